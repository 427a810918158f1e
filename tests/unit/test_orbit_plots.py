"""Pictures of orbits and of boundaries: curves, symbols and letters where they belong."""

from __future__ import annotations

import json

import numpy as np
import pytest
import xarray as xr
from pictures import (
    SYSTEM,
    check_layout,
    check_words,
    data_axes,
    map_of,
    words,
)

import wedgebrake as wb
from wedgebrake.figures.data.orbit_branches import OrbitBranches

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


def curves(dataset, order=None, quantity="velocity"):
    """Lines of orbits: whether stable, and points (n, 2)."""
    return [
        (one.stable, np.column_stack((one.x, one.y)))
        for one in OrbitBranches.of(dataset, quantity).curves
        if order is None or one.order == order
    ]


def letters(figure):
    return [text.get_text() for text in data_axes(figure)[0].texts]


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


class TestBoundaries:
    @pytest.mark.parametrize("turned", [False, True])
    def test_over_a_map_in_any_order(self, turned):
        for dataset in (map_of(), map_of().transpose("F0", "eta")):
            (axes,) = data_axes(wb.plot(dataset, boundaries=[boundary_of(turned=turned)]))
            x, y = dataset["motion"].dims
            ends = {"eta": [-60.0, 12.0], "F0": [0.02, 0.08]}
            assert axes.lines[-1].get_xdata()[[0, -1]] == pytest.approx(ends[x])
            assert axes.lines[-1].get_ydata()[[0, -1]] == pytest.approx(ends[y])


@pytest.mark.parametrize("width", [2.5, pytest.param(3.5, marks=pytest.mark.slow), 7.2])
def test_no_words_touch_at_any_width(width):
    lines = [boundary_of(), boundary_of("period doubling", 2, shift=0.01)]
    eta = np.linspace(-60.0, 0.0, 10)
    # Both axes have a label in their common corner.
    flat = dataset_of(branch(eta, 0.0 * eta, eta < 1.0))
    pictures = (
        wb.plot(flat, width=width),
        wb.plot(lines[0], width=width),
        wb.plot(map_of(), boundaries=lines, width=width),
        wb.plot(cascade(60, loop()), width=width),
    )
    for figure in pictures:
        check_words(figure)
        check_layout(figure)
