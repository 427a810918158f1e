"""Files, written completely or not at all; datasets as netCDF-4."""

from __future__ import annotations

import contextlib
import io
import os
import secrets
from pathlib import Path
from typing import TYPE_CHECKING

from wedgebrake.errors import OutputError

if TYPE_CHECKING:
    import xarray as xr


def write(target: Path, content: bytes) -> None:
    """Write a file atomically: after an error, or Ctrl-C, its previous state is unchanged.

    The content goes to a temporary file in the same folder, which is then renamed.

    Raises ``OutputError`` if the file cannot be written.
    """
    beside = target.with_name(f".{target.name}.{secrets.token_hex(6)}.part")
    try:
        with beside.open("xb") as file:
            file.write(content)
            file.flush()
            # A full disk may be reported only here.
            os.fsync(file.fileno())
        beside.replace(target)
    except BaseException as error:
        with contextlib.suppress(OSError, ValueError):
            beside.unlink()
        if not isinstance(error, OSError | ValueError):  # ValueError: a name with a zero byte
            raise
        reason = str(getattr(error, "strerror", None) or error).lower()
        raise OutputError.of(
            "path", target, f"cannot be written ({reason}). Free disk space, or choose an existing"
            " folder with write permission.",
        ) from None  # fmt: skip


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
