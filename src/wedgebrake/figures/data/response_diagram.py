"""The response diagram: amplitudes of the motion over one parameter, in one or both directions."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wedgebrake.arrays import FloatArray
from wedgebrake.figures import style
from wedgebrake.figures.data import class_styles as classes
from wedgebrake.figures.data.axes import label
from wedgebrake.figures.data.bifurcation import SweepDiagram
from wedgebrake.figures.data.panels import Panel, StyledLine
from wedgebrake.model.machine_matrices import natural_frequencies
from wedgebrake.model.studies.machine_study import bodies_of
from wedgebrake.model.validation import unknown

if TYPE_CHECKING:
    import xarray as xr


RESPONSE = "response"
"""Name of the quantity that selects all amplitudes."""


class _Result(NamedTuple):
    """A result of a sweep, with its name in legends and the dashes of its curves [pt]."""

    variable: str
    name: str = ""
    dashes: tuple[float, ...] = ()


# Panels of the diagram: label and results. The amplitude is half the range of the speed.
_AMPLITUDE = "speed_amplitude"
_PEAK, _RMS = "peak (speed: half the range)", "root mean square"
_DASHES = (3.0, 1.5)
_PANELS = (
    ("speed amplitude\n[rad/s]", (_Result(_AMPLITUDE, _PEAK),
                                  _Result("rms_velocity", _RMS, _DASHES))),
    ("torque\n[N m]", (_Result("peak_torque", _PEAK), _Result("rms_torque", _RMS, _DASHES))),
    ("jerk\n[rad/s³]", (_Result("peak_jerk", _PEAK), _Result("rms_jerk", _RMS, _DASHES))),
    ("share of time\nat rest  [1]", (_Result("stick_share"),)),
)  # fmt: skip
RESULTS = tuple(one.variable for _, results in _PANELS for one in results)
"""Names of the results that ``RESPONSE`` shows."""
# Widths of the curves of the last branch and of the others [pt].
_THIN, _WIDE = 0.8, 2.0
# Largest number of values that are marked with points.
_POINTS = 60
# A change between neighbours is drawn as a jump if it exceeds this share of the panel's height and
# this multiple of the larger of the two adjacent changes. A steep curve may be drawn so too.
_JUMP, _STEEPER = 0.08, 3.0


# Line at an undamped natural frequency.
NATURAL = classes.LineStyle(style.GREY, 0.7, (0, (6.0, 2.0, 1.0, 2.0)))
# Largest number of natural frequencies that are listed in a legend.
_LISTED = 3


@dataclass(frozen=True, eq=False)
class ResponseDiagram(SweepDiagram):
    """Amplitudes of a sweep over one parameter.

    In each panel the lines are ordered by result, and those of one result by branch.

    natural : undamped natural frequencies in the swept range, see ``natural_values``
    """

    panels: tuple[Panel, ...]
    natural: FloatArray

    @classmethod
    def of(cls, dataset: xr.Dataset, quantity: str = RESPONSE) -> ResponseDiagram:
        """The diagram of a dataset.

        quantity : ``RESPONSE``, or the name of a single result

        Raises ``InputError`` as ``read``, and for an unknown quantity.
        """
        swept = SweepDiagram.read(with_amplitude(dataset))
        chosen = _chosen(swept, quantity)
        panels = [_panel(swept, words, results) for words, results in chosen]
        natural = natural_values(dataset, swept.x.name)
        low, high = float(swept.x.values.min()), float(swept.x.values.max())
        natural = natural[(low <= natural) & (natural <= high)]
        return cls(**vars(swept), panels=tuple(panels), natural=natural)

    @property
    def has_jumps(self) -> bool:
        """True if a curve jumps somewhere, or is as steep as a jump."""
        return any(np.any(line.jumps) for panel in self.panels for line in panel.lines)

    def legends(self) -> list[tuple[str, list[classes.LegendEntry]]]:
        """Legends of the bands of classes and of the branches."""
        names = {line.name: line.dashes for panel in self.panels for line in panel.lines}
        lines = [
            classes.LegendEntry(name, classes.LineStyle(style.BLACK, 1.0, (0, dashes)))
            for name, dashes in names.items()
            if name
        ]
        marks = [
            classes.LegendEntry(one.direction, classes.LineStyle(one.colour, 1.0))
            for one in self.branches
            if one.direction
        ]
        return [*self.class_legends(), ("", lines + marks + list(self._natural_entry()))]

    def _natural_entry(self) -> Iterator[classes.LegendEntry]:
        if not self.natural.size:
            return
        words = f"undamped natural {'frequency' if self.natural.size == 1 else 'frequencies'}"
        values = ", ".join(f"{one:.4g}" for one in self.natural)
        if self.natural.size <= _LISTED and self.x.name != "f":
            words += f", {values} Hz"
        yield classes.LegendEntry(words, NATURAL)


def with_amplitude(dataset: xr.Dataset) -> xr.Dataset:
    """Add half the range of the speed to the results of a sweep."""
    if not {"lowest_velocity", "highest_velocity"} <= set(getattr(dataset, "data_vars", ())):
        return dataset
    amplitude = 0.5 * (dataset["highest_velocity"] - dataset["lowest_velocity"])
    attributes = {"units": "rad/s", "long_name": "half the range of the speed"}
    return dataset.assign({_AMPLITUDE: amplitude.assign_attrs(attributes)})


def natural_values(dataset: xr.Dataset, name: str) -> FloatArray:
    """Values of a swept frequency at the undamped natural frequencies, without contacts, (m,).

    Empty if the parameter is not a frequency of a signal. The normalised frequency f is 1 at that
    of a driveline.
    """
    if name == "f":
        return np.ones(1)
    system = json.loads(dataset.attrs.get("system", "{}"))
    if dataset[name].attrs.get("units") != "Hz" or not system:
        return np.empty(0)
    if "driveline" in system:
        line = system["driveline"]
        return np.array([math.sqrt(line["stiffness"] / line["inertia"]) / (2.0 * math.pi)])
    return natural_frequencies(bodies_of(system)) / (2.0 * math.pi)


def _chosen(swept: SweepDiagram, quantity: str) -> Iterator[tuple[str, tuple[_Result, ...]]]:
    dataset = swept.branches[0].dataset
    known = [
        str(one)
        for one, values in dataset.data_vars.items()
        if values.dims == (swept.x.name,) and values.dtype.kind == "f"
    ]
    if quantity != RESPONSE:
        if quantity not in known:
            allowed = [RESPONSE, *style.SECTION, *known]
            raise unknown("quantity", quantity, allowed, "the sweep has no such result")
        yield label(dataset[quantity]), (_Result(quantity),)
        return
    for words, results in _PANELS:
        own = tuple(
            one
            for one in results
            if one.variable in known and np.any(np.isfinite(swept.rows(one.variable)))
        )
        if own:
            yield words, own


def _panel(swept: SweepDiagram, words: str, results: tuple[_Result, ...]) -> Panel:
    """A panel, whose curves are interrupted at points without a result."""
    missing = classes.without_result(swept.motions)
    found = [np.where(missing, np.nan, swept.rows(one.variable)) for one in results]
    finite = np.concatenate([one[np.isfinite(one)] for one in found])
    height = float(np.ptp(np.append(finite, 0.0))) or 1.0
    lines = tuple(
        StyledLine(
            one.name, swept.x.values, row, branch.colour, one.dashes,
            # Different widths, so that both branches are visible where they coincide.
            width=_THIN if branch is swept.branches[-1] else _WIDE,
            points=row.size <= _POINTS, jumps=jumps(row, height),
        )
        for one, values in zip(results, found, strict=True)
        for branch, row in zip(swept.branches, values, strict=True)
    )  # fmt: skip
    return Panel(words, lines, legend=False, zero=True)


def jumps(values: FloatArray, height: float) -> NDArray[np.bool_]:
    """Whether a result jumps or is steep between neighbouring values of the parameter, (n - 1,)."""
    change = np.abs(np.diff(values))
    beside = np.zeros_like(change)
    known = np.nan_to_num(change)
    beside[1:] = known[:-1]
    beside[:-1] = np.maximum(beside[:-1], known[1:])
    found: NDArray[np.bool_] = (change > _JUMP * height) & (change > _STEEPER * beside)
    return found
