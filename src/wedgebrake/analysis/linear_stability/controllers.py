"""Controllers of a machine, linearised about steady sliding.

Rows are factors of the state of a ``LinearSystem``, whose last elements are the states of the
controllers (``Controller.memory``).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from wedgebrake.analysis.linear_stability.sliding_contact import SlidingContact, frozen, is_constant
from wedgebrake.arrays import FloatArray
from wedgebrake.model.controller import COMMAND, TORQUE, Controller
from wedgebrake.model.machine import Machine
from wedgebrake.model.machine_matrices import shaft_rows
from wedgebrake.model.validation import wrong

if TYPE_CHECKING:
    from wedgebrake.analysis.linear_stability.linear_system import Mechanics

# Force with which a contact of unknown force is linearised; the result does not depend on it [N].
_ANY_FORCE = 1.0


class Feedback(NamedTuple):
    """The controllers of a machine.

    outputs : (c, N) output of each controller
    rates   : (N, N) rates of their states, 0 in the rows of other states
    jump    : (N, N) the state just after a sample in terms of that before it; None without digital
              controllers
    """

    outputs: FloatArray
    rates: FloatArray
    jump: FloatArray | None


def feedback_of(
    machine: Machine, contacts: Sequence[SlidingContact], given: Mechanics, speeds: FloatArray,
    lags: Sequence[int], size: int,
) -> Feedback:  # fmt: skip
    """The controllers of a machine with linearised contacts.

    speeds : (n,) of the inertias [rad/s]
    lags   : number of the first state of the lag of each contact
    size   : number of states
    """
    loops = machine.controllers
    if not loops:
        return Feedback(np.zeros((0, size)), np.zeros((size, size)), None)
    outputs, rates, jump = np.zeros((len(loops), size)), np.zeros((size, size)), np.eye(size)
    first = size - sum(len(one.memory) for one in loops)
    for number, loop in enumerate(loops):
        error = _error_row(loop, machine, contacts, given, lags, size)
        unit = {name: np.eye(size)[first + at] for at, name in enumerate(loop.memory)}
        place = {name: first + at for at, name in enumerate(loop.memory)}
        acts = acts_at(loop, machine, speeds)
        if loop.sample_time is None:
            outputs[number] = acts * _set_continuous(loop, error, unit, place, rates)
        else:
            _set_sampled(loop, acts * error, first, jump)
            outputs[number] = unit["output"]
        first += len(loop.memory)
    digital = any(one.sample_time is not None for one in loops)
    return Feedback(outputs, rates, jump if digital else None)


def _set_continuous(
    loop: Controller, error: FloatArray, unit: dict[str, FloatArray], place: dict[str, int],
    rates: FloatArray,
) -> FloatArray:  # fmt: skip
    """Set the rates of the states of a continuous controller; returns the row of its output."""
    output = loop.proportional * error
    if "integral" in unit:
        rates[place["integral"]] = loop.integral * error
        output = output + unit["integral"]
    if "filter" in unit and loop.filter_time is not None:
        rate = (error - unit["filter"]) / loop.filter_time
        rates[place["filter"]] = rate
        output = output + loop.derivative * rate
    return output


def _set_sampled(loop: Controller, error: FloatArray, first: int, jump: FloatArray) -> None:
    """Set the states of a digital controller after a sample.

    first : number of its first state
    """
    names, before = loop.memory, np.eye(len(error))
    step, smooth = loop.sample_time or 0.0, loop.filter_time or 0.0
    output = loop.proportional * error
    if "integral" in names:
        at = first + names.index("integral")
        jump[at] = before[at] + loop.integral * step * error
        output = output + jump[at]
    if "rate" in names:
        at, last = first + names.index("rate"), first + names.index("error")
        change = loop.derivative * (error - before[last])
        jump[at], jump[last] = (smooth * before[at] + change) / (smooth + step), error
        output = output + jump[at]
    queue = range(first + len(names) - loop.delay, first + len(names))
    waiting = [*before[queue], output]
    for at, row in zip([first, *queue], waiting, strict=True):
        jump[at] = row


def _error_row(
    loop: Controller, machine: Machine, contacts: Sequence[SlidingContact], given: Mechanics,
    lags: Sequence[int], size: int,
) -> FloatArray:  # fmt: skip
    """The error of a controller, without its steady value."""
    row = np.zeros(size)
    held = slice(0, given.speeds.start)
    twists, shafts = shaft_rows(machine), [one.name for one in machine.shafts]
    for name, factor in loop.measured.items():
        part, _, what = name.rpartition(".")
        if what == "angle":
            row[held] -= factor * given.held[machine.index(part)]
        elif what == "speed":
            row[given.speeds] -= factor * given.basis[machine.index(part)]
        elif what == "torque":
            at = shafts.index(part)
            shaft, twist = machine.shafts[at], twists[at]
            row[held] -= factor * shaft.largest_stiffness * (twist @ given.held)
            row[given.speeds] -= factor * shaft.damping * (twist @ given.basis)
        else:
            at = machine.contact_names.index(part)
            if contacts[at].follows:
                row[lags[at]] -= factor
                row[: given.normals.shape[1]] -= factor * given.normals[at]
    return row


def _steady_error(loop: Controller, machine: Machine, speeds: FloatArray) -> float:
    """Error of a controller at constant speeds, without forces; nan with angles or torques."""
    found = frozen(loop.setpoint)
    for name, factor in loop.measured.items():
        part, _, what = name.rpartition(".")
        if what == "speed":
            found -= factor * float(speeds[machine.index(part)])
        elif what != "force":
            return math.nan
    return found


def steady_torque(loop: Controller, machine: Machine, speeds: FloatArray) -> float:
    """Output of a controller at constant speeds; nan if it is not known from these.

    speeds : (n,) of the inertias [rad/s]
    """
    forces = any(name.endswith(".force") for name in loop.measured)
    if loop.integral != 0.0 or forces:
        return math.nan
    output = loop.proportional * _steady_error(loop, machine, speeds) if loop.proportional else 0.0
    low, high = loop.limits or (-math.inf, math.inf)
    return output if math.isnan(output) else min(max(output, low), high)


def acts_at(loop: Controller, machine: Machine, speeds: FloatArray) -> bool:
    """Return False if the output of a controller without an integral part is beyond a limit."""
    if loop.limits is None:
        return True
    low, high = loop.limits
    output = steady_torque(loop, machine, speeds)
    return math.isnan(output) or low < output < high


def steady_command(machine: Machine, number: int, speed: float, speeds: FloatArray) -> float:
    """What controllers add to the command of a contact that slides steadily; nan if unknown [N].

    speed  : its sliding speed [rad/s]
    speeds : (n,) of the inertias [rad/s]
    """
    contact, total = machine.contacts[number], 0.0
    own = f"{contact.name}.force"
    loops = [one for one in machine.controllers if one.acts_on == (contact.name, COMMAND)]
    for loop in loops:
        error = _steady_error(loop, machine, speeds)
        others = [name for name in loop.measured if name.endswith(".force") and name != own]
        factor = loop.measured.get(own, 0.0)
        if others or (factor != 0.0 and len(loops) > 1):
            return math.nan
        given = contact.actuation
        command = frozen(given.initial_force) + given.slope * abs(speed)
        if factor != 0.0:
            force = error / factor
            if loop.integral == 0.0:
                gain = loop.proportional
                force = (command + gain * error) / (1.0 + gain * factor)
            output = force - command
        elif loop.integral != 0.0:
            return math.nan
        else:
            output = loop.proportional * error if loop.proportional != 0.0 else 0.0
        low, high = loop.limits or (-math.inf, math.inf)
        total += output if math.isnan(output) else min(max(output, low), high)
    return total


def commanded_actuation(
    machine: Machine, number: int, speed: float, speeds: FloatArray
) -> tuple[Machine, bool]:
    """The machine with the steady output of controllers included in the force of a contact.

    Returns (machine, whether the force is known). Raises ``InputError`` if the force is not known
    and the result depends on it.
    """
    contact = machine.contacts[number]
    added = steady_command(machine, number, speed, speeds)
    known = not math.isnan(added)
    given = contact.actuation
    if known:
        force = frozen(given.initial_force) + added
        actuation = given.model_copy(update={"initial_force": force})
    else:
        rubbing = contact.brake.radius * abs(speed)
        if not is_constant(contact.friction, rubbing) or contact.normal:
            raise wrong(
                f"{contact.name}.friction", contact.friction,
                "constant where the steady force is not known",
                "A controller that has an integral part, or measures angles or torques, commands"
                " the force, which is therefore unknown. Give constant friction, or leave out the"
                f" controller and give {contact.name}.initial_force.",
            )  # fmt: skip
        force = _ANY_FORCE - given.slope * abs(speed)
        actuation = given.model_copy(update={"initial_force": force, "limits": None})
    contacts = list(machine.contacts)
    contacts[number] = contact.model_copy(update={"actuation": actuation})
    return machine.model_copy(update={"contacts": tuple(contacts)}), known


def torque_loads(machine: Machine) -> list[tuple[int, int]]:
    """Numbers of the controllers whose outputs are torques, each with that of its inertia."""
    pairs = [(number, one.acts_on) for number, one in enumerate(machine.controllers)]
    return [(number, machine.index(part)) for number, (part, what) in pairs if what == TORQUE]


def command_loads(machine: Machine, contact: str) -> list[int]:
    """Numbers of the controllers that add to the command of a contact."""
    loops = enumerate(machine.controllers)
    return [number for number, one in loops if one.acts_on == (contact, COMMAND)]
