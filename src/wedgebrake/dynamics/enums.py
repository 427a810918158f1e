"""Codes shared by kernels and Python: one enumeration for each list of outcomes, kinds and classes.

Kernels compare members of an ``IntEnum`` as fast as integers. Values that are
written to results and stores must not change.
"""

from enum import IntEnum
from typing import NamedTuple


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


class Comparison(IntEnum):
    """Criterion by which motions of a class are identified as one attractor."""

    NONE = 0
    """The motions are not attractors."""
    REST = 1
    """All motions are one attractor."""
    ORBIT = 2
    """Their Poincare points coincide."""
    CLOUD = 3
    """Their Poincare points cover the same set."""
    AVERAGES = 4
    """Their ranges and averages coincide."""


class AboutMotion(NamedTuple):
    """Name and description of a class of motion in reports and the explorer.

    word       : name in text; ``motion_word`` adds the order of a periodic motion
    comparison : criterion by which motions are identified as one attractor
    vibrates   : whether the class of stick-slip and the returns are reported
    tone       : "good", "warn" or "bad"
    meaning    : explanation in a sentence; empty if the headline is sufficient
    detail     : a few words that replace the evidence
    headline   : description of the motion, with {order} for the number of periods; without a full
                 stop if further text follows
    """

    word: str
    comparison: Comparison = Comparison.NONE
    vibrates: bool = True
    tone: str = "warn"
    meaning: str = ""
    detail: str = ""
    headline: str = ""


_UNKNOWN = AboutMotion("")


class MotionClass(IntEnum):
    """Class of motion (docs/numerics.md, "Classes of motion"); -1 if not computed.

    Each member has its code and, as ``about``, its name and description. Its place in legends and
    its colour are in ``wedgebrake.figures.data.class_styles``.
    """

    about: AboutMotion

    def __new__(cls, code: int, about: AboutMotion = _UNKNOWN) -> "MotionClass":
        """Create a member from its code and description; lookups use the code alone."""
        member = int.__new__(cls, code)
        member._value_, member.about = code, about
        return member

    NONE = -1, AboutMotion("not computed", vibrates=False)
    UNDECIDED = 0, AboutMotion(
        "undecided",
        headline="The motion has not settled yet, or the run is too short to tell.",
    )  # fmt: skip
    AT_REST = 1, AboutMotion(
        "at rest", comparison=Comparison.REST, vibrates=False,
        tone="good", meaning="The brake holds: nothing moves relative to it.",
        detail="the brake holds", headline="Stays at rest: the brake holds.",
    )  # fmt: skip
    SYNCHRONOUS = 2, AboutMotion(
        "synchronous", comparison=Comparison.ORBIT, tone="good",
        meaning="The motion repeats in every period of the torque.",
        headline="Moves in step with the torque",
    )  # fmt: skip
    PERIODIC = 3, AboutMotion(
        "periodic", comparison=Comparison.ORBIT,
        meaning="The motion repeats after several periods of the torque.",
        headline="Repeats every {order} periods of the torque",
    )  # fmt: skip
    """With two periods of the torque or more."""
    QUASI_PERIODIC = 4, AboutMotion(
        "quasi-periodic", comparison=Comparison.CLOUD,
        meaning="The motion has two frequencies without a common period.",
        detail="never quite repeats", headline="Moves quasi-periodically, never quite repeating",
    )  # fmt: skip
    CHAOTIC = 5, AboutMotion(
        "chaotic", comparison=Comparison.CLOUD, tone="bad",
        meaning="Small differences grow, so that long predictions are impossible.",
        headline="Moves chaotically",
    )  # fmt: skip
    DIVERGED = 6, AboutMotion(
        "diverged", vibrates=False, tone="bad",
        detail="grows without bound",
        headline="Grows without bound: let the brake release, or make the slope less negative.",
    )  # fmt: skip
    SELF_LOCKED = 7, AboutMotion(
        "self-locked", vibrates=False, tone="bad",
        detail="cannot slide",
        headline="Locks itself: lower the friction, or change the brake.",
    )  # fmt: skip
    STEADY_SLIDING = 8, AboutMotion(
        "steady sliding", comparison=Comparison.AVERAGES, tone="good",
        meaning="The brake slides evenly.", detail="slides evenly", headline="Slides evenly",
    )  # fmt: skip
    """At constant speeds, without a varying signal."""
    LIMIT_CYCLE = 9, AboutMotion(
        "limit cycle", comparison=Comparison.AVERAGES,
        meaning="The vibration is self-excited and periodic.",
        headline="Vibrates by itself, without a torque",
    )  # fmt: skip
    """Periodic without a varying signal, and approached by neighbouring motions."""
    FREE_VIBRATION = 10, AboutMotion(
        "free vibration",
        meaning="Nothing damps the vibration: its amplitude is that of the initial state.",
        headline="Vibrates freely, without damping",
    )  # fmt: skip
    """Undamped vibration that causes no event. It attracts no other motion."""
    STEADY_ROTATION = 11, AboutMotion(
        "steady rotation", vibrates=False, tone="good",
        meaning="All inertias turn at constant speeds.", headline="Turns evenly",
    )  # fmt: skip
    """Of a machine without contacts, whose speed is that of the initial state."""

    @property
    def word(self) -> str:
        """Name in text; ``motion_word`` adds the order of a periodic motion."""
        return self.about.word

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
