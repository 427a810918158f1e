"""Detect orbits and branches that have already been computed."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from wedgebrake.orbits.branch_point import BranchPoint
from wedgebrake.orbits.curves import OrbitCurve
from wedgebrake.orbits.palc import FAILED, newton
from wedgebrake.orbits.section import FloatArray

CLOSED = "the branch has closed"
# Poincare points nearer than this share of their size are those of one orbit.
_SAME = 1e-5


class Mark(NamedTuple):
    """An end of a branch. Another that comes to it in its direction would retrace it.

    at  : the orbit there
    way : sign of the parameter's change from there into the branch
    why : words for the end of a branch that comes to it
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
    """The mark that a branch passes between two neighbouring points: (orbit there, why)."""
    for mark in among:
        if mark.way != way(first, second):
            continue
        at = _same_orbit(mark.at.points, mark.at.value, first, second)
        if at is not None:
            return at, mark.why
    return None


def lies_on(points: FloatArray, value: float, branch: Sequence[BranchPoint]) -> bool:
    """Return True if an orbit is on a branch, at any shift by whole periods of the torque.

    points : (order, 2) Poincare points of the orbit
    value  : of the parameter
    """
    return any(
        _same_orbit(points, value, first, second) is not None for first, second in pairwise(branch)
    )


def _same_orbit(
    points: FloatArray, value: float, first: BranchPoint, second: BranchPoint
) -> BranchPoint | None:
    """The orbit between two neighbouring points of a branch that is a given one; None: none."""
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
        # Where the segments change both are so near that the second serves as a guess.
        if first.equations is second.equations:
            chord = guess - curve.scaled(first)
            guess = guess - (1.0 - share) * chord
            reach = float(np.linalg.norm(chord))
        held = np.zeros(guess.size)
        held[-1] = 1.0
        guess[-1] = value / curve.scales[-1]
        y, _ = newton(curve, guess, held)
        if np.linalg.norm(y - guess) > reach:
            # Not between them: on another branch.
            return None
        arclength = first.arclength + share * (second.arclength - first.arclength)
        at = BranchPoint.of(curve.solution(y), second.direction, arclength)
    except FAILED:
        return None
    return replace(at, values=(value,))
