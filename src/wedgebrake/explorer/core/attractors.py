"""Attractors of many runs, identified a few runs at a time.

``wb.basins`` compares all motions with each other once all are computed; here new motions are
compared with a few motions of each known attractor.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wedgebrake.dynamics.enums import Comparison, MotionClass
from wedgebrake.figures.data.basins import Attractor
from wedgebrake.sweeps.basins import label

if TYPE_CHECKING:
    import xarray as xr

Codes = NDArray[np.int64]

# Results by which attractors are compared.
_COMPARED = (
    "motion", "order", "status", "size", "largest_exponent", "friction_power", "angle", "velocity"
)  # fmt: skip
# Classes of aperiodic motions.
_CLOUDS = [one for one in MotionClass if one.about.comparison == Comparison.CLOUD]
# Runs kept of an aperiodic attractor; of a periodic one a single run is enough.
_KEPT = 6


class AttractorSet:
    """Known attractors, numbered from 0.

    attributes : attributes of a sweep's dataset
    """

    def __init__(self, attributes: dict[str, Any]) -> None:
        self._attributes = attributes
        self._known: list[dict[str, Any]] = []
        self._owners: list[int] = []
        self._count = 0

    def add(self, runs: dict[str, NDArray[Any]]) -> tuple[Codes, dict[int, int]]:
        """Number the attractors of some runs, (n,); also return known numbers merged into others.

        runs : results of a sweep at n points, (n,) or (n, recorded)

        Numbers below 0 are those of ``wb.basins``: undecided, diverged, self-locked, not
        computed.
        """
        given = {name: runs[name] for name in _COMPARED}
        rows = [*self._known, *_rows(given)]
        labelled = label(self._dataset(rows))
        found = labelled["attractor"].to_numpy().astype(np.int64)
        numbers, merged = self._numbers(found)
        aperiodic = np.isin(given["motion"], _CLOUDS)
        new = numbers[len(self._owners) :]
        for row, number, wide in zip(_rows(given), new, aperiodic, strict=True):
            if number >= 0 and self._owners.count(number) < (_KEPT if wide else 1):
                self._known.append(row)
                self._owners.append(int(number))
        return new, merged

    def found(self, numbers: Codes) -> list[Attractor]:
        """The attractors among the numbers of some runs, with their shares."""
        there, counts = np.unique(numbers, return_counts=True)
        return [
            self._attractor(int(number), count / numbers.size)
            for number, count in zip(there, counts, strict=True)
            if number >= 0
        ]

    def _attractor(self, number: int, share: float) -> Attractor:
        row = self._known[self._owners.index(number)]
        order = int(row["order"])
        points = np.stack([row["angle"], row["velocity"]], axis=1)
        shown = points[-min(order or len(points), len(points)) :]
        return Attractor(number, int(row["motion"]), order, share, shown)

    def _numbers(self, found: Codes) -> tuple[Codes, dict[int, int]]:
        """Translate the numbers of one call into those valid for all calls."""
        names: dict[int, int] = {}
        merged: dict[int, int] = {}
        # In ascending order, so that merged attractors get the lower number.
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
