"""Legend entries as artists, and the options of lines and markers."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from wedgebrake.figures.data.class_styles import HATCH, ClassStyle, LineStyle, MarkerStyle
from wedgebrake.figures.data.legend import LegendEntry

HATCHES = "/////////"
# Width of a line with the casing on both sides of it, over that of the line [pt].
_CASING = 1.4


def handles(entries: Iterable[LegendEntry]) -> list[Any]:
    """Artists of a legend's entries."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    found: list[Any] = []
    for entry in entries:
        style = entry.style
        if isinstance(style, ClassStyle):
            opaque = style.opacity == 1.0
            patch = Patch(
                facecolor=style.over(),
                edgecolor="#808080" if opaque else style.over(HATCH),
                hatch=None if opaque else HATCHES,
                linewidth=0.3,
                label=entry.label,
            )
            found.append(patch)
        else:
            options = (
                marker_options(style) if isinstance(style, MarkerStyle) else line_options(style)
            )
            found.append(Line2D([], [], label=entry.label, **options))
    return found


def line_options(style: LineStyle) -> dict[str, Any]:
    """Options of ``plot`` for a line."""
    from matplotlib.patheffects import Normal, Stroke

    options = {
        "color": style.colour,
        "linewidth": style.width,
        "linestyle": style.dashes,
        "dash_capstyle": "butt",
    }
    if not style.casing:
        return options
    unbroken = {"dash_offset": 0.0, "dash_list": None}
    casing = Stroke(linewidth=style.width + _CASING, foreground=style.casing, dashes=unbroken)
    return {**options, "solid_capstyle": "butt", "path_effects": [casing, Normal()]}


def marker_options(style: MarkerStyle) -> dict[str, Any]:
    """Options of ``plot`` for points."""
    return {
        "linestyle": "none",
        "marker": style.symbol,
        "markersize": style.size,
        "markerfacecolor": style.face,
        "markeredgecolor": style.edge,
        "markeredgewidth": style.edge_width,
    }
