"""The critical slopes of linear stability."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wedgebrake.analysis.linear_stability import DirectionStability, stability, stability_map
from wedgebrake.figures.matplotlib import style
from wedgebrake.model.paper_machines import AS_PRINTED, CONVENTIONAL, KINETIC, WEDGE, Case
from wedgebrake.paper.figures import layout

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from wedgebrake.paper.laboratory import Laboratory

_COEFFICIENTS = (0.2, KINETIC, 0.4)
_COLOURS = (style.GREEN, style.MOTION, style.VERMILLION)
_STEEPEST = 1.2
# "A little above mu_k": tan(alpha_w) up to so many times mu_k.
_PRACTICAL = 1.25
_STABLE = "#DCEBF5"
_LOW = -2.2


def draw(_laboratory: Laboratory) -> Figure:
    """Critical slopes of both brakes and directions, and of wedges; nothing is run."""
    figure, ((left, right),) = layout.sheet(
        [
            (
                "Figure 2. Linear stability of sliding (section 3), damping as printed:"
                rf" $c = {AS_PRINTED.damping:g}$ N m s/rad. No run; friction at rest not counted."
            )
        ],
        [2.2],
        (1.0, 1.15),
        left=0.95,
        across=0.62,
    )
    _line(left)
    _over_angle(right)
    return figure


def _line(axes: Axes) -> None:
    """Stable from the critical slope on, each brake and direction."""
    case = Case(eta=0.0)
    rows: list[tuple[str, float, str]] = []
    for brake, formulas in (
        (WEDGE, (r"\mu_k - \tan\,\alpha_w", r"-\mu_k - \tan\,\alpha_w")),
        (CONVENTIONAL, ("-1", "-1")),
    ):
        found = stability(AS_PRINTED.system(case.at(brake=brake), "coulomb"))
        for one, sign, formula in zip((found.forward, found.backward), "><", formulas, strict=True):
            rows.append((f"{brake}\n$\\dot\\theta {sign} 0$", _slope(one), formula))
    for place, (_, critical, formula) in enumerate(rows):
        axes.barh(place, 1.0 - critical, left=critical, height=0.55, color=_STABLE)
        axes.plot([critical] * 2, [place - 0.275, place + 0.275], color=style.LIMIT, linewidth=1.2)
        value = f" = {critical:.3f}" if formula != "-1" else ""
        axes.annotate(
            rf"$\eta = {formula}{value}$",
            (critical, place - 0.3),
            xytext=(0.0, 1.0),
            textcoords="offset points",
            ha="center",
            va="bottom",
            fontsize=style.SMALL,
        )
        axes.text(0.47, place, "stable", ha="right", va="center", fontsize=style.SMALL)
        axes.text(critical - 0.05, place, "unstable", ha="right", va="center", fontsize=style.SMALL)
    axes.axvline(0.0, color=style.GREY, linewidth=0.4, zorder=0)
    axes.set_yticks(range(len(rows)), [row[0] for row in rows])
    axes.set_ylim(len(rows) - 0.55, -0.75)
    axes.set_xlim(-1.7, 0.5)
    axes.tick_params(axis="y", length=0.0)
    axes.set_xlabel(r"slope $\eta$  [1]", labelpad=1.5)
    layout.ticks(axes, 5, 0)
    layout.head(axes, rf"(a) critical slopes, $\alpha = {case.alpha:g}$, $\mu_k = {KINETIC:g}$")


def _slope(one: DirectionStability) -> float:
    """The critical slope of a direction."""
    return math.nan if one.hopf_eta is None else one.hopf_eta


def _critical(kinetic: float, angles: NDArray[np.float64]) -> NDArray[np.float64]:
    """The critical slope of the worse direction at wedge angles [rad]."""
    system = AS_PRINTED.system(Case(eta=0.0), "coulomb")
    found = stability_map(system, eta=[0.0], alpha=np.tan(angles) / kinetic, kinetic=[kinetic])
    critical: NDArray[np.float64] = -found["margin"].to_numpy().ravel()
    return critical


def _over_angle(axes: Axes) -> None:
    """The critical slope of wedges over their angle."""
    system = AS_PRINTED.system(Case(eta=0.0, brake=CONVENTIONAL), "coulomb")
    axes.axhline(
        _slope(stability(system).forward),
        color=style.ORANGE,
        linewidth=1.0,
        linestyle=style.DASHES,
        label="conventional",
        zorder=3,
    )
    for kinetic, colour in zip(_COEFFICIENTS, _COLOURS, strict=True):
        first = math.atan(kinetic)
        angles = np.linspace(first, _STEEPEST, 200)[1:]
        critical = _critical(kinetic, angles)
        look: dict[str, Any] = {"color": colour, "zorder": 4}
        axes.plot(angles, critical, linewidth=0.9, label=rf"$\mu_k = {kinetic:g}$", **look)
        practical = np.tan(angles) <= _PRACTICAL * kinetic
        axes.plot(angles[practical], critical[practical], linewidth=3.0, alpha=0.45, **look)
        if kinetic == KINETIC:
            axes.fill_between(angles, critical, 1.0, color=_STABLE, linewidth=0.0, zorder=1)
    axes.set_xlim(0.1, _STEEPEST)
    axes.set_ylim(_LOW, 0.5)
    axes.text(0.9, 0.2, rf"stable ($\mu_k = {KINETIC:g}$)", ha="center", fontsize=style.SMALL)
    axes.text(0.6, -0.85, "unstable", ha="center", fontsize=style.SMALL)
    axes.plot([], [], color=style.GREY, linewidth=3.0, alpha=0.45,
              label=rf"$\tan\,\alpha_w$ < {_PRACTICAL:g} $\mu_k$")  # fmt: skip
    axes.legend(loc="lower left", borderaxespad=0.6)
    axes.set_xlabel(r"wedge angle $\alpha_w$  [rad]", labelpad=1.5)
    layout.head(axes, r"(b) critical $\eta$ of wedge brakes  [1]")
    layout.ticks(axes, 6, 6)
