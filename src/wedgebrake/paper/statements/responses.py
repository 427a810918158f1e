"""Responses at a falling actuation force: R1 to R7 (figures 9, 10, 12, 13, 15, 16, 18)."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import pairwise

import numpy as np

from wedgebrake.analysis.sticking import BIDIRECTIONAL, NON_STICK_SLIP, UNIDIRECTIONAL
from wedgebrake.model.paper_machines import CONVENTIONAL, WEDGE, Case
from wedgebrake.paper.claims import Part
from wedgebrake.paper.laboratory import Laboratory
from wedgebrake.paper.signal_features import asymmetry, ellipse_error, percent
from wedgebrake.paper.statements.parts import (
    STICKING,
    OnFigure,
    bands_of,
    bent,
    no_sticks,
    stick_slip,
    sticks_of,
    two_lines,
)
from wedgebrake.paper.visual_criteria import FILLED, MULTIPLE, appearance

# A Poincaré map is an ellipse if its points lie on one to this share of its size, and regular
# if they lie on one to this share.
_ELLIPSE, _REGULAR = 0.02, 0.1
# "Mostly" is at least this share of the energy.
_MOSTLY = 0.95


def _slopes_wedge(laboratory: Laboratory, cases: Sequence[Case]) -> Iterator[Part]:
    first, *steeper = cases
    yield stick_slip(laboratory, first, NON_STICK_SLIP, "η = −6")
    says = "η = −6: velocity bent at its crossings"
    yield bent(laboratory, first, first.at(brake=CONVENTIONAL), says)
    for case in steeper:
        found = sticks_of(laboratory, case)
        yield Part(
            f"η = {case.eta:g}: sticks when θ' falls through zero, none on the way back",
            found.kind == UNIDIRECTIONAL and found.shares[0] > found.shares[1],
            found.description(),
        )
    both = [*steeper, *(case.at(brake=CONVENTIONAL) for case in steeper)]
    points = [steady.velocity for steady in laboratory.steadies(both)]
    axis = float(np.ptp(np.concatenate(points)))
    seen = [appearance(velocity, axis, laboratory.thresholds.dot) for velocity in points]
    own, other = seen[:3], seen[3:]
    yield Part(
        "η = −30: irregular Poincaré map",
        own[1].kind in (MULTIPLE, FILLED),
        f"{own[1].kind}, {own[1].groups} groups of points",
    )
    yield Part(
        "η = −24 and −60: simpler than the conventional brake",
        all(own[i].groups < other[i].groups for i in (0, 2)),
        f"{own[0].groups} and {own[2].groups} groups of points against {other[0].groups} and"
        f" {other[2].groups}",
    )


def _slopes_conventional(laboratory: Laboratory, cases: Sequence[Case]) -> Iterator[Part]:
    yield no_sticks(laboratory, cases, "eta")
    yield two_lines(laboratory, cases, "eta")


def _forces_wedge(laboratory: Laboratory, cases: Sequence[Case]) -> Iterator[Part]:
    kinds = [NON_STICK_SLIP, *[BIDIRECTIONAL] * 4, UNIDIRECTIONAL]
    for case, kind in zip(cases, kinds, strict=True):
        yield stick_slip(laboratory, case, kind, f"F_0 = {case.F0:g}")
    shares = [sticks_of(laboratory, case).shares[2] for case in cases]
    yield Part(
        "the larger F_0, the more of the time at rest",
        all(one <= two for one, two in pairwise(shares)),
        ", ".join(percent(share) for share in shares),
    )


def _forces_conventional(laboratory: Laboratory, cases: Sequence[Case]) -> Iterator[Part]:
    yield no_sticks(laboratory, cases, "F0")
    settling = laboratory.steady(cases[3]).velocity
    half = settling.size // 2
    early, late = float(np.ptp(settling[:half])), float(np.ptp(settling[half:]))
    yield Part(
        "F_0 = 0.042: the Poincaré points close in on one point",
        late < early,
        f"spread {early:.3g} rad/s in the first half of the last 5 s, {late:.3g} in the second",
    )
    own, other = (_ellipse_error(laboratory, cases[0].at(brake=b)) for b in (CONVENTIONAL, WEDGE))
    yield Part(
        "F_0 = 0.015: the Poincaré map is an ellipse, the wedge's is distorted",
        own <= _ELLIPSE < other,
        f"{_distance(own)}, {_distance(other, short=True)} for the wedge",
    )
    yield two_lines(laboratory, cases, "F0")


def _frequencies_wedge(laboratory: Laboratory, cases: Sequence[Case]) -> Iterator[Part]:
    for index in (0, 1, 3):
        stuck = sticks_of(laboratory, cases[index])
        says = f"f = {cases[index].f:.3g}: sticks"
        yield Part(says, stuck.kind in STICKING, stuck.description())
    found = [bands_of(laboratory, case) for case in cases[:3]]
    yield Part(
        "side bands disappear gradually towards f = 1, where f_e alone is left",
        found[0].seen > found[1].seen > found[2].seen == 0,
        ", ".join(str(one.seen) for one in found)
        + " lines besides f_e at f = 0.31, 0.63 and 1, with "
        + ", ".join(percent(one.share) for one in found)
        + " of the energy",
    )


def _frequencies_conventional(laboratory: Laboratory, cases: Sequence[Case]) -> Iterator[Part]:
    yield no_sticks(laboratory, cases, "f")
    for index in (1, 3):
        error = _ellipse_error(laboratory, cases[index])
        says = f"f = {cases[index].f:.3g}: a regular Poincaré map with axes of symmetry"
        yield Part(says, error <= _REGULAR, _distance(error))
    for index in (2, 4):
        found = bands_of(laboratory, cases[index])
        yield Part(
            f"f = {cases[index].f:.3g}: clean spectrum",
            found.beside < laboratory.thresholds.line,
            f"highest line beside f_e {found.beside:.2g} of it, at {found.where:.3g} Hz",
        )


def _angles(laboratory: Laboratory, cases: Sequence[Case]) -> Iterator[Part]:
    small, large = cases
    one, two = (bands_of(laboratory, case, natural=True) for case in cases)
    stuck = sticks_of(laboratory, large)
    uneven = asymmetry(laboratory.response(large))
    yield stick_slip(laboratory, small, UNIDIRECTIONAL, "α = 0.68")
    yield Part(
        "α = 0.68: many side bands",
        one.seen >= 3,
        f"{one.seen} lines besides f_e and f_n, the highest {one.beside:.2g} of the top",
    )
    yield Part(
        "α = 5.20: asymmetric",
        uneven >= laboratory.thresholds.line,
        f"largest speeds of the two directions differ by {100.0 * uneven:.2g} %",
    )
    yield Part("α = 5.20: some sticking", stuck.kind in STICKING, stuck.description())
    yield Part(
        "α = 5.20: spectrum mostly f_n and f_e",
        two.share <= 1.0 - _MOSTLY,
        f"{100.0 * (1.0 - two.share):.3g} % of the energy within 0.5 Hz of them",
    )


def _ellipse_error(laboratory: Laboratory, case: Case) -> float:
    """Distance of the Poincaré points from an ellipse, over its size."""
    points = laboratory.steady(case)
    return ellipse_error(points.angle, points.velocity)


def _distance(share: float, *, short: bool = False) -> str:
    """Distance from an ellipse in words."""
    if not math.isfinite(share):
        return "cannot be told: points too far apart"
    start = "" if short else "rms distance from the nearest ellipse "
    return f"{start}{100.0 * share:.2g} % of its size"


CHECKS = {
    "R1": OnFigure(9, _slopes_wedge),
    "R2": OnFigure(10, _slopes_conventional),
    "R3": OnFigure(12, _forces_wedge),
    "R4": OnFigure(13, _forces_conventional),
    "R5": OnFigure(15, _frequencies_wedge),
    "R6": OnFigure(16, _frequencies_conventional),
    "R7": OnFigure(18, _angles),
}
