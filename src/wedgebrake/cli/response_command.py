"""Implementation of ``wedgebrake response``: checks of options, computation, data and text."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from wedgebrake.cli.assignments import parse_levels, parse_range
from wedgebrake.cli.compilation import announce_compilation
from wedgebrake.cli.interrupts import Interrupted
from wedgebrake.cli.output import Output, describe, header, timed, with_unit
from wedgebrake.cli.overrides import check_repeats, in_options, named_as_in_study
from wedgebrake.cli.progress import ProgressDisplay, Stage
from wedgebrake.errors import InputError
from wedgebrake.model.display import counted
from wedgebrake.model.studies.study import Study
from wedgebrake.orbits.bifurcation_types import Kind, Scenario
from wedgebrake.orbits.branches.branch import Branch
from wedgebrake.orbits.ranges import Range
from wedgebrake.orbits.response_curve import response_curve

if TYPE_CHECKING:
    import xarray as xr

_OPTIONS = ("order", "switch", "step", "points", "folds", "samplings")


class ResponseRequest(NamedTuple):
    """Options of the command line.

    over, level : the parameter over which orbits are followed, and the levels, as text
    settings    : order, switch, step, points, folds and samplings, as for ``wb.response_curve``
    drawn       : quantity, inertia, contact and shaft of the picture
    """

    study: Study
    over: list[str] | None
    level: list[str] | None
    settings: dict[str, Any]
    drawn: dict[str, str | None]
    output: Output


def run(asked: ResponseRequest) -> None:
    """Check, follow the orbits of each level, write and print the results.

    Raises ``InputError`` that names the option and a remedy, ``Interrupted`` with a note, and
    as ``wb.response_curve``.
    """
    begin, system, settings = time.perf_counter(), asked.study.system, asked.study.run
    over = parse_range("--over", _single("--over", asked.over, "frequency=5:40"), system)
    level, values = parse_levels(
        "--level", _single("--level", asked.level, "amplitude=50,150,300"), system
    )
    if level == over.name:
        raise InputError(f"--level {level}: is that of --over. Give another parameter.")
    if asked.settings["folds"] and len(values) < 2:
        raise InputError(
            "--folds: needs two levels or more. Give more at --level, or leave it out."
        )
    check_repeats(asked.study, "an orbit closes after a period of all signals")
    watch = ProgressDisplay()
    count = 0

    def tell(branch: Branch) -> None:
        nonlocal count
        count += 1
        last = branch.points[-1]
        words = f"{count} orbits, {level} = {last.system.value(level):g}"
        watch.hear(Stage(0, 100, words=f"{words}, {over.name} = {last.value:.6g}"))

    try:
        with named_as_in_study(system), announce_compilation() as announced:
            dataset = watch.wait(
                lambda: response_curve(
                    system, {over.name: (over.first, over.last)}, levels={level: values},
                    method=settings.method, rtol=getattr(settings, "rtol", 1e-10),
                    progress=tell, **asked.settings,
                )
            )  # fmt: skip
    except Interrupted as interrupt:
        interrupt.add_note("Nothing is kept.")
        raise
    except InputError as error:
        raise in_options(error, _OPTIONS) from None
    speed = {"seconds": time.perf_counter() - begin, "with_compilation": bool(announced)}
    report = _report(asked, dataset, over, level, values) | {
        "speed": {"points": int(dataset.sizes["point"]), **speed},
        "files": {"picture": None, "data": None},
    }
    drawn = {name: value for name, value in asked.drawn.items() if value is not None}
    asked.output.finish(
        report, lambda: _text(asked.study, report), dataset, lambda: (dataset, drawn)
    )


def _single(option: str, texts: list[str] | None, example: str) -> str:
    """The text of an option that must be given once."""
    if texts is None or len(texts) != 1:
        many = f"given {len(texts)} times" if texts else "not given"
        raise InputError(f"{option}: {many}, must be given once, for example {option} {example}.")
    return texts[0]


def _report(
    asked: ResponseRequest, dataset: xr.Dataset, over: Range, level: str, values: list[float]
) -> dict[str, Any]:
    """The data of ``response --json``, without speed and files."""
    notes = dict(zip(values, [""] * len(values), strict=True))
    for line in dataset.attrs["note"].splitlines():
        where, _, why = line.partition(": ")
        value = next(one for one in values if where == f"{level} = {one:g}")
        notes[value] = why
    about = dataset[dataset.attrs["level"]].attrs
    return {
        **header(asked.study.system),
        "kind": dataset.attrs["kind"],
        "method": dataset.attrs["method"],
        "parameter": {"name": over.name, "unit": over.unit, "meaning": over.meaning},
        "range": [over.first, over.last],
        "level": {"name": level, "unit": about["units"], "meaning": about["long_name"]},
        "phase_reference": dataset.attrs["phase_reference"],
        "settings": asked.settings,
        "levels": [_of_level(dataset, value, notes[value]) for value in values],
        "curves_of_folds": _curves(dataset),
    }


def _of_level(dataset: xr.Dataset, value: float, note: str) -> dict[str, Any]:
    """Where the amplitude of a level is largest, and its folds and other bifurcations."""
    found: dict[str, Any] = {"value": value, "note": note, "points": 0}
    own = np.flatnonzero(dataset[dataset.attrs["level"]].to_numpy() == value)
    if not own.size:
        return found
    points = dataset.isel(point=own)
    sizes, phases = (
        points[name].to_numpy().reshape(own.size, -1) for name in ("angle_amplitude", "angle_phase")
    )
    place, part = (int(one) for one in np.unravel_index(np.argmax(sizes), sizes.shape))
    at = dataset["bifurcation_level"].to_numpy() == value
    columns = [
        dataset[f"bifurcation_{name}"].to_numpy()[at].tolist()
        for name in ("kind", "scenario", "value", "sentence")
    ]
    return found | {
        "points": int(own.size),
        "largest": {
            "at": float(points[dataset.attrs["parameter"]][place]),
            "inertia": _part(dataset, "inertia", part),
            "angle_amplitude": float(sizes[place, part]),
            "angle_phase": float(phases[place, part]),
            "stable": bool(points["stable"][place]),
        },
        "bifurcations": [
            {
                "kind": kind, "value": where, "sentence": sentence,
                "fold": kind == Kind.FOLD.value or scenario == Scenario.FOLD.value,
            }
            for kind, scenario, where, sentence in zip(*columns, strict=True)
        ],
    }  # fmt: skip


def _part(dataset: xr.Dataset, dim: str, place: int) -> str | None:
    """Name of a part; None where there is a single one without a name."""
    return str(dataset[dim].to_numpy()[place]) if dim in dataset.dims else None


def _curves(dataset: xr.Dataset) -> list[dict[str, Any]] | None:
    """The curves of folds; None if they were not followed or there are none."""
    if "fold_point" not in dataset.dims:
        return None
    number = dataset["fold_curve"].to_numpy()
    return [
        {
            "values": dataset["fold_value"].to_numpy()[number == one],
            "levels": dataset["fold_level"].to_numpy()[number == one],
        }
        for one in np.unique(number)
    ]


def _text(study: Study, report: dict[str, Any]) -> str:
    """The report as text."""
    parameter, level = report["parameter"], report["level"]
    name, unit = parameter["name"], with_unit(parameter["unit"])
    first, last = report["range"]
    followed = f"Followed: {name} from {first:.6g} to {last:.6g}{unit} ({parameter['meaning']})"
    lines = [
        "Largest amplitudes (half the range of an angle):",
        *_levels(report),
        "",
        describe(study.system, [name, level["name"]]),
        f"{followed}; method {report['method']}",
        f"Phases refer to the {report['phase_reference']}.",
    ]
    count = report["settings"]["samplings"]
    if count is not None:
        lines.append(f"The sampling interval follows the period, with {count} samplings in each.")
    curves = report["curves_of_folds"]
    if report["settings"]["folds"] and curves is None:
        lines.append("Folds: none")
    for number, one in enumerate(curves or ()):
        spans = [
            f"{word} = {np.min(values):.6g} ... {np.max(values):.6g}"
            for word, values in ((level["name"], one["levels"]), (name, one["values"]))
        ]
        lines.append(f"Curve of folds {number + 1}: {', '.join(spans)}")
    speed = report["speed"]
    return "\n".join([*lines, "", timed(counted(speed["points"], "orbit"), speed)])


def _levels(report: dict[str, Any]) -> list[str]:
    """A line for each level, and its folds and other bifurcations."""
    level, name = report["level"], report["parameter"]["name"]
    unit, lines = with_unit(report["parameter"]["unit"]), []
    for one in report["levels"]:
        where = f"  {level['name']} = {one['value']:g}{with_unit(level['unit'])}:"
        if not one["points"]:
            lines.append(f"{where} no orbit. {one['note']}")
            continue
        most = one["largest"]
        whose = f" of {most['inertia']}" if most["inertia"] else ""
        lines.append(
            f"{where} {most['angle_amplitude']:.4g} rad{whose} at {name} = {most['at']:.6g}{unit},"
            f" {'stable' if most['stable'] else 'unstable'}"
        )
        folds = [found for found in one["bifurcations"] if found["fold"]]
        if folds:
            values = ", ".join(f"{found['value']:.6g}" for found in folds)
            lines.append(f"      folds at {name} = {values}{unit}")
        others = [found for found in one["bifurcations"] if not found["fold"]]
        kinds = list(dict.fromkeys(found["kind"] for found in others))
        for kind in kinds:
            values = ", ".join(f"{one['value']:.6g}" for one in others if one["kind"] == kind)
            lines.append(f"      {kind} at {values}{unit}")
    return lines
