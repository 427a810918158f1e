"""Datasets as netCDF-4, in a file or in memory."""

from __future__ import annotations

import io
from collections.abc import Callable
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any

from wedgebrake.model.files import whole

if TYPE_CHECKING:
    import xarray as xr


def write_netcdf(dataset: xr.Dataset, target: Path) -> None:
    """Write a dataset as netCDF-4, atomically: after an error an existing file is unchanged.

    Raises ``OutputError`` if the file cannot be written, for example on a full disk.
    """
    with whole(target) as file:
        _put(dataset, file)


def netcdf(dataset: xr.Dataset) -> bytes:
    """Content of the netCDF-4 file of a dataset."""
    content = io.BytesIO()
    _put(dataset, content)
    return content.getvalue()


def _put(dataset: xr.Dataset, file: IO[bytes]) -> None:
    import h5netcdf
    from xarray.backends import H5NetCDFStore

    guarded = _Guarded(file)
    try:
        with h5netcdf.File(guarded, "w") as root:
            dataset.dump_to_store(H5NetCDFStore(root))
    finally:
        guarded.check()


class _Guarded:
    """File object whose write operations never fail for HDF5, even on a full disk.

    After a failed write HDF5 cannot close its file, tries again when the process exits, and
    crashes. The first error, or Ctrl-C, is therefore stored for ``check``, and all later
    operations are skipped.
    """

    def __init__(self, file: IO[bytes]) -> None:
        self._file = file
        self._error: BaseException | None = None
        self._place = self._size = 0

    def check(self) -> None:
        """Raise the stored error, if any."""
        if self._error is not None:
            raise self._error

    def _do(self, work: Callable[[], object]) -> None:
        if self._error is None:
            try:
                work()
            except BaseException as error:
                self._error = error

    def _there(self, work: Callable[[], object]) -> None:
        self._do(lambda: (self._file.seek(self._place), work()))

    # The part of the binary file interface that h5py uses.

    def seek(self, offset: int, whence: int = io.SEEK_SET) -> int:
        self._place = offset + (0, self._place, self._size)[whence]
        return self._place

    def tell(self) -> int:
        return self._place

    def write(self, content: Any) -> int:
        view = memoryview(content).cast("B")
        self._there(lambda: self._file.write(view))
        self._place += len(view)
        self._size = max(self._size, self._place)
        return len(view)

    def read(self, size: int) -> bytes:
        found: list[bytes] = []
        self._there(lambda: found.append(self._file.read(size)))
        content = b"".join(found).ljust(size, b"\0")
        self._place += size
        return content

    def truncate(self, size: int) -> int:
        self._do(lambda: self._file.truncate(size))
        self._size = size
        return size

    def flush(self) -> None:
        self._do(self._file.flush)
