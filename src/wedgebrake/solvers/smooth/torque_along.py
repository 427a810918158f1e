"""Brake torque of a smooth law at many sliding velocities."""

from numba import types

from wedgebrake.dynamics.brake_torque import LAWS, SHAPES, brake_torque, smooth_brake
from wedgebrake.dynamics.jit import compiled_for


def _torques(laws, shapes, radius, initial_force, slope, release, v, out):
    """``brake_torque`` at each of the sliding velocities ``v`` [rad/s], into ``out`` [N m].

    laws : of friction and brake, as ``torque.gather`` gives them
    """
    functions = (laws[0], shapes[0], laws[1], shapes[1])
    brake = smooth_brake(functions, (radius, initial_force, slope, release))
    for i in range(v.size):
        out[i] = brake_torque(brake, v[i])


def _signature():
    """The one signature of ``torques``: laws as function pointers, so that its cache serves all."""
    real = types.float64
    vector = types.Array(real, 1, "C")
    return (LAWS, SHAPES, real, real, real, types.boolean, vector, vector)


torques = compiled_for(_signature())(_torques)
