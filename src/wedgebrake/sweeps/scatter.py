"""``scatter``: samples of a system with uncertain parameters, and probabilities of outcomes."""

from __future__ import annotations

import json
from collections.abc import Collection, Mapping
from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from wedgebrake._version import __version__
from wedgebrake.analysis.linear_stability.sliding_contact import Method, linearisation_of
from wedgebrake.analysis.sobol import sobol
from wedgebrake.arrays import FloatArray
from wedgebrake.errors import InputError
from wedgebrake.model.machine import Machine
from wedgebrake.model.studies.sweep_settings import joined
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.model.validation import check_instance, check_whole, wrong
from wedgebrake.solvers.kernels import method_of
from wedgebrake.sweeps.grid import Axis, make_axes
from wedgebrake.sweeps.outcomes import (
    LINEAR,
    OUTCOME,
    SAFE,
    SAMPLE,
    UNKNOWN,
    check_limits,
    check_outcomes,
    linear_outcomes,
    quantities,
    with_amplitude,
    with_linear,
    with_probabilities,
    with_quantiles,
)
from wedgebrake.sweeps.results import PointStatus, Variable
from wedgebrake.sweeps.sampling import distributions, given_sample
from wedgebrake.sweeps.sobol_indices import design, with_indices
from wedgebrake.sweeps.sweep import execute, make_plan, split_options

if TYPE_CHECKING:
    import xarray as xr

_MOST_SAMPLES = 10_000_000
_STATUS = Variable("status", "1", "how the simulation ended", "int8", 0, words=PointStatus)


class Evaluation(NamedTuple):
    """What is evaluated at each sample.

    outcomes : their names, as ``check_outcomes`` returns them
    limits   : of results, by name
    settings, execution : arguments of a sweep
    """

    system: BrakedDriveline | Machine
    outcomes: tuple[str, ...]
    limits: dict[str, float]
    settings: dict[str, Any]
    execution: dict[str, Any]

    def without_store(self) -> Evaluation:
        """Itself, if it has no store: one keeps the samples of a single call of ``results``."""
        if self.execution.get("store") is not None:
            raise wrong(
                "store", self.execution["store"], "left out where samples are chosen step by step"
            )
        return self

    @property
    def runs(self) -> bool:
        """Whether an outcome needs a run of each sample."""
        return not {*LINEAR, SAFE}.issuperset(self.outcomes)

    @property
    def linearised(self) -> Method:
        """How friction is linearised: as the solver has it."""
        return linearisation_of(method_of(self.system, self.settings.get("method")))

    def results(self, values: Mapping[str, FloatArray]) -> xr.Dataset:
        """The results at samples, without probabilities."""
        import xarray as xr

        if not self.runs:
            axes = make_axes(self.system, dict(values), SAMPLE)
            growth, locked, valid = self._linear(axes)
            status = np.where(valid, PointStatus.COMPLETED, PointStatus.INVALID).astype(np.int8)
            dataset = xr.Dataset(
                {"status": (SAMPLE, status, _STATUS.attributes())},
                coords={one.label: (SAMPLE, one.values, one.attributes()) for one in axes},
                attrs=self._attributes(axes),
            )
            return with_linear(dataset, growth, locked)
        plan = make_plan("scatter", self.system, dict(values), dim=SAMPLE, **self.settings)
        if {*LINEAR}.isdisjoint(self.outcomes):
            return with_amplitude(execute(plan, **self.execution))
        # The kernels leave the interpreter to the linear verdicts.
        with ThreadPoolExecutor(1) as beside:
            linear = beside.submit(self._linear, plan.grid.axes)
            dataset = with_amplitude(execute(plan, **self.execution))
            growth, locked, _ = linear.result()
        return with_linear(dataset, growth, locked)

    def _linear(self, axes: tuple[Axis, ...]) -> tuple[FloatArray, Any, Any]:
        checked = {one.name: one.values for one in axes}
        return linear_outcomes(self.system, checked, self.linearised)

    def _attributes(self, axes: tuple[Axis, ...]) -> dict[str, Any]:
        return {
            "kind": "scatter",
            "wedgebrake_version": __version__,
            "method": self.linearised,
            "system": json.dumps(self.system.as_dict()),
            "axes": json.dumps([one.label for one in axes]),
        }


def evaluation(
    system: BrakedDriveline | Machine,
    over: Any,
    outcomes: Collection[str] | None,
    limits: Mapping[str, float] | None,
    options: dict[str, Any],
) -> tuple[dict[Any, Any], Evaluation]:
    """The varied parameters with what is given for them, and what is evaluated at each sample."""
    check_instance("system", system, BrakedDriveline | Machine, "a BrakedDriveline or a Machine")
    parameters, settings, execution = split_options(options)
    if over is not None and hasattr(over, "columns"):  # a DataFrame
        over = {str(name): over[name].to_numpy() for name in over.columns}
    varied = joined(over, parameters)
    if not varied:
        raise InputError(
            "over: no parameter varies. Give at least one with its distribution, for"
            ' example {"kinetic": scipy.stats.uniform(0.28, 0.14)}.'
        )
    settings.setdefault("keep_points", False)
    checked = check_limits(limits)
    return varied, Evaluation(
        system, check_outcomes(outcomes, checked), checked, settings, execution
    )


def scatter(
    system: BrakedDriveline | Machine,
    over: Any = None,
    *,
    samples: int = 1024,
    seed: int = 0,
    correlation: Any = None,
    outcomes: Collection[str] | None = None,
    limits: Mapping[str, float] | None = None,
    quantiles: Collection[float] = (0.05, 0.5, 0.95),
    indices: bool = False,
    **options: Any,
) -> xr.Dataset:
    """Estimate the probabilities of outcomes for a system with uncertain parameters.

    Parameters
    ----------
    system : BrakedDriveline or Machine
        The system whose parameters are varied.
    over : mapping or DataFrame
        Frozen distributions of ``scipy.stats`` by name of the parameter, in SI units, for example
        ``{"kinetic": scipy.stats.uniform(0.28, 0.14)}``; the parameters in a tuple of names share
        one value. Or a given sample: an array of values for each name, or a DataFrame with a
        column for each.
    samples : int
        Number of points of a scrambled Sobol sequence; powers of 2 are best.
    seed : int
        Seed of the scrambling. The same seed gives the same points.
    correlation : array or mapping
        Correlation matrix of a Gaussian copula in the order of ``over``, or a mapping from pairs of
        names to coefficients. Default: independent parameters.
    outcomes : list of str
        Names of the outcomes: "unstable_forwards" and "unstable_backwards" (no stable sliding in
        the direction: small vibration grows, or the brake locks itself), "self_locked",
        "stick_slip", "undecided". Default: all. The first three follow from linear stability; if
        only these are requested, nothing is simulated.
    limits : mapping
        Limits of results of a sweep, in SI units: ``{"rms_torque": 20.0}`` adds the outcome
        "rms_torque > 20". "amplitude" is half the range of the speed.
    quantiles : list of float
        Probabilities for which quantiles are computed, of amplitude, torque, growth rate and
        results with limits.
    indices : bool
        Compute Sobol indices from Saltelli's design, which needs (k + 2) ``samples`` points for k
        parameters.
    **options
        Parameters as keywords, and arguments of ``sweep``: ``periods``, ``transient``, ``limit``,
        ``method``, ``store``, ``resume``, ``threads``, ``client``, ``progress``, ...

    Returns
    -------
    xarray.Dataset
        Over ``sample``: the values of the parameters as coordinates, the variables of ``sweep``
        and ``amplitude`` [rad/s]; over (sample, direction) ``growth_rate`` [1/s] and
        ``self_locking``; over (sample, outcome) ``occurs`` (1 yes, 0 no, -1 not known). Over
        ``outcome``: ``probability``, the ends ``low`` and ``high`` of its 95 % Wilson score
        interval, and ``unknown``, the number of samples whose outcome is not known. ``low`` assumes
        that the outcome does not occur in these, ``high`` that it does. A sample is "safe" if no
        other outcome occurs; undecided, failed or invalid samples are never counted as safe. Over
        (quantity, quantile): ``quantiles``. With ``indices``, over (effect, parameter): ``S1`` and
        ``ST``, the first-order and total Sobol indices, with the half-widths ``S1_conf`` and
        ``ST_conf`` of their 95 % intervals; over ``effect``: ``index_samples``, the number of rows
        of the design in which all values are known.

    The Wilson interval is that of independent samples. The points of a Sobol sequence are spread
    more evenly, so that it tends to be conservative. It is conditional on the given distributions.

    Raises
    ------
    InputError
        For invalid arguments, and as ``sweep``.
    OutputError, WedgebrakeError
        As ``sweep``.
    """
    check_whole("samples", samples, 2, _MOST_SAMPLES)
    check_whole("seed", seed, 0, 2**32 - 1)
    check_instance("indices", indices, bool)
    levels = _levels(quantiles)
    varied, what = evaluation(system, over, outcomes, limits, options)
    values = given_sample(varied)
    if values is not None:
        if correlation is not None or indices:
            name = "indices" if indices else "correlation"
            raise wrong(name, True if indices else correlation, "left out with a given sample")
    else:
        found = distributions(varied, correlation)
        k = len(found.quantiles)
        if indices and not found.independent:
            raise wrong(
                "indices", indices, "False with a correlation",
                "Sobol indices are those of independent parameters.",
            )  # fmt: skip
        points = sobol(samples, 2 * k if indices else k, seed)
        values = found.values(design(points) if indices else points)
    dataset = what.results(values)
    whole = with_probabilities(dataset, what.outcomes, what.limits)
    kept = whole.isel({SAMPLE: slice(0, 2 * samples)}) if indices else whole
    result = with_quantiles(
        with_probabilities(kept, what.outcomes, what.limits), what.limits, levels
    )
    if indices:
        parameters = json.loads(result.attrs["axes"])
        result = with_indices(result, _effects(whole, what), parameters, seed)
    result.attrs["seed"] = seed
    return result


def _effects(dataset: xr.Dataset, what: Evaluation) -> dict[str, FloatArray]:
    """Values whose variance Sobol indices explain: quantities, and outcomes as 0 or 1."""
    found = quantities(dataset, what.limits)
    for i, name in enumerate(dataset[OUTCOME].to_numpy()):
        occurs = dataset["occurs"].to_numpy()[:, i]
        found[str(name)] = np.where(occurs == UNKNOWN, np.nan, occurs.astype(float))
    return found


def _levels(given: Any) -> FloatArray:
    try:
        levels = np.array(list(given), dtype=float)
    except (TypeError, ValueError):
        levels = np.array([np.nan])
    if levels.ndim != 1 or not np.all((levels >= 0.0) & (levels <= 1.0)):
        raise wrong("quantiles", given, "numbers from 0 to 1, for example (0.05, 0.5, 0.95)")
    return levels
