"""The step that provably contains no root (Taylor lower bound, third order).

Let u(d) >= 0 be the distance from a boundary, with u, u', u'' known now and a bound B of
|u'''| on [0, d]. Then u(d) >= u + u' d + u'' d^2/2 - B d^3/6, so there is no root before
the first positive root of the right side. Near a simple root this is Halley's method from
the safe side (cubic convergence); near a grazing minimum the steps shrink and grow again.
Nothing is sampled, so a root can be missed only if it is within rounding, that is, within the
least step of ``event_search.slip``.

The bound comes from an energy. Every derivative y of the velocity obeys
y'' + g2 y' + w2 y = forcing, hence e = sqrt(y'^2 + w2 y^2) grows at most at the rate
max(-g2, 0) plus the forcing's amplitude, whatever the kind of damping. With y = u'',
|u'''| <= e at any time.
"""

import math

from wedgebrake.dynamics.jit import compiled


@compiled
def bound(e, f, growth, d):
    """Bound of |u'''| a time up to ``d`` from now, for growth * d <= 1.

    e : sqrt(u'''^2 + w2 u''^2) now;  f : amplitude of the forcing of u'';
    growth : max(-g2, 0) [1/s].  exp(x) <= 1 + x + x^2 for x <= 1.
    """
    x = growth * d
    return (e + f * d) * (1.0 + x + x * x)


@compiled
def _quadratic_root(u, u1, b):
    """First positive root of u + u1 d + b d^2/2 with u >= 0; inf if there is none."""
    disc = u1 * u1 - 2.0 * b * u
    if disc < 0.0:
        return math.inf
    root = math.sqrt(disc)
    if u1 < 0.0:
        return 2.0 * u / (root - u1)
    if b >= 0.0:
        return math.inf
    return (u1 + root) / -b


@compiled
def safe_step(u, u1, u2, e, f, growth, cell):
    """A step in [0, cell] before which the distance u has no root.

    u, u1, u2 : distance [any unit], its first and second time derivative;
    e, f, growth : as for ``bound``.
    """
    third = bound(e, f, growth, cell) / 3.0
    curve = 0.5 * (min(u2, 0.0) - third * cell)
    if u + (min(u1, 0.0) + curve * cell) * cell > 0.0:
        return cell
    if u < 0.0:
        u = 0.0
    if u1 >= 0.0:
        # Leaving the boundary: u/d is bounded below by a parabola, root in closed form, in
        # two forms, each free of cancellation for its sign of u''.
        third = max(third, 1e-300)
        half = 0.5 * u2
        root = math.sqrt(half * half + 2.0 * third * u1)
        step = (half + root) / third if half >= 0.0 else 2.0 * u1 / (root - half)
        if u > 0.0:
            step = max(step, _quadratic_root(u, u1, u2 - third * cell))
        return min(step, cell)
    # u'' d^2/2 - B d^3/6 >= (u'' - B limit/3) d^2/2 while d <= limit: a limit just past
    # Newton's step keeps this parabola close, and the convergence cubic.
    limit = min(cell, -1.25 * u / u1)
    third = bound(e, f, growth, limit) / 3.0
    return min(limit, _quadratic_root(u, u1, u2 - third * limit))
