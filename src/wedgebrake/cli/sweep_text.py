"""The text that ``sweep`` prints."""

from __future__ import annotations

import math
from itertools import groupby
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wedgebrake.cli.writing import compiled_note, describe, file_lines, with_unit
from wedgebrake.model.groups import SETTERS
from wedgebrake.model.system import BrakedDriveline

_MOST_LINES = 12  # of the intervals, and of the attractors
_MOST_CLASSES = 8  # in one line


def sweep_text(system: BrakedDriveline, report: dict[str, Any]) -> str:
    """The report of ``sweep_report`` in words."""
    axes = report["axes"]
    lines = [describe(system, axes), *_swept(report), f"Evaluated {_settings(report)}"]
    lines += [*_undriven(system, axes), ""]
    total = report["points"]
    lines.append(f"Points: {total}, {_listed(report['status'], total)}")
    lines.append(f"Motion: {_listed(report['motion'], total)}")
    lines.append(f"Stick-slip: {_listed(report['stick_slip'], total)}")
    if "undecided" in report["motion"] and report["protocol"]["transient"] != "auto":
        lines.append("  (--transient auto gives each point the time to settle)")
    lines += _linear(report)
    if report["intervals"]:
        lines += ["", *_intervals(report)]
    if report["attractors"] is not None:
        lines += ["", *_attractors(report["attractors"])]
    lines += ["", _speed(report)]
    return "\n".join([*lines, *file_lines(report["files"])])


def _swept(report: dict[str, Any]) -> list[str]:
    lines = []
    for name, axis in report["axes"].items():
        values, unit = axis["values"], axis["unit"]
        low, high = values.min(), values.max()
        many = f"{len(values)} values" if len(values) > 1 else "one value"
        meaning = axis["meaning"]
        if name in SETTERS:  # a group may set another part than its name suggests: F0 the torque
            meaning += f"; sets {SETTERS[name].target}"
        span = f"{low:.6g} to {high:.6g}{with_unit(unit)}"
        lines.append(f"Swept: {name} from {span}, {many} ({meaning})")
    return lines


def _settings(report: dict[str, Any]) -> str:
    protocol = report["protocol"]
    if protocol["transient"] == "auto":
        text = (
            f"over {protocol['recorded']} torque periods once each point has settled, at the latest"
            f" after {protocol['limit']} periods"
        )
    else:
        text = f"over torque periods {protocol['transient']}–{protocol['periods']}"
    if protocol["follow"] is not None:
        text += f"; each point starts where its neighbour in {protocol['follow']} ended"
    else:
        text += _start(protocol["initial"], report["axes"])
    return f"{text}; method {report['method']}"


def _start(initial: list[float], axes: dict[str, Any]) -> str:
    """The initial state, as far as it is not swept."""
    (angle, velocity), swept = initial, {"initial_angle", "initial_velocity"} & set(axes)
    if not swept and velocity == 0.0:
        return f", starting from rest at angle {angle:.6g}" + (" rad" if angle else "")
    fixed = [] if "initial_angle" in swept else [f"angle {angle:.6g} rad"]
    fixed += [] if "initial_velocity" in swept else [f"velocity {velocity:.6g} rad/s"]
    return f", starting from {' and '.join(fixed)}" if fixed else ""


def _undriven(system: BrakedDriveline, axes: dict[str, Any]) -> list[str]:
    """The meaning of torque periods if no torque acts."""
    torque = system.excitation
    if torque.amplitude > 0.0 or not {"amplitude", "F0"}.isdisjoint(axes):
        return []
    period = "1/frequency" if not {"frequency", "f"}.isdisjoint(axes) else f"{torque.period:.4g} s"
    text = (
        f"  (no torque acts: its period, {period}, only sets the times at which the motion is"
        " sampled; synchronous and nT-periodic refer to that period)"
    )
    return [text]


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
    share, limits = (report["linear_stability"][name] for name in ("stable_share", "limits"))
    if math.isnan(share):
        return []
    locked = report["linear_stability"]["locked_share"]
    if locked == 1.0:
        return ["Linear stability: the brake locks itself at every point, no steady sliding exists"]
    also = f"; the brake locks itself at {_share(locked)} of the points" if locked else ""
    if not locked and share in (0.0, 1.0):
        what = f"is {'' if share else 'un'}stable at every point"
    elif limits:
        (name,) = report["axes"]
        places = (f"{name} = {one['value']:.6g} (stable {one['stable']} it)" for one in limits)
        what = f"has its limit{'s' if len(limits) > 1 else ''} at {', '.join(places)}"
    else:
        what = f"is stable at {_share(share)} of the points"
    return [f"Linear stability: sliding {what}{also}"]


def _intervals(report: dict[str, Any]) -> list[str]:
    """The motion along the parameter, in about a dozen lines."""
    (name,) = report["axes"]
    digits = _digits(report["axes"][name]["values"])
    branches = {
        branch: list(runs)
        for branch, runs in groupby(report["intervals"], lambda run: run.get("branch"))
    }
    stripped = [[{**run, "branch": None} for run in runs] for runs in branches.values()]
    if len(branches) > 1 and stripped[0] == stripped[1]:
        branches = {"up and down alike": stripped[0]}
    lines, cut = [], False
    for branch, runs in branches.items():
        lines.append(f"Along {name}" + (f", {branch}:" if branch else ":"))
        rows = _condensed([_row(run) for run in runs], _MOST_LINES // len(branches))
        cut = cut or len(rows) < len(runs)
        places = [f"  {_range(low, high, digits)}" for low, high, _ in rows]
        width = max(map(len, places))
        lines += [
            f"{place:{width}}   {words}" for place, (_, _, words) in zip(places, rows, strict=True)
        ]
    if cut:
        lines.append("  (short intervals are merged; --json lists each)")
    return lines


_Row = tuple[float, float, int, list[str]]


def _row(run: dict[str, Any]) -> _Row:
    motion, sticks = run["motion"], run["stick_slip"]
    words = motion if motion == sticks else f"{motion}, {sticks}"
    return run["from"], run["to"], run["points"], [words]


def _condensed(rows: list[_Row], most: int) -> list[tuple[float, float, str]]:
    """At most so many rows: neighbours among the shortest are merged."""
    shortest = 0
    kept = rows
    while len(kept) > most:
        shortest = min(count for _, _, count, _ in rows if count > shortest)
        kept = []
        # The lambda is called before the loop goes on, with the number it was made for.
        for short, group in groupby(rows, lambda row: row[2] <= shortest):  # noqa: B023 - see above
            together = list(group)
            kept += [_joined(together)] if short else together
    return [(low, high, _mixed(words)) for low, high, _, words in kept]


def _joined(rows: list[_Row]) -> _Row:
    by_length = sorted(rows, key=lambda row: -row[2])
    words = list(dict.fromkeys(word for row in by_length for word in row[3]))
    return rows[0][0], rows[-1][1], sum(row[2] for row in rows), words


def _mixed(words: list[str]) -> str:
    if len(words) == 1:
        return words[0]
    motions = list(dict.fromkeys(word.split(",")[0] for word in words))
    more = f" and {len(motions) - 3} others" if len(motions) > 4 else ""
    return f"mixed: {', '.join(motions[: 3 if more else 4])}{more}"


def _digits(values: NDArray[np.float64]) -> int:
    """Significant digits that tell neighbouring values apart."""
    ordered = np.unique(values)
    if ordered.size < 2:
        return 6
    ratio = float(np.max(np.abs(ordered)) / np.min(np.diff(ordered)))
    return min(15, max(3, math.ceil(math.log10(ratio)) + 1))


def _range(low: float, high: float, digits: int) -> str:
    one = f"{low:.{digits}g}"
    return one if low == high else f"{one} ... {high:.{digits}g}"


def _attractors(attractors: list[dict[str, Any]]) -> list[str]:
    lines = [f"Attractors: {len(attractors)}, by the share of the points that settle to each"]
    shown = attractors[: _MOST_LINES - 1]
    lines += [f"  {one['number']:3}  {_share(one['share']):>7}  {one['motion']}" for one in shown]
    if len(attractors) > len(shown):
        lines.append(f"  and {len(attractors) - len(shown)} more; --json lists each")
    return lines


def _speed(report: dict[str, Any]) -> str:
    speed = report["speed"]
    computed, resumed = speed["computed"], speed["resumed"]
    if not computed:
        return f"All {resumed} points were in the store."
    text = f"{computed} points in {speed['seconds']:.3g} s"
    text += f" ({speed['points_per_second']:.3g} points/s"
    note = compiled_note(speed)
    text += f", {note})" if note else ")"
    return text + (f"; {resumed} were in the store" if resumed else "")
