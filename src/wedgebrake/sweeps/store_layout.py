"""The arrays of a sweep's store as zarr v3: shapes, chunks, metadata, bytes of a chunk.

zarr-python writes the metadata and the coordinates. The chunks of the results are put
together here, as the format prescribes and byte for byte as zarr-python would: it takes
1.6 ms for each of a chunk's twenty small arrays, thirty times as long, and a process killed
in its LocalStore leaves half a file (before 3.1.3) or a file of another name.
"""

from __future__ import annotations

import functools
import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from wedgebrake.sweeps.results import Variable
from wedgebrake.sweeps.store_files import reason

# Never split; every other dimension is one of the points.
PERIOD = "period"
# Written last; where it is, the chunk is done.
MARKER = "status"

# Files of a store that are none of zarr's. No reader of zarr looks for files inside an array.
PRIVATE = f"{MARKER}/.store"
IDENTITY = f"{PRIVATE}/identity.json"
PARTIAL = f"{PRIVATE}/partial"

ChunkIndex = tuple[int, ...]

_ZSTD_LEVEL = 0
_CHECKSUM_BYTES = 4


@dataclass(frozen=True)
class Layout:
    """What is in a store and how it is cut into chunks.

    dims      : name -> size, in order. All but "period" are dimensions of the points
    variables : (variable, its dims): the dims of the points, in their order, and "period"
                for some; one of them is ``status``
    coords    : name of a dim -> (its values, their attributes)
    chunks    : name of a dim of the points -> length of a chunk; the whole dim by default
    attrs     : attributes of the dataset, as JSON knows them
    """

    dims: Mapping[str, int]
    variables: Sequence[tuple[Variable, Sequence[str]]]
    coords: Mapping[str, tuple[Any, Mapping[str, Any]]] = field(default_factory=dict)
    chunks: Mapping[str, int] = field(default_factory=dict)
    attrs: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Refuse what no caller of ours should ask for."""
        if MARKER not in [variable.name for variable, _ in self.variables]:
            raise ValueError(f"variables: {MARKER!r} must be one of them.")
        for variable, dims in self.variables:
            if tuple(name for name in dims if name != PERIOD) != self.point_dims:
                raise ValueError(f"{variable.name}: dims {dims!r}, points {self.point_dims!r}.")
        if not self.point_dims or min(self.dims.values()) < 1:
            raise ValueError(f"dims = {self.dims!r}: at least one of points, none empty.")
        if not set(self.chunks) <= set(self.point_dims) or min(self.chunks.values(), default=1) < 1:
            raise ValueError(f"chunks = {self.chunks!r}: at least 1, over {self.point_dims!r}.")

    @property
    def point_dims(self) -> tuple[str, ...]:
        """The dims that the chunks divide."""
        return tuple(name for name in self.dims if name != PERIOD)

    @property
    def names(self) -> list[str]:
        """Names of the variables in the order of writing: the marker last."""
        return sorted((one.name for one, _ in self.variables), key=lambda name: name == MARKER)

    def length(self, dim: str) -> int:
        """Length of a chunk along a dim."""
        return min(self.chunks.get(dim, self.dims[dim]), self.dims[dim])

    def indices(self) -> list[ChunkIndex]:
        """The chunks, each by its number along every dim of the points, the last fastest."""
        counts = [math.ceil(self.dims[name] / self.length(name)) for name in self.point_dims]
        return list(itertools.product(*map(range, counts)))

    def slices(self, index: ChunkIndex) -> dict[str, slice]:
        """Which points a chunk has, for each dim of them."""
        found = {}
        for name, number in zip(self.point_dims, index, strict=True):
            start = number * self.length(name)
            if not 0 <= start < self.dims[name]:
                raise ValueError(f"chunk {index!r}: no such chunk along {name!r}.")
            found[name] = slice(start, min(start + self.length(name), self.dims[name]))
        return found

    def key(self, variable: str, index: ChunkIndex) -> str:
        """Path of a chunk's file inside the store."""
        numbers = dict(zip(self.point_dims, index, strict=True))
        dims = next(dims for one, dims in self.variables if one.name == variable)
        return "/".join([variable, "c", *(str(numbers.get(name, 0)) for name in dims)])

    def keys(self, index: ChunkIndex) -> dict[str, str]:
        """Variable -> path of its file, in the order of writing."""
        return {name: self.key(name, index) for name in self.names}

    def encode(self, index: ChunkIndex, arrays: Mapping[str, Any]) -> dict[str, bytes]:
        """The files of a chunk: path -> bytes, in the order of writing.

        arrays : variable -> values at the chunk's points

        A chunk at the end of an axis is filled up to the full length, as the format has it.
        """
        if set(arrays) != set(self.names):
            raise ValueError(f"arrays: {sorted(set(arrays) ^ set(self.names))} missing or unknown.")
        parts = self.slices(index)
        files = {}
        for variable, dims in sorted(self.variables, key=lambda one: one[0].name == MARKER):
            name = variable.name
            values = np.asarray(arrays[name])
            part = tuple(parts.get(dim, slice(0, self.dims[dim])) for dim in dims)
            shape = tuple(one.stop - one.start for one in part)
            if values.shape != shape:
                raise ValueError(f"{name}: shape {values.shape}, chunk {index!r} has {shape}.")
            full = np.full([self.length(dim) for dim in dims], variable.fill, _stored(variable))
            np.copyto(full[tuple(map(slice, shape))], values, casting="same_kind")
            files[self.key(name, index)] = _pack(full)
        return files

    @functools.cached_property
    def files(self) -> dict[str, bytes]:
        """Metadata and coordinates: path -> bytes. It takes zarr some 2 ms an array."""
        import zarr
        from zarr.codecs import BytesCodec, Crc32cCodec, ZstdCodec
        from zarr.storage import MemoryStore

        memory: dict[str, Any] = {}
        group = zarr.create_group(
            store=MemoryStore(memory), zarr_format=3, attributes=dict(self.attrs)
        )
        codecs = (ZstdCodec(level=_ZSTD_LEVEL, checksum=False), Crc32cCodec())
        for variable, dims in self.variables:
            group.create_array(
                variable.name,
                shape=tuple(self.dims[dim] for dim in dims),
                chunks=tuple(self.length(dim) for dim in dims),
                dtype=variable.dtype,
                fill_value=np.dtype(variable.dtype).type(variable.fill),
                serializer=BytesCodec(endian="little"),
                compressors=codecs,
                dimension_names=tuple(dims),
                attributes=variable.attributes(),
            )
        for name, (given, attributes) in self.coords.items():
            values = np.asarray(given)
            if values.shape != (self.dims[name],):
                raise ValueError(f"{name}: shape {values.shape}, the dim {self.dims[name]}.")
            text = values.dtype.kind in "UOT"
            array = group.create_array(
                name,
                shape=values.shape,
                chunks=values.shape,
                # Texts of any length: those of a fixed length are no settled part of zarr v3.
                dtype=str if text else values.dtype,
                serializer="auto" if text else BytesCodec(endian="little"),
                compressors=codecs,
                dimension_names=(name,),
                attributes=dict(attributes),
            )
            array[:] = values.astype(object) if text else values
        return {key: buffer.to_bytes() for key, buffer in memory.items()}


def fault(path: Path) -> str | None:
    """What is wrong with the file of a chunk; None where it is as it was written."""
    import google_crc32c

    try:
        content = path.read_bytes()
    except FileNotFoundError:
        return "is missing"
    except OSError as error:
        return f"cannot be read ({reason(error)})"
    if not content:
        return "is empty"
    packed, checksum = content[:-_CHECKSUM_BYTES], content[-_CHECKSUM_BYTES:]
    if google_crc32c.value(packed).to_bytes(_CHECKSUM_BYTES, "little") != checksum:
        return f"is damaged: its checksum does not fit its {len(content)} bytes"
    return None


def _stored(variable: Variable) -> np.dtype[Any]:
    """The type on disk: little-endian on every machine."""
    return np.dtype(variable.dtype).newbyteorder("<")


def _pack(full: np.ndarray[Any, Any]) -> bytes:
    """The codecs of every array, in their order: bytes, zstd, crc32c."""
    import google_crc32c
    from numcodecs import zstd  # type: ignore[import-untyped]

    packed: bytes = zstd.compress(full.tobytes(), _ZSTD_LEVEL)
    checksum: int = google_crc32c.value(packed)
    return packed + checksum.to_bytes(_CHECKSUM_BYTES, "little")
