"""Labels beside points of a picture, clear of its curves and of each other."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from wedgebrake.figures.matplotlib import style

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# Distances of labels from their point [pt]; beyond the next value a line leads to the point.
_DISTANCES, _NEAR = (7.0, 10.0, 14.0, 19.0, 25.0, 32.0), 12.0
_TURNS = np.deg2rad(np.arange(90.0, 450.0, 22.5))
# For a label with many points, approximate number of points tried, evenly spaced.
_TRIED = 8
# Half the width of a letter and half the height of letters, and the clearance about them;
# half the size of a symbol; steps along curves. All in points, 1/72 inch.
_HALF_LETTER, _HALF_HEIGHT, _CLEARANCE = 0.34 * style.SMALL, 0.39 * style.SMALL, 1.0
_SYMBOL, _STEP = 2.8, 1.5
# Points closer than this count as one [pt].
_TIE = 0.5


def draw(
    axes: Axes,
    labels: Sequence[tuple[str, np.ndarray]],
    curves: Sequence[np.ndarray],
    *,
    force: bool = False,
) -> None:
    """Write each label beside one of its points, in the first free place.

    labels : letters and their possible points (n, 2), the most important first
    curves : points along each, (n, 2), NaN where it is interrupted
    force  : write labels without a free place too, at the last place tried

    The axes must have their final position and limits.
    """
    box = np.reshape(axes.bbox.extents, (2, 2)) * _points_per_pixel(axes)
    anchors = [_on_page(axes, points) for _, points in labels]
    anchors = [one[np.all((one >= box[0]) & (one <= box[1]), axis=1)] for one in anchors]
    taken = np.concatenate(
        [_dense(_on_page(axes, curve), box) for curve in curves] or [np.empty((0, 2))]
    )
    symbols = np.concatenate([*anchors, np.empty((0, 2))])
    owner = np.repeat(np.arange(len(anchors)), [len(points) for points in anchors])
    centres, halves = np.empty((0, 2)), np.empty((0, 2))
    for number, (letters, _) in enumerate(labels):
        others = symbols[owner != number]
        half = style.points(1.0) * np.array([_HALF_LETTER * len(letters), _HALF_HEIGHT])
        half += _CLEARANCE
        choices = _choices(anchors[number])
        for tried, (point, centre) in enumerate(choices, start=1):
            if (force and tried == len(choices)) or (
                np.all((centre - half > box[0]) & (centre + half < box[1]))
                and _clear(centre, centres, half + halves)
                and _clear(centre, symbols, half + _SYMBOL)
                and _clear(centre, taken, half)
                and _unambiguous(point, centre, others)
            ):
                centres, halves = np.vstack((centres, centre)), np.vstack((halves, half))
                _write(axes, letters, point, centre)
                break


def _on_page(axes: Axes, values: np.ndarray) -> np.ndarray:
    """Points (n, 2) of the axes as positions on the page [pt]."""
    positions: np.ndarray = axes.transData.transform(values) * _points_per_pixel(axes)
    return positions


def _points_per_pixel(axes: Axes) -> float:
    figure: Any = axes.get_figure()
    return float(72.0 / figure.dpi)


def _dense(positions: np.ndarray, box: np.ndarray) -> np.ndarray:
    """Positions along a curve near a box, one step apart or less."""
    # Points far outside are moved closer, to limit the number of steps.
    positions = np.clip(positions, box[0] - 2.0 * _STEP, box[1] + 2.0 * _STEP)
    lengths = np.hypot(*np.diff(positions, axis=0).T)
    parts = [
        np.linspace(first, last, int(length / _STEP) + 2)
        for first, last, length in zip(positions[:-1], positions[1:], lengths, strict=True)
        if np.isfinite(length)
    ]
    return np.concatenate([*parts, np.empty((0, 2))])


def _choices(points: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
    """Points with positions of labels beside them, the nearest first."""
    chosen = points[:: max(1, len(points) // _TRIED)]
    return [
        (point, point + far * np.array([np.cos(turn), np.sin(turn)]))
        for far in _DISTANCES
        for turn in _TURNS
        for point in chosen
    ]


def _clear(centre: np.ndarray, others: np.ndarray, distance: np.ndarray) -> bool:
    """Return True if all others are at least a distance away, across or up."""
    return bool(np.all(np.any(np.abs(others - centre) >= distance, axis=1)))


def _unambiguous(point: np.ndarray, centre: np.ndarray, others: np.ndarray) -> bool:
    """Return True if a line leads to the point, or no other point is nearer."""
    far = float(np.hypot(*(centre - point)))
    return far > _NEAR or bool(np.all(np.hypot(*(others - centre).T) > far - _TIE))


def _write(axes: Axes, letters: str, point: np.ndarray, centre: np.ndarray) -> None:
    from matplotlib.patheffects import withStroke

    ring = [withStroke(linewidth=1.6, foreground="white")]
    shift = centre - point
    x, y = axes.transData.inverted().transform(point / _points_per_pixel(axes))
    far = float(np.hypot(*shift)) > _NEAR
    line = {"arrowstyle": "-", "linewidth": 0.4, "shrinkA": 0.0, "shrinkB": 2.0}
    look = {"ha": "center", "va": "center_baseline", "zorder": 5.0}
    arrow = {**line, "relpos": (0.5, 0.5)} if far else None
    more = {"path_effects": ring, "arrowprops": arrow}
    label = style.write(axes, letters, (x, y), tuple(shift.tolist()), "data", **look, **more)
    label.set_in_layout(False)
