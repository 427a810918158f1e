"""Derivatives of signals with respect to a parameter and to time, as signals."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np

from wedgebrake.model.part import SMALLEST
from wedgebrake.model.signals.signal_base import Signal, as_signal
from wedgebrake.model.signals.signal_tables import Table
from wedgebrake.model.signals.signals import (
    LONGEST,
    Constant,
    Exponential,
    Harmonic,
    Integral,
    Orders,
    Product,
    Sum,
)
from wedgebrake.model.validation import wrong

Difference = Callable[[Sequence[float]], float]

# Distance beside a jump, relative to 1 s and to its time, and largest change of a signal between
# both sides that is continuous, relative to its bound.
_BESIDE, _SIDES, _CONTINUOUS = 2.0**-45, np.array([-1.0, 1.0]), 1e-9
# The time itself as a signal [s].
_TIME = Table(times=(0.0, LONGEST), values=(0.0, LONGEST), after="hold")


def tangent_of(near: Sequence[Signal], difference: Difference, signal: Signal) -> Signal:
    """Derivative of a signal with respect to a parameter.

    near       : the signal at neighbouring values of the parameter
    difference : derivative of a number, from its values there
    signal     : at the value itself

    Raises ``InputError`` for a signal that has none.
    """
    plain, others = signal.primitive(), [one.primitive() for one in near]
    found = _tangent(others, difference, plain)
    # Where jumps move, the signal as a whole must be continuous, such as a ramp with law "log".
    for time in _moving_jumps(others, plain):
        apart = float(np.diff(plain(time + _BESIDE * max(1.0, abs(time)) * _SIDES))[0])
        if abs(apart) > _CONTINUOUS * plain.bound:
            raise _none(signal)
    return found


def _moving_jumps(near: Sequence[Any], signal: Any) -> Iterator[float]:
    """Times of the jumps of tables that depend on a parameter [s]."""
    if isinstance(signal, Sum | Product):
        for i, part in enumerate(signal.signals):
            yield from _moving_jumps([one.signals[i] for one in near], part)
    elif isinstance(signal, Orders):
        yield from _moving_jumps([one.speed for one in near], signal.speed)
    elif isinstance(signal, Table):
        for place in np.flatnonzero(np.diff(signal.times) == 0.0).tolist():
            if any(one.times[place] != signal.times[place] for one in near):
                yield signal.times[place]


def _tangent(near: Sequence[Any], difference: Difference, signal: Any) -> Signal:
    if any(type(one) is not type(signal) for one in near):
        raise _none(signal)
    if isinstance(signal, Constant):
        return Constant(difference([one.value for one in near]))
    if isinstance(signal, Harmonic):
        return _of_harmonic(near, difference, signal)
    if isinstance(signal, Table):
        return _of_table(near, difference, signal)
    if isinstance(signal, Exponential):
        by_value, by_growth, by_begin = (
            difference([getattr(one, name) for one in near])
            for name in ("value", "growth", "begin")
        )
        # d/da of exp(a (t - t_0)) is (t - t_0) exp(a (t - t_0)).
        factor = by_value / signal.value - by_growth * signal.begin - by_begin * signal.growth
        return Product(signals=(Sum(signals=(Constant(factor), by_growth * _TIME)), signal))
    if isinstance(signal, Sum | Product):
        parts = [
            _tangent([one.signals[i] for one in near], difference, part)
            for i, part in enumerate(signal.signals)
        ]
        if isinstance(signal, Sum):
            return Sum(signals=tuple(parts))
        terms = [
            Product(signals=(*signal.signals[:i], part, *signal.signals[i + 1 :]))
            for i, part in enumerate(parts)
        ]
        return Sum(signals=tuple(terms))
    if isinstance(signal, Orders):
        return _of_orders(near, difference, signal)
    raise _none(signal)


def _of_harmonic(near: Sequence[Harmonic], difference: Difference, signal: Harmonic) -> Signal:
    by_amplitude, by_frequency, by_phase = (
        difference([getattr(one, name) for one in near])
        for name in ("amplitude", "frequency", "phase")
    )
    later = signal.phase + 0.5 * math.pi
    terms: list[Signal] = [
        Harmonic(by_amplitude, signal.frequency, signal.phase),
        Harmonic(_size(signal.amplitude * by_phase), signal.frequency, later),
    ]
    size = _size(2.0 * math.pi * signal.amplitude * by_frequency)
    if size != 0.0:
        terms.append(Product(signals=(_TIME, Harmonic(size, signal.frequency, later))))
    return Sum(signals=tuple(terms))


def _of_orders(near: Sequence[Orders], difference: Difference, signal: Orders) -> Signal:
    """That of sin(n theta) is (n' theta + n theta') cos(n theta), theta being the angle."""
    angle, turned = Integral(speed=signal.speed), as_signal(0.0)
    if any(one.speed != signal.speed for one in near):
        turned = Integral(speed=_tangent([one.speed for one in near], difference, signal.speed))
    fixed, terms = [], list[Signal]()
    for i, (order, amplitude, phase) in enumerate(signal.orders):
        by_order, by_amplitude, by_phase = (
            difference([one.orders[i][place] for one in near]) for place in range(3)
        )
        later = phase + 0.5 * math.pi
        fixed += [(order, by_amplitude, phase), (order, amplitude * by_phase, later)]
        change = by_order * angle + order * turned
        if change.varies:
            terms.append(change * Orders(signal.speed, [(order, amplitude, later)]))
    return Sum(signals=(Orders(signal.speed, fixed), *terms))


def _size(value: float) -> float:
    """A size of a signal; 0 for one that is too small for a parameter."""
    return value if abs(value) >= SMALLEST else 0.0


def _of_table(near: Sequence[Table], difference: Difference, signal: Table) -> Signal:
    times, values = (np.array([getattr(one, name) for one in near]) for name in ("times", "values"))
    by_time = np.array([difference(one) for one in times.T])
    by_value = np.array([difference(one) for one in values.T])
    at, now = np.array(signal.times), np.array(signal.values)
    lengths = np.diff(at)
    if signal.periodic and np.any(by_time != 0.0):
        raise _none(signal)
    # On each piece v0 + s (t - t0), the derivative is v0' - s t0' + s' (t - t0).
    ends = [] if signal.after == "error" else [(at[0], by_value[0])]
    for i in np.flatnonzero(lengths > 0.0):
        slope = (now[i + 1] - now[i]) / lengths[i]
        ends += [(at[end], by_value[end] - slope * by_time[end]) for end in (i, i + 1)]
    ends += [] if signal.after == "error" else [(at[-1], by_value[-1])]
    ends = [one for i, one in enumerate(ends) if i == 0 or one != ends[i - 1]]
    return Table(
        times=tuple(time for time, _ in ends), values=tuple(value for _, value in ends),
        periodic=signal.periodic, after=signal.after,
    )  # fmt: skip


def rate_of(signal: Any) -> Signal:
    """Derivative of a primitive signal with respect to time, between its jumps."""
    if isinstance(signal, Harmonic):
        size = 2.0 * math.pi * signal.frequency * signal.amplitude
        return Harmonic(size, signal.frequency, signal.phase + 0.5 * math.pi)
    if isinstance(signal, Exponential):
        return signal.growth * signal
    if isinstance(signal, Table):
        at, now = np.array(signal.times), np.array(signal.values)
        kept = np.flatnonzero(np.diff(at) > 0.0)
        slopes = np.repeat(np.diff(now)[kept] / np.diff(at)[kept], 2)
        times = np.stack([at[kept], at[kept + 1]], axis=1).ravel()
        # Beyond its ends a table that is held has the rate 0.
        if signal.after == "hold":
            times, slopes = np.append(times, times[-1]), np.append(slopes, 0.0)
        return Table(
            times=tuple(times), values=tuple(slopes), periodic=signal.periodic, after=signal.after
        )
    if isinstance(signal, Sum):
        return Sum(signals=tuple(rate_of(one) for one in signal.signals))
    if isinstance(signal, Product):
        given = signal.signals
        terms = (
            Product(signals=(*given[:i], rate_of(one), *given[i + 1 :]))
            for i, one in enumerate(given)
        )
        return Sum(signals=tuple(terms))
    if isinstance(signal, Integral):
        return signal.speed
    if isinstance(signal, Orders):
        orders = [(n, n * size, phase + 0.5 * math.pi) for n, size, phase in signal.orders]
        return Product(signals=(signal.speed, Orders(signal.speed, orders)))
    return Constant(0.0)


def _none(signal: Signal) -> Exception:
    return wrong(
        "signal", signal, "a signal with a derivative with respect to the parameter",
        "Times of jumps and of periodic tables have none.",
    )  # fmt: skip
