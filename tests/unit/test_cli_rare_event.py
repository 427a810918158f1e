"""The command rare-event."""

from __future__ import annotations

import math
import re
from pathlib import Path

import pytest
from scipy import stats

import wedgebrake as wb

PAPER = Path(__file__).parents[2] / "examples" / "paper.toml"
LOCKS = ("--vary", "kinetic=norm(0.25,0.02)", "--set", "angle=0.335", "--runs", "500")
PEAK = (
    "--vary", "initial_force=norm(300,10)", "--outcome", "peak_torque > 380", "--runs", "500",
    "--transient", "20", "--periods", "30",
)  # fmt: skip


def test_answers_are_those_of_python(answer):
    told = answer("rare-event", PAPER, *PEAK, "--seed", "2")
    found = wb.rare_event(
        wb.load_study(PAPER).system, {"initial_force": stats.norm(300.0, 10.0)},
        "peak_torque > 380", runs=500, seed=2, transient=20, periods=30,
    )  # fmt: skip
    assert 0.0 < told["probability"] < 0.01
    for name in ("probability", "standard_error", "low", "high", "lines", "runs", "unknown"):
        assert told[name] == found[name].item()
    point = told["design_point"]["initial_force"]
    assert point == {"value": found["design_point"].item(), "unit": "N"}
    assert told["outcome"] == "peak_torque > 380"


def test_the_text_has_the_probability_and_the_design_point(run):
    """Self-locking needs a friction coefficient above the tangent of the angle."""
    status, text, _ = run("rare-event", PAPER, *LOCKS)
    assert status == 0
    limit = math.tan(0.335)
    exact = stats.norm(0.25, 0.02).sf(limit)
    shown = float(re.findall(r"\d\.\d+e-\d+", text)[0])
    assert shown == pytest.approx(exact, rel=1e-3)
    assert f"kinetic: {limit:.5g}" in text


def test_what_does_not_occur(run, answer):
    options = ("rare-event", PAPER, "--vary", "damping=0.1..0.2", "--runs", "500")
    told = answer(*options)
    assert (told["probability"], told["high"]) == (0.0, None)
    assert told["design_point"]["damping"]["value"] is None
    status, text, _ = run(*options)
    assert status == 0
    assert "No occurrence" in text


def test_a_direction_in_which_nothing_slides(run):
    """The mass on the belt is always slower than the belt."""
    belt = PAPER.with_name("belt.toml")
    varied = ("--vary", "belt.base_speed=norm(1.2,0.1)", "--outcome", "unstable_forwards")
    status, text, said = run("rare-event", belt, *varied)
    assert (status, text) == (2, "")
    assert said.startswith("error: --outcome")
    status, text, _ = run("scatter", belt, *varied, "--samples", "64")
    assert status == 0
    assert "no sample slides forwards" in text


@pytest.mark.parametrize(
    ("options", "name"),
    [
        ((), "--vary"),
        (("--vary", "kinetic=0.3"), "--vary"),
        (("--vary", "kinetik=norm(0.3,0.1)"), "--vary"),
        ((*LOCKS, "--outcome", "safe"), "--outcome"),
        ((*LOCKS, "--outcome", "torque > 1"), "--outcome"),
        ((*LOCKS, "--outcome", "peak_torque > much"), "--outcome"),
        ((*LOCKS, "--outcome", "peak_torque > nan"), "--outcome"),
        ((*LOCKS, "--runs", "5"), "--runs"),
        ((*LOCKS, "--seed", "-1"), "--seed"),
        ((*PEAK, "--threads", "0"), "--threads"),
        ((*LOCKS, "--transient", "soon"), "--transient"),
        ((*LOCKS, "--set", "duration=3"), "--set"),
    ],
)
def test_wrong_options(run, options, name):
    status, text, said = run("rare-event", PAPER, *options)
    assert (status, text) == (2, "")
    assert said.startswith("error: ")
    assert name in said


def test_a_file_that_is_not_a_study_is_refused(run, tmp_path):
    (tmp_path / "bad.toml").write_text("[brake\n", encoding="utf-8")
    assert run("rare-event", "bad.toml", "--vary", "kinetic=0.1..0.2")[0] == 2
