"""The machine's values on the page: sliders, numbers, kinds; and what follows from them."""

from __future__ import annotations

import pytest
from playwright.sync_api import expect
from screen import GHOST, MOTION, near

from wedgebrake.explorer.core.fields import _KINDS as KINDS
from wedgebrake.explorer.core.presets import preset

STATE = preset("start").state()


def test_a_slider_moves_everything_that_follows(screen):
    before, drawn = screen.shown(), screen.pixels(screen.card("history"))
    screen.drag("eta", 0.95, release=False)
    # Numbers, verdict and pictures follow while the slider is still held.
    screen.after(before)
    screen.tone("good")
    screen.still()
    eta = screen.number("eta")
    assert 0 < eta < 12
    assert screen.number("slope") == pytest.approx(eta / 0.6, rel=1e-4)
    screen.page.mouse.up()
    screen.tile("forward", "good")
    assert screen.number("eta") == eta
    # The line in the diagram stands there.
    assert screen.cursor("plot-diagram") == pytest.approx((eta + 120) / 132, abs=0.003)
    assert (screen.pixels(screen.card("history")) != drawn).mean() > 0.01
    screen.says(STATE.edited(eta=eta))


def test_a_number_is_typed(screen):
    screen.type("eta", "-6,5")  # with a comma, as some write it
    screen.says(STATE.edited(eta=-6.5))
    assert screen.number("eta") == -6.5
    assert screen.number("slope") == pytest.approx(-6.5 / 0.6, rel=1e-4)
    # What the slope is set to is what the group becomes.
    screen.type("slope", 10)
    screen.tone("good")
    assert screen.number("eta") == pytest.approx(6.0)
    at = screen.place("eta")
    low, high = STATE.view.spans["eta"]
    assert low + at * (high - low) == pytest.approx(6.0, abs=0.2)


def test_a_slider_is_moved_by_keys(screen):
    handle = screen("slider-f").locator(".noUi-handle")
    handle.focus()
    screen.page.keyboard.press("ArrowRight")
    expect(screen("input-f")).not_to_have_value("0.63")
    screen.page.keyboard.press("End")
    expect(screen("input-f")).to_have_value("2.2")
    expect(screen("input-frequency")).to_have_value("35.014")


def test_sliders_of_ratios(screen):
    """Of the stiffness the middle is the geometric mean of the ends."""
    screen.drag("stiffness", 0.5)
    screen.page.wait_for_function("() => true")
    assert screen.number("stiffness") == pytest.approx(1e4, rel=0.05)
    screen.drag("stiffness", 0.0)
    expect(screen("input-stiffness")).to_have_value("1000")


REFUSED = {
    "inertia": "0", "damping": "-1", "kinetic": "7", "static": "0.1", "angle": "2",
    "frequency": "0", "periods": "1e9", "eta": "1e300", "alpha": "0", "stiffness": "stiff",
    "radius": "", "drive_speed": "1e400", "slope": "1 2",
}  # fmt: skip


def test_a_wrong_value_is_refused_in_words(screen):
    before = screen.shown()
    for name, text in REFUSED.items():
        field = screen(f"input-{name}")
        old = field.input_value()
        screen.type(name, text)
        screen.refused(name if name not in ("stiffness", "radius", "drive_speed") else "")
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
    screen.says(STATE.edited(angle=0.4))


def test_friction_laws(screen):
    screen("law-Smoothed").click()
    expect(screen("input-steepness")).to_be_visible()
    smoothed = STATE.edited(friction="smoothed")
    screen.says(smoothed)
    screen("input-friction").select_option(KINDS["tabulated"])
    expect(screen("law-Table")).to_be_visible()
    expect(screen("input-steepness")).to_have_count(0)
    tabulated = smoothed.edited(friction="tabulated")
    screen.says(tabulated)
    # A table is two lists; lists that do not fit each other are refused.
    screen.type("coefficients", "0.3, 0.28")
    screen.refused("coefficients")
    screen.type("coefficients", "0.3; 0.29  0.28")
    expect(screen("input-coefficients")).to_have_value("0.3, 0.29, 0.28")
    screen.says(tabulated.edited(coefficients=(0.3, 0.29, 0.28)))
    screen("law-Exact").click()
    expect(screen("input-coefficients")).to_have_count(0)
    expect(screen("input-static")).to_be_visible()


def test_a_brake_that_does_not_release(screen):
    expect(screen("input-release")).to_be_checked()
    screen.type("eta", -40)
    screen("input-release").uncheck()
    screen.says(STATE.edited(eta=-40.0, release=False))
    screen("input-release").check()
    screen.says(STATE.edited(eta=-40.0))


def test_the_conventional_brake_is_drawn_behind(screen):
    key = screen.card("history").get_by_text("conventional brake")
    expect(key).to_have_count(0)
    grey = near(screen.pixels(screen.card("phase")), GHOST, 4).sum()
    screen("comparison").check()
    expect(key).to_be_visible()
    assert near(screen.pixels(screen.card("phase")), GHOST, 4).sum() > grey + 100
    screen.says(STATE.edited(comparison=True))
    screen("comparison").uncheck()
    expect(key).to_have_count(0)


def test_more_of_the_motion_is_shown(screen):
    drawn = screen.pixels(screen.card("history"))
    before = screen.shown()
    screen.type("shown", 40)
    screen.after(before)
    assert (
        near(screen.pixels(screen.card("history")), "#0072B2").sum()
        > 1.5 * near(drawn, "#0072B2").sum()
    )


def test_presets_by_name(screen):
    for name in ("fig9c", "band", "falling-friction"):
        state = preset(name).state()
        screen.choose(name)
        screen.says(state)
        assert screen.number("drive_speed") == state.value("drive_speed")
        assert screen.number("slope") == pytest.approx(state.value("slope"), rel=1e-4)


def test_a_motion_without_bound_is_told_in_place(screen):
    state = preset("as-printed").state()
    screen.choose("as-printed")
    screen.says(state)
    screen.tone("bad")
    for name in ("spectrum", "section"):  # a sentence stands in their place
        assert near(screen.pixels(screen.card(name)), MOTION).sum() < 40, name
    # The page goes on.
    screen("input-release").check()
    screen.says(state.edited(release=True))
    assert near(screen.pixels(screen.card("spectrum")), MOTION).sum() > 40


def test_a_machine_that_locks_itself(screen):
    screen.choose("self-locking")
    screen.says(preset("self-locking").state())
    screen.tile("locking", "bad")
    screen.after(0, "picture")
    # The diagram shows the rest as a line of points, below labels.
    picture = screen.pixels(screen("plot-diagram"))
    upper = picture[: int(0.8 * len(picture))]
    assert (near(upper, "#808080", 20) | near(upper, "#B0B0B0", 30)).sum() > 300
