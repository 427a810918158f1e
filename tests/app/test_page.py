"""The page as it opens: what stands on it, and where."""

from __future__ import annotations

from itertools import combinations

import pytest
from playwright.sync_api import expect
from screen import CARDS, CURSOR, MOTION, START, colours, near, words

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
      && !["SELECT", "OPTION", "LABEL"].includes(one.tagName) && one.className !== "words";
  }).map((one) => `${one.tagName} ${one.className}: ${one.textContent}`);
}"""
)
_SIZE = """() => {
  const {scrollWidth, scrollHeight, clientWidth, clientHeight} = document.scrollingElement;
  return {scrollWidth, scrollHeight, clientWidth, clientHeight};
}"""
TILES = {
    "forward": ["Sliding forwards", "unstable", "margin −23.9 in η"],
    "backward": ["Sliding backwards", "unstable", "margin −23.3 in η"],
    "locking": ["Self-locking", "none", "slides both ways"],
    "motion": ["Motion", "6T-periodic", "recovers in"],
    "sticks": ["Stick-slip", "both ways", "sticks a period"],
    "torque": ["Brake torque", "106 N m", "peak 333"],
    "share": ["Time stuck", "13 %", "of the time at rest"],
}


def boxes(screen):
    """(left, top, right, bottom) of the areas by name."""
    areas = screen.page.locator("[data-testid^='area-']").all()
    found = {}
    for area in areas:
        box = area.bounding_box()
        name = area.get_attribute("data-testid").removeprefix("area-").removeprefix("card ")
        found[name] = (box["x"], box["y"], box["x"] + box["width"], box["y"] + box["height"])
    assert set(found) == {"header", "machine", "strip", *CARDS}
    return found


def overlapping(found):
    """Pairs of areas that share pixels."""
    return [
        (one, other) for (one, a), (other, b) in combinations(found.items(), 2)
        if min(a[2], b[2]) - max(a[0], b[0]) > 1 and min(a[3], b[3]) - max(a[1], b[1]) > 1
    ]  # fmt: skip


def test_says_what_the_machine_does(visit):
    screen = visit()
    screen.headline(START)
    expect(screen("tone")).to_have_text("caution")
    for name, found in TILES.items():
        for text in found:
            expect(screen(f"tile-{name}")).to_contain_text(text)
        assert screen(f"tile-{name}").get_attribute("title"), name
    assert screen.number("eta") == -24
    assert screen.number("slope") == -40
    # What cannot be set stands beside it.
    expect(screen("row-natural")).to_contain_text("15.92 Hz")
    expect(screen("notice")).to_be_empty()
    expect(screen("busy")).to_be_empty()


def test_every_picture_is_painted(screen):
    screen.after(0, "picture")
    screen.headline(START)
    for name in CARDS:
        assert colours(screen.pixels(screen.card(name))) > 30, name
    for name in ("history", "phase", "spectrum", "section"):
        assert near(screen.pixels(screen.card(name)), MOTION).sum() > 40, name
    # The dot of the instant, in both charts of the motion.
    for name in ("history", "phase"):
        assert near(screen.pixels(screen.card(name)), CURSOR).sum() > 15, name
    # The diagram goes over the parameter with a line at its value, -24 of -120 to 12.
    assert screen.cursor("panel-diagram") == pytest.approx(96 / 132, abs=0.003)
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
        screen("input-brake").select_option(brake)
        screen("input-friction").select_option(friction)
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
    screen.headline(START)
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
    box = screen.card("atlas").bounding_box()
    assert box["y"] + box["height"] <= 768
    # The bar at the top stays.
    assert screen("area-header").bounding_box()["y"] == 0


def test_every_picture_over_parameters_has_room(screen):
    for name in ("regimes", "stability", "basins"):
        screen(f"tab-{name}").click()
        expect(screen(f"panel-{name}")).to_be_visible()
        expect(screen("panel-diagram")).to_be_hidden()
        expect(screen("legend").locator("li").first).to_be_visible()
        size = screen.page.evaluate(_SIZE)
        assert size["scrollHeight"] <= 900, name
        assert screen.page.evaluate(_SCROLLERS) == [], name


def test_help_tells_what_is_shown_and_its_limits(screen):
    expect(screen("help-text")).to_be_hidden()
    screen("help").click()
    text = words(screen("help-text").inner_text())
    for part in ("Verdict", "Basins", "Limits", "One degree of freedom", "2000 periods", "600"):
        assert part in text
    screen.page.keyboard.press("Escape")
    expect(screen("help-text")).to_be_hidden()


def test_says_what_every_symbol_means(screen):
    """Rows of the machine and tabs have words that come up under the pointer."""
    rows = screen.page.locator("[data-testid^='row-']").all()
    assert len(rows) > 25
    for row in rows:
        if row.get_attribute("data-testid") in ("row-release",):
            continue
        assert len(row.get_attribute("title")) > 3, row.get_attribute("data-testid")
    for name in ("diagram", "regimes", "stability", "basins"):
        assert screen(f"tab-{name}").get_attribute("title")


def test_can_be_reached_by_keyboard(page):
    """Tab goes through all controls of the bar, and the one that has it shows it."""
    page.locator("div.mark").click()  # from the beginning of the page
    seen = []
    for _ in range(9):
        page.keyboard.press("Tab")
        seen.append(
            page.evaluate(
                """() => {
  let one = document.activeElement;
  while (one.shadowRoot?.activeElement) one = one.shadowRoot.activeElement;
  const {outlineStyle, boxShadow} = getComputedStyle(one);
  const {outlineStyle: around = "none"} = one.parentElement
    ? getComputedStyle(one.parentElement) : {};
  const told = outlineStyle !== "none" || boxShadow !== "none" || around !== "none";
  return [one.dataset.testid ?? one.closest("[data-testid]")?.dataset.testid, told];
}"""
            )
        )
    names = [name for name, _ in seen]
    assert names[:4] == ["preset", "load", "save", "export"]
    assert {"law-coulomb", "ghost", "help"} <= set(names)
    assert all(told for _, told in seen), seen
