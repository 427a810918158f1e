"""Files that a command writes: checked before the work, each written completely or not at all."""

from __future__ import annotations

import os
import secrets
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

from wedgebrake.errors import InputError, OutputError, WedgebrakeError
from wedgebrake.model import netcdf
from wedgebrake.model.files import write

if TYPE_CHECKING:
    import xarray as xr


def check_target(option: str, path: Path, suffixes: tuple[str, ...]) -> None:
    """Refuse a path that could not be written, before any work is done.

    Raises ``InputError`` that names the option, the path and the way out.
    """
    if path.suffix.lower() not in suffixes:
        raise InputError(
            f"{option} {path}: must end in {', '.join(suffixes)}; the suffix sets the format. For"
            f" example {option} run{suffixes[0]}."
        )
    beside = path.with_name(f".{path.name}.{secrets.token_hex(6)}.part")
    try:
        is_folder = path.is_dir()
        try:
            beside.touch(exist_ok=False)
        finally:
            beside.unlink(missing_ok=True)
    except FileNotFoundError:
        there = path.parent.is_dir()
        what = "takes no files. Choose" if there else "does not exist. Create it, or choose"
        raise InputError(
            f"{option} {path}: cannot be written: the folder {path.parent} {what} another one."
        ) from None
    except (OSError, ValueError) as error:
        why = getattr(error, "strerror", None) or error
        raise InputError(
            f"{option} {path}: cannot be written ({why}). Choose another name or folder."
        ) from None
    if is_folder:
        raise InputError(f"{option} {path}: is a directory. Give the name of a file.")


def check_files(data: Path | None, picture: Path | None) -> None:
    """Refuse files of ``--out`` and ``--plot`` that could not be written; see ``check_target``."""
    if data is not None:
        check_target("--out", data, (".nc",))
        _check_netcdf(data)
    if picture is not None:
        check_target("--plot", picture, (".png", ".svg", ".pdf"))


def _check_netcdf(path: Path) -> None:
    """Refuse a netCDF file if the netcdf extra is not installed."""
    missing = [name for name in ("h5netcdf", "h5py") if find_spec(name) is None]
    if missing:
        raise InputError(
            f"--out {path}: netCDF needs {' and '.join(missing)}. Install the extra: pip install"
            " 'wedgebrake[netcdf]'."
        )


def write_files(
    **files: tuple[Path | None, Callable[[Path], None]],
) -> tuple[dict[str, Path | None], list[WedgebrakeError]]:
    """Write the picture and the data that were asked for.

    files : "data", "picture" -> the path, and the function that writes it

    Returns where each of them is, and the errors of those that could not be written: the report
    is printed all the same.
    """
    places: dict[str, Path | None] = {"picture": None, "data": None}
    failures = []
    for what, (path, write_to) in files.items():
        try:
            if path is not None:
                write_to(path)
                places[what] = path.resolve()
        except WedgebrakeError as error:
            failures.append(error)
    return places, failures


def draw(path: Path, dataset: xr.Dataset, **options: Any) -> None:
    """Draw a dataset into a file; options as for ``wb.plot``."""
    from wedgebrake.figures.matplotlib.draw import plot
    from wedgebrake.figures.matplotlib.save import save

    save(plot(dataset, **options), path)


def write_netcdf(dataset: xr.Dataset, path: Path) -> None:
    """Write a dataset as netCDF-4, completely or not at all.

    Raises ``OutputError`` if the file cannot be written.
    """
    with _as_option(path):
        netcdf.write_netcdf(dataset, path)


def write_new(content: bytes, path: Path) -> None:
    """Write a new file; after an error no incomplete file remains.

    Raises ``InputError`` if it exists, ``OutputError`` if it cannot be written.
    """
    if os.path.lexists(path):
        raise InputError(f"--out {path}: already exists. Choose another name.")
    with _as_option(path):
        write(path, content)


@contextmanager
def _as_option(path: Path) -> Iterator[None]:
    """Name the option ``--out`` instead of the path in errors raised inside the context."""
    try:
        yield
    except OutputError as error:
        raise OutputError(str(error).replace(f"path = {str(path)!r}", f"--out {path}")) from None
