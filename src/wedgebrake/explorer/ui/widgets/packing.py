"""What a part shows, as text for its script."""

from __future__ import annotations

import json
import math
from typing import Any


def packed(state: Any) -> str:
    """A state of plain values as JSON, with null for numbers that are not finite.

    As text because Panel and Bokeh look into every corner of a dict, several times.
    """
    try:
        return json.dumps(state, allow_nan=False)
    except ValueError:
        return json.dumps(_finite(state))


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {name: _finite(one) for name, one in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(one) for one in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
