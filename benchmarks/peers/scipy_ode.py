"""SciPy's solve_ivp with a compiled right side.

Coulomb friction by pieces: sliding ends at the roots of event functions, how long the brake
rests is known in closed form. Smoothed friction as one right side, blind to the kinks. Steps are
held below 2 ms: with longer ones all methods step over whole reversals.
"""

import math
import time
from collections.abc import Callable, Sequence
from typing import Any

import numba
import numpy as np
from scipy.integrate import solve_ivp

from peers.brake import Brake
from peers.peer import LAWS, Answers, Peer, absent

METHODS = ("RK45", "DOP853", "LSODA", "Radau")
LONGEST_STEP = 2e-3
# A slip that begins on the root of its own event would end there, if it is shorter than a step.
ASIDE = 1e-12
RTOL = 1e-8
State = tuple[float, float]
Rates = Callable[..., Any]


class SciPy(Peer):
    """One method of solve_ivp."""

    def __init__(self, law: str, method: str, rtol: float) -> None:
        self.law, self.method, self.rtol = law, method, rtol
        self.rates: Rates = sliding if law == "coulomb" else smoothed
        events = ", events" if law == "coulomb" else ""
        self.name = f"SciPy {method}{events}"
        self.asked = f"rtol {rtol:g}, steps ≤ 2 ms"
        self.slow = method == "Radau"

    def missing(self) -> str:
        return absent("scipy")

    def solve(self, brakes: Sequence[Brake], until: float) -> Answers:
        run = self.by_pieces if self.law == "coulomb" else self.whole
        run(brakes[0], 1e-3)  # compiles
        start = time.perf_counter()
        states = [run(brake, until) for brake in brakes]
        return Answers(np.array(states), time.perf_counter() - start)

    def whole(self, brake: Brake, until: float) -> State:
        """The smoothed law."""
        t, angle, w, _ = self.advance(0.0, (0.0, 0.0), until, brake)
        assert t == until
        return angle, w

    def by_pieces(self, brake: Brake, until: float) -> State:
        """Rest, sliding with the brake engaged, sliding with the brake released."""
        t, angle, w = 0.0, 0.0, 0.0
        side, engaged = 0, True
        while t < until:
            if side == 0:
                t, side = brake.rest(t, angle)
                if t >= until:
                    return angle, 0.0
            numbers = (*brake.piece(side, engaged), brake.te, brake.om, brake.k)
            events = crossings(side, engaged, brake.release)
            if w == 0.0:
                w = side * ASIDE
            t, angle, w, which = self.advance(t, (angle, w), until, numbers, events)
            if which == 0:
                w, engaged = 0.0, True
                side = brake.side_of(brake.pull(t, angle))
            elif which == 1:
                w, engaged = side * brake.release, not engaged
        return angle, w

    def advance(
        self,
        t: float,
        state: State,
        until: float,
        numbers: tuple[float, ...],
        events: Sequence[Rates] = (),
    ) -> tuple[float, float, float, int]:
        """Time, angle and velocity at the first event or the end, and which event; -1: none."""
        found = solve_ivp(
            self.rates, (t, until), state, method=self.method, rtol=self.rtol,
            atol=self.rtol * 1e-2, max_step=LONGEST_STEP, args=(numbers,), events=events or None,
        )  # fmt: skip
        assert found.status >= 0, found.message
        which = -1
        if found.status == 1:
            which = next(i for i, times in enumerate(found.t_events) if times.size)
        return float(found.t[-1]), float(found.y[0, -1]), float(found.y[1, -1]), which


def crossings(side: int, engaged: bool, release: float) -> list[Rates]:
    """Terminal events of sliding to one side: the end of sliding, and of (dis)engagement."""

    def zero(_t: float, y: Any, *_: float) -> float:
        return float(y[1])

    def at_release(_t: float, y: Any, *_: float) -> float:
        return float(y[1]) - side * release

    zero.terminal, zero.direction = True, -side
    events = [zero]
    if math.isfinite(release):
        at_release.terminal, at_release.direction = True, side if engaged else -side
        events.append(at_release)
    return events


@numba.njit
def sliding(t, y, numbers):
    """Sliding to one side, a linear equation."""
    g2, q, te, om, k = numbers
    return np.array([y[1], te * math.sin(om * t) - k * y[0] - g2 * y[1] + q])


@numba.njit
def smoothed(t, y, brake):
    """The smoothed law in one piece."""
    m = brake.mu * math.tanh(brake.steep * brake.r * y[1])
    force = max(brake.fa + brake.slope * abs(y[1]), 0.0)
    torque = brake.r * force * m / (brake.tan - m)
    drive = brake.te * math.sin(brake.om * t)
    return np.array([y[1], drive - brake.c * y[1] - brake.k * y[0] - torque])


def peers() -> list[Peer]:
    """Every method on both laws."""
    return [SciPy(law, method, RTOL) for law in LAWS for method in METHODS]
