"""Files of measured traces, by suffix: what each reader returns has columns of samples."""

from __future__ import annotations

import csv
from collections.abc import Callable, Mapping
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from wedgebrake.model.validation import check_installed, wrong

if TYPE_CHECKING:
    import xarray as xr

TIME = "time"
"""The name of the times in files that have no name for them."""
# Numbers in the universal file format of functions over a variable, and of those over time.
_FUNCTION, _OVER_TIME = 58, 1


class _Format(NamedTuple):
    """How a file is read, and the package of the extra ``traces`` that reads it."""

    read: Callable[[Path], Any]
    package: str = ""


def _csv(path: Path | BytesIO) -> Any:
    import pandas as pd

    def read(encoding: str) -> Any:
        if isinstance(path, BytesIO):
            path.seek(0)
        return pd.read_csv(
            path, sep=None, engine="python", comment="#", skipinitialspace=True, encoding=encoding
        )

    try:
        return read("utf-8-sig")  # also without the mark at the start that spreadsheets write
    except UnicodeDecodeError:  # as programs on Windows write degrees and umlauts
        return read("cp1252")
    except csv.Error:
        raise ValueError("No columns are found: is it empty, or without a separator?") from None


def _mat(path: Path) -> Any:
    from scipy.io import loadmat

    found = {name: np.asarray(one) for name, one in loadmat(path, squeeze_me=True).items()}
    found = {name: one for name, one in found.items() if not name.startswith("__")}
    structs = {name: one.dtype.names for name, one in found.items() if one.dtype.names}
    columns = {name: one for name, one in found.items() if name not in structs}
    if structs and sum(one.size > 1 for one in columns.values()) < 2:  # times and a column
        name, fields = next(iter(structs.items()))
        raise ValueError(
            f"{name} is a struct with the fields {', '.join(fields)}. Save its fields as variables:"
            f" in MATLAB, save('trace.mat', '-struct', '{name}')."
        )
    return columns


def _nc(path: Path) -> Any:
    import xarray as xr

    # Numbers of milliseconds stay numbers with their unit.
    with xr.open_dataset(path, decode_timedelta=False) as found:
        return found.load()


def _tdms(path: Path) -> Any:
    """Channels by name, or by group and name where two have the same one."""
    from nptdms import TdmsFile

    channels = [one for group in TdmsFile.read(path).groups() for one in group.channels()]
    names = [one.name for one in channels]
    found = {
        one.name if names.count(one.name) == 1 else f"{one.group_name}/{one.name}":
        _with_unit(one[:], one.properties.get("unit_string"))
        for one in channels
    }  # fmt: skip
    timed = [one.time_track() for one in channels if "wf_increment" in one.properties]
    return _over_time(found, timed)


def _mf4(path: Path) -> Any:
    """Channels over the times of all, nan where a channel has no sample."""
    from asammdf import MDF

    with MDF(path) as found:
        channels = [one for one in found.iter_channels(copy_master=True) if one.samples.ndim == 1]
    times = np.unique(np.concatenate([one.timestamps for one in channels]))
    columns: dict[str, Any] = {TIME: times}
    for one in channels:
        samples = np.full(times.size, np.nan)
        samples[np.searchsorted(times, one.timestamps)] = one.samples
        columns[one.name] = _with_unit(samples, one.unit)
    return columns


def _uff(path: Path) -> Any:
    """Functions of time by the first line of their names, or by node and direction."""
    import pyuff

    given = pyuff.UFF(str(path)).read_sets()
    sets = [
        one for one in (given if isinstance(given, list) else [given])
        if one["type"] == _FUNCTION and one["func_type"] == _OVER_TIME
    ]  # fmt: skip
    names = [one["id1"].strip() for one in sets]
    found = {
        name if name not in ("", "NONE") and names.count(name) == 1
        else f"{one['rsp_node']}:{one['rsp_dir']}":
        _with_unit(one["data"], one.get("ordinate_axis_units_lab"))
        for name, one in zip(names, sets, strict=True)
    }  # fmt: skip
    times = [_with_unit(one["x"], one.get("abscissa_axis_units_lab")) for one in sets]
    return _over_time(found, times)


def _with_unit(samples: Any, unit: Any) -> xr.DataArray:
    """Samples with the unit that a file states for them, if any."""
    import xarray as xr

    return xr.DataArray(np.asarray(samples), dims=TIME, attrs={"units": unit or ""})


def _over_time(columns: dict[str, Any], times: list[Any]) -> Mapping[str, Any]:
    """Columns with the times that they have in common.

    Raises ``ValueError`` if their times differ.
    """
    if not times or TIME in columns:
        return columns
    if any(not np.array_equal(one, times[0]) for one in times):
        raise ValueError("its channels have different times; give a mapping of those of one time")
    return {TIME: times[0], **columns}


_FORMATS = {
    ".csv": _Format(_csv), ".txt": _Format(_csv), ".mat": _Format(_mat), ".nc": _Format(_nc),
    ".tdms": _Format(_tdms, "nptdms"), ".mf4": _Format(_mf4, "asammdf"),
    ".uff": _Format(_uff, "pyuff"), ".unv": _Format(_uff, "pyuff"),
}  # fmt: skip
SUFFIXES = tuple(_FORMATS)
"""The suffixes of files that can be read."""


def read_file(path: Path) -> Any:
    """The contents of a file of a trace: a mapping, a DataFrame or a Dataset.

    Raises ``InputError`` for another suffix, and for a file that cannot be read.
    """
    found = _FORMATS.get(path.suffix.lower())
    if found is None:
        raise wrong("trace", str(path), f"a file that ends in {', '.join(SUFFIXES)}")
    if not path.is_file():
        raise wrong("trace", str(path), "the path of a file that exists")
    if found.package:
        check_installed(f"trace = {str(path)!r}", [found.package], "traces")
    return _read(str(path), path.suffix, lambda: found.read(path))


def read_csv(name: str, content: bytes) -> Any:
    """Return the contents of a .csv file that is in memory, as ``read_file`` does.

    Raises ``InputError`` as ``read_file``.
    """
    return _read(name, ".csv", lambda: _csv(BytesIO(content)))


def _read(name: str, suffix: str, read: Callable[[], Any]) -> Any:
    try:
        return read()
    except Exception as error:  # readers raise errors of many types
        raise wrong("trace", name, f"a {suffix} file that can be read", str(error)) from None
