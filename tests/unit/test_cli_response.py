"""``wedgebrake response``: data, text, files, and wrong input."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import wedgebrake as wb

EXAMPLES = Path(__file__).parents[2] / "examples"
PAPER = EXAMPLES / "paper.toml"
OVER = ["--over", "frequency=8:9"]
LEVELS = ["--level", "amplitude=480,530"]
WIDE = ["--step", "0.1"]


def test_data_are_those_of_the_library(run, answer) -> None:
    told = answer("response", PAPER, *OVER, *LEVELS, *WIDE, "--folds", "--set", "eta=-24")
    system = wb.load_study(PAPER).system.replace(eta=-24.0)
    found = wb.response_curve(
        system, frequency=(8.0, 9.0), levels=[480.0, 530.0], folds=True, step=0.1
    )
    assert told["kind"] == "response_curve"
    assert told["range"] == [8.0, 9.0]
    assert told["level"]["name"] == "amplitude"
    assert [one["value"] for one in told["levels"]] == [480.0, 530.0]
    assert told["speed"]["points"] == found.sizes["point"]
    for one in told["levels"]:
        own = found.isel(point=found.amplitude.to_numpy() == one["value"])
        place = int(np.argmax(own.angle_amplitude.to_numpy()))
        assert one["largest"]["at"] == float(own.frequency[place])
        assert one["largest"]["angle_amplitude"] == float(own.angle_amplitude[place])
        assert one["largest"]["stable"] is bool(own.stable[place])
        values = found.bifurcation_value.to_numpy()[found.bifurcation_level == one["value"]]
        assert [each["value"] for each in one["bifurcations"]] == values.tolist()
        assert any(each["fold"] for each in one["bifurcations"])
    curves = np.concatenate([one["values"] for one in told["curves_of_folds"]])
    assert curves == pytest.approx(found.fold_value.to_numpy())


def test_samplings_in_each_period(run, tmp_path) -> None:
    sampled = wb.load_study(PAPER).system.replace(sample_time=0.001)
    wb.save_study(wb.Study(system=sampled), tmp_path / "sampled.toml")
    asked = ("response", tmp_path / "sampled.toml", *OVER, *LEVELS, "--step", "0.3")
    status, text, _ = run(*asked, "--samplings", "50")
    assert status == 0
    assert "50 samplings in each" in text
    status, _, errors = run(*asked)
    assert status == 2
    assert "samplings in a period" in errors


def test_text_and_files(run, tmp_path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    files = ["--plot", "c.png", "--out", "c.csv"]
    status, text, _ = run("response", PAPER, *OVER, *LEVELS, *WIDE, *files)
    assert status == 0
    assert text.startswith("Largest amplitudes")
    assert "amplitude = 480 N m:" in text
    assert "Phases refer to the torque on driveline." in text
    assert (tmp_path / "c.png").stat().st_size > 10_000
    lines = [one for one in (tmp_path / "c.csv").read_text().splitlines() if one[0] != "#"]
    assert {"frequency [Hz]", "amplitude [N m]", "angle_phase [rad]"} <= set(lines[0].split(","))
    status, text, _ = run("response", PAPER, *OVER, *LEVELS, *WIDE, "--out", "c.nc")
    assert status == 0
    with xr.open_dataset(tmp_path / "c.nc") as found:
        wb.plot(found.load())


def test_levels_without_an_orbit(run, answer) -> None:
    options = ["--set", "eta=0", "--set", "initial_force=20000", "--step", "0.5"]
    told = answer("response", PAPER, *OVER, "--level", "amplitude=50,20000", *options)
    assert told["levels"][0]["points"] == 0
    assert told["levels"][0]["note"].startswith("Nothing slips")
    status, text, _ = run("response", PAPER, *OVER, "--level", "amplitude=50,20000", *options)
    assert (status, "amplitude = 50 N m: no orbit. Nothing slips" in text) == (0, True)
    status, text, message = run("response", PAPER, *OVER, "--level", "amplitude=50", *options)
    assert (status, text) == (2, "")
    assert "no orbit at any of them. amplitude = 50: Nothing slips" in message


def test_machine(answer) -> None:
    """Names with a dot, and the part that moves most."""
    told = answer(
        "response", EXAMPLES / "belt.toml", "--over", "belt.base_speed=0.6:0.7", "--level",
        "belt.initial_force=1,1.2", *WIDE,
    )  # fmt: skip
    assert told["levels"][0]["largest"]["inertia"] == "mass"
    assert told["phase_reference"] == "angle of mass"


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (LEVELS, "--over: not given"),
        (OVER, "--level: not given, must be given once"),
        ([*OVER, *OVER, *LEVELS], "--over: given 2 times"),
        ([*OVER, "--level", "amplitude"], "--level amplitude: must be NAME=A,B"),
        ([*OVER, "--level", "amplitude=a"], "is not a number"),
        ([*OVER, "--level", "amplitude=5,5"], "must be different values"),
        ([*OVER, "--level", "amplitud=5"], "--level amplitud=5: orbits cannot be followed"),
        ([*OVER, "--level", "frequency=9"], "--level frequency: is that of --over"),
        ([*OVER, "--level", "kinetic=-1"], "--level kinetic=-1: "),
        ([*OVER, "--level", "amplitude=500", "--folds"], "--folds: needs two levels"),
        ([*OVER, *LEVELS, "--order", "0"], "--order 0"),
        ([*OVER, *LEVELS, "--switch", "-1"], "--switch -1"),
        ([*OVER, *LEVELS, "--step", "9"], "--step 9"),
        ([*OVER, *LEVELS, "--set", "periods=3"], "--set periods: has no effect on response"),
        ([*OVER, *LEVELS, "--set", "initial=[0,1]"], "--set initial: has no effect"),
        (["--over", "frequency=8:8", *LEVELS], "two different numbers"),
    ],
)
def test_wrong_input(run, options, words) -> None:
    status, text, message = run("response", PAPER, *options)
    assert (status, text) == (2, "")
    assert words in message
