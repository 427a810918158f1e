"""The task of a kernel, and its answer."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wedgebrake.arrays import FloatArray
from wedgebrake.solvers.status import Status

if TYPE_CHECKING:
    from wedgebrake.solvers.machine.final_state import FinalState


@dataclass(frozen=True)
class PeriodClock:
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
    """Task of a kernel: initial state, end, and times of the samples.

    clock      : of the torque, for kernels that count periods
    start, end : (period number, time inside the period [s]), for kernels that count periods
    span       : start and end [s], for those that do not
    initial    : angle and velocity of the only inertia; None: the initial state of the machine
    times      : (k,) times at which the response is wanted [s], ascending
    until_rest : end as soon as all contacts are permanently at rest
    recorded   : period at whose multiples the states are wanted, and at events [s]; 0: at events
                 only; None: not even there
    method     : "exact" or "smooth"
    limits     : rtol, max_steps and max_events, as far as the kernel has them
    note       : appended to the message of the response; begins with a space unless empty
    stop       : (1,) ends the run at its next step when another thread sets it to True
    """

    clock: PeriodClock
    start: tuple[int, float]
    end: tuple[int, float]
    span: tuple[float, float]
    initial: FinalState | tuple[float, float] | None
    times: FloatArray
    until_rest: bool = False
    recorded: float | None = None
    method: str = "exact"
    limits: dict[str, Any] = field(default_factory=dict)
    note: str = ""
    stop: NDArray[np.bool_] = field(default_factory=lambda: np.zeros(1, dtype=np.bool_))

    def ended_at(self, end: float) -> Task:
        """The task with another end [s], without the samples after it."""
        number, rest = self.clock.split(end)
        return replace(
            self, end=(int(number), float(rest)), span=(self.span[0], end),
            times=self.times[self.times <= end],
        )  # fmt: skip

    @property
    def state(self) -> tuple[float, float]:
        """Angle [rad] and velocity [rad/s] of the only inertia at the start."""
        if isinstance(self.initial, tuple):
            return self.initial
        if self.initial is None:
            return 0.0, 0.0
        (angle,), (speed,) = self.initial.angles.values(), self.initial.speeds.values()
        return angle, speed


@dataclass(frozen=True)
class Events:
    """Events in order: time [s], ``EventKind``, number of the contact, side before and after.

    Sides are signs of the sliding speed; 0: the contact sticks. ``side``, where states at events
    are recorded, is that of the entry into a stick, else the direction of motion after the event.
    ``part``, where shafts or torques have events too, is the name of the part; their contact is -1.
    """

    time: FloatArray
    kind: NDArray[np.int8]
    contact: NDArray[np.int64]
    before: NDArray[np.int8]
    after: NDArray[np.int8]
    side: NDArray[np.int8] | None = None
    part: NDArray[np.str_] | None = None


@dataclass(frozen=True)
class Sticks:
    """Intervals of rest [s] of contacts; entry and exit: side before and after.

    Side 0: at rest from the start on, or still at rest at the end.
    """

    start: FloatArray
    end: FloatArray
    contact: NDArray[np.int64]
    entry: NDArray[np.int8]
    exit: NDArray[np.int8]


@dataclass(frozen=True)
class RecordedStates:
    """States at r times [s], of events or whole periods: angles and velocities (r, inertias)."""

    time: FloatArray
    angle: FloatArray
    velocity: FloatArray


@dataclass(frozen=True)
class Trajectory:
    """A kernel's answer for n inertias, m contacts and c controllers.

    times           : (k,) the wanted times that were reached
    angle, velocity : (k, n) [rad], [rad/s]
    brake_torque    : (k, m) of each contact against its first inertia [N m]
    force           : (k, m) actuation force [N]
    sticking        : (k, m) whether the contact is at rest
    creeps          : whether contacts never rest exactly, and stick in a band of speeds
    control, integral : (k, c) outputs of controllers and their integral parts; None without them
    at_events       : states at the events; None unless wanted
    periods, at_periods : numbers of the periods of the torque, and the states there
    status, message : how the run ended
    final           : state at the end
    at_rest         : whether all contacts are permanently at rest, if this was asked
    work            : evaluations or steps spent
    """

    times: FloatArray
    angle: FloatArray
    velocity: FloatArray
    brake_torque: FloatArray
    force: FloatArray
    sticking: NDArray[np.bool_]
    events: Events
    sticks: Sticks
    status: Status
    message: str
    final: FinalState
    control: FloatArray | None = None
    integral: FloatArray | None = None
    at_events: RecordedStates | None = None
    periods: NDArray[np.int64] | None = None
    at_periods: RecordedStates | None = None
    at_rest: bool = False
    creeps: bool = False
    work: int = 0
