"""``wb.explore``: what a notebook cell shows, without a notebook."""

from pathlib import Path

from playwright.sync_api import expect

import wedgebrake as wb
from wedgebrake.explorer.core.presets import START, preset

PAPER = Path("examples/paper.toml").read_text()


def test_a_machine_a_study_a_file_and_nothing():
    system, study = wb.paper.system(eta=-24), wb.load_study("examples/band.toml")
    assert wb.explore(system).system == system
    assert wb.explore(study).system == study.system
    assert wb.explore("examples/band.toml").study == wb.explore(study).study
    assert wb.explore().state == preset(START).state()


def test_one_server_and_an_address_that_cannot_be_guessed():
    first, second = wb.explore().url, wb.explore().url
    server, key = first.split("?cell=")
    assert second.split("?cell=")[0] == server
    assert server.startswith("http://127.0.0.1:")
    assert second.split("?cell=")[1] != key
    assert len(key) > 20


def test_the_machine_follows_the_page_and_a_second_page_begins_there(visit):
    # With a diagram that takes no time.
    sweep = "[run]\nperiods = 20\n[sweep]\neta = { from = -8, to = -4, points = 20 }\n"
    cell = wb.explore(wb.read_study(PAPER.split("[run]")[0] + sweep))
    first = visit(cell.url)
    first.type("eta", 0)
    first.page.locator("[data-motion='2']").wait_for()
    assert cell.system.groups.eta == 0.0
    assert cell.study.system == cell.system
    second = visit(cell.url)
    expect(second("input-eta")).to_have_value("0")
    second.type("eta", -1)
    second.page.locator("[data-motion='2']").wait_for()
    assert cell.system.groups.eta == -1.0
    second.page.close()
    assert cell.system.groups.eta == -1.0
    # In a narrow cell all of the bar is within reach.
    for width in (760, 820, 900, 1000):
        first.page.set_viewport_size({"width": width, "height": 900})
        for name in ("preset", "load", "save", "export", "law", "comparison", "help"):
            box = first.page.locator(f".{name}").first.bounding_box()
            assert box["x"] + box["width"] <= width, (name, width)
        for name in ("across", "from", "to", "quantity", "follow"):
            box = first(name).bounding_box()
            assert box["x"] + box["width"] <= width, (name, width)
        assert first.page.evaluate("document.documentElement.scrollWidth") <= width
