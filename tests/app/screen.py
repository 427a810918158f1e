"""What a page of the explorer shows: numbers, words and pixels, as a user meets them."""

from __future__ import annotations

import io
import re
from itertools import combinations
from typing import Any

import numpy as np
from PIL import Image

from wedgebrake.explorer.core.presets import START, preset
from wedgebrake.explorer.core.snapshot import take_snapshot
from wedgebrake.explorer.core.state import PageState
from wedgebrake.explorer.core.verdict import verdict

# Colours of the page (app/charts/look.py, plots/style.py) that tests look for.
FRAME, MOTION, CURSOR, COMPARISON = "#C9D0D8", "#0072B2", "#E69F00", "#A9B2BD"
CARDS = ("history", "phase", "brake", "spectrum", "section", "torque", "plots")
# The inputs of the machine.
INPUTS = ".parameters :is(input, select)"

_TABS = ("diagram", "regimes", "stability", "basins", "curve", "trace")
# Elements of the page by the names that tests give them.
_ELEMENTS = {
    "preset": ".preset select", "load": ".load input", "save": ".save button",
    "export": ".export button", "comparison": ".comparison input", "help": ".help summary",
    "notice": ".notyf__message", "natural": ".fact-natural",
    "across": ".across select", "up": ".up select", "quantity": ".quantity select",
    "follow": ".follow input", "level": ".level select", "levels": ".levels input",
    "samplings": ".samplings input", "measure": ".measure select", "stop": ".stop button",
    "load-trace": ".load-trace input", "column": ".column select",
    "observes": ".observes select", "add-free": ".add-free select", "free": ".free input",
    "fit": ".fit button", "take": ".take button", "from": ".across-from input",
    "to": ".across-to input",
}  # fmt: skip
_DISMISS = """
(all) => {
  for (const one of all) {
    one.closest(".notyf__toast").style.display = "none";
    one.className = "";
  }
}
"""
# Elements that scroll, or would, inside the page; and those with words of which a part is cut off,
# without the narrow labels, whose whole words are in titles.
_FLAWS = """
() => {
  const all = [];
  const walk = (root) => {
    for (const one of root.querySelectorAll("*")) {
      all.push(one);
      if (one.shadowRoot) walk(one.shadowRoot);
    }
  };
  walk(document);
  const scrolls = (one) => {
    if (one === document.scrollingElement || one === document.body) return false;
    const {overflowX, overflowY} = getComputedStyle(one);
    const may = (way) => way === "auto" || way === "scroll";
    return (may(overflowY) && one.scrollHeight > one.clientHeight + 1)
      || (may(overflowX) && one.scrollWidth > one.clientWidth + 1);
  };
  const own = (one) => [...one.childNodes].some((child) => child.nodeType === 3
    && child.textContent.trim());
  const cut = (one) => {
    const {overflowX, visibility} = getComputedStyle(one);
    const seen = one.checkVisibility() && visibility === "visible" && one.clientWidth > 2;
    return seen && own(one) && overflowX !== "visible" && one.scrollWidth > one.clientWidth + 1
      && !["SELECT", "OPTION", "LABEL"].includes(one.tagName)
      && !one.className.includes("bk-slider-title") && !one.closest("dl");
  };
  return all.filter((one) => scrolls(one) || cut(one))
    .map((one) => `${one.tagName} ${one.className}: ${one.textContent}`);
}
"""


class Screen:
    """A page in the browser, by what stands on it.

    page   : Playwright's
    loaded : (address, status) of each response
    sent   : frames sent over its websocket; heard : those received
    """

    def __init__(self, page: Any) -> None:
        self.page = page
        self.loaded: list[tuple[Any, int]] = []
        self.sent: list[Any] = []
        self.heard: list[Any] = []
        self._first: list[Any] = []
        self._instant = ""

    def __call__(self, name: str) -> Any:
        """The element of a name."""
        kind, _, rest = name.partition("-")
        if name in _ELEMENTS:
            selector = _ELEMENTS[name]
        elif kind == "input":
            selector = f".input-{rest} :is(input, select)"
        elif kind == "tab":
            return self.page.locator(".tabs .bk-tab").nth(_TABS.index(rest))
        elif rest in ("from", "to"):
            selector = f".{name} input"
        elif kind == "law":
            selector = f'.law button:text("{rest}")'
        elif kind == "stage" or name in ("play", "scrub"):
            return self.page.get_by_test_id(name)
        else:
            selector = f".{name}"
        return self.page.locator(selector)

    def card(self, name: str) -> Any:
        return self(f"card.{name}")

    def choose(self, name: str) -> None:
        self("preset").select_option(preset(name).title)

    def number(self, name: str) -> float:
        return float(self(f"input-{name}").input_value())

    def values(self, inputs: str = INPUTS) -> list[Any]:
        return self.page.locator(inputs).evaluate_all(  # type: ignore[no-any-return]
            "(all) => all.map((one) => one.type === 'checkbox' ? one.checked : one.value)"
        )

    def refused(self, words: str) -> None:
        """Wait for a notice that has some words, and put what there is out of sight."""
        self("notice").filter(has_text=words).first.wait_for()
        self("notice").evaluate_all(_DISMISS)

    def place(self, name: str) -> float:
        """The place of a slider's handle, as a share of its way."""
        slider = self(f"slider-{name}")
        handle, way = (slider.locator(one).bounding_box() for one in (".noUi-handle", ".noUi-base"))
        return float((handle["x"] + handle["width"] / 2 - way["x"]) / way["width"])

    def type(self, name: str, text: str | float) -> None:
        self(name if name in _ELEMENTS else f"input-{name}").fill(str(text))
        self(name if name in _ELEMENTS else f"input-{name}").press("Enter")

    def tile(self, name: str, tone: str) -> None:
        """Wait until a tile of the verdict is "good", "warn" or "bad"."""
        self(f"tile-{name}.{tone}").wait_for()

    def shown(self, what: str = "motion") -> int:
        """The number of the study that the motion, or the open picture, shows."""
        return int(self.page.locator(f"[data-{what}]").get_attribute(f"data-{what}"))

    def after(self, number: int, what: str = "motion") -> None:
        """Wait until the motion, or the open picture, shows a later study."""
        from playwright.sync_api import expect

        not_later = re.compile(f"^({'|'.join(map(str, range(number + 1)))})$")
        expect(self.page.locator(f"[data-{what}]")).not_to_have_attribute(f"data-{what}", not_later)

    def still(self) -> None:
        """Wait until nothing new has come for longer than work is put off."""
        count = -1
        while count != len(self.heard):
            count = len(self.heard)
            self.page.wait_for_timeout(700)

    def begin_again(self) -> None:
        """Show the page as it opened, with the preset to begin with."""
        from playwright.sync_api import expect

        self.page.set_viewport_size({"width": 1440, "height": 900})
        self.page.mouse.move(2, 450)
        self.page.evaluate("scrollTo(0, 0)")
        everything = ":is(.header, .parameters, .plots) :is(input:not([type=file]), select)"
        if self.values(everything) != self._first:
            # What a preset leaves as it is.
            if self("comparison").is_checked():
                self("comparison").uncheck()
            if self("input-shown").input_value() != "12":
                self.type("shown", 12)
            self("tab-diagram").click()
            self.choose(START)
            expect(self("input-eta")).to_have_value("-24")
            self.says(preset(START).state())
            self._first = self.values(everything)
            self._instant = self._instant or self("scrub").input_value()
        self("scrub").fill(self._instant)
        self("notice").evaluate_all(_DISMISS)
        expect(self("verdict")).not_to_have_class(re.compile("pending"))

    def says(self, state: PageState) -> None:
        """Wait until the page shows the verdict that a study deserves, computed here."""
        from playwright.sync_api import expect

        wanted = verdict(state, take_snapshot(state, settle=True))["headline"]
        expect(self("headline")).to_have_text(wanted)
        expect(self("verdict")).not_to_have_class(re.compile("pending"))

    def pixels(self, element: Any) -> np.ndarray:
        """What is painted of an element, (height, width, 3)."""
        return np.asarray(Image.open(io.BytesIO(element.screenshot())).convert("RGB"))

    def frame(self, name: str) -> tuple[float, float, float, float]:
        """Where the frame of a chart, or of a picture over parameters, lies on the page.

        Its left, top, right and bottom [px], found by the colour of its lines, or of what fills it.
        """
        element = self(name) if name.startswith("plot-") else self.card(name)
        pixels = self.pixels(element)
        lines = near(pixels, FRAME, 3)
        columns = np.flatnonzero(lines.mean(axis=0) > 0.45)
        rows = np.flatnonzero(lines.mean(axis=1) > 0.55)
        if np.ptp(rows) < 20 or np.ptp(columns) < 20:  # covered by a map
            filled = ~near(pixels, "#FFFFFF", 3)
            columns = np.flatnonzero(filled.mean(axis=0) > 0.6)
            rows = np.flatnonzero(filled.mean(axis=1) > 0.8)
        box = element.bounding_box()
        return (
            box["x"] + columns[0], box["y"] + rows[0], box["x"] + columns[-1], box["y"] + rows[-1]
        )  # fmt: skip

    def at(self, name: str, across: float, up: float = 0.5) -> tuple[float, float]:
        """Where shares of a chart's width and height lie on the page [px]."""
        left, top, right, bottom = self.frame(name)
        return round(left + across * (right - left)), round(bottom - up * (bottom - top))

    def marks(self, name: str, share: float) -> None:
        """Wait until the line of the present value stands at a share of the width."""
        for _ in range(40):
            left, top, right, bottom = self.frame(name)
            inside = Image.open(io.BytesIO(self.page.screenshot())).convert("RGB")
            # Half of the height, and none of the frame.
            box = map(int, (left + 3, top + 3, right - 2, (top + bottom) / 2))
            dark = (np.asarray(inside.crop(tuple(box))).sum(axis=2, dtype=int) < 450).mean(axis=0)
            line = np.flatnonzero(dark > 0.9 * dark.max())  # points may lie over it
            found = (float(line.mean()) + 3.0) / (right - left) if dark.max() > 0.7 else np.nan
            if abs(found - share) < 0.003:
                return
        raise AssertionError(f"the line of the present value stands at {found}, not {share}")

    def drag(self, name: str, share: float, steps: int = 12, *, release: bool = True) -> None:
        """Drag the handle of a slider to a share of its way with the mouse."""
        box = self(f"slider-{name}").locator(".noUi-base").bounding_box()
        along = lambda part: box["x"] + part * box["width"]  # noqa: E731
        middle = box["y"] + box["height"] / 2
        self.page.mouse.move(along(self.place(name)), middle)
        self.page.mouse.down()
        self.page.mouse.move(along(share), middle, steps=steps)
        if release:
            self.page.mouse.up()

    def check_layout(self, width: int) -> int:
        """Assert that nothing is too wide, overlaps, scrolls by itself or is cut off.

        Returns the height of the page [px].
        """
        found = {}
        for name in ("header", "parameters", "strip", *CARDS):
            box = (self.card(name) if name in CARDS else self(name)).bounding_box()
            found[name] = (box["x"], box["y"], box["x"] + box["width"], box["y"] + box["height"])
        assert all(one[0] >= 0 and one[1] >= 0 and one[2] <= width for one in found.values())
        assert [
            (one, other) for (one, a), (other, b) in combinations(found.items(), 2)
            if min(a[2], b[2]) - max(a[0], b[0]) > 1 and min(a[3], b[3]) - max(a[1], b[1]) > 1
        ] == []  # fmt: skip
        assert self.page.evaluate(_FLAWS) == []
        page = "document.scrollingElement"
        assert self.page.evaluate(f"{page}.scrollWidth <= {page}.clientWidth")
        return int(self.page.evaluate(f"{page}.scrollHeight"))


def near(pixels: np.ndarray, colour: str, reach: int = 12) -> np.ndarray:
    """Which pixels have about a colour, (height, width)."""
    wanted = [int(colour[i : i + 2], 16) for i in (1, 3, 5)]
    return np.all(np.abs(pixels.astype(int) - wanted) <= reach, axis=2)


def colours(pixels: np.ndarray) -> int:
    return len(np.unique(pixels.reshape(-1, 3), axis=0))
