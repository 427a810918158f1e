"""The motion of the current system: one run, its class, and the contents of its charts."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wedgebrake.analysis.linear_stability import DrivelineStability, method_of, stability
from wedgebrake.analysis.motion import Motion, motion
from wedgebrake.analysis.responses.spectrum import spectrum
from wedgebrake.analysis.responses.torque import BrakeTorque, brake_torque
from wedgebrake.errors import InputError
from wedgebrake.explorer.core.computation import DENSEST, evaluation_settings, samples_wanted
from wedgebrake.explorer.core.limits import SAMPLES_PER_PERIOD
from wedgebrake.explorer.core.state import PageState
from wedgebrake.figures.data.motion import History, MotionFigures, Phase, Section, Spectrum
from wedgebrake.figures.data.torque_curve import TorqueCurve
from wedgebrake.model.brakes import ConventionalBrake
from wedgebrake.solvers.simulate import simulate

if TYPE_CHECKING:
    import xarray as xr

State = tuple[float, float]

# The spectrum reaches to these multiples of the natural and the forcing frequency.
_NATURALS, _FORCINGS = 6.0, 4.0
# Least number of samples of a run that ended early.
_FEWEST = 600
# Share of a run that met its limit that is run again for the charts.
_SHARE = 0.1
LIMITS = ("event_limit", "step_limit")
"""Status of runs that a limit stopped."""
_AT_A_LIMIT = "Stopped at a limit of the explorer; the beginning is shown."
# Sentences for a run that ended early.
_ENDINGS = {
    "diverged": "The motion grows without bound.",
    "no_forward_solution": "The brake locked itself.",
    **dict.fromkeys(LIMITS, _AT_A_LIMIT),
}


@dataclass(frozen=True, eq=False)
class Snapshot:
    """Motion of a system; if the run ended early, its computed part.

    status, message  : how the simulation ended, as in the attributes of a response
    figures          : contents of its charts
    motion           : the class of the motion, with the evidence
    stability        : the linear verdict
    braking          : torque of the brake over the recorded periods; nan where there is none
    comparison       : the same system with a conventional brake of the same radius
    """

    status: str
    message: str
    figures: MotionFigures
    motion: Motion
    stability: DrivelineStability
    braking: BrakeTorque
    comparison: Snapshot | None = None


def take_snapshot(state: PageState, *, settle: bool = False) -> Snapshot:
    """Run the current system and classify its motion.

    settle : True to continue the run until the motion has settled, within limits; otherwise it is
             classified over the recorded periods of the run

    Divergence, self-locking and limits are answers. Raises ``InputError`` for a method that
    does not fit the friction law.
    """
    comparison = None
    if state.view.comparison and not isinstance(state.system.brake, ConventionalBrake):
        comparison = _one_brake(state.edited(brake="conventional"), settle)
    return replace(_one_brake(state, settle), comparison=comparison)


def _one_brake(state: PageState, settle: bool) -> Snapshot:
    run = _Run(state)
    recorded, seen = run.response()
    status = recorded.attrs["status"]
    complete = status == "completed"
    linear = stability(state.system, method=method_of(recorded.attrs["method"]))
    return Snapshot(
        status=status,
        message=recorded.attrs["message"],
        figures=run.figures(recorded, seen, linear),
        motion=run.classified(recorded, settle),
        stability=linear,
        braking=run.braking(recorded) if complete else _NO_TORQUE,
    )


class _Run:
    def __init__(self, state: PageState) -> None:
        self.state, self.system = state, state.system
        run = state.study.run
        self.begin, self.initial = run.start_time, run.initial
        self.options: dict[str, Any] = {
            "method": run.method,
            "rtol": run.rtol,
            **state.limits,
        }
        self.period = 1.0 / self.system.excitation.frequency
        wanted = samples_wanted(self.system)
        self.resolved = wanted <= DENSEST  # otherwise there is no spectrum
        self.density = max(SAMPLES_PER_PERIOD, math.ceil(wanted) if self.resolved else 0)
        self.shown = min(state.view.shown, state.periods)
        self.first_recorded = self._time(state.transient)
        self.first_shown = self._time(state.periods - self.shown)
        # Windows begin earlier by this time [s]: rounding must not exclude the first sample.
        self.early = 0.5 * self.period / self.density

    def _time(self, periods: float) -> float:
        return float(self.begin + periods * self.period)

    def response(self) -> tuple[xr.Dataset, xr.Dataset]:
        """The whole run, sampled at its end; and the response that the charts show."""
        periods = self.state.periods
        length = max(self.state.recorded, self.shown)
        steps = np.arange((periods - length) * self.density, periods * self.density + 1)
        times = self.begin + steps * (self.period / self.density)
        whole = self._simulate(periods=periods, times=times)
        if whole.attrs["status"] == "completed":
            return whole, whole
        # It ended early: run again, with samples over the computed part.
        end = float(whole.attrs["final_time"])
        if whole.attrs["status"] in LIMITS:
            end = self.begin + _SHARE * (end - self.begin)
        duration = end - self.begin
        if not duration > 0.0:
            return whole, whole.isel(time=slice(0))
        self.first_shown = max(self.begin, end - self.shown * self.period)
        span = end - self.first_shown
        count = max(_FEWEST, round(span / self.period * self.density))
        times = np.linspace(self.first_shown, end, count + 1)
        seen = self._simulate(duration=duration, times=times)
        # Whether it reaches the instant at which the first one ended is a matter of rounding.
        return whole, seen.assign_attrs(status=whole.attrs["status"])

    def _simulate(self, **given: Any) -> xr.Dataset:
        return simulate(
            self.system, initial=self.initial, start_time=self.begin, **given, **self.options
        )

    def classified(self, response: xr.Dataset, settle: bool) -> Motion:
        """The class of the motion.

        The run is continued from where its record begins.
        """
        state, options = self.state, dict(self.options)
        returns = self.system.machine.returns
        points = np.column_stack([response["poincare_angle"], response["poincare_velocity"]])
        numbers = response["period"].to_numpy()
        complete = response.attrs["status"] == "completed"
        if settle and complete:
            # As many periods as the limits of one run allow.
            most = min(state.limits.values()) / max(response.attrs["work"], 1) * state.periods
            rule = evaluation_settings(state)
            rule["limit"] = int(min(max(most, state.periods), rule["limit"]))
            return motion(self.system, initial=_state(points[0]), **rule, **options)
        if complete:
            place = int(np.searchsorted(numbers, numbers[-1] - state.recorded))
            start = _state(points[place])
            options[returns] = state.recorded
            found = motion(self.system, transient=0, initial=start, **options)
            return replace(found, transient=state.transient)
        if response.attrs["status"] in LIMITS:
            options |= {"max_events": 1, "max_steps": 1}  # the limits would be met again
        start = _state(points[0]) if len(points) else self.initial
        options[returns] = state.periods
        return motion(self.system, transient=state.transient, initial=start, **options)

    def figures(
        self, recorded: xr.Dataset, seen: xr.Dataset, linear: DrivelineStability
    ) -> MotionFigures:
        """Contents of the charts: of the last shown periods, and of the recorded ones."""
        time = seen["time"].to_numpy()
        time = time[int(np.searchsorted(time, self.first_shown - self.early)) :]
        if time.size < 2:
            seen, time = seen.isel(time=slice(0)), np.zeros(1)
        history = History.between(seen, float(time[0]), float(time[-1]))
        numbers = recorded["period"].to_numpy()
        settled = recorded["poincare_time"].to_numpy()[
            numbers >= self.state.transient + min(numbers, default=0)
        ]
        complete = recorded.attrs["status"] == "completed"
        sliding = history.velocity + self.system.driveline.drive_speed
        return MotionFigures(
            history=history,
            force=np.array([self.system.actuation.force(one) for one in sliding.tolist()]),
            phase=Phase.over(self.system, history),
            section=Section.of(recorded, start=float(settled[0]) if settled.size else math.inf),
            spectrum=self.spectrum(recorded, complete=complete),
            torque=TorqueCurve.of(
                self.system, linear, float(np.abs(sliding[history.bounded]).max(initial=0.0))
            ),
            completed=complete,
            ending=_ENDINGS.get(recorded.attrs["status"], ""),
        )

    def spectrum(self, response: xr.Dataset, *, complete: bool) -> Spectrum:
        """Spectrum of the velocity over the recorded periods; empty where there is none."""
        forcing = self.system.excitation.frequency
        natural = self.system.driveline.natural_frequency / (2.0 * math.pi)
        highest = max(_NATURALS * natural, _FORCINGS * forcing)
        if complete and self.resolved:
            lines = spectrum(response, start=self.first_recorded - self.early)
            return Spectrum.of(lines, highest)
        acts = self.system.excitation.amplitude > 0.0
        return Spectrum(
            np.empty(0), np.empty(0), highest, forcing=forcing if acts else 0.0, natural=natural
        )

    def braking(self, response: xr.Dataset) -> BrakeTorque:
        """Torque of the brake over the recorded periods."""
        try:
            return brake_torque(response, start=self.first_recorded)
        except InputError:  # samples too far apart
            return _NO_TORQUE


_NO_TORQUE = BrakeTorque(mean=math.nan, mean_size=math.nan, peak=math.nan)


def _state(point: NDArray[np.float64]) -> State:
    return float(point[0]), float(point[1])
