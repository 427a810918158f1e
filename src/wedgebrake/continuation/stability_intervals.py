"""Along a branch: from where to where it is stable."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray


class Stretch(NamedTuple):
    """Points ``first`` to ``last`` of a branch, all stable or not; neighbours share a point."""

    first: int
    last: int
    stable: bool


def stretches(stable: NDArray[np.bool_], marginal: NDArray[np.bool_]) -> list[Stretch]:
    """The stretches of a branch between changes of stability.

    stable   : (n,) of each point
    marginal : (n,) where a multiplier is on the unit circle but for rounding, as at a
               bifurcation: there the neighbours tell
    """
    if stable.size < 2:
        return [Stretch(0, 0, bool(stable[0]))] if stable.size else []
    first, last = stable[:-1], stable[1:]
    steps = np.where(
        marginal[:-1] == marginal[1:], first & last, np.where(marginal[:-1], last, first)
    )
    edges = np.flatnonzero(np.diff(steps)) + 1
    begins = [0, *edges.tolist()]
    ends = [*edges.tolist(), steps.size]
    return [Stretch(a, b, bool(steps[a])) for a, b in zip(begins, ends, strict=True)]
