"""Structured dtypes whose elements have their fields as attributes, in kernels and in Python."""

from collections.abc import Iterable
from typing import Any

import numpy as np


def record(floats: str = "", *, whole: str = "", fields: Iterable[tuple[Any, ...]] = ()) -> Any:
    """Dtype with fields of integers, then of floats (names in a string), or any ``fields``.

    A field with the name of a NumPy scalar's attribute, such as ``size``, is not an attribute
    in plain Python: NumPy's own is returned.
    """
    named: list[Any] = [(name, np.int64) for name in whole.split()]
    named += [(name, np.float64) for name in floats.split()]
    return np.dtype((np.record, np.dtype([*named, *fields], align=True)))
