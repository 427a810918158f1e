"""Export of the current study as charts, data, a study file or a program."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

import wedgebrake as wb
from wedgebrake.explorer.core.computation import linked_friction, sweep_settings
from wedgebrake.explorer.core.program import length, picture, run, shown, snippet
from wedgebrake.explorer.core.snapshot import take_snapshot
from wedgebrake.explorer.core.state import PageState
from wedgebrake.explorer.core.studies import study_of
from wedgebrake.figures.matplotlib.draw import plot
from wedgebrake.figures.matplotlib.save import image
from wedgebrake.figures.matplotlib.style import PAGE
from wedgebrake.model.exports import check_format, content
from wedgebrake.model.validation import check_choice
from wedgebrake.solvers.simulate import simulate

if TYPE_CHECKING:
    import xarray as xr

Progress = Callable[[Any], None]


class File(NamedTuple):
    """A file: its name and its content."""

    name: str
    content: bytes


def export(state: PageState, kind: str, progress: Progress = lambda _: None) -> File:
    """Return the current study as a file of one of the kinds in ``FORMATS``.

    progress : called while a plot is computed, as by ``wb.sweep``; its exceptions end the export

    Raises ``InputError`` for an unknown kind, and if the system or the installation does
    not support the format.
    """
    name, make = FORMATS[check_choice("format", kind, FORMATS)]
    return File(name.replace("{plot}", state.view.plot), make(state, progress))


def _response(state: PageState) -> xr.Dataset:
    return simulate(
        state.system,
        **{**length(state), **run(state), **state.limits},
    )


def _overview(state: PageState, kind: str) -> bytes:
    if not state.counted:
        return image(plot(_response(state)), kind)
    found = take_snapshot(state, settle=True).motion
    return image(plot(_response(state), verdict="" if found is None else found.verdict), kind)


def _computed(state: PageState, progress: Progress) -> xr.Dataset:
    """The result that the open plot shows, at the finest resolution of the page."""
    call = picture(state)
    if call.function == "response_curve":
        ends = {name: (first, last) for name, (first, last, *_) in call.axes.items()}
        system = linked_friction(state, call.options["levels"])
        return wb.response_curve(system, ends, **call.options, progress=progress)
    values = {
        name: (np.geomspace if scale == "log" else np.linspace)(first, last, number)
        for name, (first, last, number, scale) in call.axes.items()
    }
    if call.function == "stability_map":
        return wb.stability_map(state.system, values)
    settings = sweep_settings(state)
    limits = {name: one for name, one in settings.items() if name.startswith("max_")}
    found: xr.Dataset = getattr(wb, call.function)(
        linked_friction(state, values), values, **{**call.options, **limits}, progress=progress
    )
    return found


def _diagram(state: PageState, kind: str, progress: Progress) -> bytes:
    """The open plot as a picture."""
    options: dict[str, Any] = {"width": PAGE, **shown(state)}
    if state.inertia is not None and state.view.plot not in ("basins", "stability"):
        options |= {"inertia": state.inertia, "contact": state.contact}
    return image(plot(_computed(state, progress), **options), kind)


def _data(state: PageState, suffix: str) -> bytes:
    check_format(f"format = {suffix[1:]!r}", suffix)
    return content(_response(state), suffix)


FORMATS: Mapping[str, tuple[str, Callable[[PageState, Progress], bytes]]] = MappingProxyType(
    {
        "png": ("response.png", lambda state, _: _overview(state, "png")),
        "svg": ("response.svg", lambda state, _: _overview(state, "svg")),
        "diagram-png": ("{plot}.png", lambda state, progress: _diagram(state, "png", progress)),
        "diagram-svg": ("{plot}.svg", lambda state, progress: _diagram(state, "svg", progress)),
        "diagram-csv": (
            "{plot}.csv",
            lambda state, progress: content(_computed(state, progress), ".csv"),
        ),
        "netcdf": ("response.nc", lambda state, _: _data(state, ".nc")),
        "csv": ("response.csv", lambda state, _: _data(state, ".csv")),
        "mat": ("response.mat", lambda state, _: _data(state, ".mat")),
        "study": ("study.toml", lambda state, _: study_of(state).to_toml().encode()),
        "python": ("wedgebrake_study.py", lambda state, _: snippet(state).encode()),
    }
)
"""Kinds of files: name of the file, and the function that returns its content."""
