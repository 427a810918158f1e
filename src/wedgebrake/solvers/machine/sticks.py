"""Intervals of rest, from the events of a machine."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from wedgebrake.solvers.machine.solve import MachineAnswer

_STICK = np.dtype(
    [("start", "f8"), ("end", "f8"), ("contact", "i8"), ("entry", "i1"), ("exit", "i1")]
)


def stick_rows(answer: MachineAnswer) -> NDArray[np.void]:
    """The sticks in order: ``start``, ``end`` [s], ``contact``, sides before and after.

    The side before, ``entry``, is 0 if it rests from the start on, and the side after, ``exit``,
    if it still rests at the end.
    """
    end = answer.final.time
    rows = []
    for contact, side in enumerate(answer.sides):
        begin, entry, resting = answer.start, 0, side == 0
        for event in answer.events[answer.events["contact"] == contact]:
            before, after = int(event["before"]), int(event["after"])
            if before == after:
                continue
            if resting:
                rows.append((begin, float(event["time"]), contact, entry, after))
            begin, entry, resting = float(event["time"]), before, after == 0
        if resting:
            rows.append((begin, end, contact, entry, 0))
    return np.array(sorted(rows), _STICK)
