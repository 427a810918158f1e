"""Sweeps and stability limits on the page of a machine: requests, computation and pictures."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from wedgebrake.analysis.linear_stability import stability_limits
from wedgebrake.errors import InputError
from wedgebrake.explorer.core.formatting import check_span
from wedgebrake.explorer.core.limits import MOST_EVENTS
from wedgebrake.explorer.core.progressive_sweep import ProgressiveSweep, followed
from wedgebrake.figures.data.response_diagram import RESPONSE
from wedgebrake.figures.matplotlib.bifurcation import bifurcation
from wedgebrake.figures.matplotlib.maps import regime_map
from wedgebrake.figures.matplotlib.save import image
from wedgebrake.figures.matplotlib.speed_limits import stability_limits as draw_limits
from wedgebrake.figures.style import PAGE
from wedgebrake.model.machine import Machine
from wedgebrake.model.studies.study import Study
from wedgebrake.model.studies.sweep_settings import sweepable

if TYPE_CHECKING:
    import xarray as xr


LIMITS = "limits"
"""Name of the picture of the stability limits over the speed."""
DIAGRAMS = {
    RESPONSE: "Amplitudes (response diagram)",
    "velocity": "Poincaré points, speed",
    "angle": "Poincaré points, angle",
    LIMITS: "Linear stability over the speed",
}
"""Pictures over one parameter, by name."""
MAPS = {
    "motion": "Class of motion",
    "stick_class": "Class of stick-slip",
    "rms_velocity": "Speed, rms",
    "peak_torque": "Torque, peak",
    "rms_torque": "Torque, rms",
    "rms_jerk": "Jerk, rms",
    "stick_share": "Share of time at rest",
}
"""Pictures over two parameters, by name."""
# Values of a parameter in a diagram and in a map, first and after refinement.
_DIAGRAM: Sequence[tuple[int, ...]] = ((16,), (64,))
_MAP: Sequence[tuple[int, ...]] = ((8, 8), (24, 24))
# Largest number of returns until a motion has settled, and of those that are recorded.
_LONGEST, _RECORDED = 1000, 50
# Time between pictures [s]; drawing one takes a quarter of a second.
_STEP = 2.0
# Width of a picture in pixels.
_WIDTH = 1500


@dataclass(frozen=True)
class SweepRequest:
    """A request for a picture on the page of a machine.

    picture : of ``DIAGRAMS``, or of ``MAPS`` with a second parameter
    ranges  : of one or two parameters: dotted name, first and last value
    follow  : whether each value starts from the final state of its neighbour, up and down; only
              for one parameter
    inertia, contact : parts whose results are shown; None for the first
    """

    picture: str
    ranges: tuple[tuple[str, float, float], ...]
    follow: bool = False
    inertia: str | None = None
    contact: str | None = None


class SweepPicture(NamedTuple):
    """A picture as PNG, with the progress of its computation in words."""

    picture: bytes
    progress: str


def parameter_labels(machine: Machine) -> dict[str, str]:
    """The parameters that can be swept: names with units, by dotted name."""
    return {
        name: f"{name}  [{unit.replace('^2', '²')}]" if unit not in ("1", "-") else name
        for name, (unit, _) in sweepable(machine).items()
    }


def usual_parameter(machine: Machine) -> str:
    """The parameter offered first: a base speed, a frequency or the slope of an actuator."""
    known = machine.parameters()
    for ending in (".base_speed", ".frequency", ".slope"):
        for name, value in known.items():
            if name.endswith(ending) and (value != 0.0 or ending == ".slope"):
                return name
    return next(iter(known))


def usual_range(machine: Machine, name: str) -> tuple[float, float]:
    """A range about the present value of a parameter."""
    value = machine.parameters().get(name, 0.0)
    if value == 0.0:
        return 0.0, 1.0
    ends = 0.2 * value, 3.0 * value
    low, high = (float(f"{one:.3g}") for one in sorted(ends))
    return low, high


def sweep_pictures(study: Study, request: SweepRequest) -> Iterator[SweepPicture]:
    """Compute a sweep or the limits, first on a coarse grid, and yield pictures of it.

    Raises ``InputError`` for invalid ranges, and as ``wb.sweep`` and ``wb.stability_limits``.
    """
    if request.picture == LIMITS:
        machine: Any = study.system
        yield SweepPicture(image(draw_limits(stability_limits(machine)), "png", width=_WIDTH), "")
        return
    draw: Callable[..., Any] = regime_map if len(request.ranges) > 1 else bifurcation
    parts = {"inertia": request.inertia, "contact": request.contact}
    for dataset, progress in sweep_datasets(study, request):
        figure = draw(dataset, request.picture, **parts, width=PAGE)
        yield SweepPicture(image(figure, "png", width=_WIDTH), progress)


def sweep_datasets(study: Study, request: SweepRequest) -> Iterator[tuple[xr.Dataset, str]]:
    """Yield results of the sweep, first on a coarse grid, with the progress in words.

    Raises ``InputError`` for invalid ranges, and as ``wb.sweep``.
    """
    machine: Any = study.system
    levels = _MAP if len(request.ranges) > 1 else _DIAGRAM
    values = {
        name: np.linspace(*check_span(name, low, high), count)
        for (name, low, high), count in zip(request.ranges, levels[-1], strict=True)
    }
    if len(values) < len(request.ranges):
        raise InputError(f"{request.ranges[0][0]}: chosen twice. Choose two different parameters.")
    settings: dict[str, Any] = {
        machine.returns: _RECORDED,
        "limit": _LONGEST,
        "transient": "auto",
        "max_events": min(study.run.max_events, MOST_EVENTS // 4),
        "method": study.run.method,
    }
    keeps = request.picture in ("velocity", "angle")
    sweep = ProgressiveSweep(machine, values, levels, keep_points=keeps, **settings)
    before = sweep.level
    for _ in sweep.steps(_STEP, _STEP):
        places = sweep.complete_places()
        if len(values) == 1:
            places = [np.flatnonzero(sweep.known)]
        elif sweep.level == before:  # a map needs a complete grid
            continue
        before = sweep.level
        done, whole = int(sweep.known.sum()), sweep.known.size
        words = f"{done} of {whole} points" if done < whole else ""
        if request.follow:
            words = "Each value from the initial state; the sweep up and down follows."
        yield sweep.dataset().isel(dict(zip(values, places, strict=True))), words
    if request.follow:
        yield followed(machine, values, **settings), ""
