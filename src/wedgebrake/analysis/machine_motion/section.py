"""Sections at which the returns of a motion are counted.

The motion of a driven machine is sampled once per period of its signals. That of a self-excited
machine is sampled whenever a speed crosses the middle of its range upwards.
"""

from __future__ import annotations

from wedgebrake.analysis.machine_motion.coordinates import Coordinates
from wedgebrake.model.machine import Machine
from wedgebrake.model.signals.signals import check_repeat
from wedgebrake.solvers.machine.passage import Crossing, Every, Passage

# Periods of the lowest natural vibration after which the section of a self-excited motion is
# chosen, and within which a return to it is expected.
FIRST_LOOK, RETURNS_WITHIN = 8.0, 4.0
# Factor by which this time grows where a motion is slow; cells of a run, and natural periods, after
# which it does not grow any more.
LONGER, MOST_CELLS, MOST_PERIODS = 4.0, 200_000, 1e12
# Cells after which a motion without a return is given up: it drifts, and digital controllers take
# many samples meanwhile.
LOST_CELLS = 500_000
# Relative size of a vibration that counts as none.
STILL = 1e-9
# Returns in the first window in which a motion is expected to settle.
FIRST_RETURNS = 16


def sampling(machine: Machine) -> Every | None:
    """Section of a driven machine; None for a self-excited one.

    If the signals have no common period, the longest of their periods is used.

    Raises ``InputError`` if a signal is neither periodic nor constant.
    """
    period = machine.period
    if period == 0.0:
        return None
    if period is not None:
        return Every(period)
    signals = machine.signals()
    check_repeat(signals)
    frequencies = [one for signal in signals.values() for one in signal.frequencies() or ()]
    return Every(1.0 / min(frequencies))


def crossing(passage: Passage, space: Coordinates, inertia: int | None = None) -> Crossing:
    """Section of a self-excited motion: a speed crosses the middle of its range upwards.

    passage : passage with the extremes of the scaled coordinates
    inertia : number of the inertia; None for the one whose scaled speed has the largest range
    """
    ranges = (passage.high - passage.low)[space.speeds]
    speed = space.speeds.start + (int(ranges.argmax()) if inertia is None else inertia)
    level = 0.5 * float(passage.low[speed] + passage.high[speed])
    return Crossing(tuple(map(float, space.to[speed])), level)
