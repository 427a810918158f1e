"""Runs of a machine in consecutive parts (passages), with their returns to a section."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wedgebrake.arrays import FloatArray
from wedgebrake.dynamics.enums import Outcome
from wedgebrake.errors import InputError
from wedgebrake.model.machine import Machine
from wedgebrake.model.validation import wrong
from wedgebrake.solvers.machine.assemble import Assembled, assemble
from wedgebrake.solvers.machine.final_state import FinalState, restore, start_state, state_of
from wedgebrake.solvers.machine.power_rows import power_rows
from wedgebrake.solvers.machine.problem import EVENT, Run, run_of
from wedgebrake.solvers.machine.quantity_statistics import QuantityStatistics
from wedgebrake.solvers.machine.trajectory import trajectory
from wedgebrake.solvers.machine.trajectory.observers import Observer, PowerRows, observer_of
from wedgebrake.solvers.machine.trajectory.watch import (
    Anew,
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


@dataclass(frozen=True, eq=False)
class Passage:
    """A part of a run, with its returns to a section.

    outcome   : COMPLETED if the wanted number of returns, or the duration, was reached
    times     : (k,) of the returns [s];  states: (k, states) at them
    matrices  : (k, memory, memory) derivative of the state at a return with respect to the state
                at the previous return, for the first one to the state at the beginning;
                (0, memory, memory) if not requested. The state is followed by the memory of each
                controller whose samples are linear in the sliding speed: the force it applies and
                those in its delay. At the first return after ``Course.restart``, the columns of
                these belong to the ``delayed`` forces; the last one is zero. At a ``Crossing``:
                projected onto the section along the flow.
    low, high : (r,) extremes of the watched quantities, by default the states
    peak_torque : (contacts,) largest magnitude of the brake torque [N m]
    stick_time : (contacts,) [s];  sticks: (contacts, 2) entered from v > 0 and from v < 0
    heat      : (m,) friction heat of the contacts [J]; empty without ``details``
    last_slip : last time at which any contact slid in the whole run [s]; -inf if none did
    log       : events in order, of dtype ``EVENT``; empty if not requested
    quantities : ``QuantityStatistics`` of the quantities of the ``Course``; empty if not requested
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
    last_slip: float
    log: NDArray[np.void]
    quantities: QuantityStatistics
    _machine: Machine = field(repr=False)
    _problem: Any = field(repr=False)
    _run: Run = field(repr=False)

    @cached_property
    def final(self) -> FinalState:
        """The state at the end, from which another run can continue."""
        return state_of(self._machine, self._problem, self._run)


_NONE = np.empty(0)
# Number of samples that controllers with given delayed forces count as taken.
_BEFORE = 2


class Course:
    """A run of a machine that is continued passage by passage.

    initial : initial state; None for that of the machine
    start   : initial time [s] if ``initial`` is None
    stop    : (1,) flag; a passage ends at its next event when another thread sets it to True
    method  : "exact" or "smooth", see ``simulate``
    watched : (r, states) factors of the states in the quantities whose extremes are recorded
    further : those that passages with ``details`` record in addition
    logs    : whether passages contain their events
    quantities : quantities that passages with ``measures`` record in addition

    Raises ``InputError`` if the method cannot solve the machine.
    """

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
    ) -> None:
        start = start if initial is None else initial.time
        self.assembled: Assembled = assemble(machine, start, curved=method == "smooth")
        problem = self.assembled.problem
        self._run = run_of(problem)
        self._stop = np.zeros(1, np.bool_) if stop is None else stop
        self._no_heat = observer_of(problem, np.empty(0))
        self._log = np.zeros(_ROWS + problem.contacts.size, EVENT)
        watched = np.eye(problem.states) if watched is None else watched
        self._watched = watched if further is None else np.vstack([watched, further])
        self._watch = watch_of(problem, self._watched)
        self._rows, self._always = self._watch.rows, len(watched)
        self._quantities = quantities
        self._no_quantities = self._watch.quantities
        spans = [one.span for one in machine.signals().values()]
        self._limit = min((last for _, last in spans), default=math.inf)
        self._logs, self._angles = logs, problem.signals.angles.copy()
        self._start(machine, initial)
        machine.check_times(start, start)

    @cached_property
    def _heat(self) -> Observer:
        """Record of the friction heat of the contacts."""
        problem = self.assembled.problem
        rows = power_rows(self.machine, self.assembled)
        heat = PowerRows(*(one[: problem.contacts.size] for one in rows))
        return observer_of(problem, np.empty(0), heat)

    def _start(self, machine: Machine, initial: FinalState | None) -> None:
        """Set the initial state: that of the machine, or one to continue from."""
        problem, self.machine = self.assembled.problem, machine
        if initial is None:
            start_state(machine, problem, self._run)
        else:
            restore(initial, machine, problem, self._run)
        self._begin(initial is not None)

    def _begin(self, restarts: bool) -> None:
        """Set the modes at the initial time, and forget the returns of an earlier run."""
        self._begins, self._restarts = True, restarts
        self._anew = Anew.YES if restarts else Anew.AT_START
        self._section: Section | None = None
        self._watch.state["last_slip"] = -math.inf

    def repeat(self, machine: Machine) -> None:
        """Return to the initial time, with the initial state of another machine.

        machine : differs in nothing but the initial angles and speeds of its inertias
        """
        problem, systems = self.assembled.problem, self._run.systems
        # The same bits as a run of its own: nothing is kept but the equations of the modes.
        self._run = run_of(problem)._replace(systems=systems)
        self._watch = watch_of(problem, self._watched)
        problem.signals.angles[:] = self._angles
        self._start(machine, None)

    def restart(self, states: FloatArray, delayed: FloatArray = _NONE) -> None:
        """Return to the initial time with other states.

        At the next ``advance``, the modes of the contacts follow from the states, and controllers
        take new samples.

        delayed : forces that controllers have sampled before and not yet applied, in the order of
                  the contacts, of each the next to act first [N]; the initial time must be 0.
                  none: the initial forces
        """
        problem, run = self.assembled.problem, self._run
        run.clock[:] = problem.start_time, 0.0
        run.z[:] = 0.0
        run.z[: problem.states, 0] = states
        run.modes[:] = np.zeros(1, run.modes.dtype)
        run.modes["first_sample"] = problem.start_time
        at = 0
        for number, contact in enumerate(problem.contacts if delayed.size else ()):
            delay, mode = int(contact["delay"]), run.modes[number]
            if contact["sampled_input"] >= 0 and delay > 0:
                # A power of 2: the product has no rounding, so that the next sample is now.
                mode["samples"], mode["first_sample"] = _BEFORE, -_BEFORE * contact["sample_time"]
                slots = (_BEFORE - delay + np.arange(delay)) % (delay + 1)
                run.queues[number, slots] = delayed[at : at + delay]
                at += delay
        problem.signals.angles[:] = self._angles
        trajectory.set_inputs(problem, run)
        self._begin(restarts=False)

    @property
    def time(self) -> float:
        """The present time [s]."""
        return float(self._run.clock[0])

    @property
    def state(self) -> Run:
        """The present state in the form used by the kernels."""
        return self._run

    @property
    def held_inputs(self) -> list[int]:
        """Number of the input that each force in the memory of controllers is; -1 if it is later.

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
        derivatives: bool = False, details: bool = False, measures: bool = False,
        max_events: int = _MOST_EVENTS,
    ) -> Passage:  # fmt: skip
        """Continue for a number of returns or for a duration, whichever ends first.

        section  : section of the returns; None to continue for the duration without returns
        returns  : number of returns; 0 for all within the duration
        duration : [s]
        details  : whether to record the friction heat, and the extremes of ``further`` quantities
        measures : whether to record the ``quantities``

        A state that is on the section at the beginning does not count as a return. Raises
        ``InputError`` for a run without end, or beyond the end of a table.
        """
        begin, run = self.time, self._run
        if section is None and returns != 0:
            raise wrong("returns", returns, "0 without a section")
        if math.isinf(duration) and returns < 1:
            raise wrong("duration", duration, "finite where no number of returns is wanted")
        self._begin_at(section, derivatives, details)
        if duration > 0.0:
            self._anew = Anew.YES
        self._begin_quantities(measures)
        watch, end = self._watch, begin + duration
        known = self._last_time(section, returns, end)
        if known > self._limit:
            self.machine.check_times(begin, known)
        capacity = returns if returns > 0 else self._capacity(section, begin, end)
        parts: list[Watch] = []
        logs = [self._log[:0].copy()]
        events, cells, outcome, ended = 0, 0, Outcome.LOG_FULL, begin
        # A motion that comes to rest may never return.
        most_cells = _CELLS if math.isinf(end) and isinstance(section, Crossing) else 10**18
        observer = self._heat if details else self._no_heat
        observer.work[:] = 0.0
        while outcome == Outcome.LOG_FULL:
            if not parts or int(watch.state[0]["count"]) == capacity:
                watch = self._with_capacity(section, capacity, derivatives)
                observer = observer._replace(watch=watch)
                parts.append(watch)
            span = trajectory.Span(
                min(end, self._limit, _NEVER),
                max_events - events,
                most_cells - cells,
                False,
                self._begins,
                self._restarts,
                self._stop,
            )
            found = trajectory.move(self.assembled.problem, run, span, self._log, observer)
            self._begins = False
            events, cells, ended = events + found.events, cells + found.cells, found.time
            outcome = Outcome(found.outcome)
            if self._logs:
                logs.append(self._log[: found.events].copy())
            full = capacity > 0 and int(watch.state[0]["count"]) == capacity
            if outcome == Outcome.COMPLETED and returns < 1 and full and ended < end:
                outcome = Outcome.LOG_FULL
        if outcome == Outcome.COMPLETED and ended < end and not full:
            self.machine.check_times(begin, math.nextafter(self._limit, math.inf))
        return self._passage(outcome, parts, logs, observer.work, (events, cells, ended - begin))

    def _begin_at(self, section: Section | None, derivatives: bool, details: bool) -> None:
        """Prepare the ``Watch`` for a passage."""
        rows = self._rows if details else self._rows[: self._always]
        low = np.full(len(rows), math.inf)
        self._watch = watch = self._watch._replace(rows=rows, low=low, high=-low)
        state = watch.state[0]
        if section != self._section:
            self._section = section
            state["scale"], state["below"] = 0.0, 0
            self._watch = watch = watch._replace(**self._fields(section))
        if derivatives:
            watch.state["anew"] = self._anew
        if isinstance(section, Every):
            watch.state["next"] = self._next_return(section)
        watch.peak[:] = watch.time_at_rest[:] = 0.0
        watch.entered[:] = 0

    def _begin_quantities(self, measures: bool) -> None:
        """Prepare the record of the quantities."""
        problem = self.assembled.problem
        if not measures or self._quantities is None:
            self._watch = self._watch._replace(quantities=self._no_quantities)
            return
        found = quantities_of(self._quantities, problem.states, problem.torque.shape[1])
        # A level near the mean: the mean square of a small vibration is then not a difference of
        # large numbers.
        values = found.rows[:, : problem.states] @ self._run.z[: problem.states, 0]
        found.level[:] = np.where((found.order == 0) & (found.contact < 0), values, 0.0)
        found.low[:], found.high[:] = math.inf, -math.inf
        self._watch = self._watch._replace(quantities=found)

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

    def _last_time(self, section: Section | None, returns: int, end: float) -> float:
        """Time at which a passage ends, if it is known; otherwise the present time [s]."""
        if isinstance(section, Every) and returns > 0:
            last = int(self._watch.state[0]["next"]) + returns - 1
            return min(end, section.origin + last * section.period)
        return self.time if math.isinf(end) or returns > 0 else end

    def _capacity(self, section: Section | None, begin: float, end: float) -> int:
        """Number of returns for which memory is allocated at a time."""
        if isinstance(section, Every):
            return 2 + math.floor((end - begin) / section.period)
        return 0 if section is None else _CHUNK

    def _with_capacity(self, section: Section | None, capacity: int, derivatives: bool) -> Watch:
        """The ``Watch`` with memory for a number of returns."""
        watch = self._watch
        count = 0 if section is None else capacity
        memory = watch.shift.size
        watch.state["count"] = 0
        return watch._replace(
            derivative=derivatives,
            times=np.empty(count),
            states=np.empty((count, self.assembled.problem.states)),
            matrices=np.empty((count if derivatives else 0, memory, memory)),
        )

    def _passage(
        self, outcome: Outcome, parts: list[Watch], logs: list[NDArray[np.void]],
        heat: FloatArray, sums: tuple[int, int, float],
    ) -> Passage:  # fmt: skip
        """Collect what has been recorded as a ``Passage``."""
        watch, run = parts[-1], self._run
        count = int(watch.state[0]["count"])
        ends = [*([one.times.size for one in parts[:-1]]), count]
        times, states, matrices = (
            np.concatenate([
                getattr(one, name)[:end] for one, end in zip(parts, ends, strict=True)
            ])
            if len(parts) > 1 else getattr(watch, name)[:count]
            for name in ("times", "states", "matrices")
        )  # fmt: skip
        events, cells, duration = sums
        return Passage(
            outcome, times, states, matrices, watch.low.copy(), watch.high.copy(),
            watch.peak.copy(), watch.time_at_rest.copy(), watch.entered.copy(),
            heat.copy(), events, cells, duration,
            float(watch.state[0]["last_slip"]), np.concatenate(logs),
            QuantityStatistics.of(watch.quantities, duration), self.machine,
            self.assembled.problem, _kept(run),
        )  # fmt: skip


def _kept(run: Run) -> Run:
    """Copy of a run whose state no longer changes."""
    return run._replace(
        clock=run.clock.copy(), z=run.z[:, :1].copy(), modes=run.modes.copy(),
        queues=run.queues.copy(),
    )  # fmt: skip
