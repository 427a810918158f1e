"""The command line: help, output, exit status, files, and what is loaded when."""

from __future__ import annotations

import copy
import json
import math
import os
import platform
import re
import resource
import shutil
import signal
import subprocess
import sys
import threading
import time
import tomllib
from importlib.metadata import version
from pathlib import Path

import jsonschema
import numpy as np
import pytest
import xarray as xr

import wedgebrake as wb
from children import started
from printed import strict_json, unwrapped
from wedgebrake.cli import output as files
from wedgebrake.cli.interrupts import announce_compilation
from wedgebrake.cli.main import main
from wedgebrake.cli.report import to_json
from wedgebrake.model.study import schema
from wedgebrake.solvers.interrupts import interruptible

PROGRAM = Path(sys.executable).parent / "wedgebrake"
EXAMPLES = sorted((Path(__file__).parents[2] / "examples").glob("*.toml"))
PAPER = next(path for path in EXAMPLES if path.name == "paper.toml")
SHORT = ["--set", "periods=20"]

PLANTS = {
    "completed": (wb.paper.system(), {"periods": 60}),
    "diverged": (wb.paper.system(damping=1.0, static=0.33, release=False), {"periods": 60}),
    "event_limit": (wb.paper.system(), {"periods": 60, "max_events": 10}),
}


class TestHelp:
    def test_of_the_program(self, run):
        status, text, message = run("--help")
        assert (status, message) == (0, "")
        for word in ("stability", "simulate", "schema", "--version", "--help", "paper.toml"):
            assert word in text
        assert "Exit status: 0 done, 2 the input is wrong, 1 anything else." in unwrapped(text)

    @pytest.mark.parametrize(
        ("command", "words"),
        [
            (
                "stability",
                ["eigenvalues", "Hopf", "--set NAME=VALUE", "eta=-30", "--json", "Example:"],
            ),
            (
                "simulate",
                [
                    "250 periods", "class of stick-slip", "--set NAME=VALUE", "periods=50",
                    "--method NAME", "exact", "smooth", "ode14x", "--out RUN.nc", "netCDF",
                    "--plot RUN.png", ".png, .svg or .pdf", "--json", "standard output",
                    '"inf"', "exit status 0", "max_events", "Example:",
                ],
            ),
            ("schema", ["JSON schema", "unit and range"]),
        ],
    )  # fmt: skip
    def test_of_a_command(self, command, words, run):
        status, text, message = run(command, "--help")
        assert (status, message) == (0, "")
        assert text.startswith(f"Usage: wedgebrake {command}")
        for word in words:
            assert word in unwrapped(text), word
        # Each option is explained.
        options = text.partition("Options:")[2].partition("Example:")[0]
        for line in re.findall(r"^  (-.*(?:\n {6,}.*)*)", options, re.MULTILINE):
            assert len(unwrapped(line).split()) >= 4, line
        assert max(map(len, text.splitlines())) <= 80
        assert run(command, "-h") == (0, text, "")

    def test_examples_in_the_help_work(self, run, tmp_path):
        shutil.copytree(PAPER.parent, tmp_path, dirs_exist_ok=True)
        for command in ("stability", "simulate"):
            example = unwrapped(run(command, "--help")[1]).partition("Example: wedgebrake ")[2]
            assert example.startswith(command)
            assert run(*example.split())[0] == 0

    def test_version(self, run):
        assert run("--version") == (0, f"wedgebrake {wb.__version__}\n", "")
        assert version("wedgebrake") == wb.__version__


class TestSimulateJson:
    @pytest.fixture
    def answer(self, run):
        status, text, _ = run("simulate", PAPER, *SHORT, "--json")
        assert status == 0
        assert text.endswith("}\n")
        assert text.count("\n") == 1
        return strict_json(text)

    def test_is_complete(self, answer):
        assert set(answer) == {
            "wedgebrake", "versions", "system", "groups", "method", "options", "status",
            "message", "final", "stability", "steady_from", "stick_slip_class", "stick_share",
            "brake_torque", "events", "sticks", "poincare", "rest_from", "repeats_after",
            "summary",
        }  # fmt: skip
        assert answer["wedgebrake"] == wb.__version__
        assert answer["versions"] == {
            "python": platform.python_version(),
            **{name: version(name) for name in ("numpy", "scipy", "numba", "xarray", "pydantic")},
        }
        assert set(answer["final"]) == {"time", "angle", "velocity"}
        assert set(answer["sticks"]) == {"start", "end", "entry", "exit"}
        assert set(answer["poincare"]) == {"period", "time", "angle", "velocity"}
        assert answer["status"] == "completed"
        assert answer["method"] == "exact"
        assert answer["stick_slip_class"] == "bidirectional stick-slip"

    def test_holds_the_same_numbers(self, answer):
        study = wb.load_study(PAPER).changed(periods=20)
        response = wb.simulate(study.system, **study.run.arguments())
        assert answer["system"] == study.system.as_dict()
        assert answer["groups"] == study.system.groups.as_dict()
        assert answer["options"] == json.loads(response.attrs["options"])
        assert answer["stability"] == strict_json(to_json(wb.stability(study.system).as_dict()))
        for name in ("time", "angle", "velocity"):
            assert answer["final"][name] == response.attrs[f"final_{name}"]
            values = response[f"poincare_{name}"].to_numpy()
            assert np.array_equal(answer["poincare"][name], values)
        assert np.array_equal(answer["poincare"]["period"], response["period"])
        for name in ("start", "end", "entry", "exit"):
            assert np.array_equal(answer["sticks"][name], response[f"stick_{name}"])
        assert sum(answer["events"].values()) == response.sizes["event"]
        last = wb.sticks(response, answer["steady_from"])
        assert answer["stick_slip_class"] == last.attrs["class"]
        assert answer["stick_share"] == last.attrs["share"]

    def test_can_be_simulated_again(self, answer):
        """The system in the JSON is the whole system."""
        tables = answer["system"]
        parts = {
            "driveline": wb.Driveline,
            "brake": wb.WedgeBrake,
            "friction": wb.CoulombFriction,
            "actuation": wb.Actuation,
            "excitation": wb.HarmonicTorque,
        }
        for table in tables.values():
            table.pop("kind", None)
        system = wb.BrakedDriveline(**{name: part(**tables[name]) for name, part in parts.items()})
        response = wb.simulate(system, periods=20)
        assert response.attrs["final_velocity"] == answer["final"]["velocity"]

    def test_has_no_nan_for_a_brake_that_locks(self, run):
        example = PAPER.with_name("self_locking.toml")
        for command in ("simulate", "stability"):
            status, text, _ = run(command, example, "--json")
            assert status == 0
            assert "NaN" not in text
            strict_json(text)

    def test_numbers_that_json_has_not(self):
        given = {"a": [math.inf, -np.inf, math.nan], "b": np.float64(0.1), "c": np.arange(2)}
        text = to_json(given)
        assert strict_json(text) == {"a": ["inf", "-inf", None], "b": 0.1, "c": [0, 1]}

    def test_stands_alone_on_standard_output(self, run):
        status, text, _ = run(
            "simulate", PAPER, *SHORT, "--json", "--out", "r.nc", "--plot", "r.svg"
        )
        assert status == 0
        strict_json(text)
        assert Path("r.nc").is_file()
        assert Path("r.svg").is_file()


class TestStabilityJson:
    def test_is_complete(self, run):
        status, text, message = run("stability", PAPER, "--json")
        assert (status, message) == (0, "")
        answer = strict_json(text)
        verdict = wb.stability(wb.load_study(PAPER).system)
        assert answer.pop("wedgebrake") == wb.__version__
        assert answer.pop("system") == wb.load_study(PAPER).system.as_dict()
        assert answer.pop("groups")["eta"] == -24.0
        assert answer == strict_json(to_json(verdict.as_dict()))


class TestWords:
    def test_of_a_response(self, run):
        status, text, _ = run("simulate", PAPER)
        assert status == 0
        for word in (
            "Wedge brake, Coulomb friction: eta = -24, f = 0.63, F0 = 0.036, alpha = 1.18",
            "Linear stability:",
            "Response (exact): Bidirectional stick-slip vibration, velocity between",
            "ran to the end",
            " stick, ",
            " slip, ",
            "state at t = 25 s",
        ):
            assert word in text
        assert "\n\n\n" not in text

    def test_of_linear_stability(self, run):
        status, text, message = run("stability", PAPER)
        assert (status, message) == (0, "")
        assert "Linear stability: Sliding forwards" in text
        assert "Hopf: eta = -0.054" in text
        status, text, _ = run("stability", PAPER.with_name("self_locking.toml"))
        assert status == 0
        assert "Sliding forwards: does not exist (self-locking)." in text

    def test_of_the_wedge_angle(self, run):
        _, text, _ = run("stability", PAPER, "--set", "eta=-0.4", "--set", "static=0.33")
        assert text.endswith(
            "\nWedge angle, here 0.340234 rad, with all else as it is:\n"
            "  self-locking up to 0.291457 rad, at rest up to 0.318748 rad\n"
            "  Hopf: forwards 0.610726 rad, backwards 0.0996687 rad (sliding decays above)\n"
        )
        _, text, _ = run("stability", PAPER, "--set", "eta=0")
        assert text.endswith("\n  self-locking up to 0.291457 rad\n")
        _, text, _ = run("stability", PAPER.with_name("conventional.toml"))
        assert "angle" not in text

    @pytest.mark.parametrize("command", ["stability", "simulate"])
    def test_of_friction_that_falls_on_a_turning_shaft(self, command, run):
        law = 'kind = "tabulated"\nspeeds = [0.0, 1.0]\ncoefficients = [0.35, 0.25]'
        text = PAPER.with_name("conventional.toml").read_text()
        Path("falling.toml").write_text(text.replace('kind = "coulomb"\nkinetic = 0.30', law))
        changes = ["slope=0", "initial_force=4000", "drive_speed=1"]
        options = [text for change in changes for text in ("--set", change)]
        _, text, _ = run(command, "falling.toml", *options)
        assert "Linearly unstable" in text
        _, text, _ = run(command, "falling.toml", *options, "--json")
        answer = strict_json(text)
        verdict = answer.get("stability", answer)
        assert verdict["forward"]["speed"] == 1.0
        assert verdict["damping"] == verdict["forward"]["damping"] == pytest.approx(-15.9)
        assert verdict["stable"] is verdict["forward"]["stable"] is False

    def test_torque_of_the_brake(self, run):
        study = wb.load_study(PAPER)
        response = wb.simulate(study.system, **study.run.arguments())
        torque = wb.brake_torque(response, 0.8 * response.attrs["final_time"])
        _, text, _ = run("simulate", PAPER)
        words = (
            f"brake torque: mean {torque.mean:.4g} N m, mean size {torque.mean_size:.4g} N m, peak"
            f" {torque.peak:.4g} N m"
        )
        assert words in text
        _, text, _ = run("simulate", PAPER, "--json")
        assert strict_json(text)["brake_torque"]["peak"] == torque.peak
        # Samples too far apart for an integral.
        status, text, _ = run("simulate", PAPER, "--set", "samples_per_period=2")
        assert status == 0
        assert "brake torque" not in text

    @pytest.mark.parametrize(
        ("changes", "words"),
        [
            (["F0=3.0", "eta=0.0"], "The brake holds the driveline at rest."),
            (["release=false", "eta=-60"], "grows without bound"),
            (["duration=0"], "Response (exact)"),
            (["duration=1e-9"], "Response (exact)"),
            (["periods=1", "samples_per_period=1"], "Response (exact)"),
            (["kinetic=0", "static=0", "slope=0"], "Non-stick-slip vibration"),
            (["amplitude=0"], "The brake holds the driveline at rest."),
            (
                ["amplitude=0", "slope=0", "initial=[0.1, 0.0]"],
                "The brake holds the driveline, at rest from 0.8482 s.",
            ),
            (
                ["amplitude=0", "slope=0", "initial=[0.1, 0.0]", "duration=1"],
                "It ends at rest from 0.8482 s.",
            ),
            (["amplitude=0", "drive_speed=3"], "No torque drives it: its periods are not counted."),
            (["amplitude=0", "drive_speed=3"], "rad/s, stuck "),
            (["periods=40"], "The run is too short to tell after how many periods it repeats."),
            (["periods=40"], " % of the time (of the last 0.798 s)."),
        ],
    )
    def test_of_every_kind_of_motion(self, changes, words, run):
        study = PAPER.with_name("conventional.toml")
        options = [text for change in changes for text in ("--set", change)]
        status, text, _ = run("simulate", study, *options, "--plot", "r.svg", "--out", "r.nc")
        assert status == 0
        assert words in text
        assert Path("r.svg").read_text().startswith("<?xml")
        with xr.open_dataset("r.nc", engine="h5netcdf") as stored:
            assert stored.sizes["time"] > 0
        status, text, _ = run("simulate", study, *options, "--json")
        assert status == 0
        strict_json(text)

    def test_what_counts_as_rest_with_smooth_friction(self, run):
        words = (
            "a smoothed brake never rests: as stick, and as rest, counts |sliding speed| below"
            " 0.02 m/s (0.1 rad/s) for longer than 1 % of a torque period"
        )
        law = 'kind = "smoothed"\nsteepness = 50'
        Path("s.toml").write_text(PAPER.read_text().replace('kind = "coulomb"', law))
        for method in ("smooth", "ode14x"):
            _, text, _ = run("simulate", "s.toml", *SHORT, "--method", method)
            assert words in text
        for study, change in ((PAPER, "eta=-24"), ("s.toml", "F0=0.0001")):
            _, text, _ = run("simulate", study, *SHORT, "--set", change)
            assert "never rests" not in text

    def test_of_few_smooth_samples(self, run):
        """Even where no sample lies in the steady motion."""
        text = PAPER.read_text().replace('"coulomb"', '"smoothed"')
        Path("s.toml").write_text(text)
        status, text, _ = run("simulate", "s.toml", "--set", "periods=1",
                              "--set", "samples_per_period=1")  # fmt: skip
        assert status == 0
        assert "Response (smooth)" in text


class TestExitStatus:
    def test_one_where_a_limit_ends_the_run(self, run):
        status, text, _ = run("simulate", PAPER, "--set", "max_events=10", "--out", "r.nc")
        assert status == 1
        assert "than max_events allows" in text
        assert "Raise max_events" in text
        assert Path("r.nc").is_file()  # what was reached is worth having
        status, text, _ = run("simulate", PAPER, "--set", "max_events=10", "--json")
        assert status == 1
        assert strict_json(text)["status"] == "event_limit"

    def test_zero_where_the_motion_diverges(self, run):
        diverging = ["--set", "release=false", "--set", "eta=-60"]
        status, text, _ = run("simulate", PAPER, *diverging, "--json")
        assert status == 0
        answer = strict_json(text)
        assert answer["status"] == "diverged"
        assert answer["summary"] == answer["message"]

    def test_one_and_no_traceback_for_a_defect(self, run, monkeypatch):
        def fail(*_):
            raise ZeroDivisionError("by zero")

        monkeypatch.setattr("wedgebrake.analysis.linear_stability.stability", fail)
        status, text, message = run("stability", PAPER)
        assert (status, text) == (1, "")
        assert "internal error: ZeroDivisionError: by zero" in message
        assert "WEDGEBRAKE_TRACEBACK=1" in message
        assert "Traceback" not in message
        monkeypatch.setenv("WEDGEBRAKE_TRACEBACK", "1")
        monkeypatch.setattr(sys, "argv", ["wedgebrake", "stability", str(PAPER)])
        with pytest.raises(ZeroDivisionError):
            main()

    def test_one_where_memory_ends(self, run, monkeypatch):
        def fail(*_, **__):
            raise MemoryError

        monkeypatch.setattr("wedgebrake.solvers.simulate.simulate", fail)
        status, text, message = run("simulate", PAPER)
        assert (status, text) == (1, "")
        assert "error: not enough memory. Lower duration, periods or samples_per_period" in message


class TestFiles:
    @pytest.mark.parametrize("plant", PLANTS)
    def test_netcdf_holds_the_same_numbers(self, plant, tmp_path):
        system, options = PLANTS[plant]
        response = wb.simulate(system, **options)
        assert response.attrs["status"] == plant
        files.write_netcdf(response, tmp_path / "r.nc")
        self.check(tmp_path / "r.nc", response)

    def test_of_the_command(self, run):
        status, text, _ = run("simulate", PAPER, *SHORT, "--out", "r.nc", "--plot", "r.pdf")
        assert status == 0
        assert f"Picture: {Path('r.pdf').resolve()}\nData: {Path('r.nc').resolve()}\n" in text
        study = wb.load_study(PAPER).changed(periods=20)
        self.check(Path("r.nc"), wb.simulate(study.system, **study.run.arguments()))
        assert sorted(path.name for path in Path().iterdir()) == ["r.nc", "r.pdf"]

    @staticmethod
    def check(path: Path, response: xr.Dataset) -> None:
        with xr.open_dataset(path, engine="h5netcdf") as stored:
            assert set(stored.variables) == set(response.variables)
            for name in response.variables:
                assert stored[name].dtype == response[name].dtype
                assert stored[name].dims == response[name].dims
                assert stored[name].to_numpy().tobytes() == response[name].to_numpy().tobytes()
                assert stored[name].attrs["units"] == response[name].attrs["units"]
                assert stored[name].attrs["long_name"] == response[name].attrs["long_name"]
            assert dict(stored.attrs) == dict(response.attrs)
            assert float(wb.sticks(stored).attrs["share"]) == wb.sticks(response).attrs["share"]

    def test_have_the_permissions_of_any_file(self, run):
        earlier = os.umask(0o027)
        try:
            run("simulate", PAPER, *SHORT, "--out", "r.nc", "--plot", "r.png")
        finally:
            os.umask(earlier)
        assert {Path(name).stat().st_mode & 0o777 for name in ("r.nc", "r.png")} == {0o640}

    def test_replace_what_was_there(self, run):
        Path("r.nc").write_text("earlier")
        assert run("simulate", PAPER, *SHORT, "--out", "r.nc")[0] == 0
        assert Path("r.nc").read_bytes().startswith(b"\x89HDF")

    @pytest.mark.usefixtures("full_disk")
    def test_are_whole_or_not_there(self, run):
        Path("r.nc").write_text("earlier")
        status, _, message = run("simulate", PAPER, *SHORT, "--out", "r.nc")
        assert status == 1
        assert "error: --out r.nc: cannot be written" in message
        assert "no space left" in message
        assert [path.name for path in Path().iterdir()] == ["r.nc"]
        assert Path("r.nc").read_text() == "earlier"


class TestChanges:
    def test_come_before_the_file(self, run):
        _, text, _ = run("stability", PAPER, "--json", "--set", "eta=-3.5", "--set", "inertia=2")
        answer = strict_json(text)
        assert answer["groups"]["eta"] == -3.5
        assert answer["system"]["driveline"]["inertia"] == 2.0

    @pytest.mark.parametrize(
        ("change", "where", "value"),
        [
            ("slope=-3", ("actuation", "slope"), -3.0),
            ("slope = -3", ("actuation", "slope"), -3.0),
            ("radius=.25", ("brake", "radius"), 0.25),
            ("radius=1.", ("brake", "radius"), 1.0),
            ("radius=2.5e-1", ("brake", "radius"), 0.25),
            ("stiffness=20_000", ("driveline", "stiffness"), 20000.0),
            ("release=false", ("actuation", "release"), False),
            ("static=0.5", ("friction", "static"), 0.5),
        ],
    )
    def test_are_written_as_in_the_file(self, change, where, value, run):
        _, text, _ = run("stability", PAPER, "--json", "--set", change)
        table, name = where
        assert strict_json(text)["system"][table][name] == value

    def test_of_the_run(self, run):
        _, text, _ = run("simulate", PAPER, "--json", "--set", "periods=3",
                         "--set", "initial=[0.001, 0.5]", "--set", "start_time=1")  # fmt: skip
        answer = strict_json(text)
        assert answer["options"] == {
            "initial": [0.001, 0.5], "start_time": 1.0, "max_events": 10_000_000
        }  # fmt: skip
        assert answer["poincare"]["period"][-1] - answer["poincare"]["period"][0] == 2
        assert answer["final"]["time"] == pytest.approx(1.0 + 3.0 / 10.026761414789407)

    @pytest.mark.parametrize("options", [["--method", "exact"], ["--set", "method=exact"]])
    def test_of_the_method(self, options, run):
        _, text, _ = run("simulate", PAPER, *SHORT, "--json", *options)
        assert strict_json(text)["method"] == "exact"


class TestExamples:
    def test_are_there(self):
        names = [path.stem for path in EXAMPLES]
        assert names == ["band", "conventional", "paper", "self_locking", "sweep"]

    @pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
    def test_run(self, path, run):
        for command in ("stability", "simulate"):
            status, text, _ = run(command, path)
            assert status == 0
            assert text.count("\n") >= 5
            status, text, _ = run(command, path, "--json")
            assert status == 0
            strict_json(text)

    @pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
    def test_are_valid_by_the_schema(self, path):
        jsonschema.validate(tomllib.loads(path.read_text()), schema())


class TestSchema:
    def test_is_printed_and_right_itself(self, run):
        status, text, message = run("schema")
        assert (status, message) == (0, "")
        assert strict_json(text) == json.loads(json.dumps(schema()))
        jsonschema.Draft202012Validator.check_schema(schema())

    @pytest.mark.parametrize(
        ("where", "value"),
        [
            (("driveline", "inertia"), -1.0),
            (("driveline", "inertia"), "1"),
            (("driveline", "mass"), 1.0),
            (("driveline",), [{}]),
            (("driveline",), None),
            (("brake", "kind"), "Wedge"),
            (("brake", "kind"), None),
            (("brake", "angle"), 19.5),
            (("friction", "kinetic"), 30),
            (("actuation", "release"), 1),
            (("groups", "eta"), "low"),
            (("groups", "delta"), 1.0),
            (("run", "periods"), 2.5),
            (("run", "initial"), [0.0]),
            (("run", "initial"), [0.0, 0.0, 0.0]),
            (("run", "method"), "exakt"),
            (("run", "rtol"), 0.0),
            (("runs",), {}),
        ],
    )
    def test_refuses_what_is_wrong(self, where, value):
        study = copy.deepcopy(tomllib.loads(PAPER.read_text()))
        *tables, name = where
        table = study
        for step in tables:
            table = table[step]
        table[name] = value
        if value is None:
            del table[name]
        with pytest.raises(jsonschema.ValidationError):
            jsonschema.validate(study, schema())

    def test_says_unit_symbol_and_meaning_of_all_numbers(self):
        def fields(node):
            if isinstance(node, dict):
                yield from node.get("properties", {}).items()
                for value in node.values():
                    yield from fields(value)
            elif isinstance(node, list):
                for value in node:
                    yield from fields(value)

        said = 0
        for table, node in schema()["properties"].items():
            for name, field in fields({"x": node}):
                if name != "kind" and table != "groups":
                    assert {"description", "unit", "symbol", "example"} <= set(field), (table, name)
                    said += 1
        assert said > 30


class TestLoading:
    def test_nothing_heavy_for_what_computes_nothing(self):
        """Numba, xarray and Matplotlib are loaded by `simulate` only."""
        program = (
            "import sys\n"
            "from wedgebrake.cli.main import main\n"
            "def loaded(*arguments):\n"
            "    sys.argv = ['wedgebrake', *arguments]\n"
            "    try:\n"
            "        main()\n"
            "    except SystemExit as stop:\n"
            "        assert not stop.code, stop.code\n"
            "    heavy = {'numba', 'xarray', 'matplotlib', 'scipy', 'pandas'}\n"
            "    print(arguments[0], sorted(heavy & set(sys.modules)), file=sys.stderr)\n"
            "loaded('--help')\n"
            "assert 'numpy' not in sys.modules\n"
            "assert 'pydantic' not in sys.modules\n"
            "loaded('--version')\n"
            "loaded('simulate', '--help')\n"
            "loaded('schema')\n"
            f"loaded('stability', {str(PAPER)!r})\n"
            f"loaded('stability', {str(PAPER)!r}, '--json')\n"
        )
        done = subprocess.run(
            [sys.executable, "-c", program], capture_output=True, text=True, timeout=60
        )
        assert done.returncode == 0, done.stderr
        assert done.stderr.splitlines() == [
            "--help []", "--version []", "simulate []", "schema []", "stability []", "stability []",
        ]  # fmt: skip

    def test_help_costs_little(self):
        """At most 0.4 s of CPU, warm: the best of three."""
        costs = []
        for _ in range(3):
            before = resource.getrusage(resource.RUSAGE_CHILDREN)
            subprocess.run([PROGRAM, "--help"], stdout=subprocess.DEVNULL, check=True, timeout=60)
            after = resource.getrusage(resource.RUSAGE_CHILDREN)
            costs.append(after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)
        assert min(costs) < 0.4, costs


class TestWaiting:
    def test_says_once_that_it_compiles_on_standard_error(self, capsys):
        import numba

        with announce_compilation():
            for _ in range(2):
                numba.njit(lambda x: x + 1)(1)
        output, message = capsys.readouterr()
        assert output == ""
        assert message == "Compiling the kernels: once per installation, about ten seconds ...\n"

    def test_says_nothing_where_nothing_is_compiled(self, run):
        run("simulate", PAPER, *SHORT)
        assert run("simulate", PAPER, *SHORT)[2] == ""

    def test_work_in_a_thread_gives_its_result_or_its_error(self):
        assert interruptible(lambda: 3) == 3
        with pytest.raises(ZeroDivisionError):
            interruptible(lambda: 1 / 0)

    def test_what_a_work_did_last_is_seen(self):
        """It may end at any instant, also just after it was looked at."""
        looked, done, seen = threading.Event(), [], []

        def work():
            looked.wait(timeout=60)
            done.append(1)

        def look():
            seen[:] = done
            looked.set()
            if not seen:
                time.sleep(0.2)  # meanwhile it ends

        interruptible(work, look)
        assert seen == [1]


class TestProcess:
    def test_json_alone_on_standard_output(self):
        done = subprocess.run(
            [PROGRAM, "simulate", PAPER, *SHORT, "--json"],
            capture_output=True, text=True, timeout=120,
        )  # fmt: skip
        assert done.returncode == 0
        assert strict_json(done.stdout)["status"] == "completed"
        assert done.stderr in ("", done.stderr[: done.stderr.find("\n") + 1])

    def test_a_reader_that_goes_away(self):
        """As in `| head -1`."""
        reader, writer = os.pipe()
        os.close(reader)
        with os.fdopen(writer, "wb") as pipe:
            done = subprocess.run(
                [PROGRAM, "schema"], stdout=pipe, stderr=subprocess.PIPE, timeout=60
            )
        assert done.returncode == 1
        assert done.stderr == b""

    @pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full")
    def test_standard_output_that_is_full(self):
        with Path("/dev/full").open("wb") as full:
            done = subprocess.run(
                [PROGRAM, "schema"], stdout=full, stderr=subprocess.PIPE, text=True, timeout=60
            )
        assert done.returncode == 1
        assert done.stderr.startswith("error: ")
        assert "No space left" in done.stderr
        assert len(done.stderr.splitlines()) == 1

    def test_interrupt(self, tmp_path):
        """Ctrl-C in a long run: a word, exit status 1, and no file."""
        long = ["--set", "periods=1000000", "--set", "samples_per_period=1"]
        process = started(
            [PROGRAM, "simulate", PAPER, *long, "--out", "r.nc", "--plot", "r.png"],
            cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        )  # fmt: skip
        time.sleep(2.0)
        process.send_signal(signal.SIGINT)
        text, message = process.communicate(timeout=60)
        assert process.returncode == 1
        assert text == ""
        assert message.splitlines()[-1] == "interrupted"
        assert "Traceback" not in message
        assert list(tmp_path.iterdir()) == []

    def test_a_name_that_is_no_text(self, tmp_path):
        name = os.fsdecode(b"r\xff.nc")
        done = subprocess.run(
            [PROGRAM, "simulate", PAPER, *SHORT, "--out", name],
            cwd=tmp_path, capture_output=True, text=True, timeout=120,
        )  # fmt: skip
        assert done.returncode == 0
        assert "r\\udcff.nc" in done.stdout
        assert (tmp_path / name).is_file()
