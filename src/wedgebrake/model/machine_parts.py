"""Parts of a machine: inertias, driven bodies, shafts, joints, contacts and torques."""

from __future__ import annotations

import math
import re
from abc import abstractmethod
from bisect import bisect_left
from collections.abc import Collection, Mapping, Sequence
from itertools import accumulate, pairwise
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Self

from numpy.typing import ArrayLike
from pydantic import (
    AfterValidator,
    BeforeValidator,
    Field,
    GetCoreSchemaHandler,
    GetJsonSchemaHandler,
    InstanceOf,
    SerializeAsAny,
    Strict,
    WithJsonSchema,
    model_validator,
)
from pydantic_core import CoreSchema, core_schema

from wedgebrake.model.actuation import Actuation
from wedgebrake.model.brakes import Brake
from wedgebrake.model.friction import Friction, SetValuedFriction
from wedgebrake.model.part import Chosen, Part, Positional, given, of_kind, parameter
from wedgebrake.model.piecewise import Chain, Gap, Law
from wedgebrake.model.signals.signals import OrSignal, Signal, as_signal, number_of
from wedgebrake.model.validation import NotAllowedError, wrong

GROUND = "ground"
"""Name of the ground as an end of shafts and contacts."""
_NAME = re.compile(r"[^\W\d][\w-]*")
_LONGEST = 60
_MOST_STAGES = 1000
_STIFFEST = 1e15
A_TORQUE = "torque"
"""Title that marks a torque in a schema."""
_FARTHEST = 1e12
# Share of the largest speed of a driven body that is rounding in its mean.
_MEAN = 1e-12
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


def own_name(**extra: Any) -> Any:
    """The field for the name of a part."""
    return parameter(
        "name, different from those of all other parts", unit="-", example="disc", **extra
    )


def end(description: str, example: str, **extra: Any) -> Any:
    """A field that names an inertia."""
    return parameter(description, unit="-", example=example, **extra)


class Inertia(Named):
    """A rotating body, with its initial angle and speed."""

    table: ClassVar[str] = "inertia"

    name: Name = own_name()
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


class Driven(Named):
    """A rotating body whose speed is given: a moved spring end, a road, a test bench.

    Its speed is the value of the signal at all times, whatever the torques on it. Shafts and
    contacts join it as they join an inertia; contacts have it as their second body ``b``.
    """

    table: ClassVar[str] = "driven"
    inertia: ClassVar[float] = math.inf
    """Its inertia: no torque changes its speed."""

    name: Name = own_name()
    speed: Annotated[float | Signal, OrSignal(-1e6, 1e6)] = parameter(
        "its speed, a number or a signal", symbol="omega", unit="rad/s", example=80.0
    )
    angle: float = parameter(
        "angle at the start", symbol="q", unit="rad", example=0.0, default=0.0, ge=-1e12, le=1e12
    )

    if TYPE_CHECKING:

        def __init__(self, name: str, speed: float | Signal, angle: float = 0.0) -> None: ...

    def mean_speed(self, period: float) -> float:
        """Mean of the speed over a period of its signal [rad/s]; 0 where only rounding is left."""
        speed = as_signal(self.speed)
        mean = float(speed.integral(period)) / period
        return mean if abs(mean) > _MEAN * speed.bound else 0.0

    @model_validator(mode="after")
    def _not_ground(self) -> Driven:
        if self.name == GROUND:
            raise self._wrong("name", "another name than 'ground'", "The ground does not turn.")
        return self


Body = Inertia | Driven


def speed_at(body: Body, time: float) -> float:
    """Speed of a driven body at a time, or that of an inertia at the start [rad/s]."""
    return float(as_signal(body.speed)(time)) if isinstance(body, Driven) else body.speed


def check_ascending(name: str, values: tuple[float, ...], way_out: str) -> None:
    """Raise ``InputError`` unless values ascend."""
    for at, (before, after) in enumerate(pairwise(values), 1):
        if not before < after:
            raise wrong(f"{name}[{at}]", after, f"above {before!r}, the value before it", way_out)


class Stages(Positional):
    """Stiffness of a shaft that changes in stages, with a continuous piecewise-linear torque.

    The torque is 0 at the twist q_a - ratio q_b - rest = 0. There is one stiffness more than
    angles: ``stiffnesses[0]`` applies below the first angle, the last one above the last angle.
    None is negative.
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
            if isinstance(value, list | tuple):
                raise NotAllowedError("a number or wb.Stages(angles, stiffnesses)")
            found: float | Stages = Stages(**value) if isinstance(value, dict) else value
            return found if isinstance(found, Stages) else check(found)

        return core_schema.no_info_wrap_validator_function(
            checked, number,
            serialization=core_schema.plain_serializer_function_ser_schema(
                lambda value: value.model_dump() if isinstance(value, Stages) else value
            ),
        )  # fmt: skip

    def __get_pydantic_json_schema__(
        self,
        _: CoreSchema,
        handler: GetJsonSchemaHandler,
    ) -> dict[str, Any]:
        stages = Stages.model_json_schema()
        stages.pop("title", None)
        return {"anyOf": [{"type": "number", "minimum": 0, "maximum": _STIFFEST}, stages]}


def _composed(data: dict[str, Any], *ends: str) -> dict[str, str]:
    """The default name of a part from those of its ends; nothing if one is missing."""
    return {"name": "-".join(str(data[one]) for one in ends)} if {*ends} <= {*data} else {}


class Shaft(Named):
    """A spring and a damper between two inertias, or between an inertia and the ground.

    The torque tau = stiffness (q_a - ratio q_b - rest) + damping (omega_a - ratio omega_b) acts as
    -tau on ``a`` and as ratio tau on ``b``. The stiffness can be given as ``Stages``. With a
    ``gap`` (low, high), there is no torque while low < q_a - ratio q_b - rest < high; beyond a
    limit, the spring acts on the twist from this limit on. Spring and damper do not pull: contact
    ends when their torque has fallen to zero. A shaft to the ground with a gap is an end stop.
    ``gap`` and ``Stages`` exclude each other.
    """

    table: ClassVar[str] = "shaft"
    listed: ClassVar[frozenset[str]] = frozenset({"gap"})
    later: ClassVar[frozenset[str]] = frozenset({"rest", "gap"})

    a: Name = end("name of the first inertia", "motor")
    b: Name = end("name of the second inertia, or 'ground'", "disc")
    stiffness: Annotated[float | Stages, _OrStages()] = parameter(
        "torsional stiffness", symbol="k", unit="N m/rad", example=2e4
    )
    damping: float = parameter(
        "viscous damping", symbol="c", unit="N m s/rad", example=1.0, default=0.0, ge=0, le=1e12
    )
    ratio: float = parameter(
        "gear ratio, speed of a over speed of b", symbol="r", example=1.0, default=1.0,
        ge=-1e6, le=1e6,
    )  # fmt: skip
    name: Name = own_name(default_factory=lambda data: f"{data.get('a', 'a')}-{data.get('b', 'b')}")
    rest: float = parameter(
        "twist at which the spring has no torque; a preload", symbol="phi_0", unit="rad",
        example=0.01, default=0.0, ge=-_FARTHEST, le=_FARTHEST,
    )  # fmt: skip
    gap: Annotated[tuple[float, float], Strict(False)] | None = parameter(
        "gap without torque: its lower and upper limit, relative to rest", symbol="s",
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
        return super()._label(_composed(data, "a", "b") | data)

    @model_validator(mode="after")
    def _between(self) -> Shaft:
        check_ends(self)
        if self.ratio == 0.0:
            raise self._wrong("ratio", "another number than 0", "Leave it out if there is no gear.")
        if self.b == GROUND and self.ratio != 1.0:
            raise self._wrong("ratio", "1 for a shaft to the ground", "The ground does not turn.")
        if self.gap is None:
            return self
        if isinstance(self.stiffness, Stages):
            raise self._wrong(
                "gap", "left out if the stiffness has stages",
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
        """The torque over the twist, where it is piecewise linear; otherwise None."""
        rest, stiffness = self.rest, self.stiffness
        if isinstance(stiffness, Stages):
            places = tuple(one + rest for one in stiffness.angles)
            return Chain(
                places, stiffness.torques(), stiffness.stiffnesses, self.damping, neutral=rest
            )
        if self.gap is not None:
            low, high = self.gap
            return Gap(low + rest, high + rest, stiffness, self.damping)
        return None

    @property
    def preload(self) -> float:
        """Torque of a shaft without a law at the twist 0, with the opposite sign [N m]."""
        return 0.0 if self.law is not None else self.largest_stiffness * self.rest

    @property
    def largest_stiffness(self) -> float:
        """The stiffness, or the largest one of its stages [N m/rad]."""
        given = self.stiffness
        return max(given.stiffnesses) if isinstance(given, Stages) else given

    def inner(self) -> dict[str, Part]:
        """The stages of the stiffness."""
        return {"stiffness": self.stiffness} if isinstance(self.stiffness, Stages) else {}


class Factors(dict[str, float]):
    """Numbers by name that do not change."""

    def _refuse(self, *_: Any, **__: Any) -> Any:
        raise TypeError("Factors: cannot be changed")

    __setitem__ = __delitem__ = update = pop = popitem = clear = setdefault = __ior__ = _refuse

    def __hash__(self) -> int:  # type: ignore[override]
        return hash(frozenset(self.items()))

    def __reduce__(self) -> Any:
        return Factors, (dict(self),)


def factors(value: Any, quantities: Collection[str], allowed: str) -> dict[str, Any]:
    """Factors of quantities of parts by dotted name, also from the nested tables of a study file.

    quantities : last words of the names
    allowed    : what is allowed, for the error message
    """
    if not isinstance(value, Mapping):
        raise NotAllowedError(allowed)
    found: dict[str, Any] = {}
    for name, one in value.items():
        if isinstance(one, Mapping):
            found |= {f"{name}.{rest}": factor for rest, factor in one.items()}
        else:
            found[name] = one
    for name in found:
        if not isinstance(name, str) or name.rpartition(".")[2] not in quantities:
            names = ", ".join(f'"disc.{one}"' for one in quantities)
            raise NotAllowedError(f"a mapping with names such as {names}")
    return found


def _normal_factors(value: Any) -> Any:
    allowed = 'a mapping of angles and speeds to numbers: {"disc.angle": 2e4}'
    return factors(value, ("angle", "speed"), allowed)


_Factor = Annotated[float, Field(ge=-_STIFFEST, le=_STIFFEST)]
_FactorsField = Annotated[
    dict[str, _Factor], BeforeValidator(_normal_factors), AfterValidator(Factors)
]


class Contact(Named):
    """A brake or clutch: friction of an inertia against the ground, a moving base or an inertia.

    The sliding speed is the speed of ``a`` minus ``ratio`` times that of ``b``, or, for a contact
    with the ground, minus ``base_speed``, the speed of the base. The torque on ``b`` is -ratio
    times that on ``a``. The ``normal`` force due to angles and speeds is added to the actuation
    force before the release at 0.
    """

    table: ClassVar[str] = "contact"
    later: ClassVar[frozenset[str]] = frozenset({"normal", "ratio"})
    ends: ClassVar[tuple[str, str]] = ("a", "b")

    a: Name = end("name of the inertia that it brakes", "disc")
    b: Name = end("name of the second inertia, or 'ground'", GROUND, default=GROUND)
    name: Name = own_name()
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
    normal: _FactorsField = parameter(
        "force per angle [N/rad] and speed [N s/rad] of inertias, added to that of the actuation",
        unit="-", example={"disc.angle": 2e4}, default_factory=Factors,
    )  # fmt: skip
    ratio: float = parameter(
        "speed of a over that of b without sliding", symbol="r", example=1.0, default=1.0,
        ge=-1e6, le=1e6,
    )  # fmt: skip

    if TYPE_CHECKING:

        def __init__(self, /, *values: Any, **data: Any) -> None: ...

    @model_validator(mode="after")
    def _pressed(self) -> Contact:
        if not self.normal:
            return self
        law, given = self.friction, self.actuation
        if not (isinstance(law, SetValuedFriction) and law.constant):
            raise self._wrong(
                "normal", "left out where friction varies with the speed",
                "Give friction=wb.CoulombFriction(...).",
            )  # fmt: skip
        if given.sample_time is not None or given.limits is not None:
            name = "limits" if given.sample_time is None else "sample_time"
            raise self._wrong(
                "normal", f"left out for an actuation with {name}", f"Leave out {name}."
            )
        return self

    @model_validator(mode="after")
    def _between(self) -> Contact:
        check_ends(self)
        if self.b != GROUND and self.base_speed != 0.0:
            raise self._wrong(
                "base_speed", "0 for a contact between two inertias",
                "Only the base of a contact with the ground can turn; leave it out.",
            )  # fmt: skip
        if self.ratio == 0.0:
            raise self._wrong("ratio", "a number other than 0", "Leave it out if there is no gear.")
        if self.b == GROUND and self.ratio != 1.0:
            raise self._wrong(
                "ratio", "1 for a contact with the ground", "Give the base_speed of the base."
            )
        return self

    def on_base(self, speed: float | Signal) -> Contact:
        """The contact between its first inertia and a base, in place of b, with a speed [rad/s]."""
        base = self.ratio * speed if self.geared else speed
        found = self.model_copy(update={"b": GROUND, "base_speed": base, "ratio": 1.0})
        found.__pydantic_fields_set__.discard("ratio")
        return found

    @property
    def geared(self) -> bool:
        """True if a ratio is given."""
        return "ratio" in self.model_fields_set and self.b != GROUND

    @property
    def unlisted(self) -> frozenset[str]:
        """Fields without a dotted name among the numbers of a machine: a ratio that is not given.

        Most contacts have no ratio, and contacts with one need another solver.
        """
        return frozenset() if self.geared else frozenset({"ratio"})

    def in_loop(self, closed: bool) -> Contact:
        """The contact with a mark whether controllers command or measure its force.

        closed : whether they do
        """
        return self.model_copy(update={"actuation": self.actuation.in_loop(closed)})

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


class OverState(Positional, Chosen):
    """A piecewise-linear torque over the speed or the angle of an inertia, see ``Torque``."""

    table: ClassVar[str] = "signal"
    kinds: ClassVar[dict[str, type[Any]]] = {}
    of_speed: ClassVar[bool]
    listed: ClassVar[frozenset[str]] = frozenset({"speeds", "angles", "torques"})

    if TYPE_CHECKING:

        @property
        def torques(self) -> tuple[float, ...]:
            """Torques at the points."""

        @property
        def scale(self) -> float | Signal:
            """Factor of the torques."""

    @property
    @abstractmethod
    def law(self) -> Chain:
        """The lines between the points, with a scale that does not vary."""

    @property
    def throttle(self) -> Signal | None:
        """The scale if it varies in time, by which the law must be multiplied; otherwise None."""
        return self.scale if number_of(self.scale) is None else None  # type: ignore[return-value]

    @property
    def scaled(self) -> tuple[float, ...]:
        """The torques at the points, with a scale that does not vary."""
        scale = number_of(self.scale)
        return self.torques if scale is None else tuple(scale * one for one in self.torques)

    def __mul__(self, other: float | Signal) -> Self:
        """The torque with a further factor, a number or a signal."""
        found = type(self)(**{**given(self), "scale": other})
        if self.scale == 1.0:
            return found
        return type(self)(**{**given(self), "scale": self.scale * found.scale})

    __rmul__ = __mul__


def _points(description: str, **extra: Any) -> Any:
    return parameter(description, min_length=1, max_length=_MOST_STAGES, strict=False, **extra)


_Scale = Annotated[float | Signal, OrSignal(-1e6, 1e6)]


def _scale() -> Any:
    return parameter(
        "factor of the torques, a number or a signal, such as a throttle", symbol="s",
        example=0.5, default=1.0,
    )  # fmt: skip


_Torques = tuple[Annotated[float, Field(ge=-1e12, le=1e12)], ...]
_Places = tuple[Annotated[float, Field(ge=-_FARTHEST, le=_FARTHEST)], ...]


class OverSpeed(OverState):
    """A torque over a speed, linear between points and constant beyond the first and the last."""

    kind: ClassVar[str] = "over_speed"
    of_speed: ClassVar[bool] = True

    speeds: _Places = _points(
        "speeds, ascending", symbol="omega", unit="rad/s", example=[0.0, 100.0, 160.0]
    )
    torques: _Torques = _points(
        "torques at these speeds", symbol="T", unit="N m", example=[200.0, 150.0, 0.0]
    )
    scale: _Scale = _scale()

    if TYPE_CHECKING:

        def __init__(
            self, speeds: ArrayLike, torques: ArrayLike, scale: float | Signal = 1.0
        ) -> None: ...

    @model_validator(mode="after")
    def _consistent(self) -> OverSpeed:
        _check_points(self, "speeds")
        return self

    @property
    def law(self) -> Chain:
        """The lines between the points, and constants beyond them."""
        torques = self.scaled
        return Chain(self.speeds, torques, (0.0, *_slopes(self.speeds, torques), 0.0))


class OverAngle(OverState):
    """A torque over an angle, linear between points and constant beyond them, or periodic.

    With a period it repeats for all angles, linear from the last point to the first point of the
    next period.
    """

    kind: ClassVar[str] = "over_angle"
    of_speed: ClassVar[bool] = False

    angles: _Places = _points("angles, ascending", symbol="q", unit="rad", example=[0.0, 1.0, 2.0])
    torques: _Torques = _points(
        "torques at these angles", symbol="T", unit="N m", example=[0.0, 50.0, 0.0]
    )
    period: float | None = parameter(
        "period of the angle", unit="rad", example=6.283185307179586, default=None, gt=0,
        le=_FARTHEST,
    )  # fmt: skip
    scale: _Scale = _scale()

    if TYPE_CHECKING:

        def __init__(
            self, angles: ArrayLike, torques: ArrayLike, period: float | None = None,
            scale: float | Signal = 1.0,
        ) -> None: ...  # fmt: skip

    @model_validator(mode="after")
    def _consistent(self) -> OverAngle:
        _check_points(self, "angles")
        if self.period is None:
            return self
        end = self.angles[0] + self.period
        if self.angles[-1] > end:
            raise wrong(
                "signal.period", self.period,
                f"at least {self.angles[-1] - self.angles[0]!r}, from the first to the last angle",
                "Give the points of one period only.",
            )  # fmt: skip
        if self.angles[-1] == end and self.torques[-1] != self.torques[0]:
            raise wrong(
                "signal.torques", self.torques,
                "the same at the first and the last angle, a period apart",
                "The torque must not jump.",
            )  # fmt: skip
        return self

    @property
    def law(self) -> Chain:
        """The lines between the points."""
        angles, torques = self.angles, self.scaled
        if self.period is None:
            return Chain(angles, torques, (0.0, *_slopes(angles, torques), 0.0))
        end = angles[0] + self.period
        if angles[-1] == end:
            angles, torques = angles[:-1], torques[:-1]
        slopes = _slopes((*angles, end), (*torques, torques[0]))
        # The line before the first place is the last one.
        return Chain(angles, torques, (slopes[-1], *slopes), period=self.period)


def _check_points(part: OverState, places: str) -> None:
    check_ascending(f"signal.{places}", getattr(part, places), f"Sort the {places}.")
    count, torques = len(getattr(part, places)), getattr(part, "torques")  # noqa: B009
    if len(torques) != count:
        raise wrong(
            "signal.torques", torques, f"a list of {count} values, as many as signal.{places} has",
            f"Give one torque for each of the {places}.",
        )  # fmt: skip


def _slopes(places: Sequence[float], values: Sequence[float]) -> tuple[float, ...]:
    """Slopes of the lines between points."""
    return tuple(
        (values[i + 1] - values[i]) / (places[i + 1] - places[i]) for i in range(len(places) - 1)
    )


_TORQUES = (
    "a number, a signal, OverSpeed or OverAngle, for example wb.Harmonic(500.0, 10.03) or"
    " wb.OverSpeed([0.0, 100.0], [300.0, 0.0])"
)


def _as_torque(value: Any) -> Any:
    """Convert a number to a constant signal, and a table to the part of its kind."""
    if isinstance(value, dict):
        return of_kind("signal", value, {**Signal.kinds, **OverState.kinds})
    if isinstance(value, OverState):
        return value
    try:
        return as_signal(value)
    except NotAllowedError:
        raise NotAllowedError(_TORQUES) from None


_TorqueField = Annotated[
    SerializeAsAny[Signal | OverState],
    BeforeValidator(_as_torque),
    WithJsonSchema({"title": A_TORQUE, "type": "object"}),
]


class Torque(Named):
    """A torque on an inertia: a function of time, or of its speed or angle [N m].

    With ``wb.OverSpeed`` or ``wb.OverAngle`` the torque depends on the speed or the angle of
    ``on``; with ``relative_to``, on that relative to another inertia, on which the opposite torque
    acts. Such a torque can be multiplied by a signal, for example by the position of a throttle:
    ``wb.OverSpeed(speeds, torques) * wb.Ramp(0.0, 1.0, 0.5)``.
    """

    table: ClassVar[str] = "torque"
    later: ClassVar[frozenset[str]] = frozenset({"relative_to"})

    on: Name = end("name of the inertia on which it acts", "disc")
    signal: _TorqueField = parameter(
        "the torque, a number, a signal or a curve", symbol="T", unit="N m", example=500.0
    )
    name: Name = own_name(default_factory=lambda data: f"{data.get('on', 'on')}-torque")
    relative_to: Name | None = end(
        "name of the inertia to which the speed or angle is relative", "frame", default=None
    )

    if TYPE_CHECKING:

        def __init__(
            self,
            on: str,
            signal: Signal | float | OverState,
            name: str = ...,
            relative_to: str | None = None,
        ) -> None: ...

    @classmethod
    def _label(cls, data: dict[str, Any]) -> str:
        """The name, by default that of the inertia."""
        named = {"name": f"{data['on']}-torque"} if "on" in data else {}
        return super()._label(named | data)

    @model_validator(mode="after")
    def _on_inertia(self) -> Torque:
        if self.on == GROUND:
            raise self._wrong("on", "the name of an inertia", "The ground does not turn.")
        if self.relative_to is None:
            return self
        if not isinstance(self.signal, OverState):
            raise self._wrong(
                "relative_to", "left out for a torque over time",
                "Give wb.OverSpeed or wb.OverAngle, or two torques of opposite sign.",
            )  # fmt: skip
        if self.relative_to in (self.on, GROUND):
            raise self._wrong(
                "relative_to", f"another inertia than {self.on!r}", "Leave it out for the ground."
            )
        return self

    @property
    def over_time(self) -> Signal | None:
        """The torque as a signal; None if it depends on the state."""
        return self.signal if isinstance(self.signal, Signal) else None

    def inner(self) -> dict[str, Part]:
        """The signal of the torque."""
        return {"signal": self.signal}


class Joint(Named):
    """A rigid connection of bodies: a linear equation between their angles.

    With the ``factors`` f, sum(f q) = 0 for the angles and for the speeds q. The torque T of the
    joint acts as -f T on each body, and its power is zero.
    """

    ends: ClassVar[tuple[str, ...]]
    """Fields that name its bodies."""

    @property
    @abstractmethod
    def factors(self) -> dict[str, float]:
        """Factor of each body by name; that of the first one is 1."""

    @classmethod
    def _label(cls, data: dict[str, Any]) -> str:
        """The name, by default composed of those of the bodies."""
        return super()._label(_composed(data, *cls.ends) | data)

    @model_validator(mode="after")
    def _of_bodies(self) -> Joint:
        taken: list[str] = []
        for end in self.ends:
            name = getattr(self, end)
            if name == GROUND:
                raise self._wrong(
                    end, "the name of an inertia or a driven body",
                    "Fix a body to the ground by wb.Driven(name, 0.0) or a contact.",
                )  # fmt: skip
            if name in taken:
                raise self._wrong(end, f"a body other than {name!r}")
            taken.append(name)
        return self


def _joint_name(*ends: str) -> Any:
    return own_name(default_factory=lambda data: "-".join(data.get(one, one) for one in ends))


class Gear(Joint):
    """A rigid gear between two bodies: the angle of ``a`` is ratio times that of ``b``.

    This also holds for the angles and speeds at the start; values that are left out follow from the
    others. The torque T of the joint acts as -T on ``a`` and as ratio T on ``b``.
    """

    table: ClassVar[str] = "gear"
    ends: ClassVar[tuple[str, ...]] = ("a", "b")

    a: Name = end("name of the first body", "motor")
    b: Name = end("name of the second body", "wheel")
    ratio: float = parameter(
        "gear ratio, speed of a over speed of b", symbol="r", example=3.5, ge=-1e6, le=1e6
    )
    name: Name = _joint_name("a", "b")

    if TYPE_CHECKING:

        def __init__(self, a: str, b: str, ratio: float, name: str = ...) -> None: ...

    @model_validator(mode="after")
    def _with_ratio(self) -> Gear:
        if self.ratio == 0.0:
            raise self._wrong("ratio", "a number other than 0", "Give -1 for opposite directions.")
        return self

    @property
    def factors(self) -> dict[str, float]:
        """1 for a, -ratio for b."""
        return {self.a: 1.0, self.b: -self.ratio}


class Rigid(Joint):
    """A rigid joint of two bodies, which turn together.

    The torque T of the joint acts as -T on ``a`` and as T on ``b``.
    """

    table: ClassVar[str] = "rigid"
    ends: ClassVar[tuple[str, ...]] = ("a", "b")

    a: Name = end("name of the first body", "hub")
    b: Name = end("name of the second body", "disc")
    name: Name = _joint_name("a", "b")

    if TYPE_CHECKING:

        def __init__(self, a: str, b: str, name: str = ...) -> None: ...

    @property
    def factors(self) -> dict[str, float]:
        """1 for a, -1 for b."""
        return {self.a: 1.0, self.b: -1.0}


class Planetary(Joint):
    """A planetary gear: omega_sun + ratio omega_ring = (1 + ratio) omega_carrier.

    The ratio is the number of teeth of the ring over that of the sun; it is negative for a gear
    with pairs of planets. The torque T of the joint acts as -T on the sun, -ratio T on the ring and
    (1 + ratio) T on the carrier.
    """

    table: ClassVar[str] = "planetary"
    ends: ClassVar[tuple[str, ...]] = ("sun", "ring", "carrier")

    sun: Name = end("name of the body with the sun", "motor")
    ring: Name = end("name of the body with the ring", "ring")
    carrier: Name = end("name of the body with the carrier", "wheel")
    ratio: float = parameter(
        "teeth of the ring over those of the sun", symbol="z", example=3.0, ge=-1e6, le=1e6
    )
    name: Name = _joint_name("sun", "ring", "carrier")

    if TYPE_CHECKING:

        def __init__(
            self, sun: str, ring: str, carrier: str, ratio: float, name: str = ...
        ) -> None: ...

    @model_validator(mode="after")
    def _with_ratio(self) -> Planetary:
        if self.ratio in (0.0, -1.0):
            raise self._wrong("ratio", "a number other than 0 and -1", "Give a wb.Gear instead.")
        return self

    @property
    def factors(self) -> dict[str, float]:
        """1 for the sun, ratio for the ring, -(1 + ratio) for the carrier."""
        return {self.sun: 1.0, self.ring: self.ratio, self.carrier: -(1.0 + self.ratio)}


def check_ends(part: Named, first: str = "a", second: str = "b") -> None:
    """Check that the first inertia of a part is not the ground, and that the second one differs.

    first, second : the fields that name the inertias
    """
    if getattr(part, first) == GROUND:
        raise part._wrong(first, "the name of an inertia", f"Give the ground as {second}.")
    if getattr(part, first) == getattr(part, second):
        raise part._wrong(second, f"another inertia than {getattr(part, first)!r}, or 'ground'")
