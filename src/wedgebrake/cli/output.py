"""Files that a command writes: checked before the work, written at once or not at all."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

from wedgebrake.errors import InputError, OutputError

if TYPE_CHECKING:
    import xarray as xr

PICTURES = (".png", ".svg", ".pdf")
DATA = (".nc",)


def check_target(option: str, path: Path | None, suffixes: tuple[str, ...]) -> None:
    """Refuse a path that could not be written, before any work is done.

    Raises ``InputError`` for a wrong suffix, ``OutputError`` for a place that cannot be
    written.
    """
    if path is None:
        return
    if path.suffix.lower() not in suffixes:
        raise InputError(
            f"{option} {path}: must end in {' or '.join(suffixes)}; the suffix sets the format."
        )
    if path.is_dir():
        raise OutputError(f"{option} {path}: is a directory. Give the name of a file.")
    folder = path.parent
    if not folder.is_dir():
        raise OutputError(f"{option} {path}: the folder {folder} does not exist. Create it first.")
    try:
        with tempfile.NamedTemporaryFile(dir=folder, prefix=".wedgebrake-"):
            pass
    except OSError as error:
        raise OutputError(
            f"{option} {path}: cannot be written ({error.strerror}). Choose another folder."
        ) from None


def write_netcdf(dataset: xr.Dataset, path: Path) -> None:
    """Write a dataset as netCDF-4, whole or not at all.

    Raises ``InputError`` where the netcdf extra is not installed, ``OutputError`` where the
    file cannot be written.
    """
    try:
        import h5netcdf  # noqa: F401 - only to see whether both are there
        import h5py  # noqa: F401
    except ImportError:
        raise InputError(
            f"--out {path}: netCDF needs the extra: pip install 'wedgebrake[netcdf]'."
        ) from None
    handle, name = tempfile.mkstemp(dir=path.parent, prefix=".wedgebrake-", suffix=".nc")
    os.close(handle)
    try:
        dataset.to_netcdf(name, engine="h5netcdf")
        Path(name).replace(path)
    except OSError as error:
        raise OutputError(f"--out {path}: cannot be written ({error}).") from None
    finally:
        Path(name).unlink(missing_ok=True)
