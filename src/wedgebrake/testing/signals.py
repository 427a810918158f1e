"""Checks of signals: values, bound, knots, integral, period, and the solver against the values."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from wedgebrake.arrays import FloatArray
from wedgebrake.errors import InputError
from wedgebrake.model.machine import Machine
from wedgebrake.model.machine_parts import Inertia, Torque
from wedgebrake.model.signals.signal_tables import Table
from wedgebrake.model.signals.signals import (
    Constant,
    Exponential,
    Harmonic,
    Orders,
    Product,
    Signal,
    Sum,
)
from wedgebrake.model.validation import check_instance
from wedgebrake.solvers.simulate import simulate
from wedgebrake.testing.parts import check_part, claim

_PRIMITIVE = (Constant, Exponential, Harmonic, Table, Orders, Product, Sum)
_SAMPLES = 997  # times at which a signal is evaluated
_MOST_KNOTS = 200  # within the times that are checked
_PERIODS = 5.25  # at most
# Cells of this many radians of the stated rate: their error is rounding with 16 points, and not if
# the signal varies twice as fast.
_CELL, _MOST_CELLS = 14.0, 16
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(16)
# Largest differences, relative to the bound.
_ROUNDING, _OF_INTEGRAL, _OF_MOTION = 1e-11, 1e-9, 1e-8
_BESIDE = 1e-9  # relative distance from a knot of the values before and after it
_LARGEST_INERTIA, _SMALLEST_INERTIA = 1e12, 1e-12


def check_signal(signal: Signal) -> None:
    """Check a signal: its values as a part, and that what it states of itself is true.

    - ``primitive`` gives the same values, composed of the kinds that the solver knows.
    - Values are finite, of the shape of the times, and at most ``bound`` in magnitude.
    - Between the ``knots`` the signal is analytic, with angular frequencies up to ``rate``; at a
      jump it has the value before or after it.
    - ``integral`` is 0 at time 0 and has the signal as its derivative.
    - A signal that does not ``vary`` has one value; the values repeat after a ``period``.
    - Sums and products with numbers have the values that they should have.
    - A free inertia on which it acts as a torque has the speed that its integral gives.

    Raises ``AssertionError`` for a signal that does not, ``InputError`` for what is no signal.
    """
    check_instance("signal", signal, Signal, "a signal")
    check_part(signal)
    name = type(signal).__name__
    _check_primitive(name, signal)
    first, last = _window(signal)
    times = np.linspace(first, last, _SAMPLES)
    values = signal(times)
    bound = signal.bound
    claim(values.shape == times.shape, f"{name}: must give values of the shape of the times.")
    claim(np.ndim(signal(first)) == 0, f"{name}: must give one value for one time.")
    claim(np.all(np.isfinite(values)), f"{name}: must have finite values.")
    claim(
        np.all(np.abs(values) <= bound * (1.0 + _ROUNDING)),
        f"{name}.bound = {bound!r}: must be at least {np.max(np.abs(values))!r}, the largest"
        " magnitude.",
    )
    _check_same(f"{name}.primitive()", signal.primitive()(times), values, bound)
    if not signal.varies:
        _check_same(f"{name}.varies is False", values, np.full_like(values, values[0]), bound)
    _check_same(f"2 {name} - 1", (2.0 * signal - 1.0)(times), 2.0 * values - 1.0, bound + 1.0)
    before = max(signal.span[0], first - 0.4 * (last - first))
    _check_knots(name, signal, before, last)
    _check_integral(name, signal, before, last)
    if signal.period:
        later = times + signal.period
        known = later <= signal.span[1]
        at = later[known] if signal.varies else times
        near = _near(at, signal, first, last + signal.period)
        found, expected = signal(at[~near]), (values[known] if signal.varies else values)[~near]
        _check_same(f"{name}.period = {signal.period!r}", found, expected, 1e3 * bound)
    _check_motion(name, signal, first, last)


def _check_primitive(name: str, signal: Signal) -> None:
    primitive = signal.primitive()
    waiting = [primitive]
    while waiting:
        one = waiting.pop()
        claim(
            type(one) in _PRIMITIVE,
            f"{name}.primitive(): must be composed of Constant, Harmonic, Table, Orders, sums and"
            f" products, but has a {type(one).__name__}; take its primitive().",
        )
        waiting += getattr(one, "signals", ())
        waiting += [one.speed] if isinstance(one, Orders) else []
    claim(
        primitive.primitive() == primitive,
        f"{name}.primitive(): must be its own primitive, not {primitive!r}.",
    )


def _window(signal: Signal) -> tuple[float, float]:
    """Times within the span of a signal, from 0 on if it is known there, in which it varies."""
    first, last = signal.span
    first = max(0.0, first)
    if math.isfinite(last):
        length = last - first
    elif signal.period:
        length = _PERIODS * signal.period
    else:
        length = 1.0
    if signal.rate > 0.0:
        length = min(length, _MOST_CELLS * _CELL / signal.rate)
    while signal.knots(first, first + length).size > _MOST_KNOTS:
        length *= 0.5
    return first, first + length


def _edges(signal: Signal, first: float, last: float) -> FloatArray:
    """The knots and the ends of an interval, divided into cells."""
    edges = np.union1d([first, last], signal.knots(first, last))
    counts = np.maximum(np.ceil(signal.rate / _CELL * np.diff(edges)), 1.0).astype(int)
    cells = [
        np.linspace(*ends, count + 1)[1:]
        for ends, count in zip(pairwise(edges), counts, strict=True)
    ]
    return np.concatenate([[first], *cells])


def _areas(signal: Signal, edges: FloatArray) -> FloatArray:
    """Integrals over cells, by 16 Gauss-Legendre points in each."""
    half = 0.5 * np.diff(edges)[:, None]
    return np.asarray((signal(edges[:-1, None] + half * (1.0 + _NODES)) @ _WEIGHTS) * half[:, 0])


def _check_knots(name: str, signal: Signal, first: float, last: float) -> None:
    knots = signal.knots(first, last)
    claim(
        np.all(np.diff(knots) > 0.0) and np.all((first < knots) & (knots < last)),
        f"{name}.knots({first:g}, {last:g}): must ascend between these times, not {knots}.",
    )
    if knots.size:
        gap = np.min(np.diff([first, *knots, last]))
        found = signal(knots)
        before, after = (signal(knots + side * _BESIDE * gap) for side in (-1.0, 1.0))
        # Rounding of a repeated knot decides on which side of a jump it lies.
        nearer = np.where(np.abs(found - before) < np.abs(found - after), before, after)
        _check_same(f"{name} at its knots", found, nearer, 1e4 * signal.bound)
    edges = _edges(signal, first, last)
    halves = np.sort(np.concatenate([edges, 0.5 * (edges[:-1] + edges[1:])]))
    whole, fine = _areas(signal, edges), _areas(signal, halves).reshape(-1, 2).sum(axis=1)
    error = np.abs(whole - fine) / np.diff(edges)
    at = int(np.argmax(error))
    claim(
        error[at] <= _OF_INTEGRAL * signal.bound,
        f"{name}: is not analytic, or varies faster than rate = {signal.rate!r}, between"
        f" {edges[at]!r} s and {edges[at + 1]!r} s. Give the times of jumps and bends in knots.",
    )


def _check_integral(name: str, signal: Signal, first: float, last: float) -> None:
    if not signal.span[0] <= 0.0 <= signal.span[1]:
        return
    claim(signal.integral(0.0) == 0.0, f"{name}.integral(0.0): must be 0.")
    edges = _edges(signal, first, last)
    expected = np.concatenate([[0.0], np.cumsum(_areas(signal, edges))])
    found = signal.integral(edges) - signal.integral(first)
    scale = signal.bound * (last - first)
    error = np.abs(found - expected)
    at = int(np.argmax(error))
    claim(
        error[at] <= _OF_INTEGRAL * scale,
        f"{name}.integral({edges[at]!r}): must be {expected[at]!r} by quadrature of the values, not"
        f" {found[at]!r}.",
    )


def _near(times: FloatArray, signal: Signal, first: float, last: float) -> NDArray[np.bool_]:
    """Which times lie so near to a knot that rounding decides on which side of a jump."""
    knots = np.concatenate([[first, last], signal.knots(first, last)])
    return np.asarray(
        np.min(np.abs(times[:, None] - knots), axis=1, initial=math.inf) <= 1e-9 * (last - first)
    )


def _check_same(what: str, found: FloatArray, expected: FloatArray, bound: float) -> None:
    error = np.abs(found - expected)
    at = int(np.argmax(error)) if error.size else 0
    claim(
        not error.size or error[at] <= _ROUNDING * bound,
        f"{what}: must be {expected[at] if error.size else 0.0!r}, not"
        f" {found[at] if error.size else 0.0!r}.",
    )


def _check_motion(name: str, signal: Signal, first: float, last: float) -> None:
    """Compare the speed of a free inertia with the integral of the torque on it."""
    scale = signal.bound * (last - first)
    inertia = min(max(scale, _SMALLEST_INERTIA), _LARGEST_INERTIA)
    machine = Machine(inertias=[Inertia("disc", inertia)], torques=[Torque("disc", signal)])
    times = np.linspace(first, last, 9)[1:]
    try:
        found = simulate(machine, last - first, times=times, start_time=first)
    except InputError as error:
        raise AssertionError(f"{name}: the solver of machines refuses it. {error}") from None
    for time, speed in zip(times, found["velocity"].values[:, 0], strict=True):
        expected = float(np.sum(_areas(signal, _edges(signal, first, float(time))))) / inertia
        claim(
            abs(speed - expected) <= _OF_MOTION * scale / inertia,
            f"{name}: as the torque on a free inertia of {inertia!r} kg m^2 it must give"
            f" {expected!r} rad/s at {time!r} s, but the solver gives {speed!r} rad/s.",
        )
