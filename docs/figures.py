"""The figures of these pages, computed and drawn: ``python docs/figures.py``, or some by name."""

from __future__ import annotations

import contextlib
import re
import sys
from functools import partial
from pathlib import Path

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import wedgebrake as wb
from wedgebrake.figures.matplotlib import style
from wedgebrake.figures.matplotlib.figure import new_figure
from wedgebrake.figures.matplotlib.save import save

FIGURES = Path(__file__).parent / "figures"
# The brake of the README, and one of its stick-slip orbits.
SYSTEM = wb.paper.system(eta=-24, F0=0.036)
# Where a slip begins inside a rest of the 2T stick-slip orbit: found by wb.continuation below.
BEFORE, AFTER = -21.4, -19.6


def amplification() -> Figure:
    """What the wedge makes of friction: amplification, and torque against velocity."""
    figure = new_figure(style.PAGE, 2.6)
    left, right = figure.subplots(1, 2)
    _draw_amplification(left)
    _draw_characteristic(right)
    return figure


def _draw_amplification(axes: Axes) -> None:
    angle = SYSTEM.brake.angle
    wedge, plain = SYSTEM.brake, wb.ConventionalBrake(radius=0.2)
    mu = np.linspace(0.0, 0.34, 400)
    forwards = [wedge.amplification(m) for m in mu]
    backwards = [-wedge.amplification(-m) for m in mu]
    axes.plot(mu, forwards, color=style.VERMILLION, label="wedge, forwards")
    axes.plot(mu, backwards, color=style.BLUE, label="wedge, backwards")
    axes.plot(mu, [plain.amplification(m) for m in mu], color=style.GREY, label="conventional")
    lock = float(np.tan(angle))
    axes.axvline(lock, color=style.BLACK, linewidth=0.6, linestyle=style.DASHES)
    axes.text(lock - 0.004, 9.6, "locks itself", rotation=90, ha="right", va="top", fontsize=6.5)
    axes.set_xlim(0.0, 0.37)
    axes.set_ylim(0.0, 10.0)
    axes.set_xlabel(r"friction coefficient $\mu$  [1]")
    axes.set_ylabel(r"amplification $|g(\pm\mu)|$  [1]")
    axes.legend(loc="upper left")
    style.letter(axes, "a")


def _draw_characteristic(axes: Axes) -> None:
    law = SYSTEM.characteristic
    for sign, colour in ((1.0, style.VERMILLION), (-1.0, style.BLUE)):
        speed = sign * np.linspace(1e-9, 10.0, 400)
        axes.plot(speed, law.torque(speed), color=colour)
    axes.plot([0.0, 0.0], law.holding, color=style.BLACK, linewidth=2.0)
    axes.annotate(
        "held at rest", (0.0, 160.0), (-9.0, 220.0), arrowprops={"arrowstyle": "-", "lw": 0.5}
    )
    axes.annotate("released", (7.5, 0.0), (6.6, 90.0), arrowprops={"arrowstyle": "-", "lw": 0.5})
    axes.set_xlabel(r"sliding velocity $v$  [rad/s]")
    axes.set_ylabel(r"brake torque $RF_\mu$  [N m]")
    style.few_ticks(axes)
    style.letter(axes, "b")


def stability() -> Figure:
    """Where sliding is stable, over slope and wedge angle."""
    chart = wb.stability_map(
        SYSTEM, eta=np.linspace(-0.3, 0.1, 201), alpha=np.linspace(0.9, 1.8, 181)
    )
    return wb.plot(chart)


def pieces() -> Figure:
    """Two periods of a stick-slip motion, piece by piece, with the torque at rest."""
    # The motion is chaotic: later, rounding would decide what the picture shows.
    response = wb.simulate(SYSTEM, periods=5, samples_per_period=2000)
    shown = _last(response, 2)
    figure = new_figure(style.PAGE, 3.6)
    top, below = figure.subplots(2, 1, sharex=True)
    _draw_pieces(top, shown)
    _draw_torques(below, response, shown)
    below.set_xlabel("time $t$  [s]")
    below.set_xlim(float(shown.time[0]), float(shown.time[-1]))
    style.few_ticks(below, x=8)
    return figure


def _last(response: xr.Dataset, periods: int) -> xr.Dataset:
    """Its last periods."""
    return response.sel(time=slice(float(response.poincare_time[-1 - periods]), None))


_PIECES = (
    ("slip forwards", style.VERMILLION),
    ("slip backwards", style.BLUE),
    ("released", style.GREEN),
    ("rest", style.BLACK),
)


def _draw_pieces(axes: Axes, shown: xr.Dataset) -> None:
    velocity, resting = shown.velocity.to_numpy(), shown.sticking.to_numpy() == 1
    release = SYSTEM.actuation.release_speed
    slipping = ~resting
    inside = np.abs(velocity) < release
    masks = (slipping & inside & (velocity > 0), slipping & inside & (velocity < 0),
             slipping & ~inside, resting)  # fmt: skip
    for (word, colour), mask in zip(_PIECES, masks, strict=True):
        axes.plot(
            shown.time, np.where(mask, velocity, np.nan), color=colour, label=word,
            linewidth=2.2 if word == "rest" else 1.1,
        )  # fmt: skip
    for speed in (-release, release):
        axes.axhline(speed, color=style.GREEN, linewidth=0.4)
    axes.set_ylabel(style.STATE["velocity"])
    style.legend_above(axes, axes.get_legend_handles_labels()[0])


def _draw_torques(axes: Axes, response: xr.Dataset, shown: xr.Dataset) -> None:
    lower, upper = SYSTEM.characteristic.holding
    first, last = float(shown.time[0]), float(shown.time[-1])
    axes.plot(shown.time, shown.brake_torque, color=style.GREY, linewidth=0.7)
    for start, end in zip(response.stick_start.values, response.stick_end.values, strict=True):
        if end > first and start < last:
            axes.fill_between([start, end], lower, upper, color=style.ORANGE, alpha=0.3, lw=0)
    held = np.where(shown.sticking == 1, shown.brake_torque, np.nan)
    axes.plot(shown.time, held, color=style.BLACK, linewidth=2.2)
    axes.set_ylabel(r"brake torque $RF_\mu$  [N m]")


def adding_sliding() -> Figure:
    """A bifurcation that only friction has: a slip appears inside a rest."""
    start = wb.orbit(SYSTEM.replace(eta=-36), order=2)
    branch = list(wb.continuation(start, eta=(-36, AFTER)))
    [at] = [p for p in branch if p.bifurcation and p.bifurcation.kind.value == "adding-sliding"][:1]
    near = [min(branch, key=lambda p: abs(p.value - eta)) for eta in (BEFORE, AFTER)]
    figure = new_figure(style.PAGE, 3.4)
    axes = figure.subplots(2, 3, sharex=True, sharey="row")
    for column, point in enumerate((near[0], at, near[1])):
        _draw_rest(axes[:, column], point)
    axes[0, 0].set_ylabel(style.STATE["velocity"])
    axes[1, 0].set_ylabel("torque on the brake  [N m]")
    return figure


def _draw_rest(axes: np.ndarray, point: wb.BranchPoint) -> None:
    """Velocity above, torque and holding interval below, about the long rest of an orbit."""
    system, period = point.system, point.system.excitation.period
    run = wb.simulate(
        system, periods=point.order, initial=tuple(point.points[0]), samples_per_period=8000
    )
    longest = int((run.stick_end - run.stick_start).to_numpy().argmax())
    # The torque peaks a quarter into its period.
    peak = np.round(float(run.stick_start[longest]) / period - 0.25) + 0.25
    phase = run.time.to_numpy() / period
    near = np.abs(phase - peak) < 0.1
    line = system.driveline
    torque = run.drive_torque - line.damping * run.velocity - line.stiffness * run.angle
    axes[0].plot(phase[near] - peak, run.velocity.to_numpy()[near], color=style.BLUE)
    axes[1].axhspan(*system.characteristic.holding, color=style.ORANGE, alpha=0.3, linewidth=0)
    axes[1].plot(phase[near] - peak, torque.to_numpy()[near], color=style.BLACK)
    axes[1].set_ylim(280.0, 345.0)
    axes[0].set_title(rf"$\eta = {point.value:.4f}$", fontsize=style.LABELS)
    axes[1].set_xlabel("time after the peak of the torque $t/T$  [1]")


def creep() -> Figure:
    """The smoothed law creeps where Coulomb friction rests."""
    exact = wb.paper.system(eta=-24, F0=0.2)
    figure = new_figure(style.PAGE, 2.6)
    left, right = figure.subplots(1, 2)
    speeds = np.linspace(-0.06, 0.06, 600)
    laws = [(xi, wb.SmoothedFriction(kinetic=0.3, steepness=xi)) for xi in (100.0, 400.0)]
    colours = (style.VERMILLION, style.BLUE)
    for (xi, law), colour in zip(laws, colours, strict=True):
        left.plot(speeds, [law.coefficient(v) for v in speeds], color=colour)
        response = wb.simulate(exact.replace(friction=law), periods=20)
        word = rf"smoothed, $\xi$ = {xi:g} s/m"
        right.plot(response.time, response.angle, color=colour, label=word)
    response = wb.simulate(exact, periods=20)
    right.plot(response.time, response.angle, color=style.BLACK, label="Coulomb")
    left.plot([-0.06, 0, 0, 0.06], [-0.3, -0.3, 0.3, 0.3], color=style.BLACK)
    left.set_xlabel("sliding speed $v_r$  [m/s]")
    left.set_ylabel("signed friction coefficient $m$  [1]")
    right.set_xlabel("time $t$  [s]")
    right.set_ylabel(style.STATE["angle"])
    for axes, word in ((left, "a"), (right, "b")):
        style.few_ticks(axes)
        style.letter(axes, word)
    right.legend(loc="best")
    return figure


def run() -> Figure:
    """The first run of the tutorial."""
    return wb.plot(wb.simulate(_tutorial(), periods=250))


def slope() -> Figure:
    """The bifurcation diagram of the tutorial."""
    return wb.plot(wb.bifurcation(_tutorial(), slope=np.linspace(-100, 20, 200)))


def _tutorial() -> wb.BrakedDriveline:
    """The machine that the tutorial writes into a file."""
    page = Path(__file__).with_name("tutorial.md").read_text(encoding="utf-8")
    return wb.read_study(page.split("```toml\n")[1].split("```")[0]).system


def _gallery(name: str) -> Figure:
    """The figure that a program of the gallery draws."""
    page = Path(__file__).with_name("gallery.md").read_text(encoding="utf-8")
    [program] = re.findall(rf"```python\n(# gallery: {name}\n.*?)```", page, flags=re.DOTALL)
    found: dict[str, Figure] = {}
    with contextlib.chdir(Path(__file__).parents[1]), contextlib.redirect_stdout(None):
        exec(program, found)  # noqa: S102 - our own text
    return found["figure"]


def _gallery_names() -> list[str]:
    """The programs of the gallery, each of which draws a figure."""
    page = Path(__file__).with_name("gallery.md").read_text(encoding="utf-8")
    return re.findall(r"^# gallery: (\w+)$", page, flags=re.MULTILINE)


def line() -> Figure:
    """The run of the tutorial on machines."""
    return wb.plot(wb.simulate(_line(), duration=4.0))


def line_modes() -> Figure:
    """The modes of the machine of that tutorial."""
    return wb.plot(wb.stability(_line()))


def _line() -> wb.Machine:
    """The machine in the last study file of the tutorial on machines."""
    page = Path(__file__).with_name("tutorial_machine.md").read_text(encoding="utf-8")
    return wb.read_study(page.split("```toml\n")[-1].split("```")[0]).system


DRAWN = {
    "amplification": amplification,
    "stability": stability,
    "pieces": pieces,
    "adding_sliding": adding_sliding,
    "creep": creep,
    "run": run,
    "slope": slope,
    "line": line,
    "line_modes": line_modes,
    **{name: partial(_gallery, name) for name in _gallery_names()},
}


def main(names: list[str]) -> None:
    """Draw those named, or all."""
    FIGURES.mkdir(exist_ok=True)
    for name in names or DRAWN:
        with style.use():
            figure = DRAWN[name]()
        width = 600 if figure.get_figwidth() < style.PAGE else 1300
        save(figure, FIGURES / f"{name}.png", width=width)


if __name__ == "__main__":
    main(sys.argv[1:])
