"""Sobol points, for samples of parameters."""

from __future__ import annotations

import warnings

import numpy as np

from wedgebrake.arrays import FloatArray

# Numbers are kept at this distance from 0 and 1, where a quantile may be infinite.
_EDGE = 2.0**-40


def sobol(count: int, dimensions: int, seed: int) -> FloatArray:
    """Scrambled Sobol points in the open unit cube, (count, dimensions)."""
    from scipy.stats import qmc

    with warnings.catch_warnings():
        # Counts that are not powers of 2 are less balanced.
        warnings.filterwarnings("ignore", "The balance properties", UserWarning)
        points = qmc.Sobol(dimensions, seed=np.random.default_rng(seed)).random(count)
    return np.asarray(np.clip(points, _EDGE, 1.0 - _EDGE))
