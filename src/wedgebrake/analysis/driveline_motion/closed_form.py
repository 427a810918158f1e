"""Machines whose motion has a closed form: one inertia, one contact, a spring and a single sine.

Their motion is classified by the compiled evaluation of drivelines instead of the series of
machines; ``Classifier`` in ``machine_motion.classify_machine`` chooses. The sine has the phase 0,
as returns are counted from there.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from wedgebrake.analysis.driveline_motion.batch import ROWS
from wedgebrake.analysis.driveline_motion.driveline_passage import arrays_for
from wedgebrake.analysis.driveline_motion.evaluate_point import EMPTY, evaluate
from wedgebrake.analysis.machine_motion.result import ContactSums, MachineResult, Vibration
from wedgebrake.analysis.run_settings import Protocol
from wedgebrake.arrays import FloatArray
from wedgebrake.dynamics.enums import MotionClass, Outcome
from wedgebrake.dynamics.harmonic import Harmonic as Sine
from wedgebrake.dynamics.linear_flow import Driveline
from wedgebrake.dynamics.problem import Problem
from wedgebrake.model.characteristic import characteristic
from wedgebrake.model.friction import SetValuedFriction
from wedgebrake.model.machine import Machine
from wedgebrake.model.signals.signals import Harmonic, Signal
from wedgebrake.solvers.event_driven.solve import problem_for
from wedgebrake.solvers.machine.final_state import FinalState


def one_inertia_problem(machine: Machine) -> Problem | None:
    """The one-inertia problem equivalent to a machine; None if it has no closed form."""
    if not len(machine.inertias) == len(machine.contacts) == len(machine.torques) == 1:
        return None
    (inertia,), (contact,), (torque,) = machine.inertias, machine.contacts, machine.torques
    sine, friction = torque.signal.primitive(), contact.friction
    if not isinstance(sine, Harmonic) or sine.amplitude <= 0.0 or sine.phase != 0.0:
        return None
    actuation, base_speed = contact.actuation, contact.base_speed
    if isinstance(base_speed, Signal) or isinstance(actuation.initial_force, Signal):
        return None
    if not actuation.straight:
        return None
    # Without a spring, the angle is not part of the state of a machine's motion.
    stiffness = sum(one.stiffness for one in machine.shafts)
    if not isinstance(friction, SetValuedFriction) or not friction.has_nodes or stiffness == 0.0:
        return None
    damping = sum(one.damping for one in machine.shafts)
    line = Driveline(inertia.inertia, damping, stiffness, base_speed)
    law = characteristic(contact.brake, friction, actuation)
    numbers = Sine(sine.amplitude, sine.rate)
    return problem_for(line, law, numbers, inertia.angle, inertia.speed)


def classified(machine: Machine, problem: Problem, protocol: Protocol) -> MachineResult:
    """Run the problem of a machine and classify its motion."""
    (inertia,), settings = machine.inertias, protocol.settings
    arrays, result = arrays_for(settings, ROWS), EMPTY.copy()[0]
    begin, end = evaluate(problem, inertia.angle, inertia.speed, settings, arrays, result)
    period = machine.torques[0].signal.period or math.nan
    return machine_result(result, arrays.points[begin:end], begin, (inertia.name, period))


def machine_result(
    found: Any, points: FloatArray, first: int, of: tuple[str, float]
) -> MachineResult:
    """The result of a machine from the record of one inertia.

    found  : of dtype ``RESULT``
    points : recorded returns, numbered from ``first``
    of     : name of the inertia, and time between two returns [s]
    """
    (name, period), order = of, int(found.order)
    result = MachineResult(
        exponents=np.array([found.largest_exponent, found.second_exponent]),
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
    )  # fmt: skip
    if result.outcome == Outcome.COMPLETED:
        # Extremes of the angle are not computed.
        result.low = np.array([math.nan, found.lowest_velocity])
        result.high = np.array([math.nan, found.highest_velocity])
        result.points = points.copy()
        result.times = period * np.arange(first, first + len(points), dtype=float)
        angles, speeds = {name: float(found.final_angle)}, {name: float(found.final_velocity)}
        # At a return the torque is as at the initial time, also if another frequency follows.
        result.final = FinalState(0.0, angles, speeds, held=((),))
    return result
