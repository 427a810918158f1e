"""Pictures of sweeps: what is drawn and where, colours for every sight, and wrong datasets."""

from __future__ import annotations

import functools
import itertools
import json
import math
import subprocess
import sys
import time

import numpy as np
import pytest
import xarray as xr
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import PathCollection, QuadMesh
from matplotlib.colors import to_rgb

import wedgebrake as wb
from wedgebrake.dynamics.enums import MotionClass, StickClass
from wedgebrake.figures.matplotlib import basins, bifurcation, class_styles, regime, style
from wedgebrake.figures.matplotlib.draw import plot
from wedgebrake.figures.matplotlib.layout import caption_lines
from wedgebrake.figures.matplotlib.save import save
from wedgebrake.sweeps.results import VARIABLES, PointStatus

SYSTEM = wb.paper.system()
COORDINATES = {
    "eta": ("1", "slope of the actuation force, delta R mu_k / c"),
    "F0": ("1", "initial actuation force"),
    "alpha": ("1", "tan(wedge angle) / mu_k"),
    "slope": ("N s/rad", "slope of the actuation force against speed"),
    "initial_angle": ("rad", "angle at the start"),
    "initial_velocity": ("rad/s", "velocity at the start"),
}


def sweep(kind="sweep", *, periods=None, follow=None, **axes):
    """A dataset in the format of sweeps: completed, synchronous, without numbers."""
    branches = ["up", "down"] if follow else []
    shape = tuple(len(one) for one in ([branches] if follow else []) + list(axes.values()))
    dims = (("branch",) if follow else ()) + tuple(axes)
    coordinates = {
        name: (name, np.asarray(values, dtype=float),
               dict(zip(("units", "long_name"), COORDINATES[name], strict=True)))
        for name, values in axes.items()
    }  # fmt: skip
    if follow:
        coordinates["branch"] = ("branch", branches)
    if periods:
        coordinates["period"] = ("period", np.arange(200, 200 + periods))
    data = {}
    for name, one in VARIABLES.items():
        if one.per_period and not periods:
            continue
        size = (*shape, periods) if one.per_period else shape
        names = (*dims, "period") if one.per_period else dims
        data[name] = (names, np.full(size, one.fill, dtype=one.dtype), one.attributes())
    dataset = xr.Dataset(data, coords=coordinates)
    for name, value in {
        "status": PointStatus.COMPLETED,
        "motion": MotionClass.SYNCHRONOUS,
        "order": 1,
        "stick_class": StickClass.UNIDIRECTIONAL,
        "sliding_damping": 1.0,
    }.items():
        dataset[name][...] = value
    protocol = {"periods": 250, "transient": 200, "initial": [0.0, 0.0], "follow": follow}
    dataset.attrs = {
        "kind": kind,
        "method": "exact",
        "system": json.dumps(SYSTEM.as_dict()),
        "groups": json.dumps(SYSTEM.groups.as_dict()),
        "protocol": json.dumps(protocol),
        "axes": json.dumps(list(axes)),
    }
    return dataset


def fill(dataset, name, values, *, order=None, **at):
    """Set a variable at some places, and the order with it."""
    dataset[name][at] = values
    if order is not None:
        dataset["order"][at] = order
    return dataset


def diagram(number=60, periods=20, values=None, **more):
    """A period doubling at the middle, chaos in the last quarter."""
    values = np.linspace(-60.0, 12.0, number) if values is None else values
    dataset = sweep("bifurcation", eta=values, periods=periods, **more)
    share = np.linspace(0.0, 1.0, len(values))
    sign = np.where(np.arange(periods) % 2, 1.0, -1.0)
    width = np.sqrt(np.clip(share - 0.5, 0.0, None))
    points = 3.0 + width[:, None] * sign
    chaos = share > 0.75
    rng = np.random.default_rng(1)
    points[chaos] = rng.uniform(1.0, 5.0, (np.count_nonzero(chaos), periods))
    dataset["velocity"][...] = points
    dataset["angle"][...] = 0.01 * points
    doubled = (share > 0.5) & ~chaos
    fill(dataset, "motion", MotionClass.PERIODIC, order=2, eta=doubled)
    fill(dataset, "motion", MotionClass.CHAOTIC, order=0, eta=chaos)
    dataset["sliding_damping"][...] = values + 10.0
    return dataset


def with_failures(dataset):
    """Runs that ended in every other way, five points each."""
    ends = (
        (PointStatus.DIVERGED, MotionClass.DIVERGED),
        (PointStatus.NO_FORWARD_SOLUTION, MotionClass.SELF_LOCKED),
        (PointStatus.EVENT_LIMIT, MotionClass.NONE),
        (PointStatus.INVALID, MotionClass.NONE),
        (PointStatus.NOT_COMPUTED, MotionClass.NONE),
        (PointStatus.COMPLETED, MotionClass.UNDECIDED),
    )
    for place, (status, motion) in enumerate(ends):
        at = {"eta": slice(5 * place, 5 * place + 5)}
        fill(dataset, "status", status, **at)
        fill(dataset, "motion", motion, order=0, **at)
        dataset["stick_class"][at] = StickClass.NONE
        if motion != MotionClass.UNDECIDED:
            dataset["velocity"][at] = np.nan
    dataset["velocity"][{"eta": slice(0, 5), "period": 0}] = 1e6
    return dataset


def map_of(x=30, y=20, **axes):
    """Chaotic to the right of the middle, 2T below it in the left half."""
    axes = axes or {"eta": np.linspace(-60.0, 12.0, x), "F0": np.linspace(0.01, 0.09, y)}
    dataset = sweep("regime_map", **axes)
    (first, xs), (second, ys) = ((name, np.asarray(values)) for name, values in axes.items())
    low, right = np.arange(ys.size) < ys.size // 2, np.arange(xs.size) >= xs.size // 2
    fill(dataset, "motion", MotionClass.PERIODIC, order=2, **{second: low})
    fill(dataset, "motion", MotionClass.CHAOTIC, order=0, **{first: right})
    dataset["peak_torque"][...] = 10.0 + xs[:, None] + 0.0 * ys
    dataset["friction_power"][...] = 1.0 + 0.0 * xs[:, None] + ys
    dataset["stick_share"][...] = 0.25
    dataset["largest_exponent"][...] = np.linspace(-1.0, 3.0, xs.size)[:, None] + 0.0 * ys
    dataset["sliding_damping"][...] = (xs - xs[0] - 0.3 * np.ptp(xs))[:, None] + 0.0 * ys
    return dataset


def basins_of(count, size=40):
    """As many attractors, in stripes of falling width; 2T, one point outside the window."""
    angles, velocities = np.linspace(-0.4, 0.4, size), np.linspace(-30.0, 30.0, size - 5)
    dataset = sweep("basins", initial_angle=angles, initial_velocity=velocities)
    weight = np.arange(2 * count, count, -1)
    edges = np.round(np.cumsum(weight) / weight.sum() * size).astype(int)
    # Numbered backwards, so that the ranking has something to do.
    number = count - 1 - np.searchsorted(edges, np.arange(size), side="right")
    stripes = np.repeat(number[:, None], size - 5, axis=1).astype(np.int32)
    where = ("initial_angle", "initial_velocity")
    dataset["attractor"] = where, stripes
    shares = np.array([np.mean(stripes == place) for place in range(count)])
    dataset["attractor_motion"] = "attractor_id", np.full(count, MotionClass.PERIODIC, np.int8)
    dataset["attractor_order"] = "attractor_id", np.full(count, 2, np.int32)
    dataset["attractor_share"] = "attractor_id", shares
    middle = [angles[number == place].mean() if shares[place] else 9.0 for place in range(count)]
    orbit = ("attractor_id", "orbit_point")
    dataset["attractor_angle"] = orbit, np.array([[a, a, np.nan] for a in middle])
    dataset["attractor_velocity"] = orbit, np.tile([5.0, 99.0, np.nan], (count, 1))
    return dataset


def words(figure):
    """Texts of all legends, row by row."""
    found = []
    for legend in (axes.get_legend() for axes in figure.axes):
        if legend:
            texts = [text.get_text() for text in legend.get_texts()]
            columns = np.array_split(texts, legend._ncols)
            rows = itertools.zip_longest(*columns)
            found += [str(word) for row in rows for word in row if word is not None]
    return found


def data_axes(figure):
    return [axes for axes in figure.axes if axes.axison]


class Pixels:
    """Colours of a figure as it is drawn."""

    def __init__(self, figure, dpi=200):
        figure.set_dpi(dpi)
        canvas = FigureCanvasAgg(figure)
        canvas.draw()
        self.image = np.asarray(canvas.buffer_rgba())[..., :3] / 255.0

    def at(self, axes, x, y):
        across, up = axes.transData.transform((x, y))
        return tuple(self.image[self.image.shape[0] - 1 - int(up), int(across)])

    def around(self, axes, x, y, half=15):
        across, up = (int(v) for v in axes.transData.transform((x, y)))
        row = self.image.shape[0] - 1 - up
        return self.image[row - half : row + half, across - half : across + half].reshape(-1, 3)


def close(one, other):
    return np.max(np.abs(np.subtract(one, to_rgb(other)))) < 0.01


PICTURES = {
    "diagram": lambda: bifurcation.bifurcation(diagram(300)),
    "diagram, column": lambda: bifurcation.bifurcation(diagram(300), width=style.COLUMN),
    "diagram, few": lambda: bifurcation.bifurcation(diagram(20), exponent=True),
    "diagram, failures": lambda: bifurcation.bifurcation(
        with_failures(diagram(80)), width=style.COLUMN
    ),
    "diagram, branches": lambda: bifurcation.bifurcation(
        diagram(300, follow="eta"), width=style.COLUMN, exponent=True
    ),
    "map": lambda: regime.regime_map(map_of()),
    "map, page": lambda: regime.regime_map(map_of(), width=style.PAGE),
    "map, bar": lambda: regime.regime_map(map_of(), "largest_exponent"),
    "basins": lambda: basins.basins(basins_of(6)),
    "basins, many": lambda: basins.basins(basins_of(25, 120)),
}


@functools.cache
def picture(name):
    return PICTURES[name]()


@pytest.fixture(scope="module")
def response():
    return wb.simulate(SYSTEM, periods=20)


@pytest.mark.parametrize("name", PICTURES)
def test_nothing_overlaps_and_nothing_is_cut(name):
    check_layout(picture(name))


def check_layout(figure):
    """Caption, panels, legends and labels of ticks are apart, and all is on the page."""
    renderer = FigureCanvasAgg(figure).get_renderer()
    figure.draw(renderer)
    page = figure.bbox
    panels = [axes.get_window_extent(renderer) for axes in data_axes(figure)]
    lowest = min(axes.get_tightbbox(renderer).y0 for axes in data_axes(figure))
    title = figure._suptitle.get_window_extent(renderer)
    assert title.x1 <= page.x1
    assert title.y0 >= max(panel.y1 for panel in panels)
    assert title.y1 <= page.y1
    legends = [a.get_legend().get_window_extent(renderer) for a in figure.axes if a.get_legend()]
    assert legends
    for box in legends:
        assert box.y1 <= lowest + 1.0
        assert box.y0 >= page.y0
        assert box.x1 <= page.x1
    for upper, lower in itertools.pairwise(sorted(legends, key=lambda box: -box.y0)):
        assert lower.y1 <= upper.y0
    for axes in data_axes(figure):
        box = axes.get_tightbbox(renderer)
        assert page.x0 <= box.x0
        assert box.x1 <= page.x1 + 1.0
        inside = axes.get_window_extent(renderer).padded(1.0)
        for axis in (axes.xaxis, axes.yaxis):
            boxes = [
                label.get_window_extent(renderer)
                for label in axis.get_ticklabels()
                if label.get_visible() and label.get_text()
            ]
            middle = [0.5 * (box.min + box.max) for box in boxes]
            along = 0 if axis is axes.xaxis else 1
            boxes = [
                box
                for box, place in zip(boxes, middle, strict=True)
                if inside.min[along] <= place[along] <= inside.max[along]
            ]
            for one, other in itertools.combinations(boxes, 2):
                assert not one.overlaps(other)


@pytest.mark.parametrize("name", PICTURES)
def test_every_figure_says_what_was_computed_and_every_axis_its_unit(name):
    figure = picture(name)
    said = figure.get_suptitle()
    for part in ("Wedge brake, Coulomb friction", "$f = 0.63$", "Exact solution", "250 periods"):
        assert part in said.replace("\n", " ")
    strips = [axes for axes in data_axes(figure) if not axes.get_xlabel() and not axes.get_ylabel()]
    for axes in data_axes(figure):
        for label in (axes.get_xlabel(), axes.get_ylabel()):
            assert not label or ("[" in label and "]" in label)
    assert len(strips) <= 1  # of the two strips one carries the parameter's label
    assert any("[" in axes.get_xlabel() for axes in data_axes(figure))


class TestCaption:
    def test_groups_that_the_sweep_changes_are_left_out(self):
        said = plot(map_of()).get_suptitle()
        assert r"\eta" not in said
        assert "F_0" not in said
        assert r"\alpha = 1.18" in said
        dataset = sweep(slope=[-40.0, 0.0], periods=3)
        dataset["velocity"][...] = 1.0
        figure = plot(dataset)
        assert r"\eta" not in figure.get_suptitle()  # it depends on the slope
        assert "F_0 = 0.036" in figure.get_suptitle()
        labels = [axes.get_xlabel() for axes in figure.axes if axes.get_xlabel()]
        assert labels == [r"slope of the actuation force against speed $\delta$  [N s/rad]"]

    def test_a_value_that_was_chosen_is_told(self):
        dataset = xr.concat(
            [diagram(9).assign_coords(alpha=value) for value in (1.1, 2.5)], dim="alpha"
        )
        said = plot(dataset.isel(alpha=1)).get_suptitle()
        assert r"\alpha = 2.5" in said
        assert "1.18" not in said

    def test_a_chosen_si_value_has_its_unit(self):
        dataset = sweep(slope=[-40.0, 0.0], F0=[0.02, 0.03]).isel(slope=0)
        dataset["velocity"] = dataset["motion"].expand_dims(period=3, axis=1).astype(float)
        said = plot(dataset).get_suptitle()
        assert r"$\delta = -40$ N s/rad" in said
        assert r"\eta" not in said

    def test_the_angle_of_the_brake_is_not_that_of_the_driveline(self):
        """Swept, it is called brake_angle: alpha = tan(angle) / mu_k changes with it."""
        angles = np.array([0.3, 0.35, 0.4])
        dataset = wb.sweep(SYSTEM, angle=angles, periods=4, transient=2, follow="angle")
        figure = plot(dataset)
        assert r"$\alpha" not in figure.get_suptitle()
        assert r"$\eta = -24$" in figure.get_suptitle()
        assert [axes.texts[0].get_text() for axes in data_axes(figure)[:2]] == [
            r"$\alpha_w$ increasing", r"$\alpha_w$ decreasing",
        ]  # fmt: skip
        assert r"wedge angle $\alpha_w$  [rad]" in {a.get_xlabel() for a in figure.axes}
        figure = plot(map_of().assign(angle=lambda one: one["stick_share"]), quantity="angle")
        assert r"$\theta$" in figure.axes[1].get_ylabel()

    def test_parts_of_ones_own(self):
        law = wb.CustomFriction(law=lambda speed: 0.3 * math.tanh(speed / 0.01), width=0.01)
        system = SYSTEM.replace(friction=law)
        dataset = map_of().assign_attrs(system=json.dumps(system.as_dict()))
        assert "Wedge brake, custom friction: " in plot(dataset).get_suptitle()

    def test_a_torque_that_does_not_act_is_told(self):
        dataset = map_of()
        dataset.attrs["system"] = json.dumps(SYSTEM.replace(amplitude=0.0).as_dict())
        del dataset.attrs["axes"]
        for names, told in (
            ({}, False),  # F0 sets the amplitude
            ({"F0": "alpha"}, True),
            ({"F0": "amplitude"}, False),
        ):
            said = plot(dataset.rename(names)).get_suptitle().replace("\n", " ")
            assert ("250 periods of a torque that does not act, the first" in said) == told

    def test_protocol(self):
        dataset = map_of()
        dataset.attrs["protocol"] = json.dumps(
            {"periods": 100, "transient": "auto", "limit": 5000, "initial": [0.1, 2.0]}
        )
        said = plot(dataset).get_suptitle().replace("\n", " ")
        assert "100 periods after a transient as long as needed, at most 5000" in said
        assert "from (0.1, 2)" in said
        for broken in ("", "{", "[1]"):
            dataset.attrs.update(protocol=broken, groups=broken, system=broken)
            assert plot(dataset).get_suptitle() == "Exact solution"


class TestDiagram:
    def test_panels_and_legend(self):
        figure = bifurcation.bifurcation(diagram(300))
        diagram_axes, motion, sticks = data_axes(figure)
        assert diagram_axes.get_ylabel() == r"velocity $\dot\theta_n$  [rad/s]"
        assert sticks.get_xlabel() == r"slope of the actuation force $\eta$  [1]"
        assert [t.get_text() for t in motion.get_yticklabels()] == ["motion"]
        assert words(figure) == [
            "synchronous ($T$)", "$2T$", "chaotic", "unidirectional", "linear stability limit",
        ]  # fmt: skip
        named = {text.get_text() for text in motion.texts}
        assert named == {"$T$", "$2T$"}

    def test_angle(self):
        figure = bifurcation.bifurcation(diagram(), "angle")
        axes = data_axes(figure)[0]
        assert axes.get_ylabel() == r"angle $\theta_n$  [rad]"
        assert axes.get_ylim()[1] == pytest.approx(0.05, abs=0.005)

    @pytest.mark.parametrize("number", [1, 2, 7, 150, 400, 3000])
    def test_every_point_is_drawn_where_it_is(self, number):
        """The share of a parameter's points in all cells, or marks, is 1."""
        dataset = diagram(number)
        axes = data_axes(bifurcation.bifurcation(dataset))[0]
        velocity = dataset["velocity"].to_numpy()
        marks = [c for c in axes.collections if isinstance(c, PathCollection)]
        if marks:
            places = marks[0].get_offsets()
            shares = marks[0].get_array()
            height = np.ptp(axes.get_ylim()) / 300.0
            for value, points in zip(dataset["eta"].to_numpy(), velocity, strict=True):
                here = places[:, 0] == value
                assert shares[here].sum() == pytest.approx(1.0)
                gaps = np.abs(points[:, None] - places[here, 1]).min(axis=1)
                assert np.max(gaps) < height
        else:
            (image,) = axes.images
            shares = np.ma.filled(image.get_array(), 0.0)
            assert shares.sum(axis=0) == pytest.approx(np.ones(shares.shape[1]))
            low, high = axes.get_ylim()
            rows = ((velocity[0] - low) / (high - low) * shares.shape[0]).astype(int)
            assert set(np.flatnonzero(shares[:, 0])) >= set(rows)
        assert bool(marks) == (number < 200)

    def test_a_single_point_among_many_is_seen_on_white(self):
        dataset = diagram(400, periods=1000)
        dataset["velocity"][...] = 1.0
        dataset["velocity"][{"eta": 200, "period": 500}] = 4.0
        figure = bifurcation.bifurcation(dataset)
        axes = data_axes(figure)[0]
        image = Pixels(figure, 300)
        colour = image.around(axes, float(dataset["eta"][200]), 4.0, 3)
        darkest = min(luminance(one) for one in colour)
        assert 1.05 / (darkest + 0.05) > 1.9  # contrast, WCAG 2

    @pytest.mark.parametrize("axis", ["linear", "logarithmic", "uneven", "falling"])
    def test_classes_stand_below_their_parameter(self, axis):
        values = {
            "linear": np.linspace(0.3, 9.0, 300),
            "logarithmic": np.geomspace(0.3, 9.0, 300),
            "uneven": np.linspace(0.5, 3.0, 300) ** 2,
            "falling": np.linspace(9.0, 0.3, 300),
        }[axis]
        dataset = sweep(alpha=values, periods=3)
        dataset["velocity"][...] = 1.0
        chosen = slice(60, 90)
        fill(dataset, "motion", MotionClass.CHAOTIC, order=0, alpha=chosen)
        dataset["velocity"][{"alpha": chosen}] = 2.0
        figure = bifurcation.bifurcation(dataset)
        image = Pixels(figure)
        panel, motion, _ = data_axes(figure)
        assert (panel.get_xscale() == "log") == (axis == "logarithmic")
        for place in (40, 58, 62, 75, 88, 92, 200):
            expected = style.VERMILLION if 60 <= place < 90 else style.PALE_BLUE
            assert close(image.at(motion, values[place], 0.15), expected)
            points = image.around(panel, values[place], dataset["velocity"][place, 0], 2)
            empty = image.around(panel, values[place], 3.0 - dataset["velocity"][place, 0], 2)
            assert min(map(luminance, points)) < 0.1 < min(map(luminance, empty))

    def test_failures_are_shown(self):
        figure = bifurcation.bifurcation(with_failures(diagram(80)))
        said = words(figure)
        for word in (
            "diverged", "self-locked", "stopped at a limit", "invalid system", "not computed",
            "undecided", "no points", "no class",
        ):  # fmt: skip
            assert word in said
        low, high = data_axes(figure)[0].get_ylim()
        assert high < 10.0  # diverged points do not flatten the others
        assert low > -10.0

    def test_stability_limit(self):
        figure = bifurcation.bifurcation(diagram(300))
        axes = data_axes(figure)[0]
        (line,) = [one for one in axes.lines if one.get_linestyle() == "--"]
        assert line.get_xdata() == pytest.approx([-10.0, -10.0])
        assert [text.get_text() for text in axes.texts] == ["linearly unstable", "stable"]
        other = diagram(300)
        other["sliding_damping"][...] *= -1.0
        axes = data_axes(bifurcation.bifurcation(other))[0]
        assert [text.get_text() for text in axes.texts] == ["linearly stable", "unstable"]
        other["sliding_damping"][...] = 1.0
        figure = bifurcation.bifurcation(other)
        assert not data_axes(figure)[0].texts
        assert "linear stability limit" not in words(figure)

    def test_limit_of_stability_lies_where_it_is(self):
        """The smaller of two dampings has a kink at eta = 0, beside the limit."""
        for count in (5, 60, 400):
            etas = np.linspace(-60.0, 12.0, count)
            dataset = wb.bifurcation(SYSTEM, eta=etas, periods=4, transient=1)
            _, *panels = data_axes(bifurcation.bifurcation(dataset))
            limits = [
                float(line.get_xdata()[0])
                for line in panels[0].figure.axes[0].lines
                if line.get_linestyle() != "-" and len(set(line.get_xdata())) == 1
            ]
            truth = wb.stability(SYSTEM).forward.hopf_eta
            assert limits == pytest.approx([truth], abs=1e-9)

    def test_exponents(self):
        dataset = diagram(50)
        assert len(data_axes(bifurcation.bifurcation(dataset))) == 3
        dataset["largest_exponent"][...] = np.linspace(-5.0, 2.0, 50)
        dataset["largest_exponent"][{"eta": 3}] = -np.inf
        dataset["largest_exponent"][{"eta": 40}] = -500.0
        dataset["exponent_error"][...] = 0.1
        figure = bifurcation.bifurcation(dataset)
        _, axes, *_ = data_axes(figure)
        assert "[1/s]" in axes.get_ylabel()
        assert any(np.all(np.asarray(line.get_ydata()) == 0.0) for line in axes.lines)
        low, high = axes.get_ylim()
        assert high > 2.0
        assert -6.0 < low < -4.5  # one deep point does not hide the others
        assert len(data_axes(bifurcation.bifurcation(dataset, exponent=False))) == 3

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
        figure = bifurcation.bifurcation(dataset)
        up, down, motion, _ = data_axes(figure)
        assert [up.texts[0].get_text(), down.texts[0].get_text()] == [
            r"$\eta$ increasing", r"$\eta$ decreasing",
        ]  # fmt: skip
        assert [t.get_text() for t in motion.get_yticklabels()] == ["motion down", "motion up"]
        values = dataset["eta"].to_numpy()
        half = 0.5 * (values[1] - values[0])
        for axes in (up, down):
            spans = [
                p for p in axes.patches if close(p.get_facecolor()[:3], class_styles.DIFFER.colour)
            ]
            ends = sorted((p.get_x(), p.get_x() + p.get_width()) for p in spans)
            assert ends == [
                pytest.approx((values[20] - half, values[29] + half)),
                pytest.approx((values[150] - half, values[179] + half)),
            ]
        image = Pixels(figure)
        assert close(image.at(motion, values[165], 1.2), style.PALE_BLUE)
        assert close(image.at(motion, values[165], 0.2), style.BLUE)
        assert "branches differ" in words(figure)

    def test_a_chosen_branch_is_told(self):
        figure = bifurcation.bifurcation(diagram(300, follow="eta").sel(branch="down"))
        axes, motion, _ = data_axes(figure)
        assert axes.texts[0].get_text() == r"$\eta$ decreasing"
        assert [t.get_text() for t in motion.get_yticklabels()] == ["motion down"]
        assert close(axes.images[0].cmap(1.0)[:3], style.DENSITY_DOWN[-1])
        maps = xr.concat([map_of(), map_of()], dim="branch", combine_attrs="override")
        chosen = maps.assign_coords(branch=["up", "down"]).sel(branch="up")
        assert data_axes(plot(chosen))[0].get_title() == "up"

    def test_undecided_motions_are_not_compared(self):
        dataset = diagram(300, follow="eta")
        at = {"branch": 0, "eta": slice(10, 20)}
        fill(dataset, "motion", MotionClass.UNDECIDED, order=0, **at)
        assert "branches differ" not in words(bifurcation.bifurcation(dataset))

    @pytest.mark.parametrize("periods", [1, 20])
    def test_nothing_computed(self, periods):
        dataset = diagram(30, periods=periods)
        for name, one in VARIABLES.items():
            dataset[name][...] = one.fill
        figure = bifurcation.bifurcation(dataset, exponent=True)
        figure.draw_without_rendering()
        assert words(figure) == ["not computed", "no class", "no points"]

    def test_all_diverged(self):
        dataset = diagram(30)
        dataset["motion"][...] = MotionClass.DIVERGED
        dataset["velocity"][...] = 1e6
        low, high = data_axes(bifurcation.bifurcation(dataset))[0].get_ylim()
        assert low < 1e6 < high

    @pytest.mark.parametrize("values", [[3.0, 3.0], [0.0, 0.0, 0.0], [1.0, 1.0, 2.0]])
    def test_a_value_given_twice(self, values):
        figure = bifurcation.bifurcation(diagram(values=np.array(values)))
        figure.draw_without_rendering()
        assert words(figure)
        figure = plot(map_of(eta=np.array(values), F0=np.array([0.02, 0.02])))
        figure.draw_without_rendering()
        assert "chaotic" in " ".join(words(figure))

    def test_many_points_in_time(self):
        dataset = diagram(5000, periods=200)
        begin = time.process_time()
        bifurcation.bifurcation(dataset).draw_without_rendering()
        assert time.process_time() - begin < 3.0


class TestMap:
    @pytest.mark.parametrize("axis", ["linear", "logarithmic", "uneven", "falling"])
    def test_cells_are_where_their_parameters_are(self, axis):
        alphas = {
            "linear": np.linspace(0.3, 9.0, 40),
            "logarithmic": np.geomspace(0.3, 9.0, 40),
            "uneven": np.linspace(0.5, 3.0, 40) ** 2,
            "falling": np.linspace(9.0, 0.3, 40),
        }[axis]
        forces = np.linspace(0.1, 0.3, 31) ** 2
        dataset = sweep("regime_map", alpha=alphas, F0=forces)
        fill(dataset, "motion", MotionClass.CHAOTIC, order=0, alpha=7, F0=25)
        fill(dataset, "motion", MotionClass.PERIODIC, order=3, alpha=slice(20, 23), F0=2)
        figure = regime.regime_map(dataset)
        (axes,) = data_axes(figure)
        image = Pixels(figure)
        assert close(image.at(axes, alphas[7], forces[25]), style.VERMILLION)
        assert close(image.at(axes, alphas[21], forces[2]), style.GREEN)
        for place in ((6, 25), (8, 25), (7, 24), (7, 26), (21, 1), (21, 3), (18, 2), (24, 2)):
            assert close(image.at(axes, alphas[place[0]], forces[place[1]]), style.PALE_BLUE)
        assert (axes.get_xscale() == "log") == (axis == "logarithmic")
        if axis == "logarithmic":
            assert [t.get_text() for t in axes.get_xticklabels()] == ["$0.5$", "$1$", "$2$", "$5$"]

    def test_order_of_dimensions_does_not_matter(self):
        dataset = map_of()
        turned = dataset.transpose("F0", "eta")
        # The first axis is the first dimension of the sweep's own order.
        assert data_axes(plot(dataset))[0].get_xlabel().startswith("slope")
        assert data_axes(plot(turned))[0].get_xlabel().startswith("initial")
        (axes,) = data_axes(figure := plot(turned))
        image = Pixels(figure)
        assert close(image.at(axes, 0.08, 8.0), style.VERMILLION)
        assert close(image.at(axes, 0.02, -58.0), style.BLUE)
        assert close(image.at(axes, 0.08, -58.0), style.PALE_BLUE)

    def test_legend_tells_shares_of_what_is_there(self):
        assert words(plot(map_of())) == [
            "synchronous ($T$), 25 %", "$2T$, 25 %", "chaotic, 50 %", "linear stability limit",
        ]  # fmt: skip

    def test_every_class_has_its_look(self):
        dataset = sweep("regime_map", eta=np.arange(14.0), F0=[0.02, 0.03])
        dataset["order"][...] = 0
        for place, (motion, order, status) in enumerate(
            [(1, 0, 1), (2, 1, 1), (3, 2, 1), (3, 3, 1), (3, 4, 1), (3, 16, 1), (4, 0, 1),
             (5, 0, 1), (7, 0, 3), (6, 0, 2), (0, 0, 1), (-1, 0, 5), (-1, 0, 6), (-1, 0, 0)]
        ):  # fmt: skip
            for name, value in (("motion", motion), ("order", order), ("status", status)):
                dataset[name][{"eta": place}] = value
        codes = class_styles.classes(dataset).to_numpy()[:, 0]
        assert list(codes) == list(range(14))
        said = [word.split(", 7.1 %")[0] for word in words(plot(dataset))]
        assert said == [look.word for look in class_styles.MOTIONS.values()]
        # A run that ended badly counts as such, even without a class.
        dataset["motion"][...] = MotionClass.NONE
        left = class_styles.classes(dataset).to_numpy()[:, 0]
        assert left[8] == list(class_styles.MOTIONS).index("self_locked")
        assert left[9] == list(class_styles.MOTIONS).index("diverged")

    def test_undecided_is_hatched_and_not_computed_white(self):
        dataset = map_of()
        fill(dataset, "motion", MotionClass.UNDECIDED, order=0, eta=slice(0, 10))
        fill(dataset, "status", PointStatus.NOT_COMPUTED, eta=slice(10, 20))
        fill(dataset, "status", PointStatus.STEP_LIMIT, eta=slice(20, 30))
        dataset["sliding_damping"][...] = 1.0
        figure = regime.regime_map(dataset)
        (axes,) = data_axes(figure)
        image = Pixels(figure)
        values = dataset["eta"].to_numpy()
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
        (axes,) = data_axes(plot(dataset))
        (line,) = [c for c in axes.collections if not isinstance(c, QuadMesh)]
        corners = np.concatenate([path.vertices for path in line.get_paths()])
        assert corners[:, 0] == pytest.approx(2.0, abs=1e-3 if axis == "logarithmic" else 1e-9)
        assert sorted(corners[[0, -1], 1]) == pytest.approx(sorted(axes.get_ylim()))

    @pytest.mark.parametrize(
        ("other", "values"),
        [("slope", np.linspace(-0.5, 0.12, 12)), ("angle", np.linspace(0.25, 0.4, 16))],
    )
    def test_stability_limit_ends_where_the_brake_locks(self, other, values):
        """Beyond tan(angle) = mu there is no forward sliding: the damping jumps, without a zero."""
        system = wb.paper.system(eta=-0.05).replace(angle=0.3)
        axes = {"kinetic": np.linspace(0.25, 0.345, 20), other: values}
        dataset = wb.regime_map(system, **axes, periods=3, transient=1)
        figure = plot(dataset)
        (panel,) = data_axes(figure)
        (line,) = [c for c in panel.collections if not isinstance(c, QuadMesh)]
        kinetic, second = np.concatenate([path.vertices for path in line.get_paths()]).T
        lock = np.arctan(kinetic) if other == "angle" else np.full(kinetic.size, 0.3)
        angle = second if other == "angle" else 0.3
        assert np.all(angle > lock - (0.0 if other == "angle" else 1e-12))
        assert np.all(np.tan(angle) > kinetic)
        assert np.max(kinetic) > 0.29
        assert "linear stability limit" in words(figure)
        beyond = plot(dataset.where(dataset["kinetic"] > 0.31, drop=True).astype(dataset.dtypes))
        if other == "slope":
            assert "linear stability limit" not in words(beyond)

    @pytest.mark.parametrize(
        ("quantity", "label"),
        [("peak_torque", "brake torque"), ("friction_power", "[W]"), ("stick_share", "[1]"),
         ("largest_exponent", r"$\lambda_1$  [1/s]"), ("order", "[1]")],
    )  # fmt: skip
    def test_other_results(self, quantity, label):
        figure = plot(map_of(), quantity=quantity)
        bar = next(a for a in figure.axes[1:] if label in a.get_ylabel())
        assert "[" in bar.get_ylabel()
        figure.draw_without_rendering()
        assert ("no value, 50 %" in words(figure)) == (quantity == "order")

    def test_exponents_are_centred_on_zero_and_infinite_ones_drawn(self):
        dataset = map_of()
        dataset["largest_exponent"][{"eta": slice(0, 5)}] = -np.inf
        figure = plot(dataset, quantity="largest_exponent")
        norm = figure.axes[0].images[0].norm
        assert norm.vmin == -norm.vmax
        assert norm.vmax == pytest.approx(3.0)
        assert "no value" not in " ".join(words(figure))
        image = Pixels(figure)
        assert close(image.at(figure.axes[0], -60.0, 0.05), style.SIGNS[0])

    def test_values_of_all_branches_share_a_scale(self):
        dataset = xr.concat([map_of(), map_of()], dim="branch", combine_attrs="override")
        dataset = dataset.assign_coords(branch=["up", "down"])
        dataset["peak_torque"][{"branch": 1}] *= 7.0
        figure = plot(dataset, quantity="peak_torque")
        norms = [a.images[0].norm for a in figure.axes if a.images and a.get_xlabel()]
        assert len(norms) == 2
        assert norms[0].vmax == norms[1].vmax
        with pytest.raises(wb.InputError, match=r"dataset: has branches.*sel\(branch"):
            regime.draw(figure.axes[0], dataset)

    def test_failures_stay_in_maps_of_values(self):
        dataset = map_of()
        fill(dataset, "status", PointStatus.NOT_COMPUTED, eta=slice(0, 3))
        fill(dataset, "motion", MotionClass.DIVERGED, eta=slice(3, 6))
        dataset["peak_torque"][{"eta": slice(3, 6)}] = 1e30
        figure = plot(dataset, quantity="peak_torque")
        assert words(figure)[:2] == ["diverged, 10 %", "not computed, 10 %"]
        assert figure.axes[0].images[0].norm.vmax < 100.0
        figure = plot(dataset, quantity="stick_class")
        assert words(figure)[:3] == [
            "unidirectional, 80 %", "diverged, 10 %", "not computed, 10 %",
        ]  # fmt: skip

    @pytest.mark.parametrize("shape", [(1, 1), (1, 12), (12, 1), (2, 2)])
    @pytest.mark.parametrize("quantity", ["motion", "largest_exponent"])
    def test_small_maps(self, shape, quantity):
        dataset = map_of(eta=np.linspace(-60.0, 12.0, shape[0]), F0=np.linspace(0.0, 1, shape[1]))
        figure = plot(dataset, quantity=quantity)
        image = Pixels(figure, 100)
        axes = figure.axes[0]
        if quantity == "motion":
            assert close(image.at(axes, float(dataset["eta"][-1]), 0.0), style.VERMILLION)

    def test_no_values_at_all(self):
        dataset = map_of()
        dataset["peak_torque"][...] = np.nan
        figure = plot(dataset, quantity="peak_torque")
        figure.draw_without_rendering()
        assert words(figure)[0] == "no value, 100 %"

    @pytest.mark.parametrize("spacing", ["even", "uneven"])
    def test_a_million_points(self, spacing, tmp_path):
        rng = np.random.default_rng(0)
        forces = np.linspace(0.1, 0.3, 1000)
        dataset = map_of(
            eta=np.linspace(-60.0, 12.0, 1000), F0=forces if spacing == "even" else forces**2
        )
        dataset["motion"][...] = rng.integers(0, 7, (1000, 1000))
        figure = plot(dataset)
        path = save(figure, tmp_path / "map.png")
        assert path.stat().st_size < 3e6
        assert save(figure, tmp_path / "map.pdf").stat().st_size < 3e6


class TestBasins:
    def test_colours_go_by_share(self):
        dataset = basins_of(4)
        figure = basins.basins(dataset)
        (axes,) = data_axes(figure)
        image = Pixels(figure)
        angles = dataset["initial_angle"].to_numpy()
        numbers = dataset["attractor"].to_numpy()[:, 0]
        ranking = np.argsort(-dataset["attractor_share"].to_numpy())
        assert list(ranking) == [3, 2, 1, 0]
        for rank, place in enumerate(ranking):
            angle = angles[numbers == place][0]
            assert close(image.at(axes, angle, -25.0), class_styles.ATTRACTORS[rank])
        assert words(figure) == [
            "3: $2T$, 30 %", "2: $2T$, 28 %", "1: $2T$, 22 %", "0: $2T$, 20 %",
            "points of attractors",
        ]  # fmt: skip
        assert [text.get_text() for text in axes.texts] == ["3", "2", "1", "0"]

    def test_only_points_inside_are_marked(self):
        dataset = basins_of(3)
        (axes,) = data_axes(basins.basins(dataset))
        marks = [line for line in axes.lines if line.get_marker() == "o"]
        assert len(marks) == 2 * 3  # ring and point
        assert all(line.get_ydata() == pytest.approx([5.0]) for line in marks)
        dataset["attractor_velocity"][...] = 99.0
        (axes,) = data_axes(basins.basins(dataset))
        assert not axes.texts

    def test_beyond_twenty_they_are_others(self):
        dataset = basins_of(25, 300)
        ranking = np.argsort(-dataset["attractor_share"].to_numpy(), kind="stable")
        figure = basins.basins(dataset)
        said = words(figure)
        assert [word.split(":")[0] for word in said[:20]] == [str(n) for n in ranking[:20]]
        assert said[20].startswith("5 others, ")
        assert len(data_axes(figure)[0].texts) == 20

    def test_numbers_do_not_touch(self):
        """Attractors in one place: their numbers are moved apart."""
        dataset = basins_of(8)
        dataset["attractor_angle"][...] = 0.1 + 0.002 * np.arange(8)[:, None]
        figure = basins.basins(dataset)
        renderer = FigureCanvasAgg(figure).get_renderer()
        figure.draw(renderer)
        texts = data_axes(figure)[0].texts
        # An annotation's own extent takes in its line.
        boxes = [super(type(text), text).get_window_extent(renderer) for text in texts]
        assert len(boxes) == 8
        for one, other in itertools.combinations(boxes, 2):
            assert not one.overlaps(other)

    def test_other_outcomes(self):
        dataset = basins_of(2)
        for place, code in enumerate((-1, -2, -3, -4)):
            dataset["attractor"][{"initial_angle": place}] = code
        said = words(basins.basins(dataset))
        for word in ("undecided", "diverged", "self-locked", "not computed"):
            assert f"{word}, 2.5 %" in said

    def test_no_attractor(self):
        dataset = basins_of(2).isel(attractor_id=slice(0, 0))
        dataset["attractor"][...] = -1
        assert words(basins.basins(dataset)) == ["undecided, 100 %"]

    def test_motions_in_words(self):
        dataset = basins_of(6, 200)
        for place, motion in enumerate((1, 2, 3, 4, 5, 0)):
            dataset["attractor_motion"][{"attractor_id": 5 - place}] = motion
        said = [word.split(",")[0] for word in words(basins.basins(dataset))]
        assert said[:6] == [
            "5: at rest", "4: $T$", "3: $2T$", "2: quasi-periodic", "1: chaotic", "0: undecided",
        ]  # fmt: skip


class TestFrontDoor:
    def test_the_picture_follows_the_dataset(self, response):
        figure = plot(response, verdict="a verdict")
        assert len(figure.axes) == 5
        assert "a verdict" in figure.get_suptitle()
        (axes,) = plot(wb.poincare(SYSTEM, 20, transient=10)).axes
        assert r"\theta_n" in axes.get_xlabel()
        (axes,) = plot(wb.spectrum(response), hertz=True).axes
        assert "Hz" in axes.get_xlabel()
        assert "motion" in words_of_ticks(plot(diagram()))
        assert "chaotic, 50 %" in words(plot(map_of()))
        assert "2: $2T$" in words(plot(basins_of(3)))[0]
        one = map_of().assign_attrs(kind="sweep")
        assert words(plot(one)) == words(plot(map_of()))

    @pytest.mark.parametrize(
        "dataset",
        [None, 3, [1.0], xr.Dataset(), xr.Dataset({"motion": ("eta", [1])})],
        ids=["none", "number", "list", "empty", "half"],
    )
    def test_other_things(self, dataset):
        with pytest.raises(wb.InputError, match=r"no picture of it.*wb\.bifurcation"):
            plot(dataset)

    def test_options(self, response):
        with pytest.raises(wb.InputError, match=r"quantiti: no option.*'regime_map'.*'quantity'"):
            plot(map_of(), quantiti="motion")
        with pytest.raises(wb.InputError, match=r"width: no option of the picture 'overview'"):
            plot(response, width=3)

    def test_three_axes(self):
        dataset = sweep(eta=[0.0, 1.0], F0=[0.1, 0.2], alpha=[1.1, 1.2])
        with pytest.raises(wb.InputError, match=r"eta, F0, alpha.*one or two.*isel\(alpha=0\)"):
            plot(dataset)
        with pytest.raises(wb.InputError, match=r"eta, F0, alpha.*two parameters.*isel"):
            regime.regime_map(dataset)
        assert words(plot(dataset.isel(alpha=0))) == ["synchronous ($T$), 100 %"]

    def test_unknown_system(self, response):
        for text in ("", "{}", "null", '{"brake": {"kind": "own"}}'):
            with pytest.raises(wb.InputError, match=r"attrs\['system'\].*overview\(system"):
                plot(response.assign_attrs(system=text))


class TestWrongDatasets:
    def test_number_of_axes(self, response):
        with pytest.raises(wb.InputError, match=r"eta, F0, but.*one parameter.*regime_map"):
            bifurcation.bifurcation(map_of())
        with pytest.raises(wb.InputError, match=r"eta, but.*two parameters.*bifurcation"):
            regime.regime_map(diagram())
        for draws in (bifurcation.bifurcation, regime.regime_map, basins.basins):
            with pytest.raises(wb.InputError, match=r"dataset = Dataset: must be the result of"):
                draws(response)

    def test_quantities(self):
        with pytest.raises(wb.InputError, match=r"quantity = 'velocit'.*'velocity'"):
            bifurcation.bifurcation(diagram(), "velocit")
        with pytest.raises(wb.InputError, match=r"quantity = 'peak_torqe'.*'peak_torque'"):
            regime.regime_map(map_of(), "peak_torqe")
        for name in ("status", "velocity", "eta"):
            with pytest.raises(wb.InputError, match=f"quantity = '{name}': no such result"):
                regime.regime_map(map_of(), name)

    def test_no_points(self):
        row = map_of().isel(F0=0)
        with pytest.raises(wb.InputError, match=r"no velocity over period.*wb\.bifurcation"):
            plot(row)

    def test_no_basins(self):
        with pytest.raises(wb.InputError, match=r"no attractor.*wb\.basins.*regime_map"):
            basins.basins(map_of())
        dataset = basins_of(2).rename(initial_angle="eta")
        with pytest.raises(wb.InputError, match=r"eta, initial_velocity.*need initial_angle"):
            basins.basins(dataset)

    def test_axes_without_numbers(self):
        dataset = map_of().assign_coords(eta=[f"v{i}" for i in range(30)])
        with pytest.raises(wb.InputError, match="eta: values of the axis must be finite numbers"):
            plot(dataset)


def words_of_ticks(figure):
    return {label.get_text() for axes in figure.axes for label in axes.get_yticklabels()}


# Linear RGB of what people with the three kinds of dichromacy see: Machado, Oliveira and
# Fernandes, IEEE Trans. Vis. Comput. Graph. 15 (2009), 1291-1298, table 1, severity 1.0.
SIGHTS = {
    "trichromacy": np.eye(3),
    "protanopia": np.array(
        [[0.152286, 1.052583, -0.204868],
         [0.114503, 0.786281, 0.099216],
         [-0.003882, -0.048116, 1.051998]]
    ),
    "deuteranopia": np.array(
        [[0.367322, 0.860646, -0.227968],
         [0.280085, 0.672501, 0.047413],
         [-0.011820, 0.042940, 0.968881]]
    ),
    "tritanopia": np.array(
        [[1.255528, -0.076749, -0.178779],
         [-0.078411, 0.930809, 0.147602],
         [0.004733, 0.691367, 0.303900]]
    ),
}  # fmt: skip
# CIE 1931 XYZ of linear sRGB, and the white of D65 (IEC 61966-2-1).
XYZ = np.array(
    [[0.4124564, 0.3575761, 0.1804375],
     [0.2126729, 0.7151522, 0.0721750],
     [0.0193339, 0.1191920, 0.9503041]]
)  # fmt: skip
WHITE = XYZ @ np.ones(3)


def linear(colour):
    rgb = np.asarray(to_rgb(colour))
    return np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)


def luminance(colour):
    return float(XYZ[1] @ linear(colour))


def lab(colour, sight):
    """CIE L*a*b* of a colour as it is seen."""
    seen = XYZ @ np.clip(SIGHTS[sight] @ linear(colour), 0.0, 1.0) / WHITE
    f = np.where(seen > 216 / 24389, np.cbrt(seen), (24389 / 27 * seen + 16) / 116)
    return np.array([116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])])


class TestColours:
    """Differences of colour, CIE 1976; about 2.3 can just be noticed side by side."""

    @pytest.mark.parametrize("sight", SIGHTS)
    @pytest.mark.parametrize("name", ["MOTIONS", "STICK_CLASSES", "ATTRACTORS"])
    def test_classes_differ_for_every_sight(self, name, sight):
        table = getattr(class_styles, name)
        colours = (
            [look.colour for look in table.values() if look.opacity == 1.0]
            if isinstance(table, dict)
            else [*table, class_styles.OTHERS, style.BLACK, style.DARK_GREY, "white"]
        )
        seen = [lab(colour, sight) for colour in colours]
        least = min(np.linalg.norm(a - b) for a, b in itertools.combinations(seen, 2))
        assert least > 14.0

    @pytest.mark.parametrize("sight", SIGHTS)
    @pytest.mark.parametrize("scale", [style.DENSITY, style.DENSITY_DOWN])
    def test_density_darkens_steadily(self, scale, sight):
        lightness = [lab(colour, sight)[0] for colour in scale]
        assert all(a - b > 12.0 for a, b in itertools.pairwise(lightness))

    @pytest.mark.parametrize("sight", SIGHTS)
    def test_signs_differ(self, sight):
        low, _, middle, _, high = (lab(colour, sight) for colour in style.SIGNS)
        inner = [lab(colour, sight) for colour in (style.SIGNS[1], style.SIGNS[3])]
        assert np.linalg.norm(inner[0] - inner[1]) > 40.0
        assert low[0] < inner[0][0] < middle[0] > inner[1][0] > high[0]

    def test_ink_can_be_read(self):
        for look in class_styles.MOTIONS.values():
            paper = luminance(class_styles.blended(look))
            ink = luminance(style.ink(class_styles.blended(look)))
            assert (max(paper, ink) + 0.05) / (min(paper, ink) + 0.05) > 3.8  # WCAG 2


class TestWords:
    @pytest.mark.parametrize(
        ("name", "meaning", "unit", "label"),
        [
            ("eta", "slope of the force, delta R", "1", r"slope of the force $\eta$  [1]"),
            ("alpha", "tan(angle) / mu_k", "1", r"relative wedge angle $\alpha$  [1]"),
            ("alpha", "", "", r"relative wedge angle $\alpha$  [1]"),
            ("stiffness", "torsional stiffness", "N m/rad", "torsional stiffness $k$  [N m/rad]"),
            ("own_thing", "", "m", "own thing  [m]"),
            ("order", "periods; 0: none", "1", "periods  [1]"),
        ],
    )
    def test_labels(self, name, meaning, unit, label):
        assert style.named(name, meaning, unit) == label

    @pytest.mark.parametrize(
        ("share", "text"),
        [(0.0, "0.0 %"), (1e-6, "<0.1 %"), (0.0312, "3.1 %"), (0.31, "31 %"), (1.0, "100 %"),
         (0.99999, "99.9 %")],
    )  # fmt: skip
    def test_percent(self, share, text):
        assert style.percent(share) == text

    @pytest.mark.parametrize(
        "ends", [(0.33, 8.6), (1e-6, 1e6), (1.1, 1.3), (20.0, 90.0), (1003.0, 1013.0)]
    )
    def test_ticks_of_logarithmic_axes(self, ends):
        figure = style.new_figure()
        axes = figure.add_subplot()
        axes.set_xscale("log")
        axes.set_xlim(*ends)
        style.round_ticks(axes.xaxis, *ends)
        ticks = [tick for tick in axes.get_xticks() if ends[0] <= tick <= ends[1]]
        assert 2 <= len(ticks) <= 9
        for tick, label in zip(axes.get_xticks(), axes.get_xticklabels(), strict=True):
            assert label.get_text() == f"${style.number(tick)}$"

    def test_captions_are_broken_between_words(self):
        lines = caption_lines(["one $a = 2$, " * 20, "two"], style.COLUMN)
        assert lines[-1] == "two"
        assert len(lines) > 2
        assert all(line.count("$") % 2 == 0 for line in lines)
        assert " ".join(lines[:-1]) == ("one $a = 2$, " * 20).strip()


def test_pyplot_stays_out():
    """In a process of its own, which is given what it draws: computing it would take longer."""
    program = """
import json, sys
from wedgebrake.figures.matplotlib import basins, bifurcation, regime
from wedgebrake.figures.matplotlib.draw import plot
assert "matplotlib" not in sys.modules and "xarray" not in sys.modules
import xarray
figures = [plot(xarray.Dataset.from_dict(one)) for one in json.load(sys.stdin)]
figures[0].draw_without_rendering()
assert "matplotlib.pyplot" not in sys.modules
"""
    results = wb.poincare(SYSTEM, 12, transient=2), diagram(7), map_of(4, 3), basins_of(2, 8)
    given = json.dumps([one.to_dict() for one in results])
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", program],
        input=given, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
