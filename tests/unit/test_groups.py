"""Normalised groups: definitions by hand, exact round trips, and what `replace` may touch."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

import wedgebrake as wb

FINITE = st.floats(-1e3, 1e3).filter(lambda x: x == 0.0 or abs(x) > 1e-6)
POSITIVE = st.floats(1e-3, 1e3)
SYSTEM = wb.BrakedDriveline(
    driveline=wb.Driveline(inertia=1.3, damping=0.17, stiffness=9.1e3, drive_speed=0.7),
    brake=wb.WedgeBrake(angle=0.37, radius=0.23),
    friction=wb.CoulombFriction(kinetic=0.28, static=0.31),
    actuation=wb.Actuation(initial_force=310.0, slope=-37.0),
    excitation=wb.HarmonicTorque(amplitude=480.0, frequency=9.7),
)
SI_OF = {"eta": "slope", "f": "frequency", "F0": "amplitude", "alpha": "angle"}


def flat(system):
    return {
        f"{part}.{name}": value
        for part, table in system.as_dict().items()
        for name, value in table.items()
    }


def test_definitions():
    g = SYSTEM.groups
    assert g.eta == pytest.approx(-37.0 * 0.23 * 0.28 / 0.17, rel=1e-15)
    assert g.f == pytest.approx(9.7 / (math.sqrt(9.1e3 / 1.3) / (2 * math.pi)), rel=1e-15)
    assert g.F0 == pytest.approx(310.0 / (480.0 / (0.28 * 0.23)), rel=1e-15)
    assert g.alpha == pytest.approx(math.tan(0.37) / 0.28, rel=1e-15)
    assert g.loss_factor == pytest.approx(0.17 / math.sqrt(9.1e3 * 1.3), rel=1e-15)
    assert g.static_ratio == pytest.approx(0.31 / 0.28, rel=1e-15)
    assert g.drive == pytest.approx(0.7 * math.sqrt(9.1e3 * 1.3) / 480.0, rel=1e-15)


def test_the_papers_values():
    """delta = eta/0.6 and f = 0.63 is 63 rad/s (docs/equations.md, "The paper's parameters")."""
    system = wb.paper.system(eta=-24, f=0.63, F0=0.036, alpha=1.18)
    assert system.actuation.slope == pytest.approx(-24 / 0.6, rel=1e-15)
    assert system.excitation.angular_frequency == pytest.approx(63.0, rel=4e-16)
    assert system.excitation.amplitude == pytest.approx(500.0, rel=1e-15)
    assert math.tan(system.brake.angle) == pytest.approx(0.354, rel=4e-16)


@given(eta=FINITE, f=POSITIVE, F0=POSITIVE, alpha=POSITIVE)
def test_groups_in_are_groups_out_to_the_last_bit(eta, f, F0, alpha):
    groups = SYSTEM.replace(eta=eta, f=f, F0=F0, alpha=alpha).groups
    assert (groups.eta, groups.f, groups.F0, groups.alpha) == (eta, f, F0, alpha)


@given(slope=FINITE, frequency=POSITIVE, amplitude=POSITIVE, angle=st.floats(1e-3, 1.5))
def test_si_to_groups_to_si_to_the_last_bit(slope, frequency, amplitude, angle):
    system = SYSTEM.replace(slope=slope, frequency=frequency, amplitude=amplitude, angle=angle)
    groups = {name: getattr(system.groups, name) for name in SI_OF}
    assert system.replace(**groups) == system


@given(eta=FINITE)
def test_a_group_computed_afresh_agrees(eta):
    """The remembered group is the one that the SI values give, to rounding."""
    system = SYSTEM.replace(eta=eta)
    again = wb.BrakedDriveline(**{name: getattr(system, name) for name in system.as_dict()})
    assert again.groups.eta == pytest.approx(eta, rel=1e-15, abs=1e-300)
    assert again == system


@pytest.mark.parametrize(("group", "si"), SI_OF.items())
def test_a_group_changes_one_si_value_and_nothing_else(group, si):
    before, after = flat(SYSTEM), flat(SYSTEM.replace(**{group: 0.8}))
    changed = {name for name in before if before[name] != after[name]}
    assert {name.split(".")[1] for name in changed} == {si}


def test_stated_groups_survive_other_changes_only_while_true():
    system = SYSTEM.replace(eta=-30.1, F0=0.07)
    assert system.replace(amplitude=1.0).groups.eta == -30.1
    assert system.replace(amplitude=1.0).groups.F0 != 0.07
    assert system.replace(damping=0.34).groups.eta == pytest.approx(-15.05)


def test_groups_apply_after_si_values():
    system = SYSTEM.replace(eta=-10.0, damping=0.5)
    assert system.driveline.damping == 0.5
    assert system.actuation.slope == pytest.approx(-10.0 * 0.5 / (0.23 * 0.28))


def test_groups_that_are_not_defined_are_none():
    system = SYSTEM.replace(
        damping=0.0, stiffness=0.0, amplitude=0.0, brake=wb.ConventionalBrake(radius=0.2)
    )
    groups = system.groups
    assert (groups.eta, groups.f, groups.F0, groups.alpha, groups.loss_factor) == (None,) * 5


@pytest.mark.parametrize(
    ("change", "group", "words"),
    [
        ({"damping": 0.0}, {"eta": -3.0}, "driveline.damping is 0"),
        ({"kinetic": 0.0}, {"eta": -3.0}, "friction.kinetic is 0"),
        ({"stiffness": 0.0}, {"f": 0.5}, "driveline.stiffness is 0"),
        ({"initial_force": 0.0}, {"F0": 0.5}, "initial_force or kinetic is 0"),
        ({"brake": wb.ConventionalBrake(radius=0.2)}, {"alpha": 1.2}, "not a WedgeBrake"),
        ({}, {"F0": 0.0}, "excitation.amplitude = 0"),
        ({}, {"f": -1.0}, "greater than 0"),
        ({}, {"alpha": 0.0}, "greater than 0"),
        ({}, {"eta": math.nan}, "finite"),
        ({}, {"eta": True}, "finite"),
        ({}, {"eta": 1.0, "slope": 2.0}, "Give one"),
    ],
)
def test_groups_that_cannot_be_set_say_why(change, group, words):
    system = SYSTEM.replace(**change) if change else SYSTEM
    with pytest.raises(wb.InputError, match=words):
        system.replace(**group)


def test_a_wedge_that_locks_itself_has_a_small_angle():
    """tan(angle) = alpha mu_k, also for alpha below 1."""
    angle = SYSTEM.replace(alpha=0.9).brake.angle
    assert math.tan(angle) == pytest.approx(0.9 * SYSTEM.friction.kinetic, rel=1e-14)


def test_replace_takes_whole_parts_and_suggests_names():
    brake = wb.BandBrake(wrap_angle=3.0, radius=0.1)
    assert SYSTEM.replace(brake=brake).brake == brake
    with pytest.raises(wb.InputError, match="Did you mean 'stiffness'"):
        SYSTEM.replace(stifness=1.0)
    assert SYSTEM.replace(wrap_angle=2.0, brake=brake).brake.wrap_angle == 2.0
