"""Which quantity of a system each column of a trace measures."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from wedgebrake.analysis.fitting.trace import name_and_unit, not_numbers
from wedgebrake.arrays import FloatArray
from wedgebrake.errors import InputError, nearest
from wedgebrake.model.units import factor_of
from wedgebrake.model.validation import unknown, wrong
from wedgebrake.solvers.layout import VARIABLES

if TYPE_CHECKING:
    import xarray as xr

    from wedgebrake.analysis.fitting.trace import Trace
    from wedgebrake.model.machine import Machine
    from wedgebrake.model.system import BrakedDriveline

# Quantities by kind of part: the word after the dot, and the variable of a response.
_WORDS = {
    "inertia": {"angle": "angle", "speed": "velocity"},
    "shaft": {"torque": "shaft_torque"},
    "contact": {"torque": "brake_torque", "force": "actuation_force"},
}


class Observation(NamedTuple):
    """A column that measures a quantity.

    column   : name in the trace
    quantity : as named by the user
    variable : of a response, and of its derivatives
    part     : along the dimension ``kind`` of the variable
    """

    column: str
    quantity: str
    variable: str
    kind: str
    part: str
    unit: str

    def of(self, response: xr.Dataset) -> FloatArray:
        """The quantity in a response, or in its derivatives; time is the last dimension."""
        found = response[self.variable]
        if self.kind in found.dims:
            found = found.sel({self.kind: self.part})
        return found.transpose(..., "time").to_numpy()


def quantities_of(system: BrakedDriveline | Machine) -> dict[str, tuple[str, str, str, str]]:
    """What can be observed: variable, kind of part, part and unit, by name.

    The names are those of parts, ``"disc.speed"``, ``"brake.torque"``; where there is one part of a
    kind also those of the response, ``"velocity"``, ``"brake_torque"``.
    """
    parts, found = system.machine.parts_along, dict[str, tuple[str, str, str, str]]()
    for kind, words in _WORDS.items():
        for word, variable in words.items():
            unit = VARIABLES[variable][1]["units"]
            named = {f"{part.name}.{word}": str(part.name) for part in parts[kind]}
            if len(named) == 1:
                named = {variable: next(iter(named.values())), **named}
            found |= {name: (variable, kind, part, unit) for name, part in named.items()}
    return found


def named_quantities(
    trace: Trace, known: Mapping[str, tuple[str, str, str, str]]
) -> dict[str, str]:
    """The quantity of each column that has the name of one, and its unit if it has a unit."""
    found = {}
    for column in trace.columns:
        name, unit = name_and_unit(column)[0], trace.units.get(column, "")
        if name in known and (not unit or factor_of(unit, known[name][-1]) is not None):
            found[column] = name
    return found


def observations_of(
    system: BrakedDriveline | Machine, trace: Trace, given: Mapping[str, str] | None
) -> list[Observation]:
    """The columns that are fitted.

    given : quantity by column; None: the columns that have the name of a quantity

    Raises ``InputError`` for unknown columns and quantities, and if there are none.
    """
    known = quantities_of(system)
    if given is None:
        given = named_quantities(trace, known)
        if not given:
            raise InputError(
                "observe: missing, as no column of the trace has the name of a quantity."
                f" Columns: {', '.join(trace.columns)}. Quantities: {', '.join(known)}.",
                name="observe", value=None, allowed=tuple(known),
            )  # fmt: skip
    if not isinstance(given, Mapping) or not given:
        raise wrong(
            "observe", given, 'a mapping of columns to quantities, as {"velocity": "disc.speed"}',
            f"Columns: {', '.join(trace.columns)}. Quantities: {', '.join(known)}.",
        )  # fmt: skip
    found = []
    for column, quantity in given.items():
        if column in trace.texts:
            raise not_numbers(column, trace.texts[column])
        if column not in trace.columns:
            raise unknown("observe", column, list(trace.columns), "no such column")
        if quantity not in known:
            raise InputError(
                f"observe[{column!r}] = {quantity!r}: no such quantity."
                f" {nearest(str(quantity), known)}",
                name=f"observe[{column!r}]", value=quantity, allowed=tuple(known),
            )  # fmt: skip
        if np.count_nonzero(np.isfinite(trace.columns[column])) < 4:
            raise wrong(f"trace[{column!r}]", "nan", "a column with at least 4 numbers")
        found.append(Observation(column, quantity, *known[quantity]))
    return found


def settings_of(observations: list[Observation]) -> dict[str, Any]:
    """What can be free besides parameters: their values where they are not."""
    scales = {f"{one.column}.scale": 1.0 for one in observations}
    return {"time_shift": 0.0, **scales, **{f"{one.column}.offset": 0.0 for one in observations}}
