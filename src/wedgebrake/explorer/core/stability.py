"""Linear stability of sliding over two groups: margins, where the brake locks, the present."""

from __future__ import annotations

import math
from collections.abc import Hashable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from wedgebrake.analysis.linear_stability import stability_map
from wedgebrake.analysis.linear_stability.damping import is_constant
from wedgebrake.errors import InputError
from wedgebrake.explorer.core import cells, legend
from wedgebrake.explorer.core.axis import Axis
from wedgebrake.explorer.core.machine import without
from wedgebrake.explorer.core.state import Desk, axes
from wedgebrake.model.brakes import WedgeBrake

FloatArray = NDArray[np.float64]

# Cells across and up, fewer if each is computed individually; approximate number of margin lines.
_CELLS, _FEW_CELLS, _LINES = (280, 120), (56, 30), 6
UNSTABLE, STABLE, HELD, LOCKED = range(4)
COLOURS = ("#F7E3D8", "#DBEDE4", "#C9D2DA", "#B4BCC4")
_WORDS = (
    "unstable: vibration about sliding grows",
    "stable: it decays",
    "locks at rest, slides once moving",
    "locks: no forward sliding",
)


@dataclass(frozen=True, eq=False)
class StabilityMap:
    """Margins over eta and another group.

    codes  : UNSTABLE, STABLE, HELD or LOCKED, (rows up, columns across)
    margin : eta less the critical eta of the worse direction, as `codes`
    limit  : lines of margin zero
    levels : lines of other margins, with what they say
    """

    x: Axis
    y: Axis
    codes: cells.Codes
    margin: FloatArray
    limit: list[cells.Line]
    levels: list[tuple[str, cells.Line]]

    @property
    def legend(self) -> list[legend.Chip]:
        """The regions that occur."""
        there = [(COLOURS[code], _WORDS[code]) for code in np.unique(self.codes)]
        if self.limit:
            there.append((legend.LINE, "margin 0"))
        if self.levels:
            there.append((legend.THIN_LINE, "equal margin in η"))
        return there

    @property
    def progress(self) -> str:
        """All is known at once."""
        return ""


def parameters(desk: Desk) -> tuple[str, str]:
    """What the map goes over, across and up."""
    return "eta", "alpha" if isinstance(desk.system.brake, WedgeBrake) else "kinetic"


def key(desk: Desk) -> Hashable:
    """Inputs of the map: the axes, and the machine without its torque and the values on the axes.

    Raises ``InputError`` where eta is not defined.
    """
    x, y = _axes(desk)
    untouched = desk.system.replace(amplitude=0.0, frequency=1.0)
    return x, y, without(untouched, (x.name, y.name))


def work(desk: Desk) -> Iterator[StabilityMap]:
    """The whole map.

    Raises ``InputError`` where eta is not defined.
    """
    x, y = _axes(desk)
    line = desk.system.driveline
    sliding = desk.system.brake.radius * abs(line.drive_speed)
    wide, high = _CELLS if is_constant(desk.system.friction, sliding) else _FEW_CELLS
    dataset = stability_map(desk.system, **{y.name: y.values(high), x.name: x.values(wide)})
    margin, locked, stable = (dataset[k].to_numpy() for k in ("margin", "locked", "stable"))
    codes = np.where(stable, STABLE, UNSTABLE)
    if y.name == "alpha" and line.drive_speed == 0.0:
        codes[y.values(high) <= _static_ratio(desk)] = HELD
    codes[locked] = LOCKED
    known = np.where(codes >= HELD, math.nan, margin)
    places = x.places(wide), y.places(high)
    levels = [
        (text, line)
        for level, text in _levels(known).items()
        for line in cells.lines(*places, known, level)
    ]
    yield StabilityMap(
        x=x, y=y, codes=codes, margin=margin, limit=cells.lines(*places, known, 0.0), levels=levels
    )


def _axes(desk: Desk) -> tuple[Axis, Axis]:
    if desk.system.groups.eta is None:
        raise InputError(
            "eta: not defined without damping or friction, and so no margin in it. Raise them;"
            " without damping sliding is linearly stable exactly where the slope of the actuation"
            " force is positive."
        )
    if desk.system.driveline.stiffness == 0.0:
        raise InputError(
            "No map: without a spring nothing brings the driveline back. Raise the stiffness."
        )
    across, up = parameters(desk)
    if up not in axes(desk.system):
        raise InputError(
            "No map: it goes over the kinetic friction coefficient, and a table of friction has"
            " many. Choose Coulomb friction, or a wedge brake, whose map goes over its angle."
        )
    return Axis.of(desk, across), Axis.of(desk, up)


def _static_ratio(desk: Desk) -> float:
    return desk.system.groups.static_ratio or 1.0


def _levels(margin: FloatArray) -> dict[float, str]:
    """Round margins but zero, with their words."""
    known = margin[np.isfinite(margin)]
    if not known.size or np.ptp(known) == 0.0:
        return {}
    axis = Axis("margin", float(known.min()), float(known.max()))
    return {
        one: text if one < 0.0 else f"+{text}" for one, text in axis.ticks(_LINES).items() if one
    }
