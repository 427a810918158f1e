"""Linear stability: statements S1 to S6 (section 3, figures 2 and 3)."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from wedgebrake.analysis.linear_stability import DirectionStability, stability
from wedgebrake.model.friction import CoulombFriction
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.paper.assumptions import CONVENTIONAL, Case
from wedgebrake.paper.claims import Part, Statement
from wedgebrake.paper.laboratory import Laboratory
from wedgebrake.paper.parameters import KINETIC, STIFFNESS

_ALPHAS = (1.03, 1.21, 3.43)
_DIGITS = 1e-9
# "Much slower" is at least this many times.
_MUCH = 1.5
_SIDES = ("forward", "backward")


def _system(laboratory: Laboratory, case: Case) -> BrakedDriveline:
    """The system of a case with constant friction, as section 3 of the paper takes it."""
    system = laboratory.system(case)
    return system.replace(friction=CoulombFriction(kinetic=system.friction.reference))


def _one(laboratory: Laboratory, case: Case, side: str, **changed: Any) -> DirectionStability:
    system = _system(laboratory, case)
    found = stability(system.replace(**changed) if changed else system)
    return found.forward if side == "forward" else found.backward


def _value(number: float | None) -> float:
    return math.nan if number is None else number


def _critical_wedge(laboratory: Laboratory, _: dict[str, Any]) -> list[Part]:
    parts = []
    for side, sign in (("forward", 1.0), ("backward", -1.0)):
        worst, numbers = 0.0, []
        for alpha in _ALPHAS:
            wanted = sign * KINETIC - alpha * KINETIC
            found = _value(_one(laboratory, Case(alpha=alpha), side).hopf_eta)
            worst = float(np.maximum(worst, abs(found - wanted)))
            numbers.append(f"{found:.4g} at α = {alpha:g}")
        words = "θ' > 0: μ_k − tan α_w" if sign > 0.0 else "θ' < 0: −μ_k − tan α_w"
        parts.append(Part(f"critical η for {words}", worst < _DIGITS, ", ".join(numbers)))
    flips = []
    for alpha in _ALPHAS:
        limit = KINETIC - alpha * KINETIC
        verdicts = [
            stability(_system(laboratory, Case(eta=limit + step, alpha=alpha))).stable
            for step in (-1e-6, 1e-6)
        ]
        flips.append(verdicts == [False, True])
    parts.append(
        Part(
            "stable in both directions exactly above μ_k − tan α_w",
            all(flips),
            f"the verdict changes within ±1e-6 of it at {sum(flips)} of {len(flips)} angles",
        )
    )
    return parts


def _critical_conventional(laboratory: Laboratory, _: dict[str, Any]) -> list[Part]:
    numbers = []
    for kinetic in (0.05, 0.3, 0.9):
        for side in _SIDES:
            case = Case(brake=CONVENTIONAL)
            one = _one(laboratory, case, side, kinetic=kinetic, static=kinetic)
            numbers.append(_value(one.hopf_eta))
    spread = float(np.max(np.abs(np.array(numbers) + 1.0)))
    found = f"within {spread:.1e} of −1 at μ_k = 0.05, 0.3 and 0.9, both directions"
    return [Part("critical η = −1, whatever μ_k", spread < _DIGITS, found)]


def _critical(laboratory: Laboratory, kinetic: float, tangent: float) -> float:
    """Critical eta of a wedge, the larger of both directions."""
    case = Case(alpha=tangent / KINETIC)
    changed = {"kinetic": kinetic, "static": kinetic}
    # Changing mu_k keeps the wedge's angle.
    return max(_value(_one(laboratory, case, side, **changed).hopf_eta) for side in _SIDES)


def _stable_area(laboratory: Laboratory, _: dict[str, Any]) -> list[Part]:
    by_friction = [_critical(laboratory, kinetic, 0.4) for kinetic in (0.1, 0.2, 0.3)]
    by_angle = [_critical(laboratory, 0.3, math.tan(angle)) for angle in (0.32, 0.6, 1.0)]
    # Practical: the angle a little above arctan(mu_k), by up to a fifth of a radian.
    practical = [
        _critical(laboratory, kinetic, math.tan(math.atan(kinetic) + more))
        for kinetic in (0.1, 0.3, 0.5)
        for more in (0.01, 0.1, 0.2)
    ]
    return [
        Part(
            "smaller μ_k widens the wedge's stable range",
            by_friction == sorted(by_friction),
            "critical η = " + ", ".join(f"{v:.3f}" for v in by_friction)
            + " at μ_k = 0.1, 0.2, 0.3 (tan α_w = 0.4)",
        ),
        Part(
            "larger α_w widens it",
            by_angle == sorted(by_angle, reverse=True),
            "critical η = " + ", ".join(f"{v:.3f}" for v in by_angle)
            + " at α_w = 0.32, 0.6, 1.0 rad (μ_k = 0.3)",
        ),
        Part(
            "for angles close to arctan μ_k it is smaller than the conventional brake's",
            min(practical) > -1.0,
            f"critical η between {min(practical):.3f} and {max(practical):.3f} for angles up to"
            " 0.2 rad above arctan μ_k; −1 for the conventional brake",
        ),
    ]  # fmt: skip


def _collapses(laboratory: Laboratory, _: dict[str, Any]) -> list[Part]:
    natural = math.sqrt(STIFFNESS)
    parts = []
    for brake, words in (("wedge", "wedge"), (CONVENTIONAL, "conventional brake")):
        for side, sign in (("forward", "θ' > 0"), ("backward", "θ' < 0")):
            case = Case(brake=brake)
            points = _one(laboratory, case, side)
            reach = 1.5 * abs(_value(points.node_focus_unstable_eta))
            etas = np.linspace(-reach, reach, 2001)
            seen = [_one(laboratory, case.at(eta=float(eta)), side) for eta in etas]
            oscillates = np.array([bool(one.oscillates) for one in seen])
            growth = np.array([_value(one.growth_rate) for one in seen])
            changes = np.flatnonzero(np.diff(oscillates.astype(int)))
            rates = [0.5 * (growth[i] + growth[i + 1]) for i in changes]
            crossings = int(np.count_nonzero(growth[:-1] * growth[1:] < 0.0))
            near = sorted(abs(rate) / natural for rate in rates)
            holds = len(changes) == 2 and crossings == 1 and all(abs(n - 1.0) < 0.01 for n in near)
            where = ", ".join(f"{0.5 * (etas[i] + etas[i + 1]):.4g}" for i in changes)
            parts.append(
                Part(
                    f"{words}, {sign}: oscillation ends at two points, h = ±ω_n; one Hopf point",
                    holds,
                    f"ends near η = {where} with |h|/ω_n = "
                    + ", ".join(f"{n:.3f}" for n in near)
                    + f"; {crossings} change of sign of h at η = {_value(points.hopf_eta):.4g}",
                )
            )
    return parts


def _rate(laboratory: Laboratory, case: Case, side: str) -> float:
    """How fast sigma falls with eta [1/s], by difference over one unit of eta."""
    one, two = (_value(_one(laboratory, case.at(eta=eta), side).growth_rate) for eta in (0.0, 1e-3))
    return (one - two) / 1e-3


def _forward_rates(laboratory: Laboratory, _: dict[str, Any]) -> list[Part]:
    wedge = [_rate(laboratory, Case(alpha=alpha), "forward") for alpha in _ALPHAS]
    other = _rate(laboratory, Case(brake=CONVENTIONAL), "forward")
    words = ", ".join(f"{v:.4g}" for v in wedge)
    return [
        Part(
            "θ' > 0: the larger α, the slower the evolution",
            wedge == sorted(wedge, reverse=True),
            f"−dσ/dη = {words} 1/s at α = 1.03, 1.21, 3.43",
        ),
        Part(
            "the conventional brake is slower than every wedge",
            other < min(wedge),
            f"−dσ/dη = {other:.4g} 1/s",
        ),
    ]


def _backward_rates(laboratory: Laboratory, _: dict[str, Any]) -> list[Part]:
    back = [_rate(laboratory, Case(alpha=alpha), "backward") for alpha in _ALPHAS]
    forth = [_rate(laboratory, Case(alpha=alpha), "forward") for alpha in _ALPHAS]
    other = _rate(laboratory, Case(brake=CONVENTIONAL), "backward")
    ratios = ", ".join(f"{f / b:.3g}" for f, b in zip(forth, back, strict=True))
    return [
        Part(
            "θ' < 0: evolution much slower than for θ' > 0",
            all(_MUCH * b <= f for b, f in zip(back, forth, strict=True)),
            f"forward over backward rate = {ratios} at α = 1.03, 1.21, 3.43",
        ),
        Part(
            "at α = 3.43 slower than the conventional brake",
            back[-1] < other,
            f"{back[-1]:.4g} against {other:.4g} 1/s",
        ),
    ]


STATEMENTS = (
    Statement(
        "S1", "2", "The wedge brake is stable for η > μ_k − tan α_w; the critical values of the"
        " two directions are μ_k − tan α_w and −μ_k − tan α_w.",
        "Eigenvalues of sliding in both directions at three wedge angles.", "1e-9 in η",
        _critical_wedge,
    ),
    Statement(
        "S2", "2", "The conventional brake is stable for η > −1, whatever the friction"
        " coefficient.",
        "Critical slope at three friction coefficients.", "1e-9 in η", _critical_conventional,
    ),
    Statement(
        "S3", "2b", "Small μ_k or large α_w widens the wedge's stable range; for practical wedges"
        " it is smaller than the conventional brake's.",
        "Critical slopes ordered over μ_k and over α_w; practical means up to 0.2 rad above"
        " arctan μ_k.", "order of the values", _stable_area,
    ),
    Statement(
        "S4", "3", "In each direction oscillation ends at two values of η, and there is one Hopf"
        " point.",
        "Eigenvalues at 2001 values of η; changes of oscillation and of sign counted.",
        "count; |h| = ω_n to 1 %", _collapses,
    ),
    Statement(
        "S5", "3a", "For θ' > 0 eigenvalues move more slowly with η the larger α is; the"
        " conventional brake's move most slowly.",
        "Slope of σ over η at η = 0.", "order of the values", _forward_rates,
    ),
    Statement(
        "S6", "3b", "For θ' < 0 eigenvalues move much more slowly than for θ' > 0; at α = 3.43"
        " more slowly than the conventional brake's.",
        "Slope of σ over η at η = 0.", f"much slower: {_MUCH:g} times", _backward_rates,
    ),
)  # fmt: skip
