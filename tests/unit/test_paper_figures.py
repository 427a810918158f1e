"""The paper's figures: each is drawn, says how, shows what was computed, and can be read."""

from __future__ import annotations

import itertools
import math
from functools import cache

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from wedgebrake.figures.matplotlib import style
from wedgebrake.paper.diagrams import PLANS, diagram
from wedgebrake.paper.figures import FIGURES, draw
from wedgebrake.paper.laboratory import METHOD_WORDS, Laboratory

MU, TAN = 0.30, math.tan(0.34)  # of the paper's brake


@pytest.fixture(scope="module")
def exact():
    with Laboratory("exact") as laboratory:
        yield laboratory


@pytest.fixture(scope="module")
def drawn(exact):
    """A figure by name, each drawn once."""
    return cache(lambda name: draw(name, exact))


def words(figure: Figure) -> str:
    """All words in a figure, in one line."""
    texts = [figure.get_suptitle(), *(t.get_text() for a in figure.axes for t in a.texts)]
    return " ".join(" ".join(texts).split())


def points(axes, marker: str) -> np.ndarray:
    """(n, 2) places of a marker."""
    found = [line.get_xydata() for line in axes.lines if line.get_marker() == marker]
    return np.concatenate(found)


def check_legible(figure: Figure) -> None:
    """No words outside the figure, no tick labels that touch; drawn without a warning."""
    with style.use():
        canvas = FigureCanvasAgg(figure)
        canvas.draw()
        renderer = canvas.get_renderer()
        inside = figure.bbox.padded(1.0)
        for axes in filter(lambda one: one.axison, figure.axes):
            box = axes.get_tightbbox(renderer)
            assert inside.x0 <= box.x0 <= box.x1 <= inside.x1, axes.get_xlabel()
            assert inside.y0 <= box.y0 <= box.y1 <= inside.y1, axes.get_xlabel()
            for axis in (axes.xaxis, axes.yaxis):
                labels = [t.label1 for t in axis.get_major_ticks() if t.label1.get_visible()]
                boxes = [one.get_window_extent(renderer) for one in labels if one.get_text()]
                for one, other in itertools.pairwise(boxes):
                    assert not one.overlaps(other), [label.get_text() for label in labels]
        title = figure._suptitle.get_window_extent(renderer)
        assert inside.x1 >= title.x1
        assert title.y0 >= max(axes.get_position().y1 for axes in figure.axes) * figure.bbox.y1


# Those of the conventional brake are laid out as those of the wedge before them.
TWINS = ("fig10", "fig13", "fig16")


@pytest.mark.parametrize(
    "name", [pytest.param(n, marks=pytest.mark.slow if n in TWINS else ()) for n in FIGURES]
)
def test_every_figure_is_drawn_legible_and_states_its_machine(name, drawn):
    figure = drawn(name)
    check_legible(figure)
    title = figure.get_suptitle()
    assert title.startswith(f"Figure {FIGURES[name].number}.")
    if name not in ("fig1", "fig2", "fig3", "fig4", "fig19"):  # of these nothing is run
        assert METHOD_WORDS["exact"] in title
        assert r"$\mu_s$ = 0.3," in title


def test_smooth_friction_with_the_exact_solution_beside_it():
    with Laboratory("smooth") as laboratory:
        figure = draw("fig7", laboratory)
    check_legible(figure)
    title = " ".join(figure.get_suptitle().split())
    assert METHOD_WORDS["smooth"] in title
    assert METHOD_WORDS["exact"] in title
    # Without sticks both are the same motion.
    blue, orange = (
        next(line.get_ydata() for line in figure.axes[1].lines if line.get_color() == colour)
        for colour in (style.MOTION, style.ORANGE)
    )
    assert np.max(np.abs(blue - orange)) < 0.05 * np.ptp(blue)


def test_critical_slopes(drawn):
    left, right = drawn("fig2").axes
    marks = [line.get_xdata()[0] for line in left.lines[:4]]
    assert marks == pytest.approx([MU * (1.0 - 1.18), -MU * (1.0 + 1.18), -1.0, -1.0])
    curves = {line.get_label(): line for line in right.lines}
    for kinetic in (0.2, 0.3, 0.4):
        angles, critical = curves[rf"$\mu_k = {kinetic:g}$"].get_data()
        assert critical == pytest.approx(kinetic - np.tan(angles))


def test_bifurcation_points_of_the_eigenvalues(drawn):
    widths = {+1: [0.009, 0.063, 0.729, 1.0], -1: [0.609, 0.663, 1.329, 1.0]}
    for axes, side in zip(drawn("fig3").axes[:2], widths, strict=True):
        hopf = points(axes, "D")
        assert np.sort(hopf[:, 0]) == pytest.approx(np.sort(-np.array(widths[side])))
        assert np.all(hopf[:, 1] == 0.0)
        nodes = [d * (-1.0 + turn) for d in widths[side] for turn in (200.0, -200.0)]
        assert np.sort(points(axes, "o")[:, 0]) == pytest.approx(np.sort(nodes))
        for line in axes.lines:
            if line.get_label().startswith("wedge"):
                # Where it oscillates the real part is a straight line in the slope.
                eta, sigma = line.get_data()
                middle = np.abs(eta) < 1.0
                assert np.ptp(np.diff(sigma[middle]) / np.diff(eta[middle])) < 1e-6


def test_ratios_of_the_friction_forces(drawn):
    figure = drawn("fig4")
    assert "5.58" in words(figure)
    assert "-0.46" in words(figure)
    speed, ratio = figure.axes[1].lines[0].get_data()
    assert ratio[speed > 0.1] == pytest.approx(MU / (TAN - MU))
    assert ratio[speed < -0.1] == pytest.approx(-MU / (TAN + MU))


@pytest.mark.parametrize("name", PLANS)
def test_diagrams_show_all_points_and_the_stated_limits(name, exact, drawn):
    plan = PLANS[name]
    axes = drawn(f"fig{name.rstrip('ab')}").axes[name.endswith("b")]
    shown = diagram(exact, plan.base, plan.name, plan.values())
    expected = [
        (value, velocity)
        for value, one in zip(shown.values, shown.columns, strict=True)
        for velocity in one.velocity
    ]
    assert np.array_equal(points(axes, "o"), np.array(expected))
    dashed = [line.get_xdata()[0] for line in axes.lines if line.get_linestyle() == "--"]
    assert dashed == list(plan.limits)
    low, high = axes.get_ylim()
    assert low < min(v for _, v in expected)
    assert high > max(v for _, v in expected)


def test_poincare_maps_are_those_of_the_laboratory(exact, drawn):
    figure = drawn("fig10")
    steady = exact.steady(PLANS["8b"].base.at(eta=-6.0))
    shown = points(figure.axes[2], "o")
    assert np.array_equal(shown, np.column_stack((steady.angle, steady.velocity)))
    # The section at 20 s + n/f_e lies in the portrait's 5 s.
    angle, velocity = figure.axes[0].lines[1].get_data()
    assert np.ptp(angle) > np.ptp(shown[:, 0])
    assert velocity.min() <= shown[:, 1].min() <= shown[:, 1].max() <= velocity.max()
