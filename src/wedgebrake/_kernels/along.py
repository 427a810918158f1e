"""Brake torque of a smooth law along a motion."""

from numba import types

from .compiling import compiled_for
from .torque import LAW, SHAPE, brake_torque


def _torques(
    friction, friction_shape, brake, brake_shape, radius, initial_force, slope, release, v, out
):  # fmt: skip
    """``brake_torque`` at each of the sliding velocities ``v`` [rad/s], into ``out`` [N m]."""
    for i in range(v.size):
        out[i] = brake_torque(
            friction, friction_shape, brake, brake_shape, radius, initial_force, slope, release,
            v[i],
        )  # fmt: skip


def _signature():
    """The one signature of ``torques``: laws as function pointers, so that its cache serves all."""
    real = types.float64
    vector = types.Array(real, 1, "C")
    return (LAW, SHAPE, LAW, SHAPE, real, real, real, types.boolean, vector, vector)


torques = compiled_for(_signature())(_torques)
