"""``wedgebrake sweep``: JSON, text, files, stores, Ctrl-C, and wrong input."""

from __future__ import annotations

import math
import re
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
from children import interrupted, started
from printed import names, strict_json
from schemas import VALIDATOR
from wedgebrake.cli.sweep_text import sweep_text
from wedgebrake.dynamics.enums import motion_word
from wedgebrake.errors import OutputError
from wedgebrake.model.studies.study import parse_study
from wedgebrake.sweeps.results import PointStatus
from wedgebrake.sweeps.store_format import StoreBackend

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
            (MAP, "regime_map", ("eta", "F0"), False),
            ([*MAP, "--follow", "F0"], "sweep", ("branch", "eta", "F0"), True),
            (STARTS, "basins", ("initial_angle", "initial_velocity"), True),
            ([*MAP, "--over", "f=0.5,0.6"], "sweep", ("eta", "F0", "f"), True),
        ],
    )
    def test_decide_on_the_kind(self, options, kind, dims, keeps, run):
        picture = [] if dims == ("eta", "F0", "f") else ["--plot", "r.png"]
        status, text, _ = run("sweep", PAPER, *options, "--out", "r.nc", *picture)
        assert status == 0
        for name in names():
            assert str(Path(name).resolve()) in text
        assert not picture or Path("r.png").read_bytes().startswith(b"\x89PNG")
        with xr.open_dataset("r.nc", engine="h5netcdf") as stored:
            assert stored.attrs["kind"] == kind
            assert stored["status"].dims == dims
            assert ("angle" in stored) == keeps
            assert not keeps or stored["angle"].dims == (*dims, "period")
            assert ("attractor" in stored) == (kind == "basins")

    def test_settings_of_the_run_count_and_its_length_does_not(self, answer, tmp_path):
        study = tmp_path / "s.toml"
        run = "duration = 3.0\ninitial = [0.01, 0.5]\nrtol = 1e-7\nmax_events = 5000\n"
        text = PAPER.read_text().replace("duration = 25.0        # s", run + "max_steps = 6000\n")
        study.write_text(text)
        protocol = answer(study, "--over", "eta=-3,3")["protocol"]
        assert protocol == {
            "periods": 50, "transient": "auto", "recorded": 50, "limit": protocol["limit"],
            "initial": [0.01, 0.5], "follow": None, "rtol": 1e-7,
            "max_events": 5000, "max_steps": 6000,
        }  # fmt: skip
        assert answer(study, *ETA, "--method", "exact")["method"] == "exact"


class TestJson:
    def test_intervals_ascend_for_each_branch(self, answer):
        told = answer(PAPER, "--over", "eta=3,-60,0,12,-24", "--follow", "eta", *SHORT)
        assert told["axes"]["eta"]["values"] == [3.0, -60.0, 0.0, 12.0, -24.0]
        for branch in ("up", "down"):
            mine = [one for one in told["intervals"] if one["branch"] == branch]
            ends = [end for one in mine for end in (one["from"], one["to"])]
            assert ends == sorted(ends)
            assert sum(one["points"] for one in mine) == 5

    def test_is_complete_and_right(self, answer):
        told = answer(PAPER, *ETA)
        assert set(told) == {
            "wedgebrake", "versions", "kind", "method", "system", "groups", "protocol", "axes",
            "points", "status", "motion", "stick_slip", "linear_stability", "intervals",
            "attractors", "speed", "files", "warnings", "returns", "contacts", "motion_period",
            "not_built", "largest", "natural_frequencies",
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
        """Forwards, eta + mu_k (alpha - 1) > 0: alpha = 1 + 0.1/0.3.

        Source: docs/equations.md, "Linear stability of one inertia".
        """
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
        assert told["not_built"]["at"] == {"inertia": -1.0}
        with pytest.raises(wb.InputError) as refused:
            wb.load_study(PAPER).system.replace(inertia=-1.0)
        assert told["not_built"]["reason"] == str(refused.value)
        assert told["intervals"][0]["to"] == 0.0
        told = answer(PAPER, "--over", "eta=-3,3", "--set", "max_events=10", *SHORT)
        assert told["status"] == {"stopped at max_events": 2}


class TestText:
    def test_names_the_limit_of_linear_stability(self, run):
        status, text, message = run("sweep", PAPER, *ETA)
        assert status == 0
        assert "eta = -0.054" in text
        assert "12 of 12 points" in message

    @pytest.mark.parametrize("lengths", [[1] * 500, [1, 50] * 30, [3] * 12, [*range(1, 40)]])
    def test_about_a_dozen_lines_however_many_intervals(self, lengths, answer):
        report = answer(PAPER, "--over", "eta=1,2", *SHORT)
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
        # They cover every value once.
        place = 0
        for low, high, _ in rows:
            assert int(low) == place
            place = int(high or low) + 1
        assert place == total


class TestFiles:
    @pytest.mark.usefixtures("full_disk")
    @pytest.mark.parametrize("option", ["--out", "--plot"])
    def test_the_words_are_said_where_a_file_fails(self, option, run):
        """Hours of work must not be for nothing."""
        name = "r.nc" if option == "--out" else "r.png"
        Path(name).write_text("earlier")
        status, text, message = run("sweep", PAPER, *ETA, option, name)
        assert status == 1
        assert "eta = -0.054" in text
        assert name not in text
        assert f"{option} {name}" in message
        assert names() == [name]
        assert Path(name).read_text() == "earlier"


def stored(path: str = "r.zarr") -> xr.Dataset:
    return xr.open_dataset(path, engine=StoreBackend).load()


class TestStore:
    def test_holds_the_same_numbers_and_goes_on(self, answer):
        files = ["--out", "r.nc", "--plot", "r.svg"]
        told = answer(PAPER, *ETA, "--store", "r.zarr", *files)
        for what, name in (("data", "r.nc"), ("picture", "r.svg"), ("store", "r.zarr")):
            assert told["files"][what] == str(Path(name).resolve())
        system = wb.load_study(PAPER).system
        wanted = wb.bifurcation(system, eta=np.linspace(-60, 12, 12), periods=30, transient=20)
        assert stored().identical(wanted)
        told = answer(PAPER, *ETA, "--store", "r.zarr", "--resume", "--out", "again.nc")
        assert (told["speed"]["computed"], told["speed"]["resumed"]) == (0, 12)
        for name in ("r.nc", "again.nc"):
            with xr.open_dataset(name, engine="h5netcdf", decode_cf=False) as kept:
                assert same(kept, wanted)
                for label in ("kind", "system", "protocol", "axes"):
                    assert kept.attrs[label] == wanted.attrs[label]

    def test_repairs_what_is_damaged_and_warns(self, run):
        options = ["--over", "eta=-60:12:100", *SHORT, "--store", "r.zarr"]
        assert run("sweep", PAPER, *options)[0] == 0
        before = stored()
        chunk = next(path for path in Path("r.zarr/results/c").rglob("*") if path.is_file())
        chunk.write_bytes(chunk.read_bytes()[:-1])
        status, text, message = run("sweep", PAPER, *options, "--resume", "--json")
        assert status == 0
        told = strict_json(text)
        assert 0 < told["speed"]["computed"] < 100
        assert told["speed"]["computed"] + told["speed"]["resumed"] == 100
        [warning] = told["warnings"]
        assert warning in message
        assert stored().identical(before)

    def test_is_not_created_if_the_sweep_is_refused(self, run):
        assert run("sweep", PAPER, "--over", "inertia=-2,-1", "--store", "r.zarr")[0] == 2
        assert names() == []

    def test_of_another_sweep_is_refused_by_the_name_of_the_option(self, run):
        assert run("sweep", PAPER, *ETA, "--store", "r.zarr")[0] == 0
        for options, name in (
            (ETA, "--resume"),
            ([*ETA, "--resume", "--set", "damping=0.2"], "system.driveline.damping"),
            ([*MAP, "--resume"], "axes.eta"),
        ):
            status, text, message = run("sweep", PAPER, *options, "--store", "r.zarr")
            assert (status, text) == (2, "")
            assert "--store r.zarr: " in message
            assert name in message

    def test_that_cannot_be_written(self, run, monkeypatch):
        def fail(*_, **__):
            raise OutputError.of("path", "r.zarr", "cannot be written.")

        monkeypatch.setattr("wedgebrake.sweeps.store.SweepStore.write", fail)
        status, text, message = run("sweep", PAPER, *ETA, "--store", "r.zarr")
        assert (status, text) == (1, "")
        assert "error: --store r.zarr: cannot be written" in message


# What is wrong: (the arguments, what the message names).
WRONG: dict[str, tuple[list[str], str]] = {
    "nothing to sweep": ([], "--over"),
    "no values": (["--over", "eta"], "--over eta"),
    "no name": (["--over", "=1:2:3"], "--over =1:2:3"),
    "one value": (["--over", "eta=-30"], "--over eta=-30"),
    "unknown scale": (["--over", "eta=1:2:3:lin"], "'lin'"),
    "word for a number": (["--over", "eta=a:2:3"], "'a'"),
    "decimal comma": (["--over", "eta=0,5:1,5:9"], "'0,5'"),
    "endless count": (["--over", "eta=1:2:" + "9" * 5000], "--over"),
    "huge count": (["--over", "eta=1:2:999999999"], "points = 999999999"),
    "ratios through zero": (["--over", "eta=-1:1:5:log"], "eta=-1:1:5:log"),
    "nan": (["--over", "eta=nan:1:5"], "'nan'"),
    "misspelt": (["--over", "etta=1:2:3"], "'eta'"),
    "of another brake": (["--over", "wrap_angle=1:2:3"], "kind 'wedge'"),
    "argument of Python": (["--over", "system=1:2:3"], "system"),
    "no number": (["--over", "release=0,1"], "release"),
    "with its table": (["--over", "driveline.inertia=1,2"], "without its table: inertia"),
    "unprintable": (["--over", "\x1b[1m=1,2"], "'\\x1b[1m"),
    "twice": (["--over", "eta=1,2", "--over", "eta=3,4"], "--over eta"),
    "too many points": (["--over", "eta=1:2:99999", "--over", "F0=1:2:99999"], "GiB of memory"),
    "no possible value": (["--over", "inertia=-3:-1:3"], "inertia"),
    "three in a picture": ([*MAP, "--over", "f=1,2", "--plot", "r.png"], "--plot"),
    "picture without points": ([*ETA, "--set", "keep_points=false", "--plot", "r.png"], "--plot"),
    "basins without points": ([*STARTS, "--set", "keep_points=false"], "keep_points"),
    "resume nothing": ([*ETA, "--resume"], "--store"),
    "store nowhere": ([*ETA, "--store", "no/r.zarr"], "--store no/r.zarr"),
    "store on a file": ([*ETA, "--store", "ok.toml", "--resume"], "--store ok.toml"),
    "store in a folder": ([*ETA, "--store", ".", "--resume"], "--store ."),
    "store that is there": ([*ETA, "--store", "folder"], "--store folder"),
    "data before the store": (
        [*ETA, "--store", "r.zarr", "--out", "no/r.nc"],
        "--out no/r.nc",
    ),
    "no threads": ([*ETA, "--threads", "0"], "--threads 0"),
    "negative transient": ([*ETA, "--transient", "-1"], "--transient -1"),
    "no periods": ([*ETA, "--periods", "0"], "--periods 0"),
    "periods of the run": ([*ETA, "--set", "periods=5"], "--set periods"),
    "transient twice": ([*ETA, "--set", "transient=5"], "--set transient"),
    "late start": ([*ETA, "--set", "start_time=5"], "run.start_time = 5.0"),
    "with the table": ([*ETA, "--set", "sweep.limit=5"], "--set sweep.limit=5"),
    "limit of nothing": ([*ETA, "--set", "limit=0"], "sweep.limit = 0"),
    "unknown method": ([*ETA, "--method", "exakt"], "--method exakt"),
    "transient beyond": ([*ETA, "--transient", "50", "--periods", "40"], "--transient 50: must"),
    "crossings of a driven system": ([*ETA, "--crossings", "5"], "--crossings"),
}


@pytest.mark.parametrize("case", WRONG)
def test_wrong_input(case, run, tmp_path):
    options, words = WRONG[case]
    (tmp_path / "ok.toml").write_text(PAPER.read_text())
    (tmp_path / "folder").mkdir()
    status, text, message = run("sweep", "ok.toml", *options)
    assert (status, text) == (2, "")
    assert "internal" not in message
    assert words in message
    assert names() == ["folder", "ok.toml"]


class TestStudyWithASweep:
    """A study may say what to sweep, whatever is done with it."""

    EXAMPLE = EXAMPLES / "sweep.toml"

    def test_is_valid_by_the_schema(self):
        VALIDATOR.validate(tomllib.loads(self.EXAMPLE.read_text()))

    @pytest.mark.parametrize(
        "table",
        [
            {"etta": [1.0]},
            {"eta": {"from": 1.0, "to": 2.0, "points": 1}},
            {"eta": {"from": 1.0, "to": 2.0, "points": 3, "scale": "lin"}},
            {"transient": "soon"},
            {"periods": 0},
            {"follow": 3},
            [],
        ],
    )
    def test_schema_refuses_what_the_reader_refuses(self, table):
        tables = {**tomllib.loads(self.EXAMPLE.read_text()), "sweep": table}
        with pytest.raises(jsonschema.ValidationError):
            VALIDATOR.validate(tables)
        with pytest.raises(wb.InputError, match="sweep"):
            parse_study(tables)

    def test_is_accepted_by_every_command(self, run, tmp_path):
        assert run("sweep", self.EXAMPLE, *SHORT)[0] == 0
        (tmp_path / "s.toml").write_text(
            self.EXAMPLE.read_text().replace("points = 400", "points = 1", 1)
        )
        for command in ("stability", "simulate", "sweep"):
            assert command == "sweep" or run(command, self.EXAMPLE)[0] == 0
            status, _, message = run(command, "s.toml")
            assert status == 2
            assert "sweep.eta.points = 1" in message


class TestInterrupt:
    """Ctrl-C in a process of its own."""

    @staticmethod
    def interrupted(folder: Path, options: list[str], ready) -> str:
        """Return what a sweep says that is interrupted when it is ready."""
        process = started(
            [PROGRAM, "sweep", PAPER, *options, "--out", "r.nc", "--plot", "r.png"],
            cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        )  # fmt: skip
        text, message = interrupted(process, ready)
        assert (process.returncode, text) == (1, "")
        assert "Traceback" not in message
        return message.partition("interrupted")[2]

    def test_leaves_a_store_that_goes_on(self, tmp_path, run):
        store, options = tmp_path / "r.zarr", ["--over", "eta=-60:12:1000", "--store", "r.zarr"]
        note = self.interrupted(
            tmp_path,
            [*options, "--threads", "1"],
            lambda: any(path.is_file() for path in store.glob("results/c/**/*")),
        )
        assert "--resume" in note
        assert names() == ["r.zarr"]
        kept = stored(store)
        computed = kept["status"].to_numpy() == PointStatus.COMPLETED
        assert 0 < np.count_nonzero(computed) < 1000
        values = np.linspace(-60, 12, 1000)[computed][:20]
        alone = wb.bifurcation(wb.load_study(PAPER).system, eta=values)
        assert np.array_equal(kept["final_angle"].to_numpy()[computed][:20], alone["final_angle"])
        told = strict_json(run("sweep", PAPER, *options, "--resume", "--json")[1])
        assert told["status"] == {"completed": 1000}
        assert told["speed"]["resumed"] >= np.count_nonzero(computed)
        assert told["speed"]["computed"] > 0

    def test_within_a_point_that_takes_an_hour(self, tmp_path, monkeypatch):
        monkeypatch.chdir(tmp_path)
        # Few periods are recorded: a long record would delay the store.
        periods = ["--periods", "4000000", "--transient", "3999950"]
        long = ["--over", "eta=-60:12:50", *periods, "--store", "r.zarr"]

        def ready() -> bool:
            time.sleep(0.3)  # from the store to the first point
            return Path("r.zarr").exists()

        self.interrupted(tmp_path, long, ready)
        assert names() == ["r.zarr"]
