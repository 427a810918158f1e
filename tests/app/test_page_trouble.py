"""What the page does in trouble: no plot of a machine, a server that is gone."""

from command import Server
from playwright.sync_api import expect
from screen import Screen

from wedgebrake.explorer.core.presets import preset


def test_a_machine_without_a_plot_says_so_and_goes_on(screen):
    screen.choose("falling-friction")
    screen("tab-stability").click()
    expect(screen("legend")).to_be_empty()
    screen.type("damping", 20.0)
    screen.says(preset("falling-friction").state().edited(damping=20.0))


def test_the_list_shows_the_loaded_preset_until_it_is_edited(screen):
    screen.choose("fig9c")
    expect(screen("input-eta")).to_have_value("-30")
    screen.type("eta", -5.0)
    expect(screen("preset")).not_to_have_value(preset("fig9c").title)
    screen.choose("fig9c")
    expect(screen("input-eta")).to_have_value("-30")
    expect(screen("preset")).to_have_value(preset("fig9c").title)


def test_a_lost_connection_is_told(chromium):
    server = Server()
    context = chromium.new_context(viewport={"width": 1440, "height": 900})
    page = context.new_page()
    page.goto(server.url)
    page.locator("[data-motion='1']").wait_for(timeout=60_000)
    assert server.stop() == 0
    expect(Screen(page)("notice").first).to_be_visible()
    context.close()
