"""Variables of the result of a sweep: names, types, units and meanings.

One table serves the computation, the store and the figures.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import IntEnum
from typing import Any

import numpy as np

from wedgebrake.dynamics.enums import MotionClass, StickClass
from wedgebrake.model.view import View


class PointStatus(IntEnum):
    """How the simulation of one point ended."""

    NOT_COMPUTED = 0
    COMPLETED = 1
    DIVERGED = 2
    NO_FORWARD_SOLUTION = 3
    EVENT_LIMIT = 4
    STEP_LIMIT = 5
    INVALID = 6


NO_ATTRACTOR = {
    "undecided": -1,
    "diverged": -2,
    "self_locked": -3,
    "not_computed": -4,
    "free_vibration": -5,
    "steady_rotation": -6,
}
"""Numbers, in a map of basins, of initial states whose motions tend to no attractor."""

RETURN, CONTACT, INERTIA, EXPONENT = "return", "contact", "inertia", "exponent"
"""Dimensions of variables; that of the recorded returns is "period" or "crossing" in a result."""


@dataclass(frozen=True)
class Variable:
    """A variable of the result.

    fill  : value of points that are not computed
    over  : its dimensions beside those of the points: ``RETURN``, ``CONTACT``, ...
    words : the classes that its numbers stand for
    """

    name: str
    unit: str
    meaning: str
    dtype: str = "float64"
    fill: float = np.nan
    over: tuple[str, ...] = ()
    words: type[IntEnum] | None = None

    def attributes(self) -> dict[str, Any]:
        """Return units and meaning, and the names of classes (CF flags)."""
        attributes: dict[str, Any] = {"units": self.unit, "long_name": self.meaning}
        if self.words is not None:
            attributes["flag_values"] = [int(one) for one in self.words]
            attributes["flag_meanings"] = " ".join(one.name.lower() for one in self.words)
        return attributes


VARIABLES: dict[str, Variable] = {
    one.name: one
    for one in (
        Variable("angle", "rad", "angle at the section", over=(RETURN, INERTIA)),
        Variable("velocity", "rad/s", "velocity at the section", over=(RETURN, INERTIA)),
        Variable("motion", "1", "class of motion", "int8", -1, words=MotionClass),
        Variable("order", "1", "returns in one period of the motion; 0: none", "int32", 0),
        Variable("motion_period", "s", "period of the motion"),
        Variable(
            "stick_class", "1", "class of stick-slip", "int8", -1, over=(CONTACT,), words=StickClass
        ),
        Variable("sticks_forward", "1", "sticks entered from v > 0 in a return", over=(CONTACT,)),
        Variable("sticks_backward", "1", "sticks entered from v < 0 in a return", over=(CONTACT,)),
        Variable("stick_share", "1", "share of time at rest", over=(CONTACT,)),
        Variable("peak_torque", "N m", "largest |torque|", over=(CONTACT,)),
        Variable("friction_power", "W", "mean power turned into heat", over=(CONTACT,)),
        Variable("rms_torque", "N m", "rms torque, about its mean", over=(CONTACT,)),
        Variable("lowest_velocity", "rad/s", "lowest speed", over=(INERTIA,)),
        Variable("highest_velocity", "rad/s", "highest speed", over=(INERTIA,)),
        Variable("rms_velocity", "rad/s", "rms speed, about its mean", over=(INERTIA,)),
        Variable("rms_acceleration", "rad/s^2", "rms acceleration", over=(INERTIA,)),
        Variable("peak_acceleration", "rad/s^2", "largest |acceleration|", over=(INERTIA,)),
        Variable("rms_jerk", "rad/s^3", "rms jerk, between jumps", over=(INERTIA,)),
        Variable("peak_jerk", "rad/s^3", "largest |jerk|, between jumps", over=(INERTIA,)),
        Variable("exponents", "1/s", "Lyapunov exponents, descending", over=(EXPONENT,)),
        Variable("largest_exponent", "1/s", "largest Lyapunov exponent"),
        Variable("second_exponent", "1/s", "second Lyapunov exponent; -inf: rank lost in a stick"),
        Variable("exponent_error", "1/s", "standard error of the largest exponent"),
        Variable("return_distance", "1", "return after `order` returns over the motion's size"),
        Variable("size", "rad/s", "half the ranges of the scaled coordinates, added"),
        Variable("transient", "1", "returns before the record"),
        Variable("settling", "1", "returns until it stayed at its final orbit (transient='auto')"),
        Variable("sliding_damping", "N m s/rad", "smallest damping of steady sliding"),
        Variable("events", "1", "events of the whole run", "int64", 0),
        Variable("final_angle", "rad", "angle at the end"),
        Variable("final_velocity", "rad/s", "velocity at the end"),
        Variable("status", "1", "how the simulation ended", "int8", 0, words=PointStatus),
    )
}
# Variables of a system with several parts, and those of a driveline.
_OF_PARTS = {"exponents"}
_OF_DRIVELINE = {
    "largest_exponent", "second_exponent", "sliding_damping", "final_angle", "final_velocity",
}  # fmt: skip


def variables(view: View) -> tuple[Variable, ...]:
    """Return the variables of a system, without the dimensions that its view leaves out."""
    others = _OF_PARTS if view.single else _OF_DRIVELINE
    return tuple(
        replace(one, over=tuple(dim for dim in one.over if dim not in view.single))
        for one in VARIABLES.values()
        if one.name not in others
    )
