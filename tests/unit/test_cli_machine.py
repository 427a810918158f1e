"""The commands on studies of machines: reports, files, changed values, refusals."""

from __future__ import annotations

import json
import math
import re
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import wedgebrake as wb
from machines import contact, single
from wedgebrake.analysis.linear_stability import speed_limits
from wedgebrake.analysis.responses.contacts import contact_summary
from wedgebrake.analysis.responses.reactions import reaction_summary
from wedgebrake.model.studies.study_run import RunSettings

EXAMPLES = Path(__file__).parents[2] / "examples"
CLUTCH, LINE = EXAMPLES / "clutch.toml", EXAMPLES / "driveline.toml"
BELT, PAPER = EXAMPLES / "belt.toml", EXAMPLES / "paper.toml"
SHORT = ["--set", "duration=1"]


def test_simulate_reports_the_numbers_of_the_library(answer):
    told = answer("simulate", CLUTCH)
    study = wb.load_study(CLUTCH)
    response = wb.simulate(study.system, **study.arguments())
    state = wb.final_state(response)
    assert told["system"] == json.loads(json.dumps(study.system.as_dict()))
    assert told["status"] == "completed"
    assert told["final"] == {"time": state.time, "angles": state.angles, "speeds": state.speeds}
    for name in ("start", "end", "entry", "exit"):
        assert np.array_equal(told["sticks"][name], response[f"stick_{name}"])
    names = response.contact.to_numpy()[response.stick_contact]
    assert told["sticks"]["contact"] == names.tolist()
    assert sum(told["events"].values()) == response.sizes["event"]
    balance = wb.energy(response)
    for name in ("friction_heat", "base_work", "viscous_loss", "torque_work"):
        assert list(told["energy"][name].values()) == balance[name].to_numpy().tolist()
    summary = contact_summary(response)
    for name, one in told["contacts"].items():
        own = summary.sel(contact=name)
        assert one["rest_share"] == own.rest_share.item()
        assert one["sticks"] == own.sticks.item()


def test_simulate_reports_a_stop(answer):
    """The clutch locks and the brake holds; without the brake nothing stops."""
    told = answer("simulate", CLUTCH)["stopping"]
    study = wb.load_study(CLUTCH)
    stop = wb.stopping(wb.simulate(study.system, **study.arguments()), ringdown=0.0)
    assert told["stop_time"] == pytest.approx(float(stop.stop_time), rel=1e-14)
    for name in ("heat", "mean_torque", "peak_torque"):
        expected = dict(zip(stop.contact.to_numpy(), stop[name].to_numpy(), strict=True))
        assert told[name] == pytest.approx(expected, rel=1e-12)
    assert answer("simulate", CLUTCH, "--set", "brake.initial_force=0")["stopping"] is None


def test_the_summary_of_contacts_counts_and_adds_up():
    study = wb.load_study(CLUTCH)
    response = wb.simulate(study.system, duration=3.0)
    clutch, brake = (contact_summary(response).sel(contact=name) for name in ("clutch", "brake"))
    assert (clutch.sticks, brake.sticks) == (3, 1)
    for i, one in enumerate((clutch, brake)):
        own = response.stick_contact.to_numpy() == i
        lengths = (response.stick_end - response.stick_start).to_numpy()[own]
        assert one.rest_time.item() == pytest.approx(lengths.sum())
        assert one.rest_share.item() == pytest.approx(lengths.sum() / 3.0)
        assert one.longest_rest.item() == lengths.max()
        assert one.entered_forward + one.entered_backward == one.sticks
        assert one.final_side == 0
        assert one.rest_from.item() == response.stick_start.to_numpy()[own][-1]
    system = wb.paper.system()
    one, other = (contact_summary(wb.simulate(each, 0.3)) for each in (system, system.machine))
    for name in one.data_vars:
        np.testing.assert_allclose(one[name], other[name], rtol=1e-12, err_msg=str(name))


def test_the_peak_torque_of_a_contact_does_not_depend_on_the_samples():
    """A brake that holds carries the whole torque, whose peak lies between the samples."""
    machine = single(contact(radius=0.1, force=1000.0), torque=wb.Harmonic(5.0, 2.0))
    response = wb.simulate(machine, duration=1.0, times=[0.0, 0.25, 0.5, 1.0])
    assert contact_summary(response).peak_torque.item() == pytest.approx(5.0, rel=1e-12)


def test_the_share_of_rest_of_a_run_that_ends_at_once():
    response = wb.simulate(single(contact(), stiffness=100.0), 10.0, until="rest")
    assert response.attrs["final_time"] == 0.0
    assert contact_summary(response).rest_share.item() == 1.0


def rising(**more):
    """A controller whose output grows by 2 N m/s until it reaches its limit of 3 N m."""
    return wb.Machine(
        inertias=[wb.Inertia("free", 1.0, speed=1.0), wb.Inertia("loaded", 2.0)],
        controllers=[
            wb.Controller(
                "loop", {"free.speed": 1.0}, 2.0, "loaded.torque", integral=2.0,
                limits=(-1.0, 3.0), **more,
            )
        ],
    )  # fmt: skip


@pytest.mark.parametrize(
    ("more", "begin"),
    # The sum after k samples is 0.5 k: the sixth one, at 1.25 s, is at the limit.
    [({}, 1.5), ({"sample_time": 0.25}, 1.25), ({"sample_time": 0.25, "delay": 2}, 1.75)],
)
def test_the_output_of_a_controller_does_not_depend_on_the_samples(more, begin):
    response = wb.simulate(rising(**more), duration=4.0, times=[0.0, 0.1])
    found = reaction_summary(response)
    assert list(found) == ["controllers"]
    loop = found["controllers"]["loop"]
    least = 0.5 if more and not more.get("delay") else 0.0
    assert loop["lowest_output"] == pytest.approx(least, abs=1e-12)
    assert loop["highest_output"] == pytest.approx(3.0, rel=1e-12)
    assert loop["time_at_limits"] == pytest.approx(4.0 - begin, rel=1e-9)
    assert loop["final_output"] == 3.0


def test_torques_of_joints_and_driven_bodies_do_not_depend_on_the_samples():
    """A gear with J = 1 and 2 kg m^2: of a torque T on b, r J_a T/(r^2 J_a + J_b) is on a."""
    ratio, torque, damping = 3.0, 5.0, 0.7
    machine = wb.Machine(
        inertias=[
            wb.Inertia("a", 1.0), wb.Inertia("b", 2.0), wb.Driven("end", wb.Harmonic(4.0, 0.5))
        ],
        shafts=[wb.Shaft("end", "ground", stiffness=0.0, damping=damping)],
        joints=[wb.Gear("a", "b", ratio, name="gear")],
        torques=[wb.Torque("b", wb.Harmonic(torque, 1.0), name="drive")],
    )  # fmt: skip
    found = reaction_summary(wb.simulate(machine, duration=2.0, times=[0.0, 1.0]))
    assert found["joints"]["gear"]["peak_torque"] == pytest.approx(
        ratio * torque / (ratio**2 + 2.0), rel=1e-12
    )
    assert found["driven"]["end"]["peak_torque"] == pytest.approx(4.0 * damping, rel=1e-12)
    assert reaction_summary(wb.simulate(single(contact()), 0.1)) == {}
    assert reaction_summary(wb.simulate(machine, duration=0.0)) == {}


@pytest.mark.parametrize(
    ("name", "kind", "part", "said"),
    [
        ("torque_control", "controllers", "loop", "output from 0 to 1500 N, 1500 N at the end"),
        ("shift", "joints", "gear", "torque up to 80 N m"),
    ],
)
def test_simulate_reports_controllers_and_joints(answer, run, name, kind, part, said):
    """The turbine takes 20 N m (0.2 kg m^2 at 100 rad/s^2) of 100 N m, the gear the rest."""
    path = EXAMPLES / f"{name}.toml"
    study = wb.load_study(path)
    response = wb.simulate(study.system, **study.arguments())
    assert answer("simulate", path)[kind] == reaction_summary(response)[kind]
    _, text, _ = run("simulate", path)
    assert f"  {part}: {said}" in text


def test_simulate_names_every_contact_in_its_text(run):
    status, text, _ = run("simulate", CLUTCH)
    assert status == 0
    for name in ("clutch", "brake", "load", "plate", "engine"):
        assert name in text


def test_simulate_writes_picture_and_data(run, tmp_path):
    status, _, _ = run("simulate", LINE, *SHORT, "--plot", "line.png", "--out", "line.nc")
    assert status == 0
    assert (tmp_path / "line.png").stat().st_size > 10_000
    read = xr.load_dataset(tmp_path / "line.nc")
    study = wb.load_study(LINE)
    again = wb.simulate(study.system, duration=1.0)
    assert np.array_equal(read.velocity, again.velocity)
    assert wb.final_state(read) == wb.final_state(again)
    assert wb.energy(read).residual.item() == wb.energy(again).residual.item()


def test_values_are_set_by_dotted_name(answer):
    changes = {"brake.slope": -40.0, "disc.inertia": 1.2, "disc-vehicle.stiffness": 3e4}
    options = [word for name, value in changes.items() for word in ("--set", f"{name}={value}")]
    told = answer("simulate", LINE, *SHORT, *options)
    machine = wb.load_study(LINE).system.replace(changes)
    assert told["system"] == json.loads(json.dumps(machine.as_dict()))
    assert told["final"]["time"] == 1.0


@pytest.mark.parametrize(
    ("change", "near"),
    [("slope=-40", ""), ("brake.slop=-40", "slope"), ("disk.inertia=1", "disc"),
     ("disc.inertia=-1", "disc.inertia"), ("disc.inertia=x", "disc.inertia"), ("brake=3", "brake"),
     ("initial=[0.0, 1.0]", "initial"), ("durtion=3", "duration"), ("brake.slope", "brake.slope")],
)  # fmt: skip
def test_wrong_changes_are_refused(change, near, run):
    """With a name that is meant, perhaps."""
    status, text, message = run("simulate", LINE, "--set", change)
    assert (status, text) == (2, "")
    assert message.startswith("error: --set")
    assert near in message


def test_a_change_given_twice_is_refused(run):
    assert run("simulate", LINE, "--set", "disc.speed=1", "--set", "disc.speed=2")[0] == 2


@pytest.mark.parametrize("setting", ["transient=3", "limit=7", "keep_points=false"])
def test_settings_of_sweeps_are_refused_where_they_do_nothing(setting, run):
    """Also in ``continue``."""
    for order in (["simulate", PAPER], ["simulate", LINE], ["stability", LINE],
                  ["continue", BELT, "--over", "belt.base_speed=0.5:1"]):  # fmt: skip
        assert run(*order, "--set", setting)[:2] == (2, "")


@pytest.mark.parametrize("study", [PAPER, LINE])
@pytest.mark.parametrize("setting", ["method=exact", "duration=3", "start_time=1", "periods=3"])
def test_stability_refuses_the_settings_of_a_run(study, setting, run):
    """Settings of a run have no effect on linear stability."""
    status, text, message = run("stability", study, "--set", setting)
    assert (status, text) == (2, "")
    assert setting.partition("=")[0] in message


@pytest.mark.parametrize("study", [PAPER, LINE])
@pytest.mark.parametrize("name", ["foo", "perids", "folow"])
def test_stability_suggests_names_that_it_takes(study, name, run):
    """Neither settings of the run nor of sweeps, which it refuses."""
    status, text, message = run("stability", study, "--set", f"{name}=3")
    assert (status, text) == (2, "")
    system = wb.load_study(study).system
    suggested = re.findall(r"'([\w.]+)'", message)
    assert set(suggested) <= set(system.names())
    assert not re.search(r"\b(periods|follow|transient)\b", message)


def test_a_run_until_rest_tells_whether_it_reached_rest(answer):
    """The clutch machine stops: not within a time before its stop, but later."""
    end = answer("simulate", CLUTCH)["stopping"]["stop_time"]
    until = ["simulate", CLUTCH, "--set", "until=rest", "--set"]
    early, late = (answer(*until, f"duration={factor * end}") for factor in (0.5, 4.0))
    plain = answer("simulate", CLUTCH, "--set", f"duration={0.5 * end}")
    assert (early["at_rest"], late["at_rest"]) == (False, True)
    assert early["final"] == plain["final"]
    assert early["message"] not in (plain["message"], late["message"])
    response = wb.simulate(wb.load_study(CLUTCH).system, 0.5 * end, until="rest")
    assert response.attrs["message"] == early["message"]
    assert not response.attrs["at_rest"]


def test_the_way_out_of_a_refused_signal_works(run, answer):
    """A sweep of signals that do not repeat names the options that make them constant."""
    order = ["sweep", LINE, "--over", "vehicle.inertia=39,40", "--transient=1", "--crossings=2"]
    status, _, message = run(*order)
    options = re.findall(r"--set ([\w.]+)=NUMBER", message)
    assert (status, len(options)) == (2, 2)
    constant = [word for name in options for word in ("--set", f"{name}=1")]
    assert answer(*order, *constant)["points"] == 2


def test_stability_reports_modes(answer, run):
    told = answer("stability", LINE)
    found = wb.stability(wb.load_study(LINE).system)
    case = told["cases"][told["critical"]]
    assert told["stable"] == found.stable
    assert [one["frequency"] for one in case["modes"]] == [one.frequency for one in found.modes]
    assert told["inertias"] == ["engine", "gearbox", "disc", "vehicle"]
    status, text, _ = run("stability", LINE)
    assert status == 0
    assert found.verdict in text


def test_simulate_reports_the_class_of_a_steady_motion(answer):
    told = answer("simulate", BELT, "--set", "duration=20")["motion"]
    found = wb.motion(wb.load_study(BELT).system, method="smooth")
    assert (told["kind"], told["stick_class"]) == (found.kind, found.stick_class)
    assert told["period"] == pytest.approx(found.period, rel=1e-9)
    assert answer("simulate", LINE, *SHORT)["motion"] is None  # its signals do not repeat
    assert answer("simulate", CLUTCH)["motion"] is None  # it has stopped


class TestSweep:
    """``wedgebrake sweep`` of machines and of self-excited drivelines."""

    SPEEDS = ("--over", "belt.base_speed=0.4:1.9:4")

    def test_without_contacts_there_are_no_sticks(self, answer, run, tmp_path):
        path = tmp_path / "disc.toml"
        path.write_text(
            'inertia = [{name = "disc", inertia = 1.0, speed = 3.0}]\n'
            'shaft = [{a = "disc", b = "ground", stiffness = 8.0}]\n'
        )
        options = ["sweep", path, "--over", "disc.inertia=0.5,2"]
        told = answer(*options)
        assert told["motion"] == {"free vibration": 2}
        assert (told["stick_slip"], told["contacts"]) == ({}, None)
        assert "tick-slip" not in run(*options)[1]

    def test_reports_the_numbers_of_the_library(self, answer, run, tmp_path):
        told = answer("sweep", BELT, *self.SPEEDS, "--out", "belt.nc")
        found = wb.bifurcation(
            wb.load_study(BELT).system, {"belt.base_speed": np.linspace(0.4, 1.9, 4)},
            method="smooth",
        )  # fmt: skip
        axis = told["axes"]["belt.base_speed"]
        assert axis["values"] == found["belt.base_speed"].to_numpy().tolist()
        assert (axis["dimension"], axis["unit"]) == ("belt.base_speed", "rad/s")
        # Sliding at a constant speed is stable above ln(10)/2 (docs/machines.md, "Class of motion,
        # sweeps and basins").
        assert told["motion"] == {"limit cycle": 2, "steady sliding": 2}
        cycles = found.motion_period.to_numpy()[:2]
        assert told["motion_period"] == {"min": cycles.min(), "max": cycles.max()}
        assert [one["motion"] for one in told["intervals"]] == ["limit cycle", "steady sliding"]
        assert told["returns"] == "crossings"
        with xr.load_dataset(tmp_path / "belt.nc") as read:
            assert read.equals(found)
        status, text, _ = run("sweep", BELT, *self.SPEEDS)
        assert status == 0
        assert "crossings" in text
        assert "periods" not in text

    def test_takes_the_axes_of_the_study(self, answer):
        told = answer("sweep", BELT, "--transient", "5", "--crossings", "9", "--set", "limit=50")
        assert told["points"] == wb.load_study(BELT).sweep.parameters()["belt.base_speed"].size
        assert (told["protocol"]["transient"], told["protocol"]["periods"]) == (5, 9)

    def test_counts_the_classes_of_each_contact(self, answer, tmp_path):
        """A belt on which a mass vibrates, beside a mass that is held."""
        study = wb.load_study(BELT)
        (belt,) = study.system.contacts
        two = study.changed(
            inertias=[*study.system.inertias, wb.Inertia("other", 1.0)],
            contacts=[belt, belt.model_copy(update={"a": "other", "name": "held", "base_speed":
                                                    wb.Constant(0.0)})],
        )  # fmt: skip
        wb.save_study(two, tmp_path / "two.toml")
        told = answer("sweep", tmp_path / "two.toml", "--over", "belt.base_speed=0.4,0.6")
        assert told["contacts"] == {
            "belt": {"unidirectional stick-slip": 2},
            "held": {"at rest": 2},
        }
        assert told["stick_slip"] == {"unidirectional stick-slip": 2}

    def test_of_initial_conditions_are_basins(self, answer):
        told = answer("sweep", BELT, "--over", "mass.angle=0,1", "--over", "mass.speed=0.5,-0.2")
        assert told["kind"] == "basins"
        assert [one["motion"] for one in told["attractors"]] == ["limit cycle"]

    def test_follows_a_neighbour(self, answer):
        """Below the Hopf point stable sliding and a limit cycle coexist."""
        told = answer("sweep", BELT, "--over", "belt.base_speed=1:1.4:2", "--follow",
                      "belt.base_speed")  # fmt: skip
        assert {one["branch"] for one in told["intervals"]} == {"up", "down"}

    def test_of_a_self_excited_driveline(self, answer, run, tmp_path):
        study = tmp_path / "turning.toml"
        text = PAPER.read_text().replace("[excitation]", "[excitation]\namplitude = 0.0")
        study.write_text(re.sub("(?m)^F0 = .*$", "", text))
        options = ("--set", "drive_speed=2", "--over", "slope=-6,-2,2")
        told = answer("sweep", study, *options)
        assert told["motion"] == {"limit cycle": 2, "steady sliding": 1}
        (limit,) = told["linear_stability"]["limits"]
        system = wb.load_study(study).system.replace(drive_speed=2.0)
        assert limit["value"] == pytest.approx(wb.stability(system).forward.hopf_slope, rel=1e-9)
        assert "crossings" in run("sweep", study, *options)[1]
        assert run("sweep", study, *options, "--periods", "50")[0] == 2

    @pytest.mark.parametrize(
        "options",
        [
            (*SPEEDS, "--periods", "50"),
            ("--over", "base_speed=0.4:1.6:4"),
            ("--over", "belt.base_sped=0.4:1.6:4"),
            ("--over", "eta=-4:0:4"),
            (*SPEEDS, "--set", "duration=3"),
            (*SPEEDS, "--follow", "belt.kinetic"),
            (*SPEEDS, "--crossings", "0"),
        ],
    )
    def test_refuses_what_does_not_fit(self, options, run):
        status, text, message = run("sweep", BELT, *options)
        assert (status, text) == (2, "")
        assert message.startswith("error: ")
        assert message.count("\n") == 1

    def test_needs_signals_that_repeat(self, run):
        assert run("sweep", LINE, "--over", "brake.slope=-40:0:4")[0] == 2


def test_orbits_need_signals_with_a_common_period(run):
    status, text, message = run("continue", LINE, "--over", "brake.slope=-40:0")
    assert (status, text) == (2, "")
    assert message.startswith("error: ")
    assert message.count("\n") == 1


class TestFunctions:
    """Functions for one inertia refuse the responses of machines."""

    MACHINE = wb.load_study(CLUTCH).system

    @pytest.mark.parametrize("call", [wb.sticks, wb.brake_torque, wb.spectrum, wb.poincare])
    def test_refuse_them(self, call):
        with pytest.raises(wb.InputError):
            call(wb.simulate(self.MACHINE, duration=0.1))

    def test_energy_of_a_window_is_the_rest_of_the_whole(self):
        first, whole = (wb.simulate(self.MACHINE, duration=one) for one in (0.05, 0.1))
        parts = wb.energy(first), wb.energy(whole, start=0.05)
        for name in ("friction_heat", "viscous_loss", "torque_work", "stored_change"):
            total = wb.energy(whole)[name]
            np.testing.assert_allclose(parts[0][name] + parts[1][name], total, atol=1e-10)
        with pytest.raises(wb.InputError, match=r"^start = 0\.2"):
            wb.energy(whole, start=0.2)


def test_sweeps_take_parameters_as_a_mapping():
    system, how = wb.paper.system(eta=-6), {"periods": 60, "transient": 50}
    found = wb.sweep(system, {"slope": [-3.0, -2.0]}, **how)
    assert found.identical(wb.sweep(system, slope=[-3.0, -2.0], **how))
    for wrong in (3, {"slope": [1.0], "damping": [1.0]}):
        with pytest.raises(wb.InputError):
            wb.sweep(system, wrong, slope=[-3.0], **how)


DRAWN = ("belt", "clutch", "electronic_wedge", "paper")


@pytest.mark.parametrize(
    "example",
    [
        pytest.param(one, id=one.stem, marks=() if one.stem in DRAWN else pytest.mark.slow)
        for one in sorted(EXAMPLES.glob("*.toml"))
    ],
)
def test_stability_of_each_example_is_drawn(run, tmp_path, monkeypatch, example):
    """Over the default range of speeds, with fewer of them."""
    for count in ("_COUNT", "_FEW"):
        monkeypatch.setattr(speed_limits, count, 3)
    picture = tmp_path / "limits.png"
    assert run("stability", example, "--plot", picture)[0] == 0
    assert picture.stat().st_size > 0


def test_speeds_without_a_picture_are_refused(run):
    status, _, error = run("stability", BELT, "--speeds", "1:2:3")
    assert (status, "--speeds" in error) == (2, True)


@pytest.mark.parametrize("axes", [["eta=-60:12:50000"], ["eta=-60:12:500", "F0=0.01:0.2:500"]])
def test_a_quantity_without_a_picture_is_refused_before_the_sweep(run, tmp_path, axes):
    over = [word for one in axes for word in ("--over", one)]
    wrong = "motion" if len(axes) == 1 else "response"
    picture = tmp_path / "sweep.png"
    status, _, error = run("sweep", PAPER, *over, "--quantity", wrong, "--plot", picture)
    assert (status, "--quantity" in error, picture.exists()) == (2, True, False)


def test_stability_with_a_contact_that_sticks(answer, run, tmp_path):
    """J = 1 and 1 joined by a clutch, and 10 behind a spring of 1000 N m/rad."""
    study = tmp_path / "clutch.toml"
    machine = wb.Machine(
        inertias=[wb.Inertia("engine", 1.0), wb.Inertia("plate", 1.0), wb.Inertia("load", 10.0)],
        shafts=[wb.Shaft("plate", "load", stiffness=1000.0)],
        contacts=[
            wb.Contact(
                "engine", "plate", name="clutch", brake=wb.ConventionalBrake(radius=0.2),
                friction=wb.CoulombFriction(kinetic=0.3),
                actuation=wb.Actuation(initial_force=300.0),
            )
        ],
    )  # fmt: skip
    wb.save_study(wb.Study(machine, RunSettings(duration=1.0)), study)
    told = answer("stability", study)
    frequencies = [told["held"]["modes"][0]["frequency"]]
    sticking = answer("stability", study, "--sticking", "clutch")
    frequencies.append(sticking["cases"][0]["modes"][0]["frequency"])
    assert frequencies == pytest.approx([math.sqrt(600.0) / math.tau] * 2, rel=1e-12)
    assert told["cases"][0]["modes"][0]["frequency"] == pytest.approx(
        math.sqrt(1100.0) / math.tau, rel=1e-12
    )
    _, text, _ = run("stability", study)
    assert "5.27857 Hz" in text
    assert "3.89848 Hz" in text
    status, _, message = run("stability", study, "--sticking", "cluch")
    assert status == 2
    assert "clutch" in message
    assert run("stability", PAPER, "--sticking", "clutch")[0] == 2


DRIVEN = """
inertia = [{ name = "block", inertia = 1.0 }, { name = "fan", inertia = 0.1 }]
driven = [{ name = "end", speed = { kind = "harmonic", amplitude = 3.0, frequency = 1.0 } }]
shaft = [
  { a = "block", b = "end", name = "spring", stiffness = 80.0, damping = 0.5 },
  { a = "fan", b = "block", name = "hub", stiffness = 400.0, damping = 0.5 },
]
drag = [{ on = "fan", name = "air", linear = 0.5 }]

[[contact]]
a = "block"
name = "floor"
brake = { kind = "conventional", radius = 0.2 }
friction = { kind = "coulomb", kinetic = 0.3 }
actuation = { initial_force = 20.0 }
"""


def test_drag_has_neither_sticks_nor_a_force(answer, run, tmp_path):
    study = tmp_path / "driven.toml"
    study.write_text(DRIVEN)
    told = answer("simulate", study, *SHORT)
    by_name = dict(line.split(": ", 1) for line in told["summary"])
    assert "reversal" in by_name["floor"]
    assert not re.search("slide|stick|rest|reversal", by_name["air"])
    forces = answer("stability", study)["cases"][0]["forces"]
    assert forces == {"floor": 20.0, "air": None}
    (line,) = (one for one in run("stability", study)[1].splitlines() if "Actuation" in one)
    assert "floor 20 N" in line
    assert "air" not in line


def test_amplitudes_of_a_branch_are_those_of_bodies_that_move_freely(run, tmp_path):
    study = tmp_path / "driven.toml"
    study.write_text(DRIVEN)
    text = run("continue", study, "--over", "end.speed.amplitude=3:2.8", "--method", "smooth")[1]
    (line,) = (one for one in text.splitlines() if "are the largest of all inertias" in one)
    assert "block" in line
    assert "end" not in line
