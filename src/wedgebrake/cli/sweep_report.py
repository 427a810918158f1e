"""The data that ``sweep --json`` prints: counts, intervals of a parameter, attractors."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wedgebrake.analysis.linear_stability import sliding_damping
from wedgebrake.cli.sweep_command import Outcome
from wedgebrake.cli.writing import versions
from wedgebrake.dynamics.enums import MotionClass, StickClass, motion_word
from wedgebrake.model.study import Study
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.sweeps.results import PointStatus

if TYPE_CHECKING:
    import xarray as xr

Codes = NDArray[np.int64]
# Classes that a class of stick-slip adds nothing to.
_ENDED = (MotionClass.AT_REST, MotionClass.DIVERGED, MotionClass.SELF_LOCKED)
_ENDS = {
    PointStatus.NOT_COMPUTED: "not computed",
    PointStatus.COMPLETED: "completed",
    PointStatus.DIVERGED: "diverged",
    PointStatus.NO_FORWARD_SOLUTION: "self-locked",
    PointStatus.EVENT_LIMIT: "stopped at max_events",
    PointStatus.STEP_LIMIT: "stopped at max_steps",
    PointStatus.INVALID: "cannot be built",
}
# Bisections of a step of an axis to find the limit of linear stability.
_HALVINGS = 50


def sweep_report(study: Study, outcome: Outcome, files: dict[str, Path | None]) -> dict[str, Any]:
    """The data that ``sweep --json`` prints.

    files : "picture", "data", "store" -> their paths
    """
    dataset = outcome.dataset
    attrs = dataset.attrs
    # A parameter's dimension may have another name, where a result has its own.
    dims = [str(dim) for dim in dataset["status"].dims if dim != "branch"]
    axes = dict(zip(study.sweep.parameters(), dims, strict=True))
    alone = next(iter(axes.items())) if len(axes) == 1 else None
    codes = _codes(dataset)
    return {
        "wedgebrake": attrs["wedgebrake_version"],
        "versions": versions(),
        "kind": attrs["kind"],
        "method": attrs["method"],
        "system": json.loads(attrs["system"]),
        "groups": json.loads(attrs["groups"]),
        "protocol": json.loads(attrs["protocol"]),
        "axes": {
            name: {
                "dimension": dim,
                "unit": dataset[dim].attrs["units"],
                "meaning": dataset[dim].attrs["long_name"],
                "values": dataset[dim].to_numpy(),
            }
            for name, dim in axes.items()
        },
        "points": int(codes.size),
        "status": _counts(codes, lambda point: point["status"]),
        "motion": _counts(codes, lambda point: point["motion"]),
        "stick_slip": _counts(codes, lambda point: point["stick_slip"]),
        "linear_stability": {
            "stable_share": _stable_share(dataset),
            "locked_share": float(np.isposinf(dataset["sliding_damping"].to_numpy()).mean()),
            "limits": list(_limits(study.system, dataset, *alone)) if alone else None,
        },
        "intervals": _intervals(dataset, alone[1], codes) if alone else None,
        "attractors": _attractors(dataset) if "attractor" in dataset else None,
        "speed": {
            "computed": outcome.computed,
            "resumed": outcome.resumed,
            "seconds": outcome.seconds,
            "points_per_second": outcome.computed / outcome.seconds if outcome.computed else None,
            "with_compilation": outcome.compiled,
        },
        "files": {what: None if path is None else str(path) for what, path in files.items()},
        "warnings": outcome.warnings,
    }


# How a point ended and what it does, in one whole number: points with equal numbers are alike.


def _codes(dataset: xr.Dataset) -> Codes:
    status, motion, stick, order = (
        dataset[name].to_numpy().astype(np.int64)
        for name in ("status", "motion", "stick_class", "order")
    )
    return np.asarray(((status * 16 + motion + 1) * 16 + stick + 1) * 2**32 + order)


def _meaning(code: int) -> dict[str, str]:
    """The words for a point: status, motion and stick-slip."""
    rest, order = divmod(code, 2**32)
    rest, stick = divmod(rest, 16)
    status, motion = divmod(rest, 16)
    end, class_ = PointStatus(status), MotionClass(motion - 1)
    odd = end not in (
        PointStatus.COMPLETED,
        PointStatus.DIVERGED,
        PointStatus.NO_FORWARD_SOLUTION,
    )
    word = _ENDS[end] if odd else motion_word(class_, order)
    plain = odd or class_ in _ENDED or stick - 1 == StickClass.NONE
    sticks = word if plain else StickClass(stick - 1).word
    return {"status": _ENDS[end], "motion": word, "stick_slip": sticks}


def _counts(codes: Codes, word: Any) -> dict[str, int]:
    """Number of points of each class, the most frequent first."""
    counts: dict[str, int] = {}
    for code, count in zip(*np.unique(codes, return_counts=True), strict=True):
        one = word(_meaning(int(code)))
        counts[one] = counts.get(one, 0) + int(count)
    return dict(sorted(counts.items(), key=lambda item: -item[1]))


def _intervals(dataset: xr.Dataset, dim: str, codes: Codes) -> list[dict[str, Any]]:
    """Intervals of neighbouring values with the same motion, in ascending order."""
    values = dataset[dim].to_numpy()
    order = np.argsort(values, kind="stable")
    branches = dataset["branch"].to_numpy().tolist() if "branch" in dataset.dims else [None]
    found = []
    # Points whose words are the same are one run, whatever else differs.
    known, places = np.unique(codes, return_inverse=True)
    words = [_meaning(int(code)) for code in known]
    alike = np.array([words.index(one) for one in words])[places]
    for branch, row in zip(branches, alike.reshape(len(branches), -1), strict=True):
        for begin, end in _runs(row[order]):
            run: dict[str, Any] = {} if branch is None else {"branch": branch}
            run |= {
                "from": float(values[order[begin]]),
                "to": float(values[order[end - 1]]),
                "points": end - begin,
                **words[row[order[begin]]],
            }
            found.append(run)
    return found


def _runs(codes: Codes) -> Iterator[tuple[int, int]]:
    cuts = [0, *(np.flatnonzero(np.diff(codes)) + 1).tolist(), codes.size]
    yield from pairwise(cuts)


def _attractors(dataset: xr.Dataset) -> list[dict[str, Any]]:
    columns = (dataset[f"attractor_{name}"].to_numpy() for name in ("motion", "order", "share"))
    return [
        {"number": number, "motion": motion_word(int(motion), int(order)), "share": float(share)}
        for number, (motion, order, share) in enumerate(zip(*columns, strict=True))
    ]


def _stable_share(dataset: xr.Dataset) -> float:
    """Share of the points at which steady sliding exists and decays; nan without points."""
    damping = dataset["sliding_damping"].to_numpy()
    known = ~np.isnan(damping)
    stable = np.isfinite(damping[known]) & (damping[known] > 0.0)
    return float(np.mean(stable)) if known.any() else math.nan


def _limits(
    system: BrakedDriveline, dataset: xr.Dataset, name: str, dim: str
) -> Iterator[dict[str, Any]]:
    """Values at which the damping of sliding changes sign, and on which side it is positive."""
    values, damping = dataset[dim].to_numpy(), dataset["sliding_damping"].to_numpy()
    damping = damping.reshape(-1, values.size)[0]  # branches have the same
    order = [i for i in np.argsort(values, kind="stable") if math.isfinite(damping[i])]
    values, stable = values[order], damping[order] > 0.0
    for i in np.flatnonzero(stable[1:] != stable[:-1]):
        low, high = float(values[i]), float(values[i + 1])
        for _ in range(_HALVINGS):
            middle = 0.5 * (low + high)
            side = sliding_damping(system.replace(**{name: middle})) > 0.0
            low, high = (middle, high) if side == stable[i] else (low, middle)
        yield {"value": 0.5 * (low + high), "stable": "above" if stable[i + 1] else "below"}
