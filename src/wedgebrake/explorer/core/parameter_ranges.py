"""The range of a parameter: of its slider, and of plots over it where the user set none."""

from __future__ import annotations

import math
from typing import Any, Literal

from pydantic.fields import FieldInfo

from wedgebrake.explorer.core.limits import MOST_PERIODS, MOST_SHOWN
from wedgebrake.explorer.core.state import PageState
from wedgebrake.explorer.core.values import (
    ShownValue,
    entry_of,
    groups_of,
    values_of,
    word_of,
)
from wedgebrake.figures.data.limits import round_step
from wedgebrake.model.machine_parts import OverAngle
from wedgebrake.model.signals.signals import number_of
from wedgebrake.model.validation import is_number, labels

Span = tuple[float, float]

# Of parameters whose scale is the same in every system, by their words.
_SPANS: dict[str, Span] = {
    "f": (0.2, 2.2),
    "alpha": (0.9, 1.6),
    "wrap_angle": (0.5, 10.0),
    "kinetic": (0.05, 0.6),
    "static": (0.05, 0.8),
    "decay": (0.0, 20.0),
    "steepness": (10.0, 1000.0),
    "speed": (0.01, 1.0),
    "tolerance": (1e-6, 1e-2),
    "angle": (0.1, 1.0),
    "periods": (20.0, float(MOST_PERIODS)),
    "shown": (1.0, float(MOST_SHOWN)),
    "phase": (-math.pi, math.pi),
    "ratio": (0.1, 10.0),
}
# Of the others, as multiples of the scales of the system that the page was opened with.
_SHARES: dict[str, Span] = {
    "inertia": (0.1, 10.0),
    "stiffness": (0.1, 10.0),
    "damping": (1e-4, 0.1),
    "radius": (0.25, 2.5),
    "initial_force": (0.0, 3.0),
    "slope": (-5.0 / 3.0, 1.0 / 3.0),
    "frequency": (0.13, 3.0),
    "amplitude": (0.0, 4.0),
    "drive_speed": (0.0, 2.0),
    "initial_velocity": (-2.0, 2.0),
    "initial_angle": (-4.0, 4.0),
}
# Parameters with logarithmic sliders. 0, where it is allowed, is entered as a number.
_LOGARITHMIC = frozenset(
    {"inertia", "damping", "stiffness", "steepness", "speed", "tolerance", "periods", "shown",
     "duration", "window", "lag_frequency", "ratio", "teeth", "sample_time", "filter_time"}
)  # fmt: skip
# Shortest run and shortest history given in seconds, in cycles.
_LEAST_CYCLES = 0.1
# Lists whose entries ascend.
_ASCENDING = ("gap", "limits", "angles", "speeds")
# Least distance between two of them on sliders, as a share of the largest.
_APART = 1e-3
# Factors from the example to the ends of the range, for parameters without a range above.
_DOWN, _UP = 0.2, 5.0
# If the beginning of a logarithmic range is not positive, it is the end divided by this factor.
_DECADES = 1e3
# Smaller values count as 0, larger ones as the largest.
_LEAST, _MOST = 1e-300, 1e300
# Round values stay as they are in spite of rounding errors.
_NEARLY = 1.0 - 1e-9


def span(state: PageState, name: str) -> Span:
    """The (lowest, highest) value of a parameter in plots over it, and of its slider.

    The range set by the user in ``state.view.spans``, within the allowed values; otherwise
    round numbers on the scales of the system that the page was opened with, which change with the
    value only where it lies outside.

    Raises ``InputError`` for a parameter that this machine does not have.
    """
    value = state.value(name)
    low, high = _usual(state, name)
    if name in state.view.spans:
        return _possible(state, name, state.view.spans[name], (low, high))
    wanted = extended((low, high), value, scale(state, name))
    return _possible(state, name, wanted, (low, high))


def scale(state: PageState, name: str) -> Literal["linear", "log"]:
    """Return the scale of a parameter, with equal steps or equal ratios."""
    known = values_of(state.origin or state.system).get(name)
    below = known is not None and is_number(known.value) and known.value < 0.0
    return "log" if word_of(state.system, name) in _LOGARITHMIC and not below else "linear"


def extended(usual: Span, value: Any, how: str) -> Span:
    """A span that contains a value, extended to the next of 1, 2, 5, 10, ... if necessary.

    A value that is not a number, or not above 0 on a logarithmic scale, changes nothing.
    """
    low, high = usual
    if not is_number(value) or (how == "log" and value <= 0.0):
        return usual
    return (_round(value, up=False) if value < low else low,
            _round(value, up=True) if value > high else high)  # fmt: skip


def field(state: PageState, name: str) -> FieldInfo | None:
    """The field of a parameter of the system or its run; None for groups and other names."""
    if name in values_of(state.system):
        return values_of(state.system)[name].field
    return type(state.study.run).model_fields.get(name)


def _usual(state: PageState, name: str) -> Span:
    """The span of a parameter, regardless of its value."""
    origin = state.origin or state.system
    word, groups = word_of(state.system, name), groups_of(origin)
    if word in _SPANS:
        low, high = _SPANS[word]
        if word == "ratio" and scale(state, name) == "linear":  # it reverses the direction
            low, high = -high, -low
    elif name in ("duration", "window"):
        low, high = _LEAST_CYCLES * state.cycle, MOST_PERIODS * state.cycle
        high = min(high, 10.0 * state.duration) if name == "duration" else state.duration
        low, high = _round(low, up=True), _round(high, up=True)
    elif groups and name in _SHARES:
        low, high = _scaled(name, _scales(origin)[name])
        if name == "drive_speed" and origin.driveline.drive_speed == 0.0:
            low = -high
    elif name in groups:
        low, high = _of_group(origin, name)
    else:
        low, high = _about(state, name)
    if word == "static":  # never below kinetic friction
        low = max(low, _reference(state, name))
        high = max(high, _round(1.5 * low, up=True))
    return low, high


def _about(state: PageState, name: str) -> Span:
    """About the value that the page was opened with, otherwise about the example of the field."""
    one = field(state, name)
    known = values_of(state.origin or state.system)
    size = known[name].value if name in known else 0.0
    if size == 0.0 and name in known and entry_of(state.system, name).isdecimal():
        # An entry of a list beside larger ones.
        entries = known[name].whole
        size = _round(max(map(abs, entries)), up=True)
        if size > 0.0:
            return (-size if min(entries) < 0.0 else 0.0), size
    if not is_number(size) or size == 0.0:
        size = labels(one).get("example", 1.0) if one is not None else 1.0
        size = float(size) if is_number(size) and size else 1.0
    low, high = (_DOWN, _UP) if scale(state, name) == "log" or name not in known else (0.0, 3.0)
    if word_of(state.system, name) == "slope":
        low, high = _SHARES["slope"]
        size = abs(size)
    low, high = sorted((low * size, high * size))
    return _round(low, up=False), _round(high, up=True)


def _reference(state: PageState, name: str) -> float:
    """The kinetic friction coefficient beside a static one, or the largest of a table."""
    first, dot, _ = name.rpartition(".")
    known = values_of(state.system)
    kinetic = f"{first}{dot}kinetic"
    if kinetic in known:
        return float(known[kinetic].value)
    return float(getattr(known[name].owner, "reference", 0.0))


def _scaled(name: str, size: float) -> Span:
    """The multiples of a scale that a parameter spans, as round numbers."""
    low, high = sorted(share * size for share in _SHARES[name])
    return _round(low, up=False), _round(high, up=True)


def _of_group(system: Any, name: str) -> Span:
    """The span of the slope of the force, or of the force, as that of the group."""
    scales, friction = _scales(system), system.friction.reference or 0.3
    lever = system.brake.radius * friction
    if name == "eta":
        factor = lever / (system.driveline.damping or scales["damping"] * 1e-3)
        low, high = (factor * one for one in _scaled("slope", scales["slope"]))
    else:
        size = lever * scales["initial_force"] / scales["amplitude"]
        low, high = 0.28 * size, 3.3 * size
    return float(f"{low:.2g}"), float(f"{high:.2g}")


def _scales(system: Any) -> dict[str, float]:
    """The size of each parameter that ``_SHARES`` has, above 0.

    A value of the system where it is not 0; otherwise what its other values make of it.
    """
    line, brake = system.driveline, system.brake
    natural = line.natural_frequency or 2.0 * math.pi * system.excitation.frequency
    impedance = line.inertia * natural
    force = number_of(system.actuation.initial_force) or 300.0
    drive = number_of(line.drive_speed) or 0.0
    holding = brake.radius * force * max(system.friction.reference, 0.1)
    amplitude = system.excitation.amplitude
    speed = max(amplitude / impedance, abs(drive)) or holding / impedance
    return {
        "inertia": line.inertia,
        "stiffness": line.stiffness or line.inertia * natural**2,
        "damping": impedance,
        "radius": brake.radius,
        "initial_force": force,
        "slope": force / speed,
        "frequency": natural / (2.0 * math.pi),
        "amplitude": amplitude or holding,
        "drive_speed": drive or speed,
        "initial_velocity": speed,
        "initial_angle": speed / natural,
    }


def _possible(state: PageState, name: str, wanted: Span, usual: Span) -> Span:
    """The allowed part of a span; the usual span if none of it is allowed."""
    low, high = wanted
    least, most, without = _limits(state, name)
    if low < least or (without and low <= least):
        allowed = usual[0] >= least and not (without and usual[0] == least)
        low = usual[0] if allowed and usual[0] < high else max(least, high / _DECADES)
    high = min(high, most)
    if name in values_of(state.system):
        beside = _beside(values_of(state.system)[name], entry_of(state.system, name))
        low, high = max(low, beside[0]), min(high, beside[1])
    return (low, high) if low < high else usual


def _limits(state: PageState, name: str) -> tuple[float, float, bool]:
    """(least, largest) allowed value of a parameter, and whether the least itself is excluded."""
    least, most, without = -math.inf, math.inf, False
    if word_of(state.system, name) == "static":
        return _reference(state, name), 5.0, False
    if name in ("periods", "shown"):
        return *_SPANS[name], False
    if name in ("f", "F0", "alpha") or scale(state, name) == "log":
        least, without = 0.0, True
    if name == "duration":
        return 0.0, MOST_PERIODS * state.cycle, True
    one = field(state, name)
    for limit in [] if one is None else one.metadata:
        for key in ("gt", "ge"):
            bound = getattr(limit, key, None)
            if bound is not None and bound >= least:
                without = without if bound == least else False
                least, without = float(bound), without or key == "gt"
        most = min(most, getattr(limit, "le", most))
        if hasattr(limit, "lt"):
            most = min(most, math.nextafter(limit.lt, -math.inf))
    return least, most, without


def _beside(value: ShownValue, entry: str) -> Span:
    """(least, largest) value between the entries beside it in a list that ascends."""
    owner, whole = value.owner, value.whole
    period = owner.period if isinstance(owner, OverAngle) else None
    if isinstance(owner, OverAngle) and value.word == "period":
        return (1.0 + _APART) * (owner.angles[-1] - owner.angles[0]), math.inf
    if not entry or value.word not in _ASCENDING:
        return -math.inf, math.inf
    at, apart = int(entry), _APART * max(map(abs, whole))
    around = [-math.inf, *whole, math.inf]
    if period is not None:
        around[0], around[-1] = whole[-1] - period, whole[0] + period
    return around[at] + apart, around[at + 2] - apart


def _round(value: float, *, up: bool) -> float:
    """The next of 1, 2, 5, 10, ... times a power of ten, with its sign; 0 stays."""
    size = min(abs(value), _MOST)
    if size < _LEAST:
        return 0.0
    outwards = up == (value > 0.0)
    found = round_step(_NEARLY * size) if outwards else 1.0 / round_step(_NEARLY / size)
    return math.copysign(float(f"{found:.9g}"), value)
