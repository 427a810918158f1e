"""The commands ``simulate`` and ``stability``."""

from __future__ import annotations

import math
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from wedgebrake.analysis.linear_stability import stability_limits
from wedgebrake.cli.assignments import parse_number, parse_speeds
from wedgebrake.cli.output import Output
from wedgebrake.cli.overrides import load_for, named_as_in_study
from wedgebrake.cli.stability_report import stability_report
from wedgebrake.errors import InputError
from wedgebrake.model.display import counted

if TYPE_CHECKING:
    import xarray as xr

# Largest number of violations listed one by one.
_MOST_VIOLATIONS = 20


def simulate(
    path: Path,
    changes: list[str] | None,
    given: Mapping[str, Any],
    shown: tuple[str | None, str | None],
    checked: bool,
    output: Output,
) -> None:
    """Simulate, and report; exit with status 1 if a limit stopped the run or a law is violated.

    given   : --method and --samples
    shown   : --from and --to
    checked : --check
    """
    from wedgebrake.cli.compilation import announce_compilation
    from wedgebrake.cli.response_report import response_report, response_text
    from wedgebrake.solvers.interrupts import interruptible
    from wedgebrake.solvers.simulate import simulate as response_of

    output.check()
    drawn = _window(shown, output)
    study = load_for("simulate", path, changes, **given)
    system, arguments = study.system, study.arguments()

    def work() -> tuple[xr.Dataset, dict[str, Any]]:
        with named_as_in_study(system), announce_compilation():
            response = response_of(system, **arguments)
            report = response_report(system, response)
            if checked:
                report["check"] = _examined(response)
            return response, report

    response, report = interruptible(work)
    if "steady_from" in report:
        drawn["verdict"] = report["summary"]
    output.finish(
        report,
        lambda: "\n".join([response_text(system, report), *_check_lines(report)]),
        response,
        lambda: (response, drawn),
    )
    violated = checked and report["check"]["violations"]
    if violated or report["status"] in ("event_limit", "step_limit"):
        sys.exit(1)


def _examined(response: xr.Dataset) -> dict[str, Any]:
    """The entry "check" of a report."""
    from wedgebrake.analysis.responses.check import examine

    found = examine(response)
    return {**found._asdict(), "violations": [one._asdict() for one in found.violations]}


def _check_lines(report: dict[str, Any]) -> list[str]:
    """The entry "check" of a report as text, if there is one."""
    if "check" not in report:
        return []
    found, wrong = report["check"], report["check"]["violations"]
    where = f"at {counted(found['events'], 'event')} and {counted(found['samples'], 'sample')}"
    balance = f"energy residual {found['residual']:.2g} J of {found['exchanged']:.4g} J exchanged"
    if math.isnan(found["residual"]):
        balance = "no energy balance, which needs a whole period of the torque and more samples"
    held = f"{counted(len(wrong), 'violation')} of the laws" if wrong else "all laws hold"
    lines = [f"  check: {held} {where}; {balance}"]
    lines += [
        f"    t = {one['time']:.9g} s: {one['contact'] or 'whole system'}, {one['law']}:"
        f" found {one['found']:.6g}, allowed {one['allowed']:.6g}"
        for one in wrong[:_MOST_VIOLATIONS]
    ]
    more = len(wrong) - _MOST_VIOLATIONS
    return [*lines, f"    ... and {more} more; --json lists all"] if more > 0 else lines


def _window(shown: tuple[str | None, str | None], output: Output) -> dict[str, Any]:
    """Options of ``wb.plot`` for --from and --to."""
    found: dict[str, Any] = {}
    for option, name, text in zip(("--from", "--to"), ("start", "stop"), shown, strict=True):
        if text is not None and output.picture is None:
            raise InputError(f"{option}: applies to the picture. Give --plot too.")
        if text is not None:
            found[name] = parse_number(option, text, "s")
    return found


def stability(
    path: Path,
    changes: list[str] | None,
    speeds: str | None,
    sticking: list[str] | None,
    method: str,
    output: Output,
) -> None:
    """Evaluate linear stability, print the result, and draw it over the speed."""
    output.check()
    if speeds is not None and output.picture is None:
        raise InputError("--speeds: applies to the picture. Give --plot too.")
    values = None if speeds is None else parse_speeds(speeds)
    system = load_for("stability", path, changes).system
    report, text = stability_report(system, sticking, method)
    limits = None
    if output.picture is not None:  # its errors come before anything is printed
        limits = stability_limits(system, values, sticking, method=report["method"])
    if output.picture is not None:
        report["files"] = {"picture": None}
    output.finish(report, lambda: text, None, lambda: (limits, {}))
