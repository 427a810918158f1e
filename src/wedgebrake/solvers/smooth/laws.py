"""Friction and brake laws as compiled functions of one type, for the kernels."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

from numba import types
from numba.core import config

from wedgebrake.dynamics.brake_torque import LAW_SIGNATURE, SHAPE_SIZE, gather
from wedgebrake.dynamics.compilation import switched_on
from wedgebrake.dynamics.jit import dispatcher_of
from wedgebrake.errors import InputError
from wedgebrake.model.brakes import Brake
from wedgebrake.model.friction import CustomFriction, SmoothFriction

Shape = tuple[float, ...]


@cache
def compiled_law(function: Callable[..., float], size: int) -> Any:
    """``function(x, shape) -> float`` compiled for the kernels.

    size : number of values in ``shape``

    Raises ``InputError`` where Numba cannot compile it.
    """
    # Only our own laws are cached on disk: Numba would not notice a change in another file
    # that a user's law calls.
    if function.__module__.startswith("wedgebrake."):
        return _compile(function, LAW_SIGNATURE, kept=True)
    # A user's law may unpack its shape, which kernels fill up with zeros.
    sized = types.UniTuple(types.float64, size) if size else types.Tuple(())  # type: ignore[no-untyped-call]
    inner = _compile(function, types.float64(types.float64, sized))

    def law(x: float, shape: Shape) -> float:
        return float(inner(x, shape[:size]))

    law.__qualname__ = _name(function)
    return _compile(law, LAW_SIGNATURE)


@cache
def _custom_law(function: Callable[[float], float]) -> Any:
    """A user's m(v_r), a straight line near rest, with the shape of ``CustomFriction``."""
    compiled = hasattr(function, "py_func")
    scalar = function if compiled else _compile(function, types.float64(types.float64))

    def law(speed: float, shape: Shape) -> float:
        if abs(speed) < shape[0]:
            return speed * (shape[1] if speed >= 0.0 else shape[2])
        return float(scalar(speed))

    law.__qualname__ = _name(function)
    return _compile(law, LAW_SIGNATURE)


def _compile(function: Callable[..., float], signature: Any, *, kept: bool = False) -> Any:
    try:
        dispatcher = dispatcher_of(function, kept=kept, error_model="numpy")
        with switched_on():
            dispatcher.compile(signature)
        dispatcher.disable_compile()
        return dispatcher
    except Exception as error:  # whatever Numba stumbles on, not only its own errors
        lines = [line.strip() for line in str(error).splitlines() if line.strip()]
        reasons = [line for line in lines if not line.startswith("Failed in ")]
        reason = reasons[0].rstrip(".") if reasons else type(error).__name__
        off = vars(config)["DISABLE_JIT"]
        switch = " NUMBA_DISABLE_JIT is set, with which njit does nothing: unset it." if off else ""
        raise InputError.of(
            "law", function, f"Numba cannot compile it ({reason}). Use numbers and functions of the"
            " math module only, and numba.njit on functions of your own that it calls."
            f"{switch}", said=_name(function),
        ) from None  # fmt: skip


def _name(function: Callable[..., float]) -> str:
    return str(getattr(function, "__qualname__", function))


def friction_law(friction: SmoothFriction) -> tuple[Any, Shape]:
    """(compiled m(v_r, shape), shape) of a smooth friction law."""
    if isinstance(friction, CustomFriction):
        return _custom_law(friction.law), _padded(friction.shape())
    law, shape = getattr(type(friction), "law", None), friction.shape()
    if law is None:
        raise InputError.of(
            "friction", friction, "has no law. State law(speed, shape) as a static method, as"
            " SmoothedFriction does, or use CustomFriction with your function.",
            allowed="a friction with a law", said=type(friction).__name__,
        )  # fmt: skip
    padded = _padded(shape)
    return compiled_law(law, len(shape)), padded


def brake_law(brake: Brake) -> tuple[Any, Shape]:
    """(compiled g(m, shape), shape) of a brake."""
    shape = brake.shape()
    padded = _padded(shape)
    return compiled_law(type(brake).law, len(shape)), padded


@cache
def gathered(friction: Any, brake: Any) -> Any:
    """Two compiled laws as the list that kernels take which are called often."""
    with switched_on():  # for lists of Numba too
        return gather(friction, brake)


def _padded(shape: Shape) -> Shape:
    if len(shape) > SHAPE_SIZE:
        raise InputError.of(
            "shape", shape, f"must have at most {SHAPE_SIZE} numbers. Combine them in shape().",
            allowed=f"at most {SHAPE_SIZE} numbers",
        )  # fmt: skip
    return (*(float(number) for number in shape), *[0.0] * (SHAPE_SIZE - len(shape)))
