"""Times at which samples are taken whose times change with parameters.

For larger values of a sample time, a sample is not yet taken at its former time; for smaller values
it is taken before. There the derivatives are those of one side.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from wedgebrake.analysis.derivatives.coincidences import OneSided, matching
from wedgebrake.arrays import FloatArray
from wedgebrake.solvers.machine.tangents import TangentTask, samples_of

# Distance of times that coincide, and distance beside them, relative to 1 s and to the time.
_TOGETHER, _AWAY = 1e-12, 2.0**-44


class MovedSamples(NamedTuple):
    """Samples at times of a task that parameters move.

    first : the first of these times [s];  names : of the parameters;  one_sided : (p,) the side of
            the derivatives with respect to each parameter that moves a sample, 0 for others
    """

    first: float
    names: list[str]
    one_sided: FloatArray

    def joined(self, sides: OneSided) -> OneSided:
        """The sides of the derivatives, with those of these times."""
        if not self.names:
            return sides
        which = "larger" if self.one_sided.max() > 0.0 else "smaller"
        note = (
            f" At t = {self.first:.9g} s a sample is taken. Derivatives with respect to"
            f" {', '.join(self.names)} are there those for {which} values."
        )
        own = np.where(self.one_sided != 0.0, self.one_sided, sides.one_sided)
        return sides._replace(one_sided=own, note=sides.note + note)


def beside_samples(task: TangentTask, side: int) -> tuple[TangentTask, MovedSamples]:
    """The task with times, and an end, just beside samples that parameters move.

    side : side of the derivatives, 1 or -1
    """
    times, end = task.times.copy(), np.array(task.span[1:])
    first, one_sided = math.inf, np.zeros(len(task.parameters))
    for samples in samples_of(task):
        for number, changes in enumerate(samples.changes.T):
            moved = changes != 0.0
            taken, way = samples.times[moved], -side * np.sign(changes[moved])
            for given in (times, end):
                place, near = matching(taken, given)
                size = _TOGETHER * (1.0 + np.abs(given))
                (same,) = np.nonzero(near)
                same = same[np.abs(taken[place[same]] - given[same]) <= size[same]]
                if same.size:
                    first, one_sided[number] = min(first, float(given[same].min())), side
                    away = way[place[same]] * _AWAY * (1.0 + np.abs(given[same]))
                    given[same] = taken[place[same]] + away
    names = [one.name for one, own in zip(task.parameters, one_sided, strict=True) if own != 0.0]
    beside = task._replace(times=times, span=(task.span[0], float(end[0])))
    return beside, MovedSamples(first, names, one_sided)
