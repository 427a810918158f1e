"""Lines of the torque of a contact over its sliding speed: straight lines or polynomials.

A curve is the torque divided by the force, R g(+-mu(v)), as a function of the sliding speed. It is
approximated to rounding by polynomials on consecutive pieces; smoothed friction of a brake of
levers, whose Taylor series is known, is one line.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator
from functools import lru_cache
from itertools import combinations, pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import NDArray

from wedgebrake.arrays import FloatArray
from wedgebrake.dynamics import piecewise_linear
from wedgebrake.errors import InputError
from wedgebrake.model.actuation import Actuation
from wedgebrake.model.brakes import Brake, LeverBrake
from wedgebrake.model.characteristic import has_straight_lines
from wedgebrake.model.friction import CustomFriction, SmoothedFriction, SmoothFriction
from wedgebrake.solvers.machine.problem import LINE, MOST_DEGREE

# Largest error of a piece and rounding of a sum, both relative to the value of the curve.
_ERROR, _ROUNDING = 1e-14, 4e-16
# Sliding speed up to which the law of a curve is evaluated [m/s], and the shortest piece, relative
# to the speed or to the width of the law.
_FASTEST, _SHORTEST = 1e6, 1e-12
# Amplification above which a brake counts as one that locks itself. The rate of a speed v that
# falls towards locking at v_0 grows like 1/(v - v_0): its series would overflow for larger values.
_LOCKED = 1e6
# Ratio of the speeds at which a long piece is compared with its curve, or a curve looked at for
# self-locking: narrower features are declared.
_RATIO = 1.1
_MOST_PIECES = 20_000
# Ends of pieces around a narrow feature, as multiples of its half width.
_AROUND = (-8.0, -4.0, -2.0, -1.0, 0.0, 1.0, 2.0, 4.0, 8.0)
# Number of cached curves, each for one direction.
_REMEMBERED = 64
# Share of the error in a longer piece from which the width does not matter, and ratio of an error
# to the one allowed up to which this may be due to the rounding of the law.
_STAGNANT, _RELEVANT = 0.95, 1e9
# Ratio of the ends of a piece from which a smooth law is v times a polynomial there.
_WIDE = 4.0
# Degree of a curve that is one polynomial of the speed, and number of speeds that determine it.
_PLAIN_DEGREE, _PLAIN_POINTS = 3, 24
# Relative distance of the speeds that show the rounding error of a law, the largest one that it
# may have, in the coefficient or relative to the torque, and number of places that are looked at.
_NEIGHBOURS, _NOISE, _WORST = 3.77e-5, 1e-13, 4
# Relative change of the slope of a torque from which it bends.
_BEND = 1e-6

# Chebyshev points with both ends, so that pieces meet, or with the upper one alone, where a piece
# is v times a polynomial; the matrices from values there to coefficients of powers; and points
# between them at which a piece is compared with the curve.
_POINTS = -np.cos(np.pi * np.arange(MOST_DEGREE + 1) / MOST_DEGREE)
_UPPER_POINTS = np.cos(2.0 * np.pi * np.arange(MOST_DEGREE) / (2 * MOST_DEGREE - 1))
_TO_CHEBYSHEV, _UPPER_TO_CHEBYSHEV = (
    np.linalg.inv(chebyshev.chebvander(points, len(points) - 1))
    for points in (_POINTS, _UPPER_POINTS)
)
_TO_POWERS = np.array(
    [np.pad(chebyshev.cheb2poly(row), (0, MOST_DEGREE - k)) for k, row in
     enumerate(np.eye(k + 1)[k] for k in range(MOST_DEGREE + 1))]
).T  # fmt: skip
_CHECKS = -np.cos(np.pi * (np.arange(2 * MOST_DEGREE) + 0.5) / (2 * MOST_DEGREE))


class FrictionLine(NamedTuple):
    """A line of the torque, as ``problem.LINE``, with the polynomial of a curved line.

    smoothed : whether the factors are the numbers of a smoothed law instead
    """

    start: float
    offset: float
    slope: float
    bends: bool = True
    released: bool = False
    factors: tuple[float, ...] = ()
    smoothed: bool = False

    def at(self, speeds: Any) -> tuple[Any, Any]:
        """Values of a line at some speeds [rad/s], and its slopes there."""
        places, value, slope = self.offset + self.slope * speeds, 0.0 * speeds, 0.0 * speeds
        if not self.factors:
            return places, self.slope
        for factor in reversed(self.factors):
            slope = slope * places + value
            value = value * places + factor
        return value, self.slope * slope


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
        degree = -1 if line.smoothed else max(len(line.factors) - 1, 0)
        missing = MOST_DEGREE + 1 - len(line.factors)
        rows[place] = (degree, *line[:-2], line.factors + (0.0,) * missing)
    rows.flags.writeable = False
    return Lines(bends, len(forward), len(backward), rows)


def straight_lines(contact: Sliding) -> tuple[list[FrictionLine], list[FrictionLine]]:
    """Straight lines of the torque forwards and backwards, if friction depends on the speed."""
    friction, given = contact.friction, contact.actuation
    if not has_straight_lines(contact.name, friction, given, instead="smooth"):
        return [], []
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
                FrictionLine(start, offset, slope, released=start >= given.release_speed)
                for start, offset, slope in lines[["start", "offset", "slope"]][:count].tolist()
            ]
        )
    return _with_bends(found[0]), _with_bends(found[1])


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
        self.shortest = _SHORTEST * (min(friction.transition, 1.0) if self.smooth else 1.0)

    def coefficient(self, speed: float) -> float:
        """The kinetic coefficient, checked."""
        try:
            if speed < self.near:
                mu = self.slope * speed
            elif self.smooth:
                mu = self.side * self.friction.coefficient(self.side * speed) + 0.0
            else:
                mu = float(self.friction.kinetic_at(speed))
        except ArithmeticError as error:
            allowed = f"a law that is defined up to {_FASTEST:g} m/s"
            raise InputError(
                f"{self.name}: raises {error!r} at the sliding speed {speed:g} m/s: must be"
                f" {allowed}. Use an expression that does not overflow.",
                name=self.name, value=type(self.friction).__name__, allowed=allowed,
            ) from None  # fmt: skip
        if not 0.0 <= mu < math.inf:
            raise InputError(
                f"{self.name}: is {mu!r} at the sliding speed {speed:g} m/s: must be finite and"
                " not negative, as friction opposes the direction of sliding.",
                name=self.name, value=mu, allowed="a number that is not negative",
            )  # fmt: skip
        return mu

    def torque(self, mu: float) -> float:
        """R g(+-mu); infinite where the brake locks itself."""
        factor = self.brake.amplification(self.side * mu)
        locked = abs(factor) > _LOCKED * max(mu, 1.0)
        return self.side * math.inf if locked else self.brake.radius * factor

    def __call__(self, speed: float) -> float:
        """The torque at a speed."""
        return self.torque(self.coefficient(speed))

    def values(self, speeds: FloatArray) -> FloatArray:
        """The torque at some speeds."""
        return np.array([self(one) for one in speeds.tolist()])

    def noise(self, speed: float) -> float:
        """Rounding error of the law at a speed, from differences of sixth order; 0: it is larger.

        That of a law such as 1 - exp(-v) near rest is large, relative to its value.
        """
        values = self.values(speed * (1.0 + _NEIGHBOURS * np.arange(-7.5, 8.0)))
        noise = 0.25 * float(np.max(np.abs(np.diff(values, 6))))
        largest = _NOISE * max(self.brake.radius, float(np.max(np.abs(values))))
        return noise if noise <= largest else 0.0


def curved_lines(contact: Sliding) -> tuple[list[FrictionLine], list[FrictionLine]]:
    """Pieces of the curve forwards and backwards, if friction depends on the speed."""
    given = contact.name, contact.brake, contact.friction
    smoothed = _smoothed_law(contact.brake, contact.friction)
    if smoothed is not None:
        return [smoothed], [smoothed]
    pieces: Any = _pieces
    try:
        hash(given)
    except TypeError:  # a user-defined law with unhashable parameters, such as lists
        pieces = _pieces.__wrapped__
    return pieces(*given, 1.0), pieces(*given, -1.0)


def _smoothed_law(brake: Brake, friction: Any) -> FrictionLine | None:
    """The line of smoothed friction of a brake of levers that does not lock itself, or None."""
    if type(friction) is not SmoothedFriction or type(brake).law is not LeverBrake.law:
        return None
    most, (a, b, d) = friction.static, brake.shape()
    if not min(a, b) > 0.0 or any(
        abs(brake.amplification(side * most)) > _LOCKED * max(most, 1.0) for side in (1.0, -1.0)
    ):
        return None
    kinetic, peak, decay, steepness = friction.shape()
    radius = brake.radius
    numbers = kinetic, peak, decay * radius, steepness * radius, radius * a, b, d
    return FrictionLine(
        0.0, 0.0, 1.0, False, factors=tuple(float(one) for one in numbers), smoothed=True
    )


@lru_cache(_REMEMBERED)
def _pieces(name: str, brake: Brake, friction: Any, side: float) -> list[FrictionLine]:
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
    found: list[FrictionLine] = []
    for low, high in pairwise([0.0, *bends, _FASTEST]):
        _append_pieces(curve, low, high, found)
    return _with_bends(found, [one / brake.radius for one in bends])


def _bends(curve: _Curve) -> Iterator[float]:
    """Sliding speeds at which pieces end: kinks, and around narrow features [m/s]."""
    if not curve.smooth:
        yield from curve.friction.bends
        return
    yield curve.near
    for speed, width in curve.friction.narrow_places:
        yield from (speed + share * width for share in _AROUND)


def _with_bends(
    lines: list[FrictionLine], starts: Collection[float] | None = None
) -> list[FrictionLine]:
    """The lines, with ``bends`` where the slope changes at their start.

    starts : of lines that may bend; None for all
    """
    return [
        line._replace(bends=(starts is None or line.start in starts) and _is_bend(before, line))
        for before, line in pairwise([lines[0], *lines])
    ]


def _is_bend(before: FrictionLine, after: FrictionLine) -> bool:
    """Return True if the slope of the torque changes from one line to the next."""
    if before.start == after.start:
        return False
    (value, one), (_, other) = before.at(after.start), after.at(after.start)
    size = max(abs(one), abs(other), abs(value) / after.start)
    return not (math.isfinite(value) and abs(other - one) <= _BEND * size)


def _append_pieces(curve: _Curve, low: float, high: float, found: list[FrictionLine]) -> None:
    """Append the pieces of a curve between two speeds, each nearly as long as possible."""
    at, width, line = low, high - low, None
    while at < high:
        # A polynomial begins where a piece is one.
        simple = line is None or len(line.factors) <= MOST_DEGREE // 2
        if simple and (at == 0.0 or high == _FASTEST) and (plain := _plain(curve, at, high)):
            found.append(plain)
            return
        width, last, noisy = min(width, high - at), math.inf, False
        line, error = _fit(curve, at, at + width, noisy=noisy)
        while error > 1.0:
            if not noisy and _STAGNANT * last < error < _RELEVANT:
                noisy = True
            else:
                last = error
                width *= min(max(0.9 * error ** (-1.0 / (MOST_DEGREE + 1)), 0.1), 0.8)
            if width < max(_SHORTEST * at, curve.shortest):
                line, width = _locked(curve, at, high)
                break
            line, error = _fit(curve, at, at + width, noisy=noisy)
        found.append(line)
        if len(found) > _MOST_PIECES:
            raise _not_smooth(curve, at)
        at, width = at + width, 2.0 * width
    if high == _FASTEST:
        found.append(_line(curve, high, 0.0, 1.0, np.array([curve(high)])))


def _plain(curve: _Curve, low: float, high: float) -> FrictionLine | None:
    """The piece from one speed to another if the curve is one polynomial of the speed there.

    As a polynomial of the speed itself, it is as exact at low speeds as at high ones.
    """
    speeds = np.geomspace(max(low, 1e3 * curve.shortest), high, _PLAIN_POINTS)
    values = curve.values(speeds)
    if not np.any(values):
        return _line(curve, low, 0.0, 1.0, np.zeros(1))
    if not np.all(np.isfinite(values)) or not np.all(values):
        return None
    columns = speeds[:, None] ** np.arange(_PLAIN_DEGREE + 1) / values[:, None]
    every = tuple(range(_PLAIN_DEGREE + 1))
    if _solution(columns, every) is None:
        return None
    subsets = (powers for count in every[1:] for powers in combinations(every, count))
    factors = next(
        one for powers in (*subsets, every) if (one := _solution(columns, powers)) is not None
    )
    line = _line(curve, low, 0.0, 1.0, np.trim_zeros(factors, "b"))
    return line if _error(curve, line, _between(curve, low, high), noisy=False) <= 1.0 else None


def _solution(columns: FloatArray, powers: tuple[int, ...]) -> FloatArray | None:
    """Factors of some columns with the sum 1 in every row, to rounding; None if there are none."""
    used = columns[:, powers]
    sizes = np.max(np.abs(used), axis=0)
    terms = np.zeros(len(powers))
    for _ in range(2):  # the second time for the rounding of the first one
        terms += np.linalg.lstsq(used / sizes, 1.0 - used @ terms, rcond=None)[0] / sizes
    rounding = _ROUNDING * (1.0 + np.abs(used) @ np.abs(terms))
    if np.any(np.abs(used @ terms - 1.0) > 2.0 * rounding):
        return None
    factors = np.zeros(columns.shape[1])
    factors[list(powers)] = terms
    return factors


def _line(
    curve: _Curve, low: float, offset: float, slope: float, factors: FloatArray
) -> FrictionLine:
    """A piece from a speed on, for s = offset + slope speed, in m/s; over the speed in rad/s."""
    radius = curve.brake.radius
    return FrictionLine(low / radius, offset, slope * radius, factors=tuple(factors.tolist()))


def _fit(curve: _Curve, low: float, high: float, *, noisy: bool) -> tuple[FrictionLine, float]:
    """The polynomial between two speeds, and the ratio of its error to the error allowed.

    noisy : whether the error may be that of the rounding of the law
    """
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    line, error = FrictionLine(low, 0.0, 0.0), math.inf
    for fit in (_times_speed, _centred) if curve.smooth and high > _WIDE * low else (_centred,):
        found = fit(curve, low, high)
        if found is None:
            return line, math.inf
        now = _error(curve, found, middle + half * _CHECKS, noisy=noisy)
        if now <= 1.0 and high > 2.0 * low:
            now = max(now, _error(curve, found, _between(curve, low, high), noisy=noisy))
        if now <= 1.0:
            return found, now
        line, error = (found, now) if now < error else (line, error)
    return line, error


def _centred(curve: _Curve, low: float, high: float) -> FrictionLine | None:
    """The polynomial of a speed that is -1 at one end and 1 at the other; None beyond locking."""
    slope = 2.0 / (high - low)
    values = curve.values(0.5 * (low + high) + _POINTS / slope)
    if not np.all(np.isfinite(values)):
        return None
    terms = _shortened(_TO_CHEBYSHEV @ values, values)
    factors = _TO_POWERS[: terms.size, : terms.size] @ terms
    return _line(curve, low, -(low + high) / (high - low), slope, factors)


def _times_speed(curve: _Curve, low: float, high: float) -> FrictionLine | None:
    """The speed times a polynomial of it, exact at low speeds too; None beyond locking."""
    speeds = 0.5 * (low + high) + 0.5 * (high - low) * _UPPER_POINTS
    values = curve.values(speeds) / speeds
    if not np.all(np.isfinite(values)):
        return None
    terms = _shortened(_UPPER_TO_CHEBYSHEV @ values, values)
    offset, slope = -(low + high) / (high - low), 2.0 * high / (high - low)
    factors = np.zeros(terms.size)
    for power in (_TO_POWERS[: terms.size, : terms.size] @ terms)[::-1]:  # Horner's rule
        factors = offset * factors + slope * np.append(0.0, factors[:-1])
        factors[0] += power
    return _line(curve, low, 0.0, 1.0 / high, np.append(0.0, high * factors))


def _shortened(terms: FloatArray, values: FloatArray) -> FloatArray:
    """Chebyshev terms of a function with some values, without last ones that are rounding."""
    sizes = np.abs(values)
    small = max(0.05 * _ERROR * float(np.min(sizes)), 0.1 * _ROUNDING * float(np.max(sizes)))
    used = np.flatnonzero(np.cumsum(np.abs(terms[::-1]))[::-1] > small)
    return terms[: int(used[-1]) + 1 if used.size else 1]


def _error(curve: _Curve, line: FrictionLine, speeds: FloatArray, *, noisy: bool) -> float:
    """Largest ratio of the error of a piece to the error allowed, at some speeds.

    The allowed error is relative to the value at each speed, with the rounding of the speed, which
    a law that is steep far from rest amplifies, and that of the coefficient: near self-locking, g
    grows like 1/(m_0 - m).
    """
    mu = [curve.coefficient(one) for one in speeds.tolist()]
    values = np.array([curve.torque(one) for one in mu])
    if not np.all(np.isfinite(values)):
        return math.inf
    at = speeds / curve.brake.radius
    fitted, slopes = line.at(at)
    sizes, errors = np.abs(values), np.abs(fitted - values)
    steep = sizes / (curve.brake.radius * np.maximum(mu, math.ulp(0.0)))
    allowed = _ERROR * sizes + _ROUNDING * (sizes * steep + np.abs(slopes) * at) + math.ulp(0.0)
    shares = errors / allowed
    if noisy and np.max(shares) > 1.0:
        worst = np.argsort(shares)[-_WORST:]
        shares = errors / (allowed + max(curve.noise(float(speeds[one])) for one in worst))
    return float(np.max(shares))


def _between(curve: _Curve, low: float, high: float) -> FloatArray:
    """Speeds in a long piece, denser towards its lower end, where curves change the most."""
    nearest = max(0.25 * low, min(1e3 * curve.shortest, 1e-3 * high))
    count = max(math.ceil(math.log((high - low) / nearest) / math.log(_RATIO)), 1)
    return low + (high - low) * _RATIO ** -np.arange(0.5, count)


def _locked(curve: _Curve, low: float, high: float) -> tuple[FrictionLine, float]:
    """The self-locking piece that begins at a speed, and its width.

    Raises ``InputError`` if the curve jumps instead.
    """
    shortest = max(_SHORTEST * low, curve.shortest)
    inside, width = low, shortest
    while math.isfinite(curve(inside + width)):
        if width > 1e6 * shortest:
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
    return _line(curve, low, 0.0, 1.0, np.array([curve.side * math.inf])), outside - low


def _not_smooth(curve: _Curve, speed: float) -> InputError:
    """The exception for a friction law that is not a smooth curve."""
    return InputError(
        f"{curve.name}: is not smooth near the sliding speed {speed:g} m/s. State the speeds of its"
        " kinks in bends, and of its narrow features in narrow; replace a jump by a steep slope.",
        name=curve.name, value=type(curve.friction).__name__, allowed="a smooth curve",
    )  # fmt: skip
