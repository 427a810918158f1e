"""Parameters for which stability limits are computed: slopes, friction levels, damping."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import NamedTuple

from wedgebrake.model.friction import CustomFriction
from wedgebrake.model.machine import Machine
from wedgebrake.model.machine_parts import Contact, Inertia

SLOPE, FRICTION, DAMPING = "slope", "friction", "damping"
"""Kinds of parameters."""
# Largest friction coefficient.
_MOST_FRICTION = 5.0


class VariedParameter(NamedTuple):
    """A parameter that is varied to its stability limit.

    name, kind : dotted name; ``SLOPE``, ``FRICTION`` or ``DAMPING``
    present    : its present value
    scale      : change of the parameter that affects the damping of a vibration appreciably
    low, high  : bounds of its values
    also       : parameters that change in proportion, with their present values
    """

    name: str
    kind: str
    present: float
    scale: float
    low: float
    high: float
    also: dict[str, float]

    def changes(self, value: float) -> dict[str, float]:
        """Return the values of the changed parameters, by name, for another value."""
        # A ratio of at least 1, so that rounding leaves static friction at or above kinetic.
        return {self.name: value} | {
            name: value * (one / self.present) for name, one in self.also.items()
        }


def varied_parameters(machine: Machine) -> list[VariedParameter]:
    """Return the parameters of a machine for which limits are computed."""
    known = machine.parameters()
    damping = _critical_damping(machine)
    parameters = []
    for contact in machine.contacts:
        name = contact.name
        gain = _gain(contact)
        if f"{name}.slope" in known and gain > 0.0:
            present = known[f"{name}.slope"]
            scale = max(damping / gain, abs(present))
            parameters.append(
                VariedParameter(f"{name}.slope", SLOPE, present, scale, -math.inf, math.inf, {})
            )
    for contact in machine.contacts:
        if not isinstance(contact.friction, CustomFriction):  # kinetic is only its reference
            parameters += _friction(contact.name, known)
    for shaft in machine.shafts:
        present = known[f"{shaft.name}.damping"]
        scale = max(damping, present)
        parameters.append(
            VariedParameter(f"{shaft.name}.damping", DAMPING, present, scale, 0.0, math.inf, {})
        )
    return parameters


def _friction(contact: str, known: Mapping[str, float]) -> Iterator[VariedParameter]:
    """Yield the friction level of a contact: the scale of a table, or the coefficients."""
    for name, most in (("scale", math.inf), ("kinetic", _MOST_FRICTION)):
        present = known.get(f"{contact}.{name}", 0.0)
        if present <= 0.0:
            continue
        also = {}
        static = known.get(f"{contact}.static")
        if name == "kinetic" and static is not None:
            also[f"{contact}.static"] = static
            most = min(most, _MOST_FRICTION * present / static)
        yield VariedParameter(f"{contact}.{name}", FRICTION, present, present, 0.0, most, also)
        return


def _critical_damping(machine: Machine) -> float:
    """Damping of the order of critical damping [N m s/rad]."""
    stiffness = max((one.largest_stiffness for one in machine.shafts), default=0.0)
    inertia = max(one.inertia for one in machine.inertias if isinstance(one, Inertia))
    own = max((one.damping for one in machine.shafts), default=0.0)
    return max(math.sqrt(stiffness * inertia), own) or inertia


def _gain(contact: Contact) -> float:
    """Torque per actuation force, forwards or backwards [m]."""
    coefficient = contact.friction.reference
    found = [abs(contact.brake.amplification(side * coefficient)) for side in (1.0, -1.0)]
    return contact.brake.radius * min(one for one in found if math.isfinite(one))
