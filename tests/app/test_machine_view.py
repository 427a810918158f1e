"""Machines with several inertias in the explorer: shown, not edited."""

from __future__ import annotations

from pathlib import Path

import pytest
from browsing import Server

import wedgebrake as wb
from wedgebrake.analysis.contacts import contact_sentences
from wedgebrake.explorer.core.limits import MOST_EVENTS
from wedgebrake.explorer.core.machine_view import take_machine_view
from wedgebrake.explorer.core.studies import opened

EXAMPLES = Path(__file__).parents[2] / "examples"
CLUTCH = wb.load_study(EXAMPLES / "clutch.toml")


def test_the_view_has_verdict_sentences_and_picture():
    view = take_machine_view(CLUTCH)
    response = wb.simulate(CLUTCH.system, **CLUTCH.run.arguments())
    assert wb.stability(CLUTCH.system).verdict in view.sentences[0]
    assert view.sentences[-2:] == tuple(contact_sentences(response))
    assert view.picture.startswith(b"\x89PNG")


def test_the_view_keeps_the_limits_of_the_explorer():
    view = take_machine_view(CLUTCH.changed(max_events=2))
    assert "max_events" in view.sentences[1]
    assert take_machine_view(CLUTCH.changed(max_events=MOST_EVENTS + 1)).sentences


def test_the_page_with_sliders_refuses_machines():
    assert CLUTCH.of_machine
    assert not wb.load_study(EXAMPLES / "paper.toml").of_machine
    with pytest.raises(wb.InputError):
        opened(CLUTCH)


def test_a_cell_keeps_the_study_of_its_machine():
    cell = wb.explore(CLUTCH)
    assert (cell.study, cell.system) == (CLUTCH, CLUTCH.system)
    assert wb.explore(CLUTCH.system).system == CLUTCH.system
    assert wb.explore(EXAMPLES / "clutch.toml").system == CLUTCH.system


def test_the_page_shows_the_machine(chromium):
    server = Server(str(EXAMPLES / "clutch.toml"))
    page = chromium.new_page()
    try:
        page.goto(server.url)
        page.get_by_text("clutch: at rest").wait_for()
        page.locator("img").wait_for()
        assert page.locator("img").bounding_box()["height"] > 300
    finally:
        page.close()
        server.stop()
    assert "Traceback" not in server.said, server.said
