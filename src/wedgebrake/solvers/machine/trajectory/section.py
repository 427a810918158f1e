"""Returns of a machine to a section: at given times, or where a quantity crosses a level."""

import math

from wedgebrake.dynamics.jit import borrowing
from wedgebrake.solvers.machine.events.cells import combine, first_zero, largest_change, polynomial
from wedgebrake.solvers.machine.trajectory.watch import SectionKind

# Magnitude of a value on the section, relative to the largest sum of its terms' magnitudes.
_ON_SECTION = 1e-12
# Most turns of a row about its level that are followed in a cell.
_TURNS = 8


@borrowing
def next_return(watch, run, terms, clock, tau, event):
    """Time from the beginning of a cell of length tau to its first return; inf if there is none.

    event : whether an event ends the cell
    """
    state = watch.state[0]
    if watch.kind == SectionKind.EVERY:
        since = (watch.origin + state.next * watch.period - clock.time) - clock.remainder
        return max(since, 0.0)
    return _next_crossing(watch, run, terms, tau, event)


@borrowing
def _next_crossing(watch, run, terms, tau, event):
    """``next_return`` for a quantity that crosses its level upwards.

    Since its previous crossing, it must have been below the level by more than rounding.
    """
    state, g = watch.state[0], watch.work[0]
    scale = combine(watch.row, run.z, g)
    reach = largest_change(g, terms, tau)
    state.scale = max(state.scale, scale + reach)
    tolerance = _ON_SECTION * state.scale
    if g[0] < -tolerance:
        state.below = 1
    if g[0] + reach < -tolerance or (g[0] - reach > tolerance and state.below == 0):
        return math.inf
    at = 0.0
    for _ in range(_TURNS):
        if state.below == 0:
            down = first_zero(g, terms, tau - at, tolerance, abs(g[0]) <= tolerance)
            if down > tau - at:
                return math.inf
            at += down
            _move(g, terms, down)
        _negate(g, terms)
        fresh = state.below == 0
        up = first_zero(g, terms, tau - at, tolerance if fresh else 0.0, fresh)
        if up > tau - at:
            end = -polynomial(g, terms, tau - at)
            if end < -tolerance:
                state.below = 1
            elif state.below != 0 and event:
                # It has arrived together with the event, up to rounding.
                state.below = 0
                return tau
            return math.inf
        if state.below != 0 or -polynomial(g, terms, 0.5 * up) < -tolerance:
            state.below = 0
            return at + up
        at += up
        _move(g, terms, up)
        _negate(g, terms)
        if up == 0.0:
            break
    return math.inf


@borrowing
def _negate(g, terms):
    """Change the sign of a series."""
    for k in range(terms):
        g[k] = -g[k]


@borrowing
def _move(g, terms, tau):
    """Move the origin of a series to tau, by Horner's scheme."""
    if tau != 0.0:
        for first in range(terms - 1):
            for k in range(terms - 2, first - 1, -1):
                g[k] += tau * g[k + 1]


@borrowing
def next_turn(g, terms, tau):
    """Time at which a series next changes its sign; inf if it does not before tau.

    The origin of the series is moved to this time, where its value then counts as zero.
    """
    scale = abs(g[0])
    reach = largest_change(g, terms, tau)
    if scale > reach:
        return math.inf
    at = first_zero(g, terms, tau, 0.0, True)
    if at == 0.0:
        _negate(g, terms)
        at = first_zero(g, terms, tau, 0.0, True)
    if 0.0 < at <= tau:
        _move(g, terms, at)
        return at
    return math.inf
