"""Maps: regimes, basins, stability, curves of bifurcations over two parameters; order maps."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from wedgebrake.figures.data import basins as basins_data
from wedgebrake.figures.data import caption, class_map
from wedgebrake.figures.data import order_map as order_map_data
from wedgebrake.figures.data.axes import SweptAxis, label, require_swept, true_runs
from wedgebrake.figures.data.class_map import LEVEL_LINE, BifurcationLine, ClassMap
from wedgebrake.figures.data.class_styles import BIFURCATIONS, HATCH, STABILITY_LIMIT, ClassStyle
from wedgebrake.figures.data.parts import with_one_part
from wedgebrake.figures.matplotlib import point_labels, style
from wedgebrake.figures.matplotlib.layout import HATCHES, line_options, marker_options, page

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Largest height of a map [inch], and its height as a share of its width.
_HIGHEST, _SHARE = 4.0, 0.72
# Width beside the axes [inch].
_BESIDE = 0.55
# Width of the white ring about a point of an attractor [pt].
_RING = 1.8
# White over cells whose motion is undecided.
_VEIL = (1.0, 1.0, 1.0, 0.5)


def regime_map(
    dataset: xr.Dataset,
    quantity: str = "motion",
    *,
    boundaries: Sequence[xr.Dataset] = (),
    inertia: str | None = None,
    contact: str | None = None,
    width: float = style.COLUMN,
) -> Figure:
    """A sweep over two parameters, the first to the right and the second upwards: a new figure.

    dataset    : as returned by ``wb.regime_map`` or ``wb.sweep``; with a dimension ``branch``,
                 one map for each branch
    quantity   : "motion" or "stick_class" (a colour for each class), "order",
                 "largest_exponent" (blue below zero, red above) or any other result of a
                 point, such as "peak_torque", "friction_power", "stick_share"
    boundaries : lines of bifurcations over the same two parameters, as ``wb.boundary`` gives
                 them
    inertia, contact : of a machine, whose results are drawn; None for the first
    width      : of the figure [inch]; a journal's column is 3.5, its page 7.2

    The dashed line is the linear stability limit, where ``sliding_damping`` changes sign; it
    ends where the brake locks itself and no forward sliding exists. Cells whose class of motion is
    undecided are hatched, whatever the quantity. Axes are logarithmic where
    values are so spaced. A picture of fewer pixels than the map has cells shows one cell in
    each pixel, never a mixture of colours.

    Raises ``InputError`` for a dataset that is not a sweep over two parameters, a quantity that
    it does not have, or boundaries over other parameters.
    """
    dataset = with_one_part(dataset, inertia, contact)
    names = require_swept(dataset, 2)
    curves = class_map.curves_over(boundaries, names)
    maps = class_map.regime_maps(dataset, quantity)
    return _figure(maps, caption.sentences(dataset, names), width, curves)


def basins(dataset: xr.Dataset, *, width: float = style.COLUMN) -> Figure:
    """Basins over the two initial conditions: a new figure.

    dataset : as returned by ``wb.basins``
    width   : of the figure [inch]; a journal's column is 3.5, its page 7.2

    Attractors are numbered as in the dataset and coloured by their share of all initial states.
    Circles are their Poincare points: states at the same phase of the torque as the initial
    state; without varying signals, at the section of the motion. The legend states the period of
    each motion that has one in periods of the torque. Beyond the twentieth, attractors share
    one colour.

    Raises ``InputError`` for a dataset that has no basins.
    """
    data = basins_data.of_dataset(dataset)
    return _figure([data], caption.sentences(dataset, [data.x.name, data.y.name]), width)


def stability_map(dataset: xr.Dataset, *, width: float = style.COLUMN) -> Figure:
    """Linear stability over two parameters, the first to the right and the second upwards.

    dataset : as returned by ``wb.stability_map``
    width   : of the figure [inch]; a journal's column is 3.5, its page 7.2

    The dashed line is the linear stability limit; thin lines are lines of equal margin in eta or,
    for a machine, of equal damping ratio of the least damped mode. Returns a new figure.

    Raises ``InputError`` for anything but such a map over two parameters, with two values each or
    more.
    """
    data = class_map.stability_map(dataset)
    names = [data.x.name, data.y.name]
    if "margin" not in dataset:
        words = "Linear stability of steady sliding. Numbers: smallest damping ratio."
        return _figure([data], [*caption.sentences(dataset, names), words], width)
    sentences = [
        caption.of_stability(dataset, names),
        "Linear stability of sliding in both directions.",
        r"Numbers: margin, $\eta$ less the critical $\eta$ of the worse direction.",
    ]
    return _figure([data], sentences, width)


def boundary(
    dataset: xr.Dataset, *, boundaries: Sequence[xr.Dataset] = (), width: float = style.COLUMN
) -> Figure:
    """A line of bifurcations over two parameters, the first to the right: a new figure.

    dataset    : as returned by ``wb.boundary``
    boundaries : further lines over the same two parameters, drawn with it
    width      : of the figure [inch]; a journal's column is 3.5, its page 7.2

    Each kind of bifurcation has its line: dark for those of smooth systems, light between
    dark edges for those of friction.

    Raises ``InputError`` for datasets that are not boundaries, or over other parameters.
    """
    names = class_map.boundary_parameters(dataset, "dataset")
    curves = [
        one for given in ([dataset], boundaries) for one in class_map.curves_over(given, names)
    ]
    x, y = (
        replace(SweptAxis.from_edges(np.linspace(low, high, 3)), label=label(dataset[name]))
        for name, (low, high) in zip(names, json.loads(dataset.attrs["ranges"]), strict=True)
    )
    empty = ClassMap(x, y, np.empty((0, 0), dtype=np.int64), (), [])
    return _figure([empty], caption.sentences(dataset, names), width, curves)


def order_map(dataset: xr.Dataset, *, hertz: bool = False, width: float = style.COLUMN) -> Figure:
    """Amplitudes over speed (right) and order (up), on a logarithmic scale: a new figure.

    dataset : as returned by ``wb.order_map``
    hertz   : over speed in rpm and frequency in Hz
    width   : of the figure [inch]

    The scale spans three decades below the largest amplitude; orders below 0.5 are left out, as
    they hold the mean and its trend.

    Raises ``InputError`` for a map of a single speed or order.
    """
    data, sentence = order_map_data.of_dataset(dataset, hertz=hertz)
    return _figure([data], [sentence], width)


def _figure(
    maps: Sequence[ClassMap],
    sentences: Sequence[str],
    width: float,
    curves: Sequence[BifurcationLine] = (),
) -> Figure:
    """Maps that share legends, side by side if the width [inch] allows."""
    across = len(maps) if width >= 1.5 * style.COLUMN else 1
    rows = [min(_SHARE * width / across, _HIGHEST)] * (len(maps) // across)
    legends = [("", maps[0].legend), ("", class_map.curve_entries(curves))]
    shape: Any = {"beside": _BESIDE, "across": across}
    with page(width, rows, legends, sentences, **shape) as (figure, grid):
        for place, data in enumerate(maps):
            axes = figure.add_subplot(grid[place // across, place % across])
            draw(axes, data, curves)
            if data.title:
                axes.set_title(data.title, fontsize=style.points(style.LABELS))
    return figure


def draw(axes: Axes, data: ClassMap, curves: Sequence[BifurcationLine] = ()) -> None:
    """Draw a map on given axes, without legend; a colour bar is beside them."""
    if data.codes.size:
        draw_hatching(axes)
    set_axes(axes, data.x, data.y)
    draw_classes(axes, data.x, data.y, data.codes, data.styles)
    for line in data.limit:
        across, up = data.x.at(line[:, 0]), data.y.at(line[:, 1])
        axes.plot(across, up, **line_options(STABILITY_LIMIT), zorder=3.0)
    if data.values is not None:
        _draw_values(axes, data, data.values)
    if data.undecided is not None:
        _hatch_over(axes, data, data.undecided)
    _draw_levels(axes, data)
    for curve in curves:
        axes.plot(*curve.points.T, **line_options(BIFURCATIONS[curve.kind].line), zorder=3.2)
    for one in data.marks:
        # With a white ring: an attractor lies in its own basin, which has the same colour.
        ring = replace(one.marker, size=one.marker.size + _RING, face="white", edge="white")
        for marker in (ring, one.marker):
            axes.plot(*one.points.T, **marker_options(marker), zorder=4.0)
    point_labels.draw(axes, [(one.label, one.points) for one in data.marks], (), force=True)


def set_axes(axes: Axes, x: SweptAxis, y: SweptAxis | None = None) -> None:
    """Set labels, scales, limits and ticks of parameters."""
    for one, way in ((x, "x"), (y, "y")):
        if one is None:
            continue
        axis = getattr(axes, f"{way}axis")
        axis.set_label_text(one.label)
        if one.log:
            getattr(axes, f"set_{way}scale")("log")
            style.round_ticks(axis, one.edges[0], one.edges[-1])
        elif one.values.size == 1:
            axis.set_ticks(one.values, labels=[style.number(one.values[0])])
        getattr(axes, f"set_{way}lim")(one.edges[0], one.edges[-1])
    if all(one is None or one.log or one.values.size > 1 for one in (x, y)):
        style.few_ticks(axes)


def draw_hatching(axes: Axes) -> None:
    """Hatch all of the axes, behind everything: visible where cells are not opaque."""
    from matplotlib.patches import Rectangle

    look: Any = {"facecolor": "white", "edgecolor": HATCH, "hatch": HATCHES, "linewidth": 0.0}
    axes.add_patch(Rectangle((0.0, 0.0), 1.0, 1.0, transform=axes.transAxes, zorder=0.1, **look))


def _hatch_over(axes: Axes, data: ClassMap, chosen: np.ndarray) -> None:
    """Hatch cells over a white veil, so that the hatching is visible on any colour."""
    from matplotlib.patches import PathPatch
    from matplotlib.path import Path

    boxes = [
        Path([(left, low), (right, low), (right, high), (left, high), (left, low)], closed=True)
        for row, (low, high) in zip(chosen, pairwise(data.y.edges), strict=True)
        for left, right in [data.x.edges[[first, last + 1]] for first, last in true_runs(row)]
    ]
    if boxes:
        look: Any = {"facecolor": _VEIL, "edgecolor": style.DARK_GREY, "hatch": HATCHES}
        path = Path.make_compound_path(*boxes)
        axes.add_patch(PathPatch(path, linewidth=0.0, zorder=2.0, **look))


def draw_classes(
    axes: Axes, x: SweptAxis, y: SweptAxis, codes: np.ndarray, styles: Sequence[ClassStyle]
) -> None:
    """Draw cells in the colours of their classes; none where a code is below 0."""
    from matplotlib.colors import ListedColormap, to_rgba

    if np.all(codes < 0):
        return
    colours = ListedColormap([to_rgba(one.colour, one.opacity) for one in styles])
    options = {"cmap": colours, "vmin": -0.5, "vmax": len(styles) - 0.5}
    draw_cells(axes, x, y, np.ma.masked_less(codes, 0), **options)


def draw_cells(axes: Axes, x: SweptAxis, y: SweptAxis, values: np.ndarray, **options: Any) -> Any:
    """Draw cells of colour, values (y, x). Returns the artist, for a colour bar."""
    options["zorder"] = 1.0
    if not (x.even and y.even):
        # Also on logarithmic axes, where releases of Matplotlib draw images differently.
        return axes.pcolormesh(x.edges, y.edges, values, rasterized=True, **options)
    options |= {"origin": "lower", "aspect": "auto", "interpolation": "nearest"}
    limits = axes.get_xlim(), axes.get_ylim()
    extent = (x.edges[0], x.edges[-1], y.edges[0], y.edges[-1])
    image = axes.imshow(values, extent=extent, **options)
    axes.set(xlim=limits[0], ylim=limits[1])
    return image


def _draw_values(axes: Axes, data: ClassMap, values: np.ndarray) -> None:
    from matplotlib.colors import LinearSegmentedColormap, LogNorm, Normalize

    scale = data.scale
    if scale is None:
        style.show_message(axes, "no values")
        return
    # Infinite values too get the last colour: just beyond the scale.
    beyond = 0.01 * (scale.high - scale.low)
    lowest = scale.low - beyond if scale.low <= 0.0 else 0.99 * scale.low
    shown = np.ma.masked_invalid(np.clip(values, lowest, scale.high + beyond))
    signs = LinearSegmentedColormap.from_list("signs", style.SIGNS)
    norm = (LogNorm if scale.log else Normalize)(scale.low, scale.high)
    colours = signs if scale.signed else style.SIZES
    drawn = draw_cells(axes, data.x, data.y, shown, cmap=colours, norm=norm)
    extend = (("neither", "max"), ("min", "both"))[scale.cut[0]][scale.cut[1]]
    bar = axes.figure.colorbar(drawn, ax=axes, extend=extend, pad=0.02, aspect=25)
    bar.set_label(scale.label)
    bar.outline.set_linewidth(0.5)


# Share of the axes beside the frame where a centred number would be cut off.
_EDGE = 0.08
# Places of a number along its line, in the order of preference, and its distances from the others,
# across and up [em].
_ALONG = (0.5, 0.35, 0.65, 0.2, 0.8, 0.1, 0.9)
_APART = np.array([4.0, 2.2])


def _draw_levels(axes: Axes, data: ClassMap) -> None:
    figure: Any = axes.figure
    em = style.points(style.SMALL) / 72.0 * figure.dpi
    taken = np.empty((0, 2))
    for level, line in data.levels:
        across, up = data.x.at(line[:, 0]), data.y.at(line[:, 1])
        axes.plot(across, up, **line_options(LEVEL_LINE), zorder=2.5)
        places = axes.transData.transform(np.column_stack((across, up))) / em
        tried = [round(share * (len(line) - 1)) for share in _ALONG]
        free = [one for one in tried if np.all(np.any(abs(taken - places[one]) > _APART, axis=1))]
        if not free:
            continue
        middle = free[0]
        taken = np.vstack((taken, places[middle]))
        box = {"facecolor": "white", "edgecolor": "none", "alpha": 0.7, "pad": 0.5}
        at = across[middle], up[middle]
        # Beside the frame, which would cut it off, a number stands on the inner side of its line.
        shares = (axes.transData - axes.transAxes).transform(at)
        ha, va = (
            ends[0] if one < _EDGE else ends[1] if one > 1.0 - _EDGE else "center"
            for one, ends in zip(shares, (("left", "right"), ("bottom", "top")), strict=True)
        )
        look: Any = {"ha": ha, "va": va, "fontsize": style.points(style.SMALL), "clip_on": True}
        axes.text(*at, style.signed(level), bbox=box, zorder=2.6, **look)
