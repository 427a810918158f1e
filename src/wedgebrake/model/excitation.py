"""The torque on the driveline."""

from __future__ import annotations

import math
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from wedgebrake.model.part import Member, parameter

FloatArray = NDArray[np.float64]


class HarmonicTorque(Member):
    """T(t) = amplitude sin(2 pi frequency t).

    The frequency also fixes the period of Poincare sections where the amplitude is zero.
    """

    table: ClassVar[str] = "excitation"

    amplitude: float = parameter(
        "torque amplitude T_e", symbol="T_e", unit="N m", example=500.0, ge=0, le=1e15
    )
    frequency: float = parameter(
        "torque frequency f_e", symbol="f_e", unit="Hz", example=10.03, gt=0, ge=1e-9, le=1e9
    )

    def torque(self, time: FloatArray) -> FloatArray:
        """Torque T [N m] at an array of ``time`` [s]."""
        return np.asarray(self.amplitude * np.sin(self.angular_frequency * time))

    @property
    def angular_frequency(self) -> float:
        """2 pi f_e [rad/s]."""
        return 2.0 * math.pi * self.frequency

    @property
    def period(self) -> float:
        """1/f_e [s]."""
        return 1.0 / self.frequency
