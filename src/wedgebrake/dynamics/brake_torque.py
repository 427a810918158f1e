"""Brake torque of any smooth law: friction and brake come as compiled functions.

Both are passed as first-class functions of one fixed type, so that a kernel is compiled
and cached once for all laws.
"""

from functools import cache

from numba import typed, types

from wedgebrake.dynamics.jit import compiled, compiled_for

# A law's parameters: four numbers, the unused ones zero. A tuple, because arrays would be
# reference-counted at every call.
SHAPE_SIZE = 4
SHAPE = types.UniTuple(types.float64, SHAPE_SIZE)
LAW_SIGNATURE = types.float64(types.float64, SHAPE)
LAW = types.FunctionType(LAW_SIGNATURE)
LAWS = types.ListType(LAW)
SHAPES = types.UniTuple(SHAPE, 2)


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


def _gather(friction, brake):
    pair = typed.List.empty_list(LAW)
    pair.append(friction)
    pair.append(brake)
    return pair


@cache
def gather():
    """Two laws as a list: to pass a function costs more than a period to solve.

    Compiled when first asked for.
    """
    return compiled_for((LAW, LAW))(_gather)
