"""``wb.explore``: what a notebook cell shows, without a notebook."""

import re
from pathlib import Path
from urllib.request import urlopen

import pytest
from playwright.sync_api import expect

import wedgebrake as wb
from wedgebrake.explorer import notebook
from wedgebrake.explorer.core.presets import START, preset

PAPER = Path("examples/paper.toml").read_text()


def test_a_machine_a_study_a_file_and_nothing():
    system, study = wb.paper.system(eta=-24), wb.load_study("examples/band.toml")
    assert wb.explore(system).system == system
    assert wb.explore(study).system == study.system
    assert wb.explore("examples/band.toml").study == wb.explore(study).study
    assert wb.explore().state == preset(START).state()


@pytest.mark.parametrize("subject", [3, [], {"eta": -24}, object()])
def test_other_subjects_are_refused(subject):
    with pytest.raises(wb.InputError, match=r"subject = .* BrakedDriveline"):
        wb.explore(subject)


def test_a_machine_that_no_study_file_names_is_refused():
    friction = wb.CustomFriction(law=lambda v: 0.3 * v / (0.01 + abs(v)), width=0.01)
    with pytest.raises(wb.InputError, match="friction = CustomFriction"):
        wb.explore(wb.paper.system().replace(friction=friction))


@pytest.mark.parametrize("wrong", [{"port": 70000}, {"port": -1}, {"port": "5006"}, {"port": True},
                                   {"height": 10}, {"height": 900.0}])  # fmt: skip
def test_a_wrong_port_or_height_is_refused(wrong):
    [name] = wrong
    with pytest.raises(wb.InputError, match=f"{name} = .*: must be a whole number"):
        wb.explore(**wrong)


def test_a_port_in_use_is_refused():
    taken = int(re.search(r":(\d+)/", wb.explore().url)[1])
    with pytest.raises(wb.InputError, match=f"port = {taken}: is in use"):
        wb.explore(port=taken)


@pytest.mark.parametrize("missing", ["panel", "bokeh"])
def test_without_the_extra_it_says_what_to_install(missing, monkeypatch):
    find = notebook.find_spec
    monkeypatch.setattr(notebook, "find_spec", lambda one: None if one == missing else find(one))
    with pytest.raises(wb.InputError, match=rf"needs {missing}\. .*'wedgebrake\[app\]'"):
        wb.explore()


def test_what_a_cell_shows():
    cell = wb.explore(height=700)
    shown = cell._repr_html_()
    assert shown.startswith("<iframe ")
    assert f'src="{cell.url}"' in shown
    assert 'height="700"' in shown
    assert cell.url in repr(cell)
    with urlopen(cell.url) as page:  # noqa: S310
        assert "wedgebrake explorer" in page.read().decode()


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
        assert first.page.evaluate("document.documentElement.scrollWidth") <= width


def test_a_page_of_no_cell_says_so(visit):
    server, words = wb.explore().url.split("?")[0], "text=belongs to no cell of the notebook"
    page = visit(server, ready=words).page
    for query in ("?cell=", "?cell=other", "?cell=%ff%fe"):
        page.goto(server + query)
        page.locator(words).wait_for()
