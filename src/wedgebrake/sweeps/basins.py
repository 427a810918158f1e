"""Basins of attraction: motions from many initial states, grouped by their attractors."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wedgebrake.analysis.machine_motion.coordinates import coordinates
from wedgebrake.analysis.responses.spectrum import frequencies
from wedgebrake.analysis.run_settings import LIMIT
from wedgebrake.arrays import FloatArray
from wedgebrake.dynamics.enums import MotionClass
from wedgebrake.errors import InputError
from wedgebrake.model.machine import Machine
from wedgebrake.model.studies.machine_study import bodies_of
from wedgebrake.model.studies.sweep_settings import joined
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.model.validation import check_instance
from wedgebrake.sweeps.plan import CROSSING, PERIOD
from wedgebrake.sweeps.results import NO_ATTRACTOR, PointStatus
from wedgebrake.sweeps.sweep import execute, make_plan, split_options

if TYPE_CHECKING:
    import xarray as xr

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
    system: BrakedDriveline | Machine, over: Mapping[str, Any] | None = None, **options: Any
) -> xr.Dataset:
    """Compute the attractor reached from each point of a grid of two initial conditions.

    Parameters
    ----------
    system : BrakedDriveline or Machine
        The system to simulate.
    over : mapping
        Swept values by name, instead of keywords.
    **options
        ``initial_angle`` [rad] and ``initial_velocity`` [rad/s] with their values; for a machine,
        two of the initial angles and speeds of its inertias, such as "disc.angle". Also arguments
        of ``sweep``; ``limit`` is 20 000 by default.

    Returns
    -------
    xarray.Dataset
        As ``sweep``, with ``attractor``, the number of the attractor of each point (-1
        undecided, -2 diverged, -3 self-locked, -4 not computed, -5 free vibration, -6 steady
        rotation, which attract no other motion), and, over ``attractor_id``, the class and order
        of each attractor, its share of the points and its Poincare points. A store contains the
        points only; attractors are identified in the returned dataset.

    Raises ``InputError`` as ``sweep``, and unless both initial conditions are swept.
    """
    parameters, settings, execution = split_options(options)
    parameters = joined(over, parameters)
    check_instance("system", system, BrakedDriveline | Machine, "a BrakedDriveline or a Machine")
    allowed = set(system.initial_conditions)
    if len(parameters) != 2 or not set(parameters) <= allowed:
        first, second = sorted(allowed)[:2]
        raise InputError(
            f"basins: swept {', '.join(parameters) or 'nothing'}, must be two initial conditions,"
            f' for example {{"{first}": np.linspace(-0.2, 0.2, 100), "{second}":'
            " np.linspace(-20, 20, 100)}. Change the system with replace.",
            name="over", value=tuple(parameters), allowed=tuple(sorted(allowed)),
        )  # fmt: skip
    if not settings.get("keep_points", True):
        raise InputError.of(
            "keep_points", False, "attractors are identified by their Poincare points. Leave it"
            " out.", allowed="left out",
        )  # fmt: skip
    settings.setdefault("limit", LIMIT)
    return label(execute(make_plan("basins", system, parameters, **settings), **execution))


def label(dataset: xr.Dataset) -> xr.Dataset:
    """Return the dataset of ``basins`` with attractors identified.

    Rest is a single attractor, regardless of the angle at which the brake holds. Motions of the
    same class and order belong to one attractor if their points coincide; quasi-periodic and
    chaotic motions if their points cover the same set.
    """
    import xarray as xr

    loaded = dataset.load()
    attrs = {str(name): one.attrs for name, one in loaded.data_vars.items()}
    flat = {name: loaded[name].to_numpy().ravel() for name in ("motion", "order", "status", "size")}
    motion, order, size = flat["motion"], flat["order"], flat["size"]
    states = [loaded[name].to_numpy() for name in ("angle", "velocity")]
    # Of a machine also over its inertias.
    record = loaded.sizes[_returns(loaded)]
    angle, velocity = (one.reshape(motion.size, record, -1) for one in states)
    numbers = np.full(motion.size, NO_ATTRACTOR["undecided"], dtype=np.int32)
    for one in MotionClass:
        numbers[motion == one] = NO_ATTRACTOR.get(one.name.lower(), NO_ATTRACTOR["undecided"])
    numbers[flat["status"] == PointStatus.NOT_COMPUTED] = NO_ATTRACTOR["not_computed"]
    numbers[motion == MotionClass.NONE] = NO_ATTRACTOR["not_computed"]

    motions = _Motions(
        motion=motion,
        order=order,
        points=_as_speeds(loaded, angle, velocity),
        size=size,
        orbitwise=_averages(loaded),
    )
    first = _number_all(numbers, motions)
    # Renumber, the largest basin first.
    counts = np.array([np.count_nonzero(numbers == i) for i in range(len(first))])
    ranking = np.argsort(-counts, kind="stable")
    numbered = numbers >= 0
    numbers[numbered] = np.argsort(ranking)[numbers[numbered]]
    chosen = [first[i] for i in ranking]
    orbits = [_orbits(one, order, chosen) for one in (angle, velocity)]
    if "inertia" not in loaded["angle"].dims:
        orbits = [one[:, :, 0] for one in orbits]
    codes = {
        "units": "1",
        "long_name": "number of the attractor",
        "flag_values": list(NO_ATTRACTOR.values()),
        "flag_meanings": " ".join(NO_ATTRACTOR),
    }
    share = {"units": "1", "long_name": "share of the points in the basin"}
    orbit_dims = ("attractor_id", "orbit_point", "inertia")[: orbits[0].ndim]
    return loaded.assign(
        attractor=(loaded["motion"].dims, numbers.reshape(loaded["motion"].shape), codes),
        attractor_kind=("attractor_id", motion[chosen], attrs["motion"]),
        attractor_order=("attractor_id", order[chosen], attrs["order"]),
        attractor_share=("attractor_id", counts[ranking] / motion.size, share),
        attractor_angle=(orbit_dims, orbits[0], attrs["angle"]),
        attractor_velocity=(orbit_dims, orbits[1], attrs["velocity"]),
    ).assign_coords(
        attractor_id=xr.Variable("attractor_id", np.arange(len(chosen)), {"units": "1"})
    )


def _returns(dataset: xr.Dataset) -> str:
    """Return the name of the dimension of the recorded returns."""
    return CROSSING if CROSSING in dataset.dims else PERIOD


def _as_speeds(dataset: xr.Dataset, angle: FloatArray, velocity: FloatArray) -> FloatArray:
    """Return states, (..., inertias) each, in coordinates that are speeds [rad/s].

    The angles of free rotations, on which no motion depends, are left out.
    """
    states = np.concatenate([angle, velocity], axis=-1)
    if "inertia" in dataset.dims:
        bodies = bodies_of(json.loads(dataset.attrs["system"]))
        return states @ coordinates(bodies).to.T
    of_system = frequencies(dataset)
    states[..., 0] *= (
        2.0 * math.pi * (of_system["natural_frequency"] or of_system["forcing_frequency"])
    )
    return states


def _averages(dataset: xr.Dataset) -> FloatArray:
    """Return averages over a whole orbit, (k, n), which compare orbits without their points.

    The points of self-excited motions may differ because their sections differ.
    """
    power = dataset["friction_power"]
    power = power.sum("contact") if "contact" in power.dims else power
    if _returns(dataset) == CROSSING:
        found = [power, dataset["size"], dataset["motion_period"].fillna(0.0)]
    elif "exponents" in dataset:
        found = [power, dataset["exponents"][..., 0]]
    else:
        found = [power, dataset["largest_exponent"]]
    return np.stack([one.to_numpy().ravel() for one in found])


class _Motions(NamedTuple):
    """Properties of n motions that are used to compare them.

    points    : (n, record, k) Poincare points, as speeds [rad/s]
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
        return np.asarray(alike & self.same_averages(seed, others))

    def same_averages(self, seed: int, others: NDArray[np.intp]) -> NDArray[np.bool_]:
        """Return which motions have the averages of ``seed``."""
        own, found = self.orbitwise[:, [seed]], self.orbitwise[:, others]
        alike = self.motion[others] == self.motion[seed]
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
    # How motions of some classes are identified as one attractor: all of them, if their Poincare
    # points coincide or cover the same set, or if their ranges and averages coincide.
    compared = (
        ((MotionClass.AT_REST,), lambda _, left: np.ones(left.size, bool)),
        ((MotionClass.SYNCHRONOUS, MotionClass.PERIODIC), motions.same_orbit),
        ((MotionClass.QUASI_PERIODIC, MotionClass.CHAOTIC), motions.same_cloud),
        ((MotionClass.STEADY_SLIDING, MotionClass.LIMIT_CYCLE), motions.same_averages),
    )
    for classes, same_as in compared:
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
    orbits = np.full((len(chosen), max(lengths, default=1), points.shape[2]), np.nan)
    for row, (i, length) in enumerate(zip(chosen, lengths, strict=True)):
        orbits[row, :length] = points[i, -length:]
    return orbits
