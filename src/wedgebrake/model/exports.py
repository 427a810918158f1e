"""Results as files: netCDF-4 with everything, CSV tables, MATLAB files."""

from __future__ import annotations

import csv as _csv
import io
import itertools
import re
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from wedgebrake.arrays import FloatArray
from wedgebrake.model.files import netcdf, write
from wedgebrake.model.validation import check_installed

if TYPE_CHECKING:
    import xarray as xr

SUFFIXES = (".nc", ".csv", ".mat")
"""Suffixes of the files that a result can be written to."""
# Most characters of a name in a MATLAB file.
_LONGEST = 63
_HEADER = b"MATLAB 5.0 MAT-file".ljust(116)


def check_format(option: str, suffix: str) -> None:
    """Raise ``InputError`` if a format needs packages that are not installed."""
    if suffix == ".nc":
        check_installed(option, ("h5netcdf", "h5py"), "netcdf")


def write_result(dataset: xr.Dataset, target: Path) -> None:
    """Write a result in the format of the suffix of a path, atomically.

    Raises ``OutputError`` if the file cannot be written, for example on a full disk.
    """
    write(target, content(dataset, target.suffix.lower()))


def content(dataset: xr.Dataset, suffix: str) -> bytes:
    """Content of the file of a result with one of ``SUFFIXES``."""
    return {".nc": netcdf, ".csv": csv, ".mat": mat}[suffix](dataset)


def csv(dataset: xr.Dataset) -> bytes:
    """A table of a result as CSV, in full precision.

    Lines that begin with "#" state the attributes. Then come the names of the columns with their
    units, as in "velocity disc [rad/s]", and a line for each time, or for each point of a sweep.
    Lists of another length, such as events and Poincare points, are left out.
    """
    text = io.StringIO()
    for name, value in dataset.attrs.items():
        text.write(f"# {name}: {' '.join(str(value).split())}\n")
    rows = _rows(dataset)
    columns = dict(_columns(dataset, rows))
    writer = _csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows(zip(*(one.tolist() for one in columns.values()), strict=True))
    return text.getvalue().encode()


def mat(dataset: xr.Dataset) -> bytes:
    """A result as a MATLAB file, version 5.

    It has each variable and coordinate under its name, with "_" for characters that MATLAB does not
    allow, and the structures ``units`` and ``attributes``.
    """
    from scipy.io import savemat

    found: dict[str, Any] = {}
    units: dict[str, str] = {}
    for name, one in dataset.variables.items():
        word = _word(str(name))
        values = one.to_numpy()
        if values.dtype.kind in "OUS":
            values = np.array(values.tolist(), dtype=object)
        found[word] = values.astype(np.uint8) if values.dtype.kind == "b" else values
        if "units" in one.attrs:
            units[word] = str(one.attrs["units"])
    attributes = {_word(str(name)): value for name, value in dataset.attrs.items()}
    file = io.BytesIO()
    savemat(
        file, {**found, "units": units, "attributes": attributes}, long_field_names=True,
        do_compression=True, oned_as="column",
    )  # fmt: skip
    # The same result gives the same file: without the time at which it is written.
    return _HEADER + file.getvalue()[len(_HEADER) :]


def _word(name: str) -> str:
    """A name that MATLAB accepts."""
    word = re.sub(r"\W", "_", name, flags=re.ASCII)
    return (word if word[:1].isalpha() else f"x{word}")[:_LONGEST]


def _rows(dataset: xr.Dataset) -> tuple[str, ...]:
    """Dimensions of the rows of a table: the time, or those that most variables have."""
    if "time" in dataset.dims:
        return ("time",)
    over = (_numbered(dataset, one) for one in dataset.data_vars.values())
    return max(Counter(over).items(), key=lambda one: one[1], default=((), 0))[0]


def _numbered(dataset: xr.Dataset, variable: xr.DataArray) -> tuple[str, ...]:
    """The dimensions of a variable without those of named parts."""
    return tuple(str(dim) for dim in variable.dims if not _parts(dataset, str(dim)))


def _parts(dataset: xr.Dataset, dim: str) -> list[str]:
    """Names of the parts along a dimension; empty for other dimensions."""
    if dim not in dataset.coords or dataset[dim].dtype.kind not in "OUS":
        return []
    return [str(one) for one in dataset[dim].to_numpy()]


def _columns(dataset: xr.Dataset, rows: tuple[str, ...]) -> Iterator[tuple[str, FloatArray]]:
    """Headings and values of the columns: coordinates of the rows first, then the variables."""
    import xarray as xr

    sizes = xr.DataArray(np.zeros([dataset.sizes[dim] for dim in rows]), dims=rows)
    chosen = [dim for dim in rows if dim in dataset.coords]
    chosen += [
        str(name) for name, one in dataset.coords.items()
        if name not in rows and one.dims and set(one.dims) <= set(rows)
    ]  # fmt: skip
    for name in (*chosen, *dataset.data_vars):
        one = dataset[name]
        if not set(_numbered(dataset, one)) <= set(rows) or (rows and not one.dims):
            continue
        named = [str(dim) for dim in one.dims if dim not in rows]
        unit = one.attrs.get("units", "1")
        for words in itertools.product(*(_parts(dataset, dim) for dim in named)):
            at = {
                dim: _parts(dataset, dim).index(word)
                for dim, word in zip(named, words, strict=True)
            }
            values, _ = xr.broadcast(one.isel(at).drop_vars(one.coords), sizes)
            heading = f"{' '.join([str(name), *words])} [{unit}]"
            yield heading, values.transpose(*rows).to_numpy().ravel()
