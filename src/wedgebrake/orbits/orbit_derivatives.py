"""Derivatives of a periodic orbit with respect to parameters, by the implicit function theorem.

With x_0 the state at the start and T the period, the orbit closes: x(T; x_0, p) = x_0, up to whole
rotations. Hence

    (1 - M) dx_0/dp = b + f dT/dp,

M and b being the derivatives of the flow over the period with respect to the initial state and to
p, and f the rate of the state at its end. The period of signals is known; that of a self-excited
orbit follows with the condition that its start remains on the section. Driven bodies start at their
own angles and speeds, and joints place the bodies that follow others.
"""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray

from wedgebrake._version import __version__
from wedgebrake.analysis.derivatives.measures import MEASURES, Found, checked_measures
from wedgebrake.analysis.derivatives.results import of_measures, one_sided, values_of
from wedgebrake.analysis.derivatives.task import checked_names, tangent_task, varying
from wedgebrake.analysis.derivatives.varied_motion import (
    VariedMotion,
    ends_of,
    period_changes,
    run_motion,
    varied_motion,
)
from wedgebrake.analysis.derivatives.varied_values import VariedValues, by_parameter
from wedgebrake.analysis.responses.machine_series import MachineSeries, series
from wedgebrake.arrays import FloatArray
from wedgebrake.model.joints import reduction
from wedgebrake.model.machine import Machine
from wedgebrake.model.machine_matrices import RANK, free_rotations
from wedgebrake.model.machine_parts import speed_at
from wedgebrake.model.validation import wrong
from wedgebrake.orbits.curves import OrbitSolution
from wedgebrake.solvers.interrupts import interruptible
from wedgebrake.solvers.machine.final_state import FinalState
from wedgebrake.solvers.machine.tangents import (
    Parameter,
    TangentTask,
    differentiate,
    samples_of,
)

if TYPE_CHECKING:
    import xarray as xr

# Singular values below this share of the largest belong to neutral directions. A larger residual
# shows that there is no orbit near this one for other values of a parameter.
_NEUTRAL, _CLOSES = 1e-9, 1e-6
# Change of a number by a neutral deviation, relative to its size, that is rounding.
_UNAFFECTED = 1e-6


class _Beside(NamedTuple):
    """The neighbouring orbits: derivatives (states, q) of the start and (q,) of the period.

    The first columns are those of the parameters, the last ones those of deviations after which the
    motion is another orbit of the same system.

    closes : for each parameter, whether there are orbits for other values
    """

    start: FloatArray
    period: FloatArray
    closes: NDArray[np.bool_]


def orbit_sensitivity(
    orbit: OrbitSolution, parameters: Sequence[str], of: Sequence[str] | None
) -> xr.Dataset:
    """As ``Orbit.sensitivity``."""
    driven = [f"{one.name}.angle" for one in orbit.system.machine.driven]
    names = checked_names(orbit.system, parameters, driven)
    parts = {"controller": orbit.system.machine.controllers, "driven": orbit.system.machine.driven}
    every = tuple(name for name, one in MEASURES.items() if parts.get(one.dim, True))
    wanted = every if of is None else checked_measures(of)
    system = varying(orbit.system, names)
    task = _task(orbit, system, names)
    motion = run_motion(task)
    beside = _beside(orbit, task, motion)
    q, neutral = len(names), beside.period.size - len(names)
    still = Parameter("a neutral deviation", 0.0)
    longer = task._replace(
        parameters=(*task.parameters, *[still] * neutral),
        machine_at=(*task.machine_at, *[lambda _: task.machine] * neutral),
        start=beside.start,
    )  # fmt: skip
    varied = _without_drift(orbit, varied_motion(longer, motion, beside.period))
    # Neighbouring orbits follow from the derivative of the flow, which is for one order of events.
    unordered = varied.sides.ordered[:q]
    found = {name: _known(MEASURES[name].of(varied), unordered) for name in wanted}
    n = len(task.machine.inertias)
    first = np.concatenate([ends_of(one)[0][0] for one in (motion.angle, motion.speed)])
    further = {
        "period": (None, "s", "period", (np.array(orbit.period), beside.period)),
        "angle": ("inertia", "rad", "angle at the start", (first[:n], beside.start[:n])),
        "velocity": (
            "inertia", "rad/s", "speed at the start", (first[n:], beside.start[n : 2 * n]),
        ),
    }  # fmt: skip
    others = {name: (*one[:3], _known(one[3], unordered)) for name, one in further.items()}
    dataset, note = of_measures(system, task.parameters, found, others)
    variables = {"one_sided": one_sided(np.where(unordered, 0.0, varied.sides.one_sided[:q]))}
    if unordered.any():
        which = ", ".join(np.array(names)[unordered])
        note += (
            f" Events of the orbit coincide, and their order changes with {which}: the orbit has no"
            f" derivative with respect to {which}."
        )
    else:
        note = varied.sides.note + note
    if neutral:
        note += (
            " The orbit is one of a continuous family: numbers that differ among its members have"
            " no derivative."
        )
    lost = [name for name, closes in zip(names, beside.closes, strict=True) if not closes]
    if lost:
        note += f" For other values of {', '.join(lost)} there is no orbit near this one."
    return dataset.assign(variables).assign_attrs(
        wedgebrake_version=__version__, method=orbit.problem.method,
        system=json.dumps(system.as_dict()), message=f"Derivatives of a {orbit.name}.{note}",
        parameters=values_of(task.parameters),
    )  # fmt: skip


def _task(orbit: OrbitSolution, system: Any, names: Sequence[str]) -> TangentTask:
    """The run along an orbit."""
    for contact in system.machine.contacts:
        if contact.actuation.delay:
            raise wrong(
                f"{contact.name}.delay", contact.actuation.delay, "0",
                "Derivatives of orbits do not include the samples of a delay.",
            )  # fmt: skip
    initial, period = orbit.initial, orbit.period
    if isinstance(initial, FinalState):
        # From just before the samples at the start to just before those at the end.
        initial = _before_samples(initial, system.machine, orbit.points[0])
    if any(one.sample_time is not None for one in system.machine.controllers):
        period = orbit.order * orbit.kernel_problem.period
    begin = initial.time if isinstance(initial, FinalState) else 0.0
    span = begin, begin + period
    return tangent_task(system, names, span, orbit.problem.method, initial)


def _before_samples(state: FinalState, machine: Machine, point: FloatArray) -> FinalState:
    """The state before actuations and digital controllers take their samples at this instant.

    point : (states,) angles, speeds, and states of lags and controllers before the samples
    """

    def before(taken: tuple[tuple[float, int], ...], steps: Sequence[float | None]) -> Any:
        return tuple(
            (first, samples - (step is not None))
            # The initial state of a machine contains no numbers of samples.
            for (first, samples), step in zip(taken, steps, strict=False)
        )

    return dataclasses.replace(
        state, actuators=tuple(map(float, point[2 * len(state.angles) :])),
        sampled=before(state.sampled, [one.actuation.sample_time for one in machine.contacts]),
        samplings=before(state.samplings, [one.sample_time for one in machine.controllers]),
    )  # fmt: skip


def _beside(orbit: OrbitSolution, task: TangentTask, motion: MachineSeries) -> _Beside:
    """Solve the equations of the orbits beside one.

    The unknowns are the derivatives of the start, of the period, and of the turn of each free
    rotation, in units in which they are of one size.
    """
    q, n, lags = len(task.parameters), motion.angle.shape[-1], motion.lags.shape[-1]
    states, period, driven = 2 * n + lags, orbit.period, len(task.machine.driven)
    free, given = free_rotations(task.machine).T, np.zeros((states, q))
    if driven or task.machine.joints:
        given[: 2 * n] = by_parameter(task, lambda machine: _placed(machine, task))
    found = interruptible(lambda: differentiate(task._replace(start=given)))
    if task.machine.controllers:  # at a limit, their states bend where the motion does not
        motion = run_motion(task, found.events)
    speed, force = (np.abs(one).max(initial=0.0) or 1.0 for one in (motion.speed, motion.force))
    sizes = np.abs(motion.lags).max(axis=(0, 1), initial=0.0)
    unit = np.concatenate([
        np.full(n, speed * period / (2.0 * math.pi)), np.full(n, speed),
        np.where(sizes > 0.0, sizes, force),
    ])  # fmt: skip
    # The unknown change of the start is beside ``given``. The turns of free rotations with a driven
    # body follow from its angle; along the others the start does not change.
    _, ranks, turns = np.linalg.svd(free[n - driven :])
    apart = free @ turns[np.count_nonzero(ranks > RANK) :].T
    last, turn = states, slice(states + 1, None)
    fixed = slice(states + 1, states + 1 + apart.shape[1])
    matrix = np.zeros((fixed.stop + driven, states + 1 + free.shape[1]))
    right = np.zeros((len(matrix), q))
    matrix[:last, :last] = (np.eye(states) - found.flow) * unit / unit[:, None]
    matrix[:last, last] = -period * _end_rate(motion) / unit
    matrix[:n, turn], matrix[fixed, :n] = free, apart.T
    matrix[fixed.stop :, n - driven : n] = np.eye(driven)
    right[:last] = (found.final - given) / unit[:, None]
    if free.size:
        right[:n] -= _turned(task, motion, free) / unit[:n, None]
    crossing = getattr(orbit.problem, "crossing", None)
    known = None
    if orbit.problem.self_excited and crossing is not None:
        row = np.array(crossing.row)
        row /= np.abs(row * unit).max()
        matrix[last, :last], right[last] = row * unit, -row @ given
    else:
        known = _period_changes(orbit, task)
        matrix[last, last], right[last] = 1.0, known / period
    left, values, across = np.linalg.svd(matrix, full_matrices=False)
    kept = values > _NEUTRAL * values[0]
    solved = across[kept].T @ (left[:, kept].T @ right / values[kept, None])
    gap = np.abs(matrix @ solved - right).max(axis=0)
    closes = gap <= _CLOSES * np.maximum(np.abs(right).max(axis=0), np.abs(solved).max(axis=0))
    solved[:, ~closes] = np.nan
    solved = np.column_stack([solved, across[~kept].T])
    start = solved[:last] * unit[:, None]
    start[:, :q] += given
    changes = solved[last] * period
    if known is not None:  # without rounding
        changes[:q], changes[q:] = np.where(closes, known, np.nan), 0.0
    return _Beside(start, changes, closes)


def _placed(machine: Machine, task: TangentTask) -> FloatArray:
    """Angles and speeds at the start of an orbit if those of the free bodies are those of a task.

    machine : with driven bodies and joints of its own, which place the other bodies
    """
    moving, follow = len(machine.inertias) - len(machine.driven), reduction(machine).follow
    if task.initial is None:
        raise RuntimeError("an orbit of several bodies begins at a state")
    angles, speeds = (
        np.array(list(one.values())) for one in (task.initial.angles, task.initial.speeds)
    )
    angles[moving:] = [one.angle for one in machine.driven]
    speeds[moving:] = [speed_at(one, task.span[0]) for one in machine.driven]
    return np.concatenate([follow @ angles, follow @ speeds])


def _turned(task: TangentTask, motion: MachineSeries, free: FloatArray) -> FloatArray:
    """Derivatives of the turns over a motion by those of the rotations alone, (n, q) [rad].

    free : (n, k) rotations
    """
    first, last = ends_of(motion.angle)
    turns = np.linalg.lstsq(free, last[-1] - first[0], rcond=None)[0]

    def turned(machine: Machine) -> FloatArray:
        near = free_rotations(machine).T
        # Otherwise parts restrain it for other values, and no orbit closes.
        return np.asarray(near @ turns if near.shape == free.shape else np.full(len(near), np.nan))

    return by_parameter(task, turned)


def _end_rate(motion: MachineSeries) -> FloatArray:
    """Rate of the state at the end of a motion."""
    inner = series(motion.lags[-1:])[0]
    rate = legendre.legval(1.0, np.asarray(legendre.legder(inner), float))
    ends = [ends_of(one)[1][-1] for one in (motion.speed, motion.acceleration)]
    return np.concatenate([*ends, rate * 2.0 / motion.length[-1]])


def _period_changes(orbit: OrbitSolution, task: TangentTask) -> FloatArray:
    """Derivatives of the period of an orbit that signals drive [s], by the parameters."""
    period = task.machine.period
    if not period:
        return np.zeros(len(task.parameters))
    for samples in samples_of(task):
        moved = samples.changes.any(axis=0)
        if moved.any():
            raise wrong(
                "parameters", task.parameters[int(np.argmax(moved))].name,
                "a parameter without effect on sample times",
                f"With another sample time, the samples of {samples.name} do not repeat with the"
                " signals.",
            )  # fmt: skip
    found = round(orbit.period / period) * period_changes(task)
    steps = {one.name: one.actuation.sample_time for one in task.machine.contacts}
    steps |= {one.name: one.sample_time for one in task.machine.controllers}
    for part, step in steps.items():
        if step is not None and np.any(found):
            name = task.parameters[int(np.argmax(found != 0.0))].name
            raise wrong(
                "parameters", name, "a parameter without effect on the period",
                f"With another period, the samples of {part} do not repeat with the signals. For"
                " orbits over the frequency use wb.response_curve(..., samplings=n).",
            )  # fmt: skip
    return found


def _without_drift(orbit: OrbitSolution, varied: VariedMotion) -> VariedMotion:
    """The motion, with angles of free rotations measured from the mean rotation."""
    free = np.abs(free_rotations(varied.machine)).max(axis=0, initial=0.0) > 0.0
    (values, changes), period = varied.angle, orbit.period
    (start, end), (start_by, end_by) = (
        (one[0][0], one[1][-1]) for one in (ends_of(values), ends_of(changes))
    )
    longer = varied.shifts[-1]
    turn = end - start
    rate = ends_of(varied.speed.values)[1][-1]
    turn_by = end_by - start_by + rate[:, None] * longer
    mean = np.where(free, turn / period, 0.0)
    mean_by = np.where(free[:, None], (turn_by - (turn / period)[:, None] * longer) / period, 0.0)
    since = varied.motion.times - varied.task.span[0]
    angle = VariedValues(
        values - since[..., None] * mean, changes - since[..., None, None] * mean_by
    )
    return dataclasses.replace(varied, angle=angle)


def _known(found: Found, unordered: NDArray[np.bool_]) -> Found:
    """Derivatives with respect to q parameters; nan if neutral deviations change the value.

    unordered : (q,) whether an orbit has no derivative because events change their order
    """
    (values, changes), q = found, unordered.size
    affected = np.abs(changes[..., q:]).max(axis=-1, initial=0.0) > _UNAFFECTED * np.abs(values)
    return values, np.where(affected[..., None] | unordered, np.nan, changes[..., :q])
