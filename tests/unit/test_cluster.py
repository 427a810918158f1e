"""A sweep on a real cluster of two worker processes, one of which is killed."""

from __future__ import annotations

import os
import signal

import numpy as np
import pytest

import wedgebrake as wb

distributed = pytest.importorskip("distributed")

pytestmark = pytest.mark.filterwarnings("ignore::DeprecationWarning")

AXES = {"eta": np.linspace(-60.0, 12.0, 48), "F0": np.geomspace(0.02, 0.2, 32)}


@pytest.fixture(scope="module")
def alone():
    return wb.sweep(wb.paper.system(), **AXES)


@pytest.fixture
def client():
    with (
        distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None
        ) as cluster,
        distributed.Client(cluster) as client,
    ):
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
    assert counted[-1] == 48 * 32
    assert spread.load().identical(alone)


def test_the_same_sweep_again_and_again(client) -> None:
    """What is alike must not stand for what is being forgotten."""
    eta = np.linspace(-20.0, 0.0, 6)
    found = [
        wb.sweep(wb.paper.system(), client=client, eta=eta, periods=20, transient=10)
        for _ in range(8)
    ]
    assert all(one.identical(found[0]) for one in found)


def test_error_in_a_worker_is_told(client, monkeypatch) -> None:
    with pytest.raises(wb.InputError, match="client = 'no such thing'"):
        wb.sweep(wb.paper.system(), client="no such thing", eta=[1.0])
