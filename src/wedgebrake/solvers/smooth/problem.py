"""A machine with smooth friction as the kernels of this folder take it."""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wedgebrake.dynamics.actuator import Actuator
from wedgebrake.dynamics.brake_torque import SmoothBrake, brake_torque
from wedgebrake.dynamics.harmonic import Sine
from wedgebrake.dynamics.jit import compiled
from wedgebrake.dynamics.linear_flow import LinearDriveline
from wedgebrake.dynamics.records import record

# A stretch of the velocity axis [rad/s]: its ends, the nearest kinks of the law below and above it,
# and whether the torque is linear there.
STRETCH = record("low high kink_below kink_above", fields=[("linear", np.bool_)])

# Distance of the poles of tanh(v/band) from the real axis, over the band.
POLE = 0.5 * math.pi


class LawNumbers(NamedTuple):
    """Numbers of friction and brake; their functions m and g are passed beside, in a list."""

    friction_shape: tuple[float, ...]
    amplification_shape: tuple[float, ...]
    radius: float
    actuator: Actuator


class AnyLaw(NamedTuple):
    """Data of Runge-Kutta steps, for any law.

    poles : (n, 2) velocity of each pole of the law and its distance from the real axis
    """

    numbers: LawNumbers
    poles: NDArray[np.float64]


class TanhLaw(NamedTuple):
    """Data of steps by series: m = kinetic tanh(steepness v) and g = a m/(b - m d)."""

    steepness: float
    kinetic: float
    a: float
    b: float
    d: float
    radius: float
    actuator: Actuator


class Tolerances(NamedTuple):
    """Relative tolerance, and scales [rad], [rad/s] that make absolute ones of it."""

    relative: float
    angle: float
    velocity: float


class SmoothProblem(NamedTuple):
    """A machine with smooth friction.

    law                 : decides by which steps the motion is computed
    stretches           : (n,) of dtype ``STRETCH``, ascending
    pieces              : (n,) of dtype ``linear_flow.PIECE``, valid where a stretch is linear
    band                : half width of the stick band about zero sliding velocity [rad/s]
    divergence_velocity : sliding velocity past which growth is called divergence [rad/s]
    longest_step        : [s]
    """

    driveline: LinearDriveline
    torque: Sine
    law: TanhLaw | AnyLaw
    stretches: NDArray[np.record]
    pieces: NDArray[np.record]
    band: float
    divergence_velocity: float
    tolerances: Tolerances
    longest_step: float


class SmoothAssembled(NamedTuple):
    """A machine with smooth friction, as Python keeps it.

    functions : m and g compiled, in a list; None where no step asks them. A list, and apart from
                the numbers: in a tuple they cost more to pass than a period to compute, and
                kernels would be compiled again for each of them.
    """

    functions: Any
    problem: SmoothProblem


class Samples(NamedTuple):
    """Times at which the state is wanted, ascending, and room for it.

    period, time : (n,) number of returns and time since the last one [s]
    state        : (n, 2) receives angle and velocity
    """

    period: NDArray[np.int64]
    time: NDArray[np.float64]
    state: NDArray[np.float64]


@compiled
def joined(functions, numbers):
    """``SmoothBrake`` of functions in a list, and their ``LawNumbers``."""
    return SmoothBrake(
        functions[0], numbers.friction_shape, functions[1], numbers.amplification_shape,
        numbers.radius, numbers.actuator,
    )  # fmt: skip


@compiled
def stretch_at(stretches, velocity, rising):
    """Index of the stretch that holds a velocity; on an edge, of the one that is entered."""
    index = 0
    while index < stretches.size - 1:
        high = stretches[index].high
        if velocity < high or (velocity == high and not rising):
            break
        index += 1
    return index


@compiled
def torques(functions, numbers, v, out):
    """Store the brake torque [N m] at sliding velocities ``v`` (n,) [rad/s] in ``out``."""
    brake = joined(functions, numbers)
    for i in range(v.size):
        out[i] = brake_torque(brake, v[i])
