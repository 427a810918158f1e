"""Output of commands: one dict as JSON or as text, and files."""

from __future__ import annotations

import json
import math
import platform
import secrets
from collections.abc import Callable, Collection, Mapping
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

import numpy as np
import typer

from wedgebrake._version import __version__
from wedgebrake.dynamics.enums import EventKind
from wedgebrake.errors import InputError, WedgebrakeError
from wedgebrake.model.display import counted
from wedgebrake.model.exports import SUFFIXES, check_format, write_result
from wedgebrake.model.machine import Machine
from wedgebrake.model.system import BrakedDriveline

if TYPE_CHECKING:
    import xarray as xr

_ROUNDING = 1e-9
_LIBRARIES = ("numpy", "scipy", "numba", "xarray", "pydantic")
_Error = TypeVar("_Error", bound=WedgebrakeError)


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
    if isinstance(value, np.ndarray | np.generic):
        return _plain(value.tolist())
    if isinstance(value, float) and not math.isfinite(value):
        return None if math.isnan(value) else str(value)
    return value


def versions() -> dict[str, Any]:
    """Versions of wedgebrake, of Python and of the numerical libraries."""
    libraries = {name: version(name) for name in _LIBRARIES}
    return {
        "wedgebrake": __version__,
        "versions": {"python": platform.python_version(), **libraries},
    }


def header(system: BrakedDriveline | Machine) -> dict[str, Any]:
    """The first entries of a report."""
    groups = {"groups": system.groups.as_dict()} if system.groups.defined else {}
    return {**versions(), "system": system.as_dict(), **groups}


def describe(system: BrakedDriveline | Machine, swept: Collection[str] = ()) -> str:
    """The system in one line, without groups that the ``swept`` parameters change."""
    return system.summary(swept)


def event_counts(response: xr.Dataset) -> dict[str, int]:
    """Number of events of each kind in a response."""
    kinds, counts = np.unique(response["event_kind"].to_numpy(), return_counts=True)
    each = zip(kinds, counts, strict=True)
    return {EventKind(kind).name.lower(): int(count) for kind, count in each}


def events_line(report: dict[str, Any]) -> str:
    """The entry "events" of a report as a line of text."""
    words = [
        counted(count, name) if "_" not in name else f"{name.replace('_', ' ')} {count} times"
        for name, count in report["events"].items()
    ]
    return f"  events: {', '.join(words) or 'none'}"


def nearly_zero(value: float, scale: float) -> float:
    """A value for display: 0 if it is rounding beside a scale."""
    return 0.0 if abs(value) <= _ROUNDING * abs(scale) else value


def with_unit(unit: str) -> str:
    """A unit after a number: empty for plain numbers."""
    return "" if unit in ("1", "-") else f" {unit}"


def timed(what: str, speed: Mapping[str, Any]) -> str:
    """Duration of the computation of ``what``, from the entry "speed" of a report."""
    rate = speed.get("points_per_second")
    notes = [f"{rate:.3g} points/s"] if rate else []
    notes += ["with compilation of the kernels"] if speed["with_compilation"] else []
    return f"{what} in {speed['seconds']:.3g} s" + (f" ({', '.join(notes)})" if notes else "")


def check_target(option: str, path: Path, suffixes: tuple[str, ...]) -> None:
    """Refuse a path that could not be written, before the computation.

    Raises ``InputError`` that names the option, the path and a remedy.
    """
    if path.suffix.lower() not in suffixes:
        raise InputError(
            f"{option} {path}: must end in {', '.join(suffixes)}; the suffix sets the format. For"
            f" example {option} run{suffixes[0]}."
        )
    check_folder(option, path, path.parent)
    if path.is_dir():
        raise InputError(f"{option} {path}: is a directory. Give the name of a file.")


def check_folder(option: str, path: Path, folder: Path) -> None:
    """Refuse a path if no new file can be created in a folder, such as its own.

    Raises ``InputError`` that names the option, the path and a remedy.
    """
    beside = folder / f".{path.name}.{secrets.token_hex(6)}.part"
    try:
        try:
            beside.touch(exist_ok=False)
        finally:
            beside.unlink(missing_ok=True)
    except FileNotFoundError:
        there = folder.is_dir()
        what = "is not writable. Choose" if there else "does not exist. Create it, or choose"
        raise InputError(
            f"{option} {path}: cannot be written: the folder {folder} {what} another one."
        ) from None
    except (OSError, ValueError) as error:
        why = getattr(error, "strerror", None) or error
        raise InputError(
            f"{option} {path}: cannot be written ({why}). Choose another name or folder."
        ) from None


class Output(NamedTuple):
    """Where a command writes its result; the paths are those of ``--out`` and ``--plot``."""

    data: Path | None
    picture: Path | None
    as_json: bool

    def check(self) -> None:
        """Refuse files that could not be written; see ``check_target``."""
        if self.data is not None:
            check_target("--out", self.data, SUFFIXES)
            check_format(f"--out {self.data}", self.data.suffix.lower())
        if self.picture is not None:
            check_target("--plot", self.picture, (".png", ".svg", ".pdf"))

    def finish(
        self,
        report: dict[str, Any],
        text: Callable[[], str],
        dataset: Any,
        drawn: Callable[[], tuple[Any, Mapping[str, Any]]],
        store: Path | None = None,
    ) -> None:
        """Write the requested files, and print the report even if one of them fails.

        report  : receives the paths of the files, if it has an entry for them
        dataset : for ``--out``
        drawn   : returns what ``--plot`` draws: a result, and options of ``wb.plot``

        Raises the first error of a file.
        """

        def save_picture(path: Path) -> None:
            from wedgebrake.figures.matplotlib.draw import plot
            from wedgebrake.figures.matplotlib.save import save

            result, options = drawn()
            save(plot(result, **options), path)

        places: dict[str, Path | None] = {"picture": None, "data": None, "store": store}
        errors: list[WedgebrakeError] = []
        for what, option, path, write in (
            ("data", "--out", self.data, lambda path: write_result(dataset, path)),
            ("picture", "--plot", self.picture, save_picture),
        ):
            try:
                if path is not None:
                    write(path)
                    places[what] = path
            except WedgebrakeError as error:
                errors.append(of_option(error, option, path))
        written = {what: str(path.resolve()) for what, path in places.items() if path is not None}
        if "files" in report:
            report["files"] |= written
        lines = [f"{what.capitalize()}: {path}" for what, path in written.items()]
        put(self.as_json, report, lambda: "\n".join([text(), *lines]))
        if errors:
            raise errors[0]


def of_option(error: _Error, option: str, path: Path | None) -> _Error:
    """An error that names the option instead of the argument ``path``, ``start`` or ``stop``."""
    names = {"start": "--from", "stop": "--to"}
    if error.name in names:
        return error.renamed(lambda name: names.get(name, name), " ")
    if path is None or error.name != "path":
        return error
    return error.renamed(lambda _: option, " ", str(path))
