"""Contacts that state their torques instead of a brake and a force: freewheels and drag."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Sequence
from functools import cache
from typing import TYPE_CHECKING, Annotated, ClassVar, Self

from pydantic import AllowInfNan, PrivateAttr, model_validator

from wedgebrake.errors import InputError
from wedgebrake.model.actuation import Actuation
from wedgebrake.model.brakes import Brake, ConventionalBrake
from wedgebrake.model.friction import CoulombFriction, Friction, SetValuedFriction
from wedgebrake.model.machine_parts import GROUND, Factors, Name, Named, check_ends, end, own_name
from wedgebrake.model.part import parameter
from wedgebrake.model.signals.signals import Signal

_UNIT_FRICTION, _UNIT_FORCE = CoulombFriction(kinetic=1.0), Actuation(initial_force=1.0)
_UNIT_BRAKE = ConventionalBrake(radius=1.0)


class TorqueContact(Named):
    """A part with the attributes of a ``Contact`` that solvers use; its actuation force is 1 N.

    In results, its actuation force is nan.
    """

    normal: ClassVar[Factors] = Factors()
    ratio: ClassVar[float] = 1.0
    geared: ClassVar[bool] = False

    ends: ClassVar[tuple[str, str]] = ("a", "b")
    """Names of the fields that name the two inertias."""

    if TYPE_CHECKING:

        @property
        def a(self) -> str:
            """The first inertia."""

        @property
        def b(self) -> str:
            """The second inertia, or the ground."""

    _base_speed: float | Signal = PrivateAttr(default=0.0)

    @model_validator(mode="after")
    def _between(self) -> Self:
        check_ends(self, *self.ends)
        return self

    def on_base(self, speed: float | Signal) -> Self:
        """The contact between its first inertia and a base with a speed [rad/s]."""
        found = self.model_copy(update={self.ends[1]: GROUND})
        found._base_speed = speed
        return found

    def in_loop(self, closed: bool) -> Self:  # noqa: ARG002 - no controller can act on it
        """The contact itself, whether ``closed`` or not."""
        return self

    @property
    def base_speed(self) -> float | Signal:
        """Speed of the base [rad/s]."""
        return self._base_speed

    @property
    def actuation(self) -> Actuation:
        """A force of 1 N."""
        return _UNIT_FORCE

    @property
    @abstractmethod
    def brake(self) -> Brake:
        """The brake: the torque as a function of the friction coefficient."""

    @property
    @abstractmethod
    def friction(self) -> Friction:
        """The friction coefficient."""

    @property
    def piecewise_linear(self) -> bool:
        """True if ``method="exact"`` can solve it."""
        return True


class _Ratchet(Brake):
    """The torques of a ``OneWayClutch`` as those of a brake with 1 N, 1 m and the coefficient 1."""

    forward: float
    backward: float

    def shape(self) -> tuple[float, ...]:
        """Torque against forward sliding, and against backward sliding [N m]."""
        return self.forward, self.backward

    @staticmethod
    def law(m: float, shape: Sequence[float]) -> float:
        """Torque in the direction of m."""
        if m == 0.0:
            return 0.0
        return shape[0] if m > 0.0 else -shape[1]


@cache
def _ratchet(forward: float, backward: float) -> _Ratchet:
    return _Ratchet.model_construct(radius=1.0, forward=forward, backward=backward)


class OneWayClutch(TorqueContact):
    """A freewheel: a cannot turn faster than b, and overruns where it is slower.

    With the direction -1, a cannot turn slower than b. Engaged, it transmits any torque up to the
    capacity, beyond which it slips with this torque. Where it overruns, the drag acts. In results
    it is a contact.
    """

    table: ClassVar[str] = "one_way_clutch"
    later: ClassVar[frozenset[str]] = frozenset({"capacity"})

    a: Name = end("name of the first inertia", "motor")
    b: Name = end("name of the second inertia, or 'ground'", "wheel")
    name: Name = own_name()
    direction: float = parameter(
        "1: a cannot turn faster than b; -1: a cannot turn slower", example=1, default=1.0,
    )  # fmt: skip
    drag: float = parameter(
        "torque where it overruns", symbol="T_d", unit="N m", example=0.5, default=0.0, ge=0,
        le=1e12,
    )  # fmt: skip
    capacity: Annotated[float, AllowInfNan()] = parameter(
        "largest torque that it transmits; inf: any", symbol="T_c", unit="N m", example=200.0,
        default=math.inf, ge=0,
    )  # fmt: skip

    if TYPE_CHECKING:

        def __init__(
            self, a: str, b: str, name: str, direction: float = 1.0, drag: float = 0.0,
            capacity: float = math.inf,
        ) -> None: ...  # fmt: skip

    @model_validator(mode="after")
    def _one_way(self) -> OneWayClutch:
        if abs(self.direction) != 1.0:
            raise self._wrong("direction", "1 or -1")
        if math.isinf(self.capacity):  # which a study file cannot state
            self.__pydantic_fields_set__.discard("capacity")
        return self

    @property
    def brake(self) -> Brake:
        """The torques in both directions as those of a brake."""
        ends = self.capacity, self.drag
        return _ratchet(*(ends if self.direction > 0.0 else ends[::-1]))

    @property
    def friction(self) -> Friction:
        """The coefficient 1."""
        return _UNIT_FRICTION


class _DragLaw(SetValuedFriction):
    """The torque of a ``Drag`` as a friction coefficient, with 1 N and 1 m."""

    linear: float
    quadratic: float

    def kinetic_at(self, speed: float) -> float:
        """The torque at a speed >= 0."""
        return (self.linear + self.quadratic * speed) * speed

    def nodes(self) -> tuple[tuple[float, float], ...]:
        """None: raises ``InputError``."""
        raise InputError(
            "method = 'exact': must be 'smooth' for a machine with drag, which is a curve over the"
            " speed. Leave the method out, or give wb.Torque(on, wb.OverSpeed(speeds, torques)).",
            name="method", value="exact", allowed="'smooth' for a machine with drag",
        )  # fmt: skip

    @property
    def breakaway(self) -> float:
        """0: drag does not hold at rest."""
        return 0.0


@cache
def _drag_law(linear: float, quadratic: float) -> _DragLaw:
    return _DragLaw.model_construct(linear=linear, quadratic=quadratic)


class Drag(TorqueContact):
    """Drag that grows with the speed: the torque -(linear + quadratic |omega|) omega on an inertia.

    omega is the speed of the inertia, or its speed relative to another inertia, on which the
    opposite torque then acts. A machine with drag is solved by the method "smooth". In results,
    drag is a contact.
    """

    table: ClassVar[str] = "drag"
    ends: ClassVar[tuple[str, str]] = ("on", "relative_to")

    on: Name = end("name of the inertia on which it acts", "wheel")
    linear: float = parameter(
        "torque per speed", symbol="d_1", unit="N m s/rad", example=0.1, default=0.0, ge=0, le=1e12
    )
    quadratic: float = parameter(
        "torque per square of the speed", symbol="d_2", unit="N m s^2/rad^2", example=0.02,
        default=0.0, ge=0, le=1e12,
    )  # fmt: skip
    relative_to: Name = end(
        "name of the inertia to which the speed is relative, or 'ground'", GROUND, default=GROUND
    )
    name: Name = own_name(default_factory=lambda data: f"{data.get('on', 'on')}-drag")

    if TYPE_CHECKING:

        def __init__(
            self, on: str, linear: float = 0.0, quadratic: float = 0.0,
            relative_to: str = GROUND, name: str = ...,
        ) -> None: ...  # fmt: skip

    @property
    def a(self) -> str:
        """The inertia on which it acts."""
        return self.on

    @property
    def b(self) -> str:
        """The other inertia, or the ground."""
        return self.relative_to

    @property
    def brake(self) -> Brake:
        """The torque is the coefficient times 1 N times 1 m."""
        return _UNIT_BRAKE

    @property
    def friction(self) -> Friction:
        """The torque as a function of the speed."""
        return _drag_law(self.linear, self.quadratic)

    @property
    def piecewise_linear(self) -> bool:
        """False: it is a curve."""
        return False


TORQUE_CONTACTS: tuple[type[TorqueContact], ...] = (OneWayClutch, Drag)
"""The parts among the contacts of a machine other than ``Contact``."""
