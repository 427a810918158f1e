"""Motions in which two events coincide, up to the last bit of a torque's amplitude."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import wedgebrake as wb
from machines import contact, numbers

DURATION = 1.5


def random_machine(generator: np.random.Generator) -> wb.Machine:
    """Up to four inertias with brakes and clutches, which may form loops, and a torque."""
    draw = generator.uniform
    names = [f"i{k}" for k in range(generator.integers(1, 5))]
    shafts = [wb.Shaft("i0", "ground", stiffness=draw(20.0, 200.0), damping=draw(0.0, 0.5))]
    contacts = []
    base_speed = float(generator.choice([0.0, 0.3]))
    for k, name in enumerate(names):
        if k > 0 and draw() < 0.6:
            shafts.append(wb.Shaft(names[k - 1], name, stiffness=draw(20.0, 200.0)))
        if k > 0 and draw() < 0.6:
            slope, lag = (float(generator.choice(one)) for one in ([0.0, -1.0, 1.0], [0.0, 0.05]))
            clutch = contact(
                name, names[k - 1], name=f"c{k}", force=draw(1.0, 8.0), slope=slope, lag=lag
            )
            contacts.append(clutch)
        if k == 0 or draw() < 0.5:
            force = draw(1.0, 8.0)
            pressing = force if draw() < 0.5 else wb.Ramp(force, force + draw(-1.0, 20.0), DURATION)
            contacts.append(contact(name, name=f"b{k}", force=pressing, base_speed=base_speed))
    return wb.Machine(
        inertias=[wb.Inertia(one, draw(0.2, 2.0), speed=generator.normal()) for one in names],
        shafts=shafts,
        contacts=contacts,
        torques=[wb.Torque("i0", wb.Harmonic(1.0, draw(3.0, 15.0), draw(0.0, 6.0)), name="torque")],
    )


@pytest.mark.parametrize(
    "seed", [*range(12), *(pytest.param(one, marks=pytest.mark.slow) for one in range(12, 300))]
)
def test_motions_on_both_sides_of_a_coincidence_are_neighbours(seed: int) -> None:
    """Without a static peak, the final state does not jump where the order of events changes.

    The amplitudes on the two sides differ in their last bit.
    """
    generator = np.random.default_rng([20, seed])
    machine = random_machine(generator)

    def run(amplitude: float) -> tuple[list[tuple[int, int]], Any]:
        response = wb.simulate(machine.replace({"torque.amplitude": amplitude}), DURATION, times=[])
        assert response.attrs["status"] == "completed"
        kinds = zip(response["event_contact"].values, response["event_kind"].values, strict=True)
        return [(int(number), int(kind)) for number, kind in kinds], wb.final_state(response)

    low, high = generator.uniform(0.0, 1.0), generator.uniform(20.0, 40.0)
    events, _ = run(low)
    assert run(high)[0] != events
    while low < 0.5 * (low + high) < high:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if run(middle)[0] == events else (low, middle)
    states = [numbers(run(one)[1]) for one in (low, high)]
    np.testing.assert_allclose(*states, rtol=0, atol=1e-8)
    for share in 10.0 ** np.arange(-15.0, -8.0):
        run(low * (1.0 - share))
        run(low * (1.0 + share))
