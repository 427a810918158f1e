"""Choice of the continuation problem for a system and a solver."""

from __future__ import annotations

from typing import Any

from wedgebrake.errors import InputError
from wedgebrake.model.machine import Machine
from wedgebrake.model.system import BrakedDriveline, check_driveline
from wedgebrake.orbits.driveline_problem import ExactDriveline, SmoothDriveline
from wedgebrake.orbits.machine_problem import MachineProblem
from wedgebrake.orbits.problem import OrbitProblem
from wedgebrake.solvers.machine.simulate import machine_method
from wedgebrake.solvers.simulate import check_limits, choose_method


def orbit_problem(
    system: BrakedDriveline | Machine, method: str | None = None, rtol: Any = 1e-10
) -> OrbitProblem:
    """The continuation problem for a system and a method, as for ``wb.orbit``.

    Raises ``InputError`` for arguments with which no orbit can be found.
    """
    if isinstance(system, Machine):
        return MachineProblem(system, machine_method(method, system), float(rtol))
    check_driveline(system)
    chosen = choose_method(system, method)
    if chosen == "ode14x":
        raise InputError(
            "method = 'ode14x': its solution chatters at a fixed step and has no derivative. Use"
            " 'exact' or 'smooth', by the friction law."
        )
    check_limits(rtol, 1e-4, 1, 1)
    kind = ExactDriveline if chosen == "exact" else SmoothDriveline
    return kind(system, chosen, float(rtol))
