"""How the cost of sweeps grows, and what a very large map would cost: ``make bench``.

Over periods and points: seconds and the memory of a process of its own. On a Dask cluster of two
workers: what a chunk costs beyond its points. From these the page docs/scale.md computes a map of
10^4 x 10^4 points (``--write-docs``, from the last measurement).
"""

import argparse
import json
import pickle
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

import wedgebrake as wb
from scale_page import page
from table import machine
from timing import best
from wedgebrake.sweeps.cluster import Cluster
from wedgebrake.sweeps.executor import compute
from wedgebrake.sweeps.plan import Plan
from wedgebrake.sweeps.store import SweepStore
from wedgebrake.sweeps.sweep import make_plan
from work import system

ROOT = Path(__file__).parents[1]
MEASURED = ROOT / "out" / "scale.json"
DOCS = ROOT / "docs" / "scale.md"

LAWS = ("coulomb", "smoothed")
PERIODS = (62, 125, 250, 500, 1000, 2000, 4000)
RECORDED = 50
LINE = {"coulomb": 40, "smoothed": 10}  # points in a run over periods
POINTS = {
    "coulomb": (100, 1000, 3000, 10_000, 30_000, 100_000),
    "smoothed": (100, 300, 1000, 3000, 10_000),
}
CHUNKS = (1, 64, 512, 4096)  # points in a chunk on the cluster
CHUNK = 4096  # what a sweep with a store chooses for the exact solver
SIDE = 10_000  # of the map that is computed from the rest


def over_periods(law: str) -> list[dict[str, float]]:
    """Seconds of one thread for a point of a line in eta, over the number of periods."""
    etas = np.linspace(-60.0, 12.0, LINE[law])
    made = []
    for periods in PERIODS:

        def run(periods=periods):
            wb.sweep(
                system(law, 0.0), eta=etas, periods=periods, transient=max(0, periods - RECORDED),
                threads=1,
            )  # fmt: skip

        made.append({"periods": periods, "seconds": best(run, seconds=1.0, least=2) / etas.size})
    return made


def over_points(law: str) -> list[dict[str, float]]:
    """Seconds and memory of maps over eta and F0, each in a process of its own."""
    made = []
    for count in POINTS[law]:
        command = [sys.executable, __file__, "--one-map", law, str(count)]
        said = subprocess.run(command, check=True, capture_output=True, text=True)  # noqa: S603
        made.append(json.loads(said.stdout.splitlines()[-1]))
    return made


def one_map(law: str, count: int) -> dict[str, float]:
    """A map of about ``count`` points into a store, on all processors."""
    side = round(count**0.5)
    with tempfile.TemporaryDirectory() as folder:
        # Compiles, and loads what a store needs.
        kept = {"transient": 200, "progress": False}
        wb.regime_map(system(law, 0.0), **values(2), store=f"{folder}/first.zarr", **kept)
        start = time.perf_counter()
        wb.regime_map(system(law, 0.0), **values(side), store=f"{folder}/map.zarr", **kept)
        seconds = time.perf_counter() - start
        written = Path(folder, "map.zarr").rglob("*")
        files = [one.stat().st_size for one in written if one.is_file()]
    return {
        "points": side**2, "seconds": seconds, "bytes": sum(files), "files": len(files),
        "memory": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024,
    }  # fmt: skip


def values(side: int) -> dict[str, np.ndarray]:
    """The axes of a map."""
    return {"eta": np.linspace(-60.0, 12.0, side), "F0": np.geomspace(0.01, 0.2, side)}


def plan_of(side: int, periods: int = 250) -> Plan:
    """A regime map, as it is planned."""
    transient = max(0, periods - RECORDED)
    return make_plan(
        "regime_map", system("coulomb", 0.0), values(side), periods=periods, transient=transient,
        keep_points=False,
    )  # fmt: skip


def on_cluster() -> list[dict[str, float]]:
    """Chunks of several sizes through two workers: seconds of a worker for a chunk."""
    from distributed import Client, LocalCluster

    made = []
    with (
        LocalCluster(
            n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None
        ) as cluster,
        Client(cluster) as client,
    ):
        warm = plan_of(4, periods=2)
        few = warm.grid.chunks(4)
        list(Cluster(warm, client).chunks(few, few.indices()))  # compiles
        for i, points in enumerate(CHUNKS):
            # Two periods a point: what a chunk costs beyond its points is looked for. Dask gives
            # equal plans one name, and may still be forgetting the last one: each is another.
            plan = plan_of(256 + i, periods=2)
            chunks = plan.grid.chunks(points)
            count = min(len(chunks.indices()), max(16, 400 // max(1, points // 64)))
            wanted = chunks.indices()[:count]
            start = time.perf_counter()
            done = sum(1 for _ in Cluster(plan, client).chunks(chunks, wanted))
            wall = time.perf_counter() - start
            made.append({"points": points, "chunks": done, "wall": wall / done})
    return made


def chunk_costs() -> dict[str, float]:
    """One chunk of the great map: its work, its answer, and its writing."""
    plan = plan_of(SIDE)
    chunks = plan.grid.chunks(CHUNK)
    indices = chunks.indices()
    # Lines of equal eta from all over the map; the first of each, of full length.
    chosen = [one for one in indices if one[1] == 0][:: SIDE // 10]
    start = time.perf_counter()
    answers = [compute(plan, chunks.slices(index)) for index in chosen]
    work = (time.perf_counter() - start) / len(chosen)
    idle = plan_of(SIDE, periods=2)
    building = best(lambda: compute(idle, chunks.slices(chosen[0])), seconds=1.0)
    with (
        tempfile.TemporaryDirectory() as folder,
        SweepStore.open(f"{folder}/map.zarr", plan, chunks) as store,
    ):
        start = time.perf_counter()
        for index, answer in zip(chosen, answers, strict=True):
            store.write(index, answer)
        writing = (time.perf_counter() - start) / len(chosen)
        start = time.perf_counter()
        done = store.completed()
        reading = (time.perf_counter() - start) / len(chosen)
        size = sum(one.stat().st_size for one in store.path.rglob("c/**/*") if one.is_file())
        assert len(done) == len(chosen)
    return {
        "points": CHUNK,
        "chunks": len(indices),
        "work": work,
        "building": building,
        "writing": writing,
        "checking": reading,
        "stored": size / len(chosen),
        "answer": len(pickle.dumps(answers[0])),
        "plan": len(pickle.dumps(plan)),
        "raw": sum(np.dtype(one.dtype).itemsize for one in plan.variables),
    }


def measure() -> dict[str, Any]:
    """Everything, as plain values."""
    found: dict[str, Any] = {"machine": machine(), "periods": {}, "points": {}}
    for law in LAWS:
        print(f"... {law}", file=sys.stderr)
        found["periods"][law], found["points"][law] = over_periods(law), over_points(law)
    print("... chunks", file=sys.stderr)
    found["chunk"] = chunk_costs()
    try:
        found["cluster"] = on_cluster()
    except ImportError as error:
        found["cluster"] = []
        print(f"(left out: {error.name} is not installed)")
    return found


def main() -> None:
    """Measure and print, or write the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--write-docs", action="store_true", help="docs from the last measurement")
    parser.add_argument("--one-map", nargs=2, metavar=("LAW", "POINTS"), help=argparse.SUPPRESS)
    chosen = parser.parse_args()
    if chosen.one_map:
        law, count = chosen.one_map
        print(json.dumps(one_map(law, int(count))))
        return
    if chosen.write_docs:
        if not MEASURED.exists():
            sys.exit(f"error: {MEASURED} is not there: measure first (make bench)")
        text = page(json.loads(MEASURED.read_text(encoding="utf-8")))
        DOCS.write_text(text, encoding="utf-8")
        return
    found = measure()
    MEASURED.parent.mkdir(exist_ok=True)
    MEASURED.write_text(json.dumps(found, indent=1), encoding="utf-8")
    print(page(found))


if __name__ == "__main__":
    main()
