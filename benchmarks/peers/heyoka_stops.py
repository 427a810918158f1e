"""heyoka on one inertia between two damped stops: Taylor series with terminal events.

One integrator serves the flight and both contacts, whose side is a parameter that the callbacks of
its events change; it runs from start to end inside heyoka.
"""

import math
import time

import numpy as np

import wedgebrake as wb
from peers.heyoka_machine import Motion
from peers.peer import absent


class Stops:
    """An inertia with a shaft with a gap to the ground, and a harmonic torque."""

    def __init__(self, machine: wb.Machine, until: float, tolerance: float = 1e-15) -> None:
        self.machine, self.until, self.tolerance = machine, until, tolerance

    def missing(self) -> str:
        """Why it cannot run here; "" if it can."""
        return absent("heyoka")

    def run(self) -> Motion:
        """The motion from the start, which must be inside the gap."""
        import heyoka as hy

        (body,), (shaft,), (torque,) = (
            self.machine.inertias, self.machine.shafts, self.machine.torques,
        )  # fmt: skip
        q, w = hy.make_vars("q", "w")
        low, high = shaft.gap
        side, wave = hy.par[0], torque.signal
        limit = 0.5 * (high + low) + 0.5 * side * (high - low)
        stop = shaft.stiffness * (q - limit) + shaft.damping * w
        push = wave.amplitude * hy.sin(2.0 * math.pi * wave.frequency * hy.time)
        events: list[tuple[float, int, int]] = []

        def to(new: int):
            def change(ta, _sign):
                ta.pars[0] = new
                events.append((ta.time, 0, new))
                return True

            return change

        falling = {"direction": hy.event_direction.negative}
        inside = 1.0 - side * side
        found = [
            # In the other phases these are far from zero.
            hy.t_event(inside * (high - q) + side * side, callback=to(1), **falling),
            hy.t_event(inside * (q - low) + side * side, callback=to(-1), **falling),
            hy.t_event(side * stop / shaft.stiffness + inside, callback=to(0), **falling),
        ]
        rates = [(q, w), (w, (push - side * side * stop) / body.inertia)]
        start = [body.angle, body.speed]
        ta = hy.taylor_adaptive(rates, start, t_events=found, tol=self.tolerance, pars=[0.0])
        begin = time.perf_counter()
        ta.propagate_until(self.until)
        seconds = time.perf_counter() - begin
        return Motion(np.array(ta.state), events, seconds, seconds)
