"""``wb.fit``: parameters of a system, fitted to a measured trace, measured numbers, or both."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from wedgebrake.analysis.derivatives.task import checked_names
from wedgebrake.analysis.fitting.estimate import Estimate, FitProblem, Loss, product
from wedgebrake.analysis.fitting.features import starts_by_features
from wedgebrake.analysis.fitting.filters import (
    LAGS,
    SIGNIFICANCE,
    ColumnNear,
    Explanation,
    explained,
    independence_p,
)
from wedgebrake.analysis.fitting.model import Known, Model, Simulated
from wedgebrake.analysis.fitting.numbers import Numbers, check_window, numbers_of
from wedgebrake.analysis.fitting.observation import Observation, observations_of, settings_of
from wedgebrake.analysis.fitting.segments import SegmentedModel, check_states
from wedgebrake.analysis.fitting.shooting import Shooting
from wedgebrake.analysis.fitting.times import remarks_on_times
from wedgebrake.analysis.fitting.trace import Trace, read_trace
from wedgebrake.arrays import FloatArray
from wedgebrake.errors import InputError
from wedgebrake.model.machine import Machine
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.model.validation import check_choice, check_instance, check_whole, unknown, wrong
from wedgebrake.solvers.interrupts import interruptible
from wedgebrake.solvers.task import check_state

if TYPE_CHECKING:
    import xarray as xr

_STARTS = ("values", "features")
_LOSSES = ("linear", "soft_l1", "huber", "cauchy", "arctan")
# Greatest correlation of an inverted column with the model, for a remark.
_INVERTED = -0.5
# Residuals up to this size, relative to the column, are rounding errors.
_ROUNDING = 1e-6
# Fewest samples of a segment.
_FEWEST = 4
# Share of the variance of a column above which its residuals are as large as the column itself.
_NOTHING = 0.9
# For a remark on a measured number: its distance from the fit in standard deviations; and its
# derivative, with the range of the parameter and its own size as units, as in chaotic motion.
_FAR, _STEEP = 4.0, 1e6


@dataclass(frozen=True)
class Fit:
    """Fitted parameters with their covariance, residuals and remarks: the result of ``wb.fit``.

    Attributes
    ----------
    system : BrakedDriveline or Machine
        The system with the fitted values.
    values, stderr : dict
        Fitted value and standard error of each free parameter, in its unit. The standard error is
        inf if the measurement does not determine the parameter, and nan if the fit has not
        converged.
    covariance, correlation : xarray.DataArray
        Covariance and correlation matrix of the values, over (``parameter``, ``other``).
    data : xarray.Dataset
        ``measured``, ``fitted`` and ``residual`` of each column, over (``column``, ``time``). With
        measured numbers also ``number_measured``, ``number_sigma`` (their standard deviations),
        ``number_fitted`` and ``number_residual`` over ``number``.
    undetermined : list of str
        A sentence for each parameter, or combination of parameters, that the measurement does not
        determine.
    remarks : list of str
        Signs of a clipped, filtered or inverted column, of lost samples after which the others were
        renumbered, of a wrong scale of the times, residuals that are not independent, an
        order of events that has changed during the fit, and measured numbers that are far from the
        fit, or whose derivatives do not exist or are too large for a fit.
    converged : bool
        Whether a convergence criterion of ``scipy.optimize.least_squares`` is met or, with
        segments, of the method that closes the gaps between them.
    message : str
        The message of the method.
    evaluations : int
        Number of simulations of the trace or of a part of it.
    start : str
        ``"features"`` if this fit started from values that were found by features of the trace,
        ``"values"`` if it started from those of the system.
    start_values : dict
        The values of the free parameters from which this fit started.
    """

    kind: ClassVar[str] = "fit"

    system: BrakedDriveline | Machine
    values: dict[str, float]
    stderr: dict[str, float]
    covariance: xr.DataArray
    correlation: xr.DataArray
    data: xr.Dataset
    undetermined: list[str]
    remarks: list[str]
    converged: bool
    message: str
    evaluations: int
    start: str
    start_values: dict[str, float]
    _problem: FitProblem

    @property
    def rms(self) -> dict[str, float]:
        """Root mean square of the residual of each column, in its unit."""
        found: FloatArray = np.sqrt(np.nanmean(self.data["residual"].to_numpy() ** 2, axis=1))
        return dict(zip(map(str, self.data["column"].to_numpy()), found.tolist(), strict=True))

    @property
    def numbers(self) -> dict[str, dict[str, Any]]:
        """``measured``, ``sigma``, ``fitted``, ``residual`` and ``unit`` of each measured number.

        The residual is measured minus fitted.
        """
        if "number" not in self.data:
            return {}
        names, words = self.data["number"].to_numpy(), ("measured", "sigma", "fitted", "residual")
        return {
            str(name): {word: float(self.data[f"number_{word}"][row]) for word in words}
            | {"unit": str(self.data["number_unit"].to_numpy()[row])}
            for row, name in enumerate(names)
        }

    def interval(self, level: float = 0.95) -> dict[str, tuple[float, float]]:
        """Confidence intervals of the values.

        They follow from Student's t distribution, or from the normal distribution if standard
        deviations of the measurement are given.

        level : confidence level, between 0 and 1
        """
        from scipy import stats

        freedom = max(int(np.isfinite(self.data["residual"]).sum()) - len(self.values), 1)
        at = 0.5 + 0.5 * level
        known = self._problem.known
        wide = float(stats.norm.ppf(at) if known else stats.t.ppf(at, freedom))
        return {
            name: (value - wide * self.stderr[name], value + wide * self.stderr[name])
            for name, value in self.values.items()
        }

    def profile(self, name: str, values: Any) -> xr.Dataset:
        """Profile of the sum of squares: its minimum over all other parameters.

        name   : name of the parameter
        values : values at which it is fixed; the other parameters start from their fitted values

        Returns a Dataset over the parameter: ``cost``, the sum of squares of the residuals divided
        by sigma, and the fitted values of the other parameters.
        """
        import xarray as xr

        if name not in self.values:
            raise unknown("name", name, list(self.values), "no free parameter")
        problem, at = self._problem, np.atleast_1d(np.asarray(values, float))
        others = {one: two for one, two in problem.free.items() if one != name}
        costs, rows = [], []
        for value in at:
            model = _fixed(problem.model, name, float(value))
            found = replace(problem, model=model, free=others).solve(
                {one: self.values[one] for one in others}
            )
            costs.append(product(found.residuals, found.residuals))
            rows.append(list(found.values.values()))
        columns = np.array(rows).reshape(at.size, len(others)).T
        each = zip(others, columns, strict=True)
        return xr.Dataset(
            {"cost": (name, costs), **{one: (name, two) for one, two in each}}, {name: at}
        )

    @property
    def warnings(self) -> list[str]:
        """Warnings as sentences: strong correlations, ``undetermined`` and ``remarks``."""
        matrix, names = self.correlation.to_numpy(), list(self.values)
        pairs = [
            (abs(matrix[i, j]), names[i], names[j], matrix[i, j])
            for i in range(len(names)) for j in range(i) if abs(matrix[i, j]) > 0.9
        ]  # fmt: skip
        correlated = [
            f"Correlation of {other} and {one}: {value:.4f}"
            for _, one, other, value in sorted(pairs, reverse=True)
        ]
        return [*correlated, *self.undetermined, *self.remarks]

    @property
    def outcome(self) -> str:
        """Whether the fit has converged, in a sentence."""
        end = "Converged" if self.converged else "Not converged"
        return f"{end} after {self.evaluations} simulations: {self.message}"

    def report(self) -> str:
        """Values, standard errors, correlations and remarks as text."""
        units, lines = self.covariance["unit"].to_numpy(), ["Fitted values"]
        if not self.converged:
            lines = [
                self.outcome,
                "Final values, which are not at a minimum and therefore have no standard errors",
            ]
        wide = max(map(len, self.values))
        for (name, value), unit in zip(self.values.items(), units, strict=True):
            error, unit = self.stderr[name], "" if unit == "1" else f" {unit}"
            share = f" ({abs(100.0 * error / value):.3g} %)" if value and np.isfinite(error) else ""
            told = f"standard error {error:.3g}{share}" if np.isfinite(error) else "not determined"
            told = "" if np.isnan(error) else f"  {told}"
            lines.append(f"  {name:<{wide}}  {value:.8g}{unit}{told}")
        if self.rms:
            rms = ", ".join(f"{name} {one:.4g}" for name, one in self.rms.items())
            lines.append(f"Root mean square of the residuals: {rms}")
        for name, one in self.numbers.items():
            lines.append(
                f"  {name}  measured {one['measured']:.8g} ± {one['sigma']:.2g} {one['unit']},"
                f" fitted {one['fitted']:.8g}"
            )
        if self.start == "features":
            each = ", ".join(f"{name} {value:.4g}" for name, value in self.start_values.items())
            lines.append(f"Starting values, found by features: {each}")
        lines += self.warnings
        return "\n".join([*lines, self.outcome] if self.converged else lines)

    def __repr__(self) -> str:
        return self.report()


def fit(
    system: BrakedDriveline | Machine,
    trace: Any,
    free: Mapping[str, tuple[float, float]],
    *,
    observe: Mapping[str, str] | None = None,
    measured: Mapping[str, tuple[float, float]] | None = None,
    window: tuple[float, float] | None = None,
    time: str | None = None,
    initial: tuple[float, float] | None = None,
    sigma: Mapping[str, float] | None = None,
    loss: str = "linear",
    loss_scale: float = 1.0,
    method: str | None = None,
    segments: int = 1,
    start: str = "values",
    progress: Callable[[int], None] | None = None,
) -> Fit:
    """Fit parameters of a system to measurements by least squares, with exact derivatives.

    The measurements are a trace, numbers that describe the motion, or both. The response is
    simulated from the first sample on and compared with the columns of the trace and the numbers.
    A free initial condition that a column measures starts from the first sample. A short initial
    part of the trace is fitted first, then longer ones, so that the vibration of the model does not
    shift by a period against the measured one. Derivatives are those of ``sensitivity``.

    Parameters
    ----------
    system : BrakedDriveline or Machine
        The system; the fit starts from its values, see also ``start``.
    trace : xarray.Dataset, pandas.DataFrame, mapping of arrays, path or None
        Columns over time, or the path of a .csv, .mat (``scipy.io``) or .nc file with them, in SI
        units; columns with a unit in their names, such as ``"time [ms]"`` and ``"speed [rpm]"``,
        are converted if they are times, angles, speeds, torques or forces; so are those with a unit
        in ``attrs["units"]`` or in the metadata of a .tdms, .mf4 or .uff file. Samples that are nan
        are left out. None: only the numbers of ``measured`` are fitted.
    free : mapping
        Lower and upper bound of each free parameter by name. Free can be: parameters with the names
        that ``replace`` takes; the initial state, ``"disc.speed"`` or for a driveline
        ``"initial_velocity"``; ``"time_shift"`` [s], which is added to the times of the trace; and
        the scale and offset of a column, such as ``"velocity.scale"`` and ``"velocity.offset"``:
        the column measures scale * quantity + offset. Shift, scale and offset start from 0, 1 and
        0, or from the middle of the range if it does not contain this value.
    observe : mapping, optional
        Quantity that each column measures: ``"disc.speed"``, ``"disc.angle"``, ``"shaft.torque"``,
        ``"brake.torque"`` (on the first inertia of the contact), ``"brake.force"``. If the system
        has only one part of the kind, also the variable of the response, such as ``"velocity"``.
        Default: the columns with the name of a quantity, with or without a unit of this quantity.
    measured : mapping, optional
        Value and standard deviation of each measured number, which describes the motion in
        ``window``. Names begin with that of a part: ``"disc.period"``, mean time between upward
        passages of the speed through its mean [s]; ``"brake.stick_time"``, mean duration of the
        sticks that begin and end in the window [s]; ``"disc.harmonic_2"``, amplitude of the speed
        at twice the frequency of the signals or, without a common period of signals, of the
        vibration, over the last whole periods [rad/s]; ``"disc.order_2"``, amplitude of the speed
        at two cycles per turn of the inertia, over the last whole turns [rad/s]; and the measures
        of ``sensitivity``, such as ``"brake.peak_torque"`` or ``"disc.rms_velocity"``. The name of
        the part can be omitted if there is only one of its kind. With measured numbers, the columns
        of a trace need ``sigma``, and ``time_shift`` cannot be free.
    window : (start, end), optional
        Times between which the numbers were measured [s]. Default: the whole trace. Required
        without a trace: the run then starts at 0 and ends with the window.
    time : str, optional
        Name of the column of times. Default: ``"time"`` or ``"t"``, also with a unit, or the first
        column.
    initial : (angle, velocity), optional
        State of a driveline at the first sample. Default: (0, 0). A machine starts from the values
        of its inertias.
    sigma : mapping, optional
        Standard deviation of the measurement noise of each column, in SI units. Default: columns
        are weighted by their own standard deviation, and the covariance is scaled with the
        residuals.
    loss, loss_scale : str, float
        Loss function of ``scipy.optimize.least_squares``; ``"soft_l1"`` or ``"huber"`` reduces the
        influence of outliers. ``loss_scale`` is the residual, divided by sigma, above which the
        loss departs from the square.
    method : {"exact", "smooth"}, optional
        As in ``simulate``.
    segments : int
        Number of segments of the trace, with about equal numbers of samples (multiple shooting),
        for long or chaotic traces. Each segment is simulated from its own initial state; these
        states are fitted too, under the condition that each segment continues the one before it.
        The first one starts from the initial state of the system. At most a quarter of the number
        of samples; not with ``measured``.
    start : {"values", "features"}, optional
        Values from which the fit starts. ``"values"``, the default: those of the system.
        ``"features"``: those of the system, and values within the ranges of ``free`` at which the
        simulated columns have features, such as mean, range and frequencies, most like those of the
        trace. The ranges are covered by 512 simulations (64 with measured numbers), the trace is
        fitted from the best 4 of them and from the values of the system, and the best fit is
        returned. The values of the system then need not lie within the ranges: the middle of the
        range replaces a value outside it.
    progress : callable, optional
        Called after each simulation with the number of simulations so far; an exception that it
        raises ends the fit.

    Returns
    -------
    Fit

    Raises
    ------
    InputError
        For an unknown name or column, for a range that does not contain the initial value (with
        ``start="values"``), for a trace with fewer than two samples in the shortest period of a
        signal, if no simulation with initial values reaches the end of the trace, and if a measured
        number, such as the duration of a stick, does not exist in these simulations.
    """
    check_instance("system", system, BrakedDriveline | Machine, "a BrakedDriveline or a Machine")
    check_choice("loss", loss, _LOSSES)
    check_choice("start", start, _STARTS)
    if not loss_scale > 0.0:
        raise wrong("loss_scale", loss_scale, "a positive number")
    numbers, found, observations = _measurement(system, trace, (observe, time), (measured, window))
    begin: dict[str, float] = {}
    if not system.holds_start:
        state = check_state("initial", (0.0, 0.0) if initial is None else initial)
        begin = dict(zip(system.initial_conditions, state, strict=True))
    elif initial is not None:
        raise wrong("initial", initial, "left out for a machine", 'Use replace({"disc.speed": 2}).')
    model = Model(
        system, found, observations, begin, settings_of(observations), method, progress, numbers
    )
    firsts = _firsts(model, segments)
    ranges = _ranges(model, free, start)
    if numbers is not None:
        if "time_shift" in ranges:
            raise wrong(
                "free['time_shift']", free["time_shift"], "left out with measured numbers",
                "They have no exact derivative with respect to it.",
            )  # fmt: skip
        if observations and sigma is None:
            raise wrong(
                "sigma", sigma, "the standard deviation of each column, as for measured numbers",
                f"For example 0.05 for the column {observations[0].column!r}.",
            )  # fmt: skip
    own = [name for name in ranges if name not in model.settings]
    if own:
        checked_names(system, own, system.initial_conditions)
    settings = (
        ranges, _sigmas(observations, found, sigma), sigma is not None or not observations,
        Loss(loss, loss_scale),
    )  # fmt: skip
    problem = FitProblem(model, *settings)
    if len(firsts) > 1:
        given = {one.name: getattr(model, one.name) for one in fields(model) if one.init}
        problem = Shooting(SegmentedModel(**given, firsts=firsts), *settings)
    return interruptible(lambda: _fitted(problem, start))


def _measurement(
    system: BrakedDriveline | Machine, trace: Any, columns: tuple[Any, Any], given: tuple[Any, Any]
) -> tuple[Numbers | None, Trace, list[Observation]]:
    """The measured numbers, the trace and its columns; without a trace, only two times.

    columns : ``observe`` and ``time``;  given : ``measured`` and ``window``
    """
    measured, window = given
    each = numbers_of(system, measured)
    if window is not None and not each:
        raise wrong("window", window, "left out without measured numbers")
    if trace is None and each:
        for name, value in zip(("observe", "time"), columns, strict=True):
            if value is not None:
                raise wrong(name, value, "left out without a trace")
        window = check_window(window, None)
        return Numbers(each, window), Trace(np.array([0.0, window[1]]), {}), []
    if trace is None:
        raise wrong(
            "trace", trace, "a measured trace if no measured numbers are given",
            "Give a trace, or measured numbers, such as a period with its standard deviation.",
        )  # fmt: skip
    found = read_trace(trace, columns[1])
    observations = observations_of(system, found, columns[0])
    _check_sampling(system, found)
    if not each:
        return None, found, observations
    window = check_window(window, (float(found.time[0]), float(found.time[-1])))
    return Numbers(each, window), found, observations


def _firsts(model: Model, segments: Any) -> tuple[int, ...]:
    """Numbers of the first samples of segments with about equal numbers of samples.

    Raises ``InputError`` for too few samples for the segments, for measured numbers, and for parts
    that cannot start in the middle of the trace.
    """
    if model.numbers is not None and segments != 1:
        raise wrong(
            "segments", segments, "1 with measured numbers",
            "They describe a single run. Leave out the segments or the measured numbers.",
        )  # fmt: skip
    size = model.trace.time.size
    segments = check_whole(
        "segments", segments, 1, max(size // _FEWEST, 1),
        why=f" The trace has {size} samples, and each segment needs {_FEWEST}.",
    )  # fmt: skip
    if segments > 1:
        check_states(model.system.machine)
    return tuple(number * size // segments for number in range(segments))


def _fixed(model: Model, name: str, value: float) -> Model:
    """A model with another value of a parameter."""
    if name in model.settings:
        return replace(model, settings={**model.settings, name: value}, _known=Known())
    if name in model.initial:
        return replace(model, initial={**model.initial, name: value}, _known=Known())
    return replace(model, system=model.system.replace({name: value}), _known=Known())


def _ranges(
    model: Model, free: Mapping[str, tuple[float, float]], start: str
) -> dict[str, tuple[float, float]]:
    """The free parameters with their limits, which contain the initial values.

    start : as for ``fit``; with ``"features"`` the limits need not contain the initial values
    """
    allowed = 'a mapping of names to limits, as {"kinetic": (0.1, 0.5)}'
    if not isinstance(free, Mapping) or not free:
        raise wrong("free", free, allowed)
    system = model.system
    names = set(system.names())
    numbers = [name for name in system.quantities() if name in names]
    known = [*numbers, *system.initial_conditions, *model.settings]
    found = {}
    for name, limits in free.items():
        if name not in known:
            raise unknown("free", name, known, "no such parameter")
        try:
            low, high = map(float, limits)
        except (TypeError, ValueError):
            raise wrong(f"free[{name!r}]", limits, "two numbers, the lower first") from None
        if not low < high:
            raise wrong(f"free[{name!r}]", limits, "two numbers, the lower first")
        value = model.value(name)
        inside = name in model.settings or low <= value <= high or start == "features"
        if not inside:
            raise wrong(
                f"free[{name!r}]", limits,
                f"two numbers with the initial value {value:g} between them",
                "Change the range or the value of the system, or start from features.",
            )  # fmt: skip
        found[name] = (low, high)
        for end in (low, high):
            _check_reachable(model, name, limits, end)
    return found


def _check_reachable(model: Model, name: str, limits: Any, end: float) -> None:
    """Refuse a range with an end that the system cannot have, where a fit would stop unnoticed."""
    try:
        _fixed(model, name, end)
    except InputError as error:
        raise wrong(
            f"free[{name!r}]", limits, f"a range of values that the system can have. At {end:g}:"
            f" {error}".rstrip("."),
        ) from None  # fmt: skip


def _sigmas(
    observations: list[Observation], trace: Trace, given: Mapping[str, float] | None
) -> tuple[float, ...]:
    """The scale of each column."""
    if given is None:
        return tuple(float(np.nanstd(trace.columns[one.column])) or 1.0 for one in observations)
    found = []
    for one in observations:
        value = given.get(one.column)
        if value is None or not 0.0 < value < np.inf:
            raise wrong(f"sigma[{one.column!r}]", value, "a positive number for each column")
        found.append(float(value))
    return tuple(found)


def _check_sampling(system: BrakedDriveline | Machine, trace: Trace) -> None:
    """Refuse a trace that is sampled too coarsely, probably since its times are not in seconds."""
    interval = float(np.median(np.diff(trace.time)))
    frequencies = [
        one
        for signal in system.signals().values()
        for one in signal.frequencies() or ()
        if one > 0.0
    ]
    if frequencies and interval > 0.5 / max(frequencies):
        raise wrong(
            "trace['time']", interval,
            f"sampled at an interval of at most {0.5 / max(frequencies):.4g} s, half the shortest"
            " period of a signal",
            "Times are in seconds. If they are in milliseconds, name the column 'time [ms]', or"
            " divide by 1000.",
        )  # fmt: skip


def _unsuitable(problem: FitProblem, start: Mapping[str, float]) -> InputError | None:
    """The error of a fit that cannot start from the values ``start``; None if it can."""
    model = problem.model
    if not problem.simulated(start).responses:
        return wrong(
            "system", "the initial values", "a system whose run reaches the end of the trace",
            "Simulate it and read the message of the response, or start from other values or"
            " from features.",
        )  # fmt: skip
    for one, number in zip(model.numbers_each, model.numbers_at(start)[0], strict=True):
        if np.isnan(number):
            return wrong(
                f"measured[{one.name!r}]", (one.value, one.sigma),
                "a number that exists in the run with the initial values",
                f"{one.why} Change the initial values or the window.",
            )  # fmt: skip
    return None


def _solved(problem: FitProblem, start: str) -> tuple[Estimate, str, dict[str, float]]:
    """The best fit, the kind of its start, and the values from which it started.

    start : as for ``fit``; ``"features"`` starts from the values of the system too
    """
    own = problem.start
    reason = _unsuitable(problem, own)
    if start == "values":
        if reason is not None:
            raise reason
        return problem.solve(own), start, own
    before = problem.model.runs
    starts = [one for one in starts_by_features(problem) if _unsuitable(problem, one) is None]
    searched = problem.model.runs - before
    starts += [own] if reason is None else []
    if reason is not None and not starts:
        raise reason
    each = [problem.approached(one) for one in starts]
    # A sum over segments that do not join is not comparable.
    costs = [
        np.inf if one.starts is not None and not one.converged else problem.cost(one)
        for one in each
    ]
    best = int(np.argmin(costs))
    found = problem.refined(each[best])
    runs = searched + sum(one.evaluations for one in each)
    if found is not each[best]:
        runs += found.evaluations
    found = replace(found, evaluations=runs)
    return found, "values" if starts[best] is own else "features", starts[best]


def _fitted(problem: FitProblem, start: str) -> Fit:
    """Fit, and say what is determined."""
    import xarray as xr

    model, size = problem.model, problem.model.trace.time.size
    found, by, values = _solved(problem, start)
    before = problem.simulated(values)
    after = problem.simulated(found.values, found.starts)
    columns = [one.column for one in model.observations]
    measured = np.array([model.trace.columns[name] for name in columns]).reshape(-1, size)
    fitted = np.array(after.columns).reshape(-1, size)
    dims = ("column", "time")
    units = ("column", [one.unit for one in model.observations])
    data = xr.Dataset(
        {"measured": (dims, measured), "fitted": (dims, fitted),
         "residual": (dims, measured - fitted)},
        {"column": columns, "time": ("time", model.trace.time, {"units": "s"}), "unit": units,
         "quantity": ("column", [one.quantity for one in model.observations])},
    )  # fmt: skip
    told: list[str] = []
    if model.numbers is not None:
        near, changes = model.numbers_at(found.values)
        data, told = _with_numbers(data, model.numbers, near), _of_numbers(problem, near, changes)
    names = list(found.values)
    # A covariance of values that are not at a minimum would be misleading.
    covariance = found.covariance if found.converged else np.full((len(names), len(names)), np.nan)
    stderr = np.sqrt(np.diag(covariance))
    quantities = model.system.quantities()
    of = [quantities[name].unit if name in quantities else _unit(name, model) for name in names]
    over = {"parameter": names, "other": names, "unit": ("parameter", of)}
    system = model.system_at(found.values)
    with np.errstate(invalid="ignore"):
        correlation = covariance / np.outer(stderr, stderr)
    first, second = (
        xr.DataArray(one, over, ("parameter", "other")) for one in (covariance, correlation)
    )
    # While gaps between segments remain, the residuals are not those of one motion.
    remarks = list[str]()
    if np.isfinite(problem.cost(found)):
        remarks = _wrong_times(problem, found, fitted)
        filters = {} if remarks else _filters(problem, found, (before, after))
        remarks += _of_residuals(data, before, filters, converged=found.converged)
    if remarks or not found.converged:  # otherwise the minimum is that of the noise
        remarks += _of_events(before, after)
    remarks = model.trace.remarks(dict(zip(columns, fitted, strict=True))) + remarks + told
    return Fit(
        system, found.values, dict(zip(names, stderr.tolist(), strict=True)), first, second, data,
        _undetermined(problem, found, stderr, after), remarks, found.converged, found.message,
        found.evaluations, by, values, problem,
    )  # fmt: skip


def _with_numbers(data: xr.Dataset, numbers: Numbers, fitted: FloatArray) -> xr.Dataset:
    """The data of a fit, with the measured numbers."""
    each = {
        "measured": numbers.measured, "sigma": numbers.sigmas, "fitted": fitted,
        "residual": numbers.measured - fitted,
    }  # fmt: skip
    found = data.assign({f"number_{name}": ("number", one) for name, one in each.items()})
    return found.assign_coords(
        number=[one.name for one in numbers.each],
        number_unit=("number", [one.kind.unit for one in numbers.each]),
    )


def _of_numbers(problem: FitProblem, fitted: FloatArray, changes: FloatArray) -> list[str]:
    """Remarks on measured numbers: far from the fit, without derivatives, or with huge ones."""
    told = []
    names, ranges = np.array(list(problem.free)), np.ptp(list(problem.free.values()), axis=1)
    for one, value, by in zip(problem.model.numbers_each, fitted, changes, strict=True):
        apart = abs(value - one.value) / one.sigma
        if apart > _FAR:
            told.append(
                f"{one.name}: differs from the fit by {apart:.3g} standard deviations. The model"
                " may not describe the system, or the standard deviation is too small."
            )
        if np.isnan(by).any():
            told.append(
                f"{one.name}: has no derivative at the fitted values, because two extremes are"
                " equal or an event is only grazed. The standard errors are those of the other"
                " measurements."
            )
        steep = names[np.abs(by) * ranges > _STEEP * max(abs(value), one.sigma)]
        if steep.size:
            told.append(
                f"{one.name}: its derivative with respect to {', '.join(steep)} is too large for a"
                " fit, as in chaotic motion. The fitted values and their standard errors are not"
                " reliable. Use a window that ends a few periods after the start."
            )
    return told


def _unit(name: str, model: Model) -> str:
    """Unit of what is free besides parameters of the system."""
    column, _, what = name.rpartition(".")
    if name == "time_shift" or what == "scale":
        return "s" if name == "time_shift" else "1"
    return next(one.unit for one in model.observations if one.column == column)


def _undetermined(
    problem: FitProblem, found: Estimate, errors: FloatArray, after: Simulated
) -> list[str]:
    """What is not determined, in words, and parameters at their limits.

    errors : standard errors; nan if the fit has not converged
    """
    told = list[str]()
    sticking = [one["sticking"] for one in after.responses if "sticking" in one]
    always = bool(sticking) and all(bool(np.all(one == 1)) for one in sticking)
    never = bool(sticking) and not any(bool(np.any(one == 1)) for one in sticking)
    why = " The contacts never slip." if always else " The contacts never stick." if never else ""
    for changes in found.undetermined if found.converged else ():
        names = list(changes)
        if len(names) == 1:
            told.append(f"{names[0]}: not determined, since nothing measured depends on it.{why}")
        elif len(names) == 2:
            what = "product" if changes[names[0]] * changes[names[1]] < 0.0 else "ratio"
            told.append(
                f"{names[0]} and {names[1]}: the measurement determines only their {what},"
                f" approximately.{why}"
            )
        else:
            told.append(
                f"{', '.join(names)}: the measurement determines only combinations of them.{why}"
            )
    for (name, (low, high)), error in zip(problem.free.items(), errors, strict=True):
        if high - low < error < np.inf:
            told.append(f"{name}: not determined within its range ({low:g}, {high:g}).{why}")
        value, near = found.values[name], 1e-6 * (high - low)
        bound = low if value - low < high - value else high
        if abs(value - bound) < near:
            told.append(f"{name}: ends at the bound {bound:g} of its range, {low:g} to {high:g}.")
    return told


def _filters(
    problem: FitProblem, found: Estimate, simulated: tuple[Simulated, Simulated]
) -> dict[str, Explanation]:
    """The delay or filter of each column that explains residuals that are not independent.

    simulated : the model with the values at the start and at the end of the fit
    """
    model, size = problem.model, problem.model.trace.time.size
    before, after = simulated
    told = dict[str, Explanation]()
    at_start: FloatArray | None = None
    # The column of each residual.
    firsts = model.firsts if isinstance(model, SegmentedModel) else (0,)
    row_of = np.concatenate([
        np.full(np.count_nonzero(np.isfinite(one[first:end])), number)
        for first, end in zip(firsts, (*firsts[1:], size), strict=True)
        for number, one in enumerate(problem.measured)
    ] or [np.zeros(0)])  # fmt: skip
    for number, (of, sigma) in enumerate(zip(model.observations, problem.sigmas, strict=True)):
        measured = problem.measured[number]
        known = np.isfinite(measured)
        residual = (measured - after.columns[number])[known]
        scale = float(np.std(measured[known]))
        if residual.size <= 2 * LAGS or np.std(residual) <= _ROUNDING * scale:
            continue
        if independence_p(residual) >= SIGNIFICANCE:
            continue

        def filled(table: FloatArray, number: int = number, known: Any = known) -> FloatArray:
            """Derivatives (k, q), interpolated where nothing was measured."""
            at = np.flatnonzero(known)
            rows = table[: row_of.size][row_of == number]
            each = [np.interp(np.arange(size), at, one) for one in rows.T]
            return np.array(each).reshape(-1, size).T

        near = [ColumnNear(after.columns[number] / sigma, filled(found.jacobian))]
        if found.basis is None:  # with segments, the start follows the measurement
            if at_start is None:
                at_start = problem.linearised(before.values, size)[:, :-1]
            near.append(ColumnNear(before.columns[number] / sigma, filled(at_start)))
        near = [one for one in near if np.all(np.isfinite(one.model))]
        one = explained(model.trace.time, measured / sigma, near)
        if one is not None:
            told[of.column] = one
    return told


def _of_filter(name: str, found: Explanation, end: float) -> str:
    """A remark on a delayed or filtered column.

    end : of the trace [s]
    """
    until = "" if found.until == end else f" until {found.until:.3g} s"
    explains = f"explains {100.0 * found.share:.0f} % of the sum of squares of the residuals{until}"
    if found.words:
        return (
            f"{name}: appears to be filtered by {found.words}, which {explains}. The model has no"
            " such filter, and the fitted values compensate for it: fit the signal before the"
            " filter, or one that is filtered with a higher cut-off frequency."
        )
    return (
        f"{name}: lags {found.delay:.3g} s behind the model, which {explains}. It may be filtered,"
        " or its times shifted: make time_shift free, or fit the signal before the filter."
    )


def _of_residuals(
    data: xr.Dataset, before: Simulated, filters: Mapping[str, Explanation], *, converged: bool
) -> list[str]:
    """Remarks on a column: inverted, filtered, residuals that are not independent at a minimum."""
    told = []
    end = float(data["time"][-1])
    for name, start in zip(map(str, data["column"].to_numpy()), before.columns, strict=True):
        one = data.sel(column=name)
        measured, fitted = one["measured"].to_numpy(), one["fitted"].to_numpy()
        known = np.isfinite(measured)
        residual = (measured - fitted)[known]
        spread = float(np.sum((fitted[known] - fitted[known].mean()) ** 2))
        if not residual.size > 2 * LAGS:
            continue
        nothing = (
            f"{name}: the fit explains nothing of it. Check the unit of the times (seconds),"
            " the quantity that it measures, its unit, and the initial state."
        )
        if not spread:  # the model is at rest, but the measurement may move
            if np.ptp(residual) > 0.0 and independence_p(residual) < SIGNIFICANCE:
                told.append(nothing)
            continue
        relative = float(np.sqrt(np.mean(residual**2) / (spread / residual.size)))
        if relative < _ROUNDING:  # the model itself
            continue
        at_start, alike = (
            float(np.corrcoef(measured[known], to[known])[0, 1]) for to in (start, fitted)
        )
        # A fit to an inverted column may end at values without any correlation.
        alike = alike if alike > -_INVERTED else min(alike, at_start)
        if alike < _INVERTED:
            told.append(
                f"{name}: moves opposite to the model (correlation {alike:.2f}). If its sign is"
                f" inverted, multiply it by -1, or make {name}.scale free with a negative range."
            )
            continue
        scatter = measured[known] - measured[known].mean()
        if name in filters:
            told.append(_of_filter(name, filters[name], end))
        elif np.sum(residual**2) > _NOTHING * np.sum(scatter**2):
            told.append(nothing)
            continue
        p = independence_p(residual)
        if converged and p < SIGNIFICANCE:
            told.append(
                f"{name}: the residuals are not independent (Ljung-Box test, p = {p:.1g}). The"
                " model may not describe the system, and the standard errors may be too small."
            )
    return told


def _wrong_times(problem: FitProblem, found: Estimate, fitted: FloatArray) -> list[str]:
    """Remarks on the times of a trace that is fitted in one run."""
    time, columns = problem.model.trace.time, problem.model.trace.columns
    if found.basis is not None or not found.ends:
        return []
    each = zip(problem.model.observations, fitted, problem.sigmas, strict=True)
    rates = [
        (np.gradient(one, time) / sigma, np.isfinite(columns[of.column])) for of, one, sigma in each
    ]
    return remarks_on_times(time, rates, found)


def _of_events(before: Simulated, after: Simulated) -> list[str]:
    """A remark where the order of the events differs between the start and the end of the fit."""
    if before.events == after.events:
        return []
    told = (
        "The order of events with the fitted values differs from that with the initial values: the"
        " sum of squares may have several minima. Repeat the fit from other values, and compare."
    )
    return [told]
