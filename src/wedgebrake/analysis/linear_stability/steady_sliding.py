"""``steady_sliding``: the speeds at which the torques on a machine are in balance.

In steady sliding no shaft with stiffness winds up. With one free rotation f the speeds are w + s f,
where driven bodies carry others along at the speeds w, and the balance is one equation
f'(torques - dampers - contacts) = 0 for s.

A controller with an integral part is at rest where its error is 0, with any output between its
limits, or at a limit, where the error has one sign.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from wedgebrake.analysis.linear_stability.controllers import (
    command_loads,
    commanded_actuation,
    steady_torque,
    torque_loads,
)
from wedgebrake.analysis.linear_stability.linear_system import carried_speeds, free_rotations
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
from wedgebrake.model.controller import COMMAND, Controller
from wedgebrake.model.elements import elements, with_fixed_scales
from wedgebrake.model.machine import WITH_SPEEDS, Machine, check_without
from wedgebrake.model.machine_matrices import contact_rows, shaft_matrices
from wedgebrake.model.machine_parts import OverAngle, Torque
from wedgebrake.model.validation import check_instance, wrong

# Distances from the speeds at which a contact stands, relative to the typical speed, at which the
# balance is evaluated: powers of ten, and values per decade.
_NEAREST, _FURTHEST, _DENSITY = -9, 6, 8
# Relative tolerances of the speeds: rounding.
_XTOL, _RTOL = 1e-18, 1e-15
# Relative size below which a difference of terms is rounding.
_EQUAL = 1e-12
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

    machine  : its signals are taken at time 0, or at the first time at which they are known; its
               controllers measure speeds
    sticking : names of contacts that stick, as for ``wb.stability``
    method   : which friction applies where it varies with the speed: the curve or the straight
               lines, as for ``wb.stability``

    Returns the solutions in ascending order of the speed of the first inertia, then of the second,
    and so on; each is a mapping from the names of the inertias to their speeds [rad/s], which
    ``wb.stability`` accepts. Empty if there is no solution.
    States in which a contact that is not in ``sticking`` is at rest are left out, except where
    nothing can turn.

    Raises ``InputError`` for a machine that turns steadily at every speed, and for several free
    rotations unless clutches and dampers couple each of them to the same one and to no other, and
    there are no controllers.
    """
    check_instance("machine", machine, Machine, "a Machine; of a BrakedDriveline use its .machine")
    for loop in machine.controllers:
        _check_balanced(loop)
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
    free, carried = free_rotations(machine, sticks), carried_speeds(machine, sticks)
    if carried is None:
        return ()
    if free.shape[1] > 1:
        check_without(
            machine, "controllers", "the balance of several free rotations",
            "Name contacts that stick: sticking=(...), or give the speeds of the inertias.",
        )  # fmt: skip
        for torque in machine.torques:
            if torque.over_time is None:
                raise wrong(
                    f"{torque.name}.signal", torque.signal,
                    "over time for the balance of several free rotations",
                    "Name contacts that stick: sticking=(...), or give the speeds of the inertias.",
                )  # fmt: skip
        several = balanced_speeds(machine, free, carried, sticks, check_method(method))
        return tuple(dict(zip(names, one, strict=True)) for one in several)
    if free.shape[1] == 0:
        found = (
            [carried]
            if all(_is_steady(one, machine, carried) for one in machine.controllers)
            else []
        )
    else:
        # The largest entry is 1: of the inertias that turn alike, s is their speed.
        along = free[:, 0] / free[np.argmax(np.abs(free[:, 0])), 0]
        line = _Line(along, carried, sticks, check_method(method))
        found = [carried + along * one for one in line.speeds(machine)]
    return tuple(dict(zip(names, (one + 0.0).tolist(), strict=True)) for one in found)


def _check_balanced(loop: Controller) -> None:
    """Raise ``InputError`` for a controller whose steady output does not follow from speeds."""
    for name, factor in loop.measured.items():
        if not name.endswith(".speed"):
            raise wrong(
                f"{loop.name}.measured.{name}", factor, "a speed for the balance of torques",
                WITH_SPEEDS,
            )  # fmt: skip
    if loop.resolution:
        raise wrong(
            f"{loop.name}.resolution", loop.resolution, "left out for the balance of torques",
            WITH_SPEEDS,
        )  # fmt: skip


def _error(loop: Controller, machine: Machine, speeds: FloatArray) -> float:
    """Error of a controller at constant speeds, 0 where it is rounding."""
    terms = [frozen(loop.setpoint)]
    for name, factor in loop.measured.items():
        terms.append(-factor * float(speeds[machine.index(name.rpartition(".")[0])]))
    return sum(terms) if abs(sum(terms)) > _EQUAL * sum(map(abs, terms)) else 0.0


def _is_steady(loop: Controller, machine: Machine, speeds: FloatArray) -> bool:
    """Whether the output of a controller does not change at constant speeds."""
    return not loop.integral or loop.limits is not None or _error(loop, machine, speeds) == 0.0


def _with_output(machine: Machine, loop: Controller, output: float) -> Machine:
    """The machine with a constant output in place of a controller."""
    others = tuple(one for one in machine.controllers if one is not loop)
    part, what = loop.acts_on
    if what != COMMAND:
        torque = Torque(part, output, name=loop.name)
        changes: dict[str, Any] = {"torques": (*machine.torques, torque)}
    else:
        contacts = list(machine.contacts)
        number = machine.contact_names.index(part)
        given = contacts[number].actuation
        force = frozen(given.initial_force) + output
        actuation = given.model_copy(update={"initial_force": force})
        contacts[number] = contacts[number].model_copy(update={"actuation": actuation})
        changes = {"contacts": tuple(contacts)}
    return machine.model_copy(update={"controllers": others, **changes})


class _Line(NamedTuple):
    """The motions of one free rotation: speeds ``carried`` + s ``along`` of the inertias, (n,)."""

    along: FloatArray
    carried: FloatArray
    sticking: Sequence[str]
    method: Method

    def speeds(self, machine: Machine) -> list[float]:
        """The values of s at which the torques are in balance, in ascending order."""
        integral = [one for one in machine.controllers if one.integral]
        if not integral:
            balance = _Balance(with_fixed_scales(machine, frozen), *self)
            if balance.neutral:
                raise wrong(
                    "machine", machine, "a machine with isolated steady sliding",
                    "Its torques are in balance at every speed. Give the speeds of its inertias.",
                )  # fmt: skip
            return balance.roots()
        if len(integral) > 1:
            raise wrong(
                f"{integral[1].name}.integral", integral[1].integral,
                "0 for the balance of torques, as another controller has an integral part",
                WITH_SPEEDS,
            )  # fmt: skip
        (loop,) = integral
        found = self._without_error(machine, loop)
        for side, limit in zip((-1.0, 1.0), loop.limits or (), strict=False):
            for speed in self.speeds(_with_output(machine, loop, limit)):
                error = _error(loop, machine, self.carried + speed * self.along)
                if side * loop.integral * error > 0.0:
                    found.append(speed)
        return sorted(found)

    def _without_error(self, machine: Machine, loop: Controller) -> list[float]:
        """The speed at which the error of a controller is 0, if it can balance the torques."""
        start = _error(loop, machine, self.carried)
        rate = sum(
            factor * float(self.along[machine.index(name.rpartition(".")[0])])
            for name, factor in loop.measured.items()
        )
        if rate == 0.0:
            if start == 0.0:
                raise wrong(
                    loop.name, loop, "a controller whose error depends on the speed that it"
                    " controls, for the balance of torques", WITH_SPEEDS,
                )  # fmt: skip
            return []
        speed = start / rate
        output = self._needed(machine, loop, speed)
        low, high = loop.limits or (-math.inf, math.inf)
        return [speed] if low <= output <= high else []

    def _needed(self, machine: Machine, loop: Controller, speed: float) -> float:
        """The output of a controller that balances the torques at a speed; nan if none does."""
        part, what = loop.acts_on
        outputs, low, high = [0.0, 1.0], -math.inf, math.inf
        if what == COMMAND:
            # The outputs with which the force is 0 and 1, and those at its limits.
            number = machine.contact_names.index(part)
            contact, at = machine.contacts[number], self.carried + speed * self.along
            sliding = float(contact_rows(machine)[number] @ at) - frozen(contact.base_speed)
            without, _ = commanded_actuation(_with_output(machine, loop, 0.0), number, sliding, at)
            given = without.contacts[number].actuation
            force = frozen(given.initial_force) + given.slope * abs(sliding)
            low, high = (one - force for one in given.limits or (-math.inf, math.inf))
            low = max(low, -force) if given.release else low
            outputs = [one - force for one in outputs]
            free = contact.model_copy(
                update={"actuation": contact.actuation.model_copy(update={"limits": None})}
            )
            contacts = tuple(free if one is contact else one for one in machine.contacts)
            machine = machine.model_copy(update={"contacts": contacts})
        balance = [
            _Balance(with_fixed_scales(_with_output(machine, loop, one), frozen), *self)(speed)
            for one in outputs
        ]
        share = balance[1] - balance[0]
        output = outputs[0] - balance[0] / share if share else math.nan
        return output if low <= output <= high else math.nan


class _Balance:
    """The torque along a free rotation, as a function of its speed.

    along   : (n,) speeds of the inertias, as multiples of that of the rotation
    carried : (n,) speeds to which these are added
    """

    def __init__(
        self, machine: Machine, along: FloatArray, carried: FloatArray, sticking: Sequence[str],
        method: Method,
    ) -> None:  # fmt: skip
        self._method = method
        rows = contact_rows(machine)
        factors = rows @ along
        factors[np.abs(factors) <= _EQUAL * (np.abs(rows) @ np.abs(along))] = 0.0  # rounding
        self._contacts = [
            (number, factor, frozen(machine.contacts[number].base_speed) - float(row @ carried))
            for number, (factor, row) in enumerate(zip(factors.tolist(), rows, strict=True))
            if machine.contacts[number].name not in sticking and factor != 0.0
        ]
        self._machine = machine
        self._drive = sum(
            float(along[machine.index(one.on)]) * frozen(one.over_time)
            for one in machine.torques
            if one.over_time is not None
        )
        damping = shaft_matrices(machine)[1]
        self._drive -= float(along @ damping @ carried)
        self._along, self._carried = along, carried
        self._loads = torque_loads(machine)
        self._curves = [one for one in elements(machine) if one.of_speed and one.load @ along]
        self._damping = float(along @ damping @ along)
        # Speeds of the rotation at which a contact stands, and at which a curve bends.
        stands = {base / factor for _, factor, base in self._contacts}
        self._corners = [
            (one - float(curve.row @ carried)) / float(curve.row @ along)
            for curve in self._curves
            if curve.row @ along
            for one in curve.law.corners
        ]
        for loop in machine.controllers:
            self._corners += self._bends(loop)
        self._ends = sorted(stands)
        speeds = [abs(frozen(one.speed)) for one in machine.inertias]
        self._typical = max([1.0, *speeds, *map(abs, self._ends), *map(abs, self._corners)])

    def _bends(self, loop: Controller) -> Iterator[float]:
        """Speeds of the rotation at which the output of a controller is 0 or reaches a limit."""
        start = _error(loop, self._machine, self._carried)
        rate = start - _error(loop, self._machine, self._carried + self._along)
        if rate != 0.0 and loop.proportional != 0.0:
            for output in (0.0, *(loop.limits or ())):
                yield (start - output / loop.proportional) / rate

    @property
    def neutral(self) -> bool:
        """True if nothing acts on the rotation: any speed is steady."""
        given = [self._machine.contacts[number] for number, _, _ in self._contacts]
        acts = any(
            linearised(contact, 0.0, 1, self._method).force != 0.0 or contact.actuation.slope != 0.0
            for contact in given
        )
        drives = self._drive != 0.0 or bool(self._curves) or bool(self._machine.controllers)
        return not drives and self._damping == 0.0 and not acts

    def __call__(self, speed: float) -> float:
        """Torque along the rotation [N m]; -inf or inf where a brake locks itself."""
        total = self._drive - self._damping * speed
        at = self._carried + self._along * speed
        for one in self._curves:
            total += float(one.load @ self._along) * float(one.torque(0.0 * at, at))
        for number, inertia in self._loads:
            output = steady_torque(self._machine.controllers[number], self._machine, at)
            total += float(self._along[inertia]) * output
        for number, factor, base in self._contacts:
            sliding = factor * speed - base
            if sliding == 0.0:
                continue
            contact = self._machine.contacts[number]
            if command_loads(self._machine, contact.name):
                commanded, _ = commanded_actuation(self._machine, number, sliding, at)
                contact = commanded.contacts[number]
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
