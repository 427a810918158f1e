"""Speed of two versions of the project: ``python benchmarks/against.py FORMER [--rounds 3]``.

FORMER is the folder of another version, for example a git worktree of a former commit. Each case
runs in processes of its own, the versions in turn, with the interpreter of this one; printed is
the shortest time of each version [ms] and their ratio. ``cold`` compiles the kernels into an empty
cache: the processor time of a first simulation, motion, sweep and orbit.
"""

import argparse
import os
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).parents[1]
KERNELS = """
import ours, work, timing
for case in work.CASES:
    rtol = None if case.law == "coulomb" else 1e-8
    run = ours.kernel(case.system, rtol, work.PERIODS)
    print(f"kernel, {case.law}, {case.words}", timing.best(run, 1.0), sep="\\t")
"""
FRONT = """
import numpy as np, wedgebrake as wb, timing
exact = wb.paper.system(eta=12.0, F0=0.036)
smooth = wb.paper.system(eta=12.0, F0=0.036, friction="smoothed")
etas = np.linspace(-60.0, 12.0, 400)
def diagram(system, values):
    return lambda: wb.bifurcation(system, eta=values, transient=200, threads=1)
def branch(system):
    first = wb.orbit(system)
    over = {"step": 0.005, "eta": (12.0, -60.0)}
    return lambda: [point.multipliers for point in wb.continuation(first, **over)]
turning = wb.BrakedDriveline(
    driveline=wb.Driveline(inertia=2.4, damping=2.77, stiffness=8000.0, drive_speed=40.0),
    brake=wb.WedgeBrake(angle=np.radians(22.0), radius=0.13),
    friction=wb.TabulatedFriction(speeds=(0.0, 2.0), coefficients=(0.34, 0.29)),
    actuation=wb.Actuation(initial_force=4000.0, slope=-60.0),
    excitation=wb.HarmonicTorque(amplitude=300.0, frequency=20.0),
)
over = {"slope": [-60.0, -2.0], "frequency": np.linspace(5.0, 40.0, 100)}
fixed = {"transient": 200, "periods": 250, "threads": 1}
paper = exact.machine
forces = paper.contacts[0].actuation.initial_force * np.linspace(0.7, 1.3, 20)
pad = {"friction": wb.CoulombFriction(kinetic=0.3, static=0.35)}
pair = wb.Machine(
    inertias=[wb.Inertia("a", 1.0), wb.Inertia("b", 2.0)],
    shafts=[
        wb.Shaft("a", "b", stiffness=3000.0, damping=2.0),
        wb.Shaft("b", "ground", stiffness=1500.0, damping=1.0),
    ],
    contacts=[
        wb.Contact(
            "a", name="first", brake=wb.ConventionalBrake(radius=0.1), **pad,
            actuation=wb.Actuation(initial_force=200.0),
        ),
        wb.Contact(
            "b", name="second", brake=wb.WedgeBrake(angle=0.4, radius=0.1), **pad,
            actuation=wb.Actuation(initial_force=100.0),
        ),
    ],
    torques=[wb.Torque("a", wb.Harmonic(80.0, 6.0))],
)
smooth_paper = smooth.machine
cases = {
    "sweep of 20 points, paper's brake as a machine": lambda: wb.sweep(
        paper, {"brake.initial_force": forces}, **fixed
    ),
    "sweep of 20 points, 2 inertias, 2 contacts": lambda: wb.sweep(
        pair, {"first.initial_force": np.linspace(150.0, 250.0, 20)}, **fixed
    ),
    "sweep of 4 points, smoothed brake as a machine": lambda: wb.sweep(
        smooth_paper, {"brake.initial_force": forces[::5]}, **fixed
    ),
    "sweep of 200 points, turning shaft": lambda: wb.sweep(turning, threads=1, **over),
    "diagram of 400 points, exact": diagram(exact, etas),
    "diagram of 40 points, smoothed": diagram(smooth, etas[::10]),
    "response, exact": lambda: wb.simulate(exact.replace(eta=-24.0), periods=250),
    "energy": lambda r=wb.simulate(exact.replace(eta=-24.0), periods=250): wb.energy(r),
    "branch, exact": branch(exact),
    "branch, smoothed": branch(smooth),
}
for name, run in cases.items():
    print(name, timing.best(run, 2.0), sep="\\t")
"""
COLD = """
import time, wedgebrake as wb
start = time.process_time()
for name, run in {
    "simulate": lambda: wb.simulate(wb.paper.system(), periods=3),
    "motion": lambda: wb.motion(wb.paper.system()),
    "smoothed": lambda: wb.motion(wb.paper.system(friction="smoothed"), 60, transient=40),
    "orbit": lambda: wb.orbit(wb.paper.system()),
}.items():
    run()
    print(f"cold, up to {name}", time.process_time() - start, sep="\\t")
"""


def measured(version, program, **environment):
    """Times [s] by case that a program prints when it runs with a version."""
    folders = (version / "src", version / "benchmarks", version / "tests")
    done = subprocess.run(  # noqa: S603 - the programs above
        [sys.executable, "-c", program], check=True, capture_output=True, text=True,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(map(str, folders)), **environment},
    )  # fmt: skip
    rows = (line.split("\t") for line in done.stdout.splitlines() if "\t" in line)
    return {name: float(seconds) for name, seconds in rows}


def main():
    """Measure both versions in turn and print the ratios."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("former", type=Path)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--cold", action="store_true", help="compile into an empty cache too")
    given = parser.parse_args()
    versions = {"former": given.former.resolve(), "this": ROOT}
    shortest = {name: {} for name in versions}
    programs = [(KERNELS, False), (FRONT, False), *([(COLD, True)] if given.cold else [])]
    with tempfile.TemporaryDirectory() as folder:
        for turn in range(given.rounds):
            for program, empty in programs:
                for name, version in versions.items():
                    cache = Path(folder) / (f"{name}{turn}" if empty else name)
                    found = measured(version, program, NUMBA_CACHE_DIR=str(cache))
                    for case, seconds in found.items():
                        before = shortest[name].get(case, float("inf"))
                        shortest[name][case] = min(before, seconds)
    print(f"{'':48}{'former':>10}{'this':>10}{'ratio':>8}")
    for case, former in shortest["former"].items():
        this = shortest["this"][case]
        print(f"{case:48}{1e3 * former:10.3f}{1e3 * this:10.3f}{this / former:8.2f}")


if __name__ == "__main__":
    main()
