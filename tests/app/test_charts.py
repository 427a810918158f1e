"""What the charts and the stage send to the browser, without one."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from bokeh.document import Document

import wedgebrake as wb
from wedgebrake.explorer.core.snapshot import Moment, look
from wedgebrake.explorer.core.state import Desk, new_desk
from wedgebrake.explorer.ui.plots import look as charts
from wedgebrake.explorer.ui.plots.history import History
from wedgebrake.explorer.ui.plots.phase import Phase
from wedgebrake.explorer.ui.plots.section import Section
from wedgebrake.explorer.ui.plots.spectrum import Spectrum
from wedgebrake.explorer.ui.widgets.brake_animation import Stage


class Page:
    """The four charts on a document, and what is sent to its browser."""

    def __init__(self) -> None:
        self.history = History()
        self.phase = Phase(self.history)
        self.section, self.spectrum = Section(), Spectrum()
        self.all = (self.history, self.phase, self.section, self.spectrum)
        self.document = Document()
        self.sent: list[object] = []
        for chart in self.all:
            self.document.add_root(chart.figure)
        self.document.on_change(self.sent.append)

    def show(self, moment: Moment) -> None:
        for chart in self.all:
            chart.show(moment)

    def sentences(self) -> list[str]:
        return [chart.figure.elements[1].html for chart in self.all]

    def source(self, name: str):
        return self.document.get_model_by_name(name)


@pytest.fixture
def desk() -> Desk:
    return new_desk(wb.paper.system(eta=-24, f=0.63, F0=0.036, alpha=1.18))


@pytest.fixture
def page() -> Page:
    return Page()


def inside(range_, values) -> bool:
    return bool(range_.start <= np.min(values) and np.max(values) <= range_.end)


class TestMotion:
    def test_history_and_phase_show_the_samples(self, desk, page):
        moment = look(desk)
        page.show(moment)
        data = page.source("motion").data
        for name in ("time", "angle", "velocity", "torque"):
            np.testing.assert_array_equal(data[name], getattr(moment, name))
        assert inside(page.history.figure.x_range, moment.time)
        assert inside(page.history.figure.y_range, moment.velocity)
        assert inside(page.phase.figure.x_range, moment.angle)
        assert page.sentences() == [""] * 4
        assert {"scrub-history", "scrub-phase", "scrub-to"} <= {
            model.name for model in page.document.models
        }

    def test_sticks_have_the_colours_of_pictures(self, desk, page):
        moment = look(desk)
        page.show(moment)
        source = next(
            one.data_source for one in page.history.figure.renderers
            if "colour" in one.data_source.data
        )  # fmt: skip
        assert len(source.data["start"]) == len(moment.sticks)
        assert set(source.data["colour"]) == {"#D55E00", "#CC79A7"}
        key = page.history.figure.elements[0].html
        assert "v &gt; 0" in key
        assert "v &lt; 0" in key

    def test_the_same_motion_is_not_sent_again(self, desk, page):
        page.show(look(desk))
        del page.sent[:]
        page.show(look(desk))
        # The orbit always is: the browser may have cut it.
        assert {type(event.model).__name__ for event in page.sent} <= {"ColumnDataSource"}
        assert len(page.sent) <= 1

    def test_ranges_stay_while_little_changes(self, desk, page):
        page.show(look(desk.edited(eta=-10.0)))
        before = [(one.start, one.end) for one in _ranges(page)]
        page.show(look(desk.edited(eta=-10.001)))
        assert [(one.start, one.end) for one in _ranges(page)] == before

    def test_a_zoom_in_time_survives_a_new_motion(self, desk, page):
        page.show(look(desk))
        page.history.figure.x_range.update(start=24.0, end=24.1)
        page.show(look(desk.edited(eta=-25.0)))
        assert page.history.figure.x_range.start == 24.0
        page.show(look(desk.edited(frequency=11.0)))
        assert page.history.figure.x_range.end < 23.0

    def test_switching_line_and_release_speed(self, desk, page):
        desk = desk.edited(drive_speed=2.0)
        page.show(look(desk))
        low, high = page.phase.figure.y_range.start, page.phase.figure.y_range.end
        spans = [one for one in page.phase.figure.center if hasattr(one, "location")]
        release = desk.system.actuation.release_speed
        assert [one.location for one in spans] == [-2.0, -2.0 + release, -2.0 - release]
        assert [one.visible for one in spans] == [low <= one.location <= high for one in spans]

    def test_many_periods_are_thinned_with_their_extremes(self, desk, page):
        moment = look(desk.edited(shown=100))
        page.show(moment)
        velocity = page.source("motion").data["velocity"]
        assert len(velocity) <= charts.MOST_POINTS
        assert np.max(velocity) == np.max(moment.velocity)
        assert np.min(velocity) == np.min(moment.velocity)


def test_thinning_keeps_the_extremes_of_every_block():
    values = np.sin(np.linspace(0.0, 300.0, 31_415))
    places = charts.thinned(values, 1000)
    assert places.size <= 1000
    assert np.all(np.diff(places) > 0)
    assert (places[0], places[-1]) == (0, values.size - 1)
    assert np.min(values[places]) == np.min(values)
    np.testing.assert_array_equal(charts.thinned(values[:1000], 1000), np.arange(1000))


@pytest.mark.parametrize(
    ("low", "high"),
    [(0.0, 1.0), (-10.7, 10.0), (5.0, 5.0), (0.0, 0.0), (1e-300, 2e-300), (-1e12, 3.0)],
)
def test_round_spans_hold_their_values(low, high):
    first, last = charts.round_span(low, high)
    assert first < low <= high < last
    if high > low:
        assert last - first < 1.5 * (high - low)
    assert charts.round_span(math.nan, high) == (-1.0, 1.0)


def test_sticks_too_near_for_the_eye_are_one(desk):
    moment = look(desk)
    begin, end = moment.time[0], moment.time[-1]
    starts = np.linspace(begin, end, 50_001)[:-1]
    signs = np.where(np.arange(50_000) % 2, 1.0, -1.0)
    many = np.column_stack((starts, starts + 1e-9, signs))
    assert len(charts.rests(replace(moment, sticks=many))) < 1100
    assert len(charts.rests(replace(moment, sticks=many[:1]))) == 1
    assert len(charts.rests(replace(moment, sticks=many[:0]))) == 0
    np.testing.assert_array_equal(charts.rests(moment), moment.sticks)


class TestSettled:
    def test_section(self, desk, page):
        moment = look(desk)
        page.show(moment)
        points = page.section.figure.renderers[-1].data_source.data
        np.testing.assert_array_equal(points["angle"], moment.section_angle)
        assert inside(page.section.figure.y_range, moment.section_velocity)

    def test_rounding_does_not_look_like_scatter(self, desk, page):
        moment = look(desk.edited(eta=-10.0, periods=1000))
        page.show(moment)
        range_ = page.section.figure.y_range
        assert range_.end - range_.start > 0.04 * np.ptp(moment.velocity)

    def test_spectrum_has_marks_and_five_decades(self, desk, page):
        moment = look(desk)
        page.show(moment)
        drawn = page.spectrum.figure
        marks = [one.location for one in drawn.center if hasattr(one, "location")]
        assert marks == [moment.forcing, moment.natural]
        top = np.max(moment.amplitude)
        assert drawn.y_range.start <= 1e-5 * top < 10.0 * drawn.y_range.start
        assert top < drawn.y_range.end < 10.0 * top
        assert np.min(drawn.renderers[-1].data_source.data["amplitude"]) >= drawn.y_range.start

    def test_a_torque_that_does_not_act_is_not_marked(self, desk, page):
        page.show(look(desk.edited(amplitude=0.0).edited(drive_speed=2.0)))
        drawn = page.spectrum.figure
        seen = [one.location for one in drawn.center if hasattr(one, "location") and one.visible]
        assert seen == [look(desk).natural]

    def test_ghost_lies_behind_in_every_chart(self, desk, page):
        page.show(look(desk.edited(ghost=True)))
        for chart in page.all:
            ghosts = [
                one for one in chart.figure.renderers
                if charts.GHOST in (getattr(one.glyph, "line_color", ""),
                                    getattr(one.glyph, "fill_color", ""))
            ]  # fmt: skip
            assert len(ghosts) == 1
            assert all(len(column) for column in ghosts[0].data_source.data.values())
        page.show(look(desk))
        for chart in page.all:
            for one in chart.figure.renderers:
                if getattr(one.glyph, "line_color", "") == charts.GHOST:
                    assert not any(len(column) for column in one.data_source.data.values())


class TestEarlyEnds:
    def test_a_diverging_motion_is_cut_where_it_leaves_the_picture(self, page):
        moment = look(new_desk(wb.paper.system(eta=-24, release=False, damping=1.0)))
        page.show(moment)
        velocity = page.source("motion").data["velocity"]
        assert 100 < len(velocity) < moment.velocity.size
        assert np.max(np.abs(velocity)) < 0.01 * np.max(np.abs(moment.velocity))
        assert inside(page.history.figure.y_range, velocity)
        assert all(page.sentences()[place] for place in (0, 2, 3))

    def test_no_samples_at_all(self, desk, page):
        moment = look(desk)
        empty = np.empty(0)
        names = ("time", "angle", "velocity", "torque", "drive", "sticking", "section_angle",
                 "section_velocity", "frequency", "amplitude")  # fmt: skip
        page.show(moment)
        page.show(
            replace(
                moment, status="step_limit", sticks=np.empty((0, 3)), **dict.fromkeys(names, empty)
            )
        )
        assert all(page.sentences())
        assert len(page.source("motion").data["time"]) == 0
        page.show(moment)
        assert not any(page.sentences())

    def test_rest_has_no_spectrum(self, desk, page):
        page.show(look(desk.edited(amplitude=0.0)))
        assert [bool(one) for one in page.sentences()] == [False, False, False, True]

    def test_a_slow_torque_has_no_spectrum(self, desk, page):
        page.show(look(desk.edited(frequency=0.1)))
        assert "too slow" in page.sentences()[3]

    def test_any_sentence_can_stand_in_place(self, desk, page):
        page.show(look(desk))
        for chart in page.all:
            chart.say("<b>a & b</b>")
        assert all("&lt;b&gt;a &amp; b" in sentence for sentence in page.sentences())
        assert len(page.source("motion").data["time"]) == 0


@pytest.mark.parametrize("brake", ["wedge", "conventional", "band", "leading-shoe"])
def test_the_stage_gets_a_small_state(desk, brake):
    desk = desk.edited(brake=brake)
    moment = look(desk)
    stage = Stage()
    stage.show(desk, moment)
    assert len(json.dumps(stage.state, allow_nan=False)) < 500
    assert stage.state["kind"] == brake
    assert moment.time[0] < stage.state["first"] < moment.time[-1]
    stage.show(desk, replace(moment, time=np.empty(0)))
    assert stage.state["first"] is None


def _ranges(page: Page):
    return [one for chart in page.all for one in (chart.figure.x_range, chart.figure.y_range)]
