"""Pictures of sweeps: what is drawn and where, colours for every sight, and wrong datasets."""

from __future__ import annotations

import functools
import itertools

import numpy as np
import pytest
from pictures import (
    SIGHTS,
    SYSTEM,
    Pixels,
    basins_of,
    check_layout,
    close,
    data_axes,
    diagram,
    fill,
    lab,
    luminance,
    map_of,
    sweep,
    with_failures,
    words,
)

import wedgebrake as wb
from wedgebrake.dynamics.enums import MotionClass
from wedgebrake.figures.data import class_styles
from wedgebrake.figures.data.bifurcation import BifurcationDiagram
from wedgebrake.figures.data.class_map import regime_maps
from wedgebrake.figures.data.class_styles import ATTRACTOR_COLOURS, MOTIONS
from wedgebrake.figures.matplotlib import maps, style

PICTURES = {
    "diagram": lambda: wb.plot(diagram(20), exponent=True),
    "diagram, failures": lambda: wb.plot(with_failures(diagram(80)), width=style.COLUMN),
    "diagram, branches": lambda: wb.plot(diagram(300, follow="eta"), width=style.COLUMN),
    "map, bar": lambda: wb.plot(map_of(), quantity="largest_exponent", width=style.COLUMN),
    "basins": lambda: wb.plot(basins_of(6)),
    "basins, many": lambda: wb.plot(basins_of(25, 120), width=style.COLUMN),
}
SPACINGS = {
    "linear": np.linspace(0.3, 9.0, 40),
    "logarithmic": np.geomspace(0.3, 9.0, 40),
    "falling": np.linspace(9.0, 0.3, 40),
}


@functools.cache
def picture(name):
    return PICTURES[name]()


@pytest.mark.parametrize("name", PICTURES)
def test_nothing_overlaps_and_every_axis_has_its_unit(name):
    figure = picture(name)
    check_layout(figure)
    for axes in data_axes(figure):
        for label in (axes.get_xlabel(), axes.get_ylabel()):
            assert not label or "[" in label


class TestDiagram:
    @pytest.mark.parametrize("number", [1, 150, 3000])
    def test_every_point_is_drawn_where_it_is(self, number):
        """The share of a parameter's points in all cells, or marks, is 1."""
        dataset = diagram(number)
        axes = data_axes(wb.plot(dataset))[0]
        velocity = dataset["velocity"].to_numpy()
        if number < 200:
            (marks,) = axes.collections
            places, shares = marks.get_offsets(), marks.get_array()
            height = np.ptp(axes.get_ylim()) / 300.0
            for value, points in zip(dataset["eta"].to_numpy(), velocity, strict=True):
                here = places[:, 0] == value
                assert shares[here].sum() == pytest.approx(1.0)
                assert np.abs(points[:, None] - places[here, 1]).min(axis=1).max() < height
        else:
            (image,) = axes.images
            shares = np.ma.filled(image.get_array(), 0.0)
            assert shares.sum(axis=0) == pytest.approx(np.ones(shares.shape[1]))
            low, high = axes.get_ylim()
            rows = ((velocity[0] - low) / (high - low) * shares.shape[0]).astype(int)
            assert set(np.flatnonzero(shares[:, 0])) >= set(rows)

    @pytest.mark.parametrize("axis", SPACINGS)
    def test_classes_stand_below_their_parameter(self, axis):
        values = SPACINGS[axis]
        dataset = sweep(alpha=values, periods=3)
        dataset["velocity"][...] = 1.0
        fill(dataset, "motion", MotionClass.CHAOTIC, order=0, alpha=slice(8, 12))
        dataset["velocity"][{"alpha": slice(8, 12)}] = 2.0
        figure = wb.plot(dataset)
        image = Pixels(figure)
        panel, motion, _ = data_axes(figure)
        assert (panel.get_xscale() == "log") == (axis == "logarithmic")
        for place in (5, 7, 8, 11, 12, 30):
            expected = style.VERMILLION if 8 <= place < 12 else style.PALE_BLUE
            assert close(image.at(motion, values[place], 0.15), expected)
            points = image.around(panel, values[place], dataset["velocity"][place, 0], 2)
            empty = image.around(panel, values[place], 3.0 - dataset["velocity"][place, 0], 2)
            assert min(map(luminance, points)) < 0.2 < min(map(luminance, empty))

    @pytest.mark.parametrize("count", [5, 60])
    def test_limit_of_stability_lies_where_it_is(self, count):
        """The smaller of two dampings has a kink at eta = 0, beside the limit."""
        etas = np.linspace(-60.0, 12.0, count)
        dataset = wb.bifurcation(SYSTEM, eta=etas, periods=4, transient=1)
        ((limit, _),) = BifurcationDiagram.of(dataset, "velocity").limits
        assert limit == pytest.approx(wb.stability(SYSTEM).forward.hopf_eta, abs=1e-9)


@pytest.mark.parametrize("f0", [[0.03, 0.04], [3.0, 4.0]], ids=["moves", "rests"])
def test_zero_is_at_the_bottom_of_amplitudes(f0):
    system = wb.paper.system(brake="conventional", eta=0.0)
    found = wb.bifurcation(system, F0=f0, periods=60, transient=50)
    figure = wb.plot(found, quantity="response")
    for axes in figure.axes[:4]:
        low, high = axes.get_ylim()
        assert low <= 0.0 < high
        assert -low < 0.05 * high
        assert max(np.nanmax(line.get_ydata()) for line in axes.lines) < high


class TestMap:
    @pytest.mark.parametrize("axis", SPACINGS)
    def test_cells_are_where_their_parameters_are(self, axis):
        alphas, forces = SPACINGS[axis], np.linspace(0.1, 0.3, 31) ** 2
        dataset = sweep("regime_map", alpha=alphas, F0=forces)
        fill(dataset, "motion", MotionClass.CHAOTIC, order=0, alpha=7, F0=25)
        fill(dataset, "motion", MotionClass.PERIODIC, order=3, alpha=slice(20, 23), F0=2)
        figure = maps.regime_map(dataset)
        (axes,) = data_axes(figure)
        image = Pixels(figure)
        assert close(image.at(axes, alphas[7], forces[25]), style.VERMILLION)
        assert close(image.at(axes, alphas[21], forces[2]), style.GREEN)
        for place in ((6, 25), (8, 25), (7, 24), (7, 26), (21, 1), (21, 3), (18, 2), (24, 2)):
            assert close(image.at(axes, alphas[place[0]], forces[place[1]]), style.PALE_BLUE)
        assert (axes.get_xscale() == "log") == (axis == "logarithmic")

    @pytest.mark.parametrize("quantity", ["motion", "stick_class", "peak_torque"])
    def test_undecided_cells_are_hatched_whatever_is_drawn(self, quantity):
        """They have no single colour, as the cells beside them have."""
        dataset = map_of(8, 6)
        fill(dataset, "motion", MotionClass.UNDECIDED, order=0, eta=6, F0=3)
        figure = wb.plot(dataset, quantity=quantity)
        image, axes = Pixels(figure), data_axes(figure)[0]
        etas, forces = dataset["eta"].to_numpy(), dataset["F0"].to_numpy()
        assert np.ptp(image.around(axes, etas[6], forces[3], 8), axis=0).max() > 0.2
        for eta, force in ((5, 3), (7, 3), (6, 2), (6, 4)):
            assert np.ptp(image.around(axes, etas[eta], forces[force], 8), axis=0).max() < 0.01
        assert any(one.startswith("undecided, 2.1") for one in words(figure))

    @pytest.mark.parametrize("axis", ["linear", "logarithmic", "one row"])
    def test_stability_limit_is_where_the_damping_vanishes(self, axis):
        alphas = np.geomspace(0.3, 9.0, 50) if axis == "logarithmic" else np.linspace(0.3, 9.0, 50)
        forces = [0.03] if axis == "one row" else np.linspace(0.01, 0.09, 20)
        dataset = sweep("regime_map", alpha=alphas, F0=forces)
        dataset["sliding_damping"][...] = (alphas - 2.0)[:, None]
        (axes,) = data_axes(wb.plot(dataset))
        (line,) = axes.lines
        assert line.get_xdata() == pytest.approx(2.0, abs=1e-3 if axis == "logarithmic" else 1e-9)
        assert sorted(line.get_ydata()[[0, -1]]) == pytest.approx(sorted(axes.get_ylim()))

    @pytest.mark.parametrize(
        ("other", "values"),
        [("slope", np.linspace(-0.5, 0.12, 12)), ("angle", np.linspace(0.25, 0.4, 16))],
    )
    def test_stability_limit_ends_where_the_brake_locks(self, other, values):
        """Beyond tan(angle) = mu there is no forward sliding: the damping jumps, without a zero."""
        system = wb.paper.system(eta=-0.05).replace(angle=0.3)
        axes = {"kinetic": np.linspace(0.25, 0.345, 20), other: values}
        dataset = wb.regime_map(system, **axes, periods=3, transient=1)
        ((kinetic, second),) = (line.T for line in regime_maps(dataset)[0].limit)
        angle = second if other == "angle" else 0.3
        assert np.all(np.tan(angle) > kinetic)
        assert np.max(kinetic) > 0.29
        beyond = dataset.where(dataset["kinetic"] > 0.31, drop=True).astype(dataset.dtypes)
        assert other == "angle" or not regime_maps(beyond)[0].limit


class TestBasins:
    def test_colours_go_by_share(self):
        dataset = basins_of(4)
        figure = maps.basins(dataset)
        (axes,) = data_axes(figure)
        image = Pixels(figure)
        angles, numbers = dataset["initial_angle"].to_numpy(), dataset["attractor"].to_numpy()[:, 0]
        for rank, place in enumerate((3, 2, 1, 0)):
            assert close(
                image.at(axes, angles[numbers == place][0], -25.0), ATTRACTOR_COLOURS[rank]
            )
        assert words(figure)[:4] == ["3: $2T$, 30 %", "2: $2T$, 28 %", "1: $2T$, 22 %",
                                     "0: $2T$, 20 %"]  # fmt: skip
        assert [text.get_text() for text in axes.texts] == ["3", "2", "1", "0"]


class TestColours:
    """Differences of colour, CIE 1976; about 2.3 can just be noticed side by side."""

    @pytest.mark.parametrize("sight", SIGHTS)
    def test_classes_differ_for_every_sight(self, sight):
        others = class_styles.OTHER_ATTRACTORS, style.BLACK, style.DARK_GREY, "white"
        for colours in (
            [one.colour for one in MOTIONS if one.opacity == 1.0],
            [one.colour for one in class_styles.STICK_CLASSES if one.opacity == 1.0],
            [*ATTRACTOR_COLOURS, *others],
            [class_styles.orbit_colour(order) for order in (*range(1, 7), 7, 8)],
        ):
            seen = [lab(colour, sight) for colour in colours]
            assert min(np.linalg.norm(a - b) for a, b in itertools.combinations(seen, 2)) > 14.0


def test_a_sweep_over_the_inertia_of_a_driveline():
    """A dimension of this name counts the inertias of a machine; here it is the parameter."""
    values = np.linspace(0.5, 2.0, 5)
    line = wb.bifurcation(SYSTEM, inertia=values, periods=30, transient=20)
    data = BifurcationDiagram.of(line, "velocity")
    np.testing.assert_array_equal(data.x.values, values)
    np.testing.assert_array_equal(data.points[0], line["velocity"])
    grid = wb.regime_map(SYSTEM, inertia=values, damping=[0.1, 1.0], periods=30, transient=20)
    (drawn,) = regime_maps(grid, "motion")
    np.testing.assert_array_equal(drawn.x.values, values)
    for found, quantity in ((line, "velocity"), (line, "response"), (grid, "motion")):
        assert wb.plot(found, quantity=quantity).axes
