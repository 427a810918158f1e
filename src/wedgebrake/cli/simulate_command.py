"""The commands ``simulate`` and ``stability``."""

from __future__ import annotations

import sys
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from wedgebrake.analysis.linear_stability import stability_limits
from wedgebrake.cli.assignments import parse_speeds
from wedgebrake.cli.output import Output
from wedgebrake.cli.overrides import load_for
from wedgebrake.model.study import Study

if TYPE_CHECKING:
    import xarray as xr


def _reports(study: Study) -> Any:
    """The module that reports on the system of a study; the other one is not imported."""
    return import_module(f"wedgebrake.cli.{'machine' if study.of_machine else 'driveline'}_report")


def simulate(path: Path, changes: list[str] | None, method: str | None, output: Output) -> None:
    """Simulate, and report; exit with status 1 if a limit stopped the run."""
    from wedgebrake.cli.interrupts import announce_compilation
    from wedgebrake.solvers.interrupts import interruptible
    from wedgebrake.solvers.simulate import simulate as response_of

    output.check()
    study = load_for("simulate", path, changes, method)
    system, reports = study.system, _reports(study)

    def work() -> tuple[xr.Dataset, dict[str, Any]]:
        with announce_compilation():
            response = response_of(system, **study.run.arguments())
            return response, reports.response_report(system, response)

    response, report = interruptible(work)
    output.finish(
        report,
        lambda: reports.response_text(system, report),
        response,
        lambda: (response, {} if study.of_machine else {"verdict": report["summary"]}),
    )
    if report["status"] in ("event_limit", "step_limit"):
        sys.exit(1)


def stability(path: Path, changes: list[str] | None, speeds: str | None, output: Output) -> None:
    """Evaluate linear stability, print the result, and draw it over the speed."""
    output.check()
    values = None if speeds is None else parse_speeds(speeds)
    study = load_for("stability", path, changes)
    report, text = _reports(study).stability_report(study.system)
    if output.picture is not None:
        report["files"] = {"picture": None}
    output.finish(report, lambda: text, None, lambda: (stability_limits(study.system, values), {}))
