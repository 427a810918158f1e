"""Pictures over parameters: a click goes there; what they go over can be chosen."""

from __future__ import annotations

import numpy as np
import pytest
from playwright.sync_api import expect
from screen import colours, near

from wedgebrake.explorer.core.presets import preset
from wedgebrake.figures.style import PARTS

STATE = preset("start").state()
PIXELS = 1.6  # a click is a pixel, and the frame is known to half a one


def values_at(screen, panel, x, y, across, up=(0.0, 1.0)):
    """The values at a place of a picture over some ranges, and how much of them is a pixel."""
    left, top, right, bottom = screen.frame(panel)
    steps = (across[1] - across[0]) / (right - left), (up[1] - up[0]) / (bottom - top)
    return (across[0] + (x - left) * steps[0], up[0] + (bottom - y) * steps[1]), steps


def opened(screen, name):
    """Open a picture, and wait for it."""
    drawn = screen.shown("picture")
    screen(f"tab-{name}").click()
    screen.after(drawn, "picture")
    expect(screen("legend").locator("li").first).to_be_visible()


def test_a_click_in_the_diagram_goes_there(screen):
    x, y = screen.at("plot-diagram", 0.35)
    (wanted, _), (pixel, _) = values_at(screen, "plot-diagram", x, y, (-120, 12))
    before = screen.shown()
    screen.page.mouse.click(x, y)
    screen.after(before)
    eta = screen.number("eta")
    assert eta == pytest.approx(wanted, abs=PIXELS * pixel)
    assert screen.number("slope") == pytest.approx(eta / 0.6, rel=1e-4)
    screen.says(STATE.edited(eta=eta))
    # The line of the present value stands where the click was, and the slider goes along.
    screen.marks("plot-diagram", 0.35)
    assert screen.place("eta") == pytest.approx(0.35, abs=0.01)


@pytest.mark.parametrize(
    ("name", "place", "set_"),
    [
        ("regimes", (0.8, 0.7), ("eta", "F0")),
        ("stability", (0.97, 0.4), ("eta", None)),
        ("basins", (0.25, 0.8), ("initial_angle", "initial_velocity")),
    ],
)
def test_a_click_in_a_map_goes_there(screen, name, place, set_):
    opened(screen, name)
    expect(screen("plot-diagram")).to_be_hidden()
    assert screen.check_layout(1440) <= 900
    panel = f"plot-{name}"
    assert colours(screen.pixels(screen(panel))) > 20
    ranges = [
        [float(screen(f"{side}-{end}").input_value()) for end in ("from", "to")]
        for side in ("across", "up")
    ]
    x, y = screen.at(panel, *place)
    wanted, pixels = values_at(screen, panel, x, y, *ranges)
    before = screen.shown()
    screen.page.mouse.click(x, y)
    screen.after(before)
    found = [screen.number(one) for one in set_ if one]
    for value, right, pixel in zip(found, wanted, pixels, strict=False):
        assert value == pytest.approx(right, abs=PIXELS * pixel)
    if name == "stability":
        screen.tile("forward", "good")
        assert screen.number("angle") != pytest.approx(0.34023)  # of alpha
    else:
        screen.says(STATE.edited(**dict(zip(set_, found, strict=True))))


def test_amplitude_curves(screen):
    screen("tab-curve").click()
    expect(screen("levels")).to_have_value("250, 500, 750")
    # Stopped, it does not go on; it is computed when the user asks for it.
    expect(screen("stop")).to_have_text("Stop")
    screen("stop").click()
    expect(screen("progress")).to_have_text("stopped")
    expect(screen("stop")).to_have_text("Compute")
    screen.type("from", "8.6")
    screen.type("to", "9")
    screen.type("levels", "480 500")
    expect(screen("stop")).to_be_hidden()
    expect(screen("progress")).to_have_text("")
    words = screen("legend").locator("li").all_inner_texts()
    assert words == ["Tₑ = 480 N m", "Tₑ = 500 N m", "stable", "unstable", "sticks", "fold"]
    assert screen.check_layout(1440) <= 900
    drawn = screen.pixels(screen("plot-curve"))
    for colour in (PARTS[0], PARTS[1]):
        assert near(drawn, colour).sum() > 100
    screen("measure").select_option("phase of the angle")
    screen.still()
    assert (screen.pixels(screen("plot-curve")) != drawn).mean() > 0.01
    # A click goes to the frequency.
    before = screen.shown()
    screen.page.mouse.click(*screen.at("plot-curve", 0.5))
    screen.after(before)
    assert screen.number("frequency") == pytest.approx(8.8, abs=0.002)
    screen.type("levels", "480 480")
    screen.refused("levels")
    expect(screen("levels")).to_have_value("480, 500")
    screen.type("levels", "0")
    expect(screen("plot-curve")).to_contain_text("there is no orbit")


def test_another_parameter_from_here_to_there(screen):
    drawn = screen.shown("picture")
    screen("across").select_option("μₖ  kinetic")
    screen.after(drawn, "picture")
    expect(screen("from")).to_have_value("0.05")
    screen.marks("plot-diagram", 0.25 / 0.55)
    drawn = screen.shown("picture")
    screen.type("to", "0.35")
    screen.after(drawn, "picture")
    screen.marks("plot-diagram", 0.25 / 0.30)
    # The slider goes over the same span.
    assert screen.place("kinetic") == pytest.approx(0.25 / 0.30, abs=0.02)
    drawn = screen.shown("picture")
    for end, text in (("from", "50"), ("to", "far")):
        old = screen(end).input_value()
        screen.type(end, text)
        notices = screen("notice").filter(has_text="kinetic")
        screen.still()
        expect(notices).to_have_count(1)
        screen.refused("kinetic")
        expect(screen(end)).to_have_value(old)
    assert screen.shown("picture") == drawn
    x, y = screen.at("plot-diagram", 0.5)
    screen.page.mouse.click(x, y)
    expect(screen("input-kinetic")).not_to_have_value("0.3")
    assert screen.number("kinetic") == pytest.approx(0.2, abs=0.001)


def test_the_wheel_zooms_and_dragging_moves(screen):
    """A click then goes to the value that stands there; the button shows the whole again."""
    expect(screen("progress")).to_have_text("")
    screen.still()
    x, y = screen.at("plot-diagram", 0.5)
    mouse, before = screen.page.mouse, screen.pixels(screen("plot-diagram"))
    mouse.move(x, y)
    for _ in range(3):
        mouse.wheel(0, -200)
        screen.page.wait_for_timeout(100)
    mouse.down()
    mouse.move(x - 100, y, steps=5)
    mouse.up()
    screen.still()
    # The study is that of before; only the picture has changed.
    assert screen.number("eta") == STATE.value("eta")
    assert (screen.pixels(screen("plot-diagram")) != before).mean() > 0.01
    (whole, _), (pixel, _) = values_at(screen, "plot-diagram", x, y, (-120, 12))
    number = screen.shown()
    mouse.click(x - 100, y)  # where the value of the middle has been moved to
    screen.after(number)
    assert screen.number("eta") == pytest.approx(whole, abs=PIXELS * pixel)
    screen.page.locator(".plot-diagram .bk-tool-icon-reset").click()
    screen.marks("plot-diagram", 0.5)


def test_amplitudes_up_and_down(screen):
    def notes():
        return screen.page.locator("[data-picture]").get_attribute("title")

    screen.still()
    initial, legend = [notes()], screen("legend").all_inner_texts()
    screen("quantity").select_option("brake torque, rms")
    screen.still()
    initial.append(notes())
    assert screen("legend").all_inner_texts() == legend  # of the same values
    drawn, before = screen.shown("picture"), screen.pixels(screen("plot-diagram"))
    screen("follow").click()
    screen.after(drawn, "picture")
    expect(screen("progress")).to_have_text("")
    screen.still()
    assert len({notes(), *initial}) == 3
    # The points of the second attractor.
    assert np.any(screen.pixels(screen("plot-diagram")) != before)
    assert screen.check_layout(1440) <= 900
    screen("tab-regimes").click()
    expect(screen("follow")).to_be_hidden()
    # The legend of many classes covers no part of the plot.
    screen.page.locator(".foot li").nth(6).wait_for()
    screen.still()
    plot, foot = (
        screen.page.locator(one).first.bounding_box()
        for one in (".plot-regimes canvas", ".foot [data-picture]")
    )
    assert plot["y"] + plot["height"] <= foot["y"] + 1
