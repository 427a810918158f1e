"""``margin``: the values of a parameter for which a criterion holds."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from inspect import signature
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wedgebrake.analysis.sobol import sobol
from wedgebrake.arrays import FloatArray
from wedgebrake.errors import InputError
from wedgebrake.model.display import Result
from wedgebrake.model.machine import Machine
from wedgebrake.model.studies.sweep_settings import refuse_doubled, sweepable, tied_names, untied
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.model.validation import check_instance, check_number, check_whole, unknown, wrong
from wedgebrake.sweeps.outcomes import (
    LOCKED,
    OUTCOME,
    STICKS,
    UNDECIDED,
    UNSTABLE,
    check_limits,
    limit_name,
    with_probabilities,
)
from wedgebrake.sweeps.results import VARIABLES
from wedgebrake.sweeps.sampling import distributions, given_sample
from wedgebrake.sweeps.scatter import Evaluation, evaluation

STABLE, NO_LOCK, NO_STICKS = "stable", "no self-locking", "no stick-slip"
# The outcomes that must not occur, by criterion, and the criterion in words.
_CRITERIA = {
    STABLE: (UNSTABLE, "sliding is linearly stable"),
    NO_LOCK: ((LOCKED,), "the brake does not lock itself"),
    NO_STICKS: ((STICKS, UNDECIDED), "there is no stick-slip"),
}
# Halvings of a step of the scan: to rounding without runs, to a share of 1e-4 with them.
_HALVINGS, _HALVINGS_OF_RUNS = 44, 12
# How often the steps between the values of a range are halved where the criterion fails first: the
# error of an end is proportional to the square of such a step. Least distance from an end at which
# the criterion is examined beyond it, as a share of the range that is searched.
_ROUNDS, _BEYOND = 8, 1e-9
_EXAMPLE = "for example (-60.0, 0.0)"

Intervals = tuple[tuple[float, float], ...]


@dataclass(frozen=True, repr=False)
class Margin(Result):
    """The values of a parameter for which a criterion holds.

    parameter : name of the parameter
    unit      : its unit
    criterion : the criterion, as given
    value     : present value of the parameter
    holds     : whether the criterion holds at the present value
    low, high : ends of the interval in which the criterion holds that contains the present value,
                or of the nearest one; None for an end that is an end of ``between``; both None if
                the criterion holds nowhere
    margin    : distance from the present value to the nearer of ``low`` and ``high``, negative if
                the criterion does not hold at the present value; None if both are None
    between   : the range that was searched
    intervals : all intervals in which the criterion holds
    verdict   : the result in words
    """

    parameter: str
    unit: str
    criterion: str
    value: float
    holds: bool
    low: float | None
    high: float | None
    margin: float | None
    between: tuple[float, float]
    intervals: Intervals
    verdict: str

    @property
    def monotone(self) -> bool:
        """True if the criterion changes at most once within the range that was searched."""
        return len(self.intervals) <= 1 and None in (self.low, self.high)

    def as_dict(self) -> dict[str, Any]:
        """Plain values, for JSON."""
        return {**vars(self), "monotone": self.monotone}

    def _headline(self) -> str:
        return self.verdict


def margin(
    system: BrakedDriveline | Machine,
    parameter: str,
    criterion: str = STABLE,
    *,
    between: tuple[float, float],
    over: Mapping[Any, Any] | None = None,
    scatter: Any = None,
    quantile: float = 0.95,
    samples: int = 256,
    seed: int = 0,
    correlation: Any = None,
    points: int = 33,
    **options: Any,
) -> Margin:
    """Find the values of a parameter for which a criterion holds.

    Parameters
    ----------
    system : BrakedDriveline or Machine
        The system.
    parameter : str
        Name as in ``replace``, for example "slope" or "brake.slope".
    criterion : str
        "stable" (small vibration about sliding grows in no direction, and sliding exists),
        "no self-locking", "no stick-slip", or a result of a sweep below a limit, in SI units:
        "rms_torque < 20"; "amplitude" is half the range of the speed.
    between : (float, float)
        Range of the parameter that is searched.
    over : mapping
        Values of other parameters by name, at all of which the criterion must hold, as a list or
        array: ``{"kinetic": [0.28, 0.3, 0.32]}``. Several parameters span a grid. For one of them,
        a tuple of two numbers gives a range: ``{"frequency": (5.0, 40.0)}``. The range is examined
        at ``points`` values, and between these where the criterion fails first. Narrow peaks
        elsewhere are not detected.
    scatter : mapping or DataFrame
        Distributions of other parameters, as for ``wb.scatter``: the criterion must hold for at
        least the fraction ``quantile`` of the samples. Not together with ``over``.
    quantile, samples, seed, correlation
        This fraction, and the number, seed and correlation of the samples, which are the same for
        all values of the parameter.
    points : int
        Number of values of the scan, and of the first values of a range of ``over``. Two changes of
        the criterion between neighbouring values are not detected.
    **options
        Arguments of ``sweep`` for criteria that need simulations, such as ``periods`` and
        ``transient``.

    Returns
    -------
    Margin
        The interval, the distance of the present value from its ends, and the result in words.

    Undecided, failed and invalid samples do not meet the criterion. Where the equilibrium is at a
    corner, for example where a gap closes, sliding is stable if it is stable on both sides. Ends
    are located by bisection, to about 1e-12 of the range for criteria of linear stability, and to
    1e-5 for those that need simulations.

    Raises ``InputError`` for invalid arguments.
    """
    check_instance("system", system, BrakedDriveline | Machine, "a BrakedDriveline or a Machine")
    check_whole("points", points, 3, 100_000)
    unit = _unit(system, parameter)
    ends = _ends(between)
    bad, limits, words = _parsed(criterion)
    if over is not None and scatter is not None:
        raise InputError(
            "over and scatter: both given. In scatter, give the range of a parameter as a uniform"
            " distribution; in over, give its values."
        )
    share, others, suffix, span = 1.0, {}, "", None
    if scatter is not None:
        share = check_number("quantile", quantile, 0.0, 1.0)
        check_whole("samples", samples, 2, 1_000_000)
        others = _samples(scatter, samples, seed, correlation)
        count = len(next(iter(others.values())))
        suffix = f" for at least {100.0 * share:g} % of {count} samples of {', '.join(others)}"
    elif over is not None:
        axes, span = _axes(over, points)
        others = _grid(axes)
        suffix = f" at {' and '.join(_span(one, v, one == span) for one, v in axes.items())}"
    _check_others(system, parameter, others)
    varied, what = evaluation(system, {parameter: []}, bad, limits, options)
    for name in varied:
        if name != parameter:
            raise unknown(
                name, varied[name], signature(margin).parameters, "not an argument of margin"
            )
    what = what.without_store()
    bad = (*bad, *(limit_name(*one) for one in limits.items()))

    search = _Search(what, bad, parameter, others, share)
    scan = _Scan(np.linspace(*ends, points), _HALVINGS_OF_RUNS if what.runs else _HALVINGS)
    if span is None:
        intervals = search.intervals(scan)
    else:
        search, intervals = search.throughout(scan, axes, span)
    present = float(system.value(untied(parameter)[0]))
    holds = bool(search.holds(search.good(np.array([present])))[0])
    return _result(parameter, unit, criterion, present, holds, ends, intervals, f"{words}{suffix}")


def _unit(system: Any, parameter: Any) -> str:
    check_instance("parameter", parameter, str, "a name, for example 'brake.slope'")
    known = sweepable(system, [parameter])
    if parameter not in known:
        raise InputError(
            f"parameter = {parameter!r}: no such parameter of this system."
            f" {system.hint(parameter, list(known))}",
            name="parameter", value=parameter, allowed=tuple(known),
        )  # fmt: skip
    return known[parameter][0]


def _ends(between: Any) -> tuple[float, float]:
    allowed = f"two different numbers, {_EXAMPLE}"
    if not isinstance(between, tuple | list | np.ndarray) or len(between) != 2:
        raise wrong("between", between, allowed)
    low, high = sorted(check_number("between", one, allowed=allowed) for one in between)
    if low == high:
        raise wrong("between", between, allowed)
    return low, high


def _parsed(criterion: Any) -> tuple[tuple[str, ...], dict[str, float], str]:
    """The outcomes that must not occur, the limits of results, and the criterion in words."""
    check_instance("criterion", criterion, str, "a name")
    if criterion in _CRITERIA:
        bad, words = _CRITERIA[criterion]
        return bad, {}, words
    name, below, limit = criterion.partition("<")
    try:
        value = float(limit)
    except ValueError:
        below = ""
    if not below:
        raise wrong(
            "criterion", criterion,
            f"one of {', '.join(map(repr, _CRITERIA))}, or a result below a limit",
            "For example 'rms_torque < 20'.",
        )  # fmt: skip
    name = name.strip()
    try:
        check_limits({name: value})
    except InputError as error:
        raise error.renamed(lambda _: "criterion") from None
    variable = VARIABLES.get(name)
    unit = "rad/s" if name == "amplitude" else variable.unit if variable else "1"
    return (UNDECIDED,), {name: value}, f"{name} is below {value:g}{_after(unit)}"


def _after(unit: str) -> str:
    """A unit after a number: empty for plain numbers."""
    return "" if unit in ("1", "-") else f" {unit}"


def _samples(given: Any, samples: int, seed: int, correlation: Any) -> dict[str, FloatArray]:
    if hasattr(given, "columns"):  # a DataFrame
        given = {str(name): given[name].to_numpy() for name in given.columns}
    check_instance("scatter", given, Mapping, "a mapping of parameters to distributions")
    if not given:
        raise wrong("scatter", given, "distributions of at least one parameter")
    values = given_sample(given)
    if values is not None:
        return values
    found = distributions(given, correlation)
    return found.values(sobol(samples, len(found.quantiles), seed))


def _axes(given: Any, points: int) -> tuple[dict[str, FloatArray], str | None]:
    """Values of other parameters by name, and the name of the one with a range, if any."""
    check_instance("over", given, Mapping, "a mapping of parameters to their values")
    named = tied_names(given)
    ranges = [name for name, one in named.items() if isinstance(one, tuple) and len(one) == 2]
    if len(ranges) > 1:
        raise InputError(
            f"over: ranges of {' and '.join(ranges)}. Give a range of one parameter, as a tuple of"
            " two numbers, and values of the others, as lists.",
            name="over", value=given, allowed="a range of one parameter",
        )  # fmt: skip
    axes = {}
    for name, one in named.items():
        values = np.asarray(one, float).ravel()
        if not values.size or not np.all(np.isfinite(values)):
            raise wrong(f"over.{name}", given, "finite values, at least one")
        if name in ranges:
            if values[0] == values[1]:
                raise wrong(f"over.{name}", one, "a range between two different numbers")
            values = np.linspace(values.min(), values.max(), points)
        axes[name] = values
    return axes, ranges[0] if ranges else None


def _grid(axes: Mapping[str, FloatArray]) -> dict[str, FloatArray]:
    """All combinations of the values of several parameters."""
    grid = np.meshgrid(*axes.values(), indexing="ij")
    return {name: one.ravel() for name, one in zip(axes, grid, strict=True)}


def _span(name: str, values: FloatArray, throughout: bool) -> str:
    """The values of a parameter in words: between them nothing is claimed, except in a range."""
    each = np.unique(values)
    if each.size == 1:
        return f"{name} = {each[0]:g}"
    count = f"{each.size} values"
    if throughout:
        ends = f"all values of {name} from {each[0]:g} to {each[-1]:g}"
        return f"{ends} (examined at {count}, most closely where it fails first)"
    return f"{count} of {name} from {each[0]:g} to {each[-1]:g}"


class _Scan(NamedTuple):
    """The scan of the parameter: its values, and the bisections of a step with a change."""

    values: FloatArray
    halvings: int

    @property
    def beyond(self) -> float:
        """Distance from the located end of an interval to a value at which the criterion fails."""
        width, steps = float(np.ptp(self.values)), self.values.size - 1
        return width * max(2.0 ** (1 - self.halvings) / steps, _BEYOND)


def _check_others(system: Any, parameter: str, others: Mapping[str, Any]) -> None:
    for name in others:
        if name == parameter:
            raise InputError(
                f"{name}: this is the parameter whose margin is sought. Leave it out.",
                name=name, allowed="other parameters",
            )  # fmt: skip
        _unit(system, name)
        refuse_doubled(name, [parameter, *others])


@dataclass(frozen=True)
class _Search:
    """Where a criterion holds along a parameter.

    bad    : the outcomes that must not occur
    others : values of the other parameters by name, (sample,)
    share  : the fraction of these samples at which none of the outcomes may occur
    """

    what: Evaluation
    bad: tuple[str, ...]
    parameter: str
    others: Mapping[str, FloatArray]
    share: float

    def holds(self, good: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Whether the criterion holds, from the samples (value, sample) that are good."""
        return np.asarray(good.mean(axis=1) >= self.share - 1e-12)

    def good(self, values: FloatArray, which: NDArray[np.bool_] | None = None) -> NDArray[np.bool_]:
        """Whether none of the outcomes occurs, (value, sample), or of those pairs asked for."""
        count = len(next(iter(self.others.values()))) if self.others else 1
        asked = np.ones((values.size, count), bool) if which is None else which
        at, sample = np.nonzero(asked)
        good = np.zeros(asked.shape, bool)
        table = {self.parameter: values[at]}
        table |= {name: one[sample] for name, one in self.others.items()}
        try:
            dataset = self.what.results(table)
        except InputError as error:
            if error.name in self.what.settings:
                raise
            if error.name not in table:
                raise self._located(error, table) from None
            # No value of a parameter is valid: the criterion does not hold.
            return good
        dataset = with_probabilities(dataset, self.what.outcomes, self.what.limits)
        occurs = dataset["occurs"].sel({OUTCOME: list(self.bad)})
        good[asked] = (occurs == 0).all(OUTCOME).to_numpy()
        return good

    def _located(self, error: InputError, table: Mapping[str, FloatArray]) -> InputError:
        """The error with the first values at which it occurs, for which each is evaluated."""
        for row in zip(*table.values(), strict=True):
            values = dict(zip(table, row, strict=True))
            try:
                self.what.results({name: np.array([one]) for name, one in values.items()})
            except InputError as found:
                if found.name not in table:
                    at = ", ".join(f"{name} = {one:g}" for name, one in values.items())
                    text = f"{found} This is so at {at}; choose a range without it."
                    return InputError(
                        text, name=found.name, value=found.value, allowed=found.allowed
                    )
        return error

    def throughout(
        self, scan: _Scan, axes: Mapping[str, FloatArray], name: str
    ) -> tuple[_Search, Intervals]:
        """The intervals in which the criterion holds at all values of a range, and the search.

        This is an exchange method of semi-infinite programming: the intervals are found for a few
        values of the range, to which values are added at which the criterion may be violated.

        axes : values of the other parameters by name, including the first ones of the range
        name : of the parameter with the range
        """
        found, at = self.intervals(scan), np.sort(axes[name])
        for _ in range(_ROUNDS):
            middles = self._added_values(found, scan, {**axes, name: at}, name)
            if not middles.size:
                break
            closer = replace(self, others=_grid({**axes, name: middles})).intervals(scan)
            found, at = _intersection(found, closer), np.union1d(at, middles)
        return replace(self, others=_grid({**axes, name: at})), found

    def _added_values(
        self, found: Intervals, scan: _Scan, axes: Mapping[str, FloatArray], name: str
    ) -> FloatArray:
        """Further values of a range, midway between the present ones, that may move an end.

        The criterion fails at these values at an end of an interval, or at a neighbouring present
        value just beyond an end.
        """
        at = axes[name]
        middles, shape = 0.5 * (at[1:] + at[:-1]), [one.size for one in axes.values()]
        between = replace(self, others=_grid({**axes, name: middles}))
        own, place = replace(self, others=_grid(axes)), list(axes).index(name)
        wanted = np.zeros(middles.size, bool)
        low, high = scan.values[0], scan.values[-1]
        for end, way in [(pair[i], way) for pair in found for i, way in enumerate((-1, 1))]:
            shape[place] = middles.size
            wanted |= _fails(between.good(np.array([end])).reshape(shape), place)
            beyond = end + way * scan.beyond
            if low < beyond < high:
                shape[place] = at.size
                fails = _fails(own.good(np.array([beyond])).reshape(shape), place)
                wanted |= fails[1:] | fails[:-1]
        return np.asarray(middles[wanted])

    def intervals(self, scan: _Scan) -> Intervals:
        """The intervals in which the criterion holds: changes of a scan, refined by bisection."""
        values, halvings = scan
        good = self.good(values)
        on = self.holds(good)
        changes = np.flatnonzero(on[1:] != on[:-1])
        before = on[changes]
        low, high = values[changes], values[changes + 1]
        if changes.size:
            halved = self._halved(low, high, good[changes], good[changes + 1], halvings)
            # Of a sample that changes back within its bracket the halving does not know.
            sure = (self._hold(halved[0]) == before) & (self._hold(halved[1]) != before)
            low, high = np.where(sure, halved[0], low), np.where(sure, halved[1], high)
            for _ in range(0 if sure.all() else halvings):
                middle = np.where(sure, low, 0.5 * (low + high))
                same = self._hold(middle) == before
                low, high = np.where(same, middle, low), np.where(same | sure, high, middle)
        # The side on which it holds.
        edges = np.where(before, low, high).tolist()
        edges = [float(values[0]), *edges] if on[0] else edges
        edges = [*edges, float(values[-1])] if on[-1] else edges
        return tuple(zip(edges[::2], edges[1::2], strict=True))

    def _hold(self, values: FloatArray) -> NDArray[np.bool_]:
        return self.holds(self.good(values))

    def _halved(
        self, low: FloatArray, high: FloatArray, below: NDArray[np.bool_],
        above: NDArray[np.bool_], halvings: int,
    ) -> tuple[FloatArray, FloatArray]:  # fmt: skip
        """Halve brackets; a sample that is as good at one end as at the other remains so."""
        before = self.holds(below)
        for _ in range(halvings):
            middle, differ = 0.5 * (low + high), below != above
            good = np.where(differ, self.good(middle, differ), below)
            same = self.holds(good) == before
            low, high = np.where(same, middle, low), np.where(same, high, middle)
            below = np.where(same[:, None], good, below)
            above = np.where(same[:, None], above, good)
        return low, high


def _fails(good: NDArray[np.bool_], axis: int) -> NDArray[np.bool_]:
    """Whether the criterion fails at a value along an axis, for any values along the others."""
    return np.asarray(~np.moveaxis(good, axis, 0).reshape(good.shape[axis], -1).all(axis=1))


def _intersection(one: Intervals, other: Intervals) -> Intervals:
    """What two unions of intervals have in common."""
    found = [(max(a, c), min(b, d)) for a, b in one for c, d in other]
    return tuple((low, high) for low, high in found if low <= high)


def _result(
    parameter: str, unit: str, criterion: str, present: float, holds: bool,
    ends: tuple[float, float], intervals: Intervals, words: str,
) -> Margin:  # fmt: skip
    in_unit = _after(unit)
    searched = f"{parameter} from {ends[0]:g} to {ends[1]:g}{in_unit}"
    low = high = distance = None
    if not intervals:
        verdict = f"There is no value of {searched} for which {words}."
    else:
        own = min(intervals, key=lambda one: max(one[0] - present, present - one[1], 0.0))
        low, high = (None if one == end else one for one, end in zip(own, ends, strict=True))
        gaps = [abs(present - one) for one in (low, high) if one is not None]
        distance = (min(gaps) if holds else -min(gaps)) if gaps else None
        verdict = f"{_where(parameter, own, (low, high), in_unit)}, {words}."
        if distance is not None:
            what = "leaves a margin of" if holds else "violates this by"
            verdict += f" The present value, {present:.6g}, {what} {abs(distance):.4g}{in_unit}."
        if len(intervals) > 1:
            listed = ", ".join(f"{one:.5g} to {other:.5g}" for one, other in intervals)
            verdict += f" The criterion is not monotone: it holds for {listed}."
    return Margin(
        parameter, unit, criterion, present, holds, low, high, distance, ends, intervals, verdict
    )


def _where(
    parameter: str, own: tuple[float, float], ends: tuple[float | None, ...], unit: str
) -> str:
    """The interval in words."""
    low, high = ends
    if low is None and high is None:
        return f"For all values of {parameter} from {own[0]:g} to {own[1]:g}{unit}"
    if high is None:
        return f"For {parameter} above {low:.6g}{unit} (searched up to {own[1]:g})"
    if low is None:
        return f"For {parameter} below {high:.6g}{unit} (searched down to {own[0]:g})"
    return f"For {parameter} from {low:.6g} to {high:.6g}{unit}"
