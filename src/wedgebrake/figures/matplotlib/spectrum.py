"""The amplitude spectrum, with the forcing and the natural frequency marked."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from wedgebrake.figures.data import caption
from wedgebrake.figures.data.spectrum import Spectrum
from wedgebrake.figures.matplotlib import style
from wedgebrake.figures.matplotlib.layout import write_caption

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_DECADES = 7.0


def spectrum(lines: xr.Dataset, largest: float | None = None, *, hertz: bool = False) -> Figure:
    """Amplitude against frequency, logarithmic: a new figure.

    lines   : what ``wb.spectrum`` gives
    largest : highest frequency shown [Hz]; default 4 times the larger of f_e and f_n
    hertz   : frequencies in Hz instead of f/f_n (also where there is no natural frequency)

    f_e is marked where a torque acts, f_n where there is stiffness.

    Raises ``InputError`` for a dataset that is no spectrum.
    """
    with style.use():
        figure = style.new_figure()
        draw(figure.add_subplot(), lines, largest, hertz=hertz)
        write_caption(figure, caption.of_response(lines))
        return figure


def draw(
    axes: Axes, lines: xr.Dataset, largest: float | None = None, *, hertz: bool = False
) -> None:
    """Draw the same on existing axes."""
    data = Spectrum.of(lines, largest)
    unit = 1.0 if hertz or data.natural == 0.0 else data.natural
    axes.set_xlabel("frequency $f$  [Hz]" if unit == 1.0 else "frequency $f/f_n$  [1]")
    axes.set_ylabel(f"amplitude of {style.short(data.quantity)}  [{data.unit}]")
    if data.top == 0.0:
        style.say(axes, "no motion in this time span")
        return
    floor = data.top * 10.0**-_DECADES
    low = max(floor, float(np.min(data.amplitude[data.amplitude > 0.0])))
    axes.set_yscale("log")
    axes.set_xlim(0.0, data.highest / unit)
    axes.set_ylim(0.5 * min(low, 0.1 * data.top), 3.0 * data.top)
    amplitude = np.maximum(data.amplitude, 1e-3 * floor)
    style.plot_line(
        axes, data.frequency / unit, amplitude, color=style.MOTION, linewidth=0.7, zorder=3
    )
    style.few_ticks(axes)
    handles = [
        axes.axvline(
            mark.frequency / unit,
            color=mark.colour,
            linewidth=0.9,
            linestyle=(0, mark.dashes),
            zorder=2,
            label=f"$f_{mark.subscript} = {style.number(mark.frequency)}$ Hz",
        )
        for mark in data.marks
        if mark.frequency > 0.0
    ]
    style.legend_above(axes, handles)
