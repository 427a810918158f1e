"""Machines that several tests build, and their states as vectors."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

import wedgebrake as wb

FRICTION = 0.5  # with a radius of 1/0.5 the torque is 1/0.5 * 0.5 times the force, exactly


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


def pressed(*ends: str, static: float = 1.0, friction: Any = None, **more: Any) -> wb.Contact:
    """A contact whose torque in motion is its force in N m, and ``static`` times this at rest."""
    law = friction or wb.CoulombFriction(kinetic=FRICTION, static=static * FRICTION)
    return contact(*ends, radius=1.0 / FRICTION, friction=law, **more)


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


def general(machine: wb.Machine) -> wb.Machine:
    """A machine with one more torque, which is zero: the general solvers run it.

    The closed form of one inertia has a single torque.
    """
    idle = wb.Torque(machine.inertias[0].name, wb.Constant(0.0), name="idle")
    return machine.replace(torques=[*machine.torques, idle])


def in_row(
    *contacts: wb.Contact, names: tuple[str, str] = ("a", "b"),
    inertia: tuple[float, float] = (1.0, 0.5), stiffness: tuple[float, float] = (4.0, 6.0),
    damping: tuple[float, float] = (0.125, 0.0625), speed: float = 0.0, **torques: Any,
) -> wb.Machine:  # fmt: skip
    """The ground, a first inertia and a second one in a row, with torques on the second by name."""
    first, second = names
    return wb.Machine(
        inertias=[wb.Inertia(*one, speed=speed) for one in zip(names, inertia, strict=True)],
        shafts=[
            wb.Shaft(first, "ground", stiffness[0], damping[0]),
            wb.Shaft(second, first, stiffness[1], damping[1]),
        ],
        contacts=contacts,
        torques=[wb.Torque(second, signal, name=name) for name, signal in torques.items()],
    )


def stribeck(tolerance: float = 1e-4) -> wb.StribeckFriction:
    """Friction that falls from 1 to 0.5 with the sliding speed, as 0.5 + 0.5 exp(-2 v)."""
    return wb.StribeckFriction(kinetic=0.5, static=1.0, speed=0.5, tolerance=tolerance)


def block(friction: Any, base_speed: float = 1.0, **more: Any) -> wb.Machine:
    """A block on a belt: x'' + 0.1 x' + x = mu."""
    belt = contact("block", name="belt", friction=friction, base_speed=base_speed, **more)
    return single(belt, name="block", stiffness=1.0, damping=0.1)


def numbers(state: wb.FinalState) -> np.ndarray:
    """The angles, speeds and actuator states of a state."""
    return np.array([*state.angles.values(), *state.speeds.values(), *state.actuators])


def with_numbers(state: wb.FinalState, values: Any) -> wb.FinalState:
    """A state with other angles, speeds and actuator states."""
    names, n = list(state.angles), len(state.angles)
    angles, speeds, actuators = np.split(np.asarray(values, dtype=float), [n, 2 * n])
    return dataclasses.replace(
        state, angles=dict(zip(names, angles.tolist(), strict=True)),
        speeds=dict(zip(names, speeds.tolist(), strict=True)), actuators=tuple(actuators.tolist()),
    )  # fmt: skip


def after(machine: wb.Machine, states: Any, duration: float) -> np.ndarray:
    """Angles and speeds of a machine a time after others."""
    names = [f"{one.name}.{what}" for what in ("angle", "speed") for one in machine.inertias]
    start = dict(zip(names, np.asarray(states).tolist(), strict=True))
    end = wb.final_state(wb.simulate(machine.replace(start), duration, times=()))
    return np.array([*end.angles.values(), *end.speeds.values()])
