"""Contents of the picture of an order map."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from wedgebrake.errors import InputError

if TYPE_CHECKING:
    import xarray as xr

FloatArray = NDArray[np.float64]

# Lowest order shown: lower ones hold the mean and its trend over a window.
_LOWEST = 0.5


@dataclass(frozen=True, eq=False)
class OrderMap:
    """Amplitudes over speed and order.

    speed_edges, order_edges : of the cells
    amplitude : (orders, speeds)
    label     : of the amplitudes
    sentences : on the map
    """

    speed_edges: FloatArray
    order_edges: FloatArray
    amplitude: FloatArray
    label: str
    sentences: tuple[str, ...]

    @classmethod
    def of(cls, dataset: xr.Dataset) -> OrderMap:
        """Contents for a dataset of ``wb.order_map``.

        Raises ``InputError`` for a map of a single speed or order.
        """
        speed, order = (dataset[name].to_numpy() for name in ("speed", "order"))
        if speed.size < 2 or order.size < 2:
            raise InputError("dataset: has one speed or one order only; a picture needs two each.")
        turns = int(dataset.attrs["turns"])
        shown = order >= _LOWEST
        if np.count_nonzero(shown) < 2:
            raise InputError(f"dataset: has fewer than two orders from {_LOWEST:g} on.")
        variable, part = (str(dataset.attrs[name]) for name in ("variable", "part"))
        unit = dataset["amplitude"].attrs["units"]
        words = variable.replace("_", " ")
        sentence = (
            f"Order map of the {words} of {part}. Reference: {dataset.attrs['reference']}."
            f" Windows of {turns} turns."
        )
        return cls(
            _edges(speed),
            _edges(order[shown]),
            dataset["amplitude"].to_numpy()[:, shown].T,
            f"amplitude of the {words} of {part}  [{unit}]",
            (sentence,),
        )


def _edges(values: FloatArray) -> FloatArray:
    """Edges of cells about ascending values."""
    middle = 0.5 * (values[1:] + values[:-1])
    first, last = 2.0 * values[0] - middle[0], 2.0 * values[-1] - middle[-1]
    return np.concatenate([[first], middle, [last]])
