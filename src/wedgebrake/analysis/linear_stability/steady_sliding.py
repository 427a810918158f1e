"""``steady_sliding``: the speeds at which the torques on a machine are in balance.

In steady sliding no shaft with stiffness winds up. With one free rotation f the speeds are a
multiple s of it, and the balance is one equation f'(torques - dampers - contacts) = 0 for s.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from wedgebrake.analysis.linear_stability.linear_system import free_rotations
from wedgebrake.analysis.linear_stability.machine_stability import check_sticking
from wedgebrake.analysis.linear_stability.several_rotations import balanced_speeds
from wedgebrake.analysis.linear_stability.sliding_contact import (
    CURVE,
    Method,
    check_method,
    frozen,
    linearised,
)
from wedgebrake.arrays import FloatArray
from wedgebrake.model.elements import elements, with_fixed_scales
from wedgebrake.model.machine import WITH_SPEEDS, Machine, check_without
from wedgebrake.model.machine_matrices import contact_rows, shaft_matrices
from wedgebrake.model.machine_parts import OverAngle
from wedgebrake.model.validation import check_instance, wrong

# Distances from the speeds at which a contact stands, relative to the typical speed, at which the
# balance is evaluated: powers of ten, and values per decade.
_NEAREST, _FURTHEST, _DENSITY = -9, 6, 8
# Relative tolerances of the speeds: rounding.
_XTOL, _RTOL = 1e-18, 1e-15
# Tolerance of the place of an extreme of the balance, relative to the interval around it.
_EXTREME = 1e-10


def steady_sliding(
    machine: Machine, sticking: Sequence[str] | None = None, method: Method = CURVE
) -> tuple[dict[str, float], ...]:
    """The steady sliding of a machine, by the balance of torques.

    All inertias turn at constant speeds, no shaft with stiffness winds up, and the torques, the
    dampers and the friction of the contacts balance each other. With friction that falls with speed
    there can be several solutions, some of them unstable: see ``wb.stability(machine, solution)``.
    If shafts hold all inertias, all speeds are 0.

    machine  : its signals are taken at time 0, or at the first time at which they are known
    sticking : names of contacts that stick, as for ``wb.stability``
    method   : which friction applies where it varies with the speed: the curve or the straight
               lines, as for ``wb.stability``

    Returns the solutions in ascending order of the speed of the first inertia, then of the second,
    and so on; each is a mapping from the names of the inertias to their speeds [rad/s], which
    ``wb.stability`` accepts. Empty if there is no solution.
    States in which a contact that is not in ``sticking`` is at rest are left out, except where
    nothing can turn.

    Raises ``InputError`` for a machine that turns steadily at every speed, and for several free
    rotations unless clutches and dampers couple each of them to the same one and to no other.
    """
    check_instance("machine", machine, Machine, "a Machine; of a BrakedDriveline use its .machine")
    check_without(machine, "driven", "the balance of torques")
    check_without(machine, "controllers", "the balance of torques", WITH_SPEEDS)
    for one in machine.contacts:
        if one.normal:
            raise wrong(
                f"{one.name}.normal", dict(one.normal), "left out for the balance of torques",
                "Give the speeds of the inertias to wb.stability.",
            )  # fmt: skip
    for torque in machine.torques:
        if isinstance(torque.signal, OverAngle):
            raise wrong(
                f"{torque.name}.signal", torque.signal,
                "over time or over a speed for the balance of torques",
                "Give the speeds of the inertias to wb.stability.",
            )  # fmt: skip
    sticks = () if sticking is None else check_sticking(machine, sticking)
    names = [one.name for one in machine.inertias]
    free = free_rotations(machine, sticks)
    if free.shape[1] > 1:
        for torque in machine.torques:
            if torque.over_time is None:
                raise wrong(
                    f"{torque.name}.signal", torque.signal,
                    "over time for the balance of several free rotations",
                    "Name contacts that stick: sticking=(...), or give the speeds of the inertias.",
                )  # fmt: skip
        several = balanced_speeds(machine, free, sticks, check_method(method))
        return tuple(dict(zip(names, one, strict=True)) for one in several)
    if free.shape[1] == 0:
        return (dict.fromkeys(names, 0.0),)
    # The largest entry is 1: of the inertias that turn alike, s is their speed.
    along = free[:, 0] / free[np.argmax(np.abs(free[:, 0])), 0]
    fixed = with_fixed_scales(machine, frozen)
    balance = _Balance(fixed, along, sticks, check_method(method))
    if balance.neutral:
        raise wrong(
            "machine", machine, "a machine with isolated steady sliding",
            "Its torques are in balance at every speed. Give the speeds of its inertias.",
        )  # fmt: skip
    return tuple(
        dict(zip(names, (along * speed + 0.0).tolist(), strict=True)) for speed in balance.roots()
    )


class _Balance:
    """The torque along a free rotation, as a function of its speed.

    along : (n,) speeds of the inertias, as multiples of that of the rotation
    """

    def __init__(
        self, machine: Machine, along: FloatArray, sticking: Sequence[str], method: Method
    ) -> None:
        self._method = method
        self._contacts = [
            (contact, factor, frozen(contact.base_speed))
            for contact, factor in zip(
                machine.contacts, (contact_rows(machine) @ along).tolist(), strict=True
            )
            if contact.name not in sticking and factor != 0.0
        ]
        self._machine = machine
        self._drive = sum(
            float(along[machine.index(one.on)]) * frozen(one.over_time)
            for one in machine.torques
            if one.over_time is not None
        )
        self._along = along
        self._curves = [one for one in elements(machine) if one.of_speed and one.load @ along]
        self._damping = float(along @ shaft_matrices(machine)[1] @ along)
        # Speeds of the rotation at which a contact stands, and at which a curve bends.
        stands = {base / factor for _, factor, base in self._contacts}
        rows = [(float(one.row @ along), one.law.corners) for one in self._curves]
        self._corners = [one / row for row, corners in rows if row for one in corners]
        self._ends = sorted(stands)
        speeds = [abs(frozen(one.speed)) for one in machine.inertias]
        self._typical = max([1.0, *speeds, *map(abs, self._ends), *map(abs, self._corners)])

    @property
    def neutral(self) -> bool:
        """True if nothing acts on the rotation: any speed is steady."""
        acts = any(
            linearised(contact, 0.0, 1, self._method).force != 0.0 or contact.actuation.slope != 0.0
            for contact, _, _ in self._contacts
        )
        drives = self._drive != 0.0 or bool(self._curves)
        return not drives and self._damping == 0.0 and not acts

    def __call__(self, speed: float) -> float:
        """Torque along the rotation [N m]; -inf or inf where a brake locks itself."""
        total = self._drive - self._damping * speed
        at = self._along * speed
        for one in self._curves:
            total += float(one.load @ self._along) * float(one.torque(0.0 * at, at))
        for contact, factor, base in self._contacts:
            sliding = factor * speed - base
            if sliding == 0.0:
                continue
            linear = linearised(contact, abs(sliding), 1 if sliding > 0.0 else -1, self._method)
            if linear.locked:
                return -math.copysign(math.inf, sliding * factor)
            total -= factor * linear.gain * linear.force
        return total

    def roots(self) -> list[float]:
        """Speeds at which the torque vanishes, in ascending order."""
        from scipy.optimize import brentq

        found: list[float] = []
        for points in self._intervals():
            cells = sorted([*points, *self._extremes(points)])
            values = [self(one) for one in cells]
            found += [one for one, value in zip(cells, values, strict=True) if value == 0.0]
            for (low, high), (first, last) in zip(pairwise(cells), pairwise(values), strict=True):
                if np.isfinite([first, last]).all() and first * last < 0.0:
                    root = brentq(self, low, high, xtol=_XTOL * self._typical, rtol=_RTOL)
                    found.append(float(root))
        return sorted(found)

    def _extremes(self, points: list[float]) -> list[float]:
        """Places of maxima below zero and minima above it, which may reach across."""
        from scipy.optimize import minimize_scalar

        found = []
        values = np.array([self(one) for one in points])
        for number in range(1, len(points) - 1):
            near, side = values[number - 1 : number + 2], np.sign(values[number])
            if not np.isfinite(near).all() or np.any(side * near < side * near[1]) or not side:
                continue
            if np.any(np.sign(near) != side):
                continue
            first, last = points[number - 1], points[number + 1]
            best = minimize_scalar(
                lambda at, side=side: side * self(at), bounds=(first, last), method="bounded",
                options={"xatol": _EXTREME * (last - first)},
            )  # fmt: skip
            found.append(float(best.x))
        return found

    def _intervals(self) -> list[list[float]]:
        """Points of the intervals between speeds at which a contact stands, ascending."""
        count = _DENSITY * (_FURTHEST - _NEAREST) + 1
        away = self._typical * np.logspace(_NEAREST, _FURTHEST, count)
        about = np.array(self._ends or [0.0])[:, None]
        near = np.concatenate([about - away, about + away, about * 0.0], axis=1)
        points = np.unique([*near.ravel(), *self._corners])
        edges = [-np.inf, *self._ends, np.inf]
        return [points[(points > low) & (points < high)].tolist() for low, high in pairwise(edges)]
