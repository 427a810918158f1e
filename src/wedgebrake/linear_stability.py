"""Linear stability of sliding: eigenvalues, bifurcation points, maps (the paper's section 3).

In each direction of motion the slope of the actuation force adds damping,

    c_dir = c + R delta |g(+-mu_k)| = c (1 + eta/D),   D = mu_k/|g(+-mu_k)|,

so that D = tan(alpha_w) -+ mu_k for the wedge and D = 1 for the conventional brake. The
brake's law enters through g alone. This is the verdict on small vibration about steady
sliding; friction at rest dissipates, so the nonlinear verdict is another one.
"""

from __future__ import annotations

import cmath
import json
import math
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from wedgebrake.errors import InputError, nearest
from wedgebrake.model.brakes import WedgeBrake
from wedgebrake.model.display import Result
from wedgebrake.model.friction import SetValuedFriction, SmoothFriction
from wedgebrake.model.part import is_finite, is_number, shown
from wedgebrake.model.system import BrakedDriveline

if TYPE_CHECKING:
    import xarray as xr

FloatArray = NDArray[np.float64]

# Of a speed: for the slope of a smooth law by differences; so near is a corner met.
_STEP, _CORNER = 1e-5, 1e-9


@dataclass(frozen=True, repr=False)
class DirectionStability(Result):
    """Linear stability of sliding in one direction.

    direction   : +1 forwards, -1 backwards
    locked      : the brake locks itself; sliding in this direction does not exist and all
                  that follows but hopf_angle is None
    damping     : c + R delta |g| [N m s/rad]
    growth_rate : h = -damping/2J [1/s]  (eqs. 11, 26)
    eigenvalues : h +- sqrt(h^2 - w_n^2) [1/s]  (eqs. 12, 27)
    stable      : both real parts negative
    oscillates  : the eigenvalues are complex
    hopf_eta    : eta where the damping vanishes, -D  (eqs. 13, 28, 29)
    node_focus_stable_eta, node_focus_unstable_eta
                : eta where oscillation ends, D (-1 +- 2 sqrt(kJ)/c)
    hopf_slope, node_focus_stable_slope, node_focus_unstable_slope
                : the same as slopes of the actuation force [N s/rad]
    margin_eta  : eta - hopf_eta, positive where stable
    margin_slope: slope - hopf_slope [N s/rad]
    hopf_angle  : of a wedge: angle where the damping vanishes, stable above it, with all else
                  (the slope, and so eta) as it is: tan = +-mu_k - eta [rad]; None where the
                  damping vanishes at no angle that slides

    The points in eta are None where eta is not defined (c = 0); all points are None for a
    brake without friction (g = 0).
    """

    direction: int
    locked: bool
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

    def as_dict(self) -> dict[str, Any]:
        """Plain values, eigenvalues as [real, imaginary] pairs."""
        plain = asdict(self)
        if self.eigenvalues is not None:
            plain["eigenvalues"] = [[value.real, value.imag] for value in self.eigenvalues]
        return plain

    def _headline(self) -> str:
        way = "forwards" if self.direction > 0 else "backwards"
        return _about(way, self.damping, bool(self.stable))


@dataclass(frozen=True, repr=False)
class ShaftStability(Result):
    """Linear stability of sliding at the speed of a turning shaft: of its steady motion.

    Unlike that of a direction it counts how friction varies with speed, and the release.

    speed   : of the shaft [rad/s]
    locked  : the brake locks itself at that speed; what follows is None
    damping : of small vibration, as ``damping_at`` gives it [N m s/rad]
    stable  : both real parts negative
    """

    speed: float
    locked: bool
    damping: float | None = None
    stable: bool | None = None

    @property
    def state(self) -> str:
        """What small vibration does: "decays", "grows", "does not decay"; "" where locked."""
        return "" if self.damping is None else _state(self.damping, bool(self.stable))

    def _headline(self) -> str:
        return _about(f"at {self.speed:.6g} rad/s", self.damping, bool(self.stable))


@dataclass(frozen=True, repr=False)
class Stability(Result):
    """The linear verdict on both directions of motion.

    Of both directions friction counts as constant in speed; of a turning shaft ``shaft``
    decides, the only steady sliding that exists there.

    stable        : sliding decays in every direction that exists
    margin_eta    : the smaller margin of the two directions, in eta; None if not defined
    margin_slope  : the same in slope of the actuation force [N s/rad]
    self_locking  : "none", "static" (a brake at rest cannot break loose forwards, but slides
                    forwards once moving) or "kinetic" (no forward sliding exists)
    verdict       : all that in words
    kinetic_locking_angle, static_locking_angle
                  : of a wedge: the angles up to which its self-locking is "kinetic" and at
                    least "static", atan(mu_k) and atan(mu_s) [rad]; None for other brakes
    shaft         : sliding at the speed of the shaft; None where the shaft does not turn
    """

    forward: DirectionStability
    backward: DirectionStability
    stable: bool
    margin_eta: float | None
    margin_slope: float | None
    self_locking: str
    verdict: str
    kinetic_locking_angle: float | None = None
    static_locking_angle: float | None = None
    shaft: ShaftStability | None = None

    def as_dict(self) -> dict[str, Any]:
        """Plain values, for JSON."""
        return {
            "stable": self.stable,
            "margin_eta": self.margin_eta,
            "margin_slope": self.margin_slope,
            "self_locking": self.self_locking,
            "kinetic_locking_angle": self.kinetic_locking_angle,
            "static_locking_angle": self.static_locking_angle,
            "verdict": self.verdict,
            "forward": self.forward.as_dict(),
            "backward": self.backward.as_dict(),
            "shaft": self.shaft and asdict(self.shaft),
        }


def stability(system: BrakedDriveline) -> Stability:
    """Linear stability of a system that slides, in both directions (eqs. 8 to 13, 23 to 29).

    Friction counts with its kinetic coefficient, constant in speed: the slope of a falling
    friction curve is not included, nor the release of the actuation. Both are in ``shaft`` of
    the answer, on sliding at the speed of a turning shaft.

    Raises ``InputError`` for what is no ``BrakedDriveline``.
    """
    _check_system(system)
    forward, backward = (_direction(system, side) for side in (1, -1))
    existing = [d for d in (forward, backward) if not d.locked]
    stable = all(bool(d.stable) for d in existing)
    etas = [d.margin_eta for d in existing if d.margin_eta is not None]
    slopes = [d.margin_slope for d in existing if d.margin_slope is not None]
    margin_eta = min(etas) if etas else None
    margin_slope = min(slopes) if slopes else None
    locking = _self_locking(system)
    shaft = _at_shaft(system)
    wedge = isinstance(system.brake, WedgeBrake)
    angles = [math.atan(one) if wedge else None for one in _locking_coefficients(system)]
    return Stability(
        forward=forward,
        backward=backward,
        stable=stable,
        margin_eta=margin_eta,
        margin_slope=margin_slope,
        self_locking=locking,
        verdict=_verdict(system, (forward, backward), stable, locking, shaft),
        kinetic_locking_angle=angles[0],
        static_locking_angle=angles[1],
        shaft=shaft,
    )


def damping_at(system: BrakedDriveline, speed: float) -> float:
    """Damping of small vibration about sliding at one speed: c + d(R F_mu)/dv [N m s/rad].

    Unlike ``stability`` it counts how friction varies with speed, and the release: at the speed
    of the shaft it decides whether steady sliding is stable, at or above zero or below. Where
    the torque has a corner, the smaller damping of both sides.

    speed : sliding velocity of the driveline [rad/s], signed, not 0

    Infinite where the brake locks itself. Raises ``InputError`` for a speed that is 0 or no
    number.
    """
    if not is_number(speed) or not is_finite(speed) or speed == 0.0:
        raise InputError(
            f"speed = {shown(speed)}: must be a finite number other than 0, the sliding velocity"
            " in rad/s; at rest the brake holds."
        )
    damping = system.driveline.damping
    if isinstance(system.friction, SetValuedFriction):
        law = system.characteristic
        near = _CORNER * abs(speed)
        first, last = np.searchsorted(law.breakpoints, (speed - near, speed + near))
        pieces = slice(int(first), int(last) + 1)
        if not np.all(np.isfinite(law.offsets[pieces])):
            return math.inf
        return damping + float(law.slopes[pieces].min())
    step = _STEP * abs(speed)
    torques = [_torque(system, speed + way * step) for way in (-2.0, -1.0, 0.0, 1.0, 2.0)]
    if not all(math.isfinite(one) for one in torques):
        return math.inf
    twice_before, before, here, after, twice_after = torques
    # Second order from either side, so that a corner is not averaged away.
    left = (3.0 * here - 4.0 * before + twice_before) / (2.0 * step)
    right = (4.0 * after - 3.0 * here - twice_after) / (2.0 * step)
    return damping + min(left, right)


def _torque(system: BrakedDriveline, speed: float) -> float:
    """Torque of the brake R F_mu at a sliding velocity [N m], for a smooth friction law."""
    radius = system.brake.radius
    friction = system.friction
    assert isinstance(friction, SmoothFriction)  # noqa: S101 - the only other family
    gain = system.brake.amplification(friction.coefficient(radius * speed))
    return radius * system.actuation.force(speed) * gain


def _at_shaft(system: BrakedDriveline) -> ShaftStability | None:
    line = system.driveline
    speed = line.drive_speed
    if speed == 0.0:
        return None
    damping = damping_at(system, speed)
    if math.isinf(damping):
        return ShaftStability(speed=speed, locked=True)
    stable = damping > 0.0 and line.stiffness > 0.0
    return ShaftStability(speed=speed, locked=False, damping=damping, stable=stable)


def _direction(system: BrakedDriveline, side: int) -> DirectionStability:
    line, brake, slope = system.driveline, system.brake, system.actuation.slope
    gain = abs(brake.amplification(side * system.friction.reference))
    if math.isinf(gain):
        return DirectionStability(direction=side, locked=True, hopf_angle=_hopf_angle(system, side))
    lever = brake.radius * gain
    damping = line.damping + lever * slope
    natural = line.natural_frequency
    rate = -damping / (2.0 * line.inertia)
    eigenvalues = _eigenvalues(rate, natural)
    points: dict[str, float | None] = {}
    impedance = 2.0 * math.sqrt(line.stiffness * line.inertia)
    for name, wanted in (
        ("hopf", 0.0),
        ("node_focus_stable", impedance),
        ("node_focus_unstable", -impedance),
    ):
        at = (wanted - line.damping) / lever if lever > 0.0 else None
        points[f"{name}_slope"] = at
        points[f"{name}_eta"] = _as_eta(system, at)
    hopf, eta = points["hopf_slope"], _as_eta(system, slope)
    hopf_eta = points["hopf_eta"]
    return DirectionStability(
        direction=side,
        locked=False,
        damping=damping,
        growth_rate=rate,
        eigenvalues=eigenvalues,
        stable=damping > 0.0 and line.stiffness > 0.0,
        oscillates=abs(rate) < natural,
        margin_slope=None if hopf is None else slope - hopf,
        margin_eta=None if eta is None or hopf_eta is None else eta - hopf_eta,
        hopf_angle=_hopf_angle(system, side),
        **points,
    )


def _hopf_angle(system: BrakedDriveline, side: int) -> float | None:
    """Wedge angle at which eta = -D = -(tan(angle) - side mu_k), among those that slide [rad]."""
    eta = _as_eta(system, system.actuation.slope)
    if not isinstance(system.brake, WedgeBrake) or eta is None:
        return None
    signed = side * system.friction.reference
    angle = math.atan(signed - eta)
    return angle if math.atan(max(signed, 0.0)) < angle < math.pi / 2 else None


def _eigenvalues(rate: float, natural: float) -> tuple[complex, complex]:
    """H +- sqrt(h^2 - w_n^2), the one with the larger real part first (eqs. 12, 27)."""
    root = cmath.sqrt(rate * rate - natural * natural)
    if root.imag != 0.0 or rate == 0.0:
        return rate + root, rate - root
    # Real roots: their product is w_n^2, which spares the smaller one the cancellation.
    large = rate + math.copysign(root.real, rate)
    small = natural * natural / large
    return complex(max(large, small)), complex(min(large, small))


def _as_eta(system: BrakedDriveline, slope: float | None) -> float | None:
    if slope is None or system.driveline.damping == 0.0:
        return None
    return slope * system.brake.radius * system.friction.reference / system.driveline.damping


def _self_locking(system: BrakedDriveline) -> str:
    kinetic, static = _locking_coefficients(system)
    if system.brake.locks(kinetic):
        return "kinetic"
    return "static" if system.brake.locks(static) else "none"


def _locking_coefficients(system: BrakedDriveline) -> tuple[float, float]:
    """Friction coefficients that decide on locking while it slides, and at rest."""
    kinetic = system.friction.reference
    # With a table the brake may slide at the speeds where friction is least.
    least = min(getattr(system.friction, "coefficients", (kinetic,)))
    return least, max(kinetic, float(getattr(system.friction, "static", kinetic)))


def _verdict(
    system: BrakedDriveline,
    directions: tuple[DirectionStability, DirectionStability],
    stable: bool,
    locking: str,
    shaft: ShaftStability | None,
) -> str:
    words = []
    if locking == "kinetic":
        words.append(
            "The brake locks itself forwards: no forward sliding exists, and no torque breaks it"
            " loose forwards."
        )
    elif locking == "static":
        words.append(
            "The brake locks itself at rest: no torque breaks it loose forwards, although it can"
            " slide forwards once moving."
        )
    taken = "" if system.friction.constant else " with constant friction"
    for name, one in zip(("forwards", "backwards"), directions, strict=True):
        if one.damping is None:
            continue
        how = "oscillating" if one.oscillates else "without oscillation"
        state = _state(one.damping, bool(one.stable))
        margin = ""
        if one.margin_eta is not None:
            margin = f", margin {one.margin_eta:+.4g} in eta"
        elif one.margin_slope is not None:
            margin = f", margin {one.margin_slope:+.4g} N s/rad in slope"
        words.append(f"Sliding {name}{taken}: small vibration {state} ({how}{margin}).")
    words.append(_conclusion(stable, taken, shaft))
    grows = not stable if shaft is None else shaft.stable is False
    if grows and system.actuation.release and math.isfinite(system.actuation.release_speed):
        words.append(
            "This is about small vibration about sliding; one that grows is bounded by the release"
            f" of the actuation, at a sliding speed of {system.actuation.release_speed:.6g} rad/s,"
            " if nothing bounds it before. The simulation tells what becomes of it."
        )
    return " ".join(words)


def _state(damping: float, stable: bool) -> str:
    """What small vibration does, from its damping [N m s/rad] and whether it comes back."""
    if damping < 0.0:
        return "grows"
    return "decays" if stable else "does not decay"


def _about(sliding: str, damping: float | None, stable: bool) -> str:
    """One line on sliding in one way."""
    if damping is None:
        return f"Sliding {sliding}: the brake locks itself."
    return f"Sliding {sliding}: small vibration {_state(damping, stable)}."


def _conclusion(stable: bool, taken: str, shaft: ShaftStability | None) -> str:
    """Linearly stable or not: with a turning shaft at its speed, the only steady sliding."""
    if shaft is None:
        return f"Linearly {'stable' if stable else 'unstable'}{taken}."
    if shaft.damping is None:
        return f"At the shaft's own speed, {shaft.speed:.6g} rad/s, the brake locks itself."
    word = "stable" if shaft.stable else "unstable"
    return (
        f"Linearly {word} at the shaft's own speed, {shaft.speed:.6g} rad/s: damping"
        f" {shaft.damping:.4g} N m s/rad, small vibration {shaft.state}."
    )


AXES = ("eta", "alpha", "kinetic", "loss_factor")
"""Groups that a map can have as axes: all that linear stability depends on."""


def _check_system(system: BrakedDriveline) -> None:
    if not isinstance(system, BrakedDriveline):
        raise InputError(f"system = {shown(system)}: must be a BrakedDriveline.")


def stability_map(system: BrakedDriveline, **axes: ArrayLike) -> xr.Dataset:
    """Linear stability over a grid of groups, vectorised.

    system : what is changed
    axes   : one or more of eta, alpha (wedge brake), kinetic, loss_factor, each an array of
             values; the dimensions of the result come in this order. All other groups are
             those of the system.

    Returns a dataset with, over those dimensions: ``margin`` (eta minus the critical eta of
    the worse direction [1]), ``stable``, ``growth`` (largest real part over the natural
    frequency [1], over both directions) and ``locked`` (no forward sliding exists; the
    backward direction alone is then judged).

    Raises ``InputError`` for what is no ``BrakedDriveline``, unknown axes, empty or
    non-finite values.
    """
    import xarray as xr

    _check_system(system)
    groups = system.groups
    if not axes:
        raise InputError(f"axes: none given. Give at least one of {', '.join(AXES)}.")
    values: dict[str, Any] = {}
    for number, (name, given) in enumerate(axes.items()):
        if name not in AXES:
            raise InputError(f"{name}: not an axis of a stability map. {nearest(name, AXES)}")
        array = _axis(name, given)
        values[name] = array.reshape([-1 if i == number else 1 for i in range(len(axes))])
    for name in ("eta", "kinetic", "loss_factor"):
        if name not in values:
            stated = getattr(groups, name)
            if stated is None:
                raise InputError(
                    f"groups.{name}: not defined for this system, so that a map over"
                    f" {', '.join(axes)} has no meaning. Give {name} as an axis."
                )
            values[name] = np.asarray(stated)
    forward, backward = _widths(system, values)
    eta, loss = values["eta"], values["loss_factor"]
    locked = ~(forward > 0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        ahead = np.where(locked, -np.inf, _growth(loss, eta, forward))
    growth = np.maximum(ahead, _growth(loss, eta, backward))
    margin = eta + np.where(locked, backward, np.minimum(forward, backward))
    shape = np.broadcast_shapes(*(np.shape(v) for v in values.values()))
    data = {"margin": margin, "stable": margin > 0.0, "growth": growth, "locked": locked}
    return xr.Dataset(
        {name: (tuple(axes), np.broadcast_to(array, shape)) for name, array in data.items()},
        coords={name: np.ravel(values[name]) for name in axes},
        attrs={
            "brake": system.brake.kind,
            "system": json.dumps(system.as_dict()),
            "groups": json.dumps(groups.as_dict()),
        },
    )


def _axis(name: str, given: ArrayLike) -> FloatArray:
    try:
        array = np.atleast_1d(np.asarray(given, dtype=float))
    except (TypeError, ValueError):
        raise InputError(f"{name}: must be an array of numbers.") from None
    if array.ndim != 1 or array.size == 0 or not np.all(np.isfinite(array)):
        raise InputError(f"{name}: must be one-dimensional, finite and not empty.")
    if name != "eta" and array.min() <= 0.0:
        raise InputError(f"{name} = {array.min():g} at the least: must be greater than 0.")
    return array


def _widths(system: BrakedDriveline, values: dict[str, Any]) -> tuple[FloatArray, FloatArray]:
    """D of both directions; not above zero where the brake locks."""
    kinetic = values["kinetic"]
    if isinstance(system.brake, WedgeBrake):
        tangent = values["alpha"] * kinetic if "alpha" in values else math.tan(system.brake.angle)
        return tangent - kinetic, tangent + kinetic
    if "alpha" in values:
        raise InputError("alpha: an axis of wedge brakes only. Use kinetic or eta.")
    gain = np.vectorize(system.brake.amplification, otypes=[float])
    return kinetic / gain(kinetic), kinetic / -gain(-kinetic)


def _growth(loss: FloatArray, eta: FloatArray, width: FloatArray) -> FloatArray:
    """Largest real part of h +- sqrt(h^2 - 1), h over the natural frequency."""
    h = -0.5 * loss * (1.0 + eta / width)
    with np.errstate(divide="ignore", over="ignore"):
        root = np.sqrt(np.maximum(h * h - 1.0, 0.0))
        # h + root, written as 1/(h - root) where the sum of real roots would cancel.
        return np.asarray(np.where((root > 0.0) & (h < 0.0), 1.0 / (h - root), h + root))
