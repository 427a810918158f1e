"""Harmonic balance compared with ``wb.response_curve``: errors and times.

Work: the orbits of a machine with two inertias and one brake over the frequency of the torque,
through two resonances, with up to four sticks per period. The table for docs/benchmarks.md is
written to out/harmonics.json. Times are per orbit, on one core.
"""

import json
import os
import time
from pathlib import Path
from typing import Any

import numpy as np

import wedgebrake as wb
from pages import harmonic_table
from peers.harmonic_balance import HarmonicBalance
from timing import best

MEASURED = Path(__file__).parents[1] / "out" / "harmonics.json"
HARMONICS = (1, 3, 5, 9, 17, 33, 65)
LEVEL, ENDS = 60.0, (3.0, 9.0)
MACHINE = wb.Machine(
    inertias=[wb.Inertia("engine", 0.8), wb.Inertia("disc", 0.4)],
    shafts=[
        wb.Shaft("engine", "disc", stiffness=1100.0, damping=0.35),
        wb.Shaft("disc", "ground", stiffness=2000.0, damping=0.5),
    ],
    contacts=[
        wb.Contact(
            "disc",
            name="brake",
            brake=wb.ConventionalBrake(radius=0.2),
            friction=wb.CoulombFriction(kinetic=0.3),
            actuation=wb.Actuation(initial_force=500.0),
        )
    ],
    torques=[wb.Torque("engine", wb.Harmonic(LEVEL, ENDS[0]))],
)
# Harmonic balance is applied at every n-th orbit of the curve.
EVERY = 5


def balanced(harmonics: int, curve: Any) -> dict[str, float]:
    """Time and errors of harmonic balance at the frequencies of a curve."""
    solver, found = HarmonicBalance(MACHINE, harmonics), []
    frequencies = curve["engine-torque.frequency"].values
    begin = time.perf_counter()
    for frequency in frequencies:
        there = solver.solve(frequency)
        found.append([there, *solver.amplitudes(frequency), solver.sticking()])
    seconds = time.perf_counter() - begin
    there, sizes, shares = np.split(np.array(found), [1, 3], axis=1)
    if not there.all():
        raise RuntimeError(f"{harmonics} harmonics: Newton's method did not converge everywhere")
    exact = curve["angle_amplitude"].values
    return {
        "harmonics": harmonics,
        "seconds": seconds / frequencies.size,
        "error_amplitude": float(np.abs(sizes - exact).max() / exact.max()),
        "error_sticking": float(np.abs(shares - curve["stick_share"].values).max()),
    }


def measure() -> dict[str, Any]:
    """The table."""
    load = os.getloadavg()[0]

    def follow() -> Any:
        return wb.response_curve(MACHINE, frequency=ENDS, levels=[LEVEL])

    curve = follow()
    seconds = best(follow, seconds=1.0, least=2) / curve.sizes["point"]
    chosen = curve.isel(point=slice(None, None, EVERY))
    rows = [balanced(harmonics, chosen) for harmonics in HARMONICS]
    return {
        "load": load, "orbits": curve.sizes["point"], "own": seconds,
        "bifurcations": curve.sizes["bifurcation"], "rows": rows,
    }  # fmt: skip


def main() -> None:
    """Measure, write the results and print them."""
    found = measure()
    MEASURED.parent.mkdir(exist_ok=True)
    MEASURED.write_text(json.dumps(found, indent=1), encoding="utf-8")
    print(harmonic_table(found))


if __name__ == "__main__":
    main()
