"""The scheme, with a fixed step and without events (Simulink's ODE14x), applied to a task.

What Simulink runs can be read in the code that it generates from a model
(``rt_ertODEUpdateContinuousStates``): extrapolation over 12, 8, 6 and 4 substeps, each seeing
the torque of its start. The harmonic sequence 1, 2, 3, 4 of Hairer and Wanner has the same
order, less work and errors a hundred times larger; the tests run both.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wedgebrake.dynamics.enums import Outcome
from wedgebrake.model.friction import CoulombFriction, SmoothFriction
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.model.validation import wrong
from wedgebrake.paper.fixed_step import kernel
from wedgebrake.solvers.event_driven.solve import driveline_numbers, torque_numbers
from wedgebrake.solvers.log_reader import logged, one_inertia, sticks_in_band
from wedgebrake.solvers.smooth.laws import Shape, brake_law, compiled_law, friction_law
from wedgebrake.solvers.solution import RecordedStates, Task, Trajectory
from wedgebrake.solvers.status import DIVERGED_FACTOR, Status

BAND = 1e-4
"""Epsilon of eq. (16) [rad/s]: half width of the band in which Coulomb friction holds."""

SUBSTEPS = (12, 8, 6, 4)
"""Substeps n_j of one step, as in Simulink's generated code."""

SEES_END = False
"""True if a substep sees the torque of its end; in Simulink's generated code, of its start."""

_FIRST_ROWS = 100_000


def solve(system: BrakedDriveline, task: Task) -> Trajectory:
    """Simulate with a fixed step as the paper does; see ``ode14x``.

    Extrapolated linearly implicit Euler of order 4 with one Newton iteration. The grid
    starts at the start time. Grid points are returned as computed; times between them, the
    Poincare section and the end by cubic Hermite interpolation, angle from (theta, theta')
    and velocity from (theta', theta''). Reversals and the ends of sticks are interpolated
    linearly in the sliding velocity. A stick is a passage through the band |v| <= 1e-4 rad/s
    (Coulomb) or |R v| <= friction.transition (smooth) that takes longer than 1 % of a torque
    period.

    Coulomb friction is banded, eqs. (16) to (20), with mu_k alone: mu_s has no part in it.
    Eq. (19) contains theta'', an algebraic loop as printed; it is read as Karnopp does, as
    the force F_s = (T - c theta' - k theta)/R that makes theta'' vanish. A step that changes
    the velocity by more than the band is wide may jump over the band and miss a stick, as
    the paper's solver does.

    The limits of the task are the step h [s] and the number of steps, max_steps.

    Raises ``InputError`` for friction other than smooth or Coulomb.
    """
    laws, hold, band = _laws(system)
    step, max_steps = task.limits["step"], task.limits["max_steps"]
    scheme = kernel.Scheme(
        driveline_numbers(system), torque_numbers(system), system.brake.radius,
        system.actuation.law, hold, band, DIVERGED_FACTOR * _speed_scale(system, task), step,
        np.array(SUBSTEPS), _turns(system.excitation.angular_frequency * step), max_steps,
    )  # fmt: skip
    first, rest = task.start
    periods = np.arange(first + (rest > 0.0), task.end[0] + 1)
    # The kernel takes one list of times: those wanted, the returns and the end.
    numbers, rests = task.clock.split(task.times)
    numbers = np.concatenate((numbers, periods, task.end[:1])) - first
    rests = np.concatenate((rests, np.zeros(periods.size), task.end[1:])) - rest
    elapsed = numbers * task.clock.period + rests
    end = float(elapsed[-1])
    # Far from t = 0 the first two carry rounding that must not put them beyond the last.
    merged = np.clip(elapsed, 0.0, end)
    order = np.argsort(merged, kind="stable")
    samples = np.empty(merged.size, dtype=kernel.SAMPLE)
    log, ended = logged(
        _FIRST_ROWS,
        lambda log: kernel.run(
            scheme, laws, rest, *task.state, end, log, merged[order], samples,
            task.stop,
        ),
    )  # fmt: skip
    done = np.empty(order.size, dtype=np.bool_)
    done[order], samples[order] = np.arange(order.size) < ended.samples, samples.copy()
    wanted, sections = slice(task.times.size), slice(task.times.size, -1)
    now, angle, velocity = ended.time, ended.angle, ended.velocity
    if done[-1]:
        now, angle, velocity = end, samples["angle"][-1], samples["velocity"][-1]
    stop = float(task.clock.join(*task.end if done[-1] else (first, rest + now)))
    # The last step may reach beyond the end; its crossings need not be in order.
    log = log[log["time"] <= now]
    log = log[np.argsort(log["time"], kind="stable")]
    log["period"], log["time"] = first, log["time"] + rest
    at, section = samples[wanted][done[wanted]], samples[sections][done[sections]]
    times = task.times[done[wanted]]
    states = (times, at["angle"].copy(), at["velocity"].copy(), at["brake_torque"].copy())
    answer = one_inertia(
        system, states, sticks_in_band(log, task.clock, stop), log,
        (stop, float(angle), float(velocity)),
        (Status.of(ended.outcome), _detail(ended.outcome, stop, step, hold), ended.steps),
        task.clock,
    )  # fmt: skip
    numbers = periods[done[sections]]
    at_periods = numbers / system.excitation.frequency
    recorded = RecordedStates(
        at_periods, *(section[name].copy()[:, None] for name in ("angle", "velocity"))
    )
    return replace(answer, periods=numbers, at_periods=recorded)


def _coulomb(speed: float, shape: Shape) -> float:
    """Signed kinetic coefficient; the sign of a zero speed counts."""
    return math.copysign(shape[0], speed)


def _laws(system: BrakedDriveline) -> tuple[tuple[Any, Shape, Any, Shape], float, float]:
    """The laws, half width of the band in which the law holds and of that which is logged."""
    friction = system.friction
    if isinstance(friction, SmoothFriction):
        band = friction.transition / system.brake.radius
        return (*friction_law(friction), *brake_law(system.brake)), 0.0, band
    if isinstance(friction, CoulombFriction):
        shape = (friction.kinetic, 0.0, 0.0, 0.0)
        return (compiled_law(_coulomb, len(shape)), shape, *brake_law(system.brake)), BAND, BAND
    raise wrong(
        "friction", friction, "SmoothedFriction, CustomFriction or CoulombFriction",
        "Or use wb.simulate, which takes any law.",
    )  # fmt: skip


def _turns(turn: float) -> NDArray[np.record]:
    """Phase of the torque that each substep sees, with ``turn`` the phase of one step."""
    share = [(m + SEES_END) / n for n in SUBSTEPS for m in range(n)]
    angles = turn * np.array(share)
    turns = np.empty(angles.size, dtype=kernel.TURN)
    turns["sine"], turns["cosine"] = np.sin(angles), np.cos(angles)
    return turns


def _speed_scale(system: BrakedDriveline, task: Task) -> float:
    """A velocity [rad/s] that the motion has where nothing grows."""
    line, force, release = system.driveline, system.actuation, system.actuation.release_speed
    mu, (angle, velocity) = system.friction.reference, task.state
    gains = [abs(system.brake.amplification(m)) for m in (-mu, mu)]
    held = system.brake.radius * force.law.initial_force * max(filter(math.isfinite, gains))
    push = system.excitation.amplitude + held
    fastest = max(line.natural_frequency, system.excitation.angular_frequency)
    scale = abs(velocity) + line.natural_frequency * abs(angle) + abs(line.constant_speed)
    scale += push / (line.inertia * fastest) + (release if math.isfinite(release) else 0.0)
    return scale if scale > 0.0 else 1.0


def _detail(outcome: int, end: float, step: float, hold: float) -> str:
    if outcome == Outcome.DIVERGED:
        return f"Diverged at t = {end:.6g} s."
    if outcome == Outcome.NO_FORWARD_SOLUTION:
        method = "exact" if hold else "smooth"
        return (
            f"A step of {step:g} s led to sliding that has no solution, at t = {end:.6g} s;"
            f" wb.simulate with method {method!r} does not step over the point where this begins."
        )
    return f"Stopped at t = {end:.6g} s." if outcome == Outcome.STEP_LIMIT else ""
