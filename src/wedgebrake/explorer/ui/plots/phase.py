"""The phase portrait: velocity over angle."""

from __future__ import annotations

import math

import numpy as np
from bokeh.models import ColumnDataSource, CustomJS, Line, Scatter, Segment, Span

from wedgebrake.explorer.core.snapshot import Moment
from wedgebrake.explorer.ui.plots import look
from wedgebrake.explorer.ui.plots.history import History, velocities
from wedgebrake.figures.matplotlib import style

CURSOR = "scrub-phase"
# The picture grows up to so many times, to show the switching line and the release speeds.
_FARTHEST = 1.6

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


class Phase:
    """Velocity [rad/s] over angle [rad]; where the brake sticks the orbit is thick.

    history : the chart whose zoom cuts the orbit to a span of time
    """

    def __init__(self, history: History) -> None:
        motion, times = history.motion, history.figure.x_range
        self.figure = look.chart(
            "Phase portrait", "angle [rad]", "angular velocity [rad/s]",
            tools="box_zoom,pan,reset", active_drag="box_zoom",
        )  # fmt: skip
        self.figure.xaxis.ticker.desired_num_ticks = 4
        self._words = look.Words(self.figure)
        empty: list[float] = []
        self._orbit = ColumnDataSource({"angle": empty, "velocity": empty})
        self._ghost = ColumnDataSource({"angle": empty, "velocity": empty})
        self._sticks = ColumnDataSource({"x0": empty, "x1": empty, "y": empty, "colour": []})
        cursor = ColumnDataSource({"x": empty, "y": empty}, name=CURSOR)
        self._switching = Span(dimension="width", line_color=look.INK, line_dash=[5, 3])
        self._releases = [
            Span(dimension="width", line_color=style.RELEASE, line_dash=[2, 3]) for _ in range(2)
        ]
        for line in (self._switching, *self._releases):
            line.visible = False
            line.level = "underlay"
            self.figure.add_layout(line)
        self._draw(cursor)
        follow = CustomJS(
            args={"motion": motion, "range": times, "orbit": self._orbit}, code=_FOLLOW
        )
        motion.js_on_change("data", follow)
        times.js_on_change("start", follow)
        times.js_on_change("end", follow)

    def _draw(self, cursor: ColumnDataSource) -> None:
        drawn = self.figure
        drawn.add_glyph(self._ghost, Line(x="angle", y="velocity", line_color=look.GHOST))
        drawn.add_glyph(
            self._sticks,
            Segment(
                x0="x0", y0="y", x1="x1", y1="y", line_color="colour", line_width=5,
                line_alpha=0.55,
            ),
        )  # fmt: skip
        # A rest is a point unless the shaft turns; a line of no length would not be drawn.
        drawn.add_glyph(
            self._sticks, Scatter(x="x1", y="y", size=6, fill_color="colour", line_color=None)
        )
        self._line = Line(x="angle", y="velocity", line_color=look.MOTION)
        drawn.add_glyph(self._orbit, self._line)
        drawn.add_glyph(cursor, look.point())

    def show(self, moment: Moment) -> None:
        """Show a motion."""
        shown = look.fitting(moment)
        angle, velocity = moment.angle[shown], moment.velocity[shown]
        if not angle.size:
            self.say(look.ending(moment) or "Nothing to show.")
            return
        places = look.thinned(velocity)
        # On the page the orbit is cut to what the history shows.
        self._orbit.data = {"angle": angle[places], "velocity": velocity[places]}
        # Thinner for more turns, so that they stay apart.
        self._line.line_width = round(min(1.4, 1.4 * (1300 / angle.size) ** 0.3), 2)
        sticks = look.rests(moment)
        sides = [int(side) for side in sticks[:, 2]]
        ends = np.interp(sticks[:, :2], moment.time, moment.angle)
        middle = np.interp(sticks[:, :2].mean(axis=1), moment.time, moment.velocity)
        look.put(
            self._sticks,
            x0=ends[:, 0],
            x1=ends[:, 1],
            y=middle,
            colour=[look.STICKS[side] for side in sides],
        )
        self._show_ghost(moment.ghost)
        low, high = self._show_lines(moment, *velocities(moment))
        look.span(self.figure.y_range, low, high)
        look.span(self.figure.x_range, *_angles(moment))
        self._words.say("")

    def _show_lines(self, moment: Moment, low: float, high: float) -> tuple[float, float]:
        """Switching line and release speeds, and the range of velocities that holds them."""
        switching, release = -moment.drive_speed, moment.release_speed
        room = (_FARTHEST - 1.0) * (high - low)
        speeds = [switching, switching + release, switching - release]
        for speed in speeds:
            if low - room <= speed < low or high < speed <= high + room:
                low, high = look.round_span(min(low, speed), max(high, speed))
        key = []
        for line, speed in zip([self._switching, *self._releases], speeds, strict=True):
            line.update(
                location=speed if math.isfinite(speed) else 0.0, visible=low <= speed <= high
            )
        if self._switching.visible:
            key.append(("╌", look.INK, "switching"))
        if any(line.visible for line in self._releases):
            key.append(("┄", style.RELEASE, "release"))
        self._words.key(*key)
        return low, high

    def _show_ghost(self, ghost: Moment | None) -> None:
        if ghost is None:
            look.put(self._ghost, angle=[], velocity=[])
            return
        shown = look.fitting(ghost)
        places = look.thinned(ghost.velocity[shown])
        look.put(
            self._ghost,
            angle=ghost.angle[shown][places],
            velocity=ghost.velocity[shown][places],
        )

    def say(self, sentence: str) -> None:
        """Show nothing but a sentence."""
        self._orbit.data = {"angle": [], "velocity": []}
        look.put(self._sticks, x0=[], x1=[], y=[], colour=[])
        self._show_ghost(None)
        for line in (self._switching, *self._releases):
            line.visible = False
        self._words.key()
        self._words.say(sentence)


def _angles(moment: Moment) -> tuple[float, float]:
    """Ends of the range of angles [rad]."""
    several = [moment.angle[look.fitting(moment)]]
    if moment.ghost is not None and moment.ghost.time.size and moment.ghost.status != "diverged":
        several.append(moment.ghost.angle)
    low, high = min(float(one.min()) for one in several), max(float(one.max()) for one in several)
    return look.about(low, high)
