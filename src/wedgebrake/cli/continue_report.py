"""The data that ``continue --json`` prints: answer, branches, bifurcations, boundaries."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from wedgebrake.cli.continue_command import Order, Outcome
from wedgebrake.cli.writing import header
from wedgebrake.dynamics.enums import MotionClass, motion_word
from wedgebrake.orbits.bifurcation_types import Kind, stability_intervals
from wedgebrake.orbits.diagram import Followed
from wedgebrake.orbits.orbit import BranchPoint

if TYPE_CHECKING:
    import xarray as xr

# The change of a stable motion at the bifurcation where it loses its stability.
_LOSSES = {
    Kind.FOLD: "it meets an unstable motion, and both end (fold)",
    Kind.PERIOD_DOUBLING: "its period doubles",
    Kind.NEIMARK_SACKER: "a second frequency sets in (Neimark-Sacker)",
    Kind.SYMMETRY_BREAKING: "its two halves become different (symmetry breaking)",
    Kind.BRANCH_POINT: "another branch crosses it",
}


def continue_report(
    order: Order, outcome: Outcome, files: dict[str, Path | None]
) -> dict[str, Any]:
    """The data that ``continue --json`` prints.

    files : "picture", "data" -> their paths
    """
    system, over, followed = order.study.system, order.over, outcome.followed
    numbers = _numbers(followed)
    return {
        **header(system),
        "kind": outcome.dataset.attrs["kind"],
        "method": outcome.start.method,
        "parameter": {"name": over.name, "unit": over.unit, "meaning": over.meaning},
        "range": [over.first, over.last],
        "settings": order.settings,
        "answer": answer(over.name, followed),
        "start": outcome.start.as_dict(),
        "branches": [_branch(number, one) for number, one in enumerate(followed)],
        "bifurcations": [
            _bifurcation(numbers[id(point)], branch, point)
            for branch, one in enumerate(followed)
            for point in one.branch.bifurcations
        ],
        "boundaries": outcome.boundaries
        and [_boundary(numbers[id(point)], curve) for point, curve in outcome.boundaries],
        "speed": {
            "points": sum(len(one.branch.points) for one in followed),
            "seconds": outcome.seconds,
            "with_compilation": outcome.compiled,
        },
        "files": {what: path and str(path) for what, path in files.items()},
    }


def _numbers(followed: list[Followed]) -> dict[int, int]:
    """Numbers of the bifurcations, as ``Followed.origin`` counts them, by identity."""
    found = [point for one in followed for point in one.branch.bifurcations]
    return {id(point): number for number, point in enumerate(found)}


def _branch(number: int, one: Followed) -> dict[str, Any]:
    points = one.branch.points
    return {
        "number": number,
        "order": points[-1].order,
        "motion": word(points[-1].order),
        "points": len(points),
        "origin": one.origin if one.origin >= 0 else None,
        "begin": {"value": points[0].value, "why": one.begin},
        "end": {"value": points[-1].value, "why": one.branch.end},
        "stable": [_interval(points[first : last + 1]) for first, last in stable_stretches(one)],
    }


def _interval(points: list[BranchPoint]) -> dict[str, Any]:
    """A stable interval of a branch, with the range of each measure: [least, greatest]."""
    found: dict[str, Any] = {"from": points[0].value, "to": points[-1].value}
    for name in ("velocity_amplitude", "stick_share", "peak_torque"):
        values = [getattr(point.measures, name) for point in points]
        found[name] = [min(values), max(values)]
    return found


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
        "motion": word(point.order),
        "multipliers": [[one.real, one.imag] for one in point.multipliers],
        "sentence": found.sentence,
    }


def _boundary(number: int, curve: xr.Dataset) -> dict[str, Any]:
    return {
        "bifurcation": number,
        "kind": curve.attrs["bifurcation"],
        "begin": curve.attrs["begin"],
        "end": curve.attrs["end"],
        "points": int(curve.sizes["point"]),
        "values": {name: curve[name].to_numpy() for name in curve.attrs["parameters"]},
    }


def word(order: int) -> str:
    """A periodic motion in words: "synchronous", "2T-periodic"."""
    return motion_word(MotionClass.SYNCHRONOUS if order == 1 else MotionClass.PERIODIC, order)


def stable_stretches(one: Followed) -> list[tuple[int, int]]:
    """(first, last) places of points between which a branch is stable, in its order."""
    points = one.branch.points
    marginal = np.array([point.bifurcation is not None for point in points])
    marginal[0] |= one.origin >= 0
    marginal[-1] |= one.branch.met
    stable = np.array([point.stable for point in points])
    return [(first, last) for first, last, holds in stability_intervals(stable, marginal) if holds]


def answer(name: str, followed: list[Followed]) -> str:
    """How far the first motion is stable, and what replaces it."""
    first = followed[0]
    points, stretches = first.branch.points, stable_stretches(first)
    motion, begin = word(points[0].order), f"{name} = {points[0].value:.6g}"
    if not stretches:
        return f"From {begin} on, the {motion} motion is unstable{_to_end(name, first)}."
    if stretches[0][0] > 0:
        ranges = " and ".join(
            f"from {name} = {points[low].value:.6g} to {points[high].value:.6g}"
            for low, high in stretches
        )
        return f"At {begin} the {motion} motion is unstable; on its branch it is stable {ranges}."
    last = stretches[0][1]
    if last == len(points) - 1:
        return f"From {begin} on, the {motion} motion is stable{_to_end(name, first)}."
    lost = points[last]
    text = f"From {begin} on, the {motion} motion is stable {_up_to(name, first, (0, last))}."
    return text + _successor(name, lost, followed)


def _to_end(name: str, one: Followed) -> str:
    """The last value of a branch, and the reason if that is not the end of the range."""
    last = one.branch.points[-1].value
    why = without_value(one.branch.end, name, last)
    ended = "" if why == "left the range" else f", where it ends: {why}"
    return f" to {name} = {last:.6g}{ended}"


def without_value(why: str, name: str, value: float) -> str:
    """The reason why a branch ends, without the value of the parameter."""
    return why.removesuffix(f" at {name} = {value:g}")


def _up_to(name: str, one: Followed, stretch: tuple[int, int]) -> str:
    """The end of a stable interval, and what happens there."""
    begin, end = (one.branch.points[place] for place in stretch)
    way = "up" if end.value > begin.value else "down"
    return f"{way} to {name} = {end.value:.6g}; there {_loss_of_stability(end)}"


def _loss_of_stability(point: BranchPoint) -> str:
    found = point.bifurcation
    if found is None:
        return "it loses its stability"
    if not found.kind.of_friction:
        return _LOSSES[found.kind]
    effect = f": {found.effect}" if found.effect else ""
    return f"a bifurcation of friction ends its stability ({found.kind.value}{effect})"


def _successor(name: str, lost: BranchPoint, followed: list[Followed]) -> str:
    """The stability of the motion that branches off where stability is lost."""
    number = _numbers(followed).get(id(lost), -1)
    for one in followed[1:]:
        if one.origin != number:
            continue
        points, stretches = one.branch.points, stable_stretches(one)
        text = f" The {word(points[-1].order)} motion that branches off is "
        if not stretches or stretches[0][0] > 0:
            return f"{text}unstable at first: the system jumps to another motion."
        if stretches[0][1] == len(points) - 1:
            return f"{text}stable{_to_end(name, one)}."
        return f"{text}stable {_up_to(name, one, stretches[0])}."
    return ""
