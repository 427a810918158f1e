"""Parameters over which orbits are followed, and the ranges in which they vary."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from wedgebrake.errors import InputError, nearest
from wedgebrake.model.machine import Machine
from wedgebrake.model.studies.sweep_settings import (
    dimension_of,
    refuse_doubled,
    sweepable,
)
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.model.validation import is_finite, is_number, shown, wrong
from wedgebrake.orbits.equations.machine_flow import check_resolution
from wedgebrake.orbits.problems.problem import OrbitProblem, sample_times

# Names of results in a dataset of orbits.
_TAKEN = ("angle", "velocity")
# Two numbers of samplings in a period with a smaller relative difference are equal up to rounding.
_SAME = 1e-9


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
        """The power of two nearest to the width: division by it is exact."""
        return float(2.0 ** round(math.log2(self.scale)))

    @property
    def bounds(self) -> tuple[float, float]:
        """(least, largest) value."""
        return min(self.first, self.last), max(self.first, self.last)

    def attributes(self) -> dict[str, str]:
        """Attributes of the coordinate of a dataset."""
        return {"units": self.unit, "long_name": self.meaning}


def make_ranges(
    system: BrakedDriveline | Machine, given: dict[str, Any], count: int
) -> list[Range]:
    """The ranges of ``count`` parameters, in the order given.

    Raises ``InputError`` for another number of them, an unknown name, a group beside the
    parameter that it sets, or ends that are not two different numbers that the system takes.
    """
    if len(given) != count:
        words = "one parameter with its ends" if count == 1 else "two parameters with their ends"
        more = ", F0=(0.01, 0.1)" if count > 1 else ""
        example = f"eta=(12, -60){more}"
        if "eta" not in followable(system):
            example = '{"brake.slope": (0.0, -60.0)}'
        raise InputError(
            f"{', '.join(given) or 'no parameter'}: must be {words}, for example {example}.",
            name="over" if count == 1 else "parameters", value=tuple(given), allowed=words,
        )  # fmt: skip
    ranges = [_range(system, name, ends) for name, ends in given.items()]
    for name in given:
        refuse_doubled(name, given)
    return ranges


def check_ranges(problem: OrbitProblem, ranges: Iterable[Range]) -> None:
    """Raise ``InputError`` for ranges over which orbits cannot be followed.

    These are ranges in which a signal of a self-excited system begins to vary, ranges of a lag that
    begin or end at zero, ranges that begin at a slope of zero if the actuator has a lag, ranges in
    which the number of samplings in a period changes, and all ranges if an actuation has a
    resolution, because an orbit ends or jumps where a sampled force reaches the next multiple of
    the resolution.
    """
    for contact in problem.base.machine.contacts:
        resolution = contact.actuation.resolution
        if resolution is not None:
            raise wrong(
                f"{contact.name}.resolution", resolution, "None to follow orbits over a parameter",
                "Rounding interrupts a branch wherever a sampled force reaches the next multiple of"
                " the resolution. Use wb.orbit at single values, or wb.bifurcation over the range.",
            )  # fmt: skip
    for one in ranges:
        if one.name.endswith(".lag") and min(map(abs, one.bounds)) == 0.0:
            raise wrong(
                one.name, (one.first, one.last), "a range of lags above 0",
                "The shorter the lag, the longer the computation; without a lag, there is no state."
                f" Begin or end at a small value instead of 0, such as {0.01 * one.scale:g}.",
            )  # fmt: skip
        ends = [problem.base.replace(**{one.name: end}) for end in (one.first, one.last)]
        if not all(map(problem.covers, ends)):
            raise wrong(
                one.name, (one.first, one.last),
                "a range that begins where the orbit has all its states",
                "At a slope of zero, for example, the state of the actuator's lag is none of them."
                f" Begin at a small value instead of 0, such as {1e-6 * one.scale:g}.",
            )  # fmt: skip
        check_samplings(problem, one)
        if problem.self_excited and not all(end.autonomous for end in ends):
            raise wrong(
                one.name, (one.first, one.last), "a range in which no signal varies in time",
                "The orbit is a limit cycle, which has no section at t = 0, T, 2 T, ... Begin with"
                " an orbit of the driven system.",
            )  # fmt: skip


def check_samplings(problem: OrbitProblem, one: Range) -> None:
    """Raise ``InputError`` for a range over which the number of samplings in a period changes.

    Raises it also for digital controllers that orbits do not accept.
    """
    check_resolution(problem.base.machine)
    ends = [problem.base.replace(**{one.name: end}) for end in (one.first, one.last)]
    counts = [
        [end.machine.period / step for step in sample_times(end).values()]
        for end in ends
        if end.machine.period
    ]
    if problem.samplings or len(counts) < 2:
        return
    if np.allclose(counts[0], counts[1], rtol=_SAME, atol=0.0):
        return
    name, step = next(iter(sample_times(ends[0]).items()))
    few, many = sorted((counts[0][0], counts[1][0]))
    raise wrong(
        one.name, (one.first, one.last),
        "a parameter without effect on the number of samplings in a period",
        f"Over this range a period of the signals has {few:g} to {many:g} samplings ({name} ="
        f" {step:g} s). Periodic orbits exist only where this number is whole, so that they form no"
        " curve. Use wb.response_curve(samplings=N), or wedgebrake response --samplings N, so that"
        " the sampling interval follows the period; or follow another parameter at values of"
        f" {one.name} where the number is whole; or simulate at any values with wb.sweep.",
    )  # fmt: skip


def followable(system: BrakedDriveline | Machine) -> dict[str, tuple[str, str]]:
    """Parameters over which orbits can be followed, with unit and meaning: no initial states."""
    initial = system.initial_conditions
    return {key: value for key, value in sweepable(system).items() if key not in initial}


def make_span(system: BrakedDriveline | Machine, name: str, values: list[float]) -> Range:
    """The range of several values of a parameter, from the least to the largest.

    Raises ``InputError`` for an unknown name, and a value that the system does not take.
    """
    about = _about(system, name, values)
    for value in values:
        system.replace(**{name: value})
    return Range(name, dimension_of(system, name, _TAKEN), min(values), max(values), *about)


def _about(system: BrakedDriveline | Machine, name: str, given: Any) -> tuple[str, str]:
    """Unit and meaning of a parameter; ``InputError`` if orbits cannot be followed over it."""
    allowed = followable(system)
    if name not in allowed:
        raise InputError(
            f"{shown(name) if not isinstance(name, str) else name}: orbits cannot be followed over"
            f" it. {nearest(str(name), allowed)}",
            name=str(name), value=given, allowed=tuple(allowed),
        )  # fmt: skip
    return allowed[name]


def _range(system: BrakedDriveline | Machine, name: str, ends: Any) -> Range:
    unit, meaning = _about(system, name, ends)
    pair = isinstance(ends, tuple | list) and len(ends) == 2
    if not pair or not all(is_number(end) and is_finite(end) for end in ends):
        raise wrong(
            name, ends, f"two numbers{'' if unit in ('1', '-') else f' in {unit}'}, the first and"
            f" the last value, for example {name}=(0.1, 1.0)",
        )  # fmt: skip
    first, last = (float(end) for end in ends)
    if first == last:
        raise wrong(name, ends, "two different numbers", "Change one of them.")
    for end in (first, last):
        system.replace(**{name: end})
    return Range(name, dimension_of(system, name, _TAKEN), first, last, unit, meaning)
