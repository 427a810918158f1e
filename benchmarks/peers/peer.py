"""The interface of all peers, and what programs outside Python share."""

import importlib.util
import subprocess
from abc import ABC, abstractmethod
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from peers.brake import Brake

LAWS = ("coulomb", "smoothed")


class Answers(NamedTuple):
    """States at the end and time taken.

    states  : (brakes, 2), angle [rad] and velocity [rad/s]
    seconds : for all of them together, without what is compiled or started once
    """

    states: np.ndarray
    seconds: float


class Peer(ABC):
    """A program that follows the motion of brakes from rest.

    name  : of the program, with what is used of it
    asked : the accuracy it is asked for
    law   : "coulomb" or "smoothed"
    lanes : brakes that it is given at once
    slow  : half a minute for a trajectory, so that one case must do
    """

    name: str
    asked: str
    law: str
    lanes = 1
    slow = False

    @abstractmethod
    def missing(self) -> str:
        """Why it cannot run here; "" if it can."""

    @abstractmethod
    def solve(self, brakes: Sequence[Brake], until: float) -> Answers:
        """From rest at t = 0 to ``until`` [s]."""


def absent(module: str) -> str:
    """A word on a Python package that is not installed; "" if it is."""
    return "" if importlib.util.find_spec(module) else "not installed"


def spoken(command: Sequence[str | Path], folder: str | Path, text: str = "") -> str:
    """What a program writes; its last words where it fails."""
    run = subprocess.run(  # noqa: S603 - programs of this machine
        [str(one) for one in command], cwd=folder, input=text, capture_output=True, text=True,
        timeout=3600, check=False,
    )  # fmt: skip
    if run.returncode:
        raise RuntimeError(f"{command[0]} failed: {(run.stdout + run.stderr)[-1000:]}")
    return run.stdout
