"""Friction that decays from its static to its kinetic value with the sliding speed."""

from __future__ import annotations

import math
from functools import cached_property
from typing import ClassVar

from wedgebrake.model.friction import SetValuedFriction, _TwoCoefficients
from wedgebrake.model.part import parameter


class StribeckFriction(_TwoCoefficients, SetValuedFriction):
    """mu(v) = kinetic + (static - kinetic) exp(-|v|/speed), set-valued at rest; v in m/s.

    The exact solver replaces the curve by straight lines. Their coefficient differs from mu(v) by
    at most ``tolerance`` at any speed, and equals mu(v) at rest and at high speeds. The method
    smooth uses the curve.
    """

    kind: ClassVar[str] = "stribeck"

    speed: float = parameter(
        "sliding speed at which the static peak has decayed to 1/e", symbol="v_0", unit="m/s",
        example=0.1, ge=1e-6, le=1e6,
    )  # fmt: skip
    tolerance: float = parameter(
        "largest error of the lines, in the coefficient", symbol="epsilon", example=1e-4,
        default=1e-4, ge=1e-8, le=1,
    )  # fmt: skip

    @property
    def constant(self) -> bool:
        """True without a static peak; False for a derived law with a curve of its own."""
        own = type(self).kinetic_at is StribeckFriction.kinetic_at
        return own and self.static == self.kinetic

    def kinetic_at(self, speed: float) -> float:
        """The kinetic coefficient mu at the sliding speed v [m/s]."""
        return self.kinetic + (self.static - self.kinetic) * math.exp(-abs(speed) / self.speed)

    def nodes(self) -> tuple[tuple[float, float], ...]:
        """Ends of the lines: (sliding speed [m/s], coefficient).

        The curve is convex: the ends of each line lie ``tolerance`` below it, except at rest, and
        the line is at most ``tolerance`` above it between them. The lines are as long as possible.
        """
        return self._nodes

    @cached_property
    def _nodes(self) -> tuple[tuple[float, float], ...]:
        peak = self.static - self.kinetic
        if peak == 0.0:
            return ((0.0, self.kinetic),)
        # Speeds in units of ``speed``; heights above the kinetic coefficient in units of the peak.
        error = self.tolerance / peak
        ending = max(-math.log(error), 0.0) if error < 1.0 else 0.0
        if ending == 0.0:
            return ((0.0, self.static), (self.speed, self.kinetic))
        places = [(0.0, 1.0)]
        while places[-1][0] < ending:
            places.append(_furthest(*places[-1], ending, error))
        return tuple((x * self.speed, self.kinetic + peak * y) for x, y in places)


def _furthest(x: float, y: float, ending: float, error: float) -> tuple[float, float]:
    """The last end of a line from (x, y) that lies at most ``error`` above exp(-x)."""

    def lowered(end: float) -> float:
        return math.exp(-end) - error if end < ending else 0.0

    def above(end: float) -> float:
        slope = (lowered(end) - y) / (end - x)
        place = min(max(-math.log(-slope), x), end)
        return y + slope * (place - x) - math.exp(-place)

    if above(ending) <= error:
        return ending, 0.0
    near, far = x, ending
    while far - near > 1e-15 * far:
        middle = 0.5 * (near + far)
        near, far = (middle, far) if above(middle) <= error else (near, middle)
    return near, lowered(near)
