"""The equations of an orbit with a smooth friction law: a map from period to period."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from wedgebrake.analysis.responses.sticking import sticks
from wedgebrake.arrays import FloatArray
from wedgebrake.dynamics.enums import Outcome
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.orbits.equations.equations import NoOrbitError, PartMeasures
from wedgebrake.orbits.equations.floquet import Floquet
from wedgebrake.orbits.equations.multiple_shooting import MultipleShooting
from wedgebrake.orbits.equations.varied_return import VariedReturn
from wedgebrake.orbits.section import Section
from wedgebrake.solvers.machine.passage import Passage, Record
from wedgebrake.solvers.simulate import simulate

_MOST_STEPS = 1_000_000


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

    def by_parameters(self, unknowns: FloatArray, varied: VariedReturn) -> FloatArray:
        """Derivative of F with respect to parameters, (size, parameters)."""
        flow = varied.flow
        points = flow.points(self._points(unknowns))
        found = [flow.on_section.back @ varied.changes(one, half=self.half) for one in points]
        return np.concatenate(found)

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

    def twists(
        self, unknowns: FloatArray, problem: Any, system: BrakedDriveline
    ) -> tuple[FloatArray, FloatArray]:
        """Half range and largest magnitude of the angle [rad]."""
        passage = self._passage(unknowns, problem, system, Record.EXTREMES)
        ends = np.array([passage.low[0], passage.high[0]])
        return 0.5 * np.ptp(ends, keepdims=True), np.max(np.abs(ends), keepdims=True)

    def measures(self, unknowns: FloatArray, problem: Any, system: BrakedDriveline) -> PartMeasures:
        """Amplitudes, sticking, events and torque."""
        passage = self._passage(unknowns, problem, system, Record.DETAILS)
        angle, velocity = 0.5 * (passage.high - passage.low)
        response = simulate(
            system, periods=self.order, initial=_start(unknowns), method="smooth", times=(),
            rtol=problem.problem.tolerances.relative,
        )  # fmt: skip
        stuck = sticks(response, 0.0).attrs
        return PartMeasures(
            velocity_amplitude=np.array([velocity]),
            angle_amplitude=np.array([angle]),
            stick_share=np.array([stuck["share"]]),
            peak_torque=passage.peak_torque,
            sticks_forward=stuck["count_forward"] / self.order,
            sticks_backward=stuck["count_backward"] / self.order,
            events=response.sizes["event"] / self.order,
        )

    def _passage(
        self, unknowns: FloatArray, problem: Any, system: BrakedDriveline, record: Record
    ) -> Passage:
        """The orbit, with its extremes."""
        from wedgebrake.solvers.smooth.course import StepperCourse

        rtol = problem.problem.tolerances.relative
        course = StepperCourse(system, _start(unknowns), rtol)
        return course.advance(None, self.order, record=record, max_events=_MOST_STEPS)

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
            times=(), initial=_start(unknowns),
        ).attrs  # fmt: skip
        apart = np.array([end["final_angle"], end["final_velocity"]]) + states[0]
        return np.asarray(section.scaled(apart) / np.max(np.abs(section.scaled(states))))


def _start(unknowns: FloatArray) -> tuple[float, float]:
    return float(unknowns[0]), float(unknowns[1])


def _period(
    state: FloatArray, problem: Any, *, derivative: bool = True, half: bool = False
) -> tuple[FloatArray, FloatArray]:
    """The state one period of the torque later, or half of it, and its derivative."""
    from wedgebrake.solvers.smooth.solve_periods import advance

    there = advance(problem, _start(state), 1, _MOST_STEPS, derivative=derivative, half=half)
    if there.outcome != Outcome.COMPLETED:
        raise NoOrbitError
    return np.array(there.state), there.matrices.reshape(-1, 2)
