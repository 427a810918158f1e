"""Parts that statements on motions have in common."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from wedgebrake.analysis.sticking import AT_REST, BIDIRECTIONAL, NON_STICK_SLIP, UNIDIRECTIONAL
from wedgebrake.model.paper_machines import RESPONSES, Case
from wedgebrake.paper.claims import Part
from wedgebrake.paper.laboratory import Laboratory
from wedgebrake.paper.signal_features import (
    SideBands,
    VisibleSticks,
    distortion,
    percent,
    side_bands,
    visible_sticks,
)

STICKING = (UNIDIRECTIONAL, BIDIRECTIONAL, AT_REST)
# A bend is visible beside a smooth crossing if the acceleration jumps this many times as far.
_BENT = 3.0


@dataclass(frozen=True)
class OnFigure:
    """A check of the responses of a figure; without a steady motion no other part is told.

    number : of the figure, with its F_0 replaced if the statement's values have one
    parts  : of the statement, from a laboratory and the cases
    """

    number: int
    parts: Callable[[Laboratory, Sequence[Case]], Iterator[Part]]

    def __call__(self, laboratory: Laboratory, values: dict[str, Any]) -> Iterator[Part]:
        """Parts of the statement."""
        changed = {"F0": values["F0"]} if "F0" in values else {}
        cases = [case.at(**changed) for case in RESPONSES[self.number].cases]
        ended = [one for one in laboratory.steadies(cases) if not one.completed]
        if not ended:
            yield from self.parts(laboratory, cases)
            return
        # Divergence is the equations' answer; other ends are a solver's.
        holds = False if all(one.status == "diverged" for one in ended) else None
        found = f"{len(ended)} of {len(cases)} do not: {ended[0].status} at {ended[0].end:.3g} s"
        yield Part("the runs last 25 s", holds, found)


def sticks_of(laboratory: Laboratory, case: Case) -> VisibleSticks:
    """Sticks of a case."""
    return visible_sticks(laboratory.response(case), laboratory.thresholds)


def bands_of(laboratory: Laboratory, case: Case, *, natural: bool = False) -> SideBands:
    """Side bands of a case."""
    return side_bands(laboratory.response(case), laboratory.thresholds, natural=natural)


def stick_slip(laboratory: Laboratory, case: Case, kind: str, label: str) -> Part:
    """A case has a class of stick-slip."""
    found = sticks_of(laboratory, case)
    return Part(f"{label}: {kind}", found.kind == kind, found.description())


def no_sticks(laboratory: Laboratory, cases: Sequence[Case], name: str) -> Part:
    """None of the cases, which differ in a group, sticks."""
    laboratory.responses(cases)
    found = [sticks_of(laboratory, case) for case in cases]
    each = "; ".join(
        f"{getattr(case, name):.3g}: {one.kind} ({percent(one.shares[2])} at rest)"
        for case, one in zip(cases, found, strict=True)
    )
    return Part("no sticks", all(one.kind == NON_STICK_SLIP for one in found), each)


def two_lines(laboratory: Laboratory, cases: Sequence[Case], name: str) -> Part:
    """The spectra of the cases, which differ in a group, show f_n and f_e only."""
    found = [bands_of(laboratory, case, natural=True) for case in cases]
    each = "; ".join(
        f"{getattr(case, name):.3g}: {one.beside:.2g} at {one.where:.3g} Hz"
        for case, one in zip(cases, found, strict=True)
    )
    return Part(
        "spectra show f_n and f_e only",
        all(one.beside < laboratory.thresholds.line for one in found),
        f"highest other line, over the highest: {each}",
    )


def bent(laboratory: Laboratory, case: Case, other: Case, says: str) -> Part:
    """The velocity of a case bends where it crosses zero, compared with another case."""
    jump, smooth = (distortion(one) for one in laboratory.responses([case, other]))
    return Part(
        says,
        jump >= _BENT * smooth,
        f"jump of the acceleration {jump:.2g} of its largest value, {smooth:.2g} for the"
        " conventional brake",
    )
