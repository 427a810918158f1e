"""The answer of ``wedgebrake continue``, its branches, bifurcations and boundaries: data, text."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from wedgebrake.analysis.linear_stability.hopf import StabilityLimit
from wedgebrake.cli.output import describe, header, timed, with_unit
from wedgebrake.dynamics.enums import MotionClass, motion_word
from wedgebrake.model.machine import Machine
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.orbits.bifurcation_types import Kind, Scenario, stability_intervals
from wedgebrake.orbits.diagram import Followed, described_measures
from wedgebrake.orbits.orbit import BranchPoint, Orbit
from wedgebrake.orbits.ranges import Range

if TYPE_CHECKING:
    import xarray as xr

_MOST_LINES = 40  # of the table of bifurcations
# Largest number of inertias or contacts that are named.
_MOST_NAMES = 6
# Measures of the stable intervals.
_REPORTED = ("velocity_amplitude", "stick_share", "peak_torque")
# The change of a stable motion at the bifurcation where it loses its stability.
_LOSSES = {
    Kind.FOLD: "it meets an unstable motion, and both end (fold)",
    Kind.PERIOD_DOUBLING: "its period doubles",
    Kind.NEIMARK_SACKER: "a second frequency sets in (Neimark-Sacker)",
    Kind.SYMMETRY_BREAKING: "its two halves become different (symmetry breaking)",
    Kind.BRANCH_POINT: "another branch crosses it",
    Kind.HOPF: "it shrinks to steady sliding (Hopf)",
}
_SCENARIOS = {
    Scenario.PERSISTENCE: "the motion continues, slightly changed",
    Scenario.FOLD: "two motions meet and end",
    Scenario.JUMP: "no nearby motion continues",
    Scenario.TOUCH: "a multiplier reaches the unit circle and returns; the stability is unchanged",
}
_SOURCE = (
    "Bifurcations of friction as in M. di Bernardo, C. J. Budd, A. R. Champneys and P. Kowalczyk,"
    " Piecewise-smooth Dynamical Systems (2008), chapters 7 and 8."
)
_STABLE = (
    "  Stable: small disturbances die out. Other motions may coexist with a stable one; a sweep"
    " over the initial angle and velocity shows which is reached from which initial state."
)


def continue_report(
    system: BrakedDriveline | Machine,
    over: Range,
    start: Orbit | StabilityLimit,
    followed: list[Followed],
    boundaries: list[tuple[BranchPoint, xr.Dataset]] | None,
    speed: dict[str, Any],
) -> dict[str, Any]:
    """The data of ``continue --json``, without kind and settings.

    start      : the first orbit, or the Hopf point
    boundaries : (bifurcation, its boundary); None without a second parameter
    speed      : seconds, and whether with compilation of the kernels
    """
    numbers = _numbers(followed)
    return {
        **header(system),
        "method": followed[0].branch.start.problem.method,
        "parameter": {"name": over.name, "unit": over.unit, "meaning": over.meaning},
        "range": [over.first, over.last],
        "answer": answer(over.name, followed),
        "start": _start(start),
        "measures": {
            name: {"unit": unit, "meaning": meaning}
            for name, (unit, meaning) in described_measures(system).items()
            if name in _REPORTED
        },
        "branches": [_branch(number, one) for number, one in enumerate(followed)],
        "bifurcations": [
            _bifurcation(numbers[id(point)], branch, point)
            for branch, one in enumerate(followed)
            for point in one.branch.bifurcations
        ],
        "boundaries": boundaries
        and [
            {
                "bifurcation": numbers[id(point)],
                "kind": curve.attrs["bifurcation"],
                "begin": curve.attrs["begin"],
                "end": curve.attrs["end"],
                "points": int(curve.sizes["point"]),
                "values": {name: curve[name].to_numpy() for name in curve.attrs["parameters"]},
            }
            for point, curve in boundaries
        ],
        "speed": {"points": sum(len(one.branch.points) for one in followed), **speed},
        "files": {"picture": None, "data": None},
    }


def _start(start: Orbit | StabilityLimit) -> dict[str, Any]:
    if isinstance(start, Orbit):
        return start.as_dict()
    found = start.as_dict()
    return {"verdict": f"{start._headline()}."} | {
        name: found[name] for name in found if name != "machine"
    }


def _numbers(followed: list[Followed]) -> dict[int, int]:
    """Numbers of the bifurcations as in ``Followed.origin``, by identity."""
    found = [point for one in followed for point in one.branch.bifurcations]
    return {id(point): number for number, point in enumerate(found)}


def _branch(number: int, one: Followed) -> dict[str, Any]:
    points = one.branch.points
    return {
        "number": number,
        "order": points[-1].order,
        "motion": _motion(points[-1]),
        "points": len(points),
        "origin": one.origin if one.origin >= 0 else None,
        "begin": {"value": points[0].value, "why": one.begin},
        "end": {"value": points[-1].value, "why": one.branch.end},
        "stable": [_interval(points[first : last + 1]) for first, last in stable_stretches(one)],
    }


def _interval(points: list[BranchPoint]) -> dict[str, Any]:
    """A stable interval of a branch, with the range of each measure: [least, greatest]."""
    found: dict[str, Any] = {"from": points[0].value, "to": points[-1].value}
    for name in _REPORTED:
        values = [getattr(point.measures, name) for point in points]
        found[name] = [min(values), max(values)]
    periods = [point.period for point in points]
    return found | {"period": [min(periods), max(periods)]}


def _bifurcation(number: int, branch: int, point: BranchPoint) -> dict[str, Any]:
    found = point.bifurcation
    assert found is not None  # noqa: S101 - of Branch.bifurcations
    return {
        "number": number,
        "branch": branch,
        "value": point.value,
        "kind": found.kind.value,
        "of_friction": found.kind.of_friction,
        "effect": found.effect,
        "scenario": found.scenario.value,
        "change": found.change,
        "order": point.order,
        "motion": _motion(point),
        "multipliers": [[one.real, one.imag] for one in point.multipliers],
        "sentence": found.sentence,
    }


def _motion(point: BranchPoint) -> str:
    """A periodic motion in words: "synchronous", "2T-periodic", "limit cycle"."""
    if point.problem.self_excited:
        return point.name
    class_ = MotionClass.SYNCHRONOUS if point.order == 1 else MotionClass.PERIODIC
    return motion_word(class_, point.order)


def _named(point: BranchPoint) -> str:
    """The name of a motion in a sentence: "synchronous motion", "limit cycle"."""
    return f"{_motion(point)}{'' if point.problem.self_excited else ' motion'}"


def stable_stretches(one: Followed) -> list[tuple[int, int]]:
    """(first, last) places of points between which a branch is stable, in its order."""
    points = one.branch.points
    marginal = np.array([point.bifurcation is not None for point in points])
    marginal[0] |= one.origin >= 0
    marginal[-1] |= one.branch.met
    stable = np.array([point.stable for point in points])
    return [(first, last) for first, last, holds in stability_intervals(stable, marginal) if holds]


def answer(name: str, followed: list[Followed]) -> str:
    """Stable range of the first motion, and the motion that replaces it."""
    points, stretches = followed[0].branch.points, stable_stretches(followed[0])
    motion, begin = _named(points[0]), f"{name} = {points[0].value:.6g}"
    ranges = " and ".join(
        f"from {name} = {points[low].value:.6g} to {points[high].value:.6g}"
        for low, high in stretches
    )
    first = points[0].bifurcation
    if first is not None and first.kind is Kind.HOPF:
        text = f"At {begin} a limit cycle branches off steady sliding (Hopf)"
        return f"{text}; it is {f'stable {ranges}' if ranges else 'unstable'}."
    if stretches and stretches[0][0] > 0:
        return f"At {begin} the {motion} is unstable; on its branch it is stable {ranges}."
    text = f"From {begin} on, the {motion} is {_course(name, followed[0])}."
    if not stretches or stretches[0][1] == len(points) - 1:
        return text
    number = _numbers(followed).get(id(points[stretches[0][1]]), -1)
    for one in followed[1:]:
        if one.origin == number:
            course = "unstable at first: the system jumps to another motion"
            if any(low == 0 for low, _ in stable_stretches(one)):
                course = _course(name, one)
            new = _named(one.branch.points[-1])
            return f"{text} The {new} that branches off is {course}."
    return text


def _course(name: str, one: Followed) -> str:
    """Stable range of a branch that is stable at its beginning, or its instability."""
    points, stretches = one.branch.points, stable_stretches(one)
    changes = stretches and stretches[0][1] < len(points) - 1
    end = points[stretches[0][1]] if changes else points[-1]
    way = "up" if end.value > points[0].value else "down"
    if changes:
        return f"stable {way} to {name} = {end.value:.6g}; there {_loss_of_stability(end)}"
    why = _without_value(one.branch.end, name, end.value)
    ended = "" if why == "left the range" else f", where it ends: {why}"
    return f"{'' if stretches else 'un'}stable {way} to {name} = {end.value:.6g}{ended}"


def _without_value(why: str, name: str, value: float) -> str:
    """The reason why a branch ends, without the value of the parameter."""
    return why.removesuffix(f" at {name} = {value:g}")


def _loss_of_stability(point: BranchPoint) -> str:
    found = point.bifurcation
    if found is None:
        return "it loses its stability"
    if not found.kind.of_friction:
        return _LOSSES[found.kind]
    effect = f": {found.effect}" if found.effect else ""
    return f"a bifurcation of friction ends its stability ({found.kind.value}{effect})"


def continue_text(system: BrakedDriveline | Machine, report: dict[str, Any], cycles: bool) -> str:
    """The report of ``continue_report`` as text.

    cycles : True if the orbits are limit cycles, whose period is unknown
    """
    parameter, (first, last) = report["parameter"], report["range"]
    name = parameter["name"]
    followed = (
        f"Followed: {name} from {first:.6g} to {last:.6g}{with_unit(parameter['unit'])}"
        f" ({parameter['meaning']}); method {report['method']}"
    )
    where = "" if "case" in report["start"] else f", at {name} = {first:.6g}"
    verdict = f"Beginning{where}: {report['start']['verdict']}"
    lines = [report["answer"], "", describe(system, [name]), followed, verdict, ""]
    lines += [*_branches(report, cycles), *_parts(system), "", *_bifurcations(report, cycles)]
    if report["boundaries"] is not None:
        lines += ["", *_boundaries(report)]
    found = report["bifurcations"]
    if found:
        kinds = [kind for kind in Kind if kind.value in {one["kind"] for one in found}]
        words = {kind.value: kind.meaning for kind in kinds}
        scenarios = {one["scenario"] for one in found}
        words |= {one.value: text for one, text in _SCENARIOS.items() if one.value in scenarios}
        lines += ["", "Meaning:", *(f"  {word}: {meaning}" for word, meaning in words.items())]
        lines += [_SOURCE] if any(kind.of_friction for kind in kinds) else []
    speed = report["speed"]
    return "\n".join([*lines, "", timed(f"{speed['points']} orbits", speed)])


def _branches(report: dict[str, Any], cycles: bool) -> list[str]:
    name = report["parameter"]["name"]
    lines = ["Branches of periodic motions, stable or not:"]
    for one in report["branches"]:
        begin, end = one["begin"], one["end"]
        why = begin["why"]
        if one["origin"] is not None:
            why += f" of branch {report['bifurcations'][one['origin']]['branch']}"
        ended = _without_value(end["why"], name, end["value"])
        lines.append(
            f"  {one['number']}  {one['motion']}: begins at {name} = {begin['value']:.6g}"
            f" ({why}), ends at {end['value']:.6g} ({ended})"
        )
        lines += [f"     stable for {name} = {_vibration(run, cycles)}" for run in one["stable"]]
        if not one["stable"]:
            lines.append("     stable nowhere")
    if all(one["begin"]["why"] != "end of the range" for one in report["branches"]):
        lines.append(
            f"  No other branch begins at {name} = {report['range'][1]:.6g}: the motion that"
            " settles there is on one of these branches, or it is rest,"
            f"{' steady sliding' if cycles else ''} or a motion that is not periodic."
        )
    return [*lines, _STABLE]


def _parts(system: BrakedDriveline | Machine) -> Iterator[str]:
    """Sentences on measures that are the largest of several inertias or contacts."""
    driven = {one.name for one in system.machine.driven}
    moving = [name for name in system.coords.get("inertia", ()) if name not in driven]
    for names, what, measures in (
        (moving, "inertias", "Velocity amplitudes"),
        (system.coords.get("contact", ()), "contacts", "Brake torques and shares of sticking"),
    ):
        if len(names) > 1:
            which = f" ({', '.join(names)})" if len(names) <= _MOST_NAMES else ""
            yield f"  {measures} are the largest of all {what}{which}."


def _vibration(run: dict[str, Any], cycles: bool) -> str:
    """A stable interval and the vibration in it, with its period if it is a limit cycle."""

    def span(ends: list[float]) -> str:
        low, high = (f"{one:.3g}" for one in ends)
        return low if low == high else f"{low} to {high}"

    low, high = run["from"], run["to"]
    digits = next((n for n in (6, 8) if f"{low:.{n}g}" != f"{high:.{n}g}"), 10)
    sticking = [100.0 * one for one in run["stick_share"]]
    return (
        f"{low:.{digits}g} ... {high:.{digits}g}"
        f"  (velocity amplitude {span(run['velocity_amplitude'])} rad/s,"
        + (f" period {span(run['period'])} s," if cycles else "")
        + f" brake torque up to {run['peak_torque'][1]:.4g} N m"
        + (f", sticking {span(sticking)} % of the time)" if sticking[1] > 0.0 else ")")
    )


def _bifurcations(report: dict[str, Any], cycles: bool) -> list[str]:
    found, name = report["bifurcations"], report["parameter"]["name"]
    if not found:
        return ["Bifurcations: none"]
    rows = [["branch", name, "bifurcation", "of the motion", "what changes"]]
    rows += [
        [
            str(one["branch"] + 1), f"{one['value']:.9g}", one["kind"], one["motion"],
            "; ".join(one[what] for what in ("effect", "scenario", "change") if one[what]),
        ]
        for one in found[:_MOST_LINES]
    ]  # fmt: skip
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    period = "" if cycles else " (T: the period of the torque)"
    lines = [f"Bifurcations: {len(found)}, along the branches{period}"]
    lines += [
        "  " + "  ".join(f"{one:{width}}" for one, width in zip(row, widths, strict=True)).rstrip()
        for row in rows
    ]
    if len(found) > _MOST_LINES:
        lines.append(f"  and {len(found) - _MOST_LINES} more; --json lists each")
    return lines


def _boundaries(report: dict[str, Any]) -> list[str]:
    boundaries = report["boundaries"]
    done = [one["bifurcation"] for one in boundaries]
    left = [one["kind"] for one in report["bifurcations"] if one["number"] not in done]
    kinds = ", ".join(kind.value for kind in Kind if kind.value in left)
    without = [f"  {len(left)} not followed: {kinds}"] if left else []
    if not boundaries:
        return ["Boundaries: none; no bifurcation can be followed", *without]
    names = ", ".join(boundaries[0]["values"])
    lines = [f"Boundaries over {names}: {len(boundaries)} (--json has their points)"]
    for one in boundaries:
        motion = report["bifurcations"][one["bifurcation"]]["motion"]
        begin, end = (
            ", ".join(f"{values[place]:.6g}" for values in one["values"].values())
            for place in (0, -1)
        )
        lines.append(
            f"  {one['kind']}, {motion}: from ({names}) = ({begin}) ({one['begin']}) to ({end})"
            f" ({one['end']})"
        )
    return lines + without
