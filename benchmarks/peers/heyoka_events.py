"""heyoka: Taylor series with terminal events.

Without events it is wrong here in the first digits. With Coulomb friction there is nothing to
expand at a reversal; with smoothed friction the series at high speed does not see the steep
layer about zero velocity, and steps over a whole reversal.
"""

import time
from collections.abc import Callable, Sequence
from functools import cached_property

import numpy as np

from peers.brake import Brake
from peers.peer import LAWS, Answers, Peer, absent

COOLDOWN = 1e-7
State = tuple[float, float]


class Heyoka(Peer):
    """A law at a tolerance, compiled once: everything of a brake is a parameter."""

    def __init__(self, law: str, tolerance: float) -> None:
        self.law, self.tolerance = law, tolerance
        self.name = "heyoka, terminal events"
        self.asked = f"tol {tolerance:g}"

    def missing(self) -> str:
        return absent("heyoka")


class HeyokaEvents(Heyoka):
    """One trajectory at a time; pieces are switched by callbacks."""

    @cached_property
    def run(self) -> Callable[[Brake, float], State]:
        return {"coulomb": coulomb, "smoothed": smoothed}[self.law](self.tolerance)

    def solve(self, brakes: Sequence[Brake], until: float) -> Answers:
        run = self.run
        start = time.perf_counter()
        states = [run(brake, until) for brake in brakes]
        return Answers(np.array(states), time.perf_counter() - start)


def coulomb(tolerance: float) -> Callable[[Brake, float], State]:
    """Sliding by Taylor series; how long the brake rests is known in closed form."""
    import heyoka as hy

    theta, w = hy.make_vars("theta", "w")
    g2, q, te, om, k, inverse = (hy.par[i] for i in range(6))
    drive = te * hy.sin(om * hy.time)
    equations = [(theta, w), (w, drive - k * theta - g2 * w + q)]
    brake: Brake  # the one that runs

    def set_piece(ta, side, engaged):
        ta.pars[:5] = [*brake.piece(side, engaged), brake.te, brake.om, brake.k]

    def at_zero(ta, _):
        side = brake.side_of(brake.pull(ta.time, ta.state[0]))
        if side:
            set_piece(ta, side, engaged=True)
        return side != 0  # at rest the caller finds its end

    def at_release(ta, direction):
        side = 1 if ta.state[1] > 0.0 else -1
        set_piece(ta, side, engaged=direction * side < 0)
        return True

    events = [hy.t_event(w, callback=at_zero, cooldown=COOLDOWN)]
    events += [
        hy.t_event(inverse * w - s, callback=at_release, cooldown=COOLDOWN) for s in (1.0, -1.0)
    ]
    ta = hy.taylor_adaptive(equations, [0.0, 0.0], pars=[0.0] * 6, t_events=events, tol=tolerance)
    # Leaving rest on the root of an event: the first small step is made without events.
    free = hy.taylor_adaptive(equations, [0.0, 0.0], pars=[0.0] * 5, tol=tolerance)

    def run(given: Brake, until: float) -> State:
        nonlocal brake
        brake = given
        t, angle = 0.0, 0.0
        while True:
            t, side = brake.rest(t, angle)
            if t >= until:
                return angle, 0.0
            set_piece(free, side, engaged=True)
            free.time, free.state[:] = t, (angle, 0.0)
            free.propagate_until(min(t + 1e-5, until))
            ta.pars[:] = [*free.pars, 1.0 / brake.release]
            ta.time, ta.state[:] = free.time, free.state
            ta.reset_cooldowns()
            outcome = ta.propagate_until(until)[0]
            if outcome == hy.taylor_outcome.time_limit:
                return float(ta.state[0]), float(ta.state[1])
            t, angle = ta.time, float(ta.state[0])

    return run


def smoothed_equations(hy):
    """Equations, and the functions whose roots are events: reversal, layer and release.

    pars : side, engaged, then c, k, te, om, r, tan, mu, fa, slope, steep, 1/release
    """
    theta, w = hy.make_vars("theta", "w")
    side, engaged, c, k, te, om, r, tan, mu, fa, slope, steep, inverse = (
        hy.par[i] for i in range(13)
    )
    m = mu * hy.tanh(steep * r * w)
    torque = r * engaged * (fa + slope * side * w) * m / (tan - m)
    equations = [(theta, w), (w, te * hy.sin(om * hy.time) - c * w - k * theta - torque)]
    # At the border of the steep layer a step must end: beyond it the series does not see
    # the layer.
    border = 10.0 / (steep * r)
    # heyoka chooses its steps by the sizes of these functions too: none may be huge.
    return equations, [w], [w - border, w + border], [inverse * w - 1.0, inverse * w + 1.0]


def smoothed(tolerance: float) -> Callable[[Brake, float], State]:
    """Steps end at every kink of the smoothed law and at the border of its steep layer."""
    import heyoka as hy

    equations, zero, border, release = smoothed_equations(hy)

    def at_zero(ta, direction):
        ta.pars[0] = -1.0 if direction < 0 else 1.0
        return True

    def at_border(_ta, _direction):
        return True

    def at_release(ta, direction):
        ta.pars[1] = 1.0 if direction * ta.state[1] < 0.0 else 0.0
        return True

    events = [
        hy.t_event(one, callback=call, cooldown=COOLDOWN)
        for several, call in ((zero, at_zero), (border, at_border), (release, at_release))
        for one in several
    ]
    ta = hy.taylor_adaptive(equations, [0.0, 0.0], pars=[1.0] * 13, t_events=events, tol=tolerance)

    def run(brake: Brake, until: float) -> State:
        ta.time, ta.state[:] = 0.0, (0.0, 0.0)
        ta.pars[:] = [1.0, 1.0, *brake, 1.0 / brake.release]
        ta.reset_cooldowns()
        ta.propagate_until(until)
        return float(ta.state[0]), float(ta.state[1])

    return run


def peers(kind: type[Heyoka] = HeyokaEvents) -> list[Peer]:
    """At the tolerance of the task and at its best."""
    tolerances = {"coulomb": (1e-15,), "smoothed": (1e-8, 1e-10)}
    return [kind(law, tolerance) for law in LAWS for tolerance in tolerances[law]]
