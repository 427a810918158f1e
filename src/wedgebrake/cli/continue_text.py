"""The text that ``continue`` prints."""

from __future__ import annotations

from itertools import zip_longest
from typing import Any

from wedgebrake.cli.continue_report import without_value
from wedgebrake.cli.writing import compiled_note, describe, file_lines, with_unit
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.orbits.bifurcation_types import Kind, Scenario

_MOST_LINES = 40  # of the table of bifurcations
_SCENARIOS = {
    Scenario.PERSISTENCE: "the motion continues, slightly changed",
    Scenario.FOLD: "two motions meet and end",
    Scenario.JUMP: "no nearby motion continues",
}
_SOURCE = (
    "Bifurcations of friction as in M. di Bernardo, C. J. Budd, A. R. Champneys and P. Kowalczyk,"
    " Piecewise-smooth Dynamical Systems (2008), chapters 7 and 8."
)
_STABLE = (
    "  Stable: small disturbances die out. Other motions may coexist with a stable one; a sweep"
    " over initial_angle and initial_velocity shows which is reached from which initial state."
)


def continue_text(system: BrakedDriveline, report: dict[str, Any]) -> str:
    """The report of ``continue_report`` in words."""
    name = report["parameter"]["name"]
    lines = [report["answer"], "", describe(system, [name]), _range(report)]
    verdict = report["start"]["verdict"]
    lines += [f"Beginning, at {name} = {report['range'][0]:.6g}: {verdict}", "", *_branches(report)]
    lines += ["", *_bifurcations(report)]
    if report["boundaries"] is not None:
        lines += ["", *_boundaries(report)]
    lines += [*_meanings(report), "", _speed(report["speed"])]
    return "\n".join([*lines, *file_lines(report["files"])])


def _range(report: dict[str, Any]) -> str:
    parameter, (first, last) = report["parameter"], report["range"]
    unit = with_unit(parameter["unit"])
    return (
        f"Followed: {parameter['name']} from {first:.6g} to {last:.6g}{unit}"
        f" ({parameter['meaning']}); method {report['method']}"
    )


def _branches(report: dict[str, Any]) -> list[str]:
    name = report["parameter"]["name"]
    lines = ["Branches of periodic motions, stable or not:"]
    for one in report["branches"]:
        begin, end = one["begin"], one["end"]
        why = begin["why"]
        if one["origin"] is not None:
            why += f" of branch {report['bifurcations'][one['origin']]['branch'] + 1}"
        ended = without_value(end["why"], name, end["value"])
        lines.append(
            f"  {one['number'] + 1}  {one['motion']}: begins at {name} = {begin['value']:.6g}"
            f" ({why}), ends at {end['value']:.6g} ({ended})"
        )
        lines += [f"     stable for {name} = {_interval(run)}" for run in one["stable"]]
        if not one["stable"]:
            lines.append("     stable nowhere")
    last = report["range"][1]
    if all(one["begin"]["why"] != "end of the range" for one in report["branches"]):
        lines.append(
            f"  No other branch begins at {name} = {last:.6g}: the motion that settles there is on"
            " one of these branches, or is not periodic."
        )
    return [*lines, _STABLE]


def _interval(run: dict[str, Any]) -> str:
    """A stable interval and the vibration in it."""
    ends = run["from"], run["to"]
    digits = next((n for n in (6, 8) if f"{ends[0]:.{n}g}" != f"{ends[1]:.{n}g}"), 10)
    speed, torque = run["velocity_amplitude"], run["peak_torque"]
    text = f"{ends[0]:.{digits}g} ... {ends[1]:.{digits}g}"
    text += f"  (velocity amplitude {_span(speed)} rad/s, brake torque up to {torque[1]:.4g} N m"
    share = run["stick_share"]
    if share[1] > 0.0:
        text += f", sticking {_span([100.0 * one for one in share])} % of the time"
    return f"{text})"


def _span(ends: list[float]) -> str:
    low, high = (f"{one:.3g}" for one in ends)
    return low if low == high else f"{low} to {high}"


def _bifurcations(report: dict[str, Any]) -> list[str]:
    found, name = report["bifurcations"], report["parameter"]["name"]
    if not found:
        return ["Bifurcations: none"]
    shown = found[:_MOST_LINES]
    rows = [["branch", name, "bifurcation", "of the motion", "what changes"]]
    rows += [
        [
            str(one["branch"] + 1), f"{one['value']:.9g}", one["kind"], one["motion"],
            "; ".join(one[what] for what in ("effect", "scenario", "change") if one[what]),
        ]
        for one in shown
    ]  # fmt: skip
    widths = [max(map(len, column)) for column in zip_longest(*rows, fillvalue="")]
    lines = [f"Bifurcations: {len(found)}, along the branches (T: the period of the torque)"]
    lines += [
        "  " + "  ".join(f"{one:{width}}" for one, width in zip(row, widths, strict=True)).rstrip()
        for row in rows
    ]
    if len(found) > len(shown):
        lines.append(f"  and {len(found) - len(shown)} more; --json lists each")
    return lines


def _boundaries(report: dict[str, Any]) -> list[str]:
    boundaries = report["boundaries"]
    if not boundaries:
        return ["Boundaries: none; no bifurcation can be followed"]
    names = ", ".join(boundaries[0]["values"])
    lines = [f"Boundaries over {names}: {len(boundaries)} (--json has their points)"]
    for one in boundaries:
        origin = report["bifurcations"][one["bifurcation"]]
        ends = [
            "(" + ", ".join(f"{values[place]:.6g}" for values in one["values"].values()) + ")"
            for place in (0, -1)
        ]
        lines.append(
            f"  {one['kind']}, {origin['motion']}: from ({names}) = {ends[0]} ({one['begin']}) to"
            f" {ends[1]} ({one['end']})"
        )
    return lines


def _meanings(report: dict[str, Any]) -> list[str]:
    """The meaning of the words in the table."""
    found = report["bifurcations"]
    if not found:
        return []
    kinds = [kind for kind in Kind if kind.value in {one["kind"] for one in found}]
    scenarios = {one["scenario"] for one in found}
    words = [(kind.value, kind.meaning) for kind in kinds]
    words += [(one.value, text) for one, text in _SCENARIOS.items() if one.value in scenarios]
    lines = ["", "Meaning:", *(f"  {word}: {meaning}" for word, meaning in words)]
    return lines + ([_SOURCE] if any(kind.of_friction for kind in kinds) else [])


def _speed(speed: dict[str, Any]) -> str:
    text = f"{speed['points']} orbits in {speed['seconds']:.3g} s"
    note = compiled_note(speed)
    return text + (f" ({note})" if note else "")
