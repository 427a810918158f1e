"""One-sided derivatives of runs in which the order of coincident events changes with a parameter.

Two events of different parts may occur at the same instant, or an event may occur at a sampling or
at a knot of a signal. If their times change differently with a parameter, their orders on the two
sides of its value differ. The derivative on one side is then the limit of the derivatives of runs
on this side, in which the events occur at different times. The same applies if the command of a
force is exactly at a limit of the force, and if a parameter moves a knot of a signal that is at a
sampling.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wedgebrake.analysis.responses.repeat import solved
from wedgebrake.arrays import FloatArray, Records
from wedgebrake.dynamics.enums import Outcome
from wedgebrake.errors import InputError
from wedgebrake.model.machine import Machine
from wedgebrake.model.machine_matrices import contact_rows
from wedgebrake.model.part import SMALLEST
from wedgebrake.model.signals.signals import as_signal
from wedgebrake.solvers.interrupts import interruptible
from wedgebrake.solvers.machine.final_state import FinalState
from wedgebrake.solvers.machine.solve import MachineTask
from wedgebrake.solvers.machine.tangents import (
    FINE,
    Parameter,
    TangentAnswer,
    TangentTask,
    differentiate,
    knot_changes,
    machine_beside,
    samples_of,
)
from wedgebrake.solvers.response import without_force

# Times of an event in two runs that differ by less, relative to their size, are the same.
_SAME = 1e-9
# Instants that differ by less, relative to their size, are the same up to rounding.
_TIE = 1e-11
# Difference of the parameter between two neighbouring runs, as a share of its value.
_BESIDE = 2.0**-22
# Derivatives that differ by less than this share of the largest are the same.
_AGREE = 1e-6
_MOST_EVENTS = 10**12
# Derivatives of the motion; the parameters are their last dimension.
_MOTION = ("states", "torques", "forces", "outputs", "final")
# Derivatives of the times of events; the parameters are their last dimension, too.
_EVENTS = "shifts"
# Places in an interval between events, as shares of it, at which forces are compared with limits.
_INSIDE = np.array([0.21, 0.5, 0.83])
# Rounding of the time of an event, and the relative deviation between its derivative and its
# difference quotient up to which the event of a run beside is the same one.
_ROUNDING, _SAME_SHIFT = 1e-13, 1e-3


class OneSided(NamedTuple):
    """The sides of the values of q parameters on which the derivatives hold.

    one_sided  : (q,) 1: for larger values; -1: for smaller values; 0: on both sides
    ordered    : (q,) whether derivatives of the motion depend on the order of coincident events
    times      : (k,) instants of events whose order changes [s]
    changes    : (k, q) whether their order changes with a parameter
    shifts     : (k, q) derivatives of the times of these events; nan where unknown
    may_differ : (q,) whether the derivatives may differ on the two sides
    alone      : (q,) whether only values on one side are possible
    explain    : returns the note for given sides
    note       : sentences that are added to the message of a result
    """

    one_sided: FloatArray
    ordered: NDArray[np.bool_]
    times: FloatArray
    changes: NDArray[np.bool_]
    shifts: FloatArray
    may_differ: NDArray[np.bool_]
    alone: NDArray[np.bool_]
    explain: Callable[[OneSided], str]
    note: str

    def set_shifts(self, times: FloatArray, shifts: FloatArray) -> None:
        """Set the derivatives (q, e) of the times of events (e,) whose order changes."""
        ends = 1 + np.flatnonzero(np.diff(self.times) > _tolerance(self.times[1:]))
        for own in np.split(np.arange(self.times.size), ends):
            for number in np.flatnonzero(self.changes[own].any(axis=0)):
                at = np.abs(times - self.times[own[0]]) <= _tolerance(self.times[own[0]])
                same_events = np.count_nonzero(at) == own.size
                shifts[number, at] = self.shifts[own, number] if same_events else math.nan


class _Sequence(NamedTuple):
    """The events of a run, and the times of its samplings and knots [s]."""

    log: Records
    ticks: FloatArray

    @property
    def tied(self) -> NDArray[np.bool_]:
        """Which events coincide with another event, a sampling or a knot."""
        times = self.log["time"]
        found = self._places()[1]
        with_next = np.diff(times) <= _tolerance(times[1:])
        found[1:] |= with_next
        found[:-1] |= with_next
        return found

    def _places(self) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
        """Number of samplings and knots before each event, and whether one coincides with it."""
        times = self.log["time"]
        apart = _tolerance(times)
        before = np.searchsorted(self.ticks, times - apart)
        return before, before != np.searchsorted(self.ticks, times + apart)

    def order(self) -> list[tuple[int, ...]]:
        """The sequence of events, and which of them coincide, without their times."""
        names = [name for name in self.log.dtype.names or () if name != "time"]
        columns = [self.log[name] for name in names]
        return list(map(tuple, np.column_stack([*columns, *self._places(), self.tied]).tolist()))


class _Beside(NamedTuple):
    """Runs on one side of the value of a parameter, at the distances h and 2 h."""

    side: float
    distance: float
    sequences: tuple[_Sequence, _Sequence]

    def times(self, event: Records) -> tuple[float, float]:
        """Times of an event in both runs [s]; nan if there is no such event."""
        found = []
        for log, _ in self.sequences:
            same = np.ones(log.size, bool)
            for name in log.dtype.names or ():
                same &= (log[name] == event[name]) if name != "time" else True
            times = log["time"][same]
            near = np.argmin(np.abs(times - event["time"])) if times.size else -1
            found.append(float(times[near]) if times.size else math.nan)
        return found[0], found[1]

    def coincide(self, times: FloatArray) -> NDArray[np.bool_]:
        """Whether events at times of the first run coincide with others there; False at nan."""
        own = self.sequences[0]
        here = own.log["time"][own.tied]
        return np.isin(times, here)


def differentiated(task: TangentTask, side: float = 1.0) -> tuple[TangentAnswer, OneSided]:
    """Run a machine and differentiate it, one-sidedly if the order of coincident events changes.

    side : the side that is used if both have derivatives: 1 for larger values, -1 for smaller ones

    Raises ``InputError`` as ``differentiate``.
    """
    found = interruptible(lambda: differentiate(task))
    task = task._replace(parameters=found.parameters)
    here = _sequence_of(task, task.machine, task.initial)
    events = here.log[here.tied & (here.log["time"] > task.span[0])]
    columns = {name: getattr(found, name).copy() for name in (*_MOTION, _EVENTS)}
    one_sided = found.one_sided.copy()
    ordered, alone, used = np.zeros((3, len(task.parameters)), bool)
    changes, shifts = np.zeros((2, events.size, one_sided.size))
    together = np.abs(events["time"] - events["time"][:, None]) <= _tolerance(events["time"])
    completed = found.outcome == Outcome.COMPLETED
    kinks = _kinks(task, here) if completed else used
    for number in range(one_sided.size):
        if not completed or not (kinks[number] or events.size):
            continue
        wanted = [one for one in (side, -side) if one_sided[number] in (0.0, one)]
        beside = [one for one in (_beside(task, number, at) for at in wanted) if one is not None]
        same = all(one.sequences[0].order() == here.order() for one in beside)
        if not beside or (same and not kinks[number]):
            continue
        used[number] = True
        limits = [_limit(task, number, one, events, found.events) for one in beside]
        own = {name: one[..., number] for name, one in columns.items()}
        differ = not _agree(own, limits[0])
        alone[number] = len(limits) == 1 and not (same and not differ)
        if alone[number] or not _agree(*limits):
            one_sided[number] = beside[0].side
        ordered[number] = not all(_agree(own, one) for one in limits)
        if differ:
            for name, column in own.items():
                column[...] = limits[0][name]
        shifts[:, number] = limits[0]["tied"]
        if not same:
            times = np.array([beside[0].times(one)[0] for one in events])
            changes[:, number] = together @ ~beside[0].coincide(times)
    explain = partial(_note, [one.name for one in task.parameters], found)
    sides = OneSided(
        one_sided, ordered, events["time"], changes > 0.0, shifts, used | found.held, alone,
        explain, "",
    )  # fmt: skip
    return found._replace(**columns), sides._replace(note=explain(sides))


def _kinks(task: TangentTask, here: _Sequence) -> NDArray[np.bool_]:
    """Which parameters move a force that is at a limit, or a knot of a signal at a sampling.

    On one side of the value the force is beyond its limit, or the knot is after the sampling.
    """
    found, taken = np.zeros(len(task.parameters), bool), samples_of(task)
    each = [*zip(task.parameters, task.machine_at, strict=True)]
    near = [machine_beside(one, machine_at) for one, machine_at in each]
    contacts = [i for i, without in enumerate(without_force(task.machine)) if not without]
    changes_of = [
        {i for i in contacts if _commands(one, i) != _commands(task.machine, i)} for one in near
    ]
    limited = _at_limits(task, here) if any(changes_of) else set()
    for number, (one, machine_at) in enumerate(each):
        found[number] = not limited.isdisjoint(changes_of[number])
        if not taken:
            continue
        for knots, changes in knot_changes(one, machine_at, task.span):
            for samples in taken:
                place, _ = matching(samples.times, knots)
                if not samples.times.size:
                    continue
                at = np.abs(samples.times[place] - knots) <= _tolerance(knots)
                moved = ~(np.abs(changes - samples.changes[place, number]) == 0.0)
                found[number] |= bool((at & moved).any())
    return found


def _commands(machine: Machine, contact: int) -> tuple[Any, ...]:
    """What determines the force of a contact, besides the motion."""
    name = f"{machine.contacts[contact].name}.command"
    loops = [one for one in machine.controllers if one.output == name]
    return (machine.contacts[contact].actuation, *loops)


def _at_limits(task: TangentTask, here: _Sequence) -> set[int]:
    """Contacts whose force is at a limit for a while, with a command that is not beyond it."""
    edges = np.unique(np.concatenate([[*task.span], here.log["time"], here.ticks]))
    edges = edges[(edges >= task.span[0]) & (edges <= task.span[1])]
    times = (edges[:-1, None] + np.diff(edges)[:, None] * _INSIDE).ravel()
    run = MachineTask(
        *task.span, times, task.initial,
        until_rest=False, max_events=_MOST_EVENTS, method=task.method,
    )  # fmt: skip
    answer = solved(task.machine, run)
    seen, n = answer.observer, len(task.machine.inertias)
    speeds = seen.states[:, n : 2 * n] @ contact_rows(task.machine).T
    found = set()
    for number, (part, one) in enumerate(
        zip(task.machine.contacts, answer.assembled.problem.contacts, strict=True)
    ):
        force = seen.force[:, number]
        limits = [own for own in (one["lowest"], one["highest"]) if np.any(force == own)]
        if not limits or without_force(task.machine)[number]:
            continue
        if one["commanded"] or one["normal"] >= 0 or one["sampled_input"] >= 0:
            found.add(number)  # its command is not known here
            continue
        if one["lag"] > 0:
            command = seen.states[:, one["state"]]
        else:
            sliding = np.abs(speeds[:, number] - as_signal(part.base_speed)(times))
            sliding[seen.side[:, number] == 0] = 0.0
            command = as_signal(part.actuation.initial_force)(times) + one["slope"] * sliding
        size = 1.0 + np.abs(command).max()
        if any(np.any(np.abs(command - own) <= _TIE * size) for own in limits):
            found.add(number)
    return found


def distance_beside(parameter: Parameter) -> float:
    """Difference of a parameter between neighbouring runs; its step resolves all numbers."""
    size = abs(parameter.value) if abs(parameter.value) > SMALLEST else 1.0
    return _BESIDE * max(size, parameter.step / FINE.step)


def _beside(task: TangentTask, number: int, side: float) -> _Beside | None:
    """Return the runs on one side of a parameter; None if it cannot have these values."""
    one = task.parameters[number]
    distance = distance_beside(one)
    try:
        sequences = [
            _sequence_of(task, *_moved(task, number, side * distance * count))
            for count in (1.0, 2.0)
        ]
    except InputError:
        return None
    return _Beside(side, distance, (sequences[0], sequences[1]))


def _moved(task: TangentTask, number: int, change: float) -> tuple[Machine, FinalState | None]:
    """The machine and its initial state for another value of a parameter."""
    machine, initial = task.machine_at[number](task.parameters[number].value + change), task.initial
    if initial is None or task.start is None:
        return machine, initial
    moved = change * task.start[:, number]
    n = len(initial.angles)
    states = (initial.angles.items(), initial.speeds.items())
    angles, speeds = (
        {name: value + float(apart) for (name, value), apart in zip(given, own, strict=True)}
        for given, own in zip(states, (moved[:n], moved[n : 2 * n]), strict=True)
    )
    lags = tuple(float(one) for one in np.array(initial.actuators) + moved[2 * n :])
    return machine, replace(initial, angles=angles, speeds=speeds, actuators=lags)


def near_task(task: TangentTask, number: int, change: float) -> TangentTask:
    """The task at another value of a parameter, with derivatives with respect to it only."""
    machine, initial = _moved(task, number, change)
    one = task.parameters[number]
    return task._replace(
        machine=machine, initial=initial,
        start=None if task.start is None else task.start[:, [number]],
        parameters=(one._replace(value=one.value + change, divisions=0),),
        machine_at=(task.machine_at[number],),
    )  # fmt: skip


def _limit(
    task: TangentTask, number: int, beside: _Beside, events: Records, watched: FloatArray
) -> dict[str, FloatArray]:
    """Return derivatives on one side of a parameter: of the motion, and of the times of events.

    At the instant of an event, the derivatives of the motion are those just after it.

    events : those that coincide with others;  watched : times of those that guards detect
    """
    times = np.array([beside.times(one) for one in events]).reshape(-1, 2).T
    apart = times - events["time"]
    at_event = np.abs(task.times[:, None] - events["time"]) <= _tolerance(events["time"])
    later = np.where(
        at_event.any(axis=1), np.nan_to_num(np.abs(apart)).max(initial=0.0) + _TIE, 0.0
    )
    found: list[dict[str, FloatArray]] = []
    for count, at in zip((1.0, 2.0), times, strict=True):
        change = beside.side * count * beside.distance
        near = near_task(task, number, change)
        near = near._replace(times=np.minimum(task.times + count * later, task.span[1]))
        answer = interruptible(lambda near=near: differentiate(near))  # type: ignore[misc]
        motion = {name: getattr(answer, name)[..., 0] for name in _MOTION}
        # Events that are not in the answer are caused by a jump and remain at its time.
        place, known = matching(answer.events, at)
        causes = (at - events["time"]) / change
        shifts = np.where(known, answer.shifts[place, 0], causes) if known.any() else causes
        moved = np.full((2, watched.size), math.nan)
        if answer.events.size:
            place, _ = matching(answer.events, watched)
            moved = np.array([answer.shifts[place, 0], (answer.events[place] - watched) / change])
        found.append(motion | {"tied": shifts, _EVENTS: moved})
    limit = {name: 2.0 * near - found[1][name] for name, near in found[0].items()}
    # The event of a run beside is the same one if its time differs by the derivative.
    shifts, moved = limit[_EVENTS]
    rounding = _ROUNDING * (1.0 + np.abs(watched)) / beside.distance
    same = np.abs(shifts - moved) <= _SAME_SHIFT * np.abs(shifts) + rounding
    return limit | {_EVENTS: np.where(same, shifts, math.nan)}


def _agree(one: dict[str, FloatArray], other: dict[str, FloatArray]) -> bool:
    """Return True if both have the same derivatives of the motion."""
    return all(
        np.allclose(
            one[name], other[name], _AGREE,
            _AGREE * np.abs(one[name][np.isfinite(one[name])]).max(initial=0.0), equal_nan=True,
        )
        for name in one if name != _EVENTS and name in other
    )  # fmt: skip


def matching(times: FloatArray, wanted: FloatArray) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """Return the indices of the ascending times nearest to those wanted, and whether they agree."""
    if not times.size:
        return np.zeros(wanted.shape, int), np.zeros(wanted.shape, bool)
    after = np.clip(np.searchsorted(times, wanted), 0, times.size - 1)
    before = np.maximum(after - 1, 0)
    place = np.where(np.abs(times[before] - wanted) < np.abs(times[after] - wanted), before, after)
    return place, np.abs(times[place] - wanted) <= _SAME * (1.0 + np.abs(wanted))


def _tolerance(times: FloatArray) -> FloatArray:
    """Return the distances from times within which instants are the same up to rounding."""
    return np.asarray(_TIE * (1.0 + np.abs(times)))


def _sequence_of(task: TangentTask, machine: Machine, initial: FinalState | None) -> _Sequence:
    """Return the events of a run of a machine over the span of a task."""
    begin, end = task.span
    run = MachineTask(
        begin, end, np.empty(0), initial,
        until_rest=False, max_events=_MOST_EVENTS, method=task.method,
    )  # fmt: skip
    known: list[FloatArray] = [
        np.asarray(signal.knots(begin, end), float) for signal in machine.signals().values()
    ]
    taken = [(one.actuation.sample_time, (begin, 0)) for one in machine.contacts]
    taken += [(one.sample_time, (begin, 0)) for one in machine.controllers]
    known_samples = () if initial is None else initial.sampled + initial.samplings
    if len(known_samples) == len(taken):
        taken = [(step, since) for (step, _), since in zip(taken, known_samples, strict=True)]
    for step, (first, count) in taken:
        if step is not None:
            last = math.floor((end - first) / step)
            known.append(np.asarray(first + step * np.arange(count, last + 1)))
    return _Sequence(solved(machine, run).events, np.sort(np.concatenate([np.empty(0), *known])))


def _note(parameters: list[str], answer: TangentAnswer, sides: OneSided) -> str:
    """Return what the message of a result says about one-sided derivatives."""
    alone = sides.alone
    names, changes, found = np.array(parameters), sides.changes, ""
    # Where a contact slips from the sliding speed 0 at the start.
    start = np.where(answer.tied == 0.0, answer.one_sided, 0.0)
    for side, word in ((1, "larger"), (-1, "smaller")):
        if (answer.tied == side).any():
            found += (
                f" The lines of friction or the states of the machine change at the value of"
                f" {', '.join(names[answer.tied == side])}: the derivatives are those for {word}"
                " values."
            )
    if start.any():
        found += (
            " At the start a contact slips from the sliding speed 0: derivatives with respect to"
            f" {', '.join(names[start != 0.0])} are one-sided."
        )
    if changes.any():
        first = float(sides.times[changes.any(axis=1)][0])
        found += (
            f" At t = {first:.9g} s an event coincides with another event, a sampling or a knot of"
            f" a signal. Their order changes with {', '.join(names[changes.any(axis=0)])}."
        )
        both = names[changes.any(axis=0) & (sides.one_sided == 0.0)]
        if both.size:
            found += (
                f" Derivatives with respect to {', '.join(both)} are the same for larger and"
                " smaller values."
            )
    kinked = (
        sides.may_differ
        & (sides.one_sided != 0.0)
        & ~changes.any(axis=0)
        & (answer.one_sided == 0.0)
    )
    if kinked.any():
        found += (
            " At the value of a parameter, a force is at one of its limits, a knot of a signal is"
            " at a sampling, a contact begins at rest whose sliding speed changes, or events"
            " coincide."
        )
    start_or_tied = answer.one_sided != 0.0
    sided_here = (changes.any(axis=0) & ~start_or_tied) | kinked
    for side, word, other in ((1, "larger", "smaller"), (-1, "smaller", "larger")):
        own = (sides.one_sided == side) & sided_here
        for sided, further in (
            (names[own & ~alone], f"; side={-side} gives those for {other} values."),
            (names[own & alone], f"; the system cannot have {other} values."),
        ):
            if sided.size:
                found += (
                    f" Derivatives with respect to {', '.join(sided)} are those for {word}"
                    f" values{further}"
                )
    return found
