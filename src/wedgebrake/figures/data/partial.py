"""Pictures of the page, complete or in part, with the texts shown at the pointer."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from wedgebrake.arrays import FloatArray
from wedgebrake.figures import style
from wedgebrake.figures.data import class_styles as classes
from wedgebrake.figures.data.axes import ParameterAxis, runs, true_runs
from wedgebrake.figures.data.bifurcation import BifurcationDiagram
from wedgebrake.figures.data.class_map import ClassMap
from wedgebrake.figures.data.limits import Codes
from wedgebrake.figures.data.response_curve import ResponseCurves

QUANTITIES = {
    "velocity": "velocity at the section  [rad/s]",
    "angle": "angle at the section  [rad]",
    "speed_amplitude": "speed, half its range  [rad/s]",
    "rms_velocity": "speed, rms  [rad/s]",
    "peak_torque": "brake torque, peak  [N m]",
    "rms_torque": "brake torque, rms  [N m]",
    "peak_jerk": "jerk, peak  [rad/s³]",
    "rms_jerk": "jerk, rms  [rad/s³]",
    "stick_share": "share of time at rest  [1]",
}
"""Quantities of a diagram on the page, with the labels of their axes."""
MEASURES = {
    "angle_amplitude": "angle, half its range  [rad]",
    "velocity_amplitude": "speed, half its range  [rad/s]",
    "angle_phase": "phase of the angle  [rad]",
    "peak_torque": "brake torque, peak  [N m]",
    "friction_heat": "heat of the brake in a cycle  [J]",
    "equivalent_damping": "equivalent damping of the brake  [N m s/rad]",
    "stick_share": "share of time at rest  [1]",
}
"""Measures of an amplitude curve on the page, with the labels of their axes."""
MOST_POINTS = 12_000
"""Points of a diagram that a browser draws without delay."""


class Boxes(NamedTuple):
    """Boxes between positions, (n,) each, with the text of each."""

    left: FloatArray
    right: FloatArray
    bottom: FloatArray
    top: FloatArray
    text: list[str]


@dataclass(frozen=True, eq=False)
class PartialMap:
    """A map, with ``known`` of its ``whole`` number of cells computed.

    axes  : across and up
    hover : runs of cells with their texts, or None
    unit  : of the progress: "cells" or "starts"
    """

    axes: tuple[ParameterAxis, ParameterAxis]
    data: ClassMap
    hover: Boxes | None
    known: int
    whole: int
    unit: str = "cells"

    @property
    def legend(self) -> list[classes.LegendEntry]:
        """Entries of the legend."""
        return self.data.legend

    @property
    def progress(self) -> str:
        """Computed share in words; empty for a complete map."""
        return _progress(self.known, self.whole, self.unit)


@dataclass(frozen=True, eq=False)
class PointCloud:
    """Points of a diagram, few enough for a browser.

    index  : of the value of the parameter of each, (m,)
    points : values of the quantity, (m,)
    codes  : of the motions, (m,)
    span   : lowest and highest value shown: of all points
    """

    index: Codes
    points: FloatArray
    codes: Codes
    span: tuple[float, float]


@dataclass(frozen=True, eq=False)
class PartialDiagram:
    """A bifurcation diagram, with ``known.size`` of ``whole`` values computed.

    axes   : that of the parameter
    known  : indices of the values computed, ascending
    data   : of these values, by quantity
    clouds : points drawn, by quantity
    follows : whether a sweep up and down will replace it
    limit_words : what each linear stability limit is
    """

    axes: tuple[ParameterAxis]
    known: Codes
    whole: int
    data: dict[str, BifurcationDiagram]
    clouds: dict[str, PointCloud]
    follows: bool = False
    limit_words: tuple[str, ...] = ()

    @classmethod
    def of(
        cls, axis: ParameterAxis, known: Codes, whole: int, data: dict[str, BifurcationDiagram],
        *, follows: bool = False, limit_words: Sequence[str] = (),
    ) -> PartialDiagram:  # fmt: skip
        """The picture of the diagrams of all quantities."""
        clouds = {name: point_cloud(data[name]) for name in data}
        return cls((axis,), known, whole, data, clouds, follows, tuple(limit_words))

    @property
    def first(self) -> BifurcationDiagram:
        """The diagram of one quantity; all have the same motions."""
        return next(iter(self.data.values()))

    @property
    def text(self) -> list[str]:
        """The value and its motion in words; a long period as a number."""
        long, words = classes.CODES["period_more"], [one.plain for one in classes.MOTIONS]
        return [
            f"{self.axes[0].text(at)}: {f'{order}T' if code == long else words[code]}"
            for at, code, order in zip(
                self.positions, self.codes, self.first.orders[0], strict=True
            )
        ]

    @property
    def codes(self) -> Codes:
        """Codes of the motions, (known,)."""
        codes: Codes = self.first.motions[0]
        return codes

    @property
    def positions(self) -> FloatArray:
        """Positions of the values along the axis, (known,)."""
        found: FloatArray = self.axes[0].positions(self.whole)[self.known]
        return found

    @property
    def band(self) -> Codes:
        """Codes of the motions at all values, from the nearest computed value, (whole,)."""
        between = 0.5 * (self.known[1:] + self.known[:-1])
        nearest: Codes = self.codes[np.searchsorted(between, np.arange(self.whole))]
        return nearest

    @property
    def gaps(self) -> FloatArray:
        """Positions between which runs have no result, (n, 2)."""
        edges = np.linspace(*self.axes[0].ends, self.whole + 1)
        empty = true_runs(classes.without_result(self.band))
        gaps = [(edges[first], edges[last + 1]) for first, last in empty]
        return np.array(gaps).reshape(-1, 2)

    @property
    def limits(self) -> list[float]:
        """Positions of the linear stability limits."""
        return [self.axes[0].position(float(value)) for value, _ in self.first.limits]

    @property
    def legend(self) -> list[classes.LegendEntry]:
        """Entries of the classes that occur, and of the limits."""
        found = classes.class_entries(self.first.motions, classes.MOTIONS, shares=True)
        return [*found, *([classes.LIMIT_ENTRY] if self.limits else [])]

    @property
    def progress(self) -> str:
        """Computed share in words; empty for a complete diagram."""
        if self.follows:
            return "from the initial state; the sweep up and down follows"
        return _progress(self.known.size, self.whole, "values")


@dataclass(frozen=True, eq=False)
class PartialCurve:
    """Amplitude curves at those levels that have been computed.

    axes   : axis of the parameter along the curves
    level  : axis of the second parameter, of which only the name and unit are used
    levels : all values of the second parameter
    done   : curves of the levels that have been computed, by measure; empty if there is no orbit
    note   : at which levels there is no orbit, or why the computation ended
    reason : why there is no orbit at the first of these levels, in full
    """

    axes: tuple[ParameterAxis]
    level: ParameterAxis
    levels: tuple[float, ...]
    done: tuple[dict[str, ResponseCurves], ...]
    note: str = ""
    reason: str = ""

    def colour(self, place: int) -> str:
        """The colour of a level."""
        return style.PARTS[place % len(style.PARTS)]

    @property
    def legend(self) -> list[classes.LegendEntry]:
        """Entries of the levels that have been computed, of kinds of lines, sticks and folds."""
        name, unit = self.level.symbol or self.level.words, self.level.unit
        unit = "" if unit in ("1", "-") else f" {unit}"
        found = [
            classes.LegendEntry(
                f"{name} = {style.number(value)}{unit}", classes.LineStyle(self.colour(place))
            )
            for place, (value, curves) in enumerate(zip(self.levels, self.done, strict=False))
            if curves
        ]
        kinds: dict[str, classes.LegendEntry] = {}
        for curves in self.done:
            for one in curves.values():
                kinds |= {entry.label: entry for entry in one.legends()[1][1]}
        return [*found, *kinds.values()]

    @property
    def progress(self) -> str:
        """Computed share in words, and which levels have no curves; empty for complete curves."""
        share = _progress(len(self.done), len(self.levels), "levels")
        return "; ".join(filter(None, (share, self.note)))


def hover_boxes(axes: Sequence[ParameterAxis], data: ClassMap) -> Boxes:
    """Runs of equal cells along each row of a map, with their classes and values in words."""
    x, y = axes
    rows, columns = data.codes.shape
    across, up = np.linspace(*x.ends, columns + 1), np.linspace(*y.ends, rows + 1)
    found = [(row, *run) for row in range(rows) for run in runs(data.codes[row])]
    row, first, last = (np.array(one) for one in zip(*found, strict=True))
    values = [number.rpartition("= ")[2] for number in map(x.text, across)]
    heights = [y.text(position) for position in y.positions(rows)]
    name = x.symbol or x.words
    text = [
        f"{data.styles[data.codes[i, a]].plain}: {name} = {values[a]} to {values[b + 1]},"
        f" {heights[i]}"
        for i, a, b in found
    ]
    return Boxes(across[first], across[last + 1], up[row], up[row + 1], text)


def point_cloud(data: BifurcationDiagram, most: int = MOST_POINTS) -> PointCloud:
    """Points of all branches of a diagram, reduced to about ``most``.

    Of a periodic motion those of one period; of others every second, third ... if there are many.
    """
    codes, orders = data.motions.ravel(), data.orders.ravel()
    points = data.points.reshape(codes.size, -1)
    recorded = points.shape[1]
    last = np.full(codes.size, recorded)
    periodic = np.isin(codes, list(classes.PERIODIC)) & (orders > 0)
    last[periodic] = np.minimum(orders[periodic], recorded)
    last[codes == classes.CODES["at_rest"]] = 1
    last[classes.without_result(codes)] = 0
    kept = np.arange(recorded) >= recorded - last[:, None]
    total = int(last.sum())
    if total > most:
        kept[~periodic] &= np.arange(recorded) % -(-total // most) == 0
    # A run that ended early has its points at the beginning of its row.
    kept[codes == classes.CODES["self_locked"]] = True
    row, column = np.nonzero(kept & np.isfinite(points))
    span = data.low, data.high
    return PointCloud(row % data.motions.shape[1], points[row, column], codes[row], span)


def _progress(known: int, whole: int, unit: str) -> str:
    return f"{known} of {whole} {unit}" if known < whole else ""
