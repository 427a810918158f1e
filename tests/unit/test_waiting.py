"""Ctrl-C while Python waits for a compiled loop, and runs that must end by themselves."""

from __future__ import annotations

import subprocess
import sys

import pytest

# A program that presses Ctrl-C once a compiled loop runs, and then tells whether it has ended:
# the processor time that goes on is that of an abandoned loop.
_PROGRAM = """
import math, os, signal, threading, time
import wedgebrake as wb

def law(v):
    return 0.3 * math.tanh(100.0 * v)

paper = wb.paper.system(eta=-24.0)
systems = {{
    "custom": paper.replace(friction=wb.CustomFriction(law=law, width=0.01, kinetic=0.3)),
    "smoothed": wb.paper.system(eta=-24.0, friction="smoothed"),
    "coulomb": paper,
}}
system = systems["{law}"]
call = lambda periods: wb.simulate(
    system, periods=periods, times=[], rtol=1e-12, step=1e-6, method="{method}"
)
call(1)
signal.signal(signal.SIGINT, signal.default_int_handler)  # ignored in the background
threading.Timer(0.5, os.kill, (os.getpid(), signal.SIGINT)).start()
begin = time.monotonic()
try:
    call({periods})
except KeyboardInterrupt:
    print("heard", time.monotonic() - begin < 10.0)
before = time.process_time()
time.sleep(1.0)
print("ended", time.process_time() - before < 0.5)
"""


@pytest.mark.parametrize(
    ("law", "method", "periods"),
    [
        ("custom", "smooth", 300_000),
        ("smoothed", "smooth", 1_000_000),
        ("coulomb", "exact", 5_000_000),
        ("coulomb", "ode14x", 1_000),
    ],
)
def test_ctrl_c_ends_a_simulation(law, method, periods):
    program = _PROGRAM.format(law=law, method=method, periods=periods)
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, timeout=300
    )
    assert done.stdout.split() == ["heard", "True", "ended", "True"], done.stderr


def test_a_solver_that_makes_no_headway_ends():
    """Scales that the model refuses, put past its checks: zero-length steps count."""
    program = (
        "import wedgebrake as wb\n"
        "system = wb.paper.system(friction='smoothed').replace(initial_force=0.0)\n"
        "torque = wb.HarmonicTorque.model_construct(amplitude=1e-308, frequency=10.03)\n"
        "parts = {name: getattr(system, name) for name in type(system).model_fields}\n"
        "parts['excitation'] = torque\n"
        "response = wb.simulate(wb.BrakedDriveline(**parts), periods=3, max_steps=1000)\n"
        "print(response.attrs['status'])\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, timeout=120
    )
    assert done.stdout.split() in (["step_limit"], ["completed"]), done.stderr
