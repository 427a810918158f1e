"""Derivatives of heat, peaks and root mean squares of runs and of periodic orbits."""

import math
from collections.abc import Callable, Mapping

import numpy as np
import pytest
from test_sensitivity import MACHINES, TWO_BRAKES, one

import wedgebrake as wb
from machines import pressed, single

# Weights of a difference of sixth order, whose error is a share h^6 of the value.
_WEIGHTS = {1: 0.75, -1: -0.75, 2: -0.15, -2: 0.15, 3: 1.0 / 60.0, -3: -1.0 / 60.0}
OF = (
    "friction_heat", "friction_power", "base_work", "viscous_loss", "torque_work", "peak_torque",
    "rms_torque", "lowest_velocity", "highest_velocity", "velocity_amplitude", "rms_velocity",
    "angle_amplitude", "peak_acceleration", "rms_acceleration",
)  # fmt: skip
_PAIR = ("period", "angle", "velocity")
Values = Mapping[str, np.ndarray]


def difference(values: Callable[[float], Values], at: float, step: float) -> Values:
    """Derivatives of numbers that depend on a parameter."""
    found: dict[str, np.ndarray] = {}
    for place, weight in _WEIGHTS.items():
        for name, value in values(at + place * step).items():
            found[name] = found.get(name, 0.0) + weight / step * np.asarray(value)
    return found


def assert_agrees(
    found: object, name: str, values: Callable[[float], Values], at: float, steps: tuple[float, ...]
) -> None:
    """Compare derivatives with differences over steps, of which one must agree.

    An event may be lost within a long step, and rounding limits short ones.
    """
    size = abs(at) or 1.0
    errors: dict[str, np.ndarray] = {}
    for step in steps:
        apart = {}
        for measure, by in difference(values, at, step * size).items():
            own = found[measure].sel(parameter=name).to_numpy()
            value = np.abs(found[f"{measure}_value"].to_numpy())
            scale = np.maximum(np.abs(own), value / size)
            error = np.abs(own - by)
            errors[measure] = np.minimum(errors.get(measure, error), error)
            if not np.all(errors[measure] <= 1e-8 * scale + 1e-11):
                apart[measure] = own, errors[measure]
        if not apart:
            return
    raise AssertionError((name, apart))


RUNS = {
    "clutch": ["brake.kinetic", "shaft.ratio", "clutch.static", "engine.frequency"],
    "sampled, lag, limits": ["brake.slope", "disc.inertia"],
    "signals": ["brake.initial_force.begin", "brake.base_speed.signals.0.amplitude"],
    "table": ["brake.scale", "shaft.damping"],
    "Stribeck": ["brake.speed", "brake.lag"],
    "smoothed": ["brake.decay", "shaft.stiffness"],
    "band": ["brake.wrap_angle", "brake.base_speed"],
}


@pytest.mark.parametrize("kind", RUNS)
def test_of_a_run_against_differences(kind: str) -> None:
    machine, names = MACHINES[kind], RUNS[kind]
    found = wb.sensitivity(machine, names, 0.5, of=OF)
    assert found.attrs["status"] == "completed"
    for name in names:

        def values(value: float, name: str = name) -> Values:
            near = wb.sensitivity(machine.replace({name: value}), names[:1], 0.5, of=OF)
            return {measure: near[f"{measure}_value"].to_numpy() for measure in OF}

        assert_agrees(found, name, values, machine.value(name), (1e-4, 2e-5))


def wedge() -> wb.Machine:
    """Two brakes whose shares bend during a stick, since one holds more in one direction."""
    return wb.Machine(
        inertias=[wb.Inertia("disc", 1.0, speed=1.0)],
        shafts=[wb.Shaft("disc", "ground", name="shaft", stiffness=1e3, damping=1.0)],
        contacts=[
            wb.Contact(
                "disc", name=name, brake=brake, friction=wb.CoulombFriction(kinetic=0.4),
                actuation=wb.Actuation(initial_force=100.0),
            )
            for name, brake in (
                ("front", wb.WedgeBrake(radius=0.2, angle=0.8)),
                ("rear", wb.ConventionalBrake(radius=0.2)),
            )
        ],
        torques=[wb.Torque("disc", wb.Harmonic(25.0, 2.0), name="engine")],
    )  # fmt: skip


@pytest.mark.parametrize(
    ("machine", "names"),
    [(TWO_BRAKES, ["rear.kinetic", "front.initial_force"]),
     (wedge(), ["front.kinetic", "rear.initial_force", "engine.amplitude"])],
)  # fmt: skip
def test_torques_that_contacts_at_rest_share(machine: wb.Machine, names: list[str]) -> None:
    """They are those of a response, which differ from the shares of the solver."""
    of = ["peak_torque", "rms_torque"]
    found = wb.sensitivity(machine, names, 1.0, of=of)
    response = wb.simulate(machine, 1.0, samples=200_001)
    assert (response["sticking"].to_numpy() == 1).all(axis=1).any()
    torque = response["brake_torque"].to_numpy()
    np.testing.assert_allclose(found["peak_torque_value"], np.abs(torque).max(axis=0), rtol=1e-6)
    np.testing.assert_allclose(found["rms_torque_value"], torque.std(axis=0), rtol=1e-4)
    for name in names:

        def values(value: float, name: str = name) -> Values:
            near = wb.sensitivity(machine.replace({name: value}), names[:1], 1.0, of=of)
            return {measure: near[f"{measure}_value"].to_numpy() for measure in of}

        assert_agrees(found, name, values, machine.value(name), (1e-4, 2e-5))


@pytest.mark.parametrize("kind", ["clutch", "signals", "Stribeck"])
def test_measures_of_a_run_are_those_of_its_energy_and_samples(kind: str) -> None:
    machine = MACHINES[kind]
    found = wb.sensitivity(machine, ["brake.slope"], 1.0, of=OF)
    response = wb.simulate(machine, 1.0, samples=200_001)
    energy = wb.energy(response)
    for name in ("friction_heat", "base_work", "viscous_loss", "torque_work"):
        np.testing.assert_allclose(found[f"{name}_value"], energy[name], rtol=1e-11, atol=1e-11)
    velocity, angle = response["velocity"].to_numpy(), response["angle"].to_numpy()
    torque = response["brake_torque"].to_numpy()
    for name, expected in {
        "highest_velocity": velocity.max(axis=0),
        "lowest_velocity": velocity.min(axis=0),
        "velocity_amplitude": 0.5 * np.ptp(velocity, axis=0),
        "angle_amplitude": 0.5 * np.ptp(angle, axis=0),
        "rms_velocity": velocity.std(axis=0),
        "rms_torque": torque.std(axis=0),
    }.items():
        np.testing.assert_allclose(found[f"{name}_value"], expected, rtol=1e-4)
    # A curve is steepest at rest: samples miss its peak by more.
    peak, sampled = found["peak_torque_value"].to_numpy(), np.abs(torque).max(axis=0)
    assert np.all(peak >= sampled * (1.0 - 1e-12))
    assert np.all(peak <= sampled * (1.0 + 1e-3))


def test_of_a_driveline_has_no_dimensions_of_parts() -> None:
    system = wb.paper.system(eta=-24.0, F0=0.067)
    found = wb.sensitivity(system, ["slope", "eta"], periods=5, of=["friction_heat"])
    assert found["friction_heat"].dims == ("parameter",)
    heat = wb.energy(wb.simulate(system, periods=5)).attrs["total_friction_heat"]
    assert float(found["friction_heat_value"]) == pytest.approx(heat, rel=1e-11)


def test_a_braked_disc_turns_its_energy_into_heat() -> None:
    # Torque M = mu F R, speed w: it stops at J w / M, and the peak and the heat are M and J w^2/2.
    brake = wb.Contact(
        "disc", name="brake", brake=wb.ConventionalBrake(radius=0.5),
        friction=wb.CoulombFriction(kinetic=0.5), actuation=wb.Actuation(initial_force=8.0),
    )  # fmt: skip
    machine = wb.Machine(inertias=[wb.Inertia("disc", 2.0, speed=4.0)], contacts=[brake])
    names = ["disc.speed", "disc.inertia", "brake.kinetic", "brake.radius"]
    of = ["friction_heat", "angle_amplitude", "peak_torque", "peak_acceleration", "rms_velocity"]
    found = wb.sensitivity(machine, names, 8.0, of=of)
    torque = found["peak_torque_value"].item()
    assert torque == pytest.approx(0.5 * 8.0 * 0.5, rel=1e-14)
    stop = 2.0 * 4.0 / torque
    np.testing.assert_allclose(found["friction_heat"][:, 0], [8.0, 8.0, 0.0, 0.0], atol=1e-11)
    np.testing.assert_allclose(
        found["angle_amplitude"][:, 0],
        [0.5 * stop, 0.5 * stop, -4.0 * stop * 0.5 , -4.0 * stop * 0.5], atol=1e-11,
    )  # fmt: skip
    np.testing.assert_allclose(
        found["peak_torque"][:, 0], [0.0, 0.0, 2.0 * torque, 2.0 * torque], atol=1e-11
    )
    # The mean of w^2 (1 - t/stop)^2 less the squared mean, over 8 s.
    variance = 16.0 * stop / 3.0 / 8.0 - (2.0 * stop / 8.0) ** 2
    by_stop = (16.0 / 24.0 - 2.0 * 4.0 * stop / 64.0) / (2.0 * math.sqrt(variance))
    assert float(found["rms_velocity_value"][0]) == pytest.approx(math.sqrt(variance), rel=1e-12)
    np.testing.assert_allclose(found["rms_velocity"][1:, 0], by_stop * stop * np.array(
        [0.5, -2.0, -2.0]), rtol=1e-11)  # fmt: skip


def test_equal_peaks_that_change_differently_have_no_derivative() -> None:
    # A constant torque in all slips: with a slope its peak is at the lowest or the highest speed.
    machine = MACHINES["leading shoe"]
    found = wb.sensitivity(machine, ["brake.slope", "brake.kinetic"], 1.0, of=["peak_torque"])
    assert np.isnan(found["peak_torque"].to_numpy()[0])
    assert found["peak_torque"].to_numpy()[1] > 0.0
    assert "peak_torque" in found.attrs["message"]
    still = wb.Machine(inertias=[wb.Inertia("disc", 1.0, speed=2.0)])
    rest = wb.sensitivity(still, ["disc.speed"], 1.0, of=["rms_velocity", "highest_velocity"])
    assert np.isnan(rest["rms_velocity"].item())
    assert rest["highest_velocity"].item() == pytest.approx(1.0, abs=1e-12)


def test_a_machine_without_contacts_has_derivatives() -> None:
    # x = exp(-d t) cos(w t) with w^2 = k/J - d^2, d = c/(2 J), from the angle 1 and speed -d.
    line = wb.Machine(
        inertias=[wb.Inertia("disc", 1.0, angle=1.0, speed=-0.5)],
        shafts=[wb.Shaft("disc", "ground", name="shaft", stiffness=16.25, damping=1.0)],
    )
    times = np.linspace(0.0, 2.0, 9)
    found = wb.sensitivity(line, ["shaft.stiffness", "disc.angle"], 2.0, times=times)
    fall, w = np.exp(-0.5 * times), 4.0
    expected = -fall * times * np.sin(w * times) / (2.0 * w)
    np.testing.assert_allclose(found["angle"][0, :, 0], expected, atol=1e-12)
    by_angle = fall * (np.cos(w * times) + 0.5 / w * np.sin(w * times))
    np.testing.assert_allclose(found["angle"][1, :, 0], by_angle, atol=1e-12)


def oscillator(k: float, c: float, amplitude: float, frequency: float) -> wb.Machine:
    return wb.Machine(
        inertias=[wb.Inertia("disc", 2.0)],
        shafts=[wb.Shaft("disc", "ground", name="shaft", stiffness=k, damping=c)],
        torques=[wb.Torque("disc", wb.Harmonic(amplitude, frequency, 0.3), name="engine")],
    )


def test_a_linear_oscillator_has_the_derivatives_of_the_closed_form() -> None:
    def closed(k: float, c: float, amplitude: float, frequency: float) -> dict[str, float]:
        w = 2.0 * math.pi * frequency
        speed = amplitude / abs(complex(c, 2.0 * w - k / w))
        period = 1.0 / frequency
        return {
            "period": period, "velocity_amplitude": speed, "angle_amplitude": speed / w,
            "rms_velocity": speed / math.sqrt(2.0), "peak_acceleration": speed * w,
            "rms_acceleration": speed * w / math.sqrt(2.0), "highest_velocity": speed,
            "viscous_loss": 0.5 * c * speed**2 * period, "torque_work": 0.5 * c * speed**2 * period,
        }  # fmt: skip

    values = {"shaft.stiffness": 100.0, "shaft.damping": 3.0, "engine.amplitude": 5.0,
              "engine.frequency": 1.0}  # fmt: skip
    orbit = wb.orbit(oscillator(*values.values()))
    found = orbit.sensitivity(list(values))
    expected = closed(*values.values())
    for measure, number in expected.items():
        assert found[f"{measure}_value"].item() == pytest.approx(number, rel=1e-12)
    for i, (name, value) in enumerate(values.items()):

        def of(there: float, i: int = i) -> dict[str, np.ndarray]:
            near = list(values.values())
            near[i] = there
            return {one: np.array(number) for one, number in closed(*near).items()}

        for measure, by in difference(of, value, 2e-3 * value).items():
            own = found[measure].sel(parameter=name).item()
            assert own == pytest.approx(float(by), rel=1e-10, abs=1e-10), (name, measure)


@pytest.mark.parametrize("ratio", [0.75, 1.5])
def test_dry_friction_has_the_amplitude_of_den_hartog(ratio: float) -> None:
    # Without sticks (Den Hartog 1931): k A/P = sqrt(V^2 - (M/P)^2 U^2).
    def amplitude(k: float, torque: float, friction: float, frequency: float) -> float:
        r = 2.0 * math.pi * frequency / math.sqrt(k)
        v = 1.0 / (1.0 - r * r)
        u = math.sin(math.pi / r) / (r * (1.0 + math.cos(math.pi / r)))
        return math.sqrt((v * torque / k) ** 2 - (friction / k * u) ** 2)

    k, torque, frequency = 100.0, 50.0, ratio * 10.0 / (2.0 * math.pi)
    brake = wb.Contact(
        "disc", name="brake", brake=wb.ConventionalBrake(radius=0.5),
        friction=wb.CoulombFriction(kinetic=0.2), actuation=wb.Actuation(initial_force=20.0),
    )  # fmt: skip
    machine = wb.Machine(
        inertias=[wb.Inertia("disc", 1.0)],
        shafts=[wb.Shaft("disc", "ground", name="shaft", stiffness=k)], contacts=[brake],
        torques=[wb.Torque("disc", wb.Harmonic(torque, frequency), name="engine")],
    )  # fmt: skip
    orbit = wb.orbit(machine)
    assert sorted(orbit.sequence.split()) == ["+", "-"]
    names = ["shaft.stiffness", "engine.amplitude", "brake.kinetic", "engine.frequency"]
    found = orbit.sensitivity(names)
    friction = float(found["peak_torque_value"][0])
    values = [k, torque, friction, frequency]
    own = found["angle_amplitude_value"].item()
    assert own == pytest.approx(amplitude(*values), rel=1e-11)
    for i, value in enumerate(values):

        def of(there: float, i: int = i) -> dict[str, np.ndarray]:
            near = [*values[:i], there, *values[i + 1 :]]
            return {"a": np.array(amplitude(*near))}

        expected = difference(of, value, 1e-3 * value)["a"]
        expected *= friction / 0.2 if i == 2 else 1.0  # by the coefficient
        assert found["angle_amplitude"][i].item() == pytest.approx(float(expected), rel=1e-9)


@pytest.mark.parametrize(("static", "speed"), [(1.5, 1.0), (1.25, 0.5), (2.0, 0.125)])
def test_a_limit_cycle_has_the_period_of_the_closed_form(static: float, speed: float) -> None:
    """A stick from 1 - a to 1 + a, and a slip, without damping: a is static/2 - 1 with radius 2."""
    belt = pressed("block", static=static, name="belt", base_speed=speed)
    machine = single(belt, name="block", stiffness=1.0)
    found = wb.orbit(machine).sensitivity(["belt.static", "belt.base_speed", "belt.kinetic"])
    a, unit = static - 1.0, static / machine.value("belt.static")
    size = speed**2 + a**2
    by_a = 2.0 / speed - 2.0 * speed / size
    expected = [unit * by_a, 2.0 * a / size - 2.0 * a / speed**2, -unit * by_a]
    np.testing.assert_allclose(found["period"], expected, rtol=1e-9)
    # Per cycle the belt loses what the block gains: the mean speed of the block is 0.
    np.testing.assert_allclose(found["base_work"], found["friction_heat"], rtol=1e-9)
    assert found["highest_velocity"].sel(parameter="belt.base_speed").item() == pytest.approx(1.0)


ORBITS: dict[str, tuple[wb.Machine, list[str]]] = {
    "Coulomb, lag": (
        one(wb.Actuation(initial_force=27.0, slope=-1.0, lag=0.01)),
        ["brake.kinetic", "brake.lag", "engine.frequency"],
    ),
    "lag without slope": (
        one(wb.Actuation(initial_force=27.0, lag=0.01)), ["brake.initial_force", "shaft.stiffness"],
    ),
    "Stribeck": (MACHINES["Stribeck"], ["brake.speed", "engine.frequency"]),
    "table": (MACHINES["table"], ["brake.scale", "engine.frequency"]),
    "smoothed": (MACHINES["smoothed"], ["brake.steepness", "engine.frequency"]),
    "sampled": (
        one(wb.Actuation(initial_force=27.0, slope=-2.0, sample_time=1.0 / 280.0)),
        ["brake.slope", "shaft.stiffness"],
    ),
    "moving base": (
        one(wb.Actuation(initial_force=40.0), base_speed=wb.Harmonic(1.0, 3.5, 0.1) + 1.0),
        ["brake.base_speed.signals.0.amplitude", "brake.kinetic"],
    ),
    "sticks": (
        one(wb.Actuation(initial_force=400.0), brake=wb.WedgeBrake(angle=1.2, radius=0.2)),
        ["brake.kinetic", "engine.amplitude"],
    ),
}  # fmt: skip


@pytest.mark.parametrize("kind", ORBITS)
def test_of_an_orbit_against_differences(kind: str) -> None:
    machine, names = ORBITS[kind]
    orbit = wb.orbit(machine)
    assert orbit.found
    found = orbit.sensitivity(names)
    for name in names:

        def values(value: float, name: str = name) -> Values:
            near = machine.replace({name: value})
            again = wb.orbit(near, orbit.order, initial=orbit.initial).sensitivity(names[:1])
            return {one: again[f"{one}_value"].to_numpy() for one in (*_PAIR, *OF)}

        assert_agrees(found, name, values, machine.value(name), (1e-3, 1e-4, 1e-5))


def test_of_a_driveline_is_that_of_its_machine() -> None:
    system = wb.paper.system(eta=-24.0, F0=0.067)
    orbit = wb.orbit(system)
    found = orbit.sensitivity(["slope", "frequency"], of=["friction_heat", "velocity_amplitude"])
    assert found["friction_heat"].dims == ("parameter",)
    assert float(found["velocity_amplitude_value"]) == pytest.approx(
        orbit.velocity_amplitude, rel=1e-10
    )
    frequency = system.excitation.frequency
    expected = -orbit.order / frequency**2
    assert float(found["period"][1]) == pytest.approx(expected, rel=1e-12)


def test_free_rotation_is_left_out() -> None:
    # Two discs on a shaft, braked on average by a moving base: only their twist is restrained.
    machine = wb.Machine(
        inertias=[wb.Inertia("a", 1.0, speed=3.0), wb.Inertia("b", 2.0, speed=3.0)],
        shafts=[
            wb.Shaft("a", "b", name="shaft", stiffness=200.0, damping=0.5),
            wb.Shaft("a", "ground", name="oil", stiffness=0.0, damping=2.0),
        ],
        torques=[wb.Torque("a", wb.Harmonic(20.0, 1.0) + 6.0, name="engine")],
    )
    orbit = wb.orbit(machine)
    found = orbit.sensitivity(["oil.damping", "engine.signals.1.value", "shaft.stiffness"])
    # The mean speed is torque over damping; the twist and all amplitudes do not depend on it.
    np.testing.assert_allclose(found["angle_amplitude"][1], 0.0, atol=1e-10)
    np.testing.assert_allclose(found["highest_velocity"][1], 0.5, rtol=1e-10)
    np.testing.assert_allclose(found["angle_amplitude_value"], orbit_swings(machine), rtol=1e-10)


def orbit_swings(machine: wb.Machine) -> list[float]:
    """Amplitudes of the angles of a and b, about their rotation."""
    w = 2.0 * math.pi
    coupling = complex(200.0, 0.5 * w)
    matrix = np.array([
        [coupling - w * w + 2.0j * w, -coupling], [-coupling, coupling - 2.0 * w * w],
    ])  # fmt: skip
    return [abs(one) for one in np.linalg.solve(matrix, np.array([20.0, 0.0]))]


def test_an_orbit_of_a_family_has_the_derivatives_that_its_members_share() -> None:
    # A disc that a clutch never releases from a second one: their relative angle is arbitrary.
    clutch = wb.Contact(
        "a", "b", name="clutch", brake=wb.ConventionalBrake(radius=0.2),
        friction=wb.CoulombFriction(kinetic=0.3), actuation=wb.Actuation(initial_force=1e5),
    )  # fmt: skip
    machine = wb.Machine(
        inertias=[wb.Inertia("a", 1.0), wb.Inertia("b", 1.0)],
        shafts=[wb.Shaft("a", "ground", name="shaft", stiffness=100.0, damping=3.0)],
        contacts=[clutch],
        torques=[wb.Torque("a", wb.Harmonic(5.0, 1.0), name="engine")],
    )
    orbit = wb.orbit(machine)
    assert orbit.found
    found = orbit.sensitivity(["shaft.stiffness"])
    z = complex(3.0, 2.0 * 2.0 * math.pi - 100.0 / (2.0 * math.pi))
    by = 5.0 / abs(z) ** 3 * z.imag / (2.0 * math.pi)
    np.testing.assert_allclose(found["velocity_amplitude"][0], by, rtol=1e-9)


def test_wrong_arguments() -> None:
    machine = MACHINES["clutch"]
    with pytest.raises(wb.InputError, match="no such measure"):
        wb.sensitivity(machine, ["brake.kinetic"], 1.0, of=["heat"])
    with pytest.raises(wb.InputError, match="of = "):
        wb.sensitivity(machine, ["brake.kinetic"], 1.0, of="friction_heat")
    with pytest.raises(wb.InputError, match="samples"):
        wb.sensitivity(machine, ["brake.kinetic"], 1.0, of=["friction_heat"], samples=10)
    line = oscillator(100.0, 3.0, 5.0, 1.0)
    with pytest.raises(wb.InputError, match="no such parameter"):
        wb.orbit(line).sensitivity(["disc.speed"])
    two = line.replace({"engine.signal": wb.Harmonic(5.0, 1.0) + wb.Harmonic(1.0, 2.0)})
    orbit = wb.orbit(two)
    with pytest.raises(wb.InputError, match="common period"):
        orbit.sensitivity(["engine.signals.0.frequency"])
    sampled = one(wb.Actuation(initial_force=27.0, slope=-2.0, sample_time=1.0 / 280.0, delay=1))
    with pytest.raises(wb.InputError, match=r"\.delay"):
        wb.orbit(sampled).sensitivity(["brake.slope"])
    undelayed = wb.orbit(ORBITS["sampled"][0])
    with pytest.raises(wb.InputError, match="period"):
        undelayed.sensitivity(["engine.frequency"])
    belt = single(pressed("block", name="belt", base_speed=1.0), name="block", stiffness=1.0,
                  damping=1.0)  # fmt: skip
    with pytest.raises(wb.InputError, match="no orbit"):
        wb.orbit(belt).sensitivity(["belt.kinetic"])
