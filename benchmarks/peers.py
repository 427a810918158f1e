"""What a user would pick instead, doing the same work: 250 periods of the paper's wedge brake.

Each function returns (run, name): ``run()`` gives the state (theta, theta') at t = 25 s.
"""

import math
from collections.abc import Callable
from importlib.metadata import version

import numba
import numpy as np
from scipy.integrate import solve_ivp

import wedgebrake as wb

END = 25.0
State = tuple[float, float]
Peer = tuple[Callable[[], State], str]


def numbers(system: wb.BrakedDriveline) -> dict[str, float]:
    """The wedge brake in plain numbers."""
    line, force = system.driveline, system.actuation
    return {
        "c": line.damping,
        "k": line.stiffness,
        "te": system.excitation.amplitude,
        "om": system.excitation.angular_frequency,
        "r": system.brake.radius,
        "tan": math.tan(system.brake.angle),
        "mu": system.friction.reference,
        "fa": force.initial_force,
        "slope": force.slope,
        "release": force.release_speed,
    }


def heyoka_coulomb(system: wb.BrakedDriveline) -> Peer:  # noqa: C901 - callbacks share its state
    """Taylor series with terminal events; stick and slip pieces are switched by callbacks."""
    import heyoka as hy

    n = numbers(system)
    gains = {s: n["r"] * n["mu"] / (n["tan"] - s * n["mu"]) for s in (1, -1)}
    upper, lower = gains[1] * n["fa"], -gains[-1] * n["fa"]
    theta, w = hy.make_vars("theta", "w")
    g2, q = hy.par[0], hy.par[1]
    drive = n["te"] * hy.sin(n["om"] * hy.time)
    equations = [(theta, w), (w, drive - n["k"] * theta - g2 * w + q)]

    def set_piece(ta, side, engaged):
        gain = gains[side] if engaged else 0.0
        ta.pars[:] = [n["c"] + gain * n["slope"], -side * gain * n["fa"]]

    def at_zero(ta, _):
        pull = n["te"] * math.sin(n["om"] * ta.time) - n["k"] * ta.state[0]
        if lower <= pull <= upper:
            return False  # rest: the caller finds its end
        set_piece(ta, 1 if pull > upper else -1, engaged=True)
        return True

    def at_release(ta, direction):
        side = 1 if ta.state[1] > 0.0 else -1
        set_piece(ta, side, engaged=direction * side < 0)
        return True

    events = [hy.t_event(w, callback=at_zero, cooldown=1e-7)]
    if math.isfinite(n["release"]):
        events += [
            hy.t_event(w - s * n["release"], callback=at_release, cooldown=1e-7)
            for s in (1.0, -1.0)
        ]
    ta = hy.taylor_adaptive(equations, [0.0, 0.0], pars=[0.0] * 2, t_events=events)
    # Leaving rest on the root of an event: the first small step is made without events.
    free = hy.taylor_adaptive(equations, [0.0, 0.0], pars=[0.0] * 2)

    def wait(level: float, phase: float) -> float:
        if level >= n["te"]:
            return math.inf
        return (math.asin(level / n["te"]) - phase) % (2.0 * math.pi) / n["om"]

    def rest(t: float, angle: float) -> tuple[float, int]:
        up = wait(upper + n["k"] * angle, n["om"] * t)
        down = wait(-lower - n["k"] * angle, n["om"] * t + math.pi)
        return t + min(up, down), 1 if up <= down else -1

    def run() -> State:
        t, angle = 0.0, 0.0
        while True:
            t, side = rest(t, angle)
            if t >= END:
                return angle, 0.0
            set_piece(free, side, engaged=True)
            free.time, free.state[:] = t, (angle, 0.0)
            free.propagate_until(t + 1e-5)
            ta.pars[:] = free.pars
            ta.time, ta.state[:] = free.time, free.state
            ta.reset_cooldowns()
            outcome = ta.propagate_until(END)[0]
            if outcome == hy.taylor_outcome.time_limit:
                return float(ta.state[0]), float(ta.state[1])
            t, angle = ta.time, float(ta.state[0])

    return run, f"heyoka {version('heyoka')}, terminal events"


def heyoka_smoothed(system: wb.BrakedDriveline, tolerance: float) -> Peer:
    """Taylor series with terminal events at the kinks of the smoothed law."""
    import heyoka as hy

    n = numbers(system)
    theta, w = hy.make_vars("theta", "w")
    side, engaged = hy.par[0], hy.par[1]
    m = n["mu"] * hy.tanh(system.friction.steepness * n["r"] * w)
    force = engaged * (n["fa"] + n["slope"] * side * w)
    torque = n["r"] * force * m / (n["tan"] - m)
    drive = n["te"] * hy.sin(n["om"] * hy.time)
    equations = [(theta, w), (w, drive - n["c"] * w - n["k"] * theta - torque)]

    def at_zero(ta, direction):
        ta.pars[0] = -1.0 if direction < 0 else 1.0
        return True

    def at_release(ta, direction):
        ta.pars[1] = 1.0 if direction * ta.state[1] < 0.0 else 0.0
        return True

    # At the border of the steep layer a step must end: beyond it the series does not see
    # the layer, and steps over a whole reversal.
    border = 10.0 / (system.friction.steepness * n["r"])
    events = [hy.t_event(w, callback=at_zero, cooldown=1e-7)]
    for s in (1.0, -1.0):
        events.append(hy.t_event(w - s * border, callback=lambda _ta, _d: True, cooldown=1e-7))
        if math.isfinite(n["release"]):
            boundary = w - s * n["release"]
            events.append(hy.t_event(boundary, callback=at_release, cooldown=1e-7))
    ta = hy.taylor_adaptive(equations, [0.0, 0.0], pars=[1.0, 1.0], t_events=events, tol=tolerance)

    def run() -> State:
        ta.time, ta.state[:], ta.pars[:] = 0.0, (0.0, 0.0), [1.0, 1.0]
        ta.reset_cooldowns()
        ta.propagate_until(END)
        return float(ta.state[0]), float(ta.state[1])

    return run, f"heyoka {version('heyoka')}, events, tol {tolerance:g}"


def scipy_smoothed(system: wb.BrakedDriveline, method: str, rtol: float) -> Peer:
    """SciPy with a compiled right side, blind to the kinks."""
    n = numbers(system)
    c, k, te, om, r, tan, mu = (n[name] for name in ("c", "k", "te", "om", "r", "tan", "mu"))
    fa, slope, steep = n["fa"], n["slope"], system.friction.steepness

    @numba.njit
    def right_side(t, y):
        m = mu * math.tanh(steep * r * y[1])
        force = max(fa + slope * abs(y[1]), 0.0)
        torque = r * force * m / (tan - m)
        return np.array([y[1], te * math.sin(om * t) - c * y[1] - k * y[0] - torque])

    def run() -> State:
        found = solve_ivp(
            right_side, (0.0, END), [0.0, 0.0], method=method, rtol=rtol, atol=rtol * 1e-2,
            max_step=2e-3,
        )  # fmt: skip
        return float(found.y[0, -1]), float(found.y[1, -1])

    return run, f"SciPy {method}, compiled right side, rtol {rtol:g}"
