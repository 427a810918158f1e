"""The pictures of one motion on the page: history, phase, section, spectrum, brake torque."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from bokeh.events import Tap
from bokeh.models import (
    BoxZoomTool,
    ColumnDataSource,
    CustomJS,
    GlyphRenderer,
    HoverTool,
    HSpan,
    Line,
    MultiLine,
    Node,
    PanTool,
    Range1d,
    ResetTool,
    Scatter,
    Segment,
    VSpan,
    VStrip,
)
from numpy.typing import NDArray

from wedgebrake.arrays import FloatArray
from wedgebrake.figures import style
from wedgebrake.figures.bokeh import chart
from wedgebrake.figures.data.limits import Limits, extent, round_limits, round_limits_about, thinned
from wedgebrake.figures.data.motion import MotionFigures, SpectrumLines
from wedgebrake.figures.data.panels import Level

# Sources that the animation of the brake listens to and moves.
MOTION, POINTED, CURSOR, PHASE_CURSOR = "motion", "scrub-to", "scrub-history", "scrub-phase"
TORQUE_CURSOR = "scrub-torque"
_COLUMNS = ("time", "angle", "velocity", "torque", "drive", "force", "sliding", "sticking")
_ENDS = "x0", "x1", "y0", "y1"
_VELOCITY = "angular velocity [rad/s]"
# Colour of the motion behind, for comparison.
COMPARISON = "#A9B2BD"
_STICKS = {side: colour for side, (colour, _) in style.STICKS.items()} | {0: "#AEB6C0"}
# Change of velocity, as a share of it, that is not seen.
_LEVEL = 1e-6
# Decades shown below the largest line of a spectrum.
_DECADES = 5.0

# A zoom into the history shows its part of the orbit here.
_FOLLOW = """
const {time, angle, velocity} = motion.data
const {start, end, reset_start, reset_end} = range
const whole = start <= reset_start && end >= reset_end
const first = whole ? 0 : Math.max(time.findIndex(t => t >= start), 0)
const after = whole ? -1 : time.findIndex(t => t > end)
const last = after < 0 ? time.length : after
orbit.setv({data: {
  angle: angle.slice(first, last), velocity: velocity.slice(first, last),
}}, {sync: false})
"""


class MotionChart(chart.Chart):
    """A figure of one motion, with lines at levels.

    zoom : directions of zooming: "" or "x"
    """

    def __init__(self, title: str, across: str, up: str, zoom: str = "", **options: Any) -> None:
        way: Any = "width" if zoom else "both"
        tools = [BoxZoomTool(dimensions=way), PanTool(dimensions=way), ResetTool()]
        super().__init__(chart.chart(title, across, up, tools, **options))
        self._levels: list[chart.MarkedLine] = []
        self.show_overlay("Computing …")

    def line(
        self, source: ColumnDataSource, x: str, y: str, colour: str, width: float = 1.0
    ) -> GlyphRenderer:
        """Add a line through columns of a source."""
        glyph = Line(x=x, y=y, line_color=colour, line_width=width)
        return self.draw(source, glyph)

    def cursor(self, name: str, *glyphs: Any) -> None:
        """Add the marker of the current position, a source that the animation moves."""
        source = self.fixed_source({"x": [], "y": []}, name)
        dot = Scatter(x="x", y="y", size=8, fill_color=style.ORANGE, line_color=chart.INK)
        for glyph in (*glyphs, dot):
            self.draw(source, glyph)

    def hover(self, line: GlyphRenderer, *tips: tuple[str, str]) -> None:
        """Show values of a line above and below the pointer."""
        options = {"mode": "vline", "visible": False}
        self.figure.add_tools(HoverTool(renderers=[line], tooltips=list(tips), **options))

    def add_levels(self, dimension: str, *downs: float | None) -> None:
        """Add lines along a dimension, labels at distances below the top [px]; None: no label."""
        for down in downs:
            top = Node(target="frame", symbol="top")
            label = None if down is None else {"y": top, "x_offset": 4, "y_offset": -down}
            self._levels.append(chart.MarkedLine(self.figure, dimension, label, level="underlay"))

    def show_levels(self, levels: Sequence[Level], low: float, high: float) -> list[Level]:
        """Show levels between two values; returns those."""
        for drawn in self._levels[len(levels) :]:
            drawn.show(None)
        for drawn, level in zip(self._levels, levels, strict=False):
            dash = [math.ceil(one) for one in level.dashes]
            drawn.line.update(line_color=level.colour, line_dash=dash)
            at = level.value if low <= level.value <= high else None
            drawn.show(at, style.plain(level.label), text_color=level.colour)
        return [level for level in levels if low <= level.value <= high]

    def show_comparison(
        self, source: ColumnDataSource, comparison: MotionFigures | None, across: str
    ) -> None:
        """Show the velocity of the motion behind over its time or angle."""
        if comparison is None:
            chart.clear_source(source)
            return
        data = comparison.history
        places = thinned(data.velocity[data.bounded])
        columns = {across: getattr(data, across)[places], "velocity": data.velocity[places]}
        chart.update_source(source, **columns)

    def show_message(self, sentence: str) -> None:
        """Show only a sentence."""
        super().show_message(sentence)
        for level in self._levels:
            level.show(None)


class HistoryChart(MotionChart):
    """Velocity [rad/s] over time [s] in the last periods of a run.

    figure : the picture
    motion : source "motion" of the animation: motion, torques, actuation force, sticking
    """

    def __init__(self) -> None:
        super().__init__("History", "time [s]", _VELOCITY, "x")
        drawn = self.figure
        self.motion = self.source(*_COLUMNS, name=MOTION)
        self._comparison = self.source("time", "velocity")
        self._sticks = self.source("start", "end", "colour")
        strip = VStrip(x0="start", x1="end", fill_color="colour", fill_alpha=0.32, line_color=None)
        self.draw(self._sticks, strip)
        self.draw(self.fixed_source({"y": [0.0]}), HSpan(y="y", line_color=chart.FRAME))
        self.line(self._comparison, "time", "velocity", COMPARISON)
        line = self.line(self.motion, "time", "velocity", style.MOTION, 1.4)
        self.cursor(CURSOR, VSpan(x="x", line_color=chart.INK, line_alpha=0.45))
        self.hover(
            line,
            ("time", "@time{0.0000} s"),
            ("velocity", "@velocity{0.000} rad/s"),
            ("brake torque", "@torque{0.0} N m"),
        )
        pointed = ColumnDataSource({"x": []}, name=POINTED)
        code = "pointed.setv({data: {x: [cb_obj.x]}}, {sync: false})"
        drawn.js_on_event(Tap, CustomJS(args={"pointed": pointed}, code=code))

    def show(self, motion: MotionFigures, comparison: MotionFigures | None = None) -> None:
        """Show a motion, and another motion behind it."""
        data = motion.history
        if not data.time.size:
            self.show_message(motion.ending or "Nothing to show.")
            return
        sticking = data.sticking.astype("uint8")
        samples = data.time, data.angle, data.velocity, data.brake_torque, data.drive_torque
        columns = zip(_COLUMNS, (*samples, motion.force, motion.sliding, sticking), strict=True)
        places = thinned(data.velocity[data.bounded])
        chart.update_source(self.motion, **{name: one[places] for name, one in columns})
        sticks = data.visible_sticks
        colours = [_STICKS[int(side)] for side in sticks.side]
        chart.update_source(self._sticks, start=sticks.start, end=sticks.end, colour=colours)
        self.show_comparison(self._comparison, comparison, "time")
        first, last = data.time[data.bounded][[0, -1]]
        chart.set_range(self.figure.x_range, float(first), float(last))
        chart.set_range(self.figure.y_range, *_velocity_limits(motion, comparison))
        self.show_overlay(motion.ending)
        sides = data.sticks.by_side()
        key = [("■", _STICKS[side], style.plain(style.STICKS[side][1])) for side in sides]
        if comparison is not None:
            key.append(("—", COMPARISON, "conventional brake"))
        self.set_key(*key)


class PhaseChart(MotionChart):
    """Velocity [rad/s] over angle [rad]; where the brake sticks the orbit is thick.

    history : the chart whose zoom limits the time span of the orbit
    """

    def __init__(self, history: HistoryChart) -> None:
        super().__init__("Phase portrait", "angle [rad]", _VELOCITY)
        drawn = self.figure
        drawn.xaxis.ticker.desired_num_ticks = 4
        self._orbit, self._comparison = (self.source("angle", "velocity") for _ in range(2))
        self._sticks = self.source("angle", "velocity", "colour")
        self._ends = self.source("angle", "velocity", "colour")
        self.add_levels("width", None, None, None)
        self.line(self._comparison, "angle", "velocity", COMPARISON)
        thick = {"line_color": "colour", "line_width": 5, "line_alpha": 0.55}
        self.draw(self._sticks, MultiLine(xs="angle", ys="velocity", **thick))
        # A stick is a point unless the shaft turns; a line of no length would not be drawn.
        dots = Scatter(x="angle", y="velocity", size=6, fill_color="colour", line_color=None)
        self.draw(self._ends, dots)
        self._line = self.line(self._orbit, "angle", "velocity", style.MOTION).glyph
        self.cursor(PHASE_CURSOR)
        times, motion = history.figure.x_range, history.motion
        given = {"motion": motion, "range": times, "orbit": self._orbit}
        follow = CustomJS(args=given, code=_FOLLOW)
        motion.js_on_change("data", follow)
        times.js_on_change("start", follow)
        times.js_on_change("end", follow)

    def show(self, motion: MotionFigures, comparison: MotionFigures | None = None) -> None:
        """Show a motion, and another motion behind it."""
        data, history = motion.phase, motion.history
        if not history.time.size:
            self.show_message(motion.ending or "Nothing to show.")
            return
        velocity = history.velocity[history.bounded]
        places = thinned(velocity)
        # Sent each time: a zoom may have cut the orbit on the page.
        self._orbit.data = {"angle": history.angle[places], "velocity": history.velocity[places]}
        # Thinner for more turns, so that they stay apart.
        self._line.line_width = round(min(1.4, 1.4 * (1300 / velocity.size) ** 0.3), 2)
        sticks = history.visible_sticks
        colours = [_STICKS[int(side)] for side in sticks.side]
        paths = [(x[shown], y[shown]) for x, y in data.paths(sticks) for shown in (_bends(y),)]
        columns = {"angle": [x for x, _ in paths], "velocity": [y for _, y in paths]}
        chart.update_source(self._sticks, **columns, colour=colours)
        ends = {name: [float(one[-1]) for one in those] for name, those in columns.items()}
        chart.update_source(self._ends, **ends, colour=colours)
        self.show_comparison(self._comparison, comparison, "angle")
        limits = _velocity_limits(motion, comparison)
        reach = data.reaching(*limits)
        low, high = limits if reach == limits else round_limits(*reach)
        chart.set_range(self.figure.y_range, low, high)
        seen = self.show_levels(data.levels, low, high)
        words = {style.SWITCHING: ("—", "switching"), style.RELEASE: ("╌", "release")}
        colours = list(dict.fromkeys(level.colour for level in seen))
        self.set_key(*((words[one][0], one, words[one][1]) for one in colours))
        both = [one.phase.angle_extent for one in _deciding(motion, comparison)]
        chart.set_range(self.figure.x_range, *round_limits_about(*extent(np.array(both))))
        self.show_overlay("")


class SectionChart(MotionChart):
    """Velocity [rad/s] over angle [rad], once in every recorded period of the torque.

    Without a torque, where the velocity crosses the middle of its range upwards.
    """

    def __init__(self) -> None:
        super().__init__("Poincaré section", "angle [rad]", _VELOCITY)
        self.figure.xaxis.ticker.desired_num_ticks = 4
        self._points, self._comparison = (self.source("angle", "velocity") for _ in range(2))
        for source, colour in ((self._comparison, COMPARISON), (self._points, style.MOTION)):
            dots = Scatter(x="angle", y="velocity", size=4, fill_color=colour, line_color=None)
            self.draw(source, dots)

    def show(self, motion: MotionFigures, comparison: MotionFigures | None = None) -> None:
        """Show the section of a motion, and that of another motion behind it."""
        data = motion.section
        if not motion.completed or not data.angle.size:
            self.show_message("No steady motion, hence no section.")
            return
        chart.update_source(self._points, angle=data.angle, velocity=data.velocity)
        shown = [data]
        if comparison is None:
            chart.clear_source(self._comparison)
        else:
            shown.append(comparison.section)
            behind = comparison.section
            chart.update_source(self._comparison, angle=behind.angle, velocity=behind.velocity)
        across, up = extent(*(s.angle for s in shown)), extent(*(s.velocity for s in shown))
        for axis, (low, high), least in zip(
            (self.figure.x_range, self.figure.y_range), (across, up), data.least, strict=True
        ):
            least = least or 0.2 * max(abs(low), abs(high))  # nothing moves
            chart.set_range(axis, *round_limits(low, high, least))
        self.show_overlay("")


class SpectrumChart(MotionChart):
    """Amplitude of the velocity [rad/s], logarithmic, over frequency [Hz]."""

    def __init__(self) -> None:
        super().__init__(
            "Spectrum", "frequency [Hz]", "amplitude [rad/s]", "x", log=True,
            ranges=(Range1d(0.0, 1.0), Range1d(1e-5, 1.0)),
        )  # fmt: skip
        self.figure.xaxis.ticker.desired_num_ticks = 6
        self._lines, self._comparison = (self.source("frequency", "amplitude") for _ in range(2))
        self.add_levels("height", 3, 16)
        self.line(self._comparison, "frequency", "amplitude", COMPARISON)
        line = self.line(self._lines, "frequency", "amplitude", style.MOTION, 1.2)
        amplitude = "@amplitude{0.000e+0} rad/s"
        self.hover(line, ("frequency", "@frequency{0.00} Hz"), ("amplitude", amplitude))

    def show(self, motion: MotionFigures, comparison: MotionFigures | None = None) -> None:
        """Show the spectrum of a motion, and that of another motion behind it."""
        data = motion.spectrum
        if not motion.completed:
            self.show_message("No steady motion, hence no spectrum.")
            return
        if not data.amplitude.size:
            self.show_message(
                "No spectrum: the torque is too slow compared with the free vibration."
            )
            return
        if data.top == 0.0:
            self.show_message("No motion, hence no spectrum.")
            return
        top = max(data.top, comparison.spectrum.top) if comparison is not None else data.top
        # Rounded to half decades, so that limits seldom change.
        floor = 10.0 ** (math.floor(2.0 * math.log10(top)) / 2.0 - _DECADES)
        ceiling = 10.0 ** (math.ceil(2.0 * math.log10(1.3 * top)) / 2.0)
        _update(self._lines, data, floor)
        _update(self._comparison, comparison.spectrum if comparison is not None else None, floor)
        chart.set_range(self.figure.x_range, 0.0, float(data.frequency[-1]))
        chart.set_range(self.figure.y_range, floor, ceiling)
        self.show_levels(data.levels, 5e-324, math.inf)
        self.show_overlay("")


class TorqueChart(MotionChart):
    """Brake torque [N m] over the sliding velocity [rad/s], in both directions."""

    def __init__(self) -> None:
        super().__init__("Brake torque", "sliding velocity [rad/s]", "torque [N m]")
        drawn = self.figure
        drawn.xaxis.ticker.desired_num_ticks = 5
        zero = self.fixed_source({"at": [0.0]})
        for span in (HSpan(y="at", line_color=chart.FRAME), VSpan(x="at", line_color=chart.FRAME)):
            self.draw(zero, span)
        self._comparison, self._curve = (self.source("velocity", "torque") for _ in range(2))
        self._holding, self._limits = self.source("low", "high"), self.source(*_ENDS)
        self._steady = self.source("velocity", "torque")
        self.line(self._comparison, "velocity", "torque", COMPARISON)
        line = self.line(self._curve, "velocity", "torque", style.MOTION, 1.6)
        held = Segment(x0=0.0, x1=0.0, y0="low", y1="high", line_color=style.MOTION, line_width=3)
        self.draw(self._holding, held)
        dashed = {"line_color": chart.INK, "line_width": 1.2, "line_dash": [6, 3]}
        self.draw(self._limits, Segment(**{one: one for one in _ENDS}, **dashed))
        dot = Scatter(x="velocity", y="torque", size=8, fill_color=chart.INK, line_color=None)
        self.draw(self._steady, dot)
        self.cursor(TORQUE_CURSOR)
        torque = "@torque{0.0} N m"
        self.hover(line, ("velocity", "@velocity{0.00} rad/s"), ("brake torque", torque))

    def show(self, motion: MotionFigures, comparison: MotionFigures | None = None) -> None:
        """Show the torque of a brake, and that of another brake behind it."""
        data = motion.torque
        for source, one in ((self._curve, motion), (self._comparison, comparison)):
            columns = one.torque.line if one is not None else ([], [])
            chart.update_source(source, **dict(zip(("velocity", "torque"), columns, strict=True)))
        ends = np.array([part.limit for part in data.directions if part.limit]).reshape(-1, 4)
        chart.update_source(self._limits, **dict(zip(_ENDS, ends.T, strict=True)))
        low, high = np.clip(data.holding, *data.up)
        chart.update_source(self._holding, low=[low], high=[high])
        steady = [] if data.steady is None else [data.steady]
        chart.update_source(
            self._steady, velocity=[v for v, _ in steady], torque=[torque for _, torque in steady]
        )
        chart.set_range(self.figure.x_range, *data.across)
        chart.set_range(self.figure.y_range, *data.up)
        key = [("╌", chart.INK, "Hopf limit")] if ends.size else []
        if steady:
            key.insert(0, ("●", chart.INK, "steady"))
        if data.locked:
            key.append(("", style.VERMILLION, "locks forwards"))
        self.show_overlay("" if data.known else "No contact.")
        self.set_key(*key)


def _deciding(motion: MotionFigures, comparison: MotionFigures | None) -> list[MotionFigures]:
    """The motions that set the limits: not a comparison that grows without bound."""
    if comparison is None or not comparison.history.time.size or comparison.history.diverged:
        return [motion]
    return [motion, comparison]


def _bends(velocity: FloatArray) -> NDArray[np.int64]:
    """Places of the points of a path in the phase plane; the ends of a straight one."""
    straight = np.ptp(velocity) <= _LEVEL * np.max(np.abs(velocity))
    return np.array([0, velocity.size - 1]) if straight else thinned(velocity)


def _velocity_limits(motion: MotionFigures, comparison: MotionFigures | None) -> Limits:
    """Limits of velocity [rad/s] that history and phase portrait share."""
    both = [one.history.velocity_extent for one in _deciding(motion, comparison)]
    return round_limits_about(*extent(np.array(both)), np.nan_to_num(motion.phase.drive_speed))


def _update(source: ColumnDataSource, data: SpectrumLines | None, floor: float) -> None:
    """Show lines down to the floor of the picture."""
    if data is None or not data.amplitude.size:
        chart.clear_source(source)
        return
    amplitude = np.maximum(data.amplitude, floor)
    places = thinned(np.log(amplitude))
    chart.update_source(source, frequency=data.frequency[places], amplitude=amplitude[places])
