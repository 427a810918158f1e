"""Curves over one parameter, in panels above each other."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wedgebrake.figures.data.axes import SweptAxis, runs

FloatArray = NDArray[np.float64]
# Dash patterns of curves of one colour [pt].
DASHES: tuple[tuple[float, ...], ...] = ((), (4.0, 1.5), (1.0, 1.2), (4.0, 1.2, 1.0, 1.2))


class Line(NamedTuple):
    """A curve over the parameter.

    values : (n,), nan where it is interrupted
    points : whether each value is marked with a point
    """

    name: str
    values: FloatArray
    colour: str
    dashes: tuple[float, ...] = ()
    points: bool = False


class Level(NamedTuple):
    """A horizontal line with its name."""

    name: str
    value: float


class Panel(NamedTuple):
    """Curves that share an axis.

    label  : of the axis
    levels : horizontal lines
    filled : (n, 2) lower and upper limit of the stable range over the parameter; None without one
    zero   : whether the axis includes 0
    """

    label: str
    lines: tuple[Line, ...]
    levels: tuple[Level, ...] = ()
    filled: FloatArray | None = None
    zero: bool = False


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


def intervals(x: SweptAxis, chosen: NDArray[np.bool_]) -> list[tuple[float, float]]:
    """Intervals of an axis covered by the chosen cells, (n,)."""
    return [
        (float(x.edges[first]), float(x.edges[last + 1]))
        for first, last in runs(np.asarray(chosen))
        if chosen[first]
    ]
