"""Controllers of a machine: proportional, integral and derivative feedback with limits."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from pydantic import AfterValidator, BeforeValidator, Field, Strict, model_validator

from wedgebrake.model.machine_parts import Factors, Name, Named, factors, own_name
from wedgebrake.model.part import parameter
from wedgebrake.model.signals.signals import OrSignal, Signal
from wedgebrake.model.validation import NotAllowedError

_LARGEST = 1e15
_LONGEST_DELAY = 100
_MEASURED = ("angle", "speed", "torque", "force")
COMMAND, TORQUE = "command", "torque"
"""What the output of a controller is: part of the command of an actuation, or a torque."""


def _measured(value: Any) -> Any:
    """Factors of measured quantities by dotted name, also from the nested tables of a study."""
    allowed = 'a mapping of measured quantities to factors, such as {"disc.speed": 1.0}'
    found = factors(value, _MEASURED, allowed)
    if not found:
        raise NotAllowedError(allowed)
    return found


def _output(value: Any) -> Any:
    part, _, what = value.rpartition(".") if isinstance(value, str) else ("", "", "")
    if not part or what not in (COMMAND, TORQUE):
        raise NotAllowedError(
            'the command of a brake, such as "brake.command", or a torque on an inertia, such as'
            ' "motor.torque"'
        )
    return value


_Measured = Annotated[
    dict[str, Annotated[float, Field(ge=-_LARGEST, le=_LARGEST)]],
    BeforeValidator(_measured), AfterValidator(Factors),
]  # fmt: skip


def _gain(description: str, symbol: str, example: float) -> Any:
    return parameter(
        description, symbol=symbol, unit="-", example=example, default=0.0, ge=-_LARGEST,
        le=_LARGEST,
    )  # fmt: skip


class Controller(Named):
    """A PID controller with the output K_p e + K_i times the integral of e + K_d times de/dt.

    The error e is the setpoint minus the measured quantity, a linear combination of angles
    ("disc.angle"), speeds ("disc.speed"), torques of shafts ("shaft.torque") and actuation forces
    ("brake.force", of an actuation with a lag). The output is added to the command of an actuation
    ("brake.command"), before its sampling and lag, or is a torque on an inertia ("motor.torque").

    The derivative part is filtered: K_d de/dt passes through a first-order lag with the time
    constant ``filter_time``. The filter starts at the initial error, the integral at 0. While the
    output is at one of its ``limits`` and the error drives it further out, the integral does not
    change. Where integration would drive the output out of the limit, but the output would return
    within it without integration, the integral changes at the rate that keeps the output at the
    limit.

    With a ``sample_time`` T the controller is digital. At the start and at intervals of T after it,
    it samples e, adds K_i T e to its sum, unless the output would be beyond a limit and K_i e
    drives it further out, and sets its derivative part D to
    (T_f D + K_d (e - e_before))/(T_f + T). The output, rounded to the ``resolution`` and limited,
    is applied ``delay`` samples later and held for one sample time. Until the first output is
    applied, the output is 0.
    """

    table: ClassVar[str] = "controller"
    listed: ClassVar[frozenset[str]] = frozenset({"limits"})

    name: Name = own_name()
    measured: _Measured = parameter(
        "factors of the measured quantities", unit="-", example={"disc.speed": 1.0}
    )
    setpoint: Annotated[float | Signal, OrSignal(-_LARGEST, _LARGEST)] = parameter(
        "setpoint of the measured quantity, a number or a signal", symbol="r", unit="-",
        example=10.0,
    )  # fmt: skip
    output: Annotated[str, BeforeValidator(_output)] = parameter(
        "what it acts on", unit="-", example="motor.torque"
    )
    proportional: float = _gain("proportional gain", "K_p", 20.0)
    integral: float = _gain("integral gain", "K_i", 50.0)
    derivative: float = _gain("derivative gain", "K_d", 0.1)
    filter_time: float | None = parameter(
        "time constant of the filter of the derivative", symbol="T_f", unit="s", example=0.01,
        default=None, gt=0, le=1e6,
    )  # fmt: skip
    limits: Annotated[tuple[float, float], Strict(False)] | None = parameter(
        "lowest and highest output", symbol="u", unit="-", example=[0.0, 2000.0], default=None
    )
    sample_time: float | None = parameter(
        "time between the samples of a digital controller", symbol="T_s", unit="s", example=0.001,
        default=None, gt=0, le=1e6,
    )  # fmt: skip
    delay: int = parameter(
        "delay of the output, in samples", example=1, default=0, ge=0, le=_LONGEST_DELAY
    )
    resolution: float | None = parameter(
        "step to which a sampled output is rounded", unit="-", example=0.5, default=None, gt=0,
        le=1e12,
    )  # fmt: skip

    if TYPE_CHECKING:

        def __init__(
            self, name: str, measured: Mapping[str, float], setpoint: float | Signal, output: str,
            proportional: float = 0.0, integral: float = 0.0, derivative: float = 0.0,
            filter_time: float | None = None, limits: tuple[float, float] | None = None,
            sample_time: float | None = None, delay: int = 0, resolution: float | None = None,
        ) -> None: ...  # fmt: skip

    @model_validator(mode="after")
    def _consistent(self) -> Controller:
        if self.derivative != 0.0 and self.filter_time is None and self.sample_time is None:
            raise self._wrong(
                "filter_time", "a time if there is a derivative gain",
                "Give, for example, filter_time=0.01, or measure a speed instead of an angle.",
            )  # fmt: skip
        if self.limits is not None and not (
            -_LARGEST <= self.limits[0] < self.limits[1] <= _LARGEST
        ):
            raise self._wrong("limits", "a lower and a higher output, (low, high)")
        for one, empty in (("delay", 0), ("resolution", None)):
            if self.sample_time is None and getattr(self, one) != empty:
                raise self._wrong(
                    one, "left out without a sample_time",
                    "Give the time between two samples, for example, sample_time=0.001.",
                )  # fmt: skip
        return self

    @property
    def acts_on(self) -> tuple[str, str]:
        """Name of the part on which it acts, and ``COMMAND`` or ``TORQUE``."""
        part, _, what = self.output.rpartition(".")
        return part, what

    @property
    def memory(self) -> tuple[str, ...]:
        """Names of its states, in the order of the state of a machine.

        Of a continuous controller: "integral", the integral part of the output, and "filter", the
        filtered error. Of a digital controller: "output"; "integral"; "rate", the derivative part
        of the output; "error", that at the last sample; and "later", the outputs that are delayed.
        """
        found = ["integral"] if self.integral != 0.0 else []
        if self.sample_time is None:
            return (*found, *(["filter"] if self.derivative != 0.0 else []))
        found += ["rate", "error"] if self.derivative != 0.0 else []
        return ("output", *found, *["later"] * self.delay)
