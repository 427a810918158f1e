"""The response: a labelled dataset, units in its attributes."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np

from wedgebrake._version import __version__
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.solvers.solution import EVENT_MEANINGS, SIDE_FLAGS, Trajectory

if TYPE_CHECKING:
    import xarray as xr

_UNITS = {
    "angle": ("rad", "angle of the driveline"),
    "velocity": ("rad/s", "velocity of the driveline"),
    "brake_torque": ("N m", "torque of the brake R F_mu"),
    "drive_torque": ("N m", "torque on the driveline T(t)"),
    "sticking": ("1", "at rest relative to the brake"),
    "poincare_time": ("s", "time of the section, period / f_e"),
    "poincare_angle": ("rad", "angle at the section"),
    "poincare_velocity": ("rad/s", "velocity at the section"),
    "event_time": ("s", "time of the event"),
    "event_kind": ("1", "kind of the event"),
    "event_angle": ("rad", "angle at the event"),
    "event_velocity": ("rad/s", "velocity of the driveline at the event"),
    "event_side": ("1", "stick: side of entry; otherwise: direction of motion after the event"),
    "stick_start": ("s", "beginning of rest"),
    "stick_end": ("s", "end of rest"),
    "stick_entry": ("1", "sign of the sliding velocity before; 0: at rest from the start"),
    "stick_exit": ("1", "sign of the sliding velocity after; 0: still at rest at the end"),
}
_FLAGS: dict[str, dict[str, Any]] = {
    "sticking": {"flag_values": [0, 1], "flag_meanings": "slips sticks"},
    "event_kind": {
        "flag_values": [int(kind) for kind in EVENT_MEANINGS],
        "flag_meanings": " ".join(kind.name.lower() for kind in EVENT_MEANINGS),
    },
    **dict.fromkeys(("event_side", "stick_entry", "stick_exit"), SIDE_FLAGS),
}


def assemble(
    system: BrakedDriveline, trajectory: Trajectory, method: str, options: dict[str, Any]
) -> xr.Dataset:
    """A solver's answer as a dataset over time, period, event and stick."""
    import xarray as xr

    t, events, sticks = trajectory, trajectory.events, trajectory.sticks
    torque = system.excitation
    data: dict[str, tuple[str, Any]] = {
        "angle": ("time", t.angle),
        "velocity": ("time", t.velocity),
        "brake_torque": ("time", t.brake_torque),
        "drive_torque": ("time", torque.torque(t.times)),
        "sticking": ("time", t.sticking.astype(np.int8)),
        "poincare_time": ("period", t.returns.period / torque.frequency),
        "poincare_angle": ("period", t.returns.angle),
        "poincare_velocity": ("period", t.returns.velocity),
        "event_time": ("event", events.time),
        "event_kind": ("event", events.kind),
        "event_angle": ("event", events.angle),
        "event_velocity": ("event", events.velocity),
        "event_side": ("event", events.side),
        "stick_start": ("stick", sticks.start),
        "stick_end": ("stick", sticks.end),
        "stick_entry": ("stick", sticks.entry),
        "stick_exit": ("stick", sticks.exit),
    }
    dataset = xr.Dataset(
        {name: (dim, values, _attributes(name)) for name, (dim, values) in data.items()},
        coords={
            "time": ("time", t.times, {"units": "s", "long_name": "time"}),
            "period": (
                "period",
                t.returns.period,
                {"units": "1", "long_name": "number of periods"},
            ),
        },
    )
    for name, flags in _FLAGS.items():
        dataset[name].attrs.update(flags)
    message = " ".join(part for part in (t.status.sentence, t.detail) if part)
    dataset.attrs = {
        "wedgebrake_version": __version__,
        "method": method,
        "options": json.dumps(options),
        "system": json.dumps(system.as_dict()),
        "groups": json.dumps(system.groups.as_dict()),
        "status": t.status.value,
        "message": message,
        "final_time": t.final[0],
        "final_angle": t.final[1],
        "final_velocity": t.final[2],
        "work": t.work,
    }
    return dataset


def _attributes(name: str) -> dict[str, str]:
    unit, meaning = _UNITS[name]
    return {"units": unit, "long_name": meaning}
