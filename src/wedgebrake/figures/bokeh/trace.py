"""A measured trace and the motion of the machine on the page."""

from __future__ import annotations

import numpy as np
from bokeh.models import Line, PanTool, ResetTool, Scatter, WheelZoomTool

from wedgebrake.arrays import FloatArray
from wedgebrake.figures.bokeh import chart
from wedgebrake.figures.data.limits import extent, round_limits_about, thinned
from wedgebrake.figures.data.trace import MEASURED, MODEL, TracePicture

# Size of measured samples [px], and the most that are drawn as points.
_DOT, _MOST_DOTS = 3.0, 400


class TracePlot(chart.QuantityChart[TracePicture]):
    """One column of a trace and the values that are simulated for it, over time."""

    def __init__(self) -> None:
        wheel = WheelZoomTool(visible=False)
        drawn = chart.chart("", "time [s]", "", [PanTool(visible=False), wheel, ResetTool()])
        drawn.toolbar.active_scroll = wheel
        drawn.title.visible = False
        super().__init__(drawn)
        self._measured, self._model = self.source("time", "value"), self.source("time", "value")
        line = Line(x="time", y="value", line_color=MEASURED, line_width=4.0)
        self.draw(self._measured, line)
        self._dots = Scatter(x="time", y="value", size=_DOT, fill_color=MEASURED, line_color=None)
        self.draw(self._measured, self._dots)
        self.draw(self._model, Line(x="time", y="value", line_color=MODEL, line_width=1.3))
        self.show_overlay("Computing …")

    def show(self, picture: TracePicture) -> None:
        """Draw a trace."""
        self._picture = picture
        self._draw_quantity(picture)

    def show_message(self, sentence: str) -> None:
        """Show only a sentence."""
        super().show_message(sentence)
        self._show_axes(visible=False)

    def _draw_quantity(self, picture: TracePicture) -> None:
        name = self._quantity if self._quantity in picture.columns else next(iter(picture.columns))
        _, unit, measured, model = picture.columns[name]
        for source, values in ((self._measured, measured), (self._model, model)):
            known = np.isfinite(values)
            time, shown = picture.time[known], values[known]
            places = thinned(shown)
            columns = {"time": time[places], "value": chart.float32(shown[places])}
            chart.update_source(source, **columns)
        few = np.count_nonzero(np.isfinite(measured)) <= _MOST_DOTS
        chart.update_model(self._dots, fill_alpha=1.0 if few else 0.0)
        both = [values[np.isfinite(values)] for values in (measured, model)]
        chart.set_range(self.figure.y_range, *round_limits_about(*extent(*both)))
        chart.set_range(self.figure.x_range, *_ends(picture.time))
        # The quantity is named in the list above: both names are longer than the axis.
        self.figure.yaxis.axis_label = f"{name}  [{unit}]"
        self.show_overlay("")
        self._show_axes(visible=True)

    def _show_axes(self, *, visible: bool) -> None:
        for one in (self.figure.xaxis[0], self.figure.yaxis[0], *self.figure.grid):
            chart.update_model(one, visible=visible)


def _ends(time: FloatArray) -> tuple[float, float]:
    return float(time[0]), float(time[-1])
