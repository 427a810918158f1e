"""Files into the page and out of it."""

from __future__ import annotations

import csv
import io
import math
import struct
import tomllib
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from playwright.sync_api import expect
from screen import words

import wedgebrake as wb
from wedgebrake.explorer.core.presets import preset
from wedgebrake.explorer.core.studies import opened

EXAMPLES = sorted((Path(__file__).parents[2] / "examples").glob("*.toml"))
PAPER = next(path for path in EXAMPLES if path.stem == "paper")
INPUTS = ".parameters :is(input, select)"


def values(screen):
    """All that stands in the inputs of the machine."""
    return screen.page.locator(INPUTS).evaluate_all(
        "(all) => all.map((one) => one.type === 'checkbox' ? one.checked : one.value)"
    )


def load(screen, name, content):
    """Choose a file of this computer."""
    given = content if isinstance(content, bytes) else content.encode()
    screen("load").set_input_files({"name": name, "mimeType": "text/plain", "buffer": given})


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_a_study_is_loaded(screen, path):
    study = wb.load_study(path)
    with screen.page.expect_file_chooser() as choosing:
        screen("load").click()
    choosing.value.set_files(path)
    screen.refused(path.name)  # told, and dismissed
    state = opened(study)
    screen.says(state)
    for name in ("inertia", "damping", "radius", "kinetic", "slope", "amplitude"):
        assert screen.number(name) == pytest.approx(state.value(name), rel=1e-4)
    assert screen.number("periods") == state.periods


def test_a_study_with_a_sweep_opens_its_picture(screen):
    text = PAPER.read_text() + "\n[sweep]\n"
    load(screen, "line.toml", text + "kinetic = { from = 0.1, to = 0.5, points = 50 }\n")
    expect(screen("from")).to_have_value("0.1")
    expect(screen("to")).to_have_value("0.5")
    text += "F0 = { from = 0.02, to = 0.05, points = 9 }\n"
    load(screen, "map.toml", text + "eta = { from = -30, to = 0, points = 9 }\n")
    expect(screen("plot-regimes")).to_be_visible()
    expect(screen("up-from")).to_have_value("-30")


HOSTILE = {
    "broken.toml": ("[brake\nkind = wedge", ["broken.toml"]),
    "picture.toml": (bytes(range(256)) * 40, ["picture.toml"]),
    "zeros.toml": (b"\0" * 5000, ["zeros.toml"]),
    "large.toml": ("# " + "x" * 1_000_000, ["large.toml", "larger than 200000 bytes"]),
    "lists.toml": ("a = " + "[" * 20_000, ["lists.toml"]),
    "tables.toml": ("[" + ".".join("a" * 1 for _ in range(20_000)) + "]\nb = 1", ["tables.toml"]),
    "keys.toml": (".".join("a" for _ in range(50_000)) + " = 1", ["keys.toml"]),
    "inline.toml": ("a = " + "{a = " * 5_000 + "1" + "}" * 5_000, ["inline.toml"]),
    "unknown.toml": (PAPER.read_text() + "\n[gearbox]\nratio = 2", ["unknown.toml", "gearbox"]),
    "types.toml": (
        PAPER.read_text().replace("inertia = 1.0", 'inertia = "heavy"'),
        ["types.toml", "driveline.inertia"],
    ),
    "table.toml": (
        PAPER.read_text().replace('kind = "wedge"', "kind = [1, 2]"), ["table.toml", "brake.kind"]
    ),
    "negative.toml": (
        PAPER.read_text().replace("damping = 0.1", "damping = -0.1"),
        ["negative.toml", "driveline.damping = -0.1", "at least 0"],
    ),
    "nan.toml": (
        PAPER.read_text().replace("damping = 0.1", "damping = nan"),
        ["nan.toml", "driveline.damping"],
    ),
    "<img src=x onerror=alert(1)>.toml": ("a b", ["<img src=x onerror=alert(1)>"]),
}  # fmt: skip


def test_what_is_no_study_is_refused_in_words(screen):
    before, shown = values(screen), screen.shown()
    for name, (content, parts) in HOSTILE.items():
        load(screen, name, content)
        for part in parts:
            screen("notice").filter(has_text=part).first.wait_for()
        screen.refused(name)
    assert values(screen) == before
    assert screen.shown() == shown
    # The page goes on.
    load(screen, "paper.toml", PAPER.read_text())
    screen.refused("paper.toml")


@pytest.fixture
def state(screen):
    """A machine of which nothing is as at the beginning, and a short run; what it is here."""
    edits = {"periods": 24, "eta": -7.5, "kinetic": 0.27, "damping": 0.2, "initial_angle": 0.01}
    for name, value in edits.items():
        screen.type(name, value)
    state = preset("start").state()
    for name, value in edits.items():
        state = state.edited(**{name: value})
    screen.says(state)
    return state


def export(screen, form):
    """The file that the menu gives: its name and content."""
    with screen.page.expect_download() as coming:
        screen("export").click()
        screen.page.locator(".export").get_by_text(FORMS[form], exact=True).click()
    expect(screen("busy")).to_be_empty()
    return coming.value.suggested_filename, coming.value.path().read_bytes()


FORMS = {
    "png": "Response, PNG", "svg": "Response, SVG", "diagram-png": "Open plot, PNG",
    "diagram-svg": "Open plot, SVG", "csv": "Response data, CSV",
    "netcdf": "Response data, netCDF", "study": "Study file, TOML", "python": "Python program",
}  # fmt: skip


def test_pictures(screen, state):
    for form, expected in (("png", "response.png"), ("diagram-png", "diagram.png")):
        name, content = export(screen, form)
        assert name == expected
        assert content[:8] == b"\x89PNG\r\n\x1a\n"
        assert min(struct.unpack(">II", content[16:24])) > 600, name
    screen("tab-stability").click()
    expect(screen("across-from")).to_be_visible()
    for form, expected in (("svg", "response.svg"), ("diagram-svg", "stability.svg")):
        name, content = export(screen, form)
        assert name == expected
        root = ET.fromstring(content)  # noqa: S314 - our own
        assert root.tag == "{http://www.w3.org/2000/svg}svg"
        assert len(list(root.iter("{http://www.w3.org/2000/svg}path"))) > 12


def test_data(screen, state):
    wanted = wb.simulate(
        state.system, periods=24, initial=state.study.run.initial, samples_per_period=100
    )
    name, content = export(screen, "csv")
    assert name == "response.csv"
    lines = content.decode().splitlines()
    about = [line for line in lines if line.startswith("#")]
    assert any(wb.__version__ in line for line in about)
    rows = list(csv.reader(io.StringIO("\n".join(lines[len(about) :]))))
    assert rows[0][:3] == ["time [s]", "angle [rad]", "velocity [rad/s]"]
    table = np.array([[float(one) for one in row[:4]] for row in rows[1:]])
    for column, variable in enumerate(("time", "angle", "velocity", "brake_torque")):
        assert np.array_equal(table[:, column], wanted[variable].to_numpy()), variable
    name, content = export(screen, "netcdf")
    assert name == "response.nc"
    with xr.open_dataset(io.BytesIO(content), engine="h5netcdf") as found:
        assert np.array_equal(found["angle"], wanted["angle"])
        assert found.attrs["status"] == "completed"


def test_the_study(screen, state):
    screen("tab-regimes").click()
    with screen.page.expect_download() as coming:
        screen("save").click()
    assert coming.value.suggested_filename == "study.toml"
    text = coming.value.path().read_text()
    study = wb.read_study(text)
    assert study.system == state.system
    assert study.run.periods == 24
    assert study.run.initial == (0.01, 0.0)
    # With the picture that lies open; and back on the page it is what it was.
    assert set(study.sweep.parameters()) == {"eta", "F0"}
    assert export(screen, "study")[1].decode() == text
    before = values(screen)
    screen.choose("band")
    expect(screen("input-wrap_angle")).to_be_visible()
    load(screen, "mine.toml", text)
    screen.refused("mine.toml")
    expect(screen("input-angle")).to_be_visible()
    assert values(screen) == before
    assert "sweep" in tomllib.loads(text)


def test_the_program(screen, state):
    name, content = export(screen, "python")
    assert name == "wedgebrake_study.py"
    program = content.decode()
    compile(program, name, "exec")
    for group, value in state.system.groups.as_dict().items():
        if value is not None:
            assert f"{group} = {value!r}" in words(program), group
    # The machine alone: tests/app/test_export.py runs whole programs.
    names = {}
    machine = program[: program.index("response = ")]
    exec(compile(machine, name, "exec"), names)  # noqa: S102 - our own text
    assert names["system"] == state.system
    assert math.isclose(names["system"].groups.eta, screen.number("eta"))
