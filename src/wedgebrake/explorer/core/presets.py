"""Machines by name, as listed on the page: those to begin with, and the paper's figures."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from types import MappingProxyType
from typing import Any

from wedgebrake.explorer.core.fields import symbol
from wedgebrake.explorer.core.state import PageState, PageView
from wedgebrake.figures.style import number
from wedgebrake.model.driveline import Driveline
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
)
from wedgebrake.model.signals.excitation import HarmonicTorque
from wedgebrake.model.studies.examples import example_files, first_sentence
from wedgebrake.model.studies.study import RunSettings, Study, load_study
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.model.validation import check_choice

START = "start"
"""Name of the initial preset."""

_FIRST, _PARTS, _RESPONSES, _DIAGRAMS = (
    "Machines to begin with",
    "Machines of several parts",
    "Responses of the paper",
    "Diagrams of the paper",
)
# Examples by the names of their presets, each with the parameter of its diagram.
_EXAMPLES = {
    "falling-friction": ("falling_friction", "damping"),
    "clutch": ("clutch_judder", "drive_speed"),
    "band": ("band", "drive_speed"),
    "leading-shoe": ("leading_shoe", "slope"),
    "self-locking": ("self_locking", "angle"),
}
# Examples of machines of several parts.
_MACHINES = (
    "electronic_wedge", "clutch", "driveline", "recorded", "shift", "tip_in", "torque_control",
    "rattle", "ratchet", "squeal",
)  # fmt: skip
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
    return PRESETS[check_choice("preset", name, PRESETS)]


def _of_case(case: Case, over: str, assumptions: Assumptions = CORRECTED) -> PageState:
    """A case of the paper as the paper runs it, with the diagram that contains it."""
    plan = DIAGRAMS[over]
    spans = MappingProxyType({plan.name: (plan.low, plan.high)})
    system = assumptions.system(case, "coulomb")
    return PageState.of(
        Study(system, RunSettings(duration=DURATION)), PageView(axis=plan.name, spans=spans)
    )


def _responses() -> Iterator[Preset]:
    for figure, rows in RESPONSES.items():
        for letter, case in zip("abcdef", rows.cases, strict=False):
            title = f"Fig. {figure} {letter}: {_title(case, rows.varied)}"
            make = partial(_of_case, case, _OVER[rows.varied[-1]])
            yield Preset(f"fig{figure}{letter}", title, _RESPONSES, make)
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
    return f"{symbol(name)} = {number(value)}"


def _diagrams() -> Iterator[Preset]:
    for name, plan in DIAGRAMS.items():
        figure = f"{name[:-1]} {name[-1]}" if name[-1].isalpha() else name
        ends = f"{number(plan.low)} to {number(plan.high)}"
        title = f"Fig. {figure}: {plan.base.brake} over {symbol(plan.name)}, {ends}"
        yield Preset(f"fig{name}", title, _DIAGRAMS, partial(_of_case, plan.base, name))


def _first() -> Iterator[Preset]:
    paths = example_files()
    title = f"Start here: {_title(Case(), ('eta',))}"
    yield Preset(START, title, _FIRST, partial(_of_case, Case(), "8a"))
    yield Preset("belt", first_sentence(paths["belt"]), _FIRST, partial(_of_belt, paths["belt"]))
    for name, (example, axis) in _EXAMPLES.items():
        path = paths[example]
        yield Preset(name, first_sentence(path), _FIRST, partial(_of_example, path, axis))


def _machines() -> Iterator[Preset]:
    for example in _MACHINES:
        path = example_files()[example]
        make = partial(_of_machine, path)
        yield Preset(f"machine-{example}", first_sentence(path), _PARTS, make)


def _of_machine(path: Path) -> PageState:
    return PageState.of(load_study(path))


def _of_example(path: Path, axis: str) -> PageState:
    study = load_study(path)
    run = RunSettings(initial=study.run.initial)
    return PageState.of(Study(study.system, run), PageView(axis=axis))


def _of_belt(path: Path) -> PageState:
    """A mass on a belt as a driveline whose shaft turns like the belt.

    The angle counts in the direction opposite to that of the machine, so that the mass slides
    forwards.
    """
    study: Any = load_study(path)
    (mass,), (spring,), (contact,) = (
        study.system.inertias, study.system.shafts, study.system.contacts,
    )  # fmt: skip
    line = Driveline(
        inertia=mass.inertia, damping=spring.damping, stiffness=spring.stiffness,
        drive_speed=contact.base_speed,
    )  # fmt: skip
    torque = HarmonicTorque(amplitude=0.0, frequency=line.natural_frequency / (2.0 * math.pi))
    system = BrakedDriveline(
        driveline=line, brake=contact.brake, friction=contact.friction,
        actuation=contact.actuation, excitation=torque,
    )  # fmt: skip
    ((_, speeds),) = study.sweep.parameters().items()
    spans = MappingProxyType({"drive_speed": (float(speeds[0]), float(speeds[-1]))})
    return PageState.of(Study(system, RunSettings()), PageView(axis="drive_speed", spans=spans))


PRESETS: dict[str, Preset] = {
    one.name: one for one in (*_first(), *_machines(), *_responses(), *_diagrams())
}
"""All presets, in the order of a list."""
