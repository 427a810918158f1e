"""Implementation of ``wedgebrake scatter``: distributions, report and text."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from wedgebrake.cli.assignments import parse_limits
from wedgebrake.cli.compilation import announce_compilation
from wedgebrake.cli.interrupts import Interrupted
from wedgebrake.cli.output import Output, describe, header, of_option, with_unit
from wedgebrake.cli.overrides import in_options, settings_of
from wedgebrake.cli.progress import ProgressDisplay
from wedgebrake.cli.sweep_command import what_is_kept
from wedgebrake.cli.workers import Workers
from wedgebrake.errors import InputError, OutputError
from wedgebrake.figures.data.scatter import percent
from wedgebrake.model.studies.study import Study
from wedgebrake.model.studies.sweep_settings import sweepable, untied
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.model.validation import as_typed
from wedgebrake.sweeps.outcomes import MEANINGS, UNSTABLE
from wedgebrake.sweeps.results import PointStatus
from wedgebrake.sweeps.sampling import parse_distribution
from wedgebrake.sweeps.scatter import scatter

if TYPE_CHECKING:
    import xarray as xr

    from wedgebrake.model.machine import Machine

_FORM = (
    "NAME=FROM..TO or NAME=DISTRIBUTION(ARGUMENTS), for example slope=norm(-60,5) or"
    " kinetic=0.28..0.42"
)
_OPTIONS = ("samples", "seed", "transient", "periods", "crossings", "indices")


def parse_varied(texts: Iterable[str], system: BrakedDriveline | Machine) -> dict[str, Any]:
    """The frozen distributions of several ``--vary`` options by name."""
    found: dict[str, Any] = {}
    for text in texts:
        name, _, law = (part.strip() for part in text.partition("="))
        if not name or not law:
            raise InputError(f"--vary {as_typed(text)}: must be {_FORM}.")
        where = f"--vary {as_typed(text)}: "
        name = ",".join(untied(name))
        try:
            known = sweepable(system, [name])
        except InputError as error:
            raise InputError(f"--vary {error}") from None
        if name not in known:
            raise InputError(
                f"{where}{as_typed(name)} cannot be varied on this system."
                f" {system.hint(name, known)}"
            )
        if name in found:
            raise InputError(f"--vary {as_typed(name)}: given twice. Give it once.")
        found[name] = parse_distribution(where, law, known[name][0])
    if not found:
        raise InputError(f"no parameter varies. Give --vary {_FORM}.")
    return found


def run(
    study: Study,
    vary: Iterable[str],
    options: Mapping[str, Any],
    limits: Iterable[str],
    store: tuple[Path | None, bool],
    workers: Workers,
    output: Output,
) -> None:
    """Evaluate the samples of a study, write and print the results.

    options : arguments of ``wb.scatter``
    store   : its path, and whether it is resumed
    """
    path, resume = store
    varied = parse_varied(vary, study.system)
    if resume and path is None:
        raise InputError("--resume: needs --store, the store to continue.")
    arguments = {
        **settings_of(study, "sweep"), **study.sweep.arguments(), **options,
        "limits": parse_limits(limits), "store": path, "resume": resume,
    }  # fmt: skip
    arguments.pop("follow", None)
    watch = ProgressDisplay()
    try:
        with workers.started() as given, announce_compilation():
            arguments |= {"progress": watch.hear, **given}
            dataset = watch.wait(lambda: scatter(study.system, varied, **arguments))
    except Interrupted as interrupt:
        interrupt.add_note(what_is_kept(path, watch.last))
        raise
    except (InputError, OutputError) as error:
        named = of_option(error, "--store", path)
        if isinstance(named, InputError):
            options = {"outcomes": "--outcome", "limits": "--limit"}
            named = named.renamed(lambda name: options.get(name, name), " ")
            named = in_options(named, _OPTIONS)
        raise named from None
    report = scatter_report(study.system, dataset, list(vary))
    text = partial(scatter_text, study.system, report)
    output.finish(report, text, dataset, lambda: (dataset, {}), path)


def scatter_report(
    system: BrakedDriveline | Machine, dataset: xr.Dataset, varied: list[str]
) -> dict[str, Any]:
    """The data of ``scatter --json``."""
    status = dataset["status"].to_numpy()
    report: dict[str, Any] = {
        **header(system),
        "kind": "scatter",
        "method": dataset.attrs["method"],
        "varied": varied,
        "samples": dataset.sizes["sample"],
        "seed": dataset.attrs["seed"],
        "status": {
            one.name.lower(): int(np.count_nonzero(status == one))
            for one in PointStatus
            if np.any(status == one)
        },
        "probabilities": {
            str(name): {
                key: dataset[key].sel(outcome=name).item()
                for key in ("probability", "low", "high", "unknown")
            }
            for name in dataset["outcome"].to_numpy()
        },
        "quantiles": {
            str(name): {
                "unit": _unit(dataset, str(name)),
                "values": {
                    f"{level:g}": value
                    for level, value in zip(
                        dataset["quantile"].to_numpy().tolist(),
                        dataset["quantiles"].sel(quantity=name).to_numpy().tolist(),
                        strict=True,
                    )
                },
            }
            for name in dataset["quantity"].to_numpy()
        },
        "indices": None,
        "index_samples": None,
        "files": {"picture": None, "data": None, "store": None},
    }
    if "ST" in dataset:
        report["indices"] = {
            str(effect): {
                str(name): {
                    key: float(dataset[key].sel(effect=effect, parameter=name))
                    for key in ("S1", "S1_conf", "ST", "ST_conf")
                }
                for name in dataset["parameter"].to_numpy()
            }
            for effect in dataset["effect"].to_numpy()
        }
        report["index_samples"] = {
            str(effect): int(dataset["index_samples"].sel(effect=effect))
            for effect in dataset["effect"].to_numpy()
        }
    return report


def _unit(dataset: xr.Dataset, name: str) -> str:
    """Unit of a quantity, whose name may be followed by that of a part."""
    variable = name.split(" ")[0]
    return str(dataset[variable].attrs.get("units", "1"))


def scatter_text(system: BrakedDriveline | Machine, report: dict[str, Any]) -> str:
    """The report as text."""
    total = report["samples"]
    lines = [describe(system, ()), *(f"Varied: {one}" for one in report["varied"])]
    failed = total - report["status"].get("completed", 0)
    samples = f"Samples: {total}"
    if failed:
        others = ", ".join(
            f"{count} {name.replace('_', ' ')}"
            for name, count in report["status"].items()
            if name != "completed"
        )
        samples += f", not completed: {others}"
    lines += [samples, "", "Probabilities, with 95 % intervals:"]
    wide = max(map(len, report["probabilities"]))
    for name, one in report["probabilities"].items():
        interval = f"({percent(one['low'])} to {percent(one['high'])})"
        unknown = f", unknown in {one['unknown']} samples" if one["unknown"] else ""
        words = MEANINGS.get(name, "")
        if name in UNSTABLE and one["probability"] == 0.0:
            direction = name.removeprefix("unstable_")
            if f"growth_rate {direction}" not in report["quantiles"]:
                words = f"no sample slides {direction}"
        tail = f"  {words}" if words else ""
        lines.append(f"  {name:{wide}}  {percent(one['probability']):>8} {interval}{unknown}{tail}")
    lines += ["", "Quantiles:"]
    for name, one in report["quantiles"].items():
        values = ", ".join(
            f"{100.0 * float(level):g} %: {value:.5g}" for level, value in one["values"].items()
        )
        lines.append(f"  {name.replace('_', ' ')}: {values}{with_unit(one['unit'])}")
    if report["indices"]:
        lines += ["", "Sobol indices, total (and first-order), with 95 % intervals:"]
        for effect, parameters in report["indices"].items():
            shown = ", ".join(
                f"{name} {one['ST']:.3f} ± {one['ST_conf']:.3f}"
                f" ({one['S1']:.3f} ± {one['S1_conf']:.3f})"
                for name, one in parameters.items()
                if np.isfinite(one["ST_conf"])
            )
            varies = any(np.isfinite(one["ST"]) for one in parameters.values())
            none = "differs in too few samples" if varies else "does not vary"
            rows, of = report["index_samples"][effect], report["samples"] // 2
            left = f", from {rows} of {of} rows of the design" if rows < of else ""
            lines.append(f"  {effect.replace('_', ' ')}: {shown or none}{left}")
    return "\n".join(lines)
