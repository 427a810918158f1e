"""Execution of a sweep by the threads of this computer, and how many workers are allowed.

The results of a chunk depend only on the plan, so that they are bitwise identical.
"""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import FIRST_EXCEPTION, Future, ThreadPoolExecutor, wait
from typing import Any

from wedgebrake.model.validation import check_whole
from wedgebrake.sweeps.chunk import Chunk
from wedgebrake.sweeps.grid import ChunkIndex, Chunks
from wedgebrake.sweeps.plan import Plan

ChunkResults = tuple[ChunkIndex, dict[str, Any]]

_MOST_WORKERS = 1024
# Chunks in progress at once, so that no thread waits for the end of a chunk.
_CHUNKS_AT_ONCE = 3


def processors() -> int:
    """Return the number of threads that can run at once on this machine."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def check_workers(name: str, count: Any) -> None:
    """Raise ``InputError`` unless a number of threads or processes is allowed; None is allowed."""
    if count is not None:
        check_whole(name, count, 1, _MOST_WORKERS, why="Leave it out for one thread per processor.")


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
