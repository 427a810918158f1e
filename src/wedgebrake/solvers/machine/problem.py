"""A machine as numbers, for the exact solver of any number of inertias and contacts.

Between events the machine is x' = A x + B u(t) + b, with the state x = (angles, speeds, actuator
states), the inputs u and a mode of each contact. A linear quantity of the machine is a row of
factors of z = (x, u, 1).
"""

from typing import Any, NamedTuple

import numpy as np

from wedgebrake.dynamics.records import record
from wedgebrake.dynamics.signals import TERMS, Signals

MOST_LAG = 4
"""Largest number of states of an actuator's lag."""

# A contact between inertia ``a`` and inertia ``b`` (-1: ground or a moving base).
#
# force           : input that is the actuation force at rest, -1: ``initial_force``
# base_input, base_rate : inputs that are the speed of the base and its rate, -1: ``base_speed``
# base_bound      : bound of that speed
# slope           : of the force against the sliding speed
# lag             : number of states of the actuator's lag; the first, ``state``, is the force
# lag_rates, lag_command : factors of these states and of the command in their rates
# lowest, highest : limits of the force, the release among them
# forward, backward, breakaway_forward, breakaway_backward : R g(m), at +-mu_k and +-mu_s
# lines_forward, lines_backward : numbers of lines of the torque over the sliding speed, from
#                   ``first_line`` on, where friction depends on the speed; otherwise 0
# curve           : input that is its torque, where these lines are curves; -1: they are straight
# normal          : row of ``normals`` that adds to the actuation force; -1: none
# ratio           : speed of a over that of b without sliding
# mobility        : acceleration of sliding per torque [1/(kg m^2)]
# commanded       : whether the output of controllers adds to its command
# sampled_input   : input that is the force a sampled actuation applies, -1: it is not sampled
# sample_time, resolution, delay : of a sampled actuation
CONTACT = record(
    "initial_force base_speed base_bound slope lowest highest forward backward breakaway_forward"
    " breakaway_backward sample_time resolution ratio mobility",
    whole="a b force base_input base_rate lag state first_line lines_forward lines_backward curve"
    " normal commanded sampled_input delay",
    fields=[
        ("lag_rates", np.float64, (MOST_LAG, MOST_LAG)), ("lag_command", np.float64, (MOST_LAG,)),
    ],
)  # fmt: skip

# A driven body: number of the inertia, inputs that are its speed and the rate of this; -1: the
# speed is ``speed``
DRIVEN = record("speed", whole="body input rate")

MOST_DEGREE = 12
"""Largest degree of a curved line."""

# A shaft between inertia ``a`` and inertia ``b`` (-1: the ground). preload: of its spring at the
# angles 0.
SHAFT = record("stiffness damping ratio preload", whole="a b")

# A piecewise-linear element: a torque with constant factors on the inertias.
#
# first, count : of its pieces; of several that fit the state at an instant the first applies
# start, period : of its argument, if it repeats
# turns        : input that is the number of periods of its argument; -1: it does not repeat
# scale        : input that is its scale, if this varies in time; -1: none
# product      : input that is its torque, if it has such a scale; -1: none
# bound        : of the scale
ELEMENT = record("start period bound", whole="first count turns scale product")

# A piece of an element, and its bounds. A bound is a row that is positive while the piece lasts.
PIECE = record(whole="first count")

# target : number of the piece after a bound has reached zero
# own, reached : bits, in ``fresh``, of the quantity in this piece and in the next one
# turns  : change of the number of periods
BOUND = record(whole="target own reached turns")

# A controller with the error e = setpoint - measured. Its output is
# proportional e + integral part + derivative (e - filtered error); of a digital one, with a
# ``sample_time``, proportional e + sum + rate, see ``controllers.sample_controllers``.
#
# inertia, contact : on which its output is a torque, to whose command it adds; -1: none
# input, rate : inputs that are the setpoint and its rate; -1: the setpoint is a number, or no
#               rate is needed
# integral    : of the error; of a digital one, factor of the error in a step of the sum
# derivative  : K_d/T_f; of a digital one, factor of the change of the error in the new rate
# filter      : 1/T_f; of a digital one, factor of the old rate in the new one
# low, high   : limits of the output
# state       : of its first state, in the order of ``Controller.memory``
# sum, filtered : states that are the integral part and the filtered error; -1: none
# held        : state that is the output of a digital one; otherwise -1
# slope, last : states that are the rate and the last error of a digital one; -1: none
# queue, delay : first of the states that are outputs to come, and their number
CONTROLLER = record(
    "proportional integral derivative filter low high sample_time resolution",
    whole="inertia contact input rate state sum filtered held slope last queue delay",
)

# What a digital controller has done.
#
# first_sample, samples : time of its first sample, and number of them so far
# clipped : -1 or 1 where the last output that it computed is at a limit
# frozen  : whether the last sample did not change its sum
# error, change, before : error at the last sample, its change, and the rate before
SAMPLING = record("first_sample error change before", whole="samples clipped frozen")

# The present piece of an element, or of a controller (see ``controllers``).
#
# piece   : its number
# fresh   : bits of the quantities that have just been zero
# changes : number of changes of the piece at this instant
PLACE = record(whole="piece fresh changes")

# A line of the torque of a contact over its sliding speed, from |v| = start on, with
# s = offset + slope |v|. A straight line: s is the torque. A curved one: the torque is the force
# times a polynomial of s, of this degree and with these factors. bends: whether the torque bends at
# the start of the line; released: whether the line follows the release of the actuator.
# degree -1: the torque over the force is a smoothed law, of which the factors are the numbers:
# (mu + peak exp(-lambda |v|)) tanh(kappa v) for m, and R a m/(b - m d).
LINE = record(
    "start offset slope", whole="degree",
    fields=[
        ("bends", np.bool_), ("released", np.bool_), ("factors", np.float64, (MOST_DEGREE + 1,)),
    ],
)  # fmt: skip

# Series of a contact with curved lines that slides, with the torque T = -P(s) F on its first
# inertia. One record, as every array is passed to every kernel.
#
# contact  : its number
# about    : P about the value of s at the beginning of the cell
# argument : s, without that value
# stages   : (TERMS, MOST_DEGREE + 1) stages of Horner's rule; the first is P
# force    : F
# series   : of a smoothed law, see ``curves``
# by_speed, by_force : dT/dv and dT/dF, if ``curves.differentiate`` is called
# speed_change, force_change : of v and F, in a column of the derivative of the flow
CURVE = record(
    whole="contact",
    fields=[
        ("about", np.float64, (MOST_DEGREE + 1,)), ("argument", np.float64, (TERMS,)),
        ("stages", np.float64, (TERMS, MOST_DEGREE + 1)), ("force", np.float64, (TERMS,)),
        ("series", np.float64, (6, TERMS)),
        ("by_speed", np.float64, (TERMS,)), ("by_force", np.float64, (TERMS,)),
        ("speed_change", np.float64, (TERMS,)), ("force_change", np.float64, (TERMS,)),
    ],
)  # fmt: skip

# Mode of a contact.
#
# side             : direction of sliding, 0 in a stick
# before, first    : the side before an event, and at the start of the run
# line             : of the torque over the sliding speed
# force_limit      : -1 or 1 where the force is at a limit
# clamp            : -1 or 1 where a stick has its largest torque, as others hold the remainder
# slack            : torque beyond its limit that is rounding, at which a stick does not yet end
# beyond           : -1 or 1 where the holding torque has just reached a limit
# fresh            : bits of the guards that have just been zero, by ``bit``
# first_sample, samples : time of the first sample of a sampled actuation, and number of them so far
# imposed          : whether the side is imposed, so that no event of the contact changes it
MODE = record(
    "first_sample slack",
    whole="side before first line force_limit clamp beyond fresh samples imposed",
)

# A guard of a mode: a linear quantity that is positive while the mode lasts. sign: of its limit. Of
# an element, contact is its number and sign that of the bound; of a controller, contact is its
# number and sign that of the guard in ``controllers.control_guards``.
GUARD = record(whole="contact kind sign")

# An event of a contact: sides of sliding before and after it, and the line and the limit of the
# force in the mode after it. The contact of an event of an element or a controller is its number
# after those of the contacts and elements, the line is its piece, and the sides are 0.
EVENT = record("time", whole="contact kind before after line force_limit")

# A contact at rest at an instant.
#
# lower, upper   : limits of the torque that holds
# forward, backward : torque of sliding
# capacity       : the larger magnitude of the limits, as the torques in loops are shared
# margin         : torque that is rounding by far
# arrived        : whether it has just come to rest
AT_REST = record("lower upper forward backward capacity margin", whole="arrived")

# Whether a contact at rest holds or slips.
#
# torque : on its first inertia
# slack  : as in ``MODE``
# side   : of sliding, 0 where it holds
# clamp  : -1 or 1 where a holding torque is at a limit since others hold the rest
PATTERN = record("torque slack", whole="side clamp")

# The torque of an element with a scale that varies in time, see ``products``.
#
# element, scale, input : number of the element, and the inputs that are its scale and its torque
# bound  : of the scale
# line   : series of the torque without the scale
# change : series of the derivative of ``line``, in a column of the derivative of the flow
# growth : series of a bound of such a column, see ``trajectory.resolution``
PRODUCT = record(
    "bound", whole="element scale input",
    fields=[
        ("line", np.float64, (TERMS,)), ("change", np.float64, (TERMS,)),
        ("growth", np.float64, (TERMS,)),
    ],
)  # fmt: skip

MOST_BOUNDS = 11
"""Largest number of Bernstein coefficients of a guard after the first, in ``STRIDE``."""

# Cells of a given length in a mode, as advanced by ``stride``.
#
# length  : [s]
# slot    : of the mode, -1: none
# uses    : number of cells so far
# terms   : of the signals
# degree  : of the polynomials that bound the guards
# guards  : number of guards
# results : number of linear results: changes of the states, Bernstein coefficients of the guards
STRIDE = record("length", whole="slot uses terms degree guards results")


class Elements(NamedTuple):
    """The piecewise-linear elements of a machine.

    elements : (e,) of dtype ``ELEMENT``
    arguments : (e, z) rows of their arguments, where they repeat
    loads    : (e, n) factors of their torques on the inertias
    pieces   : (p,) of dtype ``PIECE``
    torques  : (p, z) rows of the torques;  losses : of the part whose work is not stored
    lines    : (p, z) rows of the torques without scales that vary in time
    bounds   : (b,) of dtype ``BOUND``;  rows : (b, z) of them
    """

    elements: Any
    arguments: Any
    loads: Any
    pieces: Any
    torques: Any
    losses: Any
    lines: Any
    bounds: Any
    rows: Any

    @property
    def most_bounds(self) -> int:
        """Largest number of bounds of the present pieces of all elements."""
        return sum(
            int(max(self.pieces["count"][one["first"] : one["first"] + one["count"]]))
            for one in self.elements
        )


class Joints(NamedTuple):
    """How joints couple the bodies of a machine; empty if it has none, nor contacts with ratios.

    mobility : (n, n) accelerations of the bodies per torque on them
    project  : (n, n) speeds after impulses of the joints, of any speeds before; those of driven
               bodies do not change
    follow   : (n, n) angles and speeds of all bodies by those of the free and the driven ones
    frame    : (m, f) sliding speeds of the contacts by the speeds of the free bodies
    """

    mobility: Any
    project: Any
    follow: Any
    frame: Any


class Controllers(NamedTuple):
    """The controllers of a machine.

    records : (c,) of dtype ``CONTROLLER``
    errors  : (c, z) rows of the errors, without the parts that the mode changes, which follow
    forces  : (c, m) factors of the actuation forces in the measured quantities
    torques : (c, e) factors of the torques of elements in them
    """

    records: Any
    errors: Any
    forces: Any
    torques: Any


class Presence(NamedTuple):
    """Which parts a machine has, so that runs of others do not look for them in each cell.

    rates   : inputs that are rates of others
    samples : sampled actuations or digital controllers
    jumps   : bases, or setpoints of controllers with limits, that follow signals, which may jump
    given   : driven bodies or joints, which determine speeds
    """

    rates: bool
    samples: bool
    jumps: bool
    given: bool


class MachineProblem(NamedTuple):
    """The numbers of a machine.

    presence    : which parts it has
    inverse     : (n,) one over the inertias, 0 of driven bodies
    joints      : how they couple the bodies
    torque      : (n, z) rows of the torques on the inertias without contacts and elements
    loads       : (n, z) the same without the shafts
    shafts      : of dtype ``SHAFT``, without those that are elements
    elements    : piecewise-linear elements
    controllers : feedback controllers
    driven      : of dtype ``DRIVEN``
    sliding     : (m, z) rows of the sliding speeds of the contacts
    normals     : (k, z) rows of the forces by the state that add to the actuation forces
    contacts    : of dtype ``CONTACT``
    lines       : of dtype ``LINE``, of all contacts
    signals     : their values are the first inputs
    states      : number of states
    frequency   : largest angular frequency of the signals [rad/s]
    start_time  : [s]
    rounding    : of a torque, relative to the sum of the magnitudes of its terms, up to which a
                  contact holds beyond its limit
    """

    presence: Presence
    inverse: Any
    joints: Joints
    torque: Any
    loads: Any
    shafts: Any
    elements: Elements
    controllers: Controllers
    driven: Any
    sliding: Any
    normals: Any
    contacts: Any
    lines: Any
    signals: Signals
    states: int
    frequency: float
    start_time: float
    rounding: float


def mobility_of(problem: MachineProblem) -> Any:
    """Accelerations of the bodies per torque on them, (n, n)."""
    by_joints = problem.joints.mobility
    return by_joints if by_joints.size else np.diag(problem.inverse)


class Systems(NamedTuple):
    """The linear systems of the modes that a run has been in, one in each slot.

    used        : (1,) number of slots in use
    keys        : (slots, m + e + c) which mode it is, of contacts, elements and controllers
    longest, counts : of each slot, its longest cell [s] and number of guards
    lead        : (slots, n) first of the inertias that share the speed of an inertia by sticks
    base        : (slots, n) contact whose base an inertia is joined to by sticks; -1: none
    follow      : (slots, n, z) rows of the speeds of the inertias by those that joints and sticks
                  leave free; empty without joints
    rates       : (slots, states, z) x' = rates z
    contact, force : (slots, m, z) torque of each contact on its first inertia, actuation force
    error, output : (slots, c, z) error and output of each controller
    guards, what: (slots, most, z) and their descriptions, of dtype ``GUARD``
    """

    used: Any
    keys: Any
    longest: Any
    counts: Any
    lead: Any
    base: Any
    follow: Any
    rates: Any
    contact: Any
    force: Any
    error: Any
    output: Any
    guards: Any
    what: Any


class Assembly(NamedTuple):
    """Workspace for assembling a system.

    torque  : (n, z) torque on each inertia, without the contacts that hold
    upper, lower : (m, z) largest and smallest torque of each contact at rest
    powers  : (2, states, states)
    loop    : (2, z) rows of a controller
    """

    torque: Any
    upper: Any
    lower: Any
    powers: Any
    loop: Any


class Strides(NamedTuple):
    """Cells of equal length: their matrices, and the products of a matrix with a cell's factors.

    kinds    : of dtype ``STRIDE``; the first one only counts cells of a candidate
    matrices : (kinds, factors, results + guards), as ``stride_matrices`` computes them
    factors  : (factors,) of a cell: rates of the states and coefficients of the inputs
    results  : (results,)
    left_out : (guards,) bounds of the omitted terms of the guards
    """

    kinds: Any
    matrices: Any
    factors: Any
    results: Any
    left_out: Any


class Tangents(NamedTuple):
    """Derivatives with respect to p parameters, for the last p columns of the derivative of a flow.

    keys    : (slots, m + e + c) as in ``Systems``, of the modes whose derivatives are stored
    rates   : (slots, p, states, z);  guards : (slots, p, most, z);  contact, force : (slots, p, m,
              z);  error, output : (slots, p, c, z), of the rows of these modes
    lines   : (p, lines, degree + 1) of the factors of curved lines
    gains   : (p, curves, TERMS) series of their polynomials
    factors : (p, pieces, z) of the lines of elements with a scale;  scales : (p, e, z) of the scale
    direct  : (p, products, TERMS) series of the torques of these elements in a given motion
    command : (m, p, z) of the force that a sampled actuation samples at rest
    slope   : (m, p) of its slope;  sliding : (m, p, z) of the sliding speeds
    driven  : (d, p, z) of the speeds of driven bodies
    loops   : (p, c) of dtype ``CONTROLLER``, derivatives of the numbers of controllers
    start   : (states, p) of the initial state
    later   : (p,) of the time of a return of a section in time
    samplings : (c + m, p) of the sample times of digital controllers and actuations
    unmoved : (c + m,) number of that sample of each whose time does not depend on the parameters
    times   : (k,) of the samples [s];  at : (1,) number of the next one
    states  : (k, states, p) derivatives of the state at these times;  torques, forces : (k, m, p)
              of the torques and actuation forces of the contacts;  outputs : (k, c, p) of those of
              controllers
    events  : (e,) times of the events detected by guards [s];  count : (1,) of them
    shifts  : (e, p) derivatives of these times
    """

    keys: Any
    rates: Any
    guards: Any
    contact: Any
    force: Any
    error: Any
    output: Any
    lines: Any
    gains: Any
    factors: Any
    scales: Any
    direct: Any
    command: Any
    slope: Any
    sliding: Any
    driven: Any
    loops: Any
    start: Any
    later: Any
    samplings: Any
    unmoved: Any
    times: Any
    at: Any
    states: Any
    torques: Any
    forces: Any
    outputs: Any
    events: Any
    count: Any
    shifts: Any


class Run(NamedTuple):
    """The variables of a run.

    clock   : (2,) time [s], as a sum of two numbers
    z       : (z, TERMS) Taylor series of the states, inputs and 1
    modes   : (m,) of dtype ``MODE``
    places  : (e + c,) of dtype ``PLACE``, of elements and controllers
    samplings : (c,) of dtype ``SAMPLING``
    queues  : (m, longest delay + 1) forces that sampled actuations have sampled
    resting : (m,) contacts with zero sliding speed, whose next state is to be decided
    pending : (1,) number of them; -1 where the modes have not changed
    limits, pattern : of these contacts, of dtype ``AT_REST`` and ``PATTERN``
    load    : (2, n) torques on the inertias without those of these contacts, and their rounding
    relative_speed : (n + 1,) speeds of the inertias and the ground relative to one that contacts at
              rest join them to [rad/s]; nan: not joined
    guard   : (TERMS,) series of a guard
    spare   : (z,) workspace for a row
    curves  : of dtype ``CURVE``, of the contacts with curved lines
    products : of dtype ``PRODUCT``, of the elements with a scale that varies in time
    strides : cells of equal length
    assembly : workspace for a system
    tangents : derivatives with respect to parameters
    """

    clock: Any
    z: Any
    modes: Any
    places: Any
    samplings: Any
    systems: Systems
    queues: Any
    resting: Any
    pending: Any
    limits: Any
    pattern: Any
    load: Any
    relative_speed: Any
    guard: Any
    spare: Any
    curves: Any
    products: Any
    strides: Strides
    assembly: Assembly
    tangents: Tangents


_SLOTS, _STRIDES = 64, 12
EMPTY_STRIDE = np.zeros(1, STRIDE)
"""A place for cells of a length, before there are any."""
EMPTY_STRIDE["slot"] = -1


def run_of(problem: MachineProblem) -> Run:
    """Allocate the arrays of a run of a machine."""
    m, states, width = problem.contacts.size, problem.states, problem.torque.shape[1]
    most, delayed = _most_guards(problem), 1 + max(problem.contacts["delay"], default=0)
    loops = problem.controllers.records.size
    parts = problem.elements.elements.size + loops
    lead, base = np.zeros((2, _SLOTS, problem.inverse.size), np.int64)
    upper, lower = np.empty((2, m, width))
    systems = Systems(
        np.zeros(1, np.int64), np.zeros((_SLOTS, m + parts), np.int64), np.zeros(_SLOTS),
        np.zeros(_SLOTS, np.int64), lead, base,
        np.zeros((_SLOTS, len(problem.joints.follow), width)),
        np.zeros((_SLOTS, states, width)),
        np.zeros((_SLOTS, m, width)), np.zeros((_SLOTS, m, width)),
        np.zeros((_SLOTS, loops, width)), np.zeros((_SLOTS, loops, width)),
        np.zeros((_SLOTS, most, width)), np.zeros((_SLOTS, most), GUARD),
    )  # fmt: skip
    curves = np.zeros(np.count_nonzero(problem.contacts["curve"] >= 0), CURVE)
    curves["contact"] = np.flatnonzero(problem.contacts["curve"] >= 0)
    given = problem.elements.elements
    scaled = np.flatnonzero(given["scale"] >= 0)
    products = np.zeros(scaled.size, PRODUCT)
    products["element"] = scaled
    for name, of in (("scale", "scale"), ("input", "product"), ("bound", "bound")):
        products[name] = given[of][scaled]
    factors = states + (width - 1 - states) * (TERMS - 1)
    results = states + most * MOST_BOUNDS
    strides = Strides(
        np.repeat(EMPTY_STRIDE, _STRIDES), np.empty((_STRIDES, factors, results + most)),
        np.empty(factors), np.empty(results), np.empty(most),
    )  # fmt: skip
    assembly = Assembly(
        np.empty((problem.inverse.size, width)), upper, lower, np.empty((2, states, states)),
        np.empty((2, width)),
    )  # fmt: skip
    return Run(
        np.array([problem.start_time, 0.0]), np.zeros((width, TERMS)), np.zeros(m, MODE),
        np.zeros(parts, PLACE), np.zeros(loops, SAMPLING), systems, np.zeros((m, delayed)),
        np.zeros(m, np.int64), np.zeros(1, np.int64),
        np.zeros(m, AT_REST), np.zeros(m, PATTERN), np.zeros((2, problem.inverse.size)),
        np.zeros(problem.inverse.size + 1), np.zeros(TERMS), np.zeros(width), curves, products,
        strides,
        assembly, tangents_of(problem, 0),
    )  # fmt: skip


def _most_guards(problem: MachineProblem) -> int:
    """Largest number of guards of a mode."""
    loops = 2 * int(problem.controllers.records.size)
    return 6 * int(problem.contacts.size) + problem.elements.most_bounds + loops + 1


def tangents_of(problem: MachineProblem, p: int, *, times: Any = (), events: int = 0) -> Tangents:
    """Allocate the derivatives with respect to p parameters.

    times  : of the samples [s]
    events : largest number of events
    """
    m, states, width = problem.contacts.size, problem.states, problem.torque.shape[1]
    most, slots = _most_guards(problem), _SLOTS if p > 0 else 0
    loops = problem.controllers.records.size
    parts = problem.elements.elements.size
    keys = m + parts + loops
    products = int(np.count_nonzero(problem.elements.elements["scale"] >= 0))
    pieces = problem.elements.pieces.size if products else 0
    curves = int(np.count_nonzero(problem.contacts["curve"] >= 0))
    # Copies of the times: read-only ones have another type, for which all would be compiled again.
    return Tangents(
        np.full((slots, keys), -(10**9)), np.zeros((slots, p, states, width)),
        np.zeros((slots, p, most, width)), np.zeros((slots, p, m, width)),
        np.zeros((slots, p, m, width)), np.zeros((slots, p, loops, width)),
        np.zeros((slots, p, loops, width)),
        np.zeros((p, problem.lines.size if curves else 0, MOST_DEGREE + 1)),
        np.zeros((p, curves, TERMS)), np.zeros((p, pieces, width)),
        np.zeros((p, parts if products else 0, width)), np.zeros((p, products, TERMS)),
        np.zeros((m, p, width)), np.zeros((m, p)),
        np.zeros((m, p, width)), np.zeros((problem.driven.size, p, width)),
        np.zeros((p, loops), CONTROLLER), np.zeros((states, p)), np.zeros(p),
        np.zeros((loops + m, p)), np.zeros(loops + m, np.int64), np.array(times, float),
        np.zeros(1, np.int64), np.zeros((len(times), states, p)),
        np.zeros((len(times), m, p)), np.zeros((len(times), m, p)),
        np.zeros((len(times), loops, p)),
        np.zeros(events), np.zeros(1, np.int64), np.zeros((events, p)),
    )  # fmt: skip
