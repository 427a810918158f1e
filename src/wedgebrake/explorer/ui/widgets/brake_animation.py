"""The stage: the brake drawn and moving, and the transport that runs through the shown time."""

from __future__ import annotations

from pathlib import Path
from typing import Any, ClassVar

import param
from panel.custom import JSComponent

from wedgebrake.explorer.core.snapshot import Moment
from wedgebrake.explorer.core.state import Desk
from wedgebrake.explorer.ui.widgets.sheets import sheets

_HERE = Path(__file__).parent


class Stage(JSComponent):
    """The machine at one instant of its motion.

    The samples come from the history's source named "motion", in the browser; ``state`` holds
    what the drawing needs beside them.
    """

    state = param.Dict(default={})

    _esm = _HERE / "stage.js"
    _stylesheets: ClassVar[list[str]] = sheets("stage.css")

    def show(self, desk: Desk, moment: Moment) -> None:
        """Show a machine in motion."""
        system = desk.system
        force, brake = system.actuation, system.brake
        self.state = {
            "kind": brake.kind,
            "shape": {
                name: getattr(brake, name) for name in type(brake).model_fields if name != "radius"
            },
            "initial_force": force.initial_force,
            "slope": force.slope,
            "release": force.release,
            "drive_speed": system.driveline.drive_speed,
            "amplitude": system.excitation.amplitude,
            "frequency": system.excitation.frequency,
            "first": _first(moment),
        }


def _first(moment: Moment) -> Any:
    """The time to begin at [s]: where the first stick ends, or the middle; None: no samples."""
    history = moment.figures.history
    if not history.time.size:
        return None
    ended = history.sticks.end[history.sticks.end < history.end]
    return float(ended[0]) if ended.size else 0.5 * (history.begin + history.end)
