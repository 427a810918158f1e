"""Brake torque of a smooth law, and velocity under a linear one, along a motion."""

import math

from numba import types

from wedgebrake.dynamics.brake_torque import LAWS, SHAPES, brake_torque
from wedgebrake.dynamics.jit import compiled, compiled_for
from wedgebrake.dynamics.linear_flow import entry, state_at


@compiled
def velocities(table, pieces, w2, f, omega, start, theta, w, tau, out):
    """Store the velocities [rad/s] at the times ``tau`` after given states in ``out``.

    table    : (pieces, flow.COLUMNS) constants of the linear pieces
    pieces   : (n,) piece of each state, negative at rest
    start, theta, w: (n,) time within the period, angle and velocity of each state
    tau, out : (n, m) times after each state [s] and velocities
    """
    for i in range(pieces.size):
        if pieces[i] < 0:
            out[i, :] = w[i]
            continue
        row = table[pieces[i]]
        sin0, cos0 = math.sin(omega * start[i]), math.cos(omega * start[i])
        coefficients = entry(row, w2, omega, theta[i], w[i], sin0, cos0)
        for j in range(tau.shape[1]):
            phase = omega * (start[i] + tau[i, j])
            _, out[i, j] = state_at(
                row, w2, f, omega, theta[i], w[i], sin0, cos0, coefficients, tau[i, j],
                math.sin(phase), math.cos(phase),
            )  # fmt: skip


def _torques(laws, shapes, radius, initial_force, slope, release, v, out):
    """``brake_torque`` at each of the sliding velocities ``v`` [rad/s], into ``out`` [N m].

    laws : of friction and brake, as ``torque.gather`` gives them
    """
    friction, brake = laws[0], laws[1]
    for i in range(v.size):
        out[i] = brake_torque(
            friction, shapes[0], brake, shapes[1], radius, initial_force, slope, release, v[i]
        )


def _signature():
    """The one signature of ``torques``: laws as function pointers, so that its cache serves all."""
    real = types.float64
    vector = types.Array(real, 1, "C")
    return (LAWS, SHAPES, real, real, real, types.boolean, vector, vector)


torques = compiled_for(_signature())(_torques)
