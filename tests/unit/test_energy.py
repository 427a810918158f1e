"""The energy balance, against closed forms and against a quadrature of its own."""

from __future__ import annotations

import json
import math
import random
from itertools import pairwise

import mpmath
import numpy as np
import pytest
import xarray as xr

import wedgebrake as wb
from wedgebrake.analysis.responses.energy import energy

# (eta, F0) of the paper's motions: sticking, released most of the time, other sticks, slope 0.
PAPER = [(-24.0, 0.036), (-60.0, 0.036), (-24.0, 0.067), (0.0, 0.09)]
BRAKES = ["wedge", "conventional"]
FORMS = ("torque_work", "drive_work", "viscous_loss", "friction_heat", "stored_change", "residual")


def custom(law="smoothed", **changes):
    """The paper's system with a smoothed law of the user's own."""
    system = wb.paper.system(friction=law, **changes)
    return system.replace(friction=wb.CustomFriction(law=own_law, width=0.01, kinetic=0.3))


def own_law(speed):
    return 0.3 * math.tanh(100.0 * speed)


class OwnWedge(wb.WedgeBrake):
    """A brake that no study file knows."""

    kind = ""


def random_case(seed):
    """A system and a state to begin with; logarithms of frequencies and damping are even."""
    chance = random.Random(seed)  # noqa: S311 - for tests

    def between(low, high):
        return low * (high / low) ** chance.random()

    inertia, natural, torque = between(0.1, 10.0), between(3.0, 300.0), between(1.0, 1000.0)
    impedance, mu, radius = inertia * natural, 0.05 + 0.5 * chance.random(), between(0.1, 1.0)
    tune = chance.choice([between(1 / 30, 0.2), between(0.2, 5.0), 1.0])
    damping = chance.choice([0.0, between(1e-4, 0.1), between(0.1, 3.0), 1.0, between(3.0, 1e3)])
    wedge = wb.WedgeBrake(radius=radius, angle=math.atan(mu * (1.1 + 3.0 * chance.random())))
    brake = chance.choice([wedge, wb.ConventionalBrake(radius=radius)])
    friction = wb.CoulombFriction(kinetic=mu, static=mu * (1.0 + 0.5 * chance.random()))
    if chance.random() < 0.3:
        speeds = (0.0, 0.1 * radius * torque / impedance, 0.5 * radius * torque / impedance)
        friction = wb.TabulatedFriction(speeds=speeds, coefficients=(mu, 0.8 * mu, 0.7 * mu))
    slope = chance.choice([0.0, 0.4 * chance.random() - 0.3]) * impedance / (mu * radius)
    drive = chance.choice([0.0, 2.0 * chance.random() - 1.0]) * torque / impedance
    system = wb.BrakedDriveline(
        driveline=wb.Driveline(
            inertia=inertia,
            damping=2.0 * damping * impedance,
            stiffness=inertia * natural**2,
            drive_speed=drive,
        ),
        brake=brake,
        friction=friction,
        actuation=wb.Actuation(
            initial_force=between(1e-3, 1.0) * torque / (mu * radius), slope=slope
        ),
        excitation=wb.HarmonicTorque(amplitude=torque, frequency=tune * natural / (2 * math.pi)),
    )
    angle, velocity = (2.0 * chance.random() - 1.0 for _ in range(2))
    return system, (angle * torque / (inertia * natural**2), velocity * torque / impedance)


def room_for_times(system, response):
    """What the rounding of the recorded times may cost: power for one unit of it in each state."""
    line = system.driveline
    speed, angle = np.abs(response.velocity), np.abs(response.angle)
    push = np.abs(response.drive_torque) + np.abs(response.brake_torque)
    power = float(np.max(speed * (push + line.damping * speed + line.stiffness * angle)))
    states = response.sizes["event"] / response.sizes["period"] + 2
    return power * np.spacing(response.attrs["final_time"]) * math.sqrt(states)


def integrals(system, response, number):
    """The integrals over a period by the roots of the equation, from its recorded events."""
    line, law = system.driveline, system.characteristic
    omega = mpmath.mpf(system.excitation.angular_frequency)
    base = number * (2.0 * math.pi / system.excitation.angular_frequency)
    begin, end = response.poincare_time.to_numpy()[number : number + 2]
    inner = (response.event_time > begin) & (response.event_time < end)
    names = ("time", "angle", "velocity")
    rows = [[float(response[f"poincare_{name}"][number + k]) for name in names] for k in (0, 1)]
    events = np.column_stack([response[f"event_{name}"][inner] for name in names])
    states = [rows[0], *events.tolist(), rows[1]]
    totals = dict.fromkeys(FORMS[:4], mpmath.mpf(0))
    with mpmath.workdps(40):
        for (t0, *state), (t1, *after) in pairwise(states):
            if t1 <= t0:
                continue
            middle, t0, length = 0.5 * (t0 + t1), mpmath.mpf(t0) - base, mpmath.mpf(t1) - t0
            stuck = np.any((response.stick_start <= middle) & (middle <= response.stick_end))
            mean = 0.25 * (state[1] + after[1]) + 0.5 * float((after[0] - state[0]) / length)
            piece = int(law.piece(mean + line.drive_speed))
            slope = 0.0 if stuck else float(law.slopes[piece])
            offset = 0.0 if stuck else float(law.offsets[piece])
            parts = _arc(system, omega, (t0, length, *state), (offset, slope), bool(stuck))
            for name, value in parts.items():
                totals[name] += value
    return {name: float(value) for name, value in totals.items()}


def _arc(system, omega, start, law, stuck):
    """The integrals over one arc; ``law``: offset and slope of the torque of the brake."""
    line, amplitude = system.driveline, mpmath.mpf(system.excitation.amplitude)
    inertia, damping, stiffness, drive = map(
        mpmath.mpf, (line.inertia, line.damping, line.stiffness, line.drive_speed)
    )
    t0, length, angle, velocity = map(mpmath.mpf, start)
    offset, slope = map(mpmath.mpf, law)
    if stuck:
        push = amplitude * (mpmath.cos(omega * t0) - mpmath.cos(omega * (t0 + length))) / omega
        held = push + damping * drive * length
        held -= stiffness * (angle * length - drive * length**2 / 2)
        work = (-drive * push, drive * held, damping * drive**2 * length, 0)
        return dict(zip(FORMS[:4], work, strict=True))
    total, i = damping + slope, mpmath.mpc(0, 1)
    split = mpmath.sqrt(mpmath.mpc(total**2 - 4 * inertia * stiffness))
    roots = [(-total + split) / (2 * inertia), (-total - split) / (2 * inertia)]
    phase = mpmath.exp(i * omega * t0) / (2 * i)
    turning = amplitude / (stiffness - inertia * omega**2 + i * omega * total) * phase
    free = angle + (offset + slope * drive) / stiffness - 2 * turning.real
    rate = velocity - 2 * (i * omega * turning).real
    first, last = roots
    # Amplitude and exponent of each part of the velocity, and of the torque.
    moving = [
        (i * omega * turning, i * omega),
        ((i * omega * turning).conjugate(), -i * omega),
        (first * (rate - last * free) / (first - last), first),
        (last * (first * free - rate) / (first - last), last),
    ]
    pushing = [(amplitude * phase, i * omega), ((amplitude * phase).conjugate(), -i * omega)]

    def integral(one, other):
        """Of the product of two sums of exponentials."""
        total = mpmath.mpc(0)
        for a, r in one:
            for b, s in other:
                z = r + s
                total += a * b * (length if z == 0 else mpmath.expm1(z * length) / z)
        return total.real

    gained, square = integral(moving, [(1, 0)]), integral(moving, moving)
    torque = (offset + slope * drive) * length + slope * gained
    heat = drive * torque + (offset + slope * drive) * gained + slope * square
    work = (integral(pushing, moving), drive * torque, damping * square, heat)
    return dict(zip(FORMS[:4], work, strict=True))


def tables_changed(response, table, **values):
    """The response with other parameters in its description of the system."""
    told = json.loads(response.attrs["system"])
    told[table].update(values)
    return response.assign_attrs(system=json.dumps(told))


class TestClosedForms:
    @pytest.mark.parametrize("slope", [0.0, 10.0])
    def test_steady_sliding_on_a_turning_shaft(self, slope):
        """Always forwards, so that the system is linear with the damping c + R mu slope."""
        system = wb.paper.system(brake="conventional", damping=0.5)
        system = system.replace(slope=slope, drive_speed=20.0)
        w, drive, damping = system.excitation.angular_frequency, 20.0, 0.5
        offset, gain = 0.2 * 0.3 * 300.0, 0.2 * 0.3 * slope
        angle = system.excitation.amplitude / (1e4 - w**2 + (damping + gain) * 1j * w)
        speed = w * abs(angle)
        assert speed < drive
        mean = -(offset + gain * drive) / 1e4
        initial = (mean + angle.imag, (1j * w * angle).imag)
        found = energy(wb.simulate(system, periods=5, initial=initial, samples_per_period=150))
        period = system.excitation.period
        heat = (offset * drive + gain * (drive**2 + 0.5 * speed**2)) * period
        np.testing.assert_allclose(found.friction_heat, heat, rtol=1e-10)
        np.testing.assert_allclose(found.friction_power, heat / period, rtol=1e-10)
        np.testing.assert_allclose(
            found.drive_work, drive * (offset + gain * drive) * period, rtol=1e-10
        )
        np.testing.assert_allclose(
            found.torque_work, 0.5 * (damping + gain) * speed**2 * period, rtol=1e-9
        )
        np.testing.assert_allclose(found.amplification, 0.3, rtol=1e-12)
        # The torque is largest at the crest of the velocity, between two samples.
        np.testing.assert_allclose(found.peak_torque, offset + gain * (drive + speed), rtol=1e-11)

    def test_free_slider_stops(self):
        """All of the kinetic energy turns into heat, at the constant torque R mu F_a0."""
        system = wb.paper.system(brake="conventional").replace(
            slope=0.0, damping=0.0, stiffness=0.0, amplitude=0.0
        )
        found = energy(wb.simulate(system, periods=5, initial=(0.0, 5.0)))
        deceleration = 18.0  # 0.2 m * 0.3 * 300 N on 1 kg m^2
        t = np.append(found.time, found.attrs["stop"])
        kinetic = 0.5 * np.maximum(5.0 - deceleration * t, 0.0) ** 2
        np.testing.assert_allclose(found.friction_heat, -np.diff(kinetic), rtol=1e-11, atol=1e-12)
        assert found.attrs["total_friction_heat"] == pytest.approx(12.5, rel=1e-12)
        assert found.attrs["total_stored_change"] == pytest.approx(-12.5, rel=1e-12)
        assert not np.any(found.torque_work)
        np.testing.assert_allclose(found.peak_torque, [18.0, 18.0, 18.0, 0.0, 0.0], rtol=1e-12)
        np.testing.assert_allclose(found.amplification, [0.3, 0.3, 0.3, np.nan, np.nan], rtol=1e-12)

    def test_rest(self):
        """Held at rest nothing is turned over, and the brake holds all of the torque."""
        system = wb.paper.system(F0=1.0)
        found = energy(wb.simulate(system, periods=3, samples_per_period=21))
        for name in (*FORMS, "friction_power"):
            assert not np.any(found[name])
        assert found.attrs["error"] == 0.0
        # Its crest lies between two samples.
        np.testing.assert_allclose(found.peak_torque, system.excitation.amplitude, rtol=1e-9)
        assert np.all(np.isnan(found.amplification))


class TestBalance:
    @pytest.mark.parametrize("samples", [12, 200])
    @pytest.mark.parametrize("brake", BRAKES)
    @pytest.mark.parametrize(("eta", "F0"), PAPER)
    def test_exact_at_any_sampling(self, eta, F0, brake, samples):
        system = wb.paper.system(eta=eta, F0=F0, brake=brake)
        found = energy(wb.simulate(system, periods=30, samples_per_period=samples))
        assert found.attrs["law"] == "system"
        assert found.attrs["error"] < 1e-12
        dissipated = found.attrs["total_friction_heat"] + found.attrs["total_viscous_loss"]
        assert abs(found.attrs["total_residual"]) < 1e-10 * dissipated
        assert found.attrs["total_friction_heat"] > 1.0

    def test_velocity_interpolated_past_self_locking(self):
        """The torque of a wedge that locks at low speed is infinite beyond it."""
        friction = wb.SmoothedFriction(kinetic=0.3)
        system = wb.paper.system().replace(friction=friction, angle=0.26122, damping=1.86)
        system = system.replace(slope=-2412.0, amplitude=765.0, frequency=3.314)
        response = wb.simulate(system, periods=1, initial=(-0.1, -10.0))
        assert energy(response).attrs["error"] < 1e-2

    @pytest.mark.parametrize("seed", range(1, 60, 2))
    def test_random_systems_to_rounding(self, seed):
        """Of any damping up to stiff, and any torque down to one thirtieth of the natural one."""
        system, initial = random_case(seed)
        response = wb.simulate(system, periods=8, initial=initial)
        assert response.attrs["status"] == "completed"
        found = energy(response)
        turned = sum(np.abs(found[name]) for name in FORMS[:5])
        missed = float(np.max(np.abs(found.residual)))
        assert missed <= 1e-12 * float(np.mean(turned)) + room_for_times(system, response)

    @pytest.mark.parametrize("seed", range(0, 60, 6))
    def test_each_integral_of_random_systems(self, seed):
        """Against products of exponentials integrated with 40 digits, from event to event."""
        system, initial = random_case(seed)
        response = wb.simulate(system, periods=3, initial=initial)
        found = energy(response)
        turned = 0.5 * float(sum(np.abs(found[name]) for name in FORMS[:5]).max())
        room = 1e-12 * turned + room_for_times(system, response)
        for number in (0, 2):
            for name, expected in integrals(system, response, number).items():
                assert abs(float(found[name][number]) - expected) <= room

    def test_steep_layer_is_resolved_by_sampling(self):
        system = wb.paper.system(eta=-60.0, friction="smoothed")
        errors = [
            energy(wb.simulate(system, periods=20, samples_per_period=n)).attrs["error"]
            for n in (50, 200, 800)
        ]
        assert errors[1] < 0.1 * errors[0]
        assert errors[2] < 0.1 * errors[1]


class TestEvidence:
    """The residual is found from nothing that it judges: wrong data show."""

    RESPONSE = wb.simulate(wb.paper.system(), periods=30)

    @pytest.mark.parametrize(
        ("table", "values"),
        [
            ("friction", {"kinetic": 0.29}),
            ("driveline", {"damping": 0.2}),
            ("driveline", {"stiffness": 1.01e4}),
            ("driveline", {"inertia": 1.01}),
            ("excitation", {"amplitude": 490.0}),
            ("actuation", {"slope": -39.0}),
            ("brake", {"radius": 0.201}),
        ],
    )
    def test_another_system(self, table, values):
        assert energy(self.RESPONSE).attrs["error"] < 1e-11
        assert energy(tables_changed(self.RESPONSE, table, **values)).attrs["error"] > 1e-4


class TestPeakTorque:
    def test_both_sides_of_a_jump_and_rest(self):
        """Slip begins forwards, every time, out of R F_a0 g(mu_s) held at rest."""
        static = 0.302
        system = wb.paper.system(eta=0.0, F0=0.09).replace(static=static)
        response = wb.simulate(system, periods=20, samples_per_period=21)
        slips = (response.event_kind == 3) & (response.event_side == 1)
        numbers = (response.event_time[slips] * system.excitation.frequency).astype(int)
        peaks = energy(response).peak_torque.to_numpy()[np.unique(numbers)]
        assert peaks.size >= 15
        held = 60.0 * static / (1.18 * 0.3 - static)
        np.testing.assert_allclose(peaks, held, rtol=1e-11)
        assert float(np.abs(response.brake_torque).max()) < held


class TestAmplification:
    def test_mean_over_both_directions(self):
        """g(mu) = 5.56 forwards, 0.459 backwards: the mean tells the share of the time."""
        system = wb.paper.system(eta=0.0, F0=0.09)
        response = wb.simulate(system, periods=100, samples_per_period=2000)
        found = energy(response, start=5.0)
        tangent, late = 1.18 * 0.3, response.time.to_numpy() >= found.attrs["start"]
        forward = np.count_nonzero((response.velocity.to_numpy() > 0.0) & late)
        backward = np.count_nonzero((response.velocity.to_numpy() < 0.0) & late)
        gains = 0.3 / (tangent - 0.3), 0.3 / (tangent + 0.3)
        expected = (forward * gains[0] + backward * gains[1]) / (forward + backward)
        assert found.attrs["mean_amplification"] == pytest.approx(expected, rel=1e-3)


class TestUnknownLaw:
    @pytest.mark.parametrize("brake", BRAKES)
    @pytest.mark.parametrize("solve", [wb.simulate, wb.paper.ode14x])
    def test_custom_friction(self, solve, brake):
        own = custom(brake=brake)
        known = wb.paper.system(brake=brake, friction="smoothed")
        found, expected = (energy(solve(system, periods=40)) for system in (own, known))
        assert (found.attrs["law"], expected.attrs["law"]) == ("samples", "system")
        for name, tolerance in (
            ("friction_heat", 1e-4),
            ("torque_work", 1e-4),
            ("peak_torque", 1e-3),
        ):
            np.testing.assert_allclose(found[name], expected[name], rtol=tolerance)
        np.testing.assert_allclose(found.amplification, expected.amplification, rtol=5e-3)
        assert found.attrs["error"] < 1e-5

    def test_custom_brake(self):
        system = wb.paper.system()
        own = system.replace(brake=OwnWedge(angle=system.brake.angle, radius=0.2))
        found, expected = (energy(wb.simulate(one, periods=40)) for one in (own, system))
        assert found.attrs["law"] == "samples"
        assert found.attrs["error"] < 1e-11
        for name in ("friction_heat", "torque_work", "peak_torque", "amplification"):
            np.testing.assert_allclose(found[name], expected[name], rtol=1e-9)


class TestWindow:
    def test_start(self):
        response = wb.simulate(wb.paper.system(), periods=50)
        whole, late = energy(response), energy(response, start=3.0)
        first = int(late.period[0])
        assert first == math.ceil(3.0 * 10.026761414789407)
        assert late.attrs["start"] == pytest.approx(first / 10.026761414789407)
        assert late.sizes["period"] == 50 - first
        for name in whole.data_vars:
            np.testing.assert_allclose(late[name], whole[name][first:], rtol=1e-12, atol=1e-15)
        assert energy(response, start=float(whole.time[7])).period[0] == 7

    def test_sampling_that_ignores_the_periods(self):
        system = wb.paper.system(eta=0.0, F0=0.09)
        regular = energy(wb.simulate(system, periods=30))
        times = np.linspace(0.013, 2.9, 5003)
        other = energy(wb.simulate(system, periods=30, times=times))
        numbers = other.period.to_numpy()
        assert numbers.tolist() == list(range(1, 29))
        for name in ("friction_heat", "torque_work", "peak_torque"):
            np.testing.assert_allclose(other[name], regular[name][numbers], rtol=1e-10)

    def test_run_that_ended_early(self):
        system = wb.paper.system(damping=1.0, static=0.33, release=False)
        response = wb.simulate(system, periods=20)
        assert response.attrs["status"] == "diverged"
        found = energy(response)
        assert found.sizes["period"] == 1
        assert found.attrs["status"] == "diverged"
        assert np.all(np.isfinite(found.friction_heat))

    def test_survives_a_netcdf_file(self, tmp_path):
        pytest.importorskip("h5netcdf")
        response = wb.simulate(wb.paper.system(), periods=10)
        response.to_netcdf(tmp_path / "run.nc", engine="h5netcdf")
        with xr.open_dataset(tmp_path / "run.nc", engine="h5netcdf") as read:
            found = energy(read)
        xr.testing.assert_identical(found, energy(response))
        found.to_netcdf(tmp_path / "energy.nc", engine="h5netcdf")

    def test_long_responses_are_integrated_in_blocks(self, monkeypatch):
        response = wb.simulate(wb.paper.system(), periods=20)
        whole = energy(response)
        monkeypatch.setattr("wedgebrake.analysis.responses.energy._BLOCK", 777)
        xr.testing.assert_identical(energy(response), whole)


class TestArguments:
    def test_less_than_a_period(self):
        with pytest.raises(wb.InputError, match=r"^response"):
            energy(wb.simulate(wb.paper.system(), duration=0.05))
        response = wb.simulate(wb.paper.system(), periods=3)
        with pytest.raises(wb.InputError, match=r"^response"):
            energy(response, start=0.25)
        nothing = wb.simulate(wb.paper.system(), periods=3, times=[])
        with pytest.raises(wb.InputError, match=r"^response"):
            energy(nothing)

    @pytest.mark.parametrize("samples", [5, 9])
    def test_too_few_samples(self, samples):
        response = wb.simulate(wb.paper.system(F0=1.0), periods=3, samples_per_period=samples)
        with pytest.raises(wb.InputError, match=r"^response"):
            energy(response)

    def test_gap_in_the_samples(self):
        times = np.append(np.linspace(0.0, 0.5, 1000), np.linspace(1.0, 1.9, 1000))
        response = wb.simulate(wb.paper.system(F0=1.0), periods=20, times=times)
        with pytest.raises(wb.InputError, match=r"^response"):
            energy(response)
        assert energy(response, start=1.0).attrs["error"] == 0.0

    def test_a_start_beyond_the_end(self):
        """What is no time at all: test_bad_input."""
        with pytest.raises(wb.InputError) as caught:
            energy(wb.simulate(wb.paper.system(), periods=3), 99.0)
        assert caught.value.name == "start"

    @pytest.mark.parametrize("wrong", [None, 1.0, xr.Dataset(), xr.Dataset(attrs={"system": "{}"})])
    def test_no_response(self, wrong):
        with pytest.raises(wb.InputError, match=r"^response"):
            energy(wrong)


@pytest.mark.parametrize(("angle", "notable"), [(0.0, False), (1000.0, True)])
def test_the_rounding_of_the_angles_of_a_stiff_shaft_is_told(angle, notable):
    """An angle of 1000 rad is rounded to 1e-13 rad: 0.1 N m at 1e12 N m/rad."""
    names = ("one", "two")
    machine = wb.Machine(
        inertias=[wb.Inertia(name, 1.0, angle=angle, speed=100.0) for name in names],
        shafts=[wb.Shaft(*names, stiffness=1e12)],
        contacts=[
            wb.Contact(
                "two", name="brake", brake=wb.ConventionalBrake(radius=0.1),
                friction=wb.CoulombFriction(kinetic=0.3),
                actuation=wb.Actuation(initial_force=300.0),
            )
        ],
    )  # fmt: skip
    found = energy(wb.simulate(machine, 0.05))
    assert abs(float(found.residual)) <= 10.0 * float(found.rounding)
    assert ("one-two" in found.attrs["note"]) == notable
