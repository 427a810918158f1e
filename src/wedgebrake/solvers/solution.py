"""The task of a solver, and its answer."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wedgebrake.arrays import FloatArray
from wedgebrake.dynamics.enums import EventKind
from wedgebrake.solvers.status import Status

EVENT_MEANINGS = {
    EventKind.STICK: "stick: slip ends in rest",
    EventKind.SLIP: "slip: rest ends",
    EventKind.REVERSAL: "reversal: the velocity changes sign without rest",
    EventKind.BREAKPOINT: "breakpoint: the torque law bends (actuation releases or engages)",
}
SIDE_FLAGS = {"flag_values": [-1, 0, 1], "flag_meanings": "backwards none forwards"}
"""Attributes of a variable that is a sign of a velocity (CF flags)."""
FLAGS: dict[str, dict[str, Any]] = {
    "sticking": {"flag_values": [0, 1], "flag_meanings": "slips sticks"},
    "event_kind": {
        "flag_values": [int(kind) for kind in EVENT_MEANINGS],
        "flag_meanings": " ".join(kind.name.lower() for kind in EVENT_MEANINGS),
    },
    **dict.fromkeys(
        ("event_side", "event_before", "event_after", "stick_entry", "stick_exit"), SIDE_FLAGS
    ),
}
"""Attributes of the coded variables of a response, by name."""


@dataclass(frozen=True)
class Clock:
    """Time as a number of torque periods and a rest, so that long runs keep their phase."""

    angular_frequency: float

    @property
    def period(self) -> float:
        """Length of a torque period [s]."""
        return 2.0 * math.pi / self.angular_frequency

    def split(self, time: FloatArray | float) -> tuple[NDArray[np.int64], FloatArray]:
        """(period numbers, times inside the period) of times [s]."""
        times = np.asarray(time, dtype=float)
        # A time that is a whole number of periods up to rounding is taken as just that.
        number = np.floor(times / self.period + 1e-12).astype(np.int64)
        return number, np.maximum(times - number * self.period, 0.0)

    def join(self, number: NDArray[np.int64] | int, rest: FloatArray | float) -> FloatArray:
        """Times [s] of period numbers and times inside the period."""
        return np.asarray(number * self.period + rest, dtype=float)


@dataclass(frozen=True)
class Task:
    """Task of a solver: initial state, end, and times of the samples.

    start, end : (period number, time inside the period [s])
    span       : start and end [s], for solvers that do not count periods
    angle, velocity : state at the start [rad], [rad/s]
    times      : (n,) times at which the response is wanted [s], ascending
    note       : appended to the message of the response; begins with a space unless empty
    stop       : (1,) ends the run at its next step when another thread sets it to True
    """

    clock: Clock
    start: tuple[int, float]
    end: tuple[int, float]
    span: tuple[float, float]
    angle: float
    velocity: float
    times: FloatArray
    note: str = ""
    stop: NDArray[np.bool_] = field(default_factory=lambda: np.zeros(1, dtype=np.bool_))


@dataclass(frozen=True)
class Events:
    """Events in order: time [s], ``EventKind``, state, and direction of motion after it."""

    time: FloatArray
    kind: NDArray[np.int8]
    angle: FloatArray
    velocity: FloatArray
    side: NDArray[np.int8]


@dataclass(frozen=True)
class Sticks:
    """Intervals of rest [s]; entry and exit side: sign of the sliding velocity before and after.

    Side 0: at rest from the start on, or still at rest at the end.
    """

    start: FloatArray
    end: FloatArray
    entry: NDArray[np.int8]
    exit: NDArray[np.int8]


@dataclass(frozen=True)
class Returns:
    """States at returns to the section: (n,) number of the return, angle and velocity."""

    period: NDArray[np.int64]
    angle: FloatArray
    velocity: FloatArray


@dataclass(frozen=True)
class Trajectory:
    """A solver's answer.

    times, angle, velocity : (n,) the wanted times that were reached, and the state there
    brake_torque           : (n,) R F_mu [N m]
    sticking               : (n,) at rest relative to the brake
    returns                : states at the returns to the section
    final                  : (time [s], angle, velocity) where the run ended
    detail                 : what the solver adds to the status sentence
    work                   : evaluations or steps spent
    """

    times: FloatArray
    angle: FloatArray
    velocity: FloatArray
    brake_torque: FloatArray
    sticking: NDArray[np.bool_]
    returns: Returns
    events: Events
    sticks: Sticks
    status: Status
    final: tuple[float, float, float]
    detail: str = ""
    work: int = 0
