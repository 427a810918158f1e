"""The onset of permanent sticking, in closed form.

Towards it the slips that are left become short together. What they add up to in angle falls
like the cube of their durations and is lost in rounding, before they vanish; but where they do
is known: the brake holds at rest just the whole swing of the torque, upper - lower = 2 T_e.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.optimize import brentq

from wedgebrake.continuation.bifurcation_detection import Solution
from wedgebrake.continuation.curves import OrbitCurve
from wedgebrake.continuation.equations import FloatArray
from wedgebrake.continuation.segment_bvp import Chain
from wedgebrake.errors import InputError

# Slips shorter than this [rad] are on the way to it, and no further than this (scaled).
_SHORT, _REACH = 0.05, 1e-3
_PIECES = (0, 1, 0, -1)


def onset(curve: OrbitCurve, at: Solution) -> tuple[FloatArray, float] | None:
    """(unknowns, parameter) where the slips of an orbit vanish; None if it is not near there."""
    chain = curve.equations
    unknowns, values = curve.unscaled(at.y)
    if not isinstance(chain, Chain) or len(values) != 1:
        return None
    codes = np.array(chain.every)
    durations = chain.margins(unknowns, curve.family.problem(values))[:, 0]
    slips = codes[: durations.size] != 0
    turns = [turn for turn in range(codes.size) if tuple(np.roll(codes, turn)) == _PIECES]
    if not turns or np.any(durations[slips] > _SHORT):
        return None
    reach = math.copysign(_REACH * curve.scales[-1], at.direction[-1])
    try:
        ends = values[0], values[0] + reach
        if _spare(curve, ends[0]) * _spare(curve, ends[1]) >= 0.0:
            return None
        value = float(brentq(lambda one: _spare(curve, one), *ends, xtol=1e-300, rtol=1e-15))
    except InputError:
        return None
    problem = curve.family.problem((value,))
    # Forwards at the torque's crest, backwards at its trough; the angle is that of both.
    angle = (problem[3] - problem[10]) / problem[2]
    crest = {1: 0.5 * math.pi, -1: 1.5 * math.pi}
    phases = _phases(chain, unknowns, crest)
    return np.column_stack((phases, np.full(phases.size, angle))).ravel(), value


def _spare(curve: OrbitCurve, value: float) -> float:
    """What the brake holds beyond the swing of the torque [N m]."""
    problem = curve.family.problem((value,))
    return float(problem[10] - problem[9] - 2.0 * problem[3])


def _phases(chain: Chain, unknowns: FloatArray, crest: dict[int, float]) -> FloatArray:
    """The phase of each node, where the slip beside it has its crest, in the same turn."""
    count = len(chain.codes)
    phases = np.empty(count)
    for node in range(count):
        code = chain.every[node] or chain.every[node - 1]
        near = unknowns[2 * node] - crest[code]
        phases[node] = crest[code] + 2.0 * math.pi * round(near / (2.0 * math.pi))
    return phases
