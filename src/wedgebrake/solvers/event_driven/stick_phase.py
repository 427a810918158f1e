"""The end of an interval of rest: when the torque leaves what the brake can hold."""

import math

from wedgebrake.dynamics.jit import compiled
from wedgebrake.solvers.event_driven.root_exclusion import safe_step

HELD, LEFT_DOWN, LEFT_UP = 0, 1, 2


@compiled
def _wait_above(level, amplitude, phase):
    """Phase to wait until amplitude sin(phase) rises through ``level``; inf if it never does.

    Zero when the torque is above already: then the wait is over.
    """
    if level >= amplitude:
        return math.inf
    if level < -amplitude:
        return 0.0
    crossing = math.asin(level / amplitude)
    since = (phase - crossing) % (2.0 * math.pi)
    if since < math.pi - 2.0 * crossing:
        return 0.0
    return 2.0 * math.pi - since


@compiled
def _hold_still(amplitude, omega, stiffness, lower, upper, t, theta):
    """Rest at constant angle: (what, time of release), in closed form.

    The brake holds while T(t) - k theta is inside [lower, upper]: the release is an
    arcsine. ``t`` is inside the period; the release may lie beyond it.
    """
    spring = stiffness * theta
    phase = omega * t
    up = _wait_above(upper + spring, amplitude, phase)
    down = _wait_above(-(lower + spring), amplitude, phase + math.pi)
    if up == math.inf and down == math.inf:
        return HELD, math.inf
    if up <= down:
        return LEFT_UP, t + up / omega
    return LEFT_DOWN, t + down / omega


@compiled
def _hold_moving(amplitude, omega, stiffness, damping, lower, upper, t, t_end, theta, w_rest):
    """Rest relative to the brake on a turning shaft: theta moves at ``w_rest``.

    The holding condition is lower <= T(t) - c w_rest - k theta(t) <= upper, its end found
    with the same bound as an event of slip. Returns (what, time).
    """
    rate = stiffness * w_rest
    jerk_bound = amplitude * omega**3
    cell = 1.0 / omega
    tick = 2.0**-52 * (t_end + 1.0 / omega)
    start = t
    while t < t_end:
        sine, cosine = math.sin(omega * t), math.cos(omega * t)
        pull = amplitude * sine - damping * w_rest - stiffness * (theta + w_rest * (t - start))
        pull1 = amplitude * omega * cosine - rate
        pull2 = -amplitude * omega * omega * sine
        reach = min(cell, t_end - t)
        step, what = reach, HELD
        if upper < math.inf:
            if pull >= upper and (pull1 > 0.0 or (pull1 == 0.0 and pull2 > 0.0)):
                return LEFT_UP, t
            d = safe_step(upper - pull, -pull1, -pull2, jerk_bound, 0.0, 0.0, reach)
            if d < step:
                step, what = d, LEFT_UP
        if lower > -math.inf:
            if pull <= lower and (pull1 < 0.0 or (pull1 == 0.0 and pull2 < 0.0)):
                return LEFT_DOWN, t
            d = safe_step(pull - lower, pull1, pull2, jerk_bound, 0.0, 0.0, reach)
            if d < step:
                step, what = d, LEFT_DOWN
        if what != HELD and step <= tick:
            return what, t + step
        t += max(step, tick)
    return HELD, t_end


@compiled
def hold(amplitude, omega, stiffness, damping, lower, upper, t, t_end, theta, w_rest):
    """Rest until the brake lets go or ``t_end``: (what, time, angle)."""
    if w_rest == 0.0:
        what, t_next = _hold_still(amplitude, omega, stiffness, lower, upper, t, theta)
    else:
        what, t_next = _hold_moving(
            amplitude, omega, stiffness, damping, lower, upper, t, t_end, theta, w_rest
        )
    if what == HELD or t_next > t_end:
        what, t_next = HELD, t_end
    return what, t_next, theta + w_rest * (t_next - t)
