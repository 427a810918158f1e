"""Program that runs Siconos, under the Python for which it is installed, without the package.

Reads {"step", "until", "machines"} as JSON and writes {"seconds", "states"}. Moreau's time-stepping
with the set-valued law of Coulomb friction as a relay. Its bounds are set before each step from the
actuation force: the torques of sliding or, where a contact was held, those at which it breaks
loose. A relay on velocities bounds impulses: torque times step.
"""

import json
import sys
import time

import numpy as np
import siconos.kernel as sk

HELD = 1e-9  # sliding speed below which a contact counts as held [rad/s]


def values(signal: object, times: np.ndarray) -> list[float]:
    """Values of a signal at some times.

    signal : a number, its values at these times, or {"harmonic": (amplitude, angular frequency,
             phase)}
    """
    if isinstance(signal, dict):
        amplitude, omega, phase = signal["harmonic"]
        return (amplitude * np.sin(omega * times + phase)).tolist()
    return np.broadcast_to(signal, times.shape).tolist()


def follow(machine: dict, step: float, until: float) -> list[float]:
    """Angles and speeds at the end."""
    steps = round(until / step)
    step = until / steps
    # Midpoint rule: torques and forces are those at the middle of the step.
    times = (np.arange(steps) + 0.5) * step
    inertias = sk.LagrangianLinearTIDS(
        machine["angles"], machine["speeds"],
        machine["mass"], machine["stiffness"], machine["damping"],
    )  # fmt: skip
    model = sk.NonSmoothDynamicalSystem(0.0, until + step)
    model.insertDynamicalSystem(inertias)
    torque = sk.SiconosVector([0.0] * len(machine["angles"]))
    inertias.setFExtPtr(torque)
    loads = [(on, values(signal, times)) for on, signal in machine["torques"]]
    contacts = []
    for one in machine["contacts"]:
        relay = sk.RelayNSL(1, 0.0, 0.0)
        # A contact counts as closed while its gap, an angle less a constant, is not positive.
        relation = sk.LagrangianLinearTIR([one["row"]], [-1e3])
        model.link(sk.Interaction(relay, relation), inertias)
        row = [(i, factor) for i, factor in enumerate(one["row"]) if factor]
        contacts.append((relay, row, values(one["force"], times), one["slope"], one["gains"]))
    stepping = sk.TimeDiscretisation(0.0, step)
    simulation = sk.TimeStepping(model, stepping, sk.MoreauJeanOSI(0.5), sk.Relay())
    for i in range(steps):
        speeds = inertias.velocity()
        for relay, row, force, slope, (kinetic, peak) in contacts:
            speed = abs(sum(factor * speeds[k] for k, factor in row))
            impulse = max(force[i] + slope * speed, 0.0) * step
            forward, backward = peak if speed < HELD else kinetic
            relay.setLb(-forward * impulse)
            relay.setUb(-backward * impulse)
        for on, load in loads:
            torque.setValue(on, load[i])
        simulation.computeOneStep()
        simulation.nextStep()
    return [*map(float, inertias.q()), *map(float, inertias.velocity())]


def main() -> None:
    """Answer the request on standard input."""
    asked = json.load(sys.stdin)
    start = time.perf_counter()
    states = [follow(one, asked["step"], asked["until"]) for one in asked["machines"]]
    print(json.dumps({"seconds": time.perf_counter() - start, "states": states}))


if __name__ == "__main__":
    main()
