"""Responses at a falling actuation force: R1 to R7 (figures 9, 10, 12, 13, 15, 16, 18)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from wedgebrake.analysis.sticking import (
    AT_REST,
    BIDIRECTIONAL,
    NON_STICK_SLIP,
    UNIDIRECTIONAL,
)
from wedgebrake.paper.assumptions import CONVENTIONAL, Case
from wedgebrake.paper.claims import Part, Statement
from wedgebrake.paper.diagrams import (
    ANGLE_COLUMN,
    FORCE_WHY,
    FREQUENCIES,
    PLANS,
    PRINTED_F0,
)
from wedgebrake.paper.laboratory import Laboratory
from wedgebrake.paper.parameters import KINETIC
from wedgebrake.paper.signal_features import (
    asymmetry,
    distortion,
    ellipse_error,
    lines,
    percent,
    rests,
)
from wedgebrake.paper.statements.motions import BENT
from wedgebrake.paper.visual_criteria import EYE, FILLED, MULTIPLE, look

ETAS = (-6.0, -24.0, -30.0, -60.0)
FORCES = (0.015, 0.024, 0.031, 0.042, 0.067, 0.120)
ANGLES = tuple(math.tan(ANGLE_COLUMN * n) / KINETIC for n in (2, 10))
"""alpha of figure 18, printed as 0.68 and 5.20."""
# A Poincare map is an ellipse if its points lie on one to this share of its size.
_ELLIPSE = 0.02
_CLOSED = 0.1
# "Mostly" is at least this share of the energy.
_MOSTLY = 0.95
STICKING = (UNIDIRECTIONAL, BIDIRECTIONAL, AT_REST)


def _class(laboratory: Laboratory, case: Case, wanted: str, words: str) -> Part:
    found = rests(laboratory.response(case), laboratory.eye)
    return Part(f"{words}: {wanted}", found.word == wanted, found.words())


def _no_sticks(laboratory: Laboratory, cases: Sequence[Case], name: str) -> Part:
    found = [rests(response, laboratory.eye) for response in laboratory.responses(cases)]
    each = "; ".join(
        f"{getattr(case, name):.3g}: {one.word} ({percent(one.shares[2])} at rest)"
        for case, one in zip(cases, found, strict=True)
    )
    return Part("no sticks", all(one.word == NON_STICK_SLIP for one in found), each)


def _lost(laboratory: Laboratory, cases: Sequence[Case]) -> list[Part]:
    """A part that fails, if a run does not last 25 s: then there is no picture to speak of."""
    ended = [one for one in laboratory.steadies(cases) if not one.completed]
    if not ended:
        return []
    # What diverges is the equations' answer; other ends are a solver's.
    told = all(one.status == "diverged" for one in ended)
    found = f"{len(ended)} of {len(cases)} do not: {ended[0].status} at {ended[0].end:.3g} s"
    return [Part("the runs last 25 s", False if told else None, found)]


def _slopes_wedge(laboratory: Laboratory, _: dict[str, Any]) -> list[Part]:
    cases = [Case(eta=eta) for eta in ETAS]
    lost = _lost(laboratory, cases)
    if lost:
        return lost
    pair = laboratory.responses([cases[0], cases[0].at(brake=CONVENTIONAL)])
    bent, smooth = map(distortion, pair)
    parts = [
        _class(laboratory, cases[0], NON_STICK_SLIP, "η = −6"),
        Part(
            "η = −6: velocity bent at its crossings",
            bent >= BENT * smooth,
            f"jump of the acceleration {bent:.2g} of its largest value, {smooth:.2g} for the"
            " conventional brake",
        ),
    ]
    for case in cases[1:]:
        found = rests(laboratory.response(case), laboratory.eye)
        parts.append(
            Part(
                f"η = {case.eta:g}: sticks when θ' falls through zero, none on the way back",
                found.word == UNIDIRECTIONAL and found.shares[0] > found.shares[1],
                found.words(),
            )
        )
    own = [steady.velocity for steady in laboratory.steadies(cases[1:])]
    others = [case.at(brake=CONVENTIONAL) for case in cases[1:]]
    compared = [steady.velocity for steady in laboratory.steadies(others)]
    axis = float(np.ptp(np.concatenate(own + compared)))
    words = [look(velocity, axis, laboratory.eye.dot) for velocity in own]
    other = [look(velocity, axis, laboratory.eye.dot) for velocity in compared]
    parts.append(
        Part(
            "η = −30: irregular Poincaré map",
            words[1].word in (MULTIPLE, FILLED),
            f"{words[1].word}, {words[1].groups} groups of points",
        )
    )
    simpler = [words[i].groups < other[i].groups for i in (0, 2)]
    parts.append(
        Part(
            "η = −24 and −60: simpler than the conventional brake",
            all(simpler),
            f"{words[0].groups} and {words[2].groups} groups of points against"
            f" {other[0].groups} and {other[2].groups}",
        )
    )
    return parts


def _slopes_conventional(laboratory: Laboratory, _: dict[str, Any]) -> list[Part]:
    cases = [Case(brake=CONVENTIONAL, eta=eta) for eta in ETAS]
    return _lost(laboratory, cases) or [
        _no_sticks(laboratory, cases, "eta"),
        _spectra(laboratory, cases, "eta"),
    ]


def _spectra(laboratory: Laboratory, cases: Sequence[Case], name: str) -> Part:
    found = [
        lines(response, laboratory.eye, natural=True) for response in laboratory.responses(cases)
    ]
    each = "; ".join(
        f"{getattr(case, name):.3g}: {one.beside:.2g} at {one.where:.3g} Hz"
        for case, one in zip(cases, found, strict=True)
    )
    return Part(
        "spectra show f_n and f_e only",
        all(one.beside < laboratory.eye.line for one in found),
        f"highest other line, over the highest: {each}",
    )


def _forces_wedge(laboratory: Laboratory, _: dict[str, Any]) -> list[Part]:
    cases = [Case(F0=force) for force in FORCES]
    lost = _lost(laboratory, cases)
    if lost:
        return lost
    wanted = [NON_STICK_SLIP, *[BIDIRECTIONAL] * 4, UNIDIRECTIONAL]
    parts = [
        _class(laboratory, case, word, f"F_0 = {case.F0:g}")
        for case, word in zip(cases, wanted, strict=True)
    ]
    shares = [rests(response, laboratory.eye).shares[2] for response in laboratory.responses(cases)]
    parts.append(
        Part(
            "the larger F_0, the more of the time at rest",
            all(one <= two for one, two in pairwise(shares)),
            ", ".join(percent(share) for share in shares),
        )
    )
    return parts


def _forces_conventional(laboratory: Laboratory, _: dict[str, Any]) -> list[Part]:
    cases = [Case(brake=CONVENTIONAL, F0=force) for force in FORCES]
    lost = _lost(laboratory, cases)
    if lost:
        return lost
    settling = laboratory.steady(cases[3]).velocity
    half = settling.size // 2
    early, late = float(np.ptp(settling[:half])), float(np.ptp(settling[half:]))
    round_, bent = laboratory.steadies([cases[0], cases[0].at(brake="wedge")])
    ellipse = ellipse_error(round_.angle, round_.velocity)
    other = ellipse_error(bent.angle, bent.velocity)
    return [
        _no_sticks(laboratory, cases, "F0"),
        Part(
            "F_0 = 0.042: the Poincaré points close in on one point",
            late < early,
            f"spread {early:.3g} rad/s in the first half of the last 5 s, {late:.3g} in the second",
        ),
        Part(
            "F_0 = 0.015: the Poincaré map is an ellipse, the wedge's is distorted",
            ellipse <= _ELLIPSE < other,
            f"rms distance from the nearest ellipse {_percent(ellipse)}, {_percent(other)} for"
            " the wedge",
        ),
        _spectra(laboratory, cases, "F0"),
    ]


def _frequencies_wedge(laboratory: Laboratory, values: dict[str, Any]) -> list[Part]:
    cases = [Case(F0=values["F0"], f=f) for f in FREQUENCIES]
    lost = _lost(laboratory, cases)
    if lost:
        return lost
    parts = []
    for index in (0, 1, 3):
        stuck = rests(laboratory.response(cases[index]), laboratory.eye)
        parts.append(
            Part(f"f = {cases[index].f:.3g}: sticks", stuck.word in STICKING, stuck.words())
        )
    found = [lines(response, laboratory.eye) for response in laboratory.responses(cases[:3])]
    parts.append(
        Part(
            "side bands disappear gradually towards f = 1, where f_e alone is left",
            found[0].seen > found[1].seen > found[2].seen == 0,
            ", ".join(str(one.seen) for one in found)
            + " lines besides f_e at f = 0.31, 0.63 and 1, with "
            + ", ".join(percent(one.share) for one in found)
            + " of the energy",
        )
    )
    return parts


def _frequencies_conventional(laboratory: Laboratory, values: dict[str, Any]) -> list[Part]:
    cases = [Case(brake=CONVENTIONAL, F0=values["F0"], f=f) for f in FREQUENCIES]
    lost = _lost(laboratory, cases)
    if lost:
        return lost
    parts = [_no_sticks(laboratory, cases, "f")]
    for index in (1, 3):
        own = laboratory.steady(cases[index])
        error = ellipse_error(own.angle, own.velocity)
        parts.append(
            Part(
                f"f = {cases[index].f:.3g}: a regular Poincaré map with axes of symmetry",
                error <= _CLOSED,
                f"rms distance from the nearest ellipse {_percent(error)}",
            )
        )
    for index in (2, 4):
        found = lines(laboratory.response(cases[index]), laboratory.eye)
        parts.append(
            Part(
                f"f = {cases[index].f:.3g}: clean spectrum",
                found.beside < laboratory.eye.line,
                f"highest line beside f_e {found.beside:.2g} of it, at {found.where:.3g} Hz",
            )
        )
    return parts


def _percent(share: float) -> str:
    return (
        f"{100.0 * share:.2g} % of its size" if math.isfinite(share) else "not told: points apart"
    )


def _angles(laboratory: Laboratory, _: dict[str, Any]) -> list[Part]:
    small, large = (Case(F0=0.024, alpha=alpha) for alpha in ANGLES)
    lost = _lost(laboratory, [small, large])
    if lost:
        return lost
    one, two = (
        lines(r, laboratory.eye, natural=True) for r in laboratory.responses([small, large])
    )
    stuck = rests(laboratory.response(large), laboratory.eye)
    uneven = asymmetry(laboratory.response(large))
    return [
        _class(laboratory, small, UNIDIRECTIONAL, "α = 0.68"),
        Part(
            "α = 0.68: many side bands",
            one.seen >= 3,
            f"{one.seen} lines besides f_e and f_n, the highest {one.beside:.2g} of the top",
        ),
        Part(
            "α = 5.20: asymmetric",
            uneven >= laboratory.eye.line,
            f"largest speeds of the two directions differ by {100.0 * uneven:.2g} %",
        ),
        Part(
            "α = 5.20: some sticking",
            stuck.word in STICKING,
            stuck.words(),
        ),
        Part(
            "α = 5.20: spectrum mostly f_n and f_e",
            two.share <= 1.0 - _MOSTLY,
            f"{100.0 * (1.0 - two.share):.3g} % of the energy within 0.5 Hz of them",
        ),
    ]


_SEEN = (
    f"a line is seen from {100 * EYE.line:g} % of the highest on, a stick from"
    f" {100 * EYE.stick:g} % of a period on; sticks count where those after one direction take"
    f" {100 * EYE.share:g} % of the time"
)
_FORCE = ({"F0": PRINTED_F0}, {"F0": PLANS["14a"].base.F0}, FORCE_WHY)
STATEMENTS = (
    Statement(
        "R1", "9", "Wedge: at η = −6 no sticks but bent crossings; at −24, −30 and −60 sticks when"
        " the velocity falls through zero and none on the way back; irregular points at −30;"
        " simpler than the conventional brake at −24 and −60.",
        "Sticks of the last 5 s by the side from which they are entered; groups of Poincaré"
        " points.", _SEEN, _slopes_wedge,
    ),
    Statement(
        "R2", "10", "Conventional brake at the same η: no sticks; spectra at f_n and f_e only.",
        "Sticks of the last 5 s, spectra of all 25 s.", _SEEN, _slopes_conventional,
    ),
    Statement(
        "R3", "12", "Wedge: no sticks at F_0 = 0.015, bidirectional stick-slip at 0.024, 0.031,"
        " 0.042 and 0.067, unidirectional at 0.120; the larger F_0, the more sticking.",
        "Sticks of the last 5 s.", _SEEN, _forces_wedge,
    ),
    Statement(
        "R4", "13", "Conventional brake: no sticks; at F_0 = 0.042 the motion settles on a point"
        " after a while; at 0.015 the Poincaré map is an ellipse where the wedge's is distorted;"
        " spectra at f_n and f_e only.",
        "Sticks, spread of the points, least-squares ellipse.",
        f"{_SEEN}; an ellipse to {100 * _ELLIPSE:g} %", _forces_conventional,
    ),
    Statement(
        "R5", "15", "Wedge: sticks at f = 0.31, 0.63 and 1.26; side bands fade towards f = 1,"
        " where f_e alone is left.",
        "Sticks of the last 5 s; lines of the spectrum of all 25 s besides f_e.", _SEEN,
        _frequencies_wedge, *_FORCE,
    ),
    Statement(
        "R6", "16", "Conventional brake: no sticks; Poincaré maps regular and symmetric; clean"
        " spectra at f = 1 and 2.07.",
        "Sticks, least-squares ellipse, spectra.",
        f"{_SEEN}; regular: an ellipse to {100 * _CLOSED:g} %", _frequencies_conventional,
        *_FORCE,
    ),
    Statement(
        "R7", "18", "α = 0.68: unidirectional stick-slip with many side bands; α = 5.20: some"
        " sticking, spectrum mostly f_n and f_e.",
        "Sticks of the last 5 s, spectra of all 25 s.",
        f"{_SEEN}; mostly: {100 * _MOSTLY:g} % of the energy", _angles,
        apart=False,
    ),
)  # fmt: skip
