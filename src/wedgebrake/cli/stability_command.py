"""The command ``stability``: verdict, limits at the machine's speed, and a plot over the speed."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from wedgebrake.analysis.linear_stability import limits_of, stability, stability_limits
from wedgebrake.cli.assignments import parse_speeds
from wedgebrake.cli.output import check_files, finish
from wedgebrake.cli.overrides import load_any
from wedgebrake.cli.report import stability_report, stability_text
from wedgebrake.model.machine import Machine

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def run(
    study: Path,
    changes: list[str] | None,
    speeds: str | None,
    plot: Path | None,
    as_json: bool,
) -> None:
    """Evaluate linear stability, print the result, and draw it over the speed."""
    check_files(None, plot)
    values = None if speeds is None else parse_speeds(speeds)
    system: Any = load_any(study, changes).system
    found: Any = stability(system)
    if isinstance(system, Machine):
        from wedgebrake.cli.machine_report import (
            machine_stability_report,
            machine_stability_text,
        )

        limits = limits_of(system)
        report = machine_stability_report(system, found, limits)

        def text() -> str:
            return machine_stability_text(system, found, limits)
    else:
        report = stability_report(system, found)

        def text() -> str:
            return stability_text(system, found)

    def picture() -> Figure:
        from wedgebrake.figures.matplotlib.speed_limits import stability_limits as draw

        return draw(stability_limits(system, values))

    if plot is not None:
        report["files"] = {"picture": None}
    finish(as_json, report, text, data=(None, None), picture=(plot, picture))
