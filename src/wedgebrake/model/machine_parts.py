"""Parts of a machine: inertias, shafts, contacts and torques."""

from __future__ import annotations

import re
from bisect import bisect_left
from itertools import accumulate, pairwise
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from numpy.typing import ArrayLike
from pydantic import (
    BeforeValidator,
    Field,
    GetCoreSchemaHandler,
    GetJsonSchemaHandler,
    InstanceOf,
    Strict,
    model_validator,
)
from pydantic_core import CoreSchema, core_schema

from wedgebrake.model.actuation import Actuation
from wedgebrake.model.brakes import Brake
from wedgebrake.model.friction import Friction, SetValuedFriction
from wedgebrake.model.part import Part, Positional, parameter
from wedgebrake.model.piecewise import Chain, Gap, Law
from wedgebrake.model.signals.signals import OrSignal, Signal, SignalField
from wedgebrake.model.validation import NotAllowedError, wrong

GROUND = "ground"
"""Name of the ground as an end of shafts and contacts."""
_NAME = re.compile(r"[^\W\d][\w-]*")
_LONGEST = 60
_MOST_STAGES = 1000
_STIFFEST = 1e15
_FARTHEST = 1e12
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


def check_ascending(name: str, values: tuple[float, ...], way_out: str) -> None:
    """Raise ``InputError`` unless values ascend."""
    for at, (before, after) in enumerate(pairwise(values), 1):
        if not before < after:
            raise wrong(
                f"{name}[{at}]", after, f"above {before!r}, the value before it", way_out
            )


class Stages(Positional):
    """Stiffness of a shaft in stages: its torque over the twist is a chain of lines.

    The torque is 0 at the twist 0. There is one stiffness more than angles: ``stiffnesses[0]``
    applies below the first angle, the last one above the last angle. None is negative.
    """

    table: ClassVar[str] = "stiffness"

    listed: ClassVar[frozenset[str]] = frozenset({"angles", "stiffnesses"})

    angles: tuple[Annotated[float, Field(ge=-_FARTHEST, le=_FARTHEST)], ...] = parameter(
        "twists at which the stiffness changes, ascending", symbol="phi", unit="rad",
        example=[-0.1, 0.1], min_length=1, max_length=_MOST_STAGES, strict=False,
    )  # fmt: skip
    stiffnesses: tuple[Annotated[float, Field(ge=0, le=_STIFFEST)], ...] = parameter(
        "stiffness below the first angle, between the angles, and above the last", symbol="k",
        unit="N m/rad", example=[1e4, 200.0, 1e4], min_length=2, max_length=_MOST_STAGES + 1,
        strict=False,
    )  # fmt: skip

    if TYPE_CHECKING:

        def __init__(self, angles: ArrayLike, stiffnesses: ArrayLike) -> None: ...

    @model_validator(mode="after")
    def _consistent(self) -> Stages:
        check_ascending("stiffness.angles", self.angles, "Sort the angles.")
        wanted = len(self.angles) + 1
        if len(self.stiffnesses) != wanted:
            raise wrong(
                "stiffness.stiffnesses", self.stiffnesses,
                f"a list of {wanted} values, one more than stiffness.angles has",
                "Give the stiffness below the first angle, between the angles, and above the last.",
            )  # fmt: skip
        return self

    def torques(self) -> tuple[float, ...]:
        """The torques at the angles [N m]."""
        lengths = (after - before for before, after in pairwise(self.angles))
        steps = (k * length for k, length in zip(self.stiffnesses[1:], lengths, strict=False))
        found = list(accumulate(steps, initial=0.0))
        # The stage that contains the twist 0, from one of its ends.
        stage = bisect_left(self.angles, 0.0)
        at = max(stage - 1, 0)
        zero = found[at] - self.stiffnesses[stage] * self.angles[at]
        return tuple(one - zero for one in found)


class _OrStages:
    """Annotation of a stiffness: a number, or stages, which a study file states as a table."""

    def __get_pydantic_core_schema__(self, _: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        number = handler.generate_schema(Annotated[float, Field(ge=0, le=_STIFFEST)])

        def checked(value: Any, check: Any) -> float | Stages:
            found: float | Stages = Stages(**value) if isinstance(value, dict) else value
            return found if isinstance(found, Stages) else check(found)

        return core_schema.no_info_wrap_validator_function(
            checked, number,
            serialization=core_schema.plain_serializer_function_ser_schema(
                lambda value: value.model_dump() if isinstance(value, Stages) else value
            ),
        )  # fmt: skip

    def __get_pydantic_json_schema__(
        self, _: CoreSchema, handler: GetJsonSchemaHandler  # noqa: ARG002
    ) -> dict[str, Any]:
        stages = Stages.model_json_schema()
        stages.pop("title", None)
        return {"anyOf": [{"type": "number", "minimum": 0, "maximum": _STIFFEST}, stages]}


class Shaft(Named):
    """A spring and a damper between two inertias, or between an inertia and the ground.

    The torque tau = stiffness (q_a - ratio q_b - rest) + damping (omega_a - ratio omega_b) acts as
    -tau on ``a`` and as ratio tau on ``b``. ``stiffness`` may have ``Stages``. With a ``gap``, there
    is no torque while low < q_a - ratio q_b - rest < high; beyond a limit, the spring and the damper
    act on the angle from there on, and do not pull: contact ends where their torque has fallen to
    zero. A stop is a shaft with a gap to the ground.
    """

    table: ClassVar[str] = "shaft"
    listed: ClassVar[frozenset[str]] = frozenset({"gap"})
    later: ClassVar[frozenset[str]] = frozenset({"rest", "gap"})

    a: Name = _end("name of the first inertia", "motor")
    b: Name = _end("name of the second inertia, or 'ground'", "disc")
    stiffness: Annotated[float | Stages, _OrStages()] = parameter(
        "torsional stiffness, a number or stages", symbol="k", unit="N m/rad", example=2e4
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
    rest: float = parameter(
        "twist at which the spring has no torque, a preload", symbol="phi_0", unit="rad",
        example=0.01, default=0.0, ge=-_FARTHEST, le=_FARTHEST,
    )  # fmt: skip
    gap: Annotated[tuple[float, float], Strict(False)] | None = parameter(
        "twists between which there is no torque, without the rest", symbol="s",
        unit="rad", columns=("rad", "rad"), example=[-0.01, 0.01], default=None,
    )  # fmt: skip

    if TYPE_CHECKING:

        def __init__(
            self,
            a: str,
            b: str,
            stiffness: float | Stages,
            damping: float = 0.0,
            ratio: float = 1.0,
            name: str = ...,
            rest: float = 0.0,
            gap: tuple[float, float] | None = None,
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
        if self.gap is None:
            return self
        if isinstance(self.stiffness, Stages):
            raise self._wrong(
                "gap", "left out where the stiffness has stages",
                "A stage of stiffness 0 is a gap without damping.",
            )  # fmt: skip
        if not -_FARTHEST <= self.gap[0] <= self.gap[1] <= _FARTHEST:
            raise self._wrong(
                "gap", f"(low, high) with low <= high, at most {_FARTHEST:g} rad in magnitude",
                "Give the lower limit first, for example gap=(-0.01, 0.01).",
            )  # fmt: skip
        return self

    @property
    def law(self) -> Law | None:
        """The torque over the twist, where it is piecewise linear or has a rest; otherwise None."""
        rest, stiffness = self.rest, self.stiffness
        if isinstance(stiffness, Stages):
            places = tuple(one + rest for one in stiffness.angles)
            return Chain(
                places, stiffness.torques(), stiffness.stiffnesses, self.damping, neutral=rest
            )
        if self.gap is not None:
            low, high = self.gap
            return Gap(low + rest, high + rest, stiffness, self.damping)
        if rest != 0.0:
            return Chain((), (-stiffness * rest,), (stiffness,), self.damping, neutral=rest)
        return None

    @property
    def largest_stiffness(self) -> float:
        """The stiffness, or the largest one of its stages [N m/rad]."""
        given = self.stiffness
        return max(given.stiffnesses) if isinstance(given, Stages) else given

    def inner(self) -> dict[str, Part]:
        """The stages of the stiffness."""
        return {"stiffness": self.stiffness} if isinstance(self.stiffness, Stages) else {}


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
