"""The nineteen figures of Chen and Xi (2014), drawn anew from a laboratory's runs.

schematics   figures 1 and 19
criteria     figure 2, eigenvalues  figure 3: linear stability
friction     figure 4, comparison  figure 5: the friction laws
responses    figures 6, 7, 9, 10, 12, 13, 15, 16, 18
diagrams     figures 8, 11, 14, 17

words and layout are what they share. Matplotlib is imported when one is drawn.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Literal

from wedgebrake.errors import InputError, nearest
from wedgebrake.paper.figures import (
    comparison,
    criteria,
    diagrams,
    eigenvalues,
    friction,
    responses,
    schematics,
)
from wedgebrake.paper.laboratory import Laboratory

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["FIGURES", "PaperFigure", "draw"]

Kind = Literal["schematic", "linear", "law", "responses", "diagram"]


@dataclass(frozen=True)
class PaperFigure:
    """One figure of the paper.

    name, number : as "fig8", 8
    kind         : of picture
    caption      : what is shown
    draw         : the figure from a laboratory
    """

    name: str
    number: int
    kind: Kind
    caption: str
    draw: Callable[[Laboratory], Figure]


def draw(name: str, laboratory: Laboratory) -> Figure:
    """A figure of the paper, "fig1" to "fig19", from a laboratory's runs.

    Responses and diagrams show the laboratory's method with the exact solution beside it.
    Runs that end early are drawn as far as they go, with a word.

    Raises ``InputError`` for any other name.
    """
    from wedgebrake.figures.matplotlib import style

    if name not in FIGURES:
        raise InputError(f"name = {name!r}: no figure of the paper. {nearest(str(name), FIGURES)}")
    with style.use():
        return FIGURES[name].draw(laboratory)


def _responses(number: int, rows: responses.Rows, caption: str) -> PaperFigure:
    maker = partial(responses.draw, rows, number)
    return PaperFigure(f"fig{number}", number, "responses", caption, maker)


def _diagram(number: int, panels: diagrams.Panels, caption: str) -> PaperFigure:
    maker = partial(diagrams.draw, panels, number)
    return PaperFigure(f"fig{number}", number, "diagram", caption, maker)


_SLOPE = "slope of the actuation force η"
_FOUR = "Phase portraits, velocities, Poincaré maps and spectra of the {} brake at {}."
_ALL = (
    PaperFigure(
        "fig1",
        1,
        "schematic",
        "Driveline with a wedge brake: (a) the model, (b) the forces on the wedge.",
        schematics.wedge,
    ),
    PaperFigure(
        "fig2",
        2,
        "linear",
        f"Where sliding is linearly stable: (a) the critical {_SLOPE} of both brakes in both"
        " directions, (b) that of wedges over their angle, for three friction coefficients.",
        criteria.draw,
    ),
    PaperFigure(
        "fig3",
        3,
        "linear",
        f"Eigenvalues of sliding over the {_SLOPE}, (a) forwards and (b) backwards: growth and"
        " frequency, with Hopf and node-focus points.",
        eigenvalues.draw,
    ),
    PaperFigure(
        "fig4",
        4,
        "law",
        "The smoothed friction law over the sliding speed, and the wedge brake's friction force"
        " over its actuation force, with and without a static peak.",
        friction.draw,
    ),
    PaperFigure(
        "fig5",
        5,
        "law",
        "Smoothed against Coulomb friction: (a) the characteristics of the wedge brake, (b) a"
        " stick-slip response.",
        comparison.draw,
    ),
    _responses(
        6,
        responses.STICK_SLIP,
        "Kinds of stick-slip of the wedge brake at constant actuation force. The second row"
        " repeats the first at F_0 = 0.036 instead of the printed 0.12; it is not in the paper.",
    ),
    _responses(
        7, responses.NO_STICK, "The conventional brake in the cases of figure 6, as printed."
    ),
    _diagram(8, diagrams.OVER_SLOPE, f"Poincaré points of both brakes over the {_SLOPE}."),
    _responses(9, responses.SLOPES, _FOUR.format("wedge", "four slopes η")),
    _responses(10, responses.SLOPES.conventional(), _FOUR.format("conventional", "four slopes η")),
    _diagram(11, diagrams.OVER_FORCE, "Poincaré points of both brakes over the initial force F_0."),
    _responses(12, responses.FORCES, _FOUR.format("wedge", "six initial forces F_0")),
    _responses(
        13,
        responses.FORCES.conventional(),
        _FOUR.format("conventional", "six initial forces F_0"),
    ),
    _diagram(
        14,
        diagrams.OVER_FREQUENCY,
        "Poincaré points of both brakes over the frequency f of the torque, on a linear axis and"
        " on one that is logarithmic beyond 1 rad/s, as the resonance towers above the rest.",
    ),
    _responses(15, responses.OVER_F, _FOUR.format("wedge", "five frequencies f")),
    _responses(
        16,
        responses.OVER_F.conventional(),
        _FOUR.format("conventional", "five frequencies f"),
    ),
    _diagram(
        17,
        diagrams.OVER_ANGLE,
        "Poincaré points of the wedge brake over the relative wedge angle; up to 1 the"
        " brake locks itself.",
    ),
    _responses(18, responses.ANGLES, _FOUR.format("wedge", "two wedge angles")),
    PaperFigure(
        "fig19",
        19,
        "schematic",
        "Driveline with a conventional brake, its actuation force normal to the friction face.",
        schematics.conventional,
    ),
)
FIGURES: dict[str, PaperFigure] = {figure.name: figure for figure in _ALL}
"""Every figure, in order."""
