"""One machine run and classified, by any solver: the numbers behind ``motion`` and every sweep.

The exact solver does it in one compiled kernel (``evaluate_point``). For the others this
module runs the windows and the record, and the same functions decide (``classify``): with
smooth friction a compiled kernel gives the periods, their derivatives from the variational
equation and what they add up to; the paper's scheme gives responses, without derivatives.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wedgebrake.analysis import classify, evaluate_point
from wedgebrake.analysis.classify import Verdict, Window
from wedgebrake.analysis.energy import energy
from wedgebrake.analysis.linear_stability import sliding_damping
from wedgebrake.analysis.run_settings import Protocol
from wedgebrake.analysis.sticking import sticks
from wedgebrake.dynamics.enums import MotionClass, StickClass
from wedgebrake.dynamics.motion_sums import empty_sums
from wedgebrake.model.friction import SmoothFriction
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.solvers.log_reader import SHORTEST_STICK
from wedgebrake.solvers.simulate import simulate
from wedgebrake.solvers.smooth.accumulators import leave_band
from wedgebrake.solvers.status import Status

if TYPE_CHECKING:
    import xarray as xr

    from wedgebrake.solvers.smooth.solve_periods import Passed

FloatArray = NDArray[np.float64]
State = tuple[float, float]
Result = Any
"""A record of dtype ``evaluate_point.RESULT``."""

# Samples from which size, peak torque and power are taken, at least: in a period of the torque
# and in one of the free vibration. So many at most; below them there is no torque or power.
_SAMPLES, _OF_NATURAL, _MOST_SAMPLES = 100, 20, 100_000
# What shrinks below this share in a period is the rounding of the other direction.
_RESOLVED = 1e-8
# Number of speeds, and of refinements about the best, in the search for a largest torque.
_SPEEDS, _ZOOMS = 200, 4
# A period of which no more than this share is slip is rest; and a record.
_RESTING, _NO_SLIP = 1e-9, 1e-12


def classify_run(
    system: BrakedDriveline,
    initial: State,
    method: str,
    protocol: Protocol,
    begun: Passed | None = None,
) -> tuple[Result, FloatArray]:
    """Run a system and classify its motion.

    begun : its transient, where that was run before (smooth friction)

    Returns (result, record): a record of ``evaluate_point.RESULT`` and the recorded Poincare
    points, (n, 2): n = recorded periods + 1, or fewer where the run ended early.
    """
    if method == "exact":
        return _exactly(system, initial, protocol)
    if method == "smooth":
        return _SmoothRun(system, initial, method, protocol, begun).classified()
    return _SchemeRun(system, initial, method, protocol).classified()


def _exactly(
    system: BrakedDriveline, initial: State, protocol: Protocol
) -> tuple[Result, FloatArray]:
    from wedgebrake.analysis.batch import ROWS
    from wedgebrake.solvers.event_driven.solve import problem

    arrays = evaluate_point.arrays_for(protocol.settings, ROWS)
    results = np.empty(1, dtype=evaluate_point.RESULT)
    given = problem(system, *initial)
    begin, end = evaluate_point.evaluate(given, *initial, protocol.settings, arrays, results[0])
    return results[0], arrays.points[begin:end].copy()


class _Run:
    """A run period by period; how it goes on is the solver's (``_advance``, ``_observe``)."""

    def __init__(
        self, system: BrakedDriveline, initial: State, method: str, protocol: Protocol
    ) -> None:
        self.system, self.method, self.protocol = system, method, protocol
        self.state, self.work = initial, 0
        self.status = Status.COMPLETED
        self.points = np.array([initial], dtype=float)
        self.size = 1.0
        self.resting = False
        line = system.driveline
        # Weight of an angle in norms, and in distances: without a spring it does not matter.
        self.weight = line.natural_frequency or system.excitation.angular_frequency
        self.ruler = line.natural_frequency
        # On a turning shaft the spring ends every rest.
        self.lasting = line.drive_speed == 0.0 or line.stiffness == 0.0
        self.result: Result = np.empty(1, dtype=evaluate_point.RESULT)[0]
        evaluate_point.clear(self.result)

    def classified(self) -> tuple[Result, FloatArray]:
        """The result and the record."""
        protocol, result = self.protocol, self.result
        verdict = None
        if self.status is Status.COMPLETED and protocol.automatic:
            verdict = self._settle()
        if self.status is Status.COMPLETED and protocol.first:
            self._advance(protocol.first)
        begin = self.points.shape[0] - 1
        if self.status is Status.COMPLETED:
            self._observe(protocol.recorded)
        record = self.points[begin:]
        evaluate_point.report_end(result, self.status.outcome)
        result.events, result.transient = self.work, begin
        result.final_angle, result.final_velocity = self.state
        result.sliding_damping = sliding_damping(self.system)
        if self.status is not Status.COMPLETED:
            result.judged, result.settling = 0, math.nan
            return result, record if record.shape[0] > 1 else record[:0]
        if verdict is None:
            verdict, result.judged = self._verdict(begin), protocol.recorded
        # Beside the larger one nothing is resolved that shrinks so fast.
        if not verdict.second > 0.5 * math.log(_RESOLVED):
            verdict = verdict._replace(second=math.nan)
        evaluate_point.report(result, verdict, 1.0 / self.system.excitation.frequency)
        result.size = self.size
        self._measure(result)
        return result, record

    def _settle(self) -> Verdict | None:
        """Run windows, each twice as long as the last, until the motion has settled in one."""
        done, limit = 0, self.protocol.limit
        verdict = None
        while done < limit:
            begin, done = done, classify.next_window(done, limit)
            self._observe(done - begin)
            if self.status is not Status.COMPLETED:
                return None
            verdict = self._verdict(begin)
            self.result.judged, self.result.settling = done - begin, begin
            if verdict.order:
                self.result.settling = classify.settling_of(
                    self.points, verdict.order, done, self.ruler, self.size
                )
            if verdict.order or verdict.motion == MotionClass.AT_REST:
                break
        return verdict

    def _verdict(self, begin: int) -> Verdict:
        """Verdict on the periods from ``begin`` on."""
        points = np.ascontiguousarray(self.points[begin:])
        growth = self._growth(points.shape[0] - 1)
        largest = np.ascontiguousarray(growth[:, 0])
        area = float(largest.mean() + growth[:, 1].mean())
        resting = self.lasting and self.resting
        window = Window(points, self.ruler, self.size, largest, area, resting)
        verdict: Verdict = classify.classify(window)
        order = verdict.order
        if resting:
            order, _ = classify.order_of(points, self.ruler, self.size)
        if order == 0:
            return verdict
        first, second = self._multipliers(order)
        error = math.nan if math.isnan(first) else 0.0
        verdict = verdict._replace(largest=first / order, second=second / order, error=error)
        if not resting:
            verdict = classify.conclude(window, verdict, first, second)
        return verdict

    def _advance(self, periods: int) -> None:
        """Run on, and keep the Poincare points."""
        raise NotImplementedError

    def _observe(self, periods: int) -> None:
        """Run on with all that the verdict needs: size, rest in the last period, ..."""
        raise NotImplementedError

    def _growth(self, periods: int) -> FloatArray:
        """(periods, 2) growth of a deviation and of the one square to it (logarithms).

        nan where the solver gives no derivatives.
        """
        return np.full((periods, 2), math.nan)

    def _multipliers(self, order: int) -> tuple[float, float]:  # noqa: ARG002 - one signature
        """Logarithms of the moduli of the multipliers of the last orbit; nan: not resolved."""
        return math.nan, math.nan

    def _measure(self, result: Result) -> None:
        """Write sticks, torque and power over the record into the result."""
        raise NotImplementedError

    def _report_sticks(self, share: float, forward: float, backward: float) -> None:
        """Write the share of rest, and the numbers of sticks in the record, into the result."""
        periods, result = self.protocol.recorded, self.result
        both = int(forward > 0) + int(backward > 0)
        result.stick_class = StickClass.NON_STICK_SLIP + both
        if share >= 1.0 - _NO_SLIP:
            result.stick_class = StickClass.AT_REST
        result.stick_share = share
        result.sticks_forward, result.sticks_backward = forward / periods, backward / periods


class _SmoothRun(_Run):
    """With smooth friction, in the compiled kernel."""

    def __init__(
        self,
        system: BrakedDriveline,
        initial: State,
        method: str,
        protocol: Protocol,
        begun: Passed | None,
    ) -> None:
        from wedgebrake.solvers.smooth import assemble, solve_periods
        from wedgebrake.solvers.smooth.solve import winds_up

        super().__init__(system, initial, method, protocol)
        self.given = assemble.problem(system, protocol.rtol, *initial)
        if winds_up(system, initial[1]):
            self.status = Status.NO_FORWARD_SOLUTION
        self.advance = solve_periods.advance
        self.begun = begun
        self.length = 1.0 / system.excitation.frequency
        self.matrices = np.empty((0, 2, 2))
        self.sums = empty_sums()

    def _go(self, periods: int, sums: Any, begin: float) -> None:
        self._take(
            self.advance(
                self.given, self.state, periods, self.protocol.max_steps - self.work,
                derivative=sums is not None, sums=sums, begin=begin,
            )
        )  # fmt: skip

    def _take(self, there: Passed) -> None:
        """Go on from there."""
        self.points = np.concatenate([self.points, there.points[1:]])
        self.state, self.work = there.state, self.work + there.steps
        self.status = Status.of(there.outcome)
        self.matrices = there.matrices

    def _advance(self, periods: int) -> None:
        if self.begun is not None:
            self._take(self.begun)
        else:
            self._go(periods, None, 0.0)

    def _observe(self, periods: int) -> None:
        self.sums = empty_sums()
        before = 0.0
        if periods > 1:
            self._go(periods - 1, self.sums, 0.0)
            if self.status is not Status.COMPLETED:
                return
            before = (periods - 1) * self.length
        matrices = self.matrices
        at_rest = self._rest(before)
        self._go(1, self.sums, before)
        if periods > 1:
            self.matrices = np.concatenate([matrices, self.matrices])
        end = periods * self.length
        self.resting = self._rest(end) - at_rest >= self.length * (1.0 - _RESTING)
        sums = self.sums
        if not math.isnan(sums.band_entered):
            leave_band(sums, end, SHORTEST_STICK * self.length)
        width = self.ruler * (sums.greatest_angle - sums.least_angle)
        width += sums.greatest_velocity - sums.least_velocity
        self.size = float(max(0.5 * width, 1e-300))

    def _rest(self, now: float) -> float:
        """Time at rest so far [s]."""
        since = self.sums.band_entered
        lasting = 0.0 if math.isnan(since) else now - since
        return float(self.sums.rest_time + lasting)

    def _derivatives(self) -> FloatArray:
        """(periods, 2, 2) derivatives over each period, of weighted angle and velocity."""
        scale = np.array([self.weight, 1.0])
        return np.asarray(self.matrices * scale[:, None] / scale)

    def _growth(self, periods: int) -> FloatArray:
        growth = np.empty((periods, 2))
        frame = np.array([[1.0, -1.0], [1.0, 1.0]]) / math.sqrt(2.0)
        for k, derivative in enumerate(self._derivatives()):
            triangle: FloatArray
            frame, triangle = np.linalg.qr(derivative @ frame)
            growth[k] = np.log(np.maximum(np.abs(np.diag(triangle)), _RESOLVED))
        return growth

    def _multipliers(self, order: int) -> tuple[float, float]:
        whole = np.eye(2)
        for derivative in self._derivatives()[-order:]:
            whole = derivative @ whole
        first, second = np.sort(np.abs(np.linalg.eigvals(whole)))[::-1]
        resolved = second > _RESOLVED * np.linalg.norm(whole)
        return math.log(max(first, 1e-300)), math.log(second) if resolved else math.nan

    def _measure(self, result: Result) -> None:
        sums, time = self.sums, self.protocol.recorded * self.length
        share = min(1.0, sums.rest_time / time)
        self._report_sticks(share, sums.sticks_forward, sums.sticks_backward)
        drive_speed = self.system.driveline.drive_speed
        low, high = sums.least_velocity + drive_speed, sums.greatest_velocity + drive_speed
        result.peak_torque = _largest_torque(self.system, low, high)
        result.friction_power = sums.heat / time


class _SchemeRun(_Run):
    """By the paper's fixed-step scheme, from its responses.

    Neighbours part at the chatter of a fixed step: that is the scheme, not the motion, so that
    there are no exponents and nothing aperiodic is told apart.
    """

    def __init__(
        self, system: BrakedDriveline, initial: State, method: str, protocol: Protocol
    ) -> None:
        super().__init__(system, initial, method, protocol)
        self.response: xr.Dataset | None = None
        line = system.driveline
        slow = line.natural_frequency / system.excitation.angular_frequency
        self.samples = min(_MOST_SAMPLES, max(_SAMPLES, math.ceil(_OF_NATURAL * slow)))

    def _advance(self, periods: int) -> None:
        self._run(periods, times=())

    def _observe(self, periods: int) -> None:
        response = self._run(periods, samples_per_period=self.samples)
        if self.status is not Status.COMPLETED:
            return
        self.response = response
        end = float(response.attrs["final_time"])
        last = end - 1.0 / self.system.excitation.frequency
        self.resting = sticks(response, last).attrs["share"] >= 1.0 - _RESTING
        seen = response.isel(time=slice(-self.samples - 1, None))
        width = np.ptp(seen["velocity"].to_numpy())
        width += self.ruler * np.ptp(seen["angle"].to_numpy())
        self.size = float(max(0.5 * width, 1e-300))

    def _run(self, periods: int, **given: Any) -> xr.Dataset:
        protocol = self.protocol
        response = simulate(
            self.system, periods=periods, initial=self.state, method=self.method,
            rtol=protocol.rtol, step=protocol.step, max_steps=protocol.max_steps, **given,
        )  # fmt: skip
        passed = np.column_stack([response["poincare_angle"], response["poincare_velocity"]])
        self.points = np.concatenate([self.points, passed[1:]])
        attrs = response.attrs
        self.state = (attrs["final_angle"], attrs["final_velocity"])
        self.status, self.work = Status(attrs["status"]), self.work + int(attrs["work"])
        return response

    def _measure(self, result: Result) -> None:
        assert self.response is not None  # noqa: S101 - a completed run was observed
        stuck = sticks(self.response, 0.0).attrs
        self._report_sticks(stuck["share"], stuck["count_forward"], stuck["count_backward"])
        if self.samples < _MOST_SAMPLES:
            work = energy(self.response).attrs
            result.peak_torque = work["largest_peak_torque"]
            result.friction_power = work["mean_friction_power"]


def _largest_torque(system: BrakedDriveline, low: float, high: float) -> float:
    """Largest |brake torque| [N m] that a smooth law has between two sliding velocities.

    A motion goes through all of them, and the torque depends on nothing else.
    """
    from wedgebrake.solvers.smooth.solve import torque_at

    assert isinstance(system.friction, SmoothFriction)  # noqa: S101 - the method fits the law
    width = 10.0 * system.friction.transition / system.brake.radius
    ends = (low, high)
    for _ in range(_ZOOMS):
        speeds = np.linspace(*ends, _SPEEDS)
        # Closer where the law is steep.
        speeds = np.concatenate([speeds, np.clip(np.linspace(-width, width, _SPEEDS), *ends)])
        speeds.sort()
        torque = np.abs(torque_at(system, speeds))
        best = int(torque.argmax())
        ends = (float(speeds[max(best - 1, 0)]), float(speeds[min(best + 1, speeds.size - 1)]))
    return float(torque[best])
