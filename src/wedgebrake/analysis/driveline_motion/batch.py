"""Many machines in sequence: the compiled loop of every sweep."""

import math

from numba import types

from wedgebrake.analysis.driveline_motion.driveline_passage import arrays_for
from wedgebrake.analysis.driveline_motion.evaluate_point import EMPTY, RESULT, Settings, evaluate
from wedgebrake.analysis.driveline_motion.part_tables import (
    ACTUATION,
    BRAKE,
    CHOICE,
    DRIVELINE,
    EXCITATION,
    Tables,
)
from wedgebrake.dynamics.actuator import Actuator
from wedgebrake.dynamics.assemble import DrivelineNumbers, assemble, workspace
from wedgebrake.dynamics.brake_torque import LAW
from wedgebrake.dynamics.enums import Outcome
from wedgebrake.dynamics.harmonic import Sine
from wedgebrake.dynamics.jit import array_of, compiled, compiled_for
from wedgebrake.dynamics.linear_flow import LinearDriveline
from wedgebrake.dynamics.problem import ANGLE, VELOCITY

# Rows of the log that are processed at once, so that they stay in the fastest cache.
ROWS = 256


@compiled
def _machine(tables, choice):
    """The machine of some rows of the tables."""
    line, brake = tables.driveline[choice.driveline], tables.brake[choice.brake]
    action, torque = tables.actuation[choice.actuation], tables.excitation[choice.excitation]
    return DrivelineNumbers(
        LinearDriveline(line.inertia, line.damping, line.stiffness, 0.0 - line.drive_speed),
        Sine(torque.amplitude, torque.angular_frequency),
        brake.radius,
        (brake.shape0, brake.shape1, brake.shape2, brake.shape3),
        tables.breakaway[choice.friction],
        tables.speeds[choice.friction],
        tables.kinetic[choice.friction],
        Actuator(action.initial_force, action.slope, action.release != 0.0),
    )


def _run(law, tables, choices, states, follow, settings, divergence_factor, results, record):
    """Evaluate every point of a batch, in order.

    law     : g(m, shape) of the brakes, compiled
    choices : (points,) of dtype ``CHOICE``
    states  : (points, 2) angle and velocity at t = 0
    follow  : each point starts at the final state of the previous point, if that was completed
    divergence_factor : of ``assemble``
    results : (points,) of dtype ``RESULT``
    record  : (points, periods + 1, 2) receives the Poincare points that are reached;
              no rows: not recorded
    """
    work = workspace(tables.speeds.shape[1])
    arrays = arrays_for(settings, ROWS)
    angle, velocity = 0.0, 0.0
    for i in range(choices.size):
        results[i] = EMPTY[0]
        result = results[i]
        machine = _machine(tables, choices[i])
        parts = machine.driveline.inertia + machine.radius + machine.breakaway
        if math.isnan(parts + machine.actuator.initial_force + machine.torque.amplitude):
            continue
        if not (follow and i > 0 and results[i - 1].outcome == Outcome.COMPLETED):
            angle, velocity = states[i, ANGLE], states[i, VELOCITY]
        problem = assemble(law, machine, angle, velocity, divergence_factor, work)
        begin, end = evaluate(problem, angle, velocity, settings, arrays, result)
        angle, velocity = result.final_angle, result.final_velocity
        for k in range(begin, end if i < record.shape[0] else begin):
            record[i, k - begin, ANGLE] = arrays.points[k, ANGLE]
            record[i, k - begin, VELOCITY] = arrays.points[k, VELOCITY]


def _signature():
    """One signature, so that the cache serves all brakes."""
    real, whole = types.float64, types.int64
    vector, matrix = types.Array(real, 1, "C"), types.Array(real, 2, "C")
    columns = (
        array_of(DRIVELINE), array_of(BRAKE), vector, matrix, matrix, array_of(ACTUATION),
        array_of(EXCITATION),
    )  # fmt: skip
    tables = types.NamedTuple(columns, Tables)
    settings = types.NamedUniTuple(whole, 4, Settings)
    return (
        LAW, tables, array_of(CHOICE), matrix, types.boolean, settings, real, array_of(RESULT),
        types.Array(real, 3, "C"),
    )  # fmt: skip


run = compiled_for(_signature())(_run)
