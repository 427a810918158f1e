"""Several smooth motions side by side: series steps in vector lanes, one system in each.

What ``smooth.run`` does with series, for a transient: no log, no looking. The lanes are
independent; a lane's numbers depend on nothing in the others. A lane that leaves the steep
layer goes on alone, in closed form, until it is back; then all step together again.
"""

import math

import numpy as np

from wedgebrake.dynamics.enums import FlowForm, Outcome, SearchEnd
from wedgebrake.dynamics.harmonic import Harmonic, phase_at, rate, value
from wedgebrake.dynamics.jit import compiled
from wedgebrake.dynamics.linear_flow import acceleration as linear_acceleration
from wedgebrake.solvers.event_driven.event_search import Motion, slip
from wedgebrake.solvers.smooth.simd_codegen import traced
from wedgebrake.solvers.smooth.taylor import (
    A1,
    ACCELS,
    DRIVE,
    DRIVE1,
    INPUTS,
    LAST,
    LONGEST,
    OUTPUTS,
    RATE,
    RATE1,
    SIZE,
    SLOPE,
    THETA,
    THETA1,
    W1,
    W,
    acceleration,
    crossing,
    formula,
    limit,
    load,
    state,
)
from wedgebrake.solvers.smooth.trajectory import POLE, SERIES_SHARE, stretch_at

WIDTH = 8

_together = traced(formula, WIDTH)


@compiled
def step_lanes(inputs, outputs):
    """One step of all lanes."""
    _together(inputs, outputs)


@compiled
def _alone(plant, edges, piece, stretch, w_diverged, inputs, lane, t, t_end, max_steps):
    """A lane through a linear stretch, in closed form: (what, t, a, steps); its w is changed."""
    forcing = Harmonic(plant[3] / plant[0], plant[4])
    theta, w = inputs[THETA, lane], inputs[W, lane]
    low = edges[stretch - 1] if stretch > 0 else -math.inf
    high = edges[stretch] if stretch < edges.size else math.inf
    if piece.damping < 0.0:
        low, high = max(low, -w_diverged), min(high, w_diverged)
    phase = phase_at(forcing, t)
    a = linear_acceleration(piece, forcing, theta, w, phase)
    start = Motion(t, phase, theta, w, a)
    hit, (t, phase, theta, w, a), spent = slip(piece, forcing, low, high, start, t_end, max_steps)
    inputs[THETA, lane], inputs[W, lane] = theta, w
    inputs[DRIVE, lane], inputs[RATE, lane] = value(forcing, phase), rate(forcing, phase)
    return hit, t, a, spent


@compiled
def _stepped(plants, lane, low, high, outputs, tiny, stalled, inputs, t):
    """A lane after a step in lanes, cut at a kink: (what, size, a); its state is changed.

    size : negative where the step was below ``tiny``
    """
    h = outputs[SIZE, lane]
    if not h >= min(tiny, inputs[LONGEST, lane]):
        return SearchEnd.TIME, -1.0, 0.0
    inputs[LAST, lane] = max(h, 1e-3 * inputs[LAST, lane])
    size, hit = crossing(outputs, lane, low, high, tiny)
    if hit == SearchEnd.TIME or (stalled and size <= tiny):
        inputs[THETA, lane], inputs[W, lane] = outputs[THETA1, lane], outputs[W1, lane]
        inputs[DRIVE, lane], inputs[RATE, lane] = outputs[DRIVE1, lane], outputs[RATE1, lane]
        return SearchEnd.TIME, h, outputs[A1, lane]
    inputs[W, lane] = low if hit == SearchEnd.HIT_LOW else high
    if size <= tiny:
        return hit, 0.0, outputs[ACCELS, lane]
    inputs[THETA, lane], _, a = state(outputs, lane, size)
    f, omega = plants[lane, 3] / plants[lane, 0], plants[lane, 4]
    inputs[DRIVE, lane] = f * math.sin(omega * (t + size))
    inputs[RATE, lane] = f * omega * math.cos(omega * (t + size))
    return hit, size, a


@compiled
def _begin(plant, law, edges, h_max, state_, inputs, lane):
    """Load a system and its state at the phase 0 into a lane: the stretch that it is in."""
    load(plant, law, inputs, lane)
    inputs[THETA, lane], inputs[W, lane] = state_[0], state_[1]
    f, omega, w2 = plant[3] / plant[0], plant[4], plant[2] / plant[0]
    inputs[DRIVE, lane], inputs[RATE, lane] = 0.0, f * omega
    inputs[LAST, lane] = 1e-2 * h_max
    side = 1.0 if state_[1] >= plant[5] else -1.0
    a = acceleration(plant, law, side, 0.0, state_[0], state_[1])
    rising = a > 0.0 or (a == 0.0 and f * omega > w2 * state_[1])
    return stretch_at(edges, state_[1], rising)


@compiled
def run(
    plants, laws, edges, kinks, linear, table, bands, w_diverged, tolerances, h_max, states,
    max_steps, points, outcomes, done, steps,
):  # fmt: skip
    """Advance WIDTH systems, each as many periods as ``points`` has room for.

    plants (WIDTH, 6), laws (WIDTH, 8), edges (WIDTH, n - 1), kinks (WIDTH, n, 2),
    linear (WIDTH, n), table (WIDTH, n, flow.COLUMNS), bands, w_diverged, h_max (WIDTH,),
    tolerances (WIDTH, 3): as for ``smooth.run``; edges that a system lacks are inf
    states   : (WIDTH, 2) at the phase 0, receives those at the end
    points   : (WIDTH, periods + 1, 2) receives the states at the beginnings of the periods
    outcomes, done, steps : (WIDTH,) receive the codes, completed periods, steps
    """
    inputs, outputs = np.zeros((INPUTS, WIDTH)), np.zeros((OUTPUTS, WIDTH))
    t, stretch, going = np.zeros(WIDTH), np.zeros(WIDTH, np.int64), np.ones(WIDTH, np.bool_)
    stalled = np.zeros(WIDTH, np.bool_)
    count = points.shape[1] - 1
    for lane in range(WIDTH):
        stretch[lane] = _begin(
            plants[lane], laws[lane], edges[lane], h_max[lane], states[lane], inputs, lane
        )  # fmt: skip
        points[lane, 0, 0], points[lane, 0, 1] = states[lane, 0], states[lane, 1]
        outcomes[lane], done[lane], steps[lane] = Outcome.COMPLETED, 0, 0
    together = WIDTH
    while together > 0:
        together = 0
        for lane in range(WIDTH):
            # By numbers, not by slices, which cost more than what is done with them.
            rest, length = plants[lane, 5], 2.0 * math.pi / plants[lane, 4]
            tiny = 1e-15 * length
            # What came of the step in lanes, and then alone until the next one.
            fresh = steps[lane] > 0 and going[lane]
            while going[lane]:
                here = stretch[lane]
                t0 = t[lane]
                hit, a = SearchEnd.TIME, 0.0
                if not linear[lane, here]:
                    if not fresh:
                        break
                    hit, size, a = _stepped(
                        plants, lane, kinks[lane, here, 0], kinks[lane, here, 1], outputs, tiny,
                        stalled[lane], inputs, t0,
                    )  # fmt: skip
                    stalled[lane] = size == 0.0
                    if size < 0.0:
                        outcomes[lane], going[lane] = Outcome.STEP_LIMIT, False
                        break
                    t[lane] = length if length - t0 - size <= 4e-16 * length else t0 + size
                else:
                    row = table[lane, here]
                    if row.form == FlowForm.BLOCKED:
                        outcomes[lane], going[lane] = Outcome.NO_FORWARD_SOLUTION, False
                        break
                    hit, t[lane], a, spent = _alone(
                        plants[lane], edges[lane], row, here, w_diverged[lane], inputs, lane, t0,
                        length, max_steps - steps[lane],
                    )  # fmt: skip
                    steps[lane] += max(spent, 1)
                fresh = False
                w = inputs[W, lane]
                if hit == SearchEnd.WORK_LIMIT or steps[lane] > max_steps:
                    outcomes[lane], going[lane] = Outcome.STEP_LIMIT, False
                elif not math.isfinite(w) or abs(w - rest) >= w_diverged[lane]:
                    outcomes[lane], going[lane] = Outcome.DIVERGED, False
                elif hit != SearchEnd.TIME:
                    stretch[lane] = stretch_at(edges[lane], w, hit == SearchEnd.HIT_HIGH)
                elif not linear[lane, here]:
                    inside = here == 0 or w > edges[lane, here - 1]
                    if not (inside and (here == edges.shape[1] or w < edges[lane, here])):
                        stretch[lane] = stretch_at(edges[lane], w, a > 0.0)
                if going[lane] and t[lane] >= length:
                    done[lane] += 1
                    t[lane], inputs[DRIVE, lane] = 0.0, 0.0
                    inputs[RATE, lane] = plants[lane, 3] / plants[lane, 0] * plants[lane, 4]
                    points[lane, done[lane], 0] = inputs[THETA, lane]
                    points[lane, done[lane], 1] = w
                    going[lane] = done[lane] < count
            if going[lane]:
                w, here = inputs[W, lane], stretch[lane]
                side = 1.0 if kinks[lane, here, 0] >= rest else -1.0
                inputs[SLOPE, lane] = side * laws[lane, 7] / plants[lane, 0]
                limit(
                    (tolerances[lane, 0], tolerances[lane, 1], tolerances[lane, 2]),
                    min(h_max[lane], length - t[lane]),
                    SERIES_SHARE * (abs(w - rest) + POLE * bands[lane]), inputs, lane,
                )  # fmt: skip
                steps[lane] += 1
                together += 1
        if together > 0:
            step_lanes(inputs, outputs)
    for lane in range(WIDTH):
        states[lane, 0], states[lane, 1] = inputs[THETA, lane], inputs[W, lane]
