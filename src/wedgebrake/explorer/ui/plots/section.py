"""The Poincare section: the state once in every period of the torque."""

from __future__ import annotations

from bokeh.models import ColumnDataSource, Scatter

from wedgebrake.explorer.core.snapshot import Moment
from wedgebrake.explorer.ui.plots import look

# The picture shows at least this share of the motion, or rounding would look like scatter.
_LEAST = 0.05


class Section:
    """Velocity [rad/s] over angle [rad] at the beginning of every recorded period."""

    def __init__(self) -> None:
        self.figure = look.chart(
            "Poincaré section", "angle [rad]", "angular velocity [rad/s]",
            tools="box_zoom,pan,reset", active_drag="box_zoom",
        )  # fmt: skip
        self.figure.xaxis.ticker.desired_num_ticks = 4
        self._words = look.Words(self.figure)
        self._points, self._ghost = (
            ColumnDataSource({"angle": [], "velocity": []}) for _ in range(2)
        )
        for source, colour in ((self._ghost, look.GHOST), (self._points, look.MOTION)):
            dots = Scatter(x="angle", y="velocity", size=4, fill_color=colour, line_color=None)
            self.figure.add_glyph(source, dots)

    def show(self, moment: Moment) -> None:
        """Show the section of a motion."""
        if moment.status != "completed" or not moment.section_angle.size:
            self.say("No settled motion, so no section.")
            return
        several = [one for one in (moment, moment.ghost) if one and one.section_angle.size]
        angle, velocity = moment.section_angle, moment.section_velocity
        look.put(self._points, angle=angle, velocity=velocity)
        ghost = several[1:]
        look.put(
            self._ghost,
            angle=ghost[0].section_angle if ghost else [],
            velocity=ghost[0].section_velocity if ghost else [],
        )
        for name, range_ in (("angle", self.figure.x_range), ("velocity", self.figure.y_range)):
            values = [getattr(one, f"section_{name}") for one in several]
            whole = getattr(moment, name)
            least = _LEAST * float(whole.max() - whole.min()) if whole.size else 0.0
            look.span(
                range_,
                *look.round_span(
                    min(float(one.min()) for one in values),
                    max(float(one.max()) for one in values),
                    least,
                ),
            )
        self._words.say("")
        absent = "" if moment.forcing else ", once in the period of a torque that does not act"
        self._words.key(("●", look.MOTION, f"{angle.size} points{absent}"))

    def say(self, sentence: str) -> None:
        """Show nothing but a sentence."""
        for source in (self._points, self._ghost):
            look.put(source, angle=[], velocity=[])
        self._words.key()
        self._words.say(sentence)
