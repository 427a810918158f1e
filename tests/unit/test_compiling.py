"""Compilation of kernels in parts, and their disk cache: shared by processes, and never stale."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import wedgebrake
import wedgebrake as wb
from machines import contact, single
from wedgebrake.solvers.machine.trajectory import trajectory

ORDERS = [
    ("sum_of_squares", "square"), ("square", "sum_of_squares"), ("square",), ("sum_of_squares",),
]  # fmt: skip
PARTS = """
import sys
from importlib import import_module
for line in sys.argv[1:]:
    module, *names = line.split()
    kernels = import_module(module)
    print(*(getattr(kernels, name)(3.0) for name in names))
"""
KERNELS = """
from wedgebrake.dynamics.jit import compiled

@compiled
def square(x):
    return x * x

@compiled
def sum_of_squares(x):
    return square(x) + square(x + 1.0)
"""
REFERENCES = """
from typing import NamedTuple
import numpy as np
from wedgebrake.dynamics.jit import chosen_by_class, compiled
from wedgebrake.dynamics.references import by_reference

class Inner(NamedTuple):
    numbers: np.ndarray
    factor: float

class Outer(NamedTuple):
    inner: Inner
    count: int
    matrix: np.ndarray

@compiled
def change(inner, at, value):
    inner.numbers[at] = value
    return inner.factor * inner.numbers.sum()

@compiled
def other(inner, at, value):
    return -1.0

chosen = chosen_by_class({Inner: change, Outer: other})

@compiled
def inside(outer):
    outer.matrix[1, 0] = outer.count
    return chosen(outer.inner, outer.count, 5.0)

@compiled
def called(outer):
    return inside(by_reference(outer))

outer = Outer(Inner(np.arange(3.0), 2.0), 1, np.zeros((2, 2)))
print(called(outer), *outer.inner.numbers, outer.matrix[1, 0], *outer[:0])
print(called.py_func(outer))
"""
PROGRAM = """
import sys
sys.path.insert(0, sys.argv[1])
from wedgebrake.solvers.event_driven import root_exclusion
value = root_exclusion.safe_step(1.0, -1.0, 0.0, 0.0, 0.0, 0.0, 10.0)
print(value, sum(root_exclusion.safe_step.stats.cache_hits.values()))
"""


def run(root: Path, cache: Path) -> tuple[float, int]:
    result = subprocess.run(
        [sys.executable, "-c", PROGRAM, str(root)],
        env={**os.environ, "NUMBA_CACHE_DIR": str(cache)},
        capture_output=True,
        text=True,
        check=True,
    )
    value, hits = result.stdout.split()
    return float(value), int(hits)


def test_a_change_in_a_called_file_is_noticed(tmp_path):
    """Numba alone watches only the file of the kernel itself."""
    package = tmp_path / "src" / "wedgebrake"
    shutil.copytree(Path(wedgebrake.__file__).parent, package)
    first = run(package.parent, tmp_path / "cache")
    assert first == (1.0, 0)
    assert run(package.parent, tmp_path / "cache") == (1.0, 1)
    other = package / "dynamics" / "linear_flow.py"
    other.write_text(other.read_text() + "\n# changed\n")
    assert run(package.parent, tmp_path / "cache") == (1.0, 0)


def test_kernels_answer_alone_and_as_parts_of_others(tmp_path):
    """Of a kernel that another one calls there is no machine code, until Python calls it too."""
    for number in range(len(ORDERS)):
        (tmp_path / f"kernels{number}.py").write_text(KERNELS)
    values = {"square": "9.0", "sum_of_squares": "25.0"}
    again = [("sum_of_squares", "square", *calls) for calls in ORDERS]
    for orders in (ORDERS, again, ORDERS):  # the later processes with what the former ones cached
        lines = [" ".join((f"kernels{number}", *calls)) for number, calls in enumerate(orders)]
        result = subprocess.run(
            [sys.executable, "-c", PARTS, *lines],
            cwd=tmp_path,
            capture_output=True,
            text=True,
            check=True,
        )
        expected = [[values[name] for name in calls] for calls in orders]
        assert [line.split() for line in result.stdout.splitlines()] == expected


def test_code_does_not_depend_on_what_python_has_called_before(tmp_path):
    """A caller contains the intermediate code of a kernel, not its code optimised for Python.

    Otherwise its rounding would differ between the process that compiles it and later ones.
    """
    (tmp_path / "kernels.py").write_text(KERNELS)
    program = """
import kernels
from wedgebrake.dynamics.compilation import _Part
kernels.square(3.0)
kernels.sum_of_squares(3.0)
code = kernels.sum_of_squares.overloads[kernels.sum_of_squares.signatures[0]].library
parts = [part for part in code._linking_libraries if part.name == "square"]
print(len(parts) > 0 and all(isinstance(part, _Part) for part in parts))
"""
    result = subprocess.run(
        [sys.executable, "-c", program], cwd=tmp_path, capture_output=True, text=True, check=True
    )
    assert result.stdout.strip() == "True"


def test_fields_are_read_and_written_through_references(tmp_path):
    """Nested tuples too, and by kernels that are chosen by the class of the tuple."""
    (tmp_path / "references.py").write_text(REFERENCES)
    for _ in range(2):  # compiled, and from the cache
        result = subprocess.run(
            [sys.executable, "references.py"],
            cwd=tmp_path, capture_output=True, text=True, check=True,
        )  # fmt: skip
        assert result.stdout.split() == ["14.0", "0.0", "5.0", "2.0", "1.0", "14.0"]


def test_times_that_are_read_only_need_no_further_kernel() -> None:
    """The times of a response are read-only, which is a type of its own for Numba."""
    machine = single(contact(base_speed=9.0), stiffness=4.0, damping=1.0)
    times = wb.simulate(machine, 1.0).time.to_numpy()
    wb.motion(machine)
    before = set(trajectory.move.signatures)
    wb.simulate(machine, 1.0, times=times)
    wb.sensitivity(machine, ["brake.kinetic"], 1.0, times=times)
    assert set(trajectory.move.signatures) == before
