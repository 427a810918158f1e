"""Attractors of many runs, told apart a few runs at a time.

``wb.basins`` compares all motions with each other when all are known; here the motions that
come are compared with a few of each attractor that is known.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wedgebrake.dynamics.enums import MotionClass
from wedgebrake.sweeps.attractors import label

if TYPE_CHECKING:
    import xarray as xr

Codes = NDArray[np.int64]

# Results that tell attractors apart.
_COMPARED = (
    "motion", "order", "status", "size", "largest_exponent", "friction_power", "angle", "velocity"
)  # fmt: skip
# Of a motion that repeats itself one run tells all; of others the ground is known from several.
_GROUND = 6


class Attractors:
    """The attractors that are known, by numbers from 0.

    attributes : those of a sweep's dataset
    """

    def __init__(self, attributes: dict[str, Any]) -> None:
        self._attributes = attributes
        self._known: list[dict[str, Any]] = []
        self._owners: list[int] = []
        self._count = 0

    def add(self, runs: dict[str, NDArray[Any]]) -> tuple[Codes, dict[int, int]]:
        """The attractors of some runs, (n,), and which known ones turned out to be another.

        runs : results of a sweep at n points, (n,) or (n, recorded)

        Numbers below 0 are those of ``wb.basins``: undecided, diverged, self-locked, not
        computed.
        """
        given = {name: runs[name] for name in _COMPARED}
        rows = [*self._known, *_rows(given)]
        labelled = label(self._dataset(rows))
        found = labelled["attractor"].to_numpy().astype(np.int64)
        numbers, merged = self._numbers(found)
        aperiodic = np.isin(given["motion"], (MotionClass.QUASI_PERIODIC, MotionClass.CHAOTIC))
        new = numbers[len(self._owners) :]
        for row, number, wide in zip(_rows(given), new, aperiodic, strict=True):
            if number >= 0 and self._owners.count(number) < (_GROUND if wide else 1):
                self._known.append(row)
                self._owners.append(int(number))
        return new, merged

    def orbit(self, number: int) -> tuple[int, int, NDArray[np.float64]]:
        """Class and order of an attractor, and its Poincare points (points, 2)."""
        row = self._known[self._owners.index(number)]
        order = int(row["order"]) or row["angle"].size
        points = np.stack([row["angle"], row["velocity"]], axis=1)
        return int(row["motion"]), int(row["order"]), points[-min(order, len(points)) :]

    def _numbers(self, found: Codes) -> tuple[Codes, dict[int, int]]:
        """Numbers of this call as those that hold from call to call."""
        names: dict[int, int] = {}
        merged: dict[int, int] = {}
        # The owners in rising order, so that what is merged goes to the lower number.
        for place in np.argsort(self._owners, kind="stable"):
            one, owner = int(found[place]), self._owners[place]
            if one >= 0 and names.setdefault(one, owner) != owner:
                merged.setdefault(owner, names[one])
        for first in sorted(merged):  # the lower number stays, also along a chain
            merged[first] = merged.get(merged[first], merged[first])
        names = {one: merged.get(owner, owner) for one, owner in names.items()}
        self._owners = [merged.get(owner, owner) for owner in self._owners]
        for one in np.unique(found[found >= 0]):
            if int(one) not in names:
                names[int(one)] = self._count
                self._count += 1
        return np.array([names.get(int(one), int(one)) for one in found], dtype=np.int64), merged

    def _dataset(self, rows: list[dict[str, Any]]) -> xr.Dataset:
        import xarray as xr

        arrays = {name: np.stack([row[name] for row in rows]) for name in _COMPARED}
        return xr.Dataset(
            {
                name: (("run", "period") if one.ndim == 2 else ("run",), one)
                for name, one in arrays.items()
            },
            attrs=self._attributes,
        )


def _rows(runs: dict[str, NDArray[Any]]) -> list[dict[str, Any]]:
    names = list(runs)
    return [dict(zip(names, one, strict=True)) for one in zip(*runs.values(), strict=True)]
