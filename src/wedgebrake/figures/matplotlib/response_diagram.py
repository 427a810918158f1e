"""The response diagram: amplitudes over one parameter, with the classes of motion below."""

from __future__ import annotations

from typing import TYPE_CHECKING

from wedgebrake.figures.data import caption
from wedgebrake.figures.data.parts import with_one_part
from wedgebrake.figures.data.response_diagram import NATURAL, RESPONSE, ResponseDiagram
from wedgebrake.figures.matplotlib import style
from wedgebrake.figures.matplotlib.bands import diagram
from wedgebrake.figures.matplotlib.layout import line_options
from wedgebrake.figures.matplotlib.panels import draw_panel

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

# Heights of a panel, and of a single panel [inch].
_PANEL, _ONLY = 1.15, 2.2
_JUMPS = "Thin dotted lines: jumps, or steep changes, between neighbouring values."


def response_diagram(
    dataset: xr.Dataset,
    quantity: str = RESPONSE,
    *,
    inertia: str | None = None,
    contact: str | None = None,
    width: float = style.PAGE,
) -> Figure:
    """Amplitudes of the motion against the parameter, with classes of motion: a new figure.

    dataset  : as returned by ``wb.bifurcation`` or ``wb.sweep`` for one parameter
    quantity : "response": half the range and root mean square of the speed, peak and root mean
               square of the torque and of the jerk, and share of time at rest; or one result of the
               sweep, for example "rms_acceleration"
    inertia, contact : parts of a machine whose results are drawn; None for the first
    width    : of the figure [inch]

    With a dimension ``branch`` (``follow``), increasing and decreasing values of the parameter have
    different colours. Over the frequency of a signal, vertical lines mark the undamped natural
    frequencies of the inertias and shafts, without the contacts. The classes of motion and of
    stick-slip are shown below.

    Raises ``InputError`` for a dataset that is not a sweep over one parameter, or an unknown
    quantity.
    """
    dataset = with_one_part(dataset, inertia, contact)
    data = ResponseDiagram.of(dataset, quantity)
    count = len(data.panels)
    heights = [_ONLY if count == 1 else _PANEL] * count
    sentences = caption.sentences(dataset, [data.x.name]) + [_JUMPS] * data.has_jumps
    with diagram(data, heights, data.legends(), sentences, width) as (figure, axes):
        for one, panel in zip(axes, data.panels, strict=True):
            draw_panel(one, panel)
            for value in data.natural:
                one.axvline(value, zorder=1.5, **line_options(NATURAL))
    return figure
