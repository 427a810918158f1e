"""Return map of a machine on a section, in coordinates of the section."""

from __future__ import annotations

import math
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wedgebrake.arrays import FloatArray
from wedgebrake.dynamics.enums import Outcome
from wedgebrake.model.elements import elements
from wedgebrake.model.joints import reduction
from wedgebrake.model.machine import Machine
from wedgebrake.model.machine_matrices import shaft_rows
from wedgebrake.model.machine_parts import speed_at
from wedgebrake.model.validation import wrong
from wedgebrake.orbits.equations.breakpoints import Breakpoints, piece_levels
from wedgebrake.orbits.equations.equations import NoOrbitError
from wedgebrake.orbits.equations.section_coordinates import NO_ROTATION, SectionCoordinates
from wedgebrake.solvers.machine.final_state import FinalState, delayed_forces, due_sample
from wedgebrake.solvers.machine.passage import (
    Course,
    Crossing,
    Every,
    Passage,
    Record,
    Section,
)
from wedgebrake.solvers.machine.problem import mobility_of

# A sliding speed below this share of its parts is rounding of Newton's method: the contact sticks.
_STICKS = 1e-11
# Number of remembered passages.
_REMEMBERED = 64
# Share of a sample by which a period may differ from a whole number of samples.
_WHOLE = 1e-9
# Relative decrease of the time until a return, so that it precedes the sample of a digital
# controller at the same instant, whatever the rounding of both.
_BEFORE_SAMPLE = 2.0**-49
# Largest number of delayed forces: each is a state of orbits, whose derivative is a full matrix.
_MOST_DELAYED = 500


def check_samples(machine: Machine, period: float | None) -> None:
    """Raise ``InputError`` if samples do not repeat with the period.

    A return to the section is then the instant of a sample, which is applied at once, so that all
    later forces follow from the states there and from those in the delay. The same holds for the
    outputs of digital controllers. The error is also raised for a delay of too many samples, and
    for outputs that are rounded.

    period : of the signals [s]; None if they have none, 0 if none varies
    """
    sampled = {one.name: one.sample_time for one in machine.controllers}
    check_resolution(machine)
    delays = [one.actuation.delay for one in machine.contacts]
    if sum(delays) > _MOST_DELAYED:
        longest = max(machine.contacts, key=lambda one: one.actuation.delay)
        raise wrong(
            f"{longest.name}.delay", longest.actuation.delay,
            f"small enough that orbits have at most {_MOST_DELAYED} delayed forces",
            f"Each is a state of the orbit, and all contacts together have {sum(delays)}. Sample"
            " less often, so that the same dead time has fewer samples, or use wb.simulate.",
        )  # fmt: skip
    sampled |= {one.name: one.actuation.sample_time for one in machine.contacts}
    for name, step in sampled.items():
        if step is None:
            continue
        if not period:
            raise wrong(
                f"{name}.sample_time", step, "None where no signal varies",
                "An orbit whose period is unknown can be found only without sampling.",
            )  # fmt: skip
        count = period / step
        if count < 0.5 or abs(count - round(count)) > _WHOLE:
            raise wrong(
                f"{name}.sample_time", step,
                f"the period of the signals, {period:.17g} s, divided by a whole number",
                "Only then does an orbit close: the samples repeat with the period.",
            )  # fmt: skip


def check_resolution(machine: Machine) -> None:
    """Raise ``InputError`` for a digital controller whose output is rounded."""
    for loop in machine.controllers:
        if loop.resolution is not None:
            raise wrong(
                f"{loop.name}.resolution", loop.resolution, "None for orbits",
                "Where the output is rounded, the end of a period does not depend continuously on"
                " its beginning, so that no orbit can be solved for. Use wb.motion, or wb.sweep"
                " over a parameter.",
            )  # fmt: skip


def _return_time(machine: Machine, period: float) -> float:
    """The period, or the time just before the sample of a digital controller at its end [s]."""
    steps = [one.sample_time for one in machine.controllers if one.sample_time is not None]
    if not steps:
        return period
    return min(period, *(step * round(period / step) for step in steps)) * (1.0 - _BEFORE_SAMPLE)


class OrbitRotations(NamedTuple):
    """Rotations of inertias and twists of shafts over an orbit [rad].

    swings     : (n,) half the range of each angle about its mean rotation; nan of an inertia
                 without one
    amplitudes : (shafts,) half the range of the twist q_a - ratio q_b; nan where it grows for ever
    peaks      : (shafts,) its largest magnitude; nan where it grows for ever
    """

    swings: FloatArray
    amplitudes: FloatArray
    peaks: FloatArray


class SectionStates:
    """States of a machine at points of a section.

    Driven bodies have their own angles and speeds, and bodies determined by joints follow the
    others with the ratios of this machine.

    carried : (states,) the state on the section that follows the driven bodies
    """

    def __init__(self, machine: Machine, local: SectionCoordinates, start: float = 0.0) -> None:
        self.local = local
        self._follow = reduction(machine).follow if machine.joints else None
        driven, space, crossing = machine.driven, local.space, local.crossing
        found, n = np.zeros(space.to.shape[1]), len(machine.inertias)
        found[:n] = space.carried @ [one.angle for one in driven]
        found[n : 2 * n] = space.carried @ [speed_at(one, start) for one in driven]
        if crossing is not None:
            row = np.array(crossing.row)
            along = row @ space.back
            found -= space.back @ along * (row @ found / (along @ along))
        self.carried = found

    def at(self, points: FloatArray) -> FloatArray:
        """States (..., states) of points (..., size), without free rotation."""
        return self._followed((self.local.states(points) + self.carried).T).T

    @cached_property
    def back(self) -> FloatArray:
        """Change of the states, and of the forces that are delayed, with a point."""
        return self._followed(self.local.back)

    def _followed(self, columns: FloatArray) -> FloatArray:
        """Columns of states in which bodies determined by joints follow the others."""
        if self._follow is None:
            return columns
        n, found = len(self._follow), columns.copy()
        for first in (0, n):
            found[first : first + n] = np.tensordot(self._follow, columns[first : first + n], 1)
        return found


class MachineFlow:
    """Map from the section of a machine to itself, with its exact derivative.

    machine : machine whose samples repeat with its signals, see ``check_samples``
    local   : coordinates of the section; they need not be those of this machine
    longest : longest time until a return [s]
    method  : "exact" or "smooth", see ``simulate``

    period : of the signals, up to rounding [s]; nan if none varies
    """

    def __init__(
        self, machine: Machine, local: SectionCoordinates, longest: float, method: str
    ) -> None:
        period = machine.period
        check_samples(machine, period)
        if local.crossing is None and not period:
            raise NoOrbitError
        self.period = _return_time(machine, period) if period else math.nan
        self.section: Crossing | Every = local.crossing or Every(self.period)
        self.machine, self.local, self.longest = machine, local, longest
        self.course = Course(machine, logs=True, watched=local.watched, method=method)
        self.on_section = SectionStates(machine, local)
        self.method = method
        self._remembered: dict[tuple[bytes, bool], Passage] = {}
        self._rotations: tuple[tuple[bytes, float], OrbitRotations] | None = None

    @cached_property
    def imposed(self) -> Course:
        """A run for imposed directions of sliding, whose systems have no conditions of these."""
        return Course(self.machine, method=self.method)

    @cached_property
    def _rotating(self) -> Course:
        """A run that records the extremes of the twist of each shaft."""
        rows = shaft_rows(self.machine)
        rows = np.pad(rows, ((0, 0), (0, self.local.space.to.shape[1] - rows.shape[1])))
        return Course(self.machine, watched=rows if len(rows) else None, method=self.method)

    @cached_property
    def turning(self) -> Any:
        """(inertias,) whether an inertia can rotate freely, or rotates with a driven body."""
        period = 1.0 if math.isnan(self.period) else self.period
        means = [abs(one.mean_speed(period)) for one in self.machine.driven]
        return self.local.free | (np.abs(self.local.space.carried) @ means > 0.0)

    @cached_property
    def breakpoints(self) -> list[Breakpoints]:
        """Breakpoints of the torque of each contact."""
        problem = self.course.assembled.problem
        return [Breakpoints.of(one, k, problem) for k, one in enumerate(self.machine.contacts)]

    @cached_property
    def piece_levels(self) -> list[NDArray[np.int64]]:
        """For each element, the levels of its pieces, see ``levels_of``."""
        return [piece_levels(one) for one in elements(self.machine)]

    def states(self, points: FloatArray) -> FloatArray:
        """States (..., states) of points (..., size), see ``SectionStates``."""
        return self.on_section.at(points)

    def points(self, states: FloatArray) -> FloatArray:
        """Points of states, projected onto the section, without the forces that are delayed."""
        return self.local.points(states - self.on_section.carried)

    def point(self, state: FinalState, states: FloatArray) -> FloatArray:
        """Point of a state: that of its states, and the forces that are delayed."""
        delayed = delayed_forces(state, self.machine) / self.local.space.delayed
        return np.append(self.points(states), delayed)

    def end(self, passage: Passage) -> FloatArray:
        """Point at the end of a passage of one return."""
        states = passage.states[0]
        local = self.local
        return self.point(passage.final, states) if local.delays else self.points(states)

    def next_return(
        self, point: FloatArray, *, derivative: bool = True, half: bool = False
    ) -> Passage:
        """Passage to the next return; raises ``NoOrbitError`` if there is none.

        half : whether it ends after half a period of the signals instead
        """
        key = point.tobytes(), half
        found = self._remembered.get(key)
        if found is None or (derivative and not len(found.matrices)):
            self.start(point)
            section = Every(0.5 * self.period) if half else self.section
            found = self.passage(1, derivative=derivative, section=section)
            if len(self._remembered) >= _REMEMBERED:
                del self._remembered[next(iter(self._remembered))]
            self._remembered[key] = found
        return found

    def matrix(self, passage: Passage) -> FloatArray:
        """Derivative of the end of a passage with respect to its beginning."""
        rows, columns = self.rows(passage.final), self.rows()
        inner = np.pad(passage.matrices[0], (0, 1))[np.ix_(rows, columns)]
        return np.asarray(self.local.to @ inner @ self.on_section.back)

    def rows(self, end: FinalState | None = None) -> list[int]:
        """Rows of the states, and of the forces that are delayed, in derivatives at a return.

        -1 for forces that are rounded: their derivative is zero, and derivatives of the flow omit
        them.

        end : state there; None for the beginning of a run
        """
        rows = list(range(self.local.space.to.shape[1]))
        line = len(rows)
        for number, contact in enumerate(self.machine.contacts if self.local.delays else ()):
            given = contact.actuation
            varies = given.slope or given.delay or given.is_in_loop
            if given.sample_time is None or not varies:
                continue
            if given.resolution:
                rows += [-1] * given.delay
                continue
            first = line
            if end is not None:
                # The first sample is taken at the section. Rounding decides whether it has already
                # been taken.
                due = due_sample(end, number, given.sample_time)
                first += 1 + due - end.sampled[number][1]
            rows += range(first, first + given.delay)
            line += 1 + given.delay
        return rows

    def passage(
        self, returns: int, *, derivative: bool = False, section: Section | None = None,
        course: Course | None = None,
    ) -> Passage:  # fmt: skip
        """Continue to a return, by default to the own section, in the run from return to return.

        Raises ``NoOrbitError`` if there is none.
        """
        section = section or self.section
        duration = self.longest * returns
        if isinstance(section, Every):
            duration = math.inf
        record = Record.EXTREMES | (Record.DERIVATIVES if derivative else Record.RETURNS)
        passage = (course or self.course).advance(
            section, returns, duration=duration, record=record
        )
        if passage.outcome != Outcome.COMPLETED or len(passage.times) < returns:
            raise NoOrbitError
        return passage

    def rotations(self, point: FloatArray, duration: float) -> OrbitRotations:
        """Rotations of the inertias, and twists of the shafts, from a point on [s]."""
        course, shafts = self._rotating, shaft_rows(self.machine)
        n, kept = len(self.machine.inertias), self.local.restrained
        if self._rotations is not None and self._rotations[0] == (point.tobytes(), duration):
            return self._rotations[1]
        self.start(point, course)
        begin, start = course.time, course.state.z[:n, 0].copy()
        whole = course.advance(None, duration=duration)
        turned = course.state.z[:n, 0] - start
        swings = np.full(n, np.nan)
        for i in np.flatnonzero(self.turning):
            # Its distance from a uniform rotation is extreme where its speed is the mean speed.
            mean, apart = turned[i] / duration, [start[i]]
            for sign in (1.0, -1.0):
                row = np.zeros(self.local.space.to.shape[1])
                row[n + i] = sign
                self.start(point, course)
                passage = course.advance(Crossing(tuple(row), sign * mean), duration=duration)
                apart += list(passage.states[:, i] - mean * (passage.times - begin))
            swings[i] = 0.5 * float(np.ptp(apart))
        turns = np.abs(shafts @ (kept - self.local.space.motions))
        held = turns.max(axis=1, initial=0.0) <= NO_ROTATION
        low, high = (one[: len(shafts)] for one in (whole.low, whole.high))
        amplitudes, peaks = 0.5 * (high - low), np.maximum(np.abs(low), np.abs(high))
        found = OrbitRotations(
            swings, np.where(held, amplitudes, np.nan), np.where(held, peaks, np.nan)
        )
        self._rotations = (point.tobytes(), duration), found
        return found

    def initial(self, point: FloatArray) -> FinalState:
        """State at a point, as an initial state of ``simulate``."""
        self.start(point)
        return self.course.advance(None, duration=0.0).final

    def start(self, point: FloatArray, course: Course | None = None) -> None:
        """Start at a point; contacts whose sliding speed is rounding are set to rest.

        course : the run; None for that from return to return
        """
        course = course or self.course
        if not np.all(np.isfinite(point)):
            raise NoOrbitError
        states, problem = self.states(point), course.assembled.problem
        delayed = self.local.delayed(point)
        course.restart(states, delayed)
        z = course.state.z[:, 0]
        speeds, sizes = problem.sliding @ z, np.abs(problem.sliding) @ np.abs(z)
        stick = np.abs(speeds) <= _STICKS * sizes
        if np.any(speeds[stick]):
            n = problem.inverse.size
            rows = problem.sliding[stick, n : 2 * n]
            moved = mobility_of(problem) @ rows.T
            states[n : 2 * n] -= moved @ np.linalg.lstsq(rows @ moved, speeds[stick], rcond=None)[0]
            course.restart(states, delayed)
