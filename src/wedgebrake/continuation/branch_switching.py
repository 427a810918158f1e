"""From a point where branches meet to the branches that leave it."""

from __future__ import annotations

import numpy as np

from wedgebrake.continuation.bifurcation_types import Kind
from wedgebrake.continuation.curves import OrbitCurve
from wedgebrake.continuation.equations import FloatArray, NoOrbitError, multipliers
from wedgebrake.continuation.palc import NotConvergedError, newton, tangent
from wedgebrake.continuation.point import BranchPoint
from wedgebrake.continuation.shooting import is_orbit

# Distances from the meeting point, in scaled unknowns, in the order in which they are tried.
_DISTANCES = (3e-3, 1e-3, 1e-2, 3e-4)
SWITCHED = (Kind.PERIOD_DOUBLING, Kind.SYMMETRY_BREAKING, Kind.BRANCH_POINT)


def leaving(point: BranchPoint) -> list[tuple[BranchPoint, BranchPoint]]:
    """The branches that leave a bifurcation, each as its first two points.

    The two halves of a branch of twice the period are one orbit at two times, and those of a
    broken symmetry each other's mirror image: one of them is given. Empty where nothing
    branches off, or nothing was found.
    """
    bifurcation = point.bifurcation
    if bifurcation is None or bifurcation.kind not in SWITCHED:
        return []
    curve, unknowns, along = _met(point, twice=bifurcation.kind is Kind.PERIOD_DOUBLING)
    y = curve.scaled(unknowns, point.values)
    across = _across(curve, y, along)
    sides = (1.0, -1.0) if bifurcation.kind is Kind.BRANCH_POINT else (1.0,)
    starts = [_start(point, curve, y, side * across) for side in sides]
    return [start for start in starts if start is not None]


def _met(point: BranchPoint, *, twice: bool) -> tuple[OrbitCurve, FloatArray, FloatArray]:
    """The curve that both branches lie on, unknowns there, and the direction of the known one."""
    own = OrbitCurve.through(point.equations, point.family, point.unknowns, point.values)
    size = point.equations.size
    moved = point.direction * own.scales
    widened = point.equations.doubled if twice else point.equations.whole
    equations, unknowns = widened(point.unknowns)
    _, further = widened(point.unknowns + moved[:size])
    curve = OrbitCurve.through(equations, point.family, unknowns, point.values)
    along = np.concatenate((further - unknowns, moved[size:])) / curve.scales
    return curve, unknowns, along


def _across(curve: OrbitCurve, y: FloatArray, along: FloatArray) -> FloatArray:
    """The direction, square to the branch, in which a second one leaves it."""
    _, matrix = curve.linearize(y)
    sizes = np.max(np.abs(matrix), axis=1)
    _, _, rows = np.linalg.svd(matrix / np.where(sizes > 0.0, sizes, 1.0)[:, None])
    along = along / np.linalg.norm(along)
    # Of the two directions in which the equations hold, what is left without the branch's own.
    rest = [row - (row @ along) * along for row in rows[-2:]]
    across = max(rest, key=lambda row: float(np.linalg.norm(row)))
    return np.asarray(across / np.linalg.norm(across))


def _start(
    point: BranchPoint, curve: OrbitCurve, y: FloatArray, across: FloatArray
) -> tuple[BranchPoint, BranchPoint] | None:
    """The meeting point and the first one beyond it."""
    for distance in _DISTANCES:
        try:
            there, matrix = newton(curve, y + distance * across, across)
            direction = tangent(matrix, across)
            unknowns, values = curve.unscaled(there)
            if not is_orbit(curve.equations, unknowns, point.family.problem(values)):
                continue
        except (NotConvergedError, NoOrbitError):
            continue
        first = _point(point, curve, y, across, 0.0)
        return first, _point(point, curve, there, direction, distance)
    return None


def _point(
    point: BranchPoint, curve: OrbitCurve, y: FloatArray, direction: FloatArray, length: float
) -> BranchPoint:
    unknowns, values = curve.unscaled(y)
    return BranchPoint(
        family=point.family,
        values=values,
        equations=curve.equations,
        unknowns=unknowns,
        multipliers=multipliers(*curve.invariants(y)),
        direction=direction,
        arclength=length,
    )
