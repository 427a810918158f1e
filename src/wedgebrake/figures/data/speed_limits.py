"""Contents of the pictures of linear stability of a machine over its speed or one parameter."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from wedgebrake.arrays import FloatArray
from wedgebrake.figures.data import caption
from wedgebrake.figures.data.axes import SweptAxis, true_runs
from wedgebrake.figures.data.panels import Level, Panel, lines_of

if TYPE_CHECKING:
    import xarray as xr

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
# Limits beyond this multiple of both the median of a curve and its present value are not shown.
_FAR = 20.0
_DASHES = (4.0, 1.5)
_ZERO = (Level(0.0, dashes=_DASHES),)


@dataclass(frozen=True, eq=False)
class ParameterLines:
    """Panels of curves over one parameter, in ascending order of it.

    shaded : intervals of the parameter that are shaded in panels without a stable range
    own    : marked value of the parameter; None for none
    """

    x: SweptAxis
    panels: tuple[Panel, ...]
    sentences: tuple[str, ...]
    shaded: Sequence[tuple[float, float]] = ()
    own: float | None = None


def of_limits(dataset: xr.Dataset) -> ParameterLines:
    """Curves for a result of ``wb.stability_limits``: damping ratios and limits."""
    dataset = dataset.sortby("speed")
    label = f"{dataset['speed'].attrs.get('long_name', 'sliding speed')}  [rad/s]"
    x = replace(SweptAxis.of(dataset, "speed"), label=label)
    ratios, frequencies = (dataset[name].to_numpy() for name in ("damping_ratio", "frequency"))
    lines = lines_of([_mode_name(one) for one in frequencies.T], x.values, ratios.T)
    panels = [Panel("damping ratio\n[1]", lines, levels=_ZERO)]
    parameters = [str(name) for name in dataset["parameter"].to_numpy()]
    limited = [name for name in parameters if np.any(np.isfinite(dataset[name]))]
    for kind in _KINDS:
        names = [one for one in limited if dataset[one].attrs["kind"] == kind]
        if names:
            panels.append(_panel(dataset, x, kind, names))
    own = float(dataset.attrs.get("own_speed", 0.0))
    sentences = [*caption.sentences(dataset, []), _LIMITS]
    if np.any(~dataset["stable"].to_numpy().astype(bool) & ~np.any(ratios < 0.0, axis=1)):
        sentences.append(
            "Where no damping ratio is negative but sliding is unstable, a motion without"
            " oscillation grows, such as the speed of a free rotation."
        )
    free = [name for name in parameters if name not in limited]
    if free:
        sentences.append(f"No stability limit: {', '.join(free)}.")
    if any(_near(dataset, name).count() < dataset[name].count() for name in limited):
        sentences.append(
            f"Limits beyond {_FAR:g} times both the present value and the median of their curve are"
            " not shown."
        )
    if own > 0.0:
        sentences.append("Dotted: the machine's own speed.")
    shaded = _unstable(dataset, x)
    return ParameterLines(x, tuple(panels), tuple(sentences), shaded, own if own > 0.0 else None)


def of_map(dataset: xr.Dataset, name: str) -> ParameterLines:
    """Curves for a result of ``wb.stability_map`` for a machine over one parameter."""
    dataset = dataset.sortby(name)
    x = SweptAxis.of(dataset, name)
    panels = tuple(
        Panel(label, lines_of([""], x.values, [dataset[one].to_numpy()]), levels=levels, zero=True)
        for label, one, levels in (
            ("smallest damping\nratio  [1]", "damping_ratio", _ZERO),
            ("largest growth\nrate  [1/s]", "growth_rate", _ZERO),
            ("frequency\n[Hz]", "frequency", ()),
        )
    )
    sentences = [
        *caption.sentences(dataset, [name]),
        "Linear stability of steady sliding: least damped mode. Red: unstable, or no sliding.",
    ]
    return ParameterLines(x, panels, tuple(sentences), _unstable(dataset, x))


def _unstable(dataset: xr.Dataset, x: SweptAxis) -> list[tuple[float, float]]:
    unstable = true_runs(~dataset["stable"].to_numpy().astype(bool))
    return [(float(x.edges[first]), float(x.edges[last + 1])) for first, last in unstable]


def _panel(dataset: xr.Dataset, x: SweptAxis, kind: str, names: list[str]) -> Panel:
    """The limits of the parameters of a kind, with their present values."""
    present = sorted({float(dataset[name].attrs["present"]) for name in names})
    shown = [_near(dataset, name).to_numpy() for name in names]
    single = len(names) == 1
    return Panel(
        _KINDS[kind],
        lines_of(names, x.values, shown, points=True),
        levels=tuple(Level(one, dashes=_DASHES) for one in present),
        filled=_stable_range(dataset, names[0]) if single else None,
        zero=kind != "slope",
    )


def _near(dataset: xr.Dataset, name: str) -> xr.DataArray:
    """The limits of a parameter, with nan for those that are not shown."""
    sizes = abs(dataset[name])
    most = _FAR * np.fmax(sizes.median(), abs(dataset[name].attrs["present"]))
    return dataset[name].where(sizes <= most) if most > 0.0 else dataset[name]


def _stable_range(dataset: xr.Dataset, name: str) -> FloatArray:
    """Range of a parameter on the stable side of its limit, (n, 2)."""
    ends = dataset[["stable_from", "stable_to"]].sel(parameter=name)
    return np.column_stack((ends["stable_from"].to_numpy(), ends["stable_to"].to_numpy()))


def _mode_name(frequencies: FloatArray) -> str:
    """The name of a mode: its frequency, or the range of its frequencies."""
    known = frequencies[np.isfinite(frequencies)]
    if not known.size:
        return ""
    low, high = (f"{one:.3g}" for one in (known.min(), known.max()))
    return f"{low} Hz" if low == high else f"{low} to {high} Hz"
