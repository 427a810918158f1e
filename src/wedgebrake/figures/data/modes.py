"""Contents of the picture of the modes of a machine."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from wedgebrake.analysis.linear_stability import Stability
from wedgebrake.arrays import FloatArray
from wedgebrake.figures import style
from wedgebrake.model.validation import wrong

# Growth rates below this share of the eigenvalue are rounding errors.
_ROUNDING = 1e-12
MOST = 12
"""Largest number of modes in a picture."""


class ModeShape(NamedTuple):
    """One mode: its title and the (n,) deflections of the inertias, of which the largest is 1.

    size  : magnitudes of the deflections

    grows : whether the mode grows
    """

    deflection: FloatArray
    size: FloatArray
    title: tuple[str, ...]
    grows: bool


@dataclass(frozen=True, eq=False)
class Modes:
    """Modes of the critical case in which inertias move, the fastest-growing first.

    inertias : their names
    shapes   : of the modes shown
    verdict  : on the machine as a whole
    """

    inertias: tuple[str, ...]
    shapes: tuple[ModeShape, ...]
    verdict: str

    @classmethod
    def of(cls, stability: Stability, most: int = MOST) -> Modes:
        """Modes of the critical case of a machine.

        Raises ``InputError`` for anything else.
        """
        if not isinstance(stability, Stability):
            raise wrong("stability", stability, "the result of wb.stability(machine)")
        moving = [one for one in stability.modes if not one.rigid and np.any(one.shape)]
        shapes = []
        for mode in moving[:most]:
            how = f"{style.number(mode.frequency)} Hz" if mode.frequency > 0.0 else "no oscillation"
            title = [f"{how}, damping ratio {style.number(mode.damping_ratio, 3)}"]
            grows = mode.growth_rate > _ROUNDING * abs(mode.eigenvalue)
            rate = f"grows with {style.number(mode.growth_rate, 3)} 1/s" if grows else ""
            fed = f"fed by {mode.fed_by}" if mode.fed_by is not None else ""
            title.append(", ".join(filter(None, (rate, fed))))
            deflection = np.real(mode.shape)
            shapes.append(ModeShape(deflection, np.abs(mode.shape), tuple(title), bool(grows)))
        return cls(stability.inertias, tuple(shapes), stability.verdict)
