"""Variables of the result of a sweep: names, types, units and meanings.

One table for drivelines and one for machines serve the computation, the store and the figures.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import Any

import numpy as np

from wedgebrake.dynamics.enums import MotionClass, StickClass


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


def _vibration(contact: tuple[str, ...], inertia: tuple[str, ...]) -> tuple[Variable, ...]:
    """Extremes and root mean squares of a motion, for each contact and each inertia."""
    return (
        Variable("rms_torque", "N m", "rms torque, about its mean", over=contact),
        Variable("lowest_velocity", "rad/s", "lowest speed", over=inertia),
        Variable("highest_velocity", "rad/s", "highest speed", over=inertia),
        Variable("rms_velocity", "rad/s", "rms speed, about its mean", over=inertia),
        Variable("rms_acceleration", "rad/s^2", "rms acceleration", over=inertia),
        Variable("peak_acceleration", "rad/s^2", "largest |acceleration|", over=inertia),
        Variable("rms_jerk", "rad/s^3", "rms jerk, between jumps", over=inertia),
        Variable("peak_jerk", "rad/s^3", "largest |jerk|, between jumps", over=inertia),
    )


VARIABLES: dict[str, Variable] = {
    one.name: one
    for one in (
        Variable("angle", "rad", "angle at the section", over=(RETURN,)),
        Variable("velocity", "rad/s", "velocity at the section", over=(RETURN,)),
        Variable("motion", "1", "class of motion", "int8", -1, words=MotionClass),
        Variable("order", "1", "periods of the torque in one of the motion; 0: none", "int32", 0),
        Variable("stick_class", "1", "class of stick-slip", "int8", -1, words=StickClass),
        Variable("sticks_forward", "1", "sticks entered from v > 0 in a period of the torque"),
        Variable("sticks_backward", "1", "sticks entered from v < 0 in a period of the torque"),
        Variable("stick_share", "1", "share of time at rest relative to the brake"),
        Variable("largest_exponent", "1/s", "largest Lyapunov exponent"),
        Variable("second_exponent", "1/s", "second Lyapunov exponent; -inf: rank lost in a stick"),
        Variable("exponent_error", "1/s", "standard error of the largest exponent"),
        Variable("return_distance", "1", "return after `order` periods over the motion's size"),
        Variable("size", "rad/s", "half the range of velocity and of w_n times angle, added"),
        Variable("transient", "1", "periods before the record"),
        Variable(
            "settling",
            "1",
            "periods until it stayed at its final orbit (transient='auto')",
        ),
        Variable("peak_torque", "N m", "largest |R F_mu|"),
        Variable("friction_power", "W", "mean power turned into heat by the brake"),
        *_vibration((), ()),
        Variable("sliding_damping", "N m s/rad", "smallest damping of steady sliding"),
        Variable("events", "1", "events of the whole run", "int64", 0),
        Variable("final_angle", "rad", "angle at the end"),
        Variable("final_velocity", "rad/s", "velocity at the end"),
        Variable("status", "1", "how the simulation ended", "int8", 0, words=PointStatus),
    )
}

MACHINE_VARIABLES: dict[str, Variable] = {
    one.name: one
    for one in (
        Variable("angle", "rad", "angle at the section", over=(RETURN, INERTIA)),
        Variable("velocity", "rad/s", "speed at the section", over=(RETURN, INERTIA)),
        VARIABLES["motion"],
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
        *_vibration((CONTACT,), (INERTIA,)),
        Variable("exponents", "1/s", "Lyapunov exponents, descending", over=(EXPONENT,)),
        VARIABLES["exponent_error"],
        VARIABLES["return_distance"],
        Variable("size", "rad/s", "half the ranges of the scaled coordinates, added"),
        Variable("transient", "1", "returns before the record"),
        Variable("settling", "1", "returns until it stayed at its final orbit (transient='auto')"),
        VARIABLES["events"],
        VARIABLES["status"],
    )
}
