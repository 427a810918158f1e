"""The command margin."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy import stats

import wedgebrake as wb

PAPER = Path(__file__).parents[2] / "examples" / "paper.toml"
SLOPE = ("--parameter", "slope=-60:12")


def test_answers_are_those_of_python(answer, run):
    system = wb.load_study(PAPER).system
    for options, more in (
        ((), {}),
        (("--over", "kinetic=0.28:0.34:3"), {"over": {"kinetic": np.linspace(0.28, 0.34, 3)}}),
        (("--over", "kinetic=0.28:0.34"), {"over": {"kinetic": (0.28, 0.34)}}),
        (
            ("--vary", "kinetic=norm(0.3,0.01)", "--samples", "8", "--quantile", "0.5"),
            {"scatter": {"kinetic": stats.norm(0.3, 0.01)}, "samples": 8, "quantile": 0.5},
        ),
    ):
        told = answer("margin", PAPER, *SLOPE, *options)
        found = wb.margin(system, "slope", between=(-60.0, 12.0), **more)
        assert told["low"] == found.low
        assert told["verdict"] == found.verdict
        assert found.verdict in run("margin", PAPER, *SLOPE, *options)[1]


def test_of_runs(answer):
    told = answer(
        "margin", PAPER, "--parameter", "F0=0.01:0.2", "--criterion", "no stick-slip", "--points",
        "4", "--periods", "20",
    )  # fmt: skip
    assert told["criterion"] == "no stick-slip"


@pytest.mark.parametrize(
    "options",
    [
        (), ("--parameter", "slope"), ("--parameter", "slope=1"), ("--parameter", "slope=1:1"),
        ("--parameter", "slop=1:2"), ("--parameter", "slope=a:2"), (*SLOPE, "--criterion", "good"),
        (*SLOPE, "--over", "slope=1:2:3"), (*SLOPE, "--vary", "kinetic=0.3"),
        (*SLOPE, "--points", "1"), (*SLOPE, "--over", "kinetic=0.3:0.3"),
        (*SLOPE, "--over", "kinetic=0.3,0.31", "--vary", "kinetic=0.3..0.4"),
    ],
)  # fmt: skip
def test_wrong_options(run, options):
    status, _, said = run("margin", PAPER, *options)
    assert status == 2
    assert "internal" not in said
