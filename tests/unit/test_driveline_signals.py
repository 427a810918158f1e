"""Drivelines that are solved as machines: commands, and errors in the names of the driveline."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

import wedgebrake as wb
from wedgebrake.model.study_run import Run

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
def test_the_signals_are_those_of_the_machine(part) -> None:
    system = with_signal(part, REPEATED)
    assert system.signals()[part] is not None
    assert set(system.signals()) == {"excitation", part}
    assert len(system.machine.signals()) == len(system.signals())
    assert (system.plain, SYSTEM.plain) == (False, True)


@pytest.mark.parametrize("part", PARTS)
@pytest.mark.parametrize(
    "call",
    [wb.motion, lambda system: wb.sweep(system, slope=[-40.0, -30.0])],
    ids=["motion", "sweep"],
)
def test_a_record_has_no_steady_motion(part, call) -> None:
    with pytest.raises(wb.InputError) as raised:
        call(with_signal(part, RECORD))
    assert raised.value.name == part
    assert isinstance(raised.value.value, wb.Table)


@pytest.mark.parametrize("part", PARTS)
def test_commands_report_on_the_machine(part, answer, tmp_path) -> None:
    machine = with_signal(part, REPEATED).machine_at(1e-3, -0.5)
    run = Run(duration=0.2, initial=(1e-3, -0.5))
    study = tmp_path / "signals.toml"
    study.write_text(wb.Study(with_signal(part, REPEATED), run).to_toml())
    assert answer("stability", study)["verdict"] == wb.stability(machine).verdict
    told, final = answer("simulate", study), wb.final_state(wb.simulate(machine, 0.2))
    assert told["final"] == {"time": 0.2, "angles": final.angles, "speeds": final.speeds}


def test_the_length_of_a_run_without_a_period_is_asked_for(run, tmp_path) -> None:
    study = tmp_path / "ramp.toml"
    study.write_text(wb.Study(with_signal("excitation", wb.Ramp(0.0, 300.0, 0.1)), Run()).to_toml())
    status, _, error = run("simulate", study)
    assert (status, "run.duration" in error) == (2, True)
    assert run("simulate", study, "--set", "duration=0.1")[0] == 0


@pytest.mark.parametrize("part", PARTS)
def test_a_run_of_the_command_beyond_a_record(part, run, tmp_path) -> None:
    study = tmp_path / "record.toml"
    study.write_text(wb.Study(with_signal(part, RECORD), Run()).to_toml())
    status, _, error = run("simulate", study, "--set", "duration=0.2")
    assert (status, error.startswith(f"error: {part}: ")) == (2, True)


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
@pytest.mark.parametrize(
    ("system", "method", "name"),
    [
        (SYSTEM, "ode14x", "method"),
        (SYSTEM, "exakt", "method"),
        (SMOOTH, None, "friction"),
        (SMOOTH, "smooth", "friction"),
    ],
)
def test_the_method_or_the_law_is_the_obstacle(system, method, name, part) -> None:
    """The signal is not: sweeps, runs and motions of other drivelines take it."""
    changed = with_signal(part, REPEATED, system)
    calls = [
        lambda: wb.sweep(changed, slope=[-40.0, -30.0], method=method),
        lambda: wb.motion(changed, method=method),
        lambda: wb.simulate(changed, 0.1, method=method),
    ]
    for call in calls:
        with pytest.raises(wb.InputError) as raised:
            call()
        assert raised.value.name == name
        assert raised.value.value == (method if name == "method" else system.friction)


def test_the_machine_is_the_way_out_of_a_refused_law() -> None:
    changed = with_signal("excitation", REPEATED, SMOOTH)
    found = wb.motion(changed.machine, transient=2, periods=6)
    assert found.status == "completed"


def test_the_machine_is_the_way_out_of_a_refused_orbit() -> None:
    changed = with_signal("excitation", REPEATED)
    with pytest.raises(wb.InputError) as raised:
        wb.orbit(changed)
    assert raised.value.name == "excitation"
    assert wb.orbit(changed.machine, order=1).period == pytest.approx(0.1)


def followed(changes: dict[str, Any], **run: Any) -> wb.Study:
    """Write a study to follow."""
    study = wb.Study(wb.paper.system(eta=-15.0).replace(**changes), Run(**run))
    Path("line.toml").write_text(study.to_toml())
    return study


class TestContinue:
    """Branches over the parameters and groups of the driveline."""

    @pytest.mark.parametrize(
        "changes",
        [{"lag": 0.005}, {"excitation": wb.Harmonic(500.0, SYSTEM.excitation.frequency) + 1.0}],
        ids=["lag", "signal"],
    )
    def test_is_that_of_the_machine_over_the_slope(self, changes, answer) -> None:
        study = followed(changes, initial=(1e-3, 0.5))
        told = answer("continue", "line.toml", "--over", "eta=-15:-18", "--switch=0", "--out=r.nc")
        slopes = [study.system.replace(eta=eta).actuation.slope for eta in (-15.0, -18.0)]
        machine = study.system.machine_at(1e-3, 0.5)
        wanted = wb.branches(machine, {"brake.slope": tuple(slopes)}, switch=0)
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
        """At the Hopf point the slope of the friction, -0.6 exp(v/0.5), balances the damping."""
        followed({
            "driveline": wb.Driveline(inertia=1.0, damping=0.1, stiffness=1.0, drive_speed=-0.5),
            "brake": wb.ConventionalBrake(radius=1.0),
            "friction": wb.StribeckFriction(kinetic=0.3, static=0.6, speed=0.5),
            "actuation": wb.Actuation(initial_force=1.0),
            "excitation": wb.HarmonicTorque(amplitude=0.0, frequency=1.0),
        }, method="smooth")  # fmt: skip
        options = ["--over", "drive_speed=-0.5:-3", "--hopf", "--step=0.1", "--switch=0"]
        told = answer("continue", "line.toml", *options)
        assert told["start"]["value"] == pytest.approx(-0.5 * np.log(6.0), rel=1e-11)
        assert {one["motion"] for one in told["branches"]} == {"limit cycle"}

    @pytest.mark.parametrize(
        ("changes", "options", "named"),
        [
            ({"sample_time": 0.0333}, [], "actuation.sample_time = 0.0333"),
            ({"sample_time": 0.1, "resolution": 2.0}, [], "actuation.resolution = 2.0"),
            ({"sample_time": 0.1, "resolution": 2.0}, [], "--set resolution=none"),
            ({"excitation": wb.Ramp(0.0, 300.0, 0.1)}, [], "error: excitation: "),
            ({"drive_speed": wb.Ramp(0.0, 1.0, 0.1)}, [], "--set drive_speed=NUMBER"),
            (
                {"initial_force": 300.0 + wb.Harmonic(9.0, 11.1)}, [],
                "actuation.initial_force 11.1 Hz",
            ),
            ({"lag": 0.1}, ["--method", "ode14x"], "run.method = 'ode14x'"),
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


class TestCurves:
    """Laws without straight lines, which only the method smooth of machines solves."""

    LINE = wb.paper.system(eta=-6.0, F0=0.036).replace(
        friction=Curve(), brake=wb.ConventionalBrake(radius=0.2)
    )

    @pytest.mark.parametrize(
        "call",
        [wb.motion, wb.orbit, lambda line: wb.simulate(line, 1.0),
         lambda line: wb.sweep(line, slope=[-4.0])],
        ids=["motion", "orbit", "simulate", "sweep"],
    )  # fmt: skip
    def test_the_exact_method_is_refused(self, call) -> None:
        with pytest.raises(wb.InputError) as raised:
            call(self.LINE)
        assert raised.value.name == "friction"
        assert "method='smooth'" in str(raised.value)

    def test_sweeps_with_the_method_smooth(self) -> None:
        """They are those of the built-in curve."""
        law = wb.StribeckFriction(kinetic=0.3, static=0.4, speed=0.5)
        one, other = (
            wb.sweep(line, slope=[-3.0, -2.0], method="smooth", transient=20, periods=22)
            for line in (self.LINE, self.LINE.replace(friction=law))
        )
        assert (other["rms_velocity"] > 0.1).all()
        np.testing.assert_allclose(one["velocity"], other["velocity"], rtol=1e-9)
        assert np.isnan(one["sliding_damping"]).all()
