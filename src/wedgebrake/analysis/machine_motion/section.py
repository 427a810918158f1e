"""The returns of a motion that are counted.

The motion of a driven machine is sampled once in a period of its signals. That of a self-excited
machine returns to a section of its own: a speed crosses the middle of its range upwards.
"""

from __future__ import annotations

from wedgebrake.analysis.machine_motion.coordinates import Coordinates
from wedgebrake.errors import InputError
from wedgebrake.model.machine import Machine
from wedgebrake.solvers.machine.passage import Crossing, Every, Passage


def sampling(machine: Machine) -> Every | None:
    """The sampling of a driven machine; None for a self-excited one.

    If the signals have no common period, the longest of their periods is used.

    Raises ``InputError`` for a signal that neither repeats nor is constant.
    """
    period = machine.period
    if period == 0.0:
        return None
    if period is not None:
        return Every(period)
    lowest: list[float] = []
    for name, signal in machine.signals().items():
        frequencies = signal.frequencies()
        if frequencies is None:
            raise InputError(
                f"{name} = {type(signal).__name__}: must be constant or repeat, as the class of a"
                " motion is that of its steady state. Use wb.simulate, or a periodic signal.",
                name=name, value=signal, allowed="a constant or a signal that repeats",
            )  # fmt: skip
        lowest += frequencies
    return Every(1.0 / min(lowest))


def crossing(passage: Passage, space: Coordinates, inertia: int | None = None) -> Crossing:
    """The section of a self-excited motion: a speed crosses the middle of its range upwards.

    passage : in which the scaled coordinates are watched
    inertia : number of the inertia; None: that whose scaled speed has the largest range
    """
    ranges = (passage.high - passage.low)[space.speeds]
    speed = space.speeds.start + (int(ranges.argmax()) if inertia is None else inertia)
    level = 0.5 * float(passage.low[speed] + passage.high[speed])
    return Crossing(tuple(map(float, space.to[speed])), level)
