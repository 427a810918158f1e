"""The time of a run, and the series of its signals at this time."""

from typing import NamedTuple

from wedgebrake.dynamics.jit import borrowing, embedded
from wedgebrake.dynamics.signals import TERMS, expand


class Clock(NamedTuple):
    """A time as a sum of two numbers, so that many small cells accumulate no rounding."""

    time: float
    remainder: float


@embedded
def later(clock, tau):
    """The clock advanced by tau."""
    total = clock.time + tau
    back = total - clock.time
    lost = (clock.time - (total - back)) + (tau - back) + clock.remainder
    time = total + lost
    return Clock(time, lost - (time - total))


@embedded
def expand_inputs(problem, run, clock):
    """Store the series of the signals, and the rates of bases, driven bodies and setpoints."""
    expand(problem.signals, clock.time, clock.remainder, run.z, problem.states)
    if problem.presence.rates:
        _expand_rates(problem, run.z)


@borrowing
def _expand_rates(problem, z):
    """Store the series of inputs that are rates of others."""
    states = problem.states
    for contact in problem.contacts:
        if contact.base_rate >= 0:
            base, rate = states + contact.base_input, states + contact.base_rate
            for k in range(TERMS - 1):
                z[rate, k] = (k + 1.0) * z[base, k + 1]
            z[rate, TERMS - 1] = 0.0
    for one in problem.driven:
        if one.rate >= 0:
            for k in range(TERMS - 1):
                z[states + one.rate, k] = (k + 1.0) * z[states + one.input, k + 1]
            z[states + one.rate, TERMS - 1] = 0.0
    for one in problem.controllers.records:
        if one.rate >= 0:
            for k in range(TERMS - 1):
                z[states + one.rate, k] = (k + 1.0) * z[states + one.input, k + 1]
            z[states + one.rate, TERMS - 1] = 0.0
