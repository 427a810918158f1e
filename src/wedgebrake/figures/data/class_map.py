"""Maps over two parameters: cells of classes or values, and the lines drawn over them.

``regime_map`` gives the map of a sweep, with one result of each point.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wedgebrake.errors import InputError, nearest
from wedgebrake.figures.data import class_styles
from wedgebrake.figures.data.axes import SweptAxis, arranged, label, require_swept, swept_axes
from wedgebrake.figures.data.class_styles import (
    CODES,
    LIMIT_ENTRY,
    MOTIONS,
    NO_VALUE,
    STICK_CLASSES,
    ClassStyle,
    LegendEntry,
    MarkerStyle,
    class_entries,
    class_entry,
)
from wedgebrake.figures.data.stability_limit import limit_lines

if TYPE_CHECKING:
    import xarray as xr

FloatArray = NDArray[np.float64]
Codes = NDArray[np.int64]

# Results with a sign: drawn about zero.
_SIGNED = ("largest_exponent", "second_exponent", "sliding_damping")
# A scale is logarithmic if values are positive and span more than this factor.
_WIDE = 300.0
# Percentage of the values at either end that is drawn in the last colour.
_OUTLIERS = 1.0


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
    marker: MarkerStyle


@dataclass(frozen=True, eq=False)
class ClassMap:
    """Cells of classes over two parameters, and what is drawn over them.

    codes  : indices into ``styles``, (y, x); cells below 0 are not drawn
    styles : of the classes
    limit  : lines of the linear stability limit, (n, 2) each, as positions along x and y
    values : of the cells, (y, x), NaN where there is none; None for a map of classes
    scale  : of the values; None if there is no value
    margin : of linear stability of the cells, (y, x): slope less the critical slope
    levels : margins with their lines, as of the limit
    marks  : of attractors, at values of both parameters
    """

    x: SweptAxis
    y: SweptAxis
    codes: Codes
    styles: Sequence[ClassStyle]
    legend: list[LegendEntry]
    limit: Sequence[FloatArray] = ()
    values: FloatArray | None = None
    scale: ValueScale | None = None
    margin: FloatArray | None = None
    levels: Sequence[tuple[float, FloatArray]] = ()
    marks: Sequence[Marks] = ()


def regime_map(
    dataset: xr.Dataset, quantity: str = "motion", *, whole: xr.Dataset | None = None
) -> ClassMap:
    """Map of a result of a sweep over two parameters, without branches.

    whole : dataset of all branches, which share a scale and a legend

    Raises ``InputError`` for a quantity that the sweep does not have at each point.
    """
    _check_quantity(dataset, quantity)
    whole = dataset if whole is None else whole
    x, y = swept_axes(dataset)
    motions = arranged(class_styles.motion_codes(dataset), x, y).astype(np.int64)
    limit = limit_lines(dataset, x, y)
    legend = [*_legend(whole, quantity), *([LIMIT_ENTRY] if limit else [])]
    if quantity == "motion":
        return ClassMap(x, y, motions, MOTIONS, legend, limit)
    missing = class_styles.without_result(motions)
    if quantity == "stick_class":
        sticks = arranged(class_styles.stick_codes(dataset), x, y).astype(np.int64)
        codes = np.where(missing, len(STICK_CLASSES) + motions, sticks)
        return ClassMap(x, y, codes, (*STICK_CLASSES, *MOTIONS), legend, limit)
    values = arranged(_values(dataset, quantity), x, y)
    codes = np.where(np.isnan(values), np.where(missing, motions, CODES["undecided"]), -1)
    scale = _scale(_values(whole, quantity))
    return ClassMap(x, y, codes, MOTIONS, legend, limit, values, scale)


def _values(dataset: xr.Dataset, quantity: str) -> xr.DataArray:
    """A result as numbers, NaN where there is none."""
    values = dataset[quantity].transpose(*dataset["motion"].dims).astype(float)
    missing = class_styles.without_result(class_styles.motion_codes(dataset).to_numpy())
    if quantity == "order":
        missing |= values.to_numpy() <= 0.0
    return values.where(~missing)  # keeps name and attributes


def _scale(values: xr.DataArray) -> ValueScale | None:
    """The scale of a result; None if all values are missing or infinite."""
    everything = values.to_numpy()
    finite = everything[np.isfinite(everything)]
    if not finite.size:
        return None
    least, most = float(np.min(finite)), float(np.max(finite))
    low, high = (float(v) for v in np.percentile(finite, (_OUTLIERS, 100.0 - _OUTLIERS)))
    # Outliers a little beyond are no reason to cut the scale.
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


def _legend(dataset: xr.Dataset, quantity: str) -> list[LegendEntry]:
    """Entries of the classes, and of the points without a result."""
    motions = class_styles.motion_codes(dataset).to_numpy()
    if quantity == "motion":
        return class_entries(motions, MOTIONS, shares=True)
    missing = class_styles.without_result(motions)
    failures = class_entries(np.where(missing, motions, -1), MOTIONS, shares=True)
    if quantity == "stick_class":
        sticks = class_styles.stick_codes(dataset).transpose(*dataset["motion"].dims).to_numpy()
        return class_entries(np.where(missing, -1, sticks), STICK_CLASSES, shares=True) + failures
    none = np.isnan(_values(dataset, quantity).to_numpy()) & ~missing
    empty = [class_entry(NO_VALUE, float(np.mean(none)))] if np.any(none) else []
    return empty + failures


def _check_quantity(dataset: xr.Dataset, quantity: str) -> None:
    names = require_swept(dataset, 2)
    allowed = [
        str(name)
        for name, one in dataset.data_vars.items()
        if set(one.dims) == set(names)
        and (one.dtype.kind == "f" or name in ("motion", "stick_class", "order"))
    ]
    if "branch" in dataset.dims:
        raise InputError(
            "dataset: has branches, but a map shows one. Choose it with dataset.sel(branch='up')."
        )
    if quantity not in allowed:
        raise InputError(
            f"quantity = {quantity!r}: no such result of each point."
            f" {nearest(str(quantity), allowed)}"
        )


@dataclass(frozen=True, eq=False)
class BifurcationCurve:
    """A curve of bifurcations of periodic orbits over two parameters.

    kind   : of bifurcation
    order  : period of its orbits, in periods of the torque
    points : values of both parameters, (n, 2)
    """

    kind: str
    order: int
    points: FloatArray


def curves_over(boundaries: Any, names: Sequence[str]) -> list[BifurcationCurve]:
    """Curves over two parameters, the first to the right, from results of ``wb.boundary``.

    Raises ``InputError`` for anything else, or a result over other parameters.
    """
    if not isinstance(boundaries, list | tuple):
        raise InputError(
            f"boundaries = {type(boundaries).__name__}: must be a list of results of"
            " wb.boundary(...)."
        )
    for place, one in enumerate(boundaries):
        own = boundary_parameters(one, f"boundaries[{place}]")
        if set(own) != set(names):
            raise InputError(
                f"boundaries[{place}]: is a line over {' and '.join(own)}, but the picture is one"
                f" over {' and '.join(names)}. Follow it over these with wb.boundary(...)."
            )
    return [
        BifurcationCurve(
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
        raise InputError(
            f"{argument} = {type(dataset).__name__}: must be the result of wb.boundary(...)."
        )
    return [str(name) for name in attributes["parameters"]]


def curve_entries(curves: Sequence[BifurcationCurve]) -> list[LegendEntry]:
    """Legend entries of the kinds that occur, each with the periods of its orbits."""
    found: dict[str, set[int]] = {}
    for one in curves:
        found.setdefault(one.kind, set()).add(one.order)
    return [
        LegendEntry(
            f"{kind} of {', '.join(map(class_styles.period, sorted(found[kind])))}", style.line
        )
        for kind, style in class_styles.BIFURCATIONS.items()
        if kind in found
    ]
