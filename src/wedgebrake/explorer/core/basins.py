"""Basins of attraction: to which motion the machine settles, from where it starts."""

from __future__ import annotations

from collections.abc import Hashable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from wedgebrake.dynamics.enums import MotionClass, motion_word
from wedgebrake.explorer.core import cells, legend
from wedgebrake.explorer.core.attractors import Attractors
from wedgebrake.explorer.core.axis import Axis
from wedgebrake.explorer.core.evaluation import judging
from wedgebrake.explorer.core.machine import settings, slow, without
from wedgebrake.explorer.core.progressive_sweep import STEP, Filling
from wedgebrake.explorer.core.state import Desk
from wedgebrake.figures.matplotlib import class_styles
from wedgebrake.figures.matplotlib.style import percent

FloatArray = NDArray[np.float64]

PARAMETERS = ("initial_angle", "initial_velocity")
# Steps are so much shorter as it takes to tell attractors apart; of a slow solver longer.
_SHARE, _SLOW = 0.7, 2.5
# Looks of what has no attractor, by the numbers of ``wb.basins`` from -1 down.
_OUTCOMES = tuple(
    class_styles.MOTIONS[name] for name in ("undecided", "diverged", "self_locked", "not_computed")
)
_MOST = len(class_styles.ATTRACTORS)
TABLE = (
    *(class_styles.Look("", colour) for colour in class_styles.ATTRACTORS),
    class_styles.Look("others", class_styles.OTHERS),
    *_OUTCOMES,
)
"""Looks of the cells by their code: attractors, the largest first, then what has none."""


@dataclass(frozen=True, eq=False)
class Basins:
    """Attractors over the start as far as they are known.

    codes        : places in TABLE, (velocities, angles); unknown cells as the nearest known one
    shown        : the same in runs along rows, each with its words
    known, whole : cells computed, of so many
    orbits       : for each attractor drawn its colour and its Poincare points, (points, 2)
    legend       : attractors with their shares, and what else there is
    """

    x: Axis
    y: Axis
    codes: cells.Codes
    shown: cells.Runs
    known: int
    whole: int
    orbits: list[tuple[str, FloatArray]]
    legend: list[legend.Chip]

    @property
    def progress(self) -> str:
        """How much is known."""
        return f"{self.known} of {self.whole} starts" if self.known < self.whole else ""


def key(desk: Desk) -> Hashable:
    """All that the basins depend on; not the present start."""
    run = {name: value for name, value in settings(desk).items() if name != "initial"}
    return (
        *(Axis.of(desk, name) for name in PARAMETERS),
        without(desk.system, []),
        tuple(judging(desk).items()),
        tuple(run.items()),
    )


def work(desk: Desk) -> Iterator[Basins]:
    """The basins as they fill up.

    Raises ``InputError`` for a method that does not fit the friction law.
    """
    x, y = (Axis.of(desk, name) for name in PARAMETERS)
    some = slow(desk)
    levels = cells.levels(some)
    high, wide = levels[-1]
    filling = Filling(
        desk.system, {y.name: y.values(high), x.name: x.values(wide)}, levels,
        **judging(desk), **settings(desk),
    )  # fmt: skip
    attractors = Attractors(filling.plan.attributes())
    numbers = np.zeros(filling.known.shape, dtype=np.int64)
    labelled = np.zeros(filling.known.shape, dtype=bool)
    step = STEP * (_SLOW if some else _SHARE)
    for _ in filling.steps(step, step):
        new = filling.known & ~labelled
        found, merged = attractors.add({name: one[new] for name, one in filling.results.items()})
        for one, other in merged.items():
            numbers[numbers == one] = other
        numbers[new] = found
        labelled |= new
        yield _picture(x, y, numbers, labelled, attractors)


def _picture(
    x: Axis, y: Axis, numbers: cells.Codes, known: NDArray[np.bool_], attractors: Attractors
) -> Basins:
    there, counts = np.unique(numbers[known], return_counts=True)
    shares = dict(zip(there.tolist(), (counts / counts.sum()).tolist(), strict=True))
    ranked = sorted((one for one in shares if one >= 0), key=lambda one: (-shares[one], one))
    place = {one: min(rank, _MOST) for rank, one in enumerate(ranked)}
    place |= {-1 - i: _MOST + 1 + i for i in range(len(_OUTCOMES))}
    words = {place[one]: _motion(attractors, one) for one in ranked[:_MOST]}
    entries = [
        (legend.background(TABLE[place[one]]), f"{words[place[one]]} {percent(shares[one])}")
        for one in ranked[:_MOST]
    ]
    if len(ranked) > _MOST:
        entries.append((class_styles.OTHERS, f"{len(ranked) - _MOST} others"))
    entries += [
        (legend.background(TABLE[place[one]]),
         f"{legend.words(TABLE[place[one]])} {percent(shares[one])}")
        for one in sorted(shares, reverse=True) if one < 0
    ]  # fmt: skip
    codes = np.vectorize(place.__getitem__, otypes=[np.int64])(cells.stand_in(numbers, known))
    return Basins(
        x=x, y=y, codes=codes,
        shown=cells.rows(codes, x, y, lambda code: words.get(code) or legend.words(TABLE[code])),
        known=int(known.sum()), whole=known.size,
        orbits=[
            (class_styles.ATTRACTORS[rank], attractors.orbit(one)[2])
            for rank, one in enumerate(ranked[:_MOST])
        ],
        legend=entries,
    )  # fmt: skip


def _motion(attractors: Attractors, number: int) -> str:
    """An attractor in words."""
    motion, order, _ = attractors.orbit(number)
    if motion == MotionClass.SYNCHRONOUS:
        return "synchronous (T)"
    return f"{order}T" if motion == MotionClass.PERIODIC and order else motion_word(motion)
