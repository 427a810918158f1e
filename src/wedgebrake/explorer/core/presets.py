"""Machines by name, as listed on the page: the paper's figures, and other brakes."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from types import MappingProxyType

from wedgebrake.explorer.core.fields import symbol
from wedgebrake.explorer.core.state import PageState, View
from wedgebrake.figures.style import number
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
from wedgebrake.model.studies.examples import example_files, first_sentence
from wedgebrake.model.studies.study import Run, Study, load_study
from wedgebrake.model.validation import check_choice

START = "start"
"""Name of the initial preset."""

_RESPONSES, _DIAGRAMS, _OTHERS = (
    "Responses of the paper",
    "Diagrams of the paper",
    "Other machines",
)
_EXAMPLES = ("band", "leading_shoe", "self_locking", "falling_friction")
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
    return PageState.of(Study(system, Run(duration=DURATION)), View(axis=plan.name, spans=spans))


def _responses() -> Iterator[Preset]:
    title = f"Start here: {_title(Case(), ('eta',))}"
    yield Preset(START, title, _RESPONSES, partial(_of_case, Case(), "8a"))
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


def _others() -> Iterator[Preset]:
    paths = example_files()
    for name in _EXAMPLES:
        title, make = first_sentence(paths[name]), partial(_of_example, paths[name])
        yield Preset(name.replace("_", "-"), title, _OTHERS, make)


def _of_example(path: Path) -> PageState:
    study = load_study(path)
    run = Run(initial=study.run.initial)
    return PageState.of(Study(study.system, run), View(axis="initial_force"))


PRESETS: dict[str, Preset] = {one.name: one for one in (*_responses(), *_diagrams(), *_others())}
"""All presets, in the order of a list."""
