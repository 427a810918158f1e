"""Pictures of a motion as they are sent to the browser, without one."""

from __future__ import annotations

import contextlib

import numpy as np
import pytest
from bokeh.document import Document
from bokeh.models import MultiLine
from states import new_state

import machines
import wedgebrake as wb
from wedgebrake.explorer.core import plots
from wedgebrake.explorer.core.plots import diagram
from wedgebrake.explorer.core.snapshot import Snapshot, take_snapshot
from wedgebrake.explorer.core.state import PageState
from wedgebrake.explorer.core.verdict import verdict
from wedgebrake.explorer.ui.widgets.brake_animation import BrakeAnimation
from wedgebrake.figures.bokeh.motion import (
    COMPARISON,
    HistoryChart,
    PhaseChart,
    SectionChart,
    SpectrumChart,
)


class Page:
    """The four charts on a document, and what is sent to its browser."""

    def __init__(self) -> None:
        self.history = HistoryChart()
        self.phase = PhaseChart(self.history)
        self.section, self.spectrum = SectionChart(), SpectrumChart()
        self.all = (self.history, self.phase, self.section, self.spectrum)
        self.document = Document()
        self.sent: list[object] = []
        for chart in self.all:
            self.document.add_root(chart.figure)
        self.document.on_change(self.sent.append)

    def show(self, snapshot: Snapshot) -> None:
        comparison = snapshot.comparison.figures if snapshot.comparison is not None else None
        for chart in self.all:
            chart.show(snapshot.figures, comparison)

    def sentences(self) -> list[str]:
        return [chart.figure.elements[1].html for chart in self.all]

    def motion(self):
        return self.document.get_model_by_name("motion").data

    def ranges(self):
        found = (one for chart in self.all for one in (chart.figure.x_range, chart.figure.y_range))
        return [(one.start, one.end) for one in found]


@pytest.fixture(scope="module")
def state() -> PageState:
    return new_state(wb.paper.system(eta=-24, f=0.63, F0=0.036, alpha=1.18))


@pytest.fixture(scope="module")
def snapshot(state) -> Snapshot:
    return take_snapshot(state)


@pytest.fixture
def page() -> Page:
    return Page()


def inside(range_, values) -> bool:
    return bool(range_.start <= np.min(values) and np.max(values) <= range_.end)


def levels(figure):
    return [one for one in figure.center if hasattr(one, "location")]


def test_all_charts_show_the_motion(snapshot, page):
    page.show(snapshot)
    history, section = snapshot.figures.history, snapshot.figures.section
    for name in ("time", "angle", "velocity"):
        np.testing.assert_array_equal(page.motion()[name], getattr(history, name))
    np.testing.assert_array_equal(page.motion()["torque"], history.brake_torque)
    assert inside(page.history.figure.x_range, history.time)
    assert inside(page.history.figure.y_range, history.velocity)
    assert inside(page.phase.figure.x_range, history.angle)
    points = page.section.figure.renderers[-1].data_source.data
    np.testing.assert_array_equal(points["angle"], section.angle)
    assert inside(page.section.figure.y_range, section.velocity)
    assert page.sentences() == [""] * 4
    # Sources that the animation of the brake works with.
    names = {model.name for model in page.document.models}
    assert {"scrub-history", "scrub-phase", "scrub-to"} <= names
    # Sticks have the colours of pictures.
    columns = (one.data_source.data for one in page.history.figure.renderers)
    sticks = next(one for one in columns if "colour" in one)
    np.testing.assert_array_equal(sticks["start"], history.sticks.start)
    assert set(sticks["colour"]) == {"#D55E00", "#CC79A7"}


def test_switching_line_and_release_speed(state, page):
    state = state.edited(drive_speed=2.0)
    page.show(take_snapshot(state))
    low, high = page.phase.figure.y_range.start, page.phase.figure.y_range.end
    lines = levels(page.phase.figure)
    release = state.system.actuation.release_speed
    assert [one.location for one in lines] == [-2.0, -2.0 + release, -2.0 - release]
    assert [one.visible for one in lines] == [low <= one.location <= high for one in lines]
    assert lines[0].visible


def test_spectrum_has_marks_and_five_decades(state, snapshot, page):
    page.show(snapshot)
    drawn, data = page.spectrum.figure, snapshot.figures.spectrum
    assert [one.location for one in levels(drawn)] == [data.forcing, data.natural]
    top = np.max(data.amplitude)
    assert drawn.y_range.start <= 1e-5 * top < 10.0 * drawn.y_range.start
    assert top < drawn.y_range.end < 10.0 * top
    assert np.min(drawn.renderers[-1].data_source.data["amplitude"]) >= drawn.y_range.start
    # A torque that does not act is not marked.
    page.show(take_snapshot(state.edited(amplitude=0.0).edited(drive_speed=2.0)))
    assert [one.location for one in levels(drawn) if one.visible] == [data.natural]


def test_comparison_lies_behind_in_every_chart(state, snapshot, page):
    page.show(take_snapshot(state.edited(comparison=True)))
    behind = [
        one.data_source
        for chart in page.all
        for one in chart.figure.renderers
        if COMPARISON
        in (getattr(one.glyph, "line_color", ""), getattr(one.glyph, "fill_color", ""))
    ]
    assert len(behind) == 4
    assert all(len(column) for one in behind for column in one.data.values())
    page.show(snapshot)
    assert not any(len(column) for one in behind for column in one.data.values())


def test_a_diverging_motion_is_cut_where_it_leaves_the_picture(page):
    snapshot = take_snapshot(new_state(wb.paper.system(eta=-24, release=False, damping=1.0)))
    page.show(snapshot)
    velocity, whole = page.motion()["velocity"], snapshot.figures.history.velocity
    assert 100 < len(velocity) < whole.size
    assert np.max(np.abs(velocity)) < 0.01 * np.max(np.abs(whole))
    assert inside(page.history.figure.y_range, velocity)
    assert all(page.sentences()[place] for place in (0, 2, 3))


# Machines at the ends of what is allowed.
ANY_LAW = [
{"stiffness": 1e15},
{"stiffness": 0.0},
{"frequency": 1e-9},
{"frequency": 1e6},
{"initial_force": 0.0},
{"drive_speed": 1e3},
]  # fmt: skip
EXTREMES = [
    *({"friction": law, **one} for law in ("coulomb", "smoothed") for one in ANY_LAW),
    *({"friction": "tabulated", **one} for one in ANY_LAW[::5]),
    {"stiffness": 0.0, "inertia": 1e12}, {"frequency": 1e9}, {"slope": -1e12}, {"slope": 1e12},
    {"kinetic": 0.0}, {"kinetic": 5.0, "brake": "conventional"}, {"initial_force": 1e12},
    {"amplitude": 1e12}, {"amplitude": 0.0}, {"drive_speed": 1e6}, {"damping": 1e12},
    {"angle": 1e-9}, {"angle": 1.5707}, {"initial_angle": 1e12, "initial_velocity": -1e12},
    {"periods": 2000, "shown": 100}, {"friction": "smoothed", "periods": 2000},
    {"friction": "smoothed", "steepness": 1e9}, {"brake": "band", "wrap_angle": 100.0},
]  # fmt: skip


@pytest.fixture(scope="module")
def used() -> Page:
    """A page on which other motions have been."""
    return Page()


@pytest.mark.parametrize("changes", EXTREMES, ids=str)
def test_extreme_machines_are_answered_in_words(state, used, monkeypatch, changes):
    """By a verdict, charts and a diagram; where a limit is met, where it went."""
    for module in ("state", "computation"):
        monkeypatch.setattr(f"wedgebrake.explorer.core.{module}.MOST_EVENTS", 20_000)
        monkeypatch.setattr(f"wedgebrake.explorer.core.{module}.MOST_STEPS", 40_000)
    monkeypatch.setattr(plots, "COARSE_POINTS", 4)
    monkeypatch.setattr(plots, "FINE_POINTS", 4)
    for name, value in changes.items():
        try:
            state = state.edited(**{name: value})
        except wb.InputError as refused:
            assert name in str(refused)  # noqa: PT017 - either
            return
    snapshot = take_snapshot(state, settle=True)
    assert snapshot.status in {status.value for status in wb.Status}
    assert snapshot.motion.status == snapshot.status
    assert snapshot.message
    history = snapshot.figures.history
    assert history.time.size != 1
    for name in ("angle", "velocity", "brake_torque", "drive_torque", "sticking"):
        assert getattr(history, name).shape == history.time.shape
    assert np.all(np.isfinite(history.velocity))
    used.show(snapshot)
    BrakeAnimation().show(state, snapshot)
    assert used.document.to_json()
    assert len(verdict(state, snapshot)["headline"]) > 10
    with contextlib.suppress(wb.InputError):  # told in place of the diagram
        assert next(diagram.pictures(state)).known.size > 0


def test_sticks_follow_the_path_of_bodies_that_vibrate_together(page):
    """A clutch that holds two bodies on a spring: (w theta)^2 + theta'^2 = 1, w = 2 rad/s."""
    machine = wb.Machine(
        inertias=[wb.Inertia("a", 1.0, speed=1.0), wb.Inertia("b", 1.0, speed=1.0)],
        shafts=[wb.Shaft("a", "ground", stiffness=8.0)],
        contacts=[machines.pressed("a", "b", name="clutch", force=10.0)],
    )
    page.show(take_snapshot(new_state(machine)))
    (sticks,) = (
        one.data_source.data
        for one in page.phase.figure.renderers
        if isinstance(one.glyph, MultiLine)
    )
    (angle,), (velocity,) = sticks["angle"], sticks["velocity"]
    assert len(angle) > 20
    assert np.hypot(2.0 * angle, velocity) == pytest.approx(1.0, rel=1e-6)
    assert np.hypot(2.0 * np.diff(angle), np.diff(velocity)).max() < 0.2
