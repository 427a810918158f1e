"""Derivatives of a run of a machine with respect to parameters of its system.

Between events a machine is linear in its state and inputs. The factors, its *numbers*, are smooth
functions of the parameters, which are differentiated by central differences of sixth order, to
about 1e-12: nothing is known here about parts and their formulas. What depends on the motion, the
series of each cell and the jumps at events, is differentiated exactly in ``variation``.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np

from wedgebrake.arrays import FloatArray
from wedgebrake.dynamics.enums import Outcome
from wedgebrake.model.machine import Machine
from wedgebrake.model.signals.signals import Signal
from wedgebrake.model.validation import wrong
from wedgebrake.solvers.machine.assemble import assemble
from wedgebrake.solvers.machine.events.modes import select_system
from wedgebrake.solvers.machine.final_state import start_state
from wedgebrake.solvers.machine.problem import EVENT, MachineProblem, Run, run_of, tangents_of
from wedgebrake.solvers.machine.trajectory import trajectory
from wedgebrake.solvers.machine.trajectory.observers import observer_of
from wedgebrake.solvers.machine.trajectory.watch import Anew, watch_of

# Places of the central difference in steps, and its weights.
_PLACES = (-3, -2, -1, 1, 2, 3)
_WEIGHTS = np.array([-1.0, 9.0, -45.0, 45.0, -9.0, 1.0]) / 60.0
# The same of fourth order, whose difference is the larger error.
_FOURTH = np.array([0.0, 1.0, -8.0, 8.0, -1.0, 0.0]) / 12.0
# Relative step, and how often it is divided by 4 where the orders differ by more than this share.
_STEP, _DIVISIONS, _AGREE = 2.0**-9, 8, 1e-8


class Parameter(NamedTuple):
    """A parameter of which derivatives are wanted.

    name  : for errors
    value : its present value
    scale : magnitude of typical values, for that of the step where the value is zero
    """

    name: str
    value: float
    scale: float


class _Near(NamedTuple):
    """Machines with neighbouring values of a parameter."""

    step: float
    problems: tuple[MachineProblem, ...]
    runs: tuple[Run, ...]


class TangentTask(NamedTuple):
    """A run whose derivatives are wanted.

    machine_at : for each parameter, the machine as a function of its value
    start, end : [s]
    times      : (k,) of the samples [s], ascending
    """

    machine: Machine
    parameters: tuple[Parameter, ...]
    machine_at: tuple[Callable[[float], Machine], ...]
    start: float
    end: float
    times: FloatArray


class TangentAnswer(NamedTuple):
    """Derivatives with respect to p parameters.

    states : (k, states, p) of the state at the samples
    final  : (states, p) of the final state
    events : (e,) times of the events that guards detect [s];  shifts : (e, p) their derivatives
    """

    states: FloatArray
    final: FloatArray
    events: FloatArray
    shifts: FloatArray
    outcome: Outcome


# Events for which memory is allocated at a time.
_EVENTS = 1024
_MOST = 10**18


def differentiate(task: TangentTask) -> TangentAnswer:
    """Run a machine and differentiate the run with respect to parameters.

    Raises ``InputError`` for a parameter without derivative.
    """
    return _TangentRun(task).answer()


class _TangentRun:
    """A run with its derivatives."""

    def __init__(self, task: TangentTask) -> None:
        self.task, machine = task, task.machine
        self._moving = [
            _moving_signals(machine, at, one)
            for one, at in zip(task.parameters, task.machine_at, strict=True)
        ]
        further = tuple(one for moving in self._moving for pair in moving for one in pair[1:])
        self._assemble = lambda one: assemble(one, task.start, further=further)
        self.assembled = self._assemble(machine)
        problem, p = self.assembled.problem, len(task.parameters)
        self._near = [
            self._neighbours(one, at)
            for one, at in zip(task.parameters, task.machine_at, strict=True)
        ]
        self.run = run_of(problem)._replace(
            tangents=tangents_of(problem, p, times=task.times, events=_EVENTS)
        )
        start_state(machine, problem, self.run)
        self._set_constants()
        self._watch = watch_of(problem, np.empty((0, problem.states)), p)._replace(derivative=True)
        self._watch.state["anew"] = Anew.AT_START

    def answer(self) -> TangentAnswer:
        """Run to the end."""
        task, problem, run = self.task, self.assembled.problem, self.run
        observer = observer_of(problem, np.empty(0))._replace(watch=self._watch)
        log, tangents, stop = np.zeros(_EVENTS, EVENT), run.tangents, np.zeros(1, np.bool_)
        events, shifts, outcome, begins = [], [], Outcome.PAUSED, True
        while outcome in (Outcome.PAUSED, Outcome.LOG_FULL):
            span = trajectory.Span(task.end, _MOST, _MOST, False, begins, False, stop)
            outcome = Outcome(trajectory.move(problem, run, span, log, observer).outcome)
            begins = False
            count = int(tangents.count[0])
            events.append(tangents.events[:count].copy())
            shifts.append(tangents.shifts[:count].copy())
            tangents.count[0] = 0
            if outcome == Outcome.PAUSED:
                self._fill()
        final = self._watch.variation[: problem.states, -len(task.parameters) :].copy()
        tangents.states[tangents.at[0] :] = final
        return TangentAnswer(
            tangents.states, final, np.concatenate(events), np.concatenate(shifts), outcome
        )

    def _neighbours(self, parameter: Parameter, machine_at: Callable[[float], Machine]) -> _Near:
        """The machines with neighbouring values, at a step that resolves their numbers."""
        base = self.assembled.problem
        step = _STEP * (abs(parameter.value) or parameter.scale)
        for _ in range(_DIVISIONS):
            problems = tuple(
                self._assemble(
                    _with_signals_of(self.task.machine, machine_at(parameter.value + place * step))
                ).problem
                for place in _PLACES
            )
            if any(_structure(one) != _structure(base) for one in problems):
                raise wrong(
                    parameter.name, parameter.value, "a value beside which the machine is the same",
                    "Beside it, friction has other pieces, or the actuator other states.",
                )  # fmt: skip
            numbers = np.array([_numbers(one) for one in problems])
            if _agree(numbers):
                break
            step /= 4.0
        return _Near(step, problems, tuple(map(run_of, problems)))

    def _set_constants(self) -> None:
        """Set the derivatives that do not depend on modes."""
        tangents, problem = self.run.tangents, self.assembled.problem
        for number, near in enumerate(self._near):
            states = []
            for one, run, place in zip(near.problems, near.runs, _PLACES, strict=True):
                machine = self.task.machine_at[number](
                    self.task.parameters[number].value + place * near.step
                )
                start_state(machine, one, run)
                states.append(run.z[: problem.states, 0].copy())
            tangents.start[:, number] = _difference(states, near.step)
            tangents.sliding[:, number] = _difference(
                [one.sliding for one in near.problems], near.step
            )
            contacts = [one.contacts for one in near.problems]
            for name, target in (
                ("slope", tangents.slope),
                ("initial_force", tangents.command[..., -1]),
            ):
                target[:, number] = _difference([one[name] for one in contacts], near.step)
            for contact, one in enumerate(problem.contacts):
                if one["base_input"] >= 0:
                    self._follow_signals(
                        number, tangents.sliding[contact, number], problem.sliding[contact]
                    )
                if one["force"] >= 0:
                    row = np.zeros(problem.torque.shape[1])
                    row[problem.states + one["force"]] = 1.0
                    self._follow_signals(number, tangents.command[contact, number], row)

    def _follow_signals(self, number: int, target: FloatArray, rows: FloatArray) -> None:
        """Add the derivatives of rows due to signals that change with a parameter."""
        states, signals = self.assembled.problem.states, self.assembled.signals
        inputs = {signal: states + i for i, signal in enumerate(signals)}
        for signal, change, rate in self._moving[number]:
            target[..., inputs[change]] += rows[..., inputs[signal]]
            for one in self.assembled.problem.contacts:
                if one["base_input"] >= 0 and signals[one["base_input"]] == signal:
                    target[..., inputs[rate]] += rows[..., states + one["base_rate"]]

    def _fill(self) -> None:
        """Store the derivatives of the rows of the present modes."""
        problem, run = self.assembled.problem, self.run
        slot, tangents, systems = select_system(problem, run), run.tangents, run.systems
        systems.used[0] = min(int(systems.used[0]), slot + 1)
        count = systems.counts[slot]
        for number, near in enumerate(self._near):
            found = []
            for one, other in zip(near.problems, near.runs, strict=True):
                other.modes[:], other.z[:] = run.modes, run.z
                at = select_system(one, other)
                found.append((other.systems.rates[at], other.systems.guards[at, :count]))
            rates, guards = zip(*found, strict=True)
            tangents.rates[slot, number] = _difference(rates, near.step)
            tangents.guards[slot, number, :count] = _difference(guards, near.step)
            self._follow_signals(number, tangents.rates[slot, number], systems.rates[slot])
            self._follow_signals(number, tangents.guards[slot, number], systems.guards[slot])
        tangents.keys[slot] = systems.keys[slot]


def _difference(values: Any, step: float) -> FloatArray:
    """Derivative of values at the places of the central difference."""
    return np.asarray(np.tensordot(_WEIGHTS, np.asarray(values), 1) / step)


def _agree(numbers: FloatArray) -> bool:
    """Return True if differences of two orders agree."""
    sixth, fourth = _WEIGHTS @ numbers, _FOURTH @ numbers
    return bool(
        np.all(
            np.abs(sixth - fourth) <= _AGREE * np.abs(sixth) + 1e-13 * np.abs(numbers).max(axis=0)
        )
    )


def _numbers(problem: MachineProblem) -> FloatArray:
    """All numbers of a machine that may depend on a parameter."""
    records = [problem.shafts, problem.contacts, problem.lines]
    fields = [
        one[name].ravel()
        for one in records
        for name in one.dtype.names or ()
        if one[name].dtype == np.float64
    ]
    found = np.concatenate(
        [problem.inverse, problem.torque.ravel(), problem.sliding.ravel(), *fields]
    )
    return np.where(np.isfinite(found), found, 0.0)


def _structure(problem: MachineProblem) -> tuple[Any, ...]:
    """What must not change with a parameter."""
    records = [problem.shafts, problem.contacts, problem.lines]
    whole = [
        one[name].tobytes()
        for one in records
        for name in one.dtype.names or ()
        if one[name].dtype != np.float64
    ]
    return (problem.torque.shape, *whole)


def _signals(machine: Machine) -> dict[str, Signal]:
    return {name: one for name, one in machine.signals().items() if one.varies}


def _moving_signals(
    machine: Machine, machine_at: Callable[[float], Machine], parameter: Parameter
) -> list[tuple[Signal, Signal, Signal]]:
    """The signals that change with a parameter, their derivatives, and the rates of these."""
    from wedgebrake.model.signals.signal_tangents import rate_of, tangent_of

    step = _STEP * (abs(parameter.value) or parameter.scale)
    near = [_signals(machine_at(parameter.value + place * step)) for place in _PLACES]
    found = []
    for name, signal in _signals(machine).items():
        others = [one[name] for one in near]
        if any(one != signal for one in others):
            change = tangent_of(others, lambda v: float(_WEIGHTS @ np.asarray(v)) / step, signal)
            found.append((signal, change, rate_of(change)))
    return found


def _with_signals_of(base: Machine, machine: Machine) -> Machine:
    """The machine with the signals of another one that vary."""
    changes: Mapping[str, Signal] = {
        name: one for name, one in _signals(base).items() if _signals(machine).get(name) != one
    }
    return machine.replace(changes) if changes else machine
