"""The actuation force and its control law (eq. 3)."""

from __future__ import annotations

from typing import Annotated, ClassVar

from pydantic import PrivateAttr, Strict, model_validator

from wedgebrake.dynamics import actuator
from wedgebrake.dynamics.actuator import Actuator, Lag
from wedgebrake.model.part import Member, parameter
from wedgebrake.model.signals.signals import OrSignal, Signal, number_of
from wedgebrake.model.validation import wrong

_Limits = Annotated[tuple[float, float], Strict(False)]


class Actuation(Member):
    """F_a = F_a0 + slope |v|  (eq. 3), and never negative where ``release`` is on.

    A brake pushed by a negative force has lost contact. ``release=False`` is the law as
    the paper prints it, with which every case of its section 4 below eta = -6 diverges.

    The force is this command after the following stages: with a ``sample_time`` (a sampled
    actuation) it is sampled at the start and at these intervals, rounded to the ``resolution`` and
    applied ``delay`` samples later; a lag of first order (``lag``) or second order (``frequency``
    and ``damping_ratio``) filters it; the ``limits`` and the release bound it.
    """

    table: ClassVar[str] = "actuation"
    later: ClassVar[frozenset[str]] = frozenset(
        ("lag", "frequency", "damping_ratio", "limits", "sample_time", "delay", "resolution")
    )

    initial_force: Annotated[float | Signal, OrSignal(0.0, 1e12)] = parameter(
        "actuation force at rest F_a0", symbol="F_a0", unit="N", example=300.0
    )
    slope: float = parameter(
        "slope of the actuation force against speed", symbol="delta", unit="N s/rad",
        example=-40.0, default=0.0, ge=-1e12, le=1e12,
    )  # fmt: skip
    release: bool = parameter(
        "whether a force below zero releases the brake", symbol="-", unit="1", example=True,
        default=True,
    )  # fmt: skip
    lag: float = parameter(
        "time constant of a lag of first order", symbol="T_a", unit="s", example=0.02,
        default=0.0, ge=0, le=1e6,
    )  # fmt: skip
    frequency: float | None = parameter(
        "natural frequency of a lag of second order", symbol="omega_a", unit="rad/s",
        example=200.0, default=None, gt=0, le=1e9,
    )  # fmt: skip
    damping_ratio: float | None = parameter(
        "damping ratio of a lag of second order", symbol="zeta_a", example=0.7, default=None,
        ge=0, le=1e3,
    )  # fmt: skip
    limits: _Limits | None = parameter(
        "lowest and highest force", unit="N", example=[0.0, 2000.0], default=None
    )
    sample_time: float | None = parameter(
        "time between the samples of the command", symbol="T_s", unit="s", example=0.001,
        default=None, gt=0, le=1e6,
    )  # fmt: skip
    delay: int = parameter("delay of a sample, in samples", example=1, default=0, ge=0, le=10_000)
    resolution: float | None = parameter(
        "step to which a sampled force is rounded", unit="N", example=0.5, default=None, gt=0,
        le=1e12,
    )  # fmt: skip
    _in_loop: bool = PrivateAttr(default=False)

    def in_loop(self, closed: bool) -> Actuation:
        """The actuation with a mark whether controllers command or measure its force.

        closed : whether they do
        """
        found = self.model_copy()
        found._in_loop = closed
        return found

    @property
    def is_in_loop(self) -> bool:
        """True if controllers command or measure its force."""
        return self._in_loop

    @model_validator(mode="after")
    def _consistent(self) -> Actuation:
        if (self.frequency is None) != (self.damping_ratio is None):
            one = "frequency" if self.frequency is None else "damping_ratio"
            raise wrong(
                f"actuation.{one}", None, "given together with the other one",
                "A lag of second order has a frequency and a damping_ratio.",
            )  # fmt: skip
        if self.lag > 0.0 and self.frequency is not None:
            raise wrong(
                "actuation.lag", self.lag, "0 where a frequency is given",
                "A lag is of first order (lag) or of second order (frequency, damping_ratio).",
            )  # fmt: skip
        if self.limits is not None and not self.limits[0] < self.limits[1]:
            raise wrong("actuation.limits", self.limits, "a lowest and a higher force, (low, high)")
        if self.limits is not None and self.release and self.limits[1] <= 0.0:
            allowed = "limits whose highest force is above 0"
            raise wrong("actuation.limits", self.limits, allowed, "This brake would never act.")
        for one, empty in (("delay", 0), ("resolution", None)):
            if self.sample_time is None and getattr(self, one) != empty:
                raise wrong(
                    f"actuation.{one}", getattr(self, one), "left out without a sample_time",
                    "Give the time between two samples, for example sample_time=0.001.",
                )  # fmt: skip
        if not self.release and not self.immediate:
            raise wrong(
                "actuation.release", False, "True with a signal, lag, limits or sampling",
                "The law without release requires a force that follows the speed at once.",
            )  # fmt: skip
        return self

    @property
    def immediate(self) -> bool:
        """True if the force is F_a0 + slope |v| at once, with a number as F_a0."""
        return self.direct and not self._force_varies

    @property
    def _force_varies(self) -> bool:
        """True if the initial force is a signal that varies."""
        return isinstance(self.initial_force, Signal) and self.initial_force.varies

    @property
    def direct(self) -> bool:
        """True if the force equals its command at once: no lag, limits, sampling or control."""
        plain = self.order == 0 and self.limits is None and self.sample_time is None
        return plain and not self._in_loop

    @property
    def begins_released(self) -> bool:
        """True if the force, which acts at once, is below zero at rest, so that it is released."""
        return self.immediate and self.release and self.law.initial_force < 0.0

    @property
    def straight(self) -> bool:
        """True if the force is `immediate`, and not released at rest but applied at speed."""
        return self.immediate and not (self.begins_released and self.slope > 0.0)

    @property
    def dynamics(self) -> Lag:
        """The lag between command and force; without states if there is none."""
        if self.frequency is not None and self.damping_ratio is not None:
            return actuator.second_order(self.frequency, self.damping_ratio)
        return actuator.first_order(self.lag) if self.lag > 0.0 else actuator.NO_LAG

    @property
    def order(self) -> int:
        """Number of states of the lag; 0 without one."""
        return len(self.dynamics.command)

    @property
    def states(self) -> int:
        """Number of states of the lag; 0 too where the command is the initial force at all times.

        A resolution rounds the command, while the lag starts at the initial force.
        """
        varies = self.slope != 0.0 or self._force_varies or self._in_loop
        return self.order if varies or self.resolution is not None else 0

    @property
    def law(self) -> Actuator:
        """The numbers of the law, in the form that the kernels for one inertia use.

        Raises ``InputError`` for a force that does not follow the speed at once.
        """
        force = number_of(self.initial_force)
        if force is None or not self.immediate:
            allowed = "a number as initial_force, without lag, limits or sampling"
            raise wrong(
                "actuation", self, allowed, "Use wb.simulate, which takes them, or leave them out."
            )
        return Actuator(force, self.slope, self.release)

    def force(self, speed: float) -> float:
        """Actuation force [N] at the sliding speed |v| [rad/s]."""
        return actuator.force(self.law, abs(speed))

    @property
    def release_speed(self) -> float:
        """Speed beyond which the brake is released [rad/s]; inf if there is none."""
        return actuator.release_speed(self.law)
