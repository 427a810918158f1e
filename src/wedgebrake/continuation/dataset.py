"""Branches as a dataset."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np

from wedgebrake._version import __version__
from wedgebrake.continuation.ranges import Range
from wedgebrake.model.system import BrakedDriveline

if TYPE_CHECKING:
    import xarray as xr

    from wedgebrake.continuation.diagram import Followed
    from wedgebrake.continuation.point import BranchPoint

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


def assemble(system: BrakedDriveline, over: Range, followed: list[Followed]) -> xr.Dataset:
    """One dataset of all branches, see ``branches``."""
    import xarray as xr

    points = [point for one in followed for point in one.branch.points]
    numbers = np.repeat(np.arange(len(followed)), [len(one.branch.points) for one in followed])
    coordinates = {
        over.dim: ("point", [point.value for point in points], over.attributes()),
        "branch": (
            "point",
            numbers.astype(np.int32),
            {"long_name": "number of the branch, from 0"},
        ),
    }
    method = points[0].family.method
    return xr.Dataset(
        {**_of_points(points), **_of_branches(followed), **_of_bifurcations(points, numbers, over)},
        coords=coordinates,
        attrs={
            "kind": "orbits",
            "parameter": over.dim,
            "range": [over.first, over.last],
            "method": method,
            "system": json.dumps(system.as_dict()),
            "groups": json.dumps(system.groups.as_dict()),
            "wedgebrake": __version__,
        },
    )


def multiplier_columns(points: list[BranchPoint]) -> dict[str, Any]:
    """The multipliers in their parts."""
    values = np.array([point.multipliers for point in points])
    words = {"units": "1", "long_name": "Floquet multipliers, the larger modulus first"}
    dims = ("point", "multiplier")
    return {
        "multiplier_real": (dims, values.real, words),
        "multiplier_imag": (dims, values.imag, words),
    }


def _of_points(points: list[BranchPoint]) -> dict[str, Any]:
    longest = max(point.order for point in points)
    section = np.full((len(points), longest, 2), np.nan)
    for row, point in zip(section, points, strict=True):
        row[: point.order] = point.points
    sizes = np.array([abs(point.multipliers[0]) for point in points])
    lengths = np.array([point.order / point.system.excitation.frequency for point in points])
    with np.errstate(divide="ignore"):
        exponents = np.log(sizes) / lengths
    dims = ("point", "return")
    where = "at t = 0, T, 2 T, ..."
    return {
        "angle": (dims, section[:, :, 0], {"units": "rad", "long_name": f"angle {where}"}),
        "velocity": (dims, section[:, :, 1], {"units": "rad/s", "long_name": f"velocity {where}"}),
        "order": (
            "point", np.array([point.order for point in points], dtype=np.int16),
            {"units": "1", "long_name": "periods of the torque in the orbit"},
        ),
        "stable": (
            "point", np.array([point.stable for point in points]),
            {"long_name": "whether small deviations, that keep a rest, die out"},
        ),
        "sequence": (
            "point", np.array([point.sequence for point in points], dtype=object),
            {"long_name": "pieces in order: + forwards, - backwards, 0 rest, +1 the next piece"},
        ),
        "arclength": (
            "point", np.array([point.arclength for point in points]),
            {"units": "1", "long_name": "length along the branch, in the scales of its unknowns"},
        ),
        **multiplier_columns(points),
        "largest_exponent": (
            "point", exponents, {"units": "1/s", "long_name": "largest Lyapunov exponent"},
        ),
        **{
            name: (
                "point",
                np.array([getattr(point.measures, name) for point in points]),
                {"units": unit, "long_name": meaning},
            )
            for name, (unit, meaning) in _MEASURES.items()
        },
    }  # fmt: skip


def _of_branches(followed: list[Followed]) -> dict[str, Any]:
    return {
        "branch_order": (
            "branch_number",
            np.array([one.branch.points[-1].order for one in followed], dtype=np.int16),
        ),
        "branch_origin": (
            "branch_number", np.array([one.origin for one in followed], dtype=np.int32),
        ),
        "branch_begin": ("branch_number", np.array([one.begin for one in followed], dtype=object)),
        "branch_end": (
            "branch_number", np.array([one.branch.end for one in followed], dtype=object),
        ),
    }  # fmt: skip


def _of_bifurcations(points: list[BranchPoint], numbers: np.ndarray, over: Range) -> dict[str, Any]:
    places = [place for place, point in enumerate(points) if point.bifurcation is not None]
    found = [point.bifurcation for point in points if point.bifurcation is not None]
    words = {
        "kind": [one.kind.value for one in found],
        "effect": [one.effect for one in found],
        "scenario": [one.scenario.value for one in found],
        "sentence": [one.sentence for one in found],
    }
    return {
        **{
            f"bifurcation_{name}": ("bifurcation", np.array(values, dtype=object))
            for name, values in words.items()
        },
        "bifurcation_value": (
            "bifurcation",
            np.array([points[place].value for place in places]),
            over.attributes(),
        ),
        "bifurcation_point": ("bifurcation", np.array(places, dtype=np.int64)),
        "bifurcation_branch": ("bifurcation", numbers[places].astype(np.int32)),
    }
