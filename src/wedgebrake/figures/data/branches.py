"""Branches of a sweep along which each point starts from its neighbour: up, and down again."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from wedgebrake.figures import style
from wedgebrake.figures.data import caption

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True, eq=False)
class SweepBranch:
    """One branch, or the whole of a sweep that has none.

    name      : "up" or "down"; empty for the whole
    direction : which parameter increases or decreases; empty for the whole
    dataset   : its points
    """

    name: str
    direction: str
    dataset: xr.Dataset

    @property
    def shades(self) -> tuple[str, ...]:
        """The colours of its points, from few to many."""
        return style.DENSITY_DOWN if self.name == "down" else style.DENSITY

    @property
    def colour(self) -> str:
        """The colour of its lines."""
        return style.VERMILLION if self.name == "down" else style.BLUE


def split(dataset: xr.Dataset) -> list[SweepBranch]:
    """The branches of a dataset: several, the one that was chosen, or the whole."""
    if "branch" not in dataset.coords:
        return [SweepBranch("", "", dataset)]
    parts = [dataset]
    if "branch" in dataset.dims:
        parts = [dataset.isel(branch=place) for place in range(dataset.sizes["branch"])]
    names = [str(part["branch"].item()) for part in parts]
    return [
        SweepBranch(name, caption.direction(part, name), part)
        for name, part in zip(names, parts, strict=True)
    ]
