"""Which reading of the paper's unstated choices satisfies how many of its statements."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from wedgebrake.analysis.sticking import NON_STICK_SLIP
from wedgebrake.paper.assumptions import CORRECTED, Assumptions, Case
from wedgebrake.paper.claims import Statement, judge, parts_of
from wedgebrake.paper.diagrams import HERTZ, PLANS, PRINTED_F0
from wedgebrake.paper.laboratory import Laboratory
from wedgebrake.paper.signal_features import lines, rests
from wedgebrake.paper.statements import STATEMENTS
from wedgebrake.paper.visual_criteria import DOUBLE, EYE, SYNCHRONOUS, look

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DAMPINGS = (1.0, 0.3, 0.2, 0.1, 0.05)
STATICS = (0.30, 0.33)
CANDIDATES = tuple(
    Assumptions(damping, static, release, slope_on)
    for slope_on, release, static, damping in product(
        ("shaft", "interface"), (True, False), STATICS, DAMPINGS
    )
)
"""c, the static peak, release and the speed of eq. (3): forty combinations."""

# Statements on figures whose own parameters are not in question, but for 6a and 7a.
_TESTED = ("S7", "S8", "M1", "M2", "M3", "M4", "B1", "B2", "B3", "B4", "R1", "R2", "R3", "R4")
# Forty combinations are coarser work than one audit.
_RTOL = 1e-6
# F_0 tried for figures 6a and 14 to 16.
_FORCES_6 = (0.006, 0.012, 0.018, 0.024, 0.030, 0.036, 0.042, 0.048, 0.054, 0.060, 0.09, 0.12)
_FORCES_14 = (0.024, 0.030, 0.036, 0.042)


class Row(NamedTuple):
    """One combination.

    scores : of each statement, whether it holds
    held, told : statements that hold, of those that can be told
    """

    assumptions: Assumptions
    scores: dict[str, bool | None]
    held: int
    told: int


class Question(NamedTuple):
    """What the paper leaves open, the answer found, and whether that settles it."""

    question: str
    answer: str
    settled: bool


@dataclass(frozen=True)
class Identification:
    """The combinations, best first, the open questions, and what hangs on the reader's eye."""

    rows: tuple[Row, ...]
    open_questions: tuple[Question, ...]
    paragraphs: tuple[str, ...]

    def table(self) -> list[dict[str, str]]:
        """The combinations in words."""
        return [
            {
                "c [N m s/rad]": f"{row.assumptions.damping:g}",
                "μ_s": f"{row.assumptions.static:.2f}",
                "release": "on" if row.assumptions.release else "off",
                "slope on": "|θ'|" if row.assumptions.slope_on == "shaft" else "|v_r|",
                "statements": f"{row.held} of {row.told}",
            }
            for row in self.rows
        ]

    def draw(self) -> Figure:
        """Combinations against statements: which hold."""
        from wedgebrake.paper.figures.identification import draw

        return draw(self.rows)


def identify(
    laboratory: Laboratory, candidates: Sequence[Assumptions] = CANDIDATES
) -> Identification:
    """Test the statements of figures 4 to 13 under every combination."""
    coarse = laboratory.like(coarse=True, rtol=_RTOL)
    chosen = [statement for statement in STATEMENTS if statement.name in _TESTED]
    # The runs are shared by the laboratory's own threads; these prepare and look.
    with ThreadPoolExecutor(laboratory.threads) as pool:
        rows = list(pool.map(lambda one: _row(coarse.like(assumptions=one), chosen), candidates))
    rows.sort(key=lambda row: -row.held)
    return Identification(
        tuple(rows), _questions(coarse), (_on_rows(rows), _on_the_eye(coarse, chosen))
    )


def _row(laboratory: Laboratory, chosen: Sequence[Statement]) -> Row:
    found = {
        statement.name: parts_of(statement, laboratory, statement.corrected) for statement in chosen
    }
    scores = {name: judge(parts) for name, parts in found.items()}
    told = [score for score in scores.values() if score is not None]
    return Row(laboratory.assumptions, scores, sum(map(bool, told)), len(told))


def _on_rows(rows: Sequence[Row]) -> str:
    """What holds in every combination with the static coefficient of the best one."""
    alike = [row for row in rows if row.assumptions.static == rows[0].assumptions.static]
    common = [name for name in rows[0].scores if all(row.scores[name] is True for row in alike)]
    second = f", the next {rows[1].held}" if len(rows) > 1 else ""
    return (
        f"{len(rows)} combinations, tested on {rows[0].told} statements about figures 4 to 13 with"
        " the values of single figures as corrected, in fewer columns than the audit. The best"
        f" satisfies {rows[0].held}{second}. {', '.join(common) or 'None'} hold with every"
        f" combination of μ_s = {rows[0].assumptions.static:.2f}: they say nothing about the"
        " other choices."
    )


# Thresholds, in words, and the statements that they concern.
_BY_DOTS = ("B1", "B2", "B3", "B4", "M4", "R1")
_BY_LINES = ("M1", "M4", "R2", "R4")
_BY_STICKS = ("S8", "M1", "M2", "M3", "M4", "R1", "R2", "R3", "R4")
_EYE = {
    "dot": ("the height of a dot", _BY_DOTS),
    "line": ("the lowest line that is seen", _BY_LINES),
    "stick": ("the shortest stick that is seen", _BY_STICKS),
    "share": ("the least share of sticks", _BY_STICKS),
}


def _on_the_eye(laboratory: Laboratory, chosen: Sequence[Statement]) -> str:
    """The same statements with each threshold halved and doubled."""
    laboratory = laboratory.like(assumptions=CORRECTED)
    before, changes = _row(laboratory, chosen).scores, []
    for name, (words, concerned) in _EYE.items():
        some = [statement for statement in chosen if statement.name in concerned]
        for factor, changed in ((0.5, "halved"), (2.0, "doubled")):
            eye = EYE._replace(**{name: factor * getattr(EYE, name)})
            after = _row(laboratory.like(eye=eye), some).scores
            flipped = [
                f"{one} then {'holds' if holds else 'fails'}"
                for one, holds in after.items()
                if holds != before[one]
            ]
            changes.append(f"{words} {changed}: {', '.join(flipped) or 'no change'}")
    return (
        "The audit names what is seen by thresholds; how far the same statements, with the"
        f" corrected choices, hang on them: {'; '.join(changes)}."
    )


def _questions(laboratory: Laboratory) -> tuple[Question, ...]:
    laboratory = laboratory.like(assumptions=CORRECTED)
    return (
        _figure_6a(laboratory),
        _figures_14_to_16(laboratory),
        _figure_17(laboratory),
        _ten_hertz(laboratory),
    )


def _figure_6a(laboratory: Laboratory) -> Question:
    cases = [Case(eta=0.0, F0=force) for force in _FORCES_6]
    responses = laboratory.responses(cases)
    free = [rests(response).word == NON_STICK_SLIP for response in responses]
    side = [lines(response).beside for response in responses]
    fits = [
        force
        for force, moves, beside in zip(_FORCES_6, free, side, strict=True)
        if moves and beside >= laboratory.eye.line
    ]
    each = "; ".join(
        f"{force:g}: {rests(response).word}, {beside:.2g}"
        for force, response, beside in zip(_FORCES_6, responses, side, strict=True)
    )
    answer = (
        f"No stick and a side band that is seen at F_0 = {fits[0]:g} to {fits[-1]:g} of the values"
        " tried." if fits else "None of the values tried gives what is described."
    )  # fmt: skip
    return Question(
        "F_0 of figure 6a (printed: 0.12)",
        f"{answer} Class and highest line beside f_e: {each}. Which of them the figure shows stays"
        f" open; {Case().F0:g}, the value of figures 8 to 10, is used.",
        settled=len(fits) == 1,
    )


def _score(laboratory: Laboratory, names: Sequence[str], force: float) -> tuple[int, int]:
    """Parts that hold, of all, with another F_0."""
    chosen = [statement for statement in STATEMENTS if statement.name in names]
    parts = [
        part
        for statement in chosen
        for part in statement.check(laboratory, {"F0": force, "whole": True})
    ]
    return sum(bool(part.holds) for part in parts), len(parts)


def _figures_14_to_16(laboratory: Laboratory) -> Question:
    scores = {force: _score(laboratory, ("B5", "B6", "R5", "R6"), force) for force in _FORCES_14}
    best = max(scores, key=lambda force: scores[force][0])
    each = ", ".join(f"{force:g}: {held} of {all_}" for force, (held, all_) in scores.items())
    return Question(
        f"F_0 of figures 14 to 16 (printed: {PRINTED_F0:g})",
        f"Parts of the statements B5, B6, R5 and R6 that hold at F_0 = {each}. {best:g} fits best;"
        f" figures 8 to 10 have {Case().F0:g}.",
        settled=scores[best][0] > scores[PRINTED_F0][0],
    )


def _figure_17(laboratory: Laboratory) -> Question:
    """The columns on both sides of figure 11's angle."""
    plan = PLANS["17"]
    low, high = (float(value) for value in plan.columns()[2:4])
    points = laboratory.steadies([plan.base.at(alpha=alpha) for alpha in (low, 1.18, high)])
    axis = max(float(np.ptp(point.velocity)) for point in points)
    words = [look(point.velocity, axis, laboratory.eye.dot).word for point in points]
    settled = words[0] == SYNCHRONOUS and SYNCHRONOUS not in words[1:]
    return Question(
        "The limit α = 1.41 of figure 17, against multi-periodic motion at 1.18 in figure 11",
        f"The printed angles are tenths of a radian. At 0.3 rad (α = {low:.4g}) the motion looks"
        f" {words[0]}, at 0.4 rad (α = {high:.4g}) {words[2]}, and at α = 1.18, between these"
        f" columns, {words[1]}.",
        settled=settled,
    )


def _ten_hertz(laboratory: Laboratory) -> Question:
    """Whether f = 0.63 is 63 rad/s or 10 Hz in figures 8 and 11."""
    scores = []
    for f in (0.63, 10.0 * HERTZ):
        cases = [Case(f=f, eta=float(eta)) for eta in np.arange(-120.0, -35.0, 6.0)]
        points = laboratory.steadies(cases)
        axis = max(float(np.ptp(point.velocity)) for point in points)
        scores.append(sum(look(point.velocity, axis).word == DOUBLE for point in points))
    total = len(np.arange(-120.0, -35.0, 6.0))
    return Question(
        "f = 0.63 of figures 8 to 13: 63 rad/s, or 10 Hz as in figures 14 to 16",
        f"Columns of figure 8a from −120 to −36 that are 2T-periodic, as the paper says of all:"
        f" {scores[0]} of {total} at 63 rad/s, {scores[1]} at 10 Hz.",
        settled=scores[0] > scores[1],
    )
