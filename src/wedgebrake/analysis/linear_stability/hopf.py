"""``hopf``: the value of a parameter at which steady sliding gains or loses its stability."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from wedgebrake.analysis.linear_stability.machine_stability import (
    MachineStability,
    SlidingCase,
    machine_stability,
    sliding_speeds,
)
from wedgebrake.analysis.linear_stability.modes import Mode
from wedgebrake.errors import InputError
from wedgebrake.model.display import Result
from wedgebrake.model.machine import Machine
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.model.validation import check_instance, check_number, wrong

# Steps of the scans of an interval whose ends have the same verdict.
_SCANS = (8, 16, 32, 64)
# Relative tolerances of the value, at rounding level.
_XTOL, _RTOL = 1e-15, 1e-15
# Two distances of points beside a limit, as shares of the interval, and the share of the change
# across the wider pair up to which that across the narrower one shows a continuous growth rate:
# about the ratio of the distances, its root where two eigenvalues meet, and 1 at a jump.
_WIDE, _NARROW, _SHRUNK = 1e-6, 1e-8, 0.5

_Value = tuple[int, MachineStability]


@dataclass(frozen=True, repr=False, eq=False)
class StabilityLimit(Result):
    """The value of a parameter at which the linear verdict on steady sliding changes.

    parameter   : its name
    value       : of the parameter at the limit, in its unit
    kind        : "hopf" if the critical mode oscillates, else "divergence"
    frequency   : of the critical mode [Hz]; 0 for a divergence
    growth_rate : of the critical mode at the value [1/s], about 0
    continuous  : False if the growth rate jumps across 0, for example where an actuator is
                  released; then ``growth_rate`` is the value on one side
    mode        : the critical mode
    case        : the case of sliding that it belongs to, with all its modes
    machine     : the machine at the limit, whose initial speeds are those of the steady sliding;
                  ``wb.continuation`` and ``wb.branches`` follow the limit cycles that begin there
    """

    parameter: str
    value: float
    kind: str
    frequency: float
    growth_rate: float
    continuous: bool
    mode: Mode
    case: SlidingCase
    machine: Machine

    @property
    def modes(self) -> tuple[Mode, ...]:
        """All modes of the case at the limit."""
        return self.case.modes

    def as_dict(self) -> dict[str, Any]:
        """Plain values, complex numbers as [real, imaginary] pairs."""
        parts = ("mode", "case", "machine")
        return dict(vars(self)) | {name: getattr(self, name).as_dict() for name in parts}

    def _headline(self) -> str:
        what = "Hopf point" if self.kind == "hopf" else "Divergence"
        how = f", {self.frequency:.6g} Hz" if self.kind == "hopf" else ""
        jump = "" if self.continuous else "; the growth rate jumps there"
        return f"{what} at {self.parameter} = {self.value:.9g}{how}{jump}"

    def _rows(self) -> Iterator[tuple[str, Any, str]]:
        yield "value", self.value, ""
        yield "frequency", self.frequency, "Hz"
        yield "growth_rate", self.growth_rate, "1/s"
        yield "mode", self.mode, ""
        yield "case", self.case, ""


def hopf(
    system: Machine | BrakedDriveline,
    parameter: str,
    *,
    between: tuple[float, float],
    speeds: Mapping[str, float] | Sequence[float] | None = None,
) -> StabilityLimit:
    """Find the value of a parameter at which the linear verdict on steady sliding changes.

    There the largest growth rate of small vibration, over all cases of sliding, crosses 0. The
    limit is a Hopf bifurcation if the critical mode oscillates, otherwise a divergence. Rotations
    that nothing holds or restrains do not count.

    system    : the machine; a ``BrakedDriveline`` is converted to a ``Machine``
    parameter : name, as in ``replace`` of the machine or the driveline: "brake.slope"; "slope",
                "eta"
    between   : two values between which the limit is sought. If the verdict is the same at both,
                the interval is scanned and the limit nearest to the first value is returned; a
                pair of limits closer together than 1/64 of the interval may be missed
    speeds    : of the inertias, as for ``wb.stability`` [rad/s]; by default the initial speeds of
                the machine with the new value

    Returns a ``StabilityLimit``. The accuracy of its value is limited only by rounding in the
    eigenvalues.

    Raises ``InputError`` if no limit is found, for an unknown parameter, and for what
    ``wb.stability`` does not accept.
    """
    check_instance("system", system, BrakedDriveline | Machine, "a BrakedDriveline or a Machine")
    ends = _interval(between)
    check_instance("parameter", parameter, str, "a name, for example 'brake.slope'")
    # Names of the machine have dots, those of a driveline have none.
    machine = system.machine
    if isinstance(system, BrakedDriveline) and "." not in parameter:
        machine = system.varied_machine_at(0.0, 0.0)

    def at(value: float) -> _Value:
        found = machine_stability(machine.replace({parameter: value}), speeds)
        return verdict_of(found), found

    low, high = _bracket(at, parameter, ends)
    value = boundary_between(at, low, high)
    there = machine.replace({parameter: value})
    sliding = zip(machine.inertias, sliding_speeds(there, speeds).tolist(), strict=True)
    there = there.replace({f"{one.name}.speed": speed for one, speed in sliding})
    return _limit(at, parameter, value, abs(high - low), there)


def _interval(between: Any) -> tuple[float, float]:
    allowed = "two different numbers, for example (-60.0, 0.0)"
    if not isinstance(between, tuple | list | np.ndarray) or len(between) != 2:
        raise wrong("between", between, allowed)
    first, last = (check_number("between", one, allowed=allowed) for one in between)
    if first == last:
        raise wrong("between", between, allowed)
    return first, last


def verdict_of(found: MachineStability) -> int:
    """Return 1 if vibration grows, -1 if it decays, 0 if neither, 2 if no sliding exists."""
    if found.critical is None:
        return 2
    if found.stable:
        return -1
    return 1 if found.critical.state == "grows" else 0


def _bracket(
    at: Callable[[float], _Value], parameter: str, ends: tuple[float, float]
) -> tuple[float, float]:
    """Two values with different verdicts, at both of which sliding exists."""
    verdicts = {end: at(end) for end in ends}
    for count in (1, *_SCANS):
        grid = np.linspace(*ends, count + 1).tolist()
        for value in grid:
            if value not in verdicts:
                verdicts[value] = at(value)
        for one, other in pairwise(grid):
            pair = {verdicts[one][0], verdicts[other][0]}
            if len(pair) == 2 and 2 not in pair:
                return one, other
    said = " and ".join(f"{_said(verdicts[end][1])} at {end:g}" for end in ends)
    raise InputError(
        f"between = {ends!r}: must hold a value of {parameter} at which the linear verdict"
        f" changes, but small vibration {said}. Widen the interval.",
        name="between", value=ends, allowed="an interval in which the linear verdict changes",
    )  # fmt: skip


def _said(found: MachineStability) -> str:
    if found.critical is None:
        return "does not exist (a brake locks itself)"
    return f"{found.critical.state} ({found.critical.growth_rate:+.4g} 1/s)"


def boundary_between(at: Callable[[float], _Value], low: float, high: float) -> float:
    """The value between two others at which the verdict changes."""
    from scipy.optimize import brentq

    width = abs(high - low)
    before, after = at(low)[0], at(high)[0]
    if 0 not in (before, after):
        return float(brentq(_growth(at), low, high, xtol=_XTOL * width, rtol=_RTOL, maxiter=500))
    while abs(high - low) > max(_XTOL * width, _RTOL * abs(high)):
        middle = 0.5 * (low + high)
        if middle in (low, high):
            break
        low, high = (middle, high) if at(middle)[0] == before else (low, middle)
    return high if after == 0 else low


def _growth(at: Callable[[float], _Value]) -> Callable[[float], float]:
    """Largest growth rate as a function of the parameter [1/s]."""

    def growth(value: float) -> float:
        critical = at(value)[1].critical
        if critical is None or critical.growth_rate is None:
            return 1.0  # a brake locks itself: not stable
        return critical.growth_rate if np.isfinite(critical.growth_rate) else -1.0

    return growth


def _limit(
    at: Callable[[float], _Value], parameter: str, value: float, width: float, machine: Machine
) -> StabilityLimit:
    """Result for a value at which the verdict changes.

    machine : the machine at this value, part of the result
    """
    growth = _growth(at)
    wide, narrow = (
        abs(growth(value + share * width) - growth(value - share * width))
        for share in (_WIDE, _NARROW)
    )
    case = at(value)[1].critical
    if case is None or case.growth_rate is None:
        raise InputError(
            f"between: the verdict changes at {parameter} = {value:g}, where a brake locks itself,"
            " not at a limit of stability. Choose an interval in which sliding exists.",
            name="between", allowed="an interval in which sliding exists",
        )  # fmt: skip
    mode = case.modes[0]
    return StabilityLimit(
        parameter=parameter,
        value=value,
        kind="hopf" if mode.frequency > 0.0 else "divergence",
        frequency=mode.frequency,
        growth_rate=case.growth_rate,
        continuous=narrow <= _SHRUNK * wide,
        mode=mode,
        case=case,
        machine=machine,
    )
