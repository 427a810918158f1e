"""From a system with smooth friction to the arguments of the kernels."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from wedgebrake.dynamics.actuator import Actuator
from wedgebrake.dynamics.harmonic import Harmonic
from wedgebrake.dynamics.linear_flow import Driveline, pieces_of
from wedgebrake.model.brakes import Brake, LeverBrake
from wedgebrake.model.friction import SmoothedFriction, SmoothFriction
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.solvers.smooth.laws import brake_law, friction_law, gathered
from wedgebrake.solvers.smooth.problem import (
    POLE,
    STRETCH,
    AnyLaw,
    Assembled,
    LawNumbers,
    SmoothProblem,
    TanhLaw,
    Tolerances,
)
from wedgebrake.solvers.solution import FloatArray
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
) -> Assembled:
    """The kernels' arguments for a system, a tolerance and an initial state.

    any_law : Runge-Kutta steps also where there are series. Their derivative is that of the
              computed map itself, not of the exact one: Newton's method needs that.
    """
    line, friction = system.driveline, smooth_friction(system)
    driveline = Driveline(line.inertia, line.damping, line.stiffness, 0.0 - line.drive_speed)
    torque = Harmonic(system.excitation.amplitude, system.excitation.angular_frequency)
    backward, forward = (_stretches(system, friction, rtol, side) for side in (-1.0, 1.0))
    cuts = np.array([-one.start for one in reversed(backward[1:])] + [one.start for one in forward])
    ordered = [*reversed(backward), *forward]
    signs = np.repeat([-1.0, 1.0], [len(backward), len(forward)])
    slopes = signs * np.array([one.slope for one in ordered])
    offsets = np.array([one.offset for one in ordered]) + slopes * line.drive_speed
    fastest = max(line.natural_frequency, torque.angular_frequency)
    finite = offsets[np.isfinite(offsets)]
    push = torque.amplitude + float(np.max(np.abs(finite))) + _held(system)
    speed = push / (line.inertia * fastest)
    band = friction.transition / system.brake.radius
    tanh_law = None if any_law else _tanh_law(system, friction)
    largest = abs(velocity) + line.natural_frequency * abs(angle) + abs(line.drive_speed)
    given = SmoothProblem(
        driveline=driveline,
        torque=torque,
        law=tanh_law or _any_law(system, friction),
        stretches=_cut(system, cuts, [one.linear for one in ordered]),
        pieces=pieces_of(driveline, torque, slopes, offsets),
        band=band,
        divergence_velocity=DIVERGED_FACTOR * (speed + largest + float(cuts.max()) + _LEAST),
        tolerances=Tolerances(
            rtol, speed / fastest + _LEAST, min(speed, _BAND_SHARE * band / rtol) + _LEAST
        ),
        longest_step=2.0 / fastest,
    )
    return Assembled(None if tanh_law else laws(system)[0], given)


def smooth_friction(system: BrakedDriveline) -> SmoothFriction:
    """The friction of a system whose solver's front door has checked that it is smooth."""
    assert isinstance(system.friction, SmoothFriction)  # noqa: S101 - checked by ``simulate``
    return system.friction


def laws(system: BrakedDriveline) -> tuple[Any, LawNumbers]:
    """Functions and numbers of friction and brake."""
    friction, friction_shape = friction_law(smooth_friction(system))
    brake, brake_shape = brake_law(system.brake)
    radius = float(system.brake.radius)
    numbers = LawNumbers(friction_shape, brake_shape, radius, actuator(system))
    return gathered(friction, brake), numbers


def actuator(system: BrakedDriveline) -> Actuator:
    """The numbers of the actuation."""
    force = system.actuation
    return Actuator(float(force.initial_force), float(force.slope), bool(force.release))


def _tanh_law(system: BrakedDriveline, friction: SmoothFriction) -> TanhLaw | None:
    """The numbers of ``taylor``, where a law has a series: mu tanh, g a fraction."""
    brake = system.brake
    if not isinstance(friction, SmoothedFriction) or not isinstance(brake, LeverBrake):
        return None
    if friction.static != friction.kinetic or friction.kinetic == 0.0:
        return None
    a, b, d = (float(arm) for arm in brake.shape())
    if not min(a, b) > 0.0 or brake.locks(friction.kinetic) or brake.locks(-friction.kinetic):
        return None
    steepness = float(friction.steepness * brake.radius)
    return TanhLaw(
        steepness, float(friction.kinetic), a, b, d, float(brake.radius), actuator(system)
    )


def _any_law(system: BrakedDriveline, friction: SmoothFriction) -> AnyLaw:
    """Data of Runge-Kutta steps."""
    places = [(0.0, friction.transition), *friction.narrow_places]
    both = {(side * speed, width) for speed, width in places for side in (-1.0, 1.0)}
    poles = np.array(sorted(both)) / system.brake.radius
    poles[:, 0] -= system.driveline.drive_speed
    poles[:, 1] *= POLE
    return AnyLaw(laws(system)[1], poles)


def _cut(
    system: BrakedDriveline, cuts: FloatArray, linear: list[bool]
) -> np.ndarray[tuple[int], np.dtype[np.record]]:
    """The stretches between ``cuts`` of the sliding velocity, with their kinks."""
    release = system.actuation.release_speed
    bends = np.unique([-math.inf, -release, 0.0, release, math.inf])
    middles = np.concatenate(([cuts[0] - 1.0], 0.5 * (cuts[1:] + cuts[:-1]), [cuts[-1] + 1.0]))
    above = np.searchsorted(bends, middles)
    drive = system.driveline.drive_speed
    stretches = np.empty(middles.size, dtype=STRETCH)
    stretches["low"] = np.append(-math.inf, cuts) - drive
    stretches["high"] = np.append(cuts, math.inf) - drive
    stretches["kink_below"], stretches["kink_above"] = (
        bends[above - 1] - drive,
        bends[above] - drive,
    )
    stretches["linear"] = linear
    return stretches


def _held(system: BrakedDriveline) -> float:
    """A torque [N m] of the brake near rest, for scales; a locking brake gives none."""
    torque = system.brake.radius * system.actuation.initial_force
    gain = system.brake.amplification(-system.friction.reference)
    return abs(torque * gain)


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
        if math.isfinite(gain):
            found.append(_Stretch(far, True, gain * force.initial_force, gain * force.slope))
        else:
            found.append(_Stretch(far, True, math.inf))
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
