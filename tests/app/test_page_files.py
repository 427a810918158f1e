"""Files into the page and out of it."""

from __future__ import annotations

from pathlib import Path

import pytest
from browsing import QUICK
from playwright.sync_api import expect

import wedgebrake as wb
from wedgebrake.explorer.core import plots
from wedgebrake.explorer.core.export import export
from wedgebrake.explorer.core.presets import preset
from wedgebrake.explorer.core.studies import state_of

EXAMPLES = Path(__file__).parents[2] / "examples"
PAPER = (EXAMPLES / "paper.toml").read_text()


def load(screen, name, content):
    """Choose a file of this computer."""
    given = {"name": name, "mimeType": "text/plain", "buffer": content.encode()}
    screen("load").set_input_files(given)


def test_a_study_is_loaded(screen):
    path = EXAMPLES / "band.toml"
    with screen.page.expect_file_chooser() as choosing:
        screen("load").click()
    choosing.value.set_files(path)
    screen.refused(path.name)  # told, and dismissed
    state = state_of(wb.load_study(path))
    screen.says(state)
    for name in ("inertia", "damping", "radius", "kinetic", "slope", "amplitude"):
        assert screen.number(name) == pytest.approx(state.value(name), rel=1e-4)
    assert screen.number("periods") == state.periods


def test_what_is_no_study_is_refused_in_words(screen):
    """The server's tests send worse."""
    screen.still()
    before, shown = screen.values(), screen.shown()
    for name, text in (
        ("broken.toml", "a b"), ("<img src=x onerror=alert(1)>.toml", "a b"), ("empty.toml", ""),
    ):  # fmt: skip
        load(screen, name, text)
        screen.refused(name)
    assert screen.values() == before
    assert screen.shown() == shown
    load(screen, "paper.toml", PAPER)
    screen.refused("paper.toml")


# Entries of the menu, the picture that is open, and how pictures begin.
SAVED = [
    ("Response, PNG", "png", "stability", b"\x89PNG\r\n\x1a\n"),
    ("Open plot, SVG", "diagram-svg", "stability", b"<?xml"),
    ("Response data, netCDF", "netcdf", "stability", b"\x89HDF"),
    ("Response data, CSV", "csv", "stability", None),
    ("Python program", "python", "stability", None),
    ("Study file, TOML", "study", "diagram", None),
]


def test_what_is_saved_is_what_lies_open(screen, monkeypatch):
    for name, value in QUICK.items():
        monkeypatch.setattr(plots, name, value)
    state = preset("start").state()
    for name, value in (("periods", 24), ("eta", -7.5), ("kinetic", 0.27), ("initial_angle", 0.01)):
        screen.type(name, value)
        state = state.edited(**{name: value})
    screen.says(state)
    for label, kind, plot, begin in SAVED:
        screen(f"tab-{plot}").click()
        expect(screen(f"plot-{plot}")).to_be_visible()
        with screen.page.expect_download() as coming:
            screen("export").click()
            screen.page.locator(".export").get_by_text(label, exact=True).click()
        expect(screen("busy")).to_be_empty()
        content = coming.value.path().read_bytes()
        if begin is not None:
            assert content.startswith(begin), kind
            continue
        file = export(state.edited(plot=plot), kind)
        assert (coming.value.suggested_filename, content) == (file.name, file.content)
    # The button saves the study too; and back on the page it is what it was.
    with screen.page.expect_download() as coming:
        screen("save").click()
    assert coming.value.suggested_filename == "study.toml"
    assert coming.value.path().read_bytes() == content
    before = screen.values()
    screen.choose("band")
    expect(screen("input-wrap_angle")).to_be_visible()
    load(screen, "mine.toml", content.decode())
    screen.refused("mine.toml")
    expect(screen("input-angle")).to_be_visible()
    assert screen.values() == before
