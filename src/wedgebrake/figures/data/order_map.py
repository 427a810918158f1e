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


def of_dataset(dataset: xr.Dataset, *, hertz: bool = False) -> tuple[ClassMap, str]:
    """The map of a result of ``wb.order_map`` over speed and order, and a sentence on it.

    hertz : over speed in rpm and frequency in Hz instead of speed in rad/s and order

    Raises ``InputError`` for a map of a single speed or order.
    """
    shown = dataset.isel(order=np.flatnonzero(dataset["order"] >= _LOWEST))
    if min(shown.sizes["speed"], shown.sizes["order"]) < 2:
        raise InputError(
            f"dataset: a picture needs two speeds, and two orders from {_LOWEST:g} on."
        )
    what = f"{dataset.attrs['variable'].replace('_', ' ')} of {dataset.attrs['part']}"
    across, up = "speed of the reference  [rad/s]", "order  [cycles per turn]"
    if hertz:
        shown = _over_frequency(shown)
        across, up = "speed of the reference  [rpm]", "frequency  [Hz]"
    x = replace(SweptAxis.of(shown, "speed"), label=across)
    y = replace(SweptAxis.of(shown, "order"), label=up)
    amplitude = grid_values(shown["amplitude"], x, y)
    most = float(np.nanmax(amplitude))
    low, high = (_RANGE * most, most) if most > 0.0 else (0.0, 1.0)
    label = f"amplitude of the {what}  [{dataset['amplitude'].attrs['units']}]"
    cut = bool(np.nanmin(amplitude) < low), False
    scale = ValueScale(label, low, high, log=low > 0.0, signed=False, cut=cut)
    codes = np.full(amplitude.shape, -1)
    sentence = (
        f"Order map of the {what}. Reference: {dataset.attrs['reference']}."
        f" Windows of {dataset.attrs['turns']} turns."
    )
    return ClassMap(x, y, codes, (), [], values=amplitude, scale=scale), sentence


def _over_frequency(dataset: xr.Dataset) -> xr.Dataset:
    """The amplitudes over speed [rpm] and frequency [Hz], nan beyond the highest order.

    The dimension of the frequency keeps the name ``order``.
    """
    speed, order = dataset["speed"].to_numpy(), dataset["order"].to_numpy()
    turns = speed / (2.0 * np.pi)
    frequency = np.linspace(0.0, order[-1] * turns.max(), order.size)
    rows = [
        np.interp(frequency, order * turn, values, left=np.nan, right=np.nan)
        for turn, values in zip(turns, dataset["amplitude"].to_numpy(), strict=True)
    ]
    over = dataset["amplitude"].copy(data=np.array(rows))
    return dataset.assign(amplitude=over).assign_coords(speed=60.0 * turns, order=frequency)
