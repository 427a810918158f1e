"""The report computed: audit, figures and comparisons at the same time.

Drawing holds Python's lock, the runs do not: while figures are drawn here, the audit and the
comparisons, in threads of their own, keep the laboratory's threads busy.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING, TypeVar

from wedgebrake.figures.matplotlib.save import image
from wedgebrake.paper.corrections import CORRECTIONS
from wedgebrake.paper.figures import FIGURES
from wedgebrake.paper.identification import Identification, identify
from wedgebrake.paper.laboratory import METHOD_WORDS, Laboratory
from wedgebrake.paper.report.content import Illustration, Made, Report, Study
from wedgebrake.paper.report.pictures import Watch, illustration, small
from wedgebrake.paper.smoothing import Smoothing, compare
from wedgebrake.paper.statements import audit
from wedgebrake.paper.timing import measure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_Result = TypeVar("_Result")


PARTS = len(FIGURES) + 4
"""Of a report: the figures, the audit, two comparisons and the run times."""


def gather(laboratory: Laboratory, kind: str, made: Made, watch: Watch) -> Report:
    """Everything that stands in the report.

    kind : of the figures' files; the page has them as PNG
    """
    timings = measure()  # while nothing else computes
    watch.part()
    threads = ThreadPoolExecutor(3, thread_name_prefix="wedgebrake-report")
    try:
        findings = threads.submit(_heard, audit, laboratory, watch)
        identification = threads.submit(_heard, identify, laboratory, watch)
        smoothing = threads.submit(_heard, compare, laboratory, watch)
        figures = [illustration(name, laboratory, kind, watch) for name in FIGURES]
        return Report(
            method=METHOD_WORDS[laboratory.method],
            assumptions=laboratory.assumptions.words(),
            findings=findings.result(),
            figures=tuple(figures),
            identification=_identified(identification.result()),
            smoothing=_compared(smoothing.result()),
            corrections=CORRECTIONS,
            timings=timings,
            made=made,
        )
    finally:
        threads.shutdown(wait=False, cancel_futures=True)


def _heard(work: Callable[[Laboratory], _Result], laboratory: Laboratory, watch: Watch) -> _Result:
    result = work(laboratory)
    watch.part()
    return result


def _identified(found: Identification) -> Study:
    return Study(
        paragraphs=found.paragraphs,
        table=tuple(found.table()),
        picture=_picture(
            "Which statements hold with each set of choices, the best set first.", found.draw()
        ),
        questions=found.open_questions,
    )


def _compared(found: Smoothing) -> Study:
    return Study(
        paragraphs=found.paragraphs,
        table=tuple(found.table()),
        picture=_picture(
            "How the smoothed law tends to Coulomb friction as its steepness ξ grows: (a) regular"
            " responses, (b) limits of figure 11a, (c) creep where Coulomb friction holds still.",
            found.draw(),
        ),
    )


def _picture(caption: str, figure: Figure) -> Illustration:
    return Illustration("", "", caption, small(image(figure, "png")), figure.get_figwidth())
