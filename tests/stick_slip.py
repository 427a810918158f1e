"""The stick-slip cycle of one inertia on a belt, by SciPy: nothing is shared with the package."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

from scipy.integrate import solve_ivp


class Cycle(NamedTuple):
    """Time of the slip and of the whole cycle [s]; ranges of the angle and the velocity."""

    slip: float
    period: float
    lowest: float
    highest: float
    slowest: float
    fastest: float


def stick_slip(friction: Callable[[float], float], speed: float, *, damping: float = 0.0) -> Cycle:
    """Of x'' + d x' + x = mu(v - x'): a slip by DOP853 until x' is the speed v of the belt again.

    The slip begins where spring and damper overcome mu(0). During the stick the spring is stretched
    at the speed of the belt. Sticks that last less than the steps are missed.
    """

    def rates(_: float, state: Any) -> list[float]:
        x, y = state
        return [y, friction(speed - y) - x - damping * y]

    def sticks(_: float, state: Any) -> float:
        return speed - state[1]

    def turns(_: float, state: Any) -> float:
        return state[1]

    def slowest(t: float, state: Any) -> float:
        return rates(t, state)[1]

    sticks.direction, slowest.direction = -1.0, 1.0
    sticks.terminal = True
    begin = friction(0.0) - damping * speed
    run = solve_ivp(
        rates, (0.0, 9.0), [begin, speed], "DOP853", events=[sticks, turns, slowest],
        rtol=1e-13, atol=1e-15, max_step=0.03,
    )  # fmt: skip
    (slip,), ((end, _),) = run.t_events[0], run.y_events[0]
    highest, lowest = run.y_events[1][:, 0]
    ((_, least),) = run.y_events[2]
    return Cycle(slip, slip + (begin - end) / speed, lowest, highest, least, speed)
