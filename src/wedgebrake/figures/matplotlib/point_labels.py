"""Letters beside points of a picture, clear of its curves and of each other."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from wedgebrake.figures.matplotlib import style

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# Distances of letters from their point that are tried; beyond the next a line leads there.
_DISTANCES, _NEAR = (7.0, 10.0, 14.0, 19.0, 25.0, 32.0), 12.0
_TURNS = np.deg2rad(np.arange(90.0, 450.0, 22.5))
# Of a label that has many points about so many are tried, evenly chosen.
_TRIED = 8
# Half the width of a letter and half the height of letters, with what they keep free about them;
# what a symbol takes up about its point; steps along curves. All in points, 1/72 inch.
_HALF_LETTER, _HALF_HEIGHT, _ROOM = 0.34 * style.SMALL, 0.39 * style.SMALL, 1.0
_SYMBOL, _STEP = 2.8, 1.5
# Points closer than this are one [pt].
_TIE = 0.5


def draw(
    axes: Axes, labels: Sequence[tuple[str, np.ndarray]], curves: Sequence[np.ndarray]
) -> None:
    """Write each label beside one of its points, in the first place that is free.

    labels : letters, and the points (n, 2) that they may stand at, the most important first
    curves : points along each, (n, 2), NaN where it is interrupted

    A label that finds no free place is left out. Axes must be final, in place and limits.
    """
    box = np.reshape(axes.bbox.extents, (2, 2)) * _points_per_pixel(axes)
    anchors = [_inside(_places(axes, points), box) for _, points in labels]
    taken = np.concatenate(
        [_dense(_places(axes, curve), box) for curve in curves] or [np.empty((0, 2))]
    )
    symbols = np.concatenate([*anchors, np.empty((0, 2))])
    owner = np.repeat(np.arange(len(anchors)), [len(points) for points in anchors])
    centres, halves = np.empty((0, 2)), np.empty((0, 2))
    for number, (letters, _) in enumerate(labels):
        others = symbols[owner != number]
        half = np.array([_HALF_LETTER * len(letters), _HALF_HEIGHT]) + _ROOM
        for point, centre in _choices(anchors[number]):
            if (
                np.all((centre - half > box[0]) & (centre + half < box[1]))
                and _clear(centre, centres, half + halves)
                and _clear(centre, symbols, half + _SYMBOL)
                and _clear(centre, taken, half)
                and _plain(point, centre, others)
            ):
                centres, halves = np.vstack((centres, centre)), np.vstack((halves, half))
                _write(axes, letters, point, centre)
                break


def _points_per_pixel(axes: Axes) -> float:
    figure: Any = axes.get_figure()
    return float(72.0 / figure.dpi)


def _places(axes: Axes, values: np.ndarray) -> np.ndarray:
    """Values (n, 2) of the axes as places on the page [pt]."""
    places: np.ndarray = axes.transData.transform(values) * _points_per_pixel(axes)
    return places


def _inside(places: np.ndarray, box: np.ndarray) -> np.ndarray:
    """Those places that lie within a box, its corners (2, 2)."""
    inside: np.ndarray = places[np.all((places >= box[0]) & (places <= box[1]), axis=1)]
    return inside


def _dense(places: np.ndarray, box: np.ndarray) -> np.ndarray:
    """Places along a curve, none farther than a step from the next, those near a box."""
    # What lies far outside is drawn nearer: steps to it would be without number.
    places = np.clip(places, box[0] - 2.0 * _STEP, box[1] + 2.0 * _STEP)
    lengths = np.hypot(*np.diff(places, axis=0).T)
    parts = [
        np.linspace(first, last, int(length / _STEP) + 2)
        for first, last, length in zip(places[:-1], places[1:], lengths, strict=True)
        if np.isfinite(length)
    ]
    return np.concatenate([*parts, np.empty((0, 2))])


def _choices(points: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
    """Points with the places beside them that are tried, the nearest first."""
    chosen = points[:: max(1, len(points) // _TRIED)]
    return [
        (point, point + far * np.array([np.cos(turn), np.sin(turn)]))
        for far in _DISTANCES
        for turn in _TURNS
        for point in chosen
    ]


def _clear(centre: np.ndarray, others: np.ndarray, room: np.ndarray) -> bool:
    """Whether a place keeps its distance from all others, across or up."""
    return bool(np.all(np.any(np.abs(others - centre) >= room, axis=1)))


def _plain(point: np.ndarray, centre: np.ndarray, others: np.ndarray) -> bool:
    """Whether letters are seen to belong to their point: by a line, or as none is nearer."""
    far = float(np.hypot(*(centre - point)))
    return far > _NEAR or bool(np.all(np.hypot(*(others - centre).T) > far - _TIE))


def _write(axes: Axes, letters: str, point: np.ndarray, centre: np.ndarray) -> None:
    """Letters at a place [pt], with a line to their point if it is far."""
    from matplotlib.patheffects import withStroke

    ring = [withStroke(linewidth=1.6, foreground="white")]
    shift = centre - point
    x, y = axes.transData.inverted().transform(point / _points_per_pixel(axes))
    far = float(np.hypot(*shift)) > _NEAR
    line = {"arrowstyle": "-", "linewidth": 0.4, "shrinkA": 0.0, "shrinkB": 2.0}
    label = axes.annotate(
        letters,
        (x, y),
        xytext=(float(shift[0]), float(shift[1])),
        textcoords="offset points",
        ha="center",
        va="center_baseline",
        fontsize=style.SMALL,
        path_effects=ring,
        arrowprops={**line, "relpos": (0.5, 0.5)} if far else None,
        zorder=5.0,
    )
    label.set_in_layout(False)
