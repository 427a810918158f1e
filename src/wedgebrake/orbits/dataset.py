"""Branches as a dataset."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wedgebrake._version import __version__
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.orbits.branch import Branch
from wedgebrake.orbits.branch_point import BranchPoint
from wedgebrake.orbits.problem import Range

if TYPE_CHECKING:
    import xarray as xr

# Measures of a point, with unit and meaning.
_MEASURES = {
    "velocity_amplitude": ("rad/s", "half the range of the velocity"),
    "angle_amplitude": ("rad", "half the range of the angle"),
    "stick_share": ("1", "share of time at rest relative to the brake"),
    "sticks_forward": ("1", "sticks entered from v > 0 in a period of the torque"),
    "sticks_backward": ("1", "sticks entered from v < 0 in a period of the torque"),
    "events": ("1", "events in a period of the torque"),
    "peak_torque": ("N m", "largest |R F_mu|"),
}


@dataclass(frozen=True)
class Followed:
    """A branch of a bifurcation diagram.

    origin : number, among all bifurcations in their order, of the one it leaves; -1: none
    begin  : why it begins where it does
    """

    branch: Branch
    origin: int
    begin: str


def assemble(system: BrakedDriveline, over: Range, followed: list[Followed]) -> xr.Dataset:
    """One dataset of all branches, see ``branches``."""
    import xarray as xr

    points = [point for one in followed for point in one.branch.points]
    numbers = np.repeat(np.arange(len(followed)), [len(one.branch.points) for one in followed])
    numbers = numbers.astype(np.int32)
    return xr.Dataset(
        {**_of_points(points), **_of_branches(followed), **_of_bifurcations(points, numbers, over)},
        coords={
            over.dim: ("point", [point.value for point in points], over.attributes()),
            "branch": ("point", numbers, {"long_name": "number of the branch, from 0"}),
        },
        attrs={
            "kind": "orbits",
            "parameter": over.dim,
            "range": [over.first, over.last],
            **provenance(system, points[0].problem.method),
        },
    )


def provenance(system: BrakedDriveline, method: str) -> dict[str, str]:
    """Attributes that tell how orbits were computed."""
    return {
        "method": method,
        "system": json.dumps(system.as_dict()),
        "groups": json.dumps(system.groups.as_dict()),
        "wedgebrake": __version__,
    }


def multiplier_columns(points: list[BranchPoint]) -> dict[str, Any]:
    """Real and imaginary parts of the multipliers."""
    values = np.array([point.multipliers for point in points])
    words = {"units": "1", "long_name": "Floquet multipliers, the larger modulus first"}
    dims = ("point", "multiplier")
    return {
        "multiplier_real": (dims, values.real, words),
        "multiplier_imag": (dims, values.imag, words),
    }


def _of_points(points: list[BranchPoint]) -> dict[str, Any]:
    section = np.full((len(points), max(point.order for point in points), 2), np.nan)
    for row, point in zip(section, points, strict=True):
        row[: point.order] = point.points
    moduli = np.array([abs(point.multipliers[0]) for point in points])
    durations = np.array([point.section.duration(point.order) for point in points])
    with np.errstate(divide="ignore"):
        exponents = np.log(moduli) / durations
    columns: dict[str, tuple[Any, str, str]] = {
        "order": (
            np.array([point.order for point in points], dtype=np.int16),
            "1", "periods of the torque in the orbit",
        ),
        "arclength": (
            np.array([point.arclength for point in points]),
            "1", "length along the branch, in the scales of its unknowns",
        ),
        "largest_exponent": (exponents, "1/s", "largest Lyapunov exponent"),
    } | {
        name: (np.array([getattr(point.measures, name) for point in points]), unit, meaning)
        for name, (unit, meaning) in _MEASURES.items()
    }  # fmt: skip
    words = "segments in order: + forwards, - backwards, 0 rest, +1 the next piece of the law"
    returns, where = ("point", "return"), "at t = 0, T, 2 T, ..."
    return {
        "angle": (
            returns, section[:, :, 0], {"units": "rad", "long_name": f"angle {where}"},
        ),
        "velocity": (
            returns, section[:, :, 1], {"units": "rad/s", "long_name": f"velocity {where}"},
        ),
        "stable": (
            "point", np.array([point.stable for point in points]),
            {"long_name": "whether small deviations, that keep a rest, die out"},
        ),
        "sequence": (
            "point", np.array([point.sequence for point in points], dtype=object),
            {"long_name": words},
        ),
        **multiplier_columns(points),
        **{
            name: ("point", values, {"units": unit, "long_name": meaning})
            for name, (values, unit, meaning) in columns.items()
        },
    }  # fmt: skip


def _of_branches(followed: list[Followed]) -> dict[str, Any]:
    columns: dict[str, tuple[list[Any], Any]] = {
        "branch_order": ([one.branch.points[-1].order for one in followed], np.int16),
        "branch_origin": ([one.origin for one in followed], np.int32),
        "branch_begin": ([one.begin for one in followed], object),
        "branch_end": ([one.branch.end for one in followed], object),
    }
    return {
        name: ("branch_number", np.array(values, dtype=kind))
        for name, (values, kind) in columns.items()
    }


def _of_bifurcations(
    points: list[BranchPoint], numbers: NDArray[np.signedinteger[Any]], over: Range
) -> dict[str, Any]:
    places = [place for place, point in enumerate(points) if point.bifurcation is not None]
    found = [point.bifurcation for point in points if point.bifurcation is not None]
    words = {
        "kind": [one.kind.value for one in found],
        "effect": [one.effect for one in found],
        "scenario": [one.scenario.value for one in found],
        "sentence": [one.sentence for one in found],
    }
    values = np.array([points[place].value for place in places])
    return {
        **{
            f"bifurcation_{name}": ("bifurcation", np.array(texts, dtype=object))
            for name, texts in words.items()
        },
        "bifurcation_value": ("bifurcation", values, over.attributes()),
        "bifurcation_point": ("bifurcation", np.array(places, dtype=np.int64)),
        "bifurcation_branch": ("bifurcation", numbers[places]),
    }
