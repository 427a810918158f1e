"""The run of a machine whose motion is classified, continued by returns to a section."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from wedgebrake.analysis.machine_motion.coordinates import (
    Coordinates,
    coordinates,
    scales_of,
)
from wedgebrake.analysis.machine_motion.result import vibration_rows
from wedgebrake.analysis.machine_motion.section import (
    FIRST_RETURNS,
    LONGER,
    LOST_CELLS,
    MOST_CELLS,
    MOST_PERIODS,
    RETURNS_WITHIN,
    STILL,
    crossing,
    sampling,
)
from wedgebrake.analysis.machine_motion.steady import Known
from wedgebrake.arrays import FloatArray
from wedgebrake.dynamics.enums import Outcome
from wedgebrake.model.machine import KINDS, Machine
from wedgebrake.model.machine_parts import speed_at
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.solvers.machine.final_state import FinalState
from wedgebrake.solvers.machine.passage import Course, Crossing, Every, Passage, Record

if TYPE_CHECKING:
    from wedgebrake.solvers.smooth.solve_periods import Passed

# Largest distance from a return at which a run counts as beginning there, as a share of a period.
_AT_RETURN = 1e-12
# Number of last returns between which a record without measures contains extremes.
_WITH_EXTREMES = 4
# Lists of parts that machines with the same preparation have in common.
_KEPT = [kind for kind in KINDS if kind not in ("inertias", "contacts")]
MEASURED = Record.DETAILS | Record.MEASURES
"""Record of the properties of a motion."""


class Prepared:
    """A machine at the beginning of a run.

    space  : scaled coordinates
    every  : section of its returns; None for a self-excited motion
    course : the run, a ``Course`` or a ``StepperCourse``
    """

    def __init__(
        self, machine: Machine, space: Coordinates, every: Every | None, course: Any
    ) -> None:
        self.machine, self.space, self.every, self.course = machine, space, every, course
        self.has_period = machine.period is not None
        # The proof of a steady state excludes samples, which are not among its states.
        times = [one.actuation.sample_time for one in machine.contacts]
        times += [one.sample_time for one in machine.controllers]
        self.linear = all(one is None for one in times)
        self.parts = len(machine.inertias), len(machine.contacts)
        self.known: Known = {}

    @classmethod
    def by_series(
        cls, machine: Machine, method: str, initial: FinalState | None = None, start: float = 0.0
    ) -> Prepared:
        """A run by series.

        initial : state; None for the initial state of the machine at the time ``start`` [s]
        """
        space, parts = coordinates(machine), (len(machine.inertias), len(machine.contacts))
        states = space.to.shape[1]
        course = Course(
            machine, initial, start=start, method=method,
            watched=space.to, further=np.eye(states), quantities=vibration_rows(*parts, states),
        )  # fmt: skip
        return cls(machine, space, sampling(machine), course)

    @classmethod
    def by_stepper(
        cls, machine: Machine, line: BrakedDriveline, rtol: float, begun: Passed | None = None
    ) -> Prepared:
        """A run by the stepper; ``line``, ``rtol`` and ``begun`` as in ``StepperCourse``."""
        from wedgebrake.solvers.smooth.course import StepperCourse

        space, every = coordinates(machine), Every(1.0 / line.excitation.frequency)
        (inertia,) = machine.inertias
        course = StepperCourse(
            line, (inertia.angle, speed_at(inertia, 0.0)), rtol,
            name=inertia.name, watched=space.to, begun=begun,
        )  # fmt: skip
        return cls(machine, space, every, course)

    def repeat(self, machine: Machine) -> bool:
        """Return to the initial time, with another machine and its initial state.

        Returns False if it needs a run of its own, as more than contacts and initial values differs
        or coordinates do.
        """
        own = self.machine
        alike = (
            all(getattr(own, kind) == getattr(machine, kind) for kind in _KEPT)
            and [(one.name, one.inertia) for one in own.inertias]
            == [(one.name, one.inertia) for one in machine.inertias]
            and [one.speed for one in own.driven] == [one.speed for one in machine.driven]
            and own.signals() == machine.signals()
            and list(map(scales_of, own.contacts)) == list(map(scales_of, machine.contacts))
        )
        if not alike or not self.course.repeat(machine):
            return False
        if own.contacts != machine.contacts:
            self.known = {}
        self.machine = machine
        return True


class RecordedReturns(NamedTuple):
    """A passage of r returns, preceded by its first state, which is nan unless it is a return.

    states, times : (r + 1, states), (r + 1,)
    """

    passage: Passage
    states: FloatArray
    times: FloatArray


class ReturnRun:
    """A run of a machine, and the section at which its returns are counted.

    section : None until that of a self-excited motion is chosen
    returned : whether the present state is a return
    done    : number of returns so far
    outcome, events, last : outcome of the last passage, number of events so far, the last passage
    within  : mean time within which a self-excited motion is expected to return [s]
    """

    def __init__(self, prepared: Prepared, most_events: int) -> None:
        self.space, self.course = prepared.space, prepared.course
        self.self_excited = prepared.every is None
        self.section: Every | Crossing | None = prepared.every
        every, time = prepared.every, self.course.time
        self.returned = every is not None and abs(math.remainder(time, every.period)) <= (
            _AT_RETURN * every.period
        )
        self.done = self.events = self._cells = 0
        self.within = RETURNS_WITHIN * self.space.longest_period
        self.outcome = Outcome.COMPLETED
        self.last: Passage | None = None
        self._most = most_events

    @property
    def completed(self) -> bool:
        """True if the last passage was completed."""
        return self.outcome == Outcome.COMPLETED

    def take_section(self, passage: Passage) -> None:
        """Choose the section of a self-excited motion, from a passage in which it varies."""
        if self.section is None or self.range_of(passage) > STILL * self.speed_of(passage):
            self.section, self.returned = crossing(passage, self.space), False

    def waits_for(self, passage: Passage, returns: int) -> bool:
        """Extend the time for returns if a motion with fewer of them in a passage is only slow.

        A stick lasts until its base has wound up a shaft, which may take many natural periods.
        Returns False if the motion returned often enough, or if it neither returned nor sticks.
        """
        if not self.completed or len(passage.times) >= returns:
            return False
        sticks = bool((self.course.state.modes["side"] == 0).any())
        short = self._cells < MOST_CELLS and self.within < MOST_PERIODS * self.space.longest_period
        if short and (sticks or len(passage.times)):
            self.within *= LONGER
            return True
        self.within = RETURNS_WITHIN * self.space.longest_period
        return False

    def is_lost(self, passage: Passage) -> bool:
        """Return True if a motion has not returned in a passage, although the run is long."""
        return not len(passage.times) and self._cells > LOST_CELLS

    def advance(
        self, returns: int, record: Record = Record.EXTREMES, *, duration: float = math.inf
    ) -> Passage:
        """Continue by a number of returns, for a self-excited motion within a limited time.

        Details of a self-excited motion are recorded, because it may become constant.
        """
        if self.self_excited:
            duration = min(duration, max(returns, FIRST_RETURNS) * self.within)
            record |= Record.DETAILS
        most, begin = self._most - self.events, self.course.time
        passage: Passage = self.course.advance(
            self.section, returns, duration=duration, record=record, max_events=most
        )
        self.done += len(passage.times)
        self.events += passage.events
        self._cells += passage.cells
        self.outcome, self.last = passage.outcome, passage
        self.returned = len(passage.times) > 0 and passage.times[-1] == self.course.time
        if len(passage.times):
            mean = (passage.times[-1] - begin) / len(passage.times)
            self.within = max(self.within, RETURNS_WITHIN * float(mean))
        return passage

    def passages(self, returns: int, record: Record = Record.EXTREMES) -> list[Passage]:
        """Continue by a number of returns, for as long as the motion may return."""
        found = [self.advance(returns, record)]
        while self.waits_for(found[-1], returns):
            returns -= len(found[-1].times)
            found.append(self.advance(returns, record))
        return found

    def record(self, returns: int, further: Record = Record.RETURNS) -> RecordedReturns:
        """Continue with measures; record the present state, if it is a return, and the returns."""
        return self._recorded([(returns, MEASURED | further)])

    def record_returns(self, returns: int) -> RecordedReturns:
        """Record without measures, and with extremes of the last returns only."""
        last = min(returns, _WITH_EXTREMES)
        parts = [(returns - last, Record.RETURNS), (last, Record.EXTREMES)]
        return self._recorded([one for one in parts if one[0] > 0])

    def _recorded(self, parts: list[tuple[int, Record]]) -> RecordedReturns:
        """Continue in parts (number of returns, record) until one is not completed."""
        begin, states = self.course.time, self.course.values[None]
        times = np.array([begin])
        if not self.returned:
            states[:], times[:] = math.nan, math.nan
        for returns, record in parts:
            passage = self.advance(returns, record)
            states, times = np.vstack([states, passage.states]), np.append(times, passage.times)
            if not self.completed:
                break
        whole = replace(
            passage, states=states[1:], times=times[1:], duration=self.course.time - begin
        )
        return RecordedReturns(whole, states, times)

    def snapshot(self) -> Callable[[], None]:
        """Return a function that restores the present state of the run."""
        names = ("returned", "done", "events", "_cells", "within", "outcome", "last")
        values, course = {name: getattr(self, name) for name in names}, self.course.snapshot()

        def rewind() -> None:
            course()
            vars(self).update(values)

        return rewind

    def orbit(self, order: int) -> Passage | None:
        """Measures and derivatives over the next returns; None if the run ends before."""
        orbit = self.advance(order, MEASURED | Record.DERIVATIVES)
        return orbit if self.completed and len(orbit.times) == order else None

    def range_of(self, passage: Passage) -> float:
        """Sum of half the ranges of the scaled coordinates [rad/s]."""
        return 0.5 * float((passage.high - passage.low)[: self.space.size].sum())

    def speed_of(self, passage: Passage) -> float:
        """Size of the scaled state [rad/s]."""
        return float(np.maximum(abs(passage.high), abs(passage.low))[: self.space.size].sum())
