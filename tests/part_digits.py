"""Runs of machines with every part at 50 digits: extrapolated midpoint steps, events by Newton.

``machine_digits`` solves Coulomb friction alone, without steps. Numbers are of ``Decimal``, with
which arithmetic is ten times as fast as with mpmath.

A reference for derivatives with respect to parameters. Differences of such runs over a step of
1e-12 of a parameter have an error of about 1e-22, whereas those of runs in double precision have
only some eight digits. Nothing is shared with the package but the values of the parameters: torques
follow from the definitions in docs/machines.md, and accelerations from equations with multipliers
for joints, driven bodies and contacts at rest.
"""

from __future__ import annotations

import heapq
from collections.abc import Callable, Iterator
from decimal import Decimal, getcontext
from itertools import pairwise
from math import prod
from typing import Any

from mpmath import mp

import wedgebrake as wb

DIGITS = 50
_STEP = Decimal("0.0005")  # of the integration [s]
_COLUMNS = 26
_SMALL = Decimal("1e-34")
_NOTHING = Decimal("1e-40")
_CHANGE = Decimal("1e-12")

Vector = list[Decimal]

with mp.workdps(DIGITS + 10):
    _PI = Decimal(mp.nstr(mp.pi, DIGITS + 5))


def _is_log(signal: Any) -> bool:
    return getattr(signal, "law", "") == "log"


def _of(function: Callable[[Any], Any], value: Decimal) -> Decimal:
    """The value of a function of mpmath."""
    with mp.workdps(DIGITS + 5):
        return Decimal(mp.nstr(function(mp.mpf(str(value))), DIGITS + 5))


def _solved(rows: list[Vector]) -> Vector:
    """Solution of linear equations, from rows with the right-hand side as last entry."""
    n = len(rows)
    for k in range(n):
        best = max(range(k, n), key=lambda i: abs(rows[i][k]))
        rows[k], rows[best] = rows[best], rows[k]
        for i in range(k + 1, n):
            if rows[i][k]:
                share = rows[i][k] / rows[k][k]
                rows[i] = [one - share * two for one, two in zip(rows[i], rows[k], strict=True)]
    found = [Decimal(0)] * n
    for k in reversed(range(n)):
        rest = sum((rows[k][i] * found[i] for i in range(k + 1, n)), Decimal(0))
        found[k] = (rows[k][n] - rest) / rows[k][k]
    return found


class _Chain:
    """A chain of lines through points, with slopes beyond them, and the present line."""

    def __init__(self, points: list[tuple[Decimal, Decimal]], below: Decimal, above: Decimal):
        self.points = points
        inner = [(b[1] - a[1]) / (b[0] - a[0]) for a, b in pairwise(points)]
        self.slopes, self.line = [below, *inner, above], 0

    def begin(self, place: Decimal) -> None:
        self.line = sum(one[0] <= place for one in self.points)

    def at(self, place: Decimal) -> Decimal:
        start, value = self.points[max(self.line - 1, 0)]
        return value + self.slopes[self.line] * (place - start)

    def guards(self, place: Decimal) -> Iterator[tuple[Decimal, int]]:
        """Distances from both ends of the line, and the line beyond."""
        if self.line:
            yield place - self.points[self.line - 1][0], self.line - 1
        if self.line < len(self.points):
            yield self.points[self.line][0] - place, self.line + 1


class Run:
    """A run of a machine from its initial state, with a change of one parameter.

    Known are sines, orders, ramps and tables without jumps that are held, their sums and products;
    shafts with stages or gaps; Coulomb, tabulated, Stribeck and smoothed friction; forces with
    slope, sampling, lag, limits and release, and normal forces of the state; one-way clutches
    without a limit, and drag; torques over speed and angle; continuous and digital controllers
    with limits; driven bodies and joints. Not known are resolutions. An event that is undone within
    a step of 0.5 ms is missed; the states of a test show it.

    The state ``x`` has the angles, the speeds, the time and the further states of signals and
    parts. What happens at known instants, the knots of signals and the samples, is in a heap.
    """

    def __init__(self, machine: wb.Machine, name: str = "", by: Decimal = Decimal(0)) -> None:
        getcontext().prec = DIGITS
        self.machine, self._name, self._by = machine, name, by
        self._all = machine.parameters()
        self.drags = [one for one in machine.contacts if isinstance(one, wb.Drag)]
        self.contacts = [one for one in machine.contacts if not isinstance(one, wb.Drag)]
        self._known: dict[str, Decimal] = {}
        bodies = machine.inertias
        self.place = {one.name: i for i, one in enumerate(bodies)}
        self.n = n = len(bodies)
        self.x: Vector = [Decimal(0)] * (2 * n + 1)
        self.events = 0
        self.chains: dict[str, _Chain] = {}
        self.modes: dict[str, Any] = {}
        self.further: dict[str, int] = {}
        self.samples: dict[str, Vector] = {}
        self._instants: list[tuple[Decimal, int, Callable[[], None]]] = []
        self._tables: dict[str, _Chain] = {}
        self._sines: dict[str, tuple[int, Callable[[Vector], Decimal]]] = {}
        for i, one in enumerate(bodies):
            driven = isinstance(one, wb.Driven)
            self._add_signal(f"{one.name}.speed", one.speed)
            speed = self.signal(f"{one.name}.speed", one.speed, self.x)
            self.x[i], self.x[n + i] = self.v(f"{one.name}.angle"), speed
            if driven:
                self.modes[one.name] = "driven"
        for one in machine.torques:
            self._add_torque(one)
        for one in machine.shafts:
            self._add_shaft(one)
        for one in self.contacts:
            self._add_contact(one)
        for one in machine.controllers:
            self._add_controller(one)
        self._begin()

    @property
    def time(self) -> Decimal:
        return self.x[2 * self.n]

    def v(self, name: str) -> Decimal:
        """Value of a parameter."""
        if name not in self._known:
            value = Decimal(self.machine.value(name))
            self._known[name] = value + (self._by if name == self._name else 0)
        return self._known[name]

    def _known_or(self, name: str, value: int) -> Decimal:
        """Value of a parameter that not all parts have."""
        return self.v(name) if name in self._all else Decimal(value)

    def _add(self, name: str, value: Decimal) -> None:
        self.further[name] = len(self.x)
        self.x.append(value)

    def _at(self, time: Decimal, act: Callable[[], None]) -> None:
        """Let something happen at an instant, at which a step then ends."""
        heapq.heappush(self._instants, (time, len(self._instants), act))

    # Signals: the sine and the cosine of their phases are states, and their tables are chains of
    # lines over time; that of a ramp with law "log" has the logarithms of the values.

    def _add_signal(self, name: str, signal: Any) -> None:
        if isinstance(signal, wb.Harmonic):
            frequency = f"{name}.frequency"
            self._add_sine(
                name, self._known_or(f"{name}.phase", 0), lambda _: self._turn(frequency)
            )
        elif isinstance(signal, wb.Orders):
            self._add_signal(f"{name}.speed", signal.speed)
            for k, (order, _, phase) in enumerate(signal.orders):
                self._add_sine(
                    f"{name}.{k}", Decimal(phase),
                    lambda x, n=Decimal(order): n * self.signal(f"{name}.speed", signal.speed, x),
                )  # fmt: skip
        elif isinstance(signal, wb.Ramp):
            begin, start, end = (self.v(f"{name}.{one}") for one in ("begin", "start", "end"))
            if signal.law == "log":
                start, end = abs(start).ln(), abs(end).ln()
            self._add_table(name, [(begin, start), (begin + self.v(f"{name}.duration"), end)])
        elif isinstance(signal, wb.Table):
            points = zip(signal.times, signal.values, strict=True)
            self._add_table(name, [(Decimal(a), Decimal(b)) for a, b in points])
        for k, one in enumerate(getattr(signal, "signals", ())):
            self._add_signal(f"{name}.signals.{k}", one)

    def _add_sine(self, name: str, phase: Decimal, rate: Callable[[Vector], Decimal]) -> None:
        self._sines[name] = len(self.x), rate
        self.x += [_of(mp.sin, phase), _of(mp.cos, phase)]

    def _turn(self, name: str) -> Decimal:
        return 2 * _PI * self.v(name)

    def _add_table(self, name: str, points: list[tuple[Decimal, Decimal]]) -> None:
        chain = self._tables[name] = _Chain(points, Decimal(0), Decimal(0))
        chain.begin(Decimal(0))
        for k, (time, _) in enumerate(points):
            if time > 0:
                self._at(time, lambda k=k: setattr(chain, "line", k + 1))

    def signal(self, name: str, signal: Any, x: Vector) -> Decimal:
        if isinstance(signal, wb.Harmonic):
            return self.v(f"{name}.amplitude") * x[self._sines[name][0]]
        if isinstance(signal, wb.Orders):
            terms = enumerate(signal.orders)
            sizes = [Decimal(one[1]) * x[self._sines[f"{name}.{k}"][0]] for k, one in terms]
            return sum(sizes, Decimal(0))
        if name in self._tables:
            value = self._tables[name].at(x[2 * self.n])
            return value.exp().copy_sign(Decimal(signal.start)) if _is_log(signal) else value
        if hasattr(signal, "signals"):
            parts = [self.signal(f"{name}.signals.{k}", s, x) for k, s in enumerate(signal.signals)]
            return prod(parts) if signal.kind == "product" else sum(parts, Decimal(0))
        return self._known_or(f"{name}.value" if f"{name}.value" in self._all else name, 0)

    def _change(self, of: Callable[[Vector], Decimal], x: Vector, rates: Vector) -> Decimal:
        """Rate of a polynomial of the state, of second degree at most: its central difference."""
        ends = [[a + way * b for a, b in zip(x, rates, strict=True)] for way in (1, -1)]
        return (of(ends[0]) - of(ends[1])) / 2

    # Parts.

    def _add_torque(self, one: wb.Torque) -> None:
        name, law = one.name, one.signal
        if isinstance(law, wb.OverSpeed | wb.OverAngle):
            what = "speeds" if isinstance(law, wb.OverSpeed) else "angles"
            points = [
                (self.v(f"{name}.{what}.{k}"), self.v(f"{name}.torques.{k}"))
                for k in range(len(law.torques))
            ]
            self.chains[name] = _Chain(points, Decimal(0), Decimal(0))
            self._add_signal(f"{name}.scale", law.scale)
        else:
            self._add_signal(name, law)

    def _add_shaft(self, one: wb.Shaft) -> None:
        name = one.name
        if isinstance(one.stiffness, wb.Stages):
            count = len(one.stiffness.angles)
            angles = [self.v(f"{name}.angles.{k}") for k in range(count)]
            slopes = [self.v(f"{name}.stiffnesses.{k}") for k in range(count + 1)]
            values = [Decimal(0)]
            for k, (a, b) in enumerate(pairwise(angles)):
                values.append(values[-1] + slopes[k + 1] * (b - a))
            chain = _Chain(list(zip(angles, values, strict=True)), slopes[0], slopes[-1])
            chain.begin(Decimal(0))
            zero = chain.at(Decimal(0))
            chain.points = [(a, b - zero) for a, b in chain.points]
            chain.slopes = slopes
            self.chains[name] = chain
        elif one.gap is not None:
            if one.damping:
                twist = self._twist(one, self.x)
                low, high = (self.v(f"{name}.gap.{k}") for k in range(2))
                self.modes[name] = 1 if twist > high else -1 if twist < low else 0
                return
            k, low, high = (self.v(f"{name}.{w}") for w in ("stiffness", "gap.0", "gap.1"))
            self.chains[name] = _Chain([(low, Decimal(0)), (high, Decimal(0))], k, k)

    def _add_contact(self, one: Any) -> None:
        if isinstance(one, wb.OneWayClutch):
            return
        given, name = one.actuation, one.name
        self._add_signal(f"{name}.initial_force", given.initial_force)
        start = self._initial_force(one, self.x)
        if given.sample_time is not None:
            self.samples[name] = [start] * given.delay
        if given.lag or given.frequency:
            self._add(f"{name}.lag", start)
        if given.frequency:
            self._add(f"{name}.rate", Decimal(0))
        if isinstance(one.friction, wb.TabulatedFriction):
            radius, scale = self.v(f"{name}.radius"), self.v(f"{name}.scale")
            table = zip(one.friction.speeds, one.friction.coefficients, strict=True)
            points = [(Decimal(a) / radius, scale * Decimal(b)) for a, b in table]
            self.chains[name] = _Chain(points, Decimal(0), Decimal(0))

    def _add_controller(self, one: wb.Controller) -> None:
        self._add_signal(f"{one.name}.setpoint", one.setpoint)
        self._add(f"{one.name}.sum", Decimal(0))
        if one.sample_time is not None:
            self.samples[one.name] = [Decimal(0)] * one.delay
        else:
            self._add(f"{one.name}.filter", Decimal(0))

    def _sample(self, one: Any, number: int = 0) -> None:
        """Take a sample, and the next ones at their instants."""
        new = self._computed(one) if isinstance(one, wb.Controller) else self._law(one, self.x)
        self.samples[one.name].append(new)
        number += 1
        time = number * self.v(f"{one.name}.sample_time")
        self._at(time, lambda: self._sample(one, number))

    def _held(self, name: str, delay: int) -> Decimal:
        """The sample that is applied."""
        return self.samples[name][-1 - delay]

    def _computed(self, one: wb.Controller) -> Decimal:
        """The output that a digital controller computes at a sample."""
        name, error = one.name, self._error(one, self.x)
        time, at = self.v(f"{name}.sample_time"), self.further[f"{name}.sum"]
        before, part = self.modes.get(f"{name}.last", (error, Decimal(0)))
        filtered = self.v(f"{name}.filter_time") if one.filter_time else Decimal(0)
        part = filtered * part + self.v(f"{name}.derivative") * (error - before)
        part /= filtered + time
        self.modes[f"{name}.last"] = error, part
        gain, fixed = self.v(f"{name}.integral"), self.v(f"{name}.proportional") * error + part
        longer = self.x[at] + gain * time * error
        side = self._beyond(one, fixed + longer)
        if side * gain * error <= 0:
            self.x[at] = longer
        found = fixed + self.x[at]
        side = self._beyond(one, found)
        return self._limit(one, side) if side else found

    def _beyond(self, one: wb.Controller, output: Decimal) -> int:
        """On which side an output is beyond a limit."""
        return next(
            (w for w in (1, -1) if one.limits and w * (output - self._limit(one, w)) > 0), 0
        )

    def _limit(self, one: Any, side: int) -> Decimal:
        place, part = (1 + side) // 2, one if isinstance(one, wb.Controller) else one.actuation
        name = f"{one.name}.limits.{place}"  # those of an actuation are no parameters
        return self.v(name) if name in self._all else Decimal(part.limits[place])

    def _begin(self) -> None:
        for drag in self.drags:
            self.modes[drag.name] = 1 if self._drag_speed(drag, self.x) > 0 else -1
        for one in self.contacts:
            speed = self.sliding(one, self.x)
            self.modes[one.name] = 0 if speed == 0 else int(speed.copy_sign(speed) / abs(speed))
        for name in self.chains:
            self.chains[name].begin(self._place(name, self.x))
        for one in self._continuous:
            self.x[self.further[f"{one.name}.filter"]] = self._error(one, self.x)
            side = self._beyond(one, self._output(one, self.x))
            what = "stopped" if self._pull(one, side, self.x) > 0 else "back" if side else "within"
            self.modes[one.name] = what, side
        for one in [*self.machine.controllers, *self._brakes]:
            if one.name in self.samples:
                self._sample(one)
        self._bound()
        for one in self.contacts:
            if self.modes[one.name] == 0:
                self._settle(one)

    @property
    def _brakes(self) -> list[Any]:
        """Contacts with an actuation."""
        return [one for one in self.contacts if not isinstance(one, wb.OneWayClutch)]

    @property
    def _continuous(self) -> list[wb.Controller]:
        return [one for one in self.machine.controllers if one.sample_time is None]

    def _bound(self) -> None:
        """Set where the forces are: at a limit, which a jump can reach, or within them."""
        for one in self._brakes:
            force = self._free_force(one, self.x)
            side = next((w for w, limit in self._bounds(one) if w * (force - limit) > 0), 0)
            self.modes[f"{one.name}.force"] = side

    def sliding(self, one: Any, x: Vector) -> Decimal:
        speed = x[self.n + self.place[one.a]]
        if one.b == "ground":
            return speed - self._known_or(f"{one.name}.base_speed", 0)
        return speed - self._ratio(one) * x[self.n + self.place[one.b]]

    def _place(self, name: str, x: Vector) -> Decimal:
        """Where a chain of lines is evaluated."""
        for shaft in self.machine.shafts:
            if shaft.name == name:
                return self._twist(shaft, x)
        for contact in self.contacts:
            if contact.name == name:
                return (self.modes[name] or 1) * self.sliding(contact, x)
        one = next(each for each in self.machine.torques if each.name == name)
        first = self.n if isinstance(one.signal, wb.OverSpeed) else 0
        other = x[first + self.place[one.relative_to]] if one.relative_to else Decimal(0)
        return x[first + self.place[one.on]] - other

    def _twist(self, one: wb.Shaft, x: Vector, first: int = 0) -> Decimal:
        other = Decimal(0)
        if one.b != "ground":
            other = self.v(f"{one.name}.ratio") * x[first + self.place[one.b]]
        rest = Decimal(0) if first else self.v(f"{one.name}.rest")
        return x[first + self.place[one.a]] - other - rest

    def _shaft_torque(self, one: wb.Shaft, x: Vector) -> Decimal:
        if one.name in self.modes:
            return self._gap_torque(one, self.modes[one.name], x)
        if one.name in self.chains:
            spring = self.chains[one.name].at(self._twist(one, x))
        else:
            spring = self.v(f"{one.name}.stiffness") * self._twist(one, x)
        return spring + self.v(f"{one.name}.damping") * self._twist(one, x, self.n)

    def _gap_torque(self, one: wb.Shaft, side: int, x: Vector) -> Decimal:
        """Torque of a shaft with damping, in contact at one end of its gap."""
        if not side:
            return Decimal(0)
        apart = self._twist(one, x) - self.v(f"{one.name}.gap.{(1 + side) // 2}")
        rate = self.v(f"{one.name}.damping") * self._twist(one, x, self.n)
        return self.v(f"{one.name}.stiffness") * apart + rate

    def _error(self, one: wb.Controller, x: Vector) -> Decimal:
        found = self.signal(f"{one.name}.setpoint", one.setpoint, x)
        for name in one.measured:
            part, _, what = name.rpartition(".")
            if what == "torque":
                value = self._shaft_torque(
                    next(s for s in self.machine.shafts if s.name == part), x
                )
            else:
                value = x[self.place[part] + (self.n if what == "speed" else 0)]
            found -= self.v(f"{one.name}.measured.{name}") * value
        return found

    def _output(self, one: wb.Controller, x: Vector) -> Decimal:
        error, name = self._error(one, x), one.name
        found = self.v(f"{name}.proportional") * error
        found += self.v(f"{name}.integral") * x[self.further[f"{name}.sum"]]
        if one.derivative:
            rate = self.v(f"{name}.derivative") / self.v(f"{name}.filter_time")
            found += rate * (error - x[self.further[f"{name}.filter"]])
        return found

    def _control(self, one: wb.Controller, x: Vector) -> Decimal:
        """The output of a controller that is applied."""
        if one.sample_time is not None:
            return self._held(one.name, one.delay)
        side = self.modes[one.name][1]
        return self._limit(one, side) if side else self._output(one, x)

    def _initial_force(self, one: wb.Contact, x: Vector) -> Decimal:
        return self.signal(f"{one.name}.initial_force", one.actuation.initial_force, x)

    def _law(self, one: wb.Contact, x: Vector) -> Decimal:
        slide = self.sliding(one, x) * self.modes[one.name]
        found = self._initial_force(one, x) + self.v(f"{one.name}.slope") * slide
        loops = [loop for loop in self.machine.controllers if loop.output == f"{one.name}.command"]
        return found + sum((self._control(loop, x) for loop in loops), Decimal(0))

    def _command(self, one: wb.Contact, x: Vector) -> Decimal:
        if one.actuation.sample_time is not None:
            return self._held(one.name, one.actuation.delay)
        return self._law(one, x)

    def _bounds(self, one: wb.Contact) -> list[tuple[int, Decimal]]:
        """The lower and the upper limit of the force, with their sides."""
        if not one.actuation.limits:
            return [(-1, Decimal(0))]
        return [(-1, max(self._limit(one, -1), Decimal(0))), (1, self._limit(one, 1))]

    def _force(self, one: wb.Contact, x: Vector) -> Decimal:
        side = self.modes[f"{one.name}.force"]
        return dict(self._bounds(one))[side] if side else self._free_force(one, x)

    def _free_force(self, one: wb.Contact, x: Vector) -> Decimal:
        """The force without limits and release."""
        lag = self.further.get(f"{one.name}.lag")
        found = self._command(one, x) if lag is None else x[lag]
        for name in one.normal:
            part, _, what = name.rpartition(".")
            place = self.place[part] + (self.n if what == "speed" else 0)
            found += self.v(f"{one.name}.normal.{name}") * x[place]
        return found

    def _slip_torque(self, one: Any, x: Vector) -> Decimal:
        """Torque of a contact that slides, against its sliding speed."""
        if isinstance(one, wb.OneWayClutch):
            return self.modes[one.name] * self.v(f"{one.name}.drag")
        return self._gain(one, self._mu(one, x)) * self._force(one, x)

    def _gain(self, one: wb.Contact, m: Decimal) -> Decimal:
        """R g(m)."""
        brake, name = one.brake, one.name
        radius = self.v(f"{name}.radius")
        if isinstance(brake, wb.WedgeBrake):
            return radius * m / (self._tan(f"{name}.angle") - m)
        if isinstance(brake, wb.BandBrake):
            return radius * ((m * self.v(f"{name}.wrap_angle")).exp() - 1)
        if isinstance(brake, wb.LeadingShoeBrake):
            a, b, d = (self.v(f"{name}.{w}_arm") for w in ("actuation", "normal", "friction"))
            return radius * m * a / (b - m * d)
        return radius * m

    def _tan(self, name: str) -> Decimal:
        key = f"tan {name}"
        if key not in self._known:
            self._known[key] = _of(mp.tan, self.v(name))
        return self._known[key]

    def _mu(self, one: wb.Contact, x: Vector) -> Decimal:
        """The signed coefficient of a contact that slides."""
        law, name, side = one.friction, one.name, self.modes[one.name]
        slide = side * self.sliding(one, x)
        if isinstance(law, wb.TabulatedFriction):
            return side * self.chains[name].at(slide)
        kinetic = self.v(f"{name}.kinetic")
        speed = self.v(f"{name}.radius") * slide
        if isinstance(law, wb.StribeckFriction):
            peak = self.v(f"{name}.static") - kinetic
            return side * (kinetic + peak * (-speed / self.v(f"{name}.speed")).exp())
        if isinstance(law, wb.SmoothedFriction):
            peak = self.v(f"{name}.static") - kinetic
            decay = (-self.v(f"{name}.decay") * speed).exp()
            e = (2 * self.v(f"{name}.steepness") * speed).exp()
            return side * (kinetic + peak * decay) * (e - 1) / (e + 1)
        return side * kinetic

    def _holds(self, one: Any, side: int, x: Vector) -> Decimal:
        """Largest size of the torque with which a contact resists sliding to a side."""
        name = one.name
        if isinstance(one, wb.OneWayClutch):
            return Decimal(10**12) if side == one.direction else self.v(f"{name}.drag")
        if isinstance(one.friction, wb.TabulatedFriction):
            static = self.v(f"{name}.scale") * self.v(f"{name}.static")
        else:
            static = self.v(f"{name}.static")
        return side * self._gain(one, side * static) * self._force(one, x)

    # The equations of motion.

    def rates(self, x: Vector) -> tuple[Vector, dict[str, Decimal]]:
        """Rates of the state, and the torques on a of contacts at rest."""
        n = self.n
        held = [one for one in self.contacts if self.modes[one.name] == 0]
        rows = [self._row([(one.a, Decimal(1)), (one.b, -self._ratio(one))]) for one in held]
        rows += [self._row(self._joint(joint)) for joint in self.machine.joints]
        rates = [Decimal(0)] * len(x)
        rates[2 * n] = Decimal(1)
        for at, turn in self._sines.values():
            speed = turn(x)
            rates[at], rates[at + 1] = speed * x[at + 1], -speed * x[at]
        for body in self.machine.inertias:
            if self.modes.get(body.name) == "driven":
                name = f"{body.name}.speed"
                speed = lambda x, at=name, one=body.speed: self.signal(at, one, x)  # noqa: E731
                rows.append(self._row([(body.name, Decimal(1))], self._change(speed, x, rates)))
        found = self._accelerations(self._loads(x), rows)
        rates[: 2 * n] = [*x[n : 2 * n], *found[:n]]
        for contact in self.contacts:
            self._set_lag(contact, x, rates)
        for loop in self._continuous:
            self._set_controller(loop, x, rates)
        return rates, {one.name: two for one, two in zip(held, found[n:], strict=False)}

    def _set_controller(self, one: wb.Controller, x: Vector, rates: Vector) -> None:
        error, at = self._error(one, x), self.further[f"{one.name}.filter"]
        if one.derivative:
            rates[at] = (error - x[at]) / self.v(f"{one.name}.filter_time")
        what = self.modes[one.name][0]
        if what in ("within", "back"):
            rates[self.further[f"{one.name}.sum"]] = error
        elif what == "kept":
            own = self._change(lambda x: self._output(one, x), x, rates)
            rates[self.further[f"{one.name}.sum"]] = -own / self.v(f"{one.name}.integral")

    def _row(self, factors: list[tuple[str, Decimal]], rate: Decimal = Decimal(0)) -> Vector:
        """An equation of accelerations, with its right-hand side as last entry."""
        row = [*[Decimal(0)] * self.n, rate]
        for body, factor in factors:
            if body != "ground":
                row[self.place[body]] += factor
        return row

    def _loads(self, x: Vector) -> Vector:
        """Torques on the bodies, without those of contacts at rest and joints."""
        load = [Decimal(0)] * self.n

        def act(torque: Decimal, a: str, b: str, ratio: Decimal) -> None:
            load[self.place[a]] -= torque
            if b != "ground":
                load[self.place[b]] += ratio * torque

        for one in self.machine.shafts:
            act(self._shaft_torque(one, x), one.a, one.b, self._ratio(one))
        for each in self.machine.torques:
            if each.name in self.chains:
                torque = self.chains[each.name].at(self._place(each.name, x))
                torque *= self.signal(f"{each.name}.scale", each.signal.scale, x)
            else:
                torque = self.signal(each.name, each.signal, x)
            act(-torque, each.on, each.relative_to or "ground", Decimal(1))
        for loop in self.machine.controllers:
            if loop.output.endswith(".command"):
                continue
            act(-self._control(loop, x), loop.output.rpartition(".")[0], "ground", Decimal(1))
        for drag in self.drags:
            speed = self._drag_speed(drag, x)
            square = self.v(f"{drag.name}.quadratic") * self.modes[drag.name] * speed
            torque = (self.v(f"{drag.name}.linear") + square) * speed
            act(torque, drag.on, drag.relative_to, Decimal(1))
        for contact in self.contacts:
            if self.modes[contact.name]:
                torque = self._slip_torque(contact, x)
                act(torque, contact.a, contact.b, self._ratio(contact))
        return load

    def _drag_speed(self, one: wb.Drag, x: Vector) -> Decimal:
        other = Decimal(0)
        if one.relative_to != "ground":
            other = x[self.n + self.place[one.relative_to]]
        return x[self.n + self.place[one.on]] - other

    def _ratio(self, one: Any) -> Decimal:
        return self._known_or(f"{one.name}.ratio", 1) if one.b != "ground" else Decimal(1)

    def _joint(self, joint: Any) -> list[tuple[str, Decimal]]:
        if isinstance(joint, wb.Planetary):
            z = self.v(f"{joint.name}.ratio")
            return [(joint.sun, Decimal(1)), (joint.ring, z), (joint.carrier, -1 - z)]
        ratio = self.v(f"{joint.name}.ratio") if isinstance(joint, wb.Gear) else Decimal(1)
        return [(joint.a, Decimal(1)), (joint.b, -ratio)]

    def _accelerations(self, load: Vector, rows: list[Vector]) -> Vector:
        n, m = self.n, len(rows)
        inertia = [
            Decimal(0) if self.modes.get(one.name) == "driven" else self.v(f"{one.name}.inertia")
            for one in self.machine.inertias
        ]
        if not m:
            return [one / two for one, two in zip(load, inertia, strict=True)]
        table = []
        for i in range(n):
            row = [Decimal(0)] * (n + m)
            row[i] = inertia[i]
            for k in range(m):
                row[n + k] = -rows[k][i]
            table.append([*row, load[i]])
        table += [[*one[:n], *[Decimal(0)] * m, one[n]] for one in rows]
        return _solved(table)

    def _set_lag(self, one: wb.Contact, x: Vector, rates: Vector) -> None:
        at = self.further.get(f"{one.name}.lag")
        if at is None:
            return
        apart = self._command(one, x) - x[at]
        if one.actuation.lag:
            rates[at] = apart / self.v(f"{one.name}.lag")
        else:
            own, speed = self.v(f"{one.name}.frequency"), self.further[f"{one.name}.rate"]
            rates[at] = x[speed]
            rates[speed] = own * own * apart
            rates[speed] -= 2 * self.v(f"{one.name}.damping_ratio") * own * x[speed]

    # Events.

    def _guards(self, x: Vector) -> list[tuple[Decimal, Callable[[], None]]]:
        """What is positive in the present modes, and what happens where it is not."""
        found: list[tuple[Decimal, Callable[[], None]]] = []
        for name, chain in self.chains.items():
            contact = next((one for one in self.contacts if one.name == name), None)
            if contact is not None and self.modes[name] == 0:
                continue
            for value, line in chain.guards(self._place(name, x)):
                if contact is None or line:
                    found.append((value, lambda c=chain, k=line: setattr(c, "line", k)))
        for drag in self.drags:
            side = self.modes[drag.name]
            change = lambda d=drag, s=side: self.modes.__setitem__(d.name, -s)  # noqa: E731
            found.append((side * self._drag_speed(drag, x), change))
        for shaft in self.machine.shafts:
            if shaft.name in self.modes:
                found += self._gap_guards(shaft, x)
        found += self._limit_guards(x)
        torques = None
        for one in self.contacts:
            side = self.modes[one.name]
            if side:
                found.append((side * self.sliding(one, x), lambda c=one: self._settle(c)))
                continue
            torques = self.rates(x)[1] if torques is None else torques
            for way in (1, -1):
                # A torque -way * size on a acts against a slip to this side.
                value = self._holds(one, way, x) + way * torques[one.name]
                found.append((value, lambda c=one, w=way: self._slip(c, w)))
        return found

    def _slip(self, one: Any, side: int) -> None:
        self.modes[one.name] = side
        if one.name in self.chains:
            self.chains[one.name].line = 1

    def _settle(self, one: Any) -> None:
        """What a contact does whose sliding speed is 0."""
        before = self.modes[one.name]
        if isinstance(getattr(one, "friction", None), wb.SmoothedFriction):
            self._slip(one, -before)
            return
        self.modes[one.name] = 0
        torque = self.rates(self.x)[1][one.name]
        for way in (1, -1):
            if self._holds(one, way, self.x) + way * torque < 0:
                self._slip(one, way)

    def _gap_guards(self, one: wb.Shaft, x: Vector) -> list[tuple[Decimal, Callable[[], None]]]:
        """Contact begins at the end of the gap, and ends where the shaft would pull."""
        side = self.modes[one.name]
        if side:
            return [
                (side * self._gap_torque(one, side, x),
                 lambda: self.modes.__setitem__(one.name, 0))
            ]  # fmt: skip
        found: list[tuple[Decimal, Callable[[], None]]] = []
        for way in (-1, 1):
            left = way * (self.v(f"{one.name}.gap.{(1 + way) // 2}") - self._twist(one, x))
            found.append((left, lambda w=way: self.modes.__setitem__(one.name, w)))
        return found

    def _limit_guards(self, x: Vector) -> list[tuple[Decimal, Callable[[], None]]]:
        """Those of the limits of forces and of the outputs of controllers."""
        found = [one for brake in self._brakes for one in self._force_guards(brake, x)]
        for loop in self._continuous:
            found += self._controller_guards(loop, x) if loop.limits else []
        return found

    def _force_guards(self, one: wb.Contact, x: Vector) -> list[tuple[Decimal, Callable[[], None]]]:
        """The force reaches a limit, or leaves it."""
        mode, force = f"{one.name}.force", self._free_force(one, x)
        side = self.modes[mode]
        return [
            (way * (force - limit) if side else way * (limit - force),
             lambda w=way: self.modes.__setitem__(mode, 0 if side else w))
            for way, limit in self._bounds(one) if side in (0, way)
        ]  # fmt: skip

    def _controller_guards(
        self, one: wb.Controller, x: Vector
    ) -> list[tuple[Decimal, Callable[[], None]]]:
        """The output reaches or leaves a limit, or the error changes its sign there.

        Beyond a limit the integral part is "stopped" or comes "back"; at it, it is "kept" there.
        """
        what, side = self.modes[one.name]
        output, pull = self._output(one, x), self._pull(one, side, x)
        if what == "within":
            return [
                (way * (self._limit(one, way) - output), lambda w=way: self._pass(one, w))
                for way in (1, -1)
            ]
        passed = lambda: self._pass(one, side)  # noqa: E731
        if what == "kept":
            own = self._outwards(one, side, x)
            return [(-own, passed), (own + pull, passed)]
        turned = "back" if what == "stopped" else "stopped"
        return [
            (side * (output - self._limit(one, side)), passed),
            (pull if what == "stopped" else -pull,
             lambda: self.modes.__setitem__(one.name, (turned, side))),
        ]  # fmt: skip

    def _pull(self, one: wb.Controller, side: int, x: Vector) -> Decimal:
        """Rate with which the integral part, where it changes, drives the output to a side."""
        return side * self.v(f"{one.name}.integral") * self._error(one, x)

    def _outwards(self, one: wb.Controller, side: int, x: Vector) -> Decimal:
        """Rate with which the output moves to a side without its integral part."""
        rates = list(self.rates(x)[0])
        rates[self.further[f"{one.name}.sum"]] = Decimal(0)
        return side * self._change(lambda x: self._output(one, x), x, rates)

    def _pass(self, one: wb.Controller, side: int) -> None:
        """What a controller does whose output is at a limit."""
        own, pull = self._outwards(one, side, self.x), self._pull(one, side, self.x)
        what = "within"
        if own > 0 and pull > 0:
            what = "stopped"
        elif own + pull > 0:
            what = "kept" if pull > 0 else "back"
        self.modes[one.name] = what, side if what != "within" else 0

    def _release(self) -> None:
        """Make contacts that cannot hold in the present modes slip."""
        for _ in self.contacts:
            for one in self.contacts:
                if self.modes[one.name] == 0:
                    torque = self.rates(self.x)[1][one.name]
                    for way in (1, -1):
                        if self._holds(one, way, self.x) + way * torque < -_NOTHING:
                            self._slip(one, way)

    def _step(self, size: Decimal) -> Vector:
        """The state after a step in the present modes, by extrapolation of midpoint steps."""
        first = self.rates(self.x)[0]
        rows: list[list[Vector]] = []
        for j in range(_COLUMNS):
            count = 2 * (j + 1)
            h = size / count
            before, now = self.x, [a + h * b for a, b in zip(self.x, first, strict=True)]
            for _ in range(count - 1):
                rates = self.rates(now)[0]
                before, now = now, [a + 2 * h * b for a, b in zip(before, rates, strict=True)]
            row = [now]
            for k in range(1, j + 1):
                factor = Decimal(j + 1) ** 2 / Decimal(j + 1 - k) ** 2 - 1
                row.append(
                    [a + (a - b) / factor for a, b in zip(row[-1], rows[-1][k - 1], strict=True)]
                )
            rows.append(row)
            if j and all(
                abs(a - b) <= _SMALL * (1 + abs(a)) for a, b in zip(row[-1], row[-2], strict=True)
            ):
                row[-1][2 * self.n] = self.time + size  # without rounding of its sums
                return row[-1]
        raise ArithmeticError(f"no convergence at t = {self.time}")

    def _reach(self, number: int, size: Decimal) -> Decimal:
        """The time until a guard is 0, from the end of a step of a size that passes it."""
        start, low, high = self.x, Decimal(0), size
        try:
            for _ in range(200):
                self.x = start
                self.x = self._step(size)
                value = self._guards(self.x)[number][0]
                rates = self.rates(self.x)[0]
                near = [a + _CHANGE**2 * b for a, b in zip(self.x, rates, strict=True)]
                slope = (self._guards(near)[number][0] - value) / _CHANGE**2
                if value < 0:
                    high = size
                else:
                    low = size
                change = -value / slope if slope else Decimal(0)
                if abs(change) <= _NOTHING:
                    return size
                size += change
                if not low < size < high:
                    size = (low + high) / 2
                    if high - low <= _NOTHING:
                        return size
        finally:
            self.x = start
        raise ArithmeticError("no event found")

    def to(self, end: float) -> Run:
        """Run to a time."""
        last = +Decimal(end)  # rounded, as all times are
        while self.time < last:
            size = min(_STEP, last - self.time)
            instant = bool(self._instants) and self._instants[0][0] <= self.time + size
            if instant:
                size = self._instants[0][0] - self.time
            while True:
                try:
                    end_state = self._step(size)
                except ArithmeticError:  # of steep friction
                    size, instant = size / 4, False
                else:
                    break
            passed = [k for k, (one, _) in enumerate(self._guards(end_state)) if one < -_NOTHING]
            passed = [k for k in passed if self._guards(self.x)[k][0] > -_NOTHING]
            if passed:
                times = {k: self._reach(k, size) for k in passed}
                number = min(times, key=lambda k: times[k])
                self.x = self._step(times[number])
                self._guards(self.x)[number][1]()
                self.events += 1
            else:
                self.x = end_state
                if not instant:
                    continue
                heapq.heappop(self._instants)[2]()
                self._bound()
            self._release()
            for loop in self._continuous:
                what, side = self.modes[loop.name]
                if what == "kept":
                    self._pass(loop, side)
        return self

    @property
    def state(self) -> Vector:
        """Angles and speeds."""
        return self.x[: 2 * self.n]


def derivative(machine: wb.Machine, name: str, end: float) -> list[float]:
    """Derivatives of the angles and speeds at a time with respect to a parameter."""
    value = abs(machine.value(name)) or 1.0
    step = _CHANGE * Decimal(value)
    ends = [Run(machine, name, way * step).to(end).state for way in (1, -1)]
    return [float((a - b) / (2 * step)) for a, b in zip(*ends, strict=True)]


def state(machine: wb.Machine, end: float) -> tuple[list[float], int]:
    """Angles and speeds at a time, and the number of events."""
    run = Run(machine).to(end)
    return [float(one) for one in run.state], run.events
