"""Docstrings become what Sphinx renders, and nothing in them is lost."""

import inspect
import sys
from pathlib import Path

import pytest

import wedgebrake as wb

pytest.importorskip("sphinx", reason="needs the extra docs")
sys.path.insert(0, str(Path(__file__).parents[2] / "docs/_ext"))

from plain_docstrings import escaped, parameters, reading


def test_only_code_is_markup():
    assert escaped("|g| of f_e, *args and ``a_b``") == r"\|g\| of f\_e, \*args and ``a_b``"


def test_a_list_of_names():
    text = "angle  : of the wedge [rad],\n         not of the band\nradius : its own"
    assert reading(text) == (
        "``angle``\n   of the wedge [rad],\n   not of the band\n``radius``\n   its own"
    )


def test_names_on_a_line_of_their_own():
    text = "a           : one\nlong, longer\n            : two of them"
    assert reading(text) == "``a``\n   one\n``long``, ``longer``\n   two of them"


def test_a_sentence_with_a_colon_is_no_list():
    text = "One line: the motion repeats.\nTwo lines: it does not."
    assert reading(text) == text


def test_sections_and_what_follows_them():
    text = (
        "Words.\n\nParameters\n----------\na : float\n    What it is.\n\n    More of it.\nb : int\n"
        "    Other.\n\nReturns\n-------\ndict\n    All.\n\nRaises ``InputError``."
    )
    assert reading(text).split("\n") == [
        "Words.", "", "**Parameters**", "",
        "``a`` : float", "   What it is.", "", "   More of it.", "",
        "``b`` : int", "   Other.", "", "",
        "**Returns**", "", "``dict``", "   All.", "", "",
        "Raises ``InputError``.",
    ]  # fmt: skip


def test_indented_lines_are_a_formula():
    assert reading("As in\n\n    x = a * b\n\nwith a.") == "As in\n\n::\n\n   x = a * b\n\nwith a."


def test_the_parameters_of_a_part_have_symbol_unit_range_and_default():
    text = parameters(wb.Driveline)
    assert "``damping`` : c [N m s/rad]; ≥ 0, ≤ 1e+12\n   Viscous damping c." in text
    assert "; default 0.0\n" in text


def test_no_word_of_a_public_docstring_is_lost():
    for name in set(wb.__all__) - {"__version__", "paper"}:
        text = inspect.getdoc(getattr(wb, name))
        words = reading(text).replace("\\", "")
        for word in text.split():
            if word.strip(":-=") and "docs/theory.md" not in word:
                assert word.strip(",") in words, (name, word)
