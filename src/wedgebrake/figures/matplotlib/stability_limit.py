"""The limit of linear stability over two parameters: where the damping of sliding changes sign."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from wedgebrake.analysis.linear_stability import Stability, stability
from wedgebrake.errors import InputError
from wedgebrake.figures.matplotlib import caption, heatmap
from wedgebrake.figures.matplotlib.heatmap import Axis
from wedgebrake.model.study import parse_study
from wedgebrake.model.sweep_settings import INITIAL

if TYPE_CHECKING:
    import xarray as xr


def field(
    dataset: xr.Dataset, x: Axis, y: Axis
) -> tuple[np.ndarray, np.ndarray, np.ndarray] | None:
    """Values along x and y, and over (y, x) what is zero on the limit and positive where stable.

    Out to the edges of the outer cells. Where the dataset tells what machine it is, the limit ends
    where the brake locks itself. None where no limit lies between the points.
    """
    values = heatmap.arranged(dataset["sliding_damping"], x, y)
    judge = _judge(dataset, x, y)
    if judge is not None:
        values = margins(values, lambda up, across: judge(x.values[across], y.values[up]))
    if not np.any(_beside_changes(values)):
        return None
    # On to the edges of the outer cells, as a contour ends at the last points.
    for one, along in ((y, 0), (x, 1)):
        values = heatmap.to_edges(values, one, along)
    xs, ys = (np.concatenate((a.edges[:1], a.values, a.edges[-1:])) for a in (x, y))
    return xs, ys, values


def margins(damping: np.ndarray, judge: Callable[[int, int], Stability | None]) -> np.ndarray:
    """The margin in the slope about changes of the damping's sign, nan elsewhere.

    judge : the linear verdict at a row and a column, None where there is none

    Towards self-locking the damping grows without bound, and the smaller of both directions has a
    kink; the margin, which has its sign, is smooth. Where the brake locks itself both jump to
    those of backward sliding, without a zero: nan there. The damping itself is used if one of the
    points has no margin, for example if the brake is released at the speed of the shaft.
    """
    chosen = _widened(_beside_changes(damping)) & np.isfinite(damping)
    sliding, found = damping.copy(), np.full(damping.shape, np.nan)
    for place in np.argwhere(chosen):
        up, across = int(place[0]), int(place[1])
        one = judge(up, across)
        if one is not None and one.forward.locked:
            sliding[up, across] = np.nan
        elif one is not None and one.margin_slope is not None:
            found[up, across] = one.margin_slope
    chosen &= np.isfinite(sliding)
    alike = np.isfinite(found) & ((found > 0.0) == (sliding > 0.0))
    return found if np.all(alike[chosen]) else sliding


def _beside_changes(values: np.ndarray) -> np.ndarray:
    """Points with a neighbour along either parameter of the other sign."""
    beside = np.zeros(values.shape, dtype=bool)
    known, stable = np.isfinite(values), values > 0.0
    for along in (0, 1):
        one, other = (
            tuple(part if axis == along else slice(None) for axis in (0, 1))
            for part in (slice(None, -1), slice(1, None))
        )
        changes = known[one] & known[other] & (stable[one] != stable[other])
        beside[one] |= changes
        beside[other] |= changes
    return beside


def _widened(chosen: np.ndarray) -> np.ndarray:
    """Chosen points and their neighbours, across corners too."""
    padded = np.pad(chosen, 1)
    rows = padded[:-2] | padded[1:-1] | padded[2:]
    wide: np.ndarray = rows[:, :-2] | rows[:, 1:-1] | rows[:, 2:]
    return wide


def _judge(
    dataset: xr.Dataset, x: Axis, y: Axis
) -> Callable[[float, float], Stability | None] | None:
    """The linear verdict at values of x and y; None where the dataset does not tell the machine."""
    try:
        tables = dict(json.loads(dataset.attrs["system"]))
        # Sliding does not depend on it, and where it followed the kinetic one it does so still.
        friction = {key: one for key, one in tables["friction"].items() if key != "static"}
        system = parse_study({**tables, "friction": friction}).system
    except (AttributeError, KeyError, TypeError, ValueError):  # an InputError is a ValueError
        return None
    fixed = {name: float(dataset[name]) for name in caption.fixed(dataset)}

    def judge(across: float, up: float) -> Stability | None:
        values = {**fixed, x.name: across, y.name: up}
        changes = {caption.swept_name(n): value for n, value in values.items() if n not in INITIAL}
        try:
            return stability(system.replace(**changes))
        except InputError:
            return None

    return judge
