"""The report computed: audit, figures and comparisons at the same time.

Drawing holds Python's lock, the runs do not: while figures are drawn here, the audit and the
comparisons, in threads of their own, keep the laboratory's threads busy.
"""

from __future__ import annotations

import io
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from typing import TYPE_CHECKING, Any, Protocol

from wedgebrake.figures.matplotlib.save import image
from wedgebrake.paper.figures import FIGURES, draw, studies
from wedgebrake.paper.identification import Identification, identify
from wedgebrake.paper.laboratory import METHOD_WORDS, Laboratory
from wedgebrake.paper.report.content import Illustration, Report, ReportQuestion
from wedgebrake.paper.smoothing import Smoothing, compare
from wedgebrake.paper.statements import audit
from wedgebrake.paper.timing import measure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PARTS = len(FIGURES) + 4
"""Of a report: the figures, the audit, two comparisons and the run times."""

_COLOURS = 96


class ReportListener(Protocol):
    """Who hears of what is done, from any thread."""

    def part(self) -> None:
        """One more part is done."""

    def file(self, name: str, content: bytes) -> None:
        """A file is complete: its name, as "fig8.png", and what stands in it."""


def drawn(
    name: str, laboratory: Laboratory, kind: str, watch: ReportListener
) -> tuple[Figure, bytes]:
    """One of the paper's figures, and what stands in its file.

    kind : of the file, "png", "svg" or "pdf"
    """
    figure = draw(name, laboratory)
    content = image(figure, kind)
    watch.file(f"{name}.{kind}", content)
    watch.part()
    return figure, content


def small(png: bytes) -> bytes:
    """The same picture in few colours, a third of the size: drawings need no more."""
    from PIL import Image

    few = Image.open(io.BytesIO(png)).convert("RGB").quantize(_COLOURS, dither=Image.Dither.NONE)
    content = io.BytesIO()
    few.save(content, "PNG")
    return content.getvalue()


def gather(
    laboratory: Laboratory, kind: str, command: str, versions: dict[str, str], watch: ReportListener
) -> Report:
    """Everything in the report.

    kind : of the figures' files; the page has them as PNG
    """
    timings = measure()  # while nothing else computes
    watch.part()
    threads = ThreadPoolExecutor(3, thread_name_prefix="wedgebrake-report")

    def begun(work: Callable[[Laboratory], Any]) -> Future[Any]:
        future = threads.submit(work, laboratory)
        future.add_done_callback(lambda _: watch.part())
        return future

    try:
        findings, identification, smoothing = begun(audit), begun(identify), begun(compare)
        figures = []
        for name, about in FIGURES.items():
            figure, content = drawn(name, laboratory, kind, watch)
            png = small(content if kind == "png" else image(figure, "png"))
            wide = figure.get_figwidth()
            figures.append(Illustration(name, str(about.number), about.caption, png, wide))
        return Report(
            method=METHOD_WORDS[laboratory.method],
            assumptions=laboratory.assumptions.words(),
            findings=findings.result(),
            figures=tuple(figures),
            identification=_study(
                identification.result(),
                studies.identification(identification.result().rows),
                "Which statements hold with each set of choices, the best set first.",
            ),
            smoothing=_study(
                smoothing.result(),
                studies.smoothing(smoothing.result()),
                "How the smoothed law tends to Coulomb friction as its steepness ξ grows: (a)"
                " regular responses, (b) limits of figure 11a, (c) creep where Coulomb friction"
                " holds still.",
            ),
            timings=timings,
            command=command,
            versions=versions,
        )
    finally:
        threads.shutdown(wait=False, cancel_futures=True)


def _study(found: Identification | Smoothing, figure: Figure, caption: str) -> ReportQuestion:
    return ReportQuestion(
        paragraphs=found.paragraphs,
        table=tuple(found.table()),
        picture=Illustration("", "", caption, small(image(figure, "png")), figure.get_figwidth()),
        questions=getattr(found, "open_questions", ()),
    )
