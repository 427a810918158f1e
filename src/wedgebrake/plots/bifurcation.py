"""The bifurcation diagram: Poincare points of a sweep over one parameter, and what they are."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from wedgebrake.errors import InputError, nearest
from wedgebrake.plots import regime, style
from wedgebrake.plots.regime import Axis

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

QUANTITIES = {
    "velocity": r"velocity $\dot\theta_n$  [rad/s]",
    "angle": r"angle $\theta_n$  [rad]",
}

_STICKS = tuple(style.STICK_CLASSES.values())
_SHADE = "Shade: share of the points of a parameter, logarithmic."

# Sizes [inch]: margins beside the axes together; label and ticks of the parameter with what
# lies between panels; one row of a strip; the exponents.
_MARGINS, _BETWEEN = 0.85, 0.75
_ROW = 0.13
_EXPONENT = 0.95
# Height of a cell of the density [pt]; parameters closer than the second become cells too,
# others marks of at most the third.
_CELL, _CLOSE, _MARK = 0.7, 2.2, 1.9
# A motion is named inside the strip where it is so wide [pt] for each character.
_CHARACTER = 4.6
# Periodic motions on two branches differ from this share of the picture's height on.
_DIFFERS = 0.02
# The picture's height is at least this share of the largest value: rounding is no scatter.
_LEAST = 0.02


def bifurcation(
    dataset: xr.Dataset,
    quantity: str = "velocity",
    *,
    exponent: bool | None = None,
    width: float = style.PAGE,
) -> Figure:
    """Poincare points against the parameter, with their classes of motion: a new figure.

    dataset  : as ``wb.bifurcation`` or ``wb.sweep`` gives it for one parameter
    quantity : "velocity" [rad/s] or "angle" [rad] of the points
    exponent : whether to draw the largest Lyapunov exponent [1/s], with its standard error;
               None: where the dataset has one. Below zero the axis goes four times as far as
               above: how fast stable motions settle is not its subject
    width    : of the figure [inch]; a journal's column is 3.5, its page 7.2

    The shade says how many of the points of a parameter lie in one place, on a logarithmic
    scale: a single point is light, a periodic motion dark. Below stand the class of motion
    and of stick-slip of every parameter, failed runs included. The dashed line is the
    linear stability limit.

    With a dimension ``branch`` (``follow``) there is one diagram for each direction, and
    intervals where the two differ are shaded: in class of motion, or, both periodic of one
    order, in their points. Two chaotic or undecided motions are not compared.

    Raises ``InputError`` for a dataset that is no sweep over one parameter, or keeps no
    points.
    """
    sweep = _Sweep.of(dataset, quantity)
    if exponent is None:
        exponent = bool(np.any(np.isfinite(sweep.exponent)))
    with style.use():
        sentences = [*regime.about(dataset, [sweep.x.name]), _SHADE]
        return _compose(sweep, sentences, exponent, width)


def _compose(sweep: _Sweep, sentences: list[str], exponent: bool, width: float) -> Figure:
    """Diagrams, exponents, strips and legends below each other."""
    inside, branches = width - _MARGINS, len(sweep.branches)
    diagram = (0.30 if branches > 1 else 0.38) * max(width, 5.5)
    legends = [
        (heading, entries)
        for heading, entries in (
            ("motion", regime.present(sweep.motions, regime.LOOKS, shares=False)),
            ("sticks", regime.present(sweep.sticks, _STICKS, shares=False)),
            ("", _marks(sweep, exponent)),
        )
        if entries
    ]
    heights = [style.legend_height([e.get_label() for e in one], inside) for _, one in legends]
    rows = [diagram] * branches + [_EXPONENT] * exponent + [_ROW * branches] * 2
    above = style.caption_height(sentences, width)
    figure = style.new_figure(width, sum(rows) + sum(heights) + above + _BETWEEN)
    engine: Any = figure.get_layout_engine()
    engine.set(h_pad=0.025, hspace=0.0)
    grid = figure.add_gridspec(len(rows) + len(heights), 1, height_ratios=rows + heights)
    panels = [figure.add_subplot(grid[0])]
    panels += [figure.add_subplot(grid[row], sharex=panels[0]) for row in range(1, len(rows))]
    for branch in range(branches):
        _draw_points(panels[branch], sweep, branch, 72.0 * inside, 72.0 * diagram)
    if exponent:
        _draw_exponent(panels[-3], sweep)
    _draw_strip(panels[-2], sweep, sweep.motions, regime.LOOKS, "motion")
    _name_motions(panels[-2], sweep, 72.0 * inside)
    _draw_strip(panels[-1], sweep, sweep.sticks, _STICKS, "sticks")
    _finish(panels, sweep)
    for row, (heading, entries) in enumerate(legends, start=len(rows)):
        style.legend_alone(figure.add_subplot(grid[row]), entries, inside, heading)
    style.caption(figure, sentences)
    return figure


@dataclass(frozen=True)
class _Sweep:
    """What is drawn, branch by branch, in ascending order of the parameter.

    branches, directions : short and long words for each branch; one empty word without
    points   : of the quantity, (branch, n, period)
    motions, orders, sticks, exponent, error : (branch, n)
    differs  : whether the branches differ, (n,)
    limits   : where the damping of sliding changes sign, and whether it is positive beyond
    low, high : limits of the quantity's axis
    """

    x: Axis
    quantity: str
    branches: list[str]
    directions: list[str]
    points: np.ndarray
    motions: np.ndarray
    orders: np.ndarray
    sticks: np.ndarray
    exponent: np.ndarray
    error: np.ndarray
    differs: np.ndarray
    limits: list[tuple[float, bool]]
    low: float
    high: float

    @classmethod
    def of(cls, dataset: xr.Dataset, quantity: str) -> _Sweep:
        (name,) = regime.swept(dataset, 1)
        if quantity not in QUANTITIES:
            raise InputError(f"quantity = {quantity!r}: {nearest(str(quantity), QUANTITIES)}")
        if quantity not in dataset.data_vars or "period" not in dataset[quantity].dims:
            raise InputError(
                f"dataset: has no {quantity} over period, so there are no Poincare points to draw."
                " Use wb.bifurcation(...) or wb.sweep(...), which keep them."
            )
        x = regime.axis(dataset, name)
        parts = regime.split(dataset)

        def rows(of: str) -> np.ndarray:
            return np.stack([part[of].to_numpy()[x.order] for _, part in parts])

        points = np.stack(
            [part[quantity].transpose(name, "period").to_numpy()[x.order] for _, part in parts]
        ).astype(float)
        motions = np.stack([regime.classes(part).to_numpy()[x.order] for _, part in parts])
        low, high = _span(points, motions)
        return cls(
            x=x,
            quantity=quantity,
            branches=[word for word, _ in parts],
            directions=[regime.direction(dataset, word) for word, _ in parts],
            points=points,
            motions=motions,
            orders=rows("order"),
            sticks=np.stack([regime.stick_classes(part).to_numpy()[x.order] for _, part in parts]),
            exponent=rows("largest_exponent").astype(float),
            error=rows("exponent_error").astype(float),
            differs=_differing(points, motions, rows("order"), _DIFFERS * (high - low)),
            limits=_crossings(x, rows("sliding_damping")[0]),
            low=low,
            high=high,
        )


def _span(points: np.ndarray, motions: np.ndarray) -> tuple[float, float]:
    """Lowest and highest value shown: of all points but those of runs that diverged."""
    kept = points[np.isfinite(points) & (motions != regime.DIVERGED)[..., None]]
    if not kept.size:
        kept = points[np.isfinite(points)]
    if not kept.size:
        return -1.0, 1.0
    low, high = float(np.min(kept)), float(np.max(kept))
    return style.margins(low, high, _LEAST * max(abs(low), abs(high)), share=0.04)


def _differing(
    points: np.ndarray, motions: np.ndarray, orders: np.ndarray, least: float
) -> np.ndarray:
    """Where two branches are two motions, (n,)."""
    differs = np.zeros(points.shape[1], dtype=bool)
    if points.shape[0] != 2:
        return differs
    for place in range(differs.size):
        one, other = motions[:, place]
        if {one, other} & regime.UNSETTLED:
            continue
        if one != other or orders[0, place] != orders[1, place]:
            differs[place] = True
        elif one in regime.PERIODIC:
            last = -max(1, int(orders[0, place]))
            differs[place] = _apart(points[0, place, last:], points[1, place, last:]) > least
    return differs


def _apart(one: np.ndarray, other: np.ndarray) -> float:
    """The Hausdorff distance of two sets of numbers; 0 if one is empty."""
    one, other = one[np.isfinite(one)], other[np.isfinite(other)]
    if not (one.size and other.size):
        return 0.0
    distance = np.abs(one[:, None] - other[None, :])
    return float(max(np.max(np.min(distance, axis=0)), np.max(np.min(distance, axis=1))))


def _crossings(x: Axis, damping: np.ndarray) -> list[tuple[float, bool]]:
    """Where the damping of sliding changes sign, and whether it is positive to the right."""
    known = np.isfinite(damping)
    places, values = x.places(x.values)[known], damping[known]
    stable = values > 0.0
    found = []
    for i in np.flatnonzero(stable[1:] != stable[:-1]):
        share = values[i] / (values[i] - values[i + 1])
        place = float(places[i] + share * (places[i + 1] - places[i]))
        found.append((10.0**place if x.log else place, bool(stable[i + 1])))
    return found


# The diagram.


def _draw_points(axes: Axes, sweep: _Sweep, branch: int, wide: float, high: float) -> None:
    """One branch on axes of a width and height [pt]."""
    regime.set_axes(axes, sweep.x, None)
    axes.set_xlabel("")
    axes.set_ylabel(QUANTITIES[sweep.quantity])
    axes.set_ylim(sweep.low, sweep.high)
    _shade(axes, sweep, ~np.any(np.isfinite(sweep.points[branch]), axis=1), style.EMPTY.colour)
    _shade(axes, sweep, sweep.differs, style.DIFFER.colour)
    if np.any(np.isfinite(sweep.points[branch])):
        _draw_density(axes, sweep, branch, wide, high)
    for value, _ in sweep.limits:
        axes.axvline(value, color=style.LIMIT, linewidth=0.9, linestyle=style.DASHES, zorder=3)
    if sweep.branches[branch]:
        axes.annotate(
            sweep.directions[branch],
            (1.0, 0.5),
            xytext=(4.0, 0.0),
            xycoords="axes fraction",
            textcoords="offset points",
            rotation=-90,
            va="center",
        )


def _shade(axes: Axes, sweep: _Sweep, where: np.ndarray, colour: str) -> None:
    """Bands over the cells of some parameters, behind the points."""
    for first, last in _runs(where):
        if where[first]:
            edges = sweep.x.edges[first], sweep.x.edges[last + 1]
            axes.axvspan(*edges, facecolor=colour, edgecolor="none", linewidth=0.0, zorder=0.5)


def _runs(values: np.ndarray) -> list[tuple[int, int]]:
    """First and last place of each run of equal values."""
    ends = np.append(np.flatnonzero(values[1:] != values[:-1]), values.size - 1)
    starts = np.append(0, ends[:-1] + 1)
    return list(zip(starts.tolist(), ends.tolist(), strict=True))


def _draw_density(axes: Axes, sweep: _Sweep, branch: int, wide: float, high: float) -> None:
    """How many of the points of a parameter lie where: cells, or marks if they are few."""
    from matplotlib.colors import LinearSegmentedColormap, LogNorm

    x, points = sweep.x, sweep.points[branch]
    rows = max(8, int(high / _CELL))
    columns, edges = _columns(x, int(wide / _CELL))
    share = _shares(points, columns, edges.size - 1, rows, (sweep.low, sweep.high))
    shades = style.DENSITY_DOWN if branch else style.DENSITY
    least = 1.0 / max(2, points.shape[1])
    how: dict[str, Any] = {
        "cmap": LinearSegmentedColormap.from_list("density", shades),
        "norm": LogNorm(least, 1.0, clip=True),
    }
    spacing = wide / x.values.size
    if spacing <= _CLOSE:
        heights = np.linspace(sweep.low, sweep.high, rows + 1)
        cells = Axis(
            "", "", 0.5 * (heights[1:] + heights[:-1]), np.arange(rows), heights, False, True
        )
        even = not x.log and regime.evenly(edges)
        across = Axis("", "", np.empty(0), np.empty(0), edges, x.log, even)
        regime.draw_cells(axes, across, cells, np.ma.masked_equal(share.T, 0.0), **how)
        return
    column, row = np.nonzero(share)
    order = np.argsort(share[column, row], kind="stable")
    column, row = column[order], row[order]
    height = (sweep.high - sweep.low) / rows
    axes.scatter(
        x.values[column],
        sweep.low + (row + 0.5) * height,
        c=share[column, row],
        s=min(_MARK, max(_CELL, 0.6 * spacing)) ** 2,
        linewidths=0.0,
        zorder=2.0,
        rasterized=column.size > style.RASTER_FROM,
        **how,
    )


def _columns(x: Axis, most: int) -> tuple[np.ndarray, np.ndarray]:
    """The column of each parameter and the columns' edges: its cell, or of several one."""
    if x.values.size <= most:
        return np.arange(x.values.size), x.edges
    ends = x.places(x.edges[[0, -1]])
    edges = np.linspace(ends[0], ends[1], most + 1)
    column = np.searchsorted(edges, x.places(x.values), side="right") - 1
    return np.clip(column, 0, most - 1), 10.0**edges if x.log else edges


def _shares(
    points: np.ndarray,
    columns: np.ndarray,
    number: int,
    rows: int,
    span: tuple[float, float],
) -> np.ndarray:
    """Share of the points of a column in each of its cells, (column, row)."""
    row = (points - span[0]) * (rows / (span[1] - span[0]))
    with np.errstate(invalid="ignore"):
        inside = (row >= 0.0) & (row < rows)
    cell = columns[:, None] * rows + np.where(inside, row, 0.0).astype(np.int64)
    counts = np.bincount(cell[inside], minlength=number * rows).reshape(number, rows)
    recorded = np.bincount(
        np.broadcast_to(columns[:, None], points.shape)[np.isfinite(points)], minlength=number
    )
    share: np.ndarray = counts / np.maximum(recorded, 1)[:, None]
    return share


# Exponents and strips.


def _draw_exponent(axes: Axes, sweep: _Sweep) -> None:
    """The largest exponents with their standard errors, and zero."""
    axes.set_ylabel(r"exponent $\lambda_1$" + "\n[1/s]")
    axes.axhline(0.0, color=style.GREY, linewidth=0.5, zorder=1.5)
    finite = sweep.exponent[np.isfinite(sweep.exponent)]
    if not finite.size:
        style.say(axes, "no exponents")
        return
    for branch, colour in zip(range(len(sweep.branches)), _BRANCHES, strict=False):
        values = np.where(np.isfinite(sweep.exponent[branch]), sweep.exponent[branch], np.nan)
        error = np.nan_to_num(sweep.error[branch], posinf=0.0)
        axes.fill_between(
            sweep.x.values,
            values - error,
            values + error,
            facecolor=colour,
            edgecolor="none",
            alpha=0.3,
            zorder=2,
        )
        axes.plot(
            sweep.x.values,
            values,
            color=colour,
            linewidth=0.6,
            marker="o",
            markersize=0.9,
            markeredgewidth=0.0,
            zorder=3,
        )
    # Deep below zero, of motions that forget their start in a stick, says little.
    top = float(np.max(finite))
    low = max(float(np.min(finite)), -4.0 * top if top > 0.0 else -np.inf)
    axes.set_ylim(*style.margins(min(low, 0.0), max(top, 0.0), 0.0, share=0.1))
    style.few_ticks(axes, y=3)


_BRANCHES = (style.BLUE, style.VERMILLION)


def _draw_strip(
    axes: Axes, sweep: _Sweep, codes: np.ndarray, looks: tuple[style.Look, ...], word: str
) -> None:
    """One row of classes for each branch, the first at the top."""
    rows = len(sweep.branches)
    style.hatching(axes)
    edges = np.arange(rows + 1.0)
    y = Axis("", "", edges[:-1] + 0.5, np.arange(rows), edges, False, True)
    axes.set_ylim(0.0, rows)
    regime.draw_classes(axes, sweep.x, y, codes[::-1], looks)
    for edge in edges[1:-1]:
        axes.axhline(edge, color="black", linewidth=0.4, zorder=3)
    axes.set_yticks(
        y.values, labels=[f"{word} {branch}".strip() for branch in reversed(sweep.branches)]
    )
    axes.tick_params(axis="y", length=0)


def _name_motions(axes: Axes, sweep: _Sweep, wide: float) -> None:
    """T, 2T, 3T, ... on the runs of one periodic motion that have the room."""
    ends = sweep.x.places(sweep.x.edges)
    scale = wide / (ends[-1] - ends[0])
    for branch in range(len(sweep.branches)):
        codes = sweep.motions[branch]
        names = np.where(np.isin(codes, list(regime.PERIODIC)), sweep.orders[branch], 0)
        names[codes == regime.SYNCHRONOUS] = 1
        for first, last in _runs(names):
            name = f"${names[first]}T$" if names[first] > 1 else "$T$"
            room = scale * (ends[last + 1] - ends[first])
            if names[first] < 1 or room < _CHARACTER * (len(name) - 1):
                continue
            middle = 0.5 * (ends[first] + ends[last + 1])
            axes.text(
                10.0**middle if sweep.x.log else middle,
                len(sweep.branches) - branch - 0.54,
                name,
                ha="center",
                va="center",
                fontsize=5.5,
                color=style.ink(regime.LOOKS[codes[first]].colour),
                zorder=4,
            )


def _finish(panels: list[Axes], sweep: _Sweep) -> None:
    """Ticks of the parameter, its label below, and the sides of the linear limit above."""
    for axes in panels[:-1]:
        axes.tick_params(axis="x", labelbottom=False)
    for axes in panels[-2:]:
        axes.tick_params(axis="x", direction="out", top=False)
    panels[-2].tick_params(axis="x", bottom=False)
    panels[-1].set_xlabel(sweep.x.label)
    if len(sweep.limits) != 1:
        return
    value, stable_right = sweep.limits[0]
    words = ("linearly unstable", "stable") if stable_right else ("linearly stable", "unstable")
    for word, side, shift in zip(words, ("right", "left"), (-3.0, 3.0), strict=True):
        panels[0].annotate(
            word,
            (value, 1.0),
            xytext=(shift, 2.5),
            xycoords=("data", "axes fraction"),
            textcoords="offset points",
            ha=side,
            va="bottom",
            fontsize=6.5,
        )


def _marks(sweep: _Sweep, exponent: bool) -> list[Any]:
    """The legend of what else is in the diagram."""
    from matplotlib.lines import Line2D

    entries = [style.limit_entry()] if sweep.limits else []
    if np.any(sweep.differs):
        entries.append(style.swatch(style.DIFFER))
    if np.any(np.all(np.isnan(sweep.points), axis=2)):
        entries.append(style.swatch(style.EMPTY))
    if exponent and len(sweep.branches) > 1:
        entries += [
            Line2D([], [], color=colour, linewidth=0.9, label=f"{word} (exponent)")
            for word, colour in zip(sweep.directions, _BRANCHES, strict=False)
        ]
    return entries
