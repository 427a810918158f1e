"""heyoka: several trajectories side by side in vector lanes, with terminal events."""

import time
from collections.abc import Callable, Sequence
from functools import cached_property
from pathlib import Path

import numpy as np

from peers import heyoka_events
from peers.brake import Brake
from peers.heyoka_events import COOLDOWN, Heyoka, smoothed_equations
from peers.peer import Answers, Peer


def lanes_here() -> int:
    """Numbers in a vector of this processor."""
    flags = Path("/proc/cpuinfo")
    wide = flags.exists() and "avx512f" in flags.read_text(encoding="utf-8")
    return 8 if wide else 4


class HeyokaBatch(Heyoka):
    """A vector of trajectories at a time; a brake at rest is a mode of the equations."""

    def __init__(self, law: str, tolerance: float) -> None:
        super().__init__(law, tolerance)
        self.lanes = lanes_here()
        self.name += f", {self.lanes} lanes"

    @cached_property
    def run(self) -> Callable[[Sequence[Brake], float], np.ndarray]:
        return {"coulomb": coulomb, "smoothed": smoothed}[self.law](self.tolerance, self.lanes)

    def solve(self, brakes: Sequence[Brake], until: float) -> Answers:
        run, count = self.run, len(brakes)
        # The last vector is filled up with the last brake.
        padded = [*brakes, *[brakes[-1]] * (-count % self.lanes)]
        start = time.perf_counter()
        states = [run(padded[i : i + self.lanes], until) for i in range(0, len(padded), self.lanes)]
        seconds = time.perf_counter() - start
        return Answers(np.concatenate(states)[:count], seconds)


def smoothed(tolerance: float, lanes: int) -> Callable[[Sequence[Brake], float], np.ndarray]:
    """As one at a time; each lane has its own side and engagement."""
    import heyoka as hy

    equations, zero, border, release = smoothed_equations(hy)

    def at_zero(ta, direction, lane):
        ta.pars[0, lane] = -1.0 if direction < 0 else 1.0
        return True

    def at_border(_ta, _direction, _lane):
        return True

    def at_release(ta, direction, lane):
        ta.pars[1, lane] = 1.0 if direction * ta.state[1, lane] < 0.0 else 0.0
        return True

    events = [
        hy.t_event_batch(one, callback=call, cooldown=COOLDOWN)
        for several, call in ((zero, at_zero), (border, at_border), (release, at_release))
        for one in several
    ]
    ta = hy.taylor_adaptive_batch(
        equations, np.zeros((2, lanes)), pars=np.ones((13, lanes)), t_events=events, tol=tolerance
    )

    def run(brakes: Sequence[Brake], until: float) -> np.ndarray:
        ta.set_time(0.0)
        ta.state[:] = 0.0
        ta.pars[:2] = 1.0
        ta.pars[2:] = np.transpose([[*brake, 1.0 / brake.release] for brake in brakes])
        ta.reset_cooldowns()
        ta.propagate_until(until)
        return ta.state.T.copy()

    return run


def coulomb(tolerance: float, lanes: int) -> Callable[[Sequence[Brake], float], np.ndarray]:
    """A brake at rest stays in its lane: its velocity is frozen, its events are those of rest.

    pars : moves (1 sliding, 0 at rest), g2, q, upper and lower torque held, te, om, k, 1/release
    """
    import heyoka as hy

    theta, w = hy.make_vars("theta", "w")
    moves, g2, q, upper, lower, te, om, k, inverse = (hy.par[i] for i in range(9))
    pull = te * hy.sin(om * hy.time) - k * theta
    equations = [(theta, w), (w, moves * (pull - g2 * w + q))]
    given: Sequence[Brake] = ()

    def set_piece(ta, lane, side, engaged):
        ta.pars[:3, lane] = (1.0, *given[lane].piece(side, engaged))

    def at_zero(ta, _direction, lane):
        brake = given[lane]
        pull = brake.pull(ta.time[lane], ta.state[0, lane])
        side = brake.side_of(pull)
        if not ta.pars[0, lane]:  # at the limit that is the nearer
            side = 1 if pull > 0.5 * (ta.pars[3, lane] + ta.pars[4, lane]) else -1
        ta.state[1, lane] = 0.0
        if side:
            set_piece(ta, lane, side, engaged=True)
        else:
            ta.pars[0, lane] = 0.0
        return True

    def at_release(ta, direction, lane):
        side = 1 if ta.state[1, lane] > 0.0 else -1
        set_piece(ta, lane, side, engaged=direction * side < 0)
        return True

    # One function for all that happens at zero velocity: so what ends a rest has its cooldown
    # when the sliding begins on the root of the same function.
    limits = (1.0 - moves) * (pull - upper) * (pull - lower) / (te * te)
    watched = [
        (moves * w + limits, at_zero),
        (inverse * w - 1.0, at_release),
        (inverse * w + 1.0, at_release),
    ]
    events = [hy.t_event_batch(one, callback=call, cooldown=COOLDOWN) for one, call in watched]
    ta = hy.taylor_adaptive_batch(
        equations, np.zeros((2, lanes)), pars=np.ones((9, lanes)), t_events=events, tol=tolerance
    )

    def run(brakes: Sequence[Brake], until: float) -> np.ndarray:
        nonlocal given
        given = brakes
        ta.set_time(0.0)
        ta.state[:] = 0.0
        ta.pars[:3] = 0.0
        limits = [(one.gain(1) * one.fa, -one.gain(-1) * one.fa) for one in brakes]
        ta.pars[3:5] = np.transpose(limits)
        ta.pars[5:] = np.transpose([(one.te, one.om, one.k, 1.0 / one.release) for one in brakes])
        ta.reset_cooldowns()
        ta.propagate_until(until)
        return ta.state.T.copy()

    return run


def peers() -> list[Peer]:
    """Those of one trajectory at a time, in lanes."""
    return heyoka_events.peers(HeyokaBatch)
