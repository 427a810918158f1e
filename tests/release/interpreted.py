"""Numbers from every kernel, compiled or as plain Python: ``python interpreted.py [--plain]``.

As plain Python the lines of the kernels can be counted (make coverage), and their answers
compared with the compiled ones. Numba's own switch does not serve: laws of friction come to
the kernels as compiled functions.
"""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Callable

import numpy as np


def interpret() -> None:
    """Leave the kernels uncompiled; before any of them is imported."""
    from wedgebrake.dynamics import jit
    from wedgebrake.solvers.smooth import simd_codegen

    np.seterr(all="ignore")  # compiled code divides by zero without a word
    jit.compiled = lambda function, **_options: function
    jit.inlined = lambda function: function
    jit.compiled_for = lambda _signature: lambda function: function
    simd_codegen.traced = lane_by_lane


def lane_by_lane(formula, rows, width):
    """What ``simd_codegen.traced`` compiles, one lane after the other."""

    def run(inputs, outputs):
        from wedgebrake.solvers.smooth.simd_codegen import Plain

        for lane in range(width):
            outputs[:, lane] = formula(Plain, list(inputs[:rows, lane]))

    return run


def results() -> dict[str, list[float]]:
    """Some numbers from each solver, measure and search, of short runs."""
    import wedgebrake as wb

    paper = wb.paper.system
    table = wb.TabulatedFriction(speeds=[0.0, 0.5, 2.0], coefficients=[0.3, 0.25, 0.35])
    turning = paper(eta=-6.0).replace(drive_speed=2.0)
    bare = wb.paper.system().replace(amplitude=0.0)
    own = paper(eta=-6.0).replace(friction=wb.CustomFriction(law=_law, width=0.02, kinetic=0.3))
    exact = {
        "wedge": paper(),
        "release": paper(eta=-60.0),
        "static": paper(static=0.33, eta=-10.0),
        "damped": paper(eta=12.0, damping=300.0),
        "critical": paper(eta=0.0).replace(damping=200.0),
        "free": paper(eta=0.0).replace(stiffness=0.0),
        "freer": paper(eta=0.0).replace(stiffness=0.0, damping=0.0),
        "locked": paper().replace(angle=0.28),
        "diverging": paper(damping=1.0, static=0.33, release=False),
        "table": paper().replace(friction=table),
        "turning": turning,
        "rest": bare,
    }
    smooth = {
        "smoothed": paper(friction="smoothed"),
        "peak": paper(friction="smoothed", static=0.33, eta=-6.0),
        "sliding": turning.replace(friction=wb.SmoothedFriction(kinetic=0.3, static=0.33)),
    }
    found: dict[str, Callable[[], object]] = {
        **{name: lambda s=s: state(wb.simulate(s, periods=3)) for name, s in exact.items()},
        **{
            name: lambda s=s: state(wb.simulate(s, duration=0.06, rtol=1e-6))
            for name, s in smooth.items()
        },
        "fixed step": lambda: state(wb.paper.ode14x(smooth["smoothed"], duration=0.004, step=1e-4)),
        "motion": lambda: judged(wb.motion(paper(), periods=30, transient=10)),
        "settled": lambda: judged(wb.motion(paper(eta=-6.0), transient="auto", limit=60)),
        "chaos": lambda: judged(wb.motion(paper(eta=-40.0), periods=40, transient=10)),
        "smooth motion": lambda: judged(
            wb.motion(smooth["smoothed"], periods=3, transient=1, rtol=1e-5)
        ),
        "steep motion": lambda: judged(
            wb.motion(
                smooth["smoothed"].replace(F0=0.5, steepness=1e4), periods=1, transient=0, rtol=1e-8
            )
        ),
        "lanes": lambda: wb.bifurcation(
            smooth["smoothed"], eta=[-6.0, 0.0], periods=4, transient=2, rtol=1e-5
        )["velocity"].values.ravel(),
        "orbit": lambda: wb.orbit(paper(eta=-24.0), order=1).multipliers[0].real,
        "branches": lambda: wb.branches(paper(), eta=(-10.0, -17.0), step=0.1, points=12)["eta"][0],
        "torus": lambda: judged(wb.motion(paper(eta=-21.5), periods=80, transient=30)),
        "wild": lambda: judged(wb.motion(paper(eta=-60.0), periods=90, transient=30)),
        "sticking orbit": lambda: wb.orbit(paper(eta=-24.0), order=6).velocity_amplitude,
        "sticking branch": lambda: wb.branches(
            paper(F0=0.067, eta=-24.0), eta=(-24.0, -30.0), step=0.1, points=12, switch=0
        )["velocity_amplitude"][0],
        "own law": lambda: state(wb.simulate(own, duration=0.03, rtol=1e-5)),
        "orbit of an own law": lambda: judged(wb.motion(own, periods=3, transient=1, rtol=1e-5)),
        "fixed step, banded": lambda: state(wb.paper.ode14x(paper(), duration=0.01, step=1e-3)),
        "smooth orbit": lambda: (
            wb.orbit(
                smooth["smoothed"].replace(eta=-6.0), order=1, initial=(0.011, -2.0), rtol=1e-5
            ).order
        ),
        "sweep": lambda: wb.sweep(
            paper(), eta=[-24.0, -6.0, 3.0], periods=12, transient=6, threads=1
        )["angle"],
        "followed": lambda: wb.sweep(
            paper(), eta=[-24.0, -6.0], periods=6, transient=3, threads=1, follow="eta"
        )["velocity"],
        "heat": lambda: wb.energy(wb.simulate(paper(), periods=3)).attrs["total_friction_heat"],
        "smooth heat": lambda: wb.energy(
            wb.simulate(smooth["smoothed"], periods=1, rtol=1e-6)
        ).attrs["total_friction_heat"],
    }
    return {name: [float(one) for one in np.ravel(make())] for name, make in found.items()}


def _law(speed: float) -> float:
    """A law of friction that wedgebrake does not know."""
    return 0.3 * math.tanh(50.0 * speed) * (1.0 + 0.1 * math.exp(-abs(speed)))


def judged(motion) -> list[float]:
    """What is known of a motion, in numbers."""
    numbers = (motion.order, motion.largest_exponent, motion.stick_share, motion.peak_torque)
    return [float(np.nan_to_num(one)) for one in numbers]


def state(response) -> list[float]:
    """Where a response ends, and how much happened."""
    ends = [response.attrs["final_angle"], response.attrs["final_velocity"]]
    return [*ends, response.sizes["event"], response.sizes["stick"]]


if __name__ == "__main__":
    if "--plain" in sys.argv:
        interpret()
    json.dump(results(), sys.stdout)
