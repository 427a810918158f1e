"""Velocity over time, with the sticks shaded."""

from __future__ import annotations

from bokeh.events import Tap
from bokeh.models import (
    ColumnDataSource,
    CustomJS,
    HoverTool,
    HSpan,
    Line,
    VSpan,
    VStrip,
)

from wedgebrake.explorer.core.snapshot import Moment
from wedgebrake.explorer.ui.plots import look

# Sources of the brake animation, and the cursor that it moves (widgets/brake_animation.js).
_COLUMNS = ("time", "angle", "velocity", "torque", "drive", "force", "sticking")
MOTION, POINTED, CURSOR = "motion", "scrub-to", "scrub-history"


class History:
    """Velocity [rad/s] over time [s] in the last periods of a run.

    figure : the picture
    motion : source "motion" of the animation: time, angle, velocity, torques, force, sticking
    """

    def __init__(self) -> None:
        self.figure = look.chart(
            "History", "time [s]", "angular velocity [rad/s]",
            tools="xbox_zoom,xpan,reset", active_drag="xbox_zoom",
        )  # fmt: skip
        self._words = look.Words(self.figure)
        empty: list[float] = []
        self.motion = ColumnDataSource(
            dict.fromkeys(_COLUMNS, empty),
            name=MOTION,
        )
        self._ghost = ColumnDataSource({"time": empty, "velocity": empty})
        self._sticks = ColumnDataSource({"start": empty, "end": empty, "colour": []})
        cursor = ColumnDataSource({"x": empty, "y": empty}, name=CURSOR)
        pointed = ColumnDataSource({"x": empty}, name=POINTED)
        self._draw(cursor)
        self.figure.js_on_event(
            Tap,
            CustomJS(
                args={"pointed": pointed},
                code="pointed.setv({data: {x: [cb_obj.x]}}, {sync: false})",
            ),
        )

    def _draw(self, cursor: ColumnDataSource) -> None:
        drawn = self.figure
        drawn.add_glyph(
            self._sticks,
            VStrip(x0="start", x1="end", fill_color="colour", fill_alpha=0.32, line_color=None),
        )
        drawn.add_glyph(ColumnDataSource({"y": [0.0]}), HSpan(y="y", line_color=look.FRAME))
        drawn.add_glyph(self._ghost, Line(x="time", y="velocity", line_color=look.GHOST))
        line = drawn.add_glyph(
            self.motion, Line(x="time", y="velocity", line_color=look.MOTION, line_width=1.4)
        )
        drawn.add_glyph(cursor, VSpan(x="x", line_color=look.INK, line_alpha=0.45))
        drawn.add_glyph(cursor, look.point())
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

    def show(self, moment: Moment) -> None:
        """Show a motion."""
        shown = look.fitting(moment)
        time, velocity = moment.time[shown], moment.velocity[shown]
        places = look.thinned(velocity)
        look.put(
            self.motion,
            time=time[places],
            angle=moment.angle[shown][places],
            velocity=velocity[places],
            torque=moment.torque[shown][places],
            drive=moment.drive[shown][places],
            force=moment.force[shown][places],
            sticking=moment.sticking[shown][places].astype("uint8"),
        )
        sticks = look.rests(moment)
        sides = [int(side) for side in sticks[:, 2]]
        look.put(
            self._sticks,
            start=sticks[:, 0],
            end=sticks[:, 1],
            colour=[look.STICKS[side] for side in sides],
        )
        self._show_ghost(moment.ghost)
        if not time.size:
            self.say(look.ending(moment) or "Nothing to show.")
            return
        look.span(self.figure.x_range, float(time[0]), float(time[-1]))
        look.span(self.figure.y_range, *velocities(moment))
        self._words.say(look.ending(moment))
        key = [
            ("■", look.STICKS[side], look.STICK_WORDS[side]) for side in sorted(set(sides))[::-1]
        ]
        if moment.ghost is not None:
            key.append(("—", look.GHOST, "conventional brake"))
        self._words.key(*key)

    def _show_ghost(self, ghost: Moment | None) -> None:
        if ghost is None:
            look.put(self._ghost, time=[], velocity=[])
            return
        shown = look.fitting(ghost)
        places = look.thinned(ghost.velocity[shown])
        look.put(
            self._ghost,
            time=ghost.time[shown][places],
            velocity=ghost.velocity[shown][places],
        )

    def say(self, sentence: str) -> None:
        """Show nothing but a sentence."""
        look.put(self.motion, **{name: [] for name in _COLUMNS})
        look.put(self._sticks, start=[], end=[], colour=[])
        self._show_ghost(None)
        self._words.key()
        self._words.say(sentence)


def velocities(moment: Moment) -> tuple[float, float]:
    """Ends of the range of velocities [rad/s], of history and phase portrait."""
    one = moment.velocity[look.fitting(moment)]
    low, high = float(one.min()), float(one.max())
    ghost = moment.ghost
    if ghost is not None and ghost.time.size:
        other = ghost.velocity[look.fitting(ghost)]
        if ghost.status != "diverged":
            low, high = min(low, float(other.min())), max(high, float(other.max()))
    return look.about(low, high, moment.drive_speed)
