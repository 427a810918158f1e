"""Series steps seen again: the derivative of each, and the motion inside.

What a motion adds up to and how deviations grow is asked of the trail that ``smooth.run`` left.
Its series steps know nothing of each other any more, so they are expanded side by side, in
vector lanes; each is cut in ``PARTS``, within which deviations have a series too:

    J y' + (c + dM/dv) y + k x = 0,  x' = y

with dM/dv from the series of the motion. ``record`` holds ``OUTPUTS`` for each part of each step.
"""

import numpy as np

from wedgebrake.dynamics.jit import compiled
from wedgebrake.solvers.smooth.simd_codegen import traced
from wedgebrake.solvers.smooth.taylor import (
    ACCELS,
    DAMPING,
    DRIVE,
    DRIVE1,
    FORCE,
    INPUTS,
    LONGEST,
    ORDER,
    RATE,
    RATE1,
    REST,
    SLOPE,
    STIFFNESS,
    THETA,
    THETA1,
    THETAS,
    W1,
    WS,
    W,
    aim,
    expand,
    load,
    results,
    state,
)
from wedgebrake.solvers.smooth.trajectory import (
    TRAIL_SIZE,
    TRAIL_STRETCH,
    TRAIL_THETA,
    TRAIL_TIME,
    TRAIL_W,
)

# A series of deviations gets along with half of what the motion's does: its law is the slope.
PARTS = 2
# Steps side by side: half of the lanes of a motion, as each step has twice the numbers.
WIDTH = 4

_X, _WEIGHT = np.polynomial.legendre.leggauss(4)
NODES, WEIGHTS = 0.5 * (1.0 + _X), 0.5 * _WEIGHT

# After the outputs of the step: the derivative of its end by its beginning, row by row, what the
# last terms of that are (over the deviation), and at each node theta, w, w' and torque over J.
_DERIVATIVE = ACCELS + ORDER
_LAST = _DERIVATIVE + 4
_LOOKS = _LAST + 1
OUTPUTS = _LOOKS + 4 * NODES.size


def formula(maths, get):
    """All outputs of a part of a step, whose size is the input LONGEST; for ``trace``."""
    drive, thetas, ws, accels, gains, rates = expand(maths, get)
    h, slope = get(LONGEST), get(SLOPE)
    looks = []
    for node in NODES:
        tau = float(node) * h
        theta, w, a, gain = thetas[ORDER], ws[ORDER], accels[ORDER - 1], gains[ORDER - 1]
        for n in range(ORDER - 1, -1, -1):
            theta, w = theta * tau + thetas[n], w * tau + ws[n]
            if n > 0:
                a, gain = a * tau + accels[n - 1], gain * tau + gains[n - 1]
        looks += [theta, w, a, (get(FORCE) + slope * (w - get(REST))) * gain]
    derivative = _derivative(maths, get, ws, gains, rates)
    return [*results(h, drive, thetas, ws, accels), *derivative, *looks]


def _derivative(maths, get, ws, gains, rates):
    """The derivative over a part, row by row, and how large its last terms are."""
    h, slope = get(LONGEST), get(SLOPE)
    pressed = get(FORCE) + slope * (ws[0] - get(REST))
    slopes = []
    for n in range(ORDER):
        moved = gains[n]
        for j in range(1, n + 1):
            moved = moved + ws[j] * rates[n - j]
        slopes.append(slope * moved + pressed * rates[n])
    slopes[0] = slopes[0] + get(DAMPING)
    columns, last = [], 0.0
    for x, y, size in ((1.0, 0.0, maths.sqrt(get(STIFFNESS)) + 1e-300), (0.0, 1.0, 1.0)):
        xs, ys = [x], [y]
        for n in range(ORDER):
            push = get(STIFFNESS) * xs[n]
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


_together = traced(formula, WIDTH)


@compiled
def expand_lanes(inputs, outputs):
    """``formula`` for WIDTH parts."""
    _together(inputs, outputs)


@compiled
def _all_parts(inputs, record, group):
    """The parts of WIDTH steps, the first of which are aimed at."""
    for part in range(PARTS):
        outputs = record[PARTS * group + part]
        expand_lanes(inputs, outputs)
        for lane in range(WIDTH):
            inputs[THETA, lane], inputs[W, lane] = outputs[THETA1, lane], outputs[W1, lane]
            inputs[DRIVE, lane], inputs[RATE, lane] = outputs[DRIVE1, lane], outputs[RATE1, lane]


@compiled
def room_for(steps):
    """Rows of a record of so many steps."""
    return PARTS * (steps // WIDTH + 1)


@compiled
def see(plant, law, kinks, linear, trail, left, record):
    """Expand the series steps among ``left`` rows of a trail into ``record``.

    plant, law, kinks, linear : as for ``smooth.run``
    record : (room_for(left), OUTPUTS, WIDTH)
    """
    inputs = np.ones((INPUTS, WIDTH))
    for lane in range(WIDTH):
        load(plant, law, inputs, lane)
    number = 0
    for i in range(left):
        stretch = int(trail[i, TRAIL_STRETCH])
        if linear[stretch]:
            continue
        side, lane = 1.0 if kinks[stretch, 0] >= plant[5] else -1.0, number % WIDTH
        t, theta, w = trail[i, TRAIL_TIME], trail[i, TRAIL_THETA], trail[i, TRAIL_W]
        aim(plant, law, side, t, theta, w, inputs, lane)
        inputs[LONGEST, lane] = trail[i, TRAIL_SIZE] / PARTS
        number += 1
        if lane == WIDTH - 1:
            _all_parts(inputs, record, number // WIDTH - 1)
    if number % WIDTH > 0:
        _all_parts(inputs, record, number // WIDTH)


@compiled
def look(record, number, part, node):
    """(theta, w, w', torque over J) at a node of a part of a step, by its number."""
    outputs, lane = record[PARTS * (number // WIDTH) + part], number % WIDTH
    row = _LOOKS + 4 * node
    return (
        outputs[row, lane],
        outputs[row + 1, lane],
        outputs[row + 2, lane],
        outputs[row + 3, lane],
    )


@compiled
def inside(record, number, size, tau):
    """(theta, w, w') in a step of a size, a time tau after it begins."""
    part = min(int(PARTS * tau / size), PARTS - 1)
    outputs = record[PARTS * (number // WIDTH) + part]
    return state(outputs, number % WIDTH, tau - part * size / PARTS)


@compiled
def _multiply(outputs, lane, matrix):
    """``matrix`` becomes the derivative over a part times itself."""
    xx, xy = outputs[_DERIVATIVE, lane], outputs[_DERIVATIVE + 1, lane]
    yx, yy = outputs[_DERIVATIVE + 2, lane], outputs[_DERIVATIVE + 3, lane]
    for j in range(2):
        x, y = matrix[0, j], matrix[1, j]
        matrix[0, j], matrix[1, j] = xx * x + xy * y, yx * x + yy * y


@compiled
def _again(plant, law, side, t, theta, w, rest, rtol, matrix):
    """Deviations through a part that is too long for them, in smaller ones."""
    inputs, outputs = np.ones((INPUTS, WIDTH)), np.empty((OUTPUTS, WIDTH))
    for lane in range(WIDTH):
        load(plant, law, inputs, lane)
    size = 0.5 * rest
    while rest > 0.0:
        aim(plant, law, side, t, theta, w, inputs, 0)
        inputs[LONGEST, 0] = min(size, rest)
        expand_lanes(inputs, outputs)
        size, lost = inputs[LONGEST, 0], outputs[_LAST, 0]
        following = size * min(2.0, 0.9 * (rtol / (lost + 1e-300)) ** (1.0 / ORDER))
        # What asks for more than a hundredth of the way is rounding: gone all the same.
        if lost > rtol and size > 0.01 * rest:
            size = max(following, 0.01 * rest)
            continue
        _multiply(outputs, 0, matrix)
        theta, w = outputs[THETA1, 0], outputs[W1, 0]
        t += size
        rest = rest - size if size < rest else 0.0
        size = following


@compiled
def carry(plant, law, rtol, kinks, row, record, number, matrix):
    """``matrix``, deviations in its columns, through a step that a ``row`` of the trail tells."""
    lane, part_size = number % WIDTH, row[TRAIL_SIZE] / PARTS
    for part in range(PARTS):
        outputs = record[PARTS * (number // WIDTH) + part]
        if outputs[_LAST, lane] <= rtol:
            _multiply(outputs, lane, matrix)
            continue
        side = 1.0 if kinks[int(row[TRAIL_STRETCH]), 0] >= plant[5] else -1.0
        theta, w = outputs[THETAS, lane], outputs[WS, lane]
        t = row[TRAIL_TIME] + part * part_size
        _again(plant, law, side, t, theta, w, part_size, rtol, matrix)
