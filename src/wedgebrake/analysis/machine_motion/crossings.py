"""Returns of a self-excited machine: a speed crosses a level, or a contact begins to slide."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wedgebrake.analysis.machine_motion.coordinates import coordinates
from wedgebrake.analysis.machine_motion.return_run import Prepared, ReturnRun
from wedgebrake.analysis.machine_motion.section import (
    FIRST_LOOK,
    LONGER,
    MOST_CELLS,
    RETURNS_WITHIN,
    STILL,
    crossing,
)
from wedgebrake.arrays import FloatArray
from wedgebrake.dynamics.enums import EventKind, Outcome
from wedgebrake.model.machine import Machine
from wedgebrake.solvers.machine.final_state import FinalState
from wedgebrake.solvers.machine.solve import MachineTask, solve_machine

# Fewest returns that are waited for, and most over which the range of a speed is taken.
_FEWEST, _MEASURED = 16, 16


class Start(NamedTuple):
    """Initial state, initial time and method of a run.

    initial : state, or None for the initial state of the machine at ``time`` [s]
    """

    initial: FinalState | None
    time: float
    method: str
    max_events: int


class Crossings(NamedTuple):
    """Returns to a section.

    numbers : (k,) numbers of the returns, from 1
    times, states : (k,) [s], (k, states)
    section : name of the inertia or contact
    level   : speed of the inertia at the section [rad/s]; nan for a contact
    """

    numbers: NDArray[np.int64]
    times: FloatArray
    states: FloatArray
    section: str
    level: float
    outcome: Outcome
    final: FinalState


def inertia_crossings(
    machine: Machine, inertia: str | None, first: int, last: int, start: Start
) -> Crossings:
    """Times at which the speed of an inertia crosses the middle of its range upwards.

    inertia     : its name; None for the one whose scaled speed has the largest range
    first, last : numbers of the first and last return; the range is determined shortly before the
                  first one
    """
    prepared = Prepared.by_series(machine, start.method, start.initial, start.time)
    run, space = ReturnRun(prepared, start.max_events), prepared.space
    which = None if inertia is None else machine.index(inertia)
    passage = run.advance(0, duration=FIRST_LOOK * space.longest_period)
    run.section = section = crossing(passage, space, which)
    # The section is moved to the middle of the motion to which the transient leads.
    parts = [first - 1 - _MEASURED, _MEASURED] if first > _MEASURED + 1 else [first - 1]
    for count in parts:
        if count > 0 and run.completed:
            passage = run.passages(count)[-1]
    times, states = np.empty(0), np.empty((0, space.to.shape[1]))
    # What is left of a vibration that dies out is rounding, and does not cross anything.
    if run.completed and run.range_of(passage) > STILL * run.speed_of(passage):
        run.section = section = crossing(passage, space, which)
        passages = run.passages(last - first + 1)
        passage = passages[-1]
        times = np.concatenate([one.times for one in passages])
        states = np.concatenate([one.states for one in passages])
    row = np.array(section.row)
    n = len(machine.inertias)
    number = int(np.flatnonzero(row)[0])
    return Crossings(
        first + np.arange(times.size), times, states, machine.inertias[number - n].name,
        section.level / float(row[number]), passage.outcome, passage.final,
    )  # fmt: skip


def contact_crossings(
    machine: Machine, contact: str, first: int, last: int, start: Start
) -> Crossings:
    """Times at which a contact begins to slide; arguments as in ``inertia_crossings``."""
    space = coordinates(machine)
    within, cells = RETURNS_WITHIN * space.longest_period, 0
    which = [one.name for one in machine.contacts].index(contact)
    state, time, events, done = start.initial, start.time, 0, 0
    times: list[FloatArray] = []
    states: list[FloatArray] = []
    while done < last:
        end = time + max(last - done, _FEWEST) * within
        events_left = start.max_events - events
        task = MachineTask(time, end, np.empty(0), state, False, events_left, start.method)
        answer = solve_machine(machine, task)
        found = answer.events
        slips = (found["kind"] == EventKind.SLIP) & (found["contact"] == which)
        own = found["time"][slips][max(first - 1 - done, 0) : last - done]
        if own.size:
            # The same run again, with samples at these instants.
            again = MachineTask(time, float(own[-1]), own, state, False, events_left, start.method)
            times.append(own)
            states.append(solve_machine(machine, again).observer.states.copy())
        done += int(slips.sum())
        events, cells = events + len(found), cells + answer.cells
        state, time = answer.final, answer.final.time
        lasts = state.modes[which][0] == 0 and cells < MOST_CELLS
        if answer.outcome != Outcome.COMPLETED or not (slips.any() or lasts):
            break
        if not slips.any():
            within *= LONGER
    reached = np.concatenate(times) if times else np.empty(0)
    points = np.concatenate(states) if states else np.empty((0, space.to.shape[1]))
    return Crossings(
        first + np.arange(reached.size), reached, points, contact, math.nan, answer.outcome,
        answer.final,
    )  # fmt: skip
