"""Derivatives of a run of a machine with respect to parameters of its system.

Between events a machine is linear in its state and inputs. The factors, its *numbers*, are smooth
functions of the parameters, which are differentiated by central differences of sixth order, to
about 1e-12: nothing is known here about parts and their formulas. What depends on the motion, the
series of each cell and the jumps at events, is differentiated exactly in ``variation``.
"""

from __future__ import annotations

import copy
import dataclasses
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cache
from typing import Any, NamedTuple, cast

import numpy as np
from numpy.polynomial import polynomial
from numpy.typing import NDArray

from wedgebrake.arrays import FloatArray
from wedgebrake.dynamics.enums import Outcome
from wedgebrake.errors import InputError
from wedgebrake.model.machine import Machine
from wedgebrake.model.part import SMALLEST
from wedgebrake.model.signals.signal_tangents import rate_of, tangent_of
from wedgebrake.model.signals.signals import Signal
from wedgebrake.model.validation import wrong
from wedgebrake.solvers.machine.assemble import Assembled, Programs, assemble
from wedgebrake.solvers.machine.events.modes import NO_KEY, select_system
from wedgebrake.solvers.machine.final_state import FinalState, restore, start_state
from wedgebrake.solvers.machine.problem import (
    CONTROLLER,
    EVENT,
    MOST_DEGREE,
    MachineProblem,
    Run,
    run_of,
    tangents_of,
)
from wedgebrake.solvers.machine.trajectory import trajectory
from wedgebrake.solvers.machine.trajectory.observers import Observer, observer_of
from wedgebrake.solvers.machine.trajectory.watch import Anew, watch_of

_NODES = -np.cos(np.pi * np.arange(MOST_DEGREE + 1) / MOST_DEGREE)
# How often the step is divided by 4 where the orders differ by more than this share.
_DIVISIONS, _AGREE = 8, 1e-9
# Factor by which the step is lengthened where changes of numbers are lost in rounding.
_LONGER = 16.0
# Step below which changes of sums of numbers may be lost in rounding, too.
_SHORT = 2.0**-29
# Share of the step within which the structure changes at the value itself.
_BESIDE = 2.0**-30
# The same for knots of signals, of which none must enter or leave the run, in these steps.
_KNOT_STEP = 2.0**-6


class Differences(NamedTuple):
    """How numbers of a machine are differentiated.

    places : values in steps from the value of the parameter: on both sides of it, above, below
    step   : step relative to the value
    tried  : whether the step is shortened until differences of two orders agree
    """

    places: tuple[tuple[int, ...], ...]
    step: float
    tried: bool


# The errors are about 1e-12, and 1e-10 with a third of the machines; 1e-9 where numbers are
# strongly nonlinear, such as the torque of a wedge over its angle.
FINE = Differences(
    ((-3, -2, -1, 1, 2, 3), (0, 1, 2, 3, 4, 5, 6), (0, -1, -2, -3, -4, -5, -6)), 2.0**-9, True
)
QUICK = Differences(((-1, 1), (0, 1, 2), (0, -1, -2)), 2.0**-19, False)


class Parameter(NamedTuple):
    """A parameter of which derivatives are wanted.

    name, value : of the parameter; the name is for errors
    divisions   : how often the step of differences is divided by 4
    """

    name: str
    value: float
    divisions: int = 0
    differences: Differences = FINE

    @property
    def step(self) -> float:
        """Step of differences of the numbers of a machine."""
        size = abs(self.value) if abs(self.value) > SMALLEST else 1.0
        return self.differences.step * size / 4.0**self.divisions

    def allowed(self, machine_at: Callable[[float], Machine]) -> Parameter:
        """The parameter with a step beside which there are machines.

        Raises ``InputError`` if there are none beside its value.
        """
        for divisions in range(self.divisions, _DIVISIONS):
            found = self._replace(divisions=divisions)
            try:
                _machines(found, found.step, machine_at)
            except InputError as error:
                last = error
            else:
                return found
        raise last


class _Stencil(NamedTuple):
    """Values of a parameter near its own, and the weights of the derivative there."""

    values: tuple[float, ...]
    weights: FloatArray

    @classmethod
    def of(cls, value: float, step: float, places: tuple[int, ...]) -> _Stencil:
        """Values at some places, in steps."""
        values = tuple(value + place * step for place in places)
        return cls(values, _weights(places) / step)

    def difference(self, found: Any) -> FloatArray:
        """Derivative of something, from what it is at the values; 0 of what does not change."""
        values = np.asarray(found)
        # Limits that do not exist are infinite at all values.
        still = values == values[0]
        changes = np.subtract(values, values[0], out=np.zeros(values.shape), where=~still)
        changes = changes.reshape(len(values), -1)
        return np.asarray((self.weights @ changes).reshape(values.shape[1:]))

    def of_number(self, found: Sequence[float]) -> float:
        """Derivative of a number."""
        return float(self.difference(found))


@cache
def _weights(places: tuple[int, ...]) -> FloatArray:
    """Weights of the derivative at 0 of values at some places."""
    powers = np.vander(np.array(places, float), increasing=True).T
    return np.asarray(np.linalg.solve(powers, np.eye(len(places))[1]))


class _Near(NamedTuple):
    """Machines with neighbouring values of a parameter.

    problems : with the signals and the pieces of friction curves of the machine itself
    fitted   : with their own pieces
    """

    stencil: _Stencil
    machines: tuple[Machine, ...]
    problems: tuple[MachineProblem, ...]
    fitted: tuple[MachineProblem, ...]

    @property
    def varies(self) -> bool:
        """Whether the numbers may depend on the parameter, and not its signals alone."""
        return any(one is not self.problems[0] for one in self.problems)

    def difference(self, of: Callable[[MachineProblem], Any]) -> FloatArray:
        """Derivative of numbers of the machine."""
        if not self.varies:
            return np.zeros(np.shape(of(self.problems[0])))
        return self.stencil.difference([of(one) for one in self.problems])

    def starts(self, run: Run) -> list[FloatArray]:
        """The states at the start, which are computed in a run."""
        found = []
        for machine, problem in zip(self.machines, self.problems, strict=True):
            start_state(machine, problem, run)
            found.append(run.z[: problem.states, 0].copy())
        return found


class TangentTask(NamedTuple):
    """A run whose derivatives are wanted.

    machine_at : for each parameter, the machine as a function of its value
    span       : start and end [s]
    times      : (k,) of the samples [s], ascending
    method     : "exact" or "smooth"
    initial    : initial state; None for that of the machine
    start      : (states, p) derivatives of the initial state; None for those of the machine, 0 of
                 a given state
    """

    machine: Machine
    parameters: tuple[Parameter, ...]
    machine_at: tuple[Callable[[float], Machine], ...]
    span: tuple[float, float]
    times: FloatArray
    method: str = "exact"
    initial: FinalState | None = None
    start: FloatArray | None = None


class TangentAnswer(NamedTuple):
    """Derivatives with respect to p parameters.

    states : (k, states, p) of the state at the samples;  torques, forces : (k, m, p) of the torques
             on the first inertias of the contacts and of the actuation forces;  outputs : (k, c, p)
             of those of controllers
    final  : (states, p) of the final state;  flow : (states, states) its derivative with respect to
             the initial state, in which contacts at rest remain at rest
    events : (e,) times of the events that guards detect [s];  shifts : (e, p) their derivatives
    one_sided : (p,) direction in which a parameter changes for these derivatives, 1 or -1, if at
             the start a contact slips from the sliding speed 0, so that the other has another
             order of events, or if the structure changes at the value; 0: both
    held : (p,) whether a parameter changes the sliding speed of a contact at rest at the start
    tied : (p,) as ``one_sided``, for parameters at whose value the structure of the machine changes
    parameters : with steps that resolve all numbers of the machine
    samples : what the run itself has recorded at the samples
    """

    states: FloatArray
    torques: FloatArray
    forces: FloatArray
    outputs: FloatArray
    final: FloatArray
    flow: FloatArray
    events: FloatArray
    shifts: FloatArray
    one_sided: FloatArray
    held: NDArray[np.bool_]
    tied: FloatArray
    parameters: tuple[Parameter, ...]
    samples: Observer
    outcome: Outcome


# Size of a sliding speed that is rounding, relative to its parts.
_ROUNDING = 1e-15
# Distance of two times that coincide, relative to 1 s and to the time.
_TOGETHER = 1e-11
# Share of a sample time within which a sample is at the start or end of a run.
_NEARLY = 1e-9
# Events for which memory is allocated at a time.
_EVENTS = 1024
_MOST = 10**18
_NO_TIMES: FloatArray = np.empty(0)


class Neighbourhood:
    """The numbers of the machine of a task, and of machines with neighbouring parameter values.

    Runs of the same machine from the same time with the same parameters share them.

    Raises ``InputError`` for a parameter without a derivative.

    moving     : for each parameter the signals that change, their derivatives, the rates of these
    assembled  : with these derivatives and rates as further inputs
    near       : for each parameter
    tied       : for each parameter, the side of its values if the structure changes at its value
    parameters : with steps that resolve all numbers of the machine
    """

    def __init__(self, task: TangentTask) -> None:
        self.task, self.parameters, self.tied = task, list[Parameter](), list[float]()
        each = zip(task.parameters, task.machine_at, strict=True)
        self.moving = [_moving_signals(task.machine, at, one) for one, at in each]
        self._further = [one for rows in self.moving for row in rows for one in row[1:]]
        self.assembled = self._assemble(task.machine)
        self.near = [self._neighbours(number) for number in range(len(task.parameters))]

    def starting_at(self, time: float) -> Neighbourhood:
        """The same for runs from given states at another time [s]."""
        found, of = copy.copy(self), self.assembled
        problem = of.problem._replace(start_time=time, signals=of.programs.numbers_of(time))
        found.assembled = dataclasses.replace(of, problem=problem)
        return found

    def _assemble(self, machine: Machine, programs: Programs | None = None) -> Assembled:
        """The numbers of a machine, with the derivatives of signals as further inputs."""
        curved, further = self.task.method == "smooth", self._further
        return assemble(
            machine, self.task.span[0], curved=curved, further=further, programs=programs
        )

    def _neighbours(self, number: int) -> _Near:
        """The machines with neighbouring values of a parameter.

        They have a step that resolves their numbers.
        """
        parameter = self.task.parameters[number]
        for divisions in range(parameter.divisions, _DIVISIONS):
            parameter = parameter._replace(divisions=divisions)
            found = self._alike(number, parameter)
            if found is None:
                continue
            numbers = self._numbers_of(found, parameter)
            if numbers is None:
                break
            if _agree(numbers, found.stencil, parameter):
                if _lost_in_rounding(numbers, found.stencil, parameter):
                    parameter, found = self._lengthened(number, parameter, found)
                break
        else:
            if found is not None:
                parameter, found = self._lengthened(number, parameter, found)
        if found is None:
            raise wrong(
                parameter.name, parameter.value,
                "a value near which the structure of the machine does not change",
                "At neighbouring values, friction has other pieces, or actuators or controllers"
                " have other states. Use another value.",
            )  # fmt: skip
        self.parameters.append(parameter)
        self.tied.append(self._tied(number, parameter, found.stencil))
        return found

    def _numbers_of(self, near: _Near, parameter: Parameter) -> FloatArray | None:
        """The numbers of neighbouring machines, (machines, numbers); None if none are compared."""
        if not (near.varies and parameter.differences.tried):
            return None
        numbers = np.array([_numbers(one) for one in near.problems])
        if self.task.initial is None and self.task.start is None:
            # The error at which a filter starts has kinks at the ends of the stages and gaps of
            # the shafts that its controller measures.
            numbers = np.hstack([numbers, near.starts(run_of(self.assembled.problem))])
        return numbers

    def _lengthened(self, number: int, shorter: Parameter, near: _Near) -> tuple[Parameter, _Near]:
        """The parameter and its neighbours with a longer step, so that rounding hides no changes.

        Changes of a tiny value are lost in the rounding of other numbers of its part. The step is
        at most that at the value 0. If no longer step is suitable, the shorter one is kept.
        """
        found, parameter = (shorter, near), self.task.parameters[number]
        while _LONGER * parameter.step <= FINE.step:
            parameter = parameter._replace(divisions=parameter.divisions - 2)
            try:
                beside = self._alike(number, parameter)
            except InputError:
                break
            # At 0, a machine may lack guards, such as those of a force that a slope changes.
            if beside is None or 0.0 in beside.stencil.values:
                continue
            numbers = self._numbers_of(beside, parameter)
            if numbers is None:
                continue
            if _agree(numbers, beside.stencil, parameter):
                found = parameter, beside
                if not _lost_in_rounding(numbers, beside.stencil, parameter):
                    break
        return found

    def _alike(self, number: int, parameter: Parameter) -> _Near | None:
        """Neighbouring machines with the structure of the machine itself; None if there are none.

        They are on one side of the value where the structure changes on the other: a curve of
        friction that is approximated by lines, for example, has one more of them.
        """
        base = self.assembled.problem
        structure = _structure(base)
        machine_at = self.task.machine_at[number]
        for stencil, machines in _stencils(parameter, parameter.step, machine_at):
            alike = tuple(self._own_signals(number, one) for one in machines)
            if all(one == self.task.machine for one in alike):  # its signals alone depend on it
                problems = (base,) * len(alike)
                return _Near(stencil, machines, problems, problems)
            given = tuple(self._assemble(one, self.assembled.programs).problem for one in alike)
            problems = tuple(_with_curves_of(base, one) for one in given)
            if all(_structure(one) == structure for one in problems):
                return _Near(stencil, machines, problems, given)
        return None

    def _own_signals(self, number: int, machine: Machine) -> Machine:
        """A neighbouring machine, with the signals of the machine itself."""
        return _with_signals_of(self.task.machine, machine) if self.moving[number] else machine

    def _tied(self, number: int, parameter: Parameter, stencil: _Stencil) -> float:
        """The side on which a stencil lies if the structure changes at the value, otherwise 0."""
        way = float(np.sign(sum(stencil.values) / len(stencil.values) - parameter.value))
        if stencil.values[0] != parameter.value:  # about it
            return 0.0
        base, distance = self.assembled.problem, _BESIDE * parameter._replace(divisions=0).step
        try:
            machine = self.task.machine_at[number](parameter.value - way * distance)
        except InputError:  # the end of its range
            return 0.0
        alike = self._own_signals(number, machine)
        beside = _with_curves_of(base, self._assemble(alike, self.assembled.programs).problem)
        return 0.0 if _structure(beside) == _structure(base) else way


def differentiate(task: TangentTask, known: Neighbourhood | None = None) -> TangentAnswer:
    """Run a machine and differentiate the run with respect to parameters.

    known : that of another run of the machine; None: it is determined

    Raises ``InputError`` for a parameter without derivative.
    """
    return _TangentRun(task, known or Neighbourhood(task)).answer()


class _TangentRun:
    """A run with its derivatives."""

    def __init__(self, task: TangentTask, known: Neighbourhood) -> None:
        _check_order(task)
        self.task, self.known, machine = task, known, task.machine
        self.assembled = known.assembled
        problem, p = self.assembled.problem, len(task.parameters)
        self._rows = VariedRows(known, run_of(problem), task.times)
        self.run = self._rows.run
        self._restored, self._one_sided = False, np.array(known.tied, float)
        self._held = np.zeros(p, bool)
        if task.initial is None:
            start_state(machine, problem, self.run)
        else:
            self._restored = restore(task.initial, machine, problem, self.run)
        self._set_start()
        self._watch = watch_of(problem, np.empty((0, problem.states)), p)._replace(derivative=True)
        self._watch.state["anew"] = Anew.AT_START
        self._watch.samples[:] = self.run.modes["samples"]
        self._watch.control_samples[:] = self.run.samplings["samples"]

    def answer(self) -> TangentAnswer:
        """Run to the end."""
        task, problem, run = self.task, self.assembled.problem, self.run
        observer = observer_of(problem, task.times)._replace(watch=self._watch)
        log, tangents, stop = np.zeros(_EVENTS, EVENT), run.tangents, np.zeros(1, np.bool_)
        events, shifts, outcome, begins = [], [], Outcome.PAUSED, True
        if not run.modes.size:  # one system for the whole run, at which it does not pause
            self._rows.fill()
        while outcome in (Outcome.PAUSED, Outcome.LOG_FULL):
            span = trajectory.Span(task.span[1], _MOST, _MOST, False, begins, self._restored, stop)
            outcome = Outcome(trajectory.move(problem, run, span, log, observer).outcome)
            begins = False
            if outcome == Outcome.LOG_FULL:
                continue
            count = int(tangents.count[0])
            events.append(tangents.events[:count].copy())
            shifts.append(tangents.shifts[:count].copy())
            if outcome == Outcome.PAUSED:
                self._rows.fill()
                self._compare_start(task.span[0])
        final = self._watch.variation[: problem.states].copy()
        return TangentAnswer(
            tangents.states, tangents.torques, tangents.forces, tangents.outputs,
            final[:, -len(task.parameters) :], final[:, : problem.states], np.concatenate(events),
            np.concatenate(shifts), self._one_sided, self._held, np.array(self.known.tied, float),
            tuple(self.known.parameters),
            observer, outcome,
        )  # fmt: skip

    def _set_start(self) -> None:
        """Set the derivatives of the initial state."""
        given, target = self.task.start, self.run.tangents.start
        for number, near in enumerate(self.known.near):
            if given is not None:
                target[:, number] = given[:, number]
            elif self.task.initial is None:
                starts = near.starts(run_of(self.assembled.problem))
                target[:, number] = near.stencil.difference(starts)

    def _compare_start(self, start: float) -> None:
        """Record the parameters that change a sliding speed of 0 at the start."""
        problem, run, tangents = self.assembled.problem, self.run, self.run.tangents
        if run.clock[0] > start:
            return
        z, states = run.z[:, 0], problem.states
        for contact, mode in enumerate(run.modes):
            row = problem.sliding[contact]
            scale = np.abs(row) @ np.abs(z)
            if abs(row @ z) <= _ROUNDING * scale:
                by = row[:states] @ tangents.start + tangents.sliding[contact] @ z
                steps = [one.step for one in self.task.parameters]
                changes = np.abs(by) * steps > _AGREE * scale
                if mode["side"] != 0:
                    self._one_sided[changes] = mode["side"] * np.sign(by[changes])
                else:
                    self._held |= changes


class VariedRows:
    """The derivatives of the rows of a run: those that are constant, and those of its modes.

    Attributes
    ----------
    run : the run, with memory for the derivatives
    """

    def __init__(self, known: Neighbourhood, run: Run, times: FloatArray = _NO_TIMES) -> None:
        self._known, problem = known, known.assembled.problem
        tangents = tangents_of(problem, len(known.parameters), times=times, events=_EVENTS)
        self.run = run._replace(tangents=tangents)
        self._beside = run_of(problem)  # of neighbouring machines, one after another
        self._set_constants()

    def _set_constants(self) -> None:
        """Set the derivatives that do not depend on modes."""
        tangents, problem = self.run.tangents, self._known.assembled.problem
        for number, near in enumerate(self._known.near):
            tangents.sliding[:, number] = near.difference(lambda one: one.sliding)
            tangents.slope[:, number] = near.difference(lambda one: one.contacts["slope"])
            force = near.difference(lambda one: one.contacts["initial_force"])
            tangents.command[:, number, -1] = force
            for contact, one in enumerate(problem.contacts):
                if one["base_input"] >= 0:
                    changes = tangents.sliding[contact, number]
                    self._follow_signals(number, changes, problem.sliding[contact])
                if one["force"] >= 0:
                    row = np.zeros(problem.torque.shape[1])
                    row[problem.states + one["force"]] = 1.0
                    self._follow_signals(number, tangents.command[contact, number], row)
            tangents.samplings[:, number] = near.difference(_sample_times)
            speeds = near.difference(lambda one: one.driven["speed"])
            tangents.driven[:, number, -1] = speeds
            for body, one in enumerate(problem.driven):
                if one["input"] >= 0:
                    row = np.zeros(problem.torque.shape[1])
                    row[problem.states + one["input"]] = 1.0
                    self._follow_signals(number, tangents.driven[body, number], row)
            for name in CONTROLLER.names if problem.controllers.records.size else ():
                if CONTROLLER[name] == np.float64:
                    changes = [one.controllers.records[name] for one in near.problems]
                    tangents.loops[name][number] = near.stencil.difference(_finite(changes))
            self._set_lines(number, near)
            self._set_products(number, near)

    def _set_lines(self, number: int, near: _Near) -> None:
        """Set the derivatives of the polynomials of curved lines."""
        problem, lines = self._known.assembled.problem, self.run.tangents.lines
        for contact in np.flatnonzero(problem.contacts["curve"] >= 0).tolist():
            for side in (1, -1):
                pieces = _pieces(problem, contact, side)
                others = [_pieces(one, contact, side) for one in near.fitted]
                first = problem.contacts[contact]["first_line"]
                first += problem.contacts[contact]["lines_forward"] if side < 0 else 0
                lines[number, first : first + len(pieces)] = _line_changes(pieces, others, near)

    def _set_products(self, number: int, near: _Near) -> None:
        """Set the derivatives of the lines of elements with a scale, and of the scale."""
        tangents, problem = self.run.tangents, self._known.assembled.problem
        if not self.run.products.size:
            return
        tangents.factors[number] = near.difference(lambda one: one.elements.lines)
        for one in self.run.products:
            row = np.zeros(problem.torque.shape[1])
            row[problem.states + one["scale"]] = 1.0
            self._follow_signals(number, tangents.scales[number, one["element"]], row)

    def _follow_signals(self, number: int, target: FloatArray, rows: FloatArray) -> None:
        """Add the derivatives of rows due to signals that change with a parameter."""
        states, signals = self._known.assembled.problem.states, self._known.assembled.signals
        inputs = {signal: states + i for i, signal in enumerate(signals)}
        for signal, change, rate in self._known.moving[number]:
            target[..., inputs[change]] += rows[..., inputs[signal]]
            for one in self._known.assembled.problem.contacts:
                if one["base_input"] >= 0 and signals[one["base_input"]] == signal:
                    target[..., inputs[rate]] += rows[..., states + one["base_rate"]]
            for one in self._known.assembled.problem.driven:
                if one["input"] >= 0 and signals[one["input"]] == signal:
                    target[..., inputs[rate]] += rows[..., states + one["rate"]]
            for one in self._known.assembled.problem.controllers.records:
                if one["rate"] >= 0 and signals[one["input"]] == signal:
                    target[..., inputs[rate]] += rows[..., states + one["rate"]]

    def fill(self) -> None:
        """Store the derivatives of the rows of the present modes."""
        run, tangents, systems = self.run, self.run.tangents, self.run.systems
        tangents.count[0] = 0
        slot = select_system(self._known.assembled.problem, run)
        if NO_KEY in systems.keys[slot, :1]:
            # It holds for the present state alone: the run assembles it anew, in the same place,
            # and no earlier one is the same.
            systems.used[0] = slot
            tangents.keys[tangents.keys[:, 0] == NO_KEY, 0] -= 1
        what = systems.what[slot, : systems.counts[slot]]
        own = [getattr(systems, name)[slot] for name in _ROWS]
        beside = self._beside
        beside.modes[:], beside.places[:], beside.z[:] = run.modes, run.places, run.z
        for number, near in enumerate(self._known.near):
            found = near.difference(lambda one: _rows_beside(one, beside, what))
            ends = np.cumsum([len(what), *(len(one) for one in own)])
            parts = np.split(found, ends[:-1])
            tangents.guards[slot, number, : len(what)] = parts[0]
            for name, rows, part in zip(_ROWS, own, parts[1:], strict=True):
                getattr(tangents, name)[slot, number] = part
                self._follow_signals(number, getattr(tangents, name)[slot, number], rows)
            guards = tangents.guards[slot, number]
            self._follow_signals(number, guards, systems.guards[slot])
        tangents.keys[slot] = systems.keys[slot]


# The rows of a mode that are differentiated, besides its guards.
_ROWS = ("rates", "contact", "force", "error", "output")


def _rows_beside(problem: MachineProblem, run: Run, what: Any) -> FloatArray:
    """The rows of the mode of a run of another machine, with the guards in a given order first.

    what : descriptions of the guards; where a force varies with a parameter, there are further ones
    """
    systems = run.systems
    systems.used[0] = 0  # those of the machine before
    slot = select_system(problem, run)
    own = systems.what[slot, : systems.counts[slot]]
    guards = systems.guards[slot, : own.size]
    if own.tobytes() != what.tobytes():
        numbers = own.tolist()
        guards = guards[[numbers.index(one) for one in what.tolist()]]
    return np.concatenate([guards, *(getattr(systems, name)[slot] for name in _ROWS)])


def _sample_times(problem: MachineProblem) -> FloatArray:
    """The sample times of digital controllers and actuations [s]; 0 without samples."""
    loops, contacts = problem.controllers.records, problem.contacts
    return np.concatenate(
        [
            np.where(loops["held"] >= 0, loops["sample_time"], 0.0),
            np.where(contacts["sampled_input"] >= 0, contacts["sample_time"], 0.0),
        ]
    )


def difference_of(parameter: Parameter, of: Callable[[float], Any]) -> FloatArray:
    """Derivative of numbers of a machine, as a function of a parameter."""
    stencil, found = _machines(parameter, parameter.step, of)
    return stencil.difference(found)


def machine_beside(parameter: Parameter, machine_at: Callable[[float], Machine]) -> Machine:
    """A machine with another value of a parameter, close to its own."""
    return cast("Machine", _machines(parameter, parameter.step, machine_at)[1][-1])


def signal_change(
    parameter: Parameter,
    machine_at: Callable[[float], Machine],
    of: Callable[[Machine], Signal],
) -> Signal:
    """Derivative of a signal of a machine with respect to a parameter, as a signal."""
    stencil, machines = _machines(parameter, parameter.step, machine_at)
    near = [of(one) for one in machines]
    return tangent_of(near, stencil.of_number, of(machine_at(parameter.value)))


def knot_changes(
    parameter: Parameter, machine_at: Callable[[float], Machine], span: tuple[float, float]
) -> list[tuple[FloatArray, FloatArray]]:
    """Knots of the signals of a machine in a span [s], and their derivatives; nan where unknown."""
    stencil, machines = _machines(parameter, _KNOT_STEP * parameter.step, machine_at)
    found = []
    for name, signal in machine_at(parameter.value).signals().items():
        knots = np.asarray(signal.knots(*span))
        near = [one.signals()[name].knots(*span) for one in machines]
        same = all(len(one) == knots.size for one in near)
        change = stencil.difference(near) if same else np.full(knots.shape, math.nan)
        found.append((knots, change))
    return found


class Samples(NamedTuple):
    """Samples of a digital controller or of an actuation in a run.

    name    : of the controller or contact
    times   : (k,) [s];  changes : (k, p) their derivatives with respect to parameters
    """

    name: str
    times: FloatArray
    changes: FloatArray


def samples_of(task: TangentTask) -> list[Samples]:
    """The samples of each part in a run."""
    parts = *task.machine.controllers, *task.machine.contacts
    loops = len(task.machine.controllers)
    begins = [(task.span[0], 0)] * len(parts)
    for place, known in ((0, "samplings"), (loops, "sampled")):
        own = getattr(task.initial, known, ())
        begins[place : place + len(own)] = own
    steps = [_steps(task.machine)]
    steps += [
        difference_of(one, lambda value, at=at: _steps(at(value)))  # type: ignore[misc]
        for one, at in zip(task.parameters, task.machine_at, strict=True)
    ]
    found = []
    for part, (begin, _), step, *changes in zip(parts, begins, *steps, strict=True):
        if step > 0.0:
            low, high = (np.asarray(task.span) - begin) / step
            numbers = np.arange(math.ceil(low - _NEARLY), math.floor(high + _NEARLY) + 1.0)
            found.append(Samples(part.name, begin + numbers * step, np.outer(numbers, changes)))
    return found


def _check_order(task: TangentTask) -> None:
    """Raise ``InputError`` for a parameter that moves samples past others or past knots."""
    samples = samples_of(task) if any(_steps(task.machine)) else []
    for number, (one, at) in enumerate(zip(task.parameters, task.machine_at, strict=True)):
        if not any(own.changes[:, number].any() for own in samples):
            continue
        given = [(own.name, own.times, own.changes[:, number]) for own in samples]
        knots = knot_changes(one, at, task.span)
        given += [(name, *own) for name, own in zip(task.machine.signals(), knots, strict=True)]
        names = np.repeat([name for name, _, _ in given], [times.size for _, times, _ in given])
        times, changes = (np.concatenate([own[place] for own in given]) for place in (1, 2))
        order = np.argsort(times, kind="stable")
        together = np.diff(times[order]) <= _TOGETHER * (1.0 + np.abs(times[order][1:]))
        (met,) = np.nonzero(together & (np.diff(changes[order]) != 0.0))
        if met.size:
            first, second = order[met[0] : met[0] + 2]
            raise wrong(
                "parameters", one.name, "a parameter that does not change the order of samples",
                f"At {times[first]:.9g} s, {names[first]} and {names[second]} coincide, and the"
                " parameter moves them apart. Change its value slightly.",
            )  # fmt: skip


def _steps(machine: Machine) -> list[float]:
    """Sample times of digital controllers and actuations [s]; 0 without samples."""
    found = [one.sample_time for one in machine.controllers]
    found += [one.actuation.sample_time for one in machine.contacts]
    return [one or 0.0 for one in found]


def _machines(
    parameter: Parameter, step: float, machine_at: Callable[[float], Any]
) -> tuple[_Stencil, tuple[Any, ...]]:
    """Machines with values about that of a parameter; at the end of its range on one side."""
    return next(_stencils(parameter, step, machine_at))


def _stencils(
    parameter: Parameter, step: float, machine_at: Callable[[float], Any]
) -> Iterator[tuple[_Stencil, tuple[Any, ...]]]:
    """Machines with values about that of a parameter, above it, and below it, where allowed."""
    last, allowed = None, False
    for places in parameter.differences.places:
        stencil = _Stencil.of(parameter.value, step, places)
        try:
            machines = tuple(map(machine_at, stencil.values))
        except InputError as error:
            last = error
        else:
            allowed = True
            yield stencil, machines
    if not allowed:
        raise wrong(
            parameter.name, parameter.value, "a value with allowed values near it",
            f"At a value near it: {last}",
        )  # fmt: skip


def _agree(numbers: FloatArray, stencil: _Stencil, parameter: Parameter) -> bool:
    """Return True if the derivatives of numbers hardly depend on the outermost value."""
    value, step = parameter.value, parameter.step
    places = tuple(round((one - value) / step) for one in stencil.values)
    fewer = _Stencil.of(value, step, places[1:])
    more, less = stencil.difference(numbers), fewer.difference(numbers[1:])
    rounding = _rounding(numbers, parameter)
    return bool(np.all(np.abs(more - less) <= _AGREE * np.abs(more) + rounding))


def _lost_in_rounding(numbers: FloatArray, stencil: _Stencil, parameter: Parameter) -> bool:
    """Return True if rounding errors of the derivatives exceed the allowed relative difference."""
    changes = np.abs(stencil.difference(numbers))
    moved = np.any(numbers != numbers[0], axis=0)
    lost = moved & (_rounding(numbers, parameter) > _AGREE * changes)
    # Below ``_SHORT``, sums of the numbers, such as the rows of a mode, may lose their changes.
    return bool(lost.any() or not moved.any() or parameter.step < _SHORT)


def _rounding(numbers: FloatArray, parameter: Parameter) -> FloatArray:
    """Bounds of the rounding errors of derivatives of numbers."""
    return np.asarray(1e-13 * np.abs(numbers).max(axis=0) / parameter.step)


def _pieces(problem: MachineProblem, contact: int, side: int) -> Any:
    """The lines of a contact in a direction of sliding."""
    one = problem.contacts[contact]
    first, count = one["first_line"], one["lines_forward"]
    if side < 0:
        first, count = first + count, one["lines_backward"]
    return problem.lines[first : first + count]


def _line_changes(pieces: Any, others: Sequence[Any], near: _Near) -> FloatArray:
    """Derivatives of the factors of curved lines, (lines, degree + 1)."""
    frame = ["start", "offset", "slope", "degree"]
    if all(len(one) == len(pieces) and np.all(one[frame] == pieces[frame]) for one in others):
        return near.stencil.difference([one["factors"] for one in others])
    found = np.zeros(pieces["factors"].shape)
    ends = [*pieces["start"][1:], math.inf]
    for row, line, end in zip(found, pieces, ends, strict=True):
        if math.isinf(end):
            speeds, degree = np.array([line["start"]]), 0
        else:
            degree = int(line["degree"])
            speeds = line["start"] + 0.5 * (end - line["start"]) * (1.0 + _NODES)
        values = near.stencil.difference([_gains(one, speeds) for one in others])
        places = line["offset"] + line["slope"] * speeds
        row[: degree + 1] = polynomial.polyfit(places, values, degree)
    return found


def _gains(pieces: Any, speeds: FloatArray) -> FloatArray:
    """Torque over force at sliding speeds, from curved lines."""
    lines = pieces[np.searchsorted(pieces["start"], speeds, side="right") - 1]
    places = lines["offset"] + lines["slope"] * speeds
    powers: FloatArray = lines["factors"] * places[:, None] ** np.arange(MOST_DEGREE + 1)
    gains: FloatArray = powers.sum(axis=1)
    return gains


def _with_curves_of(base: MachineProblem, problem: MachineProblem) -> MachineProblem:
    """The numbers of a machine, with the curved lines of another one."""
    curved = base.contacts["curve"] >= 0
    if not curved.any() or base.contacts.size != problem.contacts.size:
        return problem
    contacts, lines = problem.contacts.copy(), base.lines.copy()
    for number in np.flatnonzero(~curved).tolist():
        for side in (1, -1):
            own, target = _pieces(problem, number, side), _pieces(base, number, side)
            if len(own) == len(target):
                first = base.contacts[number]["first_line"]
                first += base.contacts[number]["lines_forward"] if side < 0 else 0
                lines[first : first + len(own)] = own
    for name in ("first_line", "lines_forward", "lines_backward"):
        contacts[name] = base.contacts[name]
    return problem._replace(contacts=contacts, lines=lines)


@cache
def _columns(dtype: Any) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Places of the numbers in a record, in 8 bytes, and the bytes of all else."""
    floats: list[int] = []
    others: list[int] = []
    for name in dtype.names:
        of, first = dtype.fields[name][:2]
        places = range(first, first + of.itemsize)
        if of.base == np.float64:
            floats += [at // 8 for at in places[::8]]
        else:
            others += places
    return np.array(floats, np.intp), np.array(others, np.intp)


def _floats(records: Any) -> FloatArray:
    """The numbers in records, flat."""
    size, dtype = records.size, records.dtype
    if not size:
        return np.empty(0)
    rows = records.view(np.float64).reshape(size, dtype.itemsize // 8)
    return np.asarray(rows[:, _columns(dtype)[0]].ravel())


def _whole(records: Any) -> bytes:
    """All else in records."""
    size, dtype = records.size, records.dtype
    if not size:
        return b""
    rows = records.view(np.uint8).reshape(size, dtype.itemsize)
    return bytes(rows[:, _columns(dtype)[1]].tobytes())


def _numbers(problem: MachineProblem) -> FloatArray:
    """All numbers of a machine that may depend on a parameter."""
    elements = problem.elements
    loops = problem.controllers
    records = [
        problem.shafts, problem.contacts, problem.driven, problem.lines, loops.records,
    ]  # fmt: skip
    arrays = [
        problem.inverse, problem.joints.mobility, problem.torque, problem.sliding, problem.normals,
        elements.loads, elements.lines, elements.rows, loops.errors, loops.forces, loops.torques,
    ]  # fmt: skip
    return _finite(np.concatenate([*(one.ravel() for one in arrays), *map(_floats, records)]))


def _finite(values: Any) -> FloatArray:
    """Values with 0 in place of infinities."""
    return np.where(np.isfinite(values), values, 0.0)


def _structure(problem: MachineProblem) -> tuple[Any, ...]:
    """What must not change with a parameter."""
    elements = problem.elements
    records = [
        problem.shafts, problem.contacts, problem.driven, problem.lines, elements.elements,
        elements.pieces, elements.bounds, problem.controllers.records,
    ]  # fmt: skip
    return (problem.torque.shape, problem.joints.mobility.shape, *map(_whole, records))


def _signals(machine: Machine) -> dict[str, Signal]:
    return {name: one for name, one in machine.signals().items() if one.varies}


def _moving_signals(
    machine: Machine, machine_at: Callable[[float], Machine], parameter: Parameter
) -> list[tuple[Signal, Signal, Signal]]:
    """The signals that change with a parameter, their derivatives, and the rates of these."""
    stencil, machines = _machines(parameter, parameter.step, machine_at)
    near = [_signals(one) for one in machines]
    found = []
    for name, signal in _signals(machine).items():
        others = [one[name] for one in near]
        if any(one != signal for one in others):
            change = tangent_of(others, stencil.of_number, signal)
            found.append((signal, change, rate_of(change)))
    return found


def _with_signals_of(base: Machine, machine: Machine) -> Machine:
    """The machine with the signals of another one that vary."""
    changes: Mapping[str, Signal] = {
        name: one for name, one in _signals(base).items() if _signals(machine).get(name) != one
    }
    return machine.replace(changes) if changes else machine
