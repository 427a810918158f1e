"""What a page of the explorer shows: numbers, words and pixels, as a user meets them."""

from __future__ import annotations

import io
import re
from typing import Any

import numpy as np
from PIL import Image

from wedgebrake.explorer.core.presets import preset
from wedgebrake.explorer.core.snapshot import take_snapshot
from wedgebrake.explorer.core.state import PageState
from wedgebrake.explorer.core.verdict import verdict

# Colours of the page (app/charts/look.py, plots/style.py) that tests look for.
FRAME, INK, MOTION, CURSOR = "#C9D0D8", "#1B2430", "#0072B2", "#E69F00"
GHOST = "#A9B2BD"
CARDS = ("history", "phase", "brake", "spectrum", "section", "plots")

_TABS = ("diagram", "regimes", "stability", "basins")
# Elements of the page by the names that tests give them.
_ELEMENTS = {
    "preset": ".preset select", "load": ".load input", "save": ".save button",
    "export": ".export button", "comparison": ".comparison input", "help": ".help summary",
    "notice": ".notyf__message", "dismiss": ".notyf__dismiss-btn", "natural": ".fact-natural",
    "axis": ".across select", "across": ".across select", "up": ".up select",
    "quantity": ".quantity select", "from": ".across-from input", "to": ".across-to input",
}  # fmt: skip
_STILL = """
() => new Promise((done) => {
  const watched = {attributes: true, childList: true, subtree: true, characterData: true};
  let timer = setTimeout(() => done(), 700);
  const all = (root, found) => {
    for (const one of root.querySelectorAll("*")) if (one.shadowRoot) {
      if (one.className.match?.(/strip|foot/)) found.push(one.shadowRoot);
      all(one.shadowRoot, found);
    }
    return found;
  };
  const watch = new MutationObserver(() => { clearTimeout(timer); timer = setTimeout(done, 700); });
  for (const root of all(document, [])) watch.observe(root, watched);
})
"""


class Screen:
    """A page in the browser, by what stands on it.

    page : Playwright's
    """

    def __init__(self, page: Any) -> None:
        self.page = page

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
        """A card: history, phase, brake, spectrum, section or plots."""
        return self(f"card.{name}")

    def choose(self, name: str) -> None:
        """Choose a preset."""
        self("preset").select_option(preset(name).title)

    def number(self, name: str) -> float:
        """The number that stands in an input."""
        return float(self(f"input-{name}").input_value())

    def refused(self, words: str) -> None:
        """Wait for a notice that has some words, and dismiss what there is."""
        self("notice").filter(has_text=words).first.wait_for()
        self("dismiss").evaluate_all("(all) => all.forEach((one) => one.click())")
        self.page.wait_for_function("() => !document.querySelector('.notyf__message')")

    def place(self, name: str) -> float:
        """The place of a slider's handle, as a share of its way."""
        slider = self(f"slider-{name}")
        handle, way = (slider.locator(one).bounding_box() for one in (".noUi-handle", ".noUi-base"))
        return float((handle["x"] + handle["width"] / 2 - way["x"]) / way["width"])

    def type(self, name: str, text: str | float) -> None:
        """Type into an input, and Enter."""
        self(f"input-{name}").fill(str(text))
        self(f"input-{name}").press("Enter")

    def tone(self, tone: str) -> None:
        """Wait until the verdict is "good", "warn" or "bad"."""
        self(f"verdict.{tone}").wait_for()

    def tile(self, name: str, tone: str) -> None:
        """Wait until a tile of the verdict has a tone."""
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
        self.page.evaluate(_STILL)

    def begin_again(self) -> None:
        """Load the preset to begin with, and show the page as it opened."""
        from playwright.sync_api import expect

        self.page.mouse.move(2, 450)
        self.page.evaluate("scrollTo(0, 0)")
        # What a preset leaves as it is.
        if self("comparison").is_checked():
            self("comparison").uncheck()
        if self("input-shown").input_value() != "12":
            self.type("shown", 12)
        self("tab-diagram").click()
        self.choose("start")
        expect(self("input-eta")).to_have_value("-24")
        if self("dismiss").count():
            self.refused("")
        self.says(preset("start").state())

    def says(self, state: PageState) -> None:
        """Wait until the page shows the verdict that a study deserves, computed here."""
        from playwright.sync_api import expect

        wanted = verdict(state, take_snapshot(state, settle=True))
        expect(self("headline")).to_have_text(wanted["headline"])
        expect(self("verdict")).not_to_have_class(re.compile("pending"))

    def pixels(self, element: Any) -> np.ndarray:
        """What is painted of an element, (height, width, 3)."""
        return np.asarray(Image.open(io.BytesIO(element.screenshot())).convert("RGB"))

    def frame(self, name: str) -> tuple[float, float, float, float]:
        """Where the frame of a chart, or of a picture of the atlas, lies on the page.

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

    def cursor(self, name: str) -> float:
        """The share of the width at which the line of the present value stands."""
        left, top, right, bottom = self.frame(name)
        inside = Image.open(io.BytesIO(self.page.screenshot())).convert("RGB")
        # Half of the height, and none of the frame.
        box = inside.crop((int(left) + 3, int(top) + 3, int(right) - 2, int((top + bottom) / 2)))
        pixels = np.asarray(box).astype(int)
        dark = (pixels.sum(axis=2) < 450).mean(axis=0)
        assert dark.max() > 0.7, "no line of the present value"
        line = np.flatnonzero(dark > 0.9 * dark.max())  # points may lie over it
        return (float(line.mean()) + 3.0) / (right - left)

    def drag(self, name: str, share: float, steps: int = 12, *, release: bool = True) -> None:
        """Drag the handle of a slider to a share of its way with the mouse."""
        if name == "scrub":  # a plain input
            box = self(name).bounding_box()
            here = self(name).evaluate("(one) => Number(one.value) / Number(one.max)")
            inset = 6.0
        else:
            box = self(f"slider-{name}").locator(".noUi-base").bounding_box()
            here, inset = self.place(name), 0.0
        along = lambda part: box["x"] + inset + part * (box["width"] - 2 * inset)  # noqa: E731
        middle = box["y"] + box["height"] / 2
        self.page.mouse.move(along(here), middle)
        self.page.mouse.down()
        self.page.mouse.move(along(share), middle, steps=steps)
        if release:
            self.page.mouse.up()


def near(pixels: np.ndarray, colour: str, reach: int = 12) -> np.ndarray:
    """Which pixels have about a colour, (height, width)."""
    wanted = [int(colour[i : i + 2], 16) for i in (1, 3, 5)]
    return np.all(np.abs(pixels.astype(int) - wanted) <= reach, axis=2)


def colours(pixels: np.ndarray) -> int:
    """How many colours there are."""
    return len(np.unique(pixels.reshape(-1, 3), axis=0))


def words(text: str) -> str:
    """A text with single blanks."""
    return re.sub(r"\s+", " ", text).strip()
