"""Machines by name, as listed on the page: the paper's figures, and other brakes."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from types import MappingProxyType
from typing import Any

from wedgebrake.errors import InputError, nearest
from wedgebrake.explorer.core.state import PageState, View
from wedgebrake.model.actuation import Actuation
from wedgebrake.model.brakes import BandBrake, ConventionalBrake, LeadingShoeBrake, WedgeBrake
from wedgebrake.model.driveline import Driveline
from wedgebrake.model.excitation import HarmonicTorque
from wedgebrake.model.friction import CoulombFriction, TabulatedFriction
from wedgebrake.model.paper_machines import (
    AS_PRINTED,
    CORRECTED,
    DIAGRAMS,
    DURATION,
    HERTZ,
    KINETIC,
    RESPONSES,
    Assumptions,
    Case,
    Range,
)
from wedgebrake.model.study import Run, Study
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.model.validation import shown

START = "start"
"""Name of the initial preset."""

_RESPONSES, _DIAGRAMS, _OTHERS = (
    "Responses of the paper",
    "Diagrams of the paper",
    "Other machines",
)
_SYMBOLS = {"eta": "η", "f": "f", "F0": "F₀", "alpha": "α"}
# The diagram that contains the cases of a figure.
_OVER = {"eta": "8a", "F0": "11a", "f": "14a", "alpha": "17"}


@dataclass(frozen=True)
class Preset:
    """A state of the page by name.

    name  : as in "fig9c"
    title : its text in the list
    group : heading in the list
    state : function that returns the state
    """

    name: str
    title: str
    group: str
    state: Callable[[], PageState]


def preset(name: str) -> Preset:
    """The preset of a name; raises ``InputError`` for an unknown name."""
    if not isinstance(name, str) or name not in PRESETS:
        raise InputError(f"preset = {shown(name)}: not known. {nearest(str(name), PRESETS)}")
    return PRESETS[name]


def _of_case(case: Case, over: str, assumptions: Assumptions = CORRECTED) -> PageState:
    """A case of the paper as the paper runs it, with the diagram that contains it."""
    plan = DIAGRAMS[over]
    spans = MappingProxyType({plan.name: (plan.low, plan.high)})
    system = assumptions.system(case, "coulomb")
    return PageState.of(Study(system, Run(duration=DURATION)), View(axis=plan.name, spans=spans))


def _responses() -> Iterator[Preset]:
    title = f"Start here: {_title(Case(), ('eta',))}"
    yield Preset(START, title, _RESPONSES, partial(_of_case, Case(), "8a"))
    for number, rows in RESPONSES.items():
        for letter, case in zip("abcdef", rows.cases, strict=False):
            title = f"Fig. {number} {letter}: {_title(case, rows.varied)}"
            make = partial(_of_case, case, _OVER[rows.varied[-1]])
            yield Preset(f"fig{number}{letter}", title, _RESPONSES, make)
    title = "Fig. 9 b with the parameters as printed: diverges"
    make = partial(_of_case, RESPONSES[9].cases[1], "8a", AS_PRINTED)
    yield Preset("as-printed", title, _RESPONSES, make)


def _title(case: Case, varied: tuple[str, ...]) -> str:
    """The brake and the parameters that distinguish the case: "wedge, η = −30"."""
    return ", ".join([case.brake, *(_equation(name, getattr(case, name)) for name in varied)])


def _equation(name: str, value: float) -> str:
    hertz = value / HERTZ
    if name == "f" and math.isclose(hertz, round(hertz)):
        return f"f = {value:.2g} ({round(hertz)} Hz)"
    if name == "alpha":
        return f"angle {math.atan(value * KINETIC):.2g} rad"
    return f"{_SYMBOLS[name]} = {value:g}".replace("-", "−")


def _diagrams() -> Iterator[Preset]:
    for name, plan in DIAGRAMS.items():
        number = f"{name[:-1]} {name[-1]}" if name[-1].isalpha() else name
        title = f"Fig. {number}: {_over(plan)}"
        yield Preset(f"fig{name}", title, _DIAGRAMS, partial(_of_case, plan.base, name))


def _over(plan: Range) -> str:
    """Describe a diagram: "wedge over η, −120 to 12"."""
    ends = f"{plan.low:g} to {plan.high:g}".replace("-", "−")
    return f"{plan.base.brake} over {_SYMBOLS[plan.name]}, {ends}"


def _others() -> Iterator[Preset]:
    for name, (title, initial, *parts) in _MACHINES.items():
        driveline, brake, friction, actuation, excitation = parts
        system = BrakedDriveline(
            driveline=driveline, brake=brake, friction=friction, actuation=actuation,
            excitation=excitation,
        )  # fmt: skip
        study, view = Study(system, Run(initial=initial)), View(axis="initial_force")
        yield Preset(name, title, _OTHERS, partial(PageState.of, study, view))


# Title, initial state and parts of the machines that are not from the paper.
_MACHINES: dict[str, tuple[Any, ...]] = {
    "band": (
        "Band brake on a turning shaft: stick-slip without a torque",
        (0.0, -2.0),  # at rest relative to the drum
        Driveline(inertia=1.0, damping=0.02, stiffness=1e4, drive_speed=2.0),
        BandBrake(radius=0.2, wrap_angle=4.0),
        CoulombFriction(kinetic=0.25, static=0.30),
        Actuation(initial_force=300.0),
        HarmonicTorque(amplitude=0.0, frequency=15.0),
    ),
    "leading-shoe": (
        "Leading shoe brake, its force falls with speed",
        (0.0, 0.0),
        Driveline(inertia=1.0, damping=0.1, stiffness=1e4),
        LeadingShoeBrake(radius=0.2, actuation_arm=0.2, normal_arm=0.1, friction_arm=0.08),
        CoulombFriction(kinetic=0.30),
        Actuation(initial_force=300.0, slope=-40.0),
        HarmonicTorque(amplitude=500.0, frequency=10.0),
    ),
    "self-locking": (
        "Wedge so acute that it locks itself",
        (0.0, 0.0),
        Driveline(inertia=1.0, damping=0.1, stiffness=1e4),
        WedgeBrake(angle=0.28, radius=0.2),  # tan(0.28 rad) < kinetic
        CoulombFriction(kinetic=0.30, static=0.33),
        Actuation(initial_force=300.0, slope=-40.0),
        HarmonicTorque(amplitude=500.0, frequency=10.0),
    ),
    "falling-friction": (
        "Friction that falls with speed: judder at 10 Hz",
        (-0.02, 0.0),
        Driveline(inertia=1.0, damping=0.5, stiffness=4e3, drive_speed=3.0),
        ConventionalBrake(radius=0.2),
        TabulatedFriction(
            speeds=(0.0, 0.2, 0.5, 1.0, 2.0), coefficients=(0.45, 0.40, 0.35, 0.31, 0.29)
        ),
        Actuation(initial_force=1000.0),
        HarmonicTorque(amplitude=0.0, frequency=10.0),
    ),
}
PRESETS: dict[str, Preset] = {one.name: one for one in (*_responses(), *_diagrams(), *_others())}
"""All presets, in the order of a list."""
