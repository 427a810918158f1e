"""Swept parameters as axes of a picture, and cells of colour about their values."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from wedgebrake.errors import InputError
from wedgebrake.figures.matplotlib import style
from wedgebrake.figures.matplotlib.class_styles import Look, colours

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes


@dataclass(frozen=True)
class Axis:
    """One swept parameter as an axis of a picture.

    values : ascending, (n,)
    order  : places of these values in the dataset, (n,)
    edges  : of the cells about the values, (n + 1,)
    log    : values are spaced evenly in their logarithm
    """

    name: str
    label: str
    values: np.ndarray
    order: np.ndarray
    edges: np.ndarray
    log: bool

    @property
    def even(self) -> bool:
        """Whether all cells are equally wide on a linear axis."""
        return not self.log and _evenly(self.edges)

    def places(self, values: np.ndarray) -> np.ndarray:
        """Values as places along the axis: their logarithms if it is logarithmic."""
        return np.log10(values) if self.log else np.asarray(values, dtype=float)

    def at(self, places: Any) -> Any:
        """The values at such places."""
        return 10.0**places if self.log else places

    def ends(self) -> tuple[float, float]:
        """Places of the outermost edges."""
        first, last = self.places(self.edges[[0, -1]])
        return float(first), float(last)


def axes_of(dataset: Any) -> list[str]:
    """Swept parameters of a dataset, those that are still dimensions; [] if it is no sweep."""
    known = getattr(dataset, "data_vars", {})
    if any(name not in known for name in ("motion", "order", "status", "sliding_damping")):
        return []
    names = [str(name) for name in dataset["status"].dims if name != "branch"]
    if all(name in dataset.coords for name in names) and dataset["status"].size:
        return names
    return []


def swept(dataset: xr.Dataset, number: int) -> list[str]:
    """Names of the swept parameters of a dataset, which must be so many.

    Raises ``InputError`` for a dataset that is no sweep, or over another number of them.
    """
    names = axes_of(dataset)
    if not names:
        raise InputError(
            f"dataset = {type(dataset).__name__}: must be the result of wb.sweep(...),"
            " wb.bifurcation(...), wb.regime_map(...) or wb.basins(...)."
        )
    if len(names) != number:
        one = "one parameter" if number == 1 else "two parameters"
        way = f"Choose values of {' or '.join(names)}, for example dataset.isel({names[-1]}=0)."
        other = "plots.regime.regime_map" if number == 1 else "plots.bifurcation.bifurcation"
        if len(names) < 3:
            way = f"Use wedgebrake.{other}, or choose a value with dataset.isel(...)."
        raise InputError(
            f"dataset: is swept over {', '.join(names)}, but this picture needs a sweep over"
            f" {one}. {way}"
        )
    return names


def axis(dataset: xr.Dataset, name: str) -> Axis:
    """The axis of a swept parameter.

    Raises ``InputError`` for values that are no finite numbers.
    """
    coordinate = dataset[name]
    given = coordinate.to_numpy()
    if given.dtype.kind not in "iuf" or not np.all(np.isfinite(given)):
        raise InputError(f"{name}: values of the axis must be finite numbers.")
    order = np.argsort(given, kind="stable")
    values = given[order].astype(float)
    log = bool(values[0] > 0.0 and not _evenly(values) and _evenly(np.log(values)))
    edges = _edges(np.log10(values) if log else values)
    return Axis(name, label(coordinate), values, order, 10.0**edges if log else edges, log)


def between(edges: np.ndarray, *, log: bool = False) -> Axis:
    """An axis of cells between edges, without a parameter."""
    middle = np.sqrt(edges[1:] * edges[:-1]) if log else 0.5 * (edges[1:] + edges[:-1])
    return Axis("", "", middle, np.arange(middle.size), edges, log)


def label(values: xr.DataArray) -> str:
    """The label of a parameter or result: meaning, symbol, unit."""
    meaning, unit = values.attrs.get("long_name", ""), values.attrs.get("units", "1")
    return style.named(str(values.name), str(meaning), str(unit))


def set_axes(axes: Axes, x: Axis | None, y: Axis | None) -> None:
    """Labels, scales, limits and ticks of parameters."""
    for one, way in ((x, "x"), (y, "y")):
        if one is None:
            continue
        matplotlib_axis = getattr(axes, f"{way}axis")
        getattr(axes, f"set_{way}label")(one.label)
        if one.log:
            getattr(axes, f"set_{way}scale")("log")
            style.round_ticks(matplotlib_axis, one.edges[0], one.edges[-1])
        elif one.values.size == 1:
            matplotlib_axis.set_ticks(one.values, labels=[f"${style.number(one.values[0])}$"])
        getattr(axes, f"set_{way}lim")(one.edges[0], one.edges[-1])
    if all(one is None or one.log or one.values.size > 1 for one in (x, y)):
        style.few_ticks(axes)


def arranged(values: xr.DataArray, x: Axis, y: Axis) -> np.ndarray:
    """Values as (y, x), both ascending; a copy."""
    plain: np.ndarray = values.transpose(y.name, x.name).to_numpy()[np.ix_(y.order, x.order)]
    return plain


def draw_cells(axes: Axes, x: Axis, y: Axis, values: np.ndarray, **how: Any) -> Any:
    """Cells of colour over two axes; values (y, x). Gives what a colour bar needs."""
    if not (x.even and y.even):
        # On logarithmic axes too: releases of Matplotlib disagree on what an image is there.
        return axes.pcolormesh(x.edges, y.edges, values, rasterized=True, zorder=1.0, **how)
    extent = (x.edges[0], x.edges[-1], y.edges[0], y.edges[-1])
    limits = axes.get_xlim(), axes.get_ylim()
    image = axes.imshow(
        values,
        origin="lower",
        extent=extent,
        aspect="auto",
        interpolation="nearest",
        zorder=1.0,
        **how,
    )
    axes.set_xlim(limits[0])
    axes.set_ylim(limits[1])
    return image


def draw_classes(axes: Axes, x: Axis, y: Axis, codes: np.ndarray, looks: Sequence[Look]) -> None:
    """Cells in the colours of classes; where a code is below 0, nothing."""
    draw_cells(
        axes,
        x,
        y,
        np.ma.masked_less(codes, 0),
        cmap=colours(looks),
        vmin=-0.5,
        vmax=len(looks) - 0.5,
    )


def to_edges(values: np.ndarray, one: Axis, along: int) -> np.ndarray:
    """Values continued in a straight line from the outer points to the edges."""
    places, edges = one.places(one.values), one.places(one.edges)
    values = np.moveaxis(values, along, 0)
    ends = []
    for end, inner in ((0, 1), (-1, -2)):
        step = places[inner] - places[end] if places.size > 1 else 0.0
        share = (edges[end] - places[end]) / step if step else 0.0
        ends.append(values[end] + share * (values[inner] - values[end]) if share else values[end])
    return np.moveaxis(np.concatenate((ends[0][None], values, ends[1][None])), 0, along)


def runs(values: np.ndarray) -> list[tuple[int, int]]:
    """First and last place of each run of equal values."""
    ends = np.append(np.flatnonzero(values[1:] != values[:-1]), values.size - 1)
    starts = np.append(0, ends[:-1] + 1)
    return list(zip(starts.tolist(), ends.tolist(), strict=True))


def _evenly(values: np.ndarray) -> bool:
    """Whether steps between values are equal, but for rounding."""
    steps = np.diff(values)
    return steps.size == 0 or bool(np.ptp(steps) <= 1e-6 * abs(float(np.mean(steps))))


def _edges(places: np.ndarray) -> np.ndarray:
    """Edges of cells about places: halfway between them, and as far beyond the outer ones."""
    if places[-1] == places[0]:
        half = 0.05 * abs(places[0]) or 0.5
        return np.linspace(places[0] - half, places[0] + half, places.size + 1)
    middle = 0.5 * (places[1:] + places[:-1])
    return np.concatenate(([2.0 * places[0] - middle[0]], middle, [2.0 * places[-1] - middle[-1]]))
