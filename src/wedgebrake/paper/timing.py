"""Run time of the paper's own example: the case of its figure 5, 5 s of motion."""

from __future__ import annotations

import time
from dataclasses import dataclass
from functools import cache

from wedgebrake.model.paper_machines import CORRECTED, FIGURE_5
from wedgebrake.paper.fixed_step.simulate import ode14x
from wedgebrake.solvers.simulate import simulate

SPAN = 5.0
"""Simulated time [s] (section 4)."""
SMOOTHED, COULOMB = 7.6, 15.1
"""Run times that the paper states for its two friction laws [s] (section 4)."""
# Words, solver, friction law, and the paper's time with that law.
_METHODS = (
    ("Coulomb friction, exact", simulate, "coulomb", COULOMB),
    ("smoothed friction, adaptive", simulate, "smoothed", SMOOTHED),
    ("smoothed friction, ODE14x as in the paper", ode14x, "smoothed", SMOOTHED),
    ("Coulomb friction in a narrow band, ODE14x as in the paper", ode14x, "coulomb", COULOMB),
)


@dataclass(frozen=True)
class Timing:
    """Time of one way to compute the example.

    words   : friction law and method
    seconds : the best of a few runs
    paper   : what the paper states for this friction law [s]
    """

    words: str
    seconds: float
    paper: float

    @property
    def times_faster(self) -> float:
        """How many times faster than the paper's machine and program."""
        return self.paper / self.seconds


@cache
def measure() -> tuple[Timing, ...]:
    """Measure each method, the best of four runs (the first may compile).

    Nothing else should compute meanwhile; it is measured once and kept.
    """
    found = []
    for words, solve, friction, paper in _METHODS:
        system, seconds = CORRECTED.system(FIGURE_5, friction), []
        for _ in range(4):
            begin = time.perf_counter()
            solve(system, SPAN)
            seconds.append(time.perf_counter() - begin)
        found.append(Timing(words, min(seconds), paper))
    return tuple(found)
