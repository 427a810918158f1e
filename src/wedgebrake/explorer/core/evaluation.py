"""Periods over which motions are classified, for the verdict, the pictures and exports alike."""

from __future__ import annotations

from typing import Any

from wedgebrake.explorer.core.state import Desk
from wedgebrake.solvers.simulate import choose_method

# Largest number of periods until a motion has settled, by method. Aperiodic motions need them all.
# "smooth" costs twenty times as much per period as "exact", and "ode14x" more.
_WAIT = {"exact": 2000, "smooth": 1000, "ode14x": 250}


def method(desk: Desk) -> str:
    """Solver of a run: "exact", "smooth" or "ode14x".

    Raises ``InputError`` if it does not support the friction law.
    """
    return choose_method(desk.system, desk.study.run.method)


def judging(desk: Desk) -> dict[str, Any]:
    """Arguments of ``wb.motion`` and of sweeps that select the periods for the classification.

    These follow the transient, whatever its length. Raises ``InputError`` as ``method`` does.
    """
    return {"periods": desk.recorded, "transient": "auto", "limit": _WAIT[method(desk)]}
