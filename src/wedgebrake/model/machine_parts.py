"""Parts of a machine: inertias, shafts, contacts and torques."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from pydantic import BeforeValidator, InstanceOf, model_validator

from wedgebrake.model.actuation import Actuation
from wedgebrake.model.brakes import Brake
from wedgebrake.model.friction import Friction, SetValuedFriction
from wedgebrake.model.part import Part, Positional, parameter
from wedgebrake.model.signals.signals import OrSignal, Signal, SignalField
from wedgebrake.model.validation import NotAllowedError, wrong

GROUND = "ground"
"""Name of the ground as an end of shafts and contacts."""
_NAME = re.compile(r"[^\W\d][\w-]*")
_LONGEST = 60
NAMES = f"a name of letters, digits, '_' and '-', at most {_LONGEST}, that begins with a letter"


def _name(value: Any) -> Any:
    if isinstance(value, str) and len(value) <= _LONGEST and _NAME.fullmatch(value):
        return value
    raise NotAllowedError(NAMES)


Name = Annotated[str, BeforeValidator(_name)]


class Named(Positional):
    """A part of a machine with a name, with which its error messages begin."""

    if TYPE_CHECKING:
        name: str

    @classmethod
    def _label(cls, data: dict[str, Any]) -> str:
        """The name if it is valid, otherwise the table."""
        name = data.get("name")
        good = isinstance(name, str) and len(name) <= _LONGEST and _NAME.fullmatch(name)
        return str(name) if good else cls.table

    def _wrong(self, field: str, allowed: str, way_out: str = "") -> Exception:
        return wrong(f"{self.name}.{field}", getattr(self, field), allowed, way_out)


def _own_name(**extra: Any) -> Any:
    return parameter(
        "name, different from those of all other parts", unit="-", example="disc", **extra
    )


def _end(description: str, example: str, **extra: Any) -> Any:
    return parameter(description, unit="-", example=example, **extra)


class Inertia(Named):
    """A rotating body, with its initial angle and speed."""

    table: ClassVar[str] = "inertia"

    name: Name = _own_name()
    inertia: float = parameter(
        "moment of inertia", symbol="J", unit="kg m^2", example=1.0, gt=0, le=1e12
    )
    angle: float = parameter(
        "angle at the start", symbol="q", unit="rad", example=0.0, default=0.0, ge=-1e12, le=1e12
    )
    speed: float = parameter(
        "speed at the start", symbol="omega", unit="rad/s", example=10.0, default=0.0,
        ge=-1e12, le=1e12,
    )  # fmt: skip

    if TYPE_CHECKING:

        def __init__(
            self, name: str, inertia: float, angle: float = 0.0, speed: float = 0.0
        ) -> None: ...

    @model_validator(mode="after")
    def _not_ground(self) -> Inertia:
        if self.name == GROUND:
            raise self._wrong("name", "another name than 'ground'", "The ground has no inertia.")
        return self


class Shaft(Named):
    """A spring and a damper between two inertias, or between an inertia and the ground.

    The torque tau = stiffness (q_a - ratio q_b) + damping (omega_a - ratio omega_b) acts as -tau on
    ``a`` and as ratio tau on ``b``.
    """

    table: ClassVar[str] = "shaft"

    a: Name = _end("name of the first inertia", "motor")
    b: Name = _end("name of the second inertia, or 'ground'", "disc")
    stiffness: float = parameter(
        "torsional stiffness", symbol="k", unit="N m/rad", example=2e4, ge=0, le=1e15
    )
    damping: float = parameter(
        "viscous damping", symbol="c", unit="N m s/rad", example=1.0, default=0.0, ge=0, le=1e12
    )
    ratio: float = parameter(
        "gear ratio, speed of a over speed of b", symbol="r", example=1.0, default=1.0,
        ge=-1e6, le=1e6,
    )  # fmt: skip
    name: Name = _own_name(
        default_factory=lambda data: f"{data.get('a', 'a')}-{data.get('b', 'b')}"
    )

    if TYPE_CHECKING:

        def __init__(
            self,
            a: str,
            b: str,
            stiffness: float,
            damping: float = 0.0,
            ratio: float = 1.0,
            name: str = ...,
        ) -> None: ...

    @classmethod
    def _label(cls, data: dict[str, Any]) -> str:
        """The name, by default that of the ends."""
        return super()._label({"name": f"{data.get('a')}-{data.get('b')}", **data})

    @model_validator(mode="after")
    def _between(self) -> Shaft:
        _check_ends(self)
        if self.ratio == 0.0:
            raise self._wrong("ratio", "another number than 0", "Leave it out if there is no gear.")
        if self.b == GROUND and self.ratio != 1.0:
            raise self._wrong("ratio", "1 for a shaft to the ground", "The ground does not turn.")
        return self


class Contact(Named):
    """A brake or clutch: friction of an inertia against the ground, a moving base or an inertia.

    The sliding speed is the speed of ``a`` minus that of ``b``, or, for a contact with the ground,
    minus ``base_speed``, the speed of the base.
    """

    table: ClassVar[str] = "contact"

    a: Name = _end("name of the inertia that it brakes", "disc")
    b: Name = _end("name of the second inertia, or 'ground'", GROUND, default=GROUND)
    name: Name = _own_name()
    brake: InstanceOf[Brake] = parameter(
        "the brake", unit="-", example="wb.WedgeBrake(angle=0.34, radius=0.2)"
    )
    friction: InstanceOf[Friction] = parameter(
        "its friction law", unit="-", example="wb.CoulombFriction(kinetic=0.3)"
    )
    actuation: InstanceOf[Actuation] = parameter(
        "the force that presses it", unit="-", example="wb.Actuation(initial_force=300.0)"
    )
    base_speed: Annotated[float | Signal, OrSignal(-1e6, 1e6)] = parameter(
        "speed of the base, a number or a signal", symbol="Omega_b", unit="rad/s", example=80.0,
        default=0.0,
    )  # fmt: skip

    if TYPE_CHECKING:

        def __init__(self, /, *values: Any, **data: Any) -> None: ...

    @model_validator(mode="after")
    def _between(self) -> Contact:
        _check_ends(self)
        if self.b != GROUND and self.base_speed != 0.0:
            raise self._wrong(
                "base_speed", "0 for a contact between two inertias",
                "Only the base of a contact with the ground can turn; leave it out.",
            )  # fmt: skip
        return self

    @property
    def piecewise_linear(self) -> bool:
        """True if ``method="exact"`` can solve it: straight lines describe force and friction."""
        law = self.friction
        if not isinstance(law, SetValuedFriction):
            return False
        return law.constant or (law.has_nodes and self.actuation.straight)

    def inner(self) -> dict[str, Part]:
        """The inner parts of the contact."""
        return {"brake": self.brake, "friction": self.friction, "actuation": self.actuation}


class Torque(Named):
    """A torque on an inertia, a function of time [N m]."""

    table: ClassVar[str] = "torque"

    on: Name = _end("name of the inertia on which it acts", "disc")
    signal: SignalField = parameter(
        "the torque, a number or a signal", symbol="T", unit="N m", example=500.0
    )
    name: Name = _own_name(default_factory=lambda data: f"{data.get('on', 'on')}-torque")

    if TYPE_CHECKING:

        def __init__(self, on: str, signal: Signal | float, name: str = ...) -> None: ...

    @classmethod
    def _label(cls, data: dict[str, Any]) -> str:
        """The name, by default that of the inertia."""
        return super()._label({"name": f"{data.get('on')}-torque", **data})

    @model_validator(mode="after")
    def _on_inertia(self) -> Torque:
        if self.on == GROUND:
            raise self._wrong("on", "the name of an inertia", "The ground does not turn.")
        return self

    def inner(self) -> dict[str, Part]:
        """The signal of the torque."""
        return {"signal": self.signal}


def _check_ends(part: Shaft | Contact) -> None:
    if part.a == GROUND:
        raise part._wrong("a", "the name of an inertia", "Give the ground as b.")
    if part.a == part.b:
        raise part._wrong("b", f"another inertia than {part.a!r}, or 'ground'")
