"""Friction: the signed coefficient m as a function of the sliding speed v_r = R v.

Two families. Set-valued laws (``CoulombFriction``, ``TabulatedFriction``, ``StribeckFriction``)
hold any torque in an interval at rest; in motion they are piecewise linear, for the exact solver,
or a curve. Smooth laws (``SmoothedFriction``, ``CustomFriction``) are functions of the speed alone:
the smooth solver's.
"""

from __future__ import annotations

import bisect
import math
from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import Annotated, Any, ClassVar, Self

from pydantic import ConfigDict, Field, Strict, model_validator

from wedgebrake.errors import InputError
from wedgebrake.model.part import Chosen, parameter
from wedgebrake.model.validation import wrong


def _kinetic(**extra: Any) -> Any:
    return parameter(
        "kinetic friction coefficient", symbol="mu_k", unit="1", example=0.3, ge=0, le=5, **extra
    )


class Friction(Chosen):
    """A friction law."""

    table: ClassVar[str] = "friction"
    kinds: ClassVar[dict[str, type[Friction]]] = {}

    @property
    def reference(self) -> float:
        """The kinetic coefficient that the normalised groups refer to [1]."""
        raise NotImplementedError

    @property
    def constant(self) -> bool:
        """Return True if the kinetic coefficient is known to be the same at all speeds.

        A steep part about rest does not count. Solvers and ``stability`` then do not evaluate the
        law at other speeds, so that a law states it only where it holds.
        """
        return False


class SetValuedFriction(Friction):
    """A law that holds an interval of torque at rest.

    To add one, write a class that states its parameters, ``kind``, its name in study files,
    ``breakaway``, and the kinetic coefficient in motion, by one or both of

    - ``nodes()``, the ends of lines between which it is linear: for the method exact, and for the
      method smooth too if there is no curve;
    - ``kinetic_at(speed)``, a curve, smooth except at the speeds ``bends``: for the method smooth.

    ``constant`` is False unless the class states otherwise: for values of its parameters at which
    the coefficient is the same at all speeds, it may return True. The law is then treated as
    Coulomb friction, and its curve is not evaluated.
    """

    def nodes(self) -> tuple[tuple[float, float], ...]:
        """(sliding speed [m/s], kinetic coefficient) where the law bends, from speed 0 on."""
        raise InputError(
            f"friction = {type(self).__name__}: is a curve over the sliding speed, but"
            " straight lines are needed here. Use method='smooth', or define nodes().",
            name="friction", value=type(self).__name__, allowed="a law with nodes()",
        )  # fmt: skip

    @property
    def has_nodes(self) -> bool:
        """Return True if the law defines ``nodes``."""
        return type(self).nodes is not SetValuedFriction.nodes

    def kinetic_at(self, speed: float) -> float:
        """The kinetic coefficient at the sliding speed v >= 0 [m/s]; linear between the nodes."""
        speeds, coefficients = zip(*self.nodes(), strict=True)
        last = bisect.bisect_right(speeds, speed)
        if last == len(speeds):
            return float(coefficients[-1])
        share = (speed - speeds[last - 1]) / (speeds[last] - speeds[last - 1])
        rise = coefficients[last] - coefficients[last - 1]
        return float(coefficients[last - 1] + share * rise)

    @property
    def is_curve(self) -> bool:
        """Return True if the law defines its own ``kinetic_at``."""
        return type(self).kinetic_at is not SetValuedFriction.kinetic_at

    @property
    def bends(self) -> tuple[float, ...]:
        """Sliding speeds above 0 at which ``kinetic_at`` has a kink [m/s]."""
        if self.is_curve:
            return ()
        return tuple(speed for speed, _ in self.nodes()[1:])

    @property
    def reference(self) -> float:
        """The coefficient at vanishing speed [1]."""
        return self.kinetic_at(0.0)

    @property
    def breakaway(self) -> float:
        """The static coefficient mu_s [1]."""
        raise NotImplementedError


class SmoothFriction(Friction):
    """A law that is a function of the sliding speed.

    To add one, write a class that states

    - its parameters, and ``kind``, its name in study files;
    - ``shape()``: the numbers that its law needs, four at most;
    - ``law(speed, shape)``, a static method: m(v_r), with ``math`` functions only (it is compiled
      for the smooth solver);
    - ``transition``, and ``reference`` for the normalised groups.

    ``limit`` and ``saturation`` let the solver use closed forms where the law is constant;
    ``narrow_places`` declares features that steps must not miss.
    """

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        for speed in (-1.0, 1.0):
            value = self.coefficient(speed)
            if not value * speed >= 0.0:
                raise _wrong_sign(speed, value)
        return self

    def shape(self) -> tuple[float, ...]:
        """The numbers that ``law`` needs, in its order."""
        return ()

    def coefficient(self, speed: float) -> float:
        """Signed friction coefficient m at the sliding speed v_r [m/s]."""
        law: Callable[..., float] = type(self).law  # type: ignore[attr-defined]
        return float(law(float(speed), self.shape()))

    @property
    def transition(self) -> float:
        """Half width of the steep part about zero speed [m/s]."""
        raise NotImplementedError

    @property
    def narrow_places(self) -> tuple[tuple[float, float], ...]:
        """(sliding speed, half width) of narrow features away from rest [m/s]."""
        return ()

    @property
    def limit(self) -> float:
        """The coefficient at high speed [1]; nan if it is not known."""
        return math.nan

    def layer(self, tolerance: float) -> float:  # noqa: ARG002 - laws may sharpen it
        """Speed [m/s] beyond which the steep part has ended, to a relative tolerance."""
        return 10.0 * self.transition

    def saturation(self, tolerance: float) -> float:  # noqa: ARG002 - laws may sharpen it
        """Speed [m/s] beyond which m equals ``limit`` to a relative tolerance; inf if none."""
        return math.inf


def _check_static(kinetic: float, static: float) -> None:
    if static < kinetic:
        raise wrong(
            "friction.static", static, f"at least friction.kinetic = {kinetic!r}",
            "Raise static, lower kinetic, or leave static out to make them equal.",
        )  # fmt: skip


def _wrong_sign(speed: float, value: float) -> InputError:
    return InputError(
        f"friction.law: law({speed}) = {value!r}: must have the sign of its argument. Friction"
        " opposes sliding; return m = mu sign(v_r).",
        name="friction.law", value=value, allowed="a number with the sign of the speed",
    )  # fmt: skip


class _TwoCoefficients(Friction):
    """A law with a kinetic and a static coefficient."""

    kinetic: float = _kinetic()
    static: float = parameter(
        "static friction coefficient (default: the kinetic one)", symbol="mu_s", unit="1",
        example=0.33, ge=0, le=5, default_factory=lambda data: data.get("kinetic", 0.0),
    )  # fmt: skip

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        _check_static(self.kinetic, self.static)
        return self

    @property
    def reference(self) -> float:
        """The kinetic coefficient mu_k [1]."""
        return self.kinetic

    @property
    def breakaway(self) -> float:
        """The static coefficient mu_s [1]."""
        return self.static


class CoulombFriction(_TwoCoefficients, SetValuedFriction):
    """Coulomb friction, set-valued at rest (eq. 4)."""

    kind: ClassVar[str] = "coulomb"

    @property
    def constant(self) -> bool:
        """True: one value at all speeds."""
        return True

    def nodes(self) -> tuple[tuple[float, float], ...]:
        """One value at all speeds."""
        return ((0.0, self.kinetic),)


class TabulatedFriction(SetValuedFriction):
    """A kinetic coefficient that varies with speed, linear between the points of a table.

    Constant beyond the last point; ``scale`` multiplies the whole table. With actuation that
    depends on velocity, or a brake whose g is not linear, the *torque* is made linear between the
    points (and the release speed); add points to refine.
    """

    kind: ClassVar[str] = "tabulated"

    speeds: tuple[float, ...] = parameter(
        "sliding speeds of the table, from 0 on, ascending [m/s]", symbol="v_r", unit="m/s",
        example=[0.0, 0.1, 1.0], min_length=1, max_length=10_000, strict=False,
    )  # fmt: skip
    coefficients: tuple[Annotated[float, Field(ge=0, le=5)], ...] = parameter(
        "kinetic friction coefficients at those speeds", symbol="mu_k",
        example=[0.4, 0.35, 0.3], min_length=1, max_length=10_000, strict=False,
    )  # fmt: skip
    static: float = parameter(
        "static friction coefficient (default: the first of the table)", symbol="mu_s",
        unit="1", example=0.4, ge=0, le=5,
        default_factory=lambda data: next(iter(data.get("coefficients", ())), 0.0),
    )  # fmt: skip
    scale: float = parameter(
        "factor of all coefficients, the static one included", example=1.1,
        default=1.0, ge=0, le=100,
    )  # fmt: skip

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        speeds, coefficients = self.speeds, self.coefficients
        if len(speeds) != len(coefficients):
            raise InputError(
                f"friction.coefficients: has {len(coefficients)} values, but friction.speeds"
                f" has {len(speeds)}. Give one coefficient for each speed.",
                name="friction.coefficients", value=coefficients,
                allowed=f"a list of {len(speeds)} values",
            )  # fmt: skip
        if speeds[0] != 0.0:
            raise wrong("friction.speeds[0]", speeds[0], "0", "Begin the table at rest.")
        for before, after in pairwise(speeds):
            if not before + 1e-9 <= after <= 1e9:
                raise InputError(
                    f"friction.speeds: {after!r} follows {before!r}: must ascend, by at least 1e-9"
                    " m/s and to at most 1e9 m/s. Sort the table and remove repeated speeds.",
                    name="friction.speeds", value=after, allowed="ascending speeds up to 1e9 m/s",
                )  # fmt: skip
        _check_static(coefficients[0], self.static)
        return self

    @property
    def constant(self) -> bool:
        """Return True if all values of the table are the same."""
        return len(set(self.coefficients)) == 1

    def nodes(self) -> tuple[tuple[float, float], ...]:
        """The table, multiplied by ``scale``."""
        scaled = (self.scale * one for one in self.coefficients)
        return tuple(zip(self.speeds, scaled, strict=True))

    @property
    def reference(self) -> float:
        """The coefficient at vanishing speed [1], without ``nodes`` of a long table."""
        return self.scale * self.coefficients[0]

    @property
    def breakaway(self) -> float:
        """The static coefficient mu_s, multiplied by ``scale`` [1]."""
        return self.scale * self.static


class SmoothedFriction(_TwoCoefficients, SmoothFriction):
    """m = mu_k [1 + (mu_s/mu_k - 1) exp(-decay |v_r|)] tanh(steepness v_r)  (eqs. 14, 15).

    The paper prints (14) without the factor mu_k.
    """

    kind: ClassVar[str] = "smoothed"

    decay: float = parameter(
        "decay of the static peak with speed", symbol="varsigma", unit="s/m", example=6.0,
        default=6.0, ge=0, le=1e9,
    )  # fmt: skip
    steepness: float = parameter(
        "steepness of tanh about zero speed", symbol="xi", unit="s/m", example=100.0,
        default=100.0, gt=0, le=1e9,
    )  # fmt: skip

    @property
    def constant(self) -> bool:
        """True without a static peak; the steep part about rest does not count."""
        return self.static == self.kinetic

    @property
    def transition(self) -> float:
        """1/steepness [m/s]."""
        return 1.0 / self.steepness

    @property
    def limit(self) -> float:
        """The kinetic coefficient, or the static one if the peak never decays [1]."""
        return self.kinetic if self.decay > 0.0 else self.static

    def layer(self, tolerance: float) -> float:
        """Speed [m/s] from which tanh is 1 to ``tolerance``: 1 - tanh(x) = 2 exp(-2x)."""
        return 0.5 * math.log(2.0 / tolerance) / self.steepness

    def saturation(self, tolerance: float) -> float:
        """Speed [m/s] from which both tanh and the static peak have gone, to ``tolerance``."""
        layer = self.layer(0.5 * tolerance)
        peak = self.static - self.kinetic
        if peak == 0.0 or self.decay == 0.0:
            return layer
        if self.kinetic == 0.0:
            return math.inf
        return max(layer, math.log(2.0 * peak / (self.kinetic * tolerance)) / self.decay)

    def shape(self) -> tuple[float, ...]:
        """The numbers that ``law`` needs."""
        return (self.kinetic, self.static - self.kinetic, self.decay, self.steepness)

    @staticmethod
    def law(speed: float, shape: Sequence[float]) -> float:
        """m(v_r), eq. (14), at a sliding speed v_r [m/s]; ``shape`` is what ``shape()`` gives."""
        peak = shape[1]
        if peak != 0.0:
            peak *= math.exp(-shape[2] * abs(speed))
        x = shape[3] * speed
        if abs(x) < 0.05:
            # tanh, 3 times as fast as the library's and as exact (error below 1e-16).
            y = x * x
            tanh = x * (1.0 - y * (1 / 3 - y * (2 / 15 - y * (17 / 315 - y * 62 / 2835))))
        else:
            e = math.exp(-2.0 * abs(x))
            tanh = math.copysign((1.0 - e) / (1.0 + e), x)
        return (shape[0] + peak) * tanh


# A law that has this share of its friction at this share of its width jumps at rest, or is
# steeper than stated: the solver would creep through the jump for ever, or not see the layer.
_INSIDE, _JUMP = 1e-3, 0.5
# Share of its width within which a law is replaced by a straight line: a value at rest other than
# 0, from rounding or the tail of a bump, would be a jump that the solver crosses again and again.
_STRAIGHT = 1e-6
# Narrow features: smallest half width relative to the speed, and largest speed [m/s].
_SHARPEST, _FASTEST = 1e-9, 1e6


class CustomFriction(SmoothFriction):
    """A smooth law of your own: m(v_r), a function that Numba can compile.

    ``law`` takes the sliding speed v_r [m/s] and returns the signed friction coefficient;
    it may have a kink at v_r = 0. Below 1e-6 of the width it is replaced by a straight line through
    0, so that rounding causes no friction at rest. ``width`` is the half width of its steep part
    about zero speed [m/s]: the solver never steps across that layer without resolving it. Away
    from rest the steps grow with the speed, to about a third of it, and the error control does
    not detect features between their stages: ``narrow`` declares each narrower feature as
    (sliding speed, half width) [m/s], for both directions. An undeclared feature may be missed
    at any rtol.
    """

    model_config = ConfigDict(arbitrary_types_allowed=True)

    law: Callable[[float], float] = Field(description="signed friction coefficient m(v_r)")
    width: float = parameter(
        "half width of the steep part", symbol="v_0", unit="m/s", example=0.01, gt=0, le=1e6
    )
    kinetic: float = _kinetic(default=0.0)
    narrow: tuple[Annotated[tuple[float, float], Strict(False)], ...] = parameter(
        "narrow features of the law away from rest: (sliding speed, half width) [m/s]", unit="m/s",
        example=[[0.5, 0.002]], default=(), max_length=1000, strict=False,
    )  # fmt: skip

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        for i, (speed, width) in enumerate(self.narrow):
            if not (0.0 < speed <= _FASTEST and _SHARPEST * speed <= width <= _FASTEST):
                raise wrong(
                    f"friction.narrow[{i}]", (speed, width), "a sliding speed above 0 and a half"
                    f" width of at least {_SHARPEST:g} times the speed, at most {_FASTEST:g} m/s",
                    "It applies to both directions; use width for the steep part at rest.",
                )  # fmt: skip
        for speed in (-1.0, 0.0, 1.0):
            value = self.law(speed)
            if not isinstance(value, int | float) or not math.isfinite(value):
                raise InputError(
                    f"friction.law: law({speed}) gave {value!r}: must be a finite number."
                    " Return the signed friction coefficient as a float.",
                    name="friction.law", value=value, allowed="a finite number",
                )  # fmt: skip
            if value * speed < 0.0:
                raise _wrong_sign(speed, value)
        at_width, inside = (abs(self.law(share * self.width)) for share in (1.0, _INSIDE))
        if inside > _JUMP * at_width:
            raise InputError(
                f"friction.law: law({_INSIDE * self.width:g}) is {inside:g} already, with"
                f" {at_width:g} at width = {self.width:g} m/s: must rise from 0 over about the"
                " width. State the true half width of the steep part, or use CoulombFriction or"
                " TabulatedFriction for friction that jumps at rest.",
                name="friction.law", value=inside, allowed="a law that rises from 0 over its width",
            )  # fmt: skip
        return self

    @property
    def reference(self) -> float:
        """The kinetic coefficient stated for the normalised groups [1]."""
        return self.kinetic

    @property
    def transition(self) -> float:
        """The stated half width [m/s]."""
        return self.width

    @property
    def narrow_places(self) -> tuple[tuple[float, float], ...]:
        """The declared ``narrow`` features [m/s]."""
        return self.narrow

    def shape(self) -> tuple[float, ...]:
        """(largest speed of the straight line [m/s], its slopes forwards and backwards [s/m])."""
        near = _STRAIGHT * self.width
        return (near, self.coefficient(near) / near, -self.coefficient(-near) / near)

    def coefficient(self, speed: float) -> float:
        """Signed friction coefficient m at the sliding speed v_r [m/s]."""
        return float(self.law(float(speed)))
