"""Random machines with all parts: their responses are solutions of the equations.

See ``verified``: the sides of contacts and lines of laws that a response shows are put into the
equations, which another integrator solves; nothing of the solver's search is used.
"""

from __future__ import annotations

import pytest

import wedgebrake as wb
from machine_draw import joined_machine, random_machine
from verified import error_of

MANY, PACK = 1500, 50
DURATION = 6.0


def check(seed: int) -> None:
    assert error_of(random_machine(seed), DURATION) < 1e-9, seed


@pytest.mark.parametrize("seed", range(6))
def test_random_machines(seed: int) -> None:
    check(seed)


@pytest.mark.slow
@pytest.mark.parametrize("first", range(0, MANY, PACK))
def test_many_random_machines(first: int) -> None:
    for seed in range(first, first + PACK):
        check(seed)


@pytest.mark.parametrize("seed", range(4))
def test_joints(seed: int) -> None:
    """With joints and contacts with ratios."""
    machine = joined_machine(seed).replace(controllers=[])
    assert error_of(machine, DURATION) < 1e-9


@pytest.mark.slow
@pytest.mark.parametrize("first", range(6, MANY // 3, PACK))
def test_many_joints(first: int) -> None:
    for seed in range(first, first + PACK):
        machine = joined_machine(seed)
        if machine.joints:
            assert error_of(machine.replace(controllers=[]), DURATION) < 1e-9, seed


@pytest.mark.parametrize("seed", range(4))
def test_drag_too(seed: int) -> None:
    """With a curve over the speed."""
    machine = random_machine(100 + seed)
    drag = wb.Drag(machine.inertias[0].name, 0.1 * (seed % 3), 0.05 * (1 + seed % 2), name="air")
    given = machine.replace(contacts=[*machine.contacts, drag])
    assert error_of(given, DURATION, method="smooth") < 1e-9


@pytest.mark.parametrize("seed", range(4))
def test_equations_of_another_machine(seed: int) -> None:
    """A response does not solve equations in which a damping differs by a millionth."""
    machine = random_machine(seed)
    first = machine.shafts[0]
    name = f"{first.name}.damping"
    other = machine.replace({name: first.damping + 1e-6})
    try:
        error = error_of(machine, DURATION, equations=other)
    except AssertionError:
        return
    assert error > 1e-9
