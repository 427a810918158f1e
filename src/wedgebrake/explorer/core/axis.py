"""The range of a parameter of the current study as an axis of a picture."""

from __future__ import annotations

from wedgebrake.explorer.core.fields import label, symbol
from wedgebrake.explorer.core.parameter_ranges import scale, span
from wedgebrake.explorer.core.state import Desk
from wedgebrake.figures.data.axes import ParameterAxis, plain
from wedgebrake.model.sweep_settings import sweepable


def parameter_axis(desk: Desk, name: str) -> ParameterAxis:
    """The axis of a parameter.

    Raises ``InputError`` for a parameter that the machine does not have.
    """
    low, high = span(desk, name)
    unit = sweepable(desk.system).get(name, ("1", ""))[0]
    log = scale(name) == "log" and low > 0.0
    return ParameterAxis(name, low, high, log, plain(symbol(name)), label(name), unit)
