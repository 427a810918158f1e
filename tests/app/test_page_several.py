"""Several pages, many edits in a short time, and a connection that is lost."""

from __future__ import annotations

import pytest
from playwright.sync_api import expect

from wedgebrake.explorer.core.presets import preset

STATE = preset("start").state()


def test_two_users_do_not_disturb_each_other(screen, visit, server):
    screen.type("eta", 6)
    other = visit(server.url, 1300, 850)
    other.says(STATE)
    other.choose("band")
    screen.says(STATE.edited(eta=6.0))
    other.says(preset("band").state())
    screen("tab-stability").click()
    other("comparison").check()
    expect(screen("plot-stability")).to_be_visible()
    other.type("wrap_angle", "-1")
    other.refused("wrap_angle")
    # Each has what it had.
    assert screen.number("eta") == 6
    expect(screen("input-angle")).to_be_visible()
    expect(screen("comparison")).not_to_be_checked()
    expect(screen("notice")).to_have_count(0)
    expect(other("plot-diagram")).to_be_visible()


def test_the_last_of_many_fast_edits_counts(visit, server):
    screen = visit(server.url)
    for name, share in (("eta", 0.9), ("eta", 0.1), ("eta", 0.75), ("f", 0.9), ("f", 0.4)):
        screen.drag(name, share, steps=6)
    for name, share in (("eta", 0.75), ("f", 0.4)):
        assert screen.place(name) == pytest.approx(share, abs=0.02)
    # The numbers follow the handles.
    wanted = {"eta": -120.0 + 132.0 * screen.place("eta"), "f": 0.2 + 2.0 * screen.place("f")}
    near = {"eta": pytest.approx(wanted["eta"], abs=0.5), "f": pytest.approx(wanted["f"], abs=0.02)}
    for _ in range(300):
        if {name: screen.number(name) for name in wanted} == near:
            break
        screen.page.wait_for_timeout(100)
    screen.still()
    eta, f = screen.number("eta"), screen.number("f")
    assert {"eta": eta, "f": f} == near
    screen.says(STATE.edited(eta=eta, f=f))
    for brake in ("band", "conventional", "leading shoe", "wedge"):
        screen("input-brake").select_option(brake)
    for name in ("regimes", "basins", "diagram"):
        screen(f"tab-{name}").click()
    for name in ("fig9a", "band", "start"):
        screen.choose(name)
    screen.says(STATE)
    expect(screen("input-angle")).to_be_visible()
    expect(screen("notice")).to_have_count(0)
