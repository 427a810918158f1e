"""Linear stability of sliding over two groups: margins, and where the brake locks."""

from __future__ import annotations

from collections.abc import Hashable, Iterator

import numpy as np

from wedgebrake.analysis.linear_stability import stability_map
from wedgebrake.analysis.linear_stability.damping import is_constant
from wedgebrake.errors import InputError
from wedgebrake.explorer.core.axis import parameter_axis
from wedgebrake.explorer.core.machine import without
from wedgebrake.explorer.core.state import Desk, axes
from wedgebrake.figures.data import class_map
from wedgebrake.figures.data.axes import ParameterAxis
from wedgebrake.figures.data.partial import PartialMap
from wedgebrake.model.brakes import WedgeBrake

# Cells across and up; fewer if each is computed individually.
_CELLS, _FEW_CELLS = (280, 120), (56, 30)


def parameters(desk: Desk) -> tuple[str, str]:
    """The parameters of the map, across and up."""
    return "eta", "alpha" if isinstance(desk.system.brake, WedgeBrake) else "kinetic"


def key(desk: Desk) -> Hashable:
    """Inputs of the map: the axes, and the machine without its torque and the values on the axes.

    Raises ``InputError`` where eta is not defined.
    """
    x, y = _axes(desk)
    untouched = desk.system.replace(amplitude=0.0, frequency=1.0)
    return x, y, without(untouched, (x.name, y.name))


def work(desk: Desk) -> Iterator[PartialMap]:
    """Compute the whole map.

    Raises ``InputError`` where eta is not defined.
    """
    x, y = _axes(desk)
    line = desk.system.driveline
    sliding = desk.system.brake.radius * abs(line.drive_speed)
    wide, high = _CELLS if is_constant(desk.system.friction, sliding) else _FEW_CELLS
    dataset = stability_map(desk.system, **{x.name: x.values(wide), y.name: y.values(high)})
    held = np.zeros(high, dtype=bool)
    if y.name == "alpha" and line.drive_speed == 0.0:
        held = y.values(high) <= (desk.system.groups.static_ratio or 1.0)
    data = class_map.stability_map(dataset, held)
    yield PartialMap((x, y), data, None, data.codes.size, data.codes.size)


def _axes(desk: Desk) -> tuple[ParameterAxis, ParameterAxis]:
    if desk.system.groups.eta is None:
        raise InputError(
            "eta: not defined without damping or friction, and so no margin in it. Raise them;"
            " without damping sliding is linearly stable exactly where the slope of the actuation"
            " force is positive."
        )
    if desk.system.driveline.stiffness == 0.0:
        raise InputError(
            "No map: without a spring nothing brings the driveline back. Raise the stiffness."
        )
    across, up = parameters(desk)
    if up not in axes(desk.system):
        raise InputError(
            "No map: it goes over the kinetic friction coefficient, and a table of friction has"
            " many. Choose Coulomb friction, or a wedge brake, whose map goes over its angle."
        )
    return parameter_axis(desk, across), parameter_axis(desk, up)
