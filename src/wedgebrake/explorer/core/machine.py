"""Inputs of sweeps over the parameters of the current study."""

from __future__ import annotations

import json
from collections.abc import Hashable, Sequence
from typing import Any

from wedgebrake.explorer.core.axis import parameter_axis
from wedgebrake.explorer.core.evaluation import judging, method
from wedgebrake.explorer.core.limits import COARSE_MAP, FINE_MAP, MOST_EVENTS, MOST_STEPS
from wedgebrake.explorer.core.progressive_sweep import ProgressiveSweep
from wedgebrake.explorer.core.state import Desk
from wedgebrake.figures.data.axes import ParameterAxis
from wedgebrake.model.groups import SETTERS
from wedgebrake.model.system import BrakedDriveline

# The limits of one of many points are smaller by this factor than those of the single run.
_SHARE = 4


def following(system: BrakedDriveline) -> BrakedDriveline:
    """The machine with static friction that follows kinetic friction if they are equal now.

    An edit of kinetic friction on the page moves static friction in the same way.
    """
    friction = system.friction
    fields = type(friction).model_fields
    if not {"kinetic", "static"} <= set(fields) or friction.reference != friction.static:  # type: ignore[attr-defined]
        return system
    values = {name: getattr(friction, name) for name in fields if name != "static"}
    return system.replace(friction=type(friction)(**values))


def without(system: BrakedDriveline, names: Sequence[str]) -> str:
    """All of a machine except the parameters that some names set, as text to be compared."""
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
    """Arguments of a sweep that set how each run is computed, plain and hashable."""
    run = desk.study.run
    # The number of fixed steps of ode14x follows from the time.
    share = 1 if run.method == "ode14x" else _SHARE
    return {
        "initial": run.initial,
        "method": run.method,
        "rtol": run.rtol,
        "step": run.step,
        "max_events": min(run.max_events, MOST_EVENTS // _SHARE),
        "max_steps": min(run.max_steps, MOST_STEPS // share),
    }


def sweep_key(desk: Desk, names: Sequence[str], *, initial: bool = True) -> Hashable:
    """All inputs of a sweep over some parameters; of these, the ends of their axes alone.

    initial : False if the initial state of the run is not an input
    """
    run = {name: value for name, value in settings(desk).items() if initial or name != "initial"}
    return (
        *(parameter_axis(desk, name) for name in names),
        without(desk.system, names),
        tuple(judging(desk).items()),
        tuple(run.items()),
    )


def new_sweep(
    desk: Desk, axes: Sequence[ParameterAxis], levels: Sequence[tuple[int, ...]], **options: Any
) -> ProgressiveSweep:
    """A sweep over some axes, as many values along each as in the last of the levels.

    Raises ``InputError`` as ``wb.sweep`` does.
    """
    values = {axis.name: axis.values(count) for axis, count in zip(axes, levels[-1], strict=True)}
    arguments = {**judging(desk), **settings(desk), **options}
    return ProgressiveSweep(following(desk.system), values, levels, **arguments)


def map_levels(few: bool) -> list[tuple[int, int]]:
    """Rows and columns of the successive grids of a map; fewer for a slow solver."""
    (width, height), (most_wide, most_high) = COARSE_MAP, FINE_MAP
    if few:
        return [(height // 4, width // 4), (height // 2, width // 2), (height, width)]
    return [(height, width), (most_high // 2, most_wide // 2), (most_high, most_wide)]
