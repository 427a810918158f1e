"""Pictures of one motion: their data, what is drawn, and files complete or not written."""

from __future__ import annotations

import itertools
import math
import os
import pickle
from concurrent.futures import ThreadPoolExecutor
from contextlib import nullcontext
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.backends.backend_pdf import PdfPages
from matplotlib.figure import Figure
from pictures import png

import wedgebrake as wb
from wedgebrake.analysis.sticking import steady_start
from wedgebrake.figures.data import limits
from wedgebrake.figures.data.motion import History, Phase, Sticks
from wedgebrake.figures.matplotlib import motion, style
from wedgebrake.figures.matplotlib.figure import Picture
from wedgebrake.figures.matplotlib.motion import overview
from wedgebrake.figures.matplotlib.save import save

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

    @pytest.mark.parametrize("name", SPANS)
    def test_of_every_time_span(self, name, tmp_path):
        figure = overview(PAPER, wb.simulate(PAPER, **SPANS[name]))
        assert png(save(figure, tmp_path / "overview.png", width=400)) == (400, 300)
        axes = figure.axes[3]
        says = [text for text in axes.texts if text.get_text() != "d"]
        assert (len(says), bool(axes.lines)) == ((0, True) if name == "late" else (1, False))

    def test_title_names_the_machine_the_method_and_the_spans(self, response):
        words = overview(PAPER, response).get_suptitle()
        for part in (
            "Wedge brake, Coulomb friction", r"$\eta = -24$", "$F_0 = 0.036$", r"$\alpha = 1.18$",
            "0 to 5.984 s from (0, 0)", "4.787 s",
        ):  # fmt: skip
            assert part in words

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

    def test_of_a_vibration_that_a_turning_shaft_sustains_shows_its_end(self, response):
        system = PAPER.replace(amplitude=0.0, drive_speed=1.0)
        figure = overview(system, wb.simulate(system, periods=60))
        assert figure.axes[1].lines[0].get_xdata()[0] != 0.0
        with pytest.raises(wb.InputError, match="system = "):
            overview("wedge", response)


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

    @pytest.mark.parametrize("periods", [0, -3.0, "all", float("nan")])
    def test_of_no_time(self, response, periods):
        with pytest.raises(wb.InputError, match="periods = "):
            motion.history(response, periods)

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


class TestPhase:
    def test_marks_switching_line_and_release_speeds(self, turning):
        axes = motion.phase(SHAFT, turning).axes[0]
        lines = [line.get_ydata() for line in axes.lines]
        levels = {one[0] for one in lines if len(one) == 2 and one[0] == one[1]}
        release = SHAFT.actuation.release_speed
        assert {-2.0, release - 2.0, -release - 2.0} <= levels
        # Each kind is named once.
        words = [text.get_text() for text in axes.get_legend().get_texts()]
        assert "release" in words
        assert len(words) == len(set(words))

    def test_reaches_the_switching_line_unless_the_motion_gets_too_small(self, turning):
        data = Phase.of(PAPER.replace(drive_speed=3.0), turning, None)
        assert data.reaching(-2.0, 2.0) == (-3.0, 2.0)
        assert data.reaching(1.0, 2.0) == (1.0, 2.0)


class TestSection:
    def test_of_one_point_is_not_enlarged(self):
        """Rounding must not fill the picture: the limits stay in scale with the motion."""
        response = wb.simulate(SYNCHRONOUS, periods=100)
        axes = motion.section(response).axes[0]
        assert np.ptp(axes.get_xlim()) > 0.04 * float(np.ptp(response.angle.to_numpy()))
        assert np.ptp(axes.get_ylim()) > 0.04 * float(np.ptp(response.velocity.to_numpy()))

    def test_takes_a_response_or_points(self, response, points):
        sizes = []
        for given, count in ((response, 13), (points, 51)):
            (drawn,) = motion.section(given).axes[0].lines
            assert len(drawn.get_xdata()) == count
            sizes.append(drawn.get_markersize())
        assert sizes[0] == 4.0 > sizes[1]
        with pytest.raises(wb.InputError, match=r"wb\.poincare"):
            motion.section(response.drop_vars(["poincare_angle"]))

    @pytest.mark.parametrize("torque", [0.0, 500.0])
    def test_states_the_period_of_a_torque_that_does_not_act(self, torque):
        system = SHAFT.replace(amplitude=torque)
        for points in (wb.simulate(system, periods=60), wb.poincare(system, 60, transient=10)):
            (words,) = (text.get_text() for text in motion.section(points).axes[0].texts)
            assert ("$0.09973$ s" in words) == (torque == 0.0)


class TestSpectrum:
    def test_marks_what_acts(self):
        for changes, marks in (
            ({}, ["$f_e = 10.03$ Hz", "$f_n = 15.92$ Hz"]),
            ({"amplitude": 0.0}, ["$f_n = 15.92$ Hz"]),
            ({"amplitude": 0.0, "stiffness": 0.0}, []),
        ):
            lines = wb.spectrum(wb.simulate(SHAFT.replace(**changes), periods=60))
            legend = motion.spectrum(lines).axes[0].get_legend()
            assert (
                [text.get_text() for text in legend.get_texts()] == marks if legend else not marks
            )

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


def test_every_single_picture_names_its_machine(response, points):
    for figure in (
        motion.history(response), motion.phase(PAPER, response), motion.section(response),
        wb.plot(points), wb.plot(wb.spectrum(response)),
    ):  # fmt: skip
        caption = figure.get_suptitle().replace("\n", " ")
        for part in ("Wedge brake, Coulomb friction: ", r"$\eta = -24$", "$F_0 = 0.036$", "(0, 0)"):
            assert part in caption
        renderer = FigureCanvasAgg(figure).get_renderer()
        figure.draw(renderer)
        box = figure._suptitle.get_window_extent(renderer)
        assert figure.bbox.x0 <= box.x0 <= box.x1 <= figure.bbox.x1
        assert box.y0 >= max(axes.get_tightbbox(renderer).y1 for axes in figure.axes)


class TestLimits:
    def test_thinning_keeps_the_extremes_of_every_block(self):
        values = np.sin(np.linspace(0.0, 300.0, 31_415))
        places = limits.thinned(values, 1000)
        assert places.size <= 1000
        assert np.all(np.diff(places) > 0)
        assert (places[0], places[-1]) == (0, values.size - 1)
        assert np.min(values[places]) == np.min(values)
        np.testing.assert_array_equal(limits.thinned(values[:1000], 1000), np.arange(1000))

    @pytest.mark.parametrize(
        ("low", "high"),
        [(0.0, 1.0), (-10.7, 10.0), (5.0, 5.0), (0.0, 0.0), (1e-300, 2e-300), (-1e12, 3.0)],
    )
    def test_round_limits_hold_their_values(self, low, high):
        first, last = limits.round_limits(low, high)
        assert first < low <= high < last
        if high > low:
            assert last - first < 1.5 * (high - low)
        assert limits.round_limits(math.nan, high) == (-1.0, 1.0)

    def test_sticks_too_near_for_the_eye_are_one(self):
        start = np.linspace(0.0, 1.0, 50_001)[:-1]
        many = Sticks(start, start + 1e-9, np.where(np.arange(50_000) % 2, 1, -1))
        assert many.merged(1e-3, 1000).start.size < 1100
        one = many.where(np.arange(50_000) == 0)
        assert one.merged(1e-3, 1000).start.size == 1
        apart = Sticks(np.array([0.0, 0.2, 0.5]), np.array([0.1, 0.3, 0.6]), np.array([1, 1, -1]))
        for merged, kept in ((apart.merged(0.05, 10), [0, 1, 2]), (apart.merged(0.15, 10), [0, 2])):
            np.testing.assert_array_equal(merged.start, apart.start[kept])


class TestStyle:
    def test_settings_are_put_back_and_those_of_the_user_not_followed(self, response):
        with mpl.rc_context({"axes.facecolor": "black"}):
            before = dict(mpl.rcParams)
            axes = motion.section(response).axes[0]
            assert dict(mpl.rcParams) == before
        assert axes.get_facecolor() == (1.0, 1.0, 1.0, 1.0)

    @pytest.mark.parametrize(
        ("value", "text", "plain"),
        [(-24.0, "-24", "-24"), (0.0, "0", "0"), (62831.85, "62832", "62832"),
         (1 / 3, "0.3333", "0.3333"), (1e6, r"1\times 10^{6}", "1·10⁶"),
         (-2.5e-7, r"-2.5\times 10^{-7}", "-2.5·10⁻⁷")],
    )  # fmt: skip
    def test_numbers(self, value, text, plain):
        assert style.number(value) == text
        assert style.plain(f"$f_e = {text}$ Hz") == f"fₑ = {plain} Hz"

    def test_moments_keep_the_digits_that_the_span_needs(self):
        assert style.moment(19.9466, 24.9) == "19.95"
        assert style.moment(10002.394123, 3.0) == "10002.394"
        assert style.moment(0.0, 0.0) == "0"


def test_a_picture_shows_itself_in_a_notebook_and_keeps_its_text(tmp_path):
    axes = {"eta": np.linspace(-2.0, 1.0, 4), "alpha": np.linspace(0.9, 2.0, 3)}
    picture = wb.plot(wb.stability_map(PAPER, **axes))
    content, about = picture._repr_png_()
    (tmp_path / "shown.png").write_bytes(content)
    across, up = png(tmp_path / "shown.png")
    assert across / about["width"] == pytest.approx(up / about["height"], rel=0.01)
    assert about["width"] == pytest.approx(100.0 * picture.get_figwidth(), abs=1.0)
    with mpl.rc_context({"pdf.fonttype": 3}):
        picture.savefig(tmp_path / "a.pdf")
    content = (tmp_path / "a.pdf").read_bytes()
    assert b"/FontFile2" in content
    assert b"/Type3" not in content
    picture.savefig(tmp_path / "a.svg")
    assert "<text" in (tmp_path / "a.svg").read_text(encoding="utf-8")


class TestSave:
    @pytest.mark.parametrize(
        ("suffix", "write"), [("png", save), ("svg", Picture.savefig), ("pdf", Picture.savefig)]
    )
    def test_same_figure_same_bytes_whatever_the_settings(self, response, tmp_path, suffix, write):
        other = {"hatch.linewidth": 5.0, "path.simplify": False, "xtick.labelsize": 20.0}
        files = []
        for settings in ({}, other):
            folder = tmp_path / str(len(files))
            folder.mkdir()
            with mpl.rc_context(settings):
                before = dict(mpl.rcParams)
                write(motion.section(response), str(folder / f"a.{suffix}"))
                assert dict(mpl.rcParams) == before
            (path,) = folder.iterdir()
            files.append(path.read_bytes())
        assert files[0] == files[1]
        assert files[0].startswith({"png": b"\x89PNG", "svg": b"<?xml", "pdf": b"%PDF-"}[suffix])

    @pytest.mark.parametrize("width", [160, 777])
    def test_width_in_pixels(self, figure, tmp_path, width):
        assert png(save(figure, tmp_path / "a.png", width=width))[0] == width

    @pytest.mark.parametrize(
        ("name", "options", "argument"),
        [("a.jpg", {}, "path"), ("a", {}, "path"), ("", {}, "path")]
        + [("a.png", {"width": width}, "width") for width in (15, 20_001, 1600.0, True)],
    )
    def test_wrong_suffixes_and_widths_write_nothing(
        self, figure, tmp_path, name, options, argument
    ):
        with pytest.raises(wb.InputError, match=f"{argument} = "):
            save(figure, tmp_path / name if name else "", **options)
        assert not list(tmp_path.iterdir())

    def test_not_writable(self, figure, tmp_path):
        (tmp_path / "file").write_text("")
        (tmp_path / "folder.png").mkdir()
        for path in ("no/a.png", "file/a.png", "folder.png"):
            with pytest.raises(wb.OutputError, match="path = "):
                save(figure, tmp_path / path, width=100)
        assert sorted(p.name for p in tmp_path.iterdir()) == ["file", "folder.png"]

    @pytest.mark.parametrize("write", [save, Picture.savefig])
    @pytest.mark.parametrize("broken", ["draw", "replace", "interrupt"])
    def test_failure_leaves_the_old_file_and_nothing_else(
        self, figure, tmp_path, monkeypatch, broken, write
    ):
        path = tmp_path / "a.png"
        path.write_bytes(b"old")
        error = {"draw": MemoryError, "replace": OSError, "interrupt": KeyboardInterrupt}[broken]

        def fail(*_args, **_named):
            raise error

        where = (Figure, "draw") if broken == "draw" else (Path, "replace")
        monkeypatch.setattr(*where, fail)
        with pytest.raises(wb.OutputError if broken == "replace" else error):
            write(figure, path)
        assert path.read_bytes() == b"old"
        assert list(tmp_path.iterdir()) == [path]


class TestSavefig:
    def test_resolution_and_metadata_are_the_users(self, figure, tmp_path):
        with mpl.rc_context({"savefig.dpi": 50}):
            figure.savefig(tmp_path / "a.png")
        figure.savefig(tmp_path / "b.png", dpi=25)
        sizes = [png(tmp_path / name)[0] for name in ("a.png", "b.png")]
        assert sizes == pytest.approx([dots * figure.get_figwidth() for dots in (50, 25)], abs=1)
        figure.savefig(tmp_path / "c.svg", metadata={"Title": "A brake"})
        assert "A brake" in (tmp_path / "c.svg").read_text(encoding="utf-8")

    @pytest.mark.parametrize(
        ("name", "options", "written"),
        [
            ("a", {}, ["a.png"]),
            ("a", {"format": "svg"}, ["a"]),
            ("a.dat", {"format": "png"}, ["a.dat"]),
            ("a.PNG", {}, ["a.PNG"]),
            ("a.xyz", {}, []),
        ],
    )
    def test_names_are_those_of_matplotlib(self, figure, tmp_path, name, options, written):
        for make, folder in ((figure, "ours"), (Figure(), "theirs")):
            (tmp_path / folder).mkdir()
            with nullcontext() if written else pytest.raises(ValueError, match="supported"):
                make.savefig(str(tmp_path / folder / name), **options)
            assert [one.name for one in (tmp_path / folder).iterdir()] == written

    def test_open_files_and_books_of_pages(self, figure, tmp_path):
        """Also of a copy: the file's own fonts, and in a book those of its owner."""
        copy = pickle.loads(pickle.dumps(figure))  # noqa: S301 - our own
        with (tmp_path / "a.pdf").open("wb") as file:
            copy.savefig(file, format="pdf")
        assert b"/Type3" not in (tmp_path / "a.pdf").read_bytes()
        for kind, fonts in ((3, b"/Type3"), (42, b"/FontFile2")):
            with mpl.rc_context({"pdf.fonttype": kind}), PdfPages(tmp_path / "b.pdf") as book:
                book.savefig(figure)
            found = (tmp_path / "b.pdf").read_bytes()
            assert [one for one in (b"/Type3", b"/FontFile2") if one in found] == [fonts]

    def test_through_a_link_and_into_a_pipe(self, figure, tmp_path):
        (tmp_path / "link.svg").symlink_to(tmp_path / "target")
        figure.savefig(tmp_path / "link.svg")
        assert (tmp_path / "link.svg").is_symlink()
        os.mkfifo(tmp_path / "pipe")
        with ThreadPoolExecutor(1) as threads:
            content = threads.submit((tmp_path / "pipe").read_bytes)
            figure.savefig(tmp_path / "pipe", format="svg")
            for one in (content.result(60), (tmp_path / "target").read_bytes()):
                assert one.rstrip().endswith(b"</svg>")
        assert (tmp_path / "pipe").is_fifo()
