"""What a page of the explorer shows: numbers, words and pixels, as a user meets them."""

from __future__ import annotations

import io
import re
from typing import Any

import numpy as np
from PIL import Image

from wedgebrake.explorer.core.snapshot import look
from wedgebrake.explorer.core.state import Desk
from wedgebrake.explorer.core.verdict import verdict

# Colours of the page (app/charts/look.py, plots/style.py) that tests look for.
FRAME, INK, MOTION, CURSOR = "#C9D0D8", "#1B2430", "#0072B2", "#E69F00"
GHOST = "#A9B2BD"
START = (
    "Linearly unstable both ways. Repeats every six periods of the torque, sticks in both"
    " directions."
)
CARDS = ("history", "phase", "stage", "spectrum", "section", "atlas")

_AFTER = "([page, what, number]) => Number(page.dataset[what] ?? 0) > number"
_STILL = """
(page) => new Promise((done) => {
  let timer = setTimeout(() => done(), 700);
  new MutationObserver(() => { clearTimeout(timer); timer = setTimeout(() => done(), 700); })
    .observe(page, { attributes: true });
})
"""


class Screen:
    """A page in the browser, by what stands on it.

    page : Playwright's
    """

    def __init__(self, page: Any) -> None:
        self.page = page
        self._root = page.locator(".explorer")

    def __call__(self, testid: str) -> Any:
        """The element of a test id."""
        return self.page.get_by_test_id(testid)

    def card(self, name: str) -> Any:
        """A card: history, phase, stage, spectrum, section or atlas."""
        return self(f"area-card {name}")

    def number(self, name: str) -> float:
        """The number that stands in an input."""
        return float(self(f"input-{name}").input_value())

    def type(self, name: str, text: str | float) -> None:
        """Type into an input, and Enter."""
        self(f"input-{name}").fill(str(text))
        self(f"input-{name}").press("Enter")

    def shown(self, what: str = "motion") -> int:
        """Which change of the desk the motion, or the open picture, shows."""
        return int(self._root.get_attribute(f"data-{what}") or 0)

    def after(self, number: int, what: str = "motion") -> None:
        """Wait until the motion, or the open picture, shows a later change."""
        self.page.wait_for_function(_AFTER, arg=[self._root.element_handle(), what, number])

    def still(self) -> None:
        """Wait until nothing new has come for longer than work is put off."""
        self._root.evaluate(_STILL)

    def begin_again(self) -> None:
        """Put the machine to begin with on the desk, and the page as it opened."""
        from playwright.sync_api import expect

        self.page.keyboard.press("Escape")
        self.page.mouse.move(2, 450)
        self.page.evaluate("scrollTo(0, 0)")
        # What a preset leaves as it is.
        if self("ghost").is_checked():
            self("ghost").uncheck()
        if self("input-shown").input_value() != "12":
            self.type("shown", 12)
        self("preset").select_option("start")
        expect(self("tab-diagram")).to_have_attribute("aria-selected", "true")
        expect(self("input-eta")).to_have_value("-24")
        if self("dismiss").count():
            self("dismiss").click()
        self.headline(START)
        expect(self("verdict")).to_have_attribute("data-pending", "false")

    def headline(self, text: str) -> None:
        """Wait until the verdict says this."""
        from playwright.sync_api import expect

        expect(self("headline")).to_have_text(text)

    def pixels(self, element: Any) -> np.ndarray:
        """What is painted of an element, (height, width, 3)."""
        return np.asarray(Image.open(io.BytesIO(element.screenshot())).convert("RGB"))

    def frame(self, name: str) -> tuple[float, float, float, float]:
        """Where the frame of a chart, or of a picture of the atlas, lies on the page.

        Its left, top, right and bottom [px], found by the colour of its lines, or of what fills it.
        """
        element = self(name) if name.startswith("panel-") else self.card(name)
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
        dark = (pixels.sum(axis=2) < 330).mean(axis=0)
        assert dark.max() > 0.9, "no line of the present value"
        return (float(np.flatnonzero(dark > 0.9).mean()) + 3.0) / (right - left)

    def drag(self, name: str, share: float, steps: int = 12, *, release: bool = True) -> None:
        """Drag the handle of a slider to a share of its way with the mouse."""
        slider = self(name)
        box = slider.bounding_box()
        here, most = slider.evaluate("(one) => [Number(one.value), Number(one.max)]")
        handle = 12.0  # the middle of the handle does not reach the ends
        along = lambda part: box["x"] + handle / 2 + part * (box["width"] - handle)  # noqa: E731
        middle = box["y"] + box["height"] / 2
        self.page.mouse.move(along(here / most), middle)
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


def said_of(desk: Desk) -> str:
    """The headline that the settled motion of a desk deserves, computed here."""
    return verdict(desk, look(desk, settle=True))["headline"]


def words(text: str) -> str:
    """A text with single blanks."""
    return re.sub(r"\s+", " ", text).strip()
