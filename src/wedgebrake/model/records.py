"""Records: tables of a study file whose points are in a CSV file.

signal = { kind = "table", file = "torque.csv", columns = ["t", "M"], units = ["s", "kN m"] }
"""

from __future__ import annotations

import csv
import io
import math
from pathlib import Path
from typing import Any, ClassVar, Literal

from pydantic import field_validator

from wedgebrake.errors import InputError
from wedgebrake.model.part import Part, parameter
from wedgebrake.model.validation import moved, shown, unknown, wrong

LARGEST = 500_000_000  # bytes of a record
UNITS = {
    "1": 1.0, "%": 0.01,
    "s": 1.0, "ms": 1e-3, "us": 1e-6, "min": 60.0, "h": 3600.0,
    "N m": 1.0, "kN m": 1e3, "N": 1.0, "kN": 1e3,
    "rad": 1.0, "rad/s": 1.0, "rpm": 2.0 * math.pi / 60.0,
}  # fmt: skip
"""SI values of the units of columns."""
_FEW = 100  # most points of a table that is written into a study
_COLUMNS = ("time", "value")
_DELIMITERS = (",", ";", "\t")


class Record(Part):
    """A table of a study file whose points are columns of a CSV file with a line of names."""

    table: ClassVar[str] = "signal"

    file: str = parameter(
        "CSV file, its path relative to the study", unit="-", example="torque.csv"
    )
    columns: tuple[str, str] = parameter(
        "names of the columns with the times and the values", unit="-", example=["t", "M"]
    )
    units: tuple[str, str] = parameter(
        "their units", unit="-", example=["s", "kN m"], default=("s", "1")
    )
    scale: float = parameter("factor of the values", example=1.0, default=1.0)
    periodic: bool = parameter("whether the table repeats", unit="-", example=False, default=False)
    after: Literal["error", "hold", "zero"] = parameter(
        "value outside its times", unit="-", example="hold", default="error"
    )

    @field_validator("columns", "units", mode="before")
    @classmethod
    def _pair(cls, value: Any) -> Any:
        return tuple(value) if isinstance(value, list) else value

    @field_validator("units")
    @classmethod
    def _known(cls, value: tuple[str, str]) -> tuple[str, str]:
        for i, one in enumerate(value):
            if one not in UNITS:
                raise unknown(f"signal.[{i}]", one, list(UNITS))
        return value

    def points(self, folder: Path) -> dict[str, Any]:
        """The fields of a ``Table`` with the times and values of the record."""
        times, values = _columns(folder / self.file, self.columns)
        first, second = UNITS[self.units[0]], UNITS[self.units[1]] * self.scale
        return {
            "kind": "table",
            "times": times if first == 1.0 else [first * one for one in times],
            "values": values if second == 1.0 else [second * one for one in values],
            "periodic": self.periodic,
            "after": self.after,
        }


def with_records(table: Any, folder: Path | None, path: str = "") -> Any:
    """The tables of a study with the points of records in place of their files.

    folder : of the study; None if unknown

    Raises ``InputError`` for a file that cannot be read.
    """
    if isinstance(table, list):
        return [with_records(one, folder, path) for one in table]
    if not isinstance(table, dict):
        return table
    if table.get("kind") != "table" or "file" not in table:
        own = table.get("name", "")
        begin = own if isinstance(own, str) and own else path
        return {
            key: with_records(value, folder, f"{begin}.{key}".removeprefix("."))
            for key, value in table.items()
        }
    try:
        record = Record(**{key: value for key, value in table.items() if key != "kind"})
        if folder is None:
            raise wrong(
                "signal.file", record.file, "left out in the text of a study",
                "Only wb.load_study(path) knows the folder of a record; give times and values.",
            )  # fmt: skip
        return record.points(folder)
    except InputError as error:
        raise moved(error, path) from None


def _columns(path: Path, columns: tuple[str, str]) -> tuple[list[float], list[float]]:
    """Two columns of a CSV file."""
    lines = _text(path).splitlines()
    if not lines:
        raise wrong("signal.file", str(path), "a CSV file with a line of names", "It is empty.")
    delimiter = max(_DELIMITERS, key=lines[0].count)
    rows = csv.reader(lines, delimiter=delimiter)
    names = [name.strip() for name in next(rows)]
    for i, name in enumerate(columns):
        if name not in names:
            raise unknown(f"signal.columns[{i}]", name, names, f"no such column of {path.name}")
    places = [names.index(name) for name in columns]
    found: tuple[list[float], list[float]] = ([], [])
    for number, row in enumerate(rows, start=2):
        if row:
            for column, place in zip(found, places, strict=True):
                column.append(_cell(row, place, f"{path.name}, line {number}"))
    return found


def _cell(row: list[str], place: int, where: str) -> float:
    text = row[place].strip() if place < len(row) else ""
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise wrong(
            "signal.file", text, "a finite number in each line",
            f"See {where}; remove the line, or fill the gap.",
        )  # fmt: skip
    return value


def _text(path: Path) -> str:
    try:
        with path.open("rb") as file:
            content = file.read(LARGEST + 1)
        if len(content) > LARGEST:
            raise wrong("signal.file", str(path), f"a CSV file of at most {LARGEST} bytes")
        return content.decode("utf-8-sig")
    except (OSError, ValueError) as error:
        if isinstance(error, InputError):
            raise
        why = getattr(error, "strerror", None) or "no text"
        raise wrong(
            "signal.file", str(path), "a CSV file that can be read",
            f"It cannot ({shown(why)}). Its path is relative to the study.",
        ) from None  # fmt: skip


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
        if value.get("kind") != "table" or len(value["times"]) <= _FEW:
            return {key: self.kept(one, name) for key, one in value.items()}
        number = sum(file.startswith(f"{self.stem}-{name}") for file in self.files)
        file = f"{self.stem}-{name}{f'-{number + 1}' if number else ''}.csv"
        self.files[file] = _csv_text(value["times"], value["values"])
        others = {key: one for key, one in value.items() if key not in ("times", "values")}
        return {**others, "file": file, "columns": list(_COLUMNS)}


def _csv_text(times: list[float], values: list[float]) -> str:
    """A record as text, from which the numbers are read back exactly."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(_COLUMNS)
    writer.writerows((repr(time), repr(value)) for time, value in zip(times, values, strict=True))
    return text.getvalue()
