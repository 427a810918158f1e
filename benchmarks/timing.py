"""Best of many runs: the least disturbed one, on a machine that others use too."""

import time
from collections.abc import Callable


def best(work: Callable[[], object], seconds: float = 2.0, least: int = 3) -> float:
    """Shortest time of one call [s], from as many calls as fit into ``seconds``."""
    work()
    shortest, spent, count = float("inf"), 0.0, 0
    while spent < seconds or count < least:
        start = time.perf_counter()
        work()
        took = time.perf_counter() - start
        shortest, spent, count = min(shortest, took), spent + took, count + 1
    return shortest
