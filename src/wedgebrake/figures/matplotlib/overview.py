"""Four pictures of one response on a page, with a title on machine, method and time spans."""

from __future__ import annotations

import json
import textwrap
from typing import TYPE_CHECKING

import numpy as np

from wedgebrake.analysis.spectrum import is_driven
from wedgebrake.analysis.spectrum import spectrum as spectrum_of
from wedgebrake.analysis.sticking import span, steady_start
from wedgebrake.errors import InputError
from wedgebrake.figures.data import caption
from wedgebrake.figures.data.history import last_periods
from wedgebrake.figures.matplotlib import history, phase, section, spectrum, style
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.model.validation import check_instance

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

PERIODS = 12.0
"""Torque periods in the history."""

# A vibration fades if its last fifth is smaller than this share of it.
_FADED = 0.5
# Characters in a line of the title.
_COLUMNS = 130


def overview(
    system: BrakedDriveline,
    response: xr.Dataset,
    verdict: str = "",
    *,
    start: float | None = None,
) -> Figure:
    """History, phase portrait, Poincare section and spectrum of a response: a new figure.

    system, response : the system, and its response by ``simulate``
    verdict          : a sentence for the title, for example on stability
    start            : beginning of the steady motion [s] for portrait, section and spectrum;
                       default the last fifth of the response, or all of a free vibration,
                       which no torque and no turning shaft sustains. The history then
                       shows all of it too.

    Raises ``InputError`` for a dataset that is no response or a start outside it.
    """
    check_instance("system", system, BrakedDriveline)
    free = _is_free(system, response)
    periods = None if free else PERIODS
    usual = span(response)[0] if free else steady_start(response)
    low = usual if start is None else start
    with style.use():
        figure = style.new_figure(style.PAGE, 0.75 * style.PAGE)
        grid = figure.subplots(2, 2)
        history.draw(grid[0, 0], response, periods)
        phase.draw(grid[0, 1], system, response, low)
        section.draw(grid[1, 0], response, low)
        _draw_spectrum(grid[1, 1], response, low)
        for word, axes in zip("abcd", grid.flat, strict=True):
            style.letter(axes, word)
        figure.suptitle(
            "\n".join(title(system, response, verdict, low, periods)),
            x=0.01,
            ha="left",
            linespacing=1.4,
        )
        return figure


def _is_free(system: BrakedDriveline, response: xr.Dataset) -> bool:
    """Tell a free vibration, shown from its start: nothing sustains it."""
    if is_driven(response):
        return False
    if system.driveline.drive_speed == 0.0:
        return True
    velocity = response["velocity"].to_numpy()
    late = velocity[response["time"].to_numpy() >= steady_start(response)]
    return not late.size or bool(np.ptp(late) <= _FADED * np.ptp(velocity))


def _draw_spectrum(axes: Axes, response: xr.Dataset, low: float) -> None:
    """Draw the spectrum of the steady motion, or state why there is none.

    The initial transient would appear as a broad floor between the lines.
    """
    try:
        lines = spectrum_of(response, start=low)
    except InputError:
        style.say(
            axes, "no spectrum: fewer than two samples in\nthis time span, or not equally spaced"
        )
        return
    spectrum.draw(axes, lines)


def title(
    system: BrakedDriveline,
    response: xr.Dataset,
    verdict: str,
    low: float,
    periods: float | None = PERIODS,
) -> list[str]:
    """Lines of the title: machine and groups; method and time spans; an early end; verdict."""
    begin, end = span(response)
    seen, _ = last_periods(response, periods)
    when = [style.moment(time, end - begin) for time in (begin, end, seen, low)]
    options = json.loads(response.attrs.get("options", "{}"))
    how = caption.method_words(str(response.attrs.get("method", "")))
    if "rtol" in options:
        how += f" (rtol {options['rtol']:g})"
    if "step" in options:
        how += f" (step {options['step']:g} s)"
    initial = ", ".join(f"{value:g}" for value in options.get("initial", []))
    protocol = f"{how}, {when[0]} to {when[1]} s from ({initial});"
    if seen == low == begin:
        protocol += " a to d: all of it"
    else:
        protocol += f" a: from {when[2]} s; b, c, d: from {when[3]} s"
    groups = caption.equations(system.groups.as_dict())
    machine = f"{caption.machine(system.as_dict())}:  {groups}"
    lines = [machine, protocol]
    if response.attrs.get("status", "completed") != "completed":
        lines.append(str(response.attrs.get("message", response.attrs["status"])))
    if verdict:
        lines.append(verdict)
    # Formulas are shorter than their source.
    rows = [[line] if line == machine else textwrap.wrap(line, _COLUMNS) for line in lines]
    return [row for wrapped in rows for row in wrapped]
