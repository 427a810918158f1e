"""Siconos: Moreau's time-stepping for brakes and machines with Coulomb friction.

Debian has it for its own Python (python3-siconos); WEDGEBRAKE_SICONOS_PYTHON names another.
"""

import json
import os
import subprocess
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

import wedgebrake as wb
from peers.brake import Brake
from peers.machine import Machine
from peers.peer import Answers, Peer, spoken

PYTHON = os.environ.get("WEDGEBRAKE_SICONOS_PYTHON", "/usr/bin/python3")
PROGRAM = Path(__file__).with_name("moreau_steps.py")


class Siconos(Peer):
    """Moreau's time-stepping with one step size."""

    law = "coulomb"
    name = "Siconos, Moreau steps"

    def __init__(self, step: float) -> None:
        self.step = step
        self.asked = f"step {step:g} s"
        self.slow = step < 1e-4

    def missing(self) -> str:
        return absent()

    def solve(self, brakes: Sequence[Brake], until: float) -> Answers:
        return _ask([_of_brake(one) for one in brakes], self.step, until)

    def follow(self, machine: wb.Machine, until: float) -> Answers:
        """Final state of a machine: angles, then speeds."""
        times = (np.arange(round(until / self.step)) + 0.5) * until / round(until / self.step)
        return _ask([_of_machine(machine, times)], self.step, until)


def _ask(machines: list[dict[str, Any]], step: float, until: float) -> Answers:
    asked = {"step": step, "until": until, "machines": machines}
    # Only the last line is the answer; the library prints messages before it.
    said = json.loads(spoken([PYTHON, PROGRAM], Path(), json.dumps(asked)).splitlines()[-1])
    return Answers(np.array(said["states"]), said["seconds"])


def _of_brake(brake: Brake) -> dict[str, Any]:
    gains = [brake.gain(1), -brake.gain(-1)]
    contact = {"row": [1.0], "force": brake.fa, "slope": brake.slope, "gains": [gains, gains]}
    return {
        "angles": [0.0], "speeds": [0.0], "mass": [[1.0]], "stiffness": [[brake.k]],
        "damping": [[brake.c]], "torques": [(0, {"harmonic": [brake.te, brake.om, 0.0]})],
        "contacts": [contact],
    }  # fmt: skip


def _of_machine(machine: wb.Machine, times: np.ndarray) -> dict[str, Any]:
    """A machine as ``moreau_steps`` reads it, with the values of its signals at some times."""
    numbers, names = Machine.of(machine), [one.name for one in machine.inertias]
    assert not numbers.controllers
    angles, speeds = np.split(numbers.start, 2)

    def values(signal: float | wb.Signal) -> float | list[float]:
        return np.asarray(signal(times)).tolist() if isinstance(signal, wb.Signal) else signal

    contacts = [
        {
            "row": row.tolist(), "force": values(contact.actuation.initial_force),
            "slope": one.slope, "gains": [[gain[1], gain[-1]] for gain in (one.kinetic, one.peak)],
        }
        for row, one, contact in zip(
            numbers.rows, numbers.contacts, machine.contacts, strict=True
        )
    ]  # fmt: skip
    return {
        "angles": angles.tolist(), "speeds": speeds.tolist(),
        "mass": np.diag(numbers.inertia).tolist(),
        "stiffness": numbers.stiffness.tolist(), "damping": numbers.damping.tolist(),
        "torques": [(names.index(one.on), values(one.signal)) for one in machine.torques],
        "contacts": contacts,
    }  # fmt: skip


@cache
def absent() -> str:
    """Why Siconos cannot run here; "" if it can."""
    try:
        command = [PYTHON, "-c", "import siconos.kernel"]
        done = subprocess.run(command, capture_output=True, check=False)  # noqa: S603 - as above
    except OSError:
        return "not installed"
    return "not installed" if done.returncode else ""


def peers() -> list[Peer]:
    """Three step sizes, each a tenth of the one before."""
    return [Siconos(step) for step in (1e-3, 1e-4, 1e-5)]
