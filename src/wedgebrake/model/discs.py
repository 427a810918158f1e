"""Discs that a contact heats: models of the temperature at their surface."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, ClassVar

from wedgebrake.model.part import Positional, parameter


class LumpedDisc(Positional):
    """A disc of uniform temperature: mass specific_heat dT/dt = P, without cooling."""

    table: ClassVar[str] = "disc"

    mass: float = parameter("mass", symbol="m", unit="kg", example=8.0, gt=0, le=1e12)
    specific_heat: float = parameter(
        "specific heat capacity", symbol="c_p", unit="J/(kg K)", example=500.0, gt=0, le=1e9
    )

    if TYPE_CHECKING:

        def __init__(self, mass: float, specific_heat: float) -> None: ...


class SemiInfiniteDisc(Positional):
    """A thick disc that is heated on an area of its surface and conducts the heat inwards.

    Its surface temperature rises by 1/(e sqrt(pi)) times the integral of q(s)/sqrt(t - s) ds up to
    the time t, with the heat flux q = P/area and the effusivity e. Valid as long as the heat does
    not reach the far side: for times short compared to d^2/a, with the thickness d and the
    diffusivity a = conductivity/(density specific_heat).
    """

    table: ClassVar[str] = "disc"

    conductivity: float = parameter(
        "thermal conductivity", symbol="k", unit="W/(m K)", example=50.0, gt=0, le=1e9
    )
    density: float = parameter("density", symbol="rho", unit="kg/m^3", example=7200.0, gt=0, le=1e9)
    specific_heat: float = parameter(
        "specific heat capacity", symbol="c_p", unit="J/(kg K)", example=500.0, gt=0, le=1e9
    )
    area: float = parameter("heated area", symbol="A", unit="m^2", example=0.04, gt=0, le=1e9)

    if TYPE_CHECKING:

        def __init__(
            self, conductivity: float, density: float, specific_heat: float, area: float
        ) -> None: ...

    @property
    def effusivity(self) -> float:
        """Thermal effusivity sqrt(k rho c_p) [W sqrt(s)/(m^2 K)]."""
        return math.sqrt(self.conductivity * self.density * self.specific_heat)
