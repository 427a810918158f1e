"""Runs of a machine in consecutive parts (passages), with their returns to a section."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from enum import IntFlag
from functools import cached_property, partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wedgebrake.arrays import FloatArray
from wedgebrake.dynamics.enums import Outcome
from wedgebrake.errors import InputError
from wedgebrake.model.machine import Machine
from wedgebrake.model.validation import wrong
from wedgebrake.solvers.machine.assemble import Assembled, assemble, with_contacts
from wedgebrake.solvers.machine.final_state import FinalState, restore, start_state, state_of
from wedgebrake.solvers.machine.power_rows import friction_rows
from wedgebrake.solvers.machine.problem import EMPTY_STRIDE, EVENT, Run, run_of
from wedgebrake.solvers.machine.quantity_statistics import QuantityStatistics
from wedgebrake.solvers.machine.tangents import Neighbourhood, VariedRows
from wedgebrake.solvers.machine.trajectory import trajectory
from wedgebrake.solvers.machine.trajectory.observers import Observer, observer_of
from wedgebrake.solvers.machine.trajectory.watch import (
    Anew,
    Quantities,
    QuantityRows,
    SectionKind,
    Watch,
    quantities_of,
    watch_of,
)

_MOST_EVENTS = 10**12
# Rows of the log of events, which is not kept, beyond one for each contact.
_ROWS = 1024
# Returns for which memory is allocated at a time, where their number is not known.
_CHUNK = 64
# Share of a period, and of the time, within which a run is at a return.
_AT_RETURN, _ROUNDING = 1e-12, 4e-16
# A time that is never reached [s], whose fourth power is finite.
_NEVER = 1e70
# Cells without an end of time after which a run counts as one that does not return.
_CELLS = 10**7
# A number of cells that is never reached.
_MOST_CELLS = 10**18


class Every(NamedTuple):
    """Section of a driven machine: the times ``origin + k period`` [s]."""

    period: float
    origin: float = 0.0


class Crossing(NamedTuple):
    """Section of a self-excited machine: a linear quantity of the state crosses a level upwards.

    row : factors of the states (angles, speeds, states of the actuators) in this quantity
    """

    row: tuple[float, ...]
    level: float


Section = Every | Crossing


class Record(IntFlag):
    """What is recorded of a passage in addition to its returns."""

    RETURNS = 0
    DERIVATIVES = 1
    """The derivative of the flow from return to return."""
    EXTREMES = 2
    """Extremes of the watched quantities and torques, and sticks."""
    DETAILS = 6
    """Extremes, also those of the further quantities, and the friction heat."""
    MEASURES = 8
    """Statistics of the quantities."""


@dataclass(frozen=True, eq=False)
class Passage:
    """A part of a run, with its returns to a section.

    outcome   : COMPLETED if the wanted number of returns, or the duration, was reached
    times     : (k,) of the returns [s];  states: (k, states) at them
    matrices  : (k, memory, memory) derivative of the state at a return with respect to the state
                at the previous return, for the first one to the state at the beginning;
                (0, memory, memory) if not requested. The state is followed by the memory of each
                sampled actuation whose samples are linear in the state: the force it applies and
                those in its delay. At the first return after ``Course.restart``, the columns of
                these belong to the ``delayed`` forces; the last one is zero. At a ``Crossing``:
                projected onto the section along the flow.
    low, high : (r,) extremes of the watched quantities, by default the states
    peak_torque : (contacts,) largest magnitude of the brake torque [N m]
    stick_time : (contacts,) [s];  sticks: (contacts, 2) entered from v > 0 and from v < 0
    heat      : (m,) friction heat of the contacts [J]
    log       : events in order, of dtype ``EVENT``; empty if not requested
    quantities : ``QuantityStatistics`` of the quantities of the ``Course``
    resting   : whether friction that never holds lets nothing slip between the last two returns

    What the ``Record`` of the passage does not contain is empty.
    """

    outcome: Outcome
    times: FloatArray
    states: FloatArray
    matrices: FloatArray
    low: FloatArray
    high: FloatArray
    peak_torque: FloatArray
    stick_time: FloatArray
    sticks: NDArray[np.int64]
    heat: FloatArray
    events: int
    cells: int
    duration: float
    log: NDArray[np.void]
    quantities: QuantityStatistics
    _final: Callable[[], FinalState] = field(repr=False)
    resting: bool = False

    @cached_property
    def final(self) -> FinalState:
        """The state at the end, from which another run can continue."""
        return self._final()


class _Moved(NamedTuple):
    """How a part of a run ended, and its numbers of events and cells."""

    outcome: Outcome
    events: int
    cells: int
    log: NDArray[np.void]

    def and_then(self, other: _Moved) -> _Moved:
        """Both parts."""
        return _Moved(
            other.outcome, self.events + other.events, self.cells + other.cells,
            np.concatenate([self.log, other.log]) if other.log.size else self.log,
        )  # fmt: skip


_NONE = np.empty(0)
# Number of samples that digital controllers, and sampled actuations with given delayed forces,
# have taken before the start.
_BEFORE = 2


class Course:
    """A run of a machine that is continued passage by passage.

    initial : initial state; None for that of the machine
    start   : initial time [s] if ``initial`` is None
    stop    : (1,) flag; a passage ends at its next event when another thread sets it to True
    method  : "exact" or "smooth", see ``simulate``
    watched : (r, states) factors of the states in the quantities of which passages record extremes
    further : those of which passages with details record them in addition
    logs    : whether passages contain their events
    quantities : quantities of which passages with measures record statistics
    near    : the machine with neighbouring values of parameters; passages with derivatives then
              contain those with respect to these parameters too

    Raises ``InputError`` if the method cannot solve the machine.
    """

    limit = "max_events"
    """The limit that its passages take as ``max_events``."""
    least_growth = -math.inf
    """Logarithm of the smallest deviation that is resolved after a return."""

    def __init__(
        self,
        machine: Machine,
        initial: FinalState | None = None,
        *,
        start: float = 0.0,
        stop: NDArray[np.bool_] | None = None,
        method: str = "exact",
        watched: FloatArray | None = None,
        further: FloatArray | None = None,
        logs: bool = False,
        quantities: QuantityRows | None = None,
        near: Neighbourhood | None = None,
    ) -> None:
        start = start if initial is None else initial.time
        self._curved = method == "smooth"
        self.assembled: Assembled = (
            near.assembled if near else assemble(machine, start, curved=self._curved)
        )
        problem = self.assembled.problem
        self._run = run_of(problem)
        self._varied = VariedRows(near, self._run) if near else None
        if self._varied:
            self._run = self._varied.run
        self._stop = np.zeros(1, np.bool_) if stop is None else stop
        self._no_heat = observer_of(problem, np.empty(0))
        self._log = np.zeros(_ROWS + problem.contacts.size, EVENT)
        watched = np.eye(problem.states) if watched is None else watched
        self._watched = watched if further is None else np.vstack([watched, further])
        self._watch = watch_of(problem, self._watched, self._run.tangents.later.size)
        self._rows, self._always = self._watch.rows, len(watched)
        self._quantities = quantities
        self._no_quantities = self._watch.quantities
        # Of passages of which nothing but the returns is recorded.
        none, contacts = np.empty(0), problem.contacts.size
        self._unrecorded = self._watch._replace(
            low=none, high=none, peak=none, time_at_rest=np.zeros(contacts),
            entered=np.zeros((contacts, 2), np.int64),
        )  # fmt: skip
        spans = [one.span for one in machine.signals().values()]
        self._limit = min((last for _, last in spans), default=math.inf)
        self._logs, self._angles = logs, problem.signals.angles.copy()
        self._start(machine, initial)
        machine.check_times(start, start)

    @cached_property
    def _heat(self) -> Observer:
        """Record of the friction heat of the contacts."""
        problem = self.assembled.problem
        return observer_of(problem, np.empty(0), friction_rows(problem))

    def _start(self, machine: Machine, initial: FinalState | None) -> None:
        """Set the initial state: that of the machine, or one to continue from."""
        problem, self.machine = self.assembled.problem, machine
        known = initial is not None
        if initial is None:
            start_state(machine, problem, self._run)
        else:
            known = restore(initial, machine, problem, self._run)
        self._begin(known)

    def _begin(self, restarts: bool) -> None:
        """Set the modes at the initial time, and forget the returns of an earlier run."""
        self._begins, self._restarts = True, restarts
        self._anew = Anew.YES if restarts else Anew.AT_START
        self._take(None)

    def repeat(self, machine: Machine) -> bool:
        """Return to the initial time, with the initial state of another machine.

        machine : differs in nothing but contacts, and initial angles and speeds of inertias

        Returns False if its contacts have other states or inputs, which need a run of their own.
        """
        run = self._run
        if machine.contacts != self.machine.contacts:
            assembled = with_contacts(self.assembled, machine, curved=self._curved)
            if assembled is None:
                return False
            self.assembled, run.systems.used[0] = assembled, 0
            self.__dict__.pop("_heat", None)
        # The same bits as a run of its own: nothing is kept but the equations of the modes.
        run.strides.kinds[:] = EMPTY_STRIDE
        self._watch = watch_of(self.assembled.problem, self._watched)
        self._rewind()
        self._start(machine, None)
        return True

    def _rewind(self) -> None:
        """Return to the initial time, without states, modes and samples."""
        problem, run = self.assembled.problem, self._run
        run.clock[:] = problem.start_time, 0.0
        for one in (run.z, run.modes, run.places, run.samplings, run.queues):
            one[:] = np.zeros(1, one.dtype)
        problem.signals.angles[:] = self._angles

    def restart(self, states: FloatArray, delayed: FloatArray = _NONE) -> None:
        """Return to the initial time with other states.

        At the next ``advance``, the modes of the contacts follow from the states, and new samples
        are taken. The states of digital controllers are those before this sample; with a digital
        controller, the initial time must be 0.

        delayed : forces that sampled actuations have yet to apply, in the order of the contacts,
                  of each the next to act first [N]; the initial time must be 0. none: the initial
                  forces
        """
        problem, run = self.assembled.problem, self._run
        self._rewind()
        run.z[: problem.states, 0] = states
        run.modes["first_sample"] = run.samplings["first_sample"] = problem.start_time
        # Not the first sample of a digital controller, which resets its memory. A power of 2: the
        # product has no rounding, so that the next sample is now.
        loops = problem.controllers.records
        run.samplings["samples"] = np.where(loops["held"] >= 0, _BEFORE, 0)
        run.samplings["first_sample"] -= _BEFORE * loops["sample_time"]
        self._watch.control_samples[:] = run.samplings["samples"]
        at = 0
        for number, contact in enumerate(problem.contacts if delayed.size else ()):
            delay, mode = int(contact["delay"]), run.modes[number]
            if contact["sampled_input"] >= 0 and delay > 0:
                # As above.
                mode["samples"], mode["first_sample"] = _BEFORE, -_BEFORE * contact["sample_time"]
                slots = (_BEFORE - delay + np.arange(delay)) % (delay + 1)
                run.queues[number, slots] = delayed[at : at + delay]
                at += delay
        self._watch.samples[:] = run.modes["samples"]
        # The next samples are taken at the initial time.
        run.tangents.unmoved[:] = *run.samplings["samples"], *run.modes["samples"]
        trajectory.set_inputs(problem, run)
        self._begin(restarts=False)

    def snapshot(self) -> Callable[[], None]:
        """Return a function that returns the run to its present state."""
        run, signals, watch = self._run, self.assembled.problem.signals, self._watch
        arrays = (
            run.clock, run.z, run.modes, run.places, run.samplings, run.queues, run.pending,
            signals.angles, signals.tables, watch.samples, watch.control_samples,
        )  # fmt: skip
        values, flags = [one.copy() for one in arrays], (self._begins, self._restarts, self._anew)

        def rewind() -> None:
            for array, value in zip(arrays, values, strict=True):
                array[:] = value
            self._begins, self._restarts, self._anew = flags

        return rewind

    @property
    def time(self) -> float:
        """The present time [s]."""
        return float(self._run.clock[0])

    @property
    def state(self) -> Run:
        """The present state in the form used by the kernels."""
        return self._run

    @property
    def values(self) -> FloatArray:
        """The present angles, speeds and states of actuators, (states,)."""
        return np.asarray(self._run.z[: self.assembled.problem.states, 0].copy())

    @property
    def held_inputs(self) -> list[int]:
        """Number of the input that each force in the memory of samples is; -1 if it acts later.

        In the order in which derivatives contain them.
        """
        contacts, rows = self.assembled.problem.contacts, self._watch.sampled_rows
        return [
            int(one["sampled_input"]) if place == 0 else -1
            for one in contacts[rows >= 0]
            for place in range(one["delay"] + 1)
        ]

    def advance(
        self, section: Section | None, returns: int = 0, *, duration: float = math.inf,
        record: Record = Record.EXTREMES, max_events: int = _MOST_EVENTS,
    ) -> Passage:  # fmt: skip
        """Continue for a number of returns or for a duration, whichever ends first.

        section  : section of the returns; None to continue for the duration without returns
        returns  : number of returns; 0 for all within the duration
        duration : [s]
        record   : what is recorded, since it may take longer than the motion

        A state that is on the section at the beginning does not count as a return. Raises
        ``InputError`` for a run without end, or beyond the end of a table.
        """
        begin = self.time
        if section is None and returns != 0:
            raise wrong("returns", returns, "0 without a section")
        if math.isinf(duration) and returns < 1:
            raise wrong("duration", duration, "finite where no number of returns is wanted")
        if section != self._section:
            self._take(section)
        first, end = 0, begin + duration
        known = begin if math.isinf(end) or returns > 0 else end
        if isinstance(section, Every):
            first = self._next_return(section)
            if returns > 0:
                known = min(end, section.origin + (first + returns - 1) * section.period)
        if known > self._limit:
            self.machine.check_times(begin, known)
        anew, self._anew = self._anew, Anew.YES if duration > 0.0 else self._anew
        if record == Record.RETURNS and not isinstance(section, Crossing):
            return self._sampled(section, first, known, max_events)
        details = record & Record.DETAILS == Record.DETAILS
        watch = self._begin_record(record, len(self._rows) if details else self._always)
        watch.state["next"] = first
        if record & Record.DERIVATIVES:
            watch.state["anew"] = anew
        capacity = returns if returns > 0 else self._capacity(section, begin, end)
        parts: list[Watch] = []
        # A motion that comes to rest may never return.
        cells = _CELLS if math.isinf(end) and isinstance(section, Crossing) else _MOST_CELLS
        observer = self._heat if details else self._no_heat
        observer.work[:] = 0.0
        moved, full = _Moved(Outcome.COMPLETED, 0, 0, self._log[:0]), True
        while moved.outcome == Outcome.COMPLETED and full:
            watch = self._with_capacity(watch, section, capacity)
            parts.append(watch)
            further = self._move(
                min(end, self._limit, _NEVER), max_events - moved.events, cells - moved.cells,
                observer._replace(watch=watch),
            )  # fmt: skip
            moved = moved.and_then(further)
            full = capacity > 0 and int(watch.state[0]["count"]) == capacity
            if returns > 0 or self.time >= end:
                break
        if moved.outcome == Outcome.COMPLETED and self.time < end and not full:
            self.machine.check_times(begin, math.nextafter(self._limit, math.inf))
        return self._passage(moved, watch, _returns_of(parts), observer.work, self.time - begin)

    def _move(self, end: float, events: int, cells: int, observer: Observer) -> _Moved:
        """Continue to a time, or until the memory of an observer for returns is full.

        events, cells : largest numbers of them
        """
        moved = _Moved(Outcome.LOG_FULL, 0, 0, self._log[:0])
        if self._varied and self._begins and not self._run.modes.size:
            self._varied.fill()  # one system for the whole run, at which it does not pause
        while moved.outcome in (Outcome.LOG_FULL, Outcome.PAUSED):
            span = trajectory.Span(
                end, events - moved.events, cells - moved.cells, False, self._begins,
                self._restarts, self._stop,
            )  # fmt: skip
            found = trajectory.move(self.assembled.problem, self._run, span, self._log, observer)
            self._begins = False
            log = self._log[: found.events if self._logs else 0].copy()
            moved = moved.and_then(_Moved(Outcome(found.outcome), found.events, found.cells, log))
            if self._varied and moved.outcome == Outcome.PAUSED:
                self._varied.fill()
        return moved

    def _sampled(self, section: Every | None, first: int, end: float, events: int) -> Passage:
        """Continue to a time with nothing but the returns, as samples of the response.

        first : number of the first return
        """
        begin = self.time
        times: FloatArray = np.empty(0)
        if section is not None:
            last = math.floor((end - section.origin) / section.period) + 1
            times = section.origin + section.period * np.arange(first, last + 1, dtype=float)
            times = times[times <= end]
        observer = observer_of(self.assembled.problem, times)
        moved, count = self._move(end, events, _MOST_CELLS, observer), int(observer.at[0])
        returns = times[:count], observer.states[:count], self._unrecorded.matrices
        return self._passage(moved, self._unrecorded, returns, observer.work, self.time - begin)

    def _take(self, section: Section | None) -> None:
        """Set the section of the returns."""
        self._watch = self._watch._replace(**self._fields(section))
        self._section: Section | None = section
        state = self._watch.state[0]
        state["scale"], state["below"] = 0.0, 0

    def _begin_record(self, record: Record, rows: int) -> Watch:
        """The ``Watch`` of a passage, without memory for returns.

        rows : number of those whose extremes are recorded, if any are
        """
        extremes = bool(record & Record.EXTREMES)
        low = np.full(rows if extremes else 0, math.inf)
        quantities = self._no_quantities
        if record & Record.MEASURES and self._quantities is not None:
            quantities = self._begin_quantities(self._quantities)
        watch = self._watch._replace(
            derivative=bool(record & Record.DERIVATIVES), rows=self._rows[: low.size],
            low=low, high=-low, peak=np.zeros(self.state.modes.size if extremes else 0),
            quantities=quantities,
        )  # fmt: skip
        watch.time_at_rest[:] = 0.0
        watch.entered[:], watch.sides[:] = 0, self.state.modes["side"]
        return watch

    def _begin_quantities(self, given: QuantityRows) -> Quantities:
        """Memory for the statistics of the quantities."""
        problem = self.assembled.problem
        found = quantities_of(given, problem.states, problem.torque.shape[1])
        # A level near the mean: the mean square of a small vibration is then not a difference of
        # large numbers.
        values = found.rows[:, : problem.states] @ self._run.z[: problem.states, 0]
        found.level[:] = np.where((found.order == 0) & (found.contact < 0), values, 0.0)
        found.low[:], found.high[:] = math.inf, -math.inf
        return found

    def _fields(self, section: Section | None) -> dict[str, Any]:
        """The fields of a ``Watch`` that describe a section."""
        problem = self.assembled.problem
        if isinstance(section, Every):
            period, origin = float(section.period), float(section.origin)
            if not 0.0 < period < math.inf:
                raise wrong("section.period", section.period, "a number of seconds above 0")
            return {"kind": int(SectionKind.EVERY), "period": period, "origin": origin}
        if section is None:
            return {"kind": int(SectionKind.NONE)}
        if len(section.row) != problem.states or not any(section.row):
            raise InputError(
                f"section.row = {section.row}: must have {problem.states} factors, not all 0, one"
                " for each state.",
                name="section.row", value=section.row, allowed=f"{problem.states} factors",
            )  # fmt: skip
        row = np.zeros(problem.torque.shape[1])
        row[: problem.states], row[-1] = section.row, -section.level
        return {"kind": int(SectionKind.CROSSING), "row": row}

    def _next_return(self, section: Every) -> int:
        """Number of the first return after the present time."""
        time, (period, origin) = self.time, section
        number = math.floor((time - origin) / period) + 1
        if origin + number * period <= time + _AT_RETURN * period + _ROUNDING * abs(time):
            number += 1
        return number

    def _capacity(self, section: Section | None, begin: float, end: float) -> int:
        """Number of returns for which memory is allocated at a time."""
        if isinstance(section, Every):
            return 2 + math.floor((end - begin) / section.period)
        return 0 if section is None else _CHUNK

    def _with_capacity(self, watch: Watch, section: Section | None, capacity: int) -> Watch:
        """A ``Watch`` with memory for a number of returns."""
        count = 0 if section is None else capacity
        memory, columns = watch.matrices.shape[1:]
        watch.state["count"] = 0
        return watch._replace(
            times=np.empty(count),
            states=np.empty((count, self.assembled.problem.states)),
            matrices=np.empty((count if watch.derivative else 0, memory, columns)),
        )

    def _passage(
        self, moved: _Moved, watch: Watch, returns: _Returns, heat: FloatArray, duration: float
    ) -> Passage:
        """Collect what has been recorded as a ``Passage``."""
        return Passage(
            moved.outcome, *returns, watch.low, watch.high, watch.peak,
            watch.time_at_rest.copy(), watch.entered.copy(),
            heat.copy(), moved.events, moved.cells, duration, moved.log,
            QuantityStatistics.of(watch.quantities, duration),
            partial(state_of, self.machine, self.assembled.problem, _kept(self._run)),
        )  # fmt: skip


_Returns = tuple[FloatArray, FloatArray, FloatArray]


def _returns_of(parts: list[Watch]) -> _Returns:
    """Times, states and matrices of the returns in consecutive parts of a passage."""
    counts = [*(one.times.size for one in parts[:-1]), int(parts[-1].state[0]["count"])]
    found = [
        (one.times[:count], one.states[:count], one.matrices[:count])
        for one, count in zip(parts, counts, strict=True)
    ]
    if len(found) == 1:
        return found[0]
    times, states, matrices = map(np.concatenate, zip(*found, strict=True))
    return times, states, matrices


def _kept(run: Run) -> Run:
    """Copy of a run whose state no longer changes."""
    return run._replace(
        clock=run.clock.copy(), z=run.z[:, :1].copy(), modes=run.modes.copy(),
        places=run.places.copy(), samplings=run.samplings.copy(), queues=run.queues.copy(),
    )  # fmt: skip
