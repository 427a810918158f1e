"""Branches of a sweep along which points follow each other: up, and down again."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from wedgebrake.figures.matplotlib import caption, style

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True)
class Branch:
    """One branch, or the whole of a sweep that has none.

    word      : "up" or "down"; empty for the whole
    direction : which parameter goes where, for example "eta increasing"; empty for the whole
    dataset   : its points
    """

    word: str
    direction: str
    dataset: xr.Dataset

    @property
    def shades(self) -> tuple[str, ...]:
        """The colours of its points, from few to many."""
        return style.DENSITY_DOWN if self.word == "down" else style.DENSITY

    @property
    def colour(self) -> str:
        """The colour of its lines."""
        return style.VERMILLION if self.word == "down" else style.BLUE


def split(dataset: xr.Dataset) -> list[Branch]:
    """The branches of a dataset: several, the one that was chosen, or the whole."""
    if "branch" not in dataset.coords:
        return [Branch("", "", dataset)]
    if "branch" not in dataset.dims:
        return [_branch(dataset)]
    return [_branch(dataset.isel(branch=place)) for place in range(dataset.sizes["branch"])]


def _branch(dataset: xr.Dataset) -> Branch:
    word = str(dataset["branch"].item())
    return Branch(word, caption.direction(dataset, word), dataset)
