"""The report as one HTML page: no script, nothing fetched, images inside."""

from __future__ import annotations

import base64
import re
import struct
from collections.abc import Sequence

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup, escape

from wedgebrake.figures.matplotlib import style
from wedgebrake.model.display import duration
from wedgebrake.model.paper_machines import AS_PRINTED, DURATION
from wedgebrake.paper.claims import Finding, StatementVerdict
from wedgebrake.paper.laboratory import STEADY
from wedgebrake.paper.report.content import CORRECTIONS, Report, chapters, compared, counts, score

TITLE = "Chen and Xi (2014), recomputed"
# Colour and short name, for styles; colours never stand alone.
_COLOURS = (style.GREEN, style.BLUE, style.VERMILLION, style.PALE_GREY)
_LOOKS = {
    one: (colour, one.name.lower()) for one, colour in zip(StatementVerdict, _COLOURS, strict=True)
}
_MEANINGS = {
    StatementVerdict.REPRODUCED: "every part holds with the printed values",
    StatementVerdict.CORRECTED: "every part holds once the values named beside it are corrected",
    StatementVerdict.CONTRADICTED: "at least one part does not hold, as printed or corrected",
    StatementVerdict.UNDECIDABLE: "no part fails, but for one of them the text does not say enough",
}
# Pixels of the page for an inch in print.
_PIXELS = 124.0
# A symbol with an index, as in F_a0 and μ_s, but not a name_of_many_words.
_INDEX = re.compile(r"(?<!\w)([^\W\d_])_([^\W_]{1,3})(?!\w)")


def page(report: Report) -> str:
    """The whole page."""
    environment = Environment(
        loader=PackageLoader("wedgebrake.paper.report", "."),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    for filter_ in (symbols, source, size, digits, duration, score):
        environment.filters[filter_.__name__] = filter_
    figures, rest = chapters(report)
    return environment.get_template("report.html.jinja").render(
        title=TITLE,
        lead=lead(report.findings),
        corrections=CORRECTIONS,
        report=report,
        chapters=figures,
        rest=rest,
        counts=counts(report.findings),
        StatementVerdict=StatementVerdict,
        looks=_LOOKS,
        ink={verdict: style.text_colour(colour) for verdict, (colour, _) in _LOOKS.items()},
        meanings=_MEANINGS,
        outcome=outcome,
        compared=compared,
        as_printed=AS_PRINTED.words(),
        duration=DURATION,
        steady=STEADY,
    )


def lead(findings: Sequence[Finding]) -> str:
    """Result of the audit, in a sentence."""
    printed, corrected, against, unclear = counts(findings).values()
    return (
        f"Of {len(findings)} statements of the paper that can be tested, {printed + corrected}"
        f" hold: {printed} as printed, {corrected} once a stated value is corrected. In {against}"
        f" at least one part does not hold; for {unclear} the text does not say enough."
    )


def outcome(finding: Finding) -> str:
    """Result of a statement, in a sentence or two."""
    if finding.verdict is StatementVerdict.REPRODUCED:
        return "Holds as printed; nothing was changed."
    if finding.verdict is StatementVerdict.UNDECIDABLE:
        return "Cannot be decided: the text does not say enough."
    printed = f"As printed, {score(finding.printed)} parts hold."
    if finding.verdict is StatementVerdict.CORRECTED:
        return f"{printed} Correction needed: {finding.needed}."
    return f"{printed} Corrected, {score(finding.parts)}."


def symbols(text: object) -> Markup:
    """Markup of a text, with the indices of its symbols set low and true minus signs."""
    safe = style.minus_signs(str(escape(text)))
    return Markup(_INDEX.sub(r"\1<sub>\2</sub>", safe))  # noqa: S704 - escaped above


def source(png: bytes) -> str:
    """Address of a picture that contains it."""
    return "data:image/png;base64," + base64.b64encode(png).decode()


def size(png: bytes, inches: float) -> tuple[int, int]:
    """Width and height on the page [pixels], for a width in print [inch]."""
    width, height = struct.unpack(">II", png[16:24])
    shown = round(inches * _PIXELS)
    return shown, round(shown * height / width)


def digits(value: float) -> str:
    """A measured number: two digits, three from 10 to 100."""
    return f"{float(f'{value:.2g}'):g}" if value < 10.0 or value >= 100.0 else f"{value:.3g}"
