"""The report of a sweep as text."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator
from itertools import groupby
from typing import Any

import numpy as np

from wedgebrake.cli.output import describe, timed, with_unit
from wedgebrake.model.groups import SETTERS
from wedgebrake.model.machine import Machine
from wedgebrake.model.system import INITIAL, BrakedDriveline

_MOST_LINES = 12  # of the intervals, and of the attractors
_MOST_CLASSES = 8  # in one line


def sweep_text(system: BrakedDriveline | Machine, report: dict[str, Any]) -> str:
    """The report of ``sweep_report`` as text."""
    axes, total, speed = report["axes"], report["points"], report["speed"]
    lines = [describe(system, axes), *_swept(axes), f"Evaluated {_settings(report)}"]
    torque = report["system"].get("excitation", {})
    sampled = report["returns"] == "periods" and torque.get("amplitude") == 0.0
    if sampled and not {"amplitude", "F0"} & set(axes):
        period = f"{1.0 / torque['frequency']:.4g} s"
        period = "1/frequency" if {"frequency", "f"} & set(axes) else period
        lines.append(
            f"  (no torque acts: its period, {period}, only sets the times at which the motion is"
            " sampled; synchronous and nT-periodic refer to that period)"
        )
    lines += ["", *_points(report, total)]
    if report["linear_stability"]:
        lines += _linear(report)
    if report["natural_frequencies"]:
        values = ", ".join(f"{one:.6g}" for one in report["natural_frequencies"][:_MOST_CLASSES])
        lines.append(f"Undamped natural frequencies, without contacts: {values} Hz")
    if report["largest"]:
        lines += ["", *_largest(report["largest"])]
    if report["intervals"]:
        lines += ["", *_along(report)]
    if report["attractors"] is not None:
        lines += ["", *_attractors(report["attractors"])]
    resumed = f"{speed['resumed']} were in the store"
    if not speed["computed"]:
        return "\n".join([*lines, "", f"All {speed['resumed']} points were in the store."])
    took = timed(f"{speed['computed']} points", speed)
    return "\n".join([*lines, "", f"{took}; {resumed}" if speed["resumed"] else took])


def _points(report: dict[str, Any], total: int) -> list[str]:
    """How the points ended, and their classes."""
    lines = [f"Points: {total}, {_listed(report['status'], total)}"]
    if report["not_built"]:
        at = ", ".join(f"{name} = {value:.6g}" for name, value in report["not_built"]["at"].items())
        reason = "; ".join(report["not_built"]["reason"].split("\n"))
        lines.append(f"  (the first point that cannot be built, {at}: {reason})")
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
    elif report["stick_slip"]:
        lines.append(f"Stick-slip: {_listed(report['stick_slip'], total)}")
    if "undecided" in report["motion"]:
        automatic = report["protocol"]["transient"] == "auto"
        longer = f"--set limit={10 * report['protocol']['limit']} waits longer"
        lines.append(
            f"  ({longer if automatic else '--transient auto gives each point the time to settle'})"
        )
    return lines


def _attractors(found: list[dict[str, Any]]) -> list[str]:
    lines = [f"Attractors: {len(found)}, by the share of the points that settle to each"]
    lines += [
        f"  {one['number']:3}  {_share(one['share']):>7}  {one['motion']}"
        for one in found[: _MOST_LINES - 1]
    ]
    if len(found) >= _MOST_LINES:
        lines.append(f"  and {len(found) - _MOST_LINES + 1} more; --json lists each")
    return lines


def _swept(axes: dict[str, Any]) -> Iterator[str]:
    for name, axis in axes.items():
        values, meaning = axis["values"], axis["meaning"]
        many = f"{len(values)} values" if len(values) > 1 else "one value"
        if name in SETTERS:  # a group may set a part that its name does not suggest: F0 the torque
            meaning += f"; sets {SETTERS[name].target}"
        span = f"{values.min():.6g} to {values.max():.6g}{with_unit(axis['unit'])}"
        yield f"Swept: {name} from {span}, {many} ({meaning})"


def _settings(report: dict[str, Any]) -> str:
    protocol, returns = report["protocol"], report["returns"]
    if protocol["transient"] == "auto":
        text = (
            f"over {protocol['recorded']} {returns} once each point has settled, at the latest"
            f" after {protocol['limit']} {returns}"
        )
    else:
        text = f"over {returns} {protocol['transient']}–{protocol['periods']}"
    if protocol["follow"] is not None:
        text += f"; each point starts where its neighbour in {protocol['follow']} ended"
    elif "initial" in protocol:
        text += _start(protocol["initial"], INITIAL.keys() & report["axes"])
    else:
        text += ", starting from the initial state"
    return f"{text}; method {report['method']}"


def _start(initial: list[float], swept: Collection[str]) -> str:
    """The initial angle [rad] and velocity [rad/s], without what is swept."""
    angle, velocity = initial
    if not swept and velocity == 0.0:
        return f", starting from rest at angle {angle:.6g}" + (" rad" if angle else "")
    given = {"angle": f"{angle:.6g} rad", "velocity": f"{velocity:.6g} rad/s"}
    fixed = [f"{name} {one}" for name, one in given.items() if f"initial_{name}" not in swept]
    return f", starting from {' and '.join(fixed)}" if fixed else ""


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


def _largest(found: list[dict[str, Any]]) -> Iterator[str]:
    """The largest values, a line for each result and each inertia or contact."""
    yield "Largest values:"
    rows = []
    for one in found:
        part = one.get("inertia") or one.get("contact")
        ((name, value),) = one["at"].items()
        branch = f" ({one['branch']})" if "branch" in one else ""
        rows.append(
            (
                one["meaning"] + (f" ({part})" if part else ""),
                f"{one['value']:.5g}{with_unit(one['unit'])}",
                f"at {name} = {value:.6g}{branch}",
            )
        )
    wide, number = (max(len(row[i]) for row in rows) for i in (0, 1))
    for meaning, value, place in rows:
        yield f"  {meaning:{wide}}  {value:{number}}  {place}"


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
