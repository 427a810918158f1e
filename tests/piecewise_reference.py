"""A machine of inertias, shafts and torques by an integrator that locates events on its own.

Each piecewise-linear law is written here by its definition. DOP853 integrates the line of each law
that applies; its event functions end a part where another line begins.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

import wedgebrake as wb

Array = NDArray[np.float64]
_FAR, _LATER, _STEP = 1e9, 1e-8, 1e-12


class _Gap:
    """A spring and a damper beyond the ends of a gap, which do not pull."""

    def __init__(self, shaft: wb.Shaft) -> None:
        assert shaft.gap is not None
        assert isinstance(shaft.stiffness, float)
        self.low, self.high = (one + shaft.rest for one in shaft.gap)
        self.k, self.c = shaft.stiffness, shaft.damping

    def label(self, x: float, v: float) -> Any:
        if self.low <= x <= self.high:
            return "inside"
        side = 1 if x > self.high else -1
        pressed = side * self._push(side, x, v) > 0.0
        return (side, pressed)

    def _push(self, side: int, x: float, v: float) -> float:
        return self.k * (x - (self.high if side > 0 else self.low)) + self.c * v

    def torque(self, label: Any, x: float, v: float) -> float:
        return self._push(label[0], x, v) if label != "inside" and label[1] else 0.0

    def ends(self, label: Any) -> list[Callable[[float, float], float]]:
        if label == "inside":
            return [lambda x, _: x - self.low, lambda x, _: x - self.high]
        side, pressed = label
        limit = self.high if side > 0 else self.low
        found: list[Callable[[float, float], float]] = [lambda x, v: self._push(side, x, v)]
        return found if pressed else [*found, lambda x, _: x - limit]


class _Chain:
    """Lines between points, which may repeat, and damping."""

    def __init__(
        self, places: Any, values: Any, slopes: Any, damping: float = 0.0, period: float = 0.0
    ) -> None:
        self.places, self.values, self.slopes = map(np.asarray, (places, values, slopes))
        self.damping, self.period = damping, period
        self.limits = [*places, places[0] + period] if period else list(places)

    def label(self, x: float, _: float) -> Any:
        turn = int(np.floor((x - self.places[0]) / self.period)) if self.period else 0
        return turn, int(np.searchsorted(self.places, x - turn * self.period))

    def torque(self, label: Any, x: float, v: float) -> float:
        turn, number = label
        at = max(number - 1, 0)
        apart = x - turn * self.period - self.places[at]
        return float(self.values[at] + self.slopes[number] * apart + self.damping * v)

    def ends(self, label: Any) -> list[Callable[[float, float], float]]:
        turn, number = label
        places = [self.limits[i] for i in (number - 1, number) if 0 <= i < len(self.limits)]
        return [lambda x, _, at=at + turn * self.period: x - at for at in places]


def _of_shaft(shaft: wb.Shaft) -> Any:
    if shaft.gap is not None:
        return _Gap(shaft)
    if not isinstance(shaft.stiffness, wb.Stages):
        return _Chain([shaft.rest], [0.0], [shaft.stiffness] * 2, shaft.damping)
    angles, stiffnesses = shaft.stiffness.angles, shaft.stiffness.stiffnesses
    edges = [-_FAR, *angles, _FAR]

    def torque(x: float) -> float:
        return sum(
            k * (np.clip(x, low, high) - np.clip(0.0, low, high))
            for low, high, k in zip(edges, edges[1:], stiffnesses, strict=False)
        )

    places = np.array(angles) + shaft.rest
    return _Chain(places, [torque(one) for one in angles], stiffnesses, shaft.damping)


def _of_torque(curve: Any) -> Any:
    values = np.array(curve.torques)
    if isinstance(curve, wb.OverSpeed):
        slopes = np.diff(values) / np.diff(curve.speeds)
        return _Chain(curve.speeds, values, [0.0, *slopes, 0.0])
    slopes = np.diff(values) / np.diff(curve.angles)
    if curve.period is None:
        return _Chain(curve.angles, values, [0.0, *slopes, 0.0])
    end = curve.angles[0] + curve.period
    last = (values[0] - values[-1]) / (end - curve.angles[-1])
    return _Chain(curve.angles, values, [last, *slopes, last], period=curve.period)


class Law:
    """A law with the factors of the state in its argument, and of its torque on the inertias.

    scale : a factor of the torque, a function of time
    """

    def __init__(
        self, of: Any, row: Array, load: Array, of_speed: bool, scale: Any = lambda _: 1.0
    ) -> None:
        self.of, self.row, self.load, self.of_speed = of, row, load, of_speed
        self.scale = scale

    def argument(self, y: Array) -> tuple[float, float]:
        angle, speed = np.split(y, 2)
        if self.of_speed:
            return float(self.row @ speed), 0.0
        return float(self.row @ angle), float(self.row @ speed)

    def label(self, y: Array) -> Any:
        return self.of.label(*self.argument(y))


def laws(machine: wb.Machine) -> list[Law]:
    """The shafts of a machine, and its torques over speeds and angles."""
    found = []
    for shaft in machine.shafts:
        twist = factors_of(machine, {shaft.a: 1.0, shaft.b: -shaft.ratio})
        found.append(Law(_of_shaft(shaft), twist, -twist, False))
    for torque in machine.torques:
        if not isinstance(torque.signal, wb.Signal):
            acts = factors_of(machine, {torque.relative_to or "ground": -1.0, torque.on: 1.0})
            of_speed = isinstance(torque.signal, wb.OverSpeed)
            scale = torque.signal.scale
            scale = scale if callable(scale) else lambda _, scale=scale: scale
            found.append(Law(_of_torque(torque.signal), acts, acts, of_speed, scale))
    return found


def factors_of(machine: wb.Machine, factors: dict[str, float]) -> Array:
    """A row with the factors of some inertias, by name."""
    return np.array([factors.get(one.name, 0.0) for one in machine.inertias])


def states(machine: wb.Machine, times: Array, longest: float = 0.004) -> Array:
    """Angles and speeds at ascending times from 0 on, (times, 2 n).

    longest : largest step of the integrator [s]
    """
    given = laws(machine)
    inertia = np.array([one.inertia for one in machine.inertias])
    y = np.array([[one.angle, one.speed] for one in machine.inertias]).T.ravel()
    signals = [
        (machine.inertia_names.index(one.on), one.signal)
        for one in machine.torques
        if isinstance(one.signal, wb.Signal)
    ]

    def rates(t: float, y: Array, labels: list[Any]) -> Array:
        torque = np.zeros(len(inertia))
        for law, label in zip(given, labels, strict=True):
            torque += law.load * law.of.torque(label, *law.argument(y)) * law.scale(t)
        for at, signal in signals:
            torque[at] += signal(t)
        return np.concatenate([y[len(inertia) :], torque / inertia])

    t, step, found = 0.0, _STEP, np.full((len(times), y.size), np.nan)
    labels = [law.label(y) for law in given]
    while t < times[-1]:
        # The lines a little later: the state may be at the end of one of them.
        labels = [law.label(y + _LATER * rates(t, y, labels)) for law in given]
        ends = []
        for law, label in zip(given, labels, strict=True):
            for end in law.of.ends(label):

                def event(_: float, y: Array, law: Any = law, end: Any = end) -> float:
                    return float(end(*law.argument(y)))

                event.terminal = True  # type: ignore[attr-defined]
                ends.append(event)
        part = solve_ivp(
            lambda t, y, labels=labels: rates(t, y, labels), (t, times[-1]), y, method="DOP853",
            rtol=3e-13, atol=1e-14, events=ends, dense_output=True, max_step=longest,
        )  # fmt: skip
        inside = (times >= t) & (times <= part.t[-1])
        if inside.any():
            found[inside] = part.sol(times[inside]).T
        # Where the state leaves an event slowly, the event is found again: longer steps.
        step = 2.0 * step if part.t[-1] <= t + step else _STEP
        t, y = part.t[-1], part.y[:, -1]
        if part.status == 1:  # a step away from the event
            passed = (times > t) & (times <= t + step)
            t, y = t + step, y + step * rates(t, y, labels)
            found[passed] = y
    return found


def random_machine(seed: int, *, rounded: bool) -> wb.Machine:
    """A chain of up to three inertias with piecewise-linear shafts and torques."""
    draw = np.random.default_rng(seed)

    def number(value: Any) -> float:
        return float(np.round(value, 1) if rounded else value)

    names = "abc"[: draw.integers(1, 4)]
    inertias = [
        wb.Inertia(one, *map(number, (draw.uniform(0.5, 2.0), 0.2 * draw.normal(), draw.normal())))
        for one in names
    ]
    shafts = []
    for i, one in enumerate(names):
        end = names[i + 1] if i + 1 < len(names) else "ground"
        more: dict[str, Any] = {
            "damping": number(draw.choice([0.0, draw.uniform(0.1, 3.0)])),
            "ratio": 1.0 if end == "ground" else float(draw.choice([1.0, 1.0, 2.0, -0.5])),
            "rest": number(draw.choice([0.0, 0.1])),
        }
        stiffness: Any = number(draw.uniform(20.0, 200.0))
        kind = draw.integers(4)
        if kind == 1:
            angles = np.unique(np.round(0.2 * draw.normal(size=3), 1 if rounded else 3))
            stiffness = wb.Stages(angles, np.round(draw.uniform(0.0, 200.0, angles.size + 1)))
        elif kind > 1:
            more["gap"] = (-number(draw.uniform(0.0, 0.3)), number(draw.uniform(0.0, 0.3)))
        shafts.append(wb.Shaft(one, end, stiffness, **more))
    torques = [
        wb.Torque("a", wb.Harmonic(number(draw.uniform(5, 20)), number(draw.uniform(0.3, 2))))
    ]
    if draw.random() < 0.6:
        speeds = np.unique(np.round(2.0 * draw.normal(size=4), 1))
        values = np.round(-speeds + 0.3 * draw.normal(size=speeds.size), 1)
        other = names[0] if len(names) > 1 and draw.random() < 0.5 else None
        torques.append(wb.Torque(names[-1], wb.OverSpeed(speeds, values), relative_to=other))
    if draw.random() < 0.6:
        period = float(draw.choice([0.4, 0.7])) if draw.random() < 0.6 else None
        torques.append(wb.Torque("a", wb.OverAngle([0.0, 0.1, 0.3], [0.0, 3.0, -2.0], period)))
    return wb.Machine(inertias=inertias, shafts=shafts, torques=torques)
