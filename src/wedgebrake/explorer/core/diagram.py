"""The bifurcation diagram: Poincare points over one parameter, by class of motion."""

from __future__ import annotations

from collections.abc import Hashable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from wedgebrake.explorer.core import legend
from wedgebrake.explorer.core.axis import Axis
from wedgebrake.explorer.core.evaluation import judging
from wedgebrake.explorer.core.limits import COARSE_POINTS, FINE_POINTS
from wedgebrake.explorer.core.machine import following, settings, slow, without
from wedgebrake.explorer.core.progressive_sweep import STEP, Filling
from wedgebrake.explorer.core.state import Desk, axes
from wedgebrake.figures.matplotlib import class_styles
from wedgebrake.figures.matplotlib.heatmap import runs
from wedgebrake.figures.matplotlib.sweep_record import Record

FloatArray = NDArray[np.float64]

# Points that a browser draws at once without waiting.
MOST_DRAWN = 12_000
# The first step takes all the coarse points, in this time [s]; of a slow solver as many as come.
_DRAFT = 0.25
# Points of this share of the values may lie beyond the picture, if they are farther away than
# so many times what the others take; then it ends this share of that beyond these.
_FAR, _BEYOND, _MARGIN = 0.04, 1.5, 0.15
_AT_REST = list(class_styles.MOTIONS).index("at_rest")
_LOCKED = list(class_styles.MOTIONS).index("self_locked")


@dataclass(frozen=True, eq=False)
class Diagram:
    """Poincare points as far as they are known.

    known, whole : values computed, of so many
    strip        : class of motion in equal cells along the axis, (cells,); the nearest known
    said         : each value and its class in words, (known,), with `middles`, their places
    place, code  : (m,) of the points drawn: place along the axis, class of motion
    points       : of each quantity, (m,)
    spans        : of each quantity, (low, high) of the picture
    outside      : of each quantity, the largest size of a point that lies beyond; 0: none does
    limits       : places where sliding loses linear stability, and whether it is stable beyond
    """

    axis: Axis
    known: int
    whole: int
    middles: FloatArray
    codes: NDArray[np.int64]
    said: list[str]
    strip: NDArray[np.int64]
    place: FloatArray
    code: NDArray[np.int64]
    points: dict[str, FloatArray]
    spans: dict[str, tuple[float, float]]
    outside: dict[str, float]
    limits: list[tuple[float, bool]]

    @property
    def gaps(self) -> list[tuple[float, float]]:
        """Where runs have no result, as places (from, to)."""
        edges = np.linspace(*self.axis.ends, self.strip.size + 1)
        empty = class_styles.without(self.strip)
        return [(edges[i], edges[j + 1]) for i, j in runs(empty) if empty[i]]

    @property
    def legend(self) -> list[legend.Chip]:
        """The classes that occur."""
        return legend.present(self.codes)

    @property
    def progress(self) -> str:
        """How much is known."""
        return f"{self.known} of {self.whole} values" if self.known < self.whole else ""


def parameter(desk: Desk) -> str:
    """What the diagram goes over: as wished, or another one where the machine has not that."""
    possible = axes(desk.system)
    return desk.view.axis if desk.view.axis in possible else possible[-1]


def key(desk: Desk) -> Hashable:
    """All that the diagram depends on, of its own parameter the ends alone."""
    name = parameter(desk)
    return (
        Axis.of(desk, name),
        without(desk.system, [name]),
        tuple(judging(desk).items()),
        tuple(settings(desk).items()),
    )


def work(desk: Desk) -> Iterator[Diagram]:
    """The diagram as it fills up.

    Raises ``InputError`` where no value of the parameter can be taken.
    """
    axis = Axis.of(desk, parameter(desk))
    some = slow(desk)
    levels = [(COARSE_POINTS,)] if some else [(COARSE_POINTS,), (FINE_POINTS,)]
    (cells,) = levels[-1]
    filling = Filling(
        following(desk.system), {axis.name: axis.values(cells)}, levels,
        **judging(desk), **settings(desk),
    )  # fmt: skip
    for _ in filling.steps(_DRAFT, 2.0 * STEP if some else STEP):
        yield _picture(axis, filling)


def _picture(axis: Axis, filling: Filling) -> Diagram:
    known = np.flatnonzero(filling.known)
    whole = filling.dataset()
    dataset = whole.isel({next(iter(whole["status"].dims)): known})
    records = {name: Record.of(dataset, name) for name in ("angle", "velocity")}
    record = records["velocity"]
    codes, orders = record.motions[0].astype(np.int64), record.orders[0]
    middles = axis.places(filling.known.size)[known]
    row, column = np.nonzero(_kept(codes, orders, record.points[0]))
    points = {name: one.points[0][row, column] for name, one in records.items()}
    spans = {name: _span(one, points[name], row) for name, one in records.items()}
    return Diagram(
        axis=axis,
        known=known.size,
        whole=filling.known.size,
        middles=middles,
        codes=codes,
        said=[
            f"{axis.said(place)}: {_class(code, order)}"
            for place, code, order in zip(middles, codes, orders, strict=True)
        ],
        strip=codes[_nearest(known, filling.known.size)],
        place=middles[row],
        code=codes[row],
        points=points,
        spans=spans,
        outside={name: _outside(one, spans[name]) for name, one in points.items()},
        limits=[(axis.place(float(value)), beyond) for value, beyond in record.limits],
    )


def _kept(
    codes: NDArray[np.int64], orders: NDArray[np.int32], points: FloatArray
) -> NDArray[np.bool_]:
    """Which points are drawn, (n, recorded): of a periodic motion those of one period."""
    recorded = points.shape[1]
    last = np.full(codes.size, recorded)
    periodic = np.isin(codes, list(class_styles.PERIODIC)) & (orders > 0)
    last[periodic] = np.minimum(orders[periodic], recorded)
    last[codes == _AT_REST] = 1
    last[class_styles.without(codes)] = 0
    kept = np.arange(recorded) >= recorded - last[:, None]
    total = int(last.sum())
    if total > MOST_DRAWN:  # of motions that do not repeat, every second, third ... point
        kept[~periodic] &= np.arange(recorded) % -(-total // MOST_DRAWN) == 0
    # A run that ended early has its points at the beginning of its row.
    ended = codes == _LOCKED
    kept[ended] = True
    shown: NDArray[np.bool_] = kept & np.isfinite(points)
    return shown


def _span(record: Record, points: FloatArray, row: NDArray[np.int64]) -> tuple[float, float]:
    """Ends of a picture of points, (m,), each of a value; few values may lie far outside.

    At a resonance points are hundreds of times as large as elsewhere, and would flatten all.
    """
    if not points.size:
        return record.low, record.high
    starts = np.flatnonzero(np.diff(row, prepend=-1))
    highest, lowest = np.maximum.reduceat(points, starts), np.minimum.reduceat(points, starts)
    top, bottom = (
        np.quantile(one, share, method="nearest")
        for one, share in ((highest, 1.0 - _FAR), (lowest, _FAR))
    )
    reach = _BEYOND * (top - bottom)
    low = record.low if lowest.min() > bottom - reach else bottom - _MARGIN * reach
    high = record.high if highest.max() < top + reach else top + _MARGIN * reach
    return float(low), float(high)


def _outside(points: FloatArray, span: tuple[float, float]) -> float:
    beyond = points[(points < span[0]) | (points > span[1])]
    return float(np.abs(beyond).max(initial=0.0))


def _nearest(known: NDArray[np.int64], cells: int) -> NDArray[np.int64]:
    """For each cell the place among the known ones of the nearest of them."""
    between = 0.5 * (known[1:] + known[:-1])
    found: NDArray[np.int64] = np.searchsorted(between, np.arange(cells))
    return found


def _class(code: int, order: int) -> str:
    """A class in words; of long periods with their number."""
    name = list(class_styles.MOTIONS)[code]
    if name == "period_more":
        return f"{order}T"
    return legend.words(class_styles.MOTION_LOOKS[code])
