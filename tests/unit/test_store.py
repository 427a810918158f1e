"""The store of a sweep: killed, cut off, filled up, taken by two, and gone on with."""

from __future__ import annotations

import copy
import errno
import json
import math
import os
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
import zarr
from hypothesis import given, settings
from hypothesis import strategies as st
from store_child import IDENTITY, LAYOUT, NAMES, layout, results, run

from wedgebrake.errors import InputError, OutputError
from wedgebrake.sweeps.results import VARIABLES
from wedgebrake.sweeps.store import SweepStore
from wedgebrake.sweeps.store_identity import differences
from wedgebrake.sweeps.store_layout import Layout

PRIVATE = Path("status", ".store")
RECORD = f"{PRIVATE.as_posix()}/identity.json"
# Filled points have other values: the smallest and the largest chunk of the sweep.
INNER, CORNER = (1, 1), (5, 2)
ETA = np.linspace(-60, 12, 22)
forks = pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork on this system")


def contents(store: Path) -> dict[str, bytes]:
    """Every file of a store but its lock."""
    files = {one.relative_to(store).as_posix(): one for one in store.rglob("*") if one.is_file()}
    return {name: one.read_bytes() for name, one in files.items() if name != f"{PRIVATE}/lock"}


def begin(path: Path, *indices: tuple[int, ...]) -> SweepStore:
    store = SweepStore.open(path, LAYOUT, IDENTITY)
    for index in indices:
        store.write(index, results(LAYOUT, index))
    return store


def open_again(path: Path, identity: Any = IDENTITY) -> SweepStore:
    return SweepStore.open(path, LAYOUT, identity, resume=True)


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    """The files of a run that nothing disturbed."""
    path = tmp_path_factory.mktemp("whole") / "sweep.zarr"
    run(path)
    return contents(path)


def put(path: Path, files: dict[str, bytes]) -> None:
    """A store of these files."""
    for name, content in files.items():
        (path / name).parent.mkdir(parents=True, exist_ok=True)
        (path / name).write_bytes(content)


@pytest.fixture
def path(tmp_path: Path) -> Iterator[Path]:
    path = tmp_path / "sweep.zarr"
    yield path
    # A hundred files; pytest would keep those of the last three runs.
    shutil.rmtree(path, ignore_errors=True)


# What is in a store


def test_everyone_reads_it_with_labels(path: Path) -> None:
    with begin(path, INNER, CORNER):
        pass
    dataset = xr.open_zarr(path, consolidated=False, chunks=None)
    assert dict(dataset.sizes) == {"eta": 22, "F0": 9, "period": 5}
    assert set(dataset.data_vars) == set(NAMES)
    assert set(dataset.coords) == {"eta", "F0", "period"}
    assert dataset.attrs == LAYOUT.attrs
    assert dataset["angle"].dims == ("eta", "F0", "period")
    assert dataset["eta"].attrs == {"units": "1", "long_name": "swept eta"}
    np.testing.assert_array_equal(dataset["period"], np.arange(200, 205))
    np.testing.assert_array_equal(dataset["eta"], np.linspace(-3, 2, 22))
    for name in NAMES:
        assert dataset[name].attrs == VARIABLES[name].attributes()
        assert dataset[name].dtype == VARIABLES[name].dtype
    # Two chunks are there: 16 points, and the one at the end of both axes, 2 x 1 points.
    assert int((dataset["status"] == 1).sum()) == 18
    assert int((dataset["status"] == 0).sum()) == 22 * 9 - 18
    unknown = dataset["status"].values == 0
    assert np.isnan(dataset["angle"].values[unknown]).all()
    assert np.isnan(dataset["largest_exponent"].values[unknown]).all()
    assert (dataset["motion"].values[unknown] == -1).all()
    assert (dataset["events"].values[unknown] == 0).all()
    for index in (INNER, CORNER):
        part = dataset.isel(LAYOUT.slices(index))
        for name, values in results(LAYOUT, index).items():
            np.testing.assert_array_equal(part[name], values)


def test_own_dataset_is_lazy_and_in_the_order_of_the_layout(path: Path) -> None:
    texts = Layout(
        {"branch": 2, "eta": 3},
        [(VARIABLES[name], ("branch", "eta")) for name in ("status", "motion")],
        {"branch": (["up", "down"], {"long_name": "way"}), "eta": ([0.0, 0.0, 0.0], {})},
        {"eta": 2},
    )
    with SweepStore.open(path, texts, {}) as store:
        dataset = store.dataset()
        assert list(dataset.data_vars) == ["status", "motion"]
        assert dataset.chunks == {}
        assert not dataset["motion"].variable._in_memory
        assert dataset["branch"].dtype == np.dtype("<U4")
        assert dataset["branch"].values.tolist() == ["up", "down"]
        assert dataset["branch"].attrs == {"long_name": "way"}
    dataset.to_netcdf(path.with_suffix(".nc"), engine="h5netcdf")
    assert xr.open_zarr(path, consolidated=False)["branch"].values.tolist() == ["up", "down"]


@settings(max_examples=12, deadline=None)
@given(data=st.data())
def test_any_shape_reads_back_and_is_what_zarr_writes(data: st.DataObject) -> None:
    """Chunks that divide the axes or do not, longer than them or not, with periods or not."""
    sizes = data.draw(st.lists(st.integers(1, 7), min_size=1, max_size=3), label="sizes")
    dims = {f"axis{number}": size for number, size in enumerate(sizes)}
    chunks = {
        name: data.draw(st.integers(1, size + 2), label=f"chunk of {name}")
        for name, size in dims.items()
        if data.draw(st.booleans(), label=f"split {name}")
    }
    if data.draw(st.booleans(), label="periods"):
        dims["period"] = data.draw(st.integers(1, 4), label="period")
    ours = layout(dims, chunks)
    order = data.draw(st.permutations(ours.indices()), label="order")
    with tempfile.TemporaryDirectory() as folder:
        with SweepStore.open(Path(folder) / "ours", ours, {}) as store:
            for index in order:
                store.write(index, results(ours, index))
            assert store.done() == set(order)
            dataset = store.dataset().load()
        cells = math.prod(math.ceil(n / chunks.get(dim, n)) for dim, n in dims.items())
        assert len(order) == cells
        everything = layout(dims, {})
        ((only,),) = (everything.indices(),)
        expected = results(everything, only)
        # The same by zarr-python alone, from the metadata.
        shutil.copytree(Path(folder) / "ours", Path(folder) / "zarrs")
        for name in expected:
            np.testing.assert_array_equal(dataset[name], expected[name])
            shutil.rmtree(Path(folder) / "zarrs" / name / "c")
            with zarr.config.set({"array.write_empty_chunks": True}):
                zarr.open_array(Path(folder) / "zarrs" / name, mode="r+")[...] = expected[name]
        assert contents(Path(folder) / "ours") == contents(Path(folder) / "zarrs")


def test_chunks_of_a_store_stay_as_they_are(path: Path, whole: dict[str, bytes]) -> None:
    """Another machine may choose other chunks: those of the store count."""
    with begin(path, INNER):
        pass
    other = layout(dict(LAYOUT.dims), {"eta": 10, "F0": 1})
    with SweepStore.open(path, other, IDENTITY, resume=True) as store:
        assert store.layout.indices() == LAYOUT.indices()
        for index in set(store.layout.indices()) - store.done():
            store.write(index, results(store.layout, index))
    assert contents(path) == whole


def test_wrong_calls_are_refused(path: Path) -> None:
    with begin(path) as store:
        good = results(LAYOUT, INNER)
        with pytest.raises(ValueError, match=r"angle.*missing or unknown"):
            store.write(INNER, {name: good[name] for name in good if name != "angle"})
        with pytest.raises(ValueError, match="shape"):
            store.write(CORNER, good)
        with pytest.raises(ValueError, match="no such chunk along 'F0'"):
            store.write((1, 3), good)
        with pytest.raises(ValueError, match="no such chunk along 'eta'"):
            store.write((-1, 0), good)
        with pytest.raises(TypeError, match="Cannot cast"):
            store.write(INNER, {**good, "events": good["largest_exponent"]})
        assert store.done() == set()
    with pytest.raises(ValueError, match="closed"):
        store.write(INNER, good)


# Interrupted and gone on with


def test_gone_on_with_bit_for_bit(path: Path, whole: dict[str, bytes]) -> None:
    for limit in (0, 1, 7, None):
        run(path, limit=limit)
    assert contents(path) == whole
    run(path)
    assert contents(path) == whole


def test_an_exception_leaves_what_is_done(path: Path, whole: dict[str, bytes]) -> None:
    with pytest.raises(KeyboardInterrupt), begin(path, INNER, CORNER):
        raise KeyboardInterrupt
    with open_again(path) as store:
        assert store.done() == {INNER, CORNER}
    run(path)
    assert contents(path) == whole


class Server:
    """Processes to be killed, from one that has imported everything."""

    def __init__(self) -> None:
        self.process = subprocess.Popen(
            [sys.executable, str(Path(__file__).with_name("store_child.py"))],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )

    def line(self) -> str:
        assert self.process.stdout is not None
        return self.process.stdout.readline().strip()

    def start(self, what: str, path: Path) -> int:
        assert self.process.stdin is not None
        self.process.stdin.write(f"{what} {path}\n")
        self.process.stdin.flush()
        return int(self.line())

    def ended(self) -> int:
        """Wait for its end: 0, or minus the signal. Until then its pid is no other's."""
        assert self.process.stdin is not None
        self.process.stdin.write("\n")
        self.process.stdin.flush()
        word, code = self.line().split()
        assert word == "end"
        return int(code)


@pytest.fixture(scope="module")
def server() -> Iterator[Server]:
    server = Server()
    with server.process:
        yield server
        assert server.process.stdin is not None
        server.process.stdin.close()


@forks
def test_killed_at_any_instant(server: Server, tmp_path: Path, whole: dict[str, bytes]) -> None:
    rng = np.random.default_rng(20)
    killed, found, number = 0, set(), 0
    while killed < 20:
        number += 1
        assert number < 60, "the runs end before they are killed"
        path = tmp_path / f"killed{number}"
        # Four kills of the same store, unless it is complete before: one while it starts, and
        # the others some time after so many chunks were done, fast as the machine may be.
        for chunks in (0, *sorted(rng.integers(1, 18, size=3))):
            pid = server.start("run", path)
            wait_for(path, chunks)
            time.sleep(rng.uniform(0.0, 0.01 if chunks else 0.1))
            os.kill(pid, signal.SIGKILL)
            if server.ended() == 0:
                break
            killed += 1
            if path.exists():
                found.add(check_survivor(path, whole))
        run(path)
        assert contents(path) == whole
        shutil.rmtree(path)
    # The kills came at different stages, or this has shown little.
    assert len(found) > 3


def wait_for(path: Path, chunks: int) -> None:
    """Until so many chunks are done."""
    begun = time.perf_counter()
    while len(list(path.glob("status/c/*/*"))) < chunks:
        assert time.perf_counter() - begun < 30.0
        time.sleep(0.0005)


def check_survivor(path: Path, whole: dict[str, bytes]) -> int:
    """A store right after its writer was killed; returns how many chunks are done."""
    dataset = xr.open_zarr(path, consolidated=False, chunks=None).load()
    files = contents(path)
    with open_again(path) as store:
        done = store.done()
        assert store.damaged == []
    for name, content in files.items():
        if PRIVATE.as_posix() not in name or name.endswith("identity.json"):
            assert content == whole[name]
    status = np.zeros((22, 9))
    for index in done:
        status[tuple(LAYOUT.slices(index).values())] = 1
    np.testing.assert_array_equal(dataset["status"], status)
    return len(done)


@forks
def test_killed_at_every_step_of_a_chunk(
    server: Server, path: Path, whole: dict[str, bytes]
) -> None:
    steps = 3 * len(NAMES)
    for step in range(steps):
        server.start(f"die{step}", path)
        assert server.ended() == -signal.SIGKILL
        assert (path / PRIVATE / "partial").exists() == (step % 3 < 2)
        # With the marker's name, the chunk is done; before, it is not.
        assert check_survivor(path, whole) == (step == steps - 1)
        assert not (path / PRIVATE / "partial").exists()
    run(path)
    assert contents(path) == whole


def test_killed_while_it_creates(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Stopped before any of its files, nothing has the store's name."""

    class Stop(BaseException):
        pass

    real = Path.write_bytes
    left = 0

    def write_bytes(self: Path, content: bytes) -> int:
        nonlocal left
        if left == 0:
            raise Stop
        left -= 1
        return real(self, content)

    monkeypatch.setattr(Path, "write_bytes", write_bytes)
    count = len(LAYOUT.files) + 1
    for before in range(count):
        left = before
        with pytest.raises(Stop):
            begin(tmp_path / "sweep.zarr")
        assert list(tmp_path.iterdir()) == []
    left = count
    begin(tmp_path / "sweep.zarr").close()
    assert left == 0


# Damage


def flip(file: Path) -> None:
    content = bytearray(file.read_bytes())
    content[len(content) // 2] ^= 0x10
    file.write_bytes(content)


DAMAGES = {
    "flipped": (flip, "checksum"),
    "cut off": (lambda file: os.truncate(file, file.stat().st_size - 1), "checksum"),
    "three bytes": (lambda file: os.truncate(file, 3), "checksum"),
    "empty": (lambda file: os.truncate(file, 0), "is empty"),
    "missing": (Path.unlink, "is missing"),
    "a folder": (lambda file: (file.unlink(), file.mkdir()), "cannot be read"),
}


@pytest.mark.parametrize("damage", DAMAGES)
@pytest.mark.parametrize("variable", ["angle", "events", "status"])
def test_damage_is_found_said_and_mended(
    path: Path, whole: dict[str, bytes], variable: str, damage: str
) -> None:
    put(path, whole)
    file = path / LAYOUT.key(variable, INNER)
    harm, why = DAMAGES[damage]
    harm(file)
    with open_again(path) as store:
        assert store.done() == set(LAYOUT.indices()) - {INNER}
        if (variable, damage) == ("status", "missing"):
            # The marker itself: the chunk was never finished.
            assert store.damaged == []
        else:
            ((index, name, said),) = store.damaged
            assert (index, name) == (INNER, variable)
            assert why in said
    if damage == "a folder":
        file.rmdir()
    run(path)
    assert contents(path) == whole


def test_damage_of_several_chunks(path: Path, whole: dict[str, bytes]) -> None:
    put(path, whole)
    flip(path / LAYOUT.key("angle", INNER))
    (path / LAYOUT.key("motion", INNER)).unlink()
    flip(path / LAYOUT.key("status", CORNER))
    with open_again(path) as store:
        assert store.done() == set(LAYOUT.indices()) - {INNER, CORNER}
        found = [(one.chunk, one.variable) for one in store.damaged]
        assert found == [(INNER, "angle"), (INNER, "motion"), (CORNER, "status")]
        for index in (INNER, CORNER):
            store.write(index, results(LAYOUT, index))
        assert store.done() == set(LAYOUT.indices())
        assert store.damaged == []
    assert contents(path) == whole


def test_damage_is_found_by_any_reader(path: Path, whole: dict[str, bytes]) -> None:
    put(path, whole)
    flip(path / LAYOUT.key("angle", INNER))
    dataset = xr.open_zarr(path, consolidated=False, chunks=None)
    np.testing.assert_array_equal(
        dataset["motion"].isel(eta=0, F0=0), results(LAYOUT, (0, 0))["motion"][0, 0]
    )
    with pytest.raises(ValueError, match="checksum"):
        dataset["angle"].load()


def test_mending_starts_with_the_marker(
    path: Path, whole: dict[str, bytes], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A chunk that is killed while it is being mended does not count as done."""
    put(path, whole)
    flip(path / LAYOUT.key("angle", INNER))
    with open_again(path) as store:

        def stop(self: Path, target: Path) -> None:
            raise KeyboardInterrupt

        monkeypatch.setattr(Path, "replace", stop)
        with pytest.raises(KeyboardInterrupt):
            store.write(INNER, results(LAYOUT, INNER))
        assert not (path / LAYOUT.key("status", INNER)).exists()
        assert not (path / PRIVATE / "partial").exists()


def test_coordinates_are_written_again(path: Path, whole: dict[str, bytes]) -> None:
    put(path, whole)
    flip(path / "eta" / "c" / "0")
    (path / "F0" / "c" / "0").unlink()
    run(path)
    assert contents(path) == whole


METADATA = ["zarr.json", "angle/zarr.json", "status/zarr.json", "eta/zarr.json"]


@pytest.mark.parametrize("key", [*METADATA, RECORD])
@pytest.mark.parametrize("damage", ["cut off", "empty", "missing", "of another", "no table"])
def test_damaged_metadata_is_refused(
    path: Path, whole: dict[str, bytes], key: str, damage: str
) -> None:
    put(path, whole)
    if damage == "of another":
        other = "angle/zarr.json" if key != "angle/zarr.json" else "status/zarr.json"
        shutil.copy(path / other, path / key)
    elif damage == "no table":
        (path / key).write_text("[1]")
    else:
        DAMAGES[damage][0](path / key)
    before = contents(path)
    with pytest.raises(InputError, match="hoose another name") as caught:
        open_again(path)
    assert key in str(caught.value)
    assert contents(path) == before


@pytest.mark.parametrize("key", [*(key for key in LAYOUT.files if key.endswith("json")), RECORD])
def test_any_flipped_bit_of_metadata_is_refused_or_harmless(
    path: Path, whole: dict[str, bytes], key: str
) -> None:
    put(path, whole)
    expected = xr.open_zarr(path, consolidated=False, chunks=None).load()[list(NAMES)]
    content = whole[key]
    rng = np.random.default_rng(7)
    for bit in rng.choice(8 * len(content), 60, replace=False):
        altered = bytearray(content)
        altered[bit // 8] ^= 1 << bit % 8
        (path / key).write_bytes(altered)
        with suppress(InputError), open_again(path) as store:
            assert store.done() == set(LAYOUT.indices())
            assert store.dataset().load().identical(expected), altered


@pytest.mark.parametrize(
    ("key", "old", "new"),
    [
        ("angle/zarr.json", b'"little"', b'"big"'),
        ("angle/zarr.json", b'"rad"', b'"deg"'),
        ("events/zarr.json", b'"fill_value": 0', b'"fill_value": 0.0'),
        ("eta/zarr.json", b'"eta"', b'"etb"'),
        ("eta/zarr.json", b'"units"', b'"unit"'),
        ("zarr.json", b'"sweep"', b'"basins"'),
        ("zarr.json", b'"zarr_format": 3', b'"zarr_format": 3, "more": []'),
        (RECORD, b'"F0": 4', b'"F0": 4.0'),
        (RECORD, b'"F0": 4', b'"F0": 5'),
        (RECORD, b'"chunks": {', b'"chunks": [{},{'),
    ],
)
def test_altered_metadata_is_refused(
    path: Path, whole: dict[str, bytes], key: str, old: bytes, new: bytes
) -> None:
    put(path, whole)
    assert old in whole[key]
    (path / key).write_bytes(whole[key].replace(old, new))
    before = contents(path)
    with pytest.raises(InputError, match=r"the store is damaged.*another name"):
        open_again(path)
    assert contents(path) == before


# Which sweep it is


def changed(*place: str | int, to: Any) -> dict[str, Any]:
    identity = copy.deepcopy(IDENTITY)
    inner: Any = identity
    for name in place[:-1]:
        inner = inner[name]
    inner[place[-1]] = to
    return identity


@pytest.mark.parametrize(
    ("identity", "line"),
    [
        (changed("version", to="0.2.0"), "version: 0.1.0 in the store, 0.2.0 now"),
        (
            changed("system", "actuation", "slope", to=-41.0),
            "system.actuation.slope: -40.0 in the store, -41.0 now",
        ),
        (
            changed("system", "actuation", "release", to=1),
            "system.actuation.release: true in the store, 1 now",
        ),
        (changed("axes", "eta", to=np.zeros(3)), "axes.eta: 22 values in the store, 3 now"),
        (changed("axes", "eta", 21, to=12.5), "axes.eta[21]: 12.0 in the store, 12.5 now"),
        (
            changed("axes", "eta", slice(20, None), to=0.0),
            f"axes.eta[20]: {ETA[20]} in the store, 0.0 now (and 1 more of its values)",
        ),
        (
            changed("protocol", "transient", to=200),
            "protocol.transient: auto in the store, 200 now",
        ),
        (changed("protocol", "limit", to=None), "protocol.limit: nothing in the store, null now"),
        (
            {name: IDENTITY[name] for name in IDENTITY if name != "version"},
            "version: 0.1.0 in the store, nothing now",
        ),
        (
            changed("protocol", "initial", to=[math.nan, 0.0]),
            "protocol.initial[0]: 0.0 in the store, NaN now",
        ),
    ],
)
def test_another_sweep_is_refused(path: Path, identity: dict[str, Any], line: str) -> None:
    run(path, limit=2)
    before = contents(path)
    with pytest.raises(InputError, match="holds another sweep") as caught:
        open_again(path, identity)
    assert str(caught.value).split("\n")[1:-1] == [f"  {line}"]
    assert "another name" in str(caught.value)
    assert contents(path) == before
    run(path)


def test_the_same_in_other_types_is_the_same(path: Path) -> None:
    identity = {"a": np.float64(1.0), "b": (1, 2), "c": np.arange(3), "d": math.nan, "e": math.inf}
    SweepStore.open(path, LAYOUT, identity).close()
    same = {"e": math.inf, "a": 1, "b": [1.0, 2], "c": [0, 1, 2], "d": math.nan}
    open_again(path, same).close()


def test_eight_differences_and_the_number_of_the_others(path: Path) -> None:
    many = {f"p{number:02}": number for number in range(30)}
    SweepStore.open(path, LAYOUT, {"system": many}).close()
    with pytest.raises(InputError) as caught:
        open_again(path, {"system": dict.fromkeys(many, -1)})
    _, *lines, last, _ = str(caught.value).split("\n")
    assert lines == [f"  system.p0{n}: {n} in the store, -1 now" for n in range(8)]
    assert last == "  and 22 more"


def test_long_values_are_cut_short() -> None:
    (line,) = differences({"system": {"a": "x" * 300}}, {"system": "y" * 300})
    assert len(line) < 200
    assert differences({"a": [{"b": 1, "c": 2}, 3]}, {"a": [{"b": 2, "c": 3}, 4]}) == [
        "a[0].b: 1 in the store, 2 now",
        "a[0].c: 2 in the store, 3 now (and 1 more of its values)",
    ]


def test_other_arrays_are_refused(path: Path) -> None:
    """The same identity but other results: a program of another version that hides it."""
    begin(path).close()
    fewer = layout(dict(LAYOUT.dims), {"eta": 4, "F0": 4}, names=("angle", "status"))
    with pytest.raises(InputError, match=r"variables.motion: .* in the store, nothing now"):
        SweepStore.open(path, fewer, IDENTITY, resume=True)


# One process at a time


@forks
def test_one_writer(server: Server, path: Path, whole: dict[str, bytes]) -> None:
    pid = server.start("hold", path)
    assert server.line() == "held"
    begun = time.perf_counter()
    with pytest.raises(InputError, match="is writing in it") as caught:
        open_again(path)
    assert time.perf_counter() - begun < 5.0
    assert f"process {pid} on {socket.gethostname()} (since " in str(caught.value)
    assert "another name" in str(caught.value)
    # Who cannot be read of is said to be another one.
    (path / PRIVATE / "writer.json").write_text("{")
    with pytest.raises(InputError, match="another process is writing in it"):
        open_again(path)
    os.kill(pid, signal.SIGKILL)
    assert server.ended() == -signal.SIGKILL
    run(path)
    assert contents(path) == whole


def test_one_writer_in_a_process(path: Path) -> None:
    with begin(path) as store:
        with pytest.raises(InputError, match=f"another sweep of this process, {os.getpid()}"):
            open_again(path)
        # The refusal took nothing away.
        store.write(INNER, results(LAYOUT, INNER))
        with pytest.raises(InputError, match="is writing in it"):
            open_again(path)
    with open_again(path) as store:
        assert store.done() == {INNER}
        store.close()
        open_again(path).close()


def test_a_refused_store_is_free(path: Path) -> None:
    begin(path).close()
    with pytest.raises(InputError, match="another sweep"):
        open_again(path, {})
    open_again(path).close()


def test_two_create_at_once(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The second finds the name taken only when it renames."""
    real = Path.rename

    def rename(self: Path, target: Path) -> Path:
        monkeypatch.setattr(Path, "rename", real)
        begin(path, INNER).close()
        return real(self, target)

    monkeypatch.setattr(Path, "rename", rename)
    with pytest.raises(InputError, match="exists already"):
        begin(path)
    assert [one.name for one in path.parent.iterdir()] == [path.name]
    shutil.rmtree(path)
    monkeypatch.setattr(Path, "rename", rename)
    with open_again(path) as store:
        assert store.done() == {INNER}


# Disks


def test_a_write_that_fails_leaves_nothing(
    path: Path, whole: dict[str, bytes], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The disk is full in the middle of each file of a chunk in turn."""
    real, left = Path.open, 0

    def full(self: Path, *arguments: Any, **options: Any) -> Any:
        nonlocal left
        file = real(self, *arguments, **options)
        if self.name == "partial":
            left -= 1
            if left < 0:
                write = file.write

                class Full:
                    def __enter__(self) -> Full:
                        return self

                    def __exit__(self, *_: object) -> None:
                        file.close()

                    def write(self, content: bytes) -> None:
                        write(content[: len(content) // 2])
                        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

                return Full()
        return file

    with begin(path, INNER, (0, 0)) as store:
        before = contents(path)
        monkeypatch.setattr(Path, "open", full)
        for number in range(len(NAMES)):
            left = number
            with pytest.raises(OutputError, match="no space left") as caught:
                store.write(CORNER, results(LAYOUT, CORNER))
            assert "2 of 18 chunks are done" in str(caught.value)
            assert "resume=True" in str(caught.value)
            assert contents(path) == before
        left = len(NAMES)
        store.write(CORNER, results(LAYOUT, CORNER))
        monkeypatch.undo()
        assert store.done() == {INNER, (0, 0), CORNER}
    run(path)
    assert contents(path) == whole


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
    try:
        yield folder
    finally:
        subprocess.run(["umount", str(folder)], check=True)


def grow(disk: Path, size: str) -> None:
    subprocess.run(["mount", "-o", f"remount,size={size}", str(disk)], check=True)


def test_a_full_disk(disk: Path, whole: dict[str, bytes]) -> None:
    path = disk / "sweep.zarr"
    filler = disk / "filler"
    filler.write_bytes(b"0" * 50_000)
    with pytest.raises(OutputError, match=r"cannot be created.*no space left"):
        begin(path)
    assert list(disk.iterdir()) == [filler]
    filler.unlink()
    grow(disk, "256k")
    with pytest.raises(OutputError, match=r"cannot be written.*no space left") as caught:
        run(path)
    before = contents(path)
    with open_again(path) as store:
        done = store.done()
        assert store.damaged == []
        assert 0 < len(done) < 18
        assert f"{len(done)} of 18 chunks are done" in str(caught.value)
    markers = {LAYOUT.key("status", index) for index in done}
    assert {name for name in before if name.startswith("status/c/")} == markers
    assert len([name for name in before if "/c/" in name]) == 3 + len(NAMES) * len(done)
    with pytest.raises(OutputError, match=f"{len(done)} of 18 chunks"):
        run(path)
    grow(disk, "8m")
    run(path)
    assert contents(path) == whole


def test_a_store_that_is_taken_away(path: Path, tmp_path: Path) -> None:
    with begin(path, INNER) as store:
        path.rename(tmp_path / "elsewhere")
        with pytest.raises(OutputError, match="no longer there"):
            store.write(CORNER, results(LAYOUT, CORNER))
        assert not path.exists()
    with open_again(tmp_path / "elsewhere") as store:
        assert store.done() == {INNER}


def test_the_working_directory_may_change(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    with begin(Path("sweep.zarr")) as store:
        monkeypatch.chdir("/")
        store.write(INNER, results(LAYOUT, INNER))
        assert store.done() == {INNER}
    assert (tmp_path / "sweep.zarr" / LAYOUT.key("status", INNER)).exists()


def test_the_working_directory_may_be_gone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "gone").mkdir()
    monkeypatch.chdir(tmp_path / "gone")
    (tmp_path / "gone").rmdir()
    for resume in (False, True):
        with pytest.raises(InputError, match=r"path = 'sweep.zarr': .*working directory"):
            SweepStore.open("sweep.zarr", LAYOUT, IDENTITY, resume=resume)
    with begin(tmp_path / "sweep.zarr", INNER) as store:
        assert store.done() == {INNER}


# Folders that are none of ours


def make_file(path: Path) -> None:
    path.write_text("mine")


def make_plain(path: Path) -> None:
    path.mkdir()
    (path / "thesis.txt").write_text("mine")


def make_zarr(path: Path) -> None:
    zarr.create_group(path, zarr_format=3).create_array("a", shape=(3,), dtype=float)


def make_old_zarr(path: Path) -> None:
    zarr.create_group(path, zarr_format=2)


def make_dangling(path: Path) -> None:
    path.symlink_to(path.with_name("nowhere"))


@pytest.mark.parametrize(
    ("make", "what"),
    [
        (make_file, "is no folder"),
        (Path.mkdir, "is not the store of a sweep"),
        (make_plain, "is not the store of a sweep"),
        (make_zarr, "is a zarr folder, but not"),
        (make_old_zarr, "is a zarr folder, but not"),
        (make_dangling, "is no folder"),
    ],
)
def test_foreign_things_are_left_alone(path: Path, make: Any, what: str) -> None:
    make(path)
    before = contents(path) if path.is_dir() else path.is_symlink() or path.read_bytes()
    with pytest.raises(InputError, match=r"exists already.*--resume.*another name"):
        begin(path)
    with pytest.raises(InputError, match=f"{what}.*another name"):
        open_again(path)
    assert before == (contents(path) if path.is_dir() else path.is_symlink() or path.read_bytes())
    assert [one.name for one in path.parent.iterdir()] == [path.name]


def test_own_store_is_not_created_again(path: Path, whole: dict[str, bytes]) -> None:
    put(path, whole)
    with pytest.raises(InputError, match=r"exists already.*--resume"):
        begin(path)
    assert contents(path) == whole


def test_names_that_cannot_be(tmp_path: Path) -> None:
    for resume in (False, True):
        for name, error, said in (
            (tmp_path / "no" / "sweep.zarr", InputError, "does not exist"),
            (Path(__file__) / "sweep.zarr", InputError, "does not exist"),
            (tmp_path / ("x" * 300), OutputError, "file name too long"),
            (str(tmp_path / "a\0b"), InputError, "null character"),
            (3, InputError, "must be the name"),
            ("", InputError, "another name"),
        ):
            with pytest.raises(error, match=said):
                SweepStore.open(name, LAYOUT, IDENTITY, resume=resume)
    assert list(tmp_path.iterdir()) == []


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


def test_folders_that_may_not_be_written(unprivileged: Path) -> None:
    path = unprivileged / "sweep.zarr"
    unprivileged.chmod(0o500)
    with pytest.raises(OutputError, match=r"cannot be created.*permission denied"):
        begin(path)
    unprivileged.chmod(0o700)
    with begin(path, INNER) as store:
        (path / "angle" / "c").chmod(0o500)
        with pytest.raises(OutputError, match=r"permission denied.*1 of 18 chunks are done"):
            store.write(CORNER, results(LAYOUT, CORNER))
        (path / "angle" / "c").chmod(0o700)
        assert store.done() == {INNER}
    (path / PRIVATE / "lock").unlink(missing_ok=True)
    (path / PRIVATE).chmod(0o500)
    with pytest.raises(OutputError, match=r"cannot be locked.*permission denied"):
        open_again(path)
    path.chmod(0o000)
    with pytest.raises(InputError, match="is not the store of a sweep"):
        open_again(path)


def test_identity_can_be_read_by_anyone(path: Path) -> None:
    begin(path).close()
    record = json.loads((path / PRIVATE / "identity.json").read_text())
    assert record["identity"]["system"] == IDENTITY["system"]
    assert record["identity"]["axes"]["eta"] == ETA.tolist()
