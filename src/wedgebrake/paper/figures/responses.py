"""Dynamic responses, a row a case: phase portrait, velocity, Poincare map, spectrum."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wedgebrake.analysis.spectrum import frequencies, spectrum
from wedgebrake.figures.matplotlib import style
from wedgebrake.paper.assumptions import CONVENTIONAL, Case
from wedgebrake.paper.diagrams import FREQUENCIES, PLANS
from wedgebrake.paper.figures import layout, words
from wedgebrake.paper.laboratory import DURATION, STEADY, Laboratory, Steady
from wedgebrake.paper.parameters import KINETIC
from wedgebrake.paper.signal_features import rests

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

FloatArray = NDArray[np.float64]

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
_EXACT_WORDS = "#8A5F00"
"""The same orange, dark enough to be read."""
_HEIGHT = 1.02


@dataclass(frozen=True)
class Rows:
    """A figure of responses.

    cases   : one a row
    varied  : the groups that differ between them
    section : whether there is a Poincare map
    """

    cases: tuple[Case, ...]
    varied: tuple[str, ...]
    section: bool = True

    def conventional(self) -> Rows:
        """The same with the conventional brake."""
        cases = tuple(case.at(brake=CONVENTIONAL) for case in self.cases)
        return Rows(cases, self.varied, self.section)


STICK_SLIP = Rows(
    (
        Case(eta=0.0, F0=0.12),
        Case(eta=0.0, F0=0.036),
        Case(eta=0.0, F0=0.09),
        Case(eta=0.0, f=1.89, F0=0.114),
    ),
    ("f", "F0"),
    section=False,
)
"""Figure 6 as printed; its second row is the first with the F_0 at which it does not stick."""
NO_STICK = Rows(
    (STICK_SLIP.cases[0], *STICK_SLIP.cases[2:]), ("f", "F0"), section=False
).conventional()
SLOPES = Rows(tuple(Case(eta=eta) for eta in (-6.0, -24.0, -30.0, -60.0)), ("eta",))
FORCES = Rows(tuple(Case(F0=F0) for F0 in (0.015, 0.024, 0.031, 0.042, 0.067, 0.120)), ("F0",))
OVER_F = Rows(tuple(PLANS["14a"].base.at(f=f) for f in FREQUENCIES), ("f",))
ANGLES = Rows(
    tuple(PLANS["17"].base.at(alpha=math.tan(angle) / KINETIC) for angle in (0.2, 1.0)), ("alpha",)
)


@dataclass(frozen=True, eq=False)
class _Run:
    """One case by one method."""

    response: xr.Dataset
    steady: Steady

    @property
    def completed(self) -> bool:
        """The run reached its end."""
        return self.steady.completed

    @property
    def word(self) -> str:
        """The class of stick-slip, or how the run ended."""
        if self.completed:
            return rests(self.response).word.removesuffix(" stick-slip")
        return f"{self.steady.status.replace('_', ' ')} at {self.steady.end:.3g} s"

    def tail(self, length: float) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Time, angle and velocity of the last ``length`` seconds of the run."""
        times = self.response["time"].to_numpy()
        first = int(np.searchsorted(times, times[-1] - length - 1e-9)) if times.size else 0
        angle, velocity = (self.response[name].to_numpy() for name in ("angle", "velocity"))
        return times[first:], angle[first:], velocity[first:]


def draw(rows: Rows, number: int, laboratory: Laboratory) -> Figure:
    """The figure: the laboratory's method in blue, over the exact solution in orange."""
    laboratories = words.compared(laboratory)
    runs = [
        [
            _Run(*pair)
            for pair in zip(one.responses(rows.cases), one.steadies(rows.cases), strict=True)
        ]
        for one in laboratories
    ]
    first, fixed = rows.cases[0], words.others(*rows.varied)
    figure, panels = layout.sheet(
        [
            (
                f"Figure {number}. {words.brake(first)}: {words.groups(first, fixed)}"
                f"{words.printed(number, first)}."
            ),
            words.assumptions(laboratory.assumptions),
            f"{words.both(laboratories)} {_protocol(rows)}",
        ],
        [_HEIGHT] * len(rows.cases),
        (1.0, 1.75, 0.9, 1.25) if rows.section else (1.0, 2.0, 1.3),
        left=0.72,
    )
    shared = {_velocity, _spectrum}
    drawers = [_portrait, _velocity, *([_section] if rows.section else []), _spectrum]
    for place, (case, line) in enumerate(zip(rows.cases, panels, strict=True)):
        of_case = [column[place] for column in runs]
        layout.row_label(line[0], words.row(case, rows.varied))
        for axes, drawer in zip(line, drawers, strict=True):
            drawer(axes, of_case)
            if drawer in shared and line is not panels[-1]:
                layout.bare(axes)
    _label(panels, rows)
    return figure


def _protocol(rows: Rows) -> str:
    """What of a run is shown where."""
    section = f" Poincaré map: {words.SECTION}." if rows.section else ""
    return (
        f"{DURATION:g} s from rest. Portrait: last {DURATION - STEADY:g} s."
        f" Velocity: last {_PERIODS} periods; above: class of stick-slip.{section}"
        f" Spectrum: all {DURATION:g} s (Hann); dashed $f_e$, dotted $f_n$."
    )


def _label(panels: list[list[Axes]], rows: Rows) -> None:
    """What the columns show, above and below them."""
    theta, speed = r"$\theta$  [rad]", r"$\dot\theta$  [rad/s]"
    heads = [
        ("phase portrait: " + speed, theta),
        ("velocity " + speed, "periods of the torque before the end"),
        ("Poincaré map: " + speed, r"$\theta_n$  [rad]"),
        ("amplitude of " + speed, "frequency $f/f_n$  [1]"),
    ]
    if not rows.section:
        heads.pop(2)
    for top, bottom, (above, below) in zip(panels[0], panels[-1], heads, strict=True):
        layout.head(top, above, raised=10.0)
        bottom.set_xlabel(below, labelpad=1.5)


def _pens(runs: list[_Run], thick: float, thin: float) -> list[tuple[_Run, dict[str, Any]]]:
    """How each run is drawn: the exact solution below, wider."""
    pens = [{"color": style.MOTION, "linewidth": thin, "zorder": 3}]
    pens.append({"color": _EXACT, "linewidth": thick, "zorder": 2})
    return list(zip(runs, pens, strict=False))[::-1]


def _limit(runs: list[_Run]) -> list[_Run]:
    """The runs that set the limits: all, unless some grew without bound."""
    return runs if all(run.completed for run in runs) else runs[:1]


def _span(arrays: list[FloatArray], least: float = 0.0) -> tuple[float, float]:
    found = np.concatenate(arrays)
    if not found.size:
        return -1.0, 1.0
    return style.margins(float(np.min(found)), float(np.max(found)), least)


def _portrait(axes: Axes, runs: list[_Run]) -> None:
    """Velocity over angle."""
    axes.axhline(0.0, color=style.GREY, linewidth=0.4, zorder=1)
    for run, pen in _pens(runs, 1.0, 0.4):
        _, angle, velocity = run.tail(DURATION - STEADY)
        axes.plot(angle, velocity, **pen)
    tails = [run.tail(DURATION - STEADY) for run in _limit(runs)]
    axes.set_xlim(*_span([tail[1] for tail in tails]))
    axes.set_ylim(*_span([tail[2] for tail in tails]))
    for run, pen in _pens(runs, 2.6, 2.0):
        _, angle, velocity = run.tail(DURATION - STEADY)
        if angle.size and np.ptp(angle) < _POINT * np.ptp(axes.get_xlim()):
            # A rest is a point, of which a line would show nothing.
            size = pen.pop("linewidth")
            axes.plot(angle[-1], velocity[-1], marker="o", markersize=size, **pen)
    layout.ticks(axes, 2, 5)


def _velocity(axes: Axes, runs: list[_Run]) -> None:
    """Velocity in time, counted in periods of the torque before the end of the run."""
    forcing = frequencies(runs[0].response)["forcing_frequency"]
    window = _PERIODS / forcing
    end = runs[0].steady.end
    axes.axhline(0.0, color=style.GREY, linewidth=0.4, zorder=1)
    for run, pen in _pens(runs, 1.3, 0.6):
        times, _, velocity = run.tail(window + run.steady.end - end)
        axes.plot((times - end) * forcing, velocity, **pen)
    limits = _span([run.tail(window)[2] for run in _limit(runs)])
    axes.set_ylim(*limits)
    if not runs[0].completed:
        layout.stretch(axes, limits, _LINEAR)
    axes.set_xlim(-_PERIODS, 0.0)
    layout.ticks(axes, _PERIODS // 2, 5)
    for run, side, colour in zip(
        runs, ("left", "right"), (style.MOTION, _EXACT_WORDS), strict=False
    ):
        layout.note(axes, run.word, side, colour)


def _section(axes: Axes, runs: list[_Run]) -> None:
    """The state once a period."""
    done = [run for run in runs if run.completed]
    if not done:
        style.say(axes, "no steady\nmotion")
        return
    for run, pen in _pens(runs, 2.6, 1.4):
        axes.plot(
            run.steady.angle,
            run.steady.velocity,
            linestyle="none",
            marker="o",
            markersize=pen.pop("linewidth"),
            markeredgewidth=0.0,
            **pen,
        )
    tails = [run.tail(DURATION - STEADY) for run in done]
    for limit, values, place in (
        (axes.set_xlim, [run.steady.angle for run in done], 1),
        (axes.set_ylim, [run.steady.velocity for run in done], 2),
    ):
        limit(_span(values, _LEAST * float(np.ptp(np.concatenate([t[place] for t in tails])))))
    layout.ticks(axes, 2, 5)


def _spectrum(axes: Axes, runs: list[_Run]) -> None:
    """Amplitude of the velocity over the frequency."""
    from matplotlib.ticker import FixedLocator, NullLocator

    known = frequencies(runs[0].response)
    natural, top = known["natural_frequency"], 0.0
    for run, pen in _pens(runs, 0.9, 0.5):
        if run.response.sizes["time"] < 2:
            continue
        lines = spectrum(run.response)
        frequency, amplitude = lines["frequency"].to_numpy(), lines["amplitude"].to_numpy()
        shown = frequency <= _HIGHEST * natural
        axes.plot(frequency[shown] / natural, np.maximum(amplitude[shown], _NOTHING), **pen)
        if run in _limit(runs):
            top = max(top, float(np.max(amplitude)))
    if top == 0.0:
        style.say(axes, "no motion")
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
