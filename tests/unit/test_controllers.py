"""Feedback controllers: outputs, limits, samples, stability, and what refuses them."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.linalg import block_diag, expm
from scipy.signal import cont2discrete, lti, step

import control_reference
import wedgebrake as wb
from control_reference import random_machine

INERTIA, GAIN, INTEGRAL = 2.0, 6.0, 5.0


def controller(**more: Any) -> wb.Controller:
    given: dict[str, Any] = {
        "measured": {"motor.speed": 1.0}, "setpoint": 10.0, "output": "motor.torque",
        "proportional": GAIN, "integral": INTEGRAL,
    }  # fmt: skip
    return wb.Controller("loop", **{**given, **more})


def motor(speed: float = 0.0, **more: Any) -> wb.Machine:
    """One inertia under the torque of a controller of its speed."""
    return wb.Machine(
        inertias=[wb.Inertia("motor", INERTIA, speed=speed)], controllers=[controller(**more)]
    )


def brake(actuation: wb.Actuation | None = None, **more: Any) -> wb.Contact:
    actuation = actuation or wb.Actuation(initial_force=100.0, lag=0.05)
    given: dict[str, Any] = {
        "name": "brake", "brake": wb.ConventionalBrake(radius=0.5),
        "friction": wb.CoulombFriction(kinetic=0.4), "actuation": actuation,
    }  # fmt: skip
    return wb.Contact("wheel", **{**given, **more})


def wheel(*loops: wb.Controller, drive: float = 20.0, speed: float = 50.5, **more: Any) -> Any:
    """A driven wheel with a brake: its torque is 0.2 m times the force."""
    return wb.Machine(
        inertias=[wb.Inertia("wheel", INERTIA, speed=speed)], contacts=[brake(**more)],
        torques=[wb.Torque("wheel", drive, name="drive")], controllers=loops,
    )  # fmt: skip


def speed_loop(**more: Any) -> wb.Controller:
    """The brake holds the speed of the wheel: the faster, the more force."""
    given: dict[str, Any] = {
        "measured": {"wheel.speed": -1.0}, "setpoint": -50.0, "output": "brake.command",
        "proportional": 4.0, "integral": 10.0,
    }  # fmt: skip
    return wb.Controller("loop", **{**given, **more})


def force_loop(**more: Any) -> wb.Controller:
    """An electromechanical brake: a loop around its force, which the lag delays."""
    given: dict[str, Any] = {
        "measured": {"brake.force": 1.0}, "setpoint": 300.0, "output": "brake.command",
        "proportional": 0.5, "integral": 20.0, "limits": (0.0, 900.0),
    }  # fmt: skip
    return wb.Controller("force", **{**given, **more})


def speeds(response: Any) -> Any:
    return response["velocity"].to_numpy()


def sorted_values(values: Any) -> Any:
    """Complex numbers by their parts, without rounding errors in the order."""
    found = np.asarray(values, complex)
    return found[np.lexsort((found.imag, np.round(found.real, 9)))]


class TestLinear:
    def test_the_step_response_is_that_of_the_matrix_exponential(self) -> None:
        times = np.linspace(0.0, 4.0, 81)
        found = wb.simulate(motor(), 4.0, times=times)
        # v' = (K_p e + I)/J, I' = K_i e
        matrix = np.array([
            [-GAIN / INERTIA, 1.0 / INERTIA, GAIN * 10.0 / INERTIA],
            [-INTEGRAL, 0.0, 50.0],
            [0, 0, 0],
        ])  # fmt: skip
        right = np.array([expm(matrix * t)[:2, 2] for t in times])
        assert speeds(found)[:, 0] == pytest.approx(right[:, 0], abs=1e-12)
        integral = found["control_integral"].to_numpy()[:, 0]
        assert integral == pytest.approx(right[:, 1], abs=1e-12)
        output = found["control_output"].to_numpy()[:, 0]
        assert output == pytest.approx(GAIN * (10.0 - right[:, 0]) + right[:, 1], abs=1e-11)
        assert found["torque"].to_numpy()[:, 0] == pytest.approx(output)

    def test_the_filtered_derivative_is_that_of_scipy(self) -> None:
        """PD control of an angle: from setpoint to angle, without the kick of the derivative."""
        gain, derivative, smooth = 8.0, 3.0, 0.1
        machine = motor(
            measured={"motor.angle": 1.0}, setpoint=0.0, proportional=gain, integral=0.0,
            derivative=derivative, filter_time=smooth,
        ).replace({"motor.angle": 1.0})  # fmt: skip
        times = np.linspace(0.0, 5.0, 101)
        found = wb.simulate(machine, 5.0, times=times)["angle"].to_numpy()[:, 0]
        # J q'' = -K_p q - K_d s/(T s + 1) q from q = 1 with the filter at rest; with q = 1 + x this
        # is the answer of x to a step of -1 in K_p alone.
        denominator = np.polyadd(np.polymul([INERTIA, 0.0, gain], [smooth, 1.0]), [derivative, 0.0])
        _, answer = step(lti(np.polymul([-gain], [smooth, 1.0]), denominator), T=times)
        assert found == pytest.approx(1.0 + answer, abs=1e-11)

    def test_a_jump_of_the_setpoint_reaches_the_derivative(self) -> None:
        jump = wb.Table(times=[0.0, 1.0, 1.0, 2.0], values=[0.0, 0.0, 1.0, 1.0])
        loop = {"setpoint": jump, "integral": 0.0, "derivative": 0.5, "filter_time": 0.1}
        found = wb.simulate(motor(**loop), 1.5, times=[0.999, 1.0])
        assert found["control_output"].to_numpy()[:, 0] == pytest.approx([0.0, GAIN + 0.5 / 0.1])

    def test_a_controller_without_gains_changes_nothing(self) -> None:
        plain = wheel()
        for more in ({}, {"limits": (-1.0, 1.0)}, {"sample_time": 0.01}):
            loop = speed_loop(proportional=0.0, integral=0.0, **more)
            one, other = (wb.simulate(m, 20.0, samples=201) for m in (plain, wheel(loop)))
            assert speeds(other) == pytest.approx(speeds(one), rel=1e-13)
            assert not other["control_output"].to_numpy().any()

    def test_a_proportional_torque_is_a_damper(self) -> None:
        """The same motion, with sticks and slips, as with a damper to the ground."""

        def machine(damping: float, gain: float) -> wb.Machine:
            return wb.Machine(
                inertias=[wb.Inertia("wheel", INERTIA)],
                shafts=[wb.Shaft("wheel", "ground", 300.0, damping)],
                contacts=[brake(wb.Actuation(initial_force=100.0))],
                torques=[wb.Torque("wheel", wb.Harmonic(60.0, 1.3))],
                controllers=[
                    wb.Controller(
                        "loop", {"wheel.speed": 1.0}, 0.0, "wheel.torque", proportional=gain
                    )
                ],
            )

        one, other = (
            wb.simulate(m, 6.0, samples=601) for m in (machine(3.0, 0.0), machine(0.0, 3.0))
        )
        assert one.sizes["event"] > 6
        assert other["event_time"].to_numpy() == pytest.approx(
            one["event_time"].to_numpy(), abs=1e-11
        )
        assert speeds(other) == pytest.approx(speeds(one), abs=1e-11)
        assert wb.check(other) == []

    def test_a_measured_shaft_is_a_spring(self) -> None:
        """A torque of -k times the twist, measured as a torque of a shaft or as angles."""
        found = []
        for measured, gain in (
            ({"spring.torque": 1.0}, 0.5), ({"a.angle": 200.0, "b.angle": -400.0}, 0.5),
        ):  # fmt: skip
            machine = wb.Machine(
                inertias=[wb.Inertia("a", 1.0, 0.1), wb.Inertia("b", 2.0, speed=1.0)],
                shafts=[
                    wb.Shaft("a", "b", 200.0, ratio=2.0, name="spring", rest=0.02),
                    wb.Shaft("b", "ground", 100.0),
                ],
                controllers=[
                    wb.Controller(
                        "loop", measured, 0.0 if "spring.torque" in measured else 4.0, "a.torque",
                        proportional=gain,
                    )
                ],
            )  # fmt: skip
            found.append(speeds(wb.simulate(machine, 3.0, samples=61)))
        assert found[0] == pytest.approx(found[1], abs=1e-11)


class TestLimits:
    def test_the_integral_rests_to_the_bit_beyond_a_limit(self) -> None:
        machine = motor(limits=(-20.0, 20.0), integral=1.7, setpoint=40.0, speed=1.0)
        first = wb.simulate(machine, 1.0, samples=2)
        machine = machine.replace({"loop.setpoint": 1000.0})
        then = wb.simulate(machine, 5.0, initial=wb.final_state(first), samples=101)
        integral = then["control_integral"].to_numpy()[:, 0]
        assert np.all(integral == integral[0])
        assert np.all(then["control_output"].to_numpy() == 20.0)
        assert speeds(then)[:, 0] == pytest.approx(
            speeds(first)[-1, 0] + 10.0 * (then["time"].to_numpy() - 1.0), rel=1e-13
        )

    def test_the_start_of_the_slow_return(self) -> None:
        """Closed form: at 10 rad/s^2 until K_p e = 20, then the linear loop."""
        machine = motor(limits=(-20.0, 20.0))
        found = wb.simulate(machine, 3.0, times=[0.5, 2.0 / 3.0, 1.5])
        assert found["event_time"].to_numpy() == pytest.approx([2.0 / 3.0], abs=1e-14)
        assert found["event_part"].to_numpy().tolist() == ["loop"]
        matrix = np.array([[-GAIN / INERTIA, 1.0 / INERTIA], [-INTEGRAL, 0.0]])
        left = expm(matrix * (1.5 - 2.0 / 3.0)) @ [20.0 / 3.0 - 10.0, 0.0]
        assert speeds(found)[:, 0] == pytest.approx([5.0, 20.0 / 3.0, 10.0 + left[0]], abs=1e-13)

    def test_an_output_that_stays_at_its_limit(self) -> None:
        """With a large integral gain the output slides along the limit: the integral follows."""
        machine = motor(limits=(-20.0, 20.0), integral=60.0)
        times = np.linspace(0.0, 2.0, 201)
        found = wb.simulate(machine, 2.0, times=times)
        output, integral = (
            found[f"control_{one}"].to_numpy()[:, 0] for one in ("output", "integral")
        )
        speed = speeds(found)[:, 0]
        follows = (times > 2.0 / 3.0) & (times < 0.9)  # until K_i e = K_p v' = 60: e = 1
        assert output[follows] == pytest.approx(20.0, abs=0.0)
        assert integral[follows] == pytest.approx(20.0 - GAIN * (10.0 - speed[follows]), abs=1e-12)
        # It leaves the limit where the full rate K_i e no longer exceeds K_p v' = 60: e = 1.
        left = found["event_time"].to_numpy()[0]
        assert left == pytest.approx(0.9, abs=1e-14)

    def test_conditional_integration_at_short_steps_agrees(self) -> None:
        """The sliding motion is the limit of a digital controller with ever shorter samples."""
        exact = speeds(wb.simulate(motor(limits=(-20.0, 20.0), integral=60.0), 2.0, samples=21))
        errors = [
            np.abs(
                speeds(
                    wb.simulate(
                        motor(limits=(-20.0, 20.0), integral=60.0, sample_time=t), 2.0, samples=21
                    )
                )
                - exact
            ).max()
            for t in (4e-3, 1e-3, 2.5e-4)
        ]
        assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.2)
        assert errors[1] / errors[2] == pytest.approx(4.0, rel=0.2)

    @pytest.mark.parametrize("seed", range(36))
    def test_random_machines(self, seed: int) -> None:
        check_random(seed)

    @pytest.mark.slow
    @pytest.mark.parametrize("pack", range(36, 436, 20))
    def test_many_random_machines(self, pack: int) -> None:
        for seed in range(pack, pack + 20):
            check_random(seed)

    @pytest.mark.parametrize("sign", [1.0, -1.0])
    def test_the_mirror_image_of_a_motion_is_one(self, sign: float) -> None:
        low, high = sorted((sign * -7.0, sign * 12.0))
        machine = motor(
            limits=(low, high), setpoint=wb.Harmonic(sign * 6.0, 0.6, 0.4), derivative=0.4,
            filter_time=0.05, speed=sign * 3.0,
        )  # fmt: skip
        found = wb.simulate(machine, 8.0, samples=161)
        other = motor(
            limits=(-7.0, 12.0), setpoint=wb.Harmonic(6.0, 0.6, 0.4), derivative=0.4,
            filter_time=0.05, speed=3.0,
        )  # fmt: skip
        right = wb.simulate(other, 8.0, samples=161)
        assert found.sizes["event"] > 6
        assert np.all(sign * speeds(found) == speeds(right))
        assert np.all(found["event_time"] == right["event_time"])

    @pytest.mark.parametrize("more", [
        {"limits": (-8.0, 12.0)},
        {"limits": (-8.0, 12.0), "derivative": 0.4, "filter_time": 0.05},
        {"limits": (-8.0, 12.0), "integral": 60.0},
        {"limits": (-8.0, 12.0), "sample_time": 0.04, "delay": 2, "derivative": 0.1},
    ])  # fmt: skip
    @pytest.mark.parametrize("at", [0.31, 1.0, 2.2])
    def test_a_restart_continues_the_motion(self, more: dict[str, Any], at: float) -> None:
        machine = motor(setpoint=wb.Harmonic(6.0, 0.6, 0.4), **more)
        whole = wb.simulate(machine, 4.0, times=[4.0])
        state = wb.final_state(wb.simulate(machine, at))
        state = wb.FinalState.from_json(state.to_json())
        rest = wb.simulate(machine, 4.0 - at, initial=state, times=[4.0])
        for name in ("velocity", "angle", "control_integral", "control_output"):
            assert rest[name].to_numpy() == pytest.approx(whole[name].to_numpy(), abs=1e-12)


def check_random(seed: int) -> None:
    """States, outputs and events of a random machine are those of the reference; laws hold."""
    machine = random_machine(seed)
    # Between samples, where outputs jump.
    times = np.append(np.linspace(0.0, 3.0, 61)[1:] - 0.0123, 3.0)
    found, right = (
        wb.simulate(machine, 3.0, times=times),
        control_reference.simulate(machine, times, 0.002),
    )
    n = len(machine.inertias)
    scale = np.abs(right.states[:, : 2 * n]).max()
    if scale > 500.0:  # unstable: the contact reverses, which the reference does not know
        return
    for name, part in (("angle", slice(0, n)), ("velocity", slice(n, 2 * n))):
        assert found[name].to_numpy() == pytest.approx(right.states[:, part], abs=1e-9 * scale)
    for name, values in (("integral", right.integrals), ("output", right.outputs)):
        size = 1.0 + np.abs(values).max()
        assert found[f"control_{name}"].to_numpy() == pytest.approx(values, abs=1e-8 * size)
    assert found["event_part"].to_numpy().tolist() == [one for _, one in right.events]
    expected = [time for time, _ in right.events]
    assert found["event_time"].to_numpy() == pytest.approx(expected, abs=1e-8)
    assert wb.check(found) == []


class TestTies:
    def test_an_output_that_begins_at_its_limit(self) -> None:
        """Error and output 0, which is the lowest output: nothing happens until the setpoint."""
        table = wb.Table(times=[0.0, 1.0, 2.0], values=[0.0, 0.0, 4.0])
        machine = motor(limits=(0.0, 50.0), setpoint=table)
        found = wb.simulate(machine, 2.0, times=[0.5, 1.0, 2.0])
        assert speeds(found)[:2, 0].tolist() == [0.0, 0.0]
        free = wb.simulate(motor(setpoint=table), 2.0, times=[2.0])
        assert speeds(found)[2] == pytest.approx(speeds(free)[0], abs=1e-12)

    @pytest.mark.parametrize("limit", [12.0, 12.0 + 1e-9, 12.0 - 1e-9])
    @pytest.mark.parametrize("integral", [0.0, 5.0, 80.0])
    def test_a_step_of_the_setpoint_onto_the_limit(self, limit: float, integral: float) -> None:
        """K_p times the step is the limit, exactly or nearly; the error then drives it out."""
        step = wb.Table(times=[0.0, 1.0, 1.0, 2.0], values=[0.0, 0.0, 2.0, 2.0])
        machine = motor(limits=(-12.0, limit), setpoint=step, integral=integral)
        found = wb.simulate(machine, 2.0, samples=101)
        assert found.attrs["status"] == "completed"
        assert wb.check(found) == []
        times = np.linspace(0.01, 1.0, 34)
        start = control_reference.simulate(
            motor(limits=(-12.0, 12.0 - 1e-7), setpoint=2.0, integral=integral), times, 0.002
        )
        later = wb.simulate(machine, 2.0, times=1.0 + times)
        assert speeds(later)[:, 0] == pytest.approx(start.states[:, 1], abs=1e-6)

    def test_a_limit_that_is_reached_at_a_sample(self) -> None:
        """K_p e falls to the limit, a round number, at the time of a sample of another loop."""
        machine = wb.Machine(
            inertias=[wb.Inertia("motor", INERTIA), wb.Inertia("other", 1.0)],
            controllers=[
                controller(limits=(-20.0, 24.0), integral=0.0),
                wb.Controller(
                    "clock", {"other.speed": 1.0}, 1.0, "other.torque", proportional=0.5,
                    sample_time=0.125,
                ),
            ],
        )  # fmt: skip
        # 60 at the start; 24 at e = 4, v = 6 = 12 t: t = 0.5.
        found = wb.simulate(machine, 1.0, times=[0.5, 1.0])
        assert found["event_time"].to_numpy() == pytest.approx([0.5], abs=1e-15)
        assert speeds(found)[1, 0] == pytest.approx(10.0 - 4.0 * math.exp(-1.5), abs=1e-14)

    def test_an_integral_alone_at_its_limit(self) -> None:
        """A pure integral controller stays at its limit until the error reverses."""
        machine = motor(proportional=0.0, integral=4.0, limits=(-4.0, 4.0), setpoint=2.0)
        found = wb.simulate(machine, 4.0, samples=41)
        right = control_reference.simulate(machine, found["time"].to_numpy(), 0.01)
        assert speeds(found)[:, 0] == pytest.approx(right.states[:, 1], abs=1e-10)
        assert found.sizes["event"] == len(right.events) >= 2

    def test_an_exact_touch_of_the_limit(self) -> None:
        """u = K_p sin(w t) - 0 touches the limit K_p at the crest: nothing changes."""
        heavy = wb.Machine(
            inertias=[wb.Inertia("motor", 1e9)],
            controllers=[
                controller(limits=(-6.0, 6.0), setpoint=wb.Harmonic(1.0, 0.5), integral=0.0)
            ],
        )
        found = wb.simulate(heavy, 6.0, samples=601)
        output = found["control_output"].to_numpy()[:, 0]
        assert output == pytest.approx(6.0 * np.sin(np.pi * found["time"].to_numpy()), abs=1e-7)


class TestSampled:
    @pytest.mark.parametrize("more", [
        {}, {"delay": 1}, {"delay": 3, "limits": (-15.0, 15.0)}, {"derivative": 0.3},
        {"derivative": 0.3, "filter_time": 0.05, "limits": (-30.0, 18.0), "delay": 2},
        {"resolution": 1.9, "limits": (-15.0, 15.0)}, {"integral": 0.0},
    ])  # fmt: skip
    def test_a_discrete_loop_of_numpy(self, more: dict[str, Any]) -> None:
        """The machine advanced by ``cont2discrete``, the controller by its difference equation."""
        step_time = 0.05
        machine = motor(sample_time=step_time, **more)
        loop = machine.controllers[0]
        damped = np.array([[0.0]]), np.array([[1.0 / INERTIA]])
        a, b, *_ = cont2discrete((*damped, np.eye(1), np.zeros((1, 1))), step_time)
        speed, total, rate, before = 0.0, 0.0, 0.0, None
        queue, low, high = [0.0] * loop.delay, *(loop.limits or (-np.inf, np.inf))
        right = []
        for _ in range(60):
            error = 10.0 - speed
            smooth = loop.filter_time or 0.0
            change = loop.derivative * (error - (error if before is None else before))
            rate, before = (smooth * rate + change) / (smooth + step_time), error
            added = loop.integral * step_time * error
            after = loop.proportional * error + rate + total + added
            if not ((after > high and added > 0.0) or (after < low and added < 0.0)):
                total += added
            output = loop.proportional * error + rate + total
            if loop.resolution:
                output = loop.resolution * round(output / loop.resolution)
            queue.append(min(max(output, low), high))
            held = queue.pop(0)
            speed = float(a[0, 0] * speed + b[0, 0] * held)
            right.append((speed, total, held))
        # Just before the samples, where outputs jump.
        times = step_time * np.arange(1, 61) - 1e-9
        found = wb.simulate(machine, 3.0, times=times)
        assert speeds(found)[:, 0] == pytest.approx([one[0] for one in right], abs=1e-7)
        for column, name in ((1, "integral"), (2, "output")):
            assert found[f"control_{name}"].to_numpy()[:, 0] == pytest.approx(
                [one[column] for one in right], abs=1e-11
            )
        end = wb.simulate(machine, 3.0, times=[3.0])
        assert speeds(end)[0, 0] == pytest.approx(right[-1][0], abs=1e-11)

    def test_the_multipliers_are_those_of_the_exact_discretisation(self) -> None:
        """Zero-order hold of the brake with its lag, and the update of sum and output."""
        step_time, lag, gain, integral = 0.1, 0.05, 4.0, 10.0
        machine = wheel(speed_loop(sample_time=step_time, proportional=gain, integral=integral))
        # (v, F) with the held output u, then the sum: e = v - 50.
        flow = np.array([[0.0, -0.2 / INERTIA, 0.0], [0.0, -1.0 / lag, 1.0 / lag], [0.0, 0.0, 0.0]])
        held = block_diag(expm(flow * step_time), 1.0)
        update = np.eye(4)
        update[3, 0] = integral * step_time
        update[2] = [gain + integral * step_time, 0.0, 0.0, 1.0]
        right = np.linalg.eigvals(held @ update)
        found = wb.stability(machine).multipliers
        assert found is not None
        # One more for the angle, which nothing restrains.
        assert sorted_values(found) == pytest.approx(sorted_values([*right, 1.0]), abs=1e-12)

    def test_delayed_derivative_in_multipliers_is_that_of_runs(self) -> None:
        """The dominant multiplier is the ratio of successive deviations of a run."""
        machine = motor(
            sample_time=0.1, delay=2, derivative=0.4, filter_time=0.05, setpoint=0.0, speed=1.0
        )
        times = 0.1 * np.arange(1, 41)
        decay = speeds(wb.simulate(machine, 4.0, times=times))[:, 0]
        count = 7  # v, output, sum, rate, error, two that are delayed
        rows = np.array([decay[k : k + count + 1] for k in range(40 - count)])
        polynomial = np.linalg.lstsq(rows[:, :count], -rows[:, count])[0]
        roots = np.roots([1.0, *polynomial[::-1]])
        found = np.array(wb.stability(machine).multipliers)
        for one in found[(np.abs(found) > 0.3) & (np.abs(found - 1.0) > 1e-9)]:
            assert np.abs(roots - one).min() < 1e-6

    def test_a_sampled_actuation_takes_the_output(self) -> None:
        """Controller and actuation sample together: as one controller with the lag alone."""
        loop = force_loop(sample_time=0.002)
        first = wb.simulate(wheel(loop), 1.0, samples=101)
        again = wheel(
            loop, actuation=wb.Actuation(initial_force=100.0, lag=0.05, sample_time=0.002)
        )
        assert speeds(wb.simulate(again, 1.0, samples=101)) == pytest.approx(
            speeds(first), rel=1e-12
        )

    def test_two_rates_of_samples(self) -> None:
        machine = wb.Machine(
            inertias=[wb.Inertia("motor", INERTIA)],
            controllers=[
                controller(sample_time=0.01, integral=0.0),
                wb.Controller(
                    "slow", {"motor.angle": 1.0}, 3.0, "motor.torque", proportional=0.7,
                    sample_time=0.03,
                ),
            ],
        )  # fmt: skip
        times = np.linspace(0.0, 2.0, 41)[1:] - 0.0012
        right = control_reference.simulate(machine, times)
        found = wb.simulate(machine, 2.0, times=times)
        assert speeds(found)[:, 0] == pytest.approx(right.states[:, 1], abs=1e-11)


class TestBrakes:
    @pytest.mark.parametrize("sample_time", [None, 0.001])
    def test_a_force_loop_stops_a_wheel(self, sample_time: float | None) -> None:
        loop = force_loop(setpoint=300.0, sample_time=sample_time)
        machine = wheel(
            loop, drive=0.0, speed=90.0, actuation=wb.Actuation(initial_force=0.0, lag=0.02)
        )
        found = wb.simulate(machine, 10.0, samples=501)
        assert wb.check(found) == []
        stop = float(found["stick_start"][0])
        # The force needs 300 N once it has settled; the impulse is exact.
        force = found["actuation_force"].to_numpy()[:, 0]
        assert force[-1] == pytest.approx(300.0, rel=1e-6)
        assert np.all(speeds(found)[found["time"].to_numpy() > stop] == 0.0)
        work = wb.energy(found)
        assert float(work["friction_heat"][0]) == pytest.approx(0.5 * INERTIA * 90.0**2, rel=1e-12)
        assert float(work["control_work"][0]) == 0.0

    def test_a_controller_releases_the_brake(self) -> None:
        """A negative output takes the force to 0, where it is released and not pulled."""
        loop = wb.Controller("loop", {"wheel.speed": 1.0}, 0.0, "brake.command", proportional=10.0)
        found = wb.simulate(wheel(loop, drive=5.0, speed=30.0), 3.0, samples=301)
        force = found["actuation_force"].to_numpy()
        assert force.min() == 0.0
        assert wb.check(found) == []
        # 100 - 10 v < 0 all the time: after the decay of 100 N, the drive alone accelerates.
        assert speeds(found)[-1, 0] - speeds(found)[100, 0] == pytest.approx(5.0, rel=1e-10)

    def test_the_force_of_an_immediate_brake_follows_at_once(self) -> None:
        """F = 100 + 3 (w - 50): as a slope of the actuation about the same line."""
        loop = wb.Controller(
            "loop", {"wheel.speed": -3.0}, -150.0, "brake.command", proportional=1.0
        )
        one = wheel(loop, actuation=wb.Actuation(initial_force=100.0))
        other = wheel(actuation=wb.Actuation(initial_force=100.0 - 150.0 + 200.0, slope=3.0))
        one = wheel(loop, actuation=wb.Actuation(initial_force=300.0))
        found = [speeds(wb.simulate(m, 5.0, samples=51)) for m in (one, other)]
        assert found[0] == pytest.approx(found[1], abs=1e-11)

    def test_friction_over_the_speed_takes_the_method_smooth(self) -> None:
        law = wb.StribeckFriction(kinetic=0.3, static=0.4, speed=2.0)
        loop = force_loop(sample_time=0.005)
        machine = wheel(loop, friction=law, drive=10.0, speed=20.0)
        found = wb.simulate(machine, 6.0, samples=301)
        assert found.attrs["method"] == "smooth"
        assert wb.check(found) == []
        with pytest.raises(wb.InputError, match=r"brake\.friction"):
            wb.simulate(
                wheel(
                    speed_loop(),
                    friction=wb.TabulatedFriction(speeds=[0.0, 1.0], coefficients=[0.4, 0.3]),
                    actuation=wb.Actuation(initial_force=1.0),
                ),
                1.0,
                method="exact",
            )

    def test_a_stop_measured_through_a_damped_gap(self) -> None:
        """The torque of a damped stop jumps, and with it the output beyond its limit."""
        machine = wb.Machine(
            inertias=[wb.Inertia("mass", 1.0, speed=2.0)],
            shafts=[wb.Shaft("mass", "ground", 400.0, 5.0, name="stop", gap=(-0.3, 0.3))],
            controllers=[
                wb.Controller(
                    "loop", {"stop.torque": 1.0}, 0.0, "mass.torque", proportional=0.2,
                    integral=3.0, limits=(-1.5, 1.5),
                )
            ],
        )  # fmt: skip
        found = wb.simulate(machine, 5.0, samples=501)
        assert wb.check(found) == []
        assert abs(float(wb.energy(found)["residual"])) < 1e-12
        output = found["control_output"].to_numpy()
        torque = found["shaft_torque"].to_numpy()
        free = -0.2 * torque + found["control_integral"].to_numpy()
        # Where the torque of the damper jumps, it has the value before or after.
        apart = np.abs(found["time"].to_numpy()[:, None] - found["event_time"].to_numpy()).min(
            axis=1
        )
        kept = apart > 1e-9
        assert output[kept] == pytest.approx(np.clip(free, -1.5, 1.5)[kept], abs=1e-11)


class TestStability:
    def test_speed_control_through_a_lag(self) -> None:
        """J T s^3 + J s^2 + c K_p s + c K_i = 0, with c = 0.2 m of the brake."""
        for gain, integral in ((4.0, 10.0), (4.0, 120.0), (0.3, 7.0)):
            machine = wheel(speed_loop(proportional=gain, integral=integral))
            right = np.roots([INERTIA * 0.05, INERTIA, 0.2 * gain, 0.2 * integral])
            found = wb.stability(machine).eigenvalues
            assert sorted_values(found) == pytest.approx(sorted_values([*right, 0.0]), abs=1e-10)

    def test_the_hopf_point_over_the_integral_gain(self) -> None:
        """K_i = K_p/T, w^2 = c K_p/(J T)."""
        limit = wb.hopf(wheel(speed_loop()), "loop.integral", between=(20.0, 200.0))
        assert limit.value == pytest.approx(4.0 / 0.05, rel=1e-10)
        assert limit.frequency == pytest.approx(
            math.sqrt(0.2 * 4.0 / (INERTIA * 0.05)) / (2.0 * math.pi), rel=1e-9
        )

    def test_the_motion_on_both_sides_of_the_hopf_point(self) -> None:
        below = wb.motion(wheel(speed_loop(integral=60.0)))
        above = wb.motion(wheel(speed_loop(integral=90.0)))
        assert "steady sliding" in str(below)
        assert "limit cycle" in str(above)
        growth = max(one.real for one in np.roots([INERTIA * 0.05, INERTIA, 0.8, 12.0]))
        assert max(below.exponents) == pytest.approx(growth, rel=1e-6)

    def test_angles_that_controllers_hold(self) -> None:
        """PID control of an angle: J T s^4 + J s^3 + (K_d + T K_p) s^2 + ... has no rigid mode."""
        gain, integral, derivative, smooth = 8.0, 3.0, 2.0, 0.1
        machine = motor(
            measured={"motor.angle": 1.0}, setpoint=0.0, proportional=gain, integral=integral,
            derivative=derivative, filter_time=smooth,
        )  # fmt: skip
        right = np.roots([
            INERTIA * smooth, INERTIA, derivative + smooth * gain, gain + smooth * integral,
            integral,
        ])  # fmt: skip
        found = wb.stability(machine)
        assert sorted_values(found.eigenvalues) == pytest.approx(sorted_values(right), abs=1e-10)
        assert not any(one.rigid for one in found.modes)

    def test_a_relative_speed_leaves_the_common_rotation_free(self) -> None:
        """An anti-jerk controller: the eigenvalues of two inertias, and two rigid zeros."""
        engine, wheels, stiffness, damping, gain = 0.3, 4.0, 400.0, 0.3, 8.0
        machine = wb.Machine(
            inertias=[wb.Inertia("engine", engine), wb.Inertia("wheels", wheels)],
            shafts=[wb.Shaft("engine", "wheels", stiffness, damping)],
            controllers=[
                controller(
                    measured={"engine.speed": 1.0, "wheels.speed": -1.0}, setpoint=0.0,
                    output="engine.torque", proportional=gain, integral=0.0,
                )
            ],
        )  # fmt: skip
        each = 1.0 / engine + 1.0 / wheels
        right = np.roots([1.0, damping * each + gain / engine, stiffness * each])
        found = wb.stability(machine)
        assert sorted_values(found.eigenvalues) == pytest.approx(
            sorted_values([*right, 0.0, 0.0]), abs=1e-10
        )
        assert [one.rigid for one in found.modes] == [False, True, True]
        assert found.stable

    @pytest.mark.parametrize("ratio", [0.3, 3.7, 11.1])
    def test_an_angle_that_a_joint_keeps_at_zero_is_not_measured(self, ratio: float) -> None:
        machine = wb.Machine(
            inertias=[wb.Inertia("a", 1.3), wb.Inertia("b", 0.7, speed=2.0)],
            joints=[wb.Gear("a", "b", ratio)],
            torques=[wb.Torque("b", wb.Harmonic(3.0, 2.0), name="drive")],
            controllers=[
                controller(
                    measured={"a.angle": 1.0, "b.angle": -ratio}, setpoint=0.0,
                    output="a.torque", proportional=5.0, integral=0.0,
                )
            ],
        )  # fmt: skip
        found = wb.stability(machine)
        assert found.eigenvalues == (0.0, 0.0)
        assert all(one.rigid for one in found.modes)
        without = wb.motion(machine.replace(controllers=[]))
        assert wb.motion(machine).kind == without.kind

    def test_a_force_loop_has_its_own_modes(self) -> None:
        machine = wheel(force_loop(limits=None))
        right = np.roots([0.05, 1.0 + 0.5, 20.0])
        found = wb.stability(machine)
        assert sorted_values(found.eigenvalues) == pytest.approx(
            sorted_values([*right, 0.0, 0.0]), abs=1e-10
        )
        assert found.critical is not None
        assert found.critical.forces == {"brake": pytest.approx(300.0)}

    def test_a_proportional_output_beyond_its_limit_does_not_act(self) -> None:
        held = wheel(speed_loop(proportional=4.0, integral=0.0, limits=(-1.0, 1.0)))
        right = wheel()
        assert wb.stability(held).growth_rate == pytest.approx(wb.stability(right).growth_rate)

    def test_orbits_have_the_multipliers_of_the_loop(self) -> None:
        machine = motor(setpoint=wb.Harmonic(5.0, 0.7))
        found = wb.orbit(machine).multipliers
        right = np.exp(np.roots([INERTIA, GAIN, INTEGRAL]) / 0.7)
        assert sorted_values(found) == pytest.approx(sorted_values(right), abs=1e-10)

    def test_orbits_with_limits_have_the_multipliers_of_runs(self) -> None:
        """The derivative of the return map by differences of runs from states beside the orbit."""
        machine = motor(setpoint=wb.Harmonic(5.0, 0.7), limits=(-20.0, 20.0))
        orbit = wb.orbit(machine)
        state = orbit.initial
        columns = []
        for change in np.eye(2) * 1e-6:
            ends = []
            for sign in (1.0, -1.0):
                start = wb.FinalState(
                    state.time, state.angles,
                    {"motor": state.speeds["motor"] + sign * change[0]},
                    (state.actuators[0] + sign * change[1],), modes=state.modes,
                    samplings=state.samplings,
                )  # fmt: skip
                end = wb.final_state(wb.simulate(machine, 1.0 / 0.7, initial=start))
                ends.append([end.speeds["motor"], end.actuators[0]])
            columns.append((np.array(ends[0]) - ends[1]) / 2e-6)
        right = np.linalg.eigvals(np.array(columns).T)
        assert sorted_values(orbit.multipliers) == pytest.approx(sorted_values(right), abs=1e-7)

    def test_branches_pass_where_a_limit_is_first_reached(self) -> None:
        machine = motor(setpoint=wb.Harmonic(5.0, 0.7), limits=(-20.0, 20.0))
        branch = list(wb.continuation(wb.orbit(machine), {"loop.setpoint.amplitude": (5.0, 0.5)}))
        last = branch[-1]
        right = np.exp(np.roots([INERTIA, GAIN, INTEGRAL]) / 0.7)
        assert sorted_values(last.multipliers) == pytest.approx(sorted_values(right), abs=1e-7)


DERIVATIVES = {
    "limits": motor(limits=(-20.0, 20.0), setpoint=wb.Harmonic(5.0, 0.7)),
    "follows": motor(limits=(-20.0, 20.0), integral=60.0, setpoint=wb.Harmonic(5.0, 0.7)),
    "derivative": motor(
        limits=(-20.0, 20.0), setpoint=wb.Harmonic(5.0, 0.7), derivative=0.5, filter_time=0.05
    ),
    "digital": motor(
        limits=(-20.0, 20.0), setpoint=wb.Harmonic(5.0, 0.7), derivative=0.5, filter_time=0.05,
        sample_time=0.01, delay=2,
    ),
    "force": wheel(force_loop(), drive=5.0),
    "sampled twice": wheel(
        force_loop(sample_time=0.002), drive=5.0,
        actuation=wb.Actuation(initial_force=100.0, lag=0.05, sample_time=0.004, delay=1),
    ),
    "sampled actuation": wheel(
        speed_loop(setpoint=wb.Harmonic(-50.0, 0.3), limits=(-50.0, 400.0)),
        actuation=wb.Actuation(initial_force=100.0, sample_time=0.004),
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", DERIVATIVES)
def test_derivatives(name: str) -> None:
    wb.testing.check_derivatives(DERIVATIVES[name])


@pytest.mark.parametrize("side", [1, -1])
def test_derivatives_at_a_sample_are_one_sided(side: int) -> None:
    """After k samples, v = v_0 (1 - h a)^k (1 - a (t - k h))."""
    h, a, start = 0.1, 1.0, 10.0
    loop = controller(setpoint=0.0, proportional=INERTIA * a, integral=0.0, sample_time=h)
    machine = wb.Machine(inertias=[wb.Inertia("motor", INERTIA, speed=start)], controllers=[loop])
    times = [0.15, 0.2, 0.3]
    found = wb.sensitivity(machine, ["loop.sample_time"], 0.3, times=times, side=side)

    def derivative(time: float, k: int) -> float:
        left, since = 1.0 - h * a, time - k * h
        slope = -a * k * left ** (k - 1) * (1.0 - a * since) + left**k * a * k
        return start * slope

    taken = [1, 1, 2] if side > 0 else [1, 2, 3]
    expected = [derivative(*one) for one in zip(times, taken, strict=True)]
    assert found["velocity"].to_numpy().ravel() == pytest.approx(expected, abs=1e-11)
    assert found["one_sided"].item() == side


@pytest.mark.parametrize("time", [0.25, 1.0])
def test_derivative_with_respect_to_an_integral_gain_of_zero(time: float) -> None:
    """J v' = K_p (r - v) + K_i (integral of r - v): of first order in K_i, with a = K_p/J."""
    found = wb.sensitivity(motor(integral=0.0), ["loop.integral"], 1.0, times=[time])
    a = GAIN / INERTIA
    of_rest = -math.expm1(-a * time) / a - time * math.exp(-a * time)
    expected = 10.0 / GAIN * of_rest
    assert found["velocity"].item() == pytest.approx(expected, rel=1e-12)


def test_times_of_limits_have_derivatives() -> None:
    """t = J (r - u/K_p)/u where K_p (r - u t/J) = u, with the limit u = 20: see above."""
    found = wb.sensitivity(
        motor(limits=(-20.0, 20.0)), ["loop.limits.1", "loop.proportional", "loop.setpoint"], 1.0,
        times=[1.0],
    )  # fmt: skip
    right = [-INERTIA * 10.0 / 20.0**2, INERTIA / GAIN**2, INERTIA / 20.0]
    assert found["event_time"].to_numpy()[:, 0] == pytest.approx(right, rel=1e-10)


class TestStudies:
    TEXT = """
[[inertia]]
name = "motor"
inertia = 2.0

[[controller]]
name = "loop"
measured = { "motor.speed" = 1.0 }
setpoint = { kind = "harmonic", amplitude = 5.0, frequency = 0.7 }
output = "motor.torque"
proportional = 6.0
integral = 5.0
limits = [-20.0, 20.0]
"""

    def test_a_study_says_the_same(self) -> None:
        study = wb.read_study(self.TEXT)
        right = motor(setpoint=wb.Harmonic(5.0, 0.7), limits=(-20.0, 20.0))
        assert study.system == right
        assert wb.read_study(wb.Study(right).to_toml()).system == right

    def test_measured_quantities_in_tables_of_their_own(self) -> None:
        text = self.TEXT.replace(
            'measured = { "motor.speed" = 1.0 }', "measured.motor = { speed = 1.0, angle = 0.5 }"
        )
        (loop,) = wb.read_study(text).system.controllers
        assert loop.measured == {"motor.speed": 1.0, "motor.angle": 0.5}

    def test_replace_and_sweep(self) -> None:
        machine = motor(limits=(-20.0, 20.0))
        changed = machine.replace({
            "loop.proportional": 3.0, "loop.limits.1": 9.0, "loop.measured.motor.speed": 2.0,
            "loop.setpoint": wb.Harmonic(1.0, 2.0),
        })  # fmt: skip
        loop = changed.controllers[0]
        assert (loop.proportional, loop.limits) == (3.0, (-20.0, 9.0))
        assert loop.measured == {"motor.speed": 2.0}
        assert changed.signals() == {"loop.setpoint": wb.Harmonic(1.0, 2.0)}
        assert (machine.autonomous, changed.autonomous) == (True, False)
        found = wb.sweep(changed, {"loop.integral": [0.0, 5.0]})
        assert found["loop.integral"].to_numpy().tolist() == [0.0, 5.0]

    def test_a_contact_taken_out_of_a_loop_is_the_former_one(self) -> None:
        machine = wheel(speed_loop())
        assert machine.replace(controllers=[]) == wheel()
        assert wheel().replace(controllers=machine.controllers) == machine
        again = wb.Machine(inertias=machine.inertias, contacts=machine.contacts)
        assert again.contacts == wheel().contacts

    def test_each_point_of_a_sweep_has_its_own_gain(self) -> None:
        machine = motor(setpoint=wb.Harmonic(5.0, 0.7))
        found = wb.sweep(machine, {"loop.proportional": [2.0, 6.0]})["rms_velocity"].to_numpy()
        # w' = (K_p e + K_i int e)/J at one frequency.
        omega = 1.4 * math.pi
        loops = [2.0 + INTEGRAL / (1j * omega), 6.0 + INTEGRAL / (1j * omega)]
        right = [5.0 / math.sqrt(2.0) * abs(k / (1j * omega * INERTIA + k)) for k in loops]
        assert found.ravel() == pytest.approx(right, rel=1e-8)

    def test_a_controlled_brake_is_no_driveline_of_closed_forms(self) -> None:
        machine = wheel(speed_loop(), actuation=wb.Actuation(initial_force=100.0), drive=1.0)
        machine = machine.replace(torques=[wb.Torque("wheel", wb.Harmonic(1.0, 2.0))])
        assert machine.one_inertia is None
        assert machine.replace(controllers=[]).one_inertia is not None


BAD: dict[str, tuple[dict[str, Any], str]] = {
    "no quantity": ({"measured": {}}, r"loop\.measured"),
    "not a mapping": ({"measured": "motor.speed"}, r"loop\.measured"),
    "unknown quantity": ({"measured": {"motor.power": 1.0}}, r"loop\.measured"),
    "no such inertia": ({"measured": {"wheel.speed": 1.0}}, r"loop\.measured.*motor\.speed"),
    "no such shaft": ({"measured": {"motor.torque": 1.0}}, r"loop\.measured"),
    "a word as factor": ({"measured": {"motor.speed": "1"}}, r"loop\.measured\.motor\.speed"),
    "infinite factor": ({"measured": {"motor.speed": math.inf}}, r"loop\.measured"),
    "output": ({"output": "motor"}, r"loop\.output"),
    "output of nothing": ({"output": "motor.speed"}, r"loop\.output"),
    "output on an unknown inertia": ({"output": "wheel.torque"}, r"loop\.output.*motor\.torque"),
    "output on an unknown contact": ({"output": "brake.command"}, r"loop\.output"),
    "output a number": ({"output": 3.0}, r"loop\.output"),
    "setpoint": ({"setpoint": "fast"}, r"loop\.setpoint"),
    "nan": ({"setpoint": math.nan}, r"loop\.setpoint"),
    "gain": ({"proportional": "2"}, r"loop\.proportional"),
    "huge gain": ({"integral": 1e16}, r"loop\.integral"),
    "derivative without filter": ({"derivative": 1.0}, r"loop\.filter_time"),
    "negative filter": ({"filter_time": -1.0}, r"loop\.filter_time"),
    "equal limits": ({"limits": (1.0, 1.0)}, r"loop\.limits"),
    "limits in the wrong order": ({"limits": (2.0, 1.0)}, r"loop\.limits"),
    "one limit": ({"limits": 3.0}, r"loop\.limits"),
    "sample time": ({"sample_time": 0.0}, r"loop\.sample_time"),
    "delay without sample time": ({"delay": 1}, r"loop\.delay"),
    "long delay": ({"delay": 101, "sample_time": 0.1}, r"loop\.delay"),
    "resolution without sample time": ({"resolution": 1.0}, r"loop\.resolution"),
    "unknown field": ({"gain": 1.0}, r"loop\.gain"),
}


class TestRefused:
    @pytest.mark.parametrize("name", BAD)
    def test_wrong_values(self, name: str) -> None:
        changes, message = BAD[name]
        with pytest.raises(wb.InputError, match=message):
            motor(**changes)

    def test_forces_without_a_lag_are_not_measured(self) -> None:
        with pytest.raises(wb.InputError, match=r"force\.measured\.brake\.force.*brake\.lag"):
            wheel(force_loop(), actuation=wb.Actuation(initial_force=1.0))

    def test_unknown_contact_measured(self) -> None:
        with pytest.raises(wb.InputError, match=r"force\.measured"):
            wheel(force_loop(measured={"pad.force": 1.0}))

    def test_driven_bodies_and_clutches_take_no_output(self) -> None:
        with pytest.raises(wb.InputError, match=r"loop\.output"):
            wb.Machine(
                inertias=[wb.Inertia("motor", 1.0), wb.Driven("belt", 2.0)],
                controllers=[controller(output="belt.torque")],
            )
        with pytest.raises(wb.InputError, match=r"loop\.output"):
            wb.Machine(
                inertias=[wb.Inertia("motor", 1.0)],
                contacts=[wb.OneWayClutch("motor", "ground", name="stop")],
                controllers=[controller(output="stop.command")],
            )

    def test_a_force_without_release_takes_no_output(self) -> None:
        with pytest.raises(wb.InputError, match=r"brake\.release"):
            wheel(speed_loop(), actuation=wb.Actuation(initial_force=1.0, release=False))

    def test_names_are_unique(self) -> None:
        loop = wb.Controller("motor", {"motor.speed": 1.0}, 0.0, "motor.torque", proportional=1.0)
        with pytest.raises(wb.InputError) as caught:
            wb.Machine(inertias=[wb.Inertia("motor", 1.0)], controllers=[loop])
        assert caught.value.name == "controllers[0].name"

    def test_orbits_take_no_samples(self) -> None:
        machine = motor(setpoint=wb.Harmonic(5.0, 0.7), sample_time=0.01)
        with pytest.raises(wb.InputError, match=r"loop\.sample_time"):
            wb.orbit(machine)

    def test_friction_over_the_speed_with_an_unknown_force(self) -> None:
        law = wb.StribeckFriction(kinetic=0.3, static=0.4, speed=2.0)
        with pytest.raises(wb.InputError, match=r"brake\.friction"):
            wb.stability(wheel(speed_loop(), friction=law))
        assert wb.stability(wheel(speed_loop(integral=0.0), friction=law)).cases

    def test_samples_at_different_times(self) -> None:
        machine = motor(sample_time=0.01)
        machine = machine.replace(controllers=[
            *machine.controllers,
            wb.Controller(
                "other", {"motor.angle": 1.0}, 0.0, "motor.torque", proportional=1.0,
                sample_time=0.02,
            ),
        ])  # fmt: skip
        with pytest.raises(wb.InputError, match=r"loop\.sample_time"):
            wb.stability(machine)

    def test_derivatives_with_respect_to_a_delay(self) -> None:
        with pytest.raises(wb.InputError, match="delay"):
            wb.sensitivity(motor(sample_time=0.01), ["loop.delay"], 1.0)

    def test_derivatives_where_samples_change_their_order(self) -> None:
        loops = [
            wb.Controller(
                name, {"motor.speed": 1.0}, 0.0, "motor.torque", proportional=1.0, sample_time=step,
            )
            for name, step in (("one", 0.02), ("other", 0.03))
        ]  # fmt: skip
        machine = motor().replace(controllers=loops)
        with pytest.raises(wb.InputError, match=r"At 0\.06 s, one and other coincide"):
            wb.sensitivity(machine, ["one.sample_time"], 1.0)

    def test_a_state_of_another_machine(self) -> None:
        state = wb.final_state(wb.simulate(motor(), 1.0))
        with pytest.raises(wb.InputError, match="initial"):
            wb.simulate(motor(integral=0.0), 1.0, initial=state)


def test_a_runaway_is_undecided() -> None:
    """A motor accelerates for ever; the samples of the controller do not make the run endless."""
    machine = wb.Machine(
        inertias=[wb.Inertia("motor", 1.0)],
        contacts=[
            wb.Contact(
                "motor", name="brake", brake=wb.ConventionalBrake(radius=0.1),
                friction=wb.CoulombFriction(kinetic=0.3),
                actuation=wb.Actuation(initial_force=0.0, lag=0.02),
            )
        ],
        torques=[wb.Torque("motor", 40.0)],
        controllers=[
            wb.Controller(
                "force", {"brake.force": 1.0}, 100.0, "brake.command", proportional=0.5,
                limits=(0.0, 500.0), sample_time=0.001,
            )
        ],
    )  # fmt: skip
    assert wb.motion(machine).kind == "undecided"


@pytest.mark.parametrize("sample_time", [None, 1e-4, 1e-3, 1e-2])
def test_speed_under_a_held_force_is_neutral_for_every_slope(sample_time):
    """The integral part holds the steady force: no torque restrains the speed, at any slope."""
    machine = wb.Machine(
        inertias=[wb.Inertia("wheel", 4.0, speed=20.0)],
        contacts=[
            wb.Contact(
                "wheel", name="brake", brake=wb.BandBrake(radius=0.1, wrap_angle=4.0),
                friction=wb.CoulombFriction(kinetic=0.25),
                actuation=wb.Actuation(initial_force=0.0, slope=-0.5, lag=0.02),
            )
        ],
        controllers=[
            wb.Controller(
                "loop", {"brake.force": 1.0}, 300.0, "brake.command", 0.5, 20.0,
                sample_time=sample_time,
            )
        ],
    )  # fmt: skip
    for slope in np.linspace(2.0, 200.0, 100):
        case = wb.stability(machine.replace({"brake.slope": slope})).critical
        assert case.state == "does not decay", slope
        assert abs(case.growth_rate) < 1e-8
