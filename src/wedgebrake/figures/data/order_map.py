"""Contents of the picture of an order map."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from wedgebrake.errors import InputError
from wedgebrake.figures.data.axes import SweptAxis, grid_values
from wedgebrake.figures.data.class_map import ClassMap, ValueScale

if TYPE_CHECKING:
    import xarray as xr

# Lowest order shown: lower ones hold the mean and its trend over a window.
_LOWEST = 0.5
# Smallest share of the largest amplitude on the scale.
_RANGE = 1e-3


def of_dataset(dataset: xr.Dataset) -> tuple[ClassMap, str]:
    """The map of a result of ``wb.order_map`` over speed and order, and a sentence on it.

    Raises ``InputError`` for a map of a single speed or order.
    """
    shown = dataset.isel(order=np.flatnonzero(dataset["order"] >= _LOWEST))
    if min(shown.sizes["speed"], shown.sizes["order"]) < 2:
        raise InputError(
            f"dataset: a picture needs two speeds, and two orders from {_LOWEST:g} on."
        )
    what = f"{dataset.attrs['variable'].replace('_', ' ')} of {dataset.attrs['part']}"
    x = replace(SweptAxis.of(shown, "speed"), label="speed of the reference  [rad/s]")
    y = replace(SweptAxis.of(shown, "order"), label="order  [cycles per turn]")
    amplitude = grid_values(shown["amplitude"], x, y)
    most = float(amplitude.max())
    low, high = (_RANGE * most, most) if most > 0.0 else (0.0, 1.0)
    label = f"amplitude of the {what}  [{dataset['amplitude'].attrs['units']}]"
    cut = bool(amplitude.min() < low), False
    scale = ValueScale(label, low, high, log=low > 0.0, signed=False, cut=cut)
    codes = np.full(amplitude.shape, -1)
    sentence = (
        f"Order map of the {what}. Reference: {dataset.attrs['reference']}."
        f" Windows of {dataset.attrs['turns']} turns."
    )
    return ClassMap(x, y, codes, (), [], values=amplitude, scale=scale), sentence
