"""A parameter as an axis of a picture: its values, its places, round numbers along it."""

from __future__ import annotations

import html
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from wedgebrake.explorer.core.fields import label, symbol
from wedgebrake.explorer.core.parameter_ranges import scale, span
from wedgebrake.explorer.core.state import Desk
from wedgebrake.model.sweep_settings import sweepable

FloatArray = NDArray[np.float64]

_LOWERED = str.maketrans("0123456789aehklmnoprstuvx", "₀₁₂₃₄₅₆₇₈₉ₐₑₕₖₗₘₙₒₚᵣₛₜᵤᵥₓ")
_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
# Digits of the span that a chosen value keeps.
_DIGITS = 4


@dataclass(frozen=True)
class Axis:
    """A parameter between two values, along equal steps or, ``log``, equal ratios.

    Places are what is drawn: values, or their logarithms to the base 10.
    """

    name: str
    low: float
    high: float
    log: bool = False
    symbol: str = ""
    words: str = ""
    unit: str = "1"

    @classmethod
    def of(cls, desk: Desk, name: str) -> Axis:
        """The axis of a parameter of the machine on a desk.

        Raises ``InputError`` for a parameter that the machine does not have.
        """
        low, high = span(desk, name)
        unit = sweepable(desk.system).get(name, ("1", ""))[0]
        log = scale(name) == "log" and low > 0.0
        return cls(name, low, high, log, plain(symbol(name)), label(name), unit)

    @property
    def title(self) -> str:
        """Words, symbol and unit."""
        unit = "" if self.unit in ("1", "-") else f"  [{self.unit.replace('^2', '²')}]"
        return f"{self.words}  {self.symbol}{unit}".strip()

    @property
    def ends(self) -> tuple[float, float]:
        """The outermost places."""
        return self.place(self.low), self.place(self.high)

    def place(self, value: float) -> float:
        """Where a value lies; nan where it lies nowhere."""
        if not self.log:
            return float(value)
        return math.log10(value) if value > 0.0 else math.nan

    def value(self, place: float) -> float:
        """The value at a place."""
        return 10.0**place if self.log else place

    def places(self, cells: int) -> FloatArray:
        """Middles of so many equal cells, as places, (cells,)."""
        low, high = self.ends
        shares = (np.arange(cells) + 0.5) / cells
        middles: FloatArray = low + (high - low) * shares
        return middles

    def values(self, cells: int) -> FloatArray:
        """The values there, (cells,)."""
        places = self.places(cells)
        return np.asarray(10.0**places) if self.log else places

    def chosen(self, place: float) -> float:
        """The value at a place inside the axis, to about four digits of the span."""
        low, high = self.ends
        place = min(max(place, low), high)
        if self.log:
            return float(f"{10.0**place:.{_DIGITS}g}")
        digits = _DIGITS - 1 - math.floor(math.log10(high - low))
        return round(place, digits) + 0.0  # no negative zero

    def holds(self, place: float) -> bool:
        """Whether a place lies inside the axis."""
        low, high = self.ends
        return low <= place <= high

    def said(self, place: float) -> str:
        """The value at a place, as for a person."""
        return f"{self.symbol or self.words} = {number(self.chosen(place))}"

    def ticks(self, most: int) -> dict[float, str]:
        """Round values, at most about so many, by their places."""
        return _log_ticks(self.low, self.high, most) if self.log else _ticks(*self.ends, most)


def picked(axes: Sequence[Axis], places: Sequence[float]) -> dict[str, float]:
    """The values at a place inside a picture, by name; nothing for a place beside it."""
    pairs = list(zip(axes, places, strict=True))
    if not all(axis.holds(place) for axis, place in pairs):
        return {}
    return {axis.name: axis.chosen(place) for axis, place in pairs}


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


def _ticks(low: float, high: float, most: int) -> dict[float, str]:
    least = (high - low) / most
    power = 10.0 ** math.floor(math.log10(least))
    step = power * min(one for one in (1.0, 2.0, 5.0, 10.0) if one * power >= 0.999 * least)
    first, last = math.ceil(low / step - 1e-6), math.floor(high / step + 1e-6)
    values = [float(f"{k * step:.10g}") for k in range(first, last + 1)]
    return {value: number(value) for value in values}


def _log_ticks(low: float, high: float, most: int) -> dict[float, str]:
    powers = range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)
    for shares in ((1.0, 2.0, 3.0, 5.0), (1.0, 2.0, 5.0), (1.0, 3.0), (1.0,)):
        values = [share * 10.0**power for power in powers for share in shares]
        inside = [one for one in values if low * 0.999 <= one <= high * 1.001]
        if len(inside) <= most:
            break
    if len(inside) < 2:
        return {math.log10(one): text for one, text in _ticks(low, high, most).items() if one > 0.0}
    return {math.log10(one): number(one) for one in inside[:: -(-len(inside) // most)]}
