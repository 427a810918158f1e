"""The class of a motion, with its evidence."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, field, fields
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from wedgebrake.analysis.run_settings import LIMIT, protocol, returns_of
from wedgebrake.dynamics.enums import MotionClass, Outcome, StickClass
from wedgebrake.model.display import Result
from wedgebrake.model.machine import Machine
from wedgebrake.model.signals.signals import check_repeat
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.model.validation import check_instance
from wedgebrake.solvers.interrupts import interruptible
from wedgebrake.solvers.kernels import method_of
from wedgebrake.solvers.machine.final_state import FinalState

if TYPE_CHECKING:
    from wedgebrake.analysis.machine_motion.result import MachineResult

# Classes that need no record of returns.
_AT_ONCE = tuple(
    one.word
    for one in (MotionClass.AT_REST, MotionClass.STEADY_SLIDING, MotionClass.STEADY_ROTATION)
)
# A speed drifts if its changes from return to return differ by at most this share of their mean, in
# a record of at least so many.
_STEADY, _FEWEST = 0.1, 8


@dataclass(frozen=True)
class ContactMotion:
    """Sticks, torque and losses of one contact of a machine in the steady motion.

    stick_class                     : "non-stick-slip", "unidirectional stick-slip", ...
    sticks_forward, sticks_backward : sticks per return, by side of entry
    stick_share                     : share of time at rest
    peak_torque                     : largest |torque| [N m]
    friction_power                  : mean power that friction turns into heat [W]
    """

    name: str
    stick_class: str
    sticks_forward: float
    sticks_backward: float
    stick_share: float
    peak_torque: float
    friction_power: float


@dataclass(frozen=True, repr=False)
class Motion(Result):
    """Class of the steady motion of a system, with its evidence.

    A motion is sampled at its returns: once per period of the signals or, if no signal varies in
    time, whenever a speed crosses the middle of its range upwards.

    kind              : "synchronous", "periodic", "quasi-periodic", "chaotic", "at rest",
                        "steady sliding", "limit cycle", "free vibration", "steady rotation",
                        "diverged", "self-locked", or "undecided" if the transient has not decayed
                        or the record is too short; "quasi-periodic" only if the returns fill a
                        curve and exclude orbits of fewer than 1000 returns
    order             : returns in one period of the motion; 0 if it does not repeat
    period            : of the motion [s]; nan if it does not repeat
    self_excited      : whether no signal varies in time
    stick_class       : "non-stick-slip", "unidirectional stick-slip", ..., as in ``sticks``; with
                        several contacts, that of the contact that sticks in most directions;
                        "not computed" without contacts
    status            : how the simulation ended, as ``Status``
    transient         : returns before the record
    settling          : with transient="auto": returns after which the motion stayed within
                        1e-5 of its final orbit; nan if it has none
    judged            : returns from which the class was determined
    return_distance   : distance from repetition, relative to the size of the motion
    exponents         : Lyapunov exponents, descending [1/s]; -inf where sticks remove a dimension,
                        nan where not resolved. A self-excited vibration has one exponent 0,
                        and another if the mean speed is conserved
    exponent_error    : standard error of the largest [1/s]; 0 where a periodic orbit's
                        multipliers give it exactly, nan below 16 returns
    sticks_forward, sticks_backward : sticks per return, by side of entry, of all contacts
    stick_share       : share of time at rest relative to the brake; largest of several contacts
    peak_torque       : largest |R F_mu| [N m]
    friction_power    : mean power that friction turns into heat [W]
    contacts          : a ``ContactMotion`` for each contact
    drifts            : of an undecided motion: the change of speed per return of
                        each inertia whose speed changes by the same amount, to 10 %, in every
                        return of the record, by its name [rad/s]
    winding           : driven bodies that wind up a shaft: for ever, whatever else moves, so that
                        no motion settles, or as long as nothing slides
    """

    kind: str
    order: int
    period: float
    self_excited: bool
    stick_class: str
    status: str
    transient: int
    settling: float
    judged: int
    return_distance: float
    exponents: tuple[float, ...]
    exponent_error: float
    sticks_forward: float
    sticks_backward: float
    stick_share: float
    peak_torque: float
    friction_power: float
    contacts: tuple[ContactMotion, ...] = ()
    drifts: dict[str, float] = field(default_factory=dict)
    winding: tuple[str, ...] = ()

    @property
    def largest_exponent(self) -> float:
        """The largest Lyapunov exponent [1/s]."""
        return self.exponents[0] if self.exponents else math.nan

    @property
    def second_exponent(self) -> float:
        """The second Lyapunov exponent [1/s]."""
        return self.exponents[1] if len(self.exponents) > 1 else math.nan

    @property
    def word(self) -> str:
        """The class as one word: "synchronous", "6T-periodic", "chaotic"."""
        return f"{self.order}T-periodic" if self.kind == "periodic" else self.kind

    @property
    def verdict(self) -> str:
        """The class and its evidence in a sentence."""
        holds = self.stick_class == StickClass.AT_REST.word
        if self.winding and (self.settled or not holds):
            why = "" if self.settled else "no motion settles: "
            return f"{self.word}: {why}{self._winds}, whose torque grows for ever."
        if self.kind in ("diverged", "self-locked"):
            return f"{self.word}."
        text = ", ".join(filter(None, (self.word, self._sticks)))
        if self.status != "completed":
            return f"{text}: the run was stopped ({self.status})."
        text += self._evidence
        one = "crossing" if self.self_excited else "period"
        for name, change in self.drifts.items():
            text += (
                f"; the speed of {name} changes by {change:.3g} rad/s per {one}: if it is meant to"
                " be constant, prescribe it by the base_speed of a contact"
            )
        if math.isnan(self.largest_exponent):
            return f"{text}."
        error = f" +- {self.exponent_error:.1g}" if self.exponent_error > 0.0 else ""
        return f"{text}; largest exponent {self.largest_exponent:.4g}{error} 1/s."

    @property
    def _evidence(self) -> str:
        """What the class in the verdict follows from, or why it is undecided."""
        returns, one = ("crossings", "crossing") if self.self_excited else ("periods", "period")
        if not self.settled and self.stick_class == StickClass.AT_REST.word:
            if self.winding:
                return (
                    f": nothing slides in the record, while {self._winds}: a contact slips later,"
                    " or is locked; record more by periods"
                )
            return (
                ": nothing slides in the record, but rest is not proved, as signals that beat may"
                " add up to a larger torque later; record more than one beat by periods"
            )
        if self.order:
            text = f" of period {self.period:.6g} s" if self.kind == "limit cycle" else ""
            after = "itself" if self.self_excited else f"after {self.order} T"
            text += f": repeats {after} to {self.return_distance:.1g} of its size"
            return text + (
                "" if math.isnan(self.settling) else f", from {one} {self.settling:g} on"
            )
        if self.kind in _AT_ONCE:
            return ""
        if self.settled and self.return_distance == 0.0:
            return ""  # returns during one stick are equal, whatever the motion
        if math.isfinite(self.return_distance):
            text = (
                f": in {self.judged} {returns} it came back no closer than"
                f" {self.return_distance:.1g} of its size"
            )
            if self.settled:
                return text
            return (
                f"{text}, which shows neither an orbit nor a torus nor chaos; a larger limit, or"
                f" more {returns} after a fixed transient, may decide"
            )
        if self.judged or not self.self_excited:
            return f": {self.judged} {returns} are too few to tell"
        return (
            "" if self.settled else ": no state returns, as a speed keeps growing or changes slowly"
        )

    @property
    def _winds(self) -> str:
        """What winds up a shaft."""
        return f"{' and '.join(self.winding)} wind{'' if len(self.winding) > 1 else 's'} up a shaft"

    @property
    def _sticks(self) -> str:
        """The class of stick-slip in the verdict; empty if it adds nothing to the motion's."""
        if not self.settled or self.stick_class in (self.word, StickClass.NONE.word):
            return ""
        return "nothing slides" if self.stick_class == StickClass.AT_REST.word else self.stick_class

    @property
    def settled(self) -> bool:
        """True if the class is known: the transient has decayed, or the motion has ended."""
        return self.kind != "undecided"

    def as_dict(self) -> dict[str, Any]:
        """Plain values, for JSON."""
        derived = ("largest_exponent", "second_exponent", "word", "verdict")
        return {**asdict(self), **{name: getattr(self, name) for name in derived}}


def motion(
    system: BrakedDriveline | Machine,
    periods: int | None = None,
    *,
    crossings: int | None = None,
    transient: int | Literal["auto"] = "auto",
    limit: int = LIMIT,
    initial: tuple[float, float] | FinalState | None = None,
    method: str | None = None,
    rtol: float = 1e-9,
    max_events: int = 10_000_000,
    max_steps: int = 100_000_000,
) -> Motion:
    """Class of the motion to which a system settles (docs/numerics.md, "Classes of motion").

    Parameters
    ----------
    system : BrakedDriveline or Machine
        System to simulate.
    periods : int
        With a number for ``transient``: number of the last period, default 250. With
        "auto": periods recorded after the transient, default 50.
    crossings : int
        Replaces ``periods`` for a system without varying signals, which has no period: number of
        returns to the section of its motion.
    transient : int or "auto"
        Number of returns discarded as transient. "auto" runs windows, each twice as long as the
        previous, until the motion has settled or ``limit`` returns have passed (200, with
        periods=250, is approximately the paper's protocol).
    limit : int
        Largest number of returns until the motion must have settled, with "auto". A larger one
        decides more of the undecided motions.
    initial : (float, float) or FinalState
        State at t = 0. For a driveline: angle [rad] and velocity [rad/s], 0 by default. For a
        machine: as in ``simulate``.
    method, rtol, max_events, max_steps
        As in ``simulate``. Exponents come from the exact derivative of the flow with
        "exact", and from the variational equation with "smooth".

    Returns
    -------
    Motion
        ``kind``, ``order``, ``stick_class`` and the evidence; ``verdict`` summarises them.

    Raises
    ------
    InputError
        For arguments that are invalid or do not fit the friction law.
    """
    limits: dict[str, Any] = {"rtol": rtol, "max_events": max_events, "max_steps": max_steps}
    check_instance("system", system, BrakedDriveline | Machine, "a BrakedDriveline or a Machine")
    chosen = method_of(system, method)
    check_repeat(system.signals())
    returns, name = returns_of(system.machine, periods, crossings)
    wanted = protocol(returns, transient, limit, name=name, **limits)
    from wedgebrake.analysis.evaluate import begun_at, classify_machine
    from wedgebrake.analysis.machine_motion.result import with_free_angle

    machine, state = begun_at(system, initial)
    result = interruptible(lambda: classify_machine(machine, wanted, state, chosen))
    if system.view.single:
        result.exponents = with_free_angle(result.exponents)
    return _motion(result, machine)


def _motion(result: MachineResult, machine: Machine) -> Motion:
    """A ``Motion`` from a result."""
    from wedgebrake.analysis.machine_motion.coordinates import winding_bodies
    from wedgebrake.solvers.status import Status

    found, inertias, contacts = result.contacts, machine.inertia_names, machine.contact_names
    unsettled = result.motion == MotionClass.UNDECIDED and result.outcome == Outcome.COMPLETED
    held = bool(np.all(found.stick_class == StickClass.AT_REST))
    locked = result.motion == MotionClass.SELF_LOCKED
    winding = winding_bodies(machine, held=held or locked) if unsettled or locked else ()
    of_contacts = tuple(
        ContactMotion(
            name=name,
            stick_class=StickClass(found.stick_class[i]).word,
            sticks_forward=float(found.sticks[i, 0]),
            sticks_backward=float(found.sticks[i, 1]),
            stick_share=float(found.stick_share[i]),
            peak_torque=float(found.peak_torque[i]),
            friction_power=float(found.friction_power[i]),
        )
        for i, name in enumerate(contacts)
    )
    sticks = found.sticks.sum(axis=0)
    own: dict[str, Any] = {
        "kind": result.motion.word,
        "stick_class": StickClass(found.stick_class.max(initial=StickClass.NONE)).word,
        "status": Status.of(result.outcome).value,
        "exponents": tuple(map(float, result.exponents)),
        "sticks_forward": float(sticks[0]),
        "sticks_backward": float(sticks[1]),
        "stick_share": float(found.stick_share.max(initial=0.0)),
        "peak_torque": float(found.peak_torque.max(initial=0.0)),
        "friction_power": float(found.friction_power.sum()),
        "contacts": of_contacts,
        "drifts": _drifts(result, inertias),
        "winding": winding,
    }
    return Motion(
        **own,
        **{one.name: getattr(result, one.name) for one in fields(Motion) if one.name not in own},
    )


def _drifts(result: MachineResult, names: tuple[str, ...]) -> dict[str, float]:
    """Changes of speed per return that are the same in all returns of an undecided motion."""
    n = len(names)
    changes = np.diff(result.points[:, n : 2 * n], axis=0)
    # The first state of a record need not be a return.
    changes = changes[np.isfinite(changes).all(axis=1)]
    if result.motion != MotionClass.UNDECIDED or len(changes) < _FEWEST:
        return {}
    mean = changes.mean(axis=0)
    steady = (np.ptp(changes, axis=0) <= _STEADY * np.abs(mean)) & (mean != 0.0)
    return {names[i]: float(mean[i]) for i in np.flatnonzero(steady)}
