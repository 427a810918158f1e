"""A measured trace: columns over time."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

from wedgebrake.analysis.fitting.trace_files import SUFFIXES, TIME, read_file
from wedgebrake.arrays import FloatArray
from wedgebrake.errors import InputError, nearest
from wedgebrake.model.display import counted
from wedgebrake.model.units import UNITS, factor_of
from wedgebrake.model.validation import wrong

# Units of times in names of columns, beside those of ``UNITS``.
_SECONDS = {**UNITS["s"], "ns": 1e-9, "sec": 1.0, "second": 1.0, "seconds": 1.0, "msec": 1e-3}
# A name with a unit: "speed [rpm]", "speed (rpm)"; of times also "time_ms" and "time/ms".
_WITH_UNIT = re.compile(r"(?P<name>.*?)\s*(?:\[(?P<unit>[^][]*)\]|\((?P<round>[^()]*)\))\s*")
_TIME_WITH_UNIT = re.compile(
    rf"(?P<name>t|(?i:time))\s*[_/]\s*(?P<unit>{'|'.join(_SECONDS)}|[µμ]s)"
)
# SI units of the quantities that columns measure.
_MEASURED = ("rad", "rad/s", "N m", "N")
# What files and datasets state for a column without a unit.
_NO_UNIT = ("", "-", "1", "none")
_FORMS = (
    f"a Dataset, a DataFrame, a mapping of columns, or the path of a file: {', '.join(SUFFIXES)}"
)
# A gap between samples, in median intervals; samples at the largest value that look clipped.
_GAP, _CLIPPED = 1.5, 3
# A model counts as constant if it varies by no more than this share of its range.
_CONSTANT = 1e-6


class Trace(NamedTuple):
    """A measured trace.

    time    : (k,) strictly ascending [s]
    columns : each (k,); nan: not measured
    texts   : of the columns that are not numbers, the first value that is none
    units   : of the columns that state one, in their names or metadata
    """

    time: FloatArray
    columns: dict[str, FloatArray]
    texts: Mapping[str, str] = MappingProxyType({})
    units: Mapping[str, str] = MappingProxyType({})

    def remarks(self, fitted: Mapping[str, FloatArray]) -> list[str]:
        """What looks wrong with the samples themselves: lost samples, clipped columns.

        fitted : the model of each column; where it is constant too, a contact sticks
        """
        intervals, found = np.diff(self.time), []
        usual = float(np.median(intervals))
        lost = int(np.count_nonzero(intervals > _GAP * usual))
        if lost:
            at = float(self.time[int(np.argmax(intervals))])
            found.append(
                f"time: {counted(lost, 'gap')} between samples, the longest after {at:.6g} s, where"
                f" samples usually are {usual:.3g} s apart. The other samples are used."
            )
        for name, model in fitted.items():
            least, column = _CONSTANT * np.ptp(model), self.columns[name]
            # A column of few digits repeats values, also those between its extremes.
            held = (np.diff(column) == 0.0) & (np.abs(np.diff(model)) > least)
            inner = ~np.isin(column[1:], (np.nanmin(column), np.nanmax(column)))
            if 2 * np.count_nonzero(held & inner) > np.count_nonzero(held):
                continue
            for what, limit in (("largest", np.nanmax), ("smallest", np.nanmin)):
                ends = self.columns[name] == limit(self.columns[name])
                runs = np.flatnonzero(np.diff(np.concatenate(([0], ends, [0])))).reshape(-1, 2)
                clipped = sum(
                    last - first >= _CLIPPED and np.ptp(model[first:last]) > least
                    for first, last in runs
                )
                if clipped > 1:
                    found.append(
                        f"{name}: stays at its {what} value {limit(self.columns[name]):.6g} for"
                        f" several samples, {clipped} times. It may be clipped: set these samples"
                        " to nan."
                    )
        return found


def name_and_unit(column: str) -> tuple[str, str]:
    """Split the name of a column, such as "speed [rpm]", into name and unit (empty if none)."""
    match = _WITH_UNIT.fullmatch(column) or _TIME_WITH_UNIT.fullmatch(column)
    if match is None:
        return column, ""
    return match["name"], (match["unit"] or match.groupdict().get("round") or "").strip()


def read_trace(given: Any, time: str | None = None) -> Trace:
    """A trace from a Dataset, a DataFrame, a mapping or a file; a ``Trace`` as it is.

    Times, angles, speeds, torques and forces are converted to SI units from a unit in the name of
    the column or in its metadata.

    time : name of the times; None: "time", "t", or the only coordinate or first column

    Raises ``InputError`` for another type, an unknown column, times that are not numbers, do not
    ascend or have an unknown unit, a unit in a name that is not that in the metadata, and fewer
    than 4 samples.
    """
    if isinstance(given, Trace):
        return given
    if isinstance(given, str | os.PathLike):
        given = read_file(Path(given))
    given = _mapping(given)
    found = _columns(given)
    columns = {name: one for name, one in found.items() if isinstance(one, np.ndarray)}
    texts = {name: one for name, one in found.items() if name not in columns}
    if time is None:
        time = _times_of(found)
    if time in texts:
        raise not_numbers(time, texts[time])
    if time not in columns:
        raise InputError(
            f"time = {time!r}: no such column. {nearest(time, columns)}",
            name="time", value=time, allowed=tuple(columns),
        )  # fmt: skip
    times = columns.pop(time)
    columns = {name: one for name, one in columns.items() if one.shape == times.shape}
    if texts and not columns:
        raise not_numbers(*next(iter(texts.items())))
    if times.ndim != 1 or times.size < 4 or not columns:
        raise wrong("trace", given, "at least 4 samples of at least one column over time")
    falls = np.flatnonzero(~(np.diff(times) > 0.0))
    if falls.size:
        at = falls[0]
        raise wrong(
            f"trace[{time!r}]", float(times[at + 1]),
            f"greater than the time before it, {times[at]:.9g}",
            f"Sort the samples, or leave out sample {at + 1}.",
        )  # fmt: skip
    each = {str(name): _unit(str(name), one) for name, one in given.items()}
    units = {name: unit for name, unit in each.items() if unit}
    converted = {name: one * _factor(units.get(name, "")) for name, one in columns.items()}
    return Trace(times * _seconds(time, units.get(time, "")), converted, texts, units)


def _times_of(columns: Mapping[str, Any]) -> str:
    """The column of times: "time" or "t", with or without a unit, otherwise the first one."""
    names = {column: name_and_unit(column)[0] for column in columns}
    wanted = {TIME: 0, "Time": 1, "TIME": 1, "t": 2}
    found = [column for column, name in names.items() if name in wanted]
    return min(found, key=lambda one: wanted[names[one]], default=next(iter(columns), ""))


def _unit(column: str, values: Any) -> str:
    """The unit of a column: that in its name or, of an array with attributes, their "units".

    Words in brackets that are not a unit, as in "speed (left)", do not hide the unit in the
    attributes.
    """
    named = name_and_unit(column)[1]
    told = str(getattr(values, "attrs", {}).get("units", "")).strip()
    if told.lower() in _NO_UNIT or told == named:
        return named
    meant = _meaning(named)
    if meant is not None and meant != _meaning(told):
        raise wrong(
            f"trace[{column!r}]", told,
            f"in a single unit; its name contains {named!r}, its metadata {told!r}",
            "Correct the name or the metadata.",
        )  # fmt: skip
    return named if meant is not None else told


def _meaning(unit: str) -> tuple[str, float] | None:
    """SI unit of the same quantity, and value of the unit in it; None if the unit is not known."""
    factors = ((one, factor_of(unit, one)) for one in _MEASURED)
    found = next(((one, factor) for one, factor in factors if factor is not None), None)
    seconds = _SECONDS.get(unit, factor_of(unit, "s"))
    return found if seconds is None else ("s", seconds)


def _seconds(column: str, unit: str) -> float:
    """Factor that converts a column of times to seconds."""
    factor = _SECONDS.get(unit, factor_of(unit, "s")) if unit else 1.0
    if factor is None:
        raise wrong(
            f"trace[{column!r}]", unit, f"times in one of the units {', '.join(UNITS['s'])}",
            "Convert the times to seconds, and name the column time [s].",
        )  # fmt: skip
    return factor


def _factor(unit: str) -> float:
    """Factor that converts a measured column to SI units; 1 without a known unit."""
    factors = (factor_of(unit, one) for one in _MEASURED)
    return next((one for one in factors if one is not None), 1.0)


def not_numbers(name: str, value: Any) -> InputError:
    """The error of a column that is not numbers, with the first value that is none."""
    return wrong(
        f"trace[{name!r}]", value, "numbers with a decimal point, or nan",
        "Write one line of names above the numbers, without a line of units; to read a decimal"
        ' comma, use pandas.read_csv(..., sep=";", decimal=",").',
    )  # fmt: skip


def _mapping(given: Any) -> Mapping[Any, Any]:
    """The columns of a Dataset, DataFrame or mapping by name, with the attributes that they have.

    Raises ``InputError`` for another type.
    """
    if hasattr(given, "data_vars"):
        return {str(name): one for name, one in given.variables.items()}
    if hasattr(given, "columns") and hasattr(given, "index"):
        frame = given if given.index.name is None else given.reset_index()
        return {str(name): frame[name].to_numpy() for name in frame.columns}
    if not isinstance(given, Mapping):
        raise wrong("trace", given, _FORMS)
    return given


def _columns(given: Mapping[Any, Any]) -> dict[str, Any]:
    """The columns as arrays of numbers.

    Of a column that is not numbers, the first value that is none.
    """
    found: dict[str, Any] = {}
    for name, one in given.items():
        try:
            found[str(name)] = np.array(one, float)
        except (TypeError, ValueError):
            found[str(name)] = str(next(filter(_is_text, np.ravel(np.array(one, object))), one))
    return found


def _is_text(value: Any) -> bool:
    try:
        float(value)
    except (TypeError, ValueError):
        return True
    return False
