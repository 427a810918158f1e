"""The class of a motion, by running it for as long as it takes.

1. Run in blocks, up to 100 000 periods (2 000 000 where it is still settling), until the
   section points repeat after n periods to 1e-9 of the motion's size: at rest, synchronous,
   nT-periodic. n may be as large as the block allows.
2. What does not repeat is followed for 100 000 more and judged by four tests (irregular),
   which have to agree; if not, once more over four times as many periods.
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from . import irregular
from .irregular import IRREGULAR, REGULAR, UNCLEAR
from .section import COMPLETED, DIVERGED, FloatArray, Section

AT_REST, SYNCHRONOUS, PERIODIC = "at rest", "synchronous", "periodic"
QUASI_PERIODIC, CHAOTIC, UNDECIDED = "quasi-periodic", "chaotic", "undecided"

RETURN = 1e-9  # of the motion's size: a repetition
HIGH_ORDER = 400  # orders above are told, but no run of some hundred periods can see them

_BLOCKS = (2_000, 4_000, 14_000, 30_000, 50_000)
_MOST = 2_000_000  # periods, for what is still settling
_RECORD = 100_000
_REST = 1e-12  # motion, as a share of the static deflection, that is rest
_CREEP = 1e-3  # the same, of a motion that still dies away
_SEPARATIONS = (1e-9, 1e-7, 1e-5)


@dataclass
class Verdict:
    """What the judge says.

    motion    : the class; "diverged" and "self-locked" are classes
    order     : periods of the torque in one of the motion, 0 where it has none
    periods   : periods simulated to find out
    exponent  : mean rate of separation of neighbours, of what does not repeat [1/s]
    error     : its standard error [1/s]
    sticks    : class of stick-slip of the final motion
    """

    motion: str
    order: int = 0
    periods: int = 0
    exponent: float | None = None
    error: float | None = None
    sticks: str = ""

    def as_dict(self) -> dict[str, Any]:
        """Plain values, rounded to what they are good for."""
        rounded = {name: float(f"{x:.4g}") for name, x in vars(self).items() if type(x) is float}
        return asdict(self) | rounded


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
            return Verdict(more.end, periods=len(states) - 1)
        size = section.size(states[-1])
        history.append(_share(section, size.span))
        if size.sticks == AT_REST or history[-1] < _REST:
            return Verdict(AT_REST, 1, len(states) - 1, sticks=AT_REST)
        order = repetition(states[-length - 1 :] / size.span)
        if order:
            return _periodic(section, states, order)
        if block < len(_BLOCKS):
            continue
        if _creeps(history):
            return Verdict(AT_REST, 1, len(states) - 1, sticks=AT_REST)
        if _grows(history):
            return Verdict(DIVERGED, periods=len(states) - 1, sticks=size.sticks)
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


def _periodic(section: Section, states: FloatArray, order: int) -> Verdict:
    """The order and the sticks of the orbit."""
    # Three times as long again: where a focus is approached with a rotation near p/q, the
    # return after q periods is within the tolerance before the return after one.
    more = section.points(states[-1], max(3 * len(states), 4 * order)).states
    span = section.size(more[-1], max(16, min(order, HIGH_ORDER))).span
    order = repetition(more / span) or order
    size = section.size(more[-1], order * math.ceil(16 / order) if order < 1000 else 1000)
    motion = SYNCHRONOUS if order == 1 else PERIODIC
    return Verdict(motion, order, len(states) - 1, sticks=size.sticks)


def _settling(scaled: FloatArray) -> bool:
    """Whether the distance of the best return changes from the first to the last fifth."""
    distance = np.max(np.abs(scaled[-1] - scaled[-2:-2002:-1]), axis=1)
    n = int(np.argmin(distance)) + 1
    step = np.sum((scaled[n:] - scaled[:-n]) ** 2, axis=1)
    fifth = len(step) // 5
    return float(np.mean(step[-fifth:])) < 0.8 * float(np.mean(step[:fifth]))


def _aperiodic(section: Section, states: FloatArray, sticks: str) -> Verdict:
    """Four tests; where they do not agree, again over a longer record."""
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
        motion, rates = _tests(section, points, span)
        if motion != UNDECIDED:
            break
    # The largest separation is there to show that the number does not hang on its size.
    small, middle, _ = rates
    error = max(small.error, middle.error, abs(small.exponent - middle.exponent))
    return Verdict(motion, 0, total, float(middle.exponent), float(error), sticks)


def _tests(
    section: Section, points: FloatArray, span: FloatArray
) -> tuple[str, list[irregular.Divergence]]:
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
    return _combined(says), rates


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
