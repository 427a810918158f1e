"""Steps by series after the fact: the motion inside each, and its derivative.

Sums over a motion and the growth of deviations are computed from the trail that
``trajectory.run`` left. Its steps by series are independent of each other then, so that they
are expanded side by side, in vector lanes; each is cut into ``PARTS``, within which deviations
have a series too:

    J y' + (c + dM/dv) y + k x = 0,  x' = y

with dM/dv from the series of the motion. A record is an array of the outputs of each part of
each step, (rows, DENSE_ROWS, WIDTH); as in ``taylor``, a row of lanes is one vector, and
``DENSE`` names the rows.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wedgebrake.dynamics.actuator import commanded_force
from wedgebrake.dynamics.deviations import Deviations
from wedgebrake.dynamics.jit import chosen_by_class, compiled
from wedgebrake.dynamics.linear_flow import forcing_of
from wedgebrake.solvers.smooth import taylor
from wedgebrake.solvers.smooth.runge_kutta import RungeKutta
from wedgebrake.solvers.smooth.simd_codegen import traced
from wedgebrake.solvers.smooth.steps import Point, Taylor
from wedgebrake.solvers.smooth.taylor import INPUT, INPUT_ROWS, ORDER, OUTPUT, OUTPUT_ROWS

# The series of deviations needs half the step of the motion's: its law is the slope.
PARTS = 2
# Steps side by side: half of the lanes of a motion, as each step has twice the numbers.
WIDTH = 4

_X, _WEIGHT = np.polynomial.legendre.leggauss(4)
NODES, WEIGHTS = 0.5 * (1.0 + _X), 0.5 * _WEIGHT


class _Dense(NamedTuple):
    """Outputs of a part of a step, after those of the step."""

    derivative: Any  # of the end by the begin: angle by angle, angle by velocity, ...
    remainder: Any  # largest of the last terms of the derivative, over the deviation
    nodes: Any  # for each node: angle, velocity, acceleration, brake torque over the inertia


DENSE = _Dense(OUTPUT_ROWS, OUTPUT_ROWS + 4, OUTPUT_ROWS + 5)
DENSE_ROWS = DENSE.nodes + 4 * NODES.size


class SeriesRecord(NamedTuple):
    """Outputs of the parts of the steps of a trail."""

    series: NDArray[np.float64]


class Inside(NamedTuple):
    """A state inside a step, with the torque of the brake [N m]."""

    angle: float
    velocity: float
    acceleration: float
    torque: float


def formula(maths: Any, rows: list[Any]) -> list[Any]:
    """All outputs of a part of a step, whose size is ``longest_size``; for ``traced``."""
    given = taylor.Inputs(*rows)
    series, h = taylor.expand(maths, given), given.longest_size
    _, angles, velocities, accels, gains, _ = series
    nodes = []
    for node in NODES:
        tau = float(node) * h
        angle, velocity, a, gain = angles[ORDER], velocities[ORDER], accels[ORDER - 1], gains[ORDER]
        for n in range(ORDER - 1, -1, -1):
            angle, velocity = angle * tau + angles[n], velocity * tau + velocities[n]
            gain = gain * tau + gains[n]
            if n > 0:
                a = a * tau + accels[n - 1]
        pressed = commanded_force(given.force, given.slope, velocity - given.rest_velocity)
        nodes += [angle, velocity, a, pressed * gain]
    return [*taylor.results(h, series), *_derivative(maths, given, series), *nodes]


def _derivative(maths: Any, given: taylor.Inputs, series: taylor.Series) -> list[Any]:
    """The derivative over a part, row by row, and the size of its last terms."""
    h, velocities, gains, rates = given.longest_size, series.velocities, series.gains, series.rates
    pressed = commanded_force(given.force, given.slope, velocities[0] - given.rest_velocity)
    slopes = []
    for n in range(ORDER):
        moved = gains[n]
        for j in range(1, n + 1):
            moved = moved + velocities[j] * rates[n - j]
        slopes.append(given.slope * moved + pressed * rates[n])
    slopes[0] = slopes[0] + given.damping
    columns, last = [], 0.0
    for x, y, size in ((1.0, 0.0, maths.sqrt(given.stiffness) + 1e-300), (0.0, 1.0, 1.0)):
        xs, ys = [x], [y]
        for n in range(ORDER):
            push = given.stiffness * xs[n]
            for j in range(n + 1):
                push = push + slopes[n - j] * ys[j]
            ys.append(push * (-1.0 / (n + 1.0)))
            xs.append(ys[n] * (1.0 / (n + 1.0)))
        power = 1.0
        for _ in range(ORDER - 1):
            power = power * h
        for n in (ORDER - 1, ORDER):
            last = maths.larger(last, abs(ys[n]) * power / size)
            power = power * h
        x, y = xs[ORDER], ys[ORDER]
        for n in range(ORDER - 1, -1, -1):
            x, y = x * h + xs[n], y * h + ys[n]
        columns.append((x, y))
    (xx, yx), (xy, yy) = columns
    return [xx, xy, yx, yy, last]


_together = traced(formula, INPUT_ROWS, WIDTH)


@compiled
def expand_lanes(inputs, outputs):
    """``formula`` for WIDTH parts."""
    _together(inputs, outputs)


@compiled
def _all_parts(inputs, series, group):
    """Expand the parts of WIDTH steps, at the begins of which the inputs are aimed."""
    for part in range(PARTS):
        outputs = series[PARTS * group + part]
        expand_lanes(inputs, outputs)
        for lane in range(WIDTH):
            inputs[INPUT.angle, lane] = outputs[OUTPUT.angle, lane]
            inputs[INPUT.velocity, lane] = outputs[OUTPUT.velocity, lane]
            inputs[INPUT.drive, lane] = outputs[OUTPUT.drive, lane]
            inputs[INPUT.drive_rate, lane] = outputs[OUTPUT.drive_rate, lane]


@compiled
def _loaded(problem):
    """Inputs of WIDTH lanes with the numbers of a machine."""
    inputs = np.ones((INPUT_ROWS, WIDTH))
    for lane in range(WIDTH):
        taylor.load(problem.driveline, problem.torque, problem.law, inputs, lane)
    return inputs


@compiled
def _aim(problem, stretch, point, size, inputs, lane):
    """Set a part of a size that begins at a point in a stretch."""
    driveline, kinks = problem.driveline, problem.stretches[stretch]
    side = 1.0 if kinks.kink_below >= driveline.rest_velocity else -1.0
    slope = side * problem.law.actuator.slope / driveline.inertia
    taylor.aim(inputs, lane, slope, forcing_of(driveline, problem.torque), point)
    inputs[INPUT.longest_size, lane] = size


@compiled
def _expand(method, problem, trail, left):  # noqa: ARG001 - one signature
    """``SeriesRecord`` of the steps by series among ``left`` rows of a trail."""
    series = np.empty((PARTS * (left // WIDTH + 1), DENSE_ROWS, WIDTH))
    inputs = _loaded(problem)
    number = 0
    for row in trail[:left]:
        if problem.stretches[row.stretch].linear:
            continue
        _aim(problem, row.stretch, row, row.duration / PARTS, inputs, number % WIDTH)
        number += 1
        if number % WIDTH == 0:
            _all_parts(inputs, series, number // WIDTH - 1)
    if number % WIDTH > 0:
        _all_parts(inputs, series, number // WIDTH)
    return SeriesRecord(series)


@compiled
def _same(method, problem, trail, left):  # noqa: ARG001 - one signature
    """The method itself, which steps again."""
    return method


expand_trail = chosen_by_class({Taylor: _expand, RungeKutta: _same})
"""(method, problem, trail, left) -> what the motion inside its steps is computed from."""


@compiled
def at_node(record, row, number, part, node, inertia):  # noqa: ARG001 - one signature
    """``Inside`` at a node of a part of a step, by its number."""
    outputs, lane = record.series[PARTS * (number // WIDTH) + part], number % WIDTH
    first = DENSE.nodes + 4 * node
    torque = inertia * outputs[first + 3, lane]
    return Inside(outputs[first, lane], outputs[first + 1, lane], outputs[first + 2, lane], torque)


@compiled
def inside(record, row, number, tau):
    """``Inside`` of a step, a time tau after it begins; without the torque."""
    part = min(int(PARTS * tau / row.duration), PARTS - 1)
    outputs = record.series[PARTS * (number // WIDTH) + part]
    later = tau - part * row.duration / PARTS
    angle, velocity, a = taylor.state(outputs, number % WIDTH, later)
    return Inside(angle, velocity, a, 0.0)


@compiled
def _multiplied(outputs, lane, deviations):
    """The derivative over a part times deviations."""
    row = DENSE.derivative
    xx, xy = outputs[row, lane], outputs[row + 1, lane]
    yx, yy = outputs[row + 2, lane], outputs[row + 3, lane]
    x1, y1, x2, y2 = deviations
    return Deviations(xx * x1 + xy * y1, yx * x1 + yy * y1, xx * x2 + xy * y2, yx * x2 + yy * y2)


@compiled
def _in_smaller_parts(problem, row, part, outputs, lane, deviations):
    """Deviations through a part that is too long for them, in smaller ones.

    outputs : of the part, in a lane
    """
    rtol, rest = problem.tolerances.relative, row.duration / PARTS
    inputs, smaller = _loaded(problem), np.empty((DENSE_ROWS, WIDTH))
    angle, velocity = outputs[OUTPUT.angles, lane], outputs[OUTPUT.velocities, lane]
    point, size = Point(row.time + part * rest, angle, velocity, 0.0), 0.5 * rest
    while rest > 0.0:
        _aim(problem, row.stretch, point, min(size, rest), inputs, 0)
        expand_lanes(inputs, smaller)
        size, lost = inputs[INPUT.longest_size, 0], smaller[DENSE.remainder, 0]
        following = size * min(2.0, 0.9 * (rtol / (lost + 1e-300)) ** (1.0 / ORDER))
        # Errors that ask for less than a hundredth of the way are rounding: accept them.
        if lost > rtol and size > 0.01 * rest:
            size = max(following, 0.01 * rest)
            continue
        deviations = _multiplied(smaller, 0, deviations)
        angle, velocity = smaller[OUTPUT.angle, 0], smaller[OUTPUT.velocity, 0]
        point = Point(point.time + size, angle, velocity, 0.0)
        rest = rest - size if size < rest else 0.0
        size = following
    return deviations


@compiled
def propagate_step(record, problem, row, number, deviations):
    """Deviations through the step by series of a ``row`` of the trail, by its number."""
    lane = number % WIDTH
    for part in range(PARTS):
        outputs = record.series[PARTS * (number // WIDTH) + part]
        if outputs[DENSE.remainder, lane] <= problem.tolerances.relative:
            deviations = _multiplied(outputs, lane, deviations)
        else:
            deviations = _in_smaller_parts(problem, row, part, outputs, lane, deviations)
    return deviations
