"""Normal forces that depend on angles and speeds: mode coupling, release, holding limits."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import wedgebrake as wb

RADIUS, FORCE = 0.5, 40.0


def coupled(mu, normal=None, speed=10.0, force=FORCE, **more):
    """Hoffmann's minimal model: M = I, K = [[2, 1 - R mu n], [1, 2]] with R n = 4/3."""
    normal = {"pad.angle": 4.0 / 3.0 / RADIUS} if normal is None else normal
    contact = wb.Contact(
        "slider", name="brake", brake=wb.ConventionalBrake(radius=RADIUS),
        friction=wb.CoulombFriction(kinetic=mu), base_speed=speed,
        actuation=wb.Actuation(initial_force=force), normal=normal,
    )  # fmt: skip
    given = {
        "inertias": [wb.Inertia("slider", 1.0), wb.Inertia("pad", 1.0)],
        "shafts": [
            wb.Shaft("slider", "ground", 1.0), wb.Shaft("pad", "ground", 1.0),
            wb.Shaft("slider", "pad", 1.0, ratio=-1.0),
        ],
        "contacts": [contact],
    }  # fmt: skip
    return wb.Machine(**(given | more))


class TestModeCoupling:
    def test_growth_beyond_flutter(self):
        found = wb.stability(coupled(0.8))
        expected = [s * 0.09109828 + t * 1.41714463j for s in (1, -1) for t in (1, -1)]
        values = np.array(found.critical.eigenvalues)
        for one in expected:
            assert np.abs(values - one).min() < 1e-8
        assert not found.stable

    def test_flutter_begins_where_the_frequencies_meet(self):
        # At a double eigenvalue, rounding r of the matrix is one of its square root.
        limit = wb.hopf(coupled(0.7), "brake.kinetic", between=(0.6, 0.9))
        assert limit.kind == "hopf"
        assert limit.value == pytest.approx(0.75, abs=1e-9)
        assert limit.frequency * 2.0 * math.pi == pytest.approx(math.sqrt(2.0), rel=1e-6)

    @pytest.mark.parametrize("mu", [0.1, 0.6, 0.74, 0.76, 1.2])
    def test_characteristic_polynomial(self, mu):
        # (s^2 + 2)^2 = 1 - 4 mu/3
        squares = -2.0 + np.array([1.0, -1.0]) * np.emath.sqrt(1.0 - 4.0 * mu / 3.0)
        roots = np.emath.sqrt(squares)
        values = np.array(wb.stability(coupled(mu)).critical.eigenvalues)
        for one in (*roots, *-roots):
            assert np.abs(values - one).min() < 1e-12

    def test_a_lag_of_the_actuation_adds_its_own_eigenvalue(self):
        machine = coupled(0.8).replace(
            {"brake.actuation": wb.Actuation(initial_force=FORCE, lag=0.25)}
        )
        second = wb.Contact(
            "pad", name="second", brake=wb.ConventionalBrake(radius=RADIUS), base_speed=5.0,
            friction=wb.CoulombFriction(kinetic=0.2), actuation=wb.Actuation(initial_force=FORCE),
            normal={"slider.angle": 0.5},
        )  # fmt: skip
        both = machine.replace(contacts=[*machine.contacts, second])
        matrix = np.array([[2.0, 1.0 - 16.0 / 15.0], [1.0 - RADIUS * 0.2 * 0.5, 2.0]])
        roots = np.emath.sqrt(-np.linalg.eigvals(matrix))
        values = np.array(wb.stability(both).critical.eigenvalues)
        for one in (*roots, *-roots, -4.0):
            assert np.abs(values - one).min() < 1e-12

    def test_the_other_direction_does_not_flutter(self):
        # K = [[2, 1 + 4 mu/3], [1, 2]]
        values = np.array(wb.stability(coupled(0.8, speed=-10.0)).critical.eigenvalues)
        assert np.abs(values.real).max() < 1e-12

    def test_a_speed_damps(self):
        # F has -n w of the slider: torque R mu n w against its motion, as the base is faster.
        values = np.array(wb.stability(coupled(0.3, {"slider.speed": -2.0})).critical.eigenvalues)
        c = RADIUS * 0.3 * 2.0
        matrix = np.array([[0, 0, 1, 0], [0, 0, 0, 1], [-2, -1, -c, 0], [-1, -2, 0, 0]])
        for one in np.linalg.eigvals(matrix):
            assert np.abs(values - one).min() < 1e-12

    def test_a_force_of_the_state_alone(self):
        # At the preload q of the pad, F = n q presses the contact without its actuation.
        machine = coupled(0.8, force=0.0, torques=[wb.Torque("pad", 10.0)])
        assert wb.stability(machine).critical.growth_rate == pytest.approx(0.09109828, abs=1e-8)
        away = machine.replace({"pad-torque": wb.Torque("pad", -10.0)})
        assert abs(wb.stability(away).critical.growth_rate) < 1e-12

    def test_growth_of_the_simulated_motion(self):
        machine = coupled(0.8, inertias=[wb.Inertia("slider", 1.0), wb.Inertia("pad", 1.0, 1e-3)])
        k = np.array([[2.0, 1.0 - 16.0 / 15.0], [1.0, 2.0]])
        load = np.array([RADIUS * 0.8 * FORCE, 0.0])
        even = np.linalg.solve(k, load)
        start = machine.replace({"slider.angle": even[0], "pad.angle": even[1] + 1e-3})
        times = np.linspace(0.0, 30.0, 61)
        response = wb.simulate(start, 30.0, times=times)
        values, shapes = np.linalg.eig(np.block([[np.zeros((2, 2)), np.eye(2)],
                                                 [-k, np.zeros((2, 2))]]))  # fmt: skip
        parts = np.linalg.solve(shapes, np.array([0.0, 1e-3, 0.0, 0.0]))
        moves = np.real(np.exp(np.outer(times, values)) * parts @ shapes.T)[:, :2]
        assert np.abs(moves).max() > 5e-3
        np.testing.assert_allclose(response["angle"], even + moves, atol=1e-11)


class TestExact:
    def test_nothing_changes_no_bit(self):
        machine = coupled(0.5, normal={}, speed=0.5)
        plain = machine.contacts[0]
        other = wb.Contact(
            plain.a, name=plain.name, brake=plain.brake, friction=plain.friction,
            actuation=plain.actuation, base_speed=plain.base_speed,
        )  # fmt: skip
        assert other == plain
        one, two = (wb.simulate(m, 10.0) for m in (machine, machine.replace(contacts=[other])))
        zero = wb.simulate(machine.replace(contacts=[plain.model_copy(
            update={"normal": type(plain.normal)({"pad.angle": 0.0})})]), 10.0)  # fmt: skip
        for name in ("angle", "velocity", "brake_torque", "event_time"):
            np.testing.assert_array_equal(one[name], two[name])
            np.testing.assert_array_equal(one[name], zero[name])

    def test_against_an_integrator_with_release(self):
        # The pad swings so far that the contact opens: F = max(F0 + n q + m w, 0).
        normal = {"pad.angle": 3.0, "pad.speed": 0.4}
        machine = coupled(
            0.5,
            normal,
            force=2.0,
            inertias=[wb.Inertia("slider", 1.0), wb.Inertia("pad", 1.0, 2.0)],
        )
        times = np.linspace(0.0, 12.0, 121)
        response = wb.simulate(machine, 12.0, times=times)

        def rates(_, x):
            force = max(2.0 + 3.0 * x[1] + 0.4 * x[3], 0.0)
            friction = RADIUS * 0.5 * force  # towards the faster base
            return [x[2], x[3], friction - 2.0 * x[0] - x[1], -x[0] - 2.0 * x[1]]

        expected = solve_ivp(
            rates, (0.0, 12.0), [0.0, 2.0, 0.0, 0.0], t_eval=times, rtol=1e-11, atol=1e-12,
            max_step=0.01,
        )  # fmt: skip
        force = response["actuation_force"][:, 0]
        assert np.any(force == 0.0)
        assert np.any(force > 2.0)
        assert float(np.abs(response["sliding_velocity"]).min()) > 1.0
        np.testing.assert_allclose(response["angle"].to_numpy().T, expected.y[:2], atol=1e-7)
        wanted = np.maximum(2.0 + 3.0 * expected.y[1] + 0.4 * expected.y[3], 0.0)
        np.testing.assert_allclose(force, wanted, atol=1e-6)
        assert abs(float(wb.energy(response)["residual"])) < 1e-10

    def test_holding_limit_that_moves(self):
        # The pad turns away at 1 rad/s: F = 10 - 4 t holds the torque 1 until t = 2 (R mu F = 1).
        contact = wb.Contact(
            "slider", name="brake", brake=wb.ConventionalBrake(radius=RADIUS),
            friction=wb.CoulombFriction(kinetic=1.0), actuation=wb.Actuation(initial_force=10.0),
            normal={"pad.angle": -4.0},
        )  # fmt: skip
        machine = wb.Machine(
            inertias=[wb.Inertia("slider", 1.0), wb.Inertia("pad", 1.0, 0.0, 1.0)],
            contacts=[contact], torques=[wb.Torque("slider", 1.0)],
        )  # fmt: skip
        response = wb.simulate(machine, 4.0, times=[1.0, 2.5, 4.0])
        assert float(response["event_time"][0]) == pytest.approx(2.0, abs=1e-13)
        # w' = 1 - (10 - 4 t)/2 = 2 t - 4 until t = 2.5, then 1.
        np.testing.assert_allclose(
            response["velocity"].sel(inertia="slider"), [0.0, 0.25, 1.75], atol=1e-12
        )

    def test_lag(self):
        contact = coupled(0.5).contacts[0]
        lagging = wb.Actuation(initial_force=wb.Harmonic(10.0, 0.3), lag=0.2)
        machine = coupled(0.5, torques=[wb.Torque("pad", wb.Harmonic(3.0, 0.2))])
        machine = machine.replace({"brake.actuation": lagging})
        response = wb.simulate(machine, 8.0)
        free = machine.replace(contacts=[contact.model_copy(
            update={"actuation": lagging, "normal": type(contact.normal)()})])  # fmt: skip
        alone = wb.simulate(free, 8.0)["actuation_force"][:, 0].to_numpy()
        pad = response["angle"].sel(inertia="pad").to_numpy()
        wanted = np.maximum(alone + 4.0 / 3.0 / RADIUS * pad, 0.0)
        unlimited = alone > 0.0
        np.testing.assert_allclose(response["actuation_force"][:, 0].to_numpy()[unlimited],
                                   wanted[unlimited], atol=1e-11)  # fmt: skip
        assert abs(float(wb.energy(response)["residual"])) < 1e-10


class TestAnalyses:
    def test_sensitivity_restart_and_motion(self):
        machine = coupled(0.8, speed=1.0, force=3.0)
        times = [2.0, 5.0, 9.0]
        for name in ("brake.normal.pad.angle", "brake.kinetic"):
            found = wb.sensitivity(machine, [name], 9.0, times=times)["angle"][0]
            value = machine.value(name)
            low, high = (
                wb.simulate(machine.replace({name: value + way * 1e-6}), 9.0, times=times)
                for way in (-1, 1)
            )
            expected = (high["angle"] - low["angle"]) / 2e-6
            np.testing.assert_allclose(found, expected, atol=1e-5 * float(abs(expected).max()))
        whole = wb.simulate(machine, 9.0, times=times)
        state = wb.final_state(wb.simulate(machine, 4.0))
        rest = wb.simulate(machine, 5.0, initial=state, times=times[1:])
        np.testing.assert_allclose(rest["angle"], whole["angle"][1:], atol=1e-10)
        assert wb.motion(machine).kind

    def test_sweep(self):
        machine = coupled(0.8, speed=1.0, force=3.0)
        found = wb.sweep(machine, over={"brake.normal.pad.angle": [0.0, 8.0 / 3.0]})
        assert found.sizes["brake.normal.pad.angle"] == 2

    def test_refused(self):
        turning = coupled(0.5, shafts=[wb.Shaft("slider", "ground", 1.0)])
        with pytest.raises(wb.InputError, match=r"^brake\.normal"):
            wb.stability(turning)
        with pytest.raises(wb.InputError, match=r"^brake\.normal"):
            wb.steady_sliding(coupled(0.5))
        sampled = wb.Actuation(initial_force=1.0, sample_time=0.1)
        limited = wb.Actuation(initial_force=1.0, limits=(0.0, 2.0))
        table = wb.TabulatedFriction(speeds=(0.0, 1.0), coefficients=(0.4, 0.3))
        for given in ({"actuation": sampled}, {"actuation": limited}, {"friction": table}):
            with pytest.raises(wb.InputError, match=r"^brake\.normal"):
                coupled(0.5).replace({f"brake.{name}": one for name, one in given.items()})
        for name in ("wheel.angle", "pad.torque"):
            with pytest.raises(wb.InputError):
                coupled(0.5, {name: 1.0})


def test_study_file(tmp_path):
    machine = coupled(0.5, {"pad.angle": 2.0, "slider.speed": -0.5})
    path = tmp_path / "study.toml"
    wb.save_study(wb.Study(machine), path)
    assert wb.load_study(path).system == machine
    nested = (
        path.read_text()
        .replace('"pad.angle"', "pad.angle")
        .replace('"slider.speed"', "slider.speed")
    )
    path.write_text(nested)
    assert wb.load_study(path).system == machine
    assert machine.replace({"brake.normal.pad.angle": 3.0}).value("brake.normal.pad.angle") == 3.0
    assert hash(machine.contacts[0].normal) == hash(
        coupled(0.5, {"slider.speed": -0.5, "pad.angle": 2.0}).contacts[0].normal
    )
    assert math.isclose(machine.value("brake.normal.slider.speed"), -0.5)
