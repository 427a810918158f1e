"""The amplitude spectrum, with the forcing and the natural frequency."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wedgebrake.errors import InputError
from wedgebrake.figures import style

if TYPE_CHECKING:
    import xarray as xr

FloatArray = NDArray[np.float64]


class Mark(NamedTuple):
    """A marked frequency [Hz], 0 if there is none; subscript as "e" of f_e, colour, dashes."""

    frequency: float
    subscript: str
    colour: str
    dashes: tuple[float, float]


@dataclass(frozen=True, eq=False)
class Spectrum:
    """Lines of an amplitude spectrum.

    frequency, amplitude : (l,) [Hz], and in ``unit``
    highest              : end of the frequency axis [Hz]
    quantity, unit       : what oscillates
    forcing, natural     : frequencies [Hz]; forcing 0: no torque acts, natural 0: no stiffness
    """

    frequency: FloatArray
    amplitude: FloatArray
    highest: float
    quantity: str = "velocity"
    unit: str = "rad/s"
    forcing: float = 0.0
    natural: float = 0.0

    @classmethod
    def of(cls, lines: xr.Dataset, highest: float | None = None) -> Spectrum:
        """Spectrum as ``wb.spectrum`` gives it, up to a frequency [Hz].

        highest : default 4 times the larger of forcing and natural frequency

        Raises ``InputError`` for a dataset that is no spectrum.
        """
        if "amplitude" not in getattr(lines, "data_vars", {}):
            raise InputError(
                f"lines = {type(lines).__name__}: must be the result of wb.spectrum(response)."
            )
        forcing = lines.attrs.get("forcing_frequency", 0.0)
        natural = lines.attrs.get("natural_frequency", 0.0)
        frequency = lines["frequency"].to_numpy()
        if highest is None:
            highest = 4.0 * max(forcing, natural) or float(frequency[-1])
        shown = frequency <= highest * (1.0 + 1e-9)
        return cls(
            frequency[shown],
            lines["amplitude"].to_numpy()[shown],
            highest,
            lines.attrs.get("quantity", "velocity"),
            lines["amplitude"].units,
            forcing,
            natural,
        )

    @property
    def top(self) -> float:
        """Largest amplitude; 0 where nothing moves."""
        return float(np.max(self.amplitude, initial=0.0))

    @property
    def marks(self) -> tuple[Mark, Mark]:
        """Forcing and natural frequency."""
        return (
            Mark(self.forcing, "e", style.FORCING, (5.0, 2.0)),
            Mark(self.natural, "n", style.NATURAL, (1.0, 1.2)),
        )
