"""Amplitude curves over a parameter: stable and unstable orbits, sticks and folds."""

from __future__ import annotations

import numpy as np
from bokeh.models import MultiLine, Scatter
from numpy.typing import NDArray

from wedgebrake.arrays import FloatArray
from wedgebrake.figures import style
from wedgebrake.figures.bokeh import canvas, chart
from wedgebrake.figures.data.axes import ParameterAxis
from wedgebrake.figures.data.limits import extent
from wedgebrake.figures.data.orbit_branches import BranchLine
from wedgebrake.figures.data.partial import MEASURES, PartialCurve
from wedgebrake.figures.data.response_curve import is_wide

# Widths of lines and of the shading of sticks, sizes of folds and of what the pointer finds [px].
_STABLE, _UNSTABLE, _BAND, _FOLD, _FOUND = 1.8, 1.3, 8.0, 6.0, 7.0
_DASHES = [6, 3]


class CurvePlot(canvas.Canvas, chart.QuantityChart[PartialCurve]):
    """A curve for each level: solid where stable, dashed where unstable, pale where it sticks."""

    def __init__(self) -> None:
        super().__init__(labelled=True)
        self.scale_axis(1)
        self._quantity = "angle_amplitude"
        lines = ("xs", "ys", "colour")
        self._sticks, self._unstable, self._stable = (self.source(*lines) for _ in range(3))
        self._folds, self._points = self.source("x", "y"), self.source("x", "y", "text")
        looks = (
            (self._sticks, {"line_width": _BAND, "line_alpha": 0.25}),
            (self._unstable, {"line_width": _UNSTABLE, "line_dash": _DASHES}),
            (self._stable, {"line_width": _STABLE}),
        )
        for source, look in looks:
            self.draw(source, MultiLine(xs="xs", ys="ys", line_color="colour", **look))
        fold = Scatter(
            x="x", y="y", marker="square", size=_FOLD, fill_color=chart.INK, line_color="#FFFFFF"
        )
        self.draw(self._folds, fold)
        found = Scatter(x="x", y="y", size=_FOUND, fill_alpha=0.0, line_alpha=0.0)
        self.hover(self.draw(self._points, found), "mouse")

    def show(self, picture: PartialCurve) -> None:
        """Draw the levels that have been computed."""
        self._picture = picture
        self.set_axes(picture.axes)
        self._draw_quantity(picture)

    def _draw_quantity(self, picture: PartialCurve) -> None:
        across, panels = picture.axes[0], []
        for place, level in enumerate(picture.done):
            if self._quantity in level:
                (panel,) = level[self._quantity].panels
                panels.append((place, panel))
        curves = [(place, one) for place, panel in panels for one in panel.curves]
        sticks = [(place, one) for place, panel in panels for one in panel.sticks]
        heights = _joined([one.y for _, one in curves])
        log = is_wide(self._quantity, heights)
        for source, chosen in (
            (self._sticks, sticks),
            (self._unstable, [one for one in curves if not one[1].stable]),
            (self._stable, [one for one in curves if one[1].stable]),
        ):
            chart.update_source(
                source,
                xs=[_positions(one.x, log=across.log) for _, one in chosen],
                ys=[_positions(one.y, log=log) for _, one in chosen],
                colour=[picture.colour(place) for place, _ in chosen],
            )
        folds = np.concatenate([np.empty((0, 2)), *(panel.folds for _, panel in panels)])
        chart.update_source(
            self._folds,
            x=_positions(folds[:, 0], log=across.log),
            y=_positions(folds[:, 1], log=log),
        )
        chart.update_source(
            self._points,
            x=_positions(_joined([one.x for _, one in curves]), log=across.log),
            y=_positions(heights, log=log),
            text=[words for _, one in curves for words in self._texts(across, one)],
        )
        limits = [panel.ylim for _, panel in panels] or [(0.0, 1.0)]
        if log:
            limits = [style.margins(*extent(np.log10(heights)), 0.0, share=0.04)]
        low, high = min(one[0] for one in limits), max(one[1] for one in limits)
        chart.set_range(self.figure.y_range, low, high)
        self.set_log(1, log)
        self.figure.yaxis.axis_label = MEASURES[self._quantity]
        missing = "" if curves else "These orbits do not have this measure. Select another one."
        self.show_overlay(missing if any(picture.done) else "Computing …")

    def _texts(self, across: ParameterAxis, curve: BranchLine) -> list[str]:
        """Texts at the pointer."""
        name, _, unit = MEASURES[self._quantity].rstrip("]").partition("  [")
        end = f"{'' if unit == '1' else f' {unit}'}, {'stable' if curve.stable else 'unstable'}"
        return [
            f"{across.text(across.position(at))}: {name} {style.number(value)}{end}"
            for at, value in zip(curve.x.tolist(), curve.y.tolist(), strict=True)
        ]


def _positions(values: FloatArray, *, log: bool) -> NDArray[np.float32]:
    return chart.float32(np.log10(values) if log else values)


def _joined(arrays: list[FloatArray]) -> FloatArray:
    return np.concatenate([np.empty(0), *arrays])
