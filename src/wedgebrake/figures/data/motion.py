"""Contents of the pictures of one motion: history, phase portrait, section, spectrum."""

from __future__ import annotations

import json
import math
from contextlib import suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wedgebrake.analysis.responses.repeat import repeated, system_of
from wedgebrake.analysis.responses.spectrum import frequencies, is_driven
from wedgebrake.analysis.responses.sticking import inside, span, steady_start
from wedgebrake.arrays import FloatArray
from wedgebrake.errors import InputError
from wedgebrake.figures import style
from wedgebrake.figures.data.limits import Limits, before_divergence, extent
from wedgebrake.figures.data.panels import Level
from wedgebrake.figures.data.parts import selected_part
from wedgebrake.figures.data.torque_curve import TorqueCurve
from wedgebrake.model.machine import Machine
from wedgebrake.model.machine_parts import GROUND
from wedgebrake.model.signals.signals import as_signal
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.model.validation import wrong

if TYPE_CHECKING:
    import xarray as xr


# A motion that exceeds its median by this factor is shown on a logarithmic scale.
_RUNAWAY = 1e3
# Sticks nearer to each other than this share of the window are merged on the page.
_APART = 1e-3
# The switching line is shown if it makes the picture at most this much higher than the motion.
_FARTHEST = 3.0
# Least size of a picture as a share of the motion, so that rounding does not look like scatter.
_LEAST = 0.05


class RestIntervals(NamedTuple):
    """Intervals during which the brake sticks.

    start, end : (k,) [s]
    side       : (k,) sign of the sliding velocity before; 0: at rest from the start
    """

    start: FloatArray
    end: FloatArray
    side: NDArray[np.int64]

    @classmethod
    def between(cls, response: xr.Dataset, begin: float, end: float) -> RestIntervals:
        """Sticks of a response with a part between two times [s], cut there."""
        start, stop, side = (
            response[f"stick_{one}"].to_numpy() for one in ("start", "end", "entry")
        )
        found = cls(np.maximum(start, begin), np.minimum(stop, end), side.astype(np.int64))
        return found.where((start <= end) & ((stop > begin) | (start >= begin) | (stop >= end)))

    def by_side(self) -> dict[int, RestIntervals]:
        """Sticks by their side, those after v > 0 first; sides without sticks are left out."""
        return {side: self.where(self.side == side) for side in (1, -1, 0) if side in self.side}

    def where(self, chosen: NDArray[np.bool_]) -> RestIntervals:
        """Return the selected sticks."""
        return RestIntervals(self.start[chosen], self.end[chosen], self.side[chosen])

    def merged(self, gap: float, most: int) -> RestIntervals:
        """Sticks of the same side not farther apart than a gap [s] as one.

        Where more than ``most`` remain, those of different sides are merged too.
        """
        if self.start.size < 2:
            return self
        far = self.start[1:] - self.end[:-1] > gap
        apart = far | (np.diff(self.side) != 0)
        if np.count_nonzero(apart) > most:
            apart = far
        first, last = np.append(True, apart), np.append(apart, True)
        return RestIntervals(self.start[first], self.end[last], self.side[first])


@dataclass(frozen=True, eq=False)
class History:
    """Motion of a response between two times.

    begin, end         : of the window [s]
    time               : (n,) [s]
    angle, velocity    : (n,) [rad], [rad/s]
    brake_torque, drive_torque : (n,) [N m]
    sticking           : (n,) 1 while the brake sticks
    sticks             : cut to the window
    diverged           : the motion grows without bound
    """

    begin: float
    end: float
    time: FloatArray
    angle: FloatArray
    velocity: FloatArray
    brake_torque: FloatArray
    drive_torque: FloatArray
    sticking: NDArray[np.int8]
    sticks: RestIntervals
    diverged: bool

    @classmethod
    def between(cls, response: xr.Dataset, begin: float, end: float) -> History:
        """Part of a response between two times [s]."""
        time = response["time"].to_numpy()
        window = (time >= begin) & (time <= end)
        names = ("time", "angle", "velocity", "brake_torque", "drive_torque", "sticking")
        samples = {name: response[name].to_numpy()[window] for name in names}
        sticks = RestIntervals.between(response, begin, end if np.any(window) else -math.inf)
        diverged = response.attrs.get("status") == "diverged"
        return cls(begin, end, **samples, sticks=sticks, diverged=diverged)

    @classmethod
    def last(cls, response: xr.Dataset, periods: float | None) -> History:
        """Last torque periods of a response, or all of it; raises ``InputError`` for others."""
        return cls.between(response, *last_periods(response, periods))

    @property
    def bounded(self) -> slice:
        """Samples that fit into a picture: of a diverging motion those before it leaves it."""
        return before_divergence(self.velocity) if self.diverged else slice(self.velocity.size)

    @property
    def linear_up_to(self) -> float | None:
        """Speed [rad/s] beyond which a growing motion needs a logarithmic scale."""
        speed = np.abs(self.velocity)
        largest = float(np.max(speed, initial=0.0))
        if not self.diverged or not largest > _RUNAWAY * max(float(np.median(speed)), 1e-300):
            return None
        least = max(float(np.min(speed[speed > 0.0])), 1e-6 * largest)
        return float(10.0 ** np.ceil(np.log10(least)))

    @property
    def visible_sticks(self) -> RestIntervals:
        """Sticks, merged where they are too close to be distinguished."""
        return self.sticks.merged(_APART * (self.end - self.begin), round(1.0 / _APART))

    @property
    def velocity_extent(self) -> Limits:
        """Smallest and largest velocity of the samples that fit [rad/s]."""
        return extent(self.velocity[self.bounded])


def last_periods(response: xr.Dataset, periods: float | None) -> tuple[float, float]:
    """First and last time [s] of the last torque periods of a response; None: all of it."""
    begin, end = span(response)
    if periods is None:
        return begin, end
    if not isinstance(periods, int | float) or not periods > 0:
        raise wrong("periods", periods, "a number above 0, or None for all")
    forcing = frequencies(response).get("forcing_frequency", 0.0)
    return (max(begin, end - periods / forcing) if forcing > 0.0 else begin), end


def window(response: xr.Dataset, start: float | None, stop: float | None) -> xr.Dataset:
    """The part of a response between two times [s]; None: its first or last time.

    Raises ``InputError`` for a dataset that is not a response or times outside it.
    """
    begin, end = span(response)
    begin = begin if start is None else inside(start, begin, end)
    end = end if stop is None else inside(stop, begin, end, "stop")
    times, slack = response["poincare_time"].to_numpy(), 1e-9 * max(abs(begin), abs(end))
    crossed = np.flatnonzero((times >= begin - slack) & (times <= end + slack))
    part = response.sel(time=slice(begin, end)).isel(period=crossed)
    options = {**json.loads(response.attrs.get("options", "{}")), "start_time": begin}
    return part.assign_attrs(options=json.dumps(options), final_time=end)


def with_section(part: xr.Dataset, response: xr.Dataset) -> xr.Dataset:
    """One part of a response with its states at whole periods of the signals."""
    if "poincare_time" in part:
        return part
    period, (begin, end) = system_of(response).machine.period, span(response)
    numbers = np.arange(math.ceil(begin / period), end // period + 1) if period else np.empty(0)
    times = numbers * (period or 0.0)
    times = times[times <= end]
    points = repeated(response, times).sel(inertia=part["inertia"].item())
    section = {
        f"poincare_{name}": ("period", points[name].to_numpy())
        for name in ("time", "angle", "velocity")
    }
    return part.assign(section).assign_coords(period=numbers[: times.size].astype(np.int64))


@dataclass(frozen=True, eq=False)
class PhaseCurve:
    """A part of a response in the phase plane.

    history       : motion in that part
    least         : smallest width [rad] and height [rad/s] of the picture
    drive_speed   : of the shaft [rad/s]; the brake sticks at the velocity -drive_speed; nan: it has
                    no such velocity, as the base does not move steadily
    release_speed : sliding speed beyond which the brake is released [rad/s]; inf: none
    """

    history: History
    least: tuple[float, float]
    drive_speed: float
    release_speed: float

    @classmethod
    def of(
        cls, system: BrakedDriveline | Machine, response: xr.Dataset, start: float | None
    ) -> PhaseCurve:
        """Portrait from a start time [s]; None: of the last fifth of the response.

        Raises ``InputError`` for a dataset that is not a response or a start outside it.
        """
        begin, end = span(response)
        low = steady_start(response) if start is None else inside(start, begin, end)
        least = _least(response["angle"].to_numpy(), response["velocity"].to_numpy())
        name = selected_part(response, "contact")
        return cls.over(system, History.between(response, low, end), least, name)

    @classmethod
    def over(
        cls,
        system: BrakedDriveline | Machine,
        history: History,
        least: tuple[float, float] = (0.0, 0.0),
        contact: str | None = None,
    ) -> PhaseCurve:
        """Portrait of the motion of a history; ``contact``: its name, None: the first one."""
        contacts = system.machine.contacts
        chosen = next((one for one in contacts if one.name == contact), contacts[0])
        base, release = as_signal(chosen.base_speed), math.inf
        steady = chosen.b == GROUND and not base.varies
        with suppress(InputError):  # a force that does not follow the speed at once
            release = chosen.actuation.release_speed
        return cls(history, least, 0.0 - float(base(0.0)) if steady else math.nan, release)

    @property
    def levels(self) -> list[Level]:
        """Velocity at which the brake may stick, and those beyond which it is released [rad/s]."""
        name = r"$\dot\theta=-\Omega$" if self.drive_speed else r"$\dot\theta=0$"
        beyond = self.release_speed - self.drive_speed, -self.release_speed - self.drive_speed
        releases = [Level(speed, "release", style.RELEASE, (5.0, 2.0)) for speed in beyond]
        levels = [Level(-self.drive_speed, name, style.SWITCHING), *releases]
        return [one for one in levels if not math.isnan(one.value)]

    @property
    def angle_extent(self) -> Limits:
        """Smallest and largest angle of the samples that fit [rad]."""
        return extent(self.history.angle[self.history.bounded])

    def reaching(self, low: float, high: float) -> Limits:
        """Limits of velocity widened to the switching line, unless the motion is too small."""
        if math.isnan(self.drive_speed):
            return low, high
        reach = min(low, -self.drive_speed), max(high, -self.drive_speed)
        return reach if reach[1] - reach[0] <= _FARTHEST * (high - low) else (low, high)

    def paths(self, sticks: RestIntervals) -> list[tuple[FloatArray, FloatArray]]:
        """Angles [rad] and velocities [rad/s] of each stick: at its ends and the samples between.

        Bodies that stick to each other may vibrate together, and a base may be accelerated.
        """
        history, found = self.history, []
        after = np.searchsorted(history.time, sticks.start, "right")
        before = np.searchsorted(history.time, sticks.end, "left")
        for start, first, last, end in zip(sticks.start, after, before, sticks.end, strict=True):
            time = np.concatenate(([start], history.time[first:last], [end]))
            angle, velocity = (
                np.interp(time, history.time, one) for one in (history.angle, history.velocity)
            )
            found.append((angle, velocity))
        return found


@dataclass(frozen=True, eq=False)
class PoincarePicture:
    """Points of a Poincaré section.

    angle, velocity : (m,) [rad], [rad/s]
    number          : (m,) of the torque period, or of the crossing
    least           : smallest width [rad] and height [rad/s] of the picture
    crossed         : velocity that the points cross upwards where no torque acts, the middle of its
                      range [rad/s]; None for one point in every period of the torque
    """

    angle: FloatArray
    velocity: FloatArray
    number: NDArray[np.int64]
    least: tuple[float, float]
    crossed: float | None = None

    @classmethod
    def of(cls, points: xr.Dataset, start: float | None = None) -> PoincarePicture:
        """Section of a response from a start time [s], or points returned by ``wb.poincare``.

        start : default the last fifth of the response

        Raises ``InputError`` for a dataset that is neither.
        """
        names = getattr(points, "data_vars", {})
        if "poincare_angle" in names:
            low = steady_start(points) if start is None else start
            if not is_driven(points):
                return cls._of_crossings(points.sel(time=slice(low, None)))
            shown = points["poincare_time"].to_numpy() >= low - 1e-9 * abs(low)
            angle, velocity, number = (
                points[name].to_numpy()[shown]
                for name in ("poincare_angle", "poincare_velocity", "period")
            )
            least = _least(points["angle"].to_numpy(), points["velocity"].to_numpy())
        elif "angle" in names and points["angle"].dims == ("period",):
            angle, velocity, number = (
                points[name].to_numpy() for name in ("angle", "velocity", "period")
            )
            least = _least(np.append(angle, 0.0), np.append(velocity, 0.0))
        else:
            allowed = "the result of wb.simulate(...) or of wb.poincare(...)"
            raise wrong("points", points, allowed)
        return cls(angle, velocity, number, least)

    @classmethod
    def _of_crossings(cls, motion: xr.Dataset) -> PoincarePicture:
        """States at which the velocity crosses the middle of its range upwards.

        The only point of an equilibrium is its last state.
        """
        angle, velocity = motion["angle"].to_numpy(), motion["velocity"].to_numpy()
        middle = 0.5 * float(np.min(velocity) + np.max(velocity)) if velocity.size else 0.0
        before = np.flatnonzero((velocity[:-1] < middle) & (velocity[1:] >= middle))
        least = _least(angle, velocity)
        if not before.size:
            return cls(angle[-1:], velocity[-1:], np.arange(velocity[-1:].size), least, middle)
        share = (middle - velocity[before]) / (velocity[before + 1] - velocity[before])
        crossed = angle[before] + share * (angle[before + 1] - angle[before])
        return cls(crossed, np.full(before.size, middle), np.arange(before.size), least, middle)


def _least(angle: FloatArray, velocity: FloatArray) -> tuple[float, float]:
    """Smallest width [rad] and height [rad/s] of a picture of a motion."""
    width, height = (_LEAST * float(np.ptp(one)) if one.size else 0.0 for one in (angle, velocity))
    return width, height


@dataclass(frozen=True, eq=False)
class SpectrumLines:
    """Lines of an amplitude spectrum.

    frequency, amplitude : (l,) [Hz], and in ``unit``
    highest              : end of the frequency axis [Hz]
    quantity, unit       : the oscillating quantity
    forcing, natural     : frequencies [Hz]; forcing 0: no torque acts, natural 0: no stiffness
    """

    frequency: FloatArray
    amplitude: FloatArray
    highest: float
    quantity: str = "velocity"
    unit: str = "rad/s"
    forcing: float = 0.0
    natural: float = 0.0

    @classmethod
    def of(cls, lines: xr.Dataset, highest: float | None = None) -> SpectrumLines:
        """Spectrum from ``wb.spectrum``, up to a frequency [Hz].

        highest : default 4 times the larger of forcing and natural frequency

        Raises ``InputError`` for a dataset that is not a spectrum.
        """
        if "amplitude" not in getattr(lines, "data_vars", {}):
            raise wrong("lines", lines, "the result of wb.spectrum(response)")
        forcing = lines.attrs.get("forcing_frequency", 0.0)
        natural = lines.attrs.get("natural_frequency", 0.0)
        quantity = lines.attrs.get("quantity", "velocity")
        frequency, amplitude = lines["frequency"].to_numpy(), lines["amplitude"].to_numpy()
        if highest is None:
            highest = 4.0 * max(forcing, natural) or float(frequency[-1])
        shown = frequency <= highest * (1.0 + 1e-9)
        unit = lines["amplitude"].units
        return cls(frequency[shown], amplitude[shown], highest, quantity, unit, forcing, natural)

    @property
    def top(self) -> float:
        """Largest amplitude; 0 where nothing moves."""
        return float(np.max(self.amplitude, initial=0.0))

    @property
    def levels(self) -> list[Level]:
        """Forcing and natural frequency [Hz], 0 for none."""
        return [
            Level(frequency, f"$f_{letter}$ = {style.number(frequency)} Hz", colour, dashes)
            for frequency, letter, colour, dashes in (
                (self.forcing, "e", style.FORCING, (5.0, 2.0)),
                (self.natural, "n", style.NATURAL, (1.0, 1.2)),
            )
        ]


@dataclass(frozen=True, eq=False)
class MotionFigures:
    """Contents of the pictures of a motion.

    history, phase, section, spectrum, torque : the pictures
    force     : actuation force over the history, (n,) [N]
    sliding   : sliding velocity over the history, (n,) [rad/s]
    completed : the run reached its end; otherwise it has neither section nor spectrum
    ending    : a sentence on a run that ended early
    """

    history: History
    phase: PhaseCurve
    section: PoincarePicture
    spectrum: SpectrumLines
    torque: TorqueCurve
    force: FloatArray
    sliding: FloatArray
    completed: bool = True
    ending: str = ""
