"""Machines with several inertias in the explorer: shown, not edited."""

from __future__ import annotations

from pathlib import Path

from browsing import Server

import wedgebrake as wb
from wedgebrake.analysis.contacts import contact_sentences
from wedgebrake.explorer.core.machine_view import take_machine_view

EXAMPLES = Path(__file__).parents[2] / "examples"
CLUTCH = wb.load_study(EXAMPLES / "clutch.toml")


def test_the_view_has_verdict_sentences_and_picture():
    view = take_machine_view(CLUTCH)
    response = wb.simulate(CLUTCH.system, **CLUTCH.run.arguments())
    assert wb.stability(CLUTCH.system).verdict in view.sentences[0]
    assert view.sentences[-2:] == tuple(contact_sentences(response))
    assert view.picture.startswith(b"\x89PNG")


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
