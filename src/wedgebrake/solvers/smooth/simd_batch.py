"""Several smooth motions side by side: steps by series in vector lanes, one system in each.

The motion is that of ``trajectory.run`` by series, for a transient: without log or samples. The
lanes are independent; a lane's numbers depend on nothing in the others. A lane that leaves the
steep layer goes on alone, in closed form, until it is back; then all step together again.
"""

import math

import numpy as np

from wedgebrake.dynamics.enums import Outcome, SearchEnd
from wedgebrake.dynamics.harmonic import Sine, phase_at
from wedgebrake.dynamics.jit import compiled, inlined
from wedgebrake.dynamics.records import record
from wedgebrake.dynamics.section import phase_at_return
from wedgebrake.solvers.smooth import taylor
from wedgebrake.solvers.smooth.problem import Tolerances, stretch_at
from wedgebrake.solvers.smooth.simd_codegen import traced
from wedgebrake.solvers.smooth.steps import FIRST_STEP, Limits, Point, arrived, linear_step
from wedgebrake.solvers.smooth.taylor import INPUT, INPUT_ROWS, OUTPUT, OUTPUT_ROWS
from wedgebrake.solvers.smooth.trajectory import TINY

WIDTH = 8

# Numbers of a system; torque and slope of the actuation force over the inertia.
SYSTEM = (
    "forcing angular_frequency period slope band divergence_velocity relative_tolerance"
    " angle_tolerance velocity_tolerance longest_step"
)
# A lane: its system, and how far it has come. Its state is in the inputs of steps. ``stalled``:
# the last step had no length; ``stepped``: a step in lanes is to be accepted.
LANE = record(
    SYSTEM + " time",
    whole="stretch outcome completed steps",
    fields=[("stalled", np.bool_), ("stepped", np.bool_), ("going", np.bool_)],
)

_together = traced(taylor.formula, INPUT_ROWS, WIDTH)


@compiled
def step_lanes(inputs, outputs):
    """One step of all lanes."""
    _together(inputs, outputs)


@inlined
def _forcing(lane):
    """The torque of a lane over its inertia."""
    return Sine(lane.forcing, lane.angular_frequency)


@compiled
def _begin(lane, number, stretches, inputs):
    """Set a lane at the phase 0 of the torque."""
    velocity, forcing = inputs[INPUT.velocity, number], _forcing(lane)
    side = math.copysign(1.0, velocity - inputs[INPUT.rest_velocity, number])
    inputs[INPUT.slope, number] = side * lane.slope
    inputs[INPUT.last_size, number] = FIRST_STEP * lane.longest_step
    taylor.drive(inputs, number, forcing, phase_at_return())
    a = taylor.acceleration(inputs, number)
    force = inputs[INPUT.drive_rate, number] - inputs[INPUT.stiffness, number] * velocity
    lane.stretch = stretch_at(stretches, velocity, a > 0.0 or (a == 0.0 and force > 0.0))
    lane.going = True


@inlined
def _accept(lane, number, stretch, inputs, outputs):
    """Accept a step in lanes: (end, acceleration); ends the lane where it was too small."""
    low, high = stretch.kink_below, stretch.kink_above
    limits = Limits(lane.period, low, high, TINY * lane.period, lane.stalled)
    size, hit, a = taylor.accept(inputs, outputs, number, limits)
    lane.stepped, lane.stalled = False, size == 0.0
    if size < 0.0:
        lane.outcome, lane.going = Outcome.STEP_LIMIT, False
        return hit, a
    lane.time = arrived(lane.time, size, limits)
    if hit == SearchEnd.TIME:
        inputs[INPUT.drive, number] = outputs[OUTPUT.drive, number]
        inputs[INPUT.drive_rate, number] = outputs[OUTPUT.drive_rate, number]
    elif size > 0.0:
        taylor.drive(inputs, number, _forcing(lane), phase_at(_forcing(lane), lane.time))
    return hit, a


@compiled
def _alone(lane, number, stretch, piece, inputs, max_steps):
    """Move a lane through a linear stretch, in closed form: (end, acceleration)."""
    forcing = _forcing(lane)
    point = Point(lane.time, inputs[INPUT.angle, number], inputs[INPUT.velocity, number], 0.0)
    made = linear_step(
        stretch, piece, forcing, point, lane.period, lane.divergence_velocity,
        max_steps - lane.steps,
    )  # fmt: skip
    lane.steps += made.work
    lane.outcome, lane.going = made.outcome, made.outcome == Outcome.COMPLETED
    lane.time = made.point.time
    inputs[INPUT.angle, number] = made.point.angle
    inputs[INPUT.velocity, number] = made.point.velocity
    taylor.drive(inputs, number, forcing, phase_at(forcing, lane.time))
    return made.hit, made.point.acceleration


@inlined
def _go_on(lane, number, stretch, stretches, hit, a, inputs, max_steps):
    """Decide how a lane goes on after a step: not at all, or in which stretch."""
    velocity = inputs[INPUT.velocity, number]
    speed = abs(velocity - inputs[INPUT.rest_velocity, number])
    if lane.steps > max_steps:
        lane.outcome, lane.going = Outcome.STEP_LIMIT, False
    elif not speed < lane.divergence_velocity:
        lane.outcome, lane.going = Outcome.DIVERGED, False
    elif hit != SearchEnd.TIME:
        lane.stretch = stretch_at(stretches[number], velocity, hit == SearchEnd.HIT_HIGH)
    elif not stretch.linear and not stretch.low < velocity < stretch.high:
        lane.stretch = stretch_at(stretches[number], velocity, a > 0.0)


@compiled
def _return(lane, number, inputs, points):
    """Record the return of a lane to the section; the lane ends with its last period."""
    lane.completed += 1
    lane.time = 0.0
    taylor.drive(inputs, number, _forcing(lane), phase_at_return())
    points[number, lane.completed, 0] = inputs[INPUT.angle, number]
    points[number, lane.completed, 1] = inputs[INPUT.velocity, number]
    lane.going = lane.completed < points.shape[1] - 1


@inlined
def _aim(lane, number, stretch, inputs):
    """Prepare the next step of a lane."""
    side = 1.0 if stretch.kink_below >= inputs[INPUT.rest_velocity, number] else -1.0
    inputs[INPUT.slope, number] = side * lane.slope
    tolerances = Tolerances(lane.relative_tolerance, lane.angle_tolerance, lane.velocity_tolerance)
    longest = min(lane.longest_step, lane.period - lane.time)
    taylor.limit(inputs, number, tolerances, longest, lane.band)
    lane.stepped = True
    lane.steps += 1


@compiled
def run(lanes, stretches, pieces, inputs, max_steps, points):
    """Advance WIDTH systems from the phase 0, as many periods as ``points`` has room for.

    lanes     : (WIDTH,) of dtype ``LANE``, the system set and the rest 0
    stretches, pieces : (WIDTH, n), as in ``SmoothProblem``
    inputs    : (INPUT_ROWS, WIDTH) with systems and states; receives the states at the end
    points    : (WIDTH, periods + 1, 2) states at the beginning of each period; the first is given
    """
    outputs = np.zeros((OUTPUT_ROWS, WIDTH))
    for number in range(WIDTH):
        _begin(lanes[number], number, stretches[number], inputs)
    together = True
    while together:
        together = False
        for number in range(WIDTH):
            lane = lanes[number]
            while lane.going:
                stretch = stretches[number, lane.stretch]
                if stretch.linear:
                    piece = pieces[number, lane.stretch]
                    hit, a = _alone(lane, number, stretch, piece, inputs, max_steps)
                elif lane.stepped:
                    hit, a = _accept(lane, number, stretch, inputs, outputs)
                else:
                    _aim(lane, number, stretch, inputs)
                    together = True
                    break
                if lane.going:
                    _go_on(lane, number, stretch, stretches, hit, a, inputs, max_steps)
                if lane.going and lane.time >= lane.period:
                    _return(lane, number, inputs, points)
        if together:
            step_lanes(inputs, outputs)
