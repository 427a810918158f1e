"""The store of a sweep: a zarr folder from which an interrupted sweep can be resumed.

Every file is written under another name and renamed, by zarr or here, so that it exists completely
or not at all. A chunk of results is one file with a checksum: an interrupted or damaged chunk is
computed again, as is one that was copied from elsewhere, which its mark reveals (``store_format``).
Chunks are not forced to the disk (5 ms each): after a power failure the checksums reveal which were
lost. The description of the store is, since all would be lost without it. An OS lock, which ends
with its process, admits one writer.

``results/.lock`` and ``results/.writer`` are not part of zarr; readers of zarr do not look
for files inside an array.
"""

from __future__ import annotations

import os
import re
import secrets
import shutil
import socket
import time
from collections.abc import Mapping
from contextlib import suppress
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import zarr
from filelock import FileLock, Timeout
from numpy.typing import NDArray

from wedgebrake.errors import InputError, OutputError
from wedgebrake.model.validation import wrong
from wedgebrake.sweeps.grid import ChunkIndex, Chunks
from wedgebrake.sweeps.plan import Plan
from wedgebrake.sweeps.store_format import (
    FOREIGN,
    GROUP,
    RESULTS,
    StoreBackend,
    canonical,
    damaged,
    differences,
    marks,
    metadata,
    pack,
    plain,
    stored_attributes,
)

if TYPE_CHECKING:
    from typing import Self

    import xarray as xr

# The process that holds the lock, in words.
_WRITER = f"{RESULTS}/.writer"
_MOST_LINES = 8
# Age [s] from which a folder beside a store, in which it was being created, is that of a process
# that was killed: creating takes milliseconds.
_ABANDONED = 3600.0


class Damage(NamedTuple):
    """A chunk whose file is not as it was written."""

    chunk: ChunkIndex
    why: str


class SweepStore:
    """Results of a sweep on disk, written chunk by chunk by one process at a time.

    Created by ``SweepStore.open``; a context manager that releases the store for other writers.

    path    : folder of the store
    chunks  : its chunks. A store that is resumed keeps those that it has
    damaged : chunks that ``completed`` found damaged
    """

    def __init__(self, path: Path, plan: Plan, lengths: Mapping[str, int], lock: FileLock) -> None:
        self.path = path
        self.chunks = Chunks(plan.grid.sizes, lengths)
        self.damaged: list[Damage] = []
        self._plan, self._lock = plan, lock
        self._results: Any = zarr.open_array(path / RESULTS, mode="r+")
        self._checksum = stored_attributes(path)["checksum"]
        self._completed: set[ChunkIndex] = set()

    @classmethod
    def open(
        cls, path: str | os.PathLike[str], plan: Plan, chunks: Chunks, *, resume: bool = False
    ) -> Self:
        """Create a store, or resume one.

        path   : folder of the store; its parent folder must exist
        chunks : chunks of a new store
        resume : False: ``path`` must not exist. True: it may exist, and must then be a store of
                 the same sweep

        Raises ``InputError`` if the path exists (with ``resume``, if it is not a store, is
        damaged or belongs to another sweep) and if another process writes to it; ``OutputError``
        if it cannot be written. In these cases nothing is changed.
        """
        target = _absolute(path)
        created = not os.path.lexists(target) and _create(target, metadata(plan, chunks.lengths))
        if not (created or resume):
            raise InputError.of(
                "path", target, "exists already. Go on with the sweep in it by resume=True"
                " (--resume on the command line), or choose another name.",
            )  # fmt: skip
        lengths = _verified_lengths(target, plan)
        lock = _locked(target)
        try:
            # Files that a killed process was writing.
            for partial in (target / RESULTS).rglob("*.partial"):
                partial.unlink(missing_ok=True)
            _remove_abandoned(target)
            return cls(target, plan, lengths, lock)
        except BaseException:
            _release(target, lock)
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Release the store for other writers. ``dataset`` remains usable."""
        _release(self.path, self._lock)

    def completed(self) -> set[ChunkIndex]:
        """Return the chunks that are complete and intact, after reading all of them.

        ``damaged`` then lists those that are not intact. Writing a chunk again repairs it.
        """
        self.damaged, self._completed = [], set()
        for index in self.chunks.indices():
            if not self.path.joinpath(RESULTS, "c", "0", *map(str, index)).is_file():
                continue
            try:
                found = self._results[self._region(index)][-1]
            except (OSError, RuntimeError, ValueError) as error:  # of the disk, zstd, the checksum
                self.damaged.append(Damage(index, str(error)))
                continue
            if np.array_equal(found, self._marks(index)):
                self._completed.add(index)
            else:
                self.damaged.append(Damage(index, f"it is {FOREIGN}"))
        return set(self._completed)

    def write(self, index: ChunkIndex, results: Mapping[str, Any]) -> None:
        """Write the results of a chunk, from an array for each variable.

        Raises ``OutputError`` if that fails, for example on a full disk. Then the store is as
        it was before.
        """
        if not (self.path / GROUP).exists():
            raise OutputError.of(
                "path", self.path, "cannot be written: the store is no longer there, removed"
                " or moved while the sweep was running. If it was moved, give its new name and"
                " resume=True (--resume on the command line).",
            )  # fmt: skip
        try:
            content = pack(self._plan, results), self._marks(index)[None]
            self._results[self._region(index)] = np.concatenate(content)
        except OSError as error:
            raise OutputError.of(
                "path", self.path, f"cannot be written ({_reason(error)}). The store is valid:"
                f" {len(self._completed)} of {len(self.chunks.indices())} chunks are done. Remove"
                " the cause, for example make room on the disk; the same call with resume=True"
                " (--resume on the command line) then goes on.",
            ) from None  # fmt: skip
        self._completed.add(index)

    def dataset(self) -> xr.Dataset:
        """Return the labelled result, with values read from disk when they are used."""
        import xarray as xr

        return xr.open_dataset(self.path, engine=StoreBackend)

    def _marks(self, index: ChunkIndex) -> NDArray[np.float64]:
        """Return the marks of the points of a chunk."""
        return marks(self._results, self._checksum, self._region(index)[1:])

    def _region(self, index: ChunkIndex) -> tuple[slice, ...]:
        return slice(None), *self.chunks.slices(index).values()


def _locked(store: Path) -> FileLock:
    """Acquire the exclusive right to write to a store, or raise an error with its holder."""
    # The thread that closes the store may be another one.
    lock = FileLock(store / RESULTS / ".lock", timeout=0, thread_local=False)
    # Apart from the file of the lock, which others cannot read on Windows.
    writer = store / _WRITER
    try:
        lock.acquire()
    except Timeout:
        holder = ""
        with suppress(OSError, ValueError):
            holder = writer.read_text("utf-8")
        raise InputError.of(
            "path", store, f"{holder or 'another process'} is writing in it. Wait until it"
            " ends, or end it: what it has finished stays, and resume=True (--resume on the command"
            " line) goes on with it. Or choose another name.",
        ) from None  # fmt: skip
    except (OSError, NotImplementedError) as error:
        raise OutputError.of(
            "path", store, f"cannot be locked for writing ({_reason(error)}). Choose a folder"
            " that you may write to, on a disk that supports file locks.",
        ) from None  # fmt: skip
    since = datetime.now(UTC).isoformat(sep=" ", timespec="seconds")
    with suppress(OSError):  # it serves the message above only
        writer.write_text(
            f"process {os.getpid()} on {socket.gethostname()} (since {since})", "utf-8"
        )
    return lock


def _release(store: Path, lock: FileLock) -> None:
    if lock.is_locked:
        with suppress(OSError):
            (store / _WRITER).unlink()
        lock.release()


def _absolute(path: str | os.PathLike[str]) -> Path:
    try:
        # The working directory may change during the sweep.
        target = Path(path).absolute()
    except (TypeError, FileNotFoundError):
        raise wrong(
            "path", path, "the path of a folder",
            "A relative path needs a working directory that exists.",
        ) from None  # fmt: skip
    if not os.path.lexists(target) and not target.parent.is_dir():
        raise InputError.of(
            "path", target, f"the folder {str(target.parent)!r} does not exist. Create it, or"
            " choose a folder that exists.",
        )  # fmt: skip
    return target


def _create(target: Path, files: Mapping[str, bytes]) -> bool:
    """Write the files in a folder beside the target and rename it; False if that now exists."""
    beside = target.with_name(f".{target.name}.{secrets.token_hex(6)}.part")
    try:
        try:
            for key, content in files.items():
                (beside / key).parent.mkdir(parents=True, exist_ok=True)
                _write_to_disk(beside / key, content)
            for folder in {(beside / key).parent for key in files}:
                _sync_folder(folder)
            beside.rename(target)
            _sync_folder(target.parent)
        except BaseException:
            shutil.rmtree(beside, ignore_errors=True)
            raise
    except (OSError, ValueError) as error:  # ValueError: a null character
        if os.path.lexists(target):
            return False
        raise OutputError.of(
            "path", target, f"cannot be created ({_reason(error)}). Choose a folder that"
            " exists, that you may write to and that has room.",
        ) from None  # fmt: skip
    return True


def _write_to_disk(path: Path, content: bytes) -> None:
    with path.open("wb") as file:
        file.write(content)
        file.flush()
        os.fsync(file.fileno())


def _sync_folder(folder: Path) -> None:
    """Force the names in a folder to the disk, where the system can."""
    with suppress(OSError):  # Windows opens no folders
        number = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(number)
        finally:
            os.close(number)


def _remove_abandoned(target: Path) -> None:
    """Remove folders in which processes that were killed were creating this store."""
    name = re.compile(rf"\.{re.escape(target.name)}\.[0-9a-f]{{12}}\.part")
    with suppress(OSError):  # they do no harm
        for one in target.parent.iterdir():
            if name.fullmatch(one.name) and time.time() - one.stat().st_mtime > _ABANDONED:
                shutil.rmtree(one, ignore_errors=True)


def _verified_lengths(target: Path, plan: Plan) -> dict[str, int]:
    """Return the chunk lengths of a store after comparing all of its metadata with the plan."""
    stored = stored_attributes(target)
    lengths = dict(stored["chunks"])
    lines = list(differences(stored["identity"], plain(plan.identity())))
    if lines:
        more = len(lines) - _MOST_LINES
        lines = lines[:_MOST_LINES] + ([f"and {more} more"] if more > 0 else [])
        text = "\n  ".join(["holds another sweep:", *lines])
        raise InputError.of(
            "path", target, f"{text}\nGive what it was computed with (and, where the version"
            " differs, install that one) to go on with it, or choose another name.",
        )  # fmt: skip
    if not all(type(lengths.get(dim)) is int and lengths[dim] > 0 for dim in plan.grid.sizes):
        raise damaged(target, GROUP)
    for key, content in metadata(plan, lengths).items():
        try:
            intact = canonical((target / key).read_bytes()) == canonical(content)
        except (OSError, ValueError):
            intact = False
        if not intact:
            raise damaged(target, key)
    return lengths


def _reason(error: Exception) -> str:
    """Return the message of an error as part of a sentence."""
    return (getattr(error, "strerror", None) or str(error)).lower()
