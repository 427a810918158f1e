"""Dynamic responses, one row per case: phase portrait, velocity, Poincaré map, spectrum."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wedgebrake.analysis.responses.spectrum import frequencies, spectrum
from wedgebrake.figures.data.limits import extent
from wedgebrake.figures.data.motion import History, SpectrumLines
from wedgebrake.figures.matplotlib import style
from wedgebrake.model.paper_machines import DURATION, RESPONSES, Rows
from wedgebrake.paper.figures import layout
from wedgebrake.paper.laboratory import STEADY, Laboratory, SteadyRun
from wedgebrake.paper.signal_features import visible_sticks

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Periods of velocity shown, spectra up to so many times f_n, decades below the highest line.
_PERIODS = 8
_HIGHEST, _DECADES = 4.0, 5.0
# An amplitude of zero on a logarithmic axis.
_NOTHING = 1e-300
# A panel shows at least this share of the motion: the scatter of rounding is no motion.
_LEAST = 0.1
# Speed [rad/s] from which the scale of a motion that grows without bound is logarithmic.
_LINEAR = 1.0
# A portrait smaller than this share of its panel is a point.
_POINT = 0.02

_EXACT = style.ORANGE
_EXACT_TEXT = "#8A5F00"
"""The same orange, dark enough to be read."""
_HEIGHT = 1.02


@dataclass(frozen=True, eq=False)
class _Run:
    response: xr.Dataset
    steady: SteadyRun

    def tail(self, length: float = DURATION - STEADY) -> History:
        """Last ``length`` seconds of the run."""
        times = self.response["time"].to_numpy()
        end = float(times[-1]) if times.size else 0.0
        return History.between(self.response, end - length - 1e-9, end)


def rows_of(number: int) -> tuple[Rows, bool]:
    """Rows of a figure, and whether it has a Poincaré map.

    Figure 6 repeats its first case with the F_0 at which it does not stick.
    """
    rows = RESPONSES[number]
    if number == 6:
        first, *others = rows.cases
        rows = Rows((first, first.at(F0=0.036), *others), rows.varied)
    return rows, number not in (6, 7)


def draw(number: int, laboratory: Laboratory) -> Figure:
    """Draw a figure: the laboratory's method in blue, over the exact solution in orange."""
    rows, section = rows_of(number)
    first, laboratories = rows.cases[0], layout.compared(laboratory)
    runs = [
        list(map(_Run, one.responses(rows.cases), one.steadies(rows.cases))) for one in laboratories
    ]
    about = f"{first.brake.capitalize()} brake: {layout.fixed(number, first, rows.varied)}"
    points = f" Poincaré map: {layout.SECTION}." if section else ""
    figure, panels = layout.sheet(
        [
            f"Figure {number}. {about}.",
            layout.assumptions(laboratory.assumptions),
            (
                f"{layout.both(laboratories)} {DURATION:g} s from rest. Portrait: last"
                f" {DURATION - STEADY:g} s. Velocity: last {_PERIODS} periods; above: class of"
                f" stick-slip.{points} Spectrum: all {DURATION:g} s (Hann); dashed $f_e$,"
                " dotted $f_n$."
            ),
        ],
        [_HEIGHT] * len(rows.cases),
        (1.0, 1.75, 0.9, 1.25) if section else (1.0, 2.0, 1.3),
        left=0.72,
    )
    theta, speed = r"$\theta$  [rad]", r"$\dot\theta$  [rad/s]"
    columns = [
        (_portrait, "phase portrait: " + speed, theta),
        (_velocity, "velocity " + speed, "periods of the torque before the end"),
        (_section, "Poincaré map: " + speed, r"$\theta_n$  [rad]"),
        (_spectrum, "amplitude of " + speed, "frequency $f/f_n$  [1]"),
    ]
    if not section:
        columns.pop(2)
    for case, line, *of_case in zip(rows.cases, panels, *runs, strict=True):
        layout.row_label(line[0], layout.row(case, rows.varied))
        for axes, (draw_panel, _, _) in zip(line, columns, strict=True):
            draw_panel(axes, of_case)
            if draw_panel in (_velocity, _spectrum) and line is not panels[-1]:
                axes.tick_params(axis="x", labelbottom=False)
    for top, bottom, (_, above, below) in zip(panels[0], panels[-1], columns, strict=True):
        layout.head(top, above, raised=10.0)
        bottom.set_xlabel(below, labelpad=1.5)
    return figure


def _pens(runs: list[_Run], thick: float, thin: float) -> list[tuple[_Run, dict[str, Any]]]:
    """Pen of each run: the exact solution below, wider."""
    pens = [{"color": style.MOTION, "linewidth": thin, "zorder": 3}]
    pens.append({"color": _EXACT, "linewidth": thick, "zorder": 2})
    return list(zip(runs, pens, strict=False))[::-1]


def _deciding(runs: list[_Run]) -> list[_Run]:
    """Runs that set the limits: all, unless some ended early."""
    return runs if all(run.steady.completed for run in runs) else runs[:1]


def _limits(arrays: list[NDArray[np.float64]], least: float = 0.0) -> tuple[float, float]:
    if not any(one.size for one in arrays):
        return -1.0, 1.0
    return style.margins(*extent(*arrays), least)


def _portrait(axes: Axes, runs: list[_Run]) -> None:
    layout.zero_lines(axes)
    tails = [run.tail() for run in _deciding(runs)]
    axes.set_xlim(*_limits([tail.angle for tail in tails]))
    axes.set_ylim(*_limits([tail.velocity for tail in tails]))
    smallest = _POINT * np.ptp(axes.get_xlim())
    for (run, pen), (_, dot) in zip(_pens(runs, 1.0, 0.4), _pens(runs, 2.6, 2.0), strict=True):
        tail = run.tail()
        axes.plot(tail.angle, tail.velocity, **pen)
        if tail.angle.size and np.ptp(tail.angle) < smallest:
            # A rest is a point, of which a line would show nothing.
            size = dot.pop("linewidth")
            axes.plot(tail.angle[-1], tail.velocity[-1], marker="o", markersize=size, **dot)
    layout.ticks(axes, 2, 5)


def _velocity(axes: Axes, runs: list[_Run]) -> None:
    """Velocity in time, counted in periods of the torque before the end of the run."""
    forcing = frequencies(runs[0].response)["forcing_frequency"]
    window, end = _PERIODS / forcing, runs[0].steady.end
    layout.zero_lines(axes)
    for run, pen in _pens(runs, 1.3, 0.6):
        tail = run.tail(window + run.steady.end - end)
        axes.plot((tail.time - end) * forcing, tail.velocity, **pen)
    limits = _limits([run.tail(window).velocity for run in _deciding(runs)])
    axes.set_ylim(*limits)
    if not runs[0].steady.completed:
        style.logarithmic_beyond(axes, _LINEAR, limits)
    axes.set_xlim(-_PERIODS, 0.0)
    layout.ticks(axes, _PERIODS // 2, 5)
    notes = (("left", style.MOTION), ("right", _EXACT_TEXT))
    for run, (side, colour) in zip(runs, notes, strict=False):
        word = f"{run.steady.status.replace('_', ' ')} at {run.steady.end:.3g} s"
        if run.steady.completed:
            word = visible_sticks(run.response).kind.removesuffix(" stick-slip")
        layout.note(axes, word, side, colour)


def _section(axes: Axes, runs: list[_Run]) -> None:
    done = [run for run in runs if run.steady.completed]
    if not done:
        style.show_message(axes, "no steady\nmotion")
        return
    for run, pen in _pens(runs, 2.6, 1.4):
        size = pen.pop("linewidth")
        style.plot_points(axes, run.steady.angle, run.steady.velocity, size, **pen)
    tails = [run.tail() for run in done]
    for set_limits, name in ((axes.set_xlim, "angle"), (axes.set_ylim, "velocity")):
        low, high = extent(*(getattr(tail, name) for tail in tails))
        set_limits(_limits([getattr(run.steady, name) for run in done], _LEAST * (high - low)))
    layout.ticks(axes, 2, 5)


def _spectrum(axes: Axes, runs: list[_Run]) -> None:
    from matplotlib.ticker import FixedLocator, NullLocator

    known = frequencies(runs[0].response)
    natural, top = known["natural_frequency"], 0.0
    for run, pen in _pens(runs, 0.9, 0.5):
        if run.response.sizes["time"] < 2:
            continue
        lines = spectrum(run.response)
        shown = SpectrumLines.of(lines, _HIGHEST * natural)
        axes.plot(shown.frequency / natural, np.maximum(shown.amplitude, _NOTHING), **pen)
        if run in _deciding(runs):
            top = max(top, float(np.max(lines["amplitude"])))
    if top == 0.0:
        style.show_message(axes, "no motion")
        return
    axes.set_yscale("log")
    forcing = known["forcing_frequency"] / natural
    for value, dashes in ((forcing, (0, (4, 2))), (1.0, (0, (1, 1.5)))):
        axes.axvline(value, color=style.GREY, linewidth=0.6, linestyle=dashes, zorder=1)
    axes.set_xlim(0.0, _HIGHEST)
    axes.set_ylim(top * 10.0**-_DECADES, 3.0 * top)
    decade = math.floor(math.log10(top))
    axes.yaxis.set_major_locator(FixedLocator([10.0 ** (decade - n) for n in (4, 2, 0)]))
    axes.yaxis.set_minor_locator(NullLocator())
    axes.set_xticks(range(round(_HIGHEST) + 1))
