"""The picture of linear stability: its regions, its limit, its labels."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib.colors import to_rgb

import wedgebrake as wb
from wedgebrake.figures.matplotlib import stability

ETA, ALPHA = np.linspace(-2.0, 1.0, 61), np.linspace(0.9, 2.0, 45)


@pytest.fixture
def wedge():
    return wb.stability_map(wb.paper.system(), eta=ETA, alpha=ALPHA)


def words(figure) -> str:
    legends = [axes.get_legend() for axes in figure.axes]
    found = [text.get_text() for one in legends if one for text in one.get_texts()]
    return " ".join([figure.get_suptitle(), *found])


def test_is_what_plot_draws(wedge):
    figure = wb.plot(wedge, width=5.0)
    panel = figure.axes[0]
    assert figure.get_figwidth() == 5.0
    assert "slope of the actuation force" in panel.get_xlabel()
    assert r"$\alpha$" in panel.get_ylabel()
    text = words(figure)
    assert r"Wedge brake, Coulomb friction: $\mu_k = 0.3$, $c/\sqrt{kJ} = 0.001$" in text
    assert r"$\eta =" not in text
    for part in ("Wedge brake", "unstable", "stable: it decays", "locks itself", "limit"):
        assert part in text


def test_colours_are_regions(wedge):
    """Cell by cell: where the limit is eta = mu_k - tan(angle), forwards, and below alpha = 1."""
    (image,) = wb.plot(wedge).axes[0].get_images()
    colours = image.cmap(image.norm(image.get_array()))[..., :3]
    for row, alpha in enumerate(ALPHA):
        for column, eta in enumerate(ETA):
            limit = 0.3 * (1.0 - alpha)
            place = 2 if alpha <= 1.0 else int(eta > limit)
            if abs(eta - limit) > 1e-9:
                expected = to_rgb(stability._LOOKS[place].colour)
                assert tuple(colours[row, column]) == pytest.approx(expected, abs=0.01)


def test_the_limit_is_drawn_where_it_is(wedge):
    contours = wb.plot(wedge).axes[0].collections
    lines = [one for one in contours if np.allclose(getattr(one, "levels", [1.0]), 0.0)]
    (line,) = lines
    points = np.concatenate([path.vertices for path in line.get_paths()])
    np.testing.assert_allclose(points[:, 0], 0.3 * (1.0 - points[:, 1]), atol=1e-9)


def test_axes_go_as_they_are_given():
    """The first to the right; also on an axis of equal ratios, and with one region alone."""
    given = wb.stability_map(
        wb.paper.system(brake="conventional"),
        loss_factor=np.geomspace(1e-3, 1e-1, 9), kinetic=np.linspace(0.1, 0.5, 5),
    )  # fmt: skip
    figure = wb.plot(given)
    assert figure.axes[0].get_xscale() == "log"
    assert "Conventional brake" in words(figure)
    assert "limit" not in words(figure)


def test_can_be_drawn_on_axes_of_ones_own(wedge):
    from matplotlib.figure import Figure

    axes = Figure().add_subplot()
    stability.draw(axes, wedge)
    assert axes.get_images()
    assert axes.get_legend() is None


@pytest.mark.parametrize(
    ("given", "why"),
    [
        ({"eta": ETA}, r"^dataset: holds 61 of eta; there are pictures .* two groups"),
        ({"eta": [1.0], "alpha": ALPHA}, r"^dataset: holds 1 of eta, 45 of alpha"),
        ({"eta": ETA, "alpha": ALPHA, "kinetic": [0.3]}, r"61 of eta, 45 of alpha, 1 of kinetic"),
    ],
)
def test_of_other_maps_there_is_none(given, why):
    with pytest.raises(wb.InputError, match=why):
        wb.plot(wb.stability_map(wb.paper.system(), **given))


def test_of_anything_else_there_is_none(wedge):
    with pytest.raises(wb.InputError, match=r"must be the result of wb\.stability_map"):
        stability.stability_map(wedge.drop_vars("margin"))
    with pytest.raises(wb.InputError, match="quantity: no option of the picture"):
        wb.plot(wedge, quantity="margin")
