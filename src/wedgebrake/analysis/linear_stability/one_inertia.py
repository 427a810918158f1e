"""Linear stability of a ``BrakedDriveline``: that of its machine, with the names of a driveline.

With constant friction and a pressed brake the damping of sliding is that of the paper,

    d = c + R delta |g(+-mu_k)| = c (1 + eta/D),   D = mu_k/|g(+-mu_k)|,

with D = tan(alpha_w) -+ mu_k for the wedge and D = 1 for the conventional brake. In general the
damping about sliding at the velocity v is

    d = c + d(R F_mu)/dv,

which includes the slope of the friction law and the release of the actuator. On a turning shaft the
brake slides steadily at the speed of the shaft, otherwise near rest in both directions. With smooth
friction, near rest means at the end of the steep part of the law.

Friction at rest dissipates, so that the nonlinear behaviour may differ from the linear verdict.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace
from itertools import pairwise
from typing import Any, NamedTuple

from wedgebrake.analysis.linear_stability.machine_stability import (
    Stability,
    conclusion,
    machine_stability,
)
from wedgebrake.analysis.linear_stability.sliding_contact import (
    CURVE,
    EXACT,
    Method,
    SlidingContact,
    check_method,
    frozen,
    is_constant,
    linearised,
    near_rest,
)
from wedgebrake.dynamics import actuator
from wedgebrake.model.actuation import Actuation
from wedgebrake.model.brakes import WedgeBrake
from wedgebrake.model.display import Result, Tabular
from wedgebrake.model.friction import SetValuedFriction, TabulatedFriction
from wedgebrake.model.machine import Machine
from wedgebrake.model.machine_parts import Contact
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.model.validation import check_instance, check_number, wrong


@dataclass(frozen=True, repr=False)
class DirectionStability(Result):
    """Linear stability of steady sliding in one direction.

    direction   : +1 forwards, -1 backwards
    speed       : sliding speed to which the values refer [rad/s]: that of a turning shaft;
                  otherwise with smooth friction the end of its steep part, else 0 for the limit
                  near rest. None if the shaft turns in the opposite direction: there is no
                  steady sliding in this direction, and all values below are None
    locked      : the brake locks itself: there is no sliding at that speed, and all values
                  below except hopf_angle are None
    released    : the actuation force is zero at that speed, so that only the driveline damps
    damping     : c + d(R F_mu)/dv of the steady torque [N m s/rad]; with a lag or sampling,
                  vibration may grow although the damping is positive
    growth_rate : h = -damping/2J [1/s]  (eqs. 11, 26); with a lag or sampling that of the mode that
                  grows fastest
    eigenvalues : h +- sqrt(h^2 - w_n^2) [1/s]  (eqs. 12, 27), the larger real part first; with a
                  lag or sampling all eigenvalues
    stable      : all real parts are negative, without the eigenvalue 0 of the angle of a free
                  rotation
    state       : course of small vibration: "decays", "grows" or "does not decay"; "" without
                  sliding
    oscillates  : the eigenvalues with the largest real part are complex
    hopf_slope  : slope of the actuation force at which the damping vanishes [N s/rad]; if
                  there are several, the nearest to the present slope
    node_focus_stable_slope, node_focus_unstable_slope
                : slopes at which oscillation ends, where the damping is +-2 sqrt(kJ)
    hopf_eta, node_focus_stable_eta, node_focus_unstable_eta
                : the same in eta; with constant friction -D and D (-1 +- 2 sqrt(kJ)/c)
                  (eqs. 13, 28, 29)
    margin_slope: distance of the slope from hopf_slope, positive where stable [N s/rad]
    margin_eta  : the same in eta
    hopf_angle  : of a wedge with constant friction: angle at which the damping vanishes for the
                  present slope and eta, tan = +-mu_k - eta [rad]; sliding is stable above it.
                  None if the damping does not vanish at any angle that permits sliding

    The Hopf and node-focus points in eta are None if eta is not defined (c = 0). A point is None if
    no slope attains it, as for a brake without friction. The margins are None if the brake is
    released at that speed. With lag, limits or sampling all points and margins are None: use
    ``wb.hopf``.
    """

    direction: int
    speed: float | None
    locked: bool
    released: bool = False
    damping: float | None = None
    growth_rate: float | None = None
    eigenvalues: tuple[complex, ...] | None = None
    stable: bool | None = None
    state: str = ""
    oscillates: bool | None = None
    hopf_eta: float | None = None
    node_focus_stable_eta: float | None = None
    node_focus_unstable_eta: float | None = None
    hopf_slope: float | None = None
    node_focus_stable_slope: float | None = None
    node_focus_unstable_slope: float | None = None
    margin_eta: float | None = None
    margin_slope: float | None = None
    hopf_angle: float | None = None

    def as_dict(self) -> dict[str, Any]:
        """Plain values, eigenvalues as [real, imaginary] pairs."""
        plain = asdict(self)
        if self.eigenvalues is not None:
            plain["eigenvalues"] = [[value.real, value.imag] for value in self.eigenvalues]
        return plain

    def _headline(self) -> str:
        way = "forwards" if self.direction > 0 else "backwards"
        if self.speed is None:
            return f"Sliding {way}: does not exist; the shaft turns the other way."
        if self.locked:
            return f"Sliding {way}: the brake locks itself."
        how = "oscillating" if self.oscillates else "without oscillation"
        if self.released:
            how += ", the actuator is released"
        elif self.margin_eta is not None:
            how += f", margin {self.margin_eta:+.4g} in eta"
        elif self.margin_slope is not None:
            how += f", margin {self.margin_slope:+.4g} N s/rad in slope"
        return f"Sliding {way}: small vibration {self.state} ({how})."


@dataclass(frozen=True, repr=False, kw_only=True)
class DrivelineStability(Stability):
    """The linear verdict on steady sliding of a ``BrakedDriveline``.

    It has the fields of ``Stability``, which describe ``system.machine``, and in addition:

    forward, backward
                  : the two directions; on a turning shaft sliding exists only in its direction
    damping       : smallest damping of those directions [N m s/rad]; inf if there is none
    margin_eta    : smallest margin of those directions in eta; None if not defined
    margin_slope  : the same in slope of the actuation force [N s/rad]
    self_locking  : "none", "static" (a brake at rest cannot break loose forwards, but slides
                    forwards at speeds at which friction is lower) or "kinetic" (no forward
                    sliding exists)
    kinetic_locking_angle, static_locking_angle
                  : of a wedge: largest angles at which self_locking is "kinetic" and at least
                    "static", atan(mu_k) and atan(mu_s) [rad]; None for other brakes
    """

    forward: DirectionStability
    backward: DirectionStability
    damping: float
    margin_eta: float | None
    margin_slope: float | None
    self_locking: str
    kinetic_locking_angle: float | None
    static_locking_angle: float | None

    def as_dict(self) -> dict[str, Any]:
        """Plain values, for JSON."""
        ways = {"forward": self.forward.as_dict(), "backward": self.backward.as_dict()}
        return super().as_dict() | ways

    def _rows(self) -> Iterator[tuple[str, Any, str]]:
        hidden = ("cases", "critical", "inertias")
        return (row for row in Tabular._rows(self) if row[0] not in hidden)


def driveline_stability(system: BrakedDriveline, method: Method = CURVE) -> DrivelineStability:
    """Linear stability of a ``BrakedDriveline``; see ``wb.stability``."""
    found = machine_stability(system.machine, method=method)
    (contact,) = system.machine.contacts
    forward, backward = (_direction(system, contact, found, side) for side in (1, -1))
    coefficients = _locking_coefficients(system)
    wedge = isinstance(system.brake, WedgeBrake)
    angles = [math.atan(one) if wedge else None for one in coefficients]
    locked = [system.brake.locks(one) for one in coefficients]

    def least(name: str) -> float | None:
        values = [getattr(one, name) for one in (forward, backward)]
        return min((one for one in values if one is not None), default=None)

    damping = least("damping")
    result = DrivelineStability(
        **vars(found),
        forward=forward,
        backward=backward,
        damping=math.inf if damping is None else damping,
        margin_eta=least("margin_eta"),
        margin_slope=least("margin_slope"),
        self_locking="kinetic" if locked[0] else "static" if locked[1] else "none",
        kinetic_locking_angle=angles[0],
        static_locking_angle=angles[1],
    )
    return replace(result, verdict=_verdict(system, result))


def damping_at(system: BrakedDriveline, speed: float, method: Method = CURVE) -> float:
    """Damping of small vibration about sliding at a velocity: c + d(R F_mu)/dv [N m s/rad].

    At a corner of the torque, the smaller of the two one-sided values.

    speed  : sliding velocity of the driveline [rad/s], signed, not 0
    method : as for ``wb.stability``

    Returns inf if the brake locks itself at that speed. Raises ``InputError`` if the speed is 0
    or not a finite number, and for friction that the method does not support.
    """
    allowed = "a finite number other than 0, the sliding velocity in rad/s; at rest the brake holds"
    if check_number("speed", speed, allowed=allowed) == 0.0:
        raise wrong("speed", speed, allowed)
    side = 1 if speed > 0.0 else -1
    (contact,) = system.machine.contacts
    return _damping(system.machine, linearised(contact, abs(speed), side, check_method(method)))


def sliding_damping(system: BrakedDriveline | Machine, method: Method = CURVE) -> float:
    """Smallest damping of steady sliding [N m s/rad] of one inertia with one contact.

    It equals ``stability(system).damping`` of a driveline.

    method : as for ``wb.stability``
    """
    check_instance("system", system, BrakedDriveline | Machine, "a BrakedDriveline or a Machine")
    machine = system.machine
    (contact,) = machine.contacts
    speed = 0.0 - frozen(contact.base_speed)
    sides = (1, -1) if speed == 0.0 else (int(math.copysign(1.0, speed)),)
    way = check_method(method)
    return min(_damping(machine, linearised(contact, abs(speed), one, way)) for one in sides)


def has_closed_form(system: BrakedDriveline) -> bool:
    """True if the damping is c (1 + eta/D): constant friction, and a force that acts at once."""
    (contact,) = system.machine.contacts
    rubbing = contact.brake.radius * abs(frozen(contact.base_speed))
    return is_constant(contact.friction, rubbing) and contact.actuation.direct


def _damping(machine: Machine, one: SlidingContact) -> float:
    return math.inf if one.locked else sum(shaft.damping for shaft in machine.shafts) + one.damping


def _direction(
    system: BrakedDriveline, contact: Contact, found: Stability, side: int
) -> DirectionStability:
    """One direction of the verdict on the machine of a driveline."""
    case = next((one for one in found.cases if one.contacts[0].direction == side), None)
    if case is None:
        return DirectionStability(direction=side, speed=None, locked=False)
    speed = abs(case.speeds[contact.name])
    shown = speed or near_rest(contact)
    angle = _hopf_angle(system, contact, speed, side)
    (one,) = case.contacts
    if one.locked:
        return DirectionStability(direction=side, speed=shown, locked=True, hopf_angle=angle)
    damping = _damping(system.machine, one)
    points: dict[str, float | None] = {}
    growth = case.growth_rate
    if contact.actuation.direct:
        growth = -damping / (2.0 * system.driveline.inertia)
        points = _points(system, contact, one, speed, found.method)
    return DirectionStability(
        direction=side,
        speed=shown,
        locked=False,
        released=one.released,
        damping=damping,
        growth_rate=growth,
        eigenvalues=case.eigenvalues,
        stable=case.stable,
        state=case.state,
        oscillates=case.modes[0].frequency > 0.0,
        hopf_angle=angle,
        **points,
    )


def _points(
    system: BrakedDriveline, contact: Contact, one: SlidingContact, speed: float, method: Method
) -> dict[str, float | None]:
    """The points of a direction over the slope and over eta, and the margins."""
    line, slope = system.driveline, contact.actuation.slope
    points: dict[str, float | None] = {}
    impedance = 2.0 * math.sqrt(line.stiffness * line.inertia)
    wanted = {"hopf": 0.0, "node_focus_stable": impedance, "node_focus_unstable": -impedance}
    curve = _over_slope(contact, one, speed, method)
    for name, level in wanted.items():
        points[f"{name}_slope"] = _nearest_slope(curve, level - line.damping, slope)
        points[f"{name}_eta"] = _as_eta(system, points[f"{name}_slope"])
    if not one.released:
        damping = _damping(system.machine, one)
        for name, present in (("slope", slope), ("eta", _as_eta(system, slope))):
            hopf = points[f"hopf_{name}"]
            if hopf is not None and present is not None:
                points[f"margin_{name}"] = math.copysign(present - hopf, damping)
    return points


class _Line(NamedTuple):
    """Damping by the brake over the actuation slope, at_zero + gradient slope in (low, high)."""

    low: float
    high: float
    at_zero: float
    gradient: float


def _over_slope(contact: Contact, one: SlidingContact, speed: float, method: Method) -> list[_Line]:
    """The damping by the brake as a function of the actuation slope, while the brake is pressed.

    It is piecewise linear. The pieces end at the slopes for which the force vanishes at the sliding
    speed or, with the method "exact", at the end of the straight line that contains this speed.
    """
    given, friction, radius = contact.actuation, contact.friction, contact.brake.radius
    force = frozen(given.initial_force)
    edges = [-math.inf, math.inf]
    if speed > 0.0:
        edges.insert(1, -force / speed)
        if given.release:
            del edges[0]
    if is_constant(friction, radius * speed):
        # One line, whatever the sign of the force.
        return [_Line(edges[0], edges[-1], 0.0, abs(one.gain))]
    if method == EXACT and given.release and isinstance(friction, SetValuedFriction):
        ends = (node / radius for node, _ in friction.nodes())
        edges.insert(1, -force / next((end for end in ends if end > speed), math.inf))
    found = []
    for low, high in pairwise(edges):
        begin, end = max(low, min(high, 0.0) - 4.0), min(high, max(low, 0.0) + 4.0)
        first, last = (begin + part * (end - begin) for part in (0.25, 0.75))
        if not first < last:
            continue
        at, beyond = (
            linearised(
                contact, speed, one.direction, method, given.model_copy(update={"slope": slope})
            ).damping
            for slope in (first, last)
        )
        gradient = (beyond - at) / (last - first)
        found.append(_Line(low, high, at - gradient * first, gradient))
    return found


def _nearest_slope(curve: list[_Line], damping: float, slope: float) -> float | None:
    """Actuation slope nearest to the present one that gives a damping; None if there is none."""
    found = [
        at
        for line in curve
        if line.gradient != 0.0
        and line.low < (at := (damping - line.at_zero) / line.gradient) < line.high
    ]
    return min(found, key=lambda one: abs(one - slope), default=None)


def _hopf_angle(system: BrakedDriveline, contact: Contact, speed: float, side: int) -> float | None:
    """Wedge angle at which eta = -D = -(tan(angle) - side mu_k), if sliding exists there [rad]."""
    given, friction, brake = contact.actuation, contact.friction, contact.brake
    eta = _as_eta(system, given.slope)
    if not isinstance(brake, WedgeBrake) or eta is None or not given.direct:
        return None
    pressed = speed < _release_speed(given)
    if not (is_constant(friction, speed * brake.radius) and pressed):
        return None
    signed = side * friction.reference
    angle = math.atan(signed - eta)
    return angle if math.atan(max(signed, 0.0)) < angle < math.pi / 2 else None


def _release_speed(given: Actuation) -> float:
    """Speed beyond which a force that acts at once is released [rad/s]; inf if there is none."""
    law = actuator.Actuator(frozen(given.initial_force), given.slope, given.release)
    return actuator.release_speed(law)


def _as_eta(system: BrakedDriveline, slope: float | None) -> float | None:
    if slope is None or system.driveline.damping == 0.0:
        return None
    return slope * system.brake.radius * system.friction.reference / system.driveline.damping


def _locking_coefficients(system: BrakedDriveline) -> tuple[float, float]:
    """Friction coefficients that decide on self-locking during sliding and at rest."""
    kinetic = system.friction.reference
    # With tabulated friction the brake may slide at the speeds of least friction.
    least, law = kinetic, system.friction
    if isinstance(law, TabulatedFriction):
        least = min(one for _, one in law.nodes())
    static = getattr(system.friction, "static", kinetic)
    return least, max(kinetic, float(getattr(system.friction, "breakaway", static)))


def _verdict(system: BrakedDriveline, found: DrivelineStability) -> str:
    drive = frozen(system.driveline.drive_speed)
    where = "" if drive == 0.0 else f" at the shaft speed of {drive:.6g} rad/s"
    words = []
    if found.self_locking == "kinetic" and found.forward.damping is not None:
        words.append("The brake locks itself forwards wherever the actuator presses it.")
    elif found.self_locking == "kinetic":
        words.append(
            "The brake locks itself forwards: no forward sliding exists, and no torque breaks it"
            " loose forwards."
        )
    elif found.self_locking == "static":
        fast = " fast enough" if found.forward.locked and drive == 0.0 else ""
        words.append(
            "The brake locks itself at rest: no torque breaks it loose forwards, although it can"
            f" slide forwards once moving{fast}."
        )
    words += [
        one._headline().replace(":", f"{where}:", 1)
        for one in (found.forward, found.backward)
        if one.damping is not None or (one.locked and drive != 0.0)
    ]
    existing = [one for one in found.cases if one.stable is not None]
    if existing:
        words.append(conclusion(found.stable, existing))
    if any(one.state == "grows" for one in existing) and system.actuation.direct:
        release = _release_speed(system.actuation)
        if math.isfinite(release):
            words.append(
                "Growing vibration is limited at the latest when the actuator releases, at"
                f" {release:.6g} rad/s. Run `simulate` to see the motion."
            )
    return " ".join(words)
