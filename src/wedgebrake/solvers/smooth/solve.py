"""Adaptive solution with a smooth friction law, split at its kinks."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import DOP853

from wedgebrake.dynamics import linear_flow
from wedgebrake.dynamics.enums import Outcome
from wedgebrake.dynamics.harmonic import Harmonic
from wedgebrake.dynamics.segment_log import empty_log
from wedgebrake.model.brakes import Brake, LeverBrake
from wedgebrake.model.friction import SmoothedFriction, SmoothFriction
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.solvers.log_reader import Log, events_of, returns_of, sticks_in_band, within
from wedgebrake.solvers.smooth import runge_kutta, torque_along
from wedgebrake.solvers.smooth import trajectory as kernel
from wedgebrake.solvers.smooth.laws import Shape, brake_law, friction_law, gathered
from wedgebrake.solvers.solution import FloatArray, Task, Trajectory
from wedgebrake.solvers.status import DIVERGED_FACTOR, Status

# The law counts as constant, and is then solved in closed form, where its torque differs by
# less than this share of rtol.
_SATURATION = 1e-2
# Near rest the speed's tolerance is at most this share of the steep layer: a motion that is
# allowed to jump to and fro across the layer is none.
_BAND_SHARE = 1e-2

# Number of speeds at which the brake is checked for self-locking.
_LOOKS = 200


class _Stretch(NamedTuple):
    """A stretch of speeds |v| of one direction; linear ones have torque offset + slope |v|."""

    start: float
    linear: bool
    offset: float
    slope: float


Laws = tuple[Any, Shape, Any, Shape]
Numbers = tuple[float, float, float, bool]


class Problem(NamedTuple):
    """A system as the kernel takes it, in the order of its arguments."""

    plant: tuple[float, float, float, float, float, float]
    pair: tuple[Laws, Numbers, tuple[FloatArray, ...], FloatArray] | None
    series: tuple[float, ...] | None
    edges: FloatArray
    kinks: FloatArray
    linear: NDArray[np.bool_]
    table: FloatArray
    rest_edge: int
    band: float
    w_diverged: float
    tolerances: tuple[float, float, float]
    h_max: float


def problem(
    system: BrakedDriveline,
    rtol: float,
    angle: float = 0.0,
    velocity: float = 0.0,
    *,
    any_law: bool = False,
) -> Problem:
    """The kernel's arguments for a system, a tolerance and an initial state.

    any_law : Runge-Kutta steps where series would do. Their derivative is that of the computed
              map itself, not of the true one: what Newton's method wants.
    """
    line, torque = system.driveline, system.excitation
    friction = system.friction
    assert isinstance(friction, SmoothFriction)  # noqa: S101 - the front door has checked it
    halves = {side: _stretches(system, friction, rtol, side) for side in (-1.0, 1.0)}
    backward, forward = halves[-1.0], halves[1.0]
    cuts = [-piece.start for piece in reversed(backward[1:])] + [p.start for p in forward]
    ordered = [*reversed(backward), *forward]
    signs = np.repeat([-1.0, 1.0], [len(backward), len(forward)])
    slopes = signs * np.array([piece.slope for piece in ordered])
    offsets = np.array([piece.offset for piece in ordered]) + slopes * line.drive_speed
    omega = torque.angular_frequency
    plant = (line.inertia, line.damping, line.stiffness, torque.amplitude, omega)
    driveline = linear_flow.Driveline(*plant[:3], 0.0 - line.drive_speed)
    fastest = max(line.natural_frequency, omega)
    finite = offsets[np.isfinite(offsets)]
    push = torque.amplitude + float(np.max(np.abs(finite))) + _held(system)
    speed = push / (line.inertia * fastest)
    band = friction.transition / system.brake.radius
    series = None if any_law else _series(system, friction)
    largest = abs(velocity) + line.natural_frequency * abs(angle) + abs(line.drive_speed)
    return Problem(
        plant=(*plant, 0.0 - line.drive_speed),
        pair=None if series else _pair(system),
        series=series,
        edges=np.array(cuts) - line.drive_speed,
        kinks=_kinks(system, np.array(cuts)),
        linear=np.array([piece.linear for piece in ordered]),
        table=linear_flow.pieces_of(driveline, Harmonic(*plant[3:]), slopes, offsets),
        rest_edge=len(backward) - 1,
        band=band,
        w_diverged=DIVERGED_FACTOR * (speed + largest + max(cuts) + 1e-300),
        tolerances=(rtol, speed / fastest + 1e-300, min(speed, _BAND_SHARE * band / rtol) + 1e-300),
        h_max=2.0 / fastest,
    )


def _series(system: BrakedDriveline, friction: SmoothFriction) -> tuple[float, ...] | None:
    """The numbers of ``taylor``, where a law has a series: mu tanh, g a fraction."""
    brake, force = system.brake, system.actuation
    if not isinstance(friction, SmoothedFriction) or not isinstance(brake, LeverBrake):
        return None
    if friction.static != friction.kinetic or friction.kinetic == 0.0:
        return None
    arms = brake.shape()
    if not min(arms[:2]) > 0.0 or brake.locks(friction.kinetic) or brake.locks(-friction.kinetic):
        return None
    kappa = friction.steepness * brake.radius
    law = (kappa, friction.kinetic, *arms, brake.radius, force.initial_force, force.slope)
    return tuple(float(number) for number in law)


def _pair(system: BrakedDriveline) -> tuple[Laws, Numbers, tuple[FloatArray, ...], FloatArray]:
    """Data of Runge-Kutta steps, see the kernel."""
    friction = system.friction
    assert isinstance(friction, SmoothFriction)  # noqa: S101 - checked by ``simulate``
    places = [(0.0, friction.transition), *friction.narrow_places]
    both = {(side * speed, width) for speed, width in places for side in (-1.0, 1.0)}
    poles = np.array(sorted(both)) / system.brake.radius
    poles[:, 0] -= system.driveline.drive_speed
    poles[:, 1] *= kernel.POLE
    return _laws(system), _numbers(system), _tableau(), poles


def _laws(system: BrakedDriveline) -> Laws:
    return (*friction_law(system.friction), *brake_law(system.brake))  # type: ignore[arg-type]


def _numbers(system: BrakedDriveline) -> Numbers:
    force = system.actuation
    return system.brake.radius, force.initial_force, force.slope, force.release


def _kinks(system: BrakedDriveline, cuts: FloatArray) -> FloatArray:
    """The nearest kinks of the law below and above each stretch, over theta' [rad/s]."""
    release = system.actuation.release_speed
    bends = np.unique([-math.inf, -release, 0.0, release, math.inf])
    middles = np.concatenate(([cuts[0] - 1.0], 0.5 * (cuts[1:] + cuts[:-1]), [cuts[-1] + 1.0]))
    above = np.searchsorted(bends, middles)
    pairs = np.column_stack((bends[above - 1], bends[above]))
    return np.ascontiguousarray(pairs - system.driveline.drive_speed)


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
    pieces = [_Stretch(0.0, False, 0.0, 0.0)]
    if layer < far:
        pieces.append(_Stretch(layer, False, 0.0, 0.0))
    if math.isfinite(far):
        gain = radius * brake.amplification(side * friction.limit)
        if math.isfinite(gain):
            line = (gain * force.initial_force, gain * force.slope)
        else:
            line = (math.inf, 0.0)
        pieces.append(_Stretch(far, True, *line))
    if math.isfinite(release):
        pieces = [piece for piece in pieces if piece.start < release]
        pieces.append(_Stretch(release, True, 0.0, 0.0))
    return pieces


def _sensitivity(brake: Brake, m: float) -> float:
    """Relative change of the amplification for a relative change of m, at least 1."""
    if math.isnan(m) or m == 0.0:
        return 1.0
    near, here = brake.amplification(m * (1.0 - 1e-6)), brake.amplification(m)
    if math.isinf(here) or math.isinf(near):
        return 1.0
    return max(1.0, abs(here - near) / (1e-6 * abs(here)))


@cache
def _tableau() -> tuple[FloatArray, ...]:
    """Coefficients of the Dormand-Prince 8(5,3) pair, from SciPy, as the kernel takes them."""
    given = (
        runge_kutta.columns(DOP853.A, DOP853.B, DOP853.C, DOP853.E3[:-1], DOP853.E5[:-1]), DOP853.C,
        DOP853.A_EXTRA, DOP853.C_EXTRA, DOP853.D, runge_kutta.bernstein_matrix(),
    )  # fmt: skip
    return tuple(np.ascontiguousarray(array, dtype=float) for array in given)


def solve(system: BrakedDriveline, task: Task, *, rtol: float, max_steps: int) -> Trajectory:
    """Simulate a system with a smooth friction law."""
    caught = winds_for_ever(system, task.velocity)
    if caught:
        seen_at_start = task.times[task.times <= task.clock.join(*task.start)]
        task = replace(task, end=task.start, times=seen_at_start)
    given = problem(system, rtol, task.angle, task.velocity)
    number, rest = task.clock.split(task.times)
    seen = np.empty((task.times.size, 2))
    log, outcome, final, steps, reached = _run(given, task, max_steps, number, rest, seen)
    end = float(task.clock.join(*final[:2]))
    times = task.times[:reached]
    angle, velocity = seen[:reached, 0].copy(), seen[:reached, 1].copy()
    speed = velocity + system.driveline.drive_speed
    sticks = sticks_in_band(log, task.clock, end)
    return Trajectory(
        times=times,
        angle=angle,
        velocity=velocity,
        brake_torque=torque_at(system, speed),
        sticking=within(times, sticks),
        returns=returns_of(log),
        events=events_of(log, task.clock, end),
        sticks=sticks,
        status=Status.of(Outcome.NO_FORWARD_SOLUTION if caught else outcome),
        final=(end, final[2], final[3]),
        detail=(
            f"From t = {end:.6g} s on it cannot pass the speed at which the brake locks, while the"
            " turning shaft winds up the spring without limit."
            if caught
            else ""
            if outcome == Outcome.COMPLETED
            else f"Stopped at t = {end:.6g} s."
        ),
        work=steps,
    )


def winds_for_ever(system: BrakedDriveline, velocity: float) -> bool:
    """Return True if the brake locks at a speed between that of the start and that of the shaft.

    Sliding cannot pass a speed at which the friction force is infinite, so that the turning shaft
    winds up the spring without limit.
    """
    line, brake = system.driveline, system.brake
    drive = line.drive_speed
    if drive == 0.0 or line.stiffness == 0.0:
        return False
    sliding = math.copysign(1.0, drive) * (velocity + drive)
    if sliding >= abs(drive):
        return False

    def locks(speed: float) -> bool:
        assert isinstance(system.friction, SmoothFriction)  # noqa: S101 - smooth
        return brake.locks(system.friction.coefficient(math.copysign(brake.radius * speed, drive)))

    # More closely spaced in the steep part of the law, where friction rises.
    steep = system.friction.transition / brake.radius  # type: ignore[attr-defined]
    speeds = np.concatenate((np.geomspace(1e-3, 1e2, _LOOKS) * steep, np.linspace(0, 1, _LOOKS)))
    speeds[_LOOKS:] *= abs(drive)
    return any(locks(float(one)) for one in speeds if max(sliding, 0.0) < one < abs(drive))


def _run(
    given: Problem,
    task: Task,
    max_steps: int,
    number: NDArray[np.int64],
    rest: FloatArray,
    seen: FloatArray,
) -> tuple[Log, int, tuple[int, float, float, float], int, int]:
    """Run the kernel, with more room for the log whenever it fills up."""
    rows = 64 + 24 * max(1, task.end[0] - task.start[0] + 1)
    work = np.empty((kernel.SCRATCH_ROWS, runge_kutta.SUMS))
    no_trail = np.empty((0, kernel.TRAIL_COLUMNS))
    run = kernel.run if given.pair is None else kernel.run_pair()
    while True:
        log = empty_log(rows)
        outcome, *final, steps, used, reached, _ = run(
            *given, *task.start, task.angle, task.velocity, *task.end, max_steps, log,
            number, rest, seen, work, no_trail, task.stop,
        )  # fmt: skip
        if outcome != Outcome.LOG_FULL:
            state = (final[0], final[1], final[2], final[3])
            return log[:used].copy(), outcome, state, steps, reached
        rows *= 4


def torque_at(system: BrakedDriveline, speed: FloatArray) -> FloatArray:
    """R F_mu [N m] at sliding velocities (n,) [rad/s]."""
    torque = np.empty(speed.size)
    friction, friction_shape, brake, brake_shape = _laws(system)
    laws = gathered(friction, brake), (friction_shape, brake_shape)
    torque_along.torques(*laws, *_numbers(system), np.ascontiguousarray(speed), torque)
    return torque
