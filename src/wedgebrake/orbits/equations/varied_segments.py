"""Derivatives of the numbers in the equations of an orbit of segments, for given parameters."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np

from wedgebrake.arrays import FloatArray
from wedgebrake.dynamics.harmonic import Sine
from wedgebrake.dynamics.linear_flow import PIECE, LinearDriveline
from wedgebrake.dynamics.problem import PiecewiseLinearBrake, Problem
from wedgebrake.errors import InputError
from wedgebrake.solvers.machine.tangents import QUICK, Parameter, difference_of

_FIELDS = ("damping", "stiffness", "constant")


class VariedSegments(NamedTuple):
    """A problem, and the derivatives of its numbers with respect to each parameter."""

    problem: Problem
    changes: tuple[Problem, ...]

    @classmethod
    def of(
        cls, problem: Problem, values: Mapping[str, float], at: Callable[[str, float], Problem]
    ) -> VariedSegments | None:
        """A problem and its derivatives; None where pieces of the brake's law begin or end.

        values : values of the parameters by name
        at     : the problem as a function of the name and the value of a parameter
        """
        found = []
        for name, given in values.items():

            def numbers(near: float, name: str = name) -> FloatArray:
                return _numbers(at(name, near), problem)

            try:
                changes = difference_of(Parameter(name, given, differences=QUICK), numbers)
            except InputError:
                return None
            found.append(_with_numbers(problem, changes))
        return cls(problem, tuple(found))


def _numbers(problem: Problem, like: Problem) -> FloatArray:
    """The numbers of a problem in one array.

    Raises ``InputError`` if its pieces are not those of the problem ``like``.
    """
    driveline, torque, brake, _ = problem
    if brake.pieces.size != like.brake.pieces.size or not np.array_equal(
        np.isinf(brake.pieces["offset"]), np.isinf(like.brake.pieces["offset"])
    ):
        raise InputError("the brake's law has other pieces")
    each = [brake.pieces[name] for name in _FIELDS]
    return np.concatenate([driveline, torque, (brake.lower, brake.upper), brake.breakpoints, *each])


def _with_numbers(problem: Problem, numbers: FloatArray) -> Problem:
    """A problem with other numbers, such as derivatives of its own."""
    driveline, torque, (lower, upper), rest = np.split(numbers, np.cumsum([4, 2, 2]))
    count = problem.brake.pieces.size
    breakpoints, *each = np.split(rest, count - 1 + count * np.arange(3))
    pieces = np.zeros(count, PIECE)
    for name, one in zip(_FIELDS, each, strict=True):
        pieces[name] = one
    brake = PiecewiseLinearBrake(
        breakpoints, pieces, problem.brake.first_forward, float(lower), float(upper)
    )
    return Problem(LinearDriveline(*driveline), Sine(*torque), brake, 0.0)
