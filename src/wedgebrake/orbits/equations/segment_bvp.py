"""The equations of an orbit with set-valued friction: a boundary-value problem of segments."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wedgebrake.analysis.driveline_motion import accumulators
from wedgebrake.analysis.driveline_motion.saltation import propagate
from wedgebrake.arrays import FloatArray, Records
from wedgebrake.dynamics.deviations import Deviations
from wedgebrake.dynamics.enums import EventKind, Outcome
from wedgebrake.dynamics.motion_sums import empty_sums
from wedgebrake.dynamics.problem import Instant, State
from wedgebrake.dynamics.segment_log import REST, empty_log
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.orbits.equations import segment_kernel
from wedgebrake.orbits.equations.equations import Codes, NoOrbitError, OrbitEquations, PartMeasures
from wedgebrake.orbits.equations.floquet import Floquet
from wedgebrake.orbits.equations.segment_changes import changes_of
from wedgebrake.orbits.equations.segment_orbit import (
    MARGINS,
    compute_margins,
    monodromy_invariants,
    widen_by_orbit,
    write_log,
)
from wedgebrake.orbits.equations.varied_segments import VariedSegments
from wedgebrake.solvers.event_driven import trajectory

# An orbit returns to this share of its size, times the growth of a deviation.
_RETURNED = 1e-8
# With a larger multiplier than this, rounding leaves the orbit within its period.
_FORGOTTEN = 1e6
# Lower bound of a scale, as a share of the angle in time units of the torque.
_SMALL = 1e-6
# A velocity below this share of that of the motion counts as rest.
_AT_REST = 1e-13
# Initial rows of the log for each period of a run, and largest number of events.
_ROWS, _MOST_EVENTS = 32, 100_000
_NO_POINTS = np.empty((0, 2))


class SegmentBVP(OrbitEquations):
    """An orbit as a cyclic sequence of segments (``segment_kernel``).

    codes : of the segments: 0 rest, 1, 2, ... forwards, -1, -2, ... backwards
    order : periods of the torque in the orbit
    half  : whether the segments are the first half of an orbit that is its own mirror image. An
            event in both halves at once, such as a graze, would make the equations of the whole
            singular twice.
    """

    differentiable = True

    def __init__(self, codes: Codes, order: int, *, half: bool = False) -> None:
        self.codes, self.order, self.half = codes, order, half
        self._codes: NDArray[np.int64] = np.array(codes, dtype=np.int64)
        self.all_codes: Codes = codes + tuple(-code for code in codes) if half else codes
        self._all_codes: NDArray[np.int64] = np.array(self.all_codes, dtype=np.int64)
        self._log = empty_log(len(self.all_codes) + order + 2)

    @property
    def size(self) -> int:
        """Two unknowns for each node."""
        return 2 * len(self.codes)

    def sequence(self, unknowns: FloatArray, problem: Any) -> str:  # noqa: ARG002
        """The segments, as in "+ 0 -": forwards, rest, backwards; "+1" is the next piece."""
        return " ".join(_sign(code) for code in self.all_codes)

    def is_mark(self, node: int) -> bool:
        """Return True if a node is not an event, but a mark at phase 0."""
        return self.all_codes[node - 1] == self.all_codes[node]

    def whole(self, unknowns: FloatArray) -> tuple[SegmentBVP, FloatArray]:
        """Equations of the whole orbit."""
        if not self.half:
            return self, unknowns
        return SegmentBVP(self.all_codes, self.order), self._all(unknowns)

    def halved(self, unknowns: FloatArray) -> tuple[SegmentBVP, FloatArray]:
        """Equations of half the orbit, which must be its own mirror image."""
        count = len(self.codes) // 2
        half = SegmentBVP(self.codes[:count], self.order, half=True)
        return half, unknowns[: 2 * count].copy()

    def doubled(self, unknowns: FloatArray) -> tuple[SegmentBVP, FloatArray]:
        """Equations of the same orbit traversed twice."""
        if self.is_mark(0):
            # A mark occurs once in an orbit, at its beginning.
            return SegmentBVP(self.codes, 2 * self.order), unknowns.copy()
        first = self._all(unknowns)
        later = first.copy()
        later[0::2] += 2.0 * math.pi * self.order
        return SegmentBVP(self.all_codes * 2, 2 * self.order), np.concatenate((first, later))

    def _all(self, unknowns: FloatArray) -> FloatArray:
        """Unknowns of the whole orbit."""
        if not self.half:
            return unknowns
        later = unknowns.copy()
        later[0::2] += math.pi * self.order
        later[1::2] *= -1.0
        return np.concatenate((unknowns, later))

    def scales(self, unknowns: FloatArray, problem: Any) -> FloatArray:
        """A radian of phase (at a mark the velocity), and the angle, of the orbit's size."""
        (slowest, fastest), (least, greatest) = self._range(unknowns, problem)
        angle, velocity = max(abs(least), abs(greatest)), max(abs(slowest), abs(fastest))
        omega = problem.torque.angular_frequency
        scales = np.empty(self.size)
        scales[0::2] = 1.0
        scales[1::2] = max(angle, _SMALL * velocity / omega) or 1.0
        if self.is_mark(0):
            scales[0] = max(velocity, _SMALL * omega * angle) or 1.0
        return scales

    def _range(self, unknowns: FloatArray, problem: Any) -> FloatArray:
        """Least and largest velocity [rad/s], least and largest angle [rad], (2, 2)."""
        sums = empty_sums()
        widen_by_orbit(problem, self._all_codes, self.order, self._all(unknowns), sums)
        names = ("least_velocity", "greatest_velocity"), ("least_angle", "greatest_angle")
        ends = np.array([[sums[name] for name in pair] for pair in names])
        if not np.all(np.isfinite(ends)):
            raise NoOrbitError
        return ends

    def residual(self, unknowns: FloatArray, problem: Any) -> FloatArray:
        """F(u)."""
        return self.linearize(unknowns, problem)[0]

    def linearize(self, unknowns: FloatArray, problem: Any) -> tuple[FloatArray, FloatArray]:
        """F(u) and its derivative."""
        values, matrix = np.empty(self.size), np.empty((self.size, self.size))
        there = segment_kernel.residual(
            problem, self._codes, self.order, -1 if self.half else 1, unknowns, values, matrix
        )
        if not there or not np.all(np.isfinite(values)) or not np.all(np.isfinite(matrix)):
            raise NoOrbitError
        return values, matrix

    def by_parameters(self, unknowns: FloatArray, varied: VariedSegments) -> FloatArray:
        """Derivative of F with respect to parameters, (size, parameters)."""
        found, sign = np.empty((len(varied.changes), self.size)), -1 if self.half else 1
        for changes, line in zip(varied.changes, found, strict=True):
            changes_of(varied.problem, changes, self._codes, self.order, sign, unknowns, line)
        return found.T

    def duration(self, unknowns: FloatArray, problem: Any) -> float:  # noqa: ARG002
        """Period of the orbit [s]."""
        return float(self.order * 2.0 * math.pi / problem.torque.angular_frequency)

    def floquet(self, unknowns: FloatArray, problem: Any) -> Floquet:
        """Floquet multipliers."""
        trace, determinant = monodromy_invariants(
            problem, self._all_codes, self.order, self._all(unknowns), self._log, self.half
        )
        return Floquet.of_plane(float(trace), float(determinant), half=self.half)

    def margins(self, unknowns: FloatArray, problem: Any) -> Records:
        """Margins of the solution as an orbit, for each segment."""
        out = np.empty(len(self.all_codes), dtype=MARGINS)
        compute_margins(problem, self._all_codes, self.order, self._all(unknowns), out)
        return out[: len(self.codes)]

    def log(self, unknowns: FloatArray, problem: Any) -> Records:
        """The orbit as the exact solver logs it; overwritten by the next call."""
        rows = write_log(problem, self._all_codes, self.order, self._all(unknowns), self._log)
        return self._log[:rows]

    def points(self, unknowns: FloatArray, problem: Any) -> FloatArray:
        """(order, 2) states at the section."""
        log = self.log(unknowns, problem)
        returns = log[log["kind"] == EventKind.RETURN][: self.order]
        points = np.empty((self.order, 2))
        states = np.column_stack((returns["angle"], returns["velocity"]))
        points[returns["period"] % self.order] = states
        return points

    def twists(
        self,
        unknowns: FloatArray,
        problem: Any,
        system: BrakedDriveline,  # noqa: ARG002
    ) -> tuple[FloatArray, FloatArray]:
        """Half range and largest magnitude of the angle [rad]."""
        angles = self._range(unknowns, problem)[1]
        return 0.5 * np.ptp(angles, keepdims=True), np.max(np.abs(angles), keepdims=True)

    def measures(self, unknowns: FloatArray, problem: Any, system: BrakedDriveline) -> PartMeasures:
        """Amplitudes, sticking, events and torque."""
        sums = accumulators.sums_of(problem, self.log(unknowns, problem))
        events = sum(not self.is_mark(i) for i in range(len(self.all_codes)))
        velocity, angle = 0.5 * np.diff(self._range(unknowns, problem))
        duration = self.order / system.excitation.frequency
        return PartMeasures(
            velocity_amplitude=velocity,
            angle_amplitude=angle,
            stick_share=np.array([float(sums["rest_time"]) / duration]),
            peak_torque=np.array([float(sums["peak_torque"])]),
            sticks_forward=float(sums["sticks_forward"]) / self.order,
            sticks_backward=float(sums["sticks_backward"]) / self.order,
            events=events / self.order,
        )

    def mirror_difference(
        self,
        unknowns: FloatArray,
        problem: Any,  # noqa: ARG002
        system: BrakedDriveline,  # noqa: ARG002
        tolerance: float,  # noqa: ARG002
    ) -> FloatArray:
        """Difference to the mirror image half an orbit later, in shares of the orbit's size."""
        if self.half:
            return np.zeros(self.size)
        half = len(self.codes) // 2
        opposite = tuple(-code for code in self.codes)
        if len(self.codes) % 2 or self.codes[half:] + self.codes[:half] != opposite:
            return np.zeros(0)
        first, second = np.split(unknowns.reshape(-1, 2), 2)
        apart = second - first * [1.0, -1.0] - [math.pi * self.order, 0.0]
        angle = np.max(np.abs(unknowns[1::2]))
        return np.asarray((apart / [1.0, angle]).ravel())

    def follows_flow(self, unknowns: FloatArray, problem: Any, growth: float) -> bool:
        """Return True if the exact flow, which misses no event, passes the segments and returns.

        An orbit so unstable that rounding leaves it within its period is accepted untested.
        """
        if growth > _FORGOTTEN:
            return True
        omega = problem.torque.angular_frequency
        rest_velocity = problem.driveline.rest_velocity
        size = np.max(np.abs(unknowns[1::2])) * omega
        start = self.points(unknowns, problem)[0]
        if abs(start[1] - rest_velocity) <= _AT_REST * size:
            start[1] = rest_velocity
        there = run(problem, start, self.order)
        apart = np.abs(there.end - start) * (omega, 1.0)
        if np.max(apart) > _RETURNED * (1.0 + growth) * (size + abs(start[1])):
            return False
        seen = from_log(there.log, problem, self.order)
        if seen is None:
            return False
        codes = seen[0].codes
        twice = self.all_codes * 2
        return len(codes) == len(self.all_codes) and any(
            twice[k : k + len(codes)] == codes for k in range(len(codes))
        )


def _sign(code: int) -> str:
    if code == 0:
        return "0"
    further = abs(code) - 1
    return ("+" if code > 0 else "-") + (str(further) if further else "")


def from_log(log: Records, problem: Any, order: int) -> tuple[SegmentBVP, FloatArray] | None:
    """Equations and unknowns of a run of ``order`` periods from phase 0.

    log : segment log of the exact solver

    None if nothing moves relative to the brake: every angle that it holds is an equilibrium.
    """
    modes, first = log["mode"], problem.brake.first_forward
    codes = np.where(modes >= first, modes - first + 1, modes - first)
    codes[modes == REST] = 0
    if np.all(codes[:-1] == 0):
        return None
    kinds = log["kind"]
    events = np.flatnonzero((kinds >= EventKind.STICK) & (kinds < EventKind.END))
    if events.size == 0:
        return SegmentBVP((int(codes[0]),), order), np.array([log["velocity"][0], log["angle"][0]])
    times = problem.torque.angular_frequency * log["time"][events]
    phases = 2.0 * math.pi * log["period"][events] + times
    unknowns = np.column_stack((phases, log["angle"][events])).ravel()
    return SegmentBVP(tuple(int(code) for code in codes[events]), order), unknowns


class FlowRun(NamedTuple):
    """A run of some periods from phase 0: its log, its end, and the derivative of the end."""

    log: Records
    end: FloatArray
    matrix: FloatArray


def run(problem: Any, state: FloatArray, periods: int) -> FlowRun:
    """The exact flow from a state; raises ``NoOrbitError`` if the run ends early."""
    rows = 16 + _ROWS * periods
    start, end = State(0, 0.0, state[0], state[1]), Instant(periods, 0.0)
    while True:
        log = empty_log(rows)
        found = trajectory.run(problem, start, end, _MOST_EVENTS, log, _NO_POINTS)
        if found.outcome != Outcome.LOG_FULL:
            break
        rows *= 4
    if found.outcome != Outcome.COMPLETED:
        raise NoOrbitError
    identity = Deviations(1.0, 0.0, 0.0, 1.0)
    there = propagate(problem, log, found.rows, identity, np.empty(0), 0)
    x1, y1, x2, y2 = there.deviations
    matrix = math.exp(min(there.log_scale, 700.0)) * np.array([[x1, x2], [y1, y2]])
    return FlowRun(log[: found.rows], np.array([found.state.angle, found.state.velocity]), matrix)
