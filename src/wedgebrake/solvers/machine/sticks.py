"""Intervals of rest, from the events of a machine."""

from __future__ import annotations

from typing import Any

import numpy as np

from wedgebrake.solvers.machine.solve import MachineAnswer
from wedgebrake.solvers.solution import Sticks


def sticks_of(answer: MachineAnswer) -> Sticks:
    """The sticks of all contacts in order."""
    changes = answer.events[answer.events["before"] != answer.events["after"]]
    found: list[list[Any]] = [[], [], [], [], []]
    for contact, side in enumerate(answer.sides):
        own = changes[changes["contact"] == contact]
        rests = np.append(side, own["after"]) == 0
        begin, entry = np.append(answer.start, own["time"]), np.append(0, own["before"])
        end, leaving = np.append(own["time"], answer.final.time), np.append(own["after"], 0)
        columns = (begin, end, np.full(rests.size, contact), entry, leaving)
        for parts, column in zip(found, columns, strict=True):
            parts.append(column[rests])
    start, stop, number, entry, leaving = (
        np.concatenate([*parts, []]).astype(kind) for parts, kind in zip(found, _TYPES, strict=True)
    )
    order = np.lexsort((number, stop, start))
    return Sticks(start[order], stop[order], number[order], entry[order], leaving[order])


_TYPES: tuple[Any, ...] = (np.float64, np.float64, np.int64, np.int8, np.int8)
