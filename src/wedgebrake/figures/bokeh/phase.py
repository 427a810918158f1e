"""The phase portrait: velocity over angle."""

from __future__ import annotations

import math

from bokeh.models import ColumnDataSource, CustomJS, Line, Scatter, Segment, Span

from wedgebrake.figures import style
from wedgebrake.figures.bokeh import chart
from wedgebrake.figures.bokeh.history import HistoryChart, show_ghost, velocity_limits
from wedgebrake.figures.data.limits import about, round_limits, thinned
from wedgebrake.figures.data.motion import MotionFigures
from wedgebrake.figures.data.phase import Phase

CURSOR = "scrub-phase"

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


class PhaseChart(chart.Chart):
    """Velocity [rad/s] over angle [rad]; where the brake sticks the orbit is thick.

    history : the chart whose zoom cuts the orbit to a span of time
    """

    def __init__(self, history: HistoryChart) -> None:
        super().__init__(
            chart.chart(
                "Phase portrait", "angle [rad]", "angular velocity [rad/s]",
                tools="box_zoom,pan,reset", active_drag="box_zoom",
            )
        )  # fmt: skip
        self.figure.xaxis.ticker.desired_num_ticks = 4
        self._orbit = ColumnDataSource({"angle": [], "velocity": []})
        self._ghost = self.source("angle", "velocity")
        self._sticks = self.source("x0", "x1", "y0", "y1", "colour")
        self._switching = Span(dimension="width", line_color=chart.INK, line_dash=[5, 3])
        self._releases = [
            Span(dimension="width", line_color=style.RELEASE, line_dash=[2, 3]) for _ in range(2)
        ]
        for line in (self._switching, *self._releases):
            line.visible = False
            line.level = "underlay"
            self.figure.add_layout(line)
        self._draw()
        times, motion = history.figure.x_range, history.motion
        follow = CustomJS(
            args={"motion": motion, "range": times, "orbit": self._orbit}, code=_FOLLOW
        )
        motion.js_on_change("data", follow)
        times.js_on_change("start", follow)
        times.js_on_change("end", follow)

    def _draw(self) -> None:
        drawn, places = self.figure, {"x": "angle", "y": "velocity"}
        cursor = ColumnDataSource({"x": [], "y": []}, name=CURSOR)
        drawn.add_glyph(self._ghost, Line(**places, line_color=chart.GHOST))
        ends = {one: one for one in ("x0", "x1", "y0", "y1")}
        thick = Segment(**ends, line_color="colour", line_width=5, line_alpha=0.55)
        drawn.add_glyph(self._sticks, thick)
        # A stick is a point unless the shaft turns; a line of no length would not be drawn.
        dots = Scatter(x="x1", y="y1", size=6, fill_color="colour", line_color=None)
        drawn.add_glyph(self._sticks, dots)
        self._line = Line(**places, line_color=chart.MOTION)
        drawn.add_glyph(self._orbit, self._line)
        drawn.add_glyph(cursor, chart.position_marker())

    def show(self, motion: MotionFigures, ghost: MotionFigures | None = None) -> None:
        """Show a motion, and another one behind it."""
        data, history = motion.phase, motion.history
        if not history.time.size:
            self.say(motion.ending or "Nothing to show.")
            return
        count = history.velocity[history.bounded].size
        places = thinned(history.velocity[history.bounded])
        # Sent each time: on the page the orbit may have been cut.
        self._orbit.data = {"angle": history.angle[places], "velocity": history.velocity[places]}
        # Thinner for more turns, so that they stay apart.
        self._line.line_width = round(min(1.4, 1.4 * (1300 / count) ** 0.3), 2)
        (x0, x1), (y0, y1), sides = data.segments(history.visible_sticks)
        colours = [chart.STICKS[int(side)] for side in sides]
        chart.update_source(self._sticks, x0=x0, x1=x1, y0=y0, y1=y1, colour=colours)
        show_ghost(self._ghost, ghost, "angle")
        chart.set_range(self.figure.y_range, *self._show_levels(data, motion, ghost))
        low, high = data.angle_extent
        if ghost is not None and ghost.history.time.size and not ghost.history.diverged:
            other = ghost.phase.angle_extent
            low, high = min(low, other[0]), max(high, other[1])
        chart.set_range(self.figure.x_range, *about(low, high))
        self._overlay.say("")

    def _show_levels(
        self, data: Phase, motion: MotionFigures, ghost: MotionFigures | None
    ) -> tuple[float, float]:
        """Show switching line and release speeds; return the limits of velocity [rad/s]."""
        limits = velocity_limits(motion, ghost)
        reach = data.reaching(*limits)
        low, high = limits if reach == limits else round_limits(*reach)
        for line, speed in zip(
            (self._switching, *self._releases), (data.switching, *data.releases), strict=True
        ):
            line.update(
                location=speed if math.isfinite(speed) else 0.0, visible=low <= speed <= high
            )
        key = []
        if self._switching.visible:
            key.append(("╌", chart.INK, "switching"))
        if any(line.visible for line in self._releases):
            key.append(("┄", style.RELEASE, "release"))
        self._overlay.key(*key)
        return low, high

    def say(self, sentence: str) -> None:
        """Show nothing but a sentence."""
        super().say(sentence)
        self._orbit.data = {"angle": [], "velocity": []}
        for line in (self._switching, *self._releases):
            line.visible = False
