"""Velocity over time, with the sticks shaded."""

from __future__ import annotations

from bokeh.events import Tap
from bokeh.models import ColumnDataSource, CustomJS, HoverTool, HSpan, Line, VSpan, VStrip

from wedgebrake.figures.bokeh import chart
from wedgebrake.figures.data.history import History
from wedgebrake.figures.data.limits import Limits, about, thinned
from wedgebrake.figures.data.motion import MotionFigures

# Sources that the animation of the brake listens to and moves.
MOTION, POINTED, CURSOR = "motion", "scrub-to", "scrub-history"
_COLUMNS = ("time", "angle", "velocity", "torque", "sticking")


class HistoryChart(chart.Chart):
    """Velocity [rad/s] over time [s] in the last periods of a run.

    figure : the picture
    motion : source "motion" of all that animates: time, angle, velocity, torque, sticking
    """

    def __init__(self) -> None:
        super().__init__(
            chart.chart(
                "History", "time [s]", "angular velocity [rad/s]",
                tools="xbox_zoom,xpan,reset", active_drag="xbox_zoom",
            )
        )  # fmt: skip
        self.motion = self.source(*_COLUMNS, name=MOTION)
        self._ghost = self.source("time", "velocity")
        self._sticks = self.source("start", "end", "colour")
        self._draw()
        pointed = ColumnDataSource({"x": []}, name=POINTED)
        code = "pointed.setv({data: {x: [cb_obj.x]}}, {sync: false})"
        self.figure.js_on_event(Tap, CustomJS(args={"pointed": pointed}, code=code))

    def _draw(self) -> None:
        drawn, places = self.figure, {"x": "time", "y": "velocity"}
        cursor = ColumnDataSource({"x": [], "y": []}, name=CURSOR)
        drawn.add_glyph(
            self._sticks,
            VStrip(x0="start", x1="end", fill_color="colour", fill_alpha=0.32, line_color=None),
        )
        drawn.add_glyph(ColumnDataSource({"y": [0.0]}), HSpan(y="y", line_color=chart.FRAME))
        drawn.add_glyph(self._ghost, Line(**places, line_color=chart.GHOST))
        line = drawn.add_glyph(self.motion, Line(**places, line_color=chart.MOTION, line_width=1.4))
        drawn.add_glyph(cursor, VSpan(x="x", line_color=chart.INK, line_alpha=0.45))
        drawn.add_glyph(cursor, chart.position_marker())
        drawn.add_tools(
            HoverTool(
                renderers=[line],
                mode="vline",
                visible=False,
                tooltips=[
                    ("time", "@time{0.0000} s"),
                    ("velocity", "@velocity{0.000} rad/s"),
                    ("brake torque", "@torque{0.0} N m"),
                ],
            )
        )

    def show(self, motion: MotionFigures, ghost: MotionFigures | None = None) -> None:
        """Show a motion, and another one behind it."""
        data = motion.history
        if not data.time.size:
            self.say(motion.ending or "Nothing to show.")
            return
        places = thinned(data.velocity[data.bounded])
        chart.update_source(
            self.motion,
            time=data.time[places],
            angle=data.angle[places],
            velocity=data.velocity[places],
            torque=data.brake_torque[places],
            sticking=data.sticking[places].astype("uint8"),
        )
        sticks = data.visible_sticks
        chart.update_source(
            self._sticks,
            start=sticks.start,
            end=sticks.end,
            colour=[chart.STICKS[int(side)] for side in sticks.side],
        )
        show_ghost(self._ghost, ghost, "time")
        first, last = data.time[data.bounded][[0, -1]]
        chart.set_range(self.figure.x_range, float(first), float(last))
        chart.set_range(self.figure.y_range, *velocity_limits(motion, ghost))
        self._overlay.say(motion.ending)
        key = [("■", chart.STICKS[side], chart.STICK_LABELS[side]) for side in sticks.by_side()]
        if ghost is not None:
            key.append(("—", chart.GHOST, "conventional brake"))
        self._overlay.key(*key)


def show_ghost(source: ColumnDataSource, ghost: MotionFigures | None, across: str) -> None:
    """Show the velocity of the motion behind over its time or angle."""
    if ghost is None:
        chart.clear_source(source)
        return
    data: History = ghost.history
    places = thinned(data.velocity[data.bounded])
    columns = {across: getattr(data, across)[places], "velocity": data.velocity[places]}
    chart.update_source(source, **columns)


def velocity_limits(motion: MotionFigures, ghost: MotionFigures | None) -> Limits:
    """Limits of velocity [rad/s] that history and phase portrait share."""
    low, high = motion.history.velocity_extent
    if ghost is not None and ghost.history.time.size and not ghost.history.diverged:
        other = ghost.history.velocity_extent
        low, high = min(low, other[0]), max(high, other[1])
    return about(low, high, motion.phase.drive_speed)
