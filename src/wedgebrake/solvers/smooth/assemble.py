"""From a system with smooth friction to the arguments of the kernels."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from wedgebrake.arrays import FloatArray
from wedgebrake.dynamics.harmonic import Sine
from wedgebrake.dynamics.linear_flow import LinearDriveline, pieces_of
from wedgebrake.model.brakes import Brake, LeverBrake
from wedgebrake.model.friction import SmoothedFriction, SmoothFriction
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.solvers.smooth.laws import brake_law, friction_law, gathered
from wedgebrake.solvers.smooth.problem import (
    POLE,
    STRETCH,
    AnyLaw,
    LawNumbers,
    SmoothAssembled,
    SmoothProblem,
    TanhLaw,
    Tolerances,
)
from wedgebrake.solvers.status import DIVERGED_FACTOR

# The law counts as constant, and is then solved in closed form, where its torque differs by
# less than this share of rtol.
_SATURATION = 1e-2
# Near rest the speed's tolerance is at most this share of the steep layer: a motion that may
# jump back and forth across the layer is no solution.
_BAND_SHARE = 1e-2
# What keeps a scale from being 0.
_LEAST = 1e-300


class _Stretch(NamedTuple):
    """A stretch of speeds |v| of one direction; linear ones have torque offset + slope |v|."""

    start: float
    linear: bool = False
    offset: float = 0.0
    slope: float = 0.0


def problem(
    system: BrakedDriveline,
    rtol: float,
    angle: float = 0.0,
    velocity: float = 0.0,
    *,
    any_law: bool = False,
) -> SmoothAssembled:
    """The kernels' arguments for a system, a tolerance and an initial state.

    any_law : Runge-Kutta steps also where there are series. Their derivative is that of the
              computed map itself, not of the exact one: Newton's method needs that.
    """
    line, friction = system.driveline, smooth_friction(system)
    driveline = LinearDriveline(
        line.inertia, line.damping, line.stiffness, 0.0 - line.constant_speed
    )
    torque = Sine(system.excitation.amplitude, system.excitation.angular_frequency)
    backward, forward = (_stretches(system, friction, rtol, side) for side in (-1.0, 1.0))
    cuts = np.array([-one.start for one in reversed(backward[1:])] + [one.start for one in forward])
    _, linear, offsets, slopes = np.array([*reversed(backward), *forward]).T
    slopes = slopes * np.repeat([-1.0, 1.0], [len(backward), len(forward)])
    offsets = offsets + slopes * line.constant_speed
    fastest = max(line.natural_frequency, torque.angular_frequency)
    # Torque of the brake near rest; a locking brake gives none.
    gain = system.brake.radius * system.brake.amplification(-friction.reference)
    held = abs(gain * system.actuation.law.initial_force)
    push = torque.amplitude + float(np.max(np.abs(offsets[np.isfinite(offsets)]))) + held
    speed = push / (line.inertia * fastest)
    band = friction.transition / system.brake.radius
    tanh_law = None if any_law else _tanh_law(system, friction)
    largest = abs(velocity) + line.natural_frequency * abs(angle) + abs(line.constant_speed)
    given = SmoothProblem(
        driveline=driveline,
        torque=torque,
        law=tanh_law or _any_law(system, friction),
        stretches=_cut(system, cuts, linear),
        pieces=pieces_of(driveline, torque, slopes, offsets),
        band=band,
        divergence_velocity=DIVERGED_FACTOR * (speed + largest + float(cuts.max()) + _LEAST),
        tolerances=Tolerances(
            rtol, speed / fastest + _LEAST, min(speed, _BAND_SHARE * band / rtol) + _LEAST
        ),
        longest_step=2.0 / fastest,
    )
    return SmoothAssembled(None if tanh_law else laws(system)[0], given)


def smooth_friction(system: BrakedDriveline) -> SmoothFriction:
    """The friction of a system whose solver's front door has checked that it is smooth."""
    assert isinstance(system.friction, SmoothFriction)  # noqa: S101 - checked by ``simulate``
    return system.friction


def laws(system: BrakedDriveline) -> tuple[Any, LawNumbers]:
    """Functions and numbers of friction and brake."""
    friction, friction_shape = friction_law(smooth_friction(system))
    brake, brake_shape = brake_law(system.brake)
    radius = float(system.brake.radius)
    numbers = LawNumbers(friction_shape, brake_shape, radius, system.actuation.law)
    return gathered(friction, brake), numbers


def _tanh_law(system: BrakedDriveline, friction: SmoothFriction) -> TanhLaw | None:
    """The numbers of ``taylor``, where a law has a series: mu tanh, g a fraction."""
    brake = system.brake
    if type(friction) is not SmoothedFriction or not isinstance(brake, LeverBrake):
        return None
    if friction.static != friction.kinetic or friction.kinetic == 0.0:
        return None
    a, b, d = (float(arm) for arm in brake.shape())
    if not min(a, b) > 0.0 or brake.locks(friction.kinetic) or brake.locks(-friction.kinetic):
        return None
    steepness, radius = float(friction.steepness * brake.radius), float(brake.radius)
    return TanhLaw(steepness, float(friction.kinetic), a, b, d, radius, system.actuation.law)


def _any_law(system: BrakedDriveline, friction: SmoothFriction) -> AnyLaw:
    """Data of Runge-Kutta steps."""
    places = [(0.0, friction.transition), *friction.narrow_places]
    both = {(side * speed, width) for speed, width in places for side in (-1.0, 1.0)}
    poles = np.array(sorted(both)) / system.brake.radius
    poles[:, 0] -= system.driveline.constant_speed
    poles[:, 1] *= POLE
    return AnyLaw(laws(system)[1], poles)


def _cut(
    system: BrakedDriveline, cuts: FloatArray, linear: FloatArray
) -> np.ndarray[tuple[int], np.dtype[np.record]]:
    """The stretches between ``cuts`` of the sliding velocity, with their kinks."""
    release, drive = system.actuation.release_speed, system.driveline.constant_speed
    bends = np.unique([-math.inf, -release, 0.0, release, math.inf])
    middles = np.concatenate(([cuts[0] - 1.0], 0.5 * (cuts[1:] + cuts[:-1]), [cuts[-1] + 1.0]))
    above = np.searchsorted(bends, middles)
    stretches = np.empty(middles.size, dtype=STRETCH)
    stretches["low"] = np.append(-math.inf, cuts) - drive
    stretches["high"] = np.append(cuts, math.inf) - drive
    stretches["kink_below"] = bends[above - 1] - drive
    stretches["kink_above"] = bends[above] - drive
    stretches["linear"] = linear
    return stretches


def _stretches(
    system: BrakedDriveline, friction: SmoothFriction, rtol: float, side: float
) -> list[_Stretch]:
    """The speeds of one direction from zero on: steep layer, static peak, constant, released."""
    radius, force, brake = system.brake.radius, system.actuation, system.brake
    release = force.release_speed
    tolerance = _SATURATION * rtol / _sensitivity(brake, side * friction.limit)
    layer = friction.layer(tolerance) / radius
    far = friction.saturation(tolerance) / radius
    found = [_Stretch(0.0)]
    if layer < far:
        found.append(_Stretch(layer))
    if math.isfinite(far):
        gain = radius * brake.amplification(side * friction.limit)
        constant = (gain * force.law.initial_force, gain * force.slope)
        found.append(_Stretch(far, True, *(constant if math.isfinite(gain) else (math.inf, 0.0))))
    if math.isfinite(release):
        found = [one for one in found if one.start < release]
        found.append(_Stretch(release, True))
    return found


def _sensitivity(brake: Brake, m: float) -> float:
    """Relative change of the amplification for a relative change of m, at least 1."""
    if math.isnan(m) or m == 0.0:
        return 1.0
    near, here = brake.amplification(m * (1.0 - 1e-6)), brake.amplification(m)
    if math.isinf(here) or math.isinf(near):
        return 1.0
    return max(1.0, abs(here - near) / (1e-6 * abs(here)))
