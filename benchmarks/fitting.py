"""Fits with exact derivatives and with differences: ``python benchmarks/fitting.py``.

A machine with five free parameters and a trace of 25 s at 1 kHz with noise, the same solver, start
and tolerances. ``least_squares`` takes the derivatives of ``wb.sensitivity`` or its own
differences, of a relative step of 1.5e-8. Printed, and written to out/fitting.json: processor time
[s], simulations and the largest error of a parameter in its standard deviations.
"""

import json
import os
import time
from pathlib import Path

import numpy as np
import scipy.optimize

import wedgebrake as wb

MEASURED = Path(__file__).parents[1] / "out" / "fitting.json"
TIMES = np.linspace(0.0, 25.0, 25001)
VALUES = {
    "brake.kinetic": 0.3, "brake.slope": -20.0, "shaft.stiffness": 1000.0, "shaft.damping": 0.5,
    "engine.amplitude": 150.0,
}  # fmt: skip


def machine():
    """One inertia with a wedge brake under a harmonic torque."""
    return wb.Machine(
        inertias=[wb.Inertia("disc", 1.0, angle=0.01, speed=2.0)],
        shafts=[wb.Shaft("disc", "ground", name="shaft", stiffness=1000.0, damping=0.5)],
        contacts=[
            wb.Contact(
                "disc", name="brake", brake=wb.WedgeBrake(angle=1.2, radius=0.2),
                friction=wb.CoulombFriction(kinetic=0.3, static=0.5),
                actuation=wb.Actuation(initial_force=400.0, slope=-20.0),
            )
        ],
        torques=[wb.Torque("disc", wb.Harmonic(150.0, 7.0, 0.3), name="engine")],
    )  # fmt: skip


def by_differences(start, measured):
    """Values by least squares with SciPy's differences, and the number of simulations."""
    sizes = np.array([abs(value) for value in VALUES.values()])
    runs = 0

    def residuals(x):
        nonlocal runs
        runs += 1
        system = start.replace(dict(zip(VALUES, x * sizes, strict=True)))
        return wb.simulate(system, 25.0, times=TIMES)["velocity"].to_numpy()[:, 0] - measured

    first = np.array([start.value(name) for name in VALUES]) / sizes
    found = scipy.optimize.least_squares(residuals, first)
    return dict(zip(VALUES, found.x * sizes, strict=True)), runs


def main():
    """Print one row for each way."""
    true = machine()
    clean = wb.simulate(true, 25.0, times=TIMES)["velocity"].to_numpy()[:, 0]
    noisy = clean + np.random.default_rng(1).normal(0.0, 0.02, TIMES.size)
    start = true.replace({name: 1.02 * value for name, value in VALUES.items()})
    free = {name: tuple(sorted((0.5 * one, 2.0 * one))) for name, one in VALUES.items()}
    free["brake.kinetic"] = (0.15, 0.5)
    trace, observe = {"time": TIMES, "velocity": noisy}, {"velocity": "disc.speed"}
    wb.fit(start, {"time": TIMES[:200], "velocity": noisy[:200]}, free, observe=observe)
    begin = time.process_time()
    fitted = wb.fit(start, trace, free, observe=observe)
    spent = time.process_time() - begin
    rows = [("exact derivatives", spent, fitted.evaluations, fitted.values)]
    begin = time.process_time()
    values, runs = by_differences(start, noisy)
    rows.append(("differences", time.process_time() - begin, runs, values))
    measured = []
    for name, seconds, count, found in rows:
        errors = [abs(found[one] - value) / fitted.stderr[one] for one, value in VALUES.items()]
        row = {"derivatives": name, "seconds": seconds, "runs": count, "error": max(errors)}
        measured.append(row)
        print(f"{name:<20}{seconds:8.2f} s{count:6d} runs{max(errors):10.3g} deviations")
    MEASURED.parent.mkdir(exist_ok=True)
    written = {"load": os.getloadavg()[0], "rows": measured}
    MEASURED.write_text(json.dumps(written, indent=1), encoding="utf-8")


if __name__ == "__main__":
    main()
