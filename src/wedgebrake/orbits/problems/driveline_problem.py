"""Orbits of a driveline, with set-valued or with smooth friction."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from wedgebrake.analysis.driveline_motion.classify_driveline import classify_driveline
from wedgebrake.analysis.run_settings import protocol
from wedgebrake.arrays import FloatArray
from wedgebrake.dynamics.enums import MotionClass, Outcome
from wedgebrake.orbits.bifurcation_types import Kind
from wedgebrake.orbits.equations.equations import OrbitEquations
from wedgebrake.orbits.equations.odd_symmetry import alike_in_both_directions
from wedgebrake.orbits.equations.segment_bvp import from_log, run
from wedgebrake.orbits.equations.stroboscopic_map import StroboscopicMap
from wedgebrake.orbits.orbit_status import OrbitStatus
from wedgebrake.orbits.problems.problem import Guesses, OrbitProblem, points_near_returns
from wedgebrake.orbits.section import Section
from wedgebrake.solvers.task import check_state

# Length of a run that records an irregular motion, and its part that is discarded [periods].
_RECORDED, _SKIPPED = 1200, 200


@dataclass(frozen=True, eq=False)
class DrivelineProblem(OrbitProblem):
    """Continuation problem of a driveline, whose orbits are sampled at t = 0, T, 2 T, ..."""

    @property
    def self_excited(self) -> bool:
        """False: the torque has a period."""
        return False

    @property
    def isolated(self) -> bool:
        """True if orbits are isolated: no shift in time or angle gives another orbit."""
        return bool(self.base.driveline.stiffness and self.base.excitation.amplitude)

    @property
    def weights(self) -> FloatArray:
        """Factors of angle and velocity."""
        natural = self.base.driveline.natural_frequency
        return np.array([natural or self.base.excitation.angular_frequency, 1.0])

    def section(self, values: tuple[float, ...]) -> Section:
        """The stroboscopic section."""
        return Section.of_driveline(self.system(values))

    def has_odd_symmetry(self, values: tuple[float, ...]) -> bool:
        """Return True for a brake that acts equally in both directions, on a shaft at rest."""
        system = self.system(values)
        return alike_in_both_directions(system.brake) and system.driveline.drive_speed == 0.0

    def kinematics(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Angles and velocities of points."""
        return points[..., 0], points[..., 1]

    def guesses(self, order: int | None, initial: Any, limit: int) -> Guesses:
        """The settled motion, or where it nearly returns after ``order`` periods."""
        settling = protocol(None, "auto", limit)
        start = check_state("initial", (0.0, 0.0) if initial is None else initial)
        if order is not None and initial is not None:
            return self._found(order, [np.array(start)])
        result, record = classify_driveline(self.base, start, self.method, settling)
        if result.outcome != Outcome.COMPLETED:
            return Guesses(OrbitStatus.NO_RUN, self, order or 0)
        if result.motion == MotionClass.AT_REST:
            return Guesses(OrbitStatus.AT_REST, self, order or 0)
        settled = int(result.order)
        if order is None and not settled:
            return Guesses(OrbitStatus.of_irregular(result.motion), self)
        if order in (None, settled):
            final = np.array([result.final_angle, result.final_velocity])
            return self._found(settled, [final])
        return self._found(order or 0, points_near_returns(record, order or 0))

    def _found(self, order: int, points: list[FloatArray]) -> Guesses:
        return Guesses(OrbitStatus.FOUND, self, order, points, self.isolated)

    def irregular_record(self, initial: Any) -> FloatArray:
        """Poincare points of a long run; none if orbits are not isolated or the run ends early."""
        if not self.isolated:
            return super().irregular_record(initial)
        start = check_state("initial", initial or (0.0, 0.0))
        run_for = protocol(_RECORDED, _SKIPPED, rtol=self.rtol)
        result, record = classify_driveline(self.base, start, self.method, run_for)
        return record if result.outcome == Outcome.COMPLETED else record[:0]


@dataclass(frozen=True, eq=False)
class ExactDriveline(DrivelineProblem):
    """A driveline with set-valued friction: orbits solve a boundary-value problem of segments."""

    subject: ClassVar[str] = "a driveline"

    def can_follow(self, kind: Kind) -> bool:
        """Return True for all but branch points and Hopf points.

        The equations of segments have margins that vanish at bifurcations of friction.
        """
        return kind not in (Kind.BRANCH_POINT, Kind.HOPF)

    def assemble(self, system: Any) -> Any:
        """A driveline in the form of the exact solver."""
        from wedgebrake.solvers.event_driven.solve import problem

        return problem(system)

    def returned(self, point: FloatArray, order: int) -> tuple[FloatArray, FloatArray]:
        """The state some periods later, and its derivative."""
        there = run(self.kernel_problem(()), point, order)
        return there.end, there.matrix

    def equations_at(
        self, point: FloatArray, order: int
    ) -> tuple[OrbitEquations, FloatArray] | None:
        """Equations of the segments of a run."""
        problem = self.kernel_problem(())
        return from_log(run(problem, point, order).log, problem, order)


@dataclass(frozen=True, eq=False)
class SmoothDriveline(DrivelineProblem):
    """A driveline with smooth friction: orbits are those of the map from period to period."""

    subject: ClassVar[str] = "a driveline with smooth friction"

    def assemble(self, system: Any) -> Any:
        """A driveline in the form of the smooth solver."""
        from wedgebrake.solvers.smooth.assemble import problem

        return problem(system, self.rtol, any_law=True)

    def returned(self, point: FloatArray, order: int) -> tuple[FloatArray, FloatArray]:
        """The state some periods later, and its derivative."""
        return StroboscopicMap(order, point.size).returned(point, self.kernel_problem(()))

    def equations_at(self, point: FloatArray, order: int) -> tuple[OrbitEquations, FloatArray]:
        """Equations of the states at successive periods."""
        return StroboscopicMap(order, point.size).through(point, self.kernel_problem(()))
