"""The continuation problem of a system, chosen by what its equations are."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

from wedgebrake.model.friction import SetValuedFriction, SmoothFriction
from wedgebrake.model.machine import Machine
from wedgebrake.model.signals.signals import check_repeat
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.model.validation import check_instance
from wedgebrake.orbits.problems.machine_problem import MachineProblem
from wedgebrake.orbits.problems.one_inertia_problem import (
    OneInertiaProblem,
    SegmentProblem,
    StroboscopicProblem,
)
from wedgebrake.orbits.problems.problem import OrbitProblem
from wedgebrake.solvers.kernels import machine_method
from wedgebrake.solvers.simulate import check_limits
from wedgebrake.solvers.smooth.solve import winds_up

# Last parts of the names of the amplitude of the torque, and of the group that sets it.
AMPLITUDES = {"amplitude", "F0"}


def orbit_problem(
    system: BrakedDriveline | Machine,
    method: str | None = None,
    rtol: Any = 1e-10,
    over: Collection[str] = (),
) -> OrbitProblem:
    """The continuation problem of a system and a method, as for ``wb.orbit``.

    over : names of the parameters over which orbits are followed. If the amplitude of the torque
           is one of them, the orbits are those of the period of the torque, although the amplitude
           may be zero at first.

    Raises ``InputError`` for arguments with which no orbit can be found.
    """
    check_instance("system", system, BrakedDriveline | Machine, "a BrakedDriveline or a Machine")
    check_limits(rtol=rtol)
    check_repeat(system.signals())
    chosen = machine_method(method, system.machine)
    varies = not AMPLITUDES.isdisjoint(name.rpartition(".")[2] for name in over)
    kind = _of_one_inertia(system.one_inertia, method, driven=varies)
    if kind is None:
        return MachineProblem(system.named_machine, chosen, float(rtol))
    return kind(system, kind.solver, float(rtol))


def _of_one_inertia(
    line: BrakedDriveline | None, method: str | None, *, driven: bool
) -> type[OneInertiaProblem] | None:
    """The problem of a driveline whose equations are those of one inertia; None if there is none.

    driven : whether the torque counts as varying
    """
    if line is None or line.driveline.stiffness == 0.0:
        return None
    friction, driven = line.friction, driven or line.excitation.amplitude > 0.0
    if isinstance(friction, SetValuedFriction):
        exact = method != "smooth" and friction.has_nodes
        return SegmentProblem if exact and driven else None
    if method == "exact" or not isinstance(friction, SmoothFriction):
        return None
    # Only the solver of one inertia ends a run in which the torque grows without limit.
    driven = driven or winds_up(line, -line.driveline.drive_speed)
    return StroboscopicProblem if driven else None
