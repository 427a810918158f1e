"""A contact of a machine, linearised about steady sliding.

With the sliding speed v and the sign s of v, the torque on the first inertia is

    -R F g(m),   m = s mu(R |v|),

and F follows the command F_a0 + slope |v|. The torque changes by -R g dF - b dv, with

    b = R^2 F g'(m) mu'(R |v|),   dF_command = slope s dv.

Where friction varies with the speed, these are the derivatives of the curve, which the method
"smooth" uses. With ``EXACT`` they are those of the straight lines that the method "exact" uses
instead: between two points of a table the torque itself is linear.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Callable
from operator import itemgetter
from typing import Any, Literal, NamedTuple, cast

import numpy as np

from wedgebrake.dynamics import piecewise_linear
from wedgebrake.dynamics.piecewise_linear import CORNER
from wedgebrake.model.actuation import Actuation
from wedgebrake.model.brakes import BandBrake, Brake, LeverBrake
from wedgebrake.model.characteristic import has_straight_lines
from wedgebrake.model.friction import Friction, SetValuedFriction, SmoothFriction
from wedgebrake.model.machine_parts import Contact
from wedgebrake.model.signals.signals import Signal
from wedgebrake.model.stribeck import StribeckFriction
from wedgebrake.model.validation import check_choice

Method = Literal["curve", "exact"]
CURVE: Method = "curve"
EXACT: Method = "exact"
# Relative difference from the asymptote at which the steep part of a smooth law ends (rounding).
FLAT = 2.0**-56
# A smooth law counts as constant from this share of the speed at which its steep part ends.
_BEYOND = 0.999
# Relative step of the one-sided differences of a smooth law.
_STEP = 1e-5
_AT_REST = 1e-7  # [m/s]
# Relative difference of a command from a limit of the force that is rounding error.
_AT_LIMIT = 2.0**-50


class SlidingContact(NamedTuple):
    """A contact linearised about steady sliding.

    name      : of the contact
    direction : +1 forwards, -1 backwards, 0 if it sticks; then gain, slope and feedback are 0
    force     : steady actuation force, after limits and release [N]
    follows   : True if the force follows the command; False if a limit or the release holds it
    gain      : torque per actuation force [m], R g(m)
    slope     : b, change of the torque with the speed at a constant force [N m s/rad]; on the
                straight lines of ``EXACT`` the whole change
    feedback  : change of the command with the sliding speed [N s/rad]; 0 on straight lines
    locked    : True if the brake locks itself and this sliding does not exist
    """

    name: str
    direction: int
    force: float
    follows: bool
    gain: float = 0.0
    slope: float = 0.0
    feedback: float = 0.0
    locked: bool = False

    @property
    def damping(self) -> float:
        """Change of the steady torque with the speed [N m s/rad]."""
        return self.slope + (self.gain * self.feedback if self.follows else 0.0)

    @property
    def released(self) -> bool:
        """True if the force is zero, and remains zero if the speed changes."""
        return self.force == 0.0 and not self.follows


def check_method(method: Any) -> Method:
    """Return the method if it is known; ``InputError`` otherwise."""
    return cast("Method", check_choice("method", method, (CURVE, EXACT)))


def linearisation_of(solver: str) -> Method:
    """The method whose friction is that of a solver: straight lines for "exact", else the curve."""
    return EXACT if solver == "exact" else CURVE


def frozen(value: float | Signal) -> float:
    """A number, or the value of a signal at time 0, or at the first time at which it is known."""
    if not isinstance(value, Signal):
        return float(value)
    return float(value(max(0.0, value.span[0])))


def near_rest(contact: Contact) -> float:
    """Speed that stands for the limit near rest [rad/s]: where a smooth law ceases to be steep."""
    law = contact.friction
    return law.layer(FLAT) / contact.brake.radius if isinstance(law, SmoothFriction) else 0.0


def is_constant(friction: Friction, rubbing: float) -> bool:
    """Return True if friction is constant about a sliding speed [m/s] (0: near rest)."""
    steep = friction.layer(FLAT) if isinstance(friction, SmoothFriction) else 0.0
    return friction.constant and (rubbing == 0.0 or rubbing >= _BEYOND * steep)


def linearised(
    contact: Contact, speed: float, direction: int, method: Method = CURVE,
    actuation: Actuation | None = None,
) -> SlidingContact:  # fmt: skip
    """Linearise a contact about steady sliding.

    speed     : magnitude of the sliding speed [rad/s]; 0 for the limit near rest
    direction : +1 forwards, -1 backwards, 0 if it sticks
    actuation : used instead of that of the contact

    Raises ``InputError`` for friction that the method does not support.
    """
    brake, friction = contact.brake, contact.friction
    given = contact.actuation if actuation is None else actuation
    force, follows = _force(given, speed)
    if direction == 0:
        return SlidingContact(contact.name, 0, force, False)
    if method == EXACT and has_straight_lines(contact.name, friction, given, instead=CURVE):
        torque, slope = _on_lines(contact, given, speed, direction)
        gain = torque / force if force != 0.0 else 0.0
        locked = math.isinf(torque)
        return SlidingContact(contact.name, direction, force, follows, gain, slope, locked=locked)
    rubbing = brake.radius * speed
    if speed == 0.0 and isinstance(friction, SmoothFriction):
        rubbing = friction.layer(FLAT)
    m = direction * _coefficient(friction, rubbing)
    amplification = brake.amplification(m)
    if math.isinf(amplification):
        if force != 0.0 or (follows and given.slope != 0.0):
            return SlidingContact(contact.name, direction, force, follows, locked=True)
        amplification = 0.0
    slope = 0.0
    if force != 0.0 and not is_constant(friction, rubbing):
        rise = brake.radius**2 * force * _amplification_slope(brake, m)
        slope = min((rise * one for one in _coefficient_slopes(friction, rubbing)), default=0.0)
    return SlidingContact(
        contact.name, direction, force, follows, brake.radius * amplification, slope,
        direction * given.slope,
    )  # fmt: skip


def _force(given: Actuation, speed: float) -> tuple[float, bool]:
    """The steady actuation force at a sliding speed, and whether it follows the command."""
    first, rise = frozen(given.initial_force), given.slope * speed
    command = first + rise
    low, high = given.limits or (-math.inf, math.inf)
    low = max(low, 0.0) if given.release else low
    near = _AT_LIMIT * (abs(first) + abs(rise))
    for limit, inwards in ((low, given.slope > 0.0), (high, given.slope < 0.0)):
        if abs(command - limit) <= near:
            # Near rest, sliding can only increase the speed; otherwise take the less stable side.
            return limit, inwards if speed == 0.0 else given.slope < 0.0
    return min(max(command, low), high), low < command < high


def _on_lines(
    contact: Contact, given: Actuation, speed: float, direction: int
) -> tuple[float, float]:
    """Torque [N m] and its slope [N m s/rad] on the straight lines of the method exact.

    The torque is infinite if the brake locks itself. At a corner, the smaller of the two slopes.
    """
    brake, nodes = contact.brake, cast("SetValuedFriction", contact.friction).nodes()
    near = CORNER * speed
    # The lines depend only on the nodes on both sides of the speed.
    first, last = (
        bisect_right(nodes, (speed + way * near) * brake.radius, key=itemgetter(0)) + way
        for way in (-1, 1)
    )
    about = np.array(nodes[max(first, 0) : last])
    lines = np.empty(about.shape[0] + 1, dtype=piecewise_linear.LINE)
    count = piecewise_linear.half(
        brake.law, brake.shape(), brake.radius, about[:, 0] / brake.radius, about[:, 1],
        given.law, given.release_speed, float(direction), lines,
    )  # fmt: skip
    low, high = piecewise_linear.pieces_about(lines["start"][1:count], speed, near)
    found = lines[low : high + 1]
    if np.isinf(found["offset"]).any():
        return math.inf, 0.0
    torque = found["offset"][0] + found["slope"][0] * speed
    return float(torque), float((direction * found["slope"]).min())


def one_sided_slopes(law: Callable[[float], float], speed: float) -> tuple[float, float]:
    """Slopes of a law on both sides of a speed; nan if it is not finite nearby.

    Differences of second order that do not average a corner.
    """
    step = _STEP * speed
    twice_before, before, here, after, twice_after = (
        law(speed + way * step) for way in (-2.0, -1.0, 0.0, 1.0, 2.0)
    )
    left = (3.0 * here - 4.0 * before + twice_before) / (2.0 * step)
    right = (4.0 * after - 3.0 * here - twice_after) / (2.0 * step)
    return left, right


def _coefficient(friction: Friction, speed: float) -> float:
    """Kinetic coefficient mu at a magnitude of the sliding speed [m/s]."""
    if isinstance(friction, SmoothFriction):
        return friction.coefficient(speed)
    return cast("SetValuedFriction", friction).kinetic_at(speed)


def _coefficient_slopes(friction: Friction, speed: float) -> tuple[float, ...]:
    """Slopes mu' on both sides of a sliding speed [s/m]; near rest on the upper side only."""
    if (
        isinstance(friction, StribeckFriction)
        and type(friction).kinetic_at is StribeckFriction.kinetic_at
    ):
        return ((friction.kinetic - friction.kinetic_at(speed)) / friction.speed,)
    if isinstance(friction, SmoothFriction) or (
        isinstance(friction, SetValuedFriction) and friction.is_curve
    ):
        if speed == 0.0:
            ahead = [_coefficient(friction, way * _AT_REST) for way in (0.0, 1.0, 2.0)]
            return ((4.0 * ahead[1] - 3.0 * ahead[0] - ahead[2]) / (2.0 * _AT_REST),)
        return one_sided_slopes(lambda at: _coefficient(friction, at), speed)
    nodes = cast("SetValuedFriction", friction).nodes()
    speeds, coefficients = (np.array(one) for one in zip(*nodes, strict=True))
    slopes = np.append(np.diff(coefficients) / np.diff(speeds), 0.0)
    near = CORNER * speed
    first = max(int(np.searchsorted(speeds, speed - near, side="right")) - 1, 0)
    last = int(np.searchsorted(speeds, speed + near, side="right")) - 1
    return tuple(slopes[first : last + 1].tolist())


def _amplification_slope(brake: Brake, m: float) -> float:
    """g'(m), in closed form for the brakes of the package."""
    if isinstance(brake, LeverBrake) and type(brake).law is LeverBrake.law:
        a, b, d = brake.shape()
        return a * b / (b - m * d) ** 2
    if isinstance(brake, BandBrake) and type(brake).law is BandBrake.law:
        return brake.wrap_angle * math.exp(m * brake.wrap_angle)
    step = 2e-3 * max(abs(m), 0.1)
    while True:
        values = [brake.amplification(m + way * step) for way in (-3, -2, -1, 1, 2, 3)]
        if all(math.isfinite(one) for one in values) or step < 1e-12:
            break
        step *= 0.25
    weights = (-1.0, 9.0, -45.0, 45.0, -9.0, 1.0)
    return sum(w * one for w, one in zip(weights, values, strict=True)) / (60.0 * step)
