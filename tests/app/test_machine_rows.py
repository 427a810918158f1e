"""Rows of the parts of machines: words, units, choices and sliders."""

from __future__ import annotations

import numpy as np
import pytest

import wedgebrake as wb
from wedgebrake.explorer.core.fields import Row, sections
from wedgebrake.explorer.core.snapshot import take_snapshot
from wedgebrake.explorer.core.state import PageState, axes
from wedgebrake.explorer.core.studies import study_of
from wedgebrake.explorer.core.verdict import verdict
from wedgebrake.model.studies.study import RunSettings, Study

MOTOR, WHEEL = wb.Inertia("motor", 0.2), wb.Inertia("wheel", 1.0)
SHAFT = wb.Shaft("wheel", "ground", 100.0, damping=1.0, name="spring")


def _state(**parts) -> PageState:
    machine = wb.Machine(**{"inertias": [MOTOR, WHEEL], "shafts": [SHAFT], **parts})
    return PageState.of(Study(machine, RunSettings(duration=1.0)))


def _rows(state: PageState) -> dict[str, Row]:
    return {row.name: row for rows in sections(state).values() for row in rows}


# With the output in N m, K_p e has the unit of the output.
UNITS = {
    "wheel.angle": ("rad", "N m/rad", "N m/(rad s)", "N m s/rad"),
    "wheel.speed": ("rad/s", "N m s/rad", "N m/rad", "N m s²/rad"),
    "spring.torque": ("N m", "N m/(N m)", "N m/(N m s)", "N m s/(N m)"),
}


@pytest.mark.parametrize("measured", UNITS)
def test_gains_have_units_that_follow_from_what_is_measured(measured):
    loop = wb.Controller(
        "loop", {measured: 1.0}, 2.0, "motor.torque", 1.0, 1.0, 1.0, 0.01, (-5.0, 5.0)
    )
    rows = _rows(_state(controllers=[loop]))
    names = ("setpoint", "proportional", "integral", "derivative")
    assert tuple(rows[f"loop.{name}"].unit for name in names) == UNITS[measured]
    assert rows["loop.limits.0"].unit == rows["loop.limits.1"].unit == "N m"


def test_signals_have_the_unit_of_what_they_replace():
    road = wb.Driven("road", wb.Harmonic(2.0, 1.0) + 30.0)
    chirp = wb.Chirp(5.0, 1.0, 20.0, 4.0)
    rows = _rows(_state(
        inertias=[MOTOR, WHEEL, road], torques=[wb.Torque("motor", chirp, name="shaker")],
    ))  # fmt: skip
    assert rows["road.speed.signals.0.amplitude"].unit == "rad/s"
    assert rows["shaker.amplitude"].unit == "N m"
    assert rows["shaker.start"].unit == rows["shaker.end"].unit == "Hz"
    # The factor of a torque over a speed has no unit.
    throttled = wb.OverSpeed([0.0, 9.0], [4.0, 0.0]) * (1.0 + wb.Harmonic(0.5, 2.0))
    state = _state(torques=[wb.Torque("motor", throttled, name="gas")])
    name = "gas.scale.signals.1.amplitude"
    assert _rows(state)[name].unit == ""
    assert state.edited(**{name: 0.7}).value(name) == 0.7
    # Factors of a product have units of their own.
    product = wb.Harmonic(2.0, 1.0) * wb.Ramp(0.0, 1.0, 2.0)
    rows = _rows(_state(torques=[wb.Torque("motor", product, name="shaker")]))
    assert rows["shaker.signals.0.amplitude"].unit == ""


def test_values_of_which_few_are_allowed_are_chosen():
    clutch = wb.OneWayClutch("motor", "wheel", "freewheel")
    chirp = wb.Torque("motor", wb.Chirp(5.0, 1.0, 20.0, 4.0), name="shaker")
    state = _state(contacts=[clutch], torques=[chirp])
    for name, value in (("freewheel.direction", -1.0), ("shaker.law", "log")):
        row = _rows(state)[name]
        assert row.kind == "choice"
        assert value in dict(row.choices)
        edited = state.edited(**{name: value})
        assert edited.value(name) == value
        assert name not in axes(state.system)
    assert state.edited(**{"freewheel.direction": -1.0}).system.contacts[0].direction == -1.0


def test_values_that_cannot_change_have_no_row():
    loop = wb.Controller("loop", {"wheel.speed": 1.0}, 2.0, "motor.torque", 1.0)
    geared = wb.Shaft("motor", "wheel", 10.0, ratio=2.0, name="geared")
    rows = _rows(_state(controllers=[loop], shafts=[SHAFT, geared]))
    assert not {"loop.delay", "loop.derivative", "spring.ratio"} & rows.keys()
    assert rows["geared.ratio"].value == 2.0
    sampled = wb.Controller(
        "loop", {"wheel.speed": 1.0}, 2.0, "motor.torque", 1.0, sample_time=0.01
    )
    rows = _rows(_state(controllers=[sampled]))
    assert {"loop.delay", "loop.derivative", "loop.sample_time"} <= rows.keys()
    assert rows["loop.delay"].whole


def test_a_part_that_reverses_the_direction_has_a_slider_with_its_sign():
    row = _rows(_state(joints=[wb.Gear("motor", "wheel", -3.0, name="gear")]))["gear.ratio"]
    assert row.low <= row.value == -3.0 <= row.high < 0.0


def test_initial_values_that_follow_by_joints_are_shown_and_not_edited():
    bodies = [wb.Inertia("sun", 0.1, speed=50.0), wb.Inertia("ring", 0.2), wb.Inertia("arm", 1.0,
              speed=20.0)]  # fmt: skip
    state = _state(inertias=bodies, shafts=[], joints=[wb.Planetary("sun", "ring", "arm", 1.5)])
    rows = _rows(state)
    ends = [name for name in rows if name.endswith((".angle", ".speed"))]
    followers = {name for name in ends if not rows[name].enabled}
    assert {name.partition(".")[2] for name in followers} == {"angle", "speed"}
    assert len(followers) == 2
    # sun + z ring = (1 + z) arm at all times, whichever of them is edited.
    for name in set(ends) - followers:
        changed = state.edited(**{name: 7.0})
        sun, ring, arm = (
            np.array([changed.value(f"{one}.{end}") for end in ("angle", "speed")])
            for one in ("sun", "ring", "arm")
        )
        np.testing.assert_allclose(sun + 1.5 * ring, 2.5 * arm, rtol=0.0, atol=1e-12)
        assert changed.value(name) == 7.0
    assert wb.read_study(study_of(state).to_toml().encode()).system == state.system


def test_a_machine_without_contacts_has_no_verdict_on_sticking():
    torque = wb.Torque("motor", wb.Harmonic(1.0, 3.0), name="drive")
    shaft = wb.Shaft("motor", "wheel", 50.0, damping=1.0, gap=(-0.01, 0.01))
    state = _state(shafts=[SHAFT, shaft], torques=[torque])
    said = verdict(state, take_snapshot(state, settle=True))
    assert not {"sticks", "share", "torque", "locking"} & {one["name"] for one in said["tiles"]}
    assert "stick" not in said["headline"]


@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_the_torque_curve_of_a_freewheel(direction):
    """One direction locks, the other one has the drag."""
    clutch = wb.OneWayClutch("wheel", "ground", "freewheel", direction, drag=0.5)
    state = _state(contacts=[clutch])
    snapshot = take_snapshot(state)
    forward, backward = snapshot.figures.torque.directions
    locked, free = (forward, backward) if direction > 0.0 else (backward, forward)
    assert locked.torque.size == 0
    np.testing.assert_array_equal(free.torque, -direction * 0.5)
    assert np.isinf(snapshot.figures.torque.holding[0 if direction < 0.0 else 1])
    assert list(snapshot.discs.torques) == ["freewheel"]


def test_one_body_with_a_stop_is_drawn_as_a_machine():
    stop = wb.Shaft("wheel", "ground", 50.0, name="stop", gap=(-0.1, 0.1))
    snapshot = take_snapshot(_state(inertias=[WHEEL], shafts=[stop]))
    assert list(snapshot.discs.angles) == ["wheel"]


def test_the_cursor_of_the_torque_is_at_the_sliding_velocity():
    """Of a clutch between two bodies, and of a brake on a base that turns."""
    parts = {"brake": wb.ConventionalBrake(radius=0.1), "friction": wb.CoulombFriction(kinetic=0.3),
             "actuation": wb.Actuation(initial_force=10.0)}  # fmt: skip
    contacts = [
        wb.Contact("motor", b="wheel", name="clutch", **parts),
        wb.Contact("wheel", name="belt", base_speed=4.0, **parts),
    ]
    state = _state(contacts=contacts, inertias=[wb.Inertia("motor", 0.2, speed=30.0), WHEEL])
    for name in ("clutch", "belt"):
        found = take_snapshot(state.edited(of_contact=name)).figures
        run = wb.simulate(state.system, duration=1.0, times=found.history.time)
        np.testing.assert_allclose(
            found.sliding, run["sliding_velocity"].sel(contact=name), rtol=0.0, atol=1e-9
        )
