"""Statements of the paper, how each is tested, and the verdict that follows.

A statement is tested in parts, each a plain yes or no with the numbers found. It is tested
twice: as printed (the paper's own parameters, ``AS_PRINTED``) and as corrected. No verdict
is written down anywhere; it follows from the parts. (One part, on the run time of the paper's
own program, cannot be decided by any run here.)
"""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from enum import Enum
from importlib.resources import files
from typing import Any

from wedgebrake.model.paper_machines import AS_PRINTED
from wedgebrake.paper.laboratory import Laboratory


def read_table(package: str, name: str) -> dict[str, Any]:
    """Contents of a TOML file that is part of a package."""
    return tomllib.loads(files(package).joinpath(name).read_text(encoding="utf-8"))


class StatementVerdict(Enum):
    """Verdict on a statement."""

    REPRODUCED = "reproduced"
    CORRECTED = "reproduced with a stated correction"
    CONTRADICTED = "contradicted"
    UNDECIDABLE = "undecidable from the text"


@dataclass(frozen=True)
class Assertion:
    """One assertion of a statement.

    says  : the assertion
    holds : whether it is true; None where the text does not say enough to decide
    found : the numbers found, in words
    """

    says: str
    holds: bool | None
    found: str

    def __post_init__(self) -> None:
        if self.holds is not None:  # NumPy's booleans are neither ``True`` nor JSON
            object.__setattr__(self, "holds", bool(self.holds))


Check = Callable[[Laboratory, dict[str, Any]], Iterable[Assertion]]
"""The parts of a statement, from a laboratory and the statement's values."""


@dataclass(frozen=True)
class Statement:
    """One statement of the paper.

    name       : as "B3"; figure: as "11a"; says: a paraphrase
    test       : how it is tested; tolerance: what counts as agreement
    check      : from a laboratory and the values below, the parts
    printed    : what the figure's caption or the text prints, where a correction changes it
    correction : the values that are used instead; {} for none
    why        : that correction in words, for the reader
    apart      : whether each assumption is reverted alone, to see if it is needed; for the
                 diagrams the identification does that
    """

    name: str
    figure: str
    says: str
    test: str
    tolerance: str
    check: Check
    printed: dict[str, Any] = field(default_factory=dict)
    correction: dict[str, Any] = field(default_factory=dict)
    why: str = ""
    apart: bool = True

    @property
    def corrected(self) -> dict[str, Any]:
        """The printed values with the correction."""
        return {**self.printed, **self.correction}

    def parts(self, laboratory: Laboratory, values: dict[str, Any]) -> tuple[Assertion, ...]:
        """Test it with some values, once for each laboratory."""
        what, check = (self.name, self.check), self.check
        found: tuple[Assertion, ...] = laboratory.once(
            what, values, lambda: tuple(check(laboratory, values))
        )
        return found

    def holds(self, laboratory: Laboratory, values: dict[str, Any] | None = None) -> bool | None:
        """Whether all parts hold, by default with the corrected values; None if undecidable."""
        return all_hold(self.parts(laboratory, self.corrected if values is None else values))


@dataclass(frozen=True)
class Finding:
    """Result of examining a statement.

    parts   : with the corrected parameters, or as printed where that already holds
    printed : the same with the paper's own parameters
    needed  : the corrections without which it does not hold, in words; empty if none
    """

    statement: Statement
    verdict: StatementVerdict
    parts: tuple[Assertion, ...]
    printed: tuple[Assertion, ...]
    needed: str = ""

    def as_dict(self) -> dict[str, Any]:
        """Plain values, for JSON."""
        words = ("figure", "says", "test", "tolerance")
        return {
            "id": self.statement.name,
            **{name: getattr(self.statement, name) for name in words},
            "verdict": self.verdict.value,
            "correction": self.needed,
            "parts": [vars(part) for part in self.parts],
            "as_printed": [vars(part) for part in self.printed],
        }


def all_hold(parts: Iterable[Assertion]) -> bool | None:
    """True if all parts hold; None if none is false but one cannot be decided."""
    answers = [part.holds for part in parts]
    if False in answers:
        return False
    return None if None in answers or not answers else True


def examine(statement: Statement, laboratory: Laboratory) -> Finding:
    """Test a statement as printed and, where that does not hold, as corrected.

    Corrected are the laboratory's assumptions and the values of the statement itself.
    """
    as_printed = laboratory.like(assumptions=AS_PRINTED)
    printed = statement.parts(as_printed, statement.printed)
    if all_hold(printed):
        return Finding(statement, StatementVerdict.REPRODUCED, printed, printed)
    parts = statement.parts(laboratory, statement.corrected)
    holds = all_hold(parts)
    verdicts = {
        True: StatementVerdict.CORRECTED,
        False: StatementVerdict.CONTRADICTED,
        None: StatementVerdict.UNDECIDABLE,
    }
    needed = _needed(statement, laboratory) if holds else ""
    return Finding(statement, verdicts[holds], parts, printed, needed)


def _needed(statement: Statement, laboratory: Laboratory) -> str:
    """Name a smallest set of changes to the printed page with which a statement holds.

    Each change is reverted in turn, for good if the statement holds without it.
    """
    chosen, values = laboratory.assumptions, statement.printed
    if statement.correction and not statement.holds(laboratory, values):
        values = statement.corrected
    names = chosen.differing(AS_PRINTED)
    if statement.apart:
        for name in tuple(names):
            without = replace(chosen, **{name: getattr(AS_PRINTED, name)})
            if statement.holds(laboratory.like(assumptions=without), values):
                chosen = without
                names.remove(name)
    words = [chosen.words(names)] if names else []
    if values is not statement.printed:
        words.append(statement.why)
    return "; ".join(words)
