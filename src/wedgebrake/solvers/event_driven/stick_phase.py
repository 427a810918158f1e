"""The end of an interval of rest: when the torque leaves what the brake can hold."""

import math

from wedgebrake.dynamics.enums import SearchEnd
from wedgebrake.dynamics.harmonic import phase_at, second_rate, wait_above, wait_below
from wedgebrake.dynamics.jit import compiled, inlined
from wedgebrake.dynamics.problem import torque_at_rest, torque_rate_at_rest
from wedgebrake.solvers.event_driven.event_search import Found, Motion
from wedgebrake.solvers.event_driven.root_exclusion import safe_step


@compiled
def _at_constant_angle(driveline, torque, lower, upper, t, theta):
    """(end, time of release) of rest at a constant angle, in closed form.

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
    """(end, time of release) of rest on a turning shaft, where the angle moves.

    The holding condition is lower <= T(t) - c w_rest - k theta(t) <= upper; its end is found
    with the same bound as an event of slip.
    """
    omega = torque.angular_frequency
    jerk_bound = torque.amplitude * omega**3
    cell = 1.0 / omega
    tick = 2.0**-52 * (t_end + 1.0 / omega)
    t = start
    while t < t_end:
        phase = phase_at(torque, t)
        angle = theta + driveline.rest_velocity * (t - start)
        held = torque_at_rest(driveline, torque, phase, angle)
        rate = torque_rate_at_rest(driveline, torque, phase)
        second = second_rate(torque, phase)
        longest = min(cell, t_end - t)
        step, end = longest, SearchEnd.TIME
        if upper < math.inf:
            if held >= upper and (rate > 0.0 or (rate == 0.0 and second > 0.0)):
                return SearchEnd.HIT_HIGH, t
            d = safe_step(upper - held, -rate, -second, jerk_bound, 0.0, 0.0, longest)
            if d < step:
                step, end = d, SearchEnd.HIT_HIGH
        if lower > -math.inf:
            if held <= lower and (rate < 0.0 or (rate == 0.0 and second < 0.0)):
                return SearchEnd.HIT_LOW, t
            d = safe_step(held - lower, rate, second, jerk_bound, 0.0, 0.0, longest)
            if d < step:
                step, end = d, SearchEnd.HIT_LOW
        if end != SearchEnd.TIME and step <= tick:
            return end, t + step
        t += max(step, tick)
    return SearchEnd.TIME, t_end


@inlined
def hold(driveline, torque, lower, upper, motion, t_end):
    """Rest until the brake releases or the time ``t_end`` comes; see ``event_search.slip``.

    HIT_HIGH, HIT_LOW: the torque left the holding interval [lower, upper] there.
    """
    t, w_rest = motion.time, driveline.rest_velocity
    if w_rest == 0.0:
        end, later = _at_constant_angle(driveline, torque, lower, upper, t, motion.angle)
    else:
        end, later = _at_moving_angle(driveline, torque, lower, upper, t, t_end, motion.angle)
    if end == SearchEnd.TIME or later > t_end:
        end, later = SearchEnd.TIME, t_end
    angle = motion.angle + w_rest * (later - t)
    phase = phase_at(torque, later)
    return Found(end, Motion(later, phase, angle, motion.velocity, motion.acceleration), 0)
