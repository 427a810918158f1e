"""Numbers with units in texts: "22 deg", "600 rpm", "2 kN m"."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from typing import Any

from wedgebrake.model.validation import wrong

_TURN = 2.0 * math.pi
_DEGREE = math.pi / 180.0
UNITS: dict[str, dict[str, float]] = {
    "1": {"%": 0.01},
    "rad": {"rad": 1.0, "mrad": 1e-3, "deg": _DEGREE, "turn": _TURN},
    "rad/s": {"rad/s": 1.0, "deg/s": _DEGREE, "turn/s": _TURN, "rpm": _TURN / 60.0},
    "Hz": {"Hz": 1.0, "kHz": 1e3, "1/s": 1.0, "1/min": 1.0 / 60.0, "rpm": 1.0 / 60.0},
    "s": {"s": 1.0, "us": 1e-6, "ms": 1e-3, "min": 60.0, "h": 3600.0},
    "m": {"m": 1.0, "um": 1e-6, "mm": 1e-3, "cm": 1e-2},
    "m^2": {"m^2": 1.0, "mm^2": 1e-6, "cm^2": 1e-4},
    "m/s": {"m/s": 1.0, "mm/s": 1e-3, "km/h": 1.0 / 3.6},
    "s/m": {"s/m": 1.0, "s/mm": 1e3},
    "kg": {"kg": 1.0, "g": 1e-3, "t": 1e3},
    "kg/m^3": {"kg/m^3": 1.0, "g/cm^3": 1e3},
    "kg m^2": {"kg m^2": 1.0, "kg cm^2": 1e-4, "kg mm^2": 1e-6, "g cm^2": 1e-7},
    "N": {"N": 1.0, "kN": 1e3, "MN": 1e6},
    "N m": {"N m": 1.0, "N mm": 1e-3, "kN m": 1e3},
    "N m/rad": {"N m/rad": 1.0, "kN m/rad": 1e3, "N m/deg": 1.0 / _DEGREE,
                "kN m/deg": 1e3 / _DEGREE},
    "N m s/rad": {"N m s/rad": 1.0, "kN m s/rad": 1e3, "N m s/deg": 1.0 / _DEGREE},
    "N s/rad": {"N s/rad": 1.0, "kN s/rad": 1e3, "N s/deg": 1.0 / _DEGREE},
    "J/(kg K)": {"J/(kg K)": 1.0, "kJ/(kg K)": 1e3},
    "W/(m K)": {"W/(m K)": 1.0},
}  # fmt: skip
"""Units in which a value can be given, by the SI unit of a parameter, with their SI values."""

_SIGNS = str.maketrans({"²": "2", "³": "3", "°": "deg", "µ": "u", "μ": "u"})

SIGNAL = "signal"
"""Key of the units of a signal, which depend on the place at which it is used."""
UNITS[SIGNAL] = {
    unit: factor for one in ("1", "N", "N m", "rad/s") for unit, factor in UNITS[one].items()
}

_NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
ANY = rf"^\s*{_NUMBER}\s*[A-Za-z1%°µμ].*$"
"""Regular expression of a text with a number and any unit."""
# An atomic number: "4e-2" is not 4 of a unit "e-2".
_QUANTITY = re.compile(
    rf"\s*(?P<number>(?>{_NUMBER}))\s*(?P<unit>[A-Za-z_°µμ].*|1/.*|%)\s*", re.ASCII
)


def is_quantity(text: object) -> bool:
    """Return True for a text of the form "NUMBER UNIT", whatever the unit."""
    return isinstance(text, str) and _QUANTITY.fullmatch(text) is not None


def with_unit(name: str, value: Any, unit: str) -> Any:
    """The SI value of a text "NUMBER UNIT", or of such texts in a list; other values as they are.

    unit : SI unit of the quantity

    Raises ``InputError`` for a unit of another quantity.
    """
    if isinstance(value, list | tuple):
        if not any(isinstance(one, str) for one in value):
            return value
        found = (with_unit(f"{name}[{i}]", one, unit) for i, one in enumerate(value))
        return type(value)(found)
    match = _QUANTITY.fullmatch(value) if isinstance(value, str) else None
    if match is None:
        return value
    factor = factor_of(match["unit"], unit)
    if factor is None:
        known = any(_key(match["unit"]) in map(_key, one) for one in UNITS.values())
        what = "a unit of another quantity" if known else "not a unit"
        raise wrong(name, value, allowed_units(unit), f"{match['unit'].strip()!r} is {what}.")
    return float(match["number"]) * factor


def factor_of(text: str, unit: str) -> float | None:
    """The SI value of one of a unit; None unless it is a unit of the quantity with an SI unit."""
    return {_key(one): factor for one, factor in UNITS.get(unit, {}).items()}.get(_key(text))


def with_units(name: str, value: Any, units: Sequence[str]) -> Any:
    """As ``with_unit``, for a row of values of different units, or a list of such rows."""
    if not isinstance(value, list | tuple):
        return value
    if any(isinstance(one, list | tuple) for one in value):
        return [with_units(f"{name}[{i}]", one, units) for i, one in enumerate(value)]
    if not any(isinstance(one, str) for one in value):
        return value
    known = [*units, *[""] * (len(value) - len(units))]
    found = zip(value, known, strict=False)
    return [with_unit(f"{name}[{i}]", one, unit) for i, (one, unit) in enumerate(found)]


def allowed_units(unit: str) -> str:
    """What a value with an SI unit may be, as error messages say it."""
    others = ", ".join(UNITS.get(unit, ()))
    number = "a number" if unit in ("1", "-", SIGNAL) else f"a number [{unit}]"
    units = "one of the units" if "," in others else "the unit"
    return f"{number}, or a number with {units} {others}" if others else number


def pattern(unit: str) -> str | None:
    """Regular expression of the texts that a parameter with an SI unit accepts; None: no text."""
    if unit not in UNITS:
        return None
    words = "|".join(
        (r"\s+" if one[0].isdigit() else r"\s*") + re.escape(one).replace(r"\ ", " ?")
        for one in UNITS[unit]
    )
    words = words.replace("deg", "(deg|°)").replace("us", "[uµμ]s").replace("um", "[uµμ]m")
    return rf"^\s*{_NUMBER}({words})\s*$"


def _key(unit: str) -> str:
    """A unit without spaces, dots and powers: "N m", "N·m" and "Nm" are the same."""
    return re.sub(r"[\s·*^]", "", unit.translate(_SIGNS))
