"""Texts of the form NAME=...: ``--set`` NAME=VALUE, ``--over`` NAME=FROM:TO:COUNT or FROM:TO."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Collection, Iterable
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wedgebrake.errors import InputError
from wedgebrake.model.machine import Machine
from wedgebrake.model.studies.sweep_settings import expanded, sweepable, swept_values, untied
from wedgebrake.model.system import CHOSEN, BrakedDriveline
from wedgebrake.model.units import allowed_units, is_quantity, with_unit
from wedgebrake.model.validation import as_typed, shown

if TYPE_CHECKING:
    from wedgebrake.orbits.ranges import Range

# Tables of a study besides those of its parts.
_TABLES = ("groups", "run", "sweep")
_FORMS = (
    "NAME=FROM:TO:COUNT (equal steps), NAME=FROM:TO:COUNT:log (equal ratios) or"
    " NAME=VALUE,VALUE,... (a list)"
)
_EXAMPLE = "for example --over eta=-60:12:400"
_LEVELS = "NAME=A,B,... with one or more values, for example amplitude=50,150,300"
_RANGE = "NAME=FROM:TO, for example eta=12:-60"


def _parted(option: str, text: str, forms: str) -> tuple[str, str]:
    """Name and values, neither empty."""
    name, _, values = (part.strip() for part in text.partition("="))
    if not name or not values:
        raise InputError(f"{option} {as_typed(text)}: must be {forms}.")
    return name, values


def parse_changes(texts: Iterable[str], system: BrakedDriveline | Machine) -> dict[str, Any]:
    """The changes of several ``--set`` options, values written as in a study file.

    The value ``none`` is read as None, which unsets an optional value.

    system : of the study; the parameters of a machine have dotted names: brake.slope=-40

    Raises ``InputError`` for a text that is not NAME=VALUE, a whole table or its kind, or a name
    given twice.
    """
    changes: dict[str, Any] = {}
    for text in texts:
        name, value = _parted("--set", text, "NAME=VALUE, for example --set eta=-30")
        table, _, rest = name.partition(".")
        where = f"--set {as_typed(text)}: "
        if "kind" in (name, rest):
            kinds = (f"{one}: {', '.join(map(repr, sorted(CHOSEN[one])))}" for one in CHOSEN)
            raise InputError(
                f"{where}another kind has other parameters, so that it cannot be set alone. Edit a"
                f" copy of the study file, kind and parameters. Kinds of {'; of '.join(kinds)}."
            )
        if name in (*system.parts(), *_TABLES):
            raise InputError(
                f"{where}{name} is a table of the study. Change its parameters one by one, or edit"
                " a copy of the study file."
            )
        if table in _TABLES and rest:
            raise InputError(f"{where}write the name without its table: --set {rest}=VALUE.")
        if name in changes:
            raise InputError(f"--set {as_typed(name)}: given twice. Give it once.")
        changes[name] = _value(text, value)
    return changes


def _value(text: str, value: str) -> Any:
    if value == "none":
        return None
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
        where = f"--over {as_typed(text)}: "
        name = ",".join(untied(name))
        try:
            known = sweepable(system, [name])
        except InputError as error:
            raise InputError(f"--over {error}") from None
        _check_varied(where, name, system, known, f"{as_typed(name)} cannot be swept")
        if name in axes:
            raise InputError(f"--over {as_typed(name)}: given twice. Give it once.")
        unit = known[name][0]
        axes[name] = swept_values(_read(where, name, values, unit), where, unit)
    return tuple(axes.items())


def parse_number(option: str, text: str, unit: str) -> float:
    """The SI value of an option, a number or a text with a unit.

    Raises ``InputError`` for anything else.
    """
    return _number(f"{option} {as_typed(text)}: ", text, unit, allowed_units(unit))


def parse_limits(texts: Iterable[str]) -> dict[str, float]:
    """The limits of several ``--limit`` options by the name of the result [SI units].

    Raises ``InputError`` for a text that is not NAME=VALUE, or a name given twice.
    """
    from wedgebrake.sweeps.results import VARIABLES

    found: dict[str, float] = {}
    for text in texts:
        name, value = _parted("--limit", text, "NAME=VALUE, for example --limit rms_torque=20")
        if name in found:
            raise InputError(f"--limit {as_typed(name)}: given twice. Give it once.")
        unit = VARIABLES[name].unit if name in VARIABLES else "rad/s"
        found[name] = parse_number("--limit", value, unit)
    return found


def parse_ends(
    option: str, text: str, system: BrakedDriveline | Machine
) -> tuple[str, tuple[float, float]]:
    """A parameter that can be swept, and two values of it, from an option.

    Raises ``InputError`` for a text of another form, or a name that cannot be swept.
    """
    name, values = _parted(option, text, _RANGE)
    where = f"{option} {as_typed(text)}: "
    name = ",".join(untied(name))
    known = sweepable(system, [name])
    _check_varied(where, name, system, known, f"{as_typed(name)} cannot be varied")
    ends = values.split(":")
    if len(ends) != 2:
        raise InputError(f"{where}must be {_RANGE}.")
    first, last = (_number(where, one, known[name][0], _RANGE) for one in ends)
    return name, (first, last)


def parse_speeds(text: str) -> NDArray[np.float64]:
    """Parse the option ``--speeds`` [rad/s].

    Raises ``InputError`` for a text of any other form.
    """
    where, unit = f"--speeds {as_typed(text)}: ", "rad/s"
    if ":" not in text and "," not in text:
        values = np.array([_number(where, text, unit)])
    else:
        values = expanded(swept_values(_read(where, "speeds", text, unit), where, unit))
    if not np.all(values > 0.0):
        raise InputError(f"{where}must be above 0, for example --speeds 0.1:2:40.")
    return values


def parse_range(option: str, text: str, system: BrakedDriveline | Machine) -> Range:
    """The range of a parameter over which orbits are followed, from an option.

    Raises ``InputError`` for a text of another form, a name that orbits of the system cannot be
    followed over, equal ends, or an end that is not a possible value.
    """
    from wedgebrake.orbits.ranges import followable, make_ranges

    name, values = _parted(option, text, _RANGE)
    where = f"{option} {as_typed(text)}: "
    refused = f"orbits cannot be followed over {as_typed(name)}"
    _check_varied(where, name, system, followable(system), refused)
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


def parse_levels(
    option: str, text: str, system: BrakedDriveline | Machine
) -> tuple[str, list[float]]:
    """The values of a second parameter of orbits, from an option.

    Raises ``InputError`` as ``parse_range``, and for a value that the system does not take.
    """
    from wedgebrake.orbits.ranges import followable, make_span

    name, values = _parted(option, text, _LEVELS)
    where, allowed = f"{option} {as_typed(text)}: ", followable(system)
    refused = f"orbits cannot be followed over {as_typed(name)}"
    _check_varied(where, name, system, allowed, refused)
    found = [_number(where, one, allowed[name][0], _LEVELS) for one in values.split(",")]
    if len(set(found)) < len(found):
        raise InputError(f"{where}must be different values.")
    try:
        make_span(system, name, found)
    except InputError as error:
        raise InputError(f"{where}{error}") from None
    return name, found


def _check_varied(
    where: str,
    name: str,
    system: BrakedDriveline | Machine,
    allowed: Collection[str],
    refused: str,
) -> None:
    """Refuse a name that is not allowed, with a hint."""
    if name not in allowed:
        raise InputError(f"{where}{refused} on this system. {system.hint(name, allowed)}")


def _read(where: str, name: str, values: str, unit: str) -> dict[str, Any] | list[float]:
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
    text = text.strip()
    value = with_unit(f"{where}value", text, unit)
    try:
        number = float(value)
    except ValueError:
        raise InputError(f"{where}{shown(text)} is not a number. Must be {forms}.") from None
    if not math.isfinite(number):
        raise InputError(f"{where}{shown(text)} is not a finite number. Must be {forms}.")
    return number
