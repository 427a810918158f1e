"""The Poincaré section: the state once in every period of the torque."""

from __future__ import annotations

from bokeh.models import Scatter

from wedgebrake.figures.bokeh import chart
from wedgebrake.figures.data.limits import extent, round_limits
from wedgebrake.figures.data.motion import MotionFigures


class SectionChart(chart.Chart):
    """Velocity [rad/s] over angle [rad] at the beginning of every recorded period."""

    def __init__(self) -> None:
        super().__init__(
            chart.chart(
                "Poincaré section", "angle [rad]", "angular velocity [rad/s]",
                tools="box_zoom,pan,reset", active_drag="box_zoom",
            )
        )  # fmt: skip
        self.figure.xaxis.ticker.desired_num_ticks = 4
        self._points, self._ghost = (self.source("angle", "velocity") for _ in range(2))
        for source, colour in ((self._ghost, chart.GHOST), (self._points, chart.MOTION)):
            dots = Scatter(x="angle", y="velocity", size=4, fill_color=colour, line_color=None)
            self.figure.add_glyph(source, dots)

    def show(self, motion: MotionFigures, ghost: MotionFigures | None = None) -> None:
        """Show the section of a motion, and that of another one behind it."""
        data = motion.section
        if not motion.completed or not data.angle.size:
            self.say("No steady motion, hence no section.")
            return
        chart.update_source(self._points, angle=data.angle, velocity=data.velocity)
        shown = [data]
        if ghost is None:
            chart.clear_source(self._ghost)
        else:
            other = ghost.section
            chart.update_source(self._ghost, angle=other.angle, velocity=other.velocity)
            shown.append(other)
        for name, range_, least in (
            ("angle", self.figure.x_range, data.least[0]),
            ("velocity", self.figure.y_range, data.least[1]),
        ):
            limits = extent(*(getattr(one, name) for one in shown))
            chart.set_range(range_, *round_limits(*limits, least))
        self._overlay.say("")
        absent = "" if data.stated_period is None else ", once in the period of an absent torque"
        self._overlay.key(("●", chart.MOTION, f"{data.angle.size} points{absent}"))
