"""Datasets as netCDF-4, in a file or in memory."""

from __future__ import annotations

import io
from pathlib import Path
from typing import TYPE_CHECKING

from wedgebrake.model.files import write

if TYPE_CHECKING:
    import xarray as xr


def write_netcdf(dataset: xr.Dataset, target: Path) -> None:
    """Write a dataset as netCDF-4, atomically: after an error an existing file is unchanged.

    Raises ``OutputError`` if the file cannot be written, for example on a full disk.
    """
    write(target, netcdf(dataset))


def netcdf(dataset: xr.Dataset) -> bytes:
    """Content of the netCDF-4 file of a dataset.

    It is made in memory: HDF5 crashes where a write to its file fails.
    """
    import h5netcdf
    from xarray.backends import H5NetCDFStore

    content = io.BytesIO()
    with h5netcdf.File(content, "w") as root:
        dataset.dump_to_store(H5NetCDFStore(root))
    return content.getvalue()
