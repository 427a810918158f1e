"""Root mean squares and peaks of sweeps: closed forms, sampled motions, other solvers."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import wedgebrake as wb
from printed import strict_json
from wedgebrake.figures.data.response_diagram import ResponseDiagram, jumps
from wedgebrake.model.studies.study_run import RunSettings

EXAMPLES = Path(__file__).parents[2] / "examples"
MEASURES = (
    "lowest_velocity", "highest_velocity", "rms_velocity", "rms_acceleration",
    "peak_acceleration", "rms_jerk", "peak_jerk", "rms_torque", "peak_torque",
)  # fmt: skip


def test_a_driveline_without_friction():
    """J v' + c v + k q = T sin wt: a sine of speed w T/|k - J w^2 + i c w|."""
    system = wb.paper.system().replace(initial_force=0.0, slope=0.0, damping=20.0)
    frequencies = np.array([5.0, 11.0, 20.0])
    found = wb.sweep(system, frequency=frequencies)
    line, w = system.driveline, 2.0 * np.pi * frequencies
    receptance = np.abs(line.stiffness - line.inertia * w**2 + 1j * line.damping * w)
    speed = w * system.excitation.amplitude / receptance
    for name, expected in (
        ("highest_velocity", speed), ("lowest_velocity", -speed),
        ("rms_velocity", speed / np.sqrt(2.0)), ("rms_acceleration", w * speed / np.sqrt(2.0)),
        ("peak_acceleration", w * speed), ("rms_jerk", w**2 * speed / np.sqrt(2.0)),
        ("peak_jerk", w**2 * speed), ("rms_torque", 0.0 * w),
    ):  # fmt: skip
        np.testing.assert_allclose(found[name], expected, rtol=2e-5, atol=1e-12, err_msg=name)


@pytest.mark.parametrize("eta", [-24.0, -3.0, 6.0])
def test_two_solvers_agree(eta):
    """The closed forms of one inertia and the Taylor series of machines, on periodic motions."""
    system = wb.paper.system(eta=eta, f=0.63, F0=0.036)
    fast = wb.sweep(system, {"eta": [eta]})
    assert fast["order"].item() > 0
    machine = system.machine
    name = "brake.slope"
    other = wb.sweep(machine, {name: [machine.parameters()[name]]})
    for measure in MEASURES:
        assert other[measure].item() == pytest.approx(fast[measure].item(), rel=2e-5), measure


def test_a_stick_slip_motion_as_sampled():
    """Of 20 000 samples of a period, with the acceleration from the equation of motion."""
    system = wb.paper.system(eta=6.0, f=0.4, F0=0.036)
    found = wb.sweep(system, {"eta": [6.0]})
    assert found["stick_share"].item() > 0.1
    final = found["final_angle"].item(), found["final_velocity"].item()
    response = wb.simulate(system, periods=1, samples_per_period=20_000, initial=final)
    time, speed, angle, torque = (
        response[name][1:].to_numpy() for name in ("time", "velocity", "angle", "brake_torque")
    )
    line, drive = system.driveline, system.excitation
    forcing = drive.amplitude * np.sin(drive.angular_frequency * time)
    acceleration = (forcing - line.stiffness * angle - line.damping * speed - torque) / line.inertia
    for name, expected in (
        ("rms_velocity", speed.std()), ("rms_torque", torque.std()),
        ("rms_acceleration", np.sqrt(np.mean(acceleration**2))),
        ("highest_velocity", speed.max()), ("peak_acceleration", np.abs(acceleration).max()),
    ):  # fmt: skip
        assert found[name].item() == pytest.approx(expected, rel=2e-3), name


def test_an_undecided_motion_is_measured_over_its_whole_record():
    """As sampled over the record; a class that is not confirmed gives no orbit to measure."""
    system = wb.paper.system(F0=0.036)
    found = wb.sweep(system, eta=np.linspace(-33.32, -33.26, 4), periods=230, transient=200)
    undecided = np.flatnonzero(found["motion"] == 0)
    assert undecided.size > 0
    for one in undecided:
        brake = system.replace(eta=found["eta"].values[one])
        attrs = wb.simulate(brake, periods=200, times=()).attrs
        begin = attrs["final_angle"], attrs["final_velocity"]
        run = wb.simulate(brake, periods=30, samples_per_period=1000, initial=begin)
        expected = run["velocity"].to_numpy()[1:].std()
        assert found["rms_velocity"].values[one] == pytest.approx(expected, rel=1e-4)


def test_fast_decay_costs_no_more_than_any_other_slip():
    """Rates of 1e6 and 1e9 1/s after each reversal; the speed otherwise follows the torque."""
    system = wb.BrakedDriveline(
        driveline=wb.Driveline(inertia=1e-5, damping=10.0, stiffness=100.0),
        brake=wb.ConventionalBrake(radius=0.2),
        friction=wb.CoulombFriction(kinetic=0.3),
        actuation=wb.Actuation(initial_force=30.0, slope=0.1),
        excitation=wb.HarmonicTorque(amplitude=500.0, frequency=1.0),
    )
    damping = [10.0, 1e4]
    found = wb.sweep(system, damping=damping, periods=1, transient=0)
    for one, rms in zip(damping, found["rms_velocity"].values, strict=True):
        run = wb.simulate(system.replace(damping=one), periods=1, samples_per_period=20_000)
        speed = run["velocity"].to_numpy()[1:]
        assert rms == pytest.approx(speed.std(), rel=1e-3)
        seen, work = wb.motion(system.replace(damping=one), 1, transient=0), wb.energy(run).attrs
        assert seen.friction_power == pytest.approx(work["mean_friction_power"], rel=1e-5)
        assert seen.peak_torque == pytest.approx(work["largest_peak_torque"], rel=1e-5)


@pytest.fixture(scope="module")
def belt():
    return wb.load_study(EXAMPLES / "belt.toml").system


@pytest.fixture(scope="module")
def followed(belt):
    return wb.bifurcation(belt, {"belt.base_speed": np.linspace(0.4, 1.9, 16)}, follow=True)


def test_a_limit_cycle_as_its_stopping_would_measure_it(belt):
    """The Legendre series between events, which ``stopping`` integrates, over one cycle."""
    from wedgebrake.analysis.responses.machine_series import largest, machine_series, series
    from wedgebrake.analysis.responses.repeat import solved
    from wedgebrake.solvers.machine.solve import MachineTask

    found = wb.sweep(belt, {"belt.base_speed": [0.5]})
    start = wb.final_state(wb.simulate(belt, 400.0))
    period = found["motion_period"].item()
    task = MachineTask(start.time, start.time + period, np.empty(0), start, False, 10**6)
    motion = machine_series(belt, task, solved(belt, task))
    jerk = motion.jerk()

    def rms(values):
        return np.sqrt(motion.integral(values**2).sum(axis=0) / period)

    mean = motion.integral(motion.torque).sum(axis=0) / period
    for name, expected in (
        ("rms_jerk", rms(jerk)), ("peak_jerk", largest(series(jerk))),
        ("rms_acceleration", rms(motion.acceleration)), ("rms_velocity", rms(motion.speed)),
        ("rms_torque", rms(motion.torque - mean)),
    ):  # fmt: skip
        np.testing.assert_allclose(found[name][0], expected, rtol=1e-6, err_msg=name)


def test_steady_sliding_does_not_vibrate(followed):
    steady = followed.sel(branch="down").isel({"belt.base_speed": -1})
    for name in ("rms_velocity", "rms_jerk", "peak_jerk", "rms_acceleration", "rms_torque"):
        assert (steady[name] == 0.0).all()


# Without friction.
LINE = wb.paper.system().replace(initial_force=0.0, slope=0.0, damping=20.0)
FREE = wb.Machine(
    inertias=[wb.Inertia("a", 1.0), wb.Inertia("b", 0.5)],
    shafts=[wb.Shaft("a", "b", 1.0, damping=0.1)],
    torques=[wb.Torque("b", wb.Harmonic(1.0, 0.2), name="engine")],
)


class TestDiagram:
    def test_hysteresis_is_shown(self, followed):
        """Below the Hopf point both branches vibrate; above it only the one that comes up."""
        data = ResponseDiagram.of(followed)
        up, down = data.panels[0].lines[:2]
        hopf = 0.5 * np.log(10.0)
        above = data.x.values > hopf + 0.03
        assert np.all(down.y[above] == 0.0)
        assert np.all(up.y[above & (data.x.values < 1.6)] > 1.0)
        np.testing.assert_allclose(
            down.y[data.x.values < 1.1], up.y[data.x.values < 1.1], rtol=1e-6
        )
        place = int(np.flatnonzero(down.jumps)[0])
        assert data.x.values[place] < hopf < data.x.values[place + 1] + 0.03

    def test_the_amplitude_is_half_the_range(self, followed):
        data = ResponseDiagram.of(followed)
        one = followed.isel(inertia=0, branch=0)
        expected = 0.5 * (one["highest_velocity"] - one["lowest_velocity"])
        np.testing.assert_array_equal(data.panels[0].lines[0].y, expected)

    def test_jumps(self):
        smooth = np.sin(np.linspace(0.0, 3.0, 50))
        assert not jumps(smooth, 1.0).any()
        broken = smooth + (np.arange(50) > 20)
        np.testing.assert_array_equal(np.flatnonzero(jumps(broken, 2.0)), [20])
        assert not jumps(np.array([0.0, np.nan, 1.0]), 1.0).any()

    @pytest.mark.parametrize("quantity", ["response", "rms_jerk", "stick_share"])
    def test_pictures(self, followed, quantity):
        assert wb.plot(followed, quantity=quantity).axes

    def test_a_driveline_has_the_same_panels(self):
        found = wb.sweep(wb.paper.system(eta=6.0), f=np.linspace(0.3, 0.8, 9), keep_points=False)
        data = ResponseDiagram.of(found)
        assert len(data.panels) == 4
        np.testing.assert_array_equal(data.panels[1].lines[1].y, found["rms_torque"])
        assert wb.plot(found, quantity="response").axes

    @pytest.mark.parametrize(
        ("system", "over", "natural"),
        [
            (LINE, {"frequency": [5.0, 20.0]}, [50.0 / np.pi]),
            (LINE, {"f": [0.5, 2.0]}, [1.0]),
            (LINE, {"f": [0.5, 0.6]}, []),
            (LINE, {"damping": [10.0, 20.0]}, []),
            (FREE, {"engine.frequency": [0.1, 1.0]}, [np.sqrt(3.0) / (2.0 * np.pi)]),
        ],
        ids=["driveline", "group", "beyond", "damping", "free machine"],
    )
    def test_natural_frequencies_are_marked(self, system, over, natural):
        """Of J = 1, k = 10⁴: 100 rad/s; of J = 1 and 0.5 with k = 1: √(k (J + J')/(J J'))."""
        found = wb.sweep(system, over, keep_points=False)
        data = ResponseDiagram.of(found.isel(inertia=0) if "inertia" in found.dims else found)
        assert data.natural.tolist() == pytest.approx(natural)
        lines = wb.plot(found, quantity="response").axes[0].lines
        marked = [one.get_xdata()[0] for one in lines if np.ptp(one.get_xdata()) == 0.0]
        assert marked == data.natural.tolist()

    def test_an_unknown_quantity(self, followed):
        with pytest.raises(wb.InputError) as caught:
            wb.plot(followed, quantity="rms_jork")
        assert "rms_jerk" in caught.value.allowed


def test_the_command_draws_amplitudes(run, tmp_path):
    picture = tmp_path / "response.png"
    words = ["sweep", EXAMPLES / "belt.toml", "--over", "belt.base_speed=0.4:1.8:4"]
    drawn = ["--plot", picture, "--quantity", "response"]
    assert run(*words, "--follow", "belt.base_speed", *drawn, "--contact", "belt")[0] == 0
    assert picture.exists()
    told = strict_json(run(*words, *drawn, "--json")[1])
    assert {one.get("inertia", one.get("contact")) for one in told["largest"]} == {"mass", "belt"}
    assert run(*words, *drawn, "--contact", "brake")[0] == 2
    assert run(*words, "--quantity", "response")[0] == 2


def test_the_command_reports_the_largest_value_and_where(run):
    """The speed is largest at √(k/J), with T/c; so is its root mean square."""
    study = wb.Study(LINE, RunSettings())
    Path("line.toml").write_text(study.to_toml())
    words = ["sweep", "line.toml", "--over", "frequency=5,9,15.915494309189533,22,25"]
    words += ["--quantity", "response", "--plot", "r.png"]
    told = strict_json(run(*words, "--json")[1])
    assert told["natural_frequencies"] == pytest.approx([50.0 / np.pi])
    largest = {one["quantity"]: one for one in told["largest"]}
    speed = LINE.excitation.amplitude / 20.0
    for name, value in (("speed_amplitude", speed), ("rms_velocity", speed / np.sqrt(2.0))):
        assert largest[name]["value"] == pytest.approx(value, rel=2e-5)
        assert largest[name]["at"] == {"frequency": 15.915494309189533}
    _, text, _ = run(*words)
    assert f"{largest['speed_amplitude']['value']:.5g} rad/s" in text
    assert "at frequency = 15.9155" in text


def test_the_amplitude_of_the_torque_is_an_axis():
    """Not the amplitude of the speed, which is a result."""
    from wedgebrake.figures.data.response_diagram import ResponseDiagram

    found = wb.sweep(LINE, amplitude=[5.0, 10.0, 20.0], periods=60, transient=50)
    data = ResponseDiagram.of(found)
    np.testing.assert_array_equal(data.x.values, [5.0, 10.0, 20.0])
    half = 0.5 * (found["highest_velocity"] - found["lowest_velocity"])
    np.testing.assert_array_equal(data.panels[0].lines[0].y, half)


def test_the_command_tells_the_amplitude_of_the_torque_of_a_largest_value(run):
    Path("line.toml").write_text(wb.Study(LINE, RunSettings()).to_toml())
    words = ["sweep", "line.toml", "--over", "amplitude=5,10,20", "--quantity", "response"]
    told = strict_json(run(*words, "--plot", "r.png", "--json")[1])
    largest = {one["quantity"]: one for one in told["largest"]}
    assert largest["rms_velocity"]["at"] == {"amplitude": 20.0}


def test_the_inertia_of_a_driveline_is_no_part_with_a_largest_value(run):
    """Resonance at J = k/(2 pi f)^2."""
    Path("line.toml").write_text(wb.Study(LINE, RunSettings()).to_toml())
    frequency = LINE.excitation.frequency
    resonant = LINE.driveline.stiffness / (2.0 * np.pi * frequency) ** 2
    values = ",".join(repr(float(share * resonant)) for share in (0.5, 0.8, 1.0, 1.3))
    words = ["sweep", "line.toml", "--over", f"inertia={values}", "--quantity", "response"]
    told = strict_json(run(*words, "--plot", "r.png", "--json")[1])
    quantities = [one["quantity"] for one in told["largest"]]
    assert len(quantities) == len(set(quantities))
    largest = {one["quantity"]: one for one in told["largest"]}
    assert largest["rms_velocity"]["at"]["inertia"] == pytest.approx(resonant)
    assert Path("r.png").exists()
