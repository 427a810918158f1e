"""The final state of a run of a machine, from which another run can continue."""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from wedgebrake.errors import InputError
from wedgebrake.model.elements import elements
from wedgebrake.model.joints import check_agrees, reduction
from wedgebrake.model.machine import Machine
from wedgebrake.model.machine_parts import speed_at
from wedgebrake.model.signals.signals import as_signal
from wedgebrake.model.validation import check_instance, wrong

if TYPE_CHECKING:
    import xarray as xr

    from wedgebrake.solvers.machine.problem import MachineProblem, Run

# What ``from_json`` takes.
_JSON = "the text that FinalState.to_json() returned"
_NESTED = ("held", "sampled", "modes", "pieces", "samplings")
_MODE = ("side", "line", "force_limit", "clamp", "fresh")


@dataclass(frozen=True)
class FinalState:
    """State of a machine at the end of a run, sufficient to continue it.

    time     : [s]
    angles, speeds : of the inertias and driven bodies, by name [rad], [rad/s]
    actuators : states of the lags, in the order of the contacts [N], [N/s]; then those of the
               controllers, in their order, see ``Controller.memory``
    held     : for each contact with a sampled actuation, the applied force and those in the queue
               of its samples [N]; empty for other contacts
    sampled  : for each contact, the time of the first sample of its actuation [s], and the number
               of samples so far
    modes    : for each contact, direction of sliding, number of the line of its torque, limit of
               its force, limit of its torque, and which limits it has just reached; if empty, the
               next run determines them from the speeds, as from the initial state of a machine
    pieces   : for each shaft or torque with a piecewise-linear law, number of the piece, number of
               periods of its argument, and which of its limits it has just reached; then for each
               controller, its piece, 0, and which of its limits it has just reached
    samplings : for each controller, time of its first sample [s], and number of samples so far; 0
               if it is continuous
    """

    time: float
    angles: dict[str, float]
    speeds: dict[str, float]
    actuators: tuple[float, ...] = ()
    held: tuple[tuple[float, ...], ...] = ()
    sampled: tuple[tuple[float, int], ...] = ()
    modes: tuple[tuple[int, ...], ...] = ()
    pieces: tuple[tuple[int, int, int], ...] = ()
    samplings: tuple[tuple[float, int], ...] = ()

    def to_json(self) -> str:
        """The state as JSON text, with all digits."""
        return json.dumps(vars(self))

    @classmethod
    def from_json(cls, text: str) -> FinalState:
        """The state whose JSON text ``to_json`` returned.

        Raises ``InputError`` for any other text.
        """
        try:
            given = json.loads(check_instance("text", text, str, _JSON))
            given = {"pieces": (), "samplings": (), **given}  # missing in earlier versions
            nested = {name: tuple(map(tuple, given[name])) for name in _NESTED}
            return cls(**{**given, "actuators": tuple(given["actuators"]), **nested})
        except (KeyError, TypeError, ValueError) as error:
            if isinstance(error, InputError):
                raise
            raise wrong("text", text, _JSON) from None


def due_sample(state: FinalState, number: int, sample_time: float) -> int:
    """Number of the sample that a sampled actuation takes, or has just taken, at this instant."""
    return round((state.time - state.sampled[number][0]) / sample_time)


def delayed_forces(state: FinalState, machine: Machine) -> list[float]:
    """Forces that sampled actuations have yet to apply, at the instant of a sample [N].

    They are in the order of the contacts; those of one contact begin with the next to act.
    """
    found: list[float] = []
    for number, contact in enumerate(machine.contacts):
        given, queue = contact.actuation, state.held[number][1:]
        if given.sample_time is not None:
            due = due_sample(state, number, given.sample_time)
            found += [queue[k % len(queue)] for k in range(due - given.delay, due)]
    return found


def final_state(response: xr.Dataset) -> FinalState:
    """Return the state in which a simulated system ended.

    response : as returned by ``wb.simulate``

    ``wb.simulate(system, initial=...)`` continues from this state. The parameters of the system
    may then be different, but not its inertias, contacts and lags.

    Raises ``InputError`` for a response without such a state.
    """
    import xarray as xr

    check_instance("response", response, xr.Dataset, "a response, as wb.simulate returns it")
    text = response.attrs.get("final_state")
    if text is None:
        raise InputError(
            "response: contains no final state. Use the result of wb.simulate(...); those of"
            " earlier versions for a BrakedDriveline give initial=(final_angle, final_velocity) and"
            " start_time=final_time, from their attributes."
        )
    return FinalState.from_json(text)


def carried(state: FinalState, machine: Machine) -> FinalState:
    """The state for a machine whose joints have other ratios.

    Free bodies keep their angles and speeds; those of the other bodies follow from the joints.
    """
    if not machine.joints:
        return state
    follow, names = reduction(machine).follow, list(state.angles)
    angles, speeds = (follow @ list(one.values()) for one in (state.angles, state.speeds))
    return replace(
        state,
        angles=dict(zip(names, map(float, angles), strict=True)),
        speeds=dict(zip(names, map(float, speeds), strict=True)),
    )


def state_of(machine: Machine, problem: MachineProblem, run: Run) -> FinalState:
    """The state that a run has reached."""
    n, z, states = len(machine.inertias), run.z[:, 0], problem.states
    names = [one.name for one in machine.inertias]
    held = [
        (float(z[states + one["sampled_input"]]), *map(float, queue[: one["delay"] + 1]))
        if one["sampled_input"] >= 0
        else ()
        for one, queue in zip(problem.contacts, run.queues, strict=True)
    ]
    loops = run.places[problem.elements.elements.size :]
    return FinalState(
        time=float(run.clock[0]),
        angles=dict(zip(names, map(float, z[:n]), strict=True)),
        speeds=dict(zip(names, map(float, z[n : 2 * n]), strict=True)),
        actuators=tuple(map(float, z[2 * n : states])),
        held=tuple(held),
        sampled=tuple((float(mode["first_sample"]), int(mode["samples"])) for mode in run.modes),
        modes=tuple(tuple(int(mode[name]) for name in _MODE) for mode in run.modes),
        pieces=tuple(
            (int(at["piece"] - one["first"]), int(_turns(problem, one, z)), int(at["fresh"]))
            for at, one in zip(run.places, problem.elements.elements, strict=False)
        )
        + tuple((int(at["piece"]), 0, int(at["fresh"])) for at in loops),
        samplings=tuple((float(one["first_sample"]), int(one["samples"])) for one in run.samplings),
    )


def _turns(problem: MachineProblem, element: Any, z: Any) -> float:
    """Number of periods of the argument of an element."""
    return float(z[problem.states + element["turns"]]) if element["turns"] >= 0 else 0.0


def _place(state: FinalState, problem: MachineProblem, run: Run) -> None:
    """Set the pieces of elements and controllers to those of a state.

    If the state is that of other elements or controllers, they are left to be determined.
    """
    count = problem.elements.elements.size
    run.places["piece"][:count], run.places["piece"][count:] = -1, 0
    if len(state.pieces) == run.places.size:
        for place, (piece, _, fresh) in zip(run.places[count:], state.pieces[count:], strict=True):
            place["piece"], place["fresh"] = piece, fresh
        each = zip(run.places, problem.elements.elements, state.pieces, strict=False)
        for place, one, (piece, turns, fresh) in each:
            place["piece"], place["fresh"] = one["first"] + piece, fresh
            if one["turns"] >= 0:
                run.z[problem.states + one["turns"], 0] = turns


def misfit(state: FinalState) -> InputError:
    """The error for a state of another machine."""
    return wrong(
        "initial", state,
        "a state of a machine with the same inertias, contacts, lags and controllers",
        "Use the final state of a run of this machine.",
    )  # fmt: skip


def restore(state: FinalState, machine: Machine, problem: MachineProblem, run: Run) -> bool:
    """Set a run to a state; return False if the modes of its contacts must follow from the speeds.

    Raises ``InputError`` if it is not a state of this machine.
    """
    names = [one.name for one in machine.inertias]
    n, states = len(names), problem.states
    fits = list(state.angles) == names and len(state.modes) in (0, problem.contacts.size)
    if not fits or len(state.actuators) != states - 2 * n:
        raise misfit(state)
    try:
        check_agrees(machine, list(state.angles.values()), list(state.speeds.values()))
    except InputError as error:
        raise wrong(
            "initial", state, "a state that agrees with the joints of the machine",
            f"{error.name} is {error.value:.10g} and must be {error.allowed}. A run cannot change a"
            " joint: give contacts with ratios for a gear shift. To start from other values, use"
            " dataclasses.replace(state, angles={...}, speeds={...}) with values of all bodies that"
            " agree.",
        ) from None  # fmt: skip
    run.z[:n, 0] = list(state.angles.values())
    run.z[n : 2 * n, 0] = list(state.speeds.values())
    run.z[2 * n : states, 0] = state.actuators
    _place(state, problem, run)
    run.samplings["first_sample"] = problem.start_time
    if len(state.samplings) == run.samplings.size:
        for sampling, (first, samples) in zip(run.samplings, state.samplings, strict=True):
            sampling["first_sample"], sampling["samples"] = first, samples
    if not state.modes:
        run.modes["first_sample"] = problem.start_time
        return not problem.contacts.size
    for number, mode in enumerate(run.modes):
        for name, value in zip(_MODE, state.modes[number], strict=True):
            mode[name] = value
        mode["first_sample"], mode["samples"] = state.sampled[number]
        contact = problem.contacts[number]
        if contact["sampled_input"] >= 0:
            run.z[states + contact["sampled_input"], 0] = state.held[number][0]
            run.queues[number, : contact["delay"] + 1] = state.held[number][1:]
    return True


def start_state(machine: Machine, problem: MachineProblem, run: Run) -> None:
    """Set the states of a run to those of the machine at the start.

    Lags start at the initial force, and filters of controllers at the initial error.
    """
    n, at = len(machine.inertias), problem.start_time
    run.z[:n, 0] = [one.angle for one in machine.inertias]
    run.z[n : 2 * n, 0] = [speed_at(one, at) for one in machine.inertias]
    run.z[2 * n : problem.states, 0] = 0.0
    for contact, one in zip(problem.contacts, machine.contacts, strict=True):
        if contact["lag"] > 0:
            force = one.actuation.initial_force
            value = float(force(at)) if callable(force) else force
            first, dynamics = contact["state"], one.actuation.dynamics
            run.z[first : first + contact["lag"], 0] = value * dynamics.steady
    for number, loop in enumerate(problem.controllers.records):
        if loop["filtered"] >= 0:
            run.z[loop["filtered"], 0] = _error(machine, problem, run, number)
    run.modes["first_sample"] = run.samplings["first_sample"] = at


def _error(machine: Machine, problem: MachineProblem, run: Run, number: int) -> float:
    """Error of a controller at the start."""
    given, n, z = problem.controllers, len(machine.inertias), run.z[:, 0]
    row, setpoint = given.errors[number], machine.controllers[number].setpoint
    found = row[: problem.states] @ z[: problem.states] + row[-1]
    if given.records[number]["input"] >= 0:
        found += float(as_signal(setpoint)(problem.start_time))
    for contact, factor in zip(problem.contacts, given.forces[number], strict=True):
        if factor != 0.0:
            force = z[contact["state"]]
            if contact["normal"] >= 0:
                force += problem.normals[contact["normal"], : problem.states] @ z[: problem.states]
            found -= factor * min(max(force, contact["lowest"]), contact["highest"])
    for element, factor in zip(elements(machine), given.torques[number], strict=True):
        if factor != 0.0:
            found -= factor * element.torque(z[:n], z[n : 2 * n])
    return float(found)
