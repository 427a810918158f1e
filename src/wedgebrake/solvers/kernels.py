"""The kernel that solves a problem: closed form, stepper or series.

One inertia on one sine has two kernels of its own: a closed form with piecewise-linear friction,
and a stepper with smooth friction. All other machines are solved by series.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any, NamedTuple

from wedgebrake.model.characteristic import has_straight_lines
from wedgebrake.model.friction import SetValuedFriction, SmoothFriction
from wedgebrake.model.machine import Machine
from wedgebrake.model.studies.study_run import METHODS
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.model.system_base import own_names
from wedgebrake.model.validation import check_choice

if TYPE_CHECKING:
    from wedgebrake.solvers.solution import Task, Trajectory


class Kernel(NamedTuple):
    """A kernel for a problem.

    module : whose ``solve(system, task)`` gives the trajectory
    line   : the one inertia, for its kernels, which count periods of the torque, so that long runs
             keep their phase; None for the series
    limits : the limits that it has, of rtol, max_steps and max_events
    """

    module: str
    line: BrakedDriveline | None = None
    limits: tuple[str, ...] = ("max_events",)

    @property
    def counts(self) -> bool:
        """Whether it counts periods of the torque."""
        return self.line is not None

    def solve(self, system: BrakedDriveline | Machine, task: Task) -> Trajectory:
        """Carry out a task; the first call imports Numba."""
        solver: Any = import_module(f"wedgebrake.solvers.{self.module}")
        found: Trajectory = solver.solve(self.line or system.machine, task)
        return found


SERIES = Kernel("machine.series")


def kernel_of(system: BrakedDriveline | Machine, method: str, *, driven: bool = False) -> Kernel:
    """The kernel for a system and a method of ``method_of``.

    driven : whether the torque counts as varying although its amplitude may be zero
    """
    line = system.one_inertia
    if line is None:
        return SERIES
    law, driven = line.friction, driven or line.excitation.amplitude > 0.0
    if method == "exact":
        closed = driven and isinstance(law, SetValuedFriction) and law.has_nodes
        return Kernel("event_driven.solve", line) if closed else SERIES
    if not isinstance(law, SmoothFriction):  # its curve is for the series
        return SERIES
    if not driven:
        from wedgebrake.solvers.smooth.solve import winds_up

        # Only the stepper ends a run in which the torque grows without limit.
        driven = winds_up(line, -line.driveline.constant_speed)
    return Kernel("smooth.solve", line, ("rtol", "max_steps")) if driven else SERIES


def method_of(system: BrakedDriveline | Machine, method: str | None) -> str:
    """The checked method; by default "exact" if it can solve all contacts, or "smooth".

    Raises ``InputError`` for a method that is unknown or does not fit the friction laws.
    """
    contacts = system.machine.contacts
    # The closed form takes any force.
    closed = system.view.single and kernel_of(system, "exact", driven=True) is not SERIES
    if method is None:
        exact = closed or all(one.piecewise_linear for one in contacts)
        return "exact" if exact else "smooth"
    check_choice("method", method, METHODS)
    if method == "exact" and not closed:
        with own_names(system):
            for one in contacts:
                has_straight_lines(one.name, one.friction, one.actuation, "smooth")
    return method
