"""Smoothed against Coulomb friction: the laws and a stick-slip response."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from wedgebrake.analysis.spectrum import frequencies
from wedgebrake.figures.matplotlib import style
from wedgebrake.model.brakes import WedgeBrake
from wedgebrake.model.friction import SmoothedFriction
from wedgebrake.paper.assumptions import Case
from wedgebrake.paper.figures import layout, words
from wedgebrake.paper.laboratory import DURATION, METHOD_WORDS, Laboratory
from wedgebrake.paper.parameters import KINETIC, RADIUS

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

CASE = Case(eta=0.0, F0=0.09, alpha=1.21)
_PERIODS = 5
_FASTEST = 0.2
_SMOOTH: dict[str, Any] = {"color": style.MOTION, "linewidth": 0.9, "zorder": 3}
_COULOMB: dict[str, Any] = {"color": style.ORANGE, "linewidth": 1.8, "zorder": 2}


def draw(laboratory: Laboratory) -> Figure:
    """Smoothed friction by the laboratory's method, or adaptively if that is the exact one."""
    exact = laboratory.like(method="exact")
    smooth = laboratory if laboratory.method != "exact" else laboratory.like(method="smooth")
    figure, ((left, right),) = layout.sheet(
        [
            f"Figure 5. {words.brake(CASE)}: {words.groups(CASE)}.",
            words.assumptions(laboratory.assumptions),
            (
                f"Blue: {METHOD_WORDS[smooth.method]}. Orange: {METHOD_WORDS[exact.method]}."
                f" {DURATION:g} s from rest; the last {_PERIODS} periods."
            ),
        ],
        [1.9],
        (1.0, 2.0),
        across=0.5,
    )
    _laws(left, laboratory.assumptions.static)
    _response(right, smooth, exact)
    return figure


def _laws(axes: Axes, static: float) -> None:
    """Friction over actuation force of both laws."""
    brake = WedgeBrake(angle=math.atan(CASE.alpha * KINETIC), radius=RADIUS)
    law = SmoothedFriction(kinetic=KINETIC, static=static)
    speeds = _FASTEST * np.linspace(-1.0, 1.0, 801) ** 3
    ratios = [brake.amplification(law.coefficient(float(speed))) for speed in speeds]
    axes.plot(speeds, ratios, **_SMOOTH)
    kinetic = [brake.amplification(side * KINETIC) for side in (-1.0, 1.0)]
    hold = [brake.amplification(side * static) for side in (-1.0, 1.0)]
    axes.plot(
        [-_FASTEST, 0.0, 0.0, 0.0, 0.0, _FASTEST],
        [kinetic[0], kinetic[0], hold[0], hold[1], kinetic[1], kinetic[1]],
        **_COULOMB,
    )
    axes.set_xlim(-_FASTEST, _FASTEST)
    axes.set_xlabel(r"sliding speed $v_r$  [m/s]", labelpad=1.5)
    layout.head(axes, r"(a) $F_\mu/F_a$  [1]")
    layout.ticks(axes, 4, 6)


def _response(axes: Axes, smooth: Laboratory, exact: Laboratory) -> None:
    """The last periods of the velocity."""
    for laboratory, look in ((exact, _COULOMB), (smooth, _SMOOTH)):
        response = laboratory.response(CASE)
        times, velocity = response["time"].to_numpy(), response["velocity"].to_numpy()
        first = DURATION - _PERIODS / frequencies(response)["forcing_frequency"]
        shown = times >= first
        axes.plot(times[shown], velocity[shown], **look)
        if response.attrs["status"] != "completed":
            layout.note(axes, response.attrs["message"], "right", style.BLACK)
    axes.axhline(0.0, color=style.GREY, linewidth=0.4, zorder=1)
    axes.set_xlim(first, DURATION)
    axes.set_xlabel("time $t$  [s]", labelpad=1.5)
    layout.head(axes, r"(b) velocity $\dot\theta$  [rad/s]")
    layout.ticks(axes, 6, 6)
