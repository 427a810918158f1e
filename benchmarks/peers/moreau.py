"""Siconos: Moreau's time-stepping on the Coulomb system, with several steps.

Debian has it for its own Python (python3-siconos); WEDGEBRAKE_SICONOS_PYTHON names another.
"""

import json
import os
import subprocess
from collections.abc import Sequence
from functools import cache
from pathlib import Path

import numpy as np

from peers.brake import Brake
from peers.peer import Answers, Peer, spoken

PYTHON = os.environ.get("WEDGEBRAKE_SICONOS_PYTHON", "/usr/bin/python3")
PROGRAM = Path(__file__).with_name("moreau_steps.py")


class Siconos(Peer):
    """One step size."""

    law = "coulomb"
    name = "Siconos, Moreau steps"

    def __init__(self, step: float) -> None:
        self.step = step
        self.asked = f"step {step:g} s"
        self.slow = step < 1e-4

    def missing(self) -> str:
        return absent()

    def solve(self, brakes: Sequence[Brake], until: float) -> Answers:
        asked = {
            "step": self.step,
            "until": until,
            "brakes": [brake._asdict() for brake in brakes],
        }
        # The last line: the library has words of its own.
        said = json.loads(spoken([PYTHON, PROGRAM], Path(), json.dumps(asked)).splitlines()[-1])
        return Answers(np.array(said["states"]), said["seconds"])


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
    """Every step a tenth of the one before."""
    return [Siconos(step) for step in (1e-3, 1e-4, 1e-5)]
