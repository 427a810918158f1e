"""Contents of the picture of the modes of a machine."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wedgebrake.analysis.linear_stability import MachineStability
from wedgebrake.errors import InputError

FloatArray = NDArray[np.float64]

# Growth rates below this share of the eigenvalue are rounding.
_ROUNDING = 1e-12
MOST = 12
"""Modes in a picture."""


class ModeShape(NamedTuple):
    """One mode: (n,) deflections of the inertias and their sizes, the largest 1; its title.

    grows : whether the mode grows
    """

    deflection: FloatArray
    size: FloatArray
    title: tuple[str, ...]
    grows: bool


@dataclass(frozen=True, eq=False)
class Modes:
    """Modes that oscillate or grow, the one that grows fastest first.

    inertias : names
    shapes   : of the modes, at most ``most``
    hidden   : number of further modes, and of rigid ones and those of actuators alone
    verdict  : on the whole machine
    """

    inertias: tuple[str, ...]
    shapes: tuple[ModeShape, ...]
    hidden: int
    verdict: str

    @classmethod
    def of(cls, stability: MachineStability, most: int = MOST) -> Modes:
        """Modes of the critical case of a machine.

        Raises ``InputError`` for anything else.
        """
        if not isinstance(stability, MachineStability):
            raise InputError(
                f"stability = {type(stability).__name__}: must be the result of"
                " wb.stability(machine)."
            )
        moving = [one for one in stability.modes if not one.rigid and np.any(one.shape)]
        shapes = []
        for mode in moving[:most]:
            how = f"{mode.frequency:.4g} Hz" if mode.frequency > 0.0 else "no oscillation"
            title = [f"{how}, damping ratio {mode.damping_ratio:.3g}"]
            grows = mode.growth_rate > _ROUNDING * abs(mode.eigenvalue)
            rate = f"grows with {mode.growth_rate:.3g} 1/s" if grows else ""
            fed = f"fed by {mode.fed_by}" if mode.fed_by is not None else ""
            title.append(", ".join(filter(None, (rate, fed))))
            deflection = np.real(mode.shape)
            shapes.append(ModeShape(deflection, np.abs(mode.shape), tuple(title), bool(grows)))
        hidden = len(stability.modes) - len(shapes)
        return cls(stability.inertias, tuple(shapes), hidden, stability.verdict)
