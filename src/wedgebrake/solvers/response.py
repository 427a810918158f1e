"""The response: a labelled dataset, units in its attributes."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np

from wedgebrake._version import __version__
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.solvers.solution import FLAGS, Trajectory

if TYPE_CHECKING:
    import xarray as xr


def assemble(
    system: BrakedDriveline, trajectory: Trajectory, method: str, options: dict[str, Any]
) -> xr.Dataset:
    """A solver's answer as a dataset over time, period, event and stick."""
    import xarray as xr

    t, events, sticks = trajectory, trajectory.events, trajectory.sticks
    torque = system.excitation
    section = (
        t.returns.period / torque.frequency
        if system.plain
        else t.returns.period * (torque.period or 0.0)
    )
    drive = torque.torque(t.times) if system.plain else torque(t.times)
    side = "stick: side of entry; otherwise: direction of motion after the event"
    table: dict[str, tuple[Any, str, str]] = {
        "angle": (t.angle, "rad", "angle of the driveline"),
        "velocity": (t.velocity, "rad/s", "velocity of the driveline"),
        "brake_torque": (t.brake_torque, "N m", "torque of the brake R F_mu"),
        "drive_torque": (drive, "N m", "torque on the driveline T(t)"),
        "sticking": (t.sticking.astype(np.int8), "1", "at rest relative to the brake"),
        "poincare_time": (section, "s", "time of the section, period / f_e"),
        "poincare_angle": (t.returns.angle, "rad", "angle at the section"),
        "poincare_velocity": (t.returns.velocity, "rad/s", "velocity at the section"),
        "event_time": (events.time, "s", "time of the event"),
        "event_kind": (events.kind, "1", "kind of the event"),
        "event_angle": (events.angle, "rad", "angle at the event"),
        "event_velocity": (events.velocity, "rad/s", "velocity of the driveline at the event"),
        "event_side": (events.side, "1", side),
        "stick_start": (sticks.start, "s", "beginning of rest"),
        "stick_end": (sticks.end, "s", "end of rest"),
        "stick_entry": (
            sticks.entry, "1", "sign of the sliding velocity before; 0: at rest from the start",
        ),
        "stick_exit": (
            sticks.exit, "1", "sign of the sliding velocity after; 0: still at rest at the end",
        ),
        "time": (t.times, "s", "time"),
        "period": (t.returns.period, "1", "number of periods"),
    }  # fmt: skip
    dimensions = {"poincare": "period", "event": "event", "stick": "stick", "period": "period"}
    dataset = xr.Dataset(
        {
            name: (
                dimensions.get(name.split("_")[0], "time"),
                values,
                {"units": unit, "long_name": meaning, **FLAGS.get(name, {})},
            )
            for name, (values, unit, meaning) in table.items()
        }
    )
    message = " ".join(part for part in (t.status.sentence, t.detail) if part)
    dataset.attrs = {
        "wedgebrake_version": __version__,
        "method": method,
        "options": json.dumps(options),
        "system": json.dumps(system.as_dict()),
        "groups": json.dumps(system.groups.as_dict() if system.plain else {}),
        "status": t.status.value,
        "message": message,
        "final_time": t.final[0],
        "final_angle": t.final[1],
        "final_velocity": t.final[2],
        "work": t.work,
    }
    return dataset
