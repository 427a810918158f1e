"""The cycle of an orbit: fundamentals of its speeds, energy and damping of its contacts."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wedgebrake.analysis.responses.machine_series import MachineSeries, machine_series
from wedgebrake.analysis.responses.repeat import solved
from wedgebrake.arrays import FloatArray
from wedgebrake.model.machine_matrices import shaft_rows
from wedgebrake.orbits.curves import OrbitSolution
from wedgebrake.solvers.machine.final_state import FinalState
from wedgebrake.solvers.machine.solve import MachineTask

_MOST_EVENTS = 10**6
# Share of the largest magnitude below which a fundamental is rounding.
_ROUNDING = 1e-12


class Cycle(NamedTuple):
    """One return of an orbit: a period of the torque, of a limit cycle its own.

    reference : torque, base or inertia to which the phases refer
    angle_fundamental, angle_phase : (inertias,) of the angles [rad]
    twist_fundamental, twist_phase : (shafts,) of the twists q_a - ratio q_b [rad]
    friction_heat      : (contacts,) [J]
    equivalent_damping : (contacts,) viscous damping [N m s/rad]; nan where nothing slides
    """

    reference: str
    angle_fundamental: FloatArray
    angle_phase: FloatArray
    twist_fundamental: FloatArray
    twist_phase: FloatArray
    friction_heat: FloatArray
    equivalent_damping: FloatArray


def cycle_of(orbit: OrbitSolution) -> Cycle:
    """Integrals over an orbit, to rounding.

    The fundamental has the frequency of the returns, of which an orbit of several periods has as
    many. With s the sliding speed, s_0 its mean, S the amplitude of its fundamental and tau the
    friction torque against it, the equivalent damping is

        c = omega int tau (s - s_0) dt / (pi S^2)

    over a return: the viscous damper that takes the same energy from a harmonic vibration. It is
    negative where friction feeds the vibration.
    """
    machine, initial = orbit.system.machine, orbit.initial
    if not isinstance(initial, FinalState):
        machine, initial = machine.started_at(*initial), None
    start = 0.0 if initial is None else initial.time
    task = MachineTask(
        start, start + orbit.period, np.empty(0), initial,
        until_rest=False, max_events=_MOST_EVENTS, method=orbit.problem.method,
    )  # fmt: skip
    motion = machine_series(machine, task, solved(machine, task))
    omega = 2.0 * math.pi * orbit.order / orbit.period
    speeds, sliding = (_fundamental(motion, one, omega) for one in (motion.speed, motion.sliding))
    reference, direction = _reference(motion, omega, speeds)
    angles = speeds / (1j * omega * direction)
    twists = shaft_rows(machine) @ angles
    swing = motion.sliding - motion.integral(motion.sliding).sum(axis=0) / orbit.period
    taken = motion.integral(-motion.torque * swing).sum(axis=0) / orbit.order
    slides = np.abs(sliding) > _ROUNDING * np.max(np.abs(motion.speed), initial=0.0)
    squares = np.where(slides, math.pi * np.abs(sliding) ** 2, np.nan)
    return Cycle(
        reference, np.abs(angles), np.angle(angles), np.abs(twists), np.angle(twists),
        motion.integral(motion.power).sum(axis=0) / orbit.order, omega * taken / squares,
    )  # fmt: skip


def _fundamental(motion: MachineSeries, values: FloatArray, omega: float) -> NDArray[np.complex128]:
    """Fundamentals a of quantities at the nodes, whose part is Re(a exp(i omega t)): (k,)."""
    turning = np.exp(-1j * omega * motion.times)[..., None]
    duration = float(motion.length.sum())
    parts = [motion.integral(part * values).sum(axis=0) for part in (turning.real, turning.imag)]
    return np.asarray(2.0 / duration * (parts[0] + 1j * parts[1]))


def _reference(
    motion: MachineSeries, omega: float, speeds: NDArray[np.complex128]
) -> tuple[str, complex]:
    """What the phases refer to, by name, and its direction, of magnitude 1.

    This is the first inertia on which a torque of this frequency acts; otherwise the first base of
    a contact that moves with this frequency; otherwise the angle of the first driven body that
    does so, or else of the inertia that moves most.
    """
    machine = motion.machine
    for what, parts, values in (
        ("torque on", machine.inertias, motion.external),
        ("base of", machine.contacts, motion.base),
    ):
        found = _fundamental(motion, values, omega)
        acts = np.abs(found) > _ROUNDING * np.max(np.abs(values), initial=0.0)
        if acts.any():
            first = int(np.argmax(acts))
            return f"{what} {parts[first].name}", complex(found[first] / abs(found[first]))
    sizes, driven = np.abs(speeds), speeds.size - len(machine.driven)
    given = np.flatnonzero(sizes[driven:] > _ROUNDING * np.max(np.abs(motion.speed), initial=0.0))
    most = driven + int(given[0]) if given.size else int(np.argmax(sizes))
    size = sizes[most]
    return f"angle of {machine.inertias[most].name}", speeds[most] / (1j * size) if size else 1.0
