"""Intervals of rest, from the events of a machine."""

from __future__ import annotations

from wedgebrake.solvers.machine.solve import MachineAnswer


def stick_rows(answer: MachineAnswer) -> list[tuple[float, float, int, int, int]]:
    """(beginning [s], end [s], contact, side before, side after) of each stick, in order.

    Side 0: at rest from the start on, or still at rest at the end.
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
    return sorted(rows)
