"""Brake torque of a smooth law, and velocity under a linear one, along a motion."""

from numba import types

from wedgebrake.dynamics.brake_torque import LAWS, SHAPES, brake_torque, smooth_brake
from wedgebrake.dynamics.harmonic import phase_at
from wedgebrake.dynamics.jit import compiled, compiled_for
from wedgebrake.dynamics.linear_flow import enter, forcing_of, state_at


@compiled
def velocities(problem, modes, start, theta, w, tau, out):
    """Store the velocities [rad/s] at the times ``tau`` after given states in ``out``.

    modes    : (n,) piece of each state, negative at rest
    start, theta, w: (n,) time within the period, angle and velocity of each state
    tau, out : (n, m) times after each state [s] and velocities
    """
    forcing = forcing_of(problem.driveline, problem.torque)
    for i in range(modes.size):
        if modes[i] < 0:
            out[i, :] = w[i]
            continue
        piece = problem.brake.pieces[modes[i]]
        entry = enter(piece, forcing, theta[i], w[i], phase_at(forcing, start[i]))
        for j in range(tau.shape[1]):
            phase = phase_at(forcing, start[i] + tau[i, j])
            _, out[i, j] = state_at(piece, forcing, entry, tau[i, j], phase)


def _torques(laws, shapes, radius, initial_force, slope, release, v, out):
    """``brake_torque`` at each of the sliding velocities ``v`` [rad/s], into ``out`` [N m].

    laws : of friction and brake, as ``torque.gather`` gives them
    """
    functions = (laws[0], shapes[0], laws[1], shapes[1])
    brake = smooth_brake(functions, (radius, initial_force, slope, release))
    for i in range(v.size):
        out[i] = brake_torque(brake, v[i])


def _signature():
    """The one signature of ``torques``: laws as function pointers, so that its cache serves all."""
    real = types.float64
    vector = types.Array(real, 1, "C")
    return (LAWS, SHAPES, real, real, real, types.boolean, vector, vector)


torques = compiled_for(_signature())(_torques)
