"""The bifurcation diagram: Poincare points of a sweep over one parameter, and what they are."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from wedgebrake.figures.matplotlib import (
    caption,
    class_bands,
    class_styles,
    density,
    heatmap,
    style,
)
from wedgebrake.figures.matplotlib.layout import page
from wedgebrake.figures.matplotlib.sweep_record import Record

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_SHADE = "Shade: share of the points of a parameter, logarithmic."

# Sizes [inch]: margins beside the axes together; label and ticks of the parameter with what
# lies between panels; the exponents.
_MARGINS, _BETWEEN = 0.85, 0.75
_EXPONENT = 0.95

# Share of the exponents that may lie below the axis.
_DEEP = 0.03


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
               None: where the dataset has one. The deepest few of a hundred may lie outside
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
    record = Record.of(dataset, quantity)
    if exponent is None:
        exponent = bool(np.any(np.isfinite(record.exponent)))
    with style.use():
        sentences = [*caption.about(dataset, [record.x.name]), _SHADE]
        return _compose(record, sentences, exponent, width)


def _compose(record: Record, sentences: list[str], exponent: bool, width: float) -> Figure:
    """Diagrams, exponents, strips and legends below each other."""
    inside, number = width - _MARGINS, len(record.branches)
    diagram = (0.30 if number > 1 else 0.38) * max(width, 5.5)
    rows = [diagram] * number + [_EXPONENT] * exponent + [class_bands.ROW * number] * 2
    legends = _legends(record, exponent)
    with page(width, rows, legends, sentences, beside=_MARGINS, more=_BETWEEN) as (figure, grid):
        engine: Any = figure.get_layout_engine()
        engine.set(h_pad=0.025, hspace=0.0)
        panels = [figure.add_subplot(grid[0])]
        panels += [figure.add_subplot(grid[row], sharex=panels[0]) for row in range(1, len(rows))]
        for branch in range(number):
            _draw_diagram(panels[branch], record, branch, (72.0 * inside, 72.0 * diagram))
        if exponent:
            _draw_exponent(panels[-3], record)
        class_bands.draw(panels[-2], panels[-1], record, 72.0 * inside)
        _finish(panels, record)
    return figure


def _draw_diagram(axes: Axes, record: Record, branch: int, size: tuple[float, float]) -> None:
    """One branch on axes of a width and height [pt]."""
    one, span = record.branches[branch], (record.low, record.high)
    heatmap.set_axes(axes, record.x, None)
    axes.set_xlabel("")
    axes.set_ylabel(style.SECTION[record.quantity])
    axes.set_ylim(span)
    _shade(axes, record, record.empty[branch], class_styles.EMPTY.colour)
    _shade(axes, record, record.differs, class_styles.DIFFER.colour)
    if not np.all(record.empty[branch]):
        density.draw(axes, record.x, record.points[branch], span, one.shades, size)
    for value, _ in record.limits:
        axes.axvline(value, color=style.LIMIT, linewidth=0.9, linestyle=style.DASHES, zorder=3)
    if one.direction:
        axes.annotate(
            one.direction,
            (1.0, 0.5),
            xytext=(4.0, 0.0),
            xycoords="axes fraction",
            textcoords="offset points",
            rotation=-90,
            va="center",
        )


def _shade(axes: Axes, record: Record, where: np.ndarray, colour: str) -> None:
    """Bands over the cells of some parameters, behind the points."""
    for first, last in heatmap.runs(where):
        if where[first]:
            edges = record.x.edges[first], record.x.edges[last + 1]
            axes.axvspan(*edges, facecolor=colour, edgecolor="none", linewidth=0.0, zorder=0.5)


def _draw_exponent(axes: Axes, record: Record) -> None:
    """The largest exponents with their standard errors, and zero."""
    axes.set_ylabel(r"exponent $\lambda_1$" + "\n[1/s]")
    axes.axhline(0.0, color=style.GREY, linewidth=0.5, zorder=1.5)
    finite = record.exponent[np.isfinite(record.exponent)]
    if not finite.size:
        style.say(axes, "no exponents")
        return
    for branch, values, error in zip(record.branches, record.exponent, record.error, strict=True):
        _draw_values(axes, record.x.values, values, error, branch.colour)
    # The few deepest, of motions that forget their start in a stick, say little.
    top, low = float(np.max(finite)), float(np.quantile(finite, _DEEP))
    axes.set_ylim(*style.margins(min(low, 0.0), max(top, 0.0), 0.0, share=0.1))
    style.few_ticks(axes, y=3)


def _draw_values(
    axes: Axes, x: np.ndarray, values: np.ndarray, error: np.ndarray, colour: str
) -> None:
    """A line through values, in a band of their errors."""
    values = np.where(np.isfinite(values), values, np.nan)
    error = np.nan_to_num(error, posinf=0.0)
    axes.fill_between(
        x,
        values - error,
        values + error,
        facecolor=colour,
        edgecolor="none",
        alpha=0.3,
        zorder=2,
    )
    axes.plot(
        x,
        values,
        color=colour,
        linewidth=0.6,
        marker="o",
        markersize=0.9,
        markeredgewidth=0.0,
        zorder=3,
    )


def _finish(panels: list[Axes], record: Record) -> None:
    """Ticks of the parameter, its label below, and the sides of the linear limit above."""
    for axes in panels[:-1]:
        axes.tick_params(axis="x", labelbottom=False)
    for axes in panels[-2:]:
        axes.tick_params(axis="x", direction="out", top=False)
    panels[-2].tick_params(axis="x", bottom=False)
    panels[-1].set_xlabel(record.x.label)
    if len(record.limits) != 1:
        return
    value, stable_right = record.limits[0]
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
            fontsize=style.SMALL,
        )


def _legends(record: Record, exponent: bool) -> list[tuple[str, list[Any]]]:
    """Legends of the strips, with their headings, and of what else is in the diagram."""
    return [
        ("motion", class_styles.present(record.motions, class_styles.MOTION_LOOKS, shares=False)),
        ("sticks", class_styles.present(record.sticks, class_styles.STICK_LOOKS, shares=False)),
        ("", _marks(record, exponent)),
    ]


def _marks(record: Record, exponent: bool) -> list[Any]:
    """The legend of what is in the diagram besides the points."""
    from matplotlib.lines import Line2D

    entries = [class_styles.limit_entry()] if record.limits else []
    if np.any(record.differs):
        entries.append(class_styles.swatch(class_styles.DIFFER))
    if np.any(record.empty):
        entries.append(class_styles.swatch(class_styles.EMPTY))
    if exponent and len(record.branches) > 1:
        entries += [
            Line2D([], [], color=one.colour, linewidth=0.9, label=f"{one.direction} (exponent)")
            for one in record.branches
        ]
    return entries
