"""The class of a motion, with its evidence."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, fields
from typing import Any, Literal

from wedgebrake.analysis.run_settings import LIMIT, protocol
from wedgebrake.model.display import Result
from wedgebrake.model.system import BrakedDriveline, check_driveline
from wedgebrake.solvers.interrupts import interruptible
from wedgebrake.solvers.simulate import check_state, choose_method


@dataclass(frozen=True, repr=False)
class Motion(Result):
    """Class of the steady motion of a system, with its evidence.

    kind              : "synchronous", "periodic", "quasi-periodic", "chaotic", "at rest",
                        "diverged", "self-locked", or "undecided" if the transient has not
                        decayed or the record is too short
    order             : periods of the torque in one period of the motion; 0 if it does not repeat.
                        If no torque acts, periods are still counted as 1/frequency: a
                        self-excited motion, which has another period, is then quasi-periodic or
                        undecided, however exactly it repeats
    stick_class       : "non-stick-slip", "unidirectional stick-slip", ..., as in ``sticks``
    status            : how the simulation ended, as ``Status``
    transient         : periods that were run before the record
    settling          : with transient="auto": periods after which the motion stayed within
                        1e-5 of its final orbit; nan where it has none
    judged            : periods that decided the class
    return_distance   : distance from repetition, relative to the size of the motion
    largest_exponent, second_exponent
                      : Lyapunov exponents [1/s]; the second is -inf where sticks remove a
                        dimension, and nan where it is not resolved (smooth)
    exponent_error    : standard error of the largest [1/s]; 0 where a periodic orbit's
                        multipliers give it exactly, nan below 16 periods
    sticks_forward, sticks_backward : sticks in a period of the torque, by side of entry
    stick_share       : share of time at rest relative to the brake
    peak_torque       : largest |R F_mu| [N m]
    friction_power    : mean power that the brake turns into heat [W]
    """

    kind: str
    order: int
    stick_class: str
    status: str
    transient: int
    settling: float
    judged: int
    return_distance: float
    largest_exponent: float
    second_exponent: float
    exponent_error: float
    sticks_forward: float
    sticks_backward: float
    stick_share: float
    peak_torque: float
    friction_power: float

    @property
    def word(self) -> str:
        """The class as one word: "synchronous", "6T-periodic", "chaotic"."""
        return f"{self.order}T-periodic" if self.kind == "periodic" else self.kind

    @property
    def verdict(self) -> str:
        """The class and its evidence in a sentence."""
        if self.kind in ("diverged", "self-locked"):
            return f"{self.word}."
        alike = not self.settled or self.stick_class == self.word
        text = self.word if alike else f"{self.word}, {self.stick_class}"
        if self.status != "completed":
            return f"{text}: the run was stopped ({self.status})."
        if self.order:
            text += f": repeats after {self.order} T to {self.return_distance:.1g} of its size"
            if not math.isnan(self.settling):
                text += f", from period {self.settling:g} on"
        elif self.kind != "at rest" and math.isfinite(self.return_distance):
            text += (
                f": in {self.judged} periods it came back no closer than"
                f" {self.return_distance:.1g} of its size"
            )
        elif self.kind != "at rest":
            text += f": {self.judged} periods are too few to tell"
        if math.isnan(self.largest_exponent):
            return f"{text}."
        error = f" +- {self.exponent_error:.1g}" if self.exponent_error > 0.0 else ""
        return f"{text}; largest exponent {self.largest_exponent:.4g}{error} 1/s."

    @property
    def settled(self) -> bool:
        """True if the class is known: the transient has decayed, or the motion has ended."""
        return self.kind != "undecided"

    def as_dict(self) -> dict[str, Any]:
        """Plain values, for JSON."""
        return {**asdict(self), "word": self.word, "verdict": self.verdict}


def motion(
    system: BrakedDriveline,
    periods: int | None = None,
    *,
    transient: int | Literal["auto"] = "auto",
    limit: int = LIMIT,
    initial: tuple[float, float] = (0.0, 0.0),
    method: str | None = None,
    rtol: float = 1e-9,
    step: float = 1e-4,
    max_events: int = 10_000_000,
    max_steps: int = 100_000_000,
) -> Motion:
    """The class of the motion that a system settles to (docs/theory.md, section 9).

    Parameters
    ----------
    system : BrakedDriveline
        System to simulate.
    periods : int
        With a number for ``transient``: number of the last period, default 250. With
        "auto": periods recorded after the transient, default 50.
    transient : int or "auto"
        Periods left out. "auto" runs windows, each twice as long as the previous, until the
        motion has settled or ``limit`` periods have passed (200, with periods=250,
        is approximately the paper's protocol).
    limit : int
        Largest number of periods to wait, with "auto".
    initial : (angle [rad], velocity [rad/s])
        State at t = 0.
    method, rtol, step, max_events, max_steps
        As in ``simulate``. Exponents come from the exact derivative of the flow with
        "exact", and from the variational equation with "smooth". The fixed step of
        "ode14x" chatters: it has no exponents, and aperiodic classes are not distinguished.

    Returns
    -------
    Motion
        ``kind``, ``order``, ``stick_class`` and the evidence; ``verdict`` states them in words.

    Raises
    ------
    InputError
        For arguments that are invalid or do not fit the friction law.
    """
    check_driveline(system)
    chosen = choose_method(system, method)
    state = check_state("initial", initial)
    wanted = protocol(
        periods, transient, limit, rtol=rtol, step=step, max_events=max_events, max_steps=max_steps
    )
    from wedgebrake.analysis.classify_run import classify_run

    result, _ = interruptible(lambda: classify_run(system, state, chosen, wanted))
    return from_result(result)


def from_result(result: Any) -> Motion:
    """A ``Motion`` from a record of ``wedgebrake.analysis.evaluate_point.RESULT``."""
    from wedgebrake.dynamics.enums import MotionClass, StickClass
    from wedgebrake.solvers.status import Status

    words: dict[str, Any] = {
        "kind": MotionClass(result["motion"]).word,
        "stick_class": StickClass(result["stick_class"]).word,
        "status": Status.of(result["outcome"]).value,
    }
    numbers = {one.name: result[one.name].item() for one in fields(Motion) if one.name not in words}
    return Motion(**words, **numbers)
