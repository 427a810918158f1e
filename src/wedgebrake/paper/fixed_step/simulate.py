"""``ode14x``: the response as the paper computed it."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from numpy.typing import ArrayLike

from wedgebrake.model.signals.signals import Signal
from wedgebrake.model.system import BrakedDriveline, is_sine
from wedgebrake.model.validation import check_instance, check_number, plain, wrong
from wedgebrake.solvers.simulate import check_limits, respond
from wedgebrake.solvers.solution import Task, Trajectory
from wedgebrake.solvers.task import Given, sampled, task_of

if TYPE_CHECKING:
    import xarray as xr

    from wedgebrake.solvers.machine.final_state import FinalState

# Fields of an actuation that delay, limit or sample the force.
_DELAYS_OR_BOUNDS = ("lag", "frequency", "limits", "sample_time")


def ode14x(
    system: BrakedDriveline,
    duration: float | None = None,
    *,
    periods: int | None = None,
    initial: tuple[float, float] | FinalState | None = None,
    start_time: float = 0.0,
    times: ArrayLike | None = None,
    samples: int | None = None,
    samples_per_period: int | None = None,
    step: float = 1e-4,
    max_steps: int = 100_000_000,
) -> xr.Dataset:
    """The response by the fixed-step scheme of Chen and Xi (2014), including its errors.

    The scheme is Simulink's ODE14x: linearly implicit Euler, extrapolated to order 4, without error
    control and without events (docs/numerics.md, "The paper's solver"). Coulomb friction is
    replaced by a banded law, equations (16) to (20), in which static friction has no part. Use it
    to reproduce the paper's results; ``wb.simulate`` is faster and accurate.

    Parameters
    ----------
    system : BrakedDriveline
        The system, with one sine as its torque and smoothed, custom or Coulomb friction.
    duration, periods, initial, start_time, times, samples, samples_per_period
        As in ``wb.simulate``.
    step : float
        Fixed step [s], 1e-9 to 1; in the paper 1e-4.
    max_steps : int
        Number of steps after which the run ends.

    Returns
    -------
    xarray.Dataset
        As returned by ``wb.simulate`` for a driveline, with ``attrs["method"] = "ode14x"``. As the
        velocity never rests, sticks are passages through a band of sliding speeds that last longer
        than 1 % of a period of the torque: the stick band of smooth friction, or 1e-4 rad/s on both
        sides of rest.

    Raises
    ------
    InputError
        For invalid arguments, and for any other system or friction law.
    """
    check_instance(
        "system", system, BrakedDriveline, "a BrakedDriveline, one inertia with one brake"
    )
    _check(system)
    given = Given(times, *map(plain, (duration, periods, start_time, samples, samples_per_period)))
    task = task_of(system, given, initial, counts=True)
    check_number("step", step, 1e-9, 1.0)
    check_limits(max_steps=max_steps)
    limits = {"step": plain(step), "max_steps": plain(max_steps)}
    task = replace(sampled(system, task, given), method="ode14x", limits=limits)

    def solve(_: Any, task: Task) -> Trajectory:
        from wedgebrake.paper.fixed_step import scheme  # and with it Numba

        return scheme.solve(system, task)

    return respond(system, task, solve)


def _check(system: BrakedDriveline) -> None:
    """Raise ``InputError`` for signals and for a force that does not act at once."""
    way_out, actuation = "Use wb.simulate, which takes every system.", system.actuation
    if not is_sine(system.excitation):
        allowed = "a HarmonicTorque without further orders here"
        raise wrong("excitation", system.excitation, allowed, way_out)
    numbers: dict[str, float | Signal] = {
        "driveline.drive_speed": system.driveline.drive_speed,
        "actuation.initial_force": actuation.initial_force,
    }
    for name, value in numbers.items():
        if isinstance(value, Signal):
            raise wrong(name, value, "a number here", way_out)
    for name in _DELAYS_OR_BOUNDS:
        given = getattr(actuation, name)
        if given != type(actuation).model_fields[name].default:
            raise wrong(f"actuation.{name}", given, "left out here", way_out)
