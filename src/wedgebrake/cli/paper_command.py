"""The work of ``wedgebrake paper``: what is asked, progress, files, and words for it."""

from __future__ import annotations

import contextlib
import queue
import secrets
import shlex
import shutil
import textwrap
import threading
import time
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

from wedgebrake._version import __version__
from wedgebrake.cli.interrupts import Interrupted, announce_compilation
from wedgebrake.cli.writing import to_json, versions
from wedgebrake.errors import InputError, nearest
from wedgebrake.model.files import write
from wedgebrake.model.paper_machines import AS_PRINTED, CORRECTED
from wedgebrake.paper.claims import Finding
from wedgebrake.paper.figures import FIGURES
from wedgebrake.paper.laboratory import FRICTION, METHOD_WORDS, Laboratory
from wedgebrake.paper.report.content import Made, counts, score
from wedgebrake.solvers.interrupts import interruptible
from wedgebrake.sweeps.progress import Bar, Progress

ALL, CLAIMS = "all", "claims"
OTHERS = {
    CLAIMS: "what comes of each statement of the paper, as text",
    ALL: "every figure, the statements, and a report on them as one HTML page",
}
KINDS = ("png", "svg", "pdf")
FOLDER, REPORT, DATA = Path("paper"), "report.html", "claims.json"
_MOST_THREADS = 1024
# Columns of the list at most, of a verdict's lines where no terminal says how many, of both at
# least; and of the space before a verdict's further lines.
_WIDTH, _LINE, _LEAST, _INDENT = 100, 120, 60, 4


@dataclass(frozen=True)
class Order:
    """Request of the command line.

    figures : names of the figures to draw
    claims  : test the statements; ``report``: and write the report
    folder  : where files go; None where there are none
    method, threads : of the laboratory
    kind    : of the figures' files
    """

    figures: tuple[str, ...]
    claims: bool
    report: bool
    folder: Path | None
    method: str
    threads: int | None
    kind: str

    @property
    def command(self) -> str:
        """Command line that gives the same report."""
        words = ["wedgebrake", "paper", ALL, "--method", self.method, "--out", str(self.folder)]
        return shlex.join(words)


@dataclass(frozen=True)
class Outcome:
    """Files and results of a command.

    files    : written, in order
    findings : what came of the statements; None where they were not tested
    seconds  : how long it took
    """

    files: list[Path]
    findings: tuple[Finding, ...] | None
    seconds: float

    @property
    def report(self) -> Path | None:
        """The page, where there is one."""
        return next((path for path in self.files if path.name == REPORT), None)


def ordered(
    targets: Iterable[str], out: Path | None, method: str, threads: int | None, kind: str
) -> Order:
    """The order, checked.

    Raises ``InputError`` for a target, method, format or number of threads that is not allowed.
    """
    targets = tuple(dict.fromkeys(target.lower() for target in targets))
    for option, word, allowed in (
        *(("", target, [*FIGURES, *OTHERS]) for target in targets),
        ("--method ", method, list(FRICTION)),
        ("--format ", kind, list(KINDS)),
    ):
        if word not in allowed:
            raise InputError(f"{option}{word}: not known. {nearest(word, allowed)}")
    if threads is not None and not 1 <= threads <= _MOST_THREADS:
        raise InputError(
            f"--threads {threads}: must be a whole number, 1 to {_MOST_THREADS}. Leave it out for"
            " one per processor."
        )
    everything = ALL in targets
    figures = tuple(name for name in FIGURES if everything or name in targets)
    return Order(
        figures=figures,
        claims=everything or CLAIMS in targets,
        report=everything,
        folder=out or (FOLDER if figures else None),
        method=method,
        threads=threads,
        kind=kind,
    )


def carry_out(order: Order) -> Outcome:
    """Draw, test and write what is asked; progress goes to standard error.

    Files appear in the folder as they are complete, each whole or not at all.

    Raises ``InputError`` for a folder that cannot be, ``OutputError`` where a file cannot be
    written, and ``Interrupted`` with a note on what is kept.
    """
    begin = time.perf_counter()
    watch = _Watch(order.folder)
    laboratory = Laboratory(order.method, threads=order.threads, watch=watch.run)

    def work() -> tuple[Finding, ...] | None:
        with announce_compilation("about half a minute"):
            return _work(order, laboratory, watch)

    with _folder(order.folder), laboratory, watch:
        try:
            findings = interruptible(work, watch.show)
        except Interrupted as interrupt:
            interrupt.add_note(_what_is_kept(watch.written))
            raise
    return Outcome(watch.written, findings, time.perf_counter() - begin)


def _work(order: Order, laboratory: Laboratory, watch: _Watch) -> tuple[Finding, ...] | None:
    """The request and the results of the statements, if they are tested."""
    do = _everything if order.report else _pieces
    findings = do(order, laboratory, watch)
    if findings is not None:
        watch.file(DATA, to_json(_claims(order, findings)).encode())
    return findings


def _everything(order: Order, laboratory: Laboratory, watch: _Watch) -> tuple[Finding, ...]:
    from wedgebrake.paper.report.gather import PARTS, gather
    from wedgebrake.paper.report.page import page

    watch.total = PARTS
    report = gather(laboratory, order.kind, _made(order), watch)
    watch.file(REPORT, page(report).encode())
    return report.findings


def _pieces(order: Order, laboratory: Laboratory, watch: _Watch) -> tuple[Finding, ...] | None:
    from wedgebrake.paper.report.pictures import drawn
    from wedgebrake.paper.statements import audit

    watch.total = len(order.figures) + order.claims
    for name in order.figures:
        drawn(name, laboratory, order.kind, watch)
    findings = audit(laboratory) if order.claims else None
    if order.claims:
        watch.part()
    return findings


def _made(order: Order) -> Made:
    drawing = {name: version(name) for name in ("matplotlib", "jinja2")}
    return Made(order.command, {"wedgebrake": __version__, **versions(), **drawing})


class _Watch:
    """Hears of what is done in other threads; writes and shows it in the main one.

    So that nothing is written or shown any more once that one has heard Ctrl-C.
    """

    def __init__(self, folder: Path | None) -> None:
        self.total = 1
        self.written: list[Path] = []
        self._folder = folder
        self._lock = threading.Lock()
        self._parts = self._runs = 0
        self._files: queue.SimpleQueue[tuple[str, bytes]] = queue.SimpleQueue()
        self._bar = Bar()
        self._shown: _Moment | None = None

    def run(self) -> None:
        """One more run is done."""
        with self._lock:
            self._runs += 1

    def part(self) -> None:
        """One more part is done."""
        with self._lock:
            self._parts += 1

    def file(self, name: str, content: bytes) -> None:
        """A file is complete; it is dropped where there is no folder."""
        if self._folder is not None:
            self._files.put((name, content))

    def show(self) -> None:
        """Write what is complete, and show what is new."""
        while self._folder is not None and not self._files.empty():
            name, content = self._files.get()
            write(self._folder / name, content)
            self.written.append(self._folder / name)
        moment = _Moment(self._parts, self.total, 0, 0.0, runs=self._runs)
        if moment != self._shown:
            self._shown = moment
            self._bar(moment)

    def __enter__(self) -> _Watch:
        return self

    def __exit__(self, *_: object) -> None:
        self._bar.close()


@dataclass(frozen=True)
class _Moment(Progress):
    """How far it has come: parts, and runs so far."""

    runs: int = 0

    def __str__(self) -> str:
        return f"{self.done} of {self.total} parts, {self.runs} runs"


@contextmanager
def _folder(path: Path | None) -> Iterator[None]:
    """Inside, the folder is there; afterwards, it is gone if it was made for nothing.

    Raises ``InputError`` that names the option and the way out.
    """
    if path is None:
        yield
        return
    if path.suffix.lower() in (".html", *(f".{kind}" for kind in KINDS)) and not path.is_dir():
        raise InputError(
            f"--out {path}: names a file, must be a folder; the files have names of their own."
            f" For example --out {FOLDER}; --format sets the kind of the figures."
        )
    beside = path / f".{secrets.token_hex(6)}.part"
    new = not path.exists()
    try:
        path.mkdir(exist_ok=True)
        beside.touch(exist_ok=False)
        beside.unlink()
    except FileNotFoundError:
        raise InputError(
            f"--out {path}: cannot be made: the folder {path.parent} does not exist. Create it, or"
            " choose another one."
        ) from None
    except (OSError, ValueError) as error:
        why = getattr(error, "strerror", None) or error
        raise InputError(
            f"--out {path}: cannot be written to ({why}). Choose another folder."
        ) from None
    try:
        yield
    finally:
        if new:
            with contextlib.suppress(OSError):  # not empty
                path.rmdir()


def _what_is_kept(written: Sequence[Path]) -> str:
    if not written:
        return "Nothing new was written."
    files = f"{len(written)} files" if len(written) > 1 else "1 file"
    return f"{written[0].parent} keeps {files}, complete."


def listing() -> str:
    """List of figures and reports, as text."""
    width = max(map(len, (*FIGURES, *OTHERS))) + 2
    lines = ["Figures of Chen and Xi (2014) that can be computed:"]
    lines += [_listed(name, figure.caption, width) for name, figure in FIGURES.items()]
    lines += ["", "And:"]
    lines += [_listed(name, words, width) for name, words in OTHERS.items()]
    lines += ["", "For example: wedgebrake paper fig8, or: wedgebrake paper all --out paper"]
    return "\n".join(lines)


def _listed(name: str, words: str, width: int) -> str:
    return textwrap.fill(
        f"{name:{width}}{words}",
        max(min(shutil.get_terminal_size((_WIDTH, 1)).columns, _WIDTH), _LEAST),
        initial_indent="  ",
        subsequent_indent=" " * (width + 2),
        break_on_hyphens=False,
    )


def listing_report() -> dict[str, Any]:
    """The same for ``--json``."""
    figures = {
        name: {"number": str(one.number), "caption": one.caption} for name, one in FIGURES.items()
    }
    return {"wedgebrake": __version__, "figures": figures, "others": OTHERS}


def text(outcome: Outcome) -> str:
    """Results, as text."""
    lines = []
    if outcome.findings is not None:
        lines += [*map(_line, outcome.findings), "", _summary(outcome.findings)]
    pictures = [path for path in outcome.files if path.name not in (REPORT, DATA)]
    if outcome.report is not None:
        folder = outcome.report.parent.resolve()
        lines.append(f"{len(pictures)} figures and {DATA}: {folder}")
        lines.append(f"Report: {outcome.report.resolve()}")
    else:
        others = [path for path in outcome.files if path.name == DATA]
        lines += [f"Figure: {path.resolve()}" for path in pictures]
        lines += [f"Data: {path.resolve()}" for path in others]
    return "\n".join(lines)


def _line(finding: Finding) -> str:
    """The verdict on a statement."""
    one = finding.statement
    figure = f"Fig. {one.figure}" if one.figure[:1].isdigit() else ""
    held = score(finding.parts).partition(",")[0]
    start = f"{one.name:<{_INDENT}}{figure:<10}{finding.verdict.value:<37}{held:<10}"
    needed = f" Correction: {finding.needed}." if finding.needed else ""
    return textwrap.fill(
        start + one.says + needed,
        max(shutil.get_terminal_size((_LINE, 1)).columns, _LEAST),
        subsequent_indent=" " * _INDENT,
        break_on_hyphens=False,
    )


def _summary(findings: Sequence[Finding]) -> str:
    found = ", ".join(f"{number} {one.value}" for one, number in counts(findings).items())
    return f"{len(findings)} statements: {found}.\nEach number found: --json, or paper all."


def report(order: Order, outcome: Outcome) -> dict[str, Any]:
    """Output of ``paper --json``."""
    tested = {} if outcome.findings is None else _claims(order, outcome.findings)
    return {
        "wedgebrake": __version__,
        "versions": versions(),
        "method": order.method,
        "files": [str(path.resolve()) for path in outcome.files],
        "report": outcome.report and str(outcome.report.resolve()),
        "counts": tested.get("counts"),
        "findings": tested.get("findings"),
        "seconds": outcome.seconds,
    }


def _claims(order: Order, findings: Sequence[Finding]) -> dict[str, Any]:
    """Contents of ``claims.json``."""
    return {
        "wedgebrake": __version__,
        "versions": versions(),
        "method": METHOD_WORDS[order.method],
        "as_printed": AS_PRINTED.words(),
        "corrected": CORRECTED.words(),
        "counts": {verdict.value: number for verdict, number in counts(findings).items()},
        "findings": [finding.as_dict() for finding in findings],
    }
