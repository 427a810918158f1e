"""``wedgebrake continue``: JSON, text, files, Ctrl-C, and wrong input."""

from __future__ import annotations

import contextlib
import os
import pty
import re
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import wedgebrake as wb
from children import started
from machines import contact
from printed import names, strict_json
from wedgebrake.cli.continue_report import stable_stretches
from wedgebrake.model.studies.study_run import RunSettings
from wedgebrake.orbits.diagram import follow
from wedgebrake.orbits.ranges import make_ranges

PROGRAM = Path(sys.executable).parent / "wedgebrake"
EXAMPLES = Path(__file__).parents[2] / "examples"
PAPER, CONVENTIONAL = EXAMPLES / "paper.toml", EXAMPLES / "conventional.toml"
SYSTEM = wb.load_study(PAPER).system
# A period doubling, with the branch that leaves it: a moment's work.
ETA = ["--over", "eta=-15:-18", "--step", "0.1"]
WIDE = ["--step", "0.1"]
# No bifurcation at all.
PLAIN = ["--over", "eta=-10:-12", "--step", "0.2"]


@pytest.fixture
def report(answer):
    """The JSON of a continuation."""
    return lambda *arguments: answer("continue", *arguments)


class TestJson:
    def test_is_complete_and_holds_the_numbers_of_the_library(self, report):
        told = report(PAPER, *ETA, "--switch", "1", "--step", "0.03")
        assert set(told) == {
            "wedgebrake", "versions", "kind", "method", "system", "groups", "parameter", "range",
            "settings", "answer", "start", "measures", "branches", "bifurcations", "boundaries",
            "speed", "files",
        }  # fmt: skip
        dataset = wb.branches(SYSTEM, eta=(-15.0, -18.0), switch=1, step=0.03)
        assert (told["wedgebrake"], told["kind"]) == (wb.__version__, dataset.attrs["kind"])
        assert told["system"] == SYSTEM.as_dict()
        assert told["method"] == "exact"
        assert told["parameter"]["name"] == "eta"
        assert told["range"] == [-15.0, -18.0]
        assert told["settings"] == {"switch": 1, "step": 0.03, "points": 2000}
        first = wb.orbit(SYSTEM.replace(eta=-15.0))
        assert told["start"]["verdict"] == first.verdict
        assert told["start"]["stable"] is True
        assert [one["order"] for one in told["branches"]] == dataset["branch_order"].values.tolist()
        counts = np.bincount(dataset["branch"].to_numpy())
        assert [one["points"] for one in told["branches"]] == counts.tolist()
        assert [one["end"]["why"] for one in told["branches"]] == [*dataset["branch_end"].values]
        assert told["speed"]["points"] == dataset.sizes["point"]
        values = [one["value"] for one in told["bifurcations"]]
        assert values == pytest.approx(dataset["bifurcation_value"].to_numpy(), rel=1e-9)
        for name in ("kind", "effect", "scenario", "sentence"):
            mine = [one[name] for one in told["bifurcations"]]
            assert mine == dataset[f"bifurcation_{name}"].to_numpy().tolist()
        assert told["boundaries"] is None
        assert told["files"] == {"picture": None, "data": None}

    def test_simulation_agrees_on_where_the_period_doubles(self, report):
        """On either side of the value, what settles from rest has the periods that it says."""
        told = report(PAPER, *ETA)
        [doubling] = [one for one in told["bifurcations"] if one["kind"] == "period doubling"]
        assert doubling["order"] == 1
        assert min(abs(complex(*one) + 1.0) for one in doubling["multipliers"]) < 1e-6
        near = doubling["value"] + np.array([0.1, -0.1])
        settled = wb.bifurcation(SYSTEM, eta=near, transient="auto")
        assert settled["order"].to_numpy().tolist() == [1, 2]
        first, second = told["branches"]
        [stretch] = first["stable"]
        assert (stretch["from"], stretch["to"]) == (-15.0, doubling["value"])
        alone = wb.orbit(SYSTEM.replace(eta=-15.0))
        assert stretch["velocity_amplitude"][0] == pytest.approx(alone.velocity_amplitude)
        assert stretch["stick_share"] == [0.0, 0.0]
        assert second["origin"] == doubling["number"]
        assert second["stable"][0]["from"] == pytest.approx(doubling["value"], rel=1e-9)

    def test_order_and_beginning_are_those_of_the_study_and_its_changes(self, report):
        """At eta = -17 the motion settles to 2T; the synchronous orbit there is unstable."""
        over = ["--over", "eta=-17:-16.5", "--switch", "0", "--step", "0.2"]
        assert report(PAPER, *over)["start"]["order"] == 2
        told = report(PAPER, *over, "--order", "1")["start"]
        assert (told["order"], told["stable"]) == (1, False)
        state = f"initial=[{told['angle'] + 1e-4!r}, {told['velocity']!r}]"
        again = report(PAPER, *over, "--order", "1", "--set", state)["start"]
        assert again["angle"] == pytest.approx(told["angle"], rel=1e-9)

    def test_boundaries_lie_where_the_orbits_of_other_values_bifurcate(self, report):
        """A point of the curve is the doubling found along eta at its F0."""
        told = report(PAPER, *ETA, "--and", "F0=0.033:0.04", "--switch", "0")
        [boundary] = told["boundaries"]
        assert boundary["kind"] == "period doubling"
        assert boundary["bifurcation"] == 0
        assert boundary["points"] == len(boundary["values"]["eta"])
        place = boundary["points"] // 4
        eta, force = (boundary["values"][name][place] for name in ("eta", "F0"))
        assert force != pytest.approx(0.036, rel=1e-3)
        other = report(PAPER, *ETA, "--switch", "0", "--set", f"F0={force!r}")
        assert other["bifurcations"][0]["value"] == pytest.approx(eta, rel=1e-8)


class TestText:
    """The text is that of the data, and its first line answers the question."""

    @pytest.mark.parametrize(
        ("study", "options", "words"),
        [
            (PAPER, ETA, ["its period doubles", "2T-periodic"]),
            (
                PAPER,
                ["--over", "eta=-17:-15", "--order", "1", "--switch", "0", *WIDE],
                ["unstable"],
            ),
            (
                PAPER,
                ["--over", "eta=-18:-17", "--order", "1", "--switch", "0", *WIDE],
                ["unstable"],
            ),
            (
                PAPER,
                ["--over", "F0=0.062:0.057", "--order", "1", *WIDE],
                ["0.0601833457", "Bernardo"],
            ),
            (CONVENTIONAL, ["--over", "slope=-30:-45", *WIDE], ["Neimark-Sacker"]),
        ],
    )
    def test_holds_the_numbers(self, study, options, words, run):
        status, text, _ = run("continue", study, *options)
        told = strict_json(run("continue", study, *options, "--json")[1])
        assert status == 0
        assert text.splitlines()[0] == told["answer"]
        for word in (*words, told["start"]["verdict"]):
            assert word in text
        for one in told["bifurcations"]:
            assert f"{one['value']:.9g}" in text
        for stretch in (one for branch in told["branches"] for one in branch["stable"]):
            assert f"{stretch['from']:.6g} ... {stretch['to']:.6g}" in text

    def test_answer_is_that_of_the_points(self):
        """Between the ends of a stretch all points are stable, and none is just beyond."""
        first = wb.orbit(SYSTEM.replace(eta=-15.0))
        (over,) = make_ranges(SYSTEM, {"eta": (-15.0, -22.0)}, 1)
        for one in follow(first, over, opposite=False):
            inside = np.zeros(len(one.branch.points), dtype=bool)
            for first, last in stable_stretches(one):
                inside[first : last + 1] = True
            for point, stable in zip(one.branch.points, inside, strict=True):
                size = abs(point.multipliers[0])
                assert abs(size - 1.0) < 1e-6 or stable == (size < 1.0)


class TestFiles:
    def test_hold_the_same_numbers(self, run):
        status, text, _ = run("continue", PAPER, *PLAIN, "--out", "r.nc")
        assert status == 0
        assert str(Path("r.nc").resolve()) in text
        wanted = wb.branches(SYSTEM, eta=(-10.0, -12.0), step=0.2)
        with xr.open_dataset("r.nc", engine="h5netcdf") as stored:
            assert stored.attrs["kind"] == wanted.attrs["kind"]
            assert stored.equals(wanted)
        assert names() == ["r.nc"]

    @pytest.mark.parametrize(
        ("options", "points"),
        [
            (PLAIN, 200),
            ([*PLAIN, "--beneath", "0"], None),
            ([*PLAIN, "--beneath", "12"], 12),
            ([*ETA, "--and", "F0=0.035:0.037", "--switch", "0", "--beneath", "3"], 9),
        ],
    )
    def test_pictures_and_the_points_beneath(self, options, points, run):
        status, text, message = run("continue", PAPER, *options, "--plot", "r.png")
        assert status == 0
        assert Path("r.png").read_bytes().startswith(b"\x89PNG")
        assert str(Path("r.png").resolve()) in text
        beneath = "points/s" if points is None else f"{points} of {points} points"
        assert (beneath in message) == (points is not None)

    @pytest.mark.usefixtures("full_disk")
    @pytest.mark.parametrize("option", ["--out", "--plot"])
    def test_the_text_is_printed_where_a_file_fails(self, option, run):
        name = "r.nc" if option == "--out" else "r.png"
        Path(name).write_text("earlier")
        status, text, message = run("continue", PAPER, *PLAIN, option, name)
        assert status == 1
        assert "eta = -10" in text
        assert f"{option} {name}" in message
        assert names() == [name]
        assert Path(name).read_text() == "earlier"

    def test_no_boundary_to_draw(self, run):
        status, text, message = run(
            "continue", PAPER, *PLAIN, "--and", "F0=0.033:0.04", "--plot", "r.png"
        )
        assert status == 2
        assert "eta = -10" in text
        assert "--plot" in message
        assert names() == []


# Options, and what the message must name.
WRONG: list[tuple[list[str], str]] = [
    ([], "--over: not given"),
    ([*ETA, "--over", "F0=0.1:0.2"], "--over: given 2 times"),
    *((["--over", one], f"--over {one}: ") for one in ("eta", "eta=12", "=1:2", "eta=12,-60")),
    (["--over", "eta=12:-60:300"], "--over eta=12:-60:300"),
    (["--over", "eta=3:3"], "--over eta=3:3"),
    (["--over", "eta=a:2"], "'a' is not a number"),
    (["--over", "eta=0:inf"], "'inf' is not a finite number"),
    (["--over", "etta=1:2"], "Did you mean 'eta'?"),
    (["--over", "wrap_angle=1:2"], "of kind 'band'"),
    (["--over", "initial_angle=0:1"], "initial_angle"),
    (["--over", "step=1:2"], "--over step=1:2"),
    (["--over", "driveline.inertia=1:2"], "without its table: inertia"),
    (["--over", "\x1b[1m=1:2"], "'\\x1b[1m"),
    (["--over", "inertia=1:-1"], "--over inertia=1:-1"),
    ([*ETA, "--and", "F1=1:2"], "--and F1=1:2"),
    ([*ETA, "--and", "eta=1:2"], "--and eta"),
    ([*ETA, "--and", "slope=-99:9"], "--and slope"),
    ([*ETA, "--and", "F0=0.04:0.05"], "--and F0=0.04:0.05: must contain 0.036"),
    (["--over", "F0=2:1"], "--over F0: at F0 = 2"),
    (["--over", "eta=12:0", "--order", "3"], "--over eta: at eta = 12"),
    ([*ETA, "--order", "0"], "--order 0"),
    ([*ETA, "--order", "two"], "--order"),
    ([*ETA, "--points", "1"], "--points 1"),
    ([*ETA, "--step", "0"], "--step 0.0"),
    ([*ETA, "--step", "nan"], "--step nan"),
    ([*ETA, "--switch", "-1"], "--switch -1"),
    ([*ETA, "--beneath", "9"], "--beneath 9"),
    ([*ETA, "--beneath", "1", "--plot", "r.png"], "--beneath 1"),
    ([*ETA, "--method", "ode14x"], "wb.paper.ode14x"),
    ([*ETA, "--method", "exakt"], "--method exakt"),
    ([*ETA, "--set", "periods=5"], "--set periods"),
    ([*ETA, "--set", "step=1e-3"], "--set step"),
    ([*ETA, "--set", "limit=9"], "--set limit"),
    ([*ETA, "--set", "start_time=5"], "run.start_time = 5.0"),
    ([*ETA, "--out", "r.txt"], "--out r.txt"),
]  # fmt: skip


@pytest.mark.parametrize("case", range(len(WRONG)), ids=lambda i: WRONG[i][1])
def test_wrong_input(case, run, tmp_path):
    options, named = WRONG[case]
    (tmp_path / "ok.toml").write_text(PAPER.read_text())
    status, text, message = run("continue", "ok.toml", *options)
    assert (status, text) == (2, "")
    assert message.startswith(("error: ", "Usage: ", "Error: "))
    assert "internal" not in message
    assert named in message
    assert names() == ["ok.toml"]


def test_ctrl_c_ends_it_and_nothing_is_written(tmp_path):
    """On a terminal, where progress is seen; steps so small that it would take hours."""
    options = ["--over", "eta=12:-60", "--step", "1e-6", "--points", "1000000", "--out", "r.nc"]
    ours, theirs = pty.openpty()
    process = started(
        [PROGRAM, "continue", PAPER, *options],
        cwd=tmp_path, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=theirs,
    )  # fmt: skip
    os.close(theirs)
    seen = b""
    while b"branch 0 at eta = 1" not in seen:
        seen += os.read(ours, 65536)  # an OSError where the process has ended
    process.send_signal(signal.SIGINT)
    output, _ = process.communicate(timeout=60)
    with contextlib.suppress(OSError):  # so Linux says that the other end is closed
        while True:
            seen += os.read(ours, 65536)
    os.close(ours)
    assert (process.returncode, output) == (1, b"")
    assert b"Traceback" not in seen
    assert b"interrupted" in seen
    assert list(tmp_path.iterdir()) == []


BELT = EXAMPLES / "belt.toml"
SPEED = ["--over", "belt.base_speed=0.5:3"]


TWO = wb.Machine(
    inertias=[wb.Inertia("disc", 0.5), wb.Inertia("hub", 2.0)],
    shafts=[wb.Shaft("disc", "hub", 400.0, 0.5), wb.Shaft("hub", "ground", 900.0, 2.0)],
    contacts=[contact(radius=0.15, friction=0.25, force=40.0)],
    torques=[wb.Torque("hub", wb.Harmonic(20.0, 3.0), name="engine")],
)


class TestMachines:
    def test_limit_cycles_from_the_hopf_point(self, report, run):
        """The numbers are those of the closed forms in test_hopf_branches."""
        told = report(BELT, *SPEED, "--hopf", "--switch", "0", "--step", "0.05")
        machine = wb.load_study(BELT).system
        limit = wb.hopf(machine, "belt.base_speed", between=(0.5, 3.0))
        assert told["method"] == "smooth"
        assert told["start"]["value"] == limit.value
        assert [one["kind"] for one in told["bifurcations"]] == ["Hopf", "grazing-sliding"]
        assert told["bifurcations"][0]["value"] == pytest.approx(0.5 * np.log(10.0), rel=1e-11)
        [branch] = told["branches"]
        assert branch["motion"] == "limit cycle"
        [stable] = branch["stable"]
        assert stable["from"] == told["bifurcations"][1]["value"]
        assert stable["to"] == 0.5
        settled = wb.motion(machine.replace({"mass.speed": 0.5}), method="smooth")
        assert stable["period"][1] == pytest.approx(settled.period, rel=1e-9)
        status, text, _ = run("continue", BELT, *SPEED, "--hopf", "--switch", "0", "--step", "0.05")
        assert status == 0
        assert told["answer"] in text
        assert "period of the torque" not in text

    def test_the_graze_is_followed_and_the_hopf_point_counted(self, report, run):
        """A point of the curve is the graze found along the speed at its friction."""
        along = [*SPEED, "--hopf", "--switch=0", "--step=0.1"]
        told = report(BELT, *along, "--and", "belt.kinetic=0.45:0.55")
        [boundary] = told["boundaries"]
        assert (boundary["kind"], boundary["bifurcation"]) == ("grazing-sliding", 1)
        place = boundary["points"] // 4
        speed, kinetic = (boundary["values"][f"belt.{name}"][place] for name in
                          ("base_speed", "kinetic"))  # fmt: skip
        assert kinetic != pytest.approx(0.5, rel=1e-2)
        other = report(BELT, *along, "--set", f"belt.kinetic={kinetic!r}")
        assert other["bifurcations"][1]["value"] == pytest.approx(speed, rel=1e-7)
        alone = ["--over=belt.base_speed=1.1:1.2", *along[2:]]
        status, text, _ = run("continue", BELT, *alone, "--and", "belt.kinetic=0.499:0.501")
        assert status == 0
        assert re.search(r"^ +1 not followed: .*Hopf", text, re.MULTILINE)

    def test_from_the_motion_that_settles(self, report, run, tmp_path):
        options = [
            "--over=belt.base_speed=0.5:0.6", "--set=mass.speed=0.5", "--method=exact", "--step=0.2"
        ]  # fmt: skip
        told = report(BELT, *options)
        machine = wb.load_study(BELT).system.replace({"mass.speed": 0.5})
        assert told["start"]["period"] == wb.orbit(machine).period
        assert told["branches"][0]["end"]["value"] == 0.6
        status, _, _ = run("continue", BELT, *options, "--plot", "b.png", "--out", "b.nc")
        assert status == 0
        assert (tmp_path / "b.png").stat().st_size > 10_000
        read = xr.load_dataset(tmp_path / "b.nc")
        assert read.attrs["section"] == "crossing"
        assert np.all(np.diff(read["period"]) != 0.0)

    def test_of_several_inertias_the_largest_amplitude_is_meant(self, report, run):
        """That of both inertias, simulated over a period."""
        machine = TWO.replace({"hub.speed": 1.0})
        Path("two.toml").write_text(wb.Study(machine, RunSettings()).to_toml())
        options = ["--over=engine.frequency=3:3.1", "--switch=0", "--step=0.2", "--out=two.nc"]
        told = report("two.toml", *options)
        orbit = wb.orbit(machine)
        response = wb.simulate(orbit.system, orbit.period, initial=orbit.initial)
        halves = {
            name: 0.5 * np.ptp(response["velocity"].sel(inertia=name).to_numpy())
            for name in machine.inertia_names
        }
        low, high = told["branches"][0]["stable"][0]["velocity_amplitude"]
        assert (
            min(abs(low / max(halves.values()) - 1.0), abs(high / max(halves.values()) - 1.0))
            < 1e-3
        )
        assert min(halves.values()) < 0.9 * low
        meant = told["measures"]["velocity_amplitude"]["meaning"]
        with xr.open_dataset("two.nc", engine="h5netcdf") as stored:
            assert stored["velocity_amplitude"].attrs["long_name"] == meant
            drawn = wb.plot(stored, quantity="velocity_amplitude")
            assert meant.partition(", ")[2] in drawn.texts[0].get_text()
            for name in machine.inertia_names:
                drawn = wb.plot(stored, quantity="velocity", inertia=name)
                assert f"shown: {name}" in drawn.texts[0].get_text()
                line = drawn.axes[0].lines[0].get_ydata()
                assert line == pytest.approx(stored["velocity"].sel(inertia=name).to_numpy()[:, 0])
            with pytest.raises(wb.InputError) as refused:
                wb.plot(stored, quantity="velocity_amplitude", inertia="hub")
            assert refused.value.name == "inertia"
        text = run("continue", "two.toml", *options[:3])[1]
        assert "disc, hub" in text

    def test_driven_machines_have_points_beneath(self, run, tmp_path):
        """One of the paper's driveline, as a machine."""
        wb.save_study(
            wb.Study(wb.paper.system(eta=-15.0).machine, RunSettings()), tmp_path / "m.toml"
        )
        over = ["--over", "brake.slope=-1:-2", "--beneath", "4"]
        status, text, _ = run("continue", "m.toml", *over, "--plot", "m.png")
        assert status == 0
        assert "synchronous" in text


# Options for the belt, and what the message must name.
WRONG_OF_MACHINES: list[tuple[list[str], str]] = [
    (["--over", "brake.slope=1:2"], "--over brake.slope=1:2"),
    (["--over", "mass.angle=0:1"], "--over mass.angle=0:1"),
    (["--over", "eta=0:1"], "--over eta=0:1"),
    (["--over", "belt.base_speed=3:4"], "--hopf"),
    (["--over", "belt.base_speed=2:4", "--hopf"], "--hopf: between"),
    ([*SPEED, "--hopf", "--order", "2"], "--order 2"),
    ([*SPEED, "--order", "0"], "--order 0"),
    ([*SPEED, "--method", "ode14x"], "wb.paper.ode14x"),
    ([*SPEED, "--set", "duration=5"], "--set duration"),
    ([*SPEED, "--set", "until=rest"], "--set until"),
    ([*SPEED, "--beneath", "9", "--plot", "r.png"], "--beneath 9"),
    ([*SPEED, "--and", "belt.kinetic=0.6:0.8"], "--and belt.kinetic"),
]


@pytest.mark.parametrize("case", range(len(WRONG_OF_MACHINES)))
def test_wrong_input_of_machines(case, run, tmp_path):
    options, named = WRONG_OF_MACHINES[case]
    status, text, message = run("continue", BELT, *options)
    assert (status, text) == (2, "")
    # Below a notice, if kernels are compiled.
    assert message.splitlines()[-1].startswith("error: ")
    assert named in message
    assert names() == []


def test_only_machines_begin_at_a_hopf_point(run):
    status, _, message = run("continue", PAPER, *PLAIN, "--hopf")
    assert status == 2
    assert "--hopf" in message
