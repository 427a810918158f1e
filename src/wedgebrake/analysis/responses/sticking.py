"""Sticks, the intervals of rest relative to the brake, and the class of stick-slip."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np

from wedgebrake.analysis.responses.datasets import (
    attributes,
    dataset_over,
    of_part,
)
from wedgebrake.dynamics.enums import StickClass
from wedgebrake.model.validation import SECONDS, check_number, wrong
from wedgebrake.solvers.layout import SIDE_FLAGS, full

if TYPE_CHECKING:
    import xarray as xr

AT_REST, NON_STICK_SLIP, UNIDIRECTIONAL, BIDIRECTIONAL = (
    one.word for one in StickClass if one is not StickClass.NONE
)
# The paper simulates 25 s and takes the last 5 s as the steady motion (its section 4).
STEADY_SHARE = 0.2
# Slip for less than this fraction of a window is rounding.
_NO_SLIP = 1e-12

_SPEC = {
    "start": ("s", "beginning of rest"),
    "end": ("s", "end of rest"),
    "duration": ("s", "length of rest"),
    "entry": ("1", "sign of the sliding velocity before; 0: at rest from the start"),
    "exit": ("1", "sign of the sliding velocity after; 0: still at rest at the end"),
}


def sticks(
    response: xr.Dataset, start: float | None = None, *, contact: str | None = None
) -> xr.Dataset:
    """Return the sticks of a response that end after ``start``.

    They are exact for "exact" responses. With smooth laws and in responses of ``wb.paper.ode14x``,
    where the velocity never rests, they are the intervals inside the steep layer of the friction
    law.

    Parameters
    ----------
    response : xarray.Dataset
        As returned by ``simulate``.
    start : float
        Beginning of the window [s]; the window ends where the response does. Default: the
        whole response, but only its last fifth for the class.
    contact : str
        Name of the contact; default: the only one.

    Returns
    -------
    xarray.Dataset
        Over ``stick``: start, end, duration [s], whole even if cut by the window; entry
        and exit: sign of the sliding velocity before and after, 0 if there is none.
        ``attrs``: window_start, window_end [s]; count, the sticks entered from slip inside
        the window, and of these count_forward (entry > 0) and count_backward; share of
        the window spent at rest [1]; class, that of ``stick_slip_class`` from
        class_start [s] on; status and message of the response.

    Raises
    ------
    InputError
        For a dataset without sticks' variables, a start outside the response, or an unknown
        contact.
    """
    response = _of_contact(response, contact)
    begin, end = span(response)
    low = begin if start is None else inside(start, begin, end)
    class_start = steady_start(response) if start is None else low
    data = _window(response, low, end)
    entered = data["entry"][data["start"] >= low]
    dataset = dataset_over("stick", _SPEC, data)
    for name in ("entry", "exit"):
        dataset[name].attrs.update(SIDE_FLAGS)
    dataset.attrs = {
        "window_start": low,
        "window_end": end,
        "count": int(np.count_nonzero(entered)),
        "count_forward": int(np.count_nonzero(entered > 0)),
        "count_backward": int(np.count_nonzero(entered < 0)),
        "share": _share(data, low, end),
        "class": _class(response, class_start, end),
        "class_start": class_start,
        **attributes(response, "status", "message"),
    }
    return dataset


def _of_contact(response: xr.Dataset, contact: str | None) -> xr.Dataset:
    """A response with the sticks of one contact."""
    response = full(response)
    chosen = of_part(response, "contact", contact, "contact")
    number = response["contact"].to_numpy().tolist().index(chosen["contact"].item())
    return chosen.isel(stick=np.flatnonzero(chosen["stick_contact"].to_numpy() == number))


def stick_slip_class(
    response: xr.Dataset, start: float | None = None, contact: str | None = None
) -> str:
    """Return the class of stick-slip from ``start`` on (docs/numerics.md, "Classes of stick-slip").

    "at rest"                   : no slip at all
    "non-stick-slip"            : slip without sticks
    "unidirectional stick-slip" : sticks are entered from one direction of motion only
    "bidirectional stick-slip"  : from both

    A stick counts if it is entered, from slip, inside the window. ``start`` [s] defaults
    to the last fifth of the response, as the paper takes the last 5 s of 25 s.

    Raises ``InputError`` as ``sticks`` does.
    """
    response = _of_contact(response, contact)
    begin, end = span(response)
    low = steady_start(response) if start is None else inside(start, begin, end)
    return _class(response, low, end)


def _class(response: xr.Dataset, low: float, end: float) -> str:
    """The class of stick-slip of one contact between two times."""
    data = _window(response, low, end)
    if _share(data, low, end) >= 1.0 - _NO_SLIP:
        return AT_REST
    sides = set(np.sign(data["entry"][data["start"] >= low]).tolist()) - {0}
    return (NON_STICK_SLIP, UNIDIRECTIONAL, BIDIRECTIONAL)[len(sides)]


def span(response: xr.Dataset) -> tuple[float, float]:
    """Return the first and last time of a response [s], whether sampled or not."""
    if "stick_start" not in getattr(response, "data_vars", {}):
        raise wrong(
            "response", response, "a dataset with stick_start, stick_end and stick_entry",
            "Use the result of wb.simulate(...).",
        )  # fmt: skip
    times = response["time"].to_numpy() if "time" in response.coords else np.empty(0)
    first = float(times[0]) if times.size else 0.0
    last = float(times[-1]) if times.size else first
    options = json.loads(response.attrs.get("options", "{}"))
    first = float(options.get("start_time", response.attrs.get("start_time", first)))
    return first, float(response.attrs.get("final_time", last))


def steady_start(response: xr.Dataset) -> float:
    """Return the start of the last fifth of a response [s], taken as its steady motion."""
    begin, end = span(response)
    return end - STEADY_SHARE * (end - begin)


def inside(value: Any, begin: float, end: float, name: str = "start") -> float:
    """Return a time [s]; raise ``InputError`` if it is not a time of the response."""
    check_number(name, value, allowed=SECONDS)
    if not begin <= value <= end:
        raise wrong(
            name, value, f"a time of the response, {begin:g} s to {end:g} s",
            "Choose one there, or simulate for longer.",
        )  # fmt: skip
    return float(value)


def _window(response: xr.Dataset, low: float, end: float) -> dict[str, Any]:
    """Sticks that overlap the window from low to end."""
    names = ("start", "end", "entry", "exit")
    data = {name: response[f"stick_{name}"].to_numpy() for name in names}
    data["duration"] = data["end"] - data["start"]
    starts, ends = data["start"], data["end"]
    part = (starts <= end) & ((ends > low) | (starts >= low) | (ends >= end))
    return {name: values[part] for name, values in data.items()}


def _share(data: dict[str, Any], low: float, end: float) -> float:
    """Fraction of the time between low and end at rest."""
    if end <= low:
        return float(data["start"].size > 0)
    rest = np.minimum(data["end"], end) - np.maximum(data["start"], low)
    return min(1.0, float(np.sum(np.maximum(rest, 0.0))) / (end - low))
