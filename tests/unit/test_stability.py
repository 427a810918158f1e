"""Linear stability beyond the paper: margins, locking, turning shafts, degenerate systems, maps."""

import json
import math

import numpy as np
import pytest

import wedgebrake as wb
from machines import contact, single
from wedgebrake.analysis.linear_stability import damping_at
from wedgebrake.model.friction import SetValuedFriction, _TwoCoefficients


def test_a_map_agrees_with_the_verdict_point_by_point():
    base = wb.paper.system()
    eta, alpha, kinetic = [-24.0, -0.05, 0.0, 90.0], [0.9, 1.02, 1.4], [0.1, 0.3]
    chart = wb.stability_map(base, eta=eta, alpha=alpha, kinetic=kinetic)
    assert chart.sizes == {"eta": 4, "alpha": 3, "kinetic": 2}
    for e in eta:
        for a in alpha:
            for m in kinetic:
                # The map varies mu_k at fixed groups: the slope follows eta.
                one = wb.stability(base.replace(kinetic=m, static=m).replace(eta=e, alpha=a))
                here = chart.sel(eta=e, alpha=a, kinetic=m)
                directions = [d for d in (one.forward, one.backward) if not d.locked]
                assert bool(here.locked) == one.forward.locked
                assert bool(here.stable) == one.stable
                assert float(here.margin) == pytest.approx(one.margin_eta, abs=1e-12)
                worst = max(z.real for d in directions for z in d.eigenvalues) / 100.0
                assert float(here.growth) == pytest.approx(worst, rel=1e-9, abs=1e-12)


@pytest.mark.parametrize(
    ("axes", "name"),
    [
        ({}, "axes"),
        ({"etta": [1.0]}, "etta"),
        ({"alpha": []}, "alpha"),
        ({"alpha": [0.0, 1.0]}, "alpha"),
        ({"eta": [np.nan]}, "eta"),
        ({"eta": "x"}, "eta"),
    ],
)
def test_wrong_axes(axes, name):
    with pytest.raises(wb.InputError, match=f"^{name}"):
        wb.stability_map(wb.paper.system(), **axes)


def _grows(system, side):
    """Whether small vibration grows about slow sliding, from the damping at a speed."""
    line = system.driveline
    damping = damping_at(system, side * 1e-9)
    matrix = [[0.0, 1.0], [-line.stiffness / line.inertia, -damping / line.inertia]]
    return max(np.linalg.eigvals(matrix).real) > 0.0


@pytest.mark.parametrize("eta", [-24.0, -0.6, -0.05])
@pytest.mark.parametrize("alpha", [0.9, 1.18])
@pytest.mark.parametrize("static", [0.3, 0.33])
def test_angles_at_which_a_wedge_becomes_unstable_or_locks(eta, alpha, static):
    system = wb.paper.system(eta=eta, alpha=alpha, static=static)
    found = wb.stability(system)
    for direction in (found.forward, found.backward):
        side, angle = direction.direction, direction.hopf_angle
        if side < 0 and eta > -0.3:
            assert angle is None  # stable at every angle
            assert not any(_grows(system.replace(angle=a), side) for a in (1e-3, 0.3, 1.57))
            continue
        below, above = (system.replace(angle=angle * (1.0 + way)) for way in (-1e-7, 1e-7))
        assert _grows(below, side)
        assert not _grows(above, side)
    for angle, coefficient, word in (
        (found.kinetic_locking_angle, 0.3, "kinetic"),
        (found.static_locking_angle, static, "static" if static > 0.3 else "kinetic"),
    ):
        below, above = (system.replace(angle=angle * (1.0 + way)) for way in (-1e-9, 1e-9))
        assert below.brake.locks(coefficient)
        assert not above.brake.locks(coefficient)
        assert wb.stability(below).self_locking == word
        assert wb.stability(above).self_locking != word


def test_where_there_is_no_limit_in_the_angle():
    system = wb.paper.system(eta=0.1)
    upward = wb.stability(system)
    assert upward.forward.hopf_angle is None
    assert upward.backward.hopf_angle is None
    undamped = wb.stability(wb.paper.system().replace(damping=0.0))
    assert undamped.forward.hopf_angle is None  # the damping has the sign of the slope
    other = wb.stability(wb.paper.system(brake="conventional"))
    assert other.forward.hopf_angle is None
    assert other.kinetic_locking_angle is None
    assert other.static_locking_angle is None


def test_without_damping_the_points_are_slopes():
    found = wb.stability(wb.paper.system().replace(damping=0.0))
    assert found.forward.hopf_eta is None
    assert found.forward.hopf_slope == 0.0
    assert found.margin_slope == pytest.approx(-40.0)


def test_without_friction_or_spring():
    frictionless = wb.stability(wb.paper.system().replace(kinetic=0.0, static=0.0))
    assert frictionless.stable
    assert frictionless.forward.hopf_slope is None
    free = wb.paper.system(eta=0.0).replace(stiffness=0.0)
    # A free shaft keeps its angle, so that its speed decides: J v' = -c v.
    for found in (wb.stability(free), wb.stability(free.machine)):
        assert found.stable
        assert found.eigenvalues == (0.0, -0.1)
    assert not wb.stability(free.replace(damping=0.0)).stable
    # A loss factor is a damping in multiples of sqrt(kJ), here zero.
    assert not wb.stability_map(free, loss_factor=[0.1]).stable


def test_damping_where_the_brake_locks_or_rests():
    locked = wb.paper.system(alpha=0.9)
    assert damping_at(locked, 1.0) == np.inf
    assert np.isfinite(damping_at(locked, -1.0))
    smooth = wb.paper.system(alpha=0.9, friction="smoothed")
    assert damping_at(smooth, 1.0) == np.inf
    for speed in (0.0, np.nan, "1"):
        with pytest.raises(wb.InputError, match="speed = "):
            damping_at(locked, speed)


def _turning(friction, speed, **actuation):
    return wb.BrakedDriveline(
        driveline=wb.Driveline(inertia=1.0, damping=0.1, stiffness=4e3, drive_speed=speed),
        brake=wb.ConventionalBrake(radius=0.2),
        friction=friction,
        actuation=wb.Actuation(**{"initial_force": 300.0, "slope": -40.0, **actuation}),
        excitation=wb.HarmonicTorque(amplitude=0.0, frequency=10.0),
    )


@pytest.mark.parametrize("law", ["coulomb", "smoothed"])
def test_at_the_release_the_worse_side_counts(law):
    """Below 300/40 rad/s the falling force feeds vibration; beyond, the driveline alone damps."""
    friction = {"coulomb": wb.CoulombFriction(kinetic=0.3), "smoothed": wb.SmoothedFriction(
        kinetic=0.3, static=0.3)}[law]  # fmt: skip
    system = _turning(friction, 7.5)
    slope = 0.1 - 0.2 * 40.0 * 0.3
    assert damping_at(system, 7.5) == pytest.approx(slope, rel=1e-6)
    assert damping_at(system, 7.4) == pytest.approx(slope, rel=1e-6)
    assert damping_at(system, 7.6) == pytest.approx(0.1, rel=1e-6)
    response = wb.simulate(system, periods=100, initial=(1e-4, 0.0))
    assert np.abs(response["velocity"].values).max() > 1.0


def test_a_table_locks_only_where_friction_is_high():
    """Locked near rest, sliding at speed: no locking in motion."""
    table = wb.TabulatedFriction(speeds=(0.0, 0.2, 1.0), coefficients=(0.4, 0.3, 0.2))
    system = wb.paper.system().replace(friction=table)
    assert wb.stability(system).self_locking == "static"
    assert np.isfinite(damping_at(system, 6.0))
    higher = wb.TabulatedFriction(speeds=(0.0, 1.0), coefficients=(0.5, 0.4))
    assert wb.stability(wb.paper.system().replace(friction=higher)).self_locking == "kinetic"


FALLING = wb.BrakedDriveline(
    driveline=wb.Driveline(inertia=1.0, damping=0.5, stiffness=1e4, drive_speed=1.0),
    brake=wb.ConventionalBrake(radius=0.2),
    friction=wb.TabulatedFriction(speeds=(0.0, 1.0), coefficients=(0.35, 0.25)),
    actuation=wb.Actuation(initial_force=4000.0),
    excitation=wb.HarmonicTorque(amplitude=0.0, frequency=10.0),
)


def test_of_a_turning_shaft_the_sliding_at_its_speed_decides():
    found = wb.stability(FALLING)
    assert not found.stable
    assert found.damping == found.forward.damping == pytest.approx(-15.5)
    assert found.forward.damping == damping_at(FALLING, 1.0)
    assert found.forward.speed == 1.0
    assert found.backward.speed is None
    assert found.backward.damping is None
    assert not found.backward.locked
    assert found.as_dict()["stable"] is found.as_dict()["forward"]["stable"] is False
    beyond = wb.stability(FALLING.replace(drive_speed=-6.0))  # past the table
    assert beyond.stable
    assert beyond.backward.speed == 6.0
    assert wb.stability(FALLING.replace(stiffness=0.0, drive_speed=6.0)).stable
    assert not wb.stability(FALLING.replace(stiffness=0.0)).stable


def test_a_table_that_locks_near_rest_alone_is_not_locked_at_the_speed_of_the_shaft():
    """Locked means that sliding at that speed does not exist."""
    table = wb.TabulatedFriction(speeds=(0.0, 0.5), coefficients=(0.4, 0.25))
    wedge = wb.WedgeBrake(angle=np.arctan(0.35), radius=0.2)
    system = wb.paper.system().replace(friction=table, brake=wedge, slope=-0.5)
    turning = wb.stability(system.replace(drive_speed=10.0))
    assert turning.self_locking == "static"
    assert not turning.forward.locked
    assert turning.damping == pytest.approx(0.1 - 0.2 * 0.5 * 0.25 / 0.1)  # g = 0.25/(0.35 - 0.25)
    assert not turning.stable
    assert wb.stability(system).forward.locked  # next to rest
    # The coefficient is 0.35 at 1/6 m/s; the line of the torque that begins in a lock is one too.
    for speed, method, locked in (
        (0.0, "curve", True), (0.8, "curve", True), (0.9, "curve", False), (10.0, "curve", False),
        (0.0, "exact", True), (2.4, "exact", True), (2.6, "exact", False),
    ):  # fmt: skip
        one = system.replace(drive_speed=speed)
        assert wb.stability(one, method=method).forward.locked == locked
        assert bool(wb.stability_map(one, eta=[one.groups.eta], method=method).locked[0]) == locked


@pytest.mark.parametrize("alpha", [1.0, np.nextafter(1.0, 2.0), np.nextafter(1.0, 0.0)])
def test_a_wedge_at_the_angle_of_self_locking_locks(alpha):
    """tan(atan(mu)) is mu but for rounding: no damping of 1e16."""
    found = wb.stability(wb.paper.system(alpha=alpha))
    assert found.self_locking == "kinetic"
    assert found.forward.locked
    assert found.damping == found.backward.damping


TABLE = wb.TabulatedFriction(speeds=(0.0, 0.2, 0.9, 2.0), coefficients=(0.4, 0.33, 0.3, 0.31))


def _torque(system, speed, method, resting=0.0):
    """R F_mu at a sliding velocity, by the definitions (eqs. 3, 5, 14).

    Of a table the torque is linear between its nodes with the method exact, else the coefficient.

    resting : speed up to which the actuation counts as that at rest
    """
    friction, brake = system.friction, system.brake
    sign = np.sign(speed)
    if isinstance(friction, wb.SmoothedFriction):
        m = friction.coefficient(brake.radius * speed)
    elif isinstance(friction, wb.CoulombFriction):
        m = sign * friction.kinetic
    elif method == "curve":
        m = sign * np.interp(brake.radius * abs(speed), friction.speeds, friction.coefficients)
    else:
        ends = np.array(friction.speeds) / brake.radius
        torques = [
            brake.radius * system.actuation.force(v) * brake.amplification(sign * m)
            for v, m in zip(ends, friction.coefficients, strict=True)
        ]
        if abs(speed) < ends[-1]:
            return np.interp(abs(speed), ends, torques)
        m = sign * friction.coefficients[-1]
    force = system.actuation.initial_force + system.actuation.slope * (abs(speed) - resting)
    if system.actuation.release:
        force = max(force, 0.0)
    return brake.radius * force * brake.amplification(m)


@pytest.mark.parametrize("slope", [-3.0, 0.0, 7.0])
@pytest.mark.parametrize("drive_speed", [0.0, 0.6, 2.5, 75.0, -40.0])
@pytest.mark.parametrize(
    ("friction", "method"),
    [
        (wb.CoulombFriction(kinetic=0.3, static=0.33), "curve"),
        (wb.CoulombFriction(kinetic=0.3, static=0.33), "exact"),
        (TABLE, "curve"),
        (TABLE, "exact"),
        (wb.SmoothedFriction(kinetic=0.3, static=0.33), "curve"),
        (wb.SmoothedFriction(kinetic=0.3), "curve"),
    ],
    ids=["coulomb", "coulomb-lines", "table", "lines", "peak", "smoothed"],
)
def test_one_linear_verdict(friction, method, drive_speed, slope):
    """Verdict, sweep, map and JSON agree with differences of the torque at the sliding speed."""
    system = wb.paper.system(alpha=1.4).replace(
        friction=friction, drive_speed=drive_speed, slope=slope, damping=2.0
    )
    found = wb.stability(system, method=method)
    assert found.method == method
    sides = [np.sign(drive_speed)] if drive_speed else [1.0, -1.0]
    resting = 0.0
    if isinstance(friction, wb.SmoothedFriction):
        resting = found.forward.speed if drive_speed == 0.0 else 0.0
        assert drive_speed or 1.0 - np.tanh(100.0 * 0.2 * resting) < 1e-15  # out of the steep part
    dampings = []
    for side in sides:
        speed = side * max(abs(drive_speed), resting, 1e-6)
        step = 1e-6 if drive_speed or resting else 0.5
        torques = [
            _torque(system, speed * (1.0 + way * step), method, resting) for way in (-1.0, 1.0)
        ]
        # A brake that locks itself has no finite torque to either side.
        assert np.all(np.isfinite(torques))
        dampings.append(2.0 + side * abs(torques[1] - torques[0]) * np.sign(
            abs(torques[1]) - abs(torques[0])) / (2.0 * step * speed))  # fmt: skip
    assert found.damping == pytest.approx(min(dampings), rel=1e-5, abs=1e-5)
    assert found.stable == (min(dampings) > 0.0)
    assert json.loads(json.dumps(found.as_dict()))["damping"] == found.damping
    smooth = isinstance(friction, wb.SmoothedFriction)
    if smooth or method == "exact":  # the method of the sweep
        swept = wb.sweep(system, inertia=[1.0], periods=2, transient=0, max_steps=10_000)
        assert float(swept["sliding_damping"][0]) == pytest.approx(found.damping, rel=1e-12)
    chart = wb.stability_map(system, eta=[system.groups.eta], method=method)
    assert bool(chart["stable"][0]) == found.stable
    if found.margin_eta is not None:
        assert float(chart["margin"][0]) == pytest.approx(found.margin_eta, rel=1e-9)


@pytest.mark.parametrize("drive_speed", [0.0, 3.0, 7.0, 40.0])
@pytest.mark.parametrize("friction", [wb.CoulombFriction(kinetic=0.3), TABLE])
def test_the_damping_changes_sign_at_the_slope_of_the_hopf_point(friction, drive_speed):
    system = wb.paper.system(alpha=1.4).replace(
        friction=friction, drive_speed=drive_speed, damping=20.0
    )
    found = wb.stability(system).forward
    if found.hopf_slope is None:  # released at that speed before the damping vanishes
        assert 20.0 == damping_at(system.replace(slope=-300.0 / drive_speed - 0.1), drive_speed)
        return
    about = [
        wb.stability(system.replace(slope=found.hopf_slope + way)).damping for way in (-1e-6, 1e-6)
    ]
    assert about[0] < 0.0 < about[1]


@pytest.mark.parametrize(
    "friction", [wb.CoulombFriction(kinetic=0.36), wb.SmoothedFriction(kinetic=0.36)]
)
@pytest.mark.parametrize("drive_speed", [7.6, 40.0])
def test_a_released_brake_locks_nothing(friction, drive_speed):
    """Beyond the release speed no force presses the wedge, whatever its angle."""
    system = wb.paper.system().replace(friction=friction, drive_speed=drive_speed, slope=-40.0)
    found = wb.stability(system)
    assert found.self_locking == "kinetic"
    assert found.forward.released
    assert not found.forward.locked
    assert found.damping == 0.1
    assert found.stable
    assert found.forward.hopf_slope is None
    chart = wb.stability_map(system, eta=[system.groups.eta]).isel(eta=0)
    assert bool(chart.stable)
    assert not bool(chart.locked)
    assert float(chart.growth) == pytest.approx(-0.05 / 100.0)
    assert bool(chart.released)
    free = system.replace(amplitude=0.0)
    assert wb.simulate(free, periods=3).attrs["status"] == "completed"


@pytest.mark.parametrize("as_machine", [False, True])
@pytest.mark.parametrize(
    ("slope", "state", "word"),
    [(-1.0, "grows", "unstable"), (0.0, "does not decay", "neutral"), (1.0, "decays", "stable")],
)
def test_without_damping_the_slope_decides(slope, state, word, as_machine) -> None:
    """With constant friction and a constant force nothing damps or feeds vibration."""
    driveline = wb.BrakedDriveline(
        driveline=wb.Driveline(inertia=1.0, stiffness=100.0, damping=0.0, drive_speed=3.0),
        brake=wb.ConventionalBrake(radius=0.2),
        friction=wb.CoulombFriction(kinetic=0.3),
        actuation=wb.Actuation(initial_force=300.0, slope=slope),
        excitation=wb.HarmonicTorque(amplitude=0.0, frequency=1.0),
    )
    found = wb.stability(driveline.machine if as_machine else driveline)
    assert (found.critical if as_machine else found.forward).state == state
    assert found.stable == (word == "stable")
    assert f"Linearly {word}." in found.verdict
    # Only vibration that grows needs a limit.
    assert ("Growing vibration" in found.verdict) == (word == "unstable" and not as_machine)


RISE = 0.2  # viscous part of the laws below [s/m]


class _Copied(_TwoCoefficients, SetValuedFriction):
    """A Stribeck curve with a viscous part, on the bases of ``StribeckFriction``."""

    def kinetic_at(self, speed):
        return self.kinetic + (self.static - self.kinetic) * math.exp(-speed) + RISE * speed


class _Derived(wb.StribeckFriction):
    def kinetic_at(self, speed):
        return super().kinetic_at(speed) + RISE * speed


@pytest.mark.parametrize("static", [0.3, 0.4])
@pytest.mark.parametrize(
    "law", [_Copied, lambda **given: _Derived(speed=1.0, **given)], ids=["copied", "derived"]
)
def test_a_curve_without_a_static_peak_is_not_constant_for_that(law, static) -> None:
    """d = c + R^2 F mu'(v) with mu' = -(mu_s - mu_k) exp(-v) + RISE, and J = R = F = 1."""
    speed, damping = 0.5, 0.1
    friction = law(kinetic=0.3, static=static)
    assert not friction.constant
    machine = single(
        contact(friction=friction, base_speed=-speed), stiffness=100.0, damping=damping
    )
    rise = RISE - (static - 0.3) * math.exp(-speed)
    assert wb.stability(machine).growth_rate == pytest.approx(-0.5 * (damping + rise), rel=1e-8)
    assert wb.StribeckFriction(kinetic=0.3, static=0.3, speed=1.0).constant


@pytest.mark.parametrize("friction", ["coulomb", "smoothed"])
def test_the_map_tells_where_the_brake_is_released(friction) -> None:
    """At 80 rad/s nothing presses the brake for F_a0 + delta 80 <= 0, however well it decays."""
    from wedgebrake.figures.data.class_map import RELEASED, stability_map

    system = wb.paper.system(friction=friction).replace(drive_speed=80.0)
    etas, alphas = np.linspace(-60.0, 12.0, 25), np.array([1.4, 1.8])
    found = wb.stability_map(system, eta=etas, alpha=alphas)
    force, slopes = system.actuation.initial_force, [
        system.replace(eta=eta).actuation.slope for eta in etas
    ]  # fmt: skip
    released = force + 80.0 * np.array(slopes) <= 0.0
    assert released.any()
    assert not released.all()
    np.testing.assert_array_equal(found.released, np.column_stack([released, released]))
    np.testing.assert_array_equal(
        stability_map(found).codes == RELEASED, np.array([released, released])
    )


def test_the_map_of_a_machine_tells_where_nothing_is_pressed() -> None:
    machine = single(
        contact(friction=wb.CoulombFriction(kinetic=0.3), force=300.0), stiffness=100.0, speed=5.0
    )
    (name,) = machine.contact_names
    found = wb.stability_map(machine, {f"{name}.slope": [-80.0, -61.0, -59.0, 0.0]})
    assert found.released.values.tolist() == [True, True, False, False]
