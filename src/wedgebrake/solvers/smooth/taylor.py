"""Steps by Taylor series, for friction mu tanh and brakes whose g is a fraction.

With m = mu tanh(kappa v) and g = a m/(b - m d), the torque per force G = R g obeys

    dG/dt = Q(G) dv/dt,  Q = p0 + p1 G + p2 G^2

(docs/numerics.md, "Smooth friction of one inertia"), so that all coefficients of angle, velocity
and G follow from each other by products of series (Jorba and Zou, Experimental Mathematics 14
(2005) 99): one exponential a step, no rejected steps, and the motion inside the step as a
polynomial as exact as the step itself, on which the kinks of the law are found without missing one.

A step is one formula, compiled for one system and for several side by side (``simd_codegen``).
Its inputs and outputs are columns of arrays, one column (lane) for each system: a row of lanes is
loaded as one vector. ``INPUT`` and ``OUTPUT`` name the rows.
"""

import math
from typing import Any, NamedTuple

from wedgebrake.dynamics.actuator import commanded_force
from wedgebrake.dynamics.enums import SearchEnd
from wedgebrake.dynamics.harmonic import phase_at, rate, value
from wedgebrake.dynamics.jit import compiled, inlined
from wedgebrake.solvers.smooth.problem import POLE
from wedgebrake.solvers.smooth.simd_codegen import traced

# Coefficients kept: of angle and velocity up to this power of the time.
ORDER = 16


class Inputs(NamedTuple):
    """Numbers that a step needs. Those over the inertia: damping to slope, drive and its rate."""

    damping: Any
    stiffness: Any
    force: Any  # of the actuation at velocity 0
    slope: Any  # of the force over the sliding velocity: that over the speed times the direction
    squared_frequency: Any  # of the torque, angular
    rest_velocity: Any
    steepness: Any  # kappa
    top: Any  # G = top tanh/(gap - lever tanh)
    gap: Any
    lever: Any
    rise: Any  # dG/dv = rise e/(1 + e)^2/(gap - lever tanh)^2
    bend: Any  # p2
    lean: Any  # p1
    angle: Any
    velocity: Any
    drive: Any
    drive_rate: Any
    last_size: Any  # of the last step
    longest_size: Any
    reach: Any  # how far the velocity may go
    angle_tolerance: Any
    velocity_tolerance: Any


class Outputs(NamedTuple):
    """Results of a step: the state at its end and the series of the motion inside."""

    size: Any
    angle: Any
    velocity: Any
    acceleration: Any
    way: Any  # bound of how far the velocity goes
    drive: Any
    drive_rate: Any
    angles: Any  # ORDER + 1 coefficients
    velocities: Any
    accelerations: Any  # ORDER coefficients


INPUT = Inputs(*range(len(Inputs._fields)))
INPUT_ROWS = len(INPUT)
OUTPUT = Outputs(*range(7), *(7 + series * (ORDER + 1) for series in range(3)))
OUTPUT_ROWS = OUTPUT.accelerations + ORDER

# The last terms may have this share of the tolerance: what is left out adds up over the steps,
# and a hundredth costs a third more of them.
_SHARE = 0.01
# Largest product of a step and the decay rate of small deviations: the sum of 16 terms of exp(-z)
# has an error of a tenth at 6, and the wrong sign beyond. The last terms do not show this error for
# a motion far below the tolerance, as near rest: its velocity would change sign at every step.
_FADES = 6.0
# A start on a kink is no crossing, nor is what rounding makes of this share of a step.
_ON_KINK = 1e-6
# A step may cover this share of the way to the nearest pole of the law.
_POLE_SHARE = 0.6


class Series(NamedTuple):
    """Coefficients of driving torque, angle, velocity, acceleration, G and Q."""

    drives: list[Any]
    angles: list[Any]
    velocities: list[Any]
    accelerations: list[Any]
    gains: list[Any]
    rates: list[Any]


def expand(maths: Any, given: Inputs) -> Series:
    """Compute the series of the motion from a state, in plain Python."""
    v = given.velocity - given.rest_velocity
    x = given.steepness * v
    e = maths.exp(-2.0 * abs(x))
    over = 1.0 / (1.0 + e)
    # 1 - e cancels near 0, where the first terms of the series bound tanh from both sides.
    size = abs(x)
    square = size * size
    low = size * (1.0 - square * (1.0 / 3.0))
    high = low + size * square * square * (2.0 / 15.0)
    tanh = maths.signed(maths.smaller(maths.larger((1.0 - e) * over, low), high), x)
    part = 1.0 / (given.gap - given.lever * tanh)
    gain, steep = given.top * tanh * part, given.rise * e * over * over * part * part
    lean = given.lean + 2.0 * given.bend * gain
    pressed = commanded_force(given.force, given.slope, v)
    drag = given.damping + given.slope * gain
    drives = [given.drive, given.drive_rate]
    accel = given.drive - given.damping * given.velocity
    accel = accel - given.stiffness * given.angle - pressed * gain
    angles, velocities, accels = [given.angle, given.velocity], [given.velocity, accel], [accel]
    gains, rates = [gain, steep * accel], [steep]
    for n in range(1, ORDER):
        square, moved, turned = 0.0, 0.0, 0.0
        for j in range(1, n):
            moved = moved + velocities[j] * gains[n - j]
            turned = turned + rates[j] * accels[n - j]
            if 2 * j < n:
                square = square + gains[j] * gains[n - j]
        square = 2.0 * square
        if n % 2 == 0:
            square = square + gains[n // 2] * gains[n // 2]
        share = 1.0 / (n + 1.0)
        drives.append(given.squared_frequency * drives[n - 1] * (-share / n))
        # What depends on the newest term comes last: the next one waits for it.
        now = drives[n] - given.stiffness * angles[n] - given.slope * moved - drag * velocities[n]
        now = now - pressed * gains[n]
        change = given.bend * square + lean * gains[n]
        accels.append(now)
        rates.append(change)
        velocities.append(now * share)
        angles.append(velocities[n] * share)
        gains.append(((turned + accel * change) + steep * now) * share)
    return Series(drives, angles, velocities, accels, gains, rates)


def results(h: Any, series: Series) -> list[Any]:
    """``Outputs`` of a step of size h, one after the other."""
    drives, angles, velocities, accels = series[:4]
    angle, velocity, accel = angles[ORDER], velocities[ORDER], accels[ORDER - 1]
    way, force, force_rate = abs(velocities[ORDER]), drives[ORDER], ORDER * drives[ORDER]
    for n in range(ORDER - 1, -1, -1):
        angle, velocity = angle * h + angles[n], velocity * h + velocities[n]
        force = force * h + drives[n]
        if n > 0:
            way = way * h + abs(velocities[n])
            accel, force_rate = accel * h + accels[n - 1], force_rate * h + n * drives[n]
    return [h, angle, velocity, accel, way * h, force, force_rate, *angles, *velocities, *accels]


def formula(maths: Any, rows: list[Any]) -> list[Any]:
    """All outputs of a step from its inputs; in plain Python, for ``traced``."""
    given = Inputs(*rows)
    series = expand(maths, given)
    pressed = commanded_force(given.force, given.slope, given.velocity - given.rest_velocity)
    slopes = given.slope * series.gains[0] + pressed * series.rates[0]
    furthest = given.reach / (abs(series.accelerations[0]) + 1e-300)
    fading = _FADES / (abs(given.damping + slopes) + 1e-300)
    h = maths.smaller(_longest(maths, given, series), maths.smaller(given.longest_size, furthest))
    h = maths.smaller(h, fading)
    return results(h, series)


def _longest(maths: Any, given: Inputs, series: Series) -> Any:
    """The step that the last two terms allow, by roots of a power of two from the last step."""
    s = given.last_size
    fourth = (s * s) * (s * s)
    power = fourth * fourth * fourth * (s * s) * s
    largest = 0.0
    for n in (ORDER - 1, ORDER):
        angle = abs(series.angles[n]) / given.angle_tolerance
        speed = abs(series.velocities[n]) / given.velocity_tolerance
        term = maths.larger(angle, speed) * power * (s if n == ORDER else 1.0)
        root = maths.sqrt(maths.sqrt(maths.sqrt(maths.sqrt(term + 1e-290))))
        if n < ORDER:
            # The sixteenth root for the fifteenth: beyond 1 a bound of what is missing.
            root = root * (1.0 + maths.larger(root - 1.0, 0.0) * (1.0 / n))
        largest = maths.larger(largest, root)
    return s / largest


_step = traced(formula, INPUT_ROWS, 1)
_commanded_force = compiled(commanded_force)


@compiled
def step(inputs, outputs):
    """``formula`` for one system: inputs (INPUT_ROWS, 1), outputs (OUTPUT_ROWS, 1)."""
    _step(inputs, outputs)


@compiled
def load(driveline, torque, law, inputs, lane):
    """Store the numbers of a system in a column of ``inputs``."""
    inertia, kappa, mu, radius = driveline.inertia, law.steepness, law.kinetic, law.radius
    a, b, d = law.a, law.b, law.d
    inputs[INPUT.damping, lane] = driveline.damping / inertia
    inputs[INPUT.stiffness, lane] = driveline.stiffness / inertia
    inputs[INPUT.force, lane] = law.actuator.initial_force / inertia
    inputs[INPUT.slope, lane] = law.actuator.slope / inertia
    inputs[INPUT.squared_frequency, lane] = torque.angular_frequency * torque.angular_frequency
    inputs[INPUT.rest_velocity, lane] = driveline.rest_velocity
    inputs[INPUT.steepness, lane] = kappa
    inputs[INPUT.top, lane] = radius * a * mu
    inputs[INPUT.gap, lane] = b
    inputs[INPUT.lever, lane] = d * mu
    inputs[INPUT.rise, lane] = 4.0 * radius * a * b * mu * kappa
    inputs[INPUT.bend, lane] = kappa * (mu * d * d - b * b / mu) / (a * b * radius)
    inputs[INPUT.lean, lane] = 2.0 * kappa * mu * d / b


@inlined
def drive(inputs, lane, forcing, phase):
    """Set the driving torque over the inertia, and its rate, at the beginning of the next step."""
    inputs[INPUT.drive, lane] = value(forcing, phase)
    inputs[INPUT.drive_rate, lane] = rate(forcing, phase)


@inlined
def aim(inputs, lane, slope, forcing, point):
    """Set time, angle and velocity of the next step's begin, and the slope of the force there."""
    inputs[INPUT.slope, lane] = slope
    inputs[INPUT.angle, lane], inputs[INPUT.velocity, lane] = point.angle, point.velocity
    drive(inputs, lane, forcing, phase_at(forcing, point.time))


@inlined
def limit(inputs, lane, tolerances, longest, band):
    """Set the limits of the next step; ``band``: half width of the steep layer."""
    angle, velocity = inputs[INPUT.angle, lane], inputs[INPUT.velocity, lane]
    speed = abs(velocity - inputs[INPUT.rest_velocity, lane])
    inputs[INPUT.longest_size, lane] = longest
    inputs[INPUT.reach, lane] = _POLE_SHARE * (speed + POLE * band)
    share = _SHARE * tolerances.relative
    inputs[INPUT.angle_tolerance, lane] = share * (tolerances.angle + abs(angle))
    inputs[INPUT.velocity_tolerance, lane] = share * (tolerances.velocity + abs(velocity))


@compiled
def acceleration(inputs, lane):
    """Acceleration at the beginning of the next step."""
    velocity = inputs[INPUT.velocity, lane]
    v = velocity - inputs[INPUT.rest_velocity, lane]
    tanh = math.tanh(inputs[INPUT.steepness, lane] * v)
    gain = inputs[INPUT.top, lane] * tanh
    gain /= inputs[INPUT.gap, lane] - inputs[INPUT.lever, lane] * tanh
    pressed = _commanded_force(inputs[INPUT.force, lane], inputs[INPUT.slope, lane], v)
    push = inputs[INPUT.drive, lane] - inputs[INPUT.damping, lane] * velocity
    return push - inputs[INPUT.stiffness, lane] * inputs[INPUT.angle, lane] - pressed * gain


@compiled
def state(outputs, lane, tau):
    """(angle, velocity, acceleration) a time tau after a step begins."""
    angles, velocities, accels = OUTPUT.angles, OUTPUT.velocities, OUTPUT.accelerations
    angle, velocity = outputs[angles + ORDER, lane], outputs[velocities + ORDER, lane]
    a = outputs[accels + ORDER - 1, lane]
    for n in range(ORDER - 1, 0, -1):
        angle = angle * tau + outputs[angles + n, lane]
        velocity = velocity * tau + outputs[velocities + n, lane]
        a = a * tau + outputs[accels + n - 1, lane]
    return angle * tau + outputs[angles, lane], velocity * tau + outputs[velocities, lane], a


@compiled
def first_crossing(outputs, lane, h, edge, sign, tiny):
    """Time until sign (velocity - edge) first vanishes, after a start at or above 0; 2h: later.

    Each step is one that provably holds no root, from a bound of the second derivative (of
    the third on leaving the edge); near a root these are Newton's, from the safe side.
    """
    two, three = 0.0, 0.0  # bounds of the second and third derivative of the velocity
    for n in range(ORDER, 1, -1):
        term = n * (n - 1.0) * abs(outputs[OUTPUT.velocities + n, lane])
        two = two * h + term
        if n > 2:
            three = three * h + term * (n - 2.0)
    gap = sign * (outputs[OUTPUT.velocities, lane] - edge)
    speed = sign * outputs[OUTPUT.accelerations, lane]
    tau = 0.0
    if gap <= 0.0:
        turn = sign * outputs[OUTPUT.accelerations + 1, lane]
        if speed < 0.0 or (speed == 0.0 and turn < 0.0):
            return 0.0
        # gap >= speed tau + turn tau^2/2 - three tau^3/6
        three = max(three / 6.0, 1e-300)
        tau = (0.5 * turn + math.sqrt(0.25 * turn * turn + 4.0 * speed * three)) / (2.0 * three)
        tau = max(tau, _ON_KINK * h)
        if tau >= h:
            return 2.0 * h
        _, velocity, a = state(outputs, lane, tau)
        gap, speed = sign * (velocity - edge), sign * a
    for _ in range(200):
        if gap < 0.0 or (gap == 0.0 and speed < 0.0):
            return tau
        root = math.sqrt(speed * speed + 2.0 * two * gap)
        ahead = (speed + root) / two if speed >= 0.0 else 2.0 * gap / (root - speed)
        tau += ahead
        if tau >= h:
            return 2.0 * h
        if ahead <= tiny:
            return tau
        _, velocity, a = state(outputs, lane, tau)
        gap, speed = sign * (velocity - edge), sign * a
    return tau


@inlined
def _crossing(outputs, lane, low, high, tiny):
    """Time until the velocity first leaves (low, high), and by which end."""
    h, velocity = outputs[OUTPUT.size, lane], outputs[OUTPUT.velocities, lane]
    way = outputs[OUTPUT.way, lane]
    size, hit = h, SearchEnd.TIME
    if way == 0.0:
        return size, hit
    if velocity - low <= way:
        found = first_crossing(outputs, lane, h, low, 1.0, tiny)
        if found <= size:
            size, hit = found, SearchEnd.HIT_LOW
    if high - velocity <= way:
        found = first_crossing(outputs, lane, h, high, -1.0, tiny)
        if found <= size:
            size, hit = found, SearchEnd.HIT_HIGH
    return size, hit


@inlined
def accept(inputs, outputs, lane, limits):
    """Move a lane to the end of its step, or to the first kink that it would cross.

    Returns (size, hit, acceleration); size -1: the step was below ``limits.tiny``. The driving
    torque is left to the caller.
    """
    h = outputs[OUTPUT.size, lane]
    if not h >= min(limits.tiny, inputs[INPUT.longest_size, lane]):
        return -1.0, SearchEnd.TIME, outputs[OUTPUT.accelerations, lane]
    inputs[INPUT.last_size, lane] = max(h, 1e-3 * inputs[INPUT.last_size, lane])
    size, hit = _crossing(outputs, lane, limits.low, limits.high, limits.tiny)
    if hit == SearchEnd.TIME or (limits.stalled and size <= limits.tiny):
        inputs[INPUT.angle, lane] = outputs[OUTPUT.angle, lane]
        inputs[INPUT.velocity, lane] = outputs[OUTPUT.velocity, lane]
        return h, SearchEnd.TIME, outputs[OUTPUT.acceleration, lane]
    inputs[INPUT.velocity, lane] = limits.low if hit == SearchEnd.HIT_LOW else limits.high
    if size <= limits.tiny:
        return 0.0, hit, outputs[OUTPUT.accelerations, lane]
    inputs[INPUT.angle, lane], _, a = state(outputs, lane, size)
    return size, hit, a
