"""Lines of the torque of a contact over its sliding speed: straight lines or polynomials.

A curve is the torque divided by the force, R g(+-mu(v)), as a function of the sliding speed. It is
approximated to rounding by polynomials on consecutive pieces.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import lru_cache
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import NDArray

from wedgebrake.arrays import FloatArray
from wedgebrake.dynamics import piecewise_linear
from wedgebrake.errors import InputError
from wedgebrake.model.actuation import Actuation
from wedgebrake.model.brakes import Brake
from wedgebrake.model.friction import CustomFriction, SetValuedFriction, SmoothFriction
from wedgebrake.solvers.machine.problem import LINE, MOST_DEGREE

# Largest error of a piece, relative to the curve; and of a sum, to its terms.
_ERROR, _ROUNDING = 1e-14, 4e-16
# Sliding speed from which the curve is constant [m/s], and the shortest piece: in m/s, and relative
# to the speed.
_FASTEST, _SHORTEST = 1e6, 1e-12
# Amplification above which a brake counts as one that locks itself. The rate of a speed v that
# falls towards locking at v_0 grows like 1/(v - v_0): its series would overflow for larger values.
_LOCKED = 1e6
# Ratio of the speeds at which a curve is compared with a constant, or looked at for self-locking.
_RATIO = 1.25
_MOST_PIECES = 20_000
# Ends of pieces around a narrow feature, as multiples of its half width.
_AROUND = (-8.0, -4.0, -2.0, -1.0, 0.0, 1.0, 2.0, 4.0, 8.0)
# Number of cached curves, each for one direction.
_REMEMBERED = 64

# Chebyshev points with both ends, so that pieces meet; the matrix from values there to coefficients
# of powers; and points between them at which a piece is compared with the curve.
_POINTS = -np.cos(np.pi * np.arange(MOST_DEGREE + 1) / MOST_DEGREE)
_TO_CHEBYSHEV = np.linalg.inv(chebyshev.chebvander(_POINTS, MOST_DEGREE))
_TO_POWERS = np.array(
    [np.pad(chebyshev.cheb2poly(row), (0, MOST_DEGREE - k)) for k, row in
     enumerate(np.eye(k + 1)[k] for k in range(MOST_DEGREE + 1))]
).T  # fmt: skip
_CHECKS = -np.cos(np.pi * (np.arange(2 * MOST_DEGREE) + 0.5) / (2 * MOST_DEGREE))


class Line(NamedTuple):
    """A line of the torque, as ``problem.LINE``, with the polynomial of a curved line."""

    start: float
    offset: float
    slope: float
    bends: bool = True
    released: bool = False
    factors: tuple[float, ...] = ()


class Sliding(NamedTuple):
    """The parts of a contact that determine its lines."""

    name: str
    brake: Brake
    friction: Any
    actuation: Actuation


class Lines(NamedTuple):
    """Lines of a contact: whether they are curves, numbers for each direction, rows of ``LINE``."""

    curved: bool
    forward: int
    backward: int
    rows: NDArray[np.void]


@lru_cache(maxsize=256)
def lines_of(contact: Sliding, curved: bool) -> Lines:
    """Lines of a contact, cached because they are equal for all points of most sweeps.

    curved : whether friction that varies with the speed is treated as a curve
    """
    smooth = isinstance(contact.friction, SmoothFriction)
    bends = curved and (smooth or not contact.friction.constant)
    forward, backward = curved_lines(contact) if bends else straight_lines(contact)
    rows = np.zeros(len(forward) + len(backward), LINE)
    for place, line in enumerate((*forward, *backward)):
        degree, missing = max(len(line.factors) - 1, 0), MOST_DEGREE + 1 - len(line.factors)
        rows[place] = (degree, *line[:-1], line.factors + (0.0,) * missing)
    rows.flags.writeable = False
    return Lines(bends, len(forward), len(backward), rows)


def straight_lines(contact: Sliding) -> tuple[list[Line], list[Line]]:
    """Straight lines of the torque forwards and backwards, if friction depends on the speed."""
    friction, given = contact.friction, contact.actuation
    if isinstance(friction, SmoothFriction):
        raise InputError(
            f"{contact.name}.friction = {type(friction).__name__}: is a smooth law, which"
            " the method 'exact' cannot solve. Use method='smooth', or CoulombFriction.",
            name="method", value="exact", allowed="'smooth'",
        )  # fmt: skip
    if friction.constant or not isinstance(friction, SetValuedFriction):
        return [], []
    if not (friction.has_nodes and given.immediate):
        raise InputError(
            f"{contact.name}.friction = {type(friction).__name__}: varies with the sliding speed,"
            " so that the method 'exact' needs a law with straight lines, nodes(), and an actuation"
            " force that depends on this speed alone, without lag, limits, sampling or a signal"
            " that varies. Use method='smooth', or CoulombFriction.",
            name=f"{contact.name}.friction", value=type(friction).__name__,
            allowed="a law with nodes(), and a force that depends on the sliding speed alone",
        )  # fmt: skip
    nodes = np.array(friction.nodes())
    speeds, law = nodes[:, 0] / contact.brake.radius, given.law
    found = []
    for side in (1.0, -1.0):
        lines = np.zeros(len(nodes) + 1, piecewise_linear.LINE)
        count = piecewise_linear.half(
            contact.brake.law, contact.brake.shape(), contact.brake.radius, speeds, nodes[:, 1],
            law, given.release_speed, side, lines,
        )  # fmt: skip
        found.append(
            [
                Line(start, offset, slope, released=start >= given.release_speed)
                for start, offset, slope in lines[["start", "offset", "slope"]][:count].tolist()
            ]
        )
    return found[0], found[1]


class _Curve:
    """The torque divided by the force, as a function of the sliding speed in m/s."""

    def __init__(self, contact: str, brake: Brake, friction: Any, side: float) -> None:
        self.name = f"{contact}.friction"
        self.brake, self.friction, self.side = brake, friction, side
        self.smooth = isinstance(friction, SmoothFriction)
        # The straight line near rest of a ``CustomFriction``, up to a speed; 0 for other laws.
        self.near = self.slope = 0.0
        if isinstance(friction, CustomFriction):
            self.near, forwards, backwards = friction.shape()
            self.slope = forwards if side > 0.0 else backwards
        at_rest = abs(self(0.0))
        self.size = at_rest if math.isfinite(at_rest) else 0.0

    def coefficient(self, speed: float) -> float:
        """The kinetic coefficient, checked."""
        if speed < self.near:
            mu = self.slope * speed
        elif self.smooth:
            mu = self.side * self.friction.coefficient(self.side * speed) + 0.0
        else:
            mu = float(self.friction.kinetic_at(speed))
        if not 0.0 <= mu < math.inf:
            raise InputError(
                f"{self.name}: is {mu!r} at the sliding speed {speed:g} m/s: must be finite and"
                " not negative, as friction opposes the direction of sliding.",
                name=self.name, value=mu, allowed="a number that is not negative",
            )  # fmt: skip
        return mu

    def __call__(self, speed: float) -> float:
        """R g(+-mu); infinite where the brake locks itself."""
        factor = self.brake.amplification(self.side * self.coefficient(speed))
        return self.brake.radius * factor if abs(factor) < _LOCKED else self.side * math.inf

    def values(self, speeds: FloatArray) -> FloatArray:
        """The curve at some speeds."""
        return np.array([self(float(one)) for one in speeds])

    def tolerance(self, speed: float, values: FloatArray) -> float:
        """Largest error allowed in a piece.

        It is relative to the value of the curve, there or at rest. Near self-locking g grows like
        1/(m_0 - m), and its relative rounding error grows with it.
        """
        largest, mu = float(np.max(np.abs(values))), self.coefficient(speed)
        steep = largest / (self.brake.radius * mu) if mu > 0.0 else 0.0
        return max(largest, self.size) * _ERROR + largest * _ROUNDING * steep


def curved_lines(contact: Sliding) -> tuple[list[Line], list[Line]]:
    """Pieces of the curve forwards and backwards, if friction depends on the speed."""
    given = contact.name, contact.brake, contact.friction
    pieces: Any = _pieces
    try:
        hash(given)
    except TypeError:  # a user-defined law with unhashable parameters, such as lists
        pieces = _pieces.__wrapped__
    return pieces(*given, 1.0), pieces(*given, -1.0)


@lru_cache(_REMEMBERED)
def _pieces(name: str, brake: Brake, friction: Any, side: float) -> list[Line]:
    """Pieces of the curve of one direction of sliding, +1 forwards or -1 backwards.

    They are cached, because sweeps and branches of orbits assemble many machines with the same
    friction.
    """
    curve = _Curve(name, brake, friction, side)
    first = curve.coefficient(0.0)
    if curve.smooth and first != 0.0:
        raise InputError(
            f"{curve.name}: is {first!r} at rest: must be 0 there, as the law is smooth. Use"
            " CoulombFriction for friction with a jump at rest.",
            name=curve.name, value=first, allowed="0 at rest",
        )  # fmt: skip
    if not curve.smooth and friction.breakaway < first * (1.0 - _ERROR):
        raise InputError(
            f"{curve.name}.breakaway = {friction.breakaway!r}: must be at least the kinetic"
            f" coefficient at rest, {first!r}. Raise it.",
            name=f"{curve.name}.breakaway", value=friction.breakaway, allowed=f">= {first!r}",
        )  # fmt: skip
    bends = sorted(float(one) for one in _bends(curve) if 0.0 < one < _FASTEST)
    found: list[Line] = []
    for low, high in pairwise([0.0, *bends, _FASTEST]):
        _append_pieces(curve, low, high, found)
    return found


def _bends(curve: _Curve) -> Iterator[float]:
    """Sliding speeds at which pieces end: kinks, and around narrow features [m/s]."""
    if not curve.smooth:
        yield from curve.friction.bends
        return
    yield curve.near
    for speed, width in curve.friction.narrow_places:
        yield from (speed + share * width for share in _AROUND)


def _append_pieces(curve: _Curve, low: float, high: float, found: list[Line]) -> None:
    """Append the pieces of a curve between two speeds, each nearly as long as possible."""
    at, width, bends = low, high - low, low > 0.0
    while at < high:
        if high == _FASTEST and _is_constant(curve, at):
            found.append(_piece(curve, at, high, np.array([curve(at)]), bends))
            return
        width = min(width, high - at)
        line, error = _fit(curve, at, at + width, bends)
        while error > 1.0:
            width *= min(max(0.9 * error ** (-1.0 / (MOST_DEGREE + 1)), 0.1), 0.9)
            if width < _SHORTEST * max(at, 1.0):
                line, width = _locked(curve, at, high, bends)
                break
            line, error = _fit(curve, at, at + width, bends)
        found.append(line)
        if len(found) > _MOST_PIECES:
            raise _not_smooth(curve, at)
        at, width, bends = at + width, 2.0 * width, False


def _is_constant(curve: _Curve, low: float) -> bool:
    """Return True if a curve is constant from a speed on."""
    step = max(low, _SHORTEST)
    count = math.ceil(math.log(_FASTEST / step) / math.log(_RATIO))
    value = curve(low)
    if math.isinf(value):
        return False
    tolerance = _ERROR * max(abs(value), curve.size)
    return all(
        abs(curve(low + step * (_RATIO**k - 1.0)) - value) <= tolerance for k in range(count, 0, -1)
    )


def _piece(curve: _Curve, low: float, high: float, factors: FloatArray, bends: bool) -> Line:
    """A piece between two speeds [m/s]; over the sliding speed in rad/s."""
    slope, radius = 2.0 / (high - low), curve.brake.radius
    offset = -(low + high) / (high - low)
    return Line(low / radius, offset, slope * radius, bends=bends, factors=tuple(factors.tolist()))


def _fit(curve: _Curve, low: float, high: float, bends: bool) -> tuple[Line, float]:
    """The polynomial between two speeds, and the ratio of its error to the error allowed."""
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    values = curve.values(middle + half * _POINTS)
    checks = curve.values(np.append(middle + half * _CHECKS, _nearer(low, high)))
    if not np.all(np.isfinite(values)) or not np.all(np.isfinite(checks)):
        return Line(low, 0.0, 0.0), math.inf
    # A law that is steep far from rest amplifies the rounding of the speed.
    steepest = float(np.max(np.abs(np.diff(values) / np.diff(half * _POINTS))))
    tolerance = curve.tolerance(low, np.append(values, checks)) + _ROUNDING * high * steepest
    tolerance = max(tolerance, math.ulp(0.0))
    terms = _TO_CHEBYSHEV @ values
    used = np.flatnonzero(np.cumsum(np.abs(terms[::-1]))[::-1] > 0.05 * tolerance)
    degree = int(used[-1]) if used.size else 0
    terms = terms[: degree + 1]
    places = np.append(_CHECKS, (_nearer(low, high) - middle) / half)
    error = float(np.max(np.abs(chebyshev.chebval(places, terms) - checks)))
    factors = _TO_POWERS[: degree + 1, : degree + 1] @ terms
    return _piece(curve, low, high, factors, bends), error / tolerance


def _nearer(low: float, high: float) -> FloatArray:
    """Speeds in a long piece, denser towards its lower end, where curves change the most."""
    nearest = max(0.25 * low, 1e-3 * _SHORTEST * high, 1e3 * _SHORTEST)
    count = max(math.ceil(math.log((high - low) / nearest) / math.log(_RATIO)), 1)
    return low + (high - low) * _RATIO ** -np.arange(1.0, count)


def _locked(curve: _Curve, low: float, high: float, bends: bool) -> tuple[Line, float]:
    """The self-locking piece that begins at a speed, and its width.

    Raises ``InputError`` if the curve jumps instead.
    """
    inside, width = low, _SHORTEST * max(low, 1.0)
    while math.isfinite(curve(inside + width)):
        if width > 1e-6 * max(low, 1.0):
            raise _not_smooth(curve, low)
        width *= 2.0
    while low + width < high and math.isinf(curve(low + width)):
        inside, width = low + width, width * _RATIO
    outside = min(low + width, high)
    for _ in range(60):
        if math.isinf(curve(outside)):
            break
        middle = 0.5 * (inside + outside)
        inside, outside = (
            (middle, outside) if math.isinf(curve(middle)) else (inside, middle)
        )  # fmt: skip
    return _piece(curve, low, outside, np.array([curve.side * math.inf]), bends), outside - low


def _not_smooth(curve: _Curve, speed: float) -> InputError:
    """The exception for a friction law that is not a smooth curve."""
    return InputError(
        f"{curve.name}: is not smooth near the sliding speed {speed:g} m/s. State the speeds of its"
        " kinks in bends, and of its narrow features in narrow; replace a jump by a steep slope.",
        name=curve.name, value=type(curve.friction).__name__, allowed="a smooth curve",
    )  # fmt: skip
