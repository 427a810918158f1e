"""``--over NAME=FROM:TO:COUNT``: one swept parameter."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

from wedgebrake.cli.changes import short
from wedgebrake.errors import InputError, nearest
from wedgebrake.model.part import shown
from wedgebrake.model.swept import sweepable, swept_values
from wedgebrake.model.system import PARTS, BrakedDriveline
from wedgebrake.model.tables import refuse_of_another_kind

_FORMS = (
    "NAME=FROM:TO:COUNT (equal steps), NAME=FROM:TO:COUNT:log (equal ratios) or"
    " NAME=VALUE,VALUE,... (a list)"
)
_EXAMPLE = "for example --over eta=-60:12:400"


def parse_axes(texts: Iterable[str], system: BrakedDriveline) -> tuple[tuple[str, Any], ...]:
    """The axes of several ``--over`` options, as ``Sweep`` takes them, in their order.

    Raises ``InputError`` for a text of another form, a name that cannot be swept on the
    system, or one given twice.
    """
    axes: dict[str, Any] = {}
    for text in texts:
        name, separator, values = (part.strip() for part in text.partition("="))
        if not separator or not name or not values:
            raise InputError(f"--over {short(text)}: must be {_FORMS}; {_EXAMPLE}.")
        _check_name(text, name, system)
        if name in axes:
            raise InputError(f"--over {short(name)}: given twice. Give it once.")
        where = f"--over {short(text)}: "
        axes[name] = swept_values(_read(where, name, values), where)
    return tuple(axes.items())


def _check_name(text: str, name: str, system: BrakedDriveline) -> None:
    table, _, rest = name.partition(".")
    if table in (*PARTS, "groups") and rest.isidentifier():
        raise InputError(
            f"--over {short(text)}: write the name without its table: --over {rest}=..."
        )
    allowed = sweepable(system)
    if name not in allowed:
        refuse_of_another_kind(name, system, f"--over {short(text)}: ")
        raise InputError(
            f"--over {short(text)}: {short(name)} cannot be swept on this brake and driveline."
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


def _number(where: str, text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        raise InputError(
            f"{where}{shown(text.strip())} is not a number. Must be {_FORMS}."
        ) from None
    if not math.isfinite(value):
        raise InputError(f"{where}{shown(text.strip())} is not a finite number.")
    return value


def _whole(where: str, text: str) -> int:
    try:
        return int(text)
    except ValueError:
        raise InputError(
            f"{where}{shown(text)} is not a whole number. It says how many values; {_EXAMPLE}."
        ) from None
