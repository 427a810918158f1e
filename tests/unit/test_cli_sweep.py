"""``wedgebrake sweep``: help, words, JSON, files, stores, Ctrl-C, and wrong input."""

from __future__ import annotations

import math
import re
import resource
import shutil
import signal
import subprocess
import sys
import time
import tomllib
from itertools import pairwise
from pathlib import Path

import jsonschema
import numpy as np
import pytest
import xarray as xr

import wedgebrake as wb
from children import started
from printed import names, strict_json, unwrapped
from wedgebrake.cli.sweep_text import sweep_text
from wedgebrake.dynamics.enums import motion_word
from wedgebrake.model.study import parse_study, schema
from wedgebrake.model.sweep_settings import INITIAL
from wedgebrake.sweeps.results import PointStatus

PROGRAM = Path(sys.executable).parent / "wedgebrake"
EXAMPLES = Path(__file__).parents[2] / "examples"
PAPER, CONVENTIONAL = EXAMPLES / "paper.toml", EXAMPLES / "conventional.toml"
# A dozen points, a moment's work.
SHORT = ["--transient", "20", "--periods", "30"]
ETA = ["--over", "eta=-60:12:12", *SHORT]
MAP = ["--over", "eta=-60:12:4", "--over", "F0=0.01:0.2:3:log", *SHORT]
STARTS = ["--over", "initial_angle=-0.1:0.1:2", "--over", "initial_velocity=-5,5", *SHORT]


@pytest.fixture
def answer(answer):
    """The JSON of a sweep."""
    return lambda *arguments: answer("sweep", *arguments)


def same(one: xr.Dataset, other: xr.Dataset) -> bool:
    return all(
        one[name].dims == other[name].dims
        and one[name].dtype == other[name].dtype
        and one[name].to_numpy().tobytes() == other[name].to_numpy().tobytes()
        for name in {*one.variables, *other.variables}
    )


class TestHelp:
    def test_is_complete(self, run):
        status, text, message = run("sweep", "--help")
        assert (status, message) == (0, "")
        assert text.startswith("Usage: wedgebrake sweep")
        for word in (
            "[sweep]", "bifurcation diagram", "basins of attraction", "keep_points",
            "FROM:TO:COUNT", "eta=-60:12:400", "F0=0.01:0.2:100:log", "F0=0.03,0.036,0.05",
            "initial_angle",
            "--set NAME=VALUE", "--method NAME", "--transient N|auto", "default 200", "limit=",
            "--periods N", "default 250", "--follow NAME", "hysteresis", "--store RUN.zarr",
            "--resume", "--threads N", "--out DATA.nc", "netCDF", "--plot PICTURE.png", "--json",
            "exit status 0", "Ctrl-C", "exit status 1", "samples_per_period", "start", "Examples:",
        ):  # fmt: skip
            assert word in unwrapped(text), word
        options = text.partition("Options:")[2].partition("Examples:")[0]
        for line in re.findall(r"^  (-.*(?:\n {6,}.*)*)", options, re.MULTILINE):
            assert len(unwrapped(line).split()) >= 4, line
        assert max(map(len, text.splitlines())) <= 80
        assert run("sweep", "-h") == (0, text, "")
        assert "How does it vibrate over a range of parameters?" in unwrapped(run("--help")[1])

    def test_its_examples_work(self, run, tmp_path):
        shutil.copytree(EXAMPLES, tmp_path, dirs_exist_ok=True)
        text = unwrapped(run("sweep", "--help")[1]).partition("Examples: ")[2]
        examples = [one.strip().removeprefix("wedgebrake ").split() for one in text.split(";")]
        assert len(examples) == 3
        for example in examples:
            smaller = [re.sub(r":\d00\b", ":4", word) for word in example]
            assert run(*smaller)[0] == 0

    def test_costs_little(self):
        """At most 0.5 s of CPU, warm: the best of three; nothing heavy is loaded."""
        costs = []
        for _ in range(3):
            before = resource.getrusage(resource.RUSAGE_CHILDREN)
            subprocess.run(
                [PROGRAM, "sweep", "--help"], stdout=subprocess.DEVNULL, check=True, timeout=60
            )
            after = resource.getrusage(resource.RUSAGE_CHILDREN)
            costs.append(after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)
        assert min(costs) < 0.5, costs
        program = (
            "import sys\n"
            "from wedgebrake.cli.main import main\n"
            "sys.argv = ['wedgebrake', 'sweep', '--help']\n"
            "try:\n    main()\n"
            "except SystemExit:\n"
            "    print({'numpy', 'numba', 'xarray', 'zarr'} & set(sys.modules), file=sys.stderr)\n"
        )
        done = subprocess.run(
            [sys.executable, "-c", program], capture_output=True, text=True, timeout=60
        )
        assert done.stderr == "set()\n"


class TestAxes:
    @pytest.mark.parametrize(
        ("texts", "values"),
        [
            (["eta=-60:12:5"], {"eta": np.linspace(-60, 12, 5)}),
            (["eta = 12 : -60 : 5 : linear"], {"eta": np.linspace(12, -60, 5)}),
            (["F0=0.01:.2:6:log"], {"F0": np.geomspace(0.01, 0.2, 6)}),
            (["eta=-0.1:-60:3:log"], {"eta": np.geomspace(-0.1, -60, 3)}),
            (["F0=0.05, 0.03,4e-2"], {"F0": np.array([0.05, 0.03, 0.04])}),
            (["initial_angle=-0.1:0.1:3"], {"initial_angle": np.linspace(-0.1, 0.1, 3)}),
            (
                ["inertia=1,2", "eta=-3:3:2", "f=0.5,0.6"],
                {
                    "inertia": np.array([1.0, 2.0]),
                    "eta": np.array([-3.0, 3.0]),
                    "f": np.array([0.5, 0.6]),
                },
            ),
        ],
    )
    def test_are_those_of_numpy_in_their_order(self, texts, values, answer):
        options = [word for text in texts for word in ("--over", text)]
        axes = answer(PAPER, *options, *SHORT)["axes"]
        assert list(axes) == list(values)
        for name, wanted in values.items():
            assert np.array_equal(axes[name]["values"], wanted)
        assert axes[name]["unit"]
        assert axes[name]["meaning"]

    def test_of_the_study_give_way_to_the_options(self, answer, tmp_path):
        study = tmp_path / "s.toml"
        study.write_text(
            f"{PAPER.read_text()}\n[sweep]\neta = [-3, 3]\nF0 = [0.1, 0.2]\nperiods = 12\n"
            "transient = 10\n"
        )
        told = answer(study)
        assert [*told["axes"]] == ["eta", "F0"]
        assert (told["protocol"]["transient"], told["protocol"]["periods"]) == (10, 12)
        told = answer(study, "--over", "f=0.5,0.6,0.7", "--periods", "13")
        assert [*told["axes"]] == ["f"]
        assert (told["protocol"]["transient"], told["protocol"]["periods"]) == (10, 13)
        told = answer(study, "--set", "transient=11", "--set", "keep_points=false")
        assert (told["protocol"]["transient"], told["protocol"]["periods"]) == (11, 12)
        told = answer(study, "--transient", "auto", "--set", "limit=300")
        assert told["protocol"]["transient"] == "auto"
        assert (told["protocol"]["recorded"], told["protocol"]["limit"]) == (12, 300)

    @pytest.mark.parametrize(
        ("options", "kind", "dims", "keeps"),
        [
            (ETA, "bifurcation", ("eta",), True),
            ([*ETA, "--follow", "eta"], "bifurcation", ("branch", "eta"), True),
            (["--over", "initial_angle=0,1", *SHORT], "bifurcation", ("initial_angle",), True),
            (MAP, "regime_map", ("eta", "F0"), False),
            ([*MAP, "--set", "keep_points=true"], "regime_map", ("eta", "F0"), True),
            ([*MAP, "--follow", "F0"], "sweep", ("branch", "eta", "F0"), True),
            (STARTS, "basins", ("initial_angle", "initial_velocity"), True),
            ([*STARTS, "--follow", "initial_angle"], "sweep", ("branch", *INITIAL), True),
            ([*STARTS[:2], *ETA], "regime_map", ("initial_angle", "eta"), False),
            ([*MAP, "--over", "f=0.5,0.6"], "sweep", ("eta", "F0", "f"), True),
        ],
    )
    def test_decide_on_the_kind(self, options, kind, dims, keeps, run):
        assert run("sweep", PAPER, *options, "--out", "r.nc")[0] == 0
        with xr.open_dataset("r.nc", engine="h5netcdf") as stored:
            assert stored.attrs["kind"] == kind
            assert stored["status"].dims == dims
            assert ("angle" in stored) == keeps
            assert not keeps or stored["angle"].dims == (*dims, "period")
            assert ("attractor" in stored) == (kind == "basins")

    def test_settings_of_the_run_count_and_its_length_does_not(self, answer, tmp_path):
        study = tmp_path / "s.toml"
        run = "duration = 3.0\ninitial = [0.01, 0.5]\nrtol = 1e-7\nstep = 1e-3\nmax_events = 5000\n"
        text = PAPER.read_text().replace("duration = 25.0        # s", run + "max_steps = 6000\n")
        study.write_text(text)
        protocol = answer(study, "--over", "eta=-3,3")["protocol"]
        assert protocol == {
            "periods": 250, "transient": 200, "recorded": 50, "limit": protocol["limit"],
            "initial": [0.01, 0.5], "follow": None, "rtol": 1e-7, "step": 1e-3,
            "max_events": 5000, "max_steps": 6000,
        }  # fmt: skip
        assert answer(study, *ETA, "--method", "exact")["method"] == "exact"


class TestJson:
    def test_is_complete_and_right(self, answer):
        told = answer(PAPER, *ETA)
        assert set(told) == {
            "wedgebrake", "versions", "kind", "method", "system", "groups", "protocol", "axes",
            "points", "status", "motion", "stick_slip", "linear_stability", "intervals",
            "attractors", "speed", "files", "warnings",
        }  # fmt: skip
        system = wb.load_study(PAPER).system
        values = np.linspace(-60, 12, 12)
        dataset = wb.bifurcation(system, eta=values, periods=30, transient=20)
        assert told["system"] == system.as_dict()
        assert told["wedgebrake"] == wb.__version__
        assert told["axes"]["eta"]["values"] == values.tolist()
        assert told["points"] == 12
        assert told["status"] == {"completed": 12}
        words = [
            motion_word(int(motion), int(order))
            for motion, order in zip(dataset["motion"], dataset["order"], strict=True)
        ]
        assert told["motion"] == {word: words.count(word) for word in words}
        assert sum(told["stick_slip"].values()) == 12
        assert told["attractors"] is None
        assert told["warnings"] == []
        assert told["files"] == {"picture": None, "data": None, "store": None}
        speed = told["speed"]
        assert (speed["computed"], speed["resumed"]) == (12, 0)
        assert speed["points_per_second"] == pytest.approx(12 / speed["seconds"])
        # The intervals are the points, one after another.
        spread = [one["motion"] for one in told["intervals"] for _ in range(one["points"])]
        assert spread == words
        place = 0
        for one in told["intervals"]:
            assert one["from"] == values[place]
            place += one["points"]
            assert one["to"] == values[place - 1]
        classes = [(one["motion"], one["stick_slip"]) for one in told["intervals"]]
        assert all(before != after for before, after in pairwise(classes))

    def test_intervals_ascend_whatever_the_order_of_the_values(self, answer):
        told = answer(PAPER, "--over", "eta=3,-60,0,12,-24", *SHORT)
        ends = [end for one in told["intervals"] for end in (one["from"], one["to"])]
        assert ends == sorted(ends)
        assert sum(one["points"] for one in told["intervals"]) == 5
        assert told["axes"]["eta"]["values"] == [3.0, -60.0, 0.0, 12.0, -24.0]

    def test_each_branch_has_its_intervals(self, answer):
        told = answer(PAPER, *ETA, "--follow", "eta")
        assert told["points"] == 24
        for branch in ("up", "down"):
            mine = [one for one in told["intervals"] if one["branch"] == branch]
            assert sum(one["points"] for one in mine) == 12
            assert [one["from"] for one in mine] == sorted(one["from"] for one in mine)

    @pytest.mark.parametrize("brake", [PAPER, CONVENTIONAL])
    def test_limit_of_linear_stability_along_the_slope(self, brake, answer):
        """It is the Hopf point of the theory, to the last digits, on whatever grid."""
        told = answer(brake, "--over", "slope=-50:20:4", *SHORT)
        verdict = wb.stability(wb.load_study(brake).system)
        hopf = max(verdict.forward.hopf_slope, verdict.backward.hopf_slope)
        [limit] = told["linear_stability"]["limits"]
        assert limit["value"] == pytest.approx(hopf, rel=1e-9)
        assert limit["stable"] == "above"

    def test_limit_of_linear_stability_along_a_parameter_that_bends_it(self, answer):
        """Forwards, eta + mu_k (alpha - 1) > 0 (docs/theory.md): alpha = 1 + 0.1/0.3."""
        told = answer(PAPER, "--set", "eta=-0.1", "--over", "alpha=3,1.1,2", *SHORT)
        [limit] = told["linear_stability"]["limits"]
        assert limit["value"] == pytest.approx(4.0 / 3.0, rel=1e-9)
        assert limit["stable"] == "above"
        assert told["linear_stability"]["stable_share"] == pytest.approx(2.0 / 3.0)

    def test_limits_along_an_angle_through_self_locking(self, answer):
        """Locked forwards below tan(angle) = mu_k; eta + tan(angle) - mu_k > 0 above."""
        told = answer(PAPER, "--set", "eta=-0.1", "--over", "angle=0.2:0.6:5", *SHORT)
        lock, free = told["linear_stability"]["limits"]
        assert (lock["stable"], free["stable"]) == ("below", "above")
        assert math.tan(lock["value"]) == pytest.approx(0.3, rel=1e-9)
        assert math.tan(free["value"]) == pytest.approx(0.4, rel=1e-9)
        # The result has an angle of its own.
        assert told["axes"]["angle"]["dimension"] == "brake_angle"
        assert told["axes"]["angle"]["values"] == np.linspace(0.2, 0.6, 5).tolist()

    def test_no_limit_where_there_is_none(self, answer):
        assert answer(PAPER, "--over", "F0=0.03,0.05", *SHORT)["linear_stability"] == {
            "stable_share": 0.0, "locked_share": 0.0, "limits": [],
        }  # fmt: skip
        assert answer(PAPER, *MAP)["linear_stability"]["limits"] is None

    def test_attractors_of_basins(self, answer):
        told = answer(PAPER, *STARTS, "--transient", "auto")
        assert sum(one["share"] for one in told["attractors"]) == pytest.approx(1.0)
        assert [one["number"] for one in told["attractors"]] == [*range(len(told["attractors"]))]
        assert told["intervals"] is None

    def test_points_that_diverge_or_cannot_be_built_are_answers(self, answer):
        told = answer(PAPER, "--set", "release=false", "--over", "slope=-400,0,40", *SHORT)
        assert told["status"]["diverged"] == 1
        assert told["motion"]["diverged"] == 1
        told = answer(PAPER, "--over", "inertia=-1:1:3", *SHORT)
        assert told["status"] == {"cannot be built": 2, "completed": 1}
        assert told["intervals"][0]["to"] == 0.0
        told = answer(PAPER, "--over", "eta=-3,3", "--set", "max_events=10", *SHORT)
        assert told["status"] == {"stopped at max_events": 2}

    def test_stands_alone_on_standard_output(self, run):
        status, text, message = run(
            "sweep", PAPER, *ETA, "--json", "--out", "r.nc", "--plot", "r.svg", "--store", "r.zarr"
        )
        assert status == 0
        files = strict_json(text)["files"]
        for what, name in (("data", "r.nc"), ("picture", "r.svg"), ("store", "r.zarr")):
            assert files[what] == str(Path(name).resolve())
        assert "12 of 12 points" in message


class TestWords:
    @pytest.mark.parametrize(
        ("options", "words"),
        [
            (
                ["--set", "amplitude=0", "--over", "eta=-9,0"],
                "no torque acts: its period, 0.09973 s, only sets",
            ),
            (["--set", "amplitude=0", "--over", "frequency=9,10"], "its period, 1/frequency, only"),
            (["--set", "amplitude=0", "--over", "F0=0.03,0.04"], None),
            (["--over", "eta=-9,0"], None),
        ],
    )
    def test_of_a_torque_that_does_not_act(self, run, options, words):
        status, text, _ = run("sweep", PAPER, *options, *SHORT)
        assert status == 0
        assert words in text if words else "no torque" not in text

    def test_of_one_parameter(self, run):
        status, text, message = run("sweep", PAPER, *ETA)
        assert status == 0
        for words in (
            "Wedge brake, Coulomb friction: f = 0.63, F0 = 0.036, alpha = 1.18\n",
            "Swept: eta from -60 to 12, 12 values",
            "Evaluated over torque periods 20–30, starting from rest at angle 0",
            "Points: 12, all completed\n",
            "\nMotion: ",
            "\nStick-slip: ",
            "Linear stability: sliding has its limit at eta = -0.054 (stable above it)\n",
            "\nAlong eta:\n  -60 ",
            " 12  ",
        ):
            assert words in text, words
        assert re.search(r"\n12 points in \S+ s \(\S+ points/s", text)
        assert "12 of 12 points" in message.splitlines()[-1]

    def test_of_a_map(self, run):
        _, text, _ = run("sweep", PAPER, *MAP)
        assert "Wedge brake, Coulomb friction: f = 0.63, alpha = 1.18\n" in text
        assert "Swept: F0 from 0.01 to 0.2, 3 values (" in text
        assert "F_a0 mu_k R / T_e; sets amplitude)\n" in text
        assert re.search(r"sliding is stable at 25 % of the points", text)
        assert "Along" not in text

    def test_of_basins(self, run):
        _, text, _ = run("sweep", PAPER, *STARTS, "--transient", "auto")
        assert "once each point has settled, at the latest after 20000" in text
        assert "Swept: initial_velocity from -5 to 5 rad/s, 2 values" in text
        assert re.search(r"\nAttractors: \d, by the share", text)
        assert "velocity 0" not in text

    def test_of_branches(self, run):
        _, text, _ = run("sweep", PAPER, *ETA, "--follow", "eta")
        assert "each point starts where its neighbour in eta ended" in text
        alike = "Along eta, up and down alike:" in text
        assert alike or ("Along eta, up:" in text and "Along eta, down:" in text)

    @pytest.mark.parametrize("lengths", [[1] * 500, [1, 50] * 30, [3] * 12, [*range(1, 40)]])
    def test_about_a_dozen_lines_however_many_intervals(self, lengths, answer):
        report = answer(PAPER, *ETA)
        total = sum(lengths)
        intervals, place = [], 0
        for number, length in enumerate(lengths):
            word = f"{number % 7 + 2}T-periodic"
            ends = {"from": float(place), "to": float(place + length - 1), "points": length}
            intervals.append({**ends, "motion": word, "stick_slip": "non-stick-slip"})
            place += length
        axis = {"unit": "1", "meaning": "x", "values": np.arange(total, dtype=float)}
        text = sweep_text(
            wb.paper.system(), {**report, "axes": {"eta": axis}, "intervals": intervals}
        )
        rows = re.findall(r"\n  (\d+)(?: \.\.\. (\d+))?   +(\S.*)", text.partition("Along eta")[2])
        assert 1 <= len(rows) <= 12
        assert len(rows) == len(lengths) or "--json lists each" in text
        # They cover every value once.
        place = 0
        for low, high, words in rows:
            assert int(low) == place
            place = int(high or low) + 1
            assert len(words) < 100
        assert place == total


class TestFiles:
    def test_hold_the_same_numbers(self, run):
        status, text, _ = run("sweep", PAPER, *ETA, "--out", "r.nc", "--plot", "r.svg")
        assert status == 0
        assert f"Picture: {Path('r.svg').resolve()}\nData: {Path('r.nc').resolve()}\n" in text
        system = wb.load_study(PAPER).system
        wanted = wb.bifurcation(system, eta=np.linspace(-60, 12, 12), periods=30, transient=20)
        with xr.open_dataset("r.nc", engine="h5netcdf", decode_cf=False) as stored:
            assert same(stored, wanted)
            for name in ("kind", "system", "protocol", "axes"):
                assert stored.attrs[name] == wanted.attrs[name]
            assert stored["angle"].attrs["units"] == "rad"
        assert Path("r.svg").read_text().startswith("<?xml")
        assert names() == ["r.nc", "r.svg"]

    @pytest.mark.parametrize("options", [ETA, MAP, STARTS, [*MAP, "--follow", "eta"]])
    def test_pictures_of_every_kind(self, options, run):
        status, text, _ = run("sweep", PAPER, *options, "--plot", "r.png")
        assert status == 0
        assert Path("r.png").read_bytes().startswith(b"\x89PNG")
        assert text.endswith(f"Picture: {Path('r.png').resolve()}\n")

    @pytest.mark.usefixtures("full_disk")
    @pytest.mark.parametrize("option", ["--out", "--plot"])
    def test_the_words_are_said_where_a_file_fails(self, option, run):
        """Hours of work must not be for nothing."""
        name = "r.nc" if option == "--out" else "r.png"
        Path(name).write_text("earlier")
        status, text, message = run("sweep", PAPER, *ETA, option, name)
        assert status == 1
        assert "Along eta" in text
        assert name not in text
        assert "no space left" in message
        assert names() == [name]
        assert Path(name).read_text() == "earlier"


class TestStore:
    def test_holds_the_same_numbers_and_goes_on(self, run, answer):
        status, text, message = run("sweep", PAPER, *ETA, "--store", "r.zarr")
        assert status == 0
        assert f"Store: {Path('r.zarr').resolve()}\n" in text
        assert "12 of 12 points" in message
        system = wb.load_study(PAPER).system
        wanted = wb.bifurcation(system, eta=np.linspace(-60, 12, 12), periods=30, transient=20)
        with xr.open_zarr("r.zarr", consolidated=False, decode_cf=False) as stored:
            assert same(stored.load(), wanted)
        status, text, message = run("sweep", PAPER, *ETA, "--store", "r.zarr", "--resume")
        assert status == 0
        assert message in ("", "12 of 12 points\n")
        assert "All 12 points were in the store." in text
        told = answer(PAPER, *ETA, "--store", "r.zarr", "--resume", "--out", "r.nc")
        assert (told["speed"]["computed"], told["speed"]["resumed"]) == (0, 12)
        with xr.open_dataset("r.nc", engine="h5netcdf", decode_cf=False) as stored:
            assert same(stored, wanted)

    def test_mends_what_is_damaged_and_says_so(self, run):
        options = ["--over", "eta=-60:12:40", *SHORT, "--store", "r.zarr"]
        assert run("sweep", PAPER, *options)[0] == 0
        before = xr.open_zarr("r.zarr", consolidated=False).load()
        chunk = next(path for path in sorted(Path("r.zarr/motion/c").rglob("*")) if path.is_file())
        chunk.write_bytes(chunk.read_bytes()[:-1])
        status, text, message = run("sweep", PAPER, *options, "--resume", "--json")
        assert status == 0
        told = strict_json(text)
        assert 0 < told["speed"]["computed"] < 40
        assert told["speed"]["computed"] + told["speed"]["resumed"] == 40
        [warning] = told["warnings"]
        assert "is damaged" in warning
        assert message.splitlines()[0] == f"warning: {warning}"
        assert "StoreWarning" not in message
        assert same(xr.open_zarr("r.zarr", consolidated=False).load(), before)

    def test_is_not_begun_where_the_sweep_is_refused(self, run):
        status, _, message = run("sweep", PAPER, "--over", "inertia=-2,-1", "--store", "r.zarr")
        assert status == 2
        assert "inertia: no value can be taken" in message
        assert names() == []

    def test_of_another_sweep_is_told_apart(self, run):
        assert run("sweep", PAPER, *ETA, "--store", "r.zarr")[0] == 0
        for options, words in (
            ([*ETA], "--store r.zarr: exists already. Go on with the sweep in it by --resume"),
            ([*ETA, "--resume", "--set", "damping=0.2"], "--store r.zarr: holds another sweep:"),
            ([*MAP, "--resume"], "axes.eta: 12 values in the store, 4 now"),
        ):
            status, text, message = run("sweep", PAPER, *options, "--store", "r.zarr")
            assert (status, text) == (2, "")
            assert message.startswith("error: --store r.zarr: ")
            assert words in message
            assert "path =" not in message
            assert "resume=True" not in message

    def test_that_cannot_be_written(self, run, monkeypatch):
        def fill(*_, **__):
            raise OSError(28, "No space left on device")

        monkeypatch.setattr("wedgebrake.sweeps.store.replace_file", fill)
        status, text, message = run("sweep", PAPER, *ETA, "--store", "r.zarr")
        assert (status, text) == (1, "")
        assert "error: --store r.zarr: cannot be written (no space left on device)" in message
        assert "the same call with --resume then goes on" in message


# What is wrong: (the arguments, what the message must say).
WRONG: dict[str, tuple[list[str], list[str]]] = {
    "nothing to sweep": ([], ["nothing to sweep", "--over eta=-60:12:400", "[sweep] table"]),
    "no values": (["--over", "eta"], ["--over eta: must be NAME=FROM:TO:COUNT"]),
    "empty values": (["--over", "eta="], ["--over eta=: must be"]),
    "no name": (["--over", "=1:2:3"], ["--over =1:2:3: must be"]),
    "nothing at all": (["--over"], ["--over", "requires an argument"]),
    "one value": (["--over", "eta=-30"], ["is one value", "--set eta=-30"]),
    "no count": (["--over", "eta=-30:2"], ["--over eta=-30:2: must be NAME="]),
    "too many parts": (["--over", "eta=1:2:3:log:4"], ["must be NAME="]),
    "unknown scale": (["--over", "eta=1:2:3:lin"], ["'lin' at the end: must be log, linear"]),
    "word for a number": (["--over", "eta=a:2:3"], ["'a' is not a number", "NAME=FROM:TO:COUNT"]),
    "decimal comma": (["--over", "eta=0,5:1,5:9"], ["'0,5' is not a number"]),
    "gap in a list": (["--over", "eta=1,,2"], ["'' is not a number"]),
    "half a count": (["--over", "eta=1:2:3.5"], ["'3.5' is not a whole number"]),
    "endless count": (["--over", "eta=1:2:" + "9" * 5000], ["is not a whole number"]),
    "huge count": (["--over", "eta=1:2:999999999"], ["points = 999999999: must be at most"]),
    "count of one": (["--over", "eta=1:2:1"], ["points = 1: must be at least 2"]),
    "negative count": (["--over", "eta=1:2:-4"], ["points = -4: must be at least 2"]),
    "equal ends": (["--over", "eta=1:1:5"], ["from = 1.0 and to = 1.0: are equal"]),
    "ratios through zero": (["--over", "eta=-1:1:5:log"], ["must both lie above 0, or both"]),
    "nan": (["--over", "eta=nan:1:5"], ["'nan' is not a finite number"]),
    "infinity in a list": (["--over", "eta=1,inf"], ["'inf' is not a finite number"]),
    "beyond floats": (["--over", "eta=1,1e400"], ["'1e400' is not a finite number"]),
    "misspelt": (["--over", "etta=1:2:3"], ["etta cannot be swept", "Did you mean 'eta'?"]),
    "of another brake": (["--over", "wrap_angle=1:2:3"], ["kind 'wedge'", "of kind 'band'"]),
    "argument of Python": (["--over", "system=1:2:3"], ["system cannot be swept"]),
    "option of Python": (["--over", "threads=1:2:3"], ["threads cannot be swept"]),
    "python's own": (["--over", "self=1:2:3"], ["self cannot be swept"]),
    "no number": (["--over", "release=0,1"], ["release cannot be swept"]),
    "with its table": (["--over", "driveline.inertia=1,2"], ["without its table: --over inertia="]),
    "unprintable": (["--over", "\x1b[1m=1,2"], ["'\\x1b[1m"]),
    "twice": (["--over", "eta=1,2", "--over", "eta=3,4"], ["--over eta: given twice"]),
    "eta and slope": (["--over", "eta=1,2", "--over", "slope=3,4"], ["eta and slope: both swept"]),
    "too many points": (
        ["--over", "eta=1:2:99999", "--over", "F0=1:2:99999"],
        ["GiB of memory", "--store"],
    ),
    "no possible value": (["--over", "inertia=-3:-1:3"], ["inertia: no value can be taken"]),
    "three in a picture": ([*MAP, "--over", "f=1,2", "--plot", "r.png"], ["--plot", "not over 3"]),
    "picture without points": (
        [*ETA, "--set", "keep_points=false", "--plot", "r.png"],
        ["--plot: a bifurcation diagram is drawn from the Poincare points", "keep_points"],
    ),
    "basins without points": ([*STARTS, "--set", "keep_points=false"], ["keep_points = False"]),
    "follow another": ([*ETA, "--follow", "F0"], ["follow = 'F0'", "must be a parameter", "eta"]),
    "resume nothing": ([*ETA, "--resume"], ["--resume: needs --store"]),
    "store nowhere": ([*ETA, "--store", "no/r.zarr"], ["--store no/r.zarr: the folder", "exist"]),
    "store on a file": (
        [*ETA, "--store", "ok.toml", "--resume"],
        ["--store ok.toml: is no folder; nothing in it was touched"],
    ),
    "store in a folder": ([*ETA, "--store", ".", "--resume"], ["is not the store of a sweep"]),
    "store that is there": ([*ETA, "--store", "folder"], ["--store folder: exists already"]),
    "data as text": ([*ETA, "--out", "r.txt"], ["--out r.txt: must end in .nc"]),
    "data nowhere": ([*ETA, "--out", "no/r.nc"], ["--out no/r.nc", "folder no does not exist"]),
    "wrong picture": ([*ETA, "--plot", "r.bmp"], ["--plot r.bmp", ".png, .svg, .pdf"]),
    "picture to a folder": ([*ETA, "--plot", "folder.png"], ["--plot folder.png: is a directory"]),
    "data refused before the store": (
        [*ETA, "--store", "r.zarr", "--out", "no/r.nc"],
        ["--out no/r.nc"],
    ),
    "no threads": ([*ETA, "--threads", "0"], ["threads = 0: must be a whole number, 1 to 1024"]),
    "threads in words": ([*ETA, "--threads", "two"], ["--threads", "integer"]),
    "transient in words": ([*ETA, "--transient", "soon"], ["--transient soon: must be", "auto"]),
    "endless transient": ([*ETA, "--transient", "9" * 5000], ["--transient '999", "must be"]),
    "negative transient": ([*ETA, "--transient", "-1"], ["--transient -1: must be a whole number"]),
    "transient too long": (
        [*ETA, "--transient", "300"],
        ["transient = 300: must be below periods = 30", "Raise periods"],
    ),
    "no periods": ([*ETA, "--periods", "0"], ["--periods 0: must be greater than 0"]),
    "periods of the run": ([*ETA, "--set", "periods=5"], ["--set periods", "give --periods"]),
    "duration": ([*ETA, "--set", "duration=5"], ["--set duration", "give --periods"]),
    "samples": ([*ETA, "--set", "samples_per_period=5"], ["--set samples_per_period", "Leave it"]),
    "transient twice": (
        [*ETA, "--set", "transient=5"],
        ["--transient and --set transient: both given"],
    ),
    "late start": ([*ETA, "--set", "start_time=5"], ["run.start_time = 5.0: must be 0"]),
    "with the table": (
        [*ETA, "--set", "sweep.limit=5"],
        ["--set sweep.limit=5", "--over", "--set limit=5000"],
    ),
    "limit of nothing": ([*ETA, "--set", "limit=0"], ["sweep.limit = 0: must be greater than 0"]),
    "unknown method": ([*ETA, "--method", "exakt"], ["--method exakt: not known", "'exact'"]),
    "method that does not fit": ([*ETA, "--method", "smooth"], ["method = 'smooth'", "'exact'"]),
    "unknown option": ([*ETA, "--jsn"], ["--jsn", "--json"]),
}


@pytest.mark.parametrize("case", WRONG)
def test_wrong_input(case, run, tmp_path):
    options, words = WRONG[case]
    (tmp_path / "ok.toml").write_text(PAPER.read_text())
    (tmp_path / "folder").mkdir()
    (tmp_path / "folder.png").mkdir()
    status, text, message = run("sweep", "ok.toml", *options)
    assert (status, text) == (2, "")
    assert message.startswith(("error: ", "Usage: ", "Error: "))
    assert "internal" not in message
    lines = message.splitlines()
    assert len(lines) <= 6
    assert max(map(len, lines)) <= 400
    for word in words:
        assert word in message, word
    assert names() == ["folder", "folder.png", "ok.toml"]


def test_wrong_input_in_a_process_of_its_own(tmp_path):
    for options, words in (
        (["no.toml", *ETA], "error: no.toml: no such file"),
        ([str(PAPER)], "error: sweep: nothing to sweep"),
        ([str(PAPER), *ETA, "--store", "no/r.zarr"], "error: --store no/r.zarr: the folder"),
    ):
        done = subprocess.run(
            [PROGRAM, "sweep", *options], cwd=tmp_path, capture_output=True, text=True, timeout=120
        )
        assert (done.returncode, done.stdout) == (2, "")
        assert done.stderr.startswith(words)
        assert list(tmp_path.iterdir()) == []


def test_memory_that_ends(run, monkeypatch):
    def fail(*_, **__):
        raise MemoryError

    monkeypatch.setattr("wedgebrake.sweeps.maps.execute", fail)
    status, text, message = run("sweep", PAPER, *ETA)
    assert (status, text) == (1, "")
    assert "error: not enough memory. Sweep fewer values" in message
    assert "--store" in message


class TestStudyWithASweep:
    """A study may say what to sweep, whatever is done with it."""

    EXAMPLE = EXAMPLES / "sweep.toml"

    def test_is_valid_by_the_schema(self):
        jsonschema.validate(tomllib.loads(self.EXAMPLE.read_text()), schema())

    @pytest.mark.parametrize(
        "table",
        [
            {"etta": [1.0]},
            {"eta": 3.0},
            {"eta": []},
            {"eta": ["low"]},
            {"eta": {"from": 1.0, "to": 2.0}},
            {"eta": {"from": 1.0, "to": 2.0, "points": 1}},
            {"eta": {"from": 1.0, "to": 2.0, "points": 3, "scale": "lin"}},
            {"eta": {"form": 1.0, "to": 2.0, "points": 3}},
            {"transient": "soon"},
            {"transient": -1},
            {"periods": 0},
            {"limit": 1.5},
            {"follow": 3},
            {"keep_points": "yes"},
            [],
        ],
    )
    def test_schema_refuses_what_the_reader_refuses(self, table):
        tables = {**tomllib.loads(self.EXAMPLE.read_text()), "sweep": table}
        with pytest.raises(jsonschema.ValidationError):
            jsonschema.validate(tables, schema())
        with pytest.raises(wb.InputError, match="sweep"):
            parse_study(tables)

    def test_says_what_is_swept(self, run):
        status, text, _ = run("sweep", self.EXAMPLE, *SHORT)
        assert status == 0
        assert "Swept: eta from -60 to 12, 400 values" in text
        assert len(text.splitlines()) <= 28

    def test_can_be_simulated_and_judged(self, run):
        for command in ("stability", "simulate"):
            status, text, _ = run(command, self.EXAMPLE)
            assert status == 0
            assert "eta = -24" in text

    def test_that_is_wrong_is_refused_by_every_command(self, run, tmp_path):
        text = self.EXAMPLE.read_text().replace("points = 400", "points = 1", 1)
        (tmp_path / "s.toml").write_text(text)
        for command in ("stability", "simulate", "sweep"):
            status, _, message = run(command, "s.toml")
            assert status == 2
            assert message.startswith("error: s.toml: sweep.eta.points = 1: must be at least 2.")


class TestInterrupt:
    """Ctrl-C in a process of its own: heard at once, whatever is being computed."""

    @staticmethod
    def interrupted(folder: Path, options: list[str], ready) -> list[str]:
        """The lines on standard error of a sweep that is interrupted when it is ready."""
        process = started(
            [PROGRAM, "sweep", PAPER, *options, "--out", "r.nc", "--plot", "r.png"],
            cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        )  # fmt: skip
        deadline = time.monotonic() + 120.0
        while not ready():
            assert process.poll() is None, process.communicate()
            assert time.monotonic() < deadline
            time.sleep(0.01)
        begin = time.monotonic()
        process.send_signal(signal.SIGINT)
        text, message = process.communicate(timeout=60)
        assert time.monotonic() - begin < 1.0
        assert (process.returncode, text) == (1, "")
        assert "Traceback" not in message
        return message.splitlines()[-2:]

    @staticmethod
    def done(store: Path) -> int:
        """Chunks that are finished."""
        return sum(path.is_file() for path in store.glob("status/c/**/*"))

    def test_leaves_a_store_that_goes_on(self, tmp_path, run):
        store, options = tmp_path / "r.zarr", ["--over", "eta=-60:12:6000", "--store", "r.zarr"]
        words = self.interrupted(tmp_path, [*options, "--threads", "1"], lambda: self.done(store))
        assert words[0] == "interrupted"
        assert re.fullmatch(
            r"r.zarr keeps (\d+ of 6000 points|what was done)\. The same command with --resume"
            r" goes on\.",
            words[1],
        )
        assert names() == ["r.zarr"]
        with xr.open_zarr(store, consolidated=False) as kept:
            computed = kept["status"].to_numpy() == PointStatus.COMPLETED
            assert 0 < np.count_nonzero(computed) < 6000
            first = kept["final_angle"].to_numpy()[computed][:20]
        values = np.linspace(-60, 12, 6000)[computed][:20]
        system = wb.load_study(PAPER).system
        assert np.array_equal(first, wb.bifurcation(system, eta=values)["final_angle"])
        status, text, _ = run("sweep", PAPER, *options, "--resume", "--json")
        assert status == 0
        told = strict_json(text)
        assert told["status"] == {"completed": 6000}
        assert told["speed"]["resumed"] >= np.count_nonzero(computed)
        assert told["speed"]["computed"] > 0

    def test_within_one_point_of_an_hour(self, tmp_path, monkeypatch):
        monkeypatch.chdir(tmp_path)
        store = tmp_path / "r.zarr"
        options = ["--over", "eta=-60:12:50", "--periods", "4000000", "--store", "r.zarr"]
        began = []

        def ready() -> bool:
            if not began and store.exists():
                began.append(time.monotonic())
            return bool(began) and time.monotonic() > began[0] + 1.0

        words = self.interrupted(tmp_path, options, ready)
        assert words[0] == "interrupted"
        assert words[1].startswith(("r.zarr keeps 0 of 50 points.", "r.zarr keeps what was done."))
        assert names() == ["r.zarr"]
        shutil.rmtree(store)

    def test_without_a_store_nothing_is_kept(self, tmp_path, monkeypatch):
        monkeypatch.chdir(tmp_path)
        begin = time.monotonic()
        options = ["--over", "eta=-60:12:50", "--periods", "4000000"]
        words = self.interrupted(tmp_path, options, lambda: time.monotonic() > begin + 3.0)
        assert words == [
            "interrupted",
            "Nothing is kept. With --store RUN.zarr the points that are done would be.",
        ]
        assert names() == []
