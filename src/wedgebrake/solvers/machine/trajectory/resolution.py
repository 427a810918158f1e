"""Length of the cells in which the derivative of the flow is resolved, with curves and products.

Where the torque of a contact is a curve, or that of an element has a factor that varies, the cells
resolve the motion. The derivative may change faster: beside an equilibrium the motion does not
change at all. A column u of the derivative obeys u' = (A + sum_c b_c g_c) u, with the gradients g
of the torques c, of magnitudes that are at most M (1 + sum_p |s_p(t) - s_p(0)|/bound_p) for the
factors s_p of the products p. Its Taylor coefficients are therefore at most those of
u' = rho (1 + ...) u for the growth rho of M.
"""

import math

from wedgebrake.dynamics.jit import borrowing, chosen_by_class, embedded
from wedgebrake.solvers.machine.events.cells import SHARES, value
from wedgebrake.solvers.machine.events.curves import CURVE_TERMS, curve_gain, resolved
from wedgebrake.solvers.machine.events.modes import cell_for, growth
from wedgebrake.solvers.machine.trajectory.watch import NoWatch, Watch


@borrowing
def _resolves(watch, problem, run, slot):
    """Length of a cell from the present state on in which the derivative is resolved; or inf."""
    if not watch.derivative:
        return math.inf
    matrix, rates, states = run.assembly.powers, run.systems.rates[slot], problem.states
    for i in range(states):
        for j in range(states):
            matrix[0, i, j] = abs(rates[i, j])
    for curve in run.curves:
        contact, mode = problem.contacts[curve.contact], run.modes[curve.contact]
        if mode.side == 0:
            continue
        line = problem.lines[contact.first_line + mode.line]
        sliding, force = problem.sliding[curve.contact], run.systems.force[slot, curve.contact]
        gain, rise = curve_gain(line, mode.side, value(sliding, run.z))
        rise *= value(force, run.z)
        for i in range(states):
            factor = abs(rates[i, states + contact.curve])
            for j in range(states):
                matrix[0, i, j] += factor * abs(rise * sliding[j])
                if force[j] != 0.0:  # the gain of a brake that locks itself is infinite
                    matrix[0, i, j] += factor * abs(gain * force[j])
    for product in run.products:
        line = problem.elements.lines[run.places[product.element].piece]
        for i in range(states):
            factor = abs(rates[i, states + product.input]) * product.bound
            for j in range(states):
                matrix[0, i, j] += factor * abs(line[j])
    fastest = growth(matrix, states)
    h = cell_for(fastest)
    return min(h, _with_products(run, states, fastest)) if run.products.size > 0 else h


@borrowing
def _with_products(run, states, fastest):
    """``_resolves`` with the growth of M, where factors vary."""
    u = run.products[0].growth
    u[0] = 1.0
    for k in range(CURVE_TERMS - 1):
        total = u[k]
        for product in run.products:
            scale = run.z[states + product.scale]
            for i in range(1, k + 1):
                total += abs(scale[i]) / product.bound * u[k - i]
        u[k + 1] = fastest * SHARES[k] * total
    return math.exp(resolved(u, CURVE_TERMS))


@embedded
def _never(watch, problem, run, slot):  # noqa: ARG001 - as ``_resolves``
    """``_resolves`` in runs without a derivative."""
    return math.inf


resolves = chosen_by_class({Watch: _resolves, NoWatch: _never})
