"""One system run and judged, by any solver: the numbers behind ``motion`` and every sweep.

The exact solver does it in one compiled kernel (``_kernels.point``). The others run period
by period; with smooth friction small deviations follow the variational equation.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wedgebrake._kernels import codes, exact, motion, point, tally
from wedgebrake.linear_stability import stability
from wedgebrake.measures.energy import energy
from wedgebrake.measures.protocol import Protocol
from wedgebrake.measures.sticking import sticks
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.solvers.solve import simulate
from wedgebrake.solvers.status import Status

if TYPE_CHECKING:
    import xarray as xr

FloatArray = NDArray[np.float64]
State = tuple[float, float]

# Samples from which size, peak torque and power are taken, at least: in a period of the torque
# and in one of the free vibration. So many at most; below them there is no torque or power.
_SAMPLES, _OF_NATURAL, _MOST_SAMPLES = 100, 20, 100_000
# What shrinks below this share in a period is the rounding of the other direction.
_RESOLVED = 1e-8
_UNSETTLED = (codes.UNDECIDED, codes.QUASI_PERIODIC, codes.CHAOTIC)


def judge(
    system: BrakedDriveline, initial: State, method: str, protocol: Protocol
) -> tuple[FloatArray, FloatArray]:
    """Run a system and judge its motion.

    Returns (answer, record): the columns of ``_kernels.point`` and the recorded Poincare
    points, (n, 2): n = recorded periods + 1, or fewer where the run ended early.
    """
    if method == "exact":
        return _exactly(system, initial, protocol)
    return _Simulated(system, initial, method, protocol).judged()


def _exactly(
    system: BrakedDriveline, initial: State, protocol: Protocol
) -> tuple[FloatArray, FloatArray]:
    from wedgebrake.solvers.exact import problem

    transient = -1 if protocol.automatic else protocol.first
    longest = max(transient, protocol.limit if transient < 0 else 0)
    longest += protocol.recorded + motion.LONGEST + 1
    points, answer = np.empty((longest, 2)), np.empty(point.COLUMNS)
    begin, end = point.judge(
        tuple(problem(system, *initial)), *initial, transient, protocol.recorded,
        protocol.limit, protocol.max_events, np.empty((256, exact.LOG_COLUMNS)), points,
        np.empty(longest), np.zeros((2, tally.ENTRIES)), answer,
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


class _Simulated:
    """A run of any solver, period by period."""

    def __init__(
        self, system: BrakedDriveline, initial: State, method: str, protocol: Protocol
    ) -> None:
        self.system, self.method, self.protocol = system, method, protocol
        self.state, self.work = initial, 0
        self.status = Status.COMPLETED
        self.points = np.array([initial], dtype=float)
        self.size = 1.0
        line = system.driveline
        # What turns an angle into a velocity; without a spring the angle does not matter.
        self.weight = line.natural_frequency or system.excitation.angular_frequency
        self.ruler = line.natural_frequency
        slow = line.natural_frequency / system.excitation.angular_frequency
        self.samples = min(_MOST_SAMPLES, max(_SAMPLES, math.ceil(_OF_NATURAL * slow)))

    def judged(self) -> tuple[FloatArray, FloatArray]:
        """The answer and the record."""
        protocol = self.protocol
        verdict = self._settle() if protocol.automatic else None
        if protocol.first:
            self._advance(protocol.first)
        begin = self.points.shape[0] - 1
        response = None
        if self.status is Status.COMPLETED:
            response = self._advance(protocol.recorded, self.samples)
        record = self.points[begin:]
        answer = np.full(point.COLUMNS, np.nan)
        answer[point.OUTCOME], answer[point.CLASS] = _ENDS[self.status]
        answer[point.EVENTS] = self.work
        answer[point.FINAL_THETA], answer[point.FINAL_W] = self.state
        answer[point.TRANSIENT], answer[point.JUDGED] = begin, 0.0
        answer[point.SLIDING_DAMPING] = _sliding_damping(self.system)
        if self.status is not Status.COMPLETED or response is None:
            answer[point.ORDER] = 0.0
            return answer, record if record.shape[0] > 1 else record[:0]
        if verdict is None:
            verdict = self._classify(begin, response)
            verdict = verdict._replace(judged=protocol.recorded)
        self._measure(answer, response)
        frequency = self.system.excitation.frequency
        answer[point.CLASS], answer[point.ORDER] = verdict.motion, verdict.order
        answer[point.SIZE] = self.size
        answer[point.RETURN_DISTANCE] = verdict.returned
        answer[point.LARGEST_EXPONENT] = verdict.mean * frequency
        # Beside the larger one nothing is resolved that shrinks so fast.
        resolved = verdict.second > 0.5 * math.log(_RESOLVED)
        answer[point.SECOND_EXPONENT] = verdict.second * frequency if resolved else math.nan
        known = math.isfinite(verdict.error)
        answer[point.EXPONENT_ERROR] = verdict.error * frequency if known else math.nan
        answer[point.JUDGED], answer[point.SETTLING] = verdict.judged, verdict.settling
        return answer, record

    def _advance(self, periods: int, samples: int = 0) -> xr.Dataset:
        """Run on, and keep the Poincare points."""
        given: dict[str, Any] = {"times": ()} if samples == 0 else {"samples_per_period": samples}
        response = self._simulate(self.state, periods, **given)
        passed = np.column_stack([response["poincare_angle"], response["poincare_velocity"]])
        self.points = np.concatenate([self.points, passed[1:]])
        attrs = response.attrs
        self.state = (attrs["final_angle"], attrs["final_velocity"])
        self.status, self.work = Status(attrs["status"]), self.work + int(attrs["work"])
        return response

    def _simulate(self, state: State, periods: int, **given: Any) -> xr.Dataset:
        protocol = self.protocol
        return simulate(
            self.system, periods=periods, initial=state, method=self.method,
            rtol=protocol.rtol, step=protocol.step, max_steps=protocol.max_steps, **given,
        )  # fmt: skip

    def _settle(self) -> _Verdict | None:
        """Windows, each twice as long as the last, until the motion has settled in one."""
        done, limit = 0, self.protocol.limit
        verdict = None
        while done < limit:
            begin, target = done, point.next_window(done, limit)
            response = self._advance(target - done)
            if self.status is not Status.COMPLETED:
                return None
            verdict = self._classify(done, response)
            settling = float(done)
            done = target
            if verdict.order:
                settling = float(
                    point.settling_of(self.points, verdict.order, done, self.ruler, self.size)
                )
            verdict = verdict._replace(judged=target - begin, settling=settling)
            if verdict.motion not in _UNSETTLED:
                break
        return verdict

    def _measure_size(self) -> None:
        """Half the range of velocity and weighted angle together, over one more period."""
        response = self._simulate(self.state, 1, samples_per_period=self.samples)
        width = np.ptp(response["velocity"].to_numpy())
        width += self.ruler * np.ptp(response["angle"].to_numpy())
        self.size = float(max(0.5 * width, 1e-300))

    def _classify(self, begin: int, response: xr.Dataset) -> _Verdict:
        self._measure_size()
        window = np.ascontiguousarray(self.points[begin:])
        order, _ = motion.order_of(window, self.ruler, self.size)
        # What repeats has the exponents of its last orbit; what does not, those of all periods.
        growth = np.zeros((window.shape[0] - 1, 2))
        if self.method == "smooth":
            growth = self._of_orbit(window, order) if order else self._growth(window)
        mean, error = motion.mean_growth(np.ascontiguousarray(growth[:, 0]))
        error = 0.0 if order else error
        second = float(np.mean(growth[:, 1]))
        end = response.attrs["final_time"]
        last = sticks(response, end - 1.0 / self.system.excitation.frequency)
        line = self.system.driveline
        # On a turning shaft the spring ends every rest.
        lasting = line.drive_speed == 0.0 or line.stiffness == 0.0
        class_, order, returned = motion.classify(
            window, self.ruler, self.size, np.ascontiguousarray(growth[:, 0]),
            float(mean) + second, lasting and last.attrs["share"] >= 1.0 - 1e-9,
        )  # fmt: skip
        if self.method == "ode14x":
            # Neighbours part at the chatter of a fixed step: that is the scheme, not the motion.
            mean = second = error = math.nan
            if class_ in (codes.CHAOTIC, codes.QUASI_PERIODIC):
                class_ = codes.UNDECIDED
        elif order and not point.attracts(order * mean, returned, window, self.ruler, self.size):
            class_, order = codes.UNDECIDED, 0
        return _Verdict(class_, order, returned, float(mean), second, float(error))

    def _derivatives(self, window: FloatArray) -> Iterator[FloatArray]:
        """Of the flow over each period, (2, 2), in velocities, from the variational equation."""
        from wedgebrake.solvers.smooth import period_map, problem

        given = problem(self.system, self.protocol.rtol)
        scale = np.array([self.weight, 1.0])
        for angle, velocity in window[:-1]:
            there = period_map(given, float(angle), float(velocity), self.protocol.max_steps)
            yield there.matrix * scale[:, None] / scale

    def _growth(self, window: FloatArray) -> FloatArray:
        """Growth of a deviation and of the one square to it, in each period (logarithms)."""
        frame = np.array([[1.0, -1.0], [1.0, 1.0]]) / math.sqrt(2.0)
        growth = np.empty((window.shape[0] - 1, 2))
        for k, derivative in enumerate(self._derivatives(window)):
            triangle: FloatArray
            frame, triangle = np.linalg.qr(derivative @ frame)
            growth[k] = np.log(np.maximum(np.abs(np.diag(triangle)), _RESOLVED))
        return growth

    def _of_orbit(self, window: FloatArray, order: int) -> FloatArray:
        """The growth of both deviations that an orbit multiplies by a number, for each period."""
        whole = np.eye(2)
        for derivative in self._derivatives(window[-1 - order :]):
            whole = derivative @ whole
        first, second = np.sort(np.abs(np.linalg.eigvals(whole)))[::-1]
        resolved = second > _RESOLVED * np.linalg.norm(whole)
        rates = (math.log(max(first, 1e-300)), math.log(second) if resolved else math.nan)
        return np.tile(np.array(rates) / order, (window.shape[0] - 1, 1))

    def _measure(self, answer: FloatArray, response: xr.Dataset) -> None:
        """Sticks, torque and power over the record."""
        periods = self.protocol.recorded
        stuck = sticks(response, 0.0).attrs
        classes = ("at rest", "non-stick-slip", "unidirectional stick-slip")
        found = stuck["class"]
        number = classes.index(found) if found in classes else codes.BIDIRECTIONAL
        answer[point.STICK_CLASS] = number
        answer[point.STICKS_FORWARD] = stuck["count_forward"] / periods
        answer[point.STICKS_BACKWARD] = stuck["count_backward"] / periods
        answer[point.STICK_SHARE] = stuck["share"]
        if self.samples < _MOST_SAMPLES:
            work = energy(response).attrs
            answer[point.PEAK_TORQUE] = work["largest_peak_torque"]
            answer[point.FRICTION_POWER] = work["mean_friction_power"]


_ENDS = {
    Status.COMPLETED: (codes.COMPLETED, codes.UNDECIDED),
    Status.DIVERGED: (codes.DIVERGED, codes.RUNAWAY),
    Status.NO_FORWARD_SOLUTION: (codes.NO_SLIDING, codes.LOCKED),
    Status.EVENT_LIMIT: (codes.EVENT_LIMIT, codes.UNDECIDED),
    Status.STEP_LIMIT: (codes.STEP_LIMIT, codes.UNDECIDED),
}


def _sliding_damping(system: BrakedDriveline) -> float:
    """Damping of sliding [N m s/rad], the smaller of the directions that exist."""
    verdict = stability(system)
    dampings = [one.damping for one in (verdict.forward, verdict.backward)]
    return min((one for one in dampings if one is not None), default=math.inf)
