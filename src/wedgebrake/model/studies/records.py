"""Records: tables of signals or of friction in a study file whose points are in a CSV file.

signal = { kind = "table", file = "torque.csv", columns = ["t", "M"], units = ["s", "kN m"] }
"""

from __future__ import annotations

import csv
import io
import math
import os
import re
import stat
from pathlib import Path
from typing import Annotated, Any, ClassVar

from pydantic import Strict, field_validator

from wedgebrake.errors import InputError, nearest
from wedgebrake.model.friction import TabulatedFriction
from wedgebrake.model.part import Part, parameter
from wedgebrake.model.signals.signal_tables import Table
from wedgebrake.model.units import UNITS as _UNITS
from wedgebrake.model.validation import moved, shown, unknown, wrong

LARGEST = 500_000_000
"""Bytes of a record: more than a table of the longest length needs."""
UNITS = {
    unit: factor
    for one in ("1", "s", "m/s", "N", "N m", "rad", "rad/s")
    for unit, factor in _UNITS[one].items()
} | {"1": 1.0}
"""SI values of the units of columns."""
_FEW = 100  # most points of a table that is written into a study
# Of each kind of table: its fields, and the names of their columns.
_POINTS: dict[Any, tuple[str, ...]] = {
    "table": ("times", "values"), "tabulated": ("speeds", "coefficients"),
}  # fmt: skip
_NAMES = {"table": ("time", "value"), "tabulated": ("speed", "coefficient")}
_DELIMITERS = (",", ";", "\t")
_DECIMAL_COMMA = re.compile(r"[+-]?\d*,\d+(?:[eE][+-]?\d+)?")
_Pair = Annotated[tuple[str, str], Strict(False)]


class TableSource(Part):
    """Source of the points of a table: two columns of a CSV file with a line of names."""

    table: ClassVar[str] = "signal"
    passed: ClassVar[tuple[str, ...]] = ("periodic", "after")
    """Fields of the table that a study gives beside the file."""

    file: str = parameter(
        "CSV file, its path relative to the study", unit="-", example="torque.csv"
    )
    columns: _Pair = parameter(
        "names of the columns with the times and the values", unit="-", example=["t", "M"]
    )
    units: _Pair = parameter("their units", unit="-", example=["s", "kN m"], default=("s", "1"))
    scale: float = parameter("factor of the values", example=1.0, default=1.0)

    @field_validator("units")
    @classmethod
    def _known(cls, value: tuple[str, str]) -> tuple[str, str]:
        for i, one in enumerate(value):
            if one not in UNITS:
                raise unknown(f"{cls.table}.[{i}]", one, list(UNITS))
        return value

    def read(self, folder: Path) -> list[list[float]]:
        """The two columns, in SI units."""
        found = []
        columns = _columns(folder / self.file, self.columns, self.table)
        for column, unit, scale in zip(columns, self.units, (1.0, self.scale), strict=True):
            factor = UNITS[unit]
            found.append([scale * (factor * one) for one in column])
        return found


class FrictionRecord(TableSource):
    """A source of friction; its scale is that of the table, which multiplies static too."""

    table: ClassVar[str] = "friction"
    passed: ClassVar[tuple[str, ...]] = ("static", "scale")

    columns: _Pair = parameter(
        "names of the columns with the sliding speeds and the coefficients", unit="-",
        example=["v", "mu"],
    )  # fmt: skip
    units: _Pair = parameter("their units", unit="-", example=["m/s", "1"], default=("m/s", "1"))


RECORDS: dict[str, tuple[type[TableSource], type[Part]]] = {
    "table": (TableSource, Table), "tabulated": (FrictionRecord, TabulatedFriction),
}  # fmt: skip
"""The record and the part of each kind of table."""


def with_records(table: Any, folder: Path | None, path: str = "") -> Any:
    """The tables of a study with the points of records in place of their files.

    folder : of the study; None if unknown

    Raises ``InputError`` for a file that cannot be read.
    """
    if isinstance(table, list):
        return [with_records(one, folder, path) for one in table]
    if not isinstance(table, dict):
        return table
    kind = table.get("kind")
    if not isinstance(kind, str) or kind not in RECORDS or "file" not in table:
        own = table.get("name", "")
        begin = own if isinstance(own, str) and own else path
        return {
            key: with_records(value, folder, f"{begin}.{key}".removeprefix("."))
            for key, value in table.items()
        }
    try:
        model = RECORDS[kind][0]
        passed = {key: table[key] for key in ("kind", *model.passed) if key in table}
        record = model(**{key: value for key, value in table.items() if key not in passed})
        if folder is None:
            raise wrong(
                f"{model.table}.file", record.file, "left out in the text of a study",
                "Only wb.load_study(path) knows the folder of a record; give its points instead.",
            )  # fmt: skip
        return passed | dict(zip(_POINTS[kind], record.read(folder), strict=True))
    except InputError as error:
        raise moved(error, path) from None


def _columns(path: Path, columns: tuple[str, str], table: str) -> tuple[list[float], list[float]]:
    """Two columns of a CSV file; errors name the ``table`` that cites it."""
    lines = _text(path, table).splitlines()
    if not lines:
        allowed = "a CSV file with a line of names"
        raise wrong(f"{table}.file", str(path), allowed, "It is empty.")
    delimiter = max(_DELIMITERS, key=lines[0].count)
    rows = csv.reader(lines, delimiter=delimiter)
    names = [name.strip() for name in next(rows)]
    for i, name in enumerate(columns):
        if name not in names:
            raise _no_column(f"{table}.columns[{i}]", name, names, path.name)
    if columns[0] == columns[1]:
        raise wrong(f"{table}.columns", columns, "the names of two different columns")
    places = [names.index(name) for name in columns]
    found: tuple[list[float], list[float]] = ([], [])
    for number, row in enumerate(rows, start=2):
        if len(row) > len(names) and delimiter == ",":
            raise wrong(
                f"{table}.file", ",".join(row), f"a line of {len(names)} values",
                f"See {path.name}, line {number}. If the numbers have decimal commas, export the"
                " file with decimal points, 1.5 instead of 1,5.",
            )  # fmt: skip
        if row:
            for column, place in zip(found, places, strict=True):
                column.append(_cell(row, place, f"{path.name}, line {number}", table))
    return found


def _no_column(argument: str, name: str, names: list[str], file: str) -> InputError:
    """The error for a column that a file lacks.

    It quotes names that are similar only: a study may name any file that its reader can read.
    """
    hint = nearest(name, names)
    if not hint.startswith("Did you mean"):
        hint = f"Its first line gives {len(names)} names, none of them similar."
    text = f"{argument} = {shown(name)}: no such column of {shown(file)}. {hint}"
    return InputError(text, name=argument, value=name, allowed="a name in the first line")


def _cell(row: list[str], place: int, where: str, table: str) -> float:
    text = row[place].strip() if place < len(row) else ""
    try:
        # Python also reads 1_000 and the digits of all scripts.
        value = float(text) if text.isascii() and "_" not in text else math.nan
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise wrong(
            f"{table}.file",
            text,
            "a finite number in each line",
            f"See {where}; {_why(text, where)}",
        )
    return value


def _why(text: str, where: str) -> str:
    """What to do about a cell that is no number."""
    if _DECIMAL_COMMA.fullmatch(text):
        return "it has a decimal comma. Export the file with decimal points, 1.5 instead of 1,5."
    if text and where.endswith(", line 2"):
        return (
            "it seems to be a line of units. Remove the line, and state them in the study:"
            ' units = ["s", "N m"].'
        )
    return "remove the line, or fill the gap."


def _text(path: Path, table: str) -> str:
    allowed = f"a regular file of at most {LARGEST} bytes (CSV)"
    try:
        with open(path, "rb", opener=_without_waiting) as file:
            status = os.fstat(file.fileno())
            if not stat.S_ISREG(status.st_mode) or status.st_size > LARGEST:
                raise wrong(f"{table}.file", str(path), allowed)
            content = file.read(LARGEST)
        return content.decode("utf-8-sig")
    except (OSError, ValueError) as error:
        if isinstance(error, InputError):
            raise
        why = getattr(error, "strerror", None) or "no text"
        raise wrong(
            f"{table}.file", str(path), "a CSV file that can be read",
            f"It cannot ({shown(why)}). Its path is relative to the study.",
        ) from None  # fmt: skip


def _without_waiting(path: str, flags: int) -> int:
    """Open a file without waiting for a writer if it is a pipe."""
    return os.open(path, flags | getattr(os, "O_NONBLOCK", 0))


class Records:
    """CSV files for the long tables of a study that is saved.

    stem  : common beginning of the file names
    files : texts of the files by name; ``kept`` adds them
    """

    def __init__(self, stem: str) -> None:
        self.stem = stem
        self.files: dict[str, str] = {}

    def kept(self, value: Any, name: str) -> Any:
        """Plain values with files in place of long tables; ``name`` is the name of the part."""
        if isinstance(value, list):
            return [self.kept(one, name) for one in value]
        if not isinstance(value, dict):
            return value
        columns = _POINTS.get(value.get("kind"), ())
        if not columns or len(value[columns[0]]) <= _FEW:
            return {key: self.kept(one, name) for key, one in value.items()}
        number = sum(file.startswith(f"{self.stem}-{name}") for file in self.files)
        file = f"{self.stem}-{name}{f'-{number + 1}' if number else ''}.csv"
        names = _NAMES[value["kind"]]
        self.files[file] = _csv_text(names, *(value[one] for one in columns))
        others = {key: one for key, one in value.items() if key not in columns}
        return {**others, "file": file, "columns": list(names)}


def _csv_text(names: tuple[str, str], first: list[float], second: list[float]) -> str:
    """A record as text, from which the numbers are read back exactly."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(names)
    writer.writerows((repr(one), repr(other)) for one, other in zip(first, second, strict=True))
    return text.getvalue()
