"""Laws of users that push, or are no static methods; a force below zero releases a brake."""

from __future__ import annotations

import math
from typing import Any

import pytest

import wedgebrake as wb
from machines import contact, single
from wedgebrake.errors import InputError


def test_a_brake_that_pushes_is_refused() -> None:
    class Pushing(wb.Brake):
        @staticmethod
        def law(m: float, shape: Any) -> float:  # noqa: ARG004
            return -m

    with pytest.raises(InputError, match="sign") as refused:
        Pushing(radius=0.1)
    assert (refused.value.name, refused.value.value) == ("brake.law", 0.1)


def test_a_smooth_law_that_pushes_is_refused() -> None:
    class Pushing(wb.SmoothFriction):
        @staticmethod
        def law(speed: float, shape: Any) -> float:  # noqa: ARG004
            return -math.tanh(speed)

    with pytest.raises(InputError, match="sign"):
        Pushing()


@pytest.mark.parametrize("base", [wb.Brake, wb.SmoothFriction])
def test_a_law_that_is_no_static_method_is_refused(base: Any) -> None:
    with pytest.raises(InputError, match="@staticmethod"):
        type("Plain", (base,), {"law": lambda _self, m: m, "__module__": __name__})


@pytest.mark.parametrize("slope", [0.0, -40.0, 40.0])
@pytest.mark.parametrize(
    "friction",
    [
        wb.TabulatedFriction(speeds=[0.0, 0.1, 1.0], coefficients=[0.4, 0.35, 0.3]),
        wb.StribeckFriction(kinetic=0.3, static=0.4, speed=0.1),
    ],
)
def test_a_force_below_zero_releases_the_brake(friction: Any, slope: float) -> None:
    """With a slope of 40 N s/rad it presses from 2.5 rad/s on."""
    held = contact("disc", friction=friction, force=wb.Constant(-100.0), slope=slope)
    found = wb.simulate(single(held, name="disc", inertia=1.0, speed=-1.0), 1.0)
    assert float(found["velocity"][-1, 0]) == -1.0
