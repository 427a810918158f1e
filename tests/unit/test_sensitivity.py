"""Derivatives of responses with respect to parameters: closed forms, differences of exact runs."""

from collections.abc import Iterator

import numpy as np
import pytest

import wedgebrake as wb

TIMES = np.linspace(0.0, 1.0, 26)
# Weights of differences of fourth order at multiples of a step: about a value, and above one that
# is the least allowed. Steps are relative to the parameter.
_CENTRAL = {1: 8.0 / 12.0, -1: -8.0 / 12.0, 2: -1.0 / 12.0, -2: 1.0 / 12.0}
_ABOVE = {0: -25.0 / 12.0, 1: 4.0, 2: -3.0, 3: 4.0 / 3.0, 4: -0.25}
_STEPS = (1e-5, 3e-6, 3e-5, 1e-6)
_NAMES = ("angle", "velocity", "shaft_torque", "brake_torque", "actuation_force")

STIFF = [wb.Shaft("disc", "ground", name="shaft", stiffness=1000.0, damping=0.5)]
DISC = [wb.Inertia("disc", 1.0, angle=0.01, speed=2.0)]
ENGINE = wb.Torque("disc", wb.Harmonic(150.0, 7.0, 0.3), name="engine")
COULOMB = wb.CoulombFriction(kinetic=0.3, static=0.33)
WEDGE = wb.WedgeBrake(angle=1.2, radius=0.2)


def one(
    actuation: wb.Actuation,
    friction: object = COULOMB,
    *,
    brake: wb.Brake = WEDGE,
    torque: wb.Torque = ENGINE,
    **more: object,
) -> wb.Machine:
    contact = wb.Contact(
        "disc", name="brake", brake=brake, friction=friction, actuation=actuation, **more
    )
    return wb.Machine(inertias=DISC, shafts=STIFF, contacts=[contact], torques=[torque])


MACHINES = {
    "clutch": wb.Machine(
        inertias=[wb.Inertia("disc", 1.0, speed=2.0), wb.Inertia("hub", 0.5, speed=1.0)],
        shafts=[
            wb.Shaft("disc", "hub", name="shaft", stiffness=3000.0, damping=1.0, ratio=1.5),
            wb.Shaft("hub", "ground", name="mount", stiffness=1000.0, damping=0.5),
        ],
        contacts=[
            wb.Contact(
                "disc", name="brake", brake=WEDGE, friction=COULOMB, base_speed=0.2,
                actuation=wb.Actuation(initial_force=200.0, slope=-10.0, lag=0.01),
            ),
            wb.Contact(
                "disc", "hub", name="clutch", brake=wb.ConventionalBrake(radius=0.2),
                friction=wb.CoulombFriction(kinetic=0.25, static=0.3),
                actuation=wb.Actuation(initial_force=100.0),
            ),
        ],
        torques=[ENGINE],
    ),
    "sampled": one(wb.Actuation(initial_force=27.0, slope=-9.0, sample_time=0.004, delay=2)),
    "sampled, lag, limits": one(
        wb.Actuation(
            initial_force=21.0, slope=-3.0, sample_time=0.004, delay=1, frequency=100.0,
            damping_ratio=0.3, limits=(2.0, 30.0),
        )
    ),
    "signals": one(
        wb.Actuation(initial_force=wb.Ramp(5.0, 60.0, 0.7, begin=0.2), slope=-3.0),
        wb.CoulombFriction(kinetic=0.3, static=0.4),
        base_speed=wb.Harmonic(1.0, 2.0, 0.1) + 1.0,
        torque=wb.Torque(
            "disc", wb.Harmonic(150.0, 7.0, 0.3) * wb.Ramp(0.5, 1.0, 0.7, begin=0.2), name="engine"
        ),
    ),
    "table": one(
        wb.Actuation(initial_force=80.0, slope=-20.0),
        wb.TabulatedFriction(speeds=(0.0, 0.05, 0.2, 1.0), coefficients=(0.35, 0.3, 0.25, 0.27)),
    ),
    "Stribeck": one(
        wb.Actuation(initial_force=40.0, slope=-1.0, lag=0.01),
        wb.StribeckFriction(kinetic=0.25, static=0.35, speed=0.1),
    ),
    "smoothed": one(
        wb.Actuation(initial_force=27.0, slope=-1.0, lag=0.01),
        wb.SmoothedFriction(kinetic=0.2, static=0.25, decay=2.0, steepness=20.0),
    ),
    "leading shoe": one(
        wb.Actuation(initial_force=40.0),
        brake=wb.LeadingShoeBrake(radius=0.2, actuation_arm=0.2, normal_arm=0.1, friction_arm=0.08),
    ),
    "band": one(wb.Actuation(initial_force=10.0), brake=wb.BandBrake(radius=0.2, wrap_angle=4.0)),
}  # fmt: skip
TWO_BRAKES = wb.Machine(
    inertias=DISC,
    shafts=[wb.Shaft("disc", "ground", name="shaft", stiffness=60.0, damping=0.5)],
    contacts=[
        wb.Contact(
            "disc", name=name, brake=wb.ConventionalBrake(radius=0.2),
            friction=wb.CoulombFriction(kinetic=kinetic),
            actuation=wb.Actuation(initial_force=300.0, slope=slope),
        )
        for name, kinetic, slope in (("front", 0.3, -5.0), ("rear", 0.2, 0.0))
    ],
    torques=[wb.Torque("disc", wb.Harmonic(36.0, 7.0, 0.3), name="engine")],
)  # fmt: skip
"""At rest they share the torque of the disc."""
_WITHOUT = ("delay", "resolution")


def parameters(machine: wb.Machine) -> list[str]:
    """All parameters that have a derivative."""
    grounded = {f"{one.name}.ratio" for one in machine.shafts if one.b == "ground"}
    grounded |= {f"{one.name}.base_speed" for one in machine.contacts if one.b != "ground"}
    return [
        name
        for name, value in machine.parameters().items()
        if name.rpartition(".")[2] not in _WITHOUT
        and name not in grounded
        and (value != 0.0 or not name.endswith("lag"))  # another number of states
    ]


def differences(
    system: object, name: str, value: float, **run: object
) -> Iterator[dict[str, np.ndarray]]:
    """Derivatives by differences of the exact runs, with several steps.

    Close to grazing, long steps are too long; rounding limits short ones.
    """
    for size in _STEPS:
        yield _difference(system, name, value, size * (abs(value) or 1.0), **run)


def _difference(
    system: object, name: str, value: float, step: float, **run: object
) -> dict[str, np.ndarray]:
    found: dict[str, np.ndarray] = {}
    try:
        system.replace(**{name: value - step})
    except wb.InputError:
        weights = _ABOVE
    else:
        weights = _CENTRAL
    for place, weight in weights.items():
        near = wb.simulate(system.replace(**{name: value + place * step}), **run)
        for one in (*_NAMES, "event_time"):
            found[one] = found.get(one, 0.0) + weight / step * near[one].to_numpy()
    return found


def assert_equal(
    found: object, expected: Iterator[dict[str, np.ndarray]], near: object, value: float, label: str
) -> None:
    """Compare with differences, of which at each time one must agree.

    Their error is also a share of the quantity over the parameter; ``near`` is the response itself.
    """
    errors: dict[str, np.ndarray] = {}
    for each in expected:
        for name, one in each.items():
            size = np.abs(near[name].to_numpy()).max(initial=0.0) / (abs(value) or 1.0)
            scale = max(np.abs(one).max(initial=1e-6), 1e-3 * size)
            error = np.abs(found[name].to_numpy() - one) / scale
            errors[name] = np.minimum(errors.get(name, error), error)
        if all(np.all(one <= 2e-7) for one in errors.values()):
            return
    raise AssertionError((label, {name: one.max(initial=0.0) for name, one in errors.items()}))


@pytest.mark.parametrize("kind", MACHINES)
def test_every_parameter_against_differences(kind: str) -> None:
    machine = MACHINES[kind]
    names = parameters(machine)
    assert_derivatives(machine, [name for name in names if not name.endswith("sample_time")], TIMES)


def assert_derivatives(machine: wb.Machine, names: list[str], times: np.ndarray) -> None:
    """Compare derivatives with differences."""
    run = {"duration": 1.0, "times": times}
    found = wb.sensitivity(machine, names, **run)
    response = wb.simulate(machine, **run)
    assert response.sizes["event"] >= 5
    assert list(found["parameter"].to_numpy()) == names
    for name in names:
        value = machine.value(name)
        expected = differences(machine, name, value, **run)
        assert_equal(found.sel(parameter=name), expected, response, value, name)


@pytest.mark.parametrize("kind", ["sampled", "sampled, lag, limits"])
def test_sample_times_against_differences(kind: str) -> None:
    """Between samples: at a sample, derivatives of both sides differ."""
    machine = MACHINES[kind]
    assert_derivatives(
        machine, [name for name in parameters(machine) if "sample" in name], TIMES[:-1] + 1e-3
    )


@pytest.mark.parametrize("kind", ["clutch", "signals", "sampled", "sampled, lag, limits"])
def test_a_run_that_continues_against_differences(kind: str) -> None:
    machine = MACHINES[kind]
    state = wb.final_state(wb.simulate(machine, 0.37))
    run = {"duration": 0.6, "times": 0.37 + 0.6 * TIMES, "initial": state, "start_time": state.time}
    response, names = wb.simulate(machine, **run), ["brake.kinetic", "brake.initial_force"]
    names[1] = names[1] if names[1] in machine.parameters() else "engine.signals.0.amplitude"
    found = wb.sensitivity(machine, names, **run)
    for name in names:
        value = machine.value(name)
        expected = differences(machine, name, value, **run)
        assert_equal(found.sel(parameter=name), expected, response, value, name)


@pytest.mark.parametrize(
    "name", ["rear.kinetic", "front.slope", "front.initial_force", "shaft.stiffness", "disc.speed"]
)
def test_many_sticks_of_two_brakes_against_differences(name: str) -> None:
    """Each stick is a system of its own, as the torques of the brakes depend on the state."""
    run = {"duration": 8.0, "times": 8.0 * TIMES}
    response = wb.simulate(TWO_BRAKES, **run)
    assert response.sizes["stick"] > 150
    found, value = wb.sensitivity(TWO_BRAKES, [name], **run), TWO_BRAKES.value(name)
    expected = differences(TWO_BRAKES, name, value, **run)
    assert_equal(found.isel(parameter=0), expected, response, value, name)


def test_an_amplitude_of_zero_has_a_derivative() -> None:
    machine, run = MACHINES["clutch"].replace({"engine.amplitude": 0.0}), {"duration": 1.0}
    run["times"] = TIMES
    found = wb.sensitivity(machine, ["engine.amplitude"], **run)
    expected = differences(machine, "engine.amplitude", 0.0, **run)
    assert np.abs(found["velocity"]).max() > 1e-3
    assert_equal(found.isel(parameter=0), expected, wb.simulate(machine, **run), 0.0, "amplitude")


def test_a_stick_at_the_start_follows_the_base() -> None:
    # A contact at rest on a moving base carries its inertia along: angle t, velocity 1.
    machine = one(wb.Actuation(initial_force=2000.0), base_speed=2.0, torque=wb.Torque("disc", 0.0))
    times = np.linspace(0.0, 0.01, 5)
    assert wb.simulate(machine, times[-1])["brake_torque"].to_numpy().any()
    found = wb.sensitivity(machine, ["brake.base_speed", "disc.speed"], times[-1], times=times)
    base, own = (found.isel(parameter=i, inertia=0) for i in (0, 1))
    np.testing.assert_allclose(base["velocity"], 1.0, atol=1e-13)
    np.testing.assert_allclose(base["angle"], times, atol=1e-14)
    np.testing.assert_allclose(own["velocity"], 0.0, atol=1e-13)
    assert not found["one_sided"].any()


def test_a_slip_from_the_sliding_speed_zero_is_one_sided() -> None:
    machine = one(wb.Actuation(initial_force=27.0), base_speed=2.0)
    names, run = ["disc.speed", "brake.kinetic"], {"duration": 0.02, "times": 0.02 * TIMES}
    found = wb.sensitivity(machine, names, **run)
    side = int(found["one_sided"][0])
    assert abs(side) == 1
    assert found["one_sided"][1] == 0
    assert "disc.speed are one-sided" in found.attrs["message"]
    at, near, far = (
        wb.simulate(machine.replace({"disc.speed": 2.0 + side * step}), **run)["angle"].to_numpy()
        for step in (0.0, 1e-6, 2e-6)
    )
    expected = side * (4.0 * near - far - 3.0 * at) / 2e-6
    np.testing.assert_allclose(found["angle"][0], expected, atol=1e-8)


@pytest.mark.parametrize("name", ["brake.kinetic", "brake.static", "brake.speed"])
def test_a_curve_whose_number_of_lines_changes_nearby(name: str) -> None:
    """Values 1 % apart, beside some of which a curve of friction needs one line more or less."""
    machine = MACHINES["Stribeck"]
    run, centre, lines = {"duration": 0.5, "times": 0.5 * TIMES}, machine.value(name), set()
    for value in centre * np.linspace(0.95, 1.05, 11):
        near = machine.replace({name: float(value)})
        lines.add(len(near.contacts[0].friction.nodes()))
        found = wb.sensitivity(near, [name], **run).isel(parameter=0)
        expected = differences(near, name, float(value), **run)
        assert_equal(found, expected, wb.simulate(near, **run), float(value), name)
    assert len(lines) > 1 or name == "brake.speed"


@pytest.mark.parametrize("name", ["brake.initial_force", "brake.slope", "brake.radius"])
def test_a_release_at_a_point_of_the_table_is_one_sided(name: str) -> None:
    """100 N - 40 N s/rad 2.5 rad/s = 0, and 2.5 rad/s is 0.5 m/s at the radius 0.2 m."""
    table = wb.TabulatedFriction(speeds=(0.0, 0.5, 1.0), coefficients=(0.4, 0.3, 0.25))
    brake = wb.ConventionalBrake(radius=0.2)
    machine = one(wb.Actuation(initial_force=100.0, slope=-40.0), table, brake=brake)
    run, value = {"duration": 1.0, "times": TIMES}, machine.value(name)
    found = wb.sensitivity(machine, [name], **run)
    side = int(found["one_sided"][0])
    assert abs(side) == 1
    assert name in found.attrs["message"]
    step = 1e-6 * side * abs(value)
    at, near, far = (
        wb.simulate(machine.replace({name: value + count * step}), **run)["angle"].to_numpy()
        for count in range(3)
    )
    expected = (4.0 * near - far - 3.0 * at) / (2.0 * step)
    np.testing.assert_allclose(found["angle"][0], expected, atol=1e-6 * np.abs(expected).max())
    beside = wb.sensitivity(machine.replace({name: 1.001 * value}), [name], **run)
    assert beside["one_sided"][0] == 0


@pytest.mark.parametrize("angle", [0.0, 0.01, 0.0119])
@pytest.mark.parametrize("name", ["disc.angle", "shaft.rest"])
def test_the_filter_of_a_controller_starts_on_a_line_of_the_shaft_that_it_measures(name, angle):
    """The error at the start bends at the ends of stages, also close beside the twist."""
    machine = wb.Machine(
        inertias=[wb.Inertia("disc", 1.0, angle=angle, speed=0.3)],
        shafts=[
            wb.Shaft(
                "disc", "ground", name="shaft", damping=1.0,
                stiffness=wb.Stages([-0.01, 0.012], [300.0, 900.0, 500.0]),
            )
        ],
        controllers=[
            wb.Controller(
                "loop", measured={"shaft.torque": 0.01}, setpoint=0.1, output="disc.torque",
                proportional=2.0, derivative=0.03, filter_time=0.017,
            )
        ],
    )  # fmt: skip
    times, step, value = np.array([0.001, 0.01, 0.05]), 1e-7, float(machine.value(name))
    found = wb.sensitivity(machine, [name], 0.05, times=times)["velocity"].to_numpy()[0]
    above, below = (
        wb.simulate(machine.replace({name: value + by}), 0.05, times=times)["velocity"].to_numpy()
        for by in (step, -step)
    )
    differences = (above - below) / (2.0 * step)
    assert found == pytest.approx(differences, rel=1e-7, abs=1e-8 * np.abs(differences).max())


def test_measures_of_a_run_that_stops_at_its_start_are_refused():
    machine = wb.Machine(
        inertias=[wb.Inertia("crank", 1.0, speed=1.0), wb.Inertia("wheel", 1.0)],
        contacts=[wb.OneWayClutch("crank", "wheel", name="freewheel")],
    )
    with pytest.raises(wb.InputError, match="freewheel"):
        wb.sensitivity(machine, ["crank.inertia"], 1.0, of=["rms_velocity"])
