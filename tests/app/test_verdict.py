"""The verdict in words, on real motions."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from functools import cache

import pytest
from states import new_state

import wedgebrake as wb
from wedgebrake.analysis.responses.torque import BrakeTorque
from wedgebrake.explorer.core.presets import preset
from wedgebrake.explorer.core.snapshot import Snapshot, take_snapshot
from wedgebrake.explorer.core.state import PageState
from wedgebrake.explorer.core.verdict import verdict
from wedgebrake.model.studies.study import RunSettings, Study
from wedgebrake.solvers.status import Status

TILES = ["forward", "backward", "locking", "motion", "sticks", "torque", "share"]


_PAPER = wb.paper.system
MACHINES = {
    "stable": _PAPER(eta=0.0),
    "synchronous": _PAPER(eta=-12.0),
    "six periods": _PAPER(),
    "two periods": _PAPER(eta=-60.0),
    "chaotic": _PAPER(eta=-30.0),
    "quasi-periodic": _PAPER(brake="conventional"),
    "locked": _PAPER(alpha=0.9, eta=-1.0),
    "locked at rest": _PAPER(alpha=1.05, static=0.33),
    "at rest": _PAPER(F0=5.0, eta=0.0),
    "diverged": _PAPER(release=False, eta=-60.0),
    "no damping": _PAPER().replace(damping=0.0),
    "no spring": _PAPER().replace(stiffness=0.0, slope=0.0),
    "no friction": _PAPER().replace(kinetic=0.0, static=0.0),
    "settling": _PAPER(f=1.0),
    "turning": _PAPER().replace(drive_speed=1.0, slope=0.0),
}


@cache
def _seen(name: str) -> tuple[PageState, Snapshot]:
    state = new_state(MACHINES[name])
    seen = replace(take_snapshot(state, settle=True), braking=BrakeTorque(3.2, 38.4, 333.3))
    if name == "settling":
        seen = replace(seen, motion=wb.motion(state.system, 50, limit=200))
    return state, seen


def _said(name: str, **changes) -> dict:
    state, seen = _seen(name)
    return verdict(state, replace(seen, **changes))


def _tile(said: dict, name: str) -> dict:
    return next(tile for tile in said["tiles"] if tile["name"] == name)


@pytest.mark.parametrize("name", MACHINES)
def test_a_verdict_is_plain_and_complete(name):
    said = _said(name)
    assert json.loads(json.dumps(said)) == said
    assert [tile["name"] for tile in said["tiles"]] == TILES
    assert said["headline"]
    for tile in said["tiles"]:
        assert all(tile[key] for key in ("title", "value", "detail", "hint"))
        assert tile["tone"] in ("good", "warn", "bad", "neutral")
        assert "nan" not in tile["value"] + tile["detail"] + tile["hint"]


@pytest.mark.parametrize(
    ("name", "tile", "part", "expected"),
    [
        # The margin, in eta or in the slope, and what bounds the growth.
        ("six periods", "forward", "detail", "−23.9 in η"),
        ("stable", "forward", "detail", "+0.054 in η"),
        ("no damping", "forward", "detail", "−40 N s/rad"),
        ("six periods", "forward", "hint", "7.5 rad/s"),
        ("no spring", "forward", "tone", "good"),  # its speed decays
        # A direction that is locked has no stability.
        ("locked", "forward", "tone", "neutral"),
        ("locked", "locking", "tone", "bad"),
        ("locked at rest", "locking", "tone", "warn"),
        ("six periods", "locking", "tone", "good"),
        ("stable", "motion", "tone", "good"),
        ("synchronous", "motion", "tone", "good"),
        ("at rest", "motion", "tone", "good"),
        ("six periods", "motion", "tone", "warn"),
        ("quasi-periodic", "motion", "tone", "warn"),
        ("settling", "motion", "tone", "warn"),
        ("chaotic", "motion", "tone", "bad"),
        ("diverged", "motion", "tone", "bad"),
        ("six periods", "motion", "value", "6T-periodic"),
        ("six periods", "motion", "detail", "510 ms"),
        ("six periods", "sticks", "detail", "0.833"),
        ("two periods", "sticks", "value", "backward"),
        ("at rest", "sticks", "value", "always"),
        ("stable", "sticks", "value", "never"),
        ("six periods", "share", "value", "13 %"),
        ("stable", "share", "value", "0 %"),
        ("six periods", "torque", "detail", "333"),
    ],
)
def test_tiles(name, tile, part, expected):
    assert expected in _tile(_said(name), tile)[part]


def test_a_run_that_met_a_limit_says_so():
    _, seen = _seen("settling")
    cut = replace(seen.motion, kind="undecided", status="event_limit", order=0)
    status = Status.EVENT_LIMIT
    said = _said("settling", motion=cut, status=status.value, message=status.sentence)
    assert "max_events" in _tile(said, "motion")["hint"]


def test_the_torque_stands_beside_that_of_the_conventional_brake():
    _, seen = _seen("six periods")
    comparison = replace(seen, braking=BrakeTorque(0.0, 29.12, 40.0))
    tile = _tile(_said("six periods", comparison=comparison), "torque")
    assert (tile["value"], tile["detail"]) == ("38.4 N m", "conventional: 29.1 N m")
    # Rounding is no mean torque.
    braking = BrakeTorque(1e-17, 2.0, 3.6)
    assert "is 0 N m" in _tile(_said("at rest", braking=braking), "torque")["hint"]


def _of(state, tile=None):
    said = verdict(state, take_snapshot(state))
    return said if tile is None else _tile(said, tile)


FALLING = preset("falling-friction").state()


def test_with_a_shaft_the_damping_at_its_speed_decides():
    """Friction that falls with speed makes sliding unstable that constant friction would not."""
    tile = _of(FALLING, "forward")
    assert (tile["tone"], tile["detail"]) == ("warn", "−2.7 N m s/rad at Ω")
    even = FALLING.edited(coefficients=[0.3] * 5, static=0.3)
    assert _of(even, "forward")["tone"] == "good"
    # Beyond the release speed only the driveline damps.
    tile = _of(new_state(_PAPER().replace(drive_speed=20.0)), "forward")
    assert (tile["tone"], tile["detail"]) == ("good", "+0.1 N m s/rad at Ω")
    # Where the brake locks at the speed of the shaft there is no sliding.
    locked = preset("start").state().edited(friction="smoothed", static=0.5, drive_speed=0.1)
    assert _of(locked, "forward")["tone"] == "neutral"


def test_without_a_torque_no_period_of_it_is_named():
    said = _of(FALLING)
    hertz = re.search(r"([\d.]+) Hz", said["headline"])
    assert hertz is not None
    assert float(hertz[1]) == pytest.approx(10.0, rel=0.01)  # its spectrum has lines 0.2 Hz apart
    assert (_tile(said, "motion")["value"], said["tone"]) == ("limit cycle", "warn")
    # However short the periods are that nothing is driven with.
    for hertz in (20.0, 40.0):
        assert _of(FALLING.edited(frequency=hertz), "motion")["value"] == "limit cycle"
    damped = _of(FALLING.edited(damping=20.0, initial_angle=0.0), "motion")
    assert damped["value"] == "steady sliding"
    assert "torque" not in damped["detail"]
    fading = FALLING.edited(coefficients=[0.3] * 5, static=0.3, damping=0.5, periods=20)
    assert _of(fading.edited(initial_velocity=0.5), "motion")["value"] == "steady sliding"
    free = preset("band").state().edited(kinetic=0.25, static=0.25, damping=0.0, drive_speed=30.0)
    assert _of(free, "motion")["value"] == "free vibration"


def test_locked_on_a_turning_shaft():
    """A wedge that locks itself at rest is carried along by a shaft that scheduler forwards."""
    state = preset("start").state().edited(static=0.6, drive_speed=2.0)
    assert take_snapshot(state).motion.kind == "self-locked"
    assert _of(state)["tone"] == "bad"


@pytest.mark.parametrize("changes", [{"shown": 1}, {"frequency": 100.0}, {"frequency": 200.0}])
def test_of_few_vibrations_no_change_is_told(changes):
    tile = _of(FALLING.edited(**changes), "motion")
    assert tile["value"] == "limit cycle"
    for word in ("growing", "shrinking"):
        assert word not in tile["detail"]


def test_of_a_motion_later_than_the_pictures_that_is_told():
    state = preset("start").state().edited(static=0.35, frequency=31.0, periods=120)
    settled = take_snapshot(state, settle=True)
    assert settled.motion.settling > 120
    assert "first 120" in verdict(state, settled)["headline"]
    assert "first 120" not in verdict(state, take_snapshot(state))["headline"]


def test_a_contact_that_sticks_all_the_time_is_not_said_to_slide():
    """A motor that drives a fan through a freewheel: the clutch is engaged, the air slides."""
    machine = wb.Machine(
        inertias=[wb.Inertia("motor", 1.0, speed=1.0), wb.Inertia("fan", 1.0, speed=1.0)],
        contacts=[
            wb.OneWayClutch("motor", "fan", name="freewheel"),
            wb.Drag("fan", linear=1.0, name="air"),
        ],
        torques=[wb.Torque("motor", 2.0, name="drive")],
    )
    state = PageState.of(Study(machine, RunSettings(duration=5.0)))
    snapshot = take_snapshot(state, settle=True)
    assert snapshot.motion.stick_share == 1.0
    shown = verdict(state, snapshot)
    said = f"{shown}"
    assert "without sticking" not in said
    assert "never sticks" not in said
