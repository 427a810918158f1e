"""The machine's values on the page: sliders, numbers, kinds; and what follows from them."""

from __future__ import annotations

import pytest
from playwright.sync_api import expect

from wedgebrake.explorer.core.fields import _KINDS as KINDS
from wedgebrake.explorer.core.presets import preset

STATE = preset("start").state()


def test_a_slider_moves_everything_that_follows(screen):
    before, drawn = screen.shown(), screen.pixels(screen.card("history"))
    screen.drag("eta", 0.95, release=False)
    # Numbers, verdict and pictures follow while the slider is still held.
    screen.after(before)
    screen("verdict.good").wait_for()
    screen.still()
    eta = screen.number("eta")
    assert 0 < eta < 12
    assert screen.number("slope") == pytest.approx(eta / 0.6, rel=1e-4)
    screen.page.mouse.up()
    screen.tile("forward", "good")
    assert screen.number("eta") == eta
    # The line in the diagram stands there.
    screen.marks("plot-diagram", (eta + 120) / 132)
    assert (screen.pixels(screen.card("history")) != drawn).mean() > 0.01
    screen.says(STATE.edited(eta=eta))


def test_a_number_is_typed(screen):
    screen.type("eta", "-6,5")  # with a comma, as some write it
    screen.says(STATE.edited(eta=-6.5))
    assert screen.number("eta") == -6.5
    assert screen.number("slope") == pytest.approx(-6.5 / 0.6, rel=1e-4)
    # What the slope is set to is what the group becomes.
    screen.type("slope", 10)
    screen("verdict.good").wait_for()
    assert screen.number("eta") == pytest.approx(6.0)
    at = screen.place("eta")
    low, high = STATE.view.spans["eta"]
    assert low + at * (high - low) == pytest.approx(6.0, abs=0.2)


# A value that is not allowed, and what is no number.
REFUSED = {"inertia": "0", "stiffness": "stiff", "radius": "", "drive_speed": "1e400"}


def test_a_wrong_value_is_refused_in_words(screen):
    before = screen.shown()
    for name, text in REFUSED.items():
        field = screen(f"input-{name}")
        old = field.input_value()
        screen.type(name, text)
        screen.refused("inertia" if name == "inertia" else "")
        expect(field).to_have_value(old)
    assert screen.shown() == before
    screen.says(STATE)
    screen.type("inertia", "1.5")
    expect(screen("natural")).to_contain_text("12.99")  # sqrt(k/J)/2 pi


def test_kinds_of_brake(screen):
    begin = screen.pixels(screen("stage-svg"))
    screen.type("angle", 0.4)
    for kind, names in (
        ("band", ["wrap_angle", "radius"]),
        ("leading-shoe", ["actuation_arm", "normal_arm", "friction_arm"]),
        ("conventional", ["radius"]),
    ):
        screen("input-brake").select_option(KINDS.get(kind, kind))
        for name in names:
            expect(screen(f"input-{name}")).to_be_visible()
        for name in ("angle", "alpha"):  # of the wedge alone
            expect(screen(f"input-{name}")).to_have_count(0)
        screen.says(STATE.edited(brake=kind))
        assert (screen.pixels(screen("stage-svg")) != begin).mean() > 0.01
    # There is no other brake to compare this one with.
    expect(screen("comparison")).to_be_disabled()
    screen("input-brake").select_option("wedge")
    expect(screen("input-angle")).to_have_value("0.4")  # as it was left
    screen("input-release").uncheck()
    screen.says(STATE.edited(angle=0.4, release=False))


def test_friction_laws(screen):
    screen.type("eta", -6)
    screen("law-Smoothed").click()
    expect(screen("input-steepness")).to_be_visible()
    smoothed = STATE.edited(eta=-6.0).edited(friction="smoothed")
    screen.says(smoothed)
    screen("input-friction").select_option(KINDS["tabulated"])
    expect(screen("law-Table")).to_be_visible()
    expect(screen("input-steepness")).to_have_count(0)
    tabulated = smoothed.edited(friction="tabulated")
    # A table is two lists; lists that do not fit each other are refused.
    screen.type("coefficients", "0.3, 0.28")
    screen.refused("coefficients")
    screen.type("coefficients", "0.3; 0.29  0.28")
    expect(screen("input-coefficients")).to_have_value("0.3, 0.29, 0.28")
    screen.says(tabulated.edited(coefficients=(0.3, 0.29, 0.28)))
    screen("law-Exact").click()
    expect(screen("input-coefficients")).to_have_count(0)
    expect(screen("input-static")).to_be_visible()
