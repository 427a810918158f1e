"""The brake in motion: the instant, the dot in the charts, the drawing; all in the browser."""

from __future__ import annotations

import re

import numpy as np
import pytest
from playwright.sync_api import expect
from screen import CURSOR, near


def instant(screen):
    """The time that is shown [s]."""
    return float(re.search(r"t = ([\d.]+) s", screen("stage-time").inner_text())[1])


def dot(screen, name):
    """The middle of the dot in a chart (x, y) [px]."""
    rows, columns = np.nonzero(near(screen.pixels(screen.card(name)), CURSOR, 20))
    assert rows.size > 10
    return columns.mean(), rows.mean()


@pytest.fixture
def quiet(visit):
    """A page to which nothing comes any more, and the frames that it sends over its websocket."""
    sent = []

    def listen(page):
        hear = lambda frame: sent.append(frame)  # noqa: E731 - Playwright marks it
        page.on("websocket", lambda socket: socket.on("framesent", hear))

    screen = visit(prepare=listen)
    screen.after(0, "picture")
    expect(screen("progress")).to_be_empty()
    screen.still()
    assert sent  # the beginning has been heard
    return screen, sent


def test_the_bar_goes_through_time_in_the_browser_alone(quiet):
    screen, sent = quiet
    begin, dots = instant(screen), [dot(screen, name) for name in ("history", "phase")]
    drawn, chart = screen.pixels(screen("stage-svg")), screen.pixels(screen.card("phase"))
    count = len(sent)
    screen.drag("scrub", 0.9)
    expect(screen("stage-time")).not_to_have_text(f"t = {begin:.4f} s")
    assert instant(screen) > begin
    assert screen("scrub").evaluate("(one) => Number(one.value)") == pytest.approx(0.9, abs=0.02)
    for name, before in zip(("history", "phase"), dots, strict=True):
        assert np.hypot(*np.subtract(dot(screen, name), before)) > 15, name
    assert (screen.pixels(screen.card("phase")) != chart).any()
    assert (screen.pixels(screen("stage-svg")) != drawn).mean() > 0.005
    # The dot of the history stands at that time.
    left, _, right, _ = screen.frame("history")
    box = screen.card("history").bounding_box()
    share = (box["x"] + dot(screen, "history")[0] - left) / (right - left)
    assert share == pytest.approx(0.9, abs=0.02)
    # Nobody was asked.
    assert sent[count:] == []


def test_a_click_in_the_history_goes_to_that_time(quiet):
    screen, _ = quiet
    first, last = (float(found) for found in ends(screen))
    x, y = screen.at("history", 0.25)
    screen.page.mouse.click(x, y)
    left, _, right, _ = screen.frame("history")
    wanted = first + (x - left) / (right - left) * (last - first)
    screen.page.wait_for_function(
        "([clock, wanted, near]) => Math.abs(parseFloat(clock.textContent.slice(4)) - wanted)"
        " < near",
        arg=[screen("stage-time").element_handle(), wanted, 2 * (last - first) / (right - left)],
    )


def ends(screen):
    """First and last time of the motion shown [s], from both ends of the bar."""
    found = []
    for key in ("Home", "End"):
        before = screen("stage-time").inner_text()
        screen("scrub").press(key)
        expect(screen("stage-time")).not_to_have_text(before)
        found.append(instant(screen))
    return found


def test_plays_and_pauses(screen):
    play = screen("play")
    expect(play).to_have_attribute("aria-label", "play")
    texts = {screen("stage-time").inner_text()}
    play.click()
    expect(play).to_have_attribute("aria-label", "pause")
    for _ in range(4):
        screen.page.wait_for_function(
            "([clock, seen]) => !seen.includes(clock.textContent)",
            arg=[screen("stage-time").element_handle(), sorted(texts)],
        )
        texts.add(screen("stage-time").inner_text())
    play.click()
    expect(play).to_have_attribute("aria-label", "play")
    frames = "() => new Promise((done) => setTimeout(done, 300))"
    screen.page.evaluate(frames)
    still = screen("stage-time").inner_text()
    screen.page.evaluate(frames)
    assert screen("stage-time").inner_text() == still


def test_the_drawing_says_what_the_brake_does(screen):
    """Somewhere on its way the brake sticks, slides both ways, and is released."""
    seen = set()
    for step in range(0, 101, 2):
        screen("scrub").evaluate(
            "(one, share) => { one.value = share; one.dispatchEvent(new Event('input')); }",
            step / 100,
        )
        seen.add(screen.page.evaluate(
            "([word]) => new Promise((done) => requestAnimationFrame(() =>"
            " requestAnimationFrame(() => done(word.textContent))))",
            [screen("stage-state").element_handle()],
        ))  # fmt: skip
    assert seen == {"sticking", "sliding forwards", "sliding backwards", "released"}
    expect(screen("stage-svg")).to_contain_text("brake torque")
