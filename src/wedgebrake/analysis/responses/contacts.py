"""How each contact sticks and slides in a response."""

from __future__ import annotations

from collections.abc import Collection
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wedgebrake.analysis.responses.datasets import attributes, dataset_over
from wedgebrake.analysis.responses.repeat import run_of, solved
from wedgebrake.analysis.responses.sticking import span
from wedgebrake.dynamics.enums import EventKind
from wedgebrake.errors import InputError
from wedgebrake.model.display import counted
from wedgebrake.solvers.layout import SIDE_FLAGS, full

if TYPE_CHECKING:
    import xarray as xr

_SPEC = {
    "sticks": ("1", "number of sticks"),
    "entered_forward": ("1", "number of sticks entered from sliding forwards"),
    "entered_backward": ("1", "number of sticks entered from sliding backwards"),
    "reversals": ("1", "number of changes of the sliding direction without rest"),
    "rest_time": ("s", "time at rest"),
    "rest_share": ("1", "share of the time at rest"),
    "longest_rest": ("s", "length of the longest stick"),
    "rest_from": ("s", "beginning of the stick that lasts to the end; nan if it slides then"),
    "final_side": ("1", "sign of the sliding speed at the end; 0: at rest"),
    "peak_torque": ("N m", "largest magnitude of the torque, also between the samples"),
}
_FINALLY = {1: "slides forwards", -1: "slides backwards", 0: "sticks"}


def contact_summary(response: xr.Dataset) -> xr.Dataset:
    """Return how often and for how long each contact sticks.

    Parameters
    ----------
    response : xarray.Dataset
        As returned by ``simulate``.

    Returns
    -------
    xarray.Dataset
        Over ``contact``: sticks, entered_forward, entered_backward, reversals; rest_time [s],
        rest_share, longest_rest [s]; rest_from [s], the start of the stick that lasts to the end,
        nan if the contact slides at the end; final_side; peak_torque [N m], the largest magnitude
        at any time, for which the run is repeated (among the samples, if the machine has parts
        without a name in study files). ``attrs``: start, stop [s], status and message of the
        response.

    Raises ``InputError`` for other datasets.
    """
    response = full(response)
    names = response["contact"].to_numpy()
    begin, end = span(response)
    rows = [_row(response, number, end - begin) for number in range(names.size)]
    peaks = _peak_torques(response)
    values: dict[str, Any] = {
        name: np.array([row[name] for row in rows], dtype=float)
        for name in _SPEC
        if name not in ("final_side", "peak_torque")
    }
    values["peak_torque"] = peaks
    for name in ("sticks", "entered_forward", "entered_backward", "reversals"):
        values[name] = values[name].astype(np.int64)
    values["final_side"] = np.array([row["final_side"] for row in rows], dtype=np.int8)
    found = dataset_over("contact", _SPEC, values).assign_coords(contact=names)
    found["final_side"].attrs.update(SIDE_FLAGS)
    found.attrs = {"start": begin, "stop": end, **attributes(response, "status", "message")}
    return found


def _row(response: xr.Dataset, number: int, duration: float) -> dict[str, float]:
    """Values of one contact."""
    own = response["stick_contact"].to_numpy() == number
    start, stop, entry, left = (
        response[f"stick_{name}"].to_numpy()[own] for name in ("start", "end", "entry", "exit")
    )
    kinds = response["event_kind"].to_numpy()[response["event_contact"].to_numpy() == number]
    rest = float(np.sum(stop - start))
    rests = bool(start.size) and left[-1] == 0
    return {
        "final_side": 0 if rests else _final_side(response, number),
        "sticks": start.size,
        "entered_forward": np.count_nonzero(entry > 0),
        "entered_backward": np.count_nonzero(entry < 0),
        "reversals": np.count_nonzero(kinds == EventKind.REVERSAL),
        "rest_time": rest,
        "rest_share": rest / duration if duration > 0.0 else float(start.size > 0),
        "longest_rest": float(np.max(stop - start, initial=0.0)),
        "rest_from": float(start[-1]) if rests else np.nan,
    }


def _final_side(response: xr.Dataset, number: int) -> int:
    """Side of a contact that slides at the end: after its last event, or without any, a sample."""
    own = np.flatnonzero(response["event_contact"].to_numpy() == number)
    if own.size:
        return int(response["event_after"][own[-1]])
    sliding = response["sliding_velocity"].to_numpy()[-1:, number]
    return int(np.sign(sliding.sum()))


def _peak_torques(response: xr.Dataset) -> NDArray[np.float64]:
    """Largest magnitude of the torque of each contact, at any time [N m]."""
    try:
        machine, task = run_of(response)
    except InputError:
        sampled = np.abs(response["brake_torque"].to_numpy())
        return np.asarray(sampled.max(axis=0, initial=0.0))
    return np.asarray(solved(machine, task, peaks=True).observer.peak)


def contact_sentences(summary: xr.Dataset, drags: Collection[str] = ()) -> list[str]:
    """How each contact sticks and slides, one sentence for each, from a ``contact_summary``.

    drags : names of the contacts that are ``Drag``; of these only the torque is stated
    """
    rows = summary.to_dataframe().to_dict("index")
    return [_sentence(str(name), values, name in drags) for name, values in rows.items()]


def _sentence(name: str, one: dict[str, Any], drag: bool) -> str:
    if drag:
        return f"{name}: torque up to {one['peak_torque']:.4g} N m."
    rest = "never sticks"
    if one["sticks"]:
        longest = f"{' ' if one['sticks'] == 1 else ', the longest '}of {one['longest_rest']:.4g} s"
        share = f"{100.0 * one['rest_share']:.3g} % of the time"
        rest = f"at rest {share}, in {counted(one['sticks'], 'stick')}{longest}"
    final = _FINALLY[int(one["final_side"])]
    if np.isfinite(one["rest_from"]):
        final += f" (since {one['rest_from']:.6g} s)"
    return (
        f"{name}: {rest}; {counted(one['reversals'], 'reversal')}; torque up to"
        f" {one['peak_torque']:.4g} N m; at the end it {final}."
    )
