"""A parameter between two values as an axis of a picture: positions, ticks, chosen values."""

from __future__ import annotations

import html
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

_LOWERED = str.maketrans("0123456789aehklmnoprstuvx", "₀₁₂₃₄₅₆₇₈₉ₐₑₕₖₗₘₙₒₚᵣₛₜᵤᵥₓ")
_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
# Digits of a rounded value, relative to the length of the axis.
_DIGITS = 4


@dataclass(frozen=True)
class ParameterAxis:
    """A parameter between two values, in equal steps or, ``log``, equal ratios.

    Positions along the axis are values or, if ``log``, their logarithms to the base 10.

    symbol, words, unit : as plain text
    """

    name: str
    low: float
    high: float
    log: bool = False
    symbol: str = ""
    words: str = ""
    unit: str = "1"

    @property
    def title(self) -> str:
        """Words, symbol and unit."""
        unit = "" if self.unit in ("1", "-") else f"  [{self.unit.replace('^2', '²')}]"
        return f"{self.words}  {self.symbol}{unit}".strip()

    @property
    def ends(self) -> tuple[float, float]:
        """The outermost positions."""
        return self.position(self.low), self.position(self.high)

    def position(self, value: float) -> float:
        """Position of a value; nan if it has none."""
        if not self.log:
            return float(value)
        return math.log10(value) if value > 0.0 else math.nan

    def positions(self, cells: int) -> FloatArray:
        """Centres of ``cells`` equal cells, (cells,)."""
        low, high = self.ends
        centres: FloatArray = low + (high - low) * (np.arange(cells) + 0.5) / cells
        return centres

    def values(self, cells: int) -> FloatArray:
        """Values at the centres of ``cells`` equal cells, (cells,)."""
        centres = self.positions(cells)
        return np.asarray(10.0**centres) if self.log else centres

    def rounded(self, position: float) -> float:
        """The value at a position inside the axis, to about four digits of its length."""
        low, high = self.ends
        position = min(max(position, low), high)
        if self.log:
            return float(f"{10.0**position:.{_DIGITS}g}")
        digits = _DIGITS - 1 - math.floor(math.log10(high - low))
        return round(position, digits) + 0.0  # no negative zero

    def contains(self, position: float) -> bool:
        """Return True for a position inside the axis."""
        low, high = self.ends
        return low <= position <= high

    def text(self, position: float) -> str:
        """The value at a position, with symbol: "η = −24"."""
        return f"{self.symbol or self.words} = {number(self.rounded(position))}"

    def ticks(self, most: int) -> dict[float, str]:
        """Round values, approximately ``most``, by their positions."""
        if self.log:
            return _log_ticks(self.low, self.high, most)
        return {one: number(one) for one in round_values(*self.ends, most)}


def selected(axes: Sequence[ParameterAxis], positions: Sequence[float]) -> dict[str, float]:
    """Values at a point of a picture by name; empty for a point outside."""
    pairs = list(zip(axes, positions, strict=True))
    if not all(axis.contains(position) for axis, position in pairs):
        return {}
    return {axis.name: axis.rounded(position) for axis, position in pairs}


def number(value: float) -> str:
    """A number as it is printed: −24, 0.036, 2·10⁴."""
    text = f"{value:.4g}".replace("-", "−")
    if "e" not in text:
        return text
    digits, power = text.split("e")
    raised = str(int(power.replace("−", "-"))).translate(_RAISED)
    return f"{digits}·10{raised}".removeprefix("1·")


def plain(markup: str) -> str:
    """A symbol in HTML as plain text."""
    lowered = re.sub(r"<sub>(.*?)</sub>", lambda found: found.group(1).translate(_LOWERED), markup)
    return html.unescape(re.sub(r"<.*?>", "", lowered))


def round_values(low: float, high: float, most: int) -> list[float]:
    """Multiples of 1, 2 or 5 times a power of ten, in at most ``most`` steps."""
    least = (high - low) / most
    power = 10.0 ** math.floor(math.log10(least))
    step = power * min(one for one in (1.0, 2.0, 5.0, 10.0) if one * power >= 0.999 * least)
    first, last = math.ceil(low / step - 1e-6), math.floor(high / step + 1e-6)
    return [float(f"{k * step:.10g}") for k in range(first, last + 1)]


def _log_ticks(low: float, high: float, most: int) -> dict[float, str]:
    powers = range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)
    for shares in ((1.0, 2.0, 3.0, 5.0), (1.0, 2.0, 5.0), (1.0, 3.0), (1.0,)):
        values = [share * 10.0**power for power in powers for share in shares]
        inside = [one for one in values if low * 0.999 <= one <= high * 1.001]
        if len(inside) <= most:
            break
    if len(inside) < 2:
        inside = [one for one in round_values(low, high, most) if one > 0.0]
    return {math.log10(one): number(one) for one in inside[:: -(-len(inside) // most)]}
