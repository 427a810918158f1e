"""What a logged trajectory adds up to: rest, sticks, heat, peak torque, size of the motion."""

import math

from wedgebrake.dynamics.enums import STICK
from wedgebrake.dynamics.jit import compiled
from wedgebrake.dynamics.linear_flow import G2, Q, acceleration, entry, jerk, state_at
from wedgebrake.solvers.event_driven.trajectory import (
    LOG_KIND,
    LOG_PERIOD,
    LOG_PIECE,
    LOG_SIDE,
    LOG_THETA,
    LOG_TIME,
    LOG_W,
    REST,
)

# Entries of the tally.
(
    REST_TIME,  # [s]
    STICKS_FORWARD,  # entered from w > w_rest
    STICKS_BACKWARD,
    HEAT,  # of the brake's torque on the sliding velocity [J]
    PEAK,  # largest |torque| of the brake [N m]
    LOW_W,  # extreme values met
    HIGH_W,
    LOW_THETA,
    HIGH_THETA,
    LAST_SLIP,  # when slip was seen last, in periods
) = range(10)
ENTRIES = 10

# The motion is looked at once in so many radians of its fastest rate, for its extremes.
_CELL = 1.5
# A torque below this share of the peak at both ends of a cell does not reach it between them.
_NEAR_PEAK = 0.5
# Below this loss (as a share of one cycle) the work of the slope is no difference of energies.
_LOSSLESS = 1e-7
# A slope of the torque below this share of the damping is the rounding of its sum.
_NO_SLOPE = 1e-14
# Gauss and Legendre's nodes and weights on (0, 1), exact to order 8.
_NODES = (0.06943184420297371, 0.33000947820757187, 0.6699905217924281, 0.9305681557970262)
_WEIGHTS = (0.17392742256872692, 0.3260725774312731, 0.3260725774312731, 0.17392742256872692)


@compiled
def clear(tally):
    """Begin to count."""
    for entry_ in range(ENTRIES):
        tally[entry_] = 0.0
    tally[LOW_W] = tally[LOW_THETA] = math.inf
    tally[HIGH_W] = tally[HIGH_THETA] = -math.inf
    tally[LAST_SLIP] = -math.inf


@compiled
def _see(tally, theta, w, torque):
    """Widen the extremes."""
    tally[LOW_W] = min(tally[LOW_W], w)
    tally[HIGH_W] = max(tally[HIGH_W], w)
    tally[LOW_THETA] = min(tally[LOW_THETA], theta)
    tally[HIGH_THETA] = max(tally[HIGH_THETA], theta)
    tally[PEAK] = max(tally[PEAK], abs(torque))


@compiled
def _rest(plant, row, tau, tally):
    """An interval of rest: time, and the largest torque that was held."""
    _, damping, stiffness, amplitude, omega, w_rest = plant
    tally[REST_TIME] += tau
    theta, phase = row[LOG_THETA], omega * row[LOG_TIME]
    # The ends, and where the held torque is stationary between them.
    share = stiffness * w_rest / (amplitude * omega) if amplitude > 0.0 else 2.0
    turn = math.acos(share) if abs(share) <= 1.0 else 0.0
    for look in range(4):
        at = phase if look == 0 else phase + omega * tau
        if look >= 2:
            at = turn if look == 2 else 2.0 * math.pi - turn
            if not phase < at < phase + omega * tau:
                continue
        here = theta + w_rest * (at - phase) / omega
        held = amplitude * math.sin(at) - damping * w_rest - stiffness * here
        _see(tally, here, w_rest, held)


@compiled
def extreme(row, w2, f, omega, theta0, w0, sin0, cos0, pull, t0, low, high, rising):
    """(time after entry, angle, velocity) of the extreme velocity between two such times.

    There the acceleration vanishes.

    rising : whether it is positive at ``low``
    """
    theta, w, tau = theta0, w0, 0.5 * (low + high)
    for _ in range(60):
        t = t0 + tau
        sine, cosine = math.sin(omega * t), math.cos(omega * t)
        theta, w = state_at(row, w2, f, omega, theta0, w0, sin0, cos0, pull, tau, sine, cosine)
        a = acceleration(row, w2, f, theta, w, sine)
        j = jerk(row, w2, f, omega, w, a, cosine)
        if (a > 0.0) == rising:
            low = tau
        else:
            high = tau
        step = a / j if j != 0.0 else math.inf
        # What is left of Newton's way to the extreme changes the velocity by a step / 2.
        if abs(a * step) <= 1e-13 * abs(w) or high - low <= 1e-15 * high:
            break
        tau -= step
        if not low < tau < high:
            tau = 0.5 * (low + high)
    return tau, theta, w


@compiled
def _square_by_energy(row, w2, f, omega, start, after, sin0, cos0, sin1, cos1):
    """Integral of w^2 over a slip, from the energy balance of the piece.

    g2 int w^2 = f int sin(omega t) w + [q theta - w^2/2 - w2 theta^2/2]; the first
    integral, and the one with cos, follow from the equation of motion times sin and cos.
    """
    g2, q = row[G2], row[Q]
    theta0, w0 = start[LOG_THETA], start[LOG_W]
    theta1, w1 = after[LOG_THETA], after[LOG_W]
    tau_sin = (cos0 - cos1) / omega
    tau_cos = (sin1 - sin0) / omega
    product = 0.5 * (sin1 * sin1 - sin0 * sin0) / omega
    tau = after[LOG_TIME] - start[LOG_TIME]
    if after[LOG_PERIOD] > start[LOG_PERIOD]:
        tau += 2.0 * math.pi / omega
    square = 0.5 * tau - 0.5 * (sin1 * cos1 - sin0 * cos0) / omega
    react = omega - w2 / omega
    right_sin = f * square + q * tau_sin - (w1 * sin1 - w0 * sin0)
    right_sin += w2 / omega * (theta1 * cos1 - theta0 * cos0)
    right_cos = f * product + q * tau_cos - (w1 * cos1 - w0 * cos0)
    right_cos -= w2 / omega * (theta1 * sin1 - theta0 * sin0)
    forced = (g2 * right_sin + react * right_cos) / (g2 * g2 + react * react)
    gained = q * (theta1 - theta0)
    gained -= 0.5 * (w1 - w0) * (w1 + w0) + 0.5 * w2 * (theta1 - theta0) * (theta1 + theta0)
    return (f * forced + gained) / g2


@compiled
def _square_by_nodes(row, w2, f, omega, start, sin0, cos0, pull, tau):
    """The same by quadrature, where nothing is lost or all is resonance."""
    theta0, w0, t0 = start[LOG_THETA], start[LOG_W], start[LOG_TIME]
    cells = 1 + int(2.0 * max(omega, math.sqrt(w2)) * tau)
    width = tau / cells
    total = 0.0
    for cell in range(cells):
        for node in range(4):
            part = (cell + _NODES[node]) * width
            sine, cosine = math.sin(omega * (t0 + part)), math.cos(omega * (t0 + part))
            _, w = state_at(row, w2, f, omega, theta0, w0, sin0, cos0, pull, part, sine, cosine)
            total += _WEIGHTS[node] * width * w * w
    return total


@compiled
def _slip(plant, offset, row, start, after, tau, tally):
    """An interval of slip in one piece: heat, torques and extremes."""
    inertia, damping, stiffness, amplitude, omega, w_rest = plant
    w2, f = stiffness / inertia, amplitude / inertia
    theta0, w0, t0 = start[LOG_THETA], start[LOG_W], start[LOG_TIME]
    theta1, w1, t1 = after[LOG_THETA], after[LOG_W], after[LOG_TIME]
    sin0, cos0 = math.sin(omega * t0), math.cos(omega * t0)
    sin1, cos1 = math.sin(omega * t1), math.cos(omega * t1)
    pull = entry(row, w2, omega, theta0, w0, sin0, cos0)
    slope = row[G2] * inertia - damping
    if abs(slope) <= _NO_SLOPE * damping:
        slope = 0.0
    _see(tally, theta0, w0, offset + slope * w0)
    _see(tally, theta1, w1, offset + slope * w1)

    cells = 1 + int(max(omega, math.sqrt(w2)) * tau / _CELL)
    width = tau / cells
    before, level = acceleration(row, w2, f, theta0, w0, sin0), abs(offset + slope * w0)
    for cell in range(1, cells + 1):
        theta, w, sine, part = theta1, w1, sin1, tau
        if cell < cells:
            part = cell * width
            sine, cosine = math.sin(omega * (t0 + part)), math.cos(omega * (t0 + part))
            theta, w = state_at(row, w2, f, omega, theta0, w0, sin0, cos0, pull, part, sine, cosine)
            _see(tally, theta, w, offset + slope * w)
        a = acceleration(row, w2, f, theta, w, sine)
        here = abs(offset + slope * w)
        near = max(here, level) > _NEAR_PEAK * tally[PEAK]
        if (a < 0.0) != (before < 0.0) and slope != 0.0 and near:
            _, theta, w = extreme(
                row, w2, f, omega, theta0, w0, sin0, cos0, pull, t0, part - width, part,
                before > 0.0,
            )  # fmt: skip
            _see(tally, theta, w, offset + slope * w)
        before, level = a, here

    if offset != 0.0 or slope != 0.0:
        # M v = (offset + slope w)(w - w_rest), and the integral of w is an angle.
        turned = theta1 - theta0
        heat = offset * (turned - w_rest * tau) - slope * w_rest * turned
        loss = abs(row[G2]) * tau * (abs(row[G2]) + abs(omega - w2 / omega)) / omega
        if slope != 0.0 and loss > _LOSSLESS:
            heat += slope * _square_by_energy(
                row, w2, f, omega, start, after, sin0, cos0, sin1, cos1
            )
        elif slope != 0.0:
            heat += slope * _square_by_nodes(row, w2, f, omega, start, sin0, cos0, pull, tau)
        tally[HEAT] += heat


@compiled
def add(plant, laws, log, rows, tally):
    """Add the first ``rows`` rows of a log to a tally (ENTRIES,); the last one ends it.

    plant : (inertia, damping, stiffness, amplitude, omega, w_rest)
    laws  : (offsets, table, lower, upper), as for ``exact.run``
    """
    offsets, table, _, _ = laws
    omega = plant[4]
    length = 2.0 * math.pi / omega
    for i in range(rows - 1):
        row, after = log[i], log[i + 1]
        tau = (after[LOG_PERIOD] - row[LOG_PERIOD]) * length + after[LOG_TIME] - row[LOG_TIME]
        piece = int(row[LOG_PIECE])
        if piece == REST:
            _rest(plant, row, tau, tally)
        elif tau > 0.0:
            _slip(plant, offsets[piece], table[piece], row, after, tau, tally)
            tally[LAST_SLIP] = after[LOG_PERIOD] + after[LOG_TIME] / length
        if int(after[LOG_KIND]) == STICK:
            if after[LOG_SIDE] > 0.0:
                tally[STICKS_FORWARD] += 1.0
            else:
                tally[STICKS_BACKWARD] += 1.0
