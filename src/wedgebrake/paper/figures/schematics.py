"""The models: a torsional driveline with a wedge brake, and with a conventional one."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from wedgebrake.figures.matplotlib import style
from wedgebrake.paper.figures import layout

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from wedgebrake.paper.laboratory import Laboratory

Point = tuple[float, float]

_BODY, _BRAKE = "#DCEBF5", "#F6DFC8"
_HEIGHT = 2.0
_DRIVELINE = r"driveline: $J\ddot\theta + c\,\dot\theta + k\,\theta + RF_\mu = T(t)$"


def wedge(_laboratory: Laboratory) -> Figure:
    """Figure 1: the driveline, the wedge on the drum, and the forces on the wedge."""
    figure, ((line, drum, forces),) = layout.sheet(
        [
            (
                "Figure 1. Driveline with one torsional degree of freedom and a wedge brake"
                " (eqs. 1 to 3). Not to scale."
            )
        ],
        [_HEIGHT],
        (1.2, 1.0, 1.0),
        left=0.1,
        across=0.1,
    )
    _driveline(line)
    layout.head(line, f"(a) {_DRIVELINE}")
    _drum(drum)
    _wedge_on(drum)
    layout.head(drum, "view along the shaft")
    _equilibrium(forces)
    layout.head(forces, r"(b) wedge: $(F_\mu + F_a)/F_N = \tan\,\alpha_w$")
    return figure


def conventional(_laboratory: Laboratory) -> Figure:
    """Figure 19: the driveline with the actuation force normal to the friction face."""
    figure, ((line, drum),) = layout.sheet(
        [
            (
                "Figure 19. Driveline with one torsional degree of freedom and a conventional brake"
                " (eqs. 21, 22). Not to scale."
            )
        ],
        [_HEIGHT],
        (1.2, 1.0),
        left=0.1,
        across=0.1,
        width=5.0,
    )
    _driveline(line)
    layout.head(line, _DRIVELINE)
    _drum(drum)
    _shoe_on(drum)
    layout.head(drum, r"view along the shaft: $F_N = F_a$")
    return figure


def _space(axes: Axes, x: Point, y: Point) -> None:
    """A drawing plane about x and y, as wide as the axes at equal scales."""
    wide, tall = layout.inches(axes)
    scale = max((x[1] - x[0]) / wide, (y[1] - y[0]) / tall)
    axes.set_axis_off()
    axes.set_xlim(*style.margins(*x, scale * wide, share=0.0))
    axes.set_ylim(*style.margins(*y, scale * tall, share=0.0))


def _strokes(axes: Axes, *lines: Sequence[Point], width: float = 0.9) -> None:
    for line in lines:
        x, y = zip(*line, strict=True)
        axes.plot(x, y, color=style.BLACK, linewidth=width, solid_capstyle="round", zorder=3)


def _body(axes: Axes, corners: Sequence[Point], colour: str, **look: Any) -> None:
    from matplotlib.patches import Polygon

    look = {"edgecolor": style.BLACK, "linewidth": 0.9, "zorder": 2, **look}
    axes.add_patch(Polygon(list(corners), closed=True, facecolor=colour, **look))


def _ground(axes: Axes, corners: Sequence[Point]) -> None:
    """A fixed body: hatched, its first side drawn."""
    _body(axes, corners, "white", hatch="/////", edgecolor=style.GREY, linewidth=0.0)
    _strokes(axes, corners[:2], width=1.1)


def _arrow(
    axes: Axes, start: Point, end: Point, *, curved: float = 0.0, colour: str = style.VERMILLION
) -> None:
    from matplotlib.patches import FancyArrowPatch

    axes.add_patch(
        FancyArrowPatch(
            start,
            end,
            arrowstyle="-|>",
            mutation_scale=7.0,
            connectionstyle=f"arc3,rad={curved}",
            color=colour,
            linewidth=1.1,
            shrinkA=0.0,
            shrinkB=0.0,
            zorder=5,
        )
    )


def _say(axes: Axes, place: Point, words: str, **look: Any) -> None:
    axes.text(
        *place, words, **{"ha": "center", "va": "center", "fontsize": 8.0, "zorder": 6, **look}
    )


def _driveline(axes: Axes) -> None:
    """Wall, torsion spring and damper side by side, inertia, torque."""
    _space(axes, (-0.3, 4.6), (-1.75, 1.75))
    _ground(axes, [(0.0, -1.1), (0.0, 1.1), (-0.22, 1.1), (-0.22, -1.1)])
    steps = np.linspace(0.55, 1.65, 11)
    zigzag = [(float(x), 0.5 + 0.16 * (-1) ** i) for i, x in enumerate(steps)]
    _strokes(
        axes,
        [(0.0, 0.5), (0.4, 0.5), *zigzag, (1.8, 0.5), (2.2, 0.5)],
        [(0.0, -0.5), (0.95, -0.5)],
        [(1.45, -0.72), (0.95, -0.72), (0.95, -0.28), (1.45, -0.28)],
        [(1.2, -0.66), (1.2, -0.34)],
        [(1.2, -0.5), (2.2, -0.5)],
        [(2.2, 0.5), (2.2, -0.5)],
        [(2.2, 0.0), (2.7, 0.0)],
        [(3.3, 0.0), (4.2, 0.0)],
    )
    _say(axes, (1.1, 0.95), "$k$")
    _say(axes, (1.2, -1.0), "$c$")
    _body(axes, [(2.7, -1.2), (3.3, -1.2), (3.3, 1.2), (2.7, 1.2)], _BODY)
    _say(axes, (3.0, -0.75), "$J$")
    axes.plot([2.5, 4.4], [0.0, 0.0], color=style.GREY, linewidth=0.5, dashes=(8, 2, 2, 2))
    # Half a turn about the shaft, seen from the side.
    _arrow(axes, (3.75, -0.45), (3.75, 0.45), curved=0.55)
    _say(axes, (4.25, 0.5), r"$T,\ \theta$", color=style.VERMILLION)
    _arrow(axes, (3.0, 0.0), (3.0, 1.2), colour=style.GREY)
    _say(axes, (3.15, 0.6), "$R$", color=style.DARK_GREY)
    _strokes(axes, [(2.6, 1.24), (3.4, 1.24)], width=2.0)
    _say(axes, (3.0, 1.52), "friction face", fontsize=style.SMALL)


def _drum(axes: Axes) -> None:
    """The rotor seen along the shaft, turning clockwise, with its friction face on top."""
    from matplotlib.patches import Circle

    _space(axes, (-1.75, 1.75), (-1.12, 2.1))
    axes.add_patch(Circle((0.0, 0.0), 1.0, facecolor=_BODY, edgecolor=style.BLACK, linewidth=0.9))
    _strokes(axes, [(-0.07, 0.0), (0.07, 0.0)], [(0.0, -0.07), (0.0, 0.07)], width=0.7)
    angle = math.radians(-50.0)
    _arrow(axes, (0.0, 0.0), (math.cos(angle), math.sin(angle)), colour=style.GREY)
    _say(axes, (0.5, -0.33), "$R$", color=style.DARK_GREY)
    _arrow(axes, (-0.68, 0.1), (0.2, 0.66), curved=-0.35, colour=style.BLUE)
    _say(axes, (-0.2, 0.3), r"$\dot\theta$", color=style.BLUE)


_THICK, _THIN, _LEFT, _RIGHT = 0.62, 0.14, -0.7, 0.66
_SLOPE = (_THICK - _THIN) / (_RIGHT - _LEFT)


def _wedge_corners(base: float) -> list[Point]:
    return [(_LEFT, base), (_RIGHT, base), (_RIGHT, base + _THIN), (_LEFT, base + _THICK)]


def _wedge_on(axes: Axes) -> None:
    """The wedge between the drum and a fixed incline, pushed on its short side."""
    from matplotlib.patches import Circle

    _body(axes, _wedge_corners(1.0), _BRAKE, zorder=3)
    roller = 0.07
    across = np.array([_SLOPE, 1.0]) / math.hypot(_SLOPE, 1.0)
    for x in (-0.45, -0.05, 0.35):
        centre = np.array([x, 1.0 + _THICK - _SLOPE * (x - _LEFT)]) + roller * across
        axes.add_patch(
            Circle(
                tuple(centre),
                roller,
                facecolor="white",
                edgecolor=style.BLACK,
                linewidth=0.7,
                zorder=4,
            )
        )
    gap = 2.0 * roller * across
    left, right = (
        (_LEFT - 0.05, 1.0 + _THICK + 0.05 * _SLOPE),
        (_RIGHT + 0.1, 1.0 + _THIN - 0.1 * _SLOPE),
    )
    face = [(x + gap[0], y + gap[1]) for x, y in (left, right)]
    back = [(x + 0.16 * across[0], y + 0.16 * across[1]) for x, y in face[::-1]]
    _ground(axes, [*face, *back])
    _arrow(axes, (_LEFT - 0.75, 1.3), (_LEFT, 1.3))
    _say(axes, (_LEFT - 0.5, 1.52), "$F_a$", color=style.VERMILLION)
    _arrow(axes, (0.02, 0.93), (-0.62, 0.93), colour=style.PURPLE)
    _say(axes, (-0.95, 0.86), r"$F_\mu$", color=style.PURPLE)


def _shoe_on(axes: Axes) -> None:
    """A shoe pressed straight on to the drum, held sideways."""
    _body(axes, [(-0.55, 1.0), (0.55, 1.0), (0.55, 1.35), (-0.55, 1.35)], _BRAKE, zorder=3)
    _ground(axes, [(0.62, 1.05), (0.62, 1.6), (0.8, 1.6), (0.8, 1.05)])
    _ground(axes, [(-0.62, 1.05), (-0.62, 1.6), (-0.8, 1.6), (-0.8, 1.05)])
    _arrow(axes, (0.0, 2.0), (0.0, 1.35))
    _say(axes, (0.24, 1.85), "$F_a$", color=style.VERMILLION)
    _arrow(axes, (0.02, 0.93), (-0.62, 0.93), colour=style.PURPLE)
    _say(axes, (-0.95, 0.86), r"$F_\mu$", color=style.PURPLE)


def _equilibrium(axes: Axes) -> None:
    """The forces on the wedge alone, the drum sliding to the right below it."""
    from matplotlib.patches import Arc

    _space(axes, (-1.9, 1.6), (-1.3, 1.92))
    _body(axes, _wedge_corners(0.0), _BRAKE)
    middle = 0.5 * (_LEFT + _RIGHT)
    top = 0.5 * (_THICK + _THIN)
    _arrow(axes, (_LEFT - 0.8, 0.3), (_LEFT, 0.3))
    _say(axes, (_LEFT - 0.55, 0.52), "$F_a$", color=style.VERMILLION)
    _arrow(axes, (middle, -0.85), (middle, 0.0), colour=style.BLUE)
    _say(axes, (middle - 0.28, -0.6), "$F_N$", color=style.BLUE)
    _arrow(axes, (middle + 0.12, -0.1), (middle + 0.87, -0.1), colour=style.PURPLE)
    _say(axes, (middle + 0.55, -0.32), r"$F_\mu$", color=style.PURPLE)
    length = 0.9
    across = np.array([_SLOPE, 1.0]) / math.hypot(_SLOPE, 1.0)
    start = (middle + length * across[0], top + length * across[1])
    _arrow(axes, start, (middle, top), colour=style.GREEN)
    _say(axes, (start[0] + 0.1, start[1] + 0.16), r"$F_N/\cos\,\alpha_w$", color=style.GREEN)
    # The angle of the incline, where its line meets the base.
    tip = _LEFT + _THICK / _SLOPE
    _strokes(axes, [(_RIGHT, _THIN), (tip, 0.0), (_RIGHT, 0.0)], width=0.5)
    degrees = math.degrees(math.atan(_SLOPE))
    axes.add_patch(
        Arc((tip, 0.0), 1.1, 1.1, theta1=180.0 - degrees, theta2=180.0, linewidth=0.7, zorder=4)
    )
    _say(axes, (tip - 0.12, 0.38), r"$\alpha_w$")
    _arrow(axes, (-1.6, -1.1), (-0.9, -1.1), colour=style.GREY)
    _say(
        axes,
        (-0.8, -1.1),
        r"face moves, $\dot\theta > 0$",
        ha="left",
        fontsize=style.SMALL,
        color=style.DARK_GREY,
    )
