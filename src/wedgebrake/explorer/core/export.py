"""Export of the current study as pictures, data, a study file or a program."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib.util import find_spec
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

from wedgebrake._version import __version__
from wedgebrake.analysis.linear_stability import stability_map
from wedgebrake.errors import InputError, nearest
from wedgebrake.explorer.core.calls import picture, run
from wedgebrake.explorer.core.machine import following, settings
from wedgebrake.explorer.core.program import samples, snippet
from wedgebrake.explorer.core.snapshot import look
from wedgebrake.explorer.core.state import Desk
from wedgebrake.explorer.core.studies import filed
from wedgebrake.figures.matplotlib.draw import plot
from wedgebrake.figures.matplotlib.save import image
from wedgebrake.figures.matplotlib.style import PAGE
from wedgebrake.model.netcdf import netcdf
from wedgebrake.model.validation import shown
from wedgebrake.solvers.simulate import simulate
from wedgebrake.sweeps.basins import basins
from wedgebrake.sweeps.sweep import bifurcation, regime_map

if TYPE_CHECKING:
    import xarray as xr

_MIME = {
    "png": "image/png",
    "svg": "image/svg+xml",
    "nc": "application/x-netcdf",
    "csv": "text/csv",
    "toml": "application/toml",
    "py": "text/x-python",
}
_COLUMNS = {
    "time": "s",
    "angle": "rad",
    "velocity": "rad/s",
    "brake_torque": "N m",
    "drive_torque": "N m",
    "sticking": "1",
}
_SWEEPS: dict[str, Callable[..., Any]] = {
    "bifurcation": bifurcation,
    "regime_map": regime_map,
    "basins": basins,
}


Progress = Callable[[Any], None]


def _unheard(_: Any) -> None:
    """Ignore the progress."""


@dataclass(frozen=True)
class File:
    """A file: its name, its media type, and what stands in it."""

    name: str
    mime: str
    content: bytes


def export(desk: Desk, kind: str, progress: Progress = _unheard) -> File:
    """Return the current study as a file of one of the kinds in ``FORMATS``.

    progress : called while a picture is computed, as by ``wb.sweep``; its exceptions end the export

    Raises ``InputError`` for another kind, and where this machine or this installation has no
    such file.
    """
    if not isinstance(kind, str) or kind not in FORMATS:
        raise InputError(f"format = {shown(kind)}: not known. {nearest(str(kind), FORMATS)}")
    name, make = FORMATS[kind]
    name = name.replace("{plate}", desk.view.plate)
    content = make(desk, progress)
    return File(name, _MIME[name.rpartition(".")[2]], content)


def _response(desk: Desk) -> xr.Dataset:
    """The whole run."""
    return simulate(
        desk.system,
        periods=desk.periods,
        start_time=desk.study.run.start_time,
        samples_per_period=samples(desk),
        **{**run(desk), **desk.limits},
    )


def _overview(desk: Desk, kind: str) -> bytes:
    """The response, with the class of its motion."""
    return image(plot(_response(desk), verdict=look(desk, settle=True).motion.verdict), kind)


def _diagram(desk: Desk, kind: str, progress: Progress) -> bytes:
    """The open picture, as fine as the page draws it."""
    call = picture(desk)
    values = {
        name: (np.geomspace if scale == "log" else np.linspace)(first, last, number)
        for name, (first, last, number, scale) in call.axes.items()
    }
    options: dict[str, Any] = {"width": PAGE}
    if call.function == "stability_map":
        return image(plot(stability_map(desk.system, **values), **options), kind)
    limits = {name: settings(desk)[name] for name in ("max_events", "max_steps")}
    swept = _SWEEPS[call.function](
        following(desk.system), **values, **{**call.options, **limits}, progress=progress
    )
    if call.function == "bifurcation":
        options["quantity"] = desk.view.quantity
    return image(plot(swept, **options), kind)


def _netcdf(desk: Desk) -> bytes:
    missing = [name for name in ("h5netcdf", "h5py") if find_spec(name) is None]
    if missing:
        raise InputError(
            f"format = 'netcdf': needs {' and '.join(missing)} where the explorer runs. Install the"
            " extra: pip install 'wedgebrake[netcdf]'; or export CSV."
        )
    return netcdf(_response(desk))


def _csv(desk: Desk) -> bytes:
    """The samples of the whole run to the last digit, below lines that say what they are."""
    response = _response(desk)
    about = {
        "wedgebrake": __version__,
        "system": response.attrs["system"],
        "options": response.attrs["options"],
        "status": response.attrs["status"],
        "message": response.attrs["message"],
    }
    lines = [f"# {name}: {value}" for name, value in about.items()]
    lines.append(",".join(f"{name} [{unit}]" for name, unit in _COLUMNS.items()))
    columns = [response[name].to_numpy().tolist() for name in _COLUMNS]
    lines += [",".join(map(repr, row)) for row in zip(*columns, strict=True)]
    return ("\n".join(lines) + "\n").encode()


FORMATS: Mapping[str, tuple[str, Callable[[Desk, Progress], bytes]]] = MappingProxyType(
    {
        "png": ("response.png", lambda desk, _: _overview(desk, "png")),
        "svg": ("response.svg", lambda desk, _: _overview(desk, "svg")),
        "diagram-png": ("{plate}.png", lambda desk, heed: _diagram(desk, "png", heed)),
        "diagram-svg": ("{plate}.svg", lambda desk, heed: _diagram(desk, "svg", heed)),
        "netcdf": ("response.nc", lambda desk, _: _netcdf(desk)),
        "csv": ("response.csv", lambda desk, _: _csv(desk)),
        "study": ("study.toml", lambda desk, _: filed(desk).to_toml().encode()),
        "python": ("wedgebrake_study.py", lambda desk, _: snippet(desk).encode()),
    }
)
"""Kinds of files: name of the file, and what makes its content."""
