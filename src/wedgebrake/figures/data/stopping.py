"""Contents of the picture of a stop."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from wedgebrake.arrays import FloatArray
from wedgebrake.figures.data.panels import Panel, lines_of

if TYPE_CHECKING:
    import xarray as xr


class Bars(NamedTuple):
    """Largest and root mean square jerk of each inertia [rad/s^3]; nan: none."""

    phase: str
    peak: FloatArray
    rms: FloatArray


@dataclass(frozen=True, eq=False)
class StopCurves:
    """A stop: speeds over time, judder over speed, jerk of each inertia.

    panels    : speeds, judder of the speeds, judder of the torques
    inertias  : their names
    jerks     : one for each phase
    sentences : times, heats and torques
    """

    panels: tuple[Panel, ...]
    inertias: tuple[str, ...]
    jerks: tuple[Bars, ...]
    sentences: tuple[str, ...]

    @classmethod
    def of(cls, stopping: xr.Dataset) -> StopCurves:
        """Contents for a dataset of ``wb.stopping``."""
        inertias = tuple(map(str, stopping["inertia"].to_numpy()))
        contacts = tuple(map(str, stopping["contact"].to_numpy()))
        # From the start of the braking, as in "stop_time".
        time = stopping["window_time"].to_numpy() - float(stopping.attrs["start"])
        speed, sliding = (stopping[name].to_numpy() for name in ("mean_speed", "mean_sliding"))
        moving = json.loads(stopping.attrs.get("moving_bases", "{}"))
        # On a moving base, the speed of the stop is that of sliding.
        along = np.column_stack(
            [
                sliding[:, contacts.index(moving[name])] if name in moving else speed[:, i]
                for i, name in enumerate(inertias)
            ]
        )
        judder, torque = (stopping[f"judder_{name}"].to_numpy() for name in ("speed", "torque"))
        what = "mean sliding speed" if set(moving) == set(inertias) else "mean speed"
        panels = (
            Panel(f"{what}  [rad/s]", lines_of(inertias, time, along.T, points=True),
                  "time from the start  [s]", zero=True),
            Panel("judder of the\nspeed  [rad/s]",
                  lines_of(inertias, along, judder.T, points=True),
                  f"{what}  [rad/s]", zero=True),
            Panel("judder of the\ntorque  [N m]",
                  lines_of(contacts, sliding, torque.T, contacts=True, points=True),
                  "mean sliding speed  [rad/s]", zero=True),
        )  # fmt: skip
        peak, rms = (stopping[name].to_numpy() for name in ("peak_jerk", "rms_jerk"))
        phases = stopping["phase"].to_numpy()
        bars = (Bars(str(phase), *pair) for phase, *pair in zip(phases, peak, rms, strict=True))
        jerks = tuple(one for one in bars if np.any(np.isfinite(one.peak)))
        sentences = _sentences(stopping, contacts)
        if moving and set(moving) != set(inertias):
            sentences.append(f"Mean speed of {', '.join(moving)}: the speed of sliding.")
        if jerks:
            sentences.append("Bars: largest jerk; white lines: its root mean square.")
        return cls(panels, inertias, jerks, tuple(sentences))


def _sentences(stopping: xr.Dataset, contacts: tuple[str, ...]) -> list[str]:
    found = [f"Stop after {float(stopping['stop_time']):.5g} s."]
    for i, name in enumerate(contacts):
        heat, mean, peak = (
            float(stopping[key][i]) for key in ("heat", "mean_torque", "peak_torque")
        )
        torques = f", torque {mean:.4g} N m on average, {peak:.4g} N m at most"
        found.append(f"{name}: heat {heat:.5g} J{torques if np.isfinite(mean) else ''}.")
    return found
