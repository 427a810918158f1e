"""Picture of the temperature of a disc."""

from __future__ import annotations

from typing import TYPE_CHECKING

from wedgebrake.figures.data.panels import Panel, lines_of
from wedgebrake.figures.matplotlib import style
from wedgebrake.figures.matplotlib.layout import captioned
from wedgebrake.figures.matplotlib.panels import draw_panel

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

_ROW = 1.3  # height of a panel [inch]
_PANELS = (
    ("temperature", "temperature\nrise  [K]"),
    ("power", "heat flow\n[W]"),
    ("heat", "heat\n[J]"),
)


def temperature(dataset: xr.Dataset, *, width: float = style.COLUMN) -> Figure:
    """Temperature rise of a disc, heat flow and heat over time: a new figure.

    dataset : as returned by ``wb.temperature``
    width   : of the figure [inch]
    """
    time = dataset["time"].to_numpy()
    peak, at = float(dataset["peak_temperature"]), float(dataset["peak_time"])
    share = f"{100.0 * dataset.attrs['share']:.4g} %"
    sentences = [
        f"{dataset.attrs['disc']}, {share} of the heat of {dataset.attrs['contact']}.",
        f"Highest temperature rise {peak:.5g} K at {at:.5g} s.",
    ]
    with captioned(width, len(_PANELS) * _ROW, sentences) as figure:
        rows = figure.subplots(len(_PANELS), 1, sharex=True)
        for axes, (name, label) in zip(rows, _PANELS, strict=True):
            lines = lines_of([""], time, [dataset[name].to_numpy()])
            draw_panel(axes, Panel(label, lines, zero=True, legend=False))
        rows[-1].set_xlabel("time $t$  [s]")
        figure.align_ylabels(rows)
    return figure
