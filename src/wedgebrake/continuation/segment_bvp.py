"""The equations of an orbit with set-valued friction: a chain of pieces."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wedgebrake.analysis import accumulators
from wedgebrake.continuation import segment_bvp_kernel as kernel
from wedgebrake.continuation.equations import FloatArray, Measures, NoOrbitError
from wedgebrake.continuation.flow import run
from wedgebrake.dynamics.enums import EventKind
from wedgebrake.dynamics.segment_log import REST, empty_log
from wedgebrake.model.system import BrakedDriveline

# An orbit returns to this share of its size, times what a deviation has grown.
_RETURNED = 1e-8
# An orbit with a larger multiplier than this is left by rounding within its period.
_FORGOTTEN = 1e6
# What moves less than this share of the angle, in time of the torque, hardly moves.
_SMALL = 1e-6
# A velocity below this share of the motion's is that of rest.
_AT_REST = 1e-13

Codes = tuple[int, ...]


class Chain:
    """An orbit as a cyclic sequence of pieces (``segment_bvp_kernel``).

    codes : the pieces, 0 rest, 1, 2, ... forwards, -1, -2, ... backwards
    order : periods of the torque in the orbit
    half  : whether the pieces are the first half of an orbit that is its own mirror image. What
            happens in both halves at once, as at a graze, would make the equations of the whole
            singular twice.
    """

    def __init__(self, sequence: Codes, order: int, *, half: bool = False) -> None:
        self.codes, self.order, self.half = sequence, order, half
        self._codes: NDArray[np.int64] = np.array(sequence, dtype=np.int64)
        every = sequence + tuple(-code for code in sequence) if half else sequence
        self.every: Codes = every
        self._every: NDArray[np.int64] = np.array(every, dtype=np.int64)
        self._log = empty_log(len(every) + order + 2)

    @property
    def size(self) -> int:
        """Two unknowns for each node."""
        return 2 * len(self.codes)

    @property
    def sequence(self) -> str:
        """The pieces, as in "+ 0 -": forwards, rest, backwards; "+1" is the next piece."""
        return " ".join(_sign(code) for code in self.every)

    def is_mark(self, node: int) -> bool:
        """Whether a node is no event, but a mark at phase 0."""
        return self.every[node - 1] == self.every[node]

    def whole(self, unknowns: FloatArray) -> tuple[Chain, FloatArray]:
        """The chain of the whole orbit."""
        if not self.half:
            return self, unknowns
        return Chain(self.every, self.order), self._all(unknowns)

    def halved(self, unknowns: FloatArray) -> tuple[Chain, FloatArray]:
        """The chain of half the orbit, which must be its own mirror image."""
        count = len(self.codes) // 2
        return Chain(self.codes[:count], self.order, half=True), unknowns[: 2 * count].copy()

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
        slowest, fastest, least, greatest = self._extremes(unknowns, problem)
        angle, velocity = max(abs(least), abs(greatest)), max(abs(slowest), abs(fastest))
        omega = problem.torque.angular_frequency
        scales = np.empty(self.size)
        scales[0::2] = 1.0
        scales[1::2] = max(angle, _SMALL * velocity / omega) or 1.0
        if self.is_mark(0):
            scales[0] = max(velocity, _SMALL * omega * angle) or 1.0
        return scales

    def _extremes(self, unknowns: FloatArray, problem: Any) -> FloatArray:
        """Least and greatest velocity [rad/s] and angle [rad]."""
        out = np.empty(4)
        kernel.extremes(problem, self._every, self.order, self._all(unknowns), out)
        if not np.all(np.isfinite(out)):
            raise NoOrbitError
        return out

    def residual(self, unknowns: FloatArray, problem: Any) -> FloatArray:
        """F(u)."""
        return self.linearize(unknowns, problem)[0]

    def linearize(self, unknowns: FloatArray, problem: Any) -> tuple[FloatArray, FloatArray]:
        """F(u) and its derivative."""
        values, matrix = np.empty(self.size), np.empty((self.size, self.size))
        there = kernel.residual(
            problem, self._codes, self.order, -1 if self.half else 1, unknowns, values, matrix
        )
        if not there or not np.all(np.isfinite(values)) or not np.all(np.isfinite(matrix)):
            raise NoOrbitError
        return values, matrix

    def invariants(self, unknowns: FloatArray, problem: Any) -> tuple[float, float]:
        """Trace and determinant of the derivative of the orbit's return."""
        trace, determinant = kernel.monodromy(
            problem, self._every, self.order, self._all(unknowns), self._log
        )
        return float(trace), float(determinant)

    def margins(self, unknowns: FloatArray, problem: Any) -> FloatArray:
        """Distances from where the orbit is none (``segment_bvp_kernel``)."""
        out = np.empty((len(self.every), kernel.COLUMNS))
        kernel.margins(problem, self._every, self.order, self._all(unknowns), out)
        return out[: len(self.codes)]

    def log(self, unknowns: FloatArray, problem: Any) -> NDArray[np.record]:
        """The orbit as the exact solver logs it, (rows, SEGMENT)."""
        rows = kernel.write(problem, self._every, self.order, self._all(unknowns), self._log)
        return self._log[:rows]

    def points(self, unknowns: FloatArray, problem: Any) -> FloatArray:
        """Poincare points at t = 0, T, ..."""
        log = self.log(unknowns, problem)
        starts = log[log["kind"] == EventKind.RETURN][: self.order]
        points = np.empty((self.order, 2))
        points[starts["period"] % self.order] = np.column_stack(
            (starts["angle"], starts["velocity"])
        )
        return points

    def measures(self, unknowns: FloatArray, problem: Any, system: BrakedDriveline) -> Measures:
        """What the orbit does."""
        log = self.log(unknowns, problem)
        sums = accumulators.sums_of(problem, log)
        events = sum(not self.is_mark(i) for i in range(len(self.every)))
        slowest, fastest, least, greatest = self._extremes(unknowns, problem)
        return Measures(
            velocity_amplitude=0.5 * float(fastest - slowest),
            angle_amplitude=0.5 * float(greatest - least),
            stick_share=float(sums["rest_time"]) * system.excitation.frequency / self.order,
            sticks_forward=float(sums["sticks_forward"]) / self.order,
            sticks_backward=float(sums["sticks_backward"]) / self.order,
            events=events / self.order,
            peak_torque=float(sums["peak_torque"]),
        )

    def from_mirror(
        self,
        unknowns: FloatArray,
        system: BrakedDriveline,  # noqa: ARG002
        tolerance: float,  # noqa: ARG002
    ) -> FloatArray:
        """From the orbit to its mirror image half an orbit later, as shares of its size."""
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

    def doubled(self, unknowns: FloatArray) -> tuple[Chain, FloatArray]:
        """The same orbit, gone through twice."""
        if self.is_mark(0):
            # A mark stands once in an orbit, at its begin.
            return Chain(self.codes, 2 * self.order), unknowns.copy()
        first = self._all(unknowns)
        later = first.copy()
        later[0::2] += 2.0 * math.pi * self.order
        return Chain(self.every * 2, 2 * self.order), np.concatenate((first, later))


def _sign(code: int) -> str:
    if code == 0:
        return "0"
    further = abs(code) - 1
    return ("+" if code > 0 else "-") + (str(further) if further else "")


def from_log(log: NDArray[np.record], problem: Any, order: int) -> tuple[Chain, FloatArray] | None:
    """The chain of a run of ``order`` periods from phase 0, and its unknowns.

    log : segment log of the exact solver

    None where nothing moves relative to the brake: every angle that it holds is an equilibrium.
    """
    omega, zero = problem.torque.angular_frequency, problem.brake.first_forward
    pieces = log["mode"]
    signed = np.where(pieces >= zero, pieces - zero + 1, pieces - zero)
    signed[pieces == REST] = 0
    kinds = log["kind"]
    if np.all(signed[:-1] == 0):
        return None
    events = np.flatnonzero((kinds >= EventKind.STICK) & (kinds < EventKind.END))
    if events.size == 0:
        unknowns = np.array([log["velocity"][0], log["angle"][0]])
        return Chain((int(signed[0]),), order), unknowns
    sequence = tuple(int(code) for code in signed[events])
    phases = 2.0 * math.pi * log["period"][events] + omega * log["time"][events]
    return Chain(sequence, order), np.column_stack((phases, log["angle"][events])).ravel()


def goes_through(chain: Chain, unknowns: FloatArray, problem: Any) -> bool:
    """Whether the exact flow, which misses no event, goes through a chain's pieces and returns.

    An orbit so unstable that rounding leaves it within its period is believed.
    """
    trace, _ = chain.invariants(unknowns, problem)
    if abs(trace) > _FORGOTTEN:
        return True
    angle, velocity = chain.points(unknowns, problem)[0]
    if (
        abs(velocity - problem.driveline.rest_velocity)
        <= _AT_REST * np.max(np.abs(unknowns[1::2])) * problem.torque.angular_frequency
    ):
        velocity = problem.driveline.rest_velocity
    start = np.array([angle, velocity])
    there = run(problem, start, chain.order)
    apart = np.abs(there.end - start) * (problem.torque.angular_frequency, 1.0)
    size = np.max(np.abs(unknowns[1::2])) * problem.torque.angular_frequency + abs(velocity)
    if np.max(apart) > _RETURNED * (1.0 + abs(trace)) * size:
        return False
    seen = from_log(there.log, problem, chain.order)
    if seen is None:
        return False
    codes_ = seen[0].codes
    if len(codes_) != len(chain.every):
        return False
    twice = chain.every * 2
    return any(twice[k : k + len(codes_)] == codes_ for k in range(len(codes_)))
