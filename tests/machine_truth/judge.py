"""The class of the motion of a machine, by running it for as long as it takes.

1. Run in blocks, up to some 20 000 units of time, until the motion is constant, or the states at
   returns repeat to 1e-9 of the motion's size. The returns of a machine without varying signals are
   one kind of its own events; the period of a limit cycle is the time between those that repeat.
2. What does not repeat is judged by neighbouring runs, by averages of the returns, and by the 0-1
   test, which have to agree.

A self-excited motion that does not repeat is left to the same tests.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

import wedgebrake as wb
from motion_truth import irregular
from motion_truth.irregular import IRREGULAR, REGULAR
from motion_truth.judge import repetition

from .parting import parting
from .runs import COMPLETED, Block, FloatArray, Machine

_ENDS = {"diverged": "diverged", "no_forward_solution": "self-locked"}
_BLOCKS = (200, 400, 1000, 2400, 5000, 11_000)
# Range of what is constant, and of what still decays, as a share of the largest state.
_CONSTANT, _DECAYING = 1e-11, 0.9
_FEWEST = 1500
_RETURNS = 10
_RECORD = 8000


@dataclass
class Verdict:
    """What the judge says.

    motion    : the class, or "unknown"
    order     : periods of the signals in one of the motion, 0 without
    period    : of a motion that repeats [s]
    units     : of time simulated to find out
    exponent, error : rate at which neighbours part, of chaos [1/s]
    sticks    : whether a contact sticks in the final motion
    """

    motion: str
    order: int = 0
    period: float | None = None
    units: int = 0
    exponent: float | None = None
    error: float | None = None
    sticks: bool = False

    def as_dict(self) -> dict[str, Any]:
        """Plain values."""
        return asdict(self)


def judge(given: wb.Machine) -> Verdict:
    """The verdict on the motion of a machine from its initial state."""
    machine = Machine(given)
    state, done = None, 0
    for units in _BLOCKS:
        block = machine.block(state, units)
        state, done = block.final, done + units
        if block.end != COMPLETED:
            return Verdict(_ENDS.get(block.end, "unknown"), units=done)
        sticks = bool(block.sticking.any())
        if _is_constant(block):
            rest = bool(block.sticking[-1].all())
            motion = "at rest" if rest else "steady sliding"
            return Verdict(motion, units=done, sticks=sticks)
        order = _order(block)
        if order:
            # Three times as long again: a focus returns late before it returns after one.
            again = machine.block(state, max(3 * done, 200))
            order = _order(again)
            if not order or _is_constant(again):
                state = again.final
                continue
            done += 3 * done
            times = again.returns.times
            period = float(times[-1] - times[-1 - order])
            if not machine.driven:
                return Verdict("limit cycle", 0, period, done, sticks=sticks)
            motion = "synchronous" if order == 1 else "periodic"
            return Verdict(motion, order, period, done, sticks=sticks)
    return _aperiodic(machine, block, done)


def _order(block: Block) -> int:
    """Returns after which the motion repeats; 0: it does not."""
    states, _, scale = block.returns
    return repetition(states / scale) if len(states) > _RETURNS else 0


def _is_constant(block: Block) -> bool:
    """Whether nothing moves any more, or what moves decays without events."""
    samples = block.samples
    speeds = samples[:, : len(block.final.speeds)]
    size = max(float(np.abs(speeds).max()), 1e-300)
    half = len(samples) // 2
    early, late = (float(np.ptp(part, axis=0).max()) for part in (samples[:half], samples[half:]))
    largest = max(float(np.abs(samples).max()), 1e-300)
    if float(np.ptp(speeds, axis=0).max()) <= _CONSTANT * size or late <= _CONSTANT * largest:
        return True
    return not block.events and late < _DECAYING * early


def _aperiodic(machine: Machine, block: Block, done: int) -> Verdict:
    """Three tests; the verdict is unknown unless they agree."""
    sticks = bool(block.sticking.any())
    block = machine.block(block.final, _RECORD)
    done += _RECORD
    if not len(block.returns.states):
        return Verdict("unknown", units=done, sticks=sticks)
    points = _points(block.returns.states, block.returns.times)
    rate = parting(machine, block.final, block.returns.scale)
    words = {rate.says}
    if len(points) > _FEWEST:
        span = np.maximum(np.ptp(points, axis=0), 1e-300)
        stride = irregular.bands(points)
        digits = irregular.birkhoff_digits(points, span, 1)
        walk = irregular.zero_one(points, stride)
        words |= {_word(-digits, -4.0, -3.0), _word(walk, 0.2, 0.8)} - {irregular.UNCLEAR}
    else:
        return Verdict("unknown", units=done, sticks=sticks)
    if words == {IRREGULAR}:
        return Verdict("chaotic", 0, None, done, rate.exponent, rate.error, sticks)
    if words == {REGULAR}:
        return Verdict("quasi-periodic", units=done, sticks=sticks)
    return Verdict("unknown", units=done, sticks=sticks)


def _points(states: FloatArray, times: FloatArray) -> FloatArray:
    """(r, 2) two numbers of each return: the column that varies most, and the time or another.

    Of returns at events the time since the last one varies; of those at periods it does not.
    """
    spread = np.ptp(states, axis=0) / np.maximum(np.abs(states).max(axis=0), 1e-300)
    columns = states[:, np.argsort(-spread)[:2]]
    since = np.diff(times)
    if np.ptp(since) > 1e-6 * since.mean():
        return np.column_stack([columns[1:, 0], since])
    return columns if columns.shape[1] == 2 else np.column_stack([columns, columns])


def _word(value: float, regular: float, irregular_: float) -> str:
    return REGULAR if value < regular else IRREGULAR if value > irregular_ else irregular.UNCLEAR
