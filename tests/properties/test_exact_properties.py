"""What must hold of every exact solution, whatever the system.

The motion between events is recomputed here from the equation of motion alone, by matrix
exponentials of the autonomous system (angle, velocity, sin, cos, 1): no closed form, no
case distinction, nothing shared with the solver.
"""

from __future__ import annotations

import math
from functools import cached_property
from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.linalg import expm

import wedgebrake as wb
from equations import Law, Piece, angular_frequency, law
from systems import cases
from wedgebrake.dynamics.enums import EventKind

EPS = float(np.finfo(float).eps)
PERIODS = 6
MOST = 20_000  # events: far more than six periods have, reached soon by an endless loop
exact_property = settings(max_examples=25, deadline=None)  # deadline: the first call compiles


class Span(NamedTuple):
    """The motion between two events: ``piece`` is None at rest relative to the brake."""

    start: float
    end: float
    state: tuple[float, float]
    piece: Piece | None
    side: int  # of the boundary that it started from; 0 if it started from none


class Run:
    """One exact solution, taken apart at its events."""

    def __init__(self, system: wb.BrakedDriveline, initial: tuple[float, float]) -> None:
        self.system, self.initial = system, initial
        self.line, self.law, self.omega = system.driveline, law(system), angular_frequency(system)
        self.amplitude = system.excitation.amplitude
        self.response = self.dense([0.0])
        attrs = self.response.attrs
        self.end: float = attrs["final_time"]
        self.final = (attrs["final_angle"], attrs["final_velocity"])

    def dense(self, times: np.ndarray | list[float]):
        """The solver's own answer at any times."""
        wanted = np.minimum(times, PERIODS * 2.0 * math.pi / self.omega)
        return wb.simulate(
            self.system, periods=PERIODS, initial=self.initial, times=wanted, max_events=MOST
        )

    def pull(self, t, angle, velocity):
        """T - c theta' - k theta [N m]: what the brake has to hold at rest."""
        drive = self.amplitude * np.sin(self.omega * t)
        return drive - self.line.damping * velocity - self.line.stiffness * angle

    def _first(self) -> tuple[Piece | None, int]:
        v = self.initial[1] + self.line.drive_speed
        if v != 0.0:
            on_boundary = any(v in (piece.low, piece.high) for piece in self.law.pieces)
            assume(not on_boundary)  # which side then: test_event_driven
            return self.law.at(v), 0
        pull = self.pull(0.0, *self.initial)
        rate = self.amplitude * self.omega - self.line.stiffness * self.initial[1]
        rounding = 4.0 * EPS * (self.amplitude + abs(pull))
        for side, limit in ((1, self.law.upper), (-1, self.law.lower)):
            excess = side * (pull - limit)
            # At its limit it slips at once if the torque is about to exceed it.
            if excess > rounding or (excess >= -rounding and side * rate > 0.0):
                return self.law.beside(0.0, side), side
        return None, 0

    @cached_property
    def spans(self) -> list[Span]:
        """The motion from event to event, in the pieces that the events announce."""
        r = self.response
        spans = []
        start, state, (piece, side) = 0.0, self.initial, self._first()
        for i in range(r.sizes["event"]):
            time, kind = float(r.event_time[i]), int(r.event_kind[i])
            spans.append(Span(start, time, state, piece, side))
            start, state = time, (float(r.event_angle[i]), float(r.event_velocity[i]))
            side = 0 if kind == EventKind.STICK else int(r.event_side[i])
            v = state[1] + self.line.drive_speed
            piece = None if kind == EventKind.STICK else self.law.beside(v, side)
        spans.append(Span(start, self.end, state, piece, side))
        return spans

    @cached_property
    def speed(self) -> float:
        """The largest velocity about [rad/s]; what a velocity is compared with."""
        r, natural = self.response, self.line.natural_frequency
        angles = np.abs([self.initial[0], self.final[0], *r.event_angle.values])
        velocities = np.abs([self.initial[1], self.final[1], *r.event_velocity.values])
        offsets = [abs(p.offset) for p in self.law.pieces if math.isfinite(p.offset)]
        push = (self.amplitude + max(offsets)) / self.line.inertia
        forced = push / max(natural, self.omega)
        return natural * angles.max() + velocities.max() + abs(self.line.drive_speed) + forced

    @cached_property
    def torque(self) -> float:
        """The largest torque about [N m]."""
        line = self.line
        reach = max(line.natural_frequency, line.damping / line.inertia) * line.inertia
        ends = [abs(x) for x in (self.law.lower, self.law.upper) if math.isfinite(x)]
        return self.amplitude + reach * self.speed + max(ends, default=0.0)

    def damping(self, span: Span) -> float:
        """theta' coefficient of the equation of motion divided by J [1/s]."""
        slope = 0.0 if span.piece is None else span.piece.slope
        return (self.line.damping + slope) / self.line.inertia

    def growth(self, span: Span) -> float:
        """Factor by which the motion inside a span can multiply an error."""
        rate = -0.5 * self.damping(span)
        rate += math.sqrt(max(rate * rate - self.line.natural_frequency**2, 0.0))
        return math.exp(max(rate, 0.0) * (span.end - span.start))

    def flow(self, span: Span) -> tuple[float, float]:
        """State at the end of a span, recomputed from its start."""
        angle, velocity = span.state
        length = span.end - span.start
        if span.piece is None or length == 0.0:
            return angle + velocity * length, velocity
        # In units of 1/rate of time, so that all unknowns are velocities of one size.
        natural, g2 = self.line.natural_frequency, self.damping(span)
        rate = max(natural, self.omega, abs(g2))
        constant = -span.piece.offset - span.piece.slope * self.line.drive_speed
        a = np.zeros((5, 5))
        a[0, 1] = 1.0
        a[1] = [
            -((natural / rate) ** 2), -g2 / rate, self.amplitude / self.line.inertia / rate, 0.0,
            constant / self.line.inertia / rate,
        ]  # fmt: skip
        a[2, 3], a[3, 2] = self.omega / rate, -self.omega / rate
        steps = max(1, math.ceil(rate * length / 4.0))
        step = expm(a * (rate * length / steps))
        phase = self.omega * span.start
        x = np.array([rate * angle, velocity, math.sin(phase), math.cos(phase), 1.0])
        x = np.linalg.matrix_power(step, steps) @ x
        return float(x[0]) / rate, float(x[1])

    def tolerance(self, span: Span) -> float:
        """1e-12 of the velocity scale, and what the rounding of the times makes of it."""
        reach = max(self.omega, self.line.natural_frequency, abs(self.damping(span)))
        return (1e-12 + 4.0 * EPS * span.end * reach) * self.speed * self.growth(span)

    def points(self, count: int) -> list[np.ndarray]:
        """``count`` times inside each span, none at its ends."""
        inner = (np.arange(count) + 0.5) / count
        return [span.start + (span.end - span.start) * inner for span in self.spans]


def spans_with(run: Run, points: list[np.ndarray]):
    """Each span with its times, angles and velocities as the solver gives them."""
    r = run.dense(np.concatenate(points))
    assert r.time.size == sum(part.size for part in points)
    cuts = np.cumsum([part.size for part in points])[:-1]
    angles, velocities = np.split(r.angle.values, cuts), np.split(r.velocity.values, cuts)
    torques = np.split(r.brake_torque.values, cuts)
    return zip(run.spans, points, angles, velocities, torques, strict=True)


def answered(case) -> Run:
    """The run of a case, and that it ended in one of the allowed ways."""
    run = Run(*case)
    assert run.response.attrs["status"] in ("completed", "diverged", "no_forward_solution")
    return run


@exact_property
@given(cases())
def test_every_exact_solution(case):
    run = answered(case)
    _check_events(run)
    closest = _check_pieces(run, run.points(200))
    _check_pieces(run, closest)  # nothing may hide between the points
    _check_rest(run)


def _check_events(run: Run) -> None:
    """Each event lies where the motion reaches its target."""
    r, release = run.response, [piece.low for piece in run.law.pieces[1:]]
    for i, span in enumerate(run.spans[:-1]):
        angle, velocity = run.flow(span)
        close = run.tolerance(span)
        natural = max(run.line.natural_frequency, run.omega)
        assert abs(velocity - float(r.event_velocity[i])) <= close
        assert abs(angle - float(r.event_angle[i])) * natural <= close
        v, kind = velocity + run.line.drive_speed, int(r.event_kind[i])
        if kind in (EventKind.STICK, EventKind.REVERSAL):
            assert abs(v) <= close
        elif kind == EventKind.BREAKPOINT:
            assert min(abs(v - w) for w in release if w != 0) <= close
        else:
            assert kind == EventKind.SLIP
            limit = run.law.upper if int(r.event_side[i]) > 0 else run.law.lower
            excess = run.pull(float(r.event_time[i]), angle, velocity) - limit
            assert abs(excess) <= 1e-12 * run.torque
    final = run.flow(run.spans[-1])
    close = run.tolerance(run.spans[-1])
    assert abs(final[1] - run.final[1]) <= close
    assert abs(final[0] - run.final[0]) * run.line.natural_frequency <= close


def _check_pieces(run: Run, points: list[np.ndarray]) -> list[np.ndarray]:
    """The velocity stays in its piece, and the torque is that of the piece.

    Returns times about where the velocity comes closest to leave the piece.
    """
    closest = []
    for span, t, _, velocity, brake in spans_with(run, points):
        v = velocity + run.line.drive_speed
        if span.piece is None:
            assert np.all(np.abs(v) <= 4.0 * EPS * abs(run.line.drive_speed))
        else:
            close = run.tolerance(span)
            assert np.all(v >= span.piece.low - close)
            assert np.all(v <= span.piece.high + close)
            if span.end > span.start:
                torque = span.piece.offset + span.piece.slope * v
                assert np.all(np.abs(torque - brake) <= 1e-12 * run.torque)
        ends = (t[max(i - 1, 0)] + (t[min(i + 1, t.size - 1)] - t[max(i - 1, 0)]) * _GRID
                for i in (np.argmin(v), np.argmax(v)))  # fmt: skip
        # Clipped: rounding must not carry a point into the next span.
        closest.append(np.clip(np.sort(np.concatenate(list(ends))), t[0], t[-1]))
    return closest


_GRID = np.linspace(0.0, 1.0, 51)


def _check_rest(run: Run) -> None:
    """At rest the brake holds."""
    room = 1e-12 * run.torque
    for span, t, angle, velocity, brake in spans_with(run, run.points(50)):
        if span.piece is not None:
            continue
        pull = run.pull(t, angle, velocity)
        assert np.all(pull >= run.law.lower - room)
        assert np.all(pull <= run.law.upper + room)
        assert np.all(np.abs(brake - pull) <= room)


@st.composite
def interrupted(draw: st.DrawFn):
    """A run, and a time to stop and start again: anywhere, or exactly at an event."""
    run = answered(draw(cases()))
    where = draw(st.sampled_from(("anywhere", "event", "stick")))
    fraction = draw(st.floats(0.0, 1.0))
    r = run.response
    if where == "event" and r.sizes["event"]:
        return run, float(r.event_time[int(fraction * (r.sizes["event"] - 1))])
    if where == "stick" and r.sizes["stick"]:
        i = int(fraction * (r.sizes["stick"] - 1))
        return run, 0.5 * float(r.stick_start[i] + r.stick_end[i])
    return run, fraction * run.end


@exact_property
@given(interrupted())
def test_restart(interrupted_run):
    """Going on from a state gives what the uninterrupted run gives.

    The tolerance is what changes of 1e-12 in the state restarted from make of the result,
    ten times over, since the restart rounds that state and the time anew.
    """
    run, t1 = interrupted_run
    t2 = min(run.end, t1 + 2.0 * 2.0 * math.pi / run.omega)
    assume(t2 - t1 > 1e-6 / run.omega)
    r = run.dense([t1, t2])
    angle, velocity = float(r.angle[0]), float(r.velocity[0])
    natural = max(run.line.natural_frequency, run.omega)
    unit = 1e-12 * run.speed

    def restarted(d_angle: float, d_velocity: float) -> np.ndarray:
        state = (angle + d_angle, velocity + d_velocity)
        again = wb.simulate(run.system, t2 - t1, start_time=t1, initial=state, times=[t2])
        reached = again.attrs["status"] != "no_forward_solution" and again.time.size
        assume(reached)
        return np.array([natural * float(again.angle[0]), float(again.velocity[0])])

    expected = np.array([natural * float(r.angle[1]), float(r.velocity[1])])
    plain = restarted(0.0, 0.0)
    changes = [(0.0, unit), (0.0, -unit), (unit / natural, 0.0), (-unit / natural, 0.0)]
    spread = sum(np.abs(restarted(*change) - plain) for change in changes)
    assert np.all(np.abs(plain - expected) <= 10.0 * spread.max() + unit)


def test_the_reference_law_is_the_models_law():
    """The restated law and the model agree, so that a disagreement elsewhere is the solver's."""
    for brake in (
        wb.WedgeBrake(radius=0.2, angle=0.34),
        wb.ConventionalBrake(radius=0.2),
        wb.BandBrake(radius=0.2, wrap_angle=4.0),
        wb.LeadingShoeBrake(radius=0.2, actuation_arm=0.2, normal_arm=0.1, friction_arm=0.08),
    ):
        system = wb.paper.system(eta=-24.0, static=0.33).replace(brake=brake)
        stated: Law = law(system)
        model = system.characteristic
        for got, expected in (
            ([p.offset for p in stated.pieces], model.offsets),
            ([p.slope for p in stated.pieces], model.slopes),
            ([p.low for p in stated.pieces[1:]], model.breakpoints),
            ([stated.lower, stated.upper], model.holding),
        ):
            assert got == pytest.approx(list(expected), rel=1e-13, abs=0.0)
