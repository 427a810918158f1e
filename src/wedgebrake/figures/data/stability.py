"""The map of linear stability over two parameters: where sliding is stable, with its margin."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from wedgebrake.errors import InputError
from wedgebrake.figures import style
from wedgebrake.figures.data.axes import SweptAxis, arranged, round_values
from wedgebrake.figures.data.class_map import ClassMap
from wedgebrake.figures.data.class_styles import (
    LIMIT_ENTRY,
    ClassStyle,
    LegendEntry,
    LineStyle,
    class_entries,
)
from wedgebrake.figures.data.stability_limit import level_lines

if TYPE_CHECKING:
    import xarray as xr

FloatArray = NDArray[np.float64]

VARIABLES = ("margin", "stable", "growth", "locked")
"""Results of ``wb.stability_map``."""
UNSTABLE, STABLE, HELD, LOCKED = range(4)
"""Codes of the regions; HELD: locked at rest, but sliding once moving."""
REGIONS = (
    ClassStyle("unstable: small vibration about sliding grows", "#F7E3D8"),
    ClassStyle("stable: it decays", "#DBEDE4"),
    ClassStyle("locks at rest, slides once moving", "#C9D2DA"),
    ClassStyle("locks itself: no forward sliding", "#B4BCC4"),
)
LEVEL_LINE = LineStyle(style.GREY, 0.5)
"""Lines of equal margin."""
# Approximate number of lines of equal margin.
_LINES = 7


def stability_map(dataset: xr.Dataset, held: NDArray[np.bool_] | None = None) -> ClassMap:
    """The map of a result of ``wb.stability_map``.

    held : rows of the dataset at which the brake locks at rest, but not once moving

    Raises ``InputError`` for anything but a map over two parameters of two values each or more.
    """
    _check(dataset)
    x, y = (SweptAxis.of(dataset, str(name)) for name in dataset["margin"].dims)
    stable, locked, margin = (
        arranged(dataset[name], x, y) for name in ("stable", "locked", "margin")
    )
    codes = np.where(stable, STABLE, UNSTABLE)
    if held is not None:
        codes[held] = HELD
    codes[locked] = LOCKED
    known = np.where(codes >= HELD, np.nan, margin)
    across, up = x.positions(x.values), y.positions(y.values)
    limit = level_lines(across, up, known, 0.0)
    values = _levels(known)
    levels = [(level, line) for level in values for line in level_lines(across, up, known, level)]
    legend = class_entries(codes, REGIONS, shares=False)
    legend += [LIMIT_ENTRY] if limit else []
    legend += [LegendEntry("equal margin", LEVEL_LINE)] if values else []
    return ClassMap(x, y, codes, REGIONS, legend, limit, margin=margin, levels=levels)


def _levels(margin: FloatArray) -> tuple[float, ...]:
    """Round margins inside the range of the map, without zero."""
    known = margin[np.isfinite(margin)]
    if not known.size or np.ptp(known) == 0.0:
        return ()
    low, high = float(known.min()), float(known.max())
    return tuple(one for one in round_values(low, high, _LINES) if one and low < one < high)


def _check(dataset: xr.Dataset) -> None:
    known = getattr(dataset, "data_vars", {})
    if any(name not in known for name in VARIABLES):
        raise InputError(
            f"dataset = {type(dataset).__name__}: must be the result of wb.stability_map(...)."
        )
    sizes = dict(dataset["margin"].sizes)
    if len(sizes) != 2 or min(sizes.values()) < 2:
        said = ", ".join(f"{size} of {name}" for name, size in sizes.items()) or "one point"
        raise InputError(
            f"dataset: holds {said}; there are pictures of linear stability over two groups, of two"
            " values each or more. Give wb.stability_map such axes, for example"
            " eta=np.linspace(-2, 1, 100), alpha=np.linspace(1.1, 2, 100)."
        )
