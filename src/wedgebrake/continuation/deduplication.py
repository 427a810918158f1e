"""Whether an orbit, or a branch, is on a branch that is there already."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from wedgebrake.continuation.curves import OrbitCurve
from wedgebrake.continuation.equations import FloatArray, NoOrbitError, multipliers
from wedgebrake.continuation.palc import NotConvergedError, newton
from wedgebrake.continuation.point import BranchPoint
from wedgebrake.continuation.symmetry import alike

CLOSED = "the branch has closed"
# Poincare points nearer than this share of their size are those of one orbit.
_SAME = 1e-5


class Mark(NamedTuple):
    """An end of a branch: another that comes to it, and goes its way, goes over that one.

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
    """The mark that a branch comes to between two neighbouring points: (orbit there, why)."""
    for mark in among:
        if mark.way != way(first, second):
            continue
        at = _same(mark.at.points, mark.at.value, first, second)
        if at is not None:
            return at, mark.why
    return None


def lies_on(points: FloatArray, value: float, branch: Sequence[BranchPoint]) -> bool:
    """Whether an orbit is on a branch, at any shift by whole periods of the torque.

    points : (order, 2) Poincare points of the orbit
    value  : of the parameter
    """
    return any(
        _same(points, value, first, second) is not None for first, second in pairwise(branch)
    )


def _same(
    points: FloatArray, value: float, first: BranchPoint, second: BranchPoint
) -> BranchPoint | None:
    """The orbit between two neighbouring points of a branch that is a given one; None: none."""
    low, high = sorted((first.value, second.value))
    if second.order != points.shape[0] or not low <= value <= high:
        return None
    at = _between(first, second, value)
    if at is None:
        return None
    omega = at.system.excitation.angular_frequency
    return at if alike(at.points, points, omega, _SAME) else None


def _between(first: BranchPoint, second: BranchPoint, value: float) -> BranchPoint | None:
    """The orbit of a branch at a value between two neighbouring points; None: not found."""
    span = second.value - first.value
    share = (value - first.value) / span if span != 0.0 else 1.0
    try:
        curve = OrbitCurve.through(second.equations, second.family, second.unknowns, second.values)
        guess = curve.scaled(second.unknowns, second.values)
        room = math.inf
        # Where the chain of pieces changes both are so near that the second serves as a guess.
        if first.equations is second.equations:
            chord = guess - curve.scaled(first.unknowns, first.values)
            guess = guess - (1.0 - share) * chord
            room = float(np.linalg.norm(chord))
        held = np.zeros(guess.size)
        held[-1] = 1.0
        guess[-1] = value / curve.scales[-1]
        y, _ = newton(curve, guess, held)
        if np.linalg.norm(y - guess) > room:
            # Not between them: on another branch.
            return None
        found = multipliers(*curve.invariants(y))
    except (NotConvergedError, NoOrbitError):
        return None
    return replace(
        second,
        values=(value,),
        unknowns=curve.unscaled(y)[0],
        multipliers=found,
        arclength=first.arclength + share * (second.arclength - first.arclength),
        bifurcation=None,
    )
