"""Pictures of sweeps and basins of machines: one inertia and one contact of several."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from test_machine_motion import belt, pair

import wedgebrake as wb
from wedgebrake.figures.data import basins as basins_data
from wedgebrake.figures.data.bifurcation import BifurcationDiagram
from wedgebrake.figures.data.caption import method_words
from wedgebrake.figures.data.parts import with_one_part
from wedgebrake.figures.data.response_diagram import natural_values

SPEEDS = np.array([0.5, 0.9, 1.6, 2.5])


@pytest.fixture(scope="module")
def sweep() -> Any:
    return wb.bifurcation(pair(), {"belt-a.base_speed": SPEEDS}, crossings=6)


@pytest.fixture(scope="module")
def basins() -> Any:
    start = {"mass.speed": np.linspace(-2.0, 2.0, 6), "mass.angle": [0.3, 0.6, 2.0]}
    return wb.basins(belt(1.3), start)


@pytest.mark.parametrize("inertia", ["a", "b"])
@pytest.mark.parametrize("quantity", ["angle", "velocity"])
def test_diagram_shows_the_inertia_that_is_named(sweep, inertia, quantity) -> None:
    data = BifurcationDiagram.of(with_one_part(sweep, inertia), quantity)
    np.testing.assert_array_equal(data.points[0], sweep[quantity].sel(inertia=inertia))
    first = BifurcationDiagram.of(sweep, quantity)
    np.testing.assert_array_equal(first.points[0], sweep[quantity].isel(inertia=0))


def _geared(**changes: Any) -> wb.Machine:
    """A wheel on a spring, turned through a gear; the spring ends at a driven body."""
    parts: dict[str, Any] = {
        "inertias": [wb.Inertia("motor", 0.1), wb.Inertia("wheel", 1.0), wb.Driven("base", 0.0)],
        "shafts": [wb.Shaft("wheel", "base", 100.0, damping=2.0)],
        "joints": [wb.Gear("motor", "wheel", 3.0)],
        "torques": [wb.Torque("motor", wb.Harmonic(1.0, 0.4), name="drive")],
        **changes,
    }
    return wb.Machine(**parts)


def test_natural_frequencies_over_a_frequency_include_joints_and_driven_bodies() -> None:
    values = np.array([0.3, 0.6])
    swept = wb.bifurcation(_geared(), {"drive.frequency": values}, periods=6)
    known = natural_values(swept, "drive.frequency")
    # The motor counts with the square of its ratio.
    np.testing.assert_allclose(known, [np.sqrt(100.0 / (1.0 + 9.0 * 0.1)) / (2.0 * np.pi)])


def test_basins_of_a_machine_with_joints_and_driven_bodies() -> None:
    """A linear machine has one attractor."""
    start = {"wheel.angle": [-0.2, 0.3], "wheel.speed": [-1.0, 1.0]}
    found = wb.basins(_geared(), start)
    np.testing.assert_array_equal(found["attractor"], 0)


@pytest.mark.parametrize("contact", ["belt-a", "belt-b"])
def test_diagram_shows_the_contact_that_is_named(sweep, contact) -> None:
    one = with_one_part(sweep, contact=contact)
    for name in ("stick_class", "stick_share", "peak_torque"):
        np.testing.assert_array_equal(one[name], sweep[name].sel(contact=contact))
    np.testing.assert_array_equal(one["largest_exponent"], sweep["exponents"][:, 0])


def test_the_axis_names_the_part_that_is_swept(sweep) -> None:
    """Two contacts have a speed of the base."""
    assert "belt-a" in BifurcationDiagram.of(sweep, "angle").x.label


def test_pictures_tell_a_tolerance_only_where_there_is_one() -> None:
    """The method smooth of a machine and of a set-valued law has none."""
    adaptive, curve, exact = (
        method_words(wb.bifurcation(system, eta=[-24.0], method=method, periods=4, transient=2))
        for system, method in (
            (wb.paper.system().replace(friction=wb.SmoothedFriction(kinetic=0.3)), "smooth"),
            (wb.paper.system(), "smooth"),
            (wb.paper.system(), "exact"),
        )
    )
    machine = wb.bifurcation(belt(1.3), {"belt.base_speed": [1.3]}, crossings=2, method="smooth")
    assert method_words(machine) == curve
    assert len({adaptive, curve, exact}) == 3


def test_pictures_are_drawn(sweep, basins) -> None:
    assert wb.plot(sweep).axes
    assert wb.plot(sweep, inertia="b", contact="belt-b", quantity="angle").axes
    assert wb.plot(sweep.sel(inertia="b")).axes
    assert wb.plot(basins).axes
    axes = {"belt-a.base_speed": SPEEDS[:2], "b.inertia": [1.0, 2.0]}
    regimes = wb.regime_map(pair(), axes)
    for quantity in ("motion", "stick_class", "peak_torque", "motion_period"):
        assert wb.plot(regimes, quantity=quantity, contact="belt-b").axes


def test_a_driveline_without_a_torque_has_a_stability_limit() -> None:
    """Its sweep counts crossings, and is drawn as before."""
    system = wb.paper.system(eta=-24, F0=0.036)
    still = system.replace(amplitude=0.0, drive_speed=2.0)
    found = wb.bifurcation(still, slope=np.linspace(-60.0, 5.0, 5), crossings=4)
    damping = [wb.stability(still.replace(slope=one)).damping for one in found["slope"].values]
    np.testing.assert_allclose(found["sliding_damping"], damping, rtol=1e-12)
    assert wb.plot(found).axes


def test_points_of_attractors_are_initial_conditions(basins) -> None:
    """In the order of the axes, whatever it is."""
    data = basins_data.of_dataset(basins)
    assert (data.x.name, data.y.name) == ("mass.speed", "mass.angle")
    place = int(np.argmax([one.label for one in data.marks] == np.array("1")))
    expected = basins["attractor_velocity"].values[place, :, 0]
    shown = data.marks[place].points[:, 0]
    known = expected[np.isfinite(expected)]
    assert set(shown) <= set(known)
