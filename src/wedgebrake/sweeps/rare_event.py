"""``rare_event``: the small probability of an outcome, by line sampling.

In independent standard normal coordinates, lines are drawn parallel to the direction from the
origin to the design point. On each line the boundary of the outcome is located by bisection, and
the normal probability beyond it is exact, so that it varies little from line to line. The mean over
the lines is unbiased for a region of any shape, as long as no part of it is thinner than the step
of the scan of a line.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wedgebrake._version import __version__
from wedgebrake.arrays import FloatArray
from wedgebrake.errors import InputError
from wedgebrake.model.machine import Machine
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.model.validation import check_instance, check_whole, wrong
from wedgebrake.sweeps.outcomes import (
    MEANINGS,
    NORMAL95,
    OUTCOME,
    SAFE,
    UNKNOWN,
    check_limits,
    limit_name,
    with_probabilities,
)
from wedgebrake.sweeps.sampling import Distributions, distributions, given_sample, sobol
from wedgebrake.sweeps.scatter import evaluation

if TYPE_CHECKING:
    import xarray as xr

# Places on a line that are scanned, and halvings of the step in which the outcome changes.
_SCAN = np.linspace(-8.0, 8.0, 9)
_HALVINGS = 14
# Share of the runs that search for the direction, and by how much they are spread.
_SEARCH, _SPREADS = 0.05, (2.0, 3.5, 6.0)
# Improvements of the direction, and the step of its differences.
_ROUNDS, _STEP = 2, 0.3
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
        Frozen distributions of ``scipy.stats`` by name of the parameter, as for ``scatter``.
    outcome : str
        Name of an outcome of ``scatter``, or a result with its limit: "rms_torque > 20".
    runs : int
        Maximum number of samples that are evaluated.
    seed, correlation, **options
        As for ``scatter``.

    Returns
    -------
    xarray.Dataset
        ``probability``, its ``standard_error`` and the ends ``low`` and ``high`` of its 95 %
        interval; the numbers ``lines`` of lines and ``runs`` of evaluated samples; and over
        ``parameter`` the ``design_point``, the most probable values for which the outcome occurs.
        If the outcome of a sample is not known, it is assumed to occur; ``unknown`` is the number
        of these samples. If no occurrence is found within 8 standard deviations, ``probability`` is
        0 and ``high`` is nan.

    Raises ``InputError`` for invalid arguments.
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
            "Rare outcomes need distributions; for a given sample, use wb.scatter.",
        )  # fmt: skip
    found = distributions(varied, correlation)
    count = {"runs": 0, "unknown": 0}

    def occurs(points: FloatArray) -> NDArray[np.bool_]:
        dataset = what.results(found.at_normal(points))
        dataset = with_probabilities(dataset, what.outcomes, what.limits)
        codes = dataset["occurs"].sel({OUTCOME: name}).to_numpy()
        count["runs"] += len(points)
        count["unknown"] += int(np.count_nonzero(codes == UNKNOWN))
        return np.asarray(codes != 0)

    nearest = _nearest(occurs, len(found.quantiles), runs, seed)
    values = dict.fromkeys(("probability", "standard_error", "low"), 0.0)
    lines, high, point = 0, np.nan, dict.fromkeys(found.quantiles, np.nan)
    if nearest is not None:
        direction, distance = _direction(occurs, nearest)
        shares = _along_lines(occurs, direction, runs - count["runs"], seed)
        lines = len(shares)
        mean = float(shares.mean())
        error = float(shares.std(ddof=1)) / np.sqrt(lines) if lines > 1 else 0.0
        # Of the logarithm, which is nearer to normal, and the error of the bisection.
        width = NORMAL95 * error / mean + 8.0 * _resolution() if mean > 0.0 else 0.0
        values = {
            "probability": mean, "standard_error": error, "low": mean * np.exp(-width)
        }  # fmt: skip
        high = min(1.0, mean * np.exp(width))
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
    """The name of an outcome, and the limit of a result if it is one."""
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
        raise wrong("outcome", outcome, "a result with its limit, as 'rms_torque > 20'") from None
    name = result.strip()
    try:
        return limit_name(name, value), check_limits({name: value})
    except InputError as error:
        raise error.renamed(lambda _: "outcome") from None


def _named(found: Distributions, point: FloatArray) -> dict[str, float]:
    return {name: float(one[0]) for name, one in found.at_normal(point[None]).items()}


def _nearest(occurs: _Occurs, k: int, runs: int, seed: int) -> FloatArray | None:
    """The point nearest to the origin among samples that are spread until the outcome occurs."""
    from scipy.special import ndtri

    points = ndtri(sobol(max(64, int(_SEARCH * runs)) // len(_SPREADS), k, seed))
    for spread in _SPREADS:
        tried = spread * points
        tried = tried[np.abs(tried).max(axis=1) <= _SCAN[-1]]
        hits = tried[occurs(tried)]
        if len(hits):
            return np.asarray(hits[np.argmin(np.linalg.norm(hits, axis=1))])
    return None


def _direction(occurs: _Occurs, nearest: FloatArray) -> tuple[FloatArray, float]:
    """The unit normal of the boundary near a point, and the distance of the boundary along it."""
    direction = nearest / (np.linalg.norm(nearest) or 1.0)
    if not np.any(direction):
        direction[0] = 1.0
    k = len(direction)
    distance = _first(occurs, np.zeros((1, k)), direction)[0]
    for _ in range(_ROUNDS if k > 1 and np.isfinite(distance) else 0):
        across = _across(direction)
        beside = _first(occurs, np.concatenate([_STEP * across, -_STEP * across]), direction)
        rise = (beside[: k - 1] - beside[k - 1 :]) / (2.0 * _STEP)
        turned = direction - np.where(np.isfinite(rise), rise, 0.0) @ across
        turned /= np.linalg.norm(turned)
        reached = _first(occurs, np.zeros((1, k)), turned)[0]
        if not reached < distance:
            break
        direction, distance = turned, reached
    return direction, float(distance)


def _across(direction: FloatArray) -> FloatArray:
    """Orthonormal directions perpendicular to a unit vector, (k - 1, k)."""
    k = len(direction)
    full = np.linalg.qr(np.column_stack([direction, np.eye(k)]))[0]
    return np.asarray(full[:, 1:k].T)


def _along_lines(occurs: _Occurs, direction: FloatArray, runs: int, seed: int) -> FloatArray:
    """Probability of the outcome on each of some random lines along the direction."""
    from scipy.special import ndtri

    k = len(direction)
    # Two changes of the outcome on a line are found at this cost.
    lines = 1 if k == 1 else max(8, runs // (len(_SCAN) + _HALVINGS + 2))
    bases = np.zeros((1, 1))
    if k > 1:
        bases = ndtri(sobol(lines, k - 1, seed + 1)) @ _across(direction)
    shares = np.zeros(lines)
    for line, low, high in _regions(occurs, bases, direction):
        shares[line] += _normal_between(low, high)
    return shares


def _first(occurs: _Occurs, bases: FloatArray, direction: FloatArray) -> FloatArray:
    """The place on each line at which its last region of the outcome begins; inf: nowhere."""
    found = np.full(len(bases), np.inf)
    for line, low, _ in _regions(occurs, bases, direction):
        found[line] = low
    return found


def _regions(
    occurs: _Occurs, bases: FloatArray, direction: FloatArray
) -> list[tuple[int, float, float]]:
    """Parts of lines on which the outcome occurs: number of the line and both ends."""
    lines = len(bases)
    places = (bases[:, None] + _SCAN[None, :, None] * direction).reshape(-1, len(direction))
    on = occurs(places).reshape(lines, -1)
    which, step = np.nonzero(on[:, 1:] != on[:, :-1])
    low, high = _SCAN[step], _SCAN[step + 1]
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
    """Error of the place of a boundary in standard deviations."""
    return float(0.5 * (_SCAN[1] - _SCAN[0]) / 2**_HALVINGS)


def _normal_between(low: float, high: float) -> float:
    """Probability of a standard normal number between two values, accurate in both tails."""
    from scipy.special import ndtr

    if low > 0.0:
        return float(ndtr(-low) - ndtr(-high))
    return float(ndtr(high) - ndtr(low))
