"""Texts of the form NAME=...: ``--set`` NAME=VALUE, ``--over`` NAME=FROM:TO:COUNT or FROM:TO."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Collection, Iterable
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wedgebrake.errors import InputError, nearest
from wedgebrake.model.groups import SETTERS
from wedgebrake.model.machine import Machine
from wedgebrake.model.study_run import MachineRun, Run
from wedgebrake.model.sweep_settings import (
    SWEEP_SETTINGS,
    expanded,
    sweepable,
    swept_values,
)
from wedgebrake.model.system import PARTS, BrakedDriveline
from wedgebrake.model.tables import CHOSEN, refuse_of_another_kind
from wedgebrake.model.units import is_quantity, with_unit
from wedgebrake.model.validation import as_typed, shown

if TYPE_CHECKING:
    from wedgebrake.orbits.problem import Range

# The tables of a study, and a parameter of each that can be set.
_EXAMPLES = {
    "driveline": "damping=0.2",
    "brake": "radius=0.25",
    "friction": "kinetic=0.25",
    "actuation": "slope=-20",
    "excitation": "amplitude=300",
    "groups": "eta=-30",
    "run": "periods=50",
}
# Settings of a sweep that are set by name; the others are options.
_SET_OF_SWEEPS = set(SWEEP_SETTINGS) - {"periods", "crossings"}
# Run settings of drivelines that machines do not have.
_OF_DRIVELINES = {
    "periods": "a machine may have no period. Give duration, in seconds.",
    "samples_per_period": "a machine may have no period. Leave it out.",
    "initial": "belongs to drivelines. Give the angle and speed of an inertia (disc.speed=30).",
}
_WITHOUT_TOLERANCE = (
    "the solver of machines has neither a tolerance nor a fixed step. Leave it out."
)
_FORMS = (
    "NAME=FROM:TO:COUNT (equal steps), NAME=FROM:TO:COUNT:log (equal ratios) or"
    " NAME=VALUE,VALUE,... (a list)"
)
_EXAMPLE = "for example --over eta=-60:12:400"
_RANGE = "NAME=FROM:TO, for example eta=12:-60"


def _parted(option: str, text: str, forms: str) -> tuple[str, str]:
    """Name and values, neither empty."""
    name, _, values = (part.strip() for part in text.partition("="))
    if not name or not values:
        raise InputError(f"{option} {as_typed(text)}: must be {forms}.")
    return name, values


def _refuse_table(option: str, text: str, name: str, tables: Collection[str]) -> None:
    """Refuse a name with its table, which is not needed."""
    table, _, rest = name.partition(".")
    if table in tables and rest.isidentifier():
        value = "VALUE" if option == "--set" else "..."
        raise InputError(
            f"{option} {as_typed(text)}: write the name without its table: {option} {rest}={value}"
        )


def parse_changes(
    texts: Iterable[str], system: BrakedDriveline | Machine, unused: Collection[str] = ()
) -> dict[str, Any]:
    """The changes of several ``--set`` options, values written as in a study file.

    system : of the study; the parameters of a machine have dotted names: brake.slope=-40
    unused : settings that the command does not use; they are not suggested

    Raises ``InputError`` for a text that is not NAME=VALUE, or a name given twice.
    """
    changes: dict[str, Any] = {}
    for text in texts:
        name, value = _parted("--set", text, "NAME=VALUE, for example --set eta=-30")
        if isinstance(system, BrakedDriveline):
            _check_changed(text, name)
        else:
            _check_dotted(text, name, system, unused)
        if name in changes:
            raise InputError(f"--set {as_typed(name)}: given twice. Give it once.")
        changes[name] = _value(text, value)
    return changes


def _check_dotted(text: str, name: str, machine: Machine, unused: Collection[str]) -> None:
    """Raise ``InputError`` unless a name is a parameter of a machine or a run setting."""
    parts = name.split(".")
    settings = {*MachineRun.model_fields, *_SET_OF_SWEEPS}
    if name in settings or name in unused or (len(parts) > 1 and parts[0] in machine.parts()):
        return
    if name in SETTERS:
        raise InputError(
            f"--set {as_typed(text)}: groups belong to a brake on a driveline. Set a parameter of"
            " the machine, for example --set brake.slope=-40."
        )
    if name in Run.model_fields:
        raise InputError(f"--set {as_typed(text)}: {_OF_DRIVELINES.get(name, _WITHOUT_TOLERANCE)}")
    allowed = [*machine.parameters(), *sorted(settings - set(unused))]
    hint = _hint(name, allowed)
    raise InputError(f"--set {as_typed(text)}: no such parameter or run setting. {hint}")


def _hint(name: str, allowed: Collection[str]) -> str:
    """A sentence with the dotted names that end with a name, or with the nearest allowed names."""
    found = [] if "." in name else [one for one in allowed if one.rpartition(".")[2] == name]
    if not found:
        return nearest(name, allowed)
    return f"Name its part too: {', '.join(found)}."


def _check_changed(text: str, name: str) -> None:
    """Refuse whole tables, and names with their table."""
    table, _, rest = name.partition(".")
    if "kind" in (name, rest):
        kinds = (
            f"[{one}] {', '.join(map(repr, sorted(CHOSEN[one])))}"
            for one in CHOSEN
            if one == table or table not in CHOSEN
        )
        raise InputError(
            f"--set {as_typed(text)}: another kind has other parameters, so that it cannot be set"
            f" alone. Edit a copy of the study file, kind and parameters: {'; '.join(kinds)}."
        )
    if table == "sweep":
        raise InputError(
            f"--set {as_typed(text)}: swept parameters and their settings are options of the"
            " command sweep: --over, --periods, --transient, --follow. Other settings are given by"
            " --set, for example --set limit=5000."
        )
    if name in _EXAMPLES:
        raise InputError(
            f"--set {as_typed(text)}: {table} is a table. Change its parameters one by one, for"
            f" example --set {_EXAMPLES[table]}, or edit the study file."
        )
    _refuse_table("--set", text, name, _EXAMPLES)


def _value(text: str, value: str) -> Any:
    try:
        read = tomllib.loads(f"value = {value}")
    except (ValueError, RecursionError):
        # Not TOML: a bare word (method=smooth), a number with a unit, or a number such as .5.
        if is_quantity(value):
            return value
        if value.replace("-", "").replace("_", "").isalnum() and not value[0].isdigit():
            return value
        try:
            return float(value)
        except ValueError:
            raise InputError(
                f"--set {as_typed(text)}: {shown(value)} is not a value. Write a number, true,"
                " false, a word, or [a, b]."
            ) from None
    if set(read) != {"value"}:
        raise InputError(f"--set {as_typed(text)}: must be one NAME=VALUE.")
    return read["value"]


def parse_axes(
    texts: Iterable[str], system: BrakedDriveline | Machine
) -> tuple[tuple[str, Any], ...]:
    """The axes of several ``--over`` options, as ``Sweep`` takes them, in their order.

    Raises ``InputError`` for a text of another form, a name that cannot be swept on the
    system, or one given twice.
    """
    axes: dict[str, Any] = {}
    for text in texts:
        name, values = _parted("--over", text, f"{_FORMS}; {_EXAMPLE}")
        refused = f"{as_typed(name)} cannot be swept"
        _check_varied("--over", text, name, system, sweepable(system), refused)
        if name in axes:
            raise InputError(f"--over {as_typed(name)}: given twice. Give it once.")
        where, unit = f"--over {as_typed(text)}: ", sweepable(system)[name][0]
        axes[name] = swept_values(_read(where, name, values, unit), where, unit)
    return tuple(axes.items())


def parse_speeds(text: str) -> NDArray[np.float64]:
    """Parse the option ``--speeds`` [rad/s].

    Raises ``InputError`` for a text of any other form.
    """
    where, unit = f"--speeds {as_typed(text)}: ", "rad/s"
    if ":" not in text and "," not in text:
        return np.array([_number(where, text, unit)])
    return expanded(swept_values(_read(where, "speeds", text, unit), where, unit))


def parse_range(option: str, text: str, system: BrakedDriveline | Machine) -> Range:
    """The range of a parameter over which orbits are followed, from an option.

    Raises ``InputError`` for a text of another form, a name that orbits of the system cannot be
    followed over, equal ends, or an end that is not a possible value.
    """
    from wedgebrake.orbits.problem import followable, make_ranges

    name, values = _parted(option, text, _RANGE)
    refused = f"orbits cannot be followed over {as_typed(name)}"
    _check_varied(option, text, name, system, followable(system).keys(), refused)
    where = f"{option} {as_typed(text)}: "
    ends = values.split(":")
    if len(ends) != 2:
        more = " The points between depend on the shape of the branch, see --step."
        raise InputError(f"{where}must be {_RANGE}.{more if len(ends) > 2 else ''}")
    unit = sweepable(system)[name][0]
    first, last = (_number(where, end, unit, _RANGE) for end in ends)
    try:
        (found,) = make_ranges(system, {name: (first, last)}, 1)
    except InputError as error:
        raise InputError(f"{where}{error}") from None
    return found


def _check_varied(
    option: str,
    text: str,
    name: str,
    system: BrakedDriveline | Machine,
    allowed: Collection[str],
    refused: str,
) -> None:
    """Refuse a name that is not allowed, and suggest the nearest allowed name."""
    where = f"{option} {as_typed(text)}: "
    if isinstance(system, BrakedDriveline):
        _refuse_table(option, text, name, (*PARTS, "groups"))
        if name not in allowed:
            refuse_of_another_kind(name, system, where)
    if name not in allowed:
        if isinstance(system, BrakedDriveline):
            hint, what = nearest(name, allowed), "brake and driveline"
        else:
            hint, what = _hint(name, allowed), "machine"
        raise InputError(f"{where}{refused} on this {what}. {hint}")


def _read(where: str, name: str, values: str, unit: str) -> dict[str, Any] | list[float]:
    """The values in the form of a study file."""
    if ":" not in values:
        listed = [_number(where, one, unit) for one in values.split(",")]
        if len(listed) == 1:
            raise InputError(
                f"{where}is one value, must be {_FORMS}. For one value use --set {name}={values}."
            )
        return listed
    parts = [part.strip() for part in values.split(":")]
    if not 3 <= len(parts) <= 4:
        raise InputError(f"{where}must be {_FORMS}; {_EXAMPLE}.")
    first, last, count, *scale = parts
    if scale and scale[0] not in ("log", "linear"):
        raise InputError(f"{where}{shown(scale[0])} at the end: must be log, linear or nothing.")
    try:
        points = int(count)
    except ValueError:
        raise InputError(
            f"{where}{shown(count)} is not a whole number. Give the number of values; {_EXAMPLE}."
        ) from None
    ends = {"from": _number(where, first, unit), "to": _number(where, last, unit)}
    return {**ends, "points": points, "scale": scale[0] if scale else "linear"}


def _number(where: str, text: str, unit: str, forms: str = _FORMS) -> float:
    what = "a number"
    try:
        value = float(with_unit(f"{where}value", text.strip(), unit))
        if math.isfinite(value):
            return value
        what = "a finite number"
    except InputError:  # of the unit
        raise
    except ValueError:
        pass
    raise InputError(f"{where}{shown(text.strip())} is not {what}. Must be {forms}.")
