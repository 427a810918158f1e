"""The motion of the machine on the desk: one run, judged, and what pictures of it need."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wedgebrake.analysis.linear_stability import Stability, stability
from wedgebrake.analysis.motion import Motion, motion
from wedgebrake.analysis.spectrum import spectrum
from wedgebrake.analysis.torque import BrakeTorque, brake_torque
from wedgebrake.errors import InputError
from wedgebrake.explorer.core.evaluation import judging
from wedgebrake.explorer.core.limits import SAMPLES_PER_PERIOD
from wedgebrake.explorer.core.state import Desk
from wedgebrake.model.brakes import ConventionalBrake
from wedgebrake.solvers.simulate import simulate

if TYPE_CHECKING:
    import xarray as xr

FloatArray = NDArray[np.float64]
State = tuple[float, float]

# A torque slower than the free vibration is sampled by the vibration's period, up to so many
# samples in one of its own; beyond that there is no spectrum.
_OF_NATURAL, _DENSEST = 20, 2000
# The spectrum reaches to these multiples of the natural and the forcing frequency.
_NATURALS, _FORCINGS = 6.0, 4.0
# A run that ended early is sampled so often at least.
_FEWEST = 600
# Of a run that met its limit, so much is run once more, for the pictures.
_SHARE = 0.1
_LIMITS = ("event_limit", "step_limit")


@dataclass(frozen=True, eq=False)
class Moment:
    """What a machine does; of a run that ended early, what there is.

    status, message  : how the simulation ended, as in the attributes of a response
    time, angle, velocity, torque, drive, force, sticking
                     : (n,) the last shown periods [s] [rad] [rad/s], torque of the brake and of
                       the drive [N m], actuation force [N], whether the brake sticks; all empty
                       below 2 samples. Of a run that met a limit, of its beginning
    settled          : (r,) velocity over the recorded periods [rad/s]; empty where the run
                       ended early
    sticks           : (k, 3) start, end [s], sign of the sliding velocity before (0: none)
    section_angle, section_velocity : (m,) Poincare points of the recorded periods
    frequency, amplitude : (l,) spectrum of the velocity over the recorded periods, up to the
                       highest shown frequency [Hz], [rad/s]; empty where there is none
    forcing, natural : frequencies [Hz]; forcing 0: no torque acts, natural 0: no spring
    motion           : the class of the motion, with the evidence
    stability        : the linear verdict
    braking          : torque of the brake over the recorded periods; nan where there is none
    drive_speed      : of the shaft [rad/s]; the brake sticks at the velocity -drive_speed
    release_speed    : sliding speed beyond which the brake is released [rad/s]; inf: none
    ghost            : the same machine with a conventional brake of the same radius
    """

    status: str
    message: str
    time: FloatArray
    angle: FloatArray
    velocity: FloatArray
    torque: FloatArray
    drive: FloatArray
    force: FloatArray
    sticking: NDArray[np.bool_]
    sticks: FloatArray
    settled: FloatArray
    section_angle: FloatArray
    section_velocity: FloatArray
    frequency: FloatArray
    amplitude: FloatArray
    forcing: float
    natural: float
    motion: Motion
    stability: Stability
    braking: BrakeTorque
    drive_speed: float
    release_speed: float
    ghost: Moment | None = None


def look(desk: Desk, *, settle: bool = False) -> Moment:
    """Run the machine on the desk and judge its motion.

    settle : wait until the motion has settled before it is judged, within limits; else it is
             judged over the recorded periods of the run

    Divergence, self-locking and limits are answers. Raises ``InputError`` for a method that
    does not fit the friction law.
    """
    ghost = None
    if desk.view.ghost and not isinstance(desk.system.brake, ConventionalBrake):
        ghost = _look(desk.edited(brake="conventional"), settle)
    return replace(_look(desk, settle), ghost=ghost)


def _look(desk: Desk, settle: bool) -> Moment:
    run = _Run(desk)
    recorded, seen = run.response()
    forcing = desk.system.excitation.frequency
    natural = desk.system.driveline.natural_frequency / (2.0 * math.pi)
    complete = recorded.attrs["status"] == "completed"
    frequency, amplitude = run.spectrum(recorded, forcing, natural) if complete else _NO_LINES
    samples = _samples(seen, run.first_shown - run.early)
    sliding = samples["velocity"] + desk.system.driveline.drive_speed
    return Moment(
        status=recorded.attrs["status"],
        message=recorded.attrs["message"],
        **samples,
        force=np.array([desk.system.actuation.force(one) for one in sliding.tolist()]),
        settled=run.settled(recorded) if complete else np.empty(0),
        section_angle=_section(recorded, desk, "poincare_angle"),
        section_velocity=_section(recorded, desk, "poincare_velocity"),
        frequency=frequency,
        amplitude=amplitude,
        forcing=forcing if desk.system.excitation.amplitude > 0.0 else 0.0,
        natural=natural,
        motion=run.judged(recorded, settle),
        stability=stability(desk.system),
        braking=run.braking(recorded) if complete else _NO_TORQUE,
        drive_speed=desk.system.driveline.drive_speed,
        release_speed=desk.system.actuation.release_speed,
    )


class _Run:
    """The run that a desk asks for."""

    def __init__(self, desk: Desk) -> None:
        self.desk, self.system = desk, desk.system
        run = desk.study.run
        self.begin, self.initial = run.start_time, run.initial
        self.options: dict[str, Any] = {
            "method": run.method,
            "rtol": run.rtol,
            "step": run.step,
            **desk.limits,
        }
        self.period = 1.0 / self.system.excitation.frequency
        wanted = _OF_NATURAL * self.system.driveline.natural_frequency * self.period
        wanted /= 2.0 * math.pi
        self.resolved = wanted <= _DENSEST
        self.density = max(SAMPLES_PER_PERIOD, math.ceil(wanted) if self.resolved else 0)
        self.shown = min(desk.view.shown, desk.periods)
        self.first_recorded = self._time(desk.transient)
        self.first_shown = self._time(desk.periods - self.shown)
        # Windows begin so much earlier [s]: rounding shall not lose the first sample.
        self.early = 0.5 * self.period / self.density

    def _time(self, periods: float) -> float:
        return float(self.begin + periods * self.period)

    def response(self) -> tuple[xr.Dataset, xr.Dataset]:
        """The whole run, sampled at its end; and the response that pictures are made of."""
        periods = self.desk.periods
        length = max(self.desk.recorded, self.shown)
        steps = np.arange((periods - length) * self.density, periods * self.density + 1)
        times = self.begin + steps * (self.period / self.density)
        whole = self._simulate(periods=periods, times=times)
        if whole.attrs["status"] == "completed":
            return whole, whole
        # It ended where nobody looked: again, and with samples where it went.
        end = float(whole.attrs["final_time"])
        if whole.attrs["status"] in _LIMITS:
            end = self.begin + _SHARE * (end - self.begin)
        duration = end - self.begin
        if not duration > 0.0:
            return whole, whole.isel(time=slice(0))
        self.first_shown = max(self.begin, end - self.shown * self.period)
        span = end - self.first_shown
        count = max(_FEWEST, round(span / self.period * self.density))
        times = np.linspace(self.first_shown, end, count + 1)
        return whole, self._simulate(duration=duration, times=times)

    def _simulate(self, **given: Any) -> xr.Dataset:
        return simulate(
            self.system, initial=self.initial, start_time=self.begin, **given, **self.options
        )

    def judged(self, response: xr.Dataset, settle: bool) -> Motion:
        """The class of the motion.

        The run that was made is gone on with, from where its record begins: from there the
        judge would come to the same states.
        """
        desk, options = self.desk, dict(self.options)
        points = np.column_stack([response["poincare_angle"], response["poincare_velocity"]])
        numbers = response["period"].to_numpy()
        complete = response.attrs["status"] == "completed"
        if settle and complete:
            # As many periods as the limits of one run allow for.
            most = min(desk.limits.values()) / max(response.attrs["work"], 1) * desk.periods
            rule = judging(desk)
            rule["limit"] = int(min(max(most, desk.periods), rule["limit"]))
            return motion(self.system, initial=_state(points[0]), **rule, **options)
        if complete:
            place = int(np.searchsorted(numbers, numbers[-1] - desk.recorded))
            start = _state(points[place])
            found = motion(self.system, desk.recorded, transient=0, initial=start, **options)
            return replace(found, transient=desk.transient)
        if response.attrs["status"] in _LIMITS:
            options |= {"max_events": 1, "max_steps": 1}  # it would meet them again
        start = _state(points[0]) if len(points) else self.initial
        return motion(self.system, desk.periods, transient=desk.transient, initial=start, **options)

    def settled(self, response: xr.Dataset) -> FloatArray:
        """Velocity over the recorded periods [rad/s]."""
        first = np.searchsorted(response["time"], self.first_recorded - self.early)
        return np.asarray(response["velocity"])[first:]

    def spectrum(
        self, response: xr.Dataset, forcing: float, natural: float
    ) -> tuple[FloatArray, FloatArray]:
        """(frequency [Hz], amplitude [rad/s]) over the recorded periods."""
        if not self.resolved:
            return _NO_LINES
        lines = spectrum(response, start=self.first_recorded - self.early)
        frequency = lines["frequency"].to_numpy()
        highest = max(_NATURALS * natural, _FORCINGS * forcing) * (1.0 + 1e-9)
        shown = slice(int(np.searchsorted(frequency, highest, side="right")))
        return frequency[shown], lines["amplitude"].to_numpy()[shown]

    def braking(self, response: xr.Dataset) -> BrakeTorque:
        """Torque of the brake over the recorded periods."""
        try:
            return brake_torque(response, start=self.first_recorded)
        except InputError:  # samples too far apart
            return _NO_TORQUE


_NO_LINES = (np.empty(0), np.empty(0))
_NO_TORQUE = BrakeTorque(mean=math.nan, mean_size=math.nan, peak=math.nan)


def _state(point: FloatArray) -> State:
    return float(point[0]), float(point[1])


def _samples(response: xr.Dataset, first: float) -> dict[str, Any]:
    """The samples of a response from a time on [s], and its sticks."""
    time = response["time"].to_numpy()
    shown = slice(int(np.searchsorted(time, first)), None)
    if time[shown].size < 2:
        shown = slice(0)
    found = {
        "time": "time",
        "angle": "angle",
        "velocity": "velocity",
        "torque": "brake_torque",
        "drive": "drive_torque",
    }
    values = {name: response[variable].to_numpy()[shown] for name, variable in found.items()}
    sticking = response["sticking"].to_numpy()[shown] != 0
    names = ("stick_start", "stick_end", "stick_entry")
    sticks = np.column_stack([response[name].to_numpy().astype(float) for name in names])
    time = values["time"]
    if time.size:
        inside = (sticks[:, 1] >= time[0]) & (sticks[:, 0] <= time[-1])
        sticks = sticks[inside]
        np.clip(sticks[:, :2], time[0], time[-1], out=sticks[:, :2])
    else:
        sticks = sticks[:0]
    return {**values, "sticking": sticking, "sticks": sticks}


def _section(response: xr.Dataset, desk: Desk, name: str) -> FloatArray:
    """Of the Poincare points, those of the recorded periods."""
    numbers = response["period"].to_numpy()
    first = numbers[0] if numbers.size else 0
    return np.asarray(response[name].to_numpy()[numbers >= first + desk.transient])
