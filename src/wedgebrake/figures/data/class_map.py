"""Maps over two parameters: cells of classes or values, and the lines drawn over them.

``regime_maps`` gives the maps of a sweep, with one result of each point, and ``stability_map`` that
of linear stability: where sliding is stable, with its margin.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wedgebrake.arrays import FloatArray
from wedgebrake.errors import InputError
from wedgebrake.figures import style
from wedgebrake.figures.data import class_styles as classes
from wedgebrake.figures.data.axes import (
    SweptAxis,
    grid_values,
    label,
    require_swept,
    round_values,
    swept_axes,
)
from wedgebrake.figures.data.bifurcation import split
from wedgebrake.figures.data.class_styles import ClassStyle
from wedgebrake.figures.data.limits import Codes
from wedgebrake.figures.data.parts import with_one_part
from wedgebrake.figures.data.stability_limit import level_lines, limit_lines
from wedgebrake.model.validation import check_choice, wrong

if TYPE_CHECKING:
    import xarray as xr


# Results with a sign: drawn about zero.
_SIGNED = ("largest_exponent", "second_exponent", "sliding_damping")
# A scale is logarithmic if values are positive and span more than this factor.
_WIDE = 300.0
# Percentage of the values at either end that is drawn in the last colour.
_OUTLIERS = 1.0


VARIABLES = ("stable", "locked", "released")
"""Variables of every result of ``wb.stability_map``."""
# Variables that are zero at the limit, over groups and over parameters, in words. The scale of the
# growth rate depends on the frequency.
_MEASURES = {"margin": "margin", "damping_ratio": "damping ratio"}
UNSTABLE, STABLE, HELD, LOCKED, RELEASED = range(5)
"""Codes of the regions; HELD: locked at rest, but sliding once moving."""
REGIONS = (
    ClassStyle("unstable: small vibration about sliding grows", "#F7E3D8"),
    ClassStyle("stable: it decays", "#DBEDE4"),
    ClassStyle("locks at rest, slides once moving", "#C9D2DA"),
    ClassStyle("locks itself: no forward sliding", "#B4BCC4"),
    ClassStyle("released: nothing presses the brake", "#E4DFF0"),
)
LEVEL_LINE = classes.LineStyle(style.GREY, 0.5)
"""Lines of equal margin."""
# Approximate number of lines of equal margin.
_LINES = 7


@dataclass(frozen=True)
class ValueScale:
    """A scale of colours, with the label of its bar.

    signed      : about zero, in two colours
    cut         : True if values lie below, above the scale
    """

    label: str
    low: float
    high: float
    log: bool
    signed: bool
    cut: tuple[bool, bool]


@dataclass(frozen=True)
class Marks:
    """Points, (n, 2), with a label beside one of them."""

    label: str
    points: FloatArray
    marker: classes.MarkerStyle


@dataclass(frozen=True, eq=False)
class ClassMap:
    """Cells of classes over two parameters, with lines and points over them.

    codes  : indices into ``styles``, (y, x); cells below 0 are not drawn
    styles : of the classes
    limit  : lines of the linear stability limit, (n, 2) each, as positions along x and y
    values : of the cells, (y, x), NaN where there is none; None for a map of classes
    scale  : of the values; None if there are no values
    margin : of linear stability of the cells, (y, x): slope less the critical slope
    levels : margins with their lines, as of the limit
    marks  : of attractors, at values of both parameters
    title  : of one of several maps
    undecided : (y, x) cells whose class of motion is undecided, to be hatched over their colour;
                None where the colour says so
    """

    x: SweptAxis
    y: SweptAxis
    codes: Codes
    styles: Sequence[ClassStyle]
    legend: list[classes.LegendEntry]
    limit: Sequence[FloatArray] = ()
    values: FloatArray | None = None
    scale: ValueScale | None = None
    margin: FloatArray | None = None
    levels: Sequence[tuple[float, FloatArray]] = ()
    marks: Sequence[Marks] = ()
    title: str = ""
    undecided: NDArray[np.bool_] | None = None


def regime_maps(dataset: xr.Dataset, quantity: str = "motion") -> list[ClassMap]:
    """Maps of a result of a sweep over two parameters, one for each branch.

    They share a scale and a legend. Raises ``InputError`` for a quantity that the sweep does not
    have at each point.
    """
    dataset = with_one_part(dataset)
    _check_quantity(dataset, quantity)
    x, y = swept_axes(dataset)
    codes, styles = _coded(dataset, quantity)
    legend = classes.class_entries(codes.to_numpy(), styles, shares=True)
    undecided = _undecided(dataset) if quantity != "motion" else None
    if undecided is not None and undecided.any():
        legend.append(classes.class_entry(classes.UNDECIDED, float(undecided.mean())))
    values = None if quantity in ("motion", "stick_class") else _values(dataset, quantity)
    scale = None if values is None else _scale(values)
    maps = []
    for branch in split(dataset):
        at = {"branch": branch.name} if "branch" in dataset.dims else {}
        maps.append(
            ClassMap(
                x,
                y,
                grid_values(codes.sel(at), x, y).astype(np.int64),
                styles,
                legend,
                limit_lines(branch.dataset, x, y),
                None if values is None else grid_values(values.sel(at), x, y),
                scale,
                title=branch.direction,
                undecided=None if undecided is None else grid_values(undecided.sel(at), x, y),
            )
        )
    ends = [classes.LIMIT_ENTRY] if any(one.limit for one in maps) else []
    return [replace(one, legend=legend + ends) for one in maps]


def _coded(dataset: xr.Dataset, quantity: str) -> tuple[xr.DataArray, tuple[ClassStyle, ...]]:
    """Codes of the cells, below 0 where a value is drawn; and their styles."""
    motions = classes.motion_codes(dataset).astype(np.int64)
    if quantity == "motion":
        return motions, classes.MOTIONS
    missing = motions.copy(data=classes.without_result(motions.to_numpy()))
    if quantity == "stick_class":
        own: tuple[ClassStyle, ...] = classes.STICK_CLASSES
        found = classes.stick_codes(dataset).astype(np.int64)
    else:
        own = (classes.NO_VALUE,)
        found = _values(dataset, quantity).isnull().astype(np.int64) - 1
    codes = found.where(~missing, motions + len(own))
    return codes.transpose(*motions.dims), (*own, *classes.MOTIONS)


def _undecided(dataset: xr.Dataset) -> xr.DataArray:
    return classes.motion_codes(dataset) == classes.CODES["undecided"]


def _values(dataset: xr.Dataset, quantity: str) -> xr.DataArray:
    values = dataset[quantity].transpose(*dataset["motion"].dims).astype(float)
    missing = classes.without_result(classes.motion_codes(dataset).to_numpy())
    if quantity == "order":
        missing |= values.to_numpy() <= 0.0
    return values.where(~missing)  # keeps name and attributes


def _scale(values: xr.DataArray) -> ValueScale | None:
    everything = values.to_numpy()
    finite = everything[np.isfinite(everything)]
    if not finite.size:
        return None
    least, most = float(np.min(finite)), float(np.max(finite))
    low, high = (float(v) for v in np.percentile(finite, (_OUTLIERS, 100.0 - _OUTLIERS)))
    # The scale is not cut for outliers slightly beyond it.
    if most - least <= 2.0 * (high - low):
        low, high = least, most
    signed = str(values.name) in _SIGNED
    if signed:
        high = max(abs(low), abs(high)) or 1.0
        low = -high
    log = not signed and low > 0.0 and high > _WIDE * low
    if high <= low:
        high = low + (abs(low) or 1.0)
    cut = bool(np.any(everything < low)), bool(np.any(everything > high))
    return ValueScale(label(values), low, high, log, signed, cut)


def _check_quantity(dataset: xr.Dataset, quantity: str) -> None:
    names = require_swept(dataset, 2)
    allowed = [
        str(name)
        for name, one in dataset.data_vars.items()
        if set(one.dims) - {"branch"} == set(names)
        and (one.dtype.kind == "f" or name in ("motion", "stick_class", "order"))
    ]
    check_choice("quantity", quantity, allowed)


def stability_map(dataset: xr.Dataset, held: NDArray[np.bool_] | None = None) -> ClassMap:
    """The map of a result of ``wb.stability_map``.

    held : rows of the dataset at which the brake locks at rest, but not once moving

    Raises ``InputError`` for anything but a map over two parameters of two values each or more.
    """
    measure = _check_stability(dataset)
    x, y = (SweptAxis.of(dataset, str(name)) for name in dataset[measure].dims)
    stable, locked, released, margin = (
        grid_values(dataset[name], x, y) for name in ("stable", "locked", "released", measure)
    )
    codes = np.where(stable, STABLE, UNSTABLE)
    if held is not None:
        codes[held] = HELD
    codes[locked] = LOCKED
    codes[released] = RELEASED
    known = np.where(codes >= HELD, np.nan, margin)
    across, up = x.positions(x.values), y.positions(y.values)
    limit = level_lines(across, up, known, 0.0)
    values = _levels(known)
    levels = [(level, line) for level in values for line in level_lines(across, up, known, level)]
    legend = classes.class_entries(codes, REGIONS, shares=False)
    legend += [classes.LIMIT_ENTRY] if limit else []
    legend += [classes.LegendEntry(f"equal {_MEASURES[measure]}", LEVEL_LINE)] if values else []
    return ClassMap(x, y, codes, REGIONS, legend, limit, margin=margin, levels=levels)


def _levels(margin: FloatArray) -> tuple[float, ...]:
    """Round margins inside the range of the map, without zero."""
    known = margin[np.isfinite(margin)]
    if not known.size or np.ptp(known) == 0.0:
        return ()
    low, high = float(known.min()), float(known.max())
    return tuple(one for one in round_values(low, high, _LINES) if one and low < one < high)


def _check_stability(dataset: xr.Dataset) -> str:
    """The measure of stability in a map over two parameters."""
    known = set(getattr(dataset, "data_vars", {}))
    measure = next((name for name in _MEASURES if name in known), "")
    if not known.issuperset((measure, *VARIABLES)):
        raise wrong("dataset", dataset, "the result of wb.stability_map(...)")
    sizes = dict(dataset["stable"].sizes)
    if len(sizes) != 2 or min(sizes.values()) < 2:
        said = ", ".join(f"{size} of {name}" for name, size in sizes.items()) or "one point"
        raise InputError(
            f"dataset: holds {said}; there are pictures of linear stability over two groups, of two"
            " values each or more. Give wb.stability_map such axes, for example"
            " eta=np.linspace(-2, 1, 100), alpha=np.linspace(1.1, 2, 100)."
        )
    return measure


@dataclass(frozen=True, eq=False)
class BifurcationLine:
    """A curve of bifurcations of periodic orbits over two parameters.

    kind   : of bifurcation
    order  : period of its orbits, in periods of the torque
    points : values of both parameters, (n, 2)
    """

    kind: str
    order: int
    points: FloatArray


def curves_over(boundaries: Any, names: Sequence[str]) -> list[BifurcationLine]:
    """Curves over two parameters, the first to the right, from results of ``wb.boundary``.

    Raises ``InputError`` for anything else, or a result over other parameters.
    """
    if not isinstance(boundaries, list | tuple):
        raise wrong("boundaries", boundaries, "a list of results of wb.boundary(...)")
    for place, one in enumerate(boundaries):
        own = boundary_parameters(one, f"boundaries[{place}]")
        if set(own) != set(names):
            raise InputError(
                f"boundaries[{place}]: is a line over {' and '.join(own)}, but the picture is one"
                f" over {' and '.join(names)}. Follow it over these with wb.boundary(...)."
            )
    return [
        BifurcationLine(
            str(one.attrs["bifurcation"]),
            int(one.attrs["order"]),
            np.column_stack([one[name].to_numpy() for name in names]),
        )
        for one in boundaries
    ]


def boundary_parameters(dataset: Any, argument: str) -> list[str]:
    """The two parameters of a result of ``wb.boundary``.

    Raises ``InputError`` for anything else, with the name of the argument.
    """
    attributes = getattr(dataset, "attrs", {})
    if attributes.get("kind") != "boundary":
        raise wrong(argument, dataset, "the result of wb.boundary(...)")
    return [str(name) for name in attributes["parameters"]]


def curve_entries(curves: Sequence[BifurcationLine]) -> list[classes.LegendEntry]:
    """Legend entries of the kinds that occur, each with the periods of its orbits."""
    found: dict[str, set[int]] = {}
    for one in curves:
        found.setdefault(one.kind, set()).add(one.order)
    return [
        classes.LegendEntry(
            f"{kind} of {', '.join(map(classes.period, sorted(found[kind])))}", one.line
        )
        for kind, one in classes.BIFURCATIONS.items()
        if kind in found
    ]
