"""The tables of docs/orbits.md: every located limit, and what simulation finds beside it."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import wedgebrake as wb

PAGE = (Path(__file__).parents[2] / "docs" / "orbits.md").read_text(encoding="utf-8")
# Brake, order of the motion, parameter, and the range in which it is followed, by the words of
# the table.
FOLLOWED = {
    "wedge, T, over η": ("wedge", 1, "eta", (-14.0, -18.0)),
    "wedge, 2T stick-slip, over η": ("wedge", 2, "eta", (-38.0, -34.0)),
    "wedge, T, over F_0": ("wedge", 1, "F0", (0.08, 0.069)),
    "wedge, 2T, over F_0": ("wedge", 2, "F0", (0.062, 0.055)),
    "wedge, 2T, over η": ("wedge", 2, "eta", (-19.5, -21.5)),
    "conventional, T, over η": ("conventional", 1, "eta", (-21.0, -23.5)),
    "conventional, T, over F_0": ("conventional", 1, "F0", (0.042, 0.037)),
}
BESIDE = 0.003
# Longest step along a branch, as a share of its range; limits are located between the steps.
STEP = 0.1
# Of the printed smooth limits: those at the default 1e-10 differ in the eighth digit.
SMOOTH_RTOL = 1e-12


def number(text):
    return float(text.replace("−", "-"))


def rows():
    """(words, cells) of the table of limits."""
    table = PAGE.split("| motion | bifurcation |")[1].split("\n\n")[0]
    found = {}
    for line in table.splitlines()[2:]:
        cells = [cell.strip() for cell in line.strip("|").split("|")]
        found[cells[0]] = cells[1:]
    return found


ROWS = rows()


@cache
def branch(words, friction):
    brake, order, name, ends = FOLLOWED[words]
    fixed = {"F0": 0.036} if name == "eta" else {"eta": -24.0}
    system = wb.paper.system(brake=brake, friction=friction, **fixed)
    found = wb.branches(
        system, order=order, switch=0, opposite=False, rtol=SMOOTH_RTOL, step=STEP, **{name: ends}
    )
    return system, found


def located(found, kind):
    places = np.flatnonzero(found["bifurcation_kind"].values == kind)
    return places[0], float(found["bifurcation_value"][places[0]])


def test_table_holds_what_is_followed() -> None:
    assert set(ROWS) == set(FOLLOWED)


# The last of each kind, and all of them with -m slow.
ALWAYS = {ROWS[words][0]: words for words in FOLLOWED}.values()
LIMITS = [
    pytest.param(words, marks=() if words in ALWAYS else pytest.mark.slow) for words in FOLLOWED
]


@pytest.mark.parametrize("words", LIMITS)
def test_limits_are_where_the_table_says(words) -> None:
    """To the digits that are printed; AUTO-07p to its own seven."""
    kind = ROWS[words][0].replace("–", "-")
    for friction, cell in (("coulomb", 1), ("smoothed", 2)):
        _, value = located(branch(words, friction)[1], kind)
        assert value == pytest.approx(number(ROWS[words][cell]), rel=3e-9)
    if ROWS[words][3]:
        assert number(ROWS[words][3]) == pytest.approx(number(ROWS[words][2]), rel=1e-6)


@pytest.mark.parametrize("words", LIMITS)
def test_simulation_agrees_on_both_sides(words) -> None:
    """A deviation of a thousandth from the orbit settles to what the table says."""
    _, order, name, ends = FOLLOWED[words]
    kind = ROWS[words][0].replace("–", "-")
    system, found = branch(words, "coulomb")
    place, value = located(found, kind)
    point = int(found["bifurcation_point"][place])
    guess = tuple(float(found[one][point, 0]) for one in ("angle", "velocity"))
    printed = re.fullmatch(r"(\S+) at \S+, (\S+) at \S+", ROWS[words][4])
    sides = (-1.0, 1.0)
    for side, word in zip(sides, printed.groups(), strict=True):
        onward = np.sign(ends[1] - ends[0]) * side * BESIDE * abs(value)
        there = system.replace(**{name: value + onward})
        orbit = wb.orbit(there, order, initial=guess)
        assert orbit.found
        assert orbit.stable == (side < 0.0)
        motion = wb.motion(there, initial=(1.001 * orbit.angle, 1.001 * orbit.velocity))
        if word in ("decay", "growth"):
            assert abs(motion.largest_exponent) < 0.01
            assert (motion.largest_exponent > 0.0) == (word == "growth")
        else:
            words_ = {"T": "synchronous", "chaos": "chaotic"}
            assert motion.word == words_.get(word, f"{word}-periodic")


def test_smoothed_limits_tend_to_the_exact_one() -> None:
    """As 1/steepness: each doubling halves the distance, ever more closely."""
    lines = PAGE.split("| ξ [s/m] |")[1].splitlines()
    steepness = [float(cell) for cell in lines[0].split("|")[:5]]
    printed = [number(cell) for cell in lines[2].strip("|").split("|")[1:7]]
    values = []
    for xi, value in zip(steepness, printed[:5], strict=True):
        system = wb.paper.system(F0=0.036, friction="smoothed").replace(steepness=xi)
        found = wb.branches(system, switch=0, opposite=False, step=STEP, eta=(-16.0, -18.0))
        values.append(located(found, "period doubling")[1])
        assert values[-1] == pytest.approx(value, abs=6e-5)
    exact = located(branch("wedge, T, over η", "coulomb")[1], "period doubling")[1]
    gaps = exact - np.array(values)
    ratios = gaps[:-1] / gaps[1:]
    assert np.all((ratios > 2.0) & (ratios < 2.1))
    assert np.all(np.diff(ratios) < 0.0)
