"""Boundaries: lines of bifurcations of periodic orbits in the plane of two parameters."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from wedgebrake.errors import InputError
from wedgebrake.figures.matplotlib import caption, class_styles, heatmap, style
from wedgebrake.figures.matplotlib.layout import HIGHEST, page

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Widths of a line and of the other colour on both sides of it [pt].
_LINE, _CASING = 1.0, 2.4


def boundary(
    dataset: xr.Dataset, *, boundaries: Sequence[xr.Dataset] = (), width: float = style.COLUMN
) -> Figure:
    """A boundary in the plane of its parameters, the first to the right: a new figure.

    dataset    : as ``wb.boundary`` gives it
    boundaries : further ones over the same two parameters, drawn with it
    width      : of the figure [inch]; a journal's column is 3.5, its page 7.2

    Each kind of bifurcation has its line: dark for those of smooth systems, light between
    dark edges for those of friction.

    Raises ``InputError`` for datasets that are no boundaries, or over other parameters.
    """
    names = parameters(dataset, "dataset")
    every = [dataset, *checked(boundaries, names)]
    with style.use():
        rows, sentences = [min(0.75 * width, HIGHEST)], caption.about(dataset, names)
        with page(width, rows, [("", entries(every))], sentences) as (figure, grid):
            axes = figure.add_subplot(grid[0])
            spans = json.loads(dataset.attrs["ranges"])
            for name, way in zip(names, "xy", strict=True):
                getattr(axes, f"set_{way}label")(heatmap.label(dataset[name]))
                getattr(axes, f"set_{way}lim")(spans[dataset.attrs["parameters"].index(name)])
            style.few_ticks(axes)
            draw(axes, names, every)
        return figure


def draw(axes: Axes, names: Sequence[str], boundaries: Sequence[xr.Dataset]) -> None:
    """Lines on axes of two parameters, the first of ``names`` to the right."""
    for one in boundaries:
        across, up = (one[name].to_numpy() for name in names)
        axes.plot(across, up, **_line(str(one.attrs["bifurcation"])), zorder=3.2)


def entries(boundaries: Sequence[xr.Dataset]) -> list[Any]:
    """Legend entries of the kinds that are there, each with the periods of its orbits."""
    from matplotlib.lines import Line2D

    found: dict[str, set[int]] = {}
    for one in boundaries:
        orders = found.setdefault(str(one.attrs["bifurcation"]), set())
        orders.add(int(one.attrs["order"]))
    return [
        Line2D(
            [],
            [],
            label=f"{kind} of {', '.join(map(class_styles.period, sorted(found[kind])))}",
            **_line(kind),
        )
        for kind in class_styles.BIFURCATIONS
        if kind in found
    ]


def checked(boundaries: Any, names: Sequence[str]) -> list[xr.Dataset]:
    """Boundaries over two parameters, in any order of them.

    Raises ``InputError`` for anything else.
    """
    if not isinstance(boundaries, list | tuple):
        raise InputError(
            f"boundaries = {type(boundaries).__name__}: must be a list of results of"
            " wb.boundary(...)."
        )
    for place, one in enumerate(boundaries):
        own = parameters(one, f"boundaries[{place}]")
        if set(own) != set(names):
            raise InputError(
                f"boundaries[{place}]: is a line over {' and '.join(own)}, but the picture is one"
                f" over {' and '.join(names)}. Follow it over these with wb.boundary(...)."
            )
    return list(boundaries)


def parameters(dataset: Any, argument: str) -> list[str]:
    """The two parameters of a boundary.

    Raises ``InputError`` for a dataset that is none, by the name of the argument.
    """
    attributes = getattr(dataset, "attrs", {})
    if attributes.get("kind") != "boundary":
        raise InputError(
            f"{argument} = {type(dataset).__name__}: must be the result of wb.boundary(...)."
        )
    return [str(name) for name in attributes["parameters"]]


def _line(kind: str) -> dict[str, Any]:
    """How the line of a kind is drawn: in two colours, to be seen on every other."""
    from matplotlib.patheffects import Normal, Stroke

    mark = class_styles.BIFURCATIONS[kind]
    inner, outer = ("white", "black") if mark.friction else ("black", "white")
    unbroken = {"dash_offset": 0.0, "dash_list": None}
    casing = Stroke(linewidth=_CASING, foreground=outer, dashes=unbroken)
    return {
        "color": inner,
        "linewidth": _LINE,
        "linestyle": mark.dashes,
        "dash_capstyle": "butt",
        "solid_capstyle": "butt",
        "path_effects": [casing, Normal()],
    }
