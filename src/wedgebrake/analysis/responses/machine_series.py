"""The motion of a machine as Legendre series between its events.

The run of a response is repeated and sampled, exactly, at Gauss points of intervals that no event,
knot of a signal or sampling divides. There every quantity is analytic; intervals
are halved until its series ends in rounding. Integrals, derivatives and extremes are those of the
series.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import ArrayLike, NDArray

from wedgebrake.analysis.responses.repeat import solved
from wedgebrake.arrays import FloatArray
from wedgebrake.errors import InputError
from wedgebrake.model.elements import elements
from wedgebrake.model.joints import accelerations
from wedgebrake.model.machine import Machine
from wedgebrake.model.machine_matrices import contact_rows, shaft_matrices, shaft_rows
from wedgebrake.solvers.response import (
    driven_accelerations,
    external_torques,
    shaft_torques,
    sliding_speeds,
)

if TYPE_CHECKING:
    from wedgebrake.solvers.machine.solve import MachineAnswer, MachineTask


# Gauss points of an interval: the square of a series is integrated exactly too.
_COUNT = 16
NODES, WEIGHTS = legendre.leggauss(_COUNT)
_DEGREES = np.arange(_COUNT)
# From values at the nodes to coefficients.
_TO_SERIES = (_DEGREES[:, None] + 0.5) * legendre.legvander(NODES, _COUNT - 1).T * WEIGHTS
# From coefficients to those of the derivative over the interval [-1, 1].
_DERIVATIVE = legendre.legder(np.eye(_COUNT))
# Coefficients below this share of the largest speeds and loads are rounding; and the rounding of a
# large angle in the torque of a shaft, which contacts at rest hold.
_CONVERGED, _EPSILON = 1e-13, 4e-15
# Coefficients below this share that do not fall as an interval is halved are rounding too: that of
# the time, late in a run, and that of the speed in the torque of a steep law.
_STALLED = 1e-10
# Coefficients of a load below this share of the largest one are not differentiated.
_CHOPPED = 2e-15
# Intervals between two events at the beginning, if these are few; most of all intervals; and the
# shortest one, as a share of the whole time.
_FIRST, _FEW, _MOST, _SHORTEST = 8, 1000, 200_000, 1e-11
_EXTREME_GRID: FloatArray = np.cos(np.linspace(0.0, np.pi, 65))


@dataclass(frozen=True, eq=False)
class MachineSeries:
    """Motion of a machine in p consecutive intervals, at their Gauss points.

    machine      : with n inertias and m contacts
    start, length: (p,) of the intervals [s]
    angle, speed, acceleration : (p, nodes, n) of the inertias
    load         : (p, nodes, n) torque of contacts and signals on the inertias
    torque, sliding, force : (p, nodes, m) torque of each contact on its first inertia, sliding
                   speed and actuation force
    slides       : (p, m) whether a contact slides
    lags         : (p, nodes, l) states of the lags of the actuators, and of controllers
    control      : (p, nodes, c) outputs of controllers
    """

    machine: Machine
    start: FloatArray
    length: FloatArray
    angle: FloatArray
    speed: FloatArray
    acceleration: FloatArray
    load: FloatArray
    torque: FloatArray
    sliding: FloatArray
    force: FloatArray
    slides: NDArray[np.bool_]
    lags: FloatArray
    control: FloatArray

    @property
    def times(self) -> FloatArray:
        """Times of the nodes, (p, nodes) [s]."""
        return self.start[:, None] + 0.5 * self.length[:, None] * (1.0 + NODES)

    @property
    def external(self) -> FloatArray:
        """Torques of signals and controllers on the inertias at the nodes, (p, nodes, n) [N m]."""
        return external_torques(self.machine, self.times, self.angle, self.speed, self.control)

    @property
    def loads(self) -> FloatArray:
        """Sum of the magnitudes of the terms of ``load``, which may cancel each other."""
        contacts = np.abs(self.torque) @ np.abs(contact_rows(self.machine))
        return np.asarray(contacts + np.abs(self.external))

    @property
    def base(self) -> FloatArray:
        """Speeds of the moving bases of the contacts at the nodes, (p, nodes, m) [rad/s]."""
        still = np.zeros((*self.times.shape, len(self.machine.inertias)))
        return -sliding_speeds(self.machine, still, self.times)

    @property
    def power(self) -> FloatArray:
        """Heat flow of the contacts, (p, nodes, m) [W]."""
        return -self.torque * self.sliding

    def integral(self, values: FloatArray) -> FloatArray:
        """Integrals of quantities at the nodes over each interval, (p, ...)."""
        return np.asarray(0.5 * np.einsum("p,k,pk...->p...", self.length, WEIGHTS, values))

    def jerk(self) -> FloatArray:
        """Jerk of the inertias at the nodes, (p, nodes, n) [rad/s^3], without jumps at events.

        nan for driven bodies.
        Only the loads are differentiated: angles have large rounding errors after many turns.
        """
        loads, rates = series(self.load), np.zeros_like(self.load)
        # Differentiation would multiply rounding by the square of the degree.
        loads[np.abs(loads) < _CHOPPED * np.max(np.abs(self.load), initial=0.0)] = 0.0
        rates[:, :-1] = np.einsum("dk,pkn->pdn", _DERIVATIVE, loads)
        rates = at_nodes(rates) * (2.0 / self.length)[:, None, None]
        for one in elements(self.machine):
            if one.kind == "shaft":
                pieces = one.pieces_at(self.angle, self.speed)
                change = one.change(pieces, self.speed, self.acceleration)
                rates += change[..., None] * one.load
        stiffness, damping = shaft_matrices(self.machine, linear=True)
        inertia = np.array([one.inertia for one in self.machine.inertias])
        found = (rates - self.speed @ stiffness - self.acceleration @ damping) / inertia
        found[..., np.isinf(inertia)] = np.nan
        return np.asarray(found)

    def select(self, first: float, last: float) -> MachineSeries:
        """The intervals between two times that are ends of intervals."""
        middle = self.start + 0.5 * self.length
        return _rows(self, (middle > first) & (middle < last))


def series(values: FloatArray) -> FloatArray:
    """Legendre coefficients (p, degrees, ...) of values at the nodes of each interval."""
    # The rounding of the weights is relative to what is left of the values.
    base = values[:, _COUNT // 2]
    found = np.einsum("dk,pk...->pd...", _TO_SERIES, values - base[:, None])
    found[:, 0] += base
    return np.asarray(found)


def at_nodes(coefficients: FloatArray) -> FloatArray:
    """Values at the nodes, the inverse of ``series``."""
    matrix = legendre.legvander(NODES, _COUNT - 1)
    return np.asarray(np.einsum("kd,pd...->pk...", matrix, coefficients))


def largest(coefficients: FloatArray) -> FloatArray:
    """Largest magnitude of each quantity, also between the nodes: (...); nan without intervals."""
    if not coefficients.shape[0]:
        return np.full(coefficients.shape[2:], np.nan)
    matrix = legendre.legvander(_EXTREME_GRID, _COUNT - 1)
    found = np.zeros(coefficients.shape[2:])
    for place in np.ndindex(found.shape):
        rows = coefficients[(slice(None), slice(None), *place)]
        ends = np.abs(rows @ matrix[[0, -1]].T)
        if np.isnan(ends).any():  # of a quantity that a part does not have
            found[place] = np.nan
            continue
        # Only intervals whose bound is above what others reach.
        chosen = rows[np.abs(rows).sum(axis=1) >= (1.0 - _CONVERGED) * ends.max()]
        values = np.abs(chosen @ matrix.T)
        x = np.asarray(_EXTREME_GRID[np.argmax(values, axis=1)])
        found[place] = max(ends.max(), values.max(), _refined(chosen, x).max())
    return found


def integrals_of_magnitude(rows: FloatArray) -> FloatArray:
    """Integrals over [-1, 1] of the magnitudes of series (p, degrees), from zero to zero: (p,)."""
    antiderivatives = legendre.legint(rows, axis=1, lbnd=-1.0)
    found = np.abs(2.0 * rows[:, 0])
    # Others cannot change their sign.
    for k in np.flatnonzero(np.abs(rows[:, 0]) < np.abs(rows[:, 1:]).sum(axis=1)):
        roots = legendre.legroots(legendre.legtrim(rows[k], 1e-16 * np.abs(rows[k]).max()))
        real = np.sort(roots[np.abs(roots.imag) < 1e-9].real)
        cuts = np.array([-1.0, *real[np.abs(real) < 1.0], 1.0])
        found[k] = np.abs(np.diff(legendre.legval(cuts, antiderivatives[k]))).sum()
    return np.asarray(found)


def _refined(rows: FloatArray, x: FloatArray) -> FloatArray:
    """Magnitudes of series at the extremes next to given places, by Newton's method."""
    first = np.asarray(legendre.legder(rows, axis=1), float)
    second = np.asarray(legendre.legder(first, axis=1), float)
    for _ in range(6):
        slope, bend = values_at(first, x), values_at(second, x)
        step = np.divide(slope, bend, out=np.zeros_like(x), where=bend != 0.0)
        x = np.asarray(np.clip(x - np.clip(step, -0.1, 0.1), -1.0, 1.0), float)
    return np.abs(values_at(rows, x))


def values_at(rows: FloatArray, x: FloatArray) -> FloatArray:
    """The value of each series at its own place."""
    return np.asarray(np.sum(rows * legendre.legvander(x, rows.shape[1] - 1), axis=1))


def machine_series(
    machine: Machine, task: MachineTask, answer: MachineAnswer, further: ArrayLike = ()
) -> MachineSeries:
    """The series of a run.

    answer  : of the task, without samples
    further : times in the run that are to be ends of intervals [s]

    Raises ``InputError`` where the run has too many vibrations to resolve.
    """
    edges = _edges(machine, task, answer, np.asarray(further, float))
    lengths = np.diff(edges)
    parts = min(_FIRST, 1 + _FEW // max(lengths.size, 1))
    shares = np.tile(np.arange(parts) / parts, lengths.size)
    start = np.repeat(edges[:-1], parts) + shares * np.repeat(lengths, parts)
    length = np.repeat(lengths / parts, parts)
    least = _SHORTEST * (task.end - task.start)
    kept: list[MachineSeries] = []
    count, fastest, most, before = 0, 0.0, 0.0, np.full((start.size, 2), np.inf)
    while start.size or not kept:
        count += start.size
        if count > _MOST:
            raise InputError(
                f"response: its run of {task.end - task.start:g} s needs more than {_MOST}"
                " intervals to resolve its vibration. Simulate a shorter time."
            )
        found = _sampled(machine, task, start, length)
        fastest = max(fastest, float(np.max(np.abs(found.speed), initial=0.0)))
        most = max(most, float(np.max(found.loads, initial=0.0)))
        noise = _EPSILON * np.abs(found.angle).max(axis=1) @ np.abs(shaft_matrices(machine)[0])
        last = np.column_stack([_last(found.speed), _last(found.load)])
        limits = _CONVERGED * np.array([[fastest, most]])
        limits = np.maximum(limits, np.column_stack([np.zeros(noise.shape[0]), noise.max(axis=1)]))
        stalled = (last > 0.5 * before) & (last <= _STALLED * np.array([fastest, most]))
        rough = (length > 2.0 * least) & ((last > limits) & ~stalled).any(axis=1)
        kept.append(_rows(found, ~rough))
        before = np.repeat(last[rough], 2, axis=0)
        half = 0.5 * length[rough]
        start = np.column_stack([start[rough], start[rough] + half]).ravel()
        length = np.repeat(half, 2)
    return _joined(kept)


def _edges(
    machine: Machine, task: MachineTask, answer: MachineAnswer, further: FloatArray
) -> FloatArray:
    """Times at which the motion may not be analytic and further ones, with the ends of the run."""
    begin, end = task.start, task.end
    parts = [np.array([begin, end]), further, answer.events["time"]]
    parts += [signal.knots(begin, end) for signal in machine.signals().values()]
    for contact, (first, _) in zip(machine.contacts, answer.final.sampled, strict=True):
        step = contact.actuation.sample_time
        if step is not None:
            number = np.arange(np.ceil((begin - first) / step), np.floor((end - first) / step) + 1)
            parts.append(first + number * step)
    for loop, (first, _) in zip(machine.controllers, answer.final.samplings, strict=True):
        step = loop.sample_time
        if step is not None:
            number = np.arange(np.ceil((begin - first) / step), np.floor((end - first) / step) + 1)
            parts.append(first + number * step)
    times = np.unique(np.concatenate(parts))
    times = times[(times >= begin) & (times <= end)]
    far = np.diff(times, prepend=-np.inf) > _SHORTEST * (end - begin)
    return np.asarray(times[far])


def _sampled(
    machine: Machine, task: MachineTask, start: FloatArray, length: FloatArray
) -> MachineSeries:
    """The motion at the nodes of intervals, whose beginnings ascend."""
    times = start[:, None] + 0.5 * length[:, None] * (1.0 + NODES)
    flat = np.clip(times.ravel(), task.start, task.end)
    observer = solved(machine, dataclasses.replace(task, times=flat)).observer
    n, m = len(machine.inertias), len(machine.contacts)
    states = observer.states.reshape(*times.shape, -1)
    angle, speed = states[..., :n], states[..., n : 2 * n]
    torque = observer.torque.reshape(*times.shape, m)
    side = observer.side.reshape(*times.shape, m)[:, _COUNT // 2]
    inside = flat.reshape(times.shape)
    sliding = np.where(side[:, None] == 0, 0.0, sliding_speeds(machine, speed, inside))
    control = observer.control.reshape(*times.shape, len(machine.controllers))
    external = external_torques(machine, inside, angle, speed, control)
    load = torque @ contact_rows(machine) + external
    shafts = shaft_torques(machine, angle, speed)
    driven = driven_accelerations(machine, inside)
    acceleration = accelerations(machine, load - shafts @ shaft_rows(machine), driven)
    force = observer.force.reshape(*times.shape, m)
    return MachineSeries(
        machine, start, length, angle, speed, acceleration, load, torque, sliding, force, side != 0,
        states[..., 2 * n :], control,
    )  # fmt: skip


def _last(values: FloatArray) -> FloatArray:
    """(p,) the larger of the last coefficients of a series."""
    return np.asarray(np.abs(series(values)[:, -2:]).max(axis=(1, 2), initial=0.0))


_OVER_INTERVALS = (
    "start", "length", "angle", "speed", "acceleration", "load", "torque", "sliding", "force",
    "slides", "lags", "control",
)  # fmt: skip


def _rows(found: MachineSeries, chosen: NDArray[np.bool_]) -> MachineSeries:
    new = {name: getattr(found, name)[chosen] for name in _OVER_INTERVALS}
    return dataclasses.replace(found, **new)


def _joined(parts: list[MachineSeries]) -> MachineSeries:
    """All intervals, in order of time."""
    columns = {
        name: np.concatenate([getattr(one, name) for one in parts]) for name in _OVER_INTERVALS
    }
    order = np.argsort(columns["start"], kind="stable")
    ordered: dict[str, Any] = {name: column[order] for name, column in columns.items()}
    return dataclasses.replace(parts[0], **ordered)
