"""Contents of the pictures of linear stability of a machine over its speed or one parameter."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wedgebrake.figures import style
from wedgebrake.figures.data import caption
from wedgebrake.figures.data.axes import SweptAxis
from wedgebrake.figures.data.parameter_lines import (
    DASHES,
    Level,
    Line,
    Panel,
    ParameterLines,
    intervals,
)

if TYPE_CHECKING:
    import xarray as xr

FloatArray = NDArray[np.float64]

# Axis labels of the kinds of limits.
_KINDS = {
    "slope": "limit of slope\n[N s/rad]",
    "friction": "limit of friction\n[1]",
    "damping": "limit of damping\n[N m s/rad]",
}
_LIMITS = (
    "Stability limits: values nearest to the present ones (dashed) at which the verdict on steady"
    " sliding changes, one parameter at a time. Red: sliding is unstable; green: stable."
)
# Values beyond this multiple of both the median magnitude of a curve and its present value are not
# shown.
_FAR = 20.0


def of_limits(dataset: xr.Dataset) -> ParameterLines:
    """Curves for a result of ``wb.stability_limits``: damping ratios and limits."""
    dataset = dataset.sortby("speed")
    label = f"{dataset['speed'].attrs.get('long_name', 'sliding speed')}  [rad/s]"
    x = replace(SweptAxis.of(dataset, "speed"), label=label)
    ratios, frequencies = (dataset[name].to_numpy() for name in ("damping_ratio", "frequency"))
    lines = []
    for number in range(ratios.shape[1]):
        name = _mode_name(frequencies[:, number])
        lines.append(_line(name, ratios[:, number], number))
    panels = [Panel("damping ratio\n[1]", tuple(lines), (Level("", 0.0),))]
    limited = {
        str(name): bool(np.any(np.isfinite(dataset[str(name)])))
        for name in dataset["parameter"].to_numpy()
    }
    for kind in _KINDS:
        names = [one for one in _of_kind(dataset, kind) if limited[one]]
        if names:
            panels.append(_panel(dataset, kind, names))
    stable = dataset["stable"].to_numpy().astype(bool)
    shaded = intervals(x, ~stable)
    own = float(dataset.attrs.get("own_speed", 0.0))
    sentences = [
        *caption.sentences(dataset, []),
        _LIMITS,
    ]
    free = [name for name, one in limited.items() if not one]
    if free:
        sentences.append(f"No stability limit: {', '.join(free)}.")
    if own > 0.0:
        sentences.append("Dotted: the machine's own speed.")
    return ParameterLines(x, tuple(panels), tuple(sentences), shaded, own if own > 0.0 else None)


def of_map(dataset: xr.Dataset, name: str) -> ParameterLines:
    """Curves for a result of ``wb.stability_map`` for a machine over one parameter."""
    dataset = dataset.sortby(name)
    x = SweptAxis.of(dataset, name)
    growth, ratio, frequency = (
        dataset[one].to_numpy() for one in ("growth_rate", "damping_ratio", "frequency")
    )
    zero = (Level("", 0.0),)
    panels = (
        Panel("smallest damping\nratio  [1]", (_line("", ratio, 0),), zero),
        Panel("largest growth\nrate  [1/s]", (_line("", growth, 0),), zero),
        Panel("frequency\n[Hz]", (_line("", frequency, 0),), zero=True),
    )
    shaded = intervals(x, ~dataset["stable"].to_numpy().astype(bool))
    sentences = [
        *caption.sentences(dataset, [name]),
        "Linear stability of steady sliding: least damped mode. Red: unstable, or no sliding.",
    ]
    return ParameterLines(x, panels, tuple(sentences), shaded)


def _of_kind(dataset: xr.Dataset, kind: str) -> list[str]:
    """Parameters of a kind."""
    names = map(str, dataset["parameter"].to_numpy())
    return [one for one in names if dataset[one].attrs.get("kind") == kind]


def _panel(dataset: xr.Dataset, kind: str, names: list[str]) -> Panel:
    """The limits of the parameters of a kind, with their present values."""
    lines = []
    for number, name in enumerate(names):
        values = dataset[name].to_numpy().astype(float)
        known = np.abs(values[np.isfinite(values)])
        present = abs(float(dataset[name].attrs["present"]))
        most = _FAR * max(float(np.median(known)) if known.size else 0.0, present)
        shown = np.where(np.abs(values) <= most, values, np.nan) if most > 0.0 else values
        lines.append(_line(name, shown, number, points=True))
    present_values = sorted({float(dataset[name].attrs["present"]) for name in names})
    levels = tuple(Level("present" if len(names) == 1 else "", one) for one in present_values)
    filled = _stable_range(dataset, names[0]) if len(names) == 1 else None
    return Panel(_KINDS[kind], tuple(lines), levels, filled, zero=kind != "slope")


def _stable_range(dataset: xr.Dataset, name: str) -> FloatArray:
    """Range of a parameter on the stable side of its limit, (n, 2)."""
    sides = dataset["stable_side"].sel(parameter=name).to_numpy()
    limits = dataset[name].to_numpy().astype(float)
    stable = dataset["stable"].to_numpy().astype(bool)
    low = np.where(sides > 0, limits, -np.inf)
    high = np.where(sides < 0, limits, np.inf)
    none = (sides == 0) & ~stable
    return np.column_stack((np.where(none, np.nan, low), np.where(none, np.nan, high)))


def _line(name: str, values: Any, number: int, *, points: bool = False) -> Line:
    colours = style.PARTS
    dashes = DASHES[(number // len(colours)) % len(DASHES)]
    return Line(name, np.asarray(values, float), colours[number % len(colours)], dashes, points)


def _mode_name(frequencies: FloatArray) -> str:
    """The name of a mode: its frequency, or the range of its frequencies."""
    known = frequencies[np.isfinite(frequencies)]
    if not known.size:
        return ""
    low, high = (f"{one:.3g}" for one in (known.min(), known.max()))
    return f"{low} Hz" if low == high else f"{low} to {high} Hz"
