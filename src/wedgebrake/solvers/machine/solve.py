"""The solver for machines: from a task to the answer."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wedgebrake.arrays import FloatArray
from wedgebrake.dynamics.enums import Outcome
from wedgebrake.model.machine import Machine
from wedgebrake.solvers.machine.assemble import Assembled, assemble
from wedgebrake.solvers.machine.final_state import FinalState, restore, start_state, state_of
from wedgebrake.solvers.machine.power_rows import power_rows
from wedgebrake.solvers.machine.problem import EVENT, Run, run_of
from wedgebrake.solvers.machine.rest import remains_at_rest
from wedgebrake.solvers.machine.rotations import Rotations
from wedgebrake.solvers.machine.trajectory import trajectory
from wedgebrake.solvers.machine.trajectory.observers import Observer, observer_of

# Time between two proofs that a machine stays at rest, in longest cells.
_PATIENCE = 16.0
# A number of cells that is never reached.
_CELLS = 10**18
# Rows of the log that is filled at a time.
_ROWS = 4096


@dataclass(frozen=True)
class MachineTask:
    """Task of the solver: initial state, end, and times of the samples.

    times : (k,) times at which the response is wanted [s], ascending
    until_rest : end as soon as all contacts are permanently at rest
    method : "exact", friction over the speed as straight lines, or "smooth", as the curve
    stop  : (1,) ends the run at its next event when another thread sets it to True
    """

    start: float
    end: float
    times: FloatArray
    initial: FinalState | None
    until_rest: bool
    max_events: int
    method: str = "exact"
    stop: NDArray[np.bool_] = field(default_factory=lambda: np.zeros(1, dtype=np.bool_))


class MachineAnswer(NamedTuple):
    """The solver's answer: numbers of the machine, samples, events and final state.

    start : time of the start [s]
    sides : of the contacts at the start
    """

    assembled: Assembled
    observer: Observer
    events: Any
    start: float
    sides: NDArray[np.int64]
    outcome: Outcome
    at_rest: bool
    cells: int
    final: FinalState


def solve_machine(
    machine: Machine, task: MachineTask, *, powers: bool = False, peaks: bool = False
) -> MachineAnswer:
    """Simulate a machine exactly (docs/numerics.md, "Exact solution of machines").

    powers : whether to integrate the work of every part as well, in the order of ``power_rows``
    peaks  : whether to record the largest torques of contacts

    Raises ``InputError`` for what the method cannot solve.
    """
    assembled = assemble(machine, task.start, curved=task.method == "smooth")
    problem = assembled.problem
    run = run_of(problem)
    known = task.initial is not None
    if task.initial is None:
        start_state(machine, problem, run)
    else:
        known = restore(task.initial, machine, problem, run)
    observer = observer_of(problem, task.times, power_rows(machine, assembled) if powers else None)
    if peaks:
        observer = observer._replace(peak=np.zeros(problem.contacts.size))
    log, events, count, cells = np.zeros(_ROWS, EVENT), [], 0, 0
    outcome, at_rest, begins = Outcome.LOG_FULL, False, True
    rotations = Rotations(machine)
    while outcome in (Outcome.LOG_FULL, Outcome.PAUSED):
        end, sample = rotations.next_end(run, task.end), int(observer.at[0])
        if task.until_rest and not begins and not run.modes["side"].any():
            at_rest = remains_at_rest(machine, assembled, run)
            # End here, with a last sample in the new modes, or try again later.
            end = min(end, run.clock[0] + (0.0 if at_rest else _patience(run)))
        span = trajectory.Span(
            end, task.max_events - count, _CELLS, task.until_rest, begins,
            known, task.stop,
        )  # fmt: skip
        ended = trajectory.move(problem, run, span, log, observer)
        observer.states[sample : observer.at[0], : rotations.out.size] += rotations.out
        events.append(log[: ended.events].copy())
        count, cells, outcome = count + ended.events, cells + ended.cells, Outcome(ended.outcome)
        if outcome == Outcome.COMPLETED and end < task.end and not at_rest:
            outcome = Outcome.PAUSED
        begins = False
    run.z[: rotations.out.size, 0] += rotations.out
    final = state_of(machine, problem, run)
    return MachineAnswer(
        assembled,
        observer,
        events[0] if len(events) == 1 else np.concatenate(events),
        task.start,
        run.modes["first"].copy(),
        outcome,
        at_rest,
        cells,
        final,
    )


def _patience(run: Run) -> float:
    """Time until the next proof [s]."""
    longest = run.systems.longest[: run.systems.used[0]]
    finite = longest[np.isfinite(longest)]
    return _PATIENCE * float(finite.max()) if finite.size else 1.0
