"""The displayed run and picture as calls of public functions."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from wedgebrake.explorer.core import basins, diagram, regimes, stability
from wedgebrake.explorer.core.axis import parameter_axis
from wedgebrake.explorer.core.evaluation import judging
from wedgebrake.explorer.core.limits import COARSE_MAP, COARSE_POINTS, FINE_MAP, FINE_POINTS
from wedgebrake.explorer.core.machine import slow
from wedgebrake.explorer.core.state import Desk
from wedgebrake.model.part import Part


@dataclass(frozen=True)
class Picture:
    """Return the call of a public function that computes the open picture.

    function : its name
    axes     : parameters with (first, last, number, scale)
    options  : other arguments than their defaults
    """

    function: str
    axes: dict[str, tuple[float, float, int, str]]
    options: dict[str, Any]


def run(desk: Desk) -> dict[str, Any]:
    """Arguments of ``wb.simulate`` and its relatives that say how a run is computed.

    Those alone that differ from their defaults.
    """
    names = ("initial", "method", "rtol", "step", "max_events", "max_steps")
    return chosen(desk.study.run, names)


def chosen(part: Part, names: tuple[str, ...] = ()) -> dict[str, Any]:
    """Values of a part other than their defaults, of all fields or of some."""
    values = dict(part)
    found = {}
    for name, field in type(part).model_fields.items():
        default = field.get_default(call_default_factory=True, validated_data=values)
        if (not names or name in names) and (field.is_required() or values[name] != default):
            found[name] = values[name]
    return found


def picture(desk: Desk) -> Picture:
    """The open picture as a call, with as many values as the page draws at last.

    Raises ``InputError`` where there is none of this machine.
    """
    how = run(desk)
    judged = {**judging(desk), **how}
    if desk.view.plate == "diagram":
        points = COARSE_POINTS if slow(desk) else FINE_POINTS
        return Picture("bifurcation", _axes(desk, (diagram.parameter(desk),), (points,)), judged)
    cells = COARSE_MAP if slow(desk) else FINE_MAP
    if desk.view.plate == "regimes":
        return Picture("regime_map", _axes(desk, regimes.parameters(desk), cells), judged)
    if desk.view.plate == "basins":
        judged.pop("initial", None)
        return Picture("basins", _axes(desk, basins.parameters(desk), cells), judged)
    stability.key(desk)  # refuses what has no such map
    return Picture("stability_map", _axes(desk, stability.parameters(desk), FINE_MAP), {})


def _axes(
    desk: Desk, names: tuple[str, ...], counts: tuple[int, ...]
) -> dict[str, tuple[float, float, int, str]]:
    found = {name: parameter_axis(desk, name) for name in names}
    return {
        name: (one.low, one.high, count, "log" if one.log else "linear")
        for (name, one), count in zip(found.items(), counts, strict=True)
    }
