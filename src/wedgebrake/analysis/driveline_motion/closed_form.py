"""Run and classification of one inertia on one sine by the closed form, in one compiled kernel.

The sine has the phase 0, as returns are counted from there.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from wedgebrake.analysis.driveline_motion import driveline_passage, evaluate_point
from wedgebrake.analysis.machine_motion.result import ContactSums, MachineResult, Vibration
from wedgebrake.analysis.run_settings import Protocol
from wedgebrake.arrays import FloatArray
from wedgebrake.dynamics.enums import MotionClass, Outcome
from wedgebrake.model.machine import Machine
from wedgebrake.model.machine_parts import speed_at
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.solvers.machine.final_state import FinalState


def _exponents(found: Any, stiffness: float) -> FloatArray:
    """Exponents, (p,), descending; without a spring only that of the speed."""
    both = np.array([found.largest_exponent, found.second_exponent])
    if stiffness > 0.0:
        return both
    # No motion depends on the angle of a free rotation: its exponent is 0.
    return both[1:] if abs(both[0]) <= abs(both[1]) else both[:1]


def classify_closed_form(
    machine: Machine, line: BrakedDriveline, protocol: Protocol
) -> MachineResult:
    """Run a machine by the closed form and classify its motion.

    line : the machine as the closed form takes it
    """
    from wedgebrake.analysis.driveline_motion.batch import ROWS
    from wedgebrake.solvers.event_driven.solve import problem

    (inertia,) = machine.inertias
    initial, settings = (inertia.angle, speed_at(inertia, 0.0)), protocol.settings
    arrays, found = driveline_passage.arrays_for(settings, ROWS), evaluate_point.EMPTY.copy()[0]
    given = problem(line, *initial)
    begin, end = evaluate_point.evaluate(given, *initial, settings, arrays, found)
    return _machine_result(found, arrays.points[begin:end], line, inertia.name)


def _machine_result(
    found: Any, points: FloatArray, line: BrakedDriveline, name: str
) -> MachineResult:
    """The result of a machine from a record of dtype ``RESULT`` and the recorded returns."""
    period, order, first = 1.0 / line.excitation.frequency, int(found.order), int(found.transient)
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
