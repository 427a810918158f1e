"""wb.orbit: what it finds, what it says where there is nothing to find."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest

import wedgebrake as wb
from differences import jacobian
from wedgebrake.errors import InputError
from wedgebrake.orbits.orbit_status import OrbitStatus

FRICTIONLESS = wb.paper.system(eta=0.0).replace(kinetic=0.0, static=0.0, damping=5.0)
FOUND = {
    "2T of the wedge": (wb.paper.system(eta=-24.0, F0=0.067), 2),
    "unstable T of the wedge": (wb.paper.system(eta=-24.0, F0=0.067), 1),
    "releases": (wb.paper.system(eta=-60.0, F0=0.036), 2),
    "unstable T with releases": (wb.paper.system(eta=-60.0, F0=0.036), 1),
    "conventional": (wb.paper.system(eta=-6.0, F0=0.05, brake="conventional"), 1),
    "no friction": (FRICTIONLESS, 1),
    "undamped": (wb.paper.system(eta=-24.0, F0=0.067).replace(damping=0.0), 2),
    "never pressed at rest": (wb.paper.system().replace(initial_force=0.0, slope=20.0), 1),
    "turning, never at rest": (
        wb.paper.system(eta=0.0, F0=0.067).replace(drive_speed=20.0), 1,
    ),
}  # fmt: skip


@pytest.fixture(scope="module", params=FOUND)
def found(request) -> wb.Orbit:
    """Each of the orbits in its turn."""
    return wb.orbit(*FOUND[request.param])


def _end(system: wb.BrakedDriveline, order: int, state) -> np.ndarray:
    end = wb.simulate(system, periods=order, initial=tuple(state), times=()).attrs
    return np.array([end["final_angle"], end["final_velocity"]])


def test_orbit_returns_under_the_exact_flow(found) -> None:
    assert found.found
    start = np.array([found.angle, found.velocity])
    size = np.array([found.angle_amplitude, found.velocity_amplitude])
    assert np.all(np.abs(_end(found.system, found.order, start) - start) <= 1e-10 * size)
    every = wb.poincare(
        found.system, periods=found.order, transient=0, initial=tuple(start), method="exact"
    )
    seen = np.column_stack((every.angle.values, every.velocity.values))[: found.order]
    shifts = [np.max(np.abs(np.roll(found.points, -k, axis=0) - seen) / size) for k in (0, 1)]
    assert min(shifts) <= 1e-9


def test_newtons_steps_are_squares_of_the_last(found) -> None:
    """Quadratic convergence, until rounding."""
    assert found.steps[-1] <= 1e-9
    for before, after in pairwise(found.steps):
        assert after <= max(100.0 * before**2, 1e-12)


def test_multipliers_are_those_of_differences_of_the_flow(found) -> None:
    base = np.array([found.angle, found.velocity])
    steps = 1e-6 * np.array([found.angle_amplitude, found.velocity_amplitude])
    matrix = jacobian(lambda start: _end(found.system, found.order, start), base, steps)
    first, second = found.multipliers
    assert np.trace(matrix) == pytest.approx((first + second).real, rel=1e-4, abs=1e-4)
    assert np.linalg.det(matrix) == pytest.approx((first * second).real, rel=1e-3, abs=1e-3)


def test_newton_from_a_guess_some_way_off_is_quadratic() -> None:
    """A smooth law has no events to find first: more than one step is long."""
    system = wb.paper.system(eta=-10.0, F0=0.067, friction="smoothed")
    found = wb.orbit(system, 1, initial=(0.03, 1.0))
    assert found.found
    assert found.steps[-1] <= 1e-9


@pytest.mark.parametrize(
    "system",
    [
        wb.paper.system(eta=-24.0, F0=0.067),
        wb.paper.system(eta=-6.0, F0=0.05, brake="conventional"),
        wb.paper.system(eta=-60.0, F0=0.036),
        wb.paper.system(eta=-10.0, F0=0.036),
        wb.paper.system(eta=-24.0, F0=0.09),
    ],
    ids=["2T", "conventional", "releases", "T", "large force"],
)
def test_exponents_are_those_of_motion_and_sweep(system) -> None:
    """Three ways to the exponents of the motion that the system settles to."""
    found, seen = wb.orbit(system), wb.motion(system)
    assert found.stable
    assert found.order == seen.order
    assert found.exponents[0] == pytest.approx(seen.largest_exponent, rel=1e-5, abs=1e-5)
    if seen.second_exponent == -math.inf:
        assert found.exponents[1] == -math.inf
    else:
        assert found.exponents[1] == pytest.approx(seen.second_exponent, rel=1e-3, abs=1e-3)
    eta = system.groups.eta
    swept = wb.sweep(system, eta=[eta, eta - 1e-6])
    names = [name for name in swept.data_vars if "largest_exponent" in str(name)]
    assert float(swept[names[0]][0]) == pytest.approx(found.exponents[0], rel=1e-5, abs=1e-5)
    for mine, theirs in (
        (found.sticks_forward, seen.sticks_forward),
        (found.sticks_backward, seen.sticks_backward),
        (found.stick_share, seen.stick_share),
    ):
        assert mine == pytest.approx(theirs, rel=1e-6, abs=1e-9)


@pytest.mark.parametrize(("eta", "F0"), [(-10.0, 0.036), (-24.0, 0.067), (-24.0, 0.09)])
def test_exponents_with_smooth_friction_are_those_of_motion_and_sweep(eta, F0) -> None:
    """All three from the variational equation; the sweep has tolerances of its own."""
    system = wb.paper.system(eta=eta, F0=F0, friction="smoothed")
    found, seen = wb.orbit(system), wb.motion(system)
    assert found.order == seen.order
    assert seen.exponent_error == 0.0
    assert seen.largest_exponent == pytest.approx(found.exponents[0], rel=1e-5)
    if not math.isnan(seen.second_exponent):
        assert seen.second_exponent == pytest.approx(found.exponents[1], rel=1e-5)
    swept = wb.sweep(system, F0=[F0], periods=90, transient=60)
    assert float(swept["largest_exponent"][0]) == pytest.approx(found.exponents[0], rel=1e-5)


def test_free_vibration_has_the_multipliers_of_its_damping() -> None:
    """Without friction: modulus exp(-c T/2J), angle sqrt(k/J - (c/2J)^2) T; amplitude too."""
    system = FRICTIONLESS
    line, omega = system.driveline, system.excitation.angular_frequency
    found = wb.orbit(system)
    rate, period = 0.5 * line.damping / line.inertia, 1.0 / system.excitation.frequency
    natural = math.sqrt(line.stiffness / line.inertia - rate**2)
    for one in found.multipliers:
        assert abs(one) == pytest.approx(math.exp(-rate * period), rel=1e-12)
        assert one.real == pytest.approx(math.exp(-rate * period) * math.cos(natural * period))
    gain = line.stiffness - line.inertia * omega**2 + 1j * omega * line.damping
    amplitude = system.excitation.amplitude / abs(gain)
    assert found.angle_amplitude == pytest.approx(amplitude, rel=1e-12)
    assert found.velocity_amplitude == pytest.approx(omega * amplitude, rel=1e-12)


def test_a_smooth_law_near_the_set_valued_one() -> None:
    """Its orbit and multiplier tend to those of Coulomb friction, the steeper the nearer."""
    exact = wb.orbit(wb.paper.system(eta=-10.0, F0=0.05), 1)
    apart = []
    for steepness in (100.0, 400.0, 1600.0):
        system = wb.paper.system(eta=-10.0, F0=0.05, friction="smoothed").replace(
            friction=wb.SmoothedFriction(kinetic=0.3, steepness=steepness)
        )
        found = wb.orbit(system, 1)
        assert found.found
        apart.append(abs(found.velocity_amplitude - exact.velocity_amplitude))
        apart[-1] /= exact.velocity_amplitude
    assert apart[2] < apart[1] < apart[0] < 0.1
    assert apart[2] < 0.3 * apart[0]


# Status: (system, other arguments).
NOTHING = {
    "at rest": (OrbitStatus.AT_REST, wb.paper.system(eta=0.0, F0=0.5), {}),
    "locked on a turning shaft": (
        OrbitStatus.NO_RUN, wb.paper.system().replace(alpha=0.9, drive_speed=5.0), {},
    ),
    "diverging": (OrbitStatus.NO_RUN, wb.paper.system(eta=-60.0).replace(release=False), {}),
    "chaos": (OrbitStatus.NOT_PERIODIC, wb.paper.system(eta=-28.0, F0=0.036), {"limit": 2000}),
    "lower order": (
        OrbitStatus.OF_LOWER_ORDER, wb.paper.system(eta=-10.0, F0=0.067),
        {"order": 2, "initial": (0.03, 1.0)},
    ),
    "one period without friction": (OrbitStatus.OF_LOWER_ORDER, FRICTIONLESS, {"order": 3}),
    # Not settled yet is not the same as settling to no orbit.
    "short wait": (OrbitStatus.NOT_SETTLED, wb.paper.system(eta=-24.0, F0=0.067), {"limit": 1}),
}  # fmt: skip


@pytest.mark.parametrize("name", NOTHING)
def test_what_is_not_found_has_a_status(name) -> None:
    status, system, arguments = NOTHING[name]
    found = wb.orbit(system, **arguments)
    assert found.status is status
    assert not found.found
    assert math.isnan(found.angle)
    assert math.isnan(found.velocity)
    assert found.message == found.verdict == found.as_dict()["message"]
    assert found.as_dict()["status"] == status.value


def test_without_a_spring_an_orbit_is_one_of_the_velocity() -> None:
    """It moves on in each period; its stick forgets every deviation."""
    system = wb.paper.system(eta=-6.0, F0=0.067).replace(stiffness=0.0)
    found, period = wb.orbit(system), 1.0 / system.excitation.frequency
    assert found.found
    assert found.multipliers == (0.0,)
    assert found.stick_share > 0.0
    begin, end = (
        wb.final_state(wb.simulate(found.system, time, initial=found.initial, times=()))
        for time in (period, 2.0 * period)
    )
    assert end.speeds["driveline"] == pytest.approx(found.initial.speeds["driveline"], abs=1e-12)
    turned = begin.angles["driveline"] - found.initial.angles["driveline"]
    assert turned < 0.0
    assert end.angles["driveline"] - begin.angles["driveline"] == pytest.approx(turned, rel=1e-9)


def test_equilibrium_of_a_turning_shaft_without_torque() -> None:
    """Every state of it is the equilibrium: k theta = -M(Omega)."""
    system = wb.paper.system(eta=1.0, F0=0.067).replace(amplitude=0.0, drive_speed=30.0)
    found = wb.orbit(system)
    law, line = system.characteristic, system.driveline
    torque = law.offsets[-1] + law.slopes[-1] * line.drive_speed
    assert found.found
    assert found.angle == pytest.approx(-torque / line.stiffness, rel=1e-12)
    assert found.velocity == pytest.approx(0.0, abs=1e-9)
    assert found.stable


@pytest.mark.parametrize(
    ("name", "value"), [("order", 0), ("order", 513), ("limit", 0), ("rtol", 1.0)]
)
def test_numbers_beyond_their_limits(name, value) -> None:
    """What is no such number at all: test_bad_input."""
    with pytest.raises(wb.InputError) as caught:
        wb.orbit(wb.paper.system(eta=-24.0, F0=0.067), **{name: value})
    assert (caught.value.name, caught.value.value) == (name, value)


class TestFamiliesOfOrbits:
    """Without damping, at half the natural frequency: J = k = 1, torque 6 sin(t/2), friction 1.

    Friction that changes its sign twice a period, half a period apart, contains no second harmonic.
    Free vibration is therefore neither fed nor damped. Between its reversals at t = -pi and
    t = pi the oscillator moves forwards: x = 8 sin(t/2) - 1 + (h + 2) cos(t - pi), then backwards:
    x = 8 sin(t/2) + 1 + h cos(t - pi), for any h from -2 to 0, where a reversal would stick.
    """

    system = wb.BrakedDriveline(
        driveline=wb.Driveline(inertia=1.0, damping=0.0, stiffness=1.0),
        brake=wb.ConventionalBrake(radius=1.0),
        friction=wb.CoulombFriction(kinetic=0.5),
        actuation=wb.Actuation(initial_force=2.0),
        excitation=wb.HarmonicTorque(amplitude=6.0, frequency=0.25 / math.pi),
    )

    @staticmethod
    def second_multiplier(h: float) -> float:
        """Product of the ratios of the accelerations after and before each reversal."""
        first = (6.0 - (9.0 + h) + 1.0) / (6.0 - (9.0 + h) - 1.0)
        return first * (-6.0 - (h - 7.0) - 1.0) / (-6.0 - (h - 7.0) + 1.0)

    @pytest.mark.parametrize("h", [-0.5, -1.0, -1.7])
    @pytest.mark.parametrize("of", ["driveline", "machine"])
    def test_the_orbit_at_the_guess_is_found_and_its_family_is_stated(self, h, of) -> None:
        start = (-3.0 - h, 4.0)
        if of == "driveline":
            found = wb.orbit(self.system, initial=start)
        else:
            machine = self.system.machine
            at = {"driveline.angle": start[0], "driveline.speed": start[1]}
            found = wb.orbit(machine.replace(at))
        assert found.found
        assert not found.isolated
        assert not found.stable
        assert found.points[0] == pytest.approx(start, abs=1e-10)
        assert found.multipliers[0] == pytest.approx(1.0, abs=1e-12)
        assert found.multipliers[1] == pytest.approx(self.second_multiplier(h), abs=1e-9)
        assert "not isolated" in found.verdict
        with pytest.raises(InputError, match=r"^orbit: The orbit is not isolated"):
            wb.continuation(found, amplitude=(5.0, 7.0))

    def test_from_a_guess_beside_the_family_the_nearest_one_is_found(self) -> None:
        """The null vector of the derivative at t = 0 is a change of the angle: that of h."""
        found = wb.orbit(self.system, 1, initial=(-2.49, 4.005))
        assert not found.isolated
        assert found.velocity == pytest.approx(4.0, abs=1e-10)
        assert found.angle == pytest.approx(-2.49, abs=1e-4)

    @pytest.mark.parametrize("change", [{"damping": 0.01}, {"frequency": 0.26 / math.pi}])
    def test_damping_and_another_frequency_isolate_it(self, change) -> None:
        found = wb.orbit(self.system.replace(**change), 1, initial=(-2.5, 4.0))
        assert found.found
        assert found.isolated
        assert abs(found.multipliers[0]) < 0.999
