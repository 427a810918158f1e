"""Speed of sweeps, beside a loop over single runs in the same run: ``make bench``.

Work: the bifurcation diagram of the paper's wedge brake in eta, 400 points of 250 periods, and
a part of the regime map over eta and F0, from which the whole of 1000 x 1000 is computed
(``--map`` does the whole, into a store). Times are the best of several runs.
"""

import argparse
import os
import resource
import tempfile
import time
from pathlib import Path

import numpy as np
from scipy import stats

import wedgebrake as wb
from peers.brake import Brake
from peers.heyoka_events import HeyokaEvents
from timing import best
from work import PERIODS, duration

SYSTEM = wb.paper.system(eta=-24.0, F0=0.036)
ETAS = np.linspace(-60.0, 12.0, 400)
TARGET_DIAGRAM, TARGET_MAP, TARGET_EFFICIENCY = 0.15, 360.0, 0.9
SAMPLES, TARGET_SCATTER = 10_000, 5.0


def diagram(threads):
    """One diagram in memory."""
    return wb.bifurcation(SYSTEM, eta=ETAS, transient=200, threads=threads)


def loop_of_single_runs(count=40):
    """The same points through ``wb.poincare``, one by one in Python; seconds a point."""
    wb.poincare(SYSTEM)
    start = time.perf_counter()
    for eta in ETAS[:: ETAS.size // count]:
        wb.poincare(SYSTEM.replace(eta=eta))
    return (time.perf_counter() - start) / count


def map_of(count, threads, store=None):
    """A regime map of count x count points."""
    return wb.regime_map(
        SYSTEM,
        eta=np.linspace(-60.0, 12.0, count),
        F0=np.geomspace(0.01, 0.2, count),
        transient=200,
        threads=threads,
        store=store,
        progress=store is not None,
    )


def scatter_of(samples):
    """Probabilities of all outcomes of systems whose friction and slope scatter."""
    over = {("kinetic", "static"): stats.uniform(0.28, 0.06), "slope": stats.norm(-40.0, 2.0)}
    return wb.scatter(SYSTEM, over, samples=samples, transient=200)


def memory():
    """Largest memory of this process so far [MiB]."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--map", action="store_true", help="the whole map of 1000 x 1000 points")
    whole = parser.parse_args().map
    processors = len(os.sched_getaffinity(0))
    first = diagram(processors)
    events = int(first["events"].sum())
    print(f"wedgebrake {wb.__version__}, {processors} processors, load {os.getloadavg()[0]:.1f}\n")

    alone = best(lambda: diagram(1), seconds=4.0)
    shared = best(lambda: diagram(processors), seconds=4.0)
    single = loop_of_single_runs()
    print("bifurcation diagram in eta, 400 points x 250 periods, exact")
    for name, seconds in (("1 thread", alone), (f"{processors} threads", shared)):
        rate = f"{ETAS.size / seconds:8.0f} points/s {events / seconds / 1e6:6.2f} M events/s"
        print(f"  {name:<12}{seconds:8.3f} s {rate}")
    print(f"  target      {TARGET_DIAGRAM:8.3f} s")
    print(f"  parallel efficiency {alone / shared / processors:.2f}, target {TARGET_EFFICIENCY}")
    print(f"  a loop of wb.poincare takes {single * 1e3:.2f} ms a point,", end=" ")
    print(f"{single * ETAS.size / shared:.1f} times as long")
    heyoka_row(shared / ETAS.size)

    count = 120
    took = best(lambda: map_of(count, processors), seconds=1.0, least=2)
    print(f"\nregime map over eta and F0, {count} x {count} points x 250 periods")
    print(f"  {took:.2f} s, {count**2 / took:.0f} points/s, or {took / count**2 * 1e6:.0f} s for")
    print(f"  1000 x 1000; target {TARGET_MAP:.0f} s")
    took = best(lambda: scatter_of(SAMPLES), seconds=1.0, least=2)
    print(f"\nscatter of friction and slope, {SAMPLES} machines x 250 periods, all outcomes")
    print(f"  {took:.2f} s, {SAMPLES / took:.0f} machines/s; target {TARGET_SCATTER:.0f} s")
    if whole:
        with tempfile.TemporaryDirectory() as folder:
            before = memory()
            start = time.perf_counter()
            found = map_of(1000, processors, Path(folder) / "map.zarr")
            took = time.perf_counter() - start
            size = sum(one.stat().st_size for one in Path(folder).rglob("*") if one.is_file())
            settled = float((found["motion"] > 0).mean())
            print(f"  1000 x 1000: {took:.1f} s, {size / 2**20:.0f} MiB on disk, {settled:.3f}")
            print(f"  of the points decided; memory {memory():.0f} MiB, {before:.0f} before")


def heyoka_row(ours):
    """The peer with stick and slip modes, driven from Python, on one point of the diagram."""
    peer = HeyokaEvents("coulomb", 1e-15)
    if peer.missing():
        print(f"  (left out: {peer.name}, {peer.missing()})")
        return
    brakes, until = [Brake.of(SYSTEM)], duration(SYSTEM, PERIODS)
    theirs = best(lambda: peer.solve(brakes, until), seconds=1.0, least=2)
    print(f"  {peer.name}: {theirs * 1e3:.2f} ms a point on one thread,", end=" ")
    print(f"{theirs / ours:.1f} times as long")


if __name__ == "__main__":
    main()
