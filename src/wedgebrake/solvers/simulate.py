"""The front door of the solvers: ``simulate``."""

from __future__ import annotations

import math
from collections.abc import Callable
from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from wedgebrake.errors import InputError
from wedgebrake.model.friction import SetValuedFriction, SmoothFriction
from wedgebrake.model.machine import Machine
from wedgebrake.model.studies.study_run import METHODS
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.model.validation import (
    check_choice,
    check_instance,
    check_number,
    check_whole,
    plain,
    shown,
    wrong,
)
from wedgebrake.solvers.interrupts import interruptible
from wedgebrake.solvers.solution import Clock, Task, Trajectory
from wedgebrake.solvers.times import (
    MOST_BY_DEFAULT,
    MOST_SAMPLES,
    needed_samples,
    sampling_note,
    wanted_times,
)

if TYPE_CHECKING:
    import xarray as xr

    from wedgebrake.solvers.machine.final_state import FinalState
    from wedgebrake.solvers.machine.simulate import EndAtRest

_MODULES = {"exact": "event_driven.solve", "smooth": "smooth.solve"}
_PER_PERIOD = 200  # samples in each period of the torque, at least
_MOST_STEPS = 10**12
_FARTHEST = 1e12  # of an initial angle [rad] or velocity [rad/s]
_MAX_PERIODS = 5_000_000  # half a kilobyte of events in each
_MAX_PHASE = 1e15  # periods before the start that leave the phase some digits


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
        For a driveline: angle theta [rad] and velocity theta' [rad/s] at the start, 0 by default.
        For a machine: the final state of another run (``wb.final_state``), by default the initial
        angles and speeds of its inertias.
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
        tolerances are rtol times the system's own scales of angle and velocity.
    max_events : int
        Limit of "exact", and of "smooth" for set-valued laws.
    max_steps : int
        Limit of "smooth" for drivelines with smooth laws.

    Returns
    -------
    xarray.Dataset
        For a driveline, over ``time``: angle [rad], velocity [rad/s], brake_torque, drive_torque
        [N m], sticking. Over ``period``: the Poincare section. Over ``event`` and ``stick``: the
        events and the intervals of rest. For a machine, over (``time``, ``inertia``): angle,
        velocity, torque; over (``time``, ``shaft``): shaft_torque; over (``time``, ``contact``):
        brake_torque, actuation_force [N], sliding_velocity, sticking; over ``event`` and ``stick``
        those of all contacts. ``attrs["status"]`` and ``attrs["message"]`` describe how the run
        ended: divergence and self-locking are results, not exceptions.

    Raises
    ------
    InputError
        For arguments that are wrong or do not fit the friction law.
    """
    check_one_sampling(times=times, samples=samples, samples_per_period=samples_per_period)
    # NumPy's numbers as Python's, which the response can store.
    duration, periods, start_time, samples, samples_per_period = map(
        plain, (duration, periods, start_time, samples, samples_per_period)
    )
    rtol, max_events, max_steps = map(plain, (rtol, max_events, max_steps))
    if isinstance(system, Machine):
        _refuse_for_machine(rtol=rtol, max_steps=max_steps)
        from wedgebrake.solvers.machine.simulate import in_seconds, simulate_machine

        duration, samples = in_seconds(system, duration, periods, samples, samples_per_period)
        return simulate_machine(
            system, duration, times=times, samples=samples, initial=initial,
            start_time=start_time, until=until, method=method, max_events=max_events,
        )  # fmt: skip
    check_instance("system", system, BrakedDriveline, "a BrakedDriveline or a Machine")
    # The curve of a set-valued law is for the solver of machines.
    set_valued = isinstance(system.friction, SetValuedFriction)
    if not (set_valued and method == "smooth"):
        method = choose_method(system, method)
    curved = set_valued and method == "smooth"
    check_limits(rtol=rtol, max_events=max_events, max_steps=max_steps)
    state = (0.0, 0.0) if initial is None else initial
    sampling = (times, samples, samples_per_period)
    end = None
    if until is not None:
        check_choice("until", until, ["rest"])
        longest = driveline_task(system, duration, periods, state, start_time, ((), None, None))
        end = _end_at_rest(system, longest, method, max_events)
        duration, periods = end.time - start_time, None
    task = driveline_task(system, duration, periods, state, start_time, sampling)
    limits: dict[str, Any] = {"max_events": max_events}
    as_machine = {"method": method} if curved or not system.plain else {}
    if method == "smooth" and not as_machine:
        limits = {"rtol": rtol, "max_steps": max_steps}

    def solve() -> Trajectory:
        name = "machine.driveline" if as_machine else _MODULES[method]
        solver = import_module(f"wedgebrake.solvers.{name}")  # and with it Numba
        trajectory: Trajectory = solver.solve(system, task, **limits, **as_machine)
        return trajectory

    found = driveline_response(system, task, solve, method, limits)
    if end is not None:
        found.attrs["at_rest"] = int(end.at_rest)
        found.attrs["message"] = end.message + task.note
    return found


def _end_at_rest(system: BrakedDriveline, longest: Task, method: str, max_events: int) -> EndAtRest:
    """The end of a driveline's run until rest, found with its machine."""
    from wedgebrake.solvers.machine.simulate import end_at_rest

    machine = system.machine_at(longest.angle, longest.velocity)
    return end_at_rest(machine, longest.span, method, max_events)


def driveline_response(
    system: BrakedDriveline,
    task: Task,
    solve: Callable[[], Trajectory],
    method: str,
    limits: dict[str, Any],
) -> xr.Dataset:
    """The response of a driveline, for a task that ``solve`` carries out; Ctrl-C stops it."""
    trajectory = interruptible(solve, stop=lambda: task.stop.fill(True))
    from wedgebrake.solvers.response import assemble

    options = {"initial": [task.angle, task.velocity], "start_time": task.span[0], **limits}
    found = assemble(system, trajectory, method, options)
    found.attrs["message"] += task.note
    return found


def check_one_sampling(**given: Any) -> None:
    """Raise ``InputError`` for output times that are given in two ways."""
    names = [name for name, value in given.items() if value is not None]
    if len(names) > 1:
        raise InputError(
            f"{names[0]} and {names[1]}: both given. Give one of times, samples and"
            " samples_per_period.",
            name=names[1], value=given[names[1]], allowed=f"left out with {names[0]}",
        )  # fmt: skip


def _refuse_for_machine(**given: Any) -> None:
    """Raise ``InputError`` for an argument of drivelines, which does not apply to a machine."""
    for name, value in given.items():
        if value != (simulate.__kwdefaults__ or {})[name]:
            way_out = "Its solver has neither a tolerance nor a limit of steps."
            raise wrong(name, value, "left out for a machine", way_out)


def choose_method(system: BrakedDriveline, method: str | None) -> str:
    """The solver's name: the given one, checked, or the friction law's default.

    Raises ``InputError`` for one that is unknown or does not fit the friction law.
    """
    law = system.friction
    set_valued = isinstance(law, SetValuedFriction)
    if method is not None:
        check_choice("method", method, METHODS)
    if not system.plain and method is None:
        from wedgebrake.solvers.machine.simulate import machine_method

        return machine_method(None, system.machine)
    if method is None:
        method = "exact" if set_valued else "smooth"
    if method == "exact" and isinstance(law, SetValuedFriction) and not law.has_nodes:
        law.nodes()  # raises the error
    fits = set_valued or method != "exact"
    laws, other, kind = "CoulombFriction or TabulatedFriction", "smooth", "Coulomb"
    if method == "smooth":
        fits = isinstance(law, SmoothFriction)
        laws, other, kind = "SmoothedFriction or CustomFriction", "exact", "Smoothed"
    if not fits:
        way_out = f"method={other!r}, or friction of kind {kind.lower()!r} (wb.{kind}Friction)"
        if set_valued:
            way_out = f"{way_out}, or system.machine, whose method 'smooth' takes any law"
        raise InputError(
            f"method = {method!r}: needs {laws}, not {type(law).__name__}. Use {way_out}."
        )
    return method


def _clock(system: BrakedDriveline, duration: float | None) -> Clock:
    """The clock of a run: the period of the torque or, without one, a tenth of the duration."""
    if system.plain:
        return Clock(system.excitation.angular_frequency)
    period = system.excitation.period
    if not period and duration is None:
        raise InputError(
            "periods: must be None, as the torque has no period. Give duration, in seconds."
        )
    if not period:
        period = 0.1 * check_number("duration", duration, 0.0, 1e12) or 1.0
    return Clock(2.0 * math.pi / period)


def driveline_task(
    system: BrakedDriveline,
    duration: float | None,
    periods: int | None,
    initial: tuple[float, float] | FinalState,
    start_time: float,
    sampling: tuple[ArrayLike | None, int | None, int | None],
) -> Task:
    """The task of a driveline's solver, from the arguments of ``simulate``.

    sampling : times, samples and samples_per_period

    Raises ``InputError`` for arguments that are wrong.
    """
    if (duration is None) == (periods is None):
        raise InputError(
            f"duration = {duration!r} and periods = {periods!r}: give exactly one of them,"
            " for example duration=25.0 (seconds) or periods=250 (of the torque)."
        )
    clock = _clock(system, duration)
    check_number("start_time", start_time, 0.0, min(1e12, _MAX_PHASE * clock.period))
    angle, velocity = check_state("initial", initial)
    number, rest = clock.split(start_time)
    start = (int(number), float(rest))
    if periods is not None:
        periods = check_whole("periods", periods, 1, _MAX_PERIODS)
        end = (start[0] + periods, start[1])
    else:
        assert duration is not None  # noqa: S101 - one of the two is given, checked above
        check_number(
            "duration", duration, 0.0, _MAX_PERIODS * clock.period,
            why=" It is in seconds, at most 5000000 periods of the torque at once; go on from the"
            " final state with initial and start_time.",
        )  # fmt: skip
        number, rest = clock.split(start_time + duration)
        end = (int(number), float(rest))
    stop = float(clock.join(*end))
    if duration is not None and not system.plain:
        stop = start_time + duration  # exactly, as a recorded signal may end there
    times, samples, per_period = sampling
    note = ""
    if times is not None:
        wanted = wanted_times(times, start_time, stop)
    elif samples is not None:
        count = check_whole("samples", samples, 2, MOST_SAMPLES)
        wanted = np.linspace(start_time, stop, count)
    else:
        length = (stop - start_time) / clock.period  # in periods
        if per_period is None:
            needed = needed_samples(system, start_time, stop)
            dense = min(needed, MOST_BY_DEFAULT) / length if length > 0.0 else 0.0
            per_period = max(_PER_PERIOD, math.ceil(min(dense, MOST_SAMPLES)))
            note = sampling_note(needed, math.ceil(per_period * length))
        check_whole("samples_per_period", per_period, 1, MOST_SAMPLES)
        count = max(1, math.ceil(length * per_period - 1e-6))
        if count > MOST_SAMPLES:
            raise InputError(
                f"samples_per_period = {per_period}: would give {count} samples, at most"
                f" {MOST_SAMPLES}. Lower it, shorten the run, or give samples or times."
            )
        wanted = np.linspace(start_time, stop, count + 1)
    return Task(clock, start, end, (start_time, stop), angle, velocity, wanted, note)


def check_limits(*, rtol: Any = 1e-9, max_events: Any = 1, max_steps: Any = 1) -> None:
    """Refuse, with ``InputError``, what no solver can work with."""
    more = " Smaller values ask for more accuracy than floating-point numbers have."
    check_number("rtol", rtol, 1e-13, 1e-2, why=more)
    check_whole("max_events", max_events, 1, _MOST_STEPS)
    check_whole("max_steps", max_steps, 1, _MOST_STEPS)


def check_state(name: str, state: Any) -> tuple[float, float]:
    """A state as two floats; raises ``InputError`` for anything else."""
    if not isinstance(state, tuple | list) or len(state) != 2:
        raise InputError(
            f"{name} = {shown(state)}: must be two numbers, angle [rad] and velocity [rad/s]."
        )
    angle = check_number(f"{name}[0]", state[0], -_FARTHEST, _FARTHEST)
    return angle, check_number(f"{name}[1]", state[1], -_FARTHEST, _FARTHEST)
