"""The driveline: one torsional degree of freedom on a shaft that may turn (eq. 1)."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated, ClassVar

from wedgebrake.model.part import Member, parameter
from wedgebrake.model.signal_base import OrSignal, Signal

# A number for type checkers: functions for one inertia raise an error for signals when called.
if TYPE_CHECKING:
    _Speed = float
else:
    _Speed = float | Signal


class Driveline(Member):
    """J theta'' + c theta' + k theta + R F_mu = T(t)  (eq. 1).

    ``drive_speed`` is the mean speed of the shaft, a number or a signal: the brake slides at
    ``drive_speed + theta'``. In the paper ``drive_speed`` is 0. If it is a signal, the base of the
    brake turns at -drive_speed and the other end of the shaft is fixed.
    """

    table: ClassVar[str] = "driveline"

    inertia: float = parameter(
        "moment of inertia J", symbol="J", unit="kg m^2", example=1.0, gt=0, le=1e12
    )
    damping: float = parameter(
        "viscous damping c", symbol="c", unit="N m s/rad", example=0.1, ge=0, le=1e12
    )
    stiffness: float = parameter(
        "torsional stiffness k", symbol="k", unit="N m/rad", example=1e4, ge=0, le=1e15
    )
    drive_speed: Annotated[_Speed, OrSignal(-1e6, 1e6)] = parameter(
        "mean speed of the shaft", symbol="Omega", unit="rad/s", example=0.0, default=0.0
    )

    @property
    def natural_frequency(self) -> float:
        """Angular natural frequency sqrt(k/J) [rad/s]."""
        return math.sqrt(self.stiffness / self.inertia)
