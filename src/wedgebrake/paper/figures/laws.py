"""Figures 4 and 5: friction laws, what the wedge makes of them, and a stick-slip response."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from wedgebrake.figures.data.motion import History, last_periods
from wedgebrake.figures.matplotlib import style
from wedgebrake.model import paper_machines as paper
from wedgebrake.model.brakes import WedgeBrake
from wedgebrake.model.friction import SmoothedFriction
from wedgebrake.model.paper_machines import FIGURE_5, KINETIC
from wedgebrake.paper.figures import layout
from wedgebrake.paper.laboratory import Laboratory

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_ANGLE = 0.34
"""The wedge angle [rad] at which the ratios are those that the paper states, 5.58 and 0.46."""
# Largest sliding speeds of both figures [m/s], and torque periods in figure 5.
_FASTEST, _NEAR = 0.4, 0.2
_PERIODS = 5
_SMOOTH: dict[str, Any] = {"color": style.MOTION, "linewidth": 0.9, "zorder": 3}
_COULOMB: dict[str, Any] = {"color": style.ORANGE, "linewidth": 1.8, "zorder": 2}


def smoothed(_laboratory: Laboratory) -> Figure:
    """Figure 4: the smoothed law with and without a static peak; nothing is run."""
    statics = (paper.CORRECTED.static, paper.AS_PRINTED.static)
    laws = [SmoothedFriction(kinetic=KINETIC, static=static) for static in statics]
    brake = WedgeBrake(angle=_ANGLE, radius=paper.RADIUS)
    figure, ((left, right),) = layout.sheet(
        [
            (
                rf"Figure 4. Smoothed friction (eqs. 14, 15): $\mu_k = {KINETIC:g}$,"
                rf" $\xi = {laws[0].steepness:g}$ s/m, $\varsigma = {laws[0].decay:g}$ s/m, and the"
                rf" wedge brake at $\alpha = {math.tan(_ANGLE) / KINETIC:.2f}$ (printed: 1.03)."
                " No run."
            )
        ],
        [1.9],
        (1.0, 1.0),
        across=0.6,
    )
    layout.head(left, r"(a) friction coefficient $\mu/\mu_k$  [1]")
    layout.head(right, r"(b) friction over actuation force $F_\mu/F_a$  [1]")
    pens = {**_SMOOTH, "linewidth": 1.1}, {**_COULOMB, "linewidth": 0.7}
    for law, pen in zip(laws, pens, strict=True):
        _curve(left, law, _FASTEST, lambda m: m / KINETIC, pen, rf"$\mu_s = {law.static:g}$")
        _curve(right, law, _FASTEST, brake.amplification, pen)
    left.legend(loc="lower right", borderaxespad=0.5)
    for side, align in ((1.0, "right"), (-1.0, "left")):
        value = brake.amplification(side * KINETIC)
        at = (0.97 * side * _FASTEST, value)
        look = {"ha": align, "va": "top", "color": style.MOTION, "fontsize": style.LABELS}
        style.write(right, f"${value:.2f}$", at, (0.0, -3.0), "data", **look)
    right.set_ylim(bottom=-1.8)
    for axes in (left, right):
        layout.zero_lines(axes, vertical=True)
        axes.set_xlabel(r"sliding speed $v_r = R\dot\theta$  [m/s]", labelpad=1.5)
        layout.ticks(axes, 5, 6)
    return figure


def comparison(laboratory: Laboratory) -> Figure:
    """Figure 5: smoothed friction by the laboratory's method, or adaptively if that is exact."""
    exact = laboratory.like(method="exact")
    smooth = laboratory if laboratory.method != "exact" else laboratory.like(method="smooth")
    figure, ((left, right),) = layout.sheet(
        [
            f"Figure 5. {FIGURE_5.brake.capitalize()} brake: {layout.groups(FIGURE_5)}.",
            layout.assumptions(laboratory.assumptions),
            (
                f"{layout.both([smooth, exact])} {paper.DURATION:g} s from rest; the last"
                f" {_PERIODS} periods."
            ),
        ],
        [1.9],
        (1.0, 2.0),
        across=0.5,
    )
    _ratios(left, laboratory.assumptions.static)
    for one, pen in ((exact, _COULOMB), (smooth, _SMOOTH)):
        response = one.response(FIGURE_5)
        first, _ = last_periods(response, _PERIODS)
        data = History.last(response, _PERIODS)
        right.plot(data.time, data.velocity, **pen)
        if response.attrs["status"] != "completed":
            layout.note(right, response.attrs["message"], "right", style.BLACK)
    layout.zero_lines(right)
    right.set_xlim(first, paper.DURATION)
    right.set_xlabel("time $t$  [s]", labelpad=1.5)
    layout.head(right, r"(b) velocity $\dot\theta$  [rad/s]")
    layout.ticks(right, 6, 6)
    return figure


def _ratios(axes: Axes, static: float) -> None:
    brake = WedgeBrake(angle=math.atan(FIGURE_5.alpha * KINETIC), radius=paper.RADIUS)
    law = SmoothedFriction(kinetic=KINETIC, static=static)
    _curve(axes, law, _NEAR, brake.amplification, _SMOOTH)
    corners = [-KINETIC, -KINETIC, -static, static, KINETIC, KINETIC]
    ratios = [brake.amplification(m) for m in corners]
    axes.plot([-_NEAR, 0.0, 0.0, 0.0, 0.0, _NEAR], ratios, **_COULOMB)
    axes.set_xlabel(r"sliding speed $v_r$  [m/s]", labelpad=1.5)
    layout.head(axes, r"(a) $F_\mu/F_a$  [1]")
    layout.ticks(axes, 4, 6)


def _curve(
    axes: Axes,
    law: SmoothedFriction,
    fastest: float,
    of: Callable[[float], float],
    pen: dict[str, Any],
    label: str = "",
) -> None:
    """A function of the coefficient over the speed, dense in the steep part about zero."""
    speeds = fastest * np.linspace(-1.0, 1.0, 801) ** 3
    values = [of(law.coefficient(float(speed))) for speed in speeds]
    axes.plot(speeds, values, label=label or None, **pen)
    axes.set_xlim(-fastest, fastest)
