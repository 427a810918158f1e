"""The limit of linear stability as a line over two parameters."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from wedgebrake.analysis.linear_stability import Stability, sliding_damping, stability
from wedgebrake.errors import InputError
from wedgebrake.explorer.core import cells
from wedgebrake.explorer.core.axis import Axis
from wedgebrake.figures.matplotlib.stability_limit import margins
from wedgebrake.model.system import BrakedDriveline

FloatArray = NDArray[np.float64]

# Iterations that find a point of the line between two points of the grid.
_HALVINGS = 10


def stability_limit(
    system: BrakedDriveline, x: Axis, y: Axis, places: tuple[FloatArray, FloatArray],
    damping: FloatArray,
) -> list[cells.Line]:  # fmt: skip
    """Lines on which the damping of sliding is zero, in places.

    places  : along x and y of the points at which the damping is known
    damping : of sliding, the smaller of both directions, (along y, along x)

    The smaller of two dampings has a kink, often near its zero: what the grid tells is made
    exact. Lines end at the outermost points, and where the brake locks itself.
    """

    def machine(across: float, up: float) -> BrakedDriveline:
        return system.replace(**{x.name: x.value(across), y.name: y.value(up)})

    def judged(row: int, column: int) -> Stability | None:
        try:
            return stability(machine(xs[column], ys[row]))
        except InputError:
            return None

    def at(across: float, up: float) -> float:
        try:
            return sliding_damping(machine(across, up))
        except InputError:
            return math.nan

    xs, ys = places
    damping = margins(damping, judged)
    found = []
    for across, up in cells.lines(xs, ys, damping, 0.0):
        line = [_exact(at, xs, ys, *point) for point in zip(across, up, strict=True)]
        found.append(([one for one, _ in line], [one for _, one in line]))
    return found


def _exact(
    at: Callable[[float, float], float], xs: FloatArray, ys: FloatArray, across: float, up: float
) -> tuple[float, float]:
    """The point of the line on that edge of the grid on which a point of a contour lies."""
    if np.min(np.abs(xs - across)) > 1e-9 * np.ptp(xs):
        return _zero(lambda one: at(one, up), xs, across), up
    return across, _zero(lambda one: at(across, one), ys, up)


def _zero(damping: Callable[[float], float], nodes: FloatArray, near: float) -> float:
    """Where the damping is zero between the two nodes about a place, by halving."""
    last = int(np.clip(np.searchsorted(nodes, near), 1, nodes.size - 1))
    low, high = float(nodes[last - 1]), float(nodes[last])
    below = damping(low) > 0.0
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if (damping(middle) > 0.0) == below else (low, middle)
    return 0.5 * (low + high)
