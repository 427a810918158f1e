"""What leaves the page: pictures, data, the study, and a program that shows the same."""

from __future__ import annotations

import io
import json
import re
import xml.etree.ElementTree as ET
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from PIL import Image
from states import new_state

import wedgebrake as wb
from schemas import DRIVELINES
from wedgebrake.dynamics.enums import motion_word
from wedgebrake.explorer.core.computation import linked_friction
from wedgebrake.explorer.core.export import File, export
from wedgebrake.explorer.core.limits import SAMPLES_PER_PERIOD
from wedgebrake.explorer.core.presets import preset
from wedgebrake.explorer.core.program import picture, snippet
from wedgebrake.explorer.core.snapshot import take_snapshot
from wedgebrake.explorer.core.state import PageState
from wedgebrake.explorer.core.studies import state_of
from wedgebrake.figures.matplotlib import figure
from wedgebrake.model.studies.study import RunSettings
from wedgebrake.sweeps.results import PointStatus

PLOTS = ("diagram", "regimes", "stability", "basins", "curve")
# Of one level over a narrow range.
CURVE = {"levels": [500.0], "spans": {"frequency": (8.8, 9.0)}}


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
    "regimes": state(plot="regimes", across="kinetic", up="frequency"),
    "stability": state(plot="stability"),
    "basins": state(plot="basins"),
    "curve": state(plot="curve", measure="velocity_amplitude", **CURVE),
    "smoothed friction": state(friction="smoothed", steepness=50.0),
    "a table": state(friction="tabulated", axis="initial_force"),
    "a shoe that starts somewhere": state(
        brake="leading-shoe", initial_angle=0.1, initial_velocity=-1 / 3
    ),
    "a band on a turning shaft": preset("band").state().edited(periods=30),
    "later": PageState.of(
        wb.Study(wb.paper.system(eta=-6.0), RunSettings(periods=60, start_time=0.123))
    ),
    "as printed": preset("as-printed").state(),
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


# Of each but the first the run as it is set is too short to tell, or tells something else.
MACHINES = [
("fig7a", {}),
("fig10b", {}),
("band", {}),
("leading-shoe", {}),
("fig9c", {}),
("fig16e", {"friction": "smoothed"}),
("fig6b", {"friction": "smoothed", "periods": 40}),
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
        point = function(
            linked_friction(given, here), **here, **call.options, progress=False
        ).squeeze()
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
            ("mat", "response.mat"),
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

    @pytest.mark.usefixtures("few")
    @pytest.mark.parametrize("plot", PLOTS)
    def test_the_open_picture(self, plot):
        kind = "svg" if plot == "stability" else "png"
        file = export(state(plot=plot, **CURVE), f"diagram-{kind}")
        assert file.name == f"{plot}.{kind}"
        check_picture(file.content)

    @pytest.mark.usefixtures("few")
    @pytest.mark.parametrize("plot", ["diagram", "curve"])
    def test_the_data_of_the_open_picture(self, plot):
        file = export(state(plot=plot, **CURVE), "diagram-csv")
        assert file.name == f"{plot}.csv"
        lines = [one for one in file.content.decode().splitlines() if not one.startswith("#")]
        assert ("frequency [Hz]" if plot == "curve" else "eta") in lines[0]
        assert len(lines) > 3

    @pytest.mark.parametrize("name", [*STATES, *DRIVELINES], ids=lambda name: Path(name).stem)
    def test_a_study_comes_back(self, name):
        given = STATES[name] if name in STATES else state_of(wb.load_study(name))
        read = wb.read_study(export(given, "study").content)
        assert read.system == given.system
        assert read.system.groups == given.system.groups
        assert read.run == given.study.run
        expected = {"stability": 0, "curve": 0, "diagram": 1}.get(given.view.plot, 2)
        assert len(read.sweep.axes) == expected

    @pytest.mark.parametrize("follow", [False, True])
    def test_a_sweep_up_and_down_comes_back(self, follow):
        given = state(plot="diagram", follow=follow)
        read = wb.read_study(export(given, "study").content)
        assert read.sweep.follow == ("eta" if follow else None)
        assert state_of(read).view.follow == follow


class TestData:
    def test_csv(self):
        given, text = state(), saved("csv").content.decode()
        about = [line for line in text.splitlines() if line.startswith("#")]
        assert f"# wedgebrake_version: {wb.__version__}" in about
        (system,) = (line for line in about if line.startswith("# system: "))
        assert json.loads(system.removeprefix("# system: ")) == given.system.as_dict()
        assert "# status: completed" in about
        header = text.splitlines()[len(about)]
        columns = dict(one.rstrip("]").split(" [") for one in header.split(","))
        units = {"time": "s", "angle": "rad", "brake_torque": "N m", "actuation_force": "N"}
        assert units.items() <= columns.items()
        table = np.genfromtxt(io.StringIO(text), delimiter=",", skip_header=len(about) + 1)
        response = wb.simulate(given.system, periods=40, samples_per_period=SAMPLES_PER_PERIOD)
        assert table.shape == (40 * SAMPLES_PER_PERIOD + 1, len(columns))
        for column, name in zip(table.T, columns, strict=True):
            assert np.array_equal(column, response[name].to_numpy())

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
