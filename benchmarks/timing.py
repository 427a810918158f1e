"""Best of many runs: the least disturbed one, on a machine that others use too."""

import time
from collections.abc import Callable
from typing import Any


def best(
    work: Callable[..., object],
    seconds: float = 2.0,
    least: int = 3,
    prepare: Callable[[], tuple[Any, ...]] = tuple,
) -> float:
    """Shortest time of one call [s], from as many calls as fit into ``seconds``.

    prepare : gives the arguments of each call; its time does not count
    """
    work(*prepare())
    shortest, spent, count = float("inf"), 0.0, 0
    while spent < seconds or count < least:
        given = prepare()
        start = time.perf_counter()
        work(*given)
        took = time.perf_counter() - start
        shortest, spent, count = min(shortest, took), spent + took, count + 1
    return shortest
