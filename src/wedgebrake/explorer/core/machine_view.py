"""Contents of the page for a machine with several inertias: sentences and a picture."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from wedgebrake.analysis.linear_stability import stability, unpressed_sentences
from wedgebrake.analysis.responses.contacts import contact_sentences
from wedgebrake.errors import InputError
from wedgebrake.explorer.core.limits import MOST_EVENTS
from wedgebrake.figures.matplotlib.machine import history
from wedgebrake.figures.matplotlib.save import image
from wedgebrake.model.machine import Machine
from wedgebrake.model.studies.study import Study
from wedgebrake.solvers.simulate import simulate

# Width of the picture [pixels].
_WIDTH = 1800


@dataclass(frozen=True)
class MachineView:
    """Contents of the page for a machine.

    headline  : the machine in words
    sentences : on linear stability, the end of the run and each contact
    picture   : PNG of the response
    """

    headline: str
    sentences: tuple[str, ...]
    picture: bytes


def take_machine_view(study: Study) -> MachineView:
    """Simulate the machine of a study, within the limits of the explorer.

    Raises ``InputError`` as ``wb.simulate``.
    """
    machine: Any = study.system
    arguments = study.arguments()
    arguments["max_events"] = min(study.run.max_events, MOST_EVENTS)
    response = simulate(machine, **arguments)
    return MachineView(
        machine._headline(),
        (*_stability(machine), response.attrs["message"], *contact_sentences(response)),
        image(history(response), "png", width=_WIDTH),
    )


def _stability(machine: Machine) -> list[str]:
    try:
        found = stability(machine)
    except InputError as error:
        return [f"Linear stability: {error}"]
    return [f"Linear stability: {found.verdict}", *unpressed_sentences(machine, found)]
