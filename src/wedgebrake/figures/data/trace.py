"""A measured trace and the motion of the machine on the page."""

from __future__ import annotations

from dataclasses import dataclass

from wedgebrake.arrays import FloatArray
from wedgebrake.figures import style
from wedgebrake.figures.data.class_styles import LegendEntry, LineStyle

MEASURED, MODEL = "#A9B2BD", style.BLUE
"""Colours of the measured trace and of the motion of the model."""


@dataclass(frozen=True, eq=False)
class TracePicture:
    """Columns of a trace over time.

    time     : (k,) [s]
    columns  : quantity, unit, measured and computed values, (k,) each, by the name of the column
    progress : why the computed values end early; empty if they do not
    """

    time: FloatArray
    columns: dict[str, tuple[str, str, FloatArray, FloatArray]]
    progress: str

    @property
    def legend(self) -> list[LegendEntry]:
        """Entries of the legend."""
        return [
            LegendEntry("measured", LineStyle(MEASURED)),
            LegendEntry("motion of the machine", LineStyle(MODEL)),
        ]
