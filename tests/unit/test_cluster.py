"""A sweep on a real cluster of two worker processes, one of which is killed."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from scipy import stats

import wedgebrake as wb
from children import started
from machines import block, stribeck

distributed = pytest.importorskip("distributed")

pytestmark = pytest.mark.filterwarnings("ignore::DeprecationWarning")

AXES = {"eta": np.linspace(-60.0, 12.0, 24), "F0": np.geomspace(0.02, 0.2, 32)}


@pytest.fixture(scope="module")
def alone():
    return wb.sweep(wb.paper.system(), **AXES)


@pytest.fixture(scope="module")
def cluster():
    # Any free port: even without a dashboard, the usual one may be taken by tests beside these.
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=":0"
    ) as cluster:
        yield cluster


@pytest.fixture
def client(cluster):
    # As the default it would leave Dask's settings changed when a test closes it itself.
    with distributed.Client(cluster, set_as_default=False) as client:
        yield client


def test_killed_worker_costs_nothing_but_time(alone, client, tmp_path) -> None:
    victims = list(client.run(os.getpid).values())
    counted: list[int] = []

    def strike(progress) -> None:
        counted.append(progress.done)
        if victims and progress.done >= 200:
            os.kill(victims.pop(), signal.SIGKILL)
            victims.clear()

    path = tmp_path / "run.zarr"
    spread = wb.sweep(wb.paper.system(), client=client, store=path, progress=strike, **AXES)
    assert not victims, "no worker was killed"
    assert counted[-1] == 24 * 32
    assert spread.load().identical(alone)


@pytest.mark.parametrize(
    ("system", "axes", "returns"),
    [
        (wb.paper.system(), {"eta": np.linspace(-20.0, 0.0, 6)}, "periods"),
        (block(stribeck()), {"belt.base_speed": np.linspace(0.5, 2.0, 6)}, "crossings"),
    ],
    ids=["driveline", "machine"],
)
def test_the_same_sweep_again_and_again(system, axes, returns, client) -> None:
    """What is alike must not stand for what is being forgotten."""
    settings = {returns: 20, "transient": 10}
    expected = wb.sweep(system, axes, **settings)
    for _ in range(4):
        assert wb.sweep(system, axes, client=client, **settings).identical(expected)


def test_samples_are_those_of_one_computer(client) -> None:
    over = {"kinetic": stats.uniform(0.28, 0.14), "slope": stats.norm(-60.0, 5.0)}
    settings = {"samples": 64, "seed": 1, "transient": 20, "periods": 30}
    expected = wb.scatter(wb.paper.system(), over, **settings)
    assert (expected["probability"] > 0.0).any()
    assert wb.scatter(wb.paper.system(), over, client=client, **settings).identical(expected)


BELT = str(Path(__file__).parents[2] / "examples" / "belt.toml")
SHORT = ["--transient", "5", "--crossings", "10"]


def test_processes_of_a_command(run) -> None:
    """They give what threads give."""
    reports = []
    for workers in ("--threads", "--processes"):
        over = ["--over", "belt.base_speed=0.2:1:40"]
        status, text, said = run("sweep", BELT, *over, *SHORT, "--json", workers, "2")
        assert status == 0, said
        report = json.loads(text)
        del report["speed"]
        reports.append(report)
    assert reports[0] == reports[1]


def test_interrupt_of_a_command_with_processes(tmp_path) -> None:
    """The terminal sends Ctrl-C to the workers too."""
    store = tmp_path / "run.zarr"
    process = started(
        [
            *(sys.executable, "-m", "wedgebrake", "sweep", BELT, "--over"),
            *("belt.base_speed=0.2:1:40000", *SHORT, "--processes", "1", "--store", store),
        ],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True,
    )  # fmt: skip
    while not store.exists():
        assert process.poll() is None, process.communicate()
        time.sleep(0.05)
    time.sleep(1.0)
    os.killpg(process.pid, signal.SIGINT)
    text, said = process.communicate(timeout=60)
    assert (process.returncode, text) == (1, "")
    assert "Traceback" not in said
    assert str(store) in said


@pytest.fixture
def fragile():
    """The scheduler of a cluster in processes of its own, and a client of it."""
    folder = Path(tempfile.mkdtemp())
    place = ["--scheduler-file", str(folder / "scheduler.json"), "--no-dashboard"]
    programs = {
        "scheduler": [*place, "--port", "0"],
        "worker": [*place, "--nthreads", "1", "--no-nanny"],
    }
    running = [
        subprocess.Popen(
            [sys.executable, "-m", f"distributed.cli.dask_{name}", *options],
            stderr=subprocess.DEVNULL, cwd=folder,
        )
        for name, options in programs.items()
    ]  # fmt: skip
    client = distributed.Client(
        scheduler_file=str(folder / "scheduler.json"), timeout=60, set_as_default=False
    )
    try:
        client.wait_for_workers(1, timeout=60)
        yield running[0], client
    finally:
        for process in reversed(running):
            process.kill()
            process.wait()
        with suppress(Exception):  # it has nothing to talk to
            client.close(timeout=1)
        shutil.rmtree(folder)


def check_lost(client, lose, alone, path) -> None:
    """A cluster that is lost after 200 points is told, and the store goes on without it."""

    def watch(progress) -> None:
        if progress.done >= 200:
            lose()

    with pytest.raises(wb.WedgebrakeError, match=r"^client: .*resume=True") as caught:
        wb.sweep(wb.paper.system(), client=client, store=path, progress=watch, **AXES)
    assert not isinstance(caught.value, ValueError)  # nothing was wrong with the input
    told = []
    again = wb.sweep(wb.paper.system(), store=path, resume=True, progress=told.append, **AXES)
    assert told[0].resumed >= 200
    assert again.load().identical(alone)


def test_a_scheduler_that_is_killed(fragile, alone, tmp_path) -> None:
    scheduler, client = fragile
    check_lost(client, scheduler.kill, alone, tmp_path / "run.zarr")


def test_a_client_that_is_closed(client, alone, tmp_path) -> None:
    check_lost(client, lambda: client.close(timeout=5), alone, tmp_path / "run.zarr")


def test_a_closed_client_leaves_no_store(client, tmp_path) -> None:
    client.close()
    with pytest.raises(wb.InputError, match=r"^client: "):
        wb.sweep(wb.paper.system(), client=client, store=tmp_path / "run.zarr", eta=[1.0])
    assert list(tmp_path.iterdir()) == []
