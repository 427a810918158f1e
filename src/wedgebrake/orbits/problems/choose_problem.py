"""The continuation problem of a system, chosen by what its equations are."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

import numpy as np

from wedgebrake.analysis.machine_motion.coordinates import coordinates
from wedgebrake.model.friction import SmoothFriction
from wedgebrake.model.machine import Machine
from wedgebrake.model.machine_matrices import (
    RANK,
    controlled_angles,
    normal_rows,
    shaft_matrices,
)
from wedgebrake.model.signals.signals import check_repeat
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.model.validation import check_instance, wrong
from wedgebrake.orbits.problems.machine_problem import MachineOrbitProblem
from wedgebrake.orbits.problems.one_inertia_problem import (
    SegmentProblem,
    StroboscopicProblem,
)
from wedgebrake.orbits.problems.problem import OrbitProblem
from wedgebrake.solvers.kernels import kernel_of, method_of
from wedgebrake.solvers.simulate import check_limits

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
    _check_driven(system.machine)
    chosen = method_of(system, method)
    varies = not AMPLITUDES.isdisjoint(name.rpartition(".")[2] for name in over)
    line = kernel_of(system, chosen, driven=varies).line
    # Without a spring, angles of orbits are not isolated.
    if line is None or line.driveline.stiffness == 0.0:
        return MachineOrbitProblem(system, chosen, float(rtol))
    kind = StroboscopicProblem if isinstance(line.friction, SmoothFriction) else SegmentProblem
    return kind(system, kind.solver, float(rtol))


def _check_driven(machine: Machine) -> None:
    """Raise ``InputError`` for a driven body whose rotation winds up a part: no orbit closes."""
    if not machine.driven:
        return
    n, carried = len(machine.inertias), coordinates(machine).carried
    angles = [shaft_matrices(machine)[0], normal_rows(machine)[:, :n], controlled_angles(machine)]
    means = np.array([one.mean_speed(machine.period or 1.0) for one in machine.driven])
    winds = [np.abs(rows) @ np.abs(carried) for rows in angles], [rows @ carried for rows in angles]
    sizes, sums = (
        np.vstack(one) * scale for one, scale in zip(winds, (np.abs(means), means), strict=True)
    )
    # Bodies that turn together wind up nothing.
    together = np.all(np.abs(sums.sum(axis=1)) <= RANK * sizes.sum(axis=1))
    for one, size, total in zip(machine.driven, sizes.T, np.abs(sums).T, strict=True):
        if not together and np.any(total > RANK * size):
            raise wrong(
                f"{one.name}.speed", one.speed,
                "a signal with a mean of 0 for orbits of this machine",
                "Otherwise the angle of the body grows, and with it the twist of a part between the"
                " body, or what it carries along, and the ground or another driven body. Use"
                " wb.simulate.",
            )  # fmt: skip
