"""Pictures over parameters: a click goes there; what they go over can be chosen."""

from __future__ import annotations

import re

import pytest
from playwright.sync_api import expect
from screen import colours

from wedgebrake.explorer.core.presets import preset

STATE = preset("start").state()
PIXELS = 1.6  # a click is a pixel, and the frame is known to half a one


def value_at(screen, panel, x, low, high):
    """The value at a place of a picture, and how much of it is a pixel."""
    left, _, right, _ = screen.frame(panel)
    return low + (x - left) / (right - left) * (high - low), (high - low) / (right - left)


@pytest.mark.parametrize("share", [0.35, 0.93])
def test_a_click_in_the_diagram_goes_there(screen, share):
    x, y = screen.at("plot-diagram", share)
    wanted, pixel = value_at(screen, "plot-diagram", x, -120, 12)
    before = screen.shown()
    screen.page.mouse.click(x, y)
    screen.after(before)
    eta = screen.number("eta")
    assert eta == pytest.approx(wanted, abs=PIXELS * pixel)
    assert screen.number("slope") == pytest.approx(eta / 0.6, rel=1e-4)
    screen.says(STATE.edited(eta=eta))
    # The line of the present value stands where the click was, and the slider goes along.
    assert screen.cursor("plot-diagram") == pytest.approx(share, abs=0.003)
    assert screen.place("eta") == pytest.approx(share, abs=0.01)


def test_the_label_at_the_line_goes_along(screen):
    """It is painted: where it was there is none any more, and it stands beside the line."""
    screen.after(0, "picture")
    number = screen.shown()
    screen.type("eta", -100)
    screen.after(number)
    before = screen.cursor("plot-diagram")
    number = screen.shown()
    screen.type("eta", -60)
    screen.after(number)
    after = screen.cursor("plot-diagram")
    assert before == pytest.approx(20 / 132, abs=0.003)
    assert after == pytest.approx(60 / 132, abs=0.003)


def test_regimes(screen):
    drawn = screen.shown("picture")
    screen("tab-regimes").click()
    screen.after(drawn, "picture")
    expect(screen("legend").locator("li").first).to_be_visible()
    assert colours(screen.pixels(screen("plot-regimes"))) > 20
    low, high = (float(screen(f"across-{end}").input_value()) for end in ("from", "to"))
    bottom, top = (float(screen(f"up-{end}").input_value()) for end in ("from", "to"))
    x, y = screen.at("plot-regimes", 0.8, 0.7)
    left, upper, right, lower = screen.frame("plot-regimes")
    before = screen.shown()
    screen.page.mouse.click(x, y)
    screen.after(before)
    across, up = (high - low) / (right - left), (top - bottom) / (lower - upper)
    assert screen.number("eta") == pytest.approx(low + (x - left) * across, abs=PIXELS * across)
    assert screen.number("F0") == pytest.approx(bottom + (lower - y) * up, abs=PIXELS * up)
    eta, F0 = screen.number("eta"), screen.number("F0")
    screen.says(STATE.edited(eta=eta, F0=F0))
    # Another pair of parameters is another picture.
    drawn = screen.shown("picture")
    screen("up").select_option("c  damping")
    screen.after(drawn, "picture")
    expect(screen("up-from")).to_have_value("0.01")
    assert screen.number("F0") == F0


def test_stability(screen):
    drawn = screen.shown("picture")
    screen("tab-stability").click()
    screen.after(drawn, "picture")
    expect(screen("legend").locator("li").first).to_be_visible()
    before = screen.shown()
    x, y = screen.at("plot-stability", 0.97, 0.4)
    screen.page.mouse.click(x, y)
    screen.after(before)
    screen.tile("forward", "good")
    assert screen.number("eta") > 0
    assert screen.number("angle") != pytest.approx(0.34023)


def test_a_picture_that_was_kept_is_shown_again(screen):
    for tab in ("tab-stability", "tab-diagram", "tab-stability"):
        drawn = screen.shown("picture")
        screen(tab).click()
        screen.after(drawn, "picture")
        screen.still()


def test_basins(screen):
    drawn = screen.shown("picture")
    screen("tab-basins").click()
    screen.after(drawn, "picture")
    expect(screen("legend").locator("li").first).to_be_visible()
    low, high = (float(screen(f"across-{end}").input_value()) for end in ("from", "to"))
    bottom, top = (float(screen(f"up-{end}").input_value()) for end in ("from", "to"))
    left, upper, right, lower = screen.frame("plot-basins")
    x, y = screen.at("plot-basins", 0.25, 0.8)
    before = screen.shown()
    screen.page.mouse.click(x, y)
    screen.after(before)
    across, up = (high - low) / (right - left), (top - bottom) / (lower - upper)
    angle, velocity = screen.number("initial_angle"), screen.number("initial_velocity")
    assert angle == pytest.approx(low + (x - left) * across, abs=PIXELS * across)
    assert velocity == pytest.approx(bottom + (lower - y) * up, abs=PIXELS * up)
    assert screen.number("eta") == -24  # the machine is the same


def test_another_parameter_from_here_to_there(screen):
    drawn = screen.shown("picture")
    screen("axis").select_option("μₖ  kinetic")
    screen.after(drawn, "picture")
    expect(screen("from")).to_have_value("0.05")
    screen.still()
    assert screen.cursor("plot-diagram") == pytest.approx(0.25 / 0.55, abs=0.003)
    drawn = screen.shown("picture")
    screen("to").fill("0.35")
    screen("to").press("Enter")
    screen.after(drawn, "picture")
    assert screen.cursor("plot-diagram") == pytest.approx(0.25 / 0.30, abs=0.003)
    # The slider goes over the same span.
    at = screen.place("kinetic")
    assert at == pytest.approx(0.25 / 0.30, abs=0.02)
    x, y = screen.at("plot-diagram", 0.5)
    screen.page.mouse.click(x, y)
    expect(screen("input-kinetic")).not_to_have_value("0.3")
    assert screen.number("kinetic") == pytest.approx(0.2, abs=0.001)


def test_a_wrong_end_is_refused_in_words(screen):
    screen.still()
    drawn = screen.shown("picture")
    for end, text in (("from", "50"), ("to", "far"), ("from", "-1e400")):
        old = screen(end).input_value()
        screen(end).fill(text)
        screen(end).press("Enter")
        screen.refused("eta")
        expect(screen(end)).to_have_value(old)
    assert screen.cursor("plot-diagram") == pytest.approx(96 / 132, abs=0.003)
    assert screen.shown("picture") == drawn


def test_the_angle_instead_of_the_velocity(screen):
    screen.after(0, "picture")
    before = screen.pixels(screen("plot-diagram"))
    screen("quantity").select_option("angle")
    expect(screen("quantity")).to_have_value("angle")
    for _ in range(40):
        if (screen.pixels(screen("plot-diagram")) != before).mean() > 0.01:
            return
    raise AssertionError("the diagram is as before")


def test_the_pointer_is_told_the_class(screen):
    screen.after(0, "picture")
    x, y = screen.at("plot-diagram", 0.97, 0.3)
    wanted, _ = value_at(screen, "plot-diagram", x, -120, 12)
    screen.page.mouse.move(x, y, steps=3)
    said = re.compile(r"η = ([\d.]+): synchronous \(T\)")
    tip = screen.page.get_by_text(said)
    expect(tip).to_be_visible()
    value = said.search(tip.inner_text())[1]
    assert float(value) == pytest.approx(wanted, abs=132 / 150)  # of a cell
    screen.page.mouse.move(2, 450)
    expect(tip).to_have_count(0)
