"""The picture of linear stability: its regions, its limit, its lines."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from pictures import words

import wedgebrake as wb
from wedgebrake.figures.data.class_map import LOCKED, REGIONS, STABLE, UNSTABLE
from wedgebrake.figures.data.class_map import stability_map as map_data
from wedgebrake.figures.matplotlib import maps

ETA, ALPHA = np.linspace(-2.0, 1.0, 61), np.linspace(0.9, 2.0, 45)


@pytest.fixture(scope="module")
def wedge():
    return wb.stability_map(wb.paper.system(), eta=ETA, alpha=ALPHA)


def test_colours_are_regions(wedge):
    """The limit is eta = mu_k - tan(angle), forwards; the brake locks below alpha = 1."""
    figure = wb.plot(wedge, width=5.0)
    (image,) = figure.axes[0].get_images()
    colours = image.cmap(image.norm(image.get_array()))[..., :3]
    alpha, eta = np.meshgrid(ALPHA, ETA, indexing="ij")
    limit = 0.3 * (1.0 - alpha)
    codes = np.where(alpha <= 1.0, LOCKED, np.where(eta > limit, STABLE, UNSTABLE))
    expected = np.array([to_rgb(one.colour) for one in REGIONS])[codes]
    clear = np.abs(eta - limit) > 1e-9
    assert colours[clear] == pytest.approx(expected[clear], abs=0.01)
    assert "linear stability limit" in words(figure)
    assert figure.get_figwidth() == 5.0


def test_the_limit_is_drawn_where_it_is(wedge):
    data = map_data(wedge)
    limits = wb.plot(wedge).axes[0].lines[: len(data.limit)]
    points = np.concatenate([line.get_xydata() for line in limits])
    np.testing.assert_allclose(points[:, 0], 0.3 * (1.0 - points[:, 1]), atol=1e-9)
    assert data.levels
    assert 0.0 not in dict(data.levels)
    for level, line in data.levels:
        np.testing.assert_allclose(line[:, 0] - 0.3 * (1.0 - line[:, 1]), level, atol=1e-9)


def test_axes_follow_the_dataset():
    """The first to the right; also on an axis of equal ratios, and with one region alone."""
    given = wb.stability_map(
        wb.paper.system(brake="conventional"),
        loss_factor=np.geomspace(1e-3, 1e-1, 9), kinetic=np.linspace(0.1, 0.5, 5),
    )  # fmt: skip
    data = map_data(given)
    assert data.x.log
    assert (data.x.name, data.y.name) == ("loss_factor", "kinetic")
    assert not data.limit
    axes = Figure().add_subplot()
    maps.draw(axes, data)
    assert axes.get_xscale() == "log"
    assert axes.get_legend() is None
