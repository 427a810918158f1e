"""Pictures in axes and styles of the user, and pictures of any width: no words touch."""

from __future__ import annotations

import functools

import matplotlib as mpl
import matplotlib.pyplot as plt
import numpy as np
import pytest
from matplotlib.figure import Figure
from pictures import basins_of, check_words, diagram, map_of

import wedgebrake as wb


@functools.cache
def belt():
    """A block on a belt, whose names are long."""
    return wb.Machine(
        inertias=[wb.Inertia(name="lower_block", inertia=1.0)],
        shafts=[wb.Shaft(a="lower_block", b="ground", stiffness=1.0, damping=0.1)],
        contacts=[
            wb.Contact(
                a="lower_block", name="belt", base_speed=0.5,
                brake=wb.ConventionalBrake(radius=1.0),
                friction=wb.StribeckFriction(kinetic=0.5, static=1.0, speed=0.5),
                actuation=wb.Actuation(initial_force=1.0),
            )
        ],
    )  # fmt: skip


@functools.cache
def result(name):
    speeds, dampings = np.linspace(0.1, 2.0, 6), np.linspace(0.0, 0.6, 6)
    make = {
        "diagram": lambda: diagram(30),
        "map": map_of,
        "basins": lambda: basins_of(4),
        "limits": lambda: wb.stability_limits(belt(), speeds),
        "stability": lambda: wb.stability_map(
            belt(), {"belt.base_speed": speeds, "lower_block-ground.damping": dampings}
        ),
        "orders": orders,
        "modes": lambda: wb.stability(belt()),
        "response": lambda: wb.simulate(wb.paper.system(), periods=20),
        "section": lambda: wb.poincare(wb.paper.system(), periods=20, transient=10),
    }
    return make[name]()


def orders():
    speed = wb.Ramp(200.0, 60.0, 7.0)
    torque = -20.0 + wb.Orders(speed, [[2.0, 5.0, 0.0]])
    wheel = wb.Inertia(name="wheel", inertia=1.0, speed=200.0)
    machine = wb.Machine(inertias=[wheel], torques=[wb.Torque(on="wheel", signal=torque)])
    return wb.order_map(wb.simulate(machine, duration=7.0), "velocity", part="wheel")


WIDE = ("diagram", "map", "limits", "stability", "orders", "modes")


@pytest.mark.parametrize("width", [2.5, pytest.param(3.5, marks=pytest.mark.slow), 7.2])
@pytest.mark.parametrize("name", WIDE)
def test_no_words_touch_at_any_width(name, width):
    check_words(wb.plot(result(name), width=width))


def test_no_words_touch_with_colour_bars_and_over_rpm():
    check_words(wb.plot(result("map"), quantity="largest_exponent", width=2.5))
    check_words(wb.plot(result("orders"), hertz=True, width=2.5))


@pytest.mark.parametrize("size", [5.0, 10.0, 12.0])
def test_no_words_touch_in_other_sizes_of_type(size):
    figure = wb.plot(result("map"), style={"font.size": size}, width=5.0)
    check_words(figure)
    # The type of ticks keeps its proportion to that of the labels.
    shown = figure.axes[0].get_xticklabels()[0].get_fontsize()
    assert shown == pytest.approx(size * 7.0 / 7.5)


class TestAxes:
    @pytest.mark.parametrize(
        ("name", "count"),
        [("map", 1), ("basins", 1), ("diagram", 4), ("response", 4), ("limits", 4)],
    )
    def test_are_those_that_are_drawn_in(self, name, count):
        options = {"exponent": True} if name == "diagram" else {}
        figure, axes = plt.subplots(count, 1, squeeze=False, layout="constrained", figsize=(6, 9))
        try:
            before = dict(mpl.rcParams)
            engine, size = figure.get_layout_engine(), tuple(figure.get_size_inches())
            given = axes if count > 1 else axes[0, 0]
            assert wb.plot(result(name), ax=given, **options) is figure
            own = wb.plot(result(name), **options)
            assert figure.get_layout_engine() is engine
            assert tuple(figure.get_size_inches()) == size
            assert not figure.get_suptitle()
            assert dict(mpl.rcParams) == before
            drawn = [one for one in own.axes if one.axison][:count]
            for one, other in zip(axes.flat, drawn, strict=True):
                assert len(one.lines) == len(other.lines)
                assert one.get_ylim() == pytest.approx(other.get_ylim())
                assert one.get_xlim() == pytest.approx(other.get_xlim())
                assert one.get_ylabel().split() == other.get_ylabel().split()
        finally:
            plt.close(figure)

    def test_leave_room_for_a_title_and_beside_other_axes(self):
        figure, (left, right) = plt.subplots(1, 2, layout="constrained", figsize=(9.0, 3.5))
        try:
            wb.plot(result("map"), ax=left)
            left.set_title("mine")
            wb.plot(result("section"), ax=right)
            right.set_title("mine too")
            check_words(figure)
            assert len(right.lines[0].get_xdata()) == result("section").sizes["period"]
        finally:
            plt.close(figure)

    def test_have_a_colour_bar_whose_label_fits(self):
        figure, axes = plt.subplots(2, 2, layout="constrained", figsize=(9.0, 5.0))
        try:
            wb.plot(result("orders"), ax=axes[0, 1])
            check_words(figure)
        finally:
            plt.close(figure)

    def test_may_be_those_of_a_part_of_a_figure(self):
        figure = Figure(layout="constrained")
        part = figure.subfigures(1, 2)[1]
        axes = part.subplots()
        assert wb.plot(result("map"), ax=axes) is figure
        assert axes.images

    def test_have_the_settings_of_the_user(self):
        with mpl.rc_context({"font.size": 14.0, "legend.frameon": True, "legend.loc": "center"}):
            figure = Figure()
            axes = figure.subplots(2, 2)
            wb.plot(result("response"), ax=axes)
        legend = axes[0, 1].get_legend()
        assert legend.get_frame_on()
        assert legend._loc == 10
        assert axes[0, 0].xaxis.label.get_fontsize() == 14.0

    def test_wrong_ones_are_refused_before_anything_is_drawn(self):
        figure = Figure()
        axes = figure.subplots(1, 3)
        with pytest.raises(wb.InputError, match=r"ax = .*3 Axes.*4 Axes"):
            wb.plot(result("response"), ax=axes)
        with pytest.raises(wb.InputError, match=r"ax = .*3 Axes.*one Axes"):
            wb.plot(result("map"), ax=axes)
        polar = Figure().add_subplot(projection="polar")
        twice = [axes[0]] * 4
        apart = [*axes, Figure().subplots()]
        for wrong in (figure, 3, "ax", [], [axes[0], 3], polar, twice, apart):
            with pytest.raises(wb.InputError, match="ax = "):
                wb.plot(result("response"), ax=wrong)
        with pytest.raises(wb.InputError, match="width"):
            wb.plot(result("map"), ax=axes[0], width=5.0)
        assert len(figure.axes) == 3
        assert not any(one.has_data() for one in axes)


class TestStyle:
    def test_of_the_user_is_kept_when_the_figure_is_drawn_later(self):
        with mpl.rc_context({"font.family": "monospace", "axes.facecolor": "#eeeeff"}):
            kept, own = (wb.plot(result("map"), style=one) for one in (mpl.rcParams, None))
        assert kept.axes[0].get_facecolor() == pytest.approx((0.9333, 0.9333, 1.0, 1.0), abs=1e-3)
        assert own.axes[0].get_facecolor() == (1.0, 1.0, 1.0, 1.0)
        assert kept.axes[0].xaxis.label.get_fontfamily() == ["monospace"]
        assert own.axes[0].xaxis.label.get_fontfamily() == ["sans-serif"]

    def test_changes_what_it_states(self):
        figure = wb.plot(result("map"), style=["ggplot", {"axes.facecolor": "#123456"}])
        assert figure.axes[0].get_facecolor()[:3] == pytest.approx(
            (0x12 / 255, 0x34 / 255, 0x56 / 255)
        )
        assert (
            figure.axes[0].xaxis.label.get_color() == mpl.style.library["ggplot"]["axes.labelcolor"]
        )

    @pytest.mark.parametrize("wrong", ["ggplto", {"font.sise": 3}, {"font.size": "x"}, 3])
    def test_wrong_ones_are_refused(self, wrong):
        with pytest.raises(wb.InputError, match="style = "):
            wb.plot(result("map"), style=wrong)
