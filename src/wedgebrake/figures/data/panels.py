"""Curves that share axes: the panels of pictures over time or over one parameter."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wedgebrake.arrays import FloatArray
from wedgebrake.figures import style

Dashes = tuple[float, ...]

# Dash patterns of curves once all colours are used [pt].
_DASHES: tuple[Dashes, ...] = ((), (4.0, 1.5), (1.2, 1.2), (4.0, 1.2, 1.0, 1.2))


class StyledLine(NamedTuple):
    """A curve, with its colour, dashes [pt] and width [pt].

    x, y   : (n,), nan where it is interrupted
    points : whether each value is marked with a point
    jumps  : (n - 1,) whether it jumps between neighbouring values; None: nowhere
    """

    name: str
    x: FloatArray
    y: FloatArray
    colour: str
    dashes: Dashes = ()
    width: float = 0.9
    points: bool = False
    jumps: NDArray[np.bool_] | None = None


class Level(NamedTuple):
    """A marked value; its meaning, as mathtext; colour and dashes [pt]."""

    value: float
    label: str = ""
    colour: str = style.GREY
    dashes: Dashes = ()


class Panel(NamedTuple):
    """Curves that share axes.

    label   : of the vertical axis
    lines   : the curves
    x_label : of the horizontal axis; empty where panels share it
    height  : relative to the other panels
    legend  : whether the curves are named above the panel
    zero    : whether the vertical axis includes 0
    levels  : horizontal lines
    filled  : (n, 2) lower and upper limit of the stable range over x; None without one
    """

    label: str
    lines: tuple[StyledLine, ...]
    x_label: str = ""
    height: float = 1.0
    legend: bool = True
    zero: bool = False
    levels: tuple[Level, ...] = ()
    filled: FloatArray | None = None


def lines_of(
    names: Sequence[str],
    x: FloatArray,
    y: Iterable[FloatArray],
    *,
    contacts: bool = False,
    points: bool = False,
) -> tuple[StyledLine, ...]:
    """Return a curve for each of several contacts or other parts, in the colours of their kind.

    x : (n,), or (n, names) if each curve has its own
    y : values of each curve
    """
    colours = style.CONTACTS if contacts else style.PARTS
    looks = ((colour, dashes) for dashes in itertools.cycle(_DASHES) for colour in colours)
    across = np.broadcast_to(x, (len(names), *x.shape)) if x.ndim == 1 else x.T
    return tuple(
        StyledLine(name, along, values, *look, points=points)
        for name, along, values, look in zip(names, across, y, looks, strict=False)
    )
