"""The brake drawn in motion, with playback controls."""

from __future__ import annotations

from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import param
from panel.custom import JSComponent

from wedgebrake.explorer.core.snapshot import Discs, Snapshot
from wedgebrake.explorer.core.state import PageState
from wedgebrake.explorer.ui.widgets.controls import style_sheet
from wedgebrake.figures.data.sketch import RADIUS, Sketch
from wedgebrake.model.signals.signals import number_of
from wedgebrake.model.system_base import System


class BrakeAnimation(JSComponent):
    """The system at one instant of its motion.

    Samples of the motion, of the actuation force and of the torques come from the source
    "motion" of the time history, in the browser; ``state`` holds the other inputs of the drawing.
    """

    state = param.Dict(default={})

    _esm = Path(__file__).with_name("brake_animation.js")
    _stylesheets: ClassVar[list[str]] = [style_sheet("brake_animation.css")]

    def show(self, state: PageState, snapshot: Snapshot) -> None:
        """Show a machine in motion: the brake of one inertia, or the sketch of other machines."""
        machine = state.system.machine
        common = {"frequency": 1.0 / state.cycle, "first": _first(snapshot)}
        contact = next(
            (one for one in machine.contacts if one.name == (state.contact or one.name)), None
        )
        if snapshot.discs is not None or contact is None:
            self.state = {**common, **_sketch(state.system, snapshot)}
            return
        brake = contact.brake
        self.state = {
            **common,
            "schematic": brake.schematic,
            "name": brake.kind,
            "shape": {
                name: getattr(brake, name) for name in type(brake).model_fields if name != "radius"
            },
            "drive_speed": -(number_of(contact.base_speed) or 0.0),
            "amplitude": float(np.abs(snapshot.figures.history.drive_torque).max(initial=0.0)),
        }


def _sketch(system: System, snapshot: Snapshot) -> dict[str, Any]:
    """The sketch of a machine, and the motion of its bodies and contacts."""
    discs, history, sketch = snapshot.discs, snapshot.figures.history, Sketch.of(system)
    if discs is None:  # of a run without samples
        discs = Discs(history.time, {sketch.discs[0].name: history.angle}, {}, {})
    return {
        "sketch": {
            "box": sketch.box,
            "radius": RADIUS,
            "lines": [one._asdict() for one in sketch.lines],
            "texts": [one._asdict() for one in sketch.texts],
        },
        "discs": [
            {**one._asdict(), "angle": discs.angles[one.name].tolist()} for one in sketch.discs
        ],
        "times": discs.time.tolist(),
        "contacts": [
            {"name": name, "sticking": one.tolist(), "torque": discs.torques[name].tolist()}
            for name, one in discs.sticking.items()
        ],
    }


def _first(snapshot: Snapshot) -> Any:
    """Return the time to begin at [s]: the end of the first stick phase, or the middle."""
    history = snapshot.figures.history
    if not history.time.size:
        return None
    ended = history.sticks.end[history.sticks.end < history.end]
    return float(ended[0]) if ended.size else 0.5 * (history.begin + history.end)
