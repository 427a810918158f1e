"""What the explorer says of each class of motion."""

from __future__ import annotations

from typing import NamedTuple

from wedgebrake.dynamics.enums import MotionClass


class ClassText(NamedTuple):
    """Texts on a motion in the verdict of the explorer.

    word     : name in text; ``motion_word`` adds the order of a periodic motion
    vibrates : whether the class of stick-slip and the returns are reported
    tone     : "good", "warn", "bad" or "neutral"
    meaning  : explanation in a sentence; empty if the headline is sufficient
    detail   : a few words that replace the evidence
    headline : description of the motion, with {order} for the number of periods; without a full
               stop if further text follows
    """

    word: str
    vibrates: bool = True
    tone: str = "warn"
    meaning: str = ""
    detail: str = ""
    headline: str = ""


def text_of(one: MotionClass) -> ClassText:
    """The texts of a class of motion."""
    return ClassText(one.word, one.vibrates, **_TEXTS[one])


_TEXTS: dict[MotionClass, dict[str, str]] = {
    MotionClass.NONE: {},
    MotionClass.UNDECIDED: {
        "headline": "The motion has not settled yet, or the run is too short to tell.",
    },
    MotionClass.AT_REST: {
        "tone": "good",
        "meaning": "The brake holds: nothing moves relative to it.",
        "detail": "the brake holds",
        "headline": "Stays at rest: the brake holds.",
    },
    MotionClass.SYNCHRONOUS: {
        "tone": "good",
        "meaning": "The motion repeats in every period of the torque.",
        "headline": "Moves in step with the torque",
    },
    MotionClass.PERIODIC: {
        "meaning": "The motion repeats after several periods of the torque.",
        "headline": "Repeats every {order} periods of the torque",
    },
    MotionClass.QUASI_PERIODIC: {
        "meaning": "The motion has two frequencies without a common period.",
        "detail": "never quite repeats",
        "headline": "Moves quasi-periodically, never quite repeating",
    },
    MotionClass.CHAOTIC: {
        "tone": "bad",
        "meaning": "Small differences grow, so that long predictions are impossible.",
        "headline": "Moves chaotically",
    },
    MotionClass.DIVERGED: {
        "tone": "bad",
        "detail": "grows without bound",
        "headline": "Grows without bound: let the brake release, or make the slope less negative.",
    },
    MotionClass.SELF_LOCKED: {
        "tone": "bad",
        "detail": "cannot slide",
        "headline": "Locks itself: lower the friction, or change the brake.",
    },
    MotionClass.STEADY_SLIDING: {
        "tone": "good",
        "meaning": "The brake slides evenly.",
        "detail": "slides evenly",
        "headline": "Slides evenly",
    },
    MotionClass.LIMIT_CYCLE: {
        "meaning": "The vibration is self-excited and periodic.",
        "headline": "Vibrates by itself, without a torque",
    },
    MotionClass.FREE_VIBRATION: {
        "meaning": "Nothing damps the vibration: its amplitude is that of the initial state.",
        "headline": "Vibrates freely, without damping",
    },
    MotionClass.STEADY_ROTATION: {
        "tone": "good",
        "meaning": "All inertias turn at constant speeds.",
        "headline": "Turns evenly",
    },
}
