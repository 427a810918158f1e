"""Status of a simulation, with one sentence each."""

from __future__ import annotations

from enum import Enum

from wedgebrake.dynamics.enums import Outcome

DIVERGED_FACTOR = 1e6
"""Growth beyond the motion's own scale that is called divergence."""


class Status(Enum):
    """Outcome of a simulation, and the sentence that explains it."""

    COMPLETED = "completed"
    DIVERGED = "diverged"
    NO_FORWARD_SOLUTION = "no_forward_solution"
    EVENT_LIMIT = "event_limit"
    STEP_LIMIT = "step_limit"

    @classmethod
    def of(cls, outcome: int) -> Status:
        """Status of the ``outcome`` of a kernel."""
        return cls[Outcome(outcome).name]

    @property
    def outcome(self) -> Outcome:
        """The kernels' code."""
        return Outcome[self.name]

    @property
    def sentence(self) -> str:
        """Meaning of the status and a remedy."""
        return _SENTENCES[self]


_SENTENCES = {
    Status.COMPLETED: "The simulation reached its end time.",
    Status.DIVERGED: (
        "The motion grows without bound: damping is negative at the highest speeds and nothing"
        " limits it. Let the brake release (actuation.release), or make the slope less negative."
    ),
    Status.NO_FORWARD_SOLUTION: (
        "The brake locked itself: it cannot continue to slide, or no torque can break it loose from"
        " a turning shaft. Lower the friction coefficients (the static one decides at rest) or the"
        " amplification, for example with a larger wedge angle."
    ),
    Status.EVENT_LIMIT: (
        "More events, or ten times as many search steps, than max_events allows; the state is"
        " valid up to the last time. Raise max_events."
    ),
    Status.STEP_LIMIT: (
        "The integrator needed more steps than allowed, or a step below rounding; the state is"
        " valid up to the last time. Loosen rtol, lower the steepness, or raise max_steps."
    ),
}
