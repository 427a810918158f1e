"""The nineteen figures of Chen and Xi (2014), drawn anew from a laboratory's runs.

captions.toml : caption of each
schematics    : figures 1 and 19
linear        : figures 2 and 3, linear stability
laws          : figures 4 and 5, the friction laws
responses     : figures 6, 7, 9, 10, 12, 13, 15, 16, 18
diagrams      : figures 8, 11, 14, 17
studies       : two figures of the report beside them: identification and smoothing
layout        : panels, titles and labels

Matplotlib is imported when a figure is drawn.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

from wedgebrake.model.paper_machines import RESPONSES
from wedgebrake.model.validation import unknown
from wedgebrake.paper.claims import read_table
from wedgebrake.paper.figures import diagrams, laws, linear, responses, schematics
from wedgebrake.paper.laboratory import Laboratory

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["FIGURES", "PaperFigure", "draw"]


@dataclass(frozen=True)
class PaperFigure:
    """One figure of the paper.

    number  : 8 of figure 8
    caption : what is shown
    draw    : the figure from a laboratory
    """

    number: int
    caption: str
    draw: Callable[[Laboratory], Figure]


_DRAW: dict[int, Callable[[Laboratory], Figure]] = {
    1: schematics.wedge,
    2: linear.criteria,
    3: linear.eigenvalues,
    4: laws.smoothed,
    5: laws.comparison,
    19: schematics.conventional,
    **{number: partial(responses.draw, number) for number in RESPONSES},
    **{number: partial(diagrams.draw, number) for number in (8, 11, 14, 17)},
}
FIGURES: dict[str, PaperFigure] = {
    f"fig{number}": PaperFigure(int(number), draw=_DRAW[int(number)], **table)
    for number, table in read_table(__name__, "captions.toml").items()
}
"""Every figure by name, as "fig8", in order."""


def draw(name: str, laboratory: Laboratory) -> Figure:
    """Draw a figure of the paper, "fig1" to "fig19", from a laboratory's runs.

    Responses and diagrams show the laboratory's method with the exact solution beside it.
    Runs that end early are drawn as far as they go and labelled.

    Raises ``InputError`` for any other name.
    """
    from wedgebrake.figures.matplotlib import style

    if name not in FIGURES:
        raise unknown("name", name, FIGURES, "no figure of the paper")
    with style.use():
        return FIGURES[name].draw(laboratory)
