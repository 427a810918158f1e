"""The response diagram: amplitudes over one parameter, with the classes of motion below."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from wedgebrake.figures.data import caption
from wedgebrake.figures.data.parts import of_parts
from wedgebrake.figures.data.response_diagram import RESPONSE, ResponseDiagram, ResponsePanel
from wedgebrake.figures.matplotlib import style
from wedgebrake.figures.matplotlib.bands import draw_classes_below
from wedgebrake.figures.matplotlib.layout import page
from wedgebrake.figures.matplotlib.maps import set_axes

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Sizes [inch]: margins beside the axes; axis label, ticks and gaps between panels; heights of a
# panel, of a single panel, and of a band of classes for each branch.
_MARGINS, _BETWEEN, _PANEL, _ONLY, _BAND = 0.85, 0.75, 1.15, 2.2, 0.13
# Widths of the curves of the last branch and of the others [pt].
_THIN, _WIDE = 0.8, 2.0
# Largest number of values that are marked with points.
_POINTS = 60
_JUMPS = "Thin dotted lines: jumps."


def response_diagram(
    dataset: xr.Dataset,
    quantity: str = RESPONSE,
    *,
    inertia: str | None = None,
    contact: str | None = None,
    width: float = style.PAGE,
) -> Figure:
    """Amplitudes of the motion against the parameter, with classes of motion: a new figure.

    dataset  : as returned by ``wb.bifurcation`` or ``wb.sweep`` for one parameter
    quantity : "response": half the range and root mean square of the speed, peak and root mean
               square of the torque and of the jerk, and share of time stuck; or one result of the
               sweep, for example "rms_acceleration"
    inertia, contact : parts of a machine whose results are drawn; None for the first
    width    : of the figure [inch]

    With a dimension ``branch`` (``follow``), increasing and decreasing values of the parameter have
    different colours. The classes of motion and of stick-slip are shown below.

    Raises ``InputError`` for a dataset that is not a sweep over one parameter, or an unknown
    quantity.
    """
    dataset = of_parts(dataset, inertia, contact)
    data = ResponseDiagram.of(dataset, quantity)
    number, count = len(data.branches), len(data.panels)
    rows = [_ONLY if count == 1 else _PANEL] * count + [_BAND * number] * 2
    sentences = caption.sentences(dataset, [data.x.name])
    if any(np.any(curve.jumps) for panel in data.panels for curve in panel.curves):
        sentences.append(_JUMPS)
    with (
        style.use(),
        page(width, rows, data.legends(), sentences, beside=_MARGINS, more=_BETWEEN) as (
            figure, grid,
        ),
    ):  # fmt: skip
        engine: Any = figure.get_layout_engine()
        engine.set(h_pad=0.03, hspace=0.0)
        axes = [figure.add_subplot(grid[0])]
        axes += [figure.add_subplot(grid[row], sharex=axes[0]) for row in range(1, len(rows))]
        for one, panel in zip(axes, data.panels, strict=False):
            draw_panel(one, data, panel)
        draw_classes_below(axes, data, 72.0 * (width - _MARGINS))
    return figure


def draw_panel(axes: Axes, data: ResponseDiagram, panel: ResponsePanel) -> None:
    """Draw the curves of a panel; jumps are dotted."""
    set_axes(axes, data.x)
    axes.set_xlabel("")
    axes.set_ylabel(panel.label)
    x = data.x.values
    for curve in panel.curves:
        colour = data.branches[curve.branch].colour
        look: Any = {"color": colour, "linestyle": (0, curve.dashes), "zorder": 3.0}
        # Different widths, so that both branches are visible where they coincide.
        look["linewidth"] = _WIDE if curve.branch < len(data.branches) - 1 else _THIN
        # The curve is interrupted at a jump.
        places = np.flatnonzero(curve.jumps) + 1
        across, up = (np.insert(one, places, np.nan) for one in (x, curve.values))
        axes.plot(across, up, **look)
        if x.size <= _POINTS:
            style.plot_points(axes, x, curve.values, 1.8, color=colour, zorder=3.1)
        for place in places:
            ends = slice(place - 1, place + 1)
            thin: Any = {"color": colour, "linewidth": 0.5, "linestyle": (0, (1.0, 1.5))}
            axes.plot(x[ends], curve.values[ends], zorder=2.5, **thin)
    axes.set_ylim(*style.margins(panel.low, panel.high, 0.0, share=0.06))
    style.few_ticks(axes, y=4)
