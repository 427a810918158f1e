"""The equations of an orbit with a smooth friction law: a map from period to period."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from wedgebrake.analysis.sticking import sticks
from wedgebrake.dynamics.enums import Outcome
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.orbits.floquet import Floquet
from wedgebrake.orbits.problem import FloatArray, Measures, NoOrbitError, Records, Section
from wedgebrake.orbits.segment_orbit import MARGINS
from wedgebrake.solvers.simulate import simulate

_MOST_STEPS = 1_000_000
_SAMPLES = 400


class StroboscopicMap:
    """An orbit as its states at the section, by multiple shooting.

    The unknowns are the states (angle [rad] and velocity [rad/s]) at t = 0, T, ...; the equations
    require that the flow leads from each state to the next.
    """

    sequence = ""
    # The flow is computed to a tolerance.
    to_rounding = False

    def __init__(self, order: int) -> None:
        self.order = order

    @property
    def size(self) -> int:
        """Two unknowns for each period."""
        return 2 * self.order

    def scales(self, unknowns: FloatArray, problem: Any) -> FloatArray:
        """The angle scale of the orbit, and the corresponding velocity."""
        angle, velocity = np.max(np.abs(self._states(unknowns)), axis=0)
        # At the section one of them may vanish where the other is largest.
        omega = problem.problem.torque.angular_frequency
        velocity = max(velocity, omega * angle) or 1.0
        return np.tile([max(angle, velocity / omega), velocity], self.order)

    def residual(self, unknowns: FloatArray, problem: Any) -> FloatArray:
        """F(u)."""
        states = self._states(unknowns)
        ends = [_period(state, problem, derivative=False)[0] for state in states]
        return (np.array(ends) - np.roll(states, -1, axis=0)).ravel()

    def linearize(self, unknowns: FloatArray, problem: Any) -> tuple[FloatArray, FloatArray]:
        """F(u) and its derivative."""
        states = self._states(unknowns)
        ends, derivatives = zip(*(_period(one, problem) for one in states), strict=True)
        n = states.shape[1]
        blocks = np.zeros((self.order, n, self.order, n))
        for k, derivative in enumerate(derivatives):
            blocks[k, :, k] += derivative
            blocks[k, :, (k + 1) % self.order] -= np.eye(n)
        values = (np.array(ends) - np.roll(states, -1, axis=0)).ravel()
        return values, blocks.reshape(self.size, self.size)

    def sequence_at(self, unknowns: FloatArray, problem: Any) -> str:  # noqa: ARG002
        """Return no segments: the flow is smooth."""
        return self.sequence

    def duration(self, unknowns: FloatArray, problem: Any) -> float:  # noqa: ARG002
        """Period of the orbit [s]."""
        return float(self.order * 2.0 * math.pi / problem.problem.torque.angular_frequency)

    def floquet(self, unknowns: FloatArray, problem: Any) -> Floquet:
        """Floquet multipliers."""
        derivatives = [_period(state, problem)[1] for state in self._states(unknowns)]
        monodromy = np.eye(len(derivatives[0]))
        for derivative in derivatives:
            monodromy = derivative @ monodromy
        determinant = float(np.prod([np.linalg.det(derivative) for derivative in derivatives]))
        return Floquet.of_plane(float(np.trace(monodromy)), determinant)

    def margins(self, unknowns: FloatArray, problem: Any) -> Records:  # noqa: ARG002
        """Return no margins: a smooth flow has no segments."""
        return np.empty(0, dtype=MARGINS)

    def follows_flow(
        self,
        unknowns: FloatArray,  # noqa: ARG002
        problem: Any,  # noqa: ARG002
        growth: float,  # noqa: ARG002
    ) -> bool:
        """Return True: the equations are the flow itself."""
        return True

    def points(self, unknowns: FloatArray, problem: Any) -> FloatArray:  # noqa: ARG002
        """(order, 2) states at the section."""
        return self._states(unknowns).copy()

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
        self, unknowns: FloatArray, system: BrakedDriveline, tolerance: float
    ) -> FloatArray:
        """Difference to the mirror image half an orbit later, in shares of the orbit's size."""
        section = Section.of(system)
        states = self._states(unknowns)
        # Much smaller than the tolerance: an orbit near a symmetric one is not symmetric.
        rtol = min(max(1e-3 * tolerance, 1e-13), 1e-9)
        end = simulate(
            system, 0.5 * self.order / system.excitation.frequency, method="smooth", rtol=rtol,
            times=(), initial=(float(unknowns[0]), float(unknowns[1])),
        ).attrs  # fmt: skip
        apart = np.array([end["final_angle"], end["final_velocity"]]) + states[0]
        return np.asarray(section.scaled(apart) / np.max(np.abs(section.scaled(states))))

    def halved(self, unknowns: FloatArray) -> tuple[StroboscopicMap, FloatArray]:
        """The same equations: nothing is gained by symmetry."""
        return self, unknowns

    def whole(self, unknowns: FloatArray) -> tuple[StroboscopicMap, FloatArray]:
        """The same equations: they assume no symmetry."""
        return self, unknowns

    def doubled(self, unknowns: FloatArray) -> tuple[StroboscopicMap, FloatArray]:
        """Equations of the same orbit traversed twice."""
        return StroboscopicMap(2 * self.order), np.tile(unknowns, 2)

    def _states(self, unknowns: FloatArray) -> FloatArray:
        return unknowns.reshape(self.order, -1)


def iterate(state: FloatArray, problem: Any, periods: int) -> tuple[FloatArray, FloatArray]:
    """States of a smooth flow at the section, (periods + 1, n), and the last one's derivative."""
    states, matrix = [state], np.eye(state.size)
    for _ in range(periods):
        end, derivative = _period(states[-1], problem)
        states.append(end)
        matrix = derivative @ matrix
    return np.array(states), matrix


def _period(
    state: FloatArray, problem: Any, *, derivative: bool = True
) -> tuple[FloatArray, FloatArray]:
    """The state one period of the torque later, and its derivative."""
    from wedgebrake.solvers.smooth.solve_periods import advance

    begin = (float(state[0]), float(state[1]))
    there = advance(problem, begin, 1, _MOST_STEPS, derivative=derivative)
    if there.outcome != Outcome.COMPLETED:
        raise NoOrbitError
    return np.array(there.state), there.matrices.reshape(-1, 2)
