"""The range of a parameter that a branch is followed over, checked."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from wedgebrake.errors import InputError, nearest
from wedgebrake.model.groups import SETTERS
from wedgebrake.model.sweep_settings import INITIAL, refuse_doubled, sweepable
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.model.validation import is_finite, is_number, shown

# Names of what a dataset holds of an orbit.
TAKEN = ("angle", "velocity")


@dataclass(frozen=True)
class Range:
    """A parameter, where it begins, and where it is to go.

    dim           : its coordinate in a dataset: its name, but "brake_angle" for the angle of the
                    brake, since ``angle`` there is that of the driveline
    unit, meaning : for the coordinate of a dataset
    """

    name: str
    dim: str
    first: float
    last: float
    unit: str
    meaning: str

    @property
    def scale(self) -> float:
        """Its width."""
        return abs(self.last - self.first)

    @property
    def bounds(self) -> tuple[float, float]:
        """(least, greatest)."""
        return min(self.first, self.last), max(self.first, self.last)

    def attributes(self) -> dict[str, str]:
        """For the coordinate of a dataset."""
        return {"units": self.unit, "long_name": self.meaning}


def exact_scale(over: Range) -> float:
    """The power of two nearest to the width of a range: dividing by it rounds nothing."""
    return float(2.0 ** round(math.log2(over.scale)))


def make_ranges(system: BrakedDriveline, given: dict[str, Any], count: int) -> list[Range]:
    """The ranges of ``count`` parameters, in the order given.

    Raises ``InputError`` for another number of them, an unknown name, a group beside the
    parameter that it sets, or ends that are no two different numbers that the system takes.
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
    return Range(name, _dim(system, name), first, last, *allowed[name])


def _dim(system: BrakedDriveline, name: str) -> str:
    return f"{system.owner(name)}_{name}" if name in TAKEN else name


def value_of(system: BrakedDriveline, name: str) -> float:
    """The value of a parameter or group of a system."""
    if name in SETTERS:
        return float(getattr(system.groups, name))
    return float(getattr(getattr(system, system.owner(name)), name))
