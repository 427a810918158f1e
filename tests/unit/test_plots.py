"""Pictures of one motion: their data, what is drawn, and files complete or not written."""

from __future__ import annotations

import itertools
from pathlib import Path

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from pictures import png

import machines
import wedgebrake as wb
from wedgebrake.analysis.responses.sticking import steady_start
from wedgebrake.figures.data import limits
from wedgebrake.figures.data.motion import History, PoincarePicture, RestIntervals
from wedgebrake.figures.matplotlib import motion, style
from wedgebrake.figures.matplotlib.motion import overview
from wedgebrake.figures.matplotlib.save import save

EXAMPLES = Path(__file__).parents[2] / "examples"
PAPER = wb.paper.system()
SHAFT = PAPER.replace(drive_speed=2.0)
SYNCHRONOUS = wb.paper.system(eta=0.0, F0=0.09)
DIVERGED = wb.paper.system(damping=1.0, static=0.33, release=False)
SYSTEMS = {
    "turning shaft": SHAFT,
    "diverged": DIVERGED,
    "no stiffness": PAPER.replace(stiffness=0.0, slope=0.0),
    "fast": PAPER.replace(frequency=1e6),
}
SPANS = {
    "no samples": {"periods": 40, "times": []},
    "uneven": {"periods": 40, "times": np.linspace(0.0, 3.0, 500) ** 1.1},
    "few": {"duration": 4.0, "times": np.linspace(0.0, 3.0, 4)},
    "nothing": {"duration": 0.0},
    "late": {"periods": 20, "start_time": 1e4},
}


@pytest.fixture(scope="module")
def response():
    return wb.simulate(PAPER, periods=60)


@pytest.fixture(scope="module")
def points():
    return wb.poincare(PAPER, 60, transient=10)


@pytest.fixture(scope="module")
def turning():
    return wb.simulate(SHAFT, periods=60)


@pytest.fixture(scope="module")
def figure(response):
    return motion.section(response)


class TestOverview:
    @pytest.mark.parametrize("name", SYSTEMS)
    def test_of_every_motion(self, name):
        """Says what was computed, has units on every axis, and no labels that touch."""
        figure = overview(SYSTEMS[name], wb.simulate(SYSTEMS[name], periods=60), "the verdict")
        assert "the verdict" in figure.get_suptitle()
        renderer = FigureCanvasAgg(figure).get_renderer()
        figure.draw(renderer)
        for axes in figure.axes:
            assert axes.get_ylabel()
            for label in (axes.get_xlabel(), axes.get_ylabel()):
                assert not label or ("[" in label and "]" in label)
            low, high = axes.get_xlim()
            boxes = [
                label.get_window_extent(renderer)
                for position, label in zip(axes.get_xticks(), axes.get_xticklabels(), strict=True)
                if low <= position <= high and label.get_text() and label.get_visible()
            ]
            assert all(left.x1 < right.x0 for left, right in itertools.pairwise(boxes))
            if axes.get_legend() is not None:
                box = axes.get_legend().get_window_extent(renderer)
                assert box.y0 >= axes.get_window_extent(renderer).y1  # hides no data
                assert figure.bbox.x0 <= box.x0 <= box.x1 <= figure.bbox.x1

    def test_says_once_how_the_run_ended(self):
        response = wb.simulate(DIVERGED, periods=60)
        message = response.attrs["message"]
        for verdict in ("", f"Vibration: {message}"):
            title = overview(DIVERGED, response, verdict).get_suptitle()
            assert " ".join(title.split()).count(style.minus_signs(message)) == 1

    @pytest.mark.parametrize("name", SPANS)
    def test_of_every_time_span(self, name, tmp_path):
        figure = overview(PAPER, wb.simulate(PAPER, **SPANS[name]))
        assert png(save(figure, tmp_path / "overview.png", width=400)) == (400, 300)
        axes = figure.axes[3]
        says = [text for text in axes.texts if text.get_text() != "d"]
        assert (len(says), bool(axes.lines)) == ((0, True) if name == "late" else (1, False))

    def test_takes_the_spectrum_of_the_steady_motion(self):
        """Free vibration that dies away is in the whole response, not in its last fifth."""
        response = wb.simulate(SYNCHRONOUS, periods=250, initial=(0.2, 0.0))
        for start in (None, 22.0):
            axes = overview(SYNCHRONOUS, response, start=start).axes[3]
            (drawn,) = (line for line in axes.lines if len(line.get_xdata()) > 2)
            steady = wb.spectrum(response, start=steady_start(response) if start is None else start)
            shown = len(drawn.get_ydata())
            assert shown < steady.sizes["frequency"]
            # Below what is shown, amplitudes are cut.
            assert drawn.get_ydata() == pytest.approx(steady.amplitude.to_numpy()[:shown], abs=1e-9)

    @pytest.mark.parametrize(
        ("torque", "speed", "whole"), [(0.0, 0.0, True), (500.0, 0.0, False), (0.0, 30.0, True)]
    )
    def test_of_a_free_vibration_begins_at_its_start(self, torque, speed, whole):
        machine = wb.paper.system(brake="conventional", eta=0.0)
        system = machine.replace(amplitude=torque, drive_speed=speed, damping=2.0)
        figure = overview(system, wb.simulate(system, initial=(0.1, 0.0), periods=60))
        first = [figure.axes[0].lines[1].get_xdata()[0], figure.axes[1].lines[0].get_xdata()[0]]
        assert (first == [0.0, 0.1]) == whole


class TestPhase:
    def test_stuck_bodies_vibrate_along_their_path(self):
        """A clutch that holds two bodies on a spring: (w theta)^2 + theta'^2 = 1, w = 2 rad/s."""
        machine = wb.Machine(
            inertias=[wb.Inertia("a", 1.0, speed=1.0), wb.Inertia("b", 1.0, speed=1.0)],
            shafts=[wb.Shaft("a", "ground", stiffness=8.0)],
            contacts=[machines.pressed("a", "b", name="clutch", force=10.0)],
        )
        response = wb.simulate(machine, duration=10.0)
        axes = overview(machine, response, inertia="b", contact="clutch").axes[1]
        (path,) = (line for drawn in axes.collections for line in drawn.get_segments())
        angle, velocity = path.T
        assert np.hypot(2.0 * angle, velocity) == pytest.approx(1.0, rel=1e-6)
        # Around, not across.
        between = np.hypot(2.0 * np.diff(angle), np.diff(velocity))
        assert between.max() < 0.2
        assert between.sum() == pytest.approx(20.0, rel=1e-3)


class TestHistory:
    def test_shades_the_sticks(self, response):
        figure = motion.history(response, periods=None)
        axes = figure.axes[0]
        assert sum(len(c.get_paths()) for c in axes.collections) == response.sizes["stick"]
        assert axes.get_xlim() == pytest.approx((0.0, float(response.time[-1])))
        assert len(figure.axes) == 2
        short = motion.history(response, periods=5, torque=False)
        assert len(short.axes) == 1
        assert np.ptp(short.axes[0].get_xlim()) == pytest.approx(5 * PAPER.excitation.period)

    def test_divergence_has_a_logarithmic_scale_and_a_bounded_part(self, response):
        diverging = wb.simulate(DIVERGED, periods=40)
        data = History.last(diverging, None)
        assert data.linear_up_to == 10.0
        assert motion.history(diverging).axes[0].get_yscale() == "symlog"
        bounded, rest = data.velocity[data.bounded], data.velocity[data.bounded.stop :]
        assert np.max(np.abs(bounded)) < 1e-2 * np.max(np.abs(rest))
        calm = History.last(response, None)
        assert calm.linear_up_to is None
        assert calm.velocity[calm.bounded].size == calm.velocity.size


class TestSection:
    def test_takes_a_response_or_points(self, response, points):
        sizes = []
        for given, count in ((response, 13), (points, 51)):
            (drawn,) = motion.section(given).axes[0].lines
            assert len(drawn.get_xdata()) == count
            sizes.append(drawn.get_markersize())
        assert sizes[0] == 4.0 > sizes[1]
        with pytest.raises(wb.InputError, match=r"wb\.poincare"):
            motion.section(response.drop_vars(["poincare_angle"]))

    def test_of_a_limit_cycle_is_a_point(self):
        system = wb.load_study(EXAMPLES / "falling_friction.toml").system
        response = wb.simulate(system, periods=200)
        found, period = PoincarePicture.of(response, start=15.0), wb.orbit(system).period
        assert found.angle.size == pytest.approx(
            (float(response["time"][-1]) - 15.0) / period, abs=1
        )
        assert np.ptp(found.angle) <= 1e-3 * np.ptp(response["angle"].values)
        motion.section(response)

    def test_of_an_equilibrium_is_its_state(self):
        system = wb.load_study(EXAMPLES / "falling_friction.toml").system.replace(damping=20.0)
        response = wb.simulate(system, periods=200)
        found = PoincarePicture.of(response)
        assert found.angle == pytest.approx(response.attrs["final_angle"], abs=1e-9)
        assert found.velocity == pytest.approx(0.0, abs=1e-9)
        assert PoincarePicture.of(response, start=np.inf).angle.size == 0


class TestSpectrum:
    def test_frequencies_in_hertz_or_natural_frequencies(self, response):
        lines = wb.spectrum(response)
        for hertz, unit in ((True, 1.0), (False, lines.attrs["natural_frequency"])):
            axes = motion.spectrum(lines, hertz=hertz).axes[0]
            found = [float(line.get_xdata()[0]) for line in axes.lines if len(line.get_xdata()) < 3]
            expected = [lines.attrs[n] / unit for n in ("forcing_frequency", "natural_frequency")]
            assert sorted(found) == pytest.approx(sorted(expected))
            assert ("Hz" in axes.get_xlabel()) == hertz
            assert axes.get_yscale() == "log"
        with pytest.raises(wb.InputError, match=r"wb\.spectrum"):
            motion.spectrum(response)
        lines.attrs = {"quantity": "velocity"}
        assert motion.spectrum(lines).get_suptitle() == ""  # of no known machine


class TestLimits:
    def test_thinning_keeps_the_extremes_of_every_block(self):
        values = np.sin(np.linspace(0.0, 300.0, 31_415))
        places = limits.thinned(values, 1000)
        assert places.size <= 1000
        assert np.all(np.diff(places) > 0)
        assert (places[0], places[-1]) == (0, values.size - 1)
        assert np.min(values[places]) == np.min(values)
        np.testing.assert_array_equal(limits.thinned(values[:1000], 1000), np.arange(1000))

    def test_sticks_too_near_for_the_eye_are_one(self):
        start = np.linspace(0.0, 1.0, 50_001)[:-1]
        many = RestIntervals(start, start + 1e-9, np.where(np.arange(50_000) % 2, 1, -1))
        assert many.merged(1e-3, 1000).start.size < 1100
        one = many.where(np.arange(50_000) == 0)
        assert one.merged(1e-3, 1000).start.size == 1
        apart = RestIntervals(
            np.array([0.0, 0.2, 0.5]), np.array([0.1, 0.3, 0.6]), np.array([1, 1, -1])
        )
        for merged, kept in ((apart.merged(0.05, 10), [0, 1, 2]), (apart.merged(0.15, 10), [0, 2])):
            np.testing.assert_array_equal(merged.start, apart.start[kept])
