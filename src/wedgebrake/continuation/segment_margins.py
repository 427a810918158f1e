"""Margins of an orbit: its distances from where a segment would begin or cease to be."""

from __future__ import annotations

import numpy as np

from wedgebrake.continuation.bifurcation_types import Margin
from wedgebrake.continuation.section import Records

# Margins of a segment; the first four are positive where the solution is an orbit.
MARGINS = np.dtype(
    [
        ("duration", np.float64),  # of the segment [rad]
        ("touch", np.float64),  # least distance inside it from a limit of velocity or torque
        ("holding", np.float64),  # at its end: from the limit of the holding torque there
        ("crossing", np.float64),  # acceleration through its end
        ("touch_phase", np.float64),  # where ``touch`` was measured [rad]
        ("touch_angle", np.float64),  # and at which angle [rad]
        ("touch_side", np.float64),  # which limit: 1 the upper, -1 the lower
    ]
)
QUANTITIES = ("duration", "touch", "holding", "crossing")


def violated(margins: Records) -> list[Margin]:
    """Margins in which a solution fails to be an orbit, segment by segment."""
    lacking = ~np.stack([margins[name] > 0.0 for name in QUANTITIES], axis=-1)
    return [Margin(int(segment), QUANTITIES[k]) for segment, k in np.argwhere(lacking)]
