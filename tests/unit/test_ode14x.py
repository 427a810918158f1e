"""The paper's fixed-step solver: order, agreement with others, and how it ends."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import wedgebrake as wb
from equations import angular_frequency, right_side
from reference_states import SMOOTHED
from wedgebrake.model.studies.study_run import RunSettings
from wedgebrake.paper.fixed_step import kernel
from wedgebrake.paper.fixed_step import scheme as fixed_step

TABLE = wb.TabulatedFriction(speeds=(0.0, 1.0), coefficients=(0.4, 0.3))
HARMONIC, SIMULINK = ((1, 2, 3, 4), True), ((12, 8, 6, 4), False)


@pytest.fixture(params=[HARMONIC, SIMULINK], ids=["harmonic", "simulink"])
def scheme(request, monkeypatch):
    """Each of the two sequences of substeps."""
    substeps, sees_end = request.param
    monkeypatch.setattr(fixed_step, "SUBSTEPS", substeps)
    monkeypatch.setattr(fixed_step, "SEES_END", sees_end)


run = wb.paper.ode14x


def linear_system(**changes):
    return wb.BrakedDriveline(
        driveline=wb.Driveline(inertia=2.0, damping=30.0, stiffness=8e3),
        brake=wb.ConventionalBrake(radius=0.2),
        friction=wb.SmoothedFriction(kinetic=0.0),
        actuation=wb.Actuation(initial_force=300.0),
        excitation=wb.HarmonicTorque(amplitude=500.0, frequency=7.0),
    ).replace(**changes)


def linear_solution(system, t, angle, velocity, start_time=0.0):
    """(theta, theta') of J theta'' + c theta' + k theta = T_e sin(omega t), underdamped."""
    line, omega = system.driveline, angular_frequency(system)
    J, c, k = line.inertia, line.damping, line.stiffness
    gain = system.excitation.amplitude / (k - J * omega**2 + 1j * c * omega)
    forced, at_start = (gain * np.exp(1j * omega * np.asarray(at)) for at in (t, start_time))
    root = -c / (2.0 * J) + 1j * math.sqrt(k / J - (c / (2.0 * J)) ** 2)
    y, yd = angle - at_start.imag, velocity - (1j * omega * at_start).imag
    free = (y - 1j * (yd - root.real * y) / root.imag) * np.exp(root * (t - start_time))
    return forced.imag + free.real, (1j * omega * forced).imag + (root * free).real


class TestLinear:
    def errors(self, step, times):
        system = linear_system()
        r = run(system, 0.4, initial=(0.02, -1.5), times=times, step=step)
        angle, velocity = linear_solution(system, times, 0.02, -1.5)
        scale = system.driveline.natural_frequency
        return scale * abs(r.angle.values - angle).max() + abs(r.velocity.values - velocity).max()

    @pytest.mark.parametrize("shift", [0.0, 0.0013], ids=["grid points", "between them"])
    @pytest.mark.usefixtures("scheme")
    def test_order_4(self, shift):
        times = np.arange(0.04, 0.36, 0.04) + shift
        coarse, fine = self.errors(4e-3, times), self.errors(2e-3, times)
        finer = self.errors(1e-3, times)
        assert 12.0 < coarse / fine < 22.0
        assert 13.0 < fine / finer < 19.0

    @pytest.mark.usefixtures("scheme")
    def test_down_to_rounding(self):
        assert self.errors(2.5e-5, np.array([0.1, 0.2, 0.4])) < 1e-10

    def test_coulomb_without_friction_is_the_same(self):
        smooth = run(linear_system(), 0.5)
        banded = run(linear_system(friction=wb.CoulombFriction(kinetic=0.0)), 0.5)
        np.testing.assert_allclose(banded.angle, smooth.angle, rtol=0.0, atol=1e-13)

    def test_phase_of_a_late_start(self):
        # The torque's phase after 1e5 periods: 1e-16 of the time itself is 1.4e-12 s.
        system = linear_system()
        start = 100_000.3 / 7.0
        r = run(system, 0.4, initial=(0.02, -1.5), start_time=start, step=1e-4)
        assert r.time.values[-1] == pytest.approx(start + 0.4, rel=1e-15)
        t = r.time.values - start + 0.3 / 7.0  # whole periods taken off
        angle, velocity = linear_solution(system, t, 0.02, -1.5, 0.3 / 7.0)
        np.testing.assert_allclose(r.angle, angle, rtol=0.0, atol=1e-9)
        np.testing.assert_allclose(r.velocity, velocity, rtol=0.0, atol=1e-8)

    def test_poincare_section(self):
        system = linear_system()
        r = run(system, 1.0, initial=(0.02, -1.5), step=1e-4)
        assert r.period.values.tolist() == list(range(8))
        angle, velocity = linear_solution(system, r.poincare_time.values, 0.02, -1.5)
        np.testing.assert_allclose(r.poincare_angle, angle, rtol=0.0, atol=1e-9)
        np.testing.assert_allclose(r.poincare_velocity, velocity, rtol=0.0, atol=1e-8)

    def test_end_off_the_grid(self):
        system = linear_system()
        r = run(system, 0.12345, initial=(0.02, -1.5), step=1e-3)
        angle, velocity = linear_solution(system, 0.12345, 0.02, -1.5)
        assert r.attrs["final_time"] == pytest.approx(0.12345, abs=1e-15)
        assert r.attrs["final_angle"] == pytest.approx(angle, abs=1e-6)
        assert r.attrs["final_velocity"] == pytest.approx(velocity, abs=1e-5)
        assert r.event_time.values.max(initial=0.0) <= 0.12345

    def test_reversals_are_zeros_of_the_velocity(self):
        system = linear_system()
        r = run(system, 1.0, initial=(0.02, -1.5), step=1e-4)
        _, velocity = linear_solution(system, r.event_time.values, 0.02, -1.5)
        dense = linear_solution(system, np.linspace(0.0, 1.0, 20_001), 0.02, -1.5)[1]
        assert r.sizes["event"] == np.count_nonzero(np.diff(np.sign(dense)))
        # Linear interpolation: theta''' h^2/8, with theta''' up to omega^2 of 10 rad/s.
        np.testing.assert_allclose(velocity, 0.0, atol=1e-4)

    def test_no_duration(self):
        r = run(linear_system(), 0.0, initial=(0.02, -1.5))
        assert r.attrs["status"] == "completed"
        assert (r.attrs["final_angle"], r.attrs["final_velocity"]) == (0.02, -1.5)
        assert r.velocity.values[0] == -1.5


class TestSmoothedLaw:
    @pytest.mark.parametrize("case", SMOOTHED)
    @pytest.mark.usefixtures("scheme")
    def test_reference_states(self, case):
        eta, F0 = case
        system = wb.paper.system(eta=eta, F0=F0, f=0.63, alpha=1.18, friction="smoothed")
        states = SMOOTHED[case]
        expected = np.array(list(states.values()))
        coarse, fine = (self.states(system, list(states), step) for step in (2e-4, 1e-4))
        # What halving the step changes bounds what is left, since the error falls by more
        # than half: measured, by 8 to 40 with these steps.
        left = np.max(abs(coarse - fine))
        assert np.max(abs(fine - expected) * [100.0, 1.0]) < left
        assert left < 1e-2

    @staticmethod
    def states(system, times, step):
        r = run(system, 25.0, times=times, step=step)
        return np.column_stack((r.angle, r.velocity))

    def test_static_peak_drive_speed_and_stick_band(self):
        system = wb.BrakedDriveline(
            driveline=wb.Driveline(damping=1.0, stiffness=1e4, inertia=1.0, drive_speed=0.05),
            brake=wb.BandBrake(wrap_angle=3.0, radius=0.2),
            friction=wb.SmoothedFriction(kinetic=0.3, static=0.4),
            actuation=wb.Actuation(initial_force=300.0, slope=-20.0),
            excitation=wb.HarmonicTorque(amplitude=150.0, frequency=10.0),
        )

        independent = solve_ivp(
            right_side(system), (0.0, 1.0), (0.0, 0.0), "LSODA", rtol=1e-10, atol=1e-12,
            max_step=1e-3, dense_output=True,
        )  # fmt: skip
        r = run(system, 1.0, step=5e-5)
        angle, velocity = independent.sol(r.time.values)
        np.testing.assert_allclose(r.angle, angle, rtol=0.0, atol=1e-6)
        np.testing.assert_allclose(r.velocity, velocity, rtol=0.0, atol=1e-4)
        assert r.sizes["stick"] > 5
        inner = slice(1, -1)
        for edge in (r.stick_start.values[inner], r.stick_end.values[inner]):
            # |R v| = 1/xi on the band's edge, to the linear interpolation between grid points.
            speed = 0.2 * (0.05 + independent.sol(edge)[1])
            np.testing.assert_allclose(abs(speed), 0.01, rtol=1e-2)
        assert np.all(r.stick_end - r.stick_start > 0.01 * 0.1)


class TestBandedCoulomb:
    @pytest.mark.usefixtures("scheme")
    def test_error_against_exact_falls_with_the_step(self):
        # The case of the paper's Fig. 5.
        system = wb.paper.system(eta=0.0, F0=0.09, alpha=1.21)
        times = np.linspace(0.0, 5.0, 5001)
        exact = wb.simulate(system, 5.0, times=times).velocity.values
        errors = []
        for step in (1e-3, 1e-4, 1e-5):
            r = run(system, 5.0, times=times, step=step)
            errors.append(math.sqrt(np.mean((r.velocity.values - exact) ** 2)))
        assert errors[1] < 0.2 * errors[0]
        assert errors[2] < 0.1 * errors[1]
        # Rest is any velocity in the band of 1e-4 rad/s.
        assert errors[2] < 5e-4

    def test_rest_holds_what_equilibrium_demands(self):
        system = wb.paper.system(eta=0.0, F0=2.0)  # torque below the holding torque
        r = run(system, 0.5)
        assert np.all(r.velocity == 0.0)
        assert np.all(r.angle == 0.0)
        np.testing.assert_allclose(r.brake_torque, r.drive_torque, rtol=0.0, atol=1e-12)
        assert r.stick_start.values.tolist() == [0.0]
        assert (int(r.stick_entry[0]), int(r.stick_exit[0])) == (0, 0)
        assert np.all(r.sticking == 1)

    def test_on_a_turning_shaft(self):
        # Once stuck to the brake, theta' = -Omega until k theta exceeds the holding torque.
        system = wb.paper.system(eta=0.0).replace(drive_speed=0.5, amplitude=0.0, damping=20.0)
        exact = wb.simulate(system, 0.5)
        # Root mean square: at the end of a slip the scheme creeps for a moment at the edge of
        # its band, where the largest difference does not fall in proportion to the step.
        errors = [
            float(np.sqrt(((run(system, 0.5, step=step).velocity - exact.velocity) ** 2).mean()))
            for step in (1e-3, 1e-4)
        ]
        assert errors[1] < 0.01 * errors[0]
        assert errors[1] < 5e-4  # a few widths of the band

    def test_static_friction_has_no_part(self):
        first, second = (run(wb.paper.system(static=mu), 0.5) for mu in (0.30, 0.33))
        np.testing.assert_array_equal(first.velocity, second.velocity)


class TestSelfLocking:
    """tan(alpha_w) < mu_k: no torque moves the wedge forwards."""

    system = wb.paper.system(eta=0.0, alpha=0.9, F0=0.09)

    def test_holds_any_torque_forwards(self):
        r = run(self.system, 0.04)  # T > 0 until 0.0499 s
        assert r.attrs["status"] == "completed"
        assert np.all(r.velocity == 0.0)
        np.testing.assert_allclose(r.brake_torque, r.drive_torque, rtol=1e-12)

    def test_forward_sliding_has_no_solution(self):
        r = run(self.system, 1.0, initial=(0.0, 1.0))
        assert r.attrs["status"] == "no_forward_solution"
        assert r.attrs["final_time"] == 0.0
        assert "exact" in r.attrs["message"]

    @pytest.mark.parametrize("friction", ["coulomb", "smoothed"])
    @pytest.mark.parametrize("alpha", [0.34, 0.9, 1.0])
    def test_never_nan(self, friction, alpha):
        r = run(wb.paper.system(eta=0.0, alpha=alpha, F0=0.09, friction=friction), 1.0)
        assert r.attrs["status"] in {"completed", "no_forward_solution"}
        for name in ("angle", "velocity", "poincare_angle", "stick_end", "event_angle"):
            assert np.all(np.isfinite(r[name])), name

    def test_a_released_wedge_slides_forwards(self):
        # Beyond the release speed nothing presses: the wall ends there.
        system = self.system.replace(slope=-30.0)  # released from 10 rad/s on
        r = run(system, 1e-3, initial=(0.0, 50.0))
        assert r.attrs["status"] == "completed"
        assert np.all(r.brake_torque == 0.0)


class TestDifferenceQuotient:
    """The rule of numjac (Salane 1986) for the share of its increments."""

    @pytest.mark.parametrize("factor", [kernel.SMALLEST_FACTOR, 1e-8, kernel.LARGEST_FACTOR])
    def test_share_finds_a_difference_that_can_be_told(self, factor):
        """Of f(x) = x the difference is the share itself."""
        for _ in range(20):
            factor = kernel._next_factor(factor, factor, 1.0, 1.0 + factor)
        assert kernel.SMALL_DIFFERENCE < factor <= kernel.LARGE_DIFFERENCE

    @pytest.mark.parametrize(
        ("difference", "end"), [(0.0, kernel.LARGEST_FACTOR), (0.5, kernel.SMALLEST_FACTOR)]
    )
    def test_share_is_bounded(self, difference, end):
        """However flat, or steep, the function stays."""
        factor = kernel.FIRST_FACTOR
        for _ in range(20):
            factor = kernel._next_factor(factor, difference, 1.0, 1.0 + difference)
        assert factor == end


class TestEndings:
    @pytest.mark.parametrize("friction", ["coulomb", "smoothed"])
    def test_divergence(self, friction):
        """At the time of the exact solver: both stop at 1e6 times the system's speed."""
        system = wb.paper.system(eta=-60.0, release=False, friction=friction)
        r = run(system, 25.0)
        assert r.attrs["status"] == "diverged"
        end = r.attrs["final_time"]
        assert 0.0 < end < 25.0
        assert r.time.values[-1] <= end
        for name in ("angle", "velocity", "brake_torque"):
            assert np.all(np.isfinite(r[name])), name
        if friction == "coulomb":
            # It grows as exp(55 t).
            exact = wb.simulate(system, 25.0)
            assert exact.attrs["status"] == "diverged"
            assert end == pytest.approx(exact.attrs["final_time"], abs=0.01)

    def test_step_limit(self):
        r = run(wb.paper.system(), 1.0, max_steps=10)
        assert r.attrs["status"] == "step_limit"
        assert r.attrs["final_time"] == pytest.approx(1e-3)
        assert r.time.values[-1] <= 1e-3
        assert r.attrs["work"] == 10

    def test_the_log_grows(self, monkeypatch):
        system = wb.paper.system(eta=-24.0)
        whole = run(system, 1.0)
        monkeypatch.setattr(fixed_step, "_FIRST_ROWS", 3)
        again = run(system, 1.0)
        np.testing.assert_array_equal(whole.event_time, again.event_time)
        np.testing.assert_array_equal(whole.velocity, again.velocity)


class TestBadInput:
    @pytest.mark.parametrize(
        ("changes", "given", "name"),
        [
            ({"friction": TABLE}, {}, "friction"),
            ({"initial_force": 300.0 + wb.Harmonic(9.0, 10.0)}, {}, "actuation.initial_force"),
            ({"lag": 0.1}, {}, "actuation.lag"),
            ({}, {"step": 0.0}, "step"),
            ({}, {"step": math.nan}, "step"),
            ({}, {"max_steps": 0}, "max_steps"),
            ({}, {"periods": 3}, None),
            ({}, {"samples": 9, "times": [0.0]}, "samples"),
            ({}, {"initial": 1.0}, "initial"),
        ],
    )
    def test_names_the_argument(self, changes, given, name):
        with pytest.raises(wb.InputError) as raised:
            run(wb.paper.system(eta=0.0).replace(**changes), 1.0, **given)
        assert name is None or raised.value.name == name

    def test_a_machine(self):
        with pytest.raises(wb.InputError) as raised:
            run(wb.paper.system().machine, 1.0)
        assert raised.value.name == "system"

    @pytest.mark.parametrize(
        "call",
        [
            lambda system, **given: wb.simulate(system, periods=2, **given),
            lambda system, **given: wb.simulate(system.machine, 1.0, **given),
            lambda system, **given: wb.sweep(system, eta=[0.0], **given),
            wb.motion,
            wb.orbit,
            wb.poincare,
            lambda _, **given: RunSettings(**given),
        ],
    )
    @pytest.mark.parametrize("amplitude", [300.0, 0.0])
    def test_other_functions_name_it(self, call, amplitude):
        """It is no method of theirs; the error says where it is."""
        with pytest.raises(wb.InputError, match=r"wb\.paper\.ode14x") as raised:
            call(wb.paper.system().replace(amplitude=amplitude), method="ode14x")
        assert raised.value.name in ("method", "run.method")
        assert raised.value.value == "ode14x"
        assert raised.value.allowed in (("exact", "smooth"), "'exact' or 'smooth'")


class TestMeasures:
    """Measures of a response by the scheme."""

    def test_error_of_the_energy_with_coulomb_friction(self):
        """Jumping over the band, the paper's step misses energy; a shorter one misses less."""
        system = wb.paper.system(eta=-24.0, F0=0.036)
        errors = [
            wb.energy(run(system, periods=8, step=step)).attrs["error"] for step in (1e-4, 1e-5)
        ]
        assert errors[0] < 1e-2
        assert errors[1] < 0.1 * errors[0]

    def test_check_refuses_it(self):
        """Its sticks are no rest."""
        with pytest.raises(wb.InputError) as raised:
            wb.check(run(wb.paper.system(), periods=1))
        assert raised.value.name == "response.method"
        assert raised.value.allowed == "'exact' or 'smooth'"
