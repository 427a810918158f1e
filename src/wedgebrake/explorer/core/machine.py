"""The machine on the desk as pictures over its parameters compute it."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any

from wedgebrake.explorer.core.evaluation import method
from wedgebrake.explorer.core.limits import MOST_EVENTS, MOST_STEPS
from wedgebrake.explorer.core.state import Desk
from wedgebrake.model.groups import SETTERS
from wedgebrake.model.system import BrakedDriveline

# One of many points may take so much less than the one run that is looked at.
_SHARE = 4


def following(system: BrakedDriveline) -> BrakedDriveline:
    """The machine, where static friction equals kinetic friction so that it stays equal.

    As on the desk, where an edit of the one moves the other.
    """
    friction = system.friction
    fields = type(friction).model_fields
    if not {"kinetic", "static"} <= set(fields) or friction.reference != friction.static:  # type: ignore[attr-defined]
        return system
    values = {name: getattr(friction, name) for name in fields if name != "static"}
    return system.replace(friction=type(friction)(**values))


def without(system: BrakedDriveline, names: Sequence[str]) -> str:
    """All of a machine but the parameters that some names set, to be compared."""
    dropped = {SETTERS[name].target if name in SETTERS else name for name in names}
    if "kinetic" in dropped and following(system) is not system:
        dropped.add("static")
    tables = {
        part: {name: value for name, value in table.items() if name not in dropped}
        for part, table in system.as_dict().items()
    }
    return json.dumps(tables)


def slow(desk: Desk) -> bool:
    """Return True if the solver takes small steps. Raises ``InputError`` as ``judging`` does."""
    return method(desk) != "exact"


def settings(desk: Desk) -> dict[str, Any]:
    """Arguments of a sweep that say how each run is computed, plain and hashable."""
    run = desk.study.run
    # The fixed steps of ode14x are as many as the time needs.
    share = 1 if run.method == "ode14x" else _SHARE
    return {
        "initial": run.initial,
        "method": run.method,
        "rtol": run.rtol,
        "step": run.step,
        "max_events": min(run.max_events, MOST_EVENTS // _SHARE),
        "max_steps": min(run.max_steps, MOST_STEPS // share),
    }
