"""Responses of a driveline and of its machine: one layout, one set of measures."""

import json
import math

import numpy as np
import pytest
import xarray as xr

import wedgebrake as wb
from wedgebrake.analysis.responses.contacts import contact_summary
from wedgebrake.solvers.layout import full

PAPER = wb.paper.system(eta=-24, f=0.63, F0=0.036, alpha=1.18, brake="wedge")
SECOND_ORDER = PAPER.replace(
    excitation=wb.HarmonicTorque(500.0, 10.03, orders=[[2.0, 0.5, 0.3]]), drive_speed=1.0
)
LAGGED = PAPER.replace(lag=0.01)
RAMP = wb.BrakedDriveline(
    driveline=wb.Driveline(
        inertia=1.0, damping=0.5, stiffness=1e4, drive_speed=wb.Ramp(3.0, 0.5, 0.5)
    ),
    brake=wb.ConventionalBrake(radius=0.2),
    friction=wb.CoulombFriction(kinetic=0.3),
    actuation=wb.Actuation(initial_force=300.0),
    excitation=wb.Constant(20.0),
)
SYSTEMS = {"plain": PAPER, "signals": SECOND_ORDER, "lag": LAGGED, "no period": RAMP}


def both(system, duration=0.6, **more):
    """The responses of a driveline and of its machine at the same times."""
    times = np.linspace(0.0, duration, 301)
    return tuple(
        wb.simulate(each, duration, times=times, **more) for each in (system, system.machine)
    )


@pytest.fixture(params=SYSTEMS, scope="module")
def pair(request):
    return both(SYSTEMS[request.param])


def close(found, expected, what=""):
    found, expected = np.asarray(found), np.asarray(expected)
    scale = np.max(np.abs(expected), initial=0.0, where=np.isfinite(expected))
    np.testing.assert_allclose(
        found, expected, rtol=1e-12, atol=1e-11 * scale, err_msg=str(what), equal_nan=True
    )


def test_a_driveline_shows_the_variables_of_its_machine(pair):
    one, machine = full(pair[0]), pair[1]
    assert set(machine.data_vars) <= set(one.data_vars)
    assert {dim: one.sizes[dim] for dim in machine.sizes} == dict(machine.sizes)
    for name in ("inertia", "shaft", "contact"):
        assert one[name].to_numpy().tolist() == machine[name].to_numpy().tolist()
    for name in machine.data_vars:
        assert one[name].dims == machine[name].dims
        assert one[name].attrs == machine[name].attrs
        close(one[name], machine[name], name)


def test_measures_of_a_contact_agree(pair):
    summaries = [contact_summary(each) for each in pair]
    for name in summaries[0].data_vars:
        close(summaries[0][name], summaries[1][name], name)
    sticks = [wb.sticks(each, contact="brake") for each in pair]
    for name in sticks[0].data_vars:
        close(sticks[0][name], sticks[1][name], name)
    assert sticks[0].attrs["class"] == sticks[1].attrs["class"]
    torques = [wb.brake_torque(each, 0.1, 0.5, contact="brake") for each in pair]
    assert torques[0].mean == pytest.approx(torques[1].mean, rel=1e-11)
    assert torques[0].peak == pytest.approx(torques[1].peak, rel=1e-9)
    # Between states, sign changes of a driveline's torque are located by a chord.
    assert torques[0].mean_size == pytest.approx(torques[1].mean_size, rel=1e-6)
    disc = wb.LumpedDisc(mass=8.0, specific_heat=500.0)
    rises = [wb.temperature(each, disc).peak_temperature.item() for each in pair]
    assert rises[0] == pytest.approx(rises[1], rel=1e-12)


def test_energy_of_whole_periods_is_that_of_all_parts(pair):
    """Period by period, or where there is none in one window: the sums of the parts."""
    one, other = (wb.energy(each) for each in pair)
    assert one.attrs["error"] < 1e-11
    last = one.attrs["stop"]
    if last < 0.6:  # the rest of the run, part by part
        rest = wb.energy(pair[1], start=last)
        other = other - rest
    sums = {
        "torque_work": other.torque_work.sum(), "viscous_loss": other.viscous_loss.sum(),
        "friction_heat": other.friction_heat.sum(), "drive_work": other.base_work.sum(),
        "stored_change": other.stored_change,
    }  # fmt: skip
    size = float(abs(sums["friction_heat"]))
    for name, total in sums.items():
        assert one.attrs[f"total_{name}"] == pytest.approx(float(total), abs=1e-11 * size), name


def test_check_and_spectrum_take_all_of_them(pair):
    assert wb.check(pair[0]) == wb.check(pair[1]) == []
    lines = [
        wb.spectrum(pair[0], "brake_torque"), wb.spectrum(pair[1], "brake_torque", part="brake"),
    ]  # fmt: skip
    close(lines[0].amplitude, lines[1].amplitude)
    assert lines[0].attrs["natural_frequency"] == pytest.approx(100.0 / (2.0 * math.pi))


def test_torque_of_each_contact_of_a_machine():
    """Two brakes that slide forwards: each has its mean, and their moments decelerate the disc."""
    machine = wb.Machine(
        inertias=[wb.Inertia("disc", 2.0, speed=50.0)],
        contacts=[
            wb.Contact(
                "disc", name=name, brake=wb.ConventionalBrake(radius=0.2),
                friction=wb.CoulombFriction(kinetic=0.4),
                actuation=wb.Actuation(initial_force=force),
            )
            for name, force in (("front", 100.0), ("rear", 50.0))
        ],
    )  # fmt: skip
    response = wb.simulate(machine, 2.0)
    found = {name: wb.brake_torque(response, contact=name) for name in ("front", "rear")}
    gain = wb.ConventionalBrake(radius=0.2).amplification(0.4) * 0.2
    for name, force in (("front", 100.0), ("rear", 50.0)):
        for value in (found[name].mean, found[name].mean_size, found[name].peak):
            assert value == pytest.approx(gain * force, rel=1e-13)
    with pytest.raises(wb.InputError, match=r"^contact"):
        wb.brake_torque(response)


def test_mean_magnitude_where_the_torque_changes_its_sign():
    """A brake that holds a sine carries it: mean 0, mean magnitude 2/pi of the peak."""
    system = PAPER.replace(excitation=wb.Harmonic(3.0, 10.0) + 0.0, slope=0.0, initial_force=1000.0)
    found = wb.brake_torque(wb.simulate(system, 0.5))
    assert found.mean == pytest.approx(0.0, abs=1e-13)
    assert found.mean_size == pytest.approx(6.0 / math.pi, rel=1e-12)
    assert found.peak == pytest.approx(3.0, rel=1e-12)


@pytest.mark.parametrize("name", SYSTEMS)
def test_a_run_continues_from_the_final_state_of_another(name):
    system = SYSTEMS[name]
    whole = wb.simulate(system, 0.6, times=np.linspace(0.3, 0.6, 31))
    first = wb.simulate(system, 0.3)
    state = wb.FinalState.from_json(wb.final_state(first).to_json())
    second = wb.simulate(system, 0.3, initial=state, times=whole.time)
    assert second.attrs["start_time"] == pytest.approx(0.3)
    for variable in ("angle", "velocity", "brake_torque", "actuation_force"):
        found, expected = second[variable], whole[variable]
        assert float(abs(found - expected).max()) < 1e-11 * float(abs(expected).max())
    assert wb.check(second) == []
    # The state of a driveline is one of its machine, and the reverse.
    other = wb.simulate(system.machine, 0.3, initial=state, times=whole.time)
    assert float(abs(other.velocity[:, 0] - whole.velocity).max()) < 1e-10 * float(
        abs(whole.velocity).max()
    )


def test_states_that_do_not_fit_are_refused():
    state = wb.final_state(wb.simulate(LAGGED, 0.1))
    for system in (PAPER, PAPER.machine):
        with pytest.raises(wb.InputError, match=r"^initial = FinalState"):
            wb.simulate(system, 0.1, initial=state)


def test_an_angle_and_a_velocity_start_a_machine_with_one_inertia():
    one, other = (
        wb.simulate(each, 0.2, initial=(1e-3, -0.5), times=[0.1, 0.2])
        for each in (PAPER, PAPER.machine)
    )
    close(other.velocity[:, 0], one.velocity)
    two = wb.Machine(inertias=[wb.Inertia("a", 1.0), wb.Inertia("b", 1.0)])
    with pytest.raises(wb.InputError, match=r"^initial = "):
        wb.simulate(two, 0.2, initial=(1e-3, -0.5))


@pytest.mark.parametrize("solve", [wb.simulate, wb.paper.ode14x])
@pytest.mark.parametrize("kind", ["coulomb", "smoothed"])
def test_a_run_may_start_before_zero(solve, kind):
    """The torque has a period, and so have the responses from rest at its beginning."""
    system = PAPER
    if kind == "smoothed":
        system = PAPER.replace(friction=wb.SmoothedFriction(kinetic=0.3, steepness=50.0))
    period = 1.0 / PAPER.excitation.frequency
    one = solve(system, periods=3, samples_per_period=20, start_time=-2.0 * period)
    other = solve(system, periods=3, samples_per_period=20)
    np.testing.assert_allclose(one.velocity, other.velocity, atol=1e-6)
    assert one.period.to_numpy().tolist()[-3:] == [-1, 0, 1]
    np.testing.assert_allclose(one.poincare_time[-3:], [-period, 0.0, period], atol=1e-15)


def test_runs_until_rest_end_at_the_same_time():
    """A driveline whose torque has no effect, sampled until it rests."""
    system = PAPER.replace(amplitude=0.0, eta=0.0)
    one, other = (
        wb.simulate(each, 20.0, initial=(0.1, 0.0), until="rest", samples=11)
        for each in (system, system.machine)
    )
    assert one.attrs["at_rest"] == other.attrs["at_rest"] == 1
    assert one.attrs["final_time"] == pytest.approx(other.attrs["final_time"], rel=1e-12)
    assert one.attrs["message"] == other.attrs["message"]
    close(one.time, other.time)
    given = wb.simulate(system, 20.0, initial=(0.1, 0.0), until="rest", times=[0.0, 0.01, 20.0])
    assert given.time.to_numpy().tolist() == [0.0, 0.01]


def test_responses_of_earlier_versions_are_read():
    """They lack what can be computed, and have no start time, final state or sides of events."""
    response = wb.simulate(LAGGED, 0.6)
    old = response.drop_vars(["actuation_force", "sliding_velocity", "shaft_torque"])
    for name in ("start_time", "final_state", "at_rest"):
        del old.attrs[name]
    assert wb.energy(old).identical(wb.energy(response))
    assert wb.check(old) == []
    assert wb.sticks(old).identical(wb.sticks(response))
    assert wb.brake_torque(old) == wb.brake_torque(response)
    assert contact_summary(old).peak_torque.item() == contact_summary(response).peak_torque.item()
    wb.plot(old)
    with pytest.raises(wb.InputError, match="final_angle"):
        wb.final_state(old)


@pytest.mark.parametrize("name", SYSTEMS)
def test_all_of_them_have_a_picture(name):
    one, other = both(SYSTEMS[name])
    assert len(wb.plot(one).axes) >= 4
    shown = wb.plot(other, inertia="driveline", contact="brake")
    curves = [
        figure.axes[0].lines[-1].get_xydata() for figure in (wb.plot(one), shown)
    ]  # fmt: skip
    np.testing.assert_allclose(curves[0], curves[1], rtol=1e-9, atol=1e-9)
    with pytest.raises(wb.InputError, match=r"^contact = 'clutch'"):
        wb.plot(other, contact="clutch")


def test_the_default_reference_of_orders_is_the_moving_base():
    system = RAMP.replace(drive_speed=wb.Ramp(200.0, 100.0, 4.0), initial_force=0.0)
    found = [
        wb.order_map(wb.simulate(each, 4.0), "velocity") for each in (system, system.machine)
    ]  # fmt: skip
    assert found[0].attrs["reference"] == found[1].attrs["reference"]
    assert found[0].attrs["reference"].startswith("drive speed 200 to 100 rad/s")
    close(found[0].amplitude, found[1].amplitude)


def test_a_response_names_its_system():
    assert json.loads(wb.simulate(LAGGED, 0.1).attrs["groups"])["eta"] == pytest.approx(-24.0)


@pytest.mark.parametrize("system", [PAPER, PAPER.machine], ids=["driveline", "machine"])
@pytest.mark.parametrize("call", [wb.simulate, wb.poincare])
def test_datasets_are_those_of_their_variables(system, call):
    one = call(system, periods=3, **({"transient": 0} if call is wb.poincare else {}))
    parts = [
        {name: (v.dims, v.to_numpy(), v.attrs) for name, v in group.items()}
        for group in (one.data_vars, one.coords)
    ]
    public = xr.Dataset(parts[0], coords=parts[1], attrs=one.attrs)
    xr.testing.assert_identical(one, public)
    assert dict(one.sizes) == dict(public.sizes)
    assert {name: index.dtype for name, index in one.indexes.items()} == {
        name: index.dtype for name, index in public.indexes.items()
    }
    for name, index in public.indexes.items():
        assert index.equals(one.indexes[name])


def test_datasets_share_nothing_that_can_be_changed():
    one = wb.simulate(PAPER.machine, 0.1, samples=3)
    one["inertia"].attrs["note"] = one["angle"].attrs["note"] = "mine"
    other = wb.simulate(PAPER.machine, 0.1, samples=3)
    assert "note" not in other["inertia"].attrs
    assert "note" not in other["angle"].attrs
