"""Two published drivelines with clutches: as 40-digit lines, as plain machines, and their events.

``FRICTION``: three inertias, a clutch and a brake, after the example "Friction" of Modelica's
Rotational library. ``COUPLED``: four equal inertias in a row with three clutches, after its
"CoupledClutches": the first inertia turns at 10 rad/s and is driven by 10 sin(2 pi 5 t) N m; each
clutch transmits 0.5 times its normal force in motion and 1.1 times that at rest; the first is
pressed by 20 cos(2 pi 0.2 t) N while that is positive, the others by 20 N from 0.4 s and 0.9 s on.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from machine_digits import DIGITS, Clutch, Exact, Line, mp
from machine_reference import Contact, Plain, shaft_matrices

FRICTION_DURATION, COUPLED_DURATION = "3", "1.5"


def friction_line() -> Line:
    """A clutch of 80 N m and, from 0.5 s on, a brake of 800 N m."""
    motor = ((0, ((100, 200, 0),)), ("0.5", ((0, 0, 0),)))
    brake = ((0, ((0, 0, 0),)), ("0.5", ((0, 0, 800),)))
    return Line(
        inertia=(1, "0.05", 1), speed=(90, 90, 100), shafts=((0, 1, 160, 1),),
        contacts=(
            Clutch("clutch", 2, 1, ((0, ((0, 0, 80),)),), 1),
            Clutch("brake", 0, -1, brake, 1),
        ),
        torques=((2, motor),), frequencies=(100,),
    )  # fmt: skip


def coupled_line() -> Line:
    """Four inertias of 1 kg m^2 and three clutches."""
    drive, press = 10 * mp.pi, 2 * mp.pi / 5
    off: Any = (0, ((0, 0, 0),))
    on: Any = ((0, 0, 10),)
    return Line(
        inertia=(1, 1, 1, 1), speed=(10, 0, 0, 0), shafts=(),
        contacts=(
            Clutch("clutch1", 0, 1, ((0, ((press, 0, 10),)), ("1.25", off[1])), "1.1"),
            Clutch("clutch2", 1, 2, (off, ("0.4", on)), "1.1"),
            Clutch("clutch3", 2, 3, (off, ("0.9", on)), "1.1"),
        ),
        torques=((0, ((0, ((drive, 10, 0),)),)),), frequencies=(drive, press),
    )  # fmt: skip


def exact(line: Any, duration: str) -> Exact:
    """A line, given as a function, at 50 digits."""
    with mp.workdps(DIGITS):
        return Exact(line(), duration).run()


def _constant(value: float) -> Any:
    return lambda t: np.full(np.shape(t), value)


def _step(time: float, before: float, after: float) -> Any:
    return lambda t: np.where(t < time, before, after)


def friction_plain() -> Plain:
    """``friction_line`` for the reference integrator."""
    stiffness, damping = shaft_matrices(3, [(0, 1, 160.0, 1.0, 1.0)])
    unit: Any = {"radius": 1.0, "kinetic": (-1.0, 1.0), "static": (-1.0, 1.0)}
    return Plain(
        ("1", "2", "3"), np.array([1.0, 0.05, 1.0]), stiffness, damping, np.zeros(3),
        np.array([90.0, 90.0, 100.0]),
        (
            Contact("clutch", 2, 1, force=_constant(80.0), **unit),
            Contact("brake", 0, -1, force=_step(0.5, 0.0, 800.0), **unit),
        ),
        ((2, lambda t: np.where(t < 0.5, 200.0 * np.sin(100.0 * t), 0.0)),), (0.5,),
    )  # fmt: skip


def coupled_plain() -> Plain:
    """``coupled_line`` for the reference integrator."""
    zero = np.zeros((4, 4))
    common: Any = {"radius": 1.0, "kinetic": (-0.5, 0.5), "static": (-0.55, 0.55)}
    pressed = lambda t: 20.0 * np.cos(0.4 * math.pi * t)  # noqa: E731
    return Plain(
        ("1", "2", "3", "4"), np.ones(4), zero, zero, np.zeros(4), np.array([10.0, 0, 0, 0]),
        (
            Contact("clutch1", 0, 1, force=pressed, **common),
            Contact("clutch2", 1, 2, force=_step(0.4, 0.0, 20.0), **common),
            Contact("clutch3", 2, 3, force=_step(0.9, 0.0, 20.0), **common),
        ),
        ((0, lambda t: 10.0 * np.sin(10.0 * math.pi * t)),), (0.4, 0.9),
    )  # fmt: skip


# (time, contact, kind, side) to 30 digits, as ``exact`` gives them; the tests recompute them.
FRICTION_EVENTS = (
    ("0.00677970887792348502166080503299", 0, "stick", 1),
    ("0.0593392840272794449078948462934", 0, "slip", 1),
    ("0.109289826824369669406490160694", 0, "stick", 1),
    ("0.534248338545656998565169747112", 0, "slip", 1),
    ("0.640613940787513642709064824728", 1, "stick", 1),
    ("1.66364144278899673782516197837", 0, "stick", 1),
)
FRICTION_ANGLES = (
    "54.5504069996378900637289706852",
    "54.3544150337825683066628007329",
    "101.565191063854441772083793527",
)
FRICTION_SPEEDS = (
    "0.0",
    "2.28987147110962196530480469175",
    "2.28987147110962196530480469175",
)

# The third clutch, unpressed between two inertias that stand, counts as at rest until 0.4 s.
COUPLED_EVENTS = (
    ("0.4", 2, "slip", 1),
    ("0.709621474693746663308781030453", 1, "stick", 1),
    ("0.79166235915481600626825795053", 0, "stick", 1),
    ("0.831108506137653244153690091282", 0, "slip", 1),
    ("0.906850192797879715262890621775", 0, "stick", 1),
    ("1.00029585989463866855927184558", 0, "slip", 1),
    ("1.14396749247316596373498280762", 2, "stick", 1),
)
COUPLED_ANGLES = (
    "7.48611909911431007467960445154",
    "4.10713741632947759307454353908",
    "2.7104644362313807194771691666",
    "1.17374387760051762007533413291",
)
COUPLED_SPEEDS = (
    "3.24705827241879500814674096877",
    "2.46318716664959544497626469491",
    "2.46318716664959544497626469491",
    "2.46318716664959544497626469491",
)
