"""Execution of a sweep by the threads of this machine or by a Dask cluster.

The results of a chunk depend only on the plan. With the same version and processor they are
bitwise identical; on a cluster with other processors they are equal up to rounding.
"""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import FIRST_EXCEPTION, Future, ThreadPoolExecutor, wait
from contextlib import contextmanager, suppress
from typing import Any

from wedgebrake.errors import InputError, WedgebrakeError
from wedgebrake.sweeps.chunk import Chunk
from wedgebrake.sweeps.grid import ChunkIndex, Chunks
from wedgebrake.sweeps.plan import Plan

ChunkResults = tuple[ChunkIndex, dict[str, Any]]

# Chunks in progress at once, so that no thread waits for the end of a chunk.
_CHUNKS_AT_ONCE = 3


def processors() -> int:
    """Return the number of threads that can run at once on this machine."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def compute(plan: Plan, where: Mapping[str, slice]) -> dict[str, Any]:
    """Return the results of a chunk, computed in this thread as by a worker of a cluster."""
    chunk = plan.chunk_maker()(where)
    for work in chunk.work:
        work()
    return chunk.results()


def by_threads(
    plan: Plan, threads: int | None, chunks: Chunks, wanted: Sequence[ChunkIndex]
) -> Iterator[ChunkResults]:
    """Iterate over the chunks in order; all threads, by default as many as can run, share each."""
    make = plan.chunk_maker()
    running: deque[tuple[ChunkIndex, Chunk, list[Future[None]]]] = deque()
    waiting = iter(wanted)
    pool = ThreadPoolExecutor(threads or processors(), thread_name_prefix="wedgebrake")
    try:
        while True:
            while len(running) < _CHUNKS_AT_ONCE:
                index = next(waiting, None)
                if index is None:
                    break
                chunk = make(chunks.slices(index))
                running.append((index, chunk, [pool.submit(work) for work in chunk.work]))
            if not running:
                return
            index, chunk, futures = running.popleft()
            wait(futures, return_when=FIRST_EXCEPTION)
            for future in futures:
                future.result()
            yield index, chunk.results()
    finally:
        # After an interrupt, too: batches that are running are not awaited, they may take long.
        pool.shutdown(wait=False, cancel_futures=True)


class Cluster:
    """Workers of a ``distributed.Client`` that compute the chunks of a plan.

    Raises ``InputError`` if the plan cannot be sent to them.
    """

    def __init__(self, plan: Plan, client: Any) -> None:
        # The plan travels with each chunk: the cluster keeps one copy of scattered data, which
        # would be lost with the worker that holds it.
        self._client, self._plan = client, plan
        try:
            from distributed.protocol.pickle import dumps

            if client.status != "running":
                raise RuntimeError("it is closed")
            self._threads = max(1, sum(client.nthreads().values()))
            dumps(plan)
        except Exception as error:  # closed clients raise various exceptions
            raise InputError(
                f"client: the sweep cannot be sent to its workers ({_first_line(error)}). Use an"
                " open client, and define custom brakes and friction laws in a module."
            ) from None

    def chunks(self, chunks: Chunks, wanted: Sequence[ChunkIndex]) -> Iterator[ChunkResults]:
        """Iterate over the chunks in the order in which the workers finish them.

        If a worker dies, its chunk is computed again by another one.

        Raises ``WedgebrakeError`` if the whole cluster is lost, or the client is closed.
        """
        from distributed import as_completed

        waiting = iter(wanted)
        running: dict[Any, ChunkIndex] = {}

        def submit() -> list[Any]:
            index = next(waiting, None)
            if index is None:
                return []
            with _cluster_errors():
                future = self._client.submit(compute, self._plan, chunks.slices(index), pure=False)
            running[future.key] = index
            return [future]

        # One task per thread, so that no results wait on workers that may die.
        first = [one for _ in range(self._threads) for one in submit()]
        finished = as_completed(first, loop=self._client.loop)
        try:
            while running:
                with _cluster_errors():
                    future = next(finished)
                with _cluster_errors(future):
                    results = future.result()
                yield running.pop(future.key), results
                finished.update(submit())
        finally:
            # A lost cluster has nothing left to cancel.
            with suppress(Exception):
                self._client.cancel(list(finished.futures), force=True)


@contextmanager
def _cluster_errors(future: Any = None) -> Iterator[None]:
    """Convert the exceptions of a client that has lost its cluster to ``WedgebrakeError``.

    future : the future whose result is requested; its own errors are not converted
    """
    try:
        yield
    except Exception as error:
        own = future is not None and future.status == "error"
        if own and type(error).__name__ != "KilledWorker":  # raised after all workers died
            raise
        raise WedgebrakeError(
            f"client: the cluster was lost, or its client closed ({_first_line(error)}). A store"
            " remains valid: repeat the call with an open client and resume=True to continue."
            " Without a store no results are kept."
        ) from error


def _first_line(error: BaseException) -> str:
    return (str(error).splitlines() or [type(error).__name__])[0]
