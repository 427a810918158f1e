"""Counts, intervals and attractors of a sweep: the data of ``sweep --json``, and the text."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from itertools import groupby, pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wedgebrake.analysis.linear_stability import sliding_damping
from wedgebrake.analysis.motion import is_solved_as_machine
from wedgebrake.cli.output import describe, header, timed, with_unit
from wedgebrake.dynamics.enums import MotionClass, StickClass, motion_word
from wedgebrake.model.groups import SETTERS
from wedgebrake.model.machine import Machine
from wedgebrake.model.study import Study
from wedgebrake.model.sweep_settings import INITIAL
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.sweeps.results import CONTACT, PointStatus

if TYPE_CHECKING:
    import xarray as xr

_ENDS = {
    PointStatus.NOT_COMPUTED: "not computed",
    PointStatus.COMPLETED: "completed",
    PointStatus.DIVERGED: "diverged",
    PointStatus.NO_FORWARD_SOLUTION: "self-locked",
    PointStatus.EVENT_LIMIT: "stopped at max_events",
    PointStatus.STEP_LIMIT: "stopped at max_steps",
    PointStatus.INVALID: "cannot be built",
}
# Outcomes that have a class of motion; and classes that need no class of stick-slip.
_CLASSIFIED = (PointStatus.COMPLETED, PointStatus.DIVERGED, PointStatus.NO_FORWARD_SOLUTION)
_ENDED = (MotionClass.AT_REST, MotionClass.DIVERGED, MotionClass.SELF_LOCKED)
# Bisections of a step of an axis to find the limit of linear stability.
_HALVINGS = 50
_MOST_LINES = 12  # of the intervals, and of the attractors
_MOST_CLASSES = 8  # in one line


def sweep_report(
    study: Study, dataset: xr.Dataset, speed: dict[str, Any], warnings: list[str]
) -> dict[str, Any]:
    """The data of ``sweep --json``."""
    # The dimension of a parameter is renamed if a result has the same name.
    dims = [str(dim) for dim in dataset["status"].dims if dim != "branch"]
    axes = dict(zip(study.sweep.parameters(), dims, strict=True))
    alone = next(iter(axes.items())) if len(axes) == 1 else None
    words, places = _words(dataset)
    several = dataset.sizes.get(CONTACT, 1) > 1
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
        "returns": "crossings" if is_self_excited(study) else "periods",
        **{what: _counts(words, places, what) for what in ("status", "motion", "stick_slip")},
        "contacts": _of_contacts(dataset) if several else None,
        "motion_period": _motion_period(dataset),
        "linear_stability": _linear_stability(study.system, dataset, alone),
        "intervals": list(_intervals(dataset, alone[1], words, places)) if alone else None,
        "attractors": _attractors(dataset) if "attractor" in dataset else None,
        "speed": speed,
        "files": {"picture": None, "data": None, "store": None},
        "warnings": warnings,
    }


def is_self_excited(study: Study) -> bool:
    """Return True if the motions of a sweep are counted by crossings, as they have no period."""
    system: BrakedDriveline | Machine = study.system
    if isinstance(system, Machine):
        return system.autonomous
    return is_solved_as_machine(system, study.run.method) and system.machine.autonomous


def _words(dataset: xr.Dataset) -> tuple[list[dict[str, str]], NDArray[np.intp]]:
    """The words for groups of equal points, and the index of the group of each point.

    The class of stick-slip is that of the contact that sticks in most directions.
    """
    columns = np.stack(
        [
            one.max(CONTACT).to_numpy().astype(np.int64).ravel()
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
    """The words for a point: status, motion and stick-slip."""
    end, class_ = PointStatus(status), MotionClass(motion)
    classified = end in _CLASSIFIED
    word = motion_word(class_, order) if classified else _ENDS[end]
    plain = not classified or class_ in _ENDED or stick == StickClass.NONE
    sticks = word if plain else StickClass(stick).word
    return {"status": _ENDS[end], "motion": word, "stick_slip": sticks}


def _counts(words: list[dict[str, str]], places: NDArray[np.intp], what: str) -> dict[str, int]:
    """Number of points of each class, the most frequent first."""
    counts: dict[str, int] = {}
    for word, count in zip(words, np.bincount(places).tolist(), strict=True):
        counts[word[what]] = counts.get(word[what], 0) + count
    return dict(sorted(counts.items(), key=lambda item: -item[1]))


def _of_contacts(dataset: xr.Dataset) -> dict[str, dict[str, int]]:
    """Number of points in each class of stick-slip, for each contact of a machine."""
    found = {}
    for name in dataset[CONTACT].to_numpy().tolist():
        own, places = _words(dataset.sel({CONTACT: name}))
        found[name] = _counts(own, places, "stick_slip")
    return found


def _motion_period(dataset: xr.Dataset) -> dict[str, float] | None:
    """Shortest and longest period of the limit cycles [s]; None if there are none."""
    if "motion_period" not in dataset:
        return None
    cycles = dataset["motion"].to_numpy() == MotionClass.LIMIT_CYCLE
    periods = dataset["motion_period"].to_numpy()[cycles]
    return {"min": float(periods.min()), "max": float(periods.max())} if periods.size else None


def _linear_stability(
    system: BrakedDriveline, dataset: xr.Dataset, alone: tuple[str, str] | None
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


def _limits(
    system: BrakedDriveline, dataset: xr.Dataset, name: str, dim: str
) -> Iterator[dict[str, Any]]:
    """Values at which the damping of sliding changes sign, and on which side it is positive."""
    values, damping = dataset[dim].to_numpy(), dataset["sliding_damping"].to_numpy()
    damping = damping.reshape(-1, values.size)[0]  # equal for all branches
    order = [i for i in np.argsort(values, kind="stable") if math.isfinite(damping[i])]
    values, stable = values[order], damping[order] > 0.0
    for i in np.flatnonzero(stable[1:] != stable[:-1]):
        low, high = float(values[i]), float(values[i + 1])
        for _ in range(_HALVINGS):
            middle = 0.5 * (low + high)
            side = sliding_damping(system.replace(**{name: middle})) > 0.0
            low, high = (middle, high) if side == stable[i] else (low, middle)
        yield {"value": 0.5 * (low + high), "stable": "above" if stable[i + 1] else "below"}


def sweep_text(system: BrakedDriveline | Machine, report: dict[str, Any]) -> str:
    """The report of ``sweep_report`` as text."""
    axes, total, speed = report["axes"], report["points"], report["speed"]
    lines = [describe(system, axes), *_swept(axes), f"Evaluated {_settings(report)}"]
    torque = None if isinstance(system, Machine) else system.excitation
    sampled = torque is not None and report["returns"] == "periods" and torque.amplitude == 0.0
    if torque is not None and sampled and not {"amplitude", "F0"} & set(axes):
        period = "1/frequency" if {"frequency", "f"} & set(axes) else f"{torque.period:.4g} s"
        lines.append(
            f"  (no torque acts: its period, {period}, only sets the times at which the motion is"
            " sampled; synchronous and nT-periodic refer to that period)"
        )
    lines += ["", f"Points: {total}, {_listed(report['status'], total)}"]
    lines.append(f"Motion: {_listed(report['motion'], total)}")
    period = report["motion_period"]
    if period:
        ends = list(dict.fromkeys(f"{period[end]:.6g}" for end in ("min", "max")))
        lines.append(f"Period of limit cycles: {' to '.join(ends)} s")
    if report["contacts"]:
        lines += [
            f"Stick-slip of {name}: {_listed(counts, total)}"
            for name, counts in report["contacts"].items()
        ]
    else:
        lines.append(f"Stick-slip: {_listed(report['stick_slip'], total)}")
    if "undecided" in report["motion"] and report["protocol"]["transient"] != "auto":
        lines.append("  (--transient auto gives each point the time to settle)")
    if report["linear_stability"]:
        lines += _linear(report)
    if report["intervals"]:
        lines += ["", *_along(report)]
    if report["attractors"] is not None:
        found = report["attractors"]
        lines += ["", f"Attractors: {len(found)}, by the share of the points that settle to each"]
        lines += [
            f"  {one['number']:3}  {_share(one['share']):>7}  {one['motion']}"
            for one in found[: _MOST_LINES - 1]
        ]
        if len(found) >= _MOST_LINES:
            lines.append(f"  and {len(found) - _MOST_LINES + 1} more; --json lists each")
    resumed = f"{speed['resumed']} were in the store"
    if not speed["computed"]:
        return "\n".join([*lines, "", f"All {speed['resumed']} points were in the store."])
    took = timed(f"{speed['computed']} points", speed)
    return "\n".join([*lines, "", f"{took}; {resumed}" if speed["resumed"] else took])


def _swept(axes: dict[str, Any]) -> Iterator[str]:
    for name, axis in axes.items():
        values, meaning = axis["values"], axis["meaning"]
        many = f"{len(values)} values" if len(values) > 1 else "one value"
        if name in SETTERS:  # a group may set a part that its name does not suggest: F0 the torque
            meaning += f"; sets {SETTERS[name].target}"
        span = f"{values.min():.6g} to {values.max():.6g}{with_unit(axis['unit'])}"
        yield f"Swept: {name} from {span}, {many} ({meaning})"


def _settings(report: dict[str, Any]) -> str:
    protocol, swept = report["protocol"], INITIAL.keys() & report["axes"]
    of_machine, returns = "groups" not in report, report["returns"]
    what = f"torque {returns}" if returns == "periods" and not of_machine else returns
    if protocol["transient"] == "auto":
        text = (
            f"over {protocol['recorded']} {what} once each point has settled, at the latest"
            f" after {protocol['limit']} {returns}"
        )
    else:
        text = f"over {what} {protocol['transient']}–{protocol['periods']}"
    angle, velocity = protocol["initial"]
    if protocol["follow"] is not None:
        text += f"; each point starts where its neighbour in {protocol['follow']} ended"
    elif of_machine:
        text += ", starting from the initial state"
    elif not swept and velocity == 0.0:
        text += f", starting from rest at angle {angle:.6g}" + (" rad" if angle else "")
    elif len(swept) < 2:
        given = {"angle": f"{angle:.6g} rad", "velocity": f"{velocity:.6g} rad/s"}
        fixed = [f"{name} {one}" for name, one in given.items() if f"initial_{name}" not in swept]
        text += f", starting from {' and '.join(fixed)}"
    return f"{text}; method {report['method']}"


def _listed(counts: dict[str, int], total: int) -> str:
    """Classes with their counts and shares, the most frequent first."""
    shown = list(counts.items())[:_MOST_CLASSES]
    if len(shown) == 1:
        return f"all {shown[0][0]}"
    text = ", ".join(f"{count} {word} ({_share(count / total)})" for word, count in shown)
    rest = total - sum(count for _, count in shown)
    return text + (f", {rest} in {len(counts) - len(shown)} other classes" if rest else "")


def _share(share: float) -> str:
    percent = 100.0 * share
    return f"{percent:.2g} %" if percent < 99.5 else f"{percent:.4g} %"


def _linear(report: dict[str, Any]) -> list[str]:
    share, locked, limits = report["linear_stability"].values()
    if math.isnan(share):
        return []
    if locked == 1.0:
        return ["Linear stability: the brake locks itself at every point, no steady sliding exists"]
    if not locked and share in (0.0, 1.0):
        what = f"is {'' if share else 'un'}stable at every point"
    elif limits:
        (name,) = report["axes"]
        places = (f"{name} = {one['value']:.6g} (stable {one['stable']} it)" for one in limits)
        what = f"has its limit{'s' if len(limits) > 1 else ''} at {', '.join(places)}"
    else:
        what = f"is stable at {_share(share)} of the points"
    also = f"; the brake locks itself at {_share(locked)} of the points" if locked else ""
    return [f"Linear stability: sliding {what}{also}"]


def _along(report: dict[str, Any]) -> list[str]:
    """The motion along the parameter, in about a dozen lines."""
    ((name, axis),) = report["axes"].items()
    branches: dict[str | None, list[_Row]] = {}
    for one in report["intervals"]:
        branches.setdefault(one.get("branch"), []).append(
            (one["from"], one["to"], one["points"], [_motion(one)])
        )
    rows = list(branches.values())
    if len(rows) > 1 and rows[0] == rows[1]:
        branches = {"up and down alike": rows[0]}
    ordered = np.unique(axis["values"])
    digits = 6  # enough to distinguish neighbouring values
    if ordered.size > 1:
        ratio = np.max(np.abs(ordered)) / np.min(np.diff(ordered))
        digits = min(15, max(3, math.ceil(math.log10(ratio)) + 1))
    lines, cut = [], False
    for branch, every in branches.items():
        shown = _condensed(every, _MOST_LINES // len(branches))
        cut = cut or len(shown) < len(every)
        ends = [list(dict.fromkeys(f"{one:.{digits}g}" for one in row[:2])) for row in shown]
        places = [" ... ".join(one) for one in ends]
        width = max(map(len, places))
        lines.append(f"Along {name}" + (f", {branch}:" if branch else ":"))
        lines += [
            f"  {place:{width}}   {_mixed(row[3])}"
            for place, row in zip(places, shown, strict=True)
        ]
    return [*lines, "  (short intervals are merged; --json lists each)"] if cut else lines


_Row = tuple[float, float, int, list[str]]


def _motion(run: dict[str, Any]) -> str:
    motion, sticks = run["motion"], run["stick_slip"]
    return str(motion) if motion == sticks else f"{motion}, {sticks}"


def _condensed(rows: list[_Row], most: int) -> list[_Row]:
    """Rows, reduced to a largest number by merging the shortest with neighbours."""
    kept = rows
    for longest in sorted({row[2] for row in rows}):
        if len(kept) <= most:
            break
        kept = _merged(rows, longest)
    return kept


def _merged(rows: list[_Row], longest: int) -> list[_Row]:
    found: list[_Row] = []
    for short, group in groupby(rows, lambda row: row[2] <= longest):
        together = list(group)
        if short:
            by_length = sorted(together, key=lambda row: -row[2])
            words = list(dict.fromkeys(word for row in by_length for word in row[3]))
            points = sum(row[2] for row in together)
            together = [(together[0][0], together[-1][1], points, words)]
        found += together
    return found


def _mixed(words: list[str]) -> str:
    if len(words) == 1:
        return words[0]
    motions = list(dict.fromkeys(word.split(",")[0] for word in words))
    more = f" and {len(motions) - 3} others" if len(motions) > 4 else ""
    return f"mixed: {', '.join(motions[: 3 if more else 4])}{more}"
