"""Numbers in inputs of the page."""

from __future__ import annotations

import math
import re
from typing import Any

from wedgebrake.errors import InputError
from wedgebrake.model.validation import check_number

# Largest magnitude of the ends of a range: their difference must be finite too.
_FARTHEST = 1e300
# Characters of an input that are read.
_LONGEST = 5000


def number_text(value: float, *, whole: bool = False) -> str:
    """Return a number as text for an input."""
    return str(round(value)) if whole else repr(float(f"{value:.5g}")).removesuffix(".0")


def parsed_numbers(text: str) -> list[float] | None:
    """Return the numbers in a text, separated by commas, semicolons or blanks; None if invalid.

    A single number may have a decimal comma.
    """
    text = text.strip().replace("−", "-")
    if len(text) > _LONGEST:
        return None
    if re.fullmatch(r"[+-]?\d*,\d+", text):
        text = text.replace(",", ".")
    try:
        numbers = [float(one) for one in re.split(r"[\s,;]+", text) if one]
    except ValueError:
        return None
    return numbers if numbers and all(math.isfinite(one) for one in numbers) else None


def check_span(name: str, low: Any, high: Any) -> tuple[float, float]:
    """The ends of a range as numbers.

    Raises ``InputError`` unless they are finite numbers, the first below the last.
    """
    first, last = (
        check_number(f"{name}, {end}", value, -_FARTHEST, _FARTHEST, "a number")
        for end, value in (("from", low), ("to", high))
    )
    if not first < last:
        raise InputError(
            f"{name} from {first:g} to {last:g}: the first value must be below the last one."
        )
    return first, last
