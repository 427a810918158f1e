"""The equations of an orbit with a smooth friction law: a map from period to period."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from wedgebrake.analysis.responses.sticking import sticks
from wedgebrake.arrays import FloatArray
from wedgebrake.dynamics.enums import Outcome
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.orbits.equations.equations import Measures, NoOrbitError
from wedgebrake.orbits.equations.floquet import Floquet
from wedgebrake.orbits.equations.multiple_shooting import MultipleShooting
from wedgebrake.orbits.section import Section
from wedgebrake.solvers.simulate import simulate

_MOST_STEPS = 1_000_000
_SAMPLES = 400


class StroboscopicMap(MultipleShooting):
    """Equations of an orbit for its angles [rad] and velocities [rad/s] at t = 0, T, ..."""

    # The flow is computed to a tolerance.
    to_rounding = False

    def scales(self, unknowns: FloatArray, problem: Any) -> FloatArray:
        """The angle scale of the orbit, and the corresponding velocity."""
        angle, velocity = np.max(np.abs(self._points(unknowns)), axis=0)
        # At the section one of them may vanish where the other is largest.
        omega = problem.problem.torque.angular_frequency
        velocity = max(velocity, omega * angle) or 1.0
        return np.tile([max(angle, velocity / omega), velocity], self.order)

    def _advanced(
        self, points: FloatArray, problem: Any, *, derivative: bool = True
    ) -> tuple[FloatArray, list[FloatArray]]:
        sign = -1.0 if self.half else 1.0
        found = [_period(one, problem, derivative=derivative, half=self.half) for one in points]
        return np.array([sign * end for end, _ in found]), [sign * matrix for _, matrix in found]

    def duration(self, unknowns: FloatArray, problem: Any) -> float:  # noqa: ARG002
        """Period of the orbit [s]."""
        return float(self.order * 2.0 * math.pi / problem.problem.torque.angular_frequency)

    def floquet(self, unknowns: FloatArray, problem: Any) -> Floquet:
        """Floquet multipliers."""
        _, derivatives = self._advanced(self._points(unknowns), problem)
        monodromy = np.eye(len(derivatives[0]))
        for derivative in derivatives:
            monodromy = derivative @ monodromy
        determinant = float(np.prod([np.linalg.det(derivative) for derivative in derivatives]))
        return Floquet.of_plane(float(np.trace(monodromy)), determinant, half=self.half)

    def points(self, unknowns: FloatArray, problem: Any) -> FloatArray:  # noqa: ARG002
        """(order, 2) states at the section."""
        return self._points(self.whole(unknowns)[1]).copy()

    def measures(self, unknowns: FloatArray, problem: Any, system: BrakedDriveline) -> Measures:
        """Amplitudes, sticking, events and torque, from a simulation of the orbit."""
        start = (float(unknowns[0]), float(unknowns[1]))
        response = simulate(
            system, periods=self.order, initial=start, method="smooth",
            rtol=problem.problem.tolerances.relative, samples_per_period=_SAMPLES,
        )  # fmt: skip
        stuck = sticks(response, 0.0).attrs
        return Measures(
            velocity_amplitude=0.5 * float(np.ptp(response["velocity"].to_numpy())),
            angle_amplitude=0.5 * float(np.ptp(response["angle"].to_numpy())),
            stick_share=float(stuck["share"]),
            sticks_forward=stuck["count_forward"] / self.order,
            sticks_backward=stuck["count_backward"] / self.order,
            events=response.sizes["event"] / self.order,
            peak_torque=float(np.max(np.abs(response["brake_torque"].to_numpy()))),
        )

    def mirror_difference(
        self,
        unknowns: FloatArray,
        problem: Any,  # noqa: ARG002
        system: BrakedDriveline,
        tolerance: float,
    ) -> FloatArray:
        """Difference to the mirror image half an orbit later, in shares of the orbit's size."""
        section = Section.of_driveline(system)
        states = self._points(unknowns)
        # Much smaller than the tolerance: an orbit near a symmetric one is not symmetric.
        rtol = min(max(1e-3 * tolerance, 1e-13), 1e-9)
        end = simulate(
            system, 0.5 * self.order / system.excitation.frequency, method="smooth", rtol=rtol,
            times=(), initial=(float(unknowns[0]), float(unknowns[1])),
        ).attrs  # fmt: skip
        apart = np.array([end["final_angle"], end["final_velocity"]]) + states[0]
        return np.asarray(section.scaled(apart) / np.max(np.abs(section.scaled(states))))


def _period(
    state: FloatArray, problem: Any, *, derivative: bool = True, half: bool = False
) -> tuple[FloatArray, FloatArray]:
    """The state one period of the torque later, or half of it, and its derivative."""
    from wedgebrake.solvers.smooth.solve_periods import advance

    begin = (float(state[0]), float(state[1]))
    there = advance(problem, begin, 1, _MOST_STEPS, derivative=derivative, half=half)
    if there.outcome != Outcome.COMPLETED:
        raise NoOrbitError
    return np.array(there.state), there.matrices.reshape(-1, 2)
