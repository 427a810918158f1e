"""Machines with several inertias in the explorer: shown, not edited."""

from __future__ import annotations

from pathlib import Path

import wedgebrake as wb
from wedgebrake.analysis.responses.contacts import contact_sentences
from wedgebrake.explorer.core.machine_view import take_machine_view

EXAMPLES = Path(__file__).parents[2] / "examples"
CLUTCH = wb.load_study(EXAMPLES / "clutch.toml")


def test_the_view_has_verdict_sentences_and_picture():
    view = take_machine_view(CLUTCH)
    response = wb.simulate(CLUTCH.system, **CLUTCH.arguments())
    assert wb.stability(CLUTCH.system).verdict in view.sentences[0]
    assert view.sentences[-2:] == tuple(contact_sentences(response))
    assert view.picture.startswith(b"\x89PNG")


def test_a_brake_that_is_not_pressed_at_the_start_is_named():
    """Its force begins at 0; the clutch is pressed by a number."""
    sentences = take_machine_view(CLUTCH).sentences
    (warning,) = (one for one in sentences if "not pressed" in one)
    assert warning.startswith("brake:")
    assert "brake.initial_force" in warning
