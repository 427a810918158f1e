"""``hopf``: the values of a parameter at which the verdict on steady sliding changes."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from itertools import combinations, pairwise
from typing import Any

import numpy as np

from wedgebrake.analysis.linear_stability.equilibrium import CornerError
from wedgebrake.analysis.linear_stability.machine_stability import (
    SlidingCase,
    Stability,
    check_sticking,
    machine_stability,
    sliding_speeds,
)
from wedgebrake.analysis.linear_stability.modes import Mode
from wedgebrake.analysis.linear_stability.sliding_contact import CURVE, Method, check_method
from wedgebrake.analysis.linear_stability.steady_sliding import steady_sliding
from wedgebrake.analysis.linear_stability.verdict_changes import (
    DIVERGENCE,
    FLIP,
    HOPF,
    NOUNS,
    At,
    Located,
    boundary,
    changes_between,
    growth,
    meeting,
    pattern,
    verdict_of,
)
from wedgebrake.arrays import FloatArray
from wedgebrake.errors import InputError
from wedgebrake.model.display import Result
from wedgebrake.model.machine import Machine
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.model.validation import check_instance, check_number, wrong

BALANCE = "balance"
"""Speeds of steady sliding by the balance of torques."""
# Order in which kinds of limits are returned; others follow.
_RANKS = {HOPF: 0, DIVERGENCE: 1, FLIP: 1}
# Steps of the scan of the interval.
_STEPS = 64
# Distance of limits from a fold of steady sliding, as a share of the interval, that is rounding.
_SAME = 1e-9
# Tolerance of the place of an extreme of the growth rate, as a share of a step.
_EXTREME = 1e-6


@dataclass(frozen=True, repr=False)
class StabilityLimit(Result):
    """A value of a parameter at which the linear verdict on steady sliding changes.

    parameter    : its name
    value        : of the parameter at the limit, in its unit
    kind         : "hopf" if the critical mode oscillates, "divergence" if it does not, "flip" if it
                   alternates from sample to sample; "self-locking" where a brake
                   begins to lock itself, "release" and "force limit" where an actuation force
                   begins to be held by the release or a limit, "reversal" where the direction of
                   sliding changes
    below, above : "stable", "unstable" or "neutral" on both sides of the value; "locked" where a
                   brake locks itself, "released" and "limited" where the force is held, "none"
                   where two answers of ``wb.steady_sliding`` have met and vanished
    frequency    : of the critical mode [Hz]; 0 if it does not oscillate
    growth_rate  : of the critical mode at the value [1/s], about 0 if ``continuous``
    continuous   : False if the growth rate jumps across 0, for example where an actuator is
                   released; then ``growth_rate`` is the value on the less stable side
    mode         : the critical mode
    case         : the case of sliding that it belongs to, with all its modes
    system       : the system at the limit
    machine      : its machine, whose initial speeds are those of the steady sliding;
                   ``wb.continuation`` and ``wb.branches`` follow the limit cycles that begin at a
                   Hopf point
    others       : the other limits in the interval, in order from its first value
    """

    parameter: str
    value: float
    kind: str
    below: str
    above: str
    frequency: float
    growth_rate: float
    continuous: bool
    mode: Mode
    case: SlidingCase
    system: BrakedDriveline | Machine
    machine: Machine
    others: tuple[StabilityLimit, ...] = ()

    @property
    def modes(self) -> tuple[Mode, ...]:
        """All modes of the case at the limit."""
        return self.case.modes

    def as_dict(self) -> dict[str, Any]:
        """Plain values, complex numbers as [real, imaginary] pairs."""
        parts = ("mode", "case", "system", "machine")
        plain = dict(vars(self)) | {name: getattr(self, name).as_dict() for name in parts}
        return plain | {"others": [one.as_dict() for one in self.others]}

    def _headline(self) -> str:
        how = f", {self.frequency:.6g} Hz" if self.kind == HOPF else ""
        jump = "" if self.continuous else "; the growth rate jumps there"
        more = f"; {len(self.others)} more in the interval" if self.others else ""
        sides = f"; {self.below} below, {self.above} above"
        return f"{NOUNS[self.kind]} at {self.parameter} = {self.value:.9g}{how}{sides}{jump}{more}"

    def _rows(self) -> Iterator[tuple[str, Any, str]]:
        yield "value", self.value, ""
        yield "frequency", self.frequency, "Hz"
        yield "growth_rate", self.growth_rate, "1/s"
        yield "mode", self.mode, ""
        yield "case", self.case, ""
        for number, one in enumerate(self.others):
            yield f"other {number}", one, ""


def hopf(
    system: Machine | BrakedDriveline,
    parameter: str,
    *,
    between: tuple[float, float],
    speeds: Mapping[str, float] | Sequence[float] | str | None = None,
    sticking: Sequence[str] | None = None,
    method: Method = CURVE,
) -> StabilityLimit:
    """Find the values of a parameter at which the linear verdict on steady sliding changes.

    There the largest growth rate of small vibration, over all cases of sliding, crosses 0: a Hopf
    bifurcation if the critical mode oscillates, otherwise a divergence. The verdict also changes
    where a brake begins to lock itself, where an actuation force begins to be held by the release
    or a limit, and where sliding changes its direction; the ``kind`` of the limit tells which.
    Where a gap closes or a stage ends, the growth rate jumps (``continuous`` is False).
    Rotations that nothing holds or restrains do not count.

    system    : the machine or driveline
    parameter : name, as in ``replace`` of the machine or the driveline: "brake.slope"; "slope",
                "eta"
    between   : two values between which limits are sought. A pair of limits closer together than
                1/64 of the interval may be missed
    speeds    : of the inertias, as for ``wb.stability`` [rad/s]; by default the initial speeds of
                the machine with the new value. "balance": at each value those of
                ``wb.steady_sliding``; if there are several, each is followed over the parameter
    sticking  : names of contacts that stick, as for ``wb.stability``
    method    : how varying friction is linearised, as for ``wb.stability``

    Returns a ``StabilityLimit``: the Hopf point nearest to the first value; without one the nearest
    divergence, without one the nearest of the others. Its ``others`` are all other limits in the
    interval. The accuracy of the values is limited by rounding in the eigenvalues only; it is about
    1e-8 where a gap closes or a stage ends.

    Raises ``InputError`` if no limit is found, for an unknown parameter, and for what
    ``wb.stability`` and ``wb.steady_sliding`` do not accept.
    """
    check_instance("system", system, BrakedDriveline | Machine, "a BrakedDriveline or a Machine")
    ends = _interval(between)
    check_instance("parameter", parameter, str, "a name, for example 'brake.slope'")
    # Names of a machine have dots, those of a driveline have none.
    system = system.machine if "." in parameter else system
    sticks = () if sticking is None else check_sticking(system.machine, sticking)
    if isinstance(speeds, str) and speeds != BALANCE:
        raise wrong("speeds", speeds, f"speeds in rad/s, or {BALANCE!r}")

    chosen = check_method(method)

    @cache
    def machine_at(value: float) -> Machine:
        return system.replace({parameter: value}).machine

    def result(located: Located, speeds_at: _Speeds) -> StabilityLimit:
        at = system.replace({parameter: located.change.value})
        return _result(parameter, located, at, speeds_at(located.change.value))

    grid = np.linspace(*ends, _STEPS + 1).tolist()
    if isinstance(speeds, str):
        found = _of_balance(result, machine_at, grid, sticks, chosen)
    else:

        def own(value: float) -> FloatArray:
            return sliding_speeds(machine_at(value), speeds)

        at = _verdicts(machine_at, own, sticks, chosen)
        found = [result(one, own) for one in _limits(at, grid)]
    found.sort(key=lambda one: abs(one.value - ends[0]))
    if not found:
        raise _none_found(parameter, ends, machine_at, speeds, sticks, chosen)
    best = min(found, key=lambda one: _RANKS.get(one.kind, len(_RANKS)))
    return replace(best, others=tuple(one for one in found if one is not best))


_MachineAt = Callable[[float], Machine]
_Speeds = Callable[[float], FloatArray]
_Limit = Callable[[Located, _Speeds], StabilityLimit]
_Answers = Callable[[float], list[FloatArray]]


def _of_balance(
    result: _Limit, machine_at: _MachineAt, grid: list[float], sticking: tuple[str, ...],
    method: Method,
) -> list[StabilityLimit]:  # fmt: skip
    """The limits of each steady sliding by the balance of torques, and where two of them meet."""
    answers = cache(
        lambda value: [
            np.array(list(one.values()))
            for one in steady_sliding(machine_at(value), sticking, method)
        ]
    )

    def followed(arranged: _Answers, number: int) -> tuple[At, _Speeds]:
        def own(value: float) -> FloatArray:
            return arranged(value)[number]

        return _verdicts(machine_at, own, sticking, method), own

    found = []
    parts = _of_one_count(lambda value: len(answers(value)), grid)
    for values in parts:
        arranged = _arranged(answers, values)
        for number in range(len(answers(values[0]))):
            at, own = followed(arranged, number)
            found += [result(one, own) for one in _limits(at, values)]
    for before, after in pairwise(parts):
        beyond, value = sorted((before[-1], after[0]), key=lambda one: len(answers(one)))
        inside = before[0] if value == before[-1] else after[-1]
        if (len(answers(value)) - len(answers(beyond))) % 2 == 0:
            # The two nearest ones have met; the other one is unstable up to there.
            arranged = _arranged(answers, [value])
            pairs = combinations(range(len(answers(value))), 2)
            met = min(
                pairs,
                key=lambda two: np.linalg.norm(np.subtract(*(arranged(value)[i] for i in two))),
            )
            pair = [followed(arranged, number) for number in met]
            at, own = min(pair, key=lambda one: growth(one[0](inside)))
            fold = result(meeting(at, value, beyond, inside), own)
            # There a growth rate is zero up to rounding.
            reach = _SAME * abs(grid[-1] - grid[0])
            found = [one for one in found if abs(one.value - value) > reach] + [fold]
    return found


def _arranged(answers: _Answers, values: list[float]) -> _Answers:
    """Solutions at values between two folds, and beside them, in an order that follows each one."""
    known = {values[0]: answers(values[0])}

    def at(value: float) -> list[FloatArray]:
        from scipy.optimize import linear_sum_assignment

        if value not in known:
            before, here = known[min(known, key=lambda one: abs(one - value))], answers(value)
            gaps = np.array([[np.sum((b - a) ** 2) for b in here] for a in before])
            places = linear_sum_assignment(gaps.reshape(len(before), len(here)))[1]
            known[value] = [here[number] for number in places]
        return known[value]

    for value in values:
        at(value)
    return at


def _verdicts(
    machine_at: _MachineAt, speeds_at: _Speeds, sticking: tuple[str, ...], method: Method
) -> At:
    """The verdict as a function of the parameter, which is evaluated once at each value.

    None where the equilibrium is at a corner, as where a gap closes.
    """

    @cache
    def at(value: float, *, modes: bool = False) -> Stability | None:
        try:
            return machine_stability(
                machine_at(value), speeds_at(value).tolist(), sticking, method, modes=modes
            )
        except CornerError:
            return None

    return at


def _of_one_count(count: Callable[[float], int], grid: list[float]) -> list[list[float]]:
    """Parts of a scan in which a number of answers is the same, up to where it changes."""
    parts = [[grid[0]]]
    for one, other in pairwise(grid):
        while count(one) != count(other):
            same = count(one)

            def holds(value: float, same: int = same) -> bool:
                return count(value) == same

            inner, outer = boundary(holds, one, other, abs(other - one))
            parts[-1].append(inner)
            parts.append([outer])
            one = outer
        parts[-1].append(other)
    return parts


def _limits(at: At, values: list[float]) -> Iterator[Located]:
    """Changes of the verdict between values, in their order."""
    values = [value for value in values if at(value) is not None]
    cells = values
    for before, here, after in zip(values, values[1:], values[2:], strict=False):
        best = _extreme(at, before, here, after)
        if best is not None:
            cells = sorted({*cells, best}, reverse=values[-1] < values[0])
    for one, other in pairwise(cells):
        yield from (located for located in changes_between(at, one, other) if located.decides)


def _extreme(at: At, before: float, here: float, after: float) -> float | None:
    """A value beside which the growth rate is nearest to zero and reaches across; None: none."""
    from scipy.optimize import minimize_scalar

    near = [at(one) for one in (before, here, after)]
    verdicts = {verdict_of(one) for one in near if one is not None}
    if verdicts not in ({1}, {-1}) or not pattern(near[0]) == pattern(near[1]) == pattern(near[2]):
        return None
    (side,) = verdicts
    sizes = [side * growth(one) for one in near]
    if min(sizes) < sizes[1]:
        return None
    low, high = sorted((before, after))
    best = minimize_scalar(
        lambda value: side * growth(at(value)), bounds=(low, high), method="bounded",
        options={"xatol": _EXTREME * (high - low)},
    )  # fmt: skip
    return float(best.x) if best.fun <= 0.0 else None


def _interval(between: Any) -> tuple[float, float]:
    allowed = "two different numbers, for example (-60.0, 0.0)"
    if not isinstance(between, tuple | list | np.ndarray) or len(between) != 2:
        raise wrong("between", between, allowed)
    first, last = (check_number("between", one, allowed=allowed) for one in between)
    if first == last:
        raise wrong("between", between, allowed)
    return first, last


def _result(
    parameter: str, located: Located, system: BrakedDriveline | Machine, speeds: FloatArray
) -> StabilityLimit:
    """The limit for a change of the verdict."""
    change, case = located.change, located.found.critical
    assert case is not None  # noqa: S101 - of any change that was located
    assert case.growth_rate is not None  # noqa: S101
    machine = system.machine
    angles = [one.angle for one in machine.inertias]
    return StabilityLimit(
        parameter=parameter,
        **change.as_dict(),
        growth_rate=case.growth_rate,
        mode=case.modes[0],
        case=case,
        system=system,
        machine=machine.started_at(angles, speeds.tolist()),
    )


def _none_found(
    parameter: str,
    ends: tuple[float, float],
    machine_at: _MachineAt,
    speeds: Any,
    sticking: tuple[str, ...],
    method: Method,
) -> InputError:
    """The exception for an interval without a limit."""
    said = []
    for end in ends:
        machine = machine_at(end)
        balance = isinstance(speeds, str)
        answers = steady_sliding(machine, sticking, method) if balance else [speeds]
        words = [_said(machine_stability(machine, one, sticking, method)) for one in answers]
        said.append(f"{' or '.join(words) or 'does not exist (no steady sliding)'} at {end:g}")
    return InputError(
        f"between = {ends!r}: must hold a value of {parameter} at which the linear verdict"
        f" changes, but small vibration {' and '.join(said)}. Widen the interval.",
        name="between", value=ends, allowed="an interval in which the linear verdict changes",
    )  # fmt: skip


def _said(found: Stability) -> str:
    if found.critical is None:
        return "does not exist (a brake locks itself)"
    if found.critical.growth_rate == -math.inf:
        return "does not exist (nothing vibrates)"
    return f"{found.critical.state} ({found.critical.growth_rate:+.4g} 1/s)"
