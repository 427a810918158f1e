"""The branches that leave a bifurcation, and those that have already been computed."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from wedgebrake.arrays import FloatArray
from wedgebrake.orbits.bifurcation_types import Kind
from wedgebrake.orbits.curves import OrbitCurve, OrbitSolution
from wedgebrake.orbits.orbit import BranchPoint
from wedgebrake.orbits.palc import FAILED, corrected, newton, null_directions

# Distances from the meeting point, in scaled unknowns, in the order in which they are tried.
_DISTANCES = (3e-3, 1e-3, 1e-2, 3e-4)
SWITCHED = (Kind.PERIOD_DOUBLING, Kind.SYMMETRY_BREAKING, Kind.BRANCH_POINT)
CLOSED = "the branch has closed"
# Poincare points nearer than this share of their size belong to one orbit.
_SAME = 1e-5


class Mark(NamedTuple):
    """An end of a branch. Another branch that arrives there in its direction would retrace it.

    at  : the orbit there
    way : sign of the parameter's change from there into the branch
    why : reason for the end of a branch that arrives there
    """

    at: BranchPoint
    way: float
    why: str


def marks(points: Sequence[BranchPoint], why: str) -> list[Mark]:
    """Both ends of a branch."""
    if len(points) < 2:
        return []
    return [
        Mark(end, way(end, inner), why)
        for end, inner in ((points[0], points[1]), (points[-1], points[-2]))
    ]


def way(first: BranchPoint, second: BranchPoint) -> float:
    """1 where the parameter rises from one point to the other, -1 where it falls, or 0."""
    return float(np.sign(second.value - first.value))


def reached(
    first: BranchPoint, second: BranchPoint, among: Iterable[Mark]
) -> tuple[BranchPoint, str] | None:
    """The mark that a branch passes between two neighbouring points: (orbit there, reason)."""
    for mark in among:
        if mark.way != way(first, second):
            continue
        at = _same_orbit(mark.at.points, mark.at.value, first, second)
        if at is not None:
            return at, mark.why
    return None


def lies_on(points: FloatArray, value: float, branch: Sequence[BranchPoint]) -> bool:
    """Return True if an orbit is on a branch, shifted by any number of returns.

    points : (order, 2) Poincare points of the orbit
    value  : of the parameter
    """
    return any(
        _same_orbit(points, value, first, second) is not None for first, second in pairwise(branch)
    )


def _same_orbit(
    points: FloatArray, value: float, first: BranchPoint, second: BranchPoint
) -> BranchPoint | None:
    """The orbit between two neighbouring points of a branch that equals a given one, or None."""
    low, high = sorted((first.value, second.value))
    if second.order != points.shape[0] or not low <= value <= high:
        return None
    at = _between(first, second, value)
    if at is None or not at.section.same_orbit(at.points, points, _SAME):
        return None
    return at


def _between(first: BranchPoint, second: BranchPoint, value: float) -> BranchPoint | None:
    """The orbit of a branch at a value between two neighbouring points; None: not found."""
    span = second.value - first.value
    share = (value - first.value) / span if span != 0.0 else 1.0
    try:
        curve = OrbitCurve(second)
        guess = curve.scaled(second)
        reach = math.inf
        # Where the segments change, both points are so near that the second serves as a guess.
        if first.equations is second.equations:
            chord = guess - curve.scaled(first)
            guess = guess - (1.0 - share) * chord
            reach = float(np.linalg.norm(chord))
        guess[-1] = value / curve.scales[-1]
        y, _ = newton(curve, guess, np.eye(guess.size)[-1])
        if np.linalg.norm(y - guess) > reach:
            # Not between them: on another branch.
            return None
        arclength = first.arclength + share * (second.arclength - first.arclength)
        at = BranchPoint.of(curve.solution(y), second.direction, arclength)
    except FAILED:
        return None
    return replace(at, values=(value,))


def leaving(point: BranchPoint) -> list[tuple[BranchPoint, BranchPoint]]:
    """The branches that leave a bifurcation, each as its first two points.

    The two halves of a branch of twice the period are one orbit at two times, and those of a
    broken symmetry each other's mirror image: one of them is returned. Empty where nothing
    branches off, or nothing was found.
    """
    bifurcation = point.bifurcation
    if bifurcation is None or bifurcation.kind not in SWITCHED:
        return []
    curve, y, along = _meeting(point, twice=bifurcation.kind is Kind.PERIOD_DOUBLING)
    across = _across(curve, y, along)
    sides = (1.0, -1.0) if bifurcation.kind is Kind.BRANCH_POINT else (1.0,)
    starts = [_start(curve, y, side * across) for side in sides]
    return [start for start in starts if start is not None]


def _meeting(point: BranchPoint, *, twice: bool) -> tuple[OrbitCurve, FloatArray, FloatArray]:
    """The curve on which both branches lie, y there, and the direction of the known branch."""
    moved = point.direction * OrbitCurve(point).scales
    size = point.equations.size
    widened = point.equations.doubled if twice else point.equations.whole
    equations, unknowns = widened(point.unknowns)
    _, further = widened(point.unknowns + moved[:size])
    solution = OrbitSolution(point.problem, point.values, equations, unknowns)
    curve = OrbitCurve(solution)
    along = np.concatenate((further - unknowns, moved[size:])) / curve.scales
    return curve, curve.scaled(solution), along


def _across(curve: OrbitCurve, y: FloatArray, along: FloatArray) -> FloatArray:
    """The direction, normal to the branch, in which a second branch leaves it."""
    _, matrix = curve.linearize(y)
    along = along / np.linalg.norm(along)
    # The parts of the two null directions of the equations that are normal to the branch.
    rest = [row - (row @ along) * along for row in null_directions(matrix)[-2:]]
    across = max(rest, key=lambda row: float(np.linalg.norm(row)))
    return np.asarray(across / np.linalg.norm(across))


def _start(
    curve: OrbitCurve, y: FloatArray, across: FloatArray
) -> tuple[BranchPoint, BranchPoint] | None:
    """The meeting point and the first point beyond it."""
    for distance in _DISTANCES:
        try:
            there = corrected(curve, y + distance * across, across)
            if not curve.solution(there.y).is_orbit:
                continue
        except FAILED:
            continue
        first = BranchPoint.of(curve.solution(y), across)
        return first, BranchPoint.of(curve.solution(there.y), there.direction, distance)
    return None
