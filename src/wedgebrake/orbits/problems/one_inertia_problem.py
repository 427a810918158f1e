"""Orbits of one inertia, driven by a sine, with set-valued or with smooth friction."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar

import numpy as np

from wedgebrake.analysis.evaluate import classify_line
from wedgebrake.analysis.machine_motion.result import MachineResult
from wedgebrake.analysis.run_settings import Protocol, protocol
from wedgebrake.arrays import FloatArray
from wedgebrake.dynamics.enums import MotionClass, Outcome
from wedgebrake.dynamics.problem import Problem
from wedgebrake.errors import InputError
from wedgebrake.model.machine_parts import speed_at
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.orbits.bifurcation_types import Kind
from wedgebrake.orbits.equations.equations import NoOrbitError, OrbitEquations
from wedgebrake.orbits.equations.odd_symmetry import alike_in_both_directions
from wedgebrake.orbits.equations.segment_bvp import from_log, run
from wedgebrake.orbits.equations.stroboscopic_map import StroboscopicMap
from wedgebrake.orbits.equations.varied_segments import VariedSegments
from wedgebrake.orbits.orbit_status import OrbitStatus
from wedgebrake.orbits.problems.machine_problem import MachineOrbitProblem
from wedgebrake.orbits.problems.problem import Guesses, OrbitProblem, points_near_returns
from wedgebrake.orbits.section import Section
from wedgebrake.solvers.machine.final_state import FinalState
from wedgebrake.solvers.machine.passage import Course, Every
from wedgebrake.solvers.task import check_state

# Share of a period within which a state is at a return.
_AT_RETURN = 1e-9
# Length of a run that records an irregular motion, and its part that is discarded [periods].
_RECORDED, _SKIPPED = 1200, 200


@dataclass(frozen=True, eq=False)
class OneInertiaProblem(OrbitProblem):
    """Continuation problem of one inertia, whose orbits are sampled at t = 0, T, 2 T, ...

    solver : name of the method that computes its motion
    """

    solver: ClassVar[str]

    @property
    def self_excited(self) -> bool:
        """False: the torque has a period."""
        return False

    @property
    def isolated(self) -> bool:
        """True if orbits are isolated: no shift in time or angle gives another orbit."""
        line = self.form(self.base)
        return bool(line.driveline.stiffness and line.excitation.amplitude)

    @property
    def weights(self) -> FloatArray:
        """Factors of angle and velocity."""
        line = self.form(self.base)
        natural = line.driveline.natural_frequency
        return np.array([natural or line.excitation.angular_frequency, 1.0])

    def form(self, system: Any) -> BrakedDriveline:
        """The system as a driveline; raises ``NoOrbitError`` if it is none."""
        found: BrakedDriveline | None = system.one_inertia
        if found is None:
            raise NoOrbitError("not a driveline")
        return found

    def covers(self, system: Any) -> bool:
        """Return False if its equations are not those of one inertia."""
        return system.one_inertia is not None

    def section(self, values: tuple[float, ...]) -> Section:
        """The stroboscopic section."""
        return Section.of_driveline(self.form(self.system(values)))

    def has_odd_symmetry(self, values: tuple[float, ...]) -> bool:
        """Return True for a brake that acts equally in both directions, on a shaft at rest."""
        line = self.form(self.system(values))
        return alike_in_both_directions(line.brake) and line.driveline.constant_speed == 0.0

    def of(self, system: Any) -> OrbitProblem:
        """The same for another system, by the equations of machines if it is no driveline."""
        if self.covers(system):
            return super().of(system)
        return MachineOrbitProblem(system, self.method, self.rtol)

    def general(
        self, equations: OrbitEquations, unknowns: FloatArray
    ) -> tuple[OrbitProblem, OrbitEquations, FloatArray]:
        """The same orbit by the equations of machines."""
        problem = MachineOrbitProblem(self.base, self.method, self.rtol)
        states = equations.points(unknowns, self.kernel_problem(()))[:1]
        (point,) = problem.kernel_problem(()).points(states)
        return problem, *problem.equations_at(point, equations.order)

    def kinematics(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Angles and velocities of points, by inertia if the system names it."""
        if self.inertias:
            return points[..., :1], points[..., 1:]
        return points[..., 0], points[..., 1]

    def initial(self, point: FloatArray) -> tuple[float, float] | FinalState:
        """Initial state at a point: a pair of numbers, or by inertia if the system names it."""
        angle, velocity = map(float, point)
        if not self.inertias:
            return angle, velocity
        (name,) = self.inertias
        return FinalState(0.0, {name: angle}, {name: velocity}, held=((),))

    def _start(self, initial: Any) -> tuple[float, float]:
        """Angle and velocity at t = 0, or at the first return of a given state."""
        if initial is None:
            (inertia,) = self.base.machine.inertias
            return inertia.angle, speed_at(inertia, 0.0)
        if not isinstance(initial, FinalState):
            return check_state("initial", initial)
        machine = self.base.machine
        course = Course(machine, initial, method=self.method)
        if abs(math.remainder(course.time, machine.period)) > _AT_RETURN * machine.period:
            course.advance(Every(machine.period), 1)
        angle, velocity = course.state.z[:2, 0].tolist()
        return angle, velocity

    def guesses(self, order: int | None, initial: Any, limit: int) -> Guesses:
        """The settled motion, or where it nearly returns after ``order`` periods."""
        settling = protocol(None, "auto", limit)
        if order is not None and initial is not None:
            return self._found(order, [np.array(self._start(initial))])
        result = self._classified(initial, settling)
        if result.outcome != Outcome.COMPLETED:
            return Guesses(OrbitStatus.NO_RUN, self, order or 0)
        if result.motion == MotionClass.AT_REST:
            return Guesses(OrbitStatus.AT_REST, self, order or 0)
        settled = int(result.order)
        if order is None and not settled:
            return Guesses(OrbitStatus.of_irregular(result.motion), self)
        if order in (None, settled):
            return self._found(settled, [result.points[-1]])
        return self._found(order or 0, points_near_returns(result.points, order or 0))

    def _found(self, order: int, points: list[FloatArray]) -> Guesses:
        return Guesses(OrbitStatus.FOUND, self, order, points, self.isolated)

    def irregular_record(self, initial: Any) -> FloatArray:
        """Poincare points of a long run; none if orbits are not isolated or the run ends early."""
        if not self.isolated:
            return super().irregular_record(initial)
        result = self._classified(initial, protocol(_RECORDED, _SKIPPED, rtol=self.rtol))
        return result.points[: None if result.outcome == Outcome.COMPLETED else 0]

    def _classified(self, initial: Any, wanted: Protocol) -> MachineResult:
        """The motion that begins at a state."""
        machine = self.base.machine.started_at(*self._start(initial))
        return classify_line(machine, self.form(self.base), self.method, wanted)


@dataclass(frozen=True, eq=False)
class SegmentProblem(OneInertiaProblem):
    """One inertia with set-valued friction: orbits solve a boundary-value problem of segments."""

    subject: ClassVar[str] = "one inertia"
    solver: ClassVar[str] = "exact"

    def can_follow(self, kind: Kind) -> bool:
        """Return True for all but branch points and Hopf points.

        The equations of segments have margins that vanish at bifurcations of friction.
        """
        return kind not in (Kind.BRANCH_POINT, Kind.HOPF)

    def assemble(self, system: Any) -> Any:
        """A system in the form of the exact solver."""
        from wedgebrake.solvers.event_driven.solve import problem

        return problem(self.form(system))

    def by_parameters(
        self, equations: OrbitEquations, unknowns: FloatArray, values: tuple[float, ...]
    ) -> FloatArray | None:
        """Exact derivative of the equations; None where pieces of the brake's law begin or end."""
        given = dict(zip(self.names, values, strict=True))

        def at(name: str, value: float) -> Problem:
            try:
                found: Problem = self.assemble(self.system(tuple((given | {name: value}).values())))
            except NoOrbitError as error:
                raise InputError(str(error)) from None
            return found

        varied = VariedSegments.of(self.kernel_problem(values), given, at)
        return None if varied is None else equations.by_parameters(unknowns, varied)

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
class StroboscopicProblem(OneInertiaProblem):
    """One inertia with smooth friction: orbits are those of the map from period to period."""

    subject: ClassVar[str] = "one inertia with smooth friction"
    solver: ClassVar[str] = "smooth"

    @cached_property
    def _machine(self) -> MachineOrbitProblem:
        """The problem by the equations of machines."""
        return MachineOrbitProblem(self.base, self.method, self.rtol, self.names, self.scales)

    def assemble(self, system: Any) -> Any:
        """A system in the form of the smooth solver."""
        from wedgebrake.solvers.smooth.assemble import problem

        return problem(self.form(system), self.rtol, any_law=True)

    def by_parameters(
        self, equations: OrbitEquations, unknowns: FloatArray, values: tuple[float, ...]
    ) -> FloatArray | None:
        """Exact derivative of the equations, by the return map of the machine."""
        varied = self._machine.varied(values)
        return None if varied is None else equations.by_parameters(unknowns, varied)

    def returned(self, point: FloatArray, order: int) -> tuple[FloatArray, FloatArray]:
        """The state some periods later, and its derivative."""
        return StroboscopicMap(order, point.size).returned(point, self.kernel_problem(()))

    def equations_at(self, point: FloatArray, order: int) -> tuple[OrbitEquations, FloatArray]:
        """Equations of the states at successive periods."""
        return StroboscopicMap(order, point.size).through(point, self.kernel_problem(()))
