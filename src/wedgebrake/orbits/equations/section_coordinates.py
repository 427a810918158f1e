"""Coordinates of the section of a machine, which do not depend on the parameters that vary."""

from __future__ import annotations

import numpy as np
from scipy.linalg import block_diag, null_space

from wedgebrake.analysis.machine_motion.coordinates import Coordinates
from wedgebrake.arrays import FloatArray
from wedgebrake.solvers.machine.passage import Crossing

# Entries of the map from angles to scaled coordinates and back that show no free rotation.
NO_ROTATION = 1e-9


class SectionCoordinates:
    """Coordinates u of a section, and of the forces that sampled actuations delay.

    The scaled coordinates of the state at a point are ``origin + basis u``; the forces have the
    units ``space.delayed``.

    space    : scaled coordinates of the state
    crossing : the section; None for one return per period of the signals
    inertias : number of inertias, with driven bodies

    to      : (size, rows) coordinates of a deviation of the states and delayed forces at a point
    back    : (rows, size) the inverse, for deviations along the section
    mirror  : (p + delayed,) signs of scaled coordinates and delayed forces in the mirror image
    watched : (p + states, states) factors of the states in scaled coordinates, then of each state
    signs   : (p + states,) of these in the mirror image
    restrained : (inertias, f) part of the angles of free motions that shafts restrain
    free    : (inertias,) whether an inertia can rotate freely
    """

    def __init__(self, space: Coordinates, crossing: Crossing | None, inertias: int) -> None:
        self.space, self.crossing = space, crossing
        states = space.to.shape[1]
        self.watched = np.vstack([space.to, np.eye(states)])
        self.restrained = (space.back @ space.to)[:inertias, :inertias] @ space.motions
        apart = np.abs(self.restrained - space.motions).max(axis=1)
        self.free = apart > NO_ROTATION
        self.origin, self.basis = np.zeros(space.size), np.eye(space.size)
        if crossing is not None:
            row = np.array(crossing.row) @ space.back
            self.origin = row * (crossing.level / (row @ row))
            self.basis = null_space(row[None, :])
        self.to = block_diag(self.basis.T @ space.to, np.diag(1.0 / space.delayed))
        self.back = block_diag(space.back @ self.basis, np.diag(space.delayed))
        # Forces, which are the states of lags, are the same in the mirror image.
        self.mirror = np.ones(space.size + space.delayed.size)
        self.mirror[: space.speeds.stop] = -1.0
        of_states = np.where(np.arange(states) < 2 * inertias, -1.0, 1.0)
        self.signs = np.append(self.mirror[: space.size], of_states)

    @property
    def delays(self) -> bool:
        """True if a sampled actuation delays its forces."""
        return self.space.delayed.size > 0

    def states(self, points: FloatArray) -> FloatArray:
        """States (..., states) of points (..., size), without free rotation and driven bodies."""
        points = points[..., : self.basis.shape[1]]
        return np.asarray((self.origin + points @ self.basis.T) @ self.space.back.T)

    def delayed(self, point: FloatArray) -> FloatArray:
        """Forces that sampled actuations delay at a point [N]."""
        return np.asarray(point[self.basis.shape[1] :] * self.space.delayed)

    def points(self, states: FloatArray) -> FloatArray:
        """Points of states, projected onto the section, without the forces that are delayed."""
        return np.asarray((states @ self.space.to.T - self.origin) @ self.basis)
