"""The [run] table of a study: how long a system is simulated, and how."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar, Literal, get_args

from pydantic import Field, model_validator

from wedgebrake.errors import InputError
from wedgebrake.model.part import Part, parameter

Method = Literal["exact", "smooth"]
METHODS: tuple[str, ...] = get_args(Method)
_State = Annotated[float, Field(ge=-1e12, le=1e12)]


def _most(meaning: str, default: int) -> Any:
    return parameter(meaning, example=default, default=default, gt=0, le=1_000_000_000_000)


class RunSettings(Part):
    """Arguments of ``wb.simulate``, with its defaults.

    Without ``duration`` and ``periods`` the length of a run is the ``default_length`` of the
    system: 250 periods of a driveline's torque, 10 s of a machine.
    """

    table: ClassVar[str] = "run"

    duration: float | None = parameter(
        "length of the run", unit="s", example=25.0, default=None, ge=0, le=1e12
    )
    periods: int | None = parameter(
        "length of the run in periods of the torque, or in common periods of a machine's signals",
        example=250, default=None, gt=0, le=1_000_000_000,
    )  # fmt: skip
    until: Literal["rest"] | None = parameter(
        "'rest': end the run as soon as all contacts stick and none will slip again",
        unit="-", example="rest", default=None,
    )  # fmt: skip
    initial: tuple[_State, _State] = parameter(
        "angle [rad] and velocity [rad/s] of a driveline at the start", symbol="theta, theta'",
        unit="-", columns=("rad", "rad/s"), example=[0.0, 0.0], default=(0.0, 0.0), strict=False,
    )  # fmt: skip
    start_time: float = parameter(
        "time of the start (it sets the phase of the torque)", symbol="t_0", unit="s", example=0.0,
        default=0.0, ge=0, le=1e12,
    )  # fmt: skip
    method: Method | None = parameter(
        "the solver (default: by the friction law)", unit="-", example="exact", default=None
    )
    samples: int | None = parameter(
        "number of samples, at equal distances (default: by the fastest vibration)",
        example=20_000, default=None, ge=2, le=50_000_000,
    )  # fmt: skip
    samples_per_period: int | None = parameter(
        "samples in a period (of a driveline 200, more for faster vibration)",
        example=200, default=None, gt=0, le=50_000_000,
    )  # fmt: skip
    rtol: float = parameter(
        "relative tolerance of the method smooth for drivelines with smooth laws",
        example=1e-9,
        default=1e-9,
        ge=1e-13,
        le=1e-2,
    )
    max_events: int = _most("largest number of events (method exact)", 10_000_000)
    max_steps: int = _most("largest number of steps (method smooth)", 100_000_000)

    @model_validator(mode="after")
    def _each_once(self) -> RunSettings:
        if self.duration is not None and self.periods is not None:
            raise InputError(
                f"run.duration = {self.duration!r} and run.periods = {self.periods!r}: both"
                " given, but one says how long. Remove one of them.",
                name="run.periods", value=self.periods, allowed="left out with duration",
            )  # fmt: skip
        if self.samples is not None and self.samples_per_period is not None:
            raise InputError(
                f"run.samples = {self.samples!r} and run.samples_per_period ="
                f" {self.samples_per_period!r}: both given. Remove one of them.",
                name="run.samples_per_period", value=self.samples_per_period,
                allowed="left out with samples",
            )  # fmt: skip
        return self
