"""Located bifurcations: a little to either side of them the orbit is another, at 50 digits."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest
import reference_mpmath as reference
from reference_mpmath import BREAKPOINT, REVERSAL, SLIP, STICK, mp

import wedgebrake as wb

# Distance from the located value at which the orbits are other ones, relative.
_BESIDE = 1e-11
# Speed relative to the brake [rad/s] that is rounding of an orbit.
_AT_REST = 1e-9
# Distance at which two orbits that meet are still apart.
_APART = 1e-9

_WEDGE = wb.paper.system()
_CONVENTIONAL = wb.paper.system(brake="conventional")
_TURNING = _WEDGE.replace(eta=-10.0, drive_speed=0.5, amplitude=150.0)


def _branch(system: wb.BrakedDriveline, order: int, **over: tuple[float, float]) -> wb.Branch:
    """The branch from the first of the two values on."""
    ((name, (first, _)),) = over.items()
    return wb.continuation(wb.orbit(system.replace(**{name: first}), order), **over)


def _is(point: wb.BranchPoint, kind: str) -> bool:
    return point.bifurcation is not None and point.bifurcation.kind.value == kind


def _beside(
    system: wb.BrakedDriveline, order: int, kind: str, over: dict[str, tuple[float, float]]
) -> list[reference.Return]:
    """The returns of the orbits at parameters just below and just above a bifurcation."""
    point = next(point for point in _branch(system, order, **over) if _is(point, kind))
    (name,) = over
    values = [point.value - abs(point.value) * _BESIDE, point.value + abs(point.value) * _BESIDE]
    found = []
    for value in values:
        there, start = system.replace(**{name: value}), point.points[0].copy()
        # At rest relative to the brake: with a speed of rounding it would slip, then stick at once.
        rest = -there.driveline.drive_speed
        start[1] = rest if abs(start[1] - rest) <= _AT_REST else start[1]
        found.append(reference.orbit(there, start, order)[1])
    return found


@pytest.mark.parametrize(
    "over",
    # The second where a stick has left one multiplier alone.
    [
        pytest.param({"eta": (-16.0, -16.4)}, marks=pytest.mark.slow),
        {"F0": (0.075, 0.0742)},
    ],
    ids=["eta", "F0"],
)
def test_period_doubling(over) -> None:
    """1 + tr + det = (1 + m_1)(1 + m_2) changes its sign where a multiplier is -1."""
    signs = []
    for there in _beside(_WEDGE, 1, "period doubling", over):
        trace, determinant = reference.invariants(there.matrix)
        signs.append(mp.sign(1 + trace + determinant))
    assert sorted(signs) == [-1, 1]


@pytest.mark.parametrize(
    ("system", "order", "over"),
    [
        (_CONVENTIONAL, 1, {"eta": (-22.5, -23.5)}),
        pytest.param(_CONVENTIONAL, 1, {"F0": (0.038, 0.0375)}, marks=pytest.mark.slow),
        pytest.param(_WEDGE, 2, {"eta": (-21.0, -21.2)}, marks=pytest.mark.slow),
    ],
    ids=["conventional, eta", "conventional, F0", "wedge, two periods"],
)
def test_neimark_sacker(system, order, over) -> None:
    """The product of two complex multipliers goes through 1."""
    signs = []
    for there in _beside(system, order, "Neimark-Sacker", over):
        trace, determinant = reference.invariants(there.matrix)
        assert trace**2 < 4 * determinant
        signs.append(mp.sign(determinant - 1))
    assert sorted(signs) == [-1, 1]


# Kind with parameter: (system, range, events that only the orbit at the lesser value has, and
# those that only that at the greater value has).
OF_FRICTION = {
    ("switching-sliding", "F0"): (_WEDGE, (0.061, 0.059), [REVERSAL], []),
    ("grazing-sliding", "F0"): (_WEDGE, (0.0585, 0.058), [], [STICK, SLIP]),
    ("crossing-sliding", "F0"): (
        _WEDGE.replace(eta=-10.0), (0.0505, 0.0509), [REVERSAL], [STICK, SLIP],
    ),
    ("grazing", "eta"): (_WEDGE, (-25.5, -25.7), [BREAKPOINT, BREAKPOINT], []),
    ("adding-sliding", "drive_speed"): (_TURNING, (0.61, 0.62), [], [STICK, SLIP]),
}  # fmt: skip


ALWAYS = ("grazing-sliding", "grazing", "adding-sliding")


@pytest.mark.parametrize(
    ("kind", "name"),
    [
        pytest.param(kind, name, marks=() if kind in ALWAYS else pytest.mark.slow)
        for kind, name in OF_FRICTION
    ],
)
def test_bifurcation_of_friction(kind, name) -> None:
    """An orbit of 50 digits has a piece more on one side."""
    system, values, *expected = OF_FRICTION[kind, name]
    less, greater = (
        Counter(event for event, _ in there.events)
        for there in _beside(system, 1, kind, {name: values})
    )
    assert [less - greater, greater - less] == [Counter(events) for events in expected]


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "power"), [("fold", 2), ("grazing-sliding", 1)])
def test_two_orbits_meet(kind, power) -> None:
    """Their distance, to a power in proportion to that from the fold, vanishes at its value.

    A fold of a smooth map is a parabola; a non-smooth one, here of grazing-sliding, a corner.
    """
    system = _WEDGE.replace(eta=-5.0, drive_speed=1.0, amplitude=150.0)
    points = list(_branch(system, 1, f=(0.51, 0.43)))
    place = next(
        i
        for i, point in enumerate(points)
        if _is(point, kind)
        and (points[i - 1].value - point.value) * (points[i + 1].value - point.value) > 0.0
    )
    point = points[place]
    side = np.sign(points[place + 1].value - point.value)
    distances, tests = [], []
    for away in (_APART, 4.0 * _APART):
        value = point.value * (1.0 + side * away)
        states = []
        for neighbour in (points[place - 1], points[place + 1]):
            share = (value - point.value) / (neighbour.value - point.value)
            along = neighbour.points[0] - point.points[0]
            guess = point.points[0] + along * share ** (1.0 / power)
            state, there = reference.orbit(system.replace(f=value), guess, 1)
            trace, determinant = reference.invariants(there.matrix)
            states.append(state)
            tests.append(1 - trace + determinant)
        distances.append(mp.norm(states[1] - states[0]) ** power)
        # A multiplier of one is beyond 1, of the other it is not yet.
        assert tests[-2] * tests[-1] < 0
    near, far = distances
    # Where the line through both vanishes, less the located value.
    left = _APART * (1 - 3 * near / (far - near))
    assert abs(left) <= _BESIDE
