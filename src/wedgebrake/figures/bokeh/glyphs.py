"""Images and boxes in figures over parameters."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from bokeh.models import ColumnDataSource, Image, LinearColorMapper, Quad

from wedgebrake.figures.bokeh import chart
from wedgebrake.figures.data.class_styles import HATCH

HATCHING = {
    "hatch_pattern": "/", "hatch_color": HATCH, "hatch_alpha": 0.4, "hatch_scale": 9.0,
    "hatch_weight": 0.6,
}  # fmt: skip
IMAGE = ("image", "x", "y", "dw", "dh")
"""Columns of an image."""
BOXES = ("left", "right", "bottom", "top")
"""Columns of boxes."""


def invisible_boxes() -> Quad:
    """Transparent boxes that react to the pointer."""
    return Quad(**{one: one for one in BOXES}, fill_alpha=0.0, line_alpha=0.0)


def image(**options: Any) -> Image:
    """An image from the columns ``IMAGE``."""
    return Image(**{one: one for one in IMAGE}, **options)


def palette(colours: Sequence[str]) -> LinearColorMapper:
    """Colours of the whole numbers from 0."""
    return LinearColorMapper(palette=list(colours), low=-0.5, high=len(colours) - 0.5)


def put_image(
    source: ColumnDataSource,
    values: np.ndarray,
    across: tuple[float, float],
    up: tuple[float, float],
    **more: Any,
) -> None:
    """Set an image of cells, (rows up, columns across), between positions."""
    box = {"x": [across[0]], "y": [up[0]], "dw": [across[1] - across[0]], "dh": [up[1] - up[0]]}
    chart.update_source(source, image=[values], **box, **more)
