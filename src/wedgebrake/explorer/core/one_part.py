"""One inertia and one contact of a response or a system, in the form of a driveline."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from wedgebrake.arrays import FloatArray
from wedgebrake.figures.data.parts import of_one_part
from wedgebrake.model.machine_parts import Contact
from wedgebrake.model.system_base import System

if TYPE_CHECKING:
    import xarray as xr

    from wedgebrake.explorer.core.state import PageState

# Distance of a sample from the beginning of a period, as a share of it.
_SAME = 1e-6


def is_one_brake(system: System) -> bool:
    """True for one brake on one inertia with a shaft and a torque, of which there is a drawing."""
    machine = system.machine
    others = [*machine.joints, *machine.controllers]
    return (
        len(machine.inertias) == len(machine.contacts) == 1
        and isinstance(machine.contacts[0], Contact)
        and max(len(machine.shafts), len(machine.torques)) <= 1
        and all(one.law is None for one in machine.shafts)
        and all(one.over_time is not None for one in machine.torques)
        and not others
    )


def one_part(response: xr.Dataset, state: PageState) -> xr.Dataset:
    """The response of the inertia and the contact of a page.

    It has the variables of the response of a driveline.
    """
    found = of_one_part(response, state.inertia, state.contact)
    if "poincare_time" in found:
        return found
    return found.assign(_returns(found, state)).assign_coords(period=_numbers(found, state))


def _numbers(found: xr.Dataset, state: PageState) -> FloatArray:
    """Numbers of the periods of the signals that begin at a sample."""
    period, time = state.system.period, found["time"].to_numpy()
    if not period or not time.size:
        return np.zeros(0)
    turns = (time - state.study.run.start_time) / period
    return np.asarray(np.round(turns[np.abs(turns - np.round(turns)) < _SAME]))


def _returns(found: xr.Dataset, state: PageState) -> dict[str, Any]:
    numbers, time = _numbers(found, state), found["time"].to_numpy()
    times = state.study.run.start_time + numbers * (state.system.period or math.nan)
    values = {"time": times}
    for name in ("angle", "velocity"):
        # Interpolation between samples serves only to select them.
        values[name] = np.interp(times, time, found[name].to_numpy()) if numbers.size else times
    return {f"poincare_{name}": ("period", one) for name, one in values.items()}
