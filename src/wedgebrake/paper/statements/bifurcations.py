"""The bifurcation diagrams: statements B1 to B7 (figures 8, 11, 14 and 17)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from itertools import pairwise
from typing import Any

import numpy as np

from wedgebrake.paper.claims import Part, Statement
from wedgebrake.paper.diagrams import (
    FORCE_WHY,
    PLANS,
    PRINTED_F0,
    Diagram,
    Fit,
    Plan,
    Segment,
    diagram,
    fit,
    paper_diagram,
)
from wedgebrake.paper.laboratory import DURATION, STEADY, Laboratory, run, section_times
from wedgebrake.paper.visual_criteria import (
    DOUBLE,
    EYE,
    FILLED,
    MULTIPLE,
    NOTHING,
    SYNCHRONOUS,
    look,
)

# What is said of a segment must be seen in at least this share of its columns.
_MOST = 2.0 / 3.0
_RESOLVED = 0.02
_NEAR, _NEAR_COARSE = 49, 13

_SYNCHRONOUS = Segment((SYNCHRONOUS,))
_DOUBLE = Segment((DOUBLE,))
_MULTIPLE = Segment((MULTIPLE,))
_FILLED = Segment((FILLED,))
_IRREGULAR = Segment((MULTIPLE, FILLED))
_NOT_SYNCHRONOUS = Segment((DOUBLE, MULTIPLE, FILLED))
_SAY = {
    _SYNCHRONOUS: "synchronous",
    _DOUBLE: "2T-periodic",
    _MULTIPLE: "multi-periodic",
    _FILLED: "quasi-periodic",
    _IRREGULAR: "multi- or quasi-periodic",
    _NOT_SYNCHRONOUS: "not synchronous",
}
_SYMBOLS = {"eta": "η", "F0": "F_0", "f": "f", "alpha": "α"}


def _limits(plan: Plan, shown: Diagram, found: Fit, segments: Sequence[Segment]) -> list[Part]:
    """One part per limit, and one per segment."""
    if all(column.velocity.size == 0 for column in shown.columns):
        return [Part("there is a steady motion", False, "every run ends before 25 s")]
    symbol, parts = _SYMBOLS[plan.name], []
    for value, limit, bracket, (left, right) in zip(
        plan.limits, found.limits, found.brackets, pairwise(segments), strict=True
    ):
        if not plan.low < limit < plan.high:
            parts.append(
                Part(
                    f"{_SAY[left]} to {_SAY[right]} at {symbol} = {value:g}", False,
                    "no such limit in the range",
                )
            )  # fmt: skip
            continue
        off = limit - value
        share = 100.0 * abs(off) / (plan.high - plan.low)
        parts.append(
            Part(
                f"{_SAY[left]} to {_SAY[right]} at {symbol} = {value:g}",
                abs(off) <= plan.resolution,
                f"found at {limit:.5g} (between {bracket[0]:.5g} and {bracket[1]:.5g}),"
                f" {share:.1f} % of the axis away",
            )
        )
    ends = [plan.low, *plan.limits, plan.high]
    for segment, agreement, (low, high) in zip(
        segments, found.agreement, pairwise(ends), strict=True
    ):
        parts.append(
            Part(
                f"{_SAY[segment]} from {low:g} to {high:g}",
                bool(agreement >= _MOST),
                f"seen in {100.0 * agreement:.0f} % of the columns between the limits found",
            )
        )
    return parts


def _segments(
    laboratory: Laboratory,
    _: dict[str, Any],
    *,
    plan: Plan,
    segments: Sequence[Segment],
) -> list[Part]:
    shown = paper_diagram(laboratory, plan)
    resolution = _RESOLVED * plan.resolution
    found = fit(laboratory, shown, segments, resolution, plan.lattice)
    return _limits(plan, shown, found, segments)


def _slope_wedge(laboratory: Laboratory, values: dict[str, Any]) -> list[Part]:
    plan, segments = PLANS["8a"], (_DOUBLE, _IRREGULAR, _SYNCHRONOUS)
    parts = _segments(laboratory, values, plan=plan, segments=segments)
    # The window is narrower than a column of the paper.
    count = _NEAR_COARSE if laboratory.coarse else _NEAR
    near = np.linspace(-30.0 - plan.resolution, -30.0 + plan.resolution, count)
    axis = paper_diagram(laboratory, plan).axis
    sights = [
        look(steady.velocity, axis, laboratory.eye.dot)
        for steady in laboratory.steadies([plan.base.at(eta=float(eta)) for eta in near])
    ]
    filled = [eta for eta, sight in zip(near, sights, strict=True) if sight.word == FILLED]
    found = ", ".join(f"{eta:.4g}" for eta in filled) or "none"
    parts.append(
        Part(
            "a quasi-periodic column within a column of η = −30",
            bool(filled),
            f"columns within {plan.resolution:g} of it that look filled, of {count}: {found}",
        )
    )
    return parts


def _slope_conventional(laboratory: Laboratory, values: dict[str, Any]) -> list[Part]:
    return _conventional(laboratory, values, plan=PLANS["8b"])


def _conventional(laboratory: Laboratory, values: dict[str, Any], *, plan: Plan) -> list[Part]:
    """Two segments; close to the limit a torus is too thin to look filled."""
    segments = (_NOT_SYNCHRONOUS, _SYNCHRONOUS)
    parts = _segments(laboratory, values, plan=plan, segments=segments)
    shown = paper_diagram(laboratory, plan)
    seen = [
        sight.word
        for value, sight in zip(shown.values, shown.sights(laboratory.eye.dot), strict=True)
        if value <= plan.limits[0]
    ]
    share = seen.count(FILLED) / len(seen)
    parts.append(
        Part(
            f"quasi-periodic up to {plan.limits[0]:g}",
            share >= _MOST,
            f"{100.0 * share:.0f} % of the columns up to there look filled",
        )
    )
    return parts


def _frequency(laboratory: Laboratory, values: dict[str, Any], *, plan: Plan) -> list[Part]:
    """The diagram over f, in whole hertz as the printed frequencies are."""
    plan = replace(plan, base=plan.base.at(F0=values["F0"]))
    segments = (_SYNCHRONOUS, _NOT_SYNCHRONOUS, _SYNCHRONOUS)
    shown = diagram(laboratory, plan.base, plan.name, list(plan.columns()))
    resolution = _RESOLVED * plan.resolution
    found = fit(laboratory, shown, segments, resolution, plan.lattice)
    parts = _limits(plan, shown, found, segments)
    parts.append(_resonance(laboratory, plan, shown, whole=values["whole"]))
    signs = [
        bool(np.mean(np.sign(column.velocity)) * (1.0 - value) > 0.0)
        for value, column in zip(shown.values, shown.columns, strict=True)
        if column.velocity.size
    ]
    parts.append(
        Part(
            "x_2(nT) is positive for f < 1 and negative for f > 1",
            bool(signs) and all(signs),
            f"so are most points in {sum(signs)} of {len(signs)} columns",
        )
    )
    return parts


def _resonance(laboratory: Laboratory, plan: Plan, shown: Diagram, *, whole: bool) -> Part:
    """At f = 1 exactly, where 20 s are no whole number of periods; ``whole``: at those."""
    system = laboratory.system(plan.base.at(f=1.0))
    frequency = system.excitation.frequency
    times = section_times(frequency)
    if whole:
        first, last = math.ceil(STEADY * frequency), math.floor(DURATION * frequency)
        times = np.arange(first, last + 1) / frequency
    response = run(system, laboratory.method, times)
    if response.attrs["status"] != "completed":
        found = f"not judged: the run ends at {response.attrs['final_time']:.3g} s"
        return Part("synchronous at f = 1", False, found)
    sight = look(response["velocity"].to_numpy(), shown.axis, laboratory.eye.dot)
    where = (
        "whole periods, where the velocity of a resonance passes zero" if whole else "20 s + n/f_e"
    )
    return Part(
        "synchronous at f = 1",
        sight.word == SYNCHRONOUS,
        f"{sight.word}: at {where}, the points of the last 5 s spread over {sight.height:.3g} rad/s"
        " (the resonance still grows)",
    )


def _angle(laboratory: Laboratory, values: dict[str, Any]) -> list[Part]:
    """Over the wedge angle, in the paper's own columns; the limit between two of them."""
    plan = PLANS["17"]
    columns = plan.columns()
    runs = laboratory.steadies([plan.base.at(alpha=float(alpha)) for alpha in columns[3:]])
    ended = sum(not one.completed for one in runs)
    if ended:  # the wall of a self-locking brake need not be climbed
        found = f"{ended} of {len(runs)} from α = 1.41 on do not"
        return [Part("the runs last 25 s", False, found)]
    shown = diagram(laboratory, plan.base, plan.name, list(columns))
    words = [sight.word for sight in shown.sights(laboratory.eye.dot)]
    limits = fit(
        laboratory, shown, (_SYNCHRONOUS, _NOT_SYNCHRONOUS), _RESOLVED * plan.resolution
    ).limits
    limit, low, high = float(limits[0]), float(columns[2]), float(columns[3])
    as_column = low < limit <= high
    nearby = abs(limit - plan.limits[0]) <= plan.resolution
    return [
        Part(
            "synchronous at α_w = 0.1, 0.2 and 0.3 rad",
            all(word == SYNCHRONOUS for word in words[:3]),
            ", ".join(words[:3]),
        ),
        Part(
            "not synchronous at α_w = 0.4, 0.5, ... 1.2 rad",
            all(word not in (SYNCHRONOUS, NOTHING) for word in words[3:]),
            ", ".join(words[3:]),
        ),
        Part(
            "the limit is 1.41",
            as_column if values["columns"] else nearby,
            f"found at α = {limit:.4g}, between the columns {low:.4g} and {high:.4g}",
        ),
    ]


_FIT = (
    "The segments laid over what is seen in 200 columns so that fewest contradict them; limits"
    " then bisected."
)


def _tolerance(plan: Plan) -> str:
    return (
        f"±{plan.resolution:.2g} for limits; {100 * _MOST:.0f} % of a segment's columns; a dot is"
        f" {100 * EYE.dot:g} % of the axis"
    )


_FORCE = (
    {"F0": PRINTED_F0, "whole": False},
    {"F0": PLANS["14a"].base.F0, "whole": True},
    f"{FORCE_WHY}; at f = 1 a section at whole periods, not at 20 s + n/f_e",
)
STATEMENTS = (
    Statement(
        "B1", "8a", "Wedge over η: 2T-periodic below −30, quasi-periodic at −30, multi-periodic"
        " to −18, synchronous above.", _FIT, _tolerance(PLANS["8a"]), _slope_wedge, apart=False,
    ),
    Statement(
        "B2", "8b", "Conventional brake over η: quasi-periodic up to −24, synchronous above.",
        _FIT, _tolerance(PLANS["8b"]), _slope_conventional, apart=False,
    ),
    Statement(
        "B3", "11a", "Wedge over F_0: quasi-periodic to 0.019, multi-periodic to 0.028,"
        " quasi-periodic to 0.034, small multi-periodic to 0.058, 2T-periodic to 0.072,"
        " synchronous to 0.120.", _FIT, _tolerance(PLANS["11a"]),
        partial(
            _segments, plan=PLANS["11a"],
            segments=(_FILLED, _MULTIPLE, _FILLED, _MULTIPLE, _DOUBLE, _SYNCHRONOUS),
        ), apart=False,
    ),
    Statement(
        "B4", "11b", "Conventional brake over F_0: quasi-periodic to 0.044, synchronous to 0.120.",
        _FIT, _tolerance(PLANS["11b"]), partial(_conventional, plan=PLANS["11b"]),
        apart=False,
    ),
    Statement(
        "B5", "14a", "Wedge over f: synchronous below 0.56, multi-periodic to 1.57 but synchronous"
        " at 1, synchronous to 3; x_2(nT) is positive below 1 and negative above.",
        "As figure 8, with columns at whole hertz.", _tolerance(PLANS["14a"]),
        partial(_frequency, plan=PLANS["14a"]), *_FORCE, apart=False,
    ),
    Statement(
        "B6", "14b", "Conventional brake over f: as the wedge, but multi-periodic from 0.69 on.",
        "As figure 8, with columns at whole hertz.", _tolerance(PLANS["14b"]),
        partial(_frequency, plan=PLANS["14b"]), *_FORCE, apart=False,
    ),
    Statement(
        "B7", "17", "Wedge over α: synchronous from 0.33 to 1.41, multi-periodic from 1.41 to"
        " 8.60.", "What is seen at α_w = 0.1, 0.2, ... 1.2 rad; the limit bisected between"
        " two of them.", "every column; the limit within one column", _angle, {"columns": False},
        {"columns": True}, "1.41 is the first of the paper's columns beyond the limit", apart=False,
    ),
)  # fmt: skip
