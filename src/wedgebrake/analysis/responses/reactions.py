"""What controllers, joints and driven bodies have done in a response."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from wedgebrake.analysis.responses.machine_series import largest, machine_series, series
from wedgebrake.analysis.responses.repeat import run_of, solved, system_of
from wedgebrake.arrays import FloatArray
from wedgebrake.solvers.response import drive_torques, shaft_torques, torques_of_joints

if TYPE_CHECKING:
    import xarray as xr

    from wedgebrake.analysis.responses.machine_series import MachineSeries

Summary = dict[str, dict[str, float]]


def reaction_summary(response: xr.Dataset) -> dict[str, Summary]:
    """Extremes of what controllers, joints and driven bodies do, also between the samples.

    By part and its name: "controllers" with the lowest, highest and final output [N or N m] and
    ``time_at_limits`` [s]; "joints" and "driven" with ``peak_torque`` [N m], the largest magnitude.
    Kinds of parts that the machine does not have are left out, and all if the run has no duration.

    Raises ``InputError`` for a response that cannot be repeated, or has too many vibrations.
    """
    machine, task = run_of(response)
    if task.end <= task.start or not (machine.controllers or machine.joints or machine.driven):
        return {}
    # Not ``machine``, whose contacts with driven bodies have moving bases instead.
    system: Any = system_of(response)
    motion = machine_series(machine, task, solved(machine, task))
    values: dict[str, Any] = {
        "time": motion.times, "angle": motion.angle, "velocity": motion.speed,
        "torque": motion.external, "brake_torque": -motion.torque,
        "shaft_torque": shaft_torques(system, motion.angle, motion.speed),
    }  # fmt: skip
    found: dict[str, Summary] = {}
    if system.controllers:
        found["controllers"] = {
            one.name: _outputs(motion, number, one.limits)
            for number, one in enumerate(system.controllers)
        }
    if system.joints:
        values["joint_torque"] = torques_of_joints(system, values)
        found["joints"] = _peaks([one.name for one in system.joints], values["joint_torque"])
    if system.driven:
        torques = drive_torques(system, values)
        found["driven"] = _peaks([one.name for one in system.driven], torques)
    return found


def _outputs(
    motion: MachineSeries, number: int, limits: tuple[float, float] | None
) -> dict[str, float]:
    """Extremes and final value of the output of a controller, and its time at limits."""
    output = motion.control[..., number]
    low, high = float(np.min(output, initial=np.inf)), float(np.max(output, initial=-np.inf))
    # Of a difference that has one sign, the largest magnitude is the largest value.
    rise, fall = (largest(series(one[..., None])).item() for one in (output - low, high - output))
    at_limits = np.isin(output, limits or ()).all(axis=1)
    return {
        "lowest_output": high - fall,
        "highest_output": low + rise,
        "final_output": float(np.sum(series(output)[-1:])),
        "time_at_limits": float(motion.length[at_limits].sum()),
    }


def _peaks(names: list[str], torques: FloatArray) -> Summary:
    """The largest magnitude of the torque of each part, from values at nodes."""
    peaks = largest(series(torques))
    return {name: {"peak_torque": float(one)} for name, one in zip(names, peaks, strict=True)}
