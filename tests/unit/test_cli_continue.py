"""``wedgebrake continue``: help, words, JSON, files, Ctrl-C, and wrong input."""

from __future__ import annotations

import os
import pty
import re
import resource
import select
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import wedgebrake as wb
from children import started
from printed import names, unwrapped
from wedgebrake.cli.continue_report import answer, stable_stretches
from wedgebrake.orbits.diagram import follow
from wedgebrake.orbits.problem import make_ranges

PROGRAM = Path(sys.executable).parent / "wedgebrake"
EXAMPLES = Path(__file__).parents[2] / "examples"
PAPER, CONVENTIONAL = EXAMPLES / "paper.toml", EXAMPLES / "conventional.toml"
SYSTEM = wb.load_study(PAPER).system
# A period doubling, with the branch that leaves it: a moment's work.
ETA = ["--over", "eta=-15:-18"]
# No bifurcation at all.
PLAIN = ["--over", "eta=-10:-12"]


@pytest.fixture
def report(answer):
    """The JSON of a continuation."""
    return lambda *arguments: answer("continue", *arguments)


class TestHelp:
    def test_is_complete(self, run):
        status, text, message = run("continue", "--help")
        assert (status, message) == (0, "")
        assert text.startswith("Usage: wedgebrake continue")
        for word in (
            "--over NAME=FROM:TO", "--and NAME=FROM:TO", "--set NAME=VALUE", "initial=[0.01, 0.0]",
            "--method NAME", "--order N", "--switch N", "default: 2", "--step SHARE", "0.02",
            "--points N", "--beneath N", "200", "--out DATA.nc", "netCDF", "--plot PICTURE.png",
            ".png, .svg or .pdf", "--json", "stable or not", "period doublings", "friction",
            "Exit status 2", "exit status 1", "Ctrl-C", "Examples:",
        ):  # fmt: skip
            assert word in unwrapped(text), word
        options = text.partition("Options:")[2].partition("Examples:")[0]
        for line in re.findall(r"^  (-.*(?:\n {6,}.*)*)", options, re.MULTILINE):
            assert len(unwrapped(line).split()) >= 4, line
        assert max(map(len, text.splitlines())) <= 80
        assert run("continue", "-h") == (0, text, "")
        assert "what comes then?" in unwrapped(run("--help")[1])

    def test_its_examples_work(self, run, tmp_path):
        shutil.copytree(EXAMPLES, tmp_path, dirs_exist_ok=True)
        text = unwrapped(run("continue", "--help")[1]).partition("Examples: ")[2]
        examples = [one.strip().removeprefix("wedgebrake ").split() for one in text.split(";")]
        assert len(examples) == 3
        for example in examples:
            assert run(*example)[0] == 0

    def test_costs_little(self):
        """At most 0.5 s of CPU, warm: the best of three."""
        costs = []
        for _ in range(3):
            before = resource.getrusage(resource.RUSAGE_CHILDREN)
            subprocess.run(
                [PROGRAM, "continue", "--help"], stdout=subprocess.DEVNULL, check=True, timeout=60
            )
            after = resource.getrusage(resource.RUSAGE_CHILDREN)
            costs.append(after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)
        assert min(costs) < 0.5, costs


class TestJson:
    def test_is_complete_and_holds_the_numbers_of_the_library(self, report):
        told = report(PAPER, *ETA, "--switch", "1", "--step", "0.03")
        assert set(told) == {
            "wedgebrake", "versions", "kind", "method", "system", "groups", "parameter", "range",
            "settings", "answer", "start", "branches", "bifurcations", "boundaries", "speed",
            "files",
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
        over = ["--over", "eta=-17:-16.5", "--switch", "0"]
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


class TestWords:
    def test_first_line_answers(self, run):
        status, text, message = run("continue", PAPER, *ETA)
        assert status == 0
        lines = text.splitlines()
        value = re.fullmatch(
            r"From eta = -15 on, the synchronous motion is stable down to eta = (-16\.\d+); there"
            r" its period doubles\. The 2T-periodic motion that branches off is stable to eta ="
            r" -18\.",
            lines[0],
        )[1]
        for words in (
            "\n\nWedge brake, Coulomb friction: f = 0.63, F0 = 0.036, alpha = 1.18\n",
            "\nFollowed: eta from -15 to -18 (slope of the actuation force",
            "\nBegin, at eta = -15: synchronous orbit, stable: multipliers ",
            "\n  1  synchronous: begins at eta = -15 (begin of the range), ends at -18 (left the",
            f"\n     stable for eta = -15 ... {value}  (velocity amplitude ",
            "rad/s, brake torque up to 333.3 N m)\n",
            "\n  No other branch begins at eta = -18: what settles there is on one of these",
            "\n  Stable: small disturbances die out. Other motions may live beside",
            f"\n  2  2T-periodic: begins at eta = {value} (period doubling of branch 1), ends at",
            "\nIn words:\n  period doubling: an orbit of twice the period branches off",
        ):
            assert words in text, words
        assert re.search(rf"\n  1 +{value}\d+ +period doubling +synchronous\n", text)
        assert re.search(r"\n\d+ orbits in \S+ s", text)
        assert "di Bernardo" not in text
        assert re.search(r"\d+ orbits of 2 branches", message.splitlines()[-1])

    def test_nothing_bifurcates(self, run):
        _, text, _ = run("continue", PAPER, *PLAIN)
        assert text.startswith(
            "From eta = -10 on, the synchronous motion is stable to eta = -12.\n"
        )
        assert "\nBifurcations: none\n" in text
        assert "In words" not in text

    def test_upwards_from_an_unstable_orbit(self, run):
        _, text, _ = run(
            "continue", PAPER, "--over", "eta=-17:-15", "--order", "1", "--switch", "0"
        )
        assert re.match(
            r"At eta = -17 the synchronous motion is unstable; on its branch it is stable from eta"
            r" = -16\.\d+ to -15\.\n",
            text,
        )
        _, text, _ = run(
            "continue", PAPER, "--over", "eta=-18:-17", "--order", "1", "--switch", "0"
        )
        assert text.startswith(
            "From eta = -18 on, the synchronous motion is unstable to eta = -17.\n"
        )
        assert "\n     nowhere stable\n" in text

    def test_bifurcations_of_friction_are_explained_with_their_source(self, run):
        _, text, _ = run("continue", PAPER, "--over", "F0=0.062:0.057", "--order", "1")
        assert re.search(r"\n  1 +0\.0601833457 +switching-sliding +synchronous +persistence", text)
        assert "\n  switching-sliding: the begin of a stick meets" in text
        assert "di Bernardo, C. J. Budd, A. R. Champneys and P. Kowalczyk" in text
        assert "(2008)" in text

    def test_a_torus_of_the_conventional_brake(self, run):
        _, text, _ = run("continue", CONVENTIONAL, "--over", "slope=-30:-45")
        assert re.match(
            r"From slope = -30 on, the synchronous motion is stable down to slope = -38\.\d+;"
            r" there a second frequency sets in \(Neimark-Sacker\)\.\n",
            text,
        )
        assert "from -30 to -45 N s/rad" in text

    def test_boundaries(self, run):
        _, text, _ = run("continue", PAPER, *ETA, "--and", "F0=0.033:0.04", "--switch", "0")
        assert "\nBoundaries over eta, F0: 1 (--json has their points)\n" in text
        assert re.search(
            r"\n  period doubling, synchronous: from \(eta, F0\) = \(-16\.9\d+, 0\.033\) \(left the"
            r" range of F0\) to \(-15\.69\d+, 0\.04\) \(left the range of F0\)\n",
            text,
        )

    def test_answer_is_that_of_the_points(self):
        """Between the ends of a stretch all points are stable, and none is just beyond."""
        first = wb.orbit(SYSTEM.replace(eta=-15.0))
        (over,) = make_ranges(SYSTEM, {"eta": (-15.0, -22.0)}, 1)
        followed = follow(first, over, opposite=False)
        assert {one.branch.points[-1].order for one in followed} == {1, 2}
        for one in followed:
            inside = np.zeros(len(one.branch.points), dtype=bool)
            for first, last in stable_stretches(one):
                inside[first : last + 1] = True
            for point, stable in zip(one.branch.points, inside, strict=True):
                on_circle = abs(abs(point.multipliers[0]) - 1.0) < 1e-6
                assert on_circle or stable == (abs(point.multipliers[0]) < 1.0)
        assert answer("eta", followed).endswith(
            "; there a second frequency sets in (Neimark-Sacker)."
        )


class TestFiles:
    def test_hold_the_same_numbers(self, run):
        status, text, _ = run(
            "continue", PAPER, *ETA, "--out", "r.nc", "--plot", "r.svg", "--beneath", "20"
        )
        assert status == 0
        assert text.endswith(
            f"Picture: {Path('r.svg').resolve()}\nData: {Path('r.nc').resolve()}\n"
        )
        wanted = wb.branches(SYSTEM, eta=(-15.0, -18.0))
        with xr.open_dataset("r.nc", engine="h5netcdf") as stored:
            assert set(stored.variables) == set(wanted.variables)
            for name in wanted.variables:
                assert stored[name].dims == wanted[name].dims
                numbers = wanted[name].dtype.kind == "f"
                mine, other = stored[name].to_numpy(), wanted[name].to_numpy()
                assert np.array_equal(mine, other, equal_nan=numbers), name
            for name in ("kind", "parameter", "method", "system"):
                assert stored.attrs[name] == wanted.attrs[name]
            assert stored["velocity"].attrs["units"] == "rad/s"
        assert Path("r.svg").read_text().startswith("<?xml")
        assert names() == ["r.nc", "r.svg"]

    @pytest.mark.parametrize(
        ("options", "points"),
        [
            (ETA, 200),
            ([*ETA, "--beneath", "0"], None),
            ([*ETA, "--beneath", "12"], 12),
            ([*ETA, "--and", "F0=0.033:0.04"], None),
            ([*ETA, "--and", "F0=0.033:0.04", "--beneath", "4"], 16),
        ],
    )
    def test_pictures_and_what_is_simulated_beneath(self, options, points, run):
        status, text, message = run("continue", PAPER, *options, "--plot", "r.png")
        assert status == 0
        assert Path("r.png").read_bytes().startswith(b"\x89PNG")
        assert text.endswith(f"Picture: {Path('r.png').resolve()}\n")
        if points is None:
            assert "points/s" not in message
        else:
            assert f"{points} of {points} points" in message

    def test_nothing_is_simulated_without_a_picture(self, run):
        assert "points/s" not in run("continue", PAPER, *PLAIN)[2]

    @pytest.mark.usefixtures("full_disk")
    @pytest.mark.parametrize("option", ["--out", "--plot"])
    def test_the_words_are_said_where_a_file_fails(self, option, run):
        name = "r.nc" if option == "--out" else "r.png"
        Path(name).write_text("earlier")
        status, text, message = run("continue", PAPER, *PLAIN, option, name)
        assert status == 1
        assert text.startswith("From eta = -10 on")
        assert name not in text
        assert "no space left" in message
        assert names() == [name]
        assert Path(name).read_text() == "earlier"

    def test_no_boundary_to_draw(self, run):
        status, text, message = run(
            "continue", PAPER, *PLAIN, "--and", "F0=0.033:0.04", "--plot", "r.png"
        )
        assert status == 2
        assert "\nBoundaries: none" in text
        assert message.splitlines()[-1].startswith("error: --plot: there is no boundary to draw")
        assert names() == []


# What is wrong: (the arguments, what the message must say).
WRONG: dict[str, tuple[list[str], list[str]]] = {
    "nothing to follow": ([], ["--over: not given", "--over eta=12:-60"]),
    "two parameters": ([*ETA, "--over", "F0=0.1:0.2"], ["--over: given 2 times", "--and"]),
    "no ends": (["--over", "eta"], ["--over eta: must be NAME=FROM:TO"]),
    "no end": (["--over", "eta=12"], ["--over eta=12: must be NAME=FROM:TO"]),
    "no name": (["--over", "=1:2"], ["--over =1:2: must be NAME=FROM:TO"]),
    "count": (["--over", "eta=12:-60:300"], ["must be NAME=FROM:TO", "--step"]),
    "list": (["--over", "eta=12,-60"], ["--over eta=12,-60: must be NAME=FROM:TO"]),
    "equal ends": (["--over", "eta=3:3"], ["--over eta=3:3", "the ends are equal"]),
    "word for a number": (["--over", "eta=a:2"], ["'a' is not a number", "NAME=FROM:TO"]),
    "no finite number": (["--over", "eta=0:inf"], ["'inf' is not a finite number"]),
    "misspelt": (["--over", "etta=1:2"], ["cannot be followed over etta", "Did you mean 'eta'?"]),
    "of another brake": (["--over", "wrap_angle=1:2"], ["kind 'wedge'", "of kind 'band'"]),
    "initial state": (["--over", "initial_angle=0:1"], ["cannot be followed over initial_angle"]),
    "option of Python": (["--over", "step=1:2"], ["cannot be followed over step"]),
    "with its table": (["--over", "driveline.inertia=1:2"], ["--over inertia="]),
    "unprintable": (["--over", "\x1b[1m=1:2"], ["'\\x1b[1m"]),
    "no possible value": (["--over", "inertia=1:-1"], ["--over inertia=1:-1", "greater than 0"]),
    "second misspelt": ([*ETA, "--and", "F1=1:2"], ["--and F1=1:2", "cannot be followed over F1"]),
    "second the same": ([*ETA, "--and", "eta=1:2"], ["--and eta: is that of --over"]),
    "second sets the first": ([*ETA, "--and", "slope=-99:9"], ["--and slope", "eta sets slope"]),
    "second elsewhere": (
        [*ETA, "--and", "F0=0.04:0.05"],
        ["--and F0=0.04:0.05: must contain 0.036", "--set F0=VALUE"],
    ),
    "no orbit": (["--over", "F0=2:1"], ["--over F0: at F0 = 2", "Nothing slips"]),
    "no orbit of this order": (
        ["--over", "eta=12:0", "--order", "3"],
        ["at eta = 12 there is no orbit to begin with", "--order N", "--set initial="],
    ),
    "no order": ([*ETA, "--order", "0"], ["--order 0: must be a whole number of periods"]),
    "order in words": ([*ETA, "--order", "two"], ["--order", "integer"]),
    "one point": ([*ETA, "--points", "1"], ["--points 1: must be a whole number, 2 to"]),
    "no step": ([*ETA, "--step", "0"], ["--step 0.0: must be a number, 1e-6 to 0.5"]),
    "step that is none": ([*ETA, "--step", "nan"], ["--step nan: must be a number"]),
    "negative switch": ([*ETA, "--switch", "-1"], ["--switch -1: must be a whole number, 0 to"]),
    "nothing to be beneath": ([*ETA, "--beneath", "9"], ["--beneath 9", "--plot PICTURE.png"]),
    "one column": ([*ETA, "--beneath", "1", "--plot", "r.png"], ["--beneath 1: must be a whole"]),
    "negative columns": ([*ETA, "--beneath", "-1", "--plot", "r.png"], ["--beneath -1: must be"]),
    "method without orbits": ([*ETA, "--method", "ode14x"], ["method = 'ode14x'", "'exact'"]),
    "method that does not fit": ([*ETA, "--method", "smooth"], ["method = 'smooth'", "'exact'"]),
    "unknown method": ([*ETA, "--method", "exakt"], ["--method exakt: not known", "'exact'"]),
    "periods": ([*ETA, "--set", "periods=5"], ["--set periods: belongs to simulate", "--order"]),
    "step of the run": ([*ETA, "--set", "step=1e-3"], ["--set step", "--step"]),
    "setting of sweep": ([*ETA, "--set", "limit=9"], ["--set limit: belongs to sweep"]),
    "late start": ([*ETA, "--set", "start_time=5"], ["run.start_time = 5.0: must be 0"]),
    "data as text": ([*ETA, "--out", "r.txt"], ["--out r.txt: must end in .nc"]),
    "picture nowhere": ([*ETA, "--plot", "no/r.png"], ["folder no does not exist"]),
    "no study": (["--over", "eta=1:2", "--set", "etta=3"], ["Did you mean 'eta'?"]),
}  # fmt: skip


@pytest.mark.parametrize("case", WRONG)
def test_wrong_input(case, run, tmp_path):
    options, words = WRONG[case]
    (tmp_path / "ok.toml").write_text(PAPER.read_text())
    status, text, message = run("continue", "ok.toml", *options)
    assert (status, text) == (2, "")
    assert message.startswith(("error: ", "Usage: ", "Error: "))
    assert "internal" not in message
    lines = message.splitlines()
    assert len(lines) <= 6
    assert max(map(len, lines)) <= 400
    for word in words:
        assert word in message, word
    assert names() == ["ok.toml"]


def test_ctrl_c_is_heard_at_once_and_nothing_is_written(tmp_path):
    """On a terminal, where progress is seen; steps so small that it would take hours."""
    ours, theirs = pty.openpty()
    options = ["--over", "eta=12:-60", "--step", "1e-6", "--points", "1000000"]
    process = started(
        [PROGRAM, "continue", PAPER, *options, "--out", "r.nc", "--plot", "r.png"],
        cwd=tmp_path, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=theirs,
    )  # fmt: skip
    os.close(theirs)
    seen, deadline = b"", time.monotonic() + 120.0
    while b"orbits, branch 1 at eta = 1" not in seen:
        assert time.monotonic() < deadline, seen
        assert process.poll() is None, seen
        if select.select([ours], [], [], 0.1)[0]:
            seen += os.read(ours, 65536)
    begin = time.monotonic()
    process.send_signal(signal.SIGINT)
    output, _ = process.communicate(timeout=60)
    assert time.monotonic() - begin < 1.0
    while select.select([ours], [], [], 0.0)[0]:
        try:
            seen += os.read(ours, 65536)
        except OSError:  # all was read
            break
    os.close(ours)
    assert (process.returncode, output) == (1, b"")
    assert b"Traceback" not in seen
    assert seen.replace(b"\r", b"").endswith(b"interrupted\nNothing is kept.\n")
    assert list(tmp_path.iterdir()) == []
