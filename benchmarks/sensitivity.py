"""Exact derivatives against finite differences of the same solver: error and time, in one table.

The differences are those of SciPy's optimisers: a step of eps^(1/2) forwards and eps^(1/3) about
the value. The error is the largest one of the velocities, relative to their largest derivative.
"""

import time
from collections.abc import Callable

import numpy as np

import wedgebrake as wb

MACHINE = wb.Machine(
    inertias=[wb.Inertia("disc", 0.8), wb.Inertia("hub", 0.4, speed=5.0)],
    shafts=[
        wb.Shaft("disc", "hub", name="shaft", stiffness=1100.0, damping=0.35),
        wb.Shaft("hub", "ground", name="mount", stiffness=2000.0, damping=0.5),
    ],
    contacts=[
        wb.Contact(
            "disc",
            name="brake",
            brake=wb.WedgeBrake(angle="22 deg", radius=0.2),
            friction=wb.CoulombFriction(kinetic=0.35, static=0.4),
            actuation=wb.Actuation(initial_force=100.0, slope=-20.0),
        )
    ],
    torques=[wb.Torque("disc", wb.Harmonic(150.0, 7.0), name="engine")],
)
NAMES = ["brake.kinetic", "brake.slope", "shaft.stiffness", "disc.inertia", "engine.amplitude"]
RUN = {"periods": 20, "samples": 200}


def velocities(changes: dict[str, float]) -> np.ndarray:
    return wb.simulate(MACHINE.replace(changes), **RUN)["velocity"].to_numpy()


def differences(step: float, weights: dict[int, float]) -> np.ndarray:
    found = []
    for name in NAMES:
        value = MACHINE.value(name)
        size = step * abs(value)
        parts = [w / size * velocities({name: value + k * size}) for k, w in weights.items()]
        found.append(np.sum(parts, axis=0))
    return np.array(found)


def exact() -> np.ndarray:
    return wb.sensitivity(MACHINE, NAMES, **RUN)["velocity"].to_numpy()


def measured(call: Callable[[], np.ndarray]) -> tuple[np.ndarray, float]:
    found, best = call(), np.inf
    for _ in range(7):
        start = time.perf_counter()
        call()
        best = min(best, time.perf_counter() - start)
    return found, best


def main() -> None:
    eps = np.finfo(float).eps
    central = {1: 0.5, -1: -0.5}
    methods = {
        "exact": exact,
        "forward differences": lambda: differences(eps ** (1 / 2), {1: 1.0, 0: -1.0}),
        "central differences": lambda: differences(eps ** (1 / 3), central),
    }
    # Sixth order; its error is about 1e-10.
    reference = differences(3e-4, {1: 0.75, -1: -0.75, 2: -0.15, -2: 0.15, 3: 1 / 60, -3: -1 / 60})
    scale = np.abs(reference).max(axis=(1, 2))
    single = measured(lambda: velocities({}))[1]
    print(f"{len(NAMES)} parameters; one run {1e3 * single:.2f} ms")
    for name, call in methods.items():
        found, seconds = measured(call)
        error = (np.abs(found - reference).max(axis=(1, 2)) / scale).max()
        print(f"{name:20s} {1e3 * seconds:8.2f} ms {seconds / single:6.1f} runs  error {error:.1e}")


if __name__ == "__main__":
    main()
