"""The motion of the current system: one run, its class, and the contents of its charts."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wedgebrake.analysis.linear_stability import Stability, linearisation_of, stability
from wedgebrake.analysis.motion import Motion, motion
from wedgebrake.analysis.responses.spectrum import spectrum
from wedgebrake.analysis.responses.torque import BrakeTorque, brake_torque
from wedgebrake.errors import InputError
from wedgebrake.explorer.core.computation import (
    DENSEST,
    density,
    evaluation_settings,
    samples_wanted,
)
from wedgebrake.explorer.core.one_part import is_one_brake, one_part
from wedgebrake.explorer.core.state import PageState
from wedgebrake.figures.data.limits import thinned
from wedgebrake.figures.data.motion import (
    History,
    MotionFigures,
    PhaseCurve,
    PoincarePicture,
    SpectrumLines,
)
from wedgebrake.figures.data.torque_curve import TorqueCurve
from wedgebrake.model.machine import Machine
from wedgebrake.model.machine_matrices import natural_frequencies
from wedgebrake.model.machine_parts import GROUND, Contact
from wedgebrake.model.signals.signals import number_of
from wedgebrake.model.torque_contacts import TorqueContact
from wedgebrake.solvers.machine.final_state import final_state
from wedgebrake.solvers.simulate import simulate

if TYPE_CHECKING:
    import xarray as xr

State = tuple[float, float]

# The spectrum reaches to these multiples of the natural and the forcing frequency.
_NATURALS, _FORCINGS = 6.0, 4.0
# Largest number of samples of an animation, and smallest number for a spectrum.
_MOST_DRAWN, _FEWEST_LINES = 1500, 16
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
class Discs:
    """The motion of all bodies and contacts of a machine, for its animation.

    time     : (n,) [s]
    angles   : of each inertia, by name, (n,) [rad]
    sticking : of each contact, by name, (n,) 1 while it sticks
    torques  : of each contact, by name, (n,) [N m]
    """

    time: NDArray[np.float64]
    angles: dict[str, NDArray[np.float64]]
    sticking: dict[str, NDArray[np.int8]]
    torques: dict[str, NDArray[np.float64]]


@dataclass(frozen=True, eq=False)
class Snapshot:
    """Motion of a system; if the run ended early, its computed part.

    status, message  : how the simulation ended, as in the attributes of a response
    figures          : contents of its charts
    motion           : the class of the motion, with the evidence; None while it is not known, and
                       for signals that do not repeat
    stability        : the linear verdict, or why there is none
    braking          : torque of the brake over the recorded periods; nan where there is none
    discs            : of a machine that is not one brake on one inertia
    at_rest          : the run ended at rest
    comparison       : the same system with a conventional brake of the same radius
    """

    status: str
    message: str
    figures: MotionFigures
    motion: Motion | None
    stability: Stability | str
    braking: BrakeTorque
    discs: Discs | None = None
    at_rest: bool = False
    comparison: Snapshot | None = None


def take_snapshot(state: PageState, *, settle: bool = False) -> Snapshot:
    """Run the current system and classify its motion.

    settle : True to continue the run until the motion has settled, within limits; otherwise it is
             classified over the recorded periods of the run

    Divergence, self-locking and limits are answers. Raises ``InputError`` for a method that
    does not fit the friction law.
    """
    comparison = None
    if state.view.comparison and state.comparable:
        comparison = _one_brake(state.edited(brake="conventional"), settle)
    return replace(_one_brake(state, settle), comparison=comparison)


def _one_brake(state: PageState, settle: bool) -> Snapshot:
    run = _Run(state)
    recorded, seen = run.response()
    status = recorded.attrs["status"]
    complete = status == "completed"
    linear: Stability | str
    try:
        linear = stability(state.system, method=linearisation_of(recorded.attrs["method"]))
    except InputError as error:
        linear = str(error)
    return Snapshot(
        status=status,
        message=recorded.attrs["message"],
        figures=run.figures(one_part(recorded, state), one_part(seen, state), linear),
        motion=run.classified(recorded, settle),
        stability=linear,
        braking=run.braking(recorded, one_part(seen, state)) if complete else _NO_TORQUE,
        discs=_discs(seen, state),
        at_rest=bool(recorded.attrs.get("at_rest", False)),
    )


def _discs(response: xr.Dataset, state: PageState) -> Discs | None:
    if is_one_brake(state.system):
        return None
    velocity = response["velocity"].sel(inertia=state.inertia).to_numpy()
    part = response.isel(time=thinned(velocity, _MOST_DRAWN))

    def by_name(name: str, kind: str) -> dict[str, Any]:
        return {str(one): part[name].sel({kind: one}).to_numpy() for one in part[kind].to_numpy()}

    return Discs(
        part["time"].to_numpy(), by_name("angle", "inertia"), by_name("sticking", "contact"),
        by_name("brake_torque", "contact"),
    )  # fmt: skip


class _Run:
    def __init__(self, state: PageState) -> None:
        self.state, self.system = state, state.system
        run = dict(state.study.run)
        self.begin = run["start_time"]
        self.initial = {"initial": run["initial"]} if state.counted else {}
        self.until = {"until": run["until"]} if run.get("until") else {}
        self.options: dict[str, Any] = {
            **{name: run[name] for name in ("method", "rtol") if name in run},
            **state.limits,
        }
        self.period, self.density = state.cycle, density(state)
        # There is a spectrum where the samples resolve the free vibration.
        self.resolved = not state.counted or samples_wanted(state) <= DENSEST
        whole = math.floor(state.duration / self.period * self.density * (1.0 + 1e-12))
        self.steps = state.periods * self.density if state.counted else whole
        self.end = self._time(self.steps / self.density)
        # All of a run whose signals do not repeat.
        repeats = state.counted or self.system.period is not None
        recorded = state.recorded if repeats else math.inf
        self.first_recorded = max(self.begin, self._time(self.steps / self.density - recorded))
        self.first_shown = max(self.begin, self.end - state.window)
        # Windows begin earlier by this time [s]: rounding must not exclude the first sample.
        self.early = 0.5 * self.period / self.density

    def _time(self, periods: float) -> float:
        return float(self.begin + periods * self.period)

    def response(self) -> tuple[xr.Dataset, xr.Dataset]:
        """The whole run, sampled at its end; and the response that the charts show."""
        state, step = self.state, self.period / self.density
        length = max(state.recorded * self.density, math.ceil(state.window / step - 1e-6))
        times = self.begin + np.arange(max(self.steps - length, 0), self.steps + 1) * step
        given = {"periods": state.periods} if state.counted else {"duration": state.duration}
        whole = self._simulate(times=times, **given, **self.until)
        end = float(whole.attrs["final_time"])
        if whole.attrs["status"] == "completed" and end >= self.end - step:
            return whole, whole
        # It ended early: run again, with samples over the computed part.
        if whole.attrs["status"] in LIMITS:
            end = self.begin + _SHARE * (end - self.begin)
        duration = end - self.begin
        if not duration > 0.0:
            return whole, whole.isel(time=slice(0))
        self.first_shown = max(self.begin, end - state.window)
        span = end - self.first_shown
        count = max(_FEWEST, round(span / self.period * self.density))
        times = np.linspace(self.first_shown, end, count + 1)
        seen = self._simulate(duration=duration, times=times)
        if whole.attrs["status"] == "completed":  # at rest
            self.first_recorded = self.first_shown
            return seen.assign_attrs(at_rest=whole.attrs["at_rest"]), seen
        # Whether it reaches the instant at which the first one ended is a matter of rounding.
        return whole, seen.assign_attrs(status=whole.attrs["status"])

    def _simulate(self, **given: Any) -> xr.Dataset:
        return simulate(self.system, start_time=self.begin, **self.initial, **given, **self.options)

    def classified(self, response: xr.Dataset, settle: bool) -> Motion | None:
        """The class of the motion; None where it is not known.

        The run is continued from where its record begins; the run of a machine from its end.
        """
        state, options = self.state, dict(self.options)
        returns = self.system.machine.returns
        complete = response.attrs["status"] == "completed"
        if not state.counted:
            if not (settle and complete) or self.system.period is None:
                return None
            rule = {**evaluation_settings(state), **options}
            return motion(self.system, initial=final_state(response), **rule)
        points = np.column_stack([response["poincare_angle"], response["poincare_velocity"]])
        numbers = response["period"].to_numpy()
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
        start = _state(points[0]) if len(points) else self.initial["initial"]
        options[returns] = state.periods
        return motion(self.system, transient=state.transient, initial=start, **options)

    def figures(
        self, recorded: xr.Dataset, seen: xr.Dataset, linear: Stability | str
    ) -> MotionFigures:
        """Contents of the charts: of the last shown periods, and of the recorded ones."""
        time = seen["time"].to_numpy()
        time = time[int(np.searchsorted(time, self.first_shown - self.early)) :]
        if time.size < 2:
            seen, time = seen.isel(time=slice(0)), np.zeros(1)
        history = History.between(seen, float(time[0]), float(time[-1]))
        shown = seen.sel(time=slice(float(time[0]), float(time[-1])))
        settled = recorded["poincare_time"].to_numpy()
        settled = settled[settled >= self.first_recorded - self.early]
        complete = recorded.attrs["status"] == "completed"
        start = self.first_recorded
        if self.system.machine.period or self.state.counted:
            start = float(settled[0]) if settled.size else math.inf
        drive, release = self._speeds()
        sliding = shown.get("sliding_velocity")
        speeds = history.velocity + drive if sliding is None else sliding.to_numpy()
        fastest = float(np.abs(speeds[history.bounded]).max(initial=0.0))
        return MotionFigures(
            history=history,
            force=shown["actuation_force"].to_numpy(),
            sliding=speeds,
            phase=PhaseCurve(history, (0.0, 0.0), drive, release),
            section=PoincarePicture.of(recorded, start=start),
            spectrum=self.spectrum(recorded, complete=complete),
            torque=TorqueCurve.of(
                *self._contact(shown, linear),
                fastest,
                float(np.abs(history.brake_torque).max(initial=0.0)),
            ),
            completed=complete,
            ending=_ENDINGS.get(recorded.attrs["status"], ""),
        )

    def _speeds(self) -> tuple[float, float]:
        """Negative speed of the surface on which the brake slides, and the speed of its release.

        The former is nan where it varies.
        """
        contact = self._found_contact()
        if contact is None:
            return math.nan, math.inf
        base, actuation = number_of(contact.base_speed), contact.actuation
        if base is None or contact.b != GROUND:
            return math.nan, math.inf
        direct = not contact.normal and actuation.direct
        direct = direct and number_of(actuation.initial_force) is not None
        return 0.0 - base, actuation.release_speed if direct else math.inf

    def _found_contact(self) -> Contact | None:
        contacts = self.system.machine.contacts
        return next((one for one in contacts if one.name == (self.state.contact or one.name)), None)

    def _contact(self, shown: xr.Dataset, linear: Stability | str) -> tuple[Any, float, Any]:
        """A contact with its steady force; of a driveline the damping and verdict by direction."""
        contact, forward = self._found_contact(), getattr(linear, "forward", None)
        directions = None if forward is None else (forward, linear.backward)  # type: ignore[union-attr]
        if contact is None:
            return None, 0.0, None
        base = number_of(contact.base_speed) or 0.0
        if isinstance(contact, TorqueContact):
            return contact.on_base(base), self._damping(directions), directions
        force = number_of(contact.actuation.initial_force)
        if force is None or contact.normal or not contact.actuation.direct:
            force = float(np.abs(shown["actuation_force"].to_numpy()).max(initial=0.0))
        actuation = type(contact.actuation)(
            initial_force=force, slope=contact.actuation.slope, release=contact.actuation.release
        )
        still = contact.model_copy(update={"actuation": actuation, "base_speed": base})
        return still, self._damping(directions), directions

    def _damping(self, directions: Any) -> float:
        return float(self.system.machine.shafts[0].damping) if directions else 0.0

    def spectrum(self, response: xr.Dataset, *, complete: bool) -> SpectrumLines:
        """Spectrum of the velocity over the recorded periods; empty where there is none."""
        machine = self.system.machine
        forcing = 1.0 / self.period if self.state.counted or machine.period else 0.0
        # Shafts with gaps act for short times only.
        acting = [one for one in machine.shafts if one.gap is None]
        linear = Machine(inertias=machine.inertias, shafts=acting, joints=machine.joints)
        natural = float(natural_frequencies(linear).max(initial=0.0)) / (2.0 * math.pi)
        highest = max(_NATURALS * natural, _FORCINGS * forcing) or 1.0 / self.period
        time = response["time"].to_numpy()
        if complete and self.resolved and time.size > _FEWEST_LINES:
            start = max(self.first_recorded - self.early, float(time[0]))
            return SpectrumLines.of(spectrum(response, start=start), highest)
        acts = any(one.varies for one in self.system.signals().values())
        return SpectrumLines(
            np.empty(0), np.empty(0), highest, forcing=forcing if acts else 0.0, natural=natural
        )

    def braking(self, response: xr.Dataset, seen: xr.Dataset) -> BrakeTorque:
        """Torque of the brake over the recorded periods; of a machine from the samples shown."""
        try:
            if self.state.counted:
                return brake_torque(response, start=self.first_recorded)
        except InputError:  # samples too far apart
            return _NO_TORQUE
        time, torque = seen["time"].to_numpy(), seen["brake_torque"].to_numpy()
        if self.state.contact is None or time.size < 2:
            return _NO_TORQUE
        mean, size = (
            float(np.trapezoid(one, time) / (time[-1] - time[0])) for one in (torque, abs(torque))
        )
        return BrakeTorque(mean=mean, mean_size=size, peak=float(np.abs(torque).max()))


_NO_TORQUE = BrakeTorque(mean=math.nan, mean_size=math.nan, peak=math.nan)


def _state(point: NDArray[np.float64]) -> State:
    return float(point[0]), float(point[1])
