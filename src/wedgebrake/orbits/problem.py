"""The problem of continuation: a system, the parameters that vary, and their ranges."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from wedgebrake.errors import InputError, nearest
from wedgebrake.model.groups import SETTERS
from wedgebrake.model.sweep_settings import INITIAL, refuse_doubled, sweepable
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.model.validation import is_finite, is_number, shown
from wedgebrake.orbits.section import Section

# Differences and Newton's method ask for neighbours in a parameter again and again.
_REMEMBERED = 16
# Names of results in a dataset of orbits.
_TAKEN = ("angle", "velocity")


class OrbitProblem:
    """A system of which some parameters vary, and the solver for its orbits.

    names  : of the parameters, SI parameters or groups; none for the system alone
    scales : (n,) a considerable change of each
    method : "exact" or "smooth"
    rtol   : tolerance of "smooth"
    """

    def __init__(
        self,
        system: BrakedDriveline,
        names: tuple[str, ...] = (),
        scales: tuple[float, ...] = (),
        *,
        method: str,
        rtol: float,
    ) -> None:
        self.base, self.names, self.scales = system, names, scales
        self.method, self.rtol = method, rtol
        self._remembered: dict[tuple[float, ...], tuple[BrakedDriveline, Any]] = {}

    def system(self, values: tuple[float, ...]) -> BrakedDriveline:
        """The system with these values; raises ``InputError`` where there is none."""
        if not values:
            return self.base
        if values in self._remembered:
            return self._remembered[values][0]
        return self.base.replace(**dict(zip(self.names, map(float, values), strict=True)))

    def section(self, values: tuple[float, ...]) -> Section:
        """Section at which the orbits of the system with these values are sampled."""
        return Section.of(self.system(values))

    def kernel_problem(self, values: tuple[float, ...]) -> Any:
        """The system as the kernels take it; raises ``InputError`` where there is none."""
        if values not in self._remembered:
            if len(self._remembered) >= _REMEMBERED:
                del self._remembered[next(iter(self._remembered))]
            system = self.system(values)
            self._remembered[values] = system, self._assemble(system)
        return self._remembered[values][1]

    def _assemble(self, system: BrakedDriveline) -> Any:
        if self.method == "exact":
            from wedgebrake.solvers.event_driven.solve import problem

            return problem(system)
        from wedgebrake.solvers.smooth.assemble import problem as smooth_problem

        return smooth_problem(system, self.rtol, any_law=True)


@dataclass(frozen=True)
class Range:
    """A parameter and the two ends between which it varies.

    dim           : name of its coordinate in a dataset: that of the parameter, but "brake_angle"
                    for the angle of the brake, since ``angle`` there is that of the driveline
    unit, meaning : attributes of that coordinate
    """

    name: str
    dim: str
    first: float
    last: float
    unit: str
    meaning: str

    @property
    def scale(self) -> float:
        """Width of the range."""
        return abs(self.last - self.first)

    @property
    def exact_scale(self) -> float:
        """The power of two nearest to the width: dividing by it rounds nothing."""
        return float(2.0 ** round(math.log2(self.scale)))

    @property
    def bounds(self) -> tuple[float, float]:
        """(least, greatest) value."""
        return min(self.first, self.last), max(self.first, self.last)

    def attributes(self) -> dict[str, str]:
        """Attributes of the coordinate of a dataset."""
        return {"units": self.unit, "long_name": self.meaning}


def make_ranges(system: BrakedDriveline, given: dict[str, Any], count: int) -> list[Range]:
    """The ranges of ``count`` parameters, in the order given.

    Raises ``InputError`` for another number of them, an unknown name, a group beside the
    parameter that it sets, or ends that are not two different numbers that the system takes.
    """
    words, example = {
        1: ("one parameter with its ends", "eta=(12, -60)"),
        2: ("two parameters with their ends", "eta=(12, -60), F0=(0.01, 0.1)"),
    }[count]
    if len(given) != count:
        raise InputError(
            f"{', '.join(given) or 'no parameter'}: must be {words}, for example {example}."
        )
    ranges = [_range(system, name, ends) for name, ends in given.items()]
    for name in given:
        refuse_doubled(name, given)
    return ranges


def _range(system: BrakedDriveline, name: str, ends: Any) -> Range:
    allowed = {key: value for key, value in sweepable(system).items() if key not in INITIAL}
    if name not in allowed:
        raise InputError(f"{name}: no parameter to follow orbits over. {nearest(name, allowed)}")
    pair = isinstance(ends, tuple | list) and len(ends) == 2
    if not pair or not all(is_number(end) and is_finite(end) for end in ends):
        raise InputError(
            f"{name} = {shown(ends)}: must be two numbers, from where to where, for example"
            f" {name}=(0.1, 1.0)."
        )
    first, last = (float(end) for end in ends)
    if first == last:
        raise InputError(f"{name} = {shown(ends)}: the ends are equal. Change one of them.")
    for end in (first, last):
        system.replace(**{name: end})
    dim = f"{system.owner(name)}_{name}" if name in _TAKEN else name
    return Range(name, dim, first, last, *allowed[name])


def value_of(system: BrakedDriveline, name: str) -> float:
    """Value of a parameter or group of a system."""
    if name in SETTERS:
        return float(getattr(system.groups, name))
    return float(getattr(getattr(system, system.owner(name)), name))
