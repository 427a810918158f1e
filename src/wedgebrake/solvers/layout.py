"""The layout of a response: its variables, how a system shows them, and the way back."""

from __future__ import annotations

import json
from collections.abc import Mapping
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wedgebrake.dynamics.enums import EventKind
from wedgebrake.errors import InputError
from wedgebrake.model.view import DRIVELINE, View

if TYPE_CHECKING:
    import xarray as xr

EVENT_MEANINGS = {
    EventKind.STICK: "stick: slip ends in rest",
    EventKind.SLIP: "slip: rest ends",
    EventKind.REVERSAL: "reversal: the velocity changes sign without rest",
    EventKind.BREAKPOINT: "breakpoint: the torque law bends (actuation releases or engages; a shaft"
    " reaches a stage or the end of its gap; the output of a controller reaches or leaves a limit)",
}
SIDE_FLAGS = {"flag_values": [-1, 0, 1], "flag_meanings": "backwards none forwards"}
"""Attributes of a variable that is a sign of a velocity (CF flags)."""
_KINDS = {
    "flag_values": [int(kind) for kind in EVENT_MEANINGS],
    "flag_meanings": " ".join(kind.name.lower() for kind in EVENT_MEANINGS),
}
_STICKING = {"flag_values": [0, 1], "flag_meanings": "slips sticks"}
_INERTIA, _CONTACT = ("time", "inertia"), ("time", "contact")


def _variable(dims: tuple[str, ...], unit: str, meaning: str, flags: Any = None) -> Any:
    return dims, {"units": unit, "long_name": meaning, **(flags or {})}


_SIDE = "stick: side of entry; otherwise: direction of motion after the event"
VARIABLES: dict[str, tuple[tuple[str, ...], dict[str, Any]]] = {
    "time": _variable(("time",), "s", "time"),
    "period": _variable(("period",), "1", "number of periods"),
    "inertia": (("inertia",), {}),
    "shaft": (("shaft",), {}),
    "contact": (("contact",), {}),
    "driven": (("driven",), {}),
    "joint": (("joint",), {}),
    "controller": (("controller",), {}),
    "angle": _variable(_INERTIA, "rad", "angle"),
    "velocity": _variable(_INERTIA, "rad/s", "speed"),
    "torque": _variable(_INERTIA, "N m", "external torque"),
    "shaft_torque": _variable(("time", "shaft"), "N m", "torque of the shaft against a"),
    "brake_torque": _variable(_CONTACT, "N m", "torque of the contact against a"),
    "joint_torque": _variable(
        ("time", "joint"), "N m", "torque of the joint against its first body"
    ),
    "driven_torque": _variable(("time", "driven"), "N m", "torque of the drive on the body"),
    "driven_power": _variable(("time", "driven"), "W", "power of the drive"),
    "control_output": _variable(
        ("time", "controller"), "1", "output of the controller, in N or N m"
    ),
    "control_integral": _variable(
        ("time", "controller"), "1", "integral part of the output, in N or N m"
    ),
    "actuation_force": _variable(_CONTACT, "N", "actuation force"),
    "sliding_velocity": _variable(_CONTACT, "rad/s", "sliding speed"),
    "sticking": _variable(_CONTACT, "1", "at rest", _STICKING),
    "poincare_time": _variable(("period",), "s", "time of the section, period / f_e"),
    "poincare_angle": _variable(("period", "inertia"), "rad", "angle at the section"),
    "poincare_velocity": _variable(("period", "inertia"), "rad/s", "speed at the section"),
    "event_time": _variable(("event",), "s", "time of the event"),
    "event_contact": _variable(("event",), "1", "number of the contact; -1: of another part"),
    "event_part": _variable(("event",), "1", "name of the contact, shaft, torque or controller"),
    "event_kind": _variable(("event",), "1", "kind of the event", _KINDS),
    "event_before": _variable(("event",), "1", "sign of the sliding speed before", SIDE_FLAGS),
    "event_after": _variable(("event",), "1", "sign of the sliding speed after", SIDE_FLAGS),
    "event_side": _variable(("event",), "1", _SIDE, SIDE_FLAGS),
    "event_angle": _variable(("event", "inertia"), "rad", "angle at the event"),
    "event_velocity": _variable(("event", "inertia"), "rad/s", "speed at the event"),
    "stick_start": _variable(("stick",), "s", "beginning of rest"),
    "stick_end": _variable(("stick",), "s", "end of rest"),
    "stick_contact": _variable(("stick",), "1", "number of the contact"),
    "stick_entry": _variable(
        ("stick",), "1", "sign of the sliding speed before; 0: at rest from the start", SIDE_FLAGS
    ),
    "stick_exit": _variable(
        ("stick",), "1", "sign of the sliding speed after; 0: still at rest at the end", SIDE_FLAGS
    ),
}
"""Dimensions and attributes of the variables of a response."""
_COORDINATES = (
    "time", "period", "inertia", "shaft", "contact", "driven", "joint", "controller",
)  # fmt: skip
# Numbers of contacts, and sides that follow from event_side: of one contact they are left out.
_NUMBERS = ("event_contact", "stick_contact")
_SIDES = ("event_before", "event_after")


def shown(values: Mapping[str, Any], view: View, attrs: dict[str, Any]) -> xr.Dataset:
    """The variables of a response, with the dimensions of a machine, as a system shows them."""
    import xarray as xr

    single, found, indexes = view.single, {}, {}
    for name, value in values.items():
        if name in single or (single and name in (*_NUMBERS, *_SIDES)):
            continue
        dims, words = VARIABLES[name]
        if name in _COORDINATES:
            names = isinstance(value, list)
            of = _names(name, tuple(value)) if names else indexed(name, value, words)
            indexes[name], found[name] = of[0], of[1].copy(deep=False)
            continue
        if single and len(dims) > 1 and dims[1] in single:
            dims, value = dims[:1], value[:, 0]
        found[view.names.get(name, name)] = xr.Variable(dims, value, words, fastpath=True)
    return assembled(found, indexes, attrs)


def assembled(
    variables: dict[str, xr.Variable], indexes: dict[str, xr.Index], attrs: dict[str, Any],
    further: tuple[str, ...] = (),
) -> xr.Dataset:  # fmt: skip
    """Dataset of variables that fit together, among them those of the indexes.

    further : names of coordinates without an index
    """
    import xarray as xr

    # Private: the constructor searches for indexes, aligns and copies, which takes longer than the
    # run. Tested against it in tests/unit/test_one_layout.py.
    return xr.Dataset._construct_direct(
        variables, {*indexes, *further}, indexes=indexes, attrs=attrs
    )


def indexed(name: str, values: NDArray[Any], words: dict[str, str]) -> tuple[Any, Any]:
    """The index of a coordinate, and its variable."""
    import pandas as pd
    import xarray as xr

    # Of anything else than a pandas index and a variable by the fast path, xarray asks whether it
    # is an array of dask, whose import takes a quarter of a second.
    index = xr.indexes.PandasIndex(pd.Index(values), name, coord_dtype=values.dtype)
    variable = xr.Variable((name,), values, words, fastpath=True)
    return index, index.create_variables({name: variable})[name]


@lru_cache(maxsize=256)
def _names(name: str, parts: tuple[str, ...]) -> tuple[Any, Any]:
    """``indexed`` for the names of parts."""
    return indexed(name, np.array(parts, str), {})


def full(response: xr.Dataset) -> xr.Dataset:
    """A response with the dimensions of a machine, whatever system it shows.

    Raises ``InputError`` for anything but a response: other results describe a system too.
    """
    if "stick_start" not in getattr(response, "data_vars", {}) or "time" not in response.coords:
        raise InputError(
            f"response = {type(response).__name__}: must be the result of wb.simulate(...), a"
            " dataset over time with stick_start, stick_end and stick_entry.",
            name="response", value=response, allowed="the result of wb.simulate(...)",
        )  # fmt: skip
    if "stick_contact" in response.data_vars:
        return response
    import xarray as xr

    machine_names = {own: name for name, own in DRIVELINE.names.items()}
    found: dict[str, Any] = {}
    for own, one in response.data_vars.items():
        name = machine_names.get(str(own), str(own))
        dims = VARIABLES[name][0] if name in VARIABLES else one.dims
        value = one.to_numpy()
        if len(dims) > len(one.dims):
            value = value[:, None]
        found[name] = xr.Variable(dims, value, one.attrs, fastpath=True)
    for name in _NUMBERS:
        size = response.sizes.get(name.partition("_")[0])
        if size is not None:
            dims, attrs = VARIABLES[name]
            found[name] = xr.Variable(dims, np.zeros(size, np.int64), attrs, fastpath=True)
    if "event_side" in found:
        kind, side, velocity = (
            response[f"event_{name}"].to_numpy() for name in ("kind", "side", "velocity")
        )
        speed = json.loads(response.attrs["system"])["driveline"].get("drive_speed", 0.0)
        sliding = velocity + speed if isinstance(speed, float | int) else side
        sides = sides_of(kind, side, sliding)
        for name, values in zip(_SIDES, sides, strict=True):
            found[name] = xr.Variable(("event",), values, VARIABLES[name][1], fastpath=True)
    return _with_coordinates(response, found)


def _with_coordinates(response: xr.Dataset, found: dict[str, xr.Variable]) -> xr.Dataset:
    """Variables with the coordinates of a response, and those of the only parts."""
    single, indexes = DRIVELINE.single, dict(response.xindexes)
    coordinates = {str(name): one.variable for name, one in response.coords.items()}
    for dim, name in single.items():
        indexes[dim], variable = _names(dim, (name,))
        coordinates[dim] = variable.copy(deep=False)
    further = tuple(name for name in coordinates if name not in indexes)
    attrs = dict(response.attrs)
    named = {str(name): index for name, index in indexes.items()}
    return assembled({**found, **coordinates}, named, attrs, further)


def sides_of(
    kind: NDArray[Any], side: NDArray[Any], sliding: NDArray[Any]
) -> tuple[NDArray[np.int8], NDArray[np.int8]]:
    """Sides before and after events.

    kind, side : of the events, ``event_kind`` and ``event_side``
    sliding    : velocities, whose sign counts at a breakpoint
    """
    side = np.where(kind == EventKind.BREAKPOINT, np.sign(sliding), side)
    reverses, slips = kind == EventKind.REVERSAL, kind == EventKind.SLIP
    before = np.where(slips, 0, np.where(reverses, -side, side))
    after = np.where(kind == EventKind.STICK, 0, side)
    return before.astype(np.int8), after.astype(np.int8)
