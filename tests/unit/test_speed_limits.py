"""Limits of slope, friction and damping over the speed, against closed forms and ``hopf``."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import expm

import wedgebrake as wb
from machines import block, contact, single, stribeck
from wedgebrake.analysis.linear_stability import limits_of
from wedgebrake.analysis.linear_stability.varied_parameters import VariedParameter
from wedgebrake.solvers.machine.final_state import final_state

BELT = Path(__file__).parents[2] / "examples" / "belt.toml"
FALLING = BELT.with_name("falling_friction.toml")
FORCE, DAMPING, KINETIC, STATIC, SPEED = 3.0, 0.1, 0.5, 1.0, 0.5


def mass_on_a_belt():
    return block(stribeck(), force=FORCE, base_speed=0.5)


def falling(speed):
    """Minus the slope of the Stribeck curve."""
    return (STATIC - KINETIC) / SPEED * np.exp(-speed / SPEED)


def coefficient(speed):
    return KINETIC + (STATIC - KINETIC) * np.exp(-speed / SPEED)


def test_the_limits_of_a_mass_on_a_belt():
    """Sliding is stable where c + delta mu(v) + (F_a0 + delta v) mu'(v) > 0."""
    speeds = np.linspace(0.2, 1.8, 9)
    found = wb.stability_limits(mass_on_a_belt(), speeds)
    fall = falling(speeds)
    np.testing.assert_allclose(found["block-ground.damping"], FORCE * fall, rtol=1e-9)
    slope = (FORCE * fall - DAMPING) / (coefficient(speeds) - speeds * fall)
    np.testing.assert_allclose(found["belt.slope"], slope, rtol=1e-8, atol=1e-10)
    # With all coefficients multiplied by one factor.
    np.testing.assert_allclose(found["belt.kinetic"], KINETIC * DAMPING / (FORCE * fall), rtol=1e-9)
    assert (found.stable_side.sel(parameter="belt.kinetic") == -1).all()
    assert (found.stable_side.sel(parameter="block-ground.damping") == 1).all()
    np.testing.assert_array_equal(found.stable, FORCE * fall < DAMPING)
    decay = 0.5 * (DAMPING - FORCE * fall)
    vibrates = np.abs(decay) < 1.0
    np.testing.assert_allclose(found.damping_ratio[vibrates, 0], decay[vibrates], rtol=1e-9)
    np.testing.assert_allclose(found.growth_rate[vibrates], -decay[vibrates], rtol=1e-9)


def two_inertias(speed=20.0):
    return wb.Machine(
        inertias=[wb.Inertia("motor", 0.2, speed=speed), wb.Inertia("disc", 1.0, speed=speed)],
        shafts=[
            wb.Shaft("motor", "disc", stiffness=2e4, damping=1.0),
            wb.Shaft("disc", "ground", stiffness=1e4, damping=0.5),
        ],
        contacts=[
            contact(
                brake=wb.WedgeBrake(angle=0.34, radius=0.2), force=3000.0, slope=-3.0, lag=2e-3,
                friction=wb.CoulombFriction(kinetic=0.3, static=0.33),
            )
        ],
    )  # fmt: skip


def test_limits_are_hopf_points():
    machine = two_inertias()
    limits = {one.parameter: one for one in limits_of(machine)}
    for name, between in (("brake.slope", (-3.0, 20.0)), ("disc-ground.damping", (0.5, 50.0))):
        expected = wb.hopf(machine, name, between=between)
        assert limits[name].limit == pytest.approx(expected.value, rel=1e-9)
        assert limits[name].frequency == pytest.approx(expected.frequency, rel=1e-6)
    assert limits["brake.slope"].present == -3.0
    # At each limit the largest growth rate is zero, and it changes its sign there.
    for one in limits.values():
        if one.limit is None:
            continue
        static = {"brake.static": 1.1 * one.limit} if one.also_static else {}
        rate = wb.stability(machine.replace({one.parameter: one.limit, **static})).growth_rate
        assert abs(rate) < 1e-7


@pytest.mark.parametrize("static", [0.3, 0.33])
def test_static_friction_in_proportion_is_never_below_kinetic(static):
    varied = VariedParameter("brake.kinetic", "friction", 0.3, 0.3, 0.0, 5.0, {"s": static})
    for value in np.geomspace(1e-6, 5.0, 1000).tolist():
        changed = varied.changes(value)
        assert changed["s"] >= changed["brake.kinetic"]
        assert changed["s"] == pytest.approx(value * static / 0.3, rel=1e-15)


def test_the_dataset_has_the_limits_of_the_own_speed():
    machine = two_inertias()
    found = wb.stability_limits(machine, [10.0, 20.0])
    assert found.attrs["own_speed"] == 20.0
    for one in limits_of(machine):
        expected = np.nan if one.limit is None else one.limit
        assert float(found[one.parameter].sel(speed=20.0)) == pytest.approx(
            expected, rel=1e-9, nan_ok=True
        )
        assert found[one.parameter].attrs["units"] == one.unit
    own = wb.stability(machine)
    modes = sorted((m.frequency, m.damping_ratio) for m in own.modes if m.frequency > 0.0)
    np.testing.assert_allclose(found.frequency.sel(speed=20.0), [f for f, _ in modes])
    np.testing.assert_allclose(found.damping_ratio.sel(speed=20.0), [d for _, d in modes])


def test_a_driveline_has_the_limits_of_its_closed_form():
    """c + R delta g = 0 with g = mu/(tan(alpha) - mu) forwards (eqs. 11 to 13)."""
    system = wb.paper.system().replace(drive_speed=-2.0, slope=-1.0)
    found = wb.stability_limits(system, [2.0])
    verdict = wb.stability(system)
    expected = verdict.backward if verdict.forward.speed is None else verdict.forward
    assert float(found["brake.slope"][0]) == pytest.approx(expected.hopf_slope, rel=1e-9)


def turning(slope, damping=8.0):
    """A disc of 5 rad/s on a shaft to the ground, with tan(alpha) = 1/2 and mu = 0.2."""
    brake = contact(
        brake=wb.WedgeBrake(angle=float(np.arctan(0.5)), radius=0.2),
        friction=wb.CoulombFriction(kinetic=0.2), force=300.0, slope=slope,
    )  # fmt: skip
    return single(brake, stiffness=1e4, damping=damping, speed=5.0)


@pytest.mark.parametrize("limit", [0.3, 0.35, 0.4, 0.45, 0.49])
def test_a_limit_just_before_self_locking_is_found(limit):
    """c + R delta g = 0 with g = mu/(tan(alpha) - mu), which locks at mu = 1/2."""
    machine = turning(slope=-8.0 / (0.2 * limit / (0.5 - limit)))
    (found,) = (one for one in limits_of(machine) if one.kind == "friction")
    assert found.limit == pytest.approx(limit, rel=1e-9)
    assert found.stable == "below"


def test_the_release_of_the_actuator_is_no_limit_of_its_slope():
    """It is at F_a0/speed = -60 N s/rad, nearer than the limit -c/(R g) beyond which it decays."""
    machine = turning(slope=-59.0, damping=1.0)
    (found,) = (one for one in limits_of(machine) if one.kind == "slope")
    assert found.limit == pytest.approx(-1.0 / (0.2 * 0.2 / (0.5 - 0.2)), rel=1e-9)
    assert found.stable == "above"


def test_no_value_beyond_a_bound_is_stable():
    """The speed of a free rotation grows for any friction above 0 whose force falls with speed."""
    brake = contact(friction=wb.CoulombFriction(kinetic=0.2), force=300.0, slope=-1.0)
    machine = wb.Machine(inertias=[wb.Inertia("disc", 1.0, speed=5.0)], contacts=[brake])
    (found,) = (one for one in limits_of(machine) if one.kind == "friction")
    assert (found.limit, found.stable) == (None, "nowhere")


@pytest.mark.parametrize("speeds", [[0.0], [-1.0], [[1.0]], "fast", [np.inf], []])
def test_wrong_speeds(speeds):
    with pytest.raises(wb.InputError) as caught:
        wb.stability_limits(mass_on_a_belt(), speeds)
    assert caught.value.name == "speeds"


def test_a_machine_without_sliding():
    machine = wb.Machine(inertias=[wb.Inertia("disc", 1.0)])
    with pytest.raises(wb.InputError):
        wb.stability_limits(machine)
    assert limits_of(machine) == ()


class TestPictures:
    def test_curves_are_those_of_the_dataset(self):
        found = wb.stability_limits(mass_on_a_belt(), np.linspace(0.3, 1.8, 7))
        figure = wb.plot(found)
        drawn = [line.get_ydata() for axes in figure.axes for line in axes.lines]
        for name in ("belt.slope", "belt.kinetic", "block-ground.damping"):
            assert any(
                np.array_equal(np.asarray(one, float), found[name].to_numpy()) for one in drawn
            )

    def test_a_far_limit_is_left_out_and_the_caption_tells(self):
        from wedgebrake.figures.data.speed_limits import of_limits

        near = wb.stability_limits(mass_on_a_belt(), np.linspace(0.3, 1.8, 7))
        far = near.copy(deep=True)
        far["belt.slope"][2] = -1e6
        before, after = of_limits(near), of_limits(far)
        assert len(after.sentences) == len(before.sentences) + 1
        hidden = np.isnan(after.panels[1].lines[0].y)
        np.testing.assert_array_equal(hidden, np.arange(7) == 2)

    def test_the_caption_tells_of_an_instability_that_no_curve_shows(self):
        from wedgebrake.figures.data.speed_limits import of_limits

        def sentences(slope):
            machine = two_inertias().replace({"disc-ground.stiffness": 0.0, "brake.slope": slope})
            machine = machine.replace({"disc-ground.damping": 0.0})
            found = wb.stability_limits(machine, [10.0, 20.0])
            assert (found.damping_ratio > 0.0).all()
            assert found.stable.any() == (slope > 0.0)
            return len(of_limits(found).sentences)

        assert sentences(-0.01) == sentences(0.01) + 1

    def test_unstable_speeds_are_shaded(self):
        """Up to the Hopf point, to the width of a cell."""
        speeds = np.linspace(1.5, 1.9, 9)
        axes = wb.plot(wb.stability_limits(mass_on_a_belt(), speeds)).axes[0]
        edge = max(patch.get_extents().x1 for patch in axes.patches)
        shaded = axes.transData.inverted().transform((edge, 0.0))[0]
        hopf = SPEED * np.log((STATIC - KINETIC) / SPEED * FORCE / DAMPING)
        assert shaded == pytest.approx(hopf, abs=0.05)

    def test_map_of_a_machine(self):
        """The limit in the plane of speed and damping is c = F (mu_s - mu_k)/v0 exp(-v/v0)."""
        from wedgebrake.figures.data.class_map import stability_map

        axes = {
            "belt.base_speed": np.linspace(0.4, 2.0, 41),
            "block-ground.damping": np.linspace(0.02, 0.6, 41),
        }
        found = wb.stability_map(mass_on_a_belt(), axes)
        points = np.concatenate(stability_map(found).limit)
        np.testing.assert_allclose(points[:, 1], FORCE * falling(points[:, 0]), atol=5e-3)
        assert wb.plot(found).axes
        line = wb.plot(found.isel({"block-ground.damping": 5}, drop=True))
        assert len(line.axes) == 3

    def test_no_number_of_a_map_is_cut_off(self):
        law = wb.StribeckFriction(kinetic=0.32, static=0.5, speed=0.4)
        pad = contact(name="pad", friction=law, radius=0.12, force=800.0, base_speed=6.0)
        machine = single(pad, inertia=0.05, stiffness=4000.0, damping=0.35)
        axes = {"pad.base_speed": np.linspace(1.0, 12.0, 41)}
        axes["pad.initial_force"] = np.linspace(200.0, 1900.0, 31)
        figure = wb.plot(wb.stability_map(machine, axes))
        figure.draw_without_rendering()
        panel = figure.axes[0]
        numbers = [one for one in panel.texts if one.get_text()]
        assert numbers
        frame = panel.get_window_extent()
        for one in numbers:
            box = one.get_window_extent()
            assert frame.x0 <= box.x0 < box.x1 <= frame.x1, one.get_text()
            assert frame.y0 <= box.y0 < box.y1 <= frame.y1, one.get_text()


def test_the_command_prints_and_draws(answer, run, tmp_path):
    told = answer("stability", BELT)
    limits = {one["parameter"]: one for one in told["limits"]}
    machine = wb.load_study(BELT).system
    name = "mass-ground.damping"
    expected = wb.hopf(machine, name, between=(machine.parameters()[name], 10.0)).value
    assert limits[name]["limit"] == pytest.approx(expected, rel=1e-9)
    status, text, _ = run("stability", BELT)
    assert status == 0
    assert f"{limits[name]['limit']:.6g}" in text
    picture = tmp_path / "limits.png"
    told = answer("stability", BELT, "--speeds", "0.2:2:5", "--plot", picture)
    assert told["files"]["picture"] == str(picture)
    assert picture.read_bytes().startswith(b"\x89PNG")
    picture.unlink()
    free = tmp_path / "free.toml"
    free.write_text('[[inertia]]\nname = "disc"\ninertia = 1.0\n')
    for arguments in ([BELT, "--speeds", "0:2:5"], [free]):
        status, text, _ = run("stability", *arguments, "--plot", picture, "--json")
        assert (status, text, picture.exists()) == (2, "", False)


def test_the_command_prints_the_limits_of_a_driveline_that_turns(answer, run):
    """d = c + R [delta mu(R Omega) + R (F_a0 + delta Omega) mu'] (examples/falling_friction.toml).

    The straight lines of the torque have another limit: they join its values at the points of the
    table on both sides, 0.5 and 1 m/s.
    """
    told = answer("stability", FALLING)
    limits = {one["parameter"]: one for one in told["limits"]}
    c, radius, speed, force = 0.5, 0.2, 3.0, 1000.0
    fall, coefficient = 0.08, 0.35 - 0.08 * (radius * speed - 0.5)
    damping = radius**2 * force * fall
    slope = (damping - c) / (radius * (coefficient - radius * speed * fall))
    expected = {"slope": slope, "scale": c / damping, "damping": damping}
    assert limits.keys() == expected.keys()
    drawn = wb.stability_limits(wb.load_study(FALLING).system, [speed])
    for name, value in expected.items():
        assert limits[name]["limit"] == pytest.approx(value, rel=1e-9)
        (of_machine,) = (one for one in drawn.data_vars if str(one).endswith(f".{name}"))
        assert float(drawn[of_machine][0]) == pytest.approx(value, rel=1e-9)
    assert told["forward"]["hopf_slope"] == pytest.approx(slope, rel=1e-9)
    low, high = 0.5 / radius, 1.0 / radius
    rise = (0.31 * high - 0.35 * low) / (high - low)
    fall_of_lines = force * (0.35 - 0.31) / (high - low)
    exact = answer("stability", FALLING, "--method", "exact")
    expected = (radius * fall_of_lines - c) / (radius * rise)
    assert (told["method"], exact["method"]) == ("curve", "exact")
    assert exact["forward"]["hopf_slope"] == pytest.approx(expected, rel=1e-9)
    (of_slope,) = (one for one in exact["limits"] if one["parameter"] == "slope")
    assert of_slope["limit"] == pytest.approx(expected, rel=1e-9)
    system = wb.load_study(FALLING).system
    limit = wb.hopf(system, "slope", between=(0.0, 100.0), method="exact")
    assert limit.value == pytest.approx(expected, rel=1e-9)
    drawn = wb.stability_limits(system, [speed], method="exact")
    assert float(drawn["brake.slope"][0]) == pytest.approx(expected, rel=1e-9)
    for report, options in ((told, ()), (exact, ("--method", "exact"))):
        _, text, _ = run("stability", FALLING, *options)
        for one in report["limits"]:
            assert f"{one['limit']:.6g}" in text


def test_each_method_has_the_limit_of_its_friction():
    """Small deviations from steady sliding, with the slope between the limits of the methods.

    The lines of the exact method are those of the torque: deviations grow. With the curve of the
    smooth method, they decay.
    """
    system = wb.load_study(FALLING).system.replace(slope=48.0)
    radius, speed, force = 0.2, 3.0, 1000.0 + 48.0 * 3.0
    ends = [radius * (1000.0 + 48.0 * v) * mu for v, mu in ((2.5, 0.35), (5.0, 0.31))]
    mu = 0.35 - 0.08 * (radius * speed - 0.5)
    torques = {
        "exact": (ends[0] + (ends[1] - ends[0]) * (speed - 2.5) / 2.5, (ends[1] - ends[0]) / 2.5),
        "smooth": (radius * force * mu, radius * (48.0 * mu - force * 0.08 * radius)),
    }
    line, duration = system.driveline, 1.0
    for method, (torque, rise) in torques.items():
        flow = np.array([[0.0, 1.0], [-line.stiffness, -(line.damping + rise)]])
        rate = np.linalg.eigvals(flow).real.max()
        assert (rate > 0.0) == (method == "exact")
        chosen = "exact" if method == "exact" else "curve"
        for one in (system, system.machine):
            found = wb.stability(one, method=chosen)
            assert found.stable == (rate < 0.0)
            assert found.growth_rate == pytest.approx(rate, abs=1e-9)
        at = -torque / line.stiffness
        start = np.array([1e-6, 0.0])
        end = final_state(
            wb.simulate(system.machine.started_at(at + 1e-6, 0.0), duration, method=method)
        )
        found = [end.angles["driveline"] - at, end.speeds["driveline"]]
        # The curve is a parabola of the speed: its second order is 1e-5 of its first one here.
        room = 1e-9 if method == "exact" else 1e-4
        size = np.array([1e-6, 1e-6 * np.sqrt(line.stiffness)])
        np.testing.assert_allclose(found / size, expm(duration * flow) @ start / size, atol=room)


def test_the_reference_of_a_custom_law_is_no_friction_that_could_be_changed():
    law = wb.CustomFriction(law=lambda v: 0.3 * np.tanh(100.0 * v), width=0.01, kinetic=0.3)
    machine = wb.paper.system().replace(drive_speed=2.0, friction=law).machine
    assert {one.kind for one in limits_of(machine)} == {"slope", "damping"}


def test_a_stop_that_friction_presses_is_a_spring():
    """Without friction the stop opens: there the equilibrium is at a corner of the gap."""
    damping, radius, kinetic = 0.3, 0.2, 0.3
    brake = contact("disc", radius=radius, friction=kinetic, force=20.0)
    machine = wb.Machine(
        inertias=[wb.Inertia("disc", 1.0)],
        shafts=[wb.Shaft("disc", "ground", 50.0, damping, gap=(-0.1, 0.1), name="stop")],
        contacts=[brake],
    )
    found = wb.stability_limits(machine, [1.0, 2.0])
    np.testing.assert_allclose(found["brake.slope"], -damping / (radius * kinetic), rtol=1e-9)
    np.testing.assert_allclose(found["stop.damping"], 0.0, atol=1e-9)
    np.testing.assert_allclose(found["brake.kinetic"], 0.0, atol=1e-5)
