"""Stability of machines beyond closed forms: cases, rigid modes, limits of stability, errors."""

import itertools
import json
import math

import mpmath
import numpy as np
import pytest
import scipy.optimize

import machines
import wedgebrake as wb


def contact(name, *ends, radius=0.2, friction=0.3, force=300.0, **more):
    return machines.contact(*ends, name=name, radius=radius, friction=friction, force=force, **more)


def held(*contacts, speed=0.0, damping=0.6):
    return machines.single(*contacts, stiffness=100.0, damping=damping, speed=speed)


FREE = wb.Machine(
    inertias=[wb.Inertia("motor", 0.2, speed=10.0), wb.Inertia("disc", 1.0, speed=10.0)],
    shafts=[wb.Shaft("motor", "disc", stiffness=500.0, damping=0.1)],
    contacts=[contact("brake")],
)


class TestCases:
    def test_a_contact_that_slides_has_one_direction(self):
        [case] = wb.stability(held(contact("brake")), speeds=[-3.0]).cases
        assert case.directions == {"brake": -1}
        assert case.speeds == {"brake": -3.0}

    def test_a_contact_that_stands_has_two(self):
        found = wb.stability(held(contact("brake", slope=-5.0)))
        assert [one.directions["brake"] for one in found.cases] == [1, -1]

    def test_only_directions_that_are_possible(self):
        # Two brakes on one inertia slide together; of a ring of clutches not all slide forwards.
        assert len(wb.stability(held(contact("one"), contact("other"))).cases) == 2
        ring = wb.Machine(
            inertias=[wb.Inertia(name, 1.0) for name in "abc"],
            contacts=[contact("x", "a", "b"), contact("y", "b", "c"), contact("z", "c", "a")],
        )
        found = {tuple(one.directions.values()) for one in wb.stability(ring).cases}
        assert len(found) == 6
        assert not {(1, 1, 1), (-1, -1, -1)} & found

    def test_speeds_by_name_and_in_order(self):
        one = wb.stability(FREE, speeds={"disc": 7.0})
        other = wb.stability(FREE, speeds=(10.0, 7.0))
        assert one.cases[0].speeds == other.cases[0].speeds == {"brake": 7.0}

    def test_the_critical_case_is_the_least_stable_one(self):
        machine = held(contact("brake", brake=wb.WedgeBrake(radius=0.2, angle=0.4), slope=-5.0))
        found = wb.stability(machine)
        assert found.critical.directions == {"brake": 1}
        assert not found.stable
        assert found.cases[1].stable
        assert found.modes is found.critical.modes

    def test_a_brake_that_locks_itself_does_not_slide(self):
        machine = held(contact("brake", brake=wb.WedgeBrake(radius=0.2, angle=0.2)))
        forwards, backwards = (found := wb.stability(machine)).cases
        assert forwards.locked == ("brake",)
        assert forwards.stable is None
        assert found.stable
        assert found.critical is backwards
        assert "locks itself" in found.verdict
        turning = wb.stability(machine, speeds=[5.0])
        assert turning.critical is None
        assert turning.growth_rate is None
        assert not turning.stable

    def test_limits_and_release_cut_the_feedback(self):
        for speed, more in ((30.0, {}), (5.0, {"limits": (250.0, 400.0)})):
            machine = held(contact("brake", slope=-15.0, **more), speed=speed)
            [case] = wb.stability(machine).cases
            assert case.limited == ("brake",)
            assert case.modes[0].growth_rate == pytest.approx(-0.3)
        [case] = wb.stability(held(contact("brake", slope=-15.0), speed=5.0)).cases
        assert case.limited == ()
        assert case.modes[0].growth_rate == pytest.approx(-0.5 * (0.6 - 0.2 * 0.3 * 15.0))

    def test_a_brake_pressed_by_its_speed_alone(self):
        # F_a0 = 0: near rest a positive slope presses it, a negative one does not.
        for slope, damping in ((10.0, 0.6 + 0.6), (-10.0, 0.6)):
            found = wb.stability(held(contact("brake", force=0.0, slope=slope)))
            assert found.growth_rate == pytest.approx(-0.5 * damping)


def test_undamped_vibration_beside_a_speed_that_grows():
    """A free rotor under falling friction, and a disc that nothing damps."""
    machine = wb.Machine(
        inertias=[wb.Inertia("disc", 1.0), wb.Inertia("rotor", 1.0, speed=5.0)],
        shafts=[wb.Shaft("disc", "ground", stiffness=100.0)],
        contacts=[contact("brake", "rotor", slope=-1.0)],
    )
    found = wb.stability(machine)
    drift, vibration, _ = found.critical.modes
    assert drift.drift
    assert drift.growth_rate == pytest.approx(0.06)  # slope * radius * mu / inertia
    assert vibration.frequency == pytest.approx(10.0 / (2.0 * math.pi))
    assert (found.critical.state, found.stable) == ("grows", False)
    assert "small vibration does not decay" in found.verdict


class TestModes:
    def test_shapes_and_frequencies_of_a_free_driveline(self):
        found = wb.stability(FREE)
        flexible, *rigid = found.modes
        assert [one.rigid for one in found.modes] == [False, True, True]
        omega = np.sqrt(500.0 * (1.0 / 0.2 + 1.0))
        assert abs(flexible.eigenvalue) == pytest.approx(omega)
        assert flexible.frequency == flexible.eigenvalue.imag / (2.0 * np.pi)
        assert flexible.damping_ratio == pytest.approx(0.5 * 0.1 * 6.0 / omega)
        np.testing.assert_allclose(flexible.shape, [1.0, -0.2], atol=1e-12)
        for one in rigid:
            np.testing.assert_allclose(one.shape, [1.0, 1.0], rtol=1e-12)
        assert found.stable
        assert found.eigenvalues.count(0j) == 2

    def test_a_free_driveline_whose_speed_runs_away(self):
        found = wb.stability(FREE.replace({"brake.slope": -1.0}))
        assert not found.stable
        assert found.modes[0].frequency == 0.0
        assert found.growth_rate == pytest.approx(0.2 * 0.3 / 1.2, rel=1e-3)
        assert [one.rigid for one in found.modes] == [False, False, True]
        assert [one.drift for one in found.modes] == [True, False, False]
        # The shaft vibrates on its own, damped: 500 N m/rad between 0.2 and 1 kg m^2.
        assert found.modes[1].growth_rate < 0.0
        assert found.modes[1].frequency == pytest.approx(
            math.sqrt(500 / 0.2 * 1.2) / math.tau, rel=1e-4
        )
        assert found.critical.forces == {"brake": pytest.approx(300.0 - 10.0)}

    def test_the_contact_that_feeds_a_mode(self):
        drives = contact("drives", slope=-30.0)
        damps = contact("damps", slope=20.0)
        [case] = wb.stability(held(damps, drives, speed=1.0)).cases
        assert case.modes[0].fed_by == "drives"
        assert wb.stability(held(damps, speed=1.0)).modes[0].fed_by is None

    def test_an_undamped_machine_does_not_decay(self):
        machine = held(contact("brake"), damping=0.0)
        found = wb.stability(machine, speeds=[1.0])
        assert not found.stable
        assert found.critical.state == "does not decay"

    def test_a_machine_without_contacts(self):
        found = wb.stability(held())
        assert found.stable
        assert found.growth_rate == pytest.approx(-0.3)

    def test_a_vibration_faster_than_the_samples(self):
        # A controller too weak to matter, at a seventh of the frequency of the vibration.
        sampled = held(contact("brake", slope=1e-6, sample_time=4.4, delay=1), speed=1.0)
        [mode] = [one for one in wb.stability(sampled).modes if one.growth_rate > -1.0]
        exact = wb.stability(held(speed=1.0)).modes[0]
        assert mode.frequency == pytest.approx(exact.frequency, rel=1e-6)
        assert mode.growth_rate == pytest.approx(exact.growth_rate, rel=1e-5)

    def test_multipliers_of_delayed_samples(self):
        found = wb.stability(
            held(contact("brake", slope=-5.0, sample_time=0.01, delay=3), speed=2.0)
        )
        assert len(found.multipliers) == 5
        rates = [np.log(complex(one)) / 0.01 for one in found.multipliers if abs(one) > 1e-12]
        np.testing.assert_allclose(
            sorted(one.real for one in found.eigenvalues), sorted(one.real for one in rates)
        )

    def test_a_free_driveline_with_a_controller(self):
        found = wb.stability(FREE.replace({"brake.sample_time": 0.002, "brake.slope": 2.0}))
        assert found.stable
        assert sum(one.rigid for one in found.modes) == 1
        slow = min(found.modes[:-1], key=lambda one: abs(one.eigenvalue))
        assert slow.growth_rate == pytest.approx(-2.0 * 0.2 * 0.3 / 1.2, rel=1e-3)


def test_friction_that_falls_with_the_speed_of_any_brake():
    # A brake of one's own, whose g has no closed derivative here, against one that has.
    class Squeezed(wb.Brake):
        angle: float = 0.6

        def shape(self):
            return (np.tan(self.angle),)

        @staticmethod
        def law(m, shape):
            gap = shape[0] - m
            return m / gap if gap > 0.0 else np.inf

    friction = wb.StribeckFriction(kinetic=0.3, static=0.5, speed=1.0)
    known = wb.WedgeBrake(radius=0.2, angle=0.6)
    one, other = (
        wb.stability(held(contact("brake", brake=brake, friction=friction), speed=speed))
        for speed in (2.0,)
        for brake in (known, Squeezed(radius=0.2))
    )
    np.testing.assert_allclose(one.eigenvalues, other.eigenvalues, rtol=1e-10)


def test_a_table_at_one_of_its_points_counts_the_less_stable_side():
    table = wb.TabulatedFriction(speeds=(0.0, 1.0, 2.0), coefficients=(0.4, 0.3, 0.35))
    machine = held(contact("brake", friction=table), speed=5.0)
    assert wb.stability(machine).growth_rate == pytest.approx(-0.5 * (0.6 - 0.04 * 300.0 * 0.1))


class TestLimit:
    def test_release_is_a_jump(self):
        # Beyond 7.5 rad/s nothing presses the brake.
        machine = held(contact("brake", slope=-40.0))
        found = wb.hopf(machine, "disc.speed", between=(1.0, 20.0))
        assert found.value == pytest.approx(7.5)
        assert not found.continuous
        assert found.kind == "release"
        assert "jumps" in repr(found)

    @pytest.mark.parametrize(
        ("damping", "between"),
        [(2.399, (1.0, 20.0)), (1.2, (20.0, 1.0)), (0.02, (1.0, 20.0))],
    )
    def test_a_jump_is_one_however_small_the_growth_rate_of_a_side(self, damping, between):
        # On the one side (2.4 - damping)/2, on the other -damping/2, with J = 1.
        machine = held(contact("brake", slope=-40.0), damping=damping)
        found = wb.hopf(machine, "disc.speed", between=between)
        assert not found.continuous
        sides = (1.2 - 0.5 * damping, -0.5 * damping)
        assert min(abs(found.growth_rate - side) for side in sides) <= 1e-12

    def test_a_speed_that_runs_away_is_a_divergence(self):
        found = wb.hopf(FREE.replace({"brake.slope": 1.0}), "brake.slope", between=(-3.0, 2.0))
        assert found.kind == "divergence"
        assert found.frequency == 0.0
        assert found.value == pytest.approx(0.0, abs=1e-12)

    def test_limits_between_ends_of_one_verdict(self):
        # Falling friction at low speeds only: unstable between two speeds.
        table = wb.TabulatedFriction(speeds=(0.0, 1.0, 1.4, 2.0), coefficients=(0.4, 0.4, 0.3, 0.3))
        machine = held(contact("brake", friction=table))
        found = wb.hopf(machine, "disc.speed", between=(0.5, 30.0))
        assert found.value == pytest.approx(5.0)
        found = wb.hopf(machine, "disc.speed", between=(30.0, 0.5))
        assert found.value == pytest.approx(7.0)

    def test_from_no_decay_to_growth(self):
        # Undamped: small vibration keeps its size for slopes from 0 on where the force is limited.
        machine = held(contact("brake", limits=(0.0, 300.0)), damping=0.0, speed=1.0)
        found = wb.hopf(machine, "brake.slope", between=(-3.0, 4.0))
        assert found.value == pytest.approx(0.0, abs=1e-12)

    @pytest.mark.parametrize("name", ["disc.inertia", "disc-ground.damping", "brake.kinetic"])
    def test_any_parameter(self, name):
        machine = held(contact("brake", slope=-10.5, lag=0.01), speed=5.0)
        start = machine.parameters()[name]
        found = wb.hopf(machine, name, between=(0.05 * start, 4.0 * start))
        assert found.continuous
        at = wb.stability(machine.replace({name: found.value}))
        assert at.growth_rate == pytest.approx(0.0, abs=1e-12)
        below, above = (
            wb.stability(machine.replace({name: f * found.value})) for f in (0.99, 1.01)
        )
        assert below.stable != above.stable
        assert found.frequency == at.modes[0].frequency > 0.0

    def test_nothing_to_find(self):
        with pytest.raises(wb.InputError, match=r"decays .* at 0 and decays .* at 5") as caught:
            wb.hopf(held(contact("brake")), "brake.slope", between=(0.0, 5.0))
        assert caught.value.name == "between"


class TestKinds:
    """Hopf points, self-locking, release and limits of the force, by closed forms."""

    WEDGE = wb.WedgeBrake(radius=0.2, angle=0.34)

    def wedge(self, speed, **more):
        return held(contact("brake", brake=self.WEDGE, slope=-0.5, **more), speed=speed)

    @pytest.mark.parametrize("speed", [0.0, 5.0])
    def test_what_locks_is_not_called_stable(self, speed):
        # c + R delta g = 0 with g = mu/(tan(alpha) - mu), and mu = tan(alpha), where it locks.
        tangent = math.tan(0.34)
        found = wb.hopf(self.wedge(speed), "brake.kinetic", between=(0.1, 0.5))
        gain = 0.6 / (0.2 * 0.5)
        assert found.value == pytest.approx(gain * tangent / (1.0 + gain), rel=1e-12)
        assert (found.kind, found.below, found.above) == ("hopf", "stable", "unstable")
        (locking,) = found.others
        assert locking.value == pytest.approx(tangent, rel=1e-12)
        assert (locking.kind, locking.below, locking.above) == (
            "self-locking", "unstable", "locked",
        )  # fmt: skip

    @pytest.mark.parametrize("between", [(-80.0, 20.0), (20.0, -80.0)])
    def test_a_release_is_no_hopf_point(self, between):
        # Released at -F/v, c + R delta mu = 0, and at a limit of 400 N.
        machine = held(contact("brake", limits=(0.0, 400.0)), speed=5.0)
        found = wb.hopf(machine, "brake.slope", between=between)
        assert (found.kind, found.value) == ("hopf", pytest.approx(-10.0, rel=1e-12))
        assert [(one.kind, one.value) for one in found.others] == [
            ("release", pytest.approx(-60.0, rel=1e-12))
        ]
        assert (found.others[0].below, found.others[0].above) == ("released", "unstable")

    def test_a_limit_beside_an_end_of_the_interval(self):
        # c - R delta mu = 0 at a damping of 1e-5, from an end where the machine exists no further.
        machine = held(contact("brake", slope=-1e-5 / 0.06), speed=5.0)
        found = wb.hopf(machine, "disc-ground.damping", between=(0.0, 20.0))
        assert found.value == pytest.approx(1e-5, rel=1e-8)
        assert found.continuous

    def test_an_alternating_force(self):
        # J v+ = J v - T_s R mu delta v: the multiplier is -1 at delta = 2 J/(T_s R mu).
        brake = contact("brake", slope=1.0, sample_time=0.01)
        machine = wb.Machine(inertias=[wb.Inertia("disc", 1.0, speed=5.0)], contacts=[brake])
        found = wb.hopf(machine, "brake.slope", between=(100.0, 5000.0))
        assert (found.kind, found.below, found.above) == ("flip", "stable", "unstable")
        assert found.value == pytest.approx(2.0 / (0.01 * 0.06), rel=1e-12)
        assert found.mode.alternates
        assert found.frequency == pytest.approx(50.0, rel=1e-12)


class TestBalance:
    """A motor with viscous damping c turns a disc that rubs with the Stribeck law."""

    LAW = wb.StribeckFriction(kinetic=0.5, static=1.0, speed=0.5)
    FORCE, DAMPING, STIFFNESS = 3.0, 0.3, 20.0

    def machine(self, torque=2.3, motor=0.5, disc=1.0):
        brake = contact("brake", radius=1.0, friction=self.LAW, force=self.FORCE)
        return wb.Machine(
            inertias=[wb.Inertia("motor", motor), wb.Inertia("disc", disc)],
            shafts=[
                wb.Shaft("motor", "disc", stiffness=self.STIFFNESS),
                wb.Shaft("motor", "ground", stiffness=0.0, damping=self.DAMPING),
            ],
            contacts=[brake],
            torques=[wb.Torque("motor", torque, name="drive")],
        )

    def torque(self, speed):
        """The torque of steady sliding."""
        return self.DAMPING * speed + self.FORCE * (0.5 + 0.5 * math.exp(-2.0 * speed))

    @pytest.mark.parametrize(
        ("torque", "count"), [(1.9, 0), (2.0, 2), (2.9, 2), (3.1, 1), (-2.3, 2), (-4.0, 1)]
    )
    def test_every_answer_balances_the_torques(self, torque, count):
        answers = wb.steady_sliding(self.machine(torque))
        assert len(answers) == count
        speeds = [one["disc"] for one in answers]
        assert speeds == sorted(speeds)
        for one in answers:
            assert one["motor"] == pytest.approx(one["disc"], rel=1e-14)
            assert self.torque(abs(one["disc"])) == pytest.approx(abs(torque), rel=1e-12)

    def test_what_has_no_isolated_answer_is_refused_or_empty(self):
        free = wb.Machine(inertias=[wb.Inertia("disc", 1.0)])
        with pytest.raises(wb.InputError, match="every speed"):
            wb.steady_sliding(free)
        two = wb.Machine(
            inertias=[wb.Inertia("one", 1.0), wb.Inertia("two", 1.0)],
            contacts=[contact("clutch", "one", "two"), contact("brake", "two")],
            torques=[wb.Torque("one", 5.0)],
        )
        assert wb.steady_sliding(two) == ()
        assert wb.steady_sliding(two, sticking=["clutch"]) == ()  # no damping, constant friction
        assert wb.steady_sliding(held(contact("brake"))) == ({"disc": 0.0},)

    def test_two_answers_meet(self):
        # dT/ds = 0: c = F exp(-2 s).
        fold = self.torque(0.5 * math.log(self.FORCE / self.DAMPING))
        found = wb.hopf(self.machine(), "drive.value", between=(1.5, 2.5), speeds="balance")
        assert found.value == pytest.approx(fold, rel=1e-12)
        assert (found.kind, found.below, found.above) == ("divergence", "none", "stable")
        assert not found.others

    def test_a_hopf_point_over_the_torque(self):
        """A light disc behind a heavy motor vibrates where the speed of both is stable."""
        motor, disc = 5.0, 0.2

        def rate(speed):
            fall, k = self.FORCE * math.exp(-2.0 * speed), self.STIFFNESS
            matrix = [
                [0, 1, -1],
                [-k / motor, -self.DAMPING / motor, 0],
                [k / disc, 0, fall / disc],
            ]
            return max(one.real for one in np.linalg.eigvals(matrix))

        speed = scipy.optimize.brentq(rate, 1.3, 6.0, xtol=1e-15)
        found = wb.hopf(
            self.machine(motor=motor, disc=disc), "drive.value", between=(1.8, 3.4),
            speeds="balance",
        )  # fmt: skip
        assert found.kind == "hopf"
        assert found.value == pytest.approx(self.torque(speed), rel=1e-10)
        assert found.machine.inertias[1].speed == pytest.approx(speed, rel=1e-8)
        assert [one.kind for one in found.others] == ["divergence"]

    def test_wrong_words(self):
        with pytest.raises(wb.InputError) as caught:
            wb.hopf(self.machine(), "drive.value", between=(1.5, 2.5), speeds="steady")
        assert caught.value.name == "speeds"


class TestBalanceOfSeveral:
    """Free inertias that a slipping clutch joins, or nothing."""

    LAW = wb.StribeckFriction(kinetic=0.5, static=1.0, speed=0.5)
    FORCE, DAMPING, LOAD, STIFFNESS = 3.0, 0.3, 0.7, 20.0

    def contact(self, *on, name, **more):
        return contact(name, *on, radius=1.0, friction=self.LAW, force=self.FORCE, **more)

    @staticmethod
    def damper(name, damping):
        return wb.Shaft(name, "ground", stiffness=0.0, damping=damping)

    def friction(self, sliding):
        return self.FORCE * (0.5 + 0.5 * math.exp(-2.0 * abs(sliding)))

    def machine(self, torque=4.0, motor=5.0, disc=0.2, load=3.0):
        """A motor turns a disc, which slips on a load that has a damper."""
        return wb.Machine(
            inertias=[
                wb.Inertia("motor", motor), wb.Inertia("disc", disc), wb.Inertia("load", load)
            ],
            shafts=[
                wb.Shaft("motor", "disc", stiffness=self.STIFFNESS),
                self.damper("motor", self.DAMPING),
                self.damper("load", self.LOAD),
            ],
            contacts=[self.contact("disc", "load", name="clutch")],
            torques=[wb.Torque("motor", torque, name="drive")],
        )  # fmt: skip

    def at(self, slip):
        """Speeds of motor and load, and torque of the drive, in steady sliding at a slip > 0."""
        load = self.friction(slip) / self.LOAD
        return load + slip, load, self.DAMPING * (load + slip) + self.friction(slip)

    @property
    def fold(self):
        """Slip of the least torque: c1 + (1 + c1/c2) dM/dv = 0."""
        ratio = self.DAMPING / (1.0 + self.DAMPING / self.LOAD)
        return -0.5 * math.log(ratio / self.FORCE)

    def test_each_inertia_has_its_own_balance(self):
        """Two that nothing joins: every pair of the solutions of both."""
        torques = (2.0, 2.2)
        machine = wb.Machine(
            inertias=[wb.Inertia("one", 1.0), wb.Inertia("two", 2.0)],
            shafts=[self.damper("one", self.DAMPING), self.damper("two", self.DAMPING)],
            contacts=[self.contact(one, name=f"brake-{one}") for one in ("one", "two")],
            torques=[wb.Torque(*one) for one in zip(("one", "two"), torques, strict=True)],
        )
        least = 0.5 * math.log(self.FORCE / self.DAMPING)
        speeds = [
            [
                scipy.optimize.brentq(
                    lambda v, torque=torque: self.DAMPING * v + self.friction(v) - torque,
                    *ends, xtol=1e-15,
                )
                for ends in ((0.0, least), (least, 10.0))
            ]
            for torque in torques
        ]  # fmt: skip
        expected = sorted(itertools.product(*speeds))
        found = [tuple(one.values()) for one in wb.steady_sliding(machine)]
        np.testing.assert_allclose(found, expected, rtol=1e-13)

    @pytest.mark.parametrize(("below", "count"), [(1e-3, 0), (-1e-3, 2), (-1e-8, 2)])
    def test_clutch_that_slips(self, below, count):
        torque = self.at(self.fold)[2] - below
        answers = wb.steady_sliding(self.machine(torque))
        forwards = [one for one in answers if one["motor"] > one["load"]]
        assert len(forwards) == count
        for one in forwards:
            assert one["motor"] == pytest.approx(one["disc"], rel=1e-14)
            motor, load, expected = self.at(one["motor"] - one["load"])
            assert (one["motor"], one["load"]) == pytest.approx((motor, load), rel=1e-12)
            assert expected == pytest.approx(torque, rel=1e-12)

    def test_random_inertias(self):
        """Two or three in a chain, against Newton's method from many speeds."""
        rng, several = np.random.default_rng(5), 0
        for _ in range(12):
            count = int(rng.integers(2, 4))
            names, damping = "abc"[:count], rng.uniform(0.05, 0.5, count)
            drive, bases = rng.uniform(-3.0, 5.0, count), rng.uniform(-3.0, 3.0, count)
            laws = rng.uniform((0.05, 0.3, 0.1, 0.5), (0.3, 1.5, 3.0, 4.0), (2 * count - 1, 4))

            def rubs(number, *on, **more):
                kinetic, static, speed, force = laws[number]  # noqa: B023
                friction = wb.StribeckFriction(kinetic=kinetic, static=static, speed=speed)
                name = f"contact-{number}"
                return contact(name, *on, radius=1.0, friction=friction, force=force, **more)

            contacts = [rubs(i, names[i], base_speed=bases[i]) for i in range(count)]
            contacts += [rubs(count + i, names[i], names[i + 1]) for i in range(count - 1)]
            machine = wb.Machine(
                inertias=[wb.Inertia(one, 1.0) for one in names],
                shafts=[self.damper(*one) for one in zip(names, damping, strict=True)],
                contacts=contacts,
                torques=[wb.Torque(*one) for one in zip(names, drive, strict=True)],
            )
            rows = np.vstack([np.eye(count), np.eye(count)[:-1] - np.eye(count)[1:]])
            shift = np.append(bases, np.zeros(count - 1))

            def rest(speeds):
                v = rows @ speeds - shift  # noqa: B023
                kinetic, static, speed, force = laws.T  # noqa: B023
                size = force * (kinetic + (static - kinetic) * np.exp(-np.abs(v) / speed))
                return drive - damping * speeds - rows.T @ (np.sign(v) * size)  # noqa: B023

            found = np.array([list(one.values()) for one in wb.steady_sliding(machine)])
            found = found.reshape(-1, count)
            several += len(found) > 1
            assert all(np.max(np.abs(rest(one))) <= 1e-12 * (1.0 + np.max(one)) for one in found)
            for start in rng.normal(size=(100, count)) * np.exp(rng.normal(size=(100, 1))):
                speeds = scipy.optimize.fsolve(rest, start, xtol=1e-13, full_output=True)[0]
                if np.max(np.abs(rest(speeds))) <= 1e-11:
                    assert np.min(np.max(np.abs(found - speeds), axis=1)) <= 1e-7
        assert several >= 2

    def test_hopf_point_over_the_torque(self):
        """The eigenvalues of the twist and three speeds; without the angles of free rotations."""
        motor, disc, load = 5.0, 0.2, 3.0

        def rate(slip):
            fall, k = self.FORCE * math.exp(-2.0 * slip), self.STIFFNESS
            matrix = [
                [0, 1, -1, 0],
                [-k / motor, -self.DAMPING / motor, 0, 0],
                [k / disc, 0, fall / disc, -fall / disc],
                [0, 0, -fall / load, (fall - self.LOAD) / load],
            ]
            values = np.linalg.eigvals(matrix)
            return max(one.real for one in values if one.imag)

        slip = scipy.optimize.brentq(rate, self.fold + 0.05, 8.0, xtol=1e-15)
        ends = self.at(self.fold)[2] - 0.3, self.at(slip)[2] + 0.3
        found = wb.hopf(self.machine(), "drive.value", between=ends, speeds="balance")
        assert found.kind == "hopf"
        assert found.value == pytest.approx(self.at(slip)[2], rel=1e-12)
        speeds = [one.speed for one in found.machine.inertias]
        assert speeds == pytest.approx([self.at(slip)[0]] * 2 + [self.at(slip)[1]], rel=1e-11)
        assert [one.kind for one in found.others] == ["divergence"]
        assert found.others[0].value == pytest.approx(self.at(self.fold)[2], rel=1e-9)

    @pytest.mark.parametrize("stiffness", [30.0, 1e4, 1e7])
    def test_hopf_point_with_conserved_momentum(self, stiffness):
        """Nothing holds the three inertias: the eigenvalues of twist and relative speeds."""
        machine = wb.Machine(
            inertias=[
                wb.Inertia("a", 5.0, speed=2.0), wb.Inertia("b", 0.7, speed=1.0),
                wb.Inertia("c", 2.9, speed=1.0),
            ],
            shafts=[
                wb.Shaft("b", "c", stiffness=stiffness, damping=0.1, name="shaft"),
                wb.Shaft("a", "c", stiffness=0.0, damping=0.9),
            ],
            contacts=[self.contact("a", "b", name="clutch")],
        )  # fmt: skip

        def rate(damping):
            fall, k = 3 * mpmath.exp(-2), mpmath.mpf(stiffness)

            def rates(twist, slip, speed):
                through, other = k * twist + damping * speed, mpmath.mpf(0.9) * (slip + speed)
                a = (fall * slip - other) / 5
                b = (-fall * slip - through) / mpmath.mpf(0.7)
                c = (other + through) / mpmath.mpf(2.9)
                return [speed, a - b, b - c]

            matrix = mpmath.matrix([rates(*one) for one in np.eye(3).tolist()]).T
            values = mpmath.eig(matrix, left=False, right=False)
            return max(mpmath.re(one) for one in values if abs(mpmath.im(one)) > 1e-20)

        with mpmath.workdps(40):
            expected = float(mpmath.findroot(rate, (0.2, 0.3), solver="secant"))
        found = wb.hopf(machine, "shaft.damping", between=(0.05, 1.0))
        assert found.kind == "hopf"
        assert found.value == pytest.approx(expected, rel=2e-14)

    def test_longer_chain_is_refused(self):
        names = "abcd"
        machine = wb.Machine(
            inertias=[wb.Inertia(one, 1.0) for one in names],
            shafts=[self.damper(one, 0.1) for one in names],
            contacts=[self.contact(a, b, name=f"{a}-on-{b}") for a, b in itertools.pairwise(names)],
            torques=[wb.Torque("a", 5.0)],
        )
        with pytest.raises(wb.InputError, match="chain") as caught:
            wb.steady_sliding(machine)
        assert caught.value.name == "machine"
        sticks = wb.steady_sliding(machine, sticking=["a-on-b"])
        assert all(one["a"] == pytest.approx(one["b"], rel=1e-14) for one in sticks)


class TestSticking:
    """J = 1 and 1 joined by a clutch, and 10 behind a spring of 1000 N m/rad."""

    CLUTCH = wb.Machine(
        inertias=[wb.Inertia("engine", 1.0), wb.Inertia("plate", 1.0), wb.Inertia("load", 10.0)],
        shafts=[wb.Shaft("plate", "load", stiffness=1000.0)],
        contacts=[contact("clutch", "engine", "plate")],
    )
    OPEN, LOCKED = (math.sqrt(1000.0 * (1.0 / one + 0.1)) / math.tau for one in (1.0, 2.0))

    def test_both_answers(self):
        found = wb.stability(self.CLUTCH)
        assert found.modes[0].frequency == pytest.approx(self.OPEN, rel=1e-12)
        assert found.held.sticking == ("clutch",)
        assert found.held.modes[0].frequency == pytest.approx(self.LOCKED, rel=1e-12)
        for words in ("5.27857 Hz", "Sticking at clutch", "3.89848 Hz"):
            assert words in found.verdict
        unpressed = self.CLUTCH.replace({"clutch.initial_force": 0.0})
        assert wb.stability(unpressed).held is None
        assert wb.stability(held(contact("brake"))).held is None  # nothing moves

    def test_named_contacts(self):
        found = wb.stability(self.CLUTCH, sticking=("clutch",))
        assert found.held is None
        (case,) = found.cases
        assert case.sticking == ("clutch",)
        assert case.modes[0].frequency == pytest.approx(self.LOCKED, rel=1e-12)
        np.testing.assert_allclose(case.modes[0].shape, [1.0, 1.0, -0.2], atol=1e-12)
        assert sum(one.rigid for one in case.modes) == 2

    def test_the_others_slide(self):
        machine = wb.Machine(
            inertias=self.CLUTCH.inertias, shafts=self.CLUTCH.shafts,
            contacts=[*self.CLUTCH.contacts, contact("brake", "load", slope=-2.0)],
        )  # fmt: skip
        rigid = wb.Machine(
            inertias=[wb.Inertia("both", 2.0), wb.Inertia("load", 10.0)],
            shafts=[wb.Shaft("both", "load", stiffness=1000.0)],
            contacts=[contact("brake", "load", slope=-2.0)],
        )
        one = wb.stability(machine, [3.0, 3.0, 3.0], sticking=["clutch"])
        other = wb.stability(rigid, [3.0, 3.0])
        np.testing.assert_allclose(one.eigenvalues, other.eigenvalues, atol=1e-12)
        assert one.modes[0].fed_by == other.modes[0].fed_by == "brake"

    @pytest.mark.parametrize(
        ("given", "speeds"), [("clutch", None), (["brake"], None), (["clutch"], [1.0, 2.0, 2.0])]
    )
    def test_wrong_contacts(self, given, speeds):
        with pytest.raises(wb.InputError) as caught:
            wb.stability(self.CLUTCH, speeds, given)
        assert caught.value.name == "sticking"


def test_the_frequency_of_a_controller_is_told():
    """J v+ = J v - T_s R mu delta v: the multiplier 1 - 1.2 is negative."""
    brake = contact("brake", slope=2000.0, sample_time=0.01)
    machine = wb.Machine(inertias=[wb.Inertia("disc", 1.0, speed=5.0)], contacts=[brake])
    mode = wb.stability(machine).modes[0]
    assert mode.multiplier == pytest.approx(-0.2, rel=1e-12)
    assert mode.alternates
    assert "sampling rate" in repr(mode)


@pytest.mark.parametrize("machine", [FREE, TestSticking.CLUTCH], ids=["free", "clutch"])
def test_a_verdict_is_equal_to_itself(machine):
    assert wb.stability(machine) == wb.stability(machine)
    assert wb.stability(machine).modes[0] == wb.stability(machine).modes[0]
    changed = machine.replace({f"{machine.contacts[0].name}.slope": 1.0})
    assert wb.stability(machine, [5.0, 6.0, 7.0][: len(machine.inertias)]) != wb.stability(
        changed, [5.0, 6.0, 7.0][: len(machine.inertias)]
    )


@pytest.mark.parametrize("name", ["slope", "brake.slope"])
def test_of_a_driveline(name):
    system = wb.paper.system(eta=-3.0)
    found = wb.hopf(system, name, between=(-20.0, 0.0))
    assert found.value == pytest.approx(wb.stability(system).forward.hopf_slope, rel=1e-12)


class TestDisplay:
    def test_in_a_terminal_and_in_a_notebook(self):
        found = wb.stability(held(contact("brake", slope=-15.0), speed=1.0))
        assert repr(found).startswith("Sliding forwards at brake: small vibration grows (1.5")
        html = found._repr_html_()
        for word in (
            "mode 0",
            "growth_rate",
            "Linearly unstable.",
            "fed_by",
            "sliding speed, brake",
        ):
            assert word in html
        limit = wb.hopf(held(contact("brake"), speed=1.0), "brake.slope", between=(-60.0, 0.0))
        assert repr(limit).startswith("Hopf point at brake.slope = -10, 1.59155 Hz")
        assert "mode" in limit._repr_html_()

    def test_as_json(self):
        sampled = contact("brake", slope=-12.0, sample_time=0.01)
        for machine in (held(sampled, speed=1.0), FREE):
            told = json.loads(json.dumps(wb.stability(machine).as_dict()))
            assert told["critical"] == 0
            assert len(told["cases"][0]["modes"]) >= 1
        limit = wb.hopf(held(sampled, speed=1.0), "brake.slope", between=(-60.0, 0.0))
        assert json.loads(json.dumps(limit.as_dict()))["kind"] == "hopf"


@pytest.mark.parametrize(
    ("speeds", "name"),
    [
        ({"disk": 1.0}, "speeds.disk"), ({"disc": np.nan}, "speeds.disc"), ([1.0], "speeds"),
        (3.0, "speeds"), ("fast", "speeds"), ([1.0, "x"], "speeds.disc"),
    ],
)  # fmt: skip
def test_wrong_speeds(speeds, name):
    with pytest.raises(wb.InputError) as caught:
        wb.stability(FREE, speeds=speeds)
    assert caught.value.name == name


def test_the_number_of_speeds_is_that_of_the_inertias():
    with pytest.raises(wb.InputError, match=r"must be 1 number in rad/s"):
        wb.stability(held(contact("brake")), speeds=[1.0, 2.0])
    with pytest.raises(wb.InputError, match=r"must be 2 numbers in rad/s"):
        wb.stability(FREE, speeds=[1.0])


def test_speeds_of_a_driveline():
    """Its brake slides faster than its inertia by the speed of the shaft."""
    system = wb.paper.system().replace(drive_speed=5.0)
    found = wb.stability(system, speeds=[2.0])
    assert found.cases[0].speeds == {"brake": 7.0}
    assert found.eigenvalues == wb.stability(system.machine, {"driveline": 2.0}).eigenvalues
    # With constant friction at any speed, as long as the brake is pressed.
    assert found.growth_rate == pytest.approx(wb.stability(system).forward.growth_rate, rel=1e-12)
    held = wb.stability(wb.paper.system(), sticking=["brake"])
    assert held.cases[0].sticking == ("brake",)


def test_wrong_arguments():
    with pytest.raises(wb.InputError, match=r"^system"):
        wb.stability(3.0)
    with pytest.raises(wb.InputError, match=r"^sticking = "):
        wb.stability(wb.paper.system(), sticking=["clutch"])
    with pytest.raises(wb.InputError, match=r"^method = .*curve"):
        wb.stability(wb.paper.system(), method="smooth")


@pytest.mark.parametrize("between", [(1.0, 1.0), (1.0,), 3.0, "ab", (0.0, np.inf), None])
def test_wrong_intervals(between):
    with pytest.raises(wb.InputError, match=r"^between"):
        wb.hopf(FREE, "brake.slope", between=between)


def test_wrong_parameters():
    with pytest.raises(wb.InputError, match=r"slope"):
        wb.hopf(FREE, "brake.slop", between=(0.0, 1.0))
    with pytest.raises(wb.InputError, match=r"^parameter"):
        wb.hopf(FREE, 3, between=(0.0, 1.0))
    with pytest.raises(wb.InputError, match=r"^system"):
        wb.hopf(3.0, "brake.slope", between=(0.0, 1.0))


def test_controllers_need_one_sample_time():
    two = [contact(f"brake{i}", slope=1.0, sample_time=0.01 * i) for i in (1, 2)]
    with pytest.raises(wb.InputError, match="one sample time") as caught:
        wb.stability(held(*two, speed=1.0))
    assert caught.value.name == "brake1.sample_time"
    constant = wb.stability(held(two[0], contact("brake2", sample_time=0.02), speed=1.0))
    assert constant.multipliers is not None


def test_delays_that_are_too_long():
    long = contact("brake", slope=1.0, sample_time=1e-4, delay=9000)
    with pytest.raises(wb.InputError, match="delay"):
        wb.stability(held(long, speed=1.0))


def test_too_many_contacts_that_stand():
    with pytest.raises(wb.InputError):
        wb.stability(held(*(contact(f"brake{i}") for i in range(11))))


def test_no_limit_where_nothing_vibrates():
    """Two free bodies and a clutch: the message states no growth rate."""
    machine = wb.Machine(
        inertias=[wb.Inertia("a", 1.0, speed=10.0), wb.Inertia("b", 2.0)],
        contacts=[
            wb.Contact(
                "a", "b", name="clutch", brake=wb.ConventionalBrake(radius=1.0),
                friction=wb.CoulombFriction(kinetic=0.3),
                actuation=wb.Actuation(initial_force=5.0),
            )
        ],
    )  # fmt: skip
    with pytest.raises(wb.InputError, match="nothing vibrates") as caught:
        wb.hopf(machine, "clutch.initial_force", between=(1.0, 9.0))
    assert "inf" not in str(caught.value)


class TestGaps:
    """A brake whose force falls with the speed, and a damped stop that friction presses it against.

    Without the stop the damping is 0.1 - 0.5 mu R, with it 0.5 more: sliding is stable if the
    friction torque (10 - 0.5) mu R = 4.75 twists the spring as far as the stop.
    """

    MACHINE = wb.Machine(
        inertias=[wb.Inertia("mass", 1.0)],
        shafts=[
            wb.Shaft("mass", "ground", 10.0, 0.1, name="spring"),
            wb.Shaft("mass", "ground", 100.0, 0.5, gap=(-1.0, 0.3), name="stop"),
        ],
        contacts=[
            wb.Contact(
                "mass", name="brake", brake=wb.ConventionalBrake(radius=1.0),
                friction=wb.CoulombFriction(kinetic=0.5), base_speed=1.0,
                actuation=wb.Actuation(initial_force=10.0, slope=-0.5),
            )
        ],
    )  # fmt: skip

    # The scan of the second interval contains the limit.
    @pytest.mark.parametrize("between", [(0.1, 2.0), (0.155, 0.795), (1.7, 0.2)])
    def test_over_the_gap(self, between):
        limit = wb.hopf(self.MACHINE, "stop.gap.1", between=between)
        assert limit.kind == "hopf"
        assert limit.value == pytest.approx(0.475, rel=1e-7)
        assert (limit.below, limit.above) == ("stable", "unstable")
        assert not limit.continuous
        # The less stable side: without the stop.
        assert limit.growth_rate == pytest.approx(0.075, rel=1e-9)
        assert limit.others == ()

    @pytest.mark.parametrize(
        ("name", "between", "value"),
        [("spring.stiffness", (5.0, 30.0), 4.75 / 0.3),
         ("brake.initial_force", (1.0, 20.0), 6.5)],
    )  # fmt: skip
    def test_over_the_load_at_the_gap(self, name, between, value):
        limit = wb.hopf(self.MACHINE, name, between=between)
        assert limit.value == pytest.approx(value, rel=1e-7)
        assert not limit.continuous
