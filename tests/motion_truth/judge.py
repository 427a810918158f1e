"""The class of a motion, by running it for as long as it takes.

1. Run in blocks, up to 100 000 periods (2 000 000 where it is still settling), until the
   section points repeat after n periods to 1e-9 of the motion's size: at rest, synchronous,
   nT-periodic. n may be as large as the block allows.
2. What does not repeat is followed for 100 000 more and judged by four tests (irregular),
   which have to agree; if not, once more over four times as many periods.
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, field
from itertools import pairwise
from typing import Any

import numpy as np

from . import irregular
from .irregular import IRREGULAR, REGULAR, UNCLEAR
from .section import COMPLETED, DIVERGED, FloatArray, Section

AT_REST, SYNCHRONOUS, PERIODIC = "at rest", "synchronous", "periodic"
QUASI_PERIODIC, CHAOTIC, UNDECIDED = "quasi-periodic", "chaotic", "undecided"

RETURN = 1e-9  # of the motion's size: a repetition
SETTLED = 1e-6  # of the motion's size: near enough to the final orbit
HIGH_ORDER = 400  # orders above are told, but no run of some hundred periods can see them

_BLOCKS = (2_000, 4_000, 14_000, 30_000, 50_000)
_MOST = 2_000_000  # periods, for what is still settling
_RECORD = 100_000
_REST = 1e-12  # motion, as a share of the static deflection, that is rest
_CREEP = 1e-3  # the same, of a motion that still dies away
_LONG = 2_000  # periods of a transient that is worth a look of its own
_SEPARATIONS = (1e-9, 1e-7, 1e-5)


@dataclass
class Verdict:
    """What the judge says.

    motion    : the class; "diverged" and "self-locked" are classes
    order     : periods of the torque in one of the motion, 0 where it has none
    settled   : periods until all later section points are within 1e-6 of the final orbit
    periods   : periods simulated to find out
    exponent  : mean rate of separation of neighbours [1/s]; None where separations fell to
                rounding, so that there is no number
    error     : its standard error [1/s]
    sticks    : class of stick-slip of the final motion
    point     : (angle [rad], velocity [rad/s]) of a repeating motion, at that of its section
                points where the angle is largest
    close_to  : classes that a run of some hundred periods may take it for
    evidence  : the numbers, and reasons of "undecided"
    """

    motion: str
    order: int = 0
    settled: int | None = None
    periods: int = 0
    exponent: float | None = None
    error: float | None = None
    sticks: str = ""
    point: list[float] = field(default_factory=list)
    close_to: list[str] = field(default_factory=list)
    evidence: dict[str, Any] = field(default_factory=dict)

    def as_dict(self) -> dict[str, Any]:
        """Plain values, rounded to what they are good for."""
        return {**_rounded(asdict(self)), "point": [float(f"{x:.10g}") for x in self.point]}


def judge(system: Any, initial: tuple[float, float] = (0.0, 0.0)) -> Verdict:
    """The verdict on the motion from ``initial`` at phase zero of the torque."""
    section = Section(system, initial)
    states = np.array([initial], dtype=float)
    history: list[float] = []  # size after each block, as a share of the static deflection
    block = 0
    while True:
        length = _BLOCKS[block] if block < len(_BLOCKS) else len(states) - 1
        block += 1
        more = section.points(states[-1], length)
        states = np.concatenate([states, more.states[1:]])
        if more.end != COMPLETED:
            return Verdict(more.end, periods=len(states) - 1, close_to=[])
        size = section.size(states[-1])
        history.append(_share(section, size.span))
        if size.sticks == AT_REST or history[-1] < _REST:
            return _at_rest(section, states)
        order = repetition(states[-length - 1 :] / size.span)
        if order:
            return _periodic(section, states, order)
        if block < len(_BLOCKS):
            continue
        if _creeps(history):
            return _creeping(states, history)
        if _grows(history):
            return Verdict(
                DIVERGED, periods=len(states) - 1, sticks=size.sticks,
                evidence={"grows like time: size over deflection after each block": history},
            )  # fmt: skip
        if len(states) > _MOST or not _settling(states[-length - 1 :] / size.span):
            return _aperiodic(section, states, size.sticks)


def repetition(scaled: FloatArray) -> int:
    """The smallest n after which the last points repeat within RETURN, 0 if there is none."""
    distance = np.max(np.abs(scaled[-1] - scaled[-2::-1]), axis=1)
    for n in (np.flatnonzero(distance < RETURN) + 1).tolist():
        window = max(2 * n, 50)
        if window + n > len(scaled):
            break
        if np.max(np.abs(scaled[-window:] - scaled[-window - n : -n])) < RETURN:
            return int(n)
    return 0


def _share(section: Section, span: FloatArray) -> float:
    return float(span[0] / section.deflection) if section.deflection > 0.0 else float(span[0])


def _at_rest(section: Section, states: FloatArray) -> Verdict:
    moving = np.flatnonzero(np.any(states != states[-1], axis=1))
    settled = int(moving[-1]) + 1 if moving.size else 0
    return Verdict(AT_REST, 1, settled, len(states) - 1, sticks=AT_REST, point=states[-1].tolist())


def _creeps(history: list[float]) -> bool:
    """A motion that dies away without end: a slip in each period, smaller and smaller.

    Where the torque leaves the holding interval by e, the angle slips by about e^2, and e
    falls like 1/n.
    """
    falling = all(b < 0.8 * a for a, b in pairwise(history[1:]))
    return falling and history[-1] < _CREEP


def _grows(history: list[float]) -> bool:
    """Growth that is not exponential, and never ends: resonance without damping."""
    growing = all(b > 1.5 * a for a, b in pairwise(history))
    return growing and history[-1] > 1e3


def _creeping(states: FloatArray, history: list[float]) -> Verdict:
    return Verdict(
        AT_REST, 1, None, len(states) - 1, close_to=[SYNCHRONOUS], sticks=AT_REST,
        point=states[-1].tolist(),
        evidence={"creeps to rest: size over deflection after each block": history},
    )  # fmt: skip


def _periodic(section: Section, states: FloatArray, order: int) -> Verdict:
    """Polish the orbit, tell when it was reached, and how its neighbours come back."""
    before = len(states)
    # Three times as long again: where a focus is approached with a rotation near p/q, the
    # return after q periods is within the tolerance before the return after one.
    more = section.points(states[-1], max(3 * before, 4 * order)).states
    states = np.concatenate([states, more[1:]])
    span = section.size(states[-1], max(16, min(order, HIGH_ORDER))).span
    order = repetition(more / span) or order
    orbit, last = states[-order:], len(states) - 1
    # Point i belongs to the orbit's point with the same number modulo the order.
    phases = (np.arange(last + 1) - (last + 1 - order)) % order
    away = np.max(np.abs(states - orbit[phases]) / span, axis=1)
    far = np.flatnonzero(away > SETTLED)
    settled = int(far[-1]) + 1 if far.size else 0

    size = section.size(states[-1], order * math.ceil(16 / order) if order < 1000 else 1000)
    record = section.points(states[-1], max(2000, min(20 * order, 40_000))).states
    rate = irregular.divergence(section, record, span, 1e-7)
    far_start = section.points(states[-1] + 1e-6 * np.array([0.6, -0.8]) * span, 20_000).states
    return_time = _return_time(far_start, orbit, span)
    evidence = {
        "return": np.max(np.abs(record[-1] - record[-1 - order]) / span),
        "separations lost to rounding": rate.lost,
        "a neighbour at 1e-6 is back within 1e-9 after periods": return_time,
    }
    close_to = [QUASI_PERIODIC] if order > HIGH_ORDER else []
    if settled > _LONG:
        transient = irregular.divergence(section, states[: min(settled, 20_000)], span, 1e-7)
        evidence["exponent of the transient"] = [transient.exponent, transient.error]
        if transient.exponent > 4.0 * transient.error:
            close_to.append(CHAOTIC)
    return Verdict(
        SYNCHRONOUS if order == 1 else PERIODIC,
        order,
        settled,
        before - 1,
        None if rate.lost else rate.exponent,
        None if rate.lost else rate.error,
        size.sticks,
        orbit[np.argmax(orbit[:, 0])].tolist(),
        close_to,
        evidence,
    )


def _return_time(states: FloatArray, orbit: FloatArray, span: FloatArray) -> int | None:
    """When a disturbed motion is within RETURN of the orbit, for good; None: not in time.

    The phase may differ by whole periods of the torque: the distance is to the point of the
    orbit that follows from the last one.
    """
    last = int(np.argmin(np.max(np.abs(orbit - states[-1]) / span, axis=1)))
    phases = (np.arange(len(states)) - (len(states) - 1) + last) % len(orbit)
    far = np.flatnonzero(np.max(np.abs(states - orbit[phases]) / span, axis=1) > RETURN)
    if far.size and far[-1] == len(states) - 1:
        return None
    return int(far[-1]) + 1 if far.size else 0


def _settling(scaled: FloatArray) -> bool:
    """Whether the distance of the best return changes from the first to the last fifth."""
    distance = np.max(np.abs(scaled[-1] - scaled[-2:-2002:-1]), axis=1)
    n = int(np.argmin(distance)) + 1
    step = np.sum((scaled[n:] - scaled[:-n]) ** 2, axis=1)
    fifth = len(step) // 5
    return float(np.mean(step[-fifth:])) < 0.8 * float(np.mean(step[:fifth]))


def _aperiodic(section: Section, states: FloatArray, sticks: str) -> Verdict:
    """Four tests; where they do not agree, again over a longer record."""
    evidence: dict[str, Any] = {}
    total = len(states) - 1
    state = states[-1]
    for record in (_RECORD, 4 * _RECORD):
        points = section.points(state, record).states
        state = points[-1]
        total += record
        span = section.size(state, 256).span
        order = repetition(points / span)
        if order:
            return _periodic(section, np.concatenate([states, points[1:]]), order)
        motion, rates, evidence = _tests(section, points, span)
        if motion != UNDECIDED:
            break
    # The largest separation is there to show that the number does not hang on its size.
    small, middle, _ = rates
    error = max(small.error, middle.error, abs(small.exponent - middle.exponent))
    return Verdict(motion, 0, None, total, middle.exponent, error, sticks, evidence=evidence)


def _tests(
    section: Section, points: FloatArray, span: FloatArray
) -> tuple[str, list[irregular.Divergence], dict[str, Any]]:
    stride = irregular.bands(points)
    rates = [irregular.divergence(section, points, span, start) for start in _SEPARATIONS]
    reached = irregular.sensitivity(section, points, span, _SEPARATIONS[0])
    digits = irregular.birkhoff_digits(points, span, stride)
    correlation = irregular.zero_one(points, stride)
    says = {
        "separation": _rate_says(rates, section.period),
        "sensitivity": _word(reached, 1e-5, 1e-3),
        "averages": _word(-digits, -6.0, -5.0),
        "0-1": _word(correlation, 0.2, 0.8),
    }
    evidence = {
        "record": len(points) - 1,
        "bands": stride,
        "exponents": [[rate.separation, rate.exponent, rate.error, rate.lost] for rate in rates],
        "neighbour at 1e-9 reached": reached,
        "digits of averages": digits,
        "0-1 test": correlation,
        "says": says,
    }
    return _combined(says), rates, evidence


def _combined(says: dict[str, str]) -> str:
    """Both tests on neighbours must say the same, a third one with them, none against them.

    But for one thing: of a torus that chaos has thickened a little the 0-1 test sees the
    rotation, and not yet, over any record of ours, the diffusion under it.
    """
    first = {says["separation"], says["sensitivity"]}
    if first == {IRREGULAR} and says["averages"] == IRREGULAR:
        return CHAOTIC
    clear = [word for word in says.values() if word != UNCLEAR]
    if len(first) > 1 or UNCLEAR in first or len(clear) < 3 or len(set(clear)) > 1:
        return UNDECIDED
    return CHAOTIC if first == {IRREGULAR} else QUASI_PERIODIC


def _word(value: float, regular: float, irregular: float) -> str:
    return REGULAR if value < regular else IRREGULAR if value > irregular else UNCLEAR


def _rate_says(rates: list[irregular.Divergence], period: float) -> str:
    """Positive beyond doubt at every separation, or zero within the error at every one."""
    zero = 2e-4 / period
    if all(rate.exponent > max(4.0 * rate.error, zero) for rate in rates):
        return IRREGULAR
    if all(abs(rate.exponent) < zero for rate in rates) and not any(rate.lost for rate in rates):
        return REGULAR
    return UNCLEAR


def _rounded(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _rounded(one) for key, one in value.items()}
    if isinstance(value, list):
        return [_rounded(one) for one in value]
    if isinstance(value, float | np.floating):
        return float(f"{value:.4g}")
    return value
