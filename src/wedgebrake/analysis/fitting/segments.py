"""The columns of a trace in segments, each simulated from its own initial state."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from wedgebrake.analysis.fitting.guess import Guess, Measured
from wedgebrake.analysis.fitting.model import Model, Simulated
from wedgebrake.arrays import FloatArray
from wedgebrake.errors import InputError
from wedgebrake.model.joints import free_motions, reduction
from wedgebrake.model.validation import wrong
from wedgebrake.solvers.simulate import simulate

if TYPE_CHECKING:
    import xarray as xr

    from wedgebrake.model.machine import Machine
    from wedgebrake.solvers.machine.final_state import FinalState
    from wedgebrake.solvers.machine.tangents import TangentTask

# The free states at the start of the next segment, from their numbers, the angles (n,) at the start
# of the segment before, and the states (states,) at its end.
Start = Callable[[list[int], FloatArray, FloatArray], FloatArray]


class Segment(NamedTuple):
    """A simulated segment, and its derivatives with respect to p parameters and s start states.

    columns : (k,) of each observation;  changes : (k, p + s)
    states  : (k + 1, states) of the machine at the samples, and at the first one of the next
              segment
    ends    : (states, p + s) derivatives of the last of these states
    """

    columns: list[FloatArray]
    changes: list[FloatArray]
    states: FloatArray
    ends: FloatArray


class StateSpace(NamedTuple):
    """The states of a machine in terms of those that are free at the start of a segment.

    The others follow from these and from the driven bodies: states = back free + carried states.

    free    : (s,) numbers of the free states
    back    : (states, s)
    carried : (states, states)
    """

    free: list[int]
    back: FloatArray
    carried: FloatArray

    def states(self, start: FloatArray, end: FloatArray) -> FloatArray:
        """All states at the start of a segment, after the end of the segment before."""
        return np.asarray(self.back @ start + self.carried @ end)

    @classmethod
    def of(cls, machine: Machine, states: int) -> StateSpace:
        """The state space of a machine: angles, speeds, states of lags and of controllers."""
        n, moving = len(machine.inertias), len(machine.inertias) - len(machine.driven)
        bodies = list(reduction(machine).free if machine.joints else range(moving))
        follow, every = np.zeros((n, n)), np.eye(states)
        follow[:, bodies] = free_motions(machine)
        follow[:, moving:] = reduction(machine).follow[:, moving:]
        for first in (0, n):
            every[first : first + n, first : first + n] = follow
        free = [*bodies, *(n + one for one in bodies), *range(2 * n, states)]
        carried = every.copy()
        carried[:, free] = 0.0
        return cls(free, every[:, free], carried)


def check_states(machine: Machine) -> None:
    """Refuse, with ``InputError``, parts with a memory besides the states of the machine."""
    sampled = {one.name: one.actuation.sample_time for one in machine.contacts}
    sampled |= {one.name: one.sample_time for one in machine.controllers}
    for name, step in sampled.items():
        if step is not None:
            raise wrong(
                f"{name}.sample_time", step, "None for a fit in segments",
                "The sampled values at the start of a segment are not known. Use one segment.",
            )  # fmt: skip
    for shaft in machine.shafts:
        if shaft.gap is not None and shaft.damping > 0.0:
            raise wrong(
                f"{shaft.name}.damping", shaft.damping, "0 for a fit in segments",
                "At the start of a segment, angle and speed do not determine whether a shaft with"
                " gap and damping is in contact. Use one segment.",
            )  # fmt: skip


@dataclass(frozen=True)
class SegmentedModel(Model):
    """What a system predicts for the columns of a trace, in segments.

    firsts : number of the first sample of each segment
    """

    firsts: tuple[int, ...] = (0,)

    def _times(self, number: int, values: Mapping[str, float]) -> FloatArray:
        """Times of the samples of a segment, and of the first one of the next segment [s]."""
        last = [*self.firsts[1:], self.trace.time.size - 1][number]
        shift = self._setting("time_shift", values)
        return self.trace.time[self.firsts[number] : last + 1] + shift

    def guess(self, values: Mapping[str, float]) -> Guess:
        """The states at the starts of the segments from which a fit begins.

        Raises ``InputError`` if a segment does not reach its end.
        """
        guess = self._empty_guess(values)
        self._chain(values, guess.append)
        return guess

    def _empty_guess(self, values: Mapping[str, float]) -> Guess:
        machine, time = self.system.machine, self.trace.time
        n, measured = len(machine.inertias), {}
        for one in self.observations:
            if one.variable in ("angle", "velocity"):
                column = self.trace.columns[one.column]
                column = column - self._setting(f"{one.column}.offset", values)
                column = column / self._setting(f"{one.column}.scale", values)
                row = machine.index(one.part) + (n if one.variable == "velocity" else 0)
                measured[row] = Measured.of(time, column)
        return Guess(measured, n, self.firsts)

    def simulated(self, values: Mapping[str, float], starts: FloatArray | None) -> Simulated:
        """Simulate all segments; nan where the system cannot have the values, or stops.

        starts : (segments - 1, s); None: those of ``guess``
        """
        start = self._empty_guess(values).append if starts is None else _given(starts)
        try:
            responses = self._chain(values, start)
        except InputError:
            nothing = np.full(self.trace.time.size, np.nan)
            return Simulated(values, [], [nothing for _ in self.observations])
        parts = [
            self._own_samples(number, self._columns(values, one))
            for number, one in enumerate(responses)
        ]
        columns = [np.concatenate(one) for one in zip(*parts, strict=True)]
        return Simulated(values, responses, columns)

    def _own_samples(self, number: int, parts: list[FloatArray]) -> list[FloatArray]:
        """Parts of a segment without the first sample of the next segment."""
        return parts if number == len(self.firsts) - 1 else [one[:-1] for one in parts]

    def _chain(self, values: Mapping[str, float], start: Start) -> list[xr.Dataset]:
        """The responses of the segments.

        Raises ``InputError`` if a segment does not reach its end.
        """
        from wedgebrake.solvers.machine.final_state import final_state

        system = self.system_at(values)
        found: list[xr.Dataset] = []
        run = self._run(values, 1)
        for number in range(len(self.firsts)):
            times = self._times(number, values)
            if found:
                end, angles = _states_in(final_state(found[-1])), found[-1]["angle"].to_numpy()[0]
                space = StateSpace.of(system.machine, end.size)
                states = space.states(start(space.free, np.atleast_1d(angles), end), end)
                run = {"initial": _state_at(float(times[0]), states, system.machine)}
            more = {**run, "times": times, "method": self.method}
            found.append(simulate(system, float(np.ptp(times)), **more))
            self._tell()
            if found[-1].sizes["time"] != times.size:
                raise InputError(str(found[-1].attrs["message"]))
        return found

    def linearised_segments(self, values: Mapping[str, float], starts: FloatArray) -> list[Segment]:
        """Simulate all segments, with derivatives.

        starts : (segments - 1, s)

        Raises ``InputError`` as ``linearised``; returns no segments if one does not reach its end.
        """
        from wedgebrake.analysis.derivatives.varied_response import varied_response
        from wedgebrake.solvers.machine.tangents import Neighbourhood, Parameter

        names, s = list(values), starts.shape[1]
        own = [place for place, name in enumerate(names) if name not in self.settings]
        columns = [*own, *range(len(names), len(names) + s)]
        task = self._task(values, [names[place] for place in own], self._times(0, values)[0])
        machine = task.machine
        machine.check_times(task.span[0], self._times(len(self.firsts) - 1, values)[-1])
        task = task._replace(
            parameters=(*task.parameters, *[Parameter("state", 0.0)] * s),
            machine_at=(*task.machine_at, *[lambda _: machine] * s),
        )
        near, found = Neighbourhood(task), list[Segment]()
        for number in range(len(self.firsts)):
            times = self._times(number, values)
            run = task._replace(span=(float(times[0]), float(times[-1])), times=times)
            if found:
                before = found[-1].states[-1], found[-1].ends[:, columns]
                run = _continued(run, starts[number - 1], *before)
            varied = varied_response(run, near.starting_at(run.span[0]))
            self._tell()
            if not varied.complete:
                return []
            each = [self._observed_in(varied, one, values) for one in self.observations]
            seen, changes = (self._own_samples(number, [*one]) for one in zip(*each, strict=True))
            states = varied.found.samples.states
            ends = np.zeros((states.shape[1], len(names) + s))
            ends[:, columns] = varied.found.states[-1]
            found.append(Segment(seen, changes, states, ends))
        if "time_shift" in names:
            self._vary_times(found, values, starts)
        return found

    def _vary_times(
        self, found: list[Segment], values: Mapping[str, float], starts: FloatArray
    ) -> None:
        """Set the derivatives with respect to ``time_shift``, by central differences."""
        from wedgebrake.solvers.machine.final_state import final_state

        step, place = self.time_step, list(values).index("time_shift")
        late, early = (
            self._chain({**values, "time_shift": values["time_shift"] + change}, _given(starts))
            for change in (step, -step)
        )
        for number, (one, *pair) in enumerate(zip(found, late, early, strict=True)):
            after, before = (self._own_samples(number, self._columns(values, of)) for of in pair)
            for rows, last, first in zip(one.changes, after, before, strict=True):
                rows[:, place] = (last - first) / (2.0 * step)
            last, first = (_states_in(final_state(of)) for of in pair)
            one.ends[:, place] = (last - first) / (2.0 * step)


def _given(starts: FloatArray) -> Start:
    """Given states at the starts of the segments but the first, one after another."""
    each = iter(starts)
    return lambda *_: np.asarray(next(each))


def _continued(
    run: TangentTask, start: FloatArray, end: FloatArray, ends: FloatArray
) -> TangentTask:
    """The run of a segment that follows the previous segment.

    run   : its last parameters are the free states at the start
    start : (s,) these states
    end   : (states,) at the end of the segment before;  ends : (states, p + s) their derivatives
    """
    from wedgebrake.solvers.machine.tangents import difference_of

    def states(machine: Machine) -> FloatArray:
        return StateSpace.of(machine, end.size).states(start, end)

    space, p = StateSpace.of(run.machine, end.size), len(run.parameters) - start.size
    by = space.carried @ ends
    by[:, p:] = space.back
    if run.machine.joints:  # whose ratios may be parameters
        for column, (one, at) in enumerate(zip(run.parameters[:p], run.machine_at, strict=False)):
            by[:, column] += difference_of(one, lambda value, at=at: states(at(value)))  # type: ignore[misc]
    initial = _state_at(run.span[0], states(run.machine), run.machine)
    return run._replace(initial=initial, start=by)


def _state_at(time: float, states: FloatArray, machine: Machine) -> FinalState:
    """The state of a machine at the start of a run at a time [s], from its states."""
    from wedgebrake.solvers.machine.final_state import FinalState

    names, given = machine.inertia_names, states.tolist()
    n = len(names)
    angles, speeds = (dict(zip(names, one, strict=True)) for one in (given[:n], given[n : 2 * n]))
    return FinalState(time, angles, speeds, tuple(given[2 * n :]))


def _states_in(state: FinalState) -> FloatArray:
    """The states of a machine as one array."""
    return np.array([*state.angles.values(), *state.speeds.values(), *state.actuators])
