"""Sweeps and stability limits on the page of a machine: requests, computation and pictures."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from wedgebrake.analysis.linear_stability import stability_limits
from wedgebrake.analysis.motion import returns_name
from wedgebrake.errors import InputError
from wedgebrake.explorer.core.limits import MOST_EVENTS
from wedgebrake.explorer.core.progressive_sweep import ProgressiveSweep
from wedgebrake.figures.data.response_diagram import RESPONSE
from wedgebrake.figures.matplotlib.bifurcation import bifurcation
from wedgebrake.figures.matplotlib.maps import regime_map
from wedgebrake.figures.matplotlib.save import image
from wedgebrake.figures.matplotlib.speed_limits import stability_limits as draw_limits
from wedgebrake.figures.style import PAGE
from wedgebrake.model.machine import Machine
from wedgebrake.model.study import Study
from wedgebrake.model.sweep_settings import sweepable
from wedgebrake.model.validation import check_number
from wedgebrake.sweeps.compute import chunks_of
from wedgebrake.sweeps.sweep import make_plan

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
    "stick_share": "Share of time stuck",
}
"""Pictures over two parameters, by name."""
# Values of a parameter in a diagram and in a map, first and after refinement.
_DIAGRAM, _MAP = ((16,), (64,)), ((8, 8), (24, 24))
# Largest number of returns until a motion has settled, and of those that are recorded.
_LONGEST, _RECORDED = 1000, 50
# Time between pictures [s]; drawing one takes a quarter of a second.
_STEP = 2.0
# Width of a picture in pixels.
_WIDTH = 1500
_FARTHEST = 1e300


@dataclass(frozen=True)
class SweepOrder:
    """A request for a picture on the page of a machine.

    picture   : of ``DIAGRAMS``, or of ``MAPS`` with a second parameter
    parameter, low, high : dotted name and range
    second, low_second, high_second : the same for the second parameter; an empty name for none
    follow    : whether each value starts from the final state of its neighbour, up and down
    inertia, contact : parts whose results are shown; None for the first
    """

    picture: str
    parameter: str
    low: float
    high: float
    second: str = ""
    low_second: float = 0.0
    high_second: float = 1.0
    follow: bool = False
    inertia: str | None = None
    contact: str | None = None


@dataclass(frozen=True)
class SweepPicture:
    """A picture as PNG, with the progress of its computation in words."""

    picture: bytes
    progress: str


def choices(machine: Machine) -> dict[str, str]:
    """The parameters that can be swept: dotted names, and names with units."""
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


def sweep_pictures(study: Study, order: SweepOrder) -> Iterator[SweepPicture]:
    """Compute a sweep or the limits, first on a coarse grid, and yield pictures of it.

    Raises ``InputError`` for invalid ranges, and as ``wb.sweep`` and ``wb.stability_limits``.
    """
    machine: Any = study.system
    if order.picture == LIMITS:
        figure = draw_limits(stability_limits(machine))
        yield SweepPicture(image(figure, "png", width=_WIDTH), "")
        return
    for dataset, progress in sweep_datasets(study, order):
        yield SweepPicture(_drawn(dataset, order), progress)


def sweep_datasets(study: Study, order: SweepOrder) -> Iterator[tuple[xr.Dataset, str]]:
    """Yield results of the sweep, first on a coarse grid, with the progress in words.

    Raises ``InputError`` for invalid ranges, and as ``wb.sweep``.
    """
    machine: Any = study.system
    spans = {order.parameter: (order.low, order.high)}
    if order.second:
        if order.second == order.parameter:
            raise InputError(f"{order.second}: chosen twice. Choose two different parameters.")
        spans[order.second] = (order.low_second, order.high_second)
    known = sweepable(machine)
    for name, ends in spans.items():
        if name not in known:
            raise InputError(f"{name}: no such parameter of this machine.")
        _check_ends(name, *ends)
    run, settings = study.run, dict(_settings(machine))
    settings |= {"max_events": min(run.max_events, MOST_EVENTS // 4)}
    if run.method is not None:
        settings["method"] = run.method
    yield from _refined(machine, spans, order, settings)
    if order.follow and not order.second:
        yield from _followed(machine, spans, order, settings)


def _settings(machine: Machine) -> dict[str, Any]:
    return {returns_name(machine): _RECORDED, "limit": _LONGEST, "transient": "auto"}


def _check_ends(name: str, low: float, high: float) -> None:
    for end in (low, high):
        check_number(name, end, -_FARTHEST, _FARTHEST)
    if not low < high:
        raise InputError(
            f"{name}: the range from {low:g} to {high:g} is empty. Its end must be above its start."
        )


def _refined(
    machine: Machine, spans: dict[str, tuple[float, float]], order: SweepOrder, settings: Any
) -> Iterator[tuple[xr.Dataset, str]]:
    """Yield results of a sweep in which each value starts from the initial state."""
    levels = _MAP if order.second else _DIAGRAM
    values = {
        name: np.linspace(*span, count)
        for (name, span), count in zip(spans.items(), levels[-1], strict=True)
    }
    keeps = order.picture in ("velocity", "angle")
    sweep = ProgressiveSweep(machine, values, levels, keep_points=keeps, **settings)
    before = sweep.level
    whole = math.prod(levels[-1])
    for _ in sweep.steps(_STEP, _STEP):
        if order.second:
            if sweep.level == before:  # a map needs a complete grid
                continue
            places = sweep.complete_places()
        else:
            places = [np.flatnonzero(sweep.known)]
        before = sweep.level
        dataset = sweep.dataset().isel(dict(zip(spans, places, strict=True)))
        done = int(sweep.known.sum())
        words = f"{done} of {whole} points" if done < whole else ""
        if order.follow and not order.second:
            words = "Each value from the initial state; the sweep up and down follows."
        yield dataset, words


def _followed(
    machine: Machine, spans: dict[str, tuple[float, float]], order: SweepOrder, settings: Any
) -> Iterator[tuple[xr.Dataset, str]]:
    """Yield the result of a sweep up and down."""
    values = {name: np.linspace(*span, _DIAGRAM[-1][0]) for name, span in spans.items()}
    plan = make_plan("bifurcation", machine, values, follow=order.parameter, **settings)
    chunk = chunks_of(plan)({dim: slice(0, size) for dim, size in plan.grid.sizes.items()})
    for work in chunk.work:
        work()
    yield plan.dataset(chunk.results()), ""


def _drawn(dataset: Any, order: SweepOrder) -> bytes:
    draw: Callable[..., Any] = regime_map if order.second else bifurcation
    figure = draw(dataset, order.picture, inertia=order.inertia, contact=order.contact, width=PAGE)
    return image(figure, "png", width=_WIDTH)
