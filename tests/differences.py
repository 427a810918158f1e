"""Derivatives by differences, for the matrices that the package computes otherwise."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np


def jacobian(function: Callable[[Any], Any], at: Any, step: Any) -> np.ndarray:
    """(values, entries) derivative of a function of a vector, by differences of fourth order.

    Those of the central differences with a step and with twice the step that Richardson
    extrapolates.

    step : of all entries, or of each
    """
    at = np.asarray(at, dtype=float)
    columns = []
    for move in np.diag(np.broadcast_to(step, at.shape)):
        near, far = (
            np.asarray(function(at + k * move)) - np.asarray(function(at - k * move))
            for k in (1.0, 2.0)
        )
        columns.append((8.0 * near - far) / (12.0 * move.sum()))
    return np.stack(columns, axis=1)
