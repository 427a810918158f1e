"""Pictures of orbits and of boundaries: curves, symbols and letters where they belong."""

from __future__ import annotations

import functools
import itertools
import json

import numpy as np
import pytest
import xarray as xr
from matplotlib.backends.backend_agg import FigureCanvasAgg
from pictures import (
    SYSTEM,
    Pixels,
    check_layout,
    close,
    data_axes,
    diagram,
    luminance,
    map_of,
    words,
)

import wedgebrake as wb
from wedgebrake.figures.data.class_map import curve_entries, curves_over
from wedgebrake.figures.data.class_styles import (
    BIFURCATIONS,
    MOTIONS,
    orbit_colour,
)
from wedgebrake.figures.data.orbit_branches import OrbitBranches
from wedgebrake.figures.matplotlib import maps, orbit_branches, style

ETA = {"units": "1", "long_name": "slope of the actuation force, delta R mu_k / c"}
F0 = {"units": "1", "long_name": "initial actuation force"}
# Period doublings of the branches below, the second of the first.
DOUBLED, AGAIN = -16.0, -24.0


def branch(eta, velocity, stable, *found, origin=-1):
    """Points of one branch; ``found`` are kinds of bifurcation and places among them."""
    return {
        "eta": np.asarray(eta, dtype=float),
        "velocity": np.asarray(velocity, dtype=float).reshape(len(eta), -1),
        "stable": np.broadcast_to(stable, len(eta)),
        "found": found,
        "origin": origin,
    }


def dataset_of(*branches, parameter="eta", attributes=ETA):
    """A dataset in the format of orbits; results of whole orbits are made up from the points."""
    sizes = [len(one["eta"]) for one in branches]
    orders = [one["velocity"].shape[1] for one in branches]
    velocity = np.full((sum(sizes), max(orders, default=1)), np.nan)
    starts = np.cumsum([0, *sizes])
    for start, size, order, one in zip(starts, sizes, orders, branches, strict=False):
        velocity[start : start + size, :order] = one["velocity"]
    stable = np.concatenate([np.empty(0, bool), *(one["stable"] for one in branches)])
    whole = np.nan_to_num(np.nanmax(velocity, axis=1)) if sizes else np.empty(0)
    values = {
        "velocity": velocity,
        "angle": 0.01 * velocity,
        "stick_share": 0.05 * whole,
        "largest_exponent": np.where(stable, -1.0, 1.0) * np.abs(whole - 5.0),
    }
    data = {
        name: (("point", "return")[: value.ndim], value, {"units": "u", "long_name": name})
        for name, value in values.items()
    }
    found = [
        (kind, start + place)
        for start, one in zip(starts, branches, strict=False)
        for kind, place in one["found"]
    ]
    eta = np.concatenate([np.empty(0), *(one["eta"] for one in branches)])
    data["stable"] = "point", stable
    data["branch_order"] = "branch_number", np.array(orders, int)
    data["branch_origin"] = "branch_number", np.array([one["origin"] for one in branches], int)
    data["bifurcation_kind"] = "bifurcation", np.array([kind for kind, _ in found], object)
    data["bifurcation_point"] = "bifurcation", np.array([place for _, place in found], int)
    coordinates = {
        parameter: ("point", eta, attributes),
        "branch": ("point", np.repeat(np.arange(len(sizes)), sizes)),
    }
    attrs = {
        "kind": "orbits",
        "parameter": parameter,
        "method": "exact",
        "system": json.dumps(SYSTEM.as_dict()),
        "groups": json.dumps(SYSTEM.groups.as_dict()),
    }
    return xr.Dataset(data, coords=coordinates, attrs=attrs)


def middle(eta):
    return 4.0 - 0.03 * np.asarray(eta)


def doubled(eta):
    """Both points of 2T: a fork at ``DOUBLED``, (n, 2)."""
    half = 0.5 * np.sqrt(np.clip(DOUBLED - np.asarray(eta), 0.0, None))
    return middle(eta)[:, None] + half[:, None] * [1.0, -1.0]


def cascade(number=60, *more):
    """T, stable above ``DOUBLED``; 2T below it, stable above ``AGAIN``; 4T below that.

    At the bifurcations themselves stability is what rounding made of it.
    """
    up, fork, low = (
        np.linspace(*ends, number) for ends in ((12.0, DOUBLED), (DOUBLED, AGAIN), (AGAIN, -30.0))
    )
    once = np.concatenate((up, np.linspace(DOUBLED, -60.0, number)[1:]))
    twice = np.concatenate((fork, np.linspace(AGAIN, -60.0, number)[1:]))
    split = 0.3 * np.sqrt(AGAIN - low)
    four = doubled(low)[:, [0, 1, 0, 1]] + split[:, None] * [1.0, 1.0, -1.0, -1.0]
    return dataset_of(
        branch(once, middle(once), once > DOUBLED, ("period doubling", number - 1)),
        branch(twice, doubled(twice), twice >= AGAIN, ("period doubling", number - 1), origin=0),
        branch(low, four, low < AGAIN, origin=1),
        *more,
    )


def loop(number=41):
    """3T in a fold at eta = -28: along one leg to the fold, unstable, and back, stable."""
    along = np.linspace(-1.0, 1.0, number)
    eta = -28.0 - 8.0 * along**2
    velocity = np.stack([level + 0.4 * along for level in (1.2, 2.6, 8.5)], axis=1)
    return branch(eta, velocity, along > 0.0, ("fold", number // 2), ("grazing", number - 8))


def crowd(count=30):
    """As many bifurcations, of all kinds, along T."""
    eta = np.linspace(12.0, -60.0, 400)
    places = np.linspace(5, 394, count).astype(int)
    found = zip(itertools.cycle(BIFURCATIONS), places.tolist(), strict=False)
    return dataset_of(branch(eta, middle(eta), True, *found))


def boundary_of(kind="fold", order=1, *, turned=False, shift=0.0):
    """A straight line from (-60, 0.02) to (12, 0.08), upwards by a shift."""
    share = np.linspace(0.0, 1.0, 30)
    coordinates = {
        "eta": ("point", -60.0 + 72.0 * share, ETA),
        "F0": ("point", 0.02 + 0.06 * share + shift, F0),
    }
    spans = [(-70.0, 20.0), (0.0, 0.2)]
    attrs = {
        "kind": "boundary",
        "bifurcation": kind,
        "order": order,
        "parameters": ["F0", "eta"] if turned else ["eta", "F0"],
        "ranges": json.dumps(spans[::-1] if turned else spans),
        "system": json.dumps(SYSTEM.as_dict()),
        "groups": json.dumps(SYSTEM.groups.as_dict()),
    }
    return xr.Dataset(coords=coordinates, attrs=attrs)


def every_boundary():
    return [
        boundary_of(kind, 1 + place % 2, shift=0.012 * place - 0.05)
        for place, kind in enumerate(BIFURCATIONS)
    ]


PICTURES = {
    "cascade": lambda: wb.plot(cascade(60, loop()), beneath=diagram(300), width=style.COLUMN),
    "exponent": lambda: wb.plot(cascade(), quantity="largest_exponent", width=style.COLUMN),
    "crowd": lambda: wb.plot(crowd(), width=style.COLUMN),
    "boundaries": lambda: maps.boundary(boundary_of(), boundaries=every_boundary()),
    "map": lambda: wb.plot(map_of(), boundaries=every_boundary()),
}


@functools.cache
def picture(name):
    return PICTURES[name]()


def curves(dataset, order=None, quantity="velocity"):
    """Lines of orbits: whether stable, and points (n, 2)."""
    return [
        (one.stable, np.column_stack((one.x, one.y)))
        for one in OrbitBranches.of(dataset, quantity).curves
        if order is None or one.order == order
    ]


def letters(figure):
    return [text.get_text() for text in data_axes(figure)[0].texts]


@pytest.mark.parametrize("name", PICTURES)
def test_nothing_overlaps_and_every_axis_has_its_unit(name):
    figure = picture(name)
    check_layout(figure)
    assert r"\eta =" not in figure.get_suptitle()
    for axes in data_axes(figure):
        assert "[" in axes.get_xlabel()
        assert "[" in axes.get_ylabel()


class TestCurves:
    def test_stable_and_unstable_pieces_meet(self):
        """T, 2T and 4T against the fork that they were made from."""
        (solid, right), (dashed, left) = curves(cascade(), 1)
        assert (solid, dashed) == (True, False)
        assert right[[0, -1], 0] == pytest.approx([12.0, DOUBLED])
        assert left[[0, -1], 0] == pytest.approx([DOUBLED, -60.0])
        for line in (right, left):
            assert line[:, 1] == pytest.approx(middle(line[:, 0]))
        twice = curves(cascade(), 2)
        ends = [(stable, line[0, 0], line[-1, 0]) for stable, line in twice]
        assert ends == [(True, DOUBLED, AGAIN)] * 2 + [(False, AGAIN, -60.0)] * 2
        for (_, line), column in zip(twice, (0, 1, 0, 1), strict=True):
            assert line[:, 1] == pytest.approx(doubled(line[:, 0])[:, column])
        assert [stable for stable, _ in curves(cascade(), 4)] == [True] * 4

    def test_rounding_at_a_bifurcation_changes_nothing(self):
        dataset = cascade(60, loop())
        other = dataset.copy(deep=True)
        begins = np.diff(dataset["branch"].to_numpy(), prepend=0) > 0
        begins &= np.isin(dataset["branch"].to_numpy(), (1, 2))
        # Not at the grazing, which leaves stability as it is.
        at = [*dataset["bifurcation_point"].to_numpy()[:-1], *np.flatnonzero(begins)]
        other["stable"][at] = ~dataset["stable"][at]
        for one, two in zip(curves(dataset), curves(other), strict=True):
            assert one[0] == two[0]
            assert one[1] == pytest.approx(two[1])

    def test_each_period_has_one_legend_entry(self):
        eta = np.linspace(0.0, -10.0, 11)
        pair = [branch(eta, middle(eta) + shift, True) for shift in (0.0, 1.0)]
        nine, twelve = (
            branch(eta, np.tile(middle(eta)[:, None], order) + np.arange(order), False)
            for order in (9, 12)
        )
        figure = wb.plot(dataset_of(*pair, nine, twelve))
        assert words(figure) == ["$T$", "$9T$, $12T$", "stable", "unstable"]
        lines = data_axes(figure)[0].lines
        colours = [(line.get_color(), line.get_linestyle() == "-") for line in lines]
        assert colours == [(orbit_colour(1), True)] * 2 + [(orbit_colour(9), False)] * 21

    def test_a_branch_of_one_point_is_seen_and_none_is_said(self):
        figure = wb.plot(dataset_of(branch([-5.0], [3.0], True)))
        (axes,) = data_axes(figure)
        assert close(Pixels(figure).at(axes, -5.0, 3.0), orbit_colour(1))
        empty = wb.plot(dataset_of())
        empty.draw_without_rendering()
        assert len(letters(empty)) == 1

    @pytest.mark.parametrize(("quantity", "scale"), [("angle", 0.01), ("stick_share", 0.05)])
    def test_other_quantities(self, quantity, scale):
        for _, line in curves(cascade(), 1, quantity):
            assert line[:, 1] == pytest.approx(scale * middle(line[:, 0]))
        count = 4 if quantity == "angle" else 2  # one curve for each return, or for the orbit
        assert len(curves(cascade(), 2, quantity)) == count

    def test_infinite_exponents_are_left_out(self):
        """Orbits with a stick forget their initial state: a multiplier is zero."""
        dataset = cascade()
        dataset["largest_exponent"][5:10] = -np.inf
        data = OrbitBranches.of(dataset, "largest_exponent")
        known = data.heights[np.isfinite(data.heights)]
        assert -10.0 < data.ylim[0] < known.min() < known.max() < data.ylim[1]
        assert list(np.flatnonzero(np.isnan(data.curves[0].y))) == [5, 6, 7, 8, 9]


class TestHeights:
    def test_a_branch_that_runs_off_does_not_flatten_the_others(self):
        """An end that climbs to a million within a fiftieth of the parameter's range."""
        eta = np.concatenate((np.linspace(12.0, -20.0, 50), -20.0 - np.geomspace(1e-6, 0.7, 50)))
        velocity = middle(eta) + 1.0 / np.clip(-19.3 - eta, 1e-6, None) * (eta < -20.0)
        velocity[-1] = 1e6
        low, high = OrbitBranches.of(cascade(60, branch(eta, velocity, True)), "velocity").ylim
        assert low < 2.6
        assert 9.0 < high < 9.0 + 2.0 * np.ptp(doubled([-60.0]))

    def test_orbits_that_do_not_change_are_not_blown_up(self):
        eta = np.linspace(0.0, -10.0, 11)
        rounding = 3.0 + 1e-13 * np.sin(7.0 * eta)
        low, high = OrbitBranches.of(dataset_of(branch(eta, rounding, True)), "velocity").ylim
        assert high - low >= 0.02 * 3.0


class TestBeneath:
    def test_points_are_grey_and_behind_the_curves(self):
        beneath = diagram(300, follow="eta")
        beneath["velocity"][{"branch": 1}] = 9.5
        beneath["velocity"][{"branch": 1, "eta": 100, "period": 3}] = 40.0
        figure = wb.plot(cascade(), beneath=beneath, width=style.COLUMN)
        (axes,) = data_axes(figure)
        assert axes.get_ylim()[1] > 40.0  # all are within
        image = Pixels(figure)
        for velocity in (3.0, 9.5):  # of both branches
            points = image.around(axes, -50.0, velocity, 2)
            assert np.max(np.ptp(points, axis=1)) < 0.01  # no colour
            assert 0.1 < min(map(luminance, points)) < 0.5
        # Chaos lies about the curve of T at eta = 0, which covers it.
        assert close(image.at(axes, 0.0, float(middle(0.0))), orbit_colour(1))
        assert "simulated points" in words(figure)

    def test_the_axis_is_logarithmic_with_the_sweep(self):
        values = np.geomspace(0.01, 0.1, 40)
        dataset = dataset_of(branch(values, 3.0 + values, True), parameter="F0", attributes=F0)
        beneath = diagram(40).rename(eta="F0").assign_coords(F0=("F0", values, F0))
        (axes,) = data_axes(wb.plot(dataset, beneath=beneath))
        assert axes.get_xscale() == "log"
        assert data_axes(wb.plot(dataset))[0].get_xscale() == "linear"


class TestBifurcations:
    def test_every_point_of_an_orbit_is_marked(self):
        data = OrbitBranches.of(cascade(60, loop()), "velocity")
        assert set(data.kinds) == {"fold", "grazing", "period doubling"}
        assert data.points("fold") == pytest.approx(np.array([[-28.0, v] for v in (1.2, 2.6, 8.5)]))
        upper, lower = doubled([AGAIN])[0]
        assert data.points("period doubling") == pytest.approx(
            np.array([[DOUBLED, middle(DOUBLED)], [AGAIN, upper], [AGAIN, lower]])
        )
        figure = wb.plot(cascade(60, loop()))
        # Each parameter has its letters once.
        assert sorted(letters(figure)) == ["G", "LP", "PD", "PD"]
        assert words(figure)[-3:] == ["LP: fold", "PD: period doubling", "G: grazing"]
        assert "D" in [line.get_marker() for line in data_axes(figure)[0].lines]

    def test_one_label_for_branches_that_bifurcate_together(self):
        """A pair of orbits, each the other's image, doubles its period at one parameter."""
        eta = np.linspace(0.0, -10.0, 11)
        found = ("period doubling", 5), ("fold", 5)
        pair = [branch(eta, middle(eta) + shift, True, *found) for shift in (0.0, 2.0)]
        data = OrbitBranches.of(dataset_of(*pair), "velocity")
        sizes = {word: len(points) for word, points in data.letters()}
        assert sizes == {"LP": 2, "PD": 2}

    def test_thirty_have_room_and_of_more_smooth_ones_come_first(self):
        every = [one.letters for one in BIFURCATIONS.values()]
        among = [one for number, one in enumerate(every) for _ in range(number, 30, len(every))]
        assert letters(picture("crowd")) == among
        said = letters(wb.plot(crowd(200), width=style.COLUMN))
        assert 20 < len(said) < 200
        assert said.count(every[0]) == max(map(said.count, every)) > said.count(every[-1])

    @pytest.mark.parametrize("name", ["cascade", "exponent", "crowd"])
    def test_letters_touch_nothing(self, name):
        """Neither curves nor symbols nor each other, and they are inside the axes."""
        figure = picture(name)
        renderer = FigureCanvasAgg(figure).get_renderer()
        figure.draw(renderer)
        (axes,) = data_axes(figure)
        # An annotation's own extent takes in its line.
        boxes = [super(type(t), t).get_window_extent(renderer) for t in axes.texts]
        assert boxes
        for one, other in itertools.combinations(boxes, 2):
            assert not one.overlaps(other)
        inside = axes.get_window_extent(renderer)
        drawn = []
        for line in axes.lines:
            points = axes.transData.transform(line.get_xydata())
            drawn += [points] if line.get_linestyle() == "None" else [
                np.linspace(a, b, 50) for a, b in itertools.pairwise(points)
            ]  # fmt: skip
        points = np.concatenate(drawn[1:] if name == "exponent" else drawn)  # without the zero line
        for box in boxes:
            assert inside.x0 < box.x0 < box.x1 < inside.x1
            assert inside.y0 < box.y0 < box.y1 < inside.y1
            # The extent of letters has room for others' ascents and descents.
            across = np.abs(points[:, 0] - (box.x0 + box.x1) / 2) < box.width / 2
            assert not np.any(
                across & (np.abs(points[:, 1] - (box.y0 + box.y1) / 2) < 0.33 * box.height)
            )

    def test_letters_stand_at_their_own_symbol(self):
        """The nearest symbol of all is of the kind that they name, or a line leads to it."""
        figure = wb.plot(crowd(80), width=style.COLUMN)
        figure.draw_without_rendering()
        (axes,) = data_axes(figure)
        data = OrbitBranches.of(crowd(80), "velocity")
        near = [text for text in axes.texts if text.arrow_patch is None]
        assert len(near) > 5
        for text in near:
            offset = np.array(text.get_position()) * figure.dpi / 72.0
            place = axes.transData.transform(text.xy) + offset
            distances = {
                one.letters: np.hypot(*(axes.transData.transform(data.points(kind)) - place).T)
                for kind, one in BIFURCATIONS.items()
            }
            nearest = min(np.min(one) for one in distances.values())
            assert np.min(distances[text.get_text()]) < nearest + 0.5 * figure.dpi / 72.0


class TestBoundaries:
    @pytest.mark.parametrize("turned", [False, True])
    def test_alone(self, turned):
        (axes,) = data_axes(wb.plot(boundary_of(turned=turned)))
        (line,) = axes.lines
        ends = np.array([[-60.0, 0.02], [12.0, 0.08]])
        assert line.get_xydata()[[0, -1]] == pytest.approx(ends[:, ::-1] if turned else ends)
        assert axes.get_xlim() == ((0.0, 0.2) if turned else (-70.0, 20.0))

    @pytest.mark.parametrize("turned", [False, True])
    def test_over_a_map_in_any_order(self, turned):
        for dataset in (map_of(), map_of().transpose("F0", "eta")):
            (axes,) = data_axes(wb.plot(dataset, boundaries=[boundary_of(turned=turned)]))
            x, y = dataset["motion"].dims
            ends = {"eta": [-60.0, 12.0], "F0": [0.02, 0.08]}
            assert axes.lines[-1].get_xdata()[[0, -1]] == pytest.approx(ends[x])
            assert axes.lines[-1].get_ydata()[[0, -1]] == pytest.approx(ends[y])

    def test_legend(self):
        lines = [boundary_of("grazing-sliding"), boundary_of("fold", 2), boundary_of("fold", 1)]
        entries = curve_entries(curves_over(lines, ["eta", "F0"]))
        assert [one.label for one in entries] == ["fold of $T$, $2T$", "grazing-sliding of $T$"]

    def test_seen_on_every_class(self):
        """Contrast of 3 with what lies behind (WCAG 2, for graphics)."""
        behind = [one.over() for one in MOTIONS if one.opacity]
        lines = [boundary_of("branch point"), boundary_of("grazing", shift=0.02)]
        figure = style.new_figure(8.0, 6.0)
        panels = figure.subplots(3, 5).ravel()[: len(behind)]
        for axes, colour in zip(panels, behind, strict=True):
            axes.set_facecolor(colour)
            maps.draw_curves(axes, curves_over(lines, ["eta", "F0"]))
        image = Pixels(figure, 200)
        for (axes, colour), up in itertools.product(zip(panels, behind, strict=True), (0.05, 0.07)):
            paper = luminance(colour)
            seen = map(luminance, image.around(axes, -24.0, up, 12))
            contrast = [(max(paper, one) + 0.05) / (min(paper, one) + 0.05) for one in seen]
            assert max(contrast) > 3.0


def other_boundary():
    other = boundary_of().rename(eta="alpha")
    other.attrs["parameters"] = ["alpha", "F0"]
    return other


@pytest.mark.parametrize(
    ("call", "argument"),
    [
        (lambda: orbit_branches.orbits(diagram()), "dataset.*wb.branches"),
        (lambda: wb.plot(cascade(), quantity="stick_shar"), "quantity.*'stick_share'"),
        (lambda: wb.plot(cascade(), benaeth=None), "benaeth.*'beneath'"),
        (lambda: wb.plot(cascade().drop_vars("branch_order")), "branch_order"),
        (lambda: wb.plot(cascade(), beneath=map_of()), "beneath.*eta, F0"),
        (lambda: wb.plot(cascade(), beneath=cascade()), "beneath"),
        (lambda: wb.plot(cascade(), quantity="stick_share", beneath=diagram()), "beneath"),
        (lambda: wb.plot(cascade(), beneath=diagram().drop_vars("velocity")), "velocity"),
        (lambda: wb.plot(map_of(), boundaries=[boundary_of(), other_boundary()]), r"\[1\].*alpha"),
        (lambda: wb.plot(map_of(), boundaries=boundary_of()), "boundaries = Dataset"),
        (lambda: wb.plot(map_of(), boundaries=[map_of()]), r"boundaries\[0\].*wb.boundary"),
        (lambda: maps.boundary(map_of()), "dataset.*wb.boundary"),
    ],
)
def test_wrong_datasets_are_refused(call, argument):
    with pytest.raises(wb.InputError, match=argument):
        call()
