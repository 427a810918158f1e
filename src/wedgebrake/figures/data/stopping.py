"""Contents of the picture of a stop."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wedgebrake.figures.data.machine import looks

if TYPE_CHECKING:
    import xarray as xr

FloatArray = NDArray[np.float64]


class Line(NamedTuple):
    """A curve with its name, colour and dashes [pt]."""

    name: str
    x: FloatArray
    y: FloatArray
    colour: str
    dashes: tuple[float, ...]


class LinePanel(NamedTuple):
    """Curves over one quantity, with the labels of the axes."""

    x_label: str
    y_label: str
    lines: tuple[Line, ...]


class Bars(NamedTuple):
    """Largest and root mean square jerk of each inertia [rad/s^3]; nan: none."""

    phase: str
    peak: FloatArray
    rms: FloatArray


@dataclass(frozen=True, eq=False)
class Stop:
    """A stop: speeds over time, judder over speed, jerk of each inertia.

    panels    : speeds, judder of the speeds, judder of the torques
    inertias  : their names
    jerks     : one for each phase
    sentences : times, heats and torques
    """

    panels: tuple[LinePanel, ...]
    inertias: tuple[str, ...]
    jerks: tuple[Bars, ...]
    sentences: tuple[str, ...]

    @classmethod
    def of(cls, stopping: xr.Dataset) -> Stop:
        """Contents for a dataset of ``wb.stopping``."""
        inertias = tuple(map(str, stopping["inertia"].to_numpy()))
        contacts = tuple(map(str, stopping["contact"].to_numpy()))
        # From the start of the braking, as in "stop_time".
        time = stopping["window_time"].to_numpy() - float(stopping.attrs["start"])
        speed, sliding = (stopping[name].to_numpy() for name in ("mean_speed", "mean_sliding"))
        times = np.broadcast_to(time[:, None], speed.shape)
        panels = [
            LinePanel("time from the start  [s]", "mean speed  [rad/s]",
                      _lines(inertias, times, speed)),
            LinePanel("mean speed  [rad/s]", "judder of the\nspeed  [rad/s]",
                      _lines(inertias, speed, stopping["judder_speed"].to_numpy())),
            LinePanel("mean sliding speed  [rad/s]", "judder of the\ntorque  [N m]",
                      _lines(contacts, sliding, stopping["judder_torque"].to_numpy(), True)),
        ]  # fmt: skip
        peak, rms = (stopping[name].to_numpy() for name in ("peak_jerk", "rms_jerk"))
        phases = stopping["phase"].to_numpy()
        bars = (Bars(str(phase), *pair) for phase, *pair in zip(phases, peak, rms, strict=True))
        jerks = tuple(one for one in bars if np.any(np.isfinite(one.peak)))
        return cls(tuple(panels), inertias, jerks, tuple(_sentences(stopping, contacts)))


def _lines(
    names: tuple[str, ...], x: FloatArray, y: FloatArray, contacts: bool = False
) -> tuple[Line, ...]:
    colours, dashes = looks(len(names), contacts=contacts)
    return tuple(
        Line(name, x[:, i], y[:, i], colours[i], dashes[i]) for i, name in enumerate(names)
    )


def _sentences(stopping: xr.Dataset, contacts: tuple[str, ...]) -> list[str]:
    found = [f"Stop after {float(stopping['stop_time']):.5g} s."]
    for i, name in enumerate(contacts):
        heat, mean, peak = (
            float(stopping[key][i]) for key in ("heat", "mean_torque", "peak_torque")
        )
        torques = f", torque {mean:.4g} N m on average, {peak:.4g} N m at most"
        found.append(f"{name}: heat {heat:.5g} J{torques if np.isfinite(mean) else ''}.")
    return found
