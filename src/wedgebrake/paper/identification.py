"""Identification of the choices that the paper leaves unstated, from its own statements."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from itertools import product
from typing import NamedTuple

import numpy as np

from wedgebrake.analysis.responses.sticking import NON_STICK_SLIP
from wedgebrake.model.paper_machines import CORRECTED, HERTZ, PRINTED_F0, Assumptions, Case
from wedgebrake.paper.claims import Statement
from wedgebrake.paper.diagrams import PLANS
from wedgebrake.paper.laboratory import Laboratory
from wedgebrake.paper.signal_features import side_bands, visible_sticks
from wedgebrake.paper.statements import STATEMENTS
from wedgebrake.paper.visual_criteria import DOUBLE, SYNCHRONOUS, THRESHOLDS, appearance

DAMPINGS = (1.0, 0.3, 0.2, 0.1, 0.05)
STATICS = (0.30, 0.33)
CANDIDATES = tuple(
    Assumptions(damping, static, release, slope_on)
    for slope_on, release, static, damping in product(
        ("shaft", "interface"), (True, False), STATICS, DAMPINGS
    )
)
"""c, the static peak, release and the speed of eq. (3): forty combinations."""

# Statements on figures whose own parameters are not in question, except 6a and 7a.
_TESTED = "S7 S8 M1 M2 M3 M4 B1 B2 B3 B4 R1 R2 R3 R4"
# Coarser than in the audit, for forty combinations.
_RTOL = 1e-6
# F_0 tried for figures 6a and 14 to 16.
_FORCES_6 = (0.006, 0.012, 0.018, 0.024, 0.030, 0.036, 0.042, 0.048, 0.054, 0.060, 0.09, 0.12)
_FORCES_14 = (0.024, 0.030, 0.036, 0.042)


class Combination(NamedTuple):
    """One combination of assumptions.

    scores     : by statement, whether it holds
    held, decided : number of statements that hold, and of those that can be decided
    """

    assumptions: Assumptions
    scores: dict[str, bool | None]
    held: int
    decided: int


class Question(NamedTuple):
    """A question that the paper leaves open, the answer found, and whether that settles it."""

    question: str
    answer: str
    settled: bool


@dataclass(frozen=True)
class Identification:
    """Combinations, best first, open questions, and the influence of the thresholds."""

    rows: tuple[Combination, ...]
    open_questions: tuple[Question, ...]
    paragraphs: tuple[str, ...]

    def table(self) -> list[dict[str, str]]:
        """Combinations as rows of text."""
        return [
            {
                "c [N m s/rad]": f"{row.assumptions.damping:g}",
                "μ_s": f"{row.assumptions.static:.2f}",
                "release": "on" if row.assumptions.release else "off",
                "slope on": "|θ'|" if row.assumptions.slope_on == "shaft" else "|v_r|",
                "statements": f"{row.held} of {row.decided}",
            }
            for row in self.rows
        ]


def identify(
    laboratory: Laboratory, candidates: Sequence[Assumptions] = CANDIDATES
) -> Identification:
    """Test the statements of figures 4 to 13 under every combination."""
    coarse = laboratory.like(coarse=True, rtol=_RTOL)
    corrected = coarse.like(assumptions=CORRECTED)
    chosen = [statement for statement in STATEMENTS if statement.name in _TESTED.split()]
    # The runs are shared by the laboratory's own threads; these prepare and evaluate.
    with ThreadPoolExecutor(laboratory.threads) as pool:
        rows = list(pool.map(lambda one: _row(coarse.like(assumptions=one), chosen), candidates))
    rows.sort(key=lambda row: -row.held)
    questions = (_figure_6a, _figures_14_to_16, _figure_17, _ten_hertz)
    return Identification(
        tuple(rows),
        tuple(question(corrected) for question in questions),
        (_on_rows(rows), _on_thresholds(corrected, chosen)),
    )


def _row(laboratory: Laboratory, chosen: Sequence[Statement]) -> Combination:
    scores = {one.name: one.holds(laboratory) for one in chosen}
    decided = [score for score in scores.values() if score is not None]
    return Combination(laboratory.assumptions, scores, sum(map(bool, decided)), len(decided))


def _on_rows(rows: Sequence[Combination]) -> str:
    """Summarise the rows, with the statements that hold whatever the other choices."""
    alike = [row for row in rows if row.assumptions.static == rows[0].assumptions.static]
    common = [name for name in rows[0].scores if all(row.scores[name] is True for row in alike)]
    second = f", the next {rows[1].held}" if len(rows) > 1 else ""
    return (
        f"{len(rows)} combinations, tested on {rows[0].decided} statements about figures 4 to 13"
        " with the values of single figures as corrected, in fewer columns than the audit. The best"
        f" satisfies {rows[0].held}{second}. {', '.join(common) or 'None'} hold with every"
        f" combination of μ_s = {rows[0].assumptions.static:.2f} and do not discriminate between"
        " the other choices."
    )


# Thresholds, and the statements that depend on them.
_BY_STICKS = "S8 M1 M2 M3 M4 R1 R2 R3 R4"
_THRESHOLDS = {
    "dot": ("the height of a dot", "B1 B2 B3 B4 M4 R1"),
    "line": ("the lowest visible line", "M1 M4 R2 R4"),
    "stick": ("the shortest visible stick", _BY_STICKS),
    "share": ("the least share of sticks", _BY_STICKS),
}


def _on_thresholds(laboratory: Laboratory, chosen: Sequence[Statement]) -> str:
    before, changes = _row(laboratory, chosen).scores, []
    for name, (words, concerned) in _THRESHOLDS.items():
        some = [statement for statement in chosen if statement.name in concerned.split()]
        for factor, changed in ((0.5, "halved"), (2.0, "doubled")):
            thresholds = THRESHOLDS._replace(**{name: factor * getattr(THRESHOLDS, name)})
            after = _row(laboratory.like(thresholds=thresholds), some).scores
            flipped = [
                f"{one} then {'holds' if holds else 'fails'}"
                for one, holds in after.items()
                if holds != before[one]
            ]
            changes.append(f"{words} {changed}: {', '.join(flipped) or 'no change'}")
    return (
        "The audit decides by thresholds what is visible. Influence of each on the same"
        f" statements, with the corrected choices: {'; '.join(changes)}."
    )


def _kinds(laboratory: Laboratory, cases: Sequence[Case]) -> list[str]:
    """Kinds of motion of some cases on one velocity axis."""
    points = [steady.velocity for steady in laboratory.steadies(cases)]
    axis = max(float(np.ptp(velocity)) for velocity in points)
    return [appearance(velocity, axis).kind for velocity in points]


def _figure_6a(laboratory: Laboratory) -> Question:
    responses = laboratory.responses([Case(eta=0.0, F0=force) for force in _FORCES_6])
    fits, rows = [], []
    for force, response in zip(_FORCES_6, responses, strict=True):
        kind, beside = visible_sticks(response).kind, side_bands(response).beside
        rows.append(f"{force:g}: {kind}, {beside:.2g}")
        if kind == NON_STICK_SLIP and beside >= THRESHOLDS.line:
            fits.append(force)
    answer = "None of the values tried gives what is described."
    if fits:
        answer = (
            f"Of the values tried, F_0 = {fits[0]:g} to {fits[-1]:g} give no stick and a visible"
            " side band."
        )
    return Question(
        "F_0 of figure 6a (printed: 0.12)",
        f"{answer} Class and highest line beside f_e: {'; '.join(rows)}. Which of them the figure"
        f" shows stays open; {Case().F0:g}, the value of figures 8 to 10, is used.",
        settled=len(fits) == 1,
    )


def _figures_14_to_16(laboratory: Laboratory) -> Question:
    chosen = [statement for statement in STATEMENTS if statement.name in ("B5", "B6", "R5", "R6")]
    scores = {}
    for force in _FORCES_14:
        values = {"F0": force, "whole": True}
        parts = [part for one in chosen for part in one.parts(laboratory, values)]
        scores[force] = sum(bool(part.holds) for part in parts), len(parts)
    best = max(scores, key=lambda force: scores[force][0])
    each = ", ".join(f"{force:g}: {held} of {all_}" for force, (held, all_) in scores.items())
    return Question(
        f"F_0 of figures 14 to 16 (printed: {PRINTED_F0:g})",
        f"Parts of the statements B5, B6, R5 and R6 that hold at F_0 = {each}. {best:g} fits best;"
        f" figures 8 to 10 have {Case().F0:g}.",
        settled=scores[best][0] > scores[PRINTED_F0][0],
    )


def _figure_17(laboratory: Laboratory) -> Question:
    plan = PLANS["17"]
    low, high = plan.columns()[2:4].tolist()
    cases = [plan.base.at(alpha=alpha) for alpha in (low, 1.18, high)]
    below, between, above = _kinds(laboratory, cases)
    return Question(
        "The limit α = 1.41 of figure 17, against multi-periodic motion at 1.18 in figure 11",
        f"The printed angles are tenths of a radian. At 0.3 rad (α = {low:.4g}) the motion looks"
        f" {below}, at 0.4 rad (α = {high:.4g}) {above}, and at α = 1.18, between these"
        f" columns, {between}.",
        settled=below == SYNCHRONOUS and SYNCHRONOUS not in (between, above),
    )


def _ten_hertz(laboratory: Laboratory) -> Question:
    slopes = np.arange(-120.0, -35.0, 6.0)
    at_63, at_10_hz = (
        _kinds(laboratory, [Case(f=f, eta=float(eta)) for eta in slopes]).count(DOUBLE)
        for f in (0.63, 10.0 * HERTZ)
    )
    return Question(
        "f = 0.63 of figures 8 to 13: 63 rad/s, or 10 Hz as in figures 14 to 16",
        "Columns of figure 8a from −120 to −36 that are 2T-periodic, as the paper states for all:"
        f" {at_63} of {slopes.size} at 63 rad/s, {at_10_hz} at 10 Hz.",
        settled=at_63 > at_10_hz,
    )
