"""The powers of all parts of a machine, whose integrals are the work in an energy balance."""

from __future__ import annotations

import numpy as np

from wedgebrake.arrays import FloatArray
from wedgebrake.model.elements import elements
from wedgebrake.model.machine import Machine
from wedgebrake.model.machine_matrices import masses, shaft_rows
from wedgebrake.solvers.machine.assemble import Assembled
from wedgebrake.solvers.machine.problem import MachineProblem
from wedgebrake.solvers.machine.trajectory.observers import PowerRows


def friction_rows(problem: MachineProblem) -> PowerRows:
    """Rows of the powers of contacts, which are the first of ``power_rows``."""
    count, width = problem.sliding.shape
    none = np.full(count, -1)
    return PowerRows(np.zeros((count, width)), -problem.sliding, np.arange(count), none, none)


def power_rows(machine: Machine, assembled: Assembled) -> PowerRows:  # noqa: C901
    """Rows of the powers of contacts, bases, shafts, torques, controllers and drives.

    The powers are in this order, each over all parts of its kind. Those of driven bodies, without
    contacts, are over the bodies; then those of the elements, over (elements, bodies), and with
    joints those of the contacts and of the controllers with torques, in the same way.
    """
    problem, machine = assembled.problem, machine.machine
    n, states, count = len(machine.inertias), problem.states, len(machine.contacts)
    loops = problem.controllers.records
    parts = 2 * count + len(machine.shafts) + len(machine.torques) + loops.size
    driven = problem.driven["body"]
    # Joints pass torques on to driven bodies: with these shares, those on all bodies.
    shares = np.eye(n)[:, driven]
    if problem.joints.project.size:
        shares = problem.joints.project[:, driven]
    given = (problem.elements.loads @ shares).ravel()
    passed, steered, acting = np.zeros(0), np.zeros(0), np.flatnonzero(loops["inertia"] >= 0)
    if problem.joints.project.size:
        passed = (problem.sliding[:, n : 2 * n] @ shares).ravel()
        steered = shares[loops["inertia"][acting]].ravel()
    left, right = np.zeros((2, parts, problem.torque.shape[1]))
    contact, element, controller = np.full((3, parts), -1)
    contact[: 2 * count] = [*range(count), *range(count)]
    right[:count] = right[count : 2 * count] = friction_rows(problem).right
    right[count : 2 * count, : 2 * n] = 0.0  # of the base alone
    for row, shaft, twist in zip(
        range(2 * count, parts), machine.shafts, shaft_rows(machine), strict=False
    ):
        if shaft.law is None:
            left[row, n : 2 * n] = shaft.damping * twist
        right[row, n : 2 * n] = twist
    first = 2 * count + len(machine.shafts)
    starts = {"shaft": 2 * count, "torque": first}
    for row, (torque, number) in enumerate(
        zip(machine.torques, assembled.torques, strict=True), first
    ):
        if number >= 0:
            left[row, states + number] = 1.0
        elif torque.over_time is not None:
            left[row, -1] = float(torque.over_time(problem.start_time))
        right[row, n + machine.index(torque.on)] = 1.0
    for number, loop in enumerate(loops):
        if loop["inertia"] >= 0:
            row = parts - loops.size + number
            controller[row], right[row, n + loop["inertia"]] = number, 1.0
    for number, one in enumerate(elements(machine)):
        row = starts[one.kind] + one.number
        element[row], right[row, n : 2 * n] = number, one.row
    if driven.size:
        size = driven.size + given.size + passed.size + steered.size
        further = np.zeros((size, left.shape[1]))
        left, right = np.vstack([left, further]), np.vstack([right, further])
        contact, element, controller = (
            np.concatenate([one, np.full(len(further), -1)])
            for one in (contact, element, controller)
        )
        left[parts : parts + driven.size] = -shares.T @ problem.torque
        if problem.joints.project.size:
            _add_inertias(machine, problem, shares, left[parts : parts + driven.size])
        bodies = np.tile(driven, size // driven.size)
        factors = np.concatenate([np.ones(driven.size), -given, -passed, -steered])
        right[np.arange(parts, len(right)), n + bodies] = factors
        # Numbers after those of the losses of the elements: their torques.
        count = len(problem.elements.loads)
        end = parts + driven.size + given.size
        element[parts + driven.size : end] = count + np.repeat(np.arange(count), driven.size)
        last = end + passed.size
        contact[end:last] = np.repeat(np.arange(passed.size // driven.size), driven.size)
        controller[last:] = np.repeat(acting, driven.size) if steered.size else -1
    return PowerRows(left, right, contact, element, controller)


def _add_inertias(
    machine: Machine, problem: MachineProblem, shares: FloatArray, rows: FloatArray
) -> None:
    """Add the torques by which drives accelerate inertias that joints connect to them.

    rows : (driven, z) torques of the drives
    """
    inertias = shares.T @ (masses(machine)[:, None] * shares)
    for column, one in zip(inertias.T, problem.driven, strict=True):
        if one["rate"] >= 0:
            rows[:, problem.states + one["rate"]] += column
