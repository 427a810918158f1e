"""The brake stated again from docs/equations.md alone, for any kind of number.

Nothing here is taken from the package but the parameters of a system, so that references
built on it are independent of its model and of its solvers.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import wedgebrake as wb


class Piece(NamedTuple):
    """Brake torque ``offset + slope v`` for sliding velocities low < v < high.

    ``offset`` is infinite where a self-locked brake cannot slide.
    """

    low: Any
    high: Any
    offset: Any
    slope: Any


class Law(NamedTuple):
    """Pieces in ascending order of velocity, and the torque held at rest, (lower, upper)."""

    pieces: tuple[Piece, ...]
    lower: Any
    upper: Any

    def at(self, v: Any) -> Piece:
        """The piece around ``v``."""
        return next(piece for piece in self.pieces if piece.low < v < piece.high)

    def beside(self, v: Any, side: int) -> Piece:
        """The piece above (side 1) or below (side -1) the boundary at ``v``, up to rounding."""
        if side > 0:
            return min(self.pieces, key=lambda piece: abs(piece.low - v))
        return min(self.pieces, key=lambda piece: abs(piece.high - v))


def gain(brake: wb.Brake, m: Any, lib: Any = math) -> Any:
    """g(m), docs/equations.md, "Amplification"; inf where the brake locks itself."""
    if isinstance(brake, wb.ConventionalBrake):
        return m
    if isinstance(brake, wb.BandBrake):
        return lib.exp(m * brake.wrap_angle) - 1
    if isinstance(brake, wb.WedgeBrake):
        top, gap = m, lib.tan(brake.angle) - m
    else:
        assert isinstance(brake, wb.LeadingShoeBrake)
        top, gap = m * brake.actuation_arm, brake.normal_arm - m * brake.friction_arm
    return top / gap if gap > 0 else math.inf


def law(system: wb.BrakedDriveline, number: type = float, lib: Any = math) -> Law:
    """R g(+-mu) F_a(|v|) with Coulomb friction as pieces over the sliding velocity v."""
    radius, force = number(system.brake.radius), number(system.actuation.initial_force)
    slope = number(system.actuation.slope)
    releases = system.actuation.release and slope < 0
    release = force / -slope if releases else math.inf
    kinetic, static = number(system.friction.kinetic), number(system.friction.static)
    # A locked brake cannot slide and holds anything, unless nothing ever presses it.
    locked = math.inf if force > 0 or slope > 0 else number(0)
    halves, holds = [], []
    for side in (-1, 1):
        sliding, resting = (gain(system.brake, side * mu, lib) for mu in (kinetic, static))
        ends = (0, release) if side > 0 else (-release, 0)
        if math.isinf(sliding):
            halves.append(Piece(*ends, side * locked, number(0)))
        else:
            halves.append(Piece(*ends, radius * sliding * force, radius * sliding * slope * side))
        holds.append(side * locked if math.isinf(resting) else radius * resting * force)
    pieces = [piece for piece in halves if piece.low < piece.high]
    if releases:
        zero = number(0)
        free = Piece(-math.inf, -release, zero, zero), Piece(release, math.inf, zero, zero)
        pieces = [free[0], *pieces, free[1]]
    return Law(tuple(pieces), *holds)


def angular_frequency(system: wb.BrakedDriveline) -> float:
    """omega_e = 2 pi f_e [rad/s]."""
    return 2.0 * math.pi * system.excitation.frequency


def coefficient(friction: wb.SmoothedFriction | wb.CustomFriction, speed: float) -> float:
    """m(v_r), eqs. 14 and 15 with the factor mu_k that the paper leaves out."""
    if isinstance(friction, wb.CustomFriction):
        return friction.law(speed)
    peak = (friction.static - friction.kinetic) * math.exp(-friction.decay * abs(speed))
    return (friction.kinetic + peak) * math.tanh(friction.steepness * speed)


def right_side(system: wb.BrakedDriveline, wall: float = 1e-9) -> Callable[..., tuple[Any, Any]]:
    """(t, (theta, theta')) -> (theta', theta''), eq. 1 with smooth friction.

    Beyond the wall of a self-locking brake the torque goes on as large as at ``wall`` of it.
    """
    line, force = system.driveline, system.actuation
    radius, omega = system.brake.radius, angular_frequency(system)

    def slope(t: float, y: Any) -> tuple[Any, Any]:
        v = y[1] + line.drive_speed
        m = coefficient(system.friction, radius * v)
        pressing = force.initial_force + force.slope * abs(v)
        if force.release:
            pressing = max(pressing, 0.0)
        g = gain(system.brake, m)
        if math.isinf(g):
            g = m / wall
        torque = system.excitation.amplitude * math.sin(omega * t) - radius * pressing * g
        return y[1], (torque - line.damping * y[1] - line.stiffness * y[0]) / line.inertia

    return slope
