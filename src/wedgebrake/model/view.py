"""How the results of a machine are shown for a system that says it in another way."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple


class View(NamedTuple):
    """A view of the results of a machine.

    single   : name of the only part along each dimension that is left out
    names    : names of variables, by those of a machine
    recorded : whether responses have the states at events and at whole periods of the torque, and
               by default a whole number of samples in each period
    """

    single: Mapping[str, str] = {}
    names: Mapping[str, str] = {}
    recorded: bool = False


MACHINE = View()
DRIVELINE = View(
    {"inertia": "driveline", "shaft": "shaft", "contact": "brake"},
    {"torque": "drive_torque"},
    recorded=True,
)
