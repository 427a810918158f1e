"""Bifurcation diagrams by the paper's protocol, and the limits visible in them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np

from wedgebrake.arrays import FloatArray
from wedgebrake.model.paper_machines import DIAGRAMS, HERTZ, KINETIC, Case, DiagramRange
from wedgebrake.paper.laboratory import Laboratory, SteadyRun
from wedgebrake.paper.visual_criteria import THRESHOLDS, Appearance, appearance

Kinds = tuple[str, ...]
"""Kinds of motion, of which one is seen in a segment of a diagram."""

COLUMNS = 200
# Every slope that the paper prints is a multiple of 6 in eta, every frequency a whole number of
# hertz to its digits, and every wedge angle of its last sweep a tenth of a radian: one column of
# a diagram. A limit is known to one column, and to no better than 2.5 % of the axis.
_ETA_COLUMN, _ANGLE_COLUMN, _READING = 6.0, 0.1, 0.025


class DiagramPlan(DiagramRange):
    """One of the paper's diagrams as it is computed."""

    @property
    def resolution(self) -> float:
        """Error of a limit read from the printed diagram."""
        read = _READING * (self.high - self.low)
        return {"eta": _ETA_COLUMN, "f": max(HERTZ, read)}.get(self.name, read)

    def values(self) -> FloatArray:
        """About ``COLUMNS`` equally spaced values, half as many of f, where the section exists.

        Frequencies are multiples of 0.05 Hz, for which 20 s are whole periods: elsewhere the
        section t = 20 s + n/f_e has another phase at each frequency. Self-locking wedges are
        taken at the paper's columns alone: the wall of the smoothed law is slow to compute.
        """
        count = COLUMNS // 2 if self.name == "f" else COLUMNS  # of f more periods each
        wanted = np.linspace(self.low, self.high, count)
        if self.name == "alpha":
            wanted = np.concatenate((self.columns()[:2], np.linspace(1.0, self.high, count)))
        return np.unique([self.lattice(value) for value in wanted])

    def lattice(self, value: float) -> float:
        """Round a value to the nearest one that can be taken."""
        step = 0.05 * HERTZ
        return round(value / step) * step if self.name == "f" else float(value)

    def columns(self) -> FloatArray:
        """Few values: the paper's own over f and alpha, where the printed ones reveal them.

        Otherwise four in each segment, the outer ones as far from the printed limits as these
        may be off.
        """
        if self.name == "f":
            return np.asarray(HERTZ * np.arange(5.0, 48.0), dtype=float)
        if self.name == "alpha":
            angles = _ANGLE_COLUMN * np.arange(1.0, 13.0)
            return np.asarray(np.tan(angles) / KINETIC, dtype=float)
        parts = []
        for low, high in pairwise((self.low, *self.limits, self.high)):
            inside = min(self.resolution, 0.25 * (high - low))
            parts.append(np.linspace(low + inside, high - inside, 4))
        return np.concatenate(parts)


PLANS = {name: DiagramPlan(**vars(one)) for name, one in DIAGRAMS.items()}
"""The diagrams of the paper, by figure."""


@dataclass(frozen=True)
class Diagram:
    """Columns of Poincare points over one parameter, in ascending order.

    base, name, values : the case, the group that is varied, (n,) its values
    columns            : the last 5 s at each value
    """

    base: Case
    name: str
    values: FloatArray
    columns: tuple[SteadyRun, ...]

    @cached_property
    def axis(self) -> float:
        """Height of the diagram [rad/s], 0 if there is nothing in it."""
        found = np.concatenate([column.velocity for column in self.columns])
        return float(np.ptp(found)) if found.size else 0.0

    def appearances(self, dot: float = THRESHOLDS.dot) -> list[Appearance]:
        """Appearance of each column."""
        return [appearance(column.velocity, self.axis, dot) for column in self.columns]


def diagram(laboratory: Laboratory, base: Case, name: str, values: Iterable[float]) -> Diagram:
    """Compute the diagram of a case over the group ``name``."""
    ordered = np.sort(np.asarray(values, dtype=float))
    cases = [base.at(**{name: float(value)}) for value in ordered]
    return Diagram(base, name, ordered, tuple(laboratory.steadies(cases)))


def paper_diagram(laboratory: Laboratory, plan: DiagramPlan) -> Diagram:
    """Compute the diagram of a plan, as fine as the laboratory works."""
    values = plan.columns() if laboratory.coarse else plan.values()
    return diagram(laboratory, plan.base, plan.name, values)


@dataclass(frozen=True)
class StatementFit:
    """The segments of a statement fitted to a diagram.

    limits    : (m - 1,) limits between m segments, each between two neighbouring values
    brackets  : (m - 1, 2) those values, after bisection
    agreement : (m,) share of the columns in each segment that show one of its kinds
    """

    limits: FloatArray
    brackets: FloatArray
    agreement: FloatArray


def fit(
    laboratory: Laboratory,
    shown: Diagram,
    segments: Sequence[Kinds],
    resolution: float,
    lattice: Callable[[float], float] = float,
) -> StatementFit:
    """Fit segments to a diagram: the limits that the fewest columns contradict.

    Of several such sets of limits, one is preferred whose limits are changes from a kind on
    the left to a kind on the right. Each limit is then refined by bisection, down to
    ``resolution``, unless the laboratory is coarse.

    segments : kinds of motion, from small to large values
    lattice  : the value to take for a wanted one, where only some are possible
    """
    dot = laboratory.thresholds.dot
    seen = [one.kind for one in shown.appearances(dot)]
    edges = [*_starts(seen, segments), len(seen)]
    agreement = []
    for (begin, end), kinds in zip(pairwise(edges), segments, strict=True):
        fitting = sum(kind in kinds for kind in seen[begin:end])
        agreement.append(fitting / (end - begin) if end > begin else 0.0)

    def bisected(low: float, high: float, left: Kinds, right: Kinds) -> tuple[float, float]:
        while high - low > resolution and not laboratory.coarse:
            middle = lattice(0.5 * (low + high))
            if not low < middle < high:
                break
            steady = laboratory.steady(shown.base.at(**{shown.name: middle}))
            kind = appearance(steady.velocity, shown.axis, dot).kind
            if (kind in left) == (kind in right):
                break  # evidence for neither side
            low, high = (low, middle) if kind in right else (middle, high)
        return float(low), float(high)

    brackets = []
    for start, (left, right) in zip(edges[1:-1], pairwise(segments), strict=True):
        low, high = shown.values[max(start - 1, 0)], shown.values[min(start, len(seen) - 1)]
        brackets.append(bisected(low, high, left, right))
    pairs = np.array(brackets, dtype=float).reshape(-1, 2)
    return StatementFit(pairs.mean(axis=1), pairs, np.array(agreement))


def _starts(seen: Sequence[str], segments: Sequence[Kinds]) -> list[int]:
    """First column of each segment, by dynamic programming over the columns."""
    count = len(seen)
    fits = np.array([[kind in segment for kind in seen] for segment in segments], dtype=int)
    # wrong[s, i]: columns before i that contradict segment s.
    wrong = np.cumsum(np.insert(1 - fits, 0, 0, axis=1), axis=1)
    best = wrong[0].astype(float)
    choices = []
    for s in range(1, len(segments)):
        # A small cost unless segment s begins at column i with a change to one of its kinds.
        unlike = np.full(count + 1, 1e-3)
        unlike[1:-1] = 1e-4 * (2 - fits[s - 1, :-1] - fits[s, 1:])
        gain = best + unlike - wrong[s]
        # The first column of the least gain up to each column.
        least = np.minimum.accumulate(np.append(np.inf, gain))
        where = np.maximum.accumulate(np.where(gain < least[:-1], np.arange(count + 1), 0))
        best = gain[where] + wrong[s]
        choices.append(where)
    starts = [count]
    for where in reversed(choices):
        starts.append(int(where[starts[-1]]))
    return [0, *reversed(starts[1:])]
