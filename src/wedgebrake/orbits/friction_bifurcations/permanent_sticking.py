"""Onset of permanent sticking of a contact of a machine: its last slips vanish together.

There the contact holds all the time, and its torque just touches the limits of both directions.
The angle that it holds is thereby known; without slip, orbits with other angles near it exist too.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from wedgebrake.arrays import FloatArray
from wedgebrake.dynamics.enums import EventKind
from wedgebrake.orbits.bifurcation_types import Limit
from wedgebrake.orbits.curves import OrbitCurve, OrbitSolution, difference
from wedgebrake.orbits.equations.equations import NoOrbitError
from wedgebrake.orbits.equations.machine_flow import MachineFlow
from wedgebrake.orbits.friction_bifurcations.imposed_run import ImposedRun, Sides
from wedgebrake.orbits.palc import FAILED, NotConvergedError, least_norm
from wedgebrake.solvers.machine.events.modes import GuardKind
from wedgebrake.solvers.machine.passage import Crossing

# Newton's method: largest number of steps, its last one, and the relative size below which singular
# values are those of the angle that is held.
_MOST_STEPS, _CONVERGED, _RANK = 12, 1e-9, 1e-9
# Distance from 1 of the multiplier of a held angle.
_NEUTRAL = 1e-9
# Scaled distance of the onset from a point of the branch, and of the touches from the middle of the
# slips there, as a share of the period, within which it is that of these slips.
_NEAR, _BESIDE = 1e-3, 0.02


class _Touch(NamedTuple):
    """A limit of the holding torque that is touched, and the time since the return [s]."""

    limit: Limit
    time: float


def begins_to_hold(before: OrbitSolution, after: OrbitSolution) -> int | None:
    """The contact that slips on one orbit and holds on the next, at any angle; None if none does.

    Where nothing depends on the angle that a contact holds, such as that of a clutch, there is no
    multiplier 1.
    """
    for number, (old, new) in enumerate(zip(before.sides, after.sides, strict=True)):
        if new == (0,) != old and np.any(
            np.abs(np.asarray(after.floquet.multipliers) - 1.0) <= _NEUTRAL
        ):
            return number
    return None


def onset_in_machine(solution: OrbitSolution) -> tuple[int, float] | None:
    """The contact that stops slipping shortly after an orbit, and the parameter at which it does.

    None if there is none nearby, if no signal varies, or if other contacts come to rest or reverse.
    """
    problem = solution.problem
    if len(solution.values) != 1 or not problem.imposes:
        return None
    flow = solution.kernel_problem
    slipping = [k for k, sides in enumerate(solution.sides) if len(sides) > 1]
    if len(slipping) != 1 or isinstance(flow.section, Crossing):
        return None
    (number,) = slipping
    points = solution.equations.whole(solution.unknowns)[1].reshape(solution.order, -1)
    sides = tuple(0 if k == number else one[0] for k, one in enumerate(solution.sides))
    try:
        touches = sorted(_touches(flow, points[0], number), key=lambda one: one.time)
        if {one.limit.sign for one in touches} != {1, -1}:
            return None
        value = _Onset(solution, points.shape[1], sides, touches).value(points[0])
    except FAILED:
        return None
    return None if value is None else (number, value)


def _touches(flow: MachineFlow, point: FloatArray, number: int) -> Iterator[_Touch]:
    """The middle of the longest slip in each direction between two returns."""
    passage = flow.next_return(point, derivative=False)
    own = [
        one for one in passage.log
        if one["contact"] == number and one["kind"] != EventKind.BREAKPOINT
    ]  # fmt: skip
    slips: dict[int, tuple[float, float]] = {}
    for begin, end in zip(own, [*own[1:], *own[:1]], strict=True):
        length = float(end["time"] - begin["time"]) % flow.period
        if begin["before"] == 0 and length > slips.get(int(begin["after"]), (0.0, 0.0))[0]:
            middle = (float(begin["time"]) + 0.5 * length) % flow.period
            slips[int(begin["after"])] = length, middle
    for side, (_, time) in slips.items():
        yield _Touch(Limit(number, GuardKind.HOLDING_LIMIT, -side), time)


class _Onset:
    """Equations of the onset, in the point of the section, the times and the parameter."""

    def __init__(self, near: OrbitSolution, size: int, sides: Sides, touches: list[_Touch]) -> None:
        self._near, self._sides, self._touches = near, sides, touches
        curve = OrbitCurve(near)
        self._size = size
        scales = curve.scales[:size]
        times = np.full(len(touches), near.kernel_problem.period)
        self._scales = np.concatenate((scales, times, near.problem.scales))

    def value(self, point: FloatArray) -> float | None:
        """The parameter at the onset near a point; None if it is not near."""
        times = [one.time for one in self._touches]
        begin = np.concatenate((point, times, self._near.values)) / self._scales
        y = begin.copy()
        for _ in range(_MOST_STEPS):
            values, matrix = self._linearize(y)
            sizes = np.max(np.abs(matrix), axis=1)
            sizes[sizes == 0.0] = 1.0
            step = least_norm(matrix / sizes[:, None], -values / sizes, _RANK)
            y += step
            if np.linalg.norm(step) <= _CONVERGED:
                *beside, moved = np.abs(y - begin)[self._size :]
                near = moved <= _NEAR and max(beside) <= _BESIDE
                return float(y[-1] * self._scales[-1]) if near else None
        raise NotConvergedError

    def _linearize(self, y: FloatArray) -> tuple[FloatArray, FloatArray]:
        values, matrix = self._at(y)
        column = difference(lambda there: self._at(there)[0], y, y.size - 1, exact=True)
        return values, np.column_stack((matrix * self._scales[:-1], column))

    def _at(self, y: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Values, and their derivatives by point and times."""
        p, unknowns = self._size, y * self._scales
        point, times = unknowns[:p], unknowns[p:-1]
        run = ImposedRun(self._near.problem.kernel_problem((float(unknowns[-1]),)), point, p + 2)
        run.enter(self._sides)
        found = []
        for k, (touch, time) in enumerate(zip(self._touches, times, strict=True)):
            run.advance(float(time), p + k)
            row = run.row(touch.limit)
            if not np.all(np.isfinite(row)):  # locked, without a limit
                raise NoOrbitError
            found += [run.value(row, p + k), run.value(row, p + k, extreme=True)]
            run.enter(self._sides, p + k)
        run.advance(run.flow.period)
        end, derivative = run.end()
        derivative = derivative.copy()
        derivative[:, :p] -= np.eye(p)
        values = np.concatenate((end - point, [one.value for one in found]))
        return values, np.vstack((derivative, [one.derivative for one in found]))
