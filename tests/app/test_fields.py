"""Rows of the machine's panel, and the ranges of their sliders."""

from __future__ import annotations

import itertools
import math

import pytest

import wedgebrake as wb
from wedgebrake.errors import InputError
from wedgebrake.explorer.core.fields import Row, sections
from wedgebrake.explorer.core.formatting import parsed_numbers
from wedgebrake.explorer.core.parameter_ranges import scale, span
from wedgebrake.explorer.core.state import PageState, axes, new_state
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


@pytest.mark.parametrize(
    ("name", "wanted"),
    [
        ("eta", (-60.0, 12.0)), ("slope", (-100.0, 20.0)), ("amplitude", (150.0, 1800.0)),
        ("frequency", (3.1, 36.0)), ("angle", (0.26, 0.45)), ("initial_velocity", (-10.0, 10.0)),
    ],
)  # fmt: skip
def test_ranges_are_those_of_the_paper(name, wanted):
    assert span(_paper(), name) == wanted


@pytest.mark.parametrize("name", axes(wb.paper.system()))
def test_a_range_does_not_drift_with_the_value_inside_it(name):
    state = _paper()
    low, high = span(state, name)
    for part in (0.0, 0.3, 0.7, 1.0):
        assert span(state.edited(**{name: low + part * (high - low)}), name) == (low, high)


@pytest.mark.parametrize(
    ("changes", "name", "wanted"),
    [
        ({"eta": -75.0}, "eta", (-100.0, 12.0)),
        ({"eta": 13.0}, "eta", (-60.0, 20.0)),
        ({"F0": 0.003}, "F0", (0.002, 0.12)),
        ({"amplitude": 0.0}, "amplitude", (0.0, 2000.0)),
        ({"damping": 300.0}, "damping", (0.01, 500.0)),
        ({"damping": 0.0}, "damping", (0.01, 10.0)),
        ({"drive_speed": -11.0}, "drive_speed", (-20.0, 10.0)),
        ({"kinetic": 0.55, "static": 0.7}, "static", (0.55, 1.0)),
        ({"stiffness": 0.0}, "frequency", (2.0, 50.0)),
    ],
)
def test_a_range_reaches_to_a_value_outside_in_round_numbers(changes, name, wanted):
    assert span(_paper(**changes), name) == wanted


def test_the_range_that_the_user_set_is_taken_and_the_slider_still_holds_the_value():
    state = _paper(spans={"eta": (-35.0, -25.0)})
    assert span(state, "eta") == (-35.0, -25.0)
    row = _rows(state)["eta"]
    assert (row.low, row.high) == (-35.0, -20.0)


@pytest.mark.parametrize(
    ("name", "given", "wanted"),
    [
        ("alpha", (-1.0, 1.3), (0.9, 1.3)),
        ("alpha", (-1.0, 0.5), (0.0005, 0.5)),
        ("damping", (-1.0, 5.0), (0.01, 5.0)),
        ("kinetic", (-1.0, 9.0), (0.05, 5.0)),
        ("angle", (0.1, 3.0), (0.1, math.nextafter(math.pi / 2, 0.0))),
        ("static", (0.1, 0.5), (0.3, 0.5)),
        ("static", (0.1, 0.2), (0.3, 0.8)),
    ],
)
def test_of_a_range_that_is_impossible_the_possible_part_is_taken(name, given, wanted):
    assert span(_paper(spans={name: given}), name) == wanted


@pytest.mark.parametrize("name", axes(wb.paper.system()))
def test_what_goes_by_ratios_lies_above_zero(name):
    for spans in ({}, {name: (-5.0, 5.0)}, {name: (-7.0, -5.0)}):
        low, high = span(_paper(spans=spans).edited(damping=0.0, stiffness=0.0), name)
        assert low < high
        assert scale(name) == "linear" or low > 0.0


def test_rows_of_groups():
    rows = _rows(_paper(damping=0.0, stiffness=0.0, amplitude=0.0))
    assert not {"eta", "f", "F0", "loss_factor", "drive", "natural"} & set(rows)
    assert "alpha" in rows
    # One that cannot be set is disabled and says why.
    row = _rows(_paper(initial_force=0.0))["F0"]
    assert not row.enabled
    assert "initial_force" in row.hint
    rows = _rows(_paper())
    assert rows["F0"].enabled
    # The natural frequency is shown in hertz; an angle is told in degrees too.
    assert (rows["natural"].kind, rows["natural"].unit) == ("fixed", "Hz")
    assert rows["natural"].value == pytest.approx(100.0 / (2.0 * math.pi))
    assert "19.49°" in rows["angle"].hint


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


@pytest.mark.parametrize(
    "changes",
    [
        {"stiffness": 1e-50},
        {"stiffness": 1e15, "inertia": 1e12, "amplitude": 1e-50},
        {"amplitude": 1e15, "inertia": 1e-50},
        {"slope": 1e12, "damping": 1e-50},
        {"initial_force": 1e-50},
        {"frequency": 1e9},
        {"kinetic": 1e-50},
    ],
)
def test_the_largest_and_smallest_values_have_finite_ranges(changes):
    for row in _rows(_paper(**changes)).values():
        if row.kind == "number":
            assert -math.inf < row.low < row.high < math.inf


def test_a_parameter_of_another_machine_is_refused():
    with pytest.raises(InputError, match="wrap_angle"):
        span(_paper(), "wrap_angle")
