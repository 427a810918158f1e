"""First-order and total Sobol indices, from Saltelli's design."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from wedgebrake.arrays import FloatArray
from wedgebrake.sweeps.outcomes import NORMAL95

if TYPE_CHECKING:
    import xarray as xr

# Resamplings of the bootstrap, and their numbers that are held in memory at once.
_RESAMPLINGS = 500
_AT_ONCE = 2**22


def design(points: FloatArray) -> FloatArray:
    """Points of the design, ((k + 2) n, k), from Sobol points of 2 k dimensions, (n, 2 k).

    The blocks are A, B, and, for each parameter, A with this parameter from B.
    """
    a, b = np.hsplit(points, 2)
    mixed = []
    for i in range(a.shape[1]):
        one = a.copy()
        one[:, i] = b[:, i]
        mixed.append(one)
    return np.concatenate([a, b, *mixed])


def with_indices(
    dataset: xr.Dataset, values: Mapping[str, FloatArray], parameters: list[str], seed: int
) -> xr.Dataset:
    """Add ``S1`` and ``ST``, with the half-widths of their 95 % intervals, to a dataset.

    values : of each quantity at the points of the design, ((k + 2) n,); a row of the design with a
             value that is not finite is left out
    """
    k, count = len(parameters), len(values)
    tables = {name: np.full((count, k), np.nan) for name in ("S1", "S1_conf", "ST", "ST_conf")}
    used = np.zeros(count, np.int64)
    for row, one in enumerate(values.values()):
        blocks = one.reshape(k + 2, -1)
        blocks = blocks[:, np.isfinite(blocks).all(axis=0)]
        used[row] = blocks.shape[1]
        if used[row] < 2:
            continue
        first, total = _indices(blocks, np.arange(used[row])[None])
        spread = _bootstrap(blocks, seed)
        for name, found in zip(tables, (first[0], spread[0], total[0], spread[1]), strict=True):
            tables[name][row] = found
    words = {
        "S1": "first-order Sobol index",
        "S1_conf": "half-width of the 95 % interval of S1",
        "ST": "total Sobol index",
        "ST_conf": "half-width of the 95 % interval of ST",
    }
    dims = ("effect", "parameter")
    return dataset.assign(
        {name: (dims, tables[name], {"units": "1", "long_name": words[name]}) for name in tables}
    ).assign(
        index_samples=(
            "effect", used, {"units": "1", "long_name": "rows of the design with all values known"}
        )
    ).assign_coords(effect=list(values), parameter=parameters)  # fmt: skip


def _indices(blocks: FloatArray, rows: NDArray[np.int64]) -> tuple[FloatArray, FloatArray]:
    """S1 (Saltelli 2010) and ST (Jansen 1999) for samples of rows, (m, n): (m, k) each."""
    blocks = blocks - blocks[:2].mean()
    a, b, mixed = blocks[0][rows], blocks[1][rows], blocks[2:][:, rows]
    variance = np.concatenate([a, b], axis=1).var(axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        first = (b * (mixed - a)).mean(axis=2) / variance
        total = 0.5 * ((a - mixed) ** 2).mean(axis=2) / variance
    constant = variance == 0.0
    first[:, constant] = total[:, constant] = np.nan
    return first.T, total.T


def _bootstrap(blocks: FloatArray, seed: int) -> tuple[FloatArray, FloatArray]:
    """Half-widths of the 95 % intervals of S1 and ST, (k,) each, by a bootstrap of the rows."""
    random = np.random.default_rng(seed)
    n = blocks.shape[1]
    step = max(1, _AT_ONCE // blocks.size)
    found = [
        _indices(blocks, random.integers(0, n, (min(step, _RESAMPLINGS - begin), n)))
        for begin in range(0, _RESAMPLINGS, step)
    ]
    first, total = (np.concatenate(one) for one in zip(*found, strict=True))
    return NORMAL95 * first.std(axis=0, ddof=1), NORMAL95 * total.std(axis=0, ddof=1)
