"""``wb.explore``: what a notebook cell shows, without a notebook."""

import re
from urllib.request import urlopen

import pytest
from playwright.sync_api import expect

import wedgebrake as wb
from wedgebrake.explorer import notebook
from wedgebrake.explorer.core.presets import START, preset


@pytest.fixture
def opened(chromium):
    """Open addresses in a browser; what its console complains of fails the test."""
    context = chromium.new_context(viewport={"width": 820, "height": 900})
    complaints = []

    def open_(url):
        page = context.new_page()
        page.on("pageerror", lambda error: complaints.append(str(error)))
        page.on("console", lambda said: said.type == "error" and complaints.append(said.text))
        page.goto(url)
        return page

    yield open_
    context.close()
    assert complaints == []


@pytest.fixture
def study():
    return wb.load_study("examples/band.toml")


def test_a_machine_a_study_a_file_and_nothing(study):
    system = wb.paper.system(eta=-24)
    assert wb.explore(system).system == system
    assert wb.explore(study).system == study.system
    assert wb.explore("examples/band.toml").study == wb.explore(study).study
    assert wb.explore().state == preset(START).state()


@pytest.mark.parametrize("subject", [3, [], {"eta": -24}, object()])
def test_other_subjects_are_refused(subject):
    with pytest.raises(wb.InputError, match=r"subject = .* must be a BrakedDriveline, a Study or"):
        wb.explore(subject)


def test_a_machine_that_no_study_file_names_is_refused():
    friction = wb.CustomFriction(law=lambda v: 0.3 * v / (0.01 + abs(v)), width=0.01)
    with pytest.raises(wb.InputError, match="the explorer takes parts that a study file can name"):
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
    assert repr(cell) == f"The explorer is at {cell.url} as long as this process lives."
    with urlopen(cell.url) as page:  # noqa: S310
        assert "wedgebrake explorer" in page.read().decode()


def test_one_server_and_an_address_that_cannot_be_guessed():
    first, second = wb.explore().url, wb.explore().url
    server, key = first.split("?cell=")
    assert second.split("?cell=")[0] == server
    assert server.startswith("http://127.0.0.1:")
    assert second.split("?cell=")[1] != key
    assert len(key) > 20


def test_the_machine_follows_the_page_and_a_second_page_begins_there(opened):
    cell = wb.explore(wb.paper.system(eta=-24))
    page = opened(cell.url)
    page.locator("[data-motion]").wait_for()
    page.locator(".input-eta input").fill("0")
    page.locator(".input-eta input").press("Enter")
    page.locator("[data-motion]").wait_for()
    page.locator("[data-motion='2']").wait_for()
    assert cell.system.groups.eta == 0.0
    assert cell.study.system == cell.system

    second = opened(cell.url)
    second.locator("[data-motion]").wait_for()
    expect(second.locator(".input-eta input")).to_have_value("0")
    second.locator(".input-eta input").fill("-1")
    second.locator(".input-eta input").press("Enter")
    second.locator("[data-motion]").wait_for()
    second.locator("[data-motion='2']").wait_for()
    assert cell.system.groups.eta == -1.0
    second.close()
    assert cell.system.groups.eta == -1.0


def test_in_a_narrow_cell_all_of_the_bar_is_within_reach(opened):
    page = opened(wb.explore().url)
    page.locator("[data-motion]").wait_for()
    for width in (760, 820, 900, 1000):
        page.set_viewport_size({"width": width, "height": 900})
        for name in ("preset", "load", "save", "export", "law", "comparison", "help"):
            box = page.locator(f".{name}").first.bounding_box()
            assert box["x"] + box["width"] <= width, (name, width)
        assert page.evaluate("document.documentElement.scrollWidth") <= width


@pytest.mark.parametrize("query", ["", "?cell=", "?cell=other", "?cell=%ff%fe"])
def test_a_page_of_no_cell_says_so(opened, query):
    server = wb.explore().url.split("?")[0]
    page = opened(server + query)
    expect(page.get_by_text("belongs to no cell of the notebook")).to_be_visible()
