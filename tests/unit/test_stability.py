"""Linear stability beyond the paper: margins, locking, degenerate systems, maps."""

import numpy as np
import pytest

import wedgebrake as wb


def test_a_map_agrees_with_the_verdict_point_by_point():
    base = wb.paper.system()
    eta, alpha, kinetic = [-24.0, -0.05, 0.0, 90.0], [0.9, 1.02, 1.4], [0.1, 0.3]
    chart = wb.stability_map(base, eta=eta, alpha=alpha, kinetic=kinetic)
    assert chart.sizes == {"eta": 4, "alpha": 3, "kinetic": 2}
    for e in eta:
        for a in alpha:
            for m in kinetic:
                # The map varies mu_k at fixed groups: the slope follows eta.
                one = wb.stability(base.replace(kinetic=m, static=m).replace(eta=e, alpha=a))
                here = chart.sel(eta=e, alpha=a, kinetic=m)
                directions = [d for d in (one.forward, one.backward) if not d.locked]
                assert bool(here.locked) == one.forward.locked
                assert bool(here.stable) == one.stable
                assert float(here.margin) == pytest.approx(one.margin_eta, abs=1e-12)
                worst = max(z.real for d in directions for z in d.eigenvalues) / 100.0
                assert float(here.growth) == pytest.approx(worst, rel=1e-9, abs=1e-12)


def test_a_map_of_a_brake_without_an_angle():
    base = wb.paper.system().replace(brake=wb.BandBrake(wrap_angle=4.0, radius=0.2))
    chart = wb.stability_map(base, kinetic=[0.2, 0.3], eta=[-0.1])
    for m in (0.2, 0.3):
        one = wb.stability(base.replace(kinetic=m, static=m).replace(eta=-0.1))
        assert float(chart.margin.sel(kinetic=m)[0]) == pytest.approx(one.margin_eta, rel=1e-12)


@pytest.mark.parametrize(
    ("axes", "words"),
    [
        ({}, "none given"),
        ({"etta": [1.0]}, "Did you mean 'eta'"),
        ({"alpha": []}, "not empty"),
        ({"alpha": [0.0, 1.0]}, "greater than 0"),
        ({"eta": [np.nan]}, "finite"),
        ({"eta": "x"}, "array of numbers"),
    ],
)
def test_wrong_axes(axes, words):
    with pytest.raises(wb.InputError, match=words):
        wb.stability_map(wb.paper.system(), **axes)


def test_self_locking_is_said_plainly():
    kinetic = wb.stability(wb.paper.system(alpha=0.9))
    assert kinetic.self_locking == "kinetic"
    assert kinetic.forward.locked
    assert "no forward sliding exists" in kinetic.verdict
    static = wb.stability(wb.paper.system(alpha=1.05, static=0.33))
    assert static.self_locking == "static"
    assert "slide forwards once moving" in static.verdict


def test_without_damping_the_points_are_slopes():
    found = wb.stability(wb.paper.system().replace(damping=0.0))
    assert found.forward.hopf_eta is None
    assert found.forward.hopf_slope == 0.0
    assert found.margin_slope == pytest.approx(-40.0)


def test_without_friction_or_spring():
    frictionless = wb.stability(wb.paper.system().replace(kinetic=0.0, static=0.0))
    assert frictionless.stable
    assert frictionless.forward.hopf_slope is None
    free = wb.stability(wb.paper.system(eta=0.0).replace(stiffness=0.0))
    assert not free.stable  # a free shaft never comes back
    assert free.forward.eigenvalues[0] == 0.0
