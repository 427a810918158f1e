"""The classes of motion and of stick-slip, as numbers and as words (docs/theory.md, section 9)."""

from __future__ import annotations

from enum import IntEnum

from wedgebrake.analysis.sticking import AT_REST, BIDIRECTIONAL, NON_STICK_SLIP, UNIDIRECTIONAL
from wedgebrake.dynamics import enums


class MotionClass(IntEnum):
    """Class of motion; -1 where nothing was computed.

    Counted in periods of the torque, 1/frequency, also where its amplitude is 0.
    """

    NONE = -1
    UNDECIDED = enums.UNDECIDED
    AT_REST = enums.AT_REST
    SYNCHRONOUS = enums.SYNCHRONOUS
    PERIODIC = enums.PERIODIC
    QUASI_PERIODIC = enums.QUASI_PERIODIC
    CHAOTIC = enums.CHAOTIC
    DIVERGED = enums.RUNAWAY
    SELF_LOCKED = enums.LOCKED

    @property
    def word(self) -> str:
        """For a person; a periodic motion is said with its order, see ``motion_word``."""
        return _WORDS[self]


class StickClass(IntEnum):
    """Class of stick-slip; -1 where nothing was computed."""

    NONE = -1
    AT_REST = enums.NO_SLIP
    NON_STICK_SLIP = enums.NON_STICK_SLIP
    UNIDIRECTIONAL = enums.UNIDIRECTIONAL
    BIDIRECTIONAL = enums.BIDIRECTIONAL

    @property
    def word(self) -> str:
        """For a person, as ``stick_slip_class`` says it."""
        return _STICK_WORDS[self]


_WORDS = {
    MotionClass.NONE: "not computed",
    MotionClass.UNDECIDED: "undecided",
    MotionClass.AT_REST: "at rest",
    MotionClass.SYNCHRONOUS: "synchronous",
    MotionClass.PERIODIC: "periodic",
    MotionClass.QUASI_PERIODIC: "quasi-periodic",
    MotionClass.CHAOTIC: "chaotic",
    MotionClass.DIVERGED: "diverged",
    MotionClass.SELF_LOCKED: "self-locked",
}
_STICK_WORDS = {
    StickClass.NONE: "not computed",
    StickClass.AT_REST: AT_REST,
    StickClass.NON_STICK_SLIP: NON_STICK_SLIP,
    StickClass.UNIDIRECTIONAL: UNIDIRECTIONAL,
    StickClass.BIDIRECTIONAL: BIDIRECTIONAL,
}


def motion_word(motion: int, order: int = 0) -> str:
    """A class of motion in words: "synchronous", "3T-periodic", "chaotic"."""
    one = MotionClass(motion)
    return f"{order}T-periodic" if one is MotionClass.PERIODIC and order else one.word
