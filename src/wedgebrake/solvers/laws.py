"""Friction and brake laws as compiled functions of one type, for the kernels."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

from numba import njit
from numba.core.errors import NumbaError

from wedgebrake._kernels.torque import LAW_SIGNATURE, SHAPE_SIZE
from wedgebrake.errors import InputError
from wedgebrake.model.brakes import Brake
from wedgebrake.model.friction import CustomFriction, SmoothedFriction, SmoothFriction

Shape = tuple[float, ...]


@cache
def compiled_law(function: Callable[..., float]) -> Any:
    """``function(x, shape) -> float`` compiled for the kernels.

    Raises ``InputError`` where Numba cannot compile it.
    """
    # Only our own laws are cached on disk: Numba would not notice a change in another file
    # that a user's law calls.
    ours = function.__module__.startswith("wedgebrake.")
    try:
        return njit(LAW_SIGNATURE, cache=ours, error_model="numpy")(function)
    except NumbaError as error:
        reason = str(error).strip().splitlines()[0]
        raise InputError(
            f"law = {getattr(function, '__qualname__', function)!s}: Numba cannot compile it"
            f" ({reason}). Use numbers and functions of the math module only."
        ) from None


@cache
def _custom_law(function: Callable[[float], float]) -> Any:
    """A user's m(v_r) with the second argument that all laws take."""
    scalar = function if hasattr(function, "py_func") else njit(error_model="numpy")(function)

    def law(speed: float, shape: Shape) -> float:  # noqa: ARG001 - the common signature
        return float(scalar(speed))

    return compiled_law(law)


def friction_law(friction: SmoothFriction) -> tuple[Any, Shape]:
    """(compiled m(v_r, shape), shape) of a smooth friction law."""
    if isinstance(friction, SmoothedFriction):
        return compiled_law(SmoothedFriction.law), _padded(friction.shape())
    if isinstance(friction, CustomFriction):
        return _custom_law(friction.law), _padded(())
    raise InputError(
        f"friction = {type(friction).__name__}: not a law that the solver knows. Use"
        " SmoothedFriction, or CustomFriction with your own function."
    )


def brake_law(brake: Brake) -> tuple[Any, Shape]:
    """(compiled g(m, shape), shape) of a brake."""
    return compiled_law(type(brake).law), _padded(brake.shape())


def _padded(shape: Shape) -> Shape:
    if len(shape) > SHAPE_SIZE:
        raise InputError(
            f"shape = {shape!r}: must have at most {SHAPE_SIZE} numbers. Combine them in shape()."
        )
    return (*(float(number) for number in shape), *[0.0] * (SHAPE_SIZE - len(shape)))
