"""System and segments of a response: the motion between its neighbouring states.

Samples, events and Poincare points are merged. Every segment is smooth, since the brake torque
jumps or bends only where two segments meet.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from numpy.typing import NDArray

from wedgebrake.arrays import FloatArray
from wedgebrake.dynamics.actuator import forces
from wedgebrake.errors import InputError
from wedgebrake.model.actuation import Actuation
from wedgebrake.model.driveline import Driveline
from wedgebrake.model.friction import Friction, SetValuedFriction
from wedgebrake.model.signals.excitation import HarmonicTorque
from wedgebrake.model.studies.study import parse_study
from wedgebrake.model.studies.tables import make_part
from wedgebrake.model.system import PARTS, BrakedDriveline
from wedgebrake.model.validation import wrong

if TYPE_CHECKING:
    import xarray as xr


# Time, angle and velocity of every kind of state in a response.
_STATES = (
    ("time", "angle", "velocity"),
    ("event_time", "event_angle", "event_velocity"),
    ("poincare_time", "poincare_angle", "poincare_velocity"),
)
_FINAL = ("final_time", "final_angle", "final_velocity")

# Gauss-Legendre nodes and weights on (0, 1), exact to order 12: the square of a quartic
# velocity needs nine, a curved torque the rest.
_X, _WEIGHT = np.polynomial.legendre.leggauss(6)
NODES: FloatArray = 0.5 * (1.0 + _X)
WEIGHTS: FloatArray = 0.5 * _WEIGHT


@dataclass(frozen=True)
class Segments:
    """Consecutive segments of a motion, each field (n,).

    start, duration : start time and duration [s]
    angle, rotation : angle at the start, and its change over the segment [rad]
    start_velocity, end_velocity : velocity of the driveline at both ends [rad/s]
    """

    start: FloatArray
    duration: FloatArray
    angle: FloatArray
    rotation: FloatArray
    start_velocity: FloatArray
    end_velocity: FloatArray

    def select(self, rows: slice | NDArray[np.intp]) -> Segments:
        """Return some of the segments."""
        return Segments(*(getattr(self, field.name)[rows] for field in fields(self)))

    @property
    def middle(self) -> FloatArray:
        """Time in the middle of each segment [s]."""
        return self.start + 0.5 * self.duration

    @property
    def inner_velocity(self) -> FloatArray:
        """A velocity between the extremes of each segment [rad/s]."""
        return 0.5 * self.rotation / self.duration + 0.25 * (
            self.start_velocity + self.end_velocity
        )

    def velocity(self, x: FloatArray, first: FloatArray, last: FloatArray) -> FloatArray:
        """Interpolate the velocity [rad/s] at fractions ``x`` of each segment, (n, m).

        The angle is the polynomial of fifth degree that matches angle, velocity and acceleration
        at both ends.

        x           : (m,) or (n, m)
        first, last : (n,) accelerations at both ends [rad/s^2]
        """
        h, w0, w1 = self.duration[:, None], self.start_velocity[:, None], self.end_velocity[:, None]
        a0, a1 = first[:, None], last[:, None]
        y = 1.0 - x
        gain = w1 - w0
        missed = self.rotation[:, None] / h - 0.5 * (w0 + w1) - h * (a0 - a1) / 12.0
        bow = y * (h * a0 - gain) - x * (h * a1 - gain) + 30.0 * missed * x * y
        return np.asarray(w0 + x * gain + x * y * bow)


def segments_between(response: xr.Dataset, low: float, high: float, shortest: float) -> Segments:
    """Return the segments of a response between two times at which it has a state [s].

    States closer to each other than ``shortest`` [s] count as one.

    """
    columns = []
    for names, final in zip(zip(*_STATES, strict=True), _FINAL, strict=True):
        found = [response[name].to_numpy() for name in names]
        columns.append(np.concatenate([*found, [response.attrs[final]]]).astype(float))
    table = np.array(columns)
    table = table[:, np.argsort(table[0], kind="stable")]
    table = table[:, (table[0] >= low - shortest) & (table[0] <= high + shortest)]
    at, to = table[:, :-1], table[:, 1:]
    long = to[0] - at[0] > shortest
    at, to = at[:, long], to[:, long]
    return Segments(at[0], to[0] - at[0], at[1], to[1] - at[1], at[2], to[2])


@dataclass(frozen=True)
class ResponseSystem:
    """Parts of the system that a response describes.

    system : the whole system; None if the response does not contain its laws
    """

    driveline: Driveline
    actuation: Actuation
    excitation: HarmonicTorque
    radius: float
    set_valued: bool
    system: BrakedDriveline | None

    def force(self, speed: FloatArray) -> FloatArray:
        """Actuation force [N] at sliding velocities [rad/s] (eq. 3)."""
        return forces(self.actuation.law, np.abs(speed))


def of_series(response: xr.Dataset) -> bool:
    """Return True if the series solved a run, and no kernel for one inertia."""
    return _recorded_system(response) is None


def recorded_system(response: xr.Dataset) -> ResponseSystem:
    """Read the system of a response of a kernel for one inertia from its attributes.

    Raises ``InputError`` if the response does not describe one.
    """
    found = _recorded_system(response)
    assert found is not None  # noqa: S101 - callers ask of_series before
    return found


def _recorded_system(response: xr.Dataset) -> ResponseSystem | None:
    if "inertia" in getattr(response, "dims", ()):
        return None
    try:
        tables: dict[str, Any] = json.loads(response.attrs["system"])
        parts = (
            Driveline(**tables["driveline"]),
            Actuation(**tables["actuation"]),
            cast("HarmonicTorque", make_part("excitation", tables["excitation"])),
        )
        radius, kind = float(tables["brake"]["radius"]), tables["friction"]["kind"]
    except (AttributeError, KeyError, TypeError, ValueError):
        raise wrong(
            "response", response, "a dataset that describes its system in attrs['system']",
            "Use the result of wb.simulate(...).",
        ) from None  # fmt: skip
    names = ("driveline", "actuation", "excitation")
    given: dict[str, Any] = dict(zip(names, parts, strict=True))
    if BrakedDriveline.model_construct(**given).one_inertia is None:
        return None
    try:
        read = parse_study({name: tables[name] for name in PARTS})
        system = cast("BrakedDriveline", read.system)
    except InputError:  # custom laws, which tables do not contain
        law = Friction.kinds.get(kind, Friction)
        set_valued = response.attrs.get("method") == "exact" or issubclass(law, SetValuedFriction)
        return ResponseSystem(*parts, radius, set_valued, None)
    set_valued = isinstance(system.friction, SetValuedFriction)
    if set_valued and response.attrs.get("method") == "smooth":  # the curve of its friction
        return None
    return ResponseSystem(*parts, radius, set_valued, system)
