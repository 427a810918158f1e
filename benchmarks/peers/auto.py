"""AUTO-07p on the work that it is made for: the synchronous orbit of the smoothed brake."""

import sys
from pathlib import Path
from typing import NamedTuple

import wedgebrake as wb

sys.path += [str(Path(__file__).parents[2] / folder) for folder in ("tests", "tests/peers")]
# The tests ask AUTO the same way.
import auto_peer

START, END = 12.0, -22.0
STEP = 0.35


class Followed(NamedTuple):
    """A branch: how long it took [s], its orbits, and eta where the period doubles."""

    seconds: float
    orbits: int
    doubling: float


def missing() -> str:
    """Why it cannot run here; "" if it can."""
    return auto_peer.missing()


def follow(machine: wb.BrakedDriveline, intervals: int) -> Followed:
    """With some intervals of the collocation; 400 resolve the layer about zero velocity."""
    made = auto_peer.branch(machine, "eta", END, step=STEP, intervals=intervals)
    return Followed(made.seconds, made.values.size, made.of("PD")[0].value)
