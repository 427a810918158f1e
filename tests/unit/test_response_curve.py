"""Amplitude curves against closed forms, the energy balance and separately located folds."""

from __future__ import annotations

import cmath
import math
from functools import cache
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from matplotlib.text import Text

import wedgebrake as wb

EXAMPLES = Path(__file__).parents[2] / "examples"


def line_with(damping: float) -> wb.Driveline:
    return wb.Driveline(inertia=2.0, damping=damping, stiffness=8000.0)


LINE = line_with(1.5)
NATURAL = math.sqrt(8000.0 / 2.0) / (2.0 * math.pi)
FRICTION = 60.0


def constant_friction(line: wb.Driveline = LINE, torque: float = FRICTION) -> wb.BrakedDriveline:
    """A brake without self-amplification, whose torque is +-``torque`` [N m]."""
    return wb.BrakedDriveline(
        driveline=line,
        brake=wb.ConventionalBrake(radius=0.2),
        friction=wb.CoulombFriction(kinetic=0.3),
        actuation=wb.Actuation(initial_force=torque / 0.06, slope=0.0),
        excitation=wb.HarmonicTorque(amplitude=400.0, frequency=10.0),
    )


def closed_form(
    line: wb.Driveline, torque: float, amplitude: float, frequency: float
) -> tuple[float, complex]:
    """Peak and fundamental (relative to the torque) of Den Hartog's motion without sticks.

    J. P. Den Hartog, Trans. ASME 53 (1931), 107-115. From its largest angle X, where t = 0, to -X
    half a period later, the friction is constant, and the motion that of a linear oscillator.
    """
    m, c, k, w = line.inertia, line.damping, line.stiffness, 2.0 * math.pi * frequency
    a = 0.5 * c / m
    wd, half = math.sqrt(k / m - a * a), math.pi / w
    e, cos, sin = math.exp(-a * half), math.cos(wd * half), math.sin(wd * half)
    # The free part exp(-a t) (A cos + B sin) and its rate, at both ends; sums of both.
    matrix = [
        [1.0 + e * cos, e * sin],
        [-a - e * (a * cos + wd * sin), wd + e * (wd * cos - a * sin)],
    ]
    first, second = np.linalg.solve(matrix, [-2.0 * torque / k, 0.0])
    gain = 1.0 / (k - m * w * w + 1j * c * w)
    rate = a * first - wd * second
    forced = math.sqrt((amplitude * abs(gain)) ** 2 - (rate / w) ** 2)
    peak = torque / k + first + forced
    # The torque is amplitude sin(w t + phase); the forced part at t = 0 has this phase.
    phase = math.atan2(forced, rate / w) - cmath.phase(gain)
    direction = -1j * cmath.exp(1j * phase)
    fundamental = gain * (amplitude * direction - 4j * torque / math.pi)
    return peak, fundamental / direction


@cache
def curves(damping: float) -> xr.Dataset:
    system = constant_friction(line_with(damping))
    # Without damping the branch climbs to unbounded amplitudes at resonance, in many short steps.
    last = 12.0 if damping else 9.5
    level = 400.0 if damping else 200.0
    return wb.response_curve(system, frequency=(5.0, last), levels=[level])


@pytest.mark.parametrize("damping", [0.0, 1.5, 40.0])
def test_den_hartog(damping) -> None:
    """Amplitude and phase of constant friction, where it does not stick, to 1e-10."""
    found, line = curves(damping), line_with(damping)
    # At resonance without damping, amplitudes are unbounded, and rounding is amplified.
    away = np.abs(found.frequency - NATURAL) > (0.1 if damping == 0.0 else -1.0)
    slides = np.flatnonzero((found.stick_share == 0.0) & away)
    assert slides.size > 30
    for k in slides[:: max(1, slides.size // 60)]:
        at = found.isel(point=k)
        level, frequency = float(at.amplitude), float(at.frequency)
        peak, fundamental = closed_form(line, FRICTION, level, frequency)
        assert float(at.angle_amplitude) == pytest.approx(peak, rel=1e-10)
        ours = at.angle_fundamental.item() * cmath.exp(1j * at.angle_phase.item())
        assert abs(ours - fundamental) <= 1e-10 * abs(fundamental)
        heat = 4.0 * FRICTION * peak
        assert float(at.friction_heat) == pytest.approx(heat, rel=1e-10)
        damper = heat / (math.pi * 2.0 * math.pi * frequency * abs(fundamental) ** 2)
        assert float(at.equivalent_damping) == pytest.approx(damper, rel=1e-10)


def test_den_hartogs_formula() -> None:
    """The published amplitude without damping, (P/k) sqrt(V^2 - (F U/P)^2)."""
    found = curves(0.0)
    slides = np.flatnonzero((found.stick_share == 0.0) & (np.abs(found.frequency - NATURAL) > 0.1))
    for k in slides[:: max(1, slides.size // 20)]:
        at = found.isel(point=k)
        ratio = float(at.frequency) / NATURAL
        gain = 1.0 / (1.0 - ratio**2)
        turn = math.sin(math.pi / ratio) / (ratio * (1.0 + math.cos(math.pi / ratio)))
        size = float(at.amplitude) / 8000.0
        peak = size * math.sqrt(gain**2 - (FRICTION * turn / float(at.amplitude)) ** 2)
        assert float(at.angle_amplitude) == pytest.approx(peak, rel=1e-10)


def chain(**changes: float) -> wb.Machine:
    """Two inertias, driven at the second, without friction."""
    return wb.Machine(
        inertias=[wb.Inertia("disc", 1.0), wb.Inertia("hub", 0.5)],
        shafts=[
            wb.Shaft("disc", "ground", stiffness=3000.0, damping=2.0, name="mount"),
            wb.Shaft("hub", "disc", stiffness=5000.0, damping=1.0, name="link"),
        ],
        torques=[wb.Torque("hub", wb.Harmonic(100.0, 8.0, phase=0.3), name="engine")],
    ).replace(changes)


def test_linear_machine() -> None:
    """Without friction: the transfer function, of each inertia and shaft, at each level."""
    found = wb.response_curve(chain(), frequency=(6.0, 9.0), levels=[50.0, 100.0], step=0.05)
    assert found.attrs["phase_reference"] == "torque on hub"
    assert set(np.unique(found["engine.amplitude"])) == {50.0, 100.0}
    assert "friction_heat" not in found
    w = 2.0 * np.pi * found["engine.frequency"].to_numpy()[:, None, None]
    stiffness = np.array([[8000.0, -5000.0], [-5000.0, 5000.0]])
    damping = np.array([[3.0, -1.0], [-1.0, 1.0]])
    dynamic = stiffness - w**2 * np.diag([1.0, 0.5]) + 1j * w * damping
    load = np.zeros((len(w), 2, 1))
    load[:, 1, 0] = found["engine.amplitude"]
    expected = np.linalg.solve(dynamic, load)[..., 0]
    ours = (found.angle_fundamental * np.exp(1j * found.angle_phase)).to_numpy()
    sizes = np.abs(expected).max(axis=1)
    assert np.max(np.abs(ours - expected) / sizes[:, None]) <= 1e-10
    link = (found.twist_fundamental * np.exp(1j * found.twist_phase)).sel(shaft="link").to_numpy()
    assert np.max(np.abs(link - expected[:, 1] + expected[:, 0]) / sizes) <= 1e-10
    assert found.angle_amplitude.to_numpy() == pytest.approx(np.abs(expected), rel=1e-9)


WEDGE = wb.paper.system(eta=-24.0, F0=0.036)


@cache
def folding() -> xr.Dataset:
    return wb.response_curve(WEDGE, frequency=(8.0, 9.5), levels=[480.0, 530.0], folds=True)


def test_a_peak_does_not_hide_the_rest_of_a_curve() -> None:
    """Half of the orbits are seen apart from the axis, and so in the explorer."""
    light = constant_friction(line_with(0.1), torque=5.0)
    found = wb.response_curve(light, frequency=(5.0, 40.0), levels=[400.0])
    sizes = found.angle_amplitude.to_numpy()
    assert sizes.max() > 20.0 * np.median(sizes)
    axes = wb.plot(found).axes[0]
    assert axes.transLimits.transform(axes.transScale.transform((0.0, np.median(sizes))))[1] > 0.1


def test_curves_of_folds() -> None:
    """Folds at levels between the given ones, located over the frequency alone."""
    found = folding()
    assert {"fold", "grazing-sliding"} <= set(found.bifurcation_kind.values)
    numbers = np.unique(found.fold_curve)
    assert numbers.size >= 2
    for number in numbers:
        points = np.flatnonzero(found.fold_curve == number)
        at = found.isel(fold_point=points[len(points) // 2])
        level = float(at.fold_level)
        alone = wb.branches(
            WEDGE.replace(amplitude=level), frequency=(8.0, 9.5), order=1, switch=0,
            opposite=False,
        )  # fmt: skip
        apart = np.abs(alone.bifurcation_value.to_numpy() - float(at.fold_value))
        nearest = int(np.argmin(apart))
        assert apart[nearest] <= 1e-8
        assert str(alone.bifurcation_kind.values[nearest]) in ("fold", "grazing-sliding")
        size = alone.angle_amplitude.to_numpy()[alone.bifurcation_point.values[nearest]]
        assert float(at.fold_angle_amplitude) == pytest.approx(size, rel=1e-5)


def test_folds_at_the_levels_are_on_one_curve_each() -> None:
    found = folding()
    turns = np.isin(found.bifurcation_scenario, ["non-smooth fold"])
    turns |= found.bifurcation_kind.to_numpy() == "fold"
    for k in np.flatnonzero(turns):
        level, value = float(found.bifurcation_level[k]), float(found.bifurcation_value[k])
        near = [
            number
            for number in np.unique(found.fold_curve)
            if np.min(
                np.hypot(
                    (found.fold_level - level)[found.fold_curve == number] / 50.0,
                    (found.fold_value - value)[found.fold_curve == number] / 1.5,
                )
            )
            < 1e-3
        ]
        assert len(near) == 1


def test_energy_of_a_cycle() -> None:
    """The heat is that of a simulation of the same orbit, also where it sticks."""
    found = folding()
    for k in np.flatnonzero(found.stable & (found.stick_share > 0.0))[::40]:
        at = found.isel(point=k)
        system = WEDGE.replace(amplitude=float(at.amplitude), frequency=float(at.frequency))
        start = float(at["angle"][0]), float(at.velocity[0])
        balance = wb.energy(wb.simulate(system, periods=2, initial=start))
        assert float(at.friction_heat) == pytest.approx(float(balance.friction_heat[0]), rel=1e-8)


def test_machine_of_the_driveline() -> None:
    """The same results by both classes; of a machine over its parts."""
    settings = {"frequency": (12.0, 13.0), "levels": [400.0], "step": 0.2}
    line = wb.response_curve(constant_friction(), **settings)
    machine = wb.response_curve(constant_friction().machine, **settings)
    assert line.angle_amplitude.dims == ("point",)
    assert machine.angle_amplitude.dims == ("point", "inertia")
    assert machine.friction_heat.dims == ("point", "contact")
    ends = {"point": [0, -1]}
    for name in ("angle_amplitude", "angle_phase", "friction_heat", "equivalent_damping"):
        ours = machine[name].isel(ends).to_numpy().ravel()
        assert ours == pytest.approx(line[name].isel(ends).to_numpy(), rel=1e-9)


def test_smooth_friction() -> None:
    """A steep smooth law: near Den Hartog's motion, in proportion to 1/steepness."""
    peak, fundamental = closed_form(LINE, FRICTION, 400.0, 12.0)
    errors = []
    for steepness in (400.0, 800.0):
        friction = wb.SmoothedFriction(kinetic=0.3, steepness=steepness)
        system = constant_friction().replace(friction=friction)
        found = wb.response_curve(system, frequency=(12.0, 12.2), levels=[400.0], step=0.5).isel(
            point=0
        )
        errors.append(abs(float(found.angle_fundamental) - abs(fundamental)))
        assert float(found.angle_amplitude) == pytest.approx(peak, rel=1e-3)
    assert errors[1] < 0.6 * errors[0]


def test_limit_cycles() -> None:
    """Friction feeds stick-slip on a belt: its damping is what the shaft dissipates, negative."""
    belt = wb.load_study("examples/belt.toml").system
    found = wb.response_curve(
        belt, {"belt.base_speed": (0.6, 0.9)}, levels={"belt.initial_force": [1.0, 1.2]},
        method="smooth", step=0.1,
    )  # fmt: skip
    assert found.attrs["phase_reference"].startswith("angle of")
    assert float(np.max(found.equivalent_damping)) < 0.0
    assert float(np.min(found.stick_share)) > 0.0


def test_levels_without_an_orbit() -> None:
    """Where the torque is too small, nothing slips: said in a note."""
    found = wb.response_curve(
        constant_friction(torque=250.0), frequency=(12.0, 15.0), levels=[100.0, 400.0]
    )
    assert set(found.amplitude.values) == {400.0}
    assert found.attrs["note"].startswith("amplitude = 100: Nothing slips")
    with pytest.raises(wb.InputError, match=r"no orbit at any of them\. amplitude = 100: Nothing"):
        wb.response_curve(constant_friction(torque=250.0), frequency=(12.0, 15.0), levels=[100.0])


def test_each_reason_for_no_orbit_is_given_with_its_frequencies() -> None:
    """Slow vibration is held by the brake; faster vibration creeps towards rest."""
    held = WEDGE.replace(amplitude=500.0)
    found = wb.response_curve(held, frequency=(8.0, 40.0), levels=[50.0, 480.0], step=0.3)
    note = found.attrs["note"]
    assert note.startswith("amplitude = 50: At frequency = 8")
    assert "Nothing slips" in note
    written = [one.get_text() for one in wb.plot(found).findobj(Text)]
    levels = [one for one in written if "= 50 " in one or "= 480 " in one]
    assert [one.endswith(": no orbit") for one in levels] == [True, False]


def test_an_orbit_that_cannot_be_followed_leaves_the_others() -> None:
    """Gear rattle at 0.1 Hz: the torsion of an engine that hardly turns."""
    system = wb.load_study(EXAMPLES / "rattle.toml").system
    signal = "engine.speed.signals.1"
    found = wb.response_curve(
        system, {f"{signal}.frequency": (0.1, 100)}, levels={f"{signal}.amplitude": [1.2]}, points=3
    )
    assert found.sizes["branch_number"] > 1


def test_between_sticking() -> None:
    """Slip around resonance only: the branch begins and ends where all slip ends."""
    found = wb.response_curve(
        constant_friction(line_with(60.0), 380.0), frequency=(6.0, 30.0), levels=[400.0]
    )
    assert float(found.frequency.min()) >= 6.0
    assert found.sizes["point"] > 10


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"levels": [], "frequency": (5, 40)}, "levels = .*a list of values of amplitude"),
        ({"levels": 50.0, "frequency": (5, 40)}, "levels = 50.0: must be a list"),
        ({"levels": [50.0, 50.0], "frequency": (5, 40)}, "different values"),
        ({"levels": {"slope": [1.0], "eta": [1.0]}, "frequency": (5, 40)}, "one parameter"),
        ({"levels": {"speed": [1.0]}, "frequency": (5, 40)}, "cannot be followed over"),
        ({"levels": {"frequency": [8.0]}, "frequency": (5, 40)}, "frequency: is followed"),
        ({"levels": [50.0], "frequency": (5, 40), "folds": True}, "folds = True"),
        ({"levels": [50.0], "frequency": 5}, "two numbers"),
        ({"levels": [50.0], "frequency": (5, 40), "switch": -1}, "switch"),
        ({"levels": [50.0]}, "one parameter with its ends"),
        ({"levels": {"kinetic": [-1.0]}, "frequency": (5, 40)}, "kinetic"),
    ],
)
def test_invalid_arguments(arguments, message) -> None:
    with pytest.raises(wb.InputError, match=message):
        wb.response_curve(constant_friction(), **arguments)


def test_which_torque() -> None:
    """With several torques the parameters are given by name."""
    machine = chain()
    two = wb.Machine(
        inertias=machine.inertias, shafts=machine.shafts,
        torques=[*machine.torques, wb.Torque("disc", wb.Harmonic(10.0, 8.0), name="other")],
    )  # fmt: skip
    with pytest.raises(wb.InputError, match=r"engine.frequency, other.frequency"):
        wb.response_curve(two, frequency=(5, 40), levels=[10.0])
    with pytest.raises(wb.InputError, match=r"engine.amplitude, other.amplitude") as error:
        wb.response_curve(two, {"disc.inertia": (1.0, 2.0)}, levels=[10.0])
    assert error.value.name == "levels"


def test_sampled_controller() -> None:
    """Over the amplitude, at frequencies with whole numbers of samples in a period."""
    system = wb.paper.system(eta=-5.0, F0=0.036).replace(sample_time=0.001, delay=1)
    found = wb.response_curve(
        system, amplitude=(400.0, 450.0), levels={"frequency": [10.0, 12.5]}, step=0.2
    )
    assert set(found.frequency.values) == {10.0, 12.5}
    at = found.isel(point=-1)
    last = system.replace(amplitude=float(at.amplitude), frequency=float(at.frequency))
    settled = wb.simulate(last, periods=200).isel(time=slice(-200, None))
    assert 0.5 * np.ptp(settled.angle.to_numpy()) == pytest.approx(
        float(at.angle_amplitude), rel=1e-3
    )


def test_the_sampling_interval_can_follow_the_frequency() -> None:
    """Each point is an orbit of the system with the sampling interval that the result states."""
    system = wb.paper.system(eta=-5.0, F0=0.036).replace(sample_time=0.001, delay=1)
    found = wb.response_curve(system, frequency=(10.0, 12.5), levels=[400.0], samplings=100)
    assert found.attrs["samplings"] == 100
    np.testing.assert_allclose(found.sample_time * found.frequency, 0.01, rtol=1e-15)
    # At 10 Hz a period has 100 samples of the system itself.
    own = wb.orbit(system.replace(frequency=10.0, amplitude=400.0))
    first = found.isel(point=int(found.frequency.argmin("point")))
    assert float(first.sample_time) == 0.001
    assert float(first.angle_amplitude) == pytest.approx(own.angle_amplitude, rel=1e-10)
    last = found.isel(point=int(found.frequency.argmax("point")))
    assert (float(last.frequency), float(last.sample_time)) == (12.5, 0.0008)
    settled = wb.simulate(
        system.replace(frequency=12.5, amplitude=400.0, sample_time=0.0008), periods=400
    ).isel(time=slice(-200, None))
    reach = 0.5 * float(settled.angle.max() - settled.angle.min())
    assert float(last.angle_amplitude) == pytest.approx(reach, rel=1e-3)


def test_frequent_samples_approach_the_curve_without_samples() -> None:
    """The force is held for half a sample on average: the difference is of first order in it."""
    system = wb.paper.system(eta=-5.0, F0=0.036)
    frequencies = (10.0, 11.0)

    def at_end(one: wb.BrakedDriveline, samplings: int | None) -> float:
        found = wb.response_curve(
            one, frequency=frequencies, levels=[400.0], samplings=samplings, step=0.1
        )
        last = found.isel(point=int(found.frequency.argmax("point")))
        return float(last.angle_amplitude)

    without = at_end(system, None)
    apart = [at_end(system.replace(sample_time=0.001), n) - without for n in (100, 200, 400)]
    # The place of the samples relative to the reversals adds to a factor of 2.
    assert np.divide(apart[:-1], apart[1:]) == pytest.approx(2.0, abs=0.2)


def test_samples_that_do_not_follow_the_frequency_are_refused() -> None:
    system = wb.paper.system(eta=-5.0, F0=0.036).replace(sample_time=0.001)
    for ends in ((10.0, 12.5), (10.1, 12.3)):  # whole numbers of samples at the ends or not
        with pytest.raises(wb.InputError, match="samplings in a period") as caught:
            wb.response_curve(system, frequency=ends, levels=[400.0])
        assert (caught.value.name, caught.value.value) == ("frequency", ends)
    curve = {"frequency": (10.0, 12.5), "levels": [400.0]}
    for wrong in (0, 2.5, True):
        with pytest.raises(wb.InputError) as caught:
            wb.response_curve(system, samplings=wrong, **curve)
        assert (caught.value.name, caught.value.value) == ("samplings", wrong)
    with pytest.raises(wb.InputError, match="none"):  # nothing is sampled
        wb.response_curve(system.replace(sample_time=None), samplings=8, **curve)


def test_the_frequency_of_a_driven_end_is_named() -> None:
    block = chain().replace(
        torques=[],
        inertias=[*chain().inertias, wb.Driven("end", wb.Harmonic(1.0, 1.0))],
        shafts=[*chain().shafts, wb.Shaft(chain().inertias[0].name, "end", 1.0, name="last")],
    )
    with pytest.raises(wb.InputError, match=r"'end\.speed\.frequency'"):
        wb.response_curve(block, frequency=(0.5, 2.0), levels=[1.0])
