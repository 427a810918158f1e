"""Maps of a sweep over two parameters: the class of motion, or any other result, by colour."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from wedgebrake.errors import InputError, nearest
from wedgebrake.figures.matplotlib import (
    caption,
    class_styles,
    codim2,
    heatmap,
    stability_limit,
    style,
)
from wedgebrake.figures.matplotlib.heatmap import Axis
from wedgebrake.figures.matplotlib.layout import HIGHEST, page
from wedgebrake.figures.matplotlib.sweep_branches import split

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Results that have a sign: drawn about zero.
_SIGNED = ("largest_exponent", "second_exponent", "sliding_damping")
# A scale is logarithmic if values are positive and span more than this.
_WIDE = 300.0
# Values beyond these percentiles are drawn in the last colour.
_OUTLIERS = 1.0


def regime_map(
    dataset: xr.Dataset,
    quantity: str = "motion",
    *,
    boundaries: Sequence[xr.Dataset] = (),
    width: float = style.COLUMN,
) -> Figure:
    """A sweep over two parameters, the first to the right and the second upwards: a new figure.

    dataset    : as ``wb.regime_map`` or ``wb.sweep`` gives it; with a dimension ``branch``,
                 one map for each branch
    quantity   : "motion" or "stick_class" (a colour for each class), "order",
                 "largest_exponent" (blue below zero, red above) or any other result of a
                 point, such as "peak_torque", "friction_power", "stick_share"
    boundaries : lines of bifurcations over the same two parameters, as ``wb.boundary`` gives
                 them
    width      : of the figure [inch]; a journal's column is 3.5, its page 7.2

    The dashed line without edges is the linear stability limit, where ``sliding_damping``
    changes sign; it ends where the brake locks itself and no forward sliding exists. Axes are
    logarithmic where values are spaced so. A picture of fewer pixels than the map has cells
    shows one cell in each pixel, never a mixture of colours.

    Raises ``InputError`` for a dataset that is no sweep over two parameters, a quantity that
    it does not have, or boundaries over other parameters.
    """
    names = heatmap.swept(dataset, 2)
    _check_quantity(dataset, quantity, names)
    lines = codim2.checked(boundaries, names)
    with style.use():
        branches = split(dataset)
        line = _limit(branches[0].dataset)  # the damping of sliding is that of all branches
        across = len(branches) if width >= 1.5 * style.COLUMN else 1
        rows = [min(0.72 * width / across, HIGHEST)] * (len(branches) // across)
        legends = [("", _entries(dataset, quantity, line)), ("", codim2.entries(lines))]
        sentences = caption.about(dataset, names)
        with page(width, rows, legends, sentences, across=across) as (figure, grid):
            for place, branch in enumerate(branches):
                axes = figure.add_subplot(grid[place // across, place % across])
                _draw_map(axes, branch.dataset, quantity, dataset)
                _draw_limit(axes, line)
                codim2.draw(axes, names, lines)
                if branch.direction:
                    axes.set_title(branch.direction, fontsize=style.LABELS)
        return figure


def draw(
    axes: Axes,
    dataset: xr.Dataset,
    quantity: str = "motion",
    *,
    boundaries: Sequence[xr.Dataset] = (),
) -> None:
    """The same on axes of your own, without legend; a colour bar comes beside them.

    Of a dataset with branches, one: ``dataset.sel(branch="up")``.
    """
    names = heatmap.swept(dataset, 2)
    _check_quantity(dataset, quantity, names)
    lines = codim2.checked(boundaries, names)
    if "branch" in dataset.dims:
        raise InputError(
            "dataset: has branches, but axes hold one map. Choose one with"
            " dataset.sel(branch='up'), or use regime_map for all."
        )
    _draw_map(axes, dataset, quantity, dataset)
    _draw_limit(axes, _limit(dataset))
    codim2.draw(axes, names, lines)


def _check_quantity(dataset: xr.Dataset, quantity: str, names: list[str]) -> None:
    """Refuse what is no result of each point."""
    allowed = [
        str(name)
        for name, one in dataset.data_vars.items()
        if set(one.dims) - {"branch"} == set(names)
        and (one.dtype.kind == "f" or name in ("motion", "stick_class", "order"))
    ]
    if quantity not in allowed:
        raise InputError(
            f"quantity = {quantity!r}: no such result of each point."
            f" {nearest(str(quantity), allowed)}"
        )


def _draw_map(axes: Axes, dataset: xr.Dataset, quantity: str, whole: xr.Dataset) -> None:
    """One branch, in the scale of all of them."""
    x, y = (heatmap.axis(dataset, name) for name in heatmap.swept(dataset, 2))
    class_styles.hatching(axes)
    heatmap.set_axes(axes, x, y)
    found = heatmap.arranged(class_styles.classes(dataset), x, y)
    if quantity == "motion":
        heatmap.draw_classes(axes, x, y, found, class_styles.MOTION_LOOKS)
    elif quantity == "stick_class":
        sticks = heatmap.arranged(class_styles.stick_classes(dataset), x, y)
        heatmap.draw_classes(axes, x, y, sticks, class_styles.STICK_LOOKS)
        _draw_without(axes, x, y, found, found < 0)
    else:
        values = heatmap.arranged(_values(dataset, quantity), x, y)
        _draw_scale(axes, x, y, values, _values(whole, quantity))
        _draw_without(axes, x, y, found, np.isnan(values))


def _values(dataset: xr.Dataset, quantity: str) -> xr.DataArray:
    """A result as numbers, NaN where there is none."""
    values = dataset[quantity].transpose(*dataset["motion"].dims).astype(float)
    without = class_styles.without(class_styles.classes(dataset).to_numpy())
    if quantity == "order":
        without |= values.to_numpy() <= 0.0
    return values.where(~without)  # keeps name and attributes


def _draw_without(axes: Axes, x: Axis, y: Axis, found: np.ndarray, missing: np.ndarray) -> None:
    """Cells without a result, in the look that says why; ``missing`` ones else as hatching."""
    codes = np.where(missing, class_styles.UNDECIDED, -1)
    without = class_styles.without(found)
    codes[without] = found[without]
    if np.any(codes >= 0):
        heatmap.draw_classes(axes, x, y, codes, class_styles.MOTION_LOOKS)


def _draw_scale(axes: Axes, x: Axis, y: Axis, values: np.ndarray, whole: xr.DataArray) -> None:
    """Cells in a scale of colours, with its bar; the scale is that of all the values."""
    everything = whole.to_numpy()
    if not np.any(np.isfinite(everything)):
        style.say(axes, "no values")
        return
    norm, colours = _scale(str(whole.name), everything[np.isfinite(everything)])
    low, high = norm.vmin, norm.vmax
    # Infinite values too get the last colour: just beyond the scale.
    beyond = 0.01 * (high - low)
    shown = np.clip(values, low - beyond if low <= 0.0 else 0.99 * low, high + beyond)
    drawn = heatmap.draw_cells(axes, x, y, np.ma.masked_invalid(shown), cmap=colours, norm=norm)
    cut = bool(np.any(everything < low)), bool(np.any(everything > high))
    extend = (("neither", "max"), ("min", "both"))[cut[0]][cut[1]]
    bar = axes.figure.colorbar(drawn, ax=axes, extend=extend, pad=0.02, aspect=25)
    bar.set_label(heatmap.label(whole))
    bar.outline.set_linewidth(0.5)


def _scale(name: str, finite: np.ndarray) -> tuple[Any, Any]:
    """Normalisation and colours for the finite values of a result."""
    from matplotlib.colors import LinearSegmentedColormap, LogNorm, Normalize

    least, most = float(np.min(finite)), float(np.max(finite))
    low, high = (float(v) for v in np.percentile(finite, (_OUTLIERS, 100.0 - _OUTLIERS)))
    # Outliers a little beyond are no reason to cut the scale.
    if most - least <= 2.0 * (high - low):
        low, high = least, most
    if name in _SIGNED:
        largest = max(abs(low), abs(high)) or 1.0
        colours = LinearSegmentedColormap.from_list("signs", style.SIGNS)
        return Normalize(-largest, largest), colours
    if low > 0.0 and high > _WIDE * low:
        return LogNorm(low, high), style.SIZES
    return Normalize(low, high if high > low else low + (abs(low) or 1.0)), style.SIZES


_Field = tuple[np.ndarray, np.ndarray, np.ndarray]


def _limit(dataset: xr.Dataset) -> _Field | None:
    """What is zero on the limit of linear stability; None where there is no such line."""
    x, y = (heatmap.axis(dataset, name) for name in heatmap.swept(dataset, 2))
    return stability_limit.field(dataset, x, y)


def _draw_limit(axes: Axes, found: _Field | None) -> None:
    """The line of the limit, if there is one."""
    from matplotlib.patheffects import Stroke

    if found is None:
        return
    xs, ys, values = found
    lines = axes.contour(
        xs,
        ys,
        np.ma.masked_invalid(values),
        levels=[0.0],
        colors=[style.LIMIT],
        linewidths=1.1,
        linestyles=[style.DASHES],
        zorder=3.0,
    )
    lines.set_path_effects([Stroke(linewidth=2.4, foreground="white"), Stroke()])


def _entries(dataset: xr.Dataset, quantity: str, line: _Field | None) -> list[Any]:
    """The legend: classes, points without a result, the linear limit."""
    found = class_styles.classes(dataset).to_numpy()
    codes = np.where(class_styles.without(found), found, -1)
    entries: list[Any] = []
    if quantity == "motion":
        codes = found
    elif quantity == "stick_class":
        sticks = class_styles.stick_classes(dataset).transpose(*dataset["motion"].dims).to_numpy()
        entries = class_styles.present(
            np.where(codes < 0, sticks, -1), class_styles.STICK_LOOKS, shares=True
        )
    else:
        none = np.isnan(_values(dataset, quantity).to_numpy()) & (codes < 0)
        if np.any(none):
            entries = [class_styles.swatch(class_styles.NO_VALUE, float(np.mean(none)))]
    entries += class_styles.present(codes, class_styles.MOTION_LOOKS, shares=True)
    if line is not None:
        entries.append(class_styles.limit_entry())
    return entries
