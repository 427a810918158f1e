"""Run and classification of one inertia by its own kernels, closed form and stepper.

The closed form does it in one compiled kernel (``evaluate_point``). With smooth friction this
module runs the windows and the record, and uses the same functions (``classify``): a compiled
kernel gives the periods, their derivatives from the variational equation and their sums.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from wedgebrake.analysis import classify, settling
from wedgebrake.analysis.classify import Verdict, Window
from wedgebrake.analysis.driveline_motion import driveline_passage, evaluate_point
from wedgebrake.analysis.driveline_motion.evaluate_point import report, report_sums
from wedgebrake.analysis.growth import distance_to_orbit, growths, log_multipliers
from wedgebrake.analysis.run_settings import Protocol
from wedgebrake.analysis.settling import Judgement
from wedgebrake.arrays import FloatArray
from wedgebrake.dynamics.motion_sums import empty_sums
from wedgebrake.model.friction import SmoothFriction
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.solvers.log_reader import SHORTEST_STICK
from wedgebrake.solvers.smooth.accumulators import leave_band
from wedgebrake.solvers.status import Status

if TYPE_CHECKING:
    from wedgebrake.solvers.smooth.solve_periods import Passed

State = tuple[float, float]
Result = Any
"""A record of dtype ``evaluate_point.RESULT``."""

# A deviation that shrinks below this share in a period is rounding of the other direction.
_RESOLVED = 1e-8
# Number of speeds, and of refinements about the best, in the search for a largest torque.
_SPEEDS, _ZOOMS = 200, 4
# Largest share of slip in a period, or a record, that counts as rest.
_RESTING, _NO_SLIP = 1e-9, 1e-12


def classify_driveline(
    system: BrakedDriveline,
    initial: State,
    method: str,
    protocol: Protocol,
    begun: Passed | None = None,
) -> tuple[Result, FloatArray]:
    """Run a system and classify its motion.

    begun : its transient, if it was run before (smooth friction)

    Returns (result, record): a record of ``evaluate_point.RESULT`` and the recorded Poincare
    points, (n, 2): n = recorded periods + 1, or fewer if the run ended early.
    """
    if method == "smooth":
        return _SmoothRun(system, initial, protocol, begun).classified()
    from wedgebrake.analysis.driveline_motion.batch import ROWS
    from wedgebrake.solvers.event_driven.solve import problem

    arrays = driveline_passage.arrays_for(protocol.settings, ROWS)
    result = evaluate_point.EMPTY.copy()[0]
    given = problem(system, *initial)
    begin, end = evaluate_point.evaluate(given, *initial, protocol.settings, arrays, result)
    return result, arrays.points[begin:end].copy()


class _SmoothRun:
    """A run with smooth friction, period by period, in the compiled kernel."""

    def __init__(
        self, system: BrakedDriveline, initial: State, protocol: Protocol, begun: Passed | None
    ) -> None:
        from wedgebrake.solvers.smooth import assemble, solve_periods
        from wedgebrake.solvers.smooth.solve import winds_up

        self.system, self.protocol = system, protocol
        self.state, self.work, self.status = initial, 0, Status.COMPLETED
        self.points = np.array([initial], dtype=float)
        self.period = 1.0 / system.excitation.frequency
        # Of the periods observed last; ``resting``: no slip in the last period.
        self.sums, self.size, self.resting = empty_sums(), 1.0, False
        # Without a spring the angle does not matter.
        self.scale = np.array([system.driveline.natural_frequency, 1.0])
        self.result: Result = evaluate_point.EMPTY.copy()[0]
        self.given = assemble.problem(system, protocol.rtol, *initial)
        if winds_up(system, initial[1]):
            self.status = Status.NO_FORWARD_SOLUTION
        self.solve, self.begun = solve_periods.advance, begun
        self.matrices = np.empty((0, 2, 2))

    def classified(self) -> tuple[Result, FloatArray]:
        """The result and the record."""
        protocol, result, verdict = self.protocol, self.result, classify.UNKNOWN
        if protocol.automatic:
            verdict = self._settle()
        elif self.status is Status.COMPLETED and protocol.first:
            self._go(protocol.first)
        begin = self.points.shape[0] - 1
        if self.status is Status.COMPLETED:
            self.observe(protocol.recorded)
        record = self.points[begin:]
        result.events, result.transient = self.work, begin
        result.final_angle, result.final_velocity = self.state
        completed = self.status is Status.COMPLETED
        if completed and not protocol.automatic:
            verdict, result.judged = self._judgement(begin).verdict, protocol.recorded
        # A multiplier that is so much smaller than the other is not resolved.
        if not verdict.second > 0.5 * math.log(_RESOLVED):
            verdict = verdict._replace(second=math.nan)
        report(result, self.status.outcome, verdict, self.period)
        if not completed:
            return result, record if record.shape[0] > 1 else record[:0]
        self.complete_sums()
        slipless = self.sums.rest_time >= (1.0 - _NO_SLIP) * protocol.recorded * self.period
        report_sums(result, self.sums, protocol.recorded, self.period, slipless)
        result.size = self.size
        return result, record

    def _settle(self) -> Verdict:
        """Run windows, each as long as all before it, until the motion has settled."""
        verdict, done, limit = classify.UNKNOWN, 0, self.protocol.limit
        approach = settling.NO_APPROACH
        while done < limit and self.status is Status.COMPLETED:
            begin = done
            done = settling.next_window(begin, limit, settling.FIRST_WINDOW, approach.waits)
            self.observe(done - begin)
            if self.status is not Status.COMPLETED:
                break
            verdict, final, approach = self._judgement(begin)
            self.result.judged, self.result.settling = done - begin, begin
            if verdict.order:
                self.result.settling = settling.settling_of(
                    self.points, verdict.order, self.scale, self.size
                )
            if final:
                break
        return verdict

    def _judgement(self, begin: int) -> Judgement:
        """The judgement on the periods from ``begin`` on."""
        points = np.ascontiguousarray(self.points[begin:])
        growth = np.maximum(growths(self._derivatives()), math.log(_RESOLVED))
        largest = np.ascontiguousarray(growth[:, 0])
        area = float(largest.mean() + growth[:, 1].mean())
        line = self.system.driveline
        # On a turning shaft the spring ends every rest.
        resting = self.resting and (line.drive_speed == 0.0 or line.stiffness == 0.0)
        window = Window(points, self.scale, self.size, largest, area, resting)
        verdict: Verdict = classify.classify(window)
        order = verdict.order
        if resting:
            order, _ = classify.order_of(points, self.scale, self.size)
        if order == 0:
            return cast("Judgement", settling.judge(window, verdict))
        matrices = self._derivatives()[-order:]
        first, second = map(float, log_multipliers(matrices))  # nan: not resolved
        error = math.nan if math.isnan(first) else 0.0
        verdict = verdict._replace(largest=first / order, second=second / order, error=error)
        if not resting:
            change = self._coordinates * (points[-1] - points[-1 - order])
            apart = distance_to_orbit(matrices, change)
            verdict = classify.conclude(window, verdict, first, second, apart)
        return cast("Judgement", settling.judge(window, verdict))

    def _go(self, periods: int, sums: Any = None, begin: float = 0.0) -> None:
        there, self.begun = self.begun, None
        if there is None:
            there = self.solve(
                self.given, self.state, periods, self.protocol.max_steps - self.work,
                derivative=sums is not None, sums=sums, begin=begin,
            )  # fmt: skip
        self.points = np.concatenate([self.points, there.points[1:]])
        self.state, self.work = there.state, self.work + there.steps
        self.status = Status.of(there.outcome)
        self.matrices = np.concatenate([self.matrices, there.matrices])

    def observe(self, periods: int) -> None:
        """Continue the run with all inputs of the verdict: sums, size, rest in the last period."""
        self.sums, self.matrices = empty_sums(), np.empty((0, 2, 2))
        before, end = (periods - 1) * self.period, periods * self.period
        if periods > 1:
            self._go(periods - 1, self.sums)
            if self.status is not Status.COMPLETED:
                return
        at_rest = self._rest(before)
        self._go(1, self.sums, before)
        self.resting = self._rest(end) - at_rest >= self.period * (1.0 - _RESTING)
        if not math.isnan(self.sums.band_entered):
            leave_band(self.sums, end, SHORTEST_STICK * self.period)
        self.size = max(driveline_passage.size_of(self.sums, self.scale), 1e-300)

    def _rest(self, now: float) -> float:
        """Time at rest so far [s]."""
        since = self.sums.band_entered
        lasting = 0.0 if math.isnan(since) else now - since
        return float(self.sums.rest_time + lasting)

    def _derivatives(self) -> FloatArray:
        """(periods, 2, 2) derivatives over each period, of scaled angle and velocity."""
        scale = self._coordinates
        return np.asarray(self.matrices * scale[:, None] / scale)

    @property
    def _coordinates(self) -> FloatArray:
        """Factors of angle and velocity in the derivatives, also without a spring."""
        return np.array([self.scale[0] or self.system.excitation.angular_frequency, 1.0])

    def complete_sums(self) -> None:
        """Complete the sums over the record."""
        drive_speed = self.system.driveline.drive_speed
        low, high = self.sums.least_velocity, self.sums.greatest_velocity
        self.sums.peak_torque = largest_torque(self.system, low + drive_speed, high + drive_speed)


def transients_together(
    systems: Mapping[int, BrakedDriveline], states: Mapping[int, State], protocol: Protocol
) -> dict[int, Passed]:
    """The ends of transients with smooth friction that can be computed side by side, by number."""
    from wedgebrake.solvers.smooth.assemble import problem
    from wedgebrake.solvers.smooth.solve_periods import advance_together, fits_lanes

    given = {k: problem(one, protocol.rtol, *states[k]) for k, one in systems.items()}
    given = {number: one for number, one in given.items() if fits_lanes(one)}
    if not given:
        return {}
    begin = np.array([states[number] for number in given])
    passed = advance_together(list(given.values()), begin, protocol.first, protocol.max_steps)
    return dict(zip(given, passed, strict=True))


def largest_torque(system: BrakedDriveline, low: float, high: float) -> float:
    """Largest |brake torque| [N m] of a smooth law between two sliding velocities.

    A motion passes through all of them, and the torque depends on the velocity only.
    """
    from wedgebrake.solvers.smooth.solve import torque_at

    friction = cast("SmoothFriction", system.friction)
    width = 10.0 * friction.transition / system.brake.radius
    ends = (low, high)
    for _ in range(_ZOOMS):
        speeds = np.linspace(*ends, _SPEEDS)
        # More closely spaced where the law is steep.
        speeds = np.concatenate([speeds, np.clip(np.linspace(-width, width, _SPEEDS), *ends)])
        speeds.sort()
        torque = np.abs(torque_at(system, speeds))
        best = int(torque.argmax())
        ends = (float(speeds[max(best - 1, 0)]), float(speeds[min(best + 1, speeds.size - 1)]))
    return float(torque[best])
