"""The verdict in words, on real motions."""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import pytest

import wedgebrake as wb
from wedgebrake.analysis.linear_stability import Stability
from wedgebrake.analysis.motion import Motion
from wedgebrake.explorer.core.presets import preset
from wedgebrake.explorer.core.snapshot import take_snapshot
from wedgebrake.explorer.core.state import PageState, new_state
from wedgebrake.explorer.core.verdict import verdict
from wedgebrake.solvers.status import Status

TILES = ["forward", "backward", "locking", "motion", "sticks", "torque", "share"]


@dataclass(frozen=True)
class Braking:
    mean: float = 3.2
    mean_size: float = 38.4
    peak: float = 333.3


@dataclass(frozen=True)
class Seen:
    """What the verdict reads of a snapshot."""

    motion: Motion
    stability: Stability
    status: str
    message: str
    braking: Braking = Braking()
    comparison: Any = None


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
    "no release": _PAPER(release=False),
    "diverged": _PAPER(release=False, eta=-60.0),
    "no damping": _PAPER().replace(damping=0.0),
    "no spring": _PAPER().replace(stiffness=0.0, slope=0.0),
    "no friction": _PAPER().replace(kinetic=0.0, static=0.0),
    "settling": _PAPER(f=1.0),
    "turning": wb.paper.system().replace(drive_speed=1.0, slope=0.0),
}


@cache
def _seen(name: str) -> tuple[PageState, Seen]:
    state = new_state(MACHINES[name])
    limit = 200 if name == "settling" else 5000
    motion = wb.motion(state.system, 50, limit=limit)
    status = Status(motion.status)
    return state, Seen(motion, wb.stability(state.system), status.value, status.sentence)


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
    assert said["headline"].endswith(".")
    assert "  " not in said["headline"]
    for tile in said["tiles"]:
        assert all(tile[key] for key in ("title", "value", "detail", "hint"))
        assert tile["tone"] in ("good", "warn", "bad", "neutral")
        assert "nan" not in tile["value"] + tile["detail"] + tile["hint"]


def test_the_margin_is_told_in_eta_or_in_slope():
    assert _tile(_said("six periods"), "forward")["detail"] == "margin −23.9 in η"
    assert _tile(_said("stable"), "forward")["detail"] == "margin +0.054 in η"
    assert _tile(_said("no damping"), "forward")["detail"] == "margin −40 N s/rad"
    assert _tile(_said("no friction"), "forward")["detail"] == "no friction, any slope"


def test_what_bounds_the_growth_is_told():
    assert "Beyond 7.5 rad/s" in _tile(_said("six periods"), "forward")["hint"]
    assert "does not release" in _tile(_said("no release"), "forward")["hint"]
    assert "Nothing bounds" in _tile(_said("diverged"), "forward")["hint"]


def test_without_a_spring_sliding_is_neutral():
    tile = _tile(_said("no spring"), "forward")
    assert (tile["value"], tile["tone"]) == ("neutral", "neutral")
    assert "Linearly neutral both ways." in _said("no spring")["headline"]


def test_a_direction_that_is_locked_has_no_stability():
    said = _said("locked")
    assert _tile(said, "forward")["value"] == "does not exist"
    assert _tile(said, "locking")["tone"] == "bad"
    assert _tile(_said("locked at rest"), "locking")["tone"] == "warn"
    assert _tile(_said("six periods"), "locking")["tone"] == "good"


def test_tones_of_motions():
    tones = {name: _tile(_said(name), "motion")["tone"] for name in MACHINES}
    assert tones["stable"] == tones["synchronous"] == tones["at rest"] == "good"
    assert tones["six periods"] == tones["quasi-periodic"] == tones["settling"] == "warn"
    assert tones["chaotic"] == tones["diverged"] == "bad"


def test_the_evidence_of_a_motion():
    state, seen = _seen("six periods")
    tile = _tile(verdict(state, seen), "motion")
    assert (tile["value"], tile["detail"]) == ("6T-periodic", "recovers in 510 ms")
    assert "repeats after 6 T" in tile["hint"]
    assert _tile(_said("chaotic"), "motion")["detail"].startswith("errors double in ")
    settling = _tile(_said("settling"), "motion")
    assert settling["detail"] == "still settling"
    assert "run more" in settling["hint"]


def test_a_run_that_met_a_limit_says_so():
    state, seen = _seen("settling")
    cut = replace(seen.motion, kind="undecided", status="event_limit", order=0)
    status = Status.EVENT_LIMIT
    said = verdict(state, replace(seen, motion=cut, status=status.value, message=status.sentence))
    assert "met a limit of work" in said["headline"]
    assert "max_events" in _tile(said, "motion")["hint"]


def test_sticks_are_counted_and_named_by_their_side():
    both = _tile(_said("six periods"), "sticks")
    assert (both["value"], both["detail"]) == ("both ways", "0.833 sticks a period")
    assert _tile(_said("two periods"), "sticks")["value"] == "from backward"
    assert _tile(_said("stable"), "sticks")["value"] == "never sticks"
    assert _tile(_said("at rest"), "sticks")["value"] == "always stuck"
    assert _tile(_said("six periods"), "share")["value"] == "13 %"
    assert _tile(_said("stable"), "share")["value"] == "0 %"


def test_the_torque_stands_beside_that_of_the_conventional_brake():
    state, seen = _seen("six periods")
    assert _tile(verdict(state, seen), "torque")["detail"] == "peak 333"
    comparison = replace(seen, braking=Braking(0.0, 29.12, 40.0))
    tile = _tile(verdict(state, replace(seen, comparison=comparison)), "torque")
    assert (tile["value"], tile["detail"]) == ("38.4 N m", "conventional: 29.1 N m")


def test_rounding_is_no_mean_torque():
    braking = Braking(1e-17, 2.0, 3.6)
    assert "signed mean is 0 N m" in _tile(_said("at rest", braking=braking), "torque")["hint"]


def _of(state):
    return verdict(state, take_snapshot(state))


def test_with_a_shaft_the_damping_at_its_speed_decides():
    """Friction that falls with speed makes sliding unstable that constant friction would not."""
    state = preset("falling-friction").state()
    said = _of(state)
    assert said["headline"].startswith("Sliding at the shaft's speed is linearly unstable.")
    assert _tile(said, "forward")["detail"] == "−2.7 N m s/rad at Ω"
    even = _of(state.edited(coefficients=[0.3] * 5, static=0.3))
    assert even["headline"].startswith("Sliding at the shaft's speed is linearly stable.")


def test_beyond_the_release_speed_only_the_driveline_damps():
    state = new_state(wb.paper.system(eta=-24).replace(drive_speed=20.0))
    tile = _tile(_of(state), "forward")
    assert (tile["value"], tile["detail"]) == ("stable", "+0.1 N m s/rad at Ω")


def test_without_a_torque_no_period_of_it_is_named():
    state = preset("falling-friction").state()
    said = _of(state)
    assert "Vibrates by itself at 10 Hz, without a torque" in said["headline"]
    assert (_tile(said, "motion")["value"], said["tone"]) == ("self-excited", "warn")
    # However short the periods are that nothing is driven with.
    for hertz in (10.0, 20.0, 40.0):
        assert "Vibrates by itself at " in _of(state.edited(frequency=hertz))["headline"]
    damped = state.edited(damping=20.0, initial_angle=0.0)
    assert _tile(_of(damped), "motion")["value"] == "steady"
    fading = state.edited(coefficients=[0.3] * 5, static=0.3, damping=0.5, periods=20)
    assert _tile(_of(fading.edited(initial_velocity=0.5)), "motion")["value"] == "fading"
    assert "torque" not in _tile(_of(damped), "motion")["detail"]


def test_locked_on_a_turning_shaft():
    """A wedge that locks itself at rest is carried along by a shaft that turns forwards."""
    state = preset("start").state().edited(static=0.6, drive_speed=2.0)
    said = _of(state)
    assert take_snapshot(state).motion.kind == "self-locked"
    assert said["tone"] == "bad"
    assert _tile(said, "motion")["value"] == "self-locked"


def test_where_the_brake_locks_at_the_speed_of_the_shaft_there_is_no_sliding():
    state = preset("start").state().edited(friction="smoothed", static=0.5, drive_speed=0.1)
    said = _of(state)
    assert _tile(said, "forward")["value"] == "does not exist"
    assert "unstable" not in said["headline"].split(".")[1]


def test_free_vibration_feeds_on_nothing():
    state = preset("band").state().edited(kinetic=0.25, static=0.25, damping=0.0)
    assert _tile(_of(state.edited(drive_speed=30.0)), "motion")["value"] == "free vibration"


@pytest.mark.parametrize("changes", [{"shown": 1}, {"frequency": 100.0}, {"frequency": 200.0}])
def test_of_few_vibrations_no_change_is_told(changes):
    said = _of(preset("falling-friction").state().edited(**changes))
    assert _tile(said, "motion")["value"] == "self-excited"
    for word in ("growing", "shrinking"):
        assert word not in _tile(said, "motion")["detail"]


def test_of_a_motion_later_than_the_pictures_that_is_told():
    state = preset("start").state().edited(static=0.35, frequency=31.0, periods=120)
    settled = take_snapshot(state, settle=True)
    assert settled.motion.settling > 120
    assert "the pictures show the first 120" in verdict(state, settled)["headline"]
    assert "the pictures show" not in verdict(state, take_snapshot(state))["headline"]
