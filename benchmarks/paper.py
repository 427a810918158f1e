"""Speed of the paper's audit, beside the paper's own scheme in the same run: ``make bench``.

Work: figure 8, both brakes, 200 columns each, smoothed friction, by the adaptive solver and, on
some columns, by the fixed-step scheme that the paper used; and the whole of ``wedgebrake paper
all`` in a process of its own (with compiled kernels, unless the first run has to compile them).
"""

import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from wedgebrake.paper.diagrams import PLANS, diagram
from wedgebrake.paper.laboratory import Laboratory
from wedgebrake.paper.timing import measure

TARGET_FIGURE_8, TARGET_ALL = 8.0, 60.0
COUNT, FEW = 200, 8


def figure_8(method, count):
    """Seconds for both diagrams of figure 8 with ``count`` columns each."""
    with Laboratory(method) as laboratory:
        laboratory.steady(PLANS["8a"].base)  # compiles
        start = time.perf_counter()
        for name in ("8a", "8b"):
            plan = PLANS[name]
            diagram(laboratory, plan.base, plan.name, np.linspace(plan.low, plan.high, count))
        return time.perf_counter() - start


def everything():
    """Seconds for the whole command, its start included."""
    program = Path(sys.executable).with_name("wedgebrake")
    with tempfile.TemporaryDirectory() as folder:
        start = time.perf_counter()
        subprocess.run(  # noqa: S603 - our own program
            [program, "paper", "all", "--out", Path(folder) / "paper"], check=True,
            capture_output=True,
        )  # fmt: skip
        return time.perf_counter() - start


def main() -> None:
    """Measure and print."""
    ours = figure_8("smooth", COUNT)
    scheme = figure_8("ode14x", FEW) * COUNT / FEW
    exact = figure_8("exact", COUNT)
    print("Figure 8, both brakes, 200 columns each, 25 s of motion a column")
    print(f"  adaptive, smoothed   {ours:8.2f} s   (target {TARGET_FIGURE_8:g} s)")
    print(f"  ODE14x, smoothed     {scheme:8.2f} s   {scheme / ours:6.1f} times as long")
    print(f"  exact, Coulomb       {exact:8.2f} s   {exact / ours:6.2f} times as long")
    print("Figure 5, 5 s of motion; the paper's machine took 7.6 s smoothed and 15.1 s Coulomb")
    for one in measure():
        print(f"  {one.words:58s} {1e3 * one.seconds:8.2f} ms   {one.times_faster:7.0f} times")
    total = everything()
    print(f"wedgebrake paper all       {total:8.1f} s   (target {TARGET_ALL:g} s)")


if __name__ == "__main__":
    main()
