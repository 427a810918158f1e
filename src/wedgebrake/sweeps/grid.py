"""The grid of a sweep: its shape, its points, and how they are shared out."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from wedgebrake.sweeps.axes import Axis

BRANCH = "branch"
BRANCHES = ("up", "down")


@dataclass(frozen=True, eq=False)
class Grid:
    """Axes, and the dimension along which each point follows its neighbour, if any."""

    axes: tuple[Axis, ...]
    follow: str | None = None

    @property
    def sizes(self) -> dict[str, int]:
        """Points along each dimension: "branch" first, where there is one."""
        sizes = {axis.dim: axis.size for axis in self.axes}
        return sizes if self.follow is None else {BRANCH: len(BRANCHES), **sizes}

    @property
    def points(self) -> int:
        """How many points there are."""
        return math.prod(self.sizes.values())

    def chunk_shape(self, target: int) -> dict[str, int]:
        """Chunks of at most about ``target`` points; a followed line is never cut."""
        shape, room = dict.fromkeys(self.sizes, 1), max(1, target)
        whole = () if self.follow is None else (BRANCH, self.follow)
        for name in whole:
            shape[name] = self.sizes[name]
            room = max(1, room // self.sizes[name])
        for name in reversed(list(self.sizes)):
            if name not in whole:
                shape[name] = min(self.sizes[name], room)
                room = max(1, room // shape[name])
        return shape


def batches(sizes: dict[str, int], follow: str | None, most: int) -> list[NDArray[np.int64]]:
    """The points of a chunk in batches of work: flat numbers within the chunk.

    Without following, at most ``most`` points each. With it, each batch is one line, in
    the order in which its points follow each other.
    """
    numbers = np.arange(math.prod(sizes.values())).reshape(tuple(sizes.values()))
    if follow is None:
        flat = numbers.ravel()
        return [flat[i : i + most] for i in range(0, flat.size, most)]
    lines = np.moveaxis(numbers, list(sizes).index(follow), -1)
    up, down = (one.reshape(-1, lines.shape[-1]) for one in lines)
    return [*up, *down[:, ::-1]]
