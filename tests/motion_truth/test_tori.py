"""Tori among random drivelines: most are proved, and no orbit is called a torus."""

from __future__ import annotations

import numpy as np
import pytest

import wedgebrake as wb

from .irregular import birkhoff_digits

# Longest orbit that is looked for, and periods after which it is.
_ORDER, _PERIODS = 1000, 200_000


def _truth(system: wb.BrakedDriveline) -> str:
    """The class of a motion that has not settled earlier, from its last points alone."""
    run = wb.poincare(system, periods=_PERIODS, transient=_PERIODS - 60_000)
    points = np.column_stack([run["angle"], run["velocity"]])
    span = np.ptp(points, axis=0)
    if not span.all():
        return "rest"
    apart = (np.abs(points[-1] - points[-2 : -_ORDER - 2 : -1]) / span).max(axis=1)
    for n in (np.flatnonzero(apart < 1e-8) + 1)[:5]:
        before, after = points[-1000 - n : -n], points[-1000:]
        if (np.abs(after - before) / span).max() < 1e-7:
            return "periodic"
    return "torus" if birkhoff_digits(points, span, 1) > 4.0 else "unclear"


@pytest.mark.parametrize(
    ("systems", "fewest"),
    [
        (40, 4),
        pytest.param(100, 10, marks=pytest.mark.slow),
        pytest.param(700, 100, marks=pytest.mark.slow),
    ],
)
def test_random_tori(systems, fewest) -> None:
    """Less than 1 in 10 is undecided; no orbit of up to 1000 periods is quasi-periodic."""
    rng = np.random.default_rng(11)
    tori, undecided, wrong = 0, 0, []
    for _ in range(systems):
        eta, F0, f, alpha = rng.uniform([-45.0, 0.01, 0.2, 1.05], [0.0, 0.1, 1.5, 2.5])
        system = wb.paper.system(eta=eta, F0=F0, f=f, alpha=alpha)
        found = wb.motion(system)
        if found.kind not in ("quasi-periodic", "undecided"):
            continue
        truth = _truth(system)
        tori += truth == "torus"
        undecided += truth == "torus" and found.kind == "undecided"
        if truth in ("periodic", "rest") and found.kind == "quasi-periodic":
            wrong.append((eta, F0, f, alpha))
    assert tori >= fewest
    assert not wrong
    assert undecided <= 0.1 * tori
