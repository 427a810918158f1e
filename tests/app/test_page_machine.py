"""The machine's values on the page: sliders, numbers, kinds; and what follows from them."""

from __future__ import annotations

import pytest
from playwright.sync_api import expect
from screen import GHOST, START, near, said_of

from wedgebrake.explorer.core.presets import preset

DESK = preset("start").desk()
STABLE = "Linearly stable. Moves in step with the torque, without sticking."


def test_a_slider_moves_everything_that_follows(screen):
    before, drawn = screen.shown(), screen.pixels(screen.card("history"))
    screen.drag("slider-eta", 0.95, release=False)
    # In the hand already, numbers, verdict and pictures follow.
    screen.after(before)
    eta = screen.number("eta")
    assert 0 < eta < 12
    screen.headline(STABLE)
    expect(screen("input-slope")).to_have_value(f"{eta / 0.6:.5g}")
    screen.page.mouse.up()
    expect(screen("tile-forward")).to_contain_text("stable")
    expect(screen("tile-forward")).not_to_contain_text("unstable")
    expect(screen("tile-motion")).to_contain_text("synchronous")
    expect(screen("tone")).to_have_text("good")
    assert screen.number("eta") == eta
    # The line in the diagram stands there.
    assert screen.cursor("panel-diagram") == pytest.approx((eta + 120) / 132, abs=0.003)
    assert (screen.pixels(screen.card("history")) != drawn).mean() > 0.01
    assert said_of(DESK.edited(eta=eta)) == STABLE


def test_a_number_is_typed(screen):
    screen.type("eta", "-6,5")  # with a comma, as some write it
    screen.headline(said_of(DESK.edited(eta=-6.5)))
    assert screen.number("eta") == -6.5
    assert screen.number("slope") == pytest.approx(-6.5 / 0.6, rel=1e-4)
    # What the slope is set to is what the group becomes.
    screen.type("slope", 10)
    screen.headline(STABLE)
    assert screen.number("eta") == pytest.approx(6.0)
    at = screen("slider-eta").evaluate("(one) => one.value / one.max")
    low, high = DESK.view.spans["eta"]
    assert low + at * (high - low) == pytest.approx(6.0, abs=0.2)


def test_arrow_keys_go_by_steps(screen):
    field = screen("input-f")
    field.focus()
    before = screen.shown()
    for _ in range(3):
        field.press("ArrowUp")
    assert float(field.input_value()) == pytest.approx(0.66)
    field.press("Shift+ArrowDown")
    screen.after(before)
    assert float(field.input_value()) == pytest.approx(0.6)  # on to the next round value
    expect(screen("input-frequency")).to_have_value("9.5493")
    screen("slider-f").focus()
    screen.page.keyboard.press("ArrowRight")
    expect(field).not_to_have_value("0.6")
    screen.page.keyboard.press("End")
    expect(field).to_have_value("2.2")
    expect(screen("input-frequency")).to_have_value("35.014")


REFUSED = {
    "inertia": ("0", ["driveline.inertia = 0", "greater than 0", "kg m^2"]),
    "damping": ("-1", ["driveline.damping = -1", "at least 0"]),
    "kinetic": ("7", ["friction.kinetic = 7", "at most 5"]),
    "static": ("0.1", ["friction.static = 0.1", "at least friction.kinetic = 0.3"]),
    "angle": ("2", ["brake.angle = 2", "below 1.5708"]),
    "frequency": ("0", ["excitation.frequency = 0", "at least"]),
    "periods": ("1e9", ["periods = 1000000000", "20 to 2000"]),
    "eta": ("1e300", ["groups.eta = 1e+300", "at most 1e+12"]),
    "alpha": ("0", ["alpha = 0", "greater than 0"]),
    "stiffness": ("stiff", ["stiffness", "write a number"]),
    "radius": ("", ["radius", "write a number"]),
    "drive_speed": ("1e400", ["shaft speed", "write a number"]),
}


def test_a_wrong_value_is_refused_in_words(screen):
    before = screen.shown()
    old = {name: screen(f"input-{name}").input_value() for name in REFUSED}
    for name, (text, parts) in REFUSED.items():
        screen.type(name, text)
        message = screen(f"refusal-{name}")
        for part in parts:
            expect(message).to_contain_text(part)
        expect(message).to_be_visible()
        field = screen(f"input-{name}")
        expect(field).to_have_value(text)  # to be mended
        expect(field).to_have_attribute("aria-invalid", "true")
        field.press("Escape")
        expect(field).to_have_value(old[name])
        expect(message).to_be_empty()
        expect(field).to_have_attribute("aria-invalid", "false")
    assert {name: screen(f"input-{name}").input_value() for name in REFUSED} == old
    assert screen.shown() == before
    expect(screen("headline")).to_have_text(START)


def test_a_wrong_value_is_mended_or_left(screen):
    screen.type("inertia", "-1")
    expect(screen("refusal-inertia")).to_contain_text("greater than 0")
    screen.type("inertia", "1.5")
    expect(screen("refusal-inertia")).to_be_empty()
    expect(screen("row-natural")).to_contain_text("12.99")  # sqrt(k/J)/2 pi
    screen.type("inertia", "nothing")
    expect(screen("refusal-inertia")).to_contain_text("write a number")
    screen("input-radius").focus()
    expect(screen("input-inertia")).to_have_value("1.5")
    expect(screen("refusal-inertia")).to_be_empty()


def test_kinds_of_brake(screen):
    begin = screen.pixels(screen("stage-svg"))
    screen.type("angle", 0.4)
    for kind, names, word in (
        ("band", ["wrap_angle", "radius"], "wrap angle 4.00 rad"),
        ("leading-shoe", ["actuation_arm", "normal_arm", "friction_arm"], ""),
        ("conventional", ["radius"], ""),
    ):
        screen("input-brake").select_option(kind)
        for name in names:
            expect(screen(f"input-{name}")).to_be_visible()
        expect(screen("input-angle")).to_have_count(0)
        expect(screen("input-alpha")).to_have_count(0)  # a group of the wedge alone
        screen.headline(said_of(DESK.edited(brake=kind)))
        expect(screen("stage-svg")).to_contain_text(word)
        assert (screen.pixels(screen("stage-svg")) != begin).mean() > 0.01
    # There is no other brake to compare this one with.
    expect(screen("ghost")).to_be_disabled()
    screen("input-brake").select_option("wedge")
    expect(screen("input-angle")).to_have_value("0.4")  # as it was left
    screen.headline(said_of(DESK.edited(angle=0.4)))


def test_friction_laws(screen):
    expect(screen("law-coulomb")).to_be_checked()
    screen("law").get_by_text("Smoothed").click()
    expect(screen("law-smoothed")).to_be_checked()
    expect(screen("input-friction")).to_have_value("smoothed")
    expect(screen("input-steepness")).to_be_visible()
    screen.headline(said_of(DESK.edited(friction="smoothed")))
    screen("input-friction").select_option("tabulated")
    expect(screen("law").get_by_text("Table")).to_be_visible()
    expect(screen("input-steepness")).to_have_count(0)
    tabulated = DESK.edited(friction="smoothed").edited(friction="tabulated")
    screen.headline(said_of(tabulated))
    # A table is two lists; lists that do not fit are refused, and mended in the other order.
    screen.type("coefficients", "0.3, 0.28")
    expect(screen("refusal-coefficients")).to_contain_text("coefficients")
    screen("input-coefficients").press("Escape")
    screen.type("coefficients", "0.3; 0.29  0.28")
    expect(screen("input-coefficients")).to_have_value("0.3, 0.29, 0.28")
    screen.headline(said_of(tabulated.edited(coefficients=(0.3, 0.29, 0.28))))
    screen("law").get_by_text("Exact").click()
    expect(screen("law-coulomb")).to_be_checked()
    expect(screen("input-coefficients")).to_have_count(0)
    expect(screen("input-static")).to_be_visible()


def test_a_brake_that_does_not_release(screen):
    expect(screen("input-release")).to_be_checked()
    screen.type("eta", -40)
    screen("input-release").uncheck()
    expected = said_of(DESK.edited(eta=-40.0, release=False))
    assert expected != said_of(DESK.edited(eta=-40.0))
    screen.headline(expected)
    screen("input-release").check()
    screen.headline(said_of(DESK.edited(eta=-40.0)))


def test_the_conventional_brake_is_drawn_behind(screen):
    key = screen.card("history").get_by_text("conventional brake")
    expect(key).to_have_count(0)
    grey = near(screen.pixels(screen.card("phase")), GHOST, 4).sum()
    screen("ghost").check()
    expect(key).to_be_visible()
    expect(screen("tile-torque")).to_contain_text("conventional:")
    assert near(screen.pixels(screen.card("phase")), GHOST, 4).sum() > grey + 100
    expect(screen("headline")).to_have_text(START)  # of the machine itself
    screen("ghost").uncheck()
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
        desk = preset(name).desk()
        screen("preset").select_option(name)
        expect(screen("input-brake")).to_have_value(desk.value("brake"))
        screen.headline(said_of(desk))
        assert screen.number("drive_speed") == desk.value("drive_speed")
        assert screen.number("slope") == pytest.approx(desk.value("slope"), rel=1e-4)
        expect(screen("axis")).to_have_value(desk.view.axis)


def test_a_motion_without_bound_is_said_in_place(screen):
    screen("preset").select_option("as-printed")
    screen.headline(said_of(preset("as-printed").desk()))
    expect(screen("headline")).to_contain_text("Grows without bound")
    expect(screen("tone")).to_have_text("critical")
    for name, sentence in (
        ("history", "The motion grows without bound."),
        ("spectrum", "No settled motion, so no spectrum."),
        ("section", "No settled motion, so no section."),
    ):
        expect(screen.card(name)).to_contain_text(sentence)
    for tile in ("sticks", "torque", "share"):
        expect(screen(f"tile-{tile}")).to_contain_text("not known")
    # Nothing is painted in red, and nothing is said of an exception.
    text = screen.page.locator(".explorer").inner_text()
    assert "Traceback" not in text
    assert "Error" not in text
    # The page goes on.
    screen("input-release").check()
    released = said_of(preset("as-printed").desk().edited(release=True))
    screen.headline(released)
    expect(screen.card("history").get_by_text("grows without bound")).to_have_count(0)


def test_a_machine_that_locks_itself(screen):
    screen("preset").select_option("self-locking")
    screen.headline("Locks itself: cannot slide forwards. Linearly unstable backwards."
                    " Stays at rest: the brake holds.")  # fmt: skip
    expect(screen("tile-locking")).to_contain_text("cannot slide forwards")
    expect(screen("tile-forward")).to_contain_text("does not exist")
    expect(screen.card("spectrum")).to_contain_text("No motion, so no spectrum.")
    # The diagram shows the rest as a line of points, below labels.
    expect(screen("legend")).to_contain_text("at rest")
    picture = screen.pixels(screen("panel-diagram"))
    upper = picture[: int(0.8 * len(picture))]
    assert (near(upper, "#808080", 20) | near(upper, "#B0B0B0", 30)).sum() > 300
    screen("tab-stability").click()
    expect(screen("legend")).to_contain_text("locks")
