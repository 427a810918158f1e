"""Orbits of a machine, sampled once per period of its signals or, if none varies, per crossing.

A crossing is where a speed, or the rate of an angle, rises through a level.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, ClassVar

import numpy as np

from wedgebrake.analysis.evaluate import classify_machine
from wedgebrake.analysis.machine_motion.coordinates import Coordinates, coordinates
from wedgebrake.analysis.machine_motion.return_run import Prepared, ReturnRun
from wedgebrake.analysis.machine_motion.section import FIRST_LOOK, RETURNS_WITHIN, crossing
from wedgebrake.analysis.run_settings import protocol
from wedgebrake.arrays import FloatArray
from wedgebrake.dynamics.enums import MotionClass, Outcome
from wedgebrake.errors import InputError
from wedgebrake.model.joints import free_motions
from wedgebrake.model.machine import Machine
from wedgebrake.model.machine_matrices import contact_rows, shaft_rows
from wedgebrake.model.signals.signals import check_repeat
from wedgebrake.model.validation import check_instance, wrong
from wedgebrake.orbits.bifurcation_types import Kind
from wedgebrake.orbits.equations.equations import NoOrbitError, OrbitEquations
from wedgebrake.orbits.equations.machine_flow import MachineFlow, check_samples
from wedgebrake.orbits.equations.odd_symmetry import has_odd_symmetry
from wedgebrake.orbits.equations.return_map import ReturnMap
from wedgebrake.orbits.equations.section_coordinates import SectionCoordinates
from wedgebrake.orbits.equations.varied_return import VariedReturn
from wedgebrake.orbits.orbit_status import OrbitStatus
from wedgebrake.orbits.problems.problem import Guesses, OrbitProblem, points_near_returns
from wedgebrake.orbits.section import Section
from wedgebrake.solvers.machine.final_state import FinalState
from wedgebrake.solvers.machine.passage import Course, Crossing, Every
from wedgebrake.solvers.task import check_state

# Events after which the search for a return ends.
_MOST_EVENTS = 100_000
# Number of recorded returns of a motion whose order is not the requested one.
_RECORDED = 400
# Largest time until a return, in periods of the motion.
LONGEST_RETURN = 100.0
# Slightly less than one period, so that its last crossing, which repeats the first, is not counted.
_ONE_PERIOD = 1.0 - 1e-6
# Relative size of what vanishes up to rounding: distances, rates, the slip of a contact that holds.
_VANISHES = 1e-9
# Classes of motion that lead to no isolated orbit.
_WITHOUT_ORBIT = {
    MotionClass.AT_REST: OrbitStatus.AT_REST,
    MotionClass.STEADY_SLIDING: OrbitStatus.STEADY_SLIDING,
    MotionClass.FREE_VIBRATION: OrbitStatus.NOT_ISOLATED,
    MotionClass.STEADY_ROTATION: OrbitStatus.NOT_ISOLATED,
    MotionClass.SELF_LOCKED: OrbitStatus.NO_RUN,
}


@dataclass(frozen=True, eq=False)
class MachineOrbitProblem(OrbitProblem):
    """Continuation problem of a machine; ``size`` is in the units of ``ReturnMap.scales``.

    crossing : section of a self-excited machine; None for a driven one, or if it is still to be
               chosen from the motion
    longest  : longest time between two crossings [s]
    start    : initial angles [rad] and speeds [rad/s] of the inertias; None for those of the system
    """

    subject: ClassVar[str] = "a machine"
    unused: ClassVar[tuple[str, ...]] = ("rtol", "max_steps")
    imposes: ClassVar[bool] = True

    crossing: Crossing | None = None
    longest: float = math.inf
    start: tuple[Any, Any] | None = None

    @property
    def self_excited(self) -> bool:
        """True if no signal varies in time."""
        return bool(self.base.autonomous)

    def form(self, system: Any) -> Machine:
        """The machine of a system."""
        machine: Machine = system.machine
        return machine if self.start is None else machine.started_at(*self.start)

    @cached_property
    def machine(self) -> Machine:
        """The machine of the base."""
        return self.form(self.base)

    @cached_property
    def space(self) -> Coordinates:
        """Scaled coordinates of the states."""
        return _section_space(self.machine)

    @cached_property
    def _local(self) -> SectionCoordinates:
        """Coordinates of the section, the same for all values."""
        return SectionCoordinates(self.space, self.crossing, len(self.machine.inertias))

    def covers(self, system: Any) -> bool:
        """Return False if it has the state of a lag that the base does not have."""
        return _section_space(system.machine).size <= self.space.size

    def can_follow(self, kind: Kind) -> bool:
        """Return True for those of the smooth flow, and those that friction causes."""
        return super().can_follow(kind) or kind.of_friction

    def section(self, values: tuple[float, ...]) -> Section:  # noqa: ARG002
        """The section; its coordinates do not depend on the values."""
        return Section(self.space.to)

    def assemble(self, system: Any) -> MachineFlow:
        """The return map of a machine; raises ``NoOrbitError`` if it lacks states of the base."""
        machine = self.form(system)
        lags = sum(one.actuation.states for one in machine.contacts)
        lags += sum(len(one.memory) for one in machine.controllers)
        if 2 * len(machine.inertias) + lags != self.space.to.shape[1]:
            raise NoOrbitError("a lag or a controller has no state")
        return MachineFlow(machine, self._local, self.longest, self.method)

    def by_parameters(
        self, equations: OrbitEquations, unknowns: FloatArray, values: tuple[float, ...]
    ) -> FloatArray | None:
        """Exact derivative of the equations with respect to the parameters."""
        varied = self.varied(values)
        return None if varied is None else equations.by_parameters(unknowns, varied)

    def varied(self, values: tuple[float, ...]) -> VariedReturn | None:
        """The derivative of the return map with respect to the parameters; None: there is none."""
        given = dict(zip(self.names, values, strict=True))

        def machine_at(name: str, value: float) -> Machine:
            return self.form(self.system(tuple((given | {name: value}).values())))

        try:
            return VariedReturn(self.kernel_problem(values), given, machine_at)
        except (InputError, NoOrbitError):  # without a torque, a driven machine has no return
            return None

    def has_odd_symmetry(self, values: tuple[float, ...]) -> bool:
        """Return True if the mirror image of a motion, half a period later, is a motion."""
        return has_odd_symmetry(self.form(self.system(values)))

    def kinematics(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Angles and speeds, by inertia if the system names them."""
        n = len(self.machine.inertias)
        if not self.inertias:
            return points[..., 0], points[..., n]
        return points[..., :n], points[..., n : 2 * n]

    def returned(self, point: FloatArray, order: int) -> tuple[FloatArray, FloatArray]:
        """The point some returns later, and its derivative."""
        return ReturnMap(order, point.size).returned(point, self.kernel_problem(()))

    def equations_at(self, point: FloatArray, order: int) -> tuple[OrbitEquations, FloatArray]:
        """Equations of the points at successive returns."""
        return ReturnMap(order, point.size).through(point, self.kernel_problem(()))

    def guesses(self, order: int | None, initial: Any, limit: int) -> Guesses:
        """Points near an orbit: those of the settled motion, or those where it nearly returns.

        Raises ``InputError`` for signals without a common period.
        """
        if initial is None or isinstance(initial, FinalState):
            return self._guesses(order, initial, limit, near=initial is not None)
        if len(self.machine.inertias) > 1:
            check_instance("initial", initial, FinalState, "a final state of wb.final_state")
        start = check_state("initial", initial)
        return replace(self, start=start)._guesses(order, None, limit, near=True)

    def _guesses(
        self, order: int | None, start: FinalState | None, limit: int, *, near: bool
    ) -> Guesses:
        """``guesses`` from a state; None for the initial state of the machine.

        near : whether the state is a guess if the order is given
        """
        machine, isolated = self.machine, not _has_free_speed(self.machine)
        settling = protocol(None, "auto", limit)
        check_samples(machine, _common_period(machine, self.base.own_name))
        if order is not None and near:
            problem = self._with_section(start, math.nan)
            first = list(problem._record(start, 1)[-1:])
            return Guesses(OrbitStatus.FOUND, problem, order, first, isolated)
        found = classify_machine(machine, settling, start, self.method)
        if found.outcome != Outcome.COMPLETED or found.final is None:
            return Guesses(OrbitStatus.NO_RUN, self, order or 0)
        if found.motion in _WITHOUT_ORBIT:
            return Guesses(_WITHOUT_ORBIT[found.motion], self, order or 0)
        if order is None and not found.order:
            return Guesses(OrbitStatus.of_irregular(found.motion), self)
        problem = self._with_section(found.final, found.period)
        settled = found.order
        if settled and self.self_excited:
            settled = problem._crossings(found.final, found.period)
        if order in (None, settled):
            order, points = settled, [problem._record(found.final, settled)[-1]]
        else:
            points = points_near_returns(problem._record(found.final, _RECORDED), order or 0)
        # The angles that a contact holds for ever are arbitrary.
        stuck = bool(np.any(found.contacts.stick_share >= 1.0 - _VANISHES))
        return Guesses(OrbitStatus.FOUND, problem, order or 0, points, isolated and not stuck)

    def _with_section(self, state: FinalState | None, period: float) -> MachineOrbitProblem:
        """The problem with a section chosen from the motion that begins at a state.

        period : of the motion [s]; nan if it is not known
        """
        if not self.self_excited:
            return self
        if not math.isfinite(period):
            period = FIRST_LOOK / RETURNS_WITHIN * self._time_of_return(state)
        section = self.crossing or self._choose(state, period)
        return replace(self, crossing=section, longest=LONGEST_RETURN * period)

    def _time_of_return(self, state: FinalState | None) -> float:
        """Time within which the motion that begins at a state is expected to return [s]."""
        run = ReturnRun(Prepared.by_series(self.machine, self.method, state), _MOST_EVENTS)
        run.take_section(run.advance(0, duration=FIRST_LOOK * self.space.longest_period))
        if run.completed:
            run.passages(1)
        return run.within

    def _course(self, state: FinalState | None, watched: FloatArray | None = None) -> Course:
        """Run of the motion that begins at a state."""
        return Course(self.machine, state, method=self.method, watched=watched)

    def _choose(self, state: FinalState | None, period: float) -> Crossing:
        """Choose the section of a self-excited motion.

        The rate of an angle that shafts restrain has a mean of zero over every orbit, so that every
        orbit of a branch crosses this level. Of these rates, the one with the fewest crossings is
        chosen; among equals, the one with the fewest sticks there, then with the largest range.
        """
        chosen: list[tuple[int, int, float, Crossing]] = []
        for rates in restrained_rates(self.machine, self.space):
            section = Crossing(tuple(map(float, rates)), 0.0)
            course = self._course(state, rates[None, :])
            if len(course.advance(section, 1, duration=period).times):
                sticks = int(np.sum(course.state.modes["side"] == 0))
                passage = course.advance(section, duration=_ONE_PERIOD * period)
                reach = float(passage.high[0] - passage.low[0])
                chosen.append((len(passage.times), sticks, -reach, section))
        if chosen:
            return min(chosen, key=lambda one: one[:3])[3]
        course = self._course(state, self.space.to)
        return crossing(course.advance(None, duration=period), self.space)

    def _crossings(self, state: FinalState, period: float) -> int:
        """Number of crossings in one period of a motion."""
        course = self._course(state)
        course.advance(self.crossing, 1, duration=2.0 * period)
        return 1 + len(course.advance(self.crossing, duration=_ONE_PERIOD * period).times)

    def _record(self, state: FinalState | None, returns: int) -> FloatArray:
        """The next points on the section, the first of them the state itself if it is on it.

        state : None for the initial state of the machine, which is then not among the points
        """
        flow, course = self.kernel_problem(()), self._course(state)
        section, begin = flow.section, course.state.z[: self.space.to.shape[1], 0].copy()
        points = []
        if state is not None and _is_on(section, state.time, begin):
            points, returns = [flow.point(state, begin)], returns - 1
        if flow.local.delays:
            # The forces that are delayed are recorded at the end of a passage.
            passages = (course.advance(section, 1) for _ in range(returns))
            points += [flow.end(one) for one in passages if len(one.times)]
        elif returns > 0:
            passage = course.advance(section, returns, duration=flow.longest * returns)
            points += list(flow.points(passage.states))
        return np.array(points)


def _section_space(machine: Machine) -> Coordinates:
    """Scaled coordinates of the state just before a return, which is the instant of a sample.

    The outputs of digital controllers are not among them, because the sample replaces them.
    """
    loops = [one for one in machine.controllers if one.sample_time is not None]
    kept = [name != "output" for one in loops for name in one.memory]
    return coordinates(machine).with_memory(kept)


def _is_on(section: Every | Crossing, time: float, states: FloatArray) -> bool:
    """Return True if a state lies on a section."""
    if isinstance(section, Every):
        return abs(math.remainder(time, section.period)) <= _VANISHES * section.period
    row = np.array(section.row)
    size = float(np.abs(row) @ np.abs(states))
    return abs(float(row @ states) - section.level) <= _VANISHES * size


def _has_free_speed(machine: Machine) -> bool:
    """Return True if inertias can rotate freely at a speed that no damper or contact restrains."""
    acts = np.array([one.stiffness != 0.0 or one.damping != 0.0 for one in machine.shafts], bool)
    motions = free_motions(machine)
    rows = np.vstack([shaft_rows(machine)[acts], contact_rows(machine)]) @ motions
    return not len(rows) or bool(np.linalg.matrix_rank(rows) < motions.shape[1])


def _common_period(machine: Machine, own_name: Callable[[str], str]) -> float:
    """The common period of the signals [s], 0 if none varies; ``InputError`` if there is none."""
    signals, period = machine.signals(), machine.period
    check_repeat(signals)
    if period is not None:
        return period
    frequencies = {name: one.frequencies() for name, one in signals.items()}
    varying = {name: found for name, found in frequencies.items() if found}
    name = next(iter(varying))
    each = "; ".join(
        f"{own_name(one)} {', '.join(f'{value:.9g}' for value in found)} Hz"
        for one, found in varying.items()
    )
    raise wrong(
        name, signals[name], "a signal that has a common period with the others",
        f"No orbit closes otherwise: the ratio of two frequencies ({each}) must be a fraction with"
        " a denominator of at most 64. Change a frequency, or use wb.motion.",
    )  # fmt: skip


def restrained_rates(machine: Machine, space: Coordinates) -> FloatArray:
    """Rates of the angles that are restrained by shafts, as rows of factors of the states.

    These are the rates of the scaled angles, and the speeds of inertias that cannot rotate freely,
    relative to the motion that follows the driven bodies.
    """
    n, states = len(machine.inertias), space.to.shape[1]
    rates = np.zeros((space.speeds.start + n, states))
    rates[: space.speeds.start, n : 2 * n] = space.to[: space.speeds.start, :n]
    relative = np.eye(n)
    relative[:, n - len(machine.driven) :] -= space.carried
    rates[space.speeds.start :, n : 2 * n] = relative
    turns = rates[:, n : 2 * n] @ (np.eye(states) - space.back @ space.to)[:n, :n] @ space.motions
    sizes = np.abs(rates).max(axis=1)
    rates = rates[(sizes > 0.0) & (np.abs(turns).max(axis=1) <= _VANISHES * sizes)]
    return np.asarray(rates / np.linalg.norm(rates @ space.back, axis=1)[:, None])
