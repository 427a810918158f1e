"""Attractors told apart by the Poincare points that the motions settle to."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wedgebrake.analysis.spectrum import frequencies
from wedgebrake.dynamics.enums import MotionClass
from wedgebrake.sweeps.results import PointStatus

if TYPE_CHECKING:
    import xarray as xr

FloatArray = NDArray[np.float64]

UNDECIDED, DIVERGED, SELF_LOCKED, NOT_COMPUTED = -1, -2, -3, -4

# Two periodic motions are one attractor if they come within this share of their size: far
# above what is left of a transient. Where the record is shorter than the orbit, they are if
# exponent and power, which are those of a whole orbit, are equal to this.
_SAME = 1e-3
# A motion belongs to an aperiodic attractor if its typical point lies as near to those known
# of it as to the next of its own, times this.
_CLOUD = 4.0
# Motions of an attractor whose points are its ground.
_MEMBERS = 20


def label(dataset: xr.Dataset) -> xr.Dataset:
    """The dataset of ``basins`` with its attractors.

    Rest is one attractor, whatever the angle that the brake holds. Motions of the same class
    and order whose points coincide are one; of quasi-periodic and chaotic ones, those whose
    points cover the same ground.
    """
    import xarray as xr

    loaded = dataset.load()
    shape = loaded["motion"].shape
    motion = loaded["motion"].to_numpy().ravel()
    order = loaded["order"].to_numpy().ravel()
    points = np.stack([loaded["angle"].to_numpy(), loaded["velocity"].to_numpy()], axis=-1)
    points = points.reshape(motion.size, -1, 2)
    numbers = np.full(motion.size, UNDECIDED, dtype=np.int32)
    numbers[motion == MotionClass.DIVERGED] = DIVERGED
    numbers[motion == MotionClass.SELF_LOCKED] = SELF_LOCKED
    numbers[loaded["status"].to_numpy().ravel() == PointStatus.NOT_COMPUTED] = NOT_COMPUTED
    numbers[motion == MotionClass.NONE] = NOT_COMPUTED

    of_system = frequencies(loaded)
    natural = 2.0 * math.pi * (of_system["natural_frequency"] or of_system["forcing_frequency"])
    orbitwise = np.stack(
        [loaded[name].to_numpy().ravel() for name in ("largest_exponent", "friction_power")]
    )
    motions = _Motions(
        motion, order, points * np.array([natural, 1.0]), loaded["size"].to_numpy().ravel(),
        orbitwise,
    )  # fmt: skip
    first = _number_all(numbers, motions)
    # The largest basin first.
    counts = np.array([np.count_nonzero(numbers == i) for i in range(len(first))])
    ranking = np.argsort(-counts, kind="stable")
    rank = np.empty_like(ranking)
    rank[ranking] = np.arange(ranking.size)
    known = numbers >= 0
    numbers[known] = rank[numbers[known]]
    chosen = [first[i] for i in ranking]
    orbits = _orbits(points, order, chosen)
    return loaded.assign(
        {
            "attractor": (
                loaded["motion"].dims,
                numbers.reshape(shape),
                {
                    "units": "1",
                    "long_name": "number of the attractor",
                    "flag_values": [UNDECIDED, DIVERGED, SELF_LOCKED, NOT_COMPUTED],
                    "flag_meanings": "undecided diverged self_locked not_computed",
                },
            ),
            "attractor_motion": ("attractor_id", motion[chosen], loaded["motion"].attrs),
            "attractor_order": ("attractor_id", order[chosen], loaded["order"].attrs),
            "attractor_share": (
                "attractor_id",
                counts[ranking] / motion.size,
                {"units": "1", "long_name": "share of the points in the basin"},
            ),
            "attractor_angle": (
                ("attractor_id", "orbit_point"),
                orbits[:, :, 0],
                loaded["angle"].attrs,
            ),
            "attractor_velocity": (
                ("attractor_id", "orbit_point"),
                orbits[:, :, 1],
                loaded["velocity"].attrs,
            ),
        }
    ).assign_coords(
        attractor_id=xr.Variable("attractor_id", np.arange(len(chosen)), {"units": "1"})
    )


class _Motions(NamedTuple):
    """What is compared, for each of n points.

    points    : (n, record, 2) Poincare points, both in rad/s
    size      : (n,) of the motion [rad/s]
    orbitwise : (k, n) numbers of a whole orbit
    """

    motion: NDArray[np.int8]
    order: NDArray[np.int32]
    points: FloatArray
    size: FloatArray
    orbitwise: FloatArray

    def same_orbit(self, seed: int, others: NDArray[np.intp]) -> NDArray[np.bool_]:
        """Which periodic motions are on the orbit of ``seed``."""
        order = int(self.order[seed])
        alike = self.order[others] == order
        if order <= self.points.shape[1]:
            orbit = self.points[seed, -order:]
            gaps = np.abs(self.points[others, -1][:, None, :] - orbit[None]).max(axis=2)
            return np.asarray(alike & (gaps.min(axis=1) <= _SAME * self.size[seed]))
        own, found = self.orbitwise[:, [seed]], self.orbitwise[:, others]
        return np.asarray(alike & (np.abs(found - own) <= _SAME * np.abs(own)).all(axis=0))

    def same_cloud(self, seed: int, others: NDArray[np.intp]) -> NDArray[np.bool_]:
        """Which aperiodic motions cover the ground of ``seed``."""
        alike = self.motion[others] == self.motion[seed]
        same = others == seed
        ground = self.points[seed]
        # The more of an attractor is known, the more of its motions are recognised.
        while True:
            left = np.flatnonzero(alike & ~same)
            found = [k for k in left if _covers(ground, self.points[others[k]])]
            if not found:
                return np.asarray(same)
            same[found] = True
            members = others[same][:_MEMBERS]
            ground = np.concatenate([self.points[i] for i in members])


def _number_all(numbers: NDArray[np.int32], motions: _Motions) -> list[int]:
    """Number the settled points in place; the first point of each attractor."""
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


def _covers(ground: FloatArray, other: FloatArray) -> bool:
    """Whether the Poincare points of a motion lie on the ground of others."""
    own = np.abs(other[:, None] - other[None]).max(axis=2)
    np.fill_diagonal(own, np.inf)
    spacing = float(np.median(own.min(axis=1)))
    across = np.abs(other[:, None] - ground[None]).max(axis=2).min(axis=1)
    return bool(np.median(across) <= _CLOUD * spacing)


def _orbits(points: FloatArray, order: NDArray[np.int32], chosen: list[int]) -> FloatArray:
    """Poincare points of each attractor: one orbit, or the record where that is not as long."""
    lengths = [min(int(order[i]) or points.shape[1], points.shape[1]) for i in chosen]
    orbits = np.full((len(chosen), max(lengths, default=1), 2), np.nan)
    for row, (i, length) in enumerate(zip(chosen, lengths, strict=True)):
        orbits[row, :length] = points[i, -length:]
    return orbits
