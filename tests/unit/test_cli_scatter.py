"""The command scatter."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy import stats

import wedgebrake as wb

PAPER = Path(__file__).parents[2] / "examples" / "paper.toml"
LINEAR = ("--outcome", "self_locked", "--samples", "64")


def test_answers_are_those_of_python(answer):
    told = answer(
        "scatter", PAPER, "--vary", "kinetic=0.28..0.42", "--vary", "slope=norm(-40, scale=5)",
        "--samples", "32", "--seed", "3", "--transient", "10", "--periods", "20",
        "--limit", "rms_torque=0.1 kN m", "--out", "s.nc", "--plot", "s.png",
    )  # fmt: skip
    found = wb.scatter(
        wb.load_study(PAPER).system,
        {"kinetic": stats.uniform(0.28, 0.14), "slope": stats.norm(-40.0, 5.0)},
        samples=32, seed=3, transient=10, periods=20, limits={"rms_torque": 100.0},
    )  # fmt: skip
    assert set(told["probabilities"]) == set(found["outcome"].to_numpy())
    for name, one in told["probabilities"].items():
        for key, value in one.items():
            assert value == found[key].sel(outcome=name).item()
    assert told["samples"] == sum(told["status"].values()) == 32
    assert Path("s.png").stat().st_size > 0
    assert Path("s.nc").stat().st_size > 0


def test_indices_and_text(run, answer):
    options = ("scatter", PAPER, "--vary", "kinetic=0.28..0.42", *LINEAR, "--indices")
    assert answer(*options)["indices"]["self_locked"]["kinetic"]["S1"] == pytest.approx(1, abs=0.3)
    status, text, _ = run(*options)
    assert status == 0
    assert "self_locked" in text
    assert "Sobol indices" in text


def test_rows_that_indices_leave_out_are_told(run, answer):
    """Kinetic friction above the given static friction is invalid."""
    options = (
        "scatter", PAPER, "--set", "static=0.35", "--vary", "kinetic=0.28..0.42", *LINEAR,
        "--indices",
    )  # fmt: skip
    told = answer(*options)
    rows = told["samples"] // 2
    used = told["index_samples"]["self_locked"]
    assert 0 < used < rows
    assert f"from {used} of {rows} rows" in run(*options)[1]


@pytest.mark.parametrize(
    ("text", "law"),
    [
        ("0.28..0.42", stats.uniform(0.28, 0.14)),
        ("uniform(0.28, 0.14)", stats.uniform(0.28, 0.14)),
        ("triang(0.5, loc=0.28, scale=0.14)", stats.triang(0.5, 0.28, 0.14)),
        ("truncnorm(-2, 2, loc=0.3, scale=0.02)", stats.truncnorm(-2, 2, 0.3, 0.02)),
    ],
)
def test_distributions(text, law, answer):
    assert "norm" not in text or "(" in text
    out = ("--out", "s.nc")
    answer("scatter", PAPER, "--vary", f"kinetic={text}", *LINEAR, *out)
    import xarray as xr

    with xr.open_dataset("s.nc") as found:
        kinetic = np.sort(found["kinetic"].to_numpy())
    assert stats.kstest(kinetic, law.cdf).statistic < 0.05


def test_values_with_units(answer):
    options = ("--vary", "initial_force=0.2 kN..0.4 kN", *LINEAR, "--out", "s.csv")
    answer("scatter", PAPER, *options)
    assert "initial_force" in Path("s.csv").read_text("utf-8")


@pytest.mark.parametrize(
    "options",
    [
        (),
        ("--vary", "kinetic"),
        ("--vary", "kinetic=0.3"),
        ("--vary", "kinetic=0.4..0.3"),
        ("--vary", "kinetic=a..b"),
        ("--vary", "kinetic=normal(0.3, 0.1)"),
        ("--vary", "kinetic=norm(0.3, -0.1)"),
        ("--vary", "kinetic=norm(0.3, colour=1)"),
        ("--vary", "kinetic=__import__('os').getcwd()"),
        ("--vary", "kinetic=rv_continuous()"),
        ("--vary", "kinetik=0.3..0.4"),
        ("--vary", "kinetic=0.3..0.4", "--vary", "kinetic=0.3..0.4"),
        ("--vary", "kinetic=0.3..0.4", "--outcome", "stable"),
        ("--vary", "kinetic=0.3..0.4", "--limit", "torque=1"),
        ("--vary", "kinetic=0.3..0.4", "--samples", "1"),
        ("--vary", "kinetic=0.3..0.4", "--resume"),
        ("--vary", "kinetic=0.3..0.4", "--plot", "s.gif"),
    ],
)
def test_wrong_options(run, options):
    status, _, said = run("scatter", PAPER, *options)
    assert status == 2
    assert said.startswith("error: ")
    assert "internal" not in said
