"""Implementation of ``wedgebrake margin``: the values for which a criterion holds."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from wedgebrake.cli.assignments import parse_axes, parse_ends
from wedgebrake.cli.compilation import announce_compilation
from wedgebrake.cli.output import describe, header, put
from wedgebrake.cli.overrides import in_options, settings_of
from wedgebrake.cli.scatter_command import parse_varied
from wedgebrake.errors import InputError
from wedgebrake.model.machine import Machine
from wedgebrake.model.studies.study import Study
from wedgebrake.model.studies.sweep_settings import expanded
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.solvers.interrupts import interruptible
from wedgebrake.sweeps.margin import margin

_OPTIONS = ("criterion", "quantile", "samples", "seed", "points", "transient", "periods")


def run(
    study: Study,
    parameter: str,
    over: Iterable[str],
    vary: Iterable[str],
    options: Mapping[str, Any],
    *,
    as_json: bool,
) -> None:
    """Find the margin of a study, and print it.

    parameter : NAME=FROM:TO
    options   : arguments of ``wb.margin``
    """
    system = study.system
    name, between = parse_ends("--parameter", parameter, system)
    varied = {**settings_of(study, "sweep"), **study.sweep.arguments(), **options}
    varied.pop("follow", None)
    axes = _axes(over, system)
    laws = parse_varied(vary, system) if vary else None
    try:
        with announce_compilation():
            found = interruptible(
                lambda: margin(
                    system, name, between=between, over=axes or None, scatter=laws, **varied
                )
            )
    except InputError as error:
        raise in_options(error, _OPTIONS) from None
    report = {**header(system), "kind": "margin", **found.as_dict()}
    put(as_json, report, lambda: f"{describe(system, (name,))}\n\n{found.verdict}")


def _axes(over: Iterable[str], system: BrakedDriveline | Machine) -> dict[str, Any]:
    """Values of other parameters, and ranges FROM:TO, as ``wb.margin`` takes them."""
    texts = list(over)
    ranges = [one for one in texts if one.partition("=")[2].count(":") == 1]
    values = parse_axes([one for one in texts if one not in ranges], system)
    spans = [parse_ends("--over", one, system) for one in ranges]
    return {name: expanded(one) for name, one in values} | dict(spans)
