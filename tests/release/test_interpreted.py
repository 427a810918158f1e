"""The kernels mean what they say: as plain Python they give the compiled numbers."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest
from interpreted import results

pytestmark = pytest.mark.slow  # half a minute of plain Python
PROGRAM = Path(__file__).with_name("interpreted.py")


@pytest.fixture(scope="module")
def both() -> tuple[dict[str, list[float]], dict[str, list[float]]]:
    command = [sys.executable, PROGRAM, "--plain"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=600)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout), results()


def test_plain_python_gives_the_same_numbers(both):
    """But for rounding: compiled code may fuse a product with a sum, which steps magnify."""
    plain, compiled = both
    assert plain.keys() == compiled.keys()
    for name, values in compiled.items():
        assert plain[name] == pytest.approx(values, rel=1e-6, abs=1e-9), name


def test_the_runs_do_something(both):
    """Numbers that differ from run to run, and events in most."""
    _, compiled = both
    assert len({tuple(values) for values in compiled.values()}) >= len(compiled) - 2
    assert sum(len(values) for values in compiled.values()) > 100
    assert compiled["wedge"][2] > 5
