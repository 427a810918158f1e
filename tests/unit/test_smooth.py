"""The smooth solver against SciPy's integrators, and in the places where it could go wrong."""

from __future__ import annotations

import itertools
import math

import numba
import numpy as np
import pytest
from scipy.integrate import simpson, solve_ivp

import wedgebrake as wb
from equations import coefficient, right_side
from wedgebrake.dynamics.enums import EventKind
from wedgebrake.model.friction import Friction, SmoothFriction
from wedgebrake.model.part import parameter
from wedgebrake.model.studies.study import RunSettings

REST = (0.0, 0.0)


def paper(**changes) -> wb.BrakedDriveline:
    """The paper's wedge at eta = -24, F_0 = 0.036 with the smoothed law, then changed."""
    return wb.paper.system(friction="smoothed").replace(**changes)


def scipy_states(system, times, start=REST, method="DOP853", rtol=1e-12, max_step=2e-4):
    """(n, 2) states at ``times`` by SciPy, split at zero sliding speed and at the release."""
    drive, release = system.driveline.drive_speed, system.actuation.release_speed
    kinks = [0.0, *([release, -release] if math.isfinite(release) else [])]
    events = []
    for kink in kinks:

        def event(_, y, kink=kink):
            return y[1] + drive - kink

        event.terminal = True
        events.append(event)
    t, y, slope, end = 0.0, np.array(start, dtype=float), right_side(system), float(times[-1])
    states = np.empty((times.size, 2))
    while t < end:
        piece = solve_ivp(
            slope, (t, end), y, method=method, rtol=rtol, atol=1e-14, max_step=max_step,
            events=events, dense_output=True,
        )  # fmt: skip
        assert piece.status >= 0
        inside = (times >= t) & (times <= piece.t[-1])
        if np.any(inside):
            states[inside] = piece.sol(times[inside]).T
        # Off the kink: the event function must not vanish at the start.
        t, y = float(piece.t[-1]) + 1e-12, piece.y[:, -1]
        y = y + 1e-12 * np.array(slope(t, y))
    return states


@numba.njit
def falling(v):
    """Leine's falling friction, smoothed by arctan; a kink at 0."""
    return 0.3 / (1.0 + 3.0 * abs(v)) * 2.0 / math.pi * math.atan(100.0 * v)


def falling_plain(v):
    return 0.3 / (1.0 + 3.0 * abs(v)) * 2.0 / math.pi * math.atan(100.0 * v)


def same_as_smoothed(v):
    """The paper's law, of which the solver does not know that it saturates."""
    return 0.3 * math.tanh(100.0 * v)


SHOE = wb.LeadingShoeBrake(radius=0.2, actuation_arm=0.2, normal_arm=0.1, friction_arm=0.08)
CASES = {
    "wedge": (paper(), REST),
    "conventional": (wb.paper.system(friction="smoothed", brake="conventional"), REST),
    "band": (paper(brake=wb.BandBrake(radius=0.2, wrap_angle=4.0)), REST),
    "leading shoe": (paper(brake=SHOE), REST),
    "static peak": (paper(static=0.33), REST),
    "static peak, turning": (paper(static=0.33, drive_speed=3.0), (0.001, -3.0)),
    "turning backwards": (paper(drive_speed=-3.0), (0.01, 3.0)),
    "paper as printed": (paper(release=False, damping=1.0, eta=-3.0), REST),
    "growing force": (paper(slope=40.0), REST),
    "no initial force, growing": (paper(initial_force=0.0, slope=40.0), REST),
    "never pressed": (paper(initial_force=0.0, slope=-40.0), (0.0, 0.5)),
    "no friction": (paper(kinetic=0.0, static=0.0), (0.0, 0.5)),
    "peak over no kinetic friction": (paper(kinetic=0.0, static=0.2), (0.0, 0.5)),
    "no damping": (paper(damping=0.0), REST),
    "no spring": (paper(stiffness=0.0), REST),
    "no torque": (paper(amplitude=0.0), (0.2, 2.0)),
    "custom, compiled": (paper(friction=wb.CustomFriction(law=falling, width=0.01)), REST),
    "custom, plain": (paper(friction=wb.CustomFriction(law=falling_plain, width=0.01)), REST),
    "custom, like the paper's": (
        paper(friction=wb.CustomFriction(law=same_as_smoothed, width=0.01)),
        REST,
    ),
}


def scales(states):
    """(2,) angle and velocity that the motion reaches."""
    return np.max(np.abs(states), axis=0) + 1e-12


@pytest.mark.parametrize("name", CASES)
def test_against_scipy(name):
    """Measured: 1e-13 to 3e-11 of the motion; both errors are the step errors times growth."""
    system, start = CASES[name]
    times = np.linspace(0.0, 0.2, 41)
    expected = scipy_states(system, times, start)
    r = wb.simulate(system, 0.2, initial=start, times=times, rtol=1e-12)
    assert r.attrs["status"] == "completed"
    got = np.column_stack((r.angle.values, r.velocity.values))
    assert np.max(np.abs(got - expected) / scales(expected)) <= 3e-10


@pytest.mark.parametrize("steepness", [1e3, 1e4, 1e5])
def test_steep_law_against_radau(steepness):
    """SciPy's implicit method at 1e-10, whose own error is what the tolerance allows for."""
    system = paper(friction=wb.SmoothedFriction(kinetic=0.3, steepness=steepness))
    times = np.linspace(0.0, 0.06, 25)
    expected = scipy_states(system, times, method="Radau", rtol=1e-10, max_step=1e-4)
    r = wb.simulate(system, 0.06, times=times, rtol=1e-10)
    got = np.column_stack((r.angle.values, r.velocity.values))
    assert np.max(np.abs(got - expected) / scales(expected)) <= 1e-7


class TestKinks:
    @pytest.mark.parametrize("rtol", [1e-6, 1e-9])
    @pytest.mark.parametrize("friction", ["smoothed", "custom"])
    def test_release_passed_by_a_hair_is_seen(self, friction, rtol):
        """Near t = 0.340 s the speed passes the release speed by only 0.0086 rad/s."""
        system = paper()
        if friction == "custom":
            system = system.replace(
                friction=wb.CustomFriction(law=same_as_smoothed, width=0.01),
                slope=system.actuation.slope,
            )
        release = system.actuation.release_speed
        r = wb.simulate(system, 0.4, times=np.linspace(0.335, 0.345, 2001), rtol=rtol)
        assert float(np.abs(r.velocity).max()) - release == pytest.approx(0.0086, abs=1e-4)
        near = (np.abs(r.event_time - 0.34) < 0.005).values
        assert list(r.event_kind.values[near]) == [EventKind.BREAKPOINT] * 2
        assert np.abs(r.event_velocity.values[near]) == pytest.approx(release)

    @pytest.mark.parametrize("brake", ["wedge", "conventional"])
    def test_start_at_rest_is_no_event(self, brake):
        """Velocity and acceleration both vanish at t = 0."""
        system = wb.paper.system(friction="smoothed", brake=brake)
        for rtol in (1e-3, 1e-6, 1e-9, 1e-12):
            r = wb.simulate(system, 0.5, rtol=rtol, max_steps=20_000)
            assert r.attrs["status"] == "completed"
            assert r.event_time.values[0] > 0.01
            assert np.all(np.diff(r.event_time.values) > 0.0)

    def test_rest_for_ever(self):
        r = wb.simulate(paper(amplitude=0.0), periods=100)
        assert (r.sizes["event"], r.sizes["stick"]) == (0, 1)
        assert np.all(r.velocity.values == 0.0)


class TestSelfLocking:
    """The wall: forward speeds at which the torque becomes infinite."""

    @pytest.mark.parametrize(
        ("alpha", "static"), [(0.9, 0.3), (1.0, 0.3), (1.05, 0.36)], ids=["0.9", "1.0", "peak"]
    )
    def test_is_approached_and_never_crossed(self, alpha, static):
        system = paper(eta=0.0, alpha=alpha, static=static)
        tangent, radius = math.tan(system.brake.angle), system.brake.radius
        times = np.linspace(0.0, 0.1, 2001)
        r = wb.simulate(system, 0.1, times=times, rtol=1e-10)
        assert r.attrs["status"] == "completed"
        velocities = np.concatenate((r.velocity.values, r.event_velocity.values))
        m = np.array([coefficient(system.friction, radius * v) for v in velocities])
        assert np.max(m) < tangent
        assert np.max(m) > 0.8 * tangent  # it was approached
        assert np.all(np.isfinite(r.brake_torque.values))
        some = times[::100]
        expected = scipy_states(system, some, method="Radau", rtol=1e-9, max_step=1e-4)
        got = np.column_stack((r.angle.values, r.velocity.values))[::100]
        assert np.max(np.abs(got - expected) / scales(expected)) <= 1e-7

    @pytest.mark.parametrize(("alpha", "velocity"), [(0.9, 2.0), (1.0, 2.0), (0.9, 0.1)])
    def test_start_beyond_it_has_no_solution(self, alpha, velocity):
        """Also inside the steep layer, at 0.1 rad/s."""
        r = wb.simulate(paper(eta=0.0, alpha=alpha), 0.1, initial=(0.0, velocity))
        assert r.attrs["status"] == "no_forward_solution"
        assert r.attrs["final_time"] == 0.0
        assert not np.any(np.isnan(r.velocity.values))

    def test_slowing_down_into_a_static_peak(self):
        """Fast sliding is free, but the static peak locks: no solution from there on."""
        system = paper(eta=0.0, alpha=1.05, static=0.36, amplitude=0.0)
        r = wb.simulate(system, 0.1, initial=(0.0, 3.0))
        assert r.attrs["status"] == "no_forward_solution"
        m = coefficient(system.friction, 0.2 * r.attrs["final_velocity"])
        assert m < math.tan(system.brake.angle)
        assert m == pytest.approx(math.tan(system.brake.angle), rel=1e-3)


class TestOutput:
    def test_wanted_times_equal_runs_that_end_there(self):
        system = paper(eta=-60.0)
        times = np.sort(np.random.default_rng(3).uniform(0.0, 0.4, 40))
        r = wb.simulate(system, 0.4, times=times, rtol=1e-8)
        for i, t in enumerate(times):
            one = wb.simulate(system, float(t), times=[], rtol=1e-8)
            assert float(r.angle[i]) == pytest.approx(one.attrs["final_angle"], abs=1e-10)
            assert float(r.velocity[i]) == pytest.approx(one.attrs["final_velocity"], abs=1e-8)

    @pytest.mark.parametrize("system", [paper(), paper(static=0.33, drive_speed=2.0)])
    def test_restart(self, system):
        """The state is all there is: a run resumed from it goes on alike."""
        begin = (0.0, -system.driveline.drive_speed)
        whole, first = (
            wb.simulate(system, end, initial=begin, times=[], rtol=1e-12).attrs
            for end in (0.4, 0.2123)
        )
        middle = (first["final_angle"], first["final_velocity"])
        rest = wb.simulate(
            system, 0.4 - 0.2123, initial=middle, start_time=0.2123, times=[], rtol=1e-12
        ).attrs
        assert rest["final_time"] == pytest.approx(0.4, abs=1e-15)
        assert rest["final_angle"] == pytest.approx(whole["final_angle"], abs=1e-11)
        assert rest["final_velocity"] == pytest.approx(whole["final_velocity"], abs=1e-9)

    def test_sections_are_states_at_period_starts(self):
        system = paper()
        r = wb.simulate(system, periods=20, rtol=1e-10)
        assert r.sizes["period"] == 21
        assert r.sizes["time"] == 20 * 200 + 1  # the very end included
        at = wb.simulate(system, periods=20, times=r.poincare_time.values, rtol=1e-10)
        assert r.poincare_angle.values == pytest.approx(at.angle.values, abs=1e-9)
        assert r.poincare_velocity.values == pytest.approx(at.velocity.values, abs=1e-7)

    def test_sticks_are_long_stays_in_the_layer(self):
        system = paper(eta=0.0, F0=0.09)
        r = wb.simulate(system, periods=20, samples_per_period=1000)
        band = 1.0 / (100.0 * 0.2)
        inside = np.abs(r.velocity.values) <= band
        assert np.mean(inside == (r.sticking.values == 1)) > 0.995
        assert np.all(r.stick_end.values > r.stick_start.values)
        assert np.all(r.stick_start.values[1:] > r.stick_end.values[:-1])


def test_loose_tolerance():
    """Even at 1e-2 the answer is a motion near the right one, and takes fewer steps."""
    system = paper(eta=0.0, F0=0.09)
    times = np.linspace(0.0, 0.3, 61)
    right = wb.simulate(system, 0.3, times=times, rtol=1e-10)
    loose = wb.simulate(system, 0.3, times=times, rtol=1e-2)
    assert loose.attrs["status"] == "completed"
    error = np.abs(loose.velocity - right.velocity).max() / np.abs(right.velocity).max()
    assert float(error) <= 0.1
    assert loose.attrs["work"] < 0.75 * right.attrs["work"]


def test_energy_balance():
    """Work of the torque = kinetic and potential energy + what damper and brake take."""
    system = paper(drive_speed=1.5)
    count = 200_001
    start = (0.0, -1.5)
    r = wb.simulate(system, 0.5, initial=start, times=np.linspace(0.0, 0.5, count), rtol=1e-11)
    line = system.driveline
    t, theta, w = r.time.values, r.angle.values, r.velocity.values
    energy = 0.5 * line.inertia * w**2 + 0.5 * line.stiffness * theta**2
    power = (r.drive_torque.values - r.brake_torque.values - line.damping * w) * w
    assert simpson(power, x=t) == pytest.approx(energy[-1] - energy[0], abs=1e-7 * energy.max())


class TestEnd:
    def test_divergence_is_an_answer(self):
        system = wb.paper.system(friction="smoothed", release=False, damping=1.0)
        r = wb.simulate(system, 25.0)
        assert r.attrs["status"] == "diverged"
        assert r.attrs["final_time"] < 25.0
        for name in r.variables:
            if r[name].values.dtype.kind == "f":
                assert np.all(np.isfinite(r[name].values))

    def test_step_limit_keeps_time_and_state_together(self):
        system = paper(eta=-60.0)
        for limit in (1, 200, 777):
            r = wb.simulate(system, 5.0, times=[], max_steps=limit, rtol=1e-10)
            assert r.attrs["status"] == "step_limit"
            t = r.attrs["final_time"]
            assert 0.0 < t < 5.0
            right = wb.simulate(system, t, times=[], rtol=1e-10)
            assert r.attrs["final_angle"] == pytest.approx(right.attrs["final_angle"], abs=1e-10)
            assert r.attrs["final_velocity"] == pytest.approx(
                right.attrs["final_velocity"], abs=1e-8
            )

    def test_law_that_numba_cannot_compile(self):
        def printed(v):
            return float(f"{0.3 * math.tanh(v)}")

        def helped(v):
            return falling_plain(v)

        for law in (printed, helped):
            system = paper(friction=wb.CustomFriction(law=law, width=0.01))
            with pytest.raises(wb.InputError, match=f"{law.__name__}: Numba cannot compile"):
                wb.simulate(system, 0.1)


def test_no_event_is_lost_between_tolerances():
    """The same reversals and releases at every tolerance, at the same times."""
    found = [
        wb.simulate(paper(eta=-60.0), 1.0, times=[], rtol=rtol) for rtol in (1e-6, 1e-9, 1e-12)
    ]
    for a, b in itertools.pairwise(found):
        assert np.array_equal(a.event_kind.values, b.event_kind.values)
        assert np.max(np.abs(a.event_time.values - b.event_time.values)) <= 1e-5


def test_a_law_that_jumps_at_rest_is_refused():
    """Or is far steeper than stated: it would be crept through for ever."""
    for law in (lambda v: math.copysign(0.3, v) if v else 0.0, lambda v: 0.3 * math.tanh(1e6 * v)):
        with pytest.raises(wb.InputError, match="width ="):
            wb.CustomFriction(law=law, width=0.01)
    for width in (1e-3, 1e-2, 1e-1):  # a stated width need not be the exact one
        wb.CustomFriction(law=lambda v: 0.3 * math.tanh(100.0 * v), width=width)


@pytest.mark.parametrize("share", [1.0, -1.0])
def test_a_law_that_misses_0_at_rest_by_rounding(share):
    """A jump of 8.9e-16 at rest, as the tail of a bump leaves it, is no friction at rest."""

    def law(speed):
        return 0.3 * math.tanh(100.0 * speed) + math.copysign(8.9e-16, speed)

    held, clean = (
        paper(amplitude=0.0, friction=wb.CustomFriction(law=one, width=0.01, kinetic=0.3))
        for one in (law, same_as_smoothed)
    )
    for initial in (REST, (share * 1e-3, 0.0)):
        found, expected = (
            wb.simulate(system, periods=5, initial=initial, max_steps=2000)
            for system in (held, clean)
        )
        assert found.attrs["status"] == "completed"
        np.testing.assert_allclose(found.angle, expected.angle, rtol=1e-6, atol=1e-15)


@pytest.mark.parametrize("start", [1e-20, 1e-100, 1e-280, 1e-310])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_motion_far_below_the_tolerance_is_no_more_work(start, sign):
    """Next to rest the steep layer is a damper, whatever the size of the motion."""
    system = paper(amplitude=0.0)
    large, small = (
        wb.simulate(system, periods=3, initial=(sign * size, 0.0), max_steps=20_000)
        for size in (1e-9, start)
    )
    assert small.attrs["status"] == "completed"
    if start >= 1e-100:
        assert small.attrs["work"] <= 2 * large.attrs["work"]
        np.testing.assert_allclose(small.angle / start, large.angle / 1e-9, rtol=1e-3)


@pytest.mark.parametrize(("speed", "width"), [(0.5, 1e-3), (0.4, 2e-3)])
def test_a_narrow_place_that_is_named_is_not_stepped_over(speed, width):
    """A bump of the friction far from rest, a tenth of the steep layer's width and less."""

    def law(v):
        x = (abs(v) - speed) / width
        bump = 0.03 * math.exp(-min(x * x, 500.0))
        return math.copysign((0.3 + bump) * math.tanh(abs(v) / 0.01), v)

    friction = wb.CustomFriction(law=law, width=0.01, kinetic=0.3, narrow=[(speed, width)])
    system = paper(friction=friction, slope=0.0)
    initial, end = (0.0, 3.0), 0.04
    found = wb.simulate(system, end, initial=initial, times=[], rtol=1e-11)
    # Steps too short to pass over anything.
    longest = 0.3 * width / system.brake.radius / 500.0
    expected = solve_ivp(
        right_side(system),
        (0.0, end),
        initial,
        method="DOP853",
        rtol=1e-12,
        atol=1e-14,
        max_step=longest,
    ).y[:, -1]
    assert abs(found.attrs["final_angle"] - expected[0]) <= 1e-10
    assert abs(found.attrs["final_velocity"] - expected[1]) <= 1e-8


@pytest.mark.parametrize("place", [(0.0, 1e-3), (-0.5, 1e-3), (0.5, 1e-12), (0.5, 0.0), (1e7, 1.0)])
def test_a_narrow_place_that_is_none_is_refused(place):
    with pytest.raises(wb.InputError, match=r"friction.narrow\[0\]"):
        wb.CustomFriction(law=same_as_smoothed, width=0.01, narrow=[place])


@pytest.mark.parametrize("system", [paper(), paper(static=0.33)], ids=["series", "Runge-Kutta"])
def test_the_last_sample_is_the_state_at_the_end(system):
    """However densely the response is sampled, also where it ends at a return to the section."""
    runs = [wb.simulate(system, periods=3, samples_per_period=count) for count in (20, 40)]
    for run in runs:
        assert run.angle.values[-1] == run.attrs["final_angle"] == run.poincare_angle.values[-1]
        assert run.velocity.values[-1] == run.attrs["final_velocity"]
    np.testing.assert_allclose(runs[0].velocity, runs[1].velocity[::2], rtol=1e-8, atol=1e-9)


@pytest.fixture
def stribeck():
    """A named law of one's own: mu (1 + peak e^(-|v|/decay)) 2/pi atan(v/width)."""
    registered = dict(Friction.kinds)

    class Stribeck(SmoothFriction):
        kind = "own-stribeck"
        kinetic: float = parameter("kinetic coefficient", symbol="mu", unit="1", example=0.3, gt=0)
        peak: float = parameter("relative peak", symbol="p", unit="1", example=0.1, ge=0)

        @property
        def reference(self) -> float:
            return self.kinetic

        @property
        def transition(self) -> float:
            return 0.01

        def shape(self):
            return (self.kinetic, self.peak)

        @staticmethod
        def law(speed, shape):
            grown = 1.0 + shape[1] * math.exp(-abs(speed) / 0.3)
            return shape[0] * grown * 2.0 / math.pi * math.atan(speed / 0.01)

    yield Stribeck
    Friction.kinds.clear()
    Friction.kinds.update(registered)


def test_a_named_law_of_ones_own(stribeck):
    """The same as the function in a CustomFriction: in Python, in study files, in sweeps."""
    own = stribeck(kinetic=0.3, peak=0.1)

    @numba.njit
    def law(v):
        grown = 1.0 + 0.1 * math.exp(-abs(v) / 0.3)
        return 0.3 * grown * 2.0 / math.pi * math.atan(v / 0.01)

    custom = wb.CustomFriction(law=law, width=0.01, kinetic=0.3)
    assert own.coefficient(0.2) == pytest.approx(custom.coefficient(0.2), rel=1e-15)
    system = paper(friction=own, damping=10.0)
    custom = paper(friction=custom, damping=10.0)
    for solve in (wb.simulate, wb.paper.ode14x):
        found, expected = (solve(one, periods=2) for one in (system, custom))
        scale = np.abs(expected.velocity.values).max()
        np.testing.assert_allclose(found.velocity, expected.velocity, atol=1e-6 * scale)
    study = wb.Study(system, RunSettings(periods=2))
    assert wb.read_study(study.to_toml()).system == system
    swept = wb.sweep(system, peak=[0.1, 0.2], periods=4, transient=2)
    assert np.all(np.isfinite(swept["final_velocity"]))
    assert swept["final_velocity"][0] != swept["final_velocity"][1]
