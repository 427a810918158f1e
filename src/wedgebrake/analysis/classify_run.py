"""One system run and judged, by any solver: the numbers behind ``motion`` and every sweep.

The exact solver does it in one compiled kernel (``evaluate_point``). With smooth friction a
compiled kernel runs the periods, with their derivatives from the variational equation, and
what they add up to; the paper's scheme is judged by its responses.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wedgebrake.analysis import accumulators, classify, evaluate_point
from wedgebrake.analysis.energy import energy
from wedgebrake.analysis.linear_stability import sliding_damping
from wedgebrake.analysis.run_settings import Protocol
from wedgebrake.analysis.sticking import sticks
from wedgebrake.dynamics import enums
from wedgebrake.model.friction import SmoothFriction
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.solvers.event_driven import trajectory
from wedgebrake.solvers.simulate import simulate
from wedgebrake.solvers.smooth import accumulators as smooth_sums
from wedgebrake.solvers.smooth.stick_band import SHORTEST_STICK
from wedgebrake.solvers.status import Status

if TYPE_CHECKING:
    import xarray as xr

    from wedgebrake.solvers.smooth.solve_periods import Passed

FloatArray = NDArray[np.float64]
State = tuple[float, float]

# Samples from which size, peak torque and power are taken, at least: in a period of the torque
# and in one of the free vibration. So many at most; below them there is no torque or power.
_SAMPLES, _OF_NATURAL, _MOST_SAMPLES = 100, 20, 100_000
# What shrinks below this share in a period is the rounding of the other direction.
_RESOLVED = 1e-8
# How a largest torque is looked for: so many speeds, closer and closer about the best.
_LOOKS, _ZOOMS = 200, 4
# A period of which no more than this share is slip is rest; and a record.
_RESTING, _NO_SLIP = 1e-9, 1e-12
_UNSETTLED = (enums.UNDECIDED, enums.QUASI_PERIODIC, enums.CHAOTIC)


def judge(
    system: BrakedDriveline,
    initial: State,
    method: str,
    protocol: Protocol,
    begun: Passed | None = None,
) -> tuple[FloatArray, FloatArray]:
    """Run a system and judge its motion.

    begun : its transient, where that was run before (smooth friction)

    Returns (answer, record): the columns of ``evaluate_point`` and the recorded Poincare
    points, (n, 2): n = recorded periods + 1, or fewer where the run ended early.
    """
    if method == "exact":
        return _exactly(system, initial, protocol)
    if method == "smooth":
        return _Smooth(system, initial, method, protocol, begun).judged()
    return _Scheme(system, initial, method, protocol).judged()


def _exactly(
    system: BrakedDriveline, initial: State, protocol: Protocol
) -> tuple[FloatArray, FloatArray]:
    from wedgebrake.solvers.event_driven.solve import problem

    transient = -1 if protocol.automatic else protocol.first
    longest = max(transient, protocol.limit if transient < 0 else 0)
    longest += protocol.recorded + classify.LONGEST + 1
    points, answer = np.empty((longest, 2)), np.empty(evaluate_point.COLUMNS)
    begin, end = evaluate_point.judge(
        tuple(problem(system, *initial)), *initial, transient, protocol.recorded,
        protocol.limit, protocol.max_events, np.empty((256, trajectory.LOG_COLUMNS)), points,
        np.empty(longest), np.zeros((2, accumulators.ENTRIES)), answer,
    )  # fmt: skip
    return answer, points[begin:end].copy()


class _Verdict(NamedTuple):
    """What the points say: class, order, return distance, growth per period and its error."""

    motion: int
    order: int
    returned: float
    mean: float
    second: float
    error: float
    judged: int = 0
    settling: float = math.nan


class _Run:
    """A run period by period; how it goes on is the solver's (``_advance``, ``_rates``)."""

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
        # What turns an angle into a velocity; without a spring the angle does not matter.
        self.weight = line.natural_frequency or system.excitation.angular_frequency
        self.ruler = line.natural_frequency
        # On a turning shaft the spring ends every rest.
        self.lasting = line.drive_speed == 0.0 or line.stiffness == 0.0

    def judged(self) -> tuple[FloatArray, FloatArray]:
        """The answer and the record."""
        protocol = self.protocol
        verdict = None
        if self.status is Status.COMPLETED:
            verdict = self._settle() if protocol.automatic else None
        if self.status is Status.COMPLETED and protocol.first:
            self._advance(protocol.first)
        begin = self.points.shape[0] - 1
        if self.status is Status.COMPLETED:
            self._look(protocol.recorded)
        record = self.points[begin:]
        answer = np.full(evaluate_point.COLUMNS, np.nan)
        answer[evaluate_point.OUTCOME], answer[evaluate_point.CLASS] = _ENDS[self.status]
        answer[evaluate_point.EVENTS] = self.work
        answer[evaluate_point.FINAL_THETA], answer[evaluate_point.FINAL_W] = self.state
        answer[evaluate_point.TRANSIENT], answer[evaluate_point.JUDGED] = begin, 0.0
        answer[evaluate_point.SLIDING_DAMPING] = sliding_damping(self.system)
        if self.status is not Status.COMPLETED:
            answer[evaluate_point.ORDER] = 0.0
            return answer, record if record.shape[0] > 1 else record[:0]
        if verdict is None:
            verdict = self._classify(begin)
            verdict = verdict._replace(judged=protocol.recorded)
        self._measure(answer)
        frequency = self.system.excitation.frequency
        answer[evaluate_point.CLASS], answer[evaluate_point.ORDER] = verdict.motion, verdict.order
        answer[evaluate_point.SIZE] = self.size
        answer[evaluate_point.RETURN_DISTANCE] = verdict.returned
        answer[evaluate_point.LARGEST_EXPONENT] = verdict.mean * frequency
        # Beside the larger one nothing is resolved that shrinks so fast.
        resolved = verdict.second > 0.5 * math.log(_RESOLVED)
        answer[evaluate_point.SECOND_EXPONENT] = (
            verdict.second * frequency if resolved else math.nan
        )
        known = math.isfinite(verdict.error)
        answer[evaluate_point.EXPONENT_ERROR] = verdict.error * frequency if known else math.nan
        answer[evaluate_point.JUDGED], answer[evaluate_point.SETTLING] = (
            verdict.judged,
            verdict.settling,
        )
        return answer, record

    def _settle(self) -> _Verdict | None:
        """Windows, each twice as long as the last, until the motion has settled in one."""
        done, limit = 0, self.protocol.limit
        verdict = None
        while done < limit:
            begin, target = done, evaluate_point.next_window(done, limit)
            self._look(target - done)
            if self.status is not Status.COMPLETED:
                return None
            verdict = self._classify(done)
            settling = float(done)
            done = target
            if verdict.order:
                settling = float(
                    evaluate_point.settling_of(
                        self.points, verdict.order, done, self.ruler, self.size
                    )
                )
            verdict = verdict._replace(judged=target - begin, settling=settling)
            if verdict.motion not in _UNSETTLED:
                break
        return verdict

    def _classify(self, begin: int) -> _Verdict:
        window = np.ascontiguousarray(self.points[begin:])
        order, _ = classify.order_of(window, self.ruler, self.size)
        growth = self._rates(window, order)
        mean, error = classify.mean_growth(np.ascontiguousarray(growth[:, 0]))
        error = 0.0 if order else error
        second = float(growth[:, 1].mean())
        class_, order, returned = classify.classify(
            window, self.ruler, self.size, np.ascontiguousarray(growth[:, 0]),
            float(mean) + second, self.lasting and self.resting,
        )  # fmt: skip
        return self._decided(
            window, _Verdict(class_, order, returned, float(mean), second, float(error))
        )

    def _advance(self, periods: int) -> None:
        """Run on, and keep the Poincare points."""
        raise NotImplementedError

    def _look(self, periods: int) -> None:
        """Run on with all that the verdict needs: size, rest in the last period, ..."""
        raise NotImplementedError

    def _rates(self, window: FloatArray, order: int) -> FloatArray:
        """(periods, 2) growth of a deviation and of the one square to it (logarithms)."""
        raise NotImplementedError

    def _decided(self, window: FloatArray, found: _Verdict) -> _Verdict:
        """The verdict that stands."""
        raise NotImplementedError

    def _measure(self, answer: FloatArray) -> None:
        """Sticks, torque and power over the record, into the answer."""
        raise NotImplementedError


class _Smooth(_Run):
    """With smooth friction, in the compiled kernel."""

    def __init__(
        self,
        system: BrakedDriveline,
        initial: State,
        method: str,
        protocol: Protocol,
        begun: Passed | None,
    ) -> None:
        from wedgebrake.solvers.smooth import solve, solve_periods

        super().__init__(system, initial, method, protocol)
        self.given = solve.problem(system, protocol.rtol, *initial)
        if solve.winds_for_ever(system, initial[1]):
            self.status = Status.NO_FORWARD_SOLUTION
        self.advance, self.no_sums = solve_periods.advance, solve_periods.no_sums
        self.begun = begun
        self.length = 1.0 / system.excitation.frequency
        self.matrices = np.empty((0, 2, 2))
        self.sums = self.no_sums()
        self.looked = 0

    def _go(self, periods: int, sums: FloatArray | None, begin: float) -> None:
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

    def _look(self, periods: int) -> None:
        self.sums, self.looked = self.no_sums(), periods
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
        if not math.isnan(self.sums[smooth_sums.SINCE]):
            smooth_sums.leave(self.sums, end, SHORTEST_STICK * self.length)
        low, high = smooth_sums.LOW_THETA, smooth_sums.HIGH_THETA
        width = self.ruler * (self.sums[high] - self.sums[low])
        width += self.sums[smooth_sums.HIGH_W] - self.sums[smooth_sums.LOW_W]
        self.size = float(max(0.5 * width, 1e-300))

    def _rest(self, now: float) -> float:
        """Time at rest so far [s]."""
        since = self.sums[smooth_sums.SINCE]
        lasting = 0.0 if math.isnan(since) else now - since
        return float(self.sums[smooth_sums.REST_TIME] + lasting)

    def _rates(self, window: FloatArray, order: int) -> FloatArray:
        """Of what repeats, the exponents of its last orbit; else those of all periods."""
        scale = np.array([self.weight, 1.0])
        derivatives = self.matrices * scale[:, None] / scale
        if order == 0:
            return _growth(derivatives)
        whole = np.eye(2)
        for derivative in derivatives[-order:]:
            whole = derivative @ whole
        first, second = np.sort(np.abs(np.linalg.eigvals(whole)))[::-1]
        resolved = second > _RESOLVED * np.linalg.norm(whole)
        rates = (math.log(max(first, 1e-300)), math.log(second) if resolved else math.nan)
        return np.tile(np.array(rates) / order, (window.shape[0] - 1, 1))

    def _decided(self, window: FloatArray, found: _Verdict) -> _Verdict:
        order, mean, returned = found.order, found.mean, found.returned
        if order and not evaluate_point.attracts(
            order * mean, returned, window, self.ruler, self.size
        ):
            return found._replace(motion=enums.UNDECIDED, order=0)
        return found

    def _measure(self, answer: FloatArray) -> None:
        sums, time = self.sums, self.looked * self.length
        forward, backward = (
            sums[smooth_sums.STICKS_FORWARD],
            sums[smooth_sums.STICKS_BACKWARD],
        )
        share = min(1.0, sums[smooth_sums.REST_TIME] / time)
        answer[evaluate_point.STICK_CLASS] = _stick_class(share, forward, backward)
        answer[evaluate_point.STICKS_FORWARD] = forward / self.looked
        answer[evaluate_point.STICKS_BACKWARD] = backward / self.looked
        answer[evaluate_point.STICK_SHARE] = share
        slow = self.system.driveline.drive_speed
        velocities = sums[smooth_sums.LOW_W] + slow, sums[smooth_sums.HIGH_W] + slow
        answer[evaluate_point.PEAK_TORQUE] = _largest_torque(self.system, *velocities)
        answer[evaluate_point.FRICTION_POWER] = sums[smooth_sums.HEAT] / time


class _Scheme(_Run):
    """By the paper's fixed-step scheme, of which the responses are looked at."""

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

    def _look(self, periods: int) -> None:
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

    def _rates(self, window: FloatArray, order: int) -> FloatArray:  # noqa: ARG002 - one signature
        return np.zeros((window.shape[0] - 1, 2))

    def _decided(self, window: FloatArray, found: _Verdict) -> _Verdict:  # noqa: ARG002
        """Neighbours part at the chatter of a fixed step: that is the scheme, not the motion."""
        aperiodic = found.motion in (enums.CHAOTIC, enums.QUASI_PERIODIC)
        class_ = enums.UNDECIDED if aperiodic else found.motion
        return found._replace(motion=class_, mean=math.nan, second=math.nan, error=math.nan)

    def _measure(self, answer: FloatArray) -> None:
        assert self.response is not None  # noqa: S101 - a completed run was looked at
        periods = self.protocol.recorded
        stuck = sticks(self.response, 0.0).attrs
        forward, backward = stuck["count_forward"], stuck["count_backward"]
        answer[evaluate_point.STICK_CLASS] = _stick_class(stuck["share"], forward, backward)
        answer[evaluate_point.STICKS_FORWARD] = forward / periods
        answer[evaluate_point.STICKS_BACKWARD] = backward / periods
        answer[evaluate_point.STICK_SHARE] = stuck["share"]
        if self.samples < _MOST_SAMPLES:
            work = energy(self.response).attrs
            answer[evaluate_point.PEAK_TORQUE] = work["largest_peak_torque"]
            answer[evaluate_point.FRICTION_POWER] = work["mean_friction_power"]


def _largest_torque(system: BrakedDriveline, low: float, high: float) -> float:
    """Largest |brake torque| [N m] that a smooth law has between two sliding velocities.

    A motion goes through all of them, and the torque depends on nothing else.
    """
    from wedgebrake.solvers.smooth.solve import torque_at

    assert isinstance(system.friction, SmoothFriction)  # noqa: S101 - the method fits the law
    width = 10.0 * system.friction.transition / system.brake.radius
    ends = (low, high)
    for _ in range(_ZOOMS):
        speeds = np.linspace(*ends, _LOOKS)
        # Closer where the law is steep.
        speeds = np.concatenate([speeds, np.clip(np.linspace(-width, width, _LOOKS), *ends)])
        speeds.sort()
        torque = np.abs(torque_at(system, speeds))
        best = int(torque.argmax())
        ends = (float(speeds[max(best - 1, 0)]), float(speeds[min(best + 1, speeds.size - 1)]))
    return float(torque[best])


def _growth(derivatives: FloatArray) -> FloatArray:
    """Growth of a deviation and of the one square to it, in each period (logarithms)."""
    frame = np.array([[1.0, -1.0], [1.0, 1.0]]) / math.sqrt(2.0)
    growth = np.empty((derivatives.shape[0], 2))
    for k, derivative in enumerate(derivatives):
        triangle: FloatArray
        frame, triangle = np.linalg.qr(derivative @ frame)
        growth[k] = np.log(np.maximum(np.abs(np.diag(triangle)), _RESOLVED))
    return growth


def _stick_class(share: float, forward: float, backward: float) -> int:
    """Code of the class of stick-slip, as ``stick_slip_class`` tells it."""
    if share >= 1.0 - _NO_SLIP:
        return enums.NO_SLIP
    if forward > 0 and backward > 0:
        return enums.BIDIRECTIONAL
    return enums.UNIDIRECTIONAL if forward > 0 or backward > 0 else enums.NON_STICK_SLIP


_ENDS = {
    Status.COMPLETED: (enums.COMPLETED, enums.UNDECIDED),
    Status.DIVERGED: (enums.DIVERGED, enums.RUNAWAY),
    Status.NO_FORWARD_SOLUTION: (enums.NO_SLIDING, enums.LOCKED),
    Status.EVENT_LIMIT: (enums.EVENT_LIMIT, enums.UNDECIDED),
    Status.STEP_LIMIT: (enums.STEP_LIMIT, enums.UNDECIDED),
}
