"""Lines of an amplitude spectrum, with names from the known frequencies."""

from __future__ import annotations

import ast
import math
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from wedgebrake.analysis.responses.datasets import attributes, dataset_over
from wedgebrake.analysis.responses.spectrum import window_weights
from wedgebrake.arrays import FloatArray
from wedgebrake.model.validation import check_number, check_whole, wrong

if TYPE_CHECKING:
    import xarray as xr


# Largest number of samples for the window's transform: that of a longer window differs by less
# than 1e-6 when expressed in bins. For leakage: table points within a bin.
_LONGEST, _FINE = 4096, 32
# A peak counts if it exceeds the leakage of stronger lines into its bin by this factor.
_CLEAR = 2.0
# Values below this fraction of the largest one are rounding.
_LEAST_HEIGHT = 1e-12
_MOST_LINES = 10**9
# Fractions p/q of f_e are tried up to this q.
_LARGEST_Q = 12

_SPEC: dict[str, tuple[str, str]] = {
    "line": ("1", "rank of the line"),
    "frequency": ("Hz", "frequency of the line"),
    "amplitude": ("", "amplitude of the line"),
    "order": ("1", "frequency / f_e"),
    "multiple": ("1", "m, the nearest multiple of f_e"),
    "offset": ("Hz", "frequency - m f_e"),
    "numerator": ("1", "p, where the frequency is p/q f_e; else 0"),
    "denominator": ("1", "q, where the frequency is p/q f_e; else 0"),
    "natural": ("1", "s, where the frequency is a f_e + s f_n with a whole number a; else 0"),
    "label": ("1", "name of the line"),
}
# Results of ``_describe`` for a line.
_DESCRIPTION: dict[str, Any] = {
    "order": float,
    "multiple": np.int64,
    "offset": float,
    "numerator": np.int64,
    "denominator": np.int64,
    "natural": np.int8,
    "label": str,
}


class _Known(NamedTuple):
    """Known frequencies and the tolerance of equality [Hz]; 0 if unknown."""

    forcing: float
    natural: float
    tolerance: float


def spectral_lines(spectrum: xr.Dataset, count: int = 12, floor: float = 1e-3) -> xr.Dataset:
    """Return the lines of a spectrum with their names, strongest first.

    A line is a peak that exceeds the leakage of stronger lines through the window. Its
    frequency and amplitude are interpolated: the ratio of the highest bin to the higher of
    its neighbours gives the distance from the bin, by the transform of the window itself
    (for "hann" in closed form 2 - 3/(1 + ratio), Grandke 1983), and that the amplitude. It is
    exact for a single line; two lines closer than the main lobe (4 bins of "hann") are not
    separated.

    Names, with the tolerance of half the resolution (docs/numerics.md, "Energy, torque and
    spectral lines"):

    "mean"            : 0 Hz
    "2 f_e"           : a multiple of the torque's frequency; "f_e = f_n" where both agree
    "f_n"             : the natural frequency of the driveline without brake
    "2/3 f_e"         : q <= 12, as in a motion of q torque periods; p/q must agree to
                        f_e/(8 q^2) too, because there are ever more fractions
    "2 f_e - f_n"     : a side band of the natural frequency
    "f_e + 1.23 Hz"   : anything else, by its distance from the nearest multiple

    Parameters
    ----------
    spectrum : xarray.Dataset
        As returned by ``wb.spectrum``.
    count : int
        Largest number of lines.
    floor : float
        Lines below this share of the strongest one (but 0 Hz) are left out, in [0, 1).

    Returns
    -------
    xarray.Dataset
        Over ``line`` (1, 2, ...): frequency [Hz], amplitude (the spectrum's unit), order
        (frequency/f_e), multiple m (the nearest), offset (frequency - m f_e) [Hz], numerator
        and denominator of p/q (0: none), natural (+1, -1: the offset is that of f_n from its
        nearest multiple, or the negative; 0: neither), label. Where f_e is not known or no
        torque acts, order and offset are nan.
        ``attrs``: quantity, window, resolution, tolerance [Hz], forcing_frequency and
        natural_frequency [Hz] where known, floor.

    Raises
    ------
    InputError
        For a dataset that is not a spectrum, a count below 1 or a floor outside [0, 1).
    """
    attrs: dict[str, Any] = getattr(spectrum, "attrs", {})
    complete = {"window", "resolution", "samples"} <= set(attrs)
    if "amplitude" not in getattr(spectrum, "data_vars", {}) or not complete:
        raise wrong("spectrum", spectrum, "the result of wb.spectrum(response)")
    check_whole("count", count, 1, _MOST_LINES)
    share = "a share of the strongest line in [0, 1), for example 1e-3"
    check_number("floor", floor, 0.0, math.nextafter(1.0, 0.0), share)
    resolution = float(attrs["resolution"])
    bins, amplitudes = _peaks(spectrum, int(count), float(floor))
    forcing, natural = (attrs.get(f"{name}_frequency", 0.0) for name in ("forcing", "natural"))
    known = _Known(float(forcing), float(natural), 0.5 * resolution)
    described = [_describe(float(f), known) for f in bins * resolution]
    values = {
        "line": np.arange(1, bins.size + 1),
        "frequency": bins * resolution,
        "amplitude": amplitudes,
    }
    for i, (name, kind) in enumerate(_DESCRIPTION.items()):
        values[name] = np.array([one[i] for one in described], dtype=kind)
    unit = spectrum["amplitude"].attrs.get("units", "1")
    spec = _SPEC | {"amplitude": (unit, "amplitude of the line")}
    dataset = dataset_over("line", spec, values)
    dataset["natural"].attrs |= {"flag_values": [-1, 0, 1], "flag_meanings": "minus neither plus"}
    kept = ("quantity", "window", "resolution", "forcing_frequency", "natural_frequency")
    dataset.attrs = attributes(spectrum, *kept)
    return dataset.assign_attrs(tolerance=known.tolerance, floor=float(floor))


def _peaks(spectrum: xr.Dataset, count: int, floor: float) -> tuple[FloatArray, FloatArray]:
    """Return frequencies in bins and amplitudes of the lines, strongest first."""
    n = int(spectrum.attrs["samples"])
    window = _Window(str(spectrum.attrs["window"]), n)
    # As in the two-sided spectrum, where the window's transform is the same at every line.
    height = spectrum["amplitude"].to_numpy().astype(float)
    height[1 : (n + 1) // 2] *= 0.5
    rising = np.append(True, height[1:] > height[:-1])
    falling = np.append(height[:-1] >= height[1:], True)
    peaks = np.flatnonzero(rising & falling)
    peaks = peaks[np.argsort(-height[peaks], kind="stable")]
    oscillating = height[peaks[peaks > 0]].max(initial=0.0)
    least = max(floor * oscillating, _LEAST_HEIGHT * float(height.max()))
    found: list[tuple[float, float]] = []
    for k in peaks[height[peaks] > least]:
        places, heights = np.array(found).reshape(-1, 2).T
        leaked = heights @ window.leak(np.abs(places - k))
        leaked += heights[places > 0.0] @ window.leak(places[places > 0.0] + k)
        if height[k] > _CLEAR * leaked:
            found.append(_interpolated(height, int(k), window))
        if len(found) == count:
            break
    places, heights = np.array(found).reshape(-1, 2).T
    alone = (places == 0.0) | (places == 0.5 * n)
    amplitudes = np.where(alone, heights, 2.0 * heights)
    order = np.argsort(-amplitudes, kind="stable")
    return places[order], amplitudes[order]


class _Window:
    """Magnitude of the transform of a window of n samples over the distance in bins, 1 at 0."""

    def __init__(self, window: str, n: int) -> None:
        try:
            name = ast.literal_eval(window)
        except (ValueError, SyntaxError):
            name = window
        size = min(n, _LONGEST)
        weights = window_weights(name, size)
        self.weights = weights / weights.sum()
        self.table = np.abs(np.fft.rfft(self.weights, _FINE * size))

    def at(self, distance: float) -> float:
        """Return the transform at a distance in bins."""
        turns = distance / self.weights.size * np.arange(self.weights.size)
        return float(abs(self.weights @ np.exp(-2j * np.pi * turns)))

    def leak(self, distance: FloatArray) -> FloatArray:
        """Interpolate the transform at many distances from the table."""
        return np.interp(distance * _FINE, np.arange(self.table.size), self.table)

    def distance(self, ratio: float) -> float:
        """Return the distance of a line from the highest bin, given the ratio of its neighbour."""
        from scipy.optimize import brentq

        if ratio <= self.at(1.0) or ratio >= 1.0:
            return 0.0 if ratio < 1.0 else 0.5
        return float(brentq(lambda x: self.at(1.0 - x) - ratio * self.at(x), 0.0, 0.5))


def _interpolated(height: FloatArray, k: int, window: _Window) -> tuple[float, float]:
    """Return the position in bins and the height of the line whose highest bin is ``k``."""
    if k in (0, height.size - 1):
        return float(k), float(height[k])
    left, right = height[k - 1], height[k + 1]
    distance = window.distance(float(max(left, right) / height[k]))
    place = k + distance if right > left else k - distance
    return place, float(height[k]) / window.at(distance)


def _describe(f: float, known: _Known) -> tuple[Any, ...]:
    """Describe a line at a frequency [Hz], as ``_DESCRIPTION``."""
    forcing, tolerance = known.forcing, known.tolerance
    if forcing <= 0.0:
        free = known.natural > 0.0 and abs(f - known.natural) <= tolerance
        label = "mean" if f == 0.0 else "f_n" if free else _hertz(f, known)
        return math.nan, 0, math.nan, 0, 0, int(free), label
    # Half-way between two multiples the lower one, also if rounding raises the line slightly.
    multiple = math.ceil((f - tolerance) / forcing - 0.5)
    offset = f - multiple * forcing
    fraction = _fraction(f / forcing, tolerance / forcing)
    side, whole = _side_band(f, known)
    if f == 0.0:
        label = "mean"
    elif fraction[1] == 1 and multiple:
        label = _times(multiple, "f_e") + (" = f_n" if (side, whole) == (1, 0) else "")
    elif (side, whole) == (1, 0):
        label = "f_n"
    elif fraction[1] > 1:
        label = f"{fraction[0]}/{fraction[1]} f_e"
    elif side:
        times = _times(abs(whole), "f_e")
        label = f"f_n - {times}" if whole < 0 else f"{times} {'+' if side > 0 else '-'} f_n"
    elif multiple:
        sign = "+" if offset > 0.0 else "-"
        label = f"{_times(multiple, 'f_e')} {sign} {_hertz(abs(offset), known)}"
    else:
        label = _hertz(f, known)
    return f / forcing, multiple, offset, *fraction, side, label


def _fraction(order: float, tolerance: float) -> tuple[int, int]:
    """Return (p, q) of the fraction with the smallest q that equals an order, or (0, 0)."""
    for q in range(1, _LARGEST_Q + 1):
        p = round(order * q)
        allowed = tolerance if q == 1 else min(tolerance, 0.125 / q**2)
        if abs(order - p / q) <= allowed:
            return p, q
    return 0, 0


def _side_band(f: float, known: _Known) -> tuple[int, int]:
    """Return (s, a) such that f = a f_e + s f_n, with s = 0 if there is none."""
    forcing, natural, tolerance = known
    if natural > 0.0:
        for side in (1, -1):
            whole = round((f - side * natural) / forcing)
            if abs(f - side * natural - whole * forcing) <= tolerance:
                return side, whole
    return 0, 0


def _times(number: int, symbol: str) -> str:
    return symbol if number == 1 else f"{number} {symbol}"


def _hertz(f: float, known: _Known) -> str:
    """Format a frequency [Hz] to a tenth of the tolerance."""
    digits = max(0, math.ceil(-math.log10(0.1 * known.tolerance)))
    return f"{f:.{digits}f} Hz"
