"""Responses: M1 to M4 at a constant actuation force (section 4.1, figures 6 and 7), and R1 to R7.

R1 to R7 are the responses at a falling force (figures 9, 10, 12, 13, 15, 16, 18).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from itertools import pairwise
from typing import Any

import numpy as np

from wedgebrake.analysis.responses.sticking import (
    AT_REST,
    BIDIRECTIONAL,
    NON_STICK_SLIP,
    UNIDIRECTIONAL,
)
from wedgebrake.model.paper_machines import CONVENTIONAL, RESPONSES, WEDGE, Case
from wedgebrake.paper.claims import Assertion, Check
from wedgebrake.paper.laboratory import STEADY, Laboratory
from wedgebrake.paper.signal_features import (
    STICK_SPEED,
    SideBands,
    VisibleSticks,
    asymmetry,
    distortion,
    edges,
    ellipse_error,
    percent,
    side_bands,
    visible_sticks,
)
from wedgebrake.paper.visual_criteria import FILLED, MULTIPLE, SYNCHRONOUS, appearance

_STICKING = (UNIDIRECTIONAL, BIDIRECTIONAL, AT_REST)
# A bend is visible beside a smooth crossing if the acceleration jumps this many times as far;
# "much quicker" is at least this many times.
_BENT, _MUCH = 3.0, 1.5
# A Poincaré map is an ellipse if its points lie on one to this share of its size, and regular
# if they lie on one to this share.
_ELLIPSE, _REGULAR = 0.02, 0.1
# "Mostly" is at least this share of the energy.
_MOSTLY = 0.95


def sticks_of(laboratory: Laboratory, case: Case) -> VisibleSticks:
    """Sticks of a case."""
    return visible_sticks(laboratory.response(case), laboratory.thresholds)


def bands_of(laboratory: Laboratory, case: Case, *, natural: bool = False) -> SideBands:
    """Side bands of a case."""
    return side_bands(laboratory.response(case), laboratory.thresholds, natural=natural)


def _of_figure(
    number: int,
    parts: Callable[[Laboratory, Sequence[Case]], Iterator[Assertion]],
    laboratory: Laboratory,
    values: dict[str, Any],
) -> Iterator[Assertion]:
    """Parts on the cases of a figure; without a steady motion no other part is told.

    The cases have another F_0 if the statement's values have one.
    """
    changed = {"F0": values["F0"]} if "F0" in values else {}
    cases = [case.at(**changed) for case in RESPONSES[number].cases]
    ended = [one for one in laboratory.steadies(cases) if not one.completed]
    if not ended:
        yield from parts(laboratory, cases)
        return
    # Divergence is the equations' answer; other ends are a solver's.
    holds = False if all(one.status == "diverged" for one in ended) else None
    found = f"{len(ended)} of {len(cases)} do not: {ended[0].status} at {ended[0].end:.3g} s"
    yield Assertion("the runs last 25 s", holds, found)


def _kind(laboratory: Laboratory, case: Case, kind: str, label: str) -> Assertion:
    found = sticks_of(laboratory, case)
    return Assertion(f"{label}: {kind}", found.kind == kind, found.description())


def _sticking(laboratory: Laboratory, case: Case, says: str) -> Assertion:
    found = sticks_of(laboratory, case)
    return Assertion(says, found.kind in _STICKING, found.description())


def _no_sticks(laboratory: Laboratory, cases: Sequence[Case], name: str) -> Assertion:
    """None of the cases, which differ in a group, sticks."""
    laboratory.responses(cases)
    found = [sticks_of(laboratory, case) for case in cases]
    each = "; ".join(
        f"{getattr(case, name):.3g}: {one.kind} ({percent(one.shares[2])} at rest)"
        for case, one in zip(cases, found, strict=True)
    )
    return Assertion("no sticks", all(one.kind == NON_STICK_SLIP for one in found), each)


def _two_lines(laboratory: Laboratory, cases: Sequence[Case], name: str) -> Assertion:
    """The spectra of the cases, which differ in a group, show f_n and f_e only."""
    found = [bands_of(laboratory, case, natural=True) for case in cases]
    each = "; ".join(
        f"{getattr(case, name):.3g}: {one.beside:.2g} at {one.where:.3g} Hz"
        for case, one in zip(cases, found, strict=True)
    )
    return Assertion(
        "spectra show f_n and f_e only",
        all(one.beside < laboratory.thresholds.line for one in found),
        f"highest other line, over the highest: {each}",
    )


def _bent(laboratory: Laboratory, case: Case, says: str) -> Assertion:
    """The velocity of a case bends where it crosses zero, the conventional brake's does not."""
    both = laboratory.responses([case, case.at(brake=CONVENTIONAL)])
    jump, smooth = map(distortion, both)
    return Assertion(
        says,
        jump >= _BENT * smooth,
        f"jump of the acceleration {jump:.2g} of its largest value, {smooth:.2g} for the"
        " conventional brake",
    )


def _non_stick_slip(laboratory: Laboratory, values: dict[str, Any]) -> Iterator[Assertion]:
    wedge = Case(eta=0.0, **values)
    yield _kind(laboratory, wedge, NON_STICK_SLIP, "wedge")
    says = "the wedge's velocity bends where it crosses zero, the conventional brake's does not"
    yield _bent(laboratory, wedge, says)
    both = (wedge, wedge.at(brake=CONVENTIONAL))
    side, clean = (bands_of(laboratory, one).beside for one in both)
    yield Assertion(
        "the wedge's spectrum has side bands, the conventional brake's has not",
        side >= laboratory.thresholds.line > clean,
        f"highest line beside f_e: {side:.2g} of it for the wedge, {clean:.2g} for the"
        " conventional brake",
    )


def _bidirectional(laboratory: Laboratory, values: dict[str, Any]) -> Iterator[Assertion]:
    case = Case(eta=0.0, **values)
    back, forth = (edges(laboratory.response(case), side) for side in (-1, 1))
    yield _kind(laboratory, case, BIDIRECTIONAL, "wedge")
    yield Assertion(
        "from negative velocity to zero much quicker than from zero to negative",
        back.rise >= _MUCH * back.fall,
        f"{1e3 * back.fall:.3g} ms against {1e3 * back.rise:.3g} ms between a tenth and nine"
        " tenths of the peak",
    )
    yield Assertion(
        "from zero to positive milder than from positive to zero",
        forth.rise > forth.fall,
        f"{1e3 * forth.rise:.3g} ms against {1e3 * forth.fall:.3g} ms",
    )


def _unidirectional(laboratory: Laboratory, values: dict[str, Any]) -> Iterator[Assertion]:
    case = Case(eta=0.0, **values)
    response = laboratory.response(case)
    velocity = response["velocity"].to_numpy()[response["time"].to_numpy() >= STEADY]
    if not velocity.size:
        yield Assertion("the run lasts 25 s", False, str(response.attrs["message"]))
        return
    high, low = float(np.max(velocity)), float(np.min(velocity))
    exact = sticks_of(laboratory.like(method="exact"), case).kind
    yield _kind(laboratory, case, UNIDIRECTIONAL, "wedge")
    yield Assertion(
        "slips at negative velocity only; positive velocities are about zero",
        high <= STICK_SPEED < -low,
        f"velocity between {low:.3g} and {high:.3g} rad/s; friction reaches 99 % of its"
        f" value at {STICK_SPEED:.3g} rad/s. With Coulomb friction: {exact}",
    )


def _conventional(laboratory: Laboratory, values: dict[str, Any]) -> Iterator[Assertion]:
    first, *others = RESPONSES[7].cases
    for letter, case in zip("abc", (first.at(**values), *others), strict=True):
        found = bands_of(laboratory, case)
        height = float(np.ptp(laboratory.response(case)["velocity"].to_numpy()))
        velocity = laboratory.steady(case).velocity
        seen = appearance(velocity, height, laboratory.thresholds.dot).kind
        yield _kind(laboratory, case, NON_STICK_SLIP, f"7{letter}")
        yield Assertion(
            f"7{letter}: one limit cycle, a clean spectrum",
            seen == SYNCHRONOUS and found.beside < laboratory.thresholds.line,
            f"{seen}; highest line beside f_e {found.beside:.2g} of it, at {found.where:.3g} Hz",
        )


def _slopes_wedge(laboratory: Laboratory, cases: Sequence[Case]) -> Iterator[Assertion]:
    first, *steeper = cases
    yield _kind(laboratory, first, NON_STICK_SLIP, "η = −6")
    yield _bent(laboratory, first, "η = −6: velocity bent at its crossings")
    for case in steeper:
        found = sticks_of(laboratory, case)
        yield Assertion(
            f"η = {case.eta:g}: sticks when θ' falls through zero, none on the way back",
            found.kind == UNIDIRECTIONAL and found.shares[0] > found.shares[1],
            found.description(),
        )
    both = [*steeper, *(case.at(brake=CONVENTIONAL) for case in steeper)]
    points = [steady.velocity for steady in laboratory.steadies(both)]
    axis = float(np.ptp(np.concatenate(points)))
    seen = [appearance(velocity, axis, laboratory.thresholds.dot) for velocity in points]
    own, other = seen[:3], seen[3:]
    yield Assertion(
        "η = −30: irregular Poincaré map",
        own[1].kind in (MULTIPLE, FILLED),
        f"{own[1].kind}, {own[1].groups} groups of points",
    )
    yield Assertion(
        "η = −24 and −60: simpler than the conventional brake",
        all(own[i].groups < other[i].groups for i in (0, 2)),
        f"{own[0].groups} and {own[2].groups} groups of points against {other[0].groups} and"
        f" {other[2].groups}",
    )


def _slopes_conventional(laboratory: Laboratory, cases: Sequence[Case]) -> Iterator[Assertion]:
    yield _no_sticks(laboratory, cases, "eta")
    yield _two_lines(laboratory, cases, "eta")


def _forces_wedge(laboratory: Laboratory, cases: Sequence[Case]) -> Iterator[Assertion]:
    kinds = [NON_STICK_SLIP, *[BIDIRECTIONAL] * 4, UNIDIRECTIONAL]
    for case, kind in zip(cases, kinds, strict=True):
        yield _kind(laboratory, case, kind, f"F_0 = {case.F0:g}")
    shares = [sticks_of(laboratory, case).shares[2] for case in cases]
    yield Assertion(
        "the larger F_0, the more of the time at rest",
        all(one <= two for one, two in pairwise(shares)),
        ", ".join(percent(share) for share in shares),
    )


def _forces_conventional(laboratory: Laboratory, cases: Sequence[Case]) -> Iterator[Assertion]:
    yield _no_sticks(laboratory, cases, "F0")
    settling = laboratory.steady(cases[3]).velocity
    half = settling.size // 2
    early, late = float(np.ptp(settling[:half])), float(np.ptp(settling[half:]))
    yield Assertion(
        "F_0 = 0.042: the Poincaré points close in on one point",
        late < early,
        f"spread {early:.3g} rad/s in the first half of the last 5 s, {late:.3g} in the second",
    )
    own, other = (_ellipse_error(laboratory, cases[0].at(brake=b)) for b in (CONVENTIONAL, WEDGE))
    yield Assertion(
        "F_0 = 0.015: the Poincaré map is an ellipse, the wedge's is distorted",
        own <= _ELLIPSE < other,
        f"{_distance(own)}, {_distance(other, '')} for the wedge",
    )
    yield _two_lines(laboratory, cases, "F0")


def _frequencies_wedge(laboratory: Laboratory, cases: Sequence[Case]) -> Iterator[Assertion]:
    for index in (0, 1, 3):
        yield _sticking(laboratory, cases[index], f"f = {cases[index].f:.3g}: sticks")
    found = [bands_of(laboratory, case) for case in cases[:3]]
    yield Assertion(
        "side bands disappear gradually towards f = 1, where f_e alone is left",
        found[0].seen > found[1].seen > found[2].seen == 0,
        ", ".join(str(one.seen) for one in found)
        + " lines besides f_e at f = 0.31, 0.63 and 1, with "
        + ", ".join(percent(one.share) for one in found)
        + " of the energy",
    )


def _frequencies_conventional(laboratory: Laboratory, cases: Sequence[Case]) -> Iterator[Assertion]:
    yield _no_sticks(laboratory, cases, "f")
    for case in (cases[1], cases[3]):
        error = _ellipse_error(laboratory, case)
        says = f"f = {case.f:.3g}: a regular Poincaré map with axes of symmetry"
        yield Assertion(says, error <= _REGULAR, _distance(error))
    for case in (cases[2], cases[4]):
        found = bands_of(laboratory, case)
        yield Assertion(
            f"f = {case.f:.3g}: clean spectrum",
            found.beside < laboratory.thresholds.line,
            f"highest line beside f_e {found.beside:.2g} of it, at {found.where:.3g} Hz",
        )


def _angles(laboratory: Laboratory, cases: Sequence[Case]) -> Iterator[Assertion]:
    small, large = cases
    one, two = (bands_of(laboratory, case, natural=True) for case in cases)
    uneven = asymmetry(laboratory.response(large))
    yield _kind(laboratory, small, UNIDIRECTIONAL, "α = 0.68")
    yield Assertion(
        "α = 0.68: many side bands",
        one.seen >= 3,
        f"{one.seen} lines besides f_e and f_n, the highest {one.beside:.2g} of the top",
    )
    yield Assertion(
        "α = 5.20: asymmetric",
        uneven >= laboratory.thresholds.line,
        f"largest speeds of the two directions differ by {100.0 * uneven:.2g} %",
    )
    yield _sticking(laboratory, large, "α = 5.20: some sticking")
    yield Assertion(
        "α = 5.20: spectrum mostly f_n and f_e",
        two.share <= 1.0 - _MOSTLY,
        f"{100.0 * (1.0 - two.share):.3g} % of the energy within 0.5 Hz of them",
    )


def _ellipse_error(laboratory: Laboratory, case: Case) -> float:
    points = laboratory.steady(case)
    return ellipse_error(points.angle, points.velocity)


def _distance(share: float, start: str = "rms distance from the nearest ellipse ") -> str:
    if not math.isfinite(share):
        return "cannot be told: points too far apart"
    return f"{start}{100.0 * share:.2g} % of its size"


CHECKS: dict[str, Check] = {
    "M1": _non_stick_slip,
    "M2": _bidirectional,
    "M3": _unidirectional,
    "M4": _conventional,
    "R1": partial(_of_figure, 9, _slopes_wedge),
    "R2": partial(_of_figure, 10, _slopes_conventional),
    "R3": partial(_of_figure, 12, _forces_wedge),
    "R4": partial(_of_figure, 13, _forces_conventional),
    "R5": partial(_of_figure, 15, _frequencies_wedge),
    "R6": partial(_of_figure, 16, _frequencies_conventional),
    "R7": partial(_of_figure, 18, _angles),
}
