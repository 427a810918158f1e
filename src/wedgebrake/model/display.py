"""Display of results: one line in a terminal, a table in a notebook."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Iterator
from enum import Enum
from html import escape
from typing import Any

import numpy as np
from pydantic.fields import FieldInfo

from wedgebrake.model.part import Part
from wedgebrake.model.validation import is_number, labels, shown

# SI units by attribute name; names that are missing have no unit.
_UNITS = {
    **dict.fromkeys(("angle", "angle_amplitude", "hopf_angle"), "rad"),
    **dict.fromkeys(("kinetic_locking_angle", "static_locking_angle"), "rad"),
    **dict.fromkeys(("velocity", "velocity_amplitude", "speed"), "rad/s"),
    **dict.fromkeys(("peak_torque", "mean", "mean_size", "peak"), "N m"),
    **dict.fromkeys(("largest_exponent", "second_exponent", "exponent_error"), "1/s"),
    **dict.fromkeys(("growth_rate", "eigenvalues", "exponents"), "1/s"),
    **dict.fromkeys(("hopf_slope", "margin_slope"), "N s/rad"),
    **dict.fromkeys(("node_focus_stable_slope", "node_focus_unstable_slope"), "N s/rad"),
    "damping": "N m s/rad",
    "friction_power": "W",
}
# Longest list whose values are displayed individually.
_FEW = 6


class Tabular:
    """Base class of objects that notebooks display as a table."""

    def _headline(self) -> str:
        """Line above the table."""
        return str(getattr(self, "verdict", type(self).__name__))

    def _rows(self) -> Iterable[tuple[str, Any, str]]:
        """Name, value and unit of each row; for a dataclass its fields that are not empty."""
        for one in dataclasses.fields(self):  # type: ignore[arg-type]
            value = getattr(self, one.name)
            if one.repr and one.name != "verdict" and words(value):
                yield one.name, value, _UNITS.get(one.name, "")

    def _repr_html_(self) -> str:
        return f"<p><b>{escape(self._headline())}</b></p>{_table(self)}"


class Result(Tabular):
    """Base class of results whose repr is the verdict; dataclasses with ``repr=False``."""

    def __repr__(self) -> str:
        return f"{self._headline()} ({type(self).__name__})"


def duration(seconds: float) -> str:
    """Return a time as text with a suitable unit: "510 ms", "42 s", "3 min 10 s", "2 h 5 min"."""
    if seconds < 59.5:
        unit, size = next(
            (one for one in (("s", 1.0), ("ms", 1e-3)) if seconds >= one[1]), ("µs", 1e-6)
        )
        return f"{float(f'{seconds / size:.2g}'):g} {unit}"
    whole = round(min(seconds, 1e9))
    if whole < 3600:
        return f"{whole // 60} min {whole % 60} s"
    return f"{whole // 3600} h {whole % 3600 // 60} min"


def part_rows(name: str, part: Part, fields: Iterable[str]) -> Iterator[tuple[str, Any, str]]:
    """Table rows of the given fields of a part of a system or of a study."""
    for one in fields:
        yield f"{name}.{one}", getattr(part, one), unit_of(type(part).model_fields[one])


def unit_of(field: FieldInfo) -> str:
    """Return the SI unit of a field; empty for none."""
    unit = str(labels(field).get("unit", ""))
    return "" if unit in ("1", "-") else unit


def _table(of: Tabular) -> str:
    rows = "".join(
        f'<tr><th style="text-align: left">{escape(name)}</th>'
        f'<td style="text-align: left">{_cell(value)}</td>'
        f'<td style="text-align: left">{escape(unit)}</td></tr>'
        for name, value, unit in of._rows()
    )
    return f"<table>{rows}</table>"


def _cell(value: Any) -> str:
    """Value as HTML; an object with its own table becomes an expandable section."""
    if isinstance(value, Tabular):
        return f"<details><summary>{escape(value._headline())}</summary>{_table(value)}</details>"
    return escape(words(value))


def words(value: Any) -> str:
    """Value as text with six digits; empty for None."""
    if value is None:
        return ""
    if isinstance(value, str):
        return value
    if isinstance(value, Enum):
        return str(value.value)
    if isinstance(value, complex):
        return f"{value.real:.6g}" + (f"{value.imag:+.6g}i" if value.imag != 0.0 else "")
    if is_number(value):
        return f"{value:.6g}" if isinstance(value, float) else str(value)
    if isinstance(value, np.ndarray) and value.size > _FEW:
        return " × ".join(map(str, value.shape)) + " values"
    if isinstance(value, np.ndarray | tuple | list):
        several = np.ravel(value).tolist() if isinstance(value, np.ndarray) else value
        few = len(several) <= _FEW
        return ", ".join(map(words, several)) if few else f"{len(several)} values"
    return shown(value)


def counted(count: int, word: str) -> str:
    """A count with its noun: "1 stick", "3 sticks", "no sticks"."""
    return f"{count or 'no'} {word}{'' if count == 1 else 's'}"
