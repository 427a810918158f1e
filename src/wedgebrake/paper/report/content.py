"""Contents of the report as plain data: nothing here computes or draws."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field

from wedgebrake.paper.claims import Finding, Part, Verdict
from wedgebrake.paper.corrections import Correction
from wedgebrake.paper.timing import Timing

Row = dict[str, str]
Counts = dict[Verdict, int]


@dataclass(frozen=True)
class Illustration:
    """A figure that was drawn.

    name, number, caption : as "fig8", "8", and what it shows
    png                   : the picture
    width                 : as it is meant to be printed [inch]
    """

    name: str
    number: str
    caption: str
    png: bytes
    width: float


@dataclass(frozen=True)
class Study:
    """A question beside the statements: words, a table, a picture, what it leaves open.

    table     : rows of cells by column, all with the same columns
    questions : (question, answer, settled)
    """

    paragraphs: tuple[str, ...] = ()
    table: tuple[Row, ...] = ()
    picture: Illustration | None = None
    questions: tuple[tuple[str, str, bool], ...] = ()


@dataclass(frozen=True)
class Made:
    """Provenance of a report.

    command  : what makes it again
    versions : of the programs, by name
    """

    command: str
    versions: dict[str, str]


@dataclass(frozen=True)
class Report:
    """Everything in the report.

    method, assumptions : how the runs were made, in words
    """

    method: str
    assumptions: str
    made: Made
    findings: tuple[Finding, ...]
    figures: tuple[Illustration, ...]
    identification: Study = field(default_factory=Study)
    smoothing: Study = field(default_factory=Study)
    corrections: tuple[Correction, ...] = ()
    timings: tuple[Timing, ...] = ()


@dataclass(frozen=True)
class Chapter:
    """A figure of the paper: what was drawn for it, and what is stated about it."""

    number: str
    illustrations: tuple[Illustration, ...]
    findings: tuple[Finding, ...]


def counts(findings: Iterable[Finding]) -> Counts:
    """How many statements have each verdict; every verdict is there, in a fixed order."""
    found = Counter(finding.verdict for finding in findings)
    return {verdict: found[verdict] for verdict in Verdict}


def chapters(report: Report) -> tuple[list[Chapter], list[Finding]]:
    """The figures with their statements, and the statements for which no figure was drawn."""
    numbers = dict.fromkeys(_number(one.number) for one in report.figures)
    found = [
        Chapter(
            number,
            tuple(one for one in report.figures if _number(one.number) == number),
            tuple(one for one in report.findings if _number(one.statement.figure) == number),
        )
        for number in numbers
    ]
    rest = [one for one in report.findings if _number(one.statement.figure) not in numbers]
    return found, rest


def _number(figure: str) -> str:
    """The number of the figure that a panel is in: "8" of "8a", "" where there is none."""
    digits = re.match(r"\d+", figure.strip())
    return digits.group() if digits else ""


def compared(finding: Finding) -> Iterator[tuple[Part | None, Part | None]]:
    """Each part as judged and as printed, paired by what it says; None where there is none."""
    rest = list(finding.printed)
    for part in finding.parts:
        twin = next((one for one in rest if one.says == part.says), None)
        if twin is not None:
            rest.remove(twin)
        yield part, twin
    for part in rest:
        yield None, part


def score(parts: Sequence[Part]) -> str:
    """How many parts hold, in words: "5 of 7", and how many cannot be told."""
    told = [part.holds for part in parts if part.holds is not None]
    unknown = len(parts) - len(told)
    words = f"{sum(told)} of {len(parts)}"
    return words + (f", {unknown} cannot be told" if unknown else "")
