"""Machines with friction that is a curve over the sliding speed: the method "smooth".

The references share nothing with the package: Runge-Kutta of order 8 from event to event, with
sticks of their own, and 40-digit Taylor series.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import mpmath
import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp

import wedgebrake as wb
from machines import contact, single
from wedgebrake.dynamics.jit import compiled
from wedgebrake.model.studies.study import Study
from wedgebrake.model.studies.study_run import RunSettings
from wedgebrake.solvers.machine.assemble import assemble
from wedgebrake.solvers.machine.events.clock import Clock, expand_inputs
from wedgebrake.solvers.machine.events.curves import CURVE_TERMS, differentiate, expand_curves
from wedgebrake.solvers.machine.events.modes import select_system
from wedgebrake.solvers.machine.final_state import start_state
from wedgebrake.solvers.machine.problem import EVENT, run_of
from wedgebrake.solvers.machine.trajectory import trajectory
from wedgebrake.solvers.machine.trajectory.observers import observer_of

STICK, SLIP, REVERSAL, BREAKPOINT = 2, 3, 4, 5
# The oscillator on a belt x'' + 2 xi x' + x = mu(v) F, with Stribeck friction.
XI, KINETIC, STATIC, DECAY = 0.05, 0.5, 1.0, 0.5


class Stribeck(wb.SetValuedFriction):
    """The law of StribeckFriction as a class of a user's own."""

    kind = "own-stribeck"

    kinetic: float = wb.parameter("kinetic coefficient", example=0.5, ge=0)
    static: float = wb.parameter("static coefficient", example=1.0, ge=0)
    speed: float = wb.parameter("decay of the peak", unit="m/s", example=0.5, gt=0)

    @property
    def breakaway(self) -> float:
        return self.static

    def kinetic_at(self, speed: float) -> float:
        return self.kinetic + (self.static - self.kinetic) * math.exp(-speed / self.speed)


STRIBECK = wb.StribeckFriction(kinetic=KINETIC, static=STATIC, speed=DECAY)
TABLE = wb.TabulatedFriction(speeds=[0.0, 0.3, 0.9, 2.0], coefficients=[1.0, 0.7, 0.55, 0.5])


def oscillator(
    belt: Any = 0.5, friction: Any = STRIBECK, brake: Any = None, damping: float = 2.0 * XI,
    torque: Any = 0.0, start: tuple[float, float] = (0.0, 0.0), **actuation: Any,
) -> wb.Machine:  # fmt: skip
    """The oscillator of unit mass, stiffness and force on a belt."""
    angle, speed = start
    held = contact(
        "mass", name="belt", brake=brake, friction=friction, base_speed=belt, **actuation
    )
    return single(
        held, name="mass", stiffness=1.0, damping=damping, torque=torque, angle=angle, speed=speed
    )


def smooth(machine: wb.Machine, duration: float, **more: Any) -> Any:
    response = wb.simulate(machine, duration, method="smooth", **more)
    assert response.attrs["status"] == "completed", response.attrs["message"]
    return response


def switches(response: Any) -> tuple[np.ndarray, np.ndarray]:
    """Times and kinds of the events except breakpoints."""
    kept = response["event_kind"].values != BREAKPOINT
    return response["event_time"].values[kept], response["event_kind"].values[kept]


class Reference:
    """The oscillator by DOP853 from event to event, with sticks as x' = belt.

    gain  : torque over the force, g(side, speed >= 0), against the motion
    hold  : largest torque over the force at rest, forwards and backwards
    force : of time; with a lag it is its input
    kinks : sliding speeds at which the gain bends
    """

    def __init__(
        self, gain: Callable[[int, float], float], hold: tuple[float, float],
        force: Callable[[float], float] = lambda _t: 1.0, lag: float = 0.0, belt: float = 0.5,
        kinks: tuple[float, ...] = (), torque: Callable[[float], float] = lambda _t: 0.0,
    ) -> None:  # fmt: skip
        self.gain, self.hold, self.force, self.lag, self.belt = gain, hold, force, lag, belt
        self.torque, self.kinks = torque, kinks
        self.events: list[tuple[float, int]] = []

    def pressed(self, t: float, y: Any) -> float:
        return float(y[2]) if self.lag else self.force(t)

    def filtered(self, t: float, y: Any) -> float:
        return (self.force(t) - float(y[2])) / self.lag if self.lag else 0.0

    def held(self, t: float, y: Any) -> float:
        """Torque on the mass that keeps it on the belt."""
        return 2.0 * XI * self.belt + float(y[0]) - self.torque(t)

    def run(self, start: tuple[float, float], end: float) -> np.ndarray:
        """The state at the end; ``events`` holds (time, kind)."""
        t, y = 0.0, np.array([*start, self.force(0.0) if self.lag else 0.0])
        side = 1 if y[1] > self.belt else -1
        while t < end:
            if side == 0:
                t, y, side = self.stick(t, y, end)
            else:
                t, y, side = self.slide(t, y, side, end)
        return y

    def slide(self, t: float, y: Any, side: int, end: float) -> Any:
        def rates(t: float, y: Any) -> list[float]:
            speed = abs(y[1] - self.belt)
            push = -self.gain(side, speed) * self.pressed(t, y)
            rate = push + self.torque(t) - y[0] - 2.0 * XI * y[1]
            return [y[1], rate, self.filtered(t, y)]

        def stop(level: float) -> Callable[[float, Any], float]:
            def distance(t: float, y: Any) -> float:
                return float(side * (y[1] - self.belt) - level)

            distance.terminal = True  # type: ignore[attr-defined]
            return distance

        here = side * (y[1] - self.belt)
        if abs(here) < 1e-9:  # leave the stick by a short step, so that its end is no event
            begin = t
            t = min(t + 1e-3, end)
            options = {"method": "DOP853", "rtol": 1e-13, "atol": 1e-15}
            y = solve_ivp(rates, (begin, t), y, **options).y[:, -1]
        stops = [stop(0.0), *(stop(one) for one in self.kinks)]
        for one in stops[1:]:
            if abs(one(t, y)) < 1e-12:
                stops.remove(one)
        found = solve_ivp(
            rates, (t, end), y, method="DOP853", rtol=1e-13, atol=1e-15, events=stops,
            max_step=0.02,
        )  # fmt: skip
        t, y = float(found.t[-1]), found.y[:, -1]
        if found.status == 0:
            return end, y, side
        if not found.t_events[0].size:
            # Beyond the kink, so that it is not found again.
            ahead = min(t + 1e-4, end)
            found = solve_ivp(rates, (t, ahead), y, method="DOP853", rtol=1e-13, atol=1e-15)
            return ahead, found.y[:, -1], side
        y[1] = self.belt
        need, force = self.held(t, y), self.pressed(t, y)
        if -self.hold[0] * force <= need <= self.hold[1] * force:
            self.events.append((t, STICK))
            return t, y, 0
        self.events.append((t, REVERSAL))
        return t, y, -side

    def stick(self, t: float, y: Any, end: float) -> Any:
        def rates(t: float, y: Any) -> list[float]:
            return [self.belt, 0.0, self.filtered(t, y)]

        def upper(t: float, y: Any) -> float:
            return self.hold[1] * self.pressed(t, y) - self.held(t, y)

        def lower(t: float, y: Any) -> float:
            return self.hold[0] * self.pressed(t, y) + self.held(t, y)

        upper.terminal = lower.terminal = True  # type: ignore[attr-defined]
        found = solve_ivp(
            rates, (t, end), y, method="DOP853", rtol=1e-13, atol=1e-15, events=[upper, lower],
            max_step=0.02,
        )  # fmt: skip
        t, y = float(found.t[-1]), found.y[:, -1]
        if found.status == 0:
            return end, y, 0
        self.events.append((t, SLIP))
        # Beyond what it can push forwards the mass lags behind the belt.
        return t, y, -1 if found.t_events[0].size else 1


def stribeck_gain(side: int, speed: float) -> float:
    return side * (KINETIC + (STATIC - KINETIC) * math.exp(-speed / DECAY))


def table_gain(side: int, speed: float) -> float:
    return side * float(np.interp(speed, TABLE.speeds, TABLE.coefficients))


def compare(response: Any, reference: Reference, start: tuple[float, float], tol: float) -> None:
    end = float(response["time"][-1])
    state = reference.run(start, end)
    times, kinds = switches(response)
    assert kinds.tolist() == [kind for _, kind in reference.events]
    assert len(kinds) > 3
    np.testing.assert_allclose(times, [t for t, _ in reference.events], rtol=0, atol=tol)
    assert response["angle"].values[-1, 0] == pytest.approx(state[0], abs=tol)
    assert response["velocity"].values[-1, 0] == pytest.approx(state[1], abs=tol)


def test_stick_slip_cycle() -> None:
    response = smooth(oscillator(), 40.0)
    compare(response, Reference(stribeck_gain, (STATIC, STATIC)), (0.0, 0.0), 1e-10)
    # A cycle: the return time does not change any more.
    times, kinds = switches(response)
    periods = np.diff(times[kinds == STICK])
    assert np.ptp(periods[1:]) < 1e-12


def test_one_phase_against_forty_digits() -> None:
    """A free slip, from a speed above that of the belt through several pieces of the curve."""
    start, duration = (0.3, 1.4), 0.7
    response = smooth(oscillator(0.2, start=start), duration)
    assert response.sizes["event"] == 0
    with mpmath.workdps(40):
        mu, peak, decay = (mpmath.mpf(one) for one in (KINETIC, STATIC - KINETIC, DECAY))
        belt, damping = mpmath.mpf(0.2), mpmath.mpf(2.0 * XI)

        def rates(_t: Any, y: Any) -> list[Any]:
            friction = mu + peak * mpmath.exp(-(y[1] - belt) / decay)
            return [y[1], -y[0] - damping * y[1] - friction]

        angle, speed = mpmath.odefun(rates, 0, [mpmath.mpf(one) for one in start])(duration)
    assert float(response["angle"][-1, 0] - float(angle)) == pytest.approx(0.0, abs=4e-16)
    assert float(response["velocity"][-1, 0] - float(speed)) == pytest.approx(0.0, abs=2e-15)


@pytest.mark.parametrize(
    "brake",
    [
        wb.WedgeBrake(angle=math.atan(1.3), radius=1.0),
        wb.BandBrake(wrap_angle=0.8, radius=1.0),
    ],
    ids=["wedge", "band"],
)
def test_brakes(brake: Any) -> None:
    """The amplification is that of the coefficient at each speed."""
    law = {"kinetic": 0.4, "static": 0.7, "speed": 0.3}

    def gain(side: int, speed: float) -> float:
        mu = law["kinetic"] + (law["static"] - law["kinetic"]) * math.exp(-speed / law["speed"])
        return float(brake.amplification(side * mu))

    friction = wb.StribeckFriction(**law)
    hold = (brake.amplification(law["static"]), -brake.amplification(-law["static"]))
    wave = wb.Harmonic(1.5, 0.11)
    response = smooth(oscillator(0.3, friction, brake, torque=wave), 40.0)
    reference = Reference(
        gain, hold, belt=0.3, torque=lambda t: 1.5 * math.sin(2.0 * math.pi * 0.11 * t)
    )
    compare(response, reference, (0.0, 0.0), 1e-10)


@pytest.mark.parametrize("lag", [0.0, 0.4])
@pytest.mark.parametrize("friction", [STRIBECK, TABLE], ids=["stribeck", "table"])
def test_force_that_varies(friction: Any, lag: float) -> None:
    """The torque is the product of friction over speed and a force over time, with a lag."""
    frequency = 0.23
    force = 1.0 + 0.4 * wb.Harmonic(1.0, frequency)
    machine = oscillator(0.4, friction, force=force, lag=lag)
    table = friction is TABLE
    reference = Reference(
        table_gain if table else stribeck_gain, (1.0, 1.0), lag=lag, belt=0.4,
        force=lambda t: 1.0 + 0.4 * math.sin(2.0 * math.pi * frequency * t),
        kinks=TABLE.speeds[1:] if table else (),
    )  # fmt: skip
    compare(smooth(machine, 30.0), reference, (0.0, 0.0), 1e-10)
    with pytest.raises(wb.InputError) as refused:
        wb.simulate(machine, 30.0, method="exact")
    assert refused.value.name == "belt.friction"


def test_lines_tend_to_the_curve() -> None:
    curve = switches(smooth(oscillator(), 40.0))
    errors = []
    for tolerance in (1e-4, 1e-6, 1e-8):
        machine = oscillator().replace({"belt.tolerance": tolerance})
        lines = switches(wb.simulate(machine, 40.0))
        assert lines[1].tolist() == curve[1].tolist()
        errors.append(np.max(np.abs(lines[0] - curve[0])))
    assert errors[2] < 1e-7
    assert errors[2] < 0.1 * errors[1] < 0.01 * errors[0]


def test_table_under_constant_force() -> None:
    """Where g is linear the lines are the table."""
    for actuation in ({}, {"slope": -0.1}):
        machine = oscillator(0.4, TABLE, torque=wb.Harmonic(0.3, 0.1), **actuation)
        if actuation:
            table = wb.TabulatedFriction(speeds=[0.0], coefficients=[0.8], static=1.0)
            machine = machine.replace({"belt.friction": table})
        exact, curve = wb.simulate(machine, 40.0), smooth(machine, 40.0)
        for one, other in zip(switches(exact), switches(curve), strict=True):
            np.testing.assert_allclose(other, one, rtol=0, atol=1e-10)
        for name in ("angle", "velocity", "brake_torque", "actuation_force"):
            np.testing.assert_allclose(curve[name], exact[name], rtol=0, atol=1e-10)


def test_energy_balances() -> None:
    force = 1.0 + 0.6 * wb.Harmonic(1.0, 0.23)
    for friction in (STRIBECK, TABLE):
        machine = oscillator(0.4, friction, torque=wb.Harmonic(0.5, 0.1), force=force)
        found = wb.energy(smooth(machine, 40.0))
        exchanged = float(np.abs(found["friction_heat"]).sum() + np.abs(found["base_work"]).sum())
        assert exchanged > 1.0
        assert abs(float(found["residual"])) < 1e-13 * exchanged


@pytest.mark.parametrize("stop", [3.1, 8.0, 20.3])
def test_restart(stop: float) -> None:
    wave = wb.Harmonic(0.4, 0.17)
    machine = oscillator(0.4, torque=wave, force=1.0 + 0.3 * wave, lag=0.2)
    whole = smooth(machine, 40.0)
    first = smooth(machine, stop)
    times = whole["time"].values[whole["time"].values > stop]
    later = smooth(machine, 40.0 - stop, initial=wb.final_state(first), times=times)
    joined = np.append(first["event_time"], later["event_time"])
    np.testing.assert_allclose(joined, whole["event_time"], rtol=0, atol=1e-11)
    np.testing.assert_allclose(later["angle"], whole["angle"].sel(time=times), rtol=0, atol=1e-11)


def test_restart_with_other_lines() -> None:
    """A run by lines goes on with the curve, whose pieces are others, in mid-slip."""
    machine = oscillator().replace({"belt.tolerance": 1e-8})
    lines = wb.simulate(machine, 4.3)
    assert not lines["sticking"].values[-1, 0]
    later = smooth(machine, 10.0, initial=wb.final_state(lines))
    whole = wb.simulate(machine, 14.3)
    back = wb.simulate(machine, 10.0, initial=wb.final_state(smooth(machine, 4.3)))
    for one in (later, back):
        times, kinds = switches(one)
        expected = switches(whole)
        np.testing.assert_allclose(times, expected[0][-times.size :], rtol=0, atol=1e-7)
        assert kinds.tolist() == expected[1][-times.size :].tolist()


def test_mirror_symmetry() -> None:
    """A conventional brake does the same in both directions."""
    wave = wb.Harmonic(1.0, 0.17)
    for friction in (STRIBECK, TABLE):
        one = smooth(oscillator(0.4, friction, torque=wave), 40.0)
        other = smooth(oscillator(-0.4, friction, torque=-1.0 * wave), 40.0)
        np.testing.assert_array_equal(one["event_time"], other["event_time"])
        np.testing.assert_array_equal(one["angle"], -other["angle"])


def test_law_of_a_user() -> None:
    own = Stribeck(kinetic=KINETIC, static=STATIC, speed=DECAY)
    one, other = smooth(oscillator(friction=own), 40.0), smooth(oscillator(), 40.0)
    np.testing.assert_array_equal(one["angle"], other["angle"])
    assert own.reference == STATIC
    with pytest.raises(wb.InputError) as refused:
        wb.simulate(oscillator(friction=own), 1.0, method="exact")
    assert refused.value.name == "belt.friction"
    text = Study(oscillator(friction=own), RunSettings(method="smooth")).to_toml()  # type: ignore[arg-type]
    study: Any = wb.read_study(text)
    assert study.run.method == "smooth"
    assert study.system.contacts[0].friction == own


def test_a_curve_of_a_driveline_needs_no_method() -> None:
    """As of its machine, a law without lines is solved by its curve."""
    line = wb.BrakedDriveline(
        driveline=wb.Driveline(inertia=1.0, damping=0.1, stiffness=100.0),
        brake=wb.ConventionalBrake(radius=0.2),
        friction=Stribeck(kinetic=KINETIC, static=STATIC, speed=DECAY),
        actuation=wb.Actuation(initial_force=10.0),
        excitation=wb.HarmonicTorque(20.0, 1.3),
    )
    one, other = (wb.simulate(each, 3.0, samples=31) for each in (line, line.machine))
    assert one.attrs["method"] == other.attrs["method"] == "smooth"
    np.testing.assert_array_equal(one["angle"], other["angle"][:, 0])


class Rough(wb.SetValuedFriction):
    """A law of |v - 1| to a power, or without a value."""

    kind = ""

    power: float
    known: tuple[float, ...] = ()
    low: float = 0.1

    @property
    def breakaway(self) -> float:
        return 0.5

    @property
    def bends(self) -> tuple[float, ...]:
        return self.known

    def kinetic_at(self, speed: float) -> float:
        return self.low + 0.3 * min(abs(speed - 1.0), 1.0) ** self.power


def test_kinks() -> None:
    """A curve with stated kinks is that of a table."""
    table = wb.TabulatedFriction(speeds=[0.0, 1.0, 2.0], coefficients=[0.4, 0.1, 0.4], static=0.5)
    one, other = (
        smooth(oscillator(2.0, law, torque=wb.Harmonic(2.0, 0.2)), 30.0)
        for law in (Rough(power=1.0, known=(1.0, 2.0)), table)
    )
    assert one.sizes["event"] > 5
    np.testing.assert_allclose(one["event_time"], other["event_time"], rtol=0, atol=1e-11)
    np.testing.assert_array_equal(one["event_kind"], other["event_kind"])


@pytest.mark.parametrize(
    ("law", "words"),
    [
        (Rough(power=1.0, low=-0.2), "must be finite"),
        (Rough(power=1.0, low=0.4), "breakaway"),
        (Rough(power=0.1), "not smooth"),
        (Rough(power=0.5), "not smooth"),
    ],
)
def test_laws_that_are_refused(law: Any, words: str) -> None:
    with pytest.raises(wb.InputError, match=words):
        smooth(oscillator(friction=law), 1.0)


def test_self_locking_at_low_speed() -> None:
    """A wedge that slides only above the speed at which the coefficient is that of its angle."""
    brake = wb.WedgeBrake(angle=math.atan(0.6), radius=1.0)
    law = wb.StribeckFriction(kinetic=0.4, static=0.8, speed=0.5)  # mu = 0.6 at 0.5 ln 2
    machine = single(contact("mass", brake=brake, friction=law, force=0.2), name="mass", speed=2.0)
    response = wb.simulate(machine, 10.0, method="smooth")
    assert response.attrs["status"] == "no_forward_solution"
    speed = wb.final_state(response).speeds["mass"]
    assert speed == pytest.approx(0.5 * math.log(2.0), rel=1e-5)

    # v' = -F mu/(0.6 - mu)
    inverse = lambda v: (0.6 - law.kinetic_at(v)) / (0.2 * law.kinetic_at(v))  # noqa: E731
    duration = quad(inverse, 0.5 * math.log(2.0), 2.0, epsabs=1e-13)[0]
    assert response.attrs["final_time"] == pytest.approx(duration, abs=1e-10)


def test_driveline() -> None:
    """A driveline with Stribeck friction goes through its machine."""
    system = wb.paper.system(eta=-24).replace(
        friction=wb.StribeckFriction(kinetic=0.25, static=0.3, speed=0.05, tolerance=1e-8)
    )
    lines = wb.simulate(system, periods=20)
    curve = wb.simulate(system, periods=20, method="smooth")
    assert curve.attrs["method"] == "smooth"
    np.testing.assert_allclose(curve["angle"], lines["angle"], rtol=0, atol=1e-6)
    assert wb.sticks(curve).attrs["count"] == wb.sticks(lines).attrs["count"] > 3


def test_derivatives_of_a_torque() -> None:
    """dT/dv and dT/dF over a cell are differences of the torque."""
    problem, run, slot = _sliding()
    terms = np.int64(CURVE_TERMS)
    h = _differentiated(problem, run, slot, terms)
    curve, z = run.curves[0], run.z
    column = problem.states + problem.contacts[0]["curve"]
    row, force = problem.sliding[0], run.systems.force[slot, 0]
    at = np.linspace(0.0, h, 5)
    value = lambda series: np.polynomial.polynomial.polyval(at, series[:terms])  # noqa: E731
    speed, push, torque = value(row @ z), value(force @ z), value(z[column])
    gain = np.array([stribeck_gain(1, one) for one in speed])
    slope = (KINETIC - gain) / DECAY
    np.testing.assert_allclose(torque, -gain * push, rtol=0, atol=1e-14)
    np.testing.assert_allclose(value(curve["by_force"]), -gain, rtol=0, atol=1e-13)
    np.testing.assert_allclose(value(curve["by_speed"]), -slope * push, rtol=0, atol=1e-12)


def _sliding() -> Any:
    """The numbers of an oscillator that slides forwards, and its run."""
    force = 1.0 + 0.4 * wb.Harmonic(1.0, 0.23)
    machine = oscillator(0.2, start=(0.3, 1.4), force=force)
    problem = assemble(machine, 0.0, curved=True).problem
    run = run_of(problem)
    start_state(machine, problem, run)
    span = trajectory.Span(1.0, 0, 0, False, True, False, np.zeros(1, np.bool_))
    trajectory.move(problem, run, span, np.zeros(1, EVENT), observer_of(problem, np.empty(0)))
    return problem, run, select_system(problem, run)


@compiled
def _differentiated(problem, run, slot, terms):  # type: ignore[no-untyped-def]
    """Expand a cell, and the derivatives of its torques; returns its length."""
    expand_inputs(problem, run, Clock(0.0, 0.0))
    h = expand_curves(problem, run, slot, terms, 10.0)
    differentiate(problem, run, terms)
    return h
