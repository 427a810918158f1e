"""Ctrl-C while Python waits for a compiled loop, and runs that must end by themselves."""

from __future__ import annotations

import subprocess
import sys

import wedgebrake as wb

# A program that presses Ctrl-C once a compiled loop runs that would take minutes, and then tells
# whether it has ended: the processor time that goes on is that of an abandoned loop.
_PROGRAM = """
import os, signal, threading, time
import wedgebrake as wb

signal.signal(signal.SIGINT, signal.default_int_handler)  # ignored in the background
smoothed, coulomb = wb.paper.system(eta=-24.0, friction="smoothed"), wb.paper.system(eta=-24.0)
for system, method, periods in (
    (smoothed, "smooth", 1_000_000), (coulomb, "exact", 5_000_000), (coulomb, "ode14x", 1_000),
):
    def call(periods):
        wb.simulate(system, periods=periods, times=[], rtol=1e-12, step=1e-6, method=method)

    call(1)
    threading.Timer(0.3, os.kill, (os.getpid(), signal.SIGINT)).start()
    try:
        call(periods)
    except KeyboardInterrupt:
        print("heard")
    before = time.process_time()
    time.sleep(0.5)
    print("ended", time.process_time() - before < 0.25)
"""


def test_ctrl_c_ends_a_simulation():
    done = subprocess.run(
        [sys.executable, "-c", _PROGRAM], capture_output=True, text=True, timeout=300
    )
    assert done.stdout.split() == ["heard", "ended", "True"] * 3, done.stderr


def test_a_solver_that_makes_no_headway_ends():
    """Scales that the model refuses, put past its checks: zero-length steps count."""
    system = wb.paper.system(friction="smoothed").replace(initial_force=0.0)
    parts = {name: getattr(system, name) for name in type(system).model_fields}
    parts["excitation"] = wb.HarmonicTorque.model_construct(amplitude=1e-308, frequency=10.03)
    response = wb.simulate(wb.BrakedDriveline(**parts), periods=3, max_steps=1000)
    assert response.attrs["status"] in {"step_limit", "completed"}
