"""Machines in other units, and mirrored: their motions are known from that of the first one."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import wedgebrake as wb
from wedgebrake.model.brakes import LeverBrake

KINDS = ("inertias", "shafts", "contacts", "torques", "joints", "controllers")


class Mirrored(LeverBrake):
    """A wedge that amplifies the other direction of sliding."""

    angle: float

    def shape(self) -> tuple[float, float, float]:
        return (1.0, math.tan(self.angle), -1.0)


class Units(NamedTuple):
    """Factors of angles, times, torques and forces; negative ones mirror."""

    angle: float = 1.0
    time: float = 1.0
    torque: float = 1.0
    force: float = 1.0

    def of(self, name: str) -> float:
        """Factor of a field of a part, or of a state."""
        angle, time, torque, force = self
        return {
            "inertia": torque * time**2 / angle, "angle": angle, "rest": angle, "gap": angle,
            "angles": angle, "period": abs(angle), "speed": angle / time, "speeds": angle / time,
            "base_speed": angle / time, "stiffness": torque / angle,
            "stiffnesses": torque / angle, "damping": torque * time / angle, "signal": torque,
            "torques": torque, "initial_force": force, "slope": force * time / abs(angle),
            "drag": abs(torque), "capacity": abs(torque), "direction": math.copysign(1.0, torque),
            "force": force, "command": force, "torque": torque, "filter_time": time,
            "sample_time": time, "velocity": angle / time, "sliding_velocity": angle / time,
            "driven_power": torque * angle / time, "actuation_force": force,
            "brake_torque": torque, "shaft_torque": torque, "joint_torque": torque,
            "driven_torque": torque,
        }.get(name, 1.0)  # fmt: skip

    def value(self, name: str, given: Any) -> Any:
        """A number, a list, a signal or a curve in the new units."""
        if isinstance(given, wb.Stages | wb.OverSpeed | wb.OverAngle):
            return type(given)(**{
                field: one if one is None else self.value(field, one) for field, one in given
            })  # fmt: skip
        if isinstance(given, tuple):
            found = tuple(self.of(name) * one for one in given)
            return found[::-1] if self.angle < 0.0 and name != "limits" else found
        if isinstance(given, wb.Signal):
            return self.signal(given, self.of(name))
        return given if given is None else self.of(name) * given

    def signal(self, given: Any, factor: float) -> Any:
        if isinstance(given, wb.Harmonic):
            return wb.Harmonic(factor * given.amplitude, given.frequency / self.time, given.phase)
        if isinstance(given, wb.Signal) and hasattr(given, "signals"):
            first, second = (self.signal(one, factor) for one in given.signals)
            return first + second
        return factor * (float(given(0.0)) if isinstance(given, wb.Signal) else given)

    def factors(self, given: Any) -> dict[str, float]:
        """Per angle, speed, torque and force."""
        return {key: one / self.of(key.rpartition(".")[2]) for key, one in given.items()}

    def part(self, given: Any) -> Any:
        """A part in the new units."""
        fields = {name: getattr(given, name) for name in given.model_fields_set}
        if isinstance(given, wb.Contact):
            fields["actuation"] = self.part(given.actuation)
            if isinstance(given.brake, wb.WedgeBrake) and self.torque * self.force < 0.0:
                fields["brake"] = Mirrored(angle=given.brake.angle, radius=given.brake.radius)
            if given.normal:
                factors = self.factors(given.normal)
                fields["normal"] = {key: self.force * one for key, one in factors.items()}
        elif isinstance(given, wb.Controller):
            return self.controller(given)
        fields = {name: one if _is_kept(name, one) else self.value(name, one)
                  for name, one in fields.items()}  # fmt: skip
        return type(given)(**fields)

    def controller(self, given: wb.Controller) -> wb.Controller:
        """The error changes at most its sign, and the gains not theirs."""
        out = self.of(given.acts_on[1])
        sign, out = math.copysign(1.0, out), abs(out)
        limits = given.limits and tuple(sorted(sign * out * one for one in given.limits))
        return wb.Controller(
            given.name,
            {key: sign * one for key, one in self.factors(given.measured).items()},
            self.signal(given.setpoint, sign), given.output, out * given.proportional,
            out / self.time * given.integral, out * self.time * given.derivative,
            self.value("filter_time", given.filter_time), limits,
            self.value("sample_time", given.sample_time), given.delay,
            given.resolution and out * given.resolution,
        )  # fmt: skip

    def machine(self, given: wb.Machine) -> wb.Machine:
        return wb.Machine(**{
            kind: [self.part(one) for one in getattr(given, kind)] for kind in KINDS
        })  # fmt: skip

    def of_state(self, name: str, part: str, machine: wb.Machine) -> float:
        """Factor of a quantity of a part in a response."""
        outputs = {one.name: one.acts_on[1] for one in machine.controllers}
        return self.of(outputs.get(part, name))


def _is_kept(name: str, value: Any) -> bool:
    """True for names, ratios and inner parts."""
    parts = wb.Actuation | wb.CoulombFriction | LeverBrake
    return isinstance(value, str | dict | bool | parts) or name in ("ratio", "delay")
