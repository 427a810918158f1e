"""``rare_event``: the small probability of an outcome, by line sampling.

In independent standard normal coordinates, the lines are parallel to the direction from the origin
to a design point. On each line, the boundary of the outcome is located by bisection, and the
normal probability beyond it is exact, so that it varies little from line to line. The mean over the
lines is unbiased for a region of any shape if no part of it is thinner than the step in which a
line is scanned. A thinner region, such as a resonance, is found if the lines pass through it where
the nearest occurrence was found, because this place is scanned too.

If occurrences lie outside the half-space behind the tangent plane at a design point, further
design points are sought from them. The space is then divided among the planes: a point belongs to
the plane behind which it is deepest. On a line along the normal of a plane, the points that belong
to this plane form a half-line. Only the outcome on this half-line is counted, so that the sum over
the planes is unbiased, too.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wedgebrake._version import __version__
from wedgebrake.analysis.sobol import sobol
from wedgebrake.arrays import FloatArray
from wedgebrake.errors import InputError
from wedgebrake.model.machine import Machine
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.model.validation import check_instance, check_whole, wrong
from wedgebrake.sweeps.outcomes import (
    DIRECTIONS,
    MEANINGS,
    NORMAL95,
    OUTCOME,
    SAFE,
    UNKNOWN,
    UNSTABLE,
    check_limits,
    has_direction,
    limit_name,
    with_probabilities,
)
from wedgebrake.sweeps.sampling import Distributions, distributions, given_sample
from wedgebrake.sweeps.scatter import evaluation

if TYPE_CHECKING:
    import xarray as xr

# Places on a line that are scanned, and bisections of the step in which the outcome changes.
_SCAN = np.linspace(-8.0, 8.0, 9)
_HALVINGS = 14
# Share of the runs in which occurrences are sought, and the factors by which the distributions are
# widened for this.
_SEARCH, _SPREADS = 0.05, (2.0, 3.5, 6.0)
# For one parameter, whose single line costs little, half the runs search, but at most so many.
_SEARCH_ONE = 600
# Number of improvements of the direction, and the step of their finite differences.
_ROUNDS, _STEP = 2, 0.3
# Occurrences from which the boundary is approached along rays, and the bisections on a ray.
_RAYS, _RAY_HALVINGS = 8, 5
# Largest number of searches for a design point, and the share of the runs after which no further
# search is started.
_STARTS, _SEARCH_ALL = 8, 0.85
# Occurrences up to this distance in front of a tangent plane count as behind it.
_IN_FRONT = 0.25
# Number of first lines, from which the cost of a line is estimated: along a single direction, and
# along each of several.
_PILOTS, _PILOTS_EACH = 8, 4
# Least standard deviation that is assumed for the probability on a line, relative to the
# probability behind the plane: a few first lines may agree by chance.
_LEAST_DEVIATION = 0.1
_FEWEST, _MOST = 500, 10_000_000

_Occurs = Callable[[FloatArray], NDArray[np.bool_]]


class _Plane(NamedTuple):
    """Tangent plane of the boundary of the outcome at a design point.

    normal   : unit vector, (k,)
    distance : position of the plane on the normal through the origin
    place    : position on the normal at which the outcome occurs
    """

    normal: FloatArray
    distance: float
    place: float

    def point(self) -> FloatArray:
        return self.distance * self.normal

    def covers(self, points: FloatArray) -> NDArray[np.bool_]:
        """Whether points, (..., k), are behind the plane, or slightly in front of it."""
        return np.asarray(points @ self.normal > self.distance - _IN_FRONT)


def rare_event(
    system: BrakedDriveline | Machine,
    over: Any = None,
    outcome: str = "self_locked",
    *,
    runs: int = 10_000,
    seed: int = 0,
    correlation: Any = None,
    **options: Any,
) -> xr.Dataset:
    """Estimate the small probability of an outcome by line sampling.

    On parallel lines through the space of the parameters, the boundary of the outcome is located
    by bisection, and the probability beyond it is computed exactly. If the outcome occurs in
    several regions, there are lines along the direction to each, and the probabilities are summed.

    Parameters
    ----------
    system : BrakedDriveline or Machine
        The system whose parameters are varied.
    over : mapping
        Frozen distribution of ``scipy.stats`` of each parameter by name, as for ``scatter``.
    outcome : str
        Name of an outcome of ``scatter``, or a result with its limit, such as "rms_torque > 20".
    runs : int
        Approximate number of samples to evaluate, at least 500. With many parameters or several
        regions, the search for the directions alone can exceed a small number.
    seed, correlation, **options
        As for ``scatter``.

    Returns
    -------
    xarray.Dataset
        ``probability``, its ``standard_error``, and the ends ``low`` and ``high`` of its 95 %
        interval; the number of ``lines``, and that of evaluated samples, ``runs``; and over
        ``parameter`` the ``design_point``, the most probable values for which the outcome occurs.
        If the outcome of a sample is unknown, it is assumed to occur; ``unknown`` is the number of
        these samples. If no occurrence is found within 8 standard deviations, ``probability`` is 0
        and ``high`` is nan. If the outcome occurs in samples but on none of the lines, because its
        region is too thin, ``probability``, ``low`` and ``high`` are nan. If it also occurs in
        samples outside the regions that could be examined with ``runs``, ``high`` is nan, because
        the probability can be much larger; the other values are those of the examined regions.

    A line is scanned in steps of 2 standard deviations. Regions that are thinner along the lines
    and far from the nearest occurrence, and regions that contain none of the samples of the search,
    can be missed: the probability is then too small, and the interval does not show this.

    Raises ``InputError`` for invalid arguments, and for instability in a direction in which no
    sample slides.
    """
    import xarray as xr

    check_whole("runs", runs, _FEWEST, _MOST)
    check_whole("seed", seed, 0, 2**32 - 1)
    name, limits = _parsed(outcome)
    varied, what = evaluation(system, over, [] if limits else [name], limits, options)
    what = what.without_store()
    if given_sample(varied) is not None:
        raise wrong(
            "over", varied, "distributions",
            "For a given sample, use wb.scatter.",
        )  # fmt: skip
    found = distributions(varied, correlation)
    count = {"runs": 0, "unknown": 0}
    slides = False

    def occurs(points: FloatArray) -> NDArray[np.bool_]:
        nonlocal slides
        codes = np.full(len(points), UNKNOWN)
        try:
            dataset = what.results(found.at_normal(points))
        except InputError:
            # Later calls have few samples, all of which can be invalid.
            if not count["runs"]:
                raise
        else:
            dataset = with_probabilities(dataset, what.outcomes, what.limits)
            codes = dataset["occurs"].sel({OUTCOME: name}).to_numpy()
            slides = slides or has_direction(dataset, name)
        count["runs"] += len(points)
        count["unknown"] += int(np.count_nonzero(codes == UNKNOWN))
        return np.asarray(codes != 0)

    hits = _occurrences(occurs, len(found.quantiles), runs, seed)
    if not slides:
        missing, other = DIRECTIONS if name == UNSTABLE[0] else DIRECTIONS[::-1]
        raise wrong(
            "outcome", name, "instability in a direction in which the system slides",
            f"No sample slides {missing}. Choose unstable_{other}.",
        )  # fmt: skip
    values = dict.fromkeys(("probability", "standard_error", "low"), 0.0)
    lines, high, point = 0, np.nan, dict.fromkeys(found.quantiles, np.nan)
    if len(hits):
        planes, complete = _planes(occurs, hits, lambda: count["runs"] < _SEARCH_ALL * runs)
        shares = _along_lines(occurs, planes, lambda: runs - count["runs"], seed)
        lines = sum(len(one) for one in shares)
        mean = float(sum(one.mean() for one in shares)) or np.nan
        error = float(np.sqrt(sum(_variance(one) / len(one) for one in shares)))
        # That of the logarithm, whose distribution is closer to normal, and of the bisection.
        width = NORMAL95 * error / mean + 8.0 * _resolution()
        values = {
            "probability": mean, "standard_error": error, "low": mean * np.exp(-width)
        }  # fmt: skip
        high = np.minimum(1.0, mean * np.exp(width)) if complete else np.nan
        nearest = planes[0]
        point = _named(found, max(nearest.distance, 0.0) * nearest.normal)
    return xr.Dataset(
        {
            **{key: ((), one, {"units": "1"}) for key, one in values.items()},
            "high": ((), high, {"units": "1"}),
            "lines": ((), lines, {"units": "1"}),
            **{key: ((), one, {"units": "1"}) for key, one in count.items()},
            "design_point": ("parameter", list(point.values()), {"units": "of the parameter"}),
        },
        coords={"parameter": list(point)},
        attrs={
            "outcome": name, "seed": seed, "system": json.dumps(system.as_dict()),
            "wedgebrake_version": __version__,
        },
    )  # fmt: skip


def _parsed(outcome: Any) -> tuple[str, dict[str, float]]:
    """The name of an outcome, and the limit of its result; no limit for other outcomes."""
    check_instance("outcome", outcome, str, "a name")
    result, above, limit = outcome.partition(">")
    if not above:
        if outcome not in MEANINGS or outcome == SAFE:
            allowed = [one for one in MEANINGS if one != SAFE]
            raise wrong(
                "outcome", outcome, f"one of {', '.join(allowed)}, or a result with its limit",
                'For example "rms_torque > 20".',
            )  # fmt: skip
        return outcome, {}
    try:
        value = float(limit)
    except ValueError:
        raise wrong(
            "outcome", outcome, "a result with its limit, such as 'rms_torque > 20'"
        ) from None
    name = result.strip()
    try:
        return limit_name(name, value), check_limits({name: value})
    except InputError as error:
        raise error.renamed(lambda _: "outcome") from None


def _named(found: Distributions, point: FloatArray) -> dict[str, float]:
    return {name: float(one[0]) for name, one in found.at_normal(point[None]).items()}


def _occurrences(occurs: _Occurs, k: int, runs: int, seed: int) -> FloatArray:
    """Samples of widened distributions in which the outcome occurs, (n, k)."""
    from scipy.special import ndtri

    count = min(runs // 2, _SEARCH_ONE) if k == 1 else max(64, int(_SEARCH * runs))
    points = ndtri(sobol(count // len(_SPREADS), k, seed))
    tried = np.concatenate([spread * points for spread in _SPREADS])
    # Those outside the range of the scan are moved towards the origin, to its edge.
    tried /= np.maximum(np.abs(tried).max(axis=1, keepdims=True) / _SCAN[-1], 1.0)
    return np.asarray(tried[occurs(tried)])


def _planes(
    occurs: _Occurs, hits: FloatArray, may_continue: Callable[[], bool]
) -> tuple[list[_Plane], bool]:
    """Tangent planes at the design points that are found from occurrences, the nearest plane first.

    The second value is whether each occurrence is behind one of them.

    hits         : occurrences, (n, k)
    may_continue : whether a further plane may be sought
    """
    planes: list[_Plane] = []
    for start in range(_STARTS):
        if not len(hits) or (planes and not may_continue()):
            break
        hits = hits[np.argsort(np.linalg.norm(hits, axis=1))]
        rays = np.unique(np.linspace(0, len(hits) - 1, min(_RAYS, len(hits))).astype(int))
        near = _approached(occurs, hits[rays])
        first = rays[np.argmin(np.linalg.norm(near, axis=1))]
        # Start well behind the boundary, so that it is found on lines beside this ray, too.
        new = _plane(occurs, hits[first], 1 if start else _ROUNDS)
        hits[rays] = near
        hits = np.delete(hits, first, axis=0)
        hits = hits[~new.covers(hits)]
        if not any(old.covers(new.point()) for old in planes):
            planes = [old for old in planes if not new.covers(old.point())] + [new]
        if len(new.normal) == 1:
            # With one parameter, the single line passes through all regions.
            hits = hits[:0]
    return sorted(planes, key=lambda one: one.distance), not len(hits)


def _approached(occurs: _Occurs, hits: FloatArray) -> FloatArray:
    """Occurrences close to the boundary, on the rays from the origin to given occurrences."""
    low, high = np.zeros((len(hits), 1)), np.ones((len(hits), 1))
    for _ in range(_RAY_HALVINGS):
        middle = 0.5 * (low + high)
        on = occurs(middle * hits)[:, None]
        low, high = np.where(on, low, middle), np.where(on, middle, high)
    return np.asarray(high * hits)


def _plane(occurs: _Occurs, nearest: FloatArray, rounds: int) -> _Plane:
    """The tangent plane of the boundary near an occurrence."""
    place = float(np.linalg.norm(nearest))
    direction = nearest / (place or 1.0)
    if not np.any(direction):
        direction[0] = 1.0
    k = len(direction)
    distance, place = _centred(occurs, direction, place)
    for _ in range(rounds if k > 1 and distance > _SCAN[0] else 0):
        across = _across(direction)
        bases = np.concatenate([_STEP * across, -_STEP * across])
        beside, _ = _region_at(occurs, bases, direction, place)
        beside[np.isinf(beside)] = np.nan
        rise = (beside[: k - 1] - beside[k - 1 :]) / (2.0 * _STEP)
        turned = direction - np.nan_to_num(rise) @ across
        turned /= np.linalg.norm(turned)
        # As far behind a plane boundary as before.
        reached, beyond = _centred(occurs, turned, place * float(turned @ direction))
        if not reached < distance:
            break
        direction, distance, place = turned, reached, beyond
    return _Plane(direction, distance, place)


def _centred(occurs: _Occurs, direction: FloatArray, place: float) -> tuple[float, float]:
    """Where the region at a place begins on the line through the origin, and a place in it.

    The place is the middle of the region if it is bounded, so that neighbouring lines pass through
    a thin region too.
    """
    low, high = (
        float(one[0]) for one in _region_at(occurs, np.zeros((1, len(direction))), direction, place)
    )
    middle = 0.5 * (low + high)
    return max(min(low, place), _SCAN[0]), middle if np.isfinite(middle) else place


def _across(direction: FloatArray) -> FloatArray:
    """Orthonormal directions perpendicular to a unit vector, (k - 1, k)."""
    k = len(direction)
    full = np.linalg.qr(np.column_stack([direction, np.eye(k)]))[0]
    return np.asarray(full[:, 1:k].T)


def _along_lines(
    occurs: _Occurs, planes: list[_Plane], left: Callable[[], int], seed: int
) -> list[FloatArray]:
    """For each plane, the probability of what belongs to it on each of a number of random lines.

    left : number of samples that may still be evaluated
    """
    from scipy.special import ndtr

    def shares(index: int, first: int, end: int) -> FloatArray:
        bases = _bases(planes[index].normal, end, seed + 1 + index)[first:]
        return _shares(occurs, planes, index, bases)

    several = len(planes) > 1
    pilots = _PILOTS_EACH if several else _PILOTS
    found, weights, costs = [], np.zeros(len(planes)), np.zeros(len(planes))
    for index, plane in enumerate(planes):
        before = left()
        one = shares(index, 0, pilots)
        found.append(one)
        # How often the outcome changes on a line determines its cost.
        costs[index] = (before - left()) / len(one)
        # The error of the sum is least if the numbers of lines are proportional to these.
        weights[index] = max(np.sqrt(_variance(one)), _LEAST_DEVIATION * ndtr(-plane.distance))
    weights /= weights.sum()
    more = max(_PILOTS_EACH if several else 0, int(left() / (weights @ costs)))
    ends = pilots + np.rint(more * weights).astype(int)
    return [
        np.append(one, shares(index, pilots, int(ends[index]))) for index, one in enumerate(found)
    ]


def _bases(direction: FloatArray, count: int, seed: int) -> FloatArray:
    """Where random lines along a direction cross the plane through the origin, (count, k).

    For one parameter there is one line.
    """
    from scipy.special import ndtri

    k = len(direction)
    if k == 1:
        return np.zeros((1, 1))
    return np.asarray(ndtri(sobol(count, k - 1, seed)) @ _across(direction))


def _shares(occurs: _Occurs, planes: list[_Plane], index: int, bases: FloatArray) -> FloatArray:
    """Probability, on each line along the normal of a plane, of what belongs to this plane."""
    own = planes[index]
    begins = np.full(len(bases), -np.inf)
    for other in planes[:index] + planes[index + 1 :]:
        ahead = bases @ other.normal + own.distance - other.distance
        begins = np.maximum(begins, ahead / (1.0 - own.normal @ other.normal))
    shares = np.zeros(len(bases))
    if len(bases):
        for line, low, high in _regions(occurs, bases, own.normal, own.place, begins):
            shares[line] += _normal_between(low, high)
    return shares


def _variance(shares: FloatArray) -> float:
    return float(shares.var(ddof=1)) if len(shares) > 1 else 0.0


def _region_at(
    occurs: _Occurs, bases: FloatArray, direction: FloatArray, place: float
) -> tuple[FloatArray, FloatArray]:
    """Both ends of the region of the outcome nearest to a place on each line; inf if none."""
    low, high, distances = np.full((3, len(bases)), np.inf)
    everywhere = np.full(len(bases), -np.inf)
    for line, begin, end in _regions(occurs, bases, direction, place, everywhere):
        distance = max(begin - place, place - end, 0.0)
        if distance < distances[line]:
            low[line], high[line], distances[line] = begin, end, distance
    return low, high


def _regions(
    occurs: _Occurs, bases: FloatArray, direction: FloatArray, place: float, begins: FloatArray
) -> list[tuple[int, float, float]]:
    """Parts of lines on which the outcome occurs: index of the line and both ends.

    place  : place that is also scanned on each line
    begins : position at which each line begins, (n,)
    """
    lines = np.arange(len(bases))
    scan = np.maximum(np.union1d(_SCAN, place), begins[:, None])
    # Places before the beginning of a line are moved to it, and only the last of them is evaluated.
    new = np.column_stack([scan[:, :-1] < scan[:, 1:], lines >= 0])
    on = np.zeros(scan.shape, bool)
    on[new] = occurs(bases[np.nonzero(new)[0]] + scan[new][:, None] * direction)
    on |= ~new & on[lines, new.argmax(axis=1)][:, None]
    which, step = np.nonzero(on[:, 1:] != on[:, :-1])
    low, high = scan[which, step], scan[which, step + 1]
    before = on[which, step]
    for _ in range(_HALVINGS if which.size else 0):
        middle = 0.5 * (low + high)
        same = occurs(bases[which] + middle[:, None] * direction) == before
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    changes = 0.5 * (low + high)
    found = []
    for line in lines.tolist():
        own = changes[which == line].tolist()
        ends = [float(begins[line]), *own] if on[line, 0] else own
        ends = [*ends, np.inf] if on[line, -1] else ends
        found += [(line, a, b) for a, b in zip(ends[::2], ends[1::2], strict=True)]
    return found


def _resolution() -> float:
    """Largest error of the position of a boundary, in standard deviations."""
    return float(0.5 * (_SCAN[1] - _SCAN[0]) / 2**_HALVINGS)


def _normal_between(low: float, high: float) -> float:
    """Probability of a standard normal number between two values, accurate in both tails."""
    from scipy.special import ndtr

    if low > 0.0:
        return float(ndtr(-low) - ndtr(-high))
    return float(ndtr(high) - ndtr(low))
