"""The response diagram: amplitudes of the motion over one parameter, in one or both directions."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from operator import itemgetter
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wedgebrake.errors import InputError, nearest
from wedgebrake.figures import style
from wedgebrake.figures.data import class_styles as classes
from wedgebrake.figures.data.axes import SweptAxis, label, require_swept
from wedgebrake.figures.data.bifurcation import SweepBranch, split
from wedgebrake.figures.data.parts import of_parts

if TYPE_CHECKING:
    import xarray as xr

FloatArray = NDArray[np.float64]
Codes = NDArray[np.int64]

RESPONSE = "response"
"""Name of the quantity that selects all amplitudes."""
# Panels of the diagram: label, and variables with their names and dashes [pt]. The amplitude is
# half the range of the speed.
_AMPLITUDE = "amplitude"
_PEAK, _RMS = (), (3.0, 1.5)
_WORDS = {"peak": "peak (speed: half the range)", "rms": "root mean square"}
_PANELS: tuple[tuple[str, tuple[tuple[str, str, tuple[float, ...]], ...]], ...] = (
    ("speed amplitude\n[rad/s]", ((_AMPLITUDE, "peak", _PEAK), ("rms_velocity", "rms", _RMS))),
    ("torque\n[N m]", (("peak_torque", "peak", _PEAK), ("rms_torque", "rms", _RMS))),
    ("jerk\n[rad/s³]", (("peak_jerk", "peak", _PEAK), ("rms_jerk", "rms", _RMS))),
    ("share of time\nstuck  [1]", (("stick_share", "", _PEAK),)),
)
# A change between neighbours is a jump if it exceeds this share of the panel's height and this
# multiple of the larger of the two adjacent changes.
_JUMP, _STEEPER = 0.08, 3.0


class Curve(NamedTuple):
    """One result over the parameter, on one branch.

    name   : a value of ``_WORDS``; empty for a single curve
    branch : number of the branch
    values : (n,)
    jumps  : (n - 1,) whether the motion jumps between neighbouring values
    """

    name: str
    branch: int
    values: FloatArray
    dashes: tuple[float, ...]
    jumps: NDArray[np.bool_]


class ResponsePanel(NamedTuple):
    """Curves that share an axis."""

    label: str
    curves: tuple[Curve, ...]
    low: float
    high: float


@dataclass(frozen=True, eq=False)
class ResponseDiagram:
    """Amplitudes of a sweep over one parameter, in ascending order of the parameter.

    motions, sticks, orders : codes of the classes, (branch, n)
    """

    x: SweptAxis
    branches: list[SweepBranch]
    panels: tuple[ResponsePanel, ...]
    motions: Codes
    orders: Codes
    sticks: Codes

    @classmethod
    def of(cls, dataset: xr.Dataset, quantity: str = RESPONSE) -> ResponseDiagram:
        """The diagram of a dataset; for a machine, of one inertia and one contact (``of_parts``).

        quantity : ``RESPONSE``, or the name of a single result

        Raises ``InputError`` for a dataset that is not a sweep over one parameter, or an unknown
        quantity.
        """
        dataset = of_parts(dataset)
        (name,) = require_swept(dataset, 1)
        dataset = with_amplitude(dataset)
        branches = [_branch(one, name) for one in split(dataset)]

        def rows(values: Callable[[xr.Dataset], xr.DataArray]) -> NDArray[Any]:
            return np.stack([values(one.dataset).to_numpy() for one in branches])

        missing = classes.without_result(rows(classes.motion_codes))
        panels = [
            _panel(words, lines, rows, missing) for words, lines in _chosen(dataset, name, quantity)
        ]
        return cls(
            x=SweptAxis.of(dataset, name),
            branches=branches,
            panels=tuple(panels),
            motions=rows(classes.motion_codes).astype(np.int64),
            orders=rows(lambda one: one["order"]).astype(np.int64),
            sticks=rows(classes.stick_codes).astype(np.int64),
        )

    def legends(self) -> list[tuple[str, list[classes.LegendEntry]]]:
        """Legends of the bands of classes and of the branches."""
        marks = [
            classes.LegendEntry(one.direction, classes.LineStyle(one.colour, 1.0))
            for one in self.branches
            if one.direction
        ]
        names = {curve.name: curve.dashes for panel in self.panels for curve in panel.curves}
        lines = [
            classes.LegendEntry(_WORDS[name], classes.LineStyle(style.BLACK, 1.0, (0, dashes)))
            for name, dashes in names.items()
            if name
        ]
        return [
            ("motion", classes.class_entries(self.motions, classes.MOTIONS, shares=False)),
            ("sticks", classes.class_entries(self.sticks, classes.STICK_CLASSES, shares=False)),
            ("", lines + marks),
        ]


def with_amplitude(dataset: xr.Dataset) -> xr.Dataset:
    """Add half the range of the speed to the results of a sweep."""
    if not {"lowest_velocity", "highest_velocity"} <= set(dataset.data_vars):
        return dataset
    amplitude = 0.5 * (dataset["highest_velocity"] - dataset["lowest_velocity"])
    attributes = {"units": "rad/s", "long_name": "half the range of the speed"}
    return dataset.assign({_AMPLITUDE: amplitude.assign_attrs(attributes)})


def _branch(branch: SweepBranch, name: str) -> SweepBranch:
    return SweepBranch(branch.name, branch.direction, branch.dataset.sortby(name))


def _chosen(dataset: xr.Dataset, name: str, quantity: str) -> Iterator[Any]:
    """Labels and lines of the panels."""
    known = [
        str(one)
        for one, values in dataset.data_vars.items()
        if set(values.dims) - {"branch"} == {name} and values.dtype.kind == "f"
    ]
    if quantity != RESPONSE:
        if quantity not in known:
            allowed = [RESPONSE, *style.SECTION, *known]
            raise InputError(
                f"quantity = {quantity!r}: the sweep has no such result."
                f" {nearest(str(quantity), allowed)}",
                name="quantity", value=quantity, allowed=tuple(allowed),
            )  # fmt: skip
        yield label(dataset[quantity]), ((quantity, "", _PEAK),)
        return
    for words, lines in _PANELS:
        own = tuple(
            line for line in lines if line[0] in known and np.any(np.isfinite(dataset[line[0]]))
        )
        if own:
            yield words, own


def _panel(
    words: str,
    lines: tuple[tuple[str, str, tuple[float, ...]], ...],
    rows: Callable[[Callable[[xr.Dataset], xr.DataArray]], NDArray[Any]],
    missing: NDArray[np.bool_],
) -> ResponsePanel:
    """A panel, whose curves are interrupted at points without a result."""
    found = [np.where(missing, np.nan, rows(itemgetter(name))) for name, _, _ in lines]
    finite = np.concatenate([one[np.isfinite(one)] for one in found])
    low, high = (float(finite.min()), float(finite.max())) if finite.size else (0.0, 1.0)
    low = min(low, 0.0)
    high = high if high > low else low + 1.0
    curves = [
        Curve(line[1], number, row, line[2], jumps(row, high - low))
        for line, values in zip(lines, found, strict=True)
        for number, row in enumerate(values)
    ]
    return ResponsePanel(words, tuple(curves), low, high)


def jumps(values: FloatArray, height: float) -> NDArray[np.bool_]:
    """Whether a result jumps between neighbouring values of the parameter, (n - 1,)."""
    change = np.abs(np.diff(values))
    beside = np.zeros_like(change)
    known = np.nan_to_num(change)
    beside[1:] = known[:-1]
    beside[:-1] = np.maximum(beside[:-1], known[1:])
    found: NDArray[np.bool_] = (change > _JUMP * height) & (change > _STEEPER * beside)
    return found
