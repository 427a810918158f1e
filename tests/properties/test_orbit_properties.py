"""What must hold of every orbit that is found, whatever the system."""

from __future__ import annotations

import math

import numpy as np
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st

import wedgebrake as wb
from differences import jacobian
from systems import systems
from wedgebrake.orbits.equations.segment_orbit import violated
from wedgebrake.orbits.orbit_status import OrbitStatus

orbit_property = settings(
    max_examples=20,
    deadline=None,  # the first call compiles
    derandomize=True,
    suppress_health_check=[HealthCheck.filter_too_much, HealthCheck.too_slow],
)
# Multipliers beyond which rounding alone leaves an orbit.
_TAME = 1e3


def found(system: wb.BrakedDriveline, order: int | None = None) -> wb.Orbit:
    """The driven orbit, or another example where there is none."""
    assume(system.excitation.amplitude > 0.0)  # without a torque, limit cycles
    orbit = wb.orbit(system, order, limit=3000)
    assume(orbit.found)
    assume(orbit.velocity_amplitude > 0.0)
    return orbit


def _end(orbit: wb.Orbit, state: np.ndarray) -> np.ndarray:
    r = wb.simulate(orbit.system, periods=orbit.order, initial=tuple(state), times=()).attrs
    assume(r["status"] == "completed")
    return np.array([r["final_angle"], r["final_velocity"]])


@orbit_property
@given(systems(), st.sampled_from((None, 1, 2)))
def test_every_answer_is_an_orbit_or_a_reason(system, order):
    """Nothing else than an answer comes out, and it can be written down."""
    orbit = wb.orbit(system, order, limit=500)
    assert orbit.status in OrbitStatus
    assert orbit.verdict
    assert orbit.as_dict()["message"] == orbit.message
    if orbit.found:
        assert math.isfinite(orbit.angle)
        assert math.isfinite(orbit.velocity)
        assert order is None or orbit.order == order


@orbit_property
@given(systems())
def test_orbit_returns(system):
    """Each piece lasts, stays inside its limits, and ends as it must; and it comes back."""
    orbit = found(system)
    assert not violated(orbit._solution.margins)
    assume(abs(orbit.multipliers[0]) < _TAME)
    base = np.array([orbit.angle, orbit.velocity])
    size = np.array([np.max(np.abs(orbit.points[:, 0])) + orbit.angle_amplitude,
                     orbit.velocity_amplitude + abs(system.driveline.drive_speed)])  # fmt: skip
    assert np.all(np.abs(_end(orbit, base) - base) <= 1e-9 * _TAME * size)


@orbit_property
@given(systems())
def test_multipliers_are_those_of_the_flow(system):
    """Trace and determinant of central differences, where both step lengths agree."""
    orbit = found(system)
    assume(abs(orbit.multipliers[0]) < _TAME)
    base = np.array([orbit.angle, orbit.velocity])
    weight = system.driveline.natural_frequency
    # An equilibrium has no size of its own.
    size = orbit.velocity_amplitude + 1e-2 * abs(system.driveline.drive_speed)
    scale = np.array([size / weight, size])

    def derivative(step: float) -> np.ndarray:
        return jacobian(lambda unit: _end(orbit, base + unit * scale) / scale, np.zeros(2), step)

    fine, coarse = derivative(1e-6), derivative(1e-5)
    largest = max(1.0, float(np.max(np.abs(fine))))
    # A graze or a corner between the neighbours: there is no derivative.
    assume(np.max(np.abs(fine - coarse)) <= 1e-4 * largest)
    first, second = orbit.multipliers
    assert abs(np.trace(fine) - (first + second).real) <= 1e-3 * largest
    assert abs(np.linalg.det(fine) - (first * second).real) <= 1e-3 * largest**2


@settings(orbit_property, max_examples=8)
@given(systems(), st.sampled_from(("damping", "amplitude", "slope", "frequency", "drive_speed")),
       st.floats(-1.0, 1.0).filter(lambda x: abs(x) > 1e-3))  # fmt: skip
def test_branches_are_orbits_and_end_for_a_reason(system, name, share):
    """Every tenth point returns, and the end is told in words."""
    orbit = found(system)
    part = system.excitation if name in ("amplitude", "frequency") else system.driveline
    part = system.actuation if name == "slope" else part
    value = getattr(part, name)
    scale = value or (system.excitation.amplitude or 100.0) / (
        system.driveline.inertia * system.driveline.natural_frequency
    )
    share = share if value else abs(share)  # none of them may be negative
    branch = wb.continuation(orbit, points=60, **{name: (value, value + 0.9 * share * abs(scale))})
    points = list(branch)
    assert branch.end
    for point in points[::10]:
        if abs(point.multipliers[0]) > _TAME:
            continue
        end = wb.simulate(
            point.system, periods=point.order, initial=tuple(point.points[0]), times=()
        ).attrs
        apart = np.abs(np.array([end["final_angle"], end["final_velocity"]]) - point.points[0])
        size = np.array([
            np.max(np.abs(point.points[:, 0])) + point.measures.angle_amplitude,
            point.measures.velocity_amplitude + abs(point.system.driveline.drive_speed),
        ])  # fmt: skip
        assert np.all(apart <= 1e-6 * size), (point.value, point.sequence)
