"""The displayed study as a Python program."""

from __future__ import annotations

import math
import textwrap
from typing import Any

from wedgebrake import __all__ as _public
from wedgebrake._version import __version__
from wedgebrake.errors import InputError
from wedgebrake.explorer.core.calls import chosen, picture, run
from wedgebrake.explorer.core.evaluation import judging
from wedgebrake.explorer.core.limits import SAMPLES_PER_PERIOD
from wedgebrake.explorer.core.state import Desk
from wedgebrake.model.system import PARTS

# A torque slower than the free vibration is sampled by the vibration's period; but of so many
# samples a period, and of so many in all, no more.
_OF_NATURAL, _DENSEST, _MOST = 20, 2000, 400_000
_WIDTH = 95  # characters
# Below so many in a period of the free vibration, no torque of the brake is told.
_FEWEST = 5


def samples(desk: Desk) -> int:
    """Samples of the response in a period of the torque."""
    wanted = math.ceil(_OF_NATURAL * _ratio(desk))
    return max(SAMPLES_PER_PERIOD, min(wanted, _DENSEST, _MOST // desk.periods))


def _ratio(desk: Desk) -> float:
    """Natural frequency over that of the torque."""
    system = desk.system
    return system.driveline.natural_frequency / system.excitation.angular_frequency


def snippet(desk: Desk) -> str:
    """A Python program that computes what is on the screen and draws it.

    It has the machine in SI values, the response, its class, the verdict on stability, the
    torque of the brake, and the open picture; all numbers are exact.

    Raises ``InputError`` for a part that is none of wedgebrake's.
    """
    parts = [_machine(desk), _motion(desk), _picture(desk)]
    numpy = "import numpy as np\n\n" if "np." in parts[-1] else ""
    return "\n".join([_heading(desk), f"{numpy}import wedgebrake as wb\n", *parts])


def _heading(desk: Desk) -> str:
    groups = desk.system.groups.as_dict()
    said = ", ".join(f"{name}_=_{value!r}" for name, value in groups.items() if value is not None)
    return "\n".join(
        [
            f'"""A braked driveline as the explorer of wedgebrake {__version__} showed it.',
            "",
            *(line.replace("_=_", " = ") for line in textwrap.wrap(f"Its groups: {said}.", _WIDTH)),
            '"""',
            "",
        ]
    )


def _machine(desk: Desk) -> str:
    lines = []
    for name in PARTS:
        part = getattr(desk.system, name)
        kind = type(part).__name__
        if kind not in _public:
            raise InputError(
                f"{name} = {kind}: is no part of wedgebrake, so that no program of its public names"
                " can build it. Save the study instead, and load it where the part is known."
            )
        lines.append(f"{name}=wb.{kind}({_arguments(chosen(part))}),")
    return _call("system = wb.BrakedDriveline", lines)


def _motion(desk: Desk) -> str:
    options = run(desk)
    begin = desk.study.run.start_time
    simulated = {
        "periods": desk.periods,
        "samples_per_period": samples(desk),
        **options,
        **({"start_time": begin} if begin else {}),
    }
    judged = {**judging(desk), **options}
    text = _call("response = wb.simulate", ["system,", *_lines(simulated)])
    lines = ["system,", *_lines(judged)]
    if begin:  # motions begin at t = 0: from the first whole period of the torque on
        first = ", ".join(f"float(response.poincare_{name}[0])" for name in ("angle", "velocity"))
        lines = [line for line in lines if not line.startswith("initial=")]
        lines.append(f"initial=({first}),")
    text += _call("motion = wb.motion", lines)
    text += 'print(response.attrs["message"])\nprint(motion.verdict)\n'
    text += "print(wb.stability(system).verdict)\n"
    if samples(desk) >= _FEWEST * _ratio(desk):
        settled = f"{desk.transient} / system.excitation.frequency"
        start = f"{begin!r} + {settled}" if begin else settled
        text += (
            'if response.attrs["status"] == "completed":\n'
            f"    print(wb.brake_torque(response, start={start}))\n"
        )
    return text + 'wb.plot(response, verdict=motion.verdict).savefig("response.png", dpi=200)\n'


def _picture(desk: Desk) -> str:
    try:
        shown = picture(desk)
    except InputError as error:
        return (
            "\n".join(f"# {line}" for line in textwrap.wrap(f"No picture: {error}", _WIDTH)) + "\n"
        )
    numbers = [one[2] for one in shown.axes.values()]
    text = f"points = {numbers[0] if len(numbers) == 1 else tuple(numbers)!r}\n"
    lines = ["system,"]
    for place, (name, (first, last, _, how)) in enumerate(shown.axes.items()):
        spread = "geomspace" if how == "log" else "linspace"
        number = "points" if len(numbers) == 1 else f"points[{place}]"
        lines.append(f"{name}=np.{spread}({first!r}, {last!r}, {number}),")
    text += _call(f"picture = wb.{shown.function}", [*lines, *_lines(shown.options)])
    quantity = ', quantity="angle"' if _of_angle(desk) else ""
    return text + f'wb.plot(picture{quantity}).savefig("{desk.view.plate}.png", dpi=200)\n'


def _of_angle(desk: Desk) -> bool:
    return desk.view.plate == "diagram" and desk.view.quantity == "angle"


def _call(what: str, lines: list[str]) -> str:
    short = f"{what}({' '.join(lines).removesuffix(',')})\n"
    if len(short) <= _WIDTH and len(lines) < len(PARTS):
        return short
    return "".join([f"{what}(\n", *(f"    {line}\n" for line in lines), ")\n"])


def _lines(values: dict[str, Any]) -> list[str]:
    return [f"{name}={_literal(value)}," for name, value in values.items()]


def _arguments(values: dict[str, Any]) -> str:
    return ", ".join(f"{name}={_literal(value)}" for name, value in values.items())


def _literal(value: Any) -> str:
    return f'"{value}"' if isinstance(value, str) else repr(value)
