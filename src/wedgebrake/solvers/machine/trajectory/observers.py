"""What is recorded of a run: states at given times, and the work of every part."""

from typing import Any, NamedTuple

import numpy as np

from wedgebrake.dynamics.jit import borrowing, embedded
from wedgebrake.dynamics.signals import TERMS
from wedgebrake.solvers.machine.events.cells import combine, polynomial
from wedgebrake.solvers.machine.trajectory.extremes import widened
from wedgebrake.solvers.machine.trajectory.nodes import WEIGHTS, values_at_nodes
from wedgebrake.solvers.machine.trajectory.watch import NoWatch, Watch


class Observer(NamedTuple):
    """What is recorded of a run.

    times   : (k,) ascending;  ``at[0]`` is the next one
    states  : (k, states);  torque, force, side : (k, m) of the contacts
    control : (k, c) outputs of controllers
    left, right : (powers, z) rows whose product is a power [W]
    contact : (powers,) whose torque is the left row instead; -1: none
    element : (powers,) whose losses are the left row instead, or, beyond the number of elements,
              whose torque is; -1: none
    controller : (powers,) whose output is the left row instead; -1: none
    work    : (powers,) their integrals [J]
    peak    : (m,) largest magnitude of the torque of a contact [N m]; (0,): not recorded
    series  : (3, TERMS) workspace for both
    watch   : what is recorded of a passage
    """

    times: Any
    at: Any
    states: Any
    torque: Any
    force: Any
    side: Any
    control: Any
    left: Any
    right: Any
    contact: Any
    element: Any
    controller: Any
    work: Any
    peak: Any
    series: Any
    watch: Watch | NoWatch


class PowerRows(NamedTuple):
    """The rows of powers in an ``Observer``."""

    left: Any
    right: Any
    contact: Any
    element: Any
    controller: Any


def observer_of(problem: Any, times: Any, powers: PowerRows | None = None) -> Observer:
    """Arrays for what is recorded.

    times  : of the samples [s]
    powers : ``PowerRows`` of what is integrated; None: nothing
    """
    samples, m = len(times), problem.contacts.size
    none = np.zeros((0, 0))
    nothing = np.zeros(0, np.int64)
    powers = powers or PowerRows(none, none, nothing, nothing, nothing)
    # A copy: read-only times have another type, for which all would be compiled again.
    return Observer(
        np.array(times, float), np.zeros(1, np.int64), np.zeros((samples, problem.states)),
        np.zeros((samples, m)), np.zeros((samples, m)), np.zeros((samples, m), np.int64),
        np.zeros((samples, problem.controllers.records.size)), *powers,
        np.zeros(len(powers.contact)),
        np.zeros(0), np.zeros((3, TERMS)), NoWatch(),
    )  # fmt: skip


@embedded
def observe(observer, problem, run, slot, terms, clock, tau, last):
    """Record a cell of length tau, from the time of a clock on.

    last : the end of the cell belongs to it, as no other one follows
    """
    times, at = observer.times, observer.at[0]
    while at < times.size:
        since = (times[at] - clock.time) - clock.remainder
        if since > tau or (since == tau and not last):
            break
        _sample(observer, problem, run, slot, terms, at, since, tau)
        at += 1
    observer.at[0] = at
    if tau > 0.0 and observer.work.size > 0:
        _add_work(observer, problem, run, slot, terms, tau)
    for number in range(observer.peak.size):
        _add_peak(observer, run, slot, terms, tau, number)


@borrowing
def _sample(observer, problem, run, slot, terms, at, since, tau):
    """Record the state at a time since the beginning of a cell of length tau."""
    since, z, g, systems = min(max(since, 0.0), tau), run.z, run.guard, run.systems
    for i in range(problem.states):
        observer.states[at, i] = polynomial(z[i], terms, since)
    for number in range(run.modes.size):
        combine(systems.contact[slot, number], z, g)
        observer.torque[at, number] = polynomial(g, terms, since)
        combine(systems.force[slot, number], z, g)
        observer.force[at, number] = polynomial(g, terms, since)
        observer.side[at, number] = run.modes[number].side
    for number in range(run.samplings.size):
        combine(systems.output[slot, number], z, g)
        observer.control[at, number] = polynomial(g, terms, since)


@borrowing
def _add_work(observer, problem, run, slot, terms, tau):
    """Add the work of a cell of length tau; a contact at rest produces no heat."""
    series, left, right = observer.series[0], observer.series[1], observer.series[2]
    for number in range(observer.work.size):
        if number < run.modes.size and run.modes[number].side == 0:
            continue
        contact, element = observer.contact[number], observer.element[number]
        if observer.controller[number] >= 0:
            combine(run.systems.output[slot, observer.controller[number]], run.z, series)
        elif element >= 0:
            if element < problem.elements.elements.size:
                combine(problem.elements.losses[run.places[element].piece], run.z, series)
            else:
                piece = run.places[element - problem.elements.elements.size].piece
                combine(problem.elements.torques[piece], run.z, series)
        elif contact < 0:
            combine(observer.left[number], run.z, series)
        else:
            combine(run.systems.contact[slot, contact], run.z, series)
        values_at_nodes(series, terms, tau, left)
        combine(observer.right[number], run.z, series)
        values_at_nodes(series, terms, tau, right)
        total = 0.0
        for i in range(WEIGHTS.size):
            total += WEIGHTS[i] * left[i + 1] * right[i + 1]
        observer.work[number] += total * tau


@borrowing
def _add_peak(observer, run, slot, terms, tau, number):
    """Add a cell of length tau to the largest torque of a contact."""
    peak, g = observer.peak[number], run.guard
    combine(run.systems.contact[slot, number], run.z, g)
    low, high = widened(observer.series, g, terms, tau, -peak, peak)
    observer.peak[number] = max(-low, high)
