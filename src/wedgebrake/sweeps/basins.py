"""Basins of attraction: motions from many initial states, grouped by their attractors."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wedgebrake.analysis.spectrum import frequencies
from wedgebrake.dynamics.enums import MotionClass
from wedgebrake.errors import InputError
from wedgebrake.model.sweep_settings import INITIAL
from wedgebrake.model.system import BrakedDriveline, check_driveline
from wedgebrake.sweeps.results import PointStatus
from wedgebrake.sweeps.sweep import execute, joined, make_plan, split_options

if TYPE_CHECKING:
    import xarray as xr

FloatArray = NDArray[np.float64]

# Attractors that have no number.
_CODES = {"undecided": -1, "diverged": -2, "self_locked": -3, "not_computed": -4}

# Periodic motions belong to one attractor if their distance is at most this share of their size,
# far above the rest of a transient. If the orbit is longer than the record, they do if exponent
# and power, which are those of a whole orbit, agree to this share.
_SAME = 1e-3
# An aperiodic motion belongs to an attractor if the median distance of its points to those of the
# attractor is at most this multiple of the median distance between its own points.
_CLOUD = 4.0
# Motions whose points represent an aperiodic attractor.
_MEMBERS = 20


def basins(
    system: BrakedDriveline, over: Mapping[str, Any] | None = None, **options: Any
) -> xr.Dataset:
    """Compute the map over initial angle and velocity of the attractor reached.

    Parameters
    ----------
    system : BrakedDriveline
        The system.
    over : mapping
        Swept values by name, instead of keywords.
    **options
        ``initial_angle`` [rad] and ``initial_velocity`` [rad/s] with their values, and
        arguments of ``sweep``; ``transient`` is "auto" by default.

    Returns
    -------
    xarray.Dataset
        As ``sweep``, with ``attractor``, the number of the attractor of each point (-1
        undecided, -2 diverged, -3 self-locked, -4 not computed), and over ``attractor_id``
        its motion, order, share of the points, and Poincare points. A store contains
        the points only: attractors are identified in the returned dataset.

    Raises ``InputError`` as ``sweep``, and unless both initial conditions are swept.
    """
    check_driveline(system)
    parameters, settings, execution = split_options(options)
    parameters = joined(over, parameters)
    if set(parameters) != set(INITIAL):
        raise InputError(
            f"basins: swept {', '.join(parameters) or 'nothing'}, must be initial_angle and"
            " initial_velocity, for example initial_angle=np.linspace(-0.2, 0.2, 100),"
            " initial_velocity=np.linspace(-20, 20, 100). Change the system with replace."
        )
    if not settings.get("keep_points", True):
        raise InputError(
            "keep_points = False: attractors are identified by their Poincare points. Leave it out."
        )
    settings.setdefault("transient", "auto")
    return label(execute(make_plan("basins", system, parameters, **settings), **execution))


def label(dataset: xr.Dataset) -> xr.Dataset:
    """Return the dataset of ``basins`` with its attractors.

    Rest is one attractor, whatever the angle at which the brake holds. Motions of the same class
    and order belong to one attractor if their points coincide; quasi-periodic and chaotic ones if
    their points cover the same set.
    """
    import xarray as xr

    loaded = dataset.load()
    attrs = {str(name): one.attrs for name, one in loaded.data_vars.items()}
    flat = {
        name: loaded[name].to_numpy().ravel()
        for name in ("motion", "order", "status", "size", "largest_exponent", "friction_power")
    }
    motion, order = flat["motion"], flat["order"]
    points = np.stack([loaded["angle"].to_numpy(), loaded["velocity"].to_numpy()], axis=-1)
    points = points.reshape(motion.size, -1, 2)
    numbers = np.full(motion.size, _CODES["undecided"], dtype=np.int32)
    numbers[motion == MotionClass.DIVERGED] = _CODES["diverged"]
    numbers[motion == MotionClass.SELF_LOCKED] = _CODES["self_locked"]
    numbers[flat["status"] == PointStatus.NOT_COMPUTED] = _CODES["not_computed"]
    numbers[motion == MotionClass.NONE] = _CODES["not_computed"]

    of_system = frequencies(loaded)
    natural = 2.0 * math.pi * (of_system["natural_frequency"] or of_system["forcing_frequency"])
    motions = _Motions(
        motion=motion,
        order=order,
        points=points * np.array([natural, 1.0]),
        size=flat["size"],
        orbitwise=np.stack([flat["largest_exponent"], flat["friction_power"]]),
    )
    first = _number_all(numbers, motions)
    # Renumber, the largest basin first.
    counts = np.array([np.count_nonzero(numbers == i) for i in range(len(first))])
    ranking = np.argsort(-counts, kind="stable")
    numbered = numbers >= 0
    numbers[numbered] = np.argsort(ranking)[numbers[numbered]]
    chosen = [first[i] for i in ranking]
    orbits = _orbits(points, order, chosen)
    codes = {
        "units": "1",
        "long_name": "number of the attractor",
        "flag_values": list(_CODES.values()),
        "flag_meanings": " ".join(_CODES),
    }
    share = {"units": "1", "long_name": "share of the points in the basin"}
    orbit_dims = ("attractor_id", "orbit_point")
    return loaded.assign(
        attractor=(loaded["motion"].dims, numbers.reshape(loaded["motion"].shape), codes),
        attractor_motion=("attractor_id", motion[chosen], attrs["motion"]),
        attractor_order=("attractor_id", order[chosen], attrs["order"]),
        attractor_share=("attractor_id", counts[ranking] / motion.size, share),
        attractor_angle=(orbit_dims, orbits[:, :, 0], attrs["angle"]),
        attractor_velocity=(orbit_dims, orbits[:, :, 1], attrs["velocity"]),
    ).assign_coords(
        attractor_id=xr.Variable("attractor_id", np.arange(len(chosen)), {"units": "1"})
    )


class _Motions(NamedTuple):
    """Properties of n motions by which they are compared.

    points    : (n, record, 2) Poincare points, both in rad/s
    size      : (n,) size of the motion [rad/s]
    orbitwise : (k, n) averages over a whole orbit
    """

    motion: NDArray[np.int8]
    order: NDArray[np.int32]
    points: FloatArray
    size: FloatArray
    orbitwise: FloatArray

    def same_orbit(self, seed: int, others: NDArray[np.intp]) -> NDArray[np.bool_]:
        """Return which periodic motions are on the orbit of ``seed``."""
        order = int(self.order[seed])
        alike = self.order[others] == order
        if order <= self.points.shape[1]:
            orbit = self.points[seed, -order:]
            gaps = np.abs(self.points[others, -1][:, None, :] - orbit[None]).max(axis=2)
            return np.asarray(alike & (gaps.min(axis=1) <= _SAME * self.size[seed]))
        own, found = self.orbitwise[:, [seed]], self.orbitwise[:, others]
        return np.asarray(alike & (np.abs(found - own) <= _SAME * np.abs(own)).all(axis=0))

    def same_cloud(self, seed: int, others: NDArray[np.intp]) -> NDArray[np.bool_]:
        """Return which aperiodic motions belong to the attractor of ``seed``."""
        alike = self.motion[others] == self.motion[seed]
        same = others == seed
        cloud = self.points[seed]
        # With more points of the attractor, more motions are recognised.
        while True:
            left = np.flatnonzero(alike & ~same)
            found = [k for k in left if _covers(cloud, self.points[others[k]])]
            if not found:
                return np.asarray(same)
            same[found] = True
            members = others[same][:_MEMBERS]
            cloud = np.concatenate([self.points[i] for i in members])


def _number_all(numbers: NDArray[np.int32], motions: _Motions) -> list[int]:
    """Number the settled motions in place; return the first motion of each attractor."""
    first: list[int] = []
    resting = np.flatnonzero(motions.motion == MotionClass.AT_REST)
    if resting.size:
        numbers[resting] = len(first)
        first.append(int(resting[0]))
    kinds = (
        ((MotionClass.SYNCHRONOUS, MotionClass.PERIODIC), motions.same_orbit),
        ((MotionClass.QUASI_PERIODIC, MotionClass.CHAOTIC), motions.same_cloud),
    )
    for classes, same_as in kinds:
        left = np.flatnonzero(np.isin(motions.motion, classes))
        while left.size:
            seed = int(left[0])
            same = same_as(seed, left)
            same[0] = True
            numbers[left[same]] = len(first)
            first.append(seed)
            left = left[~same]
    return first


def _covers(cloud: FloatArray, other: FloatArray) -> bool:
    """Return whether the Poincare points of a motion lie among those of others."""
    own = np.abs(other[:, None] - other[None]).max(axis=2)
    np.fill_diagonal(own, np.inf)
    spacing = float(np.median(own.min(axis=1)))
    across = np.abs(other[:, None] - cloud[None]).max(axis=2).min(axis=1)
    return bool(np.median(across) <= _CLOUD * spacing)


def _orbits(points: FloatArray, order: NDArray[np.int32], chosen: list[int]) -> FloatArray:
    """Return the Poincare points of each attractor: one orbit, or the record if it is shorter."""
    lengths = [min(int(order[i]) or points.shape[1], points.shape[1]) for i in chosen]
    orbits = np.full((len(chosen), max(lengths, default=1), 2), np.nan)
    for row, (i, length) in enumerate(zip(chosen, lengths, strict=True)):
        orbits[row, :length] = points[i, -length:]
    return orbits
