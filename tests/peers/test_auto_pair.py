"""Bifurcations of two inertias with a smoothed brake, against AUTO-07p.

AUTO solves for whole orbits by collocation; the package supplies only the numbers of the machine.
The equations are in pair.f90. The orbit that AUTO starts from is integrated by SciPy.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from auto_peer import KINDS, missing, run_auto, write_constants, write_start

import wedgebrake as wb

EQUATIONS = Path(__file__).with_name("pair.f90")
PARAMETERS = {"brake.slope": 1, "engine.amplitude": 2}
NAMES = {"LP": "fold", "PD": "period doubling", "TR": "Neimark-Sacker"}

pytestmark = pytest.mark.skipif(bool(missing()), reason=missing() or "")


def pair(slope: float, amplitude: float, inertia: float = 0.25, stiffness: float = 4.0) -> Any:
    """The paper's brake with a smoothed law, and a second inertia on the first.

    inertia, stiffness : of the second inertia and its shaft, as multiples of the first ones
    """
    system = wb.paper.system()
    line = system.driveline
    return wb.Machine(
        inertias=[wb.Inertia("disc", line.inertia), wb.Inertia("load", inertia * line.inertia)],
        shafts=[
            wb.Shaft("disc", "ground", line.stiffness, line.damping),
            wb.Shaft("load", "disc", stiffness * line.stiffness, line.damping),
        ],
        contacts=[
            wb.Contact(
                "disc", name="brake", brake=system.brake,
                friction=wb.SmoothedFriction(kinetic=0.3, steepness=50.0),
                actuation=wb.Actuation(
                    initial_force=system.actuation.initial_force, slope=slope
                ),
            )
        ],
        torques=[
            wb.Torque("disc", wb.Harmonic(amplitude, system.excitation.frequency), name="engine")
        ],
    )  # fmt: skip


def write_orbit(machine: wb.Machine, omega: float, here: Path) -> None:
    """The orbit on which the machine settles from rest, for AUTO: phase, u(1) ... u(6)."""
    one, other = (inertia.inertia for inertia in machine.inertias)
    first, second = machine.shafts
    contact, amplitude = machine.contacts[0], machine.parameters()["engine.amplitude"]
    force, slope = contact.actuation.initial_force, contact.actuation.slope
    radius, friction = contact.brake.radius, contact.friction
    tangent = math.tan(contact.brake.angle)

    def rates(phase: float, u: Any) -> list[float]:
        angle, other_angle, velocity, other_velocity = u.tolist()
        m = friction.kinetic * math.tanh(friction.steepness * radius * velocity)
        brake = radius * max(0.0, force + slope * abs(velocity)) * m / (tangent - m)
        twist = (angle - other_angle) / omega
        link = second.damping * (velocity - other_velocity) + second.stiffness * twist
        rest = first.damping * velocity + first.stiffness * angle / omega
        on_first = amplitude * math.sin(phase) - brake - rest - link
        return [velocity, other_velocity, on_first / (one * omega), link / (other * omega)]

    write_start(rates, 4, 1, 400, here)
    numbers = (
        one, other, first.damping, second.damping, first.stiffness, second.stiffness, radius, force,
        friction.kinetic, friction.steepness, omega, tangent, slope, amplitude,
    )  # fmt: skip
    (here / "pair.txt").write_text("\n".join(f"{number:.17g}" for number in numbers) + "\n")


def found_by_auto(
    machine: wb.Machine, name: str, stop: float, step: float, here: Path
) -> list[tuple[str, float]]:
    """Kinds and values of the bifurcations of the branch from ``machine`` to ``stop``."""
    frequency = machine.parameters()["engine.frequency"]
    write_orbit(machine, 2.0 * math.pi * frequency, here)
    write_constants(6, PARAMETERS[name], (machine.parameters()[name], stop), step, here)
    run_auto(EQUATIONS, here)
    rows = [line.split() for line in (here / "fort.7").read_text().splitlines()]
    rows = [row for row in rows if row[0] != "0" and int(row[3])]
    kinds = [(KINDS[int(row[2])], float(row[4])) for row in rows]
    assert kinds[-1] == ("UZ", pytest.approx(stop)), "AUTO came to no orbit further on"
    return [(NAMES[kind], value) for kind, value in kinds if kind in NAMES]


@pytest.mark.parametrize(
    ("machine", "name", "stop", "step", "kinds"),
    [
        (pair(-20.0, 500.0), "brake.slope", -42.0, 0.5, ["Neimark-Sacker", "Neimark-Sacker"]),
        pytest.param(
            pair(-20.0, 500.0, 0.1, 10.0),
            "brake.slope",
            -28.0,
            0.5,
            ["period doubling"],
            marks=pytest.mark.slow,
        ),
        (pair(-40.0, 180.0), "engine.amplitude", 190.0, 0.1, ["fold", "fold"]),
    ],
    ids=["Neimark-Sacker", "period doubling", "fold"],
)
def test_bifurcations(machine, name, stop, step, kinds, tmp_path) -> None:
    """AUTO locates a fold between long steps to five digits only."""
    begin = machine.parameters()[name]
    branch = wb.continuation(wb.orbit(machine, 1), {name: (begin, stop)})
    ours = [
        (one.bifurcation.kind.value, one.value)
        for one in list(branch)
        if one.bifurcation is not None
    ]
    theirs = found_by_auto(machine, name, stop, step, tmp_path)
    assert [kind for kind, _ in ours] == [kind for kind, _ in theirs] == kinds
    located = [np.array([value for _, value in found]) for found in (ours, theirs)]
    np.testing.assert_allclose(*located, rtol=1e-5)
