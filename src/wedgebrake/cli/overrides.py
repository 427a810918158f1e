"""The study of a command: its file, changed by ``--set``, ``--method`` and other options."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from wedgebrake.cli.assignments import parse_axes, parse_changes
from wedgebrake.cli.streams import say
from wedgebrake.errors import InputError, nearest
from wedgebrake.model.machine import Machine
from wedgebrake.model.part import given
from wedgebrake.model.signals.signals import check_repeat
from wedgebrake.model.studies.study import METHODS, Study, load_study
from wedgebrake.model.studies.study_run import RunSettings
from wedgebrake.model.studies.sweep_settings import SWEEP_SETTINGS, Sweep
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.model.system_base import own_names
from wedgebrake.model.validation import as_typed, unusual, wrong

_RUN = set(RunSettings.model_fields)
_OF_SWEEPS = set(SWEEP_SETTINGS) - _RUN
_OF_ORBITS = {"initial", "method", "rtol", "max_events", "max_steps", "start_time"}
# Settings that each command uses.
_USED: dict[str, set[str]] = {
    "simulate": _RUN,
    "stability": set(),
    "sweep": _OF_ORBITS | _OF_SWEEPS,
    "continue": _OF_ORBITS,
    "response": {"method", "rtol", "start_time"},
}
# What to give instead of a setting that a command does not use.
_LENGTH = ("periods", "duration", "until", "samples", "samples_per_period")
_INSTEAD: dict[str, dict[str, str]] = {
    "sweep": dict.fromkeys(
        _LENGTH, "Give --periods, or --crossings where no signal varies in time."
    ),
    "continue": {
        **dict.fromkeys(_LENGTH, "The length of an orbit is set by --order. Leave it out."),
        "step": "Give --step, the largest step along a branch.",
    },
}
_INSTEAD["response"] = _INSTEAD["continue"]


def settings_of(study: Study, command: str) -> dict[str, Any]:
    """The settings of [run] that a command uses, except the start time, which is 0."""
    used = _USED[command] - {"start_time"}
    return {name: value for name, value in given(study.run).items() if name in used}


def refuse_unused(study: Study, names: Iterable[str], what: str) -> None:
    """Refuse settings of [run] without effect.

    what : on which they have none, in words

    Raises ``InputError`` that names the setting.
    """
    run = study.run
    for name in names:
        if name in given(run):
            raise InputError(
                f"run.{name} = {getattr(run, name)!r}: has no effect on {what}. Leave it out.",
                name=f"run.{name}", value=getattr(run, name), allowed="left out",
            )  # fmt: skip


def check_repeats(study: Study, why: str) -> None:
    """Refuse signals that neither repeat nor are constant.

    why : the reason, a clause

    Raises ``InputError`` that names all of them.
    """
    signals = study.system.signals()
    try:
        check_repeat(signals)
    except InputError as error:
        refused = [name for name, one in signals.items() if one.frequencies() is None]
        known = study.system.names()
        words = {one: one.rpartition(".")[2] for one in refused}
        names = [word if word in known else one for one, word in words.items()]
        options = [f"--set {name}=NUMBER" for name in names if name != "excitation"]
        constant = f"Make constant with {' '.join(options)}, or edit" if options else "Edit"
        raise InputError(
            f"{', '.join(refused)}: must be {error.allowed}, as {why}. {constant} a copy of the"
            " study file; simulate accepts all signals.",
            name=error.name, value=error.value, allowed=error.allowed,
        ) from None  # fmt: skip


def load_for(
    command: str,
    path: Path,
    changes: Iterable[str] | None,
    method: str | None = None,
    samples: int | None = None,
) -> Study:
    """Read the study file of a command, and apply ``--set``, ``--method`` and ``--samples``.

    Raises ``InputError``, also for settings that the command does not use.
    """
    given = {"samples": samples}
    study = _changed(command, load_study(path), changes, method, given)
    if samples is None:
        return study
    try:
        return study.changed(**given)
    except InputError as error:
        raise in_options(error, ("samples",), "run.") from None


def _changed(
    command: str,
    study: Study,
    changes: Iterable[str] | None,
    method: str | None,
    options: Mapping[str, Any],
) -> Study:
    """Apply ``--set`` and ``--method``.

    options : options of the command, whose names must not be set as well
    """
    wanted = parse_changes(changes or (), study.system)
    if method is not None:
        if method not in METHODS:
            raise InputError(f"--method {method}: not known. {nearest(method, METHODS)}")
        if "method" in wanted:
            raise InputError("--method and --set method: both given. Give one of them.")
    instead_of = _INSTEAD.get(command, {})
    for name in wanted:
        if name in ((_RUN | _OF_SWEEPS) - _USED[command]) | instead_of.keys():
            instead = instead_of.get(name, "Leave it out.")
            raise InputError(f"--set {name}: has no effect on {command}. {instead}")
        if options.get(name) is not None:
            raise InputError(f"--{name} and --set {name}: both given. Give one of them.")
    try:
        for name in wanted:
            study.check_name(name, _USED[command])
        study = study.changed(**wanted)
    except InputError as error:
        raise InputError(f"--set: {error}") from None
    try:
        study = study if method is None else study.changed(method=method)
    except InputError as error:
        raise InputError(f"--method: {error}") from None
    for sentence in unusual(study.system.machine.parameters()):
        say(f"warning: {sentence}")
    if command in ("sweep", "continue", "response") and study.run.start_time != 0.0:
        raise wrong(
            "run.start_time", study.run.start_time, "0, where sweeps and orbits start",
            "Set it with --set start_time=0.",
        )  # fmt: skip
    return study


def load_for_sweep(
    path: Path,
    changes: Iterable[str] | None,
    method: str | None,
    over: list[str] | None,
    options: Mapping[str, Any],
) -> Study:
    """As ``load_for``, with the axes of ``--over`` and the other options of a sweep in its [sweep].

    options : transient, periods, crossings and follow, if given
    """
    study = _changed("sweep", load_study(path), changes, method, options)
    settings = {name: value for name, value in options.items() if value is not None}
    if settings.get("transient", "auto") != "auto":
        try:
            settings["transient"] = int(settings["transient"])
        except ValueError:
            raise InputError(
                f"--transient {as_typed(settings['transient'])}: must be a whole number of"
                " periods or crossings, or auto."
            ) from None
    axes = parse_axes(over, study.system) if over else study.sweep.axes
    try:
        return study.changed(sweep=Sweep(**{**study.sweep.arguments(), **settings}, axes=axes))
    except InputError as error:
        raise in_options(error, options, "sweep.") from None


@contextmanager
def named_as_in_study(system: BrakedDriveline | Machine) -> Iterator[None]:
    """Rewrite errors of a computation with the names that ``--set`` takes for a system."""
    try:
        with own_names(system):
            yield
    except InputError as error:
        name = error.name or ""
        if name not in system.names():
            name = name.rpartition(".")[2]
        if not (name and isinstance(error.allowed, str) and error.allowed.startswith("None")):
            raise
        raise InputError(
            f"{error} Unset it with --set {name}=none.",
            name=error.name, value=error.value, allowed=error.allowed,
        ) from None  # fmt: skip


def in_options(error: InputError, names: Collection[str], table: str = "") -> InputError:
    """The error of an argument, as one of the option with its name.

    names : of the arguments that are options
    table : what stands before a name in the error
    """

    def name_of(name: str) -> str:
        own = name.removeprefix(table)
        return f"--{own.replace('_', '-')}" if own in names else name

    return error.renamed(name_of, " ")
