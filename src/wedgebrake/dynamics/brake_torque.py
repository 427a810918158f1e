"""Brake torque of any smooth law: friction and brake are compiled functions.

Both are passed as first-class functions of one fixed type, so that a kernel is compiled
and cached once for all laws.
"""

from typing import Any, NamedTuple

from numba import typed, types

from wedgebrake.dynamics import actuator
from wedgebrake.dynamics.actuator import Actuator
from wedgebrake.dynamics.jit import compiled, compiled_for

# Parameters of a law: four numbers, unused ones zero. A tuple, because arrays would be
# reference-counted at every call.
SHAPE_SIZE = 4
SHAPE = types.UniTuple(types.float64, SHAPE_SIZE)
LAW_SIGNATURE = types.float64(types.float64, SHAPE)
LAW = types.FunctionType(LAW_SIGNATURE)

actuator_force = compiled(actuator.force)


class SmoothBrake(NamedTuple):
    """A brake with any law of friction: m(v_r) and g(m) as functions, each with its parameters.

    Kernels receive the functions separately, since the types of functions in a named tuple from
    outside do not match a signature, and join them inside.
    """

    friction: Any
    friction_shape: tuple[float, ...]
    amplification: Any
    amplification_shape: tuple[float, ...]
    radius: float
    actuator: Actuator


ACTUATOR = types.NamedTuple((types.float64, types.float64, types.boolean), Actuator)


@compiled
def brake_torque(brake, v):
    """R F_a(|v|) g(m(R v)) at the sliding velocity v [N m]  (eqs. 3, 5, 14, 15).

    Zero without actuation; infinite at and beyond the wall of a self-locking brake.
    """
    force = actuator_force(brake.actuator, abs(v))
    if force == 0.0:
        return 0.0
    friction = brake.friction(brake.radius * v, brake.friction_shape)
    return brake.radius * force * brake.amplification(friction, brake.amplification_shape)


@compiled_for((LAW, LAW))
def gather(friction, brake):
    """Two laws as a list: passing a function takes longer than solving a period."""
    pair = typed.List.empty_list(LAW)
    pair.append(friction)
    pair.append(brake)
    return pair
