"""The page as it opens: what stands on it, and where."""

from __future__ import annotations

import pytest
from playwright.sync_api import expect
from screen import CARDS, CURSOR, MOTION, colours, near

from wedgebrake.explorer.core.fields import _KINDS as KINDS
from wedgebrake.explorer.core.presets import preset
from wedgebrake.explorer.core.snapshot import take_snapshot
from wedgebrake.explorer.core.verdict import verdict

START = preset("start").state()
SCRIPT = "/static/js/bokeh.min.js"


def test_what_the_page_loads_is_served(screen):
    loaded = {place.path: status for place, status in screen.loaded if place.scheme == "http"}
    assert {"/", SCRIPT} <= set(loaded)
    assert set(loaded.values()) == {200}
    assert not any(path.startswith("/components") for path in loaded)


def test_shows_the_verdict_and_the_values(screen):
    screen("verdict.warn").wait_for()
    for tile in verdict(START, take_snapshot(START, settle=True))["tiles"]:
        shown = screen(f"tile-{tile['name']}.{tile['tone']}")
        for part in ("title", "value", "detail"):
            expect(shown).to_contain_text(tile[part])
        expect(shown).to_have_attribute("title", tile["hint"])
    assert (screen.number("eta"), screen.number("slope")) == (-24, -40)
    # What cannot be set is shown too.
    expect(screen("natural")).to_contain_text("15.92 Hz")
    expect(screen("notice")).to_have_count(0)
    expect(screen("busy")).to_be_empty()
    for name in ("eta", "slope", "amplitude", "kinetic", "inertia", "periods"):
        assert len(screen(f"slider-{name}").get_attribute("title")) > 3


def test_sections_of_parameters_fold(screen):
    section = screen.page.locator(".parameters .section").first
    title, field = section.locator(".title button"), section.locator("input, select").first
    high = section.bounding_box()["height"]
    title.click()
    expect(field).to_be_hidden()
    assert section.bounding_box()["height"] < 40 < high
    title.click()
    expect(field).to_be_visible()
    assert section.bounding_box()["height"] == high


def test_every_picture_is_painted(screen):
    screen.after(0, "picture")
    for name in CARDS:
        assert colours(screen.pixels(screen.card(name))) > 30, name
    for name in ("history", "phase", "spectrum", "section", "torque"):
        assert near(screen.pixels(screen.card(name)), MOTION).sum() > 40, name
    # The dot of the instant, in the charts of the motion and on the curve of the torque.
    for name in ("history", "phase", "torque"):
        assert near(screen.pixels(screen.card(name)), CURSOR).sum() > 15, name
    # The diagram goes over the parameter with a line at its value, -24 of -120 to 12.
    screen.marks("plot-diagram", 96 / 132)
    assert (screen("from").input_value(), screen("to").input_value()) == ("-120", "12")
    legend = screen("legend").locator("li").all_inner_texts()
    assert any(one.startswith("synchronous") for one in legend)
    assert any(one.startswith("2T") for one in legend)


# The end of the title of a chart and the beginning of its key [px from the left of the chart].
_TITLE_AND_KEY = """
(card) => {
  const found = []
  const walk = (root) => {
    for (const one of root.querySelectorAll("*")) {
      if (one.shadowRoot) walk(one.shadowRoot)
      if (one.style.justifyContent === "flex-end") found.push(one)
    }
  }
  walk(card.shadowRoot ?? card)
  const pen = document.createElement("canvas").getContext("2d")
  const {left} = card.getBoundingClientRect()
  return found.filter((key) => key.textContent).map((key) => {
    pen.font = `bold 12px ${getComputedStyle(key).fontFamily}`
    const starts = [...key.children].map((one) => one.getBoundingClientRect().left - left)
    return [54 + pen.measureText(TITLE).width, Math.min(...starts)]
  })
}
"""
TITLES = {"history": "History", "phase": "Phase portrait", "torque": "Brake torque"}


@pytest.mark.parametrize(
    "widths", [(1440, 420), pytest.param((1200, 800), marks=pytest.mark.slow)], ids=str
)
def test_keys_do_not_cover_titles(screen, widths):
    screen.choose("band")  # a brake that has all entries
    screen("comparison").check()
    for width in widths:
        screen.page.set_viewport_size({"width": width, "height": 900})
        screen.still()
        for name, title in TITLES.items():
            script = _TITLE_AND_KEY.replace("TITLE", repr(title))
            for end, start in screen.card(name).evaluate(script):
                assert end < start, (width, name)


@pytest.mark.parametrize(
    "widths", [(1000, 700, 420), pytest.param((1200, 960, 900), marks=pytest.mark.slow)], ids=str
)
def test_fits_a_narrow_window(screen, widths):
    screen("input-friction").select_option(KINDS["tabulated"])
    for width in widths:
        screen.page.set_viewport_size({"width": width, "height": 900})
        screen.still()
        screen.check_layout(width)
        header, card = screen("header").bounding_box(), screen("parameters").last.bounding_box()
        assert (header["x"], header["width"]) == (0, width)
        # Every row lies in the card, and sliders have room to move.
        for name in ("slope", "speeds", "coefficients", "damping", "initial_velocity"):
            row = screen.page.locator(f".input-{name}").bounding_box()
            assert card["x"] < row["x"]
            assert row["x"] + row["width"] < card["x"] + card["width"]
        assert screen("slider-damping").locator(".noUi-base").bounding_box()["width"] > 50


def test_fits_a_laptop(screen):
    """1440 x 900: all of it is seen at once, whatever the machine."""
    assert screen.check_layout(1440) <= 900
    screen("input-brake").select_option(KINDS["leading-shoe"])
    screen("input-friction").select_option(KINDS["smoothed"])
    expect(screen("input-steepness")).to_be_visible()
    expect(screen("input-friction_arm")).to_be_visible()
    assert screen.check_layout(1440) <= 900
