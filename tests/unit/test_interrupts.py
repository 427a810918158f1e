"""Ctrl-C while Python waits for a compiled loop, and runs that must end by themselves."""

from __future__ import annotations

import subprocess
import sys
import threading
from itertools import count

from wedgebrake.solvers.interrupts import interruptible

# Presses Ctrl-C while each solver's compiled loop runs, and prints whether its thread then ends.
_INTERRUPTED = """
import math, os, signal, threading
import wedgebrake as wb

def law(v):
    return 0.3 * math.tanh(100.0 * v)

coulomb = wb.paper.system(eta=-24.0)
smoothed = wb.paper.system(eta=-24.0, friction="smoothed")
custom = coulomb.replace(friction=wb.CustomFriction(law=law, width=0.01, kinetic=0.3))
signal.signal(signal.SIGINT, signal.default_int_handler)  # ignored in the background
for system, solve, options, periods in (
    (custom, wb.simulate, {"rtol": 1e-12}, 300_000),
    (smoothed, wb.simulate, {"rtol": 1e-12}, 1_000_000),
    (coulomb, wb.simulate, {}, 5_000_000),
    (coulomb, wb.paper.ode14x, {"step": 1e-5}, 1_000),
):
    call = lambda n: solve(system, periods=n, times=[], **options)
    call(1)
    threading.Timer(0.2, os.kill, (os.getpid(), signal.SIGINT)).start()
    try:
        call(periods)
    except KeyboardInterrupt:
        others = [one for one in threading.enumerate() if one is not threading.main_thread()]
        for one in others:
            one.join(10.0)
        print("running" if any(one.is_alive() for one in others) else "ended")
"""

# Scales that the model refuses, put past its checks: steps of no length count.
_NO_HEADWAY = """
system = wb.paper.system(friction="smoothed").replace(initial_force=0.0)
torque = wb.HarmonicTorque.model_construct(amplitude=1e-308, frequency=10.03)
parts = {name: getattr(system, name) for name in type(system).model_fields}
parts["excitation"] = torque
print(wb.simulate(wb.BrakedDriveline(**parts), periods=3, max_steps=1000).attrs["status"])
"""


def test_each_solver_ends() -> None:
    """By Ctrl-C, and where it makes no headway."""
    done = subprocess.run(
        [sys.executable, "-c", _INTERRUPTED + _NO_HEADWAY],
        capture_output=True, text=True, timeout=300,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    *interrupted, status = done.stdout.split()
    assert interrupted == ["ended"] * 4
    assert status in ("step_limit", "completed")


def _interrupted_wait(at: int) -> bool:
    """Whether Ctrl-C at the given line of a wait arrived; False where the wait ended before."""
    lines = count(1)

    def trace(frame, event, _):
        if event == "line" and next(lines) == at:
            raise KeyboardInterrupt
        return trace

    def meanwhile():
        sys._getframe(1).f_trace = trace
        sys.settrace(trace)

    ended = threading.Event()
    former = sys.gettrace()
    try:
        interruptible(lambda: ended.wait(timeout=0.15), meanwhile)
    except KeyboardInterrupt:
        return True
    finally:
        sys.settrace(former)
        ended.set()
    return False


def test_ctrl_c_at_any_line_of_a_wait_is_an_interruption():
    """An interrupted wait of a condition may raise RuntimeError in place of the interruption."""
    at = 1
    while _interrupted_wait(at):
        at += 1
    assert at > 5
