"""The smoothed friction law and what the wedge makes of it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from wedgebrake.figures.matplotlib import style
from wedgebrake.model.brakes import WedgeBrake
from wedgebrake.model.friction import SmoothedFriction
from wedgebrake.paper.assumptions import AS_PRINTED, CORRECTED
from wedgebrake.paper.figures import layout
from wedgebrake.paper.laboratory import Laboratory
from wedgebrake.paper.parameters import KINETIC, RADIUS

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_ANGLE = 0.34
"""The wedge angle [rad] at which the ratios are those that the paper states, 5.58 and 0.46."""
_FASTEST = 0.4


def draw(_laboratory: Laboratory) -> Figure:
    """Both curves with and without a static peak; nothing is run."""
    laws = [SmoothedFriction(kinetic=KINETIC, static=a.static) for a in (CORRECTED, AS_PRINTED)]
    alpha = math.tan(_ANGLE) / KINETIC
    brake = WedgeBrake(angle=_ANGLE, radius=RADIUS)
    figure, ((left, right),) = layout.sheet(
        [
            (
                rf"Figure 4. Smoothed friction (eqs. 14, 15): $\mu_k = {KINETIC:g}$,"
                rf" $\xi = {laws[0].steepness:g}$ s/m, $\varsigma = {laws[0].decay:g}$ s/m, and the"
                rf" wedge brake at $\alpha = {alpha:.2f}$ (printed: 1.03). No run."
            ),
        ],
        [1.9],
        (1.0, 1.0),
        across=0.6,
    )
    for axes, words in (
        (left, r"(a) friction coefficient $\mu/\mu_k$  [1]"),
        (right, r"(b) friction over actuation force $F_\mu/F_a$  [1]"),
    ):
        _frame(axes, words)
    looks: tuple[dict[str, Any], ...] = (
        {"color": style.MOTION, "linewidth": 1.1, "zorder": 3},
        {"color": style.ORANGE, "linewidth": 0.7, "zorder": 2},
    )
    for law, look in zip(laws, looks, strict=True):
        # Not at equal steps: the steep part about zero is a fiftieth of the axis.
        speeds = _FASTEST * np.linspace(-1.0, 1.0, 801) ** 3
        friction = np.array([law.coefficient(float(speed)) for speed in speeds])
        left.plot(speeds, friction / KINETIC, label=rf"$\mu_s = {law.static:g}$", **look)
        right.plot(speeds, [brake.amplification(float(m)) for m in friction], **look)
    left.legend(loc="lower right", borderaxespad=0.5)
    for side in (1.0, -1.0):
        _level(right, brake.amplification(side * KINETIC), side)
    right.set_ylim(bottom=-1.8)
    for axes in (left, right):
        layout.ticks(axes, 5, 6)
    return figure


def _frame(axes: Axes, words: str) -> None:
    axes.axhline(0.0, color=style.GREY, linewidth=0.4, zorder=1)
    axes.axvline(0.0, color=style.GREY, linewidth=0.4, zorder=1)
    layout.head(axes, words)
    axes.set_xlabel(r"sliding speed $v_r = R\dot\theta$  [m/s]", labelpad=1.5)
    axes.set_xlim(-_FASTEST, _FASTEST)


def _level(axes: Axes, value: float, side: float) -> None:
    """A ratio at high speed, in figures, at the end of its curve."""
    axes.annotate(
        f"${value:.2f}$",
        (0.97 * side * _FASTEST, value),
        xytext=(0.0, -3.0),
        textcoords="offset points",
        ha="right" if side > 0.0 else "left",
        va="top",
        color=style.MOTION,
    )
