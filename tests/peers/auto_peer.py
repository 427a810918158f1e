"""Branches of periodic orbits of the smoothed brake from AUTO-07p.

AUTO solves for whole orbits by collocation and reads the multipliers off its linear systems;
only the orbit that it starts from is integrated, by SciPy. The equations are in brake.f90,
stated from docs/equations.md, "One inertia with one brake"; the package supplies nothing but a
system's numbers.

With 400 intervals the layer about zero velocity is resolved: located values change by less
than 1e-6 of themselves when the intervals are doubled, and by less than 1e-5 with 200. No node
of the mesh lies where the brake releases. On an orbit that passes there the states keep six
digits, but the multipliers three or four only.
"""

from __future__ import annotations

import math
import os
import re
import shutil
import subprocess
import time
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp
from scipy.interpolate import BarycentricInterpolator

import wedgebrake as wb
from equations import angular_frequency, gain

AUTO = Path(os.environ.get("AUTO_DIR", "/usr/lib/auto-07p"))
EQUATIONS = Path(__file__).with_name("brake.f90")
PARAMETERS = {"eta": 1, "F0": 2}
KINDS = {5: "LP", 6: "BP", 7: "PD", 8: "TR", -4: "UZ", 9: "EP"}
FAILED = -9
NCOL = 4


@dataclass(frozen=True)
class Orbit:
    """A labelled orbit: a special point (LP, BP, PD, TR), a wanted value (UZ) or an end (EP).

    ``states``: (order, 2), angle [rad] and velocity [rad/s] at whole periods of the torque;
    ``peaks``: (2,), the greatest of each on the orbit; ``multipliers``: (2,), without the two
    of the torque's oscillator.
    """

    kind: str
    value: float
    states: np.ndarray
    peaks: np.ndarray
    multipliers: np.ndarray


@dataclass(frozen=True)
class Branch:
    """A branch: (point,) values of the parameter, (point, 2) peaks and multipliers; orbits.

    The multipliers of the first point are poor: AUTO has not fitted its mesh to it yet.
    ``seconds``: how long AUTO itself ran.
    """

    values: np.ndarray
    peaks: np.ndarray
    multipliers: np.ndarray
    orbits: tuple[Orbit, ...]
    seconds: float

    def of(self, *kinds: str) -> list[Orbit]:
        """The orbits of some kinds, in order along the branch."""
        return [orbit for orbit in self.orbits if orbit.kind in kinds]


def missing() -> str:
    """Why AUTO cannot run here; "" if it can."""
    if shutil.which("gfortran") is None:
        return "gfortran is not installed: AUTO compiles its equations"
    if not (AUTO / "lib" / "main.o").exists():
        return f"AUTO-07p is not installed: no {AUTO}/lib/main.o (AUTO_DIR names its folder)"
    return ""


@cache
def _program(equations: Path) -> bytes:
    """AUTO with some equations, compiled."""
    with TemporaryDirectory() as folder:
        built = Path(folder, "program")
        objects = sorted(map(str, (AUTO / "lib").glob("*.o")))
        command = ["gfortran", "-O2", "-fopenmp", "-w", str(equations), *objects, "-o", str(built)]
        subprocess.run(command, cwd=folder, check=True, capture_output=True, timeout=300)
        return built.read_bytes()


def run_auto(equations: Path, here: Path) -> float:
    """Run AUTO on what has been written to a folder; returns how long it took [s]."""
    executable = here / "program"
    executable.write_bytes(_program(equations))
    executable.chmod(0o755)
    begin = time.perf_counter()
    run = subprocess.run(
        [str(executable)], cwd=here, capture_output=True, text=True, timeout=600, check=False,
        env={**os.environ, "OMP_NUM_THREADS": "1"},
    )  # fmt: skip
    seconds = time.perf_counter() - begin
    # A constant that AUTO cannot read ends it early, and yet as a success.
    done = run.returncode == 0 and (here / "fort.7").exists()
    assert done, run.stdout[-2000:] + run.stderr[-2000:]
    return seconds


def branch(
    system: wb.BrakedDriveline,
    name: str,
    stop: float,
    *,
    order: int = 1,
    settle: int = 200,
    intervals: int = 400,
    step: float,
    wanted: tuple[float, ...] = (),
) -> Branch:
    """The branch from ``system`` to the value ``stop`` of a parameter (eta or F0).

    ``order``: the orbit's period over the torque's; ``settle``: periods of the torque
    integrated from rest to a stable orbit; ``intervals``: of the collocation; ``step``: the
    longest along the branch; ``wanted``: values at which orbits are kept.
    """
    with TemporaryDirectory() as folder:
        here = Path(folder)
        _write_numbers(system, here)
        _write_orbit(system, order, settle, here)
        ends = float(getattr(system.groups, name)), stop
        write_constants(4, PARAMETERS[name], ends, step, here, intervals, wanted)
        seconds = run_auto(EQUATIONS, here)
        return _read(order, angular_frequency(system), here, seconds)


def _write_numbers(system: wb.BrakedDriveline, here: Path) -> None:
    line, brake, friction, groups = system.driveline, system.brake, system.friction, system.groups
    assert isinstance(friction, wb.SmoothedFriction)
    assert isinstance(brake, wb.WedgeBrake | wb.ConventionalBrake)
    assert line.drive_speed == 0.0
    assert system.actuation.release
    tangent = math.tan(brake.angle) if isinstance(brake, wb.WedgeBrake) else 0.0
    numbers = (
        line.inertia, line.damping, line.stiffness, brake.radius, system.actuation.initial_force,
        friction.kinetic, friction.static, friction.decay, friction.steepness,
        angular_frequency(system), tangent, groups.eta, groups.F0,
    )  # fmt: skip
    (here / "brake.txt").write_text("\n".join(f"{number:.17g}" for number in numbers) + "\n")


def _write_orbit(system: wb.BrakedDriveline, order: int, settle: int, here: Path) -> None:
    """The orbit that the brake settles on from rest, for AUTO: phase, u(1) ... u(4)."""
    line, friction, radius = system.driveline, system.friction, system.brake.radius
    force, slope = system.actuation.initial_force, system.actuation.slope
    omega, amplitude = angular_frequency(system), system.excitation.amplitude

    def rates(phase: float, u: Any) -> list[float]:
        angle, velocity = u.tolist()
        speed = radius * velocity
        peak = (friction.static - friction.kinetic) * math.exp(-friction.decay * abs(speed))
        m = (friction.kinetic + peak) * math.tanh(friction.steepness * speed)
        brake = radius * max(0.0, force + slope * abs(velocity)) * gain(system.brake, m)
        rest = line.damping * velocity + line.stiffness * angle / omega
        return [velocity, (amplitude * math.sin(phase) - brake - rest) / (line.inertia * omega)]

    write_start(rates, 2, order, settle // order, here)


def write_start(rates: Any, states: int, order: int, settle: int, here: Path) -> None:
    """The orbit that a system settles on from rest, for AUTO: phase, states, its sine and cosine.

    ``rates(phase, states)``: derivatives with respect to the torque's phase; ``order``: the
    orbit's period over the torque's; ``settle``: the most periods of the orbit that are integrated.
    AUTO corrects the orbit, so that it need not have settled to more than five digits.
    """
    phases = np.linspace(0.0, 2.0 * math.pi * order, 2000 * order + 1)
    ends = phases[0], phases[-1]
    state = np.zeros(states)
    for _ in range(settle):
        before = state
        made = solve_ivp(rates, ends, before, "LSODA", t_eval=phases, rtol=1e-7, atol=1e-7)
        state = made.y[:, -1]
        if np.allclose(state, before, rtol=0.0, atol=1e-5):
            break
    assert np.allclose(state, before, rtol=0.0, atol=1e-3), "the system has not settled"
    table = np.column_stack([phases, *made.y, np.sin(phases), np.cos(phases)])
    np.savetxt(here / "start.dat", table, fmt="%.16e")


def write_constants(
    states: int,
    index: int,
    ends: tuple[float, float],
    step: float,
    here: Path,
    intervals: int = 400,
    wanted: tuple[float, ...] = (),
) -> None:
    """AUTO's constants of a branch of orbits: of u, its size; the parameter's number and ends."""
    begin, stop = ends
    values = {
        "dat": "'start'", "NDIM": states, "IPS": 2, "IRS": 0, "ILP": 1, "ISP": 2, "ISW": 1,
        "ICP": [index, 11], "NTST": intervals, "NCOL": NCOL, "IAD": 3, "JAC": 1,
        "EPSL": 1e-9, "EPSU": 1e-9, "EPSS": 1e-8, "ITMX": 30, "ITNW": 9, "NWTN": 5,
        "DS": math.copysign(step / 10.0, stop - begin), "DSMIN": step * 1e-6, "DSMAX": step,
        "IADS": 1, "NMX": 2000, "NPR": 0, "MXBF": 0, "IID": 2, "IPLT": 0,
        "UZSTOP": {index: float(stop)},
    }  # fmt: skip
    if wanted:
        values["UZR"] = {index: [float(value) for value in wanted]}
    (here / "fort.2").write_text("".join(f"{key}={value}\n" for key, value in values.items()))


def _read(order: int, omega: float, here: Path, seconds: float) -> Branch:
    """The branch from AUTO's tables: one row for each point, a block for each orbit kept."""
    rows = [line.split() for line in (here / "fort.7").read_text().splitlines()]
    rows = [row for row in rows if row[0] != "0"]
    values = np.array([float(row[4]) for row in rows])
    peaks = np.array([row[6:8] for row in rows], dtype=float) / (omega, 1.0)
    multipliers = _read_multipliers(order, here)
    assert len(multipliers) == len(rows), "a point without multipliers"
    states = _read_states(order, omega, here)
    orbits = []
    for i, row in enumerate(rows):
        kind, label = int(row[2]), int(row[3])
        assert kind != FAILED, f"AUTO came to no orbit beyond {row[4]}"
        if label:
            orbits.append(Orbit(KINDS[kind], values[i], states[label], peaks[i], multipliers[i]))
    return Branch(values, peaks, multipliers, tuple(orbits), seconds)


def _read_multipliers(order: int, here: Path) -> np.ndarray:
    """(point, 2): the brake's own, the last that were computed for each point."""
    found: dict[int, list[complex]] = {}
    for line in (here / "fort.9").read_text().splitlines():
        match = re.match(r"\s+\d+\s+(\d+)\s+Multiplier\s+(\d)\s+(\S+)\s+(\S+)", line)
        if match:
            point, which = int(match[1]), int(match[2])
            if which == 1:
                found[point] = []
            found[point].append(complex(float(match[3]), float(match[4])))
    # The oscillator of the torque's phase has 1, and exp(-4 pi) in each of its turns.
    for several in found.values():
        for known in (1.0, math.exp(-4.0 * math.pi * order)):
            several.remove(min(several, key=lambda one: abs(one - known)))
    return np.array([found[point] for point in sorted(found)])


def _read_states(order: int, omega: float, here: Path) -> dict[int, np.ndarray]:
    """By label: (order, 2), angle and velocity where the torque's phase is a whole turn."""
    lines = (here / "fort.8").read_text().splitlines()
    states, at = {}, 0
    while at < len(lines):
        header = [int(word) for word in lines[at].split()]
        label, points, rows = header[3], header[6], header[8]
        orbit = np.array([line.split() for line in lines[at + 1 : at + 1 + points]], dtype=float)
        begin = math.atan2(orbit[0, 3], orbit[0, 4]) / (2.0 * math.pi)
        times = sorted((turn - begin) / order % 1.0 for turn in range(order))
        states[label] = np.array([_inside(orbit, time) for time in times]) / (omega, 1.0)
        at += 1 + rows
    return states


def _inside(orbit: np.ndarray, time: float) -> np.ndarray:
    """u(1) and u(2) at a time in [0, 1], from the collocation polynomial around it."""
    mesh = orbit[::NCOL, 0]
    left = NCOL * int(np.clip(np.searchsorted(mesh, time) - 1, 0, mesh.size - 2))
    piece = orbit[left : left + NCOL + 1]
    return np.asarray(BarycentricInterpolator(piece[:, 0], piece[:, 1:3])(time))
