"""The stroboscopic map (angle, velocity) -> (angle, velocity) one torque period later."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

import wedgebrake as wb
from wedgebrake.dynamics.enums import Outcome
from wedgebrake.dynamics.problem import Instant, State
from wedgebrake.dynamics.segment_log import empty_log
from wedgebrake.solvers.event_driven import trajectory as kernel
from wedgebrake.solvers.event_driven.solve import problem

FloatArray = NDArray[np.float64]

COMPLETED, DIVERGED, SELF_LOCKED = "completed", "diverged", "self-locked"
_ENDS = {
    Outcome.COMPLETED: COMPLETED,
    Outcome.DIVERGED: DIVERGED,
    Outcome.NO_FORWARD_SOLUTION: SELF_LOCKED,
}
_NO_LOG = empty_log(0)
_MOST_EVENTS = 10**12


class Points(NamedTuple):
    """(n+1, 2) section points, the first of them the start, and how the run ended."""

    states: FloatArray
    end: str


@dataclass(frozen=True)
class Size:
    """Extent of the motion between section points, over some periods.

    span  : (angle [rad], velocity [rad/s]), largest minus smallest
    sticks: class of stick-slip over the window
    """

    span: FloatArray
    sticks: str


class Section:
    """The map of one system. Every call starts at phase zero of the torque."""

    def __init__(self, system: wb.BrakedDriveline, initial: tuple[float, float]) -> None:
        self.system = system
        self.period = 1.0 / system.excitation.frequency
        line, torque = system.driveline, system.excitation
        stiffness = line.stiffness or line.inertia * torque.angular_frequency**2
        self.deflection = torque.amplitude / stiffness
        self._problem = problem(system, *initial)

    def points(self, state: FloatArray | tuple[float, float], periods: int) -> Points:
        """``periods`` iterates; fewer where the run ended early."""
        states = np.empty((periods + 1, 2))
        states[0] = state
        start, end = State(0, 0.0, float(state[0]), float(state[1])), Instant(periods, 0.0)
        found = kernel.run(self._problem, start, end, _MOST_EVENTS, _NO_LOG, states[1:])
        return Points(states[: found.state.period + 1], _ENDS[found.outcome])

    def size(self, state: FloatArray, periods: int = 16) -> Size:
        """Extent of the next periods, with 32 samples in each, and their sticks."""
        response = wb.simulate(
            self.system,
            periods=periods,
            initial=(float(state[0]), float(state[1])),
            samples_per_period=32,
        )
        span = np.array([np.ptp(response[name].to_numpy()) for name in ("angle", "velocity")])
        return Size(span, wb.sticks(response, start=0.0).attrs["class"])
