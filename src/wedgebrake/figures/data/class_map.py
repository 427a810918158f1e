"""Maps over two parameters: cells of classes or values, with the lines drawn over them.

``regime_map`` gives the map of a sweep, with one result of each point.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from wedgebrake.errors import InputError, nearest
from wedgebrake.figures.data import class_styles
from wedgebrake.figures.data.class_styles import CODES, MOTIONS, NO_VALUE, STICK_CLASSES, ClassStyle
from wedgebrake.figures.data.legend import LIMIT_ENTRY, LegendEntry, class_entries, class_entry
from wedgebrake.figures.data.stability_limit import limit_lines
from wedgebrake.figures.data.swept_axis import (
    SweptAxis,
    arranged,
    label,
    require_swept,
    swept_axes,
)

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


@dataclass(frozen=True, eq=False)
class ClassMap:
    """Cells of classes over two parameters.

    codes  : indices into ``styles``, (y, x); cells below 0 are not drawn
    styles : of the classes
    limit  : lines of the linear stability limit, (n, 2) each, as positions along x and y
    """

    x: SweptAxis
    y: SweptAxis
    codes: Codes
    styles: tuple[ClassStyle, ...]
    legend: list[LegendEntry]
    limit: list[FloatArray] = field(default_factory=list)


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


@dataclass(frozen=True, eq=False)
class RegimeMap(ClassMap):
    """One result of each point over two parameters.

    values : of the cells, (y, x), NaN where there is none; None for a map of classes
    scale  : of the values; None if there is no value
    """

    values: FloatArray | None = None
    scale: ValueScale | None = None


def check_quantity(dataset: xr.Dataset, quantity: str) -> None:
    """Raise ``InputError`` unless a sweep over two parameters has the result at each point."""
    names = require_swept(dataset, 2)
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


def regime_map(
    dataset: xr.Dataset, quantity: str = "motion", *, whole: xr.Dataset | None = None
) -> RegimeMap:
    """Map of a result of a sweep over two parameters, without branches.

    whole : dataset of all branches, which share a scale and a legend
    """
    whole = dataset if whole is None else whole
    x, y = swept_axes(dataset)
    motions = arranged(class_styles.motion_codes(dataset), x, y).astype(np.int64)
    limit = limit_lines(dataset, x, y)
    legend = [*_legend(whole, quantity), *([LIMIT_ENTRY] if limit else [])]
    if quantity == "motion":
        return RegimeMap(x, y, motions, MOTIONS, legend, limit)
    missing = class_styles.without_result(motions)
    if quantity == "stick_class":
        sticks = arranged(class_styles.stick_codes(dataset), x, y).astype(np.int64)
        codes = np.where(missing, len(STICK_CLASSES) + motions, sticks)
        return RegimeMap(x, y, codes, (*STICK_CLASSES, *MOTIONS), legend, limit)
    values = arranged(_values(dataset, quantity), x, y)
    codes = np.where(np.isnan(values), np.where(missing, motions, CODES["undecided"]), -1)
    scale = _scale(_values(whole, quantity))
    return RegimeMap(x, y, codes, MOTIONS, legend, limit, values, scale)


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
