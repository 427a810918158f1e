"""Pictures of orbits and of boundaries: curves, symbols and letters where they belong."""

from __future__ import annotations

import functools
import itertools
import json

import numpy as np
import pytest
import xarray as xr
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_rgb
from test_sweep_plots import (
    SIGHTS,
    Pixels,
    check_layout,
    close,
    data_axes,
    diagram,
    lab,
    luminance,
    map_of,
    words,
)

import wedgebrake as wb
from wedgebrake.figures.matplotlib import class_styles, codim2, orbit_branches, regime, style
from wedgebrake.figures.matplotlib.draw import plot

SYSTEM = wb.paper.system()
UNITS = {
    "angle": ("rad", "angle at the section"),
    "velocity": ("rad/s", "velocity at the section"),
    "velocity_amplitude": ("rad/s", "half the range of the velocity"),
    "angle_amplitude": ("rad", "half the range of the angle"),
    "stick_share": ("1", "share of time at rest relative to the brake"),
    "largest_exponent": ("1/s", "largest Lyapunov exponent"),
}
ETA = {"units": "1", "long_name": "slope of the actuation force, delta R mu_k / c"}
F0 = {"units": "1", "long_name": "initial actuation force"}
# Period doublings of the branches below, the second of the first.
DOUBLED, AGAIN = -16.0, -24.0


def branch(eta, velocity, stable, *found, origin=-1):
    """Points of one branch; ``found`` are kinds of bifurcation and places among them."""
    velocity = np.asarray(velocity, dtype=float)
    return {
        "eta": np.asarray(eta, dtype=float),
        "velocity": velocity.reshape(len(eta), -1),
        "stable": np.broadcast_to(stable, len(eta)),
        "found": found,
        "origin": origin,
    }


def dataset_of(*branches, parameter="eta", attributes=ETA):
    """A dataset in the format of orbits; whole results are made up from the points."""
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
        "velocity_amplitude": 2.0 * whole,
        "angle_amplitude": 0.02 * whole,
        "stick_share": 0.05 * whole,
        "largest_exponent": np.where(stable, -1.0, 1.0) * np.abs(whole - 5.0),
    }
    data = {
        name: (("point", "return")[: value.ndim], value,
               dict(zip(("units", "long_name"), UNITS[name], strict=True)))
        for name, value in values.items()
    }  # fmt: skip
    found = [
        (kind, start + place, number)
        for number, (start, one) in enumerate(zip(starts, branches, strict=False))
        for kind, place in one["found"]
    ]
    eta = np.concatenate([np.empty(0), *(one["eta"] for one in branches)])
    data["stable"] = "point", stable
    data["order"] = "point", np.repeat(np.array(orders, np.int16), sizes)
    data["branch_order"] = "branch_number", np.array(orders, int)
    data["branch_origin"] = "branch_number", np.array([one["origin"] for one in branches], int)
    data["bifurcation_kind"] = "bifurcation", np.array([kind for kind, _, _ in found], object)
    data["bifurcation_point"] = "bifurcation", np.array([place for _, place, _ in found], int)
    data["bifurcation_branch"] = "bifurcation", np.array([number for _, _, number in found], int)
    data["bifurcation_value"] = "bifurcation", eta[[place for _, place, _ in found]]
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
    kinds = itertools.cycle(class_styles.BIFURCATIONS)
    places = np.linspace(5, 394, count).astype(int)
    found = zip(kinds, places.tolist(), strict=False)
    return dataset_of(branch(eta, middle(eta), True, *found))


ETA_SPAN, F0_SPAN = (-70.0, 20.0), (0.0, 0.2)


def boundary_of(kind="fold", order=1, *, number=30, turned=False, shift=0.0):
    """A straight line from (-60, 0.02) to (12, 0.08), upwards by a shift."""
    share = np.linspace(0.0, 1.0, number)
    coordinates = {
        "eta": ("point", -60.0 + 72.0 * share, ETA),
        "F0": ("point", 0.02 + 0.06 * share + shift, F0),
    }
    attrs = {
        "kind": "boundary",
        "bifurcation": kind,
        "parameters": ["F0", "eta"] if turned else ["eta", "F0"],
        "ranges": json.dumps([F0_SPAN, ETA_SPAN] if turned else [ETA_SPAN, F0_SPAN]),
        "system": json.dumps(SYSTEM.as_dict()),
        "groups": json.dumps(SYSTEM.groups.as_dict()),
    }
    return xr.Dataset(coords=coordinates, attrs={**attrs, "order": order})


def every_boundary():
    return [
        boundary_of(kind, 1 + place % 2, shift=0.012 * place - 0.05)
        for place, kind in enumerate(class_styles.BIFURCATIONS)
    ]


PICTURES = {
    "cascade": lambda: orbit_branches.orbits(cascade(60, loop()), beneath=diagram(300)),
    "cascade, column": lambda: orbit_branches.orbits(
        cascade(60, loop()), beneath=diagram(300), width=style.COLUMN
    ),
    "exponent": lambda: orbit_branches.orbits(cascade(), "largest_exponent", width=style.COLUMN),
    "crowd": lambda: orbit_branches.orbits(crowd()),
    "crowd, column": lambda: orbit_branches.orbits(crowd(), width=style.COLUMN),
    "boundaries": lambda: codim2.boundary(boundary_of(), boundaries=every_boundary()),
    "map": lambda: regime.regime_map(map_of(), boundaries=every_boundary()),
    "map, page": lambda: regime.regime_map(map_of(), boundaries=every_boundary(), width=style.PAGE),
}


@functools.cache
def picture(name):
    return PICTURES[name]()


def curves(figure, colour=None):
    """Lines of orbits: colour, whether solid, and points (n, 2)."""
    lines = [
        (line.get_color(), line.get_linestyle() == "-", line.get_xydata())
        for line in data_axes(figure)[0].lines
        if line.get_linestyle() != "None" and len(line.get_xdata()) > 2
    ]
    return [one for one in lines if colour is None or one[0] == colour]


def symbols(figure):
    """Places of symbols (n, 2) by their kind."""
    axes = data_axes(figure)[0]
    kinds = {look.symbol: kind for kind, look in class_styles.BIFURCATIONS.items()}
    return {
        kinds[line.get_marker()]: line.get_xydata()
        for line in axes.lines
        if line.get_linestyle() == "None"
    }


def letters(figure):
    return [text.get_text() for text in data_axes(figure)[0].texts]


@pytest.mark.parametrize("name", PICTURES)
def test_nothing_overlaps_and_nothing_is_cut(name):
    check_layout(picture(name))


@pytest.mark.parametrize("name", PICTURES)
def test_every_figure_says_what_was_computed_and_every_axis_its_unit(name):
    figure = picture(name)
    said = figure.get_suptitle().replace("\n", " ")
    assert "Wedge brake, Coulomb friction: $f = 0.63$" in said
    assert r"\eta =" not in said
    for axes in data_axes(figure):
        assert "[" in axes.get_xlabel()
        assert "[" in axes.get_ylabel()


class TestCurves:
    def test_stable_solid_unstable_dashed_without_gap(self):
        """T, 2T and 4T against the fork that they were made from."""
        dataset = cascade()
        figure = orbit_branches.orbits(dataset)
        (_, solid, right), (_, dashed, left) = curves(figure, class_styles.ORBITS[1].colour)
        assert (solid, dashed) == (True, False)
        assert right[[0, -1], 0] == pytest.approx([12.0, DOUBLED])
        assert left[[0, -1], 0] == pytest.approx([DOUBLED, -60.0])
        for line in (right, left):
            assert line[:, 1] == pytest.approx(middle(line[:, 0]))
        twice = curves(figure, class_styles.ORBITS[2].colour)
        ends = [(solid, line[0, 0], line[-1, 0]) for _, solid, line in twice]
        assert ends == [(True, DOUBLED, AGAIN)] * 2 + [(False, AGAIN, -60.0)] * 2
        for (_, _, line), column in zip(twice, (0, 1, 0, 1), strict=True):
            assert line[:, 1] == pytest.approx(doubled(line[:, 0])[:, column])
        four = curves(figure, class_styles.ORBITS[4].colour)
        assert [solid for _, solid, _ in four] == [True] * 4
        assert len(curves(figure)) == 2 + 4 + 4

    def test_rounding_at_a_bifurcation_changes_nothing(self):
        dataset = cascade(60, loop())
        other = dataset.copy(deep=True)
        at = [*dataset["bifurcation_point"].to_numpy(), *np.flatnonzero(
            (np.diff(dataset["branch"].to_numpy(), prepend=0) > 0)
            & (dataset["order"].to_numpy() != 3)
        )]  # fmt: skip
        # Not at the grazing, which leaves stability as it is.
        other["stable"][at[:-1]] = ~dataset["stable"][at[:-1]]
        for one, two in zip(
            curves(orbit_branches.orbits(dataset)),
            curves(orbit_branches.orbits(other)),
            strict=True,
        ):
            assert one[:2] == two[:2]
            assert one[2] == pytest.approx(two[2])

    def test_without_a_located_bifurcation_an_unstable_end_makes_it_unstable(self):
        eta = np.linspace(0.0, -10.0, 11)
        figure = orbit_branches.orbits(dataset_of(branch(eta, middle(eta), eta > -4.5)))
        (_, solid, first), (_, dashed, last) = curves(figure)
        assert (solid, dashed) == (True, False)
        assert first[-1, 0] == last[0, 0] == -4.0

    def test_branches_of_one_period_share_a_colour_and_a_legend_entry(self):
        eta = np.linspace(0.0, -10.0, 11)
        shifted = [branch(eta, middle(eta) + shift, True) for shift in (0.0, 1.0)]
        nine, twelve = (
            branch(eta, np.tile(middle(eta)[:, None], order) + np.arange(order), False)
            for order in (9, 12)
        )
        figure = orbit_branches.orbits(dataset_of(*shifted, nine, twelve))
        assert len(curves(figure, class_styles.ORBITS[1].colour)) == 2
        assert len(curves(figure, class_styles.OTHER_ORBITS.colour)) == 9 + 12
        assert words(figure) == ["$T$", "$9T$, $12T$", "stable", "unstable"]

    def test_a_branch_of_one_point_is_seen(self):
        figure = orbit_branches.orbits(dataset_of(branch([-5.0], [3.0], True)))
        (axes,) = data_axes(figure)
        assert close(Pixels(figure).at(axes, -5.0, 3.0), class_styles.ORBITS[1].colour)

    def test_no_orbits(self):
        figure = orbit_branches.orbits(dataset_of())
        figure.draw_without_rendering()
        assert letters(figure) == ["no orbits"]

    @pytest.mark.parametrize(
        ("quantity", "label", "scale"),
        [("angle", r"angle $\theta_n$  [rad]", 0.01),
         ("velocity_amplitude", "half the range of the velocity  [rad/s]", 2.0),
         ("angle_amplitude", "half the range of the angle  [rad]", 0.02),
         ("stick_share", "share of time at rest relative to the brake  [1]", 0.05)],
    )  # fmt: skip
    def test_other_quantities(self, quantity, label, scale):
        figure = plot(cascade(), quantity=quantity)
        assert data_axes(figure)[0].get_ylabel() == label
        (_, _, right), (_, _, left) = curves(figure, class_styles.ORBITS[1].colour)
        for line in (right, left):
            assert line[:, 1] == pytest.approx(scale * middle(line[:, 0]))
        count = 2 if quantity == "angle" else 1
        assert len(curves(figure, class_styles.ORBITS[2].colour)) == 2 * count

    def test_infinite_exponents_are_left_out(self):
        """Orbits with a stick forget their start: a multiplier is zero."""
        dataset = cascade()
        dataset["largest_exponent"][5:10] = -np.inf
        figure = plot(dataset, quantity="largest_exponent")
        low, high = data_axes(figure)[0].get_ylim()
        known = dataset["largest_exponent"].where(np.isfinite(dataset["largest_exponent"]))
        assert low < float(known.min()) < float(known.max()) < high
        assert low > -10.0
        (_, _, right), _ = curves(figure, class_styles.ORBITS[1].colour)
        assert list(np.flatnonzero(np.isnan(right[:, 1]))) == [5, 6, 7, 8, 9]


class TestHeights:
    def test_all_is_shown(self):
        dataset = cascade(60, loop())
        low, high = data_axes(orbit_branches.orbits(dataset))[0].get_ylim()
        assert low < float(dataset["velocity"].min()) < float(dataset["velocity"].max()) < high

    def test_a_branch_that_runs_off_does_not_flatten_the_others(self):
        """An end that climbs to a million within a fiftieth of the parameter's range."""
        eta = np.concatenate((np.linspace(12.0, -20.0, 50), -20.0 - np.geomspace(1e-6, 0.7, 50)))
        velocity = middle(eta) + 1.0 / np.clip(-19.3 - eta, 1e-6, None) * (eta < -20.0)
        velocity[-1] = 1e6
        assert np.max(velocity) == 1e6
        low, high = data_axes(orbit_branches.orbits(cascade(60, branch(eta, velocity, True))))[
            0
        ].get_ylim()
        spread = np.ptp(doubled([-60.0]))
        assert low < 2.6
        assert 9.0 < high < 9.0 + 2.0 * spread

    def test_points_beneath_are_within(self):
        beneath = diagram(300)
        beneath["velocity"][{"eta": 100, "period": 3}] = 40.0
        low, high = data_axes(orbit_branches.orbits(cascade(), beneath=beneath))[0].get_ylim()
        assert low < 1.0
        assert high > 40.0

    def test_orbits_that_do_not_change_are_not_blown_up(self):
        eta = np.linspace(0.0, -10.0, 11)
        rounding = 3.0 + 1e-13 * np.sin(7.0 * eta)
        low, high = data_axes(orbit_branches.orbits(dataset_of(branch(eta, rounding, True))))[
            0
        ].get_ylim()
        assert high - low >= 0.02 * 3.0


class TestBeneath:
    def test_points_are_grey_and_behind_the_curves(self):
        beneath = diagram(300)
        figure = orbit_branches.orbits(cascade(), beneath=beneath)
        (axes,) = data_axes(figure)
        image = Pixels(figure)
        points = image.around(axes, -50.0, 3.0, 2)
        assert np.max(np.ptp(points, axis=1)) < 0.01  # no colour
        assert 0.1 < min(map(luminance, points)) < 0.5
        # Chaos lies about the curve of T at eta = 0, which covers it.
        assert close(image.at(axes, 0.0, float(middle(0.0))), class_styles.ORBITS[1].colour)
        assert "simulated points" in words(figure)
        said = figure.get_suptitle().split("\n")
        assert said[1:] == [
            r"Exact solution; periodic orbits followed over $\eta$",
            "Grey: exact solution; 250 periods, the first 200 left out; from (0, 0)",
        ]

    def test_both_branches_of_a_sweep_that_follows(self):
        beneath = diagram(300, follow="eta")
        beneath["velocity"][{"branch": 1}] = 8.0
        (axes,) = data_axes(figure := orbit_branches.orbits(cascade(), beneath=beneath))
        image = Pixels(figure)
        for velocity in (3.0, 8.0):
            assert min(map(luminance, image.around(axes, -45.0, velocity, 2))) < 0.5

    def test_the_axis_is_logarithmic_with_the_sweep(self):
        values = np.geomspace(0.01, 0.1, 40)
        dataset = dataset_of(branch(values, 3.0 + values, True), parameter="F0", attributes=F0)
        beneath = diagram(40).rename(eta="F0").assign_coords(F0=("F0", values, F0))
        (axes,) = data_axes(figure := plot(dataset, beneath=beneath))
        figure.draw_without_rendering()
        assert axes.get_xscale() == "log"
        assert "$0.02$" in [tick.get_text() for tick in axes.get_xticklabels()]
        assert data_axes(plot(dataset))[0].get_xscale() == "linear"

    def test_wrong_datasets(self):
        for beneath, why in ((map_of(), "is swept over eta, F0"), (cascade(), "is no sweep")):
            with pytest.raises(wb.InputError, match=rf"beneath = Dataset: {why}.*eta=\.\.\."):
                plot(cascade(), beneath=beneath)
        with pytest.raises(wb.InputError, match=r"beneath: .*stick_share.*'angle' or 'velocity'"):
            plot(cascade(), quantity="stick_share", beneath=diagram())
        with pytest.raises(wb.InputError, match="no velocity over period"):
            plot(cascade(), beneath=diagram().drop_vars("velocity"))


class TestBifurcations:
    def test_every_point_of_an_orbit_is_marked(self):
        figure = orbit_branches.orbits(cascade(60, loop()))
        found = symbols(figure)
        assert set(found) == {"fold", "grazing", "period doubling"}
        assert found["fold"] == pytest.approx(np.array([[-28.0, v] for v in (1.2, 2.6, 8.5)]))
        upper, lower = doubled([AGAIN])[0]
        assert found["period doubling"] == pytest.approx(
            np.array([[DOUBLED, middle(DOUBLED)], [AGAIN, upper], [AGAIN, lower]])
        )
        # Each parameter has its letters once.
        assert sorted(letters(figure)) == ["G", "LP", "PD", "PD"]
        assert words(figure)[-3:] == ["LP: fold", "PD: period doubling", "G: grazing"]

    def test_one_label_for_branches_that_bifurcate_together(self):
        """A pair of orbits, each the other's image, doubles its period at one parameter."""
        eta = np.linspace(0.0, -10.0, 11)
        pair = [
            branch(eta, middle(eta) + shift, True, ("period doubling", 5), ("fold", 5))
            for shift in (0.0, 2.0)
        ]
        figure = orbit_branches.orbits(dataset_of(*pair))
        assert sorted(letters(figure)) == ["LP", "PD"]
        assert len(symbols(figure)["fold"]) == 2

    @pytest.mark.parametrize("width", [style.COLUMN, style.PAGE])
    def test_thirty_have_room(self, width):
        figure = orbit_branches.orbits(crowd(30), width=width)
        assert sum(map(len, symbols(figure).values())) == 30
        expected = [look.letters for look in class_styles.BIFURCATIONS.values() for _ in range(3)]
        assert letters(figure) == expected

    def test_where_room_is_short_smooth_ones_are_labelled(self):
        figure = orbit_branches.orbits(crowd(200), width=style.COLUMN)
        assert sum(map(len, symbols(figure).values())) == 200
        said = letters(figure)
        assert 20 < len(said) < 200
        counts = [said.count(look.letters) for look in class_styles.BIFURCATIONS.values()]
        assert counts[0] == max(counts)
        assert counts[0] > counts[-1]

    @pytest.mark.parametrize(
        "name", ["cascade", "cascade, column", "exponent", "crowd", "crowd, column"]
    )
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
        dense = [
            np.concatenate([np.linspace(a, b, 50) for a, b in itertools.pairwise(
                axes.transData.transform(line))])
            for _, _, line in curves(figure)
        ]  # fmt: skip
        marks = [axes.transData.transform(points) for points in symbols(figure).values()]
        for box in boxes:
            assert inside.x0 < box.x0 < box.x1 < inside.x1
            assert inside.y0 < box.y0 < box.y1 < inside.y1
            for points in (*dense, *marks):
                # The extent of letters has room for others' ascents and descents.
                touched = (np.abs(points[:, 0] - (box.x0 + box.x1) / 2) < box.width / 2) & (
                    np.abs(points[:, 1] - (box.y0 + box.y1) / 2) < 0.33 * box.height
                )
                assert not np.any(touched)

    @pytest.mark.parametrize("count", [30, 80])
    def test_letters_stand_at_their_own_symbol(self, count):
        """The nearest symbol of all is of the kind that they name, or a line leads to it."""
        figure = orbit_branches.orbits(crowd(count), width=style.COLUMN)
        figure.draw_without_rendering()
        (axes,) = data_axes(figure)
        near = [text for text in axes.texts if text.arrow_patch is None]
        assert len(near) > 5
        for text in near:
            (kind,) = [
                k for k, one in class_styles.BIFURCATIONS.items() if one.letters == text.get_text()
            ]
            offset = np.array(text.get_position()) * figure.dpi / 72.0
            place = axes.transData.transform(text.xy) + offset
            distances = {
                other: np.min(np.hypot(*(axes.transData.transform(points) - place).T))
                for other, points in symbols(figure).items()
            }
            assert distances[kind] < min(distances.values()) + 0.5 * figure.dpi / 72.0

    def test_points_outside_the_picture_get_no_letters(self):
        """At eta = -24 the branch that runs off is a thousand times as high."""
        eta = np.linspace(-23.9, -24.0, 20)
        off = branch(eta, np.geomspace(5.0, 5e3, 20), False, ("branch point", 19))
        assert sorted(letters(orbit_branches.orbits(cascade(60, off)))) == ["PD", "PD"]


class TestWrongDatasets:
    def test_no_orbits(self):
        for dataset in (diagram(), boundary_of(), None, 3):
            with pytest.raises(wb.InputError, match=r"dataset = \w+: .*wb\.branches"):
                orbit_branches.orbits(dataset)

    def test_quantities(self):
        with pytest.raises(wb.InputError, match=r"quantity = 'stick_shar'.*'stick_share'"):
            plot(cascade(), quantity="stick_shar")
        with pytest.raises(wb.InputError, match=r"quantity = 'order'"):
            plot(cascade(), quantity="order")

    def test_options_and_missing_parts(self):
        with pytest.raises(wb.InputError, match=r"benaeth: no option.*'orbits'.*'beneath'"):
            plot(cascade(), benaeth=None)
        with pytest.raises(wb.InputError, match=r"lacks .*branch_order.*wb\.branches"):
            plot(cascade().drop_vars("branch_order"))


class TestBoundaries:
    def test_front_door(self):
        figure = plot(boundary_of("period doubling", 2))
        (axes,) = data_axes(figure)
        assert axes.get_xlabel() == r"slope of the actuation force $\eta$  [1]"
        assert axes.get_ylabel() == "initial actuation force $F_0$  [1]"
        (line,) = axes.lines
        assert line.get_xydata()[[0, -1]] == pytest.approx(np.array([[-60.0, 0.02], [12.0, 0.08]]))
        assert words(figure) == ["period doubling of $2T$"]
        assert r"A bifurcation followed over $\eta$ and $F_0$" in figure.get_suptitle()
        (axes,) = data_axes(plot(boundary_of(turned=True)))
        assert axes.get_xlabel().startswith("initial")
        assert axes.lines[0].get_xdata()[-1] == pytest.approx(0.08)

    @pytest.mark.parametrize("turned", [False, True])
    def test_over_a_map_in_any_order(self, turned):
        dataset = map_of()
        for one in (dataset, dataset.transpose("F0", "eta")):
            (axes,) = data_axes(plot(one, boundaries=[boundary_of(turned=turned)]))
            (line,) = axes.lines
            x, y = one["motion"].dims
            ends = {"eta": [-60.0, 12.0], "F0": [0.02, 0.08]}
            assert line.get_xdata()[[0, -1]] == pytest.approx(ends[x])
            assert line.get_ydata()[[0, -1]] == pytest.approx(ends[y])
            assert axes.get_xlim()[0] == pytest.approx(data_axes(plot(one))[0].get_xlim()[0])

    def test_on_every_branch_and_on_axes_of_ones_own(self):
        maps = xr.concat([map_of(), map_of()], dim="branch", combine_attrs="override")
        maps = maps.assign_coords(branch=["up", "down"])
        figure = plot(maps, boundaries=[boundary_of()])
        assert [len(axes.lines) for axes in data_axes(figure)] == [1, 1]
        axes = style.new_figure().add_subplot()
        regime.draw(axes, map_of(), boundaries=[boundary_of(), boundary_of("grazing")])
        assert len(axes.lines) == 2

    def test_legend(self):
        lines = [boundary_of("grazing-sliding"), boundary_of("fold", 2), boundary_of("fold", 1)]
        said = words(plot(map_of(), boundaries=lines))
        assert said[-3:] == [
            "linear stability limit",
            "fold of $T$, $2T$",
            "grazing-sliding of $T$",
        ]
        assert said[:-2] == words(plot(map_of()))

    @pytest.mark.parametrize("kind", class_styles.BIFURCATIONS)
    @pytest.mark.parametrize(
        "behind", [look for look in class_styles.MOTIONS.values() if look.opacity]
    )
    def test_seen_on_every_class(self, kind, behind):
        """Contrast of 3 with what lies behind (WCAG 2, for graphics)."""
        figure = style.new_figure(2.0, 2.0)
        axes = figure.add_subplot()
        axes.set_facecolor(class_styles.blended(behind))
        codim2.draw(axes, ["eta", "F0"], [boundary_of(kind)])
        around = Pixels(figure, 300).around(axes, -24.0, 0.05, 12)
        paper = luminance(class_styles.blended(behind))
        seen = [luminance(one) for one in around]
        contrast = [(max(paper, one) + 0.05) / (min(paper, one) + 0.05) for one in seen]
        assert max(contrast) > 3.0

    def test_kinds_are_told_apart(self):
        lines = {}
        for kind in class_styles.BIFURCATIONS:
            axes = style.new_figure().add_subplot()
            regime.draw(axes, map_of(), boundaries=[boundary_of(kind)])
            (line,) = axes.lines
            lines[kind] = str((line.get_color(), line._dash_pattern))
        assert len(set(lines.values())) == len(class_styles.BIFURCATIONS)

    def test_wrong_boundaries(self):
        other = boundary_of().rename(eta="alpha")
        other.attrs["parameters"] = ["alpha", "F0"]
        for given in (plot, regime.regime_map):
            with pytest.raises(wb.InputError, match=r"boundaries\[1\].*alpha and F0.*eta and F0"):
                given(map_of(), boundaries=[boundary_of(), other])
        with pytest.raises(wb.InputError, match=r"boundaries\[0\].*alpha and F0.*eta and F0"):
            plot(boundary_of(), boundaries=[other])
        with pytest.raises(wb.InputError, match=r"boundaries = Dataset: must be a list"):
            plot(map_of(), boundaries=boundary_of())
        with pytest.raises(wb.InputError, match=r"boundaries\[0\] = Dataset: .*wb\.boundary"):
            plot(map_of(), boundaries=[map_of()])
        with pytest.raises(wb.InputError, match=r"dataset = Dataset: .*wb\.boundary"):
            codim2.boundary(map_of())


class TestColours:
    @pytest.mark.parametrize("sight", SIGHTS)
    def test_periods_differ_for_every_sight(self, sight):
        """Among each other and from the points beneath (CIE 1976; about 2.3 can be noticed)."""
        drawn = [look.colour for look in (*class_styles.ORBITS.values(), class_styles.OTHER_ORBITS)]
        seen = [lab(colour, sight) for colour in drawn]
        greys = [lab(colour, sight) for colour in style.DENSITY_BENEATH]
        least = min(np.linalg.norm(a - b) for a, b in itertools.combinations(seen, 2))
        assert least > 14.0
        assert min(np.linalg.norm(a - b) for a in seen for b in greys) > 14.0

    def test_lines_can_be_seen_on_white(self):
        for look in (*class_styles.ORBITS.values(), class_styles.OTHER_ORBITS):
            assert 1.05 / (luminance(to_rgb(look.colour)) + 0.05) > 3.0  # WCAG 2
