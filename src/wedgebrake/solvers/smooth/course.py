"""A smooth motion of one inertia, continued passage by passage by the stepper."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from functools import partial
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from wedgebrake.arrays import FloatArray
from wedgebrake.dynamics.enums import Outcome
from wedgebrake.dynamics.motion_sums import empty_sums
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.solvers.log_reader import SHORTEST_STICK
from wedgebrake.solvers.machine.final_state import FinalState
from wedgebrake.solvers.machine.passage import Passage, Record
from wedgebrake.solvers.machine.problem import EVENT
from wedgebrake.solvers.machine.quantity_statistics import QuantityStatistics
from wedgebrake.solvers.smooth import assemble
from wedgebrake.solvers.smooth.accumulators import leave_band
from wedgebrake.solvers.smooth.solve import torque_at, winds_up
from wedgebrake.solvers.smooth.solve_periods import Passed, advance, advance_together, fits_lanes

if TYPE_CHECKING:
    from wedgebrake.model.friction import SmoothFriction

# Number of speeds, and of refinements about the best, in the search for a largest torque.
_SPEEDS, _ZOOMS = 200, 4
# Largest share of slip in a period that counts as rest.
_SLIP = 1e-9
_NONE = np.empty((0, 2))


class StepperCourse:
    """A run of one inertia with smooth friction, with passages as those of a ``Course``.

    line    : the inertia, driven by a sine whose phase is 0 at the beginning
    initial : angle [rad] and velocity [rad/s]
    name    : of the inertia, in the final state of a passage
    watched : (r, 2) factors of angle and velocity, not below 0, as in ``Course``
    begun   : the first passage without records, if it was computed before
    """

    limit = "max_steps"
    """The limit that its passages take as ``max_events``."""
    least_growth = math.log(1e-8)
    """A deviation that shrinks more in a period (logarithm) is rounding of another direction."""

    def __init__(
        self, line: BrakedDriveline, initial: tuple[float, float], rtol: float, *,
        name: str = "", watched: FloatArray = _NONE, begun: Passed | None = None,
    ) -> None:  # fmt: skip
        self._line, self._state, self._name, self._watched = line, initial, name, watched
        self._period = 1.0 / line.excitation.frequency
        self._given = assemble.problem(line, rtol, *initial)
        self._caught, self._begun, self._done = winds_up(line, initial[1]), begun, 0
        # On a turning shaft the spring ends every rest.
        shaft = line.driveline
        self._lasting = shaft.constant_speed == 0.0 or shaft.stiffness == 0.0

    def snapshot(self) -> Callable[[], None]:
        """Return a function that returns the run to its present state."""
        state, done = self._state, self._done

        def rewind() -> None:
            self._state, self._done = state, done

        return rewind

    @property
    def time(self) -> float:
        """The present time [s]."""
        return self._done * self._period

    @property
    def values(self) -> FloatArray:
        """The present angle [rad] and velocity [rad/s]."""
        return np.array(self._state)

    def advance(
        self, section: Any, returns: int = 0, *, duration: float = math.inf,  # noqa: ARG002
        record: Record = Record.EXTREMES, max_events: int = 100_000_000,
    ) -> Passage:  # fmt: skip
        """Continue for a number of periods, as ``Course.advance``; its events are steps."""
        first, sums = self._done, empty_sums()
        wanted = {"derivative": bool(record & Record.DERIVATIVES)}
        parts, still = [returns], 0.0
        if record & Record.EXTREMES:
            wanted["sums"] = sums
            parts = [returns - 1, 1] if returns > 1 else [returns]
        passed: list[Passed] = []
        for periods in parts:
            before = (self._done - first) * self._period
            still = _rest(sums, before)
            left = max_events - sum(one.steps for one in passed)
            passed.append(self._go(periods, left, begin=before, **wanted))
            if passed[-1].outcome != Outcome.COMPLETED:
                break
        end = (self._done - first) * self._period
        still = _rest(sums, end) - still
        if not math.isnan(sums.band_entered):
            leave_band(sums, end, SHORTEST_STICK * self._period)
        states = np.concatenate([one.points[1:] for one in passed])
        extremes = bool(record & Record.EXTREMES) and len(states) > 0
        low, high = self._extremes(sums) if extremes else np.empty((2, 0))
        details = extremes and record & Record.DETAILS == Record.DETAILS
        peak = self._largest_torque(sums) if details else math.nan
        return Passage(
            Outcome(passed[-1].outcome),
            self._period * np.arange(first + 1, self._done + 1, dtype=float),
            states, np.concatenate([one.matrices for one in passed]), low, high, np.array([peak]),
            np.array([sums.rest_time]),
            np.array([[int(sums.sticks_forward), int(sums.sticks_backward)]]),
            np.array([sums.heat]), sum(one.steps for one in passed), 0, end, np.empty(0, EVENT),
            QuantityStatistics(np.empty(0), np.empty(0)), partial(self._final, *self._state),
            resting=extremes and self._lasting and still >= self._period * (1.0 - _SLIP),
        )  # fmt: skip

    def _go(self, periods: int, steps: int, **wanted: Any) -> Passed:
        """Continue for some periods."""
        there, self._begun = self._begun, None
        if self._caught:
            point = np.array([self._state])
            return Passed(Outcome.NO_FORWARD_SOLUTION, point, self._state, 0, np.empty((0, 2, 2)))
        if there is None:
            there = advance(self._given, self._state, periods, steps, **wanted)
        self._state, self._done = there.state, self._done + len(there.points) - 1
        return there

    def _extremes(self, sums: Any) -> tuple[FloatArray, FloatArray]:
        """Extremes of the watched quantities, then of angle and velocity."""
        rows = np.vstack([self._watched, np.eye(2)])
        low = np.array([sums.least_angle, sums.least_velocity])
        high = np.array([sums.greatest_angle, sums.greatest_velocity])
        return rows @ low, rows @ high

    def _largest_torque(self, sums: Any) -> float:
        """Largest |brake torque| [N m] of a motion, of which ``sums`` has the extremes.

        The motion passes through all velocities between them, on which alone the torque depends.
        """
        friction = cast("SmoothFriction", self._line.friction)
        width = 10.0 * friction.transition / self._line.brake.radius
        drive = self._line.driveline.constant_speed
        ends = sums.least_velocity + drive, sums.greatest_velocity + drive
        for _ in range(_ZOOMS):
            speeds = np.linspace(*ends, _SPEEDS)
            # More closely spaced where the law is steep.
            speeds = np.concatenate([speeds, np.clip(np.linspace(-width, width, _SPEEDS), *ends)])
            speeds.sort()
            torque = np.abs(torque_at(self._line, speeds))
            best = int(torque.argmax())
            ends = (float(speeds[max(best - 1, 0)]), float(speeds[min(best + 1, speeds.size - 1)]))
        return float(torque[best])

    def _final(self, angle: float, velocity: float) -> FinalState:
        """The state at a return, where the torque is as at the beginning at any frequency."""
        return FinalState(0.0, {self._name: angle}, {self._name: velocity}, held=((),))


def _rest(sums: Any, now: float) -> float:
    """Time at rest until ``now`` [s]."""
    since = sums.band_entered
    return float(sums.rest_time + (0.0 if math.isnan(since) else now - since))


def transients_together(
    lines: Mapping[int, BrakedDriveline], states: Mapping[int, tuple[float, float]], periods: int,
    limits: Any,
) -> dict[int, Passed]:  # fmt: skip
    """The ends of transients that can be computed side by side, by number.

    states : angle [rad] and velocity [rad/s] at the beginning
    periods : of each transient;  limits : with ``rtol`` and ``max_steps``
    """
    given = {k: assemble.problem(one, limits.rtol, *states[k]) for k, one in lines.items()}
    given = {number: one for number, one in given.items() if fits_lanes(one)}
    if not given:
        return {}
    begin = np.array([states[number] for number in given])
    passed = advance_together(list(given.values()), begin, periods, limits.max_steps)
    return dict(zip(given, passed, strict=True))
