"""Taylor series of the torques of contacts whose torque is a curve over the sliding speed.

Such a torque is T = -P(s) F on the first inertia, with the force F and a polynomial P of
s = offset + slope |v| for each piece of the curve. T is an input of the machine, which is linear
otherwise. As the coefficient of order k of T follows from those of v and F up to this order, the
series of the states and of T are computed order by order.
"""

import math

from wedgebrake.dynamics.jit import borrowing, embedded
from wedgebrake.solvers.machine.events.cells import add_inputs, next_coefficient

CURVE_TERMS = 24
"""Terms of a series in a mode in which contacts slide on curves.

The work of an order grows like the number of terms, and the length of a cell for a given accuracy
like accuracy^(1/terms): 20 to 28 terms take about the same time.
"""
# Size of the last terms of a series at the end of a cell, relative to its first ones. What is left
# out is smaller: the terms fall by a factor of 5 then.
_LAST_TERM = 1e-16
_FIRST_TERMS = 4


@borrowing
def curve_gain(problem, number, mode, speed):
    """Torque of a sliding contact over its force, against the motion: P(s)."""
    one = problem.lines[problem.contacts[number].first_line + mode.line]
    s = one.offset + one.slope * abs(speed)
    total = 0.0
    for j in range(one.degree, -1, -1):
        total = total * s + one.factors[j]
    return total


@borrowing
def slides_on_curve(run):
    """Return True if a contact slides on a curve."""
    slides = False
    for curve in run.curves:
        slides = slides or run.modes[curve.contact].side != 0
    return slides


@borrowing
def expand_curves(problem, run, slot, terms, longest):
    """Store the series of the states and of the torques on curves in z[:, :terms], from z[:, 0].

    Returns the length of the cell in which the series are resolved, at most ``longest``.

    The torques are nonlinear, so that no bound of the coefficients is known in advance. The length
    is chosen such that the last two terms of each speed, actuator state and torque are rounding
    relative to its first terms. (An angle is resolved if its speed is.)
    """
    z, rates, half = run.z, run.systems.rates[slot], problem.inverse.size
    lead = run.systems.lead[slot]
    for curve in run.curves:
        if run.modes[curve.contact].side != 0:
            _begin(problem, run, curve)
    add_inputs(rates, half, z)
    for k in range(terms):
        for curve in run.curves:
            if run.modes[curve.contact].side != 0:
                _extend(problem, run, curve, run.systems.force[slot, curve.contact], terms, k)
                if k + 1 < terms:
                    add_curve(problem, run, slot, curve, z, k)
        if k + 1 < terms:
            next_coefficient(rates, lead, z, k)
    h = longest
    for column in range(half, z.shape[0] - 1):
        if column < problem.states or _is_torque(problem, run, column - problem.states):
            h = min(h, _resolved(z[column], terms))
    return h


@embedded
def _is_torque(problem, run, number):
    """Return True if an input is the torque of a contact that slides on a curve."""
    found = False
    for curve in run.curves:
        slides = run.modes[curve.contact].side != 0
        found = found or (slides and problem.contacts[curve.contact].curve == number)
    return found


@embedded
def add_curve(problem, run, slot, curve, z, k):
    """Add the torque of a contact to the rates of the states, for ``next_coefficient``."""
    column = problem.states + problem.contacts[curve.contact].curve
    for i in range(problem.inverse.size, problem.states):
        z[i, k + 1] += run.systems.rates[slot, i, column] * z[column, k]


@borrowing
def _begin(problem, run, curve):
    """Expand the polynomial of a contact about its present sliding speed, without the torque."""
    run.z[problem.states + problem.contacts[curve.contact].curve] = 0.0
    mode, about = run.modes[curve.contact], curve.about
    one = problem.lines[problem.contacts[curve.contact].first_line + mode.line]
    row = problem.sliding[curve.contact]
    speed = 0.0
    for j in range(row.size):
        speed += row[j] * run.z[j, 0]
    s = one.offset + one.slope * mode.side * speed
    for j in range(one.degree + 1):
        about[j] = one.factors[j]
    if math.isinf(about[0]):
        # A brake that locks itself does so where it is pressed; released, it has no torque.
        about[0] = 0.0
    for i in range(one.degree):
        for j in range(one.degree - 1, i - 1, -1):
            about[j] += s * about[j + 1]


@borrowing
def _extend(problem, run, curve, force, terms, k):
    """Store the coefficient of order k of the torque of a contact in z, from those of z[:, :k + 1].

    force : row of its force

    Stage j of Horner's rule is about[j] + argument stage[j + 1]. It is required only to the order
    terms - j (of the derivative too), as the argument has no constant term.
    """
    z, contact, mode = run.z, problem.contacts[curve.contact], run.modes[curve.contact]
    one, sliding = problem.lines[contact.first_line + mode.line], problem.sliding[curve.contact]
    argument, stages, forces = curve.argument, curve.stages, curve.force
    speed, push = 0.0, 0.0
    for j in range(sliding.size):
        speed += sliding[j] * z[j, k]
        push += force[j] * z[j, k]
    argument[k], forces[k] = one.slope * mode.side * speed, push
    used, now = min(one.degree, terms - k + 1), stages[k]
    for j in range(one.degree + 1):
        now[j] = curve.about[j] if k == 0 else 0.0
    if k == 0:
        argument[0] = 0.0
    for i in range(1, k + 1):
        factor, before = argument[i], stages[k - i]
        for j in range(used):
            now[j] += factor * before[j + 1]
    total = 0.0
    for i in range(k + 1):
        total += stages[k - i, 0] * forces[i]
    z[problem.states + contact.curve, k] = -total


@embedded
def _resolved(series, terms):
    """Time at which the last two terms of a series are rounding relative to the first ones."""
    h = math.inf
    for last in range(terms - 2, terms):
        if series[last] == 0.0:
            continue
        small, longest = math.log(abs(series[last])) - math.log(_LAST_TERM), -math.inf
        for k in range(_FIRST_TERMS):
            if series[k] != 0.0:
                longest = max(longest, (math.log(abs(series[k])) - small) / (last - k))
        if longest > -math.inf:
            h = min(h, math.exp(longest))
    return h


@borrowing
def differentiate(problem, run, terms):
    """Store the series of dT/dv and dT/dF for contacts on curves, once those of T are stored.

    v is given by the row ``problem.sliding`` of a contact, F by the row ``systems.force`` of its
    mode.
    """
    for curve in run.curves:
        mode = run.modes[curve.contact]
        if mode.side == 0:
            continue
        one = problem.lines[problem.contacts[curve.contact].first_line + mode.line]
        argument, stages, forces = curve.argument, curve.stages, curve.force
        by_speed, by_force = curve.by_speed, curve.by_force
        # P' = sum of stage_j argument^(j - 1): as P = about_0 + argument stage_1, the derivative of
        # Horner's rule is P' = stage_1 + argument (stage_1)', and so on, from the last stage.
        slope, scale = by_speed, one.slope * mode.side
        slope[:terms] = 0.0
        for j in range(one.degree, 0, -1):
            for k in range(terms - 1, -1, -1):
                total = stages[k, j]
                for i in range(1, k + 1):
                    total += argument[i] * slope[k - i]
                slope[k] = total
        for k in range(terms - 1, -1, -1):
            total = 0.0
            for i in range(k + 1):
                total += slope[k - i] * forces[i]
            by_speed[k] = -scale * total
            by_force[k] = -stages[k, 0]
