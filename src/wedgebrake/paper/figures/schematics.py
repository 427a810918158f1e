"""The models: a torsional driveline with a wedge brake, and with a conventional one.

schematics.toml holds the drawings: lines, bodies, fixed bodies, arrows, texts, circles and arcs.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from wedgebrake.figures.matplotlib import style
from wedgebrake.paper.claims import read_table
from wedgebrake.paper.figures import layout

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from wedgebrake.paper.laboratory import Laboratory

_COLOURS = {"BODY": "#DCEBF5", "BRAKE": "#F6DFC8", "white": "white"}
_DRIVELINE = r"driveline: $J\ddot\theta + c\,\dot\theta + k\,\theta + RF_\mu = T(t)$"
_MODEL = "Driveline with one torsional degree of freedom and a"


def wedge(_laboratory: Laboratory) -> Figure:
    """Figure 1: the driveline, the wedge on the drum, and the forces on the wedge."""
    return _sheet(
        f"Figure 1. {_MODEL} wedge brake (eqs. 1 to 3). Not to scale.",
        [
            (1.2, f"(a) {_DRIVELINE}", ["driveline"]),
            (1.0, "view along the shaft", ["drum", "wedge"]),
            (1.0, r"(b) wedge: $(F_\mu + F_a)/F_N = \tan\,\alpha_w$", ["forces"]),
        ],
        style.PAGE,
    )


def conventional(_laboratory: Laboratory) -> Figure:
    """Figure 19: the driveline with the actuation force normal to the friction surface."""
    return _sheet(
        f"Figure 19. {_MODEL} conventional brake (eqs. 21, 22). Not to scale.",
        [
            (1.2, _DRIVELINE, ["driveline"]),
            (1.0, "view along the shaft: $F_N = F_a$", ["drum", "shoe"]),
        ],
        5.0,
    )


def _sheet(title: str, parts: list[tuple[float, str, list[str]]], width: float) -> Figure:
    """Panels side by side, each with its share of the width, words above, and drawings."""
    shares = [share for share, _, _ in parts]
    figure, (panels,) = layout.sheet([title], [2.0], shares, left=0.1, across=0.1, width=width)
    drawings = read_table("wedgebrake.paper.figures", "schematics.toml")
    for axes, (_, words, names) in zip(panels, parts, strict=True):
        _draw(axes, [drawings[name] for name in names])
        layout.head(axes, words)
    return figure


def _draw(axes: Axes, tables: list[dict[str, Any]]) -> None:
    """Draw tables of the drawings on a plane as wide as the axes, at equal scales."""
    x, y = tables[0]["x"], tables[0]["y"]
    wide, tall = layout.inches(axes)
    scale = max((x[1] - x[0]) / wide, (y[1] - y[0]) / tall)
    axes.set_axis_off()
    axes.set_xlim(*style.margins(x[0], x[1], scale * wide, share=0.0))
    axes.set_ylim(*style.margins(y[0], y[1], scale * tall, share=0.0))
    for table in tables:
        for item in table["items"]:
            kind = next(iter(item))
            _ITEMS[kind](axes, **item)


def _colour(name: str) -> str:
    return _COLOURS.get(name) or str(getattr(style, name))


def _line(axes: Axes, line: Any, width: float = 0.9) -> None:
    look: dict[str, Any] = {"solid_capstyle": "round", "zorder": 3}
    axes.plot(*zip(*line, strict=True), color=style.BLACK, linewidth=width, **look)


def _axis(axes: Axes, axis: Any) -> None:
    axes.plot(*zip(*axis, strict=True), color=style.GREY, linewidth=0.5, dashes=(8, 2, 2, 2))


def _body(axes: Axes, body: Any, fill: str, zorder: float = 2.0, **look: Any) -> None:
    from matplotlib.patches import Polygon

    look = {"edgecolor": style.BLACK, "linewidth": 0.9, "zorder": zorder, **look}
    axes.add_patch(Polygon(body, closed=True, facecolor=_colour(fill), **look))


def _ground(axes: Axes, ground: Any) -> None:
    """A fixed body: hatched, its first side drawn."""
    _body(axes, ground, "white", hatch="/////", edgecolor=style.GREY, linewidth=0.0)
    _line(axes, ground[:2], width=1.1)


def _arrow(axes: Axes, arrow: Any, colour: str, curved: float = 0.0) -> None:
    from matplotlib.patches import FancyArrowPatch

    look: dict[str, Any] = {"linewidth": 1.1, "shrinkA": 0.0, "shrinkB": 0.0, "zorder": 5}
    look |= {"arrowstyle": "-|>", "mutation_scale": 7.0, "color": _colour(colour)}
    start, end = arrow
    axes.add_patch(FancyArrowPatch(start, end, connectionstyle=f"arc3,rad={curved}", **look))


def _text(
    axes: Axes, text: str, at: Any, colour: str = "BLACK", size: float = 8.0, align: str = "center"
) -> None:
    look: dict[str, Any] = {"ha": align, "va": "center", "fontsize": size, "zorder": 6}
    axes.text(at[0], at[1], text, color=_colour(colour), **look)


def _circle(
    axes: Axes, circle: Any, radius: float, fill: str, width: float = 0.9, zorder: float = 1.0
) -> None:
    from matplotlib.patches import Circle

    look = {"edgecolor": style.BLACK, "linewidth": width, "zorder": zorder}
    axes.add_patch(Circle(circle, radius, facecolor=_colour(fill), **look))


def _arc(axes: Axes, arc: Any, diameter: float, angles: Any) -> None:
    from matplotlib.patches import Arc

    first, last = angles
    look: dict[str, Any] = {"theta1": first, "theta2": last, "linewidth": 0.7, "zorder": 4}
    axes.add_patch(Arc(arc, diameter, diameter, **look))


_ITEMS: dict[str, Any] = {
    one.__name__.removeprefix("_"): one
    for one in (_line, _axis, _body, _ground, _arrow, _text, _circle, _arc)
}
