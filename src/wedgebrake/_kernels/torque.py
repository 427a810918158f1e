"""Brake torque of any smooth law: friction and brake come as compiled functions.

Both are passed as first-class functions of one fixed type, so that a kernel is compiled
and cached once for all laws.
"""

from numba import types

from .compiling import compiled

# A law's parameters: four numbers, the unused ones zero. A tuple, because arrays would be
# reference-counted at every call.
SHAPE_SIZE = 4
SHAPE = types.UniTuple(types.float64, SHAPE_SIZE)
LAW_SIGNATURE = types.float64(types.float64, SHAPE)
LAW = types.FunctionType(LAW_SIGNATURE)


@compiled
def brake_torque(
    friction, friction_shape, brake, brake_shape, radius, initial_force, slope, release, v
):
    """R F_a(|v|) g(m(R v)) at the sliding velocity v [N m]  (eqs. 3, 5, 14, 15).

    Zero where nothing presses; infinite at and beyond the wall of a self-locking brake.
    """
    force = initial_force + slope * abs(v)
    if force == 0.0 or (release and force < 0.0):
        return 0.0
    return radius * force * brake(friction(radius * v, friction_shape), brake_shape)
