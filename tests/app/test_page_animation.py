"""The brake in motion: the instant, the dot in the charts, the drawing; all in the browser."""

from __future__ import annotations

import re

import numpy as np
import pytest
from playwright.sync_api import expect
from screen import CURSOR, near

# Until the clock shows another time than some.
_GOES_ON = "([clock, seen]) => !seen.includes(clock.textContent)"
_PAUSE = "() => new Promise((done) => setTimeout(done, 300))"
# What the drawing says at each place of the bar.
_STATES = """
async ([bar, word]) => {
  const frame = () => new Promise((done) => requestAnimationFrame(done));
  const seen = new Set();
  for (let step = 0; step <= 100; step += 2) {
    bar.value = step / 100;
    bar.dispatchEvent(new Event('input'));
    await frame();
    await frame();
    seen.add(word.textContent);
  }
  return [...seen].sort();
}
"""


def instant(screen):
    """The time that is shown [s]."""
    return float(re.search(r"t = ([\d.]+) s", screen("stage-time").inner_text())[1])


def dot(screen, name):
    """The middle of the dot in a chart (x, y) [px]."""
    rows, columns = np.nonzero(near(screen.pixels(screen.card(name)), CURSOR, 20))
    assert rows.size > 10
    return columns.mean(), rows.mean()


def test_the_bar_goes_through_time_in_the_browser_alone(screen):
    # Nothing comes any more.
    screen.after(0, "picture")
    expect(screen("progress")).to_be_empty()
    screen.still()
    begin, dots = instant(screen), [dot(screen, name) for name in ("history", "phase")]
    drawn = screen.pixels(screen("stage-svg"))
    count = len(screen.sent)
    assert count  # the beginning has been heard
    screen("scrub").fill("0.9")
    expect(screen("stage-time")).not_to_have_text(f"t = {begin:.4f} s")
    assert instant(screen) > begin
    for name, before in zip(("history", "phase"), dots, strict=True):
        assert np.hypot(*np.subtract(dot(screen, name), before)) > 15, name
    assert (screen.pixels(screen("stage-svg")) != drawn).mean() > 0.005
    # The dot of the history stands at that time.
    left, _, right, _ = screen.frame("history")
    box = screen.card("history").bounding_box()
    share = (box["x"] + dot(screen, "history")[0] - left) / (right - left)
    assert share == pytest.approx(0.9, abs=0.02)
    # Nobody was asked.
    assert len(screen.sent) == count


def test_plays_and_pauses(screen):
    play, clock = screen("play"), screen("stage-time")
    expect(play).to_have_attribute("aria-label", "play")
    texts = {clock.inner_text()}
    play.click()
    expect(play).to_have_attribute("aria-label", "pause")
    for _ in range(4):
        screen.page.wait_for_function(_GOES_ON, arg=[clock.element_handle(), sorted(texts)])
        texts.add(clock.inner_text())
    play.click()
    expect(play).to_have_attribute("aria-label", "play")
    screen.page.evaluate(_PAUSE)
    still = clock.inner_text()
    screen.page.evaluate(_PAUSE)
    assert clock.inner_text() == still


def test_the_drawing_says_what_the_brake_does(screen):
    """Somewhere on its way the brake sticks, slides both ways, and is released."""
    handles = [screen(name).element_handle() for name in ("scrub", "stage-state")]
    states = ["released", "sliding backwards", "sliding forwards", "sticking"]
    assert screen.page.evaluate(_STATES, handles) == states
    expect(screen("stage-svg")).to_contain_text("brake torque")
