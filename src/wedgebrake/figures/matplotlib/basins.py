"""Basins of attraction: which start leads to which steady motion."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from wedgebrake.dynamics.enums import MotionClass
from wedgebrake.errors import InputError
from wedgebrake.figures.matplotlib import caption, class_styles, heatmap, style
from wedgebrake.figures.matplotlib.heatmap import Axis
from wedgebrake.figures.matplotlib.layout import HIGHEST, page

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Codes of points without an attractor.
_OUTCOMES = {
    -1: class_styles.MOTIONS["undecided"],
    -2: class_styles.MOTIONS["diverged"],
    -3: class_styles.MOTIONS["self_locked"],
    -4: class_styles.MOTIONS["not_computed"],
}
_NEEDED = (
    "attractor",
    "attractor_motion",
    "attractor_order",
    "attractor_share",
    "attractor_angle",
    "attractor_velocity",
)
# An attractor of more points is drawn in smaller ones [pt].
_MANY, _SIZE, _SMALLER = 16, 3.2, 1.6
# Distances of a number from its point that are tried, and what it keeps from points and from
# other numbers, across and up [pt].
_DISTANCES = (6.0, 12.0, 20.0, 30.0, 42.0)
_FROM_POINTS, _FROM_NUMBERS = np.array([5.5, 5.0]), np.array([10.0, 9.0])


def basins(dataset: xr.Dataset, *, width: float = style.COLUMN) -> Figure:
    """Basins over the angle [rad] and velocity [rad/s] at the start: a new figure.

    dataset : as ``wb.basins`` gives it
    width   : of the figure [inch]; a journal's column is 3.5, its page 7.2

    Attractors are numbered by their share of all starts. Each has a colour, its basin, and
    circles, its Poincare points: states at the same phase of the torque as the start. The
    legend tells the period of its motion. Beyond the twentieth they have one colour
    together.

    Raises ``InputError`` for a dataset that has no basins.
    """
    _check(dataset)
    with style.use():
        rows, legends = [min(0.75 * width, HIGHEST)], [("", _entries(dataset))]
        sentences = caption.about(dataset, heatmap.swept(dataset, 2))
        with page(width, rows, legends, sentences) as (figure, grid):
            draw(figure.add_subplot(grid[0]), dataset)
        return figure


def draw(axes: Axes, dataset: xr.Dataset) -> None:
    """The same on axes of your own, without legend."""
    _check(dataset)
    x, y = (heatmap.axis(dataset, name) for name in heatmap.swept(dataset, 2))
    codes, table = _codes(dataset)
    class_styles.hatching(axes)
    heatmap.set_axes(axes, x, y)
    heatmap.draw_classes(axes, x, y, heatmap.arranged(codes, x, y), table)
    _mark(axes, dataset, x, y)


def _check(dataset: Any) -> None:
    """Refuse a dataset without attractors."""
    names = heatmap.swept(dataset, 2)
    missing = [name for name in _NEEDED if name not in dataset.data_vars]
    if missing:
        raise InputError(
            f"dataset: has no {missing[0]}, so there are no basins to draw. Use the result of"
            " wb.basins(...); for another sweep over two parameters use"
            " wedgebrake.figures.matplotlib.regime.regime_map."
        )
    if set(names) != {"initial_angle", "initial_velocity"}:
        raise InputError(
            f"dataset: is swept over {', '.join(names)}, but basins need initial_angle and"
            " initial_velocity. Use the result of wb.basins(...)."
        )


def _ranking(dataset: xr.Dataset) -> np.ndarray:
    """Attractors by falling share."""
    order: np.ndarray = np.argsort(-dataset["attractor_share"].to_numpy(), kind="stable")
    return order


def _codes(dataset: xr.Dataset) -> tuple[xr.DataArray, list[class_styles.Look]]:
    """The class of each start: its place among the looks that are returned with it."""
    ranking, given = _ranking(dataset), dataset["attractor"]
    most = len(class_styles.ATTRACTORS)
    table = [
        class_styles.Look(f"{place}: {_motion(dataset, int(place))}", colour)
        for place, colour in zip(ranking[:most], class_styles.ATTRACTORS, strict=False)
    ]
    rank = np.empty(ranking.size, dtype=np.int64)
    rank[ranking] = np.minimum(np.arange(ranking.size), most)
    if ranking.size > most:
        table.append(class_styles.Look(f"{ranking.size - most} others", class_styles.OTHERS))
    first = len(table)
    table += _OUTCOMES.values()
    values = given.to_numpy()
    codes = np.full(values.shape, first, dtype=np.int16)  # undecided, for any other number
    known = (values >= 0) & (values < ranking.size)
    codes[known] = rank[values[known]]
    for place, outcome in enumerate(_OUTCOMES):
        codes[values == outcome] = first + place
    return given.copy(data=codes), table


def _motion(dataset: xr.Dataset, place: int) -> str:
    """An attractor in words."""
    motion = int(dataset["attractor_motion"].to_numpy()[place])
    order = int(dataset["attractor_order"].to_numpy()[place])
    if motion == MotionClass.SYNCHRONOUS:
        return class_styles.period(1)
    if motion == MotionClass.PERIODIC and order > 0:
        return class_styles.period(order)
    return MotionClass(motion).word if motion in set(MotionClass) else "?"


def _mark(axes: Axes, dataset: xr.Dataset, x: Axis, y: Axis) -> None:
    """The Poincare points of the attractors, those inside the picture, and their numbers."""
    ranking = _ranking(dataset)[: len(class_styles.ATTRACTORS)]
    orbits = [_visible(dataset, x, y, int(place)) for place in ranking]
    for (across, up), colour in zip(orbits, class_styles.ATTRACTORS, strict=False):
        size = _SMALLER if across.size > _MANY else _SIZE
        # Ringed in white: an attractor lies in its own basin, of the same colour.
        for width, face, edge in ((size + 1.8, "white", "white"), (size, colour, "black")):
            axes.plot(
                across,
                up,
                linestyle="none",
                marker="o",
                markersize=width,
                markerfacecolor=face,
                markeredgecolor=edge,
                markeredgewidth=0.5,
                zorder=4.0,
            )
    scale = _points_per_share(axes)
    shares = [np.stack([_share(across, x), _share(up, y)], axis=1) * scale for across, up in orbits]
    for place, orbit, where in zip(ranking, orbits, _label(shares), strict=True):
        if where is not None:
            point, shift = where
            _number(axes, int(place), (orbit[0][point], orbit[1][point]), shift)


def _visible(dataset: xr.Dataset, x: Axis, y: Axis, place: int) -> tuple[np.ndarray, np.ndarray]:
    """Points of an attractor along both axes, those inside the picture."""
    points = {
        f"initial_{name}": dataset[f"attractor_{name}"].to_numpy()[place]
        for name in ("angle", "velocity")
    }
    across, up = points[x.name], points[y.name]
    # Comparisons with the padding, NaN, are false.
    seen = (across >= x.edges[0]) & (across <= x.edges[-1])
    seen &= (up >= y.edges[0]) & (up <= y.edges[-1])
    return across[seen], up[seen]


def _share(values: np.ndarray, one: Axis) -> np.ndarray:
    """Values as shares of the length of an axis."""
    ends = one.ends()
    share: np.ndarray = (one.places(values) - ends[0]) / (ends[1] - ends[0])
    return share


def _points_per_share(axes: Axes) -> np.ndarray:
    """Width and height of the axes [pt], before the layout is final."""
    box = axes.get_position()
    figure: Any = axes.get_figure()
    size: np.ndarray = 72.0 * figure.get_size_inches() * np.array([box.width, box.height])
    return size


def _label(orbits: list[np.ndarray]) -> list[tuple[int, np.ndarray] | None]:
    """For each attractor the point that gets its number and the number's shift [pt].

    orbits : places of the visible points [pt], (points, 2) each

    The first place that is clear of all points and of the numbers before it; if there is
    none, the last one tried.
    """
    points = np.concatenate([*orbits, np.empty((0, 2))])
    numbers = np.empty((0, 2))
    found: list[tuple[int, np.ndarray] | None] = []
    turns = np.deg2rad(np.arange(90.0, 450.0, 45.0))
    shifts = [far * np.array([np.cos(turn), np.sin(turn)]) for far in _DISTANCES for turn in turns]
    for orbit in orbits:
        choices = [(place, shift) for shift in shifts for place in range(min(len(orbit), _MANY))]
        best = None
        for place, shift in choices:
            best = place, shift
            at = orbit[place] + shift
            if _clear(at, points, _FROM_POINTS) and _clear(at, numbers, _FROM_NUMBERS):
                break
        if best is not None:
            numbers = np.vstack((numbers, orbit[best[0]] + best[1]))
        found.append(best)
    return found


def _clear(place: np.ndarray, others: np.ndarray, room: np.ndarray) -> bool:
    """Whether a place keeps its distance from all others, across or up."""
    return bool(np.all(np.any(np.abs(others - place) > room, axis=1)))


def _number(axes: Axes, number: int, point: tuple[float, float], shift: np.ndarray) -> None:
    """The number of an attractor beside one of its points, with a line if it is far."""
    from matplotlib.patheffects import withStroke

    ring = [withStroke(linewidth=1.8, foreground="white")]
    far = float(np.hypot(*shift)) > _DISTANCES[0]
    line = {"arrowstyle": "-", "linewidth": 0.5, "shrinkA": 3.0, "shrinkB": 1.5}
    axes.annotate(
        str(number),
        point,
        xytext=(float(shift[0]), float(shift[1])),
        textcoords="offset points",
        ha="center",
        va="center",
        fontsize=style.SMALL,
        path_effects=ring,
        arrowprops={**line, "path_effects": ring} if far else None,
        zorder=5.0,
    )


def _entries(dataset: xr.Dataset) -> list[Any]:
    """The legend: attractors with their motion and share, other outcomes, the marks."""
    from matplotlib.lines import Line2D

    codes, table = _codes(dataset)
    entries = class_styles.present(codes.to_numpy(), table, shares=True)
    if dataset.sizes["attractor_id"]:
        entries.append(
            Line2D(
                [],
                [],
                linestyle="none",
                marker="o",
                markersize=_SIZE,
                markerfacecolor="white",
                markeredgecolor="black",
                markeredgewidth=0.6,
                label="points of attractors",
            )
        )
    return entries
