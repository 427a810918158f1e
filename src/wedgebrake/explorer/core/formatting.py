"""Numbers and sentences as they are printed on the page."""

from __future__ import annotations

_NUMBERS = (
    "no", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten", "eleven",
    "twelve",
)  # fmt: skip


def plain(value: float, digits: int = 4) -> str:
    """A number to so many digits, with a true minus sign."""
    text = f"{value:.{digits}g}"
    if "e" in text and 1.0 <= abs(value) < 1e6:
        text = f"{float(text):.0f}"
    return text.replace("-", "−")


def signed(value: float) -> str:
    """A number to three digits, with its sign."""
    return ("+" if value > 0.0 else "") + plain(value, 3)


def duration(seconds: float) -> str:
    """A time in the unit that suits it."""
    for unit, size in (("s", 1.0), ("ms", 1e-3)):
        if seconds >= size:
            return f"{plain(seconds / size, 2)} {unit}"
    return f"{plain(seconds * 1e6, 2)} µs"


def counted(count: int) -> str:
    """A count, in a word up to twelve."""
    return _NUMBERS[count] if count < len(_NUMBERS) else str(count)


def upper(words: str) -> str:
    """A sentence with a capital at its beginning."""
    return words[:1].upper() + words[1:]
