"""The page as it opens: what stands on it, and where."""

from __future__ import annotations

from itertools import combinations

import pytest
from playwright.sync_api import expect
from screen import CARDS, CURSOR, MOTION, colours, near

from wedgebrake.explorer.core.fields import _KINDS as KINDS
from wedgebrake.explorer.core.presets import preset
from wedgebrake.explorer.core.snapshot import take_snapshot
from wedgebrake.explorer.core.verdict import verdict

START = preset("start").state()

# All elements, through all shadow roots.
_ALL = """
const all = [];
const walk = (root) => {
  for (const one of root.querySelectorAll("*")) {
    all.push(one);
    if (one.shadowRoot) walk(one.shadowRoot);
  }
};
walk(document);
"""
# Elements that scroll, or would, inside the page.
_SCROLLERS = (
    "() => {"
    + _ALL
    + """
  return all.filter((one) => {
    if (one === document.scrollingElement || one === document.body) return false;
    const {overflowX, overflowY} = getComputedStyle(one);
    const scrolls = (way) => way === "auto" || way === "scroll";
    return (scrolls(overflowY) && one.scrollHeight > one.clientHeight + 1)
      || (scrolls(overflowX) && one.scrollWidth > one.clientWidth + 1);
  }).map((one) => `${one.tagName} ${one.className} ${one.dataset.testid ?? ""}`);
}"""
)
# Words of which a part is cut off: without the narrow labels, whose whole words are in titles.
_CUT = (
    "() => {"
    + _ALL
    + """
  const own = (one) => [...one.childNodes].some((child) => child.nodeType === 3
    && child.textContent.trim());
  return all.filter((one) => {
    const {overflowX, visibility} = getComputedStyle(one);
    const seen = one.checkVisibility() && visibility === "visible" && one.clientWidth > 2;
    return seen && own(one) && overflowX !== "visible" && one.scrollWidth > one.clientWidth + 1
      && !["SELECT", "OPTION", "LABEL"].includes(one.tagName)
      && !one.className.includes("bk-slider-title") && !one.closest("dl");
  }).map((one) => `${one.tagName} ${one.className}: ${one.textContent}`);
}"""
)
_SIZE = """() => {
  const {scrollWidth, scrollHeight, clientWidth, clientHeight} = document.scrollingElement;
  return {scrollWidth, scrollHeight, clientWidth, clientHeight};
}"""


def boxes(screen):
    """(left, top, right, bottom) of the areas by name."""
    found = {}
    for name in ("header", "parameters", "strip", *CARDS):
        box = screen(f"card.{name}" if name in CARDS else name).bounding_box()
        found[name] = (box["x"], box["y"], box["x"] + box["width"], box["y"] + box["height"])
    return found


def overlapping(found):
    """Pairs of areas that share pixels."""
    return [
        (one, other) for (one, a), (other, b) in combinations(found.items(), 2)
        if min(a[2], b[2]) - max(a[0], b[0]) > 1 and min(a[3], b[3]) - max(a[1], b[1]) > 1
    ]  # fmt: skip


def test_shows_the_verdict_and_the_values(visit):
    screen = visit()
    screen.says(START)
    screen.tone("warn")
    tiles = verdict(START, take_snapshot(START, settle=True))["tiles"]
    for tile in tiles:
        shown = screen(f"tile-{tile['name']}")
        for part in ("title", "value", "detail"):
            expect(shown).to_contain_text(tile[part])
        expect(shown).to_have_attribute("title", tile["hint"])
        screen.tile(tile["name"], tile["tone"])
    assert screen.number("eta") == -24
    assert screen.number("slope") == -40
    # What cannot be set is shown too.
    expect(screen("natural")).to_contain_text("15.92 Hz")
    expect(screen("notice")).to_have_count(0)
    expect(screen("busy")).to_be_empty()


def test_every_picture_is_painted(screen):
    screen.after(0, "picture")
    screen.says(START)
    for name in CARDS:
        assert colours(screen.pixels(screen.card(name))) > 30, name
    for name in ("history", "phase", "spectrum", "section"):
        assert near(screen.pixels(screen.card(name)), MOTION).sum() > 40, name
    # The dot of the instant, in both charts of the motion.
    for name in ("history", "phase"):
        assert near(screen.pixels(screen.card(name)), CURSOR).sum() > 15, name
    # The diagram goes over the parameter with a line at its value, -24 of -120 to 12.
    assert screen.cursor("plot-diagram") == pytest.approx(96 / 132, abs=0.003)
    assert (screen("from").input_value(), screen("to").input_value()) == ("-120", "12")
    legend = screen("legend").locator("li").all_inner_texts()
    assert any(one.startswith("synchronous") for one in legend)
    assert any(one.startswith("2T") for one in legend)


@pytest.mark.parametrize(
    ("brake", "friction"), [("wedge", "coulomb"), ("leading-shoe", "smoothed")], ids=str
)
def test_fits_a_laptop(screen, brake, friction):
    """1440 x 900: all of it is seen at once, whatever the machine."""
    if brake != "wedge":
        screen("input-brake").select_option(KINDS[brake])
        screen("input-friction").select_option(KINDS[friction])
        expect(screen("input-steepness")).to_be_visible()
        expect(screen("input-friction_arm")).to_be_visible()
    size = screen.page.evaluate(_SIZE)
    assert size["scrollHeight"] <= size["clientHeight"] == 900
    assert size["scrollWidth"] <= size["clientWidth"] == 1440
    found = boxes(screen)
    assert overlapping(found) == []
    for name, (left, top, right, bottom) in found.items():
        assert left >= 0, name
        assert top >= 0, name
        assert right <= 1440, name
        assert bottom <= 900, name
    assert screen.page.evaluate(_SCROLLERS) == []
    assert screen.page.evaluate(_CUT) == []


def test_scrolls_as_one_page_on_a_small_screen(visit):
    """1024 x 768: downwards alone, and nothing inside it scrolls by itself."""
    screen = visit(1024, 768)
    screen.says(START)
    size = screen.page.evaluate(_SIZE)
    assert size["scrollWidth"] <= size["clientWidth"]
    assert size["scrollHeight"] > 768
    found = boxes(screen)
    assert overlapping(found) == []
    assert all(left >= 0 and right <= 1024 for left, _, right, _ in found.values())
    assert screen.page.evaluate(_SCROLLERS) == []
    assert screen.page.evaluate(_CUT) == []
    # The wheel scrolls the page, also over a chart.
    screen.page.mouse.move(600, 350)
    screen.page.mouse.wheel(0, 3000)
    screen.page.wait_for_function("() => scrollY > 100")
    box = screen.card("plots").bounding_box()
    assert box["y"] + box["height"] <= 768
    # The bar at the top stays.
    assert screen("header").bounding_box()["y"] == 0


def test_every_picture_over_parameters_has_room(screen):
    for name in ("regimes", "stability", "basins"):
        screen(f"tab-{name}").click()
        expect(screen(f"plot-{name}")).to_be_visible()
        expect(screen("plot-diagram")).to_be_hidden()
        expect(screen("legend").locator("li").first).to_be_visible()
        size = screen.page.evaluate(_SIZE)
        assert size["scrollHeight"] <= 900, name
        assert screen.page.evaluate(_SCROLLERS) == [], name


def test_help(screen):
    text = screen.page.locator(".help dl")
    expect(text).to_be_hidden()
    screen("help").click()
    expect(text).to_be_visible()
    screen("help").click()
    expect(text).to_be_hidden()


def test_every_parameter_has_a_tooltip(screen):
    for name in ("eta", "slope", "amplitude", "kinetic", "inertia", "periods"):
        assert len(screen(f"slider-{name}").get_attribute("title")) > 3


def test_the_header_can_be_reached_by_keyboard(page):
    """Tab goes through all controls of the header, and the focus is visible."""
    page.locator(".brand").click()  # from the beginning of the page
    seen = []
    for _ in range(8):
        page.keyboard.press("Tab")
        seen.append(page.evaluate("""() => {
  let one = document.activeElement, names = [];
  for (; one.shadowRoot?.activeElement; one = one.shadowRoot.activeElement)
    names.push(one.className);
  const outline = (one) => getComputedStyle(one).outlineStyle !== "none";
  return [names.join(" "), outline(one) || outline(one.getRootNode().host)];
}"""))  # fmt: skip
    for name in ("preset", "load", "save", "export", "law", "comparison", "help"):
        assert any(name in names and visible for names, visible in seen), (name, seen)
