"""Implementation of ``wedgebrake paper``: request, progress, files and text."""

from __future__ import annotations

import contextlib
import queue
import shlex
import shutil
import textwrap
import threading
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

from wedgebrake._version import __version__
from wedgebrake.cli.compilation import announce_compilation
from wedgebrake.cli.interrupts import Interrupted
from wedgebrake.cli.output import check_folder, put, to_json, versions
from wedgebrake.cli.progress import ProgressDisplay, Stage
from wedgebrake.errors import InputError, nearest
from wedgebrake.model.files import write
from wedgebrake.model.paper_machines import AS_PRINTED, CORRECTED
from wedgebrake.paper.claims import Finding
from wedgebrake.paper.figures import FIGURES
from wedgebrake.paper.laboratory import FRICTION, METHOD_WORDS, Laboratory
from wedgebrake.paper.report.content import counts, score

ALL, CLAIMS = "all", "claims"
OTHERS = {
    CLAIMS: "the verdict on each statement of the paper, as text",
    ALL: "every figure, the statements, and a report on them as one HTML page",
}
KINDS = ("png", "svg", "pdf")
FOLDER, REPORT, DATA = Path("paper"), "report.html", "claims.json"
# Largest width of the list, width of verdicts without a terminal, smallest width of both
# [columns]; and indent of the further lines of a verdict.
_WIDTH, _LINE, _LEAST, _INDENT = 100, 120, 60, 4


@dataclass(frozen=True)
class Order:
    """Request of the command line, checked.

    targets : figures to draw, claims, all
    out     : folder of the files; by default the folder paper if there are figures
    method, threads : of the laboratory
    kind    : of the figures' files

    Raises ``InputError`` for a target, method or format that is not allowed.
    """

    targets: tuple[str, ...]
    out: Path | None
    method: str
    threads: int | None
    kind: str

    def __post_init__(self) -> None:
        for option, word, allowed in (
            *(("", target, [*FIGURES, *OTHERS]) for target in self.targets),
            ("--method ", self.method, list(FRICTION)),
            ("--format ", self.kind, list(KINDS)),
        ):
            if word not in allowed:
                raise InputError(f"{option}{word}: not known. {nearest(word, allowed)}")

    @property
    def figures(self) -> list[str]:
        """Names of the figures to draw."""
        return [name for name in FIGURES if ALL in self.targets or name in self.targets]

    @property
    def folder(self) -> Path | None:
        """Folder of the files; None if there are none."""
        return self.out or (FOLDER if self.figures else None)


def run(
    targets: list[str],
    out: Path | None,
    method: str,
    threads: int | None,
    kind: str,
    as_json: bool,
) -> None:
    """Draw, test and write the request and print the results; without a target list all.

    Files appear in the folder when they are complete; none is written in part.

    Raises ``InputError`` for an impossible folder, ``OutputError`` if a file cannot be
    written, and ``Interrupted`` with a note on kept files.
    """
    if not targets:
        listed = {
            name: {"number": str(one.number), "caption": one.caption}
            for name, one in FIGURES.items()
        }
        put(as_json, {"wedgebrake": __version__, "figures": listed, "others": OTHERS}, _listing)
        return
    order = Order(tuple(target.lower() for target in targets), out, method, threads, kind)
    begin = time.perf_counter()
    watch = _ReportProgress(order.folder)
    laboratory = Laboratory(method, threads=threads, watch=watch.run)

    def work() -> tuple[Finding, ...] | None:
        with announce_compilation():
            return _work(order, laboratory, watch)

    with _folder(order.folder), laboratory:
        try:
            findings = watch.wait(work)
        except Interrupted as interrupt:
            interrupt.add_note(_what_is_kept(watch.written))
            raise
    report = _report(order, watch.written, findings, time.perf_counter() - begin)
    put(as_json, report, lambda: _text(report, findings))


def _work(
    order: Order, laboratory: Laboratory, watch: _ReportProgress
) -> tuple[Finding, ...] | None:
    """Draw and test; returns the results of the statements, if they are tested."""
    findings = None
    if ALL in order.targets:
        from wedgebrake.paper.report.gather import PARTS, gather
        from wedgebrake.paper.report.page import page

        watch.total = PARTS
        drawing = {name: version(name) for name in ("matplotlib", "jinja2")}
        words = ["wedgebrake", "paper", ALL, "--method", order.method, "--out", str(order.folder)]
        programs = {"wedgebrake": __version__, **versions()["versions"], **drawing}
        gathered = gather(laboratory, order.kind, shlex.join(words), programs, watch)
        watch.file(REPORT, page(gathered).encode())
        findings = gathered.findings
    else:
        from wedgebrake.paper.report.gather import drawn
        from wedgebrake.paper.statements import audit

        watch.total = len(order.figures) + (CLAIMS in order.targets)
        for name in order.figures:
            drawn(name, laboratory, order.kind, watch)
        if CLAIMS in order.targets:
            findings = audit(laboratory)
            watch.part()
    if findings is not None:
        watch.file(DATA, to_json(_claims(order, findings)).encode())
    return findings


class _ReportProgress(ProgressDisplay):
    """Receives results of other threads; writes and shows them in the main thread."""

    def __init__(self, folder: Path | None) -> None:
        super().__init__()
        self.total = 1
        self.written: list[Path] = []
        self._folder = folder
        self._lock = threading.Lock()
        self._parts = self._runs = 0
        self._files: queue.SimpleQueue[tuple[str, bytes]] = queue.SimpleQueue()

    def run(self) -> None:
        """Count a completed run."""
        self._add(runs=1)

    def part(self) -> None:
        """Count a completed part."""
        self._add(parts=1)

    def _add(self, *, parts: int = 0, runs: int = 0) -> None:
        with self._lock:
            self._parts += parts
            self._runs += runs
            words = f"{self._parts} of {self.total} parts, {self._runs} runs"
            self.hear(Stage(self._parts, self.total, words=words))

    def file(self, name: str, content: bytes) -> None:
        """Receive a complete file; it is discarded if there is no folder."""
        if self._folder is not None:
            self._files.put((name, content))

    def show(self) -> None:
        """Write complete files, and show new progress."""
        while self._folder is not None and not self._files.empty():
            name, content = self._files.get()
            write(self._folder / name, content)
            self.written.append(self._folder / name)
        super().show()


@contextlib.contextmanager
def _folder(path: Path | None) -> Iterator[None]:
    """Inside, the folder exists; afterwards it is removed if it was created and is empty.

    Raises ``InputError`` that names the option and a remedy.
    """
    if path is None:
        yield
        return
    if path.suffix.lower() in (".html", *(f".{kind}" for kind in KINDS)) and not path.is_dir():
        raise InputError(
            f"--out {path}: names a file, must be a folder; the names of the files are fixed."
            f" For example --out {FOLDER}; --format sets the kind of the figures."
        )
    new = not path.exists()
    if new:
        check_folder("--out", path, path.parent)
        path.mkdir()
    try:
        check_folder("--out", path, path)
        yield
    finally:
        if new:
            with contextlib.suppress(OSError):  # not empty
                path.rmdir()


def _what_is_kept(written: Sequence[Path]) -> str:
    if not written:
        return "No new file was written."
    files = f"{len(written)} files" if len(written) > 1 else "1 file"
    return f"{written[0].parent} contains {files}, complete."


def _listing() -> str:
    width = max(map(len, (*FIGURES, *OTHERS))) + 2

    def listed(name: str, words: str) -> str:
        return _filled(f"  {name:{width}}{words}", width + 2, _WIDTH, _WIDTH)

    lines = ["Figures of Chen and Xi (2014) that can be computed:"]
    lines += [listed(name, figure.caption) for name, figure in FIGURES.items()]
    lines += ["", "And:", *(listed(name, words) for name, words in OTHERS.items())]
    lines += ["", "For example: wedgebrake paper fig8, or: wedgebrake paper all --out paper"]
    return "\n".join(lines)


def _text(report: dict[str, Any], findings: Sequence[Finding] | None) -> str:
    lines = []
    if findings is not None:
        found = ", ".join(f"{number} {verdict}" for verdict, number in report["counts"].items())
        lines += [*map(_line, findings), "", f"{len(findings)} statements: {found}."]
        lines.append("Each number found: --json, or paper all.")
    files = {Path(path).name: path for path in report["files"]}
    data, page = files.pop(DATA, None), files.pop(REPORT, None)
    if page is not None:
        lines.append(f"{len(files)} figures and {DATA}: {Path(page).parent}")
        return "\n".join([*lines, f"Report: {page}"])
    lines += [f"Figure: {path}" for path in files.values()]
    return "\n".join([*lines, f"Data: {data}"] if data else lines)


def _line(finding: Finding) -> str:
    one = finding.statement
    figure = f"Fig. {one.figure}" if one.figure[:1].isdigit() else ""
    held = score(finding.parts).partition(",")[0]
    start = f"{one.name:<{_INDENT}}{figure:<10}{finding.verdict.value:<37}{held:<10}"
    needed = f" Correction: {finding.needed}." if finding.needed else ""
    return _filled(start + one.says + needed, _INDENT, _LINE)


def _filled(text: str, indent: int, usual: int, most: int = 10_000) -> str:
    """Text in lines as wide as the terminal, with an indent of further lines [columns]."""
    width = max(min(shutil.get_terminal_size((usual, 1)).columns, most), _LEAST)
    return textwrap.fill(text, width, subsequent_indent=" " * indent, break_on_hyphens=False)


def _report(
    order: Order, written: list[Path], findings: Sequence[Finding] | None, seconds: float
) -> dict[str, Any]:
    tested = {} if findings is None else _claims(order, findings)
    files = [str(path.resolve()) for path in written]
    return {
        **versions(),
        "method": order.method,
        "files": files,
        "report": next((path for path in files if Path(path).name == REPORT), None),
        "counts": tested.get("counts"),
        "findings": tested.get("findings"),
        "seconds": seconds,
    }


def _claims(order: Order, findings: Sequence[Finding]) -> dict[str, Any]:
    return {
        **versions(),
        "method": METHOD_WORDS[order.method],
        "as_printed": AS_PRINTED.words(),
        "corrected": CORRECTED.words(),
        "counts": {verdict.value: number for verdict, number in counts(findings).items()},
        "findings": [finding.as_dict() for finding in findings],
    }
