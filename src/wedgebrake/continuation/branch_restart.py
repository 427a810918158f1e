"""From the end of one chain of pieces to the begin of the next."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from wedgebrake.continuation.bifurcation_detection import Solution
from wedgebrake.continuation.bifurcation_types import Kind, Scenario
from wedgebrake.continuation.curves import OrbitCurve
from wedgebrake.continuation.discontinuity_induced import Margin, Transition, transition, violated
from wedgebrake.continuation.equations import FloatArray, NoOrbitError
from wedgebrake.continuation.palc import NotConvergedError, newton, tangent
from wedgebrake.continuation.segment_bvp import Chain, goes_through

ALL_SLIP_ENDS = "all slip ends, permanent sticking begins"
PERMANENT = "permanent sticking: every angle that the brake holds is an equilibrium"
# Lengths [rad] of what is put in, in the order in which they are tried.
_LENGTHS = (1e-3, 1e-4, 1e-2, 1e-5, 1e-6, 1e-7)
# First steps beyond, as shares of the longest.
_STEPS = (1e-3, 1e-4, 1e-2)


@dataclass(frozen=True, eq=False)
class Beyond:
    """What lies beyond a bifurcation of friction.

    equations, curve, solution : where the branch goes on, None where it does not
    why : then the reason
    """

    kind: Kind
    effect: str
    scenario: Scenario
    equations: Chain | None = None
    curve: OrbitCurve | None = None
    solution: Solution | None = None
    why: str = ""


def go_beyond(
    curve: OrbitCurve, chain: Chain, came: float, at: Solution, ends: list[Margin], largest: float
) -> Beyond | None:
    """What lies beyond a point where some margins vanish; None where nothing was found.

    came : change of the scaled parameter on the way to it. The direction there does not tell:
           on the side of a short piece it stands square to the parameter.
    """
    unknowns, values = curve.unscaled(at.y)
    problem = curve.family.problem(values)
    found = transition(chain, unknowns, problem, ends)
    if found is None:
        return None
    effect = _effect(chain.codes, tuple(node.code for node in found.nodes), found)
    if found.jump:
        why = f"{found.kind.value}, beyond which the motion jumps"
        return Beyond(found.kind, effect, Scenario.JUMP, why=why)
    if not found.nodes:
        return Beyond(found.kind, effect, Scenario.NONE, why=PERMANENT)
    new = Chain(tuple(node.code for node in found.nodes), chain.order, half=chain.half)
    started = _grown(curve, new, found, values) if found.grown else None
    if not found.grown:
        started = _joined(curve, new, found, values, largest)
    if started is None:
        return None
    there, solution = started
    on = came * (solution.y[-1] - at.y[-1]) > 0.0
    scenario = Scenario.PERSISTENCE if on else Scenario.FOLD
    return Beyond(found.kind, effect, scenario, new, there, solution)


def _unknowns(found: Transition) -> FloatArray:
    return np.array([[node.first, node.angle] for node in found.nodes]).ravel()


def _grown(
    curve: OrbitCurve, chain: Chain, found: Transition, values: tuple[float, ...]
) -> tuple[OrbitCurve, Solution] | None:
    """An orbit on which the pieces put in last a little."""
    for length in _LENGTHS:
        unknowns = _unknowns(found)
        size = unknowns.size
        normal = np.zeros(size + len(values))
        for piece, share in zip(found.grown, found.shares, strict=True):
            begin, end = 2 * piece, 2 * (piece + 1) % size
            unknowns[begin] -= share * length
            unknowns[end] += (1.0 - share) * length
            normal[begin] -= 1.0
            normal[end] += 1.0
        there = OrbitCurve.through(chain, curve.family, unknowns, values)
        normal = normal * there.scales
        normal /= np.linalg.norm(normal)
        try:
            y, matrix = newton(there, there.scaled(unknowns, values), normal)
            solution = Solution(y, matrix, tangent(matrix, normal))
        except (NotConvergedError, NoOrbitError):
            continue
        if _is_orbit(there, chain, solution):
            return there, solution
    return None


def _joined(
    curve: OrbitCurve,
    chain: Chain,
    found: Transition,
    values: tuple[float, ...],
    largest: float,
) -> tuple[OrbitCurve, Solution] | None:
    """An orbit a little further on the side on which the shorter chain is one."""
    unknowns = _unknowns(found)
    there = OrbitCurve.through(chain, curve.family, unknowns, values)
    along = np.zeros(unknowns.size + len(values))
    along[-1] = 1.0
    try:
        y, matrix = newton(there, there.scaled(unknowns, values), along)
        direction = tangent(matrix, along)
    except (NotConvergedError, NoOrbitError):
        return None
    for step in _STEPS:
        for side in (1.0, -1.0):
            try:
                further, matrix = newton(there, y + side * step * largest * direction, direction)
                solution = Solution(further, matrix, tangent(matrix, side * direction))
            except (NotConvergedError, NoOrbitError):
                continue
            if _is_orbit(there, chain, solution):
                return there, solution
    return None


def _is_orbit(curve: OrbitCurve, chain: Chain, solution: Solution) -> bool:
    if violated(curve.margins(solution.y)):
        return False
    unknowns, values = curve.unscaled(solution.y)
    return goes_through(chain, unknowns, curve.family.problem(values))


def _effect(before: tuple[int, ...], after: tuple[int, ...], found: Transition) -> str:
    """What of the motion begins or ends, in words."""
    if found.jump:
        return ""
    if not after:
        return ALL_SLIP_ENDS
    words = []
    for word, test in (
        ("slip forwards", lambda code: code > 0),
        ("slip backwards", lambda code: code < 0),
        ("sticking", lambda code: code == 0),
        ("crossing of a breakpoint (release)", lambda code: abs(code) > 1),
    ):
        had, has = any(map(test, before)), any(map(test, after))
        if had != has:
            words.append(f"{word} {'begins' if has else 'ends'}")
    return ", ".join(words)
