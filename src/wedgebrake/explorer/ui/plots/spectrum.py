"""The amplitude spectrum of the velocity."""

from __future__ import annotations

import math

import numpy as np
from bokeh.models import ColumnDataSource, HoverTool, Label, Line, Node, Range1d, Span
from bokeh.plotting import figure

from wedgebrake.explorer.core.snapshot import Moment
from wedgebrake.explorer.ui.plots import look
from wedgebrake.figures.matplotlib import style

# Decades below the largest line that are shown.
_DECADES = 5.0


class Spectrum:
    """Amplitude of the velocity [rad/s], logarithmic, over frequency [Hz]."""

    def __init__(self) -> None:
        self.figure = look.chart(
            "Spectrum", "frequency [Hz]", "amplitude [rad/s]",
            y_axis_type="log", y_range=Range1d(1e-5, 1.0),
            tools="xbox_zoom,xpan,reset", active_drag="xbox_zoom",
        )  # fmt: skip
        self._words = look.Words(self.figure)
        self._lines, self._ghost = (
            ColumnDataSource({"frequency": [], "amplitude": []}) for _ in range(2)
        )
        self._marks = (
            _Mark(self.figure, "f\u2091", style.FORCING, [5, 2], 3),
            _Mark(self.figure, "f\u2099", style.NATURAL, [2, 2], 16),
        )
        places = {"x": "frequency", "y": "amplitude"}
        self.figure.add_glyph(self._ghost, Line(**places, line_color=look.GHOST))
        line = self.figure.add_glyph(
            self._lines, Line(**places, line_color=look.MOTION, line_width=1.2)
        )
        self.figure.add_tools(
            HoverTool(
                renderers=[line],
                mode="vline",
                visible=False,
                tooltips=[
                    ("frequency", "@frequency{0.00} Hz"),
                    ("amplitude", "@amplitude{0.000e+0} rad/s"),
                ],
            )
        )

    def show(self, moment: Moment) -> None:
        """Show the spectrum of a motion."""
        amplitude = moment.amplitude
        top = float(np.max(amplitude, initial=0.0))
        if moment.status != "completed":
            self.say("No settled motion, so no spectrum.")
            return
        if not amplitude.size:
            self.say("The torque is too slow beside the free vibration for a spectrum.")
            return
        if top == 0.0:
            self.say("No motion, so no spectrum.")
            return
        ghost = moment.ghost
        if ghost is not None:
            top = max(top, float(np.max(ghost.amplitude, initial=0.0)))
        # Whole halves of a decade, so that they seldom change.
        floor = 10.0 ** (math.floor(2.0 * math.log10(top)) / 2.0 - _DECADES)
        ceiling = 10.0 ** (math.ceil(2.0 * math.log10(1.3 * top)) / 2.0)
        _put(self._lines, moment, floor)
        _put(self._ghost, ghost, floor)
        look.span(self.figure.x_range, 0.0, float(moment.frequency[-1]))
        look.span(self.figure.y_range, floor, ceiling)
        first, second = self._marks
        first.show(moment.forcing)
        second.show(moment.natural)
        self._words.say("")

    def say(self, sentence: str) -> None:
        """Show nothing but a sentence."""
        for source in (self._lines, self._ghost):
            look.put(source, frequency=[], amplitude=[])
        for mark in self._marks:
            mark.show(0.0)
        self._words.say(sentence)


class _Mark:
    """A line at a frequency with its symbol."""

    def __init__(self, drawn: figure, symbol: str, colour: str, dash: list[int], down: int) -> None:
        self._symbol = symbol
        self._line = Span(
            dimension="height", line_color=colour, line_dash=dash, level="underlay", visible=False
        )
        self._label = Label(
            x=0.0, y=Node(target="frame", symbol="top"), x_offset=4, y_offset=-down, text="",
            text_color=colour, text_font=look.FONT, text_font_size="11px", text_baseline="top",
            background_fill_color="#FFFFFF", background_fill_alpha=0.8, visible=False,
        )  # fmt: skip
        for one in (self._line, self._label):
            drawn.add_layout(one)

    def show(self, frequency: float) -> None:
        """At a frequency [Hz]; 0: nowhere."""
        seen = frequency > 0.0
        self._line.update(location=frequency, visible=seen)
        self._label.update(x=frequency, text=f"{self._symbol} = {frequency:.4g} Hz", visible=seen)


def _put(source: ColumnDataSource, moment: Moment | None, floor: float) -> None:
    if moment is None or not moment.amplitude.size:
        look.put(source, frequency=[], amplitude=[])
        return
    amplitude = np.maximum(moment.amplitude, floor)
    places = look.thinned(np.log(amplitude))
    look.put(source, frequency=moment.frequency[places], amplitude=amplitude[places])
