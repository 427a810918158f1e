"""Driven bodies: their speed is given, exactly, and moves what joins them."""

import numpy as np
import pytest

import wedgebrake as wb

BRAKE = wb.ConventionalBrake(radius=0.2)
BELT = wb.Harmonic(0.4, 0.7)


def contact(b="ground", a="block", force=300.0, name="brake", **more):
    return wb.Contact(
        a, b, name=name, brake=BRAKE, friction=wb.CoulombFriction(kinetic=0.3, static=0.4),
        actuation=wb.Actuation(initial_force=force), **more,
    )  # fmt: skip


def pulled(signal, angle=0.0, stiffness=400.0, **more):
    """A block that a driven spring end pulls over the ground."""
    return wb.Machine(
        inertias=[wb.Inertia("block", 1.0), wb.Driven("end", signal, angle)],
        shafts=[wb.Shaft("block", "end", stiffness, 0.5, name="spring")],
        contacts=[contact(force=20.0)], **more,
    )  # fmt: skip


def on_belt(speed, driven):
    """Two blocks on one belt, a driven body or the bases of the contacts."""
    end = {"b": "belt"} if driven else {"base_speed": speed}
    bodies = [wb.Inertia("block", 1.0, 0.0, 0.3), wb.Inertia("other", 2.0, 0.0, 0.3)]
    return wb.Machine(
        inertias=[*bodies, wb.Driven("belt", speed)] if driven else bodies,
        shafts=[wb.Shaft("block", "ground", 300.0), wb.Shaft("block", "other", 200.0, 0.2)],
        contacts=[
            contact(**end, force=15.0), contact(**end, a="other", force=25.0, name="second"),
        ],
    )  # fmt: skip


def angle_of(response, name="block"):
    return response["angle"].sel(inertia=name).to_numpy()


class TestSpringEnd:
    @pytest.mark.parametrize("phase", [0.0, 1.0])
    def test_equals_the_torque_of_the_moved_end(self, phase):
        # speed A sin(w t + p): the end is at (A/w)(cos p - cos(wt + p)).
        omega, k, c = 2.0 * np.pi * 0.7, 400.0, 0.5
        signal = wb.Harmonic(0.4, 0.7, phase)
        moved = pulled(signal)
        reach = 0.4 / omega
        torques = [
            wb.Torque("block", k * reach * float(np.cos(phase)), name="offset"),
            wb.Torque("block", wb.Harmonic(k * reach, 0.7, phase - np.pi / 2), name="swing"),
            wb.Torque("block", wb.Harmonic(c * 0.4, 0.7, phase), name="damper"),
        ]
        fixed = wb.Machine(
            inertias=[wb.Inertia("block", 1.0)], contacts=moved.contacts, torques=torques,
            shafts=[wb.Shaft("block", "ground", k, c, name="spring")],
        )  # fmt: skip
        times = np.linspace(0.0, 4.0, 801)
        one, other = (wb.simulate(m, 4.0, times=times) for m in (moved, fixed))
        assert one.sizes["event"] == other.sizes["event"] > 5
        np.testing.assert_allclose(one["event_time"], other["event_time"], atol=1e-11)
        np.testing.assert_allclose(angle_of(one), angle_of(other), atol=1e-11)
        end = reach * (np.cos(phase) - np.cos(omega * times + phase))
        np.testing.assert_allclose(angle_of(one, "end"), end, atol=1e-13)

    def test_equals_a_moving_frame(self):
        speed = 0.3
        moved = pulled(speed)
        frame = wb.Machine(
            inertias=[wb.Inertia("block", 1.0, 0.0, -speed)],
            shafts=[wb.Shaft("block", "ground", 400.0, 0.5)],
            contacts=[contact(force=20.0, base_speed=-speed)],
        )
        times = np.linspace(0.0, 5.0, 501)
        one, other = (wb.simulate(m, 5.0, times=times) for m in (moved, frame))
        np.testing.assert_allclose(one["event_time"], other["event_time"], atol=1e-11)
        np.testing.assert_allclose(angle_of(one), angle_of(other) + speed * times, atol=1e-11)
        assert np.all(one["velocity"].sel(inertia="end") == speed)

    def test_speed_that_jumps(self):
        # The end is at the integral of the speed, a chain of lines.
        speed = wb.Table([0.0, 1.0, 1.0, 1.5, 1.5, 3.0], [1.0, 1.0, -2.0, -2.0, 0.5, 0.5])
        moved = pulled(speed).replace({"spring.damping": 0.0})
        load = wb.Table([0.0, 1.0, 1.5, 3.0], [0.0, 400.0, 0.0, 300.0])
        fixed = wb.Machine(
            inertias=[wb.Inertia("block", 1.0)],
            contacts=moved.contacts,
            shafts=[wb.Shaft("block", "ground", 400.0)],
            torques=[wb.Torque("block", load)],
        )
        times = np.linspace(0.0, 3.0, 301)
        one, other = (wb.simulate(m, 3.0, times=times) for m in (moved, fixed))
        np.testing.assert_allclose(angle_of(one), angle_of(other), atol=1e-11)
        damped = wb.simulate(pulled(speed), 3.0)
        assert float(abs(wb.energy(damped)["residual"])) < 1e-11

    def test_torque_and_power(self):
        response = wb.simulate(pulled(BELT), 3.0)
        spring = response["shaft_torque"].sel(shaft="spring")
        torque = response["driven_torque"].sel(driven="end")
        np.testing.assert_array_equal(torque, -spring)
        power = torque * response["velocity"].sel(inertia="end")
        np.testing.assert_array_equal(response["driven_power"].sel(driven="end"), power)
        work = float(wb.energy(response)["drive_work"].sel(driven="end"))
        assert work == pytest.approx(float(power.integrate("time")), rel=1e-4)

    @pytest.mark.parametrize("ratio", [1.0, -2.5])
    def test_energy_with_a_gap_and_a_torque_over_speed(self, ratio):
        machine = wb.Machine(
            inertias=[wb.Inertia("block", 1.0), wb.Driven("end", BELT)],
            shafts=[
                wb.Shaft("block", "end", 400.0, 0.5, ratio=ratio, gap=(-0.1, 0.05), name="stop"),
                wb.Shaft("block", "ground", 50.0),
            ],
            torques=[
                wb.Torque("block", wb.OverSpeed([-1.0, 1.0], [3.0, -3.0]), relative_to="end"),
            ],
        )  # fmt: skip
        response = wb.simulate(machine, 10.0)
        assert np.sum(response["shaft_torque"].sel(shaft="stop") == 0.0) > 10
        found = wb.energy(response)
        assert abs(float(found["drive_work"].sum())) > 0.1
        assert abs(float(found["residual"])) < 1e-11


class TestBelt:
    @pytest.mark.parametrize("speed", [0.3, BELT, wb.Ramp(0.3, -0.3, 2.0)], ids=repr)
    def test_equals_moving_bases(self, speed):
        one, other = (wb.simulate(on_belt(speed, driven), 4.0) for driven in (True, False))
        assert one.sizes["event"] >= 4
        for name in ("event_time", "event_contact", "brake_torque", "sticking"):
            np.testing.assert_array_equal(one[name], other[name])
        for name in ("block", "other"):
            np.testing.assert_array_equal(angle_of(one, name), angle_of(other, name))
        sticks = one["sticking"].sel(contact="brake") == 1
        belt = one["velocity"].sel(inertia="belt")
        assert sticks.any()
        apart = (one["velocity"].sel(inertia="block") - belt).where(sticks, 0.0)
        assert float(np.abs(apart).max()) <= 1e-14
        balance = wb.energy(one)
        assert abs(float(balance["residual"])) < 1e-10

    def test_torque_of_the_belt(self):
        response = wb.simulate(on_belt(BELT, True), 2.0)
        given = -response["brake_torque"].sum("contact")
        np.testing.assert_allclose(response["driven_torque"].sel(driven="belt"), given, atol=1e-12)

    def test_sticks_that_close_a_loop_with_a_clutch(self):
        # All bodies turn with the belt from the start; nothing is to be held.
        machine = on_belt(1.0, True)
        clutch = contact(a="block", b="other", name="clutch")
        machine = machine.replace(contacts=[*machine.contacts, clutch], shafts=[])
        machine = machine.replace({"block.speed": 1.0, "other.speed": 1.0})
        response = wb.simulate(machine, 3.0)
        assert response.sizes["event"] == 0
        assert bool((response["sticking"] == 1).all())
        assert bool((response["velocity"] == 1.0).all())

    def test_holds_up_to_its_limit_with_round_numbers(self):
        # Shaft to the ground: torque 10 t at a speed of 1; the contact holds 20 N m until t = 2.
        brake = wb.Contact(
            "block", "belt", name="brake", brake=wb.ConventionalBrake(radius=0.1),
            friction=wb.CoulombFriction(kinetic=0.5), actuation=wb.Actuation(initial_force=400.0),
        )  # fmt: skip
        machine = wb.Machine(
            inertias=[wb.Inertia("block", 1.0, 0.0, 1.0), wb.Driven("belt", 1.0)],
            shafts=[wb.Shaft("block", "ground", 10.0)], contacts=[brake],
        )  # fmt: skip
        response = wb.simulate(machine, 3.0)
        torque = 0.1 * 400.0 * wb.ConventionalBrake(radius=0.1).amplification(0.5)
        assert response["event_time"][0] == pytest.approx(torque / 10.0, abs=1e-13)


class TestAnalyses:
    @pytest.mark.parametrize(
        "name", ["end.speed.amplitude", "end.speed.frequency", "end.angle", "spring.stiffness"]
    )
    def test_sensitivity(self, name):
        machine = pulled(BELT, angle=0.01)
        times = np.array([0.3, 1.1, 2.0])
        found = wb.sensitivity(machine, [name], 2.0, times=times)
        step = 1e-6 * max(1.0, abs(machine.value(name)))
        low, high = (
            wb.simulate(machine.replace({name: machine.value(name) + way * step}), 2.0, times=times)
            for way in (-1, 1)
        )
        for variable in ("angle", "velocity", "shaft_torque"):
            expected = (high[variable] - low[variable]) / (2.0 * step)
            scale = float(abs(expected).max())
            np.testing.assert_allclose(
                found[variable][0], expected, atol=2e-6 * scale, rtol=1e-5, err_msg=variable
            )

    def test_sensitivity_of_a_constant_speed_and_of_a_jump(self):
        times = np.array([0.5, 1.7, 2.8])
        constant = pulled(0.7)
        jump = pulled(wb.Table([0.0, 1.0, 1.0, 3.0], [1.0, 1.0, -2.0, -1.0]))
        for machine, name in ((constant, "end.speed"), (jump, "end.speed.values.2")):
            if name not in machine.names():
                continue
            found = wb.sensitivity(machine, [name], 3.0, times=times)
            value = machine.value(name)
            low, high = (
                wb.simulate(machine.replace({name: value + way * 1e-6}), 3.0, times=times)
                for way in (-1, 1)
            )
            expected = (high["angle"] - low["angle"]) / 2e-6
            np.testing.assert_allclose(found["angle"][0], expected, atol=1e-6, rtol=1e-5)

    def test_restart(self):
        machine = pulled(BELT)
        whole = wb.simulate(machine, 4.0, times=[1.5, 3.0, 4.0])
        first = wb.simulate(machine, 1.3)
        state = wb.FinalState.from_json(wb.final_state(first).to_json())
        rest = wb.simulate(machine, 2.7, initial=state, times=[1.5, 3.0, 4.0])
        np.testing.assert_allclose(rest["angle"], whole["angle"], atol=1e-12)

    def test_motion_is_that_of_the_frame(self):
        moved = pulled(0.01)
        frame = wb.Machine(
            inertias=[wb.Inertia("block", 1.0, 0.0, -0.01)],
            shafts=[wb.Shaft("block", "ground", 400.0, 0.5)],
            contacts=[contact(force=20.0, base_speed=-0.01)],
        )
        one, other = wb.motion(moved), wb.motion(frame)
        assert one.kind == other.kind
        assert one.period == pytest.approx(other.period, rel=1e-9)

    def test_motion_of_a_shaken_block(self):
        machine = pulled(wb.Harmonic(2.0, 0.7))
        assert wb.motion(machine).order == 1
        values = [0.02, 0.2, 2.0]
        found = wb.sweep(machine, over={"end.speed.amplitude": values})
        for k, value in enumerate(values):
            alone = wb.motion(machine.replace({"end.speed.amplitude": value}))
            assert float(found["peak_torque"][k, 0]) == pytest.approx(alone.peak_torque, rel=1e-9)
            assert float(found["stick_share"][k].max()) == pytest.approx(
                alone.stick_share, abs=1e-9
            )
        assert len(set(found["stick_share"].to_numpy().ravel().tolist())) == 3

    def test_linear_stability_is_that_of_a_fixed_end(self):
        moved = pulled(0.3).replace({"block.speed": 0.3})
        fixed = wb.Machine(
            inertias=[wb.Inertia("block", 1.0, 0.0, 0.3)],
            shafts=[wb.Shaft("block", "ground", 400.0, 0.5)], contacts=[contact(force=20.0)],
        )  # fmt: skip
        one, other = wb.stability(moved), wb.stability(fixed)
        np.testing.assert_allclose(one.critical.eigenvalues, other.critical.eigenvalues)
        assert one.stable == other.stable


class TestModel:
    def test_study_file(self, tmp_path):
        machine = wb.Machine(
            inertias=[wb.Driven("belt", BELT, 0.1), wb.Inertia("block", 1.0), wb.Driven("end", 2)],
            shafts=[wb.Shaft("block", "end", 1e3)], contacts=[contact("belt")],
        )  # fmt: skip
        path = tmp_path / "study.toml"
        wb.save_study(wb.Study(machine), path)
        assert wb.load_study(path).system == machine
        assert "[[driven]]" in path.read_text()
        assert [one.name for one in machine.inertias] == ["block", "belt", "end"]

    def test_replace(self):
        machine = pulled(BELT)
        assert machine.replace({"end.speed": 3.0}).value("end.speed") == 3.0
        assert machine.replace({"end.speed.amplitude": 3.0}).inertias[1].speed.amplitude == 3.0
        assert "end.angle" in machine.initial_conditions

    @pytest.mark.parametrize(
        ("given", "name"),
        [
            ({"inertias": [wb.Driven("end", 1.0)], "shafts": [], "contacts": []}, "inertias"),
            ({"contacts": [contact("block", a="end")]}, "brake.a"),
            ({"torques": [wb.Torque("end", 1.0)]}, "end-torque.on"),
        ],
    )
    def test_refused(self, given, name):
        with pytest.raises(wb.InputError) as error:
            pulled(1.0).replace(**given)
        assert error.value.name == name


def turned(force=200.0, mount=0.0, wedge=True, torques=(), speed=5.0):
    """A disc that a motor turns through a shaft; the wedge locks itself: tan 0.34 < 0.4."""
    brake = wb.WedgeBrake(radius=0.2, angle=0.34) if wedge else BRAKE
    shafts = [wb.Shaft("motor", "disc", 1000.0, 1.0, name="shaft")]
    if mount:
        shafts.append(wb.Shaft("disc", "ground", mount, 1.0, name="mount"))
    return wb.Machine(
        inertias=[wb.Inertia("disc", 1.0), wb.Driven("motor", speed)], shafts=shafts,
        contacts=[
            wb.Contact(
                "disc", name="brake", brake=brake, friction=wb.CoulombFriction(kinetic=0.4),
                actuation=wb.Actuation(initial_force=force),
            )
        ],
        torques=list(torques),
    )  # fmt: skip


PULSE = wb.Torque("disc", wb.Harmonic(10.0, 2.0), name="engine")


class TestWinding:
    """A driven body that winds up a shaft for ever is named."""

    @pytest.mark.parametrize(
        "machine",
        [
            turned(), turned(torques=[PULSE]), turned(mount=1000.0, wedge=False),
            turned(mount=500.0, wedge=False, torques=[PULSE]),
        ],
        ids=["locked", "locked and driven", "between two ends", "the same, driven"],
    )  # fmt: skip
    def test_it_is_named(self, machine):
        found = wb.motion(machine)
        assert found.kind in ("self-locked", "undecided")
        assert found.winding == ("motor",)
        assert "motor winds up" in found.verdict
        assert found.order == 0
        # The torque of the shaft to the motor grows at a constant rate on average.
        times = np.array([20.0, 30.0, 40.0])
        torque = wb.simulate(machine, 40.0, times=times)["shaft_torque"]
        grown = np.diff(np.abs(torque.sel(shaft="shaft") if "shaft" in torque.dims else torque))
        assert grown == pytest.approx(grown[0], rel=1e-3)
        assert grown[0] > 1000.0

    def test_of_a_locked_machine_there_is_no_orbit(self):
        found = wb.orbit(turned())
        assert found.status.value == "no_run"

    @pytest.mark.parametrize(
        "machine",
        [
            turned(wedge=False),
            turned(wedge=False, torques=[PULSE]),
            turned(mount=500.0, wedge=False, speed=wb.Harmonic(0.5, 2.0)),
        ],
        ids=["slides", "slides, driven", "to and fro"],
    )  # fmt: skip
    def test_what_does_not_wind_is_not_named(self, machine):
        found = wb.motion(machine)
        assert found.settled
        assert found.winding == ()

    def test_a_clutch_that_holds_carries_its_disc_along(self):
        machine = wb.Machine(
            inertias=[wb.Inertia("disc", 1.0), wb.Driven("motor", 5.0)],
            contacts=[contact(a="disc", b="motor", name="clutch")],
            torques=[wb.Torque("disc", wb.Harmonic(10.0, 2.0), name="engine")],
        )
        assert wb.motion(machine).winding == ()

    def test_two_ends_that_turn_alike_wind_up_nothing(self):
        def between(other):
            return wb.Machine(
                inertias=[
                    wb.Inertia("disc", 1.0), wb.Driven("left", 2.0), wb.Driven("right", other)
                ],
                shafts=[wb.Shaft("left", "disc", 900.0, 2.0), wb.Shaft("disc", "right", 400.0)],
                torques=[PULSE],
            )  # fmt: skip

        assert wb.motion(between(2.0)).winding == ()
        assert wb.motion(between(2.5)).winding == ("left", "right")


class TestRest:
    """A run until rest ends where contacts stick to bodies that turn at constant speeds."""

    def carried(self, frame, end, **more):
        """A disc with a body on a shaft, and a brake on what turns with a frame."""
        bodies = [
            wb.Inertia("disc", 1.0, speed=9.0 + frame), wb.Inertia("body", 2.0, speed=9.0 + frame),
        ]  # fmt: skip
        if end is not None:
            bodies.append(wb.Driven("end", end))
        brake = contact("end" if end is not None else "ground", force=100.0, a="disc")
        shaft = wb.Shaft("disc", "body", 300.0, 0.5)
        return wb.Machine(inertias=bodies, shafts=[shaft], contacts=[brake], **more)

    @pytest.mark.parametrize("speed", [0.0, 5.0, -20.0])
    def test_a_frame_that_moves(self, speed):
        machines = self.carried(0.0, None), self.carried(speed, speed)
        fixed, moved = (wb.simulate(one, 60.0, until="rest") for one in machines)
        assert fixed.attrs["at_rest"] == moved.attrs["at_rest"] == 1
        assert moved.attrs["final_time"] == pytest.approx(fixed.attrs["final_time"], rel=1e-9)
        later = wb.simulate(machines[1], 60.0)
        after = later["time"] >= moved.attrs["final_time"]
        assert later["sticking"].sel(time=after).all()

    def test_a_speed_that_becomes_constant(self):
        found = wb.simulate(self.carried(0.0, wb.Ramp(0.0, 6.0, 2.0)), 60.0, until="rest")
        assert found.attrs["at_rest"] == 1
        assert 2.0 <= found.attrs["final_time"] < 60.0
        assert found["velocity"][-1].sel(inertia="disc").item() == 6.0

    def test_a_speed_that_swings(self):
        found = wb.simulate(self.carried(0.0, 2.0 + wb.Harmonic(0.1, 1.0)), 9.0, until="rest")
        assert found.attrs["at_rest"] == 0

    @pytest.mark.parametrize(("loss", "rests"), [(1.1, True), (1.3, False)])
    def test_a_damper_that_the_clutch_must_carry(self, loss, rests):
        """At 10 rad/s it takes 10 times its damping; the clutch slips with 12 N m."""
        machine = wb.Machine(
            inertias=[wb.Inertia("disc", 1.0), wb.Driven("end", 10.0)],
            shafts=[wb.Shaft("disc", "ground", 0.0, loss)],
            contacts=[contact("end", a="disc", force=200.0)],
        )  # fmt: skip
        found = wb.simulate(machine, 60.0, until="rest")
        assert bool(found.attrs["at_rest"]) == rests

    def test_a_spring_that_winds_up(self):
        """The block sticks to the belt until the spring tears it off."""
        machine = wb.Machine(
            inertias=[wb.Inertia("block", 1.0), wb.Driven("belt", 0.1)],
            shafts=[wb.Shaft("block", "ground", 5.0)], contacts=[contact("belt", force=20.0)],
        )  # fmt: skip
        found = wb.simulate(machine, 60.0, until="rest")
        assert found["event_time"].size > 1


class TestEndsThatTurnTogether:
    """Two driven ends of the same speed are one: they wind up nothing."""

    WAVE = wb.Torque("a", wb.Harmonic(3.0, 1.0), name="wave")

    def machine(self, *ends):
        names = [f"d{i}" for i in range(len(ends))]
        parts = [
            wb.Shaft("a", name, 150.0 / len(ends), 1.5 / len(ends), ratio=ratio, name=f"s{name}")
            for name, (_, ratio) in zip(names, ends, strict=True)
        ]
        bodies = [wb.Driven(name, one) for name, (one, _) in zip(names, ends, strict=True)]
        return wb.Machine(
            inertias=[wb.Inertia("a", 1.0, speed=5.0), *bodies], shafts=parts, torques=[self.WAVE]
        )

    @pytest.mark.parametrize("other", [(5.0, 1.0), (-5.0, -1.0), (10.0, 0.5)])
    def test_they_are_one_end(self, other):
        one, two = self.machine((5.0, 1.0)), self.machine((5.0, 1.0), other)
        found, expected = wb.motion(two), wb.motion(one)
        assert found.verdict.startswith("synchronous")
        np.testing.assert_allclose(found.exponents, expected.exponents, rtol=1e-6)
        orbits = wb.orbit(two), wb.orbit(one)
        multipliers = [np.sort_complex(each.multipliers) for each in orbits]
        np.testing.assert_allclose(*multipliers, rtol=1e-9)
        amplitudes = [each.velocity_amplitude for each in orbits]
        assert amplitudes[0] == pytest.approx(amplitudes[1], rel=1e-9)

    def test_without_a_torque_they_carry_it_along(self):
        machine = self.machine((5.0, 1.0), (5.0, 1.0)).replace({"wave.amplitude": 0.0})
        assert wb.motion(machine).verdict.startswith("steady rotation")

    def test_at_different_speeds_they_wind_up_shafts(self):
        machine = self.machine((5.0, 1.0), (4.0, 1.0))
        assert "wind up" in wb.motion(machine).verdict
        with pytest.raises(wb.InputError, match=r"d0\.speed"):
            wb.orbit(machine)
