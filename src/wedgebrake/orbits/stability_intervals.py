"""The intervals of a branch in which it is stable."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray


class StabilityInterval(NamedTuple):
    """Points ``first`` to ``last`` of a branch, all stable or not; neighbours share a point."""

    first: int
    last: int
    stable: bool


def stability_intervals(
    stable: NDArray[np.bool_], marginal: NDArray[np.bool_]
) -> list[StabilityInterval]:
    """Divide a branch where its stability changes.

    stable   : (n,) of each point
    marginal : (n,) where a multiplier is on the unit circle but for rounding, as at a
               bifurcation: there the neighbours decide
    """
    if stable.size < 2:
        return [StabilityInterval(0, 0, bool(stable[0]))] if stable.size else []
    first, last = stable[:-1], stable[1:]
    steps = np.where(
        marginal[:-1] == marginal[1:], first & last, np.where(marginal[:-1], last, first)
    )
    edges = (np.flatnonzero(np.diff(steps)) + 1).tolist()
    ends = zip([0, *edges], [*edges, steps.size], strict=True)
    return [StabilityInterval(a, b, bool(steps[a])) for a, b in ends]
