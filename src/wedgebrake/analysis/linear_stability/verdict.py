"""Linear verdict: eigenvalues and bifurcation points of steady sliding, as numbers and text.

With constant friction and a pressed brake the damping of sliding is that of the paper,

    d = c + R delta |g(+-mu_k)| = c (1 + eta/D),   D = mu_k/|g(+-mu_k)|,

with D = tan(alpha_w) -+ mu_k for the wedge and D = 1 for the conventional brake. Friction at
rest dissipates, so that the nonlinear behaviour may differ from the linear verdict.
"""

from __future__ import annotations

import cmath
import math
from dataclasses import asdict, dataclass, replace
from typing import Any

from wedgebrake.analysis.linear_stability.damping import (
    DampingLine,
    Sliding,
    damping_of,
    is_constant,
    lines_over_slope,
    steady,
)
from wedgebrake.model.brakes import WedgeBrake
from wedgebrake.model.display import Result
from wedgebrake.model.friction import TabulatedFriction
from wedgebrake.model.system import BrakedDriveline


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
    released    : the actuation force is zero at that speed, and the damping that of the driveline
    damping     : c + d(R F_mu)/dv [N m s/rad]
    growth_rate : h = -damping/2J [1/s]  (eqs. 11, 26)
    eigenvalues : h +- sqrt(h^2 - w_n^2) [1/s]  (eqs. 12, 27)
    stable      : both real parts negative
    oscillates  : the eigenvalues are complex
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

    The points in eta are None if eta is not defined (c = 0). A point is None if it exists for no
    slope, as for a brake without friction. The margins are None if the brake is released at that
    speed.
    """

    direction: int
    speed: float | None
    locked: bool
    released: bool = False
    damping: float | None = None
    growth_rate: float | None = None
    eigenvalues: tuple[complex, complex] | None = None
    stable: bool | None = None
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

    @property
    def state(self) -> str:
        """Course of small vibration: "decays", "grows", "does not decay"; "" without sliding."""
        if self.damping is None:
            return ""
        if self.damping < 0.0:
            return "grows"
        return "decays" if self.stable else "does not decay"

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
        return f"Sliding {way}: small vibration {self.state}."


@dataclass(frozen=True, repr=False)
class Stability(Result):
    """The linear verdict on steady sliding.

    forward, backward
                  : the two directions; on a turning shaft sliding exists only in its direction
    stable        : steady sliding exists, and small vibration decays in each direction in which
                    it exists
    damping       : smallest damping of those directions [N m s/rad]; inf if there is none
    margin_eta    : smallest margin of those directions in eta; None if not defined
    margin_slope  : the same in slope of the actuation force [N s/rad]
    self_locking  : "none", "static" (a brake at rest cannot break loose forwards, but slides
                    forwards at speeds at which friction is lower) or "kinetic" (no forward
                    sliding exists)
    verdict       : the above in words
    kinetic_locking_angle, static_locking_angle
                  : of a wedge: largest angles at which self_locking is "kinetic" and at least
                    "static", atan(mu_k) and atan(mu_s) [rad]; None for other brakes
    """

    forward: DirectionStability
    backward: DirectionStability
    stable: bool
    damping: float
    margin_eta: float | None
    margin_slope: float | None
    self_locking: str
    verdict: str
    kinetic_locking_angle: float | None = None
    static_locking_angle: float | None = None

    def as_dict(self) -> dict[str, Any]:
        """Plain values, for JSON."""
        ways = {"forward": self.forward.as_dict(), "backward": self.backward.as_dict()}
        return {name: value for name, value in vars(self).items() if name not in ways} | ways


def driveline_stability(system: BrakedDriveline) -> Stability:
    """Linear stability of a ``BrakedDriveline``; see ``wb.stability``."""
    forward, backward = (_direction(system, side) for side in (1, -1))
    existing = [d for d in (forward, backward) if d.damping is not None]
    coefficients = _locking_coefficients(system)
    wedge = isinstance(system.brake, WedgeBrake)
    angles = [math.atan(one) if wedge else None for one in coefficients]
    locked = [system.brake.locks(one) for one in coefficients]

    def least(name: str) -> float | None:
        values = [getattr(one, name) for one in existing]
        return min((one for one in values if one is not None), default=None)

    damping = least("damping")
    found = Stability(
        forward=forward,
        backward=backward,
        stable=bool(existing) and all(bool(d.stable) for d in existing),
        damping=math.inf if damping is None else damping,
        margin_eta=least("margin_eta"),
        margin_slope=least("margin_slope"),
        self_locking="kinetic" if locked[0] else "static" if locked[1] else "none",
        verdict="",
        kinetic_locking_angle=angles[0],
        static_locking_angle=angles[1],
    )
    return replace(found, verdict=_verdict(system, found))


def _nearest_slope(curve: list[DampingLine], damping: float, slope: float) -> float | None:
    """Actuation slope nearest to the present one that gives a damping; None if there is none."""
    found = [
        at
        for line in curve
        if line.gradient != 0.0
        and line.low < (at := (damping - line.at_zero) / line.gradient) < line.high
    ]
    return min(found, key=lambda one: abs(one - slope), default=None)


def _direction(system: BrakedDriveline, side: int) -> DirectionStability:
    line, slope = system.driveline, system.actuation.slope
    at = steady(system, side)
    if at is None:
        return DirectionStability(direction=side, speed=None, locked=False)
    angle = _hopf_angle(system, at)
    damping = damping_of(system, at)
    if math.isinf(damping):
        return DirectionStability(direction=side, speed=at.speed, locked=True, hopf_angle=angle)
    natural = line.natural_frequency
    rate = -damping / (2.0 * line.inertia)
    points: dict[str, float | None] = {}
    impedance = 2.0 * math.sqrt(line.stiffness * line.inertia)
    wanted = {"hopf": 0.0, "node_focus_stable": impedance, "node_focus_unstable": -impedance}
    curve = lines_over_slope(system, at)
    for name, level in wanted.items():
        points[f"{name}_slope"] = _nearest_slope(curve, level, slope)
        points[f"{name}_eta"] = _as_eta(system, points[f"{name}_slope"])
    margins = dict.fromkeys(("margin_slope", "margin_eta"))
    released = at.actuated >= system.actuation.release_speed
    if not released:
        for name, present in (("slope", slope), ("eta", _as_eta(system, slope))):
            hopf = points[f"hopf_{name}"]
            if hopf is not None and present is not None:
                margins[f"margin_{name}"] = math.copysign(present - hopf, damping)
    return DirectionStability(
        direction=side,
        speed=at.speed,
        locked=False,
        released=released,
        damping=damping,
        growth_rate=rate,
        eigenvalues=_eigenvalues(rate, natural),
        stable=damping > 0.0 and line.stiffness > 0.0,
        oscillates=abs(rate) < natural,
        hopf_angle=angle,
        **points,
        **margins,
    )


def _hopf_angle(system: BrakedDriveline, at: Sliding) -> float | None:
    """Wedge angle at which eta = -D = -(tan(angle) - side mu_k), if sliding exists there [rad]."""
    eta = _as_eta(system, system.actuation.slope)
    constant = is_constant(system.friction, at.speed * system.brake.radius)
    pressed = at.actuated < system.actuation.release_speed
    if not isinstance(system.brake, WedgeBrake) or eta is None or not (constant and pressed):
        return None
    signed = at.direction * system.friction.reference
    angle = math.atan(signed - eta)
    return angle if math.atan(max(signed, 0.0)) < angle < math.pi / 2 else None


def _eigenvalues(rate: float, natural: float) -> tuple[complex, complex]:
    """H +- sqrt(h^2 - w_n^2), the one with the larger real part first (eqs. 12, 27)."""
    root = cmath.sqrt(rate * rate - natural * natural)
    if root.imag != 0.0 or rate == 0.0:
        return rate + root, rate - root
    # The smaller real root follows from the product w_n^2, without cancellation.
    large = rate + math.copysign(root.real, rate)
    small = natural * natural / large
    return complex(max(large, small)), complex(min(large, small))


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


def _verdict(system: BrakedDriveline, found: Stability) -> str:
    drive = system.driveline.drive_speed
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
    for name, one in (("forwards", found.forward), ("backwards", found.backward)):
        if one.locked and drive != 0.0:
            words.append(f"Sliding {name}{where} does not exist: the brake locks itself.")
        if one.damping is None:
            continue
        how = "oscillating" if one.oscillates else "without oscillation"
        margin = ", the actuator is released" if one.released else ""
        if one.margin_eta is not None:
            margin = f", margin {one.margin_eta:+.4g} in eta"
        elif one.margin_slope is not None:
            margin = f", margin {one.margin_slope:+.4g} N s/rad in slope"
        words.append(f"Sliding {name}{where}: small vibration {one.state} ({how}{margin}).")
    if not math.isinf(found.damping):
        grows = "grows" in (found.forward.state, found.backward.state)
        verdict = "stable" if found.stable else "unstable" if grows else "neutral"
        words.append(f"Linearly {verdict}.")
        release = system.actuation.release_speed
        if grows and math.isfinite(release):
            words.append(
                "Growing vibration is limited at the latest when the actuator releases, at"
                f" {release:.6g} rad/s. Run `simulate` to see the motion."
            )
    return " ".join(words)
