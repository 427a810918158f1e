"""Writing of reports: every command makes one dict, which is printed as JSON or told as text."""

from __future__ import annotations

import json
import math
import platform
from collections.abc import Callable, Collection, Mapping
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
import typer

from wedgebrake._version import __version__
from wedgebrake.model.groups import SETTERS
from wedgebrake.model.system import BrakedDriveline

_LIBRARIES = ("numpy", "scipy", "numba", "xarray", "pydantic")
_FILES = {"picture": "Picture", "data": "Data", "store": "Store"}


def put(as_json: bool, report: dict[str, Any], text: Callable[[], str]) -> None:
    """Print a report as one JSON object, or as text."""
    typer.echo(to_json(report) if as_json else text())


def to_json(report: dict[str, Any]) -> str:
    """One JSON object; infinities are the strings "inf" and "-inf", and nan is null."""
    return json.dumps(_plain(report), allow_nan=False)


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    if isinstance(value, np.ndarray):
        return _plain(value.tolist())
    if isinstance(value, np.generic):
        return _plain(value.item())
    if isinstance(value, float) and not math.isfinite(value):
        return None if math.isnan(value) else str(value)
    return value


def versions() -> dict[str, str]:
    """Of Python and of the libraries that compute."""
    return {
        "python": platform.python_version(),
        **{name: version(name) for name in _LIBRARIES},
    }


def describe(system: BrakedDriveline, swept: Collection[str] = ()) -> str:
    """The system in one line: its brake, friction, and groups that ``swept`` leaves alone."""
    given = system.groups.as_dict()
    groups = [
        f"{name} = {given[name]:.6g}"
        for name, setter in SETTERS.items()
        if given[name] is not None and not {name, setter.target, *setter.reads} & set(swept)
    ]
    friction = type(system.friction).__name__.removesuffix("Friction")
    brake = type(system.brake).__name__.removesuffix("Brake")
    about = ": " + ", ".join(groups) if groups else ""
    return f"{brake} brake, {friction} friction{about}"


def header(system: BrakedDriveline) -> dict[str, Any]:
    """The first entries of a report: versions and machine."""
    return {
        "wedgebrake": __version__,
        "versions": versions(),
        "system": system.as_dict(),
        "groups": system.groups.as_dict(),
    }


def file_lines(files: Mapping[str, Path | str | None]) -> list[str]:
    """A line for each file that was written, "picture", "data" or "store"."""
    return [f"{_FILES[what]}: {path}" for what, path in files.items() if path]


def with_unit(unit: str) -> str:
    """A unit after a number: empty for plain numbers."""
    return "" if unit in ("1", "-") else f" {unit}"


def compiled_note(speed: Mapping[str, Any]) -> str:
    """A note that a time includes the compilation of the kernels, if it does."""
    return "with compilation of the kernels" if speed["with_compilation"] else ""
