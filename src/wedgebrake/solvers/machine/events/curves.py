"""Taylor series of the torques of contacts whose torque is a curve over the sliding speed.

Such a torque is T = -P(s) F on the first inertia, with the force F and a polynomial P of
s = offset + slope |v| for each piece of the curve. T is an input of the machine, which is linear
otherwise. As the coefficient of order k of T follows from those of v and F up to this order, the
series of the states and of T are computed order by order.

Smoothed friction with a brake of levers needs no pieces: with t = tanh(kappa v), w = 1 - t^2 and
E = exp(-lambda |v|),

    t' = kappa w v',  E' = -+lambda E v',  m = (mu + peak E) t,  P (b - d m) = R a m,

the coefficients follow from each other by products of series (Jorba and Zou, Experimental
Mathematics 14 (2005) 99). w is a series of its own, as 1 - t^2 would cancel at high speeds.
"""

import math

from wedgebrake.dynamics.jit import borrowing, compiled, embedded
from wedgebrake.solvers.machine.events.cells import SHARES, add_inputs, next_coefficient
from wedgebrake.solvers.machine.events.products import (
    add_product,
    begin_products,
    extend_product,
)

CURVE_TERMS = 24
"""Terms of a series in a mode in which contacts slide on curves.

The work of an order grows like the number of terms, and the length of a cell for a given accuracy
like accuracy^(1/terms): 20 to 28 terms take about the same time.
"""
# Size of the last terms of a series at the end of a cell, relative to its first ones. What is left
# out is smaller: the terms fall by a factor of 5 then.
_LAST_TERM = 1e-16
_FIRST_TERMS = 4
# Rows of the series of a smoothed law: k v_k, t, w, E, m and P.
_RATE, _TANH, _FALL, _PEAK, _COEFFICIENT, _GAIN = range(6)
# Exponents of exp that a cell may pass. The terms y^k/k! of one that grows by e^y fall from the
# beginning of the omitted ones on if y is at most half their order; otherwise all of them are
# negligible if it remains below exp(-39).
_GROWTH, _VANISHED = 12.0, 39.0


@compiled
def curve_gain(one, side, speed):
    """Torque of a contact over its force, against the motion, P, at a sliding speed, and dP/dv.

    one : the line, of dtype ``LINE``, in a direction of sliding
    """
    if one.degree < 0:
        kinetic, peak, decay, steepness, arm, gap, lever = _smoothed(one)
        tanh, fall, shrunk = _start(decay, steepness, speed)
        part = kinetic + peak * shrunk
        clearance = gap - lever * part * tanh
        rise = steepness * part * fall - side * decay * peak * shrunk * tanh
        return arm * part * tanh / clearance, arm * gap * rise / (clearance * clearance)
    s = one.offset + one.slope * side * speed
    total, rate = 0.0, 0.0
    for j in range(one.degree, -1, -1):
        rate = rate * s + total
        total = total * s + one.factors[j]
    return total, one.slope * side * rate


@embedded
def _smoothed(one):
    """The numbers of a smoothed law: mu, peak, lambda, kappa, and of the levers R a, b, d."""
    f = one.factors
    return f[0], f[1], f[2], f[3], f[4], f[5], f[6]


@embedded
def _start(decay, steepness, speed):
    """(t, w, E) at a sliding speed."""
    e = math.exp(-2.0 * steepness * abs(speed))
    fall = 4.0 * e / ((1.0 + e) * (1.0 + e))
    return math.tanh(steepness * speed), fall, math.exp(-decay * abs(speed))


@borrowing
def slides_on_curve(run):
    """Return True if a contact slides on a curve, or an element has a scale that varies."""
    slides = run.products.size > 0
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
    begin_products(problem, run)
    add_inputs(rates, half, z)
    for k in range(terms):
        for curve in run.curves:
            if run.modes[curve.contact].side != 0:
                _extend(problem, run, curve, run.systems.force[slot, curve.contact], terms, k)
                if k + 1 < terms:
                    add_curve(problem, run, slot, curve, z, k)
        for product in run.products:
            extend_product(problem, run, product, run.z, product.line, k)
            if k + 1 < terms:
                add_product(problem, run, slot, product, z, k)
        if k + 1 < terms:
            next_coefficient(rates, lead, z, k)
    log = math.inf
    for column in range(half, z.shape[0] - 1):
        if column < problem.states or _is_torque(problem, run, column - problem.states):
            log = min(log, resolved(z[column], terms))
    h = min(longest, math.exp(log))
    for curve in run.curves:
        mode = run.modes[curve.contact]
        one = problem.lines[problem.contacts[curve.contact].first_line + mode.line]
        if mode.side != 0 and one.degree < 0:
            h = min(h, _within_growth(problem, run, curve, one, terms, h))
    return h


@borrowing
def _within_growth(problem, run, curve, one, terms, h):
    """The part of a cell of length h in which the exponentials of a smoothed law are resolved."""
    _, peak, decay, steepness, _, _, _ = _smoothed(one)
    speed, row = 0.0, problem.sliding[curve.contact]
    for j in range(row.size):
        speed += row[j] * run.z[j, 0]
    reach = _reach(2.0 * steepness, abs(speed))
    if peak != 0.0:
        reach = min(reach, _reach(decay, abs(speed)))
    # The speed changes by at most this much; over a share of the cell, by at most that share of it.
    change = 0.0
    for k in range(terms - 1, 0, -1):
        change = change * h + abs(curve.series[_RATE, k]) / k
    change *= h
    return h if change <= reach else h * (reach / change)


@embedded
def _reach(rate, speed):
    """Change of the speed that exp(-rate speed) allows."""
    return max(_GROWTH, rate * speed - _VANISHED) / rate if rate > 0.0 else math.inf


@embedded
def _is_torque(problem, run, number):
    """Return True if an input is the torque of a contact that slides on a curve, or a product."""
    found = False
    for product in run.products:
        found = found or product.input == number
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
    if one.degree < 0:
        return
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
    forces[k] = push
    if one.degree < 0:
        total = _extend_smoothed(curve, one, mode.side, speed, k)
        z[problem.states + contact.curve, k] = -total
        return
    argument[k] = one.slope * mode.side * speed
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


@borrowing
def _extend_smoothed(curve, one, side, speed, k):
    """Store the coefficients of order k of a smoothed law; returns that of P F.

    speed : coefficient of the sliding speed
    """
    kinetic, peak, decay, steepness, arm, gap, lever = _smoothed(one)
    series, forces = curve.series, curve.force
    rates, t, w = series[_RATE], series[_TANH], series[_FALL]
    e, m, p = series[_PEAK], series[_COEFFICIENT], series[_GAIN]
    rates[k] = k * speed
    if k == 0:
        t[0], w[0], e[0] = _start(decay, steepness, speed)
        m[0] = (kinetic + peak * e[0]) * t[0]
        curve.about[0] = 1.0 / (gap - lever * m[0])
        p[0] = arm * m[0] * curve.about[0]
        return p[0] * forces[0]
    # Sums of products of earlier coefficients, side by side: each waits for its last addition.
    turn, shrink, square, peaks, levers, total = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for j in range(1, k):
        i = k - j
        turn += w[j] * rates[i]
        shrink += e[j] * rates[i]
        square += t[j] * t[i]
        peaks += e[j] * t[i]
        levers += m[j] * p[i]
        total += p[j] * forces[i]
    share = SHARES[k - 1]
    t[k] = steepness * share * (turn + w[0] * rates[k])
    e[k] = -side * decay * share * (shrink + e[0] * rates[k])
    w[k] = -(square + 2.0 * t[0] * t[k])
    m[k] = kinetic * t[k] + peak * (peaks + e[0] * t[k] + e[k] * t[0])
    p[k] = (arm * m[k] + lever * (levers + m[k] * p[0])) * curve.about[0]
    return total + p[0] * forces[k] + p[k] * forces[0]


@embedded
def resolved(series, terms):
    """Logarithm of the time at which the last two terms of a series are rounding.

    Relative to the first ones.
    """
    h, one, two = math.inf, abs(series[terms - 2]), abs(series[terms - 1])
    if one == 0.0 and two == 0.0:
        return h
    first, second = -math.inf, -math.inf
    small, smaller = _log(one) - math.log(_LAST_TERM), _log(two) - math.log(_LAST_TERM)
    for k in range(_FIRST_TERMS):
        size = _log(abs(series[k]))
        first = max(first, (size - small) / (terms - 2 - k))
        second = max(second, (size - smaller) / (terms - 1 - k))
    # A series whose first terms are zero is resolved by those of the others.
    h = first if one > 0.0 and first > -math.inf else h
    return min(h, second) if two > 0.0 and second > -math.inf else h


@embedded
def _log(size):
    """Logarithm; -inf for zero."""
    return math.log(size) if size > 0.0 else -math.inf


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
        if one.degree < 0:
            _differentiate_smoothed(curve, one, mode.side, terms)
            continue
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


@borrowing
def _differentiate_smoothed(curve, one, side, terms):
    """``differentiate`` for a smoothed law: dP/dv = R a b q^2 dm/dv, with q = 1/(b - d m)."""
    kinetic, peak, decay, steepness, arm, gap, lever = _smoothed(one)
    series, work, speeds = curve.series, curve.stages, curve.by_speed
    t, w, e, p = series[_TANH], series[_FALL], series[_PEAK], series[_GAIN]
    for k in range(terms):
        work[k, 0] = lever * p[k] / (arm * gap)  # q, as b q - 1 = d P/(R a)
    work[0, 0] += 1.0 / gap
    for k in range(terms):
        rise, fall, square = 0.0, 0.0, 0.0
        for j in range(k + 1):
            rise += e[j] * w[k - j]
            fall += e[j] * t[k - j]
            square += work[j, 0] * work[k - j, 0]
        work[k, 1] = steepness * (kinetic * w[k] + peak * rise) - side * peak * decay * fall
        work[k, 2] = square
    for k in range(terms):
        total = 0.0
        for j in range(k + 1):
            total += work[j, 2] * curve.force[k - j]
        work[k, 3] = total
    for k in range(terms):
        total = 0.0
        for j in range(k + 1):
            total += work[j, 3] * work[k - j, 1]
        speeds[k], curve.by_force[k] = -arm * gap * total, -p[k]


@borrowing
def change_smoothed(curve, one, side, speed, change, gains, terms):
    """Store the series of the derivative of P of a smoothed law with respect to a parameter.

    At a given sliding speed, with q of ``_differentiate_smoothed``, which is called before:
    dP = q (d(R a) m + R a dm + P (-db + dd m + d dm)).

    speed  : sliding speed at the beginning of the cell
    change : derivatives of the numbers of the law
    gains  : (TERMS,) the series
    """
    kinetic, peak, _, _, arm, _, lever = _smoothed(one)
    by_kinetic, by_peak, by_decay, by_steepness = change[0], change[1], change[2], change[3]
    by_arm, by_gap, by_lever = change[4], change[5], change[6]
    series, work = curve.series, curve.stages
    t, w, e = series[_TANH], series[_FALL], series[_PEAK]
    m, p = series[_COEFFICIENT], series[_GAIN]
    for k in range(terms):
        turn, shrink = speed * w[k], speed * e[k]
        for j in range(1, k + 1):
            part = series[_RATE, j] * SHARES[j - 1]
            turn += part * w[k - j]
            shrink += part * e[k - j]
        work[k, 1] = by_steepness * turn  # dt
        work[k, 2] = by_peak * e[k] - side * by_decay * peak * shrink
    work[0, 2] += by_kinetic
    for k in range(terms):
        total = kinetic * work[k, 1]
        for j in range(k + 1):
            total += work[j, 2] * t[k - j] + peak * e[j] * work[k - j, 1]
        work[k, 3] = total  # dm
        work[k, 4] = by_lever * m[k] + lever * total
    work[0, 4] -= by_gap
    for k in range(terms):
        total = by_arm * m[k] + arm * work[k, 3]
        for j in range(k + 1):
            total += p[j] * work[k - j, 4]
        work[k, 5] = total
    for k in range(terms):
        total = 0.0
        for j in range(k + 1):
            total += work[j, 0] * work[k - j, 5]
        gains[k] = total
