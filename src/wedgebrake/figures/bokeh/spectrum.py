"""The amplitude spectrum of the velocity."""

from __future__ import annotations

import math

import numpy as np
from bokeh.models import ColumnDataSource, HoverTool, Label, Line, Node, Range1d, Span

from wedgebrake.figures.bokeh import chart
from wedgebrake.figures.data.limits import thinned
from wedgebrake.figures.data.motion import MotionFigures
from wedgebrake.figures.data.spectrum import Mark, Spectrum

# Decades below the largest line that are shown.
_DECADES = 5.0
_SUBSCRIPTS = {"e": "f\u2091", "n": "f\u2099"}


class SpectrumChart(chart.Chart):
    """Amplitude of the velocity [rad/s], logarithmic, over frequency [Hz]."""

    def __init__(self) -> None:
        super().__init__(
            chart.chart(
                "Spectrum", "frequency [Hz]", "amplitude [rad/s]",
                y_axis_type="log", y_range=Range1d(1e-5, 1.0),
                tools="xbox_zoom,xpan,reset", active_drag="xbox_zoom",
            )
        )  # fmt: skip
        self._lines, self._ghost = (self.source("frequency", "amplitude") for _ in range(2))
        self._marks = [_MarkLine(self, down) for down in (3, 16)]
        places = {"x": "frequency", "y": "amplitude"}
        self.figure.add_glyph(self._ghost, Line(**places, line_color=chart.GHOST))
        line = self.figure.add_glyph(
            self._lines, Line(**places, line_color=chart.MOTION, line_width=1.2)
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

    def show(self, motion: MotionFigures, ghost: MotionFigures | None = None) -> None:
        """Show the spectrum of a motion, and that of another one behind it."""
        data = motion.spectrum
        if not motion.completed:
            self.say("No steady motion, hence no spectrum.")
            return
        if not data.amplitude.size:
            self.say("No spectrum: the torque is too slow compared with the free vibration.")
            return
        if data.top == 0.0:
            self.say("No motion, hence no spectrum.")
            return
        top = max(data.top, ghost.spectrum.top) if ghost is not None else data.top
        # Whole halves of a decade, so that they seldom change.
        floor = 10.0 ** (math.floor(2.0 * math.log10(top)) / 2.0 - _DECADES)
        ceiling = 10.0 ** (math.ceil(2.0 * math.log10(1.3 * top)) / 2.0)
        _update(self._lines, data, floor)
        _update(self._ghost, ghost.spectrum if ghost is not None else None, floor)
        chart.set_range(self.figure.x_range, 0.0, float(data.frequency[-1]))
        chart.set_range(self.figure.y_range, floor, ceiling)
        for line, mark in zip(self._marks, data.marks, strict=True):
            line.show(mark)
        self._overlay.say("")

    def say(self, sentence: str) -> None:
        """Show nothing but a sentence."""
        super().say(sentence)
        for line in self._marks:
            line.hide()


class _MarkLine:
    """A line at a frequency with its symbol, a distance below the top [pixels]."""

    def __init__(self, spectrum: chart.Chart, down: int) -> None:
        self._line = Span(dimension="height", level="underlay", visible=False)
        self._label = Label(
            x=0.0, y=Node(target="frame", symbol="top"), x_offset=4, y_offset=-down, text="",
            text_font=chart.FONT, text_font_size="11px", text_baseline="top",
            background_fill_color="#FFFFFF", background_fill_alpha=0.8, visible=False,
        )  # fmt: skip
        for one in (self._line, self._label):
            spectrum.figure.add_layout(one)

    def show(self, mark: Mark) -> None:
        """Show a mark, if there is that frequency."""
        seen = mark.frequency > 0.0
        text = f"{_SUBSCRIPTS[mark.subscript]} = {mark.frequency:.4g} Hz"
        dash = [math.ceil(one) for one in mark.dashes]
        self._line.update(
            location=mark.frequency, visible=seen, line_color=mark.colour, line_dash=dash
        )
        self._label.update(x=mark.frequency, text=text, visible=seen, text_color=mark.colour)

    def hide(self) -> None:
        """Show nothing."""
        self._line.visible = self._label.visible = False


def _update(source: ColumnDataSource, data: Spectrum | None, floor: float) -> None:
    """Show lines down to the floor of the picture."""
    if data is None or not data.amplitude.size:
        chart.clear_source(source)
        return
    amplitude = np.maximum(data.amplitude, floor)
    places = thinned(np.log(amplitude))
    chart.update_source(source, frequency=data.frequency[places], amplitude=amplitude[places])
