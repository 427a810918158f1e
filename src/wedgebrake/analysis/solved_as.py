"""Whether a system is solved as a machine, and how the returns of its motion are counted."""

from __future__ import annotations

from typing import Any, cast

from wedgebrake.model.friction import SmoothFriction
from wedgebrake.model.machine import Machine
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.model.validation import check_instance, wrong
from wedgebrake.solvers.kernels import choose_method, machine_method
from wedgebrake.solvers.machine.final_state import FinalState
from wedgebrake.solvers.smooth.solve import winds_up
from wedgebrake.solvers.task import check_state


def machine_of(system: BrakedDriveline | Machine, method: str | None = None) -> Machine | None:
    """The machine as which a system is solved; None for a driveline with its own solvers.

    Raises ``InputError`` for any other system.
    """
    if isinstance(system, Machine):
        return system
    check_instance("system", system, BrakedDriveline, "a BrakedDriveline or a Machine")
    return system.machine if _is_solved_as_machine(system, method) else None


def solver_of(system: BrakedDriveline | Machine, method: str | None) -> tuple[Machine | None, str]:
    """The machine as which a system is solved, see ``machine_of``, and the name of the method."""
    machine = machine_of(system, method)
    if machine is None:
        return None, choose_method(cast("BrakedDriveline", system), method)
    return machine, machine_method(method, machine)


def _is_solved_as_machine(system: BrakedDriveline, method: str | None) -> bool:
    """Return True for a driveline that its own solvers do not solve.

    These are drivelines without a torque, those with signals, lag, limits or sampling, and those
    with set-valued friction and ``method="smooth"``.
    """
    if not system.plain:
        return True
    if isinstance(system.friction, SmoothFriction):
        undriven = method != "exact" and system.excitation.amplitude == 0.0
        # Only the driveline's own solver ends a run in which the torque grows without limit.
        return undriven and not winds_up(system, -system.driveline.drive_speed)
    return method == "smooth" or system.excitation.amplitude == 0.0


def returns_name(system: BrakedDriveline | Machine, method: str | None = None) -> str:
    """Name of the argument that counts the returns of a motion: "periods" or "crossings"."""
    machine = machine_of(system, method)
    return "crossings" if machine is not None and machine.autonomous else "periods"


def as_machine(
    system: BrakedDriveline | Machine, initial: Any
) -> tuple[Machine, FinalState | None]:
    """The machine of a system, and the state in which its run begins."""
    if isinstance(system, Machine):
        allowed = "a final state, as returned by wb.final_state"
        if initial is not None:
            check_instance("initial", initial, FinalState, allowed)
        return system, initial
    angle, velocity = check_state("initial", (0.0, 0.0) if initial is None else initial)
    return system.machine_at(angle, velocity), None


def returns_of(
    machine: Machine | None, periods: int | None, crossings: int | None
) -> tuple[int | None, str]:
    """Number of returns of a run, given as periods or as crossings, and the name of the argument.

    machine : None for a driveline whose torque varies

    Raises ``InputError`` if the system does not have returns of this kind.
    """
    if machine is not None and machine.autonomous:
        if periods is not None:
            raise wrong(
                "periods", periods, "None for a system without varying signals, which has no"
                " period", "Give crossings, the number of returns to the section of its motion.",
            )  # fmt: skip
        return crossings, "crossings"
    if crossings is not None:
        raise wrong(
            "crossings", crossings, "None for a system with signals that vary", "Give periods."
        )
    return periods, "periods"
