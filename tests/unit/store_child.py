"""A small sweep for the tests of the store, and a process that forks runs of it to be killed.

The process reads a command and a path, answers with the pid of the run, reads an empty line,
waits for the end of the run and answers with its exit code. It has loaded everything before, as
that takes seconds.
"""

from __future__ import annotations

import os
import signal
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np

import wedgebrake as wb
from wedgebrake.sweeps.grid import Chunks
from wedgebrake.sweeps.plan import Plan
from wedgebrake.sweeps.store import SweepStore
from wedgebrake.sweeps.sweep import make_plan

AXES = {"eta": np.linspace(-60.0, 12.0, 22), "F0": np.linspace(0.01, 0.2, 9)}
SETTINGS: dict[str, Any] = {"periods": 204, "transient": 200}
PLAN = make_plan("sweep", wb.paper.system(), AXES, **SETTINGS)
# Chunks at the end of an axis have fewer points than the others.
CHUNKS = Chunks(PLAN.grid.sizes, {"eta": 4, "F0": 4})


def results(plan: Plan, chunks: Chunks, index: tuple[int, ...]) -> dict[str, Any]:
    """Artificial results of a chunk that depend on the points alone."""
    numbers = np.arange(plan.grid.points).reshape(tuple(plan.grid.sizes.values()))
    points = numbers[tuple(chunks.slices(index).values())]
    found = {}
    for number, variable in enumerate(plan.variables):
        place = points[..., None] * 100 + np.arange(plan.record_size)
        place = place if variable.over else points
        if variable.dtype == "float64":
            found[variable.name] = np.sin(place * (number + 1.0))
        else:
            found[variable.name] = ((place * 7 + number) % 5).astype(variable.dtype)
    return found


def fill(path: str | Path, limit: int | None = None) -> None:
    """Create or resume the store of the artificial results, at most ``limit`` chunks."""
    with SweepStore.open(path, PLAN, CHUNKS, resume=True) as store:
        completed = store.completed()
        for index in [one for one in CHUNKS.indices() if one not in completed][:limit]:
            store.write(index, results(PLAN, CHUNKS, index))


def sweep(path: str | Path, points: int = 1024) -> None:
    """Begin or resume a real sweep, in chunks of 64 points."""
    eta = np.linspace(-60.0, 12.0, points)
    wb.sweep(wb.paper.system(), eta=eta, store=path, resume=True, progress=False)


def hold(path: str) -> None:
    with SweepStore.open(path, PLAN, CHUNKS, resume=True):
        say("held")
        time.sleep(30)


def say(*words: object) -> None:
    sys.stdout.write(" ".join(map(str, words)) + "\n")
    sys.stdout.flush()


def main() -> None:
    sweep(sys.argv[1], 4)
    say("ready")
    while line := sys.stdin.readline():
        command, path = line.rstrip("\n").split(" ", 1)
        pid = os.fork()
        if pid == 0:
            signal.alarm(60)
            try:
                {"sweep": sweep, "hold": hold}[command](path)
                os._exit(0)
            except BaseException as error:
                sys.stderr.write(f"{error!r}\n")
                sys.stderr.flush()
                os._exit(1)
        say(pid)
        sys.stdin.readline()
        say(os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1]))


if __name__ == "__main__":
    main()
