"""Sweeps in which several parameters of a machine have the same value."""

from __future__ import annotations

import numpy as np
import pytest

import wedgebrake as wb
from wedgebrake.cli.assignments import parse_axes
from wedgebrake.model.studies.study import parse_study

NAMES = ("c1.base_speed", "c2.base_speed")
BOTH = ",".join(NAMES)
SPEEDS = [0.4, 0.8, 1.6]


def contact(on, name):
    return wb.Contact(
        on, name=name, brake=wb.ConventionalBrake(radius=1.0), base_speed=0.5,
        friction=wb.CoulombFriction(kinetic=0.5, static=1.0),
        actuation=wb.Actuation(initial_force=1.0),
    )  # fmt: skip


MACHINE = wb.Machine(
    inertias=[wb.Inertia("a", 1.0), wb.Inertia("b", 1.0)],
    shafts=[wb.Shaft("a", "ground", 1.0), wb.Shaft("b", "ground", 2.0), wb.Shaft("a", "b", 0.5)],
    contacts=[contact("a", "c1"), contact("b", "c2")],
)


def test_each_point_has_both_values():
    swept = wb.sweep(MACHINE, {NAMES: SPEEDS}, crossings=5)
    assert list(swept[BOTH]) == SPEEDS
    for speed in SPEEDS:
        alone = wb.sweep(
            MACHINE.replace({"c2.base_speed": speed}), {NAMES[0]: [speed]}, crossings=5
        )
        found = swept.sel({BOTH: speed})
        for name in ("motion", "motion_period", "rms_velocity"):
            assert np.array_equal(found[name], alone[name].isel({NAMES[0]: 0}), equal_nan=True)


def test_maps_of_stability():
    found = wb.stability_map(MACHINE, {NAMES: SPEEDS})
    for speed in SPEEDS:
        own = wb.stability(MACHINE.replace(dict.fromkeys(NAMES, speed)))
        assert found["growth_rate"].sel({BOTH: speed}) == own.growth_rate


def test_command_line_and_study():
    ((name, values),) = parse_axes([f"{NAMES[0]}, {NAMES[1]}=30 rpm:60 rpm:5"], MACHINE)
    assert name == BOTH
    assert dict(values)["to"] == pytest.approx(2.0 * np.pi)
    study = parse_study({**MACHINE.as_dict(), "sweep": {BOTH: SPEEDS}})
    assert study.sweep.axes == ((BOTH, tuple(SPEEDS)),)


@pytest.mark.parametrize(
    "axes",
    [
        {("c1.base_speed", "c2.slope"): SPEEDS}, {("c1.base_speed", "c3.base_speed"): SPEEDS},
        {("c1.base_speed", "c1.base_speed"): SPEEDS}, {NAMES: SPEEDS, "c2.base_speed": SPEEDS},
    ],
)  # fmt: skip
def test_impossible_ties_are_refused(axes):
    with pytest.raises(wb.InputError) as error:
        wb.sweep(MACHINE, axes)
    assert error.value.name
