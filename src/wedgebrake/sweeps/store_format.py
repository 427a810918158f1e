"""Format of a store: one zarr array of all results, and its description in zarr attributes.

``results`` has the dimensions "column" and those of the points. A chunk holds all columns of its
points in one file with a checksum (CRC-32C), so that it is either complete or missing. A variable
is one column, a variable with several values at a point one column for each of them. Whole numbers
are exact in double precision. The last column has the mark of the chunk, a number that depends on
the sweep and on the place of the chunk, so that a file from elsewhere is found. The attributes of
the group contain all that is needed to present the columns as the Dataset of the sweep, which the
xarray engine "wedgebrake" does, and the checksum of the metadata.
"""

from __future__ import annotations

import hashlib
import json
import math
import os
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
import zarr
from numpy.typing import NDArray
from xarray.backends import BackendArray, BackendEntrypoint
from xarray.core import indexing
from zarr.codecs import BytesCodec, Crc32cCodec, ZstdCodec
from zarr.storage import MemoryStore

from wedgebrake.errors import InputError
from wedgebrake.sweeps.plan import Plan

FORMAT = "wedgebrake sweep 6"
RESULTS, GROUP = "results", "zarr.json"

FOREIGN = "that of another place or another sweep"
"""What is wrong with a chunk whose mark is not its own."""
_ABSENT = object()
_LONGEST_VALUE = 60  # characters in a message


def columns(plan: Plan) -> dict[str, slice]:
    """Return the columns of each variable in ``results``."""
    found, start = {}, 0
    for variable in plan.variables:
        stop = start + plan.width(variable)
        found[variable.name] = slice(start, stop)
        start = stop
    return found


def pack(plan: Plan, results: Mapping[str, NDArray[Any]]) -> NDArray[np.float64]:
    """Return the results of some points as (columns, *points)."""
    points = len(plan.grid.sizes)
    return np.concatenate(
        [
            np.moveaxis(
                results[one.name].reshape(*results[one.name].shape[:points], plan.width(one)), -1, 0
            )
            for one in plan.variables
        ],
        dtype=np.float64,
    )


def description(plan: Plan, lengths: Mapping[str, int]) -> dict[str, Any]:
    """Return the attributes of a store; ``lengths`` are those of its chunks."""
    document = {
        "format": FORMAT,
        "identity": plan.identity(),
        "chunks": dict(lengths),
        "variables": {
            one.name: {
                "dims": plan.dims(one),
                "shape": plan.shape(one),
                "columns": [own.start, own.stop],
                "dtype": one.dtype,
                "fill": None if np.isnan(one.fill) else one.fill,
                "attributes": one.attributes(),
            }
            for one, own in zip(plan.variables, columns(plan).values(), strict=True)
        },
        "coordinates": {
            name: {"dim": dim, "values": values.tolist(), "attributes": attributes}
            for name, (dim, values, attributes) in plan.coordinates().items()
        },
        "attributes": plan.attributes(),
    }
    return plain(document)


def plain(document: dict[str, Any]) -> dict[str, Any]:
    """Return a document as JSON returns it: tuples as lists, numbers of NumPy as Python's."""
    result: dict[str, Any] = json.loads(json.dumps(document, default=lambda one: one.tolist()))
    return result


def metadata(plan: Plan, lengths: Mapping[str, int]) -> dict[str, bytes]:
    """Return the files of an empty store: path -> content."""
    files: dict[str, Any] = {}
    group = zarr.create_group(
        store=MemoryStore(files), zarr_format=3, attributes=description(plan, lengths)
    )
    width = max(own.stop for own in columns(plan).values()) + 1
    group.create_array(
        RESULTS,
        shape=(width, *plan.grid.sizes.values()),
        chunks=(width, *(lengths[dim] for dim in plan.grid.sizes)),
        dtype="float64",
        fill_value=np.nan,
        serializer=BytesCodec(endian="little"),
        compressors=(ZstdCodec(level=0), Crc32cCodec()),
        dimension_names=("column", *plan.grid.sizes),
    )
    described = group.attrs.asdict()
    group.attrs["checksum"] = _checksum(described, files[f"{RESULTS}/{GROUP}"].to_bytes())
    return {key: buffer.to_bytes() for key, buffer in files.items()}


def _checksum(attributes: dict[str, Any], array: bytes) -> str:
    """Return the checksum of the attributes of the group and the metadata of the array."""
    text = json.dumps(attributes, sort_keys=True) + canonical(array)
    return hashlib.sha256(text.encode()).hexdigest()


def marks(results: Any, checksum: str, points: Iterable[Any]) -> NDArray[np.float64]:
    """Return the marks of the chunks that hold some points.

    results : the array of the store
    points  : index along each dimension of the points: a number, a slice or an array
    """
    number = np.zeros((), np.int64)
    for one, size, length in zip(points, results.shape[1:], results.chunks[1:], strict=True):
        chunk = np.arange(size)[one] // length
        number = np.add.outer(number * math.ceil(size / length), chunk)
    # Of 48 bits, so that it is a whole number in double precision.
    return (int(checksum[:12], 16) + number).astype(np.float64)


def stored_attributes(store: Path) -> dict[str, Any]:
    """Return the attributes of a store.

    Raises ``InputError`` for another folder, the store of an earlier version, and damaged metadata.
    """
    try:
        found: dict[str, Any] = json.loads((store / GROUP).read_bytes())["attributes"]
        kind = found["format"]
    except (OSError, ValueError, KeyError, TypeError):
        kind = None
    # The first format had an array for each variable.
    early = os.access(store / "status/.store/identity.json", os.F_OK)
    if kind != FORMAT and (early or str(kind).startswith(FORMAT.rstrip("0123456789"))):
        raise InputError.of(
            "path", store, "is the store of another version of wedgebrake, whose format differs."
            " Read or resume it with that version, or choose another name to compute the sweep"
            " again.",
        )  # fmt: skip
    if kind != FORMAT:
        raise InputError.of(
            "path", store, f"is not the store of a sweep, or its {GROUP} is damaged; nothing in"
            " it was touched. Choose another name.",
        )  # fmt: skip
    array = f"{RESULTS}/{GROUP}"
    attributes = dict(found)
    checksum = attributes.pop("checksum", None)
    try:
        intact = checksum == _checksum(attributes, (store / array).read_bytes())
    except (OSError, ValueError):
        raise damaged(store, array) from None
    if not intact:
        raise damaged(store, f"{GROUP} or {array}")
    return found


def damaged(store: Path, file: str) -> InputError:
    """The error for metadata that is damaged."""
    return InputError.of(
        "path", store, f"the store is damaged: {file} is not as it was written. Put that file"
        " back from a copy, or choose another name to compute the sweep again.",
    )  # fmt: skip


class StoreBackend(BackendEntrypoint):
    """The xarray engine "wedgebrake": a store of a sweep, with values read when they are used."""

    description = "Stores of wedgebrake sweeps"
    open_dataset_parameters = ("filename_or_obj", "drop_variables")

    def open_dataset(
        self, filename_or_obj: Any, *, drop_variables: str | Iterable[str] | None = None
    ) -> xr.Dataset:
        """Return the Dataset of the sweep.

        Points that are not computed have ``status`` 0 and the fill values of other variables.

        Raises ``InputError`` for another folder and for damaged metadata; reading values raises
        it for a chunk of another place or sweep.
        """
        store = Path(filename_or_obj)
        found = stored_attributes(store)
        results = zarr.open_array(store / RESULTS, mode="r")
        dataset = xr.Dataset(
            {
                name: xr.Variable(
                    one["dims"],
                    indexing.LazilyIndexedArray(_Column(results, one, found["checksum"])),
                    one["attributes"],
                )
                for name, one in found["variables"].items()
            },
            coords={
                name: (one["dim"], np.array(one["values"]), one["attributes"])
                for name, one in found["coordinates"].items()
            },
            attrs=found["attributes"],
        )
        return dataset.drop_vars(drop_variables or [])


class _Column(BackendArray):
    """A variable in the columns of ``results``, read when it is indexed."""

    def __init__(self, results: Any, variable: dict[str, Any], checksum: str) -> None:
        self._results, self._fill, self._checksum = results, variable["fill"], checksum
        inner = variable["shape"]
        self._columns = np.arange(*variable["columns"]).reshape(inner)
        self.dtype = np.dtype(variable["dtype"])
        self.shape = (*results.shape[1:], *inner)

    def __getitem__(self, key: indexing.ExplicitIndexer) -> NDArray[Any]:
        values: NDArray[Any] = indexing.explicit_indexing_adapter(
            key, self.shape, indexing.IndexingSupport.OUTER, self._read
        )
        return values

    def _read(self, key: tuple[Any, ...]) -> NDArray[Any]:
        count = self._results.ndim - 1
        points, inner = key[:count], key[count:]
        own = self._columns
        for axis in reversed(range(len(inner))):
            own = own[(slice(None),) * axis + (inner[axis],)]
        wanted = [*np.atleast_1d(own).ravel(), self._results.shape[0] - 1]
        *values, found = self._results.oindex[(wanted, *points)]
        strange = ~np.isnan(found) & (found != marks(self._results, self._checksum, points))
        if np.any(strange):
            raise InputError.of(
                "path", self._results.store_path, f"the store is damaged: a chunk is {FOREIGN}."
                " Resume the sweep to compute it again.",
            )  # fmt: skip
        values = np.moveaxis(np.array(values), 0, -1)
        values = values.reshape((*values.shape[:-1], *np.shape(own)))
        if self._fill is not None:
            values = np.where(np.isnan(values), self._fill, values)
        return np.asarray(values, self.dtype)


def differences(stored: Any, wanted: Any, place: str = "") -> Iterator[str]:
    """Iterate over the differences of two nested JSON values, one line each.

    A line names its place with dots and brackets. Of a list only the length, or the first element
    that differs, is compared.
    """
    if isinstance(stored, dict) and isinstance(wanted, dict):
        for name in {**stored, **wanted}:
            inner = f"{place}.{name}" if place else name
            yield from differences(stored.get(name, _ABSENT), wanted.get(name, _ABSENT), inner)
    elif stored == wanted:
        return
    elif isinstance(stored, list) and isinstance(wanted, list) and len(stored) == len(wanted):
        first = next(i for i, one in enumerate(stored) if one != wanted[i])
        yield from differences(stored[first], wanted[first], f"{place}[{first}]")
    else:
        yield f"{place}: {_text(stored)} in the store, {_text(wanted)} now"


def canonical(text: bytes) -> str:
    """Return a text that is equal for equal JSON documents, where 1 and 1.0 differ."""
    return json.dumps(json.loads(text), sort_keys=True)


def _text(value: Any) -> str:
    if value is _ABSENT:
        return "nothing"
    if isinstance(value, list):
        return f"{len(value)} values"
    text = value if isinstance(value, str) and value else json.dumps(value)
    return text if len(text) <= _LONGEST_VALUE else f"{text[: _LONGEST_VALUE - 3]}..."
