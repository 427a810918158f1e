"""Contents of the report as plain data: nothing here computes or draws."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple

from wedgebrake.paper.claims import Assertion, Finding, StatementVerdict, read_table
from wedgebrake.paper.timing import Timing

CORRECTIONS = tuple(read_table("wedgebrake.paper", "corrections.toml")["correction"])
"""The places where what the paper prints differs from what it computed: where, what is printed and
what is used instead, and the evidence."""


class Illustration(NamedTuple):
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


class ReportQuestion(NamedTuple):
    """A question beside the statements: words, a table, a picture, what it leaves open.

    table     : rows of cells by column, all with the same columns
    questions : (question, answer, settled)
    """

    paragraphs: tuple[str, ...] = ()
    table: tuple[dict[str, str], ...] = ()
    picture: Illustration | None = None
    questions: tuple[tuple[str, str, bool], ...] = ()


class Report(NamedTuple):
    """Everything in the report.

    method, assumptions : how the runs were made, in words
    command, versions   : the command that makes it again, and the programs
    """

    method: str
    assumptions: str
    command: str
    versions: dict[str, str]
    findings: tuple[Finding, ...]
    figures: tuple[Illustration, ...]
    identification: ReportQuestion
    smoothing: ReportQuestion
    timings: tuple[Timing, ...]


class Chapter(NamedTuple):
    """A figure of the paper: what was drawn for it, and what is stated about it."""

    number: str
    illustrations: list[Illustration]
    findings: list[Finding]


def counts(findings: Iterable[Finding]) -> dict[StatementVerdict, int]:
    """How many statements have each verdict; every verdict is there, in a fixed order."""
    found = Counter(finding.verdict for finding in findings)
    return {verdict: found[verdict] for verdict in StatementVerdict}


def chapters(report: Report) -> tuple[list[Chapter], list[Finding]]:
    """The figures with their statements, and the statements for which no figure was drawn."""
    found: dict[str, Chapter] = {}
    for one in report.figures:
        number = _number(one.number)
        found.setdefault(number, Chapter(number, [], [])).illustrations.append(one)
    rest: list[Finding] = []
    for finding in report.findings:
        number = _number(finding.statement.figure)
        (found[number].findings if number in found else rest).append(finding)
    return list(found.values()), rest


def _number(figure: str) -> str:
    """The number of the figure that a panel is in: "8" of "8a", "" where there is none."""
    digits = re.match(r"\d+", figure)
    return digits.group() if digits else ""


def compared(finding: Finding) -> Iterator[tuple[Assertion | None, Assertion | None]]:
    """Each part as evaluated and as printed, paired by what it says; None where there is none."""
    rest = list(finding.printed)
    for part in finding.parts:
        twin = next((one for one in rest if one.says == part.says), None)
        if twin is not None:
            rest.remove(twin)
        yield part, twin
    for part in rest:
        yield None, part


def score(parts: Sequence[Assertion]) -> str:
    """How many parts hold, in words: "5 of 7", and how many cannot be told."""
    unknown = sum(part.holds is None for part in parts)
    words = f"{sum(part.holds is True for part in parts)} of {len(parts)}"
    return words + (f", {unknown} cannot be told" if unknown else "")
