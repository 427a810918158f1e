"""What a reader can see in a printed bifurcation diagram.

The paper names motions from its diagrams: 5 s of Poincare points at each parameter, drawn as
dots. Two points are told apart where they are farther apart than a dot; what no 5 s could
tell (a torus from a resonance of high order, chaos from either) is not asked here. The
rigorous class is ``measures.motion``'s.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

SYNCHRONOUS = "synchronous"
DOUBLE = "2T"
MULTIPLE = "multi-periodic"
FILLED = "quasi-periodic"
NOTHING = "no steady motion"
WORDS = (SYNCHRONOUS, DOUBLE, MULTIPLE, FILLED, NOTHING)


class Eye(NamedTuple):
    """What a reader sees of a printed picture; the audit says what hangs on these.

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


EYE = Eye()
# A column counts as filled, not as separate dots, where this share of twenty equal parts of
# its height holds points, each part at least a dot high: fifty dots over less always touch.
# A torus leaves 85 % of them occupied on average and 50 random points 92 %; eight dots, or
# two bands a fifth of the height each, at most 40 %.
_PARTS, _FILLED = 20, 0.6


class Sight(NamedTuple):
    """One column of a diagram.

    word   : as above
    groups : of dots that touch
    height : highest less lowest point [rad/s]
    """

    word: str
    groups: int
    height: float


def look(velocity: FloatArray, axis: float, dot: float = EYE.dot) -> Sight:
    """One column as a reader sees it.

    velocity : (n,) Poincare points [rad/s]; none: the run did not last
    axis     : the height of the whole diagram [rad/s]
    dot      : height of a dot, as a share of the axis
    """
    if velocity.size == 0:
        return Sight(NOTHING, 0, 0.0)
    size = dot * axis
    ordered = np.sort(velocity)
    parts = np.split(ordered, np.flatnonzero(np.diff(ordered) > size) + 1)
    height = float(ordered[-1] - ordered[0])
    if height <= size:
        return Sight(SYNCHRONOUS, 1, height)
    places = np.minimum((ordered - ordered[0]) / height * _PARTS, _PARTS - 1).astype(int)
    filled = np.unique(places).size / _PARTS
    if len(parts) == 2 and all(np.ptp(part) <= size for part in parts):
        word = DOUBLE
    else:
        word = FILLED if filled >= _FILLED and height >= _PARTS * size else MULTIPLE
    return Sight(word, len(parts), height)
