"""Eigenvalues of sliding over the slope of the actuation force."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wedgebrake.analysis.linear_stability import DirectionStability, stability
from wedgebrake.figures.matplotlib import style
from wedgebrake.model.paper_machines import AS_PRINTED, CONVENTIONAL, Case
from wedgebrake.paper.figures import layout

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from wedgebrake.paper.laboratory import Laboratory

FloatArray = NDArray[np.float64]

_CASES = (
    (Case(eta=0.0, alpha=1.03), r"wedge, $\alpha = 1.03$", style.VERMILLION),
    (Case(eta=0.0, alpha=1.21), r"wedge, $\alpha = 1.21$", style.MOTION),
    (Case(eta=0.0, alpha=3.43), r"wedge, $\alpha = 3.43$", style.GREEN),
    (Case(eta=0.0, brake=CONVENTIONAL), "conventional", style.BLACK),
)
_MOST, _LINEAR = 400.0, 0.005
_GROWTH = 250.0
_NODE: dict[str, Any] = {"marker": "o", "markersize": 3.4, "markerfacecolor": "white", "zorder": 4}
_HOPF: dict[str, Any] = {"marker": "D", "markersize": 3.0, "zorder": 4}


def draw(_laboratory: Laboratory) -> Figure:
    """Real and imaginary parts in both directions, with the bifurcation points; no run."""
    figure, panels = layout.sheet(
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
        across=0.42,
        between=0.1,
    )
    for case, label, colour in _CASES:
        _curves(panels, case, label, colour)
    for column, words in enumerate((r"(a) $\dot\theta > 0$", r"(b) $\dot\theta < 0$")):
        layout.head(panels[0][column], words)
        _frame(panels[0][column], panels[1][column])
    panels[0][0].set_ylabel(r"real part $\sigma$  [1/s]", labelpad=1.0)
    panels[1][0].set_ylabel(r"$\Omega = \omega/\omega_n$  [1]", labelpad=1.0)
    figure.legend(
        *panels[0][0].get_legend_handles_labels(),
        loc="lower right",
        ncols=len(_CASES),
        bbox_to_anchor=(0.985, panels[0][0].get_position().y1 + 0.055),
    )
    return figure


def _curves(panels: list[list[Axes]], case: Case, label: str, colour: str) -> None:
    """Both directions of one brake."""
    system = AS_PRINTED.system(case, "coulomb")
    points = stability(system)
    slopes = _slopes([points.forward, points.backward])
    found = [stability(system.replace(eta=float(eta))) for eta in slopes]
    natural = system.driveline.natural_frequency
    for column, side in enumerate(("forward", "backward")):
        values = np.array([getattr(one, side).eigenvalues for one in found])
        top, bottom = panels[0][column], panels[1][column]
        top.plot(slopes, values.real[:, 0], color=colour, label=label)
        top.plot(slopes, values.real[:, 1], color=colour)
        bottom.plot(slopes, np.abs(values.imag[:, 0]) / natural, color=colour)
        one: DirectionStability = getattr(points, side)
        nodes = np.array([one.node_focus_unstable_eta, one.node_focus_stable_eta], dtype=float)
        hopf = np.array([one.hopf_eta], dtype=float)
        for axes, levels in ((top, (natural, -natural)), (bottom, (0.0, 0.0))):
            axes.plot(nodes, levels, color=colour, linestyle="none", **_NODE)
        for axes, level in ((top, 0.0), (bottom, 1.0)):
            axes.plot(hopf, [level], color=colour, linestyle="none", **_HOPF)


def _slopes(directions: list[DirectionStability]) -> FloatArray:
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
    """Scales, and the lines at zero."""
    from matplotlib.ticker import FixedLocator, NullLocator

    for axes in (top, bottom):
        axes.set_xscale("symlog", linthresh=_LINEAR, linscale=0.5)
        axes.set_xlim(-_MOST, _MOST)
        powers = [10.0**n for n in range(-2, math.floor(math.log10(_MOST)) + 1, 2)]
        axes.xaxis.set_major_locator(FixedLocator([*(-p for p in powers[::-1]), 0.0, *powers]))
        axes.xaxis.set_minor_locator(NullLocator())
        axes.axvline(0.0, color=style.GREY, linewidth=0.4, zorder=1)
    top.axhline(0.0, color=style.GREY, linewidth=0.4, zorder=1)
    top.set_ylim(-_GROWTH, _GROWTH)
    bottom.set_ylim(-0.08, 1.12)
    layout.bare(top)
    bottom.set_xlabel(r"slope of the actuation force $\eta$  [1]", labelpad=1.5)
    layout.ticks(top, 0, 5)
    layout.ticks(bottom, 0, 3)
