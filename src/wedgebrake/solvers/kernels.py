"""The kernel that solves a system: closed form, series or stepper, chosen by the problem.

A ``Machine`` is solved by the series, also where the closed form of one inertia would apply: each
is an independent check of the other.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any, NamedTuple, cast

from wedgebrake.errors import InputError
from wedgebrake.model.friction import SetValuedFriction, SmoothFriction
from wedgebrake.model.machine import Machine
from wedgebrake.model.studies.study_run import METHODS
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.model.validation import check_choice

if TYPE_CHECKING:
    from wedgebrake.solvers.solution import Task, Trajectory


class Kernel(NamedTuple):
    """A kernel of ``simulate``.

    module : whose ``solve(system, task)`` gives the trajectory
    method : "exact" or "smooth"
    limits : the limits that it has, of rtol, max_steps and max_events
    counts : whether it counts periods of the torque, so that long runs keep their phase
    """

    module: str
    method: str
    limits: tuple[str, ...] = ("max_events",)
    counts: bool = False

    def solve(self, system: BrakedDriveline | Machine, task: Task) -> Trajectory:
        """Carry out a task; the first call imports Numba."""
        solver: Any = import_module(f"wedgebrake.solvers.{self.module}")
        found: Trajectory = solver.solve(system if self.counts else system.machine, task)
        return found


def kernel_of(system: BrakedDriveline | Machine, method: str | None) -> Kernel:
    """The kernel that simulates a system.

    Raises ``InputError`` for a method that is unknown or does not fit the friction law.
    """
    # The curve of a set-valued law is for the series.
    law = system.machine.contacts[0].friction if system.plain else None
    if not system.plain or (method == "smooth" and isinstance(law, SetValuedFriction)):
        return Kernel("machine.series", machine_method(method, system.machine))
    method = choose_method(cast("BrakedDriveline", system), method)
    if method == "exact":
        return Kernel("event_driven.solve", method, counts=True)
    return Kernel("smooth.solve", method, ("rtol", "max_steps"), counts=True)


def machine_method(method: str | None, machine: Machine) -> str:
    """Return the checked method; by default "exact" if it can solve all contacts, or "smooth"."""
    if method is not None:
        return check_choice("method", method, METHODS)
    return "exact" if all(one.piecewise_linear for one in machine.contacts) else "smooth"


def choose_method(system: BrakedDriveline, method: str | None) -> str:
    """The solver's name: the given one, checked, or the friction law's default.

    Raises ``InputError`` for one that is unknown or does not fit the friction law.
    """
    law = system.friction
    set_valued = isinstance(law, SetValuedFriction)
    if method is not None:
        check_choice("method", method, METHODS)
    if not system.plain and method is None:
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
