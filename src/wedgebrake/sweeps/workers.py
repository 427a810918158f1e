"""Who does the work of a sweep: the threads of this machine, or a Dask cluster.

Both give the same chunks: a chunk depends on the plan alone. With one version they are the same bit
for bit, on a cluster of other processors up to rounding.
"""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Iterator, Sequence
from concurrent.futures import FIRST_EXCEPTION, Future, ThreadPoolExecutor, wait
from typing import Any

from wedgebrake.errors import InputError
from wedgebrake.sweeps.compute import Chunk, compute
from wedgebrake.sweeps.parts import Parts
from wedgebrake.sweeps.plan import Plan
from wedgebrake.sweeps.store_layout import ChunkIndex, Layout

Done = tuple[ChunkIndex, dict[str, Any]]

# Chunks in hand at once: threads need not wait for the end of one before they begin another.
_IN_HAND = 3


def processors() -> int:
    """How many threads can run at once here."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def by_threads(
    plan: Plan, layout: Layout, wanted: Sequence[ChunkIndex], threads: int
) -> Iterator[Done]:
    """Chunk after chunk, in order; each is shared by all threads."""
    parts = Parts(plan.system, plan.grid.axes)
    hand: deque[tuple[ChunkIndex, Chunk, list[Future[None]]]] = deque()
    waiting = iter(wanted)
    pool = ThreadPoolExecutor(threads, thread_name_prefix="wedgebrake")
    try:
        while True:
            while len(hand) < _IN_HAND:
                index = next(waiting, None)
                if index is None:
                    break
                chunk = Chunk(plan, parts, layout.slices(index))
                hand.append((index, chunk, [pool.submit(work) for work in chunk.work]))
            if not hand:
                return
            index, chunk, futures = hand.popleft()
            wait(futures, return_when=FIRST_EXCEPTION)
            for future in futures:
                future.result()
            yield index, chunk.results()
    finally:
        # Also where the caller has had enough, or Ctrl-C was pressed: what runs is left to
        # itself, it may take long.
        pool.shutdown(wait=False, cancel_futures=True)


def by_cluster(
    plan: Plan, layout: Layout, wanted: Sequence[ChunkIndex], client: Any
) -> Iterator[Done]:
    """Chunks in the order in which the workers of a ``distributed.Client`` finish them.

    A worker that dies takes the chunk in its hands with it; another one computes it again.
    """
    from distributed import as_completed

    waiting = iter(wanted)
    running: dict[Any, ChunkIndex] = {}
    try:
        # Without the hash, or the plan of an earlier sweep that is alike, and is being forgotten,
        # would stand for this one.
        [shared] = client.scatter([plan], broadcast=True, hash=False)
        hands = max(1, sum(client.nthreads().values()))
    except (TypeError, RuntimeError, OSError) as error:
        raise InputError(
            f"client: the sweep cannot be sent to its workers ({str(error).splitlines()[0]}). Use a"
            " client that is open, and define brakes and laws of your own in a module."
        ) from None

    def submit() -> Any:
        index = next(waiting, None)
        if index is None:
            return None
        future = client.submit(compute, shared, layout.slices(index), pure=False)
        running[future.key] = index
        return future

    # As many as there are hands, so that results do not wait on workers that may die.
    first = [submit() for _ in range(hands)]
    finished = as_completed([one for one in first if one is not None])
    try:
        for future in finished:
            yield running.pop(future.key), future.result()
            following = submit()
            if following is not None:
                finished.add(following)
    finally:
        client.cancel(list(finished.futures), force=True)
