"""Linear stability: statements S1 to S6 (section 3, figures 2 and 3)."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from wedgebrake.analysis.linear_stability import DirectionStability, stability
from wedgebrake.model.friction import CoulombFriction
from wedgebrake.model.paper_machines import CONVENTIONAL, KINETIC, STIFFNESS, WEDGE, Case
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.paper.claims import Assertion
from wedgebrake.paper.laboratory import Laboratory

_ALPHAS = (1.03, 1.21, 3.43)
_DIGITS = 1e-9
# "Much slower" is at least this many times.
_MUCH = 1.5
_SIDES = {"forward": "θ' > 0", "backward": "θ' < 0"}


def _system(laboratory: Laboratory, case: Case) -> BrakedDriveline:
    """The system of a case with constant friction, as section 3 of the paper takes it."""
    system = laboratory.system(case)
    return system.replace(friction=CoulombFriction(kinetic=system.friction.reference))


def _one(laboratory: Laboratory, case: Case, side: str, **changed: float) -> DirectionStability:
    found: DirectionStability = getattr(
        stability(_system(laboratory, case).replace(**changed)), side
    )
    return found


def _value(number: float | None) -> float:
    return math.nan if number is None else number


def _hopf(laboratory: Laboratory, case: Case, side: str, **changed: float) -> float:
    return _value(_one(laboratory, case, side, **changed).hopf_eta)


def _list(values: list[float], spec: str = ".3f") -> str:
    return ", ".join(f"{value:{spec}}" for value in values)


def _critical_wedge(laboratory: Laboratory, _: dict[str, Any]) -> Iterator[Assertion]:
    for side, sign, formula in (("forward", 1.0, "μ_k"), ("backward", -1.0, "−μ_k")):
        found = [_hopf(laboratory, Case(alpha=alpha), side) for alpha in _ALPHAS]
        wanted = [sign * KINETIC - alpha * KINETIC for alpha in _ALPHAS]
        worst = float(np.max(np.abs(np.subtract(found, wanted))))
        numbers = [f"{eta:.4g} at α = {alpha:g}" for eta, alpha in zip(found, _ALPHAS, strict=True)]
        says = f"critical η for {_SIDES[side]}: {formula} − tan α_w"
        yield Assertion(says, worst < _DIGITS, ", ".join(numbers))
    flips = []
    for alpha in _ALPHAS:
        limit = KINETIC - alpha * KINETIC
        verdicts = [
            stability(_system(laboratory, Case(eta=limit + step, alpha=alpha))).stable
            for step in (-1e-6, 1e-6)
        ]
        flips.append(verdicts == [False, True])
    yield Assertion(
        "stable in both directions exactly above μ_k − tan α_w",
        all(flips),
        f"the verdict changes within ±1e-6 of it at {sum(flips)} of {len(flips)} angles",
    )


def _critical_conventional(laboratory: Laboratory, _: dict[str, Any]) -> Iterator[Assertion]:
    case = Case(brake=CONVENTIONAL)
    found = [
        _hopf(laboratory, case, side, kinetic=kinetic, static=kinetic)
        for kinetic in (0.05, 0.3, 0.9)
        for side in _SIDES
    ]
    spread = float(np.max(np.abs(np.array(found) + 1.0)))
    words = f"within {spread:.1e} of −1 at μ_k = 0.05, 0.3 and 0.9, both directions"
    yield Assertion("critical η = −1, whatever μ_k", spread < _DIGITS, words)


def _critical(laboratory: Laboratory, kinetic: float, tangent: float) -> float:
    """Critical eta of a wedge, the larger of both directions."""
    case = Case(alpha=tangent / KINETIC)
    # Changing mu_k keeps the wedge's angle.
    return max(_hopf(laboratory, case, side, kinetic=kinetic, static=kinetic) for side in _SIDES)


def _stable_area(laboratory: Laboratory, _: dict[str, Any]) -> Iterator[Assertion]:
    by_friction = [_critical(laboratory, kinetic, 0.4) for kinetic in (0.1, 0.2, 0.3)]
    by_angle = [_critical(laboratory, 0.3, math.tan(angle)) for angle in (0.32, 0.6, 1.0)]
    # Practical: the angle a little above arctan(mu_k), by up to a fifth of a radian.
    practical = [
        _critical(laboratory, kinetic, math.tan(math.atan(kinetic) + more))
        for kinetic in (0.1, 0.3, 0.5)
        for more in (0.01, 0.1, 0.2)
    ]
    yield Assertion(
        "smaller μ_k widens the wedge's stable range",
        by_friction == sorted(by_friction),
        f"critical η = {_list(by_friction)} at μ_k = 0.1, 0.2, 0.3 (tan α_w = 0.4)",
    )
    yield Assertion(
        "larger α_w widens it",
        by_angle == sorted(by_angle, reverse=True),
        f"critical η = {_list(by_angle)} at α_w = 0.32, 0.6, 1.0 rad (μ_k = 0.3)",
    )
    yield Assertion(
        "for angles close to arctan μ_k it is smaller than the conventional brake's",
        min(practical) > -1.0,
        f"critical η between {min(practical):.3f} and {max(practical):.3f} for angles up to"
        " 0.2 rad above arctan μ_k; −1 for the conventional brake",
    )


def _ends_of_oscillation(laboratory: Laboratory, _: dict[str, Any]) -> Iterator[Assertion]:
    natural = math.sqrt(STIFFNESS)
    for brake, words in ((WEDGE, "wedge"), (CONVENTIONAL, "conventional brake")):
        system = _system(laboratory, Case(brake=brake))
        for side, sign in _SIDES.items():
            points: DirectionStability = getattr(stability(system), side)
            reach = 1.5 * abs(_value(points.node_focus_unstable_eta))
            etas = np.linspace(-reach, reach, 2001)
            along = [getattr(stability(system.replace(eta=float(eta))), side) for eta in etas]
            oscillates = np.array([bool(one.oscillates) for one in along])
            growth = np.array([_value(one.growth_rate) for one in along])
            changes = np.flatnonzero(np.diff(oscillates.astype(int)))
            rates = sorted(abs(0.5 * (growth[i] + growth[i + 1])) / natural for i in changes)
            crossings = int(np.count_nonzero(growth[:-1] * growth[1:] < 0.0))
            where = [0.5 * (etas[i] + etas[i + 1]) for i in changes]
            yield Assertion(
                f"{words}, {sign}: oscillation ends at two points, h = ±ω_n; one Hopf point",
                len(changes) == 2 and crossings == 1 and all(abs(n - 1.0) < 0.01 for n in rates),
                f"ends near η = {_list(where, '.4g')} with |h|/ω_n = {_list(rates)}; {crossings}"
                f" change of sign of h at η = {_value(points.hopf_eta):.4g}",
            )


def _rates(laboratory: Laboratory, side: str) -> tuple[list[float], float]:
    """Rate at which sigma falls with eta [1/s] at eta = 0: wedges by angle, conventional brake."""

    def rate(case: Case) -> float:
        cases = (case.at(eta=0.0), case.at(eta=1e-3))
        one, two = (_value(_one(laboratory, at, side).growth_rate) for at in cases)
        return (one - two) / 1e-3

    return [rate(Case(alpha=alpha)) for alpha in _ALPHAS], rate(Case(brake=CONVENTIONAL))


def _forward_rates(laboratory: Laboratory, _: dict[str, Any]) -> Iterator[Assertion]:
    wedges, other = _rates(laboratory, "forward")
    yield Assertion(
        "θ' > 0: the larger α, the slower the evolution",
        wedges == sorted(wedges, reverse=True),
        f"−dσ/dη = {_list(wedges, '.4g')} 1/s at α = 1.03, 1.21, 3.43",
    )
    says = "the conventional brake is slower than every wedge"
    yield Assertion(says, other < min(wedges), f"−dσ/dη = {other:.4g} 1/s")


def _backward_rates(laboratory: Laboratory, _: dict[str, Any]) -> Iterator[Assertion]:
    forth, _conventional = _rates(laboratory, "forward")
    back, other = _rates(laboratory, "backward")
    ratios = [f / b for f, b in zip(forth, back, strict=True)]
    yield Assertion(
        "θ' < 0: evolution much slower than for θ' > 0",
        min(ratios) >= _MUCH,
        f"forward over backward rate = {_list(ratios, '.3g')} at α = 1.03, 1.21, 3.43",
    )
    says = "at α = 3.43 slower than the conventional brake"
    yield Assertion(says, back[-1] < other, f"{back[-1]:.4g} against {other:.4g} 1/s")


CHECKS = {
    "S1": _critical_wedge,
    "S2": _critical_conventional,
    "S3": _stable_area,
    "S4": _ends_of_oscillation,
    "S5": _forward_rates,
    "S6": _backward_rates,
}
