"""wb.orbit: what it finds, what it says where there is nothing to find."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest

import wedgebrake as wb
from wedgebrake.orbits.orbit import OrbitStatus


def _returned(found: wb.Orbit) -> np.ndarray:
    """Distance to the orbit's own point after its time, in shares of the orbit's size."""
    end = wb.simulate(
        found.system, periods=found.order, initial=(found.angle, found.velocity), times=()
    ).attrs
    apart = end["final_angle"] - found.angle, end["final_velocity"] - found.velocity
    return np.abs(apart) / (found.angle_amplitude, found.velocity_amplitude)


FOUND = {
    "2T of the wedge": (wb.paper.system(eta=-24.0, F0=0.067), 2),
    "unstable T of the wedge": (wb.paper.system(eta=-24.0, F0=0.067), 1),
    "releases": (wb.paper.system(eta=-60.0, F0=0.036), 2),
    "unstable T with releases": (wb.paper.system(eta=-60.0, F0=0.036), 1),
    "conventional": (wb.paper.system(eta=-6.0, F0=0.05, brake="conventional"), 1),
    "no friction": (wb.paper.system(eta=0.0).replace(kinetic=0.0, static=0.0, damping=5.0), 1),
    "undamped": (wb.paper.system(eta=-24.0, F0=0.067).replace(damping=0.0), 2),
    "never pressed at rest": (wb.paper.system().replace(initial_force=0.0, slope=20.0), 1),
    "turning, never at rest": (
        wb.paper.system(eta=0.0, F0=0.067).replace(drive_speed=20.0), 1,
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", FOUND)
def test_orbit_returns_under_the_exact_flow(name) -> None:
    system, order = FOUND[name]
    found = wb.orbit(system, order)
    assert found.found
    assert found.order == order
    assert np.all(_returned(found) <= 1e-10)
    every = wb.poincare(
        system, periods=order, transient=0, initial=(found.angle, found.velocity), method="exact"
    )
    seen = np.column_stack((every.angle.values, every.velocity.values))[:order]
    size = (found.angle_amplitude, found.velocity_amplitude)
    shifts = [np.max(np.abs(np.roll(found.points, -k, axis=0) - seen) / size) for k in (0, 1)]
    assert min(shifts) <= 1e-9


@pytest.mark.parametrize("name", FOUND)
def test_newtons_steps_are_squares_of_the_last(name) -> None:
    """Quadratic convergence, until rounding."""
    system, order = FOUND[name]
    steps = wb.orbit(system, order).steps
    assert steps[-1] <= 1e-9
    for before, after in pairwise(steps):
        assert after <= max(100.0 * before**2, 1e-12)


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


def test_multipliers_are_those_of_differences_of_the_flow() -> None:
    for system, order in FOUND.values():
        found = wb.orbit(system, order)
        base = np.array([found.angle, found.velocity])
        scale = np.array([found.angle_amplitude, found.velocity_amplitude])

        def end(state, system=system, order=order):
            r = wb.simulate(system, periods=order, initial=tuple(state), times=()).attrs
            return np.array([r["final_angle"], r["final_velocity"]])

        columns = []
        for i in range(2):
            move = np.zeros(2)
            move[i] = 1e-6 * scale[i]
            columns.append((end(base + move) - end(base - move)) / (2e-6 * scale[i]))
        matrix = np.stack(columns, axis=1)
        first, second = found.multipliers
        trace, determinant = (first + second).real, (first * second).real
        assert np.trace(matrix) == pytest.approx(trace, rel=1e-4, abs=1e-4)
        assert np.linalg.det(matrix) == pytest.approx(determinant, rel=1e-3, abs=1e-3)


def test_free_vibration_has_the_multipliers_of_its_damping() -> None:
    """Without friction: modulus exp(-c T/2J), angle sqrt(k/J - (c/2J)^2) T; amplitude too."""
    system = wb.paper.system(eta=0.0).replace(kinetic=0.0, static=0.0, damping=5.0)
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


class TestNothingFound:
    """Each status with what can be done."""

    def _is(self, found: wb.Orbit, status: OrbitStatus) -> None:
        assert found.status is status
        assert not found.found
        assert math.isnan(found.angle)
        assert math.isnan(found.velocity)
        assert found.message == found.verdict
        assert found.as_dict()["status"] == status.value

    def test_at_rest(self) -> None:
        found = wb.orbit(wb.paper.system(eta=0.0, F0=0.5))
        self._is(found, OrbitStatus.AT_REST)

    def test_locked_on_a_turning_shaft(self) -> None:
        found = wb.orbit(wb.paper.system().replace(alpha=0.9, drive_speed=5.0))
        self._is(found, OrbitStatus.NO_RUN)

    def test_diverging(self) -> None:
        system = wb.paper.system(eta=-60.0).replace(release=False)
        self._is(wb.orbit(system), OrbitStatus.NO_RUN)

    def test_chaos(self) -> None:
        found = wb.orbit(wb.paper.system(eta=-28.0, F0=0.036), limit=2000)
        self._is(found, OrbitStatus.NOT_PERIODIC)

    def test_lower_order(self) -> None:
        found = wb.orbit(wb.paper.system(eta=-10.0, F0=0.067), 2, initial=(0.03, 1.0))
        self._is(found, OrbitStatus.OF_LOWER_ORDER)

    def test_only_one_period_without_friction(self) -> None:
        system = wb.paper.system(eta=0.0).replace(kinetic=0.0, static=0.0, damping=5.0)
        self._is(wb.orbit(system, 3), OrbitStatus.OF_LOWER_ORDER)

    def test_a_wait_that_is_too_short_is_not_called_aperiodic(self) -> None:
        """Not settled yet is not the same as settling to no orbit: the limit has to be named."""
        found = wb.orbit(wb.paper.system(eta=-24.0, F0=0.067), limit=1)
        assert found.status is OrbitStatus.NOT_SETTLED

    def test_without_a_spring_the_cause_is_told(self) -> None:
        """Orbits are not isolated there: no guess helps, and a message must not ask for one."""
        found = wb.orbit(wb.paper.system(eta=-6.0, F0=0.067).replace(stiffness=0.0))
        assert found.status is OrbitStatus.NOT_ISOLATED

    def test_without_torque_the_cause_is_told(self) -> None:
        """A limit cycle of its own has no phase: no guess helps either."""
        system = wb.paper.system(eta=-6.0, F0=0.067).replace(
            amplitude=0.0, drive_speed=0.3, static=0.33
        )
        found = wb.orbit(system, 1)
        assert found.status is OrbitStatus.NOT_ISOLATED


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


class TestArguments:
    SYSTEM = wb.paper.system(eta=-24.0, F0=0.067)

    @pytest.mark.parametrize("order", [0, -1, 1.5, True, "2", 513, math.nan])
    def test_order(self, order) -> None:
        with pytest.raises(wb.InputError, match=r"order = .*whole number of periods, 1 to 512"):
            wb.orbit(self.SYSTEM, order)

    @pytest.mark.parametrize("initial", [(1.0,), ("a", 2.0), (math.nan, 0.0), 3.0, (1e300, 0.0)])
    def test_initial(self, initial) -> None:
        with pytest.raises(wb.InputError, match="initial"):
            wb.orbit(self.SYSTEM, initial=initial)

    @pytest.mark.parametrize("method", ["ode14x", "smooth", "bogus", 3])
    def test_method(self, method) -> None:
        with pytest.raises(wb.InputError, match="method"):
            wb.orbit(self.SYSTEM, method=method)

    @pytest.mark.parametrize("rtol", [0.0, -1.0, "a", math.nan, 1.0])
    def test_rtol(self, rtol) -> None:
        with pytest.raises(wb.InputError, match="rtol"):
            wb.orbit(self.SYSTEM, rtol=rtol)

    @pytest.mark.parametrize("limit", [0, 1.5, "a", True])
    @pytest.mark.parametrize("order", [None, 1])
    def test_limit(self, limit, order) -> None:
        """Also where an order with a guess makes it unused."""
        with pytest.raises(wb.InputError, match="limit"):
            wb.orbit(self.SYSTEM, order, initial=(0.0, 0.0), limit=limit)

    def test_system(self) -> None:
        with pytest.raises(wb.InputError, match="BrakedDriveline"):
            wb.orbit(3)


def test_a_stick_has_no_negative_zero_multiplier() -> None:
    """The verdict is read by people: "-0" is no number of theirs."""
    found = wb.orbit(wb.paper.system(eta=-24.0, F0=0.067), 1)
    assert "-0;" not in found.verdict
