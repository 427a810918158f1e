"""The front door of the solvers: ``simulate``."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from wedgebrake.model.machine import Machine
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.model.validation import (
    check_choice,
    check_instance,
    check_number,
    check_whole,
    plain,
)
from wedgebrake.solvers.interrupts import interruptible
from wedgebrake.solvers.kernels import SERIES, kernel_of, method_of
from wedgebrake.solvers.solution import Task, Trajectory
from wedgebrake.solvers.task import Given, sampled, task_of

if TYPE_CHECKING:
    import xarray as xr

    from wedgebrake.solvers.machine.final_state import FinalState

_MOST_STEPS = 10**12


def simulate(
    system: BrakedDriveline | Machine,
    duration: float | None = None,
    *,
    periods: int | None = None,
    initial: tuple[float, float] | FinalState | None = None,
    start_time: float = 0.0,
    until: str | None = None,
    method: str | None = None,
    times: ArrayLike | None = None,
    samples: int | None = None,
    samples_per_period: int | None = None,
    rtol: float = 1e-9,
    max_events: int = 10_000_000,
    max_steps: int = 100_000_000,
) -> xr.Dataset:
    """The response of a braked driveline or of a machine with several inertias and contacts.

    Parameters
    ----------
    system : BrakedDriveline or Machine
        The system.
    duration : float
        Length of the run [s]; give either this or ``periods``.
    periods : int
        Length of the run in periods of a driveline's torque, or in common periods of the signals of
        a machine.
    initial : (float, float) or FinalState
        Of one inertia, angle theta [rad] and velocity theta' [rad/s] at the start; or the final
        state of another run (``wb.final_state``). Default: rest of a driveline, the initial angles
        and speeds of the inertias of a machine.
    start_time : float
        Time of the start [s]; it sets the phase of the torque. A ``FinalState`` has its own.
    until : {"rest"}
        End the run as soon as all contacts are at rest and provably stay so; ``duration`` or
        ``periods`` is then the maximum length of the run. ``attrs["at_rest"]`` is 1 if rest was
        reached; otherwise ``attrs["message"]`` says that it was not.
    method : {"exact", "smooth"}
        Default: "exact" for Coulomb, tabulated and Stribeck friction, "smooth" for smooth laws, in
        a machine if any contact has one. Friction that is set-valued at rest and varies with the
        speed is replaced by straight lines by "exact"; "smooth" uses its curve, to rounding, with
        sticks and events. With such friction and an actuation force that does not depend on the
        sliding speed alone, "smooth" is required, and is the default.
    times : array of float
        Times at which the response is wanted [s], ascending. By default they are equally spaced,
        with at least 50 in a period of the highest natural frequency of inertias and shafts and of
        the highest frequency of a signal, and one for each value of a record: for a machine 2 000
        or more, for a driveline a whole number in each period of the torque, 200 or more. More than
        200 000 are not stored by default, except 200 in each period; ``attrs["message"]`` then says
        how many are needed.
    samples : int
        Number of equally spaced times, both ends included, instead of ``times``: 2 to 50 000 000.
    samples_per_period : int
        Number of samples in each period of a driveline's torque, or in each common period of the
        signals of a machine, instead of ``times``.
    rtol : float
        Relative tolerance of "smooth" for drivelines with smooth laws, 1e-13 to 1e-2; the absolute
        tolerances are rtol times the system's own scales of angle and velocity. Other systems are
        solved to rounding.
    max_events : int
        Limit of "exact", and of "smooth" for set-valued laws.
    max_steps : int
        Limit of "smooth" for drivelines with smooth laws.

    Returns
    -------
    xarray.Dataset
        For a machine, over (``time``, ``inertia``): angle [rad], velocity [rad/s], torque [N m];
        over (``time``, ``shaft``): shaft_torque [N m]; over (``time``, ``contact``): brake_torque
        [N m], actuation_force [N], nan for one-way clutches and drag, sliding_velocity [rad/s],
        sticking; with driven bodies, over
        (``time``, ``driven``): driven_torque [N m] and driven_power [W]; over ``event`` and
        ``stick``: the events and the intervals of rest of all contacts. For a driveline the same
        over ``time``, without the dimensions of its only parts, where the torque is drive_torque;
        over ``period`` the Poincare section; and the states at the events. ``attrs["status"]`` and
        ``attrs["message"]`` describe how the run ended: divergence and self-locking are results,
        not exceptions.

    Raises
    ------
    InputError
        For arguments that are wrong or do not fit the friction law.
    """
    check_instance("system", system, BrakedDriveline | Machine, "a BrakedDriveline or a Machine")
    # NumPy's numbers as Python's, which the response can store.
    given = Given(times, *map(plain, (duration, periods, start_time, samples, samples_per_period)))
    limits = {"rtol": plain(rtol), "max_events": plain(max_events), "max_steps": plain(max_steps)}
    method = method_of(system, method)
    # A machine is solved by series also where one inertia has a kernel of its own: each is an
    # independent check of the other.
    kernel = kernel_of(system, method, driven=True) if system.view.single else SERIES
    check_limits(**limits)
    if until is not None:
        check_choice("until", until, ["rest"])
    task = task_of(system, given, initial, counts=kernel.counts)
    task = replace(
        task, method=method, until_rest=until is not None,
        limits={name: limits[name] for name in kernel.limits},
    )  # fmt: skip
    if until is None:
        return respond(system, sampled(system, task, given), kernel.solve)
    rest = _end_at_rest(system, replace(task, limits=limits))
    task = sampled(system, task, given, rest.time)
    if kernel.counts:  # and proves no rest
        task = task.ended_at(rest.time)

    def solve(*of: Any) -> Trajectory:
        return replace(kernel.solve(*of), at_rest=rest.at_rest, message=rest.message)

    return respond(system, task, solve)


class _Rest(NamedTuple):
    """End of a run until rest: its time [s], whether rest was reached, and the message on it."""

    time: float
    at_rest: bool
    message: str


def _end_at_rest(system: BrakedDriveline | Machine, task: Task) -> _Rest:
    """Find where a run until rest ends: the proof that contacts stay at rest is the series'."""
    from wedgebrake.solvers.machine import series

    task = replace(task, times=np.empty(0), recorded=None)
    found = interruptible(
        lambda: series.solve(system.machine, task), stop=lambda: task.stop.fill(True)
    )
    return _Rest(found.final.time, found.at_rest, found.message)


def respond(
    system: BrakedDriveline | Machine,
    task: Task,
    solve: Callable[[BrakedDriveline | Machine, Task], Trajectory],
) -> xr.Dataset:
    """The response of a system to a task that ``solve`` carries out; Ctrl-C stops it."""
    answer = interruptible(lambda: solve(system, task), stop=lambda: task.stop.fill(True))
    from wedgebrake.solvers.response import assemble

    return assemble(system, task, answer)


def check_limits(*, rtol: Any = 1e-9, max_events: Any = 1, max_steps: Any = 1) -> None:
    """Refuse, with ``InputError``, what no solver can work with."""
    more = " Smaller values ask for more accuracy than floating-point numbers have."
    check_number("rtol", rtol, 1e-13, 1e-2, why=more)
    check_whole("max_events", max_events, 1, _MOST_STEPS)
    check_whole("max_steps", max_steps, 1, _MOST_STEPS)
