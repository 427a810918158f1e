"""The store of a sweep: killed, damaged, filled up, opened twice, and resumed to the same bytes."""

from __future__ import annotations

import os
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import nullcontext, suppress
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
import zarr
from hypothesis import given, settings
from hypothesis import strategies as st
from store_child import AXES, CHUNKS, PLAN, SETTINGS, fill, results, sweep

import wedgebrake as wb
from wedgebrake.dynamics.enums import MotionClass, StickClass
from wedgebrake.errors import InputError, OutputError
from wedgebrake.sweeps.grid import Chunks
from wedgebrake.sweeps.plan import Plan
from wedgebrake.sweeps.results import PointStatus
from wedgebrake.sweeps.store import SweepStore
from wedgebrake.sweeps.store_format import StoreBackend, differences
from wedgebrake.sweeps.sweep import make_plan

# A whole chunk, and the smallest, at the end of both axes.
INNER, CORNER = (1, 1), (5, 2)
PRIVATE = {".lock", ".writer"}
forks = pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork on this system")


def contents(store: Path) -> dict[str, bytes]:
    """Every file of a store except those of its lock."""
    return {
        one.relative_to(store).as_posix(): one.read_bytes()
        for one in store.rglob("*")
        if one.is_file() and one.name not in PRIVATE
    }


def put(path: Path, files: dict[str, bytes]) -> None:
    for name, content in files.items():
        (path / name).parent.mkdir(parents=True, exist_ok=True)
        (path / name).write_bytes(content)


def key(index: tuple[int, ...]) -> str:
    return "/".join(["results", "c", "0", *map(str, index)])


def begin(path: Path | str, *indices: tuple[int, ...]) -> SweepStore:
    store = SweepStore.open(path, PLAN, CHUNKS)
    for index in indices:
        store.write(index, results(PLAN, CHUNKS, index))
    return store


def reopen(path: Path | str, plan: Plan = PLAN) -> SweepStore:
    return SweepStore.open(path, plan, plan.grid.chunks(1000), resume=True)


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    """The files of a run that was not interrupted."""
    path = tmp_path_factory.mktemp("whole") / "sweep.zarr"
    fill(path)
    return contents(path)


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "sweep.zarr"


# Contents


@settings(max_examples=8, deadline=None)
@given(data=st.data())
def test_any_shape_reads_back(data: st.DataObject) -> None:
    """In any chunks written in any order, in whole and in parts."""
    names = data.draw(st.permutations(["eta", "F0", "initial_angle"]))
    sizes = data.draw(st.lists(st.integers(1, 4), min_size=1, max_size=3))
    axes = {name: np.linspace(0.01, 0.1, size) for name, size in zip(names, sizes, strict=False)}
    follow = data.draw(st.sampled_from([None, names[0]]))
    keep = data.draw(st.booleans())
    plan = make_plan("sweep", wb.paper.system(), axes, follow=follow, keep_points=keep, **SETTINGS)
    lengths = {dim: data.draw(st.integers(1, size)) for dim, size in plan.grid.sizes.items()}
    chunks = Chunks(plan.grid.sizes, lengths)
    everything = Chunks(plan.grid.sizes, plan.grid.sizes)
    expected = plan.dataset(results(plan, everything, (0,) * len(lengths)))
    with tempfile.TemporaryDirectory() as folder:
        with SweepStore.open(Path(folder) / "a.zarr", plan, chunks) as store:
            for index in data.draw(st.permutations(chunks.indices())):
                store.write(index, results(plan, chunks, index))
            assert store.completed() == set(chunks.indices())
        dataset = store.dataset()
        assert not dataset["status"].variable._in_memory
        part = {
            str(dim): data.draw(
                st.integers(0, size - 1)
                | st.slices(size).filter(lambda one, n=size: len(range(n)[one]) > 0)
                | st.lists(st.integers(0, size - 1), min_size=1)
            )
            for dim, size in dataset.sizes.items()
        }
        xr.testing.assert_identical(dataset.isel(part).load(), expected.isel(part))
        xr.testing.assert_identical(dataset.load(), expected)


def test_points_that_are_not_computed_are_marked(path: Path) -> None:
    with begin(path, INNER, CORNER) as store:
        dataset = xr.open_dataset(path, engine=StoreBackend).load()
    known = np.zeros((22, 9), dtype=bool)
    for index in (INNER, CORNER):
        where = CHUNKS.slices(index)
        known[tuple(where.values())] = True
        for name, values in results(PLAN, CHUNKS, index).items():
            np.testing.assert_array_equal(dataset[name].isel(where), values)
    for variable in PLAN.variables:
        values = dataset[variable.name].values[~known]
        np.testing.assert_array_equal(values, np.full_like(values, variable.fill))
    # Which is a class of its own where the variable is one.
    none = {
        "motion": MotionClass.NONE, "stick_class": StickClass.NONE,
        "status": PointStatus.NOT_COMPUTED,
    }  # fmt: skip
    assert none.keys() == {one.name for one in PLAN.variables if one.words}
    for name, code in none.items():
        assert np.all(dataset[name].values[~known] == code)
    assert store.completed() == {INNER, CORNER}


def test_zarr_reads_the_columns(path: Path, whole: dict[str, bytes]) -> None:
    put(path, whole)
    group: Any = zarr.open_group(path, mode="r")
    start, stop = group.attrs["variables"]["velocity"]["columns"]
    dataset = xr.open_dataset(path, engine=StoreBackend)
    np.testing.assert_array_equal(
        np.moveaxis(group["results"][start:stop], 0, -1), dataset["velocity"]
    )
    assert group.attrs["identity"]["axes"]["eta"] == AXES["eta"].tolist()


def test_the_chunks_of_a_store_are_kept(path: Path, whole: dict[str, bytes]) -> None:
    """Another machine may choose other chunks."""
    begin(path, INNER).close()
    with reopen(path) as store:
        assert store.chunks == CHUNKS
        for index in set(CHUNKS.indices()) - store.completed():
            store.write(index, results(PLAN, CHUNKS, index))
    assert contents(path) == whole


# Interruption


def test_resumed_byte_for_byte(path: Path, whole: dict[str, bytes]) -> None:
    for limit in (0, 1, 7, None):
        fill(path, limit=limit)
    assert contents(path) == whole
    fill(path)
    assert contents(path) == whole


def test_an_exception_leaves_what_is_done(path: Path, whole: dict[str, bytes]) -> None:
    with pytest.raises(KeyboardInterrupt), begin(path, INNER, CORNER):
        raise KeyboardInterrupt
    with reopen(path) as store:
        assert store.completed() == {INNER, CORNER}
    fill(path)
    assert contents(path) == whole


@forks
def test_killed_while_it_is_created(path: Path, whole: dict[str, bytes]) -> None:
    """Nothing is there under the name; what is beside goes with a later store of this name."""

    def killed(self: Path, target: Path) -> None:
        os.kill(os.getpid(), signal.SIGKILL)

    child = os.fork()
    if child == 0:
        Path.rename = killed  # type: ignore[assignment,method-assign]
        begin(path)
    os.waitpid(child, 0)
    [beside] = path.parent.iterdir()
    assert not path.exists()
    begin(path).close()
    assert beside.exists()  # it might be another process that is creating the store
    long_ago = time.time() - 86400.0
    os.utime(beside, (long_ago, long_ago))
    foreign = path.with_name(f".{path.name}.notes.part")
    foreign.mkdir()
    os.utime(foreign, (long_ago, long_ago))
    reopen(path).close()
    assert not beside.exists()
    assert foreign.exists()
    fill(path)
    assert contents(path) == whole


@pytest.mark.skipif(os.name != "posix", reason="folders cannot be opened")
def test_the_description_is_on_the_disk_before_the_store_has_its_name(
    path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Files and their folders first, then the folder of the new name."""
    order: list[int] = []
    rename, sync = Path.rename, os.fsync

    def synced(number: int) -> None:
        order.append(os.fstat(number).st_ino)
        sync(number)

    def renamed(self: Path, target: Path) -> Path:
        order.append(-1)
        return rename(self, target)

    monkeypatch.setattr(os, "fsync", synced)
    monkeypatch.setattr(Path, "rename", renamed)
    begin(path).close()
    described = ("zarr.json", "results/zarr.json", ".", "results")
    before = order[: order.index(-1)]
    assert {path.joinpath(one).stat().st_ino for one in described} <= set(before)
    assert order[order.index(-1) + 1 :][0] == path.parent.stat().st_ino


class Server:
    """The process of ``store_child``."""

    def __init__(self, scratch: Path) -> None:
        script = Path(__file__).with_name("store_child.py")
        self.process: Any = subprocess.Popen(
            [sys.executable, script, scratch],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
        )  # fmt: skip
        assert self.line() == "ready"

    def line(self) -> str:
        return str(self.process.stdout.readline()).strip()

    def tell(self, text: str) -> None:
        self.process.stdin.write(f"{text}\n")
        self.process.stdin.flush()

    def start(self, command: str, path: Path) -> int:
        self.tell(f"{command} {path}")
        return int(self.line())

    def ended(self) -> int:
        """Wait for the end of the run; return 0 or minus the signal."""
        self.tell("")
        return int(self.line())


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    server = Server(tmp_path_factory.mktemp("server") / "warm.zarr")
    yield server
    server.process.communicate()


@forks
def test_killed_at_any_stage_of_a_sweep(server: Server, tmp_path: Path) -> None:
    sweep(tmp_path / "whole.zarr")
    expected = contents(tmp_path / "whole.zarr")
    stores, found = [tmp_path / "killed0.zarr"], set()
    for chunks in (0, 0, 1, 2, 4, 6, 8, 10, 12):
        path, patience = stores[-1], time.monotonic() + 60.0
        pid = server.start("sweep", path)
        while len(list(path.glob("results/c/0/*"))) < chunks:
            assert time.monotonic() < patience
            time.sleep(1e-3)
        os.kill(pid, signal.SIGKILL)
        if server.ended() == 0:
            stores.append(tmp_path / f"killed{len(stores)}.zarr")
            continue
        files = contents(path) if path.exists() else {}
        found.add(len(files))
        for name in set(files) & set(expected):
            assert files[name] == expected[name]
    for path in stores:
        sweep(path)
        assert contents(path) == expected
    # The kills came at different stages, or this has shown little.
    assert len(found) > 2


# Damage


def flip(file: Path) -> None:
    content = bytearray(file.read_bytes())
    content[len(content) // 2] ^= 0x10
    file.write_bytes(content)


DAMAGES: dict[str, Any] = {
    "flipped": flip,
    "cut off": lambda file: os.truncate(file, file.stat().st_size - 1),
    "three bytes": lambda file: os.truncate(file, 3),
    "four zeros": lambda file: file.write_bytes(bytes(4)),
    "empty": lambda file: os.truncate(file, 0),
    "missing": Path.unlink,
}


@pytest.mark.parametrize("index", [INNER, CORNER])
@pytest.mark.parametrize("damage", DAMAGES)
def test_damaged_chunks_are_found_and_repaired(
    path: Path, whole: dict[str, bytes], damage: str, index: tuple[int, ...]
) -> None:
    put(path, whole)
    DAMAGES[damage](path / key(index))
    missing = damage == "missing"
    with nullcontext() if missing else pytest.raises((ValueError, RuntimeError)):
        xr.open_dataset(path, engine=StoreBackend)["angle"].load()
    with reopen(path) as store:
        assert store.completed() == set(CHUNKS.indices()) - {index}
        assert [one.chunk for one in store.damaged] == ([] if missing else [index])
    fill(path)
    assert contents(path) == whole


def exchange(path: Path, other: Path) -> None:
    one, two = (path / key(index) for index in (INNER, (2, 1)))
    content = one.read_bytes()
    one.write_bytes(two.read_bytes())
    two.write_bytes(content)


def copy(path: Path, other: Path) -> None:
    shutil.copy(path / key((2, 1)), path / key(INNER))


def take(path: Path, other: Path) -> None:
    shutil.copy(other / key(INNER), path / key(INNER))


@pytest.mark.parametrize(
    ("move", "damaged"), [(exchange, [INNER, (2, 1)]), (copy, [INNER]), (take, [INNER])]
)
def test_chunks_of_another_place_or_sweep_are_found_and_repaired(
    path: Path, whole: dict[str, bytes], tmp_path: Path, move: Any, damaged: list[tuple[int, ...]]
) -> None:
    put(path, whole)
    other = tmp_path / "other.zarr"
    system = wb.paper.system().replace(slope=-41.0)
    plan = make_plan("sweep", system, AXES, **SETTINGS)
    with SweepStore.open(other, plan, CHUNKS) as store:
        store.write(INNER, results(plan, CHUNKS, INNER))
    move(path, other)
    dataset = xr.open_dataset(path, engine=StoreBackend)
    intact = dataset["angle"].isel(CHUNKS.slices((0, 0)))
    expected = results(PLAN, CHUNKS, (0, 0))["angle"]
    np.testing.assert_array_equal(intact, expected)
    for index in damaged:
        with pytest.raises(InputError, match="damaged"):
            dataset["status"].isel(CHUNKS.slices(index)).load()
    with reopen(path) as store:
        assert store.completed() == set(CHUNKS.indices()) - set(damaged)
        assert [one.chunk for one in store.damaged] == damaged
    fill(path)
    assert contents(path) == whole


@pytest.mark.parametrize("name", ["zarr.json", "results/zarr.json", key(INNER), key(CORNER)])
def test_any_flipped_bit_is_found_or_harmless(
    path: Path, whole: dict[str, bytes], name: str
) -> None:
    put(path, whole)
    expected = xr.open_dataset(path, engine=StoreBackend).load()
    rng = np.random.default_rng(7)
    for bit in rng.choice(8 * len(whole[name]), 20, replace=False):
        altered = bytearray(whole[name])
        altered[bit // 8] ^= 1 << bit % 8
        (path / name).write_bytes(altered)
        with suppress(InputError), reopen(path) as store:
            if store.completed() == set(CHUNKS.indices()):
                xr.testing.assert_identical(store.dataset().load(), expected)
        with suppress(InputError if "json" in name else (ValueError, RuntimeError)):
            found = xr.open_dataset(path, engine=StoreBackend).load()
            xr.testing.assert_identical(found, expected)


@pytest.mark.parametrize("name", ["zarr.json", "results/zarr.json"])
@pytest.mark.parametrize("damage", [*DAMAGES, "of another", "no table"])
def test_damaged_metadata_is_refused(
    path: Path, whole: dict[str, bytes], name: str, damage: str
) -> None:
    put(path, whole)
    if damage == "of another":
        shutil.copy(path / ("zarr.json" if "/" in name else "results/zarr.json"), path / name)
    elif damage == "no table":
        (path / name).write_text("[1]")
    else:
        DAMAGES[damage](path / name)
    before = contents(path)
    for read in (reopen, lambda store: xr.open_dataset(store, engine=StoreBackend)):
        with pytest.raises(InputError, match=name):
            read(path)
    assert contents(path) == before


@pytest.mark.parametrize(
    ("name", "old", "new"),
    [
        ("results/zarr.json", b'"little"', b'"big"'),
        ("results/zarr.json", b'"F0"', b'"f0"'),
        ("zarr.json", b'"rad"', b'"deg"'),
        ("zarr.json", b'"fill": 0', b'"fill": 1'),
        ("zarr.json", b'"zarr_format": 3', b'"zarr_format": 3, "more": []'),
        ("zarr.json", b'"F0": 4', b'"F0": 4.0'),
        ("zarr.json", b'"F0": 4', b'"F0": 5'),
        ("zarr.json", b'"F0": 4', b'"F0": 0'),
    ],
)
def test_altered_metadata_is_refused(
    path: Path, whole: dict[str, bytes], name: str, old: bytes, new: bytes
) -> None:
    put(path, whole)
    assert old in whole[name]
    (path / name).write_bytes(whole[name].replace(old, new))
    with pytest.raises(InputError, match="the store is damaged"):
        reopen(path)
    if b"zarr_format" not in old:
        with pytest.raises(InputError, match="the store is damaged"):
            xr.open_dataset(path, engine=StoreBackend)


# Identity


@pytest.mark.parametrize(
    ("changes", "place"),
    [
        ({"system": wb.paper.system().replace(slope=-41.0)}, "system.actuation.slope"),
        ({"parameters": {**AXES, "eta": AXES["eta"][:3]}}, "axes.eta"),
        ({"parameters": {**AXES, "eta": AXES["eta"] + np.eye(22)[21]}}, "axes.eta[21]"),
        ({"parameters": {"eta": AXES["eta"], "f": AXES["F0"]}}, "axes.F0"),
        ({"periods": 205}, "protocol.recorded"),
        ({"initial": (0.1, 0.0)}, "initial[0]"),
        ({"kind": "regime_map"}, "kind"),
        ({"follow": "eta"}, "follow"),
    ],
)
def test_another_sweep_is_refused(
    path: Path, whole: dict[str, bytes], changes: dict[str, Any], place: str
) -> None:
    put(path, whole)
    given = {"kind": "sweep", "system": wb.paper.system(), "parameters": AXES, **SETTINGS}
    with pytest.raises(InputError, match="holds another sweep") as caught:
        reopen(path, make_plan(**{**given, **changes}))
    assert f"\n  {place}: " in str(caught.value)
    assert contents(path) == whole
    reopen(path).close()


def test_differences_name_their_places() -> None:
    stored = {"a": [{"b": 1, "c": 2}, 3], "d": [1.0, 2.0], "e": {"f": 1}, "g": "x"}
    wanted = {"a": [{"b": 2, "c": 3}, 4], "d": [1.0], "e": {}, "g": "x", "h": 0}
    places = [line.partition(":")[0] for line in differences(stored, wanted)]
    assert places == ["a[0].b", "a[0].c", "d", "e.f", "h"]
    assert list(differences({"a": 1}, {"a": 1.0})) == []


# One process at a time


@forks
def test_one_writer(server: Server, path: Path, whole: dict[str, bytes]) -> None:
    pid = server.start("hold", path)
    assert server.line() == "held"
    with pytest.raises(InputError, match=f"process {pid} on {socket.gethostname()}"):
        reopen(path)
    os.kill(pid, signal.SIGKILL)
    assert server.ended() == -signal.SIGKILL
    fill(path)
    assert contents(path) == whole


def test_one_writer_in_a_process(path: Path) -> None:
    with begin(path) as store:
        for _ in range(2):
            with pytest.raises(InputError, match="is writing in it"):
                reopen(path)
            store.write(INNER, results(PLAN, CHUNKS, INNER))
    with reopen(path) as store:
        assert store.completed() == {INNER}
        store.close()
        reopen(path).close()


@pytest.mark.parametrize("resume", [False, True])
def test_two_create_at_once(path: Path, monkeypatch: pytest.MonkeyPatch, resume: bool) -> None:
    """The second finds the name taken when it renames."""
    real = Path.rename

    def rename(self: Path, target: Path) -> Path:
        monkeypatch.undo()
        begin(path, INNER).close()
        return real(self, target)

    monkeypatch.setattr(Path, "rename", rename)
    if resume:
        with reopen(path) as store:
            assert store.completed() == {INNER}
    else:
        with pytest.raises(InputError, match="exists already"):
            begin(path)
    assert list(path.parent.iterdir()) == [path]


# Disks


@pytest.fixture
def disk(tmp_path: Path) -> Iterator[Path]:
    """A disk in memory of 64 kB."""
    folder = tmp_path / "disk"
    folder.mkdir()
    mount = shutil.which("mount")
    if sys.platform != "linux" or mount is None or os.geteuid() != 0:
        pytest.skip("a small disk can be mounted by root of Linux only")
    command = [mount, "-t", "tmpfs", "-o", "size=64k", "none", str(folder)]
    if subprocess.run(command, capture_output=True, check=False).returncode:
        pytest.skip("no small disk may be mounted here")
    yield folder
    subprocess.run(["umount", str(folder)], check=True)


def test_a_full_disk(disk: Path, whole: dict[str, bytes]) -> None:
    path, filler = disk / "sweep.zarr", disk / "filler"
    filler.write_bytes(b"0" * 62_000)
    with pytest.raises(OutputError, match="cannot be created"):
        begin(path)
    assert list(disk.iterdir()) == [filler]
    filler.write_bytes(b"0" * 20_000)
    with pytest.raises(OutputError, match="cannot be written") as caught:
        fill(path)
    with reopen(path) as store:
        done = store.completed()
        assert store.damaged == []
    assert 0 < len(done) < 18
    assert f"{len(done)} of 18 chunks" in str(caught.value)
    assert {name for name in contents(path) if "/c/" in name} == {key(index) for index in done}
    subprocess.run(["mount", "-o", "remount,size=8m", str(disk)], check=True)
    fill(path)
    assert contents(path) == whole


def test_a_store_that_is_moved(path: Path, tmp_path: Path) -> None:
    with begin(path, INNER) as store:
        path.rename(tmp_path / "elsewhere")
        with pytest.raises(OutputError, match="no longer there"):
            store.write(CORNER, results(PLAN, CHUNKS, CORNER))
        assert not path.exists()
    with reopen(tmp_path / "elsewhere") as store:
        assert store.completed() == {INNER}


def test_the_working_directory_may_change(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    with begin("sweep.zarr") as store:
        monkeypatch.chdir("/")
        store.write(INNER, results(PLAN, CHUNKS, INNER))
        assert store.completed() == {INNER}
    assert (tmp_path / "sweep.zarr" / key(INNER)).exists()


# Paths that are not a store


def make_folder(path: Path) -> None:
    path.mkdir()
    (path / "thesis.txt").write_text("mine")


def make_zarr(path: Path) -> None:
    zarr.create_group(path, zarr_format=3).create_array("a", shape=(3,), dtype=float)


def make_earlier(path: Path) -> None:
    make_zarr(path)
    put(path, {"status/.store/identity.json": b'{"format": "wedgebrake sweep 1"}'})


def make_third(path: Path) -> None:
    zarr.create_group(path, zarr_format=3, attributes={"format": "wedgebrake sweep 3"})


@pytest.mark.parametrize(
    ("make", "what"),
    [
        (lambda path: path.write_text("mine"), "is not the store of a sweep"),
        (make_folder, "is not the store of a sweep"),
        (make_zarr, "is not the store of a sweep"),
        (lambda path: zarr.create_group(path, zarr_format=2), "is not the store of a sweep"),
        (lambda path: path.symlink_to("nowhere"), "is not the store of a sweep"),
        (make_earlier, "another version"),
        (make_third, "another version"),
    ],
)
def test_other_files_are_left_alone(path: Path, make: Any, what: str) -> None:
    make(path)
    before = contents(path) if path.is_dir() else path.is_symlink() or path.read_bytes()
    with pytest.raises(InputError, match=r"exists already.*--resume.*another name"):
        begin(path)
    with pytest.raises(InputError, match=f"{what}.*another name"):
        reopen(path)
    assert before == (contents(path) if path.is_dir() else path.is_symlink() or path.read_bytes())
    assert list(path.parent.iterdir()) == [path]


@pytest.mark.parametrize("resume", [False, True])
def test_paths_that_cannot_be(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, resume: bool
) -> None:
    for name, error in (
        (tmp_path / "no" / "sweep.zarr", InputError),
        (Path(__file__) / "sweep.zarr", InputError),
        (tmp_path / ("x" * 300), OutputError),
        (str(tmp_path / "a\0b"), OutputError),
        (3, InputError),
        ("", InputError),
    ):
        with pytest.raises(error, match="path = "):
            SweepStore.open(name, PLAN, CHUNKS, resume=resume)  # type: ignore[arg-type]
    assert list(tmp_path.iterdir()) == []
    (tmp_path / "gone").mkdir()
    monkeypatch.chdir(tmp_path / "gone")
    (tmp_path / "gone").rmdir()
    with pytest.raises(InputError, match="working directory"):
        SweepStore.open("sweep.zarr", PLAN, CHUNKS, resume=resume)


@pytest.fixture
def unprivileged() -> Iterator[Path]:
    """A folder of a user who is not root."""
    if not hasattr(os, "geteuid"):
        pytest.skip("permissions of another kind on this system")
    folder = Path(tempfile.mkdtemp())
    root = os.geteuid() == 0
    if root:
        os.chown(folder, 65534, 65534)
        os.seteuid(65534)
    try:
        yield folder
    finally:
        for one in [folder, *folder.rglob("*")]:
            one.chmod(0o700)
        if root:
            os.seteuid(0)
        shutil.rmtree(folder)


def test_folders_without_permission(unprivileged: Path) -> None:
    path = unprivileged / "sweep.zarr"
    unprivileged.chmod(0o500)
    with pytest.raises(OutputError, match=r"cannot be created.*permission denied"):
        begin(path)
    unprivileged.chmod(0o700)
    with begin(path, INNER) as store:
        (path / "results" / "c" / "0").chmod(0o500)
        with pytest.raises(OutputError, match=r"permission denied.*1 of 18 chunks"):
            store.write(CORNER, results(PLAN, CHUNKS, CORNER))
        (path / "results" / "c" / "0").chmod(0o700)
        assert store.completed() == {INNER}
    (path / "results" / ".lock").unlink(missing_ok=True)
    (path / "results").chmod(0o500)
    with pytest.raises(OutputError, match=r"cannot be locked.*permission denied"):
        reopen(path)
    path.chmod(0o000)
    with pytest.raises(InputError, match="is not the store of a sweep"):
        reopen(path)
