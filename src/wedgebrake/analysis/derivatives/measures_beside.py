"""Derivatives of measures on one side of the value of a parameter, from runs beside it.

The two sides may differ where events coincide, where a force is at one of its limits, and where a
contact is at rest at the start and a parameter changes its sliding speed. The derivative of a
measure on one side is then the limit of its derivatives in runs on this side.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from wedgebrake.analysis.derivatives.coincidences import distance_beside, near_task
from wedgebrake.analysis.derivatives.measures import MEASURES, Found
from wedgebrake.analysis.derivatives.varied_motion import VariedMotion, run_motion, varied_motion
from wedgebrake.arrays import FloatArray
from wedgebrake.errors import InputError
from wedgebrake.solvers.machine.tangents import TangentTask

# Relative differences up to which numbers are the same: derivatives in the two runs beside,
# derivatives on the two sides, and a measure and its limit.
_STEADY, _AGREE, _CONTINUOUS = 1e-3, 1e-5, 1e-9
# Distance of the runs, relative to that for derivatives of the motion: measures are integrals over
# intervals between events, and rates at the ends of very short ones are inaccurate.
_FURTHER = 64.0


def measures_beside(
    varied: VariedMotion, task: TangentTask, found: Mapping[str, Found], side: float
) -> VariedMotion:
    """Set derivatives of measures to those on one side, where the two sides may differ.

    found : the measures of ``varied`` by name; their derivatives are changed in place
    side  : the side that is used if the derivatives on the two sides differ

    Returns the motion, with the sides on which these derivatives hold.
    """
    sides = varied.sides
    one_sided, alone = sides.one_sided.copy(), sides.alone.copy()
    for number in np.flatnonzero(sides.may_differ):
        wanted = [one for one in (side, -side) if one_sided[number] in (0.0, side, one)]
        tried = [(one, _limits(varied, task, int(number), one, found)) for one in wanted]
        known = [(one, limit) for one, limit in tried if limit is not None]
        if not known:
            continue
        (first, limit), *others = known
        own = {name: by[:, number] for name, (_, by) in found.items()}
        alone[number] |= not others and len(wanted) > 1
        if others:
            one_sided[number] = 0.0 if _same(limit, others[0][1]) else first
        elif not _same(limit, own):
            one_sided[number] = first
        for name, by in own.items():
            by[:] = limit[name]
    sides = sides._replace(one_sided=one_sided, alone=alone)
    return replace(varied, sides=sides._replace(note=sides.explain(sides)))


def _same(one: Mapping[str, FloatArray], other: Mapping[str, FloatArray]) -> bool:
    """Return True if two sets of derivatives by name differ by rounding only."""
    return all(
        np.allclose(
            by, other[name], _AGREE, _AGREE * np.abs(by[np.isfinite(by)]).max(initial=0.0),
            equal_nan=True,
        )
        for name, by in one.items()
    )  # fmt: skip


def _limits(
    varied: VariedMotion, task: TangentTask, number: int, side: float, found: Mapping[str, Found]
) -> dict[str, FloatArray] | None:
    """Derivatives of measures (parts,) on one side; None if there are no such values."""
    distance = _FURTHER * distance_beside(varied.task.parameters[number])
    runs = []
    for count in (1.0, 2.0):
        try:
            near = near_task(task, number, side * count * distance)
        except InputError:
            return None
        try:
            beside = varied_motion(near, run_motion(near), side=side)
        except RuntimeError:  # the run beside does not reach the end
            return {name: np.full(values.shape, np.nan) for name, (values, _) in found.items()}
        runs.append({name: MEASURES[name].of(beside) for name in found})
    limits = {}
    for name, (values, _) in found.items():
        (near_value, one), (far_value, other) = (run[name] for run in runs)
        change, further = one[:, 0], other[:, 0]
        size = np.maximum(np.abs(change), np.abs(further))
        rounding = _AGREE * (np.abs(values) + size.max(initial=0.0))
        steady = np.abs(change - further) <= _STEADY * size + rounding
        # A derivative that is proportional to the distance from the value has the limit 0 there.
        limit = 2.0 * change - further
        limit[~steady & (np.abs(limit) <= _STEADY * size)] = 0.0
        steady |= limit == 0.0
        jump = np.abs(2.0 * near_value - far_value - values)
        moved = distance * (np.abs(change) + np.abs(further))
        continuous = jump <= _CONTINUOUS * (np.abs(values).max(initial=0.0)) + _STEADY * moved
        limits[name] = np.where(steady & continuous, limit, np.nan)
    return limits
