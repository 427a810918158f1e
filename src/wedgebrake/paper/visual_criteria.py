"""Kinds of motion as a reader sees them in a printed bifurcation diagram.

The paper names motions from its diagrams: 5 s of Poincaré points at each parameter, drawn as
dots. Two points are distinct where they are farther apart than a dot. What 5 s cannot show (a
torus against a resonance of high order, chaos against either) is not decided here; the rigorous
class is that of ``wb.motion``.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

SYNCHRONOUS, DOUBLE, MULTIPLE, FILLED = "synchronous", "2T", "multi-periodic", "quasi-periodic"
NOTHING = "no steady motion"


class Thresholds(NamedTuple):
    """Least features visible in a printed picture; the audit states what depends on them.

    dot   : height of a dot, as a share of a diagram's axis: half a millimetre
    line  : a spectral line is seen from this share of the highest one on: a millimetre of a
            panel 25 mm high, as four of them in a row are; so is a bend or an asymmetry
    stick : a stick is seen from this share of a torque period on
    share : a motion is said to stick if its sticks take this share of the time
    """

    dot: float = 0.01
    line: float = 0.04
    stick: float = 0.02
    share: float = 0.01


THRESHOLDS = Thresholds()
# A column counts as filled, not as separate dots, where this share of twenty equal parts of
# its height holds points, each part at least a dot high: fifty dots over less always touch.
# A torus leaves 85 % of them occupied on average and 50 random points 92 %; eight dots, or
# two bands a fifth of the height each, at most 40 %.
_PARTS, _FILLED = 20, 0.6


class Appearance(NamedTuple):
    """One column of a diagram: kind of motion, groups of dots that touch, its height [rad/s]."""

    kind: str
    groups: int
    height: float


def appearance(
    velocity: NDArray[np.float64], axis: float, dot: float = THRESHOLDS.dot
) -> Appearance:
    """Appearance of one column.

    velocity : (n,) Poincare points [rad/s]; empty if the run ended early
    axis     : the height of the whole diagram [rad/s]
    dot      : height of a dot, as a share of the axis
    """
    if velocity.size == 0:
        return Appearance(NOTHING, 0, 0.0)
    size = dot * axis
    ordered = np.sort(velocity)
    parts = np.split(ordered, np.flatnonzero(np.diff(ordered) > size) + 1)
    height = float(ordered[-1] - ordered[0])
    if height <= size:
        return Appearance(SYNCHRONOUS, 1, height)
    places = np.minimum((ordered - ordered[0]) / height * _PARTS, _PARTS - 1).astype(int)
    filled = np.unique(places).size / _PARTS
    if len(parts) == 2 and all(np.ptp(part) <= size for part in parts):
        kind = DOUBLE
    else:
        kind = FILLED if filled >= _FILLED and height >= _PARTS * size else MULTIPLE
    return Appearance(kind, len(parts), height)
