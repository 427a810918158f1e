"""The first event inside one linear piece, found safely and then to rounding; the end of rest."""

import math
from typing import NamedTuple

from wedgebrake.dynamics.enums import SearchEnd
from wedgebrake.dynamics.harmonic import (
    Phase,
    advanced,
    phase_at,
    second_rate,
    wait_above,
    wait_below,
)
from wedgebrake.dynamics.jit import compiled, inlined
from wedgebrake.dynamics.linear_flow import acceleration, enter, jerk, snap, state_at
from wedgebrake.dynamics.problem import torque_at_rest, torque_rate_at_rest
from wedgebrake.solvers.event_driven.root_exclusion import bound, safe_step


class MotionState(NamedTuple):
    """A motion at a time since the last return [s], with the phase of the torque there.

    The acceleration is carried along, not computed, because at the end of a stick it is known
    exactly where a difference would be rounding.
    """

    time: float
    phase: Phase
    angle: float
    velocity: float
    acceleration: float


class Found(NamedTuple):
    """End of a search: what ended it, the motion there, and evaluations spent."""

    end: SearchEnd
    motion: MotionState
    evaluations: int


class _Derivatives(NamedTuple):
    """Derivatives of the velocity: jerk, snap, and ``e = sqrt(snap^2 + stiffness jerk^2)``."""

    jerk: float
    snap: float
    energy: float


class _Bounds(NamedTuple):
    """Constants of a piece for ``root_exclusion``: its forcing, growth and fastest rate."""

    forcing: float
    growth: float
    rate: float
    noise: float


@inlined
def _departs(u, u1, u2, noise):
    """Return True if a state on (or, by rounding, beyond) a boundary leaves through it."""
    if u1 < -noise:
        return True
    return u1 <= noise and u2 < 0.0 and u <= 0.0


@inlined
def _is_simple(step, a, higher, bounds):
    """Return True if one simple root follows the safe step, near enough for a Taylor polynomial.

    Within a tenth of a radian of the fastest rate the ninth-order remainder is below
    rounding, and where the acceleration hardly changes there is no second root.
    """
    s_bound = bound(higher.energy, bounds.forcing, bounds.growth, step)
    turned = bounds.rate * step
    return turned <= 0.1 and (abs(higher.jerk) + s_bound * step) * step <= 0.25 * abs(a)


@compiled
def _polish(piece, forcing, target, motion, higher, step):
    """(time, angle) gained until the velocity is ``target``, by Newton on a Taylor polynomial.

    It is of eighth order in the velocity; ``step`` is the safe step to start from.
    """
    g2, w2, omega = piece.damping, piece.stiffness, forcing.angular_frequency
    w, a, j, s = motion.velocity, motion.acceleration, higher.jerk, higher.snap
    sine, cosine = motion.phase
    force = -forcing.amplitude * omega * omega * omega
    c4 = force * cosine - g2 * s - w2 * j
    force *= omega
    c5 = -force * sine - g2 * c4 - w2 * s
    force *= omega
    c6 = -force * cosine - g2 * c5 - w2 * c4
    force *= omega
    c7 = force * sine - g2 * c6 - w2 * c5
    force *= omega
    c8 = force * cosine - g2 * c7 - w2 * c6
    p2, p3, p4, p5 = j / 2.0, s / 6.0, c4 / 24.0, c5 / 120.0
    p6, p7, p8 = c6 / 720.0, c7 / 5040.0, c8 / 40320.0
    x = step
    gap = w - target
    for _ in range(3):
        value = p4 + x * (p5 + x * (p6 + x * (p7 + x * p8)))
        value = gap + x * (a + x * (p2 + x * (p3 + x * value)))
        slope = 5.0 * p5 + x * (6.0 * p6 + x * (7.0 * p7 + x * 8.0 * p8))
        slope = a + x * (2.0 * p2 + x * (3.0 * p3 + x * (4.0 * p4 + x * slope)))
        x -= value / slope
    x = max(x, 0.0)
    angle = p4 / 5.0 + x * (p5 / 6.0 + x * (p6 / 7.0 + x * (p7 / 8.0 + x * p8 / 9.0)))
    return x, x * (w + x * (a / 2.0 + x * (p2 / 3.0 + x * (p3 / 4.0 + x * angle))))


@inlined
def _safe(low, high, motion, higher, bounds, longest):
    """(step, end): a step without a root before its end, or one of length zero on a boundary.

    The end is a boundary where that is what limits the step, and TIME where nothing does.
    A negative step: the state leaves through the boundary at once.
    """
    w, a, j, e = motion.velocity, motion.acceleration, higher.jerk, higher.energy
    step, end = longest, SearchEnd.TIME
    # The boundary ahead first: its step makes the one behind a mere check.
    for order in range(2):
        if (order == 0) == (a < 0.0):
            if low > -math.inf:
                u = w - low
                if u <= 0.0 and _departs(u, a, j, bounds.noise):
                    return -1.0, SearchEnd.HIT_LOW
                d = safe_step(u, a, j, e, bounds.forcing, bounds.growth, step)
                if d < step:
                    step, end = d, SearchEnd.HIT_LOW
        elif high < math.inf:
            u = high - w
            if u <= 0.0 and _departs(u, -a, -j, bounds.noise):
                return -1.0, SearchEnd.HIT_HIGH
            d = safe_step(u, -a, -j, e, bounds.forcing, bounds.growth, step)
            if d < step:
                step, end = d, SearchEnd.HIT_HIGH
    return step, end


@inlined
def slip(piece, forcing, low, high, motion, t_end, work_limit):
    """Move inside a piece until the velocity leaves (low, high) or the time ``t_end`` comes.

    forcing    : torque over the inertia
    motion     : where to begin; its acceleration is taken as given
    work_limit : evaluations after which to give up, as in periods of very many vibrations

    On a hit the velocity found is the boundary itself.
    """
    omega, f = forcing.angular_frequency, forcing.amplitude
    t0 = motion.time
    entry = enter(piece, forcing, motion.angle, motion.velocity, motion.phase)
    bounds = _Bounds(
        f * omega * omega * omega, max(-piece.damping, 0.0),
        max(3.0 / piece.cell, abs(piece.damping)), piece.noise,
    )  # fmt: skip
    tick = 2.0**-52 * (t_end + 1.0 / omega)
    evaluations = 0
    while True:
        t, phase, theta, w, a = motion
        j = jerk(piece, forcing, w, a, phase)
        s = snap(piece, forcing, a, j, phase)
        higher = _Derivatives(j, s, math.sqrt(s * s + piece.stiffness * j * j))
        remaining = t_end - t
        step, end = _safe(low, high, motion, higher, bounds, min(piece.cell, remaining))
        boundary = low if end == SearchEnd.HIT_LOW else high
        if step < 0.0:
            return Found(end, MotionState(t, phase, theta, boundary, a), evaluations)
        if end != SearchEnd.TIME:
            if _is_simple(step, a, higher, bounds):
                gained, angle = _polish(piece, forcing, boundary, motion, higher, step)
                if gained <= remaining:
                    theta += angle
                    phase = advanced(phase, omega * gained)
                    a = acceleration(piece, forcing, theta, boundary, phase)
                    return Found(
                        end, MotionState(t + gained, phase, theta, boundary, a), evaluations
                    )
                step = remaining
            # Rounding must not stop the clock, nor a corner that the state rests in.
            step = max(step, 4.0 * tick)
            if abs(a) <= bounds.noise:
                step = max(step, 1e-7 * piece.cell)
            step = min(step, remaining)
        t = t + step if step < remaining else t_end
        phase = phase_at(forcing, t)
        theta, w = state_at(piece, forcing, entry, t - t0, phase)
        motion = MotionState(t, phase, theta, w, acceleration(piece, forcing, theta, w, phase))
        evaluations += 1
        if t >= t_end or not math.isfinite(w):
            return Found(SearchEnd.TIME, motion, evaluations)
        if evaluations >= work_limit:
            return Found(SearchEnd.WORK_LIMIT, motion, evaluations)


@compiled
def _at_constant_angle(driveline, torque, lower, upper, t, theta):
    """(end, time of breaking away) of rest at a constant angle, in closed form.

    The brake holds while T(t) - k theta is inside [lower, upper].
    """
    spring = driveline.stiffness * theta
    up = wait_above(torque, upper + spring, t)
    down = wait_below(torque, lower + spring, t)
    if up == math.inf and down == math.inf:
        return SearchEnd.TIME, math.inf
    if up <= down:
        return SearchEnd.HIT_HIGH, t + up
    return SearchEnd.HIT_LOW, t + down


@compiled
def _at_moving_angle(driveline, torque, lower, upper, start, t_end, theta):
    """(end, time of breaking away) of rest on a turning shaft, where the angle moves.

    The holding condition is lower <= T(t) - c w_rest - k theta(t) <= upper; its end is found
    with the same bound as an event of slip.
    """
    omega = torque.angular_frequency
    jerk_bound = torque.amplitude * omega**3
    tick = 2.0**-52 * (t_end + 1.0 / omega)
    t = start
    while t < t_end:
        phase = phase_at(torque, t)
        angle = theta + driveline.rest_velocity * (t - start)
        held = torque_at_rest(driveline, torque, phase, angle)
        rate = torque_rate_at_rest(driveline, torque, phase)
        second = second_rate(torque, phase)
        longest = min(1.0 / omega, t_end - t)
        step, end = longest, SearchEnd.TIME
        for side in (1.0, -1.0):
            gap = upper - held if side > 0.0 else held - lower
            hit = SearchEnd.HIT_HIGH if side > 0.0 else SearchEnd.HIT_LOW
            if gap == math.inf:
                continue
            if gap <= 0.0 and (side * rate > 0.0 or (rate == 0.0 and side * second > 0.0)):
                return hit, t
            d = safe_step(gap, -side * rate, -side * second, jerk_bound, 0.0, 0.0, longest)
            if d < step:
                step, end = d, hit
        if end != SearchEnd.TIME and step <= tick:
            return end, t + step
        t += max(step, tick)
    return SearchEnd.TIME, t_end


@compiled
def passes(rate, second, slack):
    """Return True if a torque at a limit goes on to exceed it by more than ``slack`` [N m].

    rate, second : first and second time derivative of the torque, positive: beyond the limit
    """
    return rate > 0.0 and rate * rate > -2.0 * second * slack


@compiled
def _end_of_rest(driveline, torque, lower, upper, motion, t_end):
    """(end, time) at which the torque leaves [lower, upper], or TIME and ``t_end``."""
    t, theta = motion.time, motion.angle
    if driveline.rest_velocity == 0.0:
        end, later = _at_constant_angle(driveline, torque, lower, upper, t, theta)
    else:
        end, later = _at_moving_angle(driveline, torque, lower, upper, t, t_end, theta)
    if end == SearchEnd.TIME or later > t_end:
        return SearchEnd.TIME, t_end
    return end, later


@compiled
def _rest_at(driveline, torque, motion, later):
    """Motion at a later time of rest."""
    angle = motion.angle + driveline.rest_velocity * (later - motion.time)
    return MotionState(later, phase_at(torque, later), angle, motion.velocity, motion.acceleration)


@compiled
def _rates_beyond(driveline, torque, end, phase):
    """(first, second) time derivative of the torque at rest, beyond the limit that it reached."""
    side = 1.0 if end == SearchEnd.HIT_HIGH else -1.0
    rate = torque_rate_at_rest(driveline, torque, phase)
    return side * rate, side * second_rate(torque, phase)


@inlined
def hold(driveline, torque, lower, upper, slack, motion, t_end):
    """Rest until the brake breaks away or the time ``t_end`` comes; see ``slip``.

    slack : torque [N m] by which the holding interval must be exceeded at some time for the brake
            to break away; it does so where it crosses the limit before

    HIT_HIGH, HIT_LOW: the torque left the holding interval [lower, upper] there.
    """
    end, later = _end_of_rest(driveline, torque, lower, upper, motion, t_end)
    ended = _rest_at(driveline, torque, motion, later)
    if end != SearchEnd.TIME:
        rate, second = _rates_beyond(driveline, torque, end, ended.phase)
        if not passes(rate, second, slack):
            # It is at its limit, or reaches it without exceeding it, as where both are equal.
            low, high = lower - slack, upper + slack
            end, later = _end_of_rest(driveline, torque, low, high, ended, t_end)
            if end != SearchEnd.TIME:
                rate, second = _rates_beyond(driveline, torque, end, phase_at(torque, later))
                root = math.sqrt(max(0.0, rate * rate - 2.0 * second * slack))
                if rate + root > 0.0:
                    later = max(ended.time, later - 2.0 * slack / (rate + root))
            ended = _rest_at(driveline, torque, motion, later)
    return Found(end, ended, 0)
