"""Speed of branches of periodic orbits, beside AUTO-07p in the same run: ``make bench``.

Work: the synchronous orbit of the paper's wedge brake followed over eta, at least 200 orbits with
their multipliers; bifurcations are located on the way. AUTO follows that of the smoothed law
by collocation with 400 intervals, which locate them as exactly. Times are the best of several
runs, on one core, without what finds the first orbit.
"""

import os
import sys
from pathlib import Path

import numpy as np

import wedgebrake as wb
from timing import best

sys.path += [str(Path(__file__).parents[1] / folder) for folder in ("tests", "tests/peers")]
import auto_peer

COULOMB = wb.paper.system(eta=12.0, F0=0.036)
SMOOTHED = wb.paper.system(eta=12.0, F0=0.036, friction="smoothed")
ENDS = (12.0, -60.0)
STEP = 0.005
TARGET = 0.5  # seconds for 200 orbits with multipliers


def follow(first, measured):
    """The branch of an orbit; with all that a dataset of branches tells, or multipliers alone."""
    branch = wb.continuation(first, step=STEP, eta=ENDS)
    for point in branch:
        assert np.isfinite(point.multipliers[0])
        if measured:
            assert point.measures.events >= 0.0
    return branch


def main() -> None:
    """Measure and print."""
    print(f"wedgebrake {wb.__version__}, load {os.getloadavg()[0]:.1f}\n")
    print("branch of the synchronous orbit over eta from 12 to -60")
    each = {}
    for name, system in (("exact", COULOMB), ("smoothed, rtol 1e-10", SMOOTHED)):
        first = wb.orbit(system)
        branch = follow(first, measured=False)
        count, found = len(branch.points), len(branch.bifurcations)
        alone = best(lambda first=first: follow(first, measured=False))
        whole = best(lambda first=first: follow(first, measured=True))
        each[name] = alone / count
        print(f"  {name:<24}{count:5} orbits, {found} bifurcations  {alone:6.3f} s", end="")
        print(f"  {1e3 * alone / count:6.2f} ms an orbit; with sticks, amplitudes {whole:6.3f} s")
    hundreds = 200.0 * each["exact"]
    print(f"  200 orbits, exact: {hundreds:.3f} s, target {TARGET:.1f} s")
    if auto_peer.missing():
        print(f"  AUTO-07p: not here ({auto_peer.missing()})")
        return
    peers = [auto_peer.branch(SMOOTHED, "eta", ENDS[1], step=0.35) for _ in range(2)]
    fastest = min(peers, key=lambda one: one.seconds)
    count = fastest.values.size
    share = fastest.seconds / count
    print(
        f"  AUTO-07p, smoothed      {count:5} orbits, {len(fastest.of('PD', 'TR', 'LP'))}", end=""
    )
    print(f" bifurcations  {fastest.seconds:6.3f} s  {1e3 * share:6.2f} ms an orbit")
    for name, seconds in each.items():
        print(f"  ratio to AUTO an orbit, {name}: {seconds / share:.2f}")


if __name__ == "__main__":
    main()
