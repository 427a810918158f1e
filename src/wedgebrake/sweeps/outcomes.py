"""Outcomes of samples: linear stability, stick-slip, limits; their probabilities."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wedgebrake.analysis.linear_stability.equilibrium import CornerError
from wedgebrake.analysis.linear_stability.machine_stability import SlidingCase, machine_stability
from wedgebrake.analysis.linear_stability.sliding_contact import Method
from wedgebrake.arrays import FloatArray
from wedgebrake.dynamics.enums import MotionClass, StickClass
from wedgebrake.errors import InputError, nearest
from wedgebrake.model.machine import Machine
from wedgebrake.model.studies.sweep_settings import untied
from wedgebrake.model.validation import check_number, unknown, wrong
from wedgebrake.sweeps.results import VARIABLES, PointStatus

if TYPE_CHECKING:
    import xarray as xr

SAMPLE, OUTCOME, DIRECTION = "sample", "outcome", "direction"
DIRECTIONS = ("forwards", "backwards")
UNSTABLE = tuple(f"unstable_{one}" for one in DIRECTIONS)
LOCKED, STICKS, UNDECIDED, SAFE = "self_locked", "stick_slip", "undecided", "safe"
MEANINGS = {
    UNSTABLE[0]: "no stable sliding forwards: small vibration grows, or the brake locks itself",
    UNSTABLE[1]: "no stable sliding backwards: small vibration grows, or the brake locks itself",
    LOCKED: "a brake locks itself in a direction",
    STICKS: "the motion sticks and slips",
    UNDECIDED: "the class of motion is undecided",
    SAFE: "no other outcome occurs, and the class of motion is known",
}
"""Outcomes by name; limits of results, as "peak_torque > 300", are further ones."""
LINEAR = (*UNSTABLE, LOCKED)
"""Outcomes that need no run."""
UNKNOWN = -1
"""Value of an outcome that is not known."""

# Quantities of which quantiles and Sobol indices are computed, if the result has them.
QUANTITIES = ("amplitude", "peak_torque", "rms_torque", "growth_rate")
_GROWTH = {"units": "1/s", "long_name": "growth rate of small vibration about sliding"}
_LOCKS = {"units": "1", "long_name": "whether the brake locks itself in the direction"}
_AMPLITUDE = {"units": "rad/s", "long_name": "half the range of the speed"}
# Two-sided 95 % quantile of the normal distribution.
NORMAL95 = 1.959963984540054


def check_outcomes(given: Any, limits: Mapping[str, float]) -> tuple[str, ...]:
    """The names of the outcomes that are asked for, limits included, ``SAFE`` last."""
    known = [name for name in MEANINGS if name != SAFE]
    if given is None:
        chosen: Sequence[str] = known
    elif isinstance(given, str) or not isinstance(given, Collection):
        raise wrong("outcomes", given, "names in a list", f"Names are {', '.join(known)}.")
    else:
        chosen = list(dict.fromkeys(given))
    for name in chosen:
        if name not in MEANINGS:
            raise unknown("outcomes", name, [*MEANINGS], "no such outcome")
    names = [one for one in chosen if one != SAFE]
    if limits and UNDECIDED not in names:
        names.append(UNDECIDED)
    return (*names, *(limit_name(*one) for one in limits.items()), SAFE)


def check_limits(given: Any) -> dict[str, float]:
    """Limits of results of a sweep by name [SI units]."""
    if given is None:
        return {}
    example = 'For example {"peak_torque": 300.0}.'
    if not isinstance(given, Mapping):
        raise wrong("limits", given, "a mapping of results to their limits", example)
    allowed = ["amplitude", *(n for n, one in VARIABLES.items() if one.dtype == "float64")]
    for name, value in given.items():
        if name not in allowed:
            # For the name of a torque, its measures are suggested: rms_torque, peak_torque.
            of_this = [one for one in allowed if one.endswith(f"_{name}")]
            problem = f"no such result. {nearest(str(name), of_this or allowed)}"
            raise InputError.of("limits", name, problem, allowed=tuple(allowed))
        check_number(f"limits.{name}", value)
    return {name: float(value) for name, value in given.items()}


def limit_name(name: str, value: float) -> str:
    """Name of the outcome that a result exceeds a limit."""
    return f"{name} > {value:g}"


def linear_outcomes(
    system: Any, values: Mapping[str, FloatArray], method: Method
) -> tuple[FloatArray, NDArray[np.bool_], NDArray[np.bool_]]:
    """Growth rates [1/s] and self-locking over (sample, direction), and which samples are valid.

    The growth rate is the largest of all cases in which a contact slides in the direction; nan
    where there is none, and where the brake locks itself. Without contacts it is the same in both
    directions. Rates within rounding are 0. If the equilibrium is at a corner, for example where a
    gap closes, they are the larger of those on the two sides.
    """
    names = [(name, untied(name)) for name in values]
    count = len(next(iter(values.values())))
    growth = np.full((count, 2), np.nan)
    locked = np.zeros((count, 2), bool)
    valid = np.ones(count, bool)
    for i in range(count):
        changes = {one: float(values[name][i]) for name, ties in names for one in ties}
        try:
            machine = system.machine_at(changes)
        except InputError:
            valid[i] = False
            continue
        for case in _cases(machine, method):
            sides = [0 if one.direction > 0 else 1 for one in case.contacts]
            for side, contact in zip(sides, case.contacts, strict=True):
                locked[i, side] |= contact.locked
            rate = case.growth_rate
            if rate is None:
                continue
            rate = 0.0 if abs(rate) <= case.rounding else rate
            # Vibration without contacts has no direction and counts in both.
            for side in sides or (0, 1):
                known = growth[i, side]
                growth[i, side] = rate if math.isnan(known) else max(known, rate)
    return growth, locked, valid


def _cases(machine: Machine, method: Method) -> tuple[SlidingCase, ...]:
    """The cases of steady sliding; at a corner, those on both sides."""
    try:
        return machine_stability(machine, method=method, modes=False).cases
    except CornerError:
        sides = [
            machine_stability(machine, method=method, modes=False, corner=side) for side in (-1, 1)
        ]
        return tuple(case for one in sides for case in one.cases)


def with_linear(dataset: xr.Dataset, growth: FloatArray, locked: NDArray[np.bool_]) -> xr.Dataset:
    """Add the linear verdicts to a dataset over samples."""
    dims = (SAMPLE, DIRECTION)
    return dataset.assign(
        growth_rate=(dims, growth, _GROWTH), self_locking=(dims, locked, _LOCKS)
    ).assign_coords({DIRECTION: list(DIRECTIONS)})


def with_amplitude(dataset: xr.Dataset) -> xr.Dataset:
    """Add half the range of the speed to the results of runs."""
    half = 0.5 * (dataset["highest_velocity"] - dataset["lowest_velocity"])
    return dataset.assign(amplitude=half.assign_attrs(_AMPLITUDE))


def occurrences(
    dataset: xr.Dataset, names: Sequence[str], limits: Mapping[str, float]
) -> NDArray[np.int8]:
    """Whether each outcome occurs, (sample, outcome): 1, 0, or ``UNKNOWN``."""
    status = dataset["status"].to_numpy()
    exists = status != PointStatus.INVALID
    found: dict[str, NDArray[Any]] = {}
    if "growth_rate" in dataset:
        growth, locked = dataset["growth_rate"].to_numpy(), dataset["self_locking"].to_numpy()
        for side, name in enumerate(UNSTABLE):
            found[name] = _known((growth[:, side] > 0.0) | locked[:, side], exists)
        found[LOCKED] = _known(locked.any(axis=1), exists)
    bad = ~exists
    if "motion" in dataset:
        motion = dataset["motion"].to_numpy()
        completed = status == PointStatus.COMPLETED
        diverged = status == PointStatus.DIVERGED
        sticks = _over_parts(dataset["stick_class"])
        found[STICKS] = _known(sticks >= StickClass.UNIDIRECTIONAL, completed)
        decided = completed & (motion != MotionClass.UNDECIDED)
        known = decided | diverged | (status == PointStatus.NO_FORWARD_SOLUTION)
        found[UNDECIDED] = (~known).astype(np.int8)
        for name, limit in limits.items():
            above = _over_parts(dataset[name]) > limit
            found[limit_name(name, limit)] = _known(above | diverged, completed | diverged)
        bad = ~decided
    for name in names:
        if name != SAFE:
            bad = bad | (found[name] != 0)
    found[SAFE] = (~bad).astype(np.int8)
    return np.stack([found[name] for name in names], axis=1)


def has_direction(dataset: xr.Dataset, name: str) -> bool:
    """False if an outcome is instability in a direction in which no sample slides or locks."""
    if name not in UNSTABLE:
        return True
    side = {DIRECTION: UNSTABLE.index(name)}
    growth, locked = dataset["growth_rate"].isel(side), dataset["self_locking"].isel(side)
    return bool((growth.notnull() | locked).any())


def _known(occurs: Any, known: NDArray[np.bool_]) -> NDArray[np.int8]:
    return np.where(known, occurs, UNKNOWN).astype(np.int8)


def _over_parts(values: xr.DataArray) -> NDArray[Any]:
    """The largest value over the parts of a machine, for each sample; -inf without parts."""
    flat = values.to_numpy().reshape(values.sizes[SAMPLE], -1)
    if not flat.shape[1]:
        return np.full(len(flat), -np.inf)
    return np.asarray(np.fmax.reduce(flat, axis=1))


def wilson(
    count: NDArray[Any] | float, total: NDArray[Any] | float
) -> tuple[FloatArray, FloatArray]:
    """The 95 % Wilson score interval of a probability, from the occurrences in a total."""
    count, total = np.asarray(count, float), np.asarray(total, float)
    square = NORMAL95**2
    share = count / total
    middle = share + square / (2.0 * total)
    half = NORMAL95 * np.sqrt(share * (1.0 - share) / total + square / (4.0 * total**2))
    low, high = (middle - half) / (1.0 + square / total), (middle + half) / (1.0 + square / total)
    # Exact where rounding would leave a rest.
    return np.where(count == 0.0, 0.0, low), np.where(count == total, 1.0, high)


def with_probabilities(
    dataset: xr.Dataset, names: Sequence[str], limits: Mapping[str, float]
) -> xr.Dataset:
    """Add occurrences, probabilities of outcomes and their intervals to a dataset over samples."""
    occurs = occurrences(dataset, names, limits)
    total = len(occurs)
    counts = np.count_nonzero(occurs == 1, axis=0)
    missing = np.count_nonzero(occurs == UNKNOWN, axis=0)
    low, _ = wilson(counts, total)
    _, high = wilson(counts + missing, total)
    meanings = {
        "occurs": "whether the outcome occurs: 1 yes, 0 no, -1 not known",
        "probability": "share of the samples in which the outcome is known to occur",
        "low": "lower end of the 95 % interval, if the outcome occurs in no unknown sample",
        "high": "upper end of the 95 % interval, if the outcome occurs in all unknown samples",
        "unknown": "number of samples in which the outcome is not known",
    }
    values = {"probability": counts / total, "low": low, "high": high, "unknown": missing}
    variables: dict[str, Any] = {name: (OUTCOME, one) for name, one in values.items()}
    variables["occurs"] = ((SAMPLE, OUTCOME), occurs)
    return dataset.assign(
        {name: (*one, {"units": "1", "long_name": meanings[name]})
         for name, one in variables.items()}
    ).assign_coords({OUTCOME: list(names)})  # fmt: skip


def quantities(dataset: xr.Dataset, limits: Mapping[str, float]) -> dict[str, FloatArray]:
    """Values of the quantities over the samples, one for each part; inf where a run diverged.

    Quantities without any value are left out.
    """
    diverged = dataset["status"].to_numpy() == PointStatus.DIVERGED
    found = {}
    for name in dict.fromkeys((*QUANTITIES, *limits)):
        if name not in dataset:
            continue
        one = dataset[name]
        flat = one.to_numpy().reshape(one.sizes[SAMPLE], -1).T
        parts = [str(part) for part in one[one.dims[1]].to_numpy()] if one.ndim == 2 else [""]
        for part, values in zip(parts, flat, strict=True):
            if name != "growth_rate":
                values = np.where(diverged, math.inf, values)
            if not np.all(np.isnan(values)):
                found[f"{name} {part}".strip()] = values
    return found


def with_quantiles(
    dataset: xr.Dataset, limits: Mapping[str, float], levels: FloatArray
) -> xr.Dataset:
    """Add quantiles of the quantities over the samples whose value is known."""
    found = quantities(dataset, limits)
    table = np.full((len(found), len(levels)), np.nan)
    for row, values in zip(table, found.values(), strict=True):
        row[:] = np.quantile(values[~np.isnan(values)], levels, method="higher")
    attrs = {"units": "of the quantity", "long_name": "quantile over the samples with a value"}
    return dataset.assign(quantiles=(("quantity", "quantile"), table, attrs)).assign_coords(
        quantity=list(found), quantile=levels
    )
