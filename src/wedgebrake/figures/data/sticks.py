"""Sticks of a response as intervals of time."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    import xarray as xr

FloatArray = NDArray[np.float64]


class Sticks(NamedTuple):
    """Intervals during which the brake sticks.

    start, end : (k,) [s]
    side       : (k,) sign of the sliding velocity before; 0: at rest from the start
    """

    start: FloatArray
    end: FloatArray
    side: NDArray[np.int64]

    def by_side(self) -> dict[int, Sticks]:
        """Sticks by their side, those after v > 0 first; sides without sticks are left out."""
        return {side: self.where(self.side == side) for side in (1, -1, 0) if side in self.side}

    def where(self, chosen: NDArray[np.bool_]) -> Sticks:
        """Return the chosen ones."""
        return Sticks(self.start[chosen], self.end[chosen], self.side[chosen])

    def merged(self, gap: float, most: int) -> Sticks:
        """Sticks of the same side not farther apart than a gap [s] as one.

        Where more than ``most`` remain, those of different sides are merged too.
        """
        if self.start.size < 2:
            return self
        far = self.start[1:] - self.end[:-1] > gap
        apart = far | (np.diff(self.side) != 0)
        if np.count_nonzero(apart) > most:
            apart = far
        first, last = np.append(True, apart), np.append(apart, True)
        return Sticks(self.start[first], self.end[last], self.side[first])


def sticks_between(response: xr.Dataset, begin: float, end: float) -> Sticks:
    """Sticks of a response with a part between two times [s], cut there."""
    start, stop, side = (response[f"stick_{one}"].to_numpy() for one in ("start", "end", "entry"))
    found = Sticks(np.maximum(start, begin), np.minimum(stop, end), side.astype(np.int64))
    return found.where((start <= end) & ((stop > begin) | (start >= begin) | (stop >= end)))
