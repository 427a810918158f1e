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
    changes = answer.events[answer.events["before"] != answer.events["after"]]
    found = []
    for contact, side in enumerate(answer.sides):
        own = changes[changes["contact"] == contact]
        begin, entry = np.append(answer.start, own["time"]), np.append(0, own["before"])
        end, leaving = np.append(own["time"], answer.final.time), np.append(own["after"], 0)
        rests = np.append(side, own["after"]) == 0
        rows = np.empty(int(rests.sum()), _STICK)
        columns = {"start": begin, "end": end, "entry": entry, "exit": leaving}
        for name, values in columns.items():
            rows[name] = values[rests]
        rows["contact"] = contact
        found.append(rows)
    rows = np.concatenate(found) if found else np.empty(0, _STICK)
    return rows[np.lexsort((rows["contact"], rows["end"], rows["start"]))]
