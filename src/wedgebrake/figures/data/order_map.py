"""Contents of the picture of an order map."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from wedgebrake.errors import InputError
from wedgebrake.figures.data.axes import SweptAxis
from wedgebrake.figures.data.limits import FloatArray

if TYPE_CHECKING:
    import xarray as xr


# Lowest order shown: lower ones hold the mean and its trend over a window.
_LOWEST = 0.5


@dataclass(frozen=True, eq=False)
class OrderMap:
    """Amplitudes over speed and order.

    amplitude : (orders, speeds)
    label     : of the amplitudes
    sentences : on the map
    """

    speed: SweptAxis
    order: SweptAxis
    amplitude: FloatArray
    label: str
    sentences: tuple[str, ...]

    @classmethod
    def of(cls, dataset: xr.Dataset) -> OrderMap:
        """Contents for a dataset of ``wb.order_map``.

        Raises ``InputError`` for a map of a single speed or order.
        """
        shown = dataset.isel(order=np.flatnonzero(dataset["order"] >= _LOWEST))
        if min(shown.sizes["speed"], shown.sizes["order"]) < 2:
            raise InputError(
                f"dataset: a picture needs two speeds, and two orders from {_LOWEST:g} on."
            )
        variable, part = (str(dataset.attrs[name]) for name in ("variable", "part"))
        what = f"{variable.replace('_', ' ')} of {part}"
        sentence = (
            f"Order map of the {what}. Reference: {dataset.attrs['reference']}."
            f" Windows of {dataset.attrs['turns']} turns."
        )
        return cls(
            replace(SweptAxis.of(shown, "speed"), label="speed of the reference  [rad/s]"),
            replace(SweptAxis.of(shown, "order"), label="order  [cycles per turn]"),
            shown["amplitude"].sortby(["speed", "order"]).transpose("order", "speed").to_numpy(),
            f"amplitude of the {what}  [{dataset['amplitude'].attrs['units']}]",
            (sentence,),
        )
