"""Pictures of sweeps: what is drawn and where, colours for every sight, and wrong datasets."""

from __future__ import annotations

import functools
import itertools
import json
import subprocess
import sys

import numpy as np
import pytest
import xarray as xr
from matplotlib.backends.backend_agg import FigureCanvasAgg
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
    png,
    sweep,
    with_failures,
    words,
)

import wedgebrake as wb
from wedgebrake.dynamics.enums import MotionClass
from wedgebrake.figures.data import caption, class_styles
from wedgebrake.figures.data.axes import SweptAxis
from wedgebrake.figures.data.basins import of_dataset as basins_data
from wedgebrake.figures.data.bifurcation import BifurcationDiagram, split
from wedgebrake.figures.data.class_map import regime_map as map_data
from wedgebrake.figures.data.class_styles import ATTRACTOR_COLOURS, CODES, MOTION_STYLES, MOTIONS
from wedgebrake.figures.data.partial import point_cloud
from wedgebrake.figures.matplotlib import bifurcation, maps, style
from wedgebrake.sweeps.results import VARIABLES, PointStatus

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


def labels(legend):
    return [entry.label for entry in legend]


def with_branches(dataset):
    both = xr.concat([dataset, dataset], dim="branch", combine_attrs="override")
    return both.assign_coords(branch=["up", "down"])


@pytest.mark.parametrize("name", PICTURES)
def test_nothing_overlaps_and_every_axis_has_its_unit(name):
    figure = picture(name)
    check_layout(figure)
    for axes in data_axes(figure):
        for label in (axes.get_xlabel(), axes.get_ylabel()):
            assert not label or "[" in label


class TestCaption:
    def test_groups_that_the_sweep_changes_are_left_out(self):
        (numbers, how) = caption.sentences(map_of(), ["eta", "F0"])
        assert r"\eta" not in numbers
        assert "F_0" not in numbers
        assert r"\alpha = 1.18" in numbers
        assert "250 periods" in how
        (numbers, _) = caption.sentences(sweep(slope=[-40.0, 0.0]), ["slope"])
        assert r"\eta" not in numbers  # it depends on the slope
        assert "F_0 = 0.036" in numbers

    def test_a_fixed_value_is_stated_with_its_unit(self):
        dataset = sweep(slope=[-40.0, 0.0], alpha=[1.1, 2.5], F0=[0.02, 0.03])
        (numbers, _) = caption.sentences(dataset.isel(slope=0, alpha=1), ["F0"])
        assert r"\alpha = 2.5" in numbers
        assert "1.18" not in numbers
        assert r"$\delta = -40$ N s/rad" in numbers
        assert r"\eta" not in numbers

    def test_the_angle_of_the_brake_is_not_that_of_the_driveline(self):
        """Swept, it is called brake_angle: alpha = tan(angle) / mu_k changes with it."""
        angles = np.array([0.3, 0.35, 0.4])
        dataset = wb.sweep(SYSTEM, angle=angles, periods=4, transient=2, follow="angle")
        (numbers, _) = caption.sentences(dataset, ["brake_angle"])
        assert r"$\alpha" not in numbers
        assert r"$\eta = -24$" in numbers
        assert [one.direction for one in split(dataset)] == [
            r"$\alpha_w$ increasing", r"$\alpha_w$ decreasing",
        ]  # fmt: skip
        assert SweptAxis.of(dataset, "brake_angle").label == r"wedge angle $\alpha_w$  [rad]"

    @pytest.mark.parametrize(("first", "absent"), [("F0", False), ("alpha", True)])
    def test_an_absent_torque_is_stated(self, first, absent):
        """Unless the amplitude, or the group that sets it, is swept."""
        dataset = map_of().rename({"F0": first}) if first != "F0" else map_of()
        dataset.attrs["system"] = json.dumps(SYSTEM.replace(amplitude=0.0).as_dict())
        del dataset.attrs["axes"]
        assert ("does not act" in caption.how(dataset, ["eta", first])) == absent


class TestDiagram:
    def test_panels(self):
        figure = wb.plot(diagram(300))
        panel, motion, sticks = data_axes(figure)
        assert panel.get_ylabel() == style.SECTION["velocity"]
        assert sticks.get_xlabel() == r"slope of the actuation force $\eta$  [1]"
        assert {text.get_text() for text in motion.texts} == {"$T$", "$2T$"}
        assert "linear stability limit" in words(figure)
        panel = data_axes(wb.plot(diagram(), quantity="angle"))[0]
        assert panel.get_ylim()[1] == pytest.approx(0.05, abs=0.005)

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

    def test_a_single_point_among_many_is_seen_on_white(self):
        dataset = diagram(400, periods=1000)
        dataset["velocity"][...] = 1.0
        dataset["velocity"][{"eta": 200, "period": 500}] = 4.0
        figure = wb.plot(dataset)
        around = Pixels(figure).around(data_axes(figure)[0], float(dataset["eta"][200]), 4.0, 3)
        darkest = min(luminance(one) for one in around)
        assert 1.05 / (darkest + 0.05) > 1.9  # contrast, WCAG 2

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

    def test_failures_are_shown(self):
        data = BifurcationDiagram.of(with_failures(diagram(80)), "velocity")
        (_, motions), _, (_, marks) = data.legends(exponent=False)
        names = "diverged", "self_locked", "limit", "invalid", "not_computed", "undecided"
        assert set(labels(motions)) >= {MOTION_STYLES[name].word for name in names}
        assert class_styles.EMPTY in [entry.style for entry in marks]
        assert -10.0 < data.low < data.high < 10.0  # diverged points do not flatten the others

    @pytest.mark.parametrize(("sign", "stable"), [(1.0, True), (-1.0, False)])
    def test_stability_limit(self, sign, stable):
        dataset = diagram(300)
        dataset["sliding_damping"][...] *= sign
        limits = BifurcationDiagram.of(dataset, "velocity").limits
        assert limits == [(pytest.approx(-10.0), stable)]
        (line,) = [o for o in data_axes(wb.plot(dataset))[0].lines if o.get_linestyle() == "--"]
        assert line.get_xdata() == pytest.approx([-10.0, -10.0])

    @pytest.mark.parametrize("count", [5, 60])
    def test_limit_of_stability_lies_where_it_is(self, count):
        """The smaller of two dampings has a kink at eta = 0, beside the limit."""
        etas = np.linspace(-60.0, 12.0, count)
        dataset = wb.bifurcation(SYSTEM, eta=etas, periods=4, transient=1)
        ((limit, _),) = BifurcationDiagram.of(dataset, "velocity").limits
        assert limit == pytest.approx(wb.stability(SYSTEM).forward.hopf_eta, abs=1e-9)

    def test_exponents(self):
        dataset = diagram(50)
        dataset["largest_exponent"][...] = np.linspace(-5.0, 2.0, 50)
        dataset["largest_exponent"][{"eta": 3}] = -np.inf
        dataset["largest_exponent"][{"eta": 40}] = -500.0
        dataset["exponent_error"][...] = 0.1
        low, high = data_axes(wb.plot(dataset))[1].get_ylim()
        assert high > 2.0
        assert -6.0 < low < -4.5  # one deep point does not hide the others
        assert len(data_axes(wb.plot(dataset, exponent=False))) == 3

    def test_branches(self):
        dataset = diagram(300, follow="eta")
        # 2T begins later on the way up: between, the branches differ.
        late = {"branch": 0, "eta": slice(150, 180)}
        fill(dataset, "motion", MotionClass.SYNCHRONOUS, order=1, **late)
        dataset["velocity"][late] = 3.0
        # The same class, other points.
        dataset["velocity"][{"branch": 1, "eta": slice(20, 30)}] = 1.5
        # The same points, in another phase of the torque.
        doubled = {"branch": 0, "eta": slice(190, 220)}
        dataset["velocity"][doubled] = dataset["velocity"][doubled].to_numpy()[:, ::-1]
        # What is undecided may be the same.
        undecided = {"branch": 0, "eta": slice(60, 70)}
        fill(dataset, "motion", MotionClass.UNDECIDED, order=0, **undecided)
        data = BifurcationDiagram.of(dataset, "velocity")
        assert list(np.flatnonzero(data.differs)) == [*range(20, 30), *range(150, 180)]
        figure = wb.plot(dataset)
        up, down, motion, _ = data_axes(figure)
        assert [up.texts[0].get_text(), down.texts[0].get_text()] == [
            r"$\eta$ increasing", r"$\eta$ decreasing",
        ]  # fmt: skip
        image, value = Pixels(figure), float(dataset["eta"][165])
        assert close(image.at(motion, value, 1.2), style.PALE_BLUE)
        assert close(image.at(motion, value, 0.2), style.BLUE)
        (chosen,) = BifurcationDiagram.of(dataset.sel(branch="down"), "velocity").branches
        assert chosen.direction == r"$\eta$ decreasing"
        assert chosen.shades == style.DENSITY_DOWN

    def test_nothing_computed(self):
        dataset = diagram(30, periods=1)
        for name, one in VARIABLES.items():
            dataset[name][...] = one.fill
        figure = bifurcation.bifurcation(dataset, exponent=True)
        figure.draw_without_rendering()
        assert words(figure) == ["not computed", "no class", "no points"]

    @pytest.mark.parametrize("values", [[0.0, 0.0, 0.0], [1.0, 1.0, 2.0]])
    def test_a_value_given_twice(self, values):
        wb.plot(diagram(values=np.array(values))).draw_without_rendering()
        data = map_data(map_of(eta=np.array(values), F0=np.array([0.02, 0.02])))
        assert CODES["chaotic"] in data.codes

    def test_points_of_the_page_are_thinned(self):
        dataset = diagram(600, periods=51)
        dataset["motion"][...] = MotionClass.CHAOTIC
        dataset["velocity"][...] = np.random.default_rng(0).normal(size=(600, 51))
        cloud = point_cloud(BifurcationDiagram.of(dataset, "velocity"), 12_000)
        assert 6_000 < cloud.points.size <= 12_000

    def test_a_resonance_does_not_flatten_the_points_of_the_page(self):
        dataset = diagram(300)
        dataset["velocity"][{"eta": slice(5, 10)}] *= 1000.0
        cloud = point_cloud(BifurcationDiagram.of(dataset, "velocity"))
        assert cloud.span[1] < 20.0
        assert cloud.outside == pytest.approx(3000.0)


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

    def test_the_first_dimension_is_to_the_right(self):
        one, turned = map_data(map_of()), map_data(map_of().transpose("F0", "eta"))
        assert (one.x.name, turned.x.name) == ("eta", "F0")
        np.testing.assert_array_equal(one.codes, turned.codes.T)

    def test_every_class_has_its_style(self):
        dataset = sweep("regime_map", eta=np.arange(16.0), F0=[0.02, 0.03])
        dataset["order"][...] = 0
        for place, (motion, order, status) in enumerate(
            [(1, 0, 1), (8, 0, 1), (9, 1, 1), (2, 1, 1), (3, 2, 1), (3, 3, 1), (3, 4, 1),
             (3, 16, 1), (4, 0, 1), (5, 0, 1), (7, 0, 3), (6, 0, 2), (0, 0, 1), (-1, 0, 5),
             (-1, 0, 6), (-1, 0, 0)]
        ):  # fmt: skip
            for name, value in (("motion", motion), ("order", order), ("status", status)):
                dataset[name][{"eta": place}] = value
        data = map_data(dataset)
        assert list(data.codes[0]) == list(range(16))
        assert [entry.style for entry in data.legend] == list(MOTIONS)
        assert all(entry.label.endswith(", 6.2 %") for entry in data.legend)
        # A run that ended early counts as such, even without a class.
        dataset["motion"][...] = MotionClass.NONE
        left = class_styles.motion_codes(dataset).to_numpy()[:, 0]
        assert left[10] == CODES["self_locked"]
        assert left[11] == CODES["diverged"]

    def test_undecided_is_hatched_and_not_computed_white(self):
        dataset = map_of()
        fill(dataset, "motion", MotionClass.UNDECIDED, order=0, eta=slice(0, 10))
        fill(dataset, "status", PointStatus.NOT_COMPUTED, eta=slice(10, 20))
        fill(dataset, "status", PointStatus.STEP_LIMIT, eta=slice(20, 30))
        dataset["sliding_damping"][...] = 1.0
        figure = maps.regime_map(dataset)
        (axes,) = data_axes(figure)
        image, values = Pixels(figure), dataset["eta"].to_numpy()
        undecided, empty, limit = (image.around(axes, values[i], 0.05) for i in (5, 15, 25))
        assert np.ptp(undecided) > 0.2
        assert np.max(undecided) > 0.99
        assert np.all(empty == 1.0)
        assert np.ptp(limit) > 0.2
        assert np.max(limit) < 0.9

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
        ((kinetic, second),) = (line.T for line in map_data(dataset).limit)
        angle = second if other == "angle" else 0.3
        assert np.all(np.tan(angle) > kinetic)
        assert np.max(kinetic) > 0.29
        beyond = dataset.where(dataset["kinetic"] > 0.31, drop=True).astype(dataset.dtypes)
        assert other == "angle" or not map_data(beyond).limit

    def test_scales_of_values(self):
        dataset = map_of()
        dataset["largest_exponent"][{"eta": slice(0, 5)}] = -np.inf
        dataset["friction_power"][{"eta": slice(5, 30)}] *= 1e4
        scale = map_data(dataset, "largest_exponent").scale
        assert scale.signed
        assert scale.low == -scale.high == pytest.approx(-3.0)
        assert scale.cut == (True, False)
        assert map_data(dataset, "friction_power").scale.log
        assert not map_data(dataset, "peak_torque").scale.log
        assert "no value, 50 %" in labels(map_data(dataset, "order").legend)
        figure = wb.plot(dataset, quantity="largest_exponent")
        assert r"$\lambda_1$  [1/s]" in figure.axes[1].get_ylabel()
        assert close(Pixels(figure).at(figure.axes[0], -60.0, 0.05), style.SIGNS[0])

    def test_values_of_all_branches_share_a_scale(self):
        dataset = with_branches(map_of())
        dataset["peak_torque"][{"branch": 1}] *= 7.0
        figure = wb.plot(dataset, quantity="peak_torque")
        norms = [a.images[0].norm for a in figure.axes if a.images and a.get_xlabel()]
        assert len(norms) == 2
        assert norms[0].vmax == norms[1].vmax
        with pytest.raises(wb.InputError, match="branches"):
            map_data(dataset)

    def test_failures_stay_in_maps_of_values(self):
        dataset = map_of()
        fill(dataset, "status", PointStatus.NOT_COMPUTED, eta=slice(0, 3))
        fill(dataset, "motion", MotionClass.DIVERGED, eta=slice(3, 6))
        dataset["peak_torque"][{"eta": slice(3, 6)}] = 1e30
        failures = ["diverged, 10 %", "not computed, 10 %"]
        data = map_data(dataset, "peak_torque")
        assert labels(data.legend)[:2] == failures
        assert data.scale.high < 100.0
        assert {data.styles[code].word for code in data.codes[0, :6]} == {
            "diverged",
            "not computed",
        }
        data = map_data(dataset, "stick_class")
        assert labels(data.legend)[:3] == ["unidirectional, 80 %", *failures]
        assert [data.styles[code].word for code in data.codes[0, [0, 4, 9]]] == [
            "not computed", "diverged", "unidirectional",
        ]  # fmt: skip
        dataset["peak_torque"][...] = np.nan
        wb.plot(dataset, quantity="peak_torque").draw_without_rendering()


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

    def test_only_points_inside_are_marked(self):
        dataset = basins_of(3)
        assert all(one.points[:, 1] == [5.0] for one in basins_data(dataset).marks)
        dataset["attractor_velocity"][...] = 99.0
        assert not any(one.points.size for one in basins_data(dataset).marks)
        assert not data_axes(maps.basins(dataset))[0].texts

    def test_beyond_twenty_they_are_others(self):
        dataset = basins_of(25, 300)
        ranking = np.argsort(-dataset["attractor_share"].to_numpy(), kind="stable")
        data = basins_data(dataset)
        assert [int(one.label) for one in data.marks] == list(ranking[:20])
        assert labels(data.legend)[20].startswith("5 others")

    def test_numbers_do_not_touch(self):
        """Attractors in one place: their numbers are moved apart."""
        dataset = basins_of(8)
        dataset["attractor_angle"][...] = 0.1 + 0.002 * np.arange(8)[:, None]
        figure = maps.basins(dataset)
        renderer = FigureCanvasAgg(figure).get_renderer()
        figure.draw(renderer)
        texts = data_axes(figure)[0].texts
        # An annotation's own extent takes in its line.
        boxes = [super(type(text), text).get_window_extent(renderer) for text in texts]
        assert len(boxes) == 8
        # The extent of digits has room for others' ascents and descents.
        for one, other in itertools.combinations(boxes, 2):
            across = min(one.x1, other.x1) - max(one.x0, other.x0)
            up = min(one.y1, other.y1) - max(one.y0, other.y0)
            assert across <= 0.0 or up <= 0.34 * one.height

    def test_outcomes_without_an_attractor(self):
        dataset = basins_of(2)
        for place, code in enumerate((-1, -2, -3, -4)):
            dataset["attractor"][{"initial_angle": place}] = code
        data = basins_data(dataset)
        found = [data.styles[code].word for code in data.codes[0, :4]]
        assert found == ["undecided", "diverged", "self-locked", "not computed"]
        dataset["attractor"][...] = -1
        empty = basins_data(dataset.isel(attractor_id=slice(0, 0)))
        assert labels(empty.legend) == ["undecided, 100 %"]

    def test_motions_in_words(self):
        dataset = basins_of(6, 200)
        for place, motion in enumerate((1, 2, 3, 4, 5, 0)):
            dataset["attractor_kind"][{"attractor_id": 5 - place}] = motion
        assert [one.word.split(": ")[1] for one in basins_data(dataset).styles[:6]] == [
            "at rest", "synchronous ($T$)", "$2T$", "quasi-periodic", "chaotic", "undecided",
        ]  # fmt: skip


class TestDatasets:
    def test_the_picture_follows_the_dataset(self):
        for dataset, name in (
            (diagram(), "T"), (map_of(), "chaotic, 50 %"), (basins_of(3), "2: $2T$"),
            (sweep(eta=[0.0, 1.0], F0=[0.1, 0.2], alpha=[1.1, 1.2]).isel(alpha=0), ", 100 %"),
        ):  # fmt: skip
            assert any(name in word for word in words(wb.plot(dataset)))
        assert wb.plot(map_of().assign_attrs(kind="sweep")).get_suptitle()

    @pytest.mark.parametrize(
        ("call", "argument"),
        [
            (lambda: wb.plot(xr.Dataset({"motion": ("eta", [1])})), "dataset"),
            (lambda: wb.plot(3), "dataset"),
            (lambda: wb.plot(map_of(), quantiti="motion"), "quantiti"),
            (lambda: wb.plot(sweep(eta=[0.0], F0=[0.1], alpha=[1.1])), "dataset"),
            (lambda: maps.regime_map(sweep(eta=[0.0], F0=[0.1], alpha=[1.1])), "dataset"),
            (lambda: bifurcation.bifurcation(map_of()), "dataset.*regime_map"),
            (lambda: maps.regime_map(diagram()), "dataset.*bifurcation"),
            (lambda: maps.basins(xr.Dataset()), "dataset"),
            (lambda: bifurcation.bifurcation(diagram(), "velocit"), "quantity.*'velocity'"),
            (lambda: maps.regime_map(map_of(), "peak_torqe"), "quantity.*'peak_torque'"),
            (lambda: maps.regime_map(map_of(), "status"), "quantity"),
            (lambda: maps.regime_map(map_of(), "eta"), "quantity"),
            (lambda: wb.plot(map_of().isel(F0=0)), "velocity over period"),
            (lambda: maps.basins(map_of()), "no attractor"),
            (lambda: maps.basins(basins_of(2).rename(initial_angle="eta")), "eta"),
            (lambda: wb.plot(map_of().assign_coords(eta=[f"v{i}" for i in range(30)])), "eta"),
        ],
    )
    def test_wrong_ones_are_refused(self, call, argument):
        with pytest.raises(wb.InputError, match=argument):
            call()


class TestColours:
    """Differences of colour, CIE 1976; about 2.3 can just be noticed side by side."""

    @pytest.mark.parametrize("sight", SIGHTS)
    def test_classes_differ_for_every_sight(self, sight):
        others = class_styles.OTHER_ATTRACTORS, style.BLACK, style.DARK_GREY, "white"
        for colours in (
            [one.colour for one in MOTIONS if one.opacity == 1.0],
            [one.colour for one in class_styles.STICK_CLASSES if one.opacity == 1.0],
            [*ATTRACTOR_COLOURS, *others],
            class_styles.ORBIT_COLOURS,
        ):
            seen = [lab(colour, sight) for colour in colours]
            assert min(np.linalg.norm(a - b) for a, b in itertools.combinations(seen, 2)) > 14.0

    @pytest.mark.parametrize("sight", SIGHTS)
    def test_density_darkens_steadily_and_signs_differ(self, sight):
        for scale in (style.DENSITY, style.DENSITY_DOWN):
            lightness = [lab(colour, sight)[0] for colour in scale]
            assert all(a - b > 12.0 for a, b in itertools.pairwise(lightness))
        low, cold, middle, warm, high = (lab(colour, sight) for colour in style.SIGNS)
        assert np.linalg.norm(cold - warm) > 40.0
        assert low[0] < cold[0] < middle[0] > warm[0] > high[0]

    @pytest.mark.parametrize("sight", SIGHTS)
    def test_orbits_differ_from_points_beneath(self, sight):
        seen, greys = (
            [lab(colour, sight) for colour in colours]
            for colours in (class_styles.ORBIT_COLOURS, style.DENSITY_BENEATH)
        )
        assert min(np.linalg.norm(a - b) for a in seen for b in greys) > 14.0

    def test_text_can_be_read_and_points_be_seen(self):
        assert all(1.05 / (luminance(one) + 0.05) > 3.0 for one in class_styles.ORBIT_COLOURS)
        for one in MOTIONS:
            paper, ink = luminance(one.colour), luminance(style.ink(one.colour))
            assert (max(paper, ink) + 0.05) / (min(paper, ink) + 0.05) > 3.8  # WCAG 2
            assert luminance(one.on_white) <= 0.43
        assert MOTION_STYLES["chaotic"].on_white == MOTION_STYLES["chaotic"].colour


class TestStyle:
    @pytest.mark.parametrize(
        "ends", [(0.33, 8.6), (1e-6, 1e6), (1.1, 1.3), (20.0, 90.0), (1003.0, 1013.0)]
    )
    def test_ticks_of_logarithmic_axes(self, ends):
        axes = style.new_figure().add_subplot()
        axes.set_xscale("log")
        axes.set_xlim(*ends)
        style.round_ticks(axes.xaxis, *ends)
        ticks = [tick for tick in axes.get_xticks() if ends[0] <= tick <= ends[1]]
        assert 2 <= len(ticks) <= 9
        for tick, label in zip(axes.get_xticks(), axes.get_xticklabels(), strict=True):
            assert label.get_text() == f"${style.number(tick)}$"


def test_pyplot_stays_out_and_matplotlib_waits(tmp_path):
    """In a process of its own, which is given what it draws."""
    program = f"""
import json, sys
import wedgebrake as wb
from wedgebrake.figures.matplotlib import bifurcation, maps, motion, orbit_branches, save, style
assert "matplotlib" not in sys.modules and "xarray" not in sys.modules
import xarray
for one in json.load(sys.stdin):
    wb.plot(xarray.Dataset.from_dict(one))
system = wb.paper.system()
save.save(motion.overview(system, wb.simulate(system, periods=5)), {str(tmp_path / "a.png")!r})
assert "matplotlib.pyplot" not in sys.modules
"""
    given = json.dumps([one.to_dict() for one in (diagram(7), map_of(4, 3), basins_of(2, 8))])
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", program],
        input=given, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert png(tmp_path / "a.png") == (1600, 1200)
