"""Amplitude and phase over one parameter, a curve for each value of a second one."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from wedgebrake.arrays import FloatArray
from wedgebrake.figures import style
from wedgebrake.figures.data import class_styles as classes
from wedgebrake.figures.data.axes import label, runs
from wedgebrake.figures.data.limits import extent, limits_of_points
from wedgebrake.figures.data.orbit_branches import BranchLine, orbit_line, stability_pieces
from wedgebrake.figures.data.parts import with_one_part
from wedgebrake.model.validation import check_choice, wrong

if TYPE_CHECKING:
    import xarray as xr

QUANTITIES = (
    "angle_amplitude", "velocity_amplitude", "angle_fundamental", "angle_phase",
    "twist_fundamental", "twist_phase", "twist_amplitude", "friction_heat", "equivalent_damping",
    "stick_share", "peak_torque",
)  # fmt: skip
# The picture without a given quantity: amplitude above phase.
_DEFAULT = ("angle_amplitude", "angle_phase")
_PHASES = ("angle_phase", "twist_phase")
# Width of the shading of sticks [pt], and its share of the colour.
_BAND, _PALE = 5.0, 0.25
_AMPLITUDES = ("angle_amplitude", "velocity_amplitude")
# An amplitude whose largest value is this multiple of the median is drawn on a logarithmic scale.
_WIDE = 30.0
# Axes begin at zero if the least value is below this share of the largest.
_TO_ZERO = 0.5


@dataclass(frozen=True, eq=False)
class ResponsePanel:
    """One quantity over the parameter.

    label  : of the quantity
    curves : pieces of branches, stable or not; sticks: pieces on which a contact sticks
    folds  : (n, 2) points;  joined: curves of folds, (n, 2) each
    log    : whether the quantity is drawn on a logarithmic scale;  ylim: of the panel
    """

    label: str
    curves: list[BranchLine]
    sticks: list[BranchLine]
    folds: FloatArray
    joined: list[FloatArray]
    log: bool
    ylim: tuple[float, float]


@dataclass(frozen=True, eq=False)
class ResponseCurves:
    """Panels of a result of ``wb.response_curve``.

    parameter, xlabel, xlim : over which orbits were followed
    level, unit, levels : the second parameter and its values; colours of each
    of_branches : place of the level of each branch
    """

    parameter: str
    xlabel: str
    xlim: tuple[float, float]
    level: str
    unit: str
    levels: list[float]
    colours: list[str]
    panels: list[ResponsePanel]
    of_branches: list[int]

    @classmethod
    def of(
        cls,
        dataset: xr.Dataset,
        quantity: str | None = None,
        *,
        inertia: str | None = None,
        contact: str | None = None,
        shaft: str | None = None,
    ) -> ResponseCurves:
        """The panels of a dataset.

        quantity : one of ``QUANTITIES``; None for amplitude and phase of the angle
        inertia, contact, shaft : parts of a machine; None for the first

        Raises ``InputError`` for another dataset, quantity or part.
        """
        if getattr(dataset, "attrs", {}).get("kind") != "response_curve":
            raise wrong("dataset", dataset, "the result of wb.response_curve(...)")
        known = [one for one in QUANTITIES if one in dataset]
        names = _DEFAULT if quantity is None else (check_choice("quantity", quantity, known),)
        sticks = dataset["stick_share"].to_numpy().reshape(dataset.sizes["point"], -1)
        dataset = with_one_part(dataset, inertia, contact, shaft)
        parameter, level = (str(dataset.attrs[name]) for name in ("parameter", "level"))
        levels = np.atleast_1d(dataset.attrs["levels"]).astype(float).tolist()
        branch = dataset["branch"].to_numpy()
        _, first = np.unique(branch, return_index=True)
        heights = dataset[level].to_numpy()[first]
        of_branches = [int(np.argmin(np.abs(np.array(levels) - one))) for one in heights]
        low, high = sorted(map(float, dataset.attrs["range"]))
        return cls(
            parameter, label(dataset[parameter]), (low, high), level,
            str(dataset[level].attrs["units"]), levels,
            [style.PARTS[k % len(style.PARTS)] for k in range(len(levels))],
            [_panel(dataset, parameter, name, sticks.max(axis=1) > 0.0) for name in names],
            of_branches,
        )  # fmt: skip

    def colour(self, curve: BranchLine) -> str:
        """Colour of the level of a curve."""
        return self.colours[self.of_branches[curve.branch]]

    def line(self, curve: BranchLine) -> classes.LineStyle:
        """The line of a curve, in the colour of its level."""
        return orbit_line(self.colour(curve), stable=curve.stable)

    def band(self, curve: BranchLine) -> classes.LineStyle:
        """The shading of a curve on which a contact sticks."""
        pale = [1.0 - _PALE * (1.0 - one) for one in style.rgb(self.colour(curve))]
        colour = "#" + "".join(f"{round(255 * one):02x}" for one in pale)
        return classes.LineStyle(colour, _BAND)

    def legends(self) -> list[tuple[str, list[classes.LegendEntry]]]:
        """Legends: levels; kinds of line, sticks and folds."""
        colours = zip(self.levels, self.colours, strict=True)
        found = set(self.of_branches)
        symbol, unit = style.symbol(self.level), "" if self.unit in "1-" else f" {self.unit}"
        rows = [
            classes.LegendEntry(
                f"{symbol} = {style.number(value)}{unit}{'' if place in found else ': no orbit'}",
                orbit_line(colour, stable=True),
            )
            for place, (value, colour) in enumerate(colours)
        ]
        curves = [curve for panel in self.panels for curve in panel.curves]
        present = sorted({curve.stable for curve in curves}, reverse=True)
        kinds = [
            classes.LegendEntry(
                "stable" if one else "unstable", orbit_line(style.BLACK, stable=one)
            )
            for one in present
        ]
        if any(panel.sticks for panel in self.panels):
            kinds.append(classes.LegendEntry("sticks", classes.LineStyle(style.PALE_GREY, _BAND)))
        if any(panel.folds.size for panel in self.panels):
            kinds.append(classes.LegendEntry("fold", FOLD))
        if any(panel.joined for panel in self.panels):
            kinds.append(classes.LegendEntry("curve of folds", FOLDS))
        return [("", rows), ("", kinds)]


FOLD = classes.BIFURCATIONS["fold"].marker()
FOLDS = classes.LineStyle(style.DARK_GREY, 0.8, (0, (1.0, 1.2)))
"""Appearance of folds and of the curves that join them."""


def _panel(dataset: xr.Dataset, parameter: str, name: str, sticks: FloatArray) -> ResponsePanel:
    x = dataset[parameter].to_numpy().astype(float)
    y = _continuous(dataset[name].to_numpy(), dataset["branch"].to_numpy(), name)
    at = dataset["bifurcation_point"].to_numpy().astype(int)
    curves = list(stability_pieces(dataset, x, y[:, None], at))
    branch = dataset["branch"].to_numpy()
    bands = [
        BranchLine(x[first : last + 1], y[first : last + 1], 1, True, int(branch[first]))
        for first, last in runs(2 * branch + sticks)
        if sticks[first]
    ]
    turns = dataset["bifurcation_kind"].to_numpy().astype(str) == "fold"
    turns |= dataset["bifurcation_scenario"].to_numpy().astype(str) == "non-smooth fold"
    folds = np.stack((x[at[turns]], y[at[turns]]), axis=1)
    joined = []
    if "fold_point" in dataset.dims:
        number = dataset["fold_curve"].to_numpy()
        values = _continuous(dataset[f"fold_{name}"].to_numpy(), number, name)
        for first, last in runs(number):
            own = slice(first, last + 1)
            joined.append(np.stack((dataset["fold_value"].to_numpy()[own], values[own]), axis=1))
    low, high = extent(y[np.isfinite(y)])
    log = is_wide(name, y)
    if log:
        bottom, top = style.margins(np.log10(low), np.log10(high), 0.0, share=0.04)
        limits = (10.0**bottom, 10.0**top)
    else:
        limits = limits_of_points(0.0 if 0.0 < low < _TO_ZERO * high else low, high)
    return ResponsePanel(label(dataset[name]), curves, bands, folds, joined, log, limits)


def is_wide(name: str, values: FloatArray) -> bool:
    """Whether a quantity is drawn on a logarithmic scale: its peaks would hide all the rest."""
    known = values[np.isfinite(values)]
    wide = known.size and known.min() > 0.0 and known.max() > _WIDE * np.median(known)
    return bool(name in _AMPLITUDES and wide)


def _continuous(values: FloatArray, number: FloatArray, name: str) -> FloatArray:
    """Phases from -2 pi to 0 at the beginning of each curve, without jumps along it."""
    values = values.astype(float)
    if name not in _PHASES:
        return values
    found = values.copy()
    for first, last in runs(number):
        own = slice(first, last + 1)
        found[own] = np.unwrap(values[own])
        found[own] -= 2.0 * np.pi * np.ceil(found[first] / (2.0 * np.pi))
    return found
