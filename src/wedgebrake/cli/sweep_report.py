"""Counts, intervals and attractors of a sweep: the data of ``sweep --json``."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wedgebrake.analysis.linear_stability import linearisation_of, sliding_damping
from wedgebrake.cli.output import header
from wedgebrake.dynamics.enums import MotionClass, StickClass, motion_word
from wedgebrake.errors import InputError
from wedgebrake.model.machine_matrices import natural_frequencies
from wedgebrake.model.studies.study import Study
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.sweeps.results import CONTACT, INERTIA, PointStatus

if TYPE_CHECKING:
    import xarray as xr

    from wedgebrake.model.machine import Machine

_ENDS = {
    PointStatus.NOT_COMPUTED: "not computed",
    PointStatus.COMPLETED: "completed",
    PointStatus.DIVERGED: "diverged",
    PointStatus.NO_FORWARD_SOLUTION: "self-locked",
    PointStatus.EVENT_LIMIT: "stopped at max_events",
    PointStatus.STEP_LIMIT: "stopped at max_steps",
    PointStatus.INVALID: "cannot be built",
}
# Outcomes that have a class of motion.
_CLASSIFIED = (PointStatus.COMPLETED, PointStatus.DIVERGED, PointStatus.NO_FORWARD_SOLUTION)
# Largest relative difference of values that count as equal.
_EQUAL = 1e-9
# Bisections of a step of an axis to find the limit of linear stability.
_HALVINGS = 50


def sweep_report(
    study: Study,
    dataset: xr.Dataset,
    speed: dict[str, Any],
    warnings: list[str],
    quantity: str | None = None,
) -> dict[str, Any]:
    """The data of ``sweep --json``.

    quantity : the results that the picture shows; their largest values are reported
    """
    # The dimension of a parameter is renamed if a result has the same name.
    dims = [str(dim) for dim in dataset["status"].dims if dim != "branch"]
    axes = dict(zip(study.sweep.parameters(), dims, strict=True))
    alone = next(iter(axes.items())) if len(axes) == 1 else None
    words, places = _words(dataset)
    contacts = dataset.sizes.get(CONTACT, 1)
    return {
        **header(study.system),
        "kind": dataset.attrs["kind"],
        "method": dataset.attrs["method"],
        "protocol": json.loads(dataset.attrs["protocol"]),
        "axes": {
            name: {
                "dimension": dim,
                "unit": dataset[dim].attrs["units"],
                "meaning": dataset[dim].attrs["long_name"],
                "values": dataset[dim].to_numpy(),
            }
            for name, dim in axes.items()
        },
        "points": int(places.size),
        "returns": study.system.machine.returns,
        **{what: _counts(words, places, what) for what in ("status", "motion")},
        "stick_slip": _counts(words, places, "stick_slip") if contacts else {},
        "contacts": _of_contacts(dataset) if contacts > 1 else None,
        "motion_period": _motion_period(dataset),
        "linear_stability": _linear_stability(study.system, dataset, alone),
        "not_built": _not_built(study.system, dataset, axes),
        "largest": list(_largest(dataset, alone, quantity)) if alone and quantity else None,
        "natural_frequencies": _natural_frequencies(study.system, dataset, alone),
        "intervals": list(_intervals(dataset, alone[1], words, places)) if alone else None,
        "attractors": _attractors(dataset) if "attractor" in dataset else None,
        "speed": speed,
        "files": {"picture": None, "data": None, "store": None},
        "warnings": warnings,
    }


def _words(dataset: xr.Dataset) -> tuple[list[dict[str, str]], NDArray[np.intp]]:
    """The words for groups of equal points, and the index of the group of each point.

    The class of stick-slip is that of the contact that sticks in most directions.
    """
    columns = np.stack(
        [
            one.reduce(np.max, CONTACT, initial=StickClass.NONE).to_numpy().astype(np.int64).ravel()
            if CONTACT in one.dims
            else one.to_numpy().astype(np.int64).ravel()
            for one in (dataset[name] for name in ("status", "motion", "stick_class", "order"))
        ]
    )
    kinds, places = np.unique(columns, axis=1, return_inverse=True)
    found = [_meaning(*kind) for kind in kinds.T.tolist()]
    # Points with the same words count as equal, regardless of other differences.
    unique = [word for place, word in enumerate(found) if word not in found[:place]]
    return unique, np.array([unique.index(word) for word in found])[places.ravel()]


def _meaning(status: int, motion: int, stick: int, order: int) -> dict[str, str]:
    end, class_ = PointStatus(status), MotionClass(motion)
    classified = end in _CLASSIFIED
    word = motion_word(class_, order) if classified else _ENDS[end]
    plain = not classified or not class_.vibrates or stick == StickClass.NONE
    sticks = word if plain else StickClass(stick).word
    return {"status": _ENDS[end], "motion": word, "stick_slip": sticks}


def _counts(words: list[dict[str, str]], places: NDArray[np.intp], what: str) -> dict[str, int]:
    """Number of points of each class, the most frequent first."""
    counts: dict[str, int] = {}
    for word, count in zip(words, np.bincount(places).tolist(), strict=True):
        counts[word[what]] = counts.get(word[what], 0) + count
    return dict(sorted(counts.items(), key=lambda item: -item[1]))


def _of_contacts(dataset: xr.Dataset) -> dict[str, dict[str, int]]:
    found = {}
    for name in dataset[CONTACT].to_numpy().tolist():
        own, places = _words(dataset.sel({CONTACT: name}))
        found[name] = _counts(own, places, "stick_slip")
    return found


def _motion_period(dataset: xr.Dataset) -> dict[str, float] | None:
    if "motion_period" not in dataset:
        return None
    cycles = dataset["motion"].to_numpy() == MotionClass.LIMIT_CYCLE
    periods = dataset["motion_period"].to_numpy()[cycles]
    return {"min": float(periods.min()), "max": float(periods.max())} if periods.size else None


def _linear_stability(
    system: BrakedDriveline | Machine, dataset: xr.Dataset, alone: tuple[str, str] | None
) -> dict[str, Any] | None:
    """Shares of stable and of locked points, and the limits; None for a machine."""
    if "sliding_damping" not in dataset:
        return None
    damping = dataset["sliding_damping"].to_numpy()
    known = damping[~np.isnan(damping)]
    stable = np.isfinite(known) & (known > 0.0)
    return {
        "stable_share": float(np.mean(stable)) if stable.size else math.nan,
        "locked_share": float(np.isposinf(damping).mean()),
        "limits": list(_limits(system, dataset, *alone)) if alone else None,
    }


def _not_built(
    system: BrakedDriveline | Machine, dataset: xr.Dataset, axes: dict[str, str]
) -> dict[str, Any] | None:
    """The first point that cannot be built, and the reason; None if there is none."""
    status = dataset["status"]
    status = status.isel(branch=0) if "branch" in status.dims else status
    places = np.argwhere(status.transpose(*axes.values()).to_numpy() == PointStatus.INVALID)
    for place in places[:1]:
        values = {
            name: float(dataset[dim][i]) for (name, dim), i in zip(axes.items(), place, strict=True)
        }
        try:
            system.machine_at(values)
        except InputError as error:
            return {"at": values, "reason": str(error)}
    return None


def _largest(
    dataset: xr.Dataset, alone: tuple[str, str], quantity: str
) -> Iterator[dict[str, Any]]:
    """The largest value of each result that the picture shows, for each inertia and contact."""
    from wedgebrake.figures.data.response_diagram import RESPONSE, RESULTS, with_amplitude

    name, dim = alone
    dataset = with_amplitude(dataset)
    names = RESULTS if quantity == RESPONSE else (quantity,)
    known = dataset["status"] == PointStatus.COMPLETED
    for one in names:
        values = dataset[one].where(known) if one in dataset else None
        if values is None or not set(values.dims) <= {dim, "branch", INERTIA, CONTACT}:
            continue
        # The inertia of a driveline may be the swept parameter.
        parts = [two for two in (INERTIA, CONTACT) if two in values.dims and two != dim]
        part = next(iter(parts), "")
        for own in [values.sel({part: two}) for two in values[part]] if part else [values]:
            if not bool(own.notnull().any()):
                continue
            # The first of equal values, whose last digits are rounding.
            highest = own.max()
            found = own.isel((own >= highest - _EQUAL * abs(highest)).argmax(...))
            yield {
                "quantity": one,
                "meaning": str(values.attrs.get("long_name", one)),
                "unit": str(values.attrs.get("units", "1")),
                **{two: str(found[two].item()) for two in (part, "branch") if two in found.coords},
                "value": float(found),
                "at": {name: float(found[dim])},
            }


def _natural_frequencies(
    system: BrakedDriveline | Machine, dataset: xr.Dataset, alone: tuple[str, str] | None
) -> list[float] | None:
    """Undamped natural frequencies without contacts [Hz], for a sweep over a frequency."""
    frequency = alone and (alone[0] == "f" or dataset[alone[1]].attrs.get("units") == "Hz")
    if not frequency:
        return None
    return [float(one) / (2.0 * math.pi) for one in natural_frequencies(system.machine)]


def _intervals(
    dataset: xr.Dataset, dim: str, words: list[dict[str, str]], places: NDArray[np.intp]
) -> Iterator[dict[str, Any]]:
    """Intervals of neighbouring values with the same motion, in ascending order."""
    values = dataset[dim].to_numpy()
    order = np.argsort(values, kind="stable")
    branches = dataset["branch"].to_numpy().tolist() if "branch" in dataset.dims else [None]
    for branch, row in zip(branches, places.reshape(len(branches), -1)[:, order], strict=True):
        for begin, end in pairwise([0, *(np.flatnonzero(np.diff(row)) + 1).tolist(), row.size]):
            yield {
                **({} if branch is None else {"branch": branch}),
                "from": float(values[order[begin]]),
                "to": float(values[order[end - 1]]),
                "points": end - begin,
                **words[row[begin]],
            }


def _attractors(dataset: xr.Dataset) -> list[dict[str, Any]]:
    columns = (dataset[f"attractor_{name}"].to_numpy() for name in ("kind", "order", "share"))
    return [
        {"number": number, "motion": motion_word(int(motion), int(order)), "share": float(share)}
        for number, (motion, order, share) in enumerate(zip(*columns, strict=True))
    ]


def _limits(system: Any, dataset: xr.Dataset, name: str, dim: str) -> Iterator[dict[str, Any]]:
    """Values at which the damping of sliding changes sign, and on which side it is positive."""
    values, damping = dataset[dim].to_numpy(), dataset["sliding_damping"].to_numpy()
    damping = damping.reshape(-1, values.size)[0]  # equal for all branches
    method = linearisation_of(dataset.attrs["method"])
    order = [i for i in np.argsort(values, kind="stable") if math.isfinite(damping[i])]
    values, stable = values[order], damping[order] > 0.0
    for i in np.flatnonzero(stable[1:] != stable[:-1]):
        low, high = float(values[i]), float(values[i + 1])
        for _ in range(_HALVINGS):
            middle = 0.5 * (low + high)
            side = sliding_damping(system.replace(**{name: middle}), method) > 0.0
            low, high = (middle, high) if side == stable[i] else (low, middle)
        yield {"value": 0.5 * (low + high), "stable": "above" if stable[i + 1] else "below"}
