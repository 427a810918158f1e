"""One-way clutches: momentum, ties, and the self-locking brake that they replace."""

import math

import numpy as np
import pytest

import wedgebrake as wb
from verified import error_of

J1, J2, AMPLITUDE, FREQUENCY = 1.0, 2.5, 5.0, 0.8


def freewheel(clutch=None, **more):
    clutch = wb.OneWayClutch("one", "two", name="clutch") if clutch is None else clutch
    given = {
        "inertias": [wb.Inertia("one", J1), wb.Inertia("two", J2)],
        "torques": [wb.Torque("one", wb.Harmonic(AMPLITUDE, FREQUENCY))],
        "contacts": [clutch],
    }
    return wb.Machine(**(given | more))


def speed_of(response, name):
    return response["velocity"].sel(inertia=name).to_numpy()


class TestFreewheel:
    @pytest.mark.parametrize("direction", [1, -1])
    def test_driven_by_a_sine(self, direction):
        machine = freewheel(wb.OneWayClutch("one", "two", name="clutch", direction=direction))
        response = wb.simulate(machine, 10.0)
        one, two = direction * speed_of(response, "one"), direction * speed_of(response, "two")
        assert np.all(np.diff(two) >= -1e-13)
        assert np.all(one - two <= 1e-13)
        # Engaged once for all: momentum A/w (1 - cos w t), so that two turns at its largest value.
        omega = 2.0 * math.pi * FREQUENCY
        if direction > 0:
            assert two[-1] == pytest.approx(2.0 * AMPLITUDE / omega / (J1 + J2), rel=1e-12)
        together = response["sticking"].sel(contact="clutch") == 1
        momentum = J1 * speed_of(response, "one") + J2 * speed_of(response, "two")
        time = response["time"].to_numpy()
        given = AMPLITUDE / omega * (1.0 - np.cos(omega * time))
        np.testing.assert_allclose(momentum, given, atol=1e-12)
        assert bool(together.any())
        torque = response["brake_torque"].sel(contact="clutch").to_numpy()
        assert np.all(direction * torque >= -1e-13)  # of the clutch against a
        last = time > 10.0 - 2.0 / FREQUENCY
        assert np.abs(torque[last]).max() <= 1e-12
        assert abs(float(wb.energy(response)["residual"])) < 1e-11

    def test_equals_a_brake_that_locks_itself(self):
        # tan(angle) < mu: it locks forwards; backwards its torque is R F mu/(tan(angle) + mu).
        drag = 0.2 * 10.0 * 0.3 / (math.tan(0.2) + 0.3)
        wedge = wb.Contact(
            "one", "two", name="clutch", brake=wb.WedgeBrake(angle=0.2, radius=0.2),
            friction=wb.CoulombFriction(kinetic=0.3), actuation=wb.Actuation(initial_force=10.0),
        )  # fmt: skip
        own = wb.OneWayClutch("one", "two", name="clutch", drag=drag)
        times = np.linspace(0.0, 8.0, 401)
        one, other = (wb.simulate(freewheel(c), 8.0, times=times) for c in (own, wedge))
        assert one.sizes["event"] == other.sizes["event"] > 5
        np.testing.assert_allclose(one["event_time"], other["event_time"], rtol=1e-12)
        np.testing.assert_allclose(one["velocity"], other["velocity"], atol=1e-12)

    def test_capacity_and_drag_are_the_torques_of_sliding(self):
        clutch = wb.OneWayClutch("one", "two", name="clutch", drag=0.4, capacity=1.5)
        response = wb.simulate(freewheel(clutch), 10.0)
        torque = response["brake_torque"].sel(contact="clutch").to_numpy()
        sliding = response["sliding_velocity"].sel(contact="clutch").to_numpy()
        assert np.all(torque[sliding > 1e-9] == 1.5)
        assert np.all(torque[sliding < -1e-9] == -0.4)
        assert np.any(sliding > 1e-3)
        assert np.any(sliding < -1e-3)
        assert torque.min() >= -0.4 - 1e-12
        assert torque.max() <= 1.5 + 1e-12
        assert abs(float(wb.energy(response)["residual"])) < 1e-11

    def test_slips_beyond_its_capacity(self):
        # 3 on the first, both at rest: 2 of it exceed 1.5 of the capacity.
        clutch = wb.OneWayClutch("one", "two", name="clutch", capacity=1.5)
        machine = freewheel(
            clutch, inertias=[wb.Inertia("one", 1.0), wb.Inertia("two", 2.0)],
            torques=[wb.Torque("one", 3.0)],
        )  # fmt: skip
        end = wb.simulate(machine, 2.0)["velocity"][-1]
        np.testing.assert_allclose(end, [3.0, 1.5], rtol=1e-13)
        end = wb.simulate(machine.replace({"clutch.capacity": 2.0}), 2.0)["velocity"][-1]
        np.testing.assert_allclose(end, [2.0, 2.0], rtol=1e-13)

    def test_backstop(self):
        # A hoist that must not fall back: the clutch joins the drum to the ground.
        stop = wb.OneWayClutch("one", "ground", name="stop", direction=-1)
        machine = freewheel(stop, inertias=[wb.Inertia("one", 1.0, 0.0, 2.0)],
                            torques=[wb.Torque("one", -4.0)])  # fmt: skip
        response = wb.simulate(machine, 3.0)
        assert float(response["event_time"][0]) == pytest.approx(0.5, abs=1e-14)
        assert speed_of(response, "one")[-1] == 0.0
        assert float(response["brake_torque"][-1, 0]) == pytest.approx(-4.0, abs=1e-13)

    def test_a_driven_body(self):
        clutch = wb.OneWayClutch("one", "drive", name="clutch", direction=-1, capacity=6.0)
        machine = freewheel(
            clutch, inertias=[wb.Inertia("one", 2.0), wb.Driven("drive", 3.0)],
            torques=[wb.Torque("one", wb.Table([0.0, 2.0, 2.0, 4.0], [0.0, 0.0, 1.0, 1.0]))],
        )  # fmt: skip
        response = wb.simulate(machine, 4.0, times=[0.5, 1.5, 4.0])
        np.testing.assert_allclose(speed_of(response, "one"), [1.5, 3.0, 4.0], rtol=1e-13)


class TestTies:
    def test_equal_speeds_and_no_torque(self):
        response = wb.simulate(freewheel(torques=[]), 5.0)
        assert response.sizes["event"] == 0
        assert np.all(response["velocity"] == 0.0)
        turning = freewheel(torques=[]).replace({"one.speed": 3.0, "two.speed": 3.0})
        assert np.all(wb.simulate(turning, 5.0)["velocity"] == 3.0)

    @pytest.mark.parametrize("torque", [-1.0, 1.0])
    def test_equal_speeds_at_the_start(self, torque):
        response = wb.simulate(freewheel(torques=[wb.Torque("one", torque)]), 1.0)
        expected = [torque / (J1 + J2)] * 2 if torque > 0 else [torque / J1, 0.0]
        np.testing.assert_allclose(response["velocity"][-1], expected, rtol=1e-13)

    def test_in_series(self):
        links = [wb.OneWayClutch("a", "b", name="first"), wb.OneWayClutch("b", "c", name="second")]
        machine = wb.Machine(
            inertias=[wb.Inertia(name, 1.0) for name in "abc"], contacts=links,
            torques=[wb.Torque("a", wb.Harmonic(6.0, 1.0))],
        )  # fmt: skip
        response = wb.simulate(machine, 3.0)
        speeds = [speed_of(response, name) for name in "abc"]
        assert np.all(speeds[0] <= speeds[1] + 1e-13)
        assert np.all(speeds[1] <= speeds[2] + 1e-13)
        # 6/w (1 - cos) for three units of inertia
        assert speeds[2][-1] == pytest.approx(2.0 * 6.0 / (2.0 * math.pi) / 3.0, rel=1e-12)

    @pytest.mark.parametrize("capacity", [math.inf, 10.0])
    def test_in_parallel_is_one(self, capacity):
        pair = [wb.OneWayClutch("one", "two", name=name, capacity=capacity) for name in ("c", "d")]
        times = np.linspace(0.0, 5.0, 101)
        one = wb.simulate(freewheel(contacts=pair), 5.0, times=times)
        other = wb.simulate(freewheel(), 5.0, times=times)
        np.testing.assert_allclose(one["velocity"], other["velocity"], atol=1e-12)
        np.testing.assert_allclose(
            one["brake_torque"].sum("contact"), other["brake_torque"].sum("contact"), atol=1e-12
        )
        np.testing.assert_allclose(one["brake_torque"][:, 0], one["brake_torque"][:, 1], atol=1e-12)

    def test_in_both_directions_is_rigid(self):
        pair = [
            wb.OneWayClutch("one", "two", name="c"),
            wb.OneWayClutch("one", "two", name="d", direction=-1),
        ]
        response = wb.simulate(freewheel(contacts=pair), 5.0)
        assert response.sizes["event"] == 0
        np.testing.assert_array_equal(speed_of(response, "one"), speed_of(response, "two"))

    @pytest.mark.parametrize("frequency", [0.1, 0.3, 0.5, 0.7, 1.0, 1.1, 1.9, 2.5])
    @pytest.mark.parametrize("direction", [1, -1])
    @pytest.mark.parametrize("joined", [False, True])
    def test_to_the_ground_where_no_torque_acts(self, frequency, direction, joined):
        """The torque that it would have to hold is zero, to the last bit, where it changes sign."""
        bodies = [wb.Inertia("a", 0.5), wb.Inertia("b", 0.5)] if joined else [wb.Inertia("a", 1.0)]
        machine = wb.Machine(
            inertias=bodies, torques=[wb.Torque("a", wb.Harmonic(2.0, frequency))],
            contacts=[wb.OneWayClutch("a", "ground", "clutch", direction)],
            joints=[wb.Rigid("b", "a")] if joined else [],
        )  # fmt: skip
        response = wb.simulate(machine, 20.0, samples=1001)
        assert response.attrs["status"] == "completed"
        omega, time = 2.0 * math.pi * frequency, response["time"].to_numpy()
        # From its first release on it slides in one direction, and stops once a period.
        begin = 0.0 if direction < 0 else 0.5 / frequency
        after = np.maximum(time - begin, 0.0)
        expected = -direction * 2.0 / omega * (1.0 - np.cos(omega * after))
        np.testing.assert_allclose(speed_of(response, "a"), expected, atol=1e-12)

    def test_faster_at_the_start(self):
        machine = freewheel().replace({"one.speed": 1.0})
        response = wb.simulate(machine, 1.0)
        assert response.attrs["status"] != "completed"
        assert "clutch" in response.attrs["message"]


class TestAnalyses:
    def test_sensitivity(self):
        clutch = wb.OneWayClutch("one", "two", name="clutch", drag=0.4, capacity=1.5)
        machine, times = freewheel(clutch), [0.7, 1.9, 3.0]
        for name in ("clutch.drag", "clutch.capacity"):
            found = wb.sensitivity(machine, [name], 3.0, times=times)["velocity"][0]
            value = machine.value(name)
            low, high = (
                wb.simulate(machine.replace({name: value + way * 1e-6}), 3.0, times=times)
                for way in (-1, 1)
            )
            expected = (high["velocity"] - low["velocity"]) / 2e-6
            assert float(abs(expected).max()) > 0.01
            np.testing.assert_allclose(found, expected, atol=1e-7)

    def test_restart(self):
        machine = freewheel()
        whole = wb.simulate(machine, 4.0, times=[3.0, 4.0])
        state = wb.final_state(wb.simulate(machine, 0.25))
        rest = wb.simulate(machine, 3.75, initial=state, times=[3.0, 4.0])
        np.testing.assert_allclose(rest["velocity"], whole["velocity"], atol=1e-12)

    def test_motion(self):
        clutch = wb.OneWayClutch("one", "two", name="clutch", drag=0.1)
        machine = freewheel(clutch, shafts=[wb.Shaft("two", "ground", 30.0, 0.5)])
        assert wb.motion(machine).order == 1
        assert "clutch" in {one.name for one in wb.motion(machine).contacts}


class TestModel:
    def test_study_file(self, tmp_path):
        links = [
            wb.OneWayClutch("one", "two", "c", -1, 0.1, 20.0),
            wb.OneWayClutch("two", "one", "d", capacity=math.inf),
        ]
        machine = freewheel(contacts=links)
        path = tmp_path / "study.toml"
        wb.save_study(wb.Study(machine), path)
        assert "[[one_way_clutch]]" in path.read_text()
        assert wb.load_study(path).system == machine
        assert machine.value("c.drag") == 0.1
        assert machine.value("d.capacity") == math.inf

    @pytest.mark.parametrize(
        ("changes", "name"),
        [({"direction": 0.5}, "c.direction"), ({"drag": -1.0}, "c.drag"),
         ({"capacity": math.nan}, "c.capacity"), ({"b": "one"}, "c.b")],
    )  # fmt: skip
    def test_refused(self, changes, name):
        with pytest.raises(wb.InputError) as error:
            wb.OneWayClutch(**({"a": "one", "b": "two", "name": "c"} | changes))
        assert error.value.name == name


@pytest.mark.parametrize(
    ("amplitude", "frequency"),
    [(5.0, 0.9), (5.3, 0.4), (5.3, 0.8), (5.3, 1.4), (5.4, 1.2), (5.8, 1.5), (6.1, 0.7)],
)
def test_opposite_clutches_take_turns(amplitude, frequency):
    """At each zero of the torque, the other one takes it over; one slips at 5.2 Nm."""
    body, torque = wb.Inertia("body", 2.8), wb.Torque("body", wb.Harmonic(amplitude, frequency))
    stops = [
        wb.OneWayClutch("body", "ground", "forwards", 1.0, capacity=5.4),
        wb.OneWayClutch("body", "ground", "backwards", -1.0, capacity=5.2),
    ]
    assert error_of(wb.Machine(inertias=[body], contacts=stops, torques=[torque]), 20.0) < 1e-9


def test_a_clutch_that_turns_too_fast_is_named_without_advice_on_brakes():
    faster = freewheel(inertias=[wb.Inertia("one", J1, speed=2.0), wb.Inertia("two", J2)])
    response = wb.simulate(faster, 1.0)
    assert response.attrs["status"] == "no_forward_solution"
    message = response.attrs["message"]
    assert "capacity" in message
    assert "wedge angle" not in message
