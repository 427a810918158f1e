"""Axes of pictures over parameters: a parameter on the page, swept parameters of a dataset."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wedgebrake.arrays import FloatArray
from wedgebrake.errors import InputError
from wedgebrake.figures import style
from wedgebrake.figures.data.limits import round_step
from wedgebrake.model.validation import wrong

if TYPE_CHECKING:
    import xarray as xr


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
        return f"{self.symbol or self.words} = {style.number(self.rounded(position))}"


def round_values(low: float, high: float, most: int) -> list[float]:
    """Multiples of 1, 2 or 5 times a power of ten, in at most ``most`` steps."""
    step = round_step(0.999 * (high - low) / most)
    first, last = math.ceil(low / step - 1e-6), math.floor(high / step + 1e-6)
    return [float(f"{k * step:.10g}") for k in range(first, last + 1)]


def round_values_log(low: float, high: float, most: int) -> list[float]:
    """Round values, approximately ``most``, in about equal ratios."""
    powers = range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)
    for shares in ((1.0, 2.0, 3.0, 5.0), (1.0, 2.0, 5.0), (1.0, 3.0), (1.0,)):
        values = [float(f"{share}e{power}") for power in powers for share in shares]
        inside = [one for one in values if low * 0.999 <= one <= high * 1.001]
        if len(inside) <= most:
            break
    if len(inside) < 2:
        inside = [one for one in round_values(low, high, most) if one > 0.0]
    return inside[:: -(-len(inside) // most)]


@dataclass(frozen=True, eq=False)
class SweptAxis:
    """One swept parameter along an axis of a picture.

    Positions along the axis are values or, if ``log``, their logarithms to the base 10.

    values : ascending, (n,)
    edges  : of the cells about the values, (n + 1,)
    log    : the values are evenly spaced in their logarithm
    """

    name: str
    label: str
    values: FloatArray
    edges: FloatArray
    log: bool

    @classmethod
    def of(cls, dataset: xr.Dataset, name: str) -> SweptAxis:
        """Axis of a swept parameter. Raises ``InputError`` for values that are not finite."""
        coordinate = dataset[name]
        given = coordinate.to_numpy()
        if given.dtype.kind not in "iuf" or not np.all(np.isfinite(given)):
            raise InputError(f"{name}: values of the axis must be finite numbers.")
        values = np.sort(given).astype(float)
        log = bool(values[0] > 0.0 and not _evenly(values) and _evenly(np.log(values)))
        edges = _edges(np.log10(values) if log else values)
        return cls(name, label(coordinate), values, 10.0**edges if log else edges, log)

    @classmethod
    def from_edges(cls, edges: FloatArray, *, log: bool = False) -> SweptAxis:
        """Axis of cells between edges, without a parameter."""
        middle = np.sqrt(edges[1:] * edges[:-1]) if log else 0.5 * (edges[1:] + edges[:-1])
        return cls("", "", middle, edges, log)

    @property
    def even(self) -> bool:
        """True if all cells are equally wide on a linear axis."""
        return not self.log and _evenly(self.edges)

    def positions(self, values: FloatArray) -> FloatArray:
        """Positions of values."""
        return np.log10(values) if self.log else np.asarray(values, dtype=float)

    def at(self, positions: Any) -> Any:
        """Values at positions."""
        return 10.0**positions if self.log else positions


def swept_parameters(dataset: Any) -> list[str]:
    """Swept parameters of a dataset that are still dimensions; [] if it is not a sweep."""
    known = getattr(dataset, "data_vars", {})
    if any(name not in known for name in ("motion", "order", "status", "settling")):
        return []
    names = [str(name) for name in dataset["status"].dims if name != "branch"]
    if all(name in dataset.coords for name in names) and dataset["status"].size:
        return names
    return []


def require_swept(dataset: xr.Dataset, number: int) -> list[str]:
    """Names of the swept parameters of a dataset.

    Raises ``InputError`` unless it is a sweep over ``number`` of them.
    """
    names = swept_parameters(dataset)
    if not names:
        results = "wb.sweep(...), wb.bifurcation(...), wb.regime_map(...) or wb.basins(...)"
        raise wrong("dataset", dataset, f"the result of {results}")
    if len(names) != number:
        one = "one parameter" if number == 1 else "two parameters"
        raise InputError(
            f"dataset: is swept over {', '.join(names)}, but this picture needs a sweep over"
            f" {one}. Choose values of others, for example dataset.isel({names[-1]}=0), or the"
            " picture with wb.plot(dataset)."
        )
    return names


def swept_axes(dataset: xr.Dataset) -> tuple[SweptAxis, SweptAxis]:
    """The axes of a sweep over two parameters, the first to the right."""
    x, y = (SweptAxis.of(dataset, name) for name in require_swept(dataset, 2))
    return x, y


def label(values: xr.DataArray) -> str:
    """The label of a parameter or result: meaning, symbol, unit."""
    meaning, unit = values.attrs.get("long_name", ""), values.attrs.get("units", "1")
    return style.axis_label(str(values.name), str(meaning), str(unit))


def grid_values(values: xr.DataArray, x: SweptAxis, y: SweptAxis) -> NDArray[Any]:
    """Values as (y, x), both ascending; a copy."""
    plain: NDArray[Any] = values.sortby([x.name, y.name]).transpose(y.name, x.name).to_numpy()
    return plain


def runs(values: NDArray[Any]) -> list[tuple[int, int]]:
    """First and last index of each run of equal values."""
    ends = np.append(np.flatnonzero(values[1:] != values[:-1]), values.size - 1)
    starts = np.append(0, ends[:-1] + 1)
    return list(zip(starts.tolist(), ends.tolist(), strict=True))


def true_runs(chosen: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """First and last index of each run of true values."""
    edges = np.flatnonzero(np.diff(chosen.astype(int), prepend=0, append=0)).tolist()
    return [(begin, end - 1) for begin, end in zip(edges[::2], edges[1::2], strict=True)]


def _evenly(values: FloatArray) -> bool:
    """True if steps between values are equal, except for rounding."""
    steps = np.diff(values)
    return steps.size == 0 or bool(np.ptp(steps) <= 1e-6 * abs(float(np.mean(steps))))


def _edges(positions: FloatArray) -> FloatArray:
    """Edges of cells: halfway between their positions, and as far beyond the outer ones."""
    if positions[-1] == positions[0]:
        half = 0.05 * abs(positions[0]) or 0.5
        return np.linspace(positions[0] - half, positions[0] + half, positions.size + 1)
    middle = 0.5 * (positions[1:] + positions[:-1])
    first, last = 2.0 * positions[0] - middle[0], 2.0 * positions[-1] - middle[-1]
    return np.concatenate(([first], middle, [last]))
