"""Several pages, and a user in a hurry."""

from __future__ import annotations

from playwright.sync_api import expect
from screen import START, said_of

from wedgebrake.explorer.core.presets import preset

DESK = preset("start").desk()


def test_two_users_do_not_disturb_each_other(visit):
    one, other = visit(), visit(1300, 850)
    one.type("eta", 6)
    other.choose("band")
    one.says(DESK.edited(eta=6.0))
    other.says(preset("band").desk())
    one("tab-regimes").click()
    other("comparison").check()
    expect(one("legend")).to_contain_text("linear stability limit")
    expect(other.card("history").get_by_text("conventional brake")).to_be_visible()
    other.type("wrap_angle", "-1")
    expect(other("refusal-wrap_angle")).to_contain_text("greater than 0")
    # Each has what it had.
    assert one.number("eta") == 6
    expect(one("input-brake")).to_have_value("wedge")
    expect(one("comparison")).not_to_be_checked()
    expect(one.card("history").get_by_text("conventional brake")).to_have_count(0)
    expect(one("tab-regimes")).to_have_attribute("aria-selected", "true")
    expect(other("tab-diagram")).to_have_attribute("aria-selected", "true")
    # A page that is loaded anew begins anew.
    one.page.reload()
    one.page.locator(".explorer[data-motion]").wait_for()
    one.headline(START)
    assert one.number("eta") == -24
    expect(other("input-brake")).to_have_value("band")


def test_of_many_fast_moves_the_last_one_counts(screen):
    for share in (0.9, 0.1, 0.8, 0.3, 0.75):
        screen.drag("eta", share, steps=20)
    last = screen.number("eta")
    # Between two moves of the slider others are moved, and come out as they were left.
    for share in (0.2, 0.9, 0.4):
        screen.drag("f", share, steps=15)
    f = screen.number("f")
    desk = DESK.edited(eta=last, f=f)
    screen.says(desk)
    assert screen.number("eta") == last
    assert screen.number("f") == f
    assert screen.number("frequency") == float(f"{desk.value('frequency'):.5g}")
    # What the server has is what is shown.
    with screen.page.expect_download() as coming:
        screen("save").click()
    text = coming.value.path().read_text()
    assert f"eta = {last}" in text or f"slope = {desk.value('slope')!r}" in text


def test_clicks_in_a_hurry(screen):
    """One after the other without waiting for any answer."""
    for brake in ("band", "conventional", "leading-shoe", "wedge") * 2:
        screen("input-brake").select_option(brake)
    for name in ("regimes", "stability", "basins", "diagram", "regimes", "diagram"):
        screen(f"tab-{name}").click()
    for name in ("fig9a", "as-printed", "band", "start"):
        screen.choose(name)
    screen.headline(START)
    expect(screen("input-brake")).to_have_value("wedge")
    expect(screen("plot-diagram")).to_be_visible()
    expect(screen("notice")).to_be_empty()
