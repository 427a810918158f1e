"""Implementation of ``wedgebrake fit``: parameters of a study from measurements."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from wedgebrake.cli.assignments import parse_number
from wedgebrake.cli.output import Output, check_target, describe, header
from wedgebrake.cli.overrides import in_options, load_for
from wedgebrake.errors import InputError
from wedgebrake.model.studies.study import Study, save_study

if TYPE_CHECKING:
    from wedgebrake.analysis.fitting.fit import Fit
    from wedgebrake.model.machine import Machine
    from wedgebrake.model.system import BrakedDriveline

_OPTIONS = (
    "free", "observe", "measured", "window", "time", "sigma", "loss", "loss_scale", "segments",
    "start",
)  # fmt: skip


def fit(
    path: Path,
    trace: Path | None,
    changes: list[str] | None,
    given: dict[str, Any],
    save: Path | None,
    output: Output,
) -> None:
    """Fit, print the values and write the files.

    given : --free, --observe, --measured, --window, --sigma, --time, --loss, --segments, --start and
            --method
    save  : --save, the study with the fitted values
    """
    from wedgebrake.analysis.fitting.fit import fit as fitted
    from wedgebrake.cli.compilation import announce_compilation
    from wedgebrake.solvers.interrupts import interruptible

    output.check()
    if save is not None:
        check_target("--save", save, (".toml",))
    study = load_for("simulate", path, changes, given["method"])
    arguments: dict[str, Any] = {
        "free": _limits(given["free"], study.system),
        "observe": _pairs("--observe", given["observe"], "COLUMN=QUANTITY"),
        "measured": _numbers(given["measured"], study.system),
        "window": _window(given["window"]), "sigma": _sigmas(given["sigma"]),
        "time": given["time"], "loss": given["loss"], "method": study.run.method,
        "segments": given["segments"], "start": given["start"],
    }  # fmt: skip
    if not study.system.holds_start:
        arguments["initial"] = study.run.initial

    def work() -> Fit:
        with announce_compilation():
            return fitted(study.system, trace, **arguments)

    try:
        found = interruptible(work)
    except InputError as error:
        raise in_options(error.renamed(_named, " "), _OPTIONS) from None
    files: dict[str, Any] = {"data": None, "picture": None}
    if save is not None:
        run = study.run
        if not study.system.holds_start:
            each = zip(study.system.initial_conditions, run.initial, strict=True)
            start = tuple(found.values.get(name, one) for name, one in each)
            run = run if start == run.initial else run.model_copy(update={"initial": start})
        save_study(Study(found.system, run, study.sweep), save)
        files["study"] = str(save)
    intervals = found.interval()
    report = {
        **header(found.system),
        "parameters": {
            name: {"value": value, "stderr": found.stderr[name], "interval": intervals[name]}
            for name, value in found.values.items()
        },
        "correlation": found.correlation.to_numpy(),
        "rms": found.rms, "measured": found.numbers, "undetermined": found.undetermined,
        "remarks": found.remarks,
        "start": found.start, "start_values": found.start_values,
        "converged": found.converged, "message": found.message, "files": files,
    }  # fmt: skip
    output.finish(
        report,
        lambda: "\n".join([describe(found.system), "", found.report()]),
        found.data,
        lambda: (found, {}),
    )


def _named(name: str) -> str:
    """``--free kinetic`` of the argument ``free['kinetic']``."""
    option, bracket, rest = name.partition("[")
    return f"--{option} {rest.strip(chr(39) + ']')}" if bracket and option in _OPTIONS else name


def _pairs(option: str, texts: list[str] | None, form: str) -> dict[str, str] | None:
    """Names and values on the two sides of the equals sign; None if no text is given."""
    if not texts:
        return None
    pairs = [text.partition("=") for text in texts]
    for name, sign, value in pairs:
        if not (name and sign and value):
            raise InputError(f"{option} {name}{sign}{value}: must have the form {form}.")
    return {name.strip(): value.strip() for name, _, value in pairs}


def _limits(texts: list[str], system: BrakedDriveline | Machine) -> dict[str, tuple[float, float]]:
    """Lower and upper limit of each free parameter."""
    quantities = system.quantities()

    def unit(name: str) -> str:
        return quantities[name].unit if name in quantities else "1"

    return {
        name: _two("--free", name, text, "LOW:HIGH", unit(name))
        for name, text in (_pairs("--free", texts, "NAME=LOW:HIGH") or {}).items()
    }


def _two(option: str, name: str, text: str, form: str, unit: str) -> tuple[float, float]:
    """Two numbers with a colon between them."""
    first, sign, second = text.partition(":")
    if not sign:
        raise InputError(
            f"{option} {name}={text}: must have the form NAME={form}, with two numbers."
        )
    return parse_number(option, first, unit), parse_number(option, second, unit)


def _numbers(
    texts: list[str] | None, system: BrakedDriveline | Machine
) -> dict[str, tuple[float, float]] | None:
    """Value and standard deviation of each measured number."""
    from wedgebrake.analysis.fitting.numbers import unit_of

    form = "VALUE:DEVIATION"
    pairs = _pairs("--measured", texts, f"NAME={form}")
    if pairs is None:
        return None
    try:
        units = {name: unit_of(system, name) for name in pairs}
    except InputError as error:
        raise in_options(error.renamed(_named, " "), _OPTIONS) from None
    return {name: _two("--measured", name, text, form, units[name]) for name, text in pairs.items()}


def _window(text: str | None) -> tuple[float, float] | None:
    """Start and end of the window of the numbers [s]."""
    if text is None:
        return None
    first, sign, last = text.partition(":")
    if not sign:
        raise InputError(f"--window {text}: must have the form START:END, such as 0.5:2.")
    return parse_number("--window", first, "s"), parse_number("--window", last, "s")


def _sigmas(texts: list[str] | None) -> dict[str, float] | None:
    pairs = _pairs("--sigma", texts, "COLUMN=NUMBER")
    if pairs is None:
        return None
    return {name: parse_number("--sigma", text, "1") for name, text in pairs.items()}
