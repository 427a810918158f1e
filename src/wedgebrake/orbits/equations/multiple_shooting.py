"""Multiple shooting: equations of an orbit for its points at successive returns to a section."""

from __future__ import annotations

from abc import abstractmethod
from typing import Any, Self

import numpy as np

from wedgebrake.arrays import FloatArray
from wedgebrake.orbits.equations.equations import OrbitEquations


class MultipleShooting(OrbitEquations):
    """An orbit as its points on the section; the flow must lead from each point to the next.

    order     : returns in the orbit
    dimension : coordinates of a point
    half      : whether the map is the flow over half a period of the signals, followed by the
                mirror image. On a system with odd symmetry, two such maps are a return. Their
                orbits are those which are their own mirror image half an orbit later, and their
                number of returns is odd.
    """

    differentiable = True

    def __init__(self, order: int, dimension: int, *, half: bool = False) -> None:
        self.order, self.dimension, self.half = order, dimension, half

    @abstractmethod
    def _advanced(
        self, points: FloatArray, problem: Any, *, derivative: bool = True
    ) -> tuple[FloatArray, list[FloatArray]]:
        """Next point of each point, (order, dimension), and the derivatives if requested."""

    @property
    def size(self) -> int:
        """Number of unknowns."""
        return self.order * self.dimension

    def residual(self, unknowns: FloatArray, problem: Any) -> FloatArray:
        """F(u)."""
        points = self._points(unknowns)
        ends, _ = self._advanced(points, problem, derivative=False)
        return np.asarray((ends - np.roll(points, -1, axis=0)).ravel())

    def linearize(self, unknowns: FloatArray, problem: Any) -> tuple[FloatArray, FloatArray]:
        """F(u) and its derivative."""
        points = self._points(unknowns)
        ends, derivatives = self._advanced(points, problem)
        blocks = np.zeros((self.order, self.dimension, self.order, self.dimension))
        for k, derivative in enumerate(derivatives):
            blocks[k, :, k] += derivative
            blocks[k, :, (k + 1) % self.order] -= np.eye(self.dimension)
        values = (ends - np.roll(points, -1, axis=0)).ravel()
        return values, blocks.reshape(self.size, self.size)

    def returned(self, point: FloatArray, problem: Any) -> tuple[FloatArray, FloatArray]:
        """The point one orbit later, and its derivative."""
        points, matrix = self._iterated(point, problem, self.order)
        return points[-1], matrix

    def through(self, point: FloatArray, problem: Any) -> tuple[Self, FloatArray]:
        """The equations, with the returns of a point as a guess of their unknowns."""
        return self, self._iterated(point, problem, self.order - 1)[0].ravel()

    def _iterated(
        self, point: FloatArray, problem: Any, returns: int
    ) -> tuple[FloatArray, FloatArray]:
        """Points of successive returns, (returns + 1, dimension), and the last one's derivative."""
        points, matrix = [point], np.eye(point.size)
        for _ in range(returns):
            ends, (derivative,) = self._advanced(points[-1][None], problem)
            points.append(ends[0])
            matrix = derivative @ matrix
        return np.array(points), matrix

    def halved(self, unknowns: FloatArray) -> tuple[Self, FloatArray]:
        """Equations of half the orbit, which must be its own mirror image."""
        # Half a return later is (order + 1)/2 returns later, in the mirror image.
        points = self._points(unknowns)
        steps = np.arange(self.order) * (self.order + 1) // 2 % self.order
        return type(self)(self.order, self.dimension, half=True), points[steps].ravel()

    def whole(self, unknowns: FloatArray) -> tuple[Self, FloatArray]:
        """Equations of the whole orbit."""
        if not self.half:
            return self, unknowns
        points = self._points(unknowns)[2 * np.arange(self.order) % self.order]
        return type(self)(self.order, self.dimension), points.ravel()

    def doubled(self, unknowns: FloatArray) -> tuple[Self, FloatArray]:
        """Equations of the same orbit traversed twice."""
        _, whole = self.whole(unknowns)
        return type(self)(2 * self.order, self.dimension), np.tile(whole, 2)

    def _points(self, unknowns: FloatArray) -> FloatArray:
        return unknowns.reshape(self.order, self.dimension)
