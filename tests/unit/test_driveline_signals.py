"""Drivelines that are solved as machines: commands, and errors in the names of the driveline."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

import wedgebrake as wb
from wedgebrake.model.studies.study_run import RunSettings

RECORD = wb.Table([0.0, 0.1], [1.0, 2.0])
REPEATED = wb.Table([0.0, 0.05, 0.1], [-300.0, 300.0, -300.0], periodic=True)
SYSTEM = wb.paper.system(eta=-24.0, F0=0.067)
SMOOTH = SYSTEM.replace(friction=wb.SmoothedFriction(kinetic=0.3, steepness=100.0))


def with_signal(part: str, signal: Any, system: Any = SYSTEM) -> Any:
    """The system with one of its values replaced by a signal."""
    if part == "excitation":
        return system.replace(excitation=signal)
    return system.replace(**{part.rpartition(".")[2]: signal})


PARTS = ["excitation", "driveline.drive_speed", "actuation.initial_force"]


@pytest.mark.parametrize("part", PARTS)
@pytest.mark.parametrize(
    "call",
    [wb.motion, wb.poincare, lambda system: wb.sweep(system, slope=[-40.0, -30.0])],
    ids=["motion", "poincare", "sweep"],
)
def test_a_record_has_no_steady_motion(part, call) -> None:
    with pytest.raises(wb.InputError) as raised:
        call(with_signal(part, RECORD))
    assert raised.value.name == part
    assert isinstance(raised.value.value, wb.Table)


@pytest.mark.parametrize("part", PARTS)
def test_commands_report_on_the_driveline(part, answer, tmp_path) -> None:
    system = with_signal(part, REPEATED)
    run = RunSettings(duration=0.2, initial=(1e-3, -0.5))
    study = tmp_path / "signals.toml"
    study.write_text(wb.Study(with_signal(part, REPEATED), run).to_toml())
    told = answer("stability", study)
    assert told["verdict"] == wb.stability(with_signal(part, REPEATED)).verdict
    assert told["system"].keys() == SYSTEM.as_dict().keys()
    told, response = answer("simulate", study), wb.simulate(system, 0.2, initial=run.initial)
    final = wb.final_state(wb.simulate(system.machine.started_at(*run.initial), 0.2))
    expected = {"time": 0.2, "angle": final.angles["driveline"]}
    assert told["final"] == {**expected, "velocity": final.speeds["driveline"]}
    assert told["system"].keys() == SYSTEM.as_dict().keys()
    assert told["stick_share"] == wb.sticks(response, told["steady_from"]).attrs["share"]


def test_a_stop_is_reported_with_its_energy(answer, run, tmp_path) -> None:
    """A ramp does not repeat; the shaft's drive pays for the heat of the brake."""
    stop = SYSTEM.replace(drive_speed=wb.Ramp(5.0, 0.0, 2.0), amplitude=0.0, slope=0.0)
    study = tmp_path / "stop.toml"
    study.write_text(wb.Study(stop, RunSettings(duration=4.0)).to_toml())
    told, response = answer("simulate", study), wb.simulate(stop, 4.0)
    assert told["final"].keys() == {"time", "angle", "velocity"}
    assert told["stopping"]["stop_time"] == pytest.approx(float(wb.stopping(response).stop_time))
    energy, (contact,) = told["energy"], told["contacts"].values()
    gained = energy["base_work"]["brake"] + energy["torque_work"]["torque"]
    lost = energy["friction_heat"]["brake"] + energy["viscous_loss"]["shaft"]
    assert gained == pytest.approx(lost + energy["stored_change"], rel=1e-9)
    assert contact["final_side"] == 0
    text = run("simulate", study)[1]
    assert "stop after" in text
    assert f"velocity {told['final']['velocity']:.9g} rad/s" in text


def test_the_limits_of_a_lag(answer, run, tmp_path) -> None:
    """At rest too: R delta |g| = -c [1 + k T^2/(J + c T)], for J = 1."""
    system = SYSTEM.replace(lag=0.02)
    study = tmp_path / "lag.toml"
    study.write_text(wb.Study(system, RunSettings()).to_toml())
    line, gain = system.driveline, 0.2 * system.brake.amplification(0.3)
    slope = -line.damping * (1.0 + line.stiffness * 4e-4 / (1.0 + 0.02 * line.damping)) / gain
    told = answer("stability", study)
    (limit,) = (one for one in told["limits"] if one["parameter"] == "slope")
    assert limit["limit"] == pytest.approx(slope, rel=1e-9)
    assert [one["kind"] for one in limit["changes"]] == ["hopf"]
    assert len(told["forward"]["eigenvalues"]) == 3
    assert f"{limit['limit']:.6g}" in run("stability", study)[1]


def test_the_length_of_a_run_without_a_period_is_asked_for(run, tmp_path) -> None:
    study = tmp_path / "ramp.toml"
    study.write_text(
        wb.Study(with_signal("excitation", wb.Ramp(0.0, 300.0, 0.1)), RunSettings()).to_toml()
    )
    status, _, error = run("simulate", study)
    assert (status, "run.duration" in error) == (2, True)
    assert run("simulate", study, "--set", "duration=0.1")[0] == 0


@pytest.mark.parametrize("part", PARTS)
def test_a_run_beyond_a_record(part) -> None:
    system = with_signal(part, RECORD)
    with pytest.raises(wb.InputError) as raised:
        wb.simulate(system, 0.2)
    assert raised.value.name == part
    assert raised.value.value == pytest.approx(0.2)
    assert str(raised.value).startswith(f"{part}: ")
    whole = wb.simulate(system, RECORD.times[-1])
    assert whole.attrs["final_time"] == whole.time.values[-1] == RECORD.times[-1]


@pytest.mark.parametrize("part", PARTS)
@pytest.mark.parametrize("system", [SYSTEM, SMOOTH], ids=["coulomb", "smoothed"])
def test_the_method_is_the_obstacle(system, part) -> None:
    """The signal is not: sweeps, runs and motions take it."""
    changed = with_signal(part, REPEATED, system)
    calls = [
        lambda: wb.sweep(changed, slope=[-40.0, -30.0], method="exakt"),
        lambda: wb.motion(changed, method="exakt"),
        lambda: wb.simulate(changed, 0.1, method="exakt"),
    ]
    for call in calls:
        with pytest.raises(wb.InputError) as raised:
            call()
        assert (raised.value.name, raised.value.value) == ("method", "exakt")


@pytest.mark.parametrize("part", PARTS)
def test_smooth_laws_with_signals(part) -> None:
    """They are solved by the series of machines, which take a sine too: beside Runge-Kutta."""
    changed = with_signal(part, REPEATED, SMOOTH)
    given = {"periods": 12, "transient": 10}
    found, machine = wb.simulate(changed, 0.2), wb.simulate(changed.machine, 0.2)
    assert found.attrs["method"] == "smooth"
    assert found.attrs["final_angle"] == wb.final_state(machine).angles["driveline"]
    swept = wb.sweep(changed, slope=[-40.0], **given)
    assert (
        swept["rms_velocity"].item()
        == wb.sweep(changed.machine, {"brake.slope": [-40.0]}, **given)["rms_velocity"].item()
    )
    sine, constant = wb.simulate(SMOOTH, 0.2), SMOOTH.driveline.drive_speed
    signal = SMOOTH.replace(drive_speed=wb.Constant(constant))
    assert wb.simulate(signal, 0.2).attrs["final_angle"] == pytest.approx(
        sine.attrs["final_angle"], rel=1e-7
    )


@pytest.mark.parametrize("part", PARTS)
@pytest.mark.parametrize(
    "call",
    [wb.orbit, lambda system: wb.branches(system, eta=(-24.0, -30.0)),
     lambda system: wb.boundaries(system, eta=(-24.0, -30.0), kinetic=(0.25, 0.35))],
    ids=["orbit", "branches", "boundaries"],
)  # fmt: skip
def test_a_record_has_no_orbit(part, call) -> None:
    with pytest.raises(wb.InputError) as raised:
        call(with_signal(part, RECORD))
    assert raised.value.name == part
    assert isinstance(raised.value.value, wb.Table)


# Judder by falling friction on a turning shaft, without a torque.
JUDDER = wb.load_study(Path(__file__).parents[2] / "examples" / "falling_friction.toml").system
# At the Hopf point the slope of the friction, -0.6 exp(v/0.5), balances the damping.
STRIBECK = wb.BrakedDriveline(
    driveline=wb.Driveline(inertia=1.0, damping=0.1, stiffness=1.0, drive_speed=-0.5),
    brake=wb.ConventionalBrake(radius=1.0),
    friction=wb.StribeckFriction(kinetic=0.3, static=0.6, speed=0.5),
    actuation=wb.Actuation(initial_force=1.0),
    excitation=wb.HarmonicTorque(amplitude=0.0, frequency=1.0),
)
HOPF_SPEED = -0.5 * np.log(6.0)
DRIVEN = wb.paper.system(eta=-4.0)
SOLVED_AS_MACHINES = {
    "no torque": (JUDDER, None),
    "smooth": (DRIVEN, "smooth"),
    "lag": (DRIVEN.replace(lag=0.005), None),
    "limits": (DRIVEN.replace(limits=(0.0, 450.0)), None),
    "sampling": (DRIVEN.replace(sample_time=0.05 * DRIVEN.excitation.period), None),
    "signal": (
        DRIVEN.replace(excitation=wb.Harmonic(500.0, DRIVEN.excitation.frequency) + 1.0), None,
    ),
}  # fmt: skip


class TestOrbits:
    """Orbits of drivelines that are solved as machines."""

    @pytest.mark.parametrize("name", SOLVED_AS_MACHINES)
    def test_are_those_of_the_machine(self, name) -> None:
        system, method = SOLVED_AS_MACHINES[name]
        found, expected = (wb.orbit(one, method=method) for one in (system, system.machine))
        assert found.found
        assert found.period == pytest.approx(expected.period, rel=1e-12)
        np.testing.assert_allclose(found.multipliers, expected.multipliers, rtol=1e-12, atol=1e-12)
        assert found.sequence == expected.sequence

    def test_belong_to_the_driveline(self) -> None:
        """A run from the orbit comes back to it after a period."""
        system = SOLVED_AS_MACHINES["lag"][0]
        found = wb.orbit(system)
        assert found.system == system
        assert (found.states, found.twists) == ({}, {})
        run = wb.simulate(system, periods=found.order, initial=found.initial, times=[])
        ends = run.attrs["final_angle"], run.attrs["final_velocity"]
        np.testing.assert_allclose(ends, (found.angle, found.velocity), rtol=1e-8, atol=1e-10)

    def test_a_guess_is_an_angle_and_a_velocity_or_a_state(self) -> None:
        system = SOLVED_AS_MACHINES["lag"][0]
        expected = wb.orbit(system)
        guess = tuple(float(one) for one in expected.points[0][:2])
        for initial in (guess, list(guess), expected.initial):
            found = wb.orbit(system, 1, initial=initial)
            np.testing.assert_allclose(found.points, expected.points, rtol=1e-9, atol=1e-12)
        with pytest.raises(wb.InputError) as raised:
            wb.orbit(system, 1, initial=3.0)
        assert raised.value.name == "initial"

    def test_branches_have_the_parameters_of_the_driveline(self) -> None:
        found = wb.branches(JUDDER, drive_speed=(4.5, 5.2))
        expected = wb.branches(JUDDER.machine, {"brake.base_speed": (-4.5, -5.2)})
        assert found["bifurcation_kind"].to_numpy().tolist() == ["grazing"]
        np.testing.assert_allclose(found["drive_speed"], -expected["brake.base_speed"], rtol=1e-12)
        # The only inertia and shaft have no dimension in results of a driveline.
        assert not {"inertia", "shaft"} & set(found.dims)
        velocity = expected["velocity"].isel(inertia=0)
        np.testing.assert_allclose(found["velocity"], velocity, rtol=1e-12, atol=1e-12)
        assert json.loads(found.attrs["system"]) == JUDDER.as_dict()

    def test_a_grazing_names_the_speed_of_its_breakpoint(self) -> None:
        """The table ends at 2 m/s, at a radius of 0.2 m."""
        start = wb.orbit(JUDDER.replace(drive_speed=4.5))
        branch = wb.continuation(start, drive_speed=(4.5, 5.5), step=0.2)
        (grazing,) = [point for point in branch if point.bifurcation]
        assert "10 rad/s" in grazing.bifurcation.effect

    def test_boundaries_have_the_parameters_of_the_driveline(self) -> None:
        settings = {"step": 0.5, "switch": 0, "opposite": False}
        force = (980.0, 1020.0)
        (found,) = wb.boundaries(JUDDER, drive_speed=(4.7, 5.0), initial_force=force, **settings)
        (expected,) = wb.boundaries(
            JUDDER.machine,
            **{"brake.base_speed": (-4.7, -5.0), "brake.initial_force": force},
            **settings,
        )
        np.testing.assert_allclose(found["drive_speed"], -expected["brake.base_speed"], rtol=1e-12)
        np.testing.assert_allclose(
            found["initial_force"], expected["brake.initial_force"], rtol=1e-12
        )

    def test_branches_from_a_hopf_point(self) -> None:
        limit = wb.hopf(STRIBECK, "drive_speed", between=(-0.5, -3.0))
        assert limit.value == pytest.approx(HOPF_SPEED, rel=1e-11)
        assert limit.system == STRIBECK.replace(drive_speed=limit.value)
        found = wb.branches(
            limit, drive_speed=(-0.5, -3.0), method="smooth", step=0.1, switch=0, opposite=False
        )
        assert found["bifurcation_kind"].to_numpy()[0] == "Hopf"
        assert found["bifurcation_value"].to_numpy()[0] == pytest.approx(HOPF_SPEED, rel=1e-8)

    @pytest.mark.parametrize(
        "call",
        [
            lambda name: wb.continuation(wb.orbit(JUDDER), {name: (0.0, -1.0)}),
            lambda name: wb.branches(JUDDER, {name: (0.0, -1.0)}),
            lambda name: wb.boundaries(JUDDER, damping=(0.2, 0.7), **{name: (0.0, -1.0)}),
        ],
        ids=["continuation", "branches", "boundaries"],
    )
    def test_names_of_the_machine_are_refused(self, call) -> None:
        with pytest.raises(wb.InputError) as raised:
            call("brake.slope")
        assert "brake.slope" in str(raised.value)

    def test_limit_cycles_are_not_followed_where_a_signal_varies(self) -> None:
        """There they would have the period of the signal."""
        machine = wb.orbit(JUDDER.machine)
        for cycle, name in ((wb.orbit(JUDDER), "amplitude"), (machine, "torque.amplitude")):
            with pytest.raises(wb.InputError) as raised:
                wb.continuation(cycle, {name: (0.0, 50.0)})
            assert raised.value.name == name
        branch = wb.continuation(wb.orbit(JUDDER), drive_speed=(3.0, 6.0))
        (grazing,) = [point for point in branch if point.bifurcation]
        with pytest.raises(wb.InputError) as raised:
            wb.boundary(grazing, drive_speed=(3.0, 6.0), amplitude=(0.0, 50.0))
        assert raised.value.name == "amplitude"

    def test_an_equilibrium_without_a_torque(self) -> None:
        """Its response to a torque begins there: a branch over the amplitude, from zero."""
        sliding = JUDDER.replace(drive_speed=8.0, damping=5.0)
        smoothed = sliding.replace(friction=wb.SmoothedFriction(kinetic=0.3, steepness=100.0))
        for system in (sliding, smoothed):
            found = wb.orbit(system)
            law = system.friction
            friction = 0.2 * 1000.0 * (law.kinetic_at(1.6) if system is sliding else 0.3)
            assert found.angle == pytest.approx(-friction / 4000.0, rel=1e-9)
            assert found.velocity == pytest.approx(0.0, abs=1e-9)
            branch = wb.branches(system, amplitude=(0.0, 1.0), switch=0, opposite=False)
            omega = system.excitation.angular_frequency
            slope = 0.2**2 * 1000.0 * (-0.02 if system is sliding else 0.0)
            wave = 1.0 / (4000.0 - omega**2 + 1j * omega * (5.0 + slope))
            last = float(branch["velocity"].to_numpy()[-1, 0])
            assert last == pytest.approx((1j * omega * wave).imag, rel=1e-8)


def followed(changes: dict[str, Any], **run: Any) -> wb.Study:
    """Write a study to follow."""
    study = wb.Study(wb.paper.system(eta=-15.0).replace(**changes), RunSettings(**run))
    Path("line.toml").write_text(study.to_toml())
    return study


# The controller samples once in a period of the torque.
ROUNDED = {"sample_time": 2.0 * np.pi / 63.0, "resolution": 2.0}


class TestContinue:
    """Branches over the parameters and groups of the driveline."""

    @pytest.mark.parametrize(
        ("changes", "end"),
        [
            pytest.param({"lag": 0.005}, -18.0, marks=pytest.mark.slow),
            ({"excitation": wb.Harmonic(500.0, SYSTEM.excitation.frequency) + 1.0}, -16.5),
        ],
        ids=["lag", "signal"],
    )
    def test_is_that_of_the_machine_over_the_slope(self, changes, end, answer) -> None:
        study = followed(changes, initial=(1e-3, 0.5))
        over = f"--over=eta=-15:{end}"
        told = answer("continue", "line.toml", over, "--switch=0", "--step=0.1", "--out=r.nc")
        slopes = [study.system.replace(eta=eta).actuation.slope for eta in (-15.0, end)]
        machine = study.system.machine.started_at(1e-3, 0.5)
        wanted = wb.branches(machine, {"brake.slope": tuple(slopes)}, switch=0, step=0.1)
        kinds = [one["kind"] for one in told["bifurcations"]]
        assert "period doubling" in kinds
        assert kinds == wanted["bifurcation_kind"].to_numpy().tolist()
        values = wanted["bifurcation_value"].to_numpy() * (-15.0 / slopes[0])
        assert [one["value"] for one in told["bifurcations"]] == pytest.approx(values, rel=1e-8)
        assert told["system"] == study.system.as_dict()
        with xr.open_dataset("r.nc", engine="h5netcdf") as stored:
            assert json.loads(stored.attrs["system"]) == told["system"]
            assert stored["eta"].to_numpy()[0] == -15.0

    def test_pictures_have_simulated_points_beneath(self, run) -> None:
        followed({"lag": 0.005})
        options = ["--over", "eta=-4:-5", "--beneath", "4", "--plot", "r.png"]
        status, _, message = run("continue", "line.toml", *options)
        assert (status, "4 of 4 points" in message) == (0, True)
        assert Path("r.png").read_bytes().startswith(b"\x89PNG")

    def test_limit_cycles_without_a_torque(self, answer) -> None:
        followed(STRIBECK.parts(), method="smooth")
        options = ["--over", "drive_speed=-0.5:-3", "--hopf", "--step=0.1", "--switch=0"]
        told = answer("continue", "line.toml", *options)
        assert told["start"]["value"] == pytest.approx(HOPF_SPEED, rel=1e-11)
        assert {one["motion"] for one in told["branches"]} == {"limit cycle"}

    @pytest.mark.parametrize(
        ("changes", "options", "named"),
        [
            ({"sample_time": 0.0333}, [], "actuation.sample_time = 0.0333"),
            (ROUNDED, [], "actuation.resolution = 2.0"),
            (ROUNDED, [], "--set resolution=none"),
            ({"excitation": wb.Ramp(0.0, 300.0, 0.1)}, [], "error: excitation: "),
            ({"drive_speed": wb.Ramp(0.0, 1.0, 0.1)}, [], "--set drive_speed=NUMBER"),
            (
                {"initial_force": 300.0 + wb.Harmonic(9.0, 11.1)}, [],
                "actuation.initial_force 11.1 Hz",
            ),
            ({"lag": 0.1}, ["--set", "rtol=1e-8"], "run.rtol = 1e-08"),
            ({"lag": 0.1}, ["--set", "slope=-1", "--over", "brake.slope=1:2"], "slope"),
            ({"lag": 0.1}, ["--hopf"], "--hopf"),
        ],
    )  # fmt: skip
    def test_errors_name_the_field_of_the_driveline(self, changes, options, named, run) -> None:
        followed(changes)
        over = [] if "--over" in options else ["--over", "slope=-40:-41"]
        status, text, message = run("continue", "line.toml", *over, *options)
        assert (status, text) == (2, "")
        assert message.startswith("error: ")
        assert named in message


class Curve(wb.SetValuedFriction):
    """Stribeck friction without straight lines."""

    kind = ""

    @property
    def breakaway(self) -> float:
        return 0.4

    def kinetic_at(self, speed: float) -> float:
        return 0.3 + 0.1 * np.exp(-speed / 0.5)


BUILT_IN = wb.StribeckFriction(kinetic=0.3, static=0.4, speed=0.5)


class TestCurves:
    """Laws without straight lines, which only the method smooth of machines solves."""

    LINE = wb.paper.system(eta=-6.0, F0=0.036).replace(
        friction=Curve(), brake=wb.ConventionalBrake(radius=0.2)
    )

    @pytest.mark.parametrize(
        "call",
        [
            lambda line: wb.motion(line, method="exact"),
            lambda line: wb.simulate(line, 1.0, method="exact"),
            lambda line: wb.sweep(line, slope=[-4.0], method="exact"),
        ],
        ids=["motion", "simulate", "sweep"],
    )  # fmt: skip
    def test_the_exact_method_is_refused(self, call) -> None:
        with pytest.raises(wb.InputError) as raised:
            call(self.LINE)
        assert raised.value.name == "friction"
        assert "method='smooth'" in str(raised.value)

    def test_orbits_are_those_of_the_built_in_curve(self) -> None:
        """Their default is the method that takes the law."""
        found = wb.orbit(self.LINE)
        expected = wb.orbit(self.LINE.replace(friction=BUILT_IN), method="smooth")
        assert found.found
        assert found.method == "smooth"
        np.testing.assert_allclose(found.points, expected.points, rtol=1e-7)
        np.testing.assert_allclose(found.multipliers, expected.multipliers, rtol=1e-6)

    @pytest.mark.parametrize("law", [Curve(), BUILT_IN], ids=["curve", "stribeck"])
    def test_the_default_is_smooth_with_a_lag(self, law) -> None:
        line = self.LINE.replace(friction=law, lag=0.02)
        given = {"transient": 20, "periods": 22}
        for call in (lambda **one: wb.simulate(line, 0.5, **one),
                     lambda **one: wb.sweep(line, slope=[-4.0], **given, **one)):  # fmt: skip
            found = call()
            assert found.attrs["method"] == "smooth"
            np.testing.assert_array_equal(found["velocity"], call(method="smooth")["velocity"])

    def test_sweeps_with_the_method_smooth(self) -> None:
        """They are those of the built-in curve."""
        one, other = (
            wb.sweep(line, slope=[-3.0, -2.0], method="smooth", transient=20, periods=22)
            for line in (self.LINE, self.LINE.replace(friction=BUILT_IN))
        )
        assert (other["rms_velocity"] > 0.1).all()
        np.testing.assert_allclose(one["velocity"], other["velocity"], rtol=1e-9)
        # c + R delta mu + R^2 F mu' next to rest, with mu = 0.4 and mu' = -0.1/0.5.
        damping = 0.1 + 0.2 * 0.4 * np.array([-3.0, -2.0]) - 0.2**2 * 300.0 * 0.2
        for swept in (one, other):
            np.testing.assert_allclose(swept["sliding_damping"], damping, rtol=1e-6)
