"""How motions of the current study are computed and classified, in one run and in sweeps."""

from __future__ import annotations

import math
from collections.abc import Collection
from typing import Any

from wedgebrake.explorer.core.limits import MOST_EVENTS, MOST_STEPS, SAMPLES_PER_PERIOD
from wedgebrake.explorer.core.state import PageState
from wedgebrake.explorer.core.values import chosen_of
from wedgebrake.solvers.kernels import method_of
from wedgebrake.solvers.times import MOST_BY_DEFAULT, needed_samples

# Largest number of periods until a motion has settled, by method. Aperiodic motions need them all.
# "smooth" costs twenty times as much per period as "exact".
_LONGEST = {"exact": 2000, "smooth": 1000}
# The same for several bodies and for actuators with stages.
_LONGEST_OF_MACHINES = 1000
# Samples of a period of the free vibration; most of a slower torque's period.
_OF_NATURAL, DENSEST = 20, 2000
# Fewest samples of a run whose length is given in seconds.
_LEAST_SAMPLES = 2000
# The limits of one of many points are smaller by this factor than those of the single run.
_SHARE = 4


def method(state: PageState) -> str:
    """Solver of a run: "exact" or "smooth".

    Raises ``InputError`` if it does not support the friction law.
    """
    return method_of(state.system, state.study.run.method)


def slow(state: PageState) -> bool:
    """Return True if a motion takes long, by small steps or several bodies.

    Raises ``InputError`` as ``method`` does.
    """
    return method(state) != "exact" or not state.counted


def evaluation_settings(state: PageState) -> dict[str, Any]:
    """Arguments of ``wb.motion`` and of sweeps that select the periods for the classification.

    These follow the transient, which may have any length. Raises ``InputError`` as ``method`` does.
    """
    chosen = method(state)
    longest = _LONGEST[chosen] if state.counted else _LONGEST_OF_MACHINES
    returns = state.system.machine.returns
    return {returns: state.recorded, "transient": "auto", "limit": longest}


def sweep_settings(state: PageState) -> dict[str, Any]:
    """Arguments of a sweep that set how each run is computed, plain and hashable."""
    run = dict(state.study.run)
    names = ("initial", "method", "rtol")
    return {
        **{name: run[name] for name in names if name in run},
        **{
            name: min(run[name], most // _SHARE)
            for name, most in (("max_events", MOST_EVENTS), ("max_steps", MOST_STEPS))
            if name in run
        },
    }


def samples_wanted(state: PageState) -> float:
    """Samples in a cycle that resolve the free vibration."""
    if state.counted:
        line, torque = state.system.driveline, state.system.excitation
        return float(_OF_NATURAL * line.natural_frequency / torque.angular_frequency)
    begin = state.study.run.start_time
    whole = max(needed_samples(state.system, begin, begin + state.duration), _LEAST_SAMPLES)
    return min(whole, MOST_BY_DEFAULT) * state.cycle / (state.duration or state.cycle)


def density(state: PageState) -> int:
    """Samples of a response in a cycle."""
    wanted = samples_wanted(state)
    if not state.counted:
        return math.ceil(wanted)
    return max(SAMPLES_PER_PERIOD, math.ceil(wanted) if wanted <= DENSEST else 0)


def linked_friction(state: PageState, names: Collection[str]) -> Any:
    """The system for a plot over some parameters.

    Over kinetic friction, static friction follows it or keeps its own value, as it does when
    kinetic friction is edited on the page.
    """
    changes = {}
    for name, part in chosen_of(state.system).items():
        values = dict(part)
        if not {"kinetic", "static"} <= values.keys():
            continue
        prefix = name.rpartition(".")[0]
        kinetic, static = (f"{prefix}.{one}".removeprefix(".") for one in ("kinetic", "static"))
        own = state.own_static(static)
        if kinetic not in names or own == values["static"]:
            continue
        if own is None:
            del values["static"]
        else:
            values |= {"kinetic": own, "static": own}
        changes[name] = type(part)(**values)
    return state.system.replace(**changes) if changes else state.system
