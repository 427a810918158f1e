"""Picture of a machine: its bodies and parts."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from wedgebrake.figures.data.sketch import RADIUS, Line, Sketch
from wedgebrake.figures.matplotlib import style
from wedgebrake.figures.matplotlib.layout import captioned

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from wedgebrake.model.system_base import System

# Largest scale [inch per unit]; that below which lines and words shrink, words to a least size.
_SCALE, _SHRINKS, _LEAST = 1.2, 0.8, 5.0
# Margin [unit]; widths of characters as shares of their size.
_MARGIN, _CHARACTER = 0.06, 0.55
_BODY, _DRIVEN = "#E4EEF6", "#F6E3CF"
_LOOKS: dict[str, dict[str, Any]] = {
    "line": {"color": style.BLACK, "linewidth": 0.8},
    "bold": {"color": style.VERMILLION, "linewidth": 2.0},
    "signal": {"color": style.GREEN, "linewidth": 0.8, "linestyle": (0, (4, 2))},
}
# Fill and edge of closed lines.
_AREAS = {
    "area": ("white", style.BLACK), "head": (style.BLACK, style.BLACK),
    "signal head": (style.GREEN, style.GREEN),
}  # fmt: skip


def sketch(system: System, *, width: float = style.PAGE) -> Figure:
    """Draw the bodies and parts of a machine in a new figure.

    system : Machine or BrakedDriveline
    width  : of the figure [inch]

    Discs are bodies, driven ones with a second circle. Parts between bodies are between or above
    them; parts between a body and the ground, and torques, are below it. Dashed lines lead from
    what a controller measures to what it acts on, and from the quantities of a normal force to its
    contact.

    Raises ``InputError`` for any other ``system``.
    """
    data = Sketch.of(system)
    left, bottom, right, top = data.box
    wide, tall = right - left + 2.0 * _MARGIN, top - bottom + 2.0 * _MARGIN
    scale = min(width / wide, _SCALE)
    with captioned(width, tall * scale + 0.1, [f"{system._headline()}."]) as figure:
        axes = figure.subplots()
        axes.set_axis_off()
        axes.set_aspect("equal")
        spare = 0.5 * (width / scale - wide) + _MARGIN
        axes.set_xlim(left - spare, right + spare)
        axes.set_ylim(bottom - _MARGIN, top + _MARGIN)
        draw_sketch(axes, data, scale)
    return figure


def draw_sketch(axes: Axes, data: Sketch, scale: float) -> None:
    """Draw a sketch in axes of a scale [inch per unit]."""
    from matplotlib.patches import Circle

    for line in data.lines:
        _draw_line(axes, line, min(scale / _SHRINKS, 1.0))
    for disc in data.discs:
        look = {"edgecolor": style.BLACK, "linewidth": 0.9, "zorder": 3.0}
        fill = _DRIVEN if disc.driven else _BODY
        axes.add_patch(Circle(disc.at, RADIUS, facecolor=fill, **look))
        if disc.driven:
            axes.add_patch(Circle(disc.at, 0.88 * RADIUS, fill=False, **look))
        _write(axes, disc.name, disc.at, 2.0 * RADIUS + 0.2, scale)
    for text in data.texts:
        _write(axes, text.words, text.at, text.wide, scale)


def _draw_line(axes: Axes, line: Line, share: float) -> None:
    """Draw a line with a share of its usual width."""
    across, up = zip(*line.points, strict=True)
    if line.look in _AREAS:
        fill, edge = _AREAS[line.look]
        axes.fill(across, up, facecolor=fill, edgecolor=edge, linewidth=0.8 * share, zorder=2.0)
        return
    look = {**_LOOKS[line.look], "solid_capstyle": "round", "zorder": 2.0}
    axes.plot(across, up, **{**look, "linewidth": share * look["linewidth"]})


def _write(axes: Axes, words: str, at: tuple[float, float], wide: float, scale: float) -> None:
    """Write words, shortened to a width [unit]."""
    from matplotlib.patheffects import withStroke

    size = style.points(max(min(scale / _SHRINKS, 1.0) * style.LABELS, _LEAST))
    most = max(int(72.0 * scale * wide / (_CHARACTER * size)), 1)
    if len(words) > most:
        words = f"{words[: most - 1]}…"
    halo = [withStroke(linewidth=2.0, foreground="white")]
    axes.text(*at, words, ha="center", va="center", fontsize=size, zorder=5.0, path_effects=halo)
