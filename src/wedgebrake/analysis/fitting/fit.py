"""``wb.fit``: parameters of a system from a measured trace."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from wedgebrake.analysis.fitting.estimate import Estimate, Loss, Problem
from wedgebrake.analysis.fitting.model import Model, Simulated
from wedgebrake.analysis.fitting.observation import Observation, observations_of, settings_of
from wedgebrake.analysis.fitting.trace import Trace, read_trace
from wedgebrake.arrays import FloatArray
from wedgebrake.errors import InputError
from wedgebrake.model.machine import Machine
from wedgebrake.model.system import INITIAL, BrakedDriveline
from wedgebrake.model.validation import check_choice, check_instance, unknown, wrong
from wedgebrake.solvers.interrupts import interruptible

if TYPE_CHECKING:
    import xarray as xr

_LOSSES = ("linear", "soft_l1", "huber", "cauchy", "arctan")
# Smallest probability of residuals that pass as independent, and lags of their correlation.
_INDEPENDENT, _LAGS = 1e-3, 20
# Shares of the residuals' variance that a delay, or another sign, has to explain to be named.
_EXPLAINED, _INVERTED = 0.3, -0.5
# Share of the variance of a column above which its residuals are as large as the column itself.
_NOTHING = 0.9


@dataclass(frozen=True)
class Fit:
    """Result of ``wb.fit``.

    Attributes
    ----------
    system : BrakedDriveline or Machine
        The system with the fitted values.
    values, stderr : dict
        Fitted value and standard deviation of each free parameter, in its unit; inf where the
        trace does not determine it.
    covariance, correlation : xarray.DataArray
        Over (``parameter``, ``other``).
    data : xarray.Dataset
        ``measured``, ``fitted`` and ``residual`` of each column, over (``column``, ``time``).
    undetermined : list of str
        What the trace does not determine, a sentence each.
    remarks : list of str
        What else to know: signs of a clipped, filtered or inverted column, residuals that are not
        independent, an order of events that has changed.
    converged : bool
    message : str
    evaluations : int
        Simulations of the trace or of a part of it.
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
    _problem: Problem

    @property
    def rms(self) -> dict[str, float]:
        """Root mean square of the residual of each column, in its unit."""
        found: FloatArray = np.sqrt(np.nanmean(self.data["residual"].to_numpy() ** 2, axis=1))
        return dict(zip(map(str, self.data["column"].to_numpy()), found.tolist(), strict=True))

    def interval(self, level: float = 0.95) -> dict[str, tuple[float, float]]:
        """Confidence intervals of the values by Student's distribution.

        level : probability, between 0 and 1
        """
        from scipy import stats

        freedom = max(int(np.isfinite(self.data["residual"]).sum()) - len(self.values), 1)
        wide = float(stats.t.ppf(0.5 + 0.5 * level, freedom))
        return {
            name: (value - wide * self.stderr[name], value + wide * self.stderr[name])
            for name, value in self.values.items()
        }

    def profile(self, name: str, values: Any) -> xr.Dataset:
        """Smallest sum of squares, all other parameters fitted, over values of one parameter.

        name   : of the parameter
        values : of it; the others start from their fitted values

        Returns a Dataset over the parameter: ``cost`` (the sum of squares of residuals in sigmas)
        and the values of the others.
        """
        import xarray as xr

        if name not in self.values:
            raise unknown("name", name, list(self.values), "no free parameter")
        problem, at = self._problem, np.atleast_1d(np.asarray(values, float))
        others = {one: two for one, two in problem.free.items() if one != name}
        costs, rows = [], []
        for value in at:
            model = _fixed(problem.model, name, float(value))
            part = Problem(model, others, problem.sigmas, problem.known, problem.loss)
            found = part.solve(self.values)
            costs.append(float(found.residuals @ found.residuals))
            rows.append(list(found.values.values()))
        columns = np.array(rows).reshape(at.size, len(others)).T
        each = zip(others, columns, strict=True)
        return xr.Dataset(
            {"cost": (name, costs), **{one: (name, two) for one, two in each}}, {name: at}
        )

    def report(self) -> str:
        """Values, deviations, correlations and remarks as text."""
        units, lines = self.covariance["unit"].to_numpy(), ["Fitted values"]
        wide = max(map(len, self.values))
        for (name, value), unit in zip(self.values.items(), units, strict=True):
            error, unit = self.stderr[name], "" if unit == "1" else f" {unit}"
            share = f" ({abs(100.0 * error / value):.3g} %)" if value and np.isfinite(error) else ""
            told = (
                f"standard deviation {error:.3g}{share}" if np.isfinite(error) else "not determined"
            )
            lines.append(f"  {name:<{wide}}  {value:.8g}{unit}  {told}")
        rms = ", ".join(f"{name} {one:.4g}" for name, one in self.rms.items())
        lines.append(f"Root mean square of the residuals: {rms}")
        matrix, names = self.correlation.to_numpy(), list(self.values)
        pairs = [
            (abs(matrix[i, j]), names[i], names[j], matrix[i, j])
            for i in range(len(names)) for j in range(i) if abs(matrix[i, j]) > 0.9
        ]  # fmt: skip
        for _, one, other, value in sorted(pairs, reverse=True):
            lines.append(f"Correlation of {other} and {one}: {value:.4f}")
        lines += [*self.undetermined, *self.remarks]
        end = "Converged" if self.converged else "Not converged"
        return "\n".join([*lines, f"{end} after {self.evaluations} simulations: {self.message}"])

    def __repr__(self) -> str:
        return self.report()


def fit(
    system: BrakedDriveline | Machine,
    trace: Any,
    free: Mapping[str, tuple[float, float]],
    *,
    observe: Mapping[str, str] | None = None,
    time: str | None = None,
    initial: tuple[float, float] | None = None,
    sigma: Mapping[str, float] | None = None,
    loss: str = "linear",
    loss_scale: float = 1.0,
    method: str | None = None,
) -> Fit:
    """Fit parameters of a system to a measured trace by least squares, with exact derivatives.

    The response is simulated from the first sample on and compared with the columns of the trace.
    First a short beginning of the trace is fitted, then longer ones, so that the vibration of the
    model does not slip by a period against the measured one. Derivatives are those of
    ``sensitivity``.

    Parameters
    ----------
    system : BrakedDriveline or Machine
        The system; its values are the start of the fit.
    trace : xarray.Dataset, pandas.DataFrame, mapping of arrays or path
        Columns over time [s]; a path of a .csv, .mat (``scipy.io``) or .nc file. Samples that are
        nan are left out.
    free : mapping
        Lower and upper limit of each free parameter: names as ``replace`` takes them; the initial
        state, ``"disc.speed"`` or for a driveline ``"initial_velocity"``; ``"time_shift"`` [s],
        which is added to the times of the trace; and for each column ``"velocity.scale"`` and
        ``"velocity.offset"``: the column measures scale * quantity + offset. The fit starts from
        the values of the system; from no shift, scale 1 and offset 0, or the middle of the range
        where this is outside.
    observe : mapping, optional
        Which quantity each column measures: ``"disc.speed"``, ``"disc.angle"``, ``"shaft.torque"``,
        ``"brake.torque"`` (on the first inertia of the contact), ``"brake.force"``; where there is
        one part of the kind also the name of the response, ``"velocity"``. Default: the columns
        with the name of a quantity.
    time : str, optional
        Column of the times. Default: ``"time"``, ``"t"``, or the first one.
    initial : (angle, velocity), optional
        State of a driveline at the first sample. Default: (0, 0). A machine starts from the values
        of its inertias.
    sigma : mapping, optional
        Standard deviation of the measurement of each column, in its unit. Default: columns are
        weighted by their own standard deviation, and the covariance is scaled with the residuals.
    loss, loss_scale : str, float
        Loss of ``scipy.optimize.least_squares``, ``"soft_l1"`` or ``"huber"`` against outliers, and
        the residual, in sigmas, at which it departs from the square.
    method : {"exact", "smooth"}, optional
        As in ``simulate``.

    Returns
    -------
    Fit

    Raises
    ------
    InputError
        For an unknown name or column, a range that does not contain the start, a trace that is
        sampled less than twice in the shortest period of the torque or vibration, and if the system
        does not reach the end of the trace at the start of the fit.
    """
    check_instance("system", system, BrakedDriveline | Machine, "a BrakedDriveline or a Machine")
    check_choice("loss", loss, _LOSSES)
    if not loss_scale > 0.0:
        raise wrong("loss_scale", loss_scale, "a positive number")
    found = read_trace(trace, time)
    observations = observations_of(system, found, observe)
    _check_sampling(system, found)
    if system.initial_conditions == tuple(INITIAL):
        initial = (0.0, 0.0) if initial is None else initial
    elif initial is not None:
        raise wrong("initial", initial, "left out for a machine", 'Use replace({"disc.speed": 2}).')
    model = Model(system, found, observations, initial, settings_of(observations), method)
    problem = Problem(
        model, _ranges(model, free), _sigmas(observations, found, sigma), sigma is not None,
        Loss(loss, loss_scale),
    )  # fmt: skip
    return interruptible(lambda: _fitted(problem))


def _fixed(model: Model, name: str, value: float) -> Model:
    """A model with another value of a parameter."""
    if name in model.settings:
        return replace(model, settings={**model.settings, name: value}, _last={})
    if name in INITIAL and model.initial is not None:
        start = dict(zip(INITIAL, model.initial, strict=True)) | {name: value}
        initial = start["initial_angle"], start["initial_velocity"]
        return replace(model, initial=initial, _last={})
    return replace(model, system=model.system.replace({name: value}), _last={})


def _ranges(
    model: Model, free: Mapping[str, tuple[float, float]]
) -> dict[str, tuple[float, float]]:
    """The free parameters with their limits."""
    allowed = 'a mapping of names to limits, as {"kinetic": (0.1, 0.5)}'
    if not isinstance(free, Mapping) or not free:
        raise wrong("free", free, allowed)
    system = model.system
    numbers = [name for name in system.quantities() if name in system.names()]
    known = [*numbers, *system.initial_conditions, *model.settings]
    found = {}
    for name, limits in free.items():
        if name not in known:
            raise unknown("free", name, known, "no such parameter")
        try:
            low, high = map(float, limits)
        except (TypeError, ValueError):
            raise wrong(f"free[{name!r}]", limits, "two numbers, the lower first") from None
        value = model.value(name)
        inside = name in model.settings or low <= value <= high
        if not low < high or not inside:
            raise wrong(
                f"free[{name!r}]", limits,
                f"two numbers, the lower first, with the start {value:g} between them",
                "Change the range, or the value of the system.",
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
            f"free[{name!r}]", limits, f"a range of values that the system can have; at {end:g},"
            f" {error}",
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
    """Refuse a trace whose time has another unit."""
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
            f"sampled at least twice in {1.0 / max(frequencies):.4g} s, the shortest period of a"
            " signal",
            "Times are in seconds: divide by 1000 if they are in milliseconds.",
        )  # fmt: skip


def _fitted(problem: Problem) -> Fit:
    """Fit, and say what the trace determines."""
    import xarray as xr

    model, size = problem.model, problem.model.trace.time.size
    start = problem.start
    before = model.simulate(start, size)
    if before.response is None:
        raise wrong(
            "system", "the start of the fit", "a system whose run reaches the end of the trace",
            "Simulate it and see its message, or start from other values.",
        )  # fmt: skip
    found = problem.solve(start)
    after = model.simulate(found.values, size)
    columns = [one.column for one in model.observations]
    measured = np.array([model.trace.columns[name] for name in columns])
    fitted = np.array(after.columns)
    dims = ("column", "time")
    units = ("column", [one.unit for one in model.observations])
    data = xr.Dataset(
        {"measured": (dims, measured), "fitted": (dims, fitted),
         "residual": (dims, measured - fitted)},
        {"column": columns, "time": ("time", model.trace.time, {"units": "s"}), "unit": units,
         "quantity": ("column", [one.quantity for one in model.observations])},
    )  # fmt: skip
    covariance, names = found.covariance, list(found.values)
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
    remarks = _of_residuals(data, before)
    if remarks or not found.converged:  # otherwise the minimum is that of the noise
        remarks += _of_events(problem, before, found)
    remarks = model.trace.remarks(columns) + remarks
    return Fit(
        system, found.values, dict(zip(names, stderr.tolist(), strict=True)), first, second, data,
        _undetermined(problem, found), remarks, found.converged, found.message,
        found.evaluations, problem,
    )  # fmt: skip


def _unit(name: str, model: Model) -> str:
    """Unit of what is free besides parameters of the system."""
    column, _, what = name.rpartition(".")
    if name in INITIAL:
        return INITIAL[name].unit
    if name == "time_shift" or what == "scale":
        return "s" if name == "time_shift" else "1"
    return next(one.unit for one in model.observations if one.column == column)


def _undetermined(problem: Problem, found: Estimate) -> list[str]:
    """What the trace does not determine, in words, and parameters at their limits."""
    told = []
    response = problem.model.simulate(found.values, problem.model.trace.time.size).response
    sticking = None if response is None else response.get("sticking")
    always = sticking is not None and bool(np.all(sticking == 1))
    never = sticking is not None and not bool(np.any(sticking == 1))
    why = " The contacts never slip." if always else " The contacts never stick." if never else ""
    for changes in found.undetermined:
        names = list(changes)
        if len(names) == 1:
            told.append(f"{names[0]}: not determined, as the trace does not depend on it.{why}")
        elif len(names) == 2:
            what = "product" if changes[names[0]] * changes[names[1]] < 0.0 else "ratio"
            told.append(f"{names[0]} and {names[1]}: only their {what} is determined, nearly.{why}")
        else:
            told.append(f"{', '.join(names)}: only combinations of them are determined.{why}")
    errors = np.sqrt(np.diag(found.covariance))
    for (name, (low, high)), error in zip(problem.free.items(), errors, strict=True):
        if high - low < error < np.inf:
            told.append(f"{name}: not determined within its range ({low:g}, {high:g}).{why}")
        value, near = found.values[name], 1e-6 * (high - low)
        if value - low < near or high - value < near:
            told.append(f"{name}: ends at the limit {value:g} of its range, ({low:g}, {high:g}).")
    return told


def _of_residuals(data: xr.Dataset, before: Simulated) -> list[str]:
    """Remarks on a column: inverted, delayed, residuals that are not independent."""
    from scipy import stats

    told = []
    time = data["time"].to_numpy()
    for name, start in zip(map(str, data["column"].to_numpy()), before.columns, strict=True):
        one = data.sel(column=name)
        measured, fitted = one["measured"].to_numpy(), one["fitted"].to_numpy()
        known = np.isfinite(measured)
        residual = (measured - fitted)[known]
        spread = float(np.sum((fitted[known] - fitted[known].mean()) ** 2))
        if not spread or not residual.size > 2 * _LAGS:
            continue
        relative = float(np.sqrt(np.mean(residual**2) / (spread / residual.size)))
        if relative < 1e-6:  # the model itself
            continue
        # At the start, too: a fit to an inverted column may end where nothing is alike.
        alike = min(float(np.corrcoef(measured[known], to[known])[0, 1]) for to in (start, fitted))
        if alike < _INVERTED:
            told.append(
                f"{name}: moves against the model (correlation {alike:.2f}). If its sign is"
                f" inverted, negate it, or fix {name}.scale at -1."
            )
            continue
        scatter = measured[known] - measured[known].mean()
        if np.sum(residual**2) > _NOTHING * np.sum(scatter**2):
            told.append(
                f"{name}: the fit explains nothing of it. Check the unit of the times (seconds),"
                " the quantity that it measures, its unit, and the initial state."
            )
            continue
        rate = np.gradient(fitted, time)[known]
        delay = -float(rate @ residual) / float(rate @ rate) if np.any(rate) else 0.0
        explained = 1.0 - float(np.sum((residual + delay * rate) ** 2) / np.sum(residual**2))
        if explained > _EXPLAINED:
            told.append(
                f"{name}: lags {delay:.3g} s behind the model, which explains"
                f" {100.0 * explained:.0f} % of the residuals. It may be filtered, or its time"
                " shifted: free time_shift."
            )
        correlated = _ljung_box(residual)
        p = float(stats.chi2.sf(correlated, _LAGS))
        if p < _INDEPENDENT:
            told.append(
                f"{name}: the residuals are not independent (Ljung-Box, p = {p:.1g}); the standard"
                " deviations are too small where the model does not fit."
            )
    return told


def _ljung_box(residual: FloatArray) -> float:
    """Statistic of Ljung and Box: chi-squared with ``_LAGS`` degrees for independent residuals."""
    n, centred = residual.size, residual - residual.mean()
    power = float(centred @ centred)
    lags = [float(centred[k:] @ centred[:-k]) / power for k in range(1, _LAGS + 1)]
    return n * (n + 2.0) * sum(one**2 / (n - k) for k, one in enumerate(lags, 1))


def _of_events(problem: Problem, before: Simulated, found: Estimate) -> list[str]:
    """A remark where the order of the events differs between the start and the end of the fit."""
    model = problem.model
    after = model.simulate(found.values, model.trace.time.size)
    end = float(model.trace.time[-1])
    if before.events(end) == after.events(end):
        return []
    told = (
        "The order of events differs between the start and the end of the fit: the sum of squares"
        " may have several minima. Start again from elsewhere, and compare."
    )
    return [told]
