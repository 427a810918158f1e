"""Several smooth motions side by side: steps by series in vector lanes, one system in each.

The motion is that of ``trajectory.run`` by series, for a transient: without log or samples. The
lanes are independent; a lane's numbers depend on nothing in the others. A lane that leaves the
steep layer goes on alone, in closed form, until it is back; then all step together again.
"""

import math

import numpy as np

from wedgebrake.dynamics.enums import Outcome, SearchEnd
from wedgebrake.dynamics.harmonic import Harmonic, phase_at
from wedgebrake.dynamics.jit import compiled
from wedgebrake.dynamics.records import record
from wedgebrake.dynamics.section import phase_at_return
from wedgebrake.solvers.smooth import taylor
from wedgebrake.solvers.smooth.problem import POLE, Tolerances, stretch_at
from wedgebrake.solvers.smooth.simd_codegen import traced
from wedgebrake.solvers.smooth.steps import FIRST_STEP, Limits, Point, linear_step
from wedgebrake.solvers.smooth.taylor import INPUT, INPUT_ROWS, OUTPUT, OUTPUT_ROWS
from wedgebrake.solvers.smooth.trajectory import TINY

WIDTH = 8

# A lane: its system (torque, slope of the actuation force and stiffness over the inertia), and
# how far it has come. Angle and velocity are in the inputs of steps. ``stalled``: the last step
# had no length; ``stepped``: a step in lanes is to be accepted.
LANE = record(
    "forcing angular_frequency period slope stiffness rest_velocity band divergence_velocity"
    " relative_tolerance angle_tolerance velocity_tolerance longest_step time",
    whole="stretch outcome completed steps",
    fields=[("stalled", np.bool_), ("stepped", np.bool_), ("going", np.bool_)],
)

_together = traced(taylor.formula, INPUT_ROWS, WIDTH)


@compiled
def step_lanes(inputs, outputs):
    """One step of all lanes."""
    _together(inputs, outputs)


@compiled
def _harmonic(lane):
    """The torque of a lane over its inertia."""
    return Harmonic(lane.forcing, lane.angular_frequency)


@compiled
def _begin(lane, stretches, acceleration, velocity):
    """Set a lane at the phase 0, where it has an acceleration."""
    force = lane.forcing * lane.angular_frequency
    rising = acceleration > 0.0
    if acceleration == 0.0:
        rising = force > lane.stiffness * velocity
    lane.stretch = stretch_at(stretches, velocity, rising)
    lane.time, lane.stalled, lane.stepped, lane.going = 0.0, False, False, True
    lane.outcome, lane.completed, lane.steps = Outcome.COMPLETED, 0, 0


@compiled
def _accept(lane, number, stretch, inputs, outputs):
    """Accept a step in lanes: (end, acceleration); ends the lane where it was too small."""
    length, tiny = lane.period, TINY * lane.period
    limits = Limits(length, stretch.kink_below, stretch.kink_above, tiny, lane.stalled)
    size, hit, a = taylor.accept(inputs, outputs, number, limits)
    lane.stepped, lane.stalled = False, size == 0.0
    if size < 0.0:
        lane.outcome, lane.going = Outcome.STEP_LIMIT, False
        return hit, a
    lane.time = length if length - lane.time - size <= 0.4 * tiny else lane.time + size
    if hit == SearchEnd.TIME:
        inputs[INPUT.drive, number] = outputs[OUTPUT.drive, number]
        inputs[INPUT.drive_rate, number] = outputs[OUTPUT.drive_rate, number]
    elif size > 0.0:
        forcing = _harmonic(lane)
        taylor.drive(inputs, number, forcing, phase_at(forcing, lane.time))
    return hit, a


@compiled
def _alone(lane, number, stretch, piece, inputs, max_steps):
    """Move a lane through a linear stretch, in closed form: (end, acceleration)."""
    forcing = _harmonic(lane)
    angle, velocity = inputs[INPUT.angle, number], inputs[INPUT.velocity, number]
    point = Point(lane.time, angle, velocity, 0.0)
    made = linear_step(
        stretch, piece, forcing, point, lane.period, lane.divergence_velocity,
        max_steps - lane.steps,
    )  # fmt: skip
    lane.steps += made.work
    if made.outcome != Outcome.COMPLETED:
        lane.outcome, lane.going = made.outcome, False
    lane.time = made.point.time
    inputs[INPUT.angle, number], inputs[INPUT.velocity, number] = (
        made.point.angle,
        made.point.velocity,
    )
    taylor.drive(inputs, number, forcing, phase_at(forcing, lane.time))
    return made.hit, made.point.acceleration


@compiled
def _go_on(lane, number, stretches, hit, a, inputs, max_steps):
    """Decide how a lane goes on after a step: not at all, or in which stretch."""
    velocity = inputs[INPUT.velocity, number]
    if lane.steps > max_steps:
        lane.outcome, lane.going = Outcome.STEP_LIMIT, False
    elif (
        not math.isfinite(velocity)
        or abs(velocity - lane.rest_velocity) >= lane.divergence_velocity
    ):
        lane.outcome, lane.going = Outcome.DIVERGED, False
        return
    here = stretches[number, lane.stretch]
    # By numbers: a slice costs more than what is done with it.
    if hit != SearchEnd.TIME:
        lane.stretch = stretch_at(stretches[number], velocity, hit == SearchEnd.HIT_HIGH)
    elif not here.linear and not here.low < velocity < here.high:
        lane.stretch = stretch_at(stretches[number], velocity, a > 0.0)


@compiled
def _return(lane, number, inputs, points):
    """Record the return of a lane to the section; the lane ends with its last period."""
    lane.completed += 1
    lane.time = 0.0
    taylor.drive(inputs, number, _harmonic(lane), phase_at_return())
    points[lane.completed, 0] = inputs[INPUT.angle, number]
    points[lane.completed, 1] = inputs[INPUT.velocity, number]
    lane.going = lane.completed < points.shape[0] - 1


@compiled
def _aim(lane, number, stretch, inputs):
    """Prepare the next step of a lane."""
    rest = lane.rest_velocity
    side = 1.0 if stretch.kink_below >= rest else -1.0
    inputs[INPUT.slope, number] = side * lane.slope
    tolerances = Tolerances(lane.relative_tolerance, lane.angle_tolerance, lane.velocity_tolerance)
    longest = min(lane.longest_step, lane.period - lane.time)
    reach = taylor.POLE_SHARE * (abs(inputs[INPUT.velocity, number] - rest) + POLE * lane.band)
    taylor.limit(inputs, number, tolerances, longest, reach)
    lane.stepped = True
    lane.steps += 1


@compiled
def run(lanes, stretches, pieces, inputs, max_steps, points):
    """Advance WIDTH systems from the phase 0, as many periods as ``points`` has room for.

    lanes     : (WIDTH,) of dtype ``LANE``, the system set
    stretches, pieces : (WIDTH, n), as in ``SmoothProblem``
    inputs    : (INPUT_ROWS, WIDTH) with systems and states; receives the states at the end
    points    : (WIDTH, periods + 1, 2) receives the states at the begin of each period
    """
    outputs = np.zeros((OUTPUT_ROWS, WIDTH))
    for number in range(WIDTH):
        lane, velocity = lanes[number], inputs[INPUT.velocity, number]
        points[number, 0, 0] = inputs[INPUT.angle, number]
        points[number, 0, 1] = velocity
        inputs[INPUT.slope, number] = math.copysign(1.0, velocity - lane.rest_velocity) * lane.slope
        inputs[INPUT.last_size, number] = FIRST_STEP * lane.longest_step
        taylor.drive(inputs, number, _harmonic(lane), phase_at_return())
    # For the accelerations alone.
    step_lanes(inputs, outputs)
    for number in range(WIDTH):
        velocity = inputs[INPUT.velocity, number]
        a = outputs[OUTPUT.accelerations, number]
        _begin(lanes[number], stretches[number], a, velocity)
    together = WIDTH
    while together > 0:
        together = 0
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
                    together += 1
                    break
                if lane.going:
                    _go_on(lane, number, stretches, hit, a, inputs, max_steps)
                if lane.going and lane.time >= lane.period:
                    _return(lane, number, inputs, points[number])
        if together > 0:
            step_lanes(inputs, outputs)
