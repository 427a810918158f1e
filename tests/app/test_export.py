"""What leaves the page: pictures, data, the study, and a program that shows the same."""

from __future__ import annotations

import ast
import io
import json
import re
import xml.etree.ElementTree as ET
from dataclasses import replace
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pytest
from PIL import Image

import wedgebrake as wb
from wedgebrake.explorer.core import export as exporting
from wedgebrake.explorer.core.computation import evaluation_settings
from wedgebrake.explorer.core.export import FORMATS, File, export
from wedgebrake.explorer.core.limits import MOST_EVENTS, SAMPLES_PER_PERIOD
from wedgebrake.explorer.core.presets import PRESETS, preset
from wedgebrake.explorer.core.program import picture, samples, snippet
from wedgebrake.explorer.core.snapshot import take_snapshot
from wedgebrake.explorer.core.state import PageState, new_state
from wedgebrake.model.study import Run
from wedgebrake.sweeps.results import PointStatus

PLOTS = ("diagram", "regimes", "stability", "basins")


def state(**edits: Any) -> PageState:
    return new_state(wb.paper.system()).edited(periods=40, **edits)


def few(program: str) -> str:
    """The program with few points in its picture."""
    program, found = re.subn(r"^points = \d+$", "points = 3", program, flags=re.MULTILINE)
    program, maps = re.subn(r"^points = \(.*\)$", "points = (3, 2)", program, flags=re.MULTILINE)
    assert found + maps == 1
    return program


@pytest.fixture
def execute(tmp_path, monkeypatch):
    """Run a program in an empty folder: its names, and the files that it wrote."""
    monkeypatch.chdir(tmp_path)

    def call(program: str) -> tuple[dict[str, Any], set[str]]:
        names: dict[str, Any] = {"__name__": "__main__"}
        exec(compile(program, "study.py", "exec"), names)  # noqa: S102 - our own text
        return names, {path.name for path in tmp_path.iterdir()}

    return call


STIFF = wb.paper.system().replace(stiffness=1e8, frequency=5.0)
DESKS = {
    "the paper's": state(),
    "a diagram of angles": state(axis="damping", quantity="angle"),
    "regimes": state(plot="regimes", across="kinetic", up="frequency"),
    "stability": state(plot="stability"),
    "basins": state(plot="basins"),
    "smoothed friction": state(friction="smoothed", steepness=50.0),
    "a table": state(friction="tabulated", axis="initial_force"),
    "a shoe that starts somewhere": state(
        brake="leading-shoe", initial_angle=0.1, initial_velocity=-1 / 3
    ),
    "a band on a turning shaft": preset("band").state().edited(periods=30),
    "later": PageState.of(wb.Study(wb.paper.system(eta=-6.0), Run(periods=60, start_time=0.123))),
    "as printed": preset("as-printed").state(),
    "a fixed step": PageState.of(wb.Study(wb.paper.system(), Run(periods=20, method="ode14x"))),
    "a stiff driveline": PageState.of(wb.Study(STIFF, Run(periods=20))),
}


class TestProgram:
    @pytest.mark.parametrize("name", DESKS)
    def test_shows_what_the_page_shows(self, name, execute, capsys):
        given = DESKS[name]
        names, files = execute(few(snippet(given)))
        assert files == {"response.png", f"{given.view.plot}.png"}
        assert names["system"] == given.system
        for part in given.system.as_dict():
            assert getattr(names["system"], part) == getattr(given.system, part)
        snapshot, response = take_snapshot(given), names["response"]
        assert response.attrs["status"] == snapshot.status
        if snapshot.status == "completed":
            shown = np.searchsorted(
                response["time"].to_numpy(), snapshot.figures.history.time - 1e-9
            )
            scale = np.max(np.abs(snapshot.figures.history.velocity)) + 1e-9
            found = response["velocity"].to_numpy()[shown]
            np.testing.assert_allclose(found, snapshot.figures.history.velocity, atol=1e-6 * scale)
        judged = take_snapshot(given, settle=True).motion
        assert names["motion"].kind == judged.kind
        assert names["motion"].order == judged.order
        printed = capsys.readouterr().out
        assert names["motion"].verdict in printed
        assert wb.stability(given.system).verdict in printed
        assert ("BrakeTorque" in printed) == (snapshot.status == "completed")

    def test_is_the_same_to_the_last_bit(self, execute, capsys):
        """At the defaults of the page: the same samples, the same torque of the brake."""
        given = state()
        names, _ = execute(few(snippet(given)))
        response = wb.simulate(
            given.system, periods=40, samples_per_period=SAMPLES_PER_PERIOD, max_events=MOST_EVENTS
        )
        for variable in ("time", "angle", "velocity", "brake_torque"):
            assert np.array_equal(names["response"][variable], response[variable])
        motion = wb.motion(given.system, **evaluation_settings(given))
        assert names["motion"].verdict == motion.verdict
        start = given.transient / given.system.excitation.frequency
        assert repr(wb.brake_torque(response, start)) in capsys.readouterr().out
        braking = take_snapshot(given).braking
        assert wb.brake_torque(response, start).peak == pytest.approx(braking.peak, rel=1e-9)
        assert wb.brake_torque(response, start).mean == pytest.approx(braking.mean, rel=1e-2)

    def test_draws_as_finely_as_the_page(self):
        assert "\npoints = 600\n" in snippet(state())
        assert "\npoints = (96, 64)\n" in snippet(state(plot="basins"))
        # Of a solver that takes its time, fewer.
        assert "\npoints = 150\n" in snippet(state(friction="smoothed"))
        assert "\npoints = (24, 16)\n" in snippet(state(friction="smoothed", plot="regimes"))

    @pytest.mark.parametrize("name", DESKS)
    def test_has_public_names_alone(self, name):
        program = snippet(DESKS[name])
        tree = ast.parse(program)
        used = {
            node.attr
            for node in ast.walk(tree)
            if isinstance(node, ast.Attribute)
            and isinstance(node.value, ast.Name)
            and node.value.id == "wb"
        }
        assert used
        assert used <= set(wb.__all__)
        imports = [ast.unparse(node) for node in tree.body if isinstance(node, ast.Import)]
        assert imports == ["import numpy as np", "import wedgebrake as wb"]
        lines = program.splitlines()
        assert len(lines) < 60
        assert max(map(len, lines)) <= 110

    @pytest.mark.parametrize("name", PRESETS)
    @pytest.mark.parametrize("plot", PLOTS)
    def test_can_be_read_by_python(self, name, plot):
        ast.parse(snippet(preset(name).state().edited(plot=plot)))

    def test_says_where_there_is_no_picture(self, execute):
        given = state(plot="stability", damping=0.0)
        program = snippet(given)
        assert "# No picture: eta" in program
        assert "numpy" not in program
        _, files = execute(program)
        assert files == {"response.png"}

    def test_tells_the_groups(self):
        """As they were given, each whole on a line."""
        text = ast.get_docstring(ast.parse(snippet(state(eta=-1 / 3))))
        assert "eta = -0.3333333333333333, f = 0.63, F0 = 0.036" in text

    def test_follows_static_friction(self, execute):
        """Where it is the kinetic one, it stays so over kinetic friction."""
        names, _ = execute(few(snippet(DESKS["regimes"])))
        assert not np.any(names["picture"]["status"] == PointStatus.INVALID)

    def test_of_a_brake_of_ones_own(self):
        class Own(wb.Brake):
            """A brake that a plug-in brings."""

            kind: ClassVar[str] = "own"
            law = staticmethod(wb.ConventionalBrake.law)

        try:
            given = new_state(wb.paper.system().replace(brake=Own(radius=0.2)))
            with pytest.raises(wb.InputError, match=r"^brake = Own: is no part of wedgebrake"):
                snippet(given)
            assert b'kind = "own"' in export(given, "study").content
        finally:
            del wb.Brake.kinds["own"]


class TestSamples:
    def test_are_those_of_the_page(self):
        assert samples(state()) == SAMPLES_PER_PERIOD

    def test_follow_fast_vibration(self):
        given = DESKS["a stiff driveline"]
        assert samples(given) > 4 * 1e4 / (2 * np.pi * 5.0)
        assert samples(given) * given.edited(periods=2000).periods > 1e6
        assert samples(given.edited(periods=2000)) * 2000 <= 400_000


class TestFiles:
    @pytest.mark.parametrize("kind", FORMATS)
    def test_each_is_one(self, kind):
        file = export(state(), kind)
        assert isinstance(file, File)
        assert file.content
        assert re.fullmatch(r"[a-z_]+\.[a-z]+", file.name)
        assert isinstance(file.content, bytes)

    @pytest.mark.parametrize("kind", ["pdf", "", None, 3, "PNG", "../x"])
    def test_an_unknown_kind(self, kind):
        with pytest.raises(wb.InputError, match=r"^format = .*: not known"):
            export(state(), kind)

    @pytest.mark.parametrize("kind", ["png", "diagram-png"])
    def test_pictures(self, kind):
        file = export(state(), kind)
        image = Image.open(io.BytesIO(file.content))
        assert image.size[0] == 1600
        assert np.ptp(np.asarray(image.convert("L"))) > 200

    @pytest.mark.parametrize("kind", ["svg", "diagram-svg"])
    def test_drawings(self, kind):
        root = ET.fromstring(export(state(), kind).content)  # noqa: S314 - our own text
        assert root.tag.endswith("svg")

    def test_the_overview_says_the_class(self):
        given = state()
        text = export(given, "svg").content.decode()
        assert take_snapshot(given, settle=True).motion.word in text

    @pytest.mark.parametrize("plot", PLOTS)
    def test_the_open_picture(self, plot, monkeypatch):
        monkeypatch.setattr("wedgebrake.explorer.core.plots.FINE_MAP", (6, 4))
        monkeypatch.setattr("wedgebrake.explorer.core.plots.FINE_POINTS", 7)
        file = export(state(plot=plot), "diagram-png")
        assert file.name == f"{plot}.png"
        assert Image.open(io.BytesIO(file.content)).size[0] == 1600

    def test_of_a_run_that_diverges(self):
        given = preset("as-printed").state()
        for kind in ("png", "csv", "netcdf"):
            assert export(given, kind).content
        assert "# status: diverged" in export(given, "csv").content.decode()

    def test_where_there_is_no_such_picture(self):
        with pytest.raises(wb.InputError, match=r"^eta.* not defined"):
            export(state(plot="stability", damping=0.0), "diagram-png")

    def test_is_the_same_each_time(self):
        for kind in ("png", "svg", "csv", "study", "python", "diagram-svg"):
            assert export(state(), kind) == export(state(), kind)


class TestStudy:
    @pytest.mark.parametrize("name", DESKS)
    def test_comes_back(self, name):
        given = DESKS[name]
        file = export(given, "study")
        read = wb.read_study(file.content)
        assert file.name == "study.toml"
        assert read.system == given.system
        assert read.system.groups == given.system.groups
        assert read.run == given.study.run
        expected = {"stability": 0, "diagram": 1}.get(given.view.plot, 2)
        assert len(read.sweep.axes) == expected


class TestData:
    def test_csv(self):
        given = state()
        text = export(given, "csv").content.decode()
        about = [line for line in text.splitlines() if line.startswith("#")]
        assert about[0] == f"# wedgebrake: {wb.__version__}"
        assert json.loads(about[1].removeprefix("# system: ")) == given.system.as_dict()
        assert "# status: completed" in about
        header = text.splitlines()[len(about)]
        words = "time [s],angle [rad],velocity [rad/s],brake_torque [N m],drive_torque [N m]"
        assert header == f"{words},sticking [1]"
        table = np.genfromtxt(io.StringIO(text), delimiter=",", skip_header=len(about) + 1)
        response = wb.simulate(given.system, periods=40, samples_per_period=SAMPLES_PER_PERIOD)
        assert table.shape == (40 * SAMPLES_PER_PERIOD + 1, 6)
        for i, name in enumerate(("time", "angle", "velocity", "brake_torque", "drive_torque")):
            assert np.array_equal(table[:, i], response[name].to_numpy())

    def test_netcdf(self, tmp_path):
        xarray = pytest.importorskip("xarray")
        pytest.importorskip("h5netcdf")
        given = DESKS["later"]
        file = export(given, "netcdf")
        path = tmp_path / file.name
        path.write_bytes(file.content)
        with xarray.open_dataset(path, engine="h5netcdf") as read:
            assert json.loads(read.attrs["system"]) == given.system.as_dict()
            assert float(read["time"][0]) == 0.123
            assert wb.sticks(read).attrs["status"] == "completed"
            assert wb.energy(read).attrs["error"] < 1e-6

    def test_netcdf_without_the_extra(self, monkeypatch):
        monkeypatch.setattr(exporting, "find_spec", lambda name: None if name == "h5py" else name)
        with pytest.raises(wb.InputError, match=r"needs h5py where .*wedgebrake\[netcdf\]"):
            export(state(), "netcdf")

    def test_limits_hold(self, monkeypatch):
        """A run that meets them says so, in the file too."""
        monkeypatch.setattr("wedgebrake.explorer.core.state.MOST_EVENTS", 50)
        text = export(state(), "csv").content.decode()
        assert "# status: event_limit" in text

    @pytest.mark.parametrize(
        ("friction", "limit", "status"),
        [("coulomb", {"max_events": 50}, "event_limit"), ("smoothed", {"max_steps": 50},
         "step_limit")],
    )  # fmt: skip
    def test_a_limit_of_the_study_holds_as_well(self, friction, limit, status):
        given = state(friction=friction)
        given = replace(given, study=given.study.changed(**limit))
        assert take_snapshot(given).status == take_snapshot(given, settle=True).status == status
        assert f"# status: {status}" in export(given, "csv").content.decode()
        [(name, value)] = limit.items()
        assert f"{name}={value}" in export(given, "python").content.decode()

    @pytest.mark.parametrize("plot", ["diagram", "regimes", "basins"])
    def test_a_picture_that_nobody_waits_for_ends(self, plot):
        def heed(progress):
            if progress.done:
                raise wb.InputError("Nobody waits.")

        with pytest.raises(wb.InputError, match="Nobody waits"):
            export(state(plot=plot), "diagram-png", heed)

    def test_leaves_nothing_behind(self, tmp_path, monkeypatch):
        monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
        export(state(), "netcdf")
        assert list(Path(tmp_path).iterdir()) == []


class TestPicture:
    def test_is_what_lies_open(self):
        assert picture(state(axis="f", spans={"f": (0.5, 0.7)})).axes == {
            "f": (0.5, 0.7, 600, "linear")
        }
        assert picture(state(axis="damping")).axes["damping"][3] == "log"
        assert picture(state(plot="basins")).function == "basins"
        assert list(picture(state(plot="stability", brake="band")).axes) == ["eta", "kinetic"]
