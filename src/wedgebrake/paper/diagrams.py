"""Bifurcation diagrams by the paper's protocol, and the limits of what is seen in them."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from wedgebrake.paper.assumptions import CONVENTIONAL, Case
from wedgebrake.paper.laboratory import Laboratory, Steady
from wedgebrake.paper.parameters import INERTIA, KINETIC, STIFFNESS
from wedgebrake.paper.visual_criteria import EYE, Sight, look

FloatArray = NDArray[np.float64]


# Every slope that the paper prints is a multiple of 6 in eta, every frequency a whole number of
# hertz to its digits, and every wedge angle of its last sweep a tenth of a radian: one column of
# a diagram. A limit is known to one column, and to no better than 2.5 % of the axis.
COLUMNS = 200
ETA_COLUMN = 6.0
HERTZ = 2.0 * math.pi / math.sqrt(STIFFNESS / INERTIA)
"""One hertz of the torque as a step of f = f_e/f_n."""
ANGLE_COLUMN = 0.1
FREQUENCIES = tuple(HERTZ * hertz for hertz in (5, 10, 16, 20, 33))
"""f of figures 15 and 16, printed as 0.31, 0.63, 1.0, 1.26 and 2.07."""
STICKING = tuple(FREQUENCIES[i] for i in (0, 1, 3))
"""Those of them at which figure 15 is said to show sticks."""
_READING = 0.025


@dataclass(frozen=True)
class Plan:
    """One of the paper's diagrams.

    base, name  : the case, and the group that is varied
    low, high   : its range
    limits      : between its segments, as printed
    resolution  : what a limit read from the printed diagram may be off by
    """

    base: Case
    name: str
    low: float
    high: float
    limits: tuple[float, ...]
    resolution: float

    def values(self, count: int) -> FloatArray:
        """About ``count`` equally spaced values, half as many of f, where the section exists.

        Frequencies are multiples of 0.05 Hz, for which 20 s are whole periods: elsewhere the
        section t = 20 s + n/f_e has another phase at each frequency. Of wedges that lock
        themselves there are the paper's columns alone: the wall of the smoothed law is slow.
        """
        if self.name == "f":  # which cost more periods each
            count = count // 2
        wanted = np.linspace(self.low, self.high, count)
        if self.name == "alpha":
            wanted = np.concatenate((self.columns()[:2], np.linspace(1.0, self.high, count)))
        return np.unique([self.lattice(value) for value in wanted])

    def lattice(self, value: float) -> float:
        """The nearest value that can be taken."""
        return whole(value, 0.05 * HERTZ) if self.name == "f" else float(value)

    def columns(self) -> FloatArray:
        """Few values: the paper's own over f and alpha, where the printed ones reveal them.

        Otherwise four in each segment, the outer ones as far from the printed limits as these
        may be off.
        """
        if self.name == "f":
            return np.asarray(HERTZ * np.arange(5.0, 48.0), dtype=float)
        if self.name == "alpha":
            angles = ANGLE_COLUMN * np.arange(1.0, 13.0)
            return np.asarray(np.tan(angles) / KINETIC, dtype=float)
        ends = (self.low, *self.limits, self.high)
        parts = []
        for low, high in pairwise(ends):
            inside = min(self.resolution, 0.25 * (high - low))
            parts.append(np.linspace(low + inside, high - inside, 4))
        return np.concatenate(parts)


def whole(value: float, step: float) -> float:
    """The nearest multiple of a step."""
    return round(value / step) * step


_ETA, _FORCE, _FREQUENCY, _ANGLE = (-120.0, 12.0), (0.012, 0.12), (0.3, 3.0), (0.33, 8.60)
_READ_FORCE, _READ_ANGLE = _READING * 0.108, _READING * 8.27
_READ_FREQUENCY = max(HERTZ, _READING * 2.7)
PRINTED_F0 = 0.024
FORCE_WHY = "F_0 = 0.036 in figures 14 to 16, not 0.024"
_OTHER = Case(brake=CONVENTIONAL)
PLANS = {
    "8a": Plan(Case(), "eta", *_ETA, (-30.0, -18.0), ETA_COLUMN),
    "8b": Plan(_OTHER, "eta", *_ETA, (-24.0,), ETA_COLUMN),
    "11a": Plan(Case(), "F0", *_FORCE, (0.019, 0.028, 0.034, 0.058, 0.072), _READ_FORCE),
    "11b": Plan(_OTHER, "F0", *_FORCE, (0.044,), _READ_FORCE),
    "14a": Plan(Case(), "f", *_FREQUENCY, (0.56, 1.57), _READ_FREQUENCY),
    "14b": Plan(_OTHER, "f", *_FREQUENCY, (0.69, 1.57), _READ_FREQUENCY),
    "17": Plan(Case(F0=PRINTED_F0), "alpha", *_ANGLE, (1.41,), _READ_ANGLE),
}
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
    columns: tuple[Steady, ...]

    @cached_property
    def axis(self) -> float:
        """Height of the diagram [rad/s], 0 if there is nothing in it."""
        found = [column.velocity for column in self.columns if column.velocity.size]
        return float(np.ptp(np.concatenate(found))) if found else 0.0

    def sights(self, dot: float = EYE.dot) -> list[Sight]:
        """What is seen at each value."""
        return [look(column.velocity, self.axis, dot) for column in self.columns]


def diagram(laboratory: Laboratory, base: Case, name: str, values: Sequence[float]) -> Diagram:
    """The diagram of a case over the group ``name``."""
    ordered = np.sort(np.asarray(values, dtype=float))
    cases = [base.at(**{name: float(value)}) for value in ordered]
    return Diagram(base, name, ordered, tuple(laboratory.steadies(cases)))


def paper_diagram(laboratory: Laboratory, plan: Plan) -> Diagram:
    """The diagram of a plan, as fine as the laboratory works."""
    values = plan.columns() if laboratory.coarse else plan.values(COLUMNS)
    return diagram(laboratory, plan.base, plan.name, list(values))


@dataclass(frozen=True)
class Segment:
    """What is said, or found, of a part of a diagram: one of ``words`` is seen there."""

    words: tuple[str, ...]


@dataclass(frozen=True)
class Fit:
    """The segments of a statement, laid over what is seen.

    limits    : (m - 1,) found limits between m segments, each between two neighbouring values
    brackets  : (m - 1, 2) those values, after bisection
    agreement : (m,) share of the columns in each segment that show what is said there
    """

    limits: FloatArray
    brackets: FloatArray
    agreement: FloatArray


def fit(
    laboratory: Laboratory,
    shown: Diagram,
    segments: Sequence[Segment],
    resolution: float,
    lattice: Callable[[float], float] = float,
) -> Fit:
    """Where the segments begin and end: the limits with the fewest columns that contradict.

    Of several such sets of limits the first is taken whose limits are changes from what is
    said on the left to what is said on the right. Each limit is then refined by bisection,
    down to ``resolution``, unless the laboratory is coarse.

    segments   : from small to large values
    lattice    : the value to take for a wanted one, where only some are possible
    """
    seen = [sight.word for sight in shown.sights(laboratory.eye.dot)]
    starts = _starts(seen, segments)
    ends = [*starts[1:], len(seen)]
    agreement = [
        _share(seen[begin:end], segment.words)
        for begin, end, segment in zip(starts, ends, segments, strict=True)
    ]
    brackets = []
    for start, (left, right) in zip(starts[1:], pairwise(segments), strict=True):
        low, high = shown.values[max(start - 1, 0)], shown.values[min(start, len(seen) - 1)]
        brackets.append(_bisected(laboratory, shown, left, right, (low, high), resolution, lattice))
    pairs = np.array(brackets, dtype=float).reshape(-1, 2)
    return Fit(pairs.mean(axis=1), pairs, np.array(agreement))


def _share(seen: Sequence[str], words: Sequence[str]) -> float:
    """Share of the columns that show one of the words; 0 of none."""
    return sum(word in words for word in seen) / len(seen) if seen else 0.0


def _starts(seen: Sequence[str], segments: Sequence[Segment]) -> list[int]:
    """First column of each segment, by dynamic programming over the columns."""
    count = len(seen)
    # wrong[s][i]: columns before i that contradict segment s.
    wrong = [
        np.concatenate(([0], np.cumsum([word not in segment.words for word in seen])))
        for segment in segments
    ]
    best = wrong[0].astype(float)
    choices = []
    for s in range(1, len(segments)):
        cost = np.array([best[i] + _unlike(seen, segments, s, i) for i in range(count + 1)])
        gain = cost - wrong[s]
        where = np.zeros(count + 1, dtype=int)
        for i in range(1, count + 1):
            where[i] = i if gain[i] < gain[where[i - 1]] else where[i - 1]
        best = gain[where] + wrong[s]
        choices.append(where)
    starts = [count]
    for where in reversed(choices):
        starts.append(int(where[starts[-1]]))
    return [0, *reversed(starts[1:])]


def _unlike(seen: Sequence[str], segments: Sequence[Segment], s: int, i: int) -> float:
    """A little, unless segment s begins at column i with a change to what is said of it."""
    if not 0 < i < len(seen):
        return 1e-3
    fits = seen[i - 1] in segments[s - 1].words, seen[i] in segments[s].words
    return 1e-4 * (2 - sum(fits))


def _bisected(
    laboratory: Laboratory,
    shown: Diagram,
    left: Segment,
    right: Segment,
    bracket: tuple[float, float],
    resolution: float,
    lattice: Callable[[float], float],
) -> tuple[float, float]:
    """The bracket of a limit, halved while it is wider than the resolution."""
    low, high = bracket
    while high - low > resolution and not laboratory.coarse:
        middle = lattice(0.5 * (low + high))
        if not low < middle < high:
            break
        steady = laboratory.steady(shown.base.at(**{shown.name: middle}))
        word = look(steady.velocity, shown.axis, laboratory.eye.dot).word
        if (word in left.words) == (word in right.words):
            break  # no witness for either side
        if word in right.words:
            high = middle
        else:
            low = middle
    return float(low), float(high)
