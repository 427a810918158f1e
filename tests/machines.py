"""Machines that several tests build: a contact with a plain brake, and one inertia."""

from __future__ import annotations

from typing import Any

import wedgebrake as wb


def contact(
    a: str = "disc", b: str = "ground", *, name: str = "brake", brake: Any = None,
    radius: float = 1.0, friction: Any = 0.5, force: Any = 1.0, base_speed: Any = 0.0,
    **actuation: Any,
) -> wb.Contact:  # fmt: skip
    """A contact, by default with a conventional brake: R F times the coefficient is its torque.

    friction : a law of friction, or the coefficient of Coulomb friction
    """
    return wb.Contact(
        a, b, name=name, base_speed=base_speed,
        brake=brake or wb.ConventionalBrake(radius=radius),
        friction=wb.CoulombFriction(kinetic=friction) if isinstance(friction, float) else friction,
        actuation=wb.Actuation(initial_force=force, **actuation),
    )  # fmt: skip


def single(
    *contacts: wb.Contact, name: str = "disc", inertia: float = 1.0, stiffness: float = 0.0,
    damping: float = 0.0, torque: Any = None, **start: float,
) -> wb.Machine:  # fmt: skip
    """One inertia with contacts, a shaft to the ground and a torque named "torque"."""
    held = stiffness or damping
    return wb.Machine(
        inertias=[wb.Inertia(name, inertia, **start)],
        shafts=[wb.Shaft(name, "ground", stiffness=stiffness, damping=damping)] if held else [],
        contacts=contacts,
        torques=[] if torque is None else [wb.Torque(name, torque, name="torque")],
    )
