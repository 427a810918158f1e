"""Siconos itself, under the Python that it is installed for; nothing of the package is used.

Reads {"step", "until", "brakes"} as JSON and writes {"seconds", "states"}. Moreau's time-stepping
with the set-valued law of Coulomb friction as a relay whose bounds, the torques of sliding,
follow the velocity from step to step. A relay of velocities holds impulses: torque times step.
"""

import json
import math
import sys
import time

import siconos.kernel as sk


def follow(brake: dict, step: float, until: float) -> tuple[float, float]:
    """Angle and velocity at the end, from rest."""
    c, k, te, om, r, tan, mu, fa, slope = (
        brake[name] for name in ("c", "k", "te", "om", "r", "tan", "mu", "fa", "slope")
    )
    forward, backward = r * mu / (tan - mu), r * mu / (tan + mu)
    driveline = sk.LagrangianLinearTIDS([0.0], [0.0], [[1.0]], [[k]], [[c]])
    torque = sk.SiconosVector([0.0])
    driveline.setFExtPtr(torque)
    steps = round(until / step)
    step = until / steps
    relay = sk.RelayNSL(1, -forward * fa * step, backward * fa * step)
    # A contact counts as closed while its gap, here the angle less a constant, is not positive.
    contact = sk.Interaction(relay, sk.LagrangianLinearTIR([[1.0]], [-1e3]))
    model = sk.NonSmoothDynamicalSystem(0.0, until + step)
    model.insertDynamicalSystem(driveline)
    model.link(contact, driveline)
    times = sk.TimeDiscretisation(0.0, step)
    simulation = sk.TimeStepping(model, times, sk.MoreauJeanOSI(0.5), sk.Relay())
    for i in range(steps):
        impulse = max(fa + slope * abs(driveline.velocity()[0]), 0.0) * step
        relay.setLb(-forward * impulse)
        relay.setUb(backward * impulse)
        # The rule of the middle: the driving torque is that of half the step.
        torque.setValue(0, te * math.sin(om * (i + 0.5) * step))
        simulation.computeOneStep()
        simulation.nextStep()
    return float(driveline.q()[0]), float(driveline.velocity()[0])


def main() -> None:
    """As asked on standard input."""
    asked = json.load(sys.stdin)
    start = time.perf_counter()
    states = [follow(brake, asked["step"], asked["until"]) for brake in asked["brakes"]]
    print(json.dumps({"seconds": time.perf_counter() - start, "states": states}))


if __name__ == "__main__":
    main()
