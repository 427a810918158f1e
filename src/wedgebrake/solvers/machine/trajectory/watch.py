"""Recording of a passage: returns to a section, derivative of the flow, extremes and sums."""

from enum import IntEnum
from typing import Any, NamedTuple

import numpy as np

from wedgebrake.dynamics.records import record
from wedgebrake.dynamics.signals import TERMS


class SectionKind(IntEnum):
    """Kind of a section."""

    NONE = 0
    EVERY = 1
    CROSSING = 2


class Anew(IntEnum):
    """Whether the derivative of the flow starts anew at the next cell."""

    NO = 0
    YES = 1
    AT_START = 2
    """At the start of the motion, where all samples follow from the state."""


# next: number of the next return of a section in time; count: returns so far; below: the row has
# been below its level since its last crossing; anew: an ``Anew``; pending: an event has ended the
# last cell, so that its jump is to be applied to the derivative
# scale: largest sum of the magnitudes of the terms of the row's value
WATCH = record("scale", whole="next count below anew pending")


class NoWatch(NamedTuple):
    """Replacement of ``Watch`` in runs of which nothing is recorded.

    on : False
    """

    on: bool = False


class Quantities(NamedTuple):
    """Quantities of which mean, mean square and extremes over a passage are recorded.

    A quantity is a row of the state or the torque of a contact, less a level, or a derivative.

    rows    : (q, z) factors
    contact : (q,) contact whose torque is the quantity instead; -1: none
    order   : (q,) order of the derivative in time
    level   : (q,) level that is subtracted before differentiation
    sums    : (q, 2) integrals of the quantity and of its square
    low, high : (q,) extremes of derivatives
    """

    rows: Any
    contact: Any
    order: Any
    level: Any
    sums: Any
    low: Any
    high: Any


class QuantityRows(NamedTuple):
    """The definition of ``Quantities``: rows of the states, contacts and orders."""

    rows: Any
    contact: Any
    order: Any


def quantities_of(given: QuantityRows | None, states: int, width: int) -> Quantities:
    """Allocate ``Quantities``; None: no quantities."""
    if given is None:
        given = QuantityRows(np.zeros((0, states)), np.zeros(0), np.zeros(0))
    count = len(given.order)
    rows = np.zeros((count, width))
    rows[:, :states] = given.rows
    contact, order = (np.asarray(one, np.int64) for one in (given.contact, given.order))
    return Quantities(
        rows, contact, order, np.zeros(count), np.zeros((count, 2)), np.zeros(count),
        np.zeros(count),
    )  # fmt: skip


class Watch(NamedTuple):
    """Record of a passage.

    derivative : whether the derivative of the flow is recorded
    kind    : a ``SectionKind``
    period, origin : of a section in time [s]
    row     : (z,) factors of the quantity of a crossing, which is positive above its level
    state   : (1,) of dtype ``WATCH``
    times, states : (k,) and (k, states) of the returns; the run ends when they are full
    matrices : (k, memory, columns) derivatives from return to return, or (0, ...)
    variation : (rows, columns) derivative of the states and of the memory of samples with
              respect to the states and the memory at the beginning, and to parameters
    shift   : (columns,) minus the derivative of the time of the last event
    before  : (z,) rates before that event or sample
    torques : (m,) torques before it of contacts that come to rest beside it; nan for others
    arrivals : (m, columns) minus the derivatives of the times at which these come to rest
    later   : (columns,) derivatives of the time of a return, or of the present samples
    series  : (z, TERMS) Taylor series of a column of ``variation``
    sampled_rows : (m,) first row of ``variation`` of the sampled actuation of a contact; -1: none
    samples : (m,) number of samples of the sampled actuations so far
    control_samples : (c,) the same of digital controllers
    rows    : (r, z) factors of the quantities whose extremes are recorded
    low, high : (r,) their extremes
    peak    : (m,) largest magnitude of the torque of a contact; (0,): neither these nor sticks
    time_at_rest : (m,) time at rest [s]
    entered : (m, 2) sticks entered from v > 0 and from v < 0
    sides   : (m,) directions of sliding in the last cell
    work    : (2, TERMS) workspace
    quantities : quantities recorded in addition to the rows
    """

    derivative: bool
    kind: int
    period: float
    origin: float
    row: Any
    state: Any
    times: Any
    states: Any
    matrices: Any
    variation: Any
    shift: Any
    before: Any
    torques: Any
    arrivals: Any
    later: Any
    series: Any
    sampled_rows: Any
    samples: Any
    control_samples: Any
    rows: Any
    low: Any
    high: Any
    peak: Any
    time_at_rest: Any
    entered: Any
    sides: Any
    work: Any
    quantities: Quantities


def watch_of(problem: Any, factors: Any, parameters: int = 0) -> Watch:
    """Allocate the record of passages, without a section.

    factors    : (r, states) factors of the states in the quantities whose extremes are recorded
    parameters : number of those with respect to which the flow is differentiated
    """
    m, states, width = problem.contacts.size, problem.states, problem.torque.shape[1]
    sampled_rows, rows, memory = np.full(m, -1), states, states
    for number, contact in enumerate(problem.contacts):
        if (
            contact["sampled_input"] >= 0
            and (contact["slope"] != 0.0 or contact["delay"] > 0 or contact["commanded"])
            and contact["resolution"] == 0.0
        ):
            sampled_rows[number] = rows
            rows += 2 + int(contact["delay"])
            memory += 1 + int(contact["delay"])
    quantities = np.zeros((len(factors), width))
    quantities[:, :states] = factors
    return Watch(
        False, int(SectionKind.NONE), 1.0, 0.0, np.zeros(width), np.zeros(1, WATCH),
        np.zeros(0), np.zeros((0, states)), np.zeros((0, memory, memory + parameters)),
        np.zeros((rows, memory + parameters)), np.zeros(memory + parameters), np.zeros(width),
        np.full(m, np.nan), np.zeros((m, memory + parameters)), np.zeros(memory + parameters),
        np.zeros((width, TERMS)), sampled_rows, np.zeros(m, np.int64),
        np.zeros(problem.controllers.records.size, np.int64), quantities, np.zeros(len(factors)),
        np.zeros(len(factors)), np.zeros(m), np.zeros(m), np.zeros((m, 2), np.int64),
        np.zeros(m, np.int64), np.zeros((2, TERMS)), quantities_of(None, states, width),
    )  # fmt: skip
