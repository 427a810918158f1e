"""The exact solver against heyoka's Taylor integrator with terminal events, over ten periods.

heyoka knows one linear oscillator; the pieces of the brake are its parameters, switched at
its events. Rest and its end are found here, by sampling and bracketing.
"""

from __future__ import annotations

import math
from functools import cache
from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq

import wedgebrake as wb
from cases import CASES
from equations import Law, Piece, angular_frequency, law

pytestmark = pytest.mark.peers
hy = pytest.importorskip("heyoka")


@cache
def integrators() -> tuple[Any, Any]:
    """(free, watched): x'' + g2 x' + w2 x = f sin(omega t) + q, without and with events.

    Parameters: g2, w2, f, omega, q, then the velocities x' that stop ``watched``.
    """
    x, w = hy.make_vars("x", "w")
    g2, w2, f, omega, q = (hy.par[i] for i in range(5))
    equations = [(x, w), (w, f * hy.sin(omega * hy.time) + q - g2 * w - w2 * x)]
    events = [hy.t_event(w - hy.par[5 + i]) for i in range(2)]
    free = hy.taylor_adaptive(equations, [0.0, 0.0], pars=[0.0] * 5)
    watched = hy.taylor_adaptive(equations, [0.0, 0.0], pars=[0.0] * 7, t_events=events)
    return free, watched


class Motion:
    """A braked driveline, piece by piece."""

    def __init__(self, system: wb.BrakedDriveline, initial: tuple[float, float]) -> None:
        self.line, self.law = system.driveline, law(system)
        self.law: Law
        self.omega, self.amplitude = angular_frequency(system), system.excitation.amplitude
        self.t, (self.angle, self.velocity) = 0.0, initial
        self.piece: Piece | None = None
        self.side = 0  # of the boundary that the motion starts from; 0: from none
        v = self.velocity + self.line.drive_speed
        if v == 0.0:
            self.decide()
        else:
            self.piece = self.law.at(v)

    def pull(self, t: Any) -> Any:
        """T - c theta' - k theta at rest relative to the brake."""
        angle = self.angle - self.line.drive_speed * (t - self.t)
        held = self.line.damping * self.line.drive_speed - self.line.stiffness * angle
        return self.amplitude * np.sin(self.omega * t) + held

    def decide(self) -> None:
        """Hold, or slip the way the torque points."""
        pull = self.pull(self.t)
        self.side = 1 if pull > self.law.upper else -1 if pull < self.law.lower else 0
        self.piece = self.law.beside(0.0, self.side) if self.side else None

    def rest(self, until: float) -> None:
        """At rest up to ``until`` or the first time that the torque leaves the interval."""
        grid = np.linspace(self.t, until, 2 + int((until - self.t) * self.omega * 200.0))
        first, side = until, 0
        for limit, towards in ((self.law.upper, 1), (self.law.lower, -1)):
            excess = towards * (self.pull(grid) - limit)
            outside = np.flatnonzero(excess > 0.0)
            if outside.size:
                i = outside[0]
                if i == 0 or excess[i - 1] == 0.0:
                    moment = grid[max(i - 1, 0)]
                else:
                    moment = brentq(
                        lambda t, limit=limit: self.pull(t) - limit, grid[i - 1], grid[i],
                        xtol=1e-16, rtol=1e-15,
                    )  # fmt: skip
                if moment < first:
                    first, side = moment, towards
        self.angle -= self.line.drive_speed * (first - self.t)
        self.t = float(first)
        if side:
            self.side, self.piece = side, self.law.beside(0.0, side)

    def slip(self, until: float) -> None:
        """In motion up to ``until`` or the first boundary."""
        assert self.piece is not None
        line, piece, drive = self.line, self.piece, self.line.drive_speed
        g2 = (line.damping + piece.slope) / line.inertia
        q = -(piece.offset + piece.slope * drive) / line.inertia
        common = [g2, line.stiffness / line.inertia, self.amplitude / line.inertia, self.omega, q]
        low, high = piece.low - drive, piece.high - drive
        # A piece without end has one boundary, watched twice.
        ends = low if math.isfinite(low) else high, high if math.isfinite(high) else low
        free, watched = integrators()
        free.pars[:], watched.pars[:] = common, [*common, *ends]
        if self.side:
            # heyoka must not start on a root of its event function: leave the boundary by a
            # step without events, so small that the motion has not come back.
            fastest = max(self.omega, line.natural_frequency, abs(g2))
            aside = min(1e-3 / fastest, until - self.t)
            while True:
                free.time, free.state[:] = self.t, (self.angle, self.velocity)
                free.propagate_until(self.t + aside)
                if low < free.state[1] < high:
                    break
                aside *= 0.1
                assert aside * fastest > 1e-12
            self.t, (self.angle, self.velocity), self.side = free.time, free.state, 0
        watched.time, watched.state[:] = self.t, (self.angle, self.velocity)
        watched.reset_cooldowns()
        outcome = int(watched.propagate_until(until)[0].value)
        self.t, (self.angle, self.velocity) = watched.time, map(float, watched.state)
        if -2 <= outcome <= -1:
            end = ends[-1 - outcome]
            self._cross(1 if end == high else -1, piece.high if end == high else piece.low)

    def _cross(self, side: int, boundary: float) -> None:
        self.velocity = boundary - self.line.drive_speed
        if boundary == 0.0:
            self.decide()
        else:
            self.side, self.piece = side, self.law.beside(boundary, side)

    def advance(self, until: float) -> tuple[float, float]:
        """State at the time ``until``."""
        while self.t < until:
            if self.piece is None:
                self.rest(until)
            else:
                self.slip(until)
        return self.angle, self.velocity


@pytest.mark.parametrize("name", CASES)
def test_ten_periods(name):
    system, initial = CASES[name]
    times = np.linspace(0.0, 10.0 / system.excitation.frequency, 38)[1:]
    motion = Motion(system, initial)
    expected = np.array([motion.advance(float(t)) for t in times])
    got = wb.simulate(system, periods=10, initial=initial, times=times)
    scale = np.abs(expected).max(axis=0)
    assert np.max(np.abs(got.angle.values - expected[:, 0])) <= 1e-10 * scale[0]
    assert np.max(np.abs(got.velocity.values - expected[:, 1])) <= 1e-10 * scale[1]
