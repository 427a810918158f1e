"""What leaves the page: pictures, data, the study, and a program that shows the same."""

from __future__ import annotations

import ast
import io
import json
import re
import xml.etree.ElementTree as ET
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pytest
import xarray as xr
from PIL import Image

import wedgebrake as wb
from wedgebrake.dynamics.enums import motion_word
from wedgebrake.explorer.core import export as exporting
from wedgebrake.explorer.core.computation import following
from wedgebrake.explorer.core.export import FORMATS, File, export
from wedgebrake.explorer.core.limits import SAMPLES_PER_PERIOD
from wedgebrake.explorer.core.presets import PRESETS, preset
from wedgebrake.explorer.core.program import picture, samples, snippet
from wedgebrake.explorer.core.snapshot import take_snapshot
from wedgebrake.explorer.core.state import PageState, new_state
from wedgebrake.explorer.core.studies import opened
from wedgebrake.figures.matplotlib import figure
from wedgebrake.model.study import Run
from wedgebrake.sweeps.results import PointStatus

PLOTS = ("diagram", "regimes", "stability", "basins")
# Those of braked drivelines; machines have tests of their own.
EXAMPLES = [
    path
    for path in sorted((Path(__file__).parents[2] / "examples").glob("*.toml"))
    if "[[inertia]]" not in path.read_text()
]


def state(**edits: Any) -> PageState:
    return new_state(wb.paper.system()).edited(periods=40, **edits)


@cache
def saved(kind: str) -> File:
    """A file of the machine to begin with."""
    return export(state(), kind)


@pytest.fixture
def few(monkeypatch):
    """Pictures of few points."""
    monkeypatch.setattr("wedgebrake.explorer.core.plots.FINE_MAP", (4, 3))
    monkeypatch.setattr("wedgebrake.explorer.core.plots.FINE_POINTS", 5)
    monkeypatch.setattr("wedgebrake.explorer.core.plots.COARSE_MAP", (3, 2))
    monkeypatch.setattr("wedgebrake.explorer.core.plots.COARSE_POINTS", 3)


@pytest.fixture
def execute(monkeypatch):
    """Run a program: its names, and the files that it would write."""
    files = []
    monkeypatch.setattr(figure.Picture, "savefig", lambda _, name, **__: files.append(name))

    def call(program: str) -> tuple[dict[str, Any], list[str]]:
        names: dict[str, Any] = {"__name__": "__main__"}
        exec(compile(program, "study.py", "exec"), names)  # noqa: S102 - our own text
        return names, files

    return call


STIFF = wb.paper.system().replace(stiffness=1e8, frequency=5.0)
STATES = {
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
    "a fixed step": PageState.of(
        wb.Study(wb.paper.system(eta=-6.0), Run(periods=20, method="ode14x"))
    ).edited(spans={"eta": (-7.0, -5.0)}),
    "a stiff driveline": PageState.of(wb.Study(STIFF, Run(periods=20))),
}


class TestProgram:
    @pytest.mark.usefixtures("few")
    @pytest.mark.parametrize("name", STATES)
    def test_shows_what_the_page_shows(self, name, execute, capsys):
        given = STATES[name]
        names, files = execute(snippet(given))
        assert files == ["response.png", f"{given.view.plot}.png"]
        assert names["system"] == given.system
        snapshot, response = take_snapshot(given, settle=True), names["response"]
        assert response.attrs["status"] == snapshot.status
        assert names["motion"].kind == snapshot.motion.kind
        assert names["motion"].order == snapshot.motion.order
        printed = capsys.readouterr().out
        assert names["motion"].verdict in printed
        assert wb.stability(given.system).verdict in printed
        assert ("BrakeTorque" in printed) == (snapshot.status == "completed")
        if snapshot.status == "completed":
            shown = np.searchsorted(
                response["time"].to_numpy(), snapshot.figures.history.time - 1e-9
            )
            scale = np.max(np.abs(snapshot.figures.history.velocity)) + 1e-9
            found = response["velocity"].to_numpy()[shown]
            np.testing.assert_allclose(found, snapshot.figures.history.velocity, atol=1e-6 * scale)
            settled = given.transient / given.system.excitation.frequency
            torque = wb.brake_torque(response, given.study.run.start_time + settled)
            assert repr(torque) in printed
            if not np.isnan(snapshot.braking.peak):  # the page's samples may be too far apart
                assert torque.peak == pytest.approx(snapshot.braking.peak, rel=1e-6)
                assert torque.mean == pytest.approx(snapshot.braking.mean, rel=1e-2, abs=1e-9)
        # Static friction that is the kinetic one stays so over kinetic friction.
        assert name != "regimes" or not np.any(names["picture"]["status"] == PointStatus.INVALID)

    def test_draws_as_finely_as_the_page(self):
        assert "\npoints = 600\n" in snippet(state())
        assert "\npoints = (96, 64)\n" in snippet(state(plot="basins"))
        # Of a solver that takes its time, fewer.
        assert "\npoints = 150\n" in snippet(state(friction="smoothed"))
        assert "\npoints = (24, 16)\n" in snippet(state(friction="smoothed", plot="regimes"))

    def test_has_public_names_alone(self):
        several = [*STATES.values()]
        several += [preset(name).state().edited(plot=one) for name in PRESETS for one in PLOTS]
        for given in several:
            tree = ast.parse(snippet(given))
            used = {
                node.attr
                for node in ast.walk(tree)
                if isinstance(node, ast.Attribute)
                and isinstance(node.value, ast.Name)
                and node.value.id == "wb"
            }
            assert used
            assert used <= set(wb.__all__)
            imports = {ast.unparse(node) for node in tree.body if isinstance(node, ast.Import)}
            assert imports <= {"import numpy as np", "import wedgebrake as wb"}

    def test_says_where_there_is_no_picture(self, execute):
        program = snippet(state(plot="stability", damping=0.0))
        assert "# No picture: eta" in program
        assert "numpy" not in program
        _, files = execute(program)
        assert files == ["response.png"]

    def test_tells_the_groups(self):
        """As they were given, each whole on a line."""
        text = ast.get_docstring(ast.parse(snippet(state(eta=-1 / 3))))
        assert "eta = -0.3333333333333333, f = 0.63, F0 = 0.036" in text

    def test_of_a_brake_of_ones_own(self):
        class Own(wb.Brake):
            """A brake that a plug-in brings."""

            kind: ClassVar[str] = "own"
            law = staticmethod(wb.ConventionalBrake.law)

        try:
            given = new_state(wb.paper.system().replace(brake=Own(radius=0.2)))
            with pytest.raises(wb.InputError, match=r"^brake = Own"):
                snippet(given)
            assert b'kind = "own"' in export(given, "study").content
        finally:
            del wb.Brake.kinds["own"]

    def test_samples_follow_fast_vibration(self):
        assert samples(state()) == SAMPLES_PER_PERIOD
        given = STATES["a stiff driveline"]
        assert samples(given) > 4 * 1e4 / (2 * np.pi * 5.0)
        assert samples(given) * given.edited(periods=2000).periods > 1e6
        assert samples(given.edited(periods=2000)) * 2000 <= 400_000


# Of each but the first the run as it is set is too short to tell, or tells something else.
MACHINES = [
    ("fig7a", {}), ("fig10b", {}), ("fig12d", {}), ("fig13d", {}), ("fig16b", {}), ("band", {}),
    ("fig18b", {}), ("leading-shoe", {}), ("start", {"eta": -28.0}), ("fig9c", {}),
    ("fig16e", {"friction": "smoothed"}), ("fig10c", {"friction": "smoothed", "periods": 60}),
    ("fig6b", {"friction": "smoothed", "method": "ode14x", "periods": 40}),
]  # fmt: skip


@pytest.mark.parametrize(("name", "changes"), MACHINES)
def test_pictures_and_program_say_what_the_page_says(name, changes):
    """A machine has one class, wherever the explorer says it."""
    given = preset(name).state()
    for one, value in changes.items():
        given = given.edited(**{one: value})
    word = take_snapshot(given, settle=True).motion.word
    for plot, function in (("diagram", wb.bifurcation), ("regimes", wb.regime_map)):
        call = picture(given.edited(plot=plot))
        assert call.function == function.__name__
        here = {name: [float(given.value(name))] for name in call.axes}
        point = function(following(given.system), **here, **call.options, progress=False).squeeze()
        assert motion_word(int(point["motion"]), int(point["order"])) == word, plot
    program = export(given, "python").content.decode()
    head = program.partition("response = ")[0]
    call = re.search(r"^motion = wb\.motion\((.*\)|\n(    .*\n)*\))$", program, re.MULTILINE)[0]
    names = {}
    exec(f"{head}\n{call}", names)  # noqa: S102 - our own text
    assert names["motion"].word == word
    if name == "fig10b":
        assert word in export(given, "svg").content.decode()


def check_picture(content: bytes) -> None:
    """It is a PNG of 1600 pixels with dark and light, or an SVG."""
    if content.startswith(b"\x89PNG"):
        image = Image.open(io.BytesIO(content))
        assert image.size[0] == 1600
        assert np.ptp(np.asarray(image.convert("L"))) > 200
    else:
        assert ET.fromstring(content).tag.endswith("svg")  # noqa: S314 - our own text


class TestFiles:
    @pytest.mark.parametrize(
        ("kind", "name"),
        [
            ("png", "response.png"),
            ("svg", "response.svg"),
            ("csv", "response.csv"),
            ("netcdf", "response.nc"),
            ("study", "study.toml"),
            ("python", "wedgebrake_study.py"),
        ],
    )
    def test_each_is_one(self, kind, name):
        file = saved(kind)
        assert file.name == name
        assert isinstance(file.content, bytes)
        assert len(file.content) > 100
        if kind in ("png", "svg"):
            check_picture(file.content)
        elif kind != "netcdf":
            assert export(state(), kind) == file

    @pytest.mark.parametrize("kind", ["pdf", "", None, 3, "PNG", "../x"])
    def test_an_unknown_kind(self, kind):
        with pytest.raises(wb.InputError, match=r"^format = .*: not known"):
            export(state(), kind)

    def test_the_overview_says_the_class(self):
        assert take_snapshot(state(), settle=True).motion.word in saved("svg").content.decode()

    @pytest.mark.usefixtures("few")
    @pytest.mark.parametrize("plot", PLOTS)
    def test_the_open_picture(self, plot):
        kind = "svg" if plot == "stability" else "png"
        file = export(state(plot=plot), f"diagram-{kind}")
        assert file.name == f"{plot}.{kind}"
        check_picture(file.content)

    @pytest.mark.usefixtures("few")
    @pytest.mark.parametrize("plot", ["diagram", "regimes", "basins"])
    def test_a_picture_that_nobody_waits_for_ends(self, plot):
        def heed(progress):
            if progress.done:
                raise wb.InputError("Nobody waits.")

        with pytest.raises(wb.InputError, match="Nobody waits"):
            export(state(plot=plot), "diagram-png", heed)

    def test_of_a_run_that_diverges(self):
        given = preset("as-printed").state()
        assert export(given, "netcdf").content
        assert "# status: diverged" in export(given, "csv").content.decode()

    def test_where_there_is_no_such_picture(self):
        with pytest.raises(wb.InputError, match=r"^eta"):
            export(state(plot="stability", damping=0.0), "diagram-png")

    @pytest.mark.parametrize("name", [*STATES, *EXAMPLES], ids=lambda name: Path(name).stem)
    def test_a_study_comes_back(self, name):
        given = STATES[name] if name in STATES else opened(wb.load_study(name))
        read = wb.read_study(export(given, "study").content)
        assert read.system == given.system
        assert read.system.groups == given.system.groups
        assert read.run == given.study.run
        expected = {"stability": 0, "diagram": 1}.get(given.view.plot, 2)
        assert len(read.sweep.axes) == expected

    def test_the_picture_is_what_lies_open(self):
        assert picture(state(axis="f", spans={"f": (0.5, 0.7)})).axes == {
            "f": (0.5, 0.7, 600, "linear")
        }
        assert picture(state(axis="damping")).axes["damping"][3] == "log"
        assert picture(state(plot="basins")).function == "basins"
        assert list(picture(state(plot="stability", brake="band")).axes) == ["eta", "kinetic"]


class TestData:
    def test_csv(self):
        given, text = state(), saved("csv").content.decode()
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

    def test_netcdf(self, tmp_path, monkeypatch):
        monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
        given = STATES["later"]
        content = export(given, "netcdf").content
        assert [*tmp_path.iterdir()] == []  # it leaves nothing behind
        with xr.open_dataset(io.BytesIO(content), engine="h5netcdf") as read:
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


def test_the_menu_has_all_kinds_of_files():
    from wedgebrake.explorer.ui.widgets.header import _EXPORTS

    assert {kind for _, kind in filter(None, _EXPORTS)} == set(FORMATS)
