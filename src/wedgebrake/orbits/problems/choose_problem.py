"""Choice of the system whose orbits are sought, and of its continuation problem."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

from wedgebrake.analysis.solved_as import machine_of
from wedgebrake.model.machine import Machine
from wedgebrake.model.signals.signals import check_repeat
from wedgebrake.model.system import BrakedDriveline, check_driveline
from wedgebrake.model.validation import check_instance
from wedgebrake.orbits.problems.driveline_problem import ExactDriveline, SmoothDriveline
from wedgebrake.orbits.problems.machine_problem import MachineProblem
from wedgebrake.orbits.problems.problem import OrbitProblem
from wedgebrake.solvers.kernels import choose_method, machine_method
from wedgebrake.solvers.simulate import check_limits

# The amplitude of the torque, and the group that sets it.
_AMPLITUDES = {"amplitude", "F0"}


def followed_system(
    system: BrakedDriveline | Machine, method: str | None = None, over: Collection[str] = ()
) -> BrakedDriveline | Machine:
    """The system whose orbits are sought: the machine of a driveline that only it can solve.

    These are drivelines with signals, lag, limits or sampling, those without a torque, and those
    with set-valued friction and ``method="smooth"``. The machine has the parameters and groups of
    the driveline.

    over : names of the parameters over which orbits are followed. If the amplitude of the torque
           is one of them, the orbits are those of the period of the torque.

    Raises ``InputError`` for signals that neither repeat nor are constant.
    """
    if isinstance(system, Machine):
        return system
    check_instance("system", system, BrakedDriveline, "a BrakedDriveline or a Machine")
    check_repeat(system.signals())
    driven = system
    if system.plain and not _AMPLITUDES.isdisjoint(over):
        driven = system.replace(amplitude=1.0)
    own = system.plain and machine_of(driven, method) is None
    return system if own else system.varied_machine_at(0.0, 0.0)


def orbit_problem(
    system: BrakedDriveline | Machine, method: str | None = None, rtol: Any = 1e-10
) -> OrbitProblem:
    """The continuation problem for a ``followed_system`` and a method, as for ``wb.orbit``.

    Raises ``InputError`` for arguments with which no orbit can be found.
    """
    check_limits(rtol=rtol)
    if isinstance(system, Machine):
        return MachineProblem(system, machine_method(method, system), float(rtol))
    check_driveline(system)
    chosen = choose_method(system, method)
    kind = ExactDriveline if chosen == "exact" else SmoothDriveline
    return kind(system, chosen, float(rtol))
