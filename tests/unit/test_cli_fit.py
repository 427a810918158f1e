"""The command ``fit``."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import wedgebrake as wb

EXAMPLES = Path(__file__).parents[2] / "examples"
GIVEN = ("fit", str(EXAMPLES / "paper.toml"), str(EXAMPLES / "trace.csv"))


def test_the_example_gives_the_values_with_which_it_was_made(run, tmp_path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    files = ("--save", "fitted.toml", "--plot", "fit.png", "--out", "fit.nc")
    free = ("--free", "kinetic=0.1:0.5", "--free", "slope=-100:0")
    status, text, message = run(*GIVEN, *free, *files, "--json")
    assert status == 0, message
    found = json.loads(text)
    for name, value in (("kinetic", 0.285), ("slope", -44.0)):
        one = found["parameters"][name]
        assert abs(one["value"] - value) < 4.0 * one["stderr"]
    assert found["rms"]["velocity"] == pytest.approx(0.05, rel=0.1)
    saved = wb.load_study("fitted.toml")
    assert saved.system.friction.kinetic == found["parameters"]["kinetic"]["value"]
    assert saved.run == wb.load_study(EXAMPLES / "paper.toml").run
    assert all(Path(one).exists() for one in ("fit.png", "fit.nc"))


def test_segments(run, tmp_path) -> None:
    """The same values as with one segment."""
    free = ("--free", "kinetic=0.1:0.5", "--free", "slope=-100:0", "--json")
    found = []
    for segments in ("1", "4"):
        status, text, message = run(*GIVEN, *free, "--segments", segments)
        assert status == 0, message
        found.append(json.loads(text)["parameters"])
    for name, one in found[0].items():
        assert abs(found[1][name]["value"] - one["value"]) < 1e-4 * one["stderr"]


def test_numbers_without_a_trace(run, tmp_path) -> None:
    """The value with which the number was computed comes back."""
    study = EXAMPLES / "paper.toml"
    system = wb.load_study(study).system.replace(kinetic=0.27)
    own = wb.sensitivity(system, ["kinetic"], 0.2, of=["friction_heat"])
    value = float(own["friction_heat_value"])
    options = (
        "--set", "kinetic=0.255", "--free", "kinetic=0.24:0.285", "--window", "0:200ms",
        "--measured", f"friction_heat={value}:{0.01 * value}", "--json",
        "--out", str(tmp_path / "fit.nc"),
    )  # fmt: skip
    status, text, message = run("fit", str(study), *options)
    assert status == 0, message
    found = json.loads(text)
    assert found["parameters"]["kinetic"]["value"] == pytest.approx(0.27, rel=1e-8)
    assert found["measured"]["friction_heat"]["fitted"] == pytest.approx(value)


@pytest.mark.parametrize(
    ("options", "named"),
    [
        (("--free", "kinetic"), "--free"),
        (("--free", "kinetic=0.1"), "--free"),
        (("--free", "kinetik=0.1:0.5"), "kinetik"),
        (("--free", "kinetic=0.1:much"), "--free"),
        (("--free", "kinetic=0.1:0.5", "--observe", "speed=velocity"), "--observe"),
        (("--free", "kinetic=0.1:0.5", "--sigma", "velocity=none"), "--sigma"),
        (("--free", "kinetic=0.1:0.5", "--loss", "square"), "--loss"),
        (("--free", "kinetic=0.1:0.5", "--segments", "0"), "--segments"),
        (("--free", "kinetic=0.1:0.5", "--segments", "100000"), "--segments"),
        (("--free", "kinetic=0.1:0.5", "--time", "seconds"), "--time"),
        (("--free", "kinetic=0.1:0.5", "--measured", "period=0.1"), "--measured"),
        (("--free", "kinetic=0.1:0.5", "--measured", "perod=0.1:0.01"), "perod"),
        (("--free", "kinetic=0.1:0.5", "--measured", "period=0.1:0.01"), "--sigma"),
        (("--free", "kinetic=0.1:0.5", "--window", "0.1"), "--window"),
        (("--free", "kinetic=0.1:0.5", "--save", "fitted.csv"), "--save"),
    ],
)
def test_what_is_wrong_is_named(run, options, named) -> None:
    status, text, message = run(*GIVEN, *options)
    assert status == 2
    assert not text
    assert named in message
    assert "Traceback" not in message
