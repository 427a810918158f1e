"""The bifurcation diagrams: statements B1 to B7 (figures 8, 11, 14 and 17)."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from itertools import pairwise
from typing import Any

import numpy as np

from wedgebrake.model.paper_machines import DURATION
from wedgebrake.paper.claims import Assertion, Check
from wedgebrake.paper.diagrams import (
    PLANS,
    Diagram,
    DiagramPlan,
    Kinds,
    diagram,
    fit,
    paper_diagram,
)
from wedgebrake.paper.laboratory import STEADY, Laboratory, run, section_times
from wedgebrake.paper.visual_criteria import (
    DOUBLE,
    FILLED,
    MULTIPLE,
    NOTHING,
    SYNCHRONOUS,
    appearance,
)

MOST = 2.0 / 3.0
"""The kind stated for a segment must be seen in at least this share of its columns."""
# Limits are bisected down to this share of the resolution of the printed diagram.
_RESOLVED = 0.02
# Columns near eta = -30.
_NEAR, _NEAR_COARSE = 49, 13

_IRREGULAR = (MULTIPLE, FILLED)
_NOT_SYNCHRONOUS = (DOUBLE, MULTIPLE, FILLED)
_WORDS: dict[Kinds, str] = {
    (SYNCHRONOUS,): "synchronous",
    (DOUBLE,): "2T-periodic",
    (MULTIPLE,): "multi-periodic",
    (FILLED,): "quasi-periodic",
    _IRREGULAR: "multi- or quasi-periodic",
    _NOT_SYNCHRONOUS: "not synchronous",
}
_SYMBOLS = {"eta": "η", "F0": "F_0", "f": "f", "alpha": "α"}


def _kinds(laboratory: Laboratory, shown: Diagram) -> list[str]:
    return [one.kind for one in shown.appearances(laboratory.thresholds.dot)]


def _limits(
    laboratory: Laboratory, plan: DiagramPlan, shown: Diagram, *segments: Kinds
) -> Iterator[Assertion]:
    """One part per limit, and one per segment, of the kind of motion between the limits."""
    if all(column.velocity.size == 0 for column in shown.columns):
        yield Assertion("there is a steady motion", False, "every run ends before 25 s")
        return
    found = fit(laboratory, shown, segments, _RESOLVED * plan.resolution, plan.lattice)
    for value, limit, (below, above), (left, right) in zip(
        plan.limits, found.limits, found.brackets, pairwise(segments), strict=True
    ):
        says = f"{_WORDS[left]} to {_WORDS[right]} at {_SYMBOLS[plan.name]} = {value:g}"
        if not plan.low < limit < plan.high:
            yield Assertion(says, False, "no such limit in the range")
            continue
        off = abs(limit - value)
        yield Assertion(
            says,
            off <= plan.resolution,
            f"found at {limit:.5g} (between {below:.5g} and {above:.5g}),"
            f" {100.0 * off / (plan.high - plan.low):.1f} % of the axis away",
        )
    ends = pairwise([plan.low, *plan.limits, plan.high])
    for segment, agreement, (low, high) in zip(segments, found.agreement, ends, strict=True):
        yield Assertion(
            f"{_WORDS[segment]} from {low:g} to {high:g}",
            agreement >= MOST,
            f"seen in {100.0 * agreement:.0f} % of the columns between the limits found",
        )


def _slope_wedge(laboratory: Laboratory, _: dict[str, Any]) -> Iterator[Assertion]:
    plan = PLANS["8a"]
    shown = paper_diagram(laboratory, plan)
    yield from _limits(laboratory, plan, shown, (DOUBLE,), _IRREGULAR, (SYNCHRONOUS,))
    # The quasi-periodic window is narrower than a column of the paper.
    count = _NEAR_COARSE if laboratory.coarse else _NEAR
    near = np.linspace(-30.0 - plan.resolution, -30.0 + plan.resolution, count)
    columns = diagram(laboratory, plan.base, "eta", near).columns
    filled = [
        f"{eta:.4g}"
        for eta, column in zip(near, columns, strict=True)
        if appearance(column.velocity, shown.axis, laboratory.thresholds.dot).kind == FILLED
    ]
    yield Assertion(
        "a quasi-periodic column within a column of η = −30",
        bool(filled),
        f"columns within {plan.resolution:g} of it that look filled, of {count}:"
        f" {', '.join(filled) or 'none'}",
    )


def _force_wedge(laboratory: Laboratory, _: dict[str, Any]) -> Iterator[Assertion]:
    plan = PLANS["11a"]
    segments = ((FILLED,), (MULTIPLE,), (FILLED,), (MULTIPLE,), (DOUBLE,), (SYNCHRONOUS,))
    yield from _limits(laboratory, plan, paper_diagram(laboratory, plan), *segments)


def _conventional(name: str, laboratory: Laboratory, _: dict[str, Any]) -> Iterator[Assertion]:
    """Two segments; close to the limit a torus is too thin to look filled."""
    plan = PLANS[name]
    shown, limit = paper_diagram(laboratory, plan), plan.limits[0]
    yield from _limits(laboratory, plan, shown, _NOT_SYNCHRONOUS, (SYNCHRONOUS,))
    kinds = zip(shown.values, _kinds(laboratory, shown), strict=True)
    seen = [kind for value, kind in kinds if value <= limit]
    share = seen.count(FILLED) / len(seen)
    found = f"{100.0 * share:.0f} % of the columns up to there look filled"
    yield Assertion(f"quasi-periodic up to {limit:g}", share >= MOST, found)


def _frequency(name: str, laboratory: Laboratory, values: dict[str, Any]) -> Iterator[Assertion]:
    """The diagram over f, at whole hertz as the printed frequencies are."""
    plan = replace(PLANS[name], base=PLANS[name].base.at(F0=values["F0"]))
    shown = diagram(laboratory, plan.base, plan.name, plan.columns())
    yield from _limits(laboratory, plan, shown, (SYNCHRONOUS,), _NOT_SYNCHRONOUS, (SYNCHRONOUS,))
    yield _resonance(laboratory, plan, shown, whole=values["whole"])
    signs = [
        bool(np.mean(np.sign(column.velocity)) * (1.0 - value) > 0.0)
        for value, column in zip(shown.values, shown.columns, strict=True)
        if column.velocity.size
    ]
    yield Assertion(
        "x_2(nT) is positive for f < 1 and negative for f > 1",
        bool(signs) and all(signs),
        f"so are most points in {sum(signs)} of {len(signs)} columns",
    )


def _resonance(
    laboratory: Laboratory, plan: DiagramPlan, shown: Diagram, *, whole: bool
) -> Assertion:
    """At f = 1 exactly, where 20 s are no whole number of periods; ``whole``: at those."""
    system = laboratory.system(plan.base.at(f=1.0))
    frequency = system.excitation.frequency
    times, where = section_times(frequency), "20 s + n/f_e"
    if whole:
        first, last = math.ceil(STEADY * frequency), math.floor(DURATION * frequency)
        times = np.arange(first, last + 1) / frequency
        where = "whole periods, where the velocity of a resonance passes zero"
    response = run(system, laboratory.method, times)
    if response.attrs["status"] != "completed":
        found = f"cannot be told: the run ends at {response.attrs['final_time']:.3g} s"
        return Assertion("synchronous at f = 1", False, found)
    seen = appearance(response["velocity"].to_numpy(), shown.axis, laboratory.thresholds.dot)
    return Assertion(
        "synchronous at f = 1",
        seen.kind == SYNCHRONOUS,
        f"{seen.kind}: at {where}, the points of the last 5 s spread over {seen.height:.3g} rad/s"
        " (the resonance still grows)",
    )


def _angle(laboratory: Laboratory, values: dict[str, Any]) -> Iterator[Assertion]:
    """Over the wedge angle, at the paper's own columns; the limit between two of them."""
    plan = PLANS["17"]
    columns = plan.columns()
    runs = diagram(laboratory, plan.base, "alpha", columns[3:]).columns
    ended = sum(not one.completed for one in runs)
    if ended:  # and the self-locking wedges, slow to compute, are not needed
        yield Assertion(
            "the runs last 25 s", False, f"{ended} of {len(runs)} from α = 1.41 on do not"
        )
        return
    shown = diagram(laboratory, plan.base, "alpha", columns)
    seen = _kinds(laboratory, shown)
    segments = ((SYNCHRONOUS,), _NOT_SYNCHRONOUS)
    limit = float(fit(laboratory, shown, segments, _RESOLVED * plan.resolution).limits[0])
    low, high = float(columns[2]), float(columns[3])
    yield Assertion(
        "synchronous at α_w = 0.1, 0.2 and 0.3 rad",
        all(kind == SYNCHRONOUS for kind in seen[:3]),
        ", ".join(seen[:3]),
    )
    yield Assertion(
        "not synchronous at α_w = 0.4, 0.5, ... 1.2 rad",
        all(kind not in (SYNCHRONOUS, NOTHING) for kind in seen[3:]),
        ", ".join(seen[3:]),
    )
    near = abs(limit - plan.limits[0]) <= plan.resolution
    yield Assertion(
        "the limit is 1.41",
        low < limit <= high if values["columns"] else near,
        f"found at α = {limit:.4g}, between the columns {low:.4g} and {high:.4g}",
    )


CHECKS: dict[str, Check] = {
    "B1": _slope_wedge,
    "B2": partial(_conventional, "8b"),
    "B3": _force_wedge,
    "B4": partial(_conventional, "11b"),
    "B5": partial(_frequency, "14a"),
    "B6": partial(_frequency, "14b"),
    "B7": _angle,
}
