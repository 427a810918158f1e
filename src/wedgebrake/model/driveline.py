"""The driveline: one torsional degree of freedom on a shaft that may turn (eq. 1)."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from wedgebrake.model.part import Member, parameter
from wedgebrake.model.signals.signal_base import OrSignal, Signal, number_of
from wedgebrake.model.validation import check_number, is_number, wrong

_MOST_DAMPED = 1e3


class Driveline(Member):
    """J theta'' + c theta' + k theta + R F_mu = T(t)  (eq. 1).

    ``drive_speed`` is the mean speed of the shaft, a number or a signal: the brake slides at
    ``drive_speed + theta'``. In the paper ``drive_speed`` is 0. If it is a signal, the base of the
    brake turns at -drive_speed and the other end of the shaft is fixed.

    ``damping_ratio`` can be given instead of ``damping``, which is then 2 damping_ratio sqrt(J k)
    and does not follow later changes of J and k; ``BrakedDriveline.replace`` takes ``damping``.
    """

    table: ClassVar[str] = "driveline"
    alternatives: ClassVar[dict[str, tuple[str, Any]]] = {
        "damping_ratio": (
            "damping",
            parameter(
                "damping ratio, c = 2 damping_ratio sqrt(J k)", symbol="zeta", example=0.02,
                ge=0, le=_MOST_DAMPED,
            ),
        )
    }  # fmt: skip

    inertia: float = parameter(
        "moment of inertia J", symbol="J", unit="kg m^2", example=1.0, gt=0, le=1e12
    )
    damping: float = parameter(
        "viscous damping c", symbol="c", unit="N m s/rad", example=0.1, ge=0, le=1e12
    )
    stiffness: float = parameter(
        "torsional stiffness k", symbol="k", unit="N m/rad", example=1e4, ge=0, le=1e15
    )
    drive_speed: Annotated[float | Signal, OrSignal(-1e6, 1e6)] = parameter(
        "mean speed of the shaft", symbol="Omega", unit="rad/s", example=0.0, default=0.0
    )

    if TYPE_CHECKING:

        def __init__(
            self,
            *,
            inertia: float,
            stiffness: float,
            damping: float = ...,
            damping_ratio: float = ...,
            drive_speed: float | Signal = 0.0,
        ) -> None: ...

    @classmethod
    def _completed(cls, data: dict[str, Any]) -> dict[str, Any]:
        """The values with the damping that a damping ratio gives."""
        if "damping_ratio" not in data:
            return data
        values = dict(data)
        ratio = values.pop("damping_ratio")
        name = f"{cls.table}.damping_ratio"
        if "damping" in values:
            raise wrong(name, ratio, "left out where damping is given", "Give one of them.")
        ratio = check_number(name, ratio, 0.0, _MOST_DAMPED)
        product = 1.0
        for other in ("inertia", "stiffness"):
            one = values.get(other)
            # What is wrong with the others is reported of them.
            product *= max(float(one), 0.0) if is_number(one) else 0.0  # type: ignore[arg-type]
        return {**values, "damping": 2.0 * ratio * math.sqrt(product)}

    @property
    def natural_frequency(self) -> float:
        """Angular natural frequency sqrt(k/J) [rad/s]."""
        return math.sqrt(self.stiffness / self.inertia)

    @property
    def constant_speed(self) -> float:
        """The mean speed of the shaft as a number [rad/s], as the kernels for one inertia take it.

        Raises ``InputError`` for a signal.
        """
        speed = number_of(self.drive_speed)
        if speed is None:
            advice = "Use wb.simulate, which takes signals, or give its mean."
            raise wrong(f"{self.table}.drive_speed", self.drive_speed, "a number", advice)
        return speed
