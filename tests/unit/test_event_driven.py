"""Places where an event-driven solver of set-valued friction goes wrong."""

import math
from fractions import Fraction

import numpy as np
import pytest
from scipy.optimize import brentq

import wedgebrake as wb
from equations import law
from wedgebrake.dynamics.enums import EventKind

EPS = float(np.finfo(float).eps)


def machine(kind="conventional", /, *, angle=0.34, **changes) -> wb.BrakedDriveline:
    """J = 1, k = 1e4, F_a0 = 300 N, mu = 0.3, a steady actuation force, and no damping."""
    brakes = {
        "conventional": wb.ConventionalBrake(radius=0.2),
        "wedge": wb.WedgeBrake(radius=0.2, angle=angle),
    }
    system = wb.BrakedDriveline(
        driveline=wb.Driveline(inertia=1.0, damping=0.0, stiffness=1e4),
        brake=brakes[kind],
        friction=wb.CoulombFriction(kinetic=0.3),
        actuation=wb.Actuation(initial_force=300.0),
        excitation=wb.HarmonicTorque(amplitude=500.0, frequency=10.0),
    )
    return system.replace(**changes)


def has_no_nan(r) -> bool:
    return all(
        not np.any(np.isnan(values))
        for values in (r[name].values for name in r.variables)
        if values.dtype.kind == "f"
    ) and all(math.isfinite(r.attrs[f"final_{name}"]) for name in ("time", "angle", "velocity"))


class TestStartAtRest:
    def test_holds_until_the_torque_exceeds_the_margin(self):
        r = wb.simulate(machine(), periods=1)
        release = math.asin(300.0 * 0.3 * 0.2 / 500.0) / (2.0 * math.pi * 10.0)
        assert r.stick_start.values[0] == 0.0
        assert int(r.stick_entry[0]) == 0
        assert int(r.stick_exit[0]) == 1
        assert int(r.event_kind[0]) == EventKind.SLIP
        assert float(r.event_time[0]) == pytest.approx(release, rel=1e-14)

    @pytest.mark.parametrize("slope", [0.0, -10.0])  # released at every speed
    @pytest.mark.parametrize("brake", ["conventional", "wedge"])
    def test_without_actuation_moves_off_at_once_and_once(self, brake, slope):
        """T(0) = 0, v = 0 and v' = 0: the event v = 0 must not fire for ever."""
        r = wb.simulate(machine(brake, initial_force=0.0, slope=slope), periods=3)
        assert r.attrs["status"] == "completed"
        omega, natural = 2.0 * math.pi * 10.0, 100.0
        exact = 500.0 / (natural**2 - omega**2) * (
            np.sin(omega * r.time.values) - omega / natural * np.sin(natural * r.time.values)
        )  # fmt: skip
        assert np.max(np.abs(r.angle.values - exact)) <= 1e-14 * 500.0 / 1e4 * 100.0
        assert np.count_nonzero(r.event_time.values < 0.01) <= 1

    def test_pushed_beyond_the_margin(self):
        """On v = 0 with the spring stronger than the brake: slips the way it points."""
        for sign in (1.0, -1.0):
            r = wb.simulate(machine(amplitude=0.0), 0.01, initial=(-sign * 0.01, 0.0))
            assert r.sizes["stick"] == 0
            assert np.all(sign * r.velocity.values[1:] > 0.0)


class TestMarginalSlip:
    """Torque amplitude above the margin by a relative eps: a slip of 3 sqrt(2 eps M/T_e)/omega.

    About the peak of the torque, J v' = M eps - T_e omega^2 s^2/2; v(s) has its double root at
    the release s0 = -sqrt(2 eps M/T_e)/omega and the next at -2 s0.
    """

    @pytest.mark.parametrize("eps", [1e-2, 1e-4, 1e-6, 1e-8, 1e-10])
    @pytest.mark.parametrize("direction", [1, -1])
    @pytest.mark.parametrize("brake", ["conventional", "wedge"])
    def test_goes_the_right_way(self, brake, direction, eps):
        still = law(machine(brake))
        amplitude = 0.3 * (still.upper - still.lower)
        system = machine(brake, amplitude=amplitude)
        # The spring shifts the torque so that its peak passes one margin by eps.
        margin = still.upper if direction > 0 else still.lower
        angle = (direction * amplitude - margin * (1.0 + eps)) / 1e4
        r = wb.simulate(system, periods=1, initial=(angle, 0.0))
        assert list(r.event_kind.values) == [EventKind.SLIP, EventKind.STICK]
        assert list(r.event_side.values) == [direction, direction]
        assert list(r.stick_exit.values) == [direction, 0]
        omega = 2.0 * math.pi * 10.0
        # The angle at the end is a sum: where the spring rests, and the forced and free parts.
        parts = abs(angle) + amplitude / (1e4 - omega**2)
        assert direction * (float(r.event_angle[1]) - angle) >= -4.0 * EPS * parts
        start, end = r.event_time.values
        expected = 3.0 * math.sqrt(2.0 * eps * abs(margin) / amplitude) / omega
        # A rounded velocity against the acceleration -3 M eps/J at the end of the slip.
        rounding = 4.0 * EPS * amplitude * omega / (1e4 - omega**2)
        late = rounding / (3.0 * eps * abs(margin))
        assert end - start == pytest.approx(expected, rel=10.0 * eps, abs=late)
        inside = wb.simulate(
            system, periods=1, initial=(angle, 0.0), times=np.linspace(start, end, 50)[1:-1]
        )
        assert np.all(direction * inside.velocity.values >= -rounding)

    def test_amplitude_equal_to_the_margin_never_slips(self):
        """R F_a0 mu = 0.25 * 512 * 0.25 = 32 N m exactly."""
        system = machine(
            amplitude=32.0, brake=wb.ConventionalBrake(radius=0.25), initial_force=512.0,
            kinetic=0.25, static=0.25,
        )  # fmt: skip
        r = wb.simulate(system, periods=1000)
        assert r.sizes["event"] == 0
        assert np.all(r.angle.values == 0.0)
        assert np.all(r.sticking.values == 1)
        above = wb.simulate(system.replace(amplitude=np.nextafter(32.0, 33.0)), periods=1000)
        assert above.attrs["status"] == "completed"

    def test_amplitude_equal_to_the_margin_never_slips_on_a_turning_shaft(self):
        system = machine(
            amplitude=32.0, brake=wb.ConventionalBrake(radius=0.25), initial_force=512.0,
            kinetic=0.25, static=0.25, stiffness=0.0, drive_speed=2.0,
        )  # fmt: skip
        r = wb.simulate(system, periods=100, initial=(0.0, -2.0))
        assert r.sizes["event"] == 0
        assert np.all(r.velocity.values == -2.0)


class TestGrazing:
    """A peak of the speed that just passes, or just misses, the release speed."""

    system = wb.paper.system(eta=-24.0, F0=0.036, f=0.63, alpha=1.18)
    release = 300.0 / 40.0

    def _peak(self, angle: float) -> tuple[float, float, float]:
        """Of the motion in the piece below release: peak speed, its time, v'' there."""
        unreleased = self.system.replace(release=False)
        t = np.linspace(0.0, 0.03, 51)
        for _ in range(6):
            v = wb.simulate(unreleased, 0.03, initial=(angle, 1.0), times=t).velocity.values
            i = int(np.argmax(v))
            time, around = t[i], (t[i - 1], t[i + 1])
            t = np.linspace(*around, 51)
        # The equation of motion once differentiated: v'' where v' = 0.
        omega = 2.0 * math.pi * self.system.excitation.frequency
        v2 = 500.0 * omega * math.cos(omega * time) - 1e4 * float(v[i])
        return float(v[i]), float(time), v2

    def _start(self, height: float) -> float:
        """Initial angle that gives this peak speed."""
        return float(brentq(lambda angle: self._peak(angle)[0] - height, -0.2, -0.045, xtol=1e-16))

    @pytest.mark.parametrize("eps", [1e-3, 1e-5, 1e-7, 1e-9, 1e-11])
    def test_a_slight_crossing_is_seen_and_a_slight_miss_is_none(self, eps):
        start = self._start(self.release * (1.0 + eps))
        _, time, v2 = self._peak(start)
        r = wb.simulate(self.system, 0.03, initial=(start, 1.0))
        crossings = r.event_time.values[r.event_kind.values == EventKind.BREAKPOINT][:2]
        # v = peak + v'' s^2/2; the height of the peak is known to rounding.
        apart = 2.0 * math.sqrt(2.0 * eps * self.release / -v2)
        assert crossings.mean() == pytest.approx(time, abs=0.1 * apart + 1e-6)
        assert np.diff(crossings) == pytest.approx(apart, rel=2.0 * math.sqrt(eps) + 1e-15 / eps)

        start = self._start(self.release * (1.0 - eps))
        _, time, _ = self._peak(start)
        r = wb.simulate(self.system, time + 1e-3, initial=(start, 1.0))
        assert np.count_nonzero(r.event_kind.values == EventKind.BREAKPOINT) == 0

    def test_the_marginal_passage_near_0_34_s(self):
        """Where a step of 2 ms misses a double crossing (reference solutions, traps)."""
        r = wb.simulate(self.system, 0.36, times=np.linspace(0.32, 0.36, 40_001))
        outside = np.abs(r.velocity.values) > self.release
        crossings = r.time.values[1:][outside[1:] != outside[:-1]]
        events = r.event_time.values[r.event_kind.values == EventKind.BREAKPOINT]
        events = events[(events > 0.32) & (events < 0.36)]
        assert events.size == crossings.size
        assert events == pytest.approx(crossings, abs=1e-6)


class TestStartOnABoundary:
    @pytest.mark.parametrize("angle", [-0.05, 0.05])
    @pytest.mark.parametrize("side", [1.0, -1.0])
    def test_release_speed(self, angle, side):
        """The motion from the boundary is the limit of the motions from its two sides."""
        system = wb.paper.system(eta=-24.0, F0=0.036)
        release = side * 300.0 / -system.actuation.slope
        on, above, below = (
            wb.simulate(system, 0.02, initial=(angle, v)).angle.values
            for v in (release, np.nextafter(release, np.inf), np.nextafter(release, -np.inf))
        )
        assert np.max(np.abs(on - above)) <= 1e-14
        assert np.max(np.abs(on - below)) <= 1e-14

    @pytest.mark.parametrize("drive_speed", [0.0, 3.0])
    def test_rest_is_reached_from_its_neighbours(self, drive_speed):
        system = machine("wedge", drive_speed=drive_speed)
        on, above, below = (
            wb.simulate(system, 0.05, initial=(0.0, v))
            for v in (-drive_speed, -drive_speed + 1e-13, -drive_speed - 1e-13)
        )
        for beside in (above, below):
            assert np.max(np.abs(on.angle.values - beside.angle.values)) <= 1e-14
        assert int(on.stick_entry[0]) == 0
        assert int(above.stick_entry[0]) == 1
        assert int(below.stick_entry[0]) == -1


class TestLegalLimits:
    @pytest.mark.parametrize("brake", ["conventional", "wedge"])
    def test_no_torque_from_rest_stays_at_rest(self, brake):
        r = wb.simulate(machine(brake, amplitude=0.0), periods=10)
        assert r.sizes["event"] == 0
        assert np.all(r.angle.values == 0.0)

    def test_no_torque_free_vibration_loses_four_margins_a_period(self):
        """Conventional brake: each half swing ends 2 M/k nearer to the middle."""
        r = wb.simulate(machine(amplitude=0.0), 1.0, initial=(0.0105, 0.0))
        turns = r.event_angle.values
        margin = 18.0 / 1e4
        expected = [(-1) ** n * (0.0105 - 2.0 * n * margin) for n in range(1, 4)]
        assert turns == pytest.approx(expected, abs=1e-16)
        assert r.event_time.values == pytest.approx(math.pi / 100.0 * np.arange(1, 4), abs=1e-15)
        assert float(r.stick_start[-1]) == pytest.approx(3.0 * math.pi / 100.0, abs=1e-15)

    def test_no_friction_is_the_linear_oscillator(self):
        r = wb.simulate(machine(amplitude=0.0, kinetic=0.0, static=0.0), 1.0, initial=(0.01, 0.0))
        assert r.sizes["stick"] == 0
        assert r.angle.values == pytest.approx(0.01 * np.cos(100.0 * r.time.values), abs=1e-15)

    def test_free_driveline_slows_to_a_stop(self):
        """k = 0: v = v0 - M t/J, and rest for ever."""
        system = machine(amplitude=0.0, stiffness=0.0)
        r = wb.simulate(system, 2.0, initial=(0.0, 9.0))
        assert float(r.event_time[0]) == pytest.approx(0.5, rel=1e-15)
        assert r.attrs["final_angle"] == pytest.approx(0.5 * 9.0 * 0.5, rel=1e-15)
        assert r.attrs["final_velocity"] == 0.0

    @pytest.mark.parametrize("side", [1.0, -1.0])
    def test_creeping_into_the_kinetic_equilibrium_is_no_storm_of_events(self, side):
        """v -> 0 as exp(-lambda t), with the torque on the edge of the holding interval.

        It never stops in exact numbers; in rounded ones it reaches v = 0 where the torque
        may be either side of the edge, and must then stay.
        """
        system = machine(amplitude=0.0, damping=200.0, slope=10.0, initial_force=100.0)
        r = wb.simulate(system, periods=100, initial=(side * 0.01, -side * 1.0), max_events=1000)
        assert r.attrs["status"] == "completed"
        assert r.sizes["event"] <= 10
        # M/k = 0.2 * 100 * 0.3 / 1e4
        assert r.attrs["final_angle"] == pytest.approx(side * 6e-4, rel=1e-14)


class TestDivergence:
    def test_as_printed_the_paper_diverges(self):
        system = wb.paper.system(eta=-24.0, damping=1.0, static=0.33, release=False)
        r = wb.simulate(system, 25.0)
        assert r.attrs["status"] == "diverged"
        assert 0.0 < r.attrs["final_time"] < 25.0
        assert f"t = {r.attrs['final_time']:.6g} s" in r.attrs["message"]
        assert has_no_nan(r)
        assert float(r.time[-1]) <= r.attrs["final_time"]
        assert r.time.size > 1

    def test_growth_without_torque(self):
        """From rest nothing happens; from a push it grows as exp(-g2 t/2)."""
        system = machine(amplitude=0.0, damping=1.0, slope=-100.0, release=False)
        assert wb.simulate(system, 5.0).attrs["status"] == "completed"
        r = wb.simulate(system, 25.0, initial=(0.1, 0.0))
        assert r.attrs["status"] == "diverged"
        assert has_no_nan(r)


class TestSelfLocking:
    locked = machine("wedge", angle=0.25)  # tan 0.25 = 0.255 < 0.3

    def test_forward_sliding_has_no_solution(self):
        r = wb.simulate(self.locked, 1.0, initial=(0.0, 1.0))
        assert r.attrs["status"] == "no_forward_solution"
        assert r.attrs["final_time"] == 0.0
        assert r.attrs["final_velocity"] == 1.0
        assert has_no_nan(r)

    def test_any_torque_forwards_is_held(self):
        r = wb.simulate(self.locked.replace(amplitude=1e6), 0.05)
        assert np.all(r.velocity.values <= 0.0)
        assert np.all(r.stick_exit.values <= 0)
        assert r.attrs["status"] == "completed"

    def test_backward_sliding_is_a_motion(self):
        r = wb.simulate(self.locked, periods=5, initial=(0.0, -1.0))
        assert r.attrs["status"] == "completed"
        assert np.all(r.velocity.values <= 0.0)

    def test_locks_when_the_actuation_comes_back(self):
        """Released and fast forwards; at the release speed the brake bites and locks."""
        r = wb.simulate(self.locked.replace(slope=-100.0), 1.0, initial=(0.0, 10.0))
        assert r.attrs["status"] == "no_forward_solution"
        assert r.attrs["final_velocity"] == 3.0
        assert r.attrs["final_time"] > 0.0
        assert has_no_nan(r)


@pytest.mark.parametrize(("change", "initial"), [({}, 0.01), ({"kinetic": 0.0}, 0.01)])
def test_a_period_of_very_many_vibrations_ends_in_a_limit(change, initial):
    """A billion vibrations in one torque period: bounded work, a sentence, a valid state."""
    system = wb.paper.system(eta=0.0).replace(frequency=1e-8, amplitude=1.0, damping=0.0)
    free = system.replace(initial_force=0.0, **change)
    r = wb.simulate(free, periods=1, initial=(initial, 0.0), times=[], max_events=1000)
    assert r.attrs["status"] == "event_limit"
    assert 0.0 < r.attrs["final_time"] < 1e8
    assert abs(r.attrs["final_angle"]) < 0.011
    # Undamped and free, it reverses at every half vibration, and never rests.
    assert r.sizes["stick"] == 0
    assert np.allclose(np.diff(r.event_time), np.pi / 100.0, rtol=1e-3)


def test_search_steps_are_bounded_too():
    """Far from every boundary there are no events; the search itself must end."""
    system = wb.paper.system(eta=0.0).replace(frequency=1e-8, amplitude=1.0, damping=0.0)
    turning = system.replace(initial_force=0.0, drive_speed=50.0)
    r = wb.simulate(turning, periods=1, initial=(0.01, 0.0), times=[], max_events=1000)
    assert r.attrs["status"] == "event_limit"
    assert r.sizes["event"] == 0
    assert 0.0 < r.attrs["final_time"] < 1e8


def test_rest_that_ends_tangentially_is_not_prolonged():
    """T_e omega = k Omega: at the start the torque and its first two rates all vanish."""
    system = wb.paper.system(eta=0.0).replace(
        inertia=1.0, damping=0.0, stiffness=20.085536923187664, drive_speed=-0.22313016014842985,
        brake=wb.BandBrake(radius=1.0, wrap_angle=1.0), initial_force=0.0, amplitude=1.0,
        frequency=0.713282968945224,
    )  # fmt: skip
    times = np.linspace(0.0, 0.01, 2001)
    r = wb.simulate(system, 0.01, initial=(0.0, 0.22313016014842985), times=times, max_events=500)
    assert r.attrs["status"] == "completed"
    pull = r.drive_torque - 20.085536923187664 * r.angle
    assert float(abs(pull.where(r.sticking == 1, 0.0)).max()) < 1e-11


@pytest.mark.parametrize("friction", ["coulomb", "smoothed"])
@pytest.mark.parametrize(
    ("speed", "torque", "stiffness", "ends"),
    [
        (1.0, 100.0, 1e4, "no_forward_solution"),
        (1.0, 0.0, 1e4, "no_forward_solution"),
        (1.0, 100.0, 0.0, "completed"),  # nothing winds up
        (-1.0, 100.0, 1e4, "completed"),  # backwards the brake holds a finite torque
    ],
)
def test_a_self_locking_brake_on_a_turning_shaft_rests_for_ever(
    friction, speed, torque, stiffness, ends
):
    """mu_k < tan(alpha) < mu_s: at rest no torque of the winding spring breaks it loose."""
    law = {
        "coulomb": wb.CoulombFriction(kinetic=0.3, static=0.4),
        "smoothed": wb.SmoothedFriction(kinetic=0.3, static=0.4),
    }[friction]
    system = wb.BrakedDriveline(
        driveline=wb.Driveline(inertia=1.0, damping=0.1, stiffness=stiffness, drive_speed=speed),
        brake=wb.WedgeBrake(angle=math.atan(0.35), radius=0.2),
        friction=law,
        actuation=wb.Actuation(initial_force=300.0, slope=-0.5),
        excitation=wb.HarmonicTorque(amplitude=torque, frequency=10.0),
    )
    start = (0.0, -speed)  # at rest relative to the brake
    response = wb.simulate(system, periods=40, initial=start)
    assert response.attrs["status"] == ends
    returns = "periods" if torque else "crossings"
    run = {returns: 30, "transient": 20, "initial": start}
    answer, swept = wb.motion(system, **run), wb.sweep(system, inertia=[1.0], **run)
    meanings = swept["motion"].attrs["flag_meanings"].split()
    at = list(swept["motion"].attrs["flag_values"]).index(int(swept["motion"][0]))
    locked = ends == "no_forward_solution"
    assert (answer.kind == "self-locked") == locked == (meanings[at] == "self_locked")
    if locked:
        # Long before 40 periods have wound up the spring.
        assert float(response["time"][-1]) <= 0.1
        assert math.isnan(answer.stick_share)


# J, k, R, mu_k, mu_s, F_a0 in decimal digits, with which a swing ends exactly at the holding limit.
ROUND = [
    tuple(numbers.split())
    for numbers in (
        "0.2 2 0.1 0.25 0.25 40", "0.7 65 0.9 0.76 0.76 0.09", "81 0.82 9.2 0.57 0.57 7",
        "7.9 0.66 0.5 0.33 0.33 1", "7 0.1 0.6 0.08 0.096 80", "0.06 0.06 0.54 0.4 0.4 0.3",
        "9 3 0.1 0.5 0.6 0.82", "0.89 0.5 0.5 0.08 0.16 24", "0.4 0.32 0.61 0.63 0.63 90",
        "0.04 0.11 0.81 0.72 0.72 20", "0.09 0.09 0.8 0.4 0.6 0.3", "0.63 75 0.48 0.84 1.008 0.5",
    )
]  # fmt: skip


def round_machine(numbers, amplitude=0.0, frequency=1.0):
    """An undamped machine, and its stiffness, kinetic torque and holding limit as fractions."""
    j, k, radius, kinetic, static, force = map(float, numbers)
    system = wb.BrakedDriveline(
        driveline=wb.Driveline(inertia=j, damping=0.0, stiffness=k),
        brake=wb.ConventionalBrake(radius=radius),
        friction=wb.CoulombFriction(kinetic=kinetic, static=static),
        actuation=wb.Actuation(initial_force=force),
        excitation=wb.HarmonicTorque(amplitude=float(amplitude), frequency=frequency),
    )
    _, k, radius, kinetic, static, force = map(Fraction, numbers)
    return system, (k, radius * kinetic * force, radius * static * force)


class TestAtTheHoldingLimit:
    """Where the torque is exactly at its limit, the brake holds, whatever the last digits are."""

    @pytest.mark.parametrize("beyond", [0, Fraction(1, 1000)])
    @pytest.mark.parametrize("swings", [1, 2, 3])
    @pytest.mark.parametrize("numbers", ROUND)
    def test_swings_end_where_it_holds(self, numbers, swings, beyond):
        """The angle falls by twice the kinetic torque over k in each swing of pi sqrt(J/k)."""
        system, (k, kinetic, static) = round_machine(numbers)
        start = angle = (static * (1 + beyond) + 2 * swings * kinetic) / k
        count = 0
        while abs(angle) * k > static:
            angle = (2 * kinetic if angle > 0 else -2 * kinetic) / k - angle
            count += 1
        assert count == swings + (beyond > 0)
        swing = math.pi * math.sqrt(system.driveline.inertia / system.driveline.stiffness)
        for sign in (1, -1):
            run = wb.simulate(system, 20.0 * swing, initial=(float(sign * start), 0.0), times=[])
            # Rounding of the angle over the last acceleration, a thousandth of the first, or less.
            time = pytest.approx([count * swing], rel=1e-10 if beyond else 1e-12)
            assert run.stick_start.values == time
            assert run.attrs["final_angle"] == pytest.approx(float(sign * angle), rel=1e-11)

    @pytest.mark.parametrize("share", [1, Fraction(1, 2), Fraction(9, 10), Fraction(3, 7)])
    @pytest.mark.parametrize("numbers", ROUND)
    def test_a_torque_that_only_reaches_it_is_held_for_ever(self, numbers, share):
        amplitude = share * round_machine(numbers)[1][2]
        system, (k, _, static) = round_machine(numbers, amplitude, 0.3)
        for sign in (1, -1):
            start = float(sign * (static - amplitude) / k), 0.0
            run = wb.simulate(system, periods=50, initial=start)
            assert run.sizes["event"] == 0
            assert np.all(run.sticking == 1)
            assert wb.motion(system, initial=start).kind == "at rest"

    @pytest.mark.parametrize("numbers", ROUND)
    def test_a_torque_that_leaves_it_slips_at_once(self, numbers):
        amplitude = 3 * round_machine(numbers)[1][2]
        system, (k, _, static) = round_machine(numbers, amplitude, 0.3)
        run = wb.simulate(system, periods=1, initial=(float(-static / k), 0.0), times=[])
        assert not np.any(run.stick_start.values == 0.0)

    @pytest.mark.parametrize("numbers", ROUND)
    def test_it_is_left_where_the_torque_comes_back_to_it(self, numbers):
        """The torque first moves inside the limits, and is at this limit again half a period on."""
        amplitude = round_machine(numbers)[1][2] / 2
        system, (k, _, static) = round_machine(numbers, amplitude, 0.3)
        run = wb.simulate(system, periods=1, initial=(float(static / k), 0.0), times=[])
        assert run.event_time.values[0] == pytest.approx(0.5 / 0.3, rel=1e-14)
