"""The pictures of one motion, and those of another one to compare it with."""

from __future__ import annotations

from dataclasses import dataclass

from wedgebrake.figures.data.history import History
from wedgebrake.figures.data.phase import Phase
from wedgebrake.figures.data.section import Section
from wedgebrake.figures.data.spectrum import Spectrum


@dataclass(frozen=True, eq=False)
class MotionFigures:
    """Contents of the four pictures of a motion.

    history, phase, section, spectrum : the pictures
    completed : the run reached its end; otherwise it has neither section nor spectrum
    ending    : a sentence on a run that did not
    """

    history: History
    phase: Phase
    section: Section
    spectrum: Spectrum
    completed: bool = True
    ending: str = ""
