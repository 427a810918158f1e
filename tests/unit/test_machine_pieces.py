"""Shafts with stages, gaps and a rest, and torques over speed and angle.

Right values are closed forms, balances, equivalent machines, and the motion of
``piecewise_reference``, which locates events on its own.
"""

from __future__ import annotations

import dataclasses
import math
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq

import piecewise_reference
import wedgebrake as wb
from machines import pressed, single

BREAKPOINT = 5


def body(*shafts: wb.Shaft, torques: Any = (), contacts: Any = (), **start: float) -> wb.Machine:
    """One inertia of 1 kg m^2 with shafts to the ground."""
    return wb.Machine(
        inertias=[wb.Inertia("disc", start.pop("inertia", 1.0), **start)],
        shafts=shafts, torques=torques, contacts=contacts,
    )  # fmt: skip


def stop(low: float, high: float, stiffness: float = 1e4, damping: float = 0.0, **more: Any) -> Any:
    return wb.Shaft(
        "disc", "ground", stiffness=stiffness, damping=damping, gap=(low, high), name="stop", **more
    )


def states(response: Any) -> Any:
    return np.hstack([response["angle"].to_numpy(), response["velocity"].to_numpy()])


class TestStops:
    @pytest.mark.parametrize("stiffness", [10.0, 1e4, 1e12])
    @pytest.mark.parametrize(("gap", "speed"), [(0.5, 2.0), (0.1, -0.3)])
    def test_flight_and_contact(self, stiffness: float, gap: float, speed: float) -> None:
        """A flight lasts gap/speed, a contact half a period of the spring.

        The rounding of an angle, about that of the gap, is a relative error of the speed when the
        spring turns it into a torque.
        """
        machine = body(stop(-gap / 2, gap / 2, stiffness), angle=-math.copysign(gap / 2, speed),
                       speed=speed)  # fmt: skip
        flight, contact = gap / abs(speed), math.pi / math.sqrt(stiffness)
        found = wb.simulate(machine, 10.2 * (flight + contact), times=[])
        lasted = np.diff(found["event_time"].to_numpy())
        assert set(found["event_part"].to_numpy()) == {"stop"}
        assert set(found["event_kind"].to_numpy()) == {BREAKPOINT}
        assert set(found["event_contact"].to_numpy()) == {-1}
        assert found.sizes["event"] == 20
        assert found["event_time"][0] == pytest.approx(flight, rel=1e-14)
        end = found["event_time"].to_numpy()[-1]
        rounding = 10.0 * 2.0**-53 * gap * math.sqrt(stiffness) / abs(speed)
        assert lasted[::2] == pytest.approx(contact, rel=1e-13, abs=1e-15 * end)
        assert lasted[1::2] == pytest.approx(flight, rel=1e-13 + rounding, abs=1e-15 * end)

    def test_energy_over_many_contacts(self) -> None:
        machine = body(stop(-0.25, 0.25), speed=2.0)
        period = 2.0 * (0.25 + math.pi / 100.0)
        found = wb.simulate(machine, 50_000.0 * period, times=[])
        assert found.sizes["event"] == 200_000
        final = wb.final_state(found)
        assert final.speeds["disc"] == pytest.approx(2.0, rel=1e-12)
        assert final.angles["disc"] == pytest.approx(0.0, abs=1e-9)

    @pytest.mark.parametrize("zeta", [0.01, 0.3, 1 / math.sqrt(2), 0.95, 1.0, 3.0])
    def test_first_damped_contact(self, zeta: float) -> None:
        """It ends where the spring no longer balances the damper; only then is it slower."""
        omega, speed = 50.0, 3.0
        machine = body(stop(-1.0, 0.0, omega**2, 2.0 * zeta * omega), angle=-0.3, speed=speed)
        found = wb.simulate(machine, 0.5, times=[])
        first, last = found["event_time"].to_numpy()[:2]
        assert first == pytest.approx(0.1, rel=1e-14)

        def motion(t: float) -> tuple[float, float]:
            """Angle and speed of the damped oscillator."""
            roots = np.sqrt(complex(zeta**2 - 1.0)) * omega
            decay = math.exp(-zeta * omega * t)
            sine = t if roots == 0.0 else (np.sinh(roots * t) / roots).real
            x = speed * decay * sine
            return x, speed * decay * np.cosh(roots * t).real - zeta * omega * x

        def push(t: float) -> float:
            x, v = motion(t)
            return omega**2 * x + 2.0 * zeta * omega * v

        if zeta < 1.0:
            damped = math.sqrt(1.0 - zeta**2)
            angle = math.atan2(2.0 * zeta * damped, -(1.0 - 2.0 * zeta**2)) % math.pi
            end = angle / (omega * damped)
        else:
            end = brentq(push, 1e-9, 3.0 / omega, xtol=1e-16)
        assert push(end) == pytest.approx(0.0, abs=1e-9)
        assert last - first == pytest.approx(end, rel=1e-12)
        # Without torque until it is inside again, and on to the other stop.
        after = wb.simulate(machine, last + 1e-3, times=[last, last + 1e-3])
        assert np.ptp(after["velocity"].to_numpy()) == pytest.approx(0.0, abs=1e-12)
        assert after["velocity"][0, 0].item() == pytest.approx(motion(end)[1], rel=1e-11)
        assert after["shaft_torque"][-1, 0].item() == 0.0

    def test_a_stiff_stop_is_a_rigid_one(self) -> None:
        """Between stops of infinite stiffness the period is twice gap/speed."""
        found = wb.simulate(body(stop(-0.1, 0.1, 1e15), speed=1.0), 4.0, times=[0.4, 3.6, 4.0])
        late = np.array([2.0, 18.0, 20.0]) * math.pi / math.sqrt(1e15)  # in the contacts so far
        assert found["angle"].to_numpy()[:, 0] == pytest.approx(-late, abs=1e-8)

    def test_a_ball_that_comes_to_rest_on_a_stop(self) -> None:
        """With damping the bounces end, and the spring carries the load."""
        fall = wb.Torque("disc", -9.81)
        found = wb.simulate(body(stop(0.0, 10.0, 1e3, 5.0), torques=[fall], angle=1.0), 20.0)
        assert found.attrs["status"] == "completed"
        assert wb.final_state(found).angles["disc"] == pytest.approx(-9.81e-3, rel=1e-9)
        assert wb.check(found) == []
        assert abs(wb.energy(found)["residual"].item()) < 1e-12


class TestSprings:
    @pytest.mark.parametrize("amplitude", [0.05, 0.1, 0.35, 2.0])
    @pytest.mark.parametrize(
        ("angles", "stiffnesses"),
        [([-0.1, 0.1], [500.0, 0.0, 500.0]), ([-0.1, 0.1], [20.0, 100.0, 20.0]),
         ([-0.3, -0.1, 0.1, 0.3], [900.0, 50.0, 5.0, 50.0, 900.0])],
    )  # fmt: skip
    def test_period_by_quadrature(self, angles: Any, stiffnesses: Any, amplitude: float) -> None:
        """A symmetric spring: 4 times the integral of 1/speed from 0 to the amplitude."""

        def torque(x: float) -> float:
            edges = [-9.0, *angles, 9.0]
            return sum(
                k * (min(max(x, a), b) - min(max(0.0, a), b))
                for a, b, k in zip(edges, edges[1:], stiffnesses, strict=False)
            )

        def stored(x: float) -> float:
            points = [one for one in angles if 0.0 < one < x]
            return float(quad(torque, 0.0, x, points=points or None, epsabs=0, epsrel=1e-13)[0])

        energy = stored(amplitude)
        if energy == 0.0:  # inside the dead zone it never returns
            return
        # x = amplitude sin(s) removes the singularity at the end.
        edges = [math.asin(a / amplitude) for a in angles if 0.0 < a < amplitude]
        parts = zip([0.0, *edges], [*edges, math.pi / 2], strict=True)
        quarter = sum(
            quad(
                lambda s: amplitude * math.cos(s)
                / math.sqrt(2.0 * _between(torque, amplitude * math.sin(s), amplitude, angles)),
                low, high, epsabs=0, epsrel=1e-12,
            )[0]
            for low, high in parts
        )  # fmt: skip
        shaft = wb.Shaft("disc", "ground", stiffness=wb.Stages(angles, stiffnesses))
        machine = body(shaft, speed=math.sqrt(2.0 * energy))
        found = wb.simulate(machine, 8.0 * quarter, times=[quarter, 4.0 * quarter, 8.0 * quarter])
        assert found["angle"].to_numpy().ravel() == pytest.approx([amplitude, 0, 0], abs=3e-10)
        last = [found["velocity"][0, 0].item(), *(found["velocity"][1:, 0] - math.sqrt(2 * energy))]
        assert last == pytest.approx([0.0] * 3, abs=1e-9)

    @pytest.mark.parametrize("rest", [0.1, -0.25])
    def test_a_rest_moves_the_equilibrium(self, rest: float) -> None:
        """The same motion about the rest, also with stages and gaps."""
        for more in (
            {"stiffness": 50.0, "damping": 0.5},
            {"stiffness": wb.Stages([-0.1, 0.2], [90.0, 3.0, 40.0]), "damping": 0.5},
            {"stiffness": 80.0, "damping": 0.2, "gap": (-0.1, 0.2)},
        ):
            plain = body(wb.Shaft("disc", "ground", **more), angle=0.3, speed=1.0)
            moved = body(wb.Shaft("disc", "ground", **more, rest=rest), angle=0.3 + rest, speed=1.0)
            one, other = (wb.simulate(each, 3.0, samples=50) for each in (plain, moved))
            assert other["angle"].to_numpy() - rest == pytest.approx(
                one["angle"].to_numpy(), abs=1e-12
            )
            assert other["shaft_torque"].to_numpy() == pytest.approx(
                one["shaft_torque"].to_numpy(), abs=1e-10
            )
            assert abs(wb.energy(other)["residual"].item()) < 1e-12
            assert wb.check(other) == []

    def test_preload_holds_a_load(self) -> None:
        shaft = wb.Shaft("disc", "ground", stiffness=40.0, rest=0.25)
        found = wb.simulate(body(shaft, torques=[wb.Torque("disc", -10.0)]), 5.0)
        assert np.abs(states(found)).max() == 0.0
        assert found["shaft_torque"].to_numpy() == pytest.approx(-10.0, rel=0)

    @pytest.mark.parametrize(
        "shaft",
        [wb.Shaft("disc", "frame", stiffness=30.0, gap=(0.0, 0.0), name="s"),
         wb.Shaft("disc", "frame", wb.Stages([-0.1, 0.0, 0.3], [30.0] * 4), 0.4, name="s"),
         wb.Shaft("disc", "frame", wb.Stages([0.1], [30.0] * 2), ratio=2.0, name="s")],
    )  # fmt: skip
    def test_equal_lines_are_one_line(self, shaft: wb.Shaft) -> None:
        inertias = [wb.Inertia("disc", 1.0, speed=2.0), wb.Inertia("frame", 0.5)]
        plain = wb.Shaft("disc", "frame", 30.0, shaft.damping, shaft.ratio, "s")
        found = [
            states(wb.simulate(wb.Machine(
                inertias=inertias, shafts=[one, wb.Shaft("frame", "ground", 10.0)],
                torques=[wb.Torque("disc", wb.Harmonic(5.0, 0.7))],
            ), 10.0, samples=100))
            for one in (shaft, plain)
        ]  # fmt: skip
        assert found[0] == pytest.approx(found[1], abs=1e-12)


def _between(torque: Any, low: float, high: float, edges: Any) -> float:
    """Work of a torque of lines, exactly, from its values at their ends."""
    places = [low, *(one for one in edges if low < one < high), high]
    return sum(0.5 * (torque(a) + torque(b)) * (b - a) for a, b in pairwise(places))


class TestTorques:
    def test_run_up_of_a_motor(self) -> None:
        """T = 12 (1 - w/100): an exponential up to the last point, constant speed beyond it."""
        curve = wb.OverSpeed([0.0, 100.0], [12.0, 0.0])
        times = np.linspace(0.0, 30.0, 13)
        found = wb.simulate(
            body(torques=[wb.Torque("disc", curve)], inertia=0.6), 30.0, times=times
        )
        rate = 12.0 / 100.0 / 0.6
        right = 100.0 * -np.expm1(-rate * times)
        assert found["velocity"].to_numpy()[:, 0] == pytest.approx(right, rel=1e-13)
        assert found["torque"].to_numpy()[:, 0] == pytest.approx(12.0 - 0.12 * right, rel=1e-12)
        beyond = wb.simulate(body(torques=[wb.Torque("disc", curve)], speed=120.0), 3.0)
        assert np.all(beyond["velocity"].to_numpy() == 120.0)
        below = wb.simulate(body(torques=[wb.Torque("disc", curve)], speed=-24.0), 2.0, times=[1.0])
        assert below["velocity"].item() == pytest.approx(-12.0, rel=1e-14)

    def test_drag_in_a_chain_of_lines(self) -> None:
        """A drag through 0 takes the same time in both directions, whatever its other points."""
        speeds = np.linspace(-10.0, 10.0, 9)
        drag = wb.Torque("disc", wb.OverSpeed(speeds, -np.sign(speeds) * speeds**2))
        for sign in (1.0, -1.0):
            found = wb.simulate(body(torques=[drag], speed=sign * 9.0), 2.0, times=[2.0])
            w, t = 9.0, 0.0
            for low in (7.5, 5.0, 2.5, 0.0):  # T = -(a + b (w - low)) on each line
                a = low**2
                b = ((low + 2.5) ** 2 - a) / 2.5
                needed = math.log((a + b * (w - low)) / a) / b if a else math.inf
                step = min(needed, 2.0 - t)
                w = low + ((a + b * (w - low)) * math.exp(-b * step) - a) / b
                t += step
            assert found["velocity"].item() == pytest.approx(sign * w, rel=1e-13)

    def test_reaction_on_the_other_inertia(self) -> None:
        """A torque over the difference of two speeds keeps their momentum."""
        machine = wb.Machine(
            inertias=[wb.Inertia("a", 2.0, speed=5.0), wb.Inertia("b", 1.0)],
            torques=[wb.Torque("a", wb.OverSpeed([-1.0, 1.0], [3.0, -3.0]), relative_to="b")],
        )
        found = wb.simulate(machine, 4.0)
        momentum = found["velocity"].to_numpy() @ [2.0, 1.0]
        assert momentum == pytest.approx(10.0, rel=1e-14)
        # 3 N m until the difference is 1, then it decays at the rate 3 (1/2 + 1).
        free = 4.0 / (3.0 * 1.5)
        last = math.exp(-4.5 * (4.0 - free))
        assert np.diff(found["velocity"].to_numpy()[-1]).item() == pytest.approx(-last, rel=1e-11)

    @pytest.mark.parametrize("sign", [1.0, -1.0])
    def test_many_turns_over_a_period(self, sign: float) -> None:
        """The kinetic energy is that of the work in whole turns, and in the last one."""
        curve = wb.OverAngle([0.0, 1.0, 4.0], [0.0, 3.0, -1.0], period=2.0 * math.pi)
        mean = np.trapezoid([0.0, 3.0, -1.0, 0.0], [0.0, 1.0, 4.0, 2.0 * math.pi])
        machine = body(torques=[wb.Torque("disc", curve)], speed=sign * 10.0)
        found = wb.simulate(machine, 20.0)
        angle, speed = states(found).T
        turns = np.floor(angle / (2.0 * math.pi))
        within = angle - 2.0 * math.pi * turns
        work = np.array([
            turn * mean + quad(lambda x: np.interp(x, [0, 1, 4, 2 * math.pi], [0, 3, -1, 0]), 0.0,
                               x, points=[1.0, 4.0], epsabs=1e-13)[0]
            for turn, x in zip(turns[::100], within[::100], strict=True)
        ])  # fmt: skip
        assert abs(turns[-1]) > 10
        assert 0.5 * speed[::100] ** 2 == pytest.approx(50.0 + work, rel=1e-12)

    def test_closing_line_of_a_period_given_or_not(self) -> None:
        curves = [
            wb.OverAngle([-1.0, 0.0, 1.0], [1.0, 2.0, 1.0], period=2.0),
            wb.OverAngle([-1.0, 0.0], [1.0, 2.0], period=2.0),
        ]
        found = [
            states(wb.simulate(body(torques=[wb.Torque("disc", one)], speed=1.0), 9.0, samples=9))
            for one in curves
        ]
        assert found[0] == pytest.approx(found[1], rel=1e-14)


@pytest.mark.parametrize("rounded", [False, True])
@pytest.mark.parametrize(
    "seed", [*range(3), *(pytest.param(one, marks=pytest.mark.slow) for one in range(3, 6))]
)
def test_random_machines(seed: int, rounded: bool) -> None:
    assert_right(piecewise_reference.random_machine(seed, rounded=rounded))


def assert_right(machine: wb.Machine) -> None:
    """The state of the reference, energy and laws; what a restart continues with is all of it."""
    times = np.linspace(0.0, 2.0, 41)
    found = wb.simulate(machine, 2.0, times=times)
    right = piecewise_reference.states(machine, times)
    assert states(found) == pytest.approx(right, abs=1e-9)
    assert abs(wb.energy(found)["residual"].item()) < 1e-11
    assert wb.check(found) == []
    for part in (wb.simulate(machine, 1.05), wb.simulate(machine, 2.0, max_events=5)):
        state = wb.FinalState.from_json(wb.final_state(part).to_json())
        rest = wb.simulate(machine, 2.0 - state.time, initial=state, times=[2.0])
        assert states(rest)[0] == pytest.approx(states(found)[-1], abs=1e-10)


class TestTies:
    @pytest.mark.parametrize("speed", [0.0, 1.0, -1.0, 1e-9, -1e-9])
    @pytest.mark.parametrize("at", [0.1, -0.1, 0.3])
    def test_a_start_at_a_breakpoint(self, at: float, speed: float) -> None:
        shafts = [
            stop(-0.1, 0.1, 30.0, 0.5),
            wb.Shaft("disc", "ground", wb.Stages([-0.1, 0.1, 0.3], [9.0, 1.0, 5.0, 0.0])),
        ]
        times = np.linspace(0.0, 3.0, 31)
        found = wb.simulate(body(*shafts, angle=at, speed=speed), 3.0, times=times)
        for side in (1e-7, -1e-7):
            beside = body(*shafts, angle=at + side, speed=speed + side)
            right = piecewise_reference.states(beside, times)
            assert states(found) == pytest.approx(right, abs=5e-6)

    def test_an_equilibrium_at_a_breakpoint(self) -> None:
        """Rounding of the torques moves nothing, and does not end the run."""
        shaft = wb.Shaft("disc", "ground", wb.Stages([0.1, 0.3], [0.7, 3.0, 11.0]), name="s")
        load = 0.1 * 0.7 + (0.3 - 0.1) * 3.0
        machine = body(shaft, torques=[wb.Torque("disc", load)], angle=0.3)
        found = wb.simulate(machine, 1e4)
        assert found.attrs["status"] == "completed"
        assert found["angle"].to_numpy() == pytest.approx(0.3, abs=1e-15)

    @pytest.mark.parametrize("damping", [0.0, 0.3])
    @pytest.mark.parametrize("limit", [0.1, 0.3, 0.7])
    def test_grazing_a_stop(self, limit: float, damping: float) -> None:
        """An oscillation that just reaches a stop is that without it."""
        spring = wb.Shaft("disc", "ground", 4.0, name="spring")
        touching = body(spring, stop(-limit, limit, 1e5, damping), angle=limit)
        plain = body(spring, angle=limit)
        one, other = (wb.simulate(each, 100.0, samples=2000) for each in (touching, plain))
        assert one.attrs["status"] == "completed"
        assert one["angle"].to_numpy() == pytest.approx(other["angle"].to_numpy(), abs=1e-11)

    def test_two_stops_at_one_instant(self) -> None:
        """Two bodies that move alike are each as alone, and so is one with the stop in halves."""
        alone = body(stop(-0.1, 0.2, 100.0, 1.0), speed=1.0, torques=[
            wb.Torque("disc", wb.Harmonic(3.0, 1.0))])  # fmt: skip
        halves = alone.replace(shafts=[
            named(stop(-0.1, 0.2, 50.0, 0.5), name) for name in ("left", "right")
        ])  # fmt: skip
        two = wb.Machine(
            inertias=[wb.Inertia("disc", 1.0, speed=1.0), wb.Inertia("other", 1.0, speed=1.0)],
            shafts=[
                stop(-0.1, 0.2, 100.0, 1.0),
                wb.Shaft("other", "ground", 100.0, 1.0, name="second", gap=(-0.1, 0.2)),
                wb.Shaft("disc", "other", 70.0, 2.0, name="between"),
            ],
            torques=[wb.Torque(one, wb.Harmonic(3.0, 1.0)) for one in ("disc", "other")],
        )
        right = states(wb.simulate(alone, 5.0, samples=200))
        assert states(wb.simulate(halves, 5.0, samples=200)) == pytest.approx(right, abs=1e-10)
        found = states(wb.simulate(two, 5.0, samples=200))
        assert found[:, ::2] == pytest.approx(right, abs=1e-10)
        assert found[:, 1::2] == pytest.approx(right, abs=1e-10)


def named(shaft: wb.Shaft, name: str) -> wb.Shaft:
    return shaft.model_copy(update={"name": name})


class TestContacts:
    def test_a_clutch_that_holds_is_one_body(self) -> None:
        """Its torque accelerates the second body, also through a stop that joins both."""
        shafts = [stop(-0.1, 0.1, 200.0, 2.0)]
        torque = wb.Torque("disc", wb.Harmonic(20.0, 0.8))
        two = wb.Machine(
            inertias=[wb.Inertia("disc", 1.0, speed=1.0), wb.Inertia("other", 0.5, speed=1.0)],
            shafts=[*shafts, wb.Shaft("disc", "other", 1e3, 1.0, gap=(-0.2, 0.3))],
            contacts=[pressed("disc", "other", force=1e5, name="clutch")], torques=[torque],
        )  # fmt: skip
        one = body(*shafts, torques=[torque], inertia=1.5, speed=1.0)
        found, right = (wb.simulate(each, 5.0, samples=300) for each in (two, one))
        assert found["angle"].to_numpy()[:, [0]] == pytest.approx(
            right["angle"].to_numpy(), abs=1e-11
        )
        load = right["torque"].to_numpy()[:, 0] - right["shaft_torque"].to_numpy()[:, 0]
        assert found["brake_torque"].to_numpy()[:, 0] == pytest.approx(load / 3.0, abs=1e-9)
        assert np.all(found["sticking"] == 1)

    @pytest.mark.parametrize("capacity", [5.0, 0.5])
    def test_a_brake_holds_against_a_stop(self, capacity: float) -> None:
        """It stands as long as the stop pushes less than its capacity."""
        machine = body(stop(-1.0, 0.0, 100.0), contacts=[pressed("disc", force=capacity)],
                       angle=0.02)  # fmt: skip
        found = wb.simulate(machine, 5.0)
        assert wb.check(found) == []
        held = capacity > 2.0
        assert bool(np.all(found["sticking"] == 1)) == held
        if held:
            assert found["brake_torque"].to_numpy() == pytest.approx(-2.0, rel=1e-12)

    def test_a_stop_throws_a_brake_off(self) -> None:
        """A damper that meets a moving body releases the clutch behind it at once."""
        machine = wb.Machine(
            inertias=[wb.Inertia("disc", 1.0, speed=2.0), wb.Inertia("other", 1.0, speed=2.0)],
            shafts=[stop(-9.0, 1.0, 100.0, 50.0)],
            contacts=[pressed("disc", "other", force=10.0, name="clutch")],
        )
        found = wb.simulate(machine, 0.6, times=[0.5, 0.5 + 1e-9])
        assert found["sticking"].to_numpy().ravel().tolist() == [0, 0]
        assert found["event_part"].to_numpy()[:2].tolist() == ["stop", "clutch"]
        assert np.ptp(found["event_time"].to_numpy()[:2]) == 0.0
        assert np.diff(found["velocity"].to_numpy(), axis=0)[0] == pytest.approx(
            [-90e-9, -10e-9], rel=1e-5
        )

    @pytest.mark.parametrize("curve", [
        wb.OverSpeed([-10.0, 0.0, 10.0], [1.0, 0.0, -1.0]), wb.OverSpeed([0.0], [0.0]),
    ])  # fmt: skip
    def test_rest_at_a_breakpoint_of_speed(self, curve: wb.OverSpeed) -> None:
        """A brake stops a body at the speed 0, where the drag has a point."""
        machine = single(pressed("disc", force=2.0), speed=3.0, torque=wb.Harmonic(3.0, 0.2))
        dragged = machine.replace(torques=[*machine.torques, wb.Torque("disc", curve, name="drag")])
        found = wb.simulate(dragged, 20.0)
        assert found.attrs["status"] == "completed"
        assert wb.check(found) == []
        assert found.sizes["stick"] > 4
        if not any(curve.torques):
            other = wb.simulate(machine, 20.0)
            assert states(found) == pytest.approx(states(other), abs=1e-12)

    def test_until_rest(self) -> None:
        """A body that a brake holds between two stops stays there, which is proved."""
        machine = body(stop(-0.1, 0.1, 50.0), contacts=[pressed("disc", force=1.0)], speed=2.0)
        found = wb.simulate(machine, 50.0, until="rest")
        assert found.attrs["at_rest"] == 1
        assert found.attrs["final_time"] < 50.0


SENSITIVE = [
    "stop.stiffness", "stop.damping", "stop.gap.1", "stop.rest", "damper.angles.0",
    "damper.stiffnesses.1", "damper.rest", "motor.torques.1", "motor.speeds.0", "cam.period",
    "cam.torques.1", "b.inertia", "spring.rest", "a.speed",
]  # fmt: skip


@pytest.fixture(scope="module")
def driveline() -> wb.Machine:
    return wb.Machine(
        inertias=[wb.Inertia("a", 1.0, 0.05, 2.0), wb.Inertia("b", 0.5, -0.02, 0.3)],
        shafts=[
            wb.Shaft("a", "b", wb.Stages([-0.1, 0.12], [100.0, 5.0, 80.0]), 0.5, name="damper"),
            wb.Shaft("b", "ground", 1e3, 3.0, name="stop", gap=(-0.2, 0.3)),
            wb.Shaft("a", "ground", 50.0, name="spring", rest=0.11),
        ],
        torques=[
            wb.Torque("a", wb.OverSpeed([0.5, 10.0], [5.0, 0.5]), name="motor"),
            wb.Torque("b", wb.OverAngle([0.01, 0.13], [0.3, 2.0], period=0.5), name="cam",
                      relative_to="a"),
            wb.Torque("a", wb.Harmonic(3.0, 1.0), name="load"),
        ],
    )  # fmt: skip


def test_derivatives(driveline: wb.Machine) -> None:
    """Against central differences of whole runs."""
    times, names = [0.4, 1.1, 1.6], SENSITIVE
    found = wb.sensitivity(driveline, names, duration=1.6, times=times)
    values, step = driveline.parameters(), 1e-6
    for number, name in enumerate(names):
        ends = [
            wb.simulate(driveline.replace({name: values[name] + change}), 1.6, times=times)
            for change in (step, -step)
        ]
        for variable in ("angle", "velocity", "shaft_torque", "event_time"):
            right = (ends[0][variable] - ends[1][variable]).to_numpy() / (2.0 * step)
            size = max(1.0, np.abs(right).max())
            assert found[variable][number].to_numpy() == pytest.approx(right, abs=2e-5 * size), name


class TestOtherFunctions:
    def test_linear_stability_with_a_rest(self) -> None:
        shaft = wb.Shaft("disc", "ground", 4.0, 0.1, rest=0.3)
        found = wb.stability(single(pressed("disc", force=1.0)).replace(shafts=[shaft]))
        plain = wb.stability(
            single(pressed("disc", force=1.0)).replace(
                shafts=[wb.Shaft("disc", "ground", 4.0, 0.1)]
            )
        )
        assert found.eigenvalues == plain.eigenvalues

    def test_motion_and_sweep_of_an_impact_oscillator(self) -> None:
        """Where it does not reach the stop the motion is that of the linear oscillator."""
        machine = body(
            wb.Shaft("disc", "ground", 4.0, 0.4, name="spring"),
            stop(-9.0, 2.0, 400.0, 2.0),
            torques=[wb.Torque("disc", wb.Harmonic(1.0, 0.3), name="load")],
        )
        omega = 0.6 * math.pi
        amplitude = 1.0 / abs(4.0 - omega**2 + 0.4j * omega)
        assert amplitude < 2.0
        assert wb.motion(machine).kind == "synchronous"
        found = wb.sweep(machine, {"stop.gap.1": [2.0, 0.5 * amplitude]}, progress=False)
        response = 1.0 / (4.0 - omega**2 + 0.4j * omega)
        points = found["angle"].to_numpy()[:, -1, 0]
        assert points[0] == pytest.approx(response.imag, rel=1e-6)
        assert abs(points[1] - points[0]) > 0.01
        assert found["events"].to_numpy()[0] == 0
        assert found["events"].to_numpy()[1] > 50
        hits = wb.simulate(machine.replace({"stop.gap.1": 0.5 * amplitude}), periods=50)
        assert hits.sizes["event"] > 50

    def test_orbit_and_multipliers(self) -> None:
        """The orbit with impacts is that of the run, and its multipliers have the right product."""
        machine = body(
            wb.Shaft("disc", "ground", 4.0, 0.4, name="spring"),
            stop(-9.0, 0.4, 40.0),
            torques=[wb.Torque("disc", wb.Harmonic(1.0, 0.3), name="load")],
        )
        orbit = wb.orbit(machine)
        # Without damping in the stop the divergence of the flow is -0.4 everywhere.
        product = np.prod(orbit.multipliers)
        assert product.real == pytest.approx(math.exp(-0.4 / 0.3), rel=1e-8)


class TestStudies:
    def test_round_trip(self, driveline: wb.Machine, tmp_path: Any) -> None:
        wb.save_study(wb.Study(system=driveline), tmp_path / "study.toml")
        assert wb.load_study(tmp_path / "study.toml").system == driveline
        assert wb.simulate(driveline, 0.1).attrs["status"] == "completed"

    def test_replaced_numbers(self, driveline: wb.Machine) -> None:
        new = driveline.replace({
            "stop.gap.1": 0.4, "damper.angles.0": -0.2, "damper.stiffnesses.2": 1.0,
            "motor.torques.0": 7.0, "cam.period": 0.6, "spring.rest": 0.0,
        })  # fmt: skip
        assert new.value("stop.gap.1") == 0.4
        assert new.value("damper.stiffnesses.2") == 1.0
        assert driveline.replace({"damper.stiffness": 3.0}).value("damper.stiffness") == 3.0
        assert new.quantities()["stop.gap.0"].unit == "rad"

    @pytest.mark.parametrize(
        ("make", "name"),
        [
            (lambda: wb.Stages([0.1, 0.1], [1.0, 2.0, 3.0]), "stiffness.angles[1]"),
            (lambda: wb.Stages([0.2, 0.1], [1.0, 2.0, 3.0]), "stiffness.angles[1]"),
            (lambda: wb.Stages([0.1], [1.0, 2.0, 3.0]), "stiffness.stiffnesses"),
            (lambda: wb.Stages([0.1], [1.0, -2.0]), "stiffness.stiffnesses[1]"),
            (lambda: wb.Stages([math.nan], [1.0, 2.0]), "stiffness.angles[0]"),
            (lambda: stop(0.2, 0.1), "stop.gap"),
            (lambda: stop(0.1, math.inf), "stop.gap[1]"),
            (lambda: stop(-0.1, 0.1, wb.Stages([0.1], [1.0, 2.0])), "stop.gap"),
            (lambda: stop(-0.1, 0.1, -1.0), "stop.stiffness"),
            (lambda: stop(-0.1, 0.1, 1.0, -1.0), "stop.damping"),
            (lambda: wb.Shaft("a", "b", {"angles": [0.2, 0.1], "stiffnesses": [1, 2, 3]}),
             "a-b.stiffness.angles[1]"),
            (lambda: wb.OverSpeed([1.0, 0.0], [1.0, 2.0]), "signal.speeds[1]"),
            (lambda: wb.OverSpeed([0.0, 1.0], [1.0]), "signal.torques"),
            (lambda: wb.OverAngle([0.0, 1.0], [1.0, 2.0], period=0.5), "signal.period"),
            (lambda: wb.OverAngle([0.0, 1.0], [1.0, 2.0], period=1.0), "signal.torques"),
            (lambda: wb.OverAngle([0.0], [1.0], period=0.0), "signal.period"),
            (lambda: wb.Torque("a", 3.0, relative_to="b", name="t"), "t.relative_to"),
            (lambda: wb.Torque("a", wb.OverSpeed([0.0], [1.0]), relative_to="a", name="t"),
             "t.relative_to"),
            (lambda: body(torques=[
                wb.Torque("disc", wb.OverSpeed([0.0], [1.0]), relative_to="x", name="t")
            ]), "t.relative_to"),
        ],
    )  # fmt: skip
    def test_wrong_values_are_named(self, make: Any, name: str) -> None:
        with pytest.raises(wb.InputError) as caught:
            make()
        assert caught.value.name == name
        assert caught.value.allowed


def test_fields_of_a_final_state() -> None:
    """A state of a machine without these parts serves one with them, and the reverse."""
    plain, stopped = body(speed=1.0), body(stop(-0.3, 0.3), speed=1.0)
    state = wb.final_state(wb.simulate(plain, 1.0))
    assert state.pieces == ()
    found = wb.simulate(stopped, 1.0, initial=state)
    assert found["angle"][-1, 0].item() < 1.0
    back = wb.final_state(wb.simulate(stopped, 0.29))
    assert len(back.pieces) == 1
    moved = dataclasses.replace(back, time=0.0)
    assert wb.simulate(plain, 1.0, initial=moved)["velocity"].to_numpy() == pytest.approx(1.0)
