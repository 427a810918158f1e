"""The store of a sweep: a zarr folder that an interrupted run goes on with.

It knows nothing of brakes: arrays over points, cut into chunks, and a description of what
they are computed from. Each file appears whole or not at all and carries a checksum; the
chunk of ``status`` is written last, and its presence says that the chunk is done.

Beside the zarr arrays it keeps four small files in ``status/.store``. There, unlike in the
root, no reader of zarr stumbles on them, and they move and vanish with the store:
identity.json (what is computed), lock, writer.json (who writes), partial (a file that is
being written).
"""

from __future__ import annotations

import contextlib
import json
import os
import secrets
import shutil
from collections.abc import Mapping
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, NamedTuple

from wedgebrake.errors import InputError, OutputError
from wedgebrake.sweeps.store_files import WriterLock, is_folder, is_there, reason, replace_file
from wedgebrake.sweeps.store_identity import description, verify
from wedgebrake.sweeps.store_layout import (
    IDENTITY,
    MARKER,
    PARTIAL,
    PRIVATE,
    ChunkIndex,
    Layout,
    fault,
)

if TYPE_CHECKING:
    from typing import Self

    import xarray as xr


class Damage(NamedTuple):
    """A file of a finished chunk that is not as it was written."""

    chunk: ChunkIndex
    variable: str
    why: str


class SweepStore:
    """Results of a sweep on disk, written chunk by chunk by one process at a time.

    ``SweepStore.open`` gives one; use it as a context manager, or ``close`` it.

    path    : the store's folder
    layout  : what is in it. On a store that was there before, its chunks are those that it
              has, whatever was asked for
    damaged : what the last ``done`` found broken; empty before
    """

    def __init__(self, path: Path, layout: Layout, lock: WriterLock) -> None:
        self.path = path
        self.layout = layout
        self.damaged: list[Damage] = []
        self._lock = lock
        self._open = True

    @classmethod
    def open(
        cls, path: str | os.PathLike[str], layout: Layout, identity: Any, *, resume: bool = False
    ) -> Self:
        """Create a store, or go on with one.

        path     : the store's folder; the folder that it is in must exist
        layout   : what is in it
        identity : exactly what is computed, as nested dicts, lists, texts and numbers
        resume   : False: ``path`` must not exist. True: it may, and must then be a store of
                   the same identity

        Raises ``InputError`` for a path that exists (or, with ``resume``, is no such store,
        is damaged, or is of another identity: the message says what differs) and where
        another process is writing; ``OutputError`` where nothing can be written. Nothing is
        created then.
        """
        target = _as_path(path)
        record = description(layout, identity)
        _check_path(target, resume=resume)
        if not os.path.lexists(target) and not _create(target, layout, record) and not resume:
            raise _exists(target)
        _check_kind(target)
        lock = WriterLock(target / PRIVATE, target)
        lock.acquire()
        try:
            layout = verify(target, layout, record)
            # Of a process that was killed while it wrote.
            with contextlib.suppress(OSError):
                (target / PARTIAL).unlink()
            return cls(target, layout, lock)
        except BaseException:
            lock.release()
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def close(self) -> None:
        """Let others write. ``dataset`` still works."""
        self._open = False
        self._lock.release()

    def done(self) -> set[ChunkIndex]:
        """The chunks that are complete and whole, found by reading every one of their bytes.

        A finished chunk with a file that is missing, cut off or altered is not among them;
        ``damaged`` says which and why, and writing the chunk again mends it. One file is in
        memory at a time.
        """
        self.damaged = []
        whole = set()
        for index in self._finished():
            found = [
                Damage(index, name, why)
                for name, key in self.layout.keys(index).items()
                if (why := fault(self.path / key)) is not None
            ]
            self.damaged += found
            if not found:
                whole.add(index)
        return whole

    def write(self, index: ChunkIndex, arrays: Mapping[str, Any]) -> None:
        """Put a chunk's results in the store; with return, the chunk is done.

        index  : the chunk's number along each dim of the points
        arrays : every variable -> its values at the points ``layout.slices(index)``

        From one thread at a time. Raises ``OutputError`` where that fails, a full disk for
        example; all other chunks are as they were, and of this one nothing is left.
        """
        if not self._open:
            raise ValueError(f"{self.path}: the store is closed.")
        files = self.layout.encode(index, arrays)
        marker = self.path / self.layout.key(MARKER, index)
        try:
            # Where the chunk is being mended: from here to the end it is not done.
            marker.unlink(missing_ok=True)
            for key, content in files.items():
                replace_file(self.path / key, content, self.path / PARTIAL)
        except OSError as error:
            for key in reversed(files):
                with contextlib.suppress(OSError):
                    (self.path / key).unlink(missing_ok=True)
            raise self._not_written(error) from None

    def dataset(self) -> xr.Dataset:
        """All of the store, labelled; values are read from disk when they are used.

        Points of chunks that are not done have ``status`` 0 and the fill values of the
        other variables.
        """
        import numpy as np
        import xarray as xr

        dataset = xr.open_dataset(self.path, engine="zarr", consolidated=False, chunks=None)
        # In the order of the layout, not in that of the folder.
        dataset = dataset[[variable.name for variable, _ in self.layout.variables]]
        # Texts of any length on disk; of a fixed length in numpy and in netCDF.
        texts = [name for name, one in dataset.coords.items() if one.dtype.kind in "OT"]
        return dataset.assign_coords(
            {
                name: (name, np.array(dataset[name].values.tolist()), dataset[name].attrs)
                for name in texts
            }
        )

    def _finished(self) -> list[ChunkIndex]:
        """The chunks that have their marker, whole or not."""
        return [
            index
            for index in self.layout.indices()
            if is_there(self.path / self.layout.key(MARKER, index))
        ]

    def _not_written(self, error: OSError) -> OutputError:
        place = f"path = {str(self.path)!r}"
        if not is_there(self.path / IDENTITY):
            return OutputError(
                f"{place}: cannot be written ({reason(error)}): the store is no longer there,"
                " removed or moved while the sweep was running. Where it was moved, give its"
                " new name and resume=True (--resume on the command line)."
            )
        return OutputError(
            f"{place}: cannot be written ({reason(error)}). What is there is valid:"
            f" {len(self._finished())} of {len(self.layout.indices())} chunks are done. Mend the"
            " cause, for example make room on the disk; the same call with resume=True"
            " (--resume on the command line) then goes on."
        )


def _as_path(path: str | os.PathLike[str]) -> Path:
    try:
        # Absolute: the working directory may change while a sweep runs.
        target = Path(path).absolute()
    except TypeError:
        raise InputError(f"path = {path!r}: must be the name of a folder.") from None
    except FileNotFoundError:
        raise InputError(
            f"path = {str(path)!r}: the working directory, to which it is relative, no longer"
            " exists. Change to an existing directory, or give an absolute path."
        ) from None
    if "\0" in str(target):
        raise InputError(f"path = {path!r}: no name of a folder has a null character.")
    return target


def _check_path(target: Path, *, resume: bool) -> None:
    """Refuse what can be refused before anything is touched."""
    if os.path.lexists(target):
        if not resume:
            raise _exists(target)
    elif not is_folder(target.parent):
        raise InputError(
            f"path = {str(target)!r}: the folder {str(target.parent)!r} does not exist. Create"
            " it, or choose a folder that exists."
        )


def _exists(target: Path) -> InputError:
    return InputError(
        f"path = {str(target)!r}: exists already. Go on with the sweep in it by resume=True"
        " (--resume on the command line), or choose another name."
    )


def _create(target: Path, layout: Layout, record: dict[str, Any]) -> bool:
    """Build the store beside its place and rename it; False where another process was first."""
    beside = target.with_name(f".{target.name}.{secrets.token_hex(6)}.part")
    files = {**layout.files, IDENTITY: json.dumps(record, indent=1).encode()}
    try:
        try:
            beside.mkdir()
            for key, content in files.items():
                (beside / key).parent.mkdir(parents=True, exist_ok=True)
                (beside / key).write_bytes(content)
            beside.rename(target)
        except BaseException:
            shutil.rmtree(beside, ignore_errors=True)
            raise
    except OSError as error:
        if os.path.lexists(target):
            return False
        raise OutputError(
            f"path = {str(target)!r}: cannot be created ({reason(error)}). Choose a folder that"
            " exists, that you may write to and that has room."
        ) from None
    return True


def _check_kind(target: Path) -> None:
    """Refuse a path that is no store of a sweep."""
    if is_there(target / IDENTITY):
        return
    if not is_folder(target):
        what = "is no folder"
    elif any(is_there(target / name) for name in ("zarr.json", ".zgroup", ".zarray")):
        what = f"is a zarr folder, but not the store of a sweep ({IDENTITY} is not in it)"
    else:
        what = f"is not the store of a sweep ({IDENTITY} is not in it)"
    raise InputError(
        f"path = {str(target)!r}: {what}; nothing in it was touched. Choose another name."
    )
