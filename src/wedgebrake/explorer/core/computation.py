"""How motions of the current study are computed and classified, in one run and in sweeps."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

from wedgebrake.analysis.solved_as import returns_name
from wedgebrake.explorer.core.limits import MOST_EVENTS, MOST_STEPS
from wedgebrake.explorer.core.state import PageState
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.solvers.kernels import choose_method

# Largest number of periods until a motion has settled, by method. Aperiodic motions need them all.
# "smooth" costs twenty times as much per period as "exact".
_LONGEST = {"exact": 2000, "smooth": 1000}
# Samples of a period of the free vibration; most of a slower torque's period.
_OF_NATURAL, DENSEST = 20, 2000
# The limits of one of many points are smaller by this factor than those of the single run.
_SHARE = 4


def method(state: PageState) -> str:
    """Solver of a run: "exact" or "smooth".

    Raises ``InputError`` if it does not support the friction law.
    """
    return choose_method(state.system, state.study.run.method)


def slow(state: PageState) -> bool:
    """Return True if the solver takes small steps. Raises ``InputError`` as ``method`` does."""
    return method(state) != "exact"


def evaluation_settings(state: PageState) -> dict[str, Any]:
    """Arguments of ``wb.motion`` and of sweeps that select the periods for the classification.

    These follow the transient, which may have any length. Raises ``InputError`` as ``method`` does.
    """
    chosen = method(state)
    returns = returns_name(state.system, chosen)
    return {returns: state.recorded, "transient": "auto", "limit": _LONGEST[chosen]}


def sweep_settings(state: PageState) -> dict[str, Any]:
    """Arguments of a sweep that set how each run is computed, plain and hashable."""
    run = state.study.run
    return {
        **{name: getattr(run, name) for name in ("initial", "method", "rtol")},
        "max_events": min(run.max_events, MOST_EVENTS // _SHARE),
        "max_steps": min(run.max_steps, MOST_STEPS // _SHARE),
    }


def samples_wanted(system: BrakedDriveline) -> float:
    """Samples in a period of the torque that resolve the free vibration."""
    line, torque = system.driveline, system.excitation
    return _OF_NATURAL * line.natural_frequency / torque.angular_frequency


def linked_friction(state: PageState, names: Collection[str]) -> BrakedDriveline:
    """The system for a plot over some parameters.

    Over kinetic friction, static friction follows it or keeps its own value, as it does when
    kinetic friction is edited on the page.
    """
    friction, own = state.system.friction, state.own_static
    values = dict(friction)
    if "kinetic" not in names or "static" not in values or own == values["static"]:
        return state.system
    if own is None:
        del values["static"]
    else:
        values |= {"kinetic": own, "static": own}
    return state.system.replace(friction=type(friction)(**values))
