"""Harmonic balance of a machine with one brake of constant friction, in NumPy.

The alternating frequency-time method (Cameron and Griffin, J. Appl. Mech. 56 (1989), 149-154) with
the set-valued friction law itself (dynamic Lagrangian formulation: Nacivet, Pierre, Thouverez and
Jezequel, J. Sound Vib. 265 (2003), 201-219). The unknowns are the harmonics of the brake torque,
from which those of the sliding speed follow. At each instant the torque satisfies

    tau = tau + epsilon v, limited to +- its largest magnitude,

both during a stick (v = 0) and during slip (tau at the limit, with the sign of v). Newton's method
starts from the orbit at the previous frequency. Neither multipliers nor bifurcations are computed.
"""

from __future__ import annotations

import math

import numpy as np

import wedgebrake as wb
from wedgebrake.model.machine_matrices import contact_rows, masses, shaft_matrices

# Samples per period and harmonic; samples per period at which amplitudes are evaluated.
SAMPLES, FINE = 16, 4096
# Newton's method: largest number of steps, tolerance, and number of lengths that a step may have.
MOST, CONVERGED, SHORTER = 60, 1e-11, 5


class HarmonicBalance:
    """Orbits of a machine under one harmonic torque, with a given number of harmonics."""

    def __init__(self, machine: wb.Machine, harmonics: int) -> None:
        (contact,), (torque,) = machine.contacts, machine.torques
        self.mass = np.diag(masses(machine))
        self.stiffness, self.damping = shaft_matrices(machine)
        self.row = contact_rows(machine)[0]
        self.on = np.eye(len(machine.inertias))[machine.index(torque.on)]
        self.amplitude = float(torque.signal.amplitude)
        actuation, friction = contact.actuation, contact.friction
        self.limit = contact.brake.radius * friction.kinetic * actuation.initial_force
        self.count = 2 * harmonics + 1
        self.orders = np.repeat(np.arange(harmonics + 1), 2)[1:]
        self.series = self._series(2 ** math.ceil(math.log2(SAMPLES * (harmonics + 1))))
        self.project = np.linalg.pinv(self.series)
        self.forcing = np.zeros(self.count)
        self.forcing[2] = self.amplitude  # a sine
        self.friction, self.sticks = np.zeros(self.count), np.zeros(len(self.series), bool)

    def _series(self, samples: int) -> np.ndarray:
        """Values of the harmonics 1, cos t, sin t, cos 2t, ... over one period."""
        time = 2.0 * np.pi * np.arange(samples)[:, None] / samples
        phases = time * self.orders
        even = np.arange(self.count) % 2 == 0
        even[0] = False
        return np.where(even, np.sin(phases), np.cos(phases))

    def _receptance(self, omega: float, left: np.ndarray, right: np.ndarray) -> np.ndarray:
        """Harmonics of the angle ``left`` per torque on ``right``, one block for each order."""
        matrix = np.zeros((self.count, self.count))
        for order in range(self.orders[-1] + 1):
            rate = 1j * order * omega
            dynamic = self.stiffness + rate * self.damping + rate * rate * self.mass
            gain = left @ np.linalg.solve(dynamic, right)
            if order == 0:
                matrix[0, 0] = gain.real
                continue
            block = [[gain.real, gain.imag], [-gain.imag, gain.real]]
            matrix[2 * order - 1 : 2 * order + 1, 2 * order - 1 : 2 * order + 1] = block
        return matrix

    def _rates(self, omega: float) -> np.ndarray:
        """The matrix from the harmonics of a quantity to those of its rate."""
        matrix = np.zeros((self.count, self.count))
        for order in range(1, self.orders[-1] + 1):
            matrix[2 * order - 1, 2 * order] = order * omega
            matrix[2 * order, 2 * order - 1] = -order * omega
        return matrix

    def solve(self, frequency: float) -> bool:
        """Find the harmonics of the friction torque; return whether Newton's method converged."""
        omega = 2.0 * np.pi * frequency
        rates = self._rates(omega)
        free = rates @ self._receptance(omega, self.row, self.on) @ self.forcing
        own = rates @ self._receptance(omega, self.row, self.row)
        # A factor of the size of the impedance makes Newton's method converge quickly.
        factor = 1.0 / np.abs(own[1:3, 1:3]).max()
        moved = np.eye(self.count) - factor * own

        def left(friction: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            asked = self.series @ (moved @ friction + factor * free)
            limited = np.clip(asked, -self.limit, self.limit)
            return friction - self.project @ limited, limited == asked

        residual, self.sticks = left(self.friction)
        for _ in range(MOST):
            size = np.linalg.norm(residual)
            if size <= CONVERGED * self.limit:
                return True
            jacobian = np.eye(self.count) - (self.project * self.sticks) @ self.series @ moved
            step = np.linalg.solve(jacobian, residual)
            for share in 0.5 ** np.arange(SHORTER):
                further = self.friction - share * step
                residual, self.sticks = left(further)
                if np.linalg.norm(residual) < size:
                    break
            self.friction = further
        return False

    def amplitudes(self, frequency: float) -> np.ndarray:
        """Half the range of each angle [rad], for the friction torque found at this frequency."""
        omega, fine = 2.0 * np.pi * frequency, self._series(FINE)
        found = []
        for left in np.eye(len(self.row)):
            angle = self._receptance(omega, left, self.on) @ self.forcing
            angle -= self._receptance(omega, left, self.row) @ self.friction
            found.append(0.5 * np.ptp(fine @ angle))
        return np.array(found)

    def sticking(self) -> float:
        """Share of the time at rest."""
        return float(np.mean(self.sticks))
