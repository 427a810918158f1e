"""Proof that a machine whose contacts are at rest stays at rest.

The signals must be constant or sums of sines from now on, and the speeds of driven bodies and of
bases constant. The state is then the sum of an equilibrium, which may move with these, a steady
vibration and a free vibration. The energy of the free vibration never grows, which bounds every
guard.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wedgebrake.model.joints import joint_rows
from wedgebrake.model.machine import Machine
from wedgebrake.model.signals.signal_tables import Table
from wedgebrake.model.signals.signals import Harmonic, Orders, Product, Signal, Sum
from wedgebrake.solvers.machine.assemble import Assembled
from wedgebrake.solvers.machine.events.modes import GuardKind, select_system
from wedgebrake.solvers.machine.problem import MachineProblem, Run

_Matrix = NDArray[np.float64]
# Relative size of what is rounding: of a residual of equilibrium, and of singular values.
_ROUNDING = 1e-9


class _Steady(NamedTuple):
    """A signal from a time on: mean and sines (angular frequency, complex amplitude)."""

    mean: float
    sines: tuple[tuple[float, complex], ...]


def remains_at_rest(machine: Machine, assembled: Assembled, run: Run) -> bool:  # noqa: C901
    """Return True if no contact can leave its present rest; False too with controllers."""
    if machine.controllers:
        return False
    products = _products(assembled, run)
    if products is None:
        return False
    problem = _in_pieces(assembled.problem, run, products)
    time, n, states = float(run.clock[0]), len(machine.inertias), problem.states
    if run.modes["side"].any() or not _is_held(problem, run):
        return False
    found = [_steady(one, time) for one in assembled.signals]
    signals = [one for one in found if one is not None]
    moving = {*problem.contacts["base_input"].tolist(), *problem.driven["input"].tolist()} - {-1}
    if len(signals) < len(found) or any(signals[one].sines for one in moving):
        return False
    if problem.elements.elements.size and not _keeps_energy(problem):
        return False
    slot = select_system(assembled.problem, run)
    guards = _without(run.systems.guards[slot, : run.systems.counts[slot]], products)
    joints = joint_rows(machine)
    free = _free_directions(problem, joints)
    mean = run.z[:, 0].copy()
    for number, signal in enumerate(signals):
        mean[states + number] = signal.mean
    speeds = _constant_speeds(problem, mean, free, joints)
    if speeds is None or np.any(
        np.abs(guards[:, :n] @ speeds) > _ROUNDING * np.abs(guards[:, :n]) @ np.abs(speeds)
    ):
        return False
    steady = _equilibrium(problem, signals, (mean[:n], speeds), free)
    if steady is None:
        return False
    mean[:n], mean[n : 2 * n] = steady, speeds
    for contact, one in zip(problem.contacts, machine.contacts, strict=True):
        if contact["lag"] > 0:
            force = _steady(one.actuation.initial_force, time)
            if force is None or force.sines:
                return False
            first, dynamics = contact["state"], one.actuation.dynamics
            mean[first : first + contact["lag"]] = force.mean * dynamics.steady
    least = guards @ mean
    transient = run.z[:states, 0] - mean[:states]
    for frequency in sorted({one for signal in signals for one, _ in signal.sines}):
        shape = _vibration(problem, signals, frequency, free, len(run.z))
        if shape is None:
            return False
        least = least - np.abs(guards @ shape)
        transient = transient - shape[:states].real
    return excludes_events(run, slot, least - _reach(machine, problem, guards, transient))


def _products(assembled: Assembled, run: Run) -> dict[int, _Matrix] | None:
    """Rows of the torques of elements with a factor, by the column that they are in.

    None if a factor still varies.
    """
    problem, found = assembled.problem, {}
    for one in run.products:
        scale = _steady(assembled.signals[one["scale"]], float(run.clock[0]))
        if scale is None or scale.sines:
            return None
        line = problem.elements.lines[run.places[one["element"]]["piece"]]
        found[problem.states + int(one["input"])] = scale.mean * line
    return found


def _without(rows: _Matrix, products: dict[int, _Matrix]) -> _Matrix:
    """Rows by the states and signals alone."""
    for column, row in products.items():
        rows = rows + np.outer(rows[:, column], row)
        rows[:, column] = 0.0
    return rows


def _in_pieces(problem: MachineProblem, run: Run, products: dict[int, _Matrix]) -> MachineProblem:
    """The numbers of a machine with the present torques of its elements as those of shafts."""
    given = problem.elements
    rows = given.torques[run.places["piece"]]
    torque = _without(problem.torque + given.loads.T @ rows, products)
    for turns in given.elements["turns"][given.elements["turns"] >= 0] + problem.states:
        torque[:, -1] += torque[:, turns] * run.z[turns, 0]
        torque[:, turns] = 0.0
    return problem._replace(torque=torque)


def _keeps_energy(problem: MachineProblem) -> bool:
    """Return True if the torques at rest have a potential, and those of speeds take energy."""
    stiffness, damping = _shafts(problem)
    least = [np.linalg.eigvalsh(0.5 * (one + one.T)).min() for one in (stiffness, damping)]
    most = [_ROUNDING * np.abs(one).max() for one in (stiffness, damping)]
    potential = np.abs(stiffness - stiffness.T).max() <= most[0]
    return bool(potential and least[0] >= -most[0] and least[1] >= -most[1])


def excludes_events(run: Run, slot: int, least: _Matrix) -> bool:
    """Return True if no guard of a mode becomes zero, given the least value of each, (guards,)."""
    what = run.systems.what[slot, : len(least)]
    # As in the solver, a holding torque may exceed its limit by rounding.
    holding = what["kind"] == GuardKind.HOLDING_LIMIT
    slack = run.modes["slack"][what["contact"][holding]]
    return bool(np.all(least[holding] + slack >= 0.0) and np.all(least[~holding] > 0.0))


def _is_held(problem: MachineProblem, run: Run) -> bool:
    """Return True if every sampled actuation holds one force that it will not change."""
    for contact, queue, mode in zip(problem.contacts, run.queues, run.modes, strict=True):
        places = contact["delay"] + 1
        if contact["sampled_input"] >= 0 and (
            contact["force"] >= 0
            or mode["samples"] < places
            or np.ptp(queue[:places]) > 0.0
            or queue[0] != _rounded(contact)
        ):
            return False
    return True


def _rounded(contact: Any) -> float:
    """The force that a sampled actuation sets at rest."""
    force, step = float(contact["initial_force"]), float(contact["resolution"])
    return step * round(force / step) if step > 0.0 else force


def _inertias(problem: MachineProblem) -> _Matrix:
    """The inertias, 0 of driven bodies, (n,)."""
    free = problem.inverse > 0.0
    return np.asarray(np.where(free, 1.0 / np.where(free, problem.inverse, 1.0), 0.0))


def _shafts(problem: MachineProblem) -> tuple[_Matrix, _Matrix]:
    """Stiffness and damping of the shafts, (n, n) each."""
    n = problem.inverse.size
    return -problem.torque[:, :n], -problem.torque[:, n : 2 * n]


def _free_directions(problem: MachineProblem, joints: _Matrix) -> _Matrix:
    """(n, k) basis of the motions without sliding that the joints allow.

    joints : rows of the joints
    """
    n = problem.inverse.size
    rows = np.vstack([problem.sliding[:, n : 2 * n], joints, np.eye(n)[problem.driven["body"]]])
    sizes = np.linalg.norm(rows, axis=1, keepdims=True)
    _, sizes, basis = np.linalg.svd(rows / sizes)
    rank = int(np.sum(sizes > _ROUNDING))
    free: _Matrix = basis[rank:].T
    return free


def _constant_speeds(
    problem: MachineProblem, mean: _Matrix, free: _Matrix, joints: _Matrix
) -> _Matrix | None:
    """Speeds with driven bodies and bases, without sliding and free rotations, (n,).

    None if they wind up shafts.

    mean : (z,) with the means of the signals
    """
    n, states, driven = problem.inverse.size, problem.states, problem.driven
    given = np.where(driven["input"] < 0, driven["speed"], mean[states + driven["input"]])
    right = np.concatenate(
        [-problem.sliding[:, states:] @ mean[states:], np.zeros(len(joints)), given]
    )
    if not right.any():
        return np.zeros(n)
    rows = np.vstack([problem.sliding[:, n : 2 * n], joints, np.eye(n)[driven["body"]]])
    speeds = np.linalg.lstsq(rows, right, rcond=_ROUNDING)[0]
    stiffness, _ = _shafts(problem)
    matrix = free.T @ stiffness
    speeds = speeds - free @ np.linalg.lstsq(matrix @ free, matrix @ speeds, rcond=_ROUNDING)[0]
    winds = np.abs(matrix @ speeds) > _ROUNDING * (np.abs(matrix) @ np.abs(speeds))
    slides = np.abs(rows @ speeds - right) > _ROUNDING * (np.abs(rows) @ np.abs(speeds))
    return None if winds.any() or slides.any() else np.asarray(speeds)


def _equilibrium(
    problem: MachineProblem, signals: list[_Steady], now: tuple[_Matrix, _Matrix], free: _Matrix
) -> _Matrix | None:
    """Angles of the equilibrium without sliding, or None if there is none.

    now : angles, and speeds of the equilibrium
    """
    stiffness, damping = _shafts(problem)
    angles, speeds = now
    load, drive = problem.torque[:, -1], problem.torque[:, problem.states : -1]
    means = np.zeros(drive.shape[1])
    means[: len(signals)] = [one.mean for one in signals]
    torque = load + drive @ means - stiffness @ angles - damping @ speeds
    matrix, right = free.T @ stiffness @ free, free.T @ torque
    found = np.linalg.lstsq(matrix, right, rcond=_ROUNDING)[0]
    scale = np.abs(right).max(initial=0.0) + np.abs(load).max(initial=0.0)
    if np.abs(matrix @ found - right).max(initial=0.0) > _ROUNDING * scale:
        return None
    moved: _Matrix = angles + free @ found
    return moved


def _vibration(
    problem: MachineProblem, signals: list[_Steady], frequency: float, free: _Matrix, width: int
) -> NDArray[np.complex128] | None:
    """Complex amplitudes of z at a frequency, at the present time; None at resonance."""
    n, states = problem.inverse.size, problem.states
    shape = np.zeros(width, complex)
    for number, signal in enumerate(signals):
        shape[states + number] = sum(a for one, a in signal.sines if one == frequency)
    stiffness, damping = _shafts(problem)
    drive = problem.torque[:, states:-1]
    dynamic = (
        stiffness + 1j * frequency * damping
        - np.diag(frequency**2 * _inertias(problem))
    )  # fmt: skip
    matrix = free.T @ dynamic @ free
    right = free.T @ (drive @ shape[states:-1])
    if matrix.size:
        sizes = np.linalg.svd(matrix, compute_uv=False)
        if sizes[-1] <= _ROUNDING * sizes[0]:
            return None
        shape[:n] = free @ np.linalg.solve(matrix, right)
    shape[n : 2 * n] = 1j * frequency * shape[:n]
    return shape


def _reach(
    machine: Machine, problem: MachineProblem, guards: _Matrix, transient: _Matrix
) -> _Matrix:
    """Bound of the change of each guard by a free vibration, from its energy."""
    n = problem.inverse.size
    stiffness, _ = _shafts(problem)
    angles, speeds = transient[:n], transient[n : 2 * n]
    energy = angles @ stiffness @ angles + speeds @ (speeds * _inertias(problem))
    springs = np.linalg.pinv(stiffness, _ROUNDING)
    by_angle, by_speed = guards[:, :n], guards[:, n : 2 * n]
    gain = np.einsum("gi,ij,gj->g", by_angle, springs, by_angle)
    gain = gain + (by_speed**2 * problem.inverse).sum(axis=1)
    reach = np.sqrt(gain * max(float(energy), 0.0))
    for contact, one in zip(problem.contacts, machine.contacts, strict=True):
        if contact["lag"] > 0:
            at = slice(contact["state"], contact["state"] + contact["lag"])
            norm, rows, x = one.actuation.dynamics.norm, guards[:, at], transient[at]
            gain = np.einsum("gi,ij,gj->g", rows, np.linalg.inv(norm), rows)
            reach = reach + np.sqrt(gain * (x @ norm @ x))
    return np.asarray(reach)


def _steady(signal: Signal | float, time: float) -> _Steady | None:
    """What a signal is from a time on; None if it is neither constant nor a sum of sines."""
    if not isinstance(signal, Signal):
        return _Steady(float(signal), ())
    if not signal.varies:
        return _Steady(float(signal(time)), ())
    plain = signal.primitive()
    if isinstance(plain, Harmonic):
        rate = 2.0 * math.pi * plain.frequency
        return _sine(plain.amplitude, rate, rate * time + plain.phase)
    if isinstance(plain, Table):
        return _steady_table(plain, time)
    if isinstance(plain, Orders):
        speed = _steady(plain.speed, time)
        if speed is None or speed.sines:
            return None
        angle = float(plain.speed.integral(time))
        parts = [
            _sine(amplitude, abs(order * speed.mean), order * angle + phase)
            if order * speed.mean >= 0.0
            else _sine(-amplitude, abs(order * speed.mean), -order * angle - phase)
            for order, amplitude, phase in plain.orders
        ]
        return _sum(parts)
    found = (
        [_steady(one, time) for one in plain.signals] if isinstance(plain, Sum | Product) else []
    )
    parts = [one for one in found if one is not None]
    if isinstance(plain, Product) and any(one.mean == 0.0 and not one.sines for one in parts):
        return _Steady(0.0, ())
    if len(parts) < len(found) or not parts:
        return None
    if isinstance(plain, Sum):
        return _sum(parts)
    waves = [one for one in parts if one.sines]
    if len(waves) > 1:
        return None
    factor = math.prod(one.mean for one in parts if not one.sines)
    if not waves:
        return _Steady(factor, ())
    sines = tuple((rate, factor * amplitude) for rate, amplitude in waves[0].sines)
    return _Steady(factor * waves[0].mean, sines)


def _steady_table(table: Table, time: float) -> _Steady | None:
    """What a table is from a time on; None if it changes."""
    now = float(table(time))
    left = np.array(table.values)[np.array(table.times) > time]
    return None if table.periodic or np.any(left != now) else _Steady(now, ())


def _sine(amplitude: float, rate: float, angle: float) -> _Steady:
    """Amplitude sin(angle + rate tau), as the real part of a rotating amplitude."""
    value = amplitude * complex(math.sin(angle), -math.cos(angle))
    return _Steady(value.real, ()) if rate == 0.0 else _Steady(0.0, ((rate, value),))


def _sum(parts: list[_Steady]) -> _Steady:
    """Sum of steady signals."""
    return _Steady(
        sum(one.mean for one in parts), tuple(sine for one in parts for sine in one.sines)
    )
