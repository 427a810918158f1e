"""What the page does in trouble: no picture of a machine, a server that is gone, a slip."""

from command import Server
from playwright.sync_api import expect
from screen import Screen


def test_a_machine_without_a_picture_says_so_and_goes_on(visit):
    screen = visit()
    screen.choose("falling-friction")
    expect(screen("headline")).to_contain_text("Vibrates by itself at 10 Hz")
    screen("tab-stability").click()
    expect(screen("plot-stability")).to_contain_text("a table of friction has many")
    expect(screen("legend")).to_be_empty()
    screen.type("damping", 20.0)
    expect(screen("headline")).to_contain_text("linearly stable")


def test_the_list_of_machines_says_what_lies_on_the_desk(visit):
    screen = visit()
    screen.choose("fig9c")
    expect(screen("input-eta")).to_have_value("-30")
    screen.type("eta", -5.0)
    expect(screen("preset")).to_have_value("")
    screen.choose("fig9c")
    expect(screen("input-eta")).to_have_value("-30")
    expect(screen("preset")).to_have_value("fig9c")


def test_a_lost_connection_is_told(chromium):
    server = Server()
    context = chromium.new_context(viewport={"width": 1440, "height": 900})
    page = context.new_page()
    page.goto(server.url)
    page.locator(".explorer[data-motion]").wait_for(timeout=60_000)
    assert server.stop() == 0
    screen = Screen(page)
    expect(screen("lost")).to_contain_text("reload the page")
    expect(screen("area-machine")).to_have_attribute("inert", "")
    context.close()
