"""The command line: help, output, exit status, files, and what is loaded when."""

from __future__ import annotations

import copy
import json
import math
import os
import platform
import re
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
import typer
import xarray as xr

import wedgebrake as wb
from printed import names, strict_json
from schemas import DRIVELINES, VALIDATOR
from wedgebrake.cli.commands import app
from wedgebrake.cli.compilation import announce_compilation
from wedgebrake.cli.main import main
from wedgebrake.cli.output import to_json
from wedgebrake.model.exports import write_result
from wedgebrake.model.studies.study import schema
from wedgebrake.model.studies.study_run import RunSettings
from wedgebrake.solvers.interrupts import interruptible

PROGRAM = Path(sys.executable).parent / "wedgebrake"
PAPER = next(path for path in DRIVELINES if path.name == "paper.toml")
CONVENTIONAL = PAPER.with_name("conventional.toml")
SHORT = ["--set", "periods=20"]
LOCKS = ["--vary", "kinetic=0.28..0.42", "--outcome", "self_locked"]
COMMANDS = typer.main.get_command(app).commands


class TestHelp:
    def test_of_the_program(self, run):
        status, text, message = run("--help")
        assert (status, message) == (0, "")
        for word in (*COMMANDS, "--version", "--help"):
            assert re.search(rf"^\s+(-h, )?{word}\b", text, re.MULTILINE), word
        assert run()[0] == 2

    @pytest.mark.parametrize("name", COMMANDS)
    def test_of_a_command(self, name, run):
        """Each option is listed and explained, and the text fits a terminal."""
        status, text, message = run(name, "--help")
        assert (status, message) == (0, "")
        assert text.startswith(f"Usage: wedgebrake {name}")
        assert max(map(len, text.splitlines())) <= 80
        assert run(name, "-h") == (0, text, "")
        for one in COMMANDS[name].params:
            assert one.param_type_name == "argument" or one.opts[0] in text
            assert len(one.help.split()) >= 2

    def test_version(self, run):
        assert run("--version") == (0, f"wedgebrake {wb.__version__}\n", "")
        assert version("wedgebrake") == wb.__version__


class TestSimulateJson:
    def test_holds_the_numbers_of_the_library(self, answer):
        told = answer("simulate", PAPER, *SHORT)
        study = wb.load_study(PAPER).changed(periods=20)
        response = wb.simulate(study.system, **study.arguments())
        assert set(told) == {
            "wedgebrake", "versions", "system", "groups", "method", "options", "status",
            "message", "final", "stability", "steady_from", "stick_slip_class", "stick_share",
            "brake_torque", "events", "sticks", "poincare", "rest_from", "repeats_after",
            "summary",
        }  # fmt: skip
        assert told["wedgebrake"] == wb.__version__
        assert told["versions"] == {
            "python": platform.python_version(),
            **{name: version(name) for name in ("numpy", "scipy", "numba", "xarray", "pydantic")},
        }
        assert (told["status"], told["method"]) == ("completed", "exact")
        assert told["system"] == study.system.as_dict()
        assert told["groups"] == study.system.groups.as_dict()
        assert told["options"] == json.loads(response.attrs["options"])
        assert told["stability"] == strict_json(to_json(wb.stability(study.system).as_dict()))
        for name in ("time", "angle", "velocity"):
            assert told["final"][name] == response.attrs[f"final_{name}"]
            assert np.array_equal(told["poincare"][name], response[f"poincare_{name}"])
        assert np.array_equal(told["poincare"]["period"], response["period"])
        for name in ("start", "end", "entry", "exit"):
            assert np.array_equal(told["sticks"][name], response[f"stick_{name}"])
        assert sum(told["events"].values()) == response.sizes["event"]
        last = wb.sticks(response, told["steady_from"])
        assert told["stick_slip_class"] == last.attrs["class"] == "bidirectional stick-slip"
        assert told["stick_share"] == last.attrs["share"]
        torque = wb.brake_torque(response, told["steady_from"])
        assert told["brake_torque"] == {
            name: getattr(torque, name) for name in ("mean", "mean_size", "peak")
        }

    @pytest.mark.parametrize(
        ("name", "value"), [("eta", -24.0), ("eta", -32.0), ("eta", -22.0), ("f", 0.6302)]
    )
    def test_a_motion_repeats_as_its_class_says(self, name, value, answer):
        told = answer("simulate", PAPER, "--set", f"{name}={value}")["repeats_after"]
        system = wb.load_study(PAPER).system.replace(**{name: value})
        motion = wb.motion(system, periods=250, transient=200)
        assert (told["periods"] if told else 0) == motion.order

    @pytest.mark.parametrize("command", ["simulate", "stability"])
    def test_has_no_nan_for_a_brake_that_locks(self, command, answer):
        answer(command, PAPER.with_name("self_locking.toml"))

    def test_numbers_that_json_has_not(self):
        given = {"a": [math.inf, -np.inf, math.nan], "b": np.float64(0.1), "c": np.arange(2)}
        text = to_json(given)
        assert strict_json(text) == {"a": ["inf", "-inf", None], "b": 0.1, "c": [0, 1]}


def test_stability_json(answer):
    told = answer("stability", PAPER)
    verdict = wb.stability(wb.load_study(PAPER).system)
    assert told.pop("wedgebrake") == wb.__version__
    assert told.pop("system") == wb.load_study(PAPER).system.as_dict()
    assert told.pop("groups")["eta"] == -24.0
    assert told.pop("limits") == []  # the shaft does not turn
    assert told == strict_json(to_json(verdict.as_dict()))


class TestText:
    def test_of_a_response(self, run, answer):
        told = answer("simulate", PAPER)
        _, text, _ = run("simulate", PAPER)
        assert "eta = -24, f = 0.63, F0 = 0.036, alpha = 1.18" in text
        for word in (told["summary"], told["message"], told["stability"]["verdict"]):
            assert word in text
        for name, number in told["brake_torque"].items():
            assert f"{name.replace('_', ' ')} {number:.4g} N m" in text
        for name, count in told["events"].items():
            assert f"{count} {name}" in text

    def test_of_linear_stability(self, run):
        verdict = wb.stability(wb.load_study(PAPER).system)
        _, text, _ = run("stability", PAPER)
        assert verdict.verdict in text
        assert f"eta = {verdict.forward.hopf_eta:.6g}" in text
        _, text, _ = run("stability", PAPER, "--set", "eta=-0.4", "--set", "static=0.33")
        # tan(angle) = mu_k, tan(angle) = mu_s; Hopf: eta + tan(angle) - mu_k = 0 forwards.
        assert f"{math.atan(0.3):.6g} rad, at rest up to {math.atan(0.33):.6g} rad" in text
        assert f"{math.atan(0.7):.6g} rad, backwards {math.atan(0.1):.6g} rad" in text

    @pytest.mark.parametrize(
        ("changes", "found"),
        [
            (["F0=3.0", "eta=0.0"], {"stick_slip_class": "at rest", "rest_from": 0.0}),
            (["release=false", "eta=-60"], {"status": "diverged"}),
            (["duration=0"], {"status": "completed"}),
            (["duration=1e-9"], {"status": "completed"}),
            (["periods=1", "samples_per_period=1"], {"brake_torque": None}),
            (["kinetic=0", "static=0", "slope=0"], {"stick_share": 0.0, "rest_from": None}),
            (["amplitude=0", "slope=0", "initial=[0.1, 0.0]"], {"repeats_after": None}),
            (["amplitude=0", "drive_speed=3"], {"repeats_after": None, "rest_from": None}),
        ],
    )
    def test_of_every_kind_of_motion(self, changes, found, run):
        options = [text for change in changes for text in ("--set", change)]
        status, text, _ = run("simulate", CONVENTIONAL, *options, "--json", "--plot", "r.png")
        told = strict_json(text)
        assert status == 0
        assert {name: told[name] for name in found} == found
        assert Path("r.png").read_bytes().startswith(b"\x89PNG")

    def test_free_motion_ends_at_rest(self, answer):
        """The last stick begins where the velocity is 0 for good."""
        free = ["--set", "amplitude=0", "--set", "slope=0", "--set", "initial=[0.1, 0.0]"]
        told = answer("simulate", CONVENTIONAL, *free)
        assert told["rest_from"] == told["sticks"]["start"][-1] == pytest.approx(0.848, abs=1e-3)
        assert told["final"]["velocity"] == 0.0

    def test_smooth_friction_says_what_counts_as_rest(self, run):
        law = 'kind = "smoothed"\nsteepness = 50'
        Path("s.toml").write_text(PAPER.read_text().replace('kind = "coulomb"', law))
        _, text, _ = run("simulate", "s.toml", "--set", "periods=8")
        assert "0.02 m/s (0.1 rad/s)" in text


class TestExitStatus:
    def test_one_where_a_limit_ends_the_run(self, run):
        status, text, _ = run(
            "simulate", PAPER, "--set", "max_events=10", "--json", "--out", "r.nc"
        )
        assert status == 1
        assert strict_json(text)["status"] == "event_limit"
        assert Path("r.nc").is_file()  # the part that was computed

    @pytest.mark.parametrize(
        ("error", "word"), [(ZeroDivisionError("by zero"), "by zero"), (MemoryError(), "memory")]
    )
    def test_one_and_no_traceback_for_a_defect_or_where_memory_ends(
        self, error, word, run, monkeypatch
    ):
        def fail(*_, **__):
            raise error

        monkeypatch.setattr("wedgebrake.solvers.simulate.simulate", fail)
        status, text, message = run("simulate", PAPER)
        assert (status, text) == (1, "")
        assert word in message
        assert "Traceback" not in message
        if word == "by zero":
            monkeypatch.setenv("WEDGEBRAKE_TRACEBACK", "1")
            monkeypatch.setattr(sys, "argv", ["wedgebrake", "simulate", str(PAPER)])
            with pytest.raises(ZeroDivisionError):
                main()


class TestFiles:
    def test_netcdf_holds_the_same_numbers(self, tmp_path):
        response = wb.simulate(wb.paper.system(), periods=20)
        write_result(response, tmp_path / "r.nc")
        with xr.open_dataset(tmp_path / "r.nc", engine="h5netcdf") as stored:
            assert set(stored.variables) == set(response.variables)
            for name in response.variables:
                assert stored[name].dtype == response[name].dtype
                assert stored[name].dims == response[name].dims
                assert stored[name].to_numpy().tobytes() == response[name].to_numpy().tobytes()
                for label in ("units", "long_name"):
                    assert stored[name].attrs[label] == response[name].attrs[label]
            assert dict(stored.attrs) == dict(response.attrs)
            assert wb.sticks(stored).attrs["share"] == wb.sticks(response).attrs["share"]

    def test_replace_what_was_there_and_have_the_permissions_of_any_file(self, run):
        Path("r.nc").write_text("earlier")
        before = os.umask(0o027)
        try:
            status, text, _ = run("simulate", PAPER, *SHORT, "--out", "r.nc")
        finally:
            os.umask(before)
        assert status == 0
        assert str(Path("r.nc").resolve()) in text
        assert Path("r.nc").read_bytes().startswith(b"\x89HDF")
        assert Path("r.nc").stat().st_mode & 0o777 == 0o640
        assert names() == ["r.nc"]

    @pytest.mark.usefixtures("full_disk")
    def test_are_complete_or_not_there(self, run):
        Path("r.nc").write_text("earlier")
        status, _, message = run("simulate", PAPER, *SHORT, "--out", "r.nc")
        assert status == 1
        assert "--out r.nc" in message
        assert names() == ["r.nc"]
        assert Path("r.nc").read_text() == "earlier"


class TestChanges:
    @pytest.mark.parametrize(
        ("change", "where", "value"),
        [
            ("slope = -3", ("actuation", "slope"), -3.0),
            ("radius=.25", ("brake", "radius"), 0.25),
            ("radius=2.5e-1", ("brake", "radius"), 0.25),
            ("stiffness=20_000", ("driveline", "stiffness"), 20000.0),
            ("release=false", ("actuation", "release"), False),
        ],
    )
    def test_are_written_as_in_the_file(self, change, where, value, answer):
        table, name = where
        assert answer("stability", PAPER, "--set", change)["system"][table][name] == value

    @pytest.mark.parametrize("name", ["resolution", "limits"])
    def test_none_unsets_an_optional_value(self, name, answer, tmp_path):
        sampled = {"sample_time": 0.01, "resolution": 1.0, "limits": (0.0, 900.0)}
        system = wb.load_study(PAPER).system.replace(**sampled)
        (tmp_path / "s.toml").write_text(wb.Study(system, RunSettings()).to_toml())
        told = answer("stability", "s.toml", "--set", f"{name}=none")["system"]["actuation"]
        assert set(sampled) - set(told) == {name}

    def test_none_for_a_length_leaves_the_other(self, answer, tmp_path):
        study = wb.Study(wb.load_study(PAPER).system, RunSettings(duration=0.5))
        (tmp_path / "s.toml").write_text(study.to_toml())
        told = answer("simulate", "s.toml", "--set", "periods=none")
        assert told["final"]["time"] == 0.5

    def test_of_the_run(self, answer):
        changes = ["periods=3", "initial=[0.001, 0.5]", "start_time=1", "method=exact", "eta=-3"]
        told = answer("simulate", PAPER, *[word for one in changes for word in ("--set", one)])
        assert told["groups"]["eta"] == -3.0
        assert told["options"]["initial"] == [0.001, 0.5]
        assert told["final"]["time"] == pytest.approx(1.0 + 3.0 / 10.026761414789407)
        assert answer("simulate", PAPER, *SHORT, "--method", "exact")["method"] == "exact"


@pytest.mark.parametrize("path", DRIVELINES, ids=lambda path: path.stem)
def test_examples_run_and_are_valid_by_the_schema(path, answer):
    VALIDATOR.validate(tomllib.loads(path.read_text()))
    assert answer("stability", path)["verdict"]
    assert answer("simulate", path)["status"] in ("completed", "no_forward_solution")


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
            (("driveline", "mass"), 1.0),
            (("driveline",), [{}]),
            (("brake", "kind"), "Wedge"),
            (("actuation", "release"), 1),
            (("run", "periods"), 2.5),
            (("run", "method"), "exakt"),
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
        with pytest.raises(jsonschema.ValidationError):
            VALIDATOR.validate(study)


def test_nothing_heavy_is_loaded_for_what_computes_nothing():
    """Numba, xarray and Matplotlib are loaded by ``simulate`` only."""
    program = (
        "import sys\n"
        "from wedgebrake.cli.main import main\n"
        "def loaded(heavy, *arguments):\n"
        "    sys.argv = ['wedgebrake', *arguments]\n"
        "    try:\n"
        "        main()\n"
        "    except SystemExit as stop:\n"
        "        assert not stop.code, stop.code\n"
        "    assert not heavy & set(sys.modules), (arguments, heavy & set(sys.modules))\n"
        "heavy = {'numba', 'xarray', 'matplotlib', 'scipy', 'pandas', 'zarr'}\n"
        "for command in ('simulate', 'sweep', 'continue'):\n"
        "    loaded({*heavy, 'numpy'}, command, '--help')\n"
        "loaded({*heavy, 'numpy'}, '--version')\n"
        "loaded(heavy, 'schema')\n"
        f"loaded(heavy, 'stability', {str(PAPER)!r})\n"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


class TestWaiting:
    def test_says_that_it_compiles_on_standard_error(self, capsys):
        import numba

        with announce_compilation() as said:
            for _ in range(2):
                numba.njit(lambda x: x + 1)(1)
        output, message = capsys.readouterr()
        assert (output, message.splitlines()) == ("", said)
        assert said

    def test_what_is_compiled_ahead_is_not_compiled_later(self, run, tmp_path):
        assert run("compile", "drivelines", "machines")[0] == 0
        for study in (PAPER, PAPER.with_name("driveline.toml")):
            command = [PROGRAM, "simulate", study]
            done = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path)
            assert (done.returncode, done.stderr) == (0, "")

    def test_an_unknown_group_is_refused(self, run):
        status, text, message = run("compile", "everything")
        assert (status, text) == (2, "")
        assert "everything" in message
        assert "machines" in message

    def test_the_last_progress_is_seen(self):
        """The work may end at any instant, also just after it was looked at."""
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
    def test_a_reader_that_goes_away(self):
        """As in `| head -1`."""
        reader, writer = os.pipe()
        os.close(reader)
        with os.fdopen(writer, "wb") as pipe:
            done = subprocess.run([PROGRAM, "schema"], stdout=pipe, stderr=subprocess.PIPE)
        assert (done.returncode, done.stderr) == (1, b"")

    @pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full")
    def test_standard_output_that_is_full(self):
        with Path("/dev/full").open("wb") as full:
            done = subprocess.run([PROGRAM, "schema"], stdout=full, stderr=subprocess.PIPE)
        assert done.returncode == 1
        assert done.stderr.startswith(b"error: standard output")
        assert b"Errno" not in done.stderr

    def test_an_interruption_while_the_program_is_imported(self, tmp_path):
        """As ``python -m wedgebrake``, before it handles Ctrl-C itself."""
        (tmp_path / "sitecustomize.py").write_text(
            "import sys\n"
            "class Interrupting:\n"
            "    def find_spec(self, name, *_):\n"
            "        if name == 'wedgebrake.cli':\n"
            "            raise KeyboardInterrupt\n"
            "sys.meta_path.insert(0, Interrupting())\n"
        )
        paths = [str(tmp_path), *filter(None, [os.environ.get("PYTHONPATH")])]
        done = subprocess.run(
            [sys.executable, "-m", "wedgebrake", "schema"],
            env={**os.environ, "PYTHONPATH": os.pathsep.join(paths)}, capture_output=True,
        )  # fmt: skip
        assert (done.returncode, done.stdout, done.stderr) == (1, b"", b"interrupted\n")


@pytest.mark.parametrize("count", ["0", "-1", "1025"])
@pytest.mark.parametrize(
    ("option", "command"),
    [
        (option, command)
        for option, commands in {
            "--threads": [["sweep", "none.toml"], ["scatter", PAPER, *LOCKS], ["paper"]],
            "--processes": [["sweep", "none.toml"], ["rare-event", PAPER, *LOCKS]],
        }.items()
        for command in commands
    ],
    ids=lambda one: one if isinstance(one, str) else one[0],
)
def test_a_number_of_workers_is_checked_first(run, option, command, count):
    """Also where there is no study, or nothing to simulate."""
    status, text, said = run(*command, option, count)
    assert (status, text) == (2, "")
    assert f"{option} {count}: " in said


@pytest.mark.parametrize("command", ["sweep", "scatter", "rare-event"])
def test_threads_or_processes(run, command):
    varied = ["--over", "eta=-20,-10"] if command == "sweep" else LOCKS
    status, _, said = run(command, PAPER, *varied, "--threads", "2", "--processes", "2")
    assert (status, said[:7]) == (2, "error: ")
    assert "--threads 2" in said


@pytest.mark.parametrize("command", ["sweep", "scatter", "rare-event", "continue", "response"])
def test_help_names_only_options_of_the_command(run, command):
    text = run(command, "--help")[1]
    own = set(re.findall(r"^[│ ]*\*? +(?:-\w, )?(--[a-z-]+)", text, re.MULTILINE))
    assert "--help" in own
    named = set(re.findall(r"(?<![\w-])--[a-z][a-z-]+(?!\s+of (?:sweep|scatter))\b", text))
    assert named <= own
