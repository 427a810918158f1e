"""Implementation of ``wedgebrake rare-event``: a small probability of an outcome."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from wedgebrake.cli.compilation import announce_compilation
from wedgebrake.cli.output import describe, header, put, with_unit
from wedgebrake.cli.overrides import in_options, settings_of
from wedgebrake.cli.scatter_command import parse_varied
from wedgebrake.cli.workers import Workers
from wedgebrake.errors import InputError
from wedgebrake.model.display import counted
from wedgebrake.model.studies.study import Study
from wedgebrake.model.studies.sweep_settings import sweepable
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.solvers.interrupts import interruptible
from wedgebrake.sweeps.outcomes import MEANINGS
from wedgebrake.sweeps.rare_event import rare_event

if TYPE_CHECKING:
    import xarray as xr

    from wedgebrake.model.machine import Machine

_OPTIONS = ("outcome", "runs", "seed", "transient", "periods", "crossings")
_VALUES = ("probability", "standard_error", "low", "high", "lines", "runs", "unknown")


def run(
    study: Study,
    vary: Iterable[str],
    options: Mapping[str, Any],
    workers: Workers,
    *,
    as_json: bool,
) -> None:
    """Estimate the probability of an outcome of a study, and print it.

    options : arguments of ``wb.rare_event``
    """
    system = study.system
    laws = parse_varied(vary, system)
    arguments = {**settings_of(study, "sweep"), **study.sweep.arguments(), **options}
    arguments.pop("follow", None)
    try:
        with workers.started() as given, announce_compilation():
            found = interruptible(lambda: rare_event(system, laws, **arguments, **given))
    except InputError as error:
        raise in_options(error, _OPTIONS) from None
    report = rare_event_report(system, found, list(vary))
    put(as_json, report, lambda: rare_event_text(system, report))


def rare_event_report(
    system: BrakedDriveline | Machine, dataset: xr.Dataset, varied: list[str]
) -> dict[str, Any]:
    """The data of ``rare-event --json``."""
    names = dataset["parameter"].to_numpy().tolist()
    units = sweepable(system, names)
    return {
        **header(system),
        "kind": "rare_event",
        "outcome": dataset.attrs["outcome"],
        "varied": varied,
        "seed": dataset.attrs["seed"],
        **{name: dataset[name].item() for name in _VALUES},
        "design_point": {
            name: {"value": value, "unit": units[name][0]}
            for name, value in zip(names, dataset["design_point"].to_numpy().tolist(), strict=True)
        },
    }


def rare_event_text(system: BrakedDriveline | Machine, report: dict[str, Any]) -> str:
    """The report as text."""
    name, runs = report["outcome"], counted(report["runs"], "sample")
    lines = [describe(system, ()), *(f"Varied: {one}" for one in report["varied"]), ""]
    meaning = f" ({MEANINGS[name]})" if name in MEANINGS else ""
    if report["probability"] == 0.0:
        lines.append(
            f"Probability of {name}{meaning}: 0. No occurrence was found within 8 standard"
            f" deviations, in {runs}."
        )
        return "\n".join(lines)
    if np.isnan(report["probability"]):
        lines.append(
            f"Probability of {name}{meaning}: not determined. It occurs in samples, but on none of"
            f" {counted(report['lines'], 'line')}. Increase --runs, or use scatter."
        )
        return "\n".join(lines)
    complete = np.isfinite(report["high"])
    high = f"{report['high']:.4g}" if complete else "an upper end that is not determined"
    between = f"{report['low']:.4g} to {high}"
    lines += [
        f"Probability of {name}{meaning}: {report['probability']:.4g}",
        f"95 % interval: {between}, from {counted(report['lines'], 'line')} and {runs}",
    ]
    if not complete:
        lines.append(
            "It also occurs outside the regions that were examined: the probability can be much"
            f" larger than {report['probability']:.4g}. Increase --runs."
        )
    if report["unknown"]:
        lines.append(
            f"Unknown in {counted(report['unknown'], 'sample')}, in which it is assumed to occur:"
            " invalid values, or a run that stopped early"
        )
    point = ", ".join(
        f"{one}: {law['value']:.5g}{with_unit(law['unit'])}"
        for one, law in report["design_point"].items()
        if np.isfinite(law["value"])
    )
    lines.append(f"Most probable values for which it occurs: {point}")
    return "\n".join(lines)
