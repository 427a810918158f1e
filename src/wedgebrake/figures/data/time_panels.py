"""All parts of a response over time: panels of speeds, torques and forces, and the sticks."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import cycle
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from wedgebrake.analysis.responses.repeat import complete
from wedgebrake.analysis.responses.sticking import span
from wedgebrake.arrays import FloatArray
from wedgebrake.figures import style
from wedgebrake.figures.data import caption
from wedgebrake.figures.data.panels import Panel, StyledLine, lines_of
from wedgebrake.model.torque_contacts import Drag
from wedgebrake.model.validation import check_number

if TYPE_CHECKING:
    import xarray as xr


# Panels: variable, its dimension, label of the axis, relative height, and whether a legend names
# the curves. Contacts have the same colours in all panels.
_PANELS = (
    ("velocity", "inertia", "speed [rad/s]", 1.7, True),
    ("sliding_velocity", "contact", "sliding\nspeed [rad/s]", 1.0, True),
    ("brake_torque", "contact", "contact\ntorque [N m]", 1.0, False),
    ("actuation_force", "contact", "actuation\nforce [N]", 0.8, False),
    ("shaft_torque", "shaft", "shaft\ntorque [N m]", 1.0, True),
    ("joint_torque", "joint", "joint\ntorque [N m]", 0.8, True),
    ("control_output", "controller", "output\n[N or N m]", 0.8, True),
    ("torque", "inertia", "external\ntorque [N m]", 0.8, True),
)
# Curves get panels of their own beside others that are larger by more than this factor.
_APART = 20.0
# Widths of the first and last curve of a panel [pt]: coinciding curves stay visible.
_WIDTHS = 1.4, 0.8


class StickIntervals(NamedTuple):
    """Intervals during which one contact sticks: (k,) beginnings and ends [s], its colour."""

    name: str
    start: FloatArray
    end: FloatArray
    colour: str


@dataclass(frozen=True, eq=False)
class TimePanels:
    """Motion of all parts between two times.

    begin, end : of the window [s]
    time       : (n,) [s]
    panels     : of each variable that the machine has; several where sizes are very different
    sticks     : one for each contact that can stick, clipped to the window
    sentences  : on the machine and, if the run ended early, on its end
    """

    begin: float
    end: float
    time: FloatArray
    panels: dict[str, list[Panel]]
    sticks: tuple[StickIntervals, ...]
    sentences: tuple[str, ...]

    @classmethod
    def of(
        cls, response: xr.Dataset, start: float | None = None, stop: float | None = None
    ) -> TimePanels:
        """Contents for a response between two times [s]; None: first or last time.

        Raises ``InputError`` for other datasets and for times outside the response.
        """
        response = complete(response)
        begin, end = span(response)
        begin = begin if start is None else check_number("start", start, begin, end)
        end = end if stop is None else check_number("stop", stop, begin, end)
        time = response["time"].to_numpy()
        shown = (time >= begin) & (time <= end)
        part = response.isel(time=np.flatnonzero(shown))
        sentences = (describe(response), end_message(response))
        return cls(
            begin,
            end,
            time[shown],
            _panels(part, time[shown]),
            tuple(_sticks(response, begin, end)),
            tuple(filter(None, sentences)),
        )


def _panels(response: xr.Dataset, time: FloatArray) -> dict[str, list[Panel]]:
    """The panels of each variable, without those of parts that the machine does not have."""
    found, acting = {}, _torques(_tables(response))
    for variable, kind, label, height, legend in _PANELS:
        if variable not in response:
            continue
        names = [str(name) for name in response[kind].to_numpy()]
        lines = lines_of(names, time, response[variable].to_numpy().T, contacts=kind == "contact")
        if variable == "torque":  # inertias without an external torque are not listed
            lines = tuple(
                one._replace(name=acting.get(one.name, one.name))
                for one in lines
                if np.any(one.y != 0.0)
            )
        lines = tuple(one for one in lines if not np.all(np.isnan(one.y)))
        if lines:
            found[variable] = [
                Panel(label, group, height=height, legend=legend) for group in _groups(lines)
            ]
    return found


def _groups(lines: tuple[StyledLine, ...]) -> Iterator[tuple[StyledLine, ...]]:
    """Curves of comparable size, the largest first; those that are zero are with the smallest."""
    sizes = [float(np.max(np.abs(one.y), initial=0.0, where=np.isfinite(one.y))) for one in lines]
    left = list(range(len(lines)))
    while left:
        largest = max(sizes[i] for i in left)
        group = [i for i in left if sizes[i] * _APART >= largest]
        left = [i for i in left if i not in group]
        if not any(sizes[i] for i in left):
            group, left = sorted(group + left), []
        widths = np.linspace(*_WIDTHS, len(group)) if len(group) > 1 else [0.9]
        yield tuple(
            lines[i]._replace(width=float(width)) for i, width in zip(group, widths, strict=True)
        )


def _tables(response: xr.Dataset) -> dict[str, list[dict[str, Any]]]:
    """The parts of the machine of a response, by the names of their tables."""
    found: dict[str, list[dict[str, Any]]] = json.loads(response.attrs.get("system", "{}"))
    return found


def _torques(tables: dict[str, list[dict[str, Any]]]) -> dict[str, str]:
    found: dict[str, list[str]] = {}
    for one in tables.get("torque", []):
        for inertia in {one["on"], one.get("relative_to") or one["on"]}:
            found.setdefault(inertia, []).append(one["name"])
    return {inertia: " + ".join(names) for inertia, names in found.items()}


def _sticks(response: xr.Dataset, begin: float, end: float) -> list[StickIntervals]:
    """The sticks of each contact that overlap a window, clipped to it; none of drag."""
    names = response["contact"].to_numpy()
    start, stop = response["stick_start"].to_numpy(), response["stick_end"].to_numpy()
    inside = (stop > begin) & (start < end)
    found, never = [], [one["name"] for one in _tables(response).get(Drag.table, [])]
    for number, (name, colour) in enumerate(zip(names, cycle(style.CONTACTS), strict=False)):
        if name in never:
            continue
        chosen = inside & (response["stick_contact"].to_numpy() == number)
        cut = np.maximum(start[chosen], begin), np.minimum(stop[chosen], end)
        found.append(StickIntervals(str(name), *cut, colour))
    return found


def describe(response: xr.Dataset) -> str:
    """The machine of a response: the names of its inertias, shafts and contacts."""
    parts = {kind: response[kind].to_numpy().tolist() for kind in ("inertia", "shaft", "contact")}
    words = [caption.listed(kind, names) for kind, names in parts.items() if names]
    return f"Machine: {'; '.join(words)}"


def end_message(response: xr.Dataset) -> str:
    """How a run ended; empty if it reached the requested time."""
    status = str(response.attrs.get("status", "completed"))
    if status == "completed" and not response.attrs.get("at_rest"):
        return ""
    return str(response.attrs.get("message", status))
