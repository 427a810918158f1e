"""The [run] table of a study: how long a system is simulated, and how."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar, Literal, get_args

from pydantic import Field, model_validator

from wedgebrake.model.groups import SETTERS
from wedgebrake.model.part import Part, given, parameter

Method = Literal["exact", "smooth"]
METHODS: tuple[str, ...] = get_args(Method)
_State = Annotated[float, Field(ge=-1e12, le=1e12)]


_NO_TOLERANCE = "the solver of machines has neither a tolerance nor a limit of steps. Leave it out."


def _start_time(meaning: str) -> Any:
    return parameter(meaning, symbol="t_0", unit="s", example=0.0, default=0.0, ge=0, le=1e12)


def _samples() -> Any:
    return parameter(
        "number of samples, at equal distances (default: by the fastest vibration)",
        example=20_000, default=None, ge=2, le=50_000_000,
    )  # fmt: skip


def _most(meaning: str, default: int) -> Any:
    return parameter(meaning, example=default, default=default, gt=0, le=1_000_000_000_000)


class Run(Part):
    """Arguments of ``wb.simulate``, with its defaults."""

    table: ClassVar[str] = "run"
    absent: ClassVar[dict[str, str]] = {}
    """Names that belong to the other kind of system, and what to give instead."""

    duration: float | None = parameter(
        "length of the run", unit="s", example=25.0, default=None, ge=0, le=1e12
    )
    periods: int | None = parameter(
        "length of the run in periods of the torque (250, without duration)",
        example=250, default=None, gt=0, le=1_000_000_000,
    )  # fmt: skip
    initial: tuple[_State, _State] = parameter(
        "angle [rad] and velocity [rad/s] at the start", symbol="theta, theta'", unit="-",
        columns=("rad", "rad/s"), example=[0.0, 0.0], default=(0.0, 0.0), strict=False,
    )  # fmt: skip
    start_time: float = _start_time("time of the start (it sets the phase of the torque)")
    method: Method | None = parameter(
        "the solver (default: by the friction law)", unit="-", example="exact", default=None
    )
    samples: int | None = _samples()
    samples_per_period: int | None = parameter(
        "samples in a period of the torque (200, more for faster vibration)",
        example=200, default=None, gt=0, le=50_000_000,
    )  # fmt: skip
    rtol: float = parameter(
        "relative tolerance of the method smooth", example=1e-9, default=1e-9, ge=1e-13, le=1e-2
    )
    max_events: int = _most("largest number of events (method exact)", 10_000_000)
    max_steps: int = _most("largest number of steps (method smooth)", 100_000_000)

    @model_validator(mode="after")
    def _each_once(self) -> Run:
        if self.duration is not None and self.periods is not None:
            raise ValueError(
                f"run.duration = {self.duration!r} and run.periods = {self.periods!r}: both"
                " given, but one says how long. Remove one of them."
            )
        if self.samples is not None and self.samples_per_period is not None:
            raise ValueError(
                f"run.samples = {self.samples!r} and run.samples_per_period ="
                f" {self.samples_per_period!r}: both given. Remove one of them."
            )
        return self

    def arguments(self) -> dict[str, Any]:
        """Keyword arguments of ``wb.simulate``."""
        without = self.duration is None and self.periods is None
        return {**dict(self), "periods": 250} if without else dict(self)


class MachineRun(Part):
    """Arguments of ``wb.simulate`` for a machine, with its defaults."""

    table: ClassVar[str] = "run"
    absent: ClassVar[dict[str, str]] = {
        "periods": "a machine may have no period. Give duration, in seconds.",
        "samples_per_period": "a machine may have no period. Give samples, their number.",
        "initial": "belongs to drivelines. Give the angle and speed of an inertia (disc.speed=30).",
        **dict.fromkeys(("rtol", "max_steps"), _NO_TOLERANCE),
        **dict.fromkeys(
            SETTERS,
            "groups belong to a brake on a driveline. Set a parameter of the machine, for example"
            " brake.slope.",
        ),
    }

    duration: float = parameter(
        "length of the run", unit="s", example=10.0, default=10.0, ge=0, le=1e12
    )
    until: Literal["rest"] | None = parameter(
        "'rest': end the run as soon as all contacts stick and none will slip again",
        unit="-", example="rest", default=None,
    )  # fmt: skip
    start_time: float = _start_time("time of the start")
    samples: int | None = _samples()
    method: Method | None = parameter(
        "the solver: friction over the speed as straight lines (exact, the default if it applies)"
        " or as a curve (smooth)",
        unit="-",
        example="exact",
        default=None,
    )
    max_events: int = _most("largest number of events", 10_000_000)

    def arguments(self) -> dict[str, Any]:
        """Keyword arguments of ``wb.simulate``: the duration and the given settings."""
        return {"duration": self.duration, **given(self)}
