"""Format of a store: one zarr array of all results, and its description in zarr attributes.

``results`` has the dimensions "column" and those of the points. A chunk holds all columns of its
points in one file with a checksum (CRC-32C), so that it is either complete or missing. A variable
is one column, a variable with several values at a point one column for each of them. Whole numbers
are exact in double precision. The attributes of the group contain all that is needed to present the
columns as the Dataset of the sweep, which the xarray engine "wedgebrake" does.
"""

from __future__ import annotations

import json
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

from wedgebrake.sweeps.plan import Plan

FORMAT = "wedgebrake sweep 3"
RESULTS = "results"

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
            name: {"values": values.tolist(), "attributes": attributes}
            for name, (values, attributes) in plan.coordinates().items()
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
    width = max(own.stop for own in columns(plan).values())
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
    return {key: buffer.to_bytes() for key, buffer in files.items()}


class StoreBackend(BackendEntrypoint):
    """The xarray engine "wedgebrake": a store of a sweep, with values read when they are used."""

    description = "Stores of wedgebrake sweeps"
    open_dataset_parameters = ("filename_or_obj", "drop_variables")

    def open_dataset(
        self, filename_or_obj: Any, *, drop_variables: str | Iterable[str] | None = None
    ) -> xr.Dataset:
        """Return the Dataset of the sweep.

        Points that are not computed have ``status`` 0 and the fill values of other variables.
        """
        group = zarr.open_group(Path(filename_or_obj), mode="r", use_consolidated=False)
        found: Any = group.attrs.asdict()
        if found.get("format") != FORMAT:
            raise ValueError(f"{filename_or_obj}: not a store of a wedgebrake sweep ({FORMAT}).")
        coordinates: Any = found["coordinates"]
        dataset = xr.Dataset(
            {
                name: xr.Variable(
                    one["dims"],
                    indexing.LazilyIndexedArray(_Column(group[RESULTS], one)),
                    one["attributes"],
                )
                for name, one in found["variables"].items()
            },
            coords={
                name: (name, np.array(one["values"]), one["attributes"])
                for name, one in coordinates.items()
            },
            attrs=found["attributes"],
        )
        return dataset.drop_vars(drop_variables or [])


class _Column(BackendArray):
    """A variable in the columns of ``results``, read when it is indexed."""

    def __init__(self, results: Any, variable: dict[str, Any]) -> None:
        self._results, self._fill = results, variable["fill"]
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
        values = self._results.oindex[(np.atleast_1d(own).ravel(), *points)]
        values = np.moveaxis(values, 0, -1)
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
