"""Linear stability with stages, gaps and torques over the state: the piece of the equilibrium.

Right values are those of the linear machine of the piece in which the equilibrium lies, which is
found by hand, by a scan over all pieces, or from a decayed motion.
"""

from __future__ import annotations

import itertools
import math
from typing import Any

import numpy as np
import pytest

import wedgebrake as wb
from machines import contact, pressed

STAGES = wb.Stages(angles=(-0.1, 0.2), stiffnesses=(50.0, 10.0, 200.0))


def machine(*shafts: wb.Shaft, load: float = 0.0, more: Any = (), speed: float = 0.0) -> wb.Machine:
    """An inertia of 2 kg m^2 under a constant torque."""
    torques = [wb.Torque("disc", wb.Constant(load), name="load"), *more]
    return wb.Machine(
        inertias=[wb.Inertia("disc", 2.0, speed=speed)], shafts=shafts, torques=torques
    )


def frequency(found: Any) -> float:
    return abs(found.eigenvalues[0].imag)


class TestStagesAndGaps:
    @pytest.mark.parametrize(
        ("load", "stiffness"),
        [(-3.0, 50.0), (-0.5, 10.0), (0.0, 10.0), (1.9, 10.0), (2.5, 200.0), (1e6, 200.0)],
    )
    def test_stage_of_the_load(self, load: float, stiffness: float) -> None:
        """Torques at the corners are -1 and 2 N m."""
        shaft = wb.Shaft("disc", "ground", STAGES, 0.1, rest=0.7)
        found = wb.stability(machine(shaft, load=load))
        value = complex(-0.1 / 4.0, math.sqrt(stiffness / 2.0 - (0.1 / 4.0) ** 2))
        assert found.eigenvalues[0] == pytest.approx(value, rel=1e-13)

    @pytest.mark.parametrize("limits", [None, (-10.0, 1.9), (-0.5, 10.0)])
    @pytest.mark.parametrize("setpoint", [-2.6, -1.5, 0.0, 0.5, 1.5])
    @pytest.mark.parametrize("output", ["disc.torque", "brake.command"])
    def test_stage_of_the_output_of_a_controller(
        self, output: str, setpoint: float, limits: tuple[float, float] | None
    ) -> None:
        """Of a proportional one, which measures another inertia; -1 and 2 N m are at corners."""
        torque = 2.0 * (setpoint - 0.3)  # the other inertia turns at 0.3 rad/s
        if limits is not None:
            torque = min(max(torque, limits[0]), limits[1])
        # The brake pulls the disc along, as its base is faster; its force is 5 N without a command.
        torque = torque if output == "disc.torque" else max(5.0 + torque, 0.0)
        stiffness = 50.0 if torque < -1.0 else 10.0 if torque < 2.0 else 200.0
        brake = pressed("disc", name="brake", force=5.0, base_speed=3.0)
        loop = wb.Controller(
            "loop", {"other.speed": 1.0}, setpoint, output, proportional=2.0, limits=limits
        )
        contacts = [brake] if output == "brake.command" else []

        def made(shaft: Any) -> wb.Machine:
            bodies = [wb.Inertia("disc", 2.0), wb.Inertia("other", 1.0, speed=0.3)]
            return wb.Machine(
                inertias=bodies, shafts=[wb.Shaft("disc", "ground", shaft, 0.1, name="shaft")],
                contacts=contacts, controllers=[loop],
            )  # fmt: skip

        found, wanted = wb.stability(made(STAGES)), wb.stability(made(stiffness))
        assert found.eigenvalues == pytest.approx(wanted.eigenvalues, rel=1e-13)

    def test_integral_part(self) -> None:
        """Its steady output is not known."""
        stops = machine(wb.Shaft("disc", "ground", STAGES))
        loop = wb.Controller("loop", {"disc.speed": 1.0}, 0.0, "disc.torque", integral=1.0)
        with pytest.raises(wb.InputError) as caught:
            wb.stability(stops.replace(controllers=[loop]))
        assert caught.value.name == "loop"

    @pytest.mark.parametrize("load", [-1.0, 2.0])
    def test_corner(self, load: float) -> None:
        with pytest.raises(wb.InputError) as caught:
            wb.stability(machine(wb.Shaft("disc", "ground", STAGES, name="damper"), load=load))
        assert caught.value.name == "damper.stiffness"

    @pytest.mark.parametrize(("load", "side"), [(30.0, 1), (-30.0, -1)])
    @pytest.mark.parametrize("damping", [0.0, 4.0])
    def test_end_stop(self, load: float, side: int, damping: float) -> None:
        """The weak spring and the stop that the load presses on act in parallel."""
        spring = wb.Shaft("disc", "ground", 100.0, 1.0, name="spring")
        stop = wb.Shaft("disc", "ground", 1e4, damping, gap=(-0.2, 0.2), name="stop")
        found = wb.stability(machine(spring, stop, load=load))
        alone = machine(spring, wb.Shaft("disc", "ground", 1e4, damping, name="second"))
        assert found.eigenvalues == pytest.approx(wb.stability(alone).eigenvalues, rel=1e-12)
        assert frequency(wb.stability(machine(spring, stop, load=side * 15.0))) == pytest.approx(
            math.sqrt(50.0 - 0.0625), rel=1e-13
        )

    def test_inside_a_gap_nothing_holds(self) -> None:
        """A body in the middle of its gap turns freely."""
        stop = wb.Shaft("disc", "ground", 1e4, gap=(-0.2, 0.2), name="stop")
        found = wb.stability(machine(stop))
        assert [one.rigid for one in found.modes] == [True] * len(found.modes)

    def test_pressed_through_a_gap(self) -> None:
        """From the middle of a gap the equilibrium is on the stop on which the load presses."""
        stop = wb.Shaft("disc", "ground", 1e4, 2.0, gap=(-0.2, 0.2), name="stop")
        found = wb.stability(machine(stop, load=5.0))
        plain = wb.stability(machine(wb.Shaft("disc", "ground", 1e4, 2.0)))
        assert found.eigenvalues == pytest.approx(plain.eigenvalues, rel=1e-13)

    def test_a_small_load_behind_a_soft_stage_and_a_stiff_gap(self) -> None:
        """The deflection of the stiff gap is far smaller than that of the stage."""
        given = wb.Machine(
            inertias=[wb.Inertia("hub", 0.004), wb.Inertia("gear", 0.001)],
            shafts=[
                wb.Shaft("hub", "ground", wb.Stages((-0.1, 0.1), (600.0, 15.0, 900.0)), 0.05),
                wb.Shaft("hub", "gear", 2e4, 0.5, gap=(-0.004, 0.004), name="backlash"),
            ],
            torques=[wb.Torque("gear", wb.Constant(-0.15), name="oil")],
        )
        linear = given.replace(
            shafts=[wb.Shaft("hub", "ground", 15.0, 0.05), wb.Shaft("hub", "gear", 2e4, 0.5)]
        )
        assert wb.stability(given).eigenvalues == pytest.approx(
            wb.stability(linear).eigenvalues, rel=1e-9
        )

    def test_directions_of_a_brake_choose_stages(self) -> None:
        """Friction presses the spring into another stage in each direction."""
        shaft = wb.Shaft("disc", "ground", STAGES, name="damper")
        brake = pressed("disc", force=100.0)
        given = machine(shaft).replace(contacts=[brake])
        found = wb.stability(given)
        assert len(found.cases) == 2
        for case in found.cases:
            torque = -case.contacts[0].gain * case.contacts[0].force
            stage = 50.0 if torque < -1.0 else 200.0 if torque > 2.0 else 10.0
            assert stage != 10.0
            assert abs(case.eigenvalues[0].imag) == pytest.approx(math.sqrt(stage / 2.0), rel=1e-13)

    def test_decayed_motion(self) -> None:
        """The motion ends in the piece about which the verdict is linear."""
        parts = [
            wb.Shaft("motor", "ground", STAGES, 3.0, name="damper"),
            wb.Shaft("motor", "disc", 300.0, 3.0, gap=(-0.1, 0.1), name="backlash"),
            wb.Shaft("disc", "ground", 20.0, 3.0, name="spring"),
        ]
        given = wb.Machine(
            inertias=[wb.Inertia("motor", 1.0), wb.Inertia("disc", 2.0)], shafts=parts,
            torques=[wb.Torque("motor", wb.Constant(40.0), name="load")],
        )  # fmt: skip
        end = wb.final_state(wb.simulate(given, 200.0, times=[]))
        motor, disc = end.angles["motor"], end.angles["disc"]
        assert motor > 0.2
        assert motor - disc > 0.1
        linear = given.replace(shafts=[
            wb.Shaft("motor", "ground", 200.0, 3.0),
            wb.Shaft("motor", "disc", 300.0, 3.0),
            wb.Shaft("disc", "ground", 20.0, 3.0),
        ])  # fmt: skip
        found = wb.stability(given).eigenvalues
        assert found == pytest.approx(wb.stability(linear).eigenvalues, rel=1e-12)

    @pytest.mark.parametrize("seed", range(60))
    def test_random_chains_against_all_pieces(self, seed: int) -> None:
        """Of all combinations of pieces, one contains its own equilibrium."""
        random = np.random.default_rng(seed)
        n = int(random.integers(1, 4))
        names = [f"i{k}" for k in range(n)]
        stages, shafts = [], []
        for k, name in enumerate(names):
            places = np.sort(random.uniform(-0.5, 0.5, 2)).round(2 if seed % 2 else 12)
            places[1] += 0.01
            values = random.uniform(1.0, 100.0, 3).round(1)
            damping, rest = random.uniform(0.0, 2.0), round(float(random.normal(0.0, 0.2)), 2)
            stages.append((places, values, rest))
            other = "ground" if k == 0 else names[k - 1]
            stage = wb.Stages(angles=tuple(places), stiffnesses=tuple(values))
            shafts.append(wb.Shaft(name, other, stage, damping, rest=rest, name=f"s{k}"))
        loads = random.normal(0.0, 10.0, n)
        inertias = random.uniform(0.5, 3.0, n)
        given = wb.Machine(
            inertias=[wb.Inertia(a, b) for a, b in zip(names, inertias, strict=True)],
            shafts=shafts,
            torques=[
                wb.Torque(a, wb.Constant(b), name=f"t{a}")
                for a, b in zip(names, loads, strict=True)
            ],
        )
        right = []
        for pieces in itertools.product(range(3), repeat=n):
            # In a chain each shaft carries all loads behind it.
            inside = True
            for k, piece in enumerate(pieces):
                twist = self._twist(stages[k], loads[k:].sum(), piece)
                inside = inside and twist is not None
            if inside:
                right.append([stages[k][1][piece] for k, piece in enumerate(pieces)])
        assert len(right) == 1
        linear = [
            one.model_copy(update={"stiffness": float(value)})
            for one, value in zip(shafts, right[0], strict=True)
        ]
        found, plain = wb.stability(given), wb.stability(given.replace(shafts=linear))
        size = abs(plain.eigenvalues[0])
        assert found.eigenvalues == pytest.approx(plain.eigenvalues, rel=1e-9, abs=1e-9 * size)

    @staticmethod
    def _twist(stage: Any, torque: float, piece: int) -> float | None:
        """The twist at which a piece carries a torque, if it is in this piece."""
        (low, high), values, _ = stage
        # The torque is 0 at the twist 0, relative to the rest.
        at_low = values[1] * low if low <= 0.0 <= high else None
        if at_low is None:
            at_low = values[0] * low if low > 0.0 else values[2] * high - values[1] * (high - low)
        at_high = at_low + values[1] * (high - low)
        if piece == 0:
            return low + (torque - at_low) / values[0] if torque < at_low else None
        if piece == 2:
            return high + (torque - at_high) / values[2] if torque > at_high else None
        return low + (torque - at_low) / values[1] if at_low < torque < at_high else None


class TestTorquesOverTheState:
    MOTOR = wb.OverSpeed((0.0, 100.0, 160.0), (200.0, 150.0, 0.0))

    @pytest.mark.parametrize(("speed", "slope"), [(50.0, -0.5), (130.0, -2.5), (200.0, 0.0)])
    def test_motor_curve_is_a_damper(self, speed: float, slope: float) -> None:
        motor = wb.Torque("disc", self.MOTOR, name="motor")
        found = wb.stability(machine(more=[motor], speed=speed))
        moving = [one for one in found.eigenvalues if one != 0.0]
        assert moving == pytest.approx([slope / 2.0] if slope else [], rel=1e-14)

    def test_corner_takes_the_steeper_line(self) -> None:
        """Of the slopes -0.5 and -2.5 the first one decays more slowly."""
        motor = wb.Torque("disc", self.MOTOR, name="motor")
        found = wb.stability(machine(more=[motor], speed=100.0))
        assert found.growth_rate == pytest.approx(-0.25, rel=1e-14)

    def test_rising_curve_is_unstable(self) -> None:
        curve = wb.Torque("disc", wb.OverSpeed((0.0, 10.0), (0.0, 30.0)), name="curve")
        found = wb.stability(machine(more=[curve], speed=5.0))
        assert not found.stable
        assert found.growth_rate == pytest.approx(1.5, rel=1e-14)

    def test_relative_to_another_inertia(self) -> None:
        curve = wb.OverSpeed((-10.0, 10.0), (30.0, -30.0))
        inertias = [wb.Inertia("a", 1.0, speed=4.0), wb.Inertia("b", 2.0)]
        given = wb.Machine(
            inertias=inertias, torques=[wb.Torque("a", curve, name="c", relative_to="b")]
        )
        plain = wb.Machine(inertias=inertias, shafts=[wb.Shaft("a", "b", 0.0, 3.0)])
        assert wb.stability(given).growth_rate == wb.stability(plain).growth_rate

    def test_magnetic_spring_over_an_angle(self) -> None:
        """A torque that falls over the angle adds its slope to the stiffness of the spring."""
        curve = wb.OverAngle((0.0, 1.0, 3.0), (0.0, 8.0, -8.0))
        magnet = wb.Torque("disc", curve, name="magnet")
        spring = wb.Shaft("disc", "ground", 2.0, 0.5, rest=0.4, name="spring")
        given = machine(spring, more=[magnet])
        # On the falling line, 16 - 8 q = 2 (q - 0.4) at q = 1.68; no other line has a solution.
        found = wb.stability(given.replace({"disc.angle": 2.0}))
        value = complex(-0.125, math.sqrt(10.0 / 2.0 - 0.125**2))
        assert found.eigenvalues[0] == pytest.approx(value, rel=1e-13)

    def test_angle_that_grows(self) -> None:
        curve = wb.Torque("disc", wb.OverAngle((0.0, 1.0), (0.0, 8.0)), name="mesh")
        with pytest.raises(wb.InputError) as caught:
            wb.stability(machine(more=[curve], speed=3.0))
        assert caught.value.name == "mesh.signal"


class TestSteadySliding:
    @pytest.mark.parametrize(("load", "speed"), [(-150.0, 100.0), (-75.0, 130.0), (-175.0, 50.0)])
    def test_motor_curve_and_load(self, load: float, speed: float) -> None:
        """Speeds at which the curve gives the load: a corner among them."""
        motor = wb.Torque("disc", TestTorquesOverTheState.MOTOR, name="motor")
        (found,) = wb.steady_sliding(machine(load=load, more=[motor]))
        assert found["disc"] == pytest.approx(speed, rel=1e-13)

    def test_curve_and_brake(self) -> None:
        """A brake holds the motor at the speed where their torques are equal."""
        motor = wb.Torque("disc", TestTorquesOverTheState.MOTOR, name="motor")
        brake = pressed("disc", force=100.0)
        given = machine(more=[motor]).replace(contacts=[brake])
        torque = brake.brake.radius * brake.brake.amplification(brake.friction.kinetic) * 100.0
        assert torque < 150.0
        (found,) = wb.steady_sliding(given)
        assert found["disc"] == pytest.approx(100.0 + (150.0 - torque) / 2.5, rel=1e-13)
        assert wb.stability(given, found).growth_rate == pytest.approx(-1.25, rel=1e-13)

    def test_over_an_angle(self) -> None:
        curve = wb.Torque("disc", wb.OverAngle((0.0, 1.0), (0.0, 8.0)), name="mesh")
        with pytest.raises(wb.InputError) as caught:
            wb.steady_sliding(machine(more=[curve]))
        assert caught.value.name == "mesh.signal"


class TestCornersInDecisions:
    """A stop adds damping: sliding that is unstable in its gap is stable beyond its end."""

    def machine(self, load: float = 4.5, slope: float = -2.0) -> wb.Machine:
        return wb.Machine(
            inertias=[wb.Inertia("disc", 1.0)],
            shafts=[
                wb.Shaft("disc", "ground", 50.0, 0.5, name="spring"),
                wb.Shaft("disc", "ground", 200.0, 1.0, gap=(-0.1, 0.1), name="stop"),
            ],
            contacts=[
                contact("disc", name="brake", force=1.0 - 5.0 * slope, slope=slope, base_speed=5.0)
            ],
            torques=[wb.Torque("disc", load, name="load")],
        )

    def test_a_margin_that_ends_at_the_corner(self) -> None:
        """At 5 rad/s the contact adds 0.5 N m; the gap closes at 50 * 0.1 = 5 N m."""
        with pytest.raises(wb.InputError, match="corner"):
            wb.stability(self.machine())
        found = wb.margin(self.machine(), "load.value", between=(2.0, 8.0))
        assert found.low == pytest.approx(4.5, rel=1e-8)  # of what counts as at the corner
        assert found.high is None

    def test_the_less_stable_side_counts(self) -> None:
        loads = {"load.value": np.array([4.0, 4.5, 5.0])}
        for slope, unstable in ((-2.0, (1, 1, 0)), (-4.0, (1, 1, 1)), (-0.5, (0, 0, 0))):
            found = wb.scatter(self.machine(slope=slope), loads, outcomes=["unstable_backwards"])
            assert tuple(found["occurs"][:, 0].to_numpy()) == unstable


class TestAlmostUnloadedGaps:
    """Backlash between a and b, which stands on a spring; friction of a closes it."""

    @staticmethod
    def machine(force: float) -> wb.Machine:
        return wb.Machine(
            inertias=[wb.Inertia("a", 1.0, speed=2.0), wb.Inertia("b", 0.5, speed=2.0)],
            shafts=[
                wb.Shaft("a", "b", 400.0, 1.0, name="backlash", gap=(-0.01, 0.01)),
                wb.Shaft("b", "ground", 200.0, 0.5, name="mount"),
            ],
            contacts=[contact("a", name="brake", force=force)],
        )

    @pytest.mark.parametrize("force", [1e-3, 1e-5, 1e-7])
    def test_a_tiny_force_closes_the_gap(self, force: float) -> None:
        found = wb.stability(self.machine(force)).eigenvalues
        expected = wb.stability(self.machine(10.0)).eigenvalues
        assert found == pytest.approx(expected, rel=1e-9)

    def test_without_a_force_the_gap_stays_open(self) -> None:
        alone = self.machine(0.0).replace(shafts=self.machine(0.0).shafts[1:])
        modes = [wb.stability(one).modes[0] for one in (self.machine(0.0), alone)]
        assert modes[0].frequency == pytest.approx(modes[1].frequency, rel=1e-9)
