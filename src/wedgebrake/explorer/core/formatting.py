"""Numbers and sentences as shown on the page."""

from __future__ import annotations

import math
import re

_NUMBERS = (
    "no", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten", "eleven",
    "twelve",
)  # fmt: skip

# Characters of an input that are read.
_LONGEST = 5000


def plain(value: float, digits: int = 4) -> str:
    """A number with a given number of digits and a true minus sign."""
    text = f"{value:.{digits}g}"
    if "e" in text and 1.0 <= abs(value) < 1e6:
        text = f"{float(text):.0f}"
    return text.replace("-", "−")


def signed(value: float) -> str:
    """A number with three digits and its sign."""
    return ("+" if value > 0.0 else "") + plain(value, 3)


def duration(seconds: float) -> str:
    """A time in a suitable unit."""
    for unit, size in (("s", 1.0), ("ms", 1e-3)):
        if seconds >= size:
            return f"{plain(seconds / size, 2)} {unit}"
    return f"{plain(seconds * 1e6, 2)} µs"


def counted(count: int) -> str:
    """A count, as a word up to twelve."""
    return _NUMBERS[count] if count < len(_NUMBERS) else str(count)


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
