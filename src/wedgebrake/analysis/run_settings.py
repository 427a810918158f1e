"""Protocol of a classification: length of the transient and of the record."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING, Any, Literal

from wedgebrake.errors import InputError
from wedgebrake.model.machine import Machine
from wedgebrake.model.validation import check_whole, wrong
from wedgebrake.solvers.simulate import check_limits

if TYPE_CHECKING:
    from wedgebrake.analysis.driveline_motion.evaluate_point import Settings

AUTO: Literal["auto"] = "auto"
# Protocol of the paper: 25 s, of which the first 20 s are left out, about 250 and 200 periods.
PERIODS, TRANSIENT = 250, 200
RECORDED = PERIODS - TRANSIENT
LIMIT, SWEEP_LIMIT = 20_000, 2048
_MOST = 5_000_000


@dataclass(frozen=True)
class Protocol:
    """Transient, record and limits of a run, in periods of the torque.

    transient : periods before the record, or "auto": as many as it takes to settle
    recorded  : periods of the record, and of the classification if ``transient`` is a number
    limit     : largest number of periods to wait for a motion to settle, with "auto"
    max_events, rtol, max_steps : limits and tolerances of the solvers, as for ``simulate``
    """

    transient: int | Literal["auto"]
    recorded: int
    limit: int = LIMIT
    max_events: int = 10_000_000
    rtol: float = 1e-9
    max_steps: int = 100_000_000

    @property
    def automatic(self) -> bool:
        """True if the transient is determined from the motion."""
        return self.transient == AUTO

    @property
    def first(self) -> int:
        """Number of the first recorded period, counted from the settled motion with "auto"."""
        return 0 if self.transient == AUTO else self.transient

    @property
    def settings(self) -> Settings:
        """The settings in the form of the exact kernel."""
        from wedgebrake.analysis.driveline_motion.evaluate_point import Settings

        transient = -1 if self.automatic else self.first
        return Settings(transient, self.recorded, self.limit, self.max_events)

    def as_dict(self) -> dict[str, Any]:
        """Plain values."""
        return asdict(self)


def returns_of(
    machine: Machine, periods: int | None, crossings: int | None
) -> tuple[int | None, str]:
    """Number of returns of a run, given as periods or as crossings, and the name of the argument.

    Raises ``InputError`` if the machine does not have returns of this kind.
    """
    if machine.autonomous:
        if periods is not None:
            raise wrong(
                "periods", periods, "None for a system without varying signals, which has no"
                " period", "Give crossings, the number of returns to the section of its motion.",
            )  # fmt: skip
        return crossings, machine.returns
    if crossings is not None:
        raise wrong(
            "crossings", crossings, "None for a system with signals that vary", "Give periods."
        )
    return periods, machine.returns


def protocol(
    periods: int | None,
    transient: int | str,
    limit: int = LIMIT,
    *,
    name: str = "periods",
    **limits: Any,
) -> Protocol:
    """The protocol requested by the user.

    periods   : with a number for ``transient``, the number of the last period (default 250);
                with "auto", the number recorded after the transient (default 50)
    transient : number of the first recorded period, or "auto"
    name      : of the argument ``periods`` to the user
    limits    : rtol, max_events and max_steps as for ``simulate``

    Raises ``InputError`` for invalid values.
    """
    asked = Protocol(AUTO, RECORDED, limit, **limits)
    check_limits(rtol=asked.rtol, max_events=asked.max_events, max_steps=asked.max_steps)
    why = " It is the longest wait for a motion to settle, in periods."
    check_whole("limit", limit, 1, _MOST, why=why)
    automatic = isinstance(transient, str)
    if automatic and transient != AUTO:
        raise InputError(
            f"transient = {transient!r}: must be a number of periods or 'auto', which runs"
            " until the motion has settled.",
            name="transient", value=transient, allowed="a number of periods or 'auto'",
        )  # fmt: skip
    last = periods if periods is not None else RECORDED if automatic else PERIODS
    why = " With transient='auto', those recorded after settling." if automatic else ""
    check_whole(name, last, 1, _MOST, why=why)
    if isinstance(transient, str):
        return replace(asked, recorded=int(last))
    check_whole("transient", transient, 0, _MOST)
    if transient >= last:
        raise InputError(
            f"transient = {transient!r}: must be below {name} = {last!r}, which counts all {name}"
            f" of the run, including those of the transient. Choose {name} ="
            f" {transient + last!r} to evaluate {last!r} after the transient, or transient ="
            " 'auto', which lasts until the motion has settled.",
            name="transient", value=transient, allowed=f"a number below {name}",
        )  # fmt: skip
    return replace(asked, transient=int(transient), recorded=int(last - transient))
