"""Contents of the pictures of a machine with several inertias: panels over time."""

from __future__ import annotations

import itertools
import json
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wedgebrake.analysis.datasets import check_machine_response
from wedgebrake.figures import style
from wedgebrake.model.validation import check_number

if TYPE_CHECKING:
    import xarray as xr

FloatArray = NDArray[np.float64]

# Largest number of names of one kind in a sentence; more are counted.
_MOST_NAMES = 6
# Panels: variable, its dimension, label of the axis, relative height, and whether a legend names
# the curves. Contacts have the same colours in all panels.
_PANELS = (
    ("velocity", "inertia", "speed [rad/s]", 1.7, True),
    ("sliding_velocity", "contact", "sliding\nspeed [rad/s]", 1.0, True),
    ("brake_torque", "contact", "contact\ntorque [N m]", 1.0, False),
    ("actuation_force", "contact", "actuation\nforce [N]", 0.8, False),
    ("shaft_torque", "shaft", "shaft\ntorque [N m]", 1.0, True),
    ("torque", "inertia", "external\ntorque [N m]", 0.8, True),
)


class Curve(NamedTuple):
    """One line of a panel: its name, its values over the times, colour and dashes [pt]."""

    name: str
    values: FloatArray
    colour: str
    dashes: tuple[float, ...]


class Panel(NamedTuple):
    """Curves that share an axis.

    height : relative to the other panels
    legend : whether the curves are named above the panel
    """

    variable: str
    label: str
    height: float
    legend: bool
    curves: tuple[Curve, ...]


class Rests(NamedTuple):
    """Intervals during which one contact sticks: (k,) beginnings and ends [s], its colour."""

    name: str
    start: FloatArray
    end: FloatArray
    colour: str


@dataclass(frozen=True, eq=False)
class MachineHistory:
    """Motion of a machine between two times.

    begin, end : of the window [s]
    time       : (n,) [s]
    panels     : one for each variable that the machine has
    rests      : one for each contact, clipped to the window
    sentences  : on the machine and, if the run ended early, on its end
    """

    begin: float
    end: float
    time: FloatArray
    panels: tuple[Panel, ...]
    rests: tuple[Rests, ...]
    sentences: tuple[str, ...]

    @classmethod
    def of(
        cls, response: xr.Dataset, start: float | None = None, stop: float | None = None
    ) -> MachineHistory:
        """Contents for the response of a machine between two times [s]; None: first or last time.

        Raises ``InputError`` for other datasets and for times outside the response.
        """
        check_machine_response(response)
        begin, end = _window(response, start, stop)
        time = response["time"].to_numpy()
        shown = (time >= begin) & (time <= end)
        part = response.isel(time=np.flatnonzero(shown))
        sentences = (describe(response), ended(response))
        return cls(
            begin,
            end,
            time[shown],
            tuple(_panels(part)),
            tuple(_rests(response, begin, end)),
            tuple(filter(None, sentences)),
        )


def _window(response: xr.Dataset, start: float | None, stop: float | None) -> tuple[float, float]:
    first, last = (float(response.attrs[name]) for name in ("start_time", "final_time"))
    begin = first if start is None else check_number("start", start, first, last)
    end = last if stop is None else check_number("stop", stop, begin, last)
    return begin, end


def _panels(response: xr.Dataset) -> list[Panel]:
    """The panels, without those of parts that the machine does not have."""
    found, acting = [], _torques(response)
    for variable, kind, label, height, legend in _PANELS:
        names = [str(name) for name in response[kind].to_numpy()]
        values = response[variable].to_numpy()
        colours, dashes = looks(len(names), contacts=kind == "contact")
        curves = tuple(
            Curve(
                acting.get(name, name) if variable == "torque" else name,
                values[:, i], colours[i], dashes[i],
            )
            for i, name in enumerate(names)
            # Inertias without an external torque are not listed.
            if variable != "torque" or np.any(values[:, i] != 0.0)
        )  # fmt: skip
        if curves:
            found.append(Panel(variable, label, height, legend, curves))
    return found


def _torques(response: xr.Dataset) -> dict[str, str]:
    """The external torques on each inertia: their names."""
    tables = json.loads(response.attrs.get("system", "{}")).get("torque", [])
    found: dict[str, list[str]] = {}
    for one in tables:
        found.setdefault(one["on"], []).append(one["name"])
    return {inertia: " + ".join(names) for inertia, names in found.items()}


def _rests(response: xr.Dataset, begin: float, end: float) -> list[Rests]:
    """The sticks of each contact that overlap a window, clipped to it."""
    names = response["contact"].to_numpy()
    colours, _ = looks(len(names), contacts=True)
    start, stop = response["stick_start"].to_numpy(), response["stick_end"].to_numpy()
    inside = (stop > begin) & (start < end)
    found = []
    for number, (name, colour) in enumerate(zip(names, colours, strict=True)):
        chosen = inside & (response["stick_contact"].to_numpy() == number)
        cut = np.maximum(start[chosen], begin), np.minimum(stop[chosen], end)
        found.append(Rests(str(name), *cut, colour))
    return found


def looks(count: int, *, contacts: bool) -> tuple[list[str], list[tuple[float, ...]]]:
    """Colours and dashes of ``count`` contacts or other parts; dashes once all colours are used."""
    colours = style.CONTACTS if contacts else style.PARTS
    rounds = math.ceil(count / len(colours)) or 1
    dashed = itertools.islice(itertools.cycle(((), (4.0, 1.5), (1.2, 1.2))), rounds)
    pairs = [(colour, dashes) for dashes in dashed for colour in colours][:count]
    return [colour for colour, _ in pairs], [dashes for _, dashes in pairs]


def describe(response: xr.Dataset) -> str:
    """The machine of a response: the names of its inertias, shafts and contacts."""
    words = []
    for kind, plural in (("inertia", "inertias"), ("shaft", "shafts"), ("contact", "contacts")):
        names = [str(name) for name in response[kind].to_numpy()]
        if len(names) > _MOST_NAMES:
            words.append(f"{len(names)} {plural}")
        elif names:
            words.append(f"{plural if len(names) > 1 else kind} {', '.join(names)}")
    return f"Machine: {'; '.join(words)}"


def ended(response: xr.Dataset) -> str:
    """How a run ended; empty if it reached the requested time."""
    status = str(response.attrs.get("status", "completed"))
    if status == "completed" and not response.attrs.get("at_rest"):
        return ""
    return str(response.attrs.get("message", status))
