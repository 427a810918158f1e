"""The system of a response, and the brake torque along segments of its motion.

A torque law belongs to a set of segments: it maps sliding velocities (n, m) [rad/s], one row for
each segment, to torques R F_mu (n, m) [N m]. It is the law of the system where the response
contains it, and otherwise interpolates the recorded samples.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wedgebrake.analysis.segments import Segments
from wedgebrake.errors import InputError
from wedgebrake.model.actuation import Actuation
from wedgebrake.model.characteristic import Characteristic
from wedgebrake.model.driveline import Driveline
from wedgebrake.model.excitation import HarmonicTorque
from wedgebrake.model.friction import Friction, SetValuedFriction
from wedgebrake.model.study import parse_study
from wedgebrake.model.system import PARTS, BrakedDriveline

if TYPE_CHECKING:
    import xarray as xr

FloatArray = NDArray[np.float64]
TorqueLaw = Callable[[FloatArray], FloatArray]


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
        return np.asarray(np.vectorize(self.actuation.force, otypes=[float])(speed))


def system_from_response(response: xr.Dataset) -> ResponseSystem:
    """Read the system of a response from its attributes.

    Raises ``InputError`` if the response does not describe one.
    """
    try:
        tables: dict[str, Any] = json.loads(response.attrs["system"])
        parts = (
            Driveline(**tables["driveline"]),
            Actuation(**tables["actuation"]),
            HarmonicTorque(**tables["excitation"]),
        )
        radius, kind = float(tables["brake"]["radius"]), tables["friction"]["kind"]
    except (AttributeError, KeyError, TypeError, ValueError):
        raise InputError(
            f"response = {type(response).__name__}: must be a dataset that describes its system in"
            " attrs['system']. Use the result of wb.simulate(...)."
        ) from None
    system = _system(tables)
    if system is not None:
        set_valued = isinstance(system.friction, SetValuedFriction)
    else:
        known = Friction.kinds.get(kind, Friction)
        set_valued = response.attrs.get("method") == "exact" or issubclass(known, SetValuedFriction)
    return ResponseSystem(*parts, radius, set_valued, system)


def _system(tables: dict[str, Any]) -> BrakedDriveline | None:
    """Rebuild the system; None if it has laws of the user's own, which tables do not hold."""
    try:
        return parse_study({name: tables[name] for name in PARTS}).system
    except InputError:
        return None


def torque_law(response: xr.Dataset, given: ResponseSystem, segments: Segments) -> TorqueLaw:
    """Return the torque law of the sliding brake for segments of a motion."""
    forward = segments.inner_velocity + given.driveline.drive_speed > 0.0
    if given.system is None:
        return _recorded(response, given, forward)
    if given.set_valued:
        law = given.system.characteristic
        return _piecewise(law, pieces_of(given, segments) >= law.first_forward)
    return _smooth(given.system, forward)


def pieces_of(given: ResponseSystem, segments: Segments) -> NDArray[np.intp]:
    """Return the piece of the characteristic of each segment, for a known set-valued law."""
    assert given.system is not None  # noqa: S101 - callers check that it is known
    law = given.system.characteristic
    inside = segments.inner_velocity + given.driveline.drive_speed
    piece = law.piece(inside)
    # A sliding direction in which a self-locking brake cannot slide is a rounding error.
    forward = (inside > 0.0) == np.isfinite(law.offsets[piece])
    first = law.first_forward
    return np.where(forward, np.maximum(piece, first), np.minimum(piece, first - 1))


def holding_interval(given: ResponseSystem, method: str) -> tuple[float, float]:
    """Return the lower and upper limit of the torque that the brake holds at rest [N m]."""
    if given.system is None or not given.set_valued:
        return -math.inf, math.inf
    law = given.system.characteristic
    if method == "ode14x":  # its band ends at the kinetic torques, eqs. (17) and (18)
        first = law.first_forward
        return float(law.offsets[first - 1]), float(law.offsets[first])
    return law.holding


def _piecewise(law: Characteristic, forward: NDArray[np.bool_]) -> TorqueLaw:
    """Torque law of a characteristic; near rest, its line for the direction of motion."""
    first, direction = law.first_forward, forward[:, None]

    def torque(v: FloatArray) -> FloatArray:
        v = _in_direction(v, direction)
        piece = law.piece(v)
        piece = np.where(direction, np.maximum(piece, first), np.minimum(piece, first - 1))
        return np.asarray(law.offsets[piece] + law.slopes[piece] * v)

    return torque


def _smooth(system: BrakedDriveline, forward: NDArray[np.bool_]) -> TorqueLaw:
    """Torque law of a smooth friction law."""
    from wedgebrake.solvers.smooth.solve import torque_at

    direction = forward[:, None]

    def torque(v: FloatArray) -> FloatArray:
        v = _in_direction(v, direction)
        return torque_at(system, v.ravel()).reshape(v.shape)

    return torque


def _in_direction(v: FloatArray, forward: NDArray[np.bool_]) -> FloatArray:
    """Clip sliding velocities to the direction of their segment; beyond it they are rounding."""
    return np.where(forward, np.maximum(v, 0.0), np.minimum(v, 0.0))


def _recorded(response: xr.Dataset, given: ResponseSystem, forward: NDArray[np.bool_]) -> TorqueLaw:
    """Torque law R F_a r(v), whose ratio r = F_mu/F_a is interpolated between the samples."""
    sliding = response["velocity"].to_numpy() + given.driveline.drive_speed
    force = given.force(sliding)
    usable = (force != 0.0) & np.isfinite(response["brake_torque"].to_numpy())
    if given.set_valued:
        usable &= (sliding != 0.0) & (response["sticking"].to_numpy() == 0)
    sliding, torques = sliding[usable], response["brake_torque"].to_numpy()[usable]
    ratio = torques / (given.radius * force[usable])
    if not given.set_valued:  # a smooth law vanishes at rest
        sliding, ratio = np.append(sliding, 0.0), np.append(ratio, 0.0)
    order = np.argsort(sliding, kind="stable")
    sliding, ratio = sliding[order], ratio[order]
    tables = [(sliding[mine], ratio[mine]) for mine in (sliding <= 0.0, sliding >= 0.0)]

    def torque(v: FloatArray) -> FloatArray:
        backward, forwards = (
            np.interp(v, *table) if table[0].size else np.zeros(v.shape) for table in tables
        )
        gain = np.where(forward[:, None], forwards, backward)
        return np.asarray(given.radius * given.force(v) * gain)

    return torque
