"""Measures of a stop against closed forms, energy, and dense samples."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from scipy.integrate import quad

import wedgebrake as wb
from machines import contact, single
from wedgebrake.analysis.responses.machine_series import NODES, largest, series

TORQUE = 2.0  # N m per N of force
INERTIA, SPEED = 40.0, 50.0


def pressed(force, *ends, **more):
    """A contact whose torque is twice its force."""
    return contact(*ends, radius=4.0, force=force, **more)


def disc(force, *, torque=None, **actuation):
    brake = pressed(force, **actuation)
    return single(brake, inertia=INERTIA, torque=torque, angle=0.3, speed=SPEED)


def with_hub(stiffness=1e4, damping=0.0, hub=2.0):
    return wb.Machine(
        inertias=[
            wb.Inertia("disc", INERTIA, speed=SPEED), wb.Inertia("hub", hub, speed=SPEED),
        ],
        shafts=[wb.Shaft("disc", "hub", stiffness=stiffness, damping=damping)],
        contacts=[pressed(100.0)],
    )  # fmt: skip


def value(found, name, **where):
    return float(found[name].sel(where))


class TestClosedForms:
    """One inertia: J omega' = -R g (F0 + slope omega)."""

    @pytest.mark.parametrize("slope", [0.0, -1.2, 3.0])
    def test_time_angle_heat_and_torque(self, slope):
        force = 100.0
        found = wb.stopping(wb.simulate(disc(force, slope=slope), 60.0, until="rest"))
        if slope:
            rate = TORQUE * slope / INERTIA
            time = math.log1p(slope * SPEED / force) / rate
            angle = (SPEED - force / slope * math.log1p(slope * SPEED / force)) / rate
        else:
            time = INERTIA * SPEED / (TORQUE * force)
            angle = 0.5 * SPEED * time
        largest_torque = TORQUE * max(force, force + slope * SPEED)
        assert float(found.stop_time) == pytest.approx(time, rel=1e-14)
        assert value(found, "contact_stop_time", contact="brake") == float(found.stop_time)
        assert value(found, "stop_angle", inertia="disc") == pytest.approx(angle, rel=1e-13)
        assert value(found, "sliding_angle", contact="brake") == pytest.approx(angle, rel=1e-13)
        heat = 0.5 * INERTIA * SPEED**2
        assert value(found, "heat", contact="brake") == pytest.approx(heat, rel=1e-13)
        mean = INERTIA * SPEED / time  # by the momentum
        assert value(found, "mean_torque", contact="brake") == pytest.approx(mean, rel=1e-13)
        peak = value(found, "peak_torque", contact="brake")
        assert peak == pytest.approx(largest_torque, rel=1e-13)
        step = value(found, "acceleration_step", inertia="disc")
        assert step == pytest.approx(TORQUE * force / INERTIA, rel=1e-12)

    def test_jerk_of_a_brake_that_varies_with_speed(self):
        """The acceleration decays as exp(-R g slope t/J)."""
        force, slope = 100.0, 3.0
        found = wb.stopping(wb.simulate(disc(force, slope=slope), 60.0, until="rest"))
        rate, time = TORQUE * slope / INERTIA, float(found.stop_time)
        first = rate * TORQUE * (force + slope * SPEED) / INERTIA
        at = {"phase": "braking", "inertia": "disc"}
        assert value(found, "peak_jerk", **at) == pytest.approx(first, rel=1e-11)
        mean = first * math.sqrt(-math.expm1(-2.0 * rate * time) / (2.0 * rate * time))
        assert value(found, "rms_jerk", **at) == pytest.approx(mean, rel=1e-11)

    def test_extremes_between_events_are_found(self):
        """A force with a ripple: largest torque at its crests, which no sample meets."""
        ripple, frequency = 0.1, 3.3
        force = 100.0 * (1.0 + ripple * wb.Harmonic(1.0, frequency, 0.4))
        found = wb.stopping(wb.simulate(disc(force), 60.0, times=[0.0, 60.0]))
        peak = value(found, "peak_torque", contact="brake")
        assert peak == pytest.approx(TORQUE * 100.0 * (1.0 + ripple), rel=1e-13)
        jerk = 2.0 * math.pi * frequency * ripple * TORQUE * 100.0 / INERTIA
        at = value(found, "peak_jerk", phase="braking", inertia="disc")
        assert at == pytest.approx(jerk, rel=1e-10)

    def test_undamped_ring_down(self):
        """Peak jerk w sqrt(a0^2 + w^2 v0^2) after the last stick."""
        machine = with_hub()
        natural = math.sqrt(1e4 / 2.0)
        period = 2.0 * math.pi / natural
        found = wb.stopping(wb.simulate(machine, 60.0, until="rest"), ringdown=20.0 * period)
        a0 = value(found, "stop_acceleration", inertia="hub")
        v0 = value(found, "stop_speed", inertia="hub")
        peak = natural * math.hypot(a0, natural * v0)
        at = {"phase": "ring-down", "inertia": "hub"}
        assert value(found, "peak_jerk", **at) == pytest.approx(peak, rel=1e-9)
        assert value(found, "rms_jerk", **at) == pytest.approx(peak / math.sqrt(2.0), rel=1e-9)
        held = value(found, "peak_jerk", phase="ring-down", inertia="disc")
        assert held < 1e-9 * peak
        # The twist at the stop, from the state there.
        state = wb.final_state(
            wb.simulate(machine, float(found.stop_time), times=[float(found.stop_time)])
        )
        twist = state.angles["disc"] - state.angles["hub"]
        assert a0 == pytest.approx(1e4 * twist / 2.0, rel=1e-8)

    def test_a_driven_body_at_rest_is_the_ground(self):
        """Its jerk is not defined, and all else is as with a spring to the ground."""
        ends = {}
        for end in ("ground", "end"):
            inertias = [wb.Inertia("disc", INERTIA, speed=2.0)]
            inertias += [wb.Driven("end", 0.0)] if end == "end" else []
            machine = wb.Machine(
                inertias=inertias,
                shafts=[wb.Shaft("disc", end, 90.0, 1.0)],
                contacts=[pressed(40.0, "disc")],
            )
            ends[end] = wb.stopping(wb.simulate(machine, 20.0), ringdown=0.0)
        assert np.isnan(ends["end"].peak_jerk.sel(inertia="end")).all()
        for name, one in ends["ground"].items():
            other = ends["end"][name]
            other = other.sel(inertia=["disc"]) if "inertia" in other.dims else other
            np.testing.assert_allclose(one, other, rtol=1e-9, atol=1e-12, err_msg=str(name))


class TestOtherMethods:
    def test_heat_is_that_of_the_energy_balance(self):
        machine = with_hub(damping=3.0).replace({"brake.slope": -1.0})
        response = wb.simulate(machine, 60.0, until="rest")
        found = wb.stopping(response)
        heat = wb.energy(response).friction_heat
        np.testing.assert_allclose(found.heat, heat, rtol=1e-12)

    @pytest.mark.parametrize(
        "changes",
        [
            {"actuation": wb.Actuation(initial_force=100.0, slope=-1.0, sample_time=1e-2, delay=1,
                                       resolution=0.5)},
            {"actuation": wb.Actuation(initial_force=100.0, slope=-1.0, frequency=50.0,
                                       damping_ratio=0.7, limits=(0.0, 90.0))},
            {"friction": wb.StribeckFriction(kinetic=0.4, static=0.5, speed=5.0)},
            {"initial_force": wb.Table(np.arange(0.0, 20.0, 0.01),
                                       100.0 + 5.0 * np.cos(np.arange(2000) ** 2), after="hold")},
        ],
        ids=["sampled", "lag", "stribeck", "record"],
    )  # fmt: skip
    def test_heat_with_kinks_and_jumps(self, changes):
        machine = with_hub(damping=3.0).replace({f"brake.{k}": one for k, one in changes.items()})
        response = wb.simulate(machine, 18.0)
        found = wb.stopping(response)
        np.testing.assert_allclose(found.heat, wb.energy(response).friction_heat, rtol=1e-12)
        dense = wb.simulate(machine, 18.0, times=np.linspace(0.0, 18.0, 30_001))
        slides = dense.sticking.to_numpy() == 0
        seen = np.abs(dense.brake_torque.to_numpy()[slides]).max()
        peak = value(found, "peak_torque", contact="brake")
        assert seen <= peak * (1.0 + 1e-9)
        assert peak == pytest.approx(seen, rel=1e-3)

    def test_judder_from_dense_samples(self):
        force = 100.0 * (1.0 + 0.1 * wb.Orders(wb.Ramp(SPEED, 0.0, 10.0), [[1.0, 1.0, 0.0]]))
        machine = with_hub(stiffness=400.0, damping=1.0).replace({"brake.initial_force": force})
        response = wb.simulate(machine, 60.0, until="rest")
        windows = 7
        found = wb.stopping(response, windows=windows)
        edges = np.linspace(0.0, float(found.stop_time), windows + 1)
        for i in range(windows):
            times = np.linspace(edges[i], edges[i + 1], 4001)[1:-1]
            dense = wb.simulate(machine, 60.0, times=times)
            for name, values in (
                ("judder_speed", dense.velocity), ("judder_torque", dense.brake_torque),
            ):  # fmt: skip
                columns = np.column_stack([np.ones_like(times), times])
                line = columns @ np.linalg.lstsq(columns, values.to_numpy(), rcond=None)[0]
                expected = np.sqrt(2.0 * np.mean((values.to_numpy() - line) ** 2, axis=0))
                np.testing.assert_allclose(found[name][i], expected, rtol=2e-3)
            np.testing.assert_allclose(found.mean_speed[i], dense.velocity.mean("time"), rtol=1e-3)

    def test_jerk_from_differences_of_accelerations(self):
        machine = with_hub(stiffness=400.0, damping=1.0)
        found = wb.stopping(wb.simulate(machine, 60.0, until="rest"))
        times = np.linspace(0.0, float(found.stop_time), 40_001)[:-1]
        speeds = wb.simulate(machine, 60.0, times=times).velocity.to_numpy()
        h = times[1] - times[0]
        jerk = (speeds[2:] - 2.0 * speeds[1:-1] + speeds[:-2]) / h**2
        braking = found.sel(phase="braking")
        np.testing.assert_allclose(braking.peak_jerk, np.abs(jerk).max(axis=0), rtol=1e-3)
        np.testing.assert_allclose(
            braking.rms_jerk, np.sqrt(np.mean(jerk**2, axis=0)), rtol=1e-3
        )  # fmt: skip

    def test_sampling_and_length_of_the_response_do_not_matter(self):
        machine = with_hub(damping=3.0)
        first = wb.stopping(wb.simulate(machine, 60.0, until="rest"), ringdown=0.5)
        second = wb.stopping(wb.simulate(machine, 25.0, times=[1.0]), ringdown=0.5)
        for name in first.data_vars:
            np.testing.assert_allclose(first[name], second[name], rtol=1e-8, atol=1e-8)

    def test_continued_run(self):
        machine = disc(100.0, slope=-1.0)
        early = wb.simulate(machine, 3.0)
        late = wb.simulate(machine, 60.0, initial=wb.final_state(early), until="rest")
        whole = wb.stopping(wb.simulate(machine, 60.0, until="rest"))
        found = wb.stopping(late)
        assert found.attrs["start"] == 3.0
        assert 3.0 + float(found.stop_time) == pytest.approx(float(whole.stop_time), rel=1e-13)

    def test_several_contacts(self):
        """A clutch that locks, and a brake that stops both sides."""
        machine = wb.Machine(
            inertias=[wb.Inertia("a", 1.0, speed=20.0), wb.Inertia("b", 2.0, speed=5.0)],
            contacts=[
                pressed(2.0, "a", "b", name="clutch"), pressed(0.5, "b"),
            ],
        )  # fmt: skip
        response = wb.simulate(machine, 60.0, until="rest")
        found = wb.stopping(response)
        # Clutch 4 N m, brake 1 N m: a loses 4 rad/s^2, b gains 1.5; then 1/3 rad/s^2 together.
        locked = 15.0 / 5.5
        times = [locked, locked + 3.0 * (20.0 - 4.0 * locked)]
        np.testing.assert_allclose(found.contact_stop_time, times, rtol=1e-13)
        assert float(found.stop_time) == pytest.approx(times[1], rel=1e-13)
        np.testing.assert_allclose(found.heat, wb.energy(response).friction_heat, rtol=1e-12)
        np.testing.assert_allclose(found.heat.sum(), 0.5 * 400.0 + 0.5 * 2.0 * 25.0, rtol=1e-12)

    def test_driveline_whose_shaft_slows_down(self):
        """The base stops at 4 s; the brake's torque twists the shaft until then."""
        system = wb.BrakedDriveline(
            driveline=wb.Driveline(
                inertia=1.0, stiffness=1e3, damping_ratio=0.2,
                drive_speed=wb.Ramp(80.0, 0.0, 4.0),
            ),
            brake=wb.ConventionalBrake(radius=0.2),
            friction=wb.CoulombFriction(kinetic=0.4, static=0.5),
            actuation=wb.Actuation(initial_force=500.0), excitation=wb.Harmonic(0.0, 1.0),
        )  # fmt: skip
        response = wb.simulate(system, duration=6.0)
        found = wb.stopping(response)
        # What is left of the vibration slides on for at most half a period.
        assert 4.0 <= float(found.stop_time) <= 4.0 + math.pi / math.sqrt(1e3 * (1.0 - 0.2**2))
        machine = wb.simulate(system.machine, 6.0)
        heat = wb.energy(machine).friction_heat
        np.testing.assert_allclose(found.heat, heat, rtol=1e-9)
        assert value(found, "mean_torque", contact="brake") == pytest.approx(40.0, rel=1e-12)
        angle = value(found, "stop_angle", inertia="driveline")
        assert angle == pytest.approx(-0.04, rel=1e-6)

    @pytest.mark.parametrize("method", ["smooth", "exact"])
    def test_a_driveline_stops_by_the_method_of_its_response(self, method):
        """J dv/dt = -R F mu(R v): the time is an integral over the speed."""
        law = wb.StribeckFriction(kinetic=0.2, static=0.5, speed=2.0, tolerance=1e-2)
        system = wb.BrakedDriveline(
            driveline=wb.Driveline(inertia=1.5, stiffness=0.0, damping=0.0),
            brake=wb.ConventionalBrake(radius=0.2), friction=law,
            actuation=wb.Actuation(initial_force=500.0), excitation=wb.Harmonic(0.0, 1.0),
        )  # fmt: skip
        response = wb.simulate(system, 10.0, initial=(0.0, 30.0), method=method)
        exact, _ = quad(lambda v: 1.5 / (0.2 * 500.0 * law.kinetic_at(0.2 * v)), 0.0, 30.0)
        # The lines of "exact" are within the law's tolerance of the curve.
        found, close = float(wb.stopping(response).stop_time), {"smooth": 1e-9, "exact": 1e-2}
        assert found == pytest.approx(exact, rel=close[method])
        assert (abs(found / exact - 1.0) > 1e-6) == (method == "exact")
        assert float(response.stick_start[-1]) == pytest.approx(found, rel=1e-12)


class TestSeries:
    def test_largest_value_between_nodes(self):
        generator = np.random.default_rng(3)
        coefficients = generator.normal(size=(20, NODES.size, 2))
        x = np.linspace(-1.0, 1.0, 200_001)
        dense = [
            np.abs(np.polynomial.legendre.legval(x, coefficients[:, :, i].T)).max()
            for i in range(2)
        ]
        np.testing.assert_allclose(largest(coefficients), dense, rtol=1e-8)

    def test_series_of_polynomials(self):
        rows = np.random.default_rng(4).normal(size=(3, NODES.size))
        values = np.polynomial.legendre.legval(NODES, rows.T)
        np.testing.assert_allclose(series(values[..., None])[..., 0], rows, atol=1e-13)


class TestBadInput:
    def test_nothing_stops(self):
        with pytest.raises(wb.InputError) as error:
            wb.stopping(wb.simulate(disc(100.0), 1.0))
        assert error.value.name == "response"

    def test_rest_from_the_start(self):
        machine = disc(100.0).replace({"disc.speed": 0.0})
        with pytest.raises(wb.InputError):
            wb.stopping(wb.simulate(machine, 1.0))

    def test_no_contacts(self):
        machine = wb.Machine(inertias=[wb.Inertia("disc", 1.0, speed=1.0)])
        with pytest.raises(wb.InputError):
            wb.stopping(wb.simulate(machine, 1.0))

    def test_stick_on_a_moving_base_is_no_stop(self):
        machine = wb.Machine(
            inertias=[wb.Inertia("disc", 1.0)], contacts=[pressed(5.0, base_speed=3.0)]
        )
        with pytest.raises(wb.InputError):
            wb.stopping(wb.simulate(machine, 10.0))

    def test_locked_clutch_is_no_stop(self):
        machine = wb.Machine(
            inertias=[wb.Inertia("a", 1.0, speed=20.0), wb.Inertia("b", 2.0)],
            contacts=[pressed(2.0, "a", "b")],
        )
        with pytest.raises(wb.InputError):
            wb.stopping(wb.simulate(machine, 60.0))

    def test_slip_in_the_ring_down(self):
        force = wb.Table([0.0, 15.0, 15.0, 20.0], [100.0, 100.0, 0.0, 0.0], after="hold")
        response = wb.simulate(disc(force, torque=1.0), 12.0)
        assert float(wb.stopping(response).stop_time) < 12.0
        with pytest.raises(wb.InputError) as error:
            wb.stopping(response, ringdown=10.0)
        assert error.value.name == "ringdown"

    @pytest.mark.parametrize(
        ("name", "given"), [("ringdown", -1.0), ("windows", 0), ("ringdown", "long")]
    )
    def test_arguments(self, name, given):
        response = wb.simulate(disc(100.0), 60.0, until="rest")
        with pytest.raises(wb.InputError) as error:
            wb.stopping(response, **{name: given})
        assert error.value.name == name

    def test_other_datasets(self):
        import xarray as xr

        with pytest.raises(wb.InputError):
            wb.stopping(xr.Dataset())
        smooth = wb.paper.system().replace(friction=wb.SmoothedFriction(kinetic=0.3))
        with pytest.raises(wb.InputError):
            wb.stopping(wb.simulate(smooth, periods=1))

    def test_result_is_plain(self):
        """Attributes can be written to a file."""
        found = wb.stopping(wb.simulate(disc(100.0), 60.0, until="rest"))
        json.dumps(found.attrs)
        assert all("units" in found[name].attrs for name in found.data_vars)


@pytest.mark.parametrize("limit", [1.0, 0.3, 2.0, 3.0, 4.0])
def test_a_driveline_runs_until_it_rests(limit):
    """A free swing of half a period each, from x to 2 limit / k - x; the last within the limit."""
    line = wb.BrakedDriveline(
        driveline=wb.Driveline(inertia=0.2, damping=0.0, stiffness=2.0),
        brake=wb.ConventionalBrake(radius=1.0),
        friction=wb.CoulombFriction(kinetic=1.0),
        actuation=wb.Actuation(initial_force=limit),
        excitation=wb.HarmonicTorque(amplitude=0.0, frequency=1.0),
    )
    swings, angle = 0, 1.5
    while 2.0 * abs(angle) > limit:
        swings, angle = swings + 1, math.copysign(limit, angle) - angle
    found = wb.simulate(line, 60.0, initial=(1.5, 0.0), until="rest")
    assert found.attrs["at_rest"] == 1
    assert found.attrs["final_time"] == pytest.approx(
        swings * math.pi * math.sqrt(0.1), rel=1e-12, abs=1e-12
    )
    assert found.attrs["final_angle"] == pytest.approx(angle, rel=1e-12)
    assert found["time"].values[-1] == found.attrs["final_time"]
    moving = wb.simulate(
        line.replace(amplitude=3.0 * limit), periods=3, initial=(1.5, 0.0), until="rest"
    )
    assert (moving.attrs["at_rest"], moving.attrs["final_time"]) == (0, 3.0)


def test_lengths_in_periods_of_the_signals_of_a_machine():
    torques = [
        wb.Torque("disc", wb.Harmonic(100.0, f), name=n) for n, f in (("a", 2.0), ("b", 3.0))
    ]
    machine = disc(100.0).replace(torques=torques)
    found = wb.simulate(machine, periods=4, samples_per_period=50)
    assert found.attrs["final_time"] == 4.0
    np.testing.assert_allclose(found["time"], np.linspace(0.0, 4.0, 201), rtol=1e-14)
    one = wb.simulate(machine, 4.0, samples=201)
    np.testing.assert_array_equal(found["angle"], one["angle"])
    for given in ({"periods": 4}, {"duration": 1.0, "samples_per_period": 50}):
        for other in (disc(100.0), machine.replace(torques=[*torques, wb.Torque(
            "disc", wb.Harmonic(1.0, math.sqrt(2.0)), name="c")])):  # fmt: skip
            with pytest.raises(wb.InputError) as raised:
                wb.simulate(other, **given)
            assert raised.value.name in given
    for name, given in {
        "periods": {"duration": 1.0, "periods": 4},
        "duration": {"duration": "1 s", "samples_per_period": 4},
        "samples_per_period": {"periods": 5_000_000, "samples_per_period": 1000},
    }.items():
        with pytest.raises(wb.InputError) as raised:
            wb.simulate(machine, **given)
        assert raised.value.name == name
