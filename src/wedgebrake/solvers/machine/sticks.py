"""Intervals of rest, from the events of a machine."""

from __future__ import annotations

import numpy as np

from wedgebrake.solvers.machine.solve import MachineAnswer
from wedgebrake.solvers.solution import Sticks


def sticks_of(answer: MachineAnswer) -> Sticks:
    """The sticks of all contacts in order."""
    changes = answer.events[answer.events["before"] != answer.events["after"]]
    found = []
    for contact, side in enumerate(answer.sides):
        own = changes[changes["contact"] == contact]
        rests = np.append(side, own["after"]) == 0
        begin, entry = np.append(answer.start, own["time"]), np.append(0, own["before"])
        end, leaving = np.append(own["time"], answer.final.time), np.append(own["after"], 0)
        columns = (begin, end, np.full(rests.size, contact), entry, leaving)
        found.append([one[rests] for one in columns])
    start, stop, contact, entry, leaving = (
        np.concatenate([one[k] for one in found]) if found else np.empty(0) for k in range(5)
    )
    order = np.lexsort((contact, stop, start))
    columns = (one[order] for one in (start, stop, contact, entry, leaving))
    return Sticks(*(one.astype(kind) for one, kind in zip(columns, _TYPES, strict=True)))


_TYPES = (np.float64, np.float64, np.int64, np.int8, np.int8)
