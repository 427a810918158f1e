"""Smoothed and exact friction compared: where the paper's smoothing changes the result."""

from __future__ import annotations

import math
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wedgebrake.analysis.motion import motion
from wedgebrake.analysis.sticking import AT_REST
from wedgebrake.model.paper_machines import CORRECTED, DURATION, KINETIC, RESPONSES, Case
from wedgebrake.paper.claims import all_hold, parts_of
from wedgebrake.paper.diagrams import PLANS, paper_diagram
from wedgebrake.paper.laboratory import RTOL, Laboratory, section_times
from wedgebrake.paper.signal_features import visible_sticks
from wedgebrake.paper.statements import STATEMENTS
from wedgebrake.paper.visual_criteria import appearance
from wedgebrake.solvers.simulate import simulate

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FloatArray = NDArray[np.float64]

STEEPNESS = (50.0, 100.0, 200.0, 500.0, 1000.0, 2000.0)
"""xi [s/m]; the paper's is 100."""
PAPER_STEEPNESS = 100.0
REGULAR = (Case(eta=-60.0), Case(eta=0.0), Case(eta=0.0, F0=0.09))
"""Cases whose response does not depend sensitively on the initial state."""
_SPAN = 2.0


class _Limit(NamedTuple):
    """A limit of figure 11a: its name, the groups of points on both sides, a bracket in F_0."""

    name: str
    left: int
    right: int
    low: float
    high: float


_LIMITS = (_Limit("4T to 2T", 3, 2, 0.052, 0.062), _Limit("2T to T", 2, 1, 0.064, 0.078))
_HEIGHT = 32.0
"""Height of figure 11a's axis [rad/s]."""
_FINE, _CLOSE = 1e-5, 0.002
"""Width of a bracket of F_0, and share of the axis from which points are told apart."""
_CREEPING = Case(eta=0.0, F0=0.12)
_NEAR_BREAKAWAY = (0.03, 0.04, 0.05, 0.06, 0.07, 0.08, 0.09, 0.105, 0.11)
_NUDGE, _LATE = 1e-12, np.arange(1.0, 15.0, 0.25)
_COMPARED = (
    Case(eta=0.0, F0=0.036),
    Case(eta=0.0, F0=0.06),
    *(case for number in (6, 9, 12) for case in RESPONSES[number].cases),
)
_BY_RUNS = tuple(statement for statement in STATEMENTS if statement.name[0] != "S")


class Compared(NamedTuple):
    """One case by both laws: kind of motion by its points, and class of stick-slip."""

    case: Case
    smoothed: tuple[str, str]
    exact: tuple[str, str]


@dataclass(frozen=True)
class Smoothing:
    """Result of the comparison.

    errors : (cases, steepness) rms difference of the velocity from the exact one over 2 s,
             over its range
    limits : name, (steepness,) limits in F_0 of figure 11a, and the exact one
    creep  : (steepness,) largest speed where the exact brake rests for good [rad/s]
    cases  : by both laws
    paragraphs : conclusions in words
    """

    errors: FloatArray
    limits: tuple[tuple[str, FloatArray, float], ...]
    creep: FloatArray
    cases: tuple[Compared, ...]
    paragraphs: tuple[str, ...]

    def table(self) -> list[dict[str, str]]:
        """Cases as rows of text."""
        return [
            {
                "η": f"{one.case.eta:g}",
                "f": f"{one.case.f:g}",
                "F_0": f"{one.case.F0:g}",
                "smoothed: points": one.smoothed[0],
                "Coulomb: points": one.exact[0],
                "smoothed: sticks": one.smoothed[1],
                "Coulomb: sticks": one.exact[1],
                "same": "yes" if one.smoothed == one.exact else "no",
            }
            for one in self.cases
        ]

    def draw(self) -> Figure:
        """Draw the convergence in xi of responses, limits and creep."""
        from wedgebrake.paper.figures.studies import smoothing

        return smoothing(self)


def compare(laboratory: Laboratory) -> Smoothing:
    """Compare the paper's smoothing with Coulomb friction, under the corrected assumptions."""
    smooth = laboratory.like(method="smooth", assumptions=CORRECTED)
    exact = smooth.like(method="exact")
    with ThreadPoolExecutor(laboratory.threads) as pool:
        errors = np.array(list(pool.map(_errors, REGULAR)))
        tasks = [(limit, steepness) for limit in _LIMITS for steepness in (*STEEPNESS, math.inf)]
        found = list(pool.map(lambda task: _found(*task), tasks))
        creep = np.array(list(pool.map(_creep, STEEPNESS)))
    rows = np.array(found).reshape(len(_LIMITS), -1)
    limits = tuple(
        (limit.name, row[:-1], float(row[-1])) for limit, row in zip(_LIMITS, rows, strict=True)
    )
    cases = _cases(smooth, exact)
    words = (
        _on_convergence(errors),
        _on_limits(limits),
        _on_creep(creep, cases),
        _on_breakaway(smooth, exact),
        _on_classes(cases),
        _on_chaos(smooth, exact),
        _on_columns(smooth, exact),
        _on_statements(smooth, exact),
    )
    return Smoothing(errors, limits, creep, cases, words)


def _points(case: Case, steepness: float, times: FloatArray, duration: float) -> FloatArray:
    """Velocities at some times; infinite steepness stands for Coulomb friction, exactly."""
    if math.isinf(steepness):
        system, method = CORRECTED.system(case, "coulomb"), "exact"
    else:
        system, method = CORRECTED.system(case, "smoothed").replace(steepness=steepness), "smooth"
    response = simulate(system, duration, method=method, times=times, rtol=RTOL)
    velocity: FloatArray = response["velocity"].to_numpy()
    return velocity


def _errors(case: Case) -> list[float]:
    times = np.linspace(0.0, _SPAN, 2001)
    truth = _points(case, math.inf, times, _SPAN)
    return [
        float(np.sqrt(np.mean((_points(case, xi, times, _SPAN) - truth) ** 2)) / np.ptp(truth))
        for xi in STEEPNESS
    ]


def _found(limit: _Limit, steepness: float) -> float:
    """F_0 of a limit, by bisection."""
    low, high = limit.low, limit.high
    while high - low > _FINE:
        middle = 0.5 * (low + high)
        case = Case(F0=middle)
        times = section_times(CORRECTED.system(case, "coulomb").excitation.frequency)
        seen = appearance(_points(case, steepness, times, DURATION), _HEIGHT, _CLOSE)
        if min(seen.groups, limit.left) > limit.right:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)


def _creep(steepness: float) -> float:
    times = np.linspace(DURATION - 1.0, DURATION, 1001)
    return float(np.max(np.abs(_points(_CREEPING, steepness, times, DURATION))))


def _cases(smooth: Laboratory, exact: Laboratory) -> tuple[Compared, ...]:
    sides = []
    for laboratory in (smooth, exact):
        points = laboratory.steadies(_COMPARED)
        responses = laboratory.responses(_COMPARED)
        sides.append(
            [
                (appearance(one.velocity, _axis(case)).kind, visible_sticks(response).kind)
                for case, one, response in zip(_COMPARED, points, responses, strict=True)
            ]
        )
    return tuple(Compared(case, *both) for case, *both in zip(_COMPARED, *sides, strict=True))


def _axis(case: Case) -> float:
    """Height of the paper's diagram that shows a case, or of its own motion [rad/s]."""
    return _HEIGHT if case.F0 != Case().F0 and case.eta != 0.0 else 12.0


def _on_convergence(errors: FloatArray) -> str:
    orders = [
        math.log(one / two) / math.log(high / low)
        for row in errors
        for (one, two), (low, high) in zip(pairwise(row[2:]), pairwise(STEEPNESS[2:]), strict=True)
    ]
    at = STEEPNESS.index(PAPER_STEEPNESS)
    worst = 100.0 * float(np.max(errors[:, at]))
    return (
        "Away from chaos the smoothed response tends to the exact one as ξ grows, with an order of"
        f" {min(orders):.2g} to {max(orders):.2g} between successive ξ from 200 on. At the paper's"
        f" ξ = {PAPER_STEEPNESS:g} it is off by up to {worst:.2g} % (rms, of the velocity's range)"
        f" within the first {_SPAN:g} s."
    )


def _on_limits(limits: Sequence[tuple[str, FloatArray, float]]) -> str:
    at = STEEPNESS.index(PAPER_STEEPNESS)
    each = []
    for (name, row, truth), printed in zip(limits, PLANS["11a"].limits[-2:], strict=True):
        nearest = STEEPNESS[int(np.argmin(np.abs(row - printed)))]
        each.append(
            f"{name} at F_0 = {row[at]:.4f} at ξ = {PAPER_STEEPNESS:g} and at {truth:.4f} with"
            f" Coulomb friction, where the paper prints {printed:g}, of the steepnesses tried"
            f" nearest to ξ = {nearest:g}"
        )
    return (
        f"Limits of figure 11a move with ξ: {'; '.join(each)}. Whether the paper's reading is off"
        " or its computation was steeper than it says stays open."
    )


def _on_creep(creep: FloatArray, cases: Sequence[Compared]) -> str:
    alpha = _CREEPING.alpha
    bound = KINETIC * (alpha**2 - 1.0) / alpha
    at = STEEPNESS.index(PAPER_STEEPNESS)
    alone = [one for one in cases if AT_REST == one.exact[1] != one.smoothed[1]]
    return (
        "With Coulomb friction the wedge brake can rest for good where the holding interval is"
        f" wider than the torque swings, F_0 > μ_s (α² − 1)/α = {bound:.4f} at α = {alpha:g}; a"
        " steep slope keeps a stick-slip orbit alive beside rest a little further, until a fold."
        f" What the smoothed law shows there is its creep: {_names(alone)}. At F_0 ="
        f" {_CREEPING.F0:g}, η = 0, the creep reaches {creep[at]:.2g} rad/s at ξ ="
        f" {PAPER_STEEPNESS:g} and {creep[-1]:.2g} rad/s at ξ = {STEEPNESS[-1]:g}."
    )


def _on_breakaway(smooth: Laboratory, exact: Laboratory) -> str:
    cases = [Case(eta=0.0, F0=float(force)) for force in _NEAR_BREAKAWAY]
    words = [[visible_sticks(one).kind for one in lab.responses(cases)] for lab in (smooth, exact)]
    unlike = [
        f"F_0 = {case.F0:g} ({one} instead of {two})"
        for case, one, two in zip(cases, *words, strict=True)
        if one != two
    ]
    return (
        f"Near breakaway, at η = 0 and F_0 = {_NEAR_BREAKAWAY[0]:g} to {_NEAR_BREAKAWAY[-1]:g}, the"
        f" class of stick-slip differs at {len(unlike)} of {len(cases)} values:"
        f" {', '.join(unlike) or 'none'}. A smoothed brake creeps where Coulomb friction holds."
    )


def _names(cases: Sequence[Compared]) -> str:
    return ", ".join(f"(η = {c.eta:g}, f = {c.f:g}, F_0 = {c.F0:g})" for c, *_ in cases) or "none"


def _on_classes(cases: Sequence[Compared]) -> str:
    sticks = [one for one in cases if one.smoothed[1] != one.exact[1]]
    points = [one for one in cases if one.smoothed[0] != one.exact[0]]
    return (
        f"Of {len(cases)} cases, those of figures 6, 9 and 12 and F_0 = 0.06 at η = 0, smoothing"
        f" changes the class of stick-slip in {len(sticks)}, and the kind of motion that the"
        f" Poincaré points show in {len(points)} (see the table)."
    )


def _on_chaos(smooth: Laboratory, exact: Laboratory) -> str:
    case = Case()
    settled = motion(exact.system(case)).word
    seen = appearance(smooth.steady(case).velocity, _axis(case))
    stuck = [visible_sticks(one.response(case)).kind for one in (smooth, exact)]
    late = simulate(exact.system(case), DURATION, method="exact", times=_LATE)
    moved = simulate(
        exact.system(case), DURATION, method="exact", times=_LATE, initial=(_NUDGE, 0.0)
    )
    apart = np.abs(late["velocity"].to_numpy() - moved["velocity"].to_numpy())
    lost = _LATE[apart > 0.1]
    grows = f"by {lost[0]:.3g} s" if lost.size else "not"
    return (
        "At η = −24, F_0 = 0.036, the middle of most figures, Coulomb friction settles on"
        f" {settled} motion ({stuck[1]} after 20 s); the smoothed law shows {seen.groups} groups of"
        f" points after 20 s ({stuck[0]}). The exact motion depends sensitively on its start before"
        f" it settles: a start {_NUDGE:g} rad aside has {grows} grown to a difference of 0.1 rad/s."
    )


def _on_statements(smooth: Laboratory, exact: Laboratory) -> str:
    """Name the statements that hold with one law and not with the other."""
    unlike = []
    for statement in _BY_RUNS:
        one, two = (
            all_hold(parts_of(statement, laboratory, statement.corrected))
            for laboratory in (smooth, exact)
        )
        if one != two:
            unlike.append(f"{statement.name} holds only {'smoothed' if one else 'exactly'}")
    return (
        f"Of the {len(_BY_RUNS)} statements on motions, with the corrected values, those that hold"
        f" with one law and not with the other: {', '.join(unlike) or 'none'}."
    )


def _on_columns(smooth: Laboratory, exact: Laboratory) -> str:
    each = []
    for name in ("8a", "8b", "11a", "11b"):
        plan = PLANS[name]
        both = [
            [column.kind for column in paper_diagram(one, plan).appearances()]
            for one in (smooth, exact)
        ]
        unlike = sum(one != two for one, two in zip(*both, strict=True)) / len(both[0])
        each.append(f"{100.0 * unlike:.0f} % of figure {name}")
    return f"The kind of motion that a column shows differs in {', '.join(each)}."
