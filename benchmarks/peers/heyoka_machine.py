"""heyoka on machines: Taylor series with terminal events, for Coulomb friction.

One integrator is compiled for each set of contacts that hold, at its first use. The numbers of the
machine are constants in it; the sides of sliding and the lines of tables are parameters. Python
code decides which contacts hold after an event: it tries patterns of sticks and slips, sticks
first.
"""

import math
import time
from collections import deque
from collections.abc import Mapping
from functools import cache
from itertools import pairwise, product
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

import wedgebrake as wb
from peers.machine import Line, Machine
from peers.peer import absent

COOLDOWN = 1e-7
ROUNDING = 1e-11  # relative size of torques that are rounding
KNOT, SAMPLE, END = range(3)


class Motion(NamedTuple):
    """Result of a run.

    state   : at the end, angles and then speeds
    events  : (time, contact, side); the side is 0 if the contact holds
    seconds : time taken
    inside  : its part in the compiled integrators [s]
    """

    state: np.ndarray
    events: list[tuple[float, int, int]]
    seconds: float
    inside: float


@cache
def patterns(count: int) -> list[tuple[int, ...]]:
    """Sides of contacts at rest, from all that hold to all that slip."""
    return sorted(product((0, 1, -1), repeat=count), key=lambda sides: sum(map(abs, sides)))


class Model:
    """A machine with everything that does not depend on its motion: integrators and schedule."""

    def __init__(self, machine: wb.Machine, until: float, tolerance: float = 1e-15) -> None:
        self.machine, self.tolerance = Machine.of(machine), tolerance
        self.schedule = schedule(self.machine, until)
        rows, rates = self.machine.rows, self.machine.rows / self.machine.inertia
        # Changes of the rates of the sliding speeds by torques of contacts, and by other torques.
        self.compliance = (rates @ rows.T).tolist()
        self.pushes = [(signal, rates[:, on].tolist()) for on, signal in self.machine.torques]
        # From the state to the sliding speeds, and to their rates by shafts.
        shafts = np.hstack([self.machine.stiffness, self.machine.damping])
        self.speeds = np.hstack([0.0 * rows, rows])
        self.seen = np.vstack([self.speeds, -rates @ shafts])
        self.inverse = cache(self._inverse)
        self.integrator = cache(self._integrator)

    def missing(self) -> str:
        """Why it cannot run here; "" if it can."""
        return absent("heyoka")

    def run(self) -> Motion:
        """The motion from the start."""
        begin = time.perf_counter()
        run = Run(self)
        run.follow()
        return Motion(run.ta.state.copy(), run.events, time.perf_counter() - begin, run.inside)

    def _inverse(self, held: tuple[int, ...]) -> list[list[float]]:
        """Matrix from the rates of contacts to the torques that hold them."""
        return np.linalg.inv(np.array(self.compliance)[np.ix_(held, held)]).tolist()

    def _integrator(self, held: tuple[int, ...]) -> tuple[Any, list[tuple[str, int, int]]]:
        """An integrator for a set of contacts that hold, and the meaning of its events."""
        import heyoka as hy

        machine = self.machine
        count, first = machine.inertia.size, 4 * len(machine.contacts)
        state = np.array(hy.make_vars(*(f"{name}{i}" for name in "qw" for i in range(count))))
        par = [hy.par[i] for i in range(first + 3 * len(machine.tables))]
        now = (hy.time, hy.sin, [par[i : i + 3] for i in range(first, len(par), 3)])
        total = -(machine.stiffness @ state[:count]) - machine.damping @ state[count:]
        for on, signal in machine.torques:
            total[on] += signal(*now)
        conditions = {}
        for i, (row, one) in enumerate(zip(machine.rows, machine.contacts, strict=True)):
            if i not in held:
                by_force, by_speed, side, engaged = par[4 * i : 4 * i + 4]
                speed, force = row @ state[count:], one.force(*now)
                total -= row * (by_force * force + by_speed * speed)
                conditions["arrive", i, 0] = side * speed
                if one.slope != 0.0:
                    conditions["release", i, 0] = (
                        engaged * (force + one.slope * side * speed) / one.size
                    )
        rates = machine.rows @ (total / machine.inertia)
        for row, i in zip(self.inverse(held), held, strict=True):
            torque = np.dot(row, rates[list(held)])
            total -= machine.rows[i] * torque
            one = machine.contacts[i]
            for side, peak in one.peak.items():
                # heyoka chooses its steps by the sizes of these functions too: about 1.
                conditions["limit", i, side] = (one.force(*now) - torque / peak) / one.size
        falling = hy.event_direction.negative
        events = [
            hy.t_event(one, direction=falling, cooldown=COOLDOWN) for one in conditions.values()
        ]
        rates = [*state[count:], *(total / machine.inertia)]
        equations = list(zip(state, rates, strict=True))
        start = [0.0] * state.size
        integrator = hy.taylor_adaptive(equations, start, t_events=events, tol=self.tolerance)
        return integrator, list(conditions)


class Run:
    """A run in progress.

    sides : of sliding, 0 where a contact holds
    pars  : parameters of the integrators: four of each contact, then the lines of the tables
    left  : time at which each contact took its present side
    """

    def __init__(self, model: Model) -> None:
        machine = self.machine = model.machine
        self.model = model
        self.lines: list[Line] = [table[0] for table in machine.tables]
        self.sides = [1] * len(machine.contacts)
        self.left = [-math.inf] * len(machine.contacts)
        self.pars = [0.0] * (4 * len(machine.contacts)) + [x for line in self.lines for x in line]
        self.queues = [
            deque([machine.contacts[i].size] * (law.delay + 1), law.delay + 1)
            for i, _, law in machine.controllers
        ]
        self.events: list[tuple[float, int, int]] = []
        self.inside = 0.0
        self.ta, self.meaning = model.integrator(())
        self.ta.time, self.ta.state[:] = 0.0, machine.start

    def follow(self) -> None:
        """Run to the end of the schedule."""
        import heyoka as hy

        time_limit = hy.taylor_outcome.time_limit
        speeds = (self.model.speeds @ self.ta.state).tolist()
        for i, (one, speed) in enumerate(zip(self.machine.contacts, speeds, strict=True)):
            self.sides[i] = 1 if speed >= 0.0 else -1
            force = one.force(0.0, math.sin, self.lines) + one.slope * abs(speed)
            self.engage(i, force >= 0.0)
        for number in range(len(self.queues)):
            self.sample(number)
        self.settle([i for i, speed in enumerate(speeds) if speed == 0.0])
        for when, kind, number, line, jump in self.model.schedule:
            while True:
                begin = time.perf_counter()
                outcome = self.ta.propagate_until(when)[0]
                self.inside += time.perf_counter() - begin
                if outcome == time_limit:
                    break
                self.handle(*self.meaning[-int(outcome) - 1])
            if kind == END:
                break
            if kind == SAMPLE:
                jump, number = self.sample(number), self.machine.controllers[number][1]
            else:
                self.lines[number] = line
            first = 4 * len(self.sides) + 3 * number
            self.pars[first : first + 3] = self.ta.pars[first : first + 3] = self.lines[number]
            if jump and 0 in self.sides:
                self.settle([i for i, side in enumerate(self.sides) if side == 0])

    def handle(self, what: str, i: int, side: int) -> None:
        """Apply an event of a contact."""
        if what == "release":
            self.engage(i, self.pars[4 * i + 3] < 0.0)
            self.ta.pars[:] = self.pars[: self.ta.pars.size]
        elif what == "limit" or self.ta.time > self.left[i] + COOLDOWN:
            resting = [k for k, one in enumerate(self.sides) if one == 0 or k == i]
            self.settle(resting, {i: side} if what == "limit" else {})

    def engage(self, i: int, engaged: bool) -> None:
        """Set the parameters of a contact: torque over force and over speed, side, engaged."""
        one, side = self.machine.contacts[i], self.sides[i]
        gain = one.kinetic[side] if side != 0 and engaged else 0.0
        self.pars[4 * i : 4 * i + 4] = gain, gain * one.slope * side, side, 1 if engaged else -1

    def sample(self, number: int) -> bool:
        """Let a controller sample and set its force; returns whether it changes."""
        i, line, law = self.machine.controllers[number]
        force = law.initial_force + law.slope * abs(float(self.model.speeds[i] @ self.ta.state))
        if law.resolution is not None:
            force = law.resolution * round(force / law.resolution)
        queue = self.queues[number]
        queue.append(force)
        before, self.lines[line] = self.lines[line], (0.0, max(queue[0], 0.0), 0.0)
        return before != self.lines[line]

    def settle(self, resting: list[int], reached: Mapping[int, int] = MappingProxyType({})) -> None:
        """Decide which contacts at rest hold; one that has reached a limit slips to its side."""
        machine, model, now = self.machine, self.model, self.ta.time
        forces = [one.force(now, math.sin, self.lines) for one in machine.contacts]
        seen = (model.seen @ self.ta.state).tolist()
        speeds, rates = seen[: len(forces)], seen[len(forces) :]
        for signal, factors in model.pushes:
            torque = signal(now, math.sin, self.lines)
            rates = [x + factor * torque for x, factor in zip(rates, factors, strict=True)]
        sliding = {
            i: self.pars[4 * i] * forces[i] + self.pars[4 * i + 1] * speed
            for i, speed in enumerate(speeds)
            if i not in resting
        }
        free = {
            i: rates[i] - sum(model.compliance[i][k] * torque for k, torque in sliding.items())
            for i in resting
        }
        chosen = self.decide(free, forces, reached)
        for i, side in chosen.items():
            if side != self.sides[i]:
                self.sides[i], self.left[i] = side, now
                self.engage(i, engaged=True)
                self.events.append((now, i, side))
        self.switch(now)

    def switch(self, now: float) -> None:
        """Change to the integrator of the present sides."""
        before, held = self.ta, tuple(i for i, side in enumerate(self.sides) if side == 0)
        self.ta, self.meaning = self.model.integrator(held)
        if self.ta is not before:  # otherwise the event that has just occurred must not occur again
            self.ta.time, self.ta.state[:] = now, before.state
            self.ta.reset_cooldowns()
        self.ta.pars[:] = self.pars[: self.ta.pars.size]

    def decide(
        self, free: dict[int, float], forces: list[float], reached: Mapping[int, int]
    ) -> dict[int, int]:
        """Sides of contacts at rest, from their rates without their own torques.

        forces  : of actuation, of all contacts
        reached : the side to which a contact slips whose torque has reached its limit
        """
        contacts, compliance = self.machine.contacts, self.model.compliance
        high = {i: contacts[i].peak[1] * forces[i] for i in free}
        low = {i: contacts[i].peak[-1] * forces[i] for i in free}
        sizes = [max(high[i], abs(free[i]) / compliance[i][i]) for i in free]
        room = ROUNDING * max(sizes, default=0.0)
        if len(free) == 1:  # without a search
            [(i, rate)] = free.items()
            needed = rate / compliance[i][i]
            slips = (needed > high[i] + room) - (needed < low[i] - room)
            return {i: reached.get(i, slips)}
        for trial in patterns(len(free)):
            sides = dict(zip(free, trial, strict=True))
            if any(sides[i] != side for i, side in reached.items()):
                continue
            rates = dict(free)
            for i, side in sides.items():
                if side:
                    torque = contacts[i].kinetic[side] * forces[i]
                    for k in free:
                        rates[k] -= compliance[k][i] * torque
            held = tuple(i for i in free if not sides[i])
            taken = [rates[i] for i in held]
            holding = {
                i: sum(factor * rate for factor, rate in zip(row, taken, strict=True))
                for i, row in zip(held, self.model.inverse(held), strict=True)
            }
            if any(not low[i] - room <= torque <= high[i] + room for i, torque in holding.items()):
                continue
            for i, torque in holding.items():
                for k in free:
                    rates[k] -= compliance[k][i] * torque
            least = {i: room * compliance[i][i] * (-1 if i in reached else 1) for i in free}
            if all(not side or side * rates[i] > least[i] for i, side in sides.items()):
                return sides
        raise RuntimeError("no pattern of sticks and slips is consistent")


def schedule(machine: Machine, until: float) -> list[tuple[float, int, int, Line, bool]]:
    """Knots, samplings and the end, in order of time.

    Each is (time, kind, number of the table or controller, next line, whether the table jumps).
    """
    found = [(until, END, 0, (0.0, 0.0, 0.0), False)]
    controlled = {line for _, line, _ in machine.controllers}
    for number, lines in enumerate(machine.tables):
        if number in controlled:
            continue
        for (start, value, slope), line in pairwise(lines):
            jump = abs(value + slope * (line[0] - start) - line[1]) > 1e-9 * abs(value)
            found.append((line[0], KNOT, number, line, jump))
    for number, (_, _, law) in enumerate(machine.controllers):
        times = np.arange(1, math.ceil(until / law.sample_time)) * law.sample_time
        found += [(float(time), SAMPLE, number, (0.0, 0.0, 0.0), False) for time in times]
    return sorted(one for one in found if one[0] <= until)
