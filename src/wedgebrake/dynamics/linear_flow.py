"""Closed-form motion of one linear piece (docs/equations.md, "Closed form"; eqs. 1 and 8 to 12).

Inside a piece the brake torque is ``offset + slope * velocity`` and the driveline obeys

    theta'' + damping theta' + stiffness theta = forcing(t) + constant
    damping = (c + slope)/J,  stiffness = k/J,  forcing = T(t)/J,  constant = -offset/J

Three forms of its solution are used, each where it does not cancel (``FlowForm``):

UNDERDAMPED, OVERDAMPED   forced part plus homogeneous part, fast
CONFLUENT                 response from the entry state by divided differences of exp over
                          the roots and i*omega: critical damping, resonance and a free
                          driveline (k = 0) are then no special cases
BLOCKED                   no sliding is possible in this piece (self-locking)
"""

import cmath
import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wedgebrake.dynamics.enums import FlowForm
from wedgebrake.dynamics.harmonic import Phase, Sine, rate, second_rate, value
from wedgebrake.dynamics.jit import compiled
from wedgebrake.dynamics.records import record

# A piece of the brake's law with the constants of its flow.
PIECE = record(
    fields=[
        ("form", np.int64),  # a ``FlowForm``
        ("offset", np.float64),  # brake torque at velocity 0 [N m]; infinite: blocked
        ("slope", np.float64),  # of the brake torque [N m s/rad]
        ("damping", np.float64),  # (c + slope)/J [1/s]
        ("stiffness", np.float64),  # k/J [1/s^2]
        ("constant", np.float64),  # -offset/J [rad/s^2]
        ("rate1", np.float64),  # underdamped: decay rate; overdamped: slow root [1/s]
        ("rate2", np.float64),  # underdamped: frequency; overdamped: fast root [1/s]
        ("forced_sine", np.float64),  # forced angle: sine part, cosine part, centre [rad]
        ("forced_cosine", np.float64),
        ("centre", np.float64),
        ("cell", np.float64),  # longest search step [s], at most 1/growth for ``root_exclusion``
        ("noise", np.float64),  # rounding of an acceleration in equilibrium [rad/s^2]
    ]
)

# A forced part further than this from resonance (relative to omega), a spring stiffer than
# this (relative to the forcing, as a ratio of squared frequencies) and roots further apart
# than this (relative to half the damping) cost at most three digits of the
# forced-plus-homogeneous form.
_RESONANCE_MARGIN = 1e-2
_STIFFNESS_MARGIN = 1e-4
_ROOT_MARGIN = 0.1


class LinearDriveline(NamedTuple):
    """Inertia J, damping c, stiffness k, and the velocity of rest relative to the brake."""

    inertia: float
    damping: float
    stiffness: float
    rest_velocity: float


class Entry(NamedTuple):
    """Start of a motion on a piece: the state, the phase of the torque, and coefficients.

    The homogeneous part of the angle is ``angle1`` times the first and ``angle2`` times the
    second basis function, that of the velocity likewise. CONFLUENT uses the state only.
    """

    angle: float
    velocity: float
    phase: Phase
    angle1: float
    angle2: float
    velocity1: float
    velocity2: float


@compiled
def forcing_of(driveline, torque):
    """The torque over the inertia [rad/s^2]."""
    return Sine(torque.amplitude / driveline.inertia, torque.angular_frequency)


@compiled
def _set_form(piece, f, omega):
    """Choose the form of a piece and compute its constants."""
    g2, w2 = piece.damping, piece.stiffness
    decay = 0.5 * g2
    split = decay * decay - w2
    detuning = w2 - omega * omega
    spring_ok = w2 > _STIFFNESS_MARGIN * omega * omega
    piece.form = FlowForm.CONFLUENT
    if split < 0.0:
        damped = math.sqrt(-split)
        if spring_ok and math.hypot(decay, damped - omega) > _RESONANCE_MARGIN * omega:
            piece.form = FlowForm.UNDERDAMPED
            piece.rate1 = decay
            piece.rate2 = damped
    elif math.sqrt(split) > _ROOT_MARGIN * abs(decay) and spring_ok:
        far = -decay - math.copysign(math.sqrt(split), decay)
        near = w2 / far
        if abs(near) > 1e-3 * omega:
            piece.form = FlowForm.OVERDAMPED
            piece.rate1 = near
            piece.rate2 = far
    if piece.form != FlowForm.CONFLUENT:
        gain = f / (detuning * detuning + g2 * g2 * omega * omega)
        piece.forced_sine = gain * detuning
        piece.forced_cosine = -gain * g2 * omega
        piece.centre = piece.constant / w2


@compiled
def prepare(driveline, torque, slopes, offsets, pieces):
    """Fill ``pieces`` from the slopes and offsets of the brake torque over the velocity."""
    w2 = driveline.stiffness / driveline.inertia
    f, omega = torque.amplitude / driveline.inertia, torque.angular_frequency
    for i in range(slopes.size):
        piece = pieces[i]
        piece.form = FlowForm.BLOCKED
        piece.offset, piece.slope, piece.stiffness = offsets[i], slopes[i], w2
        piece.damping = piece.constant = piece.rate1 = piece.rate2 = 0.0
        piece.forced_sine = piece.forced_cosine = piece.centre = piece.cell = piece.noise = 0.0
        if math.isinf(offsets[i]):
            continue
        g2 = (driveline.damping + slopes[i]) / driveline.inertia
        q = -offsets[i] / driveline.inertia
        piece.damping, piece.constant = g2, q
        piece.noise = 1e-15 * (f + abs(q))
        piece.cell = 3.0 / max(math.sqrt(w2), omega, -3.0 * g2)
        _set_form(piece, f, omega)


@compiled
def _phi1(z):
    """(exp(z) - 1)/z for complex z with Re z <= 0, without cancellation."""
    if abs(z.real) + abs(z.imag) < 1e-8:
        return 1.0 + 0.5 * z
    half = math.sin(0.5 * z.imag)
    real = math.expm1(z.real) * math.cos(z.imag) - 2.0 * half * half
    return complex(real, math.exp(z.real) * math.sin(z.imag)) / z


@compiled
def _exp_difference(a, b):
    """First divided difference exp[a, b], stable for near and for far nodes."""
    if a.real >= b.real:
        return cmath.exp(a) * _phi1(b - a)
    return cmath.exp(b) * _phi1(a - b)


@compiled
def _exp_difference2(a, b, c):
    """Second divided difference exp[a, b, c] of complex nodes."""
    ab, bc, ca = abs(a - b), abs(b - c), abs(c - a)
    widest = max(ab, bc, ca)
    if widest >= 1.0:
        # Division by the widest gap, so that the numerator loses at most one digit.
        if ab == widest:
            return (_exp_difference(a, c) - _exp_difference(c, b)) / (a - b)
        if bc == widest:
            return (_exp_difference(b, a) - _exp_difference(a, c)) / (b - c)
        return (_exp_difference(c, b) - _exp_difference(b, a)) / (c - a)
    # Power series about the mean node: complete symmetric polynomials over factorials.
    mean = (a + b + c) / 3.0
    a, b, c = a - mean, b - mean, c - mean
    e2 = a * b + b * c + c * a
    e3 = a * b * c
    h0, h1, h2 = complex(1.0), complex(0.0), -e2
    total = 0.5 + h2 / 24.0
    factorial = 24.0
    for n in range(3, 22):
        h0, h1, h2 = h1, h2, -e2 * h1 + e3 * h0
        factorial *= n + 2.0
        total += h2 / factorial
    return cmath.exp(mean) * total


@compiled
def _roots(g2, w2):
    """The two roots of r^2 + g2 r + w2."""
    decay = 0.5 * g2
    split = decay * decay - w2
    if split >= 0.0:
        far = -decay - math.copysign(math.sqrt(split), decay)
        return complex(far), complex(w2 / far if far != 0.0 else 0.0)
    damped = math.sqrt(-split)
    return complex(-decay, damped), complex(-decay, -damped)


@compiled
def _unit_impulse(root1, root2, tau):
    """(theta, w) of the free motion a time ``tau`` after a unit velocity, for any roots."""
    a, b = root1 * tau, root2 * tau
    theta = tau * _exp_difference(a, b).real
    # Equal to exp(root2 t) + root1 theta, which would cancel for a large root1.
    return theta, (cmath.exp(a) + root2 * theta).real


@compiled
def impulse(piece, tau):
    """(h, h') of the free motion of a piece a time ``tau`` after a unit velocity.

    The fundamental matrix of the piece is [[h' + damping h, h], [-stiffness h, h']].
    """
    if piece.form == FlowForm.UNDERDAMPED:
        decay, damped = piece.rate1, piece.rate2
        shrink = math.exp(-decay * tau)
        h = shrink * math.sin(damped * tau) / damped
        return h, shrink * math.cos(damped * tau) - decay * h
    if piece.form == FlowForm.OVERDAMPED:
        near, far = piece.rate1, piece.rate2
        first, second = math.exp(near * tau), math.exp(far * tau)
        return (first - second) / (near - far), (near * first - far * second) / (near - far)
    root1, root2 = _roots(piece.damping, piece.stiffness)
    return _unit_impulse(root1, root2, tau)


@compiled
def _confluent(piece, forcing, entry, tau):
    """State after ``tau`` from the entry state, for pieces whose form must avoid divisions."""
    f, omega = forcing.amplitude, forcing.angular_frequency
    theta0, w0 = entry.angle, entry.velocity
    root1, root2 = _roots(piece.damping, piece.stiffness)
    a, b = root1 * tau, root2 * tau
    impulse, impulse_rate = _unit_impulse(root1, root2, tau)
    step = tau * tau * _exp_difference2(a, b, complex(0.0)).real
    forced = tau * tau * _exp_difference2(a, b, complex(0.0, omega * tau))
    forced_rate = impulse + complex(0.0, omega) * forced
    phase = complex(entry.phase.cosine, entry.phase.sine)
    push = piece.constant - piece.stiffness * theta0
    theta = theta0 + w0 * impulse + push * step + f * (phase * forced).imag
    w = w0 * impulse_rate + push * impulse + f * (phase * forced_rate).imag
    return theta, w


@compiled
def enter(piece, forcing, theta0, w0, phase):
    """``Entry`` of the motion on a piece from a state at a phase of the torque."""
    omega, w2 = forcing.angular_frequency, piece.stiffness
    ps, pc = piece.forced_sine, piece.forced_cosine
    y = theta0 - piece.centre - (ps * phase.sine + pc * phase.cosine)
    yd = w0 - omega * (ps * phase.cosine - pc * phase.sine)
    if piece.form == FlowForm.UNDERDAMPED:
        decay, damped = piece.rate1, piece.rate2
        sine, sine_rate = (yd + decay * y) / damped, -(decay * yd + w2 * y) / damped
        return Entry(theta0, w0, phase, y, sine, yd, sine_rate)
    near, far = piece.rate1, piece.rate2
    slow, fast = (yd - far * y) / (near - far), (near * y - yd) / (near - far)
    return Entry(theta0, w0, phase, slow, fast, near * slow, far * fast)


@compiled
def state_at(piece, forcing, entry, tau, phase):
    """(angle, velocity) a time ``tau`` after entry, where the torque has the given phase."""
    if piece.form == FlowForm.CONFLUENT:
        return _confluent(piece, forcing, entry, tau)
    omega, ps, pc = forcing.angular_frequency, piece.forced_sine, piece.forced_cosine
    if piece.form == FlowForm.UNDERDAMPED:
        shrink = math.exp(-piece.rate1 * tau)
        angle = piece.rate2 * tau
        first, second = shrink * math.cos(angle), shrink * math.sin(angle)
    else:
        first, second = math.exp(piece.rate1 * tau), math.exp(piece.rate2 * tau)
    forced = piece.centre + ps * phase.sine + pc * phase.cosine
    theta = forced + entry.angle1 * first + entry.angle2 * second
    w = omega * (ps * phase.cosine - pc * phase.sine)
    return theta, w + entry.velocity1 * first + entry.velocity2 * second


@compiled
def acceleration(piece, forcing, theta, w, phase):
    """Second derivative of the angle, from the equation of motion."""
    return value(forcing, phase) - piece.damping * w - piece.stiffness * theta + piece.constant


@compiled
def jerk(piece, forcing, w, a, phase):
    """Third derivative of the angle, from the differentiated equation of motion."""
    return rate(forcing, phase) - piece.damping * a - piece.stiffness * w


@compiled
def snap(piece, forcing, a, j, phase):
    """Fourth derivative of the angle, likewise."""
    return second_rate(forcing, phase) - piece.damping * j - piece.stiffness * a


def pieces_of(
    driveline: LinearDriveline,
    torque: Sine,
    slopes: NDArray[np.float64],
    offsets: NDArray[np.float64],
) -> NDArray[np.record]:
    """Allocate and fill the pieces of a brake torque over the velocity."""
    pieces = np.empty(slopes.size, dtype=PIECE)
    prepare(driveline, torque, slopes, offsets, pieces)
    return pieces
