"""How a motion is judged: one rule for the verdict, the pictures, and what is exported."""

from __future__ import annotations

from typing import Any

from wedgebrake.app.desk import Desk
from wedgebrake.solvers.solve import choose_method

# Most periods that a motion is given to settle, by method. Of a motion that does not repeat all
# are run; smoothed friction costs twenty times as much as exact, the steps of ode14x more.
_WAIT = {"exact": 2000, "smooth": 1000, "ode14x": 250}


def method(desk: Desk) -> str:
    """The solver of a run: "exact", "smooth" or "ode14x".

    Raises ``InputError`` for one that does not fit the friction law.
    """
    return choose_method(desk.system, desk.study.run.method)


def judging(desk: Desk) -> dict[str, Any]:
    """Arguments of ``wb.motion`` and of sweeps that say from which periods the class is taken.

    Those after the transient, however long it is. Raises ``InputError`` as ``method``.
    """
    return {"periods": desk.recorded, "transient": "auto", "limit": _WAIT[method(desk)]}
