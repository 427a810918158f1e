"""Codes shared by kernels and Python: one enumeration for each list of outcomes, kinds and classes.

Kernels compare members of an ``IntEnum`` as fast as integers. Values that are
written to results and stores must not change.
"""

from enum import IntEnum


class Outcome(IntEnum):
    """End of a run of a kernel."""

    COMPLETED = 0
    DIVERGED = 1
    NO_FORWARD_SOLUTION = 2
    """A self-locking brake cannot continue to slide, or sticks permanently on a turning shaft.

    Also if no pattern of sticks and slips of a machine is consistent.
    """
    EVENT_LIMIT = 3
    STEP_LIMIT = 4
    LOG_FULL = 5
    """The log has no room for another row; the run can be continued."""
    PAUSED = 6
    """All contacts of a machine have come to rest; the run can be continued."""
    RUNNING = 7
    """The run has not ended; inside kernels only."""


class EventKind(IntEnum):
    """Kind of a row of the segment log; those from ``STICK`` on, except ``END``, are events."""

    START = 0
    RETURN = 1
    """Return to the section at which the motion is sampled."""
    STICK = 2
    SLIP = 3
    REVERSAL = 4
    BREAKPOINT = 5
    """A speed at which the brake torque bends: of the release, or of a table of friction."""
    END = 6
    BAND_ENTERED = 7
    """The sliding velocity enters the stick band of a smooth law."""
    BAND_LEFT = 8


class SearchEnd(IntEnum):
    """End of a search for the next event of a segment.

    ``HIT_LOW`` and ``HIT_HIGH``: in slip, the velocity reached a limit of the piece; at rest,
    the torque left the holding interval there.
    """

    TIME = 0
    HIT_LOW = 1
    HIT_HIGH = 2
    WORK_LIMIT = 3


class FlowForm(IntEnum):
    """Form in which the motion on a linear piece is written (``linear_flow``)."""

    UNDERDAMPED = 0
    OVERDAMPED = 1
    CONFLUENT = 2
    BLOCKED = 3


class MotionClass(IntEnum):
    """Class of motion (docs/numerics.md, "Classes of motion"); -1 if not computed.

    Its place in legends and its colour are in ``wedgebrake.figures.data.class_styles``; what the
    explorer says of it is in ``wedgebrake.explorer.core.class_texts``.
    """

    NONE = -1
    UNDECIDED = 0
    AT_REST = 1
    SYNCHRONOUS = 2
    PERIODIC = 3
    """With two periods of the torque or more."""
    QUASI_PERIODIC = 4
    CHAOTIC = 5
    DIVERGED = 6
    SELF_LOCKED = 7
    STEADY_SLIDING = 8
    """At constant speeds, without a varying signal."""
    LIMIT_CYCLE = 9
    """Periodic without a varying signal, and approached by neighbouring motions."""
    FREE_VIBRATION = 10
    """Undamped vibration that causes no event. It attracts no other motion."""
    STEADY_ROTATION = 11
    """Of a machine without contacts, whose speed is that of the initial state."""

    @property
    def word(self) -> str:
        """Name in text; ``motion_word`` adds the order of a periodic motion."""
        names = {
            MotionClass.NONE: "not computed",
            MotionClass.QUASI_PERIODIC: "quasi-periodic",
            MotionClass.SELF_LOCKED: "self-locked",
        }
        return names.get(self, self.name.lower().replace("_", " "))

    @property
    def vibrates(self) -> bool:
        """Whether the class of stick-slip and the returns mean something."""
        return self not in (
            MotionClass.NONE, MotionClass.AT_REST, MotionClass.DIVERGED, MotionClass.SELF_LOCKED,
            MotionClass.STEADY_ROTATION,
        )  # fmt: skip

    @classmethod
    def named(cls, word: str) -> "MotionClass":
        """The class with a given ``word``."""
        return next(one for one in cls if one.word == word)


class StickClass(IntEnum):
    """Class of stick-slip; -1 if not computed."""

    NONE = -1
    AT_REST = 0
    NON_STICK_SLIP = 1
    UNIDIRECTIONAL = 2
    BIDIRECTIONAL = 3

    @property
    def word(self) -> str:
        """Name in text."""
        if self in (StickClass.UNIDIRECTIONAL, StickClass.BIDIRECTIONAL):
            return f"{self.name.lower()} stick-slip"
        names = {StickClass.NONE: "not computed", StickClass.AT_REST: "at rest"}
        return names.get(self, "non-stick-slip")


def motion_word(motion: int, order: int = 0) -> str:
    """Name of a class of motion with its order: "synchronous", "3T-periodic", "chaotic"."""
    one = MotionClass(motion)
    return f"{order}T-periodic" if one is MotionClass.PERIODIC and order else one.word
