"""The [run] table of a study: how long a system is simulated, and how."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar, Literal, get_args

from pydantic import Field, model_validator

from wedgebrake.model.part import Part, given, parameter

Method = Literal["exact", "smooth", "ode14x"]
METHODS: tuple[str, ...] = get_args(Method)
_State = Annotated[float, Field(ge=-1e12, le=1e12)]


class Run(Part):
    """Arguments of ``wb.simulate``, with its defaults."""

    table: ClassVar[str] = "run"

    duration: float | None = parameter(
        "length of the run", unit="s", example=25.0, default=None, ge=0, le=1e12
    )
    periods: int | None = parameter(
        "length of the run in periods of the torque (250, without duration)",
        example=250, default=None, gt=0, le=1_000_000_000,
    )  # fmt: skip
    initial: tuple[_State, _State] = parameter(
        "angle [rad] and velocity [rad/s] at the start", symbol="theta, theta'", unit="-",
        example=[0.0, 0.0], default=(0.0, 0.0), strict=False,
    )  # fmt: skip
    start_time: float = parameter(
        "time of the start (it sets the phase of the torque)", symbol="t_0", unit="s",
        example=0.0, default=0.0, ge=0, le=1e12,
    )  # fmt: skip
    method: Method | None = parameter(
        "the solver (default: by the friction law)", unit="-", example="exact", default=None
    )
    samples_per_period: int = parameter(
        "samples in a period of the torque", example=200, default=200, gt=0, le=50_000_000
    )
    rtol: float = parameter(
        "relative tolerance of the method smooth", example=1e-9, default=1e-9, ge=1e-13, le=1e-2
    )
    step: float = parameter(
        "fixed step of the method ode14x", unit="s", example=1e-4, default=1e-4, ge=1e-9, le=1
    )
    max_events: int = parameter(
        "most events of the method exact", example=10_000_000, default=10_000_000,
        gt=0, le=1_000_000_000_000,
    )  # fmt: skip
    max_steps: int = parameter(
        "most steps of the methods smooth and ode14x", example=100_000_000, default=100_000_000,
        gt=0, le=1_000_000_000_000,
    )  # fmt: skip

    @model_validator(mode="after")
    def _one_length(self) -> Run:
        if self.duration is not None and self.periods is not None:
            raise ValueError(
                f"run.duration = {self.duration!r} and run.periods = {self.periods!r}: both"
                " given, but one says how long. Remove one of them."
            )
        return self

    def arguments(self) -> dict[str, Any]:
        """Keyword arguments of ``wb.simulate``."""
        without = self.duration is None and self.periods is None
        return {**dict(self), "periods": 250} if without else dict(self)


class MachineRun(Part):
    """Arguments of ``wb.simulate`` for a machine, with its defaults."""

    table: ClassVar[str] = "run"

    duration: float = parameter(
        "length of the run", unit="s", example=10.0, default=10.0, ge=0, le=1e12
    )
    until: Literal["rest"] | None = parameter(
        "'rest': end the run as soon as all contacts stick and none will slip again",
        unit="-", example="rest", default=None,
    )  # fmt: skip
    start_time: float = parameter(
        "time of the start", symbol="t_0", unit="s", example=0.0, default=0.0, ge=0, le=1e12
    )
    method: Literal["exact", "smooth"] | None = parameter(
        "the solver: friction over the speed as straight lines (exact, the default) or as a curve",
        unit="-",
        example="exact",
        default=None,
    )
    max_events: int = parameter(
        "most events", example=10_000_000, default=10_000_000, gt=0, le=1_000_000_000_000
    )

    def arguments(self) -> dict[str, Any]:
        """Keyword arguments of ``wb.simulate``: the duration and the given settings."""
        return {"duration": self.duration, **given(self)}
