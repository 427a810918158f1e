"""Modes with imposed directions of sliding: the smooth continuation of a motion beyond its events.

Contacts slide and stick as prescribed, whether or not their speeds and torques allow it; the lines
of friction and the limits of forces are those of the motion.
"""

import numpy as np

from wedgebrake.dynamics.jit import compiled
from wedgebrake.dynamics.references import by_reference
from wedgebrake.dynamics.signals import TERMS
from wedgebrake.solvers.machine.events.cells import expand_states
from wedgebrake.solvers.machine.events.clock import Clock, expand_inputs
from wedgebrake.solvers.machine.events.curves import (
    CURVE_TERMS,
    differentiate,
    expand_curves,
    slides_on_curve,
)
from wedgebrake.solvers.machine.events.events import limited_force
from wedgebrake.solvers.machine.events.modes import NO_KEY, present_system


@compiled
def impose(problem, run, sides):
    """Impose directions of sliding, (m,), in the present state."""
    for number in range(run.modes.size):
        mode, contact = run.modes[number], problem.contacts[number]
        if mode.side != sides[number] or mode.clamp != 0:
            mode.side, mode.clamp = sides[number], 0
            mode.line = contact.lines_forward if mode.side < 0 else 0
            _, mode.force_limit = limited_force(problem, number, run, mode.side)
        mode.imposed, mode.fresh = 1, 0
    run.pending[0] = -1


@compiled
def expand(problem, run):
    """Store the series of the present state in ``run.z``; returns the slot of its system.

    With those of the derivatives of torques on curves. -1 if contacts at rest could share a torque
    in several ways.
    """
    problem, run = by_reference(problem), by_reference(run)
    slot = present_system(problem, run)
    expand_inputs(problem, run, Clock(run.clock[0], run.clock[1]))
    if slides_on_curve(run):
        expand_curves(problem, run, slot, CURVE_TERMS, np.inf)
        differentiate(problem, run, CURVE_TERMS)
    else:
        expand_states(run.systems.rates[slot], run.systems.lead[slot], run.z, TERMS)
    return slot if run.systems.keys[slot, 0] != NO_KEY else -1
