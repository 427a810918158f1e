"""Rows of the machine's panel, and the ranges of their sliders."""

from __future__ import annotations

import itertools
import math

import pytest
from states import new_state

import wedgebrake as wb
from wedgebrake.explorer.core.fields import Row, sections
from wedgebrake.explorer.core.formatting import parsed_numbers
from wedgebrake.explorer.core.parameter_ranges import span
from wedgebrake.explorer.core.state import PageState, axes
from wedgebrake.model.brakes import Brake
from wedgebrake.model.friction import Friction
from wedgebrake.model.system import PARTS

KINDS = list(
    itertools.product(sorted(Brake.kinds), ("coulomb", "smoothed", "stribeck", "tabulated"))
)


def _paper(**changes) -> PageState:
    return new_state(wb.paper.system()).edited(**changes)


def _rows(state: PageState) -> dict[str, Row]:
    return {row.name: row for rows in sections(state).values() for row in rows}


@pytest.mark.parametrize(("brake", "friction"), KINDS)
def test_every_parameter_has_one_row_whose_slider_can_be_taken(brake, friction):
    state = _paper(brake=brake, friction=friction)
    names = [row.name for rows in sections(state).values() for row in rows]
    assert len(names) == len(set(names))
    rows = _rows(state)
    for part in PARTS:
        model = type(getattr(state.system, part))
        for name in set(model.model_fields) - model.later:
            assert rows[name].value == state.value(name)
    assert rows["brake"].value == brake
    assert {value for value, _ in rows["brake"].choices} == set(Brake.kinds)
    assert {value for value, _ in rows["friction"].choices} == set(Friction.kinds)
    assert ("kinetic" in rows) == (friction != "tabulated")
    assert ("alpha" in rows) == (brake == "wedge")
    for row in rows.values():
        if row.kind == "number":
            assert row.low < row.high
            assert row.low <= row.value <= row.high
            for end in (row.low, row.high):
                state.edited(**{row.name: round(end) if row.whole else end})


@pytest.mark.parametrize("name", axes(wb.paper.system()))
def test_a_range_does_not_drift_with_the_value_inside_it(name):
    state = _paper()
    low, high = span(state, name)
    for part in (0.0, 0.3, 0.7, 1.0):
        assert span(state.edited(**{name: low + part * (high - low)}), name) == (low, high)


def scaled(system, inertia: float, time: float, force: float) -> wb.BrakedDriveline:
    """The same machine with other units of mass, time and force; angles have no unit."""
    line, torque, act = system.driveline, system.excitation, system.actuation
    return system.replace(
        inertia=line.inertia * inertia, stiffness=line.stiffness * inertia / time**2,
        damping=line.damping * inertia / time, drive_speed=line.drive_speed / time,
        initial_force=act.initial_force * force, slope=act.slope * force * time,
        radius=system.brake.radius * inertia / time**2 / force,
        amplitude=torque.amplitude * inertia / time**2, frequency=torque.frequency / time,
    )  # fmt: skip


@pytest.mark.parametrize("amplitude", [500.0, 0.0])
@pytest.mark.parametrize("drive", [0.0, 2.0])
def test_ranges_are_those_of_the_study(amplitude, drive):
    """In other units they are the same ranges; rounding to 1, 2, 5 is harmless for powers of 10."""
    one = wb.paper.system().replace(amplitude=amplitude, drive_speed=drive)
    other = scaled(one, inertia=1e-4, time=1e-2, force=1e-3)
    here, there = new_state(one), new_state(other)
    for name in (*axes(one), "initial_angle", "initial_velocity"):
        size = other.value(name) / one.value(name) if name in axes(one) and one.value(name) else 0.0
        low, high = span(here, name)
        if name == "initial_velocity" or (name == "drive_speed" and not drive):
            size = 100.0
        if name == "initial_angle":
            size = 1.0
        if size:
            assert span(there, name) == pytest.approx((low * size, high * size), rel=1e-6), name
    natural = one.driveline.natural_frequency / (2.0 * math.pi)
    low, high = span(here, "frequency")
    assert low < 0.5 * natural < 2.0 * natural < high


def test_the_range_that_the_user_set_is_taken_and_the_slider_still_holds_the_value():
    state = _paper(spans={"eta": (-35.0, -25.0)})
    assert span(state, "eta") == (-35.0, -25.0)
    row = _rows(state)["eta"]
    assert (row.low, row.high) == (-35.0, -20.0)


@pytest.mark.parametrize(
    ("text", "numbers"),
    [
        ("-6,5", [-6.5]), ("−6.5", [-6.5]), ("0.3; 0.29  0.28", [0.3, 0.29, 0.28]),
        ("0.3, 0.28", [0.3, 0.28]), ("", None), ("stiff", None), ("1e400", None), ("nan", None),
        ("1 " * 5000, None),
    ],
)  # fmt: skip
def test_numbers_as_they_are_typed(text, numbers):
    assert parsed_numbers(text) == numbers
