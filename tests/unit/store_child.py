"""A small sweep for the tests of the store, and a process that runs it to be killed.

The process forks for each run, as it takes a second to import everything anew. It reads
"run PATH", "hold PATH" or "dieSTEP PATH" and answers with the pid of the run; then it reads
an empty line, waits for the end of the run and answers with "end" and its exit code.
"""

from __future__ import annotations

import os
import signal
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np

from wedgebrake.sweeps.results import VARIABLES
from wedgebrake.sweeps.store import SweepStore
from wedgebrake.sweeps.store_layout import Layout

NAMES = ("status", "angle", "motion", "events", "largest_exponent")


def layout(dims: dict[str, int], chunks: dict[str, int], names: tuple[str, ...] = NAMES) -> Layout:
    points = tuple(dim for dim in dims if dim != "period")
    variables = [
        (VARIABLES[name], (*points, "period") if VARIABLES[name].per_period else points)
        for name in names
        if "period" in dims or not VARIABLES[name].per_period
    ]
    coords = {
        dim: (np.linspace(-3.0, 2.0, size), {"units": "1", "long_name": f"swept {dim}"})
        for dim, size in dims.items()
        if dim != "period"
    }
    if "period" in dims:
        coords["period"] = (np.arange(200, 200 + dims["period"]), {"units": "1"})
    return Layout(dims, variables, coords, chunks, {"kind": "sweep", "axes": list(points)})


LAYOUT = layout({"eta": 22, "F0": 9, "period": 5}, {"eta": 4, "F0": 4})
IDENTITY: dict[str, Any] = {
    "version": "0.1.0",
    "system": {"actuation": {"slope": -40.0, "release": True}},
    "axes": {"eta": np.linspace(-60, 12, 22), "F0": np.linspace(0, 0.2, 9)},
    "protocol": {"periods": 250, "transient": "auto", "initial": [0.0, 0.0]},
}


def results(layout: Layout, index: tuple[int, ...]) -> dict[str, Any]:
    """What the "simulation" gives at the points of a chunk: depends on the point alone."""
    parts = layout.slices(index)
    sizes = [layout.dims[dim] for dim in layout.point_dims]
    points = np.arange(np.prod(sizes)).reshape(sizes)[tuple(parts.values())]
    found = {}
    for number, (variable, dims) in enumerate(layout.variables):
        place = points
        if "period" in dims:
            place = points[..., None] * 100 + np.arange(layout.dims["period"])
        if variable.dtype == "float64":
            found[variable.name] = np.sin(place * (number + 1.0))
        else:
            found[variable.name] = (place * 7 + number) % 5
    found["status"] = np.ones(points.shape, "int8")
    return found


def run(path: str | Path, pause: float = 0.0, limit: int | None = None) -> None:
    """Create or go on with the sweep; at most ``limit`` chunks."""
    with SweepStore.open(path, LAYOUT, IDENTITY, resume=True) as store:
        done = store.done()
        for index in [one for one in LAYOUT.indices() if one not in done][:limit]:
            time.sleep(pause)
            store.write(index, results(LAYOUT, index))


def die(path: str, step: int) -> None:
    """Killed at a step of its first chunk: 3 k: file k half written, then not yet renamed,
    then renamed."""
    real_open, real_replace = Path.open, Path.replace
    steps = iter(range(1000))

    def count() -> None:
        if next(steps) == step:
            os.kill(os.getpid(), signal.SIGKILL)

    def opened(self: Path, *arguments: Any, **options: Any) -> Any:
        file = real_open(self, *arguments, **options)
        if self.name != "partial":
            return file

        class Halves:
            def __enter__(self) -> Halves:
                return self

            def __exit__(self, *_: object) -> None:
                file.close()

            def write(self, content: bytes) -> None:
                file.write(content[: len(content) // 2])
                file.flush()
                count()
                file.write(content[len(content) // 2 :])

        return Halves()

    def replaced(self: Path, target: Path) -> Path:
        if self.name != "partial":
            return real_replace(self, target)
        target.parent.mkdir(parents=True, exist_ok=True)
        count()
        found = real_replace(self, target)
        count()
        return found

    Path.open, Path.replace = opened, replaced  # type: ignore[method-assign] - to die between them
    run(path)


def say(*words: object) -> None:
    sys.stdout.write(" ".join(map(str, words)) + "\n")
    sys.stdout.flush()


def hold(path: str) -> None:
    with SweepStore.open(path, LAYOUT, IDENTITY, resume=True):
        say("held")
        time.sleep(30)


def main() -> None:
    import filelock  # noqa: F401 - loaded before the forks
    import google_crc32c  # noqa: F401 - the same
    import zarr  # noqa: F401 - the same

    while line := sys.stdin.readline():
        what, path = line.rstrip("\n").split(" ", 1)
        pid = os.fork()
        if pid == 0:
            signal.alarm(30)
            try:
                if what == "hold":
                    hold(path)
                elif what == "run":
                    run(path, pause=0.003)
                else:
                    die(path, int(what.removeprefix("die")))
                os._exit(0)
            except BaseException as error:
                sys.stderr.write(f"{error!r}\n")
                sys.stderr.flush()
                os._exit(1)
        say(pid)
        sys.stdin.readline()
        say("end", os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1]))


if __name__ == "__main__":
    main()
