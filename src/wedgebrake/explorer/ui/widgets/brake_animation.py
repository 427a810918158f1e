"""The brake drawn in motion, with playback controls."""

from __future__ import annotations

from pathlib import Path
from typing import Any, ClassVar

import param
from panel.custom import JSComponent

from wedgebrake.explorer.core.snapshot import Snapshot
from wedgebrake.explorer.core.state import PageState
from wedgebrake.explorer.ui.widgets.controls import style_sheet


class BrakeAnimation(JSComponent):
    """The system at one instant of its motion.

    Samples of the motion, of the actuation force and of the torques come from the source
    "motion" of the time history, in the browser; ``state`` holds the other inputs of the drawing.
    """

    state = param.Dict(default={})

    _esm = Path(__file__).with_name("brake_animation.js")
    _stylesheets: ClassVar[list[str]] = [style_sheet("brake_animation.css")]

    def show(self, state: PageState, snapshot: Snapshot) -> None:
        """Show a machine in motion."""
        system, brake = state.system, state.system.brake
        self.state = {
            "schematic": brake.schematic,
            "name": brake.kind,
            "shape": {
                name: getattr(brake, name) for name in type(brake).model_fields if name != "radius"
            },
            "drive_speed": system.driveline.drive_speed,
            "amplitude": system.excitation.amplitude,
            "frequency": system.excitation.frequency,
            "first": _first(snapshot),
        }


def _first(snapshot: Snapshot) -> Any:
    """Return the time to begin at [s]: the end of the first stick phase, or the middle."""
    history = snapshot.figures.history
    if not history.time.size:
        return None
    ended = history.sticks.end[history.sticks.end < history.end]
    return float(ended[0]) if ended.size else 0.5 * (history.begin + history.end)
