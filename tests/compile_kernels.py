"""Compile the largest kernels, so that the processes that run the tests do not each compile them.

    python tests/compile_kernels.py drivelines|machines

One kernel is compiled in one thread. The two groups share little and can be compiled at a time.
"""

import sys
from pathlib import Path

import wedgebrake as wb

EXAMPLES = Path(__file__).parents[1] / "examples"


def drivelines() -> None:
    for friction in ("coulomb", "smoothed"):
        system = wb.paper.system(friction=friction)
        wb.simulate(system, periods=2)
        wb.motion(system, periods=20)
        wb.bifurcation(system, slope=[-3.0, -2.0], periods=20, transient=10)
        wb.branches(system, slope=(-3.0, -2.9), points=3)


def machines() -> None:
    wb.simulate(wb.load_study(EXAMPLES / "clutch.toml").system, duration=0.1)
    belt = wb.load_study(EXAMPLES / "belt.toml").system
    for method in ("exact", "smooth"):
        wb.motion(belt, method=method)


if __name__ == "__main__":
    {"drivelines": drivelines, "machines": machines}[sys.argv[1]]()
