"""The displayed run and plot as calls of public functions, and as a Python program."""

from __future__ import annotations

import math
from typing import Any

from wedgebrake import __all__ as _public
from wedgebrake._version import __version__
from wedgebrake.errors import InputError
from wedgebrake.explorer.core.computation import (
    DENSEST,
    density,
    evaluation_settings,
    samples_wanted,
)
from wedgebrake.explorer.core.limits import SAMPLES_PER_PERIOD
from wedgebrake.explorer.core.plots import PARAMETER_PLOTS, Call
from wedgebrake.explorer.core.state import PageState
from wedgebrake.explorer.core.values import groups_of
from wedgebrake.model.part import Part
from wedgebrake.model.signals.signals import Product, Sum

# Largest number of samples of a response.
_MOST = 400_000
# Characters of a line, and arguments of a call on one line.
_WIDTH, _MOST_LINES = 95, 5
# With a smaller share of the samples wanted the brake torque is not printed.
_FEWEST = 0.25


def run(state: PageState) -> dict[str, Any]:
    """Arguments of ``wb.simulate`` and related functions that set how a run is computed.

    Only those that differ from their defaults.
    """
    names = ("initial", "method", "rtol", "max_events", "max_steps")
    return {name: value for name, value in _chosen(state.study.run).items() if name in names}


def picture(state: PageState) -> Call:
    """The open plot as a call, with as many values as the page shows after refinement.

    Raises ``InputError`` if this machine has no such plot.
    """
    options = {**evaluation_settings(state), **run(state)}
    return PARAMETER_PLOTS[state.view.plot].call(state, options)


def shown(state: PageState) -> dict[str, str]:
    """Return the options of ``wb.plot`` for the open plot that differ from the defaults."""
    view = state.view
    chosen = {"diagram": view.quantity, "curve": view.measure}.get(view.plot)
    return {} if chosen in (None, "velocity", "angle_amplitude") else {"quantity": str(chosen)}


def _chosen(part: Part) -> dict[str, Any]:
    """Values of a part other than their defaults, which may follow other values."""
    values = dict(part)
    return {
        name: values[name]
        for name, field in type(part).model_fields.items()
        if field.is_required()
        or values[name] != field.get_default(call_default_factory=True, validated_data=values)
    }


def samples(state: PageState) -> int:
    """Samples of the response in a cycle."""
    if not state.counted:
        return density(state)
    wanted = math.ceil(samples_wanted(state))
    return max(SAMPLES_PER_PERIOD, min(wanted, DENSEST, _MOST // state.periods))


def length(state: PageState) -> dict[str, Any]:
    """Arguments of ``wb.simulate`` that set length, beginning and samples of the run."""
    begin = state.study.run.start_time
    more = {"start_time": begin} if begin else {}
    if state.counted:
        return {"periods": state.periods, "samples_per_period": samples(state), **more}
    until = state.study.run.until
    return {"duration": state.duration, **more, **({"until": until} if until else {})}


def snippet(state: PageState) -> str:
    """A Python program that computes and draws the displayed results.

    It contains the system in SI values, the response, its class, the stability verdict, the
    brake torque, and the open plot; all numbers are exact.

    Raises ``InputError`` for a part that is not from wedgebrake.
    """
    parts = [_machine(state), _motion(state), _picture(state)]
    numpy = "import numpy as np\n\n" if "np." in parts[-1] else ""
    return "\n".join([_heading(state), f"{numpy}import wedgebrake as wb\n", *parts])


def _heading(state: PageState) -> str:
    groups = groups_of(state.system).items()
    said = ", ".join(f"{name} = {value!r}" for name, value in groups if value is not None)
    what = f"Its groups: {said}.\n" if said else ""
    kind = "A braked driveline" if said else state.system._headline()
    blank = "\n" if what else ""
    return f'"""{kind} as the explorer of wedgebrake {__version__} showed it.\n{blank}{what}"""\n'


def _machine(state: PageState) -> str:
    system = state.system
    kind = type(system).__name__
    lines = [f"{name}={_code(value, name)}," for name, value in dict(system).items()]
    return _call(f"system = wb.{kind}", lines)


def _code(value: Any, name: str) -> str:
    """The expression that makes a value of a system."""
    if isinstance(value, Part):
        kind = type(value).__name__
        if isinstance(value, Sum | Product):
            sign = " + " if isinstance(value, Sum) else " * "
            return f"({sign.join(_code(one, name) for one in value.signals)})"
        if kind not in _public:
            raise InputError.of(
                name, kind, "is not part of wedgebrake, so no program of its public names can build"
                " it. Save the study instead, and load it where the part is known.", said=kind,
            )  # fmt: skip
        values = ", ".join(f"{key}={_code(one, name)}" for key, one in _chosen(value).items())
        return f"wb.{kind}({values})"
    if isinstance(value, tuple) and any(isinstance(one, Part) for one in value):
        return f"[{', '.join(_code(one, name) for one in value)}]"
    return repr(value)


def _motion(state: PageState) -> str:
    options = run(state)
    simulated = {**length(state), **options}
    text = _call("response = wb.simulate", ["system,", *_lines(simulated)])
    verdict = ""
    if state.system.machine.period is not None:
        text += _call("motion = wb.motion", _motion_lines(state, options))
        verdict = ", verdict=motion.verdict" if state.counted else ""
    text += 'print(response.attrs["message"])\n'
    if state.system.machine.period is not None:
        text += "print(motion.verdict)\n"
    text += "print(wb.stability(system).verdict)\n"
    if not state.counted:
        text += "print(wb.contact_summary(response))\n" if state.contact else ""
    elif samples(state) >= _FEWEST * samples_wanted(state):
        begin = state.study.run.start_time
        settled = f"{state.transient} / system.excitation.frequency"
        start = f"{begin!r} + {settled}" if begin else settled
        text += (
            'if response.attrs["status"] == "completed":\n'
            f"    print(wb.brake_torque(response, start={start}))\n"
        )
    return text + f'wb.plot(response{verdict}).savefig("response.png", dpi=200)\n'


def _motion_lines(state: PageState, options: dict[str, Any]) -> list[str]:
    lines = ["system,", *_lines({**evaluation_settings(state), **options})]
    if not state.counted:  # continued from the end of the run
        return [*lines, "initial=wb.final_state(response),"]
    if state.study.run.start_time:
        # Motions begin at t = 0: from the first whole period of the torque on.
        first = ", ".join(f"float(response.poincare_{name}[0])" for name in ("angle", "velocity"))
        lines = [line for line in lines if not line.startswith("initial=")]
        lines.append(f"initial=({first}),")
    return lines


def _picture(state: PageState) -> str:
    try:
        call = picture(state)
    except InputError as error:
        return f"# No picture: {error}\n"
    numbers = [one[2] for one in call.axes.values()]
    given = numbers[0] if len(numbers) == 1 else tuple(numbers)
    text = f"points = {given!r}\n" if all(numbers) else ""
    swept, dotted = {}, any("." in name for name in call.axes)
    for place, (name, (first, last, count, how)) in enumerate(call.axes.items()):
        spread = "geomspace" if how == "log" else "linspace"
        number = "points" if len(numbers) == 1 else f"points[{place}]"
        ends = f"{first!r}, {last!r}"
        swept[name] = f"np.{spread}({ends}, {number})" if count else f"({ends})"
    if dotted:
        lines = [f"system, {{{', '.join(f'{name!r}: {one}' for name, one in swept.items())}}},"]
    else:
        lines = ["system,", *(f"{name}={one}," for name, one in swept.items())]
    text += _call(f"picture = wb.{call.function}", [*lines, *_lines(call.options)])
    quantity = "".join(f', {name}="{one}"' for name, one in shown(state).items())
    return text + f'wb.plot(picture{quantity}).savefig("{state.view.plot}.png", dpi=200)\n'


def _call(what: str, lines: list[str]) -> str:
    short = f"{what}({' '.join(lines).removesuffix(',')})\n"
    if len(short) <= _WIDTH and len(lines) < _MOST_LINES:
        return short
    return "".join([f"{what}(\n", *(f"    {line}\n" for line in lines), ")\n"])


def _lines(values: dict[str, Any]) -> list[str]:
    return [f"{name}={value!r}," for name, value in values.items()]
