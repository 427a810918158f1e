"""``--over``: a swept parameter, NAME=FROM:TO:COUNT, or one to follow orbits over, NAME=FROM:TO."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable
from typing import Any

from wedgebrake.errors import InputError, nearest
from wedgebrake.model.sweep_settings import INITIAL, sweepable, swept_values
from wedgebrake.model.system import PARTS, BrakedDriveline
from wedgebrake.model.tables import refuse_of_another_kind
from wedgebrake.model.validation import as_typed, shown
from wedgebrake.orbits.problem import Range, make_ranges

_FORMS = (
    "NAME=FROM:TO:COUNT (equal steps), NAME=FROM:TO:COUNT:log (equal ratios) or"
    " NAME=VALUE,VALUE,... (a list)"
)
_EXAMPLE = "for example --over eta=-60:12:400"
_RANGE = "NAME=FROM:TO, for example eta=12:-60"


def parse_axes(texts: Iterable[str], system: BrakedDriveline) -> tuple[tuple[str, Any], ...]:
    """The axes of several ``--over`` options, as ``Sweep`` takes them, in their order.

    Raises ``InputError`` for a text of another form, a name that cannot be swept on the
    system, or one given twice.
    """
    axes: dict[str, Any] = {}
    for text in texts:
        name, values = _parted("--over", text, f"{_FORMS}; {_EXAMPLE}")
        allowed, refused = sweepable(system), f"{as_typed(name)} cannot be swept"
        _check_name("--over", text, name, system, allowed, refused)
        if name in axes:
            raise InputError(f"--over {as_typed(name)}: given twice. Give it once.")
        where = f"--over {as_typed(text)}: "
        axes[name] = swept_values(_read(where, name, values), where)
    return tuple(axes.items())


def parse_range(option: str, text: str, system: BrakedDriveline) -> Range:
    """The range that an option tells to follow orbits over.

    Raises ``InputError`` for a text of another form, a name that orbits of the system cannot be
    followed over, equal ends, or one that is no possible value.
    """
    name, values = _parted(option, text, _RANGE)
    allowed = [one for one in sweepable(system) if one not in INITIAL]
    refused = f"orbits cannot be followed over {as_typed(name)}"
    _check_name(option, text, name, system, allowed, refused)
    where = f"{option} {as_typed(text)}: "
    ends = values.split(":")
    if len(ends) != 2:
        more = " The points between are chosen as the branch bends, see --step."
        raise InputError(f"{where}must be {_RANGE}.{more if len(ends) > 2 else ''}")
    first, last = (_number(where, end, _RANGE) for end in ends)
    try:
        (found,) = make_ranges(system, {name: (first, last)}, 1)
    except InputError as error:
        raise InputError(f"{where}{error}") from None
    return found


def _parted(option: str, text: str, forms: str) -> tuple[str, str]:
    """Name and values, both there."""
    name, separator, values = (part.strip() for part in text.partition("="))
    if not separator or not name or not values:
        raise InputError(f"{option} {as_typed(text)}: must be {forms}.")
    return name, values


def _check_name(
    option: str,
    text: str,
    name: str,
    system: BrakedDriveline,
    allowed: Collection[str],
    refused: str,
) -> None:
    """Refuse a name that is not allowed, in words that say so, with the nearest that is."""
    table, _, rest = name.partition(".")
    if table in (*PARTS, "groups") and rest.isidentifier():
        raise InputError(
            f"{option} {as_typed(text)}: write the name without its table: {option} {rest}=..."
        )
    if name not in allowed:
        refuse_of_another_kind(name, system, f"{option} {as_typed(text)}: ")
        raise InputError(
            f"{option} {as_typed(text)}: {refused} on this brake and driveline."
            f" {nearest(name, allowed)}"
        )


def _read(where: str, name: str, values: str) -> dict[str, Any] | list[float]:
    """The values as a study file would have them."""
    if ":" not in values:
        listed = [_number(where, one) for one in values.split(",")]
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
    return {
        "from": _number(where, first),
        "to": _number(where, last),
        "points": _whole(where, count),
        "scale": scale[0] if scale else "linear",
    }


def _number(where: str, text: str, forms: str = _FORMS) -> float:
    try:
        value = float(text)
    except ValueError:
        raise InputError(
            f"{where}{shown(text.strip())} is not a number. Must be {forms}."
        ) from None
    if not math.isfinite(value):
        raise InputError(f"{where}{shown(text.strip())} is not a finite number. Must be {forms}.")
    return value


def _whole(where: str, text: str) -> int:
    try:
        return int(text)
    except ValueError:
        raise InputError(
            f"{where}{shown(text)} is not a whole number. It must say how many values; {_EXAMPLE}."
        ) from None
