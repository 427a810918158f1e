"""``rare_event``: the small probability of an outcome, by line sampling.

In independent standard normal coordinates, the lines are parallel to the direction from the origin
to the design point. On each line, the boundary of the outcome is located by bisection, and the
normal probability beyond it is exact, so that it varies little from line to line. The mean over the
lines is unbiased for a region of any shape if no part of it is thinner than the step in which a
line is scanned. A thinner region, such as a resonance, is found if the lines pass through it where
the nearest occurrence was found, because this place is scanned too.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

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
# Share of the runs in which the direction is sought, and the factors by which they are spread.
_SEARCH, _SPREADS = 0.05, (2.0, 3.5, 6.0)
# For one parameter, whose single line costs little, half the runs search, but at most so many.
_SEARCH_ONE = 600
# Number of improvements of the direction, and the step of their finite differences.
_ROUNDS, _STEP = 2, 0.3
# Number of lines from which the cost of a line is estimated.
_PILOTS = 8
_FEWEST, _MOST = 500, 10_000_000

_Occurs = Callable[[FloatArray], NDArray[np.bool_]]


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
    by bisection, and the probability beyond it is computed exactly.

    Parameters
    ----------
    system : BrakedDriveline or Machine
        The system whose parameters are varied.
    over : mapping
        Frozen distribution of ``scipy.stats`` of each parameter by name, as for ``scatter``.
    outcome : str
        Name of an outcome of ``scatter``, or a result with its limit, such as "rms_torque > 20".
    runs : int
        Approximate number of samples to evaluate, at least 500. With many parameters, the search
        for the direction alone can exceed a small number.
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
        region is too thin, ``probability``, ``low`` and ``high`` are nan.

    A line is scanned in steps of 2 standard deviations. Regions that are thinner along the lines
    and far from the nearest occurrence can be missed: the probability is then too small, and the
    interval does not show this.

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

    nearest = _nearest(occurs, len(found.quantiles), runs, seed)
    if not slides:
        missing, other = DIRECTIONS if name == UNSTABLE[0] else DIRECTIONS[::-1]
        raise wrong(
            "outcome", name, "instability in a direction in which the system slides",
            f"No sample slides {missing}. Choose unstable_{other}.",
        )  # fmt: skip
    values = dict.fromkeys(("probability", "standard_error", "low"), 0.0)
    lines, high, point = 0, np.nan, dict.fromkeys(found.quantiles, np.nan)
    if nearest is not None:
        direction, distance, place = _direction(occurs, nearest)
        shares = _along_lines(occurs, direction, place, runs - count["runs"], seed)
        lines = len(shares)
        mean = float(shares.mean()) or np.nan
        error = float(shares.std(ddof=1)) / np.sqrt(lines) if lines > 1 else 0.0
        # That of the logarithm, whose distribution is closer to normal, and of the bisection.
        width = NORMAL95 * error / mean + 8.0 * _resolution()
        values = {
            "probability": mean, "standard_error": error, "low": mean * np.exp(-width)
        }  # fmt: skip
        high = np.minimum(1.0, mean * np.exp(width))
        point = _named(found, max(distance, 0.0) * direction)
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


def _nearest(occurs: _Occurs, k: int, runs: int, seed: int) -> FloatArray | None:
    """The occurrence nearest to the origin, among samples spread wider until there is one."""
    from scipy.special import ndtri

    count = min(runs // 2, _SEARCH_ONE) if k == 1 else max(64, int(_SEARCH * runs))
    points = ndtri(sobol(count // len(_SPREADS), k, seed))
    for spread in _SPREADS:
        tried = spread * points
        tried = tried[np.abs(tried).max(axis=1) <= _SCAN[-1]]
        hits = tried[occurs(tried)]
        if len(hits):
            return np.asarray(hits[np.argmin(np.linalg.norm(hits, axis=1))])
    return None


def _direction(occurs: _Occurs, nearest: FloatArray) -> tuple[FloatArray, float, float]:
    """The unit normal of the boundary near a point; the positions on it of boundary and region."""
    place = float(np.linalg.norm(nearest))
    direction = nearest / (place or 1.0)
    if not np.any(direction):
        direction[0] = 1.0
    k = len(direction)
    distance, place = _centred(occurs, direction, place)
    for _ in range(_ROUNDS if k > 1 and np.isfinite(distance) else 0):
        across = _across(direction)
        bases = np.concatenate([_STEP * across, -_STEP * across])
        beside, _ = _region_at(occurs, bases, direction, place)
        rise = (beside[: k - 1] - beside[k - 1 :]) / (2.0 * _STEP)
        turned = direction - np.where(np.isfinite(rise), rise, 0.0) @ across
        turned /= np.linalg.norm(turned)
        # As far behind a plane boundary as before.
        reached, beyond = _centred(occurs, turned, place * float(turned @ direction))
        if not reached < distance:
            break
        direction, distance, place = turned, reached, beyond
    return direction, distance, place


def _centred(occurs: _Occurs, direction: FloatArray, place: float) -> tuple[float, float]:
    """Where the region at a place begins on the line through the origin, and a place in it.

    The place is the middle of the region if it is bounded, so that neighbouring lines pass through
    a thin region too.
    """
    low, high = (
        float(one[0]) for one in _region_at(occurs, np.zeros((1, len(direction))), direction, place)
    )
    middle = 0.5 * (low + high)
    return min(low, place), middle if np.isfinite(middle) else place


def _across(direction: FloatArray) -> FloatArray:
    """Orthonormal directions perpendicular to a unit vector, (k - 1, k)."""
    k = len(direction)
    full = np.linalg.qr(np.column_stack([direction, np.eye(k)]))[0]
    return np.asarray(full[:, 1:k].T)


def _along_lines(
    occurs: _Occurs, direction: FloatArray, place: float, runs: int, seed: int
) -> FloatArray:
    """Probability of the outcome on each of a number of random lines along the direction."""
    from scipy.special import ndtri

    k, scan = len(direction), len(_SCAN) + 1
    most = 1 if k == 1 else max(_PILOTS, runs // scan)
    bases = np.zeros((1, 1))
    if k > 1:
        bases = ndtri(sobol(most, k - 1, seed + 1)) @ _across(direction)
    # The first lines show how often the outcome changes on a line, which determines its cost.
    pilots = _regions(occurs, bases[:_PILOTS], direction, place)
    changes = int(np.isfinite([ends for _, *ends in pilots]).sum())
    cost = scan + _HALVINGS * changes / min(most, _PILOTS)
    lines = min(most, max(_PILOTS, int(runs / cost)))
    shares = np.zeros(lines)
    rest = bases[_PILOTS:lines]
    others = _regions(occurs, rest, direction, place) if len(rest) else []
    further = [(_PILOTS + line, low, high) for line, low, high in others]
    for line, low, high in pilots + further:
        shares[line] += _normal_between(low, high)
    return shares


def _region_at(
    occurs: _Occurs, bases: FloatArray, direction: FloatArray, place: float
) -> tuple[FloatArray, FloatArray]:
    """Both ends of the region of the outcome nearest to a place on each line; inf if none."""
    low, high, distances = np.full((3, len(bases)), np.inf)
    for line, begin, end in _regions(occurs, bases, direction, place):
        distance = max(begin - place, place - end, 0.0)
        if distance < distances[line]:
            low[line], high[line], distances[line] = begin, end, distance
    return low, high


def _regions(
    occurs: _Occurs, bases: FloatArray, direction: FloatArray, place: float
) -> list[tuple[int, float, float]]:
    """Parts of lines on which the outcome occurs: index of the line and both ends.

    place : place that is also scanned on each line
    """
    lines, scan = len(bases), np.union1d(_SCAN, place)
    places = (bases[:, None] + scan[None, :, None] * direction).reshape(-1, len(direction))
    on = occurs(places).reshape(lines, -1)
    which, step = np.nonzero(on[:, 1:] != on[:, :-1])
    low, high = scan[step], scan[step + 1]
    before = on[which, step]
    for _ in range(_HALVINGS if which.size else 0):
        middle = 0.5 * (low + high)
        same = occurs(bases[which] + middle[:, None] * direction) == before
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    changes = 0.5 * (low + high)
    found = []
    for line in range(lines):
        own = changes[which == line].tolist()
        ends = [-np.inf, *own] if on[line, 0] else own
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
