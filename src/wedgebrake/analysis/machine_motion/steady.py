"""Proof that a motion ends in steady sliding, in steady rotation, at rest or as free vibration.

Between events a machine without varying signals is linear. Its state is then the sum of an
equilibrium and modes of vibration. If none of these grows, the sum of their sizes bounds every
guard. If no guard can reach zero, the modes of the contacts never change again.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import null_space

from wedgebrake.analysis.machine_motion.coordinates import Coordinates
from wedgebrake.arrays import FloatArray
from wedgebrake.solvers.machine.events.curves import curve_gain
from wedgebrake.solvers.machine.events.modes import select_system
from wedgebrake.solvers.machine.problem import MachineProblem, Run
from wedgebrake.solvers.machine.rest import excludes_events

ComplexArray = NDArray[np.complex128]
# Relative size below which rates count as zero: those of modes, and of the state and its guards.
_CONSTANT = 1e-9
# Relative size of a singular value that is rounding.
_RANK = 1e-10
# Relative size of a rate that is the rounding of terms which cancel.
_CANCELLED = 1e-13
# Largest condition number of the shapes of modes.
_CONDITION = 1e8


class Steady(NamedTuple):
    """State to which a motion tends.

    sliding   : (m,) sliding speed of each contact, 0 at rest [rad/s]
    torque    : (m,) brake torque on its first inertia [N m]
    states    : (states,)
    ringing   : size of the undamped vibration that remains [rad/s]
    exponents : (p,) Lyapunov exponents, descending; -inf for each contact at rest [1/s]
    """

    sliding: FloatArray
    torque: FloatArray
    states: FloatArray
    ringing: float
    exponents: FloatArray


def _linearized(problem: MachineProblem, run: Run, slot: int) -> tuple[FloatArray, FloatArray]:
    """Present state with its inputs, (z,), and the Jacobian of its rates.

    The torques of contacts that slide on curves are inputs; their values are those of the last
    cell.
    """
    states, z = problem.states, run.z[:, 0].copy()
    slopes = run.systems.rates[slot, :, :states].copy()
    for number in run.curves["contact"]:
        mode, contact = run.modes[number], problem.contacts[number]
        if mode["side"] == 0:
            continue
        line, place = problem.lines[contact["first_line"] + mode["line"]], states + contact["curve"]
        sliding, force = problem.sliding[number], run.systems.force[slot, number]
        gain, rise = curve_gain(line, mode["side"], sliding @ z)
        z[place] = -gain * (force @ z)
        torque = -rise * (force @ z) * sliding - gain * force
        slopes += np.outer(run.systems.rates[slot, :, place], torque[:states])
    return z, slopes


class FreeVibration(NamedTuple):
    """Free vibration in a mode of the contacts, in which those at rest do not move.

    moves  : (states, q) deviations of the state that are possible
    rates  : (q, z) rates of their coordinates
    values, shapes : (q,), (q, q) eigenvalues [1/s] and eigenvectors
    still  : (q,) whether an eigenvalue is zero
    lasting : (q,) whether a vibration does not decay
    """

    moves: FloatArray
    rates: FloatArray
    values: ComplexArray
    shapes: ComplexArray
    still: NDArray[np.bool_]
    lasting: NDArray[np.bool_]


def _vibration(
    rates: FloatArray, slopes: FloatArray, held: FloatArray, space: Coordinates
) -> FreeVibration | None:
    """Free vibration, None if it grows or its eigenvectors nearly coincide.

    rates  : (states, z) of the states; slopes: (states, states) their derivatives
    held   : (k, p) sliding speeds of the contacts at rest, over the scaled coordinates
    """
    basis = null_space(held, rcond=_RANK) if held.size else np.eye(space.size)
    inwards, moves = basis.T @ space.to, space.back @ basis
    matrix = inwards @ slopes @ moves
    # What the contacts at rest hold cancels, up to rounding.
    matrix[np.abs(matrix) <= _CANCELLED * (np.abs(inwards) @ np.abs(slopes) @ np.abs(moves))] = 0.0
    values, shapes = np.linalg.eig(matrix)
    rounding = _CONSTANT * float(np.abs(matrix).max(initial=0.0))
    if values.size and (np.any(values.real > rounding) or np.linalg.cond(shapes) > _CONDITION):
        return None
    still = np.abs(values) <= rounding
    lasting = ~still & (values.real >= -rounding)
    return FreeVibration(moves, inwards @ rates, values, shapes, still, lasting)


Known = dict[bytes, FreeVibration | None]
"""Free vibrations that are known, by the mode of the contacts."""


def steady_state(
    problem: MachineProblem, run: Run, space: Coordinates, known: Known
) -> Steady | None:
    """State to which a motion tends without another event; None if this is not proved.

    problem : problem of a machine without varying signals and controllers
    known   : of the same problem
    """
    slot, states = select_system(problem, run), problem.states
    systems = run.systems
    z, slopes = _linearized(problem, run, slot)
    # Deviations in which the contacts at rest do not move.
    resting = problem.sliding[run.modes["side"] == 0]
    held = resting[:, :states] @ space.back
    key = systems.keys[slot].tobytes()
    if run.curves.size or key not in known:
        known[key] = _vibration(systems.rates[slot], slopes, held, space)
    free = known[key]
    if free is None:
        return None
    moves, rates, values, shapes, still, lasting = free
    # Their sliding speeds are zero, up to rounding.
    if held.size:
        z[:states] -= space.back @ np.linalg.pinv(held) @ (resting @ z)
    # The deviation u from now on, u' = matrix u + drive, as a sum of modes.
    forces = np.linalg.solve(shapes, (rates @ z).astype(complex))
    if np.any(np.abs(forces[still]) > _CONSTANT * (np.abs(rates) @ np.abs(z)).max(initial=0.0)):
        return None
    transient = np.zeros_like(forces)
    transient[~still] = forces[~still] / values[~still]
    guards = systems.guards[slot, : systems.counts[slot]]
    reaches = guards[:, :states] @ moves @ (shapes * transient)
    least = guards @ z - reaches.sum(axis=1).real - np.abs(reaches).sum(axis=1)
    if not excludes_events(run, slot, least):
        return None
    ringing = float(np.linalg.norm(shapes[:, lasting] @ transient[lasting]))
    end = z.copy()
    end[:states] -= (moves @ (shapes @ transient)).real
    sliding = np.where(run.modes["side"] == 0, 0.0, problem.sliding @ end)
    exponents = np.sort(np.where(still | lasting, 0.0, values.real))[::-1]
    lost = np.full(space.size - values.size, -np.inf)
    return Steady(
        sliding, systems.contact[slot] @ end, end[:states], ringing,
        np.concatenate([exponents, lost]),
    )  # fmt: skip


def is_locked(problem: MachineProblem, run: Run) -> bool:
    """Return True if all contacts stay at rest for ever while moving bases wind up shafts.

    All speeds are constant, and no guard approaches zero.
    """
    if run.modes["side"].any():
        return False
    slot, states, n = select_system(problem, run), problem.states, problem.inverse.size
    rates, z = run.systems.rates[slot], run.z[:, 0]
    changes = rates @ z
    accelerates = np.abs(changes[n:]) > _CONSTANT * (np.abs(rates[n:]) @ np.abs(z))
    guards = run.systems.guards[slot, : run.systems.counts[slot], :states]
    approach = guards @ changes < -_CONSTANT * (np.abs(guards) @ np.abs(changes))
    return not (accelerates.any() or approach.any())
