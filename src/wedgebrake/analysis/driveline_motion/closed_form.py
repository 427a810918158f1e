"""Machines that are one inertia on one harmonic: their form, and the results of its kernels.

Their motion is classified by the kernels of one inertia, the closed form or the stepper, instead of
the series of machines; ``evaluate`` chooses. The sine has the phase 0, as returns are counted from
there.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from wedgebrake.analysis.machine_motion.result import ContactSums, MachineResult, Vibration
from wedgebrake.arrays import FloatArray
from wedgebrake.dynamics.enums import MotionClass, Outcome
from wedgebrake.dynamics.problem import Problem
from wedgebrake.model.driveline import Driveline
from wedgebrake.model.friction import SetValuedFriction, SmoothFriction
from wedgebrake.model.machine import Machine
from wedgebrake.model.signals.excitation import HarmonicTorque
from wedgebrake.model.signals.signals import Harmonic, Signal
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.solvers.machine.final_state import FinalState


def one_inertia(system: BrakedDriveline | Machine) -> BrakedDriveline | None:
    """The numbers of a system that is one inertia with a spring, a contact and a sine, or None.

    The force acts at once, and the base of the contact has a constant speed.
    """
    if isinstance(system, BrakedDriveline):
        return system if system.plain else None
    if not len(system.inertias) == len(system.contacts) == len(system.torques) == 1:
        return None
    (inertia,), (contact,), (torque,) = system.inertias, system.contacts, system.torques
    sine, actuation, base_speed = torque.signal.primitive(), contact.actuation, contact.base_speed
    if not isinstance(sine, Harmonic) or sine.amplitude < 0.0 or sine.phase != 0.0:
        return None
    if isinstance(base_speed, Signal) or isinstance(actuation.initial_force, Signal):
        return None
    if not actuation.immediate:
        return None
    # The parts have been checked where the machine was made.
    line = Driveline.model_construct(
        inertia=inertia.inertia,
        damping=sum((one.damping for one in system.shafts), 0.0),
        stiffness=sum((one.stiffness for one in system.shafts), 0.0),
        drive_speed=0.0 - base_speed,
    )
    return BrakedDriveline.model_construct(
        driveline=line, brake=contact.brake, friction=contact.friction, actuation=actuation,
        excitation=HarmonicTorque.model_construct(
            amplitude=sine.amplitude, frequency=sine.frequency
        ),
    )  # fmt: skip


def kernel_form(system: BrakedDriveline | Machine, method: str) -> BrakedDriveline | None:
    """The ``one_inertia`` that its own kernel evaluates with a method; None for the series."""
    line = one_inertia(system)
    if line is None:
        return None
    friction, driven = line.friction, line.excitation.amplitude > 0.0
    if isinstance(friction, SmoothFriction) and method == "smooth":
        from wedgebrake.solvers.smooth.solve import winds_up

        # Only the stepper ends a run in which the torque grows without limit.
        return line if driven or winds_up(line, -line.driveline.drive_speed) else None
    closed = method == "exact" and isinstance(friction, SetValuedFriction) and friction.has_nodes
    return line if closed and driven else None


def one_inertia_problem(machine: Machine) -> Problem | None:
    """The problem of the closed form that is equivalent to a machine; None if it has none."""
    from wedgebrake.solvers.event_driven.solve import problem

    line, (inertia, *_) = kernel_form(machine, "exact"), machine.inertias
    return None if line is None else problem(line, inertia.angle, inertia.speed)


def _exponents(found: Any, stiffness: float) -> FloatArray:
    """Exponents, (p,), descending; without a spring only that of the speed."""
    both = np.array([found.largest_exponent, found.second_exponent])
    if stiffness > 0.0:
        return both
    # No motion depends on the angle of a free rotation: its exponent is 0.
    return both[1:] if abs(both[0]) <= abs(both[1]) else both[:1]


def machine_result(
    found: Any, points: FloatArray, first: int, line: BrakedDriveline, name: str
) -> MachineResult:
    """The result of a machine from the record of one inertia.

    found  : of dtype ``RESULT``
    points : recorded returns, numbered from ``first``
    name   : of the inertia
    """
    period, order = 1.0 / line.excitation.frequency, int(found.order)
    result = MachineResult(
        exponents=_exponents(found, line.driveline.stiffness),
        contacts=ContactSums(
            np.array([found.stick_class]),
            np.array([[found.sticks_forward, found.sticks_backward]]),
            *(np.array([found[name]]) for name in ("stick_share", "peak_torque", "friction_power")),
        ),
        vibration=Vibration(*(np.array([found[name]]) for name in Vibration._fields)),
        outcome=Outcome(found.outcome),
        motion=MotionClass(found.motion),
        order=order,
        period=order * period if order else math.nan,
        exponent_error=float(found.exponent_error),
        return_distance=float(found.return_distance),
        size=float(found["size"]),  # found.size is that of an array
        transient=int(found.transient),
        settling=float(found.settling),
        judged=int(found.judged),
        events=int(found.events),
        # Extremes of the angle are not computed.
        low=np.array([math.nan, found.lowest_velocity]),
        high=np.array([math.nan, found.highest_velocity]),
        points=points.copy(),
        times=period * np.arange(first, first + len(points), dtype=float),
    )
    angles, speeds = {name: float(found.final_angle)}, {name: float(found.final_velocity)}
    # At a return the torque is as at the initial time, also if another frequency follows.
    result.final = FinalState(0.0, angles, speeds, held=((),))
    return result
