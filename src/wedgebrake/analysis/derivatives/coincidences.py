"""One-sided derivatives of runs in which the order of coincident events changes with a parameter.

Two events of different parts may occur at the same instant, or an event may occur at a sampling or
at a knot of a signal. If their times change differently with a parameter, their orders on the two
sides of its value differ. The derivative on one side is then the limit of the derivatives of runs
on this side, in which the events occur at different times.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wedgebrake.analysis.responses.repeat import solved
from wedgebrake.arrays import FloatArray, Records
from wedgebrake.dynamics.enums import Outcome
from wedgebrake.errors import InputError
from wedgebrake.model.machine import Machine
from wedgebrake.model.part import SMALLEST
from wedgebrake.solvers.interrupts import interruptible
from wedgebrake.solvers.machine.final_state import FinalState
from wedgebrake.solvers.machine.solve import MachineTask
from wedgebrake.solvers.machine.tangents import TangentAnswer, TangentTask, differentiate

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


class OneSided(NamedTuple):
    """The sides of the values of q parameters on which the derivatives hold.

    one_sided : (q,) 1: for larger values; -1: for smaller values; 0: on both sides
    ordered   : (q,) whether derivatives of the motion depend on the order of coincident events
    times     : (k,) instants of events whose order changes [s]
    changes   : (k, q) whether their order changes with a parameter
    shifts    : (k, q) derivatives of the times of these events; nan where unknown
    note      : sentences that are added to the message of a result
    """

    one_sided: FloatArray
    ordered: NDArray[np.bool_]
    times: FloatArray
    changes: NDArray[np.bool_]
    shifts: FloatArray
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
    here = _sequence_of(task, task.machine, task.initial)
    events = here.log[here.tied & (here.log["time"] > task.span[0])]
    columns = {name: getattr(found, name).copy() for name in _MOTION}
    one_sided, (ordered, alone) = found.one_sided.copy(), np.zeros((2, len(task.parameters)), bool)
    changes, shifts = np.zeros((2, events.size, one_sided.size))
    together = np.abs(events["time"] - events["time"][:, None]) <= _tolerance(events["time"])
    completed = found.outcome == Outcome.COMPLETED and events.size > 0
    for number in range(one_sided.size if completed else 0):
        wanted = [one for one in (side, -side) if one_sided[number] in (0.0, one)]
        beside = [one for one in (_beside(task, number, at) for at in wanted) if one is not None]
        if all(one.sequences[0].order() == here.order() for one in beside):
            continue
        limits = [_limit(task, number, one, events) for one in beside]
        alone[number] = len(limits) == 1
        if alone[number] or not _agree(*limits):
            one_sided[number] = beside[0].side
        own = {name: one[..., number] for name, one in columns.items()}
        ordered[number] = not all(_agree(own, one) for one in limits)
        if not _agree(own, limits[0]):
            for name, column in own.items():
                column[...] = limits[0][name]
        shifts[:, number] = limits[0]["shifts"]
        times = np.array([beside[0].times(one)[0] for one in events])
        changes[:, number] = together @ ~beside[0].coincide(times)
    sides = OneSided(one_sided, ordered, events["time"], changes > 0.0, shifts, "")
    note = _note([one.name for one in task.parameters], found, sides, alone)
    return found._replace(**columns), sides._replace(note=note)


def _beside(task: TangentTask, number: int, side: float) -> _Beside | None:
    """Return the runs on one side of a parameter; None if it cannot have these values."""
    one = task.parameters[number]
    distance = _BESIDE * (abs(one.value) if abs(one.value) > SMALLEST else 1.0)
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


def _limit(
    task: TangentTask, number: int, beside: _Beside, events: Records
) -> dict[str, FloatArray]:
    """Return derivatives on one side of a parameter: of the motion, and of the times of events.

    At the instant of an event, the derivatives of the motion are those just after it.
    """
    times = np.array([beside.times(one) for one in events]).T
    apart = times - events["time"]
    at_event = np.abs(task.times[:, None] - events["time"]) <= _tolerance(events["time"])
    later = np.where(at_event.any(axis=1), np.nan_to_num(np.abs(apart)).max() + _TIE, 0.0)
    one, found = task.parameters[number], []
    for count, at in zip((1.0, 2.0), times, strict=True):
        change = beside.side * count * beside.distance
        machine, initial = _moved(task, number, change)
        near = task._replace(
            machine=machine, initial=initial,
            start=None if task.start is None else task.start[:, [number]],
            parameters=(one._replace(value=one.value + change),),
            machine_at=(task.machine_at[number],),
            times=np.minimum(task.times + count * later, task.span[1]),
        )  # fmt: skip
        answer = interruptible(lambda near=near: differentiate(near))  # type: ignore[misc]
        motion = {name: getattr(answer, name)[..., 0] for name in _MOTION}
        # Events that are not in the answer are caused by a jump and remain at its time.
        place, known = matching(answer.events, at)
        causes = (at - events["time"]) / change
        shifts = np.where(known, answer.shifts[place, 0], causes) if known.any() else causes
        found.append(motion | {"shifts": shifts})
    return {name: 2.0 * near - found[1][name] for name, near in found[0].items()}


def _agree(one: dict[str, FloatArray], other: dict[str, FloatArray]) -> bool:
    """Return True if both have the same derivatives."""
    return all(
        np.allclose(
            mine, other[name], _AGREE,
            _AGREE * np.abs(mine[np.isfinite(mine)]).max(initial=0.0), equal_nan=True,
        )
        for name, mine in one.items()
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


def _note(
    parameters: list[str], answer: TangentAnswer, sides: OneSided, alone: NDArray[np.bool_]
) -> str:
    """Return what the message of a result says about one-sided derivatives and coincident events.

    alone : (q,) whether only values on one side are possible
    """
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
        for side, word, other in ((1, "larger", "smaller"), (-1, "smaller", "larger")):
            own = (sides.one_sided == side) & (start == 0.0)
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
