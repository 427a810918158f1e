"""Entries of legends."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wedgebrake.figures.data.class_styles import (
    STABILITY_LIMIT,
    ClassStyle,
    LineStyle,
    MarkerStyle,
)
from wedgebrake.figures.style import percent


@dataclass(frozen=True)
class LegendEntry:
    """Entry of a legend: a colour, line or symbol and its label, which may contain mathtext."""

    label: str
    style: ClassStyle | LineStyle | MarkerStyle

    @property
    def css(self) -> tuple[str, str]:
        """CSS background and plain words of the entry on a page."""
        words = self.label.replace("$", "")
        if isinstance(self.style, ClassStyle):
            return self.style.css, words
        if isinstance(self.style, MarkerStyle):
            face, edge = self.style.face, self.style.edge
            return f"radial-gradient({face} 2px, {edge} 2px 3px, transparent 3px)", words
        colour, half = self.style.colour, 8 if self.style == STABILITY_LIMIT else 5
        edges = f"{50 - half}%", f"{50 + half}%"
        line = f"transparent {edges[0]}, {colour} {edges[0]} {edges[1]}, transparent {edges[1]}"
        return f"linear-gradient({line})", words


LIMIT_ENTRY = LegendEntry("linear stability limit", STABILITY_LIMIT)


def class_entry(style: ClassStyle, share: float | None = None) -> LegendEntry:
    """The entry of a class, with its share of all points if given."""
    return LegendEntry(style.word if share is None else f"{style.word}, {percent(share)}", style)


def class_entries(
    codes: NDArray[Any], styles: Sequence[ClassStyle], *, shares: bool
) -> list[LegendEntry]:
    """Entries of the classes that occur, with their shares of all points.

    Codes below 0 count as points, but have no entry.
    """
    counts = np.bincount(codes[codes >= 0].ravel(), minlength=len(styles))
    return [
        class_entry(one, count / codes.size if shares else None)
        for one, count in zip(styles, counts, strict=True)
        if count
    ]
