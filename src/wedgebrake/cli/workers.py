"""Threads or processes of this computer that compute the points of a sweep."""

from __future__ import annotations

import logging
import os
import signal
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, NamedTuple

from wedgebrake.errors import InputError


class Workers(NamedTuple):
    """Values of the options --threads and --processes; None: not given."""

    threads: int | None
    processes: int | None

    @contextmanager
    def started(self) -> Iterator[dict[str, Any]]:
        """Start the workers and yield the argument of ``sweep``; processes end with the context.

        Raises ``InputError`` if both are given, and without the extra that processes need.
        """
        if self.processes is None:
            yield {"threads": self.threads}
            return
        option = f"--processes {self.processes}"
        if self.threads is not None:
            raise InputError(f"{option}: given with --threads {self.threads}. Give one of them.")
        try:
            from distributed import Client, LocalCluster
        except ImportError:
            raise InputError(
                f"{option}: needs Dask, which is not installed: pip install 'wedgebrake[cluster]'."
                " Or give --threads."
            ) from None
        with _without_interrupts(), _quiet():
            # Any free port of this computer: even without a dashboard, one is taken.
            cluster = LocalCluster(
                n_workers=self.processes, threads_per_worker=1, dashboard_address="127.0.0.1:0",
                scheduler_kwargs={"dashboard": False}, silence_logs=logging.CRITICAL,
            )  # fmt: skip
        with cluster, Client(cluster) as client:
            yield {"client": client}


@contextmanager
def _without_interrupts() -> Iterator[None]:
    """Ignore Ctrl-C, also in the processes that start meanwhile: the terminal sends it to all."""
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


@contextmanager
def _quiet() -> Iterator[None]:
    """Let processes that start meanwhile log nothing but what ends them.

    Errors of the computation are raised in this process; the others are of connections that end.
    """
    name = "DASK_LOGGING__DISTRIBUTED"
    before = os.environ.get(name)
    os.environ[name] = "critical"
    try:
        yield
    finally:
        if before is None:
            del os.environ[name]
        else:
            os.environ[name] = before
