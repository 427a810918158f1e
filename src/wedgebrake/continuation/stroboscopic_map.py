"""The equations of an orbit with a smooth friction law: a map from period to period."""

from __future__ import annotations

from typing import Any

import numpy as np

from wedgebrake.analysis.sticking import sticks
from wedgebrake.continuation import segment_bvp_kernel as kernel
from wedgebrake.continuation.equations import FloatArray, Measures, NoOrbitError
from wedgebrake.dynamics.enums import Outcome
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.solvers.simulate import simulate

_MOST_STEPS = 1_000_000
_SAMPLES = 400


class Strobe:
    """An orbit as its states at the begin of each period of the torque.

    The unknowns are angle [rad] and velocity [rad/s] at t = 0, T, ...; each period asks that
    the flow leads from one state to the next.
    """

    sequence = ""

    def __init__(self, order: int) -> None:
        self.order = order

    @property
    def size(self) -> int:
        """Two unknowns for each period."""
        return 2 * self.order

    def scales(self, unknowns: FloatArray, problem: Any) -> FloatArray:
        """The angle, and the velocity that belongs to it, of the orbit's size."""
        angle, velocity = np.max(np.abs(self._states(unknowns)), axis=0)
        # At the section the one may vanish where the other is largest.
        omega = problem.problem.torque.angular_frequency
        velocity = max(velocity, omega * angle) or 1.0
        return np.tile([max(angle, velocity / omega), velocity], self.order)

    def residual(self, unknowns: FloatArray, problem: Any) -> FloatArray:
        """F(u)."""
        ends = [self._period(state, problem, derivative=False) for state in self._states(unknowns)]
        return self._closed(unknowns, [end for end, _ in ends])

    def linearize(self, unknowns: FloatArray, problem: Any) -> tuple[FloatArray, FloatArray]:
        """F(u) and its derivative."""
        matrix = np.zeros((self.size, self.size))
        ends = []
        for k, state in enumerate(self._states(unknowns)):
            end, derivative = self._period(state, problem, derivative=True)
            ends.append(end)
            here, following = slice(2 * k, 2 * k + 2), 2 * ((k + 1) % self.order)
            matrix[here, here] += derivative
            matrix[here, following : following + 2] -= np.eye(2)
        return self._closed(unknowns, ends), matrix

    def invariants(self, unknowns: FloatArray, problem: Any) -> tuple[float, float]:
        """Trace and determinant of the derivative of the orbit's return."""
        whole, determinant = np.eye(2), 1.0
        for state in self._states(unknowns):
            _, derivative = self._period(state, problem, derivative=True)
            whole = derivative @ whole
            determinant *= float(np.linalg.det(derivative))
        return float(np.trace(whole)), determinant

    def margins(self, unknowns: FloatArray, problem: Any) -> FloatArray:  # noqa: ARG002
        """A smooth flow has none."""
        return np.empty((0, kernel.COLUMNS))

    def points(self, unknowns: FloatArray, problem: Any) -> FloatArray:  # noqa: ARG002
        """Poincare points at t = 0, T, ..."""
        return self._states(unknowns).copy()

    def measures(self, unknowns: FloatArray, problem: Any, system: BrakedDriveline) -> Measures:
        """What the orbit does."""
        start = (float(unknowns[0]), float(unknowns[1]))
        response = simulate(
            system, periods=self.order, initial=start, method="smooth",
            rtol=problem.problem.tolerances.relative, samples_per_period=_SAMPLES,
        )  # fmt: skip
        velocity, angle = response["velocity"].to_numpy(), response["angle"].to_numpy()
        stuck = sticks(response, 0.0).attrs
        return Measures(
            velocity_amplitude=0.5 * float(np.ptp(velocity)),
            angle_amplitude=0.5 * float(np.ptp(angle)),
            stick_share=float(stuck["share"]),
            sticks_forward=stuck["count_forward"] / self.order,
            sticks_backward=stuck["count_backward"] / self.order,
            events=response.sizes["event"] / self.order,
            peak_torque=float(np.max(np.abs(response["brake_torque"].to_numpy()))),
        )

    def from_mirror(
        self, unknowns: FloatArray, system: BrakedDriveline, tolerance: float
    ) -> FloatArray:
        """From the orbit to its mirror image half an orbit later, as shares of its size."""
        half = 0.5 * self.order / system.excitation.frequency
        start = (float(unknowns[0]), float(unknowns[1]))
        # Far better than what is asked: an orbit next to a symmetric one is none.
        rtol = min(max(1e-3 * tolerance, 1e-13), 1e-9)
        end = simulate(system, half, initial=start, method="smooth", rtol=rtol, times=()).attrs
        apart = np.array([end["final_angle"] + start[0], end["final_velocity"] + start[1]])
        sizes = np.max(np.abs(self._states(unknowns)), axis=0)
        omega = system.excitation.angular_frequency
        return np.asarray(apart * [omega, 1.0] / np.max(sizes * [omega, 1.0]))

    def halved(self, unknowns: FloatArray) -> tuple[Strobe, FloatArray]:
        """The same: nothing is gained by symmetry."""
        return self, unknowns

    def whole(self, unknowns: FloatArray) -> tuple[Strobe, FloatArray]:
        """The same: nothing is assumed of symmetry."""
        return self, unknowns

    def doubled(self, unknowns: FloatArray) -> tuple[Strobe, FloatArray]:
        """The same orbit, gone through twice."""
        return Strobe(2 * self.order), np.tile(unknowns, 2)

    def through(
        self, state: FloatArray, problem: Any, periods: int
    ) -> tuple[FloatArray, FloatArray]:
        """Where some periods lead from a state, and the derivative of that."""
        whole = np.eye(2)
        for _ in range(periods):
            state, derivative = self._period(state, problem, derivative=True)
            whole = derivative @ whole
        return state, whole

    def _states(self, unknowns: FloatArray) -> FloatArray:
        return unknowns.reshape(-1, 2)

    def _closed(self, unknowns: FloatArray, ends: list[FloatArray]) -> FloatArray:
        return (np.array(ends) - np.roll(self._states(unknowns), -1, axis=0)).ravel()

    def _period(
        self, state: FloatArray, problem: Any, *, derivative: bool
    ) -> tuple[FloatArray, FloatArray]:
        """Where a period of the torque leads, and the derivative of that."""
        from wedgebrake.solvers.smooth.solve_periods import period_map

        there = period_map(
            problem, float(state[0]), float(state[1]), _MOST_STEPS, derivative=derivative
        )
        if there.outcome != Outcome.COMPLETED:
            raise NoOrbitError
        return np.array([there.angle, there.velocity]), there.matrix
