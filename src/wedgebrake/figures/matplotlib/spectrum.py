"""The amplitude spectrum, with the forcing and the natural frequency marked."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from wedgebrake.errors import InputError
from wedgebrake.figures.data import caption
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
    """The same on axes of your own."""
    if "amplitude" not in getattr(lines, "data_vars", {}):
        raise InputError(
            f"lines = {type(lines).__name__}: must be the result of wb.spectrum(response)."
        )
    forcing = lines.attrs.get("forcing_frequency", 0.0)
    natural = lines.attrs.get("natural_frequency", 0.0)
    frequency = lines["frequency"].to_numpy()
    if largest is None:
        largest = 4.0 * max(forcing, natural) or float(frequency[-1])
    shown = frequency <= largest * (1.0 + 1e-12)
    amplitude = lines["amplitude"].to_numpy()[shown]
    unit = 1.0 if hertz or natural == 0.0 else natural
    quantity = lines.attrs.get("quantity", "velocity")
    axes.set_xlabel("frequency $f$  [Hz]" if unit == 1.0 else "frequency $f/f_n$  [1]")
    axes.set_ylabel(f"amplitude of {style.short(quantity)}  [{lines['amplitude'].units}]")
    top = float(np.max(amplitude, initial=0.0))
    if top == 0.0:
        style.say(axes, "no motion in this time span")
        return
    floor = top * 10.0**-_DECADES
    axes.set_yscale("log")
    axes.set_xlim(0.0, largest / unit)
    low = max(floor, float(np.min(amplitude[amplitude > 0.0])))
    axes.set_ylim(0.5 * min(low, 0.1 * top), 3.0 * top)
    axes.plot(
        frequency[shown] / unit,
        np.maximum(amplitude, 1e-3 * floor),
        color=style.MOTION,
        linewidth=0.7,
        zorder=3,
        rasterized=amplitude.size > style.RASTER_FROM,
    )
    style.few_ticks(axes)
    style.legend_above(axes, _mark(axes, forcing, natural, unit))


def _mark(axes: Axes, forcing: float, natural: float, unit: float) -> list[Any]:
    """Lines at the forcing and the natural frequency, behind the spectrum."""
    handles: list[Any] = []
    for value, symbol, colour, dashes in (
        (forcing, "f_e", style.FORCING, (0, (5, 2))),
        (natural, "f_n", style.NATURAL, (0, (1, 1.2))),
    ):
        if value > 0.0:
            handles.append(
                axes.axvline(
                    value / unit,
                    color=colour,
                    linewidth=0.9,
                    linestyle=dashes,
                    zorder=2,
                    label=f"${symbol} = {style.number(value)}$ Hz",
                )
            )
    return handles
