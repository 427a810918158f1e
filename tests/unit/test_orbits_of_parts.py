"""Orbits of machines with joints and driven bodies: each equals one without them."""

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import pytest

import wedgebrake as wb
from machines import contact as a_contact
from wedgebrake.errors import InputError
from wedgebrake.orbits.bifurcation_types import Kind

STIFFNESS, DAMPING, FREQUENCY, SWING = 100.0, 0.5, 1.7, 0.3
OMEGA = 2.0 * math.pi * FREQUENCY
# Torque of the spring end that swings by SWING sin(OMEGA t).
PUSH = wb.Harmonic(
    SWING * math.hypot(STIFFNESS, DAMPING * OMEGA), FREQUENCY,
    math.atan2(DAMPING * OMEGA, STIFFNESS),
)  # fmt: skip
SWINGING = wb.Harmonic(SWING * OMEGA, FREQUENCY, math.pi / 2.0)


class Pair(NamedTuple):
    """A machine, and one with the same motion of its body.

    ratio : of the largest amplitudes of the two
    """

    machine: wb.Machine
    other: wb.Machine
    ratio: float = 1.0


def brake(on: str, b: str = "ground", radius: float = 1.0, base_speed: float = 0.0) -> wb.Contact:
    return wb.Contact(
        on, b, name="brake", brake=wb.ConventionalBrake(radius=radius),
        friction=wb.CoulombFriction(kinetic=0.3, static=0.4),
        actuation=wb.Actuation(initial_force=10.0), base_speed=base_speed,
    )  # fmt: skip


def sprung(
    contact: wb.Contact,
    inertia: float = 3.0,
    end: str = "ground",
    others: Sequence[wb.Inertia | wb.Driven] = (),
    **more: Any,
) -> wb.Machine:
    """A body on a spring, perhaps with others."""
    damping, rest = more.pop("damping", DAMPING), more.pop("rest", 0.0)
    spring = wb.Shaft("body", end, STIFFNESS, damping=damping, rest=rest, name="spring")
    body = wb.Inertia("body", inertia, speed=more.pop("speed", 0.0))
    return wb.Machine(inertias=[body, *others], shafts=[spring], contacts=[contact], **more)


SHAKEN = {"torques": [wb.Torque("body", wb.Harmonic(30.0, FREQUENCY))]}
PUSHED = {"torques": [wb.Torque("body", PUSH)]}
PAIRS = {
    "a brake behind a gear": lambda: Pair(
        sprung(
            brake("motor"), 1.0, joints=[wb.Gear("motor", "body", 2.0, name="gear")],
            others=[wb.Inertia("motor", 0.5)], **SHAKEN,
        ),
        sprung(brake("body", radius=2.0), **SHAKEN),
        ratio=2.0,
    ),
    "two bodies that are one": lambda: Pair(
        sprung(
            brake("disc"), 1.0, joints=[wb.Rigid("disc", "body", name="rigid")],
            others=[wb.Inertia("disc", 2.0)], **SHAKEN,
        ),
        sprung(brake("body"), **SHAKEN),
    ),
    "a planetary gear whose ring stands": lambda: Pair(
        # The sun turns by 1 + 2 per turn of the carrier.
        sprung(
            brake("body"), 1.2, joints=[wb.Planetary("sun", "ring", "body", ratio=2.0, name="set")],
            others=[wb.Inertia("sun", 0.2), wb.Driven("ring", 0.0)], **SHAKEN,
        ),
        sprung(brake("body"), 1.2 + 9.0 * 0.2, **SHAKEN),
        ratio=3.0,
    ),
    "a moved spring end": lambda: Pair(
        sprung(brake("body"), end="end", others=[wb.Driven("end", SWINGING)]),
        sprung(brake("body"), **PUSHED),
    ),
    "a spring end that turns": lambda: Pair(
        sprung(
            brake("body"), end="end", others=[wb.Driven("end", SWINGING + 5.0, angle=0.7)],
            speed=5.0, rest=0.2,
        ),
        sprung(brake("body", base_speed=-5.0), rest=0.2 - 0.7, **PUSHED),
    ),
    "a spring end moved by a gear": lambda: Pair(
        sprung(
            brake("body"), end="rack", joints=[wb.Gear("drive", "rack", 2.0, name="gear")],
            others=[wb.Inertia("rack", 0.1), wb.Driven("drive", 2.0 * SWINGING)],
        ),
        sprung(brake("body"), **PUSHED),
        ratio=math.nan,
    ),
    "a belt": lambda: Pair(
        # At rest at the start, the body would vibrate freely, slower than the belt.
        sprung(
            brake("body", "belt"), others=[wb.Driven("belt", 0.2, angle=3.0)], speed=0.2,
            damping=0.0,
        ),
        sprung(brake("body", base_speed=0.2), speed=0.2, damping=0.0),
    ),
    "a belt on a pulley": lambda: Pair(
        sprung(
            wb.Contact(**{**dict(brake("body", "pulley")), "ratio": 2.0}), damping=0.0, speed=0.2,
            others=[wb.Driven("pulley", 0.1)],
        ),
        sprung(brake("body", base_speed=0.2), speed=0.2, damping=0.0),
    ),
    "a pulled block": lambda: Pair(
        sprung(
            brake("body"), end="end", others=[wb.Driven("end", 0.2, angle=3.0)], speed=0.2,
            damping=0.0,
        ),
        sprung(brake("body", base_speed=-0.2), rest=-3.0, damping=0.0),
    ),
}  # fmt: skip
FORCES = {"brake.initial_force": (10.0, 70.0)}
STEADY = (
    "a spring end that turns",
    "a belt",
    "a belt on a pulley",
    "a pulled block",
)  # these stick anyway, or never
STICKING = [name for name in PAIRS if name not in STEADY]


@pytest.mark.parametrize("name", PAIRS)
class TestOrbit:
    def test_is_that_of_the_other_machine(self, name: str) -> None:
        pair = PAIRS[name]()
        found, wanted = wb.orbit(pair.machine), wb.orbit(pair.other)
        assert (found.order, found.stable) == (wanted.order, wanted.stable)
        assert found.period == pytest.approx(wanted.period, rel=1e-12)
        np.testing.assert_allclose(found.multipliers, wanted.multipliers, atol=1e-11)
        assert found.stick_share == pytest.approx(wanted.stick_share, abs=1e-11)
        for measure in ("velocity_amplitude", "angle_amplitude"):
            if not math.isnan(pair.ratio):
                size = pair.ratio * getattr(wanted, measure)
                assert getattr(found, measure) == pytest.approx(size, rel=1e-11)

    def test_repeats(self, name: str) -> None:
        """One period later, all is as before up to a turn of the machine as a whole."""
        machine = PAIRS[name]().machine
        found = wb.orbit(machine)
        start = found.initial
        end = wb.final_state(wb.simulate(machine, found.period, initial=start))
        for one in machine.inertias:
            assert end.speeds[one.name] == pytest.approx(start.speeds[one.name], abs=1e-10)
        turns = {one: end.angles[one] - start.angles[one] for one in end.angles} | {"ground": 0.0}
        assert turns["body"] == pytest.approx(turns[machine.shafts[0].b], abs=1e-10)


@pytest.mark.parametrize("name", STICKING)
def test_sticks_begin_where_they_do_in_the_other_machine(name: str) -> None:
    """On the branch over the force of the brake."""
    pair = PAIRS[name]()
    found, wanted = (
        next(one for one in wb.continuation(wb.orbit(machine), FORCES) if one.bifurcation)
        for machine in (pair.machine, pair.other)
    )
    assert found.bifurcation.kind == wanted.bifurcation.kind
    assert found.values == pytest.approx(wanted.values, rel=1e-9)


def test_phases_are_relative_to_the_driven_body() -> None:
    """The torque of the spring, which also damps, is ahead of its angle."""
    pair = PAIRS["a moved spring end"]()
    found, wanted = (
        wb.response_curve(
            machine,
            {"brake.initial_force": (5.0, 20.0)},
            levels={"body.inertia": [2.0, 3.0]},
            points=20,
        )
        for machine in (pair.machine, pair.other)
    )
    assert found.attrs["phase_reference"] == "angle of end"
    for level in (2.0, 3.0):
        # The branches begin at the same force; their further points differ.
        one, other = (
            curve.sel(inertia="body", point=curve["body.inertia"] == level).isel(point=0)
            for curve in (found, wanted)
        )
        assert float(one["brake.initial_force"]) == float(other["brake.initial_force"])
        for name, turned in (("angle_fundamental", 0.0), ("angle_phase", PUSH.phase)):
            assert float(one[name]) == pytest.approx(float(other[name]) + turned, abs=1e-10)


@pytest.mark.parametrize("speed", [5.0, SWINGING + 5.0], ids=["constant", "swinging"])
def test_windings_are_refused(speed: Any) -> None:
    """The spring winds up."""
    machine = sprung(brake("body"), end="end", others=[wb.Driven("end", speed)])
    grounded = wb.Shaft("body", "ground", 10.0, name="other")
    with pytest.raises(wb.InputError) as found:
        wb.orbit(machine.replace(shafts=[*machine.shafts, grounded]))
    assert found.value.name == "end.speed"


def _through_a_gear(torques: Any, **belt: Any) -> wb.Machine:
    """Two bodies behind a gear, with springs on both, and a brake on the one that follows."""
    return wb.Machine(
        inertias=[wb.Inertia("a", 1.0), wb.Inertia("b", 2.0)],
        joints=[wb.Gear("a", "b", 2.0, name="gear")],
        shafts=[wb.Shaft("a", "ground", 20.0, 0.05), wb.Shaft("b", "ground", 40.0, 0.05)],
        contacts=[a_contact("a", name="brake", **belt)], torques=torques,
    )  # fmt: skip


@pytest.mark.parametrize(
    "machine",
    [
        _through_a_gear([wb.Torque("a", wb.Harmonic(5.0, 0.3))], force=5.0),
        _through_a_gear([], force=20.0, slope=-4.0, base_speed=1.0),
    ],
    ids=["driven", "self-excited"],
)
def test_branches_over_the_ratio_of_a_joint(machine: wb.Machine) -> None:
    """Each point is the orbit of its own machine, whose bodies turn in its ratio."""
    found = wb.branches(machine, {"gear.ratio": (1.6, 2.6)}, switch=0)
    assert found.sizes["point"] < 100
    ratios = found["gear.ratio"].to_numpy()
    for name in ("angle", "velocity"):
        values = found[name].isel({"return": 0}).sel(inertia=["a", "b"]).to_numpy()
        np.testing.assert_allclose(values[:, 0], ratios * values[:, 1], rtol=1e-9, atol=1e-12)
    for at in (0, len(ratios) // 2, -1):
        own = wb.orbit(machine.replace({"gear.ratio": float(ratios[at])}))
        point = found.isel(point=at)
        assert float(point["period"]) == pytest.approx(own.period, rel=1e-9)
        for name in ("velocity_amplitude", "peak_torque"):
            np.testing.assert_allclose(point[name], getattr(own, name), rtol=1e-8)
        multipliers = point["multiplier_real"] + 1j * point["multiplier_imag"]
        np.testing.assert_allclose(
            np.sort(np.abs(multipliers)), np.sort(np.abs(own.multipliers)), atol=1e-7
        )


SPRING = wb.Shaft("mass", "ground", 40.0, 1.0, name="spring")
TURN = 2.0 * math.pi
GRAZING: dict[str, tuple[dict[str, Any], float, float]] = {
    # Parts, damping while nothing is reached, and the amplitude of the angle that reaches it first.
    "two stops": (
        {"shafts": [SPRING, wb.Shaft("mass", "ground", 1e3, 1.0, gap=(-1.0, 1.0))]}, 1.0, 1.0,
    ),
    "one stop": ({"shafts": [SPRING, wb.Shaft("mass", "ground", 1e3, gap=(-5.0, 1.0))]}, 1.0, 1.0),
    "a stage": (
        {"shafts": [wb.Shaft("mass", "ground", wb.Stages([-1.0, 1.5], [400.0, 40.0, 300.0]), 1.0)]},
        1.0, 1.0,
    ),
    "a torque over the speed": (
        {
            "shafts": [SPRING],
            "torques": [wb.Torque("mass", wb.OverSpeed([-9.0, 8.0, 9.0], [0.0, 0.0, -5.0]))],
        },
        1.0, 8.0 / TURN,
    ),
    "a torque over the speed with a factor": (
        {
            "shafts": [SPRING],
            "torques": [
                wb.Torque(
                    "mass",
                    wb.OverSpeed([-9.0, 8.0, 9.0], [0.0, 0.0, -5.0])
                    * (1.0 + wb.Harmonic(0.5, 1.0)),
                )
            ],
        },
        1.0, 8.0 / TURN,
    ),
    "a limit of a controller": (
        {
            "shafts": [SPRING],
            "controllers": [
                wb.Controller(
                    "loop", {"mass.speed": 1.0}, 0.0, "mass.torque", proportional=0.5,
                    limits=(-2.0, 9.0),
                )
            ],
        },
        1.5, 4.0 / TURN,
    ),
}  # fmt: skip


@pytest.mark.parametrize("kind", GRAZING)
def test_a_branch_locates_where_its_orbit_first_reaches_another_piece(kind: str) -> None:
    """Before, the machine is linear: the amplitude of its torque follows from its impedance."""
    parts, damping, reached = GRAZING[kind]
    drive = wb.Torque("mass", wb.Harmonic(2.0, 1.0), name="drive")
    parts = parts | {"torques": [drive, *parts.get("torques", [])]}
    machine = wb.Machine(inertias=[wb.Inertia("mass", 1.0)], **parts)
    branch = wb.continuation(wb.orbit(machine), {"drive.amplitude": (2.0, 8.5)})
    points = list(branch)
    expected = reached * abs(complex(40.0 - TURN**2, damping * TURN))
    first = branch.bifurcations[0]
    # Whatever the rounding, both stops are reached at once.
    assert len([one for one in branch.bifurcations if one.value < 1.001 * expected]) == 1
    assert first.bifurcation.kind is Kind.GRAZING
    assert first.value == pytest.approx(expected, rel=1e-11)
    apart = [one for one in points if abs(one.value - expected) > 1e-9 * expected]
    for point in apart:
        assert (point.measures.events > 0) == (point.value > expected)
    with pytest.raises(InputError) as caught:
        wb.boundary(first, **{"drive.amplitude": (2.0, 8.5), "drive.frequency": (0.9, 1.1)})
    assert caught.value.name == "point"
    value = f"{expected:.6g}"
    with pytest.warns(UserWarning, match=rf"grazing at drive\.amplitude = {value}"):
        curves = wb.boundaries(
            machine, **{"drive.amplitude": (2.0, 8.5), "drive.frequency": (0.9, 1.1)}
        )
    assert all(one.attrs["bifurcation"] != "grazing" for one in curves)
