"""Brake torque of a smooth law along a motion."""

from numba import types

from .compiling import compiled_for
from .torque import LAWS, SHAPES, brake_torque


def _torques(laws, shapes, radius, initial_force, slope, release, v, out):
    """``brake_torque`` at each of the sliding velocities ``v`` [rad/s], into ``out`` [N m].

    laws : of friction and brake, as ``torque.gather`` gives them
    """
    friction, brake = laws[0], laws[1]
    for i in range(v.size):
        out[i] = brake_torque(
            friction, shapes[0], brake, shapes[1], radius, initial_force, slope, release, v[i]
        )


def _signature():
    """The one signature of ``torques``: laws as function pointers, so that its cache serves all."""
    real = types.float64
    vector = types.Array(real, 1, "C")
    return (LAWS, SHAPES, real, real, real, types.boolean, vector, vector)


torques = compiled_for(_signature())(_torques)
