"""The map of regimes: the class of motion over two parameters."""

from __future__ import annotations

from collections.abc import Hashable, Iterator
from dataclasses import dataclass

import numpy as np

from wedgebrake.explorer.core import cells, legend
from wedgebrake.explorer.core.axis import Axis
from wedgebrake.explorer.core.evaluation import judging
from wedgebrake.explorer.core.machine import following, settings, slow, without
from wedgebrake.explorer.core.progressive_sweep import STEP, Filling
from wedgebrake.explorer.core.stability_limit import stability_limit
from wedgebrake.explorer.core.state import Desk, axes
from wedgebrake.figures.matplotlib import class_styles

_SLOW = 2.5  # steps of a slow solver are so much longer


@dataclass(frozen=True, eq=False)
class Regimes:
    """Classes of motion as far as they are known.

    codes        : (rows up, columns across), the unknown cells as the nearest known one
    shown        : the same in runs along rows, each with its words
    known, whole : cells computed, of so many
    limit        : lines along which sliding loses linear stability, in places
    legend       : the classes that occur
    """

    x: Axis
    y: Axis
    codes: cells.Codes
    shown: cells.Runs
    known: int
    whole: int
    limit: list[cells.Line]
    legend: list[legend.Chip]

    @property
    def progress(self) -> str:
        """How much is known."""
        return f"{self.known} of {self.whole} cells" if self.known < self.whole else ""


def parameters(desk: Desk) -> tuple[str, str]:
    """What the map goes over, across and up: as wished, or others that the machine has."""
    possible = axes(desk.system)
    across = desk.view.across if desk.view.across in possible else possible[-1]
    up = desk.view.up if desk.view.up in possible and desk.view.up != across else None
    others = [one for one in ("F0", "eta", *possible) if one in possible and one != across]
    return across, up or others[0]


def key(desk: Desk) -> Hashable:
    """All that the map depends on, of its own parameters the ends alone."""
    names = parameters(desk)
    return (
        *(Axis.of(desk, name) for name in names),
        without(desk.system, names),
        tuple(judging(desk).items()),
        tuple(settings(desk).items()),
    )


def work(desk: Desk) -> Iterator[Regimes]:
    """The map as it fills up.

    Raises ``InputError`` for two parameters of which one sets the other, and where no value of
    one can be taken.
    """
    x, y = (Axis.of(desk, name) for name in parameters(desk))
    some = slow(desk)
    levels = cells.levels(some)
    high, wide = levels[-1]
    filling = Filling(
        following(desk.system), {y.name: y.values(high), x.name: x.values(wide)}, levels,
        **judging(desk), keep_points=False, **settings(desk),
    )  # fmt: skip
    step = STEP * (_SLOW if some else 1.0)
    limit: list[cells.Line] = []
    level = filling.level
    for _ in filling.steps(step, step):
        if filling.level != level:
            # Fewer points are enough for the line than for the classes.
            limit = limit or _limit(filling, x, y)
            level = filling.level
        yield _picture(filling, x, y, limit)


def _picture(filling: Filling, x: Axis, y: Axis, limit: list[cells.Line]) -> Regimes:
    found = class_styles.classes(filling.dataset()).to_numpy().astype(np.int64)
    codes = cells.stand_in(found, filling.known)
    entries = legend.present(found[filling.known])
    if limit:
        entries.append((legend.LINE, "linear stability limit"))
    return Regimes(
        x=x, y=y, codes=codes,
        shown=cells.rows(codes, x, y, lambda code: legend.words(class_styles.MOTION_LOOKS[code])),
        known=int(filling.known.sum()), whole=filling.known.size, limit=limit, legend=entries,
    )  # fmt: skip


def _limit(filling: Filling, x: Axis, y: Axis) -> list[cells.Line]:
    """The limit of linear stability, from the finest grid that is complete."""
    (up, across), damping = filling.complete("sliding_damping")
    high, wide = filling.known.shape
    places = x.places(wide)[across], y.places(high)[up]
    return stability_limit(filling.plan.system, x, y, places, damping)
