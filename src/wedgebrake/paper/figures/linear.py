"""Figures 2 and 3: critical slopes and eigenvalues of linear stability; nothing is run."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from wedgebrake.analysis.linear_stability import DirectionStability, stability, stability_map
from wedgebrake.arrays import FloatArray
from wedgebrake.figures.matplotlib import style
from wedgebrake.model.paper_machines import AS_PRINTED, CONVENTIONAL, KINETIC, WEDGE, Case
from wedgebrake.paper.figures import layout
from wedgebrake.paper.laboratory import Laboratory

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


# Of figure 2.
_COEFFICIENTS = {0.2: style.GREEN, KINETIC: style.MOTION, 0.4: style.VERMILLION}
_STEEPEST = 1.2
# "A little above mu_k": tan(alpha_w) up to so many times mu_k.
_PRACTICAL = 1.25
_STABLE = "#DCEBF5"
_LOW = -2.2
# Of figure 3.
_CASES = (
    (Case(eta=0.0, alpha=1.03), r"wedge, $\alpha = 1.03$", style.VERMILLION),
    (Case(eta=0.0, alpha=1.21), r"wedge, $\alpha = 1.21$", style.MOTION),
    (Case(eta=0.0, alpha=3.43), r"wedge, $\alpha = 3.43$", style.GREEN),
    (Case(eta=0.0, brake=CONVENTIONAL), "conventional", style.BLACK),
)
_MOST, _LINEAR = 400.0, 0.005
_GROWTH = 250.0
_NODE: dict[str, Any] = {"marker": "o", "markersize": 3.4, "markerfacecolor": "white"}
_HOPF: dict[str, Any] = {"marker": "D", "markersize": 3.0}


def criteria(_laboratory: Laboratory) -> Figure:
    """Figure 2: critical slopes of both brakes and directions, and of wedges."""
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
    _critical_slopes(left)
    _over_angle(right)
    return figure


def _critical_slopes(axes: Axes) -> None:
    """Stable from the critical slope on, each brake and direction."""
    case = Case(eta=0.0)
    rows: list[tuple[str, float, str]] = []
    for brake, formulas in (
        (WEDGE, (r"\mu_k - \tan\,\alpha_w", r"-\mu_k - \tan\,\alpha_w")),
        (CONVENTIONAL, ("-1", "-1")),
    ):
        found = stability(AS_PRINTED.system(case.at(brake=brake), "coulomb"))
        for one, sign, formula in zip((found.forward, found.backward), "><", formulas, strict=True):
            rows.append((f"{brake}\n$\\dot\\theta {sign} 0$", one.hopf_eta or math.nan, formula))
    small: dict[str, Any] = {"va": "center", "ha": "right", "fontsize": style.SMALL}
    for place, (_, critical, formula) in enumerate(rows):
        axes.barh(place, 1.0 - critical, left=critical, height=0.55, color=_STABLE)
        axes.plot([critical] * 2, [place - 0.275, place + 0.275], color=style.LIMIT, linewidth=1.2)
        value = f" = {critical:.3f}" if formula != "-1" else ""
        at = (critical, place - 0.3), (0.0, 1.0), "data"
        style.write(axes, rf"$\eta = {formula}{value}$", *at, ha="center", va="bottom")
        axes.text(0.47, place, "stable", **small)
        axes.text(critical - 0.05, place, "unstable", **small)
    axes.axvline(0.0, color=style.GREY, linewidth=0.4, zorder=0)
    axes.set_yticks(range(len(rows)), [row[0] for row in rows])
    axes.set_ylim(len(rows) - 0.55, -0.75)
    axes.set_xlim(-1.7, 0.5)
    axes.tick_params(axis="y", length=0.0)
    axes.set_xlabel(r"slope $\eta$  [1]", labelpad=1.5)
    layout.ticks(axes, 5, 0)
    layout.head(axes, rf"(a) critical slopes, $\alpha = {case.alpha:g}$, $\mu_k = {KINETIC:g}$")


def _over_angle(axes: Axes) -> None:
    conventional = AS_PRINTED.system(Case(eta=0.0, brake=CONVENTIONAL), "coulomb")
    look: dict[str, Any] = {"linewidth": 1.0, "linestyle": style.DASHES, "zorder": 3}
    limit = stability(conventional).forward.hopf_eta or math.nan
    axes.axhline(limit, color=style.ORANGE, label="conventional", **look)
    wedge = AS_PRINTED.system(Case(eta=0.0), "coulomb")
    thick: dict[str, Any] = {"linewidth": 3.0, "alpha": 0.45}
    for kinetic, colour in _COEFFICIENTS.items():
        angles = np.linspace(math.atan(kinetic), _STEEPEST, 200)[1:]
        alpha = np.tan(angles) / kinetic
        found = stability_map(wedge, eta=[0.0], alpha=alpha, kinetic=[kinetic])
        critical = -found["margin"].to_numpy().ravel()
        look = {"color": colour, "zorder": 4}
        axes.plot(angles, critical, linewidth=0.9, label=rf"$\mu_k = {kinetic:g}$", **look)
        practical = np.tan(angles) <= _PRACTICAL * kinetic
        axes.plot(angles[practical], critical[practical], **thick, **look)
        if kinetic == KINETIC:
            axes.fill_between(angles, critical, 1.0, color=_STABLE, linewidth=0.0, zorder=1)
    axes.set_xlim(0.1, _STEEPEST)
    axes.set_ylim(_LOW, 0.5)
    axes.text(0.9, 0.2, rf"stable ($\mu_k = {KINETIC:g}$)", ha="center", fontsize=style.SMALL)
    axes.text(0.6, -0.85, "unstable", ha="center", fontsize=style.SMALL)
    label = rf"$\tan\,\alpha_w$ < {_PRACTICAL:g} $\mu_k$"
    axes.plot([], [], color=style.GREY, label=label, **thick)
    axes.legend(loc="lower left", borderaxespad=0.6)
    axes.set_xlabel(r"wedge angle $\alpha_w$  [rad]", labelpad=1.5)
    layout.head(axes, r"(b) critical $\eta$ of wedge brakes  [1]")
    layout.ticks(axes, 6, 6)


def eigenvalues(_laboratory: Laboratory) -> Figure:
    """Figure 3: real and imaginary parts in both directions, with the bifurcation points."""
    figure, (tops, bottoms) = layout.sheet(
        [
            (
                "Figure 3. Eigenvalues $\\sigma \\pm i\\omega$ of sliding (section 3), damping as"
                rf" printed: $c = {AS_PRINTED.damping:g}$ N m s/rad. No run. Axis of"
                rf" $\eta$: logarithmic beyond {_LINEAR:g}."
            ),
            (
                "Diamonds: Hopf points. Circles: node-focus points, where oscillation ends; there"
                r" $\sigma$ splits in two. Right of the Hopf point sliding is stable."
            ),
        ],
        [1.9, 1.15],
        (1.0, 1.0),
        top=0.42,
        between=0.1,
    )
    for case, label, colour in _CASES:
        system = AS_PRINTED.system(case, "coulomb")
        points = stability(system)
        slopes = _slopes(points.forward, points.backward)
        found = [stability(system.replace(eta=float(eta))) for eta in slopes]
        natural = system.driveline.natural_frequency
        for side, top, bottom in zip(("forward", "backward"), tops, bottoms, strict=True):
            values = np.array([getattr(one, side).eigenvalues for one in found])
            top.plot(slopes, values.real[:, 0], color=colour, label=label)
            top.plot(slopes, values.real[:, 1], color=colour)
            bottom.plot(slopes, np.abs(values.imag[:, 0]) / natural, color=colour)
            one: DirectionStability = getattr(points, side)
            ends = np.array([one.node_focus_unstable_eta, one.node_focus_stable_eta], dtype=float)
            hopf = np.array([one.hopf_eta], dtype=float)
            look: dict[str, Any] = {"color": colour, "linestyle": "none", "zorder": 4}
            for axes, levels, level in ((top, (natural, -natural), 0.0), (bottom, (0.0, 0.0), 1.0)):
                axes.plot(ends, levels, **_NODE, **look)
                axes.plot(hopf, [level], **_HOPF, **look)
    for sign, letter, top, bottom in zip("><", "ab", tops, bottoms, strict=True):
        layout.head(top, rf"({letter}) $\dot\theta {sign} 0$")
        _frame(top, bottom)
    tops[0].set_ylabel(r"real part $\sigma$  [1/s]", labelpad=1.0)
    bottoms[0].set_ylabel(r"$\Omega = \omega/\omega_n$  [1]", labelpad=1.0)
    figure.legend(
        *tops[0].get_legend_handles_labels(),
        loc="lower right",
        ncols=len(_CASES),
        bbox_to_anchor=(0.985, tops[0].get_position().y1 + 0.055),
    )
    return figure


def _slopes(*directions: DirectionStability) -> FloatArray:
    """Slopes equally spaced on the axis, dense near the node-focus points, those included."""
    powers = np.geomspace(_LINEAR, _MOST, 160)
    slopes = [-powers, np.linspace(-_LINEAR, _LINEAR, 11), powers]
    for one in directions:
        for eta in (one.node_focus_unstable_eta, one.node_focus_stable_eta):
            if eta is not None:
                # Square-root branches: the nearer, the denser.
                near = np.geomspace(1e-4, 0.3, 12)
                slopes.append(eta * np.concatenate((1.0 - near, [1.0], 1.0 + near)))
    every: FloatArray = np.unique(np.concatenate(slopes))
    return every[np.abs(every) <= _MOST]


def _frame(top: Axes, bottom: Axes) -> None:
    from matplotlib.ticker import FixedLocator, NullLocator

    for axes in (top, bottom):
        axes.set_xscale("symlog", linthresh=_LINEAR, linscale=0.5)
        axes.set_xlim(-_MOST, _MOST)
        powers = [10.0**n for n in range(-2, math.floor(math.log10(_MOST)) + 1, 2)]
        axes.xaxis.set_major_locator(FixedLocator([*(-p for p in powers[::-1]), 0.0, *powers]))
        axes.xaxis.set_minor_locator(NullLocator())
        axes.axvline(0.0, color=style.GREY, linewidth=0.4, zorder=1)
    layout.zero_lines(top)
    top.set_ylim(-_GROWTH, _GROWTH)
    bottom.set_ylim(-0.08, 1.12)
    top.tick_params(axis="x", labelbottom=False)
    bottom.set_xlabel(r"slope of the actuation force $\eta$  [1]", labelpad=1.5)
    layout.ticks(top, 0, 5)
    layout.ticks(bottom, 0, 3)
