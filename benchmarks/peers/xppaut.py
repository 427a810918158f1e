"""XPPAUT without a screen: cvode on the smoothed law, compiled to its own byte code."""

import shutil
import time
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from peers.brake import Brake
from peers.peer import Answers, Peer, spoken

# XPPAUT restarts nothing at an output; between two, cvode chooses its steps, up to this one.
STEP = 2e-3
PROGRAM = """# the wedge brake, smoothed friction
par {parameters}
m = mu*tanh(steep*r*w)
theta' = w
w' = te*sin(om*t) - c*w - k*theta - r*max(fa + slope*abs(w), 0)*m/(tan0 - m)
init theta=0, w=0
@ meth=cvode, tol={rtol:g}, atol={atol:g}, total={until!r}, dt={step!r}, bound=1e6, maxstor=1000000
@ output=made.dat, trans={trans!r}
done
"""


class Xppaut(Peer):
    """The time is that of the whole program, less that of one that follows a single step."""

    law = "smoothed"
    name = "XPPAUT cvode"

    def __init__(self, rtol: float) -> None:
        self.rtol = rtol
        self.asked = f"rtol {rtol:g}, output every 2 ms"

    def missing(self) -> str:
        return "" if shutil.which("xppaut") else "not installed"

    def solve(self, brakes: Sequence[Brake], until: float) -> Answers:
        states, seconds = [], 0.0
        for brake in brakes:
            state, whole = self.run(brake, until)
            seconds += whole - self.run(brake, STEP)[1]
            states.append(state)
        return Answers(np.array(states), seconds)

    def run(self, brake: Brake, until: float) -> tuple[np.ndarray, float]:
        """State at the end, and how long the program takes from start to end."""
        numbers = brake._asdict()
        numbers["tan0"] = numbers.pop("tan")  # tan is a function there
        step = until / max(1, round(until / STEP))
        text = PROGRAM.format(
            parameters=", ".join(f"{name}={value!r}" for name, value in numbers.items()),
            rtol=self.rtol, atol=self.rtol * 1e-2, until=until, step=step, trans=until - step,
        )  # fmt: skip
        with TemporaryDirectory() as folder:
            Path(folder, "brake.ode").write_text(text, encoding="utf-8")
            start = time.perf_counter()
            spoken(["xppaut", "brake.ode", "-silent"], folder)
            seconds = time.perf_counter() - start
            made = np.loadtxt(Path(folder, "made.dat"), ndmin=2)[-1]
        if abs(made[0] - until) > 1e-3 * until:
            raise RuntimeError(f"xppaut ended at {made[0]:g} s, not at {until:g} s")
        return made[1:3], seconds


def peers() -> list[Peer]:
    """One."""
    return [Xppaut(1e-8)]
