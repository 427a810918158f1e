"""The normalised groups of the paper, both ways (docs/equations.md, "Normalised groups")."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Any, NamedTuple, Protocol

from wedgebrake.errors import InputError
from wedgebrake.model.actuation import Actuation
from wedgebrake.model.brakes import Brake, WedgeBrake
from wedgebrake.model.display import Tabular
from wedgebrake.model.driveline import Driveline
from wedgebrake.model.friction import Friction
from wedgebrake.model.signals.excitation import HarmonicTorque
from wedgebrake.model.signals.signals import Signal, number_of
from wedgebrake.model.units import allowed_units, with_unit
from wedgebrake.model.validation import check_number, wrong


class _System(Protocol):
    """What the groups use of a ``BrakedDriveline``, whose module imports this one."""

    @property
    def driveline(self) -> Driveline: ...
    @property
    def brake(self) -> Brake: ...
    @property
    def friction(self) -> Friction: ...
    @property
    def actuation(self) -> Actuation: ...
    @property
    def excitation(self) -> HarmonicTorque: ...


@dataclass(frozen=True)
class Groups(Tabular):
    """Dimensionless groups; None where a group is not defined for the system.

    eta          : slope of the actuation force, delta R mu_k / c
    f            : forcing frequency over natural frequency, f_e / f_n
    F0           : initial actuation force, F_a0 mu_k R / T_e
    alpha        : tan(wedge angle) / mu_k
    loss_factor  : c / sqrt(k J)
    kinetic      : mu_k
    static_ratio : mu_s / mu_k
    drive        : Omega sqrt(k J) / T_e
    """

    eta: float | None = None
    f: float | None = None
    F0: float | None = None
    alpha: float | None = None
    loss_factor: float | None = None
    kinetic: float | None = None
    static_ratio: float | None = None
    drive: float | None = None

    @property
    def defined(self) -> bool:
        """True if any group is defined: one inertia on a shaft, with one brake and one torque."""
        return any(value is not None for value in self.as_dict().values())

    def as_dict(self) -> dict[str, float | None]:
        """The groups by name."""
        return asdict(self)


def _lever(system: _System) -> float:
    """R mu_k, the brake torque at a force of 1 N before amplification [m]."""
    return system.brake.radius * system.friction.reference


def _ratio(numerator: float | None, denominator: float | None) -> float | None:
    if numerator is None or denominator is None or denominator <= 0.0:
        return None
    return numerator / denominator


class Oscillator(NamedTuple):
    """One inertia on a shaft, with one brake and one torque: what the groups are computed from.

    speed : of the shaft relative to the base of the brake
    """

    inertia: float
    damping: float
    stiffness: float
    speed: float | Signal
    brake: Brake
    friction: Friction
    actuation: Actuation
    torque: Signal


def compute(one: Oscillator) -> Groups:
    """The groups of an oscillator, from its SI values."""
    mu = one.friction.reference
    lever = one.brake.radius * mu
    static = getattr(one.friction, "breakaway", getattr(one.friction, "static", mu))
    impedance = math.sqrt(one.stiffness * one.inertia)
    sine = one.torque if isinstance(one.torque, HarmonicTorque) else None
    amplitude = None if sine is None else sine.amplitude
    speed, initial = number_of(one.speed), number_of(one.actuation.initial_force)
    tangent = math.tan(one.brake.angle) if isinstance(one.brake, WedgeBrake) else None
    return Groups(
        eta=_ratio(one.actuation.slope * lever, one.damping),
        f=_ratio(
            None if sine is None else sine.angular_frequency,
            math.sqrt(one.stiffness / one.inertia),
        ),
        F0=_ratio(None if initial is None else initial * mu * one.brake.radius, amplitude),
        alpha=None if tangent is None else _ratio(tangent, mu),
        loss_factor=_ratio(one.damping, impedance),
        kinetic=mu,
        static_ratio=_ratio(static, mu),
        drive=_ratio(None if speed is None else speed * impedance, amplitude),
    )


def _undefined(group: str, why: str) -> InputError:
    return InputError(f"groups.{group}: not defined here, because {why}. Give SI values instead.")


def _slope(system: _System, eta: float) -> float:
    lever = _lever(system)
    if system.driveline.damping == 0.0:
        raise _undefined("eta", "driveline.damping is 0 and eta = delta R mu_k / c")
    if lever == 0.0:
        raise _undefined("eta", "friction.kinetic is 0 and eta = delta R mu_k / c")
    return eta * system.driveline.damping / lever


def _check_sine(system: _System, group: str) -> None:
    if not isinstance(system.excitation, HarmonicTorque):
        kind = type(system.excitation).__name__
        raise _undefined(group, f"the torque is a {kind}, not a HarmonicTorque")


def _frequency(system: _System, f: float) -> float:
    if system.driveline.stiffness == 0.0:
        raise _undefined("f", "driveline.stiffness is 0: there is no natural frequency")
    _check_sine(system, "f")
    if f <= 0.0:
        raise wrong("groups.f", f, "greater than 0", "It is f_e / f_n.")
    return f * system.driveline.natural_frequency / (2.0 * math.pi)


def _amplitude(system: _System, initial: float) -> float:
    _check_sine(system, "F0")
    if initial <= 0.0:
        raise wrong(
            "groups.F0", initial, "greater than 0",
            "It is F_a0 mu_k R / T_e; for a driveline without torque set excitation.amplitude = 0.",
        )  # fmt: skip
    at_rest = number_of(system.actuation.initial_force)
    if at_rest is None:
        raise _undefined("F0", "initial_force varies in time and F0 = F_a0 mu_k R / T_e")
    force = at_rest * system.friction.reference * system.brake.radius
    if force == 0.0:
        raise _undefined("F0", "initial_force or kinetic is 0 and F0 = F_a0 mu_k R / T_e")
    return force / initial


def _angle(system: _System, alpha: float) -> float:
    if not isinstance(system.brake, WedgeBrake):
        raise _undefined("alpha", f"the brake is a {type(system.brake).__name__}, not a WedgeBrake")
    if system.friction.reference == 0.0:
        raise _undefined("alpha", "friction.kinetic is 0 and alpha = tan(angle) / mu_k")
    if alpha <= 0.0:
        raise wrong("groups.alpha", alpha, "greater than 0", "It is tan(angle) / mu_k.")
    return math.atan(alpha * system.friction.reference)


def check_group(name: str, value: Any) -> float:
    """Return a value of a group as a float; raises ``InputError`` for anything else."""
    where = f"groups.{name}"
    return check_number(
        where, with_unit(where, value, "1"), allowed=f"finite; {allowed_units('1')}"
    )


class Setter(NamedTuple):
    """The meaning of a group, and how it is set.

    meaning : in words, with its definition
    part    : the part of the system that it changes
    target  : the SI parameter of that part
    reads   : the SI parameters that the new value is computed from
    value   : the new value of the target, from a system and the group
    """

    meaning: str
    part: str
    target: str
    reads: tuple[str, ...]
    value: Callable[[_System, float], float]


_SLOPE = ("damping", "radius", "kinetic")
_FORCE = ("initial_force", "radius", "kinetic")
SETTERS = {
    "eta": Setter(
        "slope of the actuation force, delta R mu_k / c", "actuation", "slope", _SLOPE, _slope
    ),
    "f": Setter(
        "forcing frequency over natural frequency, f_e / f_n",
        "excitation",
        "frequency",
        ("stiffness", "inertia"),
        _frequency,
    ),
    "F0": Setter(
        "initial actuation force, F_a0 mu_k R / T_e", "excitation", "amplitude", _FORCE, _amplitude
    ),
    "alpha": Setter("tan(wedge angle) / mu_k", "brake", "angle", ("kinetic",), _angle),
}
