"""The study of a command: its file, changed by ``--set``, ``--method`` and other options."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from wedgebrake.cli.assignments import parse_axes, parse_changes
from wedgebrake.errors import InputError, nearest
from wedgebrake.model.study import METHODS, Study, load_study
from wedgebrake.model.sweep_settings import Sweep
from wedgebrake.model.validation import as_typed

# Settings that a sweep and a continuation do not use, and their replacements.
NOT_SWEPT = {
    "periods": "belongs to simulate. For a sweep give --periods.",
    "duration": "belongs to simulate. For a sweep give --periods, in periods of the torque.",
    "samples_per_period": "belongs to simulate. A sweep samples once in each period. Leave it out.",
}
NOT_SWEPT_OF_MACHINES = {
    **dict.fromkeys(
        ("duration", "periods"), "belongs to simulate. For a sweep give --periods or --crossings."
    ),
    "until": "belongs to simulate. Leave it out.",
}
_OF_SWEEPS = dict.fromkeys(
    ("transient", "limit", "follow", "keep_points"), "belongs to sweep. Leave it out."
)
NOT_CONTINUED_OF_MACHINES = {
    **_OF_SWEEPS,
    **dict.fromkeys(
        ("duration", "periods", "until"),
        "belongs to simulate. An orbit lasts as many returns as --order says. Leave it out.",
    ),
}
NOT_CONTINUED = {
    **dict.fromkeys(
        ("periods", "duration", "samples_per_period"),
        "belongs to simulate. An orbit lasts as many periods as --order says. Leave it out.",
    ),
    **_OF_SWEEPS,
    "step": "belongs to the fixed step of simulate. Along a branch it is --step.",
}


def load_any(path: Path, changes: Iterable[str] | None, method: str | None = None) -> Study:
    """Read the study file of a driveline or of a machine, and apply ``--set`` and ``--method``.

    Raises ``InputError``, also for settings of sweeps.
    """
    return _changed(load_study(path), changes, method, _OF_SWEEPS, {})


def load_for_orbits(path: Path, changes: Iterable[str] | None, method: str | None) -> Study:
    """Like ``load_any``, but refuses settings that do not apply to orbits."""
    study = load_study(path)
    unused = NOT_CONTINUED_OF_MACHINES if study.of_machine else NOT_CONTINUED
    return _from_zero(_changed(study, changes, method, unused, {}))


def _changed(
    study: Study,
    changes: Iterable[str] | None,
    method: str | None,
    unused: Mapping[str, str],
    options: Mapping[str, Any],
) -> Study:
    """Apply ``--set`` and ``--method``.

    unused  : settings that the command does not use, and what to do instead
    options : options of the command, whose names must not be set as well
    """
    wanted = parse_changes(changes or (), study.system, unused)
    if method is not None:
        if method not in METHODS:
            raise InputError(f"--method {method}: not known. {nearest(method, METHODS)}")
        if "method" in wanted:
            raise InputError("--method and --set method: both given. Give one of them.")
    for name in wanted:
        if name in unused:
            raise InputError(f"--set {name}: {unused[name]}")
        if options.get(name) is not None:
            raise InputError(f"--{name} and --set {name}: both given. Give one of them.")
    try:
        study = study.changed(**wanted)
    except InputError as error:
        raise InputError(f"--set: {error}") from None
    try:
        return study if method is None else study.changed(method=method)
    except InputError as error:
        raise InputError(f"--method: {error}") from None


def _from_zero(study: Study) -> Study:
    """The study; raises ``InputError`` unless its run starts at time 0."""
    if study.run.start_time != 0.0:
        raise InputError(
            f"run.start_time = {study.run.start_time!r}: must be 0, where sweeps and orbits start."
            " Set it with --set start_time=0."
        )
    return study


def load_for_sweep(
    path: Path,
    changes: Iterable[str] | None,
    method: str | None,
    over: list[str] | None,
    options: Mapping[str, Any],
) -> Study:
    """As ``load_any``, with the axes of ``--over`` and the other options of a sweep in its [sweep].

    options : transient, periods, crossings and follow, if given
    """
    study = load_study(path)
    unused = NOT_SWEPT_OF_MACHINES if study.of_machine else NOT_SWEPT
    study = _from_zero(_changed(study, changes, method, unused, options))
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
        raise InputError(in_options(str(error), r"\w+", "sweep.")) from None


def in_options(text: str, names: str, table: str = "") -> str:
    """Rewrite a message about arguments as one about the options with their names.

    names : a regular expression for them, for example r"order|step"
    """
    return re.sub(rf"(?m)^{re.escape(table)}({names}) = ", r"--\1 ", text)
