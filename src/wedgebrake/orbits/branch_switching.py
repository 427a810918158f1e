"""Branch switching: the branches that leave a point where branches meet."""

from __future__ import annotations

import numpy as np

from wedgebrake.orbits.bifurcation_types import Kind
from wedgebrake.orbits.branch_point import BranchPoint
from wedgebrake.orbits.curves import OrbitCurve, OrbitSolution
from wedgebrake.orbits.palc import FAILED, corrected
from wedgebrake.orbits.section import FloatArray
from wedgebrake.orbits.shooting import is_orbit

# Distances from the meeting point, in scaled unknowns, in the order in which they are tried.
_DISTANCES = (3e-3, 1e-3, 1e-2, 3e-4)
SWITCHED = (Kind.PERIOD_DOUBLING, Kind.SYMMETRY_BREAKING, Kind.BRANCH_POINT)


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
    """The direction, square to the branch, in which a second one leaves it."""
    _, matrix = curve.linearize(y)
    sizes = np.max(np.abs(matrix), axis=1)
    _, _, rows = np.linalg.svd(matrix / np.where(sizes > 0.0, sizes, 1.0)[:, None])
    along = along / np.linalg.norm(along)
    # The parts of the two null directions of the equations that are square to the branch.
    rest = [row - (row @ along) * along for row in rows[-2:]]
    across = max(rest, key=lambda row: float(np.linalg.norm(row)))
    return np.asarray(across / np.linalg.norm(across))


def _start(
    curve: OrbitCurve, y: FloatArray, across: FloatArray
) -> tuple[BranchPoint, BranchPoint] | None:
    """The meeting point and the first one beyond it."""
    for distance in _DISTANCES:
        try:
            there = corrected(curve, y + distance * across, across)
            if not is_orbit(curve.solution(there.y)):
                continue
        except FAILED:
            continue
        first = BranchPoint.of(curve.solution(y), across)
        return first, BranchPoint.of(curve.solution(there.y), there.direction, distance)
    return None
