"""Execution of a sweep by a Dask cluster.

With the same version and processor as here the results are bitwise identical to those of threads;
on other processors they are equal up to rounding.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from typing import Any

from wedgebrake.errors import InputError, WedgebrakeError
from wedgebrake.sweeps.executor import ChunkResults, compute
from wedgebrake.sweeps.grid import ChunkIndex, Chunks
from wedgebrake.sweeps.plan import Plan


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
